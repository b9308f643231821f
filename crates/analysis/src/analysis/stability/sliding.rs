//! Steady sliding of two trains, and changes of its stability.

use super::linear::{ImpedanceCrossings, ROUNDING, SlidingVerdict, columns, crossings, jacobian, state};
use super::modes::{ChangeSearch, OperatingPoint, StabilityChange};
use nalgebra::Complex;
use std::f64::consts::TAU;
use stickslip_system::friction::Law;
use stickslip_system::model::Mode;
use stickslip_system::model::equations::{Engagement, Side, SystemEquations};
use stickslip_system::model::margin::slowing;
use stickslip_system::model::system::{End, System, Train};
use stickslip_system::numerics::bisection::bisect;
use stickslip_system::numerics::eigenvalues::eigenvalues;

const DECADES: i32 = 9;
const POINTS: i32 = 80;
/// Range of the search in normal force and damping: the case's own value divided and multiplied by this factor.
const MULTIPLES: f64 = 1e3;

pub(super) struct Base {
    /// Speed V of a prescribed train, or M/D under torque M with bearings D; `None` for a free train.
    pub(super) speed: Option<f64>,
    /// 1/D for a train on bearings, otherwise 0, rad/(N m s).
    yielding: f64,
    torque: f64,
}

impl Base {
    pub(super) fn new(train: &Train, speed: f64, torque: f64) -> Base {
        let ground: f64 = train.viscous.iter().sum();
        let (speed, yielding) = match train.end {
            End::Free if ground > 0.0 => (Some(torque / ground), 1.0 / ground),
            End::Free => (None, 0.0),
            End::Driven(_) | End::Fixed => (Some(speed), 0.0),
        };
        Base {
            speed,
            yielding,
            torque,
        }
    }
}

/// Condition for steady sliding of sense s at x = |omega_r|, with friction torque T at x.
#[derive(Clone, Copy)]
pub(super) enum Balance {
    /// x + yielding T = speed.
    Speed { speed: f64, yielding: f64 },
    /// T = torque.
    Torque(f64),
    /// No point of steady sliding.
    Never,
}

/// Trains that slide at a given speed.
pub(super) struct Sliding {
    trains: System,
    pub(super) system: SystemEquations,
    crossings: ImpedanceCrossings,
    /// Whether sliding slows down by itself.
    slows: bool,
}

impl Sliding {
    pub(super) fn new(trains: System) -> Sliding {
        let system = SystemEquations::new(&trains);
        let slows = slowing(&trains).is_ok();
        Sliding {
            crossings: crossings(&system, !slows),
            trains,
            system,
            slows,
        }
    }

    fn damped(&self, (rotor, stator): (f64, f64)) -> Sliding {
        let mut trains = self.trains.clone();
        trains.rotor.damping.iter_mut().for_each(|c| *c *= rotor);
        trains.stator.damping.iter_mut().for_each(|c| *c *= stator);
        Sliding::new(trains)
    }

    pub(super) fn is_engaged(&self) -> bool {
        self.system.engagement != Engagement::StickSlip
    }

    pub(super) fn mode(&self, sense: f64) -> Mode {
        match (self.is_engaged(), sense < 0.0) {
            (true, _) => Mode::Engaged,
            (false, false) => Mode::SlipForward,
            (false, true) => Mode::SlipBackward,
        }
    }

    /// Interface torque of steady sliding at omega_r = `w`, over r F_n: positive, of either sense.
    fn coefficient(&self, w: f64) -> f64 {
        let (outside, y) = state(&self.system, w, 1.0 / self.system.radius);
        let (sense, piece) = (1f64.copysign(w), self.system.piece_of(w));
        sense
            * self
                .system
                .interface_torque(self.mode(sense), sense, piece, &outside, &y)
    }

    /// Contact damping at `x` divided by r F_n, s/rad. Not for bristles: their damping depends on the frequency.
    fn slope(&self, x: f64) -> f64 {
        let (system, law) = (&self.system, self.system.law_in(x, self.system.piece_of(x)));
        let (outside, y) = state(system, x, 1.0 / system.radius);
        match system.engagement {
            Engagement::StickSlip => law.coefficient_and_slope(x).1,
            _ => {
                // Contact adds b kappa g^T to the Jacobian.
                let with = jacobian(system, Mode::Engaged, 1.0, &outside, &y);
                let without = jacobian(system, Mode::Separated, 1.0, &outside, &y);
                let (b, g) = columns(system);
                let row = b.icamax();
                let column = g.icamax();
                (with[(row, column)] - without[(row, column)]) / (b[row] * g[column])
            }
        }
    }

    /// Eigenvalues of sliding on bristles, the fastest first, and the size of their rounding; `None` without bristles.
    fn of_bristles(&self, x: f64, force: f64) -> Option<(Vec<Complex<f64>>, f64)> {
        let system = &self.system;
        if !matches!(system.engagement, Engagement::Bristles(..)) {
            return None;
        }
        let (outside, y) = state(system, x, force);
        let mut found = eigenvalues(&system.balanced(jacobian(system, Mode::Engaged, 1.0, &outside, &y)));
        found.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
        let rounding = ROUNDING * found.first().map_or(0.0, |l| l.norm());
        Some((found, rounding))
    }

    fn verdict(&self, x: f64, force: f64) -> SlidingVerdict {
        let Some((found, rounding)) = self.of_bristles(x, force) else {
            return self.crossings.verdict(self.slope(x) * self.system.radius * force);
        };
        // Sliding that slows down by itself is not a disturbance.
        let disturbances = found.len() - usize::from(self.slows);
        let moving = found[..disturbances].iter().filter(|l| l.norm() > rounding);
        let most = moving.map(|l| l.re).fold(f64::NEG_INFINITY, f64::max);
        match most {
            most if most > rounding => SlidingVerdict::Unstable,
            most if most >= -rounding => SlidingVerdict::Neutral,
            _ => SlidingVerdict::Stable,
        }
    }

    fn frequency(&self, x: f64, force: f64) -> Option<f64> {
        let omega = match self.of_bristles(x, force) {
            Some((found, rounding)) => {
                let moving = found.iter().filter(|l| l.norm() > rounding);
                let slowest = moving.min_by(|a, b| a.re.abs().total_cmp(&b.re.abs()));
                slowest.map(|l| l.im.abs())
            }
            None => self.crossings.frequency(self.slope(x) * self.system.radius * force),
        };
        omega.filter(|&omega| omega > 0.0).map(|omega| omega / TAU)
    }

    /// Rising relative velocities: equal ratios, equal steps, knots, and speeds that match a resistance.
    fn grid(&self, to: f64, force: f64) -> Vec<f64> {
        let count = DECADES * POINTS;
        let mut grid: Vec<f64> = (0..=count)
            .flat_map(|k| {
                let share = f64::from(k) / f64::from(count);
                [to * 10f64.powf(f64::from(DECADES) * (share - 1.0)), to * share]
            })
            .collect();
        let mut marks: Vec<f64> = self.system.law.knots().to_vec();
        grid.extend(marks.iter().flat_map(|knot| [knot * (1.0 - 1e-9), knot * (1.0 + 1e-9)]));
        if !self.is_engaged() {
            marks.extend(self.zeros(force));
        }
        marks.sort_by(f64::total_cmp);
        grid.extend(marks.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])));
        grid.retain(|&x| x > 0.0 && x <= to);
        grid.sort_by(f64::total_cmp);
        grid.dedup();
        grid
    }

    fn zeros(&self, force: f64) -> Vec<f64> {
        let weight = self.system.radius * force;
        let of = |resistance: f64| self.system.law.damping_zeros(resistance, weight);
        let all = self.crossings.0.iter().flat_map(|crossing| of(crossing.resistance));
        all.filter(|x| x.is_finite() && *x > 0.0).collect()
    }

    /// Upper limit of the relative velocities: beyond the scales of the law, of its smoothing, and of the case.
    fn reach(&self, force: f64, sliding: f64) -> f64 {
        let law = &self.system.law;
        let smoothing = match self.system.engagement {
            Engagement::Regularised(_, speed) => 1e3 * speed,
            _ => 0.0,
        };
        let known = [
            law.extent(),
            law.knots().last().copied().unwrap_or(0.0),
            smoothing,
            2.0 * sliding,
        ];
        let zeros = self.zeros(force).into_iter().map(|x| 2.0 * x);
        let known = known.into_iter().chain(zeros).filter(|x| x.is_finite());
        let most = known.fold(0.0, f64::max);
        let most = if most > 0.0 { most } else { 1.0 };
        // A law of finite range does not include its last speed.
        most.min(law.ends_at() * (1.0 - f64::EPSILON))
    }
}

pub(super) fn balance(rotor: &Base, stator: &Base, sense: f64) -> Balance {
    match (rotor.speed, stator.speed) {
        (Some(a), Some(b)) => Balance::Speed {
            speed: sense * (a - b),
            yielding: rotor.yielding + stator.yielding,
        },
        (None, Some(_)) => Balance::Torque(sense * rotor.torque),
        (Some(_), None) => Balance::Torque(-sense * stator.torque),
        (None, None) => Balance::Never,
    }
}

impl Sliding {
    pub(super) fn steady(&self, sense: f64, balance: Balance, force: f64, start: f64) -> Vec<f64> {
        let pressed = self.system.radius * force;
        let torque = |x: f64| pressed * self.coefficient(sense * x);
        let ends = self.system.law.ends_at();
        let (to, missing): (f64, Box<dyn Fn(f64) -> f64 + '_>) = match balance {
            _ if force <= 0.0 => return Vec::new(),
            Balance::Speed { speed, yielding: 0.0 } => {
                return Some(speed).filter(|&x| x > 0.0 && x < ends).into_iter().collect();
            }
            Balance::Speed { speed, yielding } => {
                // Friction can only reduce the speed.
                (speed, Box::new(move |x| x + yielding * torque(x) - speed))
            }
            Balance::Torque(held) => (self.reach(force, start), Box::new(move |x| torque(x) - held)),
            Balance::Never => return Vec::new(),
        };
        if to.is_nan() || to <= 0.0 {
            return Vec::new();
        }
        let to = to.min(ends * (1.0 - f64::EPSILON));
        let grid = self.grid(to, force);
        let is_short = |x: f64| missing(x) < 0.0;
        let pairs = grid.windows(2).filter(|pair| is_short(pair[0]) != is_short(pair[1]));
        pairs.map(|pair| turn(pair[0], pair[1], is_short)).collect()
    }

    pub(super) fn operating(&self, sense: f64, x: f64, force: f64, bases: Option<(&Base, &Base)>) -> OperatingPoint {
        let interface = sense * self.system.radius * force * self.coefficient(sense * x);
        let stability = self.verdict(x, force);
        let mut point = OperatingPoint {
            steady: bases.is_some(),
            relative_velocity: sense * x,
            rotor_speed: None,
            stator_speed: None,
            interface_torque: interface,
            rotor_twist: Vec::new(),
            stator_twist: Vec::new(),
            stability,
        };
        let Some((rotor, stator)) = bases else {
            return point;
        };
        let of_rotor = rotor.speed.map(|speed| speed - rotor.yielding * interface);
        let of_stator = stator.speed.map(|speed| speed + stator.yielding * interface);
        let (of_rotor, of_stator) = match (of_rotor, of_stator) {
            (None, Some(other)) => (other + sense * x, other),
            (Some(other), None) => (other, other - sense * x),
            (Some(rotor), Some(stator)) => (rotor, stator),
            (None, None) => return point,
        };
        point.rotor_speed = Some(of_rotor);
        point.stator_speed = Some(of_stator);
        point.rotor_twist = twists(&self.system.rotor, rotor.torque, interface, of_rotor);
        point.stator_twist = twists(&self.system.stator, stator.torque, interface, of_stator);
        point
    }

    pub(super) fn critical_velocities(&self, force: f64, sliding: f64) -> ChangeSearch {
        let to = self.reach(force, sliding);
        let found = changes(&self.grid(to, force), |x| self.verdict(x, force));
        search((0.0, to), found, |x| (x, self.frequency(x, force)))
    }

    /// Search along the branches of steady sliding, whose speed depends on the force; else at omega_r = `w`.
    pub(super) fn critical_forces(&self, force: f64, w: f64, balance: Balance) -> ChangeSearch {
        let x = w.abs();
        let range = (force / MULTIPLES, force * MULTIPLES);
        let of_speed = |x: f64| {
            let unit = self.system.radius * self.coefficient(x.copysign(w));
            match balance {
                Balance::Speed { speed, yielding } => (speed - x) / (yielding * unit),
                Balance::Torque(held) => held / unit,
                Balance::Never => f64::NAN,
            }
        };
        let end = match balance {
            Balance::Speed { speed, yielding } if yielding > 0.0 => speed,
            Balance::Torque(_) => self.reach(force, x),
            _ => {
                let grid: Vec<f64> = multiples().map(|k| k * force).collect();
                let found = changes(&grid, |force| self.verdict(x, force));
                return search(range, found, |value| (x, self.frequency(x, value)));
            }
        };
        let within = |x: &f64| (range.0..=range.1).contains(&of_speed(*x));
        let grid: Vec<f64> = self.grid(end, force).into_iter().filter(within).collect();
        let found = changes(&grid, |x| self.verdict(x, of_speed(x)));
        let mut search = search(range, found, |x| (x, self.frequency(x, of_speed(x))));
        for change in &mut search.changes {
            let x = change.value;
            change.value = of_speed(x);
            // If the speed falls with rising force, "above" in speed is "below" in force.
            let rising = of_speed(x * (1.0 + 1e-6)) > of_speed(x * (1.0 - 1e-6));
            change.unstable_above = change.unstable_above == rising;
        }
        search.changes.sort_by(|a, b| a.value.total_cmp(&b.value));
        search
    }

    pub(super) fn critical_damping(&self, force: f64, x: f64, scale: fn(f64) -> (f64, f64)) -> ChangeSearch {
        let with = |k: f64| self.damped(scale(k));
        let coarse: Vec<f64> = multiples().step_by(4).collect();
        let found = changes(&coarse, |k| with(k).verdict(x, force));
        search((1.0 / MULTIPLES, MULTIPLES), found, |k| {
            (x, with(k).frequency(x, force))
        })
    }
}

/// Changes of stability (value, unstable above), or the verdict for the whole range.
type SlidingChanges = (Vec<(f64, bool)>, Option<SlidingVerdict>);

/// `at` returns relative velocity and frequency of the neutral motion at a change.
fn search(
    (from, to): (f64, f64),
    (found, throughout): SlidingChanges,
    at: impl Fn(f64) -> (f64, Option<f64>),
) -> ChangeSearch {
    let change = |(value, unstable_above): (f64, bool)| {
        let (relative_velocity, frequency) = at(value);
        StabilityChange {
            value,
            relative_velocity,
            frequency,
            unstable_above,
        }
    };
    ChangeSearch {
        from,
        to,
        changes: found.into_iter().map(change).collect(),
        throughout,
    }
}

/// Bisection to the last digit between `below` and `above`, where `holds` has different values.
fn turn(below: f64, above: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let first = holds(below);
    bisect(below, above, usize::MAX, |x| holds(x) == first).1
}

fn changes(grid: &[f64], verdict: impl Fn(f64) -> SlidingVerdict) -> SlidingChanges {
    let known: Vec<(f64, SlidingVerdict)> = grid.iter().map(|&value| (value, verdict(value))).collect();
    let is_unstable = |value: f64| verdict(value).is_unstable();
    let pairs = known.windows(2).map(|pair| (pair[0], pair[1]));
    let pairs = pairs.filter(|(a, b)| a.1.is_unstable() != b.1.is_unstable());
    let found = pairs.map(|(a, b)| (turn(a.0, b.0, is_unstable), b.1.is_unstable()));
    let found: Vec<(f64, bool)> = found.collect();
    let throughout = match (found.is_empty(), known.first()) {
        // A mixture of stable and neutral points counts as neutral.
        (true, Some(first)) if known.iter().all(|(_, verdict)| *verdict == first.1) => Some(first.1),
        (true, Some(first)) if !first.1.is_unstable() => Some(SlidingVerdict::Neutral),
        _ => None,
    };
    (found, throughout)
}

fn multiples() -> impl Iterator<Item = f64> {
    let count = 6 * POINTS;
    (0..=count).map(move |k| MULTIPLES.powf(2.0 * f64::from(k) / f64::from(count) - 1.0))
}

fn twists(side: &Side, external: f64, interface: f64, speed: f64) -> Vec<f64> {
    let mut torque = interface;
    (0..side.shafts())
        .map(|i| {
            let own = if side.takes_torque[i] { external } else { 0.0 };
            torque += side.sign * (side.viscous[i] * speed - own);
            torque / side.stiffness[i]
        })
        .collect()
}
