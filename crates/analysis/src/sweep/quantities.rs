//! Quantities of a run in a sweep, and the outcome of a point.

use crate::analysis::{Attractor, Extremes, Summary, summary};
use stickslip_case::{Motion, suggest};
use stickslip_system::model::margin::{resistance, slowing};
use stickslip_system::model::system::System;
use stickslip_system::quote::shown;
use stickslip_system::record::{Event, EventKind};

/// Quantity of a run's summary.
#[derive(Clone, Copy)]
pub struct Quantity {
    /// Name of its variable.
    pub name: &'static str,
    /// Unit (UDUNITS), in rotation.
    unit: &'static str,
    /// Description in words, with the paper's symbol.
    pub description: &'static str,
    /// Whether it is a whole number, stored as int64 with `NO_COUNT` if missing; else float64 with NaN.
    pub count: bool,
    /// Codes and meanings of a coded count.
    pub flags: &'static [(i64, &'static str)],
    get: fn(&Summary) -> Option<f64>,
}

impl Quantity {
    /// Unit (UDUNITS), with positions as angles or lengths.
    pub fn unit(&self, motion: Motion) -> &'static str {
        match (motion, self.unit) {
            (Motion::Translation, "rad") => "m",
            (Motion::Translation, "rad s-1") => "m s-1",
            (_, unit) => unit,
        }
    }

    /// Reason why no run of this system has the quantity; `None` if one may.
    fn why_not(&self, system: &System) -> Option<String> {
        if GROWTH.contains(&self.name) {
            let why = resistance(system).err()?;
            Some(format!("its sliding is not watched for a loss of stability: {why}"))
        } else if self.name.starts_with("attractor_") && slowing(system).is_ok() {
            Some("nothing drives its sliding, which slows down to a stop and does not repeat itself".to_owned())
        } else {
            None
        }
    }
}

impl std::fmt::Debug for Quantity {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(self.name)
    }
}

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
        flags: &[],
        get,
    }
}

const fn count(name: &'static str, description: &'static str, get: fn(&Summary) -> Option<f64>) -> Quantity {
    Quantity {
        count: true,
        ..number(name, "1", description, get)
    }
}

/// Quantities of sliding whose loss of stability is watched.
const GROWTH: [&str; 6] = [
    "natural_period",
    "instability_time",
    "growth_exponent",
    "growth_to_onset",
    "e_folds_gained",
    "noise_determined",
];

/// Value of a quantity in [`GROWTH`], if the loss of stability is watched.
fn watched(summary: &Summary, value: f64) -> Option<f64> {
    summary.natural_period.map(|_| value)
}

fn attractor(summary: &Summary, of: fn(&Attractor) -> f64) -> Option<f64> {
    summary.attractor().map(of)
}

fn extremes(summary: &Summary, of: fn(&Extremes) -> Option<f64>) -> Option<f64> {
    summary.attractor()?.extremes.as_ref().and_then(of)
}

const STUCK: f64 = 1.0;

/// Code of a motion without a period that does not end in a stick.
const NOT_PERIODIC: f64 = 2.0;

const MOTIONS: [(i64, &str); 7] = [
    (0, "periodic"),
    (1, "stuck"),
    (2, "not-periodic"),
    (3, "steady-slip"),
    (4, "steady-stick"),
    (5, "steady-separated"),
    (6, "steady-engaged"),
];

fn motion(summary: &Summary) -> Option<f64> {
    Some(match summary.outcome.as_ref()? {
        summary::Outcome::Periodic(_) => 0.0,
        summary::Outcome::Stuck { .. } => STUCK,
        summary::Outcome::NotPeriodic => NOT_PERIODIC,
        summary::Outcome::Steady { mode, .. } => match *mode {
            "stick" => 4.0,
            "separated" => 5.0,
            "engaged" => 6.0,
            _ => 3.0,
        },
    })
}

/// Quantities of every run, in the order of the variables in a sweep file.
pub const QUANTITIES: [Quantity; 40] = [
    count("stick_count", "number of sticks", |s| Some(s.sticks as f64)),
    count("slip_count", "number of breakaways from stick", |s| {
        Some(s.slips as f64)
    }),
    number("onset_time", "s", "time of the first stick", |s| s.onset_time),
    number(
        "final_stick_time",
        "s",
        "begin of the stick in which the run ends",
        |s| s.final_stick_time,
    ),
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
    number("natural_period", "s", "T_n = 2 pi sqrt(J/k_t)", |s| s.natural_period),
    number(
        "instability_time",
        "s",
        "when steady sliding loses its stability",
        |s| s.instability_time,
    ),
    // Sliding that keeps its stability amplifies nothing.
    number(
        "growth_exponent",
        "1",
        "G, e-folds that a perturbation could gain",
        |s| watched(s, s.growth_exponent.unwrap_or(0.0)),
    ),
    number("growth_to_onset", "1", "the part of G up to the first stick", |s| {
        watched(s, s.growth_to_onset.unwrap_or(0.0))
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
        |s| watched(s, f64::from(u8::from(s.noise_determined))),
    ),
    count("kicks_never_given", "kicks that the run did not come to", |s| {
        Some(s.kicks_never_given as f64)
    }),
    number("energy_residual", "J", "largest residual of the energy balance", |s| {
        Some(s.energy_residual)
    }),
    count("steps", "steps of all solvers", |s| {
        Some(s.work.iter().map(|w| w.steps as f64).sum())
    }),
    count("rhs_evaluations", "right-hand sides of all solvers", |s| {
        Some(s.work.iter().map(|w| w.rhs_evaluations as f64).sum())
    }),
    count("jacobian_evaluations", "Jacobians of all solvers", |s| {
        Some(s.work.iter().map(|w| w.jacobian_evaluations as f64).sum())
    }),
    Quantity {
        flags: &MOTIONS,
        ..count("motion", "what the motion comes to by the end of the run", motion)
    },
    count("event_count", "number of events", |s| Some(s.events as f64)),
    number(
        "attractor_period",
        "s",
        "period of the motion that the run has come to, NaN where it does not repeat itself",
        |s| attractor(s, |a| a.period),
    ),
    count("attractor_sticks", "sticks in a period of that motion", |s| {
        attractor(s, |a| a.sticks as f64)
    }),
    number(
        "attractor_agreement",
        "1",
        "relative difference of its last two cycles",
        |s| attractor(s, |a| a.agreement),
    ),
    number(
        "attractor_distance",
        "1",
        "relative distance of the last cycle from the periodic motion",
        |s| attractor(s, |a| a.distance),
    ),
    number(
        "attractor_since",
        "s",
        "when two successive cycles had come to agree",
        |s| attractor(s, |a| a.since),
    ),
    number(
        "attractor_amplitude",
        "rad",
        "half of the range of the position over a period",
        |s| extremes(s, |e| e.amplitude),
    ),
    number("attractor_position_min", "rad", "least position over a period", |s| {
        extremes(s, |e| Some(e.position.0))
    }),
    number("attractor_position_max", "rad", "largest position over a period", |s| {
        extremes(s, |e| Some(e.position.1))
    }),
    number(
        "attractor_relative_velocity_min",
        "rad s-1",
        "least relative velocity omega_r over a period",
        |s| extremes(s, |e| Some(e.relative_velocity.0)),
    ),
    number(
        "attractor_relative_velocity_max",
        "rad s-1",
        "largest relative velocity omega_r over a period",
        |s| extremes(s, |e| Some(e.relative_velocity.1)),
    ),
    number(
        "stick_threshold",
        "rad s-1",
        "speed below which a contact without stick counts as stuck; NaN of one that sticks",
        |s| s.stick_threshold,
    ),
    number(
        "last_event_time",
        "s",
        "time of the last stick, slip, reversal, separation or contact",
        |s| s.last_event_time,
    ),
    number("end_time", "s", "time at which the run ends", |s| Some(s.end)),
];

/// Index of a quantity in [`QUANTITIES`].
pub fn quantity_index(name: &str) -> Option<usize> {
    QUANTITIES.iter().position(|quantity| quantity.name == name)
}

/// Index of a requested quantity that fits the `purpose`, such as " to measure", or a message about its name.
pub(crate) fn asked_for(
    name: &str,
    system: Option<&System>,
    purpose: &str,
    fits: fn(&Quantity) -> bool,
) -> Result<usize, String> {
    match quantity_index(name).filter(|&place| fits(&QUANTITIES[place])) {
        Some(place) => match system.and_then(|system| QUANTITIES[place].why_not(system)) {
            Some(why) => Err(format!("no run of this case has \"{name}\": {why}")),
            None => Ok(place),
        },
        None => {
            let names: Vec<&str> = QUANTITIES.iter().filter(|one| fits(one)).map(|one| one.name).collect();
            let hint = match suggest(name, names.iter().copied()) {
                Some(close) => format!("did you mean {close}?"),
                None => format!("there are {}", names.join(", ")),
            };
            Err(format!("a run has no quantity \"{}\"{purpose}; {hint}", shown(name)))
        }
    }
}

/// Duration of a lasting final stick, relative to the longest earlier one.
const LASTING_STICK: f64 = 2.0;

/// Whether a longer run might determine the motion. A stop: no lasting stick yet. Another motion without a period: the
/// contact still changes in the second half, or the final stick, too short, may belong to a cycle.
pub(super) fn is_open(values: &QuantityValues) -> bool {
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
pub type QuantityValues = Vec<f64>;

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
    pub result: Result<QuantityValues, String>,
    /// Events in order of time; empty unless the study keeps them.
    pub events: Vec<EventRow>,
}

impl PointOutcome {
    /// Value of a quantity by its index; NaN if missing.
    pub fn value(&self, index: usize) -> f64 {
        self.result.as_ref().map_or(f64::NAN, |values| values[index])
    }
}

pub(super) fn values(summary: &Summary) -> QuantityValues {
    let values = QUANTITIES.iter().map(|quantity| (quantity.get)(summary));
    values.map(|value| value.unwrap_or(f64::NAN)).collect()
}
