//! Derivatives of a run's events by parameters of its case: [`hybrid::Carried`](crate::hybrid::Carried) for a system.

use super::dynamics::{GUARD_STOPPING, SystemDynamics, SystemLocation};
use super::simulate::prepared;
use super::state_readings::StateReadings;
use crate::hybrid::{
    Carried, CarryingRules, Fired, Measures, MovedCopy, MovedNumber, Passage, Replaced, RunError, Transition,
};
use crate::simulation::observer::Recording;
use crate::simulation::{Method, OutputOptions, Progress, RunFailure, RunReport, SolverOptions, automaton};
use nalgebra::DVector;
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, PoisonError};
use stickslip_system::model::Mode;
use stickslip_system::model::equations::{Engagement, Outside, SystemEquations};
use stickslip_system::model::slow_manifold::{Slip, has_slow_manifold, on_slow_manifold, slow_momenta};
use stickslip_system::model::system::System;
use stickslip_system::record::{EventDigest, EventKind, Recorder};

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
    /// Effect of small changes on each event. A d(time)/d(parameter) is NaN if the copies have another event.
    pub events: Vec<Passage>,
    /// For each parameter, whether its copies begin in the run's mode.
    pub alike: Vec<bool>,
}

/// Factors that make the components of a deviation comparable: for a twist the frequency of its inertia on its shaft,
/// rad/s; otherwise 1.
pub fn deviation_weights(system: &SystemEquations) -> Vec<f64> {
    let mut weights = vec![1.0; system.mechanical()];
    for side in [&system.rotor, &system.stator] {
        for i in 0..side.shafts() {
            weights[side.twists + 2 * i] = side.own_frequency(i);
        }
    }
    weights
}

/// Growth starts at a loss of stability.
pub(super) struct GrowthContact {
    dynamics: Arc<SystemDynamics>,
    weights: Vec<f64>,
}

impl GrowthContact {
    pub(super) fn new(dynamics: &Arc<SystemDynamics>) -> GrowthContact {
        GrowthContact {
            dynamics: dynamics.clone(),
            weights: deviation_weights(&dynamics.system),
        }
    }
}

impl Measures<SystemLocation, EventKind> for GrowthContact {
    fn weights(&self) -> &[f64] {
        &self.weights
    }

    fn derives_apart(&self, location: &SystemLocation) -> bool {
        location.mode == Mode::Stick
    }

    fn starts_growth(&self, kind: &EventKind) -> bool {
        *kind == EventKind::Destabilised
    }

    fn carry_over(
        &self,
        location: &SystemLocation,
        t: f64,
        fired: Option<(Fired, f64)>,
        transitions: &[Transition<EventKind, SystemLocation>],
        change: &mut [f64],
    ) {
        let reaches = |mode: Mode| location.mode != mode && transitions.iter().any(|one| one.location.mode == mode);
        let joins = match (fired, location.mode) {
            (Some(_), Mode::Stick) => true,
            (Some(_), Mode::Engaged) => false,
            (Some((fired, _)), _) => fired.contains(GUARD_STOPPING),
            (None, _) => reaches(Mode::Stick),
        };
        let system = &self.dynamics.system;
        if joins {
            // The map is linear in the state and the speeds of the ends.
            let dt = fired.map_or(0.0, |fired| fired.1);
            system.join(&self.dynamics.outside_rates(location, t).scaled(dt), change);
        }
        if let (Engagement::Bristles(.., at), true) = (&system.engagement, reaches(Mode::Separated)) {
            change[*at] = 0.0;
        }
    }

    /// A kick is added to the slow manifold, at the point with the state's momentum.
    fn replaced(
        &self,
        location: &SystemLocation,
        t: f64,
        y: &[f64],
        transitions: &[Transition<EventKind, SystemLocation>],
    ) -> Option<Replaced> {
        let SystemDynamics { system, excitation, .. } = &*self.dynamics;
        let kick = transitions.iter().find(|one| one.kind == Some(EventKind::Kick))?;
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

/// Whether two systems differ in kicks and initial state at most.
pub(super) fn alike_between_events(one: &System, other: &System) -> bool {
    let other = System {
        kicks: one.kicks.clone(),
        initial: one.initial.clone(),
        ..other.clone()
    };
    *one == other
}

/// Runs the system by `series`, into `recorder`, with derivatives by each of the parameters `numbers`. `threshold` is
/// in rad/s.
///
/// # Errors
/// Errors of a run.
pub fn variation(
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
    let measures = Box::new(GrowthContact::new(&dynamics));
    let mechanical = dynamics.system.mechanical();
    let carried = Carried::new(dynamics.clone(), measures, mechanical, output.end_time, columns);
    let carried = Arc::new(Mutex::new(carried));
    let mut rules = CarryingRules::new(rules, carried.clone());
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
