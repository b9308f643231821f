//! What a reference is a run of: a brake, or two trains.

use super::super::Channel;
use super::super::vocabulary::{Known, Vocabulary};
use super::{Curve, Physics, TimeScale, TrainPhysics, TrainWalk, Walk};
use crate::model::Mode;
use crate::results::ResultError;

/// The part of a reference that differs between a brake and two trains.
#[derive(Debug)]
pub enum Subject {
    /// The two-disk brake.
    Brake(Box<Physics>, Vocabulary),
    /// Two trains.
    Trains(Box<TrainPhysics>),
}

/// The channels that the torques of a brake follow from.
const TWISTS: [Channel; 4] = [
    Channel::RotorTwist,
    Channel::RotorTwistRate,
    Channel::Phi1,
    Channel::Phi1Dot,
];

/// The channels that the energy of a brake follows from.
pub(crate) const MOTION: [Channel; 5] = [
    Channel::RotorTwist,
    Channel::RotorTwistRate,
    Channel::Phi1,
    Channel::Phi1Dot,
    Channel::ThetaDot,
];

impl Subject {
    /// What can be compared.
    pub fn vocabulary(&self) -> &Vocabulary {
        match self {
            Subject::Brake(_, vocabulary) => vocabulary,
            Subject::Trains(physics) => &physics.vocabulary,
        }
    }

    /// Two trains.
    pub fn trains(&self) -> Option<&TrainPhysics> {
        match self {
            Subject::Brake(..) => None,
            Subject::Trains(physics) => Some(physics),
        }
    }

    /// By which times are measured, s: T_n of a brake.
    pub fn natural_period(&self) -> f64 {
        match self {
            Subject::Brake(physics, _) => physics.natural_period,
            Subject::Trains(physics) => physics.scale.period,
        }
    }

    /// The same of two trains, with what it is.
    pub fn time_scale(&self) -> Option<&TimeScale> {
        self.trains().map(|physics| &physics.scale)
    }

    /// The angular frequency of [`Self::natural_period`], rad/s.
    pub(crate) fn natural_angular_frequency(&self) -> f64 {
        match self {
            Subject::Brake(physics, _) => physics.torsion.natural_angular_frequency(),
            Subject::Trains(physics) => std::f64::consts::TAU / physics.scale.period,
        }
    }

    /// The size of a channel in its SI unit; before the first event (`sliding`) the speeds of a brake are of that of the initial
    /// one.
    pub(crate) fn size(&self, channel: Channel, sliding: bool) -> f64 {
        match self {
            Subject::Brake(physics, _) => {
                let size = physics.scale(channel);
                let is_speed = matches!(
                    channel,
                    Channel::ThetaDot | Channel::Phi2Dot | Channel::RelativeVelocity
                );
                if sliding && is_speed {
                    size.max(physics.initial_speed())
                } else {
                    size
                }
            }
            Subject::Trains(physics) => physics.size(channel),
        }
    }

    /// The speed of an oscillation that friction causes, rad/s.
    pub(crate) fn speed(&self) -> f64 {
        match self {
            Subject::Brake(physics, _) => physics.speed(),
            Subject::Trains(physics) => physics.speed(),
        }
    }

    /// What [`Self::torques`] takes, in its order.
    pub(crate) fn torque_channels(&self) -> &[Channel] {
        match self {
            Subject::Brake(..) => &TWISTS,
            Subject::Trains(physics) => &physics.state,
        }
    }

    /// T_r and T_s of a brake; twice T_f of two trains. N m.
    #[inline]
    pub(crate) fn torques(&self, time: f64, value: impl Fn(usize) -> f64) -> (f64, f64) {
        match self {
            Subject::Brake(physics, _) => (
                physics.twist_torque(value(0), value(1)),
                physics.twist_torque(value(2), value(3)),
            ),
            Subject::Trains(physics) => {
                let torque = physics.transmitted(time, &physics.y(value));
                (torque, torque)
            }
        }
    }

    /// mu_0 r F_n at a time (s), N m.
    pub(crate) fn limit(&self, time: f64) -> f64 {
        match self {
            Subject::Brake(physics, _) => physics.torsion.breakaway_torque(physics.axial.at(time).pressing_force),
            Subject::Trains(physics) => physics.limit(time),
        }
    }

    /// What an energy balance takes, in its order.
    pub(crate) fn energy_channels(&self) -> &[Channel] {
        match self {
            Subject::Brake(..) => &MOTION,
            Subject::Trains(physics) => &physics.state,
        }
    }

    /// Angle or speed of a driven end; a brake has none.
    pub(crate) fn driven(&self, known: Known, time: f64) -> f64 {
        self.trains().map_or(0.0, |physics| physics.driven(known, time))
    }
}

/// A walk in order of time through a reference.
#[derive(Debug)]
pub(crate) enum AnyWalk<'a> {
    Brake(Box<Walk<'a>>),
    Trains(Box<TrainWalk<'a>>),
}

impl<'a> AnyWalk<'a> {
    /// Start, end and whether an event ends it, of what holds `time`; see [`Walk::at`].
    ///
    /// # Errors
    /// Of the file.
    pub fn at(&mut self, time: f64) -> Result<Option<(f64, f64, bool)>, ResultError> {
        match self {
            AnyWalk::Brake(walk) => Ok(walk.at(time)?.map(|gap| {
                let (left, right) = gap.span();
                (left, right, gap.closes())
            })),
            AnyWalk::Trains(walk) => walk.at(time),
        }
    }

    /// The curves of `channels` there; see [`Walk::curves`].
    pub fn curves(&mut self, channels: &[Channel], curves: &mut Vec<Curve<'a>>) -> Option<bool> {
        match self {
            AnyWalk::Brake(walk) => walk.curves(channels, curves),
            AnyWalk::Trains(walk) => walk.curves(channels, curves),
        }
    }

    /// What the contact does in what was found.
    pub fn mode(&self) -> Mode {
        match self {
            AnyWalk::Brake(walk) => walk.mode(),
            AnyWalk::Trains(walk) => walk.mode(),
        }
    }

    /// theta at the start of what was found, rad: of the angles that a brake's twists may be differences of.
    pub fn rotor_angle(&self) -> f64 {
        match self {
            AnyWalk::Brake(walk) => walk.rotor_angle(),
            AnyWalk::Trains(_) => 0.0,
        }
    }

    /// Whether the equations of trains were integrated again.
    pub fn was_filled(&self) -> bool {
        match self {
            AnyWalk::Brake(_) => false,
            AnyWalk::Trains(walk) => walk.was_filled(),
        }
    }
}
