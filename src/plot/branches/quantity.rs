//! Quantities of the points of a branch.

use crate::plot::figure::Axis;
use stickslip_analysis::continuation::{Branch, BranchPoint, Stored};

/// Returns the value at a point; NaN if there is none.
pub type Value = fn(&Branch, &BranchPoint) -> f64;

/// A quantity of the points.
#[derive(Debug, Clone, Copy)]
pub struct BranchQuantity {
    /// Name for `--quantity`.
    pub name: &'static str,
    /// Name in titles and lists.
    pub words: &'static str,
    name_at_axis: &'static str,
    measure: Measure,
    /// The value, or the lower one if there are two.
    pub low: Value,
    /// The upper value, if there are two.
    pub high: Option<Value>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Measure {
    Position,
    Speed,
    Time,
    Rate,
    Number,
}

impl BranchQuantity {
    /// Unit in the notation of UDUNITS.
    pub fn unit<'a>(&self, stored: &'a Stored) -> &'a str {
        match self.measure {
            Measure::Position => &stored.angle,
            Measure::Speed => &stored.speed,
            Measure::Time => "s",
            Measure::Rate => "s-1",
            Measure::Number => "1",
        }
    }

    pub(in crate::plot) fn axis(&self, stored: &Stored) -> Axis {
        let axis = Axis::new(self.name_at_axis, self.unit(stored));
        match (self.measure, stored.speed.starts_with("rad")) {
            (Measure::Speed, true) => axis.with_symbol("ωᵣ"),
            (Measure::Speed, false) => axis.with_symbol("vᵣ"),
            _ => axis,
        }
    }

    /// The value, or both values if there are two.
    pub fn sides(&self) -> impl Iterator<Item = Value> + use<> {
        [Some(self.low), self.high].into_iter().flatten()
    }
}

const fn one(name: &'static str, words: &'static str, measure: Measure, of: Value) -> BranchQuantity {
    BranchQuantity {
        name,
        words,
        name_at_axis: words,
        measure,
        low: of,
        high: None,
    }
}

const fn both(
    name: &'static str,
    words: &'static str,
    name_at_axis: &'static str,
    measure: Measure,
    (low, high): (Value, Value),
) -> BranchQuantity {
    BranchQuantity {
        high: Some(high),
        ..one(name, words, measure, low).shorter(name_at_axis)
    }
}

impl BranchQuantity {
    const fn shorter(self, name_at_axis: &'static str) -> BranchQuantity {
        BranchQuantity { name_at_axis, ..self }
    }
}

const fn least_position(_: &Branch, point: &BranchPoint) -> f64 {
    point.position.0
}

const fn largest_position(_: &Branch, point: &BranchPoint) -> f64 {
    point.position.1
}

const fn least_velocity(_: &Branch, point: &BranchPoint) -> f64 {
    point.relative_velocity.0
}

const fn largest_velocity(_: &Branch, point: &BranchPoint) -> f64 {
    point.relative_velocity.1
}

/// Largest |multiplier| of a cycle, except the trivial one along the motion.
fn multiplier(branch: &Branch, point: &BranchPoint) -> f64 {
    let magnitudes = point.spectrum.iter().map(|one| one.0.hypot(one.1));
    match branch.steady {
        true => f64::NAN,
        false => magnitudes.fold(f64::NAN, f64::max),
    }
}

/// Largest growth rate of a disturbance, 1/s: the largest real part of the eigenvalues in steady sliding, or
/// ln|multiplier|/period for cycles. NaN if all disturbances vanish within a period.
fn growth_rate(branch: &Branch, point: &BranchPoint) -> f64 {
    let rate = match branch.steady {
        true => point.spectrum.iter().map(|one| one.0).fold(f64::NAN, f64::max),
        false => multiplier(branch, point).ln() / point.period,
    };
    if rate.is_finite() { rate } else { f64::NAN }
}

/// All quantities in the order of lists.
pub const QUANTITIES: &[BranchQuantity] = &[
    one("amplitude", "amplitude", Measure::Position, |_, point| {
        (point.position.1 - point.position.0) / 2.0
    }),
    both(
        "position",
        "least and largest position",
        "position",
        Measure::Position,
        (least_position, largest_position),
    ),
    one("least_position", "least position", Measure::Position, least_position),
    one(
        "largest_position",
        "largest position",
        Measure::Position,
        largest_position,
    ),
    both(
        "relative_velocity",
        "least and largest relative velocity",
        "relative velocity",
        Measure::Speed,
        (least_velocity, largest_velocity),
    ),
    one(
        "least_relative_velocity",
        "least relative velocity",
        Measure::Speed,
        least_velocity,
    ),
    one(
        "largest_relative_velocity",
        "largest relative velocity",
        Measure::Speed,
        largest_velocity,
    ),
    one("period", "period", Measure::Time, |branch, point| match branch.steady {
        true => f64::NAN,
        false => point.period,
    }),
    one("multiplier", "largest |multiplier|", Measure::Number, multiplier),
    one("growth_rate", "growth rate", Measure::Rate, growth_rate),
    one("unstable", "unstable directions", Measure::Number, |_, point| {
        point.unstable as f64
    }),
    one(
        "sticks",
        "sticks in a period",
        Measure::Number,
        |branch, point| match branch.steady {
            true => f64::NAN,
            false => point.sticks as f64,
        },
    ),
    one(
        "shortest_stick",
        "duration of the shortest stick",
        Measure::Time,
        |_, point| point.shortest_stick,
    )
    .shorter("shortest stick"),
    one(
        "margin",
        "distance of another sequence of events",
        Measure::Number,
        |_, point| point.margin,
    )
    .shorter("margin"),
];
