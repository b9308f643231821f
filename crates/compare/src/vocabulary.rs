//! Channels of comparisons: names, units, and how they follow from each other.

use std::borrow::Cow;
use stickslip_case::quantity::Dimension;
use stickslip_case::{Motion, Words};
use stickslip_engine::simulation::{CourseQuantity, TrainPart, TrainSide};
use stickslip_system::model::system::{ContactLaw, End, Pressing, System, Train};
use stickslip_system::record::channel::{self, RecordedChannel};

/// Channels that a reference can be compared in.
#[derive(Debug, Clone, PartialEq)]
pub struct Vocabulary {
    motion: Motion,
    bodies: &'static str,
    entries: Vec<VocabularyEntry>,
    same: Vec<(Channel, Channel)>,
}

#[derive(Debug, Clone, PartialEq)]
struct VocabularyEntry {
    channel: Channel,
    /// The channel's own name and its aliases, in lower case.
    names: Vec<String>,
    /// Sum over the angles and then the speeds of the inertias, in order; `None` if the channel follows from no
    /// positions and speeds.
    form: Option<Sum>,
}

/// The motion of a driven end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Known {
    /// Train of the end.
    pub of: TrainSide,
    /// Speed of the end, not its angle.
    pub is_rate: bool,
}

/// A channel as a sum of other channels and motions of driven ends, with factors.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sum {
    /// Places of other channels, with their factors.
    pub terms: Vec<(usize, f64)>,
    /// Motions of driven ends, with their factors.
    pub known: Vec<(Known, f64)>,
}

impl Default for Vocabulary {
    /// The names of the short form, for no particular reference and without dependencies.
    fn default() -> Self {
        let entry = |channel: Channel| VocabularyEntry {
            channel,
            names: names(channel, true),
            form: None,
        };
        Vocabulary {
            motion: Motion::Rotation,
            bodies: "surfaces",
            entries: Channel::all()
                .chain(Channel::products())
                .chain(impulses())
                .map(entry)
                .collect(),
            same: Vec::new(),
        }
    }
}

fn impulses() -> impl Iterator<Item = Channel> {
    Channel::IMPULSES.into_iter().map(|(impulse, _)| impulse)
}

struct Forms<'a> {
    trains: &'a System,
}

impl Forms<'_> {
    fn train(&self, of: TrainSide) -> &Train {
        match of {
            TrainSide::Rotor => &self.trains.rotor,
            TrainSide::Stator => &self.trains.stator,
        }
    }

    fn count(&self, of: TrainSide) -> usize {
        self.train(of).inertia.len()
    }

    fn shafts(&self, of: TrainSide) -> usize {
        self.train(of).shafts()
    }

    fn inertia(&self, TrainPart { of, index }: TrainPart, is_rate: bool) -> Sum {
        let (rotor, stator) = (self.count(TrainSide::Rotor), self.count(TrainSide::Stator));
        let mut form = Sum::default();
        if index < self.count(of) {
            let first = if of == TrainSide::Rotor { 0 } else { rotor };
            let rates = if is_rate { rotor + stator } else { 0 };
            form.terms.push((rates + first + index, 1.0));
        } else if matches!(self.train(of).end, End::Driven(_)) {
            form.known.push((Known { of, is_rate }, 1.0));
        }
        form
    }

    fn shaft(&self, TrainPart { of, index }: TrainPart, is_rate: bool) -> Sum {
        let sign = if of == TrainSide::Rotor { 1.0 } else { -1.0 };
        let [outer, inner] = [index + 1, index].map(|index| self.inertia(TrainPart { of, index }, is_rate));
        Sum::difference(sign, &outer, &inner)
    }

    fn across(&self, is_rate: bool) -> Sum {
        let [rotor, stator] = TrainSide::BOTH.map(|of| self.inertia(TrainPart { of, index: 0 }, is_rate));
        Sum::difference(1.0, &rotor, &stator)
    }

    fn of(&self, quantity: CourseQuantity) -> Option<Sum> {
        Some(match quantity {
            CourseQuantity::RelativeVelocity => self.across(true),
            CourseQuantity::Slip => self.across(false),
            CourseQuantity::Twist(part) => self.shaft(part, false),
            CourseQuantity::TwistRate(part) => self.shaft(part, true),
            CourseQuantity::Angle(part) => self.inertia(part, false),
            CourseQuantity::Speed(part) => self.inertia(part, true),
            _ => return None,
        })
    }

    /// Every channel, in the order of reports: channels of motion in every file first.
    fn channels(&self) -> Vec<Channel> {
        let of_motion = |channel: &Channel| self.of(channel.quantity(0)).is_some();
        let (motion, forces): (Vec<Channel>, Vec<Channel>) = Channel::all().partition(of_motion);
        let has_twist = self.shafts(TrainSide::Rotor) > 0;
        let mut found = motion;
        found.retain(|channel| has_twist || !matches!(channel, Channel::Recorded("rotor_twist" | "rotor_twist_rate")));
        for of in TrainSide::BOTH {
            let shafts = (0..self.shafts(of)).map(|index| TrainPart { of, index });
            found.extend(shafts.flat_map(|part| [Channel::Twist(part), Channel::TwistRate(part)]));
            let inertias = (0..self.count(of)).map(|index| TrainPart { of, index });
            found.extend(inertias.flat_map(|part| [Channel::Speed(part), Channel::Angle(part)]));
        }
        let has_axial = matches!(self.trains.pressing, Pressing::Axial { .. });
        let has_bristles = matches!(self.trains.contact, ContactLaw::Bristles(_));
        found.extend(has_bristles.then_some(Channel::Deflection));
        found.extend(forces.into_iter().filter(|channel| has_axial || !channel.is_axial()));
        found.extend(Channel::products());
        found.extend(impulses());
        found
    }
}

fn add<T: PartialEq>(sum: &mut Vec<(T, f64)>, of: T, factor: f64) {
    match sum.iter_mut().find(|(known, _)| *known == of) {
        Some((_, there)) => *there += factor,
        None => sum.push((of, factor)),
    }
}

impl Sum {
    fn difference(sign: f64, a: &Sum, b: &Sum) -> Sum {
        let mut sum = Sum::default();
        for (form, factor) in [(a, sign), (b, -sign)] {
            for &(index, c) in &form.terms {
                add(&mut sum.terms, index, factor * c);
            }
            sum.known
                .extend(form.known.iter().map(|&(known, c)| (known, factor * c)));
        }
        sum.terms.retain(|&(_, c)| c != 0.0);
        sum.terms.sort_by_key(|&(index, _)| index);
        sum
    }
}

impl Vocabulary {
    /// The vocabulary of a system, with the names of its case.
    pub fn of(words: Words, trains: &System) -> Vocabulary {
        let forms = Forms { trains };
        let is_short = words.has_letters();
        let outermost = forms.count(TrainSide::Rotor).saturating_sub(1);
        let mut entries: Vec<VocabularyEntry> = Vec::new();
        let mut same = Vec::new();
        for channel in forms.channels() {
            let form = forms.of(channel.quantity(outermost));
            // A channel that a drive or the ground prescribes needs no comparison.
            if form.as_ref().is_some_and(|form| form.terms.is_empty()) {
                continue;
            }
            let known = entries.iter_mut().find(|entry| form.is_some() && entry.form == form);
            match known {
                Some(entry) => {
                    same.push((channel, entry.channel));
                    entry.names.extend(names(channel, is_short));
                }
                None => entries.push(VocabularyEntry {
                    channel,
                    names: names(channel, is_short),
                    form,
                }),
            }
        }
        if let [(of, 1), (_, 0)] | [(_, 0), (of, 1)] = TrainSide::BOTH.map(|of| (of, forms.count(of))) {
            let names: [(bool, &[&str]); 2] = [
                (false, &["x", "position", "angle"]),
                (true, &["v", "velocity", "speed", "x_dot", "xdot", "dx"]),
            ];
            for (is_rate, names) in names {
                let alone = Some(forms.inertia(TrainPart { of, index: 0 }, is_rate));
                for entry in entries.iter_mut().filter(|entry| entry.form == alone) {
                    entry.names.extend(names.iter().map(|&name| name.to_owned()));
                }
            }
        }
        // A name belongs to one channel, and z in a result file is the axial displacement.
        let axial = entries.iter().any(|entry| entry.channel == Channel::Recorded("z"));
        let mut deflection = entries.iter_mut().filter(|entry| entry.channel == Channel::Deflection);
        if let Some(entry) = deflection.next().filter(|_| axial) {
            entry.names.retain(|name| name != "z");
        }
        Vocabulary {
            motion: words.motion(),
            bodies: if is_short { "disks" } else { "surfaces" },
            entries,
            same,
        }
    }

    pub(super) fn also(&mut self, known: &str, name: &str) {
        let (known, name) = (known.to_lowercase(), name.to_lowercase());
        if self.find(&name).is_none()
            && let Some(entry) = self.entries.iter_mut().find(|entry| entry.names.contains(&known))
        {
            entry.names.push(name);
        }
    }

    /// Kind of the coordinates.
    pub fn motion(&self) -> Motion {
        self.motion
    }

    /// Names of the channels behind the relative velocity: "phi1_dot and phi2_dot".
    pub(super) fn surface_speeds(&self) -> String {
        let speeds = ["phi1_dot", "phi2_dot"].map(Channel::Recorded).into_iter();
        let speeds = speeds.filter_map(|speed| self.canonical(speed));
        speeds.map(|speed| speed.name()).collect::<Vec<_>>().join(" and ")
    }

    /// Every channel, in the order of reports.
    pub fn channels(&self) -> impl Iterator<Item = Channel> + '_ {
        self.entries.iter().map(|entry| entry.channel)
    }

    /// The channel with this name or alias; upper and lower case are equivalent.
    pub fn find(&self, name: &str) -> Option<Channel> {
        let name = name.to_lowercase();
        let known = self.entries.iter().find(|entry| entry.names.contains(&name));
        known.map(|entry| entry.channel)
    }

    /// The channel that represents an equal one, which may be itself; `None` if the reference does not have it.
    pub fn canonical(&self, channel: Channel) -> Option<Channel> {
        let same = self.same.iter().find(|(other, _)| *other == channel);
        let same = same.map(|(_, one)| *one);
        same.or_else(|| self.channels().find(|&one| one == channel))
    }

    /// Whether result files have a channel, or an equal one, under this name.
    pub(super) fn is_own_name(&self, channel: Channel, name: &str) -> bool {
        let mut same = self.same.iter().filter(|(_, one)| *one == channel);
        channel.name() == name || same.any(|(other, _)| other.name() == name)
    }

    pub(crate) fn names(&self, channel: Channel) -> &[String] {
        let entry = self.entries.iter().find(|entry| entry.channel == channel);
        entry.map_or(&[], |entry| &entry.names)
    }

    /// Dimension of a channel.
    pub fn dimension(&self, channel: Channel) -> Dimension {
        self.motion.dimension(channel.dimension())
    }

    /// SI unit of a channel, for readers.
    pub fn unit(&self, channel: Channel) -> &'static str {
        self.dimension(channel).unit()
    }

    /// Channels that follow from `direct` ones, in the order of reports, without `direct`.
    pub fn derived(&self, direct: &[Channel]) -> Vec<(Channel, Sum)> {
        let place = |channel: Channel| direct.iter().position(|&known| known == channel);
        let mut found = Vec::new();
        for entry in self.entries.iter().filter(|entry| place(entry.channel).is_none()) {
            let sum = entry.form.as_ref().and_then(|form| self.solved(form, direct));
            found.extend(sum.map(|sum| (entry.channel, sum)));
        }
        found
    }

    /// `form` as a sum of `direct`, with twists and speeds before absolute angles; `None` if impossible.
    fn solved(&self, form: &Sum, direct: &[Channel]) -> Option<Sum> {
        /// Factors are small whole numbers, so smaller values are zero.
        const NOTHING: f64 = 1e-9;
        let absolute = |channel: Channel| {
            use Channel::{Angle, Recorded};
            matches!(
                channel,
                Angle(_) | Recorded("phi1" | "phi2" | "theta" | "slip_displacement")
            )
        };
        let mut columns: Vec<(usize, &Sum)> = Vec::new();
        for wanted in [false, true] {
            for (index, &channel) in direct.iter().enumerate().filter(|(_, c)| absolute(**c) == wanted) {
                let entry = self.entries.iter().find(|entry| entry.channel == channel);
                columns.extend(entry.and_then(|entry| entry.form.as_ref()).map(|form| (index, form)));
            }
        }
        let forms = self.entries.iter().filter_map(|entry| entry.form.as_ref());
        let rows = forms.flat_map(|form| &form.terms).map(|(index, _)| index + 1).max()?;
        let width = columns.len();
        let mut matrix = vec![vec![0.0; width + 1]; rows];
        for (column, of) in columns.iter().map(|(_, form)| *form).chain([form]).enumerate() {
            for &(row, c) in &of.terms {
                matrix[row][column] = c;
            }
        }
        let mut pivots: Vec<usize> = Vec::new();
        for column in 0..width {
            let done = pivots.len();
            let Some(best) = (done..rows).max_by(|&a, &b| matrix[a][column].abs().total_cmp(&matrix[b][column].abs()))
            else {
                break;
            };
            if matrix[best][column].abs() < NOTHING {
                continue;
            }
            matrix.swap(done, best);
            let pivot = matrix[done].clone();
            for (row, line) in matrix.iter_mut().enumerate() {
                let factor = line[column] / pivot[column];
                if row != done && factor != 0.0 {
                    for (x, p) in line.iter_mut().zip(&pivot) {
                        *x -= factor * p;
                    }
                }
            }
            pivots.push(column);
        }
        if matrix[pivots.len()..].iter().any(|row| row[width].abs() > NOTHING) {
            return None;
        }
        let mut sum = Sum::default();
        let mut known = form.known.clone();
        for (row, &column) in pivots.iter().enumerate() {
            let factor = matrix[row][width] / matrix[row][column];
            if factor.abs() > NOTHING {
                let (index, of) = columns[column];
                sum.terms.push((index, factor));
                known.extend(of.known.iter().map(|&(known, c)| (known, -factor * c)));
            }
        }
        for (one, factor) in known {
            add(&mut sum.known, one, factor);
        }
        sum.known.retain(|(_, factor)| factor.abs() > NOTHING);
        Some(sum)
    }
}

/// The names of a channel, its own first; `short` with the letters of the short form.
fn names(channel: Channel, short: bool) -> Vec<String> {
    let own = channel.name().into_owned();
    let linear = match channel {
        Channel::Angle(_) => Some(own.replace("angle", "position")),
        Channel::Speed(_) => Some(own.replace("speed", "velocity")),
        _ => None,
    };
    // With any number of inertias and shafts, these letters are ambiguous.
    let letters = ["u", "u_dot", "v", "v_dot", "twist", "twist_rate", "omega"];
    let aliases = channel.aliases().filter(|alias| short || !letters.contains(alias));
    let aliases = aliases.map(str::to_owned);
    std::iter::once(own).chain(aliases).chain(linear).collect()
}

/// A quantity over time that both runs have, in SI units and radians. Names and signs are those of /trajectory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Channel {
    /// A recorded channel that every result file has, by its name in [`stickslip_system::record::channel`].
    Recorded(&'static str),
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

/// Recorded channels with an own role, in the order of reports.
const RECORDED: &str = "relative_velocity rotor_twist rotor_twist_rate phi1 phi1_dot theta_dot phi2_dot theta phi2 \
                        slip_displacement z z_dot normal_force friction_torque transmitted_torque";

impl Channel {
    /// omega_r = phi_2' - phi_1', rad/s.
    pub const RELATIVE_VELOCITY: Channel = Channel::Recorded("relative_velocity");
    pub(crate) const ROTOR_TWIST: Channel = Channel::Recorded("rotor_twist");
    pub(crate) const NORMAL_FORCE: Channel = Channel::Recorded("normal_force");

    /// Channels with an own role that every result file has, in the order of reports.
    pub fn all() -> impl Iterator<Item = Channel> {
        RECORDED.split_whitespace().map(Channel::Recorded)
    }

    /// Products of two channels that every result file has.
    pub fn products() -> impl Iterator<Item = Channel> {
        let products = channel::all().filter(|channel| channel.product.is_some());
        products.map(|channel| Channel::Recorded(channel.name))
    }

    pub(crate) const IMPULSES: [(Channel, Channel); 2] = [
        (Channel::NormalImpulse, Channel::NORMAL_FORCE),
        (Channel::FrictionImpulse, Channel::Recorded("friction_torque")),
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
            Channel::Recorded(name) => name.into(),
        }
    }

    fn recorded(self) -> Option<&'static RecordedChannel> {
        match self {
            Channel::Recorded(name) => channel::find(name),
            _ => None,
        }
    }

    /// Its dimension in rotation.
    pub fn dimension(self) -> Dimension {
        match self {
            Channel::TwistRate(_) | Channel::Speed(_) => Dimension::AngularVelocity,
            Channel::NormalImpulse => Dimension::Impulse,
            Channel::FrictionImpulse => Dimension::AngularImpulse,
            _ => {
                let unit = self.recorded().map(|channel| channel.unit);
                unit.and_then(Dimension::of_udunits).unwrap_or(Dimension::Angle)
            }
        }
    }

    /// Names in other programs, in lower case.
    pub(crate) fn aliases(self) -> impl Iterator<Item = &'static str> {
        let aliases = match self {
            Channel::Deflection => "z",
            _ => self.recorded().map_or("", |channel| channel.aliases),
        };
        aliases.split_whitespace()
    }

    pub(crate) fn is_axial(self) -> bool {
        matches!(self, Channel::Recorded("z" | "z_dot"))
    }

    /// Its function of time; `outermost` is the rotor's outermost inertia.
    pub(crate) fn quantity(self, outermost: usize) -> CourseQuantity {
        match self {
            Channel::Twist(part) => CourseQuantity::Twist(part),
            Channel::TwistRate(part) => CourseQuantity::TwistRate(part),
            Channel::Speed(part) => CourseQuantity::Speed(part),
            Channel::Angle(part) => CourseQuantity::Angle(part),
            Channel::Deflection => CourseQuantity::Deflection,
            Channel::Recorded(name) => {
                CourseQuantity::of_channel(name, outermost).unwrap_or(CourseQuantity::Transmitted)
            }
            // Impulses are integrated from forces and torques.
            Channel::NormalImpulse | Channel::FrictionImpulse => CourseQuantity::Transmitted,
        }
    }
}
