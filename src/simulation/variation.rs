//! Derivatives of the events of a run by numbers of its case: [`hybrid::Carried`](crate::hybrid::Carried) for a system.

use super::dynamics::{SystemDynamics, SystemLocation};
use super::simulate::prepared;
use super::state_readings::StateReadings;
use crate::hybrid::{
    Carried, CarryingRules, Measures, MovedCopy, MovedNumber, Passage, Replaced, RunError, Transition,
};
use crate::model::Mode;
use crate::model::equations::{Outside, SystemEquations};
use crate::model::slow_manifold::{Slip, has_slow_manifold, on_slow_manifold, slow_momenta};
use crate::model::system::System;
use crate::record::{EventDigest, EventKind, Recorder};
use crate::simulation::observer::Recording;
use crate::simulation::{Method, OutputOptions, Progress, RunFailure, RunReport, SolverOptions, automaton};
use nalgebra::DVector;
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, PoisonError};

/// The system of a case in which a number is moved.
pub(crate) struct MovedSystem {
    /// With the number moved.
    pub system: System,
    /// As in [`Run::of_system`](crate::Run::of_system), rad/s.
    pub threshold: f64,
    /// Per unit of the number. Over all copies the weights add up to zero, and weight times value to the derivative of a value.
    pub weight: f64,
    /// As [`MovedCopy::bend`].
    pub bend: f64,
}

/// A number, moved.
pub(crate) struct MovedCases {
    /// The copies in which it is.
    pub copies: Vec<MovedSystem>,
    /// Its value, where its rounding counts.
    pub rounded: Option<f64>,
}

/// What a run gives beside its events.
pub(crate) struct Variation {
    /// What small changes do to each event; d(time)/d(number) is NaN where the copies have another event.
    pub events: Vec<Passage>,
    /// Of each number, whether its copies begin in the mode of the run.
    pub alike: Vec<bool>,
}

/// What each component of a deviation is multiplied by to compare with the others: twists by the frequencies of their inertias on
/// their shafts, rad/s.
pub(crate) fn deviation_weights(system: &SystemEquations) -> Vec<f64> {
    let mut weights = vec![1.0; system.mechanical()];
    for side in [&system.rotor, &system.stator] {
        for i in 0..side.shafts() {
            weights[side.twists + 2 * i] = side.own_frequency(i);
        }
    }
    weights
}

/// Deviations are compared by [`deviation_weights`]; growth counts from a loss of stability on.
pub(super) struct Contact {
    dynamics: Arc<SystemDynamics>,
    weights: Vec<f64>,
}

impl Contact {
    pub(super) fn new(dynamics: &Arc<SystemDynamics>) -> Contact {
        Contact {
            dynamics: dynamics.clone(),
            weights: deviation_weights(&dynamics.system),
        }
    }
}

impl Measures<SystemLocation, EventKind> for Contact {
    fn weights(&self) -> &[f64] {
        &self.weights
    }

    fn derives_apart(&self, location: &SystemLocation) -> bool {
        location.mode == Mode::Stick
    }

    fn starts_growth(&self, kind: &EventKind) -> bool {
        *kind == EventKind::Destabilised
    }

    /// A kick is added to the slow manifold, of which the momentum says where on it the state is.
    fn replaced(
        &self,
        location: &SystemLocation,
        t: f64,
        y: &[f64],
        transitions: &[Transition<EventKind, SystemLocation>],
    ) -> Option<Replaced> {
        let SystemDynamics { system, excitation, .. } = &*self.dynamics;
        let kick = transitions.iter().find(|one| one.kind == Some(EventKind::Kick))?;
        // A kick changes rates only.
        let kept = system.twist_rates().all(|rate| kick.state[rate - 1] == y[rate - 1]);
        if kept || location.mode.sense() == 0 || !has_slow_manifold(system) {
            return None;
        }
        let pressing = excitation.line(location.stretch, t);
        let slip = Slip::undriven(location.sign(), location.piece, &pressing);
        let slow = on_slow_manifold(system, &slip, y);
        let momentum = |k: usize| {
            let mut unit = vec![0.0; system.dimension];
            unit[k] = 1.0;
            slow_momenta(system, &Outside::default(), &unit).iter().sum()
        };
        // Rounding is counted elsewhere.
        let error = if slow.settled { Vec::new() } else { slow.error };
        Some(Replaced {
            error: error.into_iter().take(system.mechanical()).collect(),
            kept: DVector::from_fn(system.mechanical(), |k, _| momentum(k)),
        })
    }
}

/// Whether two cases have the same equations, and differ in what happens in between at most.
pub(super) fn alike_between_events(one: &System, other: &System) -> bool {
    let other = System {
        kicks: one.kicks.clone(),
        initial: one.initial.clone(),
        ..other.clone()
    };
    *one == other
}

/// Runs the system by `series`, into `recorder`, and gives what each of the numbers does.
///
/// # Errors
/// Those of a run.
pub(crate) fn variation(
    (system, threshold): (&System, f64),
    numbers: &[MovedCases],
    solver: &SolverOptions,
    output: &OutputOptions,
    recorder: &mut dyn Recorder,
    control: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<Variation, Box<RunFailure>> {
    let solver = SolverOptions {
        method: Method::Series,
        ..solver.clone()
    };
    let prepared = |of: (&System, f64)| prepared(of, None, &solver, output.end_time);
    let (dynamics, rules, start) = prepared((system, threshold));
    let mut alike = vec![true; numbers.len()];
    let mut columns = Vec::with_capacity(numbers.len());
    for (moved, alike) in numbers.iter().zip(&mut alike) {
        let mut copies = Vec::with_capacity(moved.copies.len());
        let mut slope = DVector::zeros(dynamics.system.mechanical());
        let in_equations = moved
            .copies
            .iter()
            .any(|copy| !alike_between_events(system, &copy.system));
        for moved in &moved.copies {
            let (dynamics, rules, begins) = prepared((&moved.system, moved.threshold));
            *alike &= begins.location.mode == start.location.mode;
            for (slope, state) in slope.iter_mut().zip(&begins.state) {
                *slope += moved.weight * state;
            }
            copies.push(MovedCopy {
                dynamics,
                rules: rules.resolving_all(),
                weight: moved.weight,
                bend: moved.bend,
            });
        }
        columns.push(MovedNumber {
            copies,
            start: slope,
            in_equations,
            rounded: moved.rounded,
        });
    }
    let measures = Box::new(Contact::new(&dynamics));
    let mechanical = dynamics.system.mechanical();
    let carried = Carried::new(dynamics.clone(), measures, mechanical, output.end_time, columns);
    let carried = Arc::new(Mutex::new(carried));
    let mut rules = CarryingRules::new(rules.clone(), rules.resolving_all(), carried.clone());
    let readings = StateReadings {
        dynamics: &dynamics,
        further: false,
    };
    let digest = EventDigest::new(None);
    let recording = Recording::new(readings, digest, (&solver, output), recorder, control, &start);
    let (result, report): (Result<(), RunError>, RunReport) =
        automaton(&dynamics, &mut rules, start, &solver, output, recording);
    report.ended(result)?;
    drop(rules);
    let carried = Arc::into_inner(carried).map(|carried| carried.into_inner().unwrap_or_else(PoisonError::into_inner));
    Ok(Variation {
        events: carried.map_or_else(Vec::new, Carried::into_passages),
        alike,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, CaseSource, Override, WrittenCase};
    use crate::record::{MemoryRecorder, NoRecorder};
    use crate::run::Run;

    /// Against differences of runs with the number moved, extrapolated from two widths.
    #[test]
    fn analytic_slopes_are_those_of_moved_runs() {
        for (name, end, least) in [
            ("drill-string", 30.0, 40),
            ("clutch", 2.0, 4),
            ("block", 3.0, 2),
            ("hairer", 20.0, 100),
            ("den-hartog", 20.0, 4),
        ] {
            let source = CaseSource::built_in(name).unwrap();
            let end = Override::number("output.end_time", end);
            let moved = |path: &str, value: f64| {
                let changes = [end.clone(), Override::number(path, value)];
                Case::read(&source, &changes)
            };
            let case = Case::read(&source, std::slice::from_ref(&end)).unwrap();
            let numbers = WrittenCase::read(&source, std::slice::from_ref(&end)).unwrap();
            let numbers = numbers.numbers();
            let mut columns = Vec::new();
            for number in numbers {
                let h = number.value.abs() / f64::from(1 << 16);
                let copies = [h, -h].map(|h| moved(&number.path, number.value + h).map(|case| (case, 0.5 / h)));
                let copies = copies.into_iter().flatten().map(|(case, weight)| MovedSystem {
                    threshold: case.threshold,
                    system: case.system,
                    weight,
                    bend: 1.0,
                });
                columns.push(MovedCases {
                    copies: copies.collect(),
                    rounded: None,
                });
            }
            let output = OutputOptions::at_the_ends(case.output.end_time);
            let found = variation(
                (&case.system, case.threshold),
                &columns,
                &case.solver,
                &output,
                &mut NoRecorder,
                &mut |_| ControlFlow::Continue(()),
            )
            .unwrap();
            let times = |path: &str, value: f64| -> Vec<f64> {
                let case = moved(path, value).unwrap();
                let solver = SolverOptions {
                    method: Method::Series,
                    ..case.solver.clone()
                };
                let mut kept = MemoryRecorder::default();
                let run = Run::new(&case).solver(&solver).output(&output).record(&mut kept);
                run.start().unwrap();
                kept.events.iter().map(|event| event.time).collect()
            };
            let mut compared = 0;
            for (column, number) in numbers.iter().enumerate() {
                let size = number.value.abs();
                if columns[column].copies.len() < 2 || !found.alike[column] {
                    continue;
                }
                let difference = |width: f64| -> Vec<f64> {
                    let [forth, back] = [width, -width].map(|width| times(&number.path, number.value + width * size));
                    let pairs = forth.iter().zip(&back);
                    pairs.map(|(a, b)| (a - b) / (2.0 * width * size)).collect()
                };
                let (wide, narrow) = (difference(1e-5), difference(1e-6));
                assert_eq!(found.events.len(), narrow.len(), "{name} {}", number.path);
                for (event, row) in found.events.iter().map(|event| &event.times).enumerate() {
                    let best = narrow[event] + (narrow[event] - wide[event]) / 99.0;
                    // Rounding of the times in the narrow difference.
                    let noise = 1e-8 * case.output.end_time / size;
                    let error = (row[column] - best).abs();
                    assert!(
                        error < 1e-6 * best.abs() + noise,
                        "{name} {} event {event}: {:e} and {best:e}",
                        number.path,
                        row[column]
                    );
                    compared += 1;
                }
            }
            assert!(compared >= least, "{name}: {compared}");
        }
    }
}
