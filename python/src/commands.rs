//! Commands of the program in this process, whose reports are shown: certify, compare, modes, cycle.

use crate::errors::of_command;
use crate::waiting::interruptible;
use pyo3::prelude::*;
use std::ffi::OsString;
use stickslip::cli::{Said, capture};

/// The report of a command, its JSON document, what it said on standard error, and why it fell short.
type Outcome = (String, Option<String>, Vec<String>, Option<String>);

/// Runs a command of the program. With `keeps` an error after its document is returned, not raised: it fell short of what was
/// asked.
#[pyfunction]
#[pyo3(signature = (arguments, keeps=false))]
pub fn command(py: Python<'_>, arguments: Vec<OsString>, keeps: bool) -> PyResult<Outcome> {
    let (said, end) = interruptible(py, None, |watch| capture(arguments, watch.stop.clone()))?;
    let Said {
        text,
        document,
        messages,
    } = said;
    match end {
        Err(error) if !keeps || document.is_none() => Err(of_command(py, &error)),
        Err(error) => Ok((text, document, messages, Some(error.to_string()))),
        Ok(_) => Ok((text, document, messages, None)),
    }
}

/// Name and text of each built-in case.
#[pyfunction]
pub fn cases() -> Vec<(&'static str, &'static str)> {
    let all = stickslip::case::builtin::all();
    all.into_iter().map(|case| (case.name, case.text)).collect()
}
