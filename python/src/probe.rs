//! Reading a file without an intact seal in another process first (`stickslip/_probe.py`).

use pyo3::prelude::*;
use std::ffi::OsString;

/// The command that reads a file first; two arguments follow it.
#[pyfunction]
pub fn set_probe(command: Vec<OsString>) {
    stickslip::results::set_probe(command);
}

/// Reads a file as the arguments of the process ask for. Returns its exit status.
#[pyfunction]
pub fn probe(arguments: Vec<OsString>) -> u8 {
    stickslip::results::probe(arguments)
}
