//! Units that a candidate may use by mistake.

use super::states::Tally;
use super::{Channel, Vocabulary};
use std::borrow::Cow;
use stickslip_case::quantity::{self, Dimension};

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

pub(super) fn of_channel(channel: Channel, vocabulary: &Vocabulary, tallies: &[Tally]) -> Option<UnitFault> {
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

pub(super) fn of_time(pairs: &[(f64, f64)]) -> Option<UnitFault> {
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
