//! The equations of a system, in twist coordinates.
//!
//! On the side `s` (+1 rotor, -1 stator) the twist of shaft i is q_i = s (outer angle - inner angle), its torque
//! S_i = k_i q_i + c_i q_i', and inertia i obeys
//!
//! ```text
//! J_i w_i' = s (S_i - S_(i-1)) - d_i w_i + M_i,    S_(-1) = T, the torque of the interface,
//! q_i''    = s (w_(i+1)' - w_i').
//! ```
//!
//! A train without a tie has the speed of its outermost inertia as a state. The speed beyond the last shaft of a tied
//! train is that of its drive, or zero. Every other speed is a sum of twist rates from there, so that no torque is a
//! difference of large numbers.

use super::margin::twice_resistance;
use super::system::{Bristles, ContactLaw, End, KickSide, Regularisation, Smoothing, System, Train};
use crate::friction::{Exponential, FrictionLaw, Law, LawSeries};
use crate::model::{BreakawayTest, Mode};
use crate::numerics::Number;
use nalgebra::{DMatrix, DVector};
use std::sync::OnceLock;

/// The drives of one side at one time, in any type of [`Number`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Driving<T = f64> {
    /// Speed of the far end, rad/s; 0 for a fixed or free end.
    pub speed: T,
    /// Acceleration of the far end, rad/s^2.
    pub acceleration: T,
    /// External torque, N m.
    pub torque: T,
}

/// External inputs of the system at one time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Outside<T = f64> {
    /// Rotor side.
    pub rotor: Driving<T>,
    /// Stator side.
    pub stator: Driving<T>,
    /// F_n, N, smooth through zero.
    pub normal_force: T,
}

impl Outside {
    /// All inputs times `factor`.
    pub fn scaled(self, factor: f64) -> Outside {
        let of = |driving: Driving| Driving {
            speed: factor * driving.speed,
            acceleration: factor * driving.acceleration,
            torque: factor * driving.torque,
        };
        Outside {
            rotor: of(self.rotor),
            stator: of(self.stator),
            normal_force: factor * self.normal_force,
        }
    }
}

/// Coefficients of one train in any type of [`Number`], and the indices of its quantities in the state.
#[derive(Debug, Clone, PartialEq)]
pub struct Side<T = f64> {
    /// +1 for the rotor, -1 for the stator.
    pub sign: f64,
    /// J_i, kg m^2, from the surface outwards.
    pub inertia: Vec<T>,
    /// k_i of the shafts, N m/rad.
    pub stiffness: Vec<T>,
    /// c_i of the shafts, N m s/rad.
    pub damping: Vec<T>,
    /// d_i of the bearings, N m s/rad.
    pub viscous: Vec<T>,
    /// Index of the inertia on which the external torque acts.
    pub torque_on: Option<usize>,
    /// Whether the external torque acts on inertia i. Comparing `torque_on` with `Some(i)` would read the index of
    /// `None`, which memory checkers report.
    pub takes_torque: Vec<bool>,
    /// The state contains twist i at `twists + 2 i`, followed by its rate.
    pub twists: usize,
    /// Index of the speed of the outermost inertia; `None` for a tied train.
    pub speed: Option<usize>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Surface {
    /// Sum of all torques except the interface's, N m; positive in the direction that the interface opposes on the
    /// rotor.
    torque: f64,
    speed: f64,
}

impl<T: Number> Side<T> {
    fn map<U>(&self, number: impl Fn(T) -> U) -> Side<U> {
        let all = |values: &[T]| values.iter().map(|value| number(*value)).collect();
        Side {
            sign: self.sign,
            inertia: all(&self.inertia),
            stiffness: all(&self.stiffness),
            damping: all(&self.damping),
            viscous: all(&self.viscous),
            torque_on: self.torque_on,
            takes_torque: self.takes_torque.clone(),
            twists: self.twists,
            speed: self.speed,
        }
    }

    /// Number of shafts.
    pub fn shafts(&self) -> usize {
        self.stiffness.len()
    }

    pub(crate) fn twist_rates(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.shafts()).map(|i| self.twists + 2 * i + 1)
    }

    /// Twist i, rad.
    #[inline]
    pub fn twist(&self, i: usize, y: &[T]) -> T {
        y[self.twists + 2 * i]
    }

    /// Twist rate i, rad/s.
    #[inline]
    pub fn twist_rate(&self, i: usize, y: &[T]) -> T {
        y[self.twists + 2 * i + 1]
    }

    /// Speed beyond the last shaft, or of a free train's outermost inertia, rad/s.
    #[inline]
    fn base(&self, driving: &Driving<T>, y: &[T]) -> T {
        self.speed.map_or(driving.speed, |index| y[index])
    }

    /// Speed of the surface, rad/s.
    #[inline]
    pub fn surface_speed(&self, driving: &Driving<T>, y: &[T]) -> T {
        let rates = (0..self.shafts()).rev().map(|i| self.twist_rate(i, y));
        let rates = rates.fold(T::of(0.0), |sum, rate| sum + rate);
        self.base(driving, y) - rates.times(self.sign)
    }
}

impl Side {
    fn new(train: &Train, sign: f64, offset: usize) -> Side {
        let shafts = train.shafts();
        let free = matches!(train.end, End::Free);
        let torque_on = train.torque.as_ref().map(|torque| torque.on);
        Side {
            sign,
            inertia: train.inertia.clone(),
            stiffness: train.stiffness.clone(),
            damping: train.damping.clone(),
            viscous: train.viscous.clone(),
            torque_on,
            takes_torque: (0..train.inertia.len()).map(|i| torque_on == Some(i)).collect(),
            twists: offset,
            speed: free.then_some(offset + 2 * shafts),
        }
    }

    fn length(&self) -> usize {
        2 * self.shafts() + usize::from(self.speed.is_some())
    }

    /// Effective inertia of the surface, kg m^2; infinite for a rigid surface.
    pub fn surface_inertia(&self) -> f64 {
        self.inertia.first().copied().unwrap_or(f64::INFINITY)
    }

    pub(super) fn rigid_inertia(&self) -> f64 {
        self.inertia.iter().sum()
    }

    /// Angular frequency of the inertia on the inner side of shaft i, on this shaft alone, rad/s. It relates the
    /// scale of a twist to that of a rate.
    pub fn own_frequency(&self, i: usize) -> f64 {
        (self.stiffness[i] / self.inertia[i]).sqrt()
    }

    #[inline]
    fn shaft_torque(&self, i: usize, y: &[f64]) -> f64 {
        self.stiffness[i] * self.twist(i, y) + self.damping[i] * self.twist_rate(i, y)
    }

    /// Speeds of all inertias, rad/s, the surface first.
    pub fn speeds(&self, driving: &Driving, y: &[f64]) -> Vec<f64> {
        let mut speeds = vec![0.0; self.inertia.len()];
        let mut outer = self.base(driving, y);
        for i in (0..self.inertia.len()).rev() {
            if i < self.shafts() {
                outer -= self.sign * self.twist_rate(i, y);
            }
            speeds[i] = outer;
        }
        speeds
    }

    /// Speed of the outermost inertia, rad/s; `None` for a rigid surface.
    pub fn outermost_speed(&self, driving: &Driving, y: &[f64]) -> Option<f64> {
        let outermost = self.inertia.len().checked_sub(1)?;
        let base = self.base(driving, y);
        Some(if outermost < self.shafts() {
            base - self.sign * self.twist_rate(outermost, y)
        } else {
            base
        })
    }

    #[inline]
    fn own_torque(&self, i: usize, speed: f64, driving: &Driving) -> f64 {
        let external = if self.takes_torque[i] { driving.torque } else { 0.0 };
        external - self.viscous[i] * speed
    }

    fn surface(&self, driving: &Driving, y: &[f64]) -> Surface {
        let speed = self.surface_speed(driving, y);
        let mut torque = 0.0;
        if !self.inertia.is_empty() {
            torque = self.sign * self.own_torque(0, speed, driving);
            if self.shafts() > 0 {
                torque += self.shaft_torque(0, y);
            }
        }
        Surface { torque, speed }
    }

    /// Writes the rates of this side under the torque `interface` (N m). Returns the power (W) of its drives and of
    /// its dampers. In stick, `joined` is the common acceleration of the surfaces (rad/s^2).
    pub(super) fn rates(
        &self,
        driving: &Driving,
        interface: f64,
        joined: Option<f64>,
        y: &[f64],
        dydt: &mut [f64],
    ) -> (f64, f64) {
        let (n, shafts) = (self.inertia.len(), self.shafts());
        if n == 0 {
            // The drive of a rigid surface acts directly on the interface.
            return (self.sign * interface * driving.speed, 0.0);
        }
        let mut outer_speed = self.base(driving, y);
        let mut outer_acceleration = driving.acceleration;
        let (mut work, mut loss) = (0.0, 0.0);
        let mut outside = 0.0;
        if shafts == n {
            outside = self.shaft_torque(n - 1, y);
            work += self.sign * outside * driving.speed;
        }
        for i in (0..n).rev() {
            if i < shafts {
                outer_speed -= self.sign * self.twist_rate(i, y);
            }
            let speed = outer_speed;
            let inside = if i > 0 { self.shaft_torque(i - 1, y) } else { interface };
            let acceleration = match joined {
                Some(joined) if i == 0 => joined,
                _ => (self.sign * (outside - inside) + self.own_torque(i, speed, driving)) / self.inertia[i],
            };
            if i < shafts {
                let rate = self.twist_rate(i, y);
                dydt[self.twists + 2 * i] = rate;
                dydt[self.twists + 2 * i + 1] = self.sign * (outer_acceleration - acceleration);
                loss += self.damping[i] * rate * rate;
            } else if let Some(index) = self.speed {
                dydt[index] = acceleration;
            }
            if self.takes_torque[i] {
                work += driving.torque * speed;
            }
            loss += self.viscous[i] * speed * speed;
            (outside, outer_acceleration) = (inside, acceleration);
        }
        (work, loss)
    }

    fn acceleration(&self, surface: &Surface, interface: f64, driving: &Driving) -> f64 {
        if self.inertia.is_empty() {
            driving.acceleration
        } else {
            self.sign * (surface.torque - interface) / self.inertia[0]
        }
    }

    fn push(&self, change: f64, y: &mut [f64]) {
        if self.inertia.is_empty() {
            return;
        }
        if self.shafts() > 0 {
            y[self.twists + 1] -= self.sign * change;
        } else if let Some(index) = self.speed {
            y[index] += change;
        }
    }

    /// Changes the speed of the drive by `change` (rad/s). The inertias keep their speeds.
    pub fn jerk(&self, change: f64, y: &mut [f64]) {
        if self.shafts() == self.inertia.len() && self.shafts() > 0 {
            y[self.twists + 2 * (self.shafts() - 1) + 1] += self.sign * change;
        }
    }

    fn kinetic_energy(&self, driving: &Driving, y: &[f64]) -> f64 {
        let mut speed = self.base(driving, y);
        let mut energy = 0.0;
        for (i, inertia) in self.inertia.iter().enumerate().rev() {
            if i < self.shafts() {
                speed -= self.sign * self.twist_rate(i, y);
            }
            energy += 0.5 * inertia * speed * speed;
        }
        energy
    }

    fn elastic_energy(&self, y: &[f64]) -> f64 {
        (0..self.shafts())
            .map(|i| 0.5 * self.stiffness[i] * self.twist(i, y).powi(2))
            .sum()
    }
}

/// Behaviour of the contact at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Engagement<T = f64> {
    /// Stick and slip.
    StickSlip,
    /// A smooth function of omega_r/eps replaces the sign. Contains the function and eps (rad/s).
    Regularised(Smoothing, T),
    /// Bristles: sigma_0, sigma_1, sigma_2, and the index of the deflection in the state.
    Bristles(T, T, T, usize),
}

impl<T> Engagement<T> {
    fn map<U>(self, number: impl Fn(T) -> U) -> Engagement<U> {
        match self {
            Engagement::StickSlip => Engagement::StickSlip,
            Engagement::Regularised(smoothing, speed) => Engagement::Regularised(smoothing, number(speed)),
            Engagement::Bristles(stiffness, damping, viscous, at) => {
                Engagement::Bristles(number(stiffness), number(damping), number(viscous), at)
            }
        }
    }
}

/// The equations of a system. They do not contain time: external inputs are arguments. The coefficients may have any
/// type of [`Number`], see [`Self::map`].
#[derive(Debug, Clone, PartialEq)]
pub struct SystemEquations<T = f64> {
    /// The rotor, side +1.
    pub rotor: Side<T>,
    /// The stator, side -1.
    pub stator: Side<T>,
    /// r, m.
    pub radius: T,
    /// mu_0 into forward sliding.
    pub breakaway: T,
    /// mu_0 into backward sliding.
    pub breakaway_backward: T,
    /// Torque that is compared with mu_0 r F_n in stick.
    pub breakaway_test: BreakawayTest,
    /// Constant part 2 R of the margin of steady sliding, N m s/rad; `None` without a margin.
    pub twice_resistance: Option<T>,
    /// mu(x), or g(x) for bristles; see [`SystemEquations::law_in`].
    pub law: FrictionLaw,
    /// mu(x) in backward sliding, if it differs.
    backward: Option<FrictionLaw>,
    /// The law of each piece between its knots, smooth beyond them; empty without knots.
    pieces: Vec<FrictionLaw>,
    /// Behaviour of the contact at rest.
    pub engagement: Engagement<T>,
    /// Index of the first quadrature. The quadratures are slip displacement, friction loss, damping loss, work of the
    /// drives and, with two free chains, the angle of the stator's outermost inertia.
    pub slip: usize,
    /// Number of components of the state.
    pub dimension: usize,
    linear: OnceLock<LinearMaps>,
}

#[derive(Debug, Clone, PartialEq)]
struct LinearMaps {
    free: DMatrix<f64>,
    interface: DVector<f64>,
    relative_velocity: DVector<f64>,
    transmitted: DVector<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ContactSlopes {
    /// dT/d omega_r, N m s/rad.
    pub by_speed: f64,
    pub bristles: Option<BristleSlopes>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BristleSlopes {
    pub at: usize,
    /// N m per unit of the deflection.
    pub torque_by_deflection: f64,
    /// Derivatives of the deflection's rate with respect to omega_r and to the deflection.
    pub rate_by_speed: f64,
    pub rate_by_deflection: f64,
}

/// Offset of the energy dissipated by friction from [`SystemEquations::slip`].
pub const FRICTION_LOSS: usize = 1;
/// Offset of the energy dissipated by shafts and bearings.
pub const DAMPING_LOSS: usize = 2;
/// Offset of the work of all drives.
pub const WORK: usize = 3;
/// Offset of the angle of the stator's outermost inertia, which exists if both chains are free.
pub const ANGLE: usize = 4;

impl<T: Number> SystemEquations<T> {
    /// The same equations with coefficients converted by `number`. The friction law keeps its parameters.
    pub fn map<U>(&self, number: impl Fn(T) -> U) -> SystemEquations<U> {
        SystemEquations {
            rotor: self.rotor.map(&number),
            stator: self.stator.map(&number),
            radius: number(self.radius),
            breakaway: number(self.breakaway),
            breakaway_backward: number(self.breakaway_backward),
            breakaway_test: self.breakaway_test,
            twice_resistance: self.twice_resistance.map(&number),
            law: self.law.clone(),
            backward: self.backward.clone(),
            engagement: self.engagement.map(&number),
            pieces: self.pieces.clone(),
            slip: self.slip,
            dimension: self.dimension,
            linear: OnceLock::new(),
        }
    }

    /// Indices of the twist rates in the state, first those of the rotor.
    pub fn twist_rates(&self) -> impl Iterator<Item = usize> + '_ {
        self.rotor.twist_rates().chain(self.stator.twist_rates())
    }

    /// Number of states before the quadratures.
    pub fn mechanical(&self) -> usize {
        self.slip
    }

    /// The law of sliding in the sense of the sign of `sense`, over all speeds.
    #[inline]
    pub fn law_of(&self, sense: f64) -> &FrictionLaw {
        match &self.backward {
            Some(law) if sense < 0.0 => law,
            _ => &self.law,
        }
    }

    /// Whether friction differs between the senses of sliding.
    #[inline]
    pub fn is_asymmetric(&self) -> bool {
        self.backward.is_some()
    }

    /// [`Self::law_of`] between the knots `piece` - 1 and `piece`.
    #[inline]
    pub fn law_in(&self, sense: f64, piece: usize) -> &FrictionLaw {
        self.pieces.get(piece).unwrap_or_else(|| self.law_of(sense))
    }

    /// omega_r = phi_2' - phi_1', rad/s.
    #[inline]
    pub fn relative_velocity(&self, outside: &Outside<T>, y: &[T]) -> T {
        self.rotor.surface_speed(&outside.rotor, y) - self.stator.surface_speed(&outside.stator, y)
    }

    /// J_2 and J_1, kg m^2; `None` for a rigid surface.
    #[inline]
    fn surface_inertias(&self) -> (Option<T>, Option<T>) {
        (
            self.rotor.inertia.first().copied(),
            self.stator.inertia.first().copied(),
        )
    }

    /// T_f from the torques on both surfaces and the accelerations of rigid surfaces. It is linear in all four.
    #[inline]
    pub fn shared(&self, rotor: T, stator: T, rotor_acceleration: T, stator_acceleration: T) -> T {
        match self.surface_inertias() {
            (Some(j2), Some(j1)) => (j1 * rotor + j2 * stator) / (j1 + j2),
            (None, Some(j1)) => stator + j1 * rotor_acceleration,
            (Some(j2), None) => rotor - j2 * stator_acceleration,
            (None, None) => T::of(0.0),
        }
    }

    /// Common acceleration of the surfaces in stick, rad/s^2, from the arguments of [`Self::shared`]. With T_f the
    /// surfaces would have equal accelerations only up to rounding, and omega_r would creep away from zero.
    #[inline]
    pub fn joined(&self, rotor: T, stator: T, rotor_acceleration: T, stator_acceleration: T) -> T {
        match self.surface_inertias() {
            (Some(j2), Some(j1)) => (rotor - stator) / (j1 + j2),
            (None, _) => rotor_acceleration,
            (_, None) => stator_acceleration,
        }
    }

    /// mu_0 r F_n, N m, into sliding in the sense of the sign of `sense`.
    pub fn breakaway_torque(&self, sense: f64, normal_force: T) -> T {
        let breakaway = match sense < 0.0 {
            true => self.breakaway_backward,
            false => self.breakaway,
        };
        breakaway * self.radius * normal_force
    }

    /// 2 r F_n, N m: the factor of mu' in the margin.
    #[inline]
    pub fn slope_weight(&self, normal_force: T) -> T {
        T::of(2.0) * self.radius * normal_force
    }
}

impl SystemEquations {
    /// The equations of a system.
    pub fn new(system: &System) -> SystemEquations {
        let rotor = Side::new(&system.rotor, 1.0, 0);
        let stator = Side::new(&system.stator, -1.0, rotor.length());
        let mut next = stator.twists + stator.length();
        let engagement = match &system.contact {
            ContactLaw::StickSlip => Engagement::StickSlip,
            ContactLaw::Regularised(Regularisation { function, speed }) => Engagement::Regularised(*function, *speed),
            ContactLaw::Bristles(Bristles {
                stiffness,
                damping,
                viscous,
                ..
            }) => {
                next += 1;
                Engagement::Bristles(*stiffness, *damping, *viscous, next - 1)
            }
        };
        let slip = next;
        let both_free = rotor.speed.is_some() && stator.speed.is_some();
        let dimension = slip + 4 + usize::from(both_free);
        let count = match system.law.knots().len() {
            0 => 0,
            knots => knots + 1,
        };
        let backward = system.law.backward();
        let system = SystemEquations {
            breakaway_backward: backward
                .as_ref()
                .map_or(system.breakaway, |backward| backward.breakaway),
            backward: backward.map(|backward| backward.law),
            pieces: (0..count).map(|piece| system.law.continued(piece)).collect(),
            rotor,
            stator,
            radius: system.radius,
            breakaway: system.breakaway,
            breakaway_test: system.breakaway_test,
            twice_resistance: twice_resistance(system).filter(|resistance| {
                // Without damping and with constant friction the margin is always zero.
                let slopes = system.law.slope_bounds(0.0, f64::INFINITY);
                *resistance != 0.0 || slopes.least != 0.0 || slopes.most != 0.0
            }),
            law: system.law.clone(),
            engagement,
            slip,
            dimension,
            linear: OnceLock::new(),
        };
        system.linear();
        system
    }

    /// Whether the law has knots.
    pub fn has_pieces(&self) -> bool {
        !self.pieces.is_empty()
    }

    /// The piece of the law at a sliding speed (rad/s); at a knot the lower one.
    pub fn piece_of(&self, speed: f64) -> usize {
        self.law.knots().iter().filter(|&&knot| knot < speed.abs()).count()
    }

    /// Sum of the magnitudes of the terms in [`Self::relative_velocity`], rad/s.
    pub fn relative_velocity_terms(&self, outside: &Outside, y: &[f64]) -> f64 {
        let of = |side: &Side, driving: &Driving| {
            let rates: f64 = (0..side.shafts()).map(|i| side.twist_rate(i, y).abs()).sum();
            side.base(driving, y).abs() + rates
        };
        of(&self.rotor, &outside.rotor) + of(&self.stator, &outside.stator)
    }

    /// T_f, N m: the torque that the interface must carry to give both surfaces the same acceleration.
    pub fn transmitted_torque(&self, outside: &Outside, y: &[f64]) -> f64 {
        let (rotor, stator) = self.surfaces(outside, y);
        self.transmitted(&rotor, &stator, outside)
    }

    /// T_r and T_s, N m: torques on the surfaces, without that of the interface.
    pub fn surface_torques(&self, outside: &Outside, y: &[f64]) -> (f64, f64) {
        let (rotor, stator) = self.surfaces(outside, y);
        (rotor.torque, stator.torque)
    }

    /// The larger mu_0 of both senses, with its sense.
    pub fn larger_breakaway(&self) -> (f64, f64) {
        match self.breakaway_backward > self.breakaway {
            true => (-1.0, self.breakaway_backward),
            false => (1.0, self.breakaway),
        }
    }

    /// The torque that breakaway compares with mu_0 r F_n, N m.
    pub fn tested_torque(&self, outside: &Outside, y: &[f64]) -> f64 {
        match self.breakaway_test {
            BreakawayTest::Transmitted => self.transmitted_torque(outside, y),
            BreakawayTest::Rotor => self.surface_torques(outside, y).0,
            BreakawayTest::Stator => self.surface_torques(outside, y).1,
        }
    }

    fn surfaces(&self, outside: &Outside, y: &[f64]) -> (Surface, Surface) {
        (
            self.rotor.surface(&outside.rotor, y),
            self.stator.surface(&outside.stator, y),
        )
    }

    fn transmitted(&self, rotor: &Surface, stator: &Surface, outside: &Outside) -> f64 {
        self.shared(
            rotor.torque,
            stator.torque,
            outside.rotor.acceleration,
            outside.stator.acceleration,
        )
    }

    /// The margin 2 (R + r F_n mu'(|omega_r|)), N m s/rad: the damping of the surfaces' swing in steady sliding. It
    /// is infinite without a margin. Steady sliding is unstable where it is negative.
    pub fn stability_margin(&self, sense: f64, piece: usize, outside: &Outside, y: &[f64]) -> f64 {
        let Some(twice_resistance) = self.twice_resistance else {
            return f64::INFINITY;
        };
        twice_resistance + 2.0 * self.contact_damping(sense, piece, outside, y)
    }

    /// A value with the sign of the margin in slip. Without resistance the margin vanishes with the normal force,
    /// whose rounding would change its sign. The slope of the friction law decides then.
    pub fn stability_guard(&self, sense: f64, piece: usize, outside: &Outside, y: &[f64]) -> f64 {
        if self.twice_resistance != Some(0.0) {
            return self.stability_margin(sense, piece, outside, y);
        }
        if self.law.only_falls() {
            return -1.0;
        }
        let x = sense * self.relative_velocity(outside, y);
        self.law_in(sense, piece).coefficient_and_slope(x).1
    }

    /// Change of [`Self::stability_guard`] if inputs and state `now` change by `change`, to first order; 0 without
    /// margin.
    pub fn stability_guard_slope(
        &self,
        sense: f64,
        piece: usize,
        now: (&Outside, &[f64]),
        change: (&Outside, &[f64]),
    ) -> f64 {
        // Without a margin, or where the guard is constant.
        if self.twice_resistance.is_none() || self.twice_resistance == Some(0.0) && self.law.only_falls() {
            return 0.0;
        }
        let mut law = self.law_in(sense, piece).series::<f64, 2>();
        law.start(sense * self.relative_velocity(now.0, now.1), 1.0);
        law.extend(1, sense * self.relative_velocity(change.0, change.1), 1.0);
        let slope = law.factors(1.0, self.slope_weight(1.0)).slope;
        let [shape, rate] = [0, 1].map(|n| law.slope_shape(n));
        if self.twice_resistance == Some(0.0) {
            return slope * rate / self.slope_weight(1.0);
        }
        slope * (shape * change.0.normal_force + rate * now.0.normal_force)
    }

    /// kappa = r F_n mu'(|omega_r|), N m s/rad: damping of the contact in slip, negative for falling friction.
    pub fn contact_damping(&self, sense: f64, piece: usize, outside: &Outside, y: &[f64]) -> f64 {
        let w = self.relative_velocity(outside, y);
        let (_, slope) = self.law_in(sense, piece).coefficient_and_slope(sense * w);
        self.radius * outside.normal_force * slope
    }

    /// Sum of the compliances of all shafts, rad/(N m).
    pub fn compliance(&self) -> f64 {
        let shafts = self.rotor.stiffness.iter().chain(&self.stator.stiffness);
        shafts.map(|k| k.recip()).sum()
    }

    /// s mu(s omega_r) r F_n in slip with sense `sense`, N m.
    fn sliding_torque(&self, law: &FrictionLaw, sense: f64, w: f64, normal_force: f64) -> f64 {
        sense * law.coefficient(sense * w) * self.radius * normal_force
    }

    /// Rate of the interface's torque in slip, N m/s, from present inputs and state, `now`, and their `rates`.
    pub fn sliding_torque_rate(
        &self,
        sense: f64,
        piece: usize,
        now: (&Outside, &[f64]),
        rates: (&Outside, &[f64]),
    ) -> f64 {
        let x = sense * self.relative_velocity(now.0, now.1);
        let (mu, slope) = self.law_in(sense, piece).coefficient_and_slope(x);
        let acceleration = self.relative_velocity(rates.0, rates.1);
        self.radius * (slope * acceleration * now.0.normal_force + sense * mu * rates.0.normal_force)
    }

    /// Torque of an engaged contact divided by r F_n, and rate of the bristles' deflection.
    pub fn engaged(&self, law: &FrictionLaw, sense: f64, w: f64, y: &[f64]) -> (f64, f64) {
        let x = sense * w;
        match self.engagement {
            Engagement::StickSlip => (0.0, 0.0),
            Engagement::Regularised(smoothing, speed) => {
                let shape = match smoothing {
                    Smoothing::Tanh => (w / speed).tanh(),
                    Smoothing::Arctan => std::f64::consts::FRAC_2_PI * (w / speed).atan(),
                };
                (law.coefficient(x) * shape, 0.0)
            }
            Engagement::Bristles(stiffness, damping, viscous, at) => {
                let z = y[at];
                let rate = w - stiffness * x * z / law.coefficient(x);
                (stiffness * z + damping * rate + viscous * w, rate)
            }
        }
    }

    /// Torque of the interface, N m. `sense` is the sign of omega_r in slip, or the side of rest of an engaged
    /// contact.
    pub fn interface_torque(&self, mode: Mode, sense: f64, piece: usize, outside: &Outside, y: &[f64]) -> f64 {
        match mode {
            Mode::Separated => 0.0,
            Mode::Stick => self.transmitted_torque(outside, y),
            Mode::SlipForward | Mode::SlipBackward => {
                let w = self.relative_velocity(outside, y);
                self.sliding_torque(self.law_in(sense, piece), sense, w, outside.normal_force)
            }
            Mode::Engaged => {
                let w = self.relative_velocity(outside, y);
                self.engaged(self.law_in(sense, piece), sense, w, y).0 * self.radius * outside.normal_force
            }
        }
    }

    /// Writes dy/dt in a mode.
    pub fn rates(&self, mode: Mode, sense: f64, piece: usize, outside: &Outside, y: &[f64], dydt: &mut [f64]) {
        // Like `interface_torque`, without computing anything twice.
        let (mut joined, mut deflection_rate) = (None, 0.0);
        let (w, torque) = match mode {
            Mode::Separated => (self.relative_velocity(outside, y), 0.0),
            Mode::Stick => {
                let (rotor, stator) = self.surfaces(outside, y);
                let [a, b] = [outside.rotor.acceleration, outside.stator.acceleration];
                joined = Some(self.joined(rotor.torque, stator.torque, a, b));
                (0.0, self.transmitted(&rotor, &stator, outside))
            }
            Mode::SlipForward | Mode::SlipBackward => {
                let w = self.relative_velocity(outside, y);
                (
                    w,
                    self.sliding_torque(self.law_in(sense, piece), sense, w, outside.normal_force),
                )
            }
            Mode::Engaged => {
                let w = self.relative_velocity(outside, y);
                let coefficient;
                (coefficient, deflection_rate) = self.engaged(self.law_in(sense, piece), sense, w, y);
                (w, coefficient * self.radius * outside.normal_force)
            }
        };
        let (rotor_work, rotor_loss) = self.rotor.rates(&outside.rotor, torque, joined, y, dydt);
        let (stator_work, stator_loss) = self.stator.rates(&outside.stator, torque, joined, y, dydt);
        if let Engagement::Bristles(.., at) = self.engagement {
            dydt[at] = deflection_rate;
        }
        let quadratures = &mut dydt[self.slip..];
        quadratures[0] = w;
        quadratures[FRICTION_LOSS] = torque * w;
        quadratures[DAMPING_LOSS] = rotor_loss + stator_loss;
        quadratures[WORK] = rotor_work + stator_work;
        if let (Some(index), Some(angle)) = (self.stator.speed, quadratures.get_mut(ANGLE)) {
            *angle = y[index];
        }
    }

    /// Acceleration of omega_r in a mode, rad/s^2.
    pub fn relative_acceleration(&self, mode: Mode, sense: f64, piece: usize, outside: &Outside, y: &[f64]) -> f64 {
        let torque = self.interface_torque(mode, sense, piece, outside, y);
        let (rotor, stator) = self.surfaces(outside, y);
        self.rotor.acceleration(&rotor, torque, &outside.rotor)
            - self.stator.acceleration(&stator, torque, &outside.stator)
    }

    /// Rates of all states per unit of the interface's torque, 1/(N m).
    pub fn interface_rates(&self) -> &[f64] {
        self.linear().interface.as_slice()
    }

    /// Share (0 to 1) of the change of omega_r from `w` by `change` (rad/s, in either direction) over which some
    /// twenty Taylor coefficients represent the interface's torque. Beyond it the last coefficients hide the error.
    pub fn expandable_share(&self, piece: usize, w: f64, change: f64) -> f64 {
        let share = self.law_in(w, piece).expandable_share(w.abs(), change);
        match self.engagement {
            // tanh approaches its limit as exp(-2 |w|/eps). Once this is below rounding, no coefficient shows the
            // region where it is not.
            Engagement::Regularised(Smoothing::Tanh, speed) => {
                let tail = Exponential {
                    low_speed: 1.0,
                    high_speed: 0.0,
                    decay: 2.0 / speed,
                };
                share.min(tail.expandable_share(w.abs(), change))
            }
            _ => share,
        }
    }

    /// Matrix of the mechanical rates in slip. The state enters only through `contact_damping` = r F_n mu' (N m
    /// s/rad).
    pub fn sliding_matrix(&self, contact_damping: f64) -> DMatrix<f64> {
        let (maps, n) = (self.linear(), self.mechanical());
        DMatrix::from_fn(n, n, |i, j| {
            maps.free[(i, j)] + contact_damping * maps.interface[i] * maps.relative_velocity[j]
        })
    }

    /// Matrix of the mechanical rates in stick or separation.
    pub fn linear_matrix(&self, mode: Mode) -> DMatrix<f64> {
        let n = self.dimension;
        let mut matrix = DMatrix::zeros(n, n);
        let rest = vec![0.0; n];
        self.jacobian(mode, 0.0, 0, &Outside::default(), &rest, &mut matrix.as_view_mut());
        matrix.resize(self.mechanical(), self.mechanical(), 0.0)
    }

    /// Factor that converts a component of the mechanical state to a speed; for bristles, to a share of friction.
    pub fn weight(&self, index: usize) -> f64 {
        if let Engagement::Bristles(stiffness, .., at) = self.engagement
            && at == index
        {
            return stiffness;
        }
        let of = |side: &Side| {
            let shaft = index.checked_sub(side.twists)?;
            (shaft % 2 == 0 && shaft / 2 < side.shafts()).then(|| side.own_frequency(shaft / 2))
        };
        let weight = of(&self.rotor).or_else(|| of(&self.stator)).unwrap_or(1.0);
        if weight > 0.0 { weight } else { 1.0 }
    }

    /// A matrix of the motion, scaled so that all components are speeds. Its eigenvalues have less rounding.
    pub fn balanced(&self, matrix: DMatrix<f64>) -> DMatrix<f64> {
        DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| {
            matrix[(i, j)] * self.weight(i) / self.weight(j)
        })
    }

    pub(crate) fn unbalanced(&self, matrix: DMatrix<f64>) -> DMatrix<f64> {
        DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| {
            matrix[(i, j)] * self.weight(j) / self.weight(i)
        })
    }

    fn linear(&self) -> &LinearMaps {
        self.linear.get_or_init(|| self.linear_maps())
    }

    fn linear_maps(&self) -> LinearMaps {
        let n = self.dimension;
        let nothing = Outside::default();
        let mut maps = LinearMaps {
            free: DMatrix::zeros(n, n),
            interface: DVector::zeros(n),
            relative_velocity: DVector::zeros(n),
            transmitted: DVector::zeros(n),
        };
        let mut rates = vec![0.0; n];
        let mut unit = vec![0.0; n];
        for k in 0..self.mechanical() {
            unit[k] = 1.0;
            rates.fill(0.0);
            self.rotor.rates(&nothing.rotor, 0.0, None, &unit, &mut rates);
            self.stator.rates(&nothing.stator, 0.0, None, &unit, &mut rates);
            maps.free.column_mut(k).copy_from_slice(&rates);
            maps.relative_velocity[k] = self.relative_velocity(&nothing, &unit);
            maps.transmitted[k] = self.transmitted_torque(&nothing, &unit);
            unit[k] = 0.0;
        }
        rates.fill(0.0);
        self.rotor.rates(&nothing.rotor, 1.0, None, &unit, &mut rates);
        self.stator.rates(&nothing.stator, 1.0, None, &unit, &mut rates);
        maps.interface.copy_from_slice(&rates);
        maps
    }

    /// Derivatives of the contact's torque and of its bristles' rate; zero in stick and separation.
    pub(super) fn contact_slopes(
        &self,
        mode: Mode,
        sense: f64,
        piece: usize,
        outside: &Outside,
        y: &[f64],
    ) -> ContactSlopes {
        let of_speed = |by_speed: f64| ContactSlopes {
            by_speed,
            bristles: None,
        };
        match mode {
            Mode::Separated | Mode::Stick => return of_speed(0.0),
            Mode::SlipForward | Mode::SlipBackward => {
                return of_speed(self.contact_damping(sense, piece, outside, y));
            }
            Mode::Engaged => {}
        }
        let w = self.relative_velocity(outside, y);
        let (mu, slope) = self.law_in(sense, piece).coefficient_and_slope(sense * w);
        let pressed = self.radius * outside.normal_force;
        match self.engagement {
            Engagement::StickSlip => of_speed(0.0),
            Engagement::Regularised(smoothing, speed) => {
                let v = w / speed;
                let (shape, rate) = match smoothing {
                    Smoothing::Tanh => (v.tanh(), 1.0 - v.tanh().powi(2)),
                    Smoothing::Arctan => {
                        let share = std::f64::consts::FRAC_2_PI;
                        (share * v.atan(), share / (1.0 + v * v))
                    }
                };
                let by_speed = sense * slope * shape + mu * rate / speed;
                of_speed(by_speed * pressed)
            }
            Engagement::Bristles(stiffness, damping, viscous, at) => {
                let (x, z) = (sense * w, y[at]);
                // z' = w - sigma_0 x z/g
                let rate_by_speed = 1.0 - stiffness * sense * z * (mu - x * slope) / (mu * mu);
                let rate_by_deflection = -stiffness * x / mu;
                ContactSlopes {
                    by_speed: (damping * rate_by_speed + viscous) * pressed,
                    bristles: Some(BristleSlopes {
                        at,
                        torque_by_deflection: (stiffness + damping * rate_by_deflection) * pressed,
                        rate_by_speed,
                        rate_by_deflection,
                    }),
                }
            }
        }
    }

    /// Writes the Jacobian of [`Self::rates`] with respect to the mechanical states. Of the quadratures only the slip
    /// displacement is included.
    pub fn jacobian(
        &self,
        mode: Mode,
        sense: f64,
        piece: usize,
        outside: &Outside,
        y: &[f64],
        jac: &mut nalgebra::DMatrixViewMut<'_, f64>,
    ) {
        let maps = self.linear();
        let g = &maps.relative_velocity;
        jac.copy_from(&maps.free);
        if mode == Mode::Stick {
            jac.ger(1.0, &maps.interface, &maps.transmitted, 1.0);
            return;
        }
        let slopes = self.contact_slopes(mode, sense, piece, outside, y);
        if mode != Mode::Separated {
            jac.ger(slopes.by_speed, &maps.interface, g, 1.0);
        }
        if let Some(bristles) = slopes.bristles {
            let at = bristles.at;
            for row in 0..self.mechanical() {
                jac[(row, at)] += bristles.torque_by_deflection * maps.interface[row];
            }
            for k in 0..self.mechanical() {
                jac[(at, k)] = bristles.rate_by_speed * g[k];
            }
            jac[(at, at)] += bristles.rate_by_deflection;
        }
        for k in 0..self.mechanical() {
            jac[(self.slip, k)] = g[k];
        }
    }

    /// Gives both surfaces their momentum-weighted mean speed. A rigid surface keeps its speed.
    pub fn join(&self, outside: &Outside, y: &mut [f64]) {
        let w = self.relative_velocity(outside, y);
        let (rotor, stator) = self.shares();
        self.rotor.push(-w * rotor, y);
        self.stator.push(w * stator, y);
    }

    /// Removes the rounding of omega_r in stick. If there is a free train, its speed is corrected: it is the largest
    /// state, and its rounding would spoil a twist rate.
    pub fn rejoin(&self, outside: &Outside, y: &mut [f64]) {
        let w = self.relative_velocity(outside, y);
        match (self.rotor.speed, self.stator.speed) {
            (Some(index), _) => y[index] -= w,
            (None, Some(index)) => y[index] += w,
            (None, None) => self.join(outside, y),
        }
    }

    /// phi_2 - phi_1 (rad) from the twists, without the rotation of the ends.
    pub fn twisted(&self, y: &[f64]) -> f64 {
        let of = |side: &Side| -> f64 { (0..side.shafts()).map(|i| side.twist(i, y)).sum() };
        -of(&self.rotor) - of(&self.stator)
    }

    /// Turns the surfaces of two tied chains by `angle` (rad) against each other, divided by [`Self::shares`].
    pub fn turn(&self, angle: f64, y: &mut [f64]) {
        let (rotor, stator) = self.shares();
        for (side, share) in [(&self.rotor, rotor), (&self.stator, stator)] {
            if side.shafts() > 0 {
                y[side.twists] -= share * angle;
            }
        }
    }

    /// Shares of the rotor's and the stator's surface in a jump of omega_r that keeps the momentum.
    pub fn shares(&self) -> (f64, f64) {
        match self.surface_inertias() {
            (Some(j2), Some(j1)) => (j1 / (j1 + j2), j2 / (j1 + j2)),
            (None, Some(_)) => (0.0, 1.0),
            (Some(_), None) => (1.0, 0.0),
            (None, None) => (0.0, 0.0),
        }
    }

    /// Adds to the surface speeds (rad/s). A rigid surface keeps its speed.
    pub fn push(&self, rotor: f64, stator: f64, y: &mut [f64]) {
        self.rotor.push(rotor, y);
        self.stator.push(stator, y);
    }

    /// Adds `delta` (rad/s) to omega_r, with an impulse on one surface or opposite ones on both, which stick absorbs.
    pub fn kick(&self, on: KickSide, delta: f64, in_stick: bool, y: &mut [f64]) {
        let (rotor_share, stator_share) = self.shares();
        match (on, in_stick) {
            (KickSide::Both, true) => {}
            (KickSide::Both, false) => self.push(delta * rotor_share, -delta * stator_share, y),
            (KickSide::Rotor, false) => self.push(delta, 0.0, y),
            (KickSide::Stator, false) => self.push(0.0, -delta, y),
            // Joined surfaces share the momentum. A rigid surface absorbs all of it.
            (KickSide::Rotor, true) => self.push(delta * stator_share, delta * stator_share, y),
            (KickSide::Stator, true) => self.push(-delta * rotor_share, -delta * rotor_share, y),
        }
    }

    /// Kinetic energy, J.
    pub fn kinetic_energy(&self, outside: &Outside, y: &[f64]) -> f64 {
        self.rotor.kinetic_energy(&outside.rotor, y) + self.stator.kinetic_energy(&outside.stator, y)
    }

    /// Elastic energy, J.
    pub fn elastic_energy(&self, y: &[f64]) -> f64 {
        self.rotor.elastic_energy(y) + self.stator.elastic_energy(y)
    }
}
