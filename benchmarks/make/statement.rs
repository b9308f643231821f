//! `problem.json`: a problem in numbers, SI.

use crate::Outcome;
use crate::answers::Answers;
use serde::Serialize;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use stickslip::compare::benchmark::{Budget, Problem, ProblemSet};
use stickslip::friction::{FrictionLaw, Law};
use stickslip::model::KickTime;
use stickslip::model::system::{ContactLaw, End, Kick, Pressing, Smoothing, System, Train};
use stickslip::signal::{Drive, Frequency, HarmonicShape, Signal};

#[derive(Serialize)]
struct Statement<'a> {
    set: &'a str,
    problem: &'a str,
    title: &'a str,
    motion: &'a str,
    end_time: f64,
    time_scale: f64,
    no_friction_law: bool,
    columns: Vec<Column<'a>>,
    relative_velocity: &'a BTreeMap<String, f64>,
    position: &'a str,
    leaves_rest: &'a str,
    threshold: Option<f64>,
    starts_in_slip: bool,
    grid: Vec<Stretch>,
    budget: &'a Budget,
    solved_with_digits: [u32; 2],
    system: Value,
}

#[derive(Serialize)]
struct Column<'a> {
    name: &'a str,
    unit: &'a str,
    meaning: &'a str,
}

#[derive(Serialize)]
struct Stretch {
    from: f64,
    to: f64,
    step: f64,
}

pub fn of(set: &ProblemSet, problem: &Problem, answers: &Answers) -> Outcome<String> {
    let (case, system) = (&answers.case, &answers.case.system);
    let constant = matches!(&system.law, FrictionLaw::Coulomb(_));
    let holds_no_more = system.breakaway == system.law.at_vanishing_speed();
    let statement = Statement {
        set: &set.version,
        problem: &problem.name,
        title: &case.title,
        motion: case.motion().name(),
        end_time: case.output.end_time,
        time_scale: problem.time_scale,
        no_friction_law: constant && holds_no_more,
        columns: problem
            .columns
            .iter()
            .map(|column| Column {
                name: &column.name,
                unit: &column.unit,
                meaning: &column.meaning,
            })
            .collect(),
        relative_velocity: &problem.relative_velocity,
        position: &problem.position,
        leaves_rest: if holds_no_more { "quadratic" } else { "linear" },
        threshold: Some(case.threshold).filter(|threshold| *threshold > 0.0),
        starts_in_slip: answers.starts_in_slip,
        grid: problem
            .grid
            .iter()
            .map(|&[from, to, step]| Stretch { from, to, step })
            .collect(),
        budget: &problem.budget,
        solved_with_digits: answers.digits,
        system: of_system(system)?,
    };
    Ok(serde_json::to_string_pretty(&statement)? + "\n")
}

fn of_system(system: &System) -> Outcome<Value> {
    let initial = &system.initial;
    let kick = |kick: &Kick| match kick.time {
        KickTime::At(time) => Ok(json!({ "time": time, "relative_velocity": kick.relative_velocity })),
        KickTime::Instability => Err("a kick without a time"),
    };
    Ok(json!({
        "first": train(&system.rotor),
        "second": train(&system.stator),
        "radius": system.radius,
        "normal_force": match &system.pressing {
            Pressing::Force(force) => signal(force),
            Pressing::Axial { axial, actuation } => json!({
                "kind": "axial", "mass": axial.mass, "stiffness": axial.stiffness, "damping": axial.damping,
                "force": linear(actuation),
            }),
        },
        "friction": friction(system),
        "initial": {
            "first_twist": initial.rotor_twist, "first_speed": initial.rotor_speed,
            "second_twist": initial.stator_twist, "second_speed": initial.stator_speed,
        },
        "kicks": system.kicks.iter().map(kick).collect::<Result<Vec<_>, _>>()?,
    }))
}

fn train(train: &Train) -> Value {
    let mut made = json!({
        "inertia": train.inertia, "stiffness": train.stiffness, "damping": train.damping, "viscous": train.viscous,
        "end": match train.end { End::Free => "free", End::Fixed => "fixed", End::Driven(_) => "driven" },
    });
    if let End::Driven(speed) = &train.end {
        made["speed"] = signal(speed);
    }
    if let Some(torque) = &train.torque {
        made["force"] = signal(&torque.signal);
        made["force_on"] = torque.on.into();
    }
    made
}

/// The parameters of the laws that the set has.
const NUMBERS: [&str; 10] = [
    "kinetic",
    "low_speed",
    "high_speed",
    "decay",
    "scale",
    "exponent",
    "viscous",
    "linear",
    "quadratic",
    "cubic",
];

fn friction(system: &System) -> Value {
    let law = &system.law;
    let mut made = Map::new();
    let engaged = !matches!(system.contact, ContactLaw::StickSlip);
    made.insert("law".to_owned(), law.name().into());
    if !engaged {
        made.insert("static".to_owned(), system.breakaway.into());
    }
    for key in NUMBERS {
        if let Some(number) = law.number(key) {
            made.insert(key.to_owned(), number.into());
        }
    }
    match &system.contact {
        ContactLaw::StickSlip => {}
        ContactLaw::Regularised(by) => {
            let function = match by.function {
                Smoothing::Tanh => "tanh",
                Smoothing::Arctan => "arctan",
            };
            made.insert(
                "regularisation".to_owned(),
                json!({ "function": function, "speed": by.speed }),
            );
        }
        ContactLaw::Bristles(bristles) => {
            made.insert("law".to_owned(), "lugre".into());
            made.insert("bristle_stiffness".to_owned(), bristles.stiffness.into());
            made.insert("bristle_damping".to_owned(), bristles.damping.into());
            made.insert("viscous".to_owned(), bristles.viscous.into());
        }
    }
    Value::Object(made)
}

fn signal(drive: &Drive) -> Value {
    match drive {
        Drive::Value(value) => json!({ "kind": "constant", "value": value }),
        Drive::Linear(signal) => linear(signal),
        Drive::Wave(wave) => json!({
            "kind": "harmonic",
            "shape": match wave.shape { HarmonicShape::Sine => "sine", HarmonicShape::Cosine => "cosine" },
            "mean": wave.mean,
            "amplitude": wave.amplitude,
            "angular_frequency": match wave.frequency {
                Frequency::Angular(omega) => omega,
                Frequency::Cycles(frequency) => std::f64::consts::TAU * frequency,
                Frequency::Sweep { .. } => unreachable!("no problem has a chirp"),
            },
            "phase": wave.phase,
        }),
        Drive::Sum(drives) => json!({ "kind": "sum", "of": drives.iter().map(signal).collect::<Vec<_>>() }),
    }
}

/// Through points.
fn linear(signal: &Signal) -> Value {
    let (time, value): (Vec<f64>, Vec<f64>) = match signal {
        Signal::Ramp(ramp) => ([0.0, ramp.rise_time].into(), [0.0, ramp.value].into()),
        Signal::TimeTable(table) => (table.time.clone(), table.value.clone()),
    };
    json!({ "kind": "linear", "time": time, "value": value })
}
