//! What figures there are of runs of two trains.

use super::entry::{Entry, Outcome, PORTRAIT, Subject};
use super::error::PlotError;
use super::figure::{Axis, Curve, CurveStyle, Figure, Panel};
use super::own::phase;
use super::run::Run;
use super::style::{BLACK, VERMILLION, line_color};
use crate::analysis::trains::TrainModes;
use crate::case::{Motion, TrainCase};
use crate::friction::Law;
use crate::model::trains::{Bristles, ContactLaw, End, Regularisation, Smoothing, Train, Trains};
use std::f64::consts::FRAC_2_PI;

/// The figures that only runs of trains have.
pub const ENTRIES: &[Entry] = &[Entry {
    name: PORTRAIT,
    title: "Relative velocity over position",
    paper_figure: None,
    draw: portrait,
}];

/// The bounded position of a surface, beside the far end of its train: the stator's if that has shafts.
fn position(trains: &Trains) -> &'static str {
    let is_fixed = |train: &Train| matches!(train.end, End::Fixed) && !train.is_rigid();
    if is_fixed(&trains.stator) {
        "phi1"
    } else if trains.stator.shafts() > 0 {
        "stator_twist_0"
    } else if is_fixed(&trains.rotor) {
        "phi2"
    } else if trains.rotor.shafts() > 0 {
        "rotor_twist_0"
    } else {
        "slip_displacement"
    }
}

/// Over the last period of a motion that repeats itself, else over the whole run.
fn portrait(entry: &Entry, subject: &Subject) -> Result<Outcome, PlotError> {
    let Some(case) = &subject.run.trains else {
        return Ok(Err(
            "it shows the motion that a run of two trains comes to, and this one is of a brake, which stops; see \
             phase-stick-slip-stator"
                .into(),
        ));
    };
    let Shown { axes, window, periodic } = shown(subject.run, case);
    let over = format!("Relative velocity over {}", subject.run.axis(axes.0)?.name);
    let mut title = if periodic { format!("{over}, last period") } else { over };
    if let Some(few) = few_samples(subject.run, window)? {
        title = format!("{title}; {few}");
    }
    phase(subject.runs, entry.name, &title, axes, window).map(Ok)
}

/// What the phase portrait of a run shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Shown {
    /// Two channels: that of the horizontal axis and that of the vertical one.
    pub(super) axes: (&'static str, &'static str),
    /// When it begins and ends, s.
    pub(super) window: (f64, f64),
    /// Whether that is one period of a motion that repeats itself.
    pub(super) periodic: bool,
}

/// Samples from which on a portrait is seen as a curve.
const MANY: usize = 60;

/// What is to be said of a portrait in a window with few samples.
pub(super) fn few_samples(run: &Run, window: (f64, f64)) -> Result<Option<String>, PlotError> {
    let samples = run.rows_in(window)?.len();
    let few = || format!("it has {samples} samples, joined by straight lines; a smaller output.interval gives more");
    Ok((samples < MANY).then(few))
}

/// What the phase portrait of a run of trains shows.
pub(super) fn shown(run: &Run, case: &TrainCase) -> Shown {
    let (first, last) = run.times;
    let axes = (position(&case.parameters), "relative_velocity");
    match run.attractor_period {
        Some(period) if period < last - first => Shown {
            axes,
            // One sample more, so that it closes.
            window: ((last - period - case.output.interval).max(first), last),
            periodic: true,
        },
        _ => Shown {
            axes,
            window: (first, last),
            periodic: false,
        },
    }
}

/// The coefficient of friction that a steady relative velocity `x` meets.
fn coefficient(trains: &Trains, x: f64) -> f64 {
    let law = trains.law.coefficient(x);
    match &trains.contact {
        ContactLaw::StickSlip => law,
        ContactLaw::Regularised(Regularisation { function, speed }) => match function {
            Smoothing::Tanh => law * (x / speed).tanh(),
            Smoothing::Arctan => law * FRAC_2_PI * (x / speed).atan(),
        },
        ContactLaw::Bristles(Bristles { viscous, .. }) => law + viscous * x,
    }
}

/// mu(x) with its critical speeds, as for the brake.
pub(super) fn friction_law(entry: &Entry, case: &TrainCase, runs: &[Run]) -> Figure {
    let trains = &case.parameters;
    let extent = trains.law.extent().min(trains.law.ends_at());
    let end = if extent.is_finite() { extent } else { 1.0 };
    let mut curves = Vec::new();
    for (number, run) in runs.iter().enumerate() {
        let Some(case) = &run.trains else { continue };
        // A regularised law rises within a hair of rest: as many points there as beyond.
        let near = |k: i32| end * 10f64.powf(f64::from(k) / 24.0 - 10.0);
        let grid = (0..240).map(near).chain((1..=240).map(|k| end * f64::from(k) / 240.0));
        let mut points: Vec<(f64, f64)> = std::iter::once(0.0)
            .chain(grid)
            .map(|x| (x, coefficient(&case.parameters, x)))
            .collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let label = if runs.len() > 1 {
            run.label()
        } else {
            format!("sliding, μ(|{}|)", symbol(case.motion))
        };
        curves.push(Curve::line(&label, line_color(number), points));
    }
    let most = |curve: &Curve| curve.points().map(|point| point.1).fold(0.0, f64::max);
    let mut largest = curves.iter().map(most).fold(1e-3, f64::max);
    if runs.len() == 1 {
        if trains.contact == ContactLaw::StickSlip {
            largest = largest.max(trains.breakaway);
            let rest = Curve::line("rest, μ₀", VERMILLION, vec![(0.0, trains.breakaway)]);
            curves.push(rest.styled(CurveStyle::Points));
        }
        let critical = TrainModes::of_case(trains).critical_relative_velocities.changes;
        let within = critical.iter().map(|change| change.value).filter(|&x| x <= end);
        let points: Vec<(f64, f64)> = within.map(|x| (x, coefficient(trains, x))).collect();
        if !points.is_empty() {
            curves.push(Curve::line("critical speed", BLACK, points).styled(CurveStyle::OpenPoints));
        }
    }
    let units = match case.motion {
        Motion::Rotation => "rad s-1",
        Motion::Translation => "m s-1",
    };
    let x = Axis::new("relative velocity", units)
        .with_symbol(&format!("|{}|", symbol(case.motion)))
        .ranging(0.0, end);
    let y = Axis::new("friction coefficient", "1")
        .with_symbol("μ")
        .ranging(0.0, 1.1 * largest);
    Figure {
        name: entry.name.to_owned(),
        title: entry.title.to_owned(),
        paper_figure: None,
        panels: vec![Panel::new(x, y, curves)],
    }
}

/// The symbol of the relative velocity.
fn symbol(motion: Motion) -> &'static str {
    match motion {
        Motion::Rotation => "ωᵣ",
        Motion::Translation => "vᵣ",
    }
}
