//! Contents of a continuation file, and reading.

use super::ending::EndReason;
use super::explore::{Branch, BranchPoint, Explored};
use super::special::Special;
use super::study::ContinuationStudy;
use crate::cycle::CycleStability;
use crate::provenance;
use std::path::Path;
use stickslip_case::{Motion, quantity::Dimension};
use stickslip_files::schema::META_POINT_COMMAND;
use stickslip_files::{
    Addition, AttributeValue, ContinuationFile, FileColumn, FileRows, ResultError, Status, StoredContinuation,
};
use stickslip_system::quote::in_shell;

const MOST_SEQUENCES: usize = 127;

/// Length of the longest stored command: all attributes of a group share 64 kB.
const LONGEST_COMMAND: usize = 32_768;

const STABILITIES: [CycleStability; 3] = [
    CycleStability::Stable,
    CycleStability::Unstable,
    CycleStability::Neutral,
];

fn flags<'a>(words: impl IntoIterator<Item = &'a str>) -> Vec<(i64, String)> {
    (0..).zip(words.into_iter().map(str::to_owned)).collect()
}

pub(crate) fn contents(study: &ContinuationStudy, motion: Motion, explored: &Explored) -> ContinuationFile {
    let mut meta: Vec<(String, AttributeValue)> = provenance::build();
    meta.push(("study_digest".to_owned(), AttributeValue::Text(study.digest())));
    meta.extend(modes_command(study));
    let settings: Vec<String> = study.settings.iter().map(stickslip_case::Override::argument).collect();
    ContinuationFile {
        title: study.title.clone(),
        source: provenance::source(),
        history: format!("stickslip continue {}", study.source.name),
        study: study.source.text.clone(),
        case: study.base.text.clone(),
        settings: settings.join("\n"),
        meta,
        groups: vec![
            branches(explored),
            points(study, motion, explored),
            curves(study, explored),
        ],
    }
}

const MULTIPLE: &str = "periods of the drives in one of its cycles; -1: autonomous, or steady sliding";
const PARENT: &str = "the branch at whose special point it starts; -1: none";
const PERIOD: &str = "period of the cycle; at a Hopf point of those that are born; NaN of steady sliding";
const UNSTABLE: &str = "multipliers above 1 in magnitude, or eigenvalues with a positive real part";
const MARGIN: &str = "relative distance of the nearest other sequence of events; NaN: none is near";
const REAL: &str = "real part of a multiplier, or of an eigenvalue of steady sliding (1/s); NaN: none";
const IMAGINARY: &str = "imaginary part of a multiplier, or of an eigenvalue of steady sliding (1/s); NaN: none";
const STATE: &str = "twists, rates, speeds of free chains and bristles at the start of the period, SI";

/// `None` if the command is too long for an attribute.
fn modes_command(study: &ContinuationStudy) -> Option<(String, AttributeValue)> {
    let mut command = format!("stickslip modes {}", in_shell(&study.source.named(&study.base)));
    for setting in &study.settings {
        command += &format!(" --set {}", in_shell(&setting.argument()));
    }
    (command.len() < LONGEST_COMMAND).then(|| (META_POINT_COMMAND.to_owned(), AttributeValue::Text(command)))
}

fn branches(explored: &Explored) -> Addition {
    let mut group = Addition::new("branches");
    let ends = flags(EndReason::ALL.map(EndReason::name));
    let end = |reason: EndReason| EndReason::ALL.iter().position(|end| *end == reason);
    let mut first = 0;
    let firsts = explored.branches.iter().map(|branch| {
        first += branch.points.len() as i64;
        first - branch.points.len() as i64
    });
    let rows = FileRows::of(&explored.branches)
        .codes("what", "what is followed", &flags(["steady", "cycle"]), |one| {
            i8::from(!one.steady)
        })
        .codes("end", "why it ends", &ends, |one| end(one.end).unwrap_or(0) as i8)
        .column(FileColumn::counts("first_point", "its first point", firsts))
        .counts("points", "how many points it has", |one| one.points.len() as i64)
        .counts("multiple", MULTIPLE, |one| one.multiple.map_or(-1, i64::from))
        .counts("parent", PARENT, |one| one.parent.map_or(-1, |parent| parent.0 as i64));
    group.rows("branch", "number of the branch", rows);
    group
}

fn points(study: &ContinuationStudy, motion: Motion, explored: &Explored) -> Addition {
    let of_branches = explored.branches.iter().enumerate();
    let all: Vec<(usize, &BranchPoint)> = of_branches
        .flat_map(|(index, branch)| branch.points.iter().map(move |point| (index, point)))
        .collect();
    let only: Vec<&BranchPoint> = all.iter().map(|one| one.1).collect();
    let angle = motion.dimension(Dimension::Angle).unit();
    let speed = motion.dimension(Dimension::AngularVelocity).unit();
    let mut group = Addition::new("points");
    let axis = &study.axes[0];
    group.attribute("number", axis.name.as_str());
    group.attribute("keys", axis.keys.join(" ").as_str());
    group.dimension("point", all.len(), "number of the point");
    let widest = |of: fn(&BranchPoint) -> usize| only.iter().map(|point| of(point)).max().unwrap_or(0);
    let (values, components) = (widest(|point| point.spectrum.len()), widest(|point| point.state.len()));
    group.dimension(
        "value",
        values,
        "number of the multiplier or eigenvalue, the most unstable first",
    );
    group.dimension("component", components, "number of the component of the state");
    let stabilities = flags(STABILITIES.map(CycleStability::name));
    let stability = |of: CycleStability| STABILITIES.iter().position(|one| *one == of).unwrap_or(0) as i8;
    let specials: Vec<_> = std::iter::once((-1, "none".to_owned()))
        .chain(flags(Special::ALL.map(Special::name)))
        .collect();
    let branches = all.iter().map(|one| one.0 as i64);
    let rows = FileRows::of(&only)
        .column(FileColumn::counts("branch", "the branch that it is of", branches))
        .numbers(&axis.name, axis.unit.unwrap_or("1"), axis.description, |one| one.value)
        .numbers("period", "s", PERIOD, |one| one.period)
        .numbers("amplitude", angle, "half of what the position sweeps", |one| {
            (one.position.1 - one.position.0) / 2.0
        })
        .numbers("least_position", angle, "least position", |one| one.position.0)
        .numbers("largest_position", angle, "largest position", |one| one.position.1)
        .numbers("least_relative_velocity", speed, "least omega_r", |one| {
            one.relative_velocity.0
        })
        .numbers("largest_relative_velocity", speed, "largest omega_r", |one| {
            one.relative_velocity.1
        })
        .codes("stability", "what becomes of small disturbances", &stabilities, |one| {
            stability(one.stability)
        })
        .counts("unstable", UNSTABLE, |one| one.unstable as i64)
        .codes("special", "what the point is special for", &specials, |one| {
            one.special.map_or(-1, Special::code)
        })
        .counts("sticks", "sticks in a period", |one| one.sticks as i64)
        .numbers(
            "shortest_stick",
            "s",
            "duration of the shortest stick; NaN: none",
            |one| one.shortest_stick,
        )
        .numbers("margin", "1", MARGIN, |one| one.margin)
        .column(sequences(&only))
        .numbers("time", "s", "phase of the drives where the state is", |one| one.time);
    group.over_each("point", rows);
    let padded = |values: Vec<f64>, length: usize| {
        let missing = length - values.len();
        values.into_iter().chain(std::iter::repeat_n(f64::NAN, missing))
    };
    let of_values = |of: fn(&(f64, f64)) -> f64| {
        let rows = only.iter().map(|point| point.spectrum.iter().map(of).collect());
        rows.flat_map(|row| padded(row, values)).collect::<Vec<f64>>()
    };
    let states = only.iter().flat_map(|point| padded(point.state.clone(), components));
    for (dimension, name, about, values) in [
        ("value", "real", REAL, of_values(|one| one.0)),
        ("value", "imaginary", IMAGINARY, of_values(|one| one.1)),
        ("component", "state", STATE, states.collect()),
    ] {
        group.over(&["point", dimension], FileColumn::numbers(name, "1", about, values));
    }
    group
}

fn sequences(points: &[&BranchPoint]) -> FileColumn {
    let mut sequences: Vec<String> = Vec::new();
    let code = |point: &&BranchPoint| {
        let word = match point.sequence.is_empty() {
            true => "none".to_owned(),
            false => point.sequence.replace(", ", "-"),
        };
        let found = sequences.iter().position(|other| *other == word).unwrap_or_else(|| {
            sequences.push(word);
            sequences.len() - 1
        });
        found.min(MOST_SEQUENCES) as i8
    };
    let codes: Vec<i8> = points.iter().map(code).collect();
    if sequences.len() > MOST_SEQUENCES {
        sequences.truncate(MOST_SEQUENCES);
        sequences.push("other".to_owned());
    }
    let words = flags(sequences.iter().map(String::as_str));
    FileColumn::codes("sequence", "events of a period", codes, words)
}

fn curves(study: &ContinuationStudy, explored: &Explored) -> Addition {
    let mut group = Addition::new("curves");
    let of_curves = explored.curves.iter().enumerate();
    let all: Vec<_> = of_curves
        .flat_map(|(index, curve)| curve.points.iter().map(move |point| (index, curve.special, point)))
        .collect();
    let specials = flags(Special::ALL.map(Special::name));
    let mut rows = FileRows::of(&all)
        .counts("curve", "the curve that it is of", |one| one.0 as i64)
        .codes("special", "special points of which kind", &specials, |one| one.1.code());
    for (k, axis) in study.axes.iter().take(2).enumerate() {
        rows = rows.numbers(&axis.name, axis.unit.unwrap_or("1"), axis.description, |one| {
            one.2.values[k]
        });
    }
    let rows = rows.numbers("curve_period", "s", "period of the cycle there", |one| one.2.period);
    group.rows("curve_point", "number of the point", rows);
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
        StoredContinuation::is_one(path)
    }

    /// Reads a continuation file.
    ///
    /// # Errors
    /// The file is missing, damaged, too new, or of another kind.
    pub fn read(path: &Path) -> Result<Stored, ResultError> {
        let file = StoredContinuation::open(path)?;
        let missing = |what: &str| stickslip_files::Reason::Missing(what.to_owned()).of(path);
        let (points, branches) = (file.table("points")?, file.table("branches")?);
        let text = |name: &str| file.text_attribute("points", name)?.ok_or_else(|| missing(name));
        let (number, keys) = (text("number")?, text("keys")?);
        let of = |name: &str| points.column(name);
        let owner = of("branch")?;
        let count = owner.len();
        let (value, period, time) = (of(&number)?, of("period")?, of("time")?);
        let (low, high) = (of("least_position")?, of("largest_position")?);
        let (slow, fast) = (of("least_relative_velocity")?, of("largest_relative_velocity")?);
        let (stability, unstable, special) = (of("stability")?, of("unstable")?, of("special")?);
        let (sticks, shortest, margin) = (of("sticks")?, of("shortest_stick")?, of("margin")?);
        let sequence = of("sequence")?;
        let sequences = file.words("points/sequence")?;
        let ((real, values), (imaginary, others)) = (points.matrix("real")?, points.matrix("imaginary")?);
        let (states, components) = points.matrix("state")?;
        if values != others {
            return Err(missing("imaginary part of every value of points/real"));
        }
        let point = |k: usize| {
            let spectrum = (k * values..(k + 1) * values).map(|at| (real[at], imaginary[at]));
            let state = states[k * components..(k + 1) * components].iter().copied();
            BranchPoint {
                value: value[k],
                period: period[k],
                position: (low[k], high[k]),
                relative_velocity: (slow[k], fast[k]),
                stability: STABILITIES[(stability[k] as usize).min(2)],
                unstable: unstable[k] as usize,
                spectrum: spectrum.filter(|one| !one.0.is_nan()).collect(),
                sticks: sticks[k] as usize,
                shortest_stick: shortest[k],
                margin: margin[k],
                sequence: sequences
                    .iter()
                    .find(|one| one.0 == sequence[k] as i64)
                    .map_or_else(String::new, |one| one.1.clone()),
                special: (special[k] >= 0.0)
                    .then(|| Special::ALL.get(special[k] as usize).copied())
                    .flatten(),
                time: time[k],
                state: state.filter(|one| !one.is_nan()).collect(),
            }
        };
        let (what, end) = (branches.column("what")?, branches.column("end")?);
        let (multiple, parent) = (branches.column("multiple")?, branches.column("parent")?);
        let branches = (0..what.len()).map(|index| Branch {
            steady: what[index] == 0.0,
            multiple: (multiple[index] > 0.0).then_some(multiple[index] as u32),
            parent: (parent[index] >= 0.0).then_some((parent[index] as usize, 0)),
            points: (0..count).filter(|&k| owner[k] as usize == index).map(point).collect(),
            end: EndReason::ALL[(end[index] as usize).min(EndReason::ALL.len() - 1)],
        });
        let branches = branches.collect();
        let mut curves: Vec<(Special, Vec<[f64; 2]>)> = Vec::new();
        let mut second = None;
        let names = file.members("curves")?;
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
            second = Some((other.clone(), file.unit(&format!("curves/{other}"))?));
        }
        let settings = file.input("settings")?;
        Ok(Stored {
            title: file.title()?,
            complete: file.status()? == Status::Complete.name(),
            modes_command: file.text_attribute("meta", META_POINT_COMMAND)?,
            number: (
                number.clone(),
                keys.split(' ').map(str::to_owned).collect(),
                file.unit(&format!("points/{number}"))?,
            ),
            second,
            branches,
            curves,
            case: (file.input("case")?, settings.lines().map(str::to_owned).collect()),
            angle: file.unit("points/amplitude")?,
            speed: file.unit("points/largest_relative_velocity")?,
        })
    }
}
