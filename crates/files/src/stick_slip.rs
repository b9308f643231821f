//! Statistics of stick-slip in a run.

use super::schema;
use stickslip_system::record::Cycle;

/// The table /stick_slip. Cycle k (from 0) is stick k with the slip after it; its period is the time from stick k to
/// stick k+1. The final stick has no duration, so that there is one cycle less than sticks.
#[derive(Debug, Clone, PartialEq)]
pub struct StickSlipTable {
    /// Cycles; empty if the writer has recorded them already.
    pub cycles: Vec<Cycle>,
    /// Attributes: quantities and counts. A quantity that the run lacks, such as an onset without a stick, is NaN.
    pub attributes: Vec<Extra>,
}

/// A quantity of /stick_slip.
#[derive(Debug, Clone, PartialEq)]
pub struct Extra {
    /// Name of the attribute.
    pub name: String,
    /// UDUNITS unit; "1" for a pure number.
    pub unit: String,
    /// Description with the unit.
    pub description: String,
    /// Value in the unit of the description.
    pub value: f64,
}

impl Extra {
    /// A quantity; `None` is stored as NaN.
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
    /// No stick and no slip: no rows, counts of 0, every quantity NaN.
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
    /// Value of a quantity or a count; `None` if there is none.
    pub fn value(&self, name: &str) -> Option<f64> {
        let found = self.attributes.iter().find(|attribute| attribute.name == name);
        found.map(|attribute| attribute.value).filter(|value| !value.is_nan())
    }

    /// Sets a quantity or a count; `None` is stored as NaN.
    pub fn set(&mut self, name: &str, value: Option<f64>) {
        for attribute in self.attributes.iter_mut().filter(|attribute| attribute.name == name) {
            attribute.value = value.unwrap_or(f64::NAN);
        }
    }
}
