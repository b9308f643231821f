//! Certification of a cycle: Newton's method with the independent oracle, to any number of digits.
//!
//! The oracle solves the motion from a state over a period. The distance to the start corrects state and period
//! through derivatives in double precision. Each correction is smaller than the previous one by the error of these
//! derivatives, about eight digits. This contraction proves the cycle and bounds the distance to it.

use super::family::{Family, first_wave, in_the_long_run, map_drives};
use super::orbit::Orbit;
use super::saved;
use crate::error::Error;
use nalgebra::{DMatrix, DVector};
use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{One, Signed, Zero};
use serde::Serialize;
use std::ops::ControlFlow;
use stickslip_case::ExactCase;
use stickslip_engine::simulation::{Excitation, WantedResults, shoot};
use stickslip_files::schema::{Variable, group};
use stickslip_files::{Addition, DeclaredColumn, columns};
use stickslip_oracle::{
    self as oracle, ExactDouble, OracleError, OracleOptions, OracleReport, OracleState, decimal, elementary,
};
use stickslip_system::model::equations::SystemEquations;
use stickslip_system::model::nearest_double;
use stickslip_system::model::system::{ContactLaw, ExactSystem, Initial};
use stickslip_system::signal::{Drive, Frequency, Wave};
use stickslip_system::watch::Watch;

const SPARE_DIGITS: u32 = 12;

const MOST_CORRECTIONS: usize = 40;

/// Largest ratio of successive corrections for a certificate.
const LEAST_CONTRACTION: f64 = 1e-3;

/// Safety factor on the extrapolated shift of the events by a correction.
const SAFETY: f64 = 10.0;

/// 64-bit words of pi: 693 digits, more than the oracle has.
const WORDS_OF_PI: usize = 36;

/// Number with its error.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Enclosed {
    /// Value, rounded to a double.
    pub value: f64,
    /// Decimal with all true digits.
    pub decimal: String,
    /// Error of the decimal in the unit of the value, rounded up.
    #[serde(rename = "uncertainty")]
    pub error: f64,
}

/// Event of a certified cycle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EnclosedEvent {
    /// Kind.
    pub kind: &'static str,
    /// Time since the start of the file, s.
    pub time: Enclosed,
}

/// A certified cycle.
#[derive(Debug, Clone, Serialize)]
pub struct CycleCertificate {
    /// Decimal digits of the oracle's computation.
    pub digits_computed: u32,
    /// Number of corrections.
    pub corrections: usize,
    /// Ratio of the last two corrections.
    pub contraction: f64,
    /// Period, s; exact for a forced motion.
    pub period: Enclosed,
    /// Events of the exact motion.
    pub events: Vec<EnclosedEvent>,
}

fn rational(value: f64) -> BigRational {
    BigRational::from_float(value).unwrap_or_default()
}

/// Drive with its time origin moved to `time` (s).
fn shifted(drive: &Drive<BigRational>, time: &BigRational, pi: &BigRational) -> Drive<BigRational> {
    match drive {
        Drive::Wave(wave) => {
            let turned = match &wave.frequency {
                Frequency::Cycles(frequency) => frequency * time * pi * BigRational::from_integer(2.into()),
                Frequency::Angular(omega) => omega * time,
                // It has no amplitude: a family refuses others.
                Frequency::Sweep { .. } => return drive.clone(),
            };
            Drive::Wave(Wave {
                phase: &wave.phase + turned,
                ..wave.clone()
            })
        }
        Drive::Sum(terms) => Drive::Sum(terms.iter().map(|term| shifted(term, time, pi)).collect()),
        other => other.clone(),
    }
}

/// Period of the first harmonic of an exact system. Only pi is rounded.
fn exact_turn(system: &ExactSystem, pi: &BigRational) -> Option<BigRational> {
    Some(match &first_wave(system)?.frequency {
        Frequency::Cycles(frequency) | Frequency::Sweep { end: frequency, .. } => frequency.abs().recip(),
        Frequency::Angular(omega) => pi * BigRational::from_integer(2.into()) / omega.abs(),
    })
}

/// Twists and speeds in the order of a case: rotor first, then stator, then bristles.
fn stated(state: &OracleState) -> Vec<BigRational> {
    let lists = [
        &state.rotor_twist,
        &state.rotor_speed,
        &state.stator_twist,
        &state.stator_speed,
    ];
    let all = lists.into_iter().flatten().chain(&state.deflection);
    all.map(|number| number.to_rational().unwrap_or_default()).collect()
}

/// Corrects a cycle by the oracle to a number of true digits of period and events. The file of a driven cycle starts
/// at phase zero of the drives, `periods_before` of their periods before the orbit's time origin. The file of an
/// autonomous cycle starts with the orbit. `watch` learns the digits and corrections of every run.
///
/// # Errors
/// The corrections do not shrink, the oracle finds other events, or a run fails.
pub fn certify(
    family: &Family,
    orbit: &Orbit,
    exact: &ExactCase,
    digits: u32,
    periods_before: u32,
    watch: &dyn Watch,
) -> Result<CycleCertificate, Error> {
    let pi = elementary::pi::<WORDS_OF_PI>();
    let pi = ExactDouble::from(&pi).to_rational().unwrap_or_default();
    let member = family.at(&orbit.values, false)?;
    let (mut system, start) = (in_the_long_run(&exact.system), rational(orbit.time));
    map_drives(&mut system, |drive| shifted(drive, &start, &pi));
    let forced = member.period.is_some();
    let equations = SystemEquations::new(&member.system);
    let outside = Excitation::new(&member.system).at(0, orbit.time);
    let n = orbit.state.len();
    // Components as stated in a case, as a function of the mechanical state: linear except for the drives.
    let of_state = |y: &[f64]| -> Vec<f64> {
        let (initial, deflection) = saved::stated(&equations, &outside, y);
        let (rotor, stator) = (
            [initial.rotor_twist, initial.rotor_speed],
            [initial.stator_twist, initial.stator_speed],
        );
        [rotor.concat(), stator.concat(), deflection.into_iter().collect()].concat()
    };
    let own = of_state(&orbit.state);
    let size = own.len();
    let change = DMatrix::from_fn(size, n, |i, j| {
        let mut y = orbit.state.clone();
        y[j] += 1.0;
        of_state(&y)[i] - own[i]
    });
    let back = change.clone().try_inverse().ok_or_else(neutral)?;
    let wanted = WantedResults {
        derivatives: Some(&[]),
        extrema: false,
        stop: &|| false,
    };
    let state = DVector::from_column_slice(&orbit.state);
    let start = (orbit.time, &state);
    let shot = shoot((&member.system, member.threshold), start, orbit.period, wanted)?;
    // (M - I, f; f 0) in stated components. The plane across the flow uses the components' sizes.
    let matrix = &change * &shot.by_state * &back;
    let (end_flow, flow) = (&change * &shot.end_rates, &change * &shot.start_rates);
    let rows = size + usize::from(!forced);
    let mut jacobian = DMatrix::zeros(rows, rows);
    for i in 0..size {
        for j in 0..size {
            jacobian[(i, j)] = matrix[(i, j)] - f64::from(i == j);
        }
        if !forced {
            jacobian[(i, size)] = end_flow[i];
            jacobian[(size, i)] = flow[i];
        }
    }
    let sizes: Vec<f64> = (0..size)
        .map(|i| {
            let parts = (0..n).map(|j| change[(i, j)].abs() * orbit.sizes[j]);
            match parts.fold(0.0, f64::max) {
                0.0 => 1.0,
                size => size,
            }
        })
        .collect();
    let solver = jacobian.lu();
    let mut period = match (exact_turn(&system, &pi), orbit.multiple) {
        (Some(turn), Some(multiple)) => {
            turn * BigRational::from_integer((family.turns().unwrap_or(1) * u64::from(multiple)).into())
        }
        _ => rational(orbit.period),
    };
    let mut x: Vec<BigRational> = own.iter().map(|value| rational(*value)).collect();
    let computed = digits + SPARE_DIGITS;
    let (mut before, mut ratio): (f64, f64) = (f64::INFINITY, f64::NAN);
    let mut last: Option<OracleReport> = None;
    let expected: Vec<&str> = orbit.events.iter().map(|event| event.kind).collect();
    for corrections in 0..MOST_CORRECTIONS {
        let mut go_on = |_| {
            let what = format_args!("exact solver with {computed} digits, correction {corrections}");
            log::debug!("{what}");
            watch.at(corrections as f64, MOST_CORRECTIONS as f64, what)
        };
        if go_on(0.0).is_break() {
            return Err(Error::interrupted());
        }
        let report = run((&system, &exact.threshold), &x, &period, computed, &mut go_on)?;
        let kinds: Vec<&str> = sequence(&report).map(|event| event.kind.name()).collect();
        if kinds != expected {
            return Err(Error::computation(format!(
                "not certified: the exact solution has other events than the cycle ({}, not {})",
                listed(&kinds),
                listed(&expected)
            )));
        }
        let Some((_, end)) = report.samples.last() else {
            return Err(neutral());
        };
        let end = stated(end);
        // Every step stays in the plane across the flow.
        let mut right = DVector::zeros(rows);
        for i in 0..size {
            right[i] = -nearest_double(&(&end[i] - &x[i]));
        }
        let step = solver.solve(&right).ok_or_else(neutral)?;
        let length = step.iter().zip(sizes.iter().chain([&orbit.period]));
        let length = length.map(|(step, size)| step.abs() / size);
        let length = length.fold(0.0, f64::max);
        let small = length <= 10f64.powi(-(digits as i32) - 1);
        if before.is_finite() && before > 0.0 {
            ratio = length / before;
        }
        let moved = last.as_ref().map(|last| differences(last, &report));
        if small && let Some(moved) = moved {
            let contraction = if ratio.is_nan() { 0.0 } else { ratio };
            if contraction > LEAST_CONTRACTION {
                return Err(no_contraction(corrections, ratio));
            }
            let resolved = 10f64.powi(-(computed as i32) + 2);
            let of_period = if forced { 0.0 } else { step[size].abs() * SAFETY };
            let enclosed = |value: &BigRational, error: f64| {
                let size = nearest_double(value).abs();
                let error = error + resolved * size;
                let true_digits = if size > 0.0 {
                    (size / error).log10().floor().max(1.0)
                } else {
                    1.0
                };
                let decimal = decimal(value, (true_digits as usize).min(computed as usize));
                // The decimal is rounded, too.
                let printed = oracle::rational(&decimal).unwrap_or_default();
                let rounding = nearest_double(&(printed - value)).abs();
                Enclosed {
                    value: nearest_double(value),
                    decimal,
                    error: (error + rounding).next_up(),
                }
            };
            let phase = rational(orbit.time);
            let turn = match (&member.period, orbit.multiple) {
                (Some(_), Some(multiple)) => &period / BigRational::from_integer(multiple.into()),
                _ => BigRational::zero(),
            };
            let events = sequence(&report).zip(&moved).map(|(event, moved)| {
                let mut time = event.time.to_rational().unwrap_or_default();
                if forced {
                    time = time + &phase + &turn * BigRational::from_integer(periods_before.into());
                    time -= (&time / &period).floor() * &period;
                }
                EnclosedEvent {
                    kind: event.kind.name(),
                    time: enclosed(&time, SAFETY * moved * contraction),
                }
            });
            let mut events: Vec<EnclosedEvent> = events.collect();
            events.sort_by(|a, b| a.time.value.total_cmp(&b.time.value));
            return Ok(CycleCertificate {
                period: enclosed(&period, of_period),
                events,
                digits_computed: computed,
                corrections,
                contraction,
            });
        }
        if corrections > 3 && ratio > LEAST_CONTRACTION.sqrt() && length > 10f64.powi(-(digits as i32)) {
            return Err(no_contraction(corrections, ratio));
        }
        before = length;
        for (x, step) in x.iter_mut().zip(step.iter()) {
            *x += rational(*step);
        }
        if !forced {
            period += rational(step[size]);
        }
        // Sums of corrections need not keep every bit.
        let bits = 8 * computed as usize;
        x.iter_mut().for_each(|x| *x = rounded(x, bits));
        period = rounded(&period, bits);
        last = Some(report);
    }
    Err(no_contraction(MOST_CORRECTIONS, ratio))
}

fn no_contraction(corrections: usize, ratio: f64) -> Error {
    Error::computation(format!(
        "not certified: after {corrections} corrections by the exact solver the last one is {ratio:.1e} of the one before, where the \
         derivatives promise 1e-8. The cycle is too near to another sequence of events, or too unstable, for its derivatives in \
         double precision"
    ))
}

fn neutral() -> Error {
    Error::computation("not certified: the cycle is neutral, so that its neighbours are cycles as well")
}

fn listed(kinds: &[&str]) -> String {
    match kinds {
        [] => "none".to_owned(),
        kinds => kinds.join(", "),
    }
}

fn rounded(value: &BigRational, bits: usize) -> BigRational {
    let scale = BigRational::from_integer(BigInt::one() << bits);
    (value * &scale).round() / scale
}

fn sequence(report: &OracleReport) -> impl Iterator<Item = &oracle::OracleEvent> {
    report.events.iter().filter(|event| event.kind.in_event_sequence())
}

fn differences(one: &OracleReport, other: &OracleReport) -> Vec<f64> {
    let pairs = sequence(one).zip(sequence(other));
    pairs.map(|(a, b)| a.time.minus(&b.time).abs()).collect()
}

/// The oracle's motion over a period, from components as stated in a case.
fn run(
    (system, threshold): (&ExactSystem, &Option<BigRational>),
    x: &[BigRational],
    period: &BigRational,
    digits: u32,
    control: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<OracleReport, OracleError> {
    let mut system = system.clone();
    let mut values = x.iter().cloned();
    let mut take = |count: usize| values.by_ref().take(count).collect::<Vec<_>>();
    system.initial = Initial {
        rotor_twist: take(system.rotor.shafts()),
        rotor_speed: take(system.rotor.inertia.len()),
        stator_twist: take(system.stator.shafts()),
        stator_speed: take(system.stator.inertia.len()),
    };
    if let ContactLaw::Bristles(bristles) = &mut system.contact
        && let Some(deflection) = take(1).pop()
    {
        bristles.deflection = deflection;
    }
    let options = OracleOptions {
        digits,
        end_time: period.clone(),
        sample_times: vec![period.clone()],
        stability: false,
        threshold: threshold.clone(),
        ..OracleOptions::default()
    };
    oracle::run(&system, &options, control)
}

const CERTIFICATE: &[DeclaredColumn<CycleCertificate>] = &columns! { of:
    Variable::quantity("period", "s", "period of the exact cycle, rounded to a double"), of.period.value;
    Variable::quantity("period_uncertainty", "s", "how far the decimal of the period can be off"),
        of.period.error;
    Variable::quantity("digits_computed", "1", "decimal digits that the exact solver computed with"),
        of.digits_computed.into();
    Variable::quantity("corrections", "1", "corrections by Newton's method"), of.corrections as f64;
    Variable::quantity("contraction", "1", "the last correction over the one before"), of.contraction;
};

const EVENTS: &[DeclaredColumn<EnclosedEvent>] = &columns! { of:
    Variable::quantity("exact_time", "s", "time of the event, rounded to a double"), of.time.value;
    Variable::quantity("exact_uncertainty", "s", "how far the decimal of the time can be off"), of.time.error;
};

impl CycleCertificate {
    /// Group /cycle_certificate of a file.
    pub fn additions(&self) -> Vec<Addition> {
        let mut group = Addition::new(group::CYCLE_CERTIFICATE);
        group.quantities(CERTIFICATE.iter().map(|one| one.quantity(self)));
        group.attribute("period_decimal", self.period.decimal.as_str());
        group.dimension("exact_event", self.events.len(), "number of the event");
        group.table("exact_event", EVENTS, &self.events);
        let lines = |of: fn(&EnclosedEvent) -> &str| self.events.iter().map(of).collect::<Vec<_>>().join("\n");
        let about = "kinds of the events, one in each line";
        group.text("kinds", about, lines(|event| event.kind));
        let about = "times of the events as decimals, s";
        group.text("decimals", about, lines(|event| &event.time.decimal));
        vec![group]
    }
}
