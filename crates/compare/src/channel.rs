//! Channels of comparisons, and their names in other programs.

use std::borrow::Cow;
use stickslip_case::quantity::Dimension;
use stickslip_engine::simulation::{CourseQuantity, TrainPart, TrainSide};

/// A quantity over time that both runs have, in SI units and radians. Names and signs are those of /trajectory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Channel {
    /// omega_r = phi_2' - phi_1', rad/s.
    RelativeVelocity,
    /// u = theta - phi_2, rad.
    RotorTwist,
    /// u', rad/s.
    RotorTwistRate,
    /// phi_1, the stator twist, rad.
    Phi1,
    /// phi_1', rad/s.
    Phi1Dot,
    /// theta', rad/s.
    ThetaDot,
    /// phi_2', rad/s.
    Phi2Dot,
    /// theta, rad.
    Theta,
    /// phi_2, rad.
    Phi2,
    /// phi_2 - phi_1, rad.
    SlipDisplacement,
    /// z, m.
    Z,
    /// z', m/s.
    ZDot,
    /// F_n, N.
    NormalForce,
    /// The torque on the stator surface through the interface, N m.
    FrictionTorque,
    /// T_f = (T_r + T_s)/2, N m.
    TransmittedTorque,
    /// Twist of a shaft, rad.
    Twist(TrainPart),
    /// Twist rate of a shaft, rad/s.
    TwistRate(TrainPart),
    /// Speed of an inertia, rad/s.
    Speed(TrainPart),
    /// Angle of an inertia, rad: no column of a result, but integrated by plain solvers.
    Angle(TrainPart),
    /// z of the bristles.
    Deflection,
    /// Integral of F_n over time, N s: no column of a result, but written by explicit finite-element codes.
    NormalImpulse,
    /// Integral of the friction torque over time, N m s: likewise.
    FrictionImpulse,
}

impl Channel {
    /// Channels that every result file has, in the order of reports.
    pub const ALL: [Channel; 15] = [
        Channel::RelativeVelocity,
        Channel::RotorTwist,
        Channel::RotorTwistRate,
        Channel::Phi1,
        Channel::Phi1Dot,
        Channel::ThetaDot,
        Channel::Phi2Dot,
        Channel::Theta,
        Channel::Phi2,
        Channel::SlipDisplacement,
        Channel::Z,
        Channel::ZDot,
        Channel::NormalForce,
        Channel::FrictionTorque,
        Channel::TransmittedTorque,
    ];

    pub(crate) const IMPULSES: [(Channel, Channel); 2] = [
        (Channel::NormalImpulse, Channel::NormalForce),
        (Channel::FrictionImpulse, Channel::FrictionTorque),
    ];

    pub(crate) fn is_impulse(self) -> bool {
        Channel::IMPULSES.iter().any(|(impulse, _)| *impulse == self)
    }

    /// Name of its variable in /trajectory.
    pub fn name(self) -> Cow<'static, str> {
        let of = |part: TrainPart, what: &str| Cow::Owned(format!("{}_{what}_{}", part.of.name(), part.index));
        match self {
            Channel::Twist(part) => of(part, "twist"),
            Channel::TwistRate(part) => of(part, "twist_rate"),
            Channel::Speed(part) => of(part, "speed"),
            Channel::Angle(part) => of(part, "angle"),
            _ => Cow::Borrowed(self.facts().0),
        }
    }

    /// Its dimension in rotation.
    pub fn dimension(self) -> Dimension {
        self.facts().1
    }

    /// Names in other programs, in lower case.
    pub(crate) fn aliases(self) -> impl Iterator<Item = &'static str> {
        self.facts().2.split_whitespace()
    }

    pub(crate) fn is_axial(self) -> bool {
        matches!(self, Channel::Z | Channel::ZDot)
    }

    fn facts(self) -> (&'static str, Dimension, &'static str) {
        use Dimension::{Angle, AngularImpulse, AngularVelocity, Force, Impulse, Length, Torque, Velocity};
        match self {
            Channel::RelativeVelocity => (
                "relative_velocity",
                AngularVelocity,
                "omega_r omega_rel w_rel w_r v_rel",
            ),
            Channel::RotorTwist => ("rotor_twist", Angle, "u twist"),
            Channel::RotorTwistRate => ("rotor_twist_rate", AngularVelocity, "u_dot twist_rate rotor_twist_dot"),
            Channel::Phi1 => ("phi1", Angle, "phi_1 stator_twist v"),
            Channel::Phi1Dot => ("phi1_dot", AngularVelocity, "phi_1_dot stator_twist_rate v_dot dphi1"),
            Channel::ThetaDot => ("theta_dot", AngularVelocity, "omega rotor_speed dtheta"),
            Channel::Phi2Dot => ("phi2_dot", AngularVelocity, "phi_2_dot dphi2"),
            Channel::Theta => ("theta", Angle, "rotor_angle"),
            Channel::Phi2 => ("phi2", Angle, "phi_2"),
            Channel::SlipDisplacement => ("slip_displacement", Angle, "slip_distance"),
            Channel::Z => ("z", Length, "axial_displacement"),
            Channel::ZDot => ("z_dot", Velocity, "axial_velocity dz"),
            Channel::NormalForce => ("normal_force", Force, "f_n fn contact_force"),
            Channel::FrictionTorque => ("friction_torque", Torque, "t_friction"),
            Channel::TransmittedTorque => ("transmitted_torque", Torque, "t_f"),
            Channel::Twist(_) | Channel::Angle(_) => ("angle", Angle, ""),
            Channel::TwistRate(_) | Channel::Speed(_) => ("speed", AngularVelocity, ""),
            Channel::Deflection => ("bristle_deflection", Angle, "z"),
            Channel::NormalImpulse => ("normal_impulse", Impulse, ""),
            Channel::FrictionImpulse => ("friction_impulse", AngularImpulse, ""),
        }
    }

    /// Its function of time; `outermost` is the rotor's outermost inertia.
    pub(crate) fn quantity(self, outermost: usize) -> CourseQuantity {
        let rotor = |index| TrainPart {
            of: TrainSide::Rotor,
            index,
        };
        let stator = TrainPart {
            of: TrainSide::Stator,
            index: 0,
        };
        match self {
            Channel::RelativeVelocity => CourseQuantity::RelativeVelocity,
            Channel::RotorTwist => CourseQuantity::Twist(rotor(0)),
            Channel::RotorTwistRate => CourseQuantity::TwistRate(rotor(0)),
            Channel::Twist(part) => CourseQuantity::Twist(part),
            Channel::TwistRate(part) => CourseQuantity::TwistRate(part),
            Channel::Speed(part) => CourseQuantity::Speed(part),
            Channel::Angle(part) => CourseQuantity::Angle(part),
            Channel::Phi1 => CourseQuantity::Angle(stator),
            Channel::Phi1Dot => CourseQuantity::Speed(stator),
            Channel::Phi2 => CourseQuantity::Angle(rotor(0)),
            Channel::Phi2Dot => CourseQuantity::Speed(rotor(0)),
            Channel::Theta => CourseQuantity::Angle(rotor(outermost)),
            Channel::ThetaDot => CourseQuantity::Speed(rotor(outermost)),
            Channel::SlipDisplacement => CourseQuantity::Slip,
            Channel::Deflection => CourseQuantity::Deflection,
            Channel::NormalForce => CourseQuantity::NormalForce,
            Channel::FrictionTorque => CourseQuantity::Interface,
            Channel::Z => CourseQuantity::AxialDisplacement,
            Channel::ZDot => CourseQuantity::AxialVelocity,
            // Impulses are integrated from forces and torques.
            Channel::TransmittedTorque | Channel::NormalImpulse | Channel::FrictionImpulse => {
                CourseQuantity::Transmitted
            }
        }
    }
}
