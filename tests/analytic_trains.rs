//! Runs of two trains against closed forms and published numbers.

use stickslip::Run;
use stickslip::friction::{Coulomb, FrictionLaw, Hyperbolic};
use stickslip::model::trains::parameters::*;
use stickslip::record::{EventKind, MemoryRecorder};
use stickslip::signal::Drive;
use stickslip::simulation::{Method, OutputOptions, SolverOptions};

fn train(inertia: &[f64], stiffness: &[f64], damping: &[f64], end: End) -> Train {
    Train {
        inertia: inertia.to_vec(),
        stiffness: stiffness.to_vec(),
        damping: damping.to_vec(),
        viscous: vec![0.0; inertia.len()],
        end,
        torque: None,
    }
}

/// A mass on a belt, in translation.
fn belt(
    speed: f64,
    mass: f64,
    stiffness: f64,
    damping: f64,
    law: FrictionLaw,
    breakaway: f64,
    contact: ContactLaw,
) -> Trains {
    Trains {
        rotor: train(&[], &[], &[], End::Driven(Drive::Value(speed))),
        stator: train(&[mass], &[stiffness], &[damping], End::Fixed),
        radius: 1.0,
        pressing: Pressing::Force(Drive::Value(1.0)),
        breakaway,
        law,
        contact,
        initial: Initial {
            rotor_twist: vec![],
            rotor_speed: vec![],
            stator_twist: vec![1.0],
            stator_speed: vec![speed],
        },
        kicks: vec![],
    }
}

fn events(trains: &Trains, method: Method, end: f64) -> MemoryRecorder {
    let solver = SolverOptions {
        method,
        ..SolverOptions::default()
    };
    let output = OutputOptions {
        end_time: end,
        interval: end / 1000.0,
        windows: vec![],
        steps: false,
    };
    let mut recorder = MemoryRecorder::default();
    let report = Run::of_trains(trains, 1e-2, &solver, &output)
        .record(&mut recorder)
        .start()
        .unwrap();
    println!(
        "{}: {} events, residual {:e}, work {:?}",
        method.name(),
        recorder.events.len(),
        report.energy_residual,
        report.work
    );
    recorder
}

#[test]
fn published_leine() {
    let law: FrictionLaw = Hyperbolic {
        low_speed: 1.0,
        high_speed: 0.0,
        scale: 1.0 / 3.0,
    }
    .into();
    let trains = belt(0.2, 1.0, 1.0, 0.0, law, 1.0, ContactLaw::StickSlip);
    for method in [
        Method::Series,
        Method::Auto,
        Method::Erk,
        Method::CvodeBdf,
        Method::CvodeAdams,
        Method::Esdirk,
    ] {
        let recorder = events(&trains, method, 40.0);
        for event in &recorder.events {
            println!(
                "{:.16} {:?} {:?} {:.16}",
                event.time, event.kind, event.mode_after, event.before.phi1
            );
        }
        let sticks: Vec<f64> = recorder
            .events
            .iter()
            .filter(|e| e.kind == EventKind::Stick)
            .map(|e| e.time)
            .collect();
        println!(
            "{:e} {:e}",
            sticks[0] - 4.295999525480154883,
            sticks[1] - sticks[0] - 12.00103129483057865
        );
    }
}

#[test]
fn analytic_coulomb() {
    let law: FrictionLaw = Coulomb { kinetic: 0.5 }.into();
    let trains = belt(0.3, 2.0, 3.0, 0.0, law, 0.8, ContactLaw::StickSlip);
    for method in [Method::Series, Method::Auto] {
        let recorder = events(&trains, method, 40.0);
        let times: Vec<f64> = recorder.events.iter().map(|e| e.time).collect();
        let w = (3.0f64 / 2.0).sqrt();
        let d = 0.3;
        println!(
            "{times:?} slip {} stick {}",
            (std::f64::consts::PI + 2.0 * (0.3 * 3.0 / (w * d)).atan()) / w,
            2.0 * d / (3.0 * 0.3)
        );
    }
}

#[test]
fn published_block() {
    let mut trains = belt(
        0.0,
        1.0,
        1.0,
        0.0,
        Coulomb { kinetic: 0.8 }.into(),
        0.8,
        ContactLaw::StickSlip,
    );
    trains.rotor = train(&[1.0], &[], &[], End::Free);
    trains.rotor.torque = Some(Torque {
        signal: Drive::Wave(stickslip::signal::Wave {
            shape: stickslip::signal::Shape::Cosine,
            mean: 0.0,
            amplitude: 8.0,
            frequency: stickslip::signal::Frequency::Angular(1.0),
            phase: 0.0,
            from: None,
            to: None,
        }),
        on: 0,
    });
    trains.stator = train(&[], &[], &[], End::Fixed);
    trains.pressing = Pressing::Force(Drive::Value(9.81));
    trains.initial = Initial {
        rotor_twist: vec![],
        rotor_speed: vec![0.0],
        stator_twist: vec![],
        stator_speed: vec![],
    };
    for method in [Method::Series, Method::Erk] {
        let recorder = events(&trains, method, 10.0);
        for event in &recorder.events {
            println!("{:.16} {:?}", event.time, event.kind);
        }
    }
}

#[test]
fn published_regularised() {
    for (function, period) in [(Smoothing::Arctan, 11.29815066), (Smoothing::Tanh, 11.90059994)] {
        let law: FrictionLaw = Hyperbolic {
            low_speed: 1.0,
            high_speed: 0.0,
            scale: 1.0 / 3.0,
        }
        .into();
        let trains = belt(
            0.2,
            1.0,
            1.0,
            0.0,
            law,
            1.0,
            ContactLaw::Regularised(Regularisation { function, speed: 1e-3 }),
        );
        for method in [Method::Series, Method::Auto, Method::CvodeBdf] {
            let recorder = events(&trains, method, 60.0);
            let sticks: Vec<f64> = recorder
                .events
                .iter()
                .filter(|e| e.kind == EventKind::Slip)
                .map(|e| e.time)
                .collect();
            println!("{:?} {:e}", sticks, sticks[3] - sticks[2] - period);
        }
    }
}
