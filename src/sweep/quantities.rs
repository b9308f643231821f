//! What is kept of every run: the quantities of its summary, and the outcome of a point.

use crate::analysis::Summary;
use crate::analysis::summary;
use crate::analysis::{Attractor, Extremes};
use crate::case::{Motion, Words, suggest};
use crate::quote::shown;
use crate::record::{Event, EventKind};

/// One quantity of the summary of a run.
#[derive(Clone, Copy)]
pub struct Quantity {
    /// The name of its variable.
    pub name: &'static str,
    /// UDUNITS.
    pub unit: &'static str,
    /// In words, with the paper's symbol.
    pub description: &'static str,
    /// Whether it is a whole number, stored as int64 with `NO_COUNT` for nothing; else float64 with NaN.
    pub count: bool,
    /// Of a count that is a code: the codes and what they mean.
    pub flags: &'static [(i64, &'static str)],
    get: fn(&Summary) -> Option<f64>,
}

/// Quantities are the same if they have the same name and unit.
impl PartialEq for Quantity {
    fn eq(&self, other: &Quantity) -> bool {
        (self.name, self.unit) == (other.name, other.unit)
    }
}

impl std::fmt::Debug for Quantity {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(self.name)
    }
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

/// What the sticks and slips of any run give.
const CYCLES: [Quantity; 14] = [
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
];

/// What a run that slows down through the loss of stability of its sliding gives.
const GROWTH: [Quantity; 6] = [
    number("natural_period", "s", "T_n = 2 pi sqrt(J/k_t)", |s| s.natural_period),
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
];

const KICKS: Quantity = count("kicks_never_given", "kicks that the run did not come to", |s| {
    Some(s.kicks_never_given as f64)
});
const RESIDUAL: Quantity = number("energy_residual", "J", "largest residual of the energy balance", |s| {
    Some(s.energy_residual)
});
const STEPS: Quantity = count("steps", "steps of all solvers", |s| {
    Some(s.work.iter().map(|w| w.steps as f64).sum())
});
const RIGHT_HAND_SIDES: Quantity = count("rhs_evaluations", "right-hand sides of all solvers", |s| {
    Some(s.work.iter().map(|w| w.rhs_evaluations as f64).sum())
});
const JACOBIANS: Quantity = count("jacobian_evaluations", "Jacobians of all solvers", |s| {
    Some(s.work.iter().map(|w| w.jacobian_evaluations as f64).sum())
});

/// The codes of `motion`: what a motion comes to.
const MOTIONS: [(i64, &str); 7] = [
    (0, "periodic"),
    (1, "stuck"),
    (2, "not-periodic"),
    (3, "steady-slip"),
    (4, "steady-stick"),
    (5, "steady-separated"),
    (6, "steady-engaged"),
];

/// The code of a motion that ends in a stick.
const STUCK: f64 = 1.0;

/// A final stick is taken to last from this multiple of the longest stick before it.
const LASTING_STICK: f64 = 2.0;

/// The code of a motion that neither repeats itself nor ends in a stick.
const NOT_PERIODIC: f64 = 2.0;

fn motion(summary: &Summary) -> Option<f64> {
    Some(match summary.outcome.as_ref()? {
        summary::Outcome::Periodic(_) => 0.0,
        summary::Outcome::Stuck { .. } => STUCK,
        summary::Outcome::NotPeriodic => NOT_PERIODIC,
        summary::Outcome::Steady { mode } => match *mode {
            "stick" => 4.0,
            "separated" => 5.0,
            "engaged" => 6.0,
            _ => 3.0,
        },
    })
}

const MOTION: [Quantity; 2] = [
    Quantity {
        flags: &MOTIONS,
        ..count("motion", "what the motion comes to by the end of the run", motion)
    },
    count("event_count", "number of events", |s| Some(s.events as f64)),
];

fn attractor(summary: &Summary, of: fn(&Attractor) -> f64) -> Option<f64> {
    summary.attractor().map(of)
}

fn extremes(summary: &Summary, of: fn(&Extremes) -> Option<f64>) -> Option<f64> {
    summary.attractor()?.extremes.as_ref().and_then(of)
}

/// What a motion that may repeat itself comes to; `angle` is the unit of positions.
const fn attractor_quantities(angle: &'static str, speed: &'static str) -> [Quantity; 13] {
    [
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
            angle,
            "half of the range of the position over a period",
            |s| extremes(s, |e| e.amplitude),
        ),
        number("attractor_position_min", angle, "least position over a period", |s| {
            extremes(s, |e| Some(e.position.0))
        }),
        number("attractor_position_max", angle, "largest position over a period", |s| {
            extremes(s, |e| Some(e.position.1))
        }),
        number(
            "attractor_relative_velocity_min",
            speed,
            "least relative velocity omega_r over a period",
            |s| extremes(s, |e| Some(e.relative_velocity.0)),
        ),
        number(
            "attractor_relative_velocity_max",
            speed,
            "largest relative velocity omega_r over a period",
            |s| extremes(s, |e| Some(e.relative_velocity.1)),
        ),
        number(
            "stick_threshold",
            speed,
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
    ]
}

/// Lists one behind the other, N quantities in all.
const fn joined<const N: usize>(lists: &[&[Quantity]]) -> [Quantity; N] {
    let mut all = [RESIDUAL; N];
    let (mut list, mut at) = (0, 0);
    while list < lists.len() {
        let mut k = 0;
        while k < lists[list].len() {
            all[at] = lists[list][k];
            (at, k) = (at + 1, k + 1);
        }
        list += 1;
    }
    assert!(at == N);
    all
}

/// What is kept of a run that comes to a stop.
pub const QUANTITIES: [Quantity; 24] = joined(&[&CYCLES, &GROWTH, &[KICKS, RESIDUAL, STEPS, RIGHT_HAND_SIDES]]);

/// What is kept of a run that may come to repeat itself.
const fn of_motion(angle: &'static str, speed: &'static str) -> [Quantity; 34] {
    joined(&[
        &MOTION,
        &CYCLES,
        &attractor_quantities(angle, speed),
        &[RESIDUAL, KICKS, STEPS, RIGHT_HAND_SIDES, JACOBIANS],
    ])
}

/// Every selection that a study may keep. A file of a study has its variables in this order.
static SELECTIONS: ([Quantity; 24], [[Quantity; 34]; 2]) =
    (QUANTITIES, [of_motion("rad", "rad s-1"), of_motion("m", "m s-1")]);

/// What is kept of every run of a case with these words, in the order of the variables in a sweep file.
pub fn quantities(words: Words) -> &'static [Quantity] {
    match (words.lists_growth(), words.motion()) {
        (true, _) => &SELECTIONS.0,
        (false, motion) => &SELECTIONS.1[usize::from(motion == Motion::Translation)],
    }
}

/// The selections, of which the one in metres repeats the names of the one in radians.
#[cfg(feature = "cli")]
pub(crate) fn selections() -> impl Iterator<Item = &'static [Quantity]> {
    [SELECTIONS.0.as_slice(), SELECTIONS.1[0].as_slice()].into_iter()
}

/// The place of a quantity in [`QUANTITIES`].
pub fn quantity_index(name: &str) -> Option<usize> {
    place(&QUANTITIES, name)
}

/// The place of a quantity in a selection.
fn place(quantities: &[Quantity], name: &str) -> Option<usize> {
    quantities.iter().position(|quantity| quantity.name == name)
}

/// What to say about a name that is no quantity of a run with these words, of which `fits` are asked for.
pub(crate) fn unknown_quantity(words: Words, name: &str, purpose: &str, fits: fn(&Quantity) -> bool) -> String {
    let own = quantities(words).iter().filter(|quantity| fits(quantity));
    let names: Vec<&str> = own.map(|quantity| quantity.name).collect();
    let quoted = shown(name);
    let listed = names.join(", ");
    if place(quantities(words), name).is_none() {
        if place(&SELECTIONS.1[0], name).is_some() {
            return format!(
                "\"{quoted}\" is a quantity of studies whose base case is in the general form, [rotor] and [stator]; there are {listed}"
            );
        }
        if place(&SELECTIONS.0, name).is_some() {
            return format!(
                "\"{quoted}\" is a quantity of studies whose base case is in the short form, [torsion]; there are {listed}"
            );
        }
    }
    match suggest(name, names.iter().copied()) {
        Some(close) => format!("a run has no quantity \"{quoted}\"{purpose}; did you mean {close}?"),
        None => format!("a run has no quantity \"{quoted}\"{purpose}; there are {listed}"),
    }
}

/// Whether a longer run might show what the motion comes to. One that is said to repeat itself, to be stuck, or neither, is open if
/// it does not repeat itself, and either the contact still changes what it does in the second half of the run, or the run ends in a
/// stick that has not yet lasted twice as long as the longest one before it: such a stick may be one of a cycle. Another has not
/// come to a stick that lasts.
pub(super) fn is_open(quantities: &[Quantity], values: &Values) -> bool {
    let value = |name: &str| place(quantities, name).map_or(f64::NAN, |place| values[place]);
    match value("motion") {
        motion if motion.is_nan() => value("final_stick_time").is_nan(),
        // False where no stick has ended.
        STUCK => value("end_time") - value("final_stick_time") < LASTING_STICK * value("longest_stick_duration"),
        motion => motion == NOT_PERIODIC && value("last_event_time") > 0.5 * value("end_time"),
    }
}

/// One value for each of the quantities of a study; NaN where the run has none.
pub type Values = Vec<f64>;

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
    /// The value of a quantity by its place; NaN for a run that failed or has none.
    pub fn value(&self, index: usize) -> f64 {
        self.result.as_ref().map_or(f64::NAN, |values| values[index])
    }
}

/// The quantities of a run of a case with these words that comes to `summary`.
pub(super) fn values(words: Words, summary: &Summary) -> Values {
    let values = quantities(words).iter();
    values
        .map(|quantity| (quantity.get)(summary).unwrap_or(f64::NAN))
        .collect()
}
