//! The case file as a tree of values, and its problems. Each value knows its place: a line of the file, or an override.

use stickslip_system::quote::{quoted, shown};
use toml_edit::{Document, Item, Table, TableLike, Value as TomlValue};

use super::schema;
use std::fmt;

/// Where a value was written.
#[derive(Debug, Clone, PartialEq)]
pub enum TextPlace {
    /// 1-based line of the file.
    Line(usize),
    /// The key of an override.
    Override(String),
}

impl TextPlace {
    /// Sort key: first the lines of the file, then the overrides.
    pub fn rank(&self) -> usize {
        match self {
            TextPlace::Line(line) => *line,
            TextPlace::Override(_) => usize::MAX,
        }
    }

    /// The place in words: `paper.toml:12` or `--set torsion.damping`.
    pub fn show(&self, label: &str) -> String {
        match self {
            TextPlace::Line(line) => format!("{label}:{line}"),
            TextPlace::Override(key) => format!("--set {key}"),
        }
    }
}

/// A value with the place where it stands.
#[derive(Debug, Clone)]
pub struct PlacedValue {
    /// The value.
    pub value: CaseValue,
    /// Line of the file, or the override that set the value.
    pub place: TextPlace,
}

/// A value of TOML.
#[derive(Debug, Clone)]
pub enum CaseValue {
    /// Keys with their values, in the order of the text.
    Table(Vec<(String, PlacedValue)>),
    /// A list.
    Array(Vec<PlacedValue>),
    /// A string.
    Text(String),
    /// A number without point and exponent.
    Integer(i64),
    /// A number with a point or an exponent.
    Float(f64),
    /// `true` or `false`.
    Flag(bool),
    /// A date or a time of day, which no key takes.
    Date,
}

impl CaseValue {
    /// The kind of value with its article, for messages.
    pub fn describe(&self) -> String {
        match self {
            CaseValue::Table(_) => "a table".to_owned(),
            CaseValue::Array(_) => "an array".to_owned(),
            CaseValue::Text(text) => format!("the text \"{text}\"", text = shown(text)),
            CaseValue::Integer(number) => format!("the number {number}"),
            CaseValue::Float(number) => format!("the number {number:?}"),
            CaseValue::Flag(flag) => flag.to_string(),
            CaseValue::Date => "a date".to_owned(),
        }
    }

    /// Whether it is a number, or a text that may be one with a unit.
    pub(super) fn is_single(&self) -> bool {
        matches!(self, CaseValue::Integer(_) | CaseValue::Float(_) | CaseValue::Text(_))
    }

    /// The value as TOML on one line. A date, which no key takes, becomes an empty text.
    pub(super) fn toml(&self) -> String {
        let text = |text: &str| TomlValue::from(text).to_string();
        match self {
            CaseValue::Table(entries) => {
                let entries = entries.iter().map(|(key, node)| {
                    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
                    let bare = !key.is_empty() && key.chars().all(plain);
                    let key = if bare { key.clone() } else { text(key) };
                    format!("{key} = {}", node.value.toml())
                });
                format!("{{ {} }}", entries.collect::<Vec<_>>().join(", "))
            }
            CaseValue::Array(nodes) => {
                let nodes = nodes.iter().map(|node| node.value.toml());
                format!("[{}]", nodes.collect::<Vec<_>>().join(", "))
            }
            CaseValue::Text(words) => text(words),
            CaseValue::Integer(number) => number.to_string(),
            CaseValue::Float(number) => format!("{number:?}"),
            CaseValue::Flag(flag) => flag.to_string(),
            CaseValue::Date => text(""),
        }
    }
}

impl PlacedValue {
    /// The node at a path of keys and indices.
    pub fn at(&self, path: &str) -> Option<&PlacedValue> {
        path.split('.').try_fold(self, |node, segment| node.child(segment))
    }

    /// The node at `path`, or the closest one above it.
    pub fn closest(&self, path: &str) -> &PlacedValue {
        let mut segments = path.split('.');
        let mut node = self;
        while let Some(child) = segments.next().and_then(|segment| node.child(segment)) {
            node = child;
        }
        node
    }

    fn child(&self, segment: &str) -> Option<&PlacedValue> {
        match &self.value {
            CaseValue::Table(entries) => entries.iter().find(|(key, _)| key == segment).map(|(_, node)| node),
            CaseValue::Array(elements) => elements.get(segment.parse::<usize>().ok()?),
            _ => None,
        }
    }
}

/// Reads TOML text. `label` names the text in errors.
pub fn read(text: &str, label: &str) -> Result<PlacedValue, CaseError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let ends: Vec<usize> = text.match_indices('\n').map(|(at, _)| at).collect();
    let line = |offset: usize| 1 + ends.partition_point(|&end| end < offset);
    let document = Document::parse(text).map_err(|error| {
        let at = error.span().map_or(1, |span| line(span.start));
        let mut message = error.message().lines().collect::<Vec<_>>().join(", ");
        // The parser quotes the offending text, but not a duplicate key.
        if message == "duplicate key" {
            let key = error.span().and_then(|span| text.get(span)).unwrap_or_default();
            message = format!("{message} {}", shown(key));
        }
        CaseError::one(format!("{label}:{at}"), "", format!("not valid TOML: {message}"))
    })?;
    let place = |at: usize| TextPlace::Line(line(at));
    Ok(PlacedValue {
        value: from_table(document.as_table(), 0, &place),
        place: TextPlace::Line(1),
    })
}

type PlaceAt<'a> = &'a dyn Fn(usize) -> TextPlace;

/// `at` is the offset of the enclosing item, for values without a span.
fn from_table(table: &dyn TableLike, at: usize, place: PlaceAt) -> CaseValue {
    let entries = table.iter().map(|(name, item)| {
        let key = table.key(name).and_then(|key| key.span()).map(|span| span.start);
        let at = key.or(item.span().map(|span| span.start)).unwrap_or(at);
        (name.to_owned(), from_item(item, at, place))
    });
    CaseValue::Table(entries.collect())
}

fn from_item(item: &Item, at: usize, place: PlaceAt) -> PlacedValue {
    let node = |value: CaseValue, at: usize| PlacedValue {
        value,
        place: place(at),
    };
    match item {
        Item::Value(value) => from_value(value, at, place),
        Item::Table(table) => node(from_table(table, at, place), at),
        Item::ArrayOfTables(tables) => {
            let element = |table: &Table| {
                let at = table.span().map_or(at, |span| span.start);
                node(from_table(table, at, place), at)
            };
            node(CaseValue::Array(tables.iter().map(element).collect()), at)
        }
        Item::None => node(CaseValue::Table(Vec::new()), at),
    }
}

fn from_value(value: &TomlValue, at: usize, place: PlaceAt) -> PlacedValue {
    let own = match value {
        TomlValue::String(text) => CaseValue::Text(text.value().clone()),
        TomlValue::Integer(number) => CaseValue::Integer(*number.value()),
        TomlValue::Float(number) => CaseValue::Float(*number.value()),
        TomlValue::Boolean(flag) => CaseValue::Flag(*flag.value()),
        TomlValue::Datetime(_) => CaseValue::Date,
        TomlValue::Array(array) => {
            let element = |value: &TomlValue| from_value(value, value.span().map_or(at, |span| span.start), place);
            CaseValue::Array(array.iter().map(element).collect())
        }
        TomlValue::InlineTable(table) => from_table(table, at, place),
    };
    PlacedValue {
        value: own,
        place: place(at),
    }
}

/// A value set from outside the file, at the dotted path of its key.
#[derive(Clone)]
pub struct Override {
    path: String,
    value: CaseValue,
    origin: Option<TextPlace>,
}

impl fmt::Debug for Override {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Override")
            .field("path", &self.path)
            .field("value", &self.value)
            .finish()
    }
}

impl Override {
    /// Reads `KEY=VALUE`. The key is a dotted path; an element of an array is `perturbation.0.time` or
    /// `perturbation[0].time`. The value is TOML (`perturbation=[]`, `actuation={profile="ramp", ...}`) or, if it is
    /// not valid TOML, text: `200 lbf in s/rad`, `cvode-bdf`.
    ///
    /// # Errors
    /// There is no `=`, or no key. [`super::Case::read`] checks whether key and value fit.
    pub fn parse(text: &str) -> Result<Override, CaseError> {
        let wrong = |message: String| Err(CaseError::one(format!("--set {text}"), "", message));
        let Some((key, value)) = text.split_once('=') else {
            return wrong("expected KEY=VALUE, such as torsion.damping=22.6".to_owned());
        };
        let path = key.trim().replace('[', ".").replace(']', "");
        if path.split('.').any(|segment| segment.trim().is_empty()) {
            let key = quoted(key.trim());
            return wrong(format!(
                "{key} is not a key: expected a dotted path, such as torsion.damping"
            ));
        }
        Ok(Override::value(&path, override_value(value.trim(), &path)))
    }

    /// The text `KEY=VALUE` that `--set` takes, with the value in TOML.
    pub fn argument(&self) -> String {
        format!("{}={}", self.path, self.value.toml())
    }

    /// The dotted path of the key.
    pub fn key(&self) -> &str {
        &self.path
    }

    pub(super) fn set_value(&self) -> &CaseValue {
        &self.value
    }

    pub(super) fn value(path: &str, value: CaseValue) -> Override {
        Override {
            path: path.to_owned(),
            value,
            origin: None,
        }
    }

    /// Sets a number, in SI.
    pub fn number(path: &str, value: f64) -> Override {
        Override::value(path, CaseValue::Float(value))
    }

    /// Returns the override with `place` as its origin.
    pub fn at(self, place: TextPlace) -> Override {
        let origin = Some(place);
        Override { origin, ..self }
    }

    /// The place where it was written, if a study contains it.
    pub fn origin(&self) -> Option<&TextPlace> {
        self.origin.as_ref()
    }

    /// Sets the value of a node in a study.
    pub fn of_node(path: &str, node: &PlacedValue) -> Override {
        let origin = Some(node.place.clone());
        let mut node = node.clone();
        re_place(&mut node, &TextPlace::Override(path.to_owned()));
        Override {
            origin,
            ..Override::value(path, node.value)
        }
    }
}

fn override_value(text: &str, path: &str) -> CaseValue {
    if let Ok(value) = text.parse::<TomlValue>() {
        let place = |_| TextPlace::Override(path.to_owned());
        return from_value(&value, 0, &place).value;
    }
    // TOML rejects these numbers: .5, 5., 007.
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => CaseValue::Float(number),
        _ => CaseValue::Text(text.to_owned()),
    }
}

const DEEPEST: usize = 8;

pub(super) fn apply(root: &mut PlacedValue, change: &Override) -> Result<(), CaseProblem> {
    let place = TextPlace::Override(change.path.clone());
    let problem = |message: String| CaseProblem {
        place: place.show(""),
        key: change.path.clone(),
        message,
    };
    let empty = || PlacedValue {
        value: CaseValue::Table(Vec::new()),
        place: place.clone(),
    };
    // No key is deeper than a few tables. The limit bounds the recursion over the tree.
    if change.path.split('.').count() > DEEPEST {
        return Err(problem("unknown key".to_owned()));
    }
    let mut node = root;
    let mut walked: Vec<&str> = Vec::new();
    for segment in change.path.split('.') {
        let here = walked.join(".");
        let of_list = schema::is_list(&here);
        // A number may replace a list with one element.
        if of_list && node.value.is_single() {
            node.value = CaseValue::Array(vec![node.clone()]);
        }
        // Element 0 of a missing array creates the array. The length of a chain's list follows from the chain, so
        // that its elements stay in a table until the case is read.
        if segment == "0" && !of_list && matches!(&node.value, CaseValue::Table(entries) if entries.is_empty()) {
            node.value = CaseValue::Array(Vec::new());
        }
        node = match &mut node.value {
            CaseValue::Table(entries) => {
                let index = entries.iter().position(|(key, _)| key == segment).unwrap_or_else(|| {
                    entries.push((segment.to_owned(), empty()));
                    entries.len() - 1
                });
                &mut entries[index].1
            }
            CaseValue::Array(elements) => {
                let count = elements.len();
                let Ok(index) = segment.parse::<usize>() else {
                    let message = format!("{here} is an array: its elements are numbered, as in {here}.0");
                    return Err(problem(message));
                };
                if index > count || of_list && index == count {
                    let there = match of_list {
                        true => schema::elements(&here, count),
                        false => format!("the next new element is {here}.{count}"),
                    };
                    return Err(problem(format!("there is no {here}.{index}: {there}")));
                }
                if index == count {
                    elements.push(empty());
                }
                &mut elements[index]
            }
            other => {
                let message = format!("{here} is {}, which has nothing inside", other.describe());
                return Err(problem(message));
            }
        };
        walked.push(segment);
    }
    *node = PlacedValue {
        value: change.value.clone(),
        place: place.clone(),
    };
    re_place(node, &place);
    Ok(())
}

fn re_place(node: &mut PlacedValue, place: &TextPlace) {
    node.place = place.clone();
    match &mut node.value {
        CaseValue::Table(entries) => entries.iter_mut().for_each(|(_, child)| re_place(child, place)),
        CaseValue::Array(elements) => elements.iter_mut().for_each(|child| re_place(child, place)),
        _ => {}
    }
}

/// All problems found in a case file, in its overrides, or in a value set in a case.
///
/// It is displayed with one line for each problem: `paper.toml:12: torsion.damping: what is wrong; what to do`.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}", self.problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
pub struct CaseError {
    /// The problems, at least one, in the order of the file.
    pub problems: Vec<CaseProblem>,
}

/// A problem of a case.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CaseProblem {
    /// `paper.toml:12`, `--set torsion.damping`, or empty for a value set by the program.
    pub place: String,
    /// Dotted path of the key; empty if the problem has none.
    pub key: String,
    /// The defect and its remedy.
    pub message: String,
}

impl fmt::Display for CaseProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let key = shown(&self.key);
        let set = self.place.strip_prefix("--set ");
        let place = set.map_or_else(|| self.place.clone(), |set| format!("--set {}", shown(set)));
        match set {
            // An override names its own key already, or the table that contains the key.
            Some(set) if set == self.key || self.key.is_empty() => write!(f, "{place}: ")?,
            // The message may concern another key, whose value conflicts with the override.
            Some(set) if !self.key.starts_with(set) => {
                let verb = if self.message.starts_with("missing") { "is " } else { "" };
                write!(f, "{place}: then {key} {verb}")?;
            }
            _ => {
                for part in [&place, &key].into_iter().filter(|part| !part.is_empty()) {
                    write!(f, "{part}: ")?;
                }
            }
        }
        f.write_str(&self.message)
    }
}

impl CaseError {
    /// An error with a single problem: its place (file and line), key and message.
    pub fn one(place: impl Into<String>, key: impl Into<String>, message: impl Into<String>) -> CaseError {
        CaseError {
            problems: vec![CaseProblem {
                place: place.into(),
                key: key.into(),
                message: message.into(),
            }],
        }
    }
}
