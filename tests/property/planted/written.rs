//! What a candidate's file shows: its columns, digits and events.

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
}

impl Written {
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

pub(super) fn csv(system: &Subject, solver: &Solver, solved: &Solved, file: &Written) -> String {
    let columns = columns(system, solver, file.columns);
    let mut text = "time".to_owned();
    columns.iter().for_each(|(_, name)| write!(text, ",{name}").unwrap());
    text.push('\n');
    for (time, y, doing) in &solved.rows {
        let mut row = solver.row(*time, y, *doing);
        text += &file.digits.write(time + file.clock);
        for (place, (index, _)) in columns.iter().enumerate() {
            if let Some((_, factor)) = file.changed.filter(|(changed, _)| *changed == place) {
                row[*index] *= factor;
            }
            text.push(',');
            text += &file.digits.write(row[*index]);
        }
        text.push('\n');
    }
    text
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
