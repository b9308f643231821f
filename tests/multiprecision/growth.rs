//! The instability: every method sees it, and its growth is compared with the multiprecision run without a
//! perturbation.

use crate::common::cases::near;
use crate::common::{output, run, solver, truth};
use stickslip::analysis::{Growth, Summary};
use stickslip::model::system::System;
use stickslip::model::{DiskKick, KickTime};
use stickslip::record::EventKind;
use stickslip::simulation::natural_period;
use stickslip::simulation::{Method, SolverOptions};

/// The smooth path of the growth exponent ends where exact sliding without a perturbation sticks (120-digit run). Its
/// last step of 0.1 ms is cut linearly, at a deceleration that changes by a per cent within it: 1e-7 s.
#[test]
fn multiprecision_smooth_sliding_ends_at_the_exact_stick() {
    let truth = truth("si-unperturbed");
    let (recorder, report) = run(
        &truth.parameters,
        &SolverOptions::default(),
        &output(truth.end_time, 0.1),
    );
    let growth =
        Growth::of_run(&System::from(&truth.parameters), &recorder.events, report.end).expect("it loses stability");
    let error = (growth.smooth_end - truth.events[0].time).abs();
    assert!(error < 1e-6, "{error:e}");
    assert!((80.0..95.0).contains(&growth.exponent), "{}", growth.exponent);
}

/// Without a perturbation the run's onset is noise, and the summary says so; with one it is not.
#[test]
fn property_noise_is_called_noise() {
    let mut parameters = truth("si-unperturbed").parameters;
    let (_, report) = run(&parameters, &SolverOptions::default(), &output(7.1, 0.1));
    let summary = Summary::of_run(&System::from(&parameters), &report);
    assert!(summary.noise_determined);
    // The exact run has one stick; this run has those that its rounding makes.
    assert!(summary.sticks > 1);
    parameters.perturbations = vec![DiskKick {
        time: KickTime::Instability,
        relative_velocity: 1e-4,
    }];
    let (_, report) = run(&parameters, &SolverOptions::default(), &output(7.1, 0.1));
    assert!(!Summary::of_run(&System::from(&parameters), &report).noise_determined);
}

/// A kick that reverses the sliding, seconds before, takes the margin of stability through zero and back, and is
/// damped out. The instability is the last one, and its growth starts from rounding as without a kick.
#[test]
fn property_a_large_early_kick_leaves_the_onset_to_noise() {
    let mut parameters = truth("si-unperturbed").parameters;
    parameters.perturbations = vec![DiskKick {
        time: KickTime::At(0.5),
        relative_velocity: -500.0,
    }];
    let (recorder, report) = run(&parameters, &SolverOptions::default(), &output(7.1, 0.1));
    let early = recorder.events.iter().find(|e| e.kind == EventKind::Destabilised);
    assert!(early.is_some_and(|e| e.time < 0.51));
    let summary = Summary::of_run(&System::from(&parameters), &report);
    assert!(summary.noise_determined);
    assert!(summary.instability_time.is_some_and(|t| t > 6.8));
    // The margin is lost at the same speed as without the kick, so that the growth is the same.
    let exponent = summary.growth_exponent.expect("it loses stability");
    let truth = truth("si-unperturbed");
    let (_, undisturbed) = run(&truth.parameters, &SolverOptions::default(), &output(7.1, 0.1));
    let expected = Summary::of_run(&System::from(&truth.parameters), &undisturbed).growth_exponent;
    near(exponent, expected.expect("it loses stability"), 1e-3);
}

/// G belongs to the case: it does not depend on the end time of the run.
#[test]
fn property_growth_exponent_is_that_of_the_whole_slide() {
    let parameters = truth("si-unperturbed").parameters;
    let exponent = |end| {
        let (_, report) = run(&parameters, &SolverOptions::default(), &output(end, 0.1));
        Summary::of_run(&System::from(&parameters), &report)
            .growth_exponent
            .expect("it loses stability")
    };
    let (cut, whole) = (exponent(6.96), exponent(7.1));
    assert!((cut - whole).abs() < 1e-3 * whole, "{cut} {whole}");
}

/// The same by `series`, which stays on smooth sliding: one stick, the exact one, and no warning.
#[test]
fn multiprecision_smooth_sliding_is_not_noise() {
    let truth = truth("si-unperturbed");
    let (_, report) = run(
        &truth.parameters,
        &solver(Method::Series, SolverOptions::default().rtol),
        &output(7.1, 0.1),
    );
    let summary = Summary::of_run(&System::from(&truth.parameters), &report);
    assert!(report.stopped_smoothly && !summary.noise_determined);
    assert_eq!((summary.sticks, summary.slips), (1, 0));
}

/// Growth of the kick in e-folds, by the eigenvalues, against the amplitudes: from half the kick on each surface to a
/// relative velocity that reaches zero, so that the oscillation has the size of the sliding speed. Within one e-fold,
/// because the phase of the crossing and the nonlinearity of the last periods are unknown.
#[test]
fn multiprecision_kick_grows_as_the_eigenvalues_say() {
    for case in ["paper", "si-kick"] {
        let truth = truth(case);
        let (recorder, report) = run(
            &truth.parameters,
            &SolverOptions::default(),
            &output(truth.end_time, 0.1),
        );
        let growth =
            Growth::of_run(&System::from(&truth.parameters), &recorder.events, report.end).expect("it loses stability");
        let kick = truth.parameters.perturbations[0].relative_velocity;
        let first = &truth.events[0].state;
        let theta_dot = first.iter().find(|(n, _)| n == "theta_dot").expect("theta_dot").1;
        let expected = (theta_dot / kick).ln();
        let gained = growth.from_kick.expect("a kick");
        assert!((gained - expected).abs() < 1.0, "{case}: {gained} against {expected}");
    }
}

/// From the loss of stability to the final stick no step is longer than a nineteenth of the natural period, for any
/// method and tolerance; the resolved steps are a twentieth. (`series` needs no such bound: its steps are as long as
/// order 24 allows, and it steps over the fast mode only where the exact solution is smooth sliding, which
/// multiprecision/events compares.)
#[test]
fn property_no_method_strides_over_the_instability() {
    let truth = truth("si-kick");
    let period = natural_period(&System::from(&truth.parameters)).unwrap();
    for method in Method::KINDS.into_iter().filter(|&m| m != Method::Series) {
        for perturbed in [true, false] {
            let mut parameters = truth.parameters.clone();
            if !perturbed {
                parameters.perturbations.clear();
            }
            let mut output = output(6.9905, 10.0);
            output.steps = true;
            let (recorder, _) = run(&parameters, &solver(method, 1e-6), &output);
            let time = |kind| recorder.events.iter().filter(move |e| e.kind == kind).map(|e| e.time);
            let start = time(EventKind::Destabilised).next().expect("it loses stability");
            let end = time(EventKind::Stick).next_back().expect("it sticks");
            // Sticks in closed form have no steps: only slips are examined, from sample to sample within a segment.
            let longest = recorder
                .samples
                .windows(2)
                .filter(|p| p[0].segment == p[1].segment && p[0].time > start && p[1].time < end)
                .filter(|p| p[0].mode.sense() != 0)
                .map(|p| p[1].time - p[0].time)
                .fold(0.0, f64::max);
            assert!(longest > 0.0, "{}: {longest:e}", method.name());
            assert!(longest < period / 19.0, "{}: {longest:e}", method.name());
        }
    }
}
