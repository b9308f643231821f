//! Report of a run: its headline beside the paper's numbers, the work of its solvers, and its witness.

use super::{Page, PageTable, Report, below_changes, fixed};
use serde::Serialize;
use stickslip_analysis::analysis::{HeadlineRow, Summary, Witness, headline};
use stickslip_case::Case;
use stickslip_engine::simulation::SolverWork;
use stickslip_files::SavedRows;

#[derive(Serialize)]
pub(crate) struct RunSummary<'a> {
    pub status: &'static str,
    pub file: String,
    /// Origin of the case.
    #[serde(rename = "case")]
    pub source: String,
    pub title: &'a str,
    /// Overrides of the case, in words.
    #[serde(skip_serializing_if = "<[String]>::is_empty")]
    pub changed: &'a [String],
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
        let rows = headline(case, summary);
        // The first row is the events, which are too long for the column next to the paper's.
        let (events, rows) = rows
            .split_first()
            .map_or(("", &[][..]), |(first, rows)| (&*first.value, rows));
        let statements = self
            .witness
            .iter()
            .flat_map(|witness| std::iter::once(&witness.statement).chain(&witness.repeated));
        Page::new(self.title, below_changes(self.changed, format!("{how}\n{events}")))
            .with(table(rows))
            .details([work(&summary.work)])
            .with_lines(statements.chain([&self.file]))
    }
}

/// The main numbers of the run, then all others as details. The first is shown even if there is none.
fn table(rows: &[HeadlineRow]) -> PageTable {
    let is_brief = |(k, row): &(usize, &HeadlineRow)| row.is_main() && (*k == 0 || row.value != "none");
    let (main, others): (Vec<_>, Vec<_>) = rows.iter().enumerate().partition(is_brief);
    let count = main.len();
    let rows: Vec<&HeadlineRow> = main.into_iter().chain(others).map(|(_, row)| row).collect();
    let table = match rows.iter().all(|row| row.paper.is_empty()) {
        true => PageTable::pairs(rows.iter().map(|row| (row.name, row.value.clone()))),
        false => PageTable::of(rows.iter().copied())
            .text("", |row| row.name)
            .text("this run", |row| &row.value)
            .text("paper", |row| row.paper)
            .done(),
    };
    table.brief(count)
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
