//! Definition of a system: two chains at one contact, in SI units and radians. In translation metres, newtons and
//! kilograms replace radians, newton metres and kilogram square metres, and the radius is 1.

use crate::friction::FrictionLaw;
use crate::model::{Axial, BreakawayTest, KickTime};
use crate::signal::{Drive, Signal};
use num_rational::BigRational;
use num_traits::ToPrimitive;

/// The physical problem. `T` is the number type, and `L` the friction law: doubles with [`FrictionLaw`], or exact
/// numbers with [`ExactLaw`].
#[derive(Debug, Clone, PartialEq)]
pub struct System<T = f64, L = FrictionLaw> {
    /// The train of the rotor, index 2 in the equations.
    pub rotor: Train<T>,
    /// The train of the stator, index 1 in the equations.
    pub stator: Train<T>,
    /// r, effective friction radius, m; 1 in translation.
    pub radius: T,
    /// Source of the normal force.
    pub pressing: Pressing<T>,
    /// mu_0, the coefficient of friction at rest.
    pub breakaway: T,
    /// Torque that is compared with mu_0 r F_n in stick.
    pub breakaway_test: BreakawayTest,
    /// mu(x) at the sliding speed x = |omega_r|; g(x) with bristles.
    pub law: L,
    /// Treatment of friction's jump at rest.
    pub contact: ContactLaw<T>,
    /// State at t = 0.
    pub initial: Initial<T>,
    /// Kicks, in any order.
    pub kicks: Vec<Kick<T>>,
}

/// The physical problem without rounding.
pub type ExactSystem = System<BigRational, ExactLaw>;

/// A friction law whose parameters are exact numbers, by their keys in a case.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactLaw {
    /// The word of `friction.law`.
    pub name: &'static str,
    /// Key and value of each number, SI.
    pub numbers: Vec<(&'static str, BigRational)>,
    /// Key and values of each list.
    pub lists: Vec<(&'static str, Vec<BigRational>)>,
    /// Key and word of each choice.
    pub words: Vec<(&'static str, &'static str)>,
}

impl ExactLaw {
    /// The value of a number; zero if the law has no such key.
    pub fn number(&self, key: &str) -> BigRational {
        let found = self.numbers.iter().find(|number| number.0 == key);
        found.map_or_else(BigRational::default, |number| number.1.clone())
    }

    /// The values of a list; empty if the law has no such key.
    pub fn list(&self, key: &str) -> &[BigRational] {
        let found = self.lists.iter().find(|list| list.0 == key);
        found.map_or(&[], |list| &list.1)
    }

    /// The word of a choice; empty if the law has no such key.
    pub fn word(&self, key: &str) -> &'static str {
        let found = self.words.iter().find(|word| word.0 == key);
        found.map_or("", |word| word.1)
    }
}

/// The double nearest to `value`.
pub fn nearest_double(value: &BigRational) -> f64 {
    value.to_f64().unwrap_or(f64::NAN)
}

/// An open chain of inertias, from the contact outwards.
#[derive(Debug, Clone, PartialEq)]
pub struct Train<T = f64> {
    /// Inertias, kg m^2. Inertia 0 is the surface. Without any, the surface is the far end, which is fixed or driven.
    pub inertia: Vec<T>,
    /// Stiffness of the shafts, N m/rad. Shaft i is between inertias i and i + 1; the last one is between the
    /// outermost inertia and a fixed or driven end. There are as many shafts as inertias, one less with a free end,
    /// and none without inertia.
    pub stiffness: Vec<T>,
    /// Damping of the shafts, N m s/rad.
    pub damping: Vec<T>,
    /// Damping of each inertia to the ground, N m s/rad.
    pub viscous: Vec<T>,
    /// Far end.
    pub end: End<T>,
    /// External torque.
    pub torque: Option<Torque<T>>,
}

/// The far end of a train.
#[derive(Debug, Clone, PartialEq)]
pub enum End<T = f64> {
    /// Free.
    Free,
    /// Fixed to the ground.
    Fixed,
    /// Driven at this speed, rad/s.
    Driven(Drive<T>),
}

/// An external torque.
#[derive(Debug, Clone, PartialEq)]
pub struct Torque<T = f64> {
    /// Torque, N m; positive in the direction of positive speed.
    pub signal: Drive<T>,
    /// Index of the inertia on which it acts.
    pub on: usize,
}

/// Source of the normal force.
#[derive(Debug, Clone, PartialEq)]
pub enum Pressing<T = f64> {
    /// A given force, N. Where it is not positive, the contact is open.
    Force(Drive<T>),
    /// The axial mode under an actuating force, as in the paper's brake.
    Axial {
        /// The axial oscillator.
        axial: Axial<T>,
        /// F(t), N.
        actuation: Signal<T>,
    },
}

/// Treatment of friction's jump at rest.
#[derive(Debug, Clone, PartialEq)]
pub enum ContactLaw<T = f64> {
    /// Stick and slip. The torque is s mu(|omega_r|) r F_n in slip, and up to mu_0 r F_n in stick.
    StickSlip,
    /// No stick. The torque is mu(|omega_r|) f(omega_r/eps) r F_n at every omega_r.
    Regularised(Regularisation<T>),
    /// No stick. The torque is (sigma_0 z + sigma_1 z' + sigma_2 omega_r) r F_n with the deflection z of the
    /// bristles, where z' = omega_r - sigma_0 |omega_r| z/g(|omega_r|) (LuGre).
    Bristles(Bristles<T>),
}

/// A smooth function that replaces the sign of omega_r.
#[derive(Debug, Clone, PartialEq)]
pub struct Regularisation<T = f64> {
    /// The function f.
    pub function: Smoothing,
    /// eps, rad/s.
    pub speed: T,
}

/// Function f of a regularisation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Smoothing {
    /// tanh(omega_r/eps).
    Tanh,
    /// (2/pi) arctan(omega_r/eps).
    Arctan,
}

/// Parameters of LuGre's bristles, without the function g.
#[derive(Debug, Clone, PartialEq)]
pub struct Bristles<T = f64> {
    /// sigma_0, 1/rad.
    pub stiffness: T,
    /// sigma_1, s/rad.
    pub damping: T,
    /// sigma_2, s/rad.
    pub viscous: T,
    /// z at t = 0, rad.
    pub deflection: T,
}

/// The state at t = 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Initial<T = f64> {
    /// Twists of the rotor's shafts, rad: outer minus inner angle.
    pub rotor_twist: Vec<T>,
    /// Speeds of the rotor's inertias, rad/s.
    pub rotor_speed: Vec<T>,
    /// Twists of the stator's shafts, rad: inner minus outer angle. Forward slip thus twists both chains positively.
    pub stator_twist: Vec<T>,
    /// Speeds of the stator's inertias, rad/s.
    pub stator_speed: Vec<T>,
}

/// A jump of the relative velocity.
#[derive(Debug, Clone, PartialEq)]
pub struct Kick<T = f64> {
    /// Time of the kick, or the loss of stability.
    pub time: KickTime<T>,
    /// delta, rad/s.
    pub relative_velocity: T,
    /// Surface that takes the kick.
    pub on: KickSide,
}

/// Surface that takes a kick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum KickSide {
    /// Both surfaces, so that the momentum is kept: phi2_dot += delta J_1/(J_1 + J_2), phi1_dot -= delta J_2/(J_1 +
    /// J_2).
    #[default]
    Both,
    /// phi2_dot += delta.
    Rotor,
    /// phi1_dot -= delta.
    Stator,
}

impl<T> Train<T> {
    /// Number of shafts that the train must have.
    pub fn shafts(&self) -> usize {
        match self.end {
            End::Free => self.inertia.len().saturating_sub(1),
            End::Fixed | End::Driven(_) => self.inertia.len(),
        }
    }

    /// Whether the surface has no inertia and moves with the far end.
    pub fn is_rigid(&self) -> bool {
        self.inertia.is_empty()
    }
}

impl<T, L> System<T, L> {
    /// All signals that drive the chains or press the surfaces directly. The actuation of the axial mode is not
    /// included.
    pub fn drives(&self) -> Vec<&Drive<T>> {
        let mut found = Vec::new();
        for train in [&self.rotor, &self.stator] {
            if let End::Driven(speed) = &train.end {
                found.push(speed);
            }
            if let Some(torque) = &train.torque {
                found.push(&torque.signal);
            }
        }
        if let Pressing::Force(force) = &self.pressing {
            found.push(force);
        }
        found
    }
}
