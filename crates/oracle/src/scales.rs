//! The least scale of each component of a motion. Errors of smaller components are relative to this scale.

use super::courses::SignalCourse;
use super::friction;
use super::pieces::pieces;
use num_rational::BigRational;
use stickslip_system::model::nearest_double;
use stickslip_system::model::system::{ContactLaw, End, ExactSystem, Pressing, Train};

#[derive(Debug)]
pub(super) struct Scales {
    pub torque: f64,
    pub chains: [ChainScales; 2],
    pub axial: [f64; 2],
    pub courses: Vec<f64>,
    pub deflection: f64,
}

impl Scales {
    pub fn least_speed(&self) -> f64 {
        let speeds = self.chains.iter().map(|chain| chain.speed);
        speeds.fold(f64::INFINITY, f64::min)
    }
}

#[derive(Debug)]
pub(super) struct ChainScales {
    pub twist: Vec<f64>,
    pub rate: Vec<f64>,
    pub speed: f64,
}

/// Least scales of twists, speeds and signals, log2: a shaft under all torques, and an oscillation of that size.
pub(super) fn scales<const N: usize>(exact: &ExactSystem, courses: &[SignalCourse<N>]) -> Scales {
    let double = |value: &BigRational| nearest_double(value).abs();
    let sizes: Vec<f64> = courses.iter().map(SignalCourse::size).collect();
    let mut place = 0;
    let mut next = || {
        place += 1;
        sizes.get(place - 1).copied().unwrap_or(0.0)
    };
    let (mut torque, mut speed) = (0.0_f64, 0.0_f64);
    let initial = &exact.initial;
    let chains = [
        (&exact.rotor, &initial.rotor_twist, &initial.rotor_speed),
        (&exact.stator, &initial.stator_twist, &initial.stator_speed),
    ];
    for (train, twists, speeds) in chains {
        if let End::Driven(_) = train.end {
            speed = speed.max(next());
        }
        if train.torque.is_some() {
            torque += next();
        }
        for (stiffness, twist) in train.stiffness.iter().zip(twists) {
            torque += double(stiffness) * double(twist);
        }
        speed = speeds.iter().map(double).fold(speed, f64::max);
    }
    let mut axial_scales = [0.0; 2];
    let force = match &exact.pressing {
        Pressing::Force(_) => next(),
        Pressing::Axial { axial, actuation } => {
            let pieces = pieces(actuation);
            let force = pieces.iter().map(|piece| double(&piece.force)).fold(0.0, f64::max);
            let force = or_one(force);
            let depth = force / double(&axial.stiffness);
            axial_scales = [depth, depth * (double(&axial.stiffness) / double(&axial.mass)).sqrt()].map(f64::log2);
            force
        }
    };
    let contact = friction::size(&exact.law).max(1e-3) * double(&exact.radius);
    torque += contact * force;
    let speed = or_one(speed);
    let chain = |train: &Train<BigRational>| {
        let shafts = || train.stiffness.iter().zip(&train.inertia);
        let twist = |k: f64| {
            if k > 0.0 && torque > 0.0 { torque / k } else { speed }
        };
        let rate = |(k, j): (f64, f64)| {
            if k > 0.0 && torque > 0.0 {
                torque / (k * j).sqrt()
            } else {
                speed
            }
        };
        let rates: Vec<f64> = shafts().map(|(k, j)| rate((double(k), double(j))).log2()).collect();
        ChainScales {
            twist: shafts().map(|(k, _)| twist(double(k)).log2()).collect(),
            speed: rates.iter().copied().fold(speed.log2(), f64::min),
            rate: rates,
        }
    };
    let deflection = match &exact.contact {
        ContactLaw::Bristles(bristles) => friction::size(&exact.law).max(1e-3) / or_one(double(&bristles.stiffness)),
        _ => 1.0,
    };
    Scales {
        torque: or_one(torque).log2(),
        chains: [chain(&exact.rotor), chain(&exact.stator)],
        axial: axial_scales,
        courses: sizes.iter().map(|size| or_one(*size).log2()).collect(),
        deflection: deflection.log2(),
    }
}

fn or_one(value: f64) -> f64 {
    if value > 0.0 { value } else { 1.0 }
}
