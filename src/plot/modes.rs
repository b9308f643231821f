//! The figure of `stickslip modes`.

use super::figure::{Axis, Curve, CurveStyle, Figure, Panel};
use super::style::{BLACK, BLUE, GREY, VERMILLION};
use stickslip_analysis::analysis::stability::modes::{EffectiveDamping, SlowingModes};
use stickslip_case::Motion;
use stickslip_case::quantity::Dimension;

/// Effective damping of the relative mode, and growth rate in slip, over the relative speed.
pub fn figure(title: &str, motion: Motion, modes: &SlowingModes) -> Figure {
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
    let zero = || Curve::line("", GREY, vec![(0.0, 0.0), (end, 0.0)]).styled(CurveStyle::Dashed);
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
