//! Certificate by the oracle: the events of a result are compared with the exact ones.
//!
//! A ladder bounds an error by distances between methods. The bound is wrong if all methods share an error. It is wide
//! if the result is better than every witness. The distance to the oracle's events is the error itself, up to the
//! oracle's own error.

use super::certificate::{Certificate, CertifiedEvent, LARGEST_SHARE, Verdict};
use super::ladder::time_scale;
use crate::error::Error;
use num_rational::BigRational;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::time::Duration;
use stickslip_case::{Case, ExactCase, WrittenCase};
use stickslip_engine::simulation::{OutputOptions, SolverOptions, is_short};
use stickslip_oracle::{self as oracle, ExactDouble, OracleRequest, OracleSolution};
use stickslip_system::model::system::{ContactLaw, Pressing, System};
use stickslip_system::model::{BreakawayTest, KickTime};
use stickslip_system::quote::bound;
use stickslip_system::record::sequence::{Alignment, SequenceEvent};
use stickslip_system::record::{Event, EventKind};
use stickslip_system::watch::Watch;

pub(crate) const ORACLE_DIGITS: u32 = 25;

/// Longest time for the oracle, if the case has no limit.
pub const LONGEST: Duration = Duration::from_secs(24 * 3600);

/// Solves the case by the oracle, which overrules the certificate of these events. `asked` holds the true digits of
/// each event time and the longest duration; `exact` is the unrounded case. Fails like [`oracle::solve`].
pub fn settle(
    certificate: &mut Certificate,
    case: &Case,
    exact: &ExactCase,
    result: &[Event],
    asked: (u32, Duration),
    watch: &dyn Watch,
) -> Result<OracleSolution, Error> {
    let mut solution = solve(case, exact, certificate, asked, watch)?;
    drop_events_at_the_end(&mut solution, result, case.output.end_time);
    drop_unresolved_separations(&mut solution, result);
    last_word(certificate, case, result, &solution);
    Ok(solution)
}

/// Relative time of the oracle beyond `end_time`: the exact time of a corner at the end can exceed its double.
const BEYOND_THE_END: f64 = 4.0 * f64::EPSILON;

pub(super) fn beyond_the_end(end_time: f64) -> BigRational {
    BigRational::from_float(end_time * (1.0 + BEYOND_THE_END)).unwrap_or_default()
}

/// The time limit is the shorter of `longest` and the run's own.
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

/// Removes exact separations shorter than the spacing of doubles at their time, unless the run has them. Their
/// cause is ringing below rounding where the force touches zero at a corner.
fn drop_unresolved_separations(solution: &mut OracleSolution, own: &[Event]) {
    let events = &mut solution.report.events;
    let mut index = 0;
    while index < events.len() {
        let next = (index + 1..events.len()).find(|next| events[*next].kind.in_event_sequence());
        let pair = next.filter(|next| {
            let kinds = [events[index].kind, events[*next].kind];
            kinds == [EventKind::Separation, EventKind::Contact]
        });
        let time = events[index].time.to_f64();
        let spacing = f64::EPSILON * time;
        let is_own = |event: &Event| event.kind == EventKind::Separation && (event.time - time).abs() <= 2.0 * spacing;
        match pair {
            Some(next) if events[next].time.distance(&events[index].time) <= spacing && !own.iter().any(is_own) => {
                for index in [next, index] {
                    events.remove(index);
                    solution.errors.remove(index);
                }
            }
            _ => index += 1,
        }
    }
}

fn solve(
    case: &Case,
    exact: &ExactCase,
    certificate: &Certificate,
    (digits, longest): (u32, Duration),
    watch: &dyn Watch,
) -> Result<OracleSolution, Error> {
    // A kick ends the growth at the first stick, near the onset that the methods find.
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
    oracle::solve(&exact.system, &request, watch).map_err(|error| match watch.stopped() {
        true => Error::interrupted(),
        false => error.into(),
    })
}

pub(super) struct Partner {
    exact: usize,
    /// Own minus exact time, s.
    distance: f64,
    /// Bound on the distance between the result's event and the exact one, s.
    pub uncertainty: f64,
    error: f64,
}

fn bound_of_sum(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 { a + b } else { (a + b).next_up() }
}

/// Exact counterpart of each event, if near, and the number of exact events of the sequence without counterpart.
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
    // Equal sequences are matched event by event, whatever the distance.
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
    // Events outside the sequence are matched with the nearest of their kind.
    for (index, event) in result.iter().enumerate().filter(|(_, event)| !in_word(event.kind)) {
        let same = (0..exact.len()).filter(|k| exact[*k].kind == event.kind);
        let distance = |k: &usize| (exact[*k].time.to_f64() - event.time).abs();
        partner[index] = same.min_by(|a, b| distance(a).total_cmp(&distance(b)));
    }
    let near = |(partner, event): (Option<usize>, &Event)| {
        let index = partner?;
        let (own, error) = (ExactDouble::from_f64(event.time, 64), solution.errors[index]);
        let partner = Partner {
            exact: index,
            distance: own.minus(&exact[index].time),
            uncertainty: bound_of_sum(own.distance(&exact[index].time), error),
            error,
        };
        // A larger distance means another event.
        (partner.distance.abs() <= LARGEST_SHARE * period).then_some(partner)
    };
    let partners: Vec<Option<Partner>> = partner.into_iter().zip(result).map(near).collect();
    let found = own.iter().filter(|k| partners[**k].is_some()).count();
    (partners, theirs.len() - found)
}

/// Replaces the ladder's judgement. An event with an exact counterpart has converged; its uncertainty is the distance
/// plus the oracle's own error. [`Certificate::contradiction`] states where the ladder was wrong.
pub fn last_word(certificate: &mut Certificate, case: &Case, result: &[Event], solution: &OracleSolution) {
    let (partners, missing) = partners(case, result, solution);
    let ladder = certificate.verdict;
    for (event, partner) in certificate.events.iter_mut().zip(&partners) {
        (event.verdict, event.uncertainty) = match partner {
            Some(partner) => (Verdict::Converged, partner.uncertainty),
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
                "; the first that it lacks is the {} at t = {:.12} s",
                event.kind, event.time
            )
        });
        return Some(format!(
            "the methods agree on a sequence of events that the exact solution contradicts: of {word} events it has {}, and \
             {missing} more{place}",
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
        Some(partner) => format!("is off by {:.3e} s", partner.distance.abs()),
        None => "is missing from the exact solution".to_owned(),
    };
    Some(format!(
        "the exact solution contradicts the methods: {} of {} events are further from the exact ones than the methods' agreement \
         says, worst the {} at t = {:.12} s, which {off} where {} s was the bound",
        wrong.len(),
        certificate.events.len(),
        worst.kind,
        worst.time,
        bound(worst.ladder_uncertainty, 3)
    ))
}

/// Relative tolerance of equal parameters: the texts are exact, and conversions round once.
const SAME: f64 = 1e-14;

/// Event sequence of a case with more digits than a double.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// Method of the computation, in the words of the file.
    pub method: String,
    /// Kinds and times (s), in order.
    pub events: Vec<(EventKind, f64)>,
    parameters: Vec<(String, f64)>,
    path: PathBuf,
}

impl Truth {
    /// Reads a JSON object with `method`, `parameters` (decimal texts by the paper's symbols or the case's keys) and
    /// `events` (each with `kind` and `time`).
    ///
    /// # Errors
    /// The file has another form.
    pub fn read(path: &Path) -> Result<Truth, String> {
        let form = |why: String| {
            let path = path.display();
            format!("{path}: not a file of true events: {why}; data/truth has three that show the form")
        };
        let text = std::fs::read_to_string(path).map_err(|error| {
            let why = match error.kind() {
                std::io::ErrorKind::NotFound => "no such file".to_owned(),
                _ => error.to_string(),
            };
            format!(
                "{}: the true events cannot be read: {why}; check the name, which counts from the folder of the study",
                path.display()
            )
        })?;
        let json: Value = serde_json::from_str(&text).map_err(|error| form(format!("not JSON: {error}")))?;
        let text_of = |of: &Value, key: &str| of.get(key).and_then(Value::as_str).map(str::to_owned);
        let events = json.get("events").and_then(Value::as_array);
        let events = events.ok_or_else(|| form("it has no list \"events\"".to_owned()))?;
        if events.is_empty() {
            return Err(form("its list \"events\" is empty".to_owned()));
        }
        let event = |(index, event): (usize, &Value)| {
            let name = text_of(event, "kind");
            let kinds = EventKind::ALL.into_iter().filter(|kind| kind.in_event_sequence());
            let kind = kinds.into_iter().find(|kind| Some(kind.name()) == name.as_deref());
            let wrong = format!("event {index} has no kind of the event sequence, or no time that is a decimal text");
            kind.zip(event.get("time").and_then(decimal)).ok_or_else(|| form(wrong))
        };
        let events: Vec<(EventKind, f64)> = events.iter().enumerate().map(event).collect::<Result<_, _>>()?;
        if let Some(index) = events.windows(2).position(|pair| pair[1].1 < pair[0].1) {
            return Err(form(format!("event {} comes before event {index}", index + 1)));
        }
        let parameters = json.get("parameters").and_then(Value::as_object);
        let parameters = parameters.ok_or_else(|| form("it has no object \"parameters\"".to_owned()))?;
        let parameter = |(name, value): (&String, &Value)| {
            let value = decimal(value).ok_or_else(|| form(format!("parameter {name} is no decimal text")))?;
            Ok((name.clone(), value))
        };
        Ok(Truth {
            method: text_of(&json, "method").unwrap_or_else(|| "not said".to_owned()),
            events,
            parameters: parameters.iter().map(parameter).collect::<Result<_, String>>()?,
            path: path.to_owned(),
        })
    }

    /// Checks that the events belong to this case. The error names the first parameter that differs or is missing.
    pub(crate) fn check_case(&self, case: &Case) -> Result<(), String> {
        // A run that ends at another time within the final stick has the same events.
        let until = self.events.last().map_or(0.0, |event| event.1);
        let end = if case.output.end_time > until {
            f64::NAN
        } else {
            case.output.end_time
        };
        let by_keys = self.parameters.iter().any(|(name, _)| name.contains('.'));
        let mut numbers = match by_keys {
            true => keyed(case),
            false => symbols(&case.system)
                .map(|(name, value)| (name.to_owned(), value))
                .into(),
        };
        numbers.push(("t_end".to_owned(), end));
        for (name, here) in numbers {
            let there = self.parameters.iter().find(|p| p.0 == name).map_or(f64::NAN, |p| p.1);
            let same = name == "t_end" && here.is_nan()
                || (there - here).abs() <= SAME * there.abs()
                || (there.is_nan() && here.is_nan());
            if !same {
                return Err(format!(
                    "{}: these events are of another case: {name} is {there:?} there and {here:?} in the case of the study; name the \
                     case that they belong to, or other events",
                    self.path.display()
                ));
            }
        }
        Ok(())
    }
}

fn keyed(case: &Case) -> Vec<(String, f64)> {
    let case = WrittenCase::of(case);
    let numbers = case.numbers().iter();
    numbers.map(|number| (number.path.clone(), number.value)).collect()
}

fn decimal(value: &Value) -> Option<f64> {
    let text = value.as_str()?;
    text.parse().ok().filter(|x: &f64| x.is_finite())
}

/// Parameters under the paper's symbols, NaN if missing. A feature without a symbol has a name that no file contains.
fn symbols(case: &System) -> [(&'static str, f64); 20] {
    let one = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let (axial, ramp) = match &case.pressing {
        Pressing::Axial { axial, actuation } => (Some(axial), actuation.as_ramp()),
        Pressing::Force(_) => (None, None),
    };
    let (rotor, stator) = (&case.rotor, &case.stator);
    let alike = |of_rotor: &[f64], of_stator: &[f64]| match (of_rotor, of_stator) {
        ([one], [other]) if one == other => Some(*one),
        _ => None,
    };
    let surfaces = alike(&rotor.inertia[..rotor.inertia.len().min(1)], &stator.inertia);
    let undisturbed = rotor.viscous.iter().chain(&stator.viscous).all(|d| *d == 0.0);
    let disk = match rotor.inertia.as_slice() {
        [_, disk] if undisturbed => Some(*disk),
        _ => None,
    };
    let speed = match case.initial.rotor_speed.as_slice() {
        [one, other] if one == other => Some(*one),
        _ => None,
    };
    let kick = match case.kicks.as_slice() {
        [kick] => Some(kick),
        _ => None,
    };
    let kick_time = kick.map(|kick| match kick.time {
        KickTime::At(time) => time,
        KickTime::Instability => f64::INFINITY,
    });
    let several = (case.kicks.len() > 1).then_some(case.kicks.len() as f64);
    let law = case.law.as_exponential();
    let unsaid = |differs: bool| differs.then_some(1.0);
    let driven = rotor.torque.is_some() || stator.torque.is_some();
    [
        ("k_e", axial.map(|axial| axial.stiffness)),
        ("c_a", axial.map(|axial| axial.damping)),
        ("m", axial.map(|axial| axial.mass)),
        ("F_0", ramp.map(|ramp| ramp.value)),
        ("t_0", ramp.map(|ramp| ramp.rise_time)),
        ("k_t", alike(&rotor.stiffness, &stator.stiffness)),
        ("c_t", alike(&rotor.damping, &stator.damping)),
        ("r", Some(case.radius)),
        ("I", disk),
        ("J", surfaces),
        ("mu_0", Some(case.breakaway)),
        ("mu_s", law.map(|law| law.low_speed)),
        ("mu_d", law.map(|law| law.high_speed)),
        ("alpha", law.map(|law| law.decay)),
        ("omega_0", speed),
        ("kick_time", kick_time),
        ("kick_relative_velocity", kick.map(|kick| kick.relative_velocity)),
        ("number of kicks", several),
        (
            "breakaway test",
            unsaid(case.breakaway_test != BreakawayTest::Transmitted),
        ),
        (
            "a part that the paper's brake has not",
            unsaid(!is_short(case) || driven || case.contact != ContactLaw::StickSlip),
        ),
    ]
    .map(|(name, value)| (name, one(value)))
}
