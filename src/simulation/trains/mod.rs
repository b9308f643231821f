//! Two trains run by the automaton: which solver where, and what is recorded.
//!
//! | module | what it is |
//! |---|---|
//! | `excitation` | signals and normal force as functions of time |
//! | `dynamics` | locations, guards and equations for the automaton |
//! | `closed_form` | stick and separation in closed form |
//! | `rules` | what happens at guards and time events |
//! | `regime` | where steps have to resolve the fast modes |
//! | `plan` | which solver integrates what, how accurately |
//! | `series`, `expansion` | the trains' own solver, by Taylor series |
//! | `readings` | what is recorded of a state |
//! | `portrait` | one period of a motion, densely |
//! | `variation` | what numbers of a case do to its events |
//! | `course` | the motion from a known state on, within one mode |

mod closed_form;
mod course;
mod dynamics;
mod excitation;
mod expansion;
mod plan;
mod portrait;
mod readings;
mod regime;
mod rules;
mod series;
mod variation;

pub(crate) use course::{Course, Quantity, TERMS, is_short};
pub use course::{Part, Which};
pub use dynamics::{TrainDynamics, TrainLocation};
pub(crate) use excitation::Excitation;
pub(crate) use plan::method_without_series;
pub(crate) use portrait::{PortraitPoint, Section, portrait, position_of};
pub use readings::Further;
pub(crate) use variation::{MovedTrains, variation};

use super::options::{OutputOptions, SolverOptions};
use super::readings::Readings as _;
use super::report::{Progress, RunFailure, RunReport};
use super::{CHATTER_COUNT, FORESEEN_STEPS, automaton, foreseen, observer::Recording};
use crate::hybrid::Start;
use crate::model::BreakawayTest;
use crate::model::trains::Trains;
use crate::model::trains::system::{Side, TrainSystem};
use crate::record::{EventDigest, NoRecorder, Recorder};
use plan::TrainPlan;
use readings::TrainReadings;
use rules::TrainRules;
use std::f64::consts::TAU;
use std::ops::ControlFlow;
use std::sync::Arc;

/// What the state of a case has beyond [`State`](crate::record::State), in the order in which a recorder gets it.
pub(crate) fn further(trains: &Trains) -> Vec<Further> {
    readings::further_names(&TrainSystem::new(trains))
}

/// The period (s) by which samples of a case are dense or sparse; `None` where nothing moves by itself.
#[cfg(feature = "plot")]
pub(crate) fn natural_period(trains: &Trains) -> Option<f64> {
    TrainDynamics::new(trains, 0.0).natural_period()
}

/// The state at t = 0.
fn start(trains: &Trains, dynamics: &TrainDynamics) -> Vec<f64> {
    let system = &dynamics.system;
    let mut y = vec![0.0; system.dimension];
    let outside = dynamics.excitation.at(dynamics.excitation.stretch(0.0), 0.0);
    let initial = &trains.initial;
    let sides = [
        (
            &system.rotor,
            &outside.rotor,
            &initial.rotor_twist,
            &initial.rotor_speed,
        ),
        (
            &system.stator,
            &outside.stator,
            &initial.stator_twist,
            &initial.stator_speed,
        ),
    ];
    for (side, driving, twists, speeds) in sides {
        for i in 0..side.shafts() {
            let outer = speeds.get(i + 1).copied().unwrap_or(driving.speed);
            y[side.twists + 2 * i] = twists[i];
            y[side.twists + 2 * i + 1] = side.sign * (outer - speeds[i]);
        }
        if let (Some(index), Some(&speed)) = (side.speed, speeds.last()) {
            y[index] = speed;
        }
    }
    if system.rotor.speed.is_none() && system.stator.speed.is_none() {
        let twists = |side: &Side| -> f64 { (0..side.shafts()).map(|i| side.sign * side.twist(i, &y)).sum() };
        y[system.slip] = twists(&system.stator) - twists(&system.rotor);
    }
    y
}

/// Integrates one case of trains from t = 0 to the end time of `output`; the counterpart of [`super::simulate`], with the same
/// contract. `threshold` (rad/s) is what counts as a stick of a contact without one.
pub(crate) fn simulate(
    trains: &Trains,
    threshold: f64,
    solver: &SolverOptions,
    output: &OutputOptions,
    recorder: &mut dyn Recorder,
    control: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<RunReport, Box<RunFailure>> {
    let dynamics = Arc::new(TrainDynamics::new(trains, threshold));
    let mut state = start(trains, &dynamics);
    let plan = TrainPlan::new(trains, &dynamics, &state, solver);
    let mut rules = TrainRules::new(dynamics.clone(), trains, plan, 0.0, output.end_time);
    let location = rules.initial_location(&mut state);
    let readings = TrainReadings { dynamics: &dynamics };
    let initial_energy = {
        let channels = readings.channels(0.0, &location, &state);
        channels.energy_kinetic + channels.energy_elastic
    };
    let digest = match dynamics.natural_period() {
        Some(period) if dynamics.system.twice_resistance.is_some() => EventDigest::watching(period),
        _ => EventDigest::without_instability(),
    };
    let stores_motion = recorder.stores_motion();
    let mut recording = Recording::new(readings, digest, output, recorder, control, initial_energy);
    recording.limit_wall_time(solver.max_wall_time);
    let foreseen = foreseen(output, solver, stores_motion, |solver, output| {
        let mut go_on = |_| ControlFlow::Continue(());
        simulate(trains, threshold, solver, output, &mut NoRecorder, &mut go_on)
    });
    let shortest = TAU * dynamics.unit(0);
    let periods = (dynamics.natural_period().unwrap_or(shortest), shortest);
    recording.follow(output, dynamics.system.dimension, periods, solver.rtol, &foreseen);
    let start = Start {
        time: 0.0,
        location,
        state,
    };
    let (result, mut report) = automaton(&dynamics, &mut rules, start, solver, output, recording);
    report.stopped_smoothly = rules.stopped_smoothly();
    report.one_sided_test = trains.breakaway_test != BreakawayTest::Transmitted;
    report.count_kicks(trains.kicks.len(), rules.kicks_never_given());
    report.ended(result)
}
