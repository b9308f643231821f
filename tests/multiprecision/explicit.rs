//! The embedded explicit pairs against the independent multiprecision events, and the studies that measure them.

use crate::common::{largest_event_error, output, run, solver, truth};
use std::ops::ControlFlow;
use stickslip::analysis::work_precision::{self, Errors, Study, StudySource};
use stickslip::simulation::{Method, SolverOptions};

/// Every pair finds all events of `paper-si` in their order, within what the methods without a choice of solver promise:
/// 1e-6 s. Below order 4 that takes so many steps at the default tolerance that these pairs are held to it at a larger
/// one.
#[test]
fn multiprecision_every_pair_finds_every_event() {
    let truth = truth("si-kick");
    let pairs: Vec<Method> = Method::all().filter(|m| matches!(m, Method::ErkPair(_))).collect();
    assert!(pairs.len() > 20);
    for method in pairs {
        let order = method.explicit_table().unwrap().order();
        let rtol = match order {
            0..=3 => 1e-7,
            _ => SolverOptions::default().rtol,
        };
        let (recorder, _) = run(
            &truth.parameters,
            &solver(method, rtol),
            &output(truth.end_time, truth.end_time),
        );
        let error = largest_event_error(&truth, &recorder);
        println!("{} {rtol:e}: {error:.1e} s", method.name());
        assert!(error < 1e-6, "{}: an event is off by {error:e} s", method.name());
    }
}

/// The tolerance decides: three digits more of it are more than one digit more of the events.
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

fn study(text: &str) -> Study {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = Some(folder.join("study.toml"));
    let source = StudySource {
        path,
        ..StudySource::text("study", text)
    };
    Study::parse(source).unwrap()
}

const SERIES: &str =
    "case = \"paper-si\"\n[[series]]\nmethods = [\"auto\", \"cvode-bdf\"]\ntolerances = [1e-6, 1e-9]\n";

/// The errors of a study are those that a direct comparison with the true events gives; and by reference runs instead of
/// the true events they change by no more than the uncertainty that these state, some 1e-13 s, and a factor for the
/// reference's own share of it.
#[test]
fn multiprecision_a_study_measures_the_errors() {
    let truth = truth("si-kick");
    let measure = |reference: &str| {
        let study = study(&format!("{SERIES}{reference}"));
        work_precision::run(&study, &mut |_| ControlFlow::Continue(()))
            .unwrap()
            .unwrap()
    };
    let by_truth = measure("[reference]\ntruth = \"data/truth/si-kick.json\"\n");
    let by_runs = measure("");
    let Errors { onset, largest, .. } = by_runs.uncertainty;
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
        assert!(
            (a.errors.largest.unwrap() - b.errors.largest.unwrap()).abs() < 5.0 * largest,
            "{a:?} {b:?}"
        );
        let calls: u64 = report.work.iter().map(|w| w.rhs_evaluations).sum();
        assert_eq!((a.rhs_evaluations, b.rhs_evaluations), (calls, calls));
        let first = recorder.events.iter().find(|e| e.kind.name() == "stick").unwrap();
        let onset = (first.time - truth.events[0].time).abs();
        assert!((a.errors.onset.unwrap() - onset).abs() < 2e-15);
    }
}
