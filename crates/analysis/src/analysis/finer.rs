//! Expected agreement of a run with another method, and finer settings.

use stickslip_engine::simulation::{Method, SolverOptions, natural_period};
use stickslip_system::model::system::System;

/// Expected distance between events of the default method and of an independent method, s.
const PROMISED: f64 = 1e-9;

/// Steps per natural period of a rerun. Longer steps miss short sticks.
const STEPS_PER_PERIOD: f64 = 50.0;

pub(super) fn promised(solver: &SolverOptions) -> f64 {
    PROMISED * (solver.rtol / SolverOptions::default().rtol).max(1.0)
}

/// Settings to try if `cvode` and its witness differ: first the default tolerance, then shorter steps as well. Results
/// of other methods are studied as they are; `series` gains nothing.
pub(super) fn finer_settings(solver: &SolverOptions, system: &System) -> Vec<SolverOptions> {
    if solver.method != Method::Cvode {
        return Vec::new();
    }
    let finer = SolverOptions {
        rtol: solver.rtol.min(SolverOptions::default().rtol),
        ..solver.clone()
    };
    let step = natural_period(system).map(|period| period / STEPS_PER_PERIOD);
    let finest = SolverOptions {
        max_step: step.into_iter().chain(solver.max_step).reduce(f64::min),
        ..finer.clone()
    };
    let mut settings = vec![finer, finest];
    settings.retain(|settings| settings != solver);
    settings
}

pub(super) fn in_words(settings: &SolverOptions, own: &SolverOptions) -> String {
    let rtol = (settings.rtol != own.rtol).then(|| format!("solver.rtol={:e}", settings.rtol));
    let step = settings.max_step.filter(|_| settings.max_step != own.max_step);
    let step = step.map(|step| format!("solver.max_step={step:.3e}"));
    rtol.into_iter().chain(step).collect::<Vec<_>>().join(", ")
}
