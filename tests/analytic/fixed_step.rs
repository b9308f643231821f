//! Fixed steps: where the exact solution is known, halving the step divides the error by 2^order.

use crate::common::cases::{built_in, kinds, recorded, reported};
use crate::common::linear_brake::LinearBrake;
use crate::common::systems::{exponential, ramp};
use crate::common::{output, run, solver, truth};
use std::f64::consts::PI;
use stickslip::friction::Friction;
use stickslip::model::Parameters;
use stickslip::record::EventKind;
use stickslip::simulation::{Method, SolverOptions};

/// End of the smooth slip, s: some eight natural periods, after which the oscillation excited by the step of the force
/// still has more than a tenth of its size.
const END: f64 = 0.002;

/// Slip under a force that is applied at once, with constant friction: a linear motion that rings.
fn slip() -> Parameters {
    let mut parameters = truth("si-kick").parameters;
    parameters.perturbations.clear();
    parameters.initial.speed = 10.0;
    parameters.friction = Friction {
        breakaway: 0.3,
        law: exponential(0.3, 0.3, 0.0).into(),
    };
    parameters.actuation = ramp(2225.0, 0.0);
    parameters
}

#[test]
fn analytic_order_by_halving_the_step() {
    let parameters = slip();
    let exact = LinearBrake::run(&parameters, END).at(END);
    for (name, steps) in [
        ("erk-heun-euler-21", [0.5e-6, 0.25e-6]),
        ("erk-bogacki-shampine-32", [2e-6, 1e-6]),
        ("erk-zonneveld-43", [8e-6, 4e-6]),
        ("erk-cash-karp-54", [10e-6, 5e-6]),
        ("erk-dormand-prince-54", [10e-6, 5e-6]),
        ("erk-verner-65", [20e-6, 10e-6]),
        ("erk-verner-87", [40e-6, 20e-6]),
        ("rk4", [8e-6, 4e-6]),
    ] {
        let method = Method::from_name(name).unwrap();
        let (_, expected) = method.fixed_steps().unwrap();
        let errors = steps.map(|step| {
            let options = SolverOptions {
                fixed_step: Some(step),
                ..solver(method, 1e-6)
            };
            let (recorder, report) = run(&parameters, &options, &output(END, END));
            let last = recorder.samples.last().unwrap();
            assert_eq!(last.time, END);
            // Every step has this length, except the last step before each of a few changes of the step regime.
            let taken: u64 = report.work.iter().map(|w| w.steps).sum();
            let least = (END / step).round() as u64;
            assert!((least..least + 8).contains(&taken), "{name}: {taken} steps of {step}");
            (last.state.rotor_twist - exact.rotor_twist).abs()
        });
        let order = (errors[0] / errors[1]).log2();
        println!("{name}: {:.1e} and {:.1e}, order {order:.2}", errors[0], errors[1]);
        // The next term of the error's series moves the quotient, the rounding of 1e-16 of the twist does not. On a linear
        // problem the first term of a method of high order is small, and the quotient is above it.
        let expected = f64::from(expected);
        let above = if expected < 6.0 { 0.6 } else { 3.0 };
        assert!(order > expected - 0.6, "{name}: order {order} instead of {expected}");
        assert!(order < expected + above, "{name}: order {order} instead of {expected}");
    }
}

/// The belt of closed form: from the recorded state after an event, the next one comes at a known time. `rk4` sees it at the end
/// of the step in which it happens, a multiple of the step, and the error of the method between is far below.
#[test]
fn analytic_events_of_rk4_are_late_by_at_most_a_step() {
    // m = 1, k = 100, v = 0.1, mu_0 F_n = 4, mu_d F_n = 3.
    let (w, v) = (10.0, 0.1);
    for step in [1e-3_f64, 1.7e-4] {
        let case = built_in("belt-coulomb", &["solver.method=rk4", &format!("solver.step={step}")]);
        let (recorder, report) = reported(&case);
        let events = &recorder.events;
        // The last event may come after the end.
        let exact = kinds(&recorded(&built_in("belt-coulomb", &[])).events);
        assert!(exact.starts_with(&kinds(events)) && exact.len() <= events.len() + 1);
        assert!(recorder.segments.iter().all(|segment| segment.solver == "rk4"));
        let taken: u64 = report.work.iter().map(|work| work.steps).sum();
        assert_eq!(taken, (10.0 / step).ceil() as u64);
        for pair in events.windows(2) {
            let x = pair[0].after.phi1;
            assert_eq!(pair[0].after.relative_velocity, 0.0);
            let exact = match pair[0].kind {
                EventKind::Stick => (0.04 - x) / v,
                _ => (PI + 2.0 * (v / (w * (x - 0.03))).atan()) / w,
            };
            let late = pair[1].time - pair[0].time - exact;
            assert!((-1e-8..step + 1e-8).contains(&late), "{late:e} of {step:e} s");
            let steps = pair[1].time / step;
            assert!((steps - steps.round()).abs() < 1e-6, "{steps}");
        }
    }
}
