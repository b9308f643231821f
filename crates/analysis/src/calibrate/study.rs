//! Study file of a calibration: base case, free parameters, measured numbers.

use crate::study::{PROBES, StudyHead, StudyKey, StudyReader, StudySource, check_points, hash_of, keys, plain};
use crate::sweep::{ParameterAxis, QUANTITIES, Quantity, Study, Values, asked_for, case_along, read_axis, sobol};
use stickslip_case::built_in;
use stickslip_case::builtin::BuiltIn;
use stickslip_case::document::{CaseValue, PlacedValue};
use stickslip_case::quantity::{self, Dimension};
use stickslip_case::{Case, CaseError, CaseKeys, Motion, Override, Setting};
use stickslip_system::model::system::System;
use stickslip_system::named;

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

const STUDY_KEYS: &[StudyKey] = keys! {
    "free": "tables", "" => "parameters that are looked for: one table for each, at most twelve";
    "target": "tables", "" => "measured numbers: one table for each";
    "search": "table", "its defaults" => "extent of the search";
};
const FREE_KEYS: &[StudyKey] = keys! {
    "key": "text or list", "" => "key of the case that is looked for, or several with one value";
    "from": "number or text", "" => "one end of the range";
    "to": "number or text", "" => "the other end";
    "spacing": "\"linear\" or \"log\"", "linear" => "scale of the range";
};
const TARGET_KEYS: &[StudyKey] = keys! {
    "quantity": "text", "" => "name of the measured quantity";
    "value": "text or number", "" => "the number as printed, such as \"6.975 s\"";
    "half_width": "text or number", "half of the last digit of a text; 0.5 for a count" =>
        "half-width of the interval around the value";
    "weight": "number", "1" => "targets of the least weight are set aside first; 0 is only compared";
};
const SEARCH_KEYS: &[StudyKey] = keys! {
    "points": "whole number", "1024" => "points of the first sample, 16 to 65536";
    "starts": "whole number", "16" => "number of local searches";
    "seed": "whole number", "0" => "seed of the random numbers";
};

/// Tables of the study and their keys.
pub(crate) const KEY_TABLES: &[(&str, &[StudyKey])] = &[
    ("", STUDY_KEYS),
    ("free[]", FREE_KEYS),
    ("target[]", TARGET_KEYS),
    ("search", SEARCH_KEYS),
];

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
        let (mut reader, root) = StudyReader::open(&source.text, source.label(), STUDY_KEYS)?;
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
        let Some(target) = read_target(reader, kind, node, &path) else {
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
        reader.table(node, "search", SEARCH_KEYS)?;
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

/// Measured number.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// Index in the quantities of a run.
    pub quantity: usize,
    /// Unit (UDUNITS).
    pub unit: &'static str,
    /// Value in the quantity's unit.
    pub value: f64,
    /// Half-width of the interval around `value`; positive.
    pub half_width: f64,
    /// Weight: if not all targets can hold, the least weight is set aside first; 0 is only compared.
    pub weight: f64,
}

impl Target {
    /// Name of the quantity.
    pub fn name(&self) -> &'static str {
        QUANTITIES[self.quantity].name
    }

    /// Distance from the measured value in half-widths; the target holds from -1 to 1. NaN without the quantity.
    pub fn residual(&self, values: &Values) -> f64 {
        (values[self.quantity] - self.value) / self.half_width
    }
}

named! {
    /// Role of a target in the result.
    pub enum Role {
        /// Holds together with the others.
        Held: "held",
        /// Holds alone, but not together with the held targets.
        Contradicts: "contradicts",
        /// Holds nowhere in the ranges of the parameters.
        OutOfReach: "out-of-reach",
        /// Only compared, by request of the study.
        Compared: "compared",
    }
}

/// Target with the result of the calibrated run.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetResult {
    /// Role of the target.
    pub role: Role,
    /// Quantity in the calibrated run, in its unit; NaN if missing.
    pub here: f64,
    /// Residual in half-widths; NaN if the quantity is missing.
    pub residual: f64,
    /// Least magnitude of the residual in the ranges, regardless of other targets.
    pub nearest: f64,
    /// For a contradicting target: least possible largest residual together with the held ones. Else NaN.
    pub together: f64,
    /// For a contradicting target: indices of held ones that could be set aside instead.
    pub instead: Vec<usize>,
}

fn read_target(
    reader: &mut StudyReader,
    (system, motion): (Option<&System>, Motion),
    node: &PlacedValue,
    path: &str,
) -> Option<Target> {
    reader.table(node, path, TARGET_KEYS)?;
    let at = |name: &str| format!("{path}.{name}");
    let expected = "a number that is not negative";
    let weight = reader.number_or(node, (path, "weight"), 1.0, expected, |weight| weight >= 0.0);
    let missing = "missing: what was measured, as in quantity = \"onset_time\"";
    let quantity = match reader.needed(node, path, "quantity", missing) {
        Some(given) => {
            let name = reader.text(given, &at("quantity"))?;
            let found = asked_for(&name, system, " to measure", Quantity::is_measured);
            reader.found(given, &at("quantity"), found)
        }
        None => None,
    };
    let missing = "missing: the number as it was printed, as in value = \"6.975 s\"";
    let given = reader.needed(node, path, "value", missing)?;
    let quantity = quantity?;
    let unit = QUANTITIES[quantity].unit(motion);
    let dimension = Dimension::of_udunits(unit).unwrap_or(Dimension::Number);
    // Value, and half-width of its rounding if it is a text.
    let mut printed = |given: &PlacedValue, name: &str| {
        let number = match (&given.value, plain(&given.value)) {
            (CaseValue::Text(text), _) => quantity::printed(text, dimension).map(|(value, half)| (value, Some(half))),
            (_, Some(value)) => Ok((value, None)),
            (other, None) => Err(format!(
                "expected {}, but got {}",
                quantity::expectation(dimension),
                other.describe()
            )),
        };
        reader.found(given, &at(name), number)
    };
    let (value, rounding) = printed(given, "value")?;
    let half_width = match node.at("half_width") {
        Some(given) => {
            let (half, _) = printed(given, "half_width")?;
            if half <= 0.0 {
                let message = format!("must be greater than 0, but is {half:?}");
                return reader.refuse(given, &at("half_width"), message);
            }
            half
        }
        // A count is exact.
        None => match rounding.or(QUANTITIES[quantity].is_count().then_some(0.5)) {
            Some(half) => half,
            None => {
                let message = "the half-width is missing: write the value in quotes as it was printed, so that its \
                               last digit says it, or add half_width";
                return reader.refuse(given, &at("value"), message);
            }
        },
    };
    Some(Target {
        quantity,
        unit,
        value,
        half_width,
        weight: weight?,
    })
}
