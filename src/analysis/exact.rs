//! A certificate by the oracle: the events of a result are held against the exact ones.
//!
//! A ladder of methods bounds an error by how far methods are apart; it can be wrong where all of them share an error, and
//! is wide where the result is better than every witness. The oracle's events settle both: the distance to them is the
//! error, up to the oracle's own.

use super::certificate::{Certificate, CertifiedEvent, CertifyError, LARGEST_SHARE, Verdict};
use super::ladder::time_scale;
use crate::case::{Case, ExactCase};
use crate::oracle::{self, Number, OracleProgress, OracleRequest, OracleSolution};
use crate::record::sequence::{Alignment, SequenceEvent};
use crate::record::{Event, EventKind};
use crate::simulation::{OutputOptions, SolverOptions};
use crate::workers::go_on_unless;
use num_rational::BigRational;
use std::time::Duration;

/// Digits that the oracle's event times have, unless more are asked for.
pub(crate) const ORACLE_DIGITS: u32 = 25;

/// The oracle takes no longer, unless the runs of the case have a limit.
pub const LONGEST: Duration = Duration::from_secs(24 * 3600);

/// Solves the case by the oracle, and gives it the last word on the certificate of these events. It is `asked` for so many true
/// digits of every event time, and takes no longer than that. `exact` is the case without rounding.
///
/// # Errors
/// Those of [`oracle::solve`].
pub fn settle(
    certificate: &mut Certificate,
    case: &Case,
    exact: &ExactCase,
    result: &[Event],
    asked: (u32, Duration),
    stop: &dyn Fn() -> bool,
    progress: &mut dyn FnMut(OracleProgress),
) -> Result<OracleSolution, CertifyError> {
    let mut solution = solve(case, exact, certificate, asked, stop, progress)?;
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
    exact: &ExactCase,
    certificate: &Certificate,
    (digits, longest): (u32, Duration),
    stop: &dyn Fn() -> bool,
    progress: &mut dyn FnMut(OracleProgress),
) -> Result<OracleSolution, CertifyError> {
    // A kick ends the growth at the first stick, which is about where the methods have it.
    let kicked = !case.system.kicks.is_empty();
    let growth = match certificate.growth_to_onset.filter(|_| kicked) {
        Some(growth) => growth,
        None => certificate.growth_exponent.unwrap_or(0.0),
    };
    let request = OracleRequest {
        growth,
        threshold: exact.threshold.clone(),
        end_time: beyond_the_end(case.output.end_time),
        ..request(&case.solver, &case.output, digits, longest)
    };
    let solution = oracle::solve(&exact.system, &request, &mut |now| {
        progress(now);
        go_on_unless(stop())
    });
    solution.map_err(|error| match stop() {
        true => CertifyError::Interrupted,
        false => CertifyError::Oracle(error),
    })
}

/// The oracle's event that is one of a result.
pub(super) struct Partner {
    /// Its index.
    exact: usize,
    /// Own less exact, s.
    distance: f64,
    /// How well that is known, s.
    error: f64,
}

impl Partner {
    /// How far from the exact event the result's can be, s.
    pub fn uncertainty(&self) -> f64 {
        self.distance.abs() + self.error
    }
}

/// Of each event of a result the oracle's; `None` where the oracle has no such event near it. And how many events of the
/// sequence the oracle has beside these.
pub(super) fn partners(case: &Case, result: &[Event], solution: &OracleSolution) -> (Vec<Option<Partner>>, usize) {
    let period = time_scale(case);
    let exact = &solution.report.events;
    let in_word = |kind: EventKind| kind.in_event_sequence();
    let theirs: Vec<usize> = (0..exact.len()).filter(|k| in_word(exact[*k].kind)).collect();
    let own: Vec<usize> = (0..result.len()).filter(|k| in_word(result[*k].kind)).collect();
    let word = |time: f64, kind| SequenceEvent { time, kind };
    let reference = theirs.iter().map(|k| word(exact[*k].time.to_f64(), exact[*k].kind));
    let reference: Vec<SequenceEvent> = reference.collect();
    let candidate: Vec<SequenceEvent> = own.iter().map(|k| word(result[*k].time, result[*k].kind)).collect();
    // Equal sequences are matched event by event, however far they are apart.
    let equal = reference.len() == candidate.len() && reference.iter().zip(&candidate).all(|(a, b)| a.kind == b.kind);
    let pairs: Vec<(usize, usize)> = match equal {
        true => (0..own.len()).map(|k| (k, k)).collect(),
        false => Alignment::of(&reference, &candidate, period).matched().collect(),
    };
    let mut partner: Vec<Option<usize>> = vec![None; result.len()];
    for (reference, candidate) in pairs {
        let (exact_index, index) = (theirs[reference], own[candidate]);
        let (truth, own) = (&exact[exact_index], &result[index]);
        if truth.kind == own.kind && truth.mode_after == own.mode_after {
            partner[index] = Some(exact_index);
        }
    }
    // The others are matched with the nearest of their kind.
    for (index, event) in result.iter().enumerate().filter(|(_, event)| !in_word(event.kind)) {
        let same = (0..exact.len()).filter(|k| exact[*k].kind == event.kind);
        let distance = |k: &usize| (exact[*k].time.to_f64() - event.time).abs();
        partner[index] = same.min_by(|a, b| distance(a).total_cmp(&distance(b)));
    }
    let near = |(partner, event): (Option<usize>, &Event)| {
        let index = partner?;
        let partner = Partner {
            exact: index,
            distance: Number::from_f64(event.time, 64).minus(&exact[index].time),
            error: solution.errors[index],
        };
        // Further off it is another event.
        (partner.distance.abs() <= LARGEST_SHARE * period).then_some(partner)
    };
    let partners: Vec<Option<Partner>> = partner.into_iter().zip(result).map(near).collect();
    let found = own.iter().filter(|k| partners[**k].is_some()).count();
    (partners, theirs.len() - found)
}

/// Puts the oracle's events in place of what the ladder says of them. Of each event the uncertainty becomes its distance from
/// the oracle's, plus the oracle's own error, and it is converged where the oracle has it. What the ladder said stays
/// beside it, and where that was wrong, [`Certificate::contradiction`] says so.
pub fn last_word(certificate: &mut Certificate, case: &Case, result: &[Event], solution: &OracleSolution) {
    let (partners, missing) = partners(case, result, solution);
    let ladder = certificate.verdict;
    for (event, partner) in certificate.events.iter_mut().zip(&partners) {
        (event.verdict, event.uncertainty) = match partner {
            Some(partner) => (Verdict::Converged, partner.uncertainty()),
            None if event.ladder_verdict == Verdict::Converged => (Verdict::SequenceDiffers, f64::INFINITY),
            None => (event.ladder_verdict, f64::INFINITY),
        };
        event.true_error = partner.as_ref().map(|partner| partner.distance);
        event.exact = partner.as_ref().map(|partner| {
            let digits = solution.digits_of_event(partner.exact).max(1) as usize;
            solution.report.events[partner.exact].time.to_decimal(digits)
        });
    }
    let is_spurious =
        |(partner, event): &(&Option<Partner>, &Event)| partner.is_none() && event.kind.in_event_sequence();
    let spurious = partners.iter().zip(result).filter(is_spurious).count();
    certificate.verdict = match (missing + spurious, ladder) {
        (0, _) => Verdict::Converged,
        (_, Verdict::NoiseDetermined) => Verdict::NoiseDetermined,
        _ => Verdict::SequenceDiffers,
    };
    certificate.contradiction = contradiction(certificate, ladder, result, &partners, (missing, spurious));
    certificate.by_oracle = true;
    certificate.bands.retime(&certificate.events);
}

/// What the ladder said that is not so, in one sentence.
fn contradiction(
    certificate: &Certificate,
    ladder: Verdict,
    result: &[Event],
    partners: &[Option<Partner>],
    (missing, spurious): (usize, usize),
) -> Option<String> {
    let claims = || certificate.events.iter().zip(partners);
    let word = result.iter().filter(|event| event.kind.in_event_sequence()).count();
    if missing + spurious > 0 && ladder == Verdict::Converged {
        let lost = claims().find(|(event, partner)| partner.is_none() && event.ladder_verdict == Verdict::Converged);
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
    let over = |(event, partner): &(&CertifiedEvent, &Option<Partner>)| -> f64 {
        match partner {
            Some(Partner { distance, error, .. }) if distance.abs() > event.ladder_uncertainty + error => {
                distance.abs() / event.ladder_uncertainty
            }
            Some(_) => 0.0,
            None => f64::INFINITY,
        }
    };
    let wrong: Vec<_> = claimed.filter(|claim| over(claim) > 0.0).collect();
    let (worst, partner) = wrong.iter().copied().max_by(|a, b| over(a).total_cmp(&over(b)))?;
    let off = match partner {
        Some(partner) => format!("is off by {:.1e} s", partner.distance.abs()),
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
