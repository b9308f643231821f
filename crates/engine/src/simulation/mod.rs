//! Runs of a system, by the automaton or by the paper's procedure.
//!
//! | module | contents |
//! |---|---|
//! | `options` | methods, tolerances, recorded times |
//! | `simulate` | a run, from its start to its record |
//! | `rules` | effects of guards and time events |
//! | `regime` | where steps must resolve the fast modes |
//! | `plan` | solver and tolerances of each location |
//! | `closed_form` | stick and separation in closed form |
//! | `series`, `expansion` | the engine of `series`: Taylor series and Radau IIA |
//! | `course` | motion from a known state, within one mode |
//! | `carried`, `rounding` | derivatives and rounding that are carried along a run |
//! | `variation` | derivatives of events by parameters |
//! | `shot` | motion over a given time, with its derivatives |
//! | `sliding` | initial states, and sliding at a state |
//! | `portrait` | one period of a motion, densely |
//! | `readings`, `state_readings` | recorded values of a state |
//! | `observer`, `sampling`, `follower` | recorded times |
//! | `report` | end and cost of a run |
//! | `stepping` | explicit steps, and the engine of `rk4` |
//! | `procedure` | the paper's procedure |

mod carried;
mod closed_form;
mod course;
pub mod expansion;
mod follower;
mod foresight;
mod observer;
pub mod options;
mod plan;
pub mod portrait;
pub mod procedure;
mod readings;
mod regime;
mod report;
mod rounding;
mod rules;
pub mod sampling;
pub mod series;
mod shot;
pub mod simulate;
pub mod sliding;
mod state_readings;
pub mod stepping;
mod variation;

pub use crate::hybrid::{Excitation, MarginWatch, SystemDynamics, SystemLocation};
pub use carried::deviation_weights;
pub use closed_form::ClosedFormEngine;
pub use course::{Course, CourseQuantity, TrainPart, TrainSide};
pub use course::{TERMS, is_short};
pub(crate) use options::FORESEEN_STEPS;
pub use plan::single_method;
pub use portrait::Section;
pub use portrait::{PortraitPoint, portrait, position_of};
pub use shot::{Border, Margin, ShotPhase};
pub use shot::{Peak, Shot, WantedResults, shoot};
pub use simulate::natural_period;
pub use simulate::{Simulation, further, simulate, simulate_from, solver_settings};
pub use sliding::{moving_state, sliding, state_of_parts, stated_start, weights};
pub use state_readings::Further;
pub use variation::{MovedCases, MovedSystem, Variation, variation};

pub use options::{Around, Following, Method, OutputOptions, OutputWindow, SolverOptions};
pub use report::{Grazing, RunFailure, RunReport, SolverWork};

use crate::Error;
use crate::hybrid::{self, Limits, Rules, Start};
use observer::Recording;
use state_readings::StateReadings;
use std::sync::Arc;

fn automaton(
    dynamics: &Arc<SystemDynamics>,
    (rules, chatter_window): (&mut dyn Rules, f64),
    start: Start,
    solver: &SolverOptions,
    output: &OutputOptions,
    mut recording: Recording<'_, StateReadings<'_>>,
) -> (Result<(), Error>, RunReport) {
    // A user who sets the length or number of steps knows how many steps there are.
    let foresee = solver.max_steps.is_none() && solver.max_step.is_none() && solver.fixed_step.is_none();
    let limits = Limits {
        max_events: solver.max_events,
        chatter_window,
        max_steps: solver.max_steps.map(|steps| steps as u64),
        foreseen_steps: foresee.then_some(FORESEEN_STEPS),
    };
    let result = hybrid::run(dynamics, rules, start, output.end_time, limits, &mut recording);
    let result = match result {
        Ok(finish) if finish.interrupted => recording.in_time(finish.time, &finish.location).map(|()| finish),
        other => other,
    };
    // Pending rows are handed on even after a failure.
    let flushed = recording.flush();
    let mut report = recording.into_report();
    let result = result.and_then(|finish| flushed.map(|()| finish));
    let result = result.map(|finish| {
        report.end = finish.time;
        report.interrupted = finish.interrupted;
    });
    (result, report)
}
