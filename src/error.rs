//! The error of figures, exports and commands.

#![cfg_attr(not(feature = "cli"), allow(dead_code, reason = "only commands need all of it"))]

use serde::Serialize;
use std::fmt::{self, Display, Formatter};
use std::io;
use std::path::Path;
use stickslip_analysis::ErrorKind as AnalysisKind;
use stickslip_case::{CaseError, CaseProblem, suggest};
use stickslip_compare::CompareError;
use stickslip_files::{Reason, ResultError};

/// The reason why a figure, an export or a command failed: one short paragraph with the remedy.
#[derive(Debug)]
pub struct Error {
    pub(crate) kind: ErrorKind,
    pub(crate) text: String,
    pub(crate) places: Vec<FailurePlace>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ErrorKind {
    /// Usage or input is wrong.
    Input,
    /// There are no samples in a range of times.
    NothingInRange,
    /// A file of another kind, or of a newer version.
    AnotherKind,
    Computation,
    /// The reader of a pipe has closed it.
    BrokenPipe,
}

/// Location of an error.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub(crate) struct FailurePlace {
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

impl Error {
    fn new(kind: ErrorKind, text: impl Display) -> Error {
        Error {
            kind,
            text: text.to_string(),
            places: Vec::new(),
        }
    }

    pub(crate) fn input(text: impl Display) -> Error {
        Error::new(ErrorKind::Input, text)
    }

    pub(crate) fn computation(text: impl Display) -> Error {
        Error::new(ErrorKind::Computation, text)
    }

    pub(crate) fn drawing(error: impl Display) -> Error {
        Error::computation(format!("drawing failed: {error}"))
    }

    /// Wrong input in a file.
    pub(crate) fn of_file(path: &Path, why: impl Display) -> Error {
        Error::input(format!("{}: {why}", path.display()))
    }

    /// The error with the file as its place.
    pub(crate) fn placed(mut self, path: &Path) -> Error {
        self.places.push(FailurePlace {
            file: Some(path.display().to_string()),
            ..FailurePlace::default()
        });
        self
    }

    /// An unknown `name` of a file's `what`, such as "the study has no quantity".
    pub(crate) fn unknown(what: impl Display, name: &str, known: &[&str], further: &str) -> Error {
        let close = suggest(name, known.iter().copied());
        let hint = close.map_or_else(String::new, |close| format!(" (did you mean {close}?)"));
        Error::input(format!(
            "{what} \"{name}\"{hint}; there are {}{further}",
            known.join(", ")
        ))
    }

    /// A file that cannot be read or written. A wrong folder is an input error, in the words of results.
    pub(crate) fn io(path: &Path, action: &'static str, error: io::Error, option: &str) -> Error {
        let known = ResultError::io(path, action, error.kind().into());
        if let Reason::NoFolder(_) | Reason::NoPermission(_) | Reason::ReadOnly = known.reason {
            let text = known.to_string();
            let text = text.strip_suffix("-o").unwrap_or(&text);
            return Error::input(format!("{text}{option}")).placed(path);
        }
        let kind = match error.kind() {
            io::ErrorKind::BrokenPipe => ErrorKind::BrokenPipe,
            _ => ErrorKind::Computation,
        };
        let error = error.to_string();
        // The path is that of a temporary file.
        let why = error.split(" at path ").next().unwrap_or_default();
        let remedy = format!("check the folder and its disk, or choose another with {option}");
        Error::new(kind, format!("{}: {action} failed: {why}; {remedy}", path.display()))
    }

    /// A temporary file that cannot be written.
    pub(crate) fn temporary(error: io::Error) -> Error {
        Error::computation(format!(
            "{}: the folder for temporary files: {error}; free some space there, or name another folder in the environment variable \
             TMPDIR",
            std::env::temp_dir().display()
        ))
    }

    /// Keys whose values are wrong. An unknown key is none.
    pub(crate) fn keys(&self) -> impl Iterator<Item = &str> {
        let is_known = |place: &&FailurePlace| {
            place
                .message
                .as_ref()
                .is_none_or(|text| !text.starts_with("unknown key"))
        };
        let places = self.places.iter().filter(is_known);
        places.filter_map(|place| place.key.as_deref())
    }

    /// Whether usage or input is wrong, rather than the computation.
    pub fn is_input(&self) -> bool {
        !matches!(self.kind, ErrorKind::Computation | ErrorKind::BrokenPipe)
    }
}

impl Display for Error {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl std::error::Error for Error {}

impl From<CaseError> for Error {
    fn from(error: CaseError) -> Self {
        Error {
            places: error.problems.iter().map(place_of).collect(),
            ..Error::input(error)
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

impl From<ResultError> for Error {
    fn from(error: ResultError) -> Self {
        let kind = match error.reason {
            _ if error.is_of_the_system() => ErrorKind::Computation,
            Reason::NotAResult(_) | Reason::Newer { .. } | Reason::AnotherKind(_) => ErrorKind::AnotherKind,
            _ => ErrorKind::Input,
        };
        let file = Some(error.path.display().to_string()).filter(|path| !path.is_empty());
        let place = file.map(|file| FailurePlace {
            file: Some(file),
            ..FailurePlace::default()
        });
        Error {
            places: place.into_iter().collect(),
            ..Error::new(kind, error)
        }
    }
}

impl From<CompareError> for Error {
    fn from(error: CompareError) -> Self {
        match error {
            CompareError::Result(error) => error.into(),
            _ => Error::input(error),
        }
    }
}

impl From<stickslip_analysis::Error> for Error {
    fn from(error: stickslip_analysis::Error) -> Self {
        match error.kind {
            // The message may say more than the error of the case.
            AnalysisKind::Case(case) => Error {
                text: error.message,
                ..case.into()
            },
            AnalysisKind::File(file) => Error {
                text: error.message,
                ..file.into()
            },
            AnalysisKind::Input => Error::input(error.message),
            _ => Error::computation(error.message),
        }
    }
}
