//! The paper's procedure: valid sequences, equation (9) at its events, and the documented errors, measured against the
//! independent multiprecision truth.

use crate::common::cases::built_in;
use crate::common::{channel, disks, event_sequence, output, run, solver, truth};
use stickslip::analysis::CycleStatistics;
use stickslip::model::Mode;
use stickslip::record::{EventKind, MemoryRecorder};
use stickslip::simulation::procedure::{EPSILON, STEPS, Settings};
use stickslip::simulation::{Method, SolverOptions};

fn paper() -> SolverOptions {
    solver(Method::Paper, SolverOptions::default().rtol)
}

#[test]
fn property_the_tolerance_is_the_papers_by_default() {
    let settings = Settings::new(&paper());
    assert!((settings.tolerance - 1e-11).abs() < 1e-25);
    assert_eq!((settings.shortest_step, settings.longest_step), (1e-8, 1e-4));
}

/// Checks that each event connects the modes before and after it by its kind. Sticks are entered within epsilon.
fn hold_sequence(recorder: &MemoryRecorder) {
    let mut mode = recorder.segments[0].mode;
    let mut time = 0.0;
    for event in &recorder.events {
        assert!(event.time >= time);
        time = event.time;
        let slip = |mode: Mode| mode.sense() != 0;
        let after = event.mode_after;
        let legal = match event.kind {
            EventKind::Stick => slip(mode) && after == Mode::Stick,
            EventKind::Slip => mode == Mode::Stick && slip(after),
            EventKind::Reversal => slip(mode) && slip(after) && mode != after,
            EventKind::Separation => mode != Mode::Separated && after == Mode::Separated,
            EventKind::Contact => mode == Mode::Separated && after != Mode::Separated,
            _ => mode == after,
        };
        assert!(legal, "{event:?} in {mode:?}");
        mode = after;
        if event.kind == EventKind::Stick {
            assert!(event.before.relative_velocity.abs() < EPSILON);
            assert_eq!(event.after.relative_velocity, 0.0);
        }
    }
    // Segments join, give the mode, and respect the step limits.
    let mut end = 0.0;
    for segment in &recorder.segments {
        assert_eq!((segment.start, segment.solver), (end, "paper"));
        assert!(segment.end > segment.start && segment.counters.steps > 0);
        end = segment.end;
        let mean = (segment.end - segment.start) / segment.counters.steps as f64;
        // A step that ends at a kick or at the end of the run may be shorter.
        let least = (segment.counters.steps - 1) as f64 * STEPS.0;
        assert!(mean <= STEPS.1 * (1.0 + 1e-9) && segment.end - segment.start >= least * (1.0 - 1e-6));
    }
    assert!(recorder.samples.windows(2).all(|pair| pair[0].time < pair[1].time));
}

/// The kick is above the procedure's own noise. The onset errs by some microseconds: six orders of magnitude more than
/// the reference, but less than a hundredth of a period. The number of sticks is right. Most sticks follow false
/// reversals.
#[test]
fn multiprecision_paper_case_within_microseconds() {
    let truth = truth("paper");
    let (recorder, report) = run(&truth.parameters, &paper(), &output(truth.end_time, 0.0005));
    hold_sequence(&recorder);
    let found = CycleStatistics::of_events(recorder.events.iter().map(|e| (e.time, e.kind))).0;
    let error = (found.onset_time.unwrap() - truth.events[0].time).abs();
    println!("onset off by {error:e} s, {} sticks", found.stick_count);
    assert!((1e-9..1e-4).contains(&error), "onset off by {error:e} s");
    let sticks = truth.events.iter().filter(|e| e.kind == "stick").count();
    assert!(found.stick_count.abs_diff(sticks) <= 5);
    assert!(event_sequence(&recorder).iter().any(|e| e.0 == EventKind::Reversal));
    // Seven seconds of steps at the stability limit leave a larger residual than the reference's rounding.
    assert!(report.energy_residual < 1e-9 * report.initial_energy);

    // Before the onset, the samples are those of smooth sliding. The twist is a difference of angles of 370 rad, each
    // with 6e-14 rad, at a step tolerance of 1e-11. Its scale is 5e-6 rad.
    let smooth = truth.samples.iter().filter(|s| s.time < 6.96);
    let mut worst = 0.0f64;
    for expected in smooth {
        let sample = recorder
            .samples
            .iter()
            .find(|s| (s.time - expected.time).abs() < 1e-12)
            .unwrap();
        let value = |name: &str| expected.state.iter().find(|(n, _)| n == name).unwrap().1;
        worst = worst.max((channel(sample, "rotor_twist") - value("rotor_twist")).abs());
        assert!((channel(sample, "theta_dot") - value("theta_dot")).abs() < 1e-8);
    }
    println!("twist off by {worst:e} rad");
    assert!((1e-14..1e-9).contains(&worst), "twist off by {worst:e} rad");
}

/// The exact unperturbed case has one final stick. The procedure shows the stick-slip of its own noise, and a
/// tolerance a thousand times larger moves its onset by a thousandth of a second.
#[test]
fn multiprecision_unperturbed_case_is_noise() {
    let truth = truth("si-unperturbed");
    assert_eq!(truth.events.len(), 1);
    let onsets = [1e-10, 1e-7].map(|rtol| {
        let (recorder, _) = run(
            &truth.parameters,
            &solver(Method::Paper, rtol),
            &output(truth.end_time, 0.1),
        );
        hold_sequence(&recorder);
        let found = CycleStatistics::of_events(recorder.events.iter().map(|e| (e.time, e.kind))).0;
        assert!(found.stick_count > 20, "{} sticks", found.stick_count);
        found.onset_time.unwrap()
    });
    println!("onsets {onsets:?}");
    assert!(onsets.iter().all(|onset| *onset < truth.events[0].time - 0.005));
    assert!((onsets[0] - onsets[1]).abs() > 1e-5);
}

/// A release includes separations and contacts, accurate to the step in which they appear.
#[test]
fn property_release_is_legal() {
    let case = built_in("release", &[]);
    let by = |method| {
        let options = SolverOptions {
            method,
            ..case.solver.clone()
        };
        run(&disks(&case), &options, &output(0.35, 0.001)).0
    };
    let (paper, arkode) = (by(Method::Paper), by(Method::Arkode));
    hold_sequence(&paper);
    let first = |recorder: &MemoryRecorder, kind| event_sequence(recorder).iter().find(|e| e.0 == kind).unwrap().1;
    for kind in [EventKind::Separation, EventKind::Contact] {
        let late = first(&paper, kind) - first(&arkode, kind);
        assert!((0.0..=STEPS.1).contains(&late), "{kind:?}: {late:e} s");
    }
}
