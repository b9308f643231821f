//! Reads the keys of the schema from the tree of values into a draft, and gathers every problem on the way.

use super::conditions::Violation;
use super::document::{Node, Place, Value};
use super::draft::Draft;
use super::error::{CaseError, Problem};
use super::quantity::Dimension;
use super::schema::{self, ARRAYS, Domain, Key, Kind, Presence};
use super::setting::read_setting;
use super::source::Origin;
use super::value::{choice, number};
use super::{Case, Motion, Setting, suggest};
use crate::friction::FrictionLaw;
use crate::model::KickTime;
use crate::model::contact::{uniform_pressure_radius, uniform_wear_radius};
use crate::quote::shown;
use crate::signal::Signal;
use crate::simulation::Around;

/// A case, and its values as they were written.
pub(super) struct Read {
    pub(super) case: Case,
    /// With bristles, `friction` holds the law g alone.
    pub(super) of_law: Node,
    pub(super) written: Node,
}

/// Reads the keys of a case from the tree of its values, and gathers what is wrong.
pub(super) struct Reader {
    /// What is read.
    pub(super) root: Node,
    /// The whole tree, where each value has its place.
    pub(super) all: Node,
    label: String,
    /// Each with the rank of its place.
    pub(super) problems: Vec<(usize, Problem)>,
    /// The paths of all keys that there are, with `[]` for indices.
    known: Vec<&'static str>,
    /// What the numbers measure.
    motion: Motion,
    /// A law beyond [`FrictionLaw`] that the case may have, and its keys, each with whether it is required.
    pub(super) further_law: Option<(&'static str, &'static [(&'static str, bool)])>,
}

impl Reader {
    pub(super) fn new(
        root: Node,
        label: String,
        problems: Vec<(usize, Problem)>,
        known: Vec<&'static str>,
        motion: Motion,
    ) -> Reader {
        Reader {
            all: root.clone(),
            root,
            label,
            problems,
            known,
            motion,
            further_law: None,
        }
    }

    /// What was left out of [output] and follows from the rest of it.
    pub(super) fn fill_output(&self, case: &mut Draft, origin: &Origin) {
        const SAMPLES: f64 = 1000.0;
        let output = &mut case.output;
        if output.interval.is_nan() {
            output.interval = output.end_time / SAMPLES;
        }
        for window in &mut output.windows {
            if window.interval.is_nan() {
                window.interval = (window.to - window.from) / SAMPLES;
            }
        }
        // The case in a result file says all that it has: of a version without the key, it has no such samples.
        let written = !matches!(origin, Origin::Result(_));
        let said = self.root.at(schema::AROUND).is_some();
        if written && !said && output.windows.is_empty() && case.solver.method.locates_events() {
            output.follow.around = Some(Around::Events);
        }
    }

    /// The case with its values, or the problems in the order of the file.
    pub(super) fn finish(self, case: Option<Case>) -> Result<Read, CaseError> {
        if let (Some(case), true) = (case, self.problems.is_empty()) {
            return Ok(Read {
                case,
                of_law: self.root,
                written: self.all,
            });
        }
        let mut problems = self.problems;
        problems.sort_by_key(|&(rank, _)| rank);
        let problems: Vec<Problem> = problems.into_iter().map(|(_, problem)| problem).collect();
        match problems.is_empty() {
            true => Err(CaseError::one(self.label, "", "the case cannot be read")),
            false => Err(CaseError { problems }),
        }
    }

    /// Finds unknown keys in the whole tree.
    pub(super) fn check_names(&mut self) {
        let root = self.root.clone();
        self.check_names_of(&root, "", "");
    }

    /// Reports a problem at the value of `path`, or at what would contain it.
    pub(super) fn report(&mut self, path: &str, message: impl Into<String>) {
        let place = self.place(path);
        self.push(place, path, message.into());
    }

    /// Reports a condition at the override that broke it, or at the value that it is about.
    pub(super) fn report_violation(&mut self, violation: Violation) {
        let Violation { path, with, message } = violation;
        let broken_by = with
            .iter()
            .find(|other| self.is_overridden(other) && !self.is_overridden(&path));
        let place = self.place(broken_by.unwrap_or(&path));
        self.push(place, &path, message);
    }

    /// The place of the value at `path`, or of what would contain it; `None` if that is the whole file.
    fn place(&self, path: &str) -> Option<Place> {
        let node = self.all.closest(path);
        (!std::ptr::eq(node, &self.all)).then(|| node.place.clone())
    }

    fn push(&mut self, place: Option<Place>, key: &str, message: String) {
        // What is missing altogether is on no line: it comes after the lines and before the overrides.
        let (rank, place) = match place {
            None => (usize::MAX - 1, self.label.clone()),
            Some(place) => (place.rank(), place.show(&self.label)),
        };
        let problem = Problem {
            place,
            key: key.to_owned(),
            message,
        };
        self.problems.push((rank, problem));
    }

    /// Whether the value at `path` comes from an override.
    fn is_overridden(&self, path: &str) -> bool {
        matches!(self.all.closest(path).place, Place::Override(_))
    }

    /// Finds unknown keys, and tables and arrays where they do not belong. `path` is where `node` is; `pattern`
    /// is the same with `[]` for indices, as in the schema.
    fn check_names_of(&mut self, node: &Node, path: &str, pattern: &str) {
        let Value::Table(entries) = &node.value else {
            return self.report(path, format!("expected a table, but got {}", node.value.describe()));
        };
        for (name, child) in entries {
            let parent = path;
            // Quoted, so that a key with a dot in its name is not taken for a path.
            let segment = toml_edit::Key::new(name).to_string();
            let path = join(parent, &segment);
            let pattern_here = join(pattern, &segment);
            let inside = format!("{pattern_here}.");
            if ARRAYS.iter().any(|array| array.path == pattern_here) {
                match &child.value {
                    Value::Array(elements) => {
                        for (index, element) in elements.iter().enumerate() {
                            self.check_names_of(
                                element,
                                &join(&path, &index.to_string()),
                                &format!("{pattern_here}[]"),
                            );
                        }
                    }
                    _ => self.report(
                        &path,
                        format!("expected an array of tables: write [[{path}]], or {path} = []"),
                    ),
                }
            } else if self.known.iter().any(|key| key.starts_with(&inside)) {
                self.check_names_of(child, &path, &pattern_here);
            } else if !self.known.contains(&pattern_here.as_str()) {
                let message = unknown_key(name, parent, pattern, &self.known);
                self.push(Some(child.place.clone()), &path, message);
            }
        }
    }

    /// Reads those keys that `wanted` says yes to, by their paths.
    pub(super) fn fill_keys(&mut self, case: &mut Draft, wanted: impl Fn(&str) -> bool) {
        for array in ARRAYS {
            if let Some(Value::Array(elements)) = self.root.at(array.path).map(|node| &node.value) {
                (array.resize)(case, elements.len());
            }
        }
        for key in schema::keys().iter().filter(|key| wanted(key.path)) {
            let count = schema::array_of(key).map_or(1, |(array, _)| (array.length)(case));
            for index in 0..count {
                self.fill_key(case, key, index);
            }
        }
    }

    fn fill_key(&mut self, case: &mut Draft, key: &Key, index: usize) {
        let path = schema::concrete(key, index);
        if let Presence::Profile(profile) = key.presence {
            match self.chosen_profile() {
                Some(chosen) if chosen == profile => {}
                Some(chosen) => return self.check_left_over(key, profile, chosen),
                None => return,
            }
            // What is left of the other profile says how to switch; that more is missing follows from it.
            if self.is_overridden("actuation.profile") && self.left_over(profile).is_some() {
                return;
            }
        }
        if let Presence::Law { .. } = key.presence {
            let Some(law) = self.chosen_law() else { return };
            if !FrictionLaw::keys_of(law)
                .iter()
                .any(|name| key.path == format!("friction.{name}"))
            {
                return self.check_other_law(key, law);
            }
            // As above.
            if self.is_overridden(schema::FRICTION_LAW) && self.of_other_laws(law).next().is_some() {
                return;
            }
        }
        let Some(node) = self.root.at(&path).cloned() else {
            // Something else in the place of the table has been reported already.
            let in_table = matches!(self.root.closest(&path).value, Value::Table(_));
            let required = matches!(
                key.presence,
                Presence::Required | Presence::Profile(_) | Presence::Law { default: None }
            );
            if in_table && required {
                self.report(&path, missing(key, self.motion));
            }
            return;
        };
        if let Err(complaints) = store(case, key, index, &node, self.motion) {
            for (inner, message) in complaints {
                self.report(&format!("{path}{inner}"), message);
            }
        }
    }

    /// A key that is given although it belongs to another profile than the chosen one.
    fn left_over(&self, chosen: &'static str) -> Option<&'static Key> {
        schema::keys().iter().find(|key| {
            let of_another = matches!(key.presence, Presence::Profile(profile) if profile != chosen);
            // A path that the chosen profile has as well is its own.
            let shared = schema::keys()
                .iter()
                .any(|k| k.path == key.path && k.presence == Presence::Profile(chosen));
            of_another && !shared && self.root.at(key.path).is_some()
        })
    }

    /// Reports `key`, of `profile`, if it is given although the profile is `chosen`.
    fn check_left_over(&mut self, key: &Key, profile: &'static str, chosen: &'static str) {
        if self.left_over(chosen).is_none_or(|left| left.path != key.path) {
            return;
        }
        let overridden = self.is_overridden("actuation.profile");
        // The override tells which of the two profiles is meant.
        let meant = if overridden { chosen } else { profile };
        let remedy = match meant {
            _ if !overridden && !self.is_overridden(key.path) => "remove it, or change the profile".to_owned(),
            meant => format!("replace the whole table, {}", schema::whole_actuation(meant)),
        };
        let place = if overridden { "actuation.profile" } else { key.path };
        let message = format!("belongs to profile \"{profile}\", but the profile is \"{chosen}\": {remedy}");
        let place = self.place(place);
        self.push(place, key.path, message);
    }

    /// The friction law, if it is one that exists.
    fn chosen_law(&self) -> Option<&'static str> {
        let mut names = FrictionLaw::NAMES.iter().copied();
        match self.root.at(schema::FRICTION_LAW).map(|node| &node.value) {
            None => names.next(),
            Some(Value::Text(name)) => names.find(|known| known == name),
            _ => None,
        }
    }

    /// The keys that are given although they belong to other friction laws than `law`.
    fn of_other_laws(&self, law: &'static str) -> impl Iterator<Item = &'static Key> {
        let own = FrictionLaw::keys_of(law);
        schema::keys().iter().filter(move |key| {
            let name = key.path.strip_prefix("friction.").unwrap_or_default();
            matches!(key.presence, Presence::Law { .. }) && !own.contains(&name) && self.root.at(key.path).is_some()
        })
    }

    /// Reports `key`, of other friction laws than `law`, if it is given.
    fn check_other_law(&mut self, key: &Key, law: &'static str) {
        if self.root.at(key.path).is_none() {
            return;
        }
        let name = key.path.strip_prefix("friction.").unwrap_or(key.path);
        let further = self
            .further_law
            .filter(|(_, keys)| keys.iter().any(|&(own, _)| own == name));
        let owners: Vec<String> = FrictionLaw::NAMES
            .iter()
            .filter(|owner| FrictionLaw::keys_of(owner).contains(&name))
            .chain(further.iter().map(|(law, _)| law))
            .map(|owner| format!("\"{owner}\""))
            .collect();
        let by_default = if self.root.at(schema::FRICTION_LAW).is_none() {
            ", the default"
        } else {
            ""
        };
        let belongs = format!(
            "belongs to law {}, but the law is \"{law}\"{by_default}",
            owners.join(" or ")
        );
        if !self.is_overridden(schema::FRICTION_LAW) {
            return self.report(key.path, format!("{belongs}: remove it, or change friction.law"));
        }
        // One message says how to switch.
        if self
            .of_other_laws(law)
            .next()
            .is_some_and(|first| first.path == key.path)
        {
            let own: String = FrictionLaw::keys_of(law)
                .iter()
                .map(|own| format!(", {own}=..."))
                .collect();
            let message = format!("{belongs}: replace the whole table, friction={{law=\"{law}\", breakaway=...{own}}}");
            let place = self.place(schema::FRICTION_LAW);
            self.push(place, key.path, message);
        }
    }

    /// The profile of the actuation, if it is one that exists.
    fn chosen_profile(&self) -> Option<&'static str> {
        match self.root.at("actuation.profile").map(|node| &node.value) {
            Some(Value::Text(name)) => Signal::NAMES.iter().copied().find(|known| known == name),
            _ => None,
        }
    }

    /// The friction radius, given or from the diameters of the contact.
    pub(super) fn contact(&mut self, case: &mut Draft) {
        let [outer, inner, wear] = ["contact.outer_diameter", "contact.inner_diameter", "contact.wear"];
        let given: Vec<&str> = [outer, inner, wear]
            .into_iter()
            .filter(|path| self.root.at(path).is_some())
            .collect();
        let radius = self.root.at("contact.radius").is_some();
        match (radius, given.first()) {
            (true, Some(&first)) => self.radius_twice(first),
            (true, None) => {}
            (false, None) => self.report(
                "contact.radius",
                "missing: r, the effective friction radius; give radius, or outer_diameter, inner_diameter and wear",
            ),
            (false, Some(_)) => {
                let outer_diameter = self.source(outer, length);
                let inner_diameter = self.source(inner, length);
                let wear = self.source(wear, |key, value| choice(value, &key.choices()));
                let (Some(outer_diameter), Some(inner_diameter), Some(wear)) = (outer_diameter, inner_diameter, wear)
                else {
                    return;
                };
                if inner_diameter >= outer_diameter {
                    return self.report(
                        inner,
                        format!("must be smaller than outer_diameter: {inner_diameter:?} m is not below {outer_diameter:?} m"),
                    );
                }
                let radius = match wear {
                    schema::UNIFORM_PRESSURE => uniform_pressure_radius(outer_diameter, inner_diameter),
                    _ => uniform_wear_radius(outer_diameter, inner_diameter),
                };
                if let Some(complaint) = Domain::Positive.complaint(radius) {
                    self.report(outer, format!("gives a radius that {complaint}, but is {radius:?} m"));
                }
                case.parameters.contact.radius = radius;
            }
        }
    }

    fn radius_twice(&mut self, diameter: &str) {
        let radius = "contact.radius";
        // Where only one of the two is an override, that is what to change.
        let (overridden, path, other) = match (self.is_overridden(radius), self.is_overridden(diameter)) {
            (false, true) => (true, diameter, radius),
            (overridden, _) => (overridden, radius, diameter),
        };
        let at = self.root.closest(other).place.show(&self.label);
        let remedy = match (overridden, path == radius) {
            (false, _) => "keep either radius, or outer_diameter, inner_diameter and wear",
            (true, true) => "replace the whole table, contact={radius=...}",
            (true, false) => {
                "replace the whole table, contact={outer_diameter=..., inner_diameter=..., wear=\"uniform-wear\"}"
            }
        };
        self.report(
            path,
            format!("the radius is given twice, with {other} ({at}): {remedy}"),
        );
    }

    /// A value that is only turned into another one of the case.
    fn source<T>(&mut self, path: &str, read: impl Fn(&Key, &Value) -> Result<T, String>) -> Option<T> {
        let key = schema::keys().iter().find(|key| key.path == path)?;
        let result = match self.root.at(path) {
            Some(node) => read(key, &node.value),
            None => Err(missing(key, self.motion)),
        };
        result.map_err(|message| self.report(path, message)).ok()
    }
}

fn length(key: &Key, value: &Value) -> Result<f64, String> {
    match key.kind {
        Kind::Source(dimension, domain) => number(value, dimension, domain),
        _ => Err("not a length".to_owned()),
    }
}

/// What is wrong with a value, each with the path of the element from the key on (`""` for the value itself).
type Complaints = Vec<(String, String)>;

fn store(case: &mut Draft, key: &Key, index: usize, node: &Node, motion: Motion) -> Result<(), Complaints> {
    let value = &node.value;
    let whole = |message: String| vec![(String::new(), message)];
    match &key.kind {
        Kind::Choice(names, access) => {
            let name = choice(value, &names()).map_err(whole)?;
            (access.set)(case, index, name);
        }
        Kind::Moment(access) => {
            let time = match value {
                Value::Text(word) if word == schema::INSTABILITY => KickTime::Instability,
                Value::Text(word) if !word.contains(|c: char| c.is_ascii_digit()) => {
                    return Err(whole(format!(
                        "expected a time, s, or \"{}\", but got \"{word}\"",
                        schema::INSTABILITY,
                        word = shown(word)
                    )));
                }
                other => KickTime::At(number(other, Dimension::Time, Domain::NotNegative).map_err(whole)?),
            };
            (access.set)(case, index, time);
        }
        Kind::Series(dimension, access) => {
            let Value::Array(elements) = value else {
                return Err(whole(format!(
                    "expected an array of numbers, but got {}",
                    value.describe()
                )));
            };
            let mut numbers = Vec::with_capacity(elements.len());
            let mut complaints = Vec::new();
            for (index, element) in elements.iter().enumerate() {
                match number(&element.value, motion.dimension(*dimension), Domain::Any) {
                    Ok(value) => numbers.push(value),
                    Err(message) => complaints.push((format!(".{index}"), message)),
                }
            }
            if !complaints.is_empty() {
                return Err(complaints);
            }
            (access.set)(case, index, numbers);
        }
        Kind::Number(dimension, domain, access) => {
            let number = number(value, motion.dimension(*dimension), *domain).map_err(whole)?;
            (access.set)(case, index, number);
        }
        // Read by `Reader::contact`.
        Kind::Source(..) | Kind::SourceChoice(_) => {}
        kind => match (kind, read_setting(key, value, motion).map_err(whole)?) {
            (Kind::Text(access), Setting::Text(text)) => (access.set)(case, index, text),
            (Kind::Flag(access), Setting::Flag(flag)) => (access.set)(case, index, flag),
            (Kind::Count(access), Setting::Count(count)) => (access.set)(case, index, count),
            (kind, setting) => unreachable!("{kind:?} has no {setting:?}"),
        },
    }
    Ok(())
}

pub(super) fn missing(key: &Key, motion: Motion) -> String {
    format!("missing: {}{}", key.description, how_to_write(key, motion))
}

/// How the key is written, as the end of a message.
fn how_to_write(key: &Key, motion: Motion) -> String {
    let name = key.path.rsplit('.').next().unwrap_or(key.path);
    let choices = key.choices();
    match key.dimension().map(|dimension| motion.dimension(dimension)) {
        Some(Dimension::Number) if matches!(key.kind, Kind::Series(..)) => {
            format!("; write {name} = [...], plain numbers")
        }
        Some(Dimension::Number) => format!("; write {name} = a number"),
        Some(dimension) if matches!(key.kind, Kind::Series(..)) => {
            format!("; write {name} = [...], numbers in {}", dimension.unit())
        }
        Some(dimension) => format!(
            "; write {name} = a number in {} or \"{}\"",
            dimension.unit(),
            dimension.example()
        ),
        None if choices.is_empty() => String::new(),
        None => format!("; write {name} = \"{}\"", choices.join("\" or \"")),
    }
}

/// What to say about a key that does not exist in the table at `parent`, which is `pattern` in the schema.
fn unknown_key(name: &str, parent: &str, pattern: &str, known: &[&'static str]) -> String {
    let start = if pattern.is_empty() {
        String::new()
    } else {
        format!("{pattern}.")
    };
    let mut here: Vec<&str> = known
        .iter()
        .filter_map(|key| key.strip_prefix(start.as_str()))
        .map(|rest| rest.split(['.', '[']).next().unwrap_or(rest))
        .collect();
    here.dedup();
    if let Some(close) = suggest(name, here.iter().copied()) {
        return format!("unknown key; did you mean {}?", join(parent, close));
    }
    let elsewhere = known.iter().find(|key| key.rsplit('.').next() == Some(name));
    if let Some(key) = elsewhere {
        return format!("unknown key; did you mean {key}?");
    }
    match pattern {
        "" => format!("unknown key; there are {}", here.join(", ")),
        _ => format!("unknown key; [{pattern}] has {}", here.join(", ")),
    }
}

pub(super) fn join(path: &str, name: &str) -> String {
    if path.is_empty() {
        name.to_owned()
    } else {
        format!("{path}.{name}")
    }
}
