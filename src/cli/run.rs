//! `stickslip run`.

use super::arguments::{Common, RunOptions};
use super::input::{Given, bad_case, bad_file, finish, interrupt_flag, overrides, overwrite, run_output};
use super::progress::Bar;
use super::{CommandError, End, complain, print, print_json, strictly, terminal};
use crate::analysis::{SavedReport, SavedRun, Summary, Warning, Witness};
use crate::case::Case;
use crate::hybrid::RunError;
use crate::results::SavedRows;
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
    /// Of what was computed, be it saved or not.
    summary: &'a Summary,
    /// Only where the file could not be written to its end: what it has for certain. It is marked interrupted.
    #[serde(skip_serializing_if = "Option::is_none")]
    saved: Option<SavedRows>,
    /// What another method made of the same case; not of a run that is not complete.
    #[serde(skip_serializing_if = "Option::is_none")]
    witness: Option<&'a Witness>,
    warnings: &'a [String],
    /// Of a failed run only.
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
}

/// Integrates one case into a result file and reports it.
pub(super) fn run(options: &RunOptions, common: &Common) -> Result<End, CommandError> {
    let given = Given::read(&options.case)?;
    let set = options.budget.over(&options.set);
    let changes = overrides(&set, options.method.as_deref()).map_err(bad_case)?;
    let case = &Case::read(&given.source, &changes).map_err(bad_case)?;
    let (source, solver) = (&given.source, &case.solver);
    let path = run_output(source, options.output.as_deref())?;
    // Before the partial file is there: from then on an interruption ends the run in good order.
    let stop = interrupt_flag()?;
    let (bar, end_time) = (Bar::new(common), case.output.end_time);
    log::info!(
        "{}: method {}, rtol {:e}",
        source.label(),
        solver.method.name(),
        solver.rtol
    );
    let result = SavedRun::new(case, &path)
        .text(&given.text)
        .overwrite(overwrite(options.force))
        .inputs(&given.files)
        .witness(!options.no_witness)
        .stop(&stop)
        .control(|progress| {
            bar.run(progress, end_time);
            ControlFlow::Continue(())
        })
        .start();
    bar.finish();
    let SavedReport {
        file,
        status,
        report,
        summary,
        warnings,
        witness,
        failure,
        unsaved,
        saved,
        wall_time,
    } = result.map_err(bad_file)?;
    let warnings: Vec<String> = warnings.iter().map(Warning::to_string).collect();
    let write_failed = matches!(&failure, Some(failure) if matches!(failure.error, RunError::Observer(_)));
    let unsaved = unsaved.map(|error| error.to_string());
    let status = if unsaved.is_some() { "failed" } else { status.name() };
    let error = unsaved.clone().or_else(|| failure.as_ref().map(ToString::to_string));
    if common.json {
        print_json(&RunDocument {
            status,
            file: file.display().to_string(),
            case: source.label(),
            title: &case.title,
            method: solver.method.name(),
            rtol: solver.rtol,
            wall_time,
            summary: &summary,
            saved: (write_failed || unsaved.is_some()).then_some(saved),
            witness: witness.as_ref(),
            warnings: &warnings,
            error,
        })?;
    } else if !common.quiet && error.is_none() {
        print(&terminal::run_report(case, &summary, wall_time))?;
        if let Some(witness) = &witness {
            print(&format!("\n{}\n", witness.statement))?;
        }
        print(&format!("\n{}\n", file.display()))?;
    }
    if !common.quiet {
        for warning in &warnings {
            complain(&format!("warning: {warning}"));
        }
    }
    match unsaved {
        Some(error) => Err(CommandError::Computation(error)),
        None => {
            let end = finish(failure.as_deref(), &report, &file, common.quiet)?;
            strictly(end, options.strict, &warnings, !common.quiet, &file)
        }
    }
}
