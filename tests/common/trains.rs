//! Cases of two trains: their texts, what changes them, and runs that are certified.

use num_rational::BigRational;
use std::ops::ControlFlow;
use std::time::Duration;
use stickslip::Run;
use stickslip::analysis::{Certified, Certify};
use stickslip::case::{Case, CaseSource, Origin, Override};
use stickslip::oracle::{self, OracleError, OracleRequest, OracleSolution};
use stickslip::record::{MemoryRecorder, Recorder};
use stickslip::simulation::{RunFailure, RunReport, SolverOptions};

/// A case that is written in a test.
pub fn source(text: &str) -> CaseSource {
    CaseSource {
        text: text.to_owned(),
        origin: Origin::File("case.toml".into()),
    }
}

/// Settings as by `--set`.
pub fn overrides(settings: &[&str]) -> Vec<Override> {
    settings
        .iter()
        .map(|setting| Override::parse(setting).unwrap())
        .collect()
}

/// The run of a case with these settings of the solver.
pub fn run(case: &Case, solver: &SolverOptions, recorder: &mut dyn Recorder) -> Result<RunReport, Box<RunFailure>> {
    Run::of_system(&case.system, case.threshold(), solver, &case.output)
        .record(recorder)
        .start()
}

/// What is certified of the run of a case by its own settings.
pub fn recorded(case: &Case) -> MemoryRecorder {
    let mut record = MemoryRecorder::default();
    run(case, &case.solver, &mut record).unwrap();
    record
}

/// The exact events of a case, each with so many digits.
pub fn truth(
    (source, changes): (&CaseSource, &[Override]),
    case: &Case,
    digits: u32,
) -> Result<OracleSolution, OracleError> {
    let exact = Case::exact(source, changes).unwrap().system;
    let request = OracleRequest {
        digits,
        end_time: BigRational::from_float(case.output.end_time).unwrap(),
        longest: Duration::from_secs(120),
        threshold: Case::exact(source, changes).unwrap().threshold,
        ..OracleRequest::default()
    };
    oracle::solve(&exact, &request, &mut |_| ControlFlow::Continue(()))
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
