//! Laws that every run obeys. A hundred times more accuracy changes nothing that can be known.

use crate::common::rigid_growth::rigid_growth;
use crate::common::{event_sequence, output, run, solver, truth};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use stickslip::analysis::{Growth, Summary};
use stickslip::friction::{Exponential, Friction};
use stickslip::model::system::System;
use stickslip::model::{DiskKick, KickTime, Mode, Parameters};
use stickslip::record::{EventKind, MemoryRecorder};
use stickslip::signal::{Ramp, Signal, TimeTable};
use stickslip::simulation::{Method, RunReport, SolverOptions};

/// A brake near the paper's, and the end of its run shortly after the stop.
#[derive(Debug, Clone)]
struct Run {
    parameters: Parameters,
    end: f64,
}

prop_compose! {
    fn frictions()(
        high_speed in 0.1..0.4f64, friction_drop in 0.0..0.4f64, above in prop_oneof![Just(0.0), 0.0..0.1f64],
        decay in 0.0..20.0f64,
    ) -> Friction {
        let low_speed = high_speed + friction_drop;
        Friction { breakaway: low_speed + above, law: Exponential { low_speed, high_speed, decay }.into() }
    }
}

prop_compose! {
    /// Points of a force table before the last one: (time as a fraction of the stop, force in N).
    fn tables()(
        first in 0.0..2225.0f64, points in prop::collection::vec((0.02..0.12f64, 200.0..4000.0f64), 1..6),
    ) -> (f64, Vec<(f64, f64)>) {
        let mut part = 0.0;
        let points = points.into_iter().map(|(step, force)| { part += step; (part, force) }).collect();
        (first, points)
    }
}

prop_compose! {
    fn runs()(
        friction in frictions(), damping in 8.0..60.0f64, lightening in 1.0..5.0f64,
        speed in 1.0..100.0f64, backward in any::<bool>(), rise_time in 0.01..1.0f64,
        kick in -5.0..-2.0f64, timed in prop_oneof![3 => Just(None), 1 => (0.0..1.0f64).prop_map(Some)],
        table in prop_oneof![2 => Just(None), 1 => tables().prop_map(Some)],
    ) -> Run {
        let mut parameters = truth("si-kick").parameters;
        parameters.friction = friction.clone();
        parameters.torsion.damping = damping;
        parameters.torsion.surface_inertia /= lightening;
        parameters.initial.speed = if backward { -speed } else { speed };
        let force = 2225.0;
        parameters.actuation = Signal::Ramp(Ramp { value: force, rise_time });
        // The stop takes longest with mu_d alone. Half of the rise time passes as if without force.
        let inertia = parameters.torsion.rotor_inertia + parameters.torsion.surface_inertia;
        let slowing = friction.law.as_exponential().unwrap().high_speed * parameters.contact.radius * force / inertia;
        let stop = 0.5 * rise_time + speed / slowing;
        let (mut end, force_of_end) = (1.02 * stop.max(1.5 * rise_time) + 0.01, force);
        if let Some((first, points)) = table {
            let (mut time, mut forces) = (vec![0.0], vec![first]);
            for (part, force) in points {
                time.push(part * stop);
                forces.push(force);
            }
            time.push(time[time.len() - 1] + 0.1 * stop);
            forces.push(force_of_end);
            // The weakest force may last for the whole table.
            end += time[time.len() - 1];
            parameters.actuation = Signal::TimeTable(TimeTable { time, value: forces });
        }
        let time = timed.map_or(KickTime::Instability, |part| KickTime::At(part * stop));
        parameters.perturbations = vec![DiskKick { time, relative_velocity: 10f64.powf(kick) }];
        Run { parameters, end }
    }
}

/// Draws the same cases on every machine and in every run.
fn runner(cases: u32) -> TestRunner {
    let config = Config {
        cases,
        failure_persistence: None,
        max_shrink_iters: 64,
        ..Config::default()
    };
    TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha))
}

fn compute(run_: &Run, method: Method, rtol: f64) -> (MemoryRecorder, RunReport) {
    run(
        &run_.parameters,
        &solver(method, rtol),
        &output(run_.end, run_.end / 200.0),
    )
}

/// Checks that sticks follow slips and slips follow sticks, that a reversal turns the sense, that the contact opens
/// and closes in turn, and that time increases. The states before and after events are those of their modes.
fn check_order(parameters: &Parameters, recorder: &MemoryRecorder) -> Result<(), TestCaseError> {
    let mut mode = if parameters.initial.speed > 0.0 {
        Mode::SlipForward
    } else {
        Mode::SlipBackward
    };
    let mut time = 0.0;
    for event in &recorder.events {
        prop_assert!(event.time >= time, "{} after {time}", event.time);
        time = event.time;
        let after = event.mode_after;
        let legal = match event.kind {
            EventKind::Stick => mode.sense() != 0 && after == Mode::Stick,
            EventKind::Slip => mode == Mode::Stick && after.sense() != 0,
            EventKind::Reversal => mode.sense() != 0 && after.sense() == -mode.sense(),
            EventKind::Separation => mode != Mode::Separated && after == Mode::Separated,
            EventKind::Contact => mode == Mode::Separated && after != Mode::Separated,
            EventKind::Kick | EventKind::Corner | EventKind::Destabilised | EventKind::Restabilised => after == mode,
        };
        prop_assert!(legal, "{:?} from {mode:?} to {after:?} at {time}", event.kind);
        let s = &event.after;
        if after == Mode::Stick {
            prop_assert_eq!(s.relative_velocity, 0.0);
        }
        if event.kind == EventKind::Slip {
            // The slip starts in the sense of the torque that has reached the limit.
            prop_assert_eq!(f64::from(after.sense()), event.internal_force.signum());
        }
        mode = after;
    }
    prop_assert!(recorder.samples.windows(2).all(|p| p[0].time < p[1].time));
    for pair in recorder.segments.windows(2) {
        prop_assert_eq!(pair[0].end, pair[1].start);
    }
    for sample in &recorder.samples {
        let w = sample.state.relative_velocity;
        // Samples extend to the next event, which is located up to the rounding of the speeds.
        prop_assert!(f64::from(sample.mode.sense()) * w >= -1e-12, "{w} in {:?}", sample.mode);
        prop_assert!(sample.channels.friction_torque * w >= -1e-9);
    }
    Ok(())
}

/// Compares the growth, which decides what can be compared, with the quasi-static integral. This neglects the rotor's
/// part in the mode and its twist, of order J/I, and an e-fold if the first stick cuts the last periods.
fn check_growth(run_: &Run, recorder: &MemoryRecorder, summary: &Summary) -> Result<(), TestCaseError> {
    let (Some(instability), Some(growth)) = (summary.instability_time, summary.growth_to_onset) else {
        return Ok(());
    };
    let lost = |e: &&stickslip::record::Event| e.kind == EventKind::Destabilised && e.time == instability;
    let mut events = recorder.events.iter();
    let speed = events.find(lost).expect("the loss").before.relative_velocity;
    let end = summary.onset_time.unwrap_or(summary.end);
    let rigid = rigid_growth(&run_.parameters, instability, speed, end);
    prop_assert!(
        (growth - rigid).abs() < 0.03 * rigid + 1.0,
        "growth {growth}, quasi-static {rigid}"
    );
    Ok(())
}

/// e-folds of the kick at the first stick above the noise of the solver, which is a few roundings, e^2; infinite
/// without growth. A fraction e of noise shifts the stick by e over the growth rate of 1000 1/s: e^-14 gives 1e-9 s.
fn kick_over_noise(summary: &Summary) -> f64 {
    summary.growth_to_onset.map_or(f64::INFINITY, |_| {
        summary.kick_above_noise.map_or(f64::INFINITY, |e_folds| e_folds - 2.0)
    })
}

const CASES: u32 = 100;

#[test]
fn property_runs_are_lawful_and_reproducible_with_more_accuracy() {
    let counts = std::cell::Cell::new((0, 0, 0, 0.0f64));
    runner(CASES)
        .run(&runs(), |case| {
            let (recorder, report) = compute(&case, Method::Arkode, SolverOptions::default().rtol);
            check_order(&case.parameters, &recorder)?;
            // Losses are integrated with the state, to rounding, so they are far below the bound.
            prop_assert!(
                report.energy_residual < 1e-9 * report.initial_energy,
                "energy {:e}",
                report.energy_residual / report.initial_energy
            );
            let (mut compared, mut noise, mut events, mut worst) = counts.get();
            let (tight, tight_report) = compute(&case, Method::Arkode, 1e-12);
            check_order(&case.parameters, &tight)?;
            let summary = Summary::of_run(&System::from(&case.parameters), &report);
            let tight_summary = Summary::of_run(&System::from(&case.parameters), &tight_report);
            check_growth(&case, &recorder, &summary)?;
            prop_assert_eq!(summary.noise_determined, tight_summary.noise_determined);
            if summary.noise_determined || kick_over_noise(&summary) <= 14.0 {
                noise += 1;
            } else {
                compared += 1;
                let (word, tight_word) = (event_sequence(&recorder), event_sequence(&tight));
                let kinds = |w: &[(EventKind, f64)]| w.iter().map(|e| e.0.name()).collect::<Vec<_>>();
                prop_assert_eq!(kinds(&word), kinds(&tight_word));
                for (a, b) in word.iter().zip(&tight_word) {
                    worst = worst.max((a.1 - b.1).abs());
                    prop_assert!((a.1 - b.1).abs() < 1e-9, "{:?} {:?}", a, b);
                }
                events += word.len();
            }
            counts.set((compared, noise, events, worst));
            Ok(())
        })
        .unwrap_or_else(|error| panic!("{error}"));
    let (compared, noise, events, worst) = counts.get();
    println!("{compared} runs with {events} events agree within {worst:.1e} s; {noise} are noise");
    assert!(compared >= CASES / 2, "{compared}");
}

#[test]
fn property_series_and_arkode_agree() {
    let counts = std::cell::Cell::new((0, 0, 0, 0, 0.0f64));
    runner(CASES)
        .run(&runs(), |case| {
            let (recorder, report) = compute(&case, Method::Series, SolverOptions::default().rtol);
            check_order(&case.parameters, &recorder)?;
            let residual = report.energy_residual / report.initial_energy;
            prop_assert!(residual < 1e-12, "energy {residual:e}");
            let (arkode, arkode_report) = compute(&case, Method::Arkode, 1e-13);
            let summary = Summary::of_run(&System::from(&case.parameters), &arkode_report);
            let margin = kick_over_noise(&summary);
            let (word, expected) = (event_sequence(&recorder), event_sequence(&arkode));
            let kinds = |w: &[(EventKind, f64)]| w.iter().map(|e| e.0.name()).collect::<Vec<_>>();
            let pairs = word.iter().zip(&expected);
            let worst = pairs.map(|(a, b)| (a.1 - b.1).abs()).fold(0.0, f64::max);
            let (mut compared, mut close, mut noise, mut events, mut largest) = counts.get();
            if summary.noise_determined || margin <= 14.0 {
                noise += 1;
            } else {
                prop_assert_eq!(kinds(&word), kinds(&expected));
                // Noise of e^-18.5 shifts the first stick by 1e-11 s; see [`kick_over_noise`].
                let limit = if margin > 18.5 { 1e-11 } else { 1e-9 };
                close += usize::from(margin > 18.5);
                prop_assert!(
                    worst < limit,
                    "{worst:e} with the kick {margin} e-folds above the noise"
                );
                (compared, events, largest) = (compared + 1, events + word.len(), largest.max(worst));
            }
            counts.set((compared, close, noise, events, largest));
            Ok(())
        })
        .unwrap_or_else(|error| panic!("{error}"));
    let (compared, close, noise, events, largest) = counts.get();
    println!(
        "{compared} runs with {events} events agree within {largest:.1e} s, {close} of them well above rounding; {noise} \
         are noise by arkode"
    );
    assert!(compared >= CASES / 2 && close >= 20, "{compared} {close}");
}

/// Without a kick, `series` follows smooth sliding to its stop if it reports this, however unstable the sliding is. It
/// stops where Runge-Kutta steps on the slow manifold stop. These 300 steps of order 4, which start at the
/// instability, end within 1e-7 s.
#[test]
fn property_series_follows_smooth_sliding_to_its_stop() {
    let counts = std::cell::Cell::new((0, 0, 0.0f64));
    runner(CASES)
        .run(&runs(), |mut case| {
            case.parameters.perturbations.clear();
            let (recorder, report) = compute(&case, Method::Series, SolverOptions::default().rtol);
            check_order(&case.parameters, &recorder)?;
            let growth = Growth::of_run(&System::from(&case.parameters), &report.events, report.end);
            let stick = event_sequence(&recorder).into_iter().find(|e| e.0 == EventKind::Stick);
            if let (Some(growth), Some(stick), true) = (growth, stick, report.stopped_smoothly) {
                let (mut smooth, mut beyond_rounding, mut largest) = counts.get();
                smooth += 1;
                beyond_rounding += usize::from(growth.to_first_stick > 36.7);
                let error = (stick.1 - growth.smooth_end).abs();
                largest = largest.max(error);
                prop_assert!(error < 1e-7, "{error:e} at a growth of {}", growth.exponent);
                prop_assert!(!Summary::of_run(&System::from(&case.parameters), &report).noise_determined);
                counts.set((smooth, beyond_rounding, largest));
            }
            Ok(())
        })
        .unwrap_or_else(|error| panic!("{error}"));
    let (smooth, beyond_rounding, largest) = counts.get();
    println!("{smooth} stops within {largest:.1e} s, {beyond_rounding} after more growth than a double has digits");
    assert!(smooth >= 25 && beyond_rounding >= 10);
}

/// Samples of `series` come from the polynomials of its steps. For any number of samples, the events and the segments
/// with all their counters are bitwise the same.
#[test]
fn property_samples_cost_series_no_steps() {
    let parameters = truth("si-kick").parameters;
    let sampled = |interval: f64| {
        let method = solver(Method::Series, SolverOptions::default().rtol);
        let (recorder, _) = run(&parameters, &method, &output(7.1, interval));
        recorder
    };
    let (few, many) = (sampled(7.1), sampled(5e-5));
    assert!(few.samples.len() < 10 && many.samples.len() > 100_000);
    assert_eq!(few.segments, many.segments);
    assert_eq!(few.events, many.events);
    assert!(few.segments.iter().map(|segment| segment.counters.steps).sum::<u64>() > 500);
}
