//! Effects of guards and time events of a system.

use super::closed_form::ClosedFormEngine;
use super::foresight::{Foresight, LONG};
use super::plan::SystemPlan;
use super::regime::Regimes;
use super::series::TaylorEngine;
use super::stepping::FixedSteps;
use crate::hybrid::dynamics::{GUARD_FORWARD, MarginWatch, SystemDynamics, SystemLocation, VELOCITY_NOISE, Watched};
use crate::hybrid::{ChosenSolver, Engine, Fired, Rules, SolverKind, Transition};
use std::sync::Arc;
use stickslip_system::friction::Law;
use stickslip_system::model::axial::{ChangeCause, ContactChange};
use stickslip_system::model::equations::Engagement;
use stickslip_system::model::system::{Kick, KickSide, System};
use stickslip_system::model::{KickTime, Mode};
use stickslip_system::record::EventKind;

#[derive(Clone)]
pub(super) struct SystemRules {
    dynamics: Arc<SystemDynamics>,
    plan: SystemPlan,
    end_time: f64,
    kicks: Vec<(f64, Kick)>,
    next_kick: usize,
    pub waiting_kicks: Vec<Kick>,
    next_corner: usize,
    /// Next change of the contact. The outer `None` means that it has not been searched yet.
    contact_change: Option<Option<ContactChange>>,
    departing: bool,
    /// `regimes` is for sliding that slows down by itself, `foresight` for other systems. With neither, all steps
    /// resolve all modes.
    regimes: Option<Regimes>,
    foresight: Option<Foresight>,
    /// Whether the first stop ended smooth sliding, on which rounding does not grow.
    pub stopped_smoothly: bool,
}

impl SystemRules {
    pub fn new(dynamics: Arc<SystemDynamics>, system: &System, plan: SystemPlan, start: f64, end_time: f64) -> Self {
        let timed = |kick: &Kick| Some((*kick.time.at()?, kick.clone()));
        let mut kicks: Vec<_> = system.kicks.iter().filter_map(timed).collect();
        kicks.sort_by(|a, b| a.0.total_cmp(&b.0));
        let waiting = system.kicks.iter().filter(|kick| kick.time == KickTime::Instability);
        let corners = dynamics.excitation.corners();
        SystemRules {
            // A motion from later than t = 0 has passed its loss of stability.
            waiting_kicks: waiting.filter(|_| start == 0.0).cloned().collect(),
            next_kick: kicks.iter().filter(|kick| kick.0 < start).count(),
            next_corner: corners.iter().filter(|&&corner| corner <= start).count(),
            regimes: None,
            foresight: None,
            stopped_smoothly: false,
            dynamics,
            plan,
            end_time,
            kicks,
            contact_change: None,
            departing: start == 0.0,
        }
    }

    pub fn resolving_all(self) -> Self {
        SystemRules {
            regimes: None,
            foresight: None,
            ..self
        }
    }

    /// Location at t = 0. Surfaces of equal speed are joined in the state `y`.
    pub fn initial_location(&mut self, y: &mut [f64]) -> SystemLocation {
        let mut location = self.blank(0.0);
        if self.dynamics.excitation.starts_closed() {
            location = self.in_contact(&location, 0.0, y);
        }
        // Nothing has excited the fast modes: the first decision is made at once.
        self.look_ahead();
        location
    }

    fn look_ahead(&mut self) {
        self.regimes = self.plan.regimes(self.end_time);
        let kicks = self.kicks.iter().map(|kick| kick.0);
        let looks_ahead = self.plan.looks_ahead(LONG);
        let foresight = looks_ahead.then(|| Foresight::new(&self.dynamics, kicks, self.end_time));
        self.foresight = foresight.flatten();
    }

    /// Location of a run that begins in a closed contact later than t = 0. Timed kicks up to `t` (s), and kicks that
    /// wait for a loss of stability, have been given.
    pub fn location_at(&mut self, t: f64, y: &mut [f64]) -> SystemLocation {
        self.next_kick = self.kicks.partition_point(|kick| kick.0 <= t);
        self.waiting_kicks.clear();
        self.departing = false;
        self.look_ahead();
        self.in_contact(&self.blank(t), t, y)
    }

    fn blank(&self, t: f64) -> SystemLocation {
        let watched = self.dynamics.system.twice_resistance.is_some();
        SystemLocation {
            watch: if watched { MarginWatch::Stable } else { MarginWatch::Off },
            ..SystemLocation::new(Mode::Separated, self.dynamics.excitation.stretch(t))
        }
    }

    fn entered(&mut self, location: &SystemLocation, mode: Mode, t: f64, y: &[f64]) -> SystemLocation {
        let mut location = SystemLocation {
            mode,
            sense: mode.sense(),
            piece: 0,
            slow: false,
            ..*location
        };
        if mode == Mode::Stick {
            location.watch = MarginWatch::Off;
        }
        if mode == Mode::Stick || mode == Mode::Separated {
            self.plan_steps(&mut location, t, y);
            return location;
        }
        let system = &self.dynamics.system;
        let speed = system.relative_velocity(&self.dynamics.outside(&location, t), y).abs();
        location.piece = system.piece_of(speed);
        if mode == Mode::Engaged {
            location.sense = self.dynamics.side(&location, t, y);
            location.slow = speed < self.dynamics.threshold;
        }
        self.plan_steps(&mut location, t, y);
        location
    }

    /// A twentieth of the natural period, s.
    pub fn chatter_window(&self) -> f64 {
        // Chains without a spring have no period of their own.
        (0.05 * self.plan.period).min(CHATTER_SHARE * self.end_time)
    }

    fn plan_steps(&mut self, location: &mut SystemLocation, t: f64, y: &[f64]) {
        if let Some(regimes) = &mut self.regimes {
            regimes.enter(location, t, y);
        }
        if let Some(foresight) = &mut self.foresight {
            foresight.enter(location, t);
        }
    }

    /// Location of a closing contact: slip in the sense of the relative velocity. If this velocity is only rounding,
    /// it is removed from the state, and the stick test decides.
    fn in_contact(&mut self, location: &SystemLocation, t: f64, y: &mut [f64]) -> SystemLocation {
        let dynamics = self.dynamics.clone();
        let system = &dynamics.system;
        let outside = dynamics.outside(location, t);
        let w = system.relative_velocity(&outside, y);
        let mode = if dynamics.is_engaged() {
            Mode::Engaged
        } else if w.abs() > VELOCITY_NOISE * system.relative_velocity_terms(&outside, y) {
            Mode::sliding(w)
        } else {
            system.join(&outside, y);
            self.settle(location, t, y)
        };
        self.entered(location, mode, t, y)
    }

    fn settle(&self, location: &SystemLocation, t: f64, y: &[f64]) -> Mode {
        let system = &self.dynamics.system;
        let outside = self.dynamics.outside(location, t);
        let torque = system.transmitted_torque(&outside, y);
        let limit = system.breakaway_torque(torque, outside.normal_force.max(0.0));
        if torque.abs() <= limit.max(self.dynamics.torque_noise()) {
            Mode::Stick
        } else {
            Mode::sliding(torque)
        }
    }

    fn stop(&mut self, location: &SystemLocation, t: f64, y: &[f64]) -> Transition {
        let mut joined = y.to_vec();
        let outside = self.dynamics.outside(location, t);
        self.dynamics.system.join(&outside, &mut joined);
        let mode = self.settle(location, t, &joined);
        // The speed only touches zero if the torque continues in the same sense.
        if mode == location.mode {
            return Transition::new(None, SystemLocation { piece: 0, ..*location }, joined);
        }
        let location = self.entered(location, mode, t, &joined);
        let kind = if mode == Mode::Stick {
            EventKind::Stick
        } else {
            EventKind::Reversal
        };
        Transition::new(kind, SystemLocation { piece: 0, ..location }, joined)
    }

    /// Transition after a jump of omega_r. A contact without stick has the event of its threshold if the jump has
    /// crossed it.
    fn after_jump(&mut self, location: &SystemLocation, t: f64, y: &[f64]) -> Option<Transition> {
        let outside = self.dynamics.outside(location, t);
        let system = &self.dynamics.system;
        let w = system.relative_velocity(&outside, y);
        // Rounding in a jump of both surfaces is no relative jump.
        let rests = w.abs() <= VELOCITY_NOISE * system.relative_velocity_terms(&outside, y);
        match location.mode {
            Mode::Separated => None,
            Mode::Engaged => {
                let slow = w.abs() < self.dynamics.threshold;
                (slow != location.slow)
                    .then(|| Transition::new(crossing(slow), SystemLocation { slow, ..*location }, y.to_vec()))
            }
            Mode::Stick => (!rests).then(|| {
                Transition::new(
                    EventKind::Slip,
                    self.entered(location, Mode::sliding(w), t, y),
                    y.to_vec(),
                )
            }),
            _ if location.sign() * w > 0.0 => None,
            _ if w == 0.0 => Some(self.stop(location, t, y)),
            _ => Some(Transition::new(
                EventKind::Reversal,
                self.entered(location, Mode::sliding(w), t, y),
                y.to_vec(),
            )),
        }
    }

    fn corner(&mut self, location: &SystemLocation, t: f64, y: &[f64]) -> Vec<Transition> {
        let corners = self.dynamics.excitation.corners();
        while corners.get(self.next_corner).is_some_and(|&corner| corner <= t) {
            self.next_corner += 1;
        }
        let mut after = SystemLocation {
            stretch: self.dynamics.excitation.stretch(t),
            ..*location
        };
        let (before, behind) = (self.dynamics.outside(location, t), self.dynamics.outside(&after, t));
        let mut state = y.to_vec();
        let jumps = [
            behind.rotor.speed - before.rotor.speed,
            behind.stator.speed - before.stator.speed,
        ];
        // Rounding between two stretches is no jump.
        let jumps = [(jumps[0], behind.rotor.speed), (jumps[1], behind.stator.speed)].map(|(jump, speed)| {
            if jump.abs() > JUMP * speed.abs().max(jump.abs() / 2.0) {
                jump
            } else {
                0.0
            }
        });
        self.dynamics.system.rotor.jerk(jumps[0], &mut state);
        self.dynamics.system.stator.jerk(jumps[1], &mut state);
        let jumped = jumps != [0.0, 0.0];
        if location.mode == Mode::Engaged || location.mode.sense() != 0 && jumped {
            after = SystemLocation {
                slow: location.slow,
                ..self.entered(&after, location.mode, t, &state)
            };
        }
        if let Some(regimes) = &mut self.regimes {
            regimes.pass_corner(&mut after, t, &state, location.resolved);
        }
        if let Some(foresight) = &mut self.foresight {
            foresight.enter(&mut after, t);
        }
        let mut transitions = vec![Transition::new(EventKind::Corner, after, state.clone())];
        if jumped {
            transitions.extend(self.after_jump(&after, t, &state));
        }
        transitions
    }

    fn kick(&mut self, location: &SystemLocation, t: f64, y: &[f64], kick: &Kick) -> Vec<Transition> {
        let dynamics = self.dynamics.clone();
        let system = &dynamics.system;
        let rigid = match kick.on {
            KickSide::Both => false,
            KickSide::Rotor => system.rotor.inertia.is_empty(),
            KickSide::Stator => system.stator.inertia.is_empty(),
        };
        let delta = if rigid { 0.0 } else { kick.relative_velocity };
        let on_manifold = self.regimes.as_ref();
        let on_manifold = on_manifold.and_then(|regimes| regimes.before_kick(location, t, y, delta));
        let mut state = on_manifold.unwrap_or_else(|| y.to_vec());
        let in_stick = location.mode == Mode::Stick;
        system.kick(kick.on, delta, in_stick, &mut state);
        let mut after = *location;
        if location.mode == Mode::Engaged {
            after = SystemLocation {
                slow: location.slow,
                ..self.entered(location, Mode::Engaged, t, &state)
            };
        } else if location.mode.sense() != 0 {
            let w = system.relative_velocity(&dynamics.outside(location, t), &state);
            after.piece = system.piece_of(w);
            after.resolved = true;
            if location.sign() * w > 0.0 {
                self.plan_steps(&mut after, t, &state);
            }
        } else {
            self.plan_steps(&mut after, t, &state);
        }
        let mut transitions = vec![Transition::new(EventKind::Kick, after, state.clone())];
        if !in_stick {
            transitions.extend(self.after_jump(&after, t, &state));
        }
        transitions
    }

    fn stability_changes(&mut self, location: &mut SystemLocation, t: f64, state: &mut [f64]) -> Vec<Transition> {
        let is_lost = location.watch == MarginWatch::Stable;
        let (kind, watch) = if is_lost {
            (EventKind::Destabilised, MarginWatch::Unstable)
        } else {
            (EventKind::Restabilised, MarginWatch::Stable)
        };
        location.watch = watch;
        if let Some(regimes) = &mut self.regimes {
            regimes.look_ahead(location, t, state, true);
        }
        let mut transitions = vec![Transition::new(kind, *location, state.to_vec())];
        if is_lost {
            for kick in std::mem::take(&mut self.waiting_kicks) {
                transitions.extend(self.kick(location, t, state, &kick));
                if let Some(last) = transitions.last() {
                    *location = last.location;
                    state.copy_from_slice(&last.state);
                }
            }
        }
        transitions
    }

    fn contact_changes(&mut self, location: &SystemLocation, t: f64, y: &[f64]) -> Transition {
        let mut state = y.to_vec();
        if location.mode != Mode::Separated {
            if let Engagement::Bristles(.., at) = self.dynamics.system.engagement {
                // Bristles of an open contact have no deflection.
                state[at] = 0.0;
            }
            return Transition::new(
                EventKind::Separation,
                self.entered(location, Mode::Separated, t, &state),
                state,
            );
        }
        Transition::new(EventKind::Contact, self.in_contact(location, t, &mut state), state)
    }
}

/// Reason to end a run at this sliding speed, beyond the `end` of the friction law, rad/s.
pub(super) fn beyond_the_law(speed: f64, end: f64) -> String {
    format!("the sliding speed has come to {speed:.6} rad/s, and the friction law is valid below {end:?} rad/s")
}

fn crossing(slow: bool) -> EventKind {
    if slow { EventKind::Stick } else { EventKind::Slip }
}

const CHATTER_SHARE: f64 = 1e-6;

/// Smaller relative changes of a speed at a corner are rounding, and no jumps.
const JUMP: f64 = 1e-12;

impl Rules for SystemRules {
    fn next_time_event(&mut self, location: &SystemLocation, t: f64) -> Option<f64> {
        let closed = location.mode != Mode::Separated;
        let excitation = &self.dynamics.excitation;
        let contact_change = *self.contact_change.get_or_insert_with(|| {
            let departing = std::mem::take(&mut self.departing);
            excitation.next_contact_change(t, closed, departing, self.end_time)
        });
        let corner = excitation.corners().get(self.next_corner).copied();
        let kick = self.kicks.get(self.next_kick).map(|kick| kick.0);
        let regime = self.regimes.as_ref().and_then(Regimes::time);
        let foresight = self.foresight.as_ref().and_then(Foresight::time);
        let times = [
            contact_change.map(|change| change.time),
            corner,
            kick,
            regime,
            foresight,
        ];
        times.into_iter().flatten().min_by(f64::total_cmp)
    }

    fn at_time_event(&mut self, location: &SystemLocation, t: f64, y: &[f64]) -> Vec<Transition> {
        let corner = self.dynamics.excitation.corners().get(self.next_corner).copied();
        if corner.is_some_and(|corner| corner <= t) {
            return self.corner(location, t, y);
        }
        let kick_due = self.kicks.get(self.next_kick).filter(|kick| kick.0 <= t).cloned();
        let change = self.contact_change.flatten().filter(|change| change.time <= t);
        if let Some(change) = change.filter(|change| change.at_corner() || kick_due.is_none()) {
            self.contact_change = None;
            self.departing = change.departs();
            if change.cause == ChangeCause::Searched {
                return Vec::new();
            }
            return vec![self.contact_changes(location, t, y)];
        }
        if let Some((_, kick)) = kick_due {
            self.next_kick += 1;
            return self.kick(location, t, y, &kick);
        }
        let mut after = *location;
        if let Some(regimes) = &mut self.regimes {
            regimes.ask(&mut after, t, y);
        }
        if let Some(foresight) = &mut self.foresight {
            foresight.ask(&mut after, t, y);
        }
        vec![Transition::new(None, after, y.to_vec())]
    }

    fn at_guards(&mut self, location: &SystemLocation, t: f64, y: &[f64], fired: Fired) -> Vec<Transition> {
        if location.mode == Mode::Stick {
            let mode = if fired.contains(GUARD_FORWARD) {
                Mode::SlipForward
            } else {
                Mode::SlipBackward
            };
            // Sets omega_r to exactly zero, beyond the rounding of the stick.
            let mut state = y.to_vec();
            let outside = self.dynamics.outside(location, t);
            self.dynamics.system.join(&outside, &mut state);
            let location = SystemLocation {
                piece: 0,
                ..self.entered(location, mode, t, &state)
            };
            return vec![Transition::new(EventKind::Slip, location, state)];
        }
        let mut transitions = Vec::new();
        let mut location = *location;
        let mut state = y.to_vec();
        let watched = self.dynamics.watched(&location);
        let has_fired = |which: Watched| {
            let index = watched.iter().position(|&watched| watched == which);
            index.is_some_and(|index| fired.contains(index))
        };
        let mut stability_changes = has_fired(Watched::Destabilised) || has_fired(Watched::Restabilised);
        let (below, above) = (has_fired(Watched::Below), has_fired(Watched::Above));
        if below || above {
            location.piece = if below {
                location.piece.saturating_sub(1)
            } else {
                location.piece + 1
            };
            // The slope of friction jumps at a knot, and so does the margin.
            let outside = self.dynamics.outside(&location, t);
            let system = &self.dynamics.system;
            let margin = system.stability_guard(location.sign(), location.piece, &outside, y);
            stability_changes = match location.watch {
                MarginWatch::Stable => margin < 0.0,
                MarginWatch::Unstable => margin > 0.0,
                MarginWatch::Off => false,
            };
            if let Some(regimes) = &mut self.regimes {
                let resolved = location.resolved;
                regimes.pass_corner(&mut location, t, y, resolved);
            }
            if let Some(foresight) = &mut self.foresight {
                foresight.enter(&mut location, t);
            }
            transitions.push(Transition::new(None, location, y.to_vec()));
        }
        if stability_changes {
            transitions.extend(self.stability_changes(&mut location, t, &mut state));
        }
        if has_fired(Watched::Threshold) {
            location.slow = !location.slow;
            transitions.push(Transition::new(crossing(location.slow), location, state.clone()));
        }
        if has_fired(Watched::Stopping) && location.mode == Mode::Engaged {
            location.sense = -location.sense;
            transitions.push(Transition::new(None, location, state.clone()));
        } else if has_fired(Watched::Stopping) && location.mode != Mode::Stick {
            let is_smooth = self.regimes.as_ref().is_some_and(|regimes| regimes.is_smooth(t));
            self.stopped_smoothly |= location.watch != MarginWatch::Off && is_smooth;
            transitions.push(self.stop(&location, t, &state));
        }
        transitions
    }

    fn outside(&self, location: &SystemLocation, t: f64, y: &[f64]) -> Option<String> {
        let system = &self.dynamics.system;
        let (end, slides) = (system.law.ends_at(), location.sense != 0);
        (slides && end.is_finite() && system.law.knots().len() <= location.piece).then(|| {
            // By rounding, a state at the end of the law may be just below it.
            let speed = system.relative_velocity(&self.dynamics.outside(location, t), y).abs();
            beyond_the_law(speed.max(end), end)
        })
    }

    fn solver(&self, location: &SystemLocation, t: f64, y: &[f64]) -> ChosenSolver {
        let chosen = self.plan.solver(location, t, y);
        let foreseen = self.foresight.as_ref().and_then(|ahead| ahead.longest_step(location));
        let longest = chosen.max_step.into_iter().chain(foreseen).reduce(f64::min);
        ChosenSolver {
            max_step: longest,
            ..chosen
        }
    }

    fn engine(&self, kind: &SolverKind) -> Option<Box<dyn Engine>> {
        match kind {
            SolverKind::Series => Some(Box::new(TaylorEngine::new(self.dynamics.clone()))),
            SolverKind::ClosedForm => Some(Box::new(ClosedFormEngine::new(self.dynamics.clone()))),
            SolverKind::Rk4 => Some(Box::new(FixedSteps::new(self.dynamics.clone()))),
            _ => None,
        }
    }
}
