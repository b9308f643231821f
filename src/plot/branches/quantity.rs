//! Quantities of the points of a branch.

use crate::plot::figure::Axis;
use Measure::{Number, Position, Rate, Speed, Time};
use stickslip_analysis::continuation::{Branch, BranchPoint, Stored};

/// Value at a point; NaN: none.
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
    /// Quantities of a sweep's runs that are the same of a periodic motion; may be empty.
    pub(super) of_runs: &'static [&'static str],
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
            Position => &stored.angle,
            Speed => &stored.speed,
            Time => "s",
            Rate => "s-1",
            Number => "1",
        }
    }

    pub(in crate::plot) fn axis(&self, stored: &Stored) -> Axis {
        let axis = Axis::new(self.name_at_axis, self.unit(stored));
        match (self.measure, stored.speed.starts_with("rad")) {
            (Speed, true) => axis.with_symbol("ωᵣ"),
            (Speed, false) => axis.with_symbol("vᵣ"),
            _ => axis,
        }
    }

    /// The value, or both values if there are two.
    pub fn sides(&self) -> impl Iterator<Item = Value> + use<> {
        [Some(self.low), self.high].into_iter().flatten()
    }
}

const fn one(name: &'static str, words: &'static str, measure: Measure, low: Value) -> BranchQuantity {
    BranchQuantity {
        name,
        words,
        name_at_axis: words,
        measure,
        low,
        high: None,
        of_runs: &[],
    }
}

impl BranchQuantity {
    const fn and(self, high: Value) -> BranchQuantity {
        let high = Some(high);
        BranchQuantity { high, ..self }
    }

    const fn swept(self, of_runs: &'static [&'static str]) -> BranchQuantity {
        BranchQuantity { of_runs, ..self }
    }

    const fn shorter(self, name_at_axis: &'static str) -> BranchQuantity {
        BranchQuantity { name_at_axis, ..self }
    }
}

/// Least and largest values over a period in a sweep.
const RUN_POSITION: (&str, &str) = ("attractor_position_min", "attractor_position_max");
const RUN_VELOCITY: (&str, &str) = ("attractor_relative_velocity_min", "attractor_relative_velocity_max");

const LEAST_POSITION: Value = |_, point| point.position.0;
const LARGEST_POSITION: Value = |_, point| point.position.1;
const LEAST_VELOCITY: Value = |_, point| point.relative_velocity.0;
const LARGEST_VELOCITY: Value = |_, point| point.relative_velocity.1;

fn of_cycle(branch: &Branch, value: f64) -> f64 {
    if branch.steady { f64::NAN } else { value }
}

/// Largest |multiplier| of a cycle, except the trivial one along the motion.
fn multiplier(branch: &Branch, point: &BranchPoint) -> f64 {
    let magnitudes = point.spectrum.iter().map(|one| one.0.hypot(one.1));
    of_cycle(branch, magnitudes.fold(f64::NAN, f64::max))
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
    one("amplitude", "amplitude", Position, |_, point| {
        (point.position.1 - point.position.0) / 2.0
    })
    .swept(&["attractor_amplitude"]),
    one("position", "least and largest position", Position, LEAST_POSITION)
        .and(LARGEST_POSITION)
        .swept(&[RUN_POSITION.0, RUN_POSITION.1])
        .shorter("position"),
    one("least_position", "least position", Position, LEAST_POSITION).swept(&[RUN_POSITION.0]),
    one("largest_position", "largest position", Position, LARGEST_POSITION).swept(&[RUN_POSITION.1]),
    one(
        "relative_velocity",
        "least and largest relative velocity",
        Speed,
        LEAST_VELOCITY,
    )
    .and(LARGEST_VELOCITY)
    .swept(&[RUN_VELOCITY.0, RUN_VELOCITY.1])
    .shorter("relative velocity"),
    one(
        "least_relative_velocity",
        "least relative velocity",
        Speed,
        LEAST_VELOCITY,
    )
    .swept(&[RUN_VELOCITY.0]),
    one(
        "largest_relative_velocity",
        "largest relative velocity",
        Speed,
        LARGEST_VELOCITY,
    )
    .swept(&[RUN_VELOCITY.1]),
    one("period", "period", Time, |branch, point| of_cycle(branch, point.period)).swept(&["attractor_period"]),
    one("multiplier", "largest |multiplier|", Number, multiplier),
    one("growth_rate", "growth rate", Rate, growth_rate),
    one("unstable", "unstable directions", Number, |_, point| {
        point.unstable as f64
    }),
    one("sticks", "sticks in a period", Number, |branch, point| {
        of_cycle(branch, point.sticks as f64)
    })
    .swept(&["attractor_sticks"]),
    one("shortest_stick", "duration of the shortest stick", Time, |_, point| {
        point.shortest_stick
    })
    .shorter("shortest stick"),
    one(
        "margin",
        "distance of another sequence of events",
        Number,
        |_, point| point.margin,
    )
    .shorter("margin"),
];
