//! Forecast of the loss of stability of steady sliding.
//!
//! One free train slows down by friction, against a train that rests. In slip the linearised equations depend on the state
//! through one number only, the contact's damping kappa = r F_n mu' (negative where friction falls with speed).

use super::equations::{Side, SystemEquations};
use crate::friction::{Bounds, Law};
use crate::numerics::eigenvalues::eigenvalues;
use nalgebra::{Complex, DMatrix};

/// No step is shorter than this part of the speed at the start, however steep the friction law.
const FINEST: f64 = 20_000.0;

/// Share of the friction law's speed scale that one step may take.
const SHARE_OF_SCALE: f64 = 0.05;

/// More steps are not taken: 1000 are usual.
const MOST_STEPS: usize = 100_000;

/// An inertia of so many times the surface's counts as holding the far end of the surface's shaft. That it gives way mistunes
/// two alike disks, and their fast modes decay faster than is said.
const HEAVY: f64 = 20.0;

/// Values of the fast modes' decay per e-fold of kappa; between them it is taken as linear.
const PER_E_FOLD: f64 = 16.0;

/// E-folds of kappa on either side of the resistance's scale that values are kept for; beyond them the last one holds.
const E_FOLDS: f64 = 20.0;

/// How the fast modes of a slip decay, by the contact's damping kappa.
#[derive(Debug, Clone)]
pub(crate) struct FastModes {
    /// 2 R: the margin of stability is 2 (R + kappa), N m s/rad.
    twice_resistance: f64,
    spectrum: Option<Spectrum>,
}

/// Which modes of a slip are the slow ones.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Slow {
    /// One for each free train.
    OfFreeChains,
    /// Those whose eigenvalue has no more than this magnitude, 1/s.
    UpTo(f64),
}

/// What the modes of a slip come to, 1/s.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rates {
    /// The least decay of a fast mode; minus infinity where the eigenvalues are not found.
    pub decay: f64,
    /// The largest magnitude of a slow one.
    pub slow: f64,
}

/// The modes by kappa, from eigenvalues found when they are first asked for.
#[derive(Debug, Clone)]
pub(crate) struct Spectrum {
    slow: Slow,
    /// kappa is this times sinh(i / [`PER_E_FOLD`]).
    scale: f64,
    rates: Vec<Option<Rates>>,
}

impl FastModes {
    /// Of a system whose margin of stability is `twice_resistance` + 2 kappa (N m s/rad; infinite where no swing of the surfaces
    /// can become unstable).
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

    /// The decay of the least damped fast mode at this kappa, 1/s; negative where it grows.
    ///
    /// Two alike disks have it in closed form, with the far ends of their shafts at rest.
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

    /// The least decay for all kappa between two values, 1/s.
    fn least_decay(&mut self, system: &SystemEquations, between: Bounds) -> f64 {
        let ends = [between.least, between.most].map(|kappa| self.decay(system, kappa));
        let least = ends[0].min(ends[1]);
        match &mut self.spectrum {
            // The closed form rises with the damping of a pair until that is real, and falls from there: no minimum between.
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

/// Whether both surfaces are alike and swing on one shaft each, whose far end is the ground or a heavy inertia.
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

/// The slower decay of the two roots of inertia s^2 + damping s + stiffness, 1/s.
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
    /// With values that are close together up to `resistance` (N m s/rad), or else up to 0.01 sqrt(k J) of a shaft.
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

    /// The least decay of the fast modes and the largest magnitude of the slow ones for all kappa between two values: those of
    /// the values that are kept from the one below to the one above.
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

    /// Where a kappa is among the values, in units of their distance.
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

fn rates(system: &SystemEquations, kappa: f64, slow: Slow) -> Rates {
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

/// The least angular frequency of the fast modes of a slip under constant friction, 1/s.
pub(crate) fn least_fast_frequency(system: &SystemEquations) -> f64 {
    let modes = fast_modes(system, 0.0).into_iter().map(|mode| mode.norm());
    modes.fold(f64::INFINITY, f64::min)
}

/// The eigenvalues of all modes but one slow one for each free train, 1/s.
pub(crate) fn fast_modes(system: &SystemEquations, kappa: f64) -> Vec<Complex<f64>> {
    modes(system, kappa, Slow::OfFreeChains).1
}

/// The eigenvalues of the slow modes and of the fast ones, each by magnitude, 1/s.
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
pub(crate) struct Braking {
    radius: f64,
    /// kg m^2.
    pub inertia: f64,
    /// Of all its bearings, N m s/rad.
    pub viscous: f64,
}

impl Braking {
    /// `None` unless exactly one train is free.
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

    /// How fast |omega_r| = `x` (rad/s) falls, rad/s^2.
    pub fn slowing(&self, mu: f64, force: f64, x: f64) -> f64 {
        (mu * self.radius * force + self.viscous * x) / self.inertia
    }
}

/// The relative velocity (rad/s) below which a slip under a normal force up to `force` (N) bends too much for BDF of order 4 with
/// steps of `stride` (s), from `speed` (rad/s) down. `None` unless exactly one train is free.
///
/// The friction law puts a part into the twists by whose fifth derivative that method errs: that of mu times the fifth power of
/// omega_r'. There a step errs by more than `relative` of the twist.
pub(crate) fn bent_sliding(
    system: &SystemEquations,
    force: f64,
    speed: f64,
    stride: f64,
    relative: f64,
) -> Option<f64> {
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

/// The normal force as a forecast needs it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SmoothForce {
    /// Without harmonics and without ringing, N.
    pub value: f64,
    /// By how much harmonics may raise or lower it, N.
    pub swing: f64,
}

/// Rigid sliding ahead of a given instant: a free train as one inertia, slowed by quasi-steady friction.
/// It leaves out the twists (for a brake a relative error of about J/I and omega_r / omega_n), which is enough to decide ahead
/// of time where an integrator has to resolve the fast modes; it never enters a result.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Forecast {
    /// (t (s), damping in e-folds of the least damped fast mode since the start).
    path: Vec<(f64, f64)>,
    /// (t (s), |omega_r| (rad/s)) at the same times.
    speeds: Vec<(f64, f64)>,
    /// When sliding turns unstable, or the relative velocity reaches zero, whichever comes first, s.
    pub instability: Option<f64>,
}

impl Forecast {
    /// Of the slip at `t` (s) with this relative velocity (rad/s), as far as `until` (s). `force` gives the force that presses at
    /// a time, `next_corner` its first corner after a time (s). `None` unless exactly one train is free; that nothing drives
    /// the system is for the caller to know.
    pub fn of_slip(
        system: &SystemEquations,
        modes: &mut FastModes,
        force: impl Fn(f64) -> SmoothForce,
        next_corner: impl Fn(f64) -> Option<f64>,
        (t, relative_velocity): (f64, f64),
        until: f64,
    ) -> Option<Self> {
        let braking = Braking::new(system)?;
        let law = &system.law;
        let slowing = |t: f64, x: f64| braking.slowing(law.coefficient(x), force(t).value.max(0.0), x);
        let mut decay = |t: f64, x: f64| {
            let SmoothForce { value, swing } = force(t);
            let slope = law.coefficient_and_slope(x).1;
            // What is worse for stability.
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
            // A force so steep that the path does not get on counts as instability, too: steps are then resolved.
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
            // Resolve the fall of the speed and, where it matters, the change of friction.
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

    /// The latest time before which `e_folds` of damping still lie ahead of the instability; `None` without one.
    pub(crate) fn last_quiet_time(&self, e_folds: f64) -> Option<f64> {
        self.instability?;
        last_quiet_time(&self.path, e_folds)
    }

    /// The first time at which the relative velocity is no more than `speed` (rad/s), if it comes to that.
    pub(crate) fn time_of_speed(&self, speed: f64) -> Option<f64> {
        self.speeds.iter().find(|(_, x)| *x <= speed).map(|(t, _)| *t)
    }

    /// The time by which `e_folds` of damping have passed since the start, if that comes before any instability.
    pub(crate) fn time_of_damping(&self, e_folds: f64) -> Option<f64> {
        let passed = self.path.windows(2).find(|pair| pair[1].1 >= e_folds);
        passed.map(|pair| between(pair, e_folds))
    }
}

/// The latest time before which `e_folds` of damping still lie ahead of the end of a path of (t (s), damping in e-folds).
pub(crate) fn last_quiet_time(path: &[(f64, f64)], e_folds: f64) -> Option<f64> {
    let last = path.last()?.1 - e_folds;
    let quiet = path.windows(2).rev().find(|pair| pair[0].1 <= last);
    Some(quiet.map_or(path[0].0, |pair| between(pair, last)))
}

/// When the damping takes a value between those of two points.
fn between(pair: &[(f64, f64)], damping: f64) -> f64 {
    let ((t, before), (end, after)) = (pair[0], pair[1]);
    if after > before {
        t + (end - t) * ((damping - before) / (after - before)).clamp(0.0, 1.0)
    } else {
        t
    }
}

/// How long a slip is far from unstable, and what instability can come to after that: bounds, from the start alone.
///
/// They rest on rigid sliding like [`Forecast`], with the friction torque between its bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct QuietStretch {
    /// Until then the margin of stability is at least R, half of what it is without friction, s.
    pub until: f64,
    /// The fast modes' decay until then, 1/s, at least.
    pub damping: f64,
    /// E-folds that a perturbation can gain between the loss of stability and the stop, at most.
    pub growth: f64,
    /// How fast steady sliding changes against how fast the twists follow it, at most: the rate at which the slope of the
    /// friction changes times kappa and the compliance of all shafts. The slow manifold is there to all digits while this is
    /// small.
    pub time_scale_ratio: f64,
}

impl QuietStretch {
    /// Of the slip at `t` (s) with this relative velocity (rad/s), under a normal force (N) between these bounds from `t` on.
    /// `None` unless exactly one train is free; that nothing drives the system is for the caller to know.
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
        // -kappa, the most that falling friction takes from R
        let negative_damping = -pressed * slopes.least;
        let resistance = modes.twice_resistance / 2.0;
        // Below this speed the margin may be less than its part (1 - part).
        let critical = |part: f64| match resistance.is_finite() {
            true => law.damped_from(part * resistance, pressed),
            false => 0.0,
        };
        let fastest = braking.slowing(coefficient.most, most, speed);
        let (half, unstable) = (critical(0.5), critical(1.0));
        // What a kappa of steady sliding that is still stable can be at least.
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
        // Another mode than the surfaces' own may turn unstable before these do.
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

/// A decay may be negative by rounding and by interpolation, as a share of that of quiet sliding: where sliding just loses its
/// stability.
const ROUNDING: f64 = 0.05;

/// A bound of the growth of any motion at this kappa, 1/s, and of those at larger ones: no energy grows faster than twice the
/// largest negative damping over its inertia, and of it half may be elastic.
fn fastest_growth(system: &SystemEquations, kappa: f64) -> f64 {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Parameters;
    use crate::model::samples;
    use crate::model::system::{End, System};

    fn general(parameters: &Parameters) -> (SystemEquations, FastModes) {
        let system = SystemEquations::new(&System::from(parameters));
        let modes = FastModes::new(&system, parameters.torsion.damping);
        (system, modes)
    }

    fn fast_decay(system: &SystemEquations, kappa: f64) -> f64 {
        rates(system, kappa, Slow::OfFreeChains).decay
    }

    /// The closed form of alike disks holds the far end of the rotor's shaft. A rotor that gives way mistunes the disks, and the
    /// least damped mode then decays faster.
    #[test]
    fn analytic_alike_disks_decay_as_their_spectrum_says() {
        for number in 0..40 {
            let mut parameters = samples::brake(number);
            for heavier in [1.0, 1e7] {
                parameters.torsion.rotor_inertia *= heavier;
                let (system, mut modes) = general(&parameters);
                let torsion = parameters.torsion;
                let own = torsion.damping / (2.0 * torsion.surface_inertia);
                for part in [0.0, -0.1, -0.3, -0.45] {
                    let kappa = part * torsion.damping;
                    let (closed, exact) = (modes.decay(&system, kappa), fast_decay(&system, kappa));
                    assert!(closed <= exact + 1e-6 * own, "{number}: {closed} and {exact}");
                    assert!(
                        heavier == 1.0 || exact <= closed + 1e-4 * own,
                        "{number}: {closed} and {exact}"
                    );
                }
            }
        }
    }

    /// Unlike disks of the same frequency whose shafts end in a heavy rotor and in the ground: R = a_1 a_2/(a_1 + a_2) in closed
    /// form, and there the fast modes turn unstable.
    #[test]
    fn analytic_the_decay_is_zero_where_the_margin_is() {
        let mut case = samples::chains();
        case.rotor.inertia = vec![0.01, 1e4];
        case.rotor.stiffness = vec![5e6];
        case.rotor.damping = vec![30.0];
        case.rotor.viscous = vec![0.0; 2];
        case.stator.inertia = vec![0.02];
        case.stator.stiffness = vec![1e7];
        case.stator.damping = vec![10.0];
        case.stator.viscous = vec![2.0];
        let system = SystemEquations::new(&case);
        let twice_resistance = 2.0 * 30.0 * 12.0 / 42.0;
        let mut modes = FastModes::new(&system, twice_resistance);
        let resistance = twice_resistance / 2.0;
        let own = modes.decay(&system, 0.0);
        assert!(own > 100.0);
        // A swing at the margin's zero decays by half of its small damping over the mean inertia; both disks differ by 2.
        assert!(modes.decay(&system, -resistance).abs() < 2e-3 * own);
        assert!(modes.decay(&system, -0.99 * resistance) > 0.0);
        assert!(modes.decay(&system, -1.01 * resistance) < 0.0);
        // Between its values the decay is a line; against the spectrum itself.
        for part in [-0.97, -0.5, -0.3, 0.2, 3.0] {
            let kappa = part * resistance;
            let (line, exact) = (modes.decay(&system, kappa), fast_decay(&system, kappa));
            assert!((line - exact).abs() < 0.01 * own, "{part}: {line} and {exact}");
        }
    }

    /// The bounds hold against the spectrum of longer chains, and the forecast loses stability where the bounds allow it.
    #[test]
    fn property_a_quiet_stretch_of_chains_bounds_its_spectrum() {
        for stiffer in [1.0, 3.0, 0.3] {
            let mut case = samples::chains();
            case.stator.stiffness[0] *= stiffer;
            case.rotor.damping[0] *= stiffer;
            let system = SystemEquations::new(&case);
            let twice_resistance = 8.0;
            let mut modes = FastModes::new(&system, twice_resistance);
            let force = Bounds {
                least: 1900.0,
                most: 2100.0,
            };
            let quiet = QuietStretch::of_slip(&system, &mut modes, force, 1.0, 80.0).unwrap();
            let smooth = |_: f64| SmoothForce {
                value: 2000.0,
                swing: 100.0,
            };
            let forecast = Forecast::of_slip(&system, &mut modes, smooth, |_| None, (1.0, 80.0), 200.0).unwrap();
            let lost = forecast.instability.expect("it stops");
            assert!(quiet.until < lost && quiet.damping > 0.0, "{quiet:?}, lost at {lost}");
            // The quiet stretch decays no faster than the forecast says.
            let calm = forecast.time_of_damping(40.0).unwrap();
            assert!(calm <= 1.0 + 40.0 / quiet.damping, "{quiet:?}, calm at {calm}");
            let resistance = twice_resistance / 2.0;
            for part in [0.0, -0.25, -0.5] {
                assert!(fast_decay(&system, part * resistance) >= quiet.damping * (1.0 - 1e-9));
            }
            let mut grown = 0.0;
            for part in [-1.5, -3.0, -10.0] {
                let kappa = part * resistance;
                let (bound, growth) = (fastest_growth(&system, kappa), -fast_decay(&system, kappa));
                assert!(bound >= growth, "{part}: {bound} and {growth}");
                grown = growth;
            }
            assert!(grown > 0.0);
        }
    }

    #[test]
    fn property_only_one_free_train_slows_down_by_itself() {
        let mut case = samples::chains();
        case.stator.end = End::Free;
        case.stator.stiffness.pop();
        case.stator.damping.pop();
        let system = SystemEquations::new(&case);
        let mut modes = FastModes::new(&system, 8.0);
        let force = Bounds { least: 1.0, most: 2.0 };
        assert!(QuietStretch::of_slip(&system, &mut modes, force, 0.0, 10.0).is_none());
    }
}
