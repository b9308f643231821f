//! The verdict of a certificate on one event.

use serde::Serialize;

/// Independent witnesses that must see the result's sequence of events.
pub(super) const LEAST_WITNESSES: usize = 2;

/// What can be said of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Independent methods agree on it.
    Converged,
    /// It is amplified rounding: no tolerance makes it converge.
    NoiseDetermined,
    /// Independent methods find another sequence of events from here on.
    SequenceDiffers,
}

impl Verdict {
    /// All of them, in the order of their codes.
    pub const ALL: [Verdict; 3] = [Verdict::Converged, Verdict::NoiseDetermined, Verdict::SequenceDiffers];

    /// The code in result files.
    pub fn code(self) -> i8 {
        self as i8
    }

    /// The name in result files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Converged => "converged",
            Verdict::NoiseDetermined => "noise-determined",
            Verdict::SequenceDiffers => "sequence-differs",
        }
    }
}

/// An event of the certified result. In JSON a number that is not finite is null.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CertifiedEvent {
    /// s.
    pub time: f64,
    /// What happened.
    pub kind: &'static str,
    /// What can be said of it.
    pub verdict: Verdict,
    /// How far from the exact solution of the stated model it can be, s; infinite unless it is converged.
    pub uncertainty: f64,
    /// What the ladder of methods alone says of it; the same as `verdict` unless the oracle has spoken.
    pub ladder_verdict: Verdict,
    /// The uncertainty by the ladder alone, s; infinite unless it is converged there.
    pub ladder_uncertainty: f64,
    /// Its distance from the oracle's event, own less exact, s; `None` without one.
    pub true_error: Option<f64>,
    /// The exact time, with the digits of it that are true; `None` without the oracle.
    pub exact: Option<String>,
    /// What double precision can hold: the rounding of the case's numbers and of the state and the clock at every event
    /// before, amplified since, s; NaN where that is not known.
    pub rounding: f64,
    /// e-folds by which a deviation has grown from the loss of stability to just behind the event.
    pub growth: Option<f64>,
}

impl CertifiedEvent {
    /// Significant decimal digits of the time that are true; 0 unless it is converged.
    pub fn digits(&self) -> u32 {
        significant(self.time, self.uncertainty)
    }

    /// The most digits of the time that double precision can hold, where that is known.
    pub fn most_digits(&self) -> Option<u32> {
        (!self.rounding.is_nan()).then(|| significant(self.time, self.rounding))
    }
}

/// Whole digits of `value` that an error of `error` leaves.
pub(super) fn significant(value: f64, error: f64) -> u32 {
    let digits = (value.abs() / error).log10().floor();
    if digits >= 1.0 { digits.min(17.0) as u32 } else { 0 }
}
