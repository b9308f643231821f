//! Errors of the library as exceptions with the same text.

use pyo3::prelude::*;
use stickslip::Error;
use stickslip::case::CaseError;
use stickslip::results::ResultError;

/// An exception of `stickslip._errors`: its class, and its text.
#[derive(Debug)]
pub struct Raised(pub &'static str, pub String);

impl From<Raised> for PyErr {
    fn from(Raised(class, text): Raised) -> PyErr {
        Python::attach(|py| {
            let made = py
                .import("stickslip._errors")
                .and_then(|module| module.getattr(class)?.call1((text,)));
            match made {
                Ok(exception) => PyErr::from_value(exception),
                Err(error) => error,
            }
        })
    }
}

impl From<CaseError> for Raised {
    fn from(error: CaseError) -> Raised {
        Raised("CaseError", error.to_string())
    }
}

impl From<ResultError> for Raised {
    fn from(error: ResultError) -> Raised {
        Raised("FileError", error.to_string())
    }
}

impl From<Error> for Raised {
    fn from(error: Error) -> Raised {
        let class = if error.is_input() { "InputError" } else { "RunError" };
        Raised(class, error.to_string())
    }
}
