//! What happens at the brake's guards and time events.

use super::brake::{Brake, GUARD_FORWARD, GUARD_STABILITY, GUARD_STOPPING, Location, Watch};
use super::plan::Plan;
use super::semi_analytic::SemiAnalyticEngine;
use crate::friction::Law;
use crate::hybrid::{ChosenSolver, ClosedFormEngine, Engine, Fired, Rules, SolverKind, Transition};
use crate::model::axial::{ChangeCause, ContactChange};
use crate::model::slow_manifold::on_slow_manifold;
use crate::model::slow_stick::SlowStick;
use crate::model::stability::{Forecast, QuietStretch};
use crate::model::state::{TorsionState, state_of};
use crate::model::torsion::TorsionModel;
use crate::model::{Mode, Parameters};
use crate::record::EventKind;
use std::sync::Arc;

/// Damping, in e-folds, after which an excitation of the fast mode is gone: e^-40 is below the rounding of any double.
/// The same amount must lie between the last unresolved step and the instability, so that the errors of unresolved
/// steps are gone before anything can amplify them.
pub(super) const QUIET_E_FOLDS: f64 = 40.0;

/// Damping after which exact sliding is on the slow manifold to every digit, even if e^20 of growth follow.
pub(super) const CALM_E_FOLDS: f64 = 60.0;

/// [`QuietStretch::time_scale_ratio`] up to which sliding is followed along its slow manifold. At this the series of the
/// manifold still gives a stop to 1e-12 s; at four times it, to 1e-9 s.
pub(crate) const LARGEST_TIME_SCALE_RATIO: f64 = 0.01;

/// A deviation from the slow manifold below this share of a kick is taken for noise.
pub(super) const NOISE_OF_KICK: f64 = 1e-3;

/// The error of the slow manifold's series may be this share of the deviation of the computed state from it, for the
/// deviation to be the state's.
pub(super) const ERROR_OF_MANIFOLD: f64 = 0.1;

/// While the fast mode is resolved, how often (in its periods) it is asked whether it still has to be.
pub(super) const REPLAN_PERIODS: f64 = 50.0;

/// The next change of step regime.
#[derive(Debug, Clone, Copy)]
pub(super) enum Regime {
    /// From unresolved to resolved steps.
    Resolve(f64),
    /// To unresolved steps, if it is still true that this is allowed.
    Relax(f64),
    /// Ask again.
    Ask(f64),
    /// Nothing foreseen.
    Keep,
}

impl Regime {
    /// When it ends or is asked for again, s.
    pub(super) fn time(&self) -> Option<f64> {
        match *self {
            Regime::Resolve(t) | Regime::Relax(t) | Regime::Ask(t) => Some(t),
            Regime::Keep => None,
        }
    }
}

/// The brake's rules, with their memory.
pub(crate) struct BrakeRules {
    brake: Arc<Brake>,
    plan: Plan,
    end_time: f64,
    /// Timed kicks in order, and which is next.
    kicks: Vec<(f64, f64)>,
    next_kick: usize,
    /// Kicks waiting for the loss of stability.
    waiting_kicks: Vec<f64>,
    /// The next zero of the contact force; outer `None`: not looked for yet.
    contact_change: Option<Option<ContactChange>>,
    /// The contact force is leaving zero.
    departing: bool,
    regime: Regime,
    /// The corner that was last passed, so that it is recorded once.
    last_corner: f64,
    /// From when on the fast mode has died since the last disturbance, by [`CALM_E_FOLDS`].
    calm_from: f64,
    /// Until then the slip under way is smooth sliding to every digit, and nothing has to be resolved: known where the
    /// plan wants to know it, see [`BrakeRules::foresee_smooth_sliding`].
    smooth_until: f64,
    /// The last forecast, and of which time and relative velocity it is: an instant may ask for it twice.
    forecast: Option<(f64, f64, Forecast)>,
    /// The first stop came while that was so.
    stopped_smoothly: bool,
}

type BrakeTransition = Transition<EventKind, Location>;

impl BrakeRules {
    pub fn new(brake: Arc<Brake>, parameters: &Parameters, plan: Plan, end_time: f64) -> Self {
        let (kicks, waiting_kicks) = parameters.kicks();
        BrakeRules {
            brake,
            plan,
            end_time,
            kicks,
            next_kick: 0,
            waiting_kicks,
            contact_change: None,
            departing: true,
            regime: Regime::Ask(0.0),
            last_corner: 0.0,
            calm_from: f64::INFINITY,
            smooth_until: f64::NEG_INFINITY,
            forecast: None,
            stopped_smoothly: false,
        }
    }

    /// Kicks set at the instability that never came.
    pub fn kicks_never_given(&self) -> usize {
        self.waiting_kicks.len()
    }

    /// Whether the first stop came at the end of smooth sliding, on which rounding does not grow.
    pub fn stopped_smoothly(&self) -> bool {
        self.stopped_smoothly
    }

    /// Location at t = 0 for a state.
    pub(crate) fn initial_location(&self, y: &[f64]) -> Location {
        let mode = if self.brake.axial.force.starts_positive() {
            self.mode_in_contact(0.0, y)
        } else {
            Mode::Separated
        };
        Location {
            mode,
            resolved: false,
            watch: self.watch_from(mode),
            piece: self.brake.piece_of(y),
        }
    }

    /// Location of a run that begins later than at t = 0, in a closed contact: corners and kicks up to `t` (s) have been, and so
    /// has a loss of stability that a kick waits for.
    pub(crate) fn location_at(&mut self, t: f64, y: &[f64]) -> Location {
        while let Some(corner) = self.brake.axial.force.next_corner(self.last_corner).filter(|&c| c <= t) {
            self.last_corner = corner;
        }
        self.next_kick = self.kicks.partition_point(|kick| kick.0 <= t);
        self.waiting_kicks.clear();
        self.departing = false;
        let mode = self.mode_in_contact(t, y);
        let watch = self.watch_from(mode);
        self.enter(mode, watch, t, y)
    }

    /// What is watched where a run begins in a mode. Without damping and under constant friction the margin is zero throughout.
    fn watch_from(&self, mode: Mode) -> Watch {
        let torsion = &self.brake.torsion;
        let slopes = torsion.friction.law.slope_bounds(0.0, f64::INFINITY);
        let vanishes = torsion.torsion.damping == 0.0 && slopes.least == 0.0 && slopes.most == 0.0;
        if mode == Mode::Stick || vanishes {
            Watch::Off
        } else {
            Watch::Stable
        }
    }

    /// Slip in the sense of the relative velocity, or where there is none what the stick test says.
    fn mode_in_contact(&self, t: f64, y: &[f64]) -> Mode {
        let w = self.brake.torsion.relative_velocity(y);
        if w != 0.0 { Mode::sliding(w) } else { self.settle(t, y) }
    }

    /// The stick test for surfaces at the same speed.
    fn settle(&self, t: f64, y: &[f64]) -> Mode {
        let limit = self
            .brake
            .torsion
            .breakaway_torque(self.brake.axial.pressing_force(t).max(0.0));
        let torque = self.brake.torsion.transmitted_torque(y);
        if torque.abs() <= limit {
            Mode::Stick
        } else {
            Mode::sliding(torque)
        }
    }

    /// Looks ahead in a slip: whether steps must resolve the fast mode now, and until when that holds. `excited` says
    /// that something has just set the fast mode going, or may have.
    fn look_ahead(&mut self, location: &Location, t: f64, y: &[f64], excited: bool) -> bool {
        let period = self.brake.torsion.natural_period();
        let ask_again = Regime::Ask(t + REPLAN_PERIODS * period);
        let (resolved, regime) = match location.mode {
            // Free surfaces have no guard to miss; the solver's own error control follows them.
            _ if self.plan.closed_form(location.mode) => (false, Regime::Keep),
            Mode::Stick | Mode::Separated if self.plan.resolves_all_ringing() => {
                let rate = SlowStick::new(&self.brake.torsion).fast_decay;
                if excited {
                    (true, Regime::Relax(t + QUIET_E_FOLDS / rate))
                } else {
                    (false, Regime::Keep)
                }
            }
            Mode::Separated | Mode::Engaged => (false, Regime::Keep),
            // Decays at c_t / 2J at least as fast as the slip's relative mode at full margin.
            Mode::Stick => {
                let rate = self.brake.torsion.torsion.damping / (2.0 * self.brake.torsion.torsion.surface_inertia);
                if excited {
                    (true, Regime::Relax(t + QUIET_E_FOLDS / rate))
                } else {
                    (false, Regime::Keep)
                }
            }
            _ if t < self.smooth_until => (false, Regime::Keep),
            Mode::SlipForward | Mode::SlipBackward => {
                let brake = &self.brake;
                let w = brake.torsion.relative_velocity(y);
                if brake.stability_margin(location, t, y) < 0.0 {
                    (true, ask_again)
                } else {
                    let (mut silent, mut bent) = (t, f64::NEG_INFINITY);
                    if self.plan.resolves_all_ringing() {
                        silent = brake.axial.dies_by(t, QUIET_E_FOLDS);
                        bent = self
                            .plan
                            .bent_sliding(&brake.torsion, brake.axial.highest_pressing_force_after(t));
                    }
                    let forecast = self.forecast(t, w);
                    let quiet_until = forecast.last_quiet_time(QUIET_E_FOLDS).unwrap_or(f64::INFINITY);
                    let quiet_until = quiet_until.min(forecast.time_of_speed(bent).unwrap_or(f64::INFINITY));
                    if excited {
                        let calm = forecast.time_of_damping(QUIET_E_FOLDS).map(|calm| calm.max(silent));
                        match calm {
                            Some(calm) if calm < quiet_until => (true, Regime::Relax(calm)),
                            _ => (true, ask_again),
                        }
                    } else if quiet_until > t + 5.0 * period {
                        let resolve = if quiet_until.is_finite() {
                            Regime::Resolve(quiet_until)
                        } else {
                            Regime::Keep
                        };
                        (false, resolve)
                    } else {
                        (true, ask_again)
                    }
                }
            }
        };
        self.regime = regime;
        resolved
    }

    /// The loss of stability of the slip at `t` with this relative velocity (rad/s), foreseen.
    fn forecast(&mut self, t: f64, w: f64) -> &Forecast {
        let known = self.forecast.take().filter(|known| (known.0, known.1) == (t, w));
        let Brake { torsion, axial, .. } = &*self.brake;
        let forecast = known.unwrap_or_else(|| (t, w, Forecast::new(torsion, axial, t, w, self.end_time)));
        &self.forecast.insert(forecast).2
    }

    /// Notes that something has set the fast mode going, or may have.
    fn disturb(&mut self, mode: Mode, t: f64, y: &[f64]) {
        self.smooth_until = f64::NEG_INFINITY;
        if self.plan.follows_smooth_sliding() && mode.sense() != 0 && self.foresee_smooth_sliding(t, y) {
            return;
        }
        self.calm_from = self.time_of_calm(mode, t, y);
    }

    /// From when on what excites the fast mode at `t` will be gone; infinite if nothing says so.
    fn time_of_calm(&mut self, mode: Mode, t: f64, y: &[f64]) -> f64 {
        let location = Location {
            mode,
            resolved: true,
            watch: Watch::Off,
            piece: self.brake.piece_of(y),
        };
        if mode.sense() == 0 || self.brake.stability_margin(&location, t, y) < 0.0 {
            return f64::INFINITY;
        }
        let w = self.brake.torsion.relative_velocity(y);
        let calm = self.forecast(t, w).time_of_damping(CALM_E_FOLDS);
        calm.unwrap_or(f64::INFINITY)
    }

    /// Whether the slip at `t` stays smooth sliding up to the next corner of F, or where none is left to its stop: the
    /// disturbance of now then dies by more e-folds than instability can bring back, and an L-stable method that
    /// strides over the fast mode stays where the exact solution is.
    fn foresee_smooth_sliding(&mut self, t: f64, y: &[f64]) -> bool {
        // At a knot of the friction law the slow manifold has a step, which excites the fast mode a little.
        if !self.brake.is_smooth() {
            return false;
        }
        let Brake { torsion, axial, .. } = &*self.brake;
        let quiet = QuietStretch::new(torsion, axial, t, torsion.relative_velocity(y));
        if quiet.time_scale_ratio > LARGEST_TIME_SCALE_RATIO {
            return false;
        }
        let from = t.max(axial.silent_from(t));
        let smooth_until = match axial.force.next_corner(t) {
            Some(corner) if corner + QUIET_E_FOLDS / quiet.damping < quiet.until => corner,
            None if (quiet.until - from) * quiet.damping > CALM_E_FOLDS + quiet.growth => f64::INFINITY,
            _ => return false,
        };
        self.calm_from = from + CALM_E_FOLDS / quiet.damping;
        self.smooth_until = smooth_until;
        true
    }

    /// The state that a kick is added to.
    ///
    /// Where sliding has been undisturbed for long, exact sliding is on the slow manifold, and what the computed state
    /// has beside it is rounding, amplified since the loss of stability. A kick of 1e-4 rad/s that is added to the
    /// manifold itself keeps four more digits than one that is added to that noise. A deviation that is too large for
    /// noise is left alone, and so is one that the manifold's own error may account for: where friction changes fast, its
    /// series is less accurate than what an integrator keeps since the loss of stability.
    fn before_kick(&self, location: &Location, t: f64, y: &[f64], delta: f64) -> Vec<f64> {
        let Brake { torsion, axial, .. } = &*self.brake;
        if t < self.calm_from || !axial.is_silent(t) {
            return y.to_vec();
        }
        let pressing = axial.at(t);
        let pressing = (pressing.pressing_force, pressing.pressing_rate);
        let state = state_of(y);
        let slow = on_slow_manifold(torsion, f64::from(location.mode.sense()), pressing, &state);
        let deviation = torsion.relative_velocity(&slow.state) - torsion.relative_velocity(y);
        let away: TorsionState = std::array::from_fn(|k| slow.state[k] - state[k]);
        let better = slow.settled || torsion.oscillation(&slow.error) < ERROR_OF_MANIFOLD * torsion.oscillation(&away);
        if better && deviation.abs() < NOISE_OF_KICK * delta.abs() {
            slow.state.to_vec()
        } else {
            y.to_vec()
        }
    }

    /// The location after a change of mode, with the step regime planned.
    fn enter(&mut self, mode: Mode, watch: Watch, t: f64, y: &[f64]) -> Location {
        self.smooth_until = f64::NEG_INFINITY;
        self.calm_from = self.time_of_calm(mode, t, y);
        let mut location = Location {
            mode,
            resolved: true,
            watch,
            piece: if mode.sense() == 0 { 0 } else { self.brake.piece_of(y) },
        };
        location.resolved = self.look_ahead(&location, t, y, true);
        location
    }

    fn kick(&mut self, location: &Location, t: f64, y: &[f64], delta: f64) -> Vec<BrakeTransition> {
        let brake = self.brake.clone();
        let torsion = &brake.torsion;
        if location.mode == Mode::Stick {
            // Equal and opposite impulses on surfaces that move as one: absorbed.
            return vec![Transition {
                kind: Some(EventKind::Kick),
                location: *location,
                state: y.to_vec(),
            }];
        }
        let in_slip = location.mode != Mode::Separated;
        let y = if in_slip {
            self.before_kick(location, t, y, delta)
        } else {
            y.to_vec()
        };
        let kicked = torsion.kicked(&y, delta);
        let w = torsion.relative_velocity(&kicked);
        if location.mode == Mode::Separated {
            return vec![Transition {
                kind: Some(EventKind::Kick),
                location: *location,
                state: kicked.to_vec(),
            }];
        }
        let sense = f64::from(location.mode.sense());
        let mut transitions = Vec::with_capacity(2);
        let after = if sense * w > 0.0 {
            self.enter(location.mode, location.watch, t, &kicked)
        } else {
            Location {
                resolved: true,
                ..*location
            }
        };
        transitions.push(Transition {
            kind: Some(EventKind::Kick),
            location: after,
            state: kicked.to_vec(),
        });
        if sense * w < 0.0 {
            let reversed = self.enter(Mode::sliding(w), location.watch, t, &kicked);
            transitions.push(Transition {
                kind: Some(EventKind::Reversal),
                location: reversed,
                state: kicked.to_vec(),
            });
        } else if w == 0.0 {
            transitions.push(self.stop(location, t, &kicked));
        }
        transitions
    }

    /// What follows when the relative velocity has reached zero.
    fn stop(&mut self, location: &Location, t: f64, y: &[f64]) -> BrakeTransition {
        let joined: TorsionState = self.brake.torsion.joined(y);
        let mode = self.settle(t, &joined);
        // A kick may end at zero with a torque that goes on in the same sense: nothing has happened.
        if mode == location.mode {
            return Transition {
                kind: None,
                location: Location { piece: 0, ..*location },
                state: joined.to_vec(),
            };
        }
        let (kind, watch) = if mode == Mode::Stick {
            (EventKind::Stick, Watch::Off)
        } else {
            (EventKind::Reversal, location.watch)
        };
        let location = self.enter(mode, watch, t, &joined);
        Transition {
            kind: Some(kind),
            location,
            state: joined.to_vec(),
        }
    }
}

/// Why there is no friction coefficient at this sliding speed (rad/s); `None` where there is one.
pub(super) fn beyond_law(torsion: &TorsionModel, speed: f64) -> Option<String> {
    let end = torsion.friction.law.ends_at();
    (speed >= end && end.is_finite()).then(|| {
        format!("the sliding speed has come to {speed:.6} rad/s, and the friction law is valid below {end:?} rad/s")
    })
}

impl Rules<Brake> for BrakeRules {
    type Kind = EventKind;

    fn next_time_event(&mut self, location: &Location, t: f64) -> Option<f64> {
        let closed = location.mode != Mode::Separated;
        let contact_change = match self.contact_change {
            Some(known) => known,
            None => {
                let found = self
                    .brake
                    .axial
                    .next_contact_change(t, closed, self.departing, self.end_time);
                self.departing = false;
                self.contact_change = Some(found);
                found
            }
        };
        let corner = self.brake.axial.force.next_corner(self.last_corner);
        let kick = self.kicks.get(self.next_kick).map(|k| k.0);
        [
            contact_change.map(|change| change.time),
            corner,
            kick,
            self.regime.time(),
        ]
        .into_iter()
        .flatten()
        .min_by(f64::total_cmp)
    }

    fn at_time_event(&mut self, location: &Location, t: f64, y: &[f64]) -> Vec<BrakeTransition> {
        if let Some(corner) = self.brake.axial.force.next_corner(self.last_corner).filter(|&c| c <= t) {
            self.last_corner = corner;
            self.disturb(location.mode, t, y);
            let mut after = *location;
            let excited = location.resolved || self.plan.resolves_all_ringing() && location.mode.sense() != 0;
            after.resolved = self.look_ahead(location, t, y, excited);
            return vec![Transition {
                kind: Some(EventKind::Corner),
                location: after,
                state: y.to_vec(),
            }];
        }
        let kick_due = self.kicks.get(self.next_kick).is_some_and(|kick| kick.0 <= t);
        let change = self.contact_change.flatten().filter(|change| change.time <= t);
        // A contact that belongs to a corner comes with it; any other at the instant of a kick is after it, as far as
        // doubles tell.
        if let Some(change) = change.filter(|change| change.at_corner() || !kick_due) {
            self.contact_change = None;
            self.departing = change.departs();
            if change.cause == ChangeCause::Searched {
                return Vec::new();
            }
            let closing = location.mode == Mode::Separated;
            let (kind, mode) = if closing {
                (EventKind::Contact, self.mode_in_contact(t, y))
            } else {
                (EventKind::Separation, Mode::Separated)
            };
            let watch = if mode == Mode::Stick {
                Watch::Off
            } else {
                location.watch
            };
            let after = self.enter(mode, watch, t, y);
            return vec![Transition {
                kind: Some(kind),
                location: after,
                state: y.to_vec(),
            }];
        }
        if let Some(&(_, delta)) = self.kicks.get(self.next_kick).filter(|k| k.0 <= t) {
            self.next_kick += 1;
            return self.kick(location, t, y, delta);
        }
        if t == 0.0 {
            self.disturb(location.mode, t, y);
        }
        if matches!(self.regime, Regime::Relax(_)) && self.plan.follows_smooth_sliding() && location.mode.sense() != 0 {
            self.foresee_smooth_sliding(t, y);
        }
        let excited =
            matches!(self.regime, Regime::Ask(_)) && location.resolved || t == 0.0 && self.plan.resolves_all_ringing();
        let mut after = *location;
        after.resolved = match self.regime {
            Regime::Resolve(_) => {
                self.regime = Regime::Ask(t + REPLAN_PERIODS * self.brake.torsion.natural_period());
                // Within the lead to the instability a question would be answered the same way again.
                true
            }
            _ => self.look_ahead(location, t, y, excited),
        };
        vec![Transition {
            kind: None,
            location: after,
            state: y.to_vec(),
        }]
    }

    fn at_guards(&mut self, location: &Location, t: f64, y: &[f64], fired: Fired) -> Vec<BrakeTransition> {
        if location.mode == Mode::Stick {
            let mode = if fired.contains(GUARD_FORWARD) {
                Mode::SlipForward
            } else {
                Mode::SlipBackward
            };
            let after = self.enter(mode, location.watch, t, y);
            return vec![Transition {
                kind: Some(EventKind::Slip),
                location: after,
                state: y.to_vec(),
            }];
        }
        let mut transitions = Vec::new();
        let mut location = *location;
        let mut state = y.to_vec();
        let mut stability_changes = location.watch != Watch::Off && fired.contains(GUARD_STABILITY);
        let passes = |below: usize| fired.contains(below) || fired.contains(below + 1);
        if let Some(below) = self.brake.guard_below(&location).filter(|&below| passes(below)) {
            if fired.contains(below) {
                location.piece -= 1;
            } else {
                location.piece += 1;
            }
            // The slope of the friction jumps there, and the margin with it.
            let margin = self.brake.stability_margin(&location, t, y);
            stability_changes = match location.watch {
                Watch::Stable => margin < 0.0,
                Watch::Unstable => margin > 0.0,
                Watch::Off => false,
            };
            self.disturb(location.mode, t, y);
            let excited = location.resolved || self.plan.resolves_all_ringing();
            location.resolved = self.look_ahead(&location, t, y, excited);
            transitions.push(Transition {
                kind: None,
                location,
                state: state.clone(),
            });
        }
        if stability_changes {
            let (kind, watch) = match location.watch {
                Watch::Stable => (EventKind::Destabilised, Watch::Unstable),
                _ => (EventKind::Restabilised, Watch::Stable),
            };
            location.watch = watch;
            location.resolved = self.look_ahead(&location, t, &state, true);
            transitions.push(Transition {
                kind: Some(kind),
                location,
                state: state.clone(),
            });
            if kind == EventKind::Destabilised {
                for delta in std::mem::take(&mut self.waiting_kicks) {
                    transitions.extend(self.kick(&location, t, &state, delta));
                    if let Some(last) = transitions.last() {
                        location = last.location;
                        state.clone_from(&last.state);
                    }
                }
            }
        }
        if fired.contains(GUARD_STOPPING) && location.mode != Mode::Stick {
            self.stopped_smoothly |= location.watch != Watch::Off && t < self.smooth_until;
            transitions.push(self.stop(&location, t, &state));
        }
        transitions
    }

    fn outside(&self, location: &Location, y: &[f64]) -> Option<String> {
        if location.mode.sense() == 0 || self.brake.torsion.friction.law.knots().len() > location.piece {
            return None;
        }
        // Above the last knot; a state that has just come to it is there by rounding.
        let speed = self.brake.torsion.relative_velocity(y).abs();
        beyond_law(
            &self.brake.torsion,
            speed.max(self.brake.torsion.friction.law.ends_at()),
        )
    }

    fn solver(&self, location: &Location, _: f64, _: &[f64]) -> ChosenSolver {
        self.plan.solver(location)
    }

    fn engine(&self, kind: &SolverKind) -> Option<Box<dyn Engine<Location>>> {
        match kind {
            SolverKind::ClosedForm => Some(Box::new(ClosedFormEngine::new(self.brake.clone()))),
            SolverKind::Series => Some(Box::new(SemiAnalyticEngine::new(self.brake.clone()))),
            _ => None,
        }
    }

    fn counts(&self, kind: &EventKind) -> bool {
        kind.in_event_sequence()
    }

    fn chatter_window(&self) -> f64 {
        0.05 * self.brake.torsion.natural_period()
    }
}
