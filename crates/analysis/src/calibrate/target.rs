//! Measured numbers: quantity of a run, value, and uncertainty.

use crate::study::{StudyReader, plain};
use crate::sweep::{QUANTITIES, Quantity, Values, asked_for};
use serde::Serialize;
use stickslip_case::Motion;
use stickslip_case::document::{CaseValue, PlacedValue};
use stickslip_case::quantity::{self, Dimension};
use stickslip_system::model::system::System;

/// Measured number.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// Index in the quantities of a run.
    pub quantity: usize,
    /// Unit (UDUNITS).
    pub unit: &'static str,
    /// Value in the quantity's unit.
    pub value: f64,
    /// Half-width of the interval around `value`; positive.
    pub half_width: f64,
    /// Weight: if not all targets can hold, the least weight is set aside first; 0 is only compared.
    pub weight: f64,
}

impl Target {
    /// Name of the quantity.
    pub fn name(&self) -> &'static str {
        QUANTITIES[self.quantity].name
    }

    /// Distance from the measured value in half-widths; the target holds from -1 to 1. NaN without the quantity.
    pub fn residual(&self, values: &Values) -> f64 {
        (values[self.quantity] - self.value) / self.half_width
    }
}

/// Role of a target in the result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Holds together with the others.
    Held = 0,
    /// Holds alone, but not together with the held targets.
    Contradicts = 1,
    /// Holds nowhere in the ranges of the parameters.
    OutOfReach = 2,
    /// Only compared, by request of the study.
    Compared = 3,
}

impl Role {
    /// Names in a word, in the order of the codes.
    pub const NAMES: [&str; 4] = ["held", "contradicts", "out-of-reach", "compared"];

    /// Name in a word.
    pub fn name(self) -> &'static str {
        Role::NAMES[self as usize]
    }
}

/// Target with the result of the calibrated run.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetResult {
    /// Role of the target.
    pub role: Role,
    /// Quantity in the calibrated run, in its unit; NaN if missing.
    pub here: f64,
    /// Residual in half-widths; NaN if the quantity is missing.
    pub residual: f64,
    /// Least magnitude of the residual in the ranges, regardless of other targets.
    pub nearest: f64,
    /// For a contradicting target: least possible largest residual together with the held ones. Else NaN.
    pub together: f64,
    /// For a contradicting target: indices of held ones that could be set aside instead.
    pub instead: Vec<usize>,
}

pub(super) fn read(
    reader: &mut StudyReader,
    (system, motion): (Option<&System>, Motion),
    node: &PlacedValue,
    path: &str,
) -> Option<Target> {
    reader.table(node, path, &["quantity", "value", "half_width", "weight"])?;
    let at = |name: &str| format!("{path}.{name}");
    let weight = node.at("weight").map_or(Some(1.0), |given| {
        let expected = "a number that is not negative";
        reader.number(given, &at("weight"), expected, |weight| weight >= 0.0)
    });
    let quantity = match node.at("quantity") {
        Some(given) => {
            let name = reader.text(given, &at("quantity"))?;
            let found = asked_for(&name, system, " to measure", Quantity::is_measured);
            reader.found(given, &at("quantity"), found)
        }
        None => {
            let message = "missing: what was measured, as in quantity = \"onset_time\"";
            reader.refuse(node, &at("quantity"), message)
        }
    };
    let Some(given) = node.at("value") else {
        let message = "missing: the number as it was printed, as in value = \"6.975 s\"";
        return reader.refuse(node, &at("value"), message);
    };
    let quantity = quantity?;
    let unit = QUANTITIES[quantity].unit(motion);
    let dimension = Dimension::of_udunits(unit).unwrap_or(Dimension::Number);
    // Value, and half-width of its rounding if it is a text.
    let mut printed = |given: &PlacedValue, name: &str| {
        let number = match (&given.value, plain(&given.value)) {
            (CaseValue::Text(text), _) => quantity::printed(text, dimension).map(|(value, half)| (value, Some(half))),
            (_, Some(value)) => Ok((value, None)),
            (other, None) => Err(format!(
                "expected {}, but got {}",
                quantity::expectation(dimension),
                other.describe()
            )),
        };
        reader.found(given, &at(name), number)
    };
    let (value, rounding) = printed(given, "value")?;
    let half_width = match node.at("half_width") {
        Some(given) => {
            let (half, _) = printed(given, "half_width")?;
            if half <= 0.0 {
                let message = format!("must be greater than 0, but is {half:?}");
                return reader.refuse(given, &at("half_width"), message);
            }
            half
        }
        // A count is exact.
        None => match rounding.or(QUANTITIES[quantity].is_count().then_some(0.5)) {
            Some(half) => half,
            None => {
                let message = "the half-width is missing: write the value in quotes as it was printed, so that its \
                               last digit says it, or add half_width";
                return reader.refuse(given, &at("value"), message);
            }
        },
    };
    Some(Target {
        quantity,
        unit,
        value,
        half_width,
        weight: weight?,
    })
}
