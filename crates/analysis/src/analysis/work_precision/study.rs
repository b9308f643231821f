//! Study file of a work-precision study in TOML. Problems are reported all at once, each with file, line and key.

use crate::study::{StudyHead, StudyKey, StudyReader, StudySource, keys, written};
use serde::ser::SerializeStruct;
use serde::{Serialize, Serializer};
use std::path::PathBuf;
use stickslip_case::built_in;
use stickslip_case::builtin::BuiltIn;
use stickslip_case::document::PlacedValue;
use stickslip_case::{Case, CaseError, CaseKeys, CaseProblem, ExactCase, Override, Setting, suggest};
use stickslip_engine::simulation::Method;
use stickslip_system::quote::shown;

/// Built-in studies; the first is the default.
pub const STUDIES: &[BuiltIn] = built_in!["studies": "work-precision"];

pub(super) const TIGHTEST: f64 = 1e-13;

/// Methods of the reference and its check if the oracle takes too long.
pub(super) const FALLBACK: [Method; 2] = [Method::Series, Method::Arkode];

/// Largest number of runs: each keeps its case in memory and takes at least milliseconds.
const MOST_RUNS: usize = 10_000;

/// Origin of the reference.
#[derive(Debug, Clone, PartialEq)]
pub enum ReferenceChoice {
    /// A file of true events.
    Truth(PathBuf),
    /// Exact solution; if that takes too long, a run by `series` with a check by `arkode`.
    Oracle(Box<ExactCase>),
    /// Run by `method`; its distance to a run by `check` is the uncertainty. Both at `rtol`.
    Runs {
        /// Method of the reference.
        method: Method,
        /// Independent method.
        check: Method,
        /// Relative tolerance of both.
        rtol: f64,
    },
}

/// Accuracy setting of one run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Knob {
    /// `solver.rtol`.
    Tolerance(f64),
    /// `solver.fixed_step`, s.
    FixedStep(f64),
}

impl Knob {
    /// Tolerance, or step (s).
    pub fn rtol_and_step(self) -> (Option<f64>, Option<f64>) {
        match self {
            Knob::Tolerance(rtol) => (Some(rtol), None),
            Knob::FixedStep(step) => (None, Some(step)),
        }
    }
}

impl Serialize for Knob {
    /// Fields `rtol` and `fixed_step`, one of them null.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let (rtol, fixed_step) = self.rtol_and_step();
        let mut both = serializer.serialize_struct("Knob", 2)?;
        both.serialize_field("rtol", &rtol)?;
        both.serialize_field("fixed_step", &fixed_step)?;
        both.end()
    }
}

/// Valid study with valid cases.
#[derive(Debug, Clone)]
pub struct PrecisionStudy {
    /// Title, common case, settings.
    pub head: StudyHead,
    /// Cases in the order of the study; only method and tolerance or step differ.
    pub runs: Vec<(Method, Knob, Case)>,
    /// Reference of the errors.
    pub reference: ReferenceChoice,
    /// Cases of a computed reference and its check.
    pub reference_cases: Vec<Case>,
    /// Repetitions of each run; the least time counts.
    pub repeat: usize,
}

const STUDY_KEYS: &[StudyKey] = keys! {
    "repeat": "whole number", "1" => "repetitions of each run; the least time counts";
    "series": "tables", "" => "methods with their tolerances or steps: one table for each";
    "reference": "table", "the exact solver" => "what the errors are measured against";
};
const SERIES_KEYS: &[StudyKey] = keys! {
    "methods": "list", "" => "integration methods";
    "tolerances": "list", "none: steps" => "relative tolerances";
    "steps": "list, s", "none: tolerances" => "fixed steps";
};
const REFERENCE_KEYS: &[StudyKey] = keys! {
    "truth": "text", "none: a run" => "JSON file of true events, beside the study";
    "method": "text", "series" => "method of the reference";
    "check": "text", "arkode" => "independent method; its distance is the uncertainty";
    "rtol": "number", "1e-13" => "relative tolerance of both";
};

/// Tables of the study and their keys.
pub(crate) const KEY_TABLES: &[(&str, &[StudyKey])] = &[
    ("", STUDY_KEYS),
    ("series[]", SERIES_KEYS),
    ("reference", REFERENCE_KEYS),
];

const VARIED: [&str; 4] = ["solver.method", TOLERANCE, STEP, "solver.step"];
const TOLERANCE: &str = "solver.rtol";
const STEP: &str = "solver.fixed_step";

impl PrecisionStudy {
    /// Reads a study, or reports all its problems with place, key and remedy.
    pub fn parse(source: StudySource) -> Result<PrecisionStudy, CaseError> {
        let (mut reader, root) = StudyReader::open(&source.text, source.label(), STUDY_KEYS)?;
        let (mut head, keys) = StudyHead::read(&mut reader, &root, source, Vec::new(), &[]);
        let is_valid = check_case(&mut reader, &root, &head);
        let mut pairs: Vec<(Method, Knob, String)> = Vec::new();
        let missing = "missing or empty: a study needs at least one [[series]] with methods, and tolerances or steps";
        for (path, node) in reader.tables(&root, "series", Some(missing)) {
            let Some((methods, knobs)) = read_series(&mut reader, &keys, node, &path) else {
                continue;
            };
            if methods.len().saturating_mul(knobs.len()) > MOST_RUNS - pairs.len() {
                reader.report(
                    node,
                    &path,
                    format!("makes more than {MOST_RUNS} runs; see docs/reference/limits.md"),
                );
                break;
            }
            for method in methods {
                pairs.extend(knobs.iter().map(|&knob| (method, knob, path.clone())));
            }
        }
        let reference = match root.at("reference") {
            Some(node) => read_reference(&mut reader, &keys, &head.source, node),
            // The oracle solves the case as it is written.
            None if !is_valid => None,
            None => match Case::exact(&head.base, &head.settings) {
                Ok(exact) => Some(ReferenceChoice::Oracle(Box::new(exact))),
                Err(error) => {
                    report_case(&mut reader, &root, "case", &error);
                    None
                }
            },
        };
        let repeat = reader.whole_or(&root, "", "repeat", 1..=1000, 1);
        let (Some(reference), Some(repeat), true) = (reference, repeat, reader.is_clean()) else {
            return Err(reader.into_error());
        };
        // Case of a run. An invalid case is reported at a key of the study.
        let mut run = |key: &str, method: Method, knob: Knob| -> Option<Case> {
            let accuracy = match knob {
                Knob::Tolerance(rtol) => Override::number(TOLERANCE, rtol),
                Knob::FixedStep(step) => Override::number(method.step_key(), step),
            };
            let method = Setting::Text(method.name().to_owned());
            let case = head.case_with([Override::setting("solver.method", &method), accuracy]);
            let mut case = case
                .map_err(|error| report_case(&mut reader, &root, key, &error))
                .ok()?;
            case.without_trajectory();
            Some(case)
        };
        let runs = pairs
            .into_iter()
            .map(|(method, knob, key)| Some((method, knob, run(&key, method, knob)?)));
        let runs: Option<Vec<_>> = runs.collect();
        let of_reference = match &reference {
            ReferenceChoice::Truth(_) => None,
            ReferenceChoice::Oracle(..) => Some((FALLBACK, "case", TIGHTEST)),
            ReferenceChoice::Runs { method, check, rtol } => Some(([*method, *check], "reference", *rtol)),
        };
        let reference_cases: Option<Vec<Case>> = of_reference.map_or(Some(Vec::new()), |(methods, key, rtol)| {
            let runs = methods
                .into_iter()
                .map(|method| run(key, method, Knob::Tolerance(rtol)));
            runs.collect()
        });
        let (Some(runs), Some(reference_cases)) = (runs, reference_cases) else {
            return Err(reader.into_error());
        };
        if let ReferenceChoice::Truth(path) = &reference {
            head.files.push(path.clone());
        }
        Ok(PrecisionStudy {
            head,
            runs,
            reference,
            reference_cases,
            repeat: repeat as usize,
        })
    }
}

fn report_case(reader: &mut StudyReader, root: &PlacedValue, key: &str, error: &CaseError) {
    let texts = error.problems.iter().map(|problem| match problem {
        CaseProblem { key, message, .. } if !key.is_empty() => format!("{key}: {message}"),
        other => other.to_string(),
    });
    let texts: Vec<String> = texts.collect();
    let message = format!("gives a case that cannot be: {}", texts.join("; "));
    reader.report(root.closest(key), key, message);
}

/// Checks the common case first, so that its problems are reported at its own keys.
fn check_case(reader: &mut StudyReader, root: &PlacedValue, head: &StudyHead) -> bool {
    for setting in &head.settings {
        if let (true, Some(place)) = (VARIED.contains(&setting.key()), setting.origin()) {
            let message = "is what the study varies: use a [[series]]";
            reader.report_at(place, &format!("set.{}", setting.key()), message);
        }
    }
    if !head.is_readable {
        return false;
    }
    let Err(mut error) = head.case_with([]) else {
        return true;
    };
    error.problems.retain(|problem| match written(&head.settings, problem) {
        Some((place, key)) => {
            reader.report_at(place, &key, format!("gives a case that cannot be: {}", problem.message));
            false
        }
        None => true,
    });
    if !error.problems.is_empty() {
        report_case(reader, root, "case", &error);
    }
    false
}

fn read_series(
    reader: &mut StudyReader,
    known: &CaseKeys,
    node: &PlacedValue,
    path: &str,
) -> Option<(Vec<Method>, Vec<Knob>)> {
    reader.table(node, path, SERIES_KEYS)?;
    let at = |name: &str| format!("{path}.{name}");
    let methods = node
        .at("methods")
        .map_or(Some(Vec::new()), |node| reader.list(node, &at("methods"), read_method))?;
    let mut knobs = Vec::new();
    for (name, key, knob) in [
        ("tolerances", TOLERANCE, Knob::Tolerance as fn(f64) -> Knob),
        ("steps", STEP, Knob::FixedStep),
    ] {
        if let Some(list) = node.at(name) {
            let numbers = reader.list(list, &at(name), |reader, node, path| {
                read_number(reader, known, node, path, key)
            })?;
            knobs.push(numbers.into_iter().map(knob).collect::<Vec<Knob>>());
        }
    }
    knobs.retain(|knobs| !knobs.is_empty());
    match (methods.is_empty(), knobs.pop(), knobs.pop()) {
        (false, Some(knobs), None) => Some((methods, knobs)),
        _ => {
            let message = "needs methods, and either tolerances or steps, such as methods = [\"cvode\"], tolerances = [1e-6, \
                           1e-8]; no list may be empty";
            reader.refuse(node, path, message)
        }
    }
}

fn read_number(reader: &mut StudyReader, known: &CaseKeys, node: &PlacedValue, path: &str, key: &str) -> Option<f64> {
    let read = known.slot(key).map(|slot| slot.read(&node.value))?;
    reader.found(node, path, read)?.as_number()
}

fn read_method(reader: &mut StudyReader, node: &PlacedValue, path: &str) -> Option<Method> {
    let name = reader.text(node, path)?;
    Method::from_name(&name).or_else(|| {
        let names: Vec<&str> = Method::all().map(Method::name).collect();
        let hint = suggest(&name, names.iter().copied()).map(|close| format!("; did you mean \"{close}\"?"));
        let message = format!(
            "there is no method \"{name}\"{}; there are {}",
            hint.unwrap_or_default(),
            names.join(", "),
            name = shown(&name)
        );
        reader.refuse(node, path, message)
    })
}

fn read_reference(
    reader: &mut StudyReader,
    known: &CaseKeys,
    source: &StudySource,
    node: &PlacedValue,
) -> Option<ReferenceChoice> {
    reader.table(node, "reference", REFERENCE_KEYS)?;
    if let Some(truth) = node.at("truth") {
        if let Some(other) = REFERENCE_KEYS[1..].iter().find(|key| node.at(key.name).is_some()) {
            let message = format!(
                "with truth, which is computed already, reference.{} has no meaning: remove one",
                other.name
            );
            return reader.refuse(truth, "reference.truth", message);
        }
        let name = reader.text(truth, "reference.truth")?;
        return Some(ReferenceChoice::Truth(source.folder().join(name)));
    }
    let mut named = |name: &str, default: Method| match node.at(name) {
        None => Some(default),
        Some(found) => read_method(reader, found, &format!("reference.{name}")),
    };
    let (method, check) = (named("method", Method::Series)?, named("check", Method::Arkode)?);
    if method == check {
        let message = format!(
            "the reference and its check are both \"{}\": the uncertainty is the difference of two independent methods, \
             so name another as reference.check",
            method.name()
        );
        return reader.refuse(node, "reference", message);
    }
    let rtol = match node.at("rtol") {
        None => TIGHTEST,
        Some(found) => read_number(reader, known, found, "reference.rtol", TOLERANCE)?,
    };
    Some(ReferenceChoice::Runs { method, check, rtol })
}
