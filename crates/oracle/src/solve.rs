//! Event times with a proven number of correct digits, whatever grows in the case.
//!
//! The growth of a deviation is unknown before the events are known: without a perturbation it lasts until the stop,
//! with a perturbation until the first stick. Therefore the case is solved twice, with a low and a higher precision.
//! The errors of both runs have the same mechanism, in their last bits. If the runs find the same events, each within
//! a small part of the shortest period, their distance is the error of the shorter run, and the error of the longer
//! run is smaller by the additional bits. Otherwise, or if the error is too large, a third, longer run is compared
//! with the second, and so on. If rounding decides about the events, two runs that differ by a machine word or more
//! place them e-folds, and therefore milliseconds, apart.

use super::automaton::run;
use super::courses;
use super::report::OracleReport;
use super::{DIGITS, GUARD_BITS, OracleError, OracleOptions, digits_of, words, words_beyond};
use num_rational::BigRational;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};
use stickslip_system::model::nearest_double;
use stickslip_system::model::system::ExactSystem;
use stickslip_system::watch::Watch;

/// Two runs agree if all their events are this close, relative to the shortest period. An event is then at the same
/// place in the oscillation, and its shift is linear in the deviation.
const SMALL: f64 = 1e-3;

/// Digits of the shorter run beyond the expected growth, so that events agree within [`SMALL`].
const DIGITS_TO_SPARE: f64 = 5.0;

/// Bits by which the error of the longer run, in units of its last bit, may exceed that of the shorter run: the runs
/// have different steps and signs of rounding.
const BITS_APART: f64 = 5.0;

/// Further such bits for each bit between the two precisions, and for each bit of an error below the resolution of
/// both runs. The terms of a series cancel by e^(omega h), and the best steps grow with the precision: omega h is
/// about 0.026 per bit.
const BITS_FOR_A_BIT: f64 = 0.04;

/// The log announces longer runs by a warning, shorter ones by an information.
const LONG: Duration = Duration::from_secs(30);

/// Wall time before an estimate may end a run.
const PATIENCE: Duration = Duration::from_secs(30);

const LEAST_WORTH_TELLING: Duration = Duration::from_secs(2);

const TRIAL: Duration = Duration::from_millis(200);

/// Requirements for [`solve`].
#[derive(Debug, Clone)]
pub struct OracleRequest {
    /// Correct significant decimal digits that every event time must have.
    pub digits: u32,
    /// Expected growth of a deviation in e-folds, at least 0. With a good guess two runs suffice.
    pub growth: f64,
    /// End time, s.
    pub end_time: BigRational,
    /// Largest number of events.
    pub max_events: usize,
    /// Limit of wall time for all runs together. A run that is estimated to exceed it ends early.
    pub longest: Duration,
    /// See [`OracleOptions::threshold`], rad/s.
    pub threshold: Option<BigRational>,
    /// See [`OracleOptions::stability`].
    pub stability: bool,
}

impl Default for OracleRequest {
    /// 25 digits, no growth, end time 0, a day, with stability, without a threshold.
    fn default() -> Self {
        OracleRequest {
            digits: 25,
            growth: 0.0,
            end_time: BigRational::default(),
            max_events: 10_000,
            longest: Duration::from_secs(24 * 3600),
            threshold: None,
            stability: true,
        }
    }
}

/// The events of a case with their error bounds.
#[derive(Debug, Clone)]
pub struct OracleSolution {
    /// Report of the most precise run.
    pub report: OracleReport,
    /// Error bound of each event time, s.
    pub errors: Vec<f64>,
    /// Correct digits of all event times, at least the requested number.
    pub digits: u32,
    /// Decimal digits of the arithmetic.
    pub digits_computed: u32,
    /// Wall time of all runs, s.
    pub seconds: f64,
}

impl OracleSolution {
    /// Correct significant decimal digits of an event time.
    pub fn digits_of_event(&self, index: usize) -> u32 {
        let time = self.report.events[index].time.to_f64().abs();
        digits_left(time, self.errors[index]).min(self.digits_computed)
    }
}

fn digits_left(time: f64, error: f64) -> u32 {
    if time == 0.0 {
        return *DIGITS.end();
    }
    (time / error).log10().floor().clamp(0.0, f64::from(*DIGITS.end())) as u32
}

/// Solves the model with enough digits for every event time to have the requested ones. `watch` is asked every few
/// steps; a stop ends the solution with an error.
///
/// # Errors
/// See [`super::run`]; also if a run takes too long, or if no precision settles the events.
pub fn solve(
    parameters: &ExactSystem,
    request: &OracleRequest,
    watch: &dyn Watch,
) -> Result<OracleSolution, OracleError> {
    let period = shortest_period(parameters).min(nearest_double(&request.end_time));
    let clock = Instant::now();
    let lost = request.growth.max(0.0) / std::f64::consts::LN_10;
    let too_many = |digits: f64| OracleError::Digits {
        asked: digits.min(f64::from(u32::MAX)) as u32,
    };
    let length = |digits: f64| words(digits.ceil().max(f64::from(*DIGITS.start())) as u32).ok_or(too_many(digits));
    let mut coarse_words = length(lost + DIGITS_TO_SPARE)?;
    let mut fine_words = length(lost + f64::from(request.digits))?;
    if fine_words <= coarse_words {
        fine_words = words_beyond(coarse_words).ok_or(too_many(lost + f64::from(request.digits)))?;
    }
    let attempt = |words: usize| attempt(parameters, request, words, clock.elapsed(), watch);
    let mut coarse = attempt(coarse_words);
    loop {
        if let Err(error) = &coarse
            && !error.may_be_rounding()
        {
            return Err(error.clone());
        }
        let fine = attempt(fine_words);
        let digits_computed = digits_of(fine_words);
        let next = match (&coarse, fine) {
            // If both runs fail, more digits do not help.
            (Err(_), Err(error)) => return Err(error),
            (_, Err(error)) if !error.may_be_rounding() => return Err(error),
            (Ok(coarse), Ok(fine)) => match errors(period, coarse, &fine) {
                Some(errors) => {
                    let times = fine.events.iter().map(|event| event.time.to_f64().abs());
                    let digits = times.zip(&errors).map(|(time, error)| digits_left(time, *error));
                    let digits = digits.fold(digits_computed, u32::min);
                    if digits >= request.digits {
                        return Ok(OracleSolution {
                            report: fine,
                            errors,
                            digits,
                            digits_computed,
                            seconds: clock.elapsed().as_secs_f64(),
                        });
                    }
                    log::debug!("the exact solver: {digits_computed} digits leave {digits} of the events");
                    (Ok(fine), digits_computed + request.digits - digits)
                }
                None => (Ok(fine), digits_computed + digits_computed / 2),
            },
            (_, fine) => (fine, digits_computed + digits_computed / 2),
        };
        log::info!(
            "the exact solver needs more than {digits_computed} digits: a deviation grows by more than expected"
        );
        let beyond = words_beyond(fine_words).ok_or(OracleError::Unsettled {
            digits: digits_computed,
        })?;
        coarse_words = fine_words;
        fine_words = words(next.1).unwrap_or(beyond).max(beyond);
        log::debug!("from {coarse_words} to {fine_words} words");
        coarse = next.0;
    }
}

fn attempt(
    parameters: &ExactSystem,
    request: &OracleRequest,
    words: usize,
    spent: Duration,
    watch: &dyn Watch,
) -> Result<OracleReport, OracleError> {
    let digits = digits_of(words);
    let end_time = nearest_double(&request.end_time);
    let options = OracleOptions {
        digits,
        end_time: request.end_time.clone(),
        sample_times: Vec::new(),
        max_events: request.max_events,
        threshold: request.threshold.clone(),
        stability: request.stability,
    };
    let clock = Instant::now();
    let left = request.longest.saturating_sub(spent).as_secs_f64();
    // The pace changes: slips are slow, the last stick is fast. Therefore it is measured repeatedly, each time over as
    // long as all earlier measurements together.
    let (mut asked, mut next, mut told) = ((0.0, 0.0), TRIAL.as_secs_f64(), false);
    let mut too_long: Option<f64> = None;
    let outcome = run(parameters, &options, &mut |time| {
        let elapsed = clock.elapsed().as_secs_f64();
        if elapsed >= left {
            let whole = if time > 0.0 { elapsed * end_time / time } else { elapsed };
            too_long = Some(whole.max(left));
            return ControlFlow::Break(());
        }
        if elapsed >= next && time > asked.1 {
            let pace = (elapsed - asked.0) / (time - asked.1);
            let whole = (elapsed + (end_time - time) * pace).min(1e12);
            (asked, next) = ((elapsed, time), 2.0 * elapsed);
            if elapsed > PATIENCE.as_secs_f64() && whole > left {
                too_long = Some(whole);
                return ControlFlow::Break(());
            }
            if !told && elapsed > LEAST_WORTH_TELLING.as_secs_f64() {
                told = true;
                let level = if whole > LONG.as_secs_f64() {
                    log::Level::Warn
                } else {
                    log::Level::Info
                };
                log::log!(
                    level,
                    "the exact solver computes with {digits} digits, which takes about {whole:.0} s"
                );
            }
        }
        let what = format_args!("exact solver with {digits} digits: t = {time:.6} s of {end_time} s");
        watch.at(time, end_time, what)
    });
    match too_long {
        Some(whole) => Err(OracleError::TooLong {
            digits,
            seconds: spent.as_secs_f64() + whole,
            longest: request.longest.as_secs_f64(),
        }),
        None => outcome,
    }
}

/// The shortest period of an inertia on its shaft, or of a signal, s; infinite without either.
fn shortest_period(parameters: &ExactSystem) -> f64 {
    let of_shafts = [&parameters.rotor, &parameters.stator].into_iter().flat_map(|train| {
        let pairs = train.stiffness.iter().zip(&train.inertia);
        pairs.map(|(stiffness, inertia)| {
            let squared = nearest_double(inertia) / nearest_double(stiffness);
            std::f64::consts::TAU * squared.sqrt()
        })
    });
    let drives = parameters.drives();
    let of_signals = drives.iter().map(|drive| courses::shortest_period(drive));
    of_shafts
        .chain(of_signals)
        .filter(|period| *period > 0.0)
        .fold(f64::INFINITY, f64::min)
}

/// The errors of `fine`, s, from its distance to `coarse`; `None` if their events differ.
fn errors(period: f64, coarse: &OracleReport, fine: &OracleReport) -> Option<Vec<f64>> {
    if coarse.events.len() != fine.events.len() {
        return None;
    }
    let (short, long) = (coarse.bits as f64, fine.bits as f64);
    let smaller = (BITS_APART - (1.0 - BITS_FOR_A_BIT) * (long - short)).exp2();
    let resolved = (GUARD_BITS - (1.0 - BITS_FOR_A_BIT) * long).exp2();
    let mut largest: f64 = 0.0;
    let pairs = coarse.events.iter().zip(&fine.events);
    let errors = pairs.map(|(a, b)| {
        let distance = a.time.minus(&b.time).abs();
        // A distance can be small by chance, but not if earlier ones are larger.
        largest = largest.max(distance);
        let same = a.kind == b.kind && a.mode_after == b.mode_after && distance <= SMALL * period;
        same.then(|| largest * smaller + resolved * b.time.to_f64().abs())
    });
    errors.collect()
}
