//! Report of a run: its headline beside the paper's numbers, the work of its solvers, and its witness.

use super::{Page, PageTable, Report, fixed};
use serde::Serialize;
use stickslip_analysis::analysis::{HeadlineRow, Summary, Witness, headline};
use stickslip_case::Case;
use stickslip_engine::simulation::SolverWork;
use stickslip_files::SavedRows;

/// Width of a value, which stands next to the paper's.
const VALUE: usize = 27;

#[derive(Serialize)]
pub(crate) struct RunSummary<'a> {
    pub status: &'static str,
    pub file: String,
    /// Origin of the case.
    #[serde(rename = "case")]
    pub source: String,
    pub title: &'a str,
    pub method: &'static str,
    pub rtol: f64,
    /// s.
    pub wall_time: f64,
    /// Computed results, whether saved or not.
    pub summary: &'a Summary,
    pub warnings: &'a [String],
    /// The intact part of the file, if writing failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub saved: Option<SavedRows>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub witness: Option<&'a Witness>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<&'a str>,
    #[serde(skip)]
    pub case: &'a Case,
}

impl Report for RunSummary<'_> {
    fn page(&self) -> Page {
        let (case, summary) = (self.case, self.summary);
        // The end time as in the case, unless the run was interrupted.
        let end = match summary.end == case.output.end_time {
            true => summary.end.to_string(),
            false => format!("{:.9}", summary.end),
        };
        let (method, rtol, wall_time) = (self.method, self.rtol, self.wall_time);
        let how = format!("method {method}, rtol {rtol:e}, t = 0 to {end} s in {wall_time:.3} s of wall time");
        let said = self.witness.map(|witness| {
            let statements = std::iter::once(&witness.statement).chain(&witness.repeated);
            statements.cloned().collect::<Vec<_>>().join("\n")
        });
        Page::new(self.title, how)
            .with(rows(&headline(case, summary)))
            .with(work(&summary.work))
            .with_all(said)
            .with(&*self.file)
    }
}

fn rows(rows: &[HeadlineRow]) -> PageTable {
    if rows.iter().all(|row| row.paper.is_empty()) {
        return PageTable::pairs(rows.iter().map(|row| (row.name, row.value.clone())));
    }
    PageTable::of(rows)
        .text("", |row| row.name)
        .text("this run", |row| below(&row.value))
        .text("paper", |row| row.paper)
        .done()
}

/// A list wrapped to the width of values, so that the paper's values stay near.
fn below(list: &str) -> String {
    let mut text = String::new();
    let mut length = 0;
    for part in list.split_inclusive(", ") {
        if length > 0 && length + part.trim_end().len() > VALUE {
            text.truncate(text.trim_end().len());
            text.push('\n');
            length = 0;
        }
        text.push_str(part);
        length += part.len();
    }
    text
}

fn work(solvers: &[SolverWork]) -> PageTable {
    PageTable::of(solvers)
        .text("solver", |one| one.solver)
        .count("segments", |one| one.segments)
        .number("simulated s", "", fixed(4), |one| one.simulated_time)
        .count("steps", |one| one.steps)
        .count("right-hand sides", |one| one.rhs_evaluations)
        .count("Jacobians", |one| one.jacobian_evaluations)
        .done()
}
