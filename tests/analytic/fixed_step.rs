//! Fixed steps: where the exact solution is known, halving the step divides the error by 2^order.

use crate::common::linear_brake::LinearBrake;
use crate::common::{output, run, solver, truth};
use stickslip::friction::{Exponential, Friction};
use stickslip::model::Parameters;
use stickslip::signal::{Ramp, Signal};
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
        law: Exponential {
            low_speed: 0.3,
            high_speed: 0.3,
            decay: 0.0,
        }
        .into(),
    };
    parameters.actuation = Signal::Ramp(Ramp {
        value: 2225.0,
        rise_time: 0.0,
    });
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
    ] {
        let method = Method::from_name(name).unwrap();
        let table = method.explicit_table().unwrap();
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
        // The next term of the error's series changes the quotient; the rounding of 1e-16 of the twist does not. On a
        // linear problem the first term of a method of high order is small, and the quotient is larger.
        let expected = f64::from(table.order());
        let above = if expected < 6.0 { 0.6 } else { 3.0 };
        assert!(
            order > expected - 0.6 && order < expected + above,
            "{name}: order {order} instead of {expected}"
        );
    }
}
