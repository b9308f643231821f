//! Which commands work for which case: the tables of docs/validation/capabilities.md, filled in by the program itself. A cell
//! contains a number, or the sentence with which the program says why there is none.
//!
//! `STICKSLIP_WRITE=1 cargo test --release --test cli capabilities:: -- --ignored` writes the tables again.

use crate::common::json::*;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use std::time::Duration;

use crate::common::cli::Folder;
use serde_json::Value;

/// A built-in case and two of its parameters. The first is changed; the second is the other axis of a boundary.
struct Subject {
    case: &'static str,
    number: (&'static str, f64),
    second: (&'static str, f64),
}

const fn subject(case: &'static str, number: (&'static str, f64), second: (&'static str, f64)) -> Subject {
    Subject { case, number, second }
}

const FORCE: &str = "contact.normal_force";
const RAMP: &str = "contact.normal_force.value";

const SUBJECTS: [Subject; 16] = [
    subject("paper", ("friction.decay", 5.0), ("actuation.force", 2224.1)),
    subject("paper-si", ("friction.decay", 3.5), ("actuation.force", 2225.0)),
    subject("unperturbed", ("friction.decay", 3.5), ("actuation.force", 2225.0)),
    subject("release", ("friction.decay", 3.5), ("torsion.rotor_inertia", 2.26)),
    subject("belt-coulomb", (FORCE, 10.0), ("stator.inertia.0", 1.0)),
    subject("belt-leine", (FORCE, 1.0), ("stator.inertia.0", 1.0)),
    subject("belt-leine-arctan", (FORCE, 1.0), ("stator.inertia.0", 1.0)),
    subject("belt-leine-tanh", (FORCE, 1.0), ("stator.inertia.0", 1.0)),
    subject("belt-exponential", (FORCE, 10.0), ("stator.inertia.0", 1.0)),
    subject("block", (FORCE, 9.81), ("rotor.inertia.0", 1.0)),
    subject("hairer", (FORCE, 4.0), ("stator.inertia.0", 1.0)),
    subject("den-hartog", (FORCE, 1.0), ("stator.inertia.0", 1.0)),
    subject("groan", (RAMP, 4000.0), ("stator.inertia.0", 0.35)),
    subject("drill-string", (FORCE, 53018.0), ("rotor.inertia.0", 374.0)),
    subject("clutch", (RAMP, 5000.0), ("rotor.inertia.0", 0.2)),
    subject("lugre-slider", (FORCE, 1.0), ("rotor.inertia.0", 1.0)),
];

/// Longest text in a cell. Longer texts become notes below their table.
const LONGEST_CELL: usize = 40;

/// The tables of the page: a marker and the columns.
const TABLES: [(&str, &[&str]); 6] = [
    (
        "runs",
        &["series", "cvode", "cvode-bdf", "erk", "esdirk", "paper", "rk4"],
    ),
    ("truth", &["true to the exact solution", "error bands", "sensitivities"]),
    (
        "stability",
        &["modes", "growth exponent", "kick at the instability", "one-sided test"],
    ),
    (
        "studies",
        &[
            "compare",
            "a changed number",
            "work-precision",
            "sweep",
            "calibrate",
            "boundary",
        ],
    ),
    ("cycles", &["cycle", "events of a period", "multipliers"]),
    ("pictures", &["figures", "page", "columns of an export"]),
];

struct Trial {
    folder: Folder,
    subject: &'static Subject,
    /// The document of `run` with `series`, whose result is series.h5.
    series: Value,
    cells: BTreeMap<&'static str, String>,
}

impl Trial {
    /// The document that the program prints with `--json`, or the reason for its refusal.
    fn document(&self, arguments: &[&str]) -> Result<Value, String> {
        let mut command = self.folder.stickslip(arguments);
        command.args(["--json", "--quiet"]).timeout(Duration::from_secs(600));
        let output = command.output().unwrap();
        let document: Value = serde_json::from_slice(&output.stdout)
            .unwrap_or_else(|error| panic!("{}: {arguments:?}: {error}", self.subject.case));
        match output.status.code() {
            Some(0) => Ok(document),
            Some(1 | 2) => Err(reason(&document["error"])),
            other => panic!("{}: {arguments:?}: {other:?}", self.subject.case),
        }
    }

    fn run(&self, arguments: &[&str]) -> Result<Value, String> {
        let mut all = vec!["run", self.subject.case, "--no-witness"];
        all.extend(arguments);
        self.document(&all)
    }

    /// Number of events of a run, or the reason why there are none.
    fn events(&self, arguments: &[&str]) -> String {
        match self.run(arguments) {
            Ok(document) if document["summary"]["noise_determined"] == true => "others".to_owned(),
            Ok(document) => match unheard(&document) {
                Some(why) => why,
                None => document["summary"]["events"].to_string(),
            },
            Err(reason) => reason,
        }
    }

    fn cell(&mut self, column: &'static str, text: impl Into<String>) {
        self.cells.insert(column, text.into());
    }

    fn runs(&mut self) {
        self.series = self.run(&["--method", "series", "-o", "series.h5"]).unwrap();
        self.cell("series", self.series["summary"]["events"].to_string());
        let step = match self.subject.case {
            "paper" | "paper-si" | "unperturbed" | "release" => "solver.step=2e-6",
            "groan" | "lugre-slider" => "solver.step=1e-5",
            _ => "solver.step=1e-4",
        };
        for method in ["cvode", "cvode-bdf", "erk", "esdirk", "paper", "rk4"] {
            let name = format!("{method}.h5");
            let mut arguments = vec!["--method", method, "-o", &name];
            if method == "rk4" {
                arguments.extend(["--set", step]);
            }
            let events = self.events(&arguments);
            // How many events amplified errors make hangs on the last bit, and so on the machine.
            let others = events.parse::<u32>().is_ok() && events != self.cells["series"];
            self.cell(method, if others { "others".to_owned() } else { events });
        }
    }

    fn truth(&mut self) {
        // With bristles of 1e5 per metre the exact solution needs steps of microseconds. The first 12 s of its 30 s
        // take half a minute less.
        if self.subject.case == "lugre-slider" {
            let end = ["--method", "series", "-o", "truth.h5", "--set", "output.end_time=12"];
            self.run(&end).unwrap();
        }
        let run = if self.folder.path("truth.h5").exists() {
            "truth.h5"
        } else {
            "series.h5"
        };
        let found = self
            .document(&["certify", run, "--oracle", "-o", "certified.h5"])
            .unwrap();
        let events = found["events"].list();
        let converged = events.iter().filter(|event| event["verdict"] == "converged").count();
        self.cell("true to the exact solution", format!("{converged} of {}", events.len()));
        let bands = found["channels"].list();
        let bands = bands.iter().filter(|channel| channel["band"].is_number()).count();
        self.cell("error bands", bands.to_string());
        let numbers = found["sensitivity"].list();
        self.cell("sensitivities", numbers.len().to_string());
    }

    fn stability(&mut self) {
        let modes = self.document(&["modes", self.subject.case]).unwrap();
        let states = modes["states"].list().iter();
        let count: usize = states.map(|state| state["modes"].list().len()).sum();
        self.cell("modes", count.to_string());
        let growth = match self.series["summary"]["growth_exponent"].as_f64() {
            Some(growth) => format!("{growth:.1}"),
            None => "sliding does not slow down to an instability by itself".to_owned(),
        };
        self.cell("growth exponent", growth);
        let kick = "perturbation=[{kind=\"kick\",time=\"instability\",relative_velocity=1e-3}]";
        let kicked = self.events(&["--method", "series", "-o", "kick.h5", "--set", kick]);
        self.cell("kick at the instability", kicked);
        let one_sided = self.events(&[
            "--method",
            "series",
            "-o",
            "one.h5",
            "--set",
            "contact.breakaway_test=rotor",
        ]);
        self.cell("one-sided test", one_sided);
    }

    fn studies(&mut self) {
        let Subject { case, number, second } = self.subject;
        let by_erk = self.document(&["compare", "series.h5", "erk.h5"]).unwrap();
        self.cell("compare", matched(&by_erk));
        let changed = format!("{}={}", number.0, number.1 * 1.02);
        self.run(&["--method", "series", "-o", "changed.h5", "--set", &changed])
            .unwrap();
        // A candidate from another program has columns, but no case.
        self.document(&["export", "changed.h5", "-o", "changed.csv"]).unwrap();
        let said = self.document(&["compare", "series.h5", "changed.csv"]).unwrap();
        let causes = said["comparisons"][0]["causes"].list().iter();
        let causes: Vec<&str> = causes.map(|cause| cause["cause"].text()).collect();
        self.cell(
            "a changed number",
            if causes.is_empty() {
                "nothing is said".to_owned()
            } else {
                causes.join(", ")
            },
        );

        let head = format!("case = \"{case}\"\n");
        self.folder.write(
            "precision.toml",
            head.clone()
                + "[[series]]\nmethods = [\"series\", \"erk\"]\ntolerances = [1e-6, 1e-9]\n\
                   [reference]\nmethod = \"series\"\ncheck = \"cvode\"\nrtol = 1e-12\n",
        );
        let cell = match self.document(&["work-precision", "precision.toml"]) {
            Ok(document) => format!("{} runs", document["runs"].list().len()),
            Err(reason) => reason,
        };
        self.cell("work-precision", cell);

        let summary = &self.series["summary"];
        // Runs of a study end soon after they have the requested quantity. Without sticks this is the amplitude.
        let (quantity, value, end) = match summary["onset_time"].as_f64() {
            Some(onset) => ("onset_time", onset, 1.2 * onset),
            None => {
                let amplitude = summary["outcome"]["extremes"]["amplitude"].number();
                ("attractor_amplitude", amplitude, summary["end"].number())
            }
        };
        let set = format!("[set]\nsolver.method = \"series\"\noutput.end_time = {end}\n");
        let axis = |key: &str, value: f64, count: u32| {
            format!(
                "[[axis]]\nkey = \"{key}\"\nfrom = {}\nto = {}\ncount = {count}\n",
                0.97 * value,
                1.02 * value
            )
        };
        let swept = format!("{head}{set}{}", axis(number.0, number.1, 2));
        self.folder.write("swept.toml", swept);
        let cell = match self.document(&["sweep", "swept.toml"]) {
            Ok(document) => format!("{} points, {} failed", document["points"], document["failed"]),
            Err(reason) => reason,
        };
        self.cell("sweep", cell);

        let free = format!(
            "{head}{set}[[free]]\nkey = \"{}\"\nfrom = {}\nto = {}\n\
             [[target]]\nquantity = \"{quantity}\"\nvalue = {value:?}\nhalf_width = {}\n[search]\npoints = 16\nstarts = 1\n",
            number.0,
            0.97 * number.1,
            1.02 * number.1,
            1e-4 * value,
        );
        self.folder.write("found.toml", free);
        let cell = match self.document(&["calibrate", "found.toml"]) {
            Ok(document) if document["consistent"] == true => "found".to_owned(),
            Ok(_) => "not found".to_owned(),
            Err(reason) => reason,
        };
        self.cell("calibrate", cell);

        let boundary = format!(
            "{head}{set}{}{}[boundary]\nx = \"{}\"\ny = \"{}\"\ncriterion = \"{quantity} > {value:?}\"\nrefinements = 0\nwidth = 1e-3\n",
            axis(number.0, number.1, 3),
            axis(second.0, second.1, 3),
            number.0,
            second.0,
        );
        self.folder.write("limit.toml", boundary);
        let cell = match self.document(&["sweep", "limit.toml"]) {
            Ok(document) => match document["curves"].as_array() {
                Some(curves) => format!("curves: {}", curves.len()),
                None => "none in this range".to_owned(),
            },
            Err(reason) => reason,
        };
        self.cell("boundary", cell);
    }

    fn cycles(&mut self) {
        let found = self.document(&["cycle", self.subject.case, "-o", "cycle.h5"]);
        let cells = match found {
            Ok(found) => {
                let count = |key: &str| found[key].list().len().to_string();
                let stability = found["stability"].text().to_owned();
                [stability, count("events"), count("multipliers")]
            }
            Err(reason) => [reason, "-".to_owned(), "-".to_owned()],
        };
        for (column, cell) in ["cycle", "events of a period", "multipliers"].into_iter().zip(cells) {
            self.cell(column, cell);
        }
    }

    fn pictures(&mut self) {
        let figures = self
            .document(&["plot", "series.h5", "-o", "figures", "--format", "svg"])
            .unwrap();
        self.cell("figures", figures["files"].list().len().to_string());
        let page = self.document(&["plot", "series.h5", "--html", "page.html"]).unwrap();
        let found = page["page"]["samples_kept"].whole();
        assert!(found > 0, "{}", self.subject.case);
        self.cell("page", "yes");
        let table = self.document(&["export", "series.h5", "-o", "rows.csv"]).unwrap();
        self.cell("columns of an export", table["columns"].list().len().to_string());
    }
}

/// Number of matched events, and accused causes, in a comparison that should accuse nothing.
fn matched(document: &Value) -> String {
    let pair = &document["comparisons"][0];
    match pair["causes"].list().len() {
        0 => format!("{} events agree", pair["event_errors"]["matched"]),
        n => format!("{n} causes"),
    }
}

fn unheard(document: &Value) -> Option<String> {
    let summary = &document["summary"];
    (summary["kicks_without_instability"] != 0).then(|| "sliding never loses its stability".to_owned())
}

/// The reason for a failure in the program's document, without place and time.
fn reason(error: &Value) -> String {
    // For a run that fails on its way, the first sentence says when, the second why.
    let of_run = error
        .as_str()
        .map(|text| text.split_once(". ").map_or(text, |(_, why)| why));
    let of_input = error["places"][0]["message"].as_str().or(error["message"].as_str());
    let text = of_run.or(of_input).unwrap();
    // The text after these marks contains numbers of the run, whose last digits depend on the machine.
    let end = [" (", "; the nearest"].iter().filter_map(|mark| text.find(mark)).min();
    text[..end.unwrap_or(text.len())].replace('|', "\\|")
}

/// The page with its tables filled from these cells.
fn filled(page: &str, cells: &[BTreeMap<&'static str, String>]) -> String {
    let mut filled = page.to_owned();
    for (marker, columns) in TABLES {
        let begin = format!("<!-- {marker} -->\n");
        let end = format!("<!-- end of {marker} -->");
        let from = filled.find(&begin).expect(marker) + begin.len();
        let to = filled.find(&end).expect(marker);
        let mut notes: Vec<&str> = Vec::new();
        let mut table = format!(
            "\n|case|{}|\n|---|{}\n",
            columns.join("|"),
            "---|".repeat(columns.len())
        );
        for (subject, row) in SUBJECTS.iter().zip(cells) {
            write!(table, "|`{}`|", subject.case).unwrap();
            for column in columns {
                let text = row[column].as_str();
                if text.len() <= LONGEST_CELL {
                    write!(table, "{text}|").unwrap();
                    continue;
                }
                let known = notes.iter().position(|note| *note == text);
                let number = known.unwrap_or_else(|| {
                    notes.push(text);
                    notes.len() - 1
                });
                write!(table, "({})|", number + 1).unwrap();
            }
            table.push('\n');
        }
        table.push('\n');
        for (index, note) in notes.iter().enumerate() {
            writeln!(table, "({}) {note}\n", index + 1).unwrap();
        }
        filled.replace_range(from..to, &table);
    }
    filled
}

fn stated(page: &str, case: &str) -> BTreeMap<&'static str, String> {
    let mut cells = BTreeMap::new();
    for (marker, columns) in TABLES {
        let (_, table) = page.split_once(&format!("<!-- {marker} -->\n")).expect(marker);
        let (table, _) = table.split_once(&format!("<!-- end of {marker} -->")).expect(marker);
        let line = |start: &str| table.lines().find_map(|line| line.strip_prefix(start));
        let row = line(&format!("|`{case}`|")).expect(case).trim_end_matches('|');
        // A bar within a cell is escaped.
        let row = row.replace("\\|", "\0");
        for (column, cell) in columns.iter().zip(row.split('|')) {
            let cell = cell.replace('\0', "\\|");
            cells.insert(*column, line(&format!("{cell} ")).unwrap_or(&cell).to_owned());
        }
    }
    cells
}

/// The cells of a case as the program fills them.
fn attempted(subject: &'static Subject) -> BTreeMap<&'static str, String> {
    let mut trial = Trial {
        folder: Folder::new(),
        subject,
        series: Value::Null,
        cells: BTreeMap::new(),
    };
    trial.runs();
    trial.truth();
    trial.stability();
    trial.studies();
    trial.cycles();
    trial.pictures();
    trial.cells
}

/// Tries these cases, and compares the results with the page, or writes the page.
fn hold(is_tried: impl Fn(&str) -> bool + Sync) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/validation/capabilities.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let cells_of = |subject: &'static Subject| match is_tried(subject.case) {
        true => attempted(subject),
        false => stated(&page, subject.case),
    };
    // Each of two threads takes every second case.
    let mut cells: Vec<_> = std::thread::scope(|scope| {
        let half = |first: usize| {
            let subjects = SUBJECTS.iter().enumerate().skip(first).step_by(2);
            let cells_of = &cells_of;
            scope.spawn(move || {
                subjects
                    .map(|(index, subject)| (index, cells_of(subject)))
                    .collect::<Vec<_>>()
            })
        };
        let halves = [half(0), half(1)];
        halves.into_iter().flat_map(|half| half.join().unwrap()).collect()
    });
    cells.sort_by_key(|(index, _)| *index);
    let cells: Vec<_> = cells.into_iter().map(|(_, cells)| cells).collect();
    let now = filled(&page, &cells);
    if std::env::var_os("STICKSLIP_WRITE").is_some() {
        std::fs::write(&path, &now).unwrap();
    } else {
        assert_eq!(
            now, page,
            "STICKSLIP_WRITE=1 writes the tables of docs/validation/capabilities.md anew"
        );
    }
}

/// One case. The test below tries every case.
#[test]
fn regression_what_works_for_a_case_is_as_the_manual_says() {
    hold(|case| case == "block");
}

#[test]
#[ignore = "long: every command on every case"]
fn regression_long_what_works_for_which_case_is_as_the_manual_says() {
    hold(|_| true);
}

#[test]
fn property_every_built_in_case_is_in_the_tables() {
    let folder = Folder::new();
    let list = folder.stickslip("case --list").output().unwrap();
    let list = String::from_utf8(list.stdout).unwrap();
    let runs = list.lines().map(|line| line.split_whitespace().collect::<Vec<_>>());
    let kept = runs.filter(|words| words.get(1) == Some(&"run"));
    let mut names: Vec<String> = kept.map(|words| words[0].to_owned()).collect();
    let mut known: Vec<String> = SUBJECTS.iter().map(|subject| subject.case.to_owned()).collect();
    names.sort();
    known.sort();
    assert_eq!(names, known);
}
