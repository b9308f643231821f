//! When a stick breaks away, by bounds on what is tested.

use super::bounds::positive_for;

/// Steps of one search for a breakaway. A system whose fast mode is damped out takes a few hundred; one so overdamped that its
/// time scales lie a million apart could take minutes, in which the run must stay interruptible.
const MOST_ROUNDS: u64 = 100_000;

/// When a stick breaks away.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Breakaway {
    /// Into slip.
    After {
        /// From the start, s.
        after: f64,
        /// Of the slip, +1 or -1.
        sense: f64,
    },
    /// Not within the stretch asked for.
    NotYet,
    /// Not before this; the search has taken its steps without getting farther.
    NotBefore {
        /// From the start, s.
        until: f64,
    },
    /// Not for as long as the bounds hold.
    Never,
}

/// A function of time at one time, with a bound on what it does from there on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounded {
    pub value: f64,
    pub rate: f64,
    /// The largest |second derivative| from here on.
    pub curvature: f64,
}

impl Bounded {
    /// `factor` >= 0 times it.
    pub fn scaled(self, factor: f64) -> Bounded {
        Bounded {
            value: factor * self.value,
            rate: factor * self.rate,
            curvature: factor * self.curvature,
        }
    }
}

/// What a search for a breakaway is told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Search {
    /// The time scale of what moves, s.
    pub period: f64,
    /// s.
    pub within: f64,
    /// A torque no larger than this (N m) is zero but for rounding: it breaks no stick.
    pub noise: f64,
}

/// The first time at which the tested torque reaches the breakaway torque, from the start of a stick on.
///
/// `tested` gives the torque a time after the start, and the largest magnitude that it has from there on; `limit` gives the
/// breakaway torque, and `lowest` the least that it has from there on. The search steps over times in which the bounds
/// exclude a root, and so passes over none.
pub(crate) fn first_breakaway(
    search: Search,
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
        // Until delta, neither distance to the limit can have reached zero.
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
        // Contact that is just closing, under no torque: the limit is zero now and positive right after.
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
