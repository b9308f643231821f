//! From the tree of values to a valid case, with all problems found on the way.

use super::case_keys::of_other_form;
use super::conditions::{self, Violation};
use super::document::{CaseError, CaseProblem, CaseValue, PlacedValue, TextPlace};
use super::place::Content;
use super::quantity::{self, Dimension};
use super::schema::{self, ARRAYS, Key, KeyKind, Presence};
use super::source::Origin;
use super::value::{number, numbers, signal, single};
use super::words::{form_of, named_motion};
use super::{Case, CaseSource, Motion, Override, Words, suggest};
use stickslip_engine::simulation::{Around, Method};
use stickslip_system::friction::Law as _;
use stickslip_system::signal::Signal;

pub(super) struct ReadCase {
    pub(super) case: Case,
    pub(super) written: PlacedValue,
}

pub(super) struct Reader {
    pub(super) root: PlacedValue,
    pub(super) label: String,
    problems: Vec<(usize, CaseProblem)>,
    pub(super) words: Words,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Given {
    Absent,
    Wrong,
    Right,
}

pub(super) fn read(source: &CaseSource, overrides: &[Override]) -> Result<ReadCase, CaseError> {
    let (root, short, problems) = form_of(source, overrides)?;
    let motion = if short { Ok(None) } else { named_motion(&root) };
    let known = motion.as_ref().ok().copied().flatten().unwrap_or_default();
    let words = if short { Words::SHORT } else { Words::general(known) };
    let mut reader = Reader {
        root,
        label: source.label(),
        problems: problems.into_iter().map(|problem| (usize::MAX, problem)).collect(),
        words,
    };
    let mut case = Case::blank(source.name(), words);
    match motion {
        Ok(_) => reader.case(&mut case, &source.origin),
        // Units and keys of the rest depend on the motion.
        Err(message) => reader.report("motion", message),
    }
    // Conditions between values are checked only if all values were read.
    if reader.problems.is_empty() {
        for violation in conditions::violated(&case) {
            reader.report_violation(violation);
        }
    }
    let mut problems = reader.problems;
    if problems.is_empty() {
        let written = reader.root;
        return Ok(ReadCase { case, written });
    }
    problems.sort_by_key(|&(rank, _)| rank);
    let problems = problems.into_iter().map(|(_, problem)| problem).collect();
    Err(CaseError { problems })
}

impl Reader {
    fn case(&mut self, case: &mut Case, origin: &Origin) {
        let root = self.root.clone();
        self.check_names(&root, "", "");
        let short = self.words.short;
        let has_chains = short || (self.chain(case, "rotor") & self.chain(case, "stator"));
        if !short {
            self.pressing(case);
        }
        self.contact_law(case);
        for array in ARRAYS {
            if let Some(CaseValue::Array(elements)) = self.root.at(array).map(|node| &node.value) {
                schema::resize(case, array, elements.len());
            }
        }
        // Without stick, the default of breakaway is the law at vanishing speed.
        let sticks = self.sticks(case) && !self.is_reported("friction.law");
        let needs_breakaway = sticks || self.has("friction.breakaway");
        self.fill(case, |key| match key.split() {
            ("rotor" | "stator", _) | ("contact", "radius") | ("friction", "law") => false,
            ("friction", "breakaway" | "breakaway_backward") => needs_breakaway,
            ("initial", _) => short,
            _ => true,
        });
        if !needs_breakaway && self.problems.is_empty() {
            let law = &mut case.system.law;
            case.system.breakaway = law.at_vanishing_speed();
            if let Some(backward) = law.backward() {
                law.set_number("breakaway_backward", backward.law.at_vanishing_speed());
            }
        }
        const FIXED_STEP: &str = "solver.fixed_step";
        let key = case.solver.method.step_key();
        if key != FIXED_STEP && self.has(FIXED_STEP) {
            let method = case.solver.method.name();
            let message = format!("with method \"{method}\" the length of the steps is {key}: give that alone");
            self.report(FIXED_STEP, message);
        }
        self.radius(case);
        self.threshold(case);
        if !short && has_chains {
            self.initial(case);
        }
        self.fill_output(case, origin);
    }

    fn fill_output(&self, case: &mut Case, origin: &Origin) {
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
        // The case in a result file lists all its values: if an old version lacks this key, it has no such samples.
        let written = !matches!(origin, Origin::Result(_));
        if written && !self.has(schema::AROUND) && output.windows.is_empty() && case.solver.method.locates_events() {
            output.follow.around = Some(Around::Events);
        }
    }

    pub(super) fn has(&self, path: &str) -> bool {
        self.root.at(path).is_some()
    }

    /// Reports a problem at the value of `path`, or at its closest ancestor.
    pub(super) fn report(&mut self, path: &str, message: impl Into<String>) {
        let place = self.place(path);
        self.push(place, path, message.into());
    }

    pub(super) fn is_reported(&self, path: &str) -> bool {
        self.problems.iter().any(|(_, problem)| problem.key == path)
    }

    /// Reports a violated condition at the override that broke it, else at the value itself.
    pub(super) fn report_violation(&mut self, violation: Violation) {
        let Violation { path, with, message } = violation;
        let mut others = with
            .iter()
            .filter(|other| self.is_overridden(other) && !self.is_overridden(&path));
        let place = self.place(others.next().unwrap_or(&path));
        self.push(place, &path, message);
    }

    /// The place of the value at `path` or of its closest ancestor; `None` for the whole file.
    fn place(&self, path: &str) -> Option<TextPlace> {
        let node = self.root.closest(path);
        (!std::ptr::eq(node, &self.root)).then(|| node.place.clone())
    }

    fn push(&mut self, place: Option<TextPlace>, key: &str, message: String) {
        // A missing value has no line: its problem is sorted after the lines and before the overrides.
        let (rank, place) = match place {
            None => (usize::MAX - 1, self.label.clone()),
            Some(place) => (place.rank(), place.show(&self.label)),
        };
        let problem = CaseProblem {
            place,
            key: key.to_owned(),
            message,
        };
        self.problems.push((rank, problem));
    }

    pub(super) fn is_overridden(&self, path: &str) -> bool {
        matches!(self.root.closest(path).place, TextPlace::Override(_))
    }

    /// Finds unknown keys, and tables and arrays in wrong places. `path` leads to `node`; `pattern` is the path in the
    /// schema, with `[]` for indices.
    fn check_names(&mut self, node: &PlacedValue, path: &str, pattern: &str) {
        let CaseValue::Table(entries) = &node.value else {
            return self.report(path, format!("expected a table, but got {}", node.value.describe()));
        };
        let known = schema::known(self.words.short);
        for (name, child) in entries {
            let parent = path;
            // Quoted, so that a dot in a name is no separator.
            let segment = toml_edit::Key::new(name).to_string();
            let path = join(parent, &segment);
            let pattern_here = join(pattern, &segment);
            let inside = format!("{pattern_here}.");
            if ARRAYS.contains(&pattern_here.as_str()) {
                match &child.value {
                    CaseValue::Array(elements) => {
                        for (index, element) in elements.iter().enumerate() {
                            self.check_names(element, &join(&path, &index.to_string()), &format!("{pattern_here}[]"));
                        }
                    }
                    _ => self.report(
                        &path,
                        format!("expected an array of tables: write [[{path}]], or {path} = []"),
                    ),
                }
            } else if known.iter().any(|key| key.starts_with(&inside)) {
                self.check_names(child, &path, &pattern_here);
            } else if !known.contains(&pattern_here.as_str()) && !self.check_form(child, &path) {
                let message = unknown_key(name, parent, pattern, &known);
                self.push(Some(child.place.clone()), &path, message);
            }
        }
    }

    /// Reports keys of the other form in an unknown table. Returns whether there are any.
    fn check_form(&mut self, node: &PlacedValue, path: &str) -> bool {
        if path == "torsion" && matches!(node.place, TextPlace::Line(_)) {
            let message = "beside [rotor] and [stator]: it is the short form of a rotor of two inertias and a stator of one; \
                           keep either [torsion], or [rotor] and [stator]";
            self.report(path, message);
            return true;
        }
        if let (CaseValue::Table(entries), None) = (&node.value, node.at("profile")) {
            let mut any = false;
            for (name, child) in entries {
                any |= self.check_form(child, &join(path, name));
            }
            return any;
        }
        let message = of_other_form(path, self.words.short);
        message.is_some_and(|message| {
            self.push(Some(node.place.clone()), path, message);
            true
        })
    }

    pub(super) fn fill(&mut self, case: &mut Case, wanted: impl Fn(&Key) -> bool) {
        for key in schema::in_order(self.words.short).iter().filter(|key| wanted(key)) {
            for index in 0..key.count(case) {
                self.fill_key(case, key, index);
            }
        }
    }

    /// Reads the key at a path outside arrays of tables.
    pub(super) fn fill_path(&mut self, case: &mut Case, path: &str) -> Given {
        let found = schema::find(path, self.words.short).next();
        found.map_or(Given::Absent, |(key, index, _)| self.fill_key(case, key, index))
    }

    fn fill_key(&mut self, case: &mut Case, key: &Key, index: usize) -> Given {
        let path = key.concrete(index);
        if let Some(choice) = DecidingWord::of(key) {
            let chosen = self.chosen(choice);
            let Some(chosen) = chosen.filter(|chosen| belongs(key, chosen)) else {
                if let Some(chosen) = chosen {
                    self.check_choice(key, choice, chosen);
                }
                return Given::Wrong;
            };
            // The message about leftover keys of the former choice says how to switch; missing keys follow from it.
            if self.is_overridden(choice.path) && self.foreign(choice, chosen).next().is_some() {
                return Given::Wrong;
            }
        }
        if key.places(case, index).is_empty() {
            return Given::Absent;
        }
        let Some(node) = self.root.at(&path) else {
            // A value of another kind instead of the table has already been reported.
            let in_table = matches!(self.root.closest(&path).value, CaseValue::Table(_));
            let required = matches!(
                key.presence,
                Presence::Required | Presence::Profile(_) | Presence::Method(_) | Presence::Law { default: None }
            );
            if in_table && required {
                self.report(&path, missing(key, self.words.motion()));
            }
            return Given::Absent;
        };
        let read = content(key, &path, node, self.words.motion());
        self.taken(read).map_or(Given::Wrong, |content| {
            for mut place in key.places(case, index) {
                place.set(content.clone());
            }
            Given::Right
        })
    }

    /// The value, or its problems are reported.
    pub(super) fn taken<T>(&mut self, read: Result<T, Vec<Violation>>) -> Option<T> {
        read.map_err(|wrong| wrong.into_iter().for_each(|violation| self.report_violation(violation)))
            .ok()
    }

    fn chosen(&self, choice: &DecidingWord) -> Option<&'static str> {
        let mut words = (choice.words)(self.words.short).into_iter();
        match self.root.at(choice.path).map(|node| &node.value) {
            None => words.next().filter(|_| choice.has_default),
            Some(CaseValue::Text(word)) => words.find(|known| known == word),
            _ => None,
        }
    }

    /// Keys that are given but belong to another word of the choice only.
    fn foreign(&self, choice: &'static DecidingWord, chosen: &'static str) -> impl Iterator<Item = &'static Key> {
        let keys = schema::in_order(self.words.short).iter().copied();
        keys.filter(move |key| {
            DecidingWord::of(key).is_some_and(|of| of.path == choice.path)
                && self.has(key.path)
                && !schema::find(key.path, self.words.short).any(|found| belongs(found.0, chosen))
        })
    }

    /// Reports `key` if it is given but belongs to another word of the choice.
    fn check_choice(&mut self, key: &Key, choice: &'static DecidingWord, chosen: &'static str) {
        if !self.has(key.path) {
            return;
        }
        let mut foreign = self.foreign(choice, chosen).map(|key| key.path);
        let overridden = self.has(choice.path) && self.is_overridden(choice.path);
        // Only one message says how to switch.
        let is_told = match overridden {
            true => foreign.next() == Some(key.path),
            false => foreign.any(|path| path == key.path),
        };
        if !is_told {
            return;
        }
        drop(foreign);
        let words = (choice.words)(self.words.short).into_iter();
        let owners: Vec<&str> = words.filter(|word| belongs(key, word)).collect();
        // The override shows which word is meant.
        let remedy = match (overridden, self.is_overridden(key.path)) {
            (false, false) => format!("remove it, or change {}", choice.named),
            (true, _) => format!("replace the whole table, {}", self.template(choice, chosen)),
            (false, true) => format!("replace the whole table, {}", self.template(choice, owners[0])),
        };
        let noun = choice.path.rsplit('.').next().unwrap_or_default();
        let by_default = if self.has(choice.path) { "" } else { ", the default" };
        let message = format!(
            "belongs to {noun} \"{}\", but the {noun} is \"{chosen}\"{by_default}: {remedy}",
            owners.join("\" or \"")
        );
        let place = self.place(if overridden { choice.path } else { key.path });
        self.push(place, key.path, message);
    }

    fn template(&self, choice: &DecidingWord, word: &str) -> String {
        let (table, noun) = choice.path.split_once('.').unwrap_or_default();
        let mut text = format!("{table}={{{noun}=\"{word}\"");
        let keys = schema::in_order(self.words.short).iter();
        for key in keys.filter(|key| key.split().0 == table) {
            let required = key.presence == Presence::Required && key.path != choice.path;
            if required || belongs(key, word) {
                let value = match key.kind {
                    KeyKind::Series(_) => "[...]",
                    _ => "...",
                };
                text += &format!(", {}={value}", key.split().1);
            }
        }
        text + "}"
    }
}

/// A word that decides which other keys a table has.
struct DecidingWord {
    path: &'static str,
    words: fn(bool) -> Vec<&'static str>,
    has_default: bool,
    named: &'static str,
}

const PROFILE: DecidingWord = DecidingWord {
    path: "actuation.profile",
    words: |_| Signal::NAMES.to_vec(),
    has_default: false,
    named: "the profile",
};

const SOLVER_METHOD: DecidingWord = DecidingWord {
    path: schema::METHOD,
    words: |_| Method::all().map(Method::name).collect(),
    has_default: true,
    named: schema::METHOD,
};

const LAW: DecidingWord = DecidingWord {
    path: schema::FRICTION_LAW,
    words: schema::laws,
    has_default: true,
    named: schema::FRICTION_LAW,
};

impl DecidingWord {
    fn of(key: &Key) -> Option<&'static DecidingWord> {
        match key.presence {
            Presence::Profile(_) => Some(&PROFILE),
            Presence::Law { .. } => Some(&LAW),
            Presence::Method(_) => Some(&SOLVER_METHOD),
            _ => None,
        }
    }
}

fn belongs(key: &Key, word: &str) -> bool {
    match key.presence {
        Presence::Profile(own) | Presence::Method(own) => own == word,
        Presence::Law { .. } => schema::law_has(word, key.split().1),
        _ => false,
    }
}

pub(super) fn content(key: &Key, path: &str, node: &PlacedValue, motion: Motion) -> Result<Content, Vec<Violation>> {
    let whole = |message: String| vec![Violation::new(path, &[], message)];
    let dimension = key.dimension().map(|dimension| motion.dimension(dimension));
    match (key.kind, &node.value, dimension) {
        (KeyKind::Signal(dimension), ..) => signal(path, node, dimension, motion).map(Content::Signal),
        (KeyKind::Series(_) | KeyKind::List(..), CaseValue::Array(elements), Some(dimension)) => {
            numbers(path, elements, dimension, key.domain()).map(Content::List)
        }
        (KeyKind::List(..), value, Some(dimension)) if value.is_single() => {
            let number = number(value, dimension, key.domain());
            number.map(|number| Content::List(vec![number])).map_err(whole)
        }
        (KeyKind::Series(_), other, _) => Err(whole(format!(
            "expected an array of numbers, but got {}",
            other.describe()
        ))),
        (KeyKind::List(..), other, Some(dimension)) => {
            let expected = quantity::expectation(dimension);
            Err(whole(format!(
                "expected a list of numbers, each {expected}, but got {}",
                other.describe()
            )))
        }
        _ => single(key, &node.value, motion).map(Content::One).map_err(whole),
    }
}

pub(super) fn missing(key: &Key, motion: Motion) -> String {
    let choices = key.choices();
    let series = matches!(key.kind, KeyKind::Series(_));
    let value = match key.dimension().map(|dimension| motion.dimension(dimension)) {
        Some(Dimension::Number) if series => "[...], plain numbers".to_owned(),
        Some(dimension) if series => format!("[...], numbers in {}", dimension.unit()),
        Some(dimension) => dimension.number(),
        None => format!("\"{}\"", choices.join("\" or \"")),
    };
    format!("missing: {}; write {} = {value}", key.description, key.split().1)
}

/// Message about an unknown key in the table at `parent`, which is `pattern` in the schema.
fn unknown_key(name: &str, parent: &str, pattern: &str, known: &[&'static str]) -> String {
    let start = join(pattern, "");
    let here = known.iter().filter_map(|key| key.strip_prefix(start.as_str()));
    let mut here: Vec<&str> = here.map(|rest| rest.split(['.', '[']).next().unwrap_or(rest)).collect();
    here.dedup();
    if let Some(close) = suggest(name, here.iter().copied()) {
        return format!("unknown key; did you mean {}?", join(parent, close));
    }
    // The inertia of a body that moves along a line is its mass.
    if name == "mass" && here.contains(&"inertia") {
        return format!("unknown key; did you mean {}?", join(parent, "inertia"));
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
