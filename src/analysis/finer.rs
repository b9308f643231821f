//! What settings of a run promise beside another method, and finer ones.

use crate::model::system::System;
use crate::simulation::{Method, SolverOptions, natural_period};

/// What the default promises: an event is within this of that of an independent method, s.
const PROMISED: f64 = 1e-9;

/// Steps in the natural period of a repetition that finds short sticks, which longer ones step over.
const STEPS_PER_PERIOD: f64 = 50.0;

/// How far apart the events of a run with these settings and those of its witness may be, s: more with a tolerance that asks for
/// less.
pub(super) fn promised(solver: &SolverOptions) -> f64 {
    PROMISED * (solver.rtol / SolverOptions::default().rtol).max(1.0)
}

/// What to try where a run of `cvode` and its witness differ: the default's tolerance, below which the method gains nothing, and then
/// shorter steps as well. Other methods are there to be studied as they are, and `series` gains nothing.
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

/// The settings, as options of the program.
pub(super) fn in_words(settings: &SolverOptions, own: &SolverOptions) -> String {
    let rtol = (settings.rtol != own.rtol).then(|| format!("solver.rtol={:e}", settings.rtol));
    let step = settings.max_step.filter(|_| settings.max_step != own.max_step);
    let step = step.map(|step| format!("solver.max_step={step:.3e}"));
    rtol.into_iter().chain(step).collect::<Vec<_>>().join(", ")
}
