//! Conversion of two equal disks to a system of two chains, and back.

use super::system::{self, ContactLaw, End, Initial, KickSide, Pressing, System, Train};
use super::{Contact, DiskInitial as AtRest, DiskKick, Parameters, Torsion};
use crate::friction::Friction;

impl From<&Parameters> for System {
    /// A free rotor, whose surface and inertia are on one shaft, and a surface on a shaft to the ground. The
    /// equations are those of the short form.
    fn from(disks: &Parameters) -> System {
        let torsion = &disks.torsion;
        let train = |inertia: Vec<f64>, end: End| Train {
            viscous: vec![0.0; inertia.len()],
            inertia,
            stiffness: vec![torsion.stiffness],
            damping: vec![torsion.damping],
            end,
            torque: None,
        };
        let kick = |kick: &DiskKick| system::Kick {
            time: kick.time,
            relative_velocity: kick.relative_velocity,
            on: KickSide::Both,
        };
        System {
            rotor: train(vec![torsion.surface_inertia, torsion.rotor_inertia], End::Free),
            stator: train(vec![torsion.surface_inertia], End::Fixed),
            radius: disks.contact.radius,
            pressing: Pressing::Axial {
                axial: disks.axial,
                actuation: disks.actuation.clone(),
            },
            breakaway: disks.friction.breakaway,
            breakaway_test: disks.contact.breakaway_test,
            law: disks.friction.law.clone(),
            contact: ContactLaw::StickSlip,
            initial: Initial {
                rotor_twist: vec![0.0],
                rotor_speed: vec![disks.initial.speed; 2],
                stator_twist: vec![0.0],
                stator_speed: vec![0.0],
            },
            kicks: disks.perturbations.iter().map(kick).collect(),
        }
    }
}

impl Parameters {
    /// The two disks of a system; `None` if the short form cannot express the system.
    pub fn of(system: &System) -> Option<Parameters> {
        let ([surface_inertia, rotor_inertia], [stiffness], [damping], Pressing::Axial { axial, actuation }) = (
            system.rotor.inertia.as_slice(),
            system.stator.stiffness.as_slice(),
            system.stator.damping.as_slice(),
            &system.pressing,
        ) else {
            return None;
        };
        let disks = Parameters {
            axial: *axial,
            actuation: actuation.clone(),
            torsion: Torsion {
                rotor_inertia: *rotor_inertia,
                surface_inertia: *surface_inertia,
                stiffness: *stiffness,
                damping: *damping,
            },
            contact: Contact {
                radius: system.radius,
                breakaway_test: system.breakaway_test,
            },
            friction: Friction {
                breakaway: system.breakaway,
                law: system.law.clone(),
            },
            initial: AtRest {
                speed: *system.initial.rotor_speed.first()?,
            },
            perturbations: system
                .kicks
                .iter()
                .map(|kick| DiskKick {
                    time: kick.time,
                    relative_velocity: kick.relative_velocity,
                })
                .collect(),
        };
        (System::from(&disks) == *system).then_some(disks)
    }
}
