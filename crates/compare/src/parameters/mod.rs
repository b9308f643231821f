//! Search for the parameter of the case that differs in a candidate.
//!
//! Between events the equations of a case are smooth in its parameters, so they are fitted to the candidate's own
//! channels (`fit`, `equations`, `stretches`). If the candidate satisfies them, or has events alone, runs of the
//! case with one other parameter are fitted to its events (`search`). Each result is tested by a run of the case from
//! where the candidate begins (`trials`). The jump of the states shows a kick, and a common error of all events
//! another clock.

mod equations;
mod fit;
mod jump;
mod mistake;
mod search;
pub mod stretches;
mod trials;

pub use jump::OtherKick;
pub use mistake::{Agreement, EventAgreement, FoundBy, OtherNumber, OtherParameters};

pub(super) use fit::least_squares;
pub(super) use jump::{JumpPass, other_kick};
pub(super) use mistake::of_normal_force;
pub(super) use stretches::StretchPass;
pub(super) use trials::{TrialStart, agreement};

use super::limit::Limit;
use fit::Fitted;
use search::search;
use stickslip_case::WrittenCase;
use stickslip_system::model::KickTime;
use stickslip_system::model::system::{Kick, System};
use stickslip_system::record::sequence::SequenceEvent;
use trials::Trials;

pub(super) struct Material<'a> {
    pub numbers: &'a WrittenCase,
    pub system: &'a System,
    pub places: &'a [usize],
    /// Stretches of the candidate; `None` for an event table.
    pub stretches: Option<StretchPass>,
    pub starts: Vec<TrialStart>,
    pub word: &'a [SequenceEvent],
    pub covered: (f64, f64),
    pub period: f64,
    /// mu_0 by the torque at which its sticks end, with its error.
    pub breakaway: Option<(f64, f64)>,
    /// Whether the events differ by more than the error of finding them in samples.
    pub events_differ: bool,
    pub shows_contact: bool,
    pub limit: Limit,
}

/// Paths of the parameters that are not 0, because changes are factors.
fn paths(case: &WrittenCase) -> impl Iterator<Item = &str> {
    let numbers = case.numbers().iter().filter(|number| number.value != 0.0);
    numbers.map(|number| number.path.as_str())
}

fn absent(system: &System) -> Vec<String> {
    let mut found = Vec::new();
    for (name, train) in [("rotor", &system.rotor), ("stator", &system.stator)] {
        for (key, values) in [("damping", &train.damping), ("viscous", &train.viscous)] {
            let zeros = (0..values.len()).filter(|&index| values[index] == 0.0);
            found.extend(zeros.map(|index| format!("{name}.{key}.{index}")));
        }
    }
    found
}

/// Events closer than this part of the natural period belong to the same equations.
const SAME_RUN: f64 = 1e-5;

/// Most steps of a run times the number of parameters, with some thirty runs each. More takes over half a minute.
const MOST_STEPS: u64 = 60_000;

const BREAKAWAY: &str = "friction.breakaway";

/// Evidence of the candidate's channels about the equations of the case.
#[derive(Debug)]
pub(super) enum Reading {
    None,
    /// They hold, and confirm the parameters with these paths.
    Hold(Vec<String>),
    /// They do not hold, and one or two parameters mend them.
    Mended,
    /// They do not hold, and no parameter mends them.
    Fail,
}

/// Evidence about the equations, and parameters, one or two at once, that the channels or events propose.
pub(super) fn other_parameters(mut material: Material<'_>) -> (Reading, Option<OtherParameters>) {
    let stretches = material.stretches.take().map(StretchPass::finish).unwrap_or_default();
    let paths = paths(material.numbers);
    let in_equations: Vec<&str> = paths
        .filter(|path| !path.starts_with("perturbation.") && !is_initial(path) && *path != BREAKAWAY)
        .collect();
    let absent = absent(material.system);
    let fitted = fit::fit(material.numbers, material.places, &stretches, &in_equations, &absent);
    let reading = match &fitted {
        Fitted::Nothing => Reading::None,
        Fitted::Satisfied(held) => Reading::Hold(held.clone()),
        Fitted::Explained { .. } => Reading::Mended,
        Fitted::Unexplained => Reading::Fail,
    };
    (reading, numbers(&material, fitted))
}

fn numbers(material: &Material<'_>, fitted: Fitted) -> Option<OtherParameters> {
    let Material {
        numbers: case, word, ..
    } = *material;
    let trials = |start: &TrialStart| Trials::new(material, start.clone());
    let number = |(path, value, error): &(String, f64, f64)| OtherNumber::of(case, path, *value, *error);
    let (held, by_channels) = match fitted {
        Fitted::Explained { numbers, explained, or } => {
            return Some(OtherParameters {
                numbers: numbers.iter().map(number).collect(),
                found_by: FoundBy::Equations,
                explained,
                or: or.iter().map(number).collect(),
                rerun: None,
            });
        }
        Fitted::Unexplained => return None,
        Fitted::Satisfied(held) => (held, true),
        Fitted::Nothing => (Vec::new(), false),
    };
    if !material.events_differ {
        return None;
    }
    let wanted = paths(case).map(str::to_owned).filter(|path| !held.contains(path));
    let wanted = wanted.map(|path| {
        let guess = material.breakaway.filter(|_| path == BREAKAWAY);
        (path, guess.map(|(value, _)| value).into_iter().collect())
    });
    let wanted: Vec<(String, Vec<f64>)> = wanted.collect();
    let supported = another_breakaway(material).then_some(BREAKAWAY);
    for start in &material.starts {
        let trials = trials(start);
        let later = matches!(start, TrialStart::At(..));
        let of_start = |path: &str| is_initial(path) || past_kick(&material.system.kicks, path, start);
        let wanted = wanted.iter().filter(|(path, _)| !(later && of_start(path)));
        let wanted: Vec<_> = wanted.cloned().collect();
        // If the events agree from the candidate's beginning on, the cause lies before it.
        let as_it_is = |found: &Agreement| found.unmatched == 0 && found.rms <= SAME_RUN * material.period;
        let too_long = |steps: u64| steps.saturating_mul(wanted.len() as u64) > MOST_STEPS;
        let run = trials.run_counted(&[]).filter(|(_, steps)| !too_long(*steps));
        if run.is_none_or(|(run, _)| as_it_is(&trials.agreement(&run))) {
            continue;
        }
        let found = search(&trials, &wanted, supported);
        let Some((before, [best, or @ ..])) = found.as_ref().map(|(before, hits)| (*before, &hits[..])) else {
            continue;
        };
        let to_number = |hit: &search::Hit| OtherNumber::of(case, &hit.path, hit.value, hit.error);
        let from_torque = by_channels && supported == Some(best.path.as_str());
        let rerun = EventAgreement::of(word.len(), before, best.after);
        return Some(OtherParameters {
            numbers: vec![to_number(best)],
            found_by: if from_torque {
                FoundBy::Breakaways
            } else {
                FoundBy::Events
            },
            explained: rerun.explained,
            or: or.iter().map(to_number).collect(),
            rerun: Some(rerun),
        });
    }
    None
}

fn another_breakaway(material: &Material<'_>) -> bool {
    /// Smallest change, in parts of mu_0, and largest interquartile range of the breakaways, in parts of the change.
    const LEAST: f64 = 0.01;
    const SCATTER: f64 = 0.1;
    let own = material.numbers.number(BREAKAWAY).map(|number| number.value);
    own.zip(material.breakaway).is_some_and(|(own, (value, scatter))| {
        let change = (value - own).abs();
        change >= LEAST * own && scatter < SCATTER * change
    })
}

fn is_initial(path: &str) -> bool {
    path.starts_with("initial.")
}

fn past_kick(kicks: &[Kick], path: &str, start: &TrialStart) -> bool {
    let TrialStart::At(from, _) = start else { return false };
    let index = path
        .strip_prefix("perturbation.")
        .and_then(|rest| rest.split('.').next()?.parse::<usize>().ok());
    index.is_some_and(|index| match kicks.get(index).map(|kick| kick.time) {
        Some(KickTime::At(time)) => time <= *from,
        _ => true,
    })
}
