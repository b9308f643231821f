//! `series` at the default tolerance against the oracle, on the random brakes of the certificates.
//!
//! The measure is what double precision allows, by the linearised run: the rounding of the time, that of the sliding speed at
//! the loss of stability or at the kick, amplified, and that of the case's own numbers. A hundred times that is what a
//! method may lose beside it.

mod common;

use common::random_brakes::{difference, exact_events, random_brake};
use std::ops::ControlFlow;
use stickslip::analysis::growth::Growth;
use stickslip::analysis::linearised::linearise;
use stickslip::case::{Case, CaseSource, Override};
use stickslip::model::torsion::TorsionModel;
use stickslip::simulation::{Event, EventKind, MemoryRecorder, Method, SolverOptions, simulate};

const ALLOWED: f64 = 100.0;

/// Rounding that may move an event by more than this share of the natural period leaves its place in the oscillation open.
const ILL_CONDITIONED: f64 = 0.02;

/// Whether the case is well-conditioned throughout, and the largest error over what is allowed of all events.
fn hold(index: u64) -> (bool, f64) {
    let source = CaseSource::built_in("paper-si").unwrap();
    let mut overrides = random_brake(index);
    overrides.push(Override::parse("solver.method=series").unwrap());
    let case = Case::parse(&source, &overrides).unwrap();
    assert_eq!(
        (case.solver.method, case.solver.rtol),
        (Method::Series, SolverOptions::default().rtol)
    );
    let mut recorder = MemoryRecorder::default();
    let end = case.output.end_time;
    simulate(&case.parameters, &case.solver, &case.output, &mut recorder, &mut |_| {
        ControlFlow::Continue(())
    })
    .unwrap();
    let instability = Growth::of_run(&case.parameters, &recorder.events, end).map(|growth| growth.instability);
    let linearised = linearise(&case, &case.solver, instability, &|| false).unwrap();
    let kinds: Vec<EventKind> = linearised.events.iter().map(|event| event.kind).collect();
    assert_eq!(
        kinds,
        recorder.events.iter().map(|event| event.kind).collect::<Vec<_>>()
    );

    let word: Vec<(usize, &Event)> = recorder
        .events
        .iter()
        .enumerate()
        .filter(|(_, event)| event.kind.in_mode_word())
        .collect();
    let period = TorsionModel::new(&case.parameters).natural_period();
    let hardest = word
        .iter()
        .map(|(k, _)| linearised.events[*k].rounding)
        .fold(0.0, f64::max);
    if ALLOWED * hardest > ILL_CONDITIONED * period {
        println!(
            "set {index}: {} events, ill-conditioned: rounding moves them by {hardest:.1e} s",
            word.len()
        );
        return (false, 0.0);
    }
    let truth = exact_events(&source, &overrides, end, 33);
    let truth: Vec<_> = truth.iter().filter(|event| event.kind.in_mode_word()).collect();
    let expected: Vec<EventKind> = truth.iter().map(|event| event.kind).collect();
    let own: Vec<EventKind> = word.iter().map(|(_, event)| event.kind).collect();
    assert_eq!(own, expected, "set {index}: the mode word");
    let (mut worst, mut ratio) = (0.0_f64, 0.0_f64);
    for ((k, event), exact) in word.iter().zip(&truth) {
        let error = difference(event.time, &exact.time).abs();
        worst = worst.max(error);
        ratio = ratio.max(error / linearised.events[*k].rounding);
    }
    println!(
        "set {index}: {} events within {worst:.1e} s, {ratio:.1} times what rounding allows",
        word.len()
    );
    (true, ratio)
}

fn sets(indices: impl Iterator<Item = u64>, least_well_conditioned: usize) {
    let results: Vec<(bool, f64)> = indices.map(hold).collect();
    let well = results.iter().filter(|(well, _)| *well).count();
    let worst = results.iter().map(|(_, ratio)| *ratio).fold(0.0, f64::max);
    println!(
        "{well} of {} well-conditioned, at most {worst:.1} times what rounding allows",
        results.len()
    );
    // A test that leaves out what is hard must not leave out everything.
    assert!(well >= least_well_conditioned);
    assert!(worst <= ALLOWED, "{worst}");
}

#[test]
fn multiprecision_series_is_as_exact_as_double_precision_allows() {
    sets([1, 3].into_iter(), 2);
}

#[test]
#[ignore = "takes a minute or two"]
fn multiprecision_series_is_as_exact_as_double_precision_allows_on_twenty_brakes() {
    sets(0..20, 12);
}
