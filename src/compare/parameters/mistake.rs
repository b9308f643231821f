//! A number of the case that is different in a candidate, in data and in words.

use crate::case::quantity::Dimension;
use crate::case::{WrittenCase, key_of};
use serde::Serialize;

/// Where a number was read from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FoundBy {
    /// The equations between the events, fitted to the candidate's own channels.
    Equations,
    /// The torque at which its sticks end.
    Breakaways,
    /// Its event times, met by runs of the case with another number.
    Events,
    /// Its samples, met by runs of the case with another number.
    Samples,
}

/// A number of the case that a candidate seems to have otherwise.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OtherNumber {
    /// Dotted path, such as `torsion.damping`.
    pub path: String,
    /// The letter of the equations, such as "c_t"; the path where there is none.
    pub symbol: String,
    /// SI, in the notation of the case file; "1" of a plain number.
    pub unit: &'static str,
    /// Of the reference's case, in that unit.
    pub reference: f64,
    /// Of the candidate, in that unit.
    pub value: f64,
    /// What `value` may be wrong by: three standard deviations by the scatter of what is left, and the error of quadrature between
    /// samples; in that unit.
    pub error: f64,
}

/// What explains a candidate: one number, or two at once.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OtherParameters {
    /// One number; two if one alone does not explain it and two do.
    pub numbers: Vec<OtherNumber>,
    /// Where they were read from.
    pub found_by: FoundBy,
    /// Part of the squared difference of samples, or else of event times, that the reference's run with the numbers takes away, 0 to 1.
    pub explained: f64,
    /// Paths and values of other numbers that explain it as well, each alone.
    pub or: Vec<OtherNumber>,
    /// The case run again with the numbers; `None` if that could not be.
    pub rerun: Option<Rerun>,
}

/// The events of a candidate against those of the reference's case, and of the case with other numbers. Both are run from where the
/// candidate begins.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Rerun {
    /// Events of the candidate.
    pub events: usize,
    /// Of the case as it is.
    pub before: Agreement,
    /// Of the case with the other numbers.
    pub after: Agreement,
    /// Part of the disagreement that the numbers take away, 0 to 1.
    pub explained: f64,
}

impl Rerun {
    /// Of so many events of a candidate, with how far the two runs agree with them.
    pub(in super::super) fn of(events: usize, before: Agreement, after: Agreement) -> Rerun {
        let left = if before.cost > 0.0 {
            after.cost / before.cost
        } else {
            1.0
        };
        Rerun {
            events,
            before,
            after,
            explained: 1.0 - left,
        }
    }
}

/// How far two event sequences agree.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Agreement {
    /// Events with a partner within a quarter of the natural period.
    pub matched: usize,
    /// Events of either without one.
    pub unmatched: usize,
    /// Root mean square of the errors of the matched, s.
    pub rms: f64,
    /// Largest of them, s.
    pub max: f64,
    /// One for each event without a partner, and up to one for each pair, in proportion to its error.
    pub cost: f64,
}

/// Numbers that F_n follows from.
pub(in super::super) fn of_normal_force(path: &str) -> bool {
    let of = ["axial.", "actuation.", "contact.normal_force"];
    of.iter().any(|table| path.starts_with(table))
}

/// The letter that the description of a key begins with, as in "c_t, torsional contact damping".
fn symbol(path: &str) -> &str {
    match key_of(path).and_then(|key| key.description.split_once(", ")) {
        Some((letter, _)) if letter.len() <= 8 && !letter.contains(' ') => letter,
        _ => path,
    }
}

impl OtherNumber {
    /// Of a case's number, or of a damping that is 0 there.
    pub(in super::super) fn of(numbers: &WrittenCase, path: &str, value: f64, error: f64) -> OtherNumber {
        let number = numbers.number(path);
        // Of what is zero in the case, by its name.
        let has = |part: &str| path.contains(part);
        let absent = numbers.case().motion().dimension(match () {
            () if has("_speed") => Dimension::AngularVelocity,
            () if has("_twist") => Dimension::Angle,
            () if path.ends_with(".torque") || path.ends_with(".torque.mean") => Dimension::Torque,
            () => Dimension::TorsionalDamping,
        });
        let absent = if path.ends_with(".phase") { "rad" } else { absent.unit() };
        OtherNumber {
            path: path.to_owned(),
            symbol: symbol(path).to_owned(),
            unit: number.map_or(absent, |number| number.unit),
            reference: number.map_or(0.0, |number| number.value),
            value,
            error,
        }
    }

    /// The value down to the last digit that its error leaves, and the error with one digit.
    pub fn value_and_error(&self) -> (String, String) {
        // More than nine digits are nobody's.
        let error = self.error.max(1e-9 * self.value.abs());
        let one: f64 = format!("{error:.0e}").parse().unwrap_or(error);
        (digits_like(self.value, error), plain(one, 1e5))
    }

    /// "c_t = 20.35 +- 0.02 N m s/rad, reference 22.606".
    pub fn words(&self) -> String {
        let unit = match self.unit {
            "1" => String::new(),
            unit => format!(" {unit}"),
        };
        let (value, error) = self.value_and_error();
        let reference = digits_like(self.reference, self.error.max(1e-6 * self.reference.abs()));
        format!("{} = {value} +- {error}{unit}, reference {reference}", self.symbol)
    }
}

/// Without an exponent, from 1e-4 up to a limit.
fn plain(number: f64, limit: f64) -> String {
    match number.abs() {
        size if (1e-4..limit).contains(&size) => format!("{number}"),
        _ => format!("{number:e}"),
    }
}

/// Down to the last digit that the error leaves.
fn digits_like(value: f64, error: f64) -> String {
    if value == 0.0 || error.is_nan() || error <= 0.0 {
        return format!("{value}");
    }
    if value.abs() < error {
        return "0".to_owned();
    }
    let digits = (value.abs().log10().floor() - error.log10().floor()).clamp(2.0, 9.0) as usize;
    let rounded: f64 = format!("{value:.digits$e}").parse().unwrap_or(value);
    plain(rounded, 1e7)
}
