//! The header of a result file, and the status of its run.

use super::{AttributeValue, schema};

/// What a result file says about its run, known before the run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Header {
    /// Of the case; root attribute `title`.
    pub title: String,
    /// The program that computed it, with its version; root attribute `source`.
    pub source: String,
    /// Where the model is published; root attribute `references`.
    pub references: String,
    /// One line: when, and by which command; root attribute `history`.
    pub history: String,
    /// The TOML text as given.
    pub case_text: String,
    /// Every parameter in SI and in full precision, as TOML.
    pub resolved: String,
    /// Attributes of /meta: versions, platform, command line, method, tolerances, start.
    pub meta: Vec<(String, AttributeValue)>,
    /// Attributes of /events: how its times were found.
    pub events: Vec<(String, AttributeValue)>,
    /// What the tables have beyond those of every file.
    pub extension: schema::Extension,
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Status {
    /// To the end of the case.
    Complete,
    /// By the user or by a kill; what was computed until then is good.
    Interrupted,
    /// With this message; what was computed until then is good.
    Failed(String),
}

impl Status {
    /// Root attribute `status`.
    pub fn name(&self) -> &'static str {
        match self {
            Status::Complete => "complete",
            Status::Interrupted => "interrupted",
            Status::Failed(_) => "failed",
        }
    }
}
