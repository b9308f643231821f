//! The figure of the friction law.

use super::entry::{Drawn, Entry, Subject};
use super::figure::{Axis, Curve, CurveStyle, Panel, drawn};
use super::run::DrawnRun;
use super::style::{BLACK, VERMILLION, line_color};
use std::f64::consts::FRAC_2_PI;
use stickslip_analysis::analysis::stability::SystemModes;
use stickslip_case::Motion;
use stickslip_system::friction::Law;
use stickslip_system::model::system::{Bristles, ContactLaw, Regularisation, Smoothing, System};

/// Number of points of the curve, evenly spaced. A contact without stick has as many additional points near rest.
const POINTS: i32 = 240;

fn coefficient(trains: &System, x: f64) -> f64 {
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

/// Speeds (rad/s) at which steady sliding loses stability. For a run that stops they follow from the margin under the
/// largest force, otherwise from the impedance of the trains.
fn critical_speeds(run: &DrawnRun) -> Vec<f64> {
    let (system, force) = (run.course.system(), run.course.largest_force());
    match system.twice_resistance {
        Some(resistance) => system.law.damping_zeros(resistance, system.slope_weight(force)),
        None => {
            let changes = SystemModes::of_case(&run.system).critical_relative_velocities.changes;
            changes.iter().map(|change| change.value).collect()
        }
    }
}

pub(super) fn friction_law(entry: &Entry, subject: &Subject) -> Drawn {
    let (run, several) = (subject.run, subject.runs.len() > 1);
    let trains = &run.system;
    let extent = trains.law.extent().min(trains.law.ends_at());
    let end = if extent.is_finite() { extent } else { 1.0 };
    let (units, symbol) = match run.case.motion() {
        Motion::Rotation => ("rad s-1", "ωᵣ"),
        Motion::Translation => ("m s-1", "vᵣ"),
    };
    let mut curves = Vec::new();
    for (number, run) in subject.runs.iter().enumerate() {
        let even = (0..=POINTS).map(|k| end * f64::from(k) / f64::from(POINTS));
        // A regularised law rises very close to rest.
        let near = (0..POINTS).map(|k| end * 10f64.powf(f64::from(k) / 24.0 - 10.0));
        let near = near.filter(|_| run.system.contact != ContactLaw::StickSlip);
        let mut points: Vec<(f64, f64)> = even.chain(near).map(|x| (x, coefficient(&run.system, x))).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let label = match several {
            true => run.label(),
            false => format!("sliding, μ(|{symbol}|)"),
        };
        curves.push(Curve::line(&label, line_color(number), points));
    }
    let most = |curve: &Curve| curve.points().map(|point| point.1).fold(0.0, f64::max);
    let mut largest = curves.iter().map(most).fold(1e-3, f64::max);
    if trains.contact == ContactLaw::StickSlip {
        largest = largest.max(trains.breakaway);
        if !several {
            let rest = Curve::line("rest, μ₀", VERMILLION, vec![(0.0, trains.breakaway)]);
            curves.push(rest.styled(CurveStyle::Points));
        }
    }
    if !several {
        let within = critical_speeds(run).into_iter().filter(|&x| x <= end);
        let points = within.map(|x| (x, coefficient(trains, x))).collect();
        curves.push(Curve::line("critical speed", BLACK, points).styled(CurveStyle::OpenPoints));
    }
    let x = Axis::new("relative velocity", units)
        .with_symbol(&format!("|{symbol}|"))
        .ranging(0.0, end);
    let y = Axis::new("friction coefficient", "1")
        .with_symbol("μ")
        .ranging(0.0, 1.1 * largest);
    Ok(entry.figure(vec![Panel::new(x, y, drawn(curves))]))
}
