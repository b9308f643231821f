//! The study file: a base case, axes over its keys, and what is wanted of the runs.

use super::axis::{self, Axis};
use super::criterion::{BoundarySpec, read_boundary};
use super::quantities::{Quantity, quantities, unknown_quantity};
use super::reading::{self, Reader, join, whole_number};
use super::sampling::{self, MOST_SOBOL_AXES, MOST_SOBOL_POINTS, SampleMethod};
use super::source::StudySource;
use crate::case::document::{self, Node, Value};
use crate::case::{Case, CaseError, CaseKeys, CaseSource, Origin, Override, Problem, Setting, Words};
use crate::quote::in_shell;
use crate::results::{is_hdf5, open_sound};
use crate::simulation::Method;
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// Which points a study has.
#[derive(Debug, Clone, PartialEq)]
pub enum Design {
    /// Every combination of the levels of the axes; the last axis runs fastest.
    Grid,
    /// The rows of a sample or of a table, one value for each axis.
    Rows(Vec<Vec<Setting>>),
    /// The points that tracing a boundary asks for, one after the other.
    Boundary(BoundarySpec),
}

/// The `solver.rtol` of points that are run by `auto` or `series`, where neither the case nor the study gives one: with
/// it all events of the runs of a critical curve are within 1e-8 s (of `series`, 1e-10 s) in half the time that the
/// default of a single run takes. The other methods need their usual tolerance for that.
pub const STUDY_RTOL: f64 = 1e-8;

/// What is kept of every run beside its summary.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Keep {
    /// The events of each run, in the study's file.
    pub events: bool,
    /// A whole result file of each run.
    pub trajectory: bool,
}

/// A study, valid as far as that can be known before its points are run.
#[derive(Debug, Clone)]
pub struct Study {
    /// Of the study.
    pub title: String,
    /// The text it was read from.
    pub source: StudySource,
    /// The base case, as text.
    pub base: CaseSource,
    /// How the places of its system are called.
    pub words: Words,
    /// What the study sets in it.
    pub settings: Vec<Override>,
    /// In the order of the text; the last one varies fastest.
    pub axes: Vec<Axis>,
    /// How the points lie in the axes.
    pub design: Design,
    /// What is stored of each run.
    pub keep: Keep,
    /// Names of the quantities that figures show of it, if nothing else is asked for.
    pub show: Vec<String>,
    /// Files that the study was read from: they must not be overwritten.
    pub files: Vec<PathBuf>,
    /// The base case with the settings, in SI: quicker to read again for every point. None where the axes take part in
    /// what it has already resolved.
    resolved: Option<CaseSource>,
    /// Whether the case or the study gives a tolerance; else it is [`STUDY_RTOL`].
    gives_tolerance: bool,
}

/// A point: its number in the study and its value on every axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// From 0.
    pub number: u64,
    /// One for each axis.
    pub coordinates: Vec<Setting>,
}

/// How long a run may take, which is no part of what it computes.
const WALL_TIME: &str = "solver.max_wall_time";
/// By which method a run is made.
const METHOD: &str = "solver.method";

/// More points than this are taken for a mistake: years of computing.
const MOST_POINTS: u64 = 1_000_000_000;

/// And so are more values on all axes together: of two axes, no grid has as many points.
const MOST_LEVELS: usize = 4_000_000;

const STUDY_KEYS: &[&str] = &[
    "title", "case", "set", "axis", "sample", "points", "keep", "show", "boundary",
];

/// So many points, evenly spread, are built before the first run: if none is valid, the study is at fault.
const PROBES: u64 = 16;

impl Study {
    /// Reads a study. `overrides` are set in the base case after the study's own.
    ///
    /// # Errors
    /// All problems that were found, each with its place, its key and what to do.
    pub fn parse(source: StudySource, overrides: &[Override]) -> Result<Study, CaseError> {
        let label = source.label();
        let root = document::read(&source.text, &label)?;
        let mut reader = Reader::new(label);
        reader.check_keys(&root, "", STUDY_KEYS);
        let title = root.at("title").and_then(|node| reader.text(node, "title"));
        let mut files: Vec<PathBuf> = source.path.iter().cloned().collect();
        let base = read_base(&mut reader, &root, &source, &mut files);
        let mut settings = Vec::new();
        if let Some(set) = root.at("set") {
            read_settings(&mut reader, &keys_of(base.as_ref(), &[]), set, "", &mut settings);
        }
        settings.extend(overrides.iter().cloned());
        let known = keys_of(base.as_ref(), &settings);
        let sampled = root.at("sample").is_some();
        let (mut axes, mut levels) = (Vec::new(), 0);
        match root.at("axis").map(|node| (node, &node.value)) {
            None => {}
            Some((_, Value::Array(elements))) => {
                for (index, element) in elements.iter().enumerate() {
                    let axis = axis::read(&mut reader, &known, element, &format!("axis.{index}"), sampled);
                    if let Some(axis) = axis {
                        levels += axis.levels.len();
                        if levels > MOST_LEVELS {
                            let message =
                                format!("the axes have more than {MOST_LEVELS} values in all; give them fewer");
                            reader.report(element, &format!("axis.{index}"), message);
                            break;
                        }
                        check_keys_once(&mut reader, element, &format!("axis.{index}"), &axes, &axis);
                        axes.push(axis);
                    }
                }
            }
            Some((node, other)) => {
                reader.report(
                    node,
                    "axis",
                    format!("expected tables: write [[axis]], not {}", other.describe()),
                );
            }
        }
        let design = read_design(&mut reader, &known, &root, &source, &mut axes, &mut files);
        let keep = match root.at("keep") {
            None => Keep::default(),
            Some(node) => {
                reader.check_keys(node, "keep", &["events", "trajectory"]);
                Keep {
                    events: reader.flag(node, "keep", "events", false),
                    trajectory: reader.flag(node, "keep", "trajectory", false),
                }
            }
        };
        let show = root
            .at("show")
            .map_or_else(Vec::new, |node| read_show(&mut reader, known.words, node));
        let (Some(base), Some(design), true) = (base, design, reader.is_clean()) else {
            return Err(reader.into_error());
        };
        let study = Study {
            resolved: resolve(known.words, &base, &settings, &axes),
            words: known.words,
            gives_tolerance: gives_tolerance(&base, &settings, &axes),
            title: title.unwrap_or_else(|| source.name.clone()),
            source,
            base,
            settings,
            axes,
            design,
            keep,
            show,
            files,
        };
        study.check()?;
        Ok(study)
    }

    /// A study of points that are asked for one after the other, anywhere in the ranges of the axes.
    pub(crate) fn of_ranges(
        title: String,
        source: StudySource,
        (base, words): (CaseSource, Words),
        settings: Vec<Override>,
        axes: Vec<Axis>,
        files: Vec<PathBuf>,
    ) -> Study {
        Study {
            resolved: resolve(words, &base, &settings, &axes),
            words,
            // A search wants runs that change smoothly with the parameters: at the case's own tolerance.
            gives_tolerance: true,
            title,
            source,
            base,
            settings,
            axes,
            design: Design::Rows(Vec::new()),
            keep: Keep::default(),
            show: Vec::new(),
            files,
        }
    }

    /// The tolerance that its points have by default, where neither it nor the case gives one.
    pub fn default_tolerance(&self) -> Option<f64> {
        (!self.gives_tolerance).then_some(STUDY_RTOL)
    }

    /// What is kept of each of its runs, in the order of the variables of its file.
    pub fn quantities(&self) -> &'static [Quantity] {
        quantities(self.words)
    }

    /// The place of a quantity among them.
    pub fn quantity(&self, name: &str) -> Option<usize> {
        self.quantities().iter().position(|quantity| quantity.name == name)
    }

    /// How many points it has; `None` if that shows only on the way.
    pub fn point_count(&self) -> Option<u64> {
        match &self.design {
            Design::Grid => self
                .axes
                .iter()
                .try_fold(1u64, |n, axis| n.checked_mul(axis.levels.len() as u64)),
            Design::Rows(rows) => Some(rows.len() as u64),
            Design::Boundary(_) => None,
        }
    }

    /// The point of a number below [`Self::point_count`]; `None` beyond, and in a study of a boundary.
    pub fn point(&self, number: u64) -> Option<Point> {
        if number >= self.point_count()? {
            return None;
        }
        let coordinates = match &self.design {
            Design::Grid => {
                let mut rest = number;
                let mut coordinates: Vec<Setting> = Vec::with_capacity(self.axes.len());
                for axis in self.axes.iter().rev() {
                    let count = axis.levels.len() as u64;
                    coordinates.push(axis.levels[(rest % count) as usize].clone());
                    rest /= count;
                }
                coordinates.reverse();
                coordinates
            }
            Design::Rows(rows) => rows[usize::try_from(number).ok()?].clone(),
            Design::Boundary(_) => return None,
        };
        Some(Point { number, coordinates })
    }

    /// The case at one value for each axis.
    ///
    /// # Errors
    /// If these values do not make a valid case.
    pub fn case_at(&self, coordinates: &[Setting]) -> Result<Case, CaseError> {
        let (base, mut overrides) = match &self.resolved {
            Some(resolved) => (resolved, Vec::with_capacity(self.axes.len())),
            None => (&self.base, self.settings.clone()),
        };
        for (axis, value) in self.axes.iter().zip(coordinates) {
            overrides.extend(axis.keys.iter().map(|key| Override::setting(key, value)));
        }
        let mut case = Case::read(base, &overrides)?;
        let solver = &mut case.solver;
        if !self.gives_tolerance && matches!(solver.method, Method::Auto | Method::Series) {
            solver.rtol = STUDY_RTOL;
        }
        if !self.keep.trajectory {
            // A sweep keeps no samples, so none are made.
            case.without_trajectory();
        }
        Ok(case)
    }

    /// The command that runs one of its points by itself, without the values on the axes: `--set KEY=VALUE` for each of their
    /// keys completes it. A base case in a file is named as the study names it, relative to its own folder.
    ///
    /// What only says how long a run may take is left out, and the tolerance, too, where the method is an axis.
    pub fn point_command(&self) -> String {
        let folder = self.source.folder();
        let base = match &self.base.origin {
            Origin::BuiltIn(name) => name.clone(),
            // No study has its base case from there.
            Origin::StandardInput | Origin::Text => "-".to_owned(),
            Origin::File(path) | Origin::Result(path) => {
                path.strip_prefix(&folder).unwrap_or(path).display().to_string()
            }
        };
        let mut arguments = vec![base];
        let settings = self.settings.iter().filter(|setting| setting.key() != WALL_TIME);
        arguments.extend(settings.flat_map(|setting| ["--set".to_owned(), setting.argument()]));
        let by_axis = self.axes.iter().any(|axis| axis.keys.iter().any(|key| key == METHOD));
        let method = Case::read(&self.base, &self.settings).map(|case| case.solver.method);
        let takes_it = !matches!(method, Ok(method) if !matches!(method, Method::Auto | Method::Series));
        if let (Some(tolerance), false, true) = (self.default_tolerance(), by_axis, takes_it) {
            arguments.extend(["--set".to_owned(), format!("solver.rtol={tolerance:e}")]);
        }
        let arguments: Vec<String> = arguments.iter().map(|argument| in_shell(argument)).collect();
        format!("stickslip run {}", arguments.join(" "))
    }

    /// The same study with further keys set in its base case.
    pub fn with(&self, overrides: &[Override]) -> Study {
        let mut study = self.clone();
        study.settings.extend(overrides.iter().cloned());
        study.resolved = resolve(study.words, &study.base, &study.settings, &study.axes);
        study.gives_tolerance = gives_tolerance(&study.base, &study.settings, &study.axes);
        study
    }

    /// What identifies the study, as 64 hexadecimal digits: everything that decides its numbers, and the version of the
    /// program; not its title, nor how its file is laid out.
    pub fn digest(&self) -> String {
        let mut hash = Sha256::new();
        let mut add = |part: &str| {
            hash.update((part.len() as u64).to_le_bytes());
            hash.update(part.as_bytes());
        };
        add("stickslip sweep 1");
        add(env!("CARGO_PKG_VERSION"));
        add(&self.base.text);
        // How long a run may take is no part of what it computes: a study is resumed with another budget.
        let settings = self.settings.iter().filter(|setting| setting.key() != WALL_TIME);
        add(&format!("{:?}", settings.collect::<Vec<_>>()));
        add(&format!("{STUDY_RTOL}"));
        for axis in &self.axes {
            add(&format!("{:?} {:?} {:?}", axis.keys, axis.range, axis.levels));
        }
        add(&format!("{:?}", self.design));
        add(&format!("{:?}", self.keep));
        hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// Looks for what is wrong with every point alike, so that it is said once and before anything is computed.
    fn check(&self) -> Result<(), CaseError> {
        let label = self.source.label();
        let mut first = None;
        let count = match &self.design {
            Design::Boundary(_) => {
                let corner = BoundarySpec::corner(&self.axes);
                return self
                    .case_at(&corner)
                    .map(drop)
                    .map_err(|error| relabelled(error, &self.settings, &label));
            }
            _ => self
                .point_count()
                .filter(|&count| count <= MOST_POINTS)
                .ok_or_else(|| {
                    let message = format!("more than {MOST_POINTS:e} points; give the axes fewer values");
                    CaseError::one(&label, "axis", message)
                })?,
        };
        let probes = count.min(PROBES);
        for k in 0..probes {
            let number = if probes == 1 { 0 } else { k * (count - 1) / (probes - 1) };
            let Some(point) = self.point(number) else { continue };
            match self.case_at(&point.coordinates) {
                Ok(_) => return Ok(()),
                Err(error) => first = first.or(Some(error)),
            }
        }
        first.map_or(Ok(()), |error| Err(relabelled(error, &self.settings, &label)))
    }
}

/// The keys of the base case; those of the short form where there is none.
pub(crate) fn keys_of(base: Option<&CaseSource>, settings: &[Override]) -> CaseKeys {
    base.map_or(CaseKeys::SHORT, |base| CaseKeys::of(base, settings))
}

fn resolve(words: Words, base: &CaseSource, settings: &[Override], axes: &[Axis]) -> Option<CaseSource> {
    let mut keys = axes.iter().flat_map(|axis| &axis.keys);
    if keys.any(|key| words.entangled().iter().any(|start| key.starts_with(start))) {
        return None;
    }
    let case = Case::read(base, settings).ok()?;
    Some(CaseSource {
        text: case.resolved(),
        origin: base.origin.clone(),
    })
}

fn gives_tolerance(base: &CaseSource, settings: &[Override], axes: &[Axis]) -> bool {
    const KEY: &str = "solver.rtol";
    settings.iter().any(|setting| matches!(setting.key(), KEY | "solver"))
        || axes.iter().any(|axis| axis.keys.iter().any(|key| key == KEY))
        || document::read(&base.text, "").is_ok_and(|root| root.at(KEY).is_some())
}

/// The problems of a point, in the words of the study: at the line of `[set]` that has the value, if one has.
pub(crate) fn relabelled(error: CaseError, settings: &[Override], label: &str) -> CaseError {
    let problems = error.problems.into_iter().map(|problem| {
        let message = format!("no point of the study is a valid case: {}", problem.message);
        let Some(set) = problem.place.strip_prefix("--set ") else {
            return Problem { message, ..problem };
        };
        let written = settings.iter().rev().find(|setting| setting.key() == set);
        match written.and_then(Override::origin) {
            Some(origin) => Problem {
                place: origin.to_owned(),
                key: format!("set.{}", problem.key),
                message,
            },
            None => Problem {
                place: label.to_owned(),
                message,
                ..problem
            },
        }
    });
    CaseError {
        problems: problems.collect(),
    }
}

pub(crate) fn read_base(
    reader: &mut Reader,
    root: &Node,
    source: &StudySource,
    files: &mut Vec<PathBuf>,
) -> Option<CaseSource> {
    let Some(node) = root.at("case") else {
        reader.report(
            root,
            "case",
            "missing: the base case, as in case = \"paper\" or case = \"mine.toml\"",
        );
        return None;
    };
    let name = reader.text(node, "case")?;
    let path = source.folder().join(&name);
    let found = if path.is_file() || Path::new(&name).extension().is_some() {
        files.push(path.clone());
        if path.is_file() && (is_hdf5(&path) || path.extension().is_some_and(|extension| extension == "h5")) {
            let resolved = open_sound(&path).and_then(|file| file.resolved());
            match resolved {
                Ok(resolved) => return Some(CaseSource::result(&path, resolved)),
                Err(error) => {
                    reader.report(node, "case", error.to_string());
                    return None;
                }
            }
        }
        CaseSource::file(&path)
    } else {
        CaseSource::built_in(&name)
    };
    match found {
        Ok(base) => Some(base),
        Err(error) => {
            for problem in &error.problems {
                reader.report(node, "case", problem.to_string());
            }
            None
        }
    }
}

/// The leaves of `[set]`, whether written as tables, as dotted keys or as quoted paths.
pub(crate) fn read_settings(
    reader: &mut Reader,
    known: &CaseKeys,
    node: &Node,
    path: &str,
    settings: &mut Vec<Override>,
) {
    match &node.value {
        // What a signal is, is said as a whole; the case finds what is wrong inside.
        _ if known.is_whole(path) && (node.at("profile").is_some() || matches!(node.value, Value::Array(_))) => {
            settings.push(Override::of_node(path, node, &reader.label));
        }
        // Another law has other keys: such a table takes the place of the case's, as with --set.
        Value::Table(entries) if path == "friction" && entries.iter().any(|(name, _)| name == "law") => {
            settings.push(Override::of_node(path, node, &reader.label));
        }
        Value::Table(entries) if entries.is_empty() && !path.is_empty() => {
            let within = |key: &&str| key.strip_prefix(path).is_some_and(|rest| rest.starts_with('.'));
            let is_known = known.slot(path).is_some() || known.known().iter().any(within);
            let message = match is_known {
                true => "an empty table sets nothing; write a value, or leave the key out".to_owned(),
                false => known.unknown(path),
            };
            reader.report(node, &format!("set.{path}"), message);
        }
        Value::Table(entries) => {
            for (name, child) in entries {
                let inner = join(path, &name.replace('[', ".").replace(']', ""));
                read_settings(reader, known, child, &inner, settings);
            }
        }
        _ if path.is_empty() => {
            reader.expected::<()>(node, "set", "a table of keys and values");
        }
        _ => {
            let whole_array = matches!(node.value, Value::Array(_));
            if known.slot(path).is_none() && !(whole_array && matches!(path, "perturbation" | "output.window")) {
                reader.report(node, &format!("set.{path}"), known.unknown(path));
            }
            settings.push(Override::of_node(path, node, &reader.label));
        }
    }
}

fn check_keys_once(reader: &mut Reader, node: &Node, path: &str, axes: &[Axis], axis: &Axis) {
    for key in &axis.keys {
        let before = axes
            .iter()
            .flat_map(|other| &other.keys)
            .filter(|other| *other == key)
            .count();
        if before > 0 || axis.keys.iter().filter(|other| *other == key).count() > 1 {
            reader.report(
                node,
                &format!("{path}.key"),
                format!("{key} stands on two axes; keep one"),
            );
        }
    }
}

fn read_design(
    reader: &mut Reader,
    known: &CaseKeys,
    root: &Node,
    source: &StudySource,
    axes: &mut Vec<Axis>,
    files: &mut Vec<PathBuf>,
) -> Option<Design> {
    let given: Vec<&str> = ["sample", "points", "boundary"]
        .into_iter()
        .filter(|name| root.at(name).is_some())
        .collect();
    if let [first, second, ..] = given[..] {
        let node = root.at(second).unwrap_or(root);
        reader.report(
            node,
            second,
            format!("a study has one set of points, and {first} gives one already; remove one of them"),
        );
        return None;
    }
    match given.first() {
        Some(&"points") => {
            let node = root.at("points")?;
            if let Some(axis) = root.at("axis") {
                reader.report(
                    axis,
                    "axis",
                    "the first line of the table of points names the keys; remove the axes",
                );
                return None;
            }
            let path = source.folder().join(reader.text(node, "points")?);
            match sampling::read_table(&path, known) {
                Ok((columns, rows)) => {
                    files.push(path);
                    *axes = columns;
                    Some(Design::Rows(rows))
                }
                Err(message) => {
                    reader.report(node, "points", message);
                    None
                }
            }
        }
        _ if axes.is_empty() => {
            // Axes that could not be read have been reported.
            if root
                .at("axis")
                .is_none_or(|node| matches!(&node.value, Value::Array(list) if list.is_empty()))
            {
                reader.report(root, "axis", "missing: a study varies something; write [[axis]] with a key and its values, or points = \"FILE.csv\"");
            }
            None
        }
        Some(&"sample") => read_sample(reader, root.at("sample")?, axes).map(Design::Rows),
        Some(_) => read_boundary(reader, known.words, root.at("boundary")?, axes).map(Design::Boundary),
        None => Some(Design::Grid),
    }
}

/// One name, or a list of them.
fn read_show(reader: &mut Reader, words: Words, node: &Node) -> Vec<String> {
    let names = reading::keys_of(reader, node, "show").unwrap_or_default();
    for name in &names {
        if !quantities(words).iter().any(|quantity| quantity.name == name) {
            reader.report(node, "show", unknown_quantity(words, name, "", |_| true));
        }
    }
    names
}

fn read_sample(reader: &mut Reader, node: &Node, axes: &[Axis]) -> Option<Vec<Vec<Setting>>> {
    reader.check_keys(node, "sample", &["method", "count", "seed"]);
    let method = match node.at("method").map(|node| (node, &node.value)) {
        Some((_, Value::Text(name))) if name == "latin-hypercube" => Some(SampleMethod::LatinHypercube),
        Some((_, Value::Text(name))) if name == "sobol" => Some(SampleMethod::Sobol),
        other => {
            let message = "expected \"latin-hypercube\" or \"sobol\"";
            reader.report(other.map_or(node, |(node, _)| node), "sample.method", message);
            None
        }
    };
    let most = match method {
        Some(SampleMethod::Sobol) => MOST_SOBOL_POINTS,
        _ => 100_000_000,
    };
    let count = match node.at("count") {
        Some(given) => whole_number(reader, given, "sample.count", 1, most),
        None => {
            reader.report(node, "sample.count", "missing: how many points are drawn");
            None
        }
    };
    let seed = match node.at("seed") {
        Some(given) => whole_number(reader, given, "sample.seed", 0, u64::from(u32::MAX)),
        None => Some(0),
    };
    let (method, count, seed) = (method?, count?, seed?);
    if let Some(most) = sampling::too_many(axes.len(), count) {
        let message = format!(
            "{count} points of {} axes are more than the {most} that memory is given for; draw fewer, or split the study",
            axes.len()
        );
        reader.report(node.at("count").unwrap_or(node), "sample.count", message);
        return None;
    }
    if method == SampleMethod::Sobol && axes.len() > MOST_SOBOL_AXES {
        let message = format!(
            "{} axes are more than the {MOST_SOBOL_AXES} of a Sobol sequence; use latin-hypercube",
            axes.len()
        );
        reader.report(node, "sample.method", message);
        return None;
    }
    Some(sampling::draw(axes, method, count as usize, seed as u32))
}
