//! Study file of a sweep: base case, axes over keys of the case, and requested results.

use super::asked_for;
use super::axis::{self, ParameterAxis};
use super::criterion::{BOUNDARY_KEYS, BoundarySpec, read_boundary};
use super::distributed::{self, AxisDistribution};
use super::sampling::{self, MOST_SOBOL_AXES, MOST_SOBOL_POINTS, SampleMethod};
use crate::study::{PROBES, StudyHead, StudyKey, StudyReader, StudySource, check_points, hash_of, keys};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use stickslip_case::built_in;
use stickslip_case::builtin::BuiltIn;
use stickslip_case::document::{self, CaseValue, PlacedValue};
use stickslip_case::{Case, CaseError, CaseKeys, METHOD, Override, Setting};
use stickslip_engine::simulation::Method;
use stickslip_files::SweepLayout;
use stickslip_system::model::system::System;
use stickslip_system::quote::in_shell;

/// Built-in studies: the files of `data/studies`.
pub const STUDIES: &[BuiltIn] = built_in!["studies": "critical-curve", "groan-speed", "belt-stability"];

/// Choice of a study's points.
#[derive(Debug, Clone, PartialEq)]
pub enum Design {
    /// All combinations of the axes' levels; the last axis varies fastest.
    Grid,
    /// Rows of a sample or a table, one value for each axis.
    Rows(Vec<Vec<Setting>>),
    /// Points that the trace of a boundary requests.
    Boundary(BoundarySpec),
}

/// Default `solver.rtol` of points by `cvode`, `arkode` or `series`. It halves the time and keeps all events of a
/// critical curve within 1e-8 s (`series`: 1e-10 s). The other methods need their usual tolerance for that.
pub const STUDY_RTOL: f64 = 1e-8;

fn has_study_tolerance(method: Method) -> bool {
    matches!(method, Method::Cvode | Method::Arkode | Method::Series)
}

/// Stored results of every run besides its summary.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Keep {
    /// Events of each run, in the study's file.
    pub events: bool,
    /// Result file of each run.
    pub trajectory: bool,
}

/// Study, checked as far as possible without runs.
#[derive(Debug, Clone)]
pub struct Study {
    /// Title, base case, settings.
    pub head: StudyHead,
    /// Axes in the order of the text; the last varies fastest.
    pub axes: Vec<ParameterAxis>,
    /// Choice of points.
    pub design: Design,
    /// Stored results of each run.
    pub keep: Keep,
    /// Names of the quantities that figures show by default.
    pub show: Vec<String>,
    /// Whether the case or the study gives a tolerance; the default is [`STUDY_RTOL`].
    pub(super) gives_tolerance: bool,
}

/// Point of a study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StudyPoint {
    /// Number in the study, from 0.
    pub number: u64,
    /// Value on each axis.
    pub coordinates: Vec<Setting>,
}

/// Largest number of points; more are a mistake: years of computing.
const MOST_POINTS: u64 = 1_000_000_000;

/// Largest number of values on all axes together; more are a mistake.
const MOST_LEVELS: usize = 4_000_000;

const STUDY_KEYS: &[StudyKey] = keys! {
    "axis": "tables", "" => "parameters that vary: one table for each; none with points";
    "sample": "table", "none: the grid" => "a random sample instead of every combination";
    "points": "text", "none" => "CSV file with the points, instead of axes; its first line names the keys";
    "keep": "table", "the summary alone" => "what is stored of each run besides its summary";
    "show": "text or list", "none" => "quantities that figures show by default";
    "boundary": "table", "none" => "traces the boundary of a criterion in the plane of two axes";
};

const SAMPLE_KEYS: &[StudyKey] = keys! {
    "method": "\"latin-hypercube\" or \"sobol\"", "" => "how points are drawn";
    "count": "whole number", "" => "number of points; at most 65536 with sobol";
    "seed": "whole number", "0" => "seed of the random numbers";
};

const KEEP_KEYS: &[StudyKey] = keys! {
    "events": "true or false", "false" => "the events of each run, in the study's file";
    "trajectory": "true or false", "false" => "a result file of each run, in STUDY.runs/";
};

/// Tables of the study and their keys.
pub(crate) const KEY_TABLES: &[(&str, &[StudyKey])] = &[
    ("", STUDY_KEYS),
    ("sample", SAMPLE_KEYS),
    ("axis[]", distributed::KEYS),
    ("keep", KEEP_KEYS),
    ("boundary", BOUNDARY_KEYS),
];

impl Study {
    /// Reads a study, or reports all its problems. `overrides` apply to the base case after the study's own settings.
    pub fn parse(source: StudySource, overrides: &[Override]) -> Result<Study, CaseError> {
        let (mut reader, root) = StudyReader::open(&source.text, source.label(), STUDY_KEYS)?;
        let (mut head, keys) = StudyHead::read(&mut reader, &root, source, Vec::new(), overrides);
        let mut axes = read_axes(&mut reader, &keys, &root, &head.source.folder());
        head.files.extend(axes.iter().filter_map(table_of).cloned());
        // A table of points defines its columns later.
        let case = match root.at("points") {
            None => axis::case_along(&axes, &head),
            Some(_) => None,
        };
        let system = case.as_ref().map(|case| &case.system);
        let design = read_design(&mut reader, (&mut head, &keys), system, &root, &mut axes);
        let keep = root.at("keep").map_or_else(Keep::default, |node| {
            reader.check_keys(node, "keep", KEEP_KEYS);
            Keep {
                events: reader.flag(node, "keep", "events"),
                trajectory: reader.flag(node, "keep", "trajectory"),
            }
        });
        let show = root
            .at("show")
            .map_or_else(Vec::new, |node| read_show(&mut reader, system, node));
        let Some(design) = design.filter(|_| reader.is_clean()) else {
            return Err(reader.into_error());
        };
        let study = Study {
            keep,
            show,
            ..Study::new(head, axes, design)
        };
        study.check()?;
        Ok(study)
    }

    pub(super) fn new(head: StudyHead, axes: Vec<ParameterAxis>, design: Design) -> Study {
        Study {
            gives_tolerance: gives_tolerance(&head, &axes),
            head,
            axes,
            design,
            keep: Keep::default(),
            show: Vec::new(),
        }
    }

    /// Study whose points are requested one by one within the ranges of the axes.
    pub(crate) fn of_ranges(head: StudyHead, axes: Vec<ParameterAxis>) -> Study {
        Study {
            // A search needs runs that vary smoothly with the parameters, so the case's own tolerance applies.
            gives_tolerance: true,
            ..Study::new(head, axes, Design::Rows(Vec::new()))
        }
    }

    /// Default tolerance of the points, if study and case give none.
    pub fn default_tolerance(&self) -> Option<f64> {
        (!self.gives_tolerance).then_some(STUDY_RTOL)
    }

    /// Whether sliding slows down by itself in the first case, so that its loss of stability is watched.
    pub fn slows_down(&self) -> bool {
        let first: Option<Vec<Setting>> = self.axes.iter().map(|axis| axis.levels.first().cloned()).collect();
        let case = match first {
            Some(first) => self.case_at(&first),
            None => self.head.case_with([]),
        };
        case.is_ok_and(|case| case.stops())
    }

    /// Number of points; `None` if unknown before the sweep.
    pub fn point_count(&self) -> Option<u64> {
        match &self.design {
            Design::Grid => {
                let mut axes = self.axes.iter();
                axes.try_fold(1u64, |n, axis| n.checked_mul(axis.levels.len() as u64))
            }
            Design::Rows(rows) => Some(rows.len() as u64),
            Design::Boundary(_) => None,
        }
    }

    pub(super) fn layout(&self) -> SweepLayout {
        match self.design {
            Design::Grid => SweepLayout::Grid,
            _ => SweepLayout::Table,
        }
    }

    /// Point with a number below [`Self::point_count`]; `None` beyond, and in a boundary study.
    pub fn point(&self, number: u64) -> Option<StudyPoint> {
        if number >= self.point_count()? {
            return None;
        }
        let coordinates = match &self.design {
            Design::Grid => {
                let (mut rest, mut coordinates) = (number, Vec::with_capacity(self.axes.len()));
                for levels in self.axes.iter().rev().map(|axis| &axis.levels) {
                    coordinates.push(levels[(rest % levels.len() as u64) as usize].clone());
                    rest /= levels.len() as u64;
                }
                coordinates.reverse();
                coordinates
            }
            Design::Rows(rows) => rows[usize::try_from(number).ok()?].clone(),
            Design::Boundary(_) => return None,
        };
        Some(StudyPoint { number, coordinates })
    }

    /// Case at one value for each axis.
    ///
    /// # Errors
    /// The values are invalid.
    pub fn case_at(&self, coordinates: &[Setting]) -> Result<Case, CaseError> {
        let mut case = self.case_with_output(coordinates)?;
        let solver = &mut case.solver;
        if !self.gives_tolerance && has_study_tolerance(solver.method) {
            solver.rtol = STUDY_RTOL;
        }
        if !self.keep.trajectory {
            case.without_trajectory();
        }
        Ok(case)
    }

    /// Keeps the case's own tolerance and output.
    pub(crate) fn case_with_output(&self, coordinates: &[Setting]) -> Result<Case, CaseError> {
        let pairs = self.axes.iter().zip(coordinates);
        self.head
            .case_with(pairs.flat_map(|(axis, value)| axis.overrides(value)))
    }

    /// Command that runs a single point, without the values on the axes. `--set KEY=VALUE` for each key of the axes
    /// completes it. A base case in a file is named relative to the study's folder.
    ///
    /// The time limit is left out. The tolerance is left out, too, if the method is an axis.
    pub fn point_command(&self) -> String {
        let mut arguments = vec![self.head.source.named(&self.head.base)];
        let settings = self.head.decisive_settings();
        arguments.extend(settings.flat_map(|setting| ["--set".to_owned(), setting.argument()]));
        let by_axis = self.axes.iter().any(|axis| axis.keys.iter().any(|key| key == METHOD));
        let method = self.head.case_with([]).map(|case| case.solver.method);
        let takes_it = method.map_or(true, has_study_tolerance);
        if let (Some(tolerance), false, true) = (self.default_tolerance(), by_axis, takes_it) {
            arguments.extend(["--set".to_owned(), format!("solver.rtol={tolerance:e}")]);
        }
        let arguments: Vec<String> = arguments.iter().map(|argument| in_shell(argument)).collect();
        format!("stickslip run {}", arguments.join(" "))
    }

    /// Hash of everything that determines the results, with the program version. Title and layout do not count. 64
    /// hexadecimal digits.
    pub fn digest(&self) -> String {
        let settings: Vec<_> = self.head.decisive_settings().collect();
        let mut parts = vec![
            "stickslip sweep 2".to_owned(),
            env!("CARGO_PKG_VERSION").to_owned(),
            self.head.base.text.clone(),
            format!("{settings:?}"),
            format!("{STUDY_RTOL}"),
        ];
        let axes = self.axes.iter();
        parts.extend(axes.map(|axis| format!("{:?} {:?} {:?}", axis.keys, axis.range, axis.levels)));
        parts.extend([format!("{:?}", self.design), format!("{:?}", self.keep)]);
        let lengths = parts
            .iter()
            .flat_map(|part| [&(part.len() as u64).to_le_bytes(), part.as_bytes()].concat());
        hash_of(lengths.collect::<Vec<u8>>())
    }

    /// Reports errors that all points share before anything is computed.
    fn check(&self) -> Result<(), CaseError> {
        let (label, settings) = (self.head.source.label(), &self.head.settings);
        if let Design::Boundary(_) = self.design {
            let corner = std::iter::once(self.case_at(&BoundarySpec::corner(&self.axes)));
            return check_points(corner, settings, &label);
        }
        let count = self.point_count().filter(|&count| count <= MOST_POINTS);
        let count = count.ok_or_else(|| {
            let message = format!("more than {MOST_POINTS:e} points; give the axes fewer values");
            CaseError::one(&label, "axis", message)
        })?;
        let probes = count.min(PROBES as u64);
        let numbers = (0..probes).map(|k| k * (count - 1) / (probes - 1).max(1));
        let points = numbers.filter_map(|number| self.point(number));
        let cases = points.map(|point| self.case_at(&point.coordinates));
        check_points(cases, settings, &label)
    }
}

fn gives_tolerance(head: &StudyHead, axes: &[ParameterAxis]) -> bool {
    const KEY: &str = "solver.rtol";
    head.settings
        .iter()
        .any(|setting| matches!(setting.key(), KEY | "solver"))
        || axes.iter().any(|axis| axis.keys.iter().any(|key| key == KEY))
        || document::read(&head.base.text, "").is_ok_and(|root| root.at(KEY).is_some())
}

/// The table from which the values of an axis are drawn, an input of the study.
fn table_of(axis: &ParameterAxis) -> Option<&PathBuf> {
    match &axis.distribution {
        Some(AxisDistribution::Table { path, .. }) => Some(path),
        _ => None,
    }
}

fn read_axes(reader: &mut StudyReader, known: &CaseKeys, root: &PlacedValue, folder: &Path) -> Vec<ParameterAxis> {
    let sampled = root.at("sample").is_some();
    let (mut axes, mut levels) = (Vec::<ParameterAxis>::new(), 0);
    for (path, node) in reader.tables(root, "axis", None) {
        let axis = match sampled {
            true => axis::read_sampled(reader, known, node, &path, folder),
            false => axis::read(reader, known, node, &path, false),
        };
        let Some(axis) = axis else { continue };
        levels += axis.levels.len();
        if levels > MOST_LEVELS {
            let message = format!("the axes have more than {MOST_LEVELS} values in all; give them fewer");
            reader.report(node, &path, message);
            break;
        }
        for (k, key) in axis.keys.iter().enumerate() {
            let mut others = axes.iter().flat_map(|other| &other.keys).chain(&axis.keys[..k]);
            if others.any(|other| other == key) {
                let message = format!("{key} stands on two axes; keep one");
                reader.report(node, &format!("{path}.key"), message);
            }
        }
        axes.push(axis);
    }
    axes
}

fn read_design(
    reader: &mut StudyReader,
    (head, keys): (&mut StudyHead, &CaseKeys),
    system: Option<&System>,
    root: &PlacedValue,
    axes: &mut Vec<ParameterAxis>,
) -> Option<Design> {
    let given = ["sample", "points", "boundary"];
    let mut given = given.into_iter().filter_map(|name| Some((name, root.at(name)?)));
    let (first, second) = (given.next(), given.next());
    if let (Some((first, _)), Some((second, node))) = (first, second) {
        let message = format!("a study has one set of points, and {first} gives one already; remove one of them");
        return reader.refuse(node, second, message);
    }
    if let Some(("points", node)) = first {
        if let Some(axis) = root.at("axis") {
            let message = "the first line of the table of points names the keys; remove the axes";
            return reader.refuse(axis, "axis", message);
        }
        let path = head.source.folder().join(reader.text(node, "points")?);
        let table = sampling::read_table(&path, keys);
        let (columns, rows) = reader.found(node, "points", table)?;
        head.files.push(path);
        *axes = columns;
        return Some(Design::Rows(rows));
    }
    if axes.is_empty() {
        // Unreadable axes have already been reported.
        let is_none = |node: &PlacedValue| matches!(&node.value, CaseValue::Array(list) if list.is_empty());
        if root.at("axis").is_none_or(is_none) {
            let message =
                "missing: a study varies something; write [[axis]] with a key and its values, or points = \"FILE.csv\"";
            reader.report(root, "axis", message);
        }
        return None;
    }
    match first {
        Some(("sample", node)) => read_sample(reader, node, axes).map(Design::Rows),
        Some((_, node)) => read_boundary(reader, system, node, axes).map(Design::Boundary),
        None => Some(Design::Grid),
    }
}

fn read_show(reader: &mut StudyReader, system: Option<&System>, node: &PlacedValue) -> Vec<String> {
    let names = reader.keys(node, "show").unwrap_or_default();
    for name in &names {
        reader.found(node, "show", asked_for(name, system, "", |_| true));
    }
    names
}

fn read_sample(reader: &mut StudyReader, node: &PlacedValue, axes: &[ParameterAxis]) -> Option<Vec<Vec<Setting>>> {
    reader.check_keys(node, "sample", SAMPLE_KEYS);
    let method = match node.at("method").map(|node| (node, &node.value)) {
        Some((_, CaseValue::Text(name))) if name == "latin-hypercube" => Some(SampleMethod::LatinHypercube),
        Some((_, CaseValue::Text(name))) if name == "sobol" => Some(SampleMethod::Sobol),
        other => {
            let message = "expected \"latin-hypercube\" or \"sobol\"";
            reader.refuse(other.map_or(node, |(node, _)| node), "sample.method", message)
        }
    };
    let most = match method {
        Some(SampleMethod::Sobol) => MOST_SOBOL_POINTS,
        _ => 100_000_000,
    };
    let count = reader.needed(node, "sample", "count", "missing: how many points are drawn");
    let count = count.and_then(|given| reader.whole_number(given, "sample.count", 1..=most));
    let seed = reader.whole_or(node, "sample", "seed", 0..=u64::from(u32::MAX), 0);
    let (method, count, seed) = (method?, count?, seed?);
    if let Some(most) = sampling::too_many(axes.len(), count) {
        let message = format!(
            "{count} points of {} axes are more than the {most} that memory is given for; draw fewer, or split the study",
            axes.len()
        );
        return reader.refuse(node.at("count").unwrap_or(node), "sample.count", message);
    }
    if method == SampleMethod::Sobol && axes.len() > MOST_SOBOL_AXES {
        let message = format!(
            "{} axes are more than the {MOST_SOBOL_AXES} of a Sobol sequence; use latin-hypercube",
            axes.len()
        );
        return reader.refuse(node, "sample.method", message);
    }
    Some(sampling::draw(axes, method, count as usize, seed as u32))
}
