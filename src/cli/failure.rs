//! Which errors are wrong input and which failed computations, and what a failed command says as JSON.

use super::{CommandError, DOCUMENT_IS_PRINTED, print_json};
use crate::case::{CaseError, Problem};
use crate::compare::CompareError;
use crate::export::ExportError;
use crate::plot::PlotError;
use crate::plot::target::TargetError;
use crate::results::ResultError;
use serde::Serialize;
use std::sync::atomic::Ordering;

/// Where something is wrong.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Place {
    /// The file, or how messages call the text.
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<String>,
    /// From 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    line: Option<u64>,
    /// The option that brought it, such as --set.
    #[serde(skip_serializing_if = "Option::is_none")]
    option: Option<&'static str>,
    /// The dotted path of the key.
    #[serde(skip_serializing_if = "Option::is_none")]
    key: Option<String>,
    /// What is wrong there.
    #[serde(skip_serializing_if = "Option::is_none")]
    message: Option<String>,
}

/// Prints the document of a failure, unless the command has printed its own.
pub(super) fn document(kind: &str, message: &str, exit_status: u8, places: &[Place]) {
    if DOCUMENT_IS_PRINTED.load(Ordering::Relaxed) {
        return;
    }
    // The kind is usage, input, computation or interrupted; without places the message alone says it.
    let error = document! { kind: kind, message: message, exit_status: exit_status, places: places };
    // Where standard output cannot be written to, standard error still says it.
    let _ = print_json(&document! { error: error });
}

/// With the place of each problem of a case or a study.
impl From<CaseError> for CommandError {
    fn from(error: CaseError) -> Self {
        CommandError {
            places: error.problems.iter().map(place_of).collect(),
            ..CommandError::input(error)
        }
    }
}

fn place_of(problem: &Problem) -> Place {
    let set = problem.place.strip_prefix("--set ");
    let (file, line) = match (set, problem.place.rsplit_once(':')) {
        (Some(_), _) => (None, None),
        (None, Some((file, line))) if line.parse::<u64>().is_ok() => (Some(file.to_owned()), line.parse().ok()),
        (None, _) => (Some(problem.place.clone()).filter(|place| !place.is_empty()), None),
    };
    let key = match problem.key.is_empty() {
        true => set.unwrap_or_default(),
        false => &problem.key,
    };
    Place {
        file,
        line,
        option: set.map(|_| "--set"),
        key: Some(key.to_owned()).filter(|key| !key.is_empty()),
        message: Some(problem.message.clone()),
    }
}

/// With the file.
impl From<ResultError> for CommandError {
    fn from(error: ResultError) -> Self {
        let place = Place {
            file: Some(error.path.display().to_string()),
            ..Place::default()
        };
        CommandError {
            is_input: !error.is_of_the_system(),
            text: error.to_string(),
            places: vec![place],
        }
    }
}

impl From<CompareError> for CommandError {
    fn from(error: CompareError) -> Self {
        match error {
            CompareError::Result(error) => error.into(),
            _ => CommandError::input(error),
        }
    }
}

impl From<ExportError> for CommandError {
    fn from(error: ExportError) -> Self {
        match error {
            ExportError::Result(error) => error.into(),
            ExportError::Compare(error) => error.into(),
            ExportError::Io { .. } => CommandError::computation(error),
            _ => CommandError::input(error),
        }
    }
}

impl From<PlotError> for CommandError {
    fn from(error: PlotError) -> Self {
        match error {
            PlotError::Result(error) => error.into(),
            PlotError::Compare(error) => error.into(),
            PlotError::Drawing(_) => CommandError::computation(error),
            PlotError::Target(target) if target.is_failure() => CommandError::computation(target),
            _ => CommandError::input(error),
        }
    }
}

impl From<TargetError> for CommandError {
    fn from(error: TargetError) -> Self {
        PlotError::from(error).into()
    }
}
