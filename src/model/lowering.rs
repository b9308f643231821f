//! The short form of a system as the general one: `[torsion]` says of two disks what two trains say of any chains.

use super::Parameters;
use super::trains::parameters::AxialOf;
use super::trains::{ContactLaw, End, Initial, Pressing, Train, Trains};

impl From<&Parameters> for Trains {
    /// A rotor of surface and inertia on one shaft, free, and a surface on a fixed shaft. Its equations are those of the short
    /// form. It has no kicks, as one that waits for the instability has no time yet; and it breaks away by T_f, whatever the
    /// short form tests.
    fn from(parameters: &Parameters) -> Trains {
        let torsion = &parameters.torsion;
        let train = |inertia: Vec<f64>, end: End| Train {
            viscous: vec![0.0; inertia.len()],
            inertia,
            stiffness: vec![torsion.stiffness],
            damping: vec![torsion.damping],
            end,
            torque: None,
        };
        let axial = &parameters.axial;
        Trains {
            rotor: train(vec![torsion.surface_inertia, torsion.rotor_inertia], End::Free),
            stator: train(vec![torsion.surface_inertia], End::Fixed),
            radius: parameters.contact.radius,
            pressing: Pressing::Axial {
                axial: AxialOf {
                    mass: axial.mass,
                    stiffness: axial.stiffness,
                    damping: axial.damping,
                    ringing_floor: axial.ringing_floor,
                },
                actuation: parameters.actuation.clone(),
            },
            breakaway: parameters.friction.breakaway,
            law: parameters.friction.law.clone(),
            contact: ContactLaw::StickSlip,
            initial: Initial {
                rotor_twist: vec![0.0],
                rotor_speed: vec![parameters.initial.speed; 2],
                stator_twist: vec![0.0],
                stator_speed: vec![0.0],
            },
            kicks: Vec::new(),
        }
    }
}
