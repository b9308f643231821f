//! One period of a motion at close intervals, from a state of a run.

use super::plan::SystemPlan;
use super::rules::SystemRules;
use super::{SystemDynamics, SystemLocation};
use crate::Error;
use crate::hybrid::{self, Limits, Observer, SegmentReport, Start};
use crate::simulation::options::{Method, SolverOptions};
use std::sync::Arc;
use stickslip_system::model::Mode;
use stickslip_system::model::equations::{Engagement, Side};
use stickslip_system::model::system::System;
use stickslip_system::record::EventKind;

/// Start of a period: an event, with the state after it.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    /// Time of the event, s.
    pub time: f64,
    /// Mode after the event.
    pub mode: Mode,
    /// Sign of omega_r after the event or, at rest, of its later direction.
    pub sense: i8,
    /// A recorder's further values after the event.
    pub further: Vec<f64>,
}

/// A state within the period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PortraitPoint {
    /// Time, s.
    pub time: f64,
    /// Mode of the contact.
    pub mode: Mode,
    /// Position of a tied surface relative to its far end, rad. In a free train with shafts it is the first twist,
    /// otherwise the slip displacement since the start of the period.
    pub position: f64,
    /// Rate of the position, rad/s.
    pub velocity: f64,
    /// omega_r, rad/s.
    pub relative_velocity: f64,
    /// Rate of omega_r, rad/s^2.
    pub relative_acceleration: f64,
}

/// One period.
#[derive(Debug, Clone, PartialEq)]
pub struct Portrait {
    /// Points in order of time. Events appear twice, with the states before and after.
    pub points: Vec<PortraitPoint>,
    /// Meaning of [`PortraitPoint::position`]: "stator", "rotor", "stator twist", "rotor twist", or "slip".
    pub of: &'static str,
}

struct Points<'a> {
    dynamics: &'a SystemDynamics,
    points: Vec<PortraitPoint>,
    start: f64,
    interval: f64,
    count: f64,
    end: f64,
}

/// Displayed position: a tied surface, or the first twist of a free train, of the stator if possible. Its name, the
/// number of summed shafts, and the sign of the sum.
pub(super) fn shown(dynamics: &SystemDynamics) -> Option<(&Side, &'static str, usize, f64)> {
    let system = &dynamics.system;
    let sides = [&system.stator, &system.rotor];
    let tied = sides.into_iter().find(|side| side.speed.is_none() && side.shafts() > 0);
    let twisted = sides.into_iter().find(|side| side.shafts() > 0);
    let stator = |side: &Side| side.sign < 0.0;
    match (tied, twisted) {
        (Some(side), _) => {
            let name = if stator(side) { "stator" } else { "rotor" };
            Some((side, name, side.shafts(), -side.sign))
        }
        (None, Some(side)) => {
            let name = if stator(side) { "stator twist" } else { "rotor twist" };
            Some((side, name, 1, 1.0))
        }
        (None, None) => None,
    }
}

pub(super) fn position(dynamics: &SystemDynamics, y: &[f64]) -> Option<(f64, f64)> {
    let (side, _, shafts, sign) = shown(dynamics)?;
    Some((0..shafts).fold((0.0, 0.0), |(x, v), i| {
        (x + sign * side.twist(i, y), v + sign * side.twist_rate(i, y))
    }))
}

/// [`Portrait::of`] for a system.
pub fn position_of(system: &System) -> &'static str {
    shown(&SystemDynamics::new(system, 0.0)).map_or("slip", |shown| shown.1)
}

impl Points<'_> {
    fn add(&mut self, t: f64, location: &SystemLocation, y: &[f64]) {
        let system = &self.dynamics.system;
        let outside = self.dynamics.outside(location, t);
        let stuck = location.mode == Mode::Stick;
        let w = if stuck {
            0.0
        } else {
            system.relative_velocity(&outside, y)
        };
        let (position, velocity) = position(self.dynamics, y).unwrap_or((y[system.slip], w));
        let relative_acceleration = if stuck {
            0.0
        } else {
            system.relative_acceleration(location.mode, location.sign(), location.piece, &outside, y)
        };
        self.points.push(PortraitPoint {
            time: t,
            mode: location.mode,
            position,
            velocity,
            relative_velocity: w,
            relative_acceleration,
        });
    }
}

impl Observer for Points<'_> {
    fn next_sample_time(&self) -> f64 {
        (self.start + self.count * self.interval).min(self.end)
    }

    fn sample(&mut self, t: f64, location: &SystemLocation, y: &[f64]) -> Result<(), Error> {
        if t >= self.end {
            self.count = f64::INFINITY;
            self.end = f64::INFINITY;
        }
        self.count += 1.0;
        self.add(t, location, y);
        Ok(())
    }

    fn event(
        &mut self,
        t: f64,
        _: EventKind,
        before: (&SystemLocation, &[f64]),
        after: (&SystemLocation, &[f64]),
    ) -> Result<(), Error> {
        self.add(t, before.0, before.1);
        self.add(t, after.0, after.1);
        Ok(())
    }

    fn segment(&mut self, _: &SegmentReport) -> Result<(), Error> {
        Ok(())
    }
}

/// The state from a recorder's further values; slip, losses and work start at zero.
pub(super) fn state_of(dynamics: &SystemDynamics, further: &[f64]) -> Vec<f64> {
    let system = &dynamics.system;
    let mut y = vec![0.0; system.dimension];
    let mut values = further.iter().copied();
    for side in [&system.rotor, &system.stator] {
        for k in 0..2 * side.shafts() {
            y[side.twists + k] = values.next().unwrap_or(f64::NAN);
        }
        for i in 0..side.inertia.len() {
            let speed = values.next().unwrap_or(f64::NAN);
            if let Some(index) = side.speed.filter(|_| i + 1 == side.inertia.len()) {
                y[index] = speed;
            }
        }
    }
    if let Engagement::Bristles(.., at) = system.engagement {
        y[at] = values.next().unwrap_or(f64::NAN);
    }
    y
}

/// Intervals in a turn of the fastest mode or signal. The error of a cubic is (2 pi/2000)^4/384 of an amplitude,
/// 3e-13.
const INTERVALS_PER_TURN: f64 = 2000.0;

const INTERVALS: (f64, f64) = (4000.0, 400_000.0);

/// The motion from `section` for `period` (s) by Taylor series, at equal intervals and at its events. `threshold` is
/// in rad/s.
///
/// # Errors
/// Errors of a run.
pub fn portrait(system: &System, threshold: f64, section: &Section, period: f64) -> Result<Portrait, Error> {
    let dynamics = Arc::new(SystemDynamics::new(system, threshold));
    let state = state_of(&dynamics, &section.further);
    let stretch = dynamics.excitation.stretch(section.time);
    let fastest = dynamics.rates.fastest.max(dynamics.excitation.fastest(stretch));
    let turns = period * fastest / std::f64::consts::TAU;
    let intervals = (INTERVALS_PER_TURN * turns).clamp(INTERVALS.0, INTERVALS.1).ceil();
    let options = SolverOptions {
        method: Method::Series,
        ..SolverOptions::default()
    };
    let plan = SystemPlan::new(system, &dynamics, &state, &options);
    let end = section.time + period;
    let mut rules = SystemRules::new(dynamics.clone(), system, plan, section.time, end);
    let mut location = SystemLocation {
        sense: section.sense,
        ..SystemLocation::new(section.mode, stretch)
    };
    let outside = dynamics.outside(&location, section.time);
    location.piece = dynamics
        .system
        .piece_of(dynamics.system.relative_velocity(&outside, &state));
    let mut points = Points {
        dynamics: &dynamics,
        points: Vec::new(),
        start: section.time,
        interval: period / intervals,
        count: 0.0,
        end,
    };
    let start = Start {
        time: section.time,
        location,
        state,
    };
    let limits = Limits {
        max_events: 10_000,
        chatter_window: rules.chatter_window(),
        max_steps: None,
        foreseen_steps: Some(super::FORESEEN_STEPS),
    };
    hybrid::run(&dynamics, &mut rules, start, end, limits, &mut points)?;
    Ok(Portrait {
        points: points.points,
        of: shown(&dynamics).map_or("slip", |shown| shown.1),
    })
}
