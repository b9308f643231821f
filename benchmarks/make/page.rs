//! The set as a page.

use crate::Outcome;
use std::collections::BTreeMap;
use std::path::PathBuf;
use stickslip::compare::benchmark::ProblemSet;

/// `index.html`.
pub fn of(_set: &ProblemSet, _made: &BTreeMap<PathBuf, String>) -> Outcome<String> {
    Ok(String::new())
}
