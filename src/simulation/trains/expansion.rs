//! The Taylor series of two trains: all coefficients of the state in time, from the start of a step.
//!
//! The equations of [`TrainSystem`] hold coefficient by coefficient. What drives the trains has its own series, the friction
//! law gives its coefficients from those of omega_r ([`LawSeries`]), and the smooth functions of a contact without stick follow
//! from their differential equations: t' = (1 - t^2) v' for tanh, a' = v'/(1 + v^2) for arctan.

use super::dynamics::{TrainDynamics, TrainLocation};
use super::excitation::{DrivingSeries, OutsideSeries};
use crate::friction::{FrictionSeries, Law, LawSeries};
use crate::model::trains::Smoothing;
use crate::model::trains::slow_manifold::SlowSeries;
use crate::model::trains::system::{ANGLE, DAMPING_LOSS, Engagement, FRICTION_LOSS, Side, TrainSystem, WORK};
use crate::model::{BreakawayTest, Mode};
use crate::numerics::taylor;

/// Coefficients of an expansion: order 27, as that of the brake.
pub(crate) const TERMS: usize = 28;

/// Coefficients by powers of time over the unit.
pub(super) type Series = [f64; TERMS];

const NONE: Series = [0.0; TERMS];

/// Series of one side that the state does not hold.
#[derive(Debug, Clone)]
struct SideSeries {
    /// Speeds of the inertias, rad/s, surface first.
    speed: Vec<Series>,
    /// Their accelerations, rad/s^2.
    acceleration: Vec<Series>,
    /// Torques of the shafts, N m.
    shaft: Vec<Series>,
    /// Sum of all else than the interface's torque on the surface, N m.
    surface: Series,
}

impl SideSeries {
    fn new(side: &Side) -> SideSeries {
        SideSeries {
            speed: vec![NONE; side.inertia.len()],
            acceleration: vec![NONE; side.inertia.len()],
            shaft: vec![NONE; side.shafts()],
            surface: NONE,
        }
    }
}

/// An expansion.
#[derive(Debug, Clone)]
pub(super) struct Expansion {
    /// s.
    pub unit: f64,
    /// How many coefficients are filled; what is behind them is of another expansion.
    pub terms: usize,
    /// Of every component of the state.
    pub state: Vec<Series>,
    /// omega_r, rad/s.
    pub relative_velocity: Series,
    /// The torque of the interface, N m: T_f in stick.
    pub interface: Series,
    /// mu_0 r F_n, N m, in stick.
    pub limit: Series,
    outside: OutsideSeries<TERMS>,
    sides: [SideSeries; 2],
    law: FrictionSeries<f64, TERMS>,
    /// Which piece of the law that is.
    piece: usize,
}

/// The coefficient `n` of a b, where those of both up to n are known.
#[inline]
fn convolved(a: &Series, b: &Series, n: usize) -> f64 {
    let mut sum = 0.0;
    for k in 0..=n {
        sum += a[k] * b[n - k];
    }
    sum
}

impl Expansion {
    pub fn new(dynamics: &TrainDynamics) -> Expansion {
        let system = &dynamics.system;
        Expansion {
            unit: 1.0,
            terms: TERMS,
            state: vec![NONE; system.dimension],
            relative_velocity: NONE,
            interface: NONE,
            limit: NONE,
            outside: OutsideSeries::new(),
            sides: [SideSeries::new(&system.rotor), SideSeries::new(&system.stator)],
            law: system.law_in(0).series(),
            piece: 0,
        }
    }

    /// Fills all coefficients of the motion from `t` (s) on, with the state `y`, by powers of time over `unit` (s).
    pub fn expand(&mut self, dynamics: &TrainDynamics, location: &TrainLocation, t: f64, y: &[f64], unit: f64) {
        let system = &dynamics.system;
        self.unit = unit;
        if self.piece != location.piece {
            self.piece = location.piece;
            self.law = system.law_in(location.piece).series();
        }
        dynamics.excitation.series(location.stretch, t, unit, &mut self.outside);
        for (series, &start) in self.state.iter_mut().zip(y) {
            series[0] = start;
        }
        let mut friction = Interface::new(location);
        let stuck = location.mode == Mode::Stick;
        self.relative_velocity = NONE;
        for n in 0..self.terms {
            for (side, (series, driving)) in [&system.rotor, &system.stator]
                .into_iter()
                .zip(self.sides.iter_mut().zip(&self.outside.sides))
            {
                series.speeds_at(side, n, &self.state, driving);
            }
            if n == 0 && !stuck {
                let outside = dynamics.outside(location, t);
                self.relative_velocity[0] = system.relative_velocity(&outside, y);
            }
            let torque = friction.torque(n, self, system);
            self.interface[n] = torque;
            self.limit[n] = system.breakaway_torque(self.outside.normal_force[n]);
            if n + 1 == self.terms {
                break;
            }
            let step = unit / (n + 1) as f64;
            let joined =
                stuck.then(|| self.on_surfaces(n, |[rotor, stator], [a, b]| system.joined(rotor, stator, a, b)));
            for (index, side) in [&system.rotor, &system.stator].into_iter().enumerate() {
                let (series, driving) = (&mut self.sides[index], &self.outside.sides[index]);
                series.extend(side, n, torque, joined, driving, step, &mut self.state);
            }
            if !stuck {
                let surface = |index: usize| {
                    let known = self.sides[index].acceleration.first();
                    known.map_or(self.outside.sides[index].acceleration[n], |a| a[n])
                };
                self.relative_velocity[n + 1] = step * (surface(0) - surface(1));
            }
            if let Engagement::Bristles(.., at) = system.engagement {
                self.state[at][n + 1] = step * friction.rate[n];
            }
        }
        self.quadratures(system, location);
    }

    /// Takes the motion along the slow manifold, from the quadratures of `y` on, for the one that it holds; by powers of time in
    /// s. Nothing drives the trains.
    pub fn follow(&mut self, system: &TrainSystem, location: &TrainLocation, slow: &SlowSeries<TERMS>, y: &[f64]) {
        self.unit = 1.0;
        slow.states(system, |index, series| self.state[index] = *series);
        for (series, &start) in self.state.iter_mut().zip(y).skip(system.mechanical()) {
            series[0] = start;
        }
        for (index, side) in [&system.rotor, &system.stator].into_iter().enumerate() {
            for n in 0..TERMS {
                self.sides[index].speeds_at(side, n, &self.state, &self.outside.sides[index]);
            }
        }
        self.relative_velocity = slow.relative_velocity();
        self.interface = *slow.torque();
        self.law = slow.friction().clone();
        self.piece = location.piece;
        self.quadratures(system, location);
    }

    /// F_n about `t` (s) by powers of time in s, up to its degree. What is held of a motion is void after that.
    pub fn pressing(&mut self, dynamics: &TrainDynamics, location: &TrainLocation, t: f64) -> &[f64] {
        dynamics.excitation.series(location.stretch, t, 1.0, &mut self.outside);
        &self.outside.normal_force[..=self.outside.degree]
    }

    fn quadratures(&mut self, system: &TrainSystem, location: &TrainLocation) {
        let mut loss = NONE;
        let mut work = NONE;
        let last = self.terms - 1;
        let add = |sum: &mut Series, factor: f64, a: &Series, b: &Series| {
            if last + 1 < TERMS {
                for (n, sum) in sum[..last].iter_mut().enumerate() {
                    *sum += factor * convolved(a, b, n);
                }
                return;
            }
            for (sum, c) in sum.iter_mut().zip(taylor::product(a, b)) {
                *sum += factor * c;
            }
        };
        for (index, side) in [&system.rotor, &system.stator].into_iter().enumerate() {
            let (series, driving) = (&self.sides[index], &self.outside.sides[index]);
            for i in 0..side.shafts() {
                let rate = &self.state[side.twists + 2 * i + 1];
                add(&mut loss, side.damping[i], rate, rate);
            }
            for (i, speed) in series.speed.iter().enumerate() {
                if side.viscous[i] != 0.0 {
                    add(&mut loss, side.viscous[i], speed, speed);
                }
            }
            if let Some(on) = side.torque_on {
                add(&mut work, 1.0, &driving.torque, &series.speed[on]);
            }
            if side.speed.is_none() {
                let held = series.shaft.last().unwrap_or(&self.interface);
                add(&mut work, side.sign, held, &driving.speed);
            }
        }
        let stuck = location.mode == Mode::Stick;
        let mut friction = NONE;
        if !stuck {
            add(&mut friction, 1.0, &self.interface, &self.relative_velocity);
        }
        for n in 0..last {
            let step = self.unit / (n + 1) as f64;
            let at = system.slip;
            self.state[at][n + 1] = if stuck { 0.0 } else { step * self.relative_velocity[n] };
            self.state[at + FRICTION_LOSS][n + 1] = step * friction[n];
            self.state[at + DAMPING_LOSS][n + 1] = step * loss[n];
            self.state[at + WORK][n + 1] = step * work[n];
            if let (Some(index), true) = (system.stator.speed, system.dimension > at + ANGLE) {
                self.state[at + ANGLE][n + 1] = step * self.state[index][n];
            }
        }
    }

    /// What follows from coefficient `n` of the torques on the two surfaces (N m) and of the accelerations of the ends (rad/s^2).
    fn on_surfaces(&self, n: usize, follows: impl Fn([f64; 2], [f64; 2]) -> f64) -> f64 {
        let surfaces = [0, 1].map(|side: usize| self.sides[side].surface[n]);
        follows(
            surfaces,
            [0, 1].map(|side: usize| self.outside.sides[side].acceleration[n]),
        )
    }

    /// The longest time of at most `longest` (s) over which friction may be taken from its Taylor coefficients.
    pub fn within_law(&self, system: &TrainSystem, location: &TrainLocation, longest: f64) -> f64 {
        if matches!(location.mode, Mode::Stick | Mode::Separated) {
            return longest;
        }
        let w = &self.relative_velocity;
        let x = longest / self.unit;
        let change = w[1..self.terms].iter().rev().fold(0.0, |sum, c| (sum + c.abs()) * x);
        longest * system.expandable_share(location.piece, w[0], change)
    }

    /// Speed of inertia `i`, rad/s, of the rotor (0) or the stator (1).
    pub fn speed(&self, side: usize, i: usize) -> &Series {
        &self.sides[side].speed[i]
    }

    /// Speed of the far end, rad/s, of the rotor (0) or the stator (1).
    pub fn end_speed(&self, side: usize) -> &Series {
        &self.outside.sides[side].speed
    }

    /// F_n, N, without the clamp at zero.
    pub fn normal_force(&self) -> &Series {
        &self.outside.normal_force
    }

    /// T_f, N m, in any mode.
    pub fn transmitted(&self, system: &TrainSystem) -> Series {
        std::array::from_fn(|n| self.on_surfaces(n, |[rotor, stator], [a, b]| system.shared(rotor, stator, a, b)))
    }

    /// The margin of steady sliding of an expanded slip, N m s/rad; `None` where there is none.
    pub fn stability_margin(&self, system: &TrainSystem) -> Option<Series> {
        let twice_resistance = system.twice_resistance?;
        let factors = self.law.factors(&1.0, &system.slope_weight(1.0));
        let slope = std::array::from_fn(|n| factors.slope * self.law.slope_shape(n));
        let mut margin = taylor::product(&self.outside.normal_force, &slope);
        margin[0] += twice_resistance;
        Some(margin)
    }

    /// The torque that the breakaway test holds against the limit, N m, in stick.
    pub fn tested(&self, system: &TrainSystem) -> &Series {
        match system.breakaway_test {
            BreakawayTest::Transmitted => &self.interface,
            BreakawayTest::Rotor => &self.sides[0].surface,
            BreakawayTest::Stator => &self.sides[1].surface,
        }
    }

    /// The state at the time `x` units after the start.
    pub fn at(&self, x: f64, out: &mut [f64]) {
        for (value, series) in out.iter_mut().zip(&self.state) {
            *value = taylor::value(&series[..self.terms], &x);
        }
    }
}

impl SideSeries {
    /// Coefficient `n` of speeds, shaft torques and the torque on the surface.
    fn speeds_at(&mut self, side: &Side, n: usize, state: &[Series], driving: &DrivingSeries<TERMS>) {
        let inertias = side.inertia.len();
        let mut outer = side.speed.map_or(driving.speed[n], |index| state[index][n]);
        for i in (0..inertias).rev() {
            if i < side.shafts() {
                let (twist, rate) = (&state[side.twists + 2 * i], &state[side.twists + 2 * i + 1]);
                outer -= side.sign * rate[n];
                self.shaft[i][n] = side.stiffness[i] * twist[n] + side.damping[i] * rate[n];
            }
            self.speed[i][n] = outer;
        }
        if inertias > 0 {
            let external = if side.torque_on == Some(0) {
                driving.torque[n]
            } else {
                0.0
            };
            let own = side.sign * (external - side.viscous[0] * self.speed[0][n]);
            self.surface[n] = own + self.shaft.first().map_or(0.0, |shaft| shaft[n]);
        }
    }

    /// Coefficient `n` of the accelerations under that of the interface's torque, or of the one of both surfaces in stick, and
    /// with them `n` + 1 of the state.
    #[allow(clippy::too_many_arguments)] // one coefficient: of which side, under what, into what
    fn extend(
        &mut self,
        side: &Side,
        n: usize,
        interface: f64,
        joined: Option<f64>,
        driving: &DrivingSeries<TERMS>,
        step: f64,
        state: &mut [Series],
    ) {
        let (inertias, shafts) = (side.inertia.len(), side.shafts());
        let mut outer = driving.acceleration[n];
        for i in (0..inertias).rev() {
            let outside = if i < shafts { self.shaft[i][n] } else { 0.0 };
            let inside = if i > 0 { self.shaft[i - 1][n] } else { interface };
            let external = if side.torque_on == Some(i) {
                driving.torque[n]
            } else {
                0.0
            };
            let own = external - side.viscous[i] * self.speed[i][n];
            let acceleration = match joined {
                Some(joined) if i == 0 => joined,
                None if i == 0 => side.sign * (self.surface[n] - interface) / side.inertia[0],
                _ => (side.sign * (outside - inside) + own) / side.inertia[i],
            };
            self.acceleration[i][n] = acceleration;
            if i < shafts {
                let at = side.twists + 2 * i;
                let rate = state[at + 1][n];
                state[at][n + 1] = step * rate;
                state[at + 1][n + 1] = step * side.sign * (outer - acceleration);
            } else if let Some(index) = side.speed {
                state[index][n + 1] = step * acceleration;
            }
            outer = acceleration;
        }
    }
}

/// The torque of the interface, coefficient by coefficient.
struct Interface {
    mode: Mode,
    sense: f64,
    /// mu_const and the factor of its shape, over r F_n.
    constant: f64,
    factor: f64,
    /// |omega_r| of the motion, s omega_r.
    speed: Series,
    /// mu or g.
    mu: Series,
    /// The smooth function of a regularised contact, and its square or 1 + v^2.
    smooth: Series,
    helper: Series,
    /// Of bristles: 1/g, x z, their rate.
    inverse: Series,
    product: Series,
    rate: Series,
    /// All of it over r F_n.
    coefficient: Series,
}

impl Interface {
    fn new(location: &TrainLocation) -> Interface {
        Interface {
            mode: location.mode,
            sense: location.sign(),
            constant: 0.0,
            factor: 0.0,
            speed: NONE,
            mu: NONE,
            smooth: NONE,
            helper: NONE,
            inverse: NONE,
            product: NONE,
            rate: NONE,
            coefficient: NONE,
        }
    }

    /// Coefficient `n`, when those of omega_r up to n are known.
    fn torque(&mut self, n: usize, all: &mut Expansion, system: &TrainSystem) -> f64 {
        let force = &all.outside.normal_force;
        match self.mode {
            Mode::Separated => return 0.0,
            Mode::Stick => return all.on_surfaces(n, |[rotor, stator], [a, b]| system.shared(rotor, stator, a, b)),
            _ => {}
        }
        self.speed[n] = self.sense * all.relative_velocity[n];
        if n == 0 {
            let factors = all.law.factors(&1.0, &1.0);
            (self.constant, self.factor) = (factors.constant, factors.shape);
            all.law.start(&self.speed[0], &1.0);
        } else {
            all.law.extend_from(n, &self.speed);
        }
        self.mu[n] = self.factor * all.law.shape(n) + if n == 0 { self.constant } else { 0.0 };
        self.coefficient[n] = match (self.mode, system.engagement) {
            (Mode::Engaged, Engagement::Regularised(smoothing, speed)) => {
                self.smooth[n] = self.smooth_coefficient(n, smoothing, speed, &all.relative_velocity);
                convolved(&self.mu, &self.smooth, n)
            }
            (Mode::Engaged, Engagement::Bristles(stiffness, damping, viscous, at)) => {
                self.inverse[n] = if n == 0 {
                    1.0 / self.mu[0]
                } else {
                    let sum: f64 = (1..=n).map(|k| self.mu[k] * self.inverse[n - k]).sum();
                    -sum / self.mu[0]
                };
                let deflection = &all.state[at];
                self.product[n] = convolved(&self.speed, deflection, n);
                let w = all.relative_velocity[n];
                self.rate[n] = w - stiffness * convolved(&self.product, &self.inverse, n);
                stiffness * deflection[n] + damping * self.rate[n] + viscous * w
            }
            _ => self.sense * self.mu[n],
        };
        system.radius * convolved(force, &self.coefficient, n)
    }

    /// Coefficient `n` of tanh(v) or (2/pi) arctan(v), v = omega_r/eps.
    fn smooth_coefficient(&mut self, n: usize, smoothing: Smoothing, speed: f64, relative_velocity: &Series) -> f64 {
        let v = |k: usize| relative_velocity[k] / speed;
        match smoothing {
            Smoothing::Tanh => {
                // helper = 1 - t^2
                if n == 0 {
                    let value = v(0).tanh();
                    self.smooth[0] = value;
                    self.helper[0] = v(0).cosh().powi(-2);
                    return value;
                }
                let sum: f64 = (1..=n).map(|k| k as f64 * v(k) * self.helper[n - k]).sum();
                let value = sum / n as f64;
                self.smooth[n] = value;
                self.helper[n] = -convolved(&self.smooth, &self.smooth, n);
                value
            }
            Smoothing::Arctan => {
                // helper = 1 + v^2; smooth holds (2/pi) a
                let share = std::f64::consts::FRAC_2_PI;
                let square: f64 = (0..=n).map(|k| v(k) * v(n - k)).sum();
                if n == 0 {
                    self.helper[0] = 1.0 + square;
                    return share * v(0).atan();
                }
                self.helper[n] = square;
                let sum: f64 = (1..n).map(|k| k as f64 * self.smooth[k] * self.helper[n - k]).sum();
                (share * n as f64 * v(n) - sum) / (n as f64 * self.helper[0])
            }
        }
    }
}
