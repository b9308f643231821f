//! Outcome of a point: the quantities of its run, and its events.

use crate::analysis::Summary;
use crate::analysis::quantity::{NOT_PERIODIC, QUANTITIES, STUCK, quantity_index};
use stickslip_system::record::{Event, EventKind};

pub(crate) const NO_COUNT: i64 = -1;

/// Duration of a lasting final stick, relative to the longest earlier one.
const LASTING_STICK: f64 = 2.0;

/// Whether a longer run might determine the motion. A stop: no lasting stick yet. Another motion without a period: the
/// contact still changes in the second half, or the final stick, too short, may belong to a cycle.
pub(super) fn is_open(values: &Values) -> bool {
    let value = |name: &str| quantity_index(name).map_or(f64::NAN, |place| values[place]);
    if !value("natural_period").is_nan() {
        return value("final_stick_time").is_nan();
    }
    match value("motion") {
        // False if no stick has ended.
        STUCK => value("end_time") - value("final_stick_time") < LASTING_STICK * value("longest_stick_duration"),
        motion => motion == NOT_PERIODIC && value("last_event_time") > 0.5 * value("end_time"),
    }
}

/// One value for each of the quantities of a study; NaN where the run has none.
pub type Values = Vec<f64>;

/// Event of a run in a sweep file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EventRow {
    /// Time, s.
    pub time: f64,
    /// Kind of the event.
    pub kind: EventKind,
    /// Code of the mode after the event.
    pub mode_after: i8,
    /// Relative velocity omega_r before the event, rad/s.
    pub relative_velocity: f64,
    /// Internal force T_f / r just before the event, N.
    pub internal_force: f64,
}

impl From<&Event> for EventRow {
    fn from(event: &Event) -> Self {
        EventRow {
            time: event.time,
            kind: event.kind,
            mode_after: event.mode_after.code(),
            relative_velocity: event.before.relative_velocity,
            internal_force: event.internal_force,
        }
    }
}

/// Outcome of a point.
#[derive(Debug, Clone, PartialEq)]
pub struct PointOutcome {
    /// Number of the point in its study.
    pub number: u64,
    /// Summary, or reason of a failure.
    pub result: Result<Values, String>,
    /// Events in order of time; empty unless the study keeps them.
    pub events: Vec<EventRow>,
}

impl PointOutcome {
    /// Value of a quantity by its index; NaN if missing, as in the journal of a version that did not have it.
    pub fn value(&self, index: usize) -> f64 {
        let values = self.result.as_ref().map_or(&[][..], Vec::as_slice);
        values.get(index).copied().unwrap_or(f64::NAN)
    }
}

pub(super) fn values(summary: &Summary) -> Values {
    let values = QUANTITIES.iter().map(|quantity| quantity.value(summary));
    values.map(|value| value.unwrap_or(f64::NAN)).collect()
}
