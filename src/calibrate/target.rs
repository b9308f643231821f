//! Measured numbers: which quantity of a run, what it was read as, and how far it may be off.

use crate::case::Motion;
use crate::case::document::{Node, Value};
use crate::case::quantity::{self, Dimension};
use crate::model::system::System;
use crate::study::{Reader, plain};
use crate::sweep::{QUANTITIES, Quantity, Values, asked_for};

/// A measured number.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// Place among the quantities of a run.
    pub quantity: usize,
    /// Its unit, as UDUNITS.
    pub unit: &'static str,
    /// In the quantity's unit.
    pub value: f64,
    /// The quantity lies within this of `value`; greater than 0.
    pub half_width: f64,
    /// Where not all can hold, the least weight is set aside first; 0 is compared only.
    pub weight: f64,
}

impl Target {
    /// The name of the quantity.
    pub fn name(&self) -> &'static str {
        QUANTITIES[self.quantity].name
    }

    /// Distance of a run's quantity from the measured value in half-widths; the target holds up to 1 either way. NaN
    /// where the run has no such quantity.
    pub fn residual(&self, values: &Values) -> f64 {
        (values[self.quantity] - self.value) / self.half_width
    }
}

/// What became of a target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// One of those that hold together.
    Held = 0,
    /// Can hold by itself, but not together with those that are held.
    Contradicts = 1,
    /// Holds nowhere in the ranges of the parameters.
    OutOfReach = 2,
    /// Compared only, as the study has it.
    Compared = 3,
}

impl Role {
    /// All, in the order of their codes.
    pub const ALL: [Role; 4] = [Role::Held, Role::Contradicts, Role::OutOfReach, Role::Compared];

    /// In a word.
    pub fn name(self) -> &'static str {
        match self {
            Role::Held => "held",
            Role::Contradicts => "contradicts",
            Role::OutOfReach => "out-of-reach",
            Role::Compared => "compared",
        }
    }
}

/// A target beside what the run with the calibrated parameters has.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetResult {
    /// Whether it is fitted, or only compared.
    pub role: Role,
    /// The quantity there, in its unit; NaN if the run has none.
    pub here: f64,
    /// In half-widths; NaN if the run has no such quantity.
    pub residual: f64,
    /// The least residual, either way, that was found anywhere in the ranges, whatever the other targets.
    pub nearest: f64,
    /// Of a target that contradicts: the largest residual that is left if it is held and the held ones are met as well as
    /// may be. NaN for the others.
    pub together: f64,
    /// Of a target that contradicts: held ones, by their places, each of which could be set aside in its place.
    pub instead: Vec<usize>,
}

/// Quantities that tell of the computation, not of what was computed.
const NOT_MEASURED: [&str; 12] = [
    "noise_determined",
    "kicks_never_given",
    "energy_residual",
    "steps",
    "rhs_evaluations",
    "jacobian_evaluations",
    "motion",
    "attractor_agreement",
    "attractor_distance",
    "attractor_since",
    "stick_threshold",
    "end_time",
];

fn is_measured(quantity: &Quantity) -> bool {
    !NOT_MEASURED.contains(&quantity.name)
}

/// Reads one `[[target]]` of runs of a system, if that is known, in this motion.
pub(super) fn read(
    reader: &mut Reader,
    (system, motion): (Option<&System>, Motion),
    node: &Node,
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
            let found = asked_for(&name, system, " to measure", is_measured);
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
    let dimension = dimension(unit);
    // A number, and how far it was rounded if it is a text.
    let mut printed = |given: &Node, name: &str| {
        let number = match (&given.value, plain(&given.value)) {
            (Value::Text(text), _) => quantity::printed(text, dimension).map(|(value, half)| (value, Some(half))),
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
        None => match rounding.or(QUANTITIES[quantity].count.then_some(0.5)) {
            Some(half) => half,
            None => {
                let message = "how far it may be off is missing: write the value in quotes as it was printed, so that its \
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

/// What is measured is a time, a position, a speed or a plain number.
fn dimension(unit: &str) -> Dimension {
    match unit {
        "s" => Dimension::Time,
        "rad" => Dimension::Angle,
        "m" => Dimension::Length,
        "rad s-1" => Dimension::AngularVelocity,
        "m s-1" => Dimension::Velocity,
        _ => Dimension::Number,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_the_last_printed_digit_gives_the_interval() {
        let printed = |text, dimension| quantity::printed(text, dimension).unwrap();
        assert_eq!(printed("6.975 s", Dimension::Time), (6.975, 0.0005));
        assert_eq!(printed("6.9750 s", Dimension::Time), (6.975, 0.00005));
        assert_eq!(printed("0.00019 s", Dimension::Time), (0.00019, 5e-6));
        assert_eq!(printed("190 us", Dimension::Time), (0.00019, 5e-7));
        assert_eq!(printed("1.9e2 us", Dimension::Time), (0.00019, 5e-6));
        assert_eq!(printed("48", Dimension::Number), (48.0, 0.5));
        assert!(quantity::printed("6.975", Dimension::Time).is_err());
        assert!(quantity::printed("48 s", Dimension::Number).is_err());
    }
}
