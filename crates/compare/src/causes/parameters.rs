//! Parameters of the case that differ in a candidate, and the agreement of events, in data and in words.

use super::judge::Judged;
use serde::Serialize;
use stickslip_case::quantity::Dimension;
use stickslip_case::{WrittenCase, key_of, train_keys};
use stickslip_system::record::EventKind;
use stickslip_system::record::sequence::{Alignment, SequenceEvent};

/// Pairs of events further apart than this part of the natural period are unrelated.
const RELATED: f64 = 0.25;

/// Evidence for a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FoundBy {
    /// Equations between the events, fitted to the candidate's own channels.
    Equations,
    /// Torque at which its sticks end.
    Breakaways,
    /// Event times, matched by runs of the case with another parameter.
    Events,
    /// Samples, matched by runs of the case with another parameter.
    Samples,
}

/// A parameter of the case that seems to differ in a candidate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OtherNumber {
    /// Dotted path, such as `torsion.damping`.
    pub path: String,
    /// Letter in the equations, such as "c_t", or else the path.
    pub symbol: String,
    /// SI unit, in the notation of the case file; "1" if dimensionless.
    pub unit: &'static str,
    /// Value in the reference's case, in that unit.
    pub reference: f64,
    /// Value in the candidate, in that unit.
    pub value: f64,
    /// Error bound of `value`, in that unit: three standard deviations by the scatter of the residual, and the
    /// quadrature error. NaN if the motion does not depend on the number from `value` on, away from `reference`.
    pub error: f64,
    /// Path as a user writes it: without the index of a list of one.
    #[serde(skip)]
    pub key: String,
}

/// Parameters that explain a candidate: one, or two at once.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OtherParameters {
    /// One parameter; two if none explains it alone.
    pub numbers: Vec<OtherNumber>,
    /// Evidence for the parameters.
    pub found_by: FoundBy,
    /// Part of the squared difference of samples, or else of event times, that the reference's run with the parameters
    /// removes, 0 to 1.
    pub explained: f64,
    /// Other parameters that explain it as well, each alone.
    pub or: Vec<OtherNumber>,
    /// Agreement of the case with the parameters; `None` if it could not be run.
    pub rerun: Option<EventAgreement>,
}

/// Agreement of the candidate's events with the case, and with the case with other parameters. Both runs begin where
/// the candidate begins.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EventAgreement {
    /// Number of the candidate's events.
    pub events: usize,
    /// Agreement with the unchanged case.
    pub before: Agreement,
    /// Agreement with the other parameters.
    pub after: Agreement,
    /// Part of the disagreement that the parameters remove, 0 to 1.
    pub explained: f64,
}

impl EventAgreement {
    pub(crate) fn of(events: usize, judged: &Judged) -> EventAgreement {
        let (before, after) = (judged.before, judged.after);
        let left = if before.cost > 0.0 {
            after.cost / before.cost
        } else {
            1.0
        };
        EventAgreement {
            events,
            before,
            after,
            explained: 1.0 - left,
        }
    }

    /// For example "run with it, the case has all 7 events within 1.0e-9 s; run without it, it misses 2 of them, ...".
    pub(crate) fn words(&self) -> String {
        let outcome = |agreement: &Agreement, events: &str, of: &str| match agreement.unmatched {
            0 if agreement.max == 0.0 => format!("has {events} at the same times"),
            0 => format!("has {events} within {:.1e} s", agreement.max),
            // Both events of an exchanged pair lack a partner.
            many => {
                let missed = many.div_ceil(2);
                format!("misses {missed} of {of}, or has them more than a quarter of the natural period off")
            }
        };
        let events = match self.events {
            1 => "the event".to_owned(),
            all => format!("all {all} events"),
        };
        let (after, before) = (
            outcome(&self.after, &events, &events),
            outcome(&self.before, "them", "them"),
        );
        format!("run with it, the case {after}; run without it, it {before}")
    }
}

/// Agreement of two event sequences.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Agreement {
    /// Events with a partner within a quarter of the natural period.
    pub matched: usize,
    /// Events of both sequences without a partner.
    pub unmatched: usize,
    /// Root mean square error of the matched events, s.
    pub rms: f64,
    /// Largest error of the matched events, s.
    pub max: f64,
    /// Cost: 1 for each event without a partner, and up to 1 for each pair, in proportion to its error.
    pub cost: f64,
}

/// Agreement of the events of a run with a candidate's; `period` is the natural period, s.
pub(crate) fn agreement(run: &[SequenceEvent], word: &[SequenceEvent], period: f64) -> Agreement {
    let alignment = Alignment::of(run, word, period);
    let related = RELATED * period;
    let errors = alignment.matched().map(|(r, c)| (word[c].time - run[r].time).abs());
    let errors: Vec<f64> = errors.filter(|error| *error <= related).collect();
    let unmatched = run.len() + word.len() - 2 * errors.len();
    let squares: f64 = errors.iter().map(|e| e * e).sum();
    Agreement {
        matched: errors.len(),
        unmatched,
        rms: (squares / errors.len().max(1) as f64).sqrt(),
        max: errors.iter().copied().fold(0.0, f64::max),
        cost: unmatched as f64 + errors.iter().map(|e| e / related).sum::<f64>(),
    }
}

/// Landmarks of runs whose events have no partners: the last event, the first one, and the duration of a cycle, s.
pub(crate) fn landmarks(word: &[SequenceEvent]) -> [Option<f64>; 3] {
    let sticks = word.iter().filter(|e| e.kind == EventKind::Stick);
    let sticks: Vec<f64> = sticks.map(|e| e.time).collect();
    // The last sticks before the final one are long.
    let cycle = match &sticks[..sticks.len() - sticks.len() / 4] {
        some @ [first, _, .., last] if some.len() > 2 => Some((last - first) / (some.len() - 1) as f64),
        _ => None,
    };
    [word.last().map(|e| e.time), word.first().map(|e| e.time), cycle]
}

pub(crate) fn of_normal_force(path: &str) -> bool {
    let of = ["axial.", "actuation.", "contact.normal_force"];
    of.iter().any(|table| path.starts_with(table))
}

/// The letter at the beginning of a key's description, as in "c_t, torsional contact damping".
fn symbol(path: &str) -> &str {
    let key = key_of(path).or_else(|| train_keys().find(|key| key.path == path));
    match key.and_then(|key| key.description.split_once(", ")) {
        Some((letter, _)) if letter.len() <= 8 && !letter.contains(' ') => letter,
        _ => path,
    }
}

impl OtherNumber {
    pub(crate) fn of(numbers: &WrittenCase, path: &str, value: f64, error: f64) -> OtherNumber {
        let number = numbers.number(path);
        // The dimension of a parameter that is zero in the case follows from its name.
        let has = |part: &str| path.contains(part);
        let absent = numbers.case().motion().dimension(match () {
            () if has("_speed") => Dimension::AngularVelocity,
            () if has("_twist") => Dimension::Angle,
            () if path.ends_with(".torque") || path.ends_with(".torque.mean") => Dimension::Torque,
            () => Dimension::TorsionalDamping,
        });
        let absent = if path.ends_with(".phase") { "rad" } else { absent.unit() };
        let system = &numbers.case().system;
        let inertias = match () {
            () if has("rotor") => system.rotor.inertia.len(),
            () if has("stator") => system.stator.inertia.len(),
            () => 0,
        };
        let key = path.strip_suffix(".0").filter(|_| inertias == 1).unwrap_or(path);
        OtherNumber {
            key: key.to_owned(),
            path: path.to_owned(),
            symbol: symbol(path).to_owned(),
            unit: number.map_or(absent, |number| number.unit),
            reference: number.map_or(0.0, |number| number.value),
            value,
            error,
        }
    }

    /// The value with the digits that its error justifies, and the error with one digit: "none" if the motion does not
    /// depend on the number from there on.
    pub fn value_and_error(&self) -> (String, String) {
        if self.error.is_nan() {
            return (digits_like(self.value, 1e-7 * self.value.abs()), "none".to_owned());
        }
        let error = self.error.max(1e-9 * self.value.abs());
        let one: f64 = format!("{error:.0e}").parse().unwrap_or(error);
        (digits_like(self.value, error), plain(one, 1e5))
    }

    /// The unit after a blank; empty for a pure number.
    pub(super) fn unit_after_blank(&self) -> String {
        match self.unit {
            "1" => String::new(),
            unit => format!(" {unit}"),
        }
    }

    /// For example "torsion.damping (c_t) = 20.35 +- 0.02 N m s/rad, reference 22.606".
    pub fn words(&self) -> String {
        let unit = self.unit_after_blank();
        let (value, error) = self.value_and_error();
        let reference = digits_like(self.reference, self.error.max(1e-6 * self.reference.abs()));
        let name = match self.symbol == self.path {
            true => self.key.clone(),
            false => format!("{} ({})", self.key, self.symbol),
        };
        if self.error.is_nan() {
            let side = if (self.value - self.reference) * self.value < 0.0 {
                "less"
            } else {
                "more"
            };
            return format!("{name} = {value}{unit} or {side}, all with one motion, reference {reference}");
        }
        format!("{name} = {value} +- {error}{unit}, reference {reference}")
    }
}

/// A number without an exponent from 1e-4 up to a limit.
pub(super) fn plain(number: f64, limit: f64) -> String {
    match number.abs() {
        size if (1e-4..limit).contains(&size) => format!("{number}"),
        _ => format!("{number:e}"),
    }
}

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
