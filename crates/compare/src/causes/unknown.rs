//! Parameters that may differ in a candidate: those of the case, and those that are zero or absent in it.

use super::evidence::Evidence;
use super::number::is_coefficient;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use stickslip_system::model::system::{Pressing, Train};
use stickslip_system::signal::{Drive, Wave};

#[derive(Debug, Clone)]
pub(crate) struct Unknown {
    pub path: String,
    pub value: f64,
    pub unit: f64,
    pub with: Vec<String>,
    /// Other parameters that change by the same factor, with their values.
    pub scaled: Numbers,
    pub mistaken: Vec<f64>,
}

pub(crate) type Numbers = Vec<(String, f64)>;

/// Common mistakes of a parameter, as factors: double, half, zero, other sign, degrees.
const MISTAKEN: [f64; 6] = [2.0, 0.5, 0.0, -1.0, TAU / 360.0, 360.0 / TAU];

/// Mistakes of a phase besides its sign: a sine for a cosine, or the opposite direction.
const TURNS: [f64; 3] = [FRAC_PI_2, -FRAC_PI_2, PI];

impl Unknown {
    pub fn changes(&self, value: f64) -> Numbers {
        let paths = [&self.path].into_iter().chain(&self.with);
        let same = paths.map(|path| (path.clone(), value));
        let scaled = self.scaled.iter();
        same.chain(scaled.map(|(path, own)| (path.clone(), own * value / self.value)))
            .collect()
    }

    /// Whether it changes alone.
    pub fn is_alone(&self) -> bool {
        self.with.is_empty() && self.scaled.is_empty()
    }
}

fn wave(drive: &Drive) -> Option<&Wave> {
    match drive {
        Drive::Wave(wave) => Some(wave),
        _ => None,
    }
}

impl Evidence<'_> {
    pub(crate) fn unknown(&self) -> Vec<Unknown> {
        let (system, trains) = (self.physics.system(), &self.physics.trains);
        let omega = self.physics.natural_angular_frequency();
        let speed = self.physics.speed();
        let torque = system.breakaway * system.radius * self.physics.course.largest_force();
        let of_case = self.case.numbers().iter().filter(|number| number.value != 0.0);
        let mut unknown: Vec<Unknown> = of_case
            .map(|number| {
                let is_phase = number.path.ends_with(".phase");
                Unknown {
                    path: number.path.clone(),
                    value: number.value,
                    unit: if is_phase { 1.0 } else { number.value.abs() },
                    with: Vec::new(),
                    scaled: Vec::new(),
                    mistaken: match is_phase {
                        true => TURNS
                            .map(|turn| number.value + turn)
                            .into_iter()
                            .chain([-number.value])
                            .collect(),
                        false => MISTAKEN.map(|factor| factor * number.value).to_vec(),
                    },
                }
            })
            .collect();
        // The speed of a driven end, together with equal speeds at t = 0.
        for end in ["rotor.speed", "stator.speed"] {
            let number = self.case.number(end).map(|number| number.value);
            let Some(value) = number.filter(|speed| *speed != 0.0) else {
                continue;
            };
            let initial = self.case.numbers().iter();
            let same = initial.filter(|n| n.path.starts_with("initial.") && n.value == value);
            let with: Vec<String> = same.map(|number| number.path.clone()).collect();
            if !with.is_empty() {
                unknown.push(Unknown {
                    path: end.to_owned(),
                    value,
                    unit: value.abs(),
                    with,
                    scaled: Vec::new(),
                    mistaken: MISTAKEN.map(|factor| factor * value).to_vec(),
                });
            }
        }
        // All coefficients of friction, which a mistaken size or unit of the force changes together.
        let coefficients = self.case.numbers().iter();
        let coefficients = coefficients.filter(|number| number.value != 0.0 && is_coefficient(&number.path));
        let mut coefficients = coefficients.map(|number| (number.path.clone(), number.value));
        if let Some((path, value)) = coefficients.next() {
            let scaled: Numbers = coefficients.collect();
            unknown.extend((!scaled.is_empty()).then(|| Unknown {
                path,
                value,
                unit: value.abs(),
                with: Vec::new(),
                scaled,
                mistaken: MISTAKEN.map(|factor| factor * value).to_vec(),
            }));
        }
        let mut absent = |path: String, unit: f64, mistaken: &[f64]| {
            let of_list = [path.strip_suffix(".0").map(str::to_owned), Some(format!("{path}.0"))];
            let is_same =
                |known: &Unknown| known.path == path || of_list.iter().flatten().any(|name| *name == known.path);
            let is_known = unknown.iter().any(is_same);
            if !is_known && unit.is_finite() && unit > 0.0 {
                unknown.push(Unknown {
                    path,
                    value: 0.0,
                    unit,
                    with: Vec::new(),
                    scaled: Vec::new(),
                    mistaken: mistaken.to_vec(),
                });
            }
        };
        for (name, train) in [("rotor", &trains.rotor), ("stator", &trains.stator)] {
            let inertia = |i: usize| train.inertia.get(i).copied().unwrap_or(f64::NAN);
            for i in 0..train.shafts() {
                absent(format!("{name}.damping.{i}"), inertia(i) * omega, &[]);
                absent(format!("initial.{name}_twist.{i}"), speed / omega, &[]);
            }
            for i in 0..train.inertia.len() {
                absent(format!("{name}.viscous.{i}"), inertia(i) * omega, &[]);
                absent(format!("initial.{name}_speed.{i}"), speed, &[]);
            }
            if !train.inertia.is_empty() {
                let driven = train.torque.as_ref().and_then(|torque| wave(&torque.signal));
                match driven {
                    Some(_) => absent(format!("{name}.torque.mean"), torque, &[]),
                    None => absent(format!("{name}.torque"), torque, &[]),
                }
            }
        }
        for (path, _) in waves([&trains.rotor, &trains.stator], &trains.pressing) {
            absent(format!("{path}.phase"), 1.0, &TURNS);
        }
        unknown
    }
}

fn waves<'a>(trains: [&'a Train; 2], pressing: &'a Pressing) -> Vec<(&'static str, &'a Wave)> {
    let mut found = Vec::new();
    let names = [("rotor.torque", "rotor.speed"), ("stator.torque", "stator.speed")];
    for (train, (torque, speed)) in trains.into_iter().zip(names) {
        let of_torque = train.torque.as_ref().and_then(|torque| wave(&torque.signal));
        found.extend(of_torque.map(|wave| (torque, wave)));
        if let stickslip_system::model::system::End::Driven(end) = &train.end {
            found.extend(wave(end).map(|wave| (speed, wave)));
        }
    }
    if let Pressing::Force(force) = pressing {
        found.extend(wave(force).map(|wave| ("contact.normal_force", wave)));
    }
    found
}
