//! The figure of `stickslip certify --figure`.

use super::figure::{Axis, Curve, CurveStyle, Figure, Panel};
use super::style::PALETTE;
use crate::analysis::stability::onset::{METHODS, Onset};

/// Name of the figure.
pub const NAME: &str = "onset-against-tolerance";

/// A distance of nothing has no logarithm: it is drawn here, s, which is about the spacing of times as doubles.
const LEAST: f64 = 1e-15;

/// The first stick against the tolerance, without and with a kick on one scale; and with it the distance from the first
/// stick of the first method at its finest tolerance.
pub fn figure(title: &str, onsets: &[Onset]) -> Figure {
    let times = || onsets.iter().filter_map(|onset| onset.first_stick);
    let (low, high) = times().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), t| {
        (low.min(t), high.max(t))
    });
    // A twentieth on each side, as where no range is set.
    let margin = ((high - low) / 20.0).max(f64::EPSILON * high.abs());
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
            if !points.is_empty() {
                curves.push(Curve::line(method.name(), color, points.clone()));
                curves.push(Curve::line("", color, points).styled(CurveStyle::Points));
            }
        }
        curves
    };
    let panel = |y: Axis, curves| Panel::new(Axis::new("rtol", "1").by_powers(), y, curves);
    let first_stick = |name: &str| {
        let axis = Axis::new(name, "s");
        if low <= high {
            axis.ranging(low - margin, high + margin)
        } else {
            axis
        }
    };
    let distance = |time: f64| Some((time - reference?).abs().max(LEAST));
    Figure {
        name: NAME.to_owned(),
        title: format!("First stick against tolerance: {title}"),
        paper_figure: None,
        panels: vec![
            panel(first_stick("no kick"), curves(false, &Some, 0)),
            panel(first_stick("kicked"), curves(true, &Some, 0)),
            panel(
                Axis::new("kicked, distance", "s").by_powers(),
                curves(true, &distance, 1),
            ),
        ],
    }
}
