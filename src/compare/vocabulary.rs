//! The channels of one reference, those of the parts of its trains among them: names, units, and how one follows from
//! others.

use super::Channel;
use crate::case::quantity::Dimension;
use crate::case::{Motion, Words};
use crate::model::system::{ContactLaw, End, Pressing, System, Train};
use crate::simulation::{Part, Quantity, Which};

/// What a reference has to be compared with.
#[derive(Debug, Clone, PartialEq)]
pub struct Vocabulary {
    motion: Motion,
    /// What touches, in words.
    bodies: &'static str,
    entries: Vec<Entry>,
    /// Other channels with the one that is the same.
    same: Vec<(Channel, Channel)>,
}

#[derive(Debug, Clone, PartialEq)]
struct Entry {
    channel: Channel,
    /// Its own and those by which it is known elsewhere, in lower case.
    names: Vec<String>,
    /// What it is made of, by the indices of angles and then of speeds of inertias, in their order; `None` of what follows from no positions and speeds.
    form: Option<Sum>,
}

/// The motion of a driven end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Known {
    /// Whose.
    pub of: Which,
    /// Its speed, not its angle.
    pub is_rate: bool,
}

/// What a channel is made of: places of others and motions of driven ends, with factors.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Sum {
    pub terms: Vec<(usize, f64)>,
    pub known: Vec<(Known, f64)>,
}

impl Default for Vocabulary {
    /// The names that the short form has, of no reference in particular: nothing follows from anything.
    fn default() -> Self {
        let entry = |channel: Channel| Entry {
            channel,
            names: names(channel, true),
            form: None,
        };
        Vocabulary {
            motion: Motion::Rotation,
            bodies: "surfaces",
            entries: Channel::ALL.into_iter().chain(impulses()).map(entry).collect(),
            same: Vec::new(),
        }
    }
}

/// Of any reference.
fn impulses() -> impl Iterator<Item = Channel> {
    Channel::IMPULSES.into_iter().map(|(impulse, _)| impulse)
}

/// What the quantities of a case are sums of.
struct Forms<'a> {
    trains: &'a System,
}

impl Forms<'_> {
    fn train(&self, of: Which) -> &Train {
        match of {
            Which::Rotor => &self.trains.rotor,
            Which::Stator => &self.trains.stator,
        }
    }

    fn count(&self, of: Which) -> usize {
        self.train(of).inertia.len()
    }

    fn shafts(&self, of: Which) -> usize {
        self.train(of).shafts()
    }

    /// Of an inertia, or of the end beyond the outermost.
    fn inertia(&self, Part { of, index }: Part, is_rate: bool) -> Sum {
        let (rotor, stator) = (self.count(Which::Rotor), self.count(Which::Stator));
        let mut form = Sum::default();
        if index < self.count(of) {
            let first = if of == Which::Rotor { 0 } else { rotor };
            let rates = if is_rate { rotor + stator } else { 0 };
            form.terms.push((rates + first + index, 1.0));
        } else if matches!(self.train(of).end, End::Driven(_)) {
            form.known.push((Known { of, is_rate }, 1.0));
        }
        form
    }

    fn shaft(&self, Part { of, index }: Part, is_rate: bool) -> Sum {
        let sign = if of == Which::Rotor { 1.0 } else { -1.0 };
        let [outer, inner] = [index + 1, index].map(|index| self.inertia(Part { of, index }, is_rate));
        Sum::difference(sign, &outer, &inner)
    }

    fn across(&self, is_rate: bool) -> Sum {
        let [rotor, stator] = Which::BOTH.map(|of| self.inertia(Part { of, index: 0 }, is_rate));
        Sum::difference(1.0, &rotor, &stator)
    }

    /// Of a quantity; `None` of what follows from no positions and speeds.
    fn of(&self, quantity: Quantity) -> Option<Sum> {
        Some(match quantity {
            Quantity::RelativeVelocity => self.across(true),
            Quantity::Slip => self.across(false),
            Quantity::Twist(part) => self.shaft(part, false),
            Quantity::TwistRate(part) => self.shaft(part, true),
            Quantity::Angle(part) => self.inertia(part, false),
            Quantity::Speed(part) => self.inertia(part, true),
            _ => return None,
        })
    }

    /// Every channel, in the order of reports: those of motion that every file has first.
    fn channels(&self) -> Vec<Channel> {
        let of_motion = |channel: &&Channel| self.of(channel.quantity(0)).is_some();
        let (motion, forces): (Vec<&Channel>, Vec<&Channel>) = Channel::ALL.iter().partition(of_motion);
        let has_twist = self.shafts(Which::Rotor) > 0;
        let mut found: Vec<Channel> = motion.into_iter().copied().collect();
        found.retain(|channel| has_twist || !matches!(channel, Channel::RotorTwist | Channel::RotorTwistRate));
        for of in Which::BOTH {
            let shafts = (0..self.shafts(of)).map(|index| Part { of, index });
            found.extend(shafts.flat_map(|part| [Channel::Twist(part), Channel::TwistRate(part)]));
            let inertias = (0..self.count(of)).map(|index| Part { of, index });
            found.extend(inertias.flat_map(|part| [Channel::Speed(part), Channel::Angle(part)]));
        }
        let has_axial = matches!(self.trains.pressing, Pressing::Axial { .. });
        let has_bristles = matches!(self.trains.contact, ContactLaw::Bristles(_));
        found.extend(has_bristles.then_some(Channel::Deflection));
        found.extend(forces.into_iter().filter(|channel| has_axial || !channel.is_axial()));
        found.extend(impulses());
        found
    }
}

/// Adds a term to a sum that has one of each kind.
fn add<T: PartialEq>(sum: &mut Vec<(T, f64)>, of: T, factor: f64) {
    match sum.iter_mut().find(|(known, _)| *known == of) {
        Some((_, there)) => *there += factor,
        None => sum.push((of, factor)),
    }
}

impl Sum {
    /// `sign` (a - b).
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
    /// Of a system, with the names of its case.
    pub(crate) fn of(words: Words, trains: &System) -> Vocabulary {
        let forms = Forms { trains };
        let is_short = words.has_letters();
        let outermost = forms.count(Which::Rotor).saturating_sub(1);
        let mut entries: Vec<Entry> = Vec::new();
        let mut same = Vec::new();
        for channel in forms.channels() {
            let form = forms.of(channel.quantity(outermost));
            // What a drive moves, or the ground, needs no comparison.
            if form.as_ref().is_some_and(|form| form.terms.is_empty()) {
                continue;
            }
            let known = entries.iter_mut().find(|entry| form.is_some() && entry.form == form);
            match known {
                Some(entry) => {
                    same.push((channel, entry.channel));
                    entry.names.extend(names(channel, is_short));
                }
                None => entries.push(Entry {
                    channel,
                    names: names(channel, is_short),
                    form,
                }),
            }
        }
        // A single body has a position and a speed.
        if let [(of, 1), (_, 0)] | [(_, 0), (of, 1)] = Which::BOTH.map(|of| (of, forms.count(of))) {
            let names: [(bool, &[&str]); 2] = [
                (false, &["x", "position", "angle"]),
                (true, &["v", "velocity", "speed", "x_dot", "xdot", "dx"]),
            ];
            for (is_rate, names) in names {
                let alone = Some(forms.inertia(Part { of, index: 0 }, is_rate));
                for entry in entries.iter_mut().filter(|entry| entry.form == alone) {
                    entry.names.extend(names.iter().map(|&name| name.to_owned()));
                }
            }
        }
        // A name is one channel's, and what is called z in a file of this program is the axial displacement.
        let axial = entries.iter().any(|entry| entry.channel == Channel::Z);
        for entry in entries
            .iter_mut()
            .filter(|entry| axial && entry.channel == Channel::Deflection)
        {
            entry.names.retain(|name| *name != Channel::Z.name());
        }
        Vocabulary {
            motion: words.motion(),
            bodies: if is_short { "disks" } else { "surfaces" },
            entries,
            same,
        }
    }

    /// Adds a name to the channel of another name; of one that no channel has, nothing.
    pub(super) fn also(&mut self, known: &str, name: &str) {
        let (known, name) = (known.to_lowercase(), name.to_lowercase());
        if self.find(&name).is_none()
            && let Some(entry) = self.entries.iter_mut().find(|entry| entry.names.contains(&known))
        {
            entry.names.push(name);
        }
    }

    /// What the coordinates are.
    pub fn motion(&self) -> Motion {
        self.motion
    }

    /// The names of what the relative velocity follows from: "phi1_dot and phi2_dot".
    pub(super) fn surface_speeds(&self) -> String {
        let speeds = [Channel::Phi1Dot, Channel::Phi2Dot].into_iter();
        let speeds = speeds.filter_map(|speed| self.canonical(speed));
        speeds.map(|speed| speed.name()).collect::<Vec<_>>().join(" and ")
    }

    /// Every channel, in the order of reports.
    pub fn channels(&self) -> impl Iterator<Item = Channel> + '_ {
        self.entries.iter().map(|entry| entry.channel)
    }

    /// The channel of a name, which is this program's or an alias; upper and lower case are alike.
    pub fn find(&self, name: &str) -> Option<Channel> {
        let name = name.to_lowercase();
        let known = self.entries.iter().find(|entry| entry.names.contains(&name));
        known.map(|entry| entry.channel)
    }

    /// The channel that stands for one, which may be itself; `None` of what the reference does not have.
    pub fn canonical(&self, channel: Channel) -> Option<Channel> {
        let same = self.same.iter().find(|(other, _)| *other == channel);
        let same = same.map(|(_, one)| *one);
        same.or_else(|| self.channels().find(|&one| one == channel))
    }

    /// Whether the program's own files have a channel, or another that is the same, by this name.
    pub(super) fn is_own_name(&self, channel: Channel, name: &str) -> bool {
        let mut same = self
            .same
            .iter()
            .filter(|(_, one)| *one == channel)
            .map(|(other, _)| *other);
        channel.name() == name || same.any(|other| other.name() == name)
    }

    /// The names of a channel of the reference, the program's own first.
    pub(crate) fn names(&self, channel: Channel) -> &[String] {
        let entry = self.entries.iter().find(|entry| entry.channel == channel);
        entry.map_or(&[], |entry| &entry.names)
    }

    /// What a channel measures.
    pub fn dimension(&self, channel: Channel) -> Dimension {
        self.motion.dimension(channel.dimension())
    }

    /// The SI unit of a channel, for people.
    pub fn unit(&self, channel: Channel) -> &'static str {
        self.dimension(channel).unit()
    }

    /// How channels follow from `direct` ones, in the order of reports; those of `direct` are left out.
    pub(crate) fn derived(&self, direct: &[Channel]) -> Vec<(Channel, Sum)> {
        let place = |channel: Channel| direct.iter().position(|&known| known == channel);
        let mut found = Vec::new();
        for entry in self.entries.iter().filter(|entry| place(entry.channel).is_none()) {
            let sum = entry.form.as_ref().and_then(|form| self.solved(form, direct));
            found.extend(sum.map(|sum| (entry.channel, sum)));
        }
        found
    }

    /// `form` as a sum of `direct`, of which twists and speeds are taken before absolute angles; `None` if it is none.
    fn solved(&self, form: &Sum, direct: &[Channel]) -> Option<Sum> {
        /// A factor is a small whole number or nothing.
        const NOTHING: f64 = 1e-9;
        let absolute = |channel: Channel| {
            use Channel::{Angle, Phi1, Phi2, SlipDisplacement, Theta};
            matches!(channel, Angle(_) | Phi1 | Phi2 | Theta | SlipDisplacement)
        };
        let mut columns: Vec<(usize, &Sum)> = Vec::new();
        for wanted in [false, true] {
            for (index, &channel) in direct.iter().enumerate().filter(|(_, c)| absolute(**c) == wanted) {
                let entry = self.entries.iter().find(|entry| entry.channel == channel);
                columns.extend(entry.and_then(|entry| entry.form.as_ref()).map(|form| (index, form)));
            }
        }
        let rows = self.entries.iter().filter_map(|entry| entry.form.as_ref());
        let rows = rows
            .flat_map(|form| form.terms.iter().map(|&(index, _)| index + 1))
            .max()?;
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

/// The names of a channel, its own first; `short` with the letters that the short form has for its own.
fn names(channel: Channel, short: bool) -> Vec<String> {
    let own = channel.name().into_owned();
    let linear = match channel {
        Channel::Angle(_) => Some(own.replace("angle", "position")),
        Channel::Speed(_) => Some(own.replace("speed", "velocity")),
        _ => None,
    };
    // Where there may be any inertias and shafts, these letters are nobody's in particular.
    let letters = ["u", "u_dot", "v", "v_dot", "twist", "twist_rate", "omega"];
    let aliases = channel.aliases().filter(|alias| short || !letters.contains(alias));
    std::iter::once(own)
        .chain(aliases.map(str::to_owned))
        .chain(linear)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, CaseSource};

    fn of(case: &str) -> Vocabulary {
        let case = Case::read(&CaseSource::built_in(case).unwrap(), &[]).unwrap();
        Vocabulary::of(case.words, &case.system)
    }

    /// What the short form names by itself are the inertias and shafts of its general form.
    #[test]
    fn analytic_the_short_form_has_the_channels_of_every_file() {
        let paper = of("paper");
        let channels: Vec<Channel> = paper.channels().collect();
        assert_eq!(channels[..Channel::ALL.len()], Channel::ALL);
        assert_eq!(paper.find("v"), Some(Channel::Phi1));
        assert_eq!(paper.find("stator_twist_0"), Some(Channel::Phi1));
        let derived = paper.derived(&[Channel::ThetaDot, Channel::RotorTwistRate, Channel::Phi1Dot]);
        let derived: Vec<Channel> = derived.into_iter().map(|(channel, _)| channel).collect();
        assert_eq!(derived, [Channel::RelativeVelocity, Channel::Phi2Dot]);
    }

    #[test]
    fn analytic_channels_follow_from_absolute_coordinates() {
        let drill = of("drill-string");
        let channels: Vec<String> = drill.channels().map(|channel| channel.name().into_owned()).collect();
        assert_eq!(channels[..3], ["relative_velocity", "rotor_twist", "rotor_twist_rate"]);
        let direct = [
            drill.find("rotor_angle_0").unwrap(),
            drill.find("rotor_angle_1").unwrap(),
        ];
        let derived = drill.derived(&direct);
        let (_, twist) = derived.iter().find(|(c, _)| *c == Channel::RotorTwist).unwrap();
        assert_eq!((twist.terms.len(), twist.known.len()), (2, 0));
        let factor = |k: usize| twist.terms.iter().find(|t| t.0 == k).unwrap().1;
        assert_eq!((factor(0), factor(1)), (-1.0, 1.0));
        assert!(derived.iter().all(|(c, _)| *c != Channel::RelativeVelocity));
    }

    #[test]
    fn analytic_the_speed_of_a_belt_is_known() {
        let belt = of("belt-leine");
        assert_eq!(belt.unit(Channel::Phi1), "m");
        let velocity = belt.find("v").unwrap();
        assert_eq!(velocity, Channel::Phi1Dot);
        assert_eq!(belt.find("stator_twist_rate_0"), Some(Channel::Phi1Dot));
        let derived = belt.derived(&[velocity]);
        assert_eq!(derived.len(), 1);
        let (channel, sum) = &derived[0];
        assert_eq!(*channel, Channel::RelativeVelocity);
        assert_eq!(sum.terms, [(0, -1.0)]);
        let end = Known {
            of: Which::Rotor,
            is_rate: true,
        };
        assert_eq!(sum.known, [(end, 1.0)]);
    }
}
