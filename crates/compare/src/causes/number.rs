//! Other parameters of the case, one or two at once.

use super::equations;
use super::evidence::Evidence;
use super::fit::{Numbers, Unknown, closest, least_squares, left};
use super::judge::{ALL, CLOSE, EXACT, EXPLAINED, OF_FITTED};
use super::motion::Played;
use super::parameters::{self, EventAgreement, FoundBy, OtherNumber, OtherParameters, of_normal_force};
use super::search::{Search, Tried};
use super::{Cause, Causes, Proposal, proposals};
use crate::diagnosis::{CauseKind, limit_of};
use std::sync::Arc;
use stickslip_engine::workers::over_processors;
use stickslip_system::friction::Law;
use stickslip_system::record::sequence::SequenceEvent;

/// Smallest explained share before an onset from noise: a motion is smooth there, and many parameters change it alike.
const OF_SMOOTH: f64 = 1.0 - 1e-6;
/// Secants for each landmark, and the largest factor of a step.
const SECANTS: usize = 5;
const FACTOR: f64 = 2.5;
const STEP: f64 = 1e-6;

const RADIUS: &str = "contact.radius";
pub(crate) const BREAKAWAY: &str = "friction.breakaway";

/// Parameters by which friction is proportional if they change by one factor.
const COEFFICIENTS: [&str; 11] = [
    "breakaway",
    "breakaway_backward",
    "kinetic",
    "kinetic_backward",
    "low_speed",
    "high_speed",
    "viscous",
    "linear",
    "quadratic",
    "cubic",
    "coefficient",
];

/// Whether friction is proportional to a parameter and to the others of this kind.
pub(super) fn is_coefficient(path: &str) -> bool {
    let name = path.strip_prefix("friction.").and_then(|name| name.split('.').next());
    name.is_some_and(|name| COEFFICIENTS.contains(&name))
}

/// Parameters that differ.
#[derive(Debug, Clone, Default)]
pub(crate) struct ChangedNumber {
    /// Paths, and values in SI.
    pub numbers: Numbers,
    /// Errors of the values, if the equations gave them.
    errors: Vec<f64>,
    told: bool,
    /// From the value on, away from the reference's, the motion does not depend on the parameter.
    beyond: bool,
}

impl From<Numbers> for ChangedNumber {
    fn from(numbers: Numbers) -> ChangedNumber {
        ChangedNumber {
            numbers,
            ..ChangedNumber::default()
        }
    }
}

impl ChangedNumber {
    /// Parameters that the equations show between the candidate's samples.
    pub fn of_equations(search: &Search<'_>) -> Vec<Proposal> {
        proposals(equations::fitted(search))
    }

    /// Parameters with the errors of their values, which the equations show.
    pub fn told(numbers: Numbers, errors: Vec<f64>) -> ChangedNumber {
        ChangedNumber {
            errors,
            told: true,
            ..ChangedNumber::from(numbers)
        }
    }

    /// mu_0 by the torque at which the candidate's sticks end.
    pub fn of_breakaways(search: &Search<'_>) -> Vec<Proposal> {
        let number = |value: f64| ChangedNumber::from(vec![(BREAKAWAY.to_owned(), value)]);
        proposals(search.breakaway.map(number))
    }

    /// Usual mistakes of a parameter; and values that bring a landmark of an event table to the candidate's.
    pub fn mistaken(search: &Search<'_>) -> Vec<Proposal> {
        let evidence = search.evidence;
        let unknown = evidence.unknown();
        let mistaken = |unknown: &'_ Unknown| -> Vec<Numbers> {
            let values = unknown.mistaken.iter();
            values.map(|value| unknown.changes(*value)).collect()
        };
        let mut all: Vec<Numbers> = unknown.iter().flat_map(mistaken).collect();
        // Samples show those in the equations better than events do.
        let is_sought = |unknown: &&Unknown| {
            let outside = ["initial.", "perturbation.", BREAKAWAY];
            evidence.observation.is_none() || outside.iter().any(|table| unknown.path.starts_with(table))
        };
        let sought: Vec<&Unknown> = unknown.iter().filter(is_sought).collect();
        let (starts, events, breakaway) = (search.starts(), evidence.observed_as(None), search.breakaway);
        let found = over_processors(sought.len(), &|| false, |k| {
            let guess = breakaway.filter(|_| sought[k].path == BREAKAWAY);
            let values = starts.iter();
            let values = values.filter_map(|start| by_landmarks(&events, sought[k], *start, guess));
            values.map(|value| sought[k].changes(value)).collect::<Vec<_>>()
        });
        all.extend(found.into_iter().flatten());
        proposals(all.into_iter().map(ChangedNumber::from))
    }

    /// Pairs of parameters with which the motion comes closest to the candidate.
    pub fn pairs(search: &Search<'_>) -> Vec<Proposal> {
        fitted(search, true)
    }

    /// All coefficients of friction times the factor of a radius or a normal force, which is the same friction.
    pub fn as_friction(search: &Search<'_>) -> Vec<Proposal> {
        let case = search.evidence.case;
        let of = |tried: &Tried| -> Option<ChangedNumber> {
            let ([(path, value)], told) = (tried.cause.numbers(), tried.cause.is_told()) else {
                return None;
            };
            if path != RADIUS && !of_normal_force(path) {
                return None;
            }
            let factor = value / case.number(path)?.value;
            let all = case.numbers().iter().filter(|number| is_coefficient(&number.path));
            let numbers: Numbers = all.map(|number| (number.path.clone(), factor * number.value)).collect();
            Some(ChangedNumber { told, ..numbers.into() })
        };
        proposals(search.causes().filter_map(of))
    }

    /// Number of factors by which parameters change, or of values for those that are 0.
    fn factors(&self, evidence: &Evidence<'_>) -> usize {
        let factor = |(path, value): &(String, f64)| match evidence.own(path) {
            0.0 => *value,
            own => value / own,
        };
        let mut factors: Vec<f64> = self.numbers.iter().map(factor).collect();
        factors.sort_by(f64::total_cmp);
        factors.dedup_by(|a, b| (*a - *b).abs() <= 1e-12 * a.abs());
        factors.len()
    }

    /// Coefficients of friction are mistaken most, then come the others, the normal force, and the radius.
    pub fn unlikely(&self) -> usize {
        let of = |(path, _): &(String, f64)| match path.as_str() {
            path if path.starts_with("friction.") => 0,
            RADIUS => 3,
            path => 1 + usize::from(of_normal_force(path)),
        };
        self.numbers.iter().map(of).max().unwrap_or(0)
    }

    fn named(&self, evidence: &Evidence<'_>, explained: f64) -> Vec<OtherNumber> {
        let each = self.numbers.iter().enumerate().map(|(k, (path, value))| {
            let error = match self.errors.get(k) {
                _ if self.beyond => f64::NAN,
                Some(error) => *error,
                // From the part of the difference that remains.
                None => 3.0 * (value - evidence.own(path)).abs() * (1.0 - explained).max(0.0).sqrt(),
            };
            OtherNumber::of(evidence.case, path, *value, error)
        });
        each.collect()
    }

    fn found_by(&self, evidence: &Evidence<'_>) -> FoundBy {
        let of_samples = evidence.observation.is_some();
        match () {
            () if self.beyond && of_samples => FoundBy::Samples,
            () if !self.errors.is_empty() => FoundBy::Equations,
            () if of_samples && self.numbers.iter().all(|(path, _)| path == BREAKAWAY) => FoundBy::Breakaways,
            () if of_samples => FoundBy::Samples,
            () => FoundBy::Events,
        }
    }
}

impl Cause for ChangedNumber {
    /// Parameters with which the motion comes closest to the candidate, each alone.
    fn propose(search: &Search<'_>) -> Vec<Proposal> {
        fitted(search, false)
    }

    fn run(&self, evidence: &Evidence<'_>, start: usize) -> Option<Played> {
        evidence.with_numbers(start, &self.numbers)
    }

    fn least(&self, evidence: &Evidence<'_>) -> f64 {
        let several = self.factors(evidence) > 1;
        match () {
            () if evidence.observation.is_none() => EXACT,
            () if self.told && several => OF_FITTED,
            () if self.told => EXPLAINED,
            () if evidence.is_smooth => OF_SMOOTH,
            // Some of all pairs fit many motions by chance.
            () if several => EXACT,
            () => 1.0 - ALL,
        }
    }

    fn complexity(&self, evidence: &Evidence<'_>) -> usize {
        self.factors(evidence)
    }

    fn parameters(&self) -> Option<&ChangedNumber> {
        Some(self)
    }

    fn is_told(&self) -> bool {
        self.told
    }

    fn words(&self, _: &Search<'_>) -> (CauseKind, String) {
        (CauseKind::AnotherParameter, String::new())
    }

    fn report(&self, search: &Search<'_>, all: &[Tried], causes: &mut Causes) -> (CauseKind, String) {
        report(search, all, causes)
    }
}

/// The diagnosis of the parameters of the best of `all`, which explain as much.
pub(crate) fn report(search: &Search<'_>, all: &[Tried], causes: &mut Causes) -> (CauseKind, String) {
    let evidence = search.evidence;
    let (best, judged) = (&all[0].cause, &all[0].judged);
    let named = |cause: &Proposal| {
        let parameters = cause.parameters();
        parameters.map_or_else(Vec::new, |parameters| parameters.named(evidence, judged.explained))
    };
    let numbers = named(best);
    let mut or: Vec<OtherNumber> = Vec::new();
    // All coefficients of friction at once are none where one of them does.
    let is_alone = |tried: &&Tried| match tried.cause.numbers() {
        [] => false,
        [_] => tried.cause.stepper().is_none(),
        several => several.iter().all(|(path, _)| !path.starts_with("friction.")),
    };
    let is_one = |tried: &&Tried| tried.cause.complexity(evidence) == 1;
    let is_single = best.stepper().is_none() && is_one(&&all[0]);
    // Parameters that change together, such as those that follow the speed of a drive, are one alternative.
    for other in all[1..].iter().filter(|_| is_single).filter(is_one).filter(is_alone) {
        let first = named(&other.cause).into_iter().next();
        let is_new = |number: &OtherNumber| numbers.iter().chain(&or).all(|known| known.path != number.path);
        or.extend(first.filter(is_new));
    }
    let events = evidence.compared_events();
    let parameters = OtherParameters {
        found_by: best
            .parameters()
            .map_or(FoundBy::Samples, |parameters| parameters.found_by(evidence)),
        numbers,
        explained: judged.explained,
        or,
        rerun: (events > 0 && judged.has_events()).then(|| EventAgreement::of(events, judged)),
    };
    let words = words(&parameters, evidence, &search.outcome(&all[0]));
    causes.parameters = Some(parameters);
    words
}

fn words(other: &OtherParameters, evidence: &Evidence<'_>, outcome: &str) -> (CauseKind, String) {
    let words: Vec<String> = other.numbers.iter().map(OtherNumber::words).collect();
    let mut text = words.join(" and ");
    let mut kind = CauseKind::AnotherParameter;
    if let [only] = &other.numbers[..]
        && only.path == BREAKAWAY
        && !only.error.is_nan()
    {
        kind = CauseKind::StickTest;
        let (own, physics) = (evidence.own(BREAKAWAY), evidence.physics);
        let mut at = format!("it breaks away at {:.3} {}", only.value / own, limit_of(physics));
        let sliding = physics.system().law.coefficient(0.0);
        if (only.value / sliding - 1.0).abs() < 0.01 {
            at += &format!(": that is the limit of slip, mu(0) = {sliding}, and not mu_0 = {own}");
        }
        text = format!("{at}; {text}");
    }
    text += match other.found_by {
        FoundBy::Equations => ", by the equations between its samples",
        FoundBy::Breakaways => ", by the torque at which its sticks end",
        FoundBy::Events => ", by its events",
        FoundBy::Samples => ", by its samples",
    };
    text += &format!(": {outcome}");
    for number in &other.or {
        text += &format!("; {} explains as much", number.words());
    }
    (kind, text)
}

/// Parameters, one or two at once, with which the motion comes closest to the candidate. Values that were tried and
/// explain something are starts of the fits.
fn fitted(search: &Search<'_>, pairs: bool) -> Vec<Proposal> {
    let evidence = search.evidence;
    let better = search.tried.iter().filter(|tried| tried.judged.explained > 0.0);
    let guesses = better.filter_map(|tried| match tried.cause.numbers() {
        [number] if tried.cause.stepper().is_none() => Some(number.clone()),
        _ => None,
    });
    let guesses: Vec<(String, f64)> = guesses.collect();
    let mut unknown = evidence.unknown();
    // All coefficients with one of them are the same pair as another.
    unknown.retain(|unknown| !pairs || unknown.scaled.is_empty());
    let found = search.starts().into_iter().flat_map(|start| {
        let play = |numbers: &[(String, f64)], until| evidence.until(until).with_numbers(start, numbers);
        let base = evidence.unchanged(start);
        base.map_or_else(Vec::new, |base| {
            closest(evidence, &play, &base, &unknown, pairs, &guesses)
        })
    });
    let numbers = found.map(|(which, point)| Unknown::changes_of(&unknown, &which, &point.values));
    proposals(numbers.map(ChangedNumber::from))
}

/// The value of a parameter with which the events come closest to the candidate's: by secants on landmarks, from the
/// reference's value and from a guess.
fn by_landmarks(evidence: &Evidence<'_>, unknown: &Unknown, start: usize, guess: Option<f64>) -> Option<f64> {
    let changed = |s: f64| evidence.with_numbers(start, &unknown.changes(unknown.value * s.exp()));
    let run = |s: f64| Some(changed(s)?.events);
    let agreement = |events: &[SequenceEvent]| parameters::agreement(events, evidence.word, evidence.period).cost;
    let own = evidence
        .unchanged
        .get(start)?
        .as_ref()
        .filter(|_| unknown.value != 0.0)?;
    let own = &own.played.events;
    let (beside, by) = match run(STEP) {
        Some(beside) => (beside, STEP),
        None => (run(-STEP)?, -STEP),
    };
    let [target, now, moved] = [evidence.word, own, &beside].map(parameters::landmarks);
    let mut best = (agreement(own), None);
    for value in [2.0 * unknown.value, 0.5 * unknown.value].into_iter().chain(guess) {
        let cost = run((value / unknown.value).ln()).map(|events| agreement(&events));
        if let Some(cost) = cost.filter(|cost| *cost < best.0) {
            best = (cost, Some(value));
        }
    }
    for k in 0..target.len() {
        let (Some(wanted), Some(now), Some(moved)) = (target[k], now[k], moved[k]) else {
            continue;
        };
        let (mut s, mut miss) = (0.0, now - wanted);
        let mut step = -miss * by / (moved - now);
        for _ in 0..SECANTS {
            if !step.is_finite() || step == 0.0 {
                break;
            }
            let next = s + step.clamp(-FACTOR.ln(), FACTOR.ln());
            let Some(events) = run(next) else { break };
            let cost = agreement(&events);
            if cost < best.0 {
                best = (cost, Some(unknown.value * next.exp()));
            }
            let Some(there) = parameters::landmarks(&events)[k] else {
                break;
            };
            let error = there - wanted;
            if error.abs() < 1e-12 || error == miss {
                break;
            }
            step = -error * (next - s) / (error - miss);
            (s, miss) = (next, error);
        }
    }
    best.1
}

/// Parameters that the equations show, with their values and errors by runs over all samples; `None` if no run comes
/// closer to the candidate.
pub(crate) fn refined(evidence: &Evidence<'_>, tried: &Tried) -> Option<Tried> {
    const STEPS: usize = 3;
    let known = tried.cause.parameters().filter(|known| !known.errors.is_empty())?;
    if !tried.judged.is_cause() {
        return None;
    }
    let seen = evidence.observation?;
    let rows = seen.time.partition_point(|time| *time <= evidence.covered.1);
    let with = |values: &[f64]| -> Numbers {
        let paths = known.numbers.iter().map(|(path, _)| path.clone());
        paths.zip(values.iter().copied()).collect()
    };
    let play = |values: &[f64]| evidence.with_numbers(tried.start, &with(values));
    let mut values: Vec<f64> = known.numbers.iter().map(|(_, value)| *value).collect();
    let (mut best, mut played) = (tried.clone(), play(&values)?);
    for _ in 0..STEPS {
        let mut now = seen.residual(&played.values, rows);
        let mut moved: Vec<Vec<f64>> = Vec::new();
        for k in 0..values.len() {
            let mut beside = values.clone();
            beside[k] *= 1.0 + STEP;
            moved.push(seen.residual(&play(&beside)?.values, rows));
        }
        let mut slopes = vec![vec![0.0; now.len()]; values.len()];
        let mut count = 0;
        for (row, own) in now.iter_mut().enumerate() {
            let changes = || moved.iter().map(|moved| moved[row] - *own);
            // At an event between two samples a channel may jump: that row says nothing of the value.
            if own.abs() <= CLOSE && changes().all(|change| change.abs() <= CLOSE) {
                let each = slopes.iter_mut().zip(changes());
                each.for_each(|(slope, change)| slope[row] = change / STEP);
                count += 1;
            } else {
                *own = 0.0;
            }
        }
        let (step, inverse) = least_squares(&slopes, &now)?;
        let each = values.iter_mut().zip(&step);
        each.for_each(|(value, step)| *value *= 1.0 + step);
        played = play(&values)?;
        let judged = tried.cause.judge(evidence, &played)?;
        // The equations hold between events: beyond their errors, events that a solver misplaces move the value.
        let mut changes = values.iter().zip(&known.numbers).zip(&known.errors);
        let is_within = changes.all(|((new, (_, old)), error)| (new - old).abs() <= *error);
        if judged.left >= best.judged.left || !judged.is_cause() || !is_within {
            break;
        }
        let variance = left(&slopes, &now) / count.max(values.len() + 1) as f64;
        let errors = values.iter().zip(&inverse);
        let cause = ChangedNumber {
            numbers: with(&values),
            errors: errors
                .map(|(value, inverse)| 3.0 * (value * value * inverse * variance).sqrt())
                .collect(),
            ..known.clone()
        };
        (best.cause, best.judged) = (Arc::new(cause), judged);
    }
    (best.judged.left < tried.judged.left).then_some(best)
}

/// The last value of a parameter, on the way to the reference's, from which on the motion is that of the mistake.
pub(crate) fn beyond(evidence: &Evidence<'_>, tried: &Tried) -> Option<Proposal> {
    const FARTHER: f64 = 1.01;
    const HALVINGS: usize = 24;
    let numbers = tried.cause.numbers();
    if numbers.is_empty() || tried.cause.stepper().is_some() || tried.cause.complexity(evidence) != 1 {
        return None;
    }
    let at = |part: f64| -> Numbers {
        let moved = numbers.iter().map(|(path, value)| {
            let own = evidence.own(path);
            (path.clone(), own + part * (value - own))
        });
        moved.collect()
    };
    let base = evidence.with_numbers(tried.start, numbers)?;
    // None where no run was made: nothing is known of that value.
    let is_same = |part: f64| {
        let other = evidence.with_numbers(tried.start, &at(part))?;
        Some(evidence.is_same(&base, &other))
    };
    if !is_same(FARTHER)? && !is_same(1.0 / FARTHER)? {
        return None;
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        *(if is_same(middle)? { &mut high } else { &mut low }) = middle;
    }
    Some(Arc::new(ChangedNumber {
        told: tried.cause.is_told(),
        beyond: true,
        ..at(high).into()
    }))
}
