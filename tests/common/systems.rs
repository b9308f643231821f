//! Systems around the paper's brake, for tests of the equations.

use stickslip::friction::{Exponential, Friction, Hyperbolic};
use stickslip::model::system::{ContactLaw, End, Initial, Pressing, System, Train};
use stickslip::model::{Axial, BreakawayTest, Contact, DiskInitial as BrakeInitial, Parameters, Torsion};
use stickslip::signal::{Drive, Ramp, Signal};

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
    let exponential = Exponential {
        low_speed: low,
        high_speed: high,
        decay,
    };
    let hyperbolic = Hyperbolic {
        low_speed: low,
        high_speed: high,
        scale: 1.0 / decay,
    };
    Parameters {
        axial: Axial {
            mass: 4.54,
            stiffness: 55.38e6,
            damping: 8760.0,
            ringing_floor: Axial::RINGING_FLOOR,
        },
        actuation: Signal::Ramp(Ramp {
            value: 2225.0 * around(2.0),
            rise_time: 1.0,
        }),
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
                exponential.into()
            },
        },
        initial: BrakeInitial { speed: 100.0 },
        perturbations: Vec::new(),
    }
}

/// A free rotor of three inertias against a tied stator of two, with bearings.
pub fn chains() -> System {
    let Parameters { contact, friction, .. } = brake(0);
    System {
        rotor: Train {
            inertia: vec![0.012, 0.4, 1.9],
            stiffness: vec![7e6, 9e6],
            damping: vec![30.0, 40.0],
            viscous: vec![0.01, 0.02, 0.3],
            end: End::Free,
            torque: None,
        },
        stator: Train {
            inertia: vec![0.009, 0.05],
            stiffness: vec![6e6, 8e6],
            damping: vec![20.0, 50.0],
            viscous: vec![0.5, 0.0],
            end: End::Fixed,
            torque: None,
        },
        radius: contact.radius,
        pressing: Pressing::Force(Drive::Value(2000.0)),
        breakaway: friction.breakaway,
        breakaway_test: contact.breakaway_test,
        law: friction.law,
        contact: ContactLaw::StickSlip,
        initial: Initial {
            rotor_twist: vec![0.0; 2],
            rotor_speed: vec![20.0; 3],
            stator_twist: vec![0.0; 2],
            stator_speed: vec![0.0; 2],
        },
        kicks: Vec::new(),
    }
}
