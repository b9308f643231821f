//! The study file of a calibration: a base case, the free parameters, the measured numbers.

use super::target::{self, Target};
use crate::case::builtin::{BuiltIn, built_in};
use crate::case::document::Node;
use crate::case::{Case, CaseError, CaseKeys, Override, Setting};
use crate::study::{Head, PROBES, Reader, StudySource, check_points};
use crate::sweep::{Axis, Study, case_along, read_axis, sobol};
use sha2::{Digest, Sha256};

/// Every built-in calibration.
pub const CALIBRATIONS: &[BuiltIn] = built_in!["studies": "paper-decay", "paper-si-decay"];

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

impl CalibrationStudy {
    /// Reads a calibration. `overrides` are set in the base case after the study's own settings.
    ///
    /// # Errors
    /// All problems that were found, each with its place, its key and what to do.
    pub fn parse(source: StudySource, overrides: &[Override]) -> Result<CalibrationStudy, CaseError> {
        let (mut reader, root) = Reader::open(&source, STUDY_KEYS)?;
        // Thousands of runs: the fastest engine, unless the study says otherwise.
        let method = Override::setting("solver.method", &Setting::Text("series".to_owned()));
        let head = Head::read(&mut reader, &root, &source, vec![method], overrides);
        let free = read_free(&mut reader, &head.keys, &root);
        let targets = read_targets(&mut reader, &head, &free, &root);
        let search = read_search(&mut reader, &root).filter(|_| reader.is_clean());
        let Some((search, runs)) = search.and_then(|search| Some((search, Study::of_ranges(head, source, free)?)))
        else {
            return Err(reader.into_error());
        };
        let study = CalibrationStudy { runs, targets, search };
        study.check()?;
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
        self.runs.case_with_output(&self.coordinates(shares))
    }

    /// What identifies the study, as 64 hexadecimal digits: everything that decides its numbers, and the version of the
    /// program.
    pub fn digest(&self) -> String {
        let mut hash = Sha256::new();
        hash.update(self.runs.digest());
        hash.update(format!("{:?} {:?}", self.targets, self.search));
        hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }

    fn check(&self) -> Result<(), CaseError> {
        let shares = sobol(self.runs.axes.len(), PROBES, self.search.seed);
        let cases = shares.iter().map(|shares| self.case_at(shares));
        check_points(cases, &self.runs.settings, &self.runs.source.label())
    }
}

fn read_free(reader: &mut Reader, known: &CaseKeys, root: &Node) -> Vec<Axis> {
    let missing = "missing: what is looked for; write [[free]] with a key and the range from, to";
    let mut free: Vec<Axis> = Vec::new();
    for (path, node) in reader.tables(root, "free", Some(missing)) {
        reader.check_keys(node, &path, FREE_KEYS);
        if let Some(absent) = ["from", "to"].into_iter().find(|name| node.at(name).is_none()) {
            let message = "missing: a free parameter is looked for between from and to";
            reader.report(node, &format!("{path}.{absent}"), message);
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

fn read_targets(reader: &mut Reader, head: &Head, free: &[Axis], root: &Node) -> Vec<Target> {
    let case = case_along(free, head);
    let kind = (case.as_ref().map(|case| &case.system), head.keys.words.motion());
    let missing = "missing: what was measured; write [[target]] with a quantity and its value";
    let mut targets: Vec<Target> = Vec::new();
    for (path, node) in reader.tables(root, "target", Some(missing)) {
        let Some(target) = target::read(reader, kind, node, &path) else {
            continue;
        };
        if targets.iter().any(|other| other.quantity == target.quantity) {
            let message = format!("{} is a target twice; keep one", target.name());
            reader.report(node, &format!("{path}.quantity"), message);
        }
        targets.push(target);
    }
    if reader.is_clean() && !targets.iter().any(|target| target.weight > 0.0) {
        let message = "all targets have weight = 0, so there is nothing to meet; remove it from one";
        reader.report(root, "target", message);
    }
    targets
}

fn read_search(reader: &mut Reader, root: &Node) -> Option<Search> {
    if let Some(node) = root.at("search") {
        reader.table(node, "search", &["points", "starts", "seed"])?;
    }
    let points = reader.whole_or(root, "", "search.points", 16..=MOST_POINTS, DEFAULT_POINTS);
    let starts = reader.whole_or(root, "", "search.starts", 1..=MOST_STARTS, DEFAULT_STARTS);
    let seed = reader.whole_or(root, "", "search.seed", 0..=u64::from(u32::MAX), 0);
    Some(Search {
        points: points? as usize,
        starts: starts? as usize,
        seed: seed? as u32,
    })
}
