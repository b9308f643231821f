//! Statistics of stick-slip in a run.

use stickslip_system::record::Cycle;

/// The table /stick_slip. Cycle k (0-based) is stick k and the slip after it; its period is from stick k to stick k+1.
/// The final stick has no duration, so there are one fewer cycles than sticks.
#[derive(Debug, Clone, PartialEq, Default)]
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
    /// Value in its unit.
    pub value: f64,
    /// Whether it is stored as int64, not as float64.
    pub whole: bool,
}

impl Extra {
    /// A quantity; `None` is stored as NaN.
    pub fn new(name: &str, unit: &str, description: &str, value: Option<f64>) -> Self {
        Extra {
            name: name.to_owned(),
            unit: unit.to_owned(),
            description: description.to_owned(),
            value: value.unwrap_or(f64::NAN),
            whole: false,
        }
    }
}

impl StickSlipTable {
    /// Value of a quantity or a count; `None` if there is none.
    pub fn value(&self, name: &str) -> Option<f64> {
        let found = self.attributes.iter().find(|attribute| attribute.name == name);
        found.map(|attribute| attribute.value).filter(|value| !value.is_nan())
    }
}
