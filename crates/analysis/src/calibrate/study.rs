//! Study file of a calibration: base case, free parameters, measured numbers.

use super::target::{self, Target};
use crate::study::{PROBES, StudyHead, StudyReader, StudySource, check_points, hash_of};
use crate::sweep::{ParameterAxis, Study, case_along, read_axis, sobol};
use stickslip_case::built_in;
use stickslip_case::builtin::BuiltIn;
use stickslip_case::document::PlacedValue;
use stickslip_case::{Case, CaseError, CaseKeys, Override, Setting};

/// Built-in calibrations.
pub const CALIBRATIONS: &[BuiltIn] = built_in!["studies": "paper-decay", "paper-si-decay"];

/// Extent of the search for parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CalibrationSearch {
    /// Points of the Sobol sample over the ranges.
    pub points: usize,
    /// Number of local searches, which start from the best separate points.
    pub starts: usize,
    /// Seed of all random numbers.
    pub seed: u32,
}

/// Calibration study, checked as far as possible without runs.
#[derive(Debug, Clone)]
pub struct CalibrationStudy {
    /// Base case with settings, and the free parameters as axes.
    pub runs: Study,
    /// Targets; at least one.
    pub targets: Vec<Target>,
    /// Extent of the search.
    pub search: CalibrationSearch,
}

const STUDY_KEYS: &[&str] = &["title", "case", "set", "free", "target", "search"];
const FREE_KEYS: &[&str] = &["key", "from", "to", "spacing"];

/// Limit of the Sobol generator.
const MOST_POINTS: u64 = 1 << 16;
const MOST_STARTS: u64 = 10_000;
/// A search without derivatives needs many more runs in more dimensions.
const MOST_FREE: usize = 12;
const DEFAULT_POINTS: u64 = 1024;
const DEFAULT_STARTS: u64 = 16;

impl CalibrationStudy {
    /// Reads a calibration, or reports all its problems. `overrides` apply to the base case after the study's
    /// settings.
    pub fn parse(source: StudySource, overrides: &[Override]) -> Result<CalibrationStudy, CaseError> {
        let (mut reader, root) = StudyReader::open(&source, STUDY_KEYS)?;
        // Thousands of runs use the fastest method, unless the study sets another one.
        let method = Override::setting("solver.method", &Setting::Text("series".to_owned()));
        let (head, keys) = StudyHead::read(&mut reader, &root, source, vec![method], overrides);
        let free = read_free(&mut reader, &keys, &root);
        let targets = read_targets(&mut reader, &head, &free, &root);
        let search = read_search(&mut reader, &root).filter(|_| reader.is_clean());
        let Some(search) = search else {
            return Err(reader.into_error());
        };
        let runs = Study::of_ranges(head, free);
        let study = CalibrationStudy { runs, targets, search };
        study.check()?;
        Ok(study)
    }

    /// Value of each free parameter at a fraction of its range, 0 to 1.
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

    /// Case at these fractions of the ranges, with the output of the base case.
    ///
    /// # Errors
    /// The values are invalid.
    pub fn case_at(&self, shares: &[f64]) -> Result<Case, CaseError> {
        self.runs.case_with_output(&self.coordinates(shares))
    }

    /// Hash of everything that determines the study's results, including the program version: 64 hexadecimal digits.
    pub fn digest(&self) -> String {
        hash_of(format!("{}{:?} {:?}", self.runs.digest(), self.targets, self.search))
    }

    fn check(&self) -> Result<(), CaseError> {
        let shares = sobol(self.runs.axes.len(), PROBES, self.search.seed);
        let cases = shares.iter().map(|shares| self.case_at(shares));
        check_points(cases, &self.runs.head.settings, &self.runs.head.source.label())
    }
}

fn read_free(reader: &mut StudyReader, known: &CaseKeys, root: &PlacedValue) -> Vec<ParameterAxis> {
    let missing = "missing: what is looked for; write [[free]] with a key and the range from, to";
    let mut free: Vec<ParameterAxis> = Vec::new();
    for (path, node) in reader.tables(root, "free", Some(missing)) {
        reader.check_keys(node, &path, FREE_KEYS);
        if let Some(absent) = ["from", "to"].into_iter().find(|name| node.at(name).is_none()) {
            let message = "missing: a free parameter is looked for between from and to";
            reader.report(node, &format!("{path}.{absent}"), message);
            continue;
        }
        // Other keys of an axis have already been reported.
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

fn read_targets(reader: &mut StudyReader, head: &StudyHead, free: &[ParameterAxis], root: &PlacedValue) -> Vec<Target> {
    let case = case_along(free, head);
    let kind = (case.as_ref().map(|case| &case.system), head.words.motion());
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

fn read_search(reader: &mut StudyReader, root: &PlacedValue) -> Option<CalibrationSearch> {
    if let Some(node) = root.at("search") {
        reader.table(node, "search", &["points", "starts", "seed"])?;
    }
    let points = reader.whole_or(root, "", "search.points", 16..=MOST_POINTS, DEFAULT_POINTS);
    let starts = reader.whole_or(root, "", "search.starts", 1..=MOST_STARTS, DEFAULT_STARTS);
    let seed = reader.whole_or(root, "", "search.seed", 0..=u64::from(u32::MAX), 0);
    Some(CalibrationSearch {
        points: points? as usize,
        starts: starts? as usize,
        seed: seed? as u32,
    })
}
