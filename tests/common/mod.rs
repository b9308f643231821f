//! What several test files share. Here: the multiprecision truth and runs held in memory.
#![allow(dead_code)] // each test program uses its part

pub mod campaign;
pub mod cases;
pub mod cli;
pub mod compare;
pub mod hostile;
pub mod json;
pub mod linear_brake;
pub mod page;
pub mod planted_solver;
pub mod random_brakes;
pub mod results;
pub mod rigid_growth;
pub mod systems;

pub mod unlocked;

use crate::common::json::*;
use stickslip::Run;
use stickslip::case::Case;
use stickslip::friction::Friction;
use stickslip::model::system::System;
use stickslip::model::{Axial, BreakawayTest, Contact, DiskInitial, DiskKick, KickTime, Parameters, Torsion};
use stickslip::record::{EventKind, MemoryRecorder, Sample};
use stickslip::simulation::{Following, Method, OutputOptions, RunReport, SolverOptions};
use systems::{exponential, ramp};

/// The rows of a table: cells that `|` parts, a row a line. A line that ends in `|` goes on in the next.
#[track_caller]
pub fn rows<const N: usize>(table: &str) -> Vec<[&str; N]> {
    let split = table.split(['|', '\n']).map(str::trim);
    let cells: Vec<&str> = split.filter(|cell| !cell.is_empty()).collect();
    let (rows, rest) = cells.as_chunks();
    assert!(rest.is_empty(), "{N} cells make a row, and {rest:?} do not");
    rows.to_vec()
}

/// An event or a sample of the independent multiprecision code, rounded to double.
pub struct TruthState {
    pub time: f64,
    pub kind: String,
    /// (channel, value)
    pub state: Vec<(String, f64)>,
}

pub struct Truth {
    pub parameters: Parameters,
    pub end_time: f64,
    pub events: Vec<TruthState>,
    pub samples: Vec<TruthState>,
}

fn number(value: &serde_json::Value) -> f64 {
    value.as_str().expect("a decimal string").parse().expect("a number")
}

/// Reads data/truth/NAME.json.
pub fn truth(name: &str) -> Truth {
    let path = format!("{}/data/truth/{name}.json", env!("CARGO_MANIFEST_DIR"));
    let json: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let p = |key: &str| number(&json["parameters"][key]);
    let perturbations = match json["parameters"].get("kick_time") {
        Some(time) => vec![DiskKick {
            time: KickTime::At(number(time)),
            relative_velocity: p("kick_relative_velocity"),
        }],
        None => Vec::new(),
    };
    let states = |key: &str, state: &str| {
        json[key]
            .list()
            .iter()
            .map(|row| TruthState {
                time: number(&row["time"]),
                kind: row.get("kind").and_then(|k| k.as_str()).unwrap_or_default().to_owned(),
                state: row[state]
                    .as_object()
                    .unwrap()
                    .iter()
                    .map(|(k, v)| (k.clone(), number(v)))
                    .collect(),
            })
            .collect()
    };
    Truth {
        parameters: Parameters {
            axial: Axial {
                mass: p("m"),
                stiffness: p("k_e"),
                damping: p("c_a"),
                ringing_floor: Axial::RINGING_FLOOR,
            },
            actuation: ramp(p("F_0"), p("t_0")),
            torsion: Torsion {
                rotor_inertia: p("I"),
                surface_inertia: p("J"),
                stiffness: p("k_t"),
                damping: p("c_t"),
            },
            contact: Contact {
                radius: p("r"),
                breakaway_test: BreakawayTest::Transmitted,
            },
            friction: Friction {
                breakaway: p("mu_0"),
                law: exponential(p("mu_s"), p("mu_d"), p("alpha")).into(),
            },
            initial: DiskInitial { speed: p("omega_0") },
            perturbations,
        },
        end_time: p("t_end"),
        events: states("events", "state_after"),
        samples: states("samples", "state"),
    }
}

/// The two disks of a case in the short form.
pub fn disks(case: &Case) -> Parameters {
    Parameters::of(&case.system).expect("two disks")
}

/// A run kept in memory.
pub fn run(parameters: &Parameters, solver: &SolverOptions, output: &OutputOptions) -> (MemoryRecorder, RunReport) {
    let mut recorder = MemoryRecorder::default();
    let report = Run::of_system(&System::from(parameters), 0.0, solver, output)
        .record(&mut recorder)
        .start()
        .expect("a run");
    (recorder, report)
}

pub fn solver(method: Method, rtol: f64) -> SolverOptions {
    SolverOptions {
        method,
        rtol,
        ..SolverOptions::default()
    }
}

pub fn output(end_time: f64, interval: f64) -> OutputOptions {
    OutputOptions {
        end_time,
        interval,
        windows: Vec::new(),
        steps: false,
        follow: Following::default(),
    }
}

/// The channel of a sample by the name that the truth files use.
pub fn channel(sample: &Sample, name: &str) -> f64 {
    let s = &sample.state;
    match name {
        "z" => s.z,
        "z_dot" => s.z_dot,
        "rotor_twist" => s.rotor_twist,
        "stator_twist" => s.phi1,
        "theta_dot" => s.theta_dot,
        "phi2_dot" => s.phi2_dot,
        "phi1_dot" => s.phi1_dot,
        other => panic!("no channel {other}"),
    }
}

/// The event sequence of a run: (kind, time).
pub fn event_sequence(recorder: &MemoryRecorder) -> Vec<(EventKind, f64)> {
    let events = recorder.events.iter().filter(|e| e.kind.in_event_sequence());
    events.map(|e| (e.kind, e.time)).collect()
}

/// Asserts the truth's events in order, none extra, and returns the largest error of a time, s.
pub fn largest_event_error(truth: &Truth, recorder: &MemoryRecorder) -> f64 {
    let word = event_sequence(recorder);
    let kinds: Vec<&str> = word.iter().map(|(k, _)| k.name()).collect();
    let expected: Vec<&str> = truth.events.iter().map(|e| e.kind.as_str()).collect();
    let wanted = expected.len();
    assert_eq!(kinds.len(), wanted, "number of events; first {:?}", word.first());
    assert_eq!(kinds, expected);
    let pairs = word.iter().zip(&truth.events);
    pairs.map(|((_, t), e)| (t - e.time).abs()).fold(0.0, f64::max)
}

/// The largest error of a sampled channel relative to the channel's largest absolute value in the samples.
pub fn largest_sample_error(truth: &Truth, recorder: &MemoryRecorder) -> (f64, String) {
    let mut worst = (0.0, String::new());
    for (index, (name, _)) in truth.samples[0].state.iter().enumerate() {
        let scale = truth.samples.iter().map(|s| s.state[index].1.abs()).fold(0.0, f64::max);
        for expected in &truth.samples {
            let sample = recorder
                .samples
                .iter()
                .find(|s| (s.time - expected.time).abs() < 1e-12)
                .unwrap_or_else(|| panic!("no sample at {}", expected.time));
            let error = (channel(sample, name) - expected.state[index].1).abs() / scale;
            if error > worst.0 {
                worst = (error, format!("{name} at {}", expected.time));
            }
        }
    }
    worst
}
