//! Taylor series of a motion: all coefficients of the state in time, from the start of a step, in any type of
//! [`Number`].
//!
//! The equations of [`SystemEquations`] hold coefficient by coefficient. Drives have their own series, the friction law
//! gives its coefficients from those of omega_r ([`LawSeries`]), and the smooth functions of a contact without stick
//! follow from differential equations: t' = (1 - t^2) v' for tanh, a' = v'/(1 + v^2) for arctan.
//!
//! The number type makes a run (`f64`) or a proof (enclosures that round outwards, and hold the coefficients of the
//! exact motion). Coefficients of the equations may be enclosures ([`SystemEquations::map`]). Parameters of the
//! friction law, the time, and the signals' lines and harmonics are exact doubles. Step control and roots stay in
//! `f64`.
//!
//! ```
//! use stickslip_system::model::Mode;
//! use stickslip_engine::simulation::expansion::Expansion;
//! use stickslip_engine::simulation::{SystemDynamics, SystemLocation};
//!
//! # fn example(system: &stickslip_system::model::system::System) {
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

use crate::hybrid::dynamics::SystemLocation;
use crate::hybrid::excitation::{Excitation, OutsideSeries};
use stickslip_system::friction::{Factors, FrictionSeries, Law, LawSeries};
use stickslip_system::model::axial::Ringing;
use stickslip_system::model::equations::{ANGLE, DAMPING_LOSS, Engagement, FRICTION_LOSS, Side, SystemEquations, WORK};
use stickslip_system::model::slow_manifold::SlowSeries;
use stickslip_system::model::system::Smoothing;
use stickslip_system::model::{BreakawayTest, Mode};
use stickslip_system::numerics::Number;
use stickslip_system::numerics::taylor::{self, convolved};

/// Coefficients of an expansion: order 27.
pub const TERMS: usize = 28;

/// Coefficients by powers of (time since the start)/unit, lowest first.
pub type Series<T = f64> = [T; TERMS];

/// Expansion of one motion, reusable for other motions of the same system. Components and units are those of
/// [`SystemEquations`]. Torques are positive if the contact brakes a rotor that is faster than the stator.
#[derive(Debug, Clone)]
pub struct Expansion<T: Number = f64> {
    /// Unit of time, s.
    pub unit: f64,
    /// Number of valid coefficients.
    pub terms: usize,
    /// Components of the state.
    pub state: Vec<Series<T>>,
    /// omega_r, rad/s: speed of the rotor's surface relative to the stator's.
    pub relative_velocity: Series<T>,
    /// Torque of the interface, N m: T_f in stick.
    pub interface: Series<T>,
    outside: OutsideSeries<T, TERMS>,
    ringing: Option<Ringing<T>>,
    law: FrictionSeries<T, TERMS>,
    /// Whether the law is that of backward sliding alone, and its piece.
    place: (bool, usize),
    engaged: EngagedContact<T>,
    /// 1/n; index 0 is unused.
    reciprocals: Series<T>,
    /// 1/J of rotor and stator, 1/(kg m^2), surface first.
    per_inertia: [Vec<T>; 2],
    /// Decrease of omega_r' per torque of the interface, 1/(kg m^2).
    lag: T,
}

struct SurfaceExpansion<T> {
    /// Torque on the surface without the interface's, N m, positive if the interface opposes it on the rotor.
    torque: T,
    /// Acceleration of the body beyond the surface's shaft, or of the rigid surface, rad/s^2.
    beyond: T,
}

impl<T: Number> Expansion<T> {
    /// An expansion for motions of a system.
    pub fn new(system: &SystemEquations<T>, excitation: &Excitation) -> Self {
        let (none, one) = (taylor::zeros(), T::of(1.0));
        let per_inertia = [&system.rotor, &system.stator].map(|side| side.inertia.iter().map(|j| one / *j).collect());
        let surfaces = per_inertia.iter().filter_map(|side: &Vec<T>| side.first());
        Expansion {
            unit: 1.0,
            terms: TERMS,
            state: vec![none; system.dimension],
            relative_velocity: none,
            interface: none,
            outside: OutsideSeries::new(),
            ringing: excitation.ringing(),
            law: system.law_in(1.0, 0).series(),
            place: (false, 0),
            engaged: EngagedContact::new(),
            reciprocals: std::array::from_fn(|n| one / T::of(n.max(1) as f64)),
            lag: surfaces.fold(T::of(0.0), |sum, per_inertia| sum + *per_inertia),
            per_inertia,
        }
    }

    /// Fills the first [`terms`](Self::terms) coefficients of the motion from `t` (s) and the state `y`, by powers of
    /// time over `unit` (s), for the system and signals of [`Self::new`]. A unit near the time scale of the motion
    /// keeps the coefficients in the range of a double. The location's mode, piece and stretch are used even beyond
    /// their ends.
    pub fn expand(
        &mut self,
        (system, excitation): (&SystemEquations<T>, &Excitation),
        location: &SystemLocation,
        t: f64,
        y: &[T],
        unit: f64,
    ) {
        self.unit = unit;
        let place = place(system, location);
        if self.place != place {
            self.place = place;
            self.law = system.law_in(location.sign(), location.piece).series();
        }
        excitation.series(self.ringing.as_ref(), location.stretch, t, unit, &mut self.outside);
        for (series, &start) in self.state.iter_mut().zip(y) {
            series[0] = start;
        }
        self.relative_velocity[0] = system.relative_velocity(&self.outside.coefficient(0), y);
        match location.mode {
            Mode::Stick => self.stick(system),
            Mode::Separated => self.move_apart(system, |_, _, _| [T::of(0.0); 2]),
            Mode::Engaged => {
                let sense = location.sign();
                self.start_law(sense, T::of(1.0));
                self.move_apart(system, |all, n, rate| {
                    all.extend_law(n, rate);
                    all.engaged_torque(system, sense, n)
                });
            }
            Mode::SlipForward | Mode::SlipBackward => {
                let factors = self.start_law(location.sign(), system.radius.times(location.sign()));
                let degree = self.outside.degree;
                self.move_apart(system, |all, n, rate| {
                    all.extend_law(n, rate);
                    let force = &all.outside.normal_force;
                    let pressed = all.law.pressed(force, n, degree);
                    [factors.constant * force[n] + factors.shape * pressed, T::of(0.0)]
                });
            }
        }
        self.quadratures(system, location);
    }

    #[inline(always)]
    fn start_law(&mut self, sense: f64, of_coefficient: T) -> Factors<T> {
        let (speed, unit) = (self.relative_velocity[0].times(sense), T::of(sense * self.unit));
        self.law.start(speed, unit);
        self.law.factors(of_coefficient, of_coefficient)
    }

    #[inline(always)]
    fn extend_law(&mut self, n: usize, acceleration: T) {
        if n > 0 {
            self.law.extend(n, acceleration, self.reciprocals[n]);
        }
    }

    /// All coefficients while the surfaces can slide. `contact` maps coefficient n - 1 of omega_r' (rad/s^2), with the
    /// state known up to n, to coefficient n of the interface torque (N m) and of the bristles' deflection rate.
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

    #[inline(always)]
    fn step(&self, n: usize) -> T {
        self.reciprocals[n + 1].times(self.unit)
    }

    #[inline(always)]
    fn stick(&mut self, system: &SystemEquations<T>) {
        self.relative_velocity = taylor::zeros();
        for n in 0..self.terms {
            let (torque, joined) = self.shared(system, n);
            self.interface[n] = torque;
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

    /// Coefficient `n` + 1 of the states of one side (rotor 0, stator 1) from those up to `n` and the interface torque
    /// (N m). Returns the surface's acceleration without this torque, rad/s^2.
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

    /// Coefficient `n` + 1 of the states of one side (rotor 0, stator 1), except the state that the surface
    /// accelerates.
    #[inline(always)]
    fn extend(&mut self, side: &Side<T>, index: usize, n: usize, step: T) -> SurfaceExpansion<T> {
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
                return SurfaceExpansion { torque, beyond };
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
        SurfaceExpansion {
            torque: T::of(0.0),
            beyond,
        }
    }

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
        let add = |sum: &mut Series<T>, factor: T, a: &Series<T>, degree: usize, b: &Series<T>| {
            taylor::add_product(sum, factor, &a[..=degree.min(last - 1)], &b[..last]);
        };
        for (index, side) in [&system.rotor, &system.stator].into_iter().enumerate() {
            let driving = &self.outside.sides[index];
            for i in 0..side.shafts() {
                let rate = &self.state[side.twists + 2 * i + 1];
                taylor::add_square(&mut loss, side.damping[i], &rate[..last]);
            }
            if side.viscous.iter().any(|viscous| *viscous != T::of(0.0)) {
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
                add(
                    &mut work,
                    one,
                    &driving.torque,
                    driving.torque_degree,
                    &self.speed(side, index, on),
                );
            }
            if let (None, Some(degree)) = (side.speed, driving.speed_degree) {
                match side.shafts() {
                    0 => add(&mut work, T::of(side.sign), &driving.speed, degree, &self.interface),
                    shafts => {
                        let held = std::array::from_fn(|n| shaft_torque(side, &self.state, shafts, n));
                        add(&mut work, T::of(side.sign), &driving.speed, degree, &held);
                    }
                }
            }
        }
        if matches!(location.mode, Mode::SlipForward | Mode::SlipBackward | Mode::Engaged) {
            add(&mut friction, one, &self.interface, last, &self.relative_velocity);
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

    /// Coefficient `n` of the torque on a side's surface without the interface's, N m.
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

    /// Coefficient `n` of T_f (N m) and of the common acceleration in stick (rad/s^2).
    #[inline(always)]
    fn shared(&self, system: &SystemEquations<T>, n: usize) -> (T, T) {
        let rotor = self.surface_torque(&system.rotor, 0, n);
        let stator = self.surface_torque(&system.stator, 1, n);
        let [a, b] = &self.outside.sides;
        let (a, b) = (a.acceleration[n], b.acceleration[n]);
        (system.shared(rotor, stator, a, b), system.joined(rotor, stator, a, b))
    }

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

    #[inline(always)]
    pub(super) fn speed(&self, side: &Side<T>, index: usize, i: usize) -> Series<T> {
        std::array::from_fn(|n| self.speed_at(side, index, i, n))
    }

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

    /// [`SystemEquations::stability_guard`] of an expanded slip.
    pub fn stability_guard(&self, system: &SystemEquations<T>) -> Option<Series<T>> {
        let twice_resistance = system.twice_resistance?;
        let undamped = twice_resistance == T::of(0.0);
        if undamped && system.law.only_falls() {
            let mut constant = taylor::zeros();
            constant[0] = T::of(-1.0);
            return Some(constant);
        }
        let factors = self.law.factors(T::of(1.0), system.slope_weight(T::of(1.0)));
        let slope = std::array::from_fn(|n| factors.slope * self.law.slope_shape(n));
        if undamped {
            return Some(slope);
        }
        let mut margin = taylor::product(&self.outside.normal_force, &slope);
        margin[0] = margin[0] + twice_resistance;
        Some(margin)
    }

    /// mu_0 r F_n, N m, into sliding in the sense of the sign of `sense`.
    pub fn limit(&self, system: &SystemEquations<T>, sense: f64) -> Series<T> {
        let mut series = taylor::zeros();
        for (c, force) in series[..self.terms].iter_mut().zip(&self.outside.normal_force) {
            *c = system.breakaway_torque(sense, *force);
        }
        series
    }

    /// Torque that the breakaway test compares with [`Self::limit`], N m, in stick.
    pub fn tested(&self, system: &SystemEquations<T>) -> Series<T> {
        let of = |side: &Side<T>, index: usize| std::array::from_fn(|n| self.surface_torque(side, index, n));
        match system.breakaway_test {
            BreakawayTest::Transmitted => self.interface,
            BreakawayTest::Rotor => of(&system.rotor, 0),
            BreakawayTest::Stator => of(&system.stator, 1),
        }
    }

    /// State `x` units after the start.
    pub fn at(&self, x: f64, out: &mut [T]) {
        let x = T::of(x);
        // Four series at once: a single sum would wait for its own latency.
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

fn place<T: Number>(system: &SystemEquations<T>, location: &SystemLocation) -> (bool, usize) {
    (system.is_asymmetric() && location.sense < 0, location.piece)
}

/// Coefficient `n` of the torque of the shaft on the inner side of inertia `i`, N m.
#[inline(always)]
fn shaft_torque<T: Number>(side: &Side<T>, state: &[Series<T>], i: usize, n: usize) -> T {
    let Some(shaft) = i.checked_sub(1) else {
        return T::of(0.0);
    };
    let at = side.twists + 2 * shaft;
    side.stiffness[shaft] * state[at][n] + side.damping[shaft] * state[at + 1][n]
}

#[derive(Debug, Clone)]
struct EngagedContact<T> {
    /// mu or g.
    mu: Series<T>,
    /// Smooth function of a regularised contact, and its helper 1 - t^2 or 1 + v^2.
    smooth: Series<T>,
    helper: Series<T>,
    /// Bristles: 1/g and x z.
    inverse: Series<T>,
    product: Series<T>,
    /// Torque over r F_n.
    coefficient: Series<T>,
}

impl<T: Number> EngagedContact<T> {
    fn new() -> Self {
        let none = taylor::zeros();
        EngagedContact {
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
    /// Coefficient `n` of the torque of a contact without stick (N m) and of its bristles' deflection rate, from
    /// omega_r and the law up to n.
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
                    // Coefficient `n` is not known yet and must not contribute.
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

impl<T: Number> EngagedContact<T> {
    /// Coefficient `n` of tanh(v) or (2/pi) arctan(v), v = omega_r/eps.
    #[inline(always)]
    fn smooth_coefficient(&mut self, n: usize, smoothing: Smoothing, speed: T, relative_velocity: &Series<T>) -> T {
        let v = |k: usize| relative_velocity[k] / speed;
        let order = |k: usize| T::of(k as f64);
        let sum = |terms: &mut dyn Iterator<Item = T>| terms.fold(T::of(0.0), |sum, term| sum + term);
        match smoothing {
            Smoothing::Tanh => {
                // helper = 1 - t^2
                if n == 0 {
                    let (value, cosh) = (v(0).tanh(), v(0).cosh());
                    self.smooth[0] = value;
                    self.helper[0] = T::of(1.0) / (cosh * cosh);
                    return value;
                }
                let sum = sum(&mut (1..=n).map(|k| order(k) * v(k) * self.helper[n - k]));
                let value = sum / order(n);
                self.smooth[n] = value;
                self.helper[n] = -convolved(&self.smooth, &self.smooth, n, n);
                value
            }
            Smoothing::Arctan => {
                // helper = 1 + v^2; smooth holds (2/pi) a
                let share = T::of(2.0) / T::pi();
                let square = sum(&mut (0..=n).map(|k| v(k) * v(n - k)));
                if n == 0 {
                    self.helper[0] = T::of(1.0) + square;
                    return share * v(0).atan();
                }
                self.helper[n] = square;
                let sum = sum(&mut (1..n).map(|k| order(k) * self.smooth[k] * self.helper[n - k]));
                (share * order(n) * v(n) - sum) / (order(n) * self.helper[0])
            }
        }
    }
}

impl Expansion {
    /// Takes the motion along the slow manifold, with the quadratures of `y`, by powers of time in s. Nothing may
    /// drive the system.
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
        self.place = place(system, location);
        self.quadratures(system, location);
    }

    /// F_n about `t` (s) by powers of time in s, up to its degree. Overwrites the expanded motion's external inputs.
    pub(super) fn pressing(&mut self, excitation: &Excitation, location: &SystemLocation, t: f64) -> &[f64] {
        excitation.series(self.ringing.as_ref(), location.stretch, t, 1.0, &mut self.outside);
        &self.outside.normal_force[..=self.outside.degree]
    }

    /// Longest time up to `longest` (s) over which the Taylor coefficients of friction are valid.
    pub(super) fn within_law(&self, system: &SystemEquations, location: &SystemLocation, longest: f64) -> f64 {
        if !location.mode.slides() {
            return longest;
        }
        let w = &self.relative_velocity;
        let x = longest / self.unit;
        // The sum of the magnitudes of all terms bounds the change of omega_r: powers of x^4, in four sums.
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
