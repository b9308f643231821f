//! A bare explicit solver of the brake with switches for the faults that such solvers have, and what it writes.

use super::cases::{built_in, parsed};
use super::cli::says;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use stickslip::case::{Case, CaseSource};
use stickslip::compare::{CauseKind, Comparison, Mapping, Reference};
use stickslip::friction::Law;
use stickslip::model::Parameters;
use stickslip::record::{EventKind, Recorder, State};
use stickslip::results::{Header, Overwrite, ResultFile, ResultWriter, Status, StickSlipTable};
use stickslip::{Run, SavedRun};

/// Runs a built-in case with overrides into a result file.
pub fn run(path: &Path, case: &str, overrides: &[&str]) {
    let source = CaseSource::built_in(case).unwrap();
    let overrides = parsed(overrides);
    let case = Case::read(&source, &overrides).unwrap();
    let header = Header {
        title: case.title.clone(),
        source: "test".to_owned(),
        references: String::new(),
        history: String::new(),
        case_text: source.text.clone(),
        resolved: case.resolved(),
        meta: Vec::new(),
        events: Vec::new(),
        extension: Default::default(),
        ..Header::default()
    };
    let mut writer = ResultWriter::create(path, Overwrite::Force, &[], &header).unwrap();
    let recorder: &mut dyn Recorder = &mut writer;
    Run::new(&case).record(recorder).start().unwrap();
    writer
        .finish(Status::Complete, &StickSlipTable::default(), 0.0)
        .unwrap();
}

/// The default run of the case `paper`, made once in each test program.
pub fn paper() -> &'static Path {
    static FILE: OnceLock<(tempfile::TempDir, PathBuf)> = OnceLock::new();
    let made = || {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("paper.h5");
        run(&path, "paper", &[]);
        (folder, path)
    };
    &FILE.get_or_init(made).1
}

/// The run of a case in a folder of its own.
pub struct Kept {
    folder: tempfile::TempDir,
    pub path: PathBuf,
}

pub fn kept(case: &Case) -> Kept {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.h5");
    let saved = SavedRun::new(case, &path).start().unwrap();
    assert!(saved.run.failure.is_none() && saved.unsaved.is_none());
    Kept { folder, path }
}

impl Kept {
    /// Compares a table with the run.
    pub fn compared(&self, text: &str, change: impl FnOnce(&mut Mapping)) -> Comparison {
        let candidate = write(&self.folder, "mine.csv", text);
        let reference = Reference::open(&self.path).unwrap();
        let mut mapping = reference.mapping();
        change(&mut mapping);
        reference.compare(&candidate, &mapping).unwrap()
    }

    /// Compares another run with it.
    pub fn against(&self, other: &Kept) -> Comparison {
        let reference = Reference::open(&self.path).unwrap();
        reference.compare(&other.path, &Mapping::default()).unwrap()
    }

    /// The time and these columns.
    pub fn columns(&self, names: &[&str]) -> Vec<Vec<f64>> {
        let file = ResultFile::open(&self.path).unwrap();
        let rows = 0..file.sample_count().unwrap();
        let names = ["time"].into_iter().chain(names.iter().copied());
        names.map(|name| file.column(name, rows.clone()).unwrap()).collect()
    }
}

/// A table of three columns as CSV.
pub fn series(header: &str, rows: impl IntoIterator<Item = [f64; 3]>) -> String {
    let mut text = format!("{header}\n");
    for [t, x, v] in rows {
        writeln!(text, "{t:?},{x:?},{v:?}").unwrap();
    }
    text
}

/// Compares a candidate with the run of `paper`.
pub fn compare(candidate: &Path, mapping: &Mapping) -> Comparison {
    Reference::open(paper()).unwrap().compare(candidate, mapping).unwrap()
}

/// The same, but no cause is sought.
pub fn compare_quick(candidate: &Path, mapping: Mapping) -> Comparison {
    compare(candidate, &Mapping { quick: true, ..mapping })
}

pub fn causes(comparison: &Comparison) -> Vec<CauseKind> {
    comparison.causes.iter().map(|d| d.cause).collect()
}

/// Asserts that nothing is accused, and that no event is missing or spurious.
#[track_caller]
pub fn agrees(c: &Comparison) {
    assert_eq!(causes(c), [], "{}", c.verdict);
    assert_eq!((c.missing, c.spurious), (0, 0), "{}", c.verdict);
}

/// The evidence for a cause, in which these words stand.
#[track_caller]
pub fn evidence<'a>(comparison: &'a Comparison, cause: CauseKind, words: &[&str]) -> &'a str {
    let found = comparison.causes.iter().find(|d| d.cause == cause);
    let none = || panic!("{cause:?} in {}", comparison.verdict);
    let said = &found.unwrap_or_else(none).evidence;
    says(said, words);
    said
}

/// The parameters of `paper`.
pub fn parameters() -> Parameters {
    let case = built_in("paper", &[]);
    Parameters::of(&case.system).unwrap()
}

/// The state of the reference around its kick, (before, after), and the time of it.
pub fn kick() -> (f64, State, State) {
    let events = ResultFile::open(paper()).unwrap().events().unwrap();
    let kick = events.iter().find(|e| e.kind == EventKind::Kick).unwrap();
    (kick.time, kick.before, kick.after)
}

/// How the stop is recognised.
#[derive(Clone, Copy, PartialEq)]
pub enum Stop {
    /// By the change of sign of omega_r at a step; both surfaces then get their mean speed.
    Sign,
    /// By |omega_r| up to this, rad/s; both surfaces then get their mean speed.
    Within(f64),
    /// The same, but omega_r stays what it was.
    Frozen(f64),
}

/// A solver and its faults.
#[derive(Clone, Copy)]
pub struct Solver {
    pub step: f64,
    pub kicked: bool,
    /// Integrates theta and phi_2 instead of their difference.
    pub absolute_angles: bool,
    pub stop: Stop,
    /// Implicit Euler, which damps, instead of the classical Runge-Kutta method.
    pub implicit: bool,
    /// Which multiple of mu_0 r F_n the torque has to reach.
    pub breakaway: f64,
}

/// Sound but for the events, which it takes at its steps of a microsecond.
pub const SOUND: Solver = Solver {
    step: 1e-6,
    kicked: true,
    absolute_angles: false,
    stop: Stop::Sign,
    implicit: false,
    breakaway: 1.0,
};

/// u or theta, u' or phi_2', v, v', theta', and phi_2 with absolute angles.
type Y = [f64; 6];

/// Time and (u, u', v, v', theta', omega_r) of each sample.
pub type Rows = Vec<(f64, [f64; 6])>;

impl Solver {
    fn rates(&self, p: &Parameters, sense: f64, force: f64, y: &Y) -> Y {
        let t = &p.torsion;
        let (twist, twist_rate) = self.twist(y);
        let rotor = t.damping * twist_rate + t.stiffness * twist;
        let stator = t.damping * y[3] + t.stiffness * y[2];
        let (phi2, phi1) = if sense == 0.0 {
            let phi = (rotor - stator) / (2.0 * t.surface_inertia);
            (phi, phi)
        } else {
            let w = self.relative_velocity(y);
            let friction = sense * p.friction.law.coefficient(w.abs()) * p.contact.radius * force;
            (
                (rotor - friction) / t.surface_inertia,
                (friction - stator) / t.surface_inertia,
            )
        };
        let theta = -rotor / t.rotor_inertia;
        if self.absolute_angles {
            [y[4], phi2, y[3], phi1, theta, y[1]]
        } else {
            [y[1], theta - phi2, y[3], phi1, theta, 0.0]
        }
    }

    fn twist(&self, y: &Y) -> (f64, f64) {
        if self.absolute_angles {
            (y[0] - y[5], y[4] - y[1])
        } else {
            (y[0], y[1])
        }
    }

    fn relative_velocity(&self, y: &Y) -> f64 {
        if self.absolute_angles {
            y[1] - y[3]
        } else {
            y[4] - y[1] - y[3]
        }
    }

    fn advance(&self, p: &Parameters, sense: f64, force: f64, y: &Y) -> Y {
        let h = self.step;
        let f = |y: &Y| self.rates(p, sense, force, y);
        let plus = |y: &Y, h: f64, k: &Y| -> Y { std::array::from_fn(|n| y[n] + h * k[n]) };
        if self.implicit {
            // A fixed point, which h omega < 1 makes converge.
            let mut next = *y;
            for _ in 0..60 {
                next = plus(y, h, &f(&next));
            }
            return next;
        }
        let k1 = f(y);
        let k2 = f(&plus(y, h / 2.0, &k1));
        let k3 = f(&plus(y, h / 2.0, &k2));
        let k4 = f(&plus(y, h, &k3));
        std::array::from_fn(|n| y[n] + h / 6.0 * (k1[n] + 2.0 * k2[n] + 2.0 * k3[n] + k4[n]))
    }

    fn joined(&self, y: &Y) -> Y {
        let half = self.relative_velocity(y) / 2.0;
        let mut y = *y;
        y[3] += half;
        y[1] += if self.absolute_angles { -half } else { half };
        y
    }

    /// From the kick of the reference to 6.99 s.
    pub fn run(&self) -> Rows {
        let (_, before, after) = kick();
        self.run_with(&parameters(), &if self.kicked { after } else { before })
    }

    /// The same with other parameters, from another state.
    pub fn run_with(&self, p: &Parameters, s: &State) -> Rows {
        let (start, _, _) = kick();
        // F(t) has been constant for seconds, and so has the contact force.
        let force = -(p.axial.stiffness * s.z + p.axial.damping * s.z_dot);
        let limit = self.breakaway * p.friction.breakaway * p.contact.radius * force;
        let mut y: Y = if self.absolute_angles {
            [s.theta, s.phi2_dot, s.phi1, s.phi1_dot, s.theta_dot, s.phi2]
        } else {
            [s.rotor_twist, s.rotor_twist_rate, s.phi1, s.phi1_dot, s.theta_dot, 0.0]
        };
        let mut sense = 1.0;
        let mut rows = Rows::new();
        for n in 0..=((6.99 - start) / self.step) as usize {
            let (u, u_dot) = self.twist(&y);
            let frozen = matches!(self.stop, Stop::Frozen(_));
            let w = if sense == 0.0 && !frozen {
                0.0
            } else {
                self.relative_velocity(&y)
            };
            rows.push((start + n as f64 * self.step, [u, u_dot, y[2], y[3], y[4], w]));
            let last = self.relative_velocity(&y);
            y = self.advance(p, sense, force, &y);
            let (u, u_dot) = self.twist(&y);
            let torque = 0.5 * (p.torsion.damping * (u_dot + y[3]) + p.torsion.stiffness * (u + y[2]));
            if sense == 0.0 {
                if torque.abs() > limit {
                    sense = torque.signum();
                }
                continue;
            }
            let w = self.relative_velocity(&y);
            // A slip that has just begun is not a stop.
            let slowing = w.abs() < last.abs();
            let stops = match self.stop {
                Stop::Sign => sense * w <= 0.0,
                Stop::Within(band) | Stop::Frozen(band) => w.abs() <= band && slowing,
            };
            if stops && torque.abs() <= limit {
                sense = 0.0;
                if !frozen {
                    y = self.joined(&y);
                }
            } else if sense * w <= 0.0 {
                sense = -sense;
            }
        }
        rows
    }
}

/// Names of the columns that [`csv`] writes after the time.
pub const NAMES: [&str; 6] = [
    "rotor_twist",
    "rotor_twist_rate",
    "phi1",
    "phi1_dot",
    "theta_dot",
    "relative_velocity",
];

/// Rows as CSV with a header.
pub fn csv(rows: &Rows) -> String {
    let mut text = format!("time,{}\n", NAMES.join(","));
    for (time, values) in rows {
        write!(text, "{time:?}").unwrap();
        for value in values {
            write!(text, ",{value:?}").unwrap();
        }
        text.push('\n');
    }
    text
}

/// The trajectory of a result file from `from` s on, as [`csv`] writes it.
pub fn rows_of(path: &Path, from: f64) -> Rows {
    let file = ResultFile::open(path).unwrap();
    let samples = file.samples(0..file.sample_count().unwrap()).unwrap();
    let row = |s: &stickslip::record::Sample| {
        let s1 = &s.state;
        let values = [
            s1.rotor_twist,
            s1.rotor_twist_rate,
            s1.phi1,
            s1.phi1_dot,
            s1.theta_dot,
            s1.relative_velocity,
        ];
        (s.time, values)
    };
    samples.iter().filter(|s| s.time >= from).map(row).collect()
}

/// Times and kinds of the event sequence of a result file.
pub fn word_of(path: &Path) -> Vec<(f64, String)> {
    let events = ResultFile::open(path).unwrap().events().unwrap();
    let word = events.iter().filter(|e| e.kind.in_event_sequence());
    word.map(|e| (e.time, e.kind.name().to_owned())).collect()
}

/// A table of events as CSV.
pub fn events_csv(word: &[(f64, String)]) -> String {
    let mut text = "time,kind\n".to_owned();
    for (time, kind) in word {
        writeln!(text, "{time:?},{kind}").unwrap();
    }
    text
}

/// Writes a text into a folder of tests.
pub fn write(folder: &tempfile::TempDir, name: &str, text: &str) -> PathBuf {
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    path
}
