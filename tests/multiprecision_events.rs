//! Every event and sample of the independent multiprecision code (data/truth), by every method.
//!
//! The tolerances are those that the program promises: 1e-9 s by default, 1e-11 s at rtol = 1e-13, and for the pure
//! methods 1e-6 s and 3e-8 s.

mod common;
use common::{largest_event_error, largest_sample_error, output, run, solver, truth};
use stickslip::simulation::{Method, SolverOptions};

fn check(case: &str, method: Method, rtol: f64, limit: f64) {
    let truth = truth(case);
    let (recorder, _) = run(
        &truth.parameters,
        &solver(method, rtol),
        &output(truth.end_time, 0.0005),
    );
    let error = largest_event_error(&truth, &recorder);
    let (sample_error, worst) = largest_sample_error(&truth, &recorder);
    println!(
        "{case} {} {rtol:e}: events {error:.2e} s, samples {sample_error:.2e} ({worst})",
        method.name()
    );
    assert!(error < limit, "{case}: an event is off by {error:e} s");
    if method == Method::Auto {
        assert!(sample_error < 1e-8, "{case}: {worst} is off by {sample_error:e}");
    }
}

fn default_rtol() -> f64 {
    SolverOptions::default().rtol
}

#[test]
fn multiprecision_paper_by_default() {
    check("paper", Method::Auto, default_rtol(), 1e-9);
}

#[test]
fn multiprecision_paper_tight() {
    check("paper", Method::Auto, 1e-13, 1e-11);
}

#[test]
fn multiprecision_si_kick_by_default() {
    check("si-kick", Method::Auto, default_rtol(), 1e-9);
}

#[test]
fn multiprecision_si_kick_tight() {
    check("si-kick", Method::Auto, 1e-13, 1e-11);
}

#[test]
fn multiprecision_si_kick_cvode_bdf() {
    check("si-kick", Method::CvodeBdf, default_rtol(), 1e-6);
    check("si-kick", Method::CvodeBdf, 1e-13, 3e-8);
}

#[test]
fn multiprecision_si_kick_cvode_adams() {
    check("si-kick", Method::CvodeAdams, default_rtol(), 1e-6);
    check("si-kick", Method::CvodeAdams, 1e-13, 3e-8);
}

#[test]
fn multiprecision_si_kick_erk() {
    check("si-kick", Method::Erk, default_rtol(), 1e-6);
    check("si-kick", Method::Erk, 1e-13, 3e-8);
}
