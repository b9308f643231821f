//! Cases by name or by text, what changes them, their runs, their exact events, and certificates of them.

use num_rational::BigRational;
use std::ops::ControlFlow;
use std::time::Duration;
use stickslip::Run;
use stickslip::analysis::{Attractor, Certified, Certify, SavedRun, Summary};
use stickslip::case::{Case, CaseSource, Origin, Override};
use stickslip::model::nearest_double;
use stickslip::model::system::ExactSystem;
use stickslip::oracle::{
    self, ExactDouble, OracleError, OracleEvent, OracleOptions, OracleReport, OracleRequest, OracleSolution, rational,
};
use stickslip::record::{Event, EventKind, MemoryRecorder, Recorder};
use stickslip::simulation::{Method, RunFailure, RunReport, SolverOptions};

/// A case that is written in a test.
pub fn source(text: &str) -> CaseSource {
    CaseSource {
        text: text.to_owned(),
        origin: Origin::File("case.toml".into()),
    }
}

/// Settings as by `--set`.
#[track_caller]
pub fn parsed(settings: &[impl AsRef<str>]) -> Vec<Override> {
    let parse = |setting: &str| Override::parse(setting).unwrap_or_else(|error| panic!("{setting}: {error}"));
    settings.iter().map(|setting| parse(setting.as_ref())).collect()
}

#[track_caller]
fn read(source: &CaseSource, settings: &[&str]) -> Case {
    Case::read(source, &parsed(settings)).unwrap_or_else(|error| panic!("{error}\n{}", source.text))
}

/// A built-in case with settings.
#[track_caller]
pub fn built_in(name: &str, settings: &[&str]) -> Case {
    read(&CaseSource::built_in(name).unwrap(), settings)
}

/// A case that is written in a test, with settings.
#[track_caller]
pub fn written(text: &str, settings: &[&str]) -> Case {
    read(&source(text), settings)
}

/// The same case by another method.
pub fn by(case: &Case, method: Method) -> Case {
    let mut case = case.clone();
    case.solver.method = method;
    case
}

/// The run of a case with these settings of the solver.
pub fn run(case: &Case, solver: &SolverOptions, recorder: &mut dyn Recorder) -> Result<RunReport, Box<RunFailure>> {
    Run::of_system(&case.system, case.threshold, solver, &case.output)
        .record(recorder)
        .start()
}

/// The run of a case by its own settings, and what is reported of it.
pub fn reported(case: &Case) -> (MemoryRecorder, RunReport) {
    let mut record = MemoryRecorder::default();
    let report = run(case, &case.solver, &mut record).unwrap();
    (record, report)
}

/// The run of a case by its own settings.
pub fn recorded(case: &Case) -> MemoryRecorder {
    reported(case).0
}

pub fn kinds(events: &[Event]) -> Vec<EventKind> {
    events.iter().map(|event| event.kind).collect()
}

#[track_caller]
pub fn near(found: f64, expected: f64, tolerance: f64) {
    let error = (found - expected).abs();
    assert!(error <= tolerance, "{found} for {expected}: off by {error:.1e}");
}

/// The events of these kinds at these times.
#[track_caller]
pub fn expect(events: &[Event], expected: &[(EventKind, f64)], tolerance: f64) {
    let wanted: Vec<EventKind> = expected.iter().map(|(kind, _)| *kind).collect();
    assert_eq!(kinds(events), wanted);
    let pairs = events.iter().zip(expected);
    let errors = pairs.map(|(event, (_, time))| (event.time - time).abs());
    let worst = errors.fold(0.0, f64::max);
    println!("{} events within {worst:.1e} s", events.len());
    assert!(worst <= tolerance, "{worst:e} s");
}

/// The exact events of a case, each with so many digits.
pub fn truth(
    (source, changes): (&CaseSource, &[Override]),
    case: &Case,
    digits: u32,
) -> Result<OracleSolution, OracleError> {
    let exact = Case::exact(source, changes).unwrap();
    let request = OracleRequest {
        digits,
        end_time: BigRational::from_float(case.output.end_time).unwrap(),
        longest: Duration::from_secs(120),
        threshold: exact.threshold,
        ..OracleRequest::default()
    };
    oracle::solve(&exact.system, &request, &())
}

/// The largest distance of events from the exact ones, s, which have the same kinds.
#[track_caller]
pub fn from_truth(label: &str, events: &[Event], truth: &OracleSolution) -> f64 {
    let errors = errors(label, events, &truth.report.events);
    errors.into_iter().fold(0.0, f64::max)
}

/// The distance of each event from the exact one, s; the kinds are the same.
#[track_caller]
pub fn errors(label: &str, events: &[Event], exact: &[OracleEvent]) -> Vec<f64> {
    let expected: Vec<EventKind> = exact.iter().map(|event| event.kind).collect();
    assert_eq!(kinds(events), expected, "{label}");
    let pairs = events.iter().zip(exact);
    pairs
        .map(|(own, exact)| difference(own.time, &exact.time).abs())
        .collect()
}

/// `own` - `exact`, without the rounding of `exact` to double.
pub fn difference(own: f64, exact: &ExactDouble) -> f64 {
    let own = ExactDouble::from_f64(own, 64).to_rational().unwrap();
    nearest_double(&(own - exact.to_rational().unwrap()))
}

/// The oracle's run until `end`, s, with samples at these times.
pub fn by_oracle(system: &ExactSystem, digits: u32, end: &str, samples: Vec<BigRational>) -> OracleReport {
    let options = OracleOptions {
        digits,
        end_time: rational(end).unwrap(),
        sample_times: samples,
        ..OracleOptions::default()
    };
    oracle::run(system, &options, &mut |_| ControlFlow::Continue(())).unwrap()
}

/// A case in exact numbers.
pub fn exact(source: &CaseSource, changes: &[Override]) -> ExactSystem {
    Case::exact(source, changes).unwrap().system
}

/// The events of a case by the oracle.
pub fn exact_events(source: &CaseSource, changes: &[Override], end_time: f64, digits: u32) -> Vec<OracleEvent> {
    by_oracle(&exact(source, changes), digits, &end_time.to_string(), Vec::new()).events
}

pub fn median(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// A case, its run, and what is certified of it with so many digits of the oracle, if it comes to them within ten minutes.
pub fn certified(source: &CaseSource, changes: &[Override], digits: u32) -> (Case, MemoryRecorder, Certified) {
    let case = Case::read(source, changes).unwrap();
    let exact = Case::exact(source, changes).unwrap();
    let record = recorded(&case);
    let certify = Certify::new(&case).oracle_within(&exact, digits, Duration::from_secs(600));
    let certified = certify.start(&record).unwrap();
    (case, record, certified)
}

/// What a run of a case comes to.
pub fn summary(case: &Case) -> Summary {
    let folder = tempfile::tempdir().unwrap();
    let saved = SavedRun::new(case, &folder.path().join("run.h5")).start().unwrap();
    assert!(saved.run.failure.is_none());
    saved.run.summary
}

#[track_caller]
pub fn attractor(summary: &Summary) -> &Attractor {
    let none = || panic!("not periodic: {:?}", summary.outcome);
    summary.attractor().unwrap_or_else(none)
}
