//! What commands share: the case or file that they are given, and the file that they write.

use super::CommandError;
use crate::case::{CaseError, CaseSource, Origin, Override};
use crate::compare::{CompareError, Mapping, Reference};
use crate::results::{Overwrite, is_hdf5, open_sound};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// As a case: what comes through standard input.
const STANDARD_INPUT: &str = "-";

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
        let source = if case == STANDARD_INPUT {
            CaseSource::standard_input()?
        } else if path.is_file() && (is_hdf5(path) || path.extension().is_some_and(|e| e == "h5")) {
            let file = open_sound(path)?;
            text = Some(file.case_text()?);
            CaseSource::result(path, file.resolved()?)
        } else if path.exists() || looks_like_a_path(case) {
            CaseSource::file(path)?
        } else {
            CaseSource::built_in(case)?
        };
        Ok(Given {
            text: text.unwrap_or_else(|| source.text.clone()),
            files: Some(path.to_owned())
                .filter(|path| case != STANDARD_INPUT && path.exists())
                .into_iter()
                .collect(),
            source,
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

fn looks_like_a_path(name: &str) -> bool {
    name.contains(std::path::MAIN_SEPARATOR) || Path::new(name).extension().is_some()
}

/// The result file that is named, or the one that is named after the case.
///
/// # Errors
/// A case from standard input has no name, and several of them would replace each other's results.
pub(super) fn output_of(source: &CaseSource, named: Option<&Path>, suffix: &str) -> Result<PathBuf, CommandError> {
    match (named, &source.origin) {
        (Some(path), _) => Ok(path.to_owned()),
        (None, Origin::StandardInput) => Err(CommandError::input(
            "a case from standard input has no name after which its result could be called; name the file with -o, for \
             example -o result.h5",
        )),
        (None, _) => Ok(PathBuf::from(format!("{}{suffix}", source.name()))),
    }
}

/// What a result may replace: with `force` any file but an input.
pub(super) fn overwrite(force: bool) -> Overwrite {
    match force {
        true => Overwrite::Force,
        false => Overwrite::OwnResults,
    }
}

/// The columns of a mapping file, with those of options over them, by the names of a reference.
pub(super) fn columns(reference: &Reference, file: Option<&Path>, options: &[String]) -> Result<Mapping, CompareError> {
    let mut mapping = match file {
        Some(path) => reference.mapping().with_file(path)?,
        None => reference.mapping(),
    };
    options.iter().try_for_each(|column| mapping.add_option(column))?;
    Ok(mapping)
}

/// A flag that Ctrl-C and a termination signal set; the run then ends in good order.
pub(super) fn interrupt_flag() -> Result<Arc<AtomicBool>, CommandError> {
    if let Some(flag) = super::captured::stop() {
        return Ok(flag);
    }
    let flag = Arc::new(AtomicBool::new(false));
    let setter = flag.clone();
    ctrlc::set_handler(move || setter.store(true, Ordering::Relaxed))
        .map_err(|error| CommandError::computation(format!("the signal handler could not be set: {error}")))?;
    Ok(flag)
}

/// A result file that is made on the way, and removed with its partial file however the command ends.
pub(super) struct Scratch(pub(super) PathBuf);

impl Drop for Scratch {
    fn drop(&mut self) {
        for path in [&self.0, &crate::results::partial_path(&self.0)] {
            let _ = std::fs::remove_file(path);
        }
    }
}
