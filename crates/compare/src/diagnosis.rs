//! Causes of a difference, in words; wrong units and differences of the case show without a run.
//!
//! Any other cause is named if the reference's run with it reproduces the candidate ([`super::causes`]). Symptoms propose
//! what to try.

use super::reference::Physics;
use super::states::Tally;
use super::{Channel, Vocabulary};
use serde::Serialize;
use std::borrow::Cow;
use stickslip_case::quantity::{self, Dimension};
use stickslip_case::{Case, Motion};

/// Declares the causes: variant, name, and advice.
macro_rules! causes {
    ($($(#[$doc:meta])* $kind:ident, $name:literal, $advice:literal;)+) => {
        /// What is wrong with a candidate.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
        #[serde(rename_all = "kebab-case")]
        pub enum CauseKind { $($(#[$doc])* $kind,)+ }

        impl CauseKind {
            /// Name of the cause.
            pub fn name(self) -> &'static str {
                match self { $(CauseKind::$kind => $name,)+ }
            }

            pub(super) fn advice(self) -> &'static str {
                match self { $(CauseKind::$kind => $advice,)+ }
            }
        }
    };
}

causes! {
    /// A channel, or the time, is in another unit or of the other sign.
    WrongUnits, "wrong units", "name the unit of the column (--column NAME=COLUMN:UNIT)";
    /// It is a run of another case.
    AnotherCase, "another case", "run both with one case; -v lists the keys that differ";
    /// The reference has a kick, the candidate has none.
    UnperturbedRun, "unperturbed run", "apply the kick of the case, or compare with a reference without one";
    /// The fast mode is not followed: steps or samples are too far apart, or the method damps it.
    UnresolvedMode, "unresolved mode", "take smaller steps, or write more samples";
    /// Short sticks pass between two steps.
    StepTooLarge, "step too large", "take smaller steps, or write more samples";
    /// A stick is declared while the disks still slide.
    VelocityTolerance, "velocity tolerance too wide", "declare a stick at a lower relative velocity";
    /// Breakaway is decided by another torque than the reference's.
    StickTest, "another stick test",
        "test breakaway as the reference does (contact.breakaway_test, friction.breakaway)";
    /// Angles instead of twists: their rounding is a floor under the torques.
    AbsoluteAngles, "absolute angles", "integrate the twists instead of the angles";
    /// A parameter of the case differs.
    AnotherParameter, "another parameter", "correct the value, and compare again";
    /// The kick has another size or another split.
    AnotherKick, "another kick", "apply the kick of the reference";
    /// Friction is smooth at rest, so sticks creep.
    RegularisedLaw, "regularised friction law",
        "let the contact stick, or compare with a reference that has the smooth law";
    /// Events are taken at the ends of steps.
    EventsLate, "events late by a step", "locate events within the step, or take smaller steps";
    /// A single event is late or early.
    EventLate, "one event late", "look at this event in your solver";
    /// A method of low order with the candidate's steps.
    LowOrderMethod, "method of low order", "take smaller steps, or a method of higher order";
    /// The initial state differs.
    AnotherState, "another initial state", "begin in the state of the reference";
    /// All times differ by a constant.
    TimeOffset, "times offset", "repeat with --time-offset auto";
    /// All times differ by a factor.
    ClockRate, "clock rate", "check the unit and the step of the times";
    /// A constant is added to a channel.
    ChannelOffset, "channel offset", "subtract the constant from the column";
    /// Columns are exchanged.
    SwappedColumns, "swapped columns", "assign the columns (--column NAME=COLUMN)";
    /// Each row stands several times, while the time goes on.
    RepeatedRows, "repeated rows", "write every step once";
    /// Channels are moving averages.
    MovingAverage, "moving average", "compare samples that are not filtered";
    /// Channels are low-pass filtered.
    LowPassFilter, "low-pass filter", "compare samples that are not filtered";
    /// Speeds are stored half a step before or after positions.
    HalfStep, "half a step off", "write positions and speeds of the same time";
    /// A breakaway is stepped over.
    MissedBreakaway, "missed breakaway", "look for breakaway within the step, or take smaller steps";
}

/// A cause with its evidence in words.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Diagnosis {
    /// The cause.
    pub cause: CauseKind,
    /// Evidence, with numbers.
    pub evidence: String,
    /// The values that differ, and what the reference's run with them has; empty if the evidence says it as shortly.
    pub brief: String,
    /// Part of the squared difference from the reference, of samples or else of event times, that the reference's run
    /// with this change removes, 0 to 1; `None` if the candidate's own case shows the cause.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub explained: Option<f64>,
}

impl Diagnosis {
    pub(super) fn shown(cause: CauseKind, evidence: String) -> Diagnosis {
        Diagnosis {
            cause,
            evidence,
            brief: String::new(),
            explained: None,
        }
    }

    pub(super) fn tried(cause: CauseKind, evidence: String, explained: f64) -> Diagnosis {
        Diagnosis {
            explained: Some(explained),
            ..Diagnosis::shown(cause, evidence)
        }
    }
}

pub(super) fn percent(share: f64) -> String {
    match 100.0 * share {
        all if all > 99.99 => "over 99.99".to_owned(),
        part => format!("{part:.2}"),
    }
}

pub(super) fn wrong_units(fault: &UnitFault) -> Diagnosis {
    let (name, found) = (&fault.name, &fault.found);
    let evidence = match fault.is_opposite() {
        true => format!("{name} has {found}"),
        false => format!("{name} looks like {found} where {} is meant", fault.expected),
    };
    Diagnosis::tried(CauseKind::WrongUnits, evidence, fault.explained)
}

/// The last digit of an angle of some hundred radians, rad.
pub(super) const LAST_DIGIT: f64 = f64::EPSILON * 256.0;

/// Rounding to the last digit of angles makes this part of the candidate's difference.
pub(super) fn absolute_angles(physics: &Physics, part: f64) -> Diagnosis {
    let stiffness = physics.system().rotor.stiffness.first().copied().unwrap_or(0.0);
    let (floor, percent) = (stiffness * LAST_DIGIT, 100.0 * part);
    let evidence = format!(
        "its rotor twist is a difference of two angles, rounded to their last digit: a floor of about {floor:.0e} N m \
         under its torques, which the instability amplifies; a run of the case with its steps, whose twist is rounded to that digit, \
         differs from one that is not by {percent:.0} % as much as the candidate does from the reference; integrate the twist itself"
    );
    Diagnosis::shown(CauseKind::AbsoluteAngles, evidence)
}

/// The next round numbers above a speed, and one just above it: values in between declare the same sticks.
pub(super) fn round_above(speed: f64) -> impl Iterator<Item = f64> {
    const DIGITS: [f64; 13] = [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 20.0, 30.0];
    let power = 10f64.powf(speed.log10().floor());
    let round = DIGITS.into_iter().map(move |digit| digit * power);
    round
        .filter(move |round| *round >= speed)
        .take(3)
        .chain([1.001 * speed])
}

pub(super) fn limit_of(physics: &Physics) -> &'static str {
    match physics.vocabulary().motion() {
        Motion::Rotation => "mu_0 r F_n",
        Motion::Translation => "mu_0 F_n",
    }
}

/// Adds the differences of a result file's case, which are the best evidence.
pub(super) fn add_case(causes: &mut Vec<Diagnosis>, differences: &[CaseDifference]) {
    if differences.is_empty() {
        return;
    }
    let names: Vec<&str> = differences.iter().take(3).map(|d| d.key.as_str()).collect();
    let more = if differences.len() > 3 { " and more" } else { "" };
    let evidence = format!(
        "it is a run of another case, which differs in {}{more}",
        names.join(", ")
    );
    let all = |test: fn(&CaseDifference) -> bool| differences.iter().all(test);
    // A contact without stick has no breakaway test.
    const SMOOTH: [&str; 4] = [
        "friction.regularisation.",
        "friction.breakaway",
        "friction.threshold",
        "contact.breakaway_test",
    ];
    let smooth = |d: &CaseDifference| SMOOTH.iter().any(|key| d.key.starts_with(key));
    // A regularised reference, alone or together with the candidate, is no fault of the candidate.
    let regularised = |d: &&CaseDifference| d.key.starts_with("friction.regularisation.");
    let of_candidate = differences.iter().any(|d| regularised(&d))
        && differences.iter().filter(regularised).all(|d| d.reference == NOT_SET);
    let cause = if all(smooth) && of_candidate {
        CauseKind::RegularisedLaw
    } else if all(|d| d.key == "contact.breakaway_test") {
        CauseKind::StickTest
    } else if all(|d| d.key.starts_with("perturbation") && d.candidate == NOT_SET) {
        CauseKind::UnperturbedRun
    } else {
        CauseKind::AnotherCase
    };
    causes.retain(|known| known.cause != cause);
    if cause == CauseKind::RegularisedLaw {
        causes.retain(|known| !matches!(known.cause, CauseKind::VelocityTolerance | CauseKind::StickTest));
    }
    let each = differences.iter().take(2);
    let each = each.map(|d| format!("{} = {} instead of {}", d.key, d.candidate, d.reference));
    let more = if differences.len() > 2 { ", and more" } else { "" };
    let brief = format!("{}{more}.", each.collect::<Vec<_>>().join(", "));
    causes.insert(
        0,
        Diagnosis {
            brief,
            ..Diagnosis::shown(cause, evidence)
        },
    );
}

/// A channel, or the time, that differs from the reference by the factor of a unit.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct UnitFault {
    pub name: Cow<'static, str>,
    pub found: String,
    pub expected: &'static str,
    pub explained: f64,
}

const OPPOSITE: &str = "the opposite sign";

impl UnitFault {
    pub fn is_opposite(&self) -> bool {
        self.found == OPPOSITE
    }
}

/// Smallest |correlation| of a channel that differs by a factor alone.
const CORRELATED: f64 = 0.999;
/// Tolerance of a unit's factor. The closest two units of one list differ by more.
const FACTOR_WITHIN: f64 = 0.01;

fn units(dimension: Dimension) -> &'static [&'static str] {
    match dimension {
        Dimension::Time => &["ms", "us", "ns", "min"],
        Dimension::Angle => &["deg", "rev", "mrad", "urad"],
        Dimension::AngularVelocity => &["rpm", "deg/s", "rev/s", "mrad/s", "rad/ms"],
        Dimension::Length => &["mm", "um", "cm", "in", "ft"],
        Dimension::Velocity => &["mm/s", "um/s", "cm/s", "in/s", "ft/s"],
        Dimension::Force => &["lbf", "kN", "kgf", "kip"],
        Dimension::Torque => &["lbf in", "lbf ft", "N mm", "kN m", "kgf m"],
        _ => &[],
    }
}

/// The unit in which numbers are `factor` times as large.
fn unit_of(factor: f64, dimension: Dimension) -> Option<&'static str> {
    units(dimension).iter().copied().find(|unit| {
        let size = quantity::factor(unit, dimension).unwrap_or(f64::NAN);
        (factor * size - 1.0).abs() < FACTOR_WITHIN
    })
}

pub(super) fn unit_of_channel(channel: Channel, vocabulary: &Vocabulary, tallies: &[Tally]) -> Option<UnitFault> {
    let [product, reference, candidate] = tallies.iter().fold([0.0; 3], |sum, tally| {
        std::array::from_fn(|k| sum[k] + tally.products[k])
    });
    if !(reference > 0.0 && candidate > 0.0) || product.abs() < CORRELATED * (reference * candidate).sqrt() {
        return None;
    }
    let factor = product / reference;
    let left = candidate - product * factor;
    let explained = 1.0 - left / (candidate - 2.0 * product + reference);
    let fault = |found: String| UnitFault {
        name: channel.name(),
        found,
        expected: vocabulary.unit(channel),
        explained,
    };
    if (factor + 1.0).abs() < FACTOR_WITHIN {
        return Some(fault(OPPOSITE.to_owned()));
    }
    unit_of(factor, vocabulary.dimension(channel)).map(|unit| fault(unit.to_owned()))
}

pub(super) fn unit_of_time(pairs: &[(f64, f64)]) -> Option<UnitFault> {
    let (first, _) = pairs.split_first()?;
    let unit = unit_of(first.1 / first.0, Dimension::Time)?;
    let same = pairs.iter().all(|(r, c)| unit_of(c / r, Dimension::Time) == Some(unit));
    let size = quantity::factor(unit, Dimension::Time).unwrap_or(f64::NAN);
    let square = |scale: f64| {
        pairs
            .iter()
            .map(|(r, c)| (c * scale - r) * (c * scale - r))
            .sum::<f64>()
    };
    same.then(|| UnitFault {
        name: Cow::Borrowed("time"),
        found: unit.to_owned(),
        expected: "s",
        explained: 1.0 - square(size) / square(1.0),
    })
}

pub(super) const NOT_SET: &str = "not set";

/// A key of the case with its value in both runs, as in /input/resolved; "not set" if a run does not have it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct CaseDifference {
    /// Dotted path.
    pub key: String,
    /// Value in the reference.
    pub reference: String,
    /// Value in the candidate.
    pub candidate: String,
}

/// Physical keys of two cases whose values differ, in the general form if only one is in the short form. Keys of
/// integration and sampling do not count.
pub(super) fn case_differences(reference: &Case, candidate: &Case) -> Vec<CaseDifference> {
    let is_like = reference.words == candidate.words;
    let text = |case: &Case| match is_like {
        true => case.resolved(),
        false => case.in_general_form().resolved(),
    };
    let (r, c) = (keys(&text(reference)), keys(&text(candidate)));
    let value = |keys: &[(String, String)], key: &str| {
        let found = keys.iter().find(|(name, _)| name == key);
        found.map_or_else(|| NOT_SET.to_owned(), |(_, value)| value.clone())
    };
    let mut names: Vec<&String> = r.iter().map(|(name, _)| name).collect();
    let known = names.len();
    for (name, _) in &c {
        if !names[..known].contains(&name) {
            names.push(name);
        }
    }
    let difference = |name: &String| CaseDifference {
        key: name.clone(),
        reference: value(&r, name),
        candidate: value(&c, name),
    };
    let differences = names.into_iter().map(difference);
    differences.filter(|d| d.reference != d.candidate).collect()
}

fn keys(resolved: &str) -> Vec<(String, String)> {
    let Ok(document) = resolved.parse::<toml_edit::DocumentMut>() else {
        return Vec::new();
    };
    let mut keys = Vec::new();
    for (name, item) in document.iter() {
        match item {
            _ if matches!(name, "solver" | "output") => {}
            toml_edit::Item::Table(table) => add(&mut keys, name, table),
            toml_edit::Item::ArrayOfTables(tables) => {
                for (index, table) in tables.iter().enumerate() {
                    add(&mut keys, &format!("{name}.{index}"), table);
                }
            }
            _ => {}
        }
    }
    keys
}

fn add(keys: &mut Vec<(String, String)>, prefix: &str, table: &toml_edit::Table) {
    for (name, item) in table {
        let path = format!("{prefix}.{name}");
        match item {
            toml_edit::Item::Value(value) => keys.push((path, value.clone().decorated("", "").to_string())),
            toml_edit::Item::Table(table) => add(keys, &path, table),
            _ => {}
        }
    }
}
