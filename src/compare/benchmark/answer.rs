//! The answer of a problem, as its folder has it.

use super::super::CompareError;
use super::set::{Combination, SummaryOf};
use crate::input;
use crate::record::EventKind;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::path::Path;

/// What a problem's files say of its answer.
#[derive(Debug)]
pub(super) struct Answer {
    pub statement: Statement,
    pub events: Vec<AnswerEvent>,
    /// The grid, s.
    pub times: Vec<f64>,
    /// The columns of the statement at the grid, and the relative velocity after them if it is none of them.
    pub samples: Vec<Vec<f64>>,
    pub summary: Vec<Valued>,
}

/// What is read of `problem.json`.
#[derive(Debug, Deserialize)]
pub(super) struct Statement {
    pub set: String,
    pub problem: String,
    motion: String,
    pub end_time: f64,
    pub time_scale: f64,
    pub columns: Vec<Column>,
    pub relative_velocity: Combination,
    pub position: String,
    leaves_rest: String,
    pub threshold: Option<f64>,
    pub starts_in_slip: bool,
    system: System,
}

#[derive(Debug, Deserialize)]
pub(super) struct Column {
    pub name: String,
    pub unit: String,
}

#[derive(Debug, Deserialize)]
struct System {
    #[serde(default)]
    kicks: Vec<Kick>,
}

#[derive(Debug, Deserialize)]
struct Kick {
    time: f64,
}

/// An event of `events.csv`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub(super) struct AnswerEvent {
    pub event: usize,
    /// s.
    pub time: f64,
    pub kind: String,
    /// s.
    pub time_uncertainty: f64,
}

#[derive(Debug, Deserialize)]
struct SummaryFile {
    values: Vec<Valued>,
}

/// A number of the motion as a whole.
#[derive(Debug, Deserialize)]
pub(super) struct Valued {
    pub name: String,
    pub unit: String,
    pub value: f64,
    /// Of the value, that are certain.
    pub digits: Option<f64>,
    #[serde(flatten)]
    pub of: SummaryOf,
}

/// The name of the relative velocity as a column.
pub(super) const RELATIVE_VELOCITY: &str = "relative_velocity";

impl Answer {
    /// Reads the files of a problem's folder.
    ///
    /// # Errors
    /// A file that is missing, or of another form.
    pub fn read(folder: &Path) -> Result<Answer, CompareError> {
        if !folder.join("problem.json").is_file() {
            let what = "a folder without problem.json, and no problem of a benchmark set";
            let remedy = "give a result file, or the folder of a problem, such as benchmarks/09-belt-coulomb";
            return Err(CompareError::whole(folder, what, remedy));
        }
        let statement: Statement = json(&folder.join("problem.json"))?;
        let summary: SummaryFile = json(&folder.join("summary.json"))?;
        let events = rows(&folder.join("events.csv"))?;
        let samples: Vec<std::collections::HashMap<String, f64>> = rows(&folder.join("samples.csv"))?;
        let lacks = |name: &str| damaged(&folder.join("samples.csv"), format!("lacks the column {name}"));
        let column = |name: &str| -> Result<Vec<f64>, CompareError> {
            samples
                .iter()
                .map(|row| row.get(name).copied().ok_or_else(|| lacks(name)))
                .collect()
        };
        let times = column("time")?;
        let mut columns: Vec<Vec<f64>> = statement
            .columns
            .iter()
            .map(|of| column(&of.name))
            .collect::<Result<_, CompareError>>()?;
        statement
            .check()
            .map_err(|what| damaged(&folder.join("problem.json"), what))?;
        let increases = times.windows(2).all(|pair| pair[0] < pair[1]);
        if times.len() < 2 || !increases || !columns.iter().flatten().all(|value| value.is_finite()) {
            let what = "needs two rows or more, of finite numbers and in order of time";
            return Err(damaged(&folder.join("samples.csv"), what));
        }
        let events: Vec<AnswerEvent> = events;
        if let Some(event) = events.iter().find(|event| counted(&event.kind).is_none()) {
            let what = format!("{:?} is no kind of event", event.kind);
            return Err(damaged(&folder.join("events.csv"), what));
        }
        if let Some(value) = summary.values.iter().find(|value| !statement.has(&value.of)) {
            let what = format!("the value {:?} follows from nothing that there is", value.name);
            return Err(damaged(&folder.join("summary.json"), what));
        }
        if events.iter().any(|event| !event.time.is_finite())
            || events.windows(2).any(|pair| pair[1].time < pair[0].time)
        {
            return Err(damaged(
                &folder.join("events.csv"),
                "its events are not in order of time",
            ));
        }
        if statement.column(RELATIVE_VELOCITY).is_none() {
            columns.push(statement.relative(times.len(), |name| {
                statement.column(name).map(|index| &columns[index][..])
            }));
        }
        Ok(Answer {
            statement,
            events,
            times,
            samples: columns,
            summary: summary.values,
        })
    }
}

impl Statement {
    /// Whether it can be scored by.
    fn check(&self) -> Result<(), String> {
        let scale = self.time_scale;
        if !(scale > 0.0 && scale.is_finite() && self.end_time.is_finite()) {
            return Err("time_scale and end_time have to be finite, and the scale positive".to_owned());
        }
        let parts = self.relative_velocity.keys().filter(|name| *name != "constant");
        match parts.chain([&self.position]).find(|name| self.column(name).is_none()) {
            Some(name) => Err(format!("{name:?} is none of its columns")),
            None => Ok(()),
        }
    }

    /// Whether a number of the motion follows from what the problem has.
    fn has(&self, of: &SummaryOf) -> bool {
        match of {
            SummaryOf::Events { count, .. } => *count > 0,
            SummaryOf::Extremum { column, between, .. } => self.column(column).is_some() && between[0] < between[1],
            SummaryOf::Samples { column, .. } => self.column(column).is_some(),
        }
    }

    /// The index of a column.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column.name == name)
    }

    /// The relative velocity of so many rows by its columns; without a column that is missing.
    pub fn relative<'a>(&self, rows: usize, column: impl Fn(&str) -> Option<&'a [f64]>) -> Vec<f64> {
        let constant = self.relative_velocity.get("constant").copied().unwrap_or(0.0);
        let mut sum = vec![constant; rows];
        for (name, factor) in &self.relative_velocity {
            for (sum, value) in sum.iter_mut().zip(column(name).unwrap_or_default()) {
                *sum += factor * value;
            }
        }
        sum
    }

    /// "m/s" or "rad/s".
    pub fn velocity_unit(&self) -> &'static str {
        if self.motion == "translation" { "m/s" } else { "rad/s" }
    }

    /// Whether the relative velocity grows linearly after a breakaway.
    pub fn leaves_linearly(&self) -> bool {
        self.leaves_rest == "linear"
    }

    /// Times of the kicks, s.
    pub fn kicks(&self) -> impl Iterator<Item = f64> {
        self.system.kicks.iter().map(|kick| kick.time)
    }
}

fn damaged(path: &Path, what: impl std::fmt::Display) -> CompareError {
    CompareError::whole(
        path,
        format!("cannot be used: {what}"),
        "take this file from the set again",
    )
}

fn text(path: &Path) -> Result<String, CompareError> {
    let text = input::text(path).map_err(CompareError::io(path))?;
    text.map_err(|_| damaged(path, "not UTF-8"))
}

fn json<T: DeserializeOwned>(path: &Path) -> Result<T, CompareError> {
    serde_json::from_str(&text(path)?).map_err(|error| damaged(path, error))
}

fn rows<T: DeserializeOwned>(path: &Path) -> Result<Vec<T>, CompareError> {
    let text = text(path)?;
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let rows = reader.deserialize().collect::<Result<Vec<T>, csv::Error>>();
    rows.map_err(|error| damaged(path, error))
}

/// A kind that counts.
pub(super) fn counted(kind: &str) -> Option<EventKind> {
    match kind.trim().to_lowercase().as_str() {
        "stick" => Some(EventKind::Stick),
        "slip" => Some(EventKind::Slip),
        "reversal" => Some(EventKind::Reversal),
        _ => None,
    }
}
