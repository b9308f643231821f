//! Figures of the friction law, and of `stickslip modes`.

use super::entry::{CatalogueEntry, Drawn, Subject};
use super::figure::{Axis, Curve, CurveStyle, Figure, Panel, drawn};
use super::run::DrawnRun;
use super::style::{BLACK, BLUE, GREY, VERMILLION, of_run};
use std::f64::consts::FRAC_2_PI;
use stickslip_analysis::analysis::stability::Modes;
use stickslip_analysis::analysis::stability::modes::{EffectiveDamping, SlowingModes};
use stickslip_case::Motion;
use stickslip_case::quantity::Dimension;
use stickslip_system::friction::{FrictionLaw, Law};
use stickslip_system::model::system::{Bristles, ContactLaw, Regularisation, Smoothing, System};

/// Number of points of the curve, evenly spaced. A contact without stick has as many additional points near rest.
const POINTS: i32 = 240;

/// Friction coefficient at a steady relative speed `x` by a law of the system.
fn coefficient(trains: &System, law: &FrictionLaw, x: f64) -> f64 {
    let law = law.coefficient(x);
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
            let changes = Modes::linear(&run.system).critical_relative_velocities.changes;
            changes.iter().map(|change| change.value).collect()
        }
    }
}

pub(super) fn friction_law(entry: &CatalogueEntry, subject: &Subject) -> Drawn {
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
        let mut speeds: Vec<f64> = even.chain(near).collect();
        speeds.sort_by(f64::total_cmp);
        let curve = |law: &FrictionLaw, label: &str| {
            let points = speeds.iter().map(|&x| (x, coefficient(&run.system, law, x))).collect();
            let (color, style) = of_run(number);
            Curve::line(label, color, points).styled(if several { style } else { CurveStyle::Solid })
        };
        let backward = run.system.law.backward();
        let label = match (several, backward.is_some()) {
            (true, _) => run.label(),
            (false, false) => format!("sliding, μ(|{symbol}|)"),
            (false, true) => format!("forward, μ(|{symbol}|)"),
        };
        curves.push(curve(&run.system.law, &label));
        if let Some(backward) = backward {
            let label = if several {
                format!("{label}, backward")
            } else {
                "backward".to_owned()
            };
            curves.push(curve(&backward.law, &label).styled(if several {
                CurveStyle::Dotted
            } else {
                CurveStyle::Dashed
            }));
        }
    }
    let most = |curve: &Curve| curve.points().map(|point| point.1).fold(0.0, f64::max);
    let mut largest = curves.iter().map(most).fold(1e-3, f64::max);
    if trains.contact == ContactLaw::StickSlip {
        let backward = trains.law.backward().map(|backward| backward.breakaway);
        let breakaways = [Some(trains.breakaway), backward].into_iter().flatten();
        largest = breakaways.clone().fold(largest, f64::max);
        if !several {
            let rest = Curve::line("rest, μ₀", VERMILLION, breakaways.map(|mu| (0.0, mu)).collect());
            curves.push(rest.styled(CurveStyle::Points));
        }
    }
    if !several {
        let within = critical_speeds(run).into_iter().filter(|&x| x <= end);
        let points = within.map(|x| (x, coefficient(trains, &trains.law, x))).collect();
        curves.push(Curve::open("critical speed", BLACK, points));
    }
    let x = Axis::new("relative velocity", units)
        .with_symbol(&format!("|{symbol}|"))
        .ranging(0.0, end);
    let y = Axis::new("friction coefficient", "1")
        .with_symbol("μ")
        .ranging(0.0, 1.1 * largest);
    Ok(entry.figure(vec![Panel::new(x, y, drawn(curves))]))
}

/// Effective damping of the relative mode, and growth rate in slip, over the relative speed.
pub fn modes_figure(title: &str, motion: Motion, modes: &SlowingModes) -> Figure {
    let unit = |of_rotation| motion.dimension(of_rotation).unit();
    let (speed, damping_unit) = (unit(Dimension::AngularVelocity), unit(Dimension::TorsionalDamping));
    let curve = |value: fn(&EffectiveDamping) -> f64| -> Vec<(f64, f64)> {
        let points = modes.effective_damping.iter();
        points.map(|point| (point.relative_velocity, value(point))).collect()
    };
    let end = modes
        .effective_damping
        .last()
        .map_or(1.0, |point| point.relative_velocity);
    let zero = || Curve::dashed("", GREY, vec![(0.0, 0.0), (end, 0.0)]);
    let mut damping = vec![zero(), Curve::line("effective damping", BLUE, curve(|p| p.damping))];
    let mut growth = vec![zero(), Curve::line("growth rate", VERMILLION, curve(|p| p.growth_rate))];
    let all = match modes.critical_speeds.as_slice() {
        [] => modes.critical_speed.as_slice(),
        several => several,
    };
    for &critical in all {
        let label = format!("critical speed, {critical:.4} {speed}");
        for curves in [&mut damping, &mut growth] {
            let point = Curve::line(&label, BLACK, vec![(critical, 0.0)]);
            curves.push(point.styled(CurveStyle::OpenPoints));
        }
    }
    let unit = match motion {
        Motion::Rotation => "rad s-1",
        Motion::Translation => "m s-1",
    };
    let x = Axis::new("relative velocity", unit)
        .with_symbol("|ωᵣ|")
        .ranging(0.0, end);
    let y = Axis::new("effective damping", damping_unit).with_symbol("c");
    let rate = Axis::new("growth rate", "1/s").with_symbol("Re λ");
    let panels = vec![Panel::new(x.clone(), y, damping), Panel::new(x, rate, growth)];
    Figure::new("modes", format!("Steady sliding: {title}"), panels)
}
