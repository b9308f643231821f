//! From a study to the file of a continuation, with a journal next to it, and back.

use super::ending::EndReason;
use super::explore::{Branch, BranchPoint, Explored, Explorer};
use super::special::Special;
use super::study::ContinuationStudy;
use crate::analysis::Deadline;
use crate::cycle::{CycleStability, Family, in_units};
use crate::error::Error;
use crate::provenance;
use crate::study::StudyRun;
use crate::sweep::journal_path;
use std::path::{Path, PathBuf};
use std::time::Instant;
use stickslip_case::Motion;
use stickslip_files::schema::{CONTINUATION_FORMAT, META_POINT_COMMAND, Variable};
use stickslip_files::{
    Addition, AttributeValue, DeclaredColumn, FileColumn, FileKind, Reservation, ResultError, Status, StudyFile,
    StudyHeader, columns, partial_path,
};
use stickslip_system::quote::in_shell;

const MOST_SEQUENCES: usize = 127;

/// Result of a continuation.
#[derive(Debug)]
pub struct ContinuationReport {
    /// Path of the file.
    pub file: PathBuf,
    /// The branches.
    pub explored: Explored,
}

/// Builder of a continuation; [`Continuation::start`] follows the branches into its file.
pub type Continuation<'a> = StudyRun<'a, ContinuationStudy>;

impl Continuation<'_> {
    /// Follows the branches, at most for `solver.max_wall_time` of the base case. Points first go to a journal next to
    /// the file. An interrupted continuation leaves a partial file and can resume from the journal.
    ///
    /// # Errors
    /// There is no start, the file is protected, or the disk fails.
    pub fn start(self) -> Result<ContinuationReport, Error> {
        let (study, watch) = (self.study, self.watch);
        let (digest, header) = (study.digest(), header(study));
        let place = self.place(FileKind::Branches, &header, Some(&digest), &study.head.files)?;
        let begin = Instant::now();
        let written = study.written()?;
        let motion = written.case().motion();
        let deadline = Deadline::after(begin, written.case().solver.max_wall_time);
        let family = Family::new(written, &[study.axes[0].keys.clone()])?;
        let at = journal_path(self.path);
        let mut journal = self.journal(&digest)?;
        let stop = || watch.stopped() || deadline.is_over();
        let told = |explored: &Explored| {
            let last = explored.branches.last().and_then(|branch| branch.points.last());
            let (branch, points) = (explored.branches.len().saturating_sub(1), explored.points());
            let value = last.map_or(f64::NAN, |point| point.value);
            let what = format_args!("branch {branch}, {points} points, at {value:.9}");
            let _ = watch.at(points as f64, points as f64, what);
        };
        let explored = Explorer::new(study, &family, &mut journal, &stop, &told).explore();
        if explored.is_err() && journal.points() == 0 {
            let _ = std::fs::remove_file(&at);
        }
        let explored = explored?;
        let file = write(study, motion, &explored, &place)?;
        drop(journal);
        if !explored.interrupted {
            // Removes what an interruption left.
            let _ = std::fs::remove_file(partial_path(self.path));
            let _ = std::fs::remove_file(&at);
        }
        Ok(ContinuationReport { file, explored })
    }
}

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
    Variable::words("stability", "stability: growth of small disturbances", CycleStability::codes()),
        f64::from(p.stability as i8), p.stability = CycleStability::ALL[(x as usize).min(2)];
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

/// Columns of /branches. The first point, which depends on the other branches, is not among them.
const BRANCH_COLUMNS: &[DeclaredColumn<Branch>] = &columns! { branch, x:
    Variable::words("what", "what is followed", flags(["steady", "cycle"])),
        (!branch.steady).into(), branch.steady = x == 0.0;
    Variable::words("end", "why it ends", EndReason::codes()),
        f64::from(branch.end as i8), branch.end = EndReason::of_code(x);
    Variable::count("points", "how many points it has"), branch.points.len() as f64, _ = (branch, x);
    Variable::count("multiple", "drive periods in one of its cycles; -1: autonomous, or steady sliding"),
        branch.multiple.map_or(-1.0, f64::from), branch.multiple = (x > 0.0).then_some(x as u32);
    Variable::count("parent", "the branch at whose special point it starts; -1: none"),
        branch.parent.map_or(-1.0, |parent| parent.0 as f64),
        branch.parent = (x >= 0.0).then_some((x as usize, 0));
};

fn words_of_specials() -> Vec<(i64, String)> {
    let none = (-1, "none".to_owned());
    std::iter::once(none)
        .chain(flags(Special::ALL.map(Special::name)))
        .collect()
}

fn flags<'a>(words: impl IntoIterator<Item = &'a str>) -> Vec<(i64, String)> {
    (0..).zip(words.into_iter().map(str::to_owned)).collect()
}

fn write(
    study: &ContinuationStudy,
    motion: Motion,
    explored: &Explored,
    place: &Reservation,
) -> Result<PathBuf, ResultError> {
    let groups = [
        branches(explored),
        points(study, motion, explored),
        curves(study, explored),
    ];
    header(study).write(CONTINUATION_FORMAT, &groups, place, &Status::of(explored.interrupted))
}

fn header(study: &ContinuationStudy) -> StudyHeader {
    let head = &study.head;
    let mut meta: Vec<(String, AttributeValue)> = provenance::build();
    meta.push(("study_digest".to_owned(), AttributeValue::Text(study.digest())));
    meta.extend(provenance::point_command(modes_command(study)));
    let settings: Vec<String> = head.settings.iter().map(stickslip_case::Override::argument).collect();
    let about = "overrides of the case, KEY=VALUE in each line";
    StudyHeader {
        inputs: vec![
            ("case", "the base case as it was given (TOML)", head.base.text.clone()),
            ("settings", about, settings.join("\n")),
        ],
        meta,
        ..head.of_file(format!("stickslip continue {}", head.source.name))
    }
}

fn modes_command(study: &ContinuationStudy) -> String {
    let base = study.head.source.named(&study.head.base);
    let settings = study.head.settings.iter();
    let settings = settings.map(|setting| format!(" --set {}", in_shell(&setting.argument())));
    format!("stickslip modes {}{}", in_shell(&base), settings.collect::<String>())
}

fn branches(explored: &Explored) -> Addition {
    let all = &explored.branches;
    let mut group = Addition::new("branches");
    group.dimension("branch", all.len(), "number of the branch");
    let mut first = 0;
    let firsts = all.iter().map(|branch| {
        first += branch.points.len() as i64;
        first - branch.points.len() as i64
    });
    let firsts = FileColumn::counts("first_point", "its first point", firsts);
    let (before, after) = BRANCH_COLUMNS.split_at(2);
    let before = before.iter().map(|column| column.of(all));
    let after = after.iter().map(|column| column.of(all));
    let columns = before.chain([firsts]).chain(after);
    columns.for_each(|column| group.over(&["branch"], column));
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
    let about = "number of the multiplier or eigenvalue, the most unstable first";
    group.dimension("value", values, about);
    group.dimension("component", components, "number of the component of the state");
    let mut add = |column: FileColumn| group.over(&["point"], column);
    let owners = all.iter().map(|one| one.0 as i64);
    add(FileColumn::counts("branch", "index of the branch of the point", owners));
    add(axis.column(only().map(|point| point.value)));
    let in_units = |declared: &DeclaredColumn<BranchPoint>| FileColumn {
        variable: in_units((declared.variable)(), motion),
        ..declared.of(only())
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
    let states = FileColumn::numbers("state", "1", about, states);
    group.over(&["point", "component"], states);
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
    let (about, words) = ("special points of which kind", flags(Special::ALL.map(Special::name)));
    let codes = all.iter().map(|one| one.1.code());
    add(FileColumn::codes("special", about, codes, words));
    for (k, axis) in study.axes.iter().take(2).enumerate() {
        add(axis.column(all.iter().map(|one| one.2.values[k])));
    }
    let (about, periods) = ("period of the cycle there", all.iter().map(|one| one.2.period));
    add(FileColumn::numbers("curve_period", "s", about, periods));
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
    /// Overrides that are not in the study, in words.
    pub changed: Vec<String>,
    /// Unit of positions.
    pub angle: String,
    /// Unit of relative velocities.
    pub speed: String,
}

impl Stored {
    /// Whether the file at `path` is a continuation.
    pub fn is_one(path: &Path) -> bool {
        StudyFile::is(path, CONTINUATION_FORMAT)
    }

    /// Reads a continuation file.
    ///
    /// # Errors
    /// The file is missing, damaged, too new, or of another kind.
    pub fn read(path: &Path) -> Result<Stored, ResultError> {
        let file = StudyFile::open(path, CONTINUATION_FORMAT)?;
        let missing = |what: &str| stickslip_files::Reason::Missing(what.to_owned()).of(path);
        let (points, branches) = (file.table("points")?, file.table("branches")?);
        let given = |path: &str| Ok::<_, ResultError>(file.text(path)?.unwrap_or_default());
        let unit = |variable: &str| Ok::<_, ResultError>(file.variable(variable)?.units);
        let text = |name: &str| file.text(&format!("points/{name}"))?.ok_or_else(|| missing(name));
        let (number, keys) = (text("number")?, text("keys")?);
        let owner = points.column("branch")?;
        let (value, sequence) = (points.column(&number)?, points.column("sequence")?);
        let mut all = vec![BranchPoint::default(); owner.len()];
        for column in POINT_COLUMNS {
            column.read(&points, &mut all)?;
        }
        let sequences = file.variable("points/sequence")?.flags;
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
        let mut found = vec![Branch::default(); branches.column("what")?.len()];
        for column in BRANCH_COLUMNS {
            column.read(&branches, &mut found)?;
        }
        for (owner, point) in owner.iter().zip(all) {
            if let Some(branch) = found.get_mut(*owner as usize).filter(|_| *owner >= 0.0) {
                branch.points.push(point);
            }
        }
        let mut curves: Vec<(Special, Vec<[f64; 2]>)> = Vec::new();
        let mut second = None;
        let known = ["curve_point", "curve", "special", "curve_period", &number];
        let mut names = file.names("curves")?;
        names.retain(|name| !known.contains(&name.as_str()));
        if let Some(other) = names.first() {
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
        Ok(Stored {
            title: given("title")?,
            complete: given("status")? == Status::Complete.name(),
            modes_command: file.text(&format!("meta/{META_POINT_COMMAND}"))?,
            number: (
                number.clone(),
                keys.split(' ').map(str::to_owned).collect(),
                unit(&format!("points/{number}"))?,
            ),
            second,
            branches: found,
            curves,
            case: (input("case")?, settings.lines().map(str::to_owned).collect()),
            changed: file.changed(),
            angle: unit("points/amplitude")?,
            speed: unit("points/largest_relative_velocity")?,
        })
    }
}
