//! A corpus of candidates with what `compare` must say of each, and what it must not: `corpus.txt` is the table.
//!
//! A candidate is made by words, in this order: a run of this program with other settings (`KEY=VALUE`), or else a bare solver, with a
//! fault (`tanh:1e-3`); what it writes (`columns:phi1,phi1_dot`); what happens to its file (`digits:6`).

use super::filing::Filing;
use super::subject::{Subject, solve};
use super::written::{Columns, Written, columns};
use crate::common::cases::{parsed, source};
use crate::common::planted_solver::{Method, Smooth, Solver};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

use stickslip::SavedRun;
use stickslip::case::{Case, CaseSource};
use stickslip::compare::Comparison;
use stickslip::friction::Law;
use stickslip::results::{Overwrite, ResultFile};

/// A row of the table: a name, the reference, the candidate, what must be said, and what must not.
struct Row {
    name: String,
    reference: String,
    candidate: String,
    said: String,
    never: String,
}

fn table() -> Vec<Row> {
    let lines = include_str!("corpus.txt").lines();
    let lines = lines.filter(|line| !line.trim().is_empty() && !line.starts_with('#'));
    let row = |line: &str| {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let [name, reference, candidate, said, never] =
            cells[..].try_into().unwrap_or_else(|_| panic!("five cells: {line}"));
        let [name, reference, candidate, said, never] = [name, reference, candidate, said, never].map(str::to_owned);
        Row {
            name,
            reference,
            candidate,
            said,
            never,
        }
    };
    lines.map(row).collect()
}

/// A reference: a built-in case, or a file of the folder `corpus`, with settings.
fn subject(reference: &str, folder: &Path) -> Subject {
    let mut words = reference.split_whitespace();
    let name = words.next().unwrap();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/property/planted/corpus/{name}.toml"));
    let of = match std::fs::read_to_string(file) {
        Ok(text) => source(&text),
        Err(_) => CaseSource::built_in(name).unwrap(),
    };
    let settings: Vec<&str> = words.collect();
    let case = Case::read(&of, &parsed(&settings)).unwrap();
    let name = reference.replace(['/', ' ', '"', '{', '}'], "_");
    Subject::of(name, source(&case.resolved()), folder).unwrap()
}

fn number(text: &str) -> f64 {
    text.parse().unwrap_or_else(|_| panic!("{text} is no number"))
}

fn pair(text: &str) -> (&str, f64) {
    let (name, value) = text.split_once(',').unwrap_or_else(|| panic!("NAME,NUMBER: {text}"));
    (name, number(value))
}

/// The columns of a candidate; the first is the time.
type Made = (Vec<String>, Vec<Vec<f64>>);

/// The columns of a run of the program.
fn by_program(subject: &Subject, settings: &[&str], names: &[String], folder: &Path) -> Made {
    let case = Case::read(&subject.source, &parsed(&[settings, &["output.around=none"]].concat())).unwrap();
    let path = folder.join("other.h5");
    SavedRun::new(&case, &path).overwrite(Overwrite::Force).start().unwrap();
    let file = ResultFile::open(&path).unwrap();
    let rows = file.sample_count().unwrap();
    let vocabulary = subject.vocabulary();
    let column = |name: &String| {
        let channel = vocabulary.find(name).and_then(|channel| vocabulary.canonical(channel));
        let stored = channel.map_or(name.clone(), |channel| channel.name().into_owned());
        file.column(&stored, 0..rows).unwrap()
    };
    let all: Vec<String> = ["time".to_owned()].iter().chain(names).cloned().collect();
    let values = all.iter().map(column).collect();
    (all, values)
}

/// The columns of a bare solver with a fault.
fn by_solver(subject: &Subject, words: &[(&str, &str)], interval: f64, names: &[String]) -> Made {
    let mut solver = Solver::sound(&subject.case.system);
    for &(word, value) in words {
        match word {
            "tanh" | "arctan" | "ratio" => {
                let function = match word {
                    "tanh" => Smooth::Tanh,
                    "arctan" => Smooth::Arctan,
                    _ => Smooth::Ratio,
                };
                solver.smooth = Some((function, number(value)));
            }
            "step" => solver.step = number(value),
            "ends" => (solver.located, solver.step) = (false, number(value)),
            "late-slips" => (solver.late_slips, solver.step) = (true, number(value)),
            "late" => {
                let (place, late) = pair(value);
                solver.late = Some((place.parse().unwrap(), late));
            }
            "skips" => solver.skipped = Some(value.parse().unwrap()),
            "band" => solver.band = number(value),
            "limit" => solver.breakaway = number(value),
            "ahead" => solver.ahead = number(value),
            "torque" => solver.torque = number(value),
            "euler" => (solver.method, solver.step) = (Method::SemiImplicitEuler, number(value)),
            "midpoint" => (solver.method, solver.step) = (Method::Rk2, number(value)),
            _ => panic!("{word}: no fault of a solver"),
        }
    }
    if let Some((_, eps)) = solver.smooth {
        let case = &subject.case.system;
        let inertia = [&case.rotor, &case.stator]
            .into_iter()
            .filter_map(|train| train.inertia.first());
        let least = inertia.copied().fold(f64::INFINITY, f64::min);
        let force = case.law.at_vanishing_speed() * case.radius * subject.largest_normal_force();
        // Stable in a stick.
        solver.step = solver.step.min(0.4 * eps * least / force);
    }
    let solved = solve(subject, &solver, None, &Written::sound(interval)).unwrap();
    let known = columns(subject, &solver, Columns::Plain);
    let mut made = (
        vec!["time".to_owned()],
        vec![solved.rows.iter().map(|row| row.0).collect()],
    );
    let vocabulary = subject.vocabulary();
    let channel = |name: &str| vocabulary.find(name).and_then(|channel| vocabulary.canonical(channel));
    for name in names {
        let same = known.iter().find(|(_, known)| channel(known) == channel(name));
        let (index, _) = same.unwrap_or_else(|| panic!("{name} in {known:?}"));
        made.0.push(name.clone());
        made.1.push(
            solved
                .rows
                .iter()
                .map(|(t, y, doing)| solver.row(*t, y, *doing)[*index])
                .collect(),
        );
    }
    made
}

/// What is said of a candidate that is made by words.
fn judged(subject: &Subject, candidate: &str, folder: &Path) -> Comparison {
    let mut settings = Vec::new();
    let (mut faults, mut after) = (Vec::new(), Vec::new());
    let mut interval = subject.case.output.interval;
    let sound = Solver::sound(&subject.case.system);
    let mut names: Vec<String> = columns(subject, &sound, Columns::Plain)
        .into_iter()
        .map(|(_, name)| name)
        .collect();
    let mut mapping = subject.reference.mapping();
    for word in candidate.split_whitespace() {
        match word.split_once(':').filter(|_| !word.contains('=')) {
            None => settings.push(word),
            Some(("every", value)) => interval = number(value),
            Some(("columns", value)) => names = value.split(',').map(str::to_owned).collect(),
            Some(("tolerance", value)) => mapping.velocity_tolerance = Some(number(value)),
            Some(word @ ("digits" | "decimals" | "multiples" | "single" | "delay" | "times", _)) => after.push(word),
            Some(word @ ("clock" | "add" | "average" | "same" | "low-pass" | "half-step" | "swap" | "repeat", _)) => {
                after.push(word)
            }
            Some(word) => faults.push(word),
        }
    }
    let halves = after.iter().any(|(word, _)| *word == "half-step");
    let interval = if halves { 0.5 * interval } else { interval };
    let of_halves = format!("output.interval={interval:e}");
    settings.extend(halves.then_some(of_halves.as_str()));
    let (names, mut values) = match faults.is_empty() {
        true => by_program(subject, &settings, &names, folder),
        false => by_solver(subject, &faults, interval, &names),
    };
    let place = |name: &str| {
        names
            .iter()
            .position(|known| known == name)
            .unwrap_or_else(|| panic!("{name} in {names:?}"))
    };
    let mut write: Box<dyn Fn(f64) -> String> = Box::new(|value| format!("{value:?}"));
    for (word, value) in after {
        match word {
            "digits" => {
                let digits: usize = value.parse().unwrap();
                write = Box::new(move |value| format!("{value:.*e}", digits - 1));
            }
            "decimals" => {
                let decimals: usize = value.parse().unwrap();
                write = Box::new(move |value| format!("{value:.decimals$}"));
            }
            "single" => values
                .iter_mut()
                .flatten()
                .for_each(|value| *value = f64::from(*value as f32)),
            "multiples" => {
                let (name, unit) = pair(value);
                values[place(name)]
                    .iter_mut()
                    .for_each(|value| *value = (*value / unit).round() * unit);
            }
            "delay" => values[0].iter_mut().for_each(|time| *time += number(value)),
            "times" => {
                let (name, by) = pair(value);
                values[place(name)].iter_mut().for_each(|value| *value *= by);
            }
            _ => {
                let column = |name: &str| place(name) - 1;
                let filing = match word {
                    "clock" => Filing::Rate(number(value)),
                    "add" => {
                        let (name, by) = pair(value);
                        Filing::Offset(column(name), by)
                    }
                    "average" => Filing::Average(value.parse().unwrap()),
                    "same" => Filing::Same(value.parse().unwrap()),
                    "low-pass" => Filing::LowPass(number(value)),
                    "half-step" => Filing::HalfStep(value.parse().unwrap()),
                    "swap" => {
                        let (one, other) = value.split_once(',').unwrap();
                        Filing::Swapped(column(one), column(other))
                    }
                    "repeat" => Filing::Repeated(value.parse().unwrap()),
                    _ => unreachable!(),
                };
                let (time, columns) = values.split_first_mut().unwrap();
                let names: Vec<&str> = names[1..].iter().map(String::as_str).collect();
                filing.apply(time, columns, &names);
            }
        }
    }
    let mut text = names.join(",") + "\n";
    for row in 0..values[0].len() {
        let cells: Vec<String> = values.iter().map(|column| write(column[row])).collect();
        writeln!(text, "{}", cells.join(",")).unwrap();
    }
    let path = folder.join("candidate.csv");
    std::fs::write(&path, text).unwrap();
    subject.reference.compare(&path, &mapping).unwrap()
}

/// What is wrong in what was said, if something is.
fn wrong(row: &Row, c: &Comparison) -> Option<String> {
    let causes = c
        .causes
        .iter()
        .map(|one| format!("{}: {}", one.cause.name(), one.evidence));
    let causes = causes.collect::<Vec<_>>().join(" | ");
    println!(
        "{}: {}\n    {}",
        row.name,
        if causes.is_empty() { "nothing" } else { &causes },
        c.verdict
    );
    let words = |cell: &str| -> Vec<String> {
        let words = cell.split('&').map(|word| word.trim().to_owned());
        words.filter(|word| !word.is_empty()).collect()
    };
    let silent = row.said.starts_with("nothing");
    if silent && !causes.is_empty() {
        return Some(format!("{}: {causes}", row.name));
    }
    let lacks = words(&row.said)
        .into_iter()
        .filter(|word| !silent && !causes.contains(word.as_str()));
    let lacks: Vec<String> = lacks.collect();
    // What explains less is no cause, but is named.
    let verdict = c.verdict.split("; the closest").next().unwrap_or_default();
    let has = words(&row.never).into_iter();
    let has: Vec<String> = has
        .filter(|word| causes.contains(word.as_str()) || verdict.contains(word.as_str()))
        .collect();
    (!lacks.is_empty() || !has.is_empty()).then(|| format!("{}: lacks {lacks:?}, has {has:?}: {}", row.name, c.verdict))
}

fn judge(wanted: impl Fn(&str) -> bool) {
    let folder = tempfile::tempdir().unwrap();
    let mut subjects: BTreeMap<String, Subject> = BTreeMap::new();
    let mut faults = Vec::new();
    assert!(
        table().iter().any(|row| wanted(&row.name)),
        "no row of the corpus has this name"
    );
    for row in table().iter().filter(|row| wanted(&row.name)) {
        let of = subjects
            .entry(row.reference.clone())
            .or_insert_with(|| subject(&row.reference, folder.path()));
        faults.extend(wrong(row, &judged(of, &row.candidate, folder.path())));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// `STICKSLIP_CORPUS=clock` takes the rows whose names have this word.
#[test]
#[ignore = "long: a search for the cause of each candidate"]
fn property_long_what_is_said_of_the_corpus() {
    let wanted = std::env::var("STICKSLIP_CORPUS").unwrap_or_default();
    judge(|name| name.contains(&wanted));
}

/// Some of it.
#[test]
fn property_what_is_said_of_a_few_of_the_corpus() {
    judge(|name| ["both-coefficients", "offset-of-a-belt", "block-at-rest"].contains(&name));
}
