//! The study file of a calibration: a base case, the free parameters, the measured numbers.

use super::target::{self, Target};
use crate::case::builtin::BuiltIn;
use crate::case::document::{self, Node, Value};
use crate::case::{Case, CaseError, CaseKeys, Override, Setting, Words};
use crate::sweep::{
    Axis, Reader, Study, StudySource, keys_of, read_axis, read_base, read_settings, relabelled, whole_number,
};
use sha2::{Digest, Sha256};
use std::path::PathBuf;

/// Every built-in calibration.
pub const CALIBRATIONS: &[BuiltIn] = &[
    BuiltIn {
        name: "paper-decay",
        text: include_str!("../../data/studies/paper-decay.toml"),
    },
    BuiltIn {
        name: "paper-si-decay",
        text: include_str!("../../data/studies/paper-si-decay.toml"),
    },
];

/// How thoroughly the parameters are looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Search {
    /// Points of the Sobol sample over the whole ranges.
    pub points: usize,
    /// Local searches, from the best points that are apart from each other.
    pub starts: usize,
    /// Of everything that is drawn.
    pub seed: u32,
}

/// A calibration, valid as far as that can be known before anything is run.
#[derive(Debug, Clone)]
pub struct CalibrationStudy {
    /// The base case with the settings, and the free parameters as axes.
    pub runs: Study,
    /// At least one.
    pub targets: Vec<Target>,
    /// How far to look.
    pub search: Search,
}

const STUDY_KEYS: &[&str] = &["title", "case", "set", "free", "target", "search"];
const FREE_KEYS: &[&str] = &["key", "from", "to", "spacing"];

/// The generator of Sobol points has no more.
const MOST_POINTS: u64 = 1 << 16;
const MOST_STARTS: u64 = 10_000;
/// A search without derivatives wants many more runs than this in more dimensions.
const MOST_FREE: usize = 12;
const DEFAULT_POINTS: u64 = 1024;
const DEFAULT_STARTS: u64 = 16;

/// So many points, evenly spread, are built before the first run: if none is valid, the study is at fault.
const PROBES: u32 = 16;

impl CalibrationStudy {
    /// A built-in calibration.
    ///
    /// # Errors
    /// If there is none of that name; the text lists those there are.
    pub fn built_in(name: &str) -> Result<StudySource, CaseError> {
        StudySource::among(CALIBRATIONS, name)
    }

    /// Reads a calibration. `overrides` are set in the base case after the study's own settings.
    ///
    /// # Errors
    /// All problems that were found, each with its place, its key and what to do.
    pub fn parse(source: StudySource, overrides: &[Override]) -> Result<CalibrationStudy, CaseError> {
        let label = source.label();
        let root = document::read(&source.text, &label)?;
        let mut reader = Reader::new(label.clone());
        reader.check_keys(&root, "", STUDY_KEYS);
        let title = root.at("title").and_then(|node| reader.text(node, "title"));
        let mut files: Vec<PathBuf> = source.path.iter().cloned().collect();
        let base = read_base(&mut reader, &root, &source, &mut files);
        // Thousands of runs: the fastest engine, unless the study says otherwise.
        let mut settings = vec![Override::setting("solver.method", &Setting::Text("series".to_owned()))];
        if let Some(set) = root.at("set") {
            read_settings(&mut reader, &keys_of(base.as_ref(), &[]), set, "", &mut settings);
        }
        settings.extend(overrides.iter().cloned());
        let known = keys_of(base.as_ref(), &settings);
        let free = read_free(&mut reader, &known, &root);
        let targets = read_targets(&mut reader, known.words, &root);
        let search = read_search(&mut reader, &root);
        let (Some(base), Some(search), true) = (base, search, reader.is_clean()) else {
            return Err(reader.into_error());
        };
        let title = title.unwrap_or_else(|| source.name.clone());
        let study = CalibrationStudy {
            runs: Study::of_ranges(title, source, (base, known.words), settings, free, files),
            targets,
            search,
        };
        study.check(&label)?;
        Ok(study)
    }

    /// The value of every free parameter at a share of its range, 0 to 1.
    pub fn parameters(&self, shares: &[f64]) -> Vec<f64> {
        self.coordinates(shares)
            .iter()
            .map(|value| value.as_number().unwrap_or(f64::NAN))
            .collect()
    }

    pub(super) fn coordinates(&self, shares: &[f64]) -> Vec<Setting> {
        let axes = self.runs.axes.iter();
        axes.zip(shares).map(|(axis, &share)| axis.at(share)).collect()
    }

    /// The case with these shares of the ranges, with the output of the base case.
    ///
    /// # Errors
    /// If they do not make a valid case.
    pub fn case_at(&self, shares: &[f64]) -> Result<Case, CaseError> {
        let mut overrides = self.runs.settings.clone();
        for (axis, value) in self.runs.axes.iter().zip(self.coordinates(shares)) {
            overrides.extend(axis.keys.iter().map(|key| Override::setting(key, &value)));
        }
        Case::read(&self.runs.base, &overrides)
    }

    /// What identifies the study, as 64 hexadecimal digits: everything that decides its numbers, and the version of the
    /// program.
    pub fn digest(&self) -> String {
        let mut hash = Sha256::new();
        hash.update(self.runs.digest());
        hash.update(format!("{:?} {:?}", self.targets, self.search));
        hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }

    fn check(&self, label: &str) -> Result<(), CaseError> {
        let mut first = None;
        for probe in 0..PROBES {
            let shares: Vec<f64> = (0..self.runs.axes.len())
                .map(|axis| f64::from(sobol_burley::sample(probe, axis as u32, self.search.seed)))
                .collect();
            match self.case_at(&shares) {
                Ok(_) => return Ok(()),
                Err(error) => first = first.or(Some(error)),
            }
        }
        first.map_or(Ok(()), |error| Err(relabelled(error, &self.runs.settings, label)))
    }
}

/// The tables of an array of tables; a report if there is none.
fn tables<'a>(reader: &mut Reader, root: &'a Node, name: &str, missing: &str) -> Vec<(String, &'a Node)> {
    match root.at(name).map(|node| (node, &node.value)) {
        Some((_, Value::Array(elements))) if !elements.is_empty() => elements
            .iter()
            .enumerate()
            .map(|(index, element)| (format!("{name}.{index}"), element))
            .collect(),
        Some((node, Value::Array(_))) => {
            reader.report(node, name, missing);
            Vec::new()
        }
        None => {
            reader.report(root, name, missing);
            Vec::new()
        }
        Some((node, other)) => {
            reader.report(
                node,
                name,
                format!("expected tables: write [[{name}]], not {}", other.describe()),
            );
            Vec::new()
        }
    }
}

fn read_free(reader: &mut Reader, known: &CaseKeys, root: &Node) -> Vec<Axis> {
    let missing = "missing: what is looked for; write [[free]] with a key and the range from, to";
    let mut free: Vec<Axis> = Vec::new();
    for (path, node) in tables(reader, root, "free", missing) {
        reader.check_keys(node, &path, FREE_KEYS);
        if let Some(absent) = ["from", "to"].into_iter().find(|name| node.at(name).is_none()) {
            reader.report(
                node,
                &format!("{path}.{absent}"),
                "missing: a free parameter is looked for between from and to",
            );
            continue;
        }
        // Keys of an axis that are none of a free parameter have just been reported.
        if ["values", "count"].iter().any(|name| node.at(name).is_some()) {
            continue;
        }
        let Some(axis) = read_axis(reader, known, node, &path, true) else {
            continue;
        };
        let mut before = free.iter().flat_map(|other| &other.keys);
        if let Some(key) = axis.keys.iter().find(|key| before.any(|other| other == *key)) {
            let message = format!("{key} is free twice; keep one");
            reader.report(node, &format!("{path}.key"), message);
        }
        free.push(axis);
    }
    if free.len() > MOST_FREE {
        let message = format!(
            "{} free parameters are more than the {MOST_FREE} that a search can tell apart; give some their values in [set]",
            free.len()
        );
        reader.report(root, "free", message);
    }
    free
}

fn read_targets(reader: &mut Reader, words: Words, root: &Node) -> Vec<Target> {
    let missing = "missing: what was measured; write [[target]] with a quantity and its value";
    let mut targets: Vec<Target> = Vec::new();
    for (path, node) in tables(reader, root, "target", missing) {
        let Some(target) = target::read(reader, words, node, &path) else {
            continue;
        };
        if targets.iter().any(|other| other.quantity == target.quantity) {
            let message = format!("{} is a target twice; keep one", target.name());
            reader.report(node, &format!("{path}.quantity"), message);
        }
        targets.push(target);
    }
    if reader.is_clean() && !targets.iter().any(|target| target.weight > 0.0) {
        reader.report(
            root,
            "target",
            "all targets have weight = 0, so there is nothing to meet; remove it from one",
        );
    }
    targets
}

fn read_search(reader: &mut Reader, root: &Node) -> Option<Search> {
    let mut number = |name: &str, least: u64, most: u64, default: u64| match root.at(&format!("search.{name}")) {
        Some(given) => whole_number(reader, given, &format!("search.{name}"), least, most),
        None => Some(default),
    };
    let points = number("points", 16, MOST_POINTS, DEFAULT_POINTS);
    let starts = number("starts", 1, MOST_STARTS, DEFAULT_STARTS);
    let seed = number("seed", 0, u64::from(u32::MAX), 0);
    if let Some(node) = root.at("search") {
        reader.check_keys(node, "search", &["points", "starts", "seed"]);
        if !matches!(node.value, Value::Table(_)) {
            reader.expected::<()>(node, "search", "a table");
        }
    }
    Some(Search {
        points: points? as usize,
        starts: starts? as usize,
        seed: seed? as u32,
    })
}
