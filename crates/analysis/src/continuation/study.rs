//! Study file of a continuation: case, varied parameter, and kind of the branches.

use super::special::Special;
use crate::cycle::{CycleSearch, From, LONGEST};
use crate::study::{StudyHead, StudyKey, StudyReader, StudySource, hash_of, keys};
use crate::sweep::{ParameterAxis, read_axis};
use stickslip_case::built_in;
use stickslip_case::builtin::BuiltIn;
use stickslip_case::document::PlacedValue;
use stickslip_case::{CaseError, Override, WrittenCase};

/// Built-in studies: the files of `data/studies`.
pub const CONTINUATIONS: &[BuiltIn] = built_in!["studies": "belt-branches", "sliding-bifurcations"];

const DEFAULT_POINTS: u64 = 400;
const MOST_POINTS: u64 = 100_000;

/// Default longest step, as a fraction of range and motion.
const DEFAULT_STEP: f64 = 0.03;

/// Tables of a case that do not enter the equations.
const NO_EQUATION: [&str; 4] = ["initial.", "output.", "perturbation.", "solver."];

const STUDY_KEYS: &[StudyKey] = keys! {
    "axis": "tables", "" =>
        "the parameter that varies, by key, from and to, and a second one for curves of special points";
    "branch": "table", "its defaults" => "what is followed, and how far";
};
const BRANCH_KEYS: &[StudyKey] = keys! {
    "of": "text or list", "cycle" => "what is followed: \"steady\" sliding, a \"cycle\", or both";
    "from": "\"end\" or \"initial\"", "end" => "where the search for a cycle starts, as in stickslip cycle";
    "period": "number, s", "the best fit" => "length near which the cycle is looked for";
    "periods": "whole number", "the best fit" => "length of the cycle in drive periods or turns";
    "direction": "\"both\", \"up\" or \"down\"", "both" => "directions of the parameter";
    "points": "whole number", "400" => "most points of a branch in one direction";
    "step": "number", "0.03" => "longest step, as a fraction of range and motion";
    "follow": "list", "[\"hopf\", \"flip\"]" => "special points whose branches are followed, too";
    "curves": "list", "[]" => "special points that are followed in two parameters";
};

/// Tables of the study and their keys.
pub(crate) const KEY_TABLES: &[(&str, &[StudyKey])] = &[("", STUDY_KEYS), ("branch", BRANCH_KEYS)];

/// Continuation study, checked as far as possible without runs.
#[derive(Debug, Clone)]
pub struct ContinuationStudy {
    /// Title, base case, settings.
    pub head: StudyHead,
    /// Parameter that varies along branches, and a second one for curves of special points.
    pub axes: Vec<ParameterAxis>,
    /// Whether branches start at steady sliding.
    pub steady: bool,
    /// Whether branches start at a cycle.
    pub cycle: bool,
    /// Search for that cycle.
    pub search: CycleSearch,
    /// Whether branches follow the rising parameter, and the falling one.
    pub directions: (bool, bool),
    /// Largest number of points of a branch in one direction.
    pub points: usize,
    /// Longest step, as a fraction of range and motion.
    pub step: f64,
    /// Special points whose emerging branches are followed.
    pub follow: Vec<Special>,
    /// Special points that are followed in two parameters.
    pub curves: Vec<Special>,
}

impl ContinuationStudy {
    /// Reads a study, or reports all its problems. `overrides` apply to the base case after the study's own settings.
    pub fn parse(source: StudySource, overrides: &[Override]) -> Result<ContinuationStudy, CaseError> {
        let (mut reader, root) = StudyReader::open(&source.text, source.label(), STUDY_KEYS)?;
        let (head, keys) = StudyHead::read(&mut reader, &root, source, Vec::new(), overrides);
        let missing = "missing: the parameter that varies; write [[axis]] with key, from and to";
        let mut axes: Vec<ParameterAxis> = Vec::new();
        for (path, node) in reader.tables(&root, "axis", Some(missing)) {
            let Some(axis) = read_axis(&mut reader, &keys, node, &path, true) else {
                continue;
            };
            if axis.range.is_none() {
                let message = "a branch is followed over a range: write from = ... and to = ...";
                reader.report(node, &path, message);
            }
            axes.push(axis);
        }
        if axes.len() > 2 {
            let message = "a continuation has one parameter that varies, and a second one for curves of special points";
            reader.report(&root, "axis", message);
        }
        let mut study = ContinuationStudy {
            head,
            axes,
            steady: false,
            cycle: true,
            search: CycleSearch::default(),
            directions: (true, true),
            points: DEFAULT_POINTS as usize,
            step: DEFAULT_STEP,
            follow: vec![Special::Hopf, Special::Flip],
            curves: Vec::new(),
        };
        study.read_branch(&mut reader, &root);
        if !reader.is_clean() {
            return Err(reader.into_error());
        }
        let start = study.head.case_with([])?;
        // A single number may stand for a list of one.
        for key in study.axes.iter_mut().flat_map(|axis| &mut axis.keys) {
            let first = format!("{key}.0");
            if start.number(key).is_err() && start.number(&first).is_ok() {
                *key = first;
            }
        }
        for (index, axis) in study.axes.iter().enumerate() {
            let key = &axis.keys[0];
            let fails = |message: &str| Err(CaseError::one(study.head.source.label(), key, message));
            if NO_EQUATION.iter().any(|table| key.starts_with(table)) {
                return fails(
                    "a periodic motion does not depend on it: name a parameter of the system or of its drive",
                );
            }
            if study.axes[..index].iter().any(|other| other.keys.contains(key)) {
                return fails("is the number of the first [[axis]], too: name another one");
            }
            let Ok(own) = start.number(key) else {
                return fails(&format!(
                    "the case has no number there from which a branch could start: write one in the case or in [set], or name a number \
                     inside, such as {key}.0 of a list or {key}.value of a signal"
                ));
            };
            let (low, high) = study.range(index);
            if !(low..=high).contains(&own) {
                return fails(&format!(
                    "the branch starts where the case is, at {own:?}, which is outside the range {low:?} to {high:?}: widen it, or \
                     set {key} in [set]"
                ));
            }
        }
        Ok(study)
    }

    fn read_branch(&mut self, reader: &mut StudyReader, root: &PlacedValue) {
        let Some(node) = root.at("branch") else { return };
        if reader.table(node, "branch", BRANCH_KEYS).is_none() {
            return;
        }
        if let Some(of) = node.at("of")
            && let Some(words) = reader.keys(of, "branch.of")
        {
            self.steady = words.iter().any(|word| word == "steady");
            self.cycle = words.iter().any(|word| word == "cycle");
            if let Some(other) = words.iter().find(|word| !matches!(word.as_str(), "steady" | "cycle")) {
                let message = format!("{other} is nothing that is followed; there are \"steady\" and \"cycle\"");
                reader.report(of, "branch.of", message);
            }
        }
        let expected = "\"end\", the end of the run, or \"initial\", the state of [initial]";
        if let Some(from) = reader.choice(node, ("branch", "from"), &["end", "initial"], expected) {
            self.search.from = [From::End, From::Initial][from];
        }
        let words = ["both", "up", "down"];
        if let Some(way) = reader.choice(node, ("branch", "direction"), &words, "\"both\", \"up\" or \"down\"") {
            self.directions = [(true, true), (true, false), (false, true)][way];
        }
        if let Some(period) = node.at("period") {
            let expected = "a period in s, greater than 0";
            self.search.period = reader.number(period, "branch.period", expected, |period| period > 0.0);
        }
        if let Some(periods) = node.at("periods") {
            let found = reader.whole_number(periods, "branch.periods", 1..=LONGEST as u64);
            self.search.periods = found.map(|periods| periods as u32);
        }
        if let Some(count) = reader.whole_or(node, "branch", "points", 2..=MOST_POINTS, DEFAULT_POINTS) {
            self.points = count as usize;
        }
        let expected = "a share of the range from 1e-5 to 0.5";
        let fits = |step: f64| (1e-5..=0.5).contains(&step);
        if let Some(step) = reader.number_or(node, ("branch", "step"), DEFAULT_STEP, expected, fits) {
            self.step = step;
        }
        let mut specials = |name: &str, fit: &[Special]| -> Option<Vec<Special>> {
            let given = node.at(name)?;
            let path = format!("branch.{name}");
            reader.list(given, &path, |reader, element, path| {
                let word = reader.text(element, path)?;
                let found = Special::from_name(&word).filter(|special| fit.contains(special));
                let words = fit.iter().map(|special| special.name()).collect::<Vec<_>>().join(", ");
                found.or_else(|| reader.refuse(element, path, format!("expected one of {words}")))
            })
        };
        if let Some(follow) = specials("follow", &[Special::Hopf, Special::Flip]) {
            self.follow = follow;
        }
        let curves: Vec<Special> = Special::ALL
            .into_iter()
            .filter(|one| *one != Special::BranchPoint)
            .collect();
        if let Some(curves) = specials("curves", &curves) {
            self.curves = curves;
            if self.axes.len() < 2
                && let Some(node) = node.at("curves")
            {
                let message = "a curve of special points is one in two parameters: write a second [[axis]]";
                reader.report(node, "branch.curves", message);
            }
        }
    }

    /// Start case with its parameters as written, if valid.
    pub fn written(&self) -> Result<WrittenCase, CaseError> {
        WrittenCase::read(&self.head.base, &self.head.settings)
    }

    /// Least and largest value of an axis, SI.
    pub fn range(&self, axis: usize) -> (f64, f64) {
        let range = self.axes[axis].range;
        range.map_or((f64::NAN, f64::NAN), |range| {
            (range.from.min(range.to), range.from.max(range.to))
        })
    }

    /// Hash of everything that determines the study's results, including the program version: 64 hexadecimal digits.
    pub fn digest(&self) -> String {
        let settings: Vec<_> = self.head.decisive_settings().collect();
        hash_of(format!(
            "{}{}{settings:?} {:?}{} {} {:?} {:?} {} {} {:?} {:?}",
            env!("CARGO_PKG_VERSION"),
            self.head.base.text,
            self.axes,
            self.steady,
            self.cycle,
            self.search,
            self.directions,
            self.points,
            self.step,
            self.follow,
            self.curves
        ))
    }
}
