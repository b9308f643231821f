//! `set.toml` of a benchmark set: what its problems are called, which quantities they ask for, and at which times.

use super::super::CompareError;
use crate::input;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml_edit::DocumentMut;

/// A benchmark set: a folder with `set.toml`, `cases` and a folder for each problem.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProblemSet {
    /// Of the set. Another number of an answer is another version.
    pub version: String,
    /// When this version was published: year, month, day.
    pub date: String,
    /// A name for people.
    pub title: String,
    /// SPDX identifier of the licence of the data.
    pub license: String,
    /// In order of difficulty.
    #[serde(rename = "problem")]
    pub problems: Vec<Problem>,
    /// The folder.
    #[serde(skip)]
    folder: PathBuf,
}

/// What a problem asks for.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Problem {
    /// Of its folder and its case, such as `04-block`.
    pub name: String,
    /// The unit of errors of event times, s.
    pub time_scale: f64,
    /// The column whose error over time is scored.
    pub position: String,
    /// The relative velocity as a sum: columns with their factors, and `constant`.
    pub relative_velocity: Combination,
    /// What a submission states at every time.
    pub columns: Vec<ProblemColumn>,
    /// From, to and step of the times at which the state is given, s.
    pub grid: Vec<[f64; 3]>,
    /// Numbers of the motion as a whole.
    #[serde(default)]
    pub summary: Vec<Summary>,
    /// Bounds that a good solver keeps, by the name of the metric.
    pub budget: Budget,
}

/// Bounds by the form of a candidate.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Budget {
    /// Of one that states events.
    pub events: BTreeMap<String, f64>,
    /// Of one that has samples.
    pub samples: BTreeMap<String, f64>,
}

/// A column of a problem's tables.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(from = "[String; 4]")]
pub struct ProblemColumn {
    /// In the tables.
    pub name: String,
    /// SI.
    pub unit: String,
    /// In words.
    pub meaning: String,
    /// The quantity by the name that comparisons know it by.
    pub channel: String,
}

impl From<[String; 4]> for ProblemColumn {
    fn from([name, unit, meaning, channel]: [String; 4]) -> Self {
        ProblemColumn {
            name,
            unit,
            meaning,
            channel,
        }
    }
}

/// A sum of columns, each with a factor, and of `constant`.
pub type Combination = BTreeMap<String, f64>;

/// A number of the motion as a whole.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Summary {
    /// Such as `period`.
    pub name: String,
    /// In words.
    pub meaning: String,
    /// How it follows from events or samples.
    #[serde(flatten)]
    pub of: SummaryOf,
}

/// How a number of the motion follows from events or samples.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "from", rename_all = "lowercase")]
pub enum SummaryOf {
    /// (time of event `last` - time of event `first`)/`count`, s; -1 is t = 0.
    Events {
        /// Index of the earlier event, or -1.
        first: i64,
        /// Index of the later event.
        last: i64,
        /// How many of the intervals lie between them.
        count: u32,
    },
    /// The largest or smallest value of a column between two times (s), where its `rate` is 0.
    Extremum {
        /// Which column.
        column: String,
        /// Its derivative as a sum: columns with their factors, and `constant`. Only the answers are made with it.
        #[serde(default)]
        rate: Combination,
        /// Largest or smallest.
        what: Extreme,
        /// s.
        between: [f64; 2],
    },
    /// The value of a column at a time of the grid.
    Samples {
        /// Which column.
        column: String,
        /// s.
        time: f64,
    },
}

/// The largest or the smallest value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Extreme {
    /// The largest.
    Maximum,
    /// The smallest.
    Minimum,
}

impl Extreme {
    /// As the set's files have it.
    pub fn name(self) -> &'static str {
        match self {
            Extreme::Maximum => "maximum",
            Extreme::Minimum => "minimum",
        }
    }
}

/// The file that makes a folder a benchmark set.
pub(super) const SET: &str = "set.toml";

impl ProblemSet {
    /// Reads the set in `folder`.
    ///
    /// # Errors
    /// If there is no `set.toml`, or one of another form.
    pub fn open(folder: &Path) -> Result<ProblemSet, CompareError> {
        let path = folder.join(SET);
        let wrong =
            |what: String| CompareError::whole(&path, what, "take the file of a published benchmark set as it is");
        let text = input::text(&path).map_err(CompareError::io(&path))?;
        let text = text.map_err(|_| wrong("not UTF-8".to_owned()))?;
        let document: DocumentMut = text.parse().map_err(|error| wrong(format!("no TOML: {error}")))?;
        let set = input::json_of_toml(document.as_item());
        let mut set: ProblemSet = serde_json::from_value(set).map_err(|error| wrong(error.to_string()))?;
        folder.clone_into(&mut set.folder);
        Ok(set)
    }

    /// The set's folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The case that a problem's answers are made from.
    pub fn case_of(&self, problem: &Problem) -> PathBuf {
        self.folder.join("cases").join(&problem.name).with_extension("toml")
    }
}

impl Problem {
    /// The index of a column.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column.name == name)
    }
}
