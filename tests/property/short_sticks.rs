//! Sticks far shorter than a step are found, whatever the length of the steps.

use crate::common::systems::{ramp, table};
use crate::common::{event_sequence, output, run, truth};
use stickslip::model::{DiskKick, KickTime, Parameters};
use stickslip::record::EventKind;
use stickslip::simulation::{Method, SolverOptions};

fn paper_si(relative_velocity: f64) -> Parameters {
    let mut parameters = truth("si-kick").parameters;
    let time = KickTime::Instability;
    parameters.perturbations = vec![DiskKick {
        time,
        relative_velocity,
    }];
    parameters
}

/// Compares sequence and times for the solver's own steps with those for steps shorter than any stick.
fn check(parameters: &Parameters, end: f64, solver: &SolverOptions, longest_step: f64, tolerance: f64) {
    let events = |options: &SolverOptions| -> (Vec<EventKind>, Vec<f64>) {
        let (recorder, _) = run(parameters, options, &output(end, end));
        event_sequence(&recorder).into_iter().unzip()
    };
    let (word, times) = events(solver);
    let (fine_word, fine_times) = events(&SolverOptions {
        max_step: Some(longest_step),
        ..SolverOptions::default()
    });
    assert_eq!(word, fine_word, "{solver:?}");
    for (time, fine) in times.iter().zip(&fine_times) {
        assert!((time - fine).abs() < tolerance, "{time} s and {fine} s with {solver:?}");
    }
}

/// Kicks near the one whose oscillation just reaches a stop, which lasts 1.5 us at steps of 12 us.
#[test]
fn property_a_first_stick_that_hardly_is_one_is_found() {
    for relative_velocity in [1.0766e-4, 1.0767e-4, 1.07675e-4, 1.0769023365453122e-4, 1.07705e-4] {
        let mut parameters = paper_si(relative_velocity);
        parameters.initial.speed = 1.0;
        parameters.actuation = ramp(2225.0, 0.001);
        // The onset of the last case is at the grazing first dip. The amplified rounding is 1e-11 s.
        check(&parameters, 0.06, &SolverOptions::default(), 1e-6, 1e-8);
    }
}

/// Sticks shorten to nothing as the force fades.
#[test]
fn property_sticks_are_found_down_to_the_shortest() {
    let mut parameters = paper_si(0.5);
    parameters.initial.speed = 0.4;
    parameters.actuation = table(&[0.0, 0.1], &[500.0, 0.0]);
    parameters.friction.law.set_number("decay", 1.85);
    parameters.torsion.damping = 13.3;
    let methods = [
        Method::Arkode,
        Method::Erk,
        Method::CvodeBdf,
        Method::CvodeAdams,
        Method::Esdirk,
    ];
    for method in methods {
        let solver = SolverOptions {
            method,
            ..SolverOptions::default()
        };
        check(&parameters, 0.09, &solver, 2e-6, 1e-6);
    }
    for rtol in [1e-8, 1e-9, 1e-13] {
        let solver = SolverOptions {
            rtol,
            ..SolverOptions::default()
        };
        check(&parameters, 0.09, &solver, 2e-6, 1e-6);
    }
}
