//! `stickslip run`.

use super::arguments::{Common, RunOptions};
use super::progress::RunBar;
use super::{CommandError, End, complain, print, print_json, provenance, terminal, witness};
use crate::analysis::headline::is_paper_case;
use crate::analysis::warning::warnings;
use crate::analysis::witness::Remembering;
use crate::analysis::{Summary, Warning, Witness};
use crate::case::{Case, CaseError, CaseSource, Origin, Override};
use crate::hybrid::RunError;
use crate::results::{
    Extra, Header, Overwrite, ResultError, ResultFile, ResultWriter, SavedRows, Status, StickSlipTable,
};
use crate::run::Run;
use crate::simulation::{RunFailure, RunReport};
use serde::Serialize;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

pub(super) const REFERENCES: &str = "Vibrational Interaction of Two Rotors with Friction Coupling, Advances in Acoustics and \
                          Vibration, 2016, article 9275147";

/// What is to be run: where it is from, and what it says.
pub(super) struct Input {
    pub source: CaseSource,
    pub case: Case,
    /// The case text for /input/case: that of the first run, if one is repeated.
    pub text: String,
    /// Files that must not be overwritten.
    pub files: Vec<PathBuf>,
}

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
    let Input {
        source,
        case,
        text,
        files,
    } = read_input(
        &options.case,
        &options.budget.over(&options.set),
        options.method.as_deref(),
    )?;
    let path = options.output.clone().unwrap_or_else(|| default_output(&source));
    let overwrite = if options.force {
        Overwrite::Force
    } else {
        Overwrite::OwnResults
    };
    let header = header(&case, text);
    // Before the partial file is there: from then on an interruption ends the run in good order.
    let stop = interrupt_flag()?;
    let mut writer = ResultWriter::create(&path, overwrite, &files, &header).map_err(bad_file)?;
    let partial = writer.partial().to_owned();
    let bar = RunBar::new(common, case.output.end_time);
    let clock = Instant::now();
    log::info!(
        "{}: method {}, rtol {:e}",
        source.label(),
        case.solver.method.name(),
        case.solver.rtol
    );
    let mut recorder = Remembering::new(&mut writer);
    let result = Run::new(&case)
        .record(&mut recorder)
        .control(|progress| {
            bar.show(progress);
            if stop.load(Ordering::Relaxed) {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        })
        .start();
    bar.finish();
    let sequence = recorder.into_sequence();
    let (report, failure) = match result {
        Ok(report) => (report, None),
        Err(mut failure) => (std::mem::take(&mut failure.report), Some(failure)),
    };
    let summary = Summary::of_run(&case.parameters, &report);
    let warnings: Vec<String> = warnings(&case, &summary, report.initial_energy)
        .iter()
        .map(Warning::to_string)
        .collect();
    let status = match &failure {
        Some(error) => Status::Failed(error.to_string()),
        None if report.interrupted => Status::Interrupted,
        None => Status::Complete,
    };
    let status_name = status.name();
    let saved = writer.saved();
    let write_failed = matches!(&failure, Some(failure) if matches!(failure.error, RunError::Observer(_)));
    let table = stick_slip_table(&summary);
    let wall_time = clock.elapsed().as_secs_f64();
    // Beside a complete run only, and never a reason for it to fail.
    let witness = (status == Status::Complete && !options.no_witness)
        .then(|| {
            crate::analysis::witness(&case, &sequence, summary.noise_determined, &|| {
                stop.load(Ordering::Relaxed)
            })
        })
        .flatten();
    let said = witness
        .as_ref()
        .map_or(Ok(()), |witness| writer.witness(&witness::attributes(witness)));
    let (file, unsaved) = match said.and_then(|()| writer.finish(status, &table, wall_time)) {
        Ok(file) => (file, None),
        Err(error) => (partial, Some(error.to_string())),
    };
    let status_name = if unsaved.is_some() { "failed" } else { status_name };
    let error = unsaved.clone().or_else(|| failure.as_ref().map(ToString::to_string));
    if common.json {
        print_json(&RunDocument {
            status: status_name,
            file: file.display().to_string(),
            case: source.label(),
            title: &case.title,
            method: case.solver.method.name(),
            rtol: case.solver.rtol,
            wall_time,
            summary: &summary,
            saved: (write_failed || unsaved.is_some()).then_some(saved),
            witness: witness.as_ref(),
            warnings: &warnings,
            error,
        })?;
    } else if !common.quiet && error.is_none() {
        let beside_paper = is_paper_case(&case.parameters);
        print(&terminal::run_report(&case, &summary, beside_paper, wall_time))?;
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
        None => finish(failure.as_deref(), &report, &file, common.quiet),
    }
}

/// What a result file says about its run, known before it.
pub(super) fn header(case: &Case, text: String) -> Header {
    let started = provenance::now();
    Header {
        title: case.title.clone(),
        source: provenance::source(),
        references: REFERENCES.to_owned(),
        history: format!("{started} {}", provenance::command_line()),
        case_text: text,
        resolved: case.resolved(),
        meta: provenance::meta(case, &started),
        events: provenance::events(case),
    }
}

fn finish(failure: Option<&RunFailure>, report: &RunReport, file: &Path, quiet: bool) -> Result<End, CommandError> {
    match failure {
        // An error of the result file names the file itself.
        Some(RunFailure {
            error: RunError::Observer(error),
            ..
        }) => Err(CommandError::Computation(error.to_string())),
        Some(failure) => Err(CommandError::Computation(format!(
            "{failure}. What was computed until then is in {}",
            file.display()
        ))),
        None if report.interrupted => {
            if !quiet {
                let (end, file) = (report.end, file.display());
                complain(&format!(
                    "interrupted at t = {end:.9} s; what was computed is saved in {file}"
                ));
            }
            Ok(End::Interrupted)
        }
        None => Ok(End::Done),
    }
}

pub(super) fn bad_case(error: CaseError) -> CommandError {
    CommandError::Input(error.to_string())
}

pub(super) fn bad_file(error: ResultError) -> CommandError {
    if error.is_of_the_system() {
        CommandError::Computation(error.to_string())
    } else {
        CommandError::Input(error.to_string())
    }
}

/// The case from a file, a result file or the built-in ones, with its overrides.
pub(super) fn read_input(case: &str, set: &[String], method: Option<&str>) -> Result<Input, CommandError> {
    let path = Path::new(case);
    let mut files = Vec::new();
    let mut text = None;
    let source = if path.is_file() && (is_hdf5(path) || path.extension().is_some_and(|e| e == "h5")) {
        let file = ResultFile::open(path).map_err(bad_file)?;
        text = Some(file.case_text().map_err(bad_file)?);
        CaseSource::result(path, file.resolved().map_err(bad_file)?)
    } else if path.exists() || looks_like_a_path(case) {
        CaseSource::file(path).map_err(bad_case)?
    } else {
        CaseSource::built_in(case).map_err(bad_case)?
    };
    if path.exists() {
        files.push(path.to_owned());
    }
    let overrides = overrides(set, method).map_err(bad_case)?;
    let case = Case::parse(&source, &overrides).map_err(bad_case)?;
    let text = text.unwrap_or_else(|| source.text.clone());
    Ok(Input {
        source,
        case,
        text,
        files,
    })
}

/// The overrides of a command: each `--set`, then `--method`.
pub(super) fn overrides(set: &[String], method: Option<&str>) -> Result<Vec<Override>, CaseError> {
    let method = method.map(|method| format!("solver.method={method}"));
    set.iter()
        .chain(&method)
        .map(|setting| Override::parse(setting))
        .collect()
}

pub(super) fn looks_like_a_path(name: &str) -> bool {
    name.contains(std::path::MAIN_SEPARATOR) || Path::new(name).extension().is_some()
}

/// By the signature, as HDF5 files may have any name. (One named so without a signature is a damaged one, not a case.)
fn is_hdf5(path: &Path) -> bool {
    use std::io::Read;
    let mut head = [0u8; 8];
    std::fs::File::open(path)
        .and_then(|mut f| f.read_exact(&mut head))
        .is_ok()
        && head == *b"\x89HDF\r\n\x1a\n"
}

fn default_output(source: &CaseSource) -> PathBuf {
    let name = source.name();
    PathBuf::from(match source.origin {
        Origin::Result(_) => format!("{name}.repeat.h5"),
        _ => format!("{name}.h5"),
    })
}

/// A flag that Ctrl-C and a termination signal set; the run then ends in good order.
pub(super) fn interrupt_flag() -> Result<Arc<AtomicBool>, CommandError> {
    let flag = Arc::new(AtomicBool::new(false));
    let setter = flag.clone();
    ctrlc::set_handler(move || setter.store(true, Ordering::Relaxed))
        .map_err(|error| CommandError::Computation(format!("the signal handler could not be set: {error}")))?;
    Ok(flag)
}

/// A further attribute of /stick_slip; NaN where there is no value.
fn extra(name: &str, unit: &str, description: &str, value: Option<f64>) -> Extra {
    Extra {
        name: name.to_owned(),
        unit: unit.to_owned(),
        description: description.to_owned(),
        value: value.unwrap_or(f64::NAN),
    }
}

pub(super) fn stick_slip_table(summary: &Summary) -> StickSlipTable {
    let missing = |value: Option<f64>| value.unwrap_or(f64::NAN);
    StickSlipTable {
        onset_time: missing(summary.onset_time),
        final_stick_time: missing(summary.final_stick_time),
        stick_count: summary.sticks as u64,
        slip_count: summary.slips as u64,
        first_period: missing(summary.first_period),
        last_period: missing(summary.last_period),
        natural_period: summary.natural_period,
        growth_exponent: missing(summary.growth_exponent),
        e_folds_gained: missing(summary.e_folds_gained),
        energy_residual_max: summary.energy_residual,
        extras: vec![
            extra(
                "instability_time",
                "s",
                "when steady sliding loses its stability",
                summary.instability_time,
            ),
            extra(
                "growth_to_onset",
                "1",
                "the part of growth_exponent up to the first stick",
                summary.growth_to_onset,
            ),
            extra(
                "kick_above_noise",
                "1",
                "by how many e-folds the kick stands above rounding at the first stick; negative: it has died out",
                summary.kick_above_noise,
            ),
            extra(
                "noise_determined",
                "1",
                "1 if the stick-slip is amplified rounding, which converges with no tolerance; else 0",
                Some(f64::from(u8::from(summary.noise_determined))),
            ),
        ],
        // The cycles themselves were recorded as they came.
        ..StickSlipTable::default()
    }
}
