//! The built-in cases of trains by every kind of method, against the oracle.

use std::ops::ControlFlow;
use std::time::Duration;
use stickslip::Run;
use stickslip::case::builtin::TRAINS;
use stickslip::case::{CaseSource, Override, TrainCase};
use stickslip::oracle::{self, OracleRequest};
use stickslip::record::MemoryRecorder;
use stickslip::simulation::{Method, SolverOptions};

/// The built-in cases of trains.
fn cases() -> Vec<(&'static str, CaseSource)> {
    let sources = TRAINS
        .iter()
        .map(|case| (case.name, CaseSource::built_in(case.name).unwrap()));
    sources.filter(|(_, source)| TrainCase::is_one(source, &[])).collect()
}

fn rational(value: f64) -> num_rational::BigRational {
    num_rational::BigRational::from_float(value).unwrap()
}

/// The bounds of each method, s: errors of all events of a run.
const METHODS: [(Method, f64, f64); 5] = [
    (Method::Auto, 1e-10, 1e-9),
    (Method::Auto, 1e-13, 1e-11),
    (Method::Series, 1e-10, 1e-12),
    (Method::CvodeBdf, 1e-12, 1e-7),
    (Method::Erk, 1e-12, 1e-9),
];

#[test]
fn multiprecision_every_built_in_case_of_trains_by_every_kind_of_method() {
    let mut failures = Vec::new();
    for (name, source) in cases() {
        // Bristles of 1e5 per metre hold the oracle to steps of microseconds.
        let changes: &[Override] = match name {
            "lugre-slider" => &[Override::parse("output.end_time=12").unwrap()],
            _ => &[],
        };
        let case = TrainCase::parse(&source, changes).unwrap();
        let exact = TrainCase::exact_parameters(&source, changes).unwrap();
        let request = OracleRequest {
            digits: 20,
            end_time: rational(case.output.end_time),
            longest: Duration::from_secs(120),
            threshold: case.threshold.map(rational),
            stability: false,
            ..OracleRequest::default()
        };
        let truth = match oracle::solve(&exact, &request, &mut |_| ControlFlow::Continue(())) {
            Ok(truth) => truth,
            Err(error) => {
                failures.push(format!("{name}: {error}"));
                continue;
            }
        };
        println!("{name}: {} events", truth.report.events.len());
        for (method, rtol, bound) in METHODS {
            let solver = SolverOptions {
                method,
                rtol,
                ..case.solver.clone()
            };
            let mut recorder = MemoryRecorder::default();
            let run = Run::of_trains(&case.parameters, case.threshold.unwrap_or(0.0), &solver, &case.output)
                .record(&mut recorder)
                .start();
            if let Err(error) = run {
                failures.push(format!("{name} by {} at {rtol:e}: {error}", method.name()));
                continue;
            }
            let events: Vec<_> = recorder
                .events
                .iter()
                .map(|event| (event.kind, event.mode_after))
                .collect();
            let expected: Vec<_> = truth
                .report
                .events
                .iter()
                .map(|event| (event.kind, event.mode_after))
                .collect();
            let errors = recorder
                .events
                .iter()
                .zip(&truth.report.events)
                .map(|(event, exact)| (event.time - exact.time.to_f64()).abs());
            let worst = errors.fold(0.0, f64::max);
            println!("  {} at {rtol:e}: {worst:e}", method.name());
            if events != expected {
                let first = events.iter().zip(&expected).position(|(a, b)| a != b);
                failures.push(format!(
                    "{name} by {} at {rtol:e}: {} events for {}, first other at {first:?}",
                    method.name(),
                    events.len(),
                    expected.len()
                ));
            } else if worst > bound {
                failures.push(format!("{name} by {} at {rtol:e}: {worst:e} s", method.name()));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
