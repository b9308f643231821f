//! Header of a result file, and status of its run.

use super::{AttributeValue, schema};

/// Metadata of a run, known before it starts.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Header {
    /// Title of the case; root attribute `title`.
    pub title: String,
    /// Program with its version; root attribute `source`.
    pub source: String,
    /// Publication of the model; root attribute `references`.
    pub references: String,
    /// Date and command in one line; root attribute `history`.
    pub history: String,
    /// The TOML text as given.
    pub case_text: String,
    /// Every parameter in SI and in full precision, as TOML.
    pub resolved: String,
    /// Attributes of /meta: versions, platform, command line, method, tolerances, start.
    pub meta: Vec<(String, AttributeValue)>,
    /// Attributes of /events: method of location.
    pub events: Vec<(String, AttributeValue)>,
    /// Columns beyond those of every file.
    pub extension: schema::Extension,
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Status {
    /// The run reached the end of the case.
    Complete,
    /// The user or a kill ended the run; the results until then are good.
    Interrupted,
    /// The run failed with this message; the results until then are good.
    Failed(String),
}

impl Status {
    /// Status of a computation that has not failed.
    pub fn of(interrupted: bool) -> Status {
        match interrupted {
            true => Status::Interrupted,
            false => Status::Complete,
        }
    }

    /// Root attribute `status`.
    pub fn name(&self) -> &'static str {
        match self {
            Status::Complete => "complete",
            Status::Interrupted => "interrupted",
            Status::Failed(_) => "failed",
        }
    }
}
