//! What the built-in reference runs cost, as snapshots: a change of cost has to be seen and accepted.
//!
//! After a change that is meant: `INSTA_UPDATE=always cargo test --test regression_solver_counters`, and read the diff.

mod common;
use std::fmt::Write as _;
use stickslip::case::{Case, CaseSource};
use stickslip::record::Segment;
use stickslip::simulation::{Method, SolverOptions};

/// One counter of a segment.
type Counter = fn(&Segment) -> u64;

/// Sums over the segments of each solver.
fn counters(case: &str, method: Method) -> String {
    let Case {
        parameters,
        solver,
        output,
        ..
    } = Case::parse(&CaseSource::built_in(case).unwrap(), &[]).unwrap();
    let solver = SolverOptions { method, ..solver };
    let (recorder, _) = common::run(&parameters, &solver, &output);
    let mut solvers: Vec<&'static str> = recorder.segments.iter().map(|s| s.solver).collect();
    solvers.sort_unstable();
    solvers.dedup();
    let mut text = format!(
        "events: {}\nsamples: {}\n",
        recorder.events.len(),
        recorder.samples.len()
    );
    for solver in solvers {
        let segments: Vec<&Segment> = recorder.segments.iter().filter(|s| s.solver == solver).collect();
        writeln!(text, "{solver}: {} segments", segments.len()).unwrap();
        let counts: [(&str, Counter); 8] = [
            ("steps", |s| s.steps),
            ("right-hand sides", |s| s.rhs_evaluations),
            ("Jacobians", |s| s.jacobian_evaluations),
            ("linear solver setups", |s| s.linear_solver_setups),
            ("refused steps", |s| s.error_test_failures),
            ("nonlinear iterations", |s| s.nonlinear_iterations),
            ("nonlinear failures", |s| s.nonlinear_convergence_failures),
            ("guard evaluations", |s| s.root_evaluations),
        ];
        for (name, count) in counts {
            let sum: u64 = segments.iter().map(|s| count(s)).sum();
            if sum > 0 {
                writeln!(text, "  {name}: {sum}").unwrap();
            }
        }
    }
    text
}

#[test]
fn regression_counters_of_paper_by_auto() {
    insta::assert_snapshot!("paper", counters("paper", Method::Auto));
}

#[test]
fn regression_counters_of_paper_si_by_auto() {
    insta::assert_snapshot!("paper-si", counters("paper-si", Method::Auto));
}

#[test]
fn regression_counters_of_paper_by_cvode() {
    insta::assert_snapshot!("paper-cvode", counters("paper", Method::Cvode));
}
