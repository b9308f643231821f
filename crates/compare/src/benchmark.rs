//! A benchmark set: problems with certified answers, stated without this program. Its `check.py` scores solutions.

use super::CompareError;
use super::candidate::{Candidate, Mapping, TimeOffset};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use stickslip_case::{Case, CaseSource, input};
use stickslip_system::quote::in_shell;
use tempfile::TempDir;
use toml_edit::DocumentMut;

#[derive(Debug)]
pub(super) struct BenchmarkProblem {
    pub folder: PathBuf,
    pub columns: Vec<ProblemColumn>,
    /// The folder of the run; dropping it deletes the folder.
    run: TempDir,
}

const RUN: &str = "run.h5";

impl BenchmarkProblem {
    /// Reads the problem in `folder`. `integrate` runs its case into a result file at the given path.
    pub fn open(
        folder: &Path,
        integrate: impl FnOnce(&Case, &Path) -> Result<(), String>,
    ) -> Result<BenchmarkProblem, CompareError> {
        let path = folder.canonicalize().map_err(CompareError::io(folder))?;
        let beside = path.parent().unwrap_or(Path::new("/"));
        let not_a_problem = |what: &str| {
            let remedy =
                "give a result file, or the folder of a problem in its set, such as benchmarks/09-belt-coulomb";
            CompareError::whole(folder, what, remedy)
        };
        if !beside.join(SET).is_file() {
            return Err(not_a_problem(
                "a folder without a set.toml beside it, and no problem of a benchmark set",
            ));
        }
        let set = ProblemSet::open(beside)?;
        let name = path.file_name().unwrap_or_default();
        let problem = set.problems.iter().find(|problem| *problem.name == *name);
        let problem = problem.ok_or_else(|| not_a_problem("no problem in the set.toml beside it"))?;
        let case = set.case_of(problem);
        let failed = |error: &dyn std::fmt::Display| {
            CompareError::whole(&case, format!("cannot be run: {error}"), "take the set again")
        };
        let read = CaseSource::file(&case).and_then(|source| Case::read(&source, &[]));
        let read = read.map_err(|error| failed(&error))?;
        let run = tempfile::tempdir().map_err(CompareError::temporary)?;
        integrate(&read, &run.path().join(RUN)).map_err(|error| failed(&error))?;
        Ok(BenchmarkProblem {
            folder: folder.to_owned(),
            columns: problem.columns.clone(),
            run,
        })
    }

    /// The command of the set's checker, for a candidate that it can read: CSV with its names of the columns, or events.
    pub fn score_command(&self, path: &Path, candidate: &Candidate, mapping: &Mapping) -> Option<String> {
        let known = |name: &String| {
            ["time", "relative_velocity"].contains(&name.as_str()) || self.columns.iter().any(|c| c.name == *name)
        };
        let is_text = || {
            path.extension()
                .is_none_or(|extension| extension != "npz" && extension != "h5")
        };
        let is_read = match candidate.format {
            "CSV" => candidate.columns().iter().all(known),
            "events table" => is_text(),
            _ => false,
        };
        let is_plain = mapping.kinds.is_empty() && matches!(mapping.time_offset, TimeOffset::None);
        if !is_read || !is_plain {
            return None;
        }
        let folder = &self.folder;
        let checker = match folder.file_name() {
            Some(_) => folder.with_file_name("check.py"),
            None => folder.join("../check.py"),
        };
        let mut command = "python3".to_owned();
        for path in [&checker, folder, path] {
            command += &format!(" {}", in_shell(&path.to_string_lossy()));
        }
        if let Some(events) = &mapping.event_file {
            command += &format!(" --events {}", in_shell(&events.to_string_lossy()));
        }
        if let Some(threshold) = mapping.velocity_tolerance {
            command += &format!(" --threshold {threshold:e}");
        }
        if let Some(hysteresis) = mapping.hysteresis {
            command += &format!(" --hysteresis {hysteresis}");
        }
        Some(command)
    }

    pub fn run(&self) -> PathBuf {
        self.run.path().join(RUN)
    }
}

/// A benchmark set: a folder with `set.toml`, `cases` and a folder for each problem.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProblemSet {
    /// Version of the set. It changes when an answer changes.
    pub version: String,
    /// Date of publication: year, month, day.
    pub date: String,
    /// Title for readers.
    pub title: String,
    /// SPDX identifier of the licence of the data.
    pub license: String,
    /// Problems in order of difficulty.
    #[serde(rename = "problem")]
    pub problems: Vec<Problem>,
    #[serde(skip)]
    folder: PathBuf,
}

/// A problem: its quantities, times and error bounds.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Problem {
    /// Name of the folder and the case, such as `04-block`.
    pub name: String,
    /// The unit of errors of event times, s.
    pub time_scale: f64,
    /// The column whose error over time is scored.
    pub position: String,
    /// The relative velocity as a linear combination of columns and `constant`.
    pub relative_velocity: Combination,
    /// Columns of a submission.
    pub columns: Vec<ProblemColumn>,
    /// Times at which the state is given: from, to and step, s.
    pub grid: Vec<[f64; 3]>,
    /// Summary values of the motion.
    #[serde(default)]
    pub summary: Vec<ProblemSummary>,
    /// Upper bounds of the metrics, by name, that a good solver keeps.
    pub budget: Budget,
}

/// Upper bounds by the form of a candidate.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Budget {
    /// Candidates that state events.
    pub events: BTreeMap<String, f64>,
    /// Candidates with samples.
    pub samples: BTreeMap<String, f64>,
}

/// A column of a problem's tables.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(from = "[String; 4]")]
pub struct ProblemColumn {
    /// Name in the tables.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Meaning in words.
    pub meaning: String,
    /// Name of the channel in comparisons.
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

/// A linear combination: a factor for each column, and `constant`.
pub type Combination = BTreeMap<String, f64>;

/// A summary value of the motion.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct ProblemSummary {
    /// Name, such as `period`.
    pub name: String,
    /// Meaning in words.
    pub meaning: String,
    /// Derivation from events or samples.
    #[serde(flatten)]
    pub of: SummaryOf,
}

/// Derivation of a summary value from events or samples.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "from", rename_all = "lowercase")]
pub enum SummaryOf {
    /// (time of event `last` - time of event `first`)/`count`, s; -1 is t = 0.
    Events {
        /// Index of the earlier event, or -1.
        first: i64,
        /// Index of the later event.
        last: i64,
        /// Number of intervals between the two.
        count: u32,
    },
    /// Largest or smallest value of a column between two times (s), at a zero of its `rate`.
    Extremum {
        /// Name of the column.
        column: String,
        /// Derivative of the column as a linear combination. Only the certified answers use it.
        #[serde(default)]
        rate: Combination,
        /// Largest or smallest.
        what: Extreme,
        /// First and last time, s.
        between: [f64; 2],
    },
    /// Value of a column at a time of the grid.
    Samples {
        /// Name of the column.
        column: String,
        /// Time, s.
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
    /// Name in the set's files.
    pub fn name(self) -> &'static str {
        match self {
            Extreme::Maximum => "maximum",
            Extreme::Minimum => "minimum",
        }
    }
}

const SET: &str = "set.toml";

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

    /// Folder of the set.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Path of the case that a problem's answers are computed from.
    pub fn case_of(&self, problem: &Problem) -> PathBuf {
        self.folder.join("cases").join(&problem.name).with_extension("toml")
    }
}

impl Problem {
    /// Index of a column.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column.name == name)
    }
}
