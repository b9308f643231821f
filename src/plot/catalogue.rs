//! The figures of the paper, from one run or several: each knows its window of time by the events.

use super::certified;
use super::entry::{Absent, Entry, NO_CORNER, NO_CYCLE, NO_STICK, Outcome, Subject, without};
use super::error::{PlotError, hint};
use super::figure::{Axis, Curve, CurveStyle, Figure, Panel};
use super::law;
use super::own::over_time;
use super::portraits;
use super::run::Run;
use super::style::{BLUE, GREY, VERMILLION, line_color};
use crate::case::CaseRef;
use crate::simulation::OutputWindow;

/// The figure of the paper that is a critical curve in (alpha, c_t).
const CRITICAL_CURVE: u32 = 25;
/// The first and the last figure of the paper that are of one run.
const OF_A_RUN: std::ops::RangeInclusive<u32> = 4..=24;

/// Every figure, in the order of the paper.
pub const ENTRIES: &[Entry] = &[
    entry("friction-law", "Friction law", Some(4), law::friction_law),
    entry("axial-displacement", "Axial displacement", Some(5), axial_displacement),
    entry(
        "axial-settling",
        "Axial displacement after the last corner of F(t)",
        None,
        axial_settling,
    ),
    entry("rotor-speed", "Rotor speed", None, |e, s| {
        whole(e, s, &[&["theta_dot"]])
    }),
    entry("rotor-speed-stop", "Rotor speed before the stop", None, |e, s| {
        stop(e, s, &[&["theta_dot"]])
    }),
    entry("surface-speeds", "Speeds of the contact surfaces", None, |e, s| {
        // Surfaces that stick together and slide apart belong into common axes; those of a brake are too far apart.
        let apart: &[&[&str]] = &[&["phi2_dot"], &["phi1_dot"]];
        let common: &[&[&str]] = &[&["phi2_dot", "phi1_dot"]];
        whole(e, s, if s.run.stops() { apart } else { common })
    }),
    entry(
        "surface-speeds-stop",
        "Speeds of the contact surfaces before the stop",
        None,
        |e, s| stop(e, s, &[&["phi2_dot"], &["phi1_dot"]]),
    ),
    entry(
        "surface-speeds-close-up",
        "Speeds of the contact surfaces, first sticks",
        None,
        |e, s| first_cycles(e, s, &[&["phi2_dot", "phi1_dot"]]),
    ),
    entry("relative-velocity", "Relative velocity", None, |e, s| {
        whole(e, s, &[&["relative_velocity"]])
    }),
    entry(
        "relative-velocity-growth",
        "Relative velocity before the first stick",
        None,
        growth,
    ),
    entry("stick-slip-transition", "Stick-slip", None, transition),
    entry(
        "stick-slip-close-up",
        "First sticks: relative velocity and torques",
        None,
        |e, s| {
            first_cycles(
                e,
                s,
                &[&["relative_velocity"], &["transmitted_torque", "friction_torque"]],
            )
        },
    ),
    entry(
        "stick-slip-end",
        "Last sticks: relative velocity and torques",
        None,
        last_cycles,
    ),
    entry("durations", "Durations of the sticks and slips", Some(15), durations),
    entry(
        "phase-axial",
        "Axial motion after the last corner of F(t)",
        None,
        portraits::axial,
    ),
    entry(
        "phase-plateau",
        "Stator surface after the last corner of F(t)",
        None,
        portraits::plateau,
    ),
    entry(
        "phase-growth-stator",
        "Stator surface before the first stick",
        None,
        portraits::growth_stator,
    ),
    entry(
        "phase-growth-rotor",
        "Rotor surface before the first stick",
        None,
        portraits::growth_rotor,
    ),
    entry(
        "phase-stick-slip-stator",
        "Stator surface during stick-slip",
        None,
        portraits::stick_slip_stator,
    ),
    entry(
        "phase-stick-slip-rotor",
        "Rotor surface during stick-slip",
        None,
        portraits::stick_slip_rotor,
    ),
    entry(
        "phase-stick-slip-torque",
        "Torque and relative velocity during stick-slip",
        None,
        portraits::torque,
    ),
    entry(
        "phase-final-stick-stator",
        "Stator surface in the last stick",
        None,
        portraits::final_stick_stator,
    ),
    entry(
        "phase-final-stick-rotor",
        "Rotor surface in the last stick",
        None,
        portraits::final_stick_rotor,
    ),
];

/// Those that a run can have, in that order, and what its certificate says.
pub fn of_run(run: &Run) -> Vec<&'static Entry> {
    let all = ENTRIES.iter().chain(portraits::ENTRIES);
    let mut found: Vec<&'static Entry> = all.filter(|entry| without(entry, run).is_none()).collect();
    if run.time_uncertainty().is_some() {
        found.extend(certified::ENTRIES);
    }
    found
}

const fn entry(
    name: &'static str,
    title: &'static str,
    paper_figure: Option<u32>,
    draw: fn(&Entry, &Subject) -> Result<Outcome, PlotError>,
) -> Entry {
    Entry {
        name,
        title,
        paper_figure,
        draw,
    }
}

/// The figure of a name or of a number in the paper.
///
/// # Errors
/// If there is none, with what there is.
pub fn find(name: &str) -> Result<&'static Entry, PlotError> {
    if let Ok(number) = name.parse::<u32>() {
        return match ENTRIES.iter().find(|e| e.paper_figure == Some(number)) {
            Some(entry) => Ok(entry),
            None if number == CRITICAL_CURVE => Err(PlotError::CriticalCurve { number }),
            None if OF_A_RUN.contains(&number) => Err(PlotError::UnknownNumber { number }),
            None => Err(unknown_figure(name)),
        };
    }
    let all = ENTRIES.iter().chain(portraits::ENTRIES).chain(certified::ENTRIES);
    all.into_iter()
        .find(|e| e.name == name)
        .ok_or_else(|| unknown_figure(name))
}

fn unknown_figure(name: &str) -> PlotError {
    let all = ENTRIES.iter().chain(portraits::ENTRIES).chain(certified::ENTRIES);
    let names: Vec<&str> = all.map(|e| e.name).collect();
    PlotError::UnknownFigure {
        name: name.to_owned(),
        hint: hint(name, names.iter().copied()),
        known: names.join(", "),
    }
}

/// The sampling with which a repeated run has everything that was absent, as `--set` takes it: its windows so far and
/// those that are needed. `None` if no sampling helps.
pub fn sampling(run: &Run, absent: &[&Absent]) -> Option<String> {
    let needed: Vec<OutputWindow> = absent.iter().filter_map(|absent| absent.window).collect();
    let mut windows: Vec<&OutputWindow> = CaseRef::from(&run.case)
        .output()
        .windows
        .iter()
        .chain(&needed)
        .collect();
    // What another window covers at least as densely is of no use; of equal ones the first stays.
    windows.sort_by(|a, b| a.interval.total_cmp(&b.interval));
    let covers = |a: &OutputWindow, b: &OutputWindow| a.from <= b.from && b.to <= a.to;
    let mut kept: Vec<&OutputWindow> = Vec::new();
    for window in windows {
        if !kept.iter().any(|denser| covers(denser, window)) {
            kept.push(window);
        }
    }
    kept.sort_by(|a, b| a.from.total_cmp(&b.from));
    let text = |w: &&OutputWindow| format!("{{from={}, to={}, interval={:e}}}", w.from, w.to, w.interval);
    let list = kept.iter().map(text).collect::<Vec<_>>().join(", ");
    (!needed.is_empty()).then(|| format!("output.window=[{list}]"))
}

fn whole(entry: &Entry, subject: &Subject, panels: &[&[&str]]) -> Result<Outcome, PlotError> {
    // One pass over the file for all figures of the whole run.
    let channels = ["theta_dot", "phi2_dot", "phi1_dot", "relative_velocity"];
    for run in subject.runs {
        run.curves(&channels, subject.run.times)?;
    }
    over_time(subject.runs, entry.name, entry.title, panels, subject.run.times).map(Ok)
}

/// A figure over a window in which motions of `period` are to be seen.
fn close_up(
    entry: &Entry,
    subject: &Subject,
    panels: &[&[&str]],
    window: (f64, f64),
    period: f64,
) -> Result<Outcome, PlotError> {
    match subject.resolved(window, period)? {
        Ok(window) => over_time(subject.runs, entry.name, entry.title, panels, window).map(Ok),
        Err(reason) => Ok(Err(reason)),
    }
}

/// As long again as F(t) changes.
fn axial_displacement(entry: &Entry, subject: &Subject) -> Result<Outcome, PlotError> {
    let (first, last) = subject.run.times;
    let end = subject.corner.map_or(last, |corner| (2.0 * corner).min(last));
    let end = if end > first { end } else { last };
    over_time(subject.runs, entry.name, entry.title, &[&["z"]], (first, end)).map(Ok)
}

fn axial_settling(entry: &Entry, subject: &Subject) -> Result<Outcome, PlotError> {
    let Some(corner) = subject.corner else {
        return Ok(Err(NO_CORNER.into()));
    };
    let window = (corner - subject.axial_period, corner + 5.0 * subject.axial_period);
    close_up(entry, subject, &[&["z"]], window, subject.axial_period)
}

/// From the loss of stability, or a little before the first stick, to a little after the last.
fn stop(entry: &Entry, subject: &Subject, panels: &[&[&str]]) -> Result<Outcome, PlotError> {
    let Some(onset) = subject.onset else {
        return Ok(Err(NO_STICK.into()));
    };
    let end = subject
        .final_stick
        .or(subject.run.events.last().map(|e| e.time))
        .unwrap_or(onset);
    let from = subject.instability.unwrap_or(onset - 60.0 * subject.period);
    close_up(
        entry,
        subject,
        panels,
        (from, end + 8.0 * subject.period),
        subject.period,
    )
}

fn growth(entry: &Entry, subject: &Subject) -> Result<Outcome, PlotError> {
    let Some(onset) = subject.onset else {
        return Ok(Err(NO_STICK.into()));
    };
    let window = (onset - 24.0 * subject.period, onset + 2.0 * subject.period);
    close_up(entry, subject, &[&["relative_velocity"]], window, subject.period)
}

fn transition(entry: &Entry, subject: &Subject) -> Result<Outcome, PlotError> {
    let Some(onset) = subject.onset else {
        return Ok(Err(NO_STICK.into()));
    };
    let end = subject
        .final_stick
        .or(subject.run.events.last().map(|e| e.time))
        .unwrap_or(onset);
    let window = (onset - 12.0 * subject.period, end + 6.0 * subject.period);
    close_up(entry, subject, &[&["relative_velocity"]], window, subject.period)
}

fn first_cycles(entry: &Entry, subject: &Subject, panels: &[&[&str]]) -> Result<Outcome, PlotError> {
    let cycles = &subject.run.cycles;
    let (Some(onset), false) = (subject.onset, cycles.is_empty()) else {
        return Ok(Err(NO_CYCLE.into()));
    };
    let length: f64 = cycles.iter().take(5).map(|c| c.period).sum();
    let window = (onset - subject.period, onset + length + 0.2 * subject.period);
    close_up(entry, subject, panels, window, subject.period)
}

fn last_cycles(entry: &Entry, subject: &Subject) -> Result<Outcome, PlotError> {
    let cycles = &subject.run.cycles;
    let (Some(end), false) = (subject.final_stick, cycles.is_empty()) else {
        return Ok(Err(NO_CYCLE.into()));
    };
    let length: f64 = cycles.iter().rev().take(4).map(|c| c.period).sum();
    let window = (end - length - 0.2 * subject.period, end + 2.0 * subject.period);
    let panels: &[&[&str]] = &[&["relative_velocity"], &["transmitted_torque", "friction_torque"]];
    close_up(entry, subject, panels, window, subject.period)
}

/// Stick durations as A exp(k/K): the factor from stick to stick and how well it fits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExponentialFit {
    /// A, s: at index 0.
    pub first: f64,
    /// exp(1/K): from one index to the next.
    pub factor: f64,
    /// Share of the variance of the logarithms that the fit explains.
    pub r_squared: f64,
    /// Largest |duration/fit - 1|.
    pub worst: f64,
}

impl ExponentialFit {
    /// By least squares on the logarithms; `None` for fewer than three durations, or any that is not positive.
    pub fn of(durations: &[f64]) -> Option<ExponentialFit> {
        if durations.len() < 3 || durations.iter().any(|&d| d <= 0.0) {
            return None;
        }
        let n = durations.len() as f64;
        let mean_k = (n - 1.0) / 2.0;
        let mean = durations.iter().map(|d| d.ln()).sum::<f64>() / n;
        let centred = || {
            durations
                .iter()
                .enumerate()
                .map(|(k, d)| (k as f64 - mean_k, d.ln() - mean))
        };
        let slope = centred().map(|(k, l)| k * l).sum::<f64>() / centred().map(|(k, _)| k * k).sum::<f64>();
        let total: f64 = centred().map(|(_, l)| l * l).sum();
        let left: f64 = centred().map(|(k, l)| (l - slope * k).powi(2)).sum();
        let first = (mean - slope * mean_k).exp();
        let fit = |k: usize| first * (slope * k as f64).exp();
        let worst = durations.iter().enumerate().map(|(k, d)| (d / fit(k) - 1.0).abs());
        Some(ExponentialFit {
            first,
            factor: slope.exp(),
            r_squared: if total > 0.0 { 1.0 - left / total } else { 1.0 },
            worst: worst.fold(0.0, f64::max),
        })
    }
}

fn durations(entry: &Entry, subject: &Subject) -> Result<Outcome, PlotError> {
    if subject.run.cycles.is_empty() {
        return Ok(Err(NO_CYCLE.into()));
    }
    let several = subject.runs.len() > 1;
    let mut curves = Vec::new();
    for (number, run) in subject.runs.iter().enumerate() {
        let cycles = &run.cycles;
        let indexed = |f: fn(&crate::record::Cycle) -> f64| -> Vec<(f64, f64)> {
            cycles.iter().enumerate().map(|(k, c)| (k as f64, f(c))).collect()
        };
        let (sticks, slips) = (indexed(|c| c.stick_duration), indexed(|c| c.slip_duration));
        let (stick_color, slip_color, prefix) = if several {
            (line_color(number), line_color(number), format!("{}: ", run.label()))
        } else {
            (VERMILLION, BLUE, String::new())
        };
        curves.push(Curve::line(&format!("{prefix}sticks"), stick_color, sticks).styled(CurveStyle::Points));
        curves.push(Curve::line(&format!("{prefix}slips"), slip_color, slips).styled(CurveStyle::OpenPoints));
        if !several {
            let durations: Vec<f64> = cycles.iter().map(|c| c.stick_duration).collect();
            if let Some(fit) = ExponentialFit::of(&durations) {
                let line = (0..durations.len()).map(|k| (k as f64, fit.first * fit.factor.powi(k as i32)));
                let label = format!("exponential, ×{:.3} per stick, R² = {:.3}", fit.factor, fit.r_squared);
                curves.push(Curve::line(&label, GREY, line.collect()).styled(CurveStyle::Dashed));
            }
        }
    }
    let longest = curves.iter().flat_map(Curve::points).map(|p| p.1).fold(0.0, f64::max);
    let count = curves.iter().flat_map(Curve::points).map(|p| p.0).fold(0.0, f64::max);
    let panel = Panel::new(
        Axis::new("index of the cycle", "1").ranging(-0.03 * count - 0.5, 1.03 * count + 0.5),
        Axis::new("duration", "s").ranging(0.0, 1.08 * longest),
        curves,
    );
    Ok(Ok(Figure {
        name: entry.name.to_owned(),
        title: entry.title.to_owned(),
        paper_figure: None,
        panels: vec![panel],
    }))
}
