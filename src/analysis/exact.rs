//! The oracle's last word: a certificate whose events are held against the exact ones.
//!
//! A ladder of methods bounds an error by how far methods are apart; it can be wrong where all of them share an error, and
//! is wide where the result is better than every witness. The oracle's events settle both: the distance to them is the
//! error, up to the oracle's own.

use super::certificate::{Certificate, CertifyError, LARGEST_SHARE, Verdict, certify};
use crate::case::{Case, CaseSource, Override};
use crate::model::ExactParameters;
use crate::model::torsion::TorsionModel;
use crate::model::trains::ExactTrains;
use crate::oracle::{self, Number, OracleProgress, OracleRequest, OracleSolution};
use crate::record::sequence::{Alignment, SequenceEvent};
use crate::record::{Event, EventKind, MemoryRecorder};
use crate::simulation::{OutputOptions, SolverOptions};
use num_rational::BigRational;
use std::ops::ControlFlow;
use std::time::Duration;

/// Digits that the oracle's event times have, unless more are asked for.
pub(crate) const ORACLE_DIGITS: u32 = 25;

/// The oracle takes no longer, unless the runs of the case have a limit.
pub const LONGEST: Duration = Duration::from_secs(24 * 3600);

/// Of two texts of one case the one whose numbers are as they were written: that which was `given`, if it is the case of the
/// run; else `resolved`, where every number has been through a double.
pub fn as_written<'a>(
    case: &Case,
    given: &'a CaseSource,
    resolved: &'a CaseSource,
    overrides: &[Override],
) -> &'a CaseSource {
    match Case::exact_parameters(given, overrides) {
        Ok(exact) if exact.rounded() == case.parameters => given,
        _ => resolved,
    }
}

/// Certifies a result as [`certify`] does, solves the case by the oracle with `digits` true digits of every event time (or
/// `ORACLE_DIGITS`, if that is more), and gives the oracle the last word. `exact` are the case's own parameters without
/// rounding, as by [`Case::exact_parameters`].
///
/// `stop` and `progress` are asked now and then.
///
/// # Errors
/// Those of [`certify`] and of [`oracle::solve`].
pub fn certify_exactly(
    case: &Case,
    exact: &ExactParameters,
    result: &MemoryRecorder,
    digits: u32,
    stop: &(dyn Fn() -> bool + Sync),
    progress: &mut dyn FnMut(OracleProgress),
) -> Result<(Certificate, OracleSolution), CertifyError> {
    let mut certificate = certify(case, result, stop)?;
    let solution = settle(&mut certificate, case, exact, &result.events, digits, stop, progress)?;
    Ok((certificate, solution))
}

/// Solves the case by the oracle as [`certify_exactly`] does, and gives it the last word on the certificate of these events.
///
/// # Errors
/// Those of [`oracle::solve`].
pub fn settle(
    certificate: &mut Certificate,
    case: &Case,
    exact: &ExactParameters,
    result: &[Event],
    digits: u32,
    stop: &dyn Fn() -> bool,
    progress: &mut dyn FnMut(OracleProgress),
) -> Result<OracleSolution, CertifyError> {
    let mut solution = solve(case, exact, certificate, digits, stop, progress)?;
    drop_events_at_the_end(&mut solution, result, case.output.end_time);
    last_word(certificate, case, result, &solution);
    Ok(solution)
}

/// By this share of `end_time` the oracle goes on beyond it: corners of a case can be there, and be later than its double.
const BEYOND_THE_END: f64 = 4.0 * f64::EPSILON;

/// Up to when the oracle is asked whose events are held against those of a run up to `end_time` (s) one by one, by
/// [`drop_events_at_the_end`] afterwards.
pub(super) fn beyond_the_end(end_time: f64) -> BigRational {
    BigRational::from_float(end_time * (1.0 + BEYOND_THE_END)).unwrap_or_default()
}

/// What the oracle is asked beside a run with these settings: its events up to the same end, each with so many true digits. It takes no
/// longer than `longest`, nor than the run itself may.
pub(super) fn request(solver: &SolverOptions, output: &OutputOptions, digits: u32, longest: Duration) -> OracleRequest {
    let limit = |seconds: f64| Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX);
    OracleRequest {
        digits,
        end_time: BigRational::from_float(output.end_time).unwrap_or_default(),
        max_events: solver.max_events,
        longest: solver
            .max_wall_time
            .map_or(longest, |seconds| limit(seconds).min(longest)),
        ..OracleRequest::default()
    }
}

/// Leaves out the exact events at `end_time` (s), to rounding, that a run with the events `own` does not come to.
pub(super) fn drop_events_at_the_end(solution: &mut OracleSolution, own: &[Event], end_time: f64) {
    let events = &mut solution.report.events;
    while let Some(last) = events.last() {
        let kind = last.kind;
        let theirs = events.iter().filter(|event| event.kind == kind).count();
        let at_the_end = last.time.to_f64() >= end_time * (1.0 - BEYOND_THE_END);
        if !at_the_end || theirs <= own.iter().filter(|event| event.kind == kind).count() {
            break;
        }
        events.pop();
        solution.errors.pop();
    }
}

fn solve(
    case: &Case,
    exact: &ExactParameters,
    certificate: &Certificate,
    digits: u32,
    stop: &dyn Fn() -> bool,
    progress: &mut dyn FnMut(OracleProgress),
) -> Result<OracleSolution, CertifyError> {
    // A kick ends the growth at the first stick, which is about where the methods have it.
    let kicked = !case.parameters.perturbations.is_empty();
    let growth = match certificate.growth_to_onset.filter(|_| kicked) {
        Some(growth) => growth,
        None => certificate.growth_exponent.unwrap_or(0.0),
    };
    let request = OracleRequest {
        growth,
        end_time: beyond_the_end(case.output.end_time),
        ..request(&case.solver, &case.output, digits.max(ORACLE_DIGITS), LONGEST)
    };
    let solution = oracle::solve(&ExactTrains::from(exact), &request, &mut |now| {
        progress(now);
        match stop() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    });
    solution.map_err(|error| match stop() {
        true => CertifyError::Interrupted,
        false => CertifyError::Oracle(error),
    })
}

/// Of each event of a result its distance from the oracle's event (s, own less exact) and how well that is known (s); `None`
/// where the oracle has no such event near it. And how many events of the sequence the oracle has beside these.
pub fn distances(case: &Case, result: &[Event], solution: &OracleSolution) -> (Vec<Option<(f64, f64)>>, usize) {
    let period = TorsionModel::new(&case.parameters).natural_period();
    let exact = &solution.report.events;
    let in_word = |kind: EventKind| kind.in_event_sequence();
    let theirs: Vec<usize> = (0..exact.len()).filter(|k| in_word(exact[*k].kind)).collect();
    let own: Vec<usize> = (0..result.len()).filter(|k| in_word(result[*k].kind)).collect();
    let word = |time: f64, kind| SequenceEvent { time, kind };
    let reference: Vec<SequenceEvent> = theirs
        .iter()
        .map(|k| word(exact[*k].time.to_f64(), exact[*k].kind))
        .collect();
    let candidate: Vec<SequenceEvent> = own.iter().map(|k| word(result[*k].time, result[*k].kind)).collect();
    // Equal sequences are matched event by event, however far they are apart.
    let equal = reference.len() == candidate.len() && reference.iter().zip(&candidate).all(|(a, b)| a.kind == b.kind);
    let pairs: Vec<(usize, usize)> = if equal {
        (0..own.len()).map(|k| (k, k)).collect()
    } else {
        Alignment::of(&reference, &candidate, period).matched().collect()
    };
    let mut partner: Vec<Option<usize>> = vec![None; result.len()];
    for (reference, candidate) in pairs {
        let (exact_index, index) = (theirs[reference], own[candidate]);
        if exact[exact_index].kind == result[index].kind {
            partner[index] = Some(exact_index);
        }
    }
    // The others are matched with the nearest of their kind.
    for (index, event) in result.iter().enumerate().filter(|(_, event)| !in_word(event.kind)) {
        let same = (0..exact.len()).filter(|k| exact[*k].kind == event.kind);
        let distance = |k: &usize| (exact[*k].time.to_f64() - event.time).abs();
        partner[index] = same.min_by(|a, b| distance(a).total_cmp(&distance(b)));
    }
    let distances: Vec<Option<(f64, f64)>> = partner
        .iter()
        .zip(result)
        .map(|(partner, event)| {
            let partner = (*partner)?;
            let distance = Number::from_f64(event.time, 64).minus(&exact[partner].time);
            // Further off it is another event.
            (distance.abs() <= LARGEST_SHARE * period).then_some((distance, solution.errors[partner]))
        })
        .collect();
    let found = own.iter().filter(|k| distances[**k].is_some()).count();
    (distances, theirs.len() - found)
}

/// Puts the oracle's events in place of what the ladder says of them. Of each event the uncertainty becomes its distance from
/// the oracle's, plus the oracle's own error, and it is converged where the oracle has it. What the ladder said stays
/// beside it, and where that was wrong, [`Certificate::contradiction`] says so.
pub fn last_word(certificate: &mut Certificate, case: &Case, result: &[Event], solution: &OracleSolution) {
    let (distances, missing) = distances(case, result, solution);
    let ladder = certificate.verdict;
    for (event, distance) in certificate.events.iter_mut().zip(&distances) {
        (event.verdict, event.uncertainty) = match distance {
            Some((distance, error)) => (Verdict::Converged, distance.abs() + error),
            None if event.ladder_verdict == Verdict::Converged => (Verdict::SequenceDiffers, f64::INFINITY),
            None => (event.ladder_verdict, f64::INFINITY),
        };
        event.true_error = distance.map(|(distance, _)| distance);
    }
    let spurious = distances
        .iter()
        .zip(result)
        .filter(|(distance, event)| distance.is_none() && event.kind.in_event_sequence())
        .count();
    certificate.verdict = match (missing + spurious, ladder) {
        (0, _) => Verdict::Converged,
        (_, Verdict::NoiseDetermined) => Verdict::NoiseDetermined,
        _ => Verdict::SequenceDiffers,
    };
    certificate.contradiction = contradiction(certificate, ladder, result, &distances, (missing, spurious));
    certificate.by_oracle = true;
    certificate.bands.retime(&certificate.events);
}

/// What the ladder said that is not so, in one sentence.
fn contradiction(
    certificate: &Certificate,
    ladder: Verdict,
    result: &[Event],
    distances: &[Option<(f64, f64)>],
    (missing, spurious): (usize, usize),
) -> Option<String> {
    let claims = || certificate.events.iter().zip(distances);
    let word = result.iter().filter(|event| event.kind.in_event_sequence()).count();
    if missing + spurious > 0 && ladder == Verdict::Converged {
        let lost = claims().find(|(event, distance)| distance.is_none() && event.ladder_verdict == Verdict::Converged);
        let place = lost.map_or_else(String::new, |(event, _)| {
            format!(
                "; the first that it has not is the {} at t = {:.12} s",
                event.kind, event.time
            )
        });
        return Some(format!(
            "the methods agree on a sequence of events that the oracle contradicts: of {word} events it has {}, and {missing} \
             more{place}",
            word - spurious
        ));
    }
    let claimed = claims().filter(|(event, _)| event.ladder_verdict == Verdict::Converged);
    let over = |(event, distance): &(&super::certificate::CertifiedEvent, &Option<(f64, f64)>)| -> f64 {
        match distance {
            Some((distance, error)) if distance.abs() > event.ladder_uncertainty + error => {
                distance.abs() / event.ladder_uncertainty
            }
            Some(_) => 0.0,
            None => f64::INFINITY,
        }
    };
    let wrong: Vec<_> = claimed.filter(|claim| over(claim) > 0.0).collect();
    let (worst, distance) = wrong.iter().copied().max_by(|a, b| over(a).total_cmp(&over(b)))?;
    let off = match distance {
        Some((distance, _)) => format!("is off by {:.1e} s", distance.abs()),
        None => "is none that the oracle has".to_owned(),
    };
    Some(format!(
        "the oracle contradicts the methods: {} of {} events are further from the exact ones than the methods' agreement says, \
         worst the {} at t = {:.12} s, which {off} where {:.1e} s was the bound",
        wrong.len(),
        certificate.events.len(),
        worst.kind,
        worst.time,
        worst.ladder_uncertainty
    ))
}
