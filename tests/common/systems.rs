//! Parts of systems: trains, laws, signals and what they make; systems around the paper's brake.

use stickslip::friction::{Exponential, Friction, FrictionLaw, Hyperbolic, Law};
use stickslip::model::system::{ContactLaw, End, Initial, Pressing, System, Train};
use stickslip::model::{Axial, BreakawayTest, Contact, DiskInitial as BrakeInitial, Parameters, Torsion};
use stickslip::signal::{Drive, Frequency, HarmonicShape, Ramp, Signal, TimeTable, Wave};

/// The axial part of the paper's brake.
pub const AXIAL: Axial = Axial {
    mass: 4.54,
    stiffness: 55.38e6,
    damping: 8760.0,
    ringing_floor: Axial::RINGING_FLOOR,
};

pub fn exponential(low_speed: f64, high_speed: f64, decay: f64) -> Exponential {
    Exponential {
        low_speed,
        high_speed,
        decay,
    }
}

pub fn ramp(value: f64, rise_time: f64) -> Signal {
    Signal::Ramp(Ramp { value, rise_time })
}

pub fn table(time: &[f64], value: &[f64]) -> Signal {
    let (time, value) = (time.to_vec(), value.to_vec());
    Signal::TimeTable(TimeTable { time, value })
}

/// A harmonic about zero that neither begins nor ends.
pub fn wave(shape: HarmonicShape, amplitude: f64, frequency: Frequency, phase: f64) -> Wave {
    Wave {
        shape,
        mean: 0.0,
        amplitude,
        frequency,
        phase,
        from: None,
        to: None,
    }
}

/// A train without bearings and without a torque.
pub fn train(inertia: &[f64], stiffness: &[f64], damping: &[f64], end: End) -> Train {
    Train {
        inertia: inertia.to_vec(),
        stiffness: stiffness.to_vec(),
        damping: damping.to_vec(),
        viscous: vec![0.0; inertia.len()],
        end,
        torque: None,
    }
}

/// Two trains at rest whose contact has a radius of 1, and the breakaway that the law has at rest.
pub fn pair(rotor: Train, stator: Train, pressing: Pressing, law: impl Into<FrictionLaw>) -> System {
    let law = law.into();
    System {
        initial: Initial {
            rotor_twist: vec![0.0; rotor.stiffness.len()],
            rotor_speed: vec![0.0; rotor.inertia.len()],
            stator_twist: vec![0.0; stator.stiffness.len()],
            stator_speed: vec![0.0; stator.inertia.len()],
        },
        breakaway: law.at_vanishing_speed(),
        rotor,
        stator,
        radius: 1.0,
        pressing,
        breakaway_test: BreakawayTest::Transmitted,
        law,
        contact: ContactLaw::StickSlip,
        kicks: Vec::new(),
    }
}

/// The paper's brake in SI units (number 0), and others around it.
pub fn brake(number: u32) -> Parameters {
    let mut seed = u64::from(number);
    // Equally distributed in 1/by to by on a logarithmic scale.
    let mut around = |by: f64| {
        if number == 0 {
            return 1.0;
        }
        seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        by.powf((seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0)
    };
    let (low, high, decay) = (0.6 * around(1.2), 0.3 * around(1.3), 3.5 * around(6.0));
    let hyperbolic = Hyperbolic {
        low_speed: low,
        high_speed: high,
        scale: 1.0 / decay,
    };
    Parameters {
        axial: AXIAL,
        actuation: ramp(2225.0 * around(2.0), 1.0),
        torsion: Torsion {
            rotor_inertia: 2.262 * around(3.0),
            surface_inertia: 0.0113 * around(3.0),
            stiffness: 7.71e6 * around(3.0),
            damping: 22.606 * around(2.0),
        },
        contact: Contact {
            radius: 0.052388,
            breakaway_test: BreakawayTest::Transmitted,
        },
        friction: Friction {
            breakaway: low,
            law: if number % 3 == 2 {
                hyperbolic.into()
            } else {
                exponential(low, high, decay).into()
            },
        },
        initial: BrakeInitial { speed: 100.0 },
        perturbations: Vec::new(),
    }
}

/// A free rotor of three inertias against a tied stator of two, with bearings.
pub fn chains() -> System {
    let Parameters { contact, friction, .. } = brake(0);
    let mut rotor = train(&[0.012, 0.4, 1.9], &[7e6, 9e6], &[30.0, 40.0], End::Free);
    let mut stator = train(&[0.009, 0.05], &[6e6, 8e6], &[20.0, 50.0], End::Fixed);
    rotor.viscous = vec![0.01, 0.02, 0.3];
    stator.viscous = vec![0.5, 0.0];
    let force = Pressing::Force(Drive::Value(2000.0));
    let mut chains = System {
        radius: contact.radius,
        breakaway: friction.breakaway,
        breakaway_test: contact.breakaway_test,
        ..pair(rotor, stator, force, friction.law)
    };
    chains.initial.rotor_speed = vec![20.0; 3];
    chains
}
