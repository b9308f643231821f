//! Channels of comparisons, and their names in other programs.

use std::borrow::Cow;
use stickslip_case::quantity::Dimension;
use stickslip_engine::simulation::{CourseQuantity, TrainPart};
use stickslip_system::record::channel;

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
    /// A recorded channel that is a product of two others.
    Product(&'static str),
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
    /// Channels with an own role that every result file has, in the order of reports.
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

    /// Products of two channels that every result file has.
    pub fn products() -> impl Iterator<Item = Channel> {
        let products = channel::all().filter(|channel| channel.product.is_some());
        products.map(|channel| Channel::Product(channel.name))
    }

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
            Channel::Deflection => "bristle_deflection".into(),
            Channel::NormalImpulse => "normal_impulse".into(),
            Channel::FrictionImpulse => "friction_impulse".into(),
            _ => self.recorded().into(),
        }
    }

    /// Name in the registry of recorded channels; empty without an entry.
    fn recorded(self) -> &'static str {
        match self {
            Channel::RelativeVelocity => "relative_velocity",
            Channel::RotorTwist => "rotor_twist",
            Channel::RotorTwistRate => "rotor_twist_rate",
            Channel::Phi1 => "phi1",
            Channel::Phi1Dot => "phi1_dot",
            Channel::ThetaDot => "theta_dot",
            Channel::Phi2Dot => "phi2_dot",
            Channel::Theta => "theta",
            Channel::Phi2 => "phi2",
            Channel::SlipDisplacement => "slip_displacement",
            Channel::Z => "z",
            Channel::ZDot => "z_dot",
            Channel::NormalForce => "normal_force",
            Channel::FrictionTorque => "friction_torque",
            Channel::TransmittedTorque => "transmitted_torque",
            Channel::Product(name) => name,
            _ => "",
        }
    }

    /// Its dimension in rotation.
    pub fn dimension(self) -> Dimension {
        let of_registry = || Dimension::of_udunits(channel::find(self.recorded())?.unit);
        match self {
            Channel::TwistRate(_) | Channel::Speed(_) => Dimension::AngularVelocity,
            Channel::NormalImpulse => Dimension::Impulse,
            Channel::FrictionImpulse => Dimension::AngularImpulse,
            _ => of_registry().unwrap_or(Dimension::Angle),
        }
    }

    /// Names in other programs, in lower case.
    pub(crate) fn aliases(self) -> impl Iterator<Item = &'static str> {
        let aliases = match self {
            Channel::Deflection => "z",
            _ => channel::find(self.recorded()).map_or("", |channel| channel.aliases),
        };
        aliases.split_whitespace()
    }

    pub(crate) fn is_axial(self) -> bool {
        matches!(self, Channel::Z | Channel::ZDot)
    }

    /// Its function of time; `outermost` is the rotor's outermost inertia.
    pub(crate) fn quantity(self, outermost: usize) -> CourseQuantity {
        match self {
            Channel::Twist(part) => CourseQuantity::Twist(part),
            Channel::TwistRate(part) => CourseQuantity::TwistRate(part),
            Channel::Speed(part) => CourseQuantity::Speed(part),
            Channel::Angle(part) => CourseQuantity::Angle(part),
            Channel::Deflection => CourseQuantity::Deflection,
            // Impulses are integrated from forces and torques.
            _ => CourseQuantity::of_channel(self.recorded(), outermost).unwrap_or(CourseQuantity::Transmitted),
        }
    }
}
