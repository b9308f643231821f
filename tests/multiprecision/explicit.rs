//! The embedded explicit pairs against the independent multiprecision events, and the studies that measure them.

use crate::common::cases::{self, built_in, by, difference, near, parsed, recorded};
use crate::common::{event_sequence, largest_event_error, output, run, solver, truth};
use stickslip::analysis::work_precision::{self, MethodErrors, PrecisionStudy, StudySource};
use stickslip::case::CaseSource;
use stickslip::simulation::{Method, SolverOptions};

/// Every pair finds all events of a brake in their order, within the promise for methods without a choice of solver:
/// 1e-6 s. Below order 4 this takes so many steps at the default tolerance that these pairs are tested at a larger
/// one, `second` for those of order 2.
fn every_pair_finds_every_event(settings: &[&str], second: f64) {
    let case = built_in("paper-si", settings);
    let source = CaseSource::built_in("paper-si").unwrap();
    let exact = cases::truth((&source, &parsed(settings)), &case, 20).unwrap();
    let exact = exact.report.events.into_iter();
    let exact: Vec<_> = exact.filter(|event| event.kind.in_event_sequence()).collect();
    assert!(exact.len() > 20, "{}", exact.len());
    let pairs: Vec<Method> = Method::all().filter(|m| matches!(m, Method::ErkPair(_))).collect();
    assert!(pairs.len() > 20);
    for method in pairs {
        let mut case = by(&case, method);
        case.solver.rtol = match method.explicit_table().unwrap().order() {
            0..=2 => second,
            3 => 1e-7,
            _ => SolverOptions::default().rtol,
        };
        let word = event_sequence(&recorded(&case));
        let kinds = word.iter().map(|(kind, _)| kind);
        assert!(kinds.eq(exact.iter().map(|event| &event.kind)), "{}", method.name());
        let errors = word
            .iter()
            .zip(&exact)
            .map(|((_, time), exact)| difference(*time, &exact.time).abs());
        let error = errors.fold(0.0, f64::max);
        println!("{} {:e}: {error:.1e} s", method.name(), case.solver.rtol);
        assert!(error < 1e-6, "{}: an event is off by {error:e} s", method.name());
    }
}

/// A stop from 7 rad/s, with the same sticks and slips as one from 100 rad/s and a tenth of the sliding before them.
#[test]
#[ignore = "long: all 23 pairs"]
fn multiprecision_long_every_pair_finds_every_event() {
    let kick = "perturbation=[{time=\"instability\", relative_velocity=1e-4}]";
    let output = "output={end_time=0.6, interval=0.6}";
    every_pair_finds_every_event(&["initial.speed=7", "actuation.rise_time=0.01", kick, output], 1e-6);
}

#[test]
#[ignore = "long: all 23 pairs"]
fn multiprecision_long_every_pair_finds_every_event_of_paper_si() {
    every_pair_finds_every_event(&[], 1e-7);
}

/// Three more digits of the tolerance give more than one more digit of the events.
#[test]
fn multiprecision_a_smaller_tolerance_is_more_accurate() {
    let truth = truth("si-kick");
    let method = Method::from_name("erk-dormand-prince-54").unwrap();
    let [loose, tight] = [1e-6, 1e-9].map(|rtol| {
        let (recorder, _) = run(
            &truth.parameters,
            &solver(method, rtol),
            &output(truth.end_time, truth.end_time),
        );
        largest_event_error(&truth, &recorder)
    });
    assert!(tight < 0.1 * loose, "{loose:e} and {tight:e}");
}

fn study(text: &str) -> PrecisionStudy {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = Some(folder.join("study.toml"));
    let source = StudySource {
        path,
        ..StudySource::text("study", text)
    };
    PrecisionStudy::parse(source).unwrap()
}

const SERIES: &str =
    "case = \"paper-si\"\n[[series]]\nmethods = [\"auto\", \"cvode-bdf\"]\ntolerances = [1e-6, 1e-9]\n";

/// The errors of a study are those of a direct comparison with the true events. With reference runs instead of the
/// true events they change by no more than the stated uncertainty of these runs, some 1e-13 s, and a factor for the
/// reference's own error.
#[test]
fn multiprecision_a_study_measures_the_errors() {
    let truth = truth("si-kick");
    let measure = |reference: &str| {
        let study = study(&format!("{SERIES}{reference}"));
        work_precision::run(&study, &()).unwrap()
    };
    let by_truth = measure("[reference]\ntruth = \"data/truth/si-kick.json\"\n");
    let by_runs = measure("");
    let MethodErrors { onset, largest, .. } = by_runs.uncertainty;
    let (onset, largest) = (onset.unwrap(), largest.unwrap());
    assert!(
        onset > 0.0 && onset <= largest && largest < 1e-11,
        "{onset:e} {largest:e}"
    );
    assert_eq!(by_truth.measurements.len(), 4);
    for (a, b) in by_truth.measurements.iter().zip(&by_runs.measurements) {
        let rtol = match a.knob {
            work_precision::Knob::Tolerance(rtol) => rtol,
            work_precision::Knob::FixedStep(_) => unreachable!(),
        };
        let (recorder, report) = run(
            &truth.parameters,
            &solver(a.method, rtol),
            &output(truth.end_time, truth.end_time),
        );
        assert!(a.same_sequence && b.same_sequence);
        let error = largest_event_error(&truth, &recorder);
        assert!((a.errors.largest.unwrap() - error).abs() < 2e-15, "{a:?}: {error:e}");
        near(a.errors.largest.unwrap(), b.errors.largest.unwrap(), 5.0 * largest);
        let calls: u64 = report.work.iter().map(|w| w.rhs_evaluations).sum();
        assert_eq!((a.rhs_evaluations, b.rhs_evaluations), (calls, calls));
        let first = recorder.events.iter().find(|e| e.kind.name() == "stick").unwrap();
        let onset = (first.time - truth.events[0].time).abs();
        assert!((a.errors.onset.unwrap() - onset).abs() < 2e-15);
    }
}
