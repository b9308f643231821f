//! Verdict of a certificate on one event.

use serde::Serialize;

/// Number of independent witnesses that must confirm the result's sequence of events.
pub(super) const LEAST_WITNESSES: usize = 2;

/// Verdict on an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Independent methods agree.
    Converged,
    /// Amplified rounding: no tolerance makes the event converge.
    NoiseDetermined,
    /// Independent methods find another sequence from here on.
    SequenceDiffers,
}

impl Verdict {
    /// Codes and names in result files and reports.
    pub const WORDS: [(i8, &'static str); 3] = [(0, "converged"), (1, "noise-determined"), (2, "sequence-differs")];

    /// Name in result files and reports.
    pub fn name(self) -> &'static str {
        Verdict::WORDS[self as usize].1
    }
}

/// Event of the certified result. In JSON, a number that is not finite is null.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CertifiedEvent {
    /// Time, s.
    pub time: f64,
    /// Kind of the event.
    pub kind: &'static str,
    /// Verdict on the event.
    pub verdict: Verdict,
    /// Bound on the distance from the exact solution, s; infinite unless the event has converged.
    pub uncertainty: f64,
    /// Verdict of the ladder alone; equal to `verdict` without the oracle.
    pub ladder_verdict: Verdict,
    /// Uncertainty by the ladder alone, s; infinite unless the event has converged there.
    pub ladder_uncertainty: f64,
    /// Own time less the oracle's, s; `None` without an exact event.
    pub true_error: Option<f64>,
    /// Exact time with its true digits; `None` without the oracle.
    pub exact: Option<String>,
    /// Limit of double precision, s: rounding of parameters, and of state and clock at earlier events; NaN if unknown.
    pub rounding: f64,
    /// e-folds of a deviation from the loss of stability to just after the event.
    pub growth: Option<f64>,
}

impl CertifiedEvent {
    /// True significant decimal digits of the time; 0 unless the event has converged.
    pub fn digits(&self) -> u32 {
        significant(self.time, self.uncertainty)
    }

    /// Largest number of digits of the time in double precision; `None` if unknown.
    pub fn most_digits(&self) -> Option<u32> {
        (!self.rounding.is_nan()).then(|| significant(self.time, self.rounding))
    }
}

pub(super) fn significant(value: f64, error: f64) -> u32 {
    let digits = (value.abs() / error).log10().floor();
    if digits >= 1.0 { digits.min(17.0) as u32 } else { 0 }
}
