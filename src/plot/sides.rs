//! What a run has on both sides of its events, where the file does not say it: by the equations, from the states there.

use super::error::PlotError;
use crate::case::{AnyCase, TrainCase};
use crate::compare::reference::{Physics, states_at_events};
use crate::friction::Law;
use crate::model::torsion::TorsionModel;
use crate::model::trains::ContactLaw;
use crate::model::{Mode, Parameters};
use crate::record::{Event, State};
use crate::results::ResultFile;

/// A channel before and after every event.
#[derive(Debug)]
pub(super) struct Sides {
    pub(super) before: Vec<f64>,
    pub(super) after: Vec<f64>,
}

impl Sides {
    /// Of each event with the mode before it; `of` is told the time just before or at the event.
    fn of(events: &[Event], first: Option<Mode>, of: impl Fn(f64, Mode, &State) -> f64) -> Sides {
        let (mut before, mut after) = (Vec::with_capacity(events.len()), Vec::with_capacity(events.len()));
        let mut mode = first.unwrap_or(Mode::SlipForward);
        for event in events {
            before.push(of(event.time.next_down().max(0.0), mode, &event.before));
            mode = event.mode_after;
            after.push(of(event.time, mode, &event.after));
        }
        Sides { before, after }
    }
}

/// The mode itself; `None` of every other channel.
pub(super) fn of_modes(events: &[Event], first: Option<Mode>, channel: &str) -> Option<Sides> {
    (channel == "mode").then(|| Sides::of(events, first, |_, mode, _| f64::from(mode as u8)))
}

/// A force, torque or energy of a brake, or its mode; `None` of what depends on more than the state.
pub(super) fn of_brake(brake: &Parameters, events: &[Event], first: Option<Mode>, channel: &str) -> Option<Sides> {
    let model = TorsionModel::new(brake);
    let axial = brake.axial;
    let force = brake.actuation.pieces();
    let pressing = move |state: &State| -axial.damping * state.z_dot - axial.stiffness * state.z;
    let normal_force = move |mode: Mode, state: &State| match mode {
        Mode::Separated => 0.0,
        _ => pressing(state).max(0.0),
    };
    let transmitted = |state: &State| model.transmitted_torque(&state.torsional().state());
    let sides = match channel {
        "applied_force" => Sides::of(events, first, |t, _, _| force.value(t)),
        "normal_force" => Sides::of(events, first, |_, mode, state| normal_force(mode, state)),
        "transmitted_torque" => Sides::of(events, first, |_, _, state| transmitted(state)),
        "friction_torque" => Sides::of(events, first, |_, mode, state| match mode {
            Mode::Separated | Mode::Engaged => 0.0,
            Mode::Stick => transmitted(state),
            Mode::SlipForward | Mode::SlipBackward => {
                let y = state.torsional().state();
                model.sliding_torque(f64::from(mode.sense()), &y, normal_force(mode, state))
            }
        }),
        "energy_kinetic" => Sides::of(events, first, |_, _, state| {
            let y = state.torsional().state();
            model.torsion.kinetic_energy(&y) + 0.5 * axial.mass * state.z_dot * state.z_dot
        }),
        "energy_elastic" => Sides::of(events, first, |_, _, state| {
            let y = state.torsional().state();
            model.torsion.elastic_energy(&y) + 0.5 * axial.stiffness * state.z * state.z
        }),
        _ => return of_modes(events, first, channel),
    };
    Some(sides)
}

/// A force or torque of two trains whose contact sticks, or their mode; `None` of what depends on more than the state, and of
/// what does not jump.
pub(super) fn of_trains(
    case: &TrainCase,
    file: &ResultFile,
    events: &[Event],
    first: Option<Mode>,
    channel: &str,
) -> Result<Option<Sides>, PlotError> {
    let torques = ["normal_force", "friction_torque", "transmitted_torque"];
    if !torques.contains(&channel) || case.parameters.contact != ContactLaw::StickSlip {
        return Ok(of_modes(events, first, channel));
    }
    let end = events.last().map_or(0.0, |event| event.time);
    let physics = Physics::new(AnyCase::Trains(Box::new(case.clone())), &[], end);
    let states = states_at_events(file, &physics, events)?;
    let trains = &case.parameters;
    let value = |t: f64, mode: Mode, state: &State, y: &[f64]| {
        let normal_force = match mode {
            Mode::Separated => 0.0,
            _ => physics.course.outside(t).normal_force.max(0.0),
        };
        match (channel, mode) {
            ("normal_force", _) => normal_force,
            ("friction_torque", Mode::Separated) => 0.0,
            ("friction_torque", Mode::SlipForward | Mode::SlipBackward) => {
                let mu = trains.law.coefficient(state.relative_velocity.abs());
                f64::from(mode.sense()) * mu * trains.radius * normal_force
            }
            _ => physics.transmitted(t, y),
        }
    };
    let (mut before, mut after) = (Vec::with_capacity(events.len()), Vec::with_capacity(events.len()));
    let mut mode = first.unwrap_or(Mode::SlipForward);
    for (event, (y_before, y_after)) in events.iter().zip(&states) {
        before.push(value(event.time.next_down().max(0.0), mode, &event.before, y_before));
        mode = event.mode_after;
        after.push(value(event.time, mode, &event.after, y_after));
    }
    Ok(Some(Sides { before, after }))
}
