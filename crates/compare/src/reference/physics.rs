//! Physics of a reference: its equations, its channels, and the scales of their errors.

use super::super::Channel;
use super::super::vocabulary::{Known, Vocabulary};
use serde::Serialize;
use std::f64::consts::TAU;
use stickslip_case::Case;
use stickslip_engine::simulation::{Course, CourseQuantity, TrainPart, TrainSide};
use stickslip_system::friction::Law;
use stickslip_system::model::Mode;
use stickslip_system::model::equations::{Engagement, Outside, Side, SystemEquations};
use stickslip_system::model::system::{End, Pressing, System, Train};
use stickslip_system::record::sequence::SequenceEvent;

/// The time scale of a comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TimeScale {
    /// Natural period, s.
    pub period: f64,
    /// Origin of the period, in words.
    pub of: String,
    /// The period belongs to a mode of the system.
    #[serde(skip)]
    pub is_mode: bool,
    /// The origin is periodic.
    #[serde(skip)]
    pub has_period: bool,
}

fn course(case: &Case, trains: &System) -> Course {
    Course::new(trains, case.threshold, &case.solver)
}

/// The physics of a reference.
#[derive(Debug)]
pub struct Physics {
    pub(crate) case: Case,
    pub(crate) trains: System,
    pub(crate) course: Course,
    pub(crate) vocabulary: Vocabulary,
    pub(crate) scale: TimeScale,
    pub(crate) state: Vec<Channel>,
    /// Places of these channels in the state of the equations.
    pub(crate) places: Vec<usize>,
    /// Indices of the channels that determine the torques on the surfaces.
    of_torques: Vec<usize>,
    /// Initial speed (rad/s) of a system without drives that slows down by itself. It is lost after the first event.
    coasting: Option<f64>,
    /// Rows of a candidate with a column `kind` are events, as in the tables of a benchmark set.
    pub(crate) kinds_are_events: bool,
}

fn is_driven(trains: &System) -> bool {
    let is_driven = |train: &Train| matches!(train.end, End::Driven(_)) || train.torque.is_some();
    is_driven(&trains.rotor) || is_driven(&trains.stator)
}

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
    /// The physics of a case; its run has these events and this end (s).
    pub fn new(case: Case, word: &[SequenceEvent], end: f64) -> Physics {
        let trains = case.system.clone();
        let course = course(&case, &trains);
        let vocabulary = Vocabulary::of(case.words, &trains);
        let (mut state, mut places) = (Vec::new(), Vec::new());
        let system = course.system();
        for (of, side) in [(TrainSide::Rotor, &system.rotor), (TrainSide::Stator, &system.stator)] {
            for index in 0..side.shafts() {
                let part = TrainPart { of, index };
                state.extend([Channel::Twist(part), Channel::TwistRate(part)]);
                places.extend([side.twists + 2 * index, side.twists + 2 * index + 1]);
            }
            if let Some(place) = side.speed {
                let index = side.inertia.len() - 1;
                state.push(Channel::Speed(TrainPart { of, index }));
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
            kinds_are_events: false,
        }
    }

    /// Channels that can be compared.
    pub fn vocabulary(&self) -> &Vocabulary {
        &self.vocabulary
    }

    /// Whether sliding slows down by itself: one train is free, and nothing is driven. Stick-slip then follows from an
    /// instability, and has an end and no period.
    pub(crate) fn coasts(&self) -> bool {
        self.coasting.is_some()
    }

    /// Whether an instability can amplify rounding: sliding without a shaft has none.
    pub(crate) fn amplifies(&self) -> bool {
        self.system().rotor.shafts() + self.system().stator.shafts() > 0
    }

    pub(crate) fn is_driven(&self) -> bool {
        is_driven(&self.trains)
    }

    /// The time scale, s.
    pub fn natural_period(&self) -> f64 {
        self.scale.period
    }

    pub(crate) fn natural_angular_frequency(&self) -> f64 {
        TAU / self.scale.period
    }

    pub(crate) fn course(&self) -> Course {
        course(&self.case, &self.trains)
    }

    pub(crate) fn system(&self) -> &SystemEquations {
        self.course.system()
    }

    pub(crate) fn y(&self, value: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut y = vec![0.0; self.system().dimension];
        self.set(&mut y, value);
        y
    }

    /// Writes `value` of each of [`Self::state`] into a state.
    #[inline]
    pub(crate) fn set(&self, y: &mut [f64], value: impl Fn(usize) -> f64) {
        for (k, &place) in self.places.iter().enumerate() {
            y[place] = value(k);
        }
    }

    pub(crate) fn columns(&self, channels: &[Channel]) -> Option<Vec<usize>> {
        let place = |channel: &Channel| channels.iter().position(|known| known == channel);
        self.state.iter().map(place).collect()
    }

    pub(crate) fn torque_channels(&self) -> Vec<Channel> {
        self.of_torques.iter().map(|&k| self.state[k]).collect()
    }

    /// [`Self::torques`] from the channels that determine them.
    pub(crate) fn torques_by(&self, t: f64, value: impl Fn(usize) -> f64) -> (f64, f64) {
        let mut y = vec![0.0; self.system().dimension];
        for (k, &of) in self.of_torques.iter().enumerate() {
            y[self.places[of]] = value(k);
        }
        self.torques(t, &y)
    }

    /// T_r and T_s if their mean is T_f, which is so if both surfaces have the same inertia; else twice T_f; N m.
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

    /// mu_0 r F_n into a sense of sliding, N m.
    pub(crate) fn limit(&self, sense: f64, t: f64) -> f64 {
        self.system()
            .breakaway_torque(sense, self.course.outside(t).normal_force)
    }

    pub(crate) fn sticks(&self) -> bool {
        self.system().engagement == Engagement::StickSlip
    }

    /// Speed (rad/s) below which a contact without stick counts as stuck; `None` for a contact with stick.
    pub(crate) fn threshold(&self) -> Option<f64> {
        (!self.sticks()).then_some(self.case.threshold)
    }

    /// Mode at a relative velocity `w`, which counts as zero up to `tolerance`, rad/s.
    pub(crate) fn mode(&self, w: f64, tolerance: f64) -> Mode {
        match self.system().engagement {
            Engagement::StickSlip if w.abs() <= tolerance => Mode::Stick,
            Engagement::StickSlip => Mode::sliding(w),
            _ => Mode::Engaged,
        }
    }

    pub(crate) fn energy(&self, t: f64, y: &[f64]) -> f64 {
        let system = self.system();
        system.kinetic_energy(&self.course.driving(t), y) + system.elastic_energy(y)
    }

    pub(crate) fn driven(&self, known: Known, t: f64) -> f64 {
        let (angle, speed) = self.course.ends(t)[known.of as usize];
        if known.is_rate { speed } else { angle }
    }

    fn side(&self, of: TrainSide) -> &Side {
        match of {
            TrainSide::Rotor => &self.system().rotor,
            TrainSide::Stator => &self.system().stator,
        }
    }

    fn speed_of(&self, of: TrainSide) -> f64 {
        let (side, sizes) = (self.side(of), self.course.sizes());
        let rates = (0..side.shafts()).map(|i| sizes[side.twists + 2 * i + 1]);
        let free = side.speed.filter(|_| self.coasting.is_none()).map(|place| sizes[place]);
        rates.chain(free).fold(0.0, f64::max)
    }

    /// Size of the angles of a train; 1 for a free train.
    fn angle_of(&self, of: TrainSide) -> f64 {
        let (side, sizes) = (self.side(of), self.course.sizes());
        match side.speed {
            None => (0..side.shafts()).map(|i| sizes[side.twists + 2 * i]).sum(),
            Some(_) => 1.0,
        }
    }

    pub(crate) fn speed(&self) -> f64 {
        TrainSide::BOTH
            .map(|of| self.speed_of(of))
            .into_iter()
            .fold(0.0, f64::max)
    }

    /// Size of a channel in its SI unit, in stick-slip, or before it (`sliding`).
    pub(crate) fn size(&self, channel: Channel, sliding: bool) -> f64 {
        let size = self.size_in_stick_slip(channel);
        let part = match self.quantity(channel) {
            CourseQuantity::Speed(part) => Some(part.of),
            CourseQuantity::Product(factors) => return self.product_of_sizes(factors, sliding),
            _ => None,
        };
        let free = part.is_some_and(|of| self.side(of).speed.is_some());
        match self.coasting {
            Some(speed) if sliding && (free || channel == Channel::RELATIVE_VELOCITY) => size.max(speed),
            _ => size,
        }
    }

    fn product_of_sizes(&self, factors: &[&str; 2], sliding: bool) -> f64 {
        let known = Channel::all().filter(|channel| factors.contains(&&*channel.name()));
        known.map(|channel| self.size(channel, sliding)).product()
    }

    fn size_in_stick_slip(&self, channel: Channel) -> f64 {
        let (system, sizes) = (self.system(), self.course.sizes());
        let twist = |TrainPart { of, index }: TrainPart| self.side(of).twists + 2 * index;
        let depth = match &self.trains.pressing {
            Pressing::Axial { axial, .. } => self.course.largest_force() / axial.stiffness,
            Pressing::Force(_) => 0.0,
        };
        let size = match self.quantity(channel) {
            _ if channel.is_impulse() => 1.0,
            CourseQuantity::RelativeVelocity => self.speed(),
            CourseQuantity::Twist(part) => sizes[twist(part)],
            CourseQuantity::TwistRate(part) => sizes[twist(part) + 1],
            CourseQuantity::Speed(part) => self.speed_of(part.of),
            CourseQuantity::Angle(part) => self.angle_of(part.of),
            CourseQuantity::Slip => 1.0,
            CourseQuantity::Deflection => match system.engagement {
                Engagement::Bristles(.., place) => sizes[place],
                _ => 1.0,
            },
            CourseQuantity::NormalForce => self.course.largest_force(),
            CourseQuantity::Interface | CourseQuantity::Transmitted => {
                let mu = system.breakaway.max(system.law.typical_coefficient(self.speed()));
                mu * system.radius * self.course.largest_force()
            }
            CourseQuantity::AxialDisplacement => depth,
            CourseQuantity::AxialVelocity => depth * self.natural_angular_frequency(),
            CourseQuantity::Product(factors) => self.product_of_sizes(factors, false),
        };
        if size > 0.0 { size } else { 1.0 }
    }

    pub(crate) fn quantity(&self, channel: Channel) -> CourseQuantity {
        let inertias = self.system().rotor.inertia.len();
        channel.quantity(inertias.saturating_sub(1))
    }

    /// The channel whose range an attractor states; `None` for a slip displacement.
    pub(crate) fn position(&self) -> Option<Channel> {
        let channel = match self.course.position()? {
            CourseQuantity::Angle(part) => Channel::Angle(part),
            CourseQuantity::Twist(part) => Channel::Twist(part),
            _ => return None,
        };
        self.vocabulary.canonical(channel)
    }
}

/// Period of a surface on its own shaft with fixed neighbours, the shorter of two: 2 pi sqrt(J/k_t) for the paper's
/// brake. Else the period of the fastest harmonic of the drives, else the mean time between two events.
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
