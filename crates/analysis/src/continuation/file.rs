//! Contents of a continuation file, and reading.

use super::ending::EndReason;
use super::explore::{Branch, BranchPoint, Explored};
use super::special::Special;
use super::study::ContinuationStudy;
use crate::cycle::CycleStability;
use crate::provenance;
use std::path::{Path, PathBuf};
use stickslip_case::{Motion, quantity::Dimension};
use stickslip_files::schema::{META_POINT_COMMAND, Variable, attribute};
use stickslip_files::{
    Addition, AttributeValue, DeclaredColumn, FileColumn, Reservation, ResultError, Status, StudyFile, StudyHeader,
    columns,
};
use stickslip_system::quote::in_shell;

const MOST_SEQUENCES: usize = 127;

/// Columns of /points with the units of a rotation. The value of the parameter and the sequence of events, whose names or
/// words differ between files, are not among them.
const POINT_COLUMNS: &[DeclaredColumn<BranchPoint>] = &columns! { p, x:
    Variable::quantity("period", "s", "period of the cycle; at a Hopf point of the cycles that are born; NaN for steady sliding"),
        p.period, p.period = x;
    Variable::quantity("amplitude", "rad", "half of what the position sweeps"), (p.position.1 - p.position.0) / 2.0, _ = (p, x);
    Variable::quantity("least_position", "rad", "least position"), p.position.0, p.position.0 = x;
    Variable::quantity("largest_position", "rad", "largest position"), p.position.1, p.position.1 = x;
    Variable::quantity("least_relative_velocity", "rad/s", "least omega_r"), p.relative_velocity.0, p.relative_velocity.0 = x;
    Variable::quantity("largest_relative_velocity", "rad/s", "largest omega_r"), p.relative_velocity.1, p.relative_velocity.1 = x;
    Variable::words("stability", "stability: growth of small disturbances", flags(STABILITIES.map(CycleStability::name))),
        index(&STABILITIES, &p.stability), p.stability = STABILITIES[(x as usize).min(2)];
    Variable::count("unstable", "multipliers above 1 in magnitude, or eigenvalues with a positive real part"),
        p.unstable as f64, p.unstable = x as usize;
    Variable::words("special", "kind of special point", words_of_specials()),
        p.special.map_or(-1, Special::code).into(),
        p.special = Special::ALL.get(x as usize).copied().filter(|_| x >= 0.0);
    Variable::count("sticks", "sticks in a period"), p.sticks as f64, p.sticks = x as usize;
    Variable::quantity("shortest_stick", "s", "duration of the shortest stick; NaN: none"),
        p.shortest_stick, p.shortest_stick = x;
    Variable::quantity("margin", "1", "relative distance of the nearest other sequence of events; NaN: none is near"),
        p.margin, p.margin = x;
    Variable::quantity("time", "s", "phase of the drives where the state is"), p.time, p.time = x;
};

const STABILITIES: [CycleStability; 3] = [
    CycleStability::Stable,
    CycleStability::Unstable,
    CycleStability::Neutral,
];

fn words_of_specials() -> Vec<(i64, String)> {
    let none = (-1, "none".to_owned());
    std::iter::once(none)
        .chain(flags(Special::ALL.map(Special::name)))
        .collect()
}

/// Code of a value: its place in the list of all values.
fn index<T: PartialEq>(all: &[T], value: &T) -> f64 {
    all.iter().position(|one| one == value).unwrap_or(0) as f64
}

fn flags<'a>(words: impl IntoIterator<Item = &'a str>) -> Vec<(i64, String)> {
    (0..).zip(words.into_iter().map(str::to_owned)).collect()
}

pub(crate) fn write(
    study: &ContinuationStudy,
    motion: Motion,
    explored: &Explored,
    place: &Reservation,
    status: &Status,
) -> Result<PathBuf, ResultError> {
    let mut meta: Vec<(String, AttributeValue)> = provenance::build();
    meta.push(("study_digest".to_owned(), AttributeValue::Text(study.digest())));
    meta.extend(provenance::point_command(modes_command(study)));
    let settings: Vec<String> = study.settings.iter().map(stickslip_case::Override::argument).collect();
    let about = "overrides of the case, KEY=VALUE in each line";
    let header = StudyHeader {
        title: study.title.clone(),
        source: provenance::source(),
        history: format!("stickslip continue {}", study.source.name),
        study: study.source.text.clone(),
        inputs: vec![
            ("case", "the base case as it was given (TOML)", study.base.text.clone()),
            ("settings", about, settings.join("\n")),
        ],
        meta,
        ..StudyHeader::default()
    };
    let groups = [
        branches(explored),
        points(study, motion, explored),
        curves(study, explored),
    ];
    header.write_continuation(&groups, place, status)
}

fn modes_command(study: &ContinuationStudy) -> String {
    let mut command = format!("stickslip modes {}", in_shell(&study.source.named(&study.base)));
    for setting in &study.settings {
        command += &format!(" --set {}", in_shell(&setting.argument()));
    }
    command
}

fn branches(explored: &Explored) -> Addition {
    let all = &explored.branches;
    let mut group = Addition::new("branches");
    group.dimension("branch", all.len(), "number of the branch");
    let mut add = |column: FileColumn| group.over(&["branch"], column);
    let what = all.iter().map(|branch| i8::from(!branch.steady));
    add(FileColumn::codes(
        "what",
        "what is followed",
        what,
        flags(["steady", "cycle"]),
    ));
    let (words, ends) = (
        flags(EndReason::ALL.map(EndReason::name)),
        all.iter().map(|branch| branch.end),
    );
    let ends = ends.map(|end| index(&EndReason::ALL, &end) as i8);
    add(FileColumn::codes("end", "why it ends", ends, words));
    let mut first = 0;
    let firsts = all.iter().map(|branch| {
        first += branch.points.len() as i64;
        first - branch.points.len() as i64
    });
    add(FileColumn::counts("first_point", "its first point", firsts));
    let points = all.iter().map(|branch| branch.points.len() as i64);
    add(FileColumn::counts("points", "how many points it has", points));
    let multiples = all.iter().map(|branch| branch.multiple.map_or(-1, i64::from));
    let about = "drive periods in one of its cycles; -1: autonomous, or steady sliding";
    add(FileColumn::counts("multiple", about, multiples));
    let parents = all
        .iter()
        .map(|branch| branch.parent.map_or(-1, |parent| parent.0 as i64));
    let about = "the branch at whose special point it starts; -1: none";
    add(FileColumn::counts("parent", about, parents));
    group
}

fn points(study: &ContinuationStudy, motion: Motion, explored: &Explored) -> Addition {
    let all: Vec<(usize, &BranchPoint)> = explored
        .branches
        .iter()
        .enumerate()
        .flat_map(|(index, branch)| branch.points.iter().map(move |point| (index, point)))
        .collect();
    let only = || all.iter().map(|one| one.1);
    let mut group = Addition::new("points");
    let axis = &study.axes[0];
    group.attribute("number", axis.name.as_str());
    group.attribute("keys", axis.keys.join(" ").as_str());
    group.dimension("point", all.len(), "number of the point");
    let widest = |of: fn(&BranchPoint) -> usize| only().map(of).max().unwrap_or(0);
    let (values, components) = (widest(|point| point.spectrum.len()), widest(|point| point.state.len()));
    group.dimension(
        "value",
        values,
        "number of the multiplier or eigenvalue, the most unstable first",
    );
    group.dimension("component", components, "number of the component of the state");
    let mut add = |column: FileColumn| group.over(&["point"], column);
    let owners = all.iter().map(|one| one.0 as i64);
    add(FileColumn::counts("branch", "index of the branch of the point", owners));
    let values_of_axis = only().map(|point| point.value);
    let unit = axis.unit.unwrap_or("1");
    add(FileColumn::numbers(&axis.name, unit, axis.description, values_of_axis));
    let in_units = |declared: &DeclaredColumn<BranchPoint>| {
        let mut column = declared.of(only());
        let of_rotation = [Dimension::Angle, Dimension::AngularVelocity];
        if let Some(dimension) = of_rotation.into_iter().find(|one| one.unit() == column.variable.units) {
            column.variable.units = motion.dimension(dimension).unit().to_owned();
        }
        column
    };
    let (before, after) = POINT_COLUMNS.split_at(POINT_COLUMNS.len() - 1);
    before.iter().map(in_units).for_each(&mut add);
    let mut sequences: Vec<String> = Vec::new();
    let codes: Vec<i8> = only()
        .map(|point| {
            let word = match point.sequence.is_empty() {
                true => "none".to_owned(),
                false => point.sequence.replace(", ", "-"),
            };
            let found = sequences.iter().position(|other| *other == word).unwrap_or_else(|| {
                sequences.push(word);
                sequences.len() - 1
            });
            found.min(MOST_SEQUENCES) as i8
        })
        .collect();
    if sequences.len() > MOST_SEQUENCES {
        sequences.truncate(MOST_SEQUENCES);
        sequences.push("other".to_owned());
    }
    let words = flags(sequences.iter().map(String::as_str));
    add(FileColumn::codes("sequence", "events of a period", codes, words));
    after.iter().map(in_units).for_each(&mut add);
    let padded = |values: Vec<f64>, length: usize| {
        let missing = length - values.len();
        values.into_iter().chain(std::iter::repeat_n(f64::NAN, missing))
    };
    for (part, of) in [
        ("real", (|one| one.0) as fn(&(f64, f64)) -> f64),
        ("imaginary", |one| one.1),
    ] {
        let spectra = only().flat_map(|point| padded(point.spectrum.iter().map(of).collect(), values));
        let about = format!("{part} part of a multiplier, or of an eigenvalue of steady sliding (1/s); NaN: none");
        group.over(&["point", "value"], FileColumn::numbers(part, "1", &about, spectra));
    }
    let states: Vec<f64> = only()
        .flat_map(|point| padded(point.state.clone(), components))
        .collect();
    let about = "twists, rates, speeds of free chains and bristles at the start of the period, SI";
    group.over(
        &["point", "component"],
        FileColumn::numbers("state", "1", about, states),
    );
    group
}

fn curves(study: &ContinuationStudy, explored: &Explored) -> Addition {
    let mut group = Addition::new("curves");
    let all: Vec<_> = explored
        .curves
        .iter()
        .enumerate()
        .flat_map(|(index, curve)| curve.points.iter().map(move |point| (index, curve.special, point)))
        .collect();
    group.dimension("curve_point", all.len(), "number of the point");
    let mut add = |column: FileColumn| group.over(&["curve_point"], column);
    let numbers = all.iter().map(|one| one.0 as i64);
    add(FileColumn::counts("curve", "index of the curve of the point", numbers));
    let (words, codes) = (
        flags(Special::ALL.map(Special::name)),
        all.iter().map(|one| one.1.code()),
    );
    add(FileColumn::codes(
        "special",
        "special points of which kind",
        codes,
        words,
    ));
    for (k, axis) in study.axes.iter().take(2).enumerate() {
        let unit = axis.unit.unwrap_or("1");
        let values = all.iter().map(|one| one.2.values[k]);
        add(FileColumn::numbers(&axis.name, unit, axis.description, values));
    }
    let periods = all.iter().map(|one| one.2.period);
    add(FileColumn::numbers(
        "curve_period",
        "s",
        "period of the cycle there",
        periods,
    ));
    group
}

/// Branches that were read from a file.
#[derive(Debug)]
pub struct Stored {
    /// Title of the study.
    pub title: String,
    /// Whether the study was completed.
    pub complete: bool,
    /// `stickslip modes` for the case, without the parameter's value; `None` if the file has no such command.
    pub modes_command: Option<String>,
    /// Name of the varied parameter, its keys, and its unit.
    pub number: (String, Vec<String>, String),
    /// Description and unit of the second parameter, if there are curves.
    pub second: Option<(String, String)>,
    /// Branches in their order.
    pub branches: Vec<Branch>,
    /// Curves in two parameters: kind and points.
    pub curves: Vec<(Special, Vec<[f64; 2]>)>,
    /// Text of the base case, and its settings.
    pub case: (String, Vec<String>),
    /// Unit of positions.
    pub angle: String,
    /// Unit of relative velocities.
    pub speed: String,
}

impl Stored {
    /// Whether the file at `path` is a continuation.
    pub fn is_one(path: &Path) -> bool {
        StudyFile::is_continuation(path)
    }

    /// Reads a continuation file.
    ///
    /// # Errors
    /// The file is missing, damaged, too new, or of another kind.
    pub fn read(path: &Path) -> Result<Stored, ResultError> {
        let file = StudyFile::open_continuation(path)?;
        let missing = |what: &str| stickslip_files::Reason::Missing(what.to_owned()).of(path);
        let (points, branches) = (file.table("points")?, file.table("branches")?);
        let unit =
            |variable: &str| Ok::<_, ResultError>(file.text_attribute(variable, attribute::UNITS)?.unwrap_or_default());
        let text = |name: &str| file.text_attribute("points", name)?.ok_or_else(|| missing(name));
        let (number, keys) = (text("number")?, text("keys")?);
        let owner = points.column("branch")?;
        let (value, sequence) = (points.column(&number)?, points.column("sequence")?);
        let mut all = vec![BranchPoint::default(); owner.len()];
        for column in POINT_COLUMNS {
            column.read(&points, &mut all)?;
        }
        let sequences = file.words("points/sequence")?;
        let ((real, values), (imaginary, others)) = (points.matrix("real")?, points.matrix("imaginary")?);
        let (states, components) = points.matrix("state")?;
        if values != others {
            return Err(missing("imaginary part of every value of points/real"));
        }
        for (k, point) in all.iter_mut().enumerate() {
            let spectrum = (k * values..(k + 1) * values).map(|at| (real[at], imaginary[at]));
            let state = states[k * components..(k + 1) * components].iter().copied();
            let word = sequences.iter().find(|one| one.0 == sequence[k] as i64);
            point.value = value[k];
            point.spectrum = spectrum.filter(|one| !one.0.is_nan()).collect();
            point.sequence = word.map_or_else(String::new, |one| one.1.clone());
            point.state = state.filter(|one| !one.is_nan()).collect();
        }
        let (what, end) = (branches.column("what")?, branches.column("end")?);
        let (multiple, parent) = (branches.column("multiple")?, branches.column("parent")?);
        let owned = |branch: usize| -> Vec<BranchPoint> {
            let points = owner.iter().zip(&all).filter(|(owner, _)| **owner as usize == branch);
            points.map(|(_, point)| point.clone()).collect()
        };
        let branches = (0..what.len()).map(|index| Branch {
            steady: what[index] == 0.0,
            multiple: (multiple[index] > 0.0).then_some(multiple[index] as u32),
            parent: (parent[index] >= 0.0).then_some((parent[index] as usize, 0)),
            points: owned(index),
            end: EndReason::ALL[(end[index] as usize).min(EndReason::ALL.len() - 1)],
        });
        let branches = branches.collect();
        let mut curves: Vec<(Special, Vec<[f64; 2]>)> = Vec::new();
        let mut second = None;
        let names = file.names("curves")?;
        let known = ["curve_point", "curve", "special", "curve_period"];
        if let Some(other) = names
            .iter()
            .find(|name| !known.contains(&name.as_str()) && **name != number)
        {
            let table = file.table("curves")?;
            let of = |name: &str| table.column(name);
            let (curve, kind, x, y) = (of("curve")?, of("special")?, of(&number)?, of(other)?);
            let mut before = f64::NAN;
            for k in 0..curve.len() {
                if curve[k] != before {
                    let special = Special::ALL.get(kind[k] as usize).copied().unwrap_or(Special::Fold);
                    curves.push((special, Vec::new()));
                    before = curve[k];
                }
                if let Some(last) = curves.last_mut() {
                    last.1.push([x[k], y[k]]);
                }
            }
            second = Some((other.clone(), unit(&format!("curves/{other}"))?));
        }
        let input = |name: &str| Ok::<_, ResultError>(file.input(name)?.unwrap_or_default());
        let settings = input("settings")?;
        let root = |name: &str| Ok::<_, ResultError>(file.text_attribute("", name)?.unwrap_or_default());
        Ok(Stored {
            title: root("title")?,
            complete: root("status")? == Status::Complete.name(),
            modes_command: file.text_attribute("meta", META_POINT_COMMAND)?,
            number: (
                number.clone(),
                keys.split(' ').map(str::to_owned).collect(),
                unit(&format!("points/{number}"))?,
            ),
            second,
            branches,
            curves,
            case: (input("case")?, settings.lines().map(str::to_owned).collect()),
            angle: unit("points/amplitude")?,
            speed: unit("points/largest_relative_velocity")?,
        })
    }
}
