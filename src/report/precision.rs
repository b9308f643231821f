//! Report of a work-precision study: the errors and the work of each run.

use super::{NumberFormat, Page, PageTable, Report, exponent, fixed};
use serde::Serialize;
use std::path::Path;
use stickslip_analysis::analysis::headline::or_none;
use stickslip_analysis::analysis::work_precision::{Measurement, MethodErrors, PrecisionStudy, StudyResult};
use stickslip_system::quote::bound;

const LEGEND: &str = "onset, final, all: errors of the first stick, of the last and the largest of all events, s; calls of the\n\
                      right-hand side; time in s. Another sequence of events than the reference's is marked *, and has no \"all\".";

#[derive(Serialize)]
pub(crate) struct PrecisionReport<'a> {
    status: &'static str,
    file: String,
    figures: Vec<String>,
    title: &'a str,
    case: String,
    reference: ReferenceSummary<'a>,
    runs: &'a [Measurement],
}

#[derive(Serialize)]
struct ReferenceSummary<'a> {
    description: &'a str,
    events: usize,
    /// Uncertainty of each error, s.
    uncertainty: MethodErrors,
}

impl<'a> PrecisionReport<'a> {
    pub fn new(study: &'a PrecisionStudy, result: &'a StudyResult, file: &Path, figures: Vec<String>) -> Self {
        PrecisionReport {
            status: super::status(result.interrupted),
            file: file.display().to_string(),
            figures,
            title: &study.head.title,
            case: study.head.base.label(),
            reference: ReferenceSummary {
                description: &result.reference.description,
                events: result.reference.events.len(),
                uncertainty: result.uncertainty,
            },
            runs: &result.measurements,
        }
    }
}

impl Report for PrecisionReport<'_> {
    fn page(&self) -> Page {
        let ReferenceSummary {
            description,
            events,
            uncertainty: unsure,
        } = &self.reference;
        let [onset, last, all] = [unsure.onset, unsure.final_stick, unsure.largest]
            .map(|error| or_none(error, |e| format!("{} s", bound(e, 0))));
        Page::new(self.title, format!("{}, {events} events", self.case))
            .with(most_accurate(self.runs))
            .details([table(self.runs, unsure)])
            .details([format!(
                "{LEGEND}\nReference: {description}.\nIts uncertainty is {onset} (onset), {last} (final), {all} (all); an error in \
                 brackets is below it."
            )])
            .with_lines(std::iter::once(&self.file).chain(&self.figures))
    }
}

/// The most accurate run of each method.
fn most_accurate(runs: &[Measurement]) -> PageTable {
    let mut best: Vec<&Measurement> = Vec::new();
    for run in runs {
        let Some(error) = run.errors.largest.filter(|_| run.failure.is_none()) else {
            continue;
        };
        match best.iter_mut().find(|known| known.method == run.method) {
            Some(known) if known.errors.largest.is_some_and(|least| least <= error) => {}
            Some(known) => *known = run,
            None => best.push(run),
        }
    }
    PageTable::of(best)
        .text("most accurate run", |run| run.method.name())
        .count("rtol", |run| {
            run.knob.rtol_and_step().0.map(|x| format!("{x:e}")).unwrap_or_default()
        })
        .number("largest error", "s", exponent(1), |run| run.errors.largest)
        .count("calls", |run| run.rhs_evaluations)
        .number("time", "s", fixed(3), |run| run.wall_time)
        .done()
        .brief(8)
}

fn table(runs: &[Measurement], unsure: &MethodErrors) -> PageTable {
    const TIME: NumberFormat = fixed(3).or("");
    let plain = |value: Option<f64>| value.map(|x| format!("{x:e}")).unwrap_or_default();
    let done = |run: &Measurement, text: String| if run.failure.is_none() { text } else { String::new() };
    let error = |run: &Measurement, of: fn(&MethodErrors) -> Option<f64>| match (of(&run.errors), of(unsure)) {
        (None, _) => done(run, "-".to_owned()),
        (Some(e), Some(u)) if e <= u => format!("({e:.0e})"),
        (Some(e), _) => format!("{e:.1e}"),
    };
    let onset = |run: &Measurement| match &run.failure {
        Some(_) => "failed".to_owned(),
        None => error(run, |errors| errors.onset),
    };
    let other = |run: &Measurement| if run.same_sequence { "" } else { "*" };
    PageTable::of(runs)
        .text("method", |run| run.method.name())
        .count("rtol", |run| plain(run.knob.rtol_and_step().0))
        .count("step", |run| plain(run.knob.rtol_and_step().1))
        .count("onset", onset)
        .count("final", |run| done(run, error(run, |errors| errors.final_stick)))
        .count("all", |run| done(run, error(run, |errors| errors.largest)))
        .count("events", |run| done(run, format!("{}{}", run.events, other(run))))
        .count("calls", |run| done(run, run.rhs_evaluations.to_string()))
        .count("time", |run| {
            TIME.print(Some(run.wall_time).filter(|_| run.failure.is_none()))
        })
        .done()
}
