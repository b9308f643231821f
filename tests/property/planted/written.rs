//! What a candidate's file shows: its columns, digits and events.

use super::filing::Filing;
use super::subject::Subject;
use crate::common::planted_solver::{Solved, Solver};
use std::fmt::Write;

/// How a candidate is written.
#[derive(Debug, Clone)]
pub(super) struct Written {
    pub interval: f64,
    pub digits: Digits,
    pub columns: Columns,
    /// With a table of events beside it.
    pub events: bool,
    /// A table of events alone.
    pub alone: bool,
    /// What is said to count as a stick, rad/s.
    pub tolerance: Option<f64>,
    /// Added to the times.
    pub clock: f64,
    /// A column (from 0), and its factor.
    pub changed: Option<(usize, f64)>,
    /// What is done to the rows.
    pub filing: Option<Filing>,
}

impl Written {
    /// Interval of the rows of the motion from which the file's rows are made, s.
    pub fn interval_of_motion(&self) -> f64 {
        self.interval / self.filing.map_or(1, Filing::rows_in_an_interval) as f64
    }

    /// With all digits, as samples of this interval (s).
    pub fn sound(interval: f64) -> Written {
        Written {
            interval,
            digits: Digits::All,
            columns: Columns::State,
            events: false,
            alone: false,
            tolerance: None,
            clock: 0.0,
            changed: None,
            filing: None,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Digits {
    All,
    Significant(usize),
    Decimals(usize),
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Columns {
    State,
    RelativeVelocity,
    /// The states without the relative velocity.
    Plain,
}

impl Digits {
    pub fn write(self, value: f64) -> String {
        match self {
            Digits::All => format!("{value:?}"),
            Digits::Significant(n) => format!("{value:.*e}", n - 1),
            Digits::Decimals(n) => format!("{value:.n$}"),
        }
    }

    /// Half a unit of the last digit.
    pub fn resolves(self, value: f64) -> f64 {
        match self {
            Digits::All => 0.0,
            Digits::Significant(n) => value.abs() * 10f64.powi(-(n as i32)),
            Digits::Decimals(n) => 0.5 * 10f64.powi(-(n as i32)),
        }
    }
}

/// The columns of a candidate: their names, and which channels of the solver they are.
pub(super) fn columns(system: &Subject, solver: &Solver, columns: Columns) -> Vec<(usize, String)> {
    let vocabulary = system.vocabulary();
    let mut seen = Vec::new();
    let mut found = Vec::new();
    for (index, names) in solver.channels().into_iter().enumerate() {
        if columns == Columns::RelativeVelocity && index > 0 || columns == Columns::Plain && index == 0 {
            continue;
        }
        let known = names.into_iter().find_map(|name| Some((vocabulary.find(&name)?, name)));
        if let Some((channel, name)) = known {
            let canonical = vocabulary.canonical(channel);
            if !seen.contains(&canonical) {
                seen.push(canonical);
                found.push((index, name));
            }
        }
    }
    found
}

/// Name that a comparison gives to a column.
pub(super) fn channel_name(system: &Subject, column: &str) -> String {
    let vocabulary = system.vocabulary();
    let channel = vocabulary.find(column).unwrap();
    vocabulary.canonical(channel).unwrap_or(channel).name().into_owned()
}

/// Times and columns of a file, with all digits.
pub(super) fn table(system: &Subject, solver: &Solver, solved: &Solved, file: &Written) -> (Vec<f64>, Vec<Vec<f64>>) {
    let names = columns(system, solver, file.columns);
    let mut time: Vec<f64> = solved.rows.iter().map(|(time, ..)| time + file.clock).collect();
    let rows = solved.rows.iter().map(|(time, y, doing)| solver.row(*time, y, *doing));
    let rows: Vec<Vec<f64>> = rows.collect();
    let column = |(place, (index, _)): (usize, &(usize, String))| -> Vec<f64> {
        let factor = file
            .changed
            .filter(|(changed, _)| *changed == place)
            .map_or(1.0, |of| of.1);
        rows.iter().map(|row| factor * row[*index]).collect()
    };
    let mut values: Vec<Vec<f64>> = names.iter().enumerate().map(column).collect();
    if let Some(filing) = file.filing {
        let names: Vec<&str> = names.iter().map(|(_, name)| name.as_str()).collect();
        filing.apply(&mut time, &mut values, &names);
    }
    (time, values)
}

pub(super) fn csv(system: &Subject, solver: &Solver, solved: &Solved, file: &Written) -> String {
    let (time, values) = table(system, solver, solved, file);
    let mut text = "time".to_owned();
    let names = columns(system, solver, file.columns);
    names.iter().for_each(|(_, name)| write!(text, ",{name}").unwrap());
    text.push('\n');
    for (row, time) in time.iter().enumerate() {
        text += &file.digits.write(*time);
        for column in &values {
            text.push(',');
            text += &file.digits.write(column[row]);
        }
        text.push('\n');
    }
    text
}

/// The largest rms of what is done to a column of a file, in parts of the rms of the column; rows are paired from the last.
pub(super) fn differs_by_filing(system: &Subject, solver: &Solver, file: &Written, solved: &Solved) -> f64 {
    let right = Written {
        filing: file.filing.map(|filing| match filing {
            // Every second row as it is.
            Filing::HalfStep(_) => Filing::HalfStep(0),
            _ => Filing::Rate(1.0),
        }),
        ..file.clone()
    };
    let [(time, filed), (right_time, right)] = [file, &right].map(|file| table(system, solver, solved, file));
    let off = |a: &[f64], b: &[f64]| {
        let pairs = a.iter().rev().zip(b.iter().rev());
        let (off, size) = pairs.fold((0.0, 0.0), |(off, size), (a, b)| {
            (off + (a - b) * (a - b), size + b * b)
        });
        if size > 0.0 { (off / size).sqrt() } else { 0.0 }
    };
    // A time is off in parts of a period.
    let late = time
        .iter()
        .rev()
        .zip(right_time.iter().rev())
        .map(|(a, b)| (a - b).abs() / solver.period());
    let columns = filed.iter().zip(&right).map(|(filed, right)| off(filed, right));
    columns.chain(late).fold(0.0, f64::max)
}

pub(super) fn event_table(solved: &Solved, file: &Written) -> String {
    let mut text = "time,kind\n".to_owned();
    for (time, kind) in &solved.events {
        writeln!(text, "{},{kind}", file.digits.write(time + file.clock)).unwrap();
    }
    text
}

/// The largest rms of a channel's difference in parts of the rms of the channel.
pub(super) fn differs(system: &Subject, solver: &Solver, file: &Written, one: &Solved, other: &Solved) -> f64 {
    let columns = columns(system, solver, file.columns);
    let mut worst: f64 = 0.0;
    for (index, _) in columns {
        let (mut off, mut size) = (0.0, 0.0);
        for (a, b) in one.rows.iter().zip(&other.rows) {
            let [x, z] = [a, b].map(|(t, y, doing)| solver.row(*t, y, *doing)[index]);
            off += (x - z) * (x - z);
            size += z * z;
        }
        if size > 0.0 {
            worst = worst.max((off / size).sqrt());
        }
    }
    worst
}

/// What the digits of a file resolve, in parts of the rms of the channel that they resolve best.
pub(super) fn resolved(system: &Subject, solver: &Solver, file: &Written, solved: &Solved) -> f64 {
    let columns = columns(system, solver, file.columns);
    let of = |(index, _): &(usize, String)| {
        let values = solved
            .rows
            .iter()
            .map(|(t, y, doing)| solver.row(*t, y, *doing)[*index]);
        let (squares, digits, count) = values.fold((0.0, 0.0, 0.0), |(squares, digits, count), value| {
            let off = file.digits.resolves(value);
            (squares + value * value, digits + off * off, count + 1.0)
        });
        if squares == 0.0 || count == 0.0 {
            0.0
        } else {
            (digits / squares).sqrt()
        }
    };
    columns.iter().map(of).fold(f64::INFINITY, f64::min)
}
