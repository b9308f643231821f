//! The Taylor series of two trains: all coefficients of the state in time, from the start of a step.
//!
//! The equations of [`TrainSystem`] hold coefficient by coefficient. What drives the trains has its own series, the friction
//! law gives its coefficients from those of omega_r ([`LawSeries`]), and the smooth functions of a contact without stick follow
//! from their differential equations: t' = (1 - t^2) v' for tanh, a' = v'/(1 + v^2) for arctan.

use super::dynamics::{TrainDynamics, TrainLocation};
use super::excitation::OutsideSeries;
use crate::friction::{Factors, FrictionSeries, Law, LawSeries};
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

/// 1/n; the first is not used.
const RECIPROCALS: Series = {
    let mut reciprocals = NONE;
    let mut n = 1;
    while n < TERMS {
        reciprocals[n] = 1.0 / n as f64;
        n += 1;
    }
    reciprocals
};

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
    law: FrictionSeries<f64, TERMS>,
    /// Which piece of the law that is.
    piece: usize,
    engaged: Engaged,
    /// 1/J of the inertias of the rotor and of the stator, 1/(kg m^2), surface first.
    per_inertia: [Vec<f64>; 2],
    /// By how much omega_r' falls per torque of the interface, 1/(kg m^2).
    lag: f64,
}

/// The coefficient `n` of a b, where those of both up to n are known and those of `a` beyond `degree` are zero.
#[inline]
fn convolved(a: &Series, b: &Series, n: usize, degree: usize) -> f64 {
    // Four partial sums: one alone would wait for each addition.
    let mut sums = [0.0; 4];
    let terms = degree.min(n) + 1;
    let (quads, rest) = a[..terms].as_chunks::<4>();
    let mut behind = n + 1;
    for a in quads {
        let b = &b[behind - 4..behind];
        for j in 0..4 {
            sums[j] += a[j] * b[3 - j];
        }
        behind -= 4;
    }
    for (sum, a) in sums.iter_mut().zip(rest) {
        behind -= 1;
        *sum += a * b[behind];
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

/// What acts on a surface, by one coefficient.
struct Surface {
    /// Sum of all else than the interface's torque, in the direction that the interface opposes on the rotor, N m.
    torque: f64,
    /// Acceleration of what is beyond the surface's shaft, or of the surface where it is rigid, rad/s^2.
    beyond: f64,
}

impl Expansion {
    pub fn new(dynamics: &TrainDynamics) -> Expansion {
        let system = &dynamics.system;
        let per_inertia = [&system.rotor, &system.stator].map(|side| side.inertia.iter().map(|j| 1.0 / j).collect());
        Expansion {
            unit: 1.0,
            terms: TERMS,
            state: vec![NONE; system.dimension],
            relative_velocity: NONE,
            interface: NONE,
            limit: NONE,
            outside: OutsideSeries::new(),
            law: system.law_in(0).series(),
            piece: 0,
            engaged: Engaged::new(),
            lag: per_inertia.iter().filter_map(|side: &Vec<f64>| side.first()).sum(),
            per_inertia,
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
        let driving = dynamics.excitation.driving_alone(location.stretch, t);
        self.relative_velocity[0] = system.relative_velocity(&driving, y);
        match location.mode {
            Mode::Stick => self.stick(system),
            Mode::Separated => self.move_apart(system, |_, _, _| [0.0; 2]),
            Mode::Engaged => {
                let sense = location.sign();
                self.start_law(sense, 1.0);
                self.move_apart(system, |all, n, rate| {
                    all.extend_law(n, rate);
                    all.engaged_torque(system, sense, n)
                });
            }
            Mode::SlipForward | Mode::SlipBackward => {
                let factors = self.start_law(location.sign(), location.sign() * system.radius);
                let degree = self.outside.degree;
                self.move_apart(system, |all, n, rate| {
                    all.extend_law(n, rate);
                    let force = &all.outside.normal_force;
                    let pressed = all.law.pressed(force, n, degree);
                    [factors.constant * force[n] + factors.shape * pressed.shape, 0.0]
                });
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

    /// Makes the law known at the start, and gives its factors times `of_coefficient`.
    fn start_law(&mut self, sense: f64, of_coefficient: f64) -> Factors<f64> {
        self.law
            .start(&(sense * self.relative_velocity[0]), &(sense * self.unit));
        self.law.factors(&of_coefficient, &of_coefficient)
    }

    /// Coefficient `n` of the law from coefficient `n` - 1 of omega_r' (rad/s^2); that at 0 is known.
    #[inline]
    fn extend_law(&mut self, n: usize, acceleration: f64) {
        if n > 0 {
            self.law.extend(n, &acceleration, &RECIPROCALS[n]);
        }
    }

    /// All coefficients while the surfaces may move against each other. `contact` gives, from coefficient n - 1 of omega_r'
    /// (rad/s^2), when those of the state up to n are known, coefficient n of the interface's torque (N m) and of the rate of
    /// the bristles' deflection.
    #[inline(always)]
    fn move_apart(&mut self, system: &TrainSystem, contact: impl Fn(&mut Expansion, usize, f64) -> [f64; 2]) {
        let mut acceleration = 0.0;
        for n in 0..self.terms {
            let [torque, deflection_rate] = contact(self, n, acceleration);
            self.interface[n] = torque;
            if n + 1 == self.terms {
                break;
            }
            let step = self.unit * RECIPROCALS[n + 1];
            let rotor = self.extend_free(&system.rotor, 0, n, step, torque);
            let stator = self.extend_free(&system.stator, 1, n, step, torque);
            acceleration = (rotor - stator) - self.lag * torque;
            self.relative_velocity[n + 1] = step * acceleration;
            if let Engagement::Bristles(.., at) = system.engagement {
                self.state[at][n + 1] = step * deflection_rate;
            }
        }
    }

    /// All coefficients while the surfaces stick to each other.
    fn stick(&mut self, system: &TrainSystem) {
        self.relative_velocity = NONE;
        for n in 0..self.terms {
            let (torque, joined) = self.shared(system, n);
            self.interface[n] = torque;
            self.limit[n] = system.breakaway_torque(self.outside.normal_force[n]);
            if n + 1 == self.terms {
                break;
            }
            let step = self.unit * RECIPROCALS[n + 1];
            for (index, side) in [&system.rotor, &system.stator].into_iter().enumerate() {
                let surface = self.extend(side, index, n, step);
                self.extend_surface(side, n, step, joined, surface.beyond);
            }
        }
    }

    /// Coefficient `n` + 1 of the states of one side (rotor 0, stator 1) from those up to `n` and the interface's torque (N m).
    /// Returns the acceleration of the surface without that torque, rad/s^2.
    #[inline(always)]
    fn extend_free(&mut self, side: &Side, index: usize, n: usize, step: f64, torque: f64) -> f64 {
        let surface = self.extend(side, index, n, step);
        let Some(per_inertia) = self.per_inertia[index].first() else {
            return surface.beyond;
        };
        let per_inertia = side.sign * per_inertia;
        let free = surface.torque * per_inertia;
        self.extend_surface(side, n, step, free - torque * per_inertia, surface.beyond);
        free
    }

    /// Coefficient `n` + 1 of the states of one side (rotor 0, stator 1) from those up to `n`, but for the one that the
    /// acceleration of its surface enters.
    #[inline(always)]
    fn extend(&mut self, side: &Side, index: usize, n: usize, step: f64) -> Surface {
        let (state, driving) = (&mut self.state[..], &self.outside.sides[index]);
        let (inertias, shafts) = (side.inertia.len(), side.shafts());
        let mut beyond = driving.acceleration[n];
        let mut speed = side.speed.map_or(driving.speed[n], |at| state[at][n]);
        let mut outside = if shafts == inertias {
            shaft_torque(side, state, shafts, n)
        } else {
            0.0
        };
        for i in (0..inertias).rev() {
            let at = side.twists + 2 * i;
            if i < shafts {
                let rate = state[at + 1][n];
                state[at][n + 1] = step * rate;
                speed -= side.sign * rate;
            }
            let external = if side.torque_on == Some(i) {
                driving.torque[n]
            } else {
                0.0
            };
            let own = external - side.viscous[i] * speed;
            if i == 0 {
                let torque = side.sign * own + outside;
                return Surface { torque, beyond };
            }
            let inside = shaft_torque(side, state, i, n);
            let acceleration = (side.sign * (outside - inside) + own) * self.per_inertia[index][i];
            if i < shafts {
                state[at + 1][n + 1] = step * side.sign * (beyond - acceleration);
            } else if let Some(at) = side.speed {
                state[at][n + 1] = step * acceleration;
            }
            (outside, beyond) = (inside, acceleration);
        }
        Surface { torque: 0.0, beyond }
    }

    /// Coefficient `n` + 1 of the state that the acceleration of a surface (rad/s^2) enters.
    #[inline(always)]
    fn extend_surface(&mut self, side: &Side, n: usize, step: f64, acceleration: f64, beyond: f64) {
        if side.shafts() > 0 {
            self.state[side.twists + 1][n + 1] = step * side.sign * (beyond - acceleration);
        } else if let Some(at) = side.speed {
            self.state[at][n + 1] = step * acceleration;
        }
    }

    fn quadratures(&mut self, system: &TrainSystem, location: &TrainLocation) {
        let stuck = location.mode == Mode::Stick;
        let (mut loss, mut work, mut friction) = (NONE, NONE, NONE);
        let last = self.terms - 1;
        if last == 0 {
            return;
        }
        let add = |sum: &mut Series, factor: f64, a: &Series, degree: usize, b: &Series| {
            taylor::add_product(sum, factor, &a[..=degree.min(last - 1)], &b[..last]);
        };
        for (index, side) in [&system.rotor, &system.stator].into_iter().enumerate() {
            let driving = &self.outside.sides[index];
            for i in 0..side.shafts() {
                let rate = &self.state[side.twists + 2 * i + 1];
                taylor::add_square(&mut loss, side.damping[i], &rate[..last]);
            }
            for (i, &viscous) in side.viscous.iter().enumerate() {
                if viscous != 0.0 {
                    taylor::add_square(&mut loss, viscous, &self.speed(side, index, i)[..last]);
                }
            }
            if let Some(on) = side.torque_on {
                add(
                    &mut work,
                    1.0,
                    &driving.torque,
                    driving.torque_degree,
                    &self.speed(side, index, on),
                );
            }
            if let (None, Some(degree)) = (side.speed, driving.speed_degree) {
                match side.shafts() {
                    0 => add(&mut work, side.sign, &driving.speed, degree, &self.interface),
                    shafts => {
                        let held = std::array::from_fn(|n| shaft_torque(side, &self.state, shafts, n));
                        add(&mut work, side.sign, &driving.speed, degree, &held);
                    }
                }
            }
        }
        if matches!(location.mode, Mode::SlipForward | Mode::SlipBackward | Mode::Engaged) {
            add(&mut friction, 1.0, &self.interface, last, &self.relative_velocity);
        }
        let at = system.slip;
        for n in 0..last {
            let step = self.unit * RECIPROCALS[n + 1];
            self.state[at][n + 1] = if stuck { 0.0 } else { step * self.relative_velocity[n] };
            self.state[at + FRICTION_LOSS][n + 1] = step * friction[n];
            self.state[at + DAMPING_LOSS][n + 1] = step * loss[n];
            self.state[at + WORK][n + 1] = step * work[n];
        }
        if let (Some(index), true) = (system.stator.speed, system.dimension > at + ANGLE) {
            for n in 0..last {
                self.state[at + ANGLE][n + 1] = self.unit * RECIPROCALS[n + 1] * self.state[index][n];
            }
        }
    }

    /// Coefficient `n` of the torque on the surface of one side (rotor 0, stator 1), but for that of the interface, N m.
    #[inline]
    fn surface_torque(&self, side: &Side, index: usize, n: usize) -> f64 {
        let Some(&viscous) = side.viscous.first() else {
            return 0.0;
        };
        let external = if side.torque_on == Some(0) {
            self.outside.sides[index].torque[n]
        } else {
            0.0
        };
        let own = external - viscous * self.speed_at(side, index, 0, n);
        let shaft = if side.shafts() > 0 {
            shaft_torque(side, &self.state, 1, n)
        } else {
            0.0
        };
        side.sign * own + shaft
    }

    /// Coefficient `n` of T_f (N m) and of the acceleration of both surfaces in stick (rad/s^2).
    #[inline]
    fn shared(&self, system: &TrainSystem, n: usize) -> (f64, f64) {
        let rotor = self.surface_torque(&system.rotor, 0, n);
        let stator = self.surface_torque(&system.stator, 1, n);
        let [a, b] = &self.outside.sides;
        let (a, b) = (a.acceleration[n], b.acceleration[n]);
        (system.shared(rotor, stator, a, b), system.joined(rotor, stator, a, b))
    }

    /// Coefficient `n` of the speed of inertia `i`, rad/s.
    fn speed_at(&self, side: &Side, index: usize, i: usize, n: usize) -> f64 {
        let base = side
            .speed
            .map_or(self.outside.sides[index].speed[n], |at| self.state[at][n]);
        let shafts = (i..side.shafts()).rev();
        shafts.fold(base, |speed, i| {
            speed - side.sign * self.state[side.twists + 2 * i + 1][n]
        })
    }

    /// Speed of inertia `i`, rad/s, of the rotor (0) or the stator (1).
    pub fn speed(&self, side: &Side, index: usize, i: usize) -> Series {
        std::array::from_fn(|n| self.speed_at(side, index, i, n))
    }

    /// The longest time of at most `longest` (s) over which friction may be taken from its Taylor coefficients.
    pub fn within_law(&self, system: &TrainSystem, location: &TrainLocation, longest: f64) -> f64 {
        if matches!(location.mode, Mode::Stick | Mode::Separated) {
            return longest;
        }
        let w = &self.relative_velocity;
        let x = longest / self.unit;
        // The terms, all taken as positive, bound its change: by powers of x^4, in four sums.
        let (fours, rest) = w[1..self.terms].as_chunks::<4>();
        let mut sums = [0.0; 4];
        for (sum, c) in sums.iter_mut().zip(rest) {
            *sum = c.abs();
        }
        let x4 = (x * x) * (x * x);
        for four in fours.iter().rev() {
            for (sum, c) in sums.iter_mut().zip(four) {
                *sum = *sum * x4 + c.abs();
            }
        }
        let change = sums.iter().rev().fold(0.0, |all, sum| (all + sum) * x);
        longest * system.expandable_share(location.piece, w[0], change)
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
        let mut series = NONE;
        for (n, c) in series[..self.terms].iter_mut().enumerate() {
            *c = self.shared(system, n).0;
        }
        series
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
    pub fn tested(&self, system: &TrainSystem) -> Series {
        let of = |side: &Side, index: usize| std::array::from_fn(|n| self.surface_torque(side, index, n));
        match system.breakaway_test {
            BreakawayTest::Transmitted => self.interface,
            BreakawayTest::Rotor => of(&system.rotor, 0),
            BreakawayTest::Stator => of(&system.stator, 1),
        }
    }

    /// The state at the time `x` units after the start.
    pub fn at(&self, x: f64, out: &mut [f64]) {
        // Four series at once: each sum alone would wait for itself.
        let (fours, rest) = self.state.as_chunks::<4>();
        let (values, others) = out.as_chunks_mut::<4>();
        for (values, four) in values.iter_mut().zip(fours) {
            let mut sums = [0.0; 4];
            for n in (0..self.terms).rev() {
                for (sum, series) in sums.iter_mut().zip(four) {
                    *sum = *sum * x + series[n];
                }
            }
            *values = sums;
        }
        for (value, series) in others.iter_mut().zip(rest) {
            *value = taylor::value(&series[..self.terms], &x);
        }
    }
}

/// Coefficient `n` of the torque of the shaft inside inertia `i`, N m.
#[inline]
fn shaft_torque(side: &Side, state: &[Series], i: usize, n: usize) -> f64 {
    let Some(shaft) = i.checked_sub(1) else { return 0.0 };
    let at = side.twists + 2 * shaft;
    side.stiffness[shaft] * state[at][n] + side.damping[shaft] * state[at + 1][n]
}

/// Series of a contact without stick.
#[derive(Debug, Clone)]
struct Engaged {
    /// mu or g.
    mu: Series,
    /// The smooth function of a regularised contact, and its square or 1 + v^2.
    smooth: Series,
    helper: Series,
    /// Of bristles: 1/g and x z.
    inverse: Series,
    product: Series,
    /// The torque over r F_n.
    coefficient: Series,
}

impl Engaged {
    fn new() -> Engaged {
        Engaged {
            mu: NONE,
            smooth: NONE,
            helper: NONE,
            inverse: NONE,
            product: NONE,
            coefficient: NONE,
        }
    }
}

impl Expansion {
    /// Coefficient `n` of the torque of a contact without stick, N m, and of the rate of its bristles' deflection, when those of
    /// omega_r and of the law up to n are known.
    fn engaged_torque(&mut self, system: &TrainSystem, sense: f64, n: usize) -> [f64; 2] {
        let factors = self.law.factors(&1.0, &1.0);
        let all = &mut self.engaged;
        all.mu[n] = factors.shape * self.law.shape(n) + if n == 0 { factors.constant } else { 0.0 };
        let mut deflection_rate = 0.0;
        all.coefficient[n] = match system.engagement {
            Engagement::StickSlip => sense * all.mu[n],
            Engagement::Regularised(smoothing, speed) => {
                all.smooth[n] = all.smooth_coefficient(n, smoothing, speed, &self.relative_velocity);
                convolved(&all.mu, &all.smooth, n, n)
            }
            Engagement::Bristles(stiffness, damping, viscous, at) => {
                all.inverse[n] = if n == 0 {
                    1.0 / all.mu[0]
                } else {
                    // What is not known yet has no part in it.
                    all.inverse[n] = 0.0;
                    -convolved(&all.mu, &all.inverse, n, n) / all.mu[0]
                };
                let (w, deflection) = (&self.relative_velocity, &self.state[at]);
                all.product[n] = sense * convolved(w, deflection, n, n);
                deflection_rate = w[n] - stiffness * convolved(&all.product, &all.inverse, n, n);
                stiffness * deflection[n] + damping * deflection_rate + viscous * w[n]
            }
        };
        let force = &self.outside.normal_force;
        let torque = system.radius * convolved(force, &all.coefficient, n, self.outside.degree);
        [torque, deflection_rate]
    }
}

impl Engaged {
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
                self.helper[n] = -convolved(&self.smooth, &self.smooth, n, n);
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
