//! State of a sliding system without its fast oscillations, at one instant and to rounding.
//!
//! After long undisturbed sliding the fast modes have died out. The exact state lies on the slow manifold, where the
//! twists follow the interface's torque T with all its derivatives. If that manifold is unstable, an integrator
//! leaves it because its rounding errors grow. The manifold itself can be computed without integration. On the side
//! `s` (+1 rotor, -1 stator), with L_j = J_j w_j' + d_j w_j - M_j, the shafts carry
//!
//! ```text
//! S_i = -s sum over j > i of L_j      (free train),
//! S_i = T + s sum over j <= i of L_j  (tied train),
//! q_i = (S_i - c_i q_i')/k_i,
//! ```
//!
//! and the momentum p = sum of J_j w_j of a free train has the rate -s T - sum of d_j w_j + M. The derivatives of the
//! twists on the right are small. Each iteration on Taylor coefficients in time gains a factor (c / k)/tau or (J /
//! k)/tau^2. For the paper's brake this is 1e-4, with a slow time scale tau of 12 ms.
//!
//! The expansion is asymptotic: each round takes two more derivatives. Where friction changes fast, with a [steepness
//! rate](Law::steepness_rate) above some 40 s/rad near the stop, a round gains a factor of two or less, and later
//! rounds lose accuracy. There the iteration stops at its least change, with as many coefficients as this takes. The
//! changes then estimate the remaining error ([`SlowState::error`]).

use super::equations::{Driving, Engagement, Outside, Side, SystemEquations};
use crate::friction::{FrictionSeries, Law, LawSeries};

const ORDER: usize = 14;

/// Most rounds for a single state. Five reach rounding at tau = 12 ms.
const ROUNDS: usize = 8;

/// Number of coefficients, and most rounds, where the short iteration does not reach rounding. A round takes two
/// derivatives, so that the last coefficients are unreliable. At a steepness rate of 70 s/rad the changes are least
/// after 18 rounds or so.
const LONG_ORDER: usize = 28;
const LONG_ROUNDS: usize = 20;

/// Largest change by a round that counts as rounding, relative to the component or, for rates, to the speed.
const SETTLED: f64 = 64.0 * f64::EPSILON;

/// Error bound of a state, divided by the larger of its last two changes where these are least. Compared with the
/// multiprecision solution the error was 0.3 to 3.4 times the change.
const ERROR_OF_CHANGE: f64 = 8.0;

/// Most rounds for a step, where friction changes so fast that the slow mode is hardly slower than the others.
const STEP_ROUNDS: usize = 12;

/// Coefficients of the derivative. The last one is zero.
pub fn derivative<const N: usize>(series: &[f64; N]) -> [f64; N] {
    std::array::from_fn(|n| if n + 1 < N { (n + 1) as f64 * series[n + 1] } else { 0.0 })
}

/// A slip and its external inputs.
#[derive(Debug, Clone, Copy)]
pub struct Slip<'a> {
    /// Sign of omega_r.
    pub sense: f64,
    /// Piece of the friction law.
    pub piece: usize,
    /// Taylor coefficients of F_n about the present, N, by powers of time in s. Missing ones are zero.
    pub pressing: &'a [f64],
    /// Speeds and torques of the drives, constant over the motion ahead. The normal force in it is not used (see
    /// `pressing`).
    pub outside: Outside,
}

impl<'a> Slip<'a> {
    /// A slip without drives and external torques.
    pub fn undriven(sense: f64, piece: usize, pressing: &'a [f64]) -> Self {
        Slip {
            sense,
            piece,
            pressing,
            outside: Outside::default(),
        }
    }
}

/// Momenta of the free chains, rotor and stator, N m s; 0 for a tied chain. They determine the slow motion.
pub type Momenta = [f64; 2];

/// Whether slips have a slow manifold: the contact has stick and slip, and every shaft has a stiffness.
pub fn has_slow_manifold(system: &SystemEquations) -> bool {
    let sprung = |side: &Side| side.stiffness.iter().all(|k| *k > 0.0);
    system.engagement == Engagement::StickSlip && sprung(&system.rotor) && sprung(&system.stator)
}

/// The momenta of a state.
pub fn slow_momenta(system: &SystemEquations, outside: &Outside, y: &[f64]) -> Momenta {
    let of = |side: &Side, driving: &Driving| {
        let speeds = side.speed.map(|_| side.speeds(driving, y)).unwrap_or_default();
        speeds.iter().zip(&side.inertia).map(|(w, j)| j * w).sum()
    };
    [of(&system.rotor, &outside.rotor), of(&system.stator, &outside.stator)]
}

/// The best available state on the slow manifold.
#[derive(Debug, Clone, PartialEq)]
pub struct SlowState {
    /// The state.
    pub state: Vec<f64>,
    /// Error bound of each component against exact sliding without fast oscillations; zero for quadratures.
    pub error: Vec<f64>,
    /// Whether the iteration has reached rounding, which is then the error.
    pub settled: bool,
}

/// Computes the state on the slow manifold that has the momenta of `y`. Quadratures are copied.
pub fn on_slow_manifold(system: &SystemEquations, slip: &Slip<'_>, y: &[f64]) -> SlowState {
    let momenta = slow_momenta(system, &slip.outside, y);
    let with = |slow: &[f64]| {
        let mut state = y.to_vec();
        state[..slow.len()].copy_from_slice(slow);
        state
    };
    let with_error = |error: Vec<f64>| {
        let mut all = vec![0.0; system.dimension];
        all[..error.len()].copy_from_slice(&error);
        all
    };
    let mut short = SlowSeries::<ORDER>::zero(system, slip);
    let mut before = short.start(system);
    for _ in 0..ROUNDS {
        before = short.start(system);
        if short.round(system, slip, momenta) {
            break;
        }
    }
    let slow = short.start(system);
    let least = rounding(system, &slow);
    // The speeds follow the twist rates one round later.
    let settled = twist_components(system).all(|k| (slow[k] - before[k]).abs() <= least[k]);
    if settled {
        return SlowState {
            state: with(&slow),
            error: with_error(least),
            settled,
        };
    }
    let (slow, change) = least_change(system, slip, momenta);
    let least = rounding(system, &slow);
    let mut error: Vec<f64> = (0..least.len())
        .map(|k| (ERROR_OF_CHANGE * change[k]).max(least[k]))
        .collect();
    // The momentum is given, so that the speed follows from the twist rates.
    for side in [&system.rotor, &system.stator] {
        if let Some(index) = side.speed {
            let inner = inner_inertias(side).zip(side.twist_rates());
            let moved: f64 = inner.map(|(inertia, rate)| inertia * error[rate]).sum();
            error[index] = least[index] + moved / side.rigid_inertia();
        }
    }
    SlowState {
        state: with(&slow),
        error: with_error(error),
        settled,
    }
}

fn twist_components(system: &SystemEquations) -> impl Iterator<Item = usize> + '_ {
    let of = |side: &Side| side.twists..side.twists + 2 * side.shafts();
    of(&system.rotor).chain(of(&system.stator))
}

fn inner_inertias(side: &Side) -> impl Iterator<Item = f64> + '_ {
    side.inertia.iter().take(side.shafts()).scan(0.0, |sum, j| {
        *sum += j;
        Some(*sum)
    })
}

fn rounding(system: &SystemEquations, slow: &[f64]) -> Vec<f64> {
    let speed = [system.rotor.speed, system.stator.speed].into_iter().flatten();
    let speed = speed.map(|index| slow[index].abs()).fold(0.0, f64::max);
    let mut least = vec![SETTLED * speed; slow.len()];
    for side in [&system.rotor, &system.stator] {
        for i in 0..side.shafts() {
            let twist = side.twists + 2 * i;
            least[twist] = SETTLED * slow[twist].abs().max(speed * f64::EPSILON / side.own_frequency(i));
            least[twist + 1] = SETTLED * slow[twist + 1].abs().max(speed * f64::EPSILON);
        }
    }
    least
}

/// Size of an oscillation, rad/s: the largest twist rate, or the largest twist times the angular frequency of the
/// inertia on its shaft's inner side.
pub fn oscillation(system: &SystemEquations, y: &[f64]) -> f64 {
    let of = |side: &Side| {
        let of_shaft = |i| (side.own_frequency(i) * side.twist(i, y).abs()).max(side.twist_rate(i, y).abs());
        (0..side.shafts()).map(of_shaft).fold(0.0, f64::max)
    };
    of(&system.rotor).max(of(&system.stator))
}

/// The state after the round with the least change, and for each component the larger of its changes in this round and
/// the previous one. A single change may be small by chance.
fn least_change(system: &SystemEquations, slip: &Slip<'_>, momenta: Momenta) -> (Vec<f64>, Vec<f64>) {
    let mut series = SlowSeries::<LONG_ORDER>::zero(system, slip);
    let components = system.mechanical();
    let (mut before, mut last) = (vec![0.0; components], vec![f64::INFINITY; components]);
    let mut best = (before.clone(), last.clone(), f64::INFINITY);
    for _ in 0..LONG_ROUNDS {
        series.round(system, slip, momenta);
        series.settle_speeds(system, momenta);
        let state = series.start(system);
        let change: Vec<f64> = state.iter().zip(&before).map(|(new, old)| (new - old).abs()).collect();
        let both: Vec<f64> = change.iter().zip(&last).map(|(new, old)| new.max(*old)).collect();
        let size = oscillation(system, &both);
        if size < best.2 {
            best = (state.clone(), both, size);
        }
        if !change.iter().all(|x| x.is_finite()) {
            break;
        }
        (before, last) = (state, change);
    }
    (best.0, best.1)
}

#[derive(Debug, Clone)]
struct SlowSide<const N: usize> {
    twists: Vec<[f64; N]>,
    base: [f64; N],
    rates: Vec<[f64; N]>,
    speeds: Vec<[f64; N]>,
}

impl<const N: usize> SlowSide<N> {
    fn zero(side: &Side) -> Self {
        SlowSide {
            twists: vec![[0.0; N]; side.shafts()],
            base: [0.0; N],
            rates: vec![[0.0; N]; side.shafts()],
            speeds: vec![[0.0; N]; side.inertia.len()],
        }
    }

    fn start_base(&mut self, side: &Side, driving: &Driving, momentum: f64) {
        self.base[0] = if side.speed.is_some() {
            let inner = inner_inertias(side).zip(&self.twists);
            let twisting: f64 = inner.map(|(inertia, twist)| inertia * twist[1]).sum();
            (momentum + side.sign * twisting) / side.rigid_inertia()
        } else {
            driving.speed
        };
    }

    /// Computes coefficient `n` of all speeds from that of the base, and returns the surface's.
    fn speeds_at(&mut self, side: &Side, n: usize) -> f64 {
        let mut speed = self.base[n];
        for i in (0..side.inertia.len()).rev() {
            if let Some(rate) = self.rates.get(i) {
                speed -= side.sign * rate[n];
            }
            self.speeds[i][n] = speed;
        }
        speed
    }

    /// Computes coefficient `n` + 1 of a free train's base speed, from the interface's torque.
    fn extend_base(&mut self, side: &Side, driving: &Driving, torque: f64, n: usize) {
        if side.speed.is_none() || n + 1 >= N {
            return;
        }
        let order = (n + 1) as f64;
        let inner = inner_inertias(side).zip(&self.rates);
        let bending: f64 = inner.map(|(inertia, rate)| inertia * order * rate[n + 1]).sum();
        let viscous: f64 = side.viscous.iter().zip(&self.speeds).map(|(d, w)| d * w[n]).sum();
        let external = if n == 0 && side.torque_on.is_some() {
            driving.torque
        } else {
            0.0
        };
        self.base[n + 1] = (side.sign * (bending - torque) - viscous + external) / (side.rigid_inertia() * order);
    }

    /// J_j w_j' + d_j w_j - M_j.
    fn load(&self, side: &Side, driving: &Driving, j: usize) -> [f64; N] {
        let acceleration = derivative(&self.speeds[j]);
        let mut load: [f64; N] =
            std::array::from_fn(|n| side.inertia[j] * acceleration[n] + side.viscous[j] * self.speeds[j][n]);
        if side.takes_torque[j] {
            load[0] -= driving.torque;
        }
        load
    }

    /// Computes the twists from the torques of the shafts. Returns whether the twist rates have settled.
    fn twist(&mut self, side: &Side, driving: &Driving, interface: &[f64; N]) -> bool {
        let mut carried = [0.0; N];
        let mut settled = true;
        let free = side.speed.is_some();
        for step in 0..side.shafts() {
            let (i, loaded) = if free {
                (side.shafts() - 1 - step, side.shafts() - step)
            } else {
                (step, step)
            };
            let load = self.load(side, driving, loaded);
            let before = self.twists[i][1];
            for n in 0..N {
                carried[n] += side.sign * load[n];
                let torque = if free { -carried[n] } else { interface[n] + carried[n] };
                self.twists[i][n] = (torque - side.damping[i] * self.rates[i][n]) / side.stiffness[i];
            }
            let after = self.twists[i][1];
            settled &= (after - before).abs() <= f64::EPSILON * after.abs();
        }
        settled
    }
}

/// Motion along the slow manifold: N Taylor coefficients by powers of time in s. The last two are unreliable.
#[derive(Debug, Clone)]
pub struct SlowSeries<const N: usize> {
    sides: [SlowSide<N>; 2],
    speed: [f64; N],
    sense: f64,
    /// Friction along the motion, by powers of time in s.
    pub friction: FrictionSeries<f64, N>,
    /// The interface's torque T, N m.
    pub torque: [f64; N],
}

impl<const N: usize> SlowSeries<N> {
    /// The motion with these [momenta](slow_momenta).
    pub fn new(system: &SystemEquations, slip: &Slip<'_>, momenta: Momenta) -> Self {
        Self::of_rounds(system, slip, momenta, STEP_ROUNDS)
    }

    /// The motion with these momenta, after at most `rounds` rounds.
    pub fn of_rounds(system: &SystemEquations, slip: &Slip<'_>, momenta: Momenta, rounds: usize) -> Self {
        let mut series = Self::zero(system, slip);
        for _ in 0..rounds {
            if series.round(system, slip, momenta) {
                break;
            }
        }
        series
    }

    fn zero(system: &SystemEquations, slip: &Slip<'_>) -> Self {
        SlowSeries {
            sides: [SlowSide::zero(&system.rotor), SlowSide::zero(&system.stator)],
            speed: [0.0; N],
            sense: slip.sense,
            friction: system.law_in(slip.piece).series(),
            torque: [0.0; N],
        }
    }

    /// One round of the iteration. Returns whether the twist rates have settled, which they do last.
    fn round(&mut self, system: &SystemEquations, slip: &Slip<'_>, momenta: Momenta) -> bool {
        let sides = [
            (&system.rotor, &slip.outside.rotor),
            (&system.stator, &slip.outside.stator),
        ];
        for ((motion, (side, driving)), momentum) in self.sides.iter_mut().zip(sides).zip(momenta) {
            motion.start_base(side, driving, momentum);
            for (rate, twist) in motion.rates.iter_mut().zip(&motion.twists) {
                *rate = derivative(twist);
            }
        }
        let factors = self.friction.factors(1.0, 0.0);
        for n in 0..N {
            let [rotor, stator] = [0, 1].map(|k| self.sides[k].speeds_at(sides[k].0, n));
            self.speed[n] = slip.sense * (rotor - stator);
            if n == 0 {
                self.friction.start(self.speed[0], 1.0);
            } else {
                self.friction.extend_from(n, &self.speed);
            }
            let friction = &self.friction;
            let mu = |n: usize| factors.shape * friction.shape(n) + if n == 0 { factors.constant } else { 0.0 };
            self.torque[n] = slip.sense * system.radius * pressed(slip.pressing, n, mu);
            for (motion, (side, driving)) in self.sides.iter_mut().zip(sides) {
                motion.extend_base(side, driving, self.torque[n], n);
            }
        }
        let mut settled = true;
        for (motion, (side, driving)) in self.sides.iter_mut().zip(sides) {
            settled &= motion.twist(side, driving, &self.torque);
        }
        settled
    }

    fn settle_speeds(&mut self, system: &SystemEquations, momenta: Momenta) {
        for ((motion, side), momentum) in self.sides.iter_mut().zip([&system.rotor, &system.stator]).zip(momenta) {
            if side.speed.is_some() {
                motion.start_base(side, &Driving::default(), momentum);
            }
        }
    }

    /// Calls `take` for each component before the quadratures, with its index in the state and its series.
    pub fn states(&self, system: &SystemEquations, mut take: impl FnMut(usize, &[f64; N])) {
        for (motion, side) in self.sides.iter().zip([&system.rotor, &system.stator]) {
            for (i, twist) in motion.twists.iter().enumerate() {
                take(side.twists + 2 * i, twist);
                take(side.twists + 2 * i + 1, &derivative(twist));
            }
            if let Some(index) = side.speed {
                take(index, &motion.base);
            }
        }
    }

    /// omega_r, rad/s.
    pub fn relative_velocity(&self) -> [f64; N] {
        self.speed.map(|x| self.sense * x)
    }

    /// r F_n mu', N m s/rad: the damping of the contact by the slope of the friction law.
    pub fn contact_damping(&self, system: &SystemEquations, pressing: &[f64]) -> [f64; N] {
        let slope = self.friction.factors(1.0, system.radius).slope;
        std::array::from_fn(|n| slope * pressed(pressing, n, |n| self.friction.slope_shape(n)))
    }

    /// State at the start of the motion, without the quadratures.
    pub fn start(&self, system: &SystemEquations) -> Vec<f64> {
        let mut state = vec![0.0; system.mechanical()];
        self.states(system, |index, series| state[index] = series[0]);
        state
    }
}

fn pressed(force: &[f64], n: usize, series: impl Fn(usize) -> f64) -> f64 {
    let terms = force.iter().take(n + 1).enumerate();
    terms.map(|(k, force)| series(n - k) * force).sum()
}
