//! The case that a result file holds, of a brake or of two trains.

use super::CompareError;
use crate::case::{Case, CaseSource, TrainCase};
use crate::results::ResultFile;
use std::path::Path;

/// See the module.
#[derive(Debug)]
pub(super) enum SavedCase {
    Brake(Box<Case>),
    Trains(Box<TrainCase>),
}

impl SavedCase {
    /// That of a result file.
    ///
    /// # Errors
    /// Of the file, or of the case in it.
    pub fn of(path: &Path, file: &ResultFile) -> Result<SavedCase, CompareError> {
        let source = CaseSource::result(path, file.resolved()?);
        let case = if TrainCase::is_one(&source, &[]) {
            TrainCase::parse(&source, &[]).map(|case| SavedCase::Trains(Box::new(case)))
        } else {
            Case::parse(&source, &[]).map(|case| SavedCase::Brake(Box::new(case)))
        };
        case.map_err(|source| CompareError::Case {
            path: path.to_owned(),
            source,
        })
    }

    /// Every value of it in SI.
    pub fn resolved(&self) -> String {
        match self {
            SavedCase::Brake(case) => case.resolved(),
            SavedCase::Trains(case) => case.resolved(),
        }
    }
}
