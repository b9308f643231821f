//! The statistics of a run's stick-slip, as the result file holds them.

use super::schema;
use crate::record::Cycle;

/// The table /stick_slip.
///
/// Cycle k (0-based) is stick k and the slip after it; its period is from stick k to stick k+1. The
/// final stick has no duration, so there are one fewer cycles than sticks.
#[derive(Debug, Clone, PartialEq)]
pub struct StickSlipTable {
    /// Empty for a writer that has recorded the cycles as they came.
    pub cycles: Vec<Cycle>,
    /// The attributes, as a file has them: quantities, counts, and further quantities. One that does not exist in a run (the
    /// onset of a run that never sticks) is NaN.
    pub attributes: Vec<Extra>,
}

/// A quantity of /stick_slip.
#[derive(Debug, Clone, PartialEq)]
pub struct Extra {
    /// The attribute's name.
    pub name: String,
    /// UDUNITS, "1" for a pure number.
    pub unit: String,
    /// With its unit.
    pub description: String,
    /// In the unit of the description.
    pub value: f64,
}

impl Extra {
    /// NaN where there is no value.
    pub fn new(name: &str, unit: &str, description: &str, value: Option<f64>) -> Self {
        Extra {
            name: name.to_owned(),
            unit: unit.to_owned(),
            description: description.to_owned(),
            value: value.unwrap_or(f64::NAN),
        }
    }
}

impl Default for StickSlipTable {
    /// No stick and no slip: no rows, counts of 0, every quantity missing.
    fn default() -> Self {
        let quantities = schema::STICK_SLIP_QUANTITIES.iter();
        let quantities = quantities.map(|(name, unit, description)| Extra::new(name, unit, description, None));
        let counts = schema::STICK_SLIP_COUNTS.iter();
        let counts = counts.map(|(name, description)| Extra::new(name, "1", description, Some(0.0)));
        StickSlipTable {
            cycles: Vec::new(),
            attributes: quantities.chain(counts).collect(),
        }
    }
}

impl StickSlipTable {
    /// A quantity or a count; `None` where it is not known.
    pub fn value(&self, name: &str) -> Option<f64> {
        let found = self.attributes.iter().find(|attribute| attribute.name == name);
        found.map(|attribute| attribute.value).filter(|value| !value.is_nan())
    }

    /// Gives a quantity or a count of every table its value, NaN where it has none.
    pub fn set(&mut self, name: &str, value: Option<f64>) {
        for attribute in self.attributes.iter_mut().filter(|attribute| attribute.name == name) {
            attribute.value = value.unwrap_or(f64::NAN);
        }
    }
}
