//! From the tree of values to a valid case of trains, with every problem on the way.

use super::conditions;
use super::keys::{self, ENDS, LUGRE, OF_BRISTLES, SIDES, SMOOTHINGS};
use crate::case::document::{Node, Value};
use crate::case::draft::Draft;
use crate::case::quantity::{self, Dimension};
use crate::case::reader::{Read, Reader, missing};
use crate::case::schema::{self, Domain};
use crate::case::value::{choice, number};
use crate::case::words::named_motion;
use crate::case::{Case, CaseError, CaseSource, Motion, Problem, Words};
use crate::friction::Law as _;
use crate::model::system::{
    Bristles, ContactLaw, End, Initial, Kick, KickSide, Pressing, Regularisation, Smoothing, System, Torque, Train,
};
use crate::signal::Drive;

/// Reads the general form; the overrides are in the tree, and what is wrong with them is in `problems`.
pub(in crate::case) fn read(
    source: &CaseSource,
    root: Node,
    problems: Vec<(usize, Problem)>,
) -> Result<Read, CaseError> {
    let motion = named_motion(&root);
    let known = motion.as_ref().ok().copied().flatten().unwrap_or_default();
    let mut reader = Reader::new(root, source.label(), problems, keys::known(), known);
    reader.further_law = Some((LUGRE, OF_BRISTLES));
    let mut train = SystemReader {
        motion: known,
        reader: &mut reader,
    };
    let case = match motion {
        Ok(_) => train.case(source),
        // Which units and keys the rest may have is not known without it.
        Err(message) => {
            train.report("motion", message);
            None
        }
    };
    if let (Some((case, draft)), true) = (&case, reader.problems.is_empty()) {
        for violation in conditions::violated(case, draft) {
            reader.report_violation(violation);
        }
    }
    reader.finish(case.map(|(case, _)| case))
}

/// A value that may be left out.
enum Given<T> {
    Absent,
    /// It has been reported.
    Wrong,
    Value(T),
}

impl<T> Given<T> {
    /// The value; `default` for none, and for a wrong one.
    fn or(self, default: T) -> T {
        match self {
            Given::Value(value) => value,
            _ => default,
        }
    }

    fn is_absent(&self) -> bool {
        matches!(self, Given::Absent)
    }
}

pub(super) struct SystemReader<'a> {
    pub(super) reader: &'a mut Reader,
    pub(super) motion: Motion,
}

impl SystemReader<'_> {
    fn report(&mut self, path: &str, message: impl Into<String>) {
        self.reader.report(path, message);
    }

    fn has(&self, path: &str) -> bool {
        self.reader.root.at(path).is_some()
    }

    /// `None` if it is wrong in a way that has been reported.
    fn case(&mut self, source: &CaseSource) -> Option<(Case, Draft)> {
        if self.has("torsion") {
            let message = "beside [rotor] and [stator]: it is the short form of a rotor of two inertias and a stator of one; \
                           keep either [torsion], or [rotor] and [stator]";
            self.report("torsion", message);
            take(&mut self.reader.root, "torsion");
        }
        self.reader.check_names();
        let bristles = self.bristles();
        let mut draft = Draft::blank(source.name());
        let rotor = self.train("rotor");
        let stator = self.train("stator");
        let pressing = self.pressing(&mut draft);
        self.radius(&mut draft);
        let regularisation = self.regularisation(bristles.is_some());
        let contact = match (bristles, regularisation) {
            (Some(bristles), _) => ContactLaw::Bristles(bristles),
            (None, Some(regularisation)) => ContactLaw::Regularised(regularisation),
            (None, None) => ContactLaw::StickSlip,
        };
        self.friction(&mut draft, &contact);
        self.reader.fill_keys(&mut draft, |path| {
            path == "title"
                || path == "contact.breakaway_test"
                || ["solver.", "output.", "perturbation"]
                    .iter()
                    .any(|table| path.starts_with(table))
        });
        self.reader.fill_output(&mut draft, &source.origin);
        let threshold = self.threshold(&contact, &draft);
        let kicks = self.kicks(&draft);
        let (rotor, stator) = (rotor?, stator?);
        let initial = self.initial(&rotor, &stator);
        let case = Case {
            title: draft.title.clone(),
            system: System {
                rotor,
                stator,
                radius: draft.parameters.contact.radius,
                pressing: pressing?,
                breakaway: draft.parameters.friction.breakaway,
                breakaway_test: draft.parameters.contact.breakaway_test,
                law: draft.parameters.friction.law.clone(),
                contact,
                initial,
                kicks,
            },
            words: Words::general(self.motion),
            threshold: threshold.unwrap_or(0.0),
            solver: draft.solver.clone(),
            output: draft.output.clone(),
        };
        Some((case, draft))
    }

    /// A number at a path of the tree.
    fn number(&mut self, path: &str) -> Given<f64> {
        let (dimension, domain) = keys::measure(path);
        let Some(node) = self.reader.root.at(path).cloned() else {
            return Given::Absent;
        };
        match number(&node.value, self.motion.dimension(dimension), domain) {
            Ok(number) => Given::Value(number),
            Err(message) => {
                self.report(path, message);
                Given::Wrong
            }
        }
    }

    /// The numbers of an array; `None` if one is wrong.
    pub(super) fn numbers(
        &mut self,
        path: &str,
        elements: &[Node],
        dimension: Dimension,
        domain: Domain,
    ) -> Option<Vec<f64>> {
        let mut numbers = Vec::with_capacity(elements.len());
        for (index, element) in elements.iter().enumerate() {
            match number(&element.value, dimension, domain) {
                Ok(number) => numbers.push(number),
                Err(message) => self.report(&format!("{path}.{index}"), message),
            }
        }
        (numbers.len() == elements.len()).then_some(numbers)
    }

    /// A list of numbers, or a number for a list of one.
    fn list(&mut self, path: &str) -> Given<Vec<f64>> {
        let (dimension, domain) = keys::measure(path);
        let dimension = self.motion.dimension(dimension);
        let numbers = match self.reader.root.at(path).map(|node| node.value.clone()) {
            None => return Given::Absent,
            Some(Value::Array(elements)) => self.numbers(path, &elements, dimension, domain),
            Some(value @ (Value::Integer(_) | Value::Float(_) | Value::Text(_))) => {
                match number(&value, dimension, domain) {
                    Ok(number) => Some(vec![number]),
                    Err(message) => {
                        self.report(path, message);
                        None
                    }
                }
            }
            Some(other) => {
                let expected = quantity::expectation(dimension);
                self.report(
                    path,
                    format!(
                        "expected a list of numbers, each {expected}, but got {}",
                        other.describe()
                    ),
                );
                None
            }
        };
        numbers.map_or(Given::Wrong, Given::Value)
    }

    /// Makes a list of one that was set element by element: what was not set is `default`. Elements beyond the list stay, and
    /// are reported.
    fn fill_list(&mut self, path: &str, count: usize, default: f64) {
        let Some(node) = node_mut(&mut self.reader.root, path) else {
            return;
        };
        let Value::Table(entries) = &node.value else { return };
        let elements: Option<Vec<(usize, Node)>> = entries
            .iter()
            .map(|(name, element)| Some((name.parse().ok()?, element.clone())))
            .collect();
        let Some(elements) = elements.filter(|elements| !elements.is_empty()) else {
            return;
        };
        let place = node.place.clone();
        if let Some((index, _)) = elements.iter().find(|(index, _)| *index >= count) {
            let message = match count {
                0 => format!("there is no {path}.{index}: the list has no element here"),
                1 => format!("there is no {path}.{index}: the only element is {path}.0"),
                _ => format!("there is no {path}.{index}: the last element is {path}.{}", count - 1),
            };
            self.report(&format!("{path}.{index}"), message);
            take(&mut self.reader.root, path);
            return;
        }
        let mut list = vec![
            Node {
                value: Value::Float(default),
                place: place.clone(),
            };
            count
        ];
        for (index, element) in elements {
            list[index] = element;
        }
        *node = Node {
            value: Value::Array(list),
            place,
        };
    }

    /// A list that has to have `count` elements, because of `why`; `default` for each if it is left out.
    fn counted(&mut self, path: &str, count: usize, why: &str, default: f64) -> Vec<f64> {
        self.fill_list(path, count, default);
        match self.list(path) {
            Given::Value(values) if values.len() == count => return values,
            Given::Value(values) => {
                let remedy = if count == 0 { "; remove it" } else { "" };
                let message = format!("{}, but {} expected: {why}{remedy}", have(values.len()), are(count));
                self.report(path, message);
            }
            Given::Absent | Given::Wrong => {}
        }
        vec![default; count]
    }

    fn train(&mut self, side: &'static str) -> Option<Train> {
        let path = |name: &str| format!("{side}.{name}");
        match self.reader.root.at(side).map(|node| &node.value) {
            None => {
                let message = format!(
                    "missing: the train of the {side}; write [{side}] with inertia, stiffness and end, or with end = \"fixed\" \
                     alone for rigid ground"
                );
                self.report(side, message);
                return None;
            }
            Some(Value::Table(_)) => {}
            // Reported with the names.
            Some(_) => return None,
        }
        let end_path = path("end");
        let end = match self.word(&end_path, ENDS) {
            Given::Value(end) => Some(end),
            Given::Wrong => None,
            Given::Absent => {
                let message = "missing: what holds the far end; write end = \"free\", \"fixed\" (to the ground) or \"driven\" (at \
                               a speed)";
                self.report(&end_path, message);
                None
            }
        };
        let speed = self.optional_signal(&path("speed"));
        let torque = self.optional_signal(&path("torque"));
        let inertia = self.list(&path("inertia"));
        // What follows from wrong values would only confuse.
        let end = end?;
        if matches!(inertia, Given::Wrong) {
            return None;
        }
        let inertia = inertia.or(Vec::new());
        let end = match (end, speed) {
            ("driven", Given::Value(speed)) => End::Driven(speed),
            ("driven", Given::Absent) => {
                let unit = self.motion.dimension(Dimension::AngularVelocity);
                let message = format!(
                    "missing: the speed of the driven end; write speed = a number in {} or \"{}\", or a signal",
                    unit.unit(),
                    unit.example()
                );
                self.report(&path("speed"), message);
                return None;
            }
            ("driven", Given::Wrong) => return None,
            (other, speed) => {
                if !speed.is_absent() {
                    let message = format!(
                        "belongs to a driven end, but end is \"{other}\": write end = \"driven\", or remove it; speeds at t = 0 are \
                         in [initial]"
                    );
                    self.report(&path("speed"), message);
                }
                if other == "free" { End::Free } else { End::Fixed }
            }
        };
        let count = inertia.len();
        if count == 0 && matches!(end, End::Free) {
            let message = "missing: a surface without inertia moves as its far end does, and nothing says how a free end moves; \
                           write inertia = [...], or end = \"fixed\" or \"driven\"";
            self.report(&path("inertia"), message);
            return None;
        }
        let mut train = Train {
            stiffness: Vec::new(),
            damping: Vec::new(),
            viscous: Vec::new(),
            inertia,
            end,
            torque: None,
        };
        let shafts = train.shafts();
        let why = shafts_of(&train);
        if shafts > 0 && !self.has(&path("stiffness")) {
            let unit = self.motion.dimension(Dimension::TorsionalStiffness).unit();
            let message = format!(
                "missing: {} expected: {why}; write stiffness = [...], numbers in {unit}{}",
                are(shafts),
                match train.end {
                    End::Driven(_) => ", or leave inertia out if the surface is itself driven",
                    End::Fixed => ", or write end = \"free\" if nothing holds it",
                    End::Free => "",
                }
            );
            self.report(&path("stiffness"), message);
        }
        train.stiffness = self.counted(&path("stiffness"), shafts, &why, f64::NAN);
        train.damping = self.counted(&path("damping"), shafts, &why, 0.0);
        let why = match count {
            0 => "there is no inertia".to_owned(),
            _ => format!("one for each inertia of the {side}"),
        };
        train.viscous = self.counted(&path("viscous"), count, &why, 0.0);
        train.torque = self.torque(side, count, torque);
        Some(train)
    }

    fn optional_signal(&mut self, path: &str) -> Given<Drive> {
        let (dimension, _) = keys::measure(path);
        match self.has(path) {
            false => Given::Absent,
            true => self.signal(path, dimension).map_or(Given::Wrong, Given::Value),
        }
    }

    fn torque(&mut self, side: &str, count: usize, torque: Given<Drive>) -> Option<Torque> {
        let [torque_path, on_path] = ["torque", "torque_on"].map(|name| format!("{side}.{name}"));
        if torque.is_absent() {
            if self.has(&on_path) {
                self.report(
                    &on_path,
                    format!("there is no {torque_path} that it is about: give one, or remove it"),
                );
            }
            return None;
        }
        if count == 0 {
            let message = format!(
                "a torque acts on an inertia, and the {side} has none: its end holds against any torque; remove it, or give inertia"
            );
            self.report(&torque_path, message);
            return None;
        }
        let on = match self.reader.root.at(&on_path).map(|node| node.value.clone()) {
            None => count - 1,
            Some(Value::Integer(on)) if (0..count as i64).contains(&on) => on as usize,
            Some(other) => {
                let written = match &other {
                    Value::Integer(on) => on.to_string(),
                    other => other.describe(),
                };
                let message = match count {
                    1 => format!("must be 0, the only inertia of the {side}, but is {written}"),
                    _ => format!(
                        "must be from 0 (the surface) to {} (the outermost of {count} inertias), but is {written}",
                        count - 1
                    ),
                };
                self.report(&on_path, message);
                return None;
            }
        };
        match torque {
            Given::Value(signal) => Some(Torque { signal, on }),
            _ => None,
        }
    }

    /// Where the normal force comes from.
    fn pressing(&mut self, draft: &mut Draft) -> Option<Pressing> {
        const FORCE: &str = "contact.normal_force";
        let table = ["axial", "actuation"].into_iter().find(|table| self.has(table));
        match (self.has(FORCE), table) {
            (true, Some(table)) => {
                let message = format!(
                    "the normal force is given twice, with [{table}]: keep either normal_force, or [axial] and [actuation]"
                );
                self.report(FORCE, message);
                None
            }
            (true, None) => match self.optional_signal(FORCE) {
                Given::Value(force) => Some(Pressing::Force(force)),
                _ => None,
            },
            (false, Some(_)) => {
                let of_axial = |path: &str| path.starts_with("axial.") || path.starts_with("actuation.");
                for table in ["axial", "actuation"] {
                    if !self.has(table) {
                        let message =
                            format!("missing: the axial mode presses by [axial] and [actuation]; write [{table}]");
                        self.report(table, message);
                        return None;
                    }
                }
                self.reader.fill_keys(draft, of_axial);
                Some(Pressing::Axial {
                    axial: draft.parameters.axial,
                    actuation: draft.parameters.actuation.clone(),
                })
            }
            (false, None) => {
                let message = "missing: what presses the surfaces together; write normal_force = a number in N or \"500 lbf\" (or a \
                               signal), or give [axial] and [actuation]";
                self.report(FORCE, message);
                None
            }
        }
    }

    fn radius(&mut self, draft: &mut Draft) {
        if self.motion == Motion::Rotation {
            self.reader.fill_keys(draft, |path| path == "contact.radius");
            return self.reader.contact(draft);
        }
        for name in ["radius", "outer_diameter", "inner_diameter", "wear"] {
            let path = format!("contact.{name}");
            if self.has(&path) {
                self.report(
                    &path,
                    "has no meaning in translation, where friction is mu F_n: remove it",
                );
            }
        }
        draft.parameters.contact.radius = 1.0;
    }

    /// With law "lugre": its bristles. The tree is left with the law g in its place.
    fn bristles(&mut self) -> Option<Bristles> {
        let chosen = match self.word(schema::FRICTION_LAW, &keys::laws()) {
            Given::Value(chosen) => chosen,
            Given::Absent => return None,
            Given::Wrong => {
                // The reader of the law knows the memoryless ones only, and would say less.
                take(&mut self.reader.root, "friction");
                return None;
            }
        };
        if chosen != LUGRE {
            for name in ["bristle_stiffness", "bristle_damping"] {
                let path = format!("friction.{name}");
                if self.has(&path) {
                    self.report(
                        &path,
                        format!(
                            "belongs to law \"{LUGRE}\", but the law is \"{chosen}\": remove it, or change friction.law"
                        ),
                    );
                }
            }
            return None;
        }
        let stiffness = self.number("friction.bristle_stiffness");
        if stiffness.is_absent() {
            self.missing("friction.bristle_stiffness");
        }
        let bristles = Bristles {
            stiffness: stiffness.or(f64::NAN),
            damping: self.number("friction.bristle_damping").or(0.0),
            viscous: self.number("friction.viscous").or(0.0),
        };
        if self.has("friction.regularisation") {
            let message = "a contact with bristles is smooth already: remove regularisation, or change friction.law";
            self.report("friction.regularisation", message);
            take(&mut self.reader.root, "friction.regularisation");
        }
        let given = match self.reader.root.at("friction").map(|node| &node.value) {
            Some(Value::Table(entries)) => entries.iter().map(|(name, _)| name.clone()).collect(),
            _ => Vec::new(),
        };
        for name in given {
            let path = format!("friction.{name}");
            let known = schema::keys().iter().any(|key| key.path == path);
            if known && !OF_BRISTLES.iter().any(|&(own, _)| own == name) {
                let own: Vec<&str> = OF_BRISTLES.iter().map(|&(own, _)| own).collect();
                self.report(
                    &path,
                    format!("the law is \"{LUGRE}\", which has {}: remove it", own.join(", ")),
                );
                take(&mut self.reader.root, &path);
            }
        }
        take(&mut self.reader.root, "friction.viscous");
        if let Some(node) = node_mut(&mut self.reader.root, schema::FRICTION_LAW) {
            node.value = Value::Text("stribeck".to_owned());
        }
        Some(bristles)
    }

    fn regularisation(&mut self, bristles: bool) -> Option<Regularisation> {
        let path = "friction.regularisation";
        if bristles || !matches!(self.reader.root.at(path).map(|node| &node.value), Some(Value::Table(_))) {
            return None;
        }
        let [function_path, speed_path] = ["function", "speed"].map(|name| format!("{path}.{name}"));
        let function = match self.word(&function_path, SMOOTHINGS) {
            Given::Value("tanh") => Some(Smoothing::Tanh),
            Given::Value(_) => Some(Smoothing::Arctan),
            Given::Wrong => None,
            Given::Absent => {
                self.missing(&function_path);
                None
            }
        };
        let speed = self.number(&speed_path);
        if speed.is_absent() {
            self.missing(&speed_path);
        }
        match speed {
            Given::Value(speed) => function.map(|function| Regularisation { function, speed }),
            _ => None,
        }
    }

    fn missing(&mut self, path: &str) {
        let message = missing(keys::find(path), self.motion);
        self.report(path, message);
    }

    /// The word of a key that takes one of several.
    fn word(&mut self, path: &str, words: &[&'static str]) -> Given<&'static str> {
        match self.reader.root.at(path).map(|node| choice(&node.value, words)) {
            None => Given::Absent,
            Some(Ok(word)) => Given::Value(word),
            Some(Err(message)) => {
                self.report(path, message);
                Given::Wrong
            }
        }
    }

    fn friction(&mut self, draft: &mut Draft, contact: &ContactLaw) {
        const BREAKAWAY: &str = "friction.breakaway";
        // A law of no such name has been reported, and what it would need is not known.
        if !self.has("friction") && self.reader.all.at("friction").is_some() {
            return;
        }
        let sticks = matches!(contact, ContactLaw::StickSlip) && !self.has("friction.regularisation");
        let may_lack = !sticks && !self.has(BREAKAWAY);
        self.reader.fill_keys(draft, |path| {
            path.starts_with("friction.") && !(may_lack && path == BREAKAWAY)
        });
        let friction = &mut draft.parameters.friction;
        if may_lack && self.reader.problems.is_empty() {
            friction.breakaway = friction.law.at_vanishing_speed();
        }
    }

    fn threshold(&mut self, contact: &ContactLaw, draft: &Draft) -> Option<f64> {
        let path = "friction.threshold";
        let default = match contact {
            ContactLaw::StickSlip => {
                if self.has(path) {
                    let message = "belongs to a contact without stick, a regularised one or one with bristles: a stick of this \
                                   one needs no threshold; remove it";
                    self.report(path, message);
                }
                return None;
            }
            ContactLaw::Regularised(regularisation) => 10.0 * regularisation.speed,
            ContactLaw::Bristles(_) => draft.parameters.friction.law.number("scale").unwrap_or(f64::NAN) / 10.0,
        };
        Some(self.number(path).or(default))
    }

    fn kicks(&mut self, draft: &Draft) -> Vec<Kick> {
        let mut kicks = Vec::new();
        for (index, kick) in draft.parameters.perturbations.iter().enumerate() {
            let path = format!("perturbation.{index}.on");
            let on = match self.word(&path, SIDES) {
                Given::Value("rotor") => KickSide::Rotor,
                Given::Value("stator") => KickSide::Stator,
                _ => KickSide::Both,
            };
            kicks.push(Kick {
                time: kick.time,
                relative_velocity: kick.relative_velocity,
                on,
            });
        }
        kicks
    }

    fn initial(&mut self, rotor: &Train, stator: &Train) -> Initial {
        let mut speeds = |side: &'static str, train: &Train| {
            let path = format!("initial.{side}_speed");
            let turning = match &train.end {
                End::Driven(speed) => speed.at_start(),
                _ => 0.0,
            };
            let why = format!("one for each inertia of the {side}");
            let twist = format!("initial.{side}_twist");
            let shafts = format!("one for each shaft of the {side}");
            (
                self.counted(&twist, train.stiffness.len(), &shafts, 0.0),
                self.counted(&path, train.inertia.len(), &why, turning),
            )
        };
        let (rotor_twist, mut rotor_speed) = speeds("rotor", rotor);
        let (stator_twist, stator_speed) = speeds("stator", stator);
        let speed = self.number("initial.speed");
        if !speed.is_absent() {
            if !matches!(rotor.end, End::Free) {
                let message = "is that of every inertia of a rotor with a free end, which this one has not: remove it, or give \
                               rotor_speed";
                self.report("initial.speed", message);
            } else if self.has("initial.rotor_speed") {
                let message = "the speeds of the rotor are given twice, with initial.rotor_speed: keep one of them";
                self.report("initial.speed", message);
            }
        }
        if let Given::Value(speed) = speed {
            rotor_speed.fill(speed);
        }
        Initial {
            rotor_twist,
            rotor_speed,
            stator_twist,
            stator_speed,
        }
    }
}

/// "has 2 numbers".
fn have(count: usize) -> String {
    match count {
        0 => "has no number".to_owned(),
        1 => "has one number".to_owned(),
        _ => format!("has {count} numbers"),
    }
}

/// "2 are".
fn are(count: usize) -> String {
    match count {
        0 => "none is".to_owned(),
        1 => "one is".to_owned(),
        _ => format!("{count} are"),
    }
}

/// Why a train has as many shafts as it has.
fn shafts_of(train: &Train) -> String {
    let between = match train.inertia.len() {
        0 => return "without inertia there is no shaft".to_owned(),
        1 => None,
        2 => Some("one shaft between the 2 inertias".to_owned()),
        count => Some(format!("{} shafts between the {count} inertias", count - 1)),
    };
    let to_end = match train.end {
        End::Free => None,
        End::Fixed => Some("one from the outermost inertia to the ground"),
        End::Driven(_) => Some("one from the outermost inertia to the driven end"),
    };
    match (between, to_end) {
        (Some(between), Some(to_end)) => format!("{between}, and {to_end}"),
        (Some(between), None) => between,
        (None, Some(to_end)) => to_end.to_owned(),
        (None, None) => "a single inertia with a free end has no shaft".to_owned(),
    }
}

/// Takes the value at `path` out of the tree.
fn take(root: &mut Node, path: &str) {
    let (parent, name) = match path.rsplit_once('.') {
        Some((parent, name)) => (node_mut(root, parent), name),
        None => (Some(root), path),
    };
    if let Some(Node {
        value: Value::Table(entries),
        ..
    }) = parent
    {
        entries.retain(|(key, _)| key != name);
    }
}

/// The node at a path of keys.
fn node_mut<'a>(root: &'a mut Node, path: &str) -> Option<&'a mut Node> {
    path.split('.').try_fold(root, |node, segment| match &mut node.value {
        Value::Table(entries) => (entries.iter_mut())
            .find(|(key, _)| key == segment)
            .map(|(_, node)| node),
        _ => None,
    })
}
