//! How many digits of a result are true: a ladder of independent runs, and what rounding can do.
//!
//! The result is held against the finest run of each independent method (a witness). Two methods that share no error
//! differ by about the larger of their errors, so that twice the distance to the nearest witness covers the result's
//! own error, if the distance is taken at its largest over some events around: at a single event two errors may cross.
//! `erk` follows the oscillation as `arkode` does: of a result of `arkode` it is a witness of the sequence, not of the times.
//! What rounding does to all methods alike comes on top: no distance between them tells of it. The oracle can have the last
//! word ([`super::exact`]).

use super::Summary;
use super::bands::{Bands, bands, compared_output};
use super::deadline::Deadline;
use super::ladder::{
    Finished, Ladder, Rung, agree, can_lose_stability, climb, finest_arkode, many_periods, matched, run, shares_errors,
    time_scale, witnesses,
};
use super::linearised::{Linearised, linearise};
use super::verdict::LEAST_WITNESSES;
use super::warning::{Warning, warnings};

pub use super::verdict::{CertifiedEvent, Verdict};

use crate::case::{Case, WrittenCase};
use crate::oracle::OracleError;
use crate::record::{Event, EventKind, MemoryRecorder};
use crate::simulation::Excitation;
use crate::simulation::{Method, OutputOptions, SolverOptions};
use serde::Serialize;
use std::borrow::Cow;

/// Two errors may cross within one event or a few; over so many on each side they do not.
const NEIGHBOURS: usize = 4;

/// An event that no two methods place within this share of the natural period is not known at all: its place in the
/// oscillation is open.
pub(super) const LARGEST_SHARE: f64 = 0.02;

/// e-folds by which rounding has to grow until it can be seen in the relative velocity; some five below those that make a
/// stick of it.
const GROWN_NOISE: f64 = 20.0;

/// Units of the last place of an event's time that rounding on the way to it may take, where it was not followed.
const ROUNDING: f64 = 64.0;

/// What the ladder says of a result.
#[derive(Debug, Clone, Serialize)]
pub struct Certificate {
    /// Every event of the result, in order.
    pub events: Vec<CertifiedEvent>,
    /// Every run.
    pub ladder: Vec<Rung>,
    /// How far the rows of the trajectory can be off, up to the first event that is not converged.
    #[serde(skip)]
    pub bands: Bands,
    /// Of the whole sequence: the worst of its events, or that others go on where the result has no more.
    pub verdict: Verdict,
    /// G, e-folds.
    pub growth_exponent: Option<f64>,
    /// e-folds from the loss of stability to the first stick.
    pub growth_to_onset: Option<f64>,
    /// e-folds by which the kicks stand above rounding at the first stick.
    pub kick_above_noise: Option<f64>,
    /// e-folds by which the kick that moves the first stick most stands above the one that would move it by its uncertainty:
    /// above the noise of the methods themselves. `None` without a kick or a converged stick.
    pub kick_above_methods: Option<f64>,
    /// Whether two independent methods agree with each other on the whole sequence and its times. If the result does not
    /// agree with them, it is the result that is coarse.
    pub others_agree: bool,
    /// Runs that the ladder lacks because they would have taken too long, in a sentence.
    pub left_out: Option<String>,
    /// Whether the oracle had the last word on the events.
    pub by_oracle: bool,
    /// Why the oracle has not, where it was to speak if it could.
    pub without_oracle: Option<String>,
    /// What the ladder said that the oracle contradicts, in one sentence.
    pub contradiction: Option<String>,
    /// The settings of the result.
    #[serde(skip)]
    pub solver: SolverOptions,
    /// What the run of the case by its own settings has to be warned of.
    #[serde(skip)]
    pub warnings: Vec<Warning>,
    /// d(event time)/d(parameter); of a case that does not slow down through a loss of stability nothing.
    #[serde(skip)]
    pub linearised: Linearised,
}

impl Certificate {
    /// Digits that every event of the sequence has; `None` without any.
    pub fn least_digits(&self) -> Option<u32> {
        self.in_event_sequence().map(CertifiedEvent::digits).min()
    }

    /// Digits of the event of the sequence of which double precision can hold least.
    pub fn most_digits(&self) -> Option<u32> {
        self.in_event_sequence().filter_map(CertifiedEvent::most_digits).min()
    }

    pub(super) fn in_event_sequence(&self) -> impl Iterator<Item = &CertifiedEvent> {
        let word = |event: &&CertifiedEvent| {
            EventKind::ALL
                .iter()
                .any(|kind| kind.name() == event.kind && kind.in_event_sequence())
        };
        self.events.iter().filter(word)
    }
}

/// Why there is no certificate.
#[derive(Debug, thiserror::Error)]
pub enum CertifyError {
    /// The case itself cannot be run.
    #[error("the run itself fails: {0}")]
    Run(String),
    /// The oracle has no events of it.
    #[error(transparent)]
    Oracle(#[from] OracleError),
    /// The control asked for an end.
    #[error("interrupted")]
    Interrupted,
}

/// Certifies a result of this case, which its own settings would give again: its events, and those of its rows that
/// [`compared_output`] picks.
///
/// The runs go over as many threads as there are processors. `stop` is asked now and then.
///
/// # Errors
/// If the case with its own settings fails, or `stop` says so.
pub fn certify(
    case: &Case,
    result: &MemoryRecorder,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Certificate, CertifyError> {
    certify_until(case, None, result, &Deadline::default(), stop)
}

/// [`certify`], whose runs have to be done by a deadline. Slopes are by the numbers of the case as it is `written`, if that is known.
pub(super) fn certify_until(
    case: &Case,
    written: Option<&WrittenCase>,
    result: &MemoryRecorder,
    deadline: &Deadline,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Certificate, CertifyError> {
    let output = match result.samples.is_empty() {
        true => OutputOptions::at_the_ends(case.output.end_time),
        false => compared_output(&case.output),
    };
    let limited = |solver: &SolverOptions| SolverOptions {
        max_wall_time: deadline.limit(solver.max_wall_time),
        ..solver.clone()
    };
    // What the run of the case by its own settings is asked for is what a loss of stability does.
    let own = can_lose_stability(case).then(|| run(case, &limited(&case.solver), &output, stop));
    if stop() {
        return Err(CertifyError::Interrupted);
    }
    if let Some(failure) = own.as_ref().and_then(|own| own.rung.failure.clone()) {
        return Err(CertifyError::Run(failure));
    }
    let summary = own.as_ref().map(|own| Summary::of_run(&case.system, &own.report));
    let warnings = summary.iter().flat_map(|summary| warnings(case, summary)).collect();
    let summary = summary.unwrap_or_default();
    let many_periods = own.as_ref().and_then(|own| many_periods(case, own, deadline, stop));
    let follows = own.is_some();
    let (ladder, linearised) = std::thread::scope(|scope| {
        let linearised = scope.spawn(|| match follows {
            true => {
                let written = written.map_or_else(|| Cow::Owned(WrittenCase::of(case)), Cow::Borrowed);
                linearise(&written, limited(&case.solver).max_wall_time, stop)
            }
            false => Ok(Linearised::default()),
        });
        let ladder = climb(case, &result.events, &output, own, many_periods, deadline, stop);
        (ladder, linearised.join())
    });
    let Ladder { runs: ladder, left_out } = ladder;
    if stop() {
        return Err(CertifyError::Interrupted);
    }
    let linearised = match linearised {
        Ok(Ok(linearised)) => linearised,
        Ok(Err(failure)) => return Err(CertifyError::Run(failure.to_string())),
        Err(panic) => std::panic::resume_unwind(panic),
    };
    // A run of `series` can be free of the noise that the onset of every other method belongs to: `arkode` decides as well.
    let noise = summary.noise_determined
        || finest_arkode(&ladder).is_some_and(|arkode| Summary::of_run(&case.system, &arkode.report).noise_determined);
    let events = judge(case, &result.events, &ladder, &linearised, noise);
    let witnesses = witnesses(&ladder, case.solver.method);
    // Where the others go on, the result lacks an event that grazes.
    let ends_alike = witnesses
        .iter()
        .filter(|run| run.rung.events == run.rung.agreeing)
        .count();
    let worst = |verdict: Verdict| events.iter().any(|event| event.verdict == verdict);
    let differs = worst(Verdict::SequenceDiffers) || ends_alike < LEAST_WITNESSES;
    let verdict = match (worst(Verdict::NoiseDetermined), differs) {
        (true, _) => Verdict::NoiseDetermined,
        (_, true) => Verdict::SequenceDiffers,
        _ => Verdict::Converged,
    };
    let near = LARGEST_SHARE * time_scale(case);
    let others_agree = (1..witnesses.len()).any(|k| witnesses[..k].iter().any(|run| agree(witnesses[k], run, near)));
    let bands = bands(case, result, &ladder, &events);
    Ok(Certificate {
        kick_above_methods: kick_above_methods(&events, &linearised),
        others_agree,
        bands,
        ladder: ladder.into_iter().map(|finished| finished.rung).collect(),
        verdict,
        growth_exponent: summary.growth_exponent,
        growth_to_onset: summary.growth_to_onset,
        kick_above_noise: summary.kick_above_noise,
        left_out,
        by_oracle: false,
        without_oracle: None,
        contradiction: None,
        solver: case.solver.clone(),
        warnings,
        linearised,
        events,
    })
}

/// ln of what the largest kick does to the time of the first stick, over the uncertainty of that.
fn kick_above_methods(events: &[CertifiedEvent], linearised: &Linearised) -> Option<f64> {
    let index = events.iter().position(|event| event.kind == EventKind::Stick.name())?;
    let (event, linear) = (&events[index], linearised.events.get(index)?);
    let kicks = linearised.parameters.iter().zip(&linear.by_parameter);
    let effect = kicks
        .filter(|(parameter, _)| parameter.path.ends_with(".relative_velocity"))
        .map(|(parameter, slope)| (parameter.value * slope.value).abs())
        .reduce(f64::max)?;
    Some((effect / event.uncertainty).ln()).filter(|folds| folds.is_finite())
}

fn judge(
    case: &Case,
    result: &[Event],
    ladder: &[Finished],
    linearised: &Linearised,
    noise: bool,
) -> Vec<CertifiedEvent> {
    let period = time_scale(case);
    let excitation = Excitation::new(&case.system);
    // All methods share the zeros of the normal force: their distances do not show how these are rounded.
    let mut of_zeros: f64 = 0.0;
    let onset = result.iter().position(|event| event.kind == EventKind::Stick);
    let single = |run: &Finished| -> Vec<f64> {
        let pairs = matched(result, run).into_iter().zip(result);
        pairs.map(|(t, event)| (t - event.time).abs()).collect()
    };
    let around = |single: &Vec<f64>| -> Vec<f64> {
        let largest = |(index, own): (usize, &f64)| {
            // What comes before the first stick is not judged by what has grown until then.
            let before = onset.filter(|onset| index < *onset).unwrap_or(single.len());
            let neighbours = &single[index.saturating_sub(NEIGHBOURS)..before.min(index + NEIGHBOURS + 1)];
            // A distance without a counterpart is left out of its neighbours'.
            let largest = neighbours.iter().copied().fold(0.0, f64::max);
            if own.is_nan() { f64::NAN } else { largest }
        };
        single.iter().enumerate().map(largest).collect()
    };
    let witnesses = witnesses(ladder, case.solver.method);
    let times: Vec<Vec<f64>> = witnesses.iter().map(|run| matched(result, run)).collect();
    // Whether two witnesses place an event alike, wherever the result has it.
    let alike = |index: usize| {
        let near = |a: &Vec<f64>, b: &Vec<f64>| (a[index] - b[index]).abs() <= LARGEST_SHARE * period;
        (1..times.len()).any(|k| times[..k].iter().any(|other| near(&times[k], other)))
    };
    let of = case.solver.method;
    let independent: Vec<bool> = witnesses.iter().map(|run| !shares_errors(run, of)).collect();
    let by_series = witnesses.iter().position(|run| run.method == Method::Series);
    let distances: Vec<Vec<f64>> = witnesses.into_iter().map(single).collect();
    let around_witnesses: Vec<Vec<f64>> = distances.iter().map(around).collect();
    let series = by_series.map(|index| &around_witnesses[index]);
    let arkode: Option<Vec<f64>> = finest_arkode(ladder).map(|run| around(&single(run)));
    let mut lost: Option<Verdict> = None;
    result
        .iter()
        .enumerate()
        .map(|(index, event)| {
            let linear = linearised.events.get(index).filter(|linear| linear.kind == event.kind);
            if matches!(event.kind, EventKind::Separation | EventKind::Contact) {
                of_zeros = of_zeros.max(excitation.rounding_of_zero(event.time));
            }
            let rounding = match linear {
                Some(linear) => linear.rounding,
                None if linearised.parameters.is_empty() => f64::NAN,
                None => f64::INFINITY,
            };
            let not_followed = ROUNDING * f64::EPSILON * event.time + of_zeros;
            let seen = around_witnesses.iter().filter(|d| !d[index].is_nan()).count();
            let of_independent = around_witnesses.iter().zip(&independent).filter(|pair| *pair.1);
            let nearest = of_independent.map(|(d, _)| d[index]).fold(f64::INFINITY, f64::min);
            let own = arkode.as_ref().map_or(0.0, |d| d[index]);
            let own = if own.is_nan() { f64::INFINITY } else { own };
            // Another witness may be near by chance; `series` is the finest, and has its say.
            let finest = series.map_or(0.0, |d| d[index]);
            let apart = (2.0 * nearest).max(if finest.is_nan() { 0.0 } else { finest });
            let uncertainty = apart + own + if rounding.is_nan() { not_followed } else { rounding };
            let timed =
                matches!(event.kind, EventKind::Corner | EventKind::Kick) && distances.iter().all(|d| d[index] == 0.0);
            if lost.is_none() && event.kind.in_event_sequence() {
                if noise && onset.is_some_and(|onset| index >= onset) {
                    lost = Some(Verdict::NoiseDetermined);
                } else if seen < LEAST_WITNESSES {
                    lost = Some(Verdict::SequenceDiffers);
                } else if uncertainty.is_nan() || uncertainty > LARGEST_SHARE * period {
                    // Where the others agree it is the result that is coarse; half a period off it is another event.
                    lost = match (alike(index), uncertainty <= 0.5 * period) {
                        (true, true) => None,
                        (true, false) => Some(Verdict::SequenceDiffers),
                        (false, _) => Some(Verdict::NoiseDetermined),
                    };
                }
            }
            // Where the onset is noise, so are the crossings of the stability margin that the oscillation makes on its way
            // there: smooth sliding has none of them.
            let of_margin = matches!(event.kind, EventKind::Destabilised | EventKind::Restabilised);
            let grown = linear.and_then(|linear| linear.growth).unwrap_or(0.0);
            if lost.is_none() && noise && of_margin && grown > GROWN_NOISE {
                lost = Some(Verdict::NoiseDetermined);
            }
            // An event outside the event sequence that the witnesses do not have, or not within half a period, is no result.
            let placed = seen >= LEAST_WITNESSES && uncertainty <= 0.5 * period;
            let mut alone = None;
            if lost.is_none() && !event.kind.in_event_sequence() && !timed && !placed {
                if noise {
                    lost = Some(Verdict::NoiseDetermined);
                } else {
                    alone = Some(Verdict::SequenceDiffers);
                }
            }
            let verdict = lost.or(alone).unwrap_or(Verdict::Converged);
            let uncertainty = match verdict {
                // Set by the case: known but for the rounding of the number.
                _ if timed => f64::EPSILON * event.time,
                // Nor is any time known better than to its last place.
                Verdict::Converged => uncertainty.max(f64::EPSILON * event.time),
                _ => f64::INFINITY,
            };
            CertifiedEvent {
                time: event.time,
                kind: event.kind.name(),
                verdict,
                uncertainty,
                ladder_verdict: verdict,
                ladder_uncertainty: uncertainty,
                true_error: None,
                exact: None,
                rounding,
                growth: linear.and_then(|linear| linear.growth),
            }
        })
        .collect()
}
