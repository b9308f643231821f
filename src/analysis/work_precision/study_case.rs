//! The case of a study: of a brake, or of two trains.

use crate::case::{AnyCase, Case, CaseError, CaseSource, Override, TrainCase};
use crate::run::Run;
use crate::simulation::{Method, OutputOptions};

/// A valid case of either form.
#[derive(Debug, Clone, PartialEq)]
pub enum StudyCase {
    /// The two-disk brake.
    Brake(Box<Case>),
    /// Two trains.
    Trains(Box<TrainCase>),
}

impl StudyCase {
    /// Reads a case, as [`Case::parse`] and [`TrainCase::parse`] do.
    ///
    /// # Errors
    /// All problems that were found.
    pub fn parse(source: &CaseSource, overrides: &[Override]) -> Result<StudyCase, CaseError> {
        Ok(match AnyCase::read(source, overrides)? {
            AnyCase::Brake(case) => StudyCase::Brake(case),
            AnyCase::Trains(case) => StudyCase::Trains(case),
        })
    }

    /// The case as a TOML text in SI.
    pub fn resolved(&self) -> String {
        match self {
            StudyCase::Brake(case) => case.resolved(),
            StudyCase::Trains(case) => case.resolved(),
        }
    }

    /// Which method the case asks for.
    pub fn method(&self) -> Method {
        match self {
            StudyCase::Brake(case) => case.solver.method,
            StudyCase::Trains(case) => case.solver.method,
        }
    }

    /// Its run.
    pub fn run(&self) -> Run<'_> {
        match self {
            StudyCase::Brake(case) => Run::new(case),
            StudyCase::Trains(case) => {
                let threshold = case.threshold.unwrap_or(0.0);
                Run::of_trains(&case.parameters, threshold, &case.solver, &case.output)
            }
        }
    }

    /// What is recorded.
    pub(super) fn output(&mut self) -> &mut OutputOptions {
        match self {
            StudyCase::Brake(case) => &mut case.output,
            StudyCase::Trains(case) => &mut case.output,
        }
    }
}
