//! Errors of the library as exceptions with the same text.

use pyo3::prelude::*;
use stickslip::Error;
use stickslip::case::CaseError;
use stickslip::results::ResultError;

/// An exception of `stickslip._errors`.
pub fn exception(py: Python<'_>, class: &str, text: String) -> PyErr {
    let made = py
        .import("stickslip._errors")
        .and_then(|module| module.getattr(class)?.call1((text,)));
    match made {
        Ok(exception) => PyErr::from_value(exception),
        Err(error) => error,
    }
}

pub fn of_case(py: Python<'_>, error: &CaseError) -> PyErr {
    exception(py, "CaseError", error.to_string())
}

pub fn of_file(py: Python<'_>, error: &ResultError) -> PyErr {
    exception(py, "FileError", error.to_string())
}

pub fn of_command(py: Python<'_>, error: &Error) -> PyErr {
    let class = if error.is_input() { "InputError" } else { "RunError" };
    exception(py, class, error.to_string())
}
