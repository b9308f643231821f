//! Classification of errors (wrong input or failed computation), and their JSON form.

use super::{CommandError, DOCUMENT_IS_PRINTED, print_json};
use crate::export::ExportError;
use crate::plot::PlotError;
use crate::plot::target::TargetError;
use serde::Serialize;
use std::sync::atomic::Ordering;
use stickslip_analysis::{Error, ErrorKind};
use stickslip_case::{CaseError, CaseProblem};
use stickslip_compare::CompareError;
use stickslip_files::ResultError;

/// Location of an error.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct FailurePlace {
    /// The file, or the name of the text in messages.
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<String>,
    /// Line, from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    line: Option<u64>,
    /// The option with the text, such as --set.
    #[serde(skip_serializing_if = "Option::is_none")]
    option: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    key: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    message: Option<String>,
}

#[derive(Serialize)]
struct FailureDocument<'a> {
    error: FailedCommand<'a>,
}

#[derive(Serialize)]
struct FailedCommand<'a> {
    /// usage, input, computation or interrupted.
    kind: &'a str,
    message: &'a str,
    exit_status: u8,
    /// May be empty.
    places: &'a [FailurePlace],
}

pub(super) fn document(kind: &str, message: &str, exit_status: u8, places: &[FailurePlace]) {
    if DOCUMENT_IS_PRINTED.load(Ordering::Relaxed) {
        return;
    }
    let error = FailedCommand {
        kind,
        message,
        exit_status,
        places,
    };
    // If standard output fails, the message is still on standard error.
    let _ = print_json(&FailureDocument { error });
}

impl From<CaseError> for CommandError {
    fn from(error: CaseError) -> Self {
        CommandError {
            places: error.problems.iter().map(place_of).collect(),
            ..CommandError::input(error)
        }
    }
}

fn place_of(problem: &CaseProblem) -> FailurePlace {
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
    FailurePlace {
        file,
        line,
        option: set.map(|_| "--set"),
        key: Some(key.to_owned()).filter(|key| !key.is_empty()),
        message: Some(problem.message.clone()),
    }
}

impl From<ResultError> for CommandError {
    fn from(error: ResultError) -> Self {
        let place = FailurePlace {
            file: Some(error.path.display().to_string()),
            ..FailurePlace::default()
        };
        CommandError {
            is_input: !error.is_of_the_system(),
            text: error.to_string(),
            places: vec![place],
        }
    }
}

impl From<Error> for CommandError {
    fn from(error: Error) -> Self {
        match error.kind {
            ErrorKind::Case(error) => error.into(),
            ErrorKind::File(error) => error.into(),
            ErrorKind::Input => CommandError::input(error.message),
            _ => CommandError::computation(error.message),
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
            ExportError::Io { .. } | ExportError::Temporary { .. } => CommandError::computation(error),
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
