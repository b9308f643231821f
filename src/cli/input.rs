//! Inputs and outputs common to several commands.

use super::INTERRUPTED;
use crate::Error;
use signal_hook::consts;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use stickslip_analysis::SavedRun;
use stickslip_case::{CaseError, CaseSource, Origin, Override, changed};
use stickslip_compare::{CompareError, Mapping, Reference};
use stickslip_files::{is_hdf5, open_sound};

const STANDARD_INPUT: &str = "-";

pub(super) struct GivenCase {
    pub source: CaseSource,
    /// Text for /input/case. A repeated run passes on the text of the first run.
    pub text: String,
    pub files: Vec<PathBuf>,
    /// Overrides with which a repeated run was made, in words.
    changed: Vec<String>,
}

impl GivenCase {
    /// Reads a file, a result whose case is repeated, or a built-in case.
    pub fn read(case: &str) -> Result<GivenCase, Error> {
        let path = Path::new(case);
        let (mut text, mut changed) = (None, Vec::new());
        let source = if case == STANDARD_INPUT {
            CaseSource::standard_input()?
        } else if path.is_file() && (is_hdf5(path) || path.extension().is_some_and(|e| e == "h5")) {
            let file = open_sound(path)?;
            text = Some(file.case_text()?);
            changed = file.changed();
            CaseSource::result(path, file.resolved()?)
        } else if path.exists() || looks_like_a_path(case) {
            CaseSource::file(path)?
        } else {
            CaseSource::built_in(case)?
        };
        Ok(GivenCase {
            text: text.unwrap_or_else(|| source.text.clone()),
            files: Some(path.to_owned())
                .filter(|path| case != STANDARD_INPUT && path.exists())
                .into_iter()
                .collect(),
            source,
            changed,
        })
    }

    /// The case of a result file, as it was given, with the overrides `changed` in words.
    pub fn of_result(path: &Path, text: String, changed: Vec<String>) -> GivenCase {
        GivenCase {
            source: CaseSource::result(path, text.clone()),
            text,
            files: vec![path.to_owned()],
            changed,
        }
    }

    /// What distinguishes the case with these overrides from the one that was written, in words.
    pub fn changed(&self, changes: &[Override]) -> Vec<String> {
        let new = changed(&self.source, changes);
        let key = |line: &str| line.split_once(" = ").map(|(key, _)| key.to_owned());
        let is_kept = |line: &&String| new.iter().all(|new| key(new) != key(line));
        let mut all: Vec<String> = self.changed.iter().filter(is_kept).cloned().collect();
        all.extend(new);
        all
    }
}

/// The overrides of options. A key that is given twice is an error: one of the values would be lost in silence.
pub(super) fn overrides(set: &[String], method: Option<&str>) -> Result<Vec<Override>, CaseError> {
    let method = method.map(|method| format!("solver.method={method}"));
    let parsed = set.iter().chain(&method).map(|setting| Override::parse(setting));
    let parsed = parsed.collect::<Result<Vec<_>, _>>()?;
    let twice = |(at, change): &(usize, &Override)| parsed[..*at].iter().any(|other| other.key() == change.key());
    match parsed.iter().enumerate().find(twice) {
        None => Ok(parsed),
        Some((_, change)) => {
            let key = change.key();
            let given = parsed.iter().filter(|other| other.key() == key).map(Override::argument);
            let given = given.collect::<Vec<_>>().join(" and ");
            Err(CaseError::one(
                format!("--set {key}"),
                "",
                format!("given twice, as {given}; leave one of them out"),
            ))
        }
    }
}

fn looks_like_a_path(name: &str) -> bool {
    name.contains(std::path::MAIN_SEPARATOR) || Path::new(name).extension().is_some()
}

/// The result file as named, or named after the case. A case from standard input has no name, which is an error.
pub(super) fn output_of(source: &CaseSource, named: Option<&Path>, suffix: &str) -> Result<PathBuf, Error> {
    match (named, &source.origin) {
        (Some(path), _) => Ok(path.to_owned()),
        (None, Origin::StandardInput) => Err(Error::input(
            "a case from standard input has no name after which its result could be called; name the file with -o, for \
             example -o result.h5",
        )),
        (None, _) => Ok(PathBuf::from(format!("{}{suffix}", source.name()))),
    }
}

/// Columns from a mapping file, overridden by options, with the names of a reference.
pub(super) fn columns(reference: &Reference, file: Option<&Path>, options: &[String]) -> Result<Mapping, CompareError> {
    let mut mapping = match file {
        Some(path) => reference.mapping().with_file(path)?,
        None => reference.mapping(),
    };
    options.iter().try_for_each(|column| mapping.add_option(column))?;
    Ok(mapping)
}

/// A flag that Ctrl-C and the termination signals set; the run then ends cleanly. A second Ctrl-C or SIGTERM ends the
/// process at once. A second SIGHUP does not, because terminals send it twice.
pub(super) fn interrupt_flag() -> Result<Arc<AtomicBool>, Error> {
    if let Some(flag) = super::capture::stop() {
        return Ok(flag);
    }
    let flag = Arc::new(AtomicBool::new(false));
    let failed = |error| Error::computation(format!("the signal handler could not be set: {error}"));
    // Registered before the handler that sets the flag, because handlers run in the order of registration.
    for signal in [consts::SIGINT, consts::SIGTERM] {
        signal_hook::flag::register_conditional_shutdown(signal, INTERRUPTED.into(), flag.clone()).map_err(failed)?;
    }
    let signals = [
        consts::SIGINT,
        consts::SIGTERM,
        #[cfg(unix)]
        consts::SIGHUP,
        #[cfg(windows)]
        consts::SIGBREAK,
    ];
    for signal in signals {
        signal_hook::flag::register(signal, flag.clone()).map_err(failed)?;
    }
    Ok(flag)
}

/// A temporary result. It is removed with its partial file, however the command ends.
pub(super) struct Scratch(pub(super) PathBuf);

impl Drop for Scratch {
    fn drop(&mut self) {
        for path in [&self.0, &stickslip_files::partial_path(&self.0)] {
            let _ = std::fs::remove_file(path);
        }
    }
}

/// Opens a result file, or runs the case in the folder of a benchmark problem.
pub(super) fn open_reference(path: &Path) -> Result<Reference, CompareError> {
    if !path.is_dir() {
        return Reference::open(path);
    }
    Reference::of_problem(path, |case, file| {
        let run = SavedRun::new(case, file).start();
        run.map(drop).map_err(|error| error.to_string())
    })
}
