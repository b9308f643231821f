//! The headline of a run of two trains as a reader sees it: each quantity in words, with the digits that are known.

use crate::analysis::Summary;
use crate::analysis::attractor::{Attractor, Extremes, LONGEST_PERIOD};
use crate::analysis::headline::{HeadlineRow, events};
use crate::analysis::summary::{Outcome, TURNOVER, residual_row, share_of};
use crate::case::{Motion, TrainCase};
use crate::record::{CycleStatistics, Event};
use crate::results::{ResultError, ResultFile, Status, StickSlipTable};
use crate::simulation::trains::position_of;

/// The units of a motion: of position and speed.
fn units(motion: Motion) -> (&'static str, &'static str) {
    match motion {
        Motion::Rotation => ("rad", "rad/s"),
        Motion::Translation => ("m", "m/s"),
    }
}

/// Decimals that an absolute uncertainty leaves, at most so many.
pub(crate) fn decimals(uncertainty: f64, most: usize) -> usize {
    (-uncertainty.max(f64::MIN_POSITIVE).log10())
        .floor()
        .clamp(0.0, most as f64) as usize
}

/// A number with the decimals that an absolute uncertainty leaves it, at most twelve.
fn known(value: f64, uncertainty: f64) -> String {
    let text = format!("{value:.*}", decimals(uncertainty, 12));
    // No sign before a zero.
    match text.strip_prefix('-') {
        Some(zero) if zero.bytes().all(|b| b == b'0' || b == b'.') => zero.to_owned(),
        _ => text,
    }
}

/// The lines, in the order in which they are read.
pub fn rows(motion: Motion, summary: &Summary) -> Vec<HeadlineRow> {
    let (angle, speed) = units(motion);
    let none = || "none".to_owned();
    let seconds = |t: Option<f64>| t.map_or_else(none, |t| format!("{t:.9} s"));
    let range =
        |range: Option<(f64, f64)>| range.map_or_else(none, |(least, most)| format!("{least:.9} to {most:.9} s"));
    let mut rows = Vec::new();
    let mut row = |name: &'static str, value: String| rows.push(HeadlineRow { name, value, paper: "" });
    row("events", events(&summary.stick_slip));
    row("first stick", seconds(summary.onset_time));
    row("slip duration, range", range(summary.slip_duration_range));
    row("stick duration, range", range(summary.stick_duration_range));
    match &summary.outcome {
        Some(Outcome::Periodic(Attractor {
            period,
            sticks,
            agreement,
            distance,
            since,
            extremes,
            ..
        })) => {
            let known = |value: f64, size: f64| known(value, size * distance);
            row("motion", format!("periodic since {since:.6} s"));
            row("period", format!("{} s", known(*period, *period)));
            // Without a stick, a bounce across the threshold is one as well.
            let crossings = "falls below the threshold in a period";
            let name = summary.stick_threshold.map_or("sticks in a period", |_| crossings);
            row(name, sticks.to_string());
            if let Some(extremes) = extremes {
                let (least, most) = extremes.position;
                let size = least.abs().max(most.abs());
                let (least, most) = (known(least, size), known(most, size));
                row(
                    "position over a period",
                    format!("{least} to {most} {angle} ({})", extremes.of),
                );
                if let Some(amplitude) = extremes.amplitude {
                    row("amplitude", format!("{} {angle}", known(amplitude, size)));
                }
                let (least, most) = extremes.relative_velocity;
                // Files of earlier versions do not have it.
                if !(least.is_nan() || most.is_nan()) {
                    let size = least.abs().max(most.abs());
                    let (least, most) = (known(least, size), known(most, size));
                    row("relative velocity over a period", format!("{least} to {most} {speed}"));
                }
            }
            row(
                "last two cycles differ by",
                format!("{agreement:.1e}, relative; from the periodic motion by {distance:.1e}"),
            );
        }
        Some(Outcome::Stuck { since }) => row(
            "motion",
            format!("no period found; in stick from {since:.9} s to the end of the run"),
        ),
        Some(Outcome::NotPeriodic) => row(
            "motion",
            format!("no period of at most {LONGEST_PERIOD} breakaways and reversals found"),
        ),
        Some(Outcome::Steady { mode }) => row("motion", format!("no event: mode {mode} all the time")),
        None => {}
    }
    if let Some(threshold) = summary.stick_threshold {
        row(
            "counted as a stick",
            format!("each fall of |relative velocity| below {threshold:e} {speed}: the contact has no stick"),
        );
    }
    let relative = summary.energy_residual_relative;
    row("energy residual", residual_row(summary.energy_residual, relative));
    rows
}

/// The headline of a result file whose case is `case` and whose events are `events`: without what a killed run could not
/// write any more.
///
/// # Errors
/// If the file cannot be read.
pub fn of_file(file: &ResultFile, case: &TrainCase, events: &[Event]) -> Result<Vec<HeadlineRow>, ResultError> {
    let table = file.stick_slip()?;
    let summary = summary_of(file, case, events, table.as_ref())?;
    let mut rows = rows(case.motion, &summary);
    if table.is_none() {
        // What a run comes to, and what it loses, is written at its end.
        rows.retain(|row| row.name != "motion" && row.name != "energy residual");
    }
    Ok(rows)
}

fn summary_of(
    file: &ResultFile,
    case: &TrainCase,
    events: &[Event],
    table: Option<&StickSlipTable>,
) -> Result<Summary, ResultError> {
    let extra = |name: &str| {
        let extras = table.iter().flat_map(|table| &table.extras);
        let found = extras.into_iter().find(|extra| extra.name == name);
        found.map(|extra| extra.value).filter(|value| !value.is_nan())
    };
    let mut stick_slip = CycleStatistics::default();
    for event in events {
        stick_slip.push(event.time, event.kind);
    }
    let samples = file.sample_count()?;
    let last = file.samples(samples.saturating_sub(1)..samples)?;
    let position = extra("attractor_position_min").zip(extra("attractor_position_max"));
    let velocity = |end: &str| extra(&format!("attractor_relative_velocity_{end}")).unwrap_or(f64::NAN);
    let attractor = extra("attractor_period").map(|period| Attractor {
        period,
        sticks: extra("attractor_sticks").unwrap_or(0.0) as u64,
        sections: 0,
        agreement: extra("attractor_agreement").unwrap_or(f64::NAN),
        distance: extra("attractor_distance").unwrap_or(f64::NAN),
        since: extra("attractor_since").unwrap_or(f64::NAN),
        extremes: position.map(|position| Extremes {
            of: position_of(&case.parameters),
            position,
            amplitude: extra("attractor_amplitude"),
            relative_velocity: (velocity("min"), velocity("max")),
        }),
    });
    let residual = table.map_or(f64::NAN, |table| table.energy_residual_max);
    let energy_turnover = extra(TURNOVER).unwrap_or(f64::NAN);
    let summary = Summary {
        end: last.last().map_or(f64::NAN, |sample| sample.time),
        events: events.len(),
        last_event_time: events
            .iter()
            .rfind(|event| event.kind.in_event_sequence())
            .map(|event| event.time),
        stick_threshold: case.threshold,
        energy_residual: residual,
        energy_turnover,
        energy_residual_relative: share_of(residual, energy_turnover),
        interrupted: *file.status() == Status::Interrupted,
        ..Summary::of_cycles(stick_slip)
    };
    Ok(summary.coming_to(attractor, last.last().map_or("", |last| last.mode.name())))
}
