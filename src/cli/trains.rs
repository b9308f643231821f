//! `stickslip run` of two trains.

use super::arguments::{Common, RunOptions};
use super::progress::RunBar;
use super::run::{Given, bad_case, bad_file, default_output, finish, interrupt_flag};
use super::{CommandError, End, complain, print, print_json, terminal};
use crate::analysis::trains::{Attractor, Outcome};
use crate::analysis::{SavedTrainReport, SavedTrainRun, TrainSummary};
use crate::case::{Motion, Override, TrainCase};
use crate::hybrid::RunError;
use crate::results::{Overwrite, SavedRows};
use serde::Serialize;
use std::ops::ControlFlow;

/// The JSON document of a run: complete, interrupted or failed.
#[derive(Serialize)]
struct RunDocument<'a> {
    /// As in the file: complete, interrupted or failed.
    status: &'a str,
    /// The result, or the partial file of a run that is not complete.
    file: String,
    /// Where the case is from.
    case: String,
    title: &'a str,
    method: &'a str,
    rtol: f64,
    /// s.
    wall_time: f64,
    summary: &'a TrainSummary,
    #[serde(skip_serializing_if = "Option::is_none")]
    saved: Option<SavedRows>,
    warnings: &'a [String],
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
}

/// Integrates one case of trains into a result file and reports it.
pub(super) fn run(
    given: &Given,
    changes: &[Override],
    options: &RunOptions,
    common: &Common,
) -> Result<End, CommandError> {
    let case = TrainCase::parse(&given.source, changes).map_err(bad_case)?;
    let path = options.output.clone().unwrap_or_else(|| default_output(&given.source));
    let overwrite = if options.force {
        Overwrite::Force
    } else {
        Overwrite::OwnResults
    };
    let stop = interrupt_flag()?;
    let bar = RunBar::new(common, case.output.end_time);
    let result = SavedTrainRun::new(&case, &path)
        .text(&given.text)
        .overwrite(overwrite)
        .inputs(&given.files)
        .stop(&stop)
        .control(|progress| {
            bar.show(progress);
            ControlFlow::Continue(())
        })
        .start();
    bar.finish();
    let SavedTrainReport {
        file,
        status,
        report,
        summary,
        failure,
        unsaved,
        saved,
        wall_time,
    } = result.map_err(bad_file)?;
    let write_failed = matches!(&failure, Some(failure) if matches!(failure.error, RunError::Observer(_)));
    let unsaved = unsaved.map(|error| error.to_string());
    let status = if unsaved.is_some() { "failed" } else { status.name() };
    let error = unsaved.clone().or_else(|| failure.as_ref().map(ToString::to_string));
    let warnings = warnings(&summary);
    if common.json {
        print_json(&RunDocument {
            status,
            file: file.display().to_string(),
            case: given.source.label(),
            title: &case.title,
            method: case.solver.method.name(),
            rtol: case.solver.rtol,
            wall_time,
            summary: &summary,
            saved: (write_failed || unsaved.is_some()).then_some(saved),
            warnings: &warnings,
            error,
        })?;
    } else if !common.quiet && error.is_none() {
        print(&run_report(&case, &summary, wall_time))?;
        print(&format!("\n{}\n", file.display()))?;
    }
    if !common.quiet {
        for warning in &warnings {
            complain(&format!("warning: {warning}"));
        }
    }
    match unsaved {
        Some(error) => Err(CommandError::Computation(error)),
        None => finish(failure.as_deref(), &report, &file, common.quiet),
    }
}

fn warnings(summary: &TrainSummary) -> Vec<String> {
    let mut found = Vec::new();
    if summary.kicks_never_given > 0 {
        found.push(format!(
            "{} of the case's perturbations come after the end of the run; raise output.end_time",
            summary.kicks_never_given
        ));
    }
    found
}

/// The units of a motion: of position, speed, and energy.
fn units(motion: Motion) -> (&'static str, &'static str) {
    match motion {
        Motion::Rotation => ("rad", "rad/s"),
        Motion::Translation => ("m", "m/s"),
    }
}

/// The headline of a run of trains, row by row.
pub(super) fn rows(case: &TrainCase, summary: &TrainSummary) -> Vec<(&'static str, String)> {
    let (angle, speed) = units(case.motion);
    let seconds = |t: Option<f64>| t.map_or_else(|| "none".to_owned(), |t| format!("{t:.9} s"));
    let range = |range: Option<(f64, f64)>| {
        range.map_or_else(
            || "none".to_owned(),
            |(least, most)| format!("{least:.9} to {most:.9} s"),
        )
    };
    let mut rows = vec![
        (
            "events",
            format!(
                "{} ({} sticks, {} slips)",
                summary.events, summary.sticks, summary.slips
            ),
        ),
        ("first stick", seconds(summary.onset_time)),
        ("slip duration, range", range(summary.slip_duration_range)),
        ("stick duration, range", range(summary.stick_duration_range)),
    ];
    match &summary.outcome {
        Outcome::Periodic(Attractor {
            period,
            sticks,
            agreement,
            since,
            extremes,
            ..
        }) => {
            rows.push(("motion", format!("periodic since {since:.6} s")));
            rows.push(("period", format!("{period:.12} s")));
            rows.push(("sticks in a period", sticks.to_string()));
            if let Some(extremes) = extremes {
                let (least, most) = extremes.position;
                rows.push((
                    "position over a period",
                    format!("{least:.12} to {most:.12} {angle} ({})", extremes.of),
                ));
                rows.push(("amplitude", format!("{:.12} {angle}", extremes.amplitude)));
                let (least, most) = extremes.relative_velocity;
                rows.push((
                    "relative velocity over a period",
                    format!("{least:.9} to {most:.9} {speed}"),
                ));
            }
            rows.push(("last two cycles differ by", format!("{agreement:.1e}, relative")));
        }
        Outcome::Stuck { since } => rows.push(("motion", format!("stuck since {since:.9} s"))),
        Outcome::NotPeriodic => rows.push(("motion", "not periodic by the end of the run".to_owned())),
        Outcome::Steady => rows.push(("motion", "no event of the contact".to_owned())),
    }
    if let Some(threshold) = summary.stick_threshold {
        rows.push((
            "counted as a stick",
            format!("|relative velocity| below {threshold:e} {speed}: the contact has no stick"),
        ));
    }
    rows.push(("energy residual", format!("{:.1e} J", summary.energy_residual)));
    rows
}

fn run_report(case: &TrainCase, summary: &TrainSummary, wall_time: f64) -> String {
    let mut report = terminal::table(&[]);
    for (name, value) in rows(case, summary) {
        report.add_row([name, &value]);
    }
    terminal::with_work(
        &case.title,
        &case.solver,
        &case.output,
        summary.end,
        wall_time,
        &report,
        &summary.work,
    )
}
