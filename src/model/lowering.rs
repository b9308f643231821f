//! The short form of a system as the general one: `[torsion]` says of two disks what two trains say of any chains.

use super::trains::parameters::AxialOf;
use super::trains::{self, ContactLaw, End, ExactTrains, Initial, KickSide, Pressing, Train, Trains};
use super::{BreakawayTest, ExactLaw, ExactParameters, Kick, Parameters};
use crate::friction::FrictionLaw;
use crate::signal::Signal;
use num_traits::Zero;

/// The numbers of the short form, of which the general one is made.
struct Disks<'a, T, L> {
    rotor_inertia: &'a T,
    surface_inertia: &'a T,
    stiffness: &'a T,
    damping: &'a T,
    speed: &'a T,
    radius: &'a T,
    breakaway: &'a T,
    breakaway_test: BreakawayTest,
    law: &'a L,
    axial: AxialOf<T>,
    actuation: &'a Signal<T>,
    kicks: &'a [Kick<T>],
}

impl<T: Clone + Zero, L: Clone> Disks<'_, T, L> {
    /// A rotor of surface and inertia on one shaft, free, and a surface on a shaft that ends in the ground. Its equations are those
    /// of the short form.
    fn trains(self) -> Trains<T, L> {
        let train = |inertia: Vec<T>, end: End<T>| Train {
            viscous: vec![T::zero(); inertia.len()],
            inertia,
            stiffness: vec![self.stiffness.clone()],
            damping: vec![self.damping.clone()],
            end,
            torque: None,
        };
        let kick = |kick: &Kick<T>| trains::Kick {
            time: kick.time.clone(),
            relative_velocity: kick.relative_velocity.clone(),
            on: KickSide::Both,
        };
        Trains {
            rotor: train(
                vec![self.surface_inertia.clone(), self.rotor_inertia.clone()],
                End::Free,
            ),
            stator: train(vec![self.surface_inertia.clone()], End::Fixed),
            radius: self.radius.clone(),
            pressing: Pressing::Axial {
                axial: self.axial,
                actuation: self.actuation.clone(),
            },
            breakaway: self.breakaway.clone(),
            breakaway_test: self.breakaway_test,
            law: self.law.clone(),
            contact: ContactLaw::StickSlip,
            initial: Initial {
                rotor_twist: vec![T::zero()],
                rotor_speed: vec![self.speed.clone(); 2],
                stator_twist: vec![T::zero()],
                stator_speed: vec![T::zero()],
            },
            kicks: self.kicks.iter().map(kick).collect(),
        }
    }
}

impl From<&Parameters> for Trains {
    fn from(parameters: &Parameters) -> Trains {
        let Parameters {
            axial,
            torsion,
            contact,
            friction,
            ..
        } = parameters;
        Disks::<f64, FrictionLaw> {
            rotor_inertia: &torsion.rotor_inertia,
            surface_inertia: &torsion.surface_inertia,
            stiffness: &torsion.stiffness,
            damping: &torsion.damping,
            speed: &parameters.initial.speed,
            radius: &contact.radius,
            breakaway: &friction.breakaway,
            breakaway_test: contact.breakaway_test,
            law: &friction.law,
            axial: AxialOf {
                mass: axial.mass,
                stiffness: axial.stiffness,
                damping: axial.damping,
                ringing_floor: axial.ringing_floor,
            },
            actuation: &parameters.actuation,
            kicks: &parameters.perturbations,
        }
        .trains()
    }
}

impl From<&ExactParameters> for ExactTrains {
    fn from(parameters: &ExactParameters) -> ExactTrains {
        Disks::<_, ExactLaw> {
            rotor_inertia: &parameters.rotor_inertia,
            surface_inertia: &parameters.surface_inertia,
            stiffness: &parameters.torsional_stiffness,
            damping: &parameters.torsional_damping,
            speed: &parameters.speed,
            radius: &parameters.radius,
            breakaway: &parameters.breakaway,
            breakaway_test: parameters.breakaway_test,
            law: &parameters.law,
            axial: AxialOf {
                mass: parameters.mass.clone(),
                stiffness: parameters.axial_stiffness.clone(),
                damping: parameters.axial_damping.clone(),
                ringing_floor: parameters.ringing_floor.clone(),
            },
            actuation: &parameters.actuation,
            kicks: &parameters.kicks,
        }
        .trains()
    }
}
