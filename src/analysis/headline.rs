//! The headline of a run as a reader sees it: each quantity in words, beside the paper's number.

use super::attractor::{Attractor, Extremes, LONGEST_PERIOD};
use super::summary::{Outcome, Summary, TURNOVER, residual_row, share_of};
use crate::case::{Case, CaseSource, Motion, builtin};
use crate::record::{CycleStatistics, Event, EventDigest, EventKind};
use crate::results::{ResultError, ResultFile, Status, StickSlipTable};
use crate::simulation::{natural_period, position_of};
use serde::Serialize;

/// The paper's own numbers (its sections 4.2 to 4.5), beside which the built-in case is put.
pub mod paper {
    /// Onset of stick-slip.
    pub(crate) const ONSET: &str = "6.975 s";
    /// Stick for good.
    pub(crate) const FINAL_STICK: &str = "6.9896 s";
    /// Duration of the first stick.
    pub(crate) const FIRST_STICK: &str = "50 us";
    /// Duration of the last stick that ends.
    pub const LAST_STICK: &str = "530 us";
    /// Duration of a slip.
    pub const SLIP: &str = "190 us";
    /// How the duration of the slips changes.
    pub(crate) const SLIP_RANGE: &str = "nearly constant";
    /// T_n.
    pub(crate) const NATURAL_PERIOD: &str = "240 us";
    /// T_i / T_n.
    pub(crate) const FIRST_PERIOD: &str = "1";
    /// T_f / T_n.
    pub(crate) const LAST_PERIOD: &str = "3";
    /// Axial displacement under the full force.
    pub const AXIAL: &str = "0.04 mm";
}

/// One line of the headline.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct HeadlineRow {
    /// What it is.
    pub name: &'static str,
    /// This run's value with its unit; "none" where the run has no such thing.
    pub value: String,
    /// The paper's value, empty where it gives none.
    pub paper: &'static str,
}

/// The lines of a run of `case` that comes to `summary`, in the order in which they are read. The numbers of the paper stand
/// beside those of its own case.
pub fn headline(case: &Case, summary: &Summary) -> Vec<HeadlineRow> {
    rows(Some(case), summary)
}

/// The same of a run whose case may be unknown.
fn rows(case: Option<&Case>, summary: &Summary) -> Vec<HeadlineRow> {
    let mut rows = match case.filter(|case| !case.stops()) {
        Some(case) => of_motion(case.motion(), summary),
        None => of_stop(summary),
    };
    if !case.is_some_and(is_paper_case) {
        rows.iter_mut().for_each(|row| row.paper = "");
    }
    rows
}

/// The lines of a result file with these events; `case` is its resolved case, if this program can read it. What a killed run could
/// not write any more is "none", or has no line.
///
/// # Errors
/// If the file cannot be read.
pub fn of_file(file: &ResultFile, case: Option<&Case>, events: &[Event]) -> Result<Vec<HeadlineRow>, ResultError> {
    let table = file.stick_slip()?;
    let summary = summary_of_file(file, case, events, table.as_ref())?;
    let mut rows = rows(case, &summary);
    if table.is_none() && case.is_some_and(|case| !case.stops()) {
        // What a run comes to, and what it loses, is written at its end.
        rows.retain(|row| row.name != "motion" && row.name != "energy residual");
    }
    Ok(rows)
}

fn summary_of_file(
    file: &ResultFile,
    case: Option<&Case>,
    events: &[Event],
    table: Option<&StickSlipTable>,
) -> Result<Summary, ResultError> {
    let known = |value: f64| (!value.is_nan()).then_some(value);
    let of_table = |value: fn(&StickSlipTable) -> f64| table.map(value).and_then(known);
    let extra = |name: &str| {
        let extras = table.iter().flat_map(|table| &table.extras);
        let found = extras.into_iter().find(|extra| extra.name == name);
        found.and_then(|extra| known(extra.value))
    };
    let mut stick_slip = CycleStatistics::default();
    for event in events {
        stick_slip.push(event.time, event.kind);
    }
    let samples = file.sample_count()?;
    let first = file.samples(0..samples.min(1))?;
    let last = file.samples(samples.saturating_sub(1)..samples)?;
    // Files of earlier versions do not have the energy turned over.
    let at_start = first
        .first()
        .filter(|_| case.is_none_or(crate::case::Case::stops))
        .map(|first| first.channels.energy_kinetic + first.channels.energy_elastic);
    let energy_turnover = extra(TURNOVER).or(at_start).unwrap_or(f64::NAN);
    let energy_residual = of_table(|table| table.energy_residual_max).unwrap_or(f64::NAN);
    let summary = Summary {
        end: last.last().map_or(f64::NAN, |sample| sample.time),
        events: events.len(),
        instability_time: extra("instability_time").or_else(|| instability_of(case?, events)),
        growth_exponent: of_table(|table| table.growth_exponent),
        growth_to_onset: extra("growth_to_onset"),
        e_folds_gained: of_table(|table| table.e_folds_gained),
        kick_above_noise: extra("kick_above_noise"),
        energy_residual,
        energy_turnover,
        energy_residual_relative: share_of(energy_residual, energy_turnover),
        interrupted: *file.status() == Status::Interrupted,
        last_event_time: events
            .iter()
            .rfind(|event| event.kind.in_event_sequence())
            .map(|event| event.time),
        ..Summary::of_cycles(stick_slip)
    };
    let Some(case) = case else {
        return Ok(summary);
    };
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
            of: position_of(&case.system),
            position,
            amplitude: extra("attractor_amplitude"),
            relative_velocity: (velocity("min"), velocity("max")),
        }),
    });
    let mode = last.last().map_or("", |last| last.mode.name());
    Ok(summary.with_statics(case).coming_to(attractor, mode))
}

/// When sliding that slows down by itself lost its stability, s.
fn instability_of(case: &Case, events: &[Event]) -> Option<f64> {
    let period = natural_period(&case.system).filter(|_| case.stops())?;
    let digest = EventDigest::of_events(Some(period), events);
    digest.instability.map(|event| event.time)
}

/// The lines of a run that slows down to a stop, or whose case is not known.
fn of_stop(summary: &Summary) -> Vec<HeadlineRow> {
    let residual = match summary.energy_residual {
        unknown if unknown.is_nan() => none(),
        residual => residual_row(residual, summary.energy_residual_relative),
    };
    let slips = pair(summary.first_slip_duration, summary.last_slip_duration);
    let period = |period: Option<f64>| ratio(period, summary.natural_period);
    let axial = summary.axial_displacement;
    let died = summary.kick_above_noise.is_some_and(|above| above < 0.0);
    let above = format!(
        "{}{}",
        number(summary.kick_above_noise),
        if died { ", it has died out" } else { "" }
    );
    [
        ("events", events(&summary.stick_slip), ""),
        ("onset of stick-slip", time(summary.onset_time), paper::ONSET),
        ("final stick", time(summary.final_stick_time), paper::FINAL_STICK),
        ("slip duration, first / last", slips, paper::SLIP),
        (
            "slip duration, range",
            range(summary.slip_duration_range),
            paper::SLIP_RANGE,
        ),
        (
            "stick duration, first",
            microseconds(summary.first_stick_duration),
            paper::FIRST_STICK,
        ),
        (
            "stick duration, last",
            microseconds(summary.last_stick_duration),
            paper::LAST_STICK,
        ),
        ("stick duration, range", range(summary.stick_duration_range), ""),
        (
            "natural period T_n",
            microseconds(summary.natural_period),
            paper::NATURAL_PERIOD,
        ),
        (
            "first period T_i / T_n",
            period(summary.first_period),
            paper::FIRST_PERIOD,
        ),
        ("last period T_f / T_n", period(summary.last_period), paper::LAST_PERIOD),
        (
            "axial displacement, static",
            axial.map_or_else(none, |z| format!("{:.4} mm", z * 1e3)),
            paper::AXIAL,
        ),
        ("loss of stability", time(summary.instability_time), ""),
        ("growth exponent G", number(summary.growth_exponent), ""),
        ("e-folds gained from the kick", number(summary.e_folds_gained), ""),
        ("kick above rounding, e-folds", above, ""),
        ("energy residual", residual, ""),
    ]
    .map(|(name, value, paper)| HeadlineRow { name, value, paper })
    .into()
}

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

/// The lines of a motion that may repeat itself.
fn of_motion(motion: Motion, summary: &Summary) -> Vec<HeadlineRow> {
    let (angle, speed) = units(motion);
    let seconds =
        |range: Option<(f64, f64)>| range.map_or_else(none, |(least, most)| format!("{least:.9} to {most:.9} s"));
    let mut rows = Vec::new();
    let mut row = |name: &'static str, value: String| rows.push(HeadlineRow { name, value, paper: "" });
    row("events", events(&summary.stick_slip));
    row("first stick", time(summary.onset_time));
    row("slip duration, range", seconds(summary.slip_duration_range));
    row("stick duration, range", seconds(summary.stick_duration_range));
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

/// Whether a case describes the system of the built-in case of the paper, beside which its numbers are put; solver and output are
/// free.
pub fn is_paper_case(case: &Case) -> bool {
    let paper = CaseSource::built_in(builtin::DEFAULT).and_then(|source| Case::read(&source, &[]));
    paper.is_ok_and(|paper| paper.system == case.system)
}

/// Kinds of events as a reader counts them: one of them, and several.
const KINDS: [(&[EventKind], &str, &str); 8] = [
    (&[EventKind::Stick], "stick", "sticks"),
    (&[EventKind::Slip], "slip", "slips"),
    (&[EventKind::Reversal], "reversal", "reversals"),
    (&[EventKind::Separation], "separation", "separations"),
    (&[EventKind::Contact], "contact", "contacts"),
    (&[EventKind::Kick], "kick", "kicks"),
    (&[EventKind::Corner], "corner", "corners"),
    (
        &[EventKind::Destabilised, EventKind::Restabilised],
        "change of stability",
        "changes of stability",
    ),
];

/// The number of events, and how many there are of each kind: these add up to it. Sticks and slips are named in any case.
pub(crate) fn events(statistics: &CycleStatistics) -> String {
    let count = |&(kinds, one, several): &(&[EventKind], &str, &str)| match statistics.count(kinds) {
        0 if !matches!(kinds, [EventKind::Stick | EventKind::Slip]) => None,
        1 => Some(format!("1 {one}")),
        n => Some(format!("{n} {several}")),
    };
    let kinds: Vec<String> = KINDS.iter().filter_map(count).collect();
    format!("{} ({})", statistics.count(&EventKind::ALL), kinds.join(", "))
}

fn time(t: Option<f64>) -> String {
    t.map_or_else(none, |t| format!("{t:.9} s"))
}

fn microseconds(t: Option<f64>) -> String {
    t.map_or_else(none, |t| format!("{:.2} us", t * 1e6))
}

fn pair(first: Option<f64>, last: Option<f64>) -> String {
    match (first, last) {
        (Some(first), Some(last)) => format!("{:.2} / {:.2} us", first * 1e6, last * 1e6),
        _ => none(),
    }
}

fn range(bounds: Option<(f64, f64)>) -> String {
    bounds.map_or_else(none, |(low, high)| format!("{:.2} to {:.2} us", low * 1e6, high * 1e6))
}

fn ratio(period: Option<f64>, natural: Option<f64>) -> String {
    match (period, natural) {
        (Some(period), Some(natural)) => format!("{:.4}", period / natural),
        _ => none(),
    }
}

fn number(x: Option<f64>) -> String {
    x.map_or_else(none, |x| format!("{x:.2}"))
}

fn none() -> String {
    "none".to_owned()
}
