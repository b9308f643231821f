//! Breakaway from stick, located with bounds of the tested torque.

use super::bounds::positive_for;

/// Most steps of one search for a breakaway. A system with a damped fast mode takes a few hundred. A strongly
/// overdamped system, with time scales a million apart, could take minutes, and must stay interruptible.
const MOST_ROUNDS: u64 = 100_000;

/// Result of a search for a breakaway.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Breakaway {
    /// Slip begins.
    After {
        /// Time since the start, s.
        after: f64,
        /// Sense of the slip, +1 or -1.
        sense: f64,
    },
    /// No breakaway within the searched stretch.
    NotYet,
    /// No breakaway before `until`, where the search has used all its steps.
    NotBefore {
        /// Time since the start, s.
        until: f64,
    },
    /// No breakaway while the bounds are valid.
    Never,
}

/// A function of time: its value and rate at one instant, with a bound for all later times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounded {
    /// Value at the time.
    pub value: f64,
    /// Derivative with respect to time, 1/s of the value's unit.
    pub rate: f64,
    /// Largest |second derivative| from this time on, 1/s^2 of the value's unit.
    pub curvature: f64,
}

impl Bounded {
    /// The function times `factor` >= 0.
    pub fn scaled(self, factor: f64) -> Bounded {
        Bounded {
            value: factor * self.value,
            rate: factor * self.rate,
            curvature: factor * self.curvature,
        }
    }
}

/// Parameters of a search for a breakaway.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BreakawaySearch {
    /// Time scale of the motion, s.
    pub period: f64,
    /// Length of the searched stretch, s.
    pub within: f64,
    /// Torques up to this (N m) are rounding, and break no stick.
    pub noise: f64,
}

/// The first time after the start of a stick (s) at which the tested torque reaches the breakaway torque.
///
/// `tested` returns the torque at a time after the start, with a bound of its later magnitude. `limit` returns the
/// breakaway torque, and `lowest` its least later value. The search steps over times in which the bounds exclude a
/// root, so that no root is missed.
pub(crate) fn first_breakaway(
    search: BreakawaySearch,
    tested: impl Fn(f64) -> (Bounded, f64),
    limit: impl Fn(f64) -> Bounded,
    lowest: impl Fn(f64) -> f64,
) -> Breakaway {
    let mut tau = 0.0;
    for round in 0..MOST_ROUNDS {
        let (torque, largest) = tested(tau);
        let limit = limit(tau);
        let asks = round % 16 == 4 || round == 0 && search.noise > 0.0;
        if asks && (largest <= search.noise || lowest(tau) > largest) {
            return Breakaway::Never;
        }
        let curvature = limit.curvature + torque.curvature;
        // Neither distance to the limit can reach zero before delta.
        let (mut delta, mut sense) = (f64::INFINITY, 0.0);
        for s in [1.0, -1.0] {
            let (g, rate) = (limit.value - s * torque.value, limit.rate - s * torque.rate);
            let step = if g <= 0.0 {
                0.0
            } else {
                positive_for(g, rate, curvature)
            };
            if step < delta {
                (delta, sense) = (step, s);
            }
        }
        // A closing contact under no torque: the limit is zero now, and positive just after.
        let unloaded = torque.value.abs() <= search.noise;
        if round == 0 && limit.value <= 0.0 && unloaded && (limit.rate > 0.0 || curvature > 0.0) {
            tau = 1e-3 * search.period;
            continue;
        }
        if delta <= f64::EPSILON * tau.max(1e-4 * search.period) {
            return Breakaway::After { after: tau, sense };
        }
        tau += delta;
        if tau >= search.within {
            return Breakaway::NotYet;
        }
    }
    Breakaway::NotBefore { until: tau }
}
