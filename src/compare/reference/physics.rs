//! What the channels of the reference are measured by.

use super::super::Channel;
use crate::friction::Law;
use crate::model::Parameters;
use crate::model::axial::AxialMotion;
use crate::model::torsion::TorsionModel;

/// The physics of the reference, and what its channels are measured by.
#[derive(Debug, Clone)]
pub struct Physics {
    /// The torsional equations.
    pub torsion: TorsionModel,
    /// The axial motion in closed form.
    pub axial: AxialMotion,
    /// mu r F / k_t with the largest mu and force: the twist that friction causes, rad.
    pub twist: f64,
    /// T_n, s.
    pub natural_period: f64,
    /// m, kg.
    pub(super) mass: f64,
    /// k_e, N/m.
    pub(super) stiffness: f64,
    /// c_a, N s/m.
    pub(super) damping: f64,
    initial_speed: f64,
}

impl Physics {
    /// Of one case.
    pub fn new(parameters: &Parameters) -> Physics {
        let torsion = TorsionModel::new(parameters);
        let axial = parameters.axial_motion();
        let friction = parameters
            .friction
            .law
            .typical_coefficient(parameters.initial.speed.abs());
        Physics {
            twist: friction * parameters.contact.radius * axial.force.largest() / parameters.torsion.stiffness,
            natural_period: torsion.natural_period(),
            torsion,
            mass: parameters.axial.mass,
            stiffness: parameters.axial.stiffness,
            damping: parameters.axial.damping,
            initial_speed: parameters.initial.speed.abs(),
            axial,
        }
    }

    /// The size that a channel has in stick-slip, in its SI unit: what friction and the actuating force make of it.
    pub fn scale(&self, channel: Channel) -> f64 {
        let omega = self.torsion.natural_angular_frequency();
        let force = self.axial.force.largest();
        match channel {
            Channel::Z => force / self.stiffness,
            Channel::ZDot => force / self.stiffness * omega,
            Channel::Phi1 | Channel::RotorTwist => self.twist,
            Channel::Theta | Channel::Phi2 | Channel::SlipDisplacement => 1.0,
            Channel::NormalForce => force,
            Channel::FrictionTorque | Channel::TransmittedTorque => self.twist * self.torsion.torsion.stiffness,
            _ => self.twist * omega,
        }
    }

    /// T_r or T_s from twist (rad) and twist rate (rad/s), N m.
    pub(crate) fn twist_torque(&self, twist: f64, rate: f64) -> f64 {
        self.torsion.torsion.stiffness * twist + self.torsion.torsion.damping * rate
    }

    /// The speed of an oscillation that friction causes, rad/s.
    pub fn speed(&self) -> f64 {
        self.twist * self.torsion.natural_angular_frequency()
    }

    /// The initial speed, rad/s.
    pub(crate) fn initial_speed(&self) -> f64 {
        self.initial_speed
    }
}
