//! What is kept of every run: the one list of summary quantities, and the outcome of a point.

use crate::analysis::Summary;
use crate::record::{Event, EventKind};
use crate::simulation::RunReport;

/// One quantity of the summary of a run.
pub struct Quantity {
    /// The name of its variable.
    pub name: &'static str,
    /// UDUNITS.
    pub unit: &'static str,
    /// In words, with the paper's symbol.
    pub description: &'static str,
    /// Whether it is a whole number, stored as int64 with `NO_COUNT` for nothing; else float64 with NaN.
    pub count: bool,
    get: fn(&Summary) -> Option<f64>,
}

/// Stands for a count of a run that failed.
pub(crate) const NO_COUNT: i64 = -1;

const fn number(
    name: &'static str,
    unit: &'static str,
    description: &'static str,
    get: fn(&Summary) -> Option<f64>,
) -> Quantity {
    Quantity {
        name,
        unit,
        description,
        count: false,
        get,
    }
}

const fn count(name: &'static str, description: &'static str, get: fn(&Summary) -> Option<f64>) -> Quantity {
    Quantity {
        name,
        unit: "1",
        description,
        count: true,
        get,
    }
}

/// Every quantity, in the order of the variables in a sweep file.
pub const QUANTITIES: [Quantity; 24] = [
    count("stick_count", "number of sticks", |s| Some(s.sticks as f64)),
    count("slip_count", "number of breakaways from stick", |s| {
        Some(s.slips as f64)
    }),
    number("onset_time", "s", "time of the first stick", |s| s.onset_time),
    number("final_stick_time", "s", "time of the stick that lasts", |s| {
        s.final_stick_time
    }),
    number("first_stick_duration", "s", "duration of the first stick", |s| {
        s.first_stick_duration
    }),
    number(
        "last_stick_duration",
        "s",
        "duration of the last stick that ends",
        |s| s.last_stick_duration,
    ),
    number("shortest_stick_duration", "s", "shortest stick that ends", |s| {
        s.stick_duration_range.map(|r| r.0)
    }),
    number("longest_stick_duration", "s", "longest stick that ends", |s| {
        s.stick_duration_range.map(|r| r.1)
    }),
    number(
        "first_slip_duration",
        "s",
        "duration of the slip after the first stick",
        |s| s.first_slip_duration,
    ),
    number(
        "last_slip_duration",
        "s",
        "duration of the last slip between sticks",
        |s| s.last_slip_duration,
    ),
    number("shortest_slip_duration", "s", "shortest slip between sticks", |s| {
        s.slip_duration_range.map(|r| r.0)
    }),
    number("longest_slip_duration", "s", "longest slip between sticks", |s| {
        s.slip_duration_range.map(|r| r.1)
    }),
    number("first_period", "s", "T_i, from the first stick to the second", |s| {
        s.first_period
    }),
    number(
        "last_period",
        "s",
        "T_f, from the last stick but one to the last",
        |s| s.last_period,
    ),
    number("natural_period", "s", "T_n = 2 pi sqrt(J/k_t)", |s| {
        Some(s.natural_period)
    }),
    number(
        "instability_time",
        "s",
        "when steady sliding loses its stability",
        |s| s.instability_time,
    ),
    // Sliding that never loses stability gives a perturbation nothing to gain.
    number(
        "growth_exponent",
        "1",
        "G, e-folds that a perturbation could gain",
        |s| Some(s.growth_exponent.unwrap_or(0.0)),
    ),
    number("growth_to_onset", "1", "the part of G up to the first stick", |s| {
        Some(s.growth_to_onset.unwrap_or(0.0))
    }),
    number(
        "e_folds_gained",
        "1",
        "e-folds that the first kick gained until the first stick",
        |s| s.e_folds_gained,
    ),
    count(
        "noise_determined",
        "1 if the stick-slip is amplified rounding, else 0",
        |s| Some(f64::from(u8::from(s.noise_determined))),
    ),
    count(
        "kicks_never_given",
        "kicks set at an instability that never came",
        |s| Some(s.kicks_never_given as f64),
    ),
    number("energy_residual", "J", "largest residual of the energy balance", |s| {
        Some(s.energy_residual)
    }),
    count("steps", "steps of all solvers", |s| {
        Some(s.work.iter().map(|w| w.steps as f64).sum())
    }),
    count("rhs_evaluations", "right-hand sides of all solvers", |s| {
        Some(s.work.iter().map(|w| w.rhs_evaluations as f64).sum())
    }),
];

/// The place of a quantity in [`QUANTITIES`].
pub fn quantity_index(name: &str) -> Option<usize> {
    QUANTITIES.iter().position(|quantity| quantity.name == name)
}

/// One value for each of [`QUANTITIES`]; NaN where the run has none.
pub type Values = [f64; QUANTITIES.len()];

/// One event of a run, as a sweep keeps it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EventRow {
    /// s.
    pub time: f64,
    /// Of the event.
    pub kind: EventKind,
    /// Code of the mode after it.
    pub mode_after: i8,
    /// Relative velocity omega_r before it, rad/s.
    pub relative_velocity: f64,
    /// T_f / r just before it, N.
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

/// What came of one point.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The number of the point in its study.
    pub number: u64,
    /// The summary, or why there is none.
    pub result: Result<Values, String>,
    /// In order of time; empty unless the study keeps them.
    pub events: Vec<EventRow>,
}

impl Outcome {
    /// The value of one of [`QUANTITIES`]; NaN for a run that failed or has none.
    pub fn value(&self, index: usize) -> f64 {
        self.result.as_ref().map_or(f64::NAN, |values| values[index])
    }
}

/// The values of a run that is complete.
pub(super) fn values_of(parameters: &crate::model::Parameters, report: &RunReport) -> Values {
    let summary = Summary::of_run(parameters, report);
    std::array::from_fn(|k| (QUANTITIES[k].get)(&summary).unwrap_or(f64::NAN))
}
