//! `stickslip run`.

use super::arguments::{Common, RunOptions};
use super::progress::RunBar;
use super::{CommandError, End, complain, print, print_json, terminal, trains};
use crate::analysis::headline::is_paper_case;
use crate::analysis::{SavedReport, SavedRun, Summary, Warning, Witness};
use crate::case::{Case, CaseError, CaseSource, Origin, Override, TrainCase};
use crate::hybrid::RunError;
use crate::results::{Overwrite, ResultError, ResultFile, SavedRows};
use crate::simulation::{RunFailure, RunReport};
use serde::Serialize;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

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
    let given = Given::read(&options.case)?;
    let set = options.budget.over(&options.set);
    let changes = overrides(&set, options.method.as_deref()).map_err(bad_case)?;
    if TrainCase::is_one(&given.source, &changes) {
        return trains::run(&given, &changes, options, common);
    }
    let Input {
        source,
        case,
        text,
        files,
    } = given.case(&changes)?;
    let path = options.output.clone().unwrap_or_else(|| default_output(&source));
    let overwrite = if options.force {
        Overwrite::Force
    } else {
        Overwrite::OwnResults
    };
    // Before the partial file is there: from then on an interruption ends the run in good order.
    let stop = interrupt_flag()?;
    let bar = RunBar::new(common, case.output.end_time);
    log::info!(
        "{}: method {}, rtol {:e}",
        source.label(),
        case.solver.method.name(),
        case.solver.rtol
    );
    let result = SavedRun::new(&case, &path)
        .text(&text)
        .overwrite(overwrite)
        .inputs(&files)
        .witness(!options.no_witness)
        .stop(&stop)
        .control(|progress| {
            bar.show(progress);
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

pub(super) fn finish(
    failure: Option<&RunFailure>,
    report: &RunReport,
    file: &Path,
    quiet: bool,
) -> Result<End, CommandError> {
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

/// What a command was given as a case, not yet read.
pub(super) struct Given {
    pub source: CaseSource,
    /// The case text for /input/case: that of the first run, if one is repeated.
    pub text: String,
    /// Files that must not be overwritten.
    pub files: Vec<PathBuf>,
}

impl Given {
    /// A file, a result whose case is repeated, or a built-in case.
    pub fn read(case: &str) -> Result<Given, CommandError> {
        let path = Path::new(case);
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
        Ok(Given {
            text: text.unwrap_or_else(|| source.text.clone()),
            files: path.exists().then(|| path.to_owned()).into_iter().collect(),
            source,
        })
    }

    /// As the case of a brake.
    pub fn case(self, changes: &[Override]) -> Result<Input, CommandError> {
        Ok(Input {
            case: Case::parse(&self.source, changes).map_err(bad_case)?,
            source: self.source,
            text: self.text,
            files: self.files,
        })
    }
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

pub(super) fn default_output(source: &CaseSource) -> PathBuf {
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
