//! What defines a system, two chains at one contact, in SI units and radians; in translation metres, newtons and kilograms stand for
//! radians, newton metres and kilogram square metres, and the radius is 1.

use crate::friction::FrictionLaw;
use crate::model::{Axial, BreakawayTest, ExactLaw, KickTime};
use crate::signal::{Drive, Signal};
use num_rational::BigRational;

/// Everything that defines the physical problem. `T` is the type of its numbers and `L` that of the friction law: doubles and
/// [`FrictionLaw`], or exact ones and [`ExactLaw`].
#[derive(Debug, Clone, PartialEq)]
pub struct System<T = f64, L = FrictionLaw> {
    /// The train of the rotor, index 2 in the equations.
    pub rotor: Train<T>,
    /// The train of the stator, index 1 in the equations.
    pub stator: Train<T>,
    /// r, effective friction radius, m; 1 in translation.
    pub radius: T,
    /// Where the normal force comes from.
    pub pressing: Pressing<T>,
    /// mu_0, the coefficient of friction at rest.
    pub breakaway: T,
    /// Which torque is held against mu_0 r F_n in stick.
    pub breakaway_test: BreakawayTest,
    /// mu(x) of the sliding speed x = |omega_r|. For bristles it is g(x).
    pub law: L,
    /// What the contact does about the jump of friction at rest.
    pub contact: ContactLaw<T>,
    /// At t = 0.
    pub initial: Initial<T>,
    /// In the order given; times need not be sorted.
    pub kicks: Vec<Kick<T>>,
}

/// Everything that defines the physical problem, without rounding.
pub type ExactSystem = System<BigRational, ExactLaw>;

/// An open chain of inertias, from the contact outwards.
#[derive(Debug, Clone, PartialEq)]
pub struct Train<T = f64> {
    /// kg m^2, inertia 0 is the surface; empty: the surface is itself the far end, which is then fixed or driven.
    pub inertia: Vec<T>,
    /// Shafts, N m/rad: shaft i is between inertia i and i + 1, the last one between the outermost inertia and an end that is
    /// fixed or driven. As many as inertias, or one less where the end is free; none where there is no inertia.
    pub stiffness: Vec<T>,
    /// N m s/rad, of the same shafts.
    pub damping: Vec<T>,
    /// N m s/rad, damping of each inertia to the ground; as many as inertias.
    pub viscous: Vec<T>,
    /// What holds the far end.
    pub end: End<T>,
    /// An external torque.
    pub torque: Option<Torque<T>>,
}

/// The far end of a train.
#[derive(Debug, Clone, PartialEq)]
pub enum End<T = f64> {
    /// Nothing.
    Free,
    /// The ground.
    Fixed,
    /// A drive whose speed is known, rad/s.
    Driven(Drive<T>),
}

/// An external torque.
#[derive(Debug, Clone, PartialEq)]
pub struct Torque<T = f64> {
    /// N m; positive in the direction of positive speed.
    pub signal: Drive<T>,
    /// The inertia that it acts on.
    pub on: usize,
}

/// Where the normal force comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum Pressing<T = f64> {
    /// Given directly, N; where it is not positive the contact is open.
    Force(Drive<T>),
    /// The axial mode of [`Axial`] under an actuating force, as in the brake.
    Axial {
        /// m, k_e, c_a, and the floor of ringing.
        axial: Axial<T>,
        /// F(t), N.
        actuation: Signal<T>,
    },
}

/// What the contact does about the jump of friction at rest.
#[derive(Debug, Clone, PartialEq)]
pub enum ContactLaw<T = f64> {
    /// Stick and slip: the torque s mu(|omega_r|) r F_n in slip, up to mu_0 r F_n in stick.
    StickSlip,
    /// No stick: the torque mu(|omega_r|) f(omega_r/eps) r F_n at every omega_r.
    Regularised(Regularisation<T>),
    /// No stick: the torque (sigma_0 z + sigma_1 z' + sigma_2 omega_r) r F_n with the deflection z of the bristles,
    /// z' = omega_r - sigma_0 |omega_r| z/g(|omega_r|) (LuGre).
    Bristles(Bristles<T>),
}

/// A smooth function in the place of the sign of omega_r.
#[derive(Debug, Clone, PartialEq)]
pub struct Regularisation<T = f64> {
    /// Which.
    pub function: Smoothing,
    /// eps, rad/s.
    pub speed: T,
}

/// A smooth function in the place of the sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Smoothing {
    /// tanh(omega_r/eps).
    Tanh,
    /// (2/pi) arctan(omega_r/eps).
    Arctan,
}

/// The numbers of LuGre's bristles beside g.
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
    /// Of the shafts of the rotor, rad: outer less inner angle.
    pub rotor_twist: Vec<T>,
    /// Of the inertias of the rotor, rad/s.
    pub rotor_speed: Vec<T>,
    /// Of the shafts of the stator, rad: inner less outer angle, so that friction of forward slip twists both chains positively.
    pub stator_twist: Vec<T>,
    /// Of the inertias of the stator, rad/s.
    pub stator_speed: Vec<T>,
}

/// A jump of the relative velocity.
#[derive(Debug, Clone, PartialEq)]
pub struct Kick<T = f64> {
    /// When: a time, or the loss of stability.
    pub time: KickTime<T>,
    /// delta, rad/s.
    pub relative_velocity: T,
    /// Which surface takes it.
    pub on: KickSide,
}

/// Which surface takes a kick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum KickSide {
    /// Both, so that momentum is kept: phi2_dot += delta J_1/(J_1 + J_2), phi1_dot -= delta J_2/(J_1 + J_2).
    #[default]
    Both,
    /// phi2_dot += delta.
    Rotor,
    /// phi1_dot -= delta.
    Stator,
}

impl<T> Train<T> {
    /// How many shafts there have to be.
    pub fn shafts(&self) -> usize {
        match self.end {
            End::Free => self.inertia.len().saturating_sub(1),
            End::Fixed | End::Driven(_) => self.inertia.len(),
        }
    }

    /// Whether the surface has no inertia of its own: it moves as the far end does.
    pub fn is_rigid(&self) -> bool {
        self.inertia.is_empty()
    }
}

impl<T, L> System<T, L> {
    /// Every signal that drives the chains or presses the surfaces together, and is not an actuation of the axial mode.
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
