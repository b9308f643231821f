//! The statistics of a run's stick-slip, as the result file holds them.

use super::schema;
use crate::record::Cycle;

/// The table /stick_slip. A quantity that does not exist in a run (the onset of a run that never
/// sticks, the slip after the final stick) is NaN, in the cycles and in the attributes.
///
/// Cycle k (0-based) is stick k and the slip after it; its period is from stick k to stick k+1. The
/// final stick has no duration, so there are `stick_count - 1` cycles.
#[derive(Debug, Clone, PartialEq)]
pub struct StickSlipTable {
    /// Empty for a writer that has recorded the cycles as they came.
    pub cycles: Vec<Cycle>,
    /// Time of the first stick, s.
    pub onset_time: f64,
    /// Time of the last stick, s.
    pub final_stick_time: f64,
    /// Sticks that began.
    pub stick_count: u64,
    /// Slips that began.
    pub slip_count: u64,
    /// s.
    pub first_period: f64,
    /// s.
    pub last_period: f64,
    /// 2 pi sqrt(J/k_t), s.
    pub natural_period: f64,
    /// Integral of the growth rate from the instability to the first stick.
    pub growth_exponent: f64,
    /// Growth from the kick to the first stick, in e-folds.
    pub e_folds_gained: f64,
    /// Largest |energy_residual| of the run, J.
    pub energy_residual_max: f64,
    /// Further quantities, each an attribute of its own.
    pub extras: Vec<Extra>,
}

/// A further quantity of /stick_slip.
#[derive(Debug, Clone, PartialEq)]
pub struct Extra {
    /// The attribute's name; none of the fields of [`StickSlipTable`].
    pub name: String,
    /// UDUNITS, "1" for a pure number.
    pub unit: String,
    /// With its unit.
    pub description: String,
    /// In the unit of the description.
    pub value: f64,
}

impl Default for StickSlipTable {
    /// No stick and no slip: no rows, counts of 0, everything else missing.
    fn default() -> Self {
        StickSlipTable {
            cycles: Vec::new(),
            onset_time: f64::NAN,
            final_stick_time: f64::NAN,
            stick_count: 0,
            slip_count: 0,
            first_period: f64::NAN,
            last_period: f64::NAN,
            natural_period: f64::NAN,
            growth_exponent: f64::NAN,
            e_folds_gained: f64::NAN,
            energy_residual_max: f64::NAN,
            extras: Vec::new(),
        }
    }
}

impl StickSlipTable {
    /// The attributes of /stick_slip, as a file has them: quantities, counts, and the further ones.
    pub fn attributes(&self) -> Vec<Extra> {
        let mut table = self.clone();
        let quantities = schema::STICK_SLIP_QUANTITIES.iter().zip(table.quantities());
        let quantities = quantities.map(|(&(name, unit, description), value)| (name, unit, description, *value));
        let counts = schema::STICK_SLIP_COUNTS
            .iter()
            .zip([self.stick_count, self.slip_count]);
        let counts = counts.map(|(&(name, description), count)| (name, "1", description, count as f64));
        let named = quantities.chain(counts).map(|(name, unit, description, value)| Extra {
            name: name.to_owned(),
            unit: unit.to_owned(),
            description: description.to_owned(),
            value,
        });
        named.chain(self.extras.iter().cloned()).collect()
    }

    /// The named quantities in the order of `schema::STICK_SLIP_QUANTITIES`.
    pub(super) fn quantities(&mut self) -> [&mut f64; 8] {
        [
            &mut self.onset_time,
            &mut self.final_stick_time,
            &mut self.first_period,
            &mut self.last_period,
            &mut self.natural_period,
            &mut self.growth_exponent,
            &mut self.e_folds_gained,
            &mut self.energy_residual_max,
        ]
    }
}
