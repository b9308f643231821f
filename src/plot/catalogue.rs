//! Figures of one or several runs, with their time windows, which follow from events, and the systems that have them.

use super::certified;
use super::entry::FigureForm::{CloseUp, Orbit, Own, Spiral, Whole};
use super::entry::{
    CatalogueEntry, Drawn, FigureOutcome, FigureView, NO_CYCLE, NoFigure, PORTRAIT, Subject, Undrawn, View, entry,
};
use super::figure::{Axis, Curve, Figure, Panel};
use super::labels::in_translation;
use super::law;
use super::own::{over_time, phase_of_each};
use super::portraits::{self, final_stick};
use super::run::DrawnRun;
use super::style::{BLUE, GREY, VERMILLION, line_color};
use crate::Error;
use stickslip_analysis::analysis::headline::is_paper_case;
use stickslip_case::Motion;
use stickslip_engine::simulation::OutputWindow;
use stickslip_system::record::Cycle;

/// Number of turns of the fast motion that are shown before the first stick.
const TURNS: f64 = 24.0;

const CRITICAL_CURVE: u32 = 25;
const OF_A_RUN: std::ops::RangeInclusive<u32> = 4..=24;

/// All figures, in the order of the paper.
pub const ENTRIES: &[CatalogueEntry] = &[
    entry("friction-law", "Friction law", Own(law::friction_law)).in_paper(4),
    entry("axial-displacement", "Axial displacement", Own(axial_displacement)).in_paper(5),
    entry(
        "axial-settling",
        "Axial displacement after the last corner of F(t)",
        CloseUp(&[&["z"]], settling),
    ),
    entry("rotor-speed", "Rotor speed", Whole(&[&["theta_dot"]])),
    entry(
        "rotor-speed-stop",
        "Rotor speed before the stop",
        CloseUp(&[&["theta_dot"]], stop),
    ),
    entry("surface-speeds", "Speeds of the contact surfaces", Own(surface_speeds)),
    entry(
        "surface-speeds-stop",
        "Speeds of the contact surfaces before the stop",
        CloseUp(SURFACES, stop),
    ),
    entry(
        "surface-speeds-close-up",
        "Speeds of the contact surfaces, first sticks",
        CloseUp(TOGETHER, first_cycles),
    ),
    entry("relative-velocity", "Relative velocity", Whole(VELOCITY)),
    entry(
        "relative-velocity-growth",
        "Relative velocity before the first stick",
        CloseUp(VELOCITY, growth),
    ),
    entry("stick-slip-transition", "Stick-slip", CloseUp(VELOCITY, transition)),
    entry(
        "stick-slip-close-up",
        "First sticks: relative velocity and torques",
        CloseUp(WITH_TORQUES, first_cycles),
    ),
    entry(
        "stick-slip-end",
        "Last sticks: relative velocity and torques",
        CloseUp(WITH_TORQUES, last_cycles),
    ),
    entry("durations", "Durations of the sticks and slips", Own(durations)).in_paper(15),
    entry(
        "phase-axial",
        "Axial motion after the last corner of F(t)",
        Spiral(("z", "z_dot"), after_corner),
    ),
    entry(
        "phase-plateau",
        "Stator surface after the last corner of F(t)",
        Spiral(STATOR, on_plateau),
    ),
    entry(
        "phase-growth-stator",
        "Stator surface before the first stick",
        Spiral(STATOR, before_onset),
    ),
    entry(
        "phase-growth-rotor",
        "Rotor surface before the first stick",
        Spiral(ROTOR, before_onset),
    ),
    entry(
        "phase-stick-slip-stator",
        "Stator surface during stick-slip",
        Orbit(STATOR, stick_slip),
    ),
    entry(
        "phase-stick-slip-rotor",
        "Rotor surface during stick-slip",
        Orbit(ROTOR, stick_slip),
    ),
    entry(
        "phase-stick-slip-torque",
        "Torque and relative velocity during stick-slip",
        Orbit(TORQUE, stick_slip),
    ),
    entry(
        "phase-final-stick-stator",
        "Stator surface in the last stick",
        Own(|e, s| final_stick(e, s, STATOR)),
    ),
    entry(
        "phase-final-stick-rotor",
        "Rotor surface in the last stick",
        Own(|e, s| final_stick(e, s, ROTOR)),
    ),
];

fn of_runs() -> impl Iterator<Item = &'static CatalogueEntry> {
    ENTRIES.iter().chain(portraits::ENTRIES)
}

const VELOCITY: &[&[&str]] = &[&["relative_velocity"]];
const SURFACES: &[&[&str]] = &[&["phi2_dot"], &["phi1_dot"]];
const TOGETHER: &[&[&str]] = &[&["phi2_dot", "phi1_dot"]];
const WITH_TORQUES: &[&[&str]] = &[&["relative_velocity"], &["transmitted_torque", "friction_torque"]];
const STATOR: (&str, &str) = ("phi1", "phi1_dot");
const ROTOR: (&str, &str) = ("rotor_twist", "rotor_twist_rate");
const TORQUE: (&str, &str) = ("relative_velocity", "transmitted_torque");

/// Figures of a motion that slows down to a stop, and of the growth before the stop.
const OF_A_STOP: [&str; 4] = [
    "rotor-speed-stop",
    "surface-speeds-stop",
    "phase-final-stick-stator",
    "phase-final-stick-rotor",
];
const OF_GROWTH: [&str; 3] = ["relative-velocity-growth", "phase-growth-stator", "phase-growth-rotor"];

fn reason(name: &str, run: &DrawnRun) -> Option<&'static str> {
    let (rotor, stator, stops) = (&run.system.rotor, &run.system.stator, run.stops());
    let of_axial_mode = name.contains("axial") || name == "phase-plateau";
    let of_cycles = ["stick-slip", "close-up", "durations"]
        .iter()
        .any(|part| name.contains(part));
    Some(match name {
        _ if name.starts_with("rotor-speed") && rotor.is_rigid() => {
            "its rotor has no inertia and moves as it is driven"
        }
        PORTRAIT if stops => {
            "it shows the attractor of a run, and this run slows down by itself to a stop; see phase-stick-slip-stator"
        }
        _ if of_axial_mode && !run.has_axial_mode() => {
            "it shows how an axial mode answers F(t), and here the normal force is given directly"
        }
        _ if name.ends_with("-rotor") && rotor.shafts() == 0 => "its rotor has no shaft",
        _ if name.ends_with("-stator") && stator.shafts() == 0 => "its stator has no shaft",
        _ if OF_GROWTH.contains(&name) && !stops => {
            "it shows what grows from a loss of stability on, as sliding slows down by itself; `stickslip modes` says where steady \
             sliding is unstable"
        }
        _ if OF_A_STOP.contains(&name) && !stops => "it shows a stop, and this run does not slow down by itself to one",
        // A run that stops gets its message when the figure is drawn, together with the necessary sampling.
        _ if of_cycles && !stops && run.cycles.is_empty() => NO_CYCLE,
        _ => return None,
    })
}

/// The title, with forces instead of torques in translation.
pub(crate) fn in_words_of(run: &DrawnRun, title: &str) -> String {
    match run.case.motion() {
        Motion::Translation => in_translation(title),
        Motion::Rotation => title.to_owned(),
    }
}

impl CatalogueEntry {
    /// Makes the figure, or returns [`NoFigure`] if the run does not have it.
    pub fn build(&self, subject: &Subject) -> Result<FigureOutcome, Error> {
        let run = subject.run;
        if let Some(why) = reason(self.name, run) {
            let has = of_runs().filter(|other| reason(other.name, run).is_none());
            let has: Vec<&str> = has.map(|other| other.name).collect();
            let why = format!("{why}; this run has {}, and any channel", has.join(", "));
            return Ok(Err(why.as_str().into()));
        }
        // Several runs have their changes in the legend.
        let changes = run.changes().filter(|_| subject.runs.len() == 1);
        let changes = changes.map(|changes| format!(" ({changes})")).unwrap_or_default();
        match self.draw(subject) {
            Ok(figure) => Ok(Ok(Figure {
                title: in_words_of(run, &figure.title) + &changes,
                paper_figure: self.paper_figure.filter(|_| is_paper_case(&run.case)),
                ..figure
            })),
            Err(Undrawn::Absent(absent)) => Ok(Err(absent)),
            Err(Undrawn::Failed(error)) => Err(error),
        }
    }
}

/// The figures that a run can have, including those of its certificate.
pub fn of_run(run: &DrawnRun) -> Vec<&'static CatalogueEntry> {
    let mut found: Vec<&'static CatalogueEntry> = of_runs().filter(|entry| reason(entry.name, run).is_none()).collect();
    if run.time_uncertainty().is_some() {
        found.extend(certified::ENTRIES);
    }
    found
}

/// The name of a figure without underscores: `map-stick_count` is also `map-stick-count`.
pub fn hyphenated(name: &str) -> String {
    name.replace('_', "-")
}

/// Finds a figure by its name or its number in the paper. The error for an unknown one lists the known ones.
pub fn find(name: &str) -> Result<&'static CatalogueEntry, Error> {
    if let Ok(number) = name.parse::<u32>() {
        return match ENTRIES.iter().find(|e| e.paper_figure == Some(number)) {
            Some(entry) => Ok(entry),
            None if number == CRITICAL_CURVE => Err(Error::input(format!(
                "figure {number} of the paper is a critical curve: stick-slip or not over decay rate and damping. It is drawn from \
                 the file of a sweep: `stickslip sweep critical-curve`, then `stickslip plot critical-curve.h5`"
            ))),
            None if OF_A_RUN.contains(&number) => Err(Error::input(format!(
                "figure {number} of the paper: it is not known which picture that is; --list says what can be drawn, with the \
                 paper's number where it is known"
            ))),
            None => Err(unknown_figure(name)),
        };
    }
    let mut all = of_runs().chain(certified::ENTRIES);
    all.find(|e| e.name == hyphenated(name))
        .ok_or_else(|| unknown_figure(name))
}

fn unknown_figure(name: &str) -> Error {
    let all = of_runs().chain(certified::ENTRIES);
    let names: Vec<&str> = all.map(|e| e.name).collect();
    Error::unknown("there is no figure", name, &names, "")
}

/// Sampling (for `--set`) with which a repeated run would have all absent figures: its present windows and the
/// missing ones. `None` if no sampling helps.
pub fn sampling(run: &DrawnRun, absent: &[&NoFigure]) -> Option<String> {
    let needed: Vec<OutputWindow> = absent.iter().filter_map(|absent| absent.window).collect();
    let mut windows: Vec<&OutputWindow> = run.case.output.windows.iter().chain(&needed).collect();
    // Drops windows that another window covers at least as densely. The first of several equal windows remains.
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

impl CatalogueEntry {
    fn draw(&self, subject: &Subject) -> Drawn {
        let windows = |view: FigureView| subject.windows(|own| own.resolved(view(own)));
        match self.form {
            Whole(panels) => {
                // One pass over the file serves all figures of the whole run.
                let channels = ["theta_dot", "phi2_dot", "phi1_dot", "relative_velocity"];
                for run in subject.runs {
                    run.curves(&channels, subject.run.times)?;
                }
                self.over_time(subject, panels, subject.run.times)
            }
            CloseUp(panels, view) => self.over_time(subject, panels, subject.resolved(view(subject))?),
            Spiral(axes, view) => portraits::spiral(self, subject, axes, &windows(view)?),
            Orbit(axes, view) => Ok(phase_of_each(
                subject.runs,
                self.name,
                self.title,
                axes,
                &windows(view)?,
            )?),
            Own(draw) => draw(self, subject),
        }
    }

    fn over_time(&self, subject: &Subject, panels: &[&[&str]], window: (f64, f64)) -> Drawn {
        Ok(over_time(subject.runs, self.name, self.title, panels, window)?)
    }
}

/// Surfaces that stick together share axes. The surfaces of a brake are too far apart.
fn surface_speeds(entry: &CatalogueEntry, subject: &Subject) -> Drawn {
    let panels = if subject.run.stops() { SURFACES } else { TOGETHER };
    let form = Whole(panels);
    CatalogueEntry { form, ..*entry }.draw(subject)
}

/// The window is twice as long as F(t) changes.
fn axial_displacement(entry: &CatalogueEntry, subject: &Subject) -> Drawn {
    let (first, last) = subject.run.times;
    let end = subject.corner.map_or(last, |corner| (2.0 * corner).min(last));
    let end = if end > first { end } else { last };
    entry.over_time(subject, &[&["z"]], (first, end))
}

fn settling(subject: &Subject) -> View {
    let (corner, period) = (subject.last_corner()?, subject.axial_period);
    Ok(((corner - period, corner + 5.0 * period), period))
}

/// Window from the loss of stability, or from shortly before the first stick, to shortly after the last stick.
fn stop(subject: &Subject) -> View {
    let (onset, period) = (subject.first_stick()?, subject.period);
    let from = subject.instability.unwrap_or(onset - 60.0 * period);
    Ok(((from, subject.end() + 8.0 * period), period))
}

fn growth(subject: &Subject) -> View {
    let (onset, period) = (subject.first_stick()?, subject.period);
    Ok(((onset - 24.0 * period, onset + 2.0 * period), period))
}

fn transition(subject: &Subject) -> View {
    let (onset, period) = (subject.first_stick()?, subject.period);
    Ok(((onset - 12.0 * period, subject.end() + 6.0 * period), period))
}

fn first_cycles(subject: &Subject) -> View {
    let (onset, period) = (subject.first_stick().map_err(|_| NO_CYCLE)?, subject.period);
    let length = length(subject.run.cycles.iter().take(5))?;
    Ok(((onset - period, onset + length + 0.2 * period), period))
}

fn last_cycles(subject: &Subject) -> View {
    let (end, period) = (subject.end(), subject.period);
    let length = length(subject.run.cycles.iter().rev().take(4))?;
    Ok(((end - length - 0.2 * period, end + 2.0 * period), period))
}

fn after_corner(subject: &Subject) -> View {
    let (corner, period) = (subject.last_corner()?, subject.axial_period);
    Ok(((corner, corner + 6.0 * period), period))
}

/// The window after the last corner, with samples that show the motion of the surfaces.
fn on_plateau(subject: &Subject) -> View {
    Ok((after_corner(subject)?.0, subject.period))
}

fn before_onset(subject: &Subject) -> View {
    let (onset, period) = (subject.first_stick()?, subject.period);
    Ok(((onset - TURNS * period, onset), period))
}

/// From the first stick to the last, with an orbit for each cycle instead of a spiral.
fn stick_slip(subject: &Subject) -> View {
    let (onset, end) = (subject.first_stick()?, subject.end());
    match end <= onset {
        true => Err(NO_CYCLE.into()),
        false => Ok(((onset, end), subject.period)),
    }
}

fn length<'a>(cycles: impl Iterator<Item = &'a Cycle>) -> Result<f64, NoFigure> {
    let lengths = cycles.map(|cycle| cycle.period);
    lengths.reduce(|one, other| one + other).ok_or_else(|| NO_CYCLE.into())
}

/// Fit of stick durations by A exp(k/K), where k is the index of the stick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExponentialFit {
    /// A, s: the fitted duration at k = 0.
    pub first: f64,
    /// exp(1/K), the ratio of successive durations.
    pub factor: f64,
    /// Coefficient of determination of the logarithms.
    pub r_squared: f64,
    /// Largest |duration/fit - 1|.
    pub worst: f64,
}

impl ExponentialFit {
    /// Least-squares fit of the logarithms; `None` for fewer than three durations, or if one is not positive.
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

fn durations(entry: &CatalogueEntry, subject: &Subject) -> Drawn {
    if subject.run.cycles.is_empty() {
        return Err(NO_CYCLE.into());
    }
    let several = subject.runs.len() > 1;
    let mut curves = Vec::new();
    for (number, run) in subject.runs.iter().enumerate() {
        let cycles = &run.cycles;
        let indexed = |f: fn(&Cycle) -> f64| -> Vec<(f64, f64)> {
            cycles.iter().enumerate().map(|(k, c)| (k as f64, f(c))).collect()
        };
        let (sticks, slips) = (indexed(|c| c.stick_duration), indexed(|c| c.slip_duration));
        let (stick_color, slip_color, prefix) = if several {
            (line_color(number), line_color(number), format!("{}: ", run.label()))
        } else {
            (VERMILLION, BLUE, String::new())
        };
        curves.push(Curve::filled(&format!("{prefix}sticks"), stick_color, sticks));
        curves.push(Curve::open(&format!("{prefix}slips"), slip_color, slips));
        // Sticks become longer before a stop. A periodic motion has no trend to fit.
        if !several && run.stops() {
            let durations: Vec<f64> = cycles.iter().map(|c| c.stick_duration).collect();
            if let Some(fit) = ExponentialFit::of(&durations) {
                let line = (0..durations.len()).map(|k| (k as f64, fit.first * fit.factor.powi(k as i32)));
                let label = format!("exponential, ×{:.3} per stick, R² = {:.3}", fit.factor, fit.r_squared);
                curves.push(Curve::dashed(&label, GREY, line.collect()));
            }
        }
    }
    let largest = |of: fn((f64, f64)) -> f64| curves.iter().flat_map(Curve::points).map(of).fold(0.0, f64::max);
    let (count, longest) = (largest(|point| point.0), largest(|point| point.1));
    let x = Axis::new("index of the cycle", "1").ranging(-0.03 * count - 0.5, 1.03 * count + 0.5);
    let y = Axis::new("duration", "s").ranging(0.0, 1.08 * longest);
    Ok(entry.figure(vec![Panel::new(x, y, curves)]))
}
