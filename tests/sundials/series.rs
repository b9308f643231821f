//! `series` against the solvers of SUNDIALS: the same event sequence and the same times, in every kind of case.
//!
//! Two methods that share nothing but the equations and the rules. `arkode` at rtol 1e-13 is itself within 1e-12 s of the
//! multiprecision events; 1e-11 s is ten times that.

use crate::common::cases::built_in;
use crate::common::systems::{exponential, ramp, table};
use crate::common::{disks, event_sequence, output, run, solver, truth};
use stickslip::Run;
use stickslip::engine::ErrorKind;
use stickslip::friction::Friction;
use stickslip::model::system::System;
use stickslip::model::{BreakawayTest, DiskKick, KickTime, Parameters};
use stickslip::record::{EventKind, MemoryRecorder};
use stickslip::simulation::{Method, SolverOptions};

const WITHIN: f64 = 1e-11;

fn kick(time: KickTime, relative_velocity: f64) -> DiskKick {
    DiskKick {
        time,
        relative_velocity,
    }
}

/// The brake of `paper-si` from a lower speed, with a kick at the instability.
fn brake(speed: f64, rise_time: f64) -> Parameters {
    let mut parameters = truth("si-kick").parameters;
    parameters.initial.speed = speed;
    parameters.actuation = ramp(2225.0, rise_time);
    parameters.perturbations = vec![kick(KickTime::Instability, 1e-3)];
    parameters
}

/// Asserts the same events by both, all kinds, and returns those of `series`.
fn hold(name: &str, parameters: &Parameters, end: f64) -> MemoryRecorder {
    let out = output(end, end / 500.0);
    let (series, _) = run(parameters, &solver(Method::Series, SolverOptions::default().rtol), &out);
    let (arkode, _) = run(parameters, &solver(Method::Arkode, 1e-13), &out);
    let kinds = |r: &MemoryRecorder| {
        let kind = |e: &stickslip::record::Event| (e.kind, e.mode_after);
        r.events.iter().map(kind).collect::<Vec<_>>()
    };
    assert_eq!(kinds(&series), kinds(&arkode), "{name}");
    let late = |(a, b): (&stickslip::record::Event, &stickslip::record::Event)| (a.time - b.time).abs();
    let worst = series.events.iter().zip(&arkode.events).map(late).fold(0.0, f64::max);
    println!("{name}: {} events within {worst:.1e} s", series.events.len());
    assert!(worst < WITHIN, "{name}: {worst:e} s");
    assert!(
        series
            .segments
            .iter()
            .all(|s| ["series", "closed-form"].contains(&s.solver))
    );
    series
}

fn count(recorder: &MemoryRecorder, kind: EventKind) -> usize {
    event_sequence(recorder).iter().filter(|e| e.0 == kind).count()
}

#[test]
fn sundials_release_and_grip() {
    let case = built_in("release", &[]);
    let recorder = hold("release", &disks(&case), case.output.end_time);
    assert!(count(&recorder, EventKind::Separation) >= 2 && count(&recorder, EventKind::Stick) >= 2);
}

/// Without torsional damping the stability margin is zero where the contact force is. A contact that begins there goes on.
#[test]
fn sundials_release_without_torsional_damping() {
    let mut parameters = disks(&built_in("release", &[]));
    parameters.torsion.damping = 0.0;
    let out = output(0.46, 1e-3);
    let by = |method, rtol| event_sequence(&run(&parameters, &solver(method, rtol), &out).0);
    let series = by(Method::Series, SolverOptions::default().rtol);
    let arkode = by(Method::Arkode, 1e-12);
    assert!(series.iter().any(|e| e.0 == EventKind::Contact), "{series:?}");
    assert_eq!(series.len(), arkode.len(), "{series:?}, {arkode:?}");
    for ((kind, time), other) in series.iter().zip(&arkode) {
        assert!(*kind == other.0, "{series:?}, {arkode:?}");
        assert!((time - other.1).abs() < WITHIN, "{series:?}, {arkode:?}");
    }
}

/// A table whose force rises and falls while the brake slides and sticks.
#[test]
fn sundials_a_table() {
    let mut parameters = brake(20.0, 1.0);
    parameters.actuation = table(
        &[0.0, 0.05, 0.4, 0.7, 0.9, 1.3],
        &[500.0, 2500.0, 1500.0, 3000.0, 2000.0, 2225.0],
    );
    let recorder = hold("table", &parameters, 2.0);
    assert!(count(&recorder, EventKind::Stick) >= 10);
}

/// Separation in the middle of the stick-slip, and contact again.
#[test]
fn sundials_a_release_out_of_stick_slip() {
    let mut parameters = brake(4.0, 0.0);
    let stops = {
        let recorder = hold("step", &parameters, 0.4);
        recorder
            .events
            .iter()
            .filter(|e| e.kind == EventKind::Stick)
            .map(|e| e.time)
            .collect::<Vec<_>>()
    };
    assert!(stops.len() >= 10);
    // Within a stick: at its very start rounding would decide which comes first, the stick or the corner.
    let release = stops[3] + 1e-6;
    parameters.actuation = table(
        &[0.0, release, release + 0.002, release + 0.01, release + 0.02],
        &[2225.0, 2225.0, -500.0, -500.0, 2225.0],
    );
    let recorder = hold("release out of stick-slip", &parameters, 0.6);
    assert!(count(&recorder, EventKind::Separation) >= 1 && count(&recorder, EventKind::Contact) >= 1);
}

#[test]
fn sundials_mu_0_above_mu_s() {
    for breakaway in [0.601, 0.65, 0.8] {
        let mut parameters = brake(15.0, 0.2);
        parameters.friction.breakaway = breakaway;
        let recorder = hold(&format!("mu_0 = {breakaway}"), &parameters, 1.5);
        assert!(count(&recorder, EventKind::Stick) >= 3);
    }
}

/// Friction that grows with speed never loses its stability, and constant friction is neither.
#[test]
fn sundials_other_friction() {
    for (name, low_speed, high_speed, decay) in [("rising", 0.3, 0.4, 2.0), ("constant", 0.4, 0.4, 3.5)] {
        let mut parameters = brake(10.0, 0.1);
        parameters.friction = Friction {
            breakaway: low_speed,
            law: exponential(low_speed, high_speed, decay).into(),
        };
        let recorder = hold(name, &parameters, 1.5);
        assert_eq!(count(&recorder, EventKind::Stick), 1);
    }
}

/// Kicks that turn the sliding round, so that it passes through zero by itself, too; forward and backward. The run ends
/// before the last stop, whose onset would belong to rounding: the kicks' oscillation has died by then.
#[test]
fn sundials_reversals_by_kicks() {
    for speed in [10.0, -10.0] {
        let mut parameters = brake(speed, 0.1);
        parameters.perturbations = vec![
            kick(KickTime::At(0.2), -2.5 * speed),
            kick(KickTime::At(0.3), 0.7 * speed),
            kick(KickTime::At(0.31), -2.0 * speed),
        ];
        let recorder = hold(&format!("kicks from {speed} rad/s"), &parameters, 0.5);
        let found = count(&recorder, EventKind::Reversal);
        assert!(found >= 3, "{:?}", event_sequence(&recorder));
    }
}

/// A breakaway by the rotor's torque starts against the sense of its slip, by a hair.
#[test]
fn sundials_the_rotors_breakaway_test() {
    let mut parameters = truth("si-kick").parameters;
    parameters.contact.breakaway_test = BreakawayTest::Rotor;
    let recorder = hold("rotor test", &parameters, 7.1);
    assert!(count(&recorder, EventKind::Stick) > 40);
}

/// The stator's torque alone undoes each breakaway at once from some time on: chattering, seen by both at the same place.
#[test]
fn sundials_the_stators_breakaway_test_chatters() {
    let mut parameters = truth("si-kick").parameters;
    parameters.contact.breakaway_test = BreakawayTest::Stator;
    let [series, arkode] =
        [(Method::Series, SolverOptions::default().rtol), (Method::Arkode, 1e-13)].map(|(method, rtol)| {
            let failure = Run::of_system(
                &System::from(&parameters),
                0.0,
                &solver(method, rtol),
                &output(7.1, 0.1),
            )
            .record(&mut MemoryRecorder::default())
            .start()
            .expect_err("chattering");
            assert_eq!(
                failure.error.kind,
                ErrorKind::Chattering,
                "{}: {}",
                method.name(),
                failure.error
            );
            (failure.error.time, failure.report.events.len())
        });
    // The breakaways of chattering follow one another within rounding, so that their number may differ by some.
    assert!((series.0 - arkode.0).abs() < 1e-6, "{series:?} {arkode:?}");
    assert!(series.1.abs_diff(arkode.1) <= 20, "{series:?} {arkode:?}");
}

/// A surface so strongly damped that there is no oscillation, and one that is hardly damped at all.
#[test]
fn sundials_damping_at_its_ends() {
    for (damping, sticks) in [(1200.0, 1), (2.0, 50)] {
        let mut parameters = brake(5.0, 0.05);
        parameters.torsion.damping = damping;
        let recorder = hold(&format!("c_t = {damping}"), &parameters, 0.6);
        assert!(count(&recorder, EventKind::Stick) >= sticks);
    }
}
