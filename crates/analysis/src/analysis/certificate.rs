//! True digits of a result, from a ladder of independent runs and a bound on rounding.
//!
//! The result is compared with the finest run of each independent method, a witness. Two methods without a common
//! error differ by about the larger of their errors. Twice the distance to the nearest witness therefore covers the
//! error of the result. At a single event two errors may cross, so the largest distance over some neighbouring events
//! counts. `erk` follows the oscillation like `arkode`, so it confirms only the sequence of a result of `arkode`, not
//! its times. Rounding affects all methods alike and is added. The oracle can overrule the ladder ([`super::exact`]).

use super::Summary;
use super::bands::{Bands, bands, compared_output};
use super::ladder::{
    Deadline, Finished, LEAST_WITNESSES, Ladder, Rung, agree, can_lose_stability, climb, finest_arkode, many_periods,
    matched, run, shares_errors, time_scale, witnesses,
};
use super::linearised::{Linearised, linearise};
use super::warning::{Warning, warnings};
use crate::error::Error;

pub use super::ladder::{CertifiedEvent, Verdict};

use serde::Serialize;
use std::borrow::Cow;
use stickslip_case::{Case, WrittenCase};
use stickslip_engine::simulation::{Excitation, Method, OutputOptions, SolverOptions};
use stickslip_system::record::{Event, EventKind, MemoryRecorder};
use stickslip_system::watch::Watch;

/// Neighbours on each side. Two methods can agree by accident at one event, so the largest distance counts.
const NEIGHBOURS: usize = 4;

/// An event is unknown if no two methods agree within this fraction of the natural period: its phase is undetermined.
pub(super) const LARGEST_SHARE: f64 = 0.02;

/// e-folds by which rounding must grow to appear in the relative velocity; a stick needs about five more.
const GROWN_NOISE: f64 = 20.0;

/// Rounding error of an event's time, in units of its last place, if the linearised motion does not cover the event.
const ROUNDING: f64 = 64.0;

/// Verdict of the ladder on a result.
#[derive(Debug, Clone, Serialize)]
pub struct Certificate {
    /// Every event of the result, in order.
    pub events: Vec<CertifiedEvent>,
    /// Every run.
    pub ladder: Vec<Rung>,
    /// Error bands of the trajectory's rows, up to the first event that has not converged.
    #[serde(skip)]
    pub bands: Bands,
    /// Verdict on the whole sequence: the worst of its events, or that other runs go on after its end.
    pub verdict: Verdict,
    /// Growth exponent G, e-folds.
    pub growth_exponent: Option<f64>,
    /// e-folds from the loss of stability to the first stick.
    pub growth_to_onset: Option<f64>,
    /// ln(effect of the kick / effect of rounding) at the first stick.
    pub kick_above_noise: Option<f64>,
    /// ln(effect of the kick / uncertainty) for the time of the first stick and its strongest kick: the margin above
    /// the methods' errors. `None` without a kick or a converged stick.
    pub kick_above_methods: Option<f64>,
    /// Whether two independent methods agree on sequence and times; a result that disagrees is then too coarse.
    pub others_agree: bool,
    /// Runs that were left out for lack of time, in a sentence.
    pub left_out: Option<String>,
    /// Whether the oracle settled the events.
    #[serde(skip)]
    pub by_oracle: bool,
    /// Reason why the oracle could not settle them.
    pub without_oracle: Option<String>,
    /// Contradiction between ladder and oracle, in one sentence.
    pub contradiction: Option<String>,
    /// Settings of the result.
    #[serde(skip)]
    pub solver: SolverOptions,
    /// Warnings of the run by the case's own settings.
    #[serde(skip)]
    pub warnings: Vec<Warning>,
    /// d(event time)/d(parameter); empty if the case does not slow down through a loss of stability.
    #[serde(skip)]
    pub linearised: Linearised,
}

impl Certificate {
    /// Least number of true digits of an event of the sequence; `None` without events.
    pub fn least_digits(&self) -> Option<u32> {
        self.in_event_sequence().map(CertifiedEvent::digits).min()
    }

    /// Least number of digits that double precision allows for an event of the sequence; `None` without events.
    pub fn most_digits(&self) -> Option<u32> {
        self.in_event_sequence().filter_map(CertifiedEvent::most_digits).min()
    }

    /// Origin of the uncertainties: "oracle" or "ladder".
    pub fn uncertainty_by(&self) -> &'static str {
        if self.by_oracle { "oracle" } else { "ladder" }
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

/// Certifies the events and the rows of [`compared_output`] of a result that the case's own settings reproduce.
///
/// The runs use all processors. `stop` is polled.
///
/// # Errors
/// The case with its own settings fails, or `stop` returns `true`.
pub fn certify(case: &Case, result: &MemoryRecorder, stop: &dyn Watch) -> Result<Certificate, Error> {
    certify_until(case, None, result, &Deadline::default(), stop)
}

pub(super) fn certify_until(
    case: &Case,
    written: Option<&WrittenCase>,
    result: &MemoryRecorder,
    deadline: &Deadline,
    stop: &dyn Watch,
) -> Result<Certificate, Error> {
    let output = match result.samples.is_empty() {
        true => OutputOptions::at_the_ends(case.output.end_time),
        false => compared_output(&case.output),
    };
    let limited = |solver: &SolverOptions| SolverOptions {
        max_wall_time: deadline.limit(solver.max_wall_time),
        ..solver.clone()
    };
    // This run serves only to judge a loss of stability.
    let own = can_lose_stability(case).then(|| run(case, &limited(&case.solver), &output, stop));
    if stop.stopped() {
        return Err(Error::interrupted());
    }
    if let Some(failure) = own.as_ref().and_then(|own| own.rung.failure.clone()) {
        return Err(Error::computation(failure.to_string()));
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
    if stop.stopped() {
        return Err(Error::interrupted());
    }
    let linearised = match linearised {
        Ok(Ok(linearised)) => linearised,
        Ok(Err(failure)) => return Err(Error::computation(failure.to_string())),
        Err(panic) => std::panic::resume_unwind(panic),
    };
    // `series` can be free of the noise that triggers the onset in every other method, so `arkode` counts as well.
    let noise = summary.noise_determined
        || finest_arkode(&ladder).is_some_and(|arkode| Summary::of_run(&case.system, &arkode.report).noise_determined);
    let events = judge(case, &result.events, &ladder, &linearised, noise);
    let witnesses = witnesses(&ladder, case.solver.method);
    // If other runs go on, the result lacks a grazing event.
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

/// ln(largest effect of a kick on the time of the first stick / uncertainty of that time).
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
    // All methods share the zeros of the normal force, so distances between methods do not show their rounding.
    let mut of_zeros: f64 = 0.0;
    let onset = result.iter().position(|event| event.kind == EventKind::Stick);
    let single = |run: &Finished| -> Vec<f64> {
        let pairs = matched(result, run).into_iter().zip(result);
        pairs.map(|(t, event)| (t - event.time).abs()).collect()
    };
    let around = |single: &Vec<f64>| -> Vec<f64> {
        let largest = |(index, own): (usize, &f64)| {
            // Events before the first stick are judged without the later, grown differences.
            let before = onset.filter(|onset| index < *onset).unwrap_or(single.len());
            let neighbours = &single[index.saturating_sub(NEIGHBOURS)..before.min(index + NEIGHBOURS + 1)];
            // Distances without a counterpart do not count for the neighbours.
            let largest = neighbours.iter().copied().fold(0.0, f64::max);
            if own.is_nan() { f64::NAN } else { largest }
        };
        single.iter().enumerate().map(largest).collect()
    };
    let witnesses = witnesses(ladder, case.solver.method);
    let times: Vec<Vec<f64>> = witnesses.iter().map(|run| matched(result, run)).collect();
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
            // Another witness may be near by chance, so `series`, the finest, counts as well.
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
                    // If the others agree, the result is coarse. A difference of half a period means another event.
                    lost = match (alike(index), uncertainty <= 0.5 * period) {
                        (true, true) => None,
                        (true, false) => Some(Verdict::SequenceDiffers),
                        (false, _) => Some(Verdict::NoiseDetermined),
                    };
                }
            }
            // If noise triggers the onset, it also determines the oscillation's crossings of the stability margin.
            // Smooth sliding has no such crossings.
            let of_margin = matches!(event.kind, EventKind::Destabilised | EventKind::Restabilised);
            let grown = linear.and_then(|linear| linear.growth).unwrap_or(0.0);
            if lost.is_none() && noise && of_margin && grown > GROWN_NOISE {
                lost = Some(Verdict::NoiseDetermined);
            }
            // An event outside the event sequence needs a counterpart within half a period in enough witnesses.
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
                // The case sets this time: only the number rounds.
                _ if timed => f64::EPSILON * event.time,
                // No time is known better than its last place.
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
