//! Every event and sample of the independent multiprecision code (data/truth), by every method.
//!
//! The tolerances are those that the program promises: 1e-9 s by default and 1e-11 s at rtol = 1e-13, also for
//! `cvode`; 1e-6 s and 3e-8 s for the pure methods; and 1e-12 s for `series` at any rtol from the default on.

use crate::common::cases::{built_in, errors, exact_events, recorded};
use crate::common::{largest_event_error, largest_sample_error, output, run, solver, truth};
use stickslip::case::CaseSource;
use stickslip::record::EventKind;
use stickslip::simulation::{Method, SolverOptions};

fn check(case: &str, method: Method, rtol: f64, limit: f64) {
    let truth = truth(case);
    let (recorder, _) = run(
        &truth.parameters,
        &solver(method, rtol),
        &output(truth.end_time, 0.0005),
    );
    let error = largest_event_error(&truth, &recorder);
    let (sample_error, worst) = largest_sample_error(&truth, &recorder);
    println!(
        "{case} {} {rtol:e}: events {error:.2e} s, samples {sample_error:.2e} ({worst})",
        method.name()
    );
    assert!(error < limit, "{case}: an event is off by {error:e} s");
    if matches!(method, Method::Arkode | Method::Series) {
        // Largest error of a sample before the kick has been amplified to the first stick.
        let limit = if rtol > 1e-9 { 1e-6 } else { 1e-8 };
        assert!(sample_error < limit, "{case}: {worst} is off by {sample_error:e}");
    }
}

fn default_rtol() -> f64 {
    SolverOptions::default().rtol
}

/// Every method on `paper` and `paper-si`, whose kick is far above its noise. On `paper` the kick is near the noise of
/// BDF: nothing is promised for the pure methods, and they must reach ten times the errors of docs/theory.md.
#[test]
fn multiprecision_every_method_keeps_its_promise() {
    let default = default_rtol();
    for case in ["paper", "si-kick"] {
        for method in [Method::Arkode, Method::Cvode] {
            check(case, method, default, 1e-9);
            check(case, method, 1e-13, 1e-11);
        }
        by_series(case);
    }
    for method in [Method::CvodeBdf, Method::CvodeAdams, Method::Erk] {
        check("si-kick", method, default, 1e-6);
        check("si-kick", method, 1e-13, 3e-8);
    }
    for (method, limit) in [
        (Method::CvodeBdf, 2e-8),
        (Method::CvodeAdams, 4e-9),
        (Method::Erk, 7e-11),
        (Method::Esdirk, 5e-10),
    ] {
        check("paper", method, default, limit);
    }
}

fn by_series(case: &str) {
    for (rtol, limit) in [(default_rtol(), 1e-12), (1e-13, 1e-12), (1e-6, 1e-9)] {
        check(case, Method::Series, rtol, limit);
    }
}

/// Without a kick the exact brake slides over its unstable stretch to one stick. So does `series`, which steps over
/// the fast mode and damps the rounding in it. No other method can.
#[test]
fn multiprecision_unperturbed_series() {
    by_series("si-unperturbed");
}

/// Separations, contacts, corners and a kick at the instability, against the oracle: all events within 1e-9 s, and those of
/// the sequence within the promise of their tolerance.
#[test]
fn multiprecision_release() {
    use EventKind::{Contact, Corner, Destabilised, Separation};
    let source = CaseSource::built_in("release").unwrap();
    let mut case = built_in("release", &[]);
    let exact = exact_events(&source, &[], case.output.end_time, 33);
    for kind in [Separation, Contact, Corner, Destabilised] {
        assert!(exact.iter().any(|event| event.kind == kind), "no {}", kind.name());
    }
    for (method, rtol, limit) in [
        (Method::Series, default_rtol(), 1e-9),
        (Method::Cvode, default_rtol(), 1e-9),
        (Method::Cvode, 1e-13, 1e-11),
    ] {
        case.solver = solver(method, rtol);
        let errors = errors("release", &recorded(&case).events, &exact).into_iter();
        for (error, event) in errors.zip(&exact) {
            let limit = if event.kind.in_event_sequence() { limit } else { 1e-9 };
            assert!(
                error < limit,
                "{}: {} is off by {error:e} s",
                method.name(),
                event.kind.name()
            );
        }
    }
}

/// The slow manifold at the samples before the kick, from the momentum of the true state alone: the whole state to
/// 1e-13 of its size, far from the instability and 60 ms before the stop.
#[test]
fn multiprecision_slow_manifold() {
    use stickslip::model::equations::SystemEquations;
    use stickslip::model::slow_manifold::{Slip, on_slow_manifold};
    use stickslip::model::system::System;
    use stickslip::signal::{Ramp, Signal};
    for case in ["paper", "si-kick"] {
        let truth = truth(case);
        let system = SystemEquations::new(&System::from(&truth.parameters));
        let (rotor, stator) = (system.rotor.twists, system.stator.twists);
        let speed = system.rotor.speed.unwrap();
        let Signal::Ramp(Ramp { value: force, .. }) = truth.parameters.actuation else {
            panic!("a ramp")
        };
        for sample in truth.samples.iter().filter(|s| s.time > 1.5 && s.time < 6.95) {
            let value = |name: &str| sample.state.iter().find(|(n, _)| n == name).unwrap().1;
            let mut y = vec![0.0; system.dimension];
            y[speed] = value("theta_dot");
            y[rotor + 1] = value("theta_dot") - value("phi2_dot");
            let slow = on_slow_manifold(&system, &Slip::undriven(1.0, 0, &[force]), &y).state;
            for (component, name) in [
                (rotor, "rotor_twist"),
                (stator, "stator_twist"),
                (stator + 1, "phi1_dot"),
                (speed, "theta_dot"),
            ] {
                let error = (slow[component] - value(name)).abs();
                // The given momentum has the rounding of theta_dot, 1e-16 of 60 rad/s at most.
                let size = value(name).abs().max(1e-12);
                println!("{case} {} {name} {error:e} {size:e}", sample.time);
                assert!(
                    error < 1e-13 * size,
                    "{case}: {name} at {} is off by {error:e}",
                    sample.time
                );
            }
        }
    }
}
