//! The oracle against the independent multiprecision code (data/truth): every event and every sample.

use num_rational::BigRational;
use num_traits::{Signed, Zero};
use std::ops::ControlFlow;
use stickslip::case::{Case, CaseSource};
use stickslip::oracle::{self, Number, OracleOptions, OracleReport, nearest_double, rational};

/// The truth of a case, and the oracle's run of the built-in case it belongs to.
fn solved(case: &str, truth: &str, digits: u32) -> (serde_json::Value, OracleReport) {
    let path = format!("{}/data/truth/{truth}.json", env!("CARGO_MANIFEST_DIR"));
    let truth: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let exact = Case::exact_parameters(&CaseSource::built_in(case).unwrap(), &[]).unwrap();
    let samples = truth["samples"].as_array().unwrap();
    let options = OracleOptions {
        digits,
        end_time: decimal(&truth["parameters"]["t_end"]),
        sample_times: samples.iter().map(|sample| decimal(&sample["time"])).collect(),
        max_events: 1000,
    };
    let start = std::time::Instant::now();
    let report = oracle::run(&exact, &options, &mut |_| ControlFlow::Continue(())).unwrap();
    println!("{case}: {} steps, {} bits, {:.2} s", report.steps, report.bits, start.elapsed().as_secs_f64());
    (truth, report)
}

fn decimal(text: &serde_json::Value) -> BigRational {
    rational(text.as_str().expect("a decimal string")).expect("a decimal")
}

/// How many digits of `value` agree with `expected`, where `scale` is what the quantity is worth.
fn digits(value: &Number, expected: &BigRational, scale: &BigRational) -> f64 {
    let error = (value.to_rational().expect("finite") - expected).abs();
    if error.is_zero() { f64::INFINITY } else { -nearest_double(&(error / scale)).log10() }
}

/// The least number of digits to which all event times and all states agree: (times, states).
fn agreement(truth: &serde_json::Value, report: &OracleReport) -> (f64, f64) {
    let events: Vec<_> = report.events.iter().filter(|e| e.kind.in_mode_word()).collect();
    let expected = truth["events"].as_array().unwrap();
    let kinds: Vec<_> = events.iter().map(|e| e.kind.name()).collect();
    let expected_kinds: Vec<_> = expected.iter().map(|e| e["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, expected_kinds);
    let (mut times, mut states) = (f64::INFINITY, f64::INFINITY);
    // An axial velocity is held against that of the ramp, 4e-5 m/s, not against what thousands of e-folds leave of it.
    let least = rational("1e-5").expect("a decimal");
    let largest = |name: &str| {
        let events = expected.iter().map(|e| &e["state_after"][name]);
        let samples = truth["samples"].as_array().unwrap().iter().map(|s| &s["state"][name]);
        events.chain(samples).map(|x| decimal(x).abs()).max().expect("values").max(least.clone())
    };
    let mut compare = |state: &oracle::OracleState, expected: &serde_json::Value| {
        for (name, value) in state.components() {
            if let Some(expected) = expected.get(name) {
                states = states.min(digits(value, &decimal(expected), &largest(name)));
            }
        }
    };
    for (event, expected) in events.iter().zip(expected) {
        let time = decimal(&expected["time"]);
        times = times.min(digits(&event.time, &time, &time));
        compare(&event.state, &expected["state_after"]);
    }
    for ((_, state), expected) in report.samples.iter().zip(truth["samples"].as_array().unwrap()) {
        compare(state, &expected["state"]);
    }
    assert_eq!(report.samples.len(), truth["samples"].as_array().unwrap().len());
    println!("{times:.1} digits of times, {states:.1} digits of states");
    (times, states)
}

#[test]
fn multiprecision_paper() {
    let (truth, report) = solved("paper", "paper", 33);
    let (times, states) = agreement(&truth, &report);
    assert!(times > 25.0 && states > 20.0);
}

#[test]
fn multiprecision_paper_si() {
    let (truth, report) = solved("paper-si", "si-kick", 33);
    let (times, states) = agreement(&truth, &report);
    assert!(times > 25.0 && states > 20.0);
}

#[test]
fn multiprecision_unperturbed() {
    let (truth, report) = solved("unperturbed", "si-unperturbed", 70);
    let (times, states) = agreement(&truth, &report);
    assert!(times > 25.0 && states > 20.0);
}

/// The truth and the oracle beyond their own rounding: with 45 digits instead of 33 the events of `paper-si` stay where they
/// are, to the digits that growth leaves of 33.
#[test]
fn zz_probe_more_digits() {
    let (_, coarse) = solved("paper-si", "si-kick", 33);
    let (truth, fine) = solved("paper-si", "si-kick", 50);
    agreement(&truth, &fine);
    let worst = coarse.events.iter().zip(&fine.events).map(|(a, b)| {
        assert_eq!(a.kind, b.kind);
        let b = b.time.to_rational().unwrap();
        digits(&a.time, &b, &b.clone().max(rational("1e-9").unwrap()))
    }).fold(f64::INFINITY, f64::min);
    println!("33 against 50: {worst:.1}");
}

#[test]
fn zz_probe_release() {
    let source = CaseSource::built_in("release").unwrap();
    let exact = Case::exact_parameters(&source, &[]).unwrap();
    let case = Case::parse(&source, &[]).unwrap();
    let options = OracleOptions { digits: 33, end_time: rational("1.2").unwrap(), sample_times: vec![], max_events: 1000 };
    let report = oracle::run(&exact, &options, &mut |_| ControlFlow::Continue(())).unwrap();
    let mut recorder = stickslip::simulation::MemoryRecorder::default();
    stickslip::simulation::simulate(&case.parameters, &case.solver, &case.output, &mut recorder, &mut |_| ControlFlow::Continue(())).unwrap();
    for (a, b) in report.events.iter().zip(&recorder.events) {
        println!("{} {} {} {} {:e}", a.kind.name(), b.kind.name(), a.time.to_decimal(20), b.time, a.time.to_f64() - b.time);
    }
    println!("{} {}", report.events.len(), recorder.events.len());
}
