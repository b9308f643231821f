//! The figure of `stickslip certify --figure`.

use super::figure::{Axis, Curve, CurveStyle, Figure, Panel, drawn, extent};
use super::style::PALETTE;
use stickslip_analysis::analysis::stability::growth::{METHODS, Onset};

/// Name of the figure and its files.
pub const NAME: &str = "onset-against-tolerance";

/// Smallest drawn distance, s, about the spacing of doubles at the times. Zero has no logarithm.
const LEAST: f64 = 1e-15;

/// Time of the first stick over the tolerance, without and with a kick on one scale, and its distance from the first
/// stick of the first method at its finest tolerance.
pub fn figure(title: &str, onsets: &[Onset]) -> Figure {
    let times = extent(onsets.iter().filter_map(|onset| onset.first_stick));
    let reference = onsets
        .iter()
        .filter(|onset| onset.kicked && onset.method == METHODS[0].name())
        .filter_map(|onset| onset.first_stick)
        .next_back();
    let curves = |kicked: bool, value: &dyn Fn(f64) -> Option<f64>, skipped: usize| -> Vec<Curve> {
        let mut curves = Vec::new();
        for (method, color) in METHODS.iter().zip(PALETTE).skip(skipped) {
            let points: Vec<(f64, f64)> = onsets
                .iter()
                .filter(|onset| onset.kicked == kicked && onset.method == method.name())
                .filter_map(|onset| Some((onset.rtol, value(onset.first_stick?)?)))
                .collect();
            curves.push(Curve::line(method.name(), color, points.clone()));
            curves.push(Curve::line("", color, points).styled(CurveStyle::Points));
        }
        drawn(curves)
    };
    let panel = |y: Axis, curves| Panel::new(Axis::new("rtol", "1").by_powers(), y, curves);
    let first_stick = |name: &str| {
        let range = times.map(|(low, high)| {
            // A margin of 5 % on each side, as without a fixed range.
            let margin = ((high - low) / 20.0).max(f64::EPSILON * high.abs());
            (low - margin, high + margin)
        });
        Axis {
            range,
            ..Axis::new(name, "s")
        }
    };
    let distance = |time: f64| Some((time - reference?).abs().max(LEAST));
    let distances = Axis::new("kicked, distance", "s").by_powers();
    let panels = vec![
        panel(first_stick("no kick"), curves(false, &Some, 0)),
        panel(first_stick("kicked"), curves(true, &Some, 0)),
        panel(distances, curves(true, &distance, 1)),
    ];
    Figure::new(NAME, format!("First stick against tolerance: {title}"), panels)
}
