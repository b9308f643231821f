//! Repetition of a run with finer settings, if its witness disagrees.

use super::finer::{finer_settings, in_words};
use super::witness::{MOST_STEPS, Sequence, Testimony, Witness, witness};
use stickslip_case::Case;
use stickslip_engine::run::Run;
use stickslip_engine::simulation::{OutputOptions, SolverOptions};

/// First of the [`finer_settings`] with which run and witness agree, and the reason. `None` if none helps, if the
/// first run agrees or has a budget, or if `stop` returns `true`.
pub(super) fn repetition(case: &Case, first: &Witness, stop: &dyn Fn() -> bool) -> Option<(SolverOptions, String)> {
    // A budget leaves no time for another run.
    let budget = case.solver.max_steps.is_some() || case.solver.max_wall_time.is_some();
    if budget || first.agrees(&case.solver) {
        return None;
    }
    let output = OutputOptions::at_the_ends(case.output.end_time);
    finer_settings(&case.solver, &case.system)
        .into_iter()
        .find_map(|settings| {
            let mut sequence = Sequence::default();
            let bounded = SolverOptions {
                max_steps: Some(MOST_STEPS),
                ..settings.clone()
            };
            let run = Run::new(case)
                .solver(&bounded)
                .output(&output)
                .record(&mut sequence)
                .stop(stop);
            if !run.start().is_ok_and(|report| !report.interrupted) {
                return None;
            }
            let mut finer = case.clone();
            finer.solver = settings.clone();
            let found = witness(&finer, &sequence, false, stop)?;
            let helps = found.testimony == Testimony::SameSequence && found.agrees(&finer.solver);
            helps.then(|| {
                let (words, statement) = (in_words(&settings, &case.solver), &first.statement);
                let reason = format!("repeated with {words}; at first: {statement}");
                (settings, reason)
            })
        })
}
