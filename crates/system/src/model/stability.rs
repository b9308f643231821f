//! Forecast of the time at which steady sliding loses its stability.
//!
//! One free train slows down by friction against a train at rest. In slip the linearised equations depend on the
//! state only through the contact's damping kappa = r F_n mu', which is negative for falling friction.

use super::equations::{Side, SystemEquations};
use crate::friction::{Bounds, Law};
use crate::numerics::eigenvalues::eigenvalues;
use nalgebra::{Complex, DMatrix};

/// The initial speed over the smallest fall of the speed in one step, however steep the friction law is.
const FINEST: f64 = 20_000.0;

const SHARE_OF_SCALE: f64 = 0.05;

const MOST_STEPS: usize = 100_000;

/// Smallest ratio between an inertia and the surface's for which the inertia counts as the fixed far end of the
/// surface's shaft. Its motion detunes two equal disks, whose fast modes then decay faster than stated.
const HEAVY: f64 = 20.0;

/// Number of tabulated values of the fast modes' decay per e-fold of kappa, with linear interpolation between them.
const PER_E_FOLD: f64 = 16.0;

/// Range of tabulated values on either side of the resistance, in e-folds of kappa. The decay is constant beyond.
const E_FOLDS: f64 = 20.0;

/// Decay of the fast modes in a slip, as a function of the contact's damping kappa.
#[derive(Debug, Clone)]
pub struct FastModes {
    /// 2 R, N m s/rad.
    twice_resistance: f64,
    spectrum: Option<Spectrum>,
}

/// The slow modes of a slip.
#[derive(Debug, Clone, Copy)]
pub enum Slow {
    /// One mode for each free train.
    OfFreeChains,
    /// Modes with an eigenvalue up to this magnitude, 1/s.
    UpTo(f64),
}

/// Rates of the modes in a slip, 1/s.
#[derive(Debug, Clone, Copy)]
pub struct Rates {
    /// Least decay of a fast mode, 1/s; minus infinity if the eigenvalues are not found.
    pub decay: f64,
    /// Largest magnitude of a slow mode's eigenvalue, 1/s.
    pub slow: f64,
}

/// The modes as functions of kappa, with eigenvalues that are computed on demand.
#[derive(Debug, Clone)]
pub struct Spectrum {
    slow: Slow,
    /// Tabulated values of kappa are this scale times sinh(i / [`PER_E_FOLD`]).
    scale: f64,
    rates: Vec<Option<Rates>>,
}

impl FastModes {
    /// The fast modes of a system with the stability margin `twice_resistance` + 2 kappa (N m s/rad; infinite if no
    /// swing of the surfaces can become unstable).
    pub fn new(system: &SystemEquations, twice_resistance: f64) -> Self {
        let spectrum = (!two_disks(system)).then(|| {
            let finite = twice_resistance > 0.0 && twice_resistance.is_finite();
            let resistance = finite.then_some(twice_resistance / 2.0);
            Spectrum::new(system, resistance, Slow::OfFreeChains)
        });
        FastModes {
            twice_resistance,
            spectrum,
        }
    }

    /// 2 (R + kappa), N m s/rad.
    pub fn margin(&self, contact_damping: f64) -> f64 {
        self.twice_resistance + 2.0 * contact_damping
    }

    /// Decay of the least damped fast mode at this kappa, 1/s; negative if the mode grows.
    ///
    /// Two equal disks have a closed form if the far ends of their shafts are at rest.
    pub fn decay(&mut self, system: &SystemEquations, contact_damping: f64) -> f64 {
        match &mut self.spectrum {
            None => {
                let (inertia, stiffness) = (system.rotor.inertia[0], system.rotor.stiffness[0]);
                let of = |damping: f64| slower(inertia, damping, stiffness);
                of(self.twice_resistance + 2.0 * contact_damping).min(of(self.twice_resistance))
            }
            Some(spectrum) => spectrum.at(system, contact_damping),
        }
    }

    /// The least decay for all kappa in `between`, 1/s.
    fn least_decay(&mut self, system: &SystemEquations, between: Bounds) -> f64 {
        let ends = [between.least, between.most].map(|kappa| self.decay(system, kappa));
        let least = ends[0].min(ends[1]);
        match &mut self.spectrum {
            // The closed form rises with the damping of a pair until its eigenvalues are real, and falls afterwards.
            // It has no minimum in between.
            None => least,
            Some(spectrum) => {
                let places = [between.least, between.most].map(|kappa| spectrum.place(kappa));
                let inner = places[0].ceil() as usize..=places[1].floor() as usize;
                inner
                    .map(|index| spectrum.node(system, index).decay)
                    .fold(least, f64::min)
            }
        }
    }
}

/// Whether both surfaces are equal and each swings on one shaft, whose far end is the ground or a heavy inertia.
fn two_disks(system: &SystemEquations) -> bool {
    let one = |side: &Side| side.shafts() == 1;
    let held = |side: &Side| {
        side.inertia
            .get(1)
            .is_none_or(|outer| *outer >= HEAVY * side.inertia[0])
    };
    let (rotor, stator) = (&system.rotor, &system.stator);
    one(rotor)
        && one(stator)
        && held(rotor)
        && held(stator)
        && rotor.inertia[0] == stator.inertia[0]
        && rotor.stiffness == stator.stiffness
        && rotor.damping[0] + rotor.viscous[0] == stator.damping[0] + stator.viscous[0]
}

/// The slower of the two decays of inertia s^2 + damping s + stiffness = 0, 1/s.
fn slower(inertia: f64, damping: f64, stiffness: f64) -> f64 {
    let apart = damping * damping - 4.0 * stiffness * inertia;
    if apart <= 0.0 {
        damping / (2.0 * inertia)
    } else if damping > 0.0 {
        2.0 * stiffness / (damping + apart.sqrt())
    } else {
        (damping - apart.sqrt()) / (2.0 * inertia)
    }
}

impl Spectrum {
    /// An empty table, dense for |kappa| up to `resistance` (N m s/rad), or without one up to 0.01 sqrt(k J) of a shaft.
    pub fn new(system: &SystemEquations, resistance: Option<f64>, slow: Slow) -> Self {
        let own = |side: &Side| {
            let shafts = side.stiffness.iter().zip(&side.inertia);
            shafts.map(|(k, j)| 0.01 * (k * j).sqrt()).fold(f64::INFINITY, f64::min)
        };
        Spectrum {
            slow,
            scale: resistance.unwrap_or_else(|| own(&system.rotor).min(own(&system.stator))),
            rates: vec![None; 2 * (E_FOLDS * PER_E_FOLD) as usize + 2],
        }
    }

    /// Least decay of fast modes and largest magnitude of slow ones over all kappa in `between`, including the
    /// adjacent tabulated values.
    pub fn over(&mut self, system: &SystemEquations, between: Bounds) -> Rates {
        let places = [between.least, between.most].map(|kappa| self.place(kappa));
        let within = places[0].floor() as usize..=places[1].ceil() as usize;
        let none = Rates {
            decay: f64::INFINITY,
            slow: 0.0,
        };
        within.fold(none, |all, index| {
            let rates = self.node(system, index);
            Rates {
                decay: all.decay.min(rates.decay),
                slow: all.slow.max(rates.slow),
            }
        })
    }

    fn place(&self, kappa: f64) -> f64 {
        let e_folds = (kappa / self.scale).asinh().clamp(-E_FOLDS, E_FOLDS);
        (E_FOLDS + e_folds) * PER_E_FOLD
    }

    fn at(&mut self, system: &SystemEquations, kappa: f64) -> f64 {
        let place = self.place(kappa);
        let (index, share) = (place.floor(), place.fract());
        let before = self.node(system, index as usize).decay;
        if share == 0.0 {
            return before;
        }
        before + share * (self.node(system, index as usize + 1).decay - before)
    }

    fn node(&mut self, system: &SystemEquations, index: usize) -> Rates {
        let (kappa, slow) = (self.scale * (index as f64 / PER_E_FOLD - E_FOLDS).sinh(), self.slow);
        *self.rates[index].get_or_insert_with(|| rates(system, kappa, slow))
    }
}

/// Decay of the fast modes and magnitude of the slow ones at the contact's damping `kappa` (N m s/rad).
pub fn rates(system: &SystemEquations, kappa: f64, slow: Slow) -> Rates {
    let (slow, fast) = modes(system, kappa, slow);
    let decay = fast
        .into_iter()
        .map(|mode| -mode.re)
        .fold(f64::INFINITY, |least, decay| {
            if decay.is_nan() {
                f64::NEG_INFINITY
            } else {
                least.min(decay)
            }
        });
    Rates {
        decay,
        slow: slow.last().map_or(0.0, |mode| mode.norm()),
    }
}

/// Largest real part of the fast modes in a slip, 1/s.
pub fn fast_growth_rate(system: &SystemEquations, kappa: f64) -> f64 {
    let rates = fast_modes(system, kappa).into_iter().map(|mode| mode.re);
    rates.fold(f64::NEG_INFINITY, f64::max)
}

/// Least angular frequency of the fast modes in a slip under constant friction, 1/s.
pub fn least_fast_frequency(system: &SystemEquations) -> f64 {
    let modes = fast_modes(system, 0.0).into_iter().map(|mode| mode.norm());
    modes.fold(f64::INFINITY, f64::min)
}

/// Eigenvalues of all modes except one slow mode for each free train, 1/s.
pub fn fast_modes(system: &SystemEquations, kappa: f64) -> Vec<Complex<f64>> {
    modes(system, kappa, Slow::OfFreeChains).1
}

fn modes(system: &SystemEquations, kappa: f64, slow: Slow) -> (Vec<Complex<f64>>, Vec<Complex<f64>>) {
    let mut modes = eigenvalues(&system.balanced(system.sliding_matrix(kappa)));
    modes.sort_by(|a, b| a.norm().total_cmp(&b.norm()));
    let slow = match slow {
        Slow::OfFreeChains => {
            let sides = [&system.rotor, &system.stator].into_iter();
            sides.filter(|side| side.speed.is_some()).count()
        }
        Slow::UpTo(rate) => modes.iter().filter(|mode| mode.norm() <= rate).count(),
    };
    let fast = modes.split_off(slow.min(modes.len()));
    (modes, fast)
}

/// The free train that slows down by itself, as one inertia.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Braking {
    radius: f64,
    /// Total inertia of the train, kg m^2.
    pub inertia: f64,
    /// Total damping of its bearings, N m s/rad.
    pub viscous: f64,
}

impl Braking {
    /// Takes the parameters from a system; `None` unless exactly one train is free.
    pub fn new(system: &SystemEquations) -> Option<Self> {
        let side = match (system.rotor.speed, system.stator.speed) {
            (Some(_), None) => &system.rotor,
            (None, Some(_)) => &system.stator,
            _ => return None,
        };
        Some(Braking {
            radius: system.radius,
            inertia: side.rigid_inertia(),
            viscous: side.viscous.iter().sum(),
        })
    }

    /// Deceleration at |omega_r| = `x` (rad/s) with friction coefficient `mu` and normal force `force` (N), rad/s^2.
    pub fn slowing(&self, mu: f64, force: f64, x: f64) -> f64 {
        (mu * self.radius * force + self.viscous * x) / self.inertia
    }
}

/// Relative velocity (rad/s) below which a slip that slows down from `speed` (rad/s), under a normal force up to
/// `force` (N), bends too much for BDF of order 4 with steps of `stride` (s). `None` unless exactly one train is
/// free.
///
/// Friction contributes to the twists a part whose fifth derivative is that of mu times omega_r'^5. This derivative
/// is the error of the method. Below the returned speed the error of a step exceeds `relative` of the twist.
pub fn bent_sliding(system: &SystemEquations, force: f64, speed: f64, stride: f64, relative: f64) -> Option<f64> {
    const ORDER: i32 = 5;
    let largest = system.law.typical_coefficient(speed);
    let slowing = Braking::new(system)?.slowing(largest, force, speed);
    let tolerated = f64::from(ORDER) * 0.5 * largest * relative;
    Some(
        system
            .law
            .speed_of_derivative(ORDER, tolerated / (slowing * stride).powi(ORDER)),
    )
}

/// Normal force in a forecast.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SmoothForce {
    /// Value without harmonics and ringing, N.
    pub value: f64,
    /// Bound of the harmonics, N.
    pub swing: f64,
}

/// Forecast of rigid sliding: a free train moves as one inertia, slowed by quasi-steady friction. The twists are
/// neglected, which for a brake is a relative error of about J/I and omega_r / omega_n. This suffices to decide in
/// advance where an integrator must resolve the fast modes. The forecast never enters a result.
#[derive(Debug, Clone, PartialEq)]
pub struct Forecast {
    /// Time (s), and damping of the least damped fast mode since the start, in e-folds.
    path: Vec<(f64, f64)>,
    /// (t (s), |omega_r| (rad/s)).
    speeds: Vec<(f64, f64)>,
    /// Time (s) at which sliding becomes unstable or the relative velocity reaches zero, whichever is first.
    pub instability: Option<f64>,
}

impl Forecast {
    /// Forecast of the slip at `t` (s) with this relative velocity (rad/s), up to `until` (s). `force` returns the
    /// normal force at a time, and `next_corner` its first corner after a time (s). `None` unless exactly one train
    /// is free. The caller ensures that nothing drives the system.
    pub fn of_slip(
        system: &SystemEquations,
        modes: &mut FastModes,
        force: impl Fn(f64) -> SmoothForce,
        next_corner: impl Fn(f64) -> Option<f64>,
        (t, relative_velocity): (f64, f64),
        until: f64,
    ) -> Option<Self> {
        let braking = Braking::new(system)?;
        let law = system.law_of(relative_velocity);
        let slowing = |t: f64, x: f64| braking.slowing(law.coefficient(x), force(t).value.max(0.0), x);
        let mut decay = |t: f64, x: f64| {
            let SmoothForce { value, swing } = force(t);
            let slope = law.coefficient_and_slope(x).1;
            let force = if slope < 0.0 { value + swing } else { value - swing };
            let contact_damping = system.radius * force.max(0.0) * slope;
            if modes.margin(contact_damping) < 0.0 {
                return None;
            }
            Some(modes.decay(system, contact_damping)).filter(|decay| *decay >= 0.0)
        };
        let (mut t, mut x) = (t, relative_velocity.abs());
        let mut damping = 0.0;
        let mut path = vec![(t, damping)];
        let mut speeds = vec![(t, x)];
        let mut instability = None;
        let coarsest = ((until - t) / 200.0).max(f64::MIN_POSITIVE);
        let finest = x / FINEST;
        while t < until {
            // If the force is too steep for progress, the path ends as if unstable, so that the steps are resolved.
            let Some(here) = decay(t, x).filter(|_| x > 0.0 && path.len() <= MOST_STEPS) else {
                instability = Some(t);
                break;
            };
            let rate = slowing(t, x);
            let corner = next_corner(t).unwrap_or(f64::INFINITY);
            let mut step = coarsest.min(until - t);
            if t + step > corner {
                step = corner - t;
            }
            // Resolves the fall of the speed and, where it matters, the change of friction.
            let followed = law.followed_fall(x, SHARE_OF_SCALE);
            let fall = (0.02 * x + 1e-6).min(followed).max(finest);
            let ahead = slowing(t + step, (x - fall).max(0.0)).max(rate);
            if ahead * step > fall {
                step = fall / ahead;
            }
            if t + step <= t {
                instability = Some(t);
                break;
            }
            let middle = slowing(t + step / 2.0, x - rate * step / 2.0);
            x -= middle * step;
            t += step;
            damping += here * step;
            path.push((t, damping));
            speeds.push((t, x));
        }
        Some(Forecast {
            path,
            speeds,
            instability,
        })
    }

    /// The latest time (s) with `e_folds` of damping still ahead before the instability, if there is one.
    pub fn last_quiet_time(&self, e_folds: f64) -> Option<f64> {
        self.instability?;
        last_quiet_time(&self.path, e_folds)
    }

    /// The first time (s) with a relative velocity up to `speed` (rad/s), if there is one.
    pub fn time_of_speed(&self, speed: f64) -> Option<f64> {
        self.speeds.iter().find(|(_, x)| *x <= speed).map(|(t, _)| *t)
    }

    /// The time (s) at which `e_folds` of damping have passed since the start; `None` if an instability comes first.
    pub fn time_of_damping(&self, e_folds: f64) -> Option<f64> {
        let passed = self.path.windows(2).find(|pair| pair[1].1 >= e_folds);
        passed.map(|pair| between(pair, e_folds))
    }
}

/// The latest time (s) with `e_folds` of damping still ahead before the end of a path of (time (s), damping in
/// e-folds).
pub fn last_quiet_time(path: &[(f64, f64)], e_folds: f64) -> Option<f64> {
    let last = path.last()?.1 - e_folds;
    let quiet = path.windows(2).rev().find(|pair| pair[0].1 <= last);
    Some(quiet.map_or(path[0].0, |pair| between(pair, last)))
}

fn between(pair: &[(f64, f64)], damping: f64) -> f64 {
    let ((t, before), (end, after)) = (pair[0], pair[1]);
    if after > before {
        t + (end - t) * ((damping - before) / (after - before)).clamp(0.0, 1.0)
    } else {
        t
    }
}

/// Bounds that follow from the start of a slip alone: how long it is far from unstable, and how unstable it becomes.
///
/// Like [`Forecast`] they assume rigid sliding, with the friction torque between its bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuietStretch {
    /// Time (s) until which the margin of stability is at least R, half of its value without friction.
    pub until: f64,
    /// Least decay of the fast modes until that time, 1/s.
    pub damping: f64,
    /// Bound of the growth of a perturbation between the loss of stability and the stop, in e-folds.
    pub growth: f64,
    /// Bound of the rate of steady sliding relative to the twists that follow it: rate of change of the friction
    /// law's slope, times kappa and the compliance of all shafts. If small, the slow manifold exists to all digits.
    pub time_scale_ratio: f64,
}

impl QuietStretch {
    /// Bounds for the slip at `t` (s) with this relative velocity (rad/s), under a normal force (N) that stays within
    /// `force` from `t` on. `None` unless exactly one train is free. The caller must ensure that nothing drives the
    /// system.
    pub fn of_slip(
        system: &SystemEquations,
        modes: &mut FastModes,
        force: Bounds,
        t: f64,
        relative_velocity: f64,
    ) -> Option<Self> {
        let (braking, law) = (Braking::new(system)?, &system.law);
        let (least, most) = (force.least.max(0.0), force.most.max(0.0));
        let speed = relative_velocity.abs();
        let coefficient = law.bounds_below(speed);
        let slopes = law.slope_bounds(0.0, f64::INFINITY);
        let pressed = system.radius * most;
        // -kappa, the largest reduction of R by falling friction.
        let negative_damping = -pressed * slopes.least;
        let resistance = modes.twice_resistance / 2.0;
        // Below this speed the margin may be less than a share 1 - part of its value without friction.
        let critical = |part: f64| match resistance.is_finite() {
            true => law.damped_from(part * resistance, pressed),
            false => 0.0,
        };
        let fastest = braking.slowing(coefficient.most, most, speed);
        let (half, unstable) = (critical(0.5), critical(1.0));
        // Bound of -kappa in steady sliding that is still stable.
        let largest = if resistance.is_finite() {
            resistance
        } else {
            2.0 * negative_damping.max(0.0)
        };
        let quiet = Bounds {
            least: -(0.5 * largest),
            most: (pressed * slopes.most).max(0.0),
        };
        let damping = modes.least_decay(system, quiet).max(0.0);
        let until = if damping <= 0.0 {
            t
        } else if half > 0.0 {
            t + 0.9 * (speed - half) / fastest
        } else {
            f64::INFINITY
        };
        // Another mode than that of the surfaces may become unstable first.
        let to_instability = Bounds {
            least: -largest,
            most: quiet.least,
        };
        let unstable = if modes.least_decay(system, to_instability) < -ROUNDING * damping {
            if half > 0.0 { half } else { speed }
        } else {
            unstable
        };
        let growth = if unstable > 0.0 {
            let slowest = braking.slowing(coefficient.least, least, 0.0);
            1.2 * fastest_growth(system, -negative_damping) * unstable / slowest
        } else {
            0.0
        };
        Some(QuietStretch {
            until,
            damping,
            growth,
            time_scale_ratio: negative_damping * system.compliance() * law.steepness_rate(0.0) * fastest,
        })
    }
}

/// Negative decay that is rounding and interpolation at the loss of stability, relative to the decay of quiet
/// sliding.
const ROUNDING: f64 = 0.05;

/// Bound of the growth of any motion at this kappa or a larger one, 1/s. The energy grows at most with twice the
/// largest negative damping over its inertia, and half of the energy may be elastic.
pub fn fastest_growth(system: &SystemEquations, kappa: f64) -> f64 {
    let sides = [&system.rotor, &system.stator];
    let first = [0, system.rotor.inertia.len()];
    let count = first[1] + system.stator.inertia.len();
    let mut damping = DMatrix::<f64>::zeros(count, count);
    let mut between = |c: f64, a: Option<usize>, b: Option<usize>| {
        for place in [a, b].into_iter().flatten() {
            damping[(place, place)] += c;
        }
        if let (Some(a), Some(b)) = (a, b) {
            damping[(a, b)] -= c;
            damping[(b, a)] -= c;
        }
    };
    let place = |side: usize, j: usize| (j < sides[side].inertia.len()).then_some(first[side] + j);
    between(kappa, place(0, 0), place(1, 0));
    for (number, side) in sides.iter().enumerate() {
        for (i, c) in side.damping.iter().enumerate() {
            between(*c, place(number, i), place(number, i + 1));
        }
        for (j, d) in side.viscous.iter().enumerate() {
            between(*d, place(number, j), None);
        }
    }
    let inertia: Vec<f64> = sides.iter().flat_map(|side| side.inertia.iter().copied()).collect();
    let weighted = DMatrix::from_fn(count, count, |i, j| damping[(i, j)] / (inertia[i] * inertia[j]).sqrt());
    -weighted
        .symmetric_eigenvalues()
        .iter()
        .fold(0.0, |least: f64, value| least.min(*value))
}
