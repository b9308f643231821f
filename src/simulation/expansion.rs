//! The Taylor series of a motion: all coefficients of the state in time, from the start of a step, in any type of [`Number`].
//!
//! The equations of [`SystemEquations`] hold coefficient by coefficient. What drives the system has its own series, the friction
//! law gives its coefficients from those of omega_r ([`LawSeries`]), and the smooth functions of a contact without stick follow
//! from their differential equations: t' = (1 - t^2) v' for tanh, a' = v'/(1 + v^2) for arctan.
//!
//! The number decides what one gets: a run (`f64`), several motions at once (doubles side by side), or a proof (enclosures).
//! Enclosures that round outwards hold the coefficients of the exact motion, and those in `f64`. Coefficients of the equations
//! may be enclosures themselves ([`SystemEquations::map`]). Parameters of the friction law, the time, and the lines and harmonics of
//! the signals are doubles and count as exact; functions of them are evaluated in the number. Step control and roots are no
//! recurrences, and stay in `f64`.
//!
//! ```
//! use stickslip::model::Mode;
//! use stickslip::simulation::expansion::Expansion;
//! use stickslip::simulation::{SystemDynamics, SystemLocation};
//!
//! # fn example(system: &stickslip::model::system::System) {
//! let SystemDynamics { system, excitation, .. } = &SystemDynamics::new(system, 0.0);
//! let mut expansion: Expansion = Expansion::new(system, excitation);
//! let (t, unit, state) = (0.5, 0.1, vec![0.0; system.dimension]);
//! let location = SystemLocation::new(Mode::SlipForward, excitation.stretch(t));
//! expansion.expand((system, excitation), &location, t, &state, unit);
//! let mut later = state;
//! // After 0.05 s.
//! expansion.at(0.5, &mut later);
//! # }
//! ```

mod lanes;

pub(super) use lanes::{Motion, SideBySide};

use super::dynamics::SystemLocation;
use super::excitation::{Excitation, OutsideSeries};
use crate::friction::{Factors, FrictionSeries, Law, LawSeries};
use crate::model::axial::Ringing;
use crate::model::equations::{ANGLE, DAMPING_LOSS, Engagement, FRICTION_LOSS, Side, SystemEquations, WORK};
use crate::model::slow_manifold::SlowSeries;
use crate::model::system::Smoothing;
use crate::model::{BreakawayTest, Mode};
use crate::numerics::Number;
use crate::numerics::taylor::{self, convolved};

/// Coefficients of an expansion: order 27.
pub const TERMS: usize = 28;

/// Coefficients by powers of the time since the start over the unit, lowest first.
pub type Series<T = f64> = [T; TERMS];

/// The expansion of one motion, with room for others of the same system. Components and units of the state are those of
/// [`SystemEquations`]; torques are positive where the contact brakes a rotor that runs ahead of the stator.
#[derive(Debug, Clone)]
pub struct Expansion<T: Number = f64> {
    /// s.
    pub unit: T,
    /// How many coefficients are filled; what is behind them is of another expansion.
    pub terms: usize,
    /// Of every component of the state.
    pub state: Vec<Series<T>>,
    /// omega_r, rad/s.
    pub relative_velocity: Series<T>,
    /// The torque of the interface, N m: T_f in stick.
    pub interface: Series<T>,
    /// mu_0 r F_n, N m, in stick.
    pub limit: Series<T>,
    /// The shape of mu' in slip.
    slope: Series<T>,
    outside: OutsideSeries<T, TERMS>,
    ringing: Option<Ringing<T>>,
    law: FrictionSeries<T, TERMS>,
    /// Which piece of the law that is.
    piece: usize,
    engaged: Engaged<T>,
    /// 1/n; the first is not used.
    reciprocals: Series<T>,
    /// 1/J of the inertias of the rotor and of the stator, 1/(kg m^2), surface first.
    per_inertia: [Vec<T>; 2],
    /// By how much omega_r' falls per torque of the interface, 1/(kg m^2).
    lag: T,
}

/// What acts on a surface, by one coefficient.
struct Surface<T> {
    /// Sum of all else than the interface's torque, in the direction that the interface opposes on the rotor, N m.
    torque: T,
    /// Acceleration of what is beyond the surface's shaft, or of the surface where it is rigid, rad/s^2.
    beyond: T,
}

impl<T: Number> Expansion<T> {
    /// Room for the motions of a system.
    pub fn new(system: &SystemEquations<T>, excitation: &Excitation) -> Self {
        Self::with_law(system, excitation.ringing(), system.law_in(0).series())
    }

    fn with_law(system: &SystemEquations<T>, ringing: Option<Ringing<T>>, law: FrictionSeries<T, TERMS>) -> Self {
        let (none, one) = (taylor::zeros(), T::of(1.0));
        let per_inertia = [&system.rotor, &system.stator].map(|side| side.inertia.iter().map(|j| one / *j).collect());
        let surfaces = per_inertia.iter().filter_map(|side: &Vec<T>| side.first());
        Expansion {
            unit: one,
            terms: TERMS,
            state: vec![none; system.dimension],
            relative_velocity: none,
            interface: none,
            limit: none,
            slope: none,
            outside: OutsideSeries::new(),
            ringing,
            law,
            piece: 0,
            engaged: Engaged::new(),
            reciprocals: std::array::from_fn(|n| one / T::of(n.max(1) as f64)),
            lag: surfaces.fold(T::of(0.0), |sum, per_inertia| sum + *per_inertia),
            per_inertia,
        }
    }

    /// Fills the first [`terms`](Self::terms) coefficients of the motion from `t` (s) on, with the state `y`, by powers of time over
    /// `unit` (s). The system and its signals are those that it was [made](Self::new) for. A unit near the time scale of the
    /// motion keeps the coefficients within the range of a double.
    ///
    /// The motion is that of the location's mode, piece of the law and stretch of the signals, whatever lies beyond their ends.
    pub fn expand(
        &mut self,
        (system, excitation): (&SystemEquations<T>, &Excitation),
        location: &SystemLocation,
        t: f64,
        y: &[T],
        unit: f64,
    ) {
        self.drive((system, excitation), location, t, unit);
        self.expand_driven(system, location, y);
    }

    /// Makes known what drives the motion, and which law it has.
    fn drive(
        &mut self,
        (system, excitation): (&SystemEquations<T>, &Excitation),
        location: &SystemLocation,
        t: f64,
        unit: f64,
    ) {
        self.unit = T::of(unit);
        if self.piece != location.piece {
            self.piece = location.piece;
            self.law = system.law_in(location.piece).series();
        }
        excitation.series(self.ringing.as_ref(), location.stretch, t, unit, &mut self.outside);
    }

    /// Fills the coefficients of the motion, once what drives it is known.
    #[inline(always)]
    fn expand_driven(&mut self, system: &SystemEquations<T>, location: &SystemLocation, y: &[T]) {
        for (series, &start) in self.state.iter_mut().zip(y) {
            series[0] = start;
        }
        self.relative_velocity[0] = system.relative_velocity(&self.outside.coefficient(0), y);
        match location.mode {
            Mode::Stick => self.stick(system),
            Mode::Separated => self.move_apart(
                system,
                #[inline(always)]
                |_, _, _| [T::of(0.0); 2],
            ),
            Mode::Engaged => {
                let sense = location.sign();
                self.start_law(sense, T::of(1.0));
                self.move_apart(
                    system,
                    #[inline(always)]
                    |all, n, rate| {
                        all.extend_law(n, rate);
                        all.engaged_torque(system, sense, n)
                    },
                );
            }
            Mode::SlipForward | Mode::SlipBackward => {
                let factors = self.start_law(location.sign(), system.radius.times(location.sign()));
                let degree = self.outside.degree;
                self.move_apart(
                    system,
                    #[inline(always)]
                    |all, n, rate| {
                        all.extend_law(n, rate);
                        let force = &all.outside.normal_force;
                        let pressed = all.law.pressed(force, n, degree);
                        [factors.constant * force[n] + factors.shape * pressed, T::of(0.0)]
                    },
                );
                self.note_slope();
            }
        }
        self.quadratures(system, location);
    }

    /// Makes the law known at the start, and gives its factors times `of_coefficient`.
    #[inline(always)]
    fn start_law(&mut self, sense: f64, of_coefficient: T) -> Factors<T> {
        let (speed, unit) = (self.relative_velocity[0].times(sense), self.unit.times(sense));
        self.law.start(speed, unit);
        self.law.factors(of_coefficient, of_coefficient)
    }

    /// Takes the shape of mu' from the law.
    #[inline(always)]
    fn note_slope(&mut self) {
        for (n, c) in self.slope.iter_mut().enumerate() {
            *c = self.law.slope_shape(n);
        }
    }

    /// Coefficient `n` of the law from coefficient `n` - 1 of omega_r' (rad/s^2); that at 0 is known.
    #[inline(always)]
    fn extend_law(&mut self, n: usize, acceleration: T) {
        if n > 0 {
            self.law.extend(n, acceleration, self.reciprocals[n]);
        }
    }

    /// All coefficients while the surfaces may move against each other. `contact` gives, from coefficient n - 1 of omega_r'
    /// (rad/s^2), when those of the state up to n are known, coefficient n of the interface's torque (N m) and of the rate of
    /// the bristles' deflection.
    #[inline(always)]
    fn move_apart(&mut self, system: &SystemEquations<T>, contact: impl Fn(&mut Self, usize, T) -> [T; 2]) {
        let mut acceleration = T::of(0.0);
        for n in 0..self.terms {
            let [torque, deflection_rate] = contact(self, n, acceleration);
            self.interface[n] = torque;
            if n + 1 == self.terms {
                break;
            }
            let step = self.step(n);
            let rotor = self.extend_free(&system.rotor, 0, n, step, torque);
            let stator = self.extend_free(&system.stator, 1, n, step, torque);
            acceleration = (rotor - stator) - self.lag * torque;
            self.relative_velocity[n + 1] = step * acceleration;
            if let Engagement::Bristles(.., at) = system.engagement {
                self.state[at][n + 1] = step * deflection_rate;
            }
        }
    }

    /// What the rate's coefficient `n` is multiplied by to be coefficient `n` + 1, s.
    #[inline(always)]
    fn step(&self, n: usize) -> T {
        self.reciprocals[n + 1] * self.unit
    }

    /// All coefficients while the surfaces stick to each other.
    #[inline(always)]
    fn stick(&mut self, system: &SystemEquations<T>) {
        self.relative_velocity = taylor::zeros();
        for n in 0..self.terms {
            let (torque, joined) = self.shared(system, n);
            self.interface[n] = torque;
            self.limit[n] = system.breakaway_torque(self.outside.normal_force[n]);
            if n + 1 == self.terms {
                break;
            }
            let step = self.step(n);
            for (index, side) in [&system.rotor, &system.stator].into_iter().enumerate() {
                let surface = self.extend(side, index, n, step);
                self.extend_surface(side, n, step, joined, surface.beyond);
            }
        }
    }

    /// Coefficient `n` + 1 of the states of one side (rotor 0, stator 1) from those up to `n` and the interface's torque (N m).
    /// Returns the acceleration of the surface without that torque, rad/s^2.
    #[inline(always)]
    fn extend_free(&mut self, side: &Side<T>, index: usize, n: usize, step: T, torque: T) -> T {
        let surface = self.extend(side, index, n, step);
        let Some(per_inertia) = self.per_inertia[index].first() else {
            return surface.beyond;
        };
        let per_inertia = per_inertia.times(side.sign);
        let free = surface.torque * per_inertia;
        self.extend_surface(side, n, step, free - torque * per_inertia, surface.beyond);
        free
    }

    /// Coefficient `n` + 1 of the states of one side (rotor 0, stator 1) from those up to `n`, but for the one that the
    /// acceleration of its surface enters.
    #[inline(always)]
    fn extend(&mut self, side: &Side<T>, index: usize, n: usize, step: T) -> Surface<T> {
        let (state, driving) = (&mut self.state[..], &self.outside.sides[index]);
        let (inertias, shafts) = (side.inertia.len(), side.shafts());
        let mut beyond = driving.acceleration[n];
        let mut speed = side.speed.map_or(driving.speed[n], |at| state[at][n]);
        let mut outside = if shafts == inertias {
            shaft_torque(side, state, shafts, n)
        } else {
            T::of(0.0)
        };
        for i in (0..inertias).rev() {
            let at = side.twists + 2 * i;
            if i < shafts {
                let rate = state[at + 1][n];
                state[at][n + 1] = step * rate;
                speed = speed - rate.times(side.sign);
            }
            let external = if side.takes_torque[i] {
                driving.torque[n]
            } else {
                T::of(0.0)
            };
            let own = external - side.viscous[i] * speed;
            if i == 0 {
                let torque = own.times(side.sign) + outside;
                return Surface { torque, beyond };
            }
            let inside = shaft_torque(side, state, i, n);
            let acceleration = ((outside - inside).times(side.sign) + own) * self.per_inertia[index][i];
            if i < shafts {
                state[at + 1][n + 1] = step.times(side.sign) * (beyond - acceleration);
            } else if let Some(at) = side.speed {
                state[at][n + 1] = step * acceleration;
            }
            (outside, beyond) = (inside, acceleration);
        }
        Surface {
            torque: T::of(0.0),
            beyond,
        }
    }

    /// Coefficient `n` + 1 of the state that the acceleration of a surface (rad/s^2) enters.
    #[inline(always)]
    fn extend_surface(&mut self, side: &Side<T>, n: usize, step: T, acceleration: T, beyond: T) {
        if side.shafts() > 0 {
            self.state[side.twists + 1][n + 1] = step.times(side.sign) * (beyond - acceleration);
        } else if let Some(at) = side.speed {
            self.state[at][n + 1] = step * acceleration;
        }
    }

    #[inline(always)]
    fn quadratures(&mut self, system: &SystemEquations<T>, location: &SystemLocation) {
        let stuck = location.mode == Mode::Stick;
        let [mut loss, mut work, mut friction] = [taylor::zeros(); 3];
        let one = T::of(1.0);
        let last = self.terms - 1;
        if last == 0 {
            return;
        }
        for (index, side) in [&system.rotor, &system.stator].into_iter().enumerate() {
            let driving = &self.outside.sides[index];
            for i in 0..side.shafts() {
                let rate = &self.state[side.twists + 2 * i + 1];
                taylor::add_square(&mut loss, side.damping[i], &rate[..last]);
            }
            if side.viscous.iter().any(|viscous| *viscous != T::of(0.0)) {
                // From the outermost inertia inwards, each speed from the one before.
                let mut speed = side.speed.map_or(driving.speed, |at| self.state[at]);
                for (i, &viscous) in side.viscous.iter().enumerate().rev() {
                    if i < side.shafts() {
                        let rate = &self.state[side.twists + 2 * i + 1];
                        for (speed, rate) in speed.iter_mut().zip(rate) {
                            *speed = *speed - rate.times(side.sign);
                        }
                    }
                    taylor::add_square(&mut loss, viscous, &speed[..last]);
                }
            }
            if let Some(on) = side.torque_on {
                add_product(
                    last,
                    &mut work,
                    one,
                    &driving.torque,
                    driving.torque_degree,
                    &self.speed(side, index, on),
                );
            }
            if let (None, Some(degree)) = (side.speed, driving.speed_degree) {
                match side.shafts() {
                    0 => add_product(
                        last,
                        &mut work,
                        T::of(side.sign),
                        &driving.speed,
                        degree,
                        &self.interface,
                    ),
                    shafts => {
                        let held = std::array::from_fn(|n| shaft_torque(side, &self.state, shafts, n));
                        add_product(last, &mut work, T::of(side.sign), &driving.speed, degree, &held);
                    }
                }
            }
        }
        if matches!(location.mode, Mode::SlipForward | Mode::SlipBackward | Mode::Engaged) {
            add_product(last, &mut friction, one, &self.interface, last, &self.relative_velocity);
        }
        let at = system.slip;
        for n in 0..last {
            let step = self.step(n);
            self.state[at][n + 1] = if stuck {
                T::of(0.0)
            } else {
                step * self.relative_velocity[n]
            };
            self.state[at + FRICTION_LOSS][n + 1] = step * friction[n];
            self.state[at + DAMPING_LOSS][n + 1] = step * loss[n];
            self.state[at + WORK][n + 1] = step * work[n];
        }
        if let (Some(index), true) = (system.stator.speed, system.dimension > at + ANGLE) {
            for n in 0..last {
                self.state[at + ANGLE][n + 1] = self.step(n) * self.state[index][n];
            }
        }
    }

    /// Coefficient `n` of the torque on the surface of one side (rotor 0, stator 1), but for that of the interface, N m.
    #[inline(always)]
    fn surface_torque(&self, side: &Side<T>, index: usize, n: usize) -> T {
        let Some(&viscous) = side.viscous.first() else {
            return T::of(0.0);
        };
        let external = if side.takes_torque[0] {
            self.outside.sides[index].torque[n]
        } else {
            T::of(0.0)
        };
        let own = external - viscous * self.speed_at(side, index, 0, n);
        let shaft = if side.shafts() > 0 {
            shaft_torque(side, &self.state, 1, n)
        } else {
            T::of(0.0)
        };
        own.times(side.sign) + shaft
    }

    /// Coefficient `n` of T_f (N m) and of the acceleration of both surfaces in stick (rad/s^2).
    #[inline(always)]
    fn shared(&self, system: &SystemEquations<T>, n: usize) -> (T, T) {
        let rotor = self.surface_torque(&system.rotor, 0, n);
        let stator = self.surface_torque(&system.stator, 1, n);
        let [a, b] = &self.outside.sides;
        let (a, b) = (a.acceleration[n], b.acceleration[n]);
        (system.shared(rotor, stator, a, b), system.joined(rotor, stator, a, b))
    }

    /// Coefficient `n` of the speed of inertia `i`, rad/s.
    #[inline(always)]
    fn speed_at(&self, side: &Side<T>, index: usize, i: usize, n: usize) -> T {
        let base = side
            .speed
            .map_or(self.outside.sides[index].speed[n], |at| self.state[at][n]);
        let shafts = (i..side.shafts()).rev();
        shafts.fold(base, |speed, i| {
            speed - self.state[side.twists + 2 * i + 1][n].times(side.sign)
        })
    }

    /// Speed of inertia `i`, rad/s, of the rotor (0) or the stator (1).
    #[inline(always)]
    pub(super) fn speed(&self, side: &Side<T>, index: usize, i: usize) -> Series<T> {
        std::array::from_fn(|n| self.speed_at(side, index, i, n))
    }

    /// Speed of the far end, rad/s, of the rotor (0) or the stator (1).
    pub(super) fn end_speed(&self, side: usize) -> &Series<T> {
        &self.outside.sides[side].speed
    }

    /// F_n, N, without the clamp at zero.
    pub fn normal_force(&self) -> &Series<T> {
        &self.outside.normal_force
    }

    /// T_f, N m, in any mode.
    pub fn transmitted(&self, system: &SystemEquations<T>) -> Series<T> {
        let mut series = taylor::zeros();
        for (n, c) in series[..self.terms].iter_mut().enumerate() {
            *c = self.shared(system, n).0;
        }
        series
    }

    /// The margin of steady sliding of an expanded slip, N m s/rad; `None` where there is none.
    pub fn stability_margin(&self, system: &SystemEquations<T>) -> Option<Series<T>> {
        let twice_resistance = system.twice_resistance?;
        let factors = self.law.factors(T::of(1.0), system.slope_weight(T::of(1.0)));
        let slope = self.slope.map(|c| factors.slope * c);
        let mut margin = taylor::product(&self.outside.normal_force, &slope);
        margin[0] = margin[0] + twice_resistance;
        Some(margin)
    }

    /// The torque that the breakaway test holds against the limit, N m, in stick.
    pub fn tested(&self, system: &SystemEquations<T>) -> Series<T> {
        let of = |side: &Side<T>, index: usize| std::array::from_fn(|n| self.surface_torque(side, index, n));
        match system.breakaway_test {
            BreakawayTest::Transmitted => self.interface,
            BreakawayTest::Rotor => of(&system.rotor, 0),
            BreakawayTest::Stator => of(&system.stator, 1),
        }
    }

    /// The state at the time `x` units after the start.
    pub fn at(&self, x: f64, out: &mut [T]) {
        let x = T::of(x);
        // Four series at once: each sum alone would wait for itself.
        let (fours, rest) = self.state.as_chunks::<4>();
        let (values, others) = out.as_chunks_mut::<4>();
        for (values, four) in values.iter_mut().zip(fours) {
            let mut sums = taylor::zeros::<T, 4>();
            for n in (0..self.terms).rev() {
                for (sum, series) in sums.iter_mut().zip(four) {
                    *sum = *sum * x + series[n];
                }
            }
            *values = sums;
        }
        for (value, series) in others.iter_mut().zip(rest) {
            *value = taylor::value(&series[..self.terms], x);
        }
    }
}

/// Adds `factor` a b, where `a` is zero beyond its degree, to the first `terms` coefficients.
#[inline(always)]
fn add_product<T: Number>(terms: usize, sum: &mut Series<T>, factor: T, a: &Series<T>, degree: usize, b: &Series<T>) {
    taylor::add_product(sum, factor, &a[..=degree.min(terms - 1)], &b[..terms]);
}

/// Coefficient `n` of the torque of the shaft inside inertia `i`, N m.
#[inline(always)]
fn shaft_torque<T: Number>(side: &Side<T>, state: &[Series<T>], i: usize, n: usize) -> T {
    let Some(shaft) = i.checked_sub(1) else {
        return T::of(0.0);
    };
    let at = side.twists + 2 * shaft;
    side.stiffness[shaft] * state[at][n] + side.damping[shaft] * state[at + 1][n]
}

/// The sum of terms, in their order.
#[inline(always)]
fn sum<T: Number>(terms: impl Iterator<Item = T>) -> T {
    let mut sum = T::of(0.0);
    for term in terms {
        sum = sum + term;
    }
    sum
}

/// Series of a contact without stick.
#[derive(Debug, Clone)]
struct Engaged<T> {
    /// mu or g.
    mu: Series<T>,
    /// The smooth function of a regularised contact, and its square or 1 + v^2.
    smooth: Series<T>,
    helper: Series<T>,
    /// Of bristles: 1/g and x z.
    inverse: Series<T>,
    product: Series<T>,
    /// The torque over r F_n.
    coefficient: Series<T>,
}

impl<T: Number> Engaged<T> {
    fn new() -> Self {
        let none = taylor::zeros();
        Engaged {
            mu: none,
            smooth: none,
            helper: none,
            inverse: none,
            product: none,
            coefficient: none,
        }
    }
}

impl<T: Number> Expansion<T> {
    /// Coefficient `n` of the torque of a contact without stick, N m, and of the rate of its bristles' deflection, when those of
    /// omega_r and of the law up to n are known.
    #[inline(always)]
    fn engaged_torque(&mut self, system: &SystemEquations<T>, sense: f64, n: usize) -> [T; 2] {
        let [zero, one] = [0.0, 1.0].map(T::of);
        let factors = self.law.factors(one, one);
        let all = &mut self.engaged;
        all.mu[n] = factors.shape * self.law.shape(n) + if n == 0 { factors.constant } else { zero };
        let mut deflection_rate = zero;
        all.coefficient[n] = match system.engagement {
            Engagement::StickSlip => all.mu[n].times(sense),
            Engagement::Regularised(smoothing, speed) => {
                all.smooth[n] = all.smooth_coefficient(n, smoothing, speed, &self.relative_velocity);
                convolved(&all.mu, &all.smooth, n, n)
            }
            Engagement::Bristles(stiffness, damping, viscous, at) => {
                all.inverse[n] = if n == 0 {
                    one / all.mu[0]
                } else {
                    // What is not known yet has no part in it.
                    all.inverse[n] = zero;
                    -convolved(&all.mu, &all.inverse, n, n) / all.mu[0]
                };
                let (w, deflection) = (&self.relative_velocity, &self.state[at]);
                all.product[n] = convolved(w, deflection, n, n).times(sense);
                deflection_rate = w[n] - stiffness * convolved(&all.product, &all.inverse, n, n);
                stiffness * deflection[n] + damping * deflection_rate + viscous * w[n]
            }
        };
        let force = &self.outside.normal_force;
        let torque = system.radius * convolved(force, &all.coefficient, n, self.outside.degree);
        [torque, deflection_rate]
    }
}

impl<T: Number> Engaged<T> {
    /// Coefficient `n` of tanh(v) or (2/pi) arctan(v), v = omega_r/eps.
    #[inline(always)]
    fn smooth_coefficient(&mut self, n: usize, smoothing: Smoothing, speed: T, relative_velocity: &Series<T>) -> T {
        let v = |k: usize| relative_velocity[k] / speed;
        let order = |k: usize| T::of(k as f64);
        match smoothing {
            Smoothing::Tanh => {
                // helper = 1 - t^2
                if n == 0 {
                    let (value, cosh) = (v(0).tanh(), v(0).cosh());
                    self.smooth[0] = value;
                    self.helper[0] = T::of(1.0) / (cosh * cosh);
                    return value;
                }
                let sum = sum((1..=n).map(|k| order(k) * v(k) * self.helper[n - k]));
                let value = sum / order(n);
                self.smooth[n] = value;
                self.helper[n] = -convolved(&self.smooth, &self.smooth, n, n);
                value
            }
            Smoothing::Arctan => {
                // helper = 1 + v^2; smooth holds (2/pi) a
                let share = T::of(2.0) / T::pi();
                let square = sum((0..=n).map(|k| v(k) * v(n - k)));
                if n == 0 {
                    self.helper[0] = T::of(1.0) + square;
                    return share * v(0).atan();
                }
                self.helper[n] = square;
                let sum = sum((1..n).map(|k| order(k) * self.smooth[k] * self.helper[n - k]));
                (share * order(n) * v(n) - sum) / (order(n) * self.helper[0])
            }
        }
    }
}

/// What only a run in doubles needs.
impl Expansion {
    /// Takes the motion along the slow manifold, from the quadratures of `y` on, for the one that it holds; by powers of time in
    /// s. Nothing drives the system.
    pub(super) fn follow(
        &mut self,
        system: &SystemEquations,
        location: &SystemLocation,
        slow: &SlowSeries<TERMS>,
        y: &[f64],
    ) {
        self.unit = 1.0;
        slow.states(system, |index, series| self.state[index] = *series);
        for (series, &start) in self.state.iter_mut().zip(y).skip(system.mechanical()) {
            series[0] = start;
        }
        self.relative_velocity = slow.relative_velocity();
        self.interface = slow.torque;
        self.law = slow.friction.clone();
        self.piece = location.piece;
        self.note_slope();
        self.quadratures(system, location);
    }

    /// F_n about `t` (s) by powers of time in s, up to its degree. What is held of a motion is void after that.
    pub(super) fn pressing(&mut self, excitation: &Excitation, location: &SystemLocation, t: f64) -> &[f64] {
        excitation.series(self.ringing.as_ref(), location.stretch, t, 1.0, &mut self.outside);
        &self.outside.normal_force[..=self.outside.degree]
    }

    /// The longest time of at most `longest` (s) over which friction may be taken from its Taylor coefficients.
    pub(super) fn within_law(&self, system: &SystemEquations, location: &SystemLocation, longest: f64) -> f64 {
        if !location.mode.slides() {
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
}
