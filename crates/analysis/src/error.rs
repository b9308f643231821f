//! The error of this crate.

use stickslip_case::CaseError;
use stickslip_files::ResultError;
use stickslip_oracle::OracleError;

/// Error of an analysis or of a study.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
pub struct Error {
    /// What is to be done about it.
    pub kind: ErrorKind,
    /// Place, reason and remedy.
    pub message: String,
}

/// What is to be done about an error.
#[derive(Debug)]
#[non_exhaustive]
pub enum ErrorKind {
    /// The observer ended the computation.
    Interrupted,
    /// The request is impossible: it has to change.
    Input,
    /// The case is wrong at these places.
    Case(CaseError),
    /// A file cannot be read or written.
    File(ResultError),
    /// The computation failed.
    Computation,
    /// The search for a cycle failed from its start; another start may succeed.
    NoCycle,
    /// Newton's method left this relative residual.
    Diverged(f64),
    /// The executor of a sweep failed; the finished points are in the journal.
    Executor,
}

impl Error {
    pub(crate) fn new(kind: ErrorKind, message: impl ToString) -> Error {
        let message = message.to_string();
        Error { kind, message }
    }

    pub(crate) fn input(message: impl ToString) -> Error {
        Error::new(ErrorKind::Input, message)
    }

    pub(crate) fn computation(message: impl ToString) -> Error {
        Error::new(ErrorKind::Computation, message)
    }

    pub(crate) fn interrupted() -> Error {
        Error::new(ErrorKind::Interrupted, "interrupted")
    }

    /// Whether the observer ended the computation.
    pub fn is_interrupted(&self) -> bool {
        matches!(self.kind, ErrorKind::Interrupted)
    }
}

/// `None` instead of a failure. An interruption stays an error.
pub(crate) fn attempt<T>(result: Result<T, Error>) -> Result<Option<T>, Error> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(error) if error.is_interrupted() => Err(error),
        Err(error) => {
            log::debug!("{error}");
            Ok(None)
        }
    }
}

impl From<CaseError> for Error {
    fn from(error: CaseError) -> Error {
        let message = error.to_string();
        Error::new(ErrorKind::Case(error), message)
    }
}

impl From<ResultError> for Error {
    fn from(error: ResultError) -> Error {
        let message = error.to_string();
        Error::new(ErrorKind::File(error), message)
    }
}

impl From<stickslip_engine::Error> for Error {
    fn from(error: stickslip_engine::Error) -> Error {
        match error.kind {
            stickslip_engine::ErrorKind::Interrupted => Error::interrupted(),
            _ => Error::computation(format!("the motion could not be followed: {error}")),
        }
    }
}

impl From<OracleError> for Error {
    fn from(error: OracleError) -> Error {
        match error {
            OracleError::Interrupted(_) => Error::interrupted(),
            OracleError::BreakawayTest | OracleError::Digits { .. } => Error::input(error),
            error => Error::computation(error),
        }
    }
}
