//! Event times with a number of digits that is known to be true, whatever grows in the case.
//!
//! How far a deviation grows is not known before the events are: without a perturbation it is all of the growth up to the
//! stop, with one it ends at the first stick, wherever that is. So the case is solved twice, with a short and a longer
//! mantissa. Both err by the same mechanism, at the level of their last bits: if they find the same events, each within a
//! small part of the shortest period, their distance is the error of the shorter one, and the error of the longer one is
//! smaller by the bits between them. If they do not, or if what remains is too little, a third, longer one is held against
//! the second, and so on. Where rounding decides about the events, two runs that differ by a machine word or more have
//! them at different places: what has grown from 2^-64 of the other comes e-folds, and with them milliseconds, later.

use super::automaton::run;
use super::courses;
use super::report::OracleReport;
use super::{DIGITS, GUARD_BITS, OracleError, OracleOptions, digits_of, words, words_beyond};
use crate::model::nearest_double;
use crate::model::system::ExactSystem;
use num_rational::BigRational;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// Two runs differ by small numbers if all their events are as near to each other as this share of the shortest period: an
/// event's place in the oscillation is then the same, and its shift linear in the deviation.
const SMALL: f64 = 1e-3;

/// Digits of the shorter run beyond those that growth is expected to take: events then lie within [`SMALL`].
const DIGITS_TO_SPARE: f64 = 5.0;

/// Bits by which the error of the longer run may be larger, in terms of its last one, than that of the shorter: two runs
/// have other steps, and other signs of their roundings.
const BITS_APART: f64 = 5.0;

/// The same for each bit between the two, and for each bit of an error that is below what both runs resolve. The terms of a
/// series cancel by e^(omega h), and its best steps grow with the precision: omega h is about 0.026 for a bit.
const BITS_FOR_A_BIT: f64 = 0.04;

/// Runs that take longer than this are announced in the log as a warning, others as information.
const LONG: Duration = Duration::from_secs(30);

/// An estimate of the time is no reason to give up before so much of it has gone by.
const PATIENCE: Duration = Duration::from_secs(30);

/// What is over before is not worth a word on how long it takes.
const LEAST_WORTH_TELLING: Duration = Duration::from_secs(2);

/// Of a run, before its duration is estimated.
const TRIAL: Duration = Duration::from_millis(200);

/// What is asked of [`solve`].
#[derive(Debug, Clone)]
pub struct OracleRequest {
    /// Significant decimal digits of every event time that have to be true.
    pub digits: u32,
    /// e-folds by which a deviation is expected to grow, at least 0: with a good guess the first two runs do.
    pub growth: f64,
    /// s.
    pub end_time: BigRational,
    /// Events after which a run gives up.
    pub max_events: usize,
    /// All runs together take no longer; one that is estimated to is given up before.
    pub longest: Duration,
    /// As [`OracleOptions::threshold`], rad/s.
    pub threshold: Option<BigRational>,
    /// As [`OracleOptions::stability`].
    pub stability: bool,
}

impl Default for OracleRequest {
    /// 25 digits without a guess of the growth, to t = 0 and within a day, with stability and without a threshold.
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

/// How far [`solve`] is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OracleProgress {
    /// Decimal digits that the present run computes with.
    pub digits: u32,
    /// s, of the motion.
    pub time: f64,
    /// Until when it runs, s of the motion.
    pub end_time: f64,
}

/// The events of a case, and how well they are known.
#[derive(Debug, Clone)]
pub struct OracleSolution {
    /// The run.
    pub report: OracleReport,
    /// Of each event, how far its time can be from the exact one, s.
    pub errors: Vec<f64>,
    /// Digits that all event times have; at least those asked for.
    pub digits: u32,
    /// Decimal digits that the run was computed with.
    pub digits_computed: u32,
    /// Wall time of all runs, s.
    pub seconds: f64,
}

impl OracleSolution {
    /// Significant decimal digits of the time of an event that are true.
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

/// Solves the model with so many digits that those asked for are true of every event time. `control` is asked at every few
/// steps; `Break` ends it with an error.
///
/// # Errors
/// Those of [`super::run`]; that a run takes too long, or that no precision settles the events.
pub fn solve(
    parameters: &ExactSystem,
    request: &OracleRequest,
    control: &mut dyn FnMut(OracleProgress) -> ControlFlow<()>,
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
    let mut attempt = |words: usize| attempt(parameters, request, words, clock.elapsed(), control);
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
            // What ends a run does so with more digits, too.
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
                    log::debug!("the oracle: {digits_computed} digits leave {digits} of the events");
                    (Ok(fine), digits_computed + request.digits - digits)
                }
                None => (Ok(fine), digits_computed + digits_computed / 2),
            },
            (_, fine) => (fine, digits_computed + digits_computed / 2),
        };
        log::info!("the oracle needs more than {digits_computed} digits: a deviation grows by more than expected");
        let beyond = words_beyond(fine_words).ok_or(OracleError::Unsettled {
            digits: digits_computed,
        })?;
        coarse_words = fine_words;
        fine_words = words(next.1).unwrap_or(beyond).max(beyond);
        log::debug!("from {coarse_words} to {fine_words} words");
        coarse = next.0;
    }
}

/// A run with mantissas of that many words, which says beforehand how long it will take. Runs before it have taken `spent`.
fn attempt(
    parameters: &ExactSystem,
    request: &OracleRequest,
    words: usize,
    spent: Duration,
    control: &mut dyn FnMut(OracleProgress) -> ControlFlow<()>,
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
    // The pace changes: slips are slow, the last stick is fast. So it is measured anew, each time over as long as all before.
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
                    "the oracle computes with {digits} digits, which takes about {whole:.0} s"
                );
            }
        }
        control(OracleProgress { digits, time, end_time })
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

/// The errors of `fine`, s, by its distance from `coarse`; `None` where they have not the same events.
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
        // A distance can be small by chance, but not if those before it are not.
        largest = largest.max(distance);
        let same = a.kind == b.kind && a.mode_after == b.mode_after && distance <= SMALL * period;
        same.then(|| largest * smaller + resolved * b.time.to_f64().abs())
    });
    errors.collect()
}
