//! Main numbers of a run in words, beside the paper's.

use super::attractor::{Attractor, Extremes};
use super::exponent::{Exponent, Neighbours};
use super::quantity::{RESIDUAL, TURNOVER};
use super::section::LONGEST_PERIOD;
use super::summary::{Outcome, Summary, residual_row, share_of};
use serde::Serialize;
use stickslip_case::{Case, CaseSource, Motion, builtin};
use stickslip_engine::simulation::{natural_period, position_of};
use stickslip_files::{ResultError, ResultFile, Status, StickSlipTable};
use stickslip_system::record::{CycleStatistics, Event, EventDigest, EventKind};

/// Line of the headline.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct HeadlineRow {
    /// Name of the number.
    pub name: &'static str,
    /// Value of this run with its unit; "none" if it does not exist.
    pub value: String,
    /// The paper's value, or an empty string.
    pub paper: &'static str,
}

impl HeadlineRow {
    /// Whether it is one of the main numbers, which a short report shows.
    pub fn is_main(&self) -> bool {
        MAIN.contains(&self.name)
    }
}

const CROSSINGS: &str = "falls below the threshold in a period";

/// Names of the main numbers.
const MAIN: [&str; 12] = [
    "events",
    "onset of stick-slip",
    "final stick",
    "slip duration, first / last",
    "stick duration, first",
    "stick duration, last",
    "first stick",
    "motion",
    "period",
    "sticks in a period",
    CROSSINGS,
    "amplitude",
];

/// Lines of a run in reading order, beside the paper's numbers for the paper's own case.
pub fn headline(case: &Case, summary: &Summary) -> Vec<HeadlineRow> {
    rows(Some(case), summary)
}

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

/// Lines of a result file with these events; `case` is its resolved case, if readable. Numbers that a killed run could
/// not write are "none" or have no line. Fails if the file cannot be read.
pub fn of_file(file: &ResultFile, case: Option<&Case>, events: &[Event]) -> Result<Vec<HeadlineRow>, ResultError> {
    let table = file.stick_slip()?;
    let summary = summary_of_file(file, case, events, table.as_ref())?;
    let mut rows = rows(case, &summary);
    if table.is_none() && case.is_some_and(|case| !case.stops()) {
        // The motion and the energy residual are written at the end of a run.
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
    let of_table = |name: &str| table.and_then(|table| table.value(name));
    let mut stick_slip = CycleStatistics::default();
    for event in events {
        stick_slip.push(event.time, event.kind);
    }
    let samples = file.sample_count()?;
    let first = file.samples(0..samples.min(1))?;
    let last = file.samples(samples.saturating_sub(1)..samples)?;
    // Files of earlier versions lack the energy turnover.
    let at_start = first
        .first()
        .filter(|_| case.is_none_or(stickslip_case::Case::stops))
        .map(|first| first.channels.energy_kinetic + first.channels.energy_elastic);
    let energy_turnover = of_table(TURNOVER).or(at_start).unwrap_or(f64::NAN);
    let energy_residual = of_table(RESIDUAL).unwrap_or(f64::NAN);
    let summary = Summary {
        end: last.last().map_or(f64::NAN, |sample| sample.time),
        events: events.len(),
        instability_time: of_table("instability_time").or_else(|| instability_of(case?, events)),
        growth_exponent: of_table("growth_exponent"),
        growth_to_onset: of_table("growth_to_onset"),
        e_folds_gained: of_table("e_folds_gained"),
        kick_above_noise: of_table("kick_above_noise"),
        energy_residual,
        energy_turnover,
        energy_residual_relative: share_of(energy_residual, energy_turnover),
        dissipated_energy: last.last().map(|sample| sample.channels.dissipated_friction),
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
    let position = of_table("attractor_position_min").zip(of_table("attractor_position_max"));
    let velocity = |end: &str| of_table(&format!("attractor_relative_velocity_{end}")).unwrap_or(f64::NAN);
    let attractor = of_table("attractor_period").map(|period| Attractor {
        period,
        sticks: of_table("attractor_sticks").unwrap_or(0.0) as u64,
        sections: 0,
        forcing_periods: of_table("attractor_forcing_periods").map(|periods| periods as u64),
        agreement: of_table("attractor_agreement").unwrap_or(f64::NAN),
        distance: of_table("attractor_distance").unwrap_or(f64::NAN),
        since: of_table("attractor_since").unwrap_or(f64::NAN),
        extremes: position.map(|position| Extremes {
            of: position_of(&case.system),
            position,
            amplitude: of_table("attractor_amplitude"),
            relative_velocity: (velocity("min"), velocity("max")),
        }),
    });
    let mode = last.last().map_or("", |last| last.mode.name());
    let constant = of_table("steady_sliding").is_some_and(|steady| steady != 0.0);
    let exponent = of_table("lyapunov_exponent").zip(of_table("lyapunov_uncertainty"));
    let exponent = exponent.map(|(value, uncertainty)| Exponent {
        value,
        uncertainty,
        time: None,
    });
    let summary = Summary { exponent, ..summary };
    Ok(summary.with_statics(case).coming_to(attractor, mode, constant))
}

fn instability_of(case: &Case, events: &[Event]) -> Option<f64> {
    let period = natural_period(&case.system).filter(|_| case.stops())?;
    let digest = EventDigest::of_events(Some(period), events);
    digest.instability.map(|event| event.time)
}

/// Lines of a run that slows down to a stop, or of an unknown case, with numbers of the paper's sections 4.2 to 4.5.
fn of_stop(summary: &Summary) -> Vec<HeadlineRow> {
    let residual = Some(summary.energy_residual).filter(|residual| !residual.is_nan());
    let residual = or_none(residual, |joules| {
        residual_row(joules, summary.energy_residual_relative)
    });
    let time = |t: Option<f64>| or_none(t, |t| format!("{t:.9} s"));
    let microseconds = |t: Option<f64>| or_none(t, |t| format!("{:.2} us", t * 1e6));
    let range = |bounds: Option<(f64, f64)>| {
        or_none(bounds, |(low, high)| {
            format!("{:.2} to {:.2} us", low * 1e6, high * 1e6)
        })
    };
    let number = |x: Option<f64>| or_none(x, |x| format!("{x:.2}"));
    let natural = |period: Option<f64>| {
        let both = period.zip(summary.natural_period);
        or_none(both, |(period, natural)| format!("{:.4}", period / natural))
    };
    let slips = summary.first_slip_duration.zip(summary.last_slip_duration);
    let slips = or_none(slips, |(first, last)| {
        format!("{:.2} / {:.2} us", first * 1e6, last * 1e6)
    });
    let axial = or_none(summary.axial_displacement, |z| format!("{:.4} mm", z * 1e3));
    let died = summary.kick_above_noise.is_some_and(|above| above < 0.0);
    let above = number(summary.kick_above_noise) + if died { ", it has died out" } else { "" };
    let (first_stick, last_stick) = (summary.first_stick_duration, summary.last_stick_duration);
    [
        ("events", events(&summary.stick_slip), ""),
        ("onset of stick-slip", time(summary.onset_time), "6.975 s"),
        ("final stick", time(summary.final_stick_time), "6.9896 s"),
        ("slip duration, first / last", slips, "190 us"),
        (
            "slip duration, range",
            range(summary.slip_duration_range),
            "nearly constant",
        ),
        ("stick duration, first", microseconds(first_stick), "50 us"),
        ("stick duration, last", microseconds(last_stick), "530 us"),
        ("stick duration, range", range(summary.stick_duration_range), ""),
        ("natural period T_n", microseconds(summary.natural_period), "240 us"),
        ("first period T_i / T_n", natural(summary.first_period), "1"),
        ("last period T_f / T_n", natural(summary.last_period), "3"),
        ("axial displacement, static", axial, "0.04 mm"),
        ("loss of stability", time(summary.instability_time), ""),
        ("growth exponent G", number(summary.growth_exponent), ""),
        ("e-folds gained from the kick", number(summary.e_folds_gained), ""),
        ("kick above rounding, e-folds", above, ""),
        (HEAT, or_none(summary.dissipated_energy, heat), ""),
        ("energy residual", residual, ""),
    ]
    .map(|(name, value, paper)| HeadlineRow { name, value, paper })
    .into()
}

const HEAT: &str = "heat of friction";

fn heat(joules: f64) -> String {
    format!("{joules:.6e} J")
}

fn units(motion: Motion) -> (&'static str, &'static str) {
    match motion {
        Motion::Rotation => ("rad", "rad/s"),
        Motion::Translation => ("m", "m/s"),
    }
}

/// Significant decimals for an absolute uncertainty, up to `most`.
pub(crate) fn decimals(uncertainty: f64, most: usize) -> usize {
    (-uncertainty.max(f64::MIN_POSITIVE).log10())
        .floor()
        .clamp(0.0, most as f64) as usize
}

fn known(value: f64, uncertainty: f64) -> String {
    let text = format!("{value:.*}", decimals(uncertainty, 12));
    match text.strip_prefix('-') {
        Some(zero) if zero.bytes().all(|b| b == b'0' || b == b'.') => zero.to_owned(),
        _ => text,
    }
}

fn of_exponent(exponent: &Exponent) -> String {
    let places = decimals(exponent.uncertainty, 12) + 2;
    let unit = 10f64.powi(places as i32);
    let uncertainty = (exponent.uncertainty * unit).ceil() / unit;
    let number = format!("{:.places$} +- {uncertainty:.places$} 1/s", exponent.value);
    match exponent.neighbours() {
        Neighbours::Part => format!("chaotic: largest exponent {number}"),
        Neighbours::Stay => format!("not periodic; largest exponent {number}, compatible with zero (quasi-periodic?)"),
        Neighbours::Meet => format!("no period found; largest exponent {number}: neighbouring motions meet"),
    }
}

fn of_motion(motion: Motion, summary: &Summary) -> Vec<HeadlineRow> {
    let (angle, speed) = units(motion);
    let seconds = |range: Option<(f64, f64)>| or_none(range, |(least, most)| format!("{least:.9} to {most:.9} s"));
    let mut rows = Vec::new();
    let mut row = |name: &'static str, value: String| rows.push(HeadlineRow { name, value, paper: "" });
    row("events", events(&summary.stick_slip));
    row("first stick", or_none(summary.onset_time, |t| format!("{t:.9} s")));
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
            forcing_periods,
            ..
        })) => {
            let known = |value: f64, size: f64| known(value, size * distance);
            let known_range = |(least, most): (f64, f64)| {
                let size = least.abs().max(most.abs());
                format!("{} to {}", known(least, size), known(most, size))
            };
            row("motion", format!("periodic since {since:.6} s"));
            let of_forcing = match forcing_periods {
                None => String::new(),
                Some(1) => ", that of the forcing".to_owned(),
                Some(periods) => format!(", {periods} of the forcing"),
            };
            row("period", format!("{} s{of_forcing}", known(*period, *period)));
            // Without sticking, bounces across the threshold also count.
            let name = summary.stick_threshold.map_or("sticks in a period", |_| CROSSINGS);
            row(name, sticks.to_string());
            if let Some(extremes) = extremes {
                let position = known_range(extremes.position);
                row(
                    "position over a period",
                    format!("{position} {angle} ({})", extremes.of),
                );
                if let Some(amplitude) = extremes.amplitude {
                    let size = extremes.position.0.abs().max(extremes.position.1.abs());
                    row("amplitude", format!("{} {angle}", known(amplitude, size)));
                }
                // Files of earlier versions lack the relative velocity.
                let (least, most) = extremes.relative_velocity;
                if !(least.is_nan() || most.is_nan()) {
                    let velocity = known_range(extremes.relative_velocity);
                    row("relative velocity over a period", format!("{velocity} {speed}"));
                }
            }
            row(
                "last two cycles differ by",
                format!("{agreement:.1e}, relative; from the periodic motion by {distance:.1e}"),
            );
        }
        Some(Outcome::Stuck { since }) => row(
            "motion",
            match summary.exponent.as_ref().map(of_exponent) {
                None => format!("no period found; in stick from {since:.9} s to the end of the run"),
                Some(found) => format!("{found}; in stick from {since:.9} s to the end of the run"),
            },
        ),
        Some(Outcome::NotPeriodic) => row(
            "motion",
            summary.exponent.as_ref().map_or_else(
                || format!("no period of at most {LONGEST_PERIOD} breakaways and reversals found"),
                of_exponent,
            ),
        ),
        Some(Outcome::Steady { mode, constant: false }) => row("motion", format!("no event: mode {mode} all the time")),
        Some(Outcome::Steady { mode, constant: true }) => {
            row("motion", format!("steady sliding, all states constant: mode {mode}"));
        }
        None => {}
    }
    if let Some(threshold) = summary.stick_threshold {
        row(
            "counted as a stick",
            format!("each fall of |relative velocity| below {threshold:e} {speed}: the contact has no stick"),
        );
    }
    row(HEAT, or_none(summary.dissipated_energy, heat));
    let relative = summary.energy_residual_relative;
    row("energy residual", residual_row(summary.energy_residual, relative));
    rows
}

/// Whether a case describes the system of the paper's built-in case; solver and output are free.
pub fn is_paper_case(case: &Case) -> bool {
    let paper = CaseSource::built_in(builtin::DEFAULT).and_then(|source| Case::read(&source, &[]));
    paper.is_ok_and(|paper| paper.system == case.system)
}

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
        "stability change",
        "stability changes",
    ),
];

/// The number of contact events, which comparisons and reference checks count too, and behind it the other events. Sticks
/// and slips are always named.
pub(crate) fn events(statistics: &CycleStatistics) -> String {
    let counts = |is_counted: bool| {
        let count = move |(kinds, one, several): &(&[EventKind], &str, &str)| match statistics.count(kinds) {
            _ if kinds[0].in_event_sequence() != is_counted => None,
            0 if !matches!(kinds, [EventKind::Stick | EventKind::Slip]) => None,
            1 => Some(format!("1 {one}")),
            n => Some(format!("{n} {several}")),
        };
        KINDS.iter().filter_map(count).collect::<Vec<_>>().join(", ")
    };
    let counted = EventKind::ALL.into_iter().filter(|kind| kind.in_event_sequence());
    let number = match statistics.count(&counted.collect::<Vec<_>>()) {
        1 => "1 contact event".to_owned(),
        n => format!("{n} contact events"),
    };
    let others = counts(false);
    let separator = if others.is_empty() { "" } else { ", " };
    format!("{number} ({}){separator}{others}", counts(true))
}

/// Value in words; "none" without a value.
pub fn or_none<T>(value: Option<T>, text: impl Fn(T) -> String) -> String {
    value.map_or_else(|| "none".to_owned(), text)
}
