//! The physics of a reference: its equations, its channels, and the scales of their errors.

use super::super::Channel;
use super::super::vocabulary::{Known, Vocabulary};
use crate::case::Case;
use crate::friction::Law;
use crate::model::Mode;
use crate::model::equations::{Engagement, Outside, Side, SystemEquations};
use crate::model::system::{End, Pressing, System, Train};
use crate::record::sequence::SequenceEvent;
use crate::simulation::{Course, Part, Quantity, Which};
use serde::Serialize;
use std::f64::consts::TAU;

/// By which times are measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TimeScale {
    /// s.
    pub period: f64,
    /// What has this period, in words.
    pub of: String,
    /// It is a mode of the system.
    #[serde(skip)]
    pub is_mode: bool,
    /// What is named has a period.
    #[serde(skip)]
    pub has_period: bool,
}

fn course(case: &Case, trains: &System) -> Course {
    Course::new(trains, case.threshold, &case.solver)
}

/// The physics of a reference.
#[derive(Debug)]
pub struct Physics {
    /// Its case.
    pub(crate) case: Case,
    /// The same in its general form.
    pub(crate) trains: System,
    pub(crate) course: Course,
    pub(crate) vocabulary: Vocabulary,
    /// By which times are measured.
    pub(crate) scale: TimeScale,
    /// The channels that make up the state, in its order.
    pub(crate) state: Vec<Channel>,
    /// Where they are in the state of the equations.
    pub(crate) places: Vec<usize>,
    /// Which of them the torques on the surfaces follow from.
    of_torques: Vec<usize>,
    /// The speed (rad/s) that a system begins with which nothing drives, and which slows down by itself: after the first event it
    /// is over.
    coasting: Option<f64>,
}

/// Whether an end is driven, or a torque acts from outside.
fn is_driven(trains: &System) -> bool {
    let is_driven = |train: &Train| matches!(train.end, End::Driven(_)) || train.torque.is_some();
    is_driven(&trains.rotor) || is_driven(&trains.stator)
}

/// Of two trains of which one is free, and which nothing drives.
fn coasting(trains: &System) -> Option<f64> {
    if is_driven(trains) {
        return None;
    }
    let sides = [
        (&trains.rotor, &trains.initial.rotor_speed),
        (&trains.stator, &trains.initial.stator_speed),
    ];
    let mut free = sides.iter().filter(|(train, _)| matches!(train.end, End::Free));
    let (_, speeds) = free.next().filter(|_| free.next().is_none())?;
    Some(speeds.last().map_or(0.0, |speed| speed.abs()))
}

impl Physics {
    /// Of a case whose run has these events and this end (s).
    pub fn new(case: Case, word: &[SequenceEvent], end: f64) -> Physics {
        let trains = case.system.clone();
        let course = course(&case, &trains);
        let vocabulary = Vocabulary::of(case.words, &trains);
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
        let named = |channel| vocabulary.canonical(channel).unwrap_or(channel);
        let state = state.into_iter().map(named).collect();
        let acts = |place: &usize| {
            let mut y = vec![0.0; system.dimension];
            y[*place] = 1.0;
            system.surface_torques(&Outside::default(), &y) != (0.0, 0.0)
        };
        let of_torques = (0..places.len()).filter(|&k| acts(&places[k])).collect();
        Physics {
            of_torques,
            scale: time_scale(&course, word, end),
            coasting: coasting(&trains),
            course,
            vocabulary,
            state,
            places,
            trains,
            case,
        }
    }

    /// What can be compared.
    pub fn vocabulary(&self) -> &Vocabulary {
        &self.vocabulary
    }

    /// Whether sliding slows down by itself: one train is free, and nothing is driven. Stick-slip then comes from an instability on
    /// the way, and has an end and no period.
    pub(crate) fn coasts(&self) -> bool {
        self.coasting.is_some()
    }

    /// Whether something else than the normal force acts from outside.
    pub(crate) fn is_driven(&self) -> bool {
        is_driven(&self.trains)
    }

    /// By which times are measured, s.
    pub fn natural_period(&self) -> f64 {
        self.scale.period
    }

    /// The angular frequency of [`Self::natural_period`], rad/s.
    pub(crate) fn natural_angular_frequency(&self) -> f64 {
        TAU / self.scale.period
    }

    /// The motion from known states on.
    pub(crate) fn course(&self) -> Course {
        course(&self.case, &self.trains)
    }

    pub(crate) fn system(&self) -> &SystemEquations {
        self.course.system()
    }

    /// The state of which `value` gives the channels of [`Self::state`], by their places; losses and work are zero.
    pub(crate) fn y(&self, value: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut y = vec![0.0; self.system().dimension];
        self.set(&mut y, value);
        y
    }

    /// Writes it into one that is there.
    #[inline]
    pub(crate) fn set(&self, y: &mut [f64], value: impl Fn(usize) -> f64) {
        for (k, &place) in self.places.iter().enumerate() {
            y[place] = value(k);
        }
    }

    /// Where `channels` have those of [`Self::state`]; `None` if they lack one.
    pub(crate) fn columns(&self, channels: &[Channel]) -> Option<Vec<usize>> {
        let place = |channel: &Channel| channels.iter().position(|known| known == channel);
        self.state.iter().map(place).collect()
    }

    /// What [`Self::torques_by`] takes, in its order.
    pub(crate) fn torque_channels(&self) -> Vec<Channel> {
        self.of_torques.iter().map(|&k| self.state[k]).collect()
    }

    /// [`Self::torques`] by the channels that they follow from.
    pub(crate) fn torques_by(&self, t: f64, value: impl Fn(usize) -> f64) -> (f64, f64) {
        let mut y = vec![0.0; self.system().dimension];
        for (k, &of) in self.of_torques.iter().enumerate() {
            y[self.places[of]] = value(k);
        }
        self.torques(t, &y)
    }

    /// T_r and T_s where their mean is T_f, which is where both surfaces have the same inertia; else twice T_f. N m.
    pub(crate) fn torques(&self, t: f64, y: &[f64]) -> (f64, f64) {
        let (system, driving) = (self.system(), self.course.driving(t));
        let (rotor, stator) = system.surface_torques(&driving, y);
        if system.shares() == (0.5, 0.5) {
            (rotor, stator)
        } else {
            let torque = system.transmitted_torque(&driving, y);
            (torque, torque)
        }
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
        (!self.sticks()).then_some(self.case.threshold)
    }

    /// What a contact does at a relative velocity that counts as zero up to `tolerance`, rad/s.
    pub(crate) fn mode(&self, w: f64, tolerance: f64) -> Mode {
        match self.system().engagement {
            Engagement::StickSlip if w.abs() <= tolerance => Mode::Stick,
            Engagement::StickSlip => Mode::sliding(w),
            _ => Mode::Engaged,
        }
    }

    /// Kinetic and elastic energy of a state, J.
    pub(crate) fn energy(&self, t: f64, y: &[f64]) -> f64 {
        let system = self.system();
        system.kinetic_energy(&self.course.driving(t), y) + system.elastic_energy(y)
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
        let free = side.speed.filter(|_| self.coasting.is_none()).map(|place| sizes[place]);
        rates.chain(free).fold(0.0, f64::max)
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

    /// The size of a channel in its SI unit, in stick-slip, or before it (`sliding`).
    pub(crate) fn size(&self, channel: Channel, sliding: bool) -> f64 {
        let size = self.size_in_stick_slip(channel);
        let part = match self.quantity(channel) {
            Quantity::Speed(part) => Some(part.of),
            _ => None,
        };
        let free = part.is_some_and(|of| self.side(of).speed.is_some());
        match self.coasting {
            Some(speed) if sliding && (free || channel == Channel::RelativeVelocity) => size.max(speed),
            _ => size,
        }
    }

    fn size_in_stick_slip(&self, channel: Channel) -> f64 {
        let (system, sizes) = (self.system(), self.course.sizes());
        let twist = |Part { of, index }: Part| self.side(of).twists + 2 * index;
        let depth = match &self.trains.pressing {
            Pressing::Axial { axial, .. } => self.course.largest_force() / axial.stiffness,
            Pressing::Force(_) => 0.0,
        };
        let size = match self.quantity(channel) {
            _ if channel.is_impulse() => 1.0,
            Quantity::RelativeVelocity => self.speed(),
            Quantity::Twist(part) => sizes[twist(part)],
            Quantity::TwistRate(part) => sizes[twist(part) + 1],
            Quantity::Speed(part) => self.speed_of(part.of),
            Quantity::Angle(part) => self.angle_of(part.of),
            Quantity::Slip => 1.0,
            Quantity::Deflection => match system.engagement {
                Engagement::Bristles(.., place) => sizes[place],
                _ => 1.0,
            },
            Quantity::NormalForce => self.course.largest_force(),
            Quantity::Interface | Quantity::Transmitted => {
                let mu = system.breakaway.max(system.law.typical_coefficient(self.speed()));
                mu * system.radius * self.course.largest_force()
            }
            Quantity::AxialDisplacement => depth,
            Quantity::AxialVelocity => depth * self.natural_angular_frequency(),
        };
        if size > 0.0 { size } else { 1.0 }
    }

    /// What a channel is as a function of time.
    pub(crate) fn quantity(&self, channel: Channel) -> Quantity {
        let inertias = self.system().rotor.inertia.len();
        channel.quantity(inertias.saturating_sub(1))
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
    let scale = |period: f64, of: &str, is_mode: bool, has_period: bool| TimeScale {
        period,
        of: of.to_owned(),
        is_mode,
        has_period,
    };
    let system = course.system();
    let of_surfaces = [(&system.rotor, "rotor"), (&system.stator, "stator")];
    let of_surfaces = of_surfaces.into_iter().filter_map(|(side, name)| {
        let (inertia, stiffness) = (side.inertia.first()?, side.stiffness.first().filter(|k| **k > 0.0)?);
        Some((TAU * (inertia / stiffness).sqrt(), name))
    });
    if let Some((period, name)) = of_surfaces.min_by(|a, b| a.0.total_cmp(&b.0)) {
        return scale(period, &format!("the surface of the {name} on its shaft"), true, true);
    }
    if let Some(period) = course.period_of_signals() {
        return scale(period, "the fastest harmonic that drives the case", false, true);
    }
    let mut intervals: Vec<f64> = word.windows(2).map(|pair| pair[1].time - pair[0].time).collect();
    intervals.retain(|interval| *interval > 0.0);
    intervals.sort_by(f64::total_cmp);
    let (period, of) = match intervals.get(intervals.len() / 2) {
        Some(&period) => (period, "the middle time between two events"),
        None => (if end > 0.0 { 0.1 * end } else { 1.0 }, "a tenth of the run"),
    };
    scale(period, &format!("{of}: nothing in the case has a period"), false, false)
}
