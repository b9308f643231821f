//! Breakaway from stick, located with bounds of the tested torque.

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
/// `tested` gives the torque a time after the start, and its largest magnitude from then on; `limit` the breakaway
/// torque into a sense (+1 or -1), and `lowest` its least value from then on in both. The search steps over times in which the bounds exclude a root,
/// so that it passes over none.
pub(crate) fn first_breakaway(
    search: BreakawaySearch,
    tested: impl Fn(f64) -> (Bounded, f64),
    limit: impl Fn(f64, f64) -> Bounded,
    lowest: impl Fn(f64) -> f64,
) -> Breakaway {
    let mut tau = 0.0;
    for round in 0..MOST_ROUNDS {
        let (torque, largest) = tested(tau);
        let asks = round % 16 == 4 || round == 0 && search.noise > 0.0;
        if asks && (largest <= search.noise || lowest(tau) > largest) {
            return Breakaway::Never;
        }
        // Before delta neither distance to its limit can reach zero.
        let (mut delta, mut sense, mut closes) = (f64::INFINITY, 0.0, false);
        for s in [1.0, -1.0] {
            let limit = limit(s, tau);
            let curvature = limit.curvature + torque.curvature;
            let (g, rate) = (limit.value - s * torque.value, limit.rate - s * torque.rate);
            let step = if g <= 0.0 {
                0.0
            } else {
                positive_for(g, rate, curvature)
            };
            if step < delta {
                (delta, sense) = (step, s);
                closes = limit.value <= 0.0 && (limit.rate > 0.0 || curvature > 0.0);
            }
        }
        // Contact that is closing under no torque: the limit is zero now, and positive right after.
        if round == 0 && closes && torque.value.abs() <= search.noise {
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

/// Distance over which a function with value `g` > 0, slope `rate` and |second derivative| <= `curvature` provably
/// stays positive: the positive zero of g + rate x - curvature x^2 / 2, or infinity without one.
///
/// Repeated steps converge to the first root from the left, and never pass a root. Near a simple root they are
/// Newton's.
pub fn positive_for(g: f64, rate: f64, curvature: f64) -> f64 {
    let root = (rate * rate + 2.0 * curvature * g).sqrt();
    if rate < 0.0 {
        // This form does not cancel.
        2.0 * g / (root - rate)
    } else if curvature > 0.0 {
        (rate + root) / curvature
    } else {
        f64::INFINITY
    }
}
