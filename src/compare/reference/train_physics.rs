//! What the channels of a reference of two trains are measured by.

use super::super::Channel;
use super::super::vocabulary::{Known, Vocabulary};
use crate::case::TrainCase;
use crate::friction::Law;
use crate::model::Mode;
use crate::model::trains::system::{DAMPING_LOSS, Engagement, FRICTION_LOSS, Side, TrainSystem, WORK};
use crate::model::trains::{End, Trains};
use crate::record::sequence::SequenceEvent;
use crate::simulation::trains::{Course, Part, Quantity, Which};
use serde::Serialize;
use std::f64::consts::TAU;

/// By which times are measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TimeScale {
    /// s.
    pub period: f64,
    /// What has this period, in words.
    pub of: String,
    /// It is a mode of the trains.
    #[serde(skip)]
    pub is_mode: bool,
    /// What is named has a period.
    #[serde(skip)]
    pub has_period: bool,
}

/// The physics of a reference of two trains.
#[derive(Debug)]
pub struct TrainPhysics {
    /// Its case.
    pub case: TrainCase,
    pub(crate) course: Course,
    pub(crate) vocabulary: Vocabulary,
    /// By which times are measured.
    pub scale: TimeScale,
    /// The channels that make up the state, in its order.
    pub(crate) state: Vec<Channel>,
    /// The rest of the state has these indices.
    places: Vec<usize>,
}

fn course(case: &TrainCase) -> Course {
    Course::new(&case.parameters, case.threshold.unwrap_or(0.0), &case.solver)
}

impl TrainPhysics {
    /// Of a case whose run has these events and this end (s).
    pub fn new(case: TrainCase, word: &[SequenceEvent], end: f64) -> TrainPhysics {
        let course = course(&case);
        let vocabulary = Vocabulary::of_trains(&case.parameters, case.motion);
        let (mut state, mut places) = (Vec::new(), Vec::new());
        let system = course.system();
        for (of, side) in [(Which::Rotor, &system.rotor), (Which::Stator, &system.stator)] {
            for index in 0..side.shafts() {
                let part = Part { of, index };
                state.extend([Channel::Twist(part), Channel::TwistRate(part)]);
                places.extend([side.twists + 2 * index, side.twists + 2 * index + 1]);
            }
            if let Some(place) = side.speed {
                let index = side.inertia.len() - 1;
                state.push(Channel::Speed(Part { of, index }));
                places.push(place);
            }
        }
        if let Engagement::Bristles(.., place) = system.engagement {
            state.push(Channel::Deflection);
            places.push(place);
        }
        let state = state
            .into_iter()
            .map(|channel| vocabulary.canonical(channel).unwrap_or(channel))
            .collect();
        TrainPhysics {
            scale: time_scale(&course, word, end),
            course,
            vocabulary,
            state,
            places,
            case,
        }
    }

    /// The motion from known states on.
    pub(crate) fn course(&self) -> Course {
        course(&self.case)
    }

    pub(crate) fn system(&self) -> &TrainSystem {
        self.course.system()
    }

    /// The state of which `value` gives the channels of [`Self::state`], by their places; losses and work are zero.
    pub(crate) fn y(&self, value: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut y = vec![0.0; self.system().dimension];
        for (k, &place) in self.places.iter().enumerate() {
            y[place] = value(k);
        }
        y
    }

    /// T_f of a state, N m.
    pub(crate) fn transmitted(&self, t: f64, y: &[f64]) -> f64 {
        self.system().transmitted_torque(&self.course.outside(t), y)
    }

    /// mu_0 r F_n, N m.
    pub(crate) fn limit(&self, t: f64) -> f64 {
        self.system().breakaway_torque(self.course.outside(t).normal_force)
    }

    /// Whether the contact has a stick.
    pub(crate) fn sticks(&self) -> bool {
        self.system().engagement == Engagement::StickSlip
    }

    /// The speed (rad/s) below which a contact without stick counts as stuck; `None` of one that sticks.
    pub(crate) fn threshold(&self) -> Option<f64> {
        self.case.threshold.filter(|_| !self.sticks())
    }

    /// What a contact does at a relative velocity that counts as zero up to `tolerance`, rad/s.
    pub(crate) fn mode(&self, w: f64, tolerance: f64) -> Mode {
        match self.system().engagement {
            Engagement::StickSlip if w.abs() <= tolerance => Mode::Stick,
            Engagement::StickSlip => Mode::sliding(w),
            _ => Mode::Engaged,
        }
    }

    /// Kinetic and elastic energy of a state (J), the power of friction (W), and that of the dampers less that of the drives (W).
    pub(crate) fn energy(&self, mode: Mode, t: f64, y: &[f64]) -> (f64, f64, f64) {
        let system = self.system();
        let mut rates = vec![0.0; system.dimension];
        self.course.rates(mode, t, y, &mut rates);
        let outside = self.course.outside(t);
        let power = |index: usize| rates[system.slip + index];
        (
            system.kinetic_energy(&outside, y) + system.elastic_energy(y),
            power(FRICTION_LOSS),
            power(DAMPING_LOSS) - power(WORK),
        )
    }

    /// Angle or speed of a driven end, rad or rad/s.
    pub(crate) fn driven(&self, known: Known, t: f64) -> f64 {
        let (angle, speed) = self.course.ends(t)[known.of as usize];
        if known.is_rate { speed } else { angle }
    }

    fn side(&self, of: Which) -> &Side {
        match of {
            Which::Rotor => &self.system().rotor,
            Which::Stator => &self.system().stator,
        }
    }

    /// The size of the speeds of a train.
    fn speed_of(&self, of: Which) -> f64 {
        let (side, sizes) = (self.side(of), self.course.sizes());
        let rates = (0..side.shafts()).map(|i| sizes[side.twists + 2 * i + 1]);
        rates.chain(side.speed.map(|place| sizes[place])).fold(0.0, f64::max)
    }

    /// The size of the angles of a train that is tied.
    fn angle_of(&self, of: Which) -> f64 {
        let (side, sizes) = (self.side(of), self.course.sizes());
        match side.speed {
            None => (0..side.shafts()).map(|i| sizes[side.twists + 2 * i]).sum(),
            Some(_) => 1.0,
        }
    }

    /// The size of the relative velocity, rad/s.
    pub(crate) fn speed(&self) -> f64 {
        Which::BOTH.map(|of| self.speed_of(of)).into_iter().fold(0.0, f64::max)
    }

    /// The size of a channel in its SI unit.
    pub(crate) fn size(&self, channel: Channel) -> f64 {
        use Which::{Rotor, Stator};
        let (system, sizes) = (self.system(), self.course.sizes());
        let size = match channel {
            Channel::RelativeVelocity => self.speed(),
            Channel::RotorTwist => sizes[system.rotor.twists],
            Channel::RotorTwistRate => sizes[system.rotor.twists + 1],
            Channel::Twist(Part { of, index }) => sizes[self.side(of).twists + 2 * index],
            Channel::TwistRate(Part { of, index }) => sizes[self.side(of).twists + 2 * index + 1],
            Channel::Speed(Part { of, .. }) => self.speed_of(of),
            Channel::Phi2Dot | Channel::ThetaDot => self.speed_of(Rotor),
            Channel::Phi1Dot => self.speed_of(Stator),
            Channel::Angle(Part { of, .. }) => self.angle_of(of),
            Channel::Phi2 | Channel::Theta => self.angle_of(Rotor),
            Channel::Phi1 => self.angle_of(Stator),
            Channel::SlipDisplacement => 1.0,
            Channel::Deflection => match system.engagement {
                Engagement::Bristles(.., place) => sizes[place],
                _ => 1.0,
            },
            Channel::NormalForce => self.largest_force(),
            Channel::FrictionTorque | Channel::TransmittedTorque => {
                let mu = system.breakaway.max(system.law.typical_coefficient(self.speed()));
                mu * system.radius * self.largest_force()
            }
            Channel::Z | Channel::ZDot | Channel::NormalImpulse | Channel::FrictionImpulse => 1.0,
        };
        if size > 0.0 { size } else { 1.0 }
    }

    fn largest_force(&self) -> f64 {
        self.course.largest_force()
    }

    /// What a channel is as a function of time.
    pub(crate) fn quantity(&self, channel: Channel) -> Quantity {
        use Which::{Rotor, Stator};
        let part = |of, index| Part { of, index };
        let outermost = self.system().rotor.inertia.len().saturating_sub(1);
        match channel {
            Channel::RelativeVelocity => Quantity::RelativeVelocity,
            Channel::RotorTwist => Quantity::Twist(part(Rotor, 0)),
            Channel::RotorTwistRate => Quantity::TwistRate(part(Rotor, 0)),
            Channel::Twist(part) => Quantity::Twist(part),
            Channel::TwistRate(part) => Quantity::TwistRate(part),
            Channel::Speed(part) => Quantity::Speed(part),
            Channel::Angle(part) => Quantity::Angle(part),
            Channel::Phi1 => Quantity::Angle(part(Stator, 0)),
            Channel::Phi1Dot => Quantity::Speed(part(Stator, 0)),
            Channel::Phi2 => Quantity::Angle(part(Rotor, 0)),
            Channel::Phi2Dot => Quantity::Speed(part(Rotor, 0)),
            Channel::Theta => Quantity::Angle(part(Rotor, outermost)),
            Channel::ThetaDot => Quantity::Speed(part(Rotor, outermost)),
            Channel::SlipDisplacement => Quantity::Slip,
            Channel::Deflection => Quantity::Deflection,
            Channel::NormalForce => Quantity::NormalForce,
            Channel::FrictionTorque => Quantity::Interface,
            // z and z' are in no vocabulary of trains, and impulses are integrated from forces and torques.
            Channel::TransmittedTorque
            | Channel::Z
            | Channel::ZDot
            | Channel::NormalImpulse
            | Channel::FrictionImpulse => Quantity::Transmitted,
        }
    }

    /// The channel of which an attractor states the range; `None` of a slip displacement.
    pub(crate) fn position(&self) -> Option<Channel> {
        let channel = match self.course.position()? {
            Quantity::Angle(part) => Channel::Angle(part),
            Quantity::Twist(part) => Channel::Twist(part),
            _ => return None,
        };
        self.vocabulary.canonical(channel)
    }
}

/// The period of a surface on its own shaft, its neighbours held, the shorter of two: for the paper's brake 2 pi sqrt(J/k_t).
/// Else that of the fastest harmonic that drives the case, else the middle time between two events.
fn time_scale(course: &Course, word: &[SequenceEvent], end: f64) -> TimeScale {
    let system = course.system();
    let of_surfaces = [(&system.rotor, "rotor"), (&system.stator, "stator")];
    let of_surfaces = of_surfaces.into_iter().filter_map(|(side, name)| {
        let (inertia, stiffness) = (side.inertia.first()?, side.stiffness.first().filter(|k| **k > 0.0)?);
        Some((TAU * (inertia / stiffness).sqrt(), name))
    });
    if let Some((period, name)) = of_surfaces.min_by(|a, b| a.0.total_cmp(&b.0)) {
        return TimeScale {
            period,
            of: format!("the surface of the {name} on its shaft"),
            is_mode: true,
            has_period: true,
        };
    }
    if let Some(period) = course.period_of_signals() {
        return TimeScale {
            period,
            of: "the fastest harmonic that drives the case".to_owned(),
            is_mode: false,
            has_period: true,
        };
    }
    let mut intervals: Vec<f64> = word.windows(2).map(|pair| pair[1].time - pair[0].time).collect();
    intervals.retain(|interval| *interval > 0.0);
    intervals.sort_by(f64::total_cmp);
    match intervals.get(intervals.len() / 2) {
        Some(&period) => TimeScale {
            period,
            of: "the middle time between two events: nothing in the case has a period".to_owned(),
            is_mode: false,
            has_period: false,
        },
        None => TimeScale {
            period: if end > 0.0 { 0.1 * end } else { 1.0 },
            of: "a tenth of the run: nothing in the case has a period".to_owned(),
            is_mode: false,
            has_period: false,
        },
    }
}

/// Whether trains are those of the short form: a rotor of surface and inertia on one shaft, free, and a surface on a fixed shaft.
pub(crate) fn is_brake(trains: &Trains) -> bool {
    let (rotor, stator) = (&trains.rotor, &trains.stator);
    let ends = matches!((&rotor.end, &stator.end), (End::Free, End::Fixed));
    ends && rotor.inertia.len() == 2 && stator.inertia.len() == 1
}
