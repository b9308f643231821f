//! The steps of `series` take no memory from the heap.

use crate::common::systems::ramp;
use crate::common::truth;
use crate::counting::allocations;
use stickslip::Run;
use stickslip::model::system::System;
use stickslip::simulation::{Following, Method, OutputOptions, RunReport, SolverOptions};

/// Stick-slip from the start, with steps of any length and with a hundredth of a period: what a run allocates goes with its segments,
/// of which both have as many, and not with its steps.
#[test]
fn regression_a_step_allocates_nothing() {
    let before = allocations();
    drop(std::hint::black_box(Box::new(0u8)));
    assert!(allocations() > before, "the counter counts");

    // Below the critical speed, and pressed at once: the oscillation is never quiet.
    let mut parameters = truth("si-kick").parameters;
    parameters.initial.speed = 0.5;
    parameters.actuation = ramp(2225.0, 0.0);
    parameters.perturbations.clear();
    let output = OutputOptions {
        end_time: 0.1,
        interval: 0.1,
        windows: Vec::new(),
        steps: false,
        follow: Following::default(),
    };
    let run = |max_step: Option<f64>| {
        let solver = SolverOptions {
            method: Method::Series,
            max_step,
            ..SolverOptions::default()
        };
        let before = allocations();
        let report = Run::of_system(&System::from(&parameters), 0.0, &solver, &output)
            .start()
            .expect("a run");
        (allocations() - before, report)
    };
    // What is computed once for all runs.
    run(None);
    let steps = |report: &RunReport| report.work.iter().map(|work| work.steps).sum::<u64>();
    let (few, long) = run(None);
    let (many, short) = run(Some(2.5e-6));
    println!("{few} for {} steps, {many} for {}", steps(&long), steps(&short));
    assert_eq!(long.events.len(), short.events.len());
    assert!(steps(&short) > steps(&long) + 5000);
    assert!(many.abs_diff(few) < 100, "{few} and {many}");
}
