//! Derivatives of a run: how a small change of its state or of a number of its case changes what follows.
//!
//! Derivatives are carried along a run by `series` (`simulation::variation`), with each number moved in
//! copies of the case: so everything is differentiated that a case can have, table, harmonic or bristle, by what the case file says
//! of it. Two widths of the moves, extrapolated, tell how far a derivative can be off.

use crate::case::{Case, CaseNumber, WrittenCase};
use crate::model::Mode;
use crate::record::{Event, EventKind, Recorder, RecorderError};
use crate::simulation::{Excitation, MovedCases, MovedSystem, variation};
use crate::simulation::{Method, OutputOptions, RunFailure, SolverOptions};
use crate::workers::go_on_unless;

/// Relative tolerance of the run.
pub(super) const RTOL: f64 = 1e-13;

/// The moves of a number, relative to it, or of one that is zero in its unit. The error of the differences is of second order: two
/// widths, of which one is twice the other, tell its largest part, which is taken off.
const WIDTHS: [f64; 2] = [1.0 / 262_144.0, 1.0 / 131_072.0];

/// Roundings of a time in a difference of two, over the move.
const DIFFERENCE_ROUNDING: f64 = 4.0;

/// The error of the integration, as a share of the largest derivative so far.
const CARRIED: f64 = 2e-8;

/// A derivative, and how far it can be off; NaN where there is none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slope {
    /// s per unit of the parameter.
    pub value: f64,
    /// In the same unit.
    pub uncertainty: f64,
}

impl Slope {
    /// None.
    pub(super) const NONE: Slope = Slope {
        value: f64::NAN,
        uncertainty: f64::NAN,
    };
}

/// An event, as far as small changes move it.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearisedEvent {
    /// s.
    pub time: f64,
    /// What happened.
    pub kind: EventKind,
    /// What the contact does behind it.
    pub mode_after: Mode,
    /// d(time)/d(parameter), one for each parameter. NaN for one that the event cannot be differentiated by: the rise time of a
    /// step.
    pub by_parameter: Vec<Slope>,
    /// By how many e-folds the deviation that grows most has grown from the loss of stability, or from a later kick on smooth
    /// sliding, to just behind the event; `None` before it, or if stability is never lost. Twists count times the natural angular frequency.
    pub growth: Option<f64>,
    /// How far a deviation of 1 rad/s where growth begins, in the worst direction, would move the event, s.
    pub per_deviation: Option<f64>,
    /// How far rounding to double precision moves the event, s. No method in double precision can be held to less.
    pub rounding: f64,
}

/// A run with its linearisation.
#[derive(Debug, Clone, Default)]
pub struct Linearised {
    /// The physical numbers of the case.
    pub parameters: Vec<CaseNumber>,
    /// All events of the run, in order.
    pub events: Vec<LinearisedEvent>,
    /// Of each parameter, whether the run begins alike with the number moved, so that its events are the same.
    alike: Vec<bool>,
}

impl Linearised {
    /// What a number does to an event; nothing where runs with the number moved have another there.
    pub fn slope(&self, event: usize, parameter: usize) -> Slope {
        let of = |event: &LinearisedEvent| event.by_parameter[parameter];
        self.events
            .get(event)
            .filter(|_| self.alike[parameter])
            .map_or(Slope::NONE, of)
    }
}

/// Keeps times, kinds and modes of the events.
#[derive(Debug, Default)]
pub(super) struct Times(pub Vec<(f64, EventKind, Mode)>);

impl Recorder for Times {
    fn stores_motion(&self) -> bool {
        false
    }

    fn event(&mut self, event: &Event) -> Result<(), RecorderError> {
        self.0.push((event.time, event.kind, event.mode_after));
        Ok(())
    }

    fn stores_events(&self) -> bool {
        true
    }
}

/// How a case is run by `series`.
pub(super) fn by_series(case: &Case, max_steps: Option<usize>) -> SolverOptions {
    SolverOptions {
        method: Method::Series,
        rtol: RTOL,
        max_events: case.solver.max_events,
        max_steps,
        ..SolverOptions::default()
    }
}

/// Runs the case by `series`, in so much wall time (s), and linearises the run. `stop` is asked now and then: what comes back after
/// it said so ends where the run did.
///
/// # Errors
/// Those of the run.
pub fn linearise(
    written: &WrittenCase,
    max_wall_time: Option<f64>,
    stop: &dyn Fn() -> bool,
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
    let mut times = Times::default();
    let system = &case.system;
    let found = variation(
        (system, case.threshold),
        &columns,
        &SolverOptions {
            max_wall_time,
            ..by_series(case, None)
        },
        &OutputOptions::at_the_ends(case.output.end_time),
        &mut times,
        &mut |_| go_on_unless(stop()),
    )?;
    let excitation = Excitation::new(system);
    let mut largest = vec![0.0f64; numbers.len()];
    let pairs = times.0.into_iter().zip(found.events);
    let events = pairs.map(|((time, kind, mode_after), passage)| {
        let slope = |(index, number): (usize, &CaseNumber)| {
            if columns[2 * index].copies.is_empty() {
                return Slope::NONE;
            }
            let [own, other] = [2 * index, 2 * index + 1];
            let (narrow, wide) = (passage.times[own], passage.times[other]);
            // Only of differences of one kind is the error known to be of the same form.
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
        // A contact at a corner, where the force stood at zero, is no zero that is looked for.
        let of_zero = match kind {
            EventKind::Separation | EventKind::Contact => excitation.rounding_of_zero(time),
            _ => 0.0,
        };
        LinearisedEvent {
            time,
            kind,
            mode_after,
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

/// What a number is moved by a share of.
fn size(number: &CaseNumber) -> f64 {
    match number.value == 0.0 {
        true => 1.0,
        false => number.value.abs(),
    }
}

/// The case with a number moved by so much, to both sides, or twice to the one to which it can be moved. None where it
/// cannot be moved.
fn moved(written: &WrittenCase, number: &CaseNumber, width: f64) -> Vec<MovedSystem> {
    let h = width * size(number);
    let copy = |steps: f64, weight: f64, bend: f64| {
        let (system, threshold) = written.moved(&number.path, number.value + steps * h)?;
        Some(MovedSystem {
            threshold,
            system,
            weight: weight / h,
            bend,
        })
    };
    let all = |copies: &[(f64, f64, f64)]| -> Option<Vec<MovedSystem>> {
        copies
            .iter()
            .map(|&(steps, weight, bend)| copy(steps, weight, bend))
            .collect()
    };
    let one_sided = |side: f64| {
        all(&[
            (0.0, -1.5 * side, 1.0),
            (side, 2.0 * side, -2.0),
            (2.0 * side, -0.5 * side, 1.0),
        ])
    };
    let central = all(&[(1.0, 0.5, 1.0), (-1.0, -0.5, 1.0)]);
    let found = central.or_else(|| one_sided(1.0)).or_else(|| one_sided(-1.0));
    found.unwrap_or_default()
}
