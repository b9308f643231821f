//! Axes of a study: keys that change together, and their values.

use super::distributed::{self, AxisDistribution};
use crate::study::{StudyHead, StudyKey, StudyReader, keys};
use std::path::Path;
use stickslip_case::document::{CaseValue, PlacedValue};
use stickslip_case::{Case, CaseKeys, Override, Setting, Slot};
use stickslip_files::{FileColumn, SweepAxis};

/// Spacing of a range's values, and scale of a boundary search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spacing {
    /// Equal differences.
    Linear,
    /// Equal ratios; both ends have the same sign.
    Log,
}

/// Range of values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisRange {
    /// First value, in the key's SI unit.
    pub from: f64,
    /// Last value, in the same unit.
    pub to: f64,
    /// Spacing of the values.
    pub spacing: Spacing,
}

impl AxisRange {
    /// Value at a fraction `share` of the range: 0 at `from`, 1 at `to`, exact at both.
    pub fn at(&self, share: f64) -> f64 {
        let AxisRange { from, to, spacing } = *self;
        if share <= 0.0 {
            from
        } else if share >= 1.0 {
            to
        } else {
            match spacing {
                Spacing::Linear => from + (to - from) * share,
                Spacing::Log => from * (share * (to / from).ln()).exp(),
            }
        }
    }

    /// `count` values from end to end; for 1, only the first.
    fn values(&self, count: usize) -> Vec<f64> {
        let last = (count.max(2) - 1) as f64;
        (0..count).map(|k| self.at(k as f64 / last)).collect()
    }
}

/// Axis of a study.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ParameterAxis {
    /// Dotted paths of the keys that take the axis's value. The first one gives name, unit and description.
    pub keys: Vec<String>,
    /// Name of the axis's variable in the result: the first key with `_` for dots.
    pub name: String,
    /// SI unit, `1` for a plain number; `None` for words and switches.
    pub unit: Option<&'static str>,
    /// Description of the first key.
    pub description: &'static str,
    /// Range; `None` for a list of values.
    pub range: Option<AxisRange>,
    /// Distribution of a sampled axis; `None` for a range, whose values are equally probable.
    pub distribution: Option<AxisDistribution>,
    /// Values of a grid, or choices of a sample; empty for a sampled range.
    pub levels: Vec<Setting>,
}

impl ParameterAxis {
    /// Value at a fraction `share` of the axis, in [0, 1): from the distribution, the range or the list.
    pub(crate) fn at(&self, share: f64) -> Setting {
        if let Some(distribution) = &self.distribution {
            return Setting::Number(distribution.at(share));
        }
        match self.range {
            Some(range) => Setting::Number(range.at(share)),
            None => {
                let last = self.levels.len() - 1;
                self.levels[((share * self.levels.len() as f64) as usize).min(last)].clone()
            }
        }
    }

    pub(super) fn of_keys(keys: Vec<String>, key: &Slot) -> ParameterAxis {
        ParameterAxis {
            name: keys[0].replace('.', "_"),
            keys,
            unit: key.unit(),
            description: key.description,
            ..ParameterAxis::default()
        }
    }

    pub(crate) fn in_a_file(&self, words: &[String], values: Vec<f64>) -> SweepAxis {
        let (keys, unit) = (self.keys.join(" "), self.unit.unwrap_or("1"));
        SweepAxis::new(&self.name, keys, unit, self.description, words, values)
    }

    pub(crate) fn column(&self, values: impl IntoIterator<Item = f64>) -> FileColumn {
        FileColumn::numbers(&self.name, self.unit.unwrap_or("1"), self.description, values)
    }

    pub(crate) fn overrides(&self, value: &Setting) -> Vec<Override> {
        self.keys.iter().map(|key| Override::setting(key, value)).collect()
    }

    /// Whether the values are numbers, so that the cases differ only in numbers.
    pub fn is_number(&self) -> bool {
        self.levels.iter().all(|level| level.as_number().is_some())
    }
}

/// Case at the first or the last values of all axes; `None` if neither is valid, or if words may change the system.
pub(crate) fn case_along(axes: &[ParameterAxis], head: &StudyHead) -> Option<Case> {
    let at = |share: f64| {
        head.case_with(axes.iter().flat_map(|axis| axis.overrides(&axis.at(share))))
            .ok()
    };
    let is_one_system = axes.iter().all(ParameterAxis::is_number);
    [0.0, 1.0].into_iter().filter(|_| is_one_system).find_map(at)
}

/// Largest number of values on an axis; more are a mistake.
const MOST_LEVELS: u64 = 4_000_000;

/// Keys of an axis of a sweep or a continuation.
pub(crate) const AXIS_KEYS: &[StudyKey] = keys! {
    "key": "text or list", "" => "key of the case that varies, or several that vary together";
    "values": "list", "none: a range" => "values, each a number in SI or a text with a unit; not in a continuation";
    "from": "number or text", "none: values" => "first value of a range";
    "to": "number or text", "none: values" => "last value of a range";
    "count": "whole number", "none" => "number of values in the range; not in a sample or a continuation";
    "spacing": "\"linear\" or \"log\"", "linear" => "spacing of the values in the range";
};

/// Reads one `[[axis]]` over `known` keys. A `sampled` range has no count.
pub(crate) fn read(
    reader: &mut StudyReader,
    known: &CaseKeys,
    node: &PlacedValue,
    path: &str,
    sampled: bool,
) -> Option<ParameterAxis> {
    read_with(reader, known, node, path, (sampled, None))
}

/// Reads one `[[axis]]` of a sample, which may have a distribution. Its tables are in `folder`.
pub(super) fn read_sampled(
    reader: &mut StudyReader,
    known: &CaseKeys,
    node: &PlacedValue,
    path: &str,
    folder: &Path,
) -> Option<ParameterAxis> {
    read_with(reader, known, node, path, (true, Some(folder)))
}

fn read_with(
    reader: &mut StudyReader,
    known: &CaseKeys,
    node: &PlacedValue,
    path: &str,
    (sampled, folder): (bool, Option<&Path>),
) -> Option<ParameterAxis> {
    if let (Some(given), None) = (node.at("distribution"), folder) {
        let message = "only an axis of a study with [sample] has a distribution; add [sample] with method and count, or leave it out";
        return reader.refuse(given, &format!("{path}.distribution"), message);
    }
    match folder {
        Some(_) => reader.table(node, path, &[AXIS_KEYS, distributed::KEYS].concat())?,
        None => reader.table(node, path, AXIS_KEYS)?,
    };
    let at = |name: &str| format!("{path}.{name}");
    let missing = "missing: write key = \"friction.decay\", or any other key of a case";
    let key_node = reader.needed(node, path, "key", missing)?;
    let paths = reader.keys(key_node, &at("key"))?;
    let mut keys = Vec::with_capacity(paths.len());
    for name in &paths {
        match (known.slot(name), known.misplaced(name)) {
            (Some(key), None) => keys.push(key),
            (Some(_), Some(why)) => reader.report(key_node, &at("key"), why),
            (None, _) => reader.report(key_node, &at("key"), known.unknown(name)),
        }
    }
    let (Some(first), true) = (keys.first(), keys.len() == paths.len()) else {
        return None;
    };
    if keys.iter().any(|key| key.dimension() != first.dimension()) {
        let message = format!(
            "\"{}\" differ in what they measure: keys that move together take one value",
            paths.join("\" and \"")
        );
        return reader.refuse(key_node, &at("key"), message);
    }
    let mut axis = ParameterAxis::of_keys(paths, first);
    if let Some(folder) = folder {
        axis.distribution = AxisDistribution::read(reader, node, &keys, path, folder)?;
        if axis.distribution.is_some() {
            return Some(axis);
        }
    }
    let of_range = ["from", "to", "count", "spacing"];
    let of_range = of_range.iter().find_map(|name| Some((*name, node.at(name)?)));
    match (node.at("values"), of_range) {
        (Some(_), Some((name, given))) => {
            return reader.refuse(given, &at(name), "an axis has either values, or from, to and count");
        }
        (None, None) => {
            let message = "an axis without values: write values = [...], or from = ..., to = ..., count = ...";
            return reader.refuse(node, path, message);
        }
        (Some(values), None) => axis.levels = read_values(reader, values, &keys, &at("values"))?,
        (None, Some(_)) => {
            let (range, count) = read_range(reader, node, &keys, path, sampled)?;
            axis.range = Some(range);
            axis.levels = range.values(count).into_iter().map(Setting::Number).collect();
        }
    }
    Some(axis)
}

fn read_values(reader: &mut StudyReader, values: &PlacedValue, keys: &[Slot], path: &str) -> Option<Vec<Setting>> {
    let CaseValue::Array(elements) = &values.value else {
        return reader.expected(values, path, "a list, as in values = [1, 2, 3]");
    };
    if elements.is_empty() {
        return reader.refuse(values, path, "an axis without values; give at least one");
    }
    let mut levels: Vec<Setting> = Vec::with_capacity(elements.len());
    reader.list(values, path, |reader, element, path| {
        let level = reader.found(element, path, one_for_all(keys, &element.value))?;
        if levels.contains(&level) {
            let message = format!("{} stands twice on this axis; remove one", level.word());
            return reader.refuse(element, path, message);
        }
        levels.push(level);
        Some(())
    })?;
    Some(levels)
}

pub(super) fn one_for_all(keys: &[Slot], value: &CaseValue) -> Result<Setting, String> {
    let mut setting = None;
    for key in keys {
        setting = Some(key.read(value)?);
    }
    setting.ok_or_else(|| "an axis without a key".to_owned())
}

fn read_range(
    reader: &mut StudyReader,
    node: &PlacedValue,
    keys: &[Slot],
    path: &str,
    sampled: bool,
) -> Option<(AxisRange, usize)> {
    let at = |name: &str| format!("{path}.{name}");
    let mut end = |name: &str| {
        let given = reader.needed(node, path, name, "missing: a range has from and to")?;
        match reader.found(given, &at(name), one_for_all(keys, &given.value))? {
            Setting::Number(number) => Some(number),
            _ => {
                let message = "this key takes words or whole numbers: list them as values = [...]";
                reader.refuse(given, &at(name), message)
            }
        }
    };
    let (from, to) = (end("from"), end("to"));
    let words = ["linear", "log"];
    let spacing = reader.choice(node, (path, "spacing"), &words, "\"linear\" or \"log\"");
    let spacing = spacing.map(|word| [Spacing::Linear, Spacing::Log][word]);
    let count = match (node.at("count"), sampled) {
        (None, true) => Some(0),
        (None, false) => {
            let message = "missing: how many values there are from end to end";
            reader.refuse(node, &at("count"), message)
        }
        (Some(given), true) => {
            let message = "this range is not divided into points; remove the count";
            reader.refuse(given, &at("count"), message)
        }
        (Some(given), false) => reader.whole_number(given, &at("count"), 1..=MOST_LEVELS),
    };
    let (from, to, spacing, count) = (from?, to?, spacing?, count?);
    if from == to && (sampled || count > 1) {
        let remedy = match sampled {
            true => "let them differ, or hold the number by [set] instead",
            false => "give a list of one value instead",
        };
        return reader.refuse(node, &at("to"), format!("from and to are both {from:?}: {remedy}"));
    }
    if spacing == Spacing::Log && from * to <= 0.0 {
        let message = format!("a log axis needs both ends on one side of 0, but they are {from:?} and {to:?}");
        return reader.refuse(node, path, message);
    }
    Some((AxisRange { from, to, spacing }, count as usize))
}
