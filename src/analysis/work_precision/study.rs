//! The study file: TOML, with the same care for places and remedies as a case.

use crate::case::builtin::{self, BuiltIn};
use crate::case::document::{self, Node, Value};
use crate::case::{Case, CaseError, CaseSource, ExactCase, Override, Problem, number_of, suggest, toml_text};
use crate::quote::shown;
use crate::simulation::Method;
use crate::simulation::is_short;
use serde::ser::SerializeStruct;
use serde::{Serialize, Serializer};
use std::path::{Path, PathBuf};

/// Every built-in study; the first is run if none is named.
pub const STUDIES: &[BuiltIn] = &[BuiltIn {
    name: "work-precision",
    text: include_str!("../../../data/studies/work-precision.toml"),
}];

/// Relative tolerance of the reference runs, if the study says nothing.
pub(super) const TIGHTEST: f64 = 1e-13;

/// The methods of the reference, and of its check, where the oracle takes too long.
pub(super) const FALLBACK: (Method, Method) = (Method::Series, Method::Auto);

/// Runs of a study: each is a case of its own, kept in memory, and takes milliseconds at the least.
const MOST_RUNS: usize = 10_000;

/// Where the reference is from.
#[derive(Debug, Clone, PartialEq)]
pub enum ReferenceChoice {
    /// A file of true events.
    Truth(PathBuf),
    /// The exact solution; where that takes too long, a run by `series` with a check by `auto`.
    Oracle(Box<ExactCase>),
    /// A run by `method`; how far another by `check` is from it is the uncertainty. Both at `rtol`.
    Runs {
        /// The reference.
        method: Method,
        /// The independent one.
        check: Method,
        /// Relative tolerance of both.
        rtol: f64,
    },
}

/// What one run of the study is steered by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Knob {
    /// `solver.rtol`.
    Tolerance(f64),
    /// `solver.fixed_step`, s.
    FixedStep(f64),
}

impl Knob {
    /// The tolerance, or the step (s).
    pub fn rtol_and_step(self) -> (Option<f64>, Option<f64>) {
        match self {
            Knob::Tolerance(rtol) => (Some(rtol), None),
            Knob::FixedStep(step) => (None, Some(step)),
        }
    }
}

impl Serialize for Knob {
    /// As `rtol` and `fixed_step`, of which one is null.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let (rtol, fixed_step) = self.rtol_and_step();
        let mut both = serializer.serialize_struct("Knob", 2)?;
        both.serialize_field("rtol", &rtol)?;
        both.serialize_field("fixed_step", &fixed_step)?;
        both.end()
    }
}

/// A valid study: every run of it is a valid case.
#[derive(Debug, Clone, PartialEq)]
pub struct Study {
    /// For people.
    pub title: String,
    /// After which results are named.
    pub name: String,
    /// TOML, as given.
    pub text: String,
    /// Of the case that all runs share.
    pub case_label: String,
    /// The case of every run, in the order of the study; only method and tolerance or step differ.
    pub runs: Vec<(Method, Knob, Case)>,
    /// Against which they are held.
    pub reference: ReferenceChoice,
    /// The cases of the reference and of its check, if they are computed.
    pub reference_cases: Vec<Case>,
    /// Each run is repeated so often, and its least time counts.
    pub repeat: usize,
    /// Files that it read, which must not be overwritten.
    pub files: Vec<PathBuf>,
}

const KEYS: [&str; 6] = ["title", "case", "set", "repeat", "series", "reference"];
const SERIES_KEYS: [&str; 3] = ["methods", "tolerances", "steps"];
const REFERENCE_KEYS: [&str; 4] = ["truth", "method", "check", "rtol"];

impl Study {
    /// The study of a name: a file, or a built-in one.
    ///
    /// # Errors
    /// If there is none, or with what is wrong with it.
    pub fn find(name: &str) -> Result<Study, CaseError> {
        let path = Path::new(name);
        if path.exists() || name.contains(std::path::MAIN_SEPARATOR) || path.extension().is_some() {
            let text = toml_text(path, "study")?;
            let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let folder = path.parent().unwrap_or(Path::new(""));
            let mut study = Study::parse(&text, name, &stem, folder)?;
            study.files.push(path.to_owned());
            return Ok(study);
        }
        let found = builtin::find("study", STUDIES, name)?;
        Study::parse(found.text, &format!("built-in study {name}"), name, Path::new(""))
    }

    /// From TOML; `label` stands for the text in errors, file names count from `folder`.
    ///
    /// # Errors
    /// The first thing that is wrong, with its place, its key and what to do.
    pub fn parse(text: &str, label: &str, name: &str, folder: &Path) -> Result<Study, CaseError> {
        let root = document::read(text, label)?;
        let reader = Reader { label, folder };
        reader.keys(&root, "", &KEYS)?;
        let title = match root.at("title") {
            None => name.to_owned(),
            Some(node) => reader.text(node, "title")?.to_owned(),
        };
        let (source, mut files) = reader.case(&root)?;
        let shared = reader.overrides(&root)?;
        // What is wrong with the case itself is said at its own keys, not at the first run's.
        let key = if shared.is_empty() { "case" } else { "set" };
        let plain = Case::read(&source, &shared).map_err(|error| reader.of_case(&root, key, &error))?;
        let series = reader.list(&root, "series")?;
        let mut pairs: Vec<(Method, Knob, String)> = Vec::new();
        for (index, node) in series.iter().enumerate() {
            let key = format!("series.{index}");
            reader.keys(node, "series.", &SERIES_KEYS)?;
            let methods = reader.methods(&root, &format!("{key}.methods"))?;
            let tolerances = reader.numbers(&root, &format!("{key}.tolerances"), "solver.rtol")?;
            let steps = reader.numbers(&root, &format!("{key}.steps"), "solver.fixed_step")?;
            if methods.is_empty() || tolerances.is_empty() == steps.is_empty() {
                let message = "needs methods, and either tolerances or steps, such as methods = [\"auto\"], tolerances = [1e-6, \
                               1e-8]; no list may be empty";
                return Err(reader.problem(&root, &key, message.to_owned()));
            }
            let knobs = tolerances.into_iter().map(Knob::Tolerance);
            let knobs: Vec<Knob> = knobs.chain(steps.into_iter().map(Knob::FixedStep)).collect();
            if methods.len().saturating_mul(knobs.len()) > MOST_RUNS - pairs.len() {
                let message = format!("makes more than {MOST_RUNS} runs; see docs/limits.md");
                return Err(reader.problem(&root, &key, message));
            }
            for method in methods {
                pairs.extend(knobs.iter().map(|&knob| (method, knob, key.clone())));
            }
        }
        if pairs.is_empty() {
            let message =
                "missing or empty: a study needs at least one [[series]] with methods, and tolerances or steps";
            return Err(reader.problem(&root, "series", message.to_owned()));
        }
        let case = |key: &str, method: Method, knob: Knob| -> Result<Case, CaseError> {
            let mut overrides = shared.clone();
            overrides.push(Override::parse(&format!("solver.method={}", method.name()))?);
            overrides.push(match knob {
                Knob::Tolerance(rtol) => Override::number("solver.rtol", rtol),
                Knob::FixedStep(step) => Override::number("solver.fixed_step", step),
            });
            let mut case = Case::read(&source, &overrides).map_err(|error| reader.of_case(&root, key, &error))?;
            // What is measured is the integration, not the samples.
            case.without_trajectory();
            Ok(case)
        };
        let runs = pairs
            .into_iter()
            .map(|(method, knob, key)| Ok((method, knob, case(&key, method, knob)?)))
            .collect::<Result<Vec<_>, CaseError>>()?;
        let reference = match root.at("reference") {
            None => {
                let exact = Case::exact(&source, &shared).map_err(|error| reader.of_case(&root, key, &error))?;
                ReferenceChoice::Oracle(Box::new(exact))
            }
            Some(node) => reader.reference(&root, node)?,
        };
        if matches!(reference, ReferenceChoice::Truth(_)) && !is_short(&plain.system) {
            let message =
                "a file of true events is of a brake; leave [reference] out, and the oracle solves the case of trains";
            return Err(reader.problem(&root, "reference.truth", message.to_owned()));
        }
        let reference_cases = match &reference {
            ReferenceChoice::Truth(path) => {
                files.push(path.clone());
                Vec::new()
            }
            ReferenceChoice::Oracle(..) => [FALLBACK.0, FALLBACK.1]
                .into_iter()
                .map(|method| case(key, method, Knob::Tolerance(TIGHTEST)))
                .collect::<Result<_, _>>()?,
            ReferenceChoice::Runs { method, check, rtol } => [method, check]
                .into_iter()
                .map(|&method| case("reference", method, Knob::Tolerance(*rtol)))
                .collect::<Result<_, _>>()?,
        };
        let repeat = match root.at("repeat").map(|node| &node.value) {
            None => 1,
            Some(Value::Integer(count @ 1..=1000)) => *count as usize,
            Some(other) => {
                let message = format!("expected a whole number from 1 to 1000, but got {}", other.describe());
                return Err(reader.problem(&root, "repeat", message));
            }
        };
        Ok(Study {
            title,
            name: name.to_owned(),
            text: text.to_owned(),
            case_label: source.label(),
            runs,
            reference,
            reference_cases,
            repeat,
            files,
        })
    }
}

struct Reader<'a> {
    label: &'a str,
    folder: &'a Path,
}

impl Reader<'_> {
    /// A problem at a key, or at what would contain it.
    fn problem(&self, root: &Node, key: &str, message: String) -> CaseError {
        let place = if root.at(key.split('.').next().unwrap_or(key)).is_some() {
            root.closest(key).place.show(self.label)
        } else {
            self.label.to_owned()
        };
        CaseError::one(place, key, message)
    }

    /// A problem at a node.
    fn at(&self, node: &Node, key: impl Into<String>, message: impl Into<String>) -> CaseError {
        CaseError::one(node.place.show(self.label), key, message)
    }

    /// What is wrong with a case that the study makes, at the study's key.
    fn of_case(&self, root: &Node, key: &str, error: &CaseError) -> CaseError {
        let texts = error.problems.iter().map(|problem| match problem {
            Problem { key, message, .. } if !key.is_empty() => format!("{key}: {message}"),
            other => other.to_string(),
        });
        let texts: Vec<String> = texts.collect();
        self.problem(root, key, format!("gives a case that cannot be: {}", texts.join("; ")))
    }

    fn keys(&self, node: &Node, prefix: &str, known: &[&str]) -> Result<(), CaseError> {
        let Value::Table(entries) = &node.value else {
            let message = format!("expected a table, but got {}", node.value.describe());
            return Err(self.at(node, prefix.trim_end_matches('.'), message));
        };
        for (name, child) in entries {
            if !known.contains(&name.as_str()) {
                let hint = suggest(name, known.iter().copied()).map_or_else(
                    || format!("there are {}", known.join(", ")),
                    |close| format!("did you mean {prefix}{close}?"),
                );
                return Err(self.at(child, format!("{prefix}{name}"), format!("unknown key; {hint}")));
            }
        }
        Ok(())
    }

    fn text<'n>(&self, node: &'n Node, key: &str) -> Result<&'n str, CaseError> {
        match &node.value {
            Value::Text(text) => Ok(text),
            other => Err(self.at(node, key, format!("expected a text, but got {}", other.describe()))),
        }
    }

    /// The elements of a list; none if the key is absent.
    fn list<'n>(&self, root: &'n Node, key: &str) -> Result<&'n [Node], CaseError> {
        match root.at(key).map(|node| &node.value) {
            None => Ok(&[]),
            Some(Value::Array(elements)) => Ok(elements),
            Some(other) => {
                let message = format!("expected a list in brackets, but got {}", other.describe());
                Err(self.problem(root, key, message))
            }
        }
    }

    fn case(&self, root: &Node) -> Result<(CaseSource, Vec<PathBuf>), CaseError> {
        let Some(node) = root.at("case") else {
            let names: Vec<&str> = builtin::CASES.iter().map(|case| case.name).collect();
            let message = format!(
                "missing: write case = one of \"{}\", or the path of a case file",
                names.join("\", \"")
            );
            return Err(CaseError::one(self.label, "case", message));
        };
        let name = self.text(node, "case")?;
        let path = self.folder.join(name);
        let found = if path.is_file() {
            CaseSource::file(&path).map(|source| (source, vec![path]))
        } else {
            CaseSource::built_in(name).map(|source| (source, Vec::new()))
        };
        found.map_err(|error| {
            let message = error.problems.first().map(|p| p.message.clone()).unwrap_or_default();
            self.at(node, "case", message)
        })
    }

    fn overrides(&self, root: &Node) -> Result<Vec<Override>, CaseError> {
        let elements = self.list(root, "set")?;
        let mut overrides = Vec::with_capacity(elements.len());
        for node in elements {
            let text = self.text(node, "set")?;
            let change = Override::parse(text).map_err(|error| self.of_case(root, "set", &error))?;
            if let key @ ("solver.method" | "solver.rtol" | "solver.fixed_step") = change.key() {
                let message = format!("{key} is what the study varies: use a [[series]]");
                return Err(self.at(node, "set", message));
            }
            overrides.push(change);
        }
        Ok(overrides)
    }

    fn method(&self, node: &Node, key: &str) -> Result<Method, CaseError> {
        let name = self.text(node, key)?;
        Method::from_name(name).ok_or_else(|| {
            let names: Vec<&str> = Method::all().map(Method::name).collect();
            let hint = suggest(name, names.iter().copied()).map(|close| format!("; did you mean \"{close}\"?"));
            let message = format!(
                "there is no method \"{name}\"{}; there are {}",
                hint.unwrap_or_default(),
                names.join(", "),
                name = shown(name)
            );
            self.at(node, key, message)
        })
    }

    fn methods(&self, root: &Node, key: &str) -> Result<Vec<Method>, CaseError> {
        self.list(root, key)?
            .iter()
            .map(|node| self.method(node, key))
            .collect()
    }

    /// Numbers as the case's key takes them, by whose rules they are read.
    fn numbers(&self, root: &Node, key: &str, case_key: &str) -> Result<Vec<f64>, CaseError> {
        let elements = self.list(root, key)?;
        elements
            .iter()
            .map(|node| number_of(node, case_key).map_err(|message| self.at(node, key, message)))
            .collect()
    }

    fn reference(&self, root: &Node, node: &Node) -> Result<ReferenceChoice, CaseError> {
        self.keys(node, "reference.", &REFERENCE_KEYS)?;
        if let Some(truth) = node.at("truth") {
            if let Some(other) = REFERENCE_KEYS[1..].iter().find(|key| node.at(key).is_some()) {
                let message =
                    format!("with truth, which is computed already, reference.{other} has no meaning: remove one");
                return Err(self.at(truth, "reference.truth", message));
            }
            let name = self.text(truth, "reference.truth")?;
            return Ok(ReferenceChoice::Truth(self.folder.join(name)));
        }
        let named = |key: &str, default: Method| match node.at(key) {
            None => Ok(default),
            Some(found) => self.method(found, &format!("reference.{key}")),
        };
        let method = named("method", Method::Auto)?;
        let check = named("check", Method::CvodeAdams)?;
        if method == check {
            let message = format!(
                "the reference and its check are both \"{}\": the uncertainty is the difference of two independent methods, \
                 so name another as reference.check",
                method.name()
            );
            return Err(self.problem(root, "reference", message));
        }
        let rtol = match node.at("rtol") {
            None => TIGHTEST,
            Some(found) => {
                number_of(found, "solver.rtol").map_err(|message| self.at(found, "reference.rtol", message))?
            }
        };
        Ok(ReferenceChoice::Runs { method, check, rtol })
    }
}
