//! A system run by the automaton, or by the procedure of the paper: which solver where, and what is recorded.
//!
//! | module | what it is |
//! |---|---|
//! | `options` | methods, tolerances, and which times are recorded |
//! | `simulate` | a run, from its start to its record |
//! | `excitation` | signals and normal force as functions of time |
//! | `dynamics` | locations, guards and equations for the automaton |
//! | `rules` | what happens at guards and time events |
//! | `regime` | where steps have to resolve the fast modes |
//! | `plan` | which solver integrates what, how accurately |
//! | `closed_form` | stick and separation in closed form |
//! | `series`, `expansion` | the engine of `series`: Taylor series and Radau IIA |
//! | `ensemble` | runs side by side |
//! | `course` | the motion from a known state on, within one mode |
//! | `variation` | what numbers of a case do to its events |
//! | `shot` | the motion over a time from a state, with its derivatives |
//! | `sliding` | states that a motion starts from, and sliding at a state |
//! | `portrait` | one period of a motion, densely |
//! | `readings`, `state_readings` | what is recorded of a state |
//! | `observer`, `sampling`, `follower` | when it is recorded |
//! | `report` | how a run ended, and what it cost |
//! | `fixed_step` | how long fixed steps may be |
//! | `procedure`, `runge_kutta` | the procedure of the paper |

mod closed_form;
mod course;
mod dynamics;
pub mod ensemble;
mod excitation;
pub mod expansion;
pub mod fixed_step;
mod follower;
mod foresight;
mod observer;
pub mod options;
mod plan;
mod portrait;
pub mod procedure;
mod readings;
mod regime;
mod report;
mod rules;
mod runge_kutta;
pub mod sampling;
mod series;
mod shot;
mod simulate;
mod sliding;
mod state_readings;
mod variation;

pub(crate) use course::{Course, Quantity, TERMS, is_short};
pub use course::{Part, Which};
pub use dynamics::{SystemDynamics, SystemLocation, Watch};
pub use excitation::Excitation;
pub(crate) use options::FORESEEN_STEPS;
pub(crate) use plan::single_method;
pub(crate) use portrait::{PortraitPoint, Section, portrait, position_of};
pub use shot::Border;
pub(crate) use shot::{Margin, Peak, Phase, Shot, ShotError, Wanted, shoot};
pub use simulate::natural_period;
pub(crate) use simulate::{Problem, further, simulate, simulate_from, solver_settings};
pub(crate) use sliding::{moving_state, sliding, state_of_parts, stated_start, weights};
pub use state_readings::Further;
pub(crate) use variation::{MovedCases, MovedSystem, deviation_weights, variation};

pub use options::{Around, Following, Method, OutputOptions, OutputWindow, SolverOptions};
pub use report::{Grazing, Progress, RunFailure, RunReport, SolverWork};

use crate::hybrid::{self, Dynamics, Limits, Rules, RunError, Start};
use crate::record::EventKind;
use observer::Recording;
use readings::Readings;
use std::sync::Arc;

/// This many transitions within a twentieth of the natural period are chattering.
const CHATTER_COUNT: usize = 32;

/// Runs the automaton within the budgets of `solver`, and closes the record.
fn automaton<D, R, V>(
    dynamics: &Arc<D>,
    rules: &mut R,
    start: Start<D::Location>,
    solver: &SolverOptions,
    output: &OutputOptions,
    mut recording: Recording<'_, V>,
) -> (Result<(), RunError>, RunReport)
where
    D: Dynamics<Location = V::Place>,
    R: Rules<D, Kind = EventKind>,
    V: Readings,
{
    // Who says how long the steps are, or how many, knows how many that makes.
    let foresee = solver.max_steps.is_none() && solver.max_step.is_none() && solver.fixed_step.is_none();
    let limits = Limits {
        max_events: solver.max_events,
        chatter_count: CHATTER_COUNT,
        max_steps: solver.max_steps.map(|steps| steps as u64),
        foreseen_steps: foresee.then_some(FORESEEN_STEPS),
    };
    let result = hybrid::run(dynamics, rules, start, output.end_time, limits, &mut recording);
    let result = match result {
        Ok(finish) if finish.interrupted => recording.in_time(finish.time, &finish.location).map(|()| finish),
        other => other,
    };
    // What waits is handed on however the run has ended.
    let flushed = recording.flush();
    let mut report = recording.into_report();
    let result = result.and_then(|finish| match flushed {
        Ok(()) => Ok(finish),
        Err(error) => Err(RunError::observed(error, || dynamics.describe(&finish.location))),
    });
    let result = result.map(|finish| {
        report.end = finish.time;
        report.interrupted = finish.interrupted;
    });
    (result, report)
}
