//! How far the events of a run of two trains can be from the exact ones.
//!
//! Two witnesses: the oracle, which solves the case with as many digits as it takes, and a ladder of methods that share little
//! with each other. The oracle's word counts; without it, as where it would take too long, the ladder's does. The rows between the
//! events are held against those of the ladder.

use super::bands::{TrainBands, TrainRecord, bands, output};
use super::sensitivity::{Slope, TrainSensitivities, sensitivities};
use super::witness::by_another_method;
use crate::analysis::exact::{drop_events_at_the_end, request as oracle_request};
use crate::analysis::sensitivity::{Affected, columns};
use crate::analysis::verdict::Verdict;
use crate::case::{CaseSource, Override, TrainCase};
use crate::model::trains::ExactTrains;
use crate::oracle::{OracleError, OracleProgress, OracleRequest, OracleSolution, solve};
use crate::record::{Event, EventKind};
use crate::results::CertificateTables;
use crate::results::schema::all_mode_flags;
use crate::run::Run;
use crate::simulation::Method;
use crate::simulation::trains::Excitation;
use num_rational::BigRational;
use serde::Serialize;
use std::ops::ControlFlow;
use std::time::Duration;

/// The methods of the ladder, each with its relative tolerance.
const LADDER: [(Method, f64); 3] = [
    (Method::Series, 1e-10),
    (Method::Auto, 1e-13),
    (Method::CvodeAdams, 1e-13),
];

/// An event can be as far from the exact one as this times the largest distance to the best two methods of the ladder.
const SAFETY: f64 = 4.0;

/// Units of the last place of an event's time that rounding on the way to it may take.
const ROUNDING: f64 = 64.0;

/// An event of the certified run; times in s.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CertifiedTrainEvent {
    /// s.
    pub time: f64,
    /// What happened.
    pub kind: &'static str,
    /// What can be said of it.
    pub verdict: Verdict,
    /// How far from the exact solution it can be, s; `None` unless it is converged.
    pub uncertainty: Option<f64>,
    /// The exact time, as far as it is known; `None` without the oracle.
    pub exact: Option<String>,
    /// Own less exact, s.
    pub true_error: Option<f64>,
    /// The uncertainty by the ladder alone, s; `None` where the methods differ.
    pub ladder_uncertainty: Option<f64>,
}

impl CertifiedTrainEvent {
    /// Significant decimal digits of the time that are true.
    pub fn digits(&self) -> u32 {
        match self.uncertainty {
            Some(uncertainty) if self.time > 0.0 => (self.time / uncertainty).log10().floor().clamp(0.0, 16.0) as u32,
            Some(_) => 16,
            None => 0,
        }
    }
}

/// A run of the ladder.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrainRung {
    /// Which method.
    pub method: &'static str,
    /// Relative tolerance.
    pub rtol: f64,
    /// Events that it finds.
    pub events: usize,
    /// From the first on, those that are the result's.
    pub agreeing: usize,
    /// The largest distance to them, s.
    pub distance: Option<f64>,
    /// Why it failed.
    pub failure: Option<String>,
}

/// What is known of the events of a run.
#[derive(Debug, Clone)]
pub struct TrainCertificate {
    /// One for each event of the run.
    pub events: Vec<CertifiedTrainEvent>,
    /// The methods that were asked.
    pub ladder: Vec<TrainRung>,
    /// The exact events, if the oracle has them.
    pub exact: Option<OracleSolution>,
    /// Why it has not.
    pub without_oracle: Option<String>,
    /// How far the rows of the trajectory can be off, up to the first event that is not converged; empty where no rows were
    /// given.
    pub bands: TrainBands,
    /// What the numbers of the case do to the events, if that was asked; or why that is not known.
    pub sensitivities: Option<Result<TrainSensitivities, String>>,
}

/// What is asked for.
#[derive(Debug, Clone)]
pub struct TrainCertifyRequest {
    /// Significant digits of every exact event time.
    pub digits: u32,
    /// The oracle is given up where it would take longer; or than the case allows a run.
    pub longest: Duration,
}

impl Default for TrainCertifyRequest {
    fn default() -> Self {
        TrainCertifyRequest {
            digits: 18,
            longest: Duration::from_secs(600),
        }
    }
}

/// Holds the events of a run of `case` against the oracle, which takes the numbers and the threshold (rad/s) as `exact` has them,
/// and the ladder.
///
/// # Errors
/// That the control has ended it. An oracle that cannot solve the case is part of the certificate.
pub fn certify(
    case: &TrainCase,
    (exact, threshold): (&ExactTrains, Option<&BigRational>),
    own: &TrainRecord,
    request: &TrainCertifyRequest,
    control: &mut dyn FnMut(OracleProgress) -> ControlFlow<()>,
) -> Result<TrainCertificate, OracleError> {
    let request = OracleRequest {
        threshold: threshold.cloned(),
        ..oracle_request(&case.solver, &case.output, request.digits, request.longest)
    };
    let (solution, without_oracle) = match solve(exact, &request, control) {
        Ok(mut solution) => {
            drop_events_at_the_end(&mut solution, &own.events, case.output.end_time);
            (Some(solution), None)
        }
        Err(error @ OracleError::Interrupted(_)) => return Err(error),
        Err(error) => (None, Some(error.to_string())),
    };
    let mut ladder_distance = vec![Some(0.0f64); own.events.len()];
    let (mut ladder, mut witnesses) = (Vec::new(), Vec::new());
    for (method, rtol) in LADDER {
        let (rung, record) = climb(case, own, method, rtol, &mut ladder_distance);
        // A method makes the same errors twice.
        if method != case.solver.method && rung.failure.is_none() {
            witnesses.push((rung.agreeing, record));
        }
        ladder.push(rung);
    }
    let mut same = true;
    let excitation = Excitation::new(&case.parameters);
    // All methods share the zeros of the normal force: their distances do not show how these are rounded.
    let mut shared: f64 = 0.0;
    let events = own.events.iter().enumerate().map(|(index, event)| {
        if matches!(event.kind, EventKind::Separation | EventKind::Contact) {
            shared = shared.max(excitation.rounding_of_zero(event.time));
        }
        let rounding = ROUNDING * f64::EPSILON * event.time + shared;
        let ladder_uncertainty = ladder_distance[index].map(|distance| SAFETY * distance + rounding);
        let found = solution
            .as_ref()
            .map(|solution| (solution, solution.report.events.get(index)));
        let (uncertainty, exact, true_error) = match found {
            Some((solution, exact)) => {
                let exact = exact.filter(|exact| exact.kind == event.kind && exact.mode_after == event.mode_after);
                same &= exact.is_some();
                match exact.filter(|_| same) {
                    Some(exact) => {
                        let own = crate::oracle::Number::from_f64(event.time, 64);
                        let error = own.minus(&exact.time);
                        let uncertainty = error.abs() + solution.errors[index] + f64::EPSILON * event.time;
                        let digits = solution.digits_of_event(index) as usize;
                        (
                            Some(uncertainty),
                            Some(exact.time.to_decimal(digits.max(1))),
                            Some(error),
                        )
                    }
                    None => (None, None, None),
                }
            }
            None => (ladder_uncertainty, None, None),
        };
        CertifiedTrainEvent {
            time: event.time,
            kind: event.kind.name(),
            verdict: if uncertainty.is_some() {
                Verdict::Converged
            } else {
                Verdict::SequenceDiffers
            },
            uncertainty,
            exact,
            true_error,
            ladder_uncertainty,
        }
    });
    let events: Vec<CertifiedTrainEvent> = events.collect();
    let uncertainties: Vec<Option<f64>> = events.iter().map(|event| event.uncertainty).collect();
    Ok(TrainCertificate {
        bands: bands(case, own, &uncertainties, &witnesses),
        events,
        ladder,
        exact: solution,
        without_oracle,
        sensitivities: None,
    })
}

/// A run by another method, held against the run's own events; takes its distances into those of the ladder.
fn climb(
    case: &TrainCase,
    own: &TrainRecord,
    method: Method,
    rtol: f64,
    distances: &mut [Option<f64>],
) -> (TrainRung, TrainRecord) {
    let (solver, at_the_ends) = by_another_method(case, method, rtol);
    let output = if own.rows.is_empty() { at_the_ends } else { output(case) };
    let mut recorder = TrainRecord::default();
    let result = Run::new(case)
        .solver(&solver)
        .output(&output)
        .record(&mut recorder)
        .start();
    let pairs = own.events.iter().zip(&recorder.events);
    let agrees = |pair: &(&Event, &Event)| pair.0.kind == pair.1.kind && pair.0.mode_after == pair.1.mode_after;
    let agreeing: Vec<f64> = pairs
        .take_while(agrees)
        .map(|(own, other)| (own.time - other.time).abs())
        .collect();
    for (index, distance) in distances.iter_mut().enumerate() {
        *distance = match (*distance, agreeing.get(index)) {
            (Some(largest), Some(here)) => Some(largest.max(*here)),
            _ => None,
        };
    }
    let rung = TrainRung {
        method: method.name(),
        rtol,
        events: recorder.events.len(),
        agreeing: agreeing.len(),
        distance: agreeing.iter().copied().reduce(f64::max),
        failure: result.err().map(|failure| failure.to_string()),
    };
    (rung, recorder)
}

impl TrainCertificate {
    /// Finds out, too, what the numbers of the case, as they are written in `source` with `overrides`, do to the events that are
    /// converged, and what half a unit of the last digit of each does to what the run comes to; `given` as for
    /// [`sensitivities`]. `stop` is asked now and then.
    pub fn add_sensitivities(
        &mut self,
        (source, overrides): (&CaseSource, &[Override]),
        given: Option<&CaseSource>,
        own: &TrainRecord,
        stop: &(dyn Fn() -> bool + Sync),
    ) {
        let converged = self
            .events
            .iter()
            .take_while(|event| event.uncertainty.is_some())
            .count();
        self.sensitivities = Some(sensitivities(source, overrides, given, &own.events[..converged], stop));
    }

    /// What the numbers of the case do, where it is known.
    pub fn known_sensitivities(&self) -> Option<&TrainSensitivities> {
        self.sensitivities.as_ref()?.as_ref().ok()
    }

    /// The fewest digits of any event's time; `None` without events.
    pub fn least_digits(&self) -> Option<u32> {
        self.events.iter().map(CertifiedTrainEvent::digits).min()
    }

    /// Whether every event is converged, and there is none that the run misses.
    pub fn converged(&self) -> bool {
        let as_many = self
            .exact
            .as_ref()
            .is_none_or(|exact| exact.report.events.len() == self.events.len());
        as_many && self.events.iter().all(|event| event.verdict == Verdict::Converged)
    }

    /// The exact event times as lines of CSV.
    fn csv(exact: &OracleSolution) -> String {
        let mut lines = vec!["time,kind,mode_after".to_owned()];
        for (index, event) in exact.report.events.iter().enumerate() {
            let digits = exact.digits_of_event(index).max(1) as usize;
            lines.push(format!(
                "{},{},{}",
                event.time.to_decimal(digits),
                event.kind.name(),
                event.mode_after.name()
            ));
        }
        lines.join("\n") + "\n"
    }

    /// What a result file is given of it.
    pub fn tables(&self) -> CertificateTables {
        let numbers = |of: fn(&CertifiedTrainEvent) -> Option<f64>| -> Vec<f64> {
            self.events.iter().map(|event| of(event).unwrap_or(f64::NAN)).collect()
        };
        let ladder_verdict = |event: &CertifiedTrainEvent| match event.ladder_uncertainty {
            Some(_) => Verdict::Converged.code(),
            None => Verdict::SequenceDiffers.code(),
        };
        let verdict = if self.converged() {
            Verdict::Converged
        } else {
            Verdict::SequenceDiffers
        };
        let known = self.known_sensitivities();
        let parameters = known.map_or(&[][..], |known| &known.parameters);
        // Nothing is known of an event that is not converged.
        let matrix = |of: fn(&Slope) -> f64| -> Vec<Vec<f64>> {
            let row = |index: usize| match known.and_then(|known| known.events.get(index)) {
                Some(row) => row.iter().map(of).collect(),
                None => vec![f64::NAN; parameters.len()],
            };
            (0..self.events.len()).map(row).collect()
        };
        let result = known.and_then(|known| known.result.as_ref());
        let of = result.map_or(Affected::LastEvent, |result| result.of);
        let mut sensitivities = columns(result, of, parameters.len());
        sensitivities.texts.push(("of", of.name().to_owned()));
        if let Some(Err(why)) = &self.sensitivities {
            sensitivities.texts.push(("without_sensitivities", why.clone()));
        }
        CertificateTables {
            time_uncertainty: numbers(|event| event.uncertainty),
            verdict: self.events.iter().map(|event| event.verdict.code()).collect(),
            ladder_uncertainty: numbers(|event| event.ladder_uncertainty),
            ladder_verdict: self.events.iter().map(ladder_verdict).collect(),
            true_error: self.exact.as_ref().map(|_| numbers(|event| event.true_error)),
            verdicts: Verdict::ALL.map(|v| (v.code(), v.name())).to_vec(),
            // Not known apart from the rest.
            rounding: vec![f64::NAN; self.events.len()],
            growth: vec![f64::NAN; self.events.len()],
            ladder: self
                .ladder
                .iter()
                .map(|rung| {
                    let distance = rung.distance.unwrap_or(f64::NAN);
                    (rung.method.to_owned(), rung.rtol, rung.agreeing as i64, distance)
                })
                .collect(),
            texts: vec![
                ("verdict_of_all", verdict.name().to_owned()),
                (
                    "uncertainty_by",
                    if self.exact.is_some() { "oracle" } else { "ladder" }.to_owned(),
                ),
            ],
            numbers: vec![("digits", self.least_digits().map_or(f64::NAN, f64::from))],
            oracle: self.exact.as_ref().map(TrainCertificate::csv).unwrap_or_default(),
            stretches: self
                .bands
                .stretches
                .iter()
                .map(|s| (s.start, s.end, s.mode.code(), s.time_uncertainty))
                .collect(),
            modes: all_mode_flags(),
            bands: self.bands.columns(),
            parameters: parameters.iter().map(|p| (p.path.clone(), p.unit.to_owned())).collect(),
            sensitivities,
            sensitivity: matrix(|slope| slope.value),
            sensitivity_uncertainty: Some(matrix(|slope| slope.uncertainty)),
        }
    }
}
