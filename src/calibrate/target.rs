//! Measured numbers: which quantity of a run, what it was read as, and how far it may be off.

use crate::case::Words;
use crate::case::document::{Node, Value};
use crate::case::quantity::{self, Dimension};
use crate::sweep::{Quantity, Reader, Values, quantities, unknown_quantity};

/// A measured number.
#[derive(Clone, PartialEq)]
pub struct Target {
    /// Place among the quantities of the study.
    pub quantity: usize,
    of: &'static Quantity,
    /// In the quantity's unit.
    pub value: f64,
    /// The quantity lies within this of `value`; greater than 0.
    pub half_width: f64,
    /// Where not all can hold, the least weight is set aside first; 0 is compared only.
    pub weight: f64,
}

/// What decides it: part of what identifies a study.
impl std::fmt::Debug for Target {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("Target")
            .field("quantity", &self.quantity)
            .field("value", &self.value)
            .field("half_width", &self.half_width)
            .field("weight", &self.weight)
            .finish()
    }
}

impl Target {
    /// The name of the quantity.
    pub fn name(&self) -> &'static str {
        self.of.name
    }

    /// Its unit, as UDUNITS.
    pub fn unit(&self) -> &'static str {
        self.of.unit
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

/// Reads one `[[target]]`.
pub(super) fn read(reader: &mut Reader, words: Words, node: &Node, path: &str) -> Option<Target> {
    let Value::Table(_) = &node.value else {
        return reader.expected(node, path, "a table");
    };
    reader.check_keys(node, path, &["quantity", "value", "half_width", "weight"]);
    let at = |name: &str| format!("{path}.{name}");
    let weight = match node.at("weight") {
        Some(given) => reader.number(given, &at("weight"), "a number that is not negative", |weight| {
            weight >= 0.0
        }),
        None => Some(1.0),
    };
    let quantity = match node.at("quantity") {
        Some(given) => {
            let name = reader.text(given, &at("quantity"))?;
            let place = quantities(words).iter().position(|quantity| quantity.name == name);
            let found = place.filter(|&index| is_measured(&quantities(words)[index]));
            if found.is_none() {
                let message = unknown_quantity(words, &name, " to measure", is_measured);
                reader.report(given, &at("quantity"), message);
            }
            found
        }
        None => {
            reader.report(
                node,
                &at("quantity"),
                "missing: what was measured, as in quantity = \"onset_time\"",
            );
            None
        }
    };
    let Some(given) = node.at("value") else {
        reader.report(
            node,
            &at("value"),
            "missing: the number as it was printed, as in value = \"6.975 s\"",
        );
        return None;
    };
    let QuantityUnit { dimension, count } = QuantityUnit::of(&quantities(words)[quantity?]);
    let mut failed = |given: &Node, name: &str, message: String| {
        reader.report(given, &at(name), message);
        None
    };
    let (value, rounding) = match &given.value {
        Value::Text(text) => match quantity::printed(text, dimension) {
            Ok((value, half)) => (value, Some(half)),
            Err(message) => return failed(given, "value", message),
        },
        other => match plain(other) {
            Some(value) => (value, count.then_some(0.5)),
            None => {
                let message = format!(
                    "expected {}, but got {}",
                    quantity::expectation(dimension),
                    other.describe()
                );
                return failed(given, "value", message);
            }
        },
    };
    let half_width = match node.at("half_width") {
        Some(given) => {
            let found = match &given.value {
                Value::Text(text) => quantity::printed(text, dimension).map(|(value, _)| value),
                other => plain(other).ok_or_else(|| {
                    format!(
                        "expected {}, but got {}",
                        quantity::expectation(dimension),
                        other.describe()
                    )
                }),
            };
            match found {
                Ok(half) if half > 0.0 => half,
                Ok(half) => return failed(given, "half_width", format!("must be greater than 0, but is {half:?}")),
                Err(message) => return failed(given, "half_width", message),
            }
        }
        None => match rounding {
            Some(half) => half,
            None => {
                let message = "how far it may be off is missing: write the value in quotes as it was printed, so that its \
                               last digit says it, or add half_width";
                return failed(given, "value", message.to_owned());
            }
        },
    };
    Some(Target {
        quantity: quantity?,
        of: &quantities(words)[quantity?],
        value,
        half_width,
        weight: weight?,
    })
}

fn plain(value: &Value) -> Option<f64> {
    match value {
        Value::Integer(number) => Some(*number as f64),
        Value::Float(number) => Some(*number).filter(|number| number.is_finite()),
        _ => None,
    }
}

struct QuantityUnit {
    dimension: Dimension,
    count: bool,
}

impl QuantityUnit {
    /// What is measured is a time, a position, a speed or a plain number.
    fn of(quantity: &Quantity) -> QuantityUnit {
        QuantityUnit {
            dimension: match quantity.unit {
                "s" => Dimension::Time,
                "rad" => Dimension::Angle,
                "m" => Dimension::Length,
                "rad s-1" => Dimension::AngularVelocity,
                "m s-1" => Dimension::Velocity,
                _ => Dimension::Number,
            },
            count: quantity.count,
        }
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
