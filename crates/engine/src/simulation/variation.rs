//! Derivatives of a run's events by parameters of its case.

use super::carried::{Carried, CarryingRules, MovedCopy, Passage, VariationColumn};
use super::simulate::prepared;
use super::state_readings::StateReadings;
use crate::Error;
use crate::hybrid::Start;
use crate::simulation::observer::Recording;
use crate::simulation::{Method, OutputOptions, RunFailure, RunReport, SolverOptions, automaton};
use nalgebra::DVector;
use std::sync::{Arc, Mutex, PoisonError};
use stickslip_system::model::equations::SystemEquations;
use stickslip_system::model::system::System;
use stickslip_system::record::{Event, EventDigest, NoRecorder};
use stickslip_system::watch::Watch;

/// A system with one parameter moved.
pub struct MovedSystem {
    /// System with the moved parameter.
    pub system: System,
    /// Threshold as in [`Run::of_system`](crate::Run::of_system), rad/s.
    pub threshold: f64,
    /// Weight per unit of the parameter. The weights of all copies sum to zero; the sum of weight times value is the
    /// derivative of the value.
    pub weight: f64,
    /// Weight of the test for a bend, see `MovedCopy::bend`.
    pub bend: f64,
}

/// A moved parameter.
pub struct MovedCases {
    /// Copies of the system.
    pub copies: Vec<MovedSystem>,
    /// Value of the parameter, if its rounding counts.
    pub rounded: Option<f64>,
}

/// Derivatives of a run.
pub struct Variation {
    /// Events of the run.
    pub events: Vec<Event>,
    /// Effect of small changes on each event. A d(time)/d(parameter) is NaN if the copies have another event.
    pub passages: Vec<Passage>,
    /// For each parameter, whether its copies begin in the run's mode.
    pub alike: Vec<bool>,
}

/// A moved parameter whose copies begin at `from` (s, with the state; `None`: at their own starts), without effect on
/// the initial state, and the starts of its copies.
pub(super) fn moved_number(
    system: &System,
    cases: &MovedCases,
    from: Option<(f64, &[f64])>,
    solver: &SolverOptions,
    end_time: f64,
) -> (VariationColumn, Vec<Start>) {
    let copy = |copy: &MovedSystem| {
        let (dynamics, rules, start) = prepared((&copy.system, copy.threshold), from, solver, end_time);
        let moved = MovedCopy::new((dynamics, rules), copy.weight, copy.bend);
        (moved, start)
    };
    let (copies, starts) = cases.copies.iter().map(copy).unzip();
    let differs = |copy: &MovedSystem| !alike_between_events(system, &copy.system);
    let column = VariationColumn {
        copies,
        in_equations: cases.copies.iter().any(differs),
        ..VariationColumn::of_state(DVector::zeros(SystemEquations::new(system).mechanical()))
    };
    (column, starts)
}

/// Whether two systems differ in kicks and initial state at most.
fn alike_between_events(one: &System, other: &System) -> bool {
    let other = System {
        kicks: one.kicks.clone(),
        initial: one.initial.clone(),
        ..other.clone()
    };
    *one == other
}

/// Runs the system by `series` with derivatives by each of the parameters `numbers`. `threshold` is
/// in rad/s.
///
/// # Errors
/// Errors of a run.
pub fn variation(
    (system, threshold): (&System, f64),
    numbers: &[MovedCases],
    solver: &SolverOptions,
    output: &OutputOptions,
    watch: &dyn Watch,
) -> Result<Variation, Box<RunFailure>> {
    let solver = SolverOptions {
        method: Method::Series,
        ..solver.clone()
    };
    let (dynamics, rules, start) = prepared((system, threshold), None, &solver, output.end_time);
    let mut alike = vec![true; numbers.len()];
    let mut columns = Vec::with_capacity(numbers.len());
    for (cases, alike) in numbers.iter().zip(&mut alike) {
        let (mut column, starts) = moved_number(system, cases, None, &solver, output.end_time);
        for (copy, begins) in cases.copies.iter().zip(starts) {
            *alike &= begins.location.mode == start.location.mode;
            for (slope, state) in column.slope.iter_mut().zip(&begins.state) {
                *slope += copy.weight * state;
            }
        }
        column.rounded = cases.rounded;
        columns.push(column);
    }
    let carried = Carried::new(dynamics.clone(), output.end_time, columns);
    let carried = Arc::new(Mutex::new(carried));
    let window = rules.chatter_window();
    let mut rules = CarryingRules::new(rules, carried.clone());
    let readings = StateReadings {
        dynamics: &dynamics,
        further: false,
    };
    let digest = EventDigest::new(None);
    let mut nobody = NoRecorder;
    let recording = Recording::new(readings, digest, (&solver, output), &mut nobody, watch, &start);
    let (result, report): (Result<(), Error>, RunReport) =
        automaton(&dynamics, (&mut rules, window), start, &solver, output, recording);
    let report = report.ended(result)?;
    drop(rules);
    let carried = Arc::into_inner(carried).map(|carried| carried.into_inner().unwrap_or_else(PoisonError::into_inner));
    Ok(Variation {
        events: report.events,
        passages: carried.map_or_else(Vec::new, Carried::into_passages),
        alike,
    })
}
