//! Derivatives of a run: effects of small changes of its state or of a parameter on later events.
//!
//! `series` carries derivatives along a run (`simulation::variation`); each parameter is moved in copies of the case.
//! So every parameter of the case file has a derivative, also those of a table, a harmonic or a bristle. Two widths,
//! extrapolated, bound the error of a derivative.

use stickslip_case::{Case, CaseNumber, WrittenCase};
use stickslip_engine::simulation::{
    Excitation, Method, MovedCases, MovedSystem, OutputOptions, RunFailure, SolverOptions, variation,
};
use stickslip_system::model::Mode;
use stickslip_system::model::system::System;
use stickslip_system::record::EventKind;
use stickslip_system::watch::Watch;

pub(super) const RTOL: f64 = 1e-13;

/// Changes of a parameter, relative, or absolute at zero. Two widths give the second-order error, which is subtracted.
const WIDTHS: [f64; 2] = [1.0 / 262_144.0, 1.0 / 131_072.0];

/// Rounding of a difference of two times, in units of the time's rounding.
const DIFFERENCE_ROUNDING: f64 = 4.0;

/// Integration error, as a fraction of the largest derivative so far.
const CARRIED: f64 = 2e-8;

/// Derivative and its uncertainty; NaN if unknown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slope {
    /// Derivative, s per unit of the parameter.
    pub value: f64,
    /// Uncertainty in the same unit.
    pub uncertainty: f64,
}

impl Slope {
    pub(super) const NONE: Slope = Slope {
        value: f64::NAN,
        uncertainty: f64::NAN,
    };
}

/// Event with the derivatives of its time.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearisedEvent {
    /// Time, s.
    pub time: f64,
    /// Kind of the event.
    pub kind: EventKind,
    /// Mode after the event.
    pub mode_after: Mode,
    /// d(time)/d(parameter) for each parameter; NaN if it does not exist, as for the rise time of a step.
    pub by_parameter: Vec<Slope>,
    /// Growth of the fastest deviation until just after the event, e-folds. Growth starts at the loss of stability, or
    /// at a later kick on smooth sliding. Twists are weighted by the natural angular frequency. `None` before the loss
    /// of stability, or without one.
    pub growth: Option<f64>,
    /// Largest shift of the event by a deviation of 1 rad/s at the start of the growth, s.
    pub per_deviation: Option<f64>,
    /// Shift of the event by rounding, s: a lower limit for every method in double precision.
    pub rounding: f64,
}

/// Run with its linearisation.
#[derive(Debug, Clone, Default)]
pub struct Linearised {
    /// Physical parameters of the case.
    pub parameters: Vec<CaseNumber>,
    /// Events of the run in order.
    pub events: Vec<LinearisedEvent>,
    /// For each parameter: whether the moved run begins in the same mode, so that its events correspond.
    alike: Vec<bool>,
}

impl Linearised {
    /// Derivative of an event by a parameter; NaN if the moved runs have a different event.
    pub fn slope(&self, event: usize, parameter: usize) -> Slope {
        let of = |event: &LinearisedEvent| event.by_parameter[parameter];
        self.events
            .get(event)
            .filter(|_| self.alike[parameter])
            .map_or(Slope::NONE, of)
    }
}

pub(super) fn by_series(case: &Case, max_steps: Option<usize>) -> SolverOptions {
    SolverOptions {
        method: Method::Series,
        rtol: RTOL,
        max_events: case.solver.max_events,
        max_steps,
        ..SolverOptions::default()
    }
}

/// Runs the case by `series` within a wall time (s) and linearises the run up to the point where `stop` ends it.
pub fn linearise(
    written: &WrittenCase,
    max_wall_time: Option<f64>,
    stop: &dyn Watch,
) -> Result<Linearised, Box<RunFailure>> {
    let (case, numbers) = (written.case(), written.numbers());
    let columns: Vec<MovedCases> = numbers
        .iter()
        .flat_map(|number| {
            WIDTHS.map(|width| MovedCases {
                copies: moved(written, number, width),
                rounded: (width == WIDTHS[0]).then_some(number.value),
            })
        })
        .collect();
    let system = &case.system;
    let found = variation(
        (system, case.threshold),
        &columns,
        &SolverOptions {
            max_wall_time,
            ..by_series(case, None)
        },
        &OutputOptions::at_the_ends(case.output.end_time),
        stop,
    )?;
    let excitation = Excitation::new(system);
    let mut largest = vec![0.0f64; numbers.len()];
    let pairs = found.events.into_iter().zip(found.passages);
    let events = pairs.map(|(event, passage)| {
        let (time, kind) = (event.time, event.kind);
        let slope = |(index, number): (usize, &CaseNumber)| {
            if columns[2 * index].copies.is_empty() {
                return Slope::NONE;
            }
            let [own, other] = [2 * index, 2 * index + 1];
            let (narrow, wide) = (passage.times[own], passage.times[other]);
            // Only differences of the same kind have errors of the same form.
            let same =
                columns[own].copies.len() == columns[other].copies.len() && found.alike[own] && found.alike[other];
            let value = if same { narrow + (narrow - wide) / 3.0 } else { narrow };
            largest[index] = largest[index].max(value.abs());
            let rounding = DIFFERENCE_ROUNDING * f64::EPSILON * time / (WIDTHS[0] * size(number));
            Slope {
                value,
                uncertainty: (narrow - wide).abs() + CARRIED * largest[index] + rounding,
            }
        };
        // A contact at a corner whose force was zero does not appear as a zero.
        let of_zero = match kind {
            EventKind::Separation | EventKind::Contact => excitation.rounding_of_zero(time),
            _ => 0.0,
        };
        LinearisedEvent {
            time,
            kind,
            mode_after: event.mode_after,
            by_parameter: numbers.iter().enumerate().map(slope).collect(),
            growth: passage.growth,
            per_deviation: passage.per_deviation,
            rounding: passage.rounding + of_zero,
        }
    });
    Ok(Linearised {
        events: events.collect(),
        parameters: numbers.to_vec(),
        alike: found.alike.chunks(2).map(|alike| alike[0]).collect(),
    })
}

fn size(number: &CaseNumber) -> f64 {
    match number.value == 0.0 {
        true => 1.0,
        false => number.value.abs(),
    }
}

/// Copies of the case with a parameter changed on both sides, or twice on the only possible side; otherwise empty.
fn moved(written: &WrittenCase, number: &CaseNumber, width: f64) -> Vec<MovedSystem> {
    let h = width * size(number);
    let at = |steps: f64| written.moved(&number.path, number.value + steps * h);
    copies(h, &[(1.0, 0.5), (-1.0, -0.5)], -2.0, at).unwrap_or_default()
}

/// Copies of a system for differences over changes `h` of a parameter: `central` ones, in steps with their weights, if
/// the system exists on both sides; otherwise three on one side, the middle one with this bend.
pub(crate) fn copies(
    h: f64,
    central: &[(f64, f64)],
    middle_bend: f64,
    at: impl Fn(f64) -> Option<(System, f64)>,
) -> Option<Vec<MovedSystem>> {
    let copy = |(steps, weight): (f64, f64), bend: f64| {
        let (system, threshold) = at(steps)?;
        Some(MovedSystem {
            system,
            threshold,
            weight: weight / h,
            bend,
        })
    };
    let one_sided = |side: f64| -> Option<Vec<MovedSystem>> {
        let steps = [(0.0, -1.5 * side), (side, 2.0 * side), (2.0 * side, -0.5 * side)];
        let bends = [1.0, middle_bend, 1.0];
        steps
            .into_iter()
            .zip(bends)
            .map(|(step, bend)| copy(step, bend))
            .collect()
    };
    let both: Option<Vec<_>> = central.iter().map(|step| copy(*step, 1.0)).collect();
    both.or_else(|| one_sided(1.0)).or_else(|| one_sided(-1.0))
}
