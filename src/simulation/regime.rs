//! Where the steps of a slip have to resolve the fast modes, and where they may stride over them.

use super::dynamics::{SystemDynamics, SystemLocation};
use crate::friction::{Bounds, Law};
use crate::model::Mode;
use crate::model::slow_manifold::{Slip, has_slow_manifold, on_slow_manifold, oscillation};
use crate::model::stability::{FastModes, Forecast, QuietStretch, bent_sliding};
use std::sync::Arc;

/// Damping, in e-folds, after which an excitation of the fast mode is gone: e^-40 is below the rounding of any double.
/// The same amount must lie between the last unresolved step and the instability, so that the errors of unresolved
/// steps are gone before anything can amplify them.
pub(super) const QUIET_E_FOLDS: f64 = 40.0;

/// Damping after which exact sliding is on the slow manifold to every digit, even if e^20 of growth follow.
const CALM_E_FOLDS: f64 = 60.0;

/// [`QuietStretch::time_scale_ratio`] up to which sliding is followed along its slow manifold. At this the series of the
/// manifold still gives a stop to 1e-12 s; at four times it, to 1e-9 s.
pub(super) const LARGEST_TIME_SCALE_RATIO: f64 = 0.01;

/// A deviation from the slow manifold below this share of a kick is taken for noise.
const NOISE_OF_KICK: f64 = 1e-3;

/// The error of the slow manifold's series may be this share of the deviation of the computed state from it, for the
/// deviation to be the state's.
const ERROR_OF_MANIFOLD: f64 = 0.1;

/// While the fast mode is resolved, how often (in its periods) it is asked whether it still has to be.
pub(super) const REPLAN_PERIODS: f64 = 50.0;

/// The next change of step regime.
#[derive(Debug, Clone, Copy)]
enum Regime {
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
    fn time(&self) -> Option<f64> {
        match *self {
            Regime::Resolve(t) | Regime::Relax(t) | Regime::Ask(t) => Some(t),
            Regime::Keep => None,
        }
    }
}

/// Shortest stretch of unresolved steps that is worth a change, in natural periods.
const SHORTEST_STRETCH: f64 = 5.0;

/// What the steps of a method can do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Steps {
    /// The method stays on smooth sliding even where that is unstable.
    pub follows_smooth_sliding: bool,
    /// Stick and separation are integrated; else they are taken as the linear motions that they are.
    pub integrates_linear_motion: bool,
    /// Of a method that strides over a dead oscillation but not over a live one, by high order.
    pub stride: Option<Stride>,
}

/// See [`Steps::stride`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stride {
    /// The shortest step of that kind, s.
    pub step: f64,
    /// The relative tolerance.
    pub relative: f64,
}

/// The step regime of a system whose sliding slows down by itself, with its memory.
#[derive(Clone)]
pub(super) struct Regimes {
    dynamics: Arc<SystemDynamics>,
    modes: FastModes,
    /// The natural period, s.
    period: f64,
    end_time: f64,
    steps: Steps,
    regime: Regime,
    /// From when on the fast modes have died since the last disturbance, by [`CALM_E_FOLDS`].
    calm_from: f64,
    /// Until then the slip under way is smooth sliding to every digit, and nothing has to be resolved.
    smooth_until: f64,
    /// The last forecast, and of which time and relative velocity it is: an instant may ask for it twice.
    forecast: Option<(f64, f64, Forecast)>,
}

impl Regimes {
    /// `None` of a system that does not slow down by itself, or that a spring does not hold everywhere.
    pub fn new(dynamics: &Arc<SystemDynamics>, end_time: f64, steps: Steps) -> Option<Regimes> {
        let system = &dynamics.system;
        let twice_resistance = system.twice_resistance.filter(|_| has_slow_manifold(system))?;
        Some(Regimes {
            modes: FastModes::new(system, twice_resistance),
            period: dynamics.natural_period()?,
            dynamics: dynamics.clone(),
            end_time,
            steps,
            regime: Regime::Ask(0.0),
            calm_from: f64::INFINITY,
            smooth_until: f64::NEG_INFINITY,
            forecast: None,
        })
    }

    /// When the regime is to be asked for again, s.
    pub fn time(&self) -> Option<f64> {
        self.regime.time()
    }

    /// Whether the slip at `t` (s) is smooth sliding to every digit.
    pub fn is_smooth(&self, t: f64) -> bool {
        t < self.smooth_until
    }

    fn relative_velocity(&self, location: &SystemLocation, t: f64, y: &[f64]) -> f64 {
        let outside = self.dynamics.outside(location, t);
        self.dynamics.system.relative_velocity(&outside, y)
    }

    /// Plans the steps after a change of mode.
    pub fn enter(&mut self, location: &mut SystemLocation, t: f64, y: &[f64]) {
        self.smooth_until = f64::NEG_INFINITY;
        self.calm_from = self.time_of_calm(location, t, y);
        self.look_ahead(location, t, y, true);
    }

    /// Looks ahead in a slip: whether steps must resolve the fast modes now, and until when that holds. `excited` says
    /// that something has just set them going, or may have.
    pub fn look_ahead(&mut self, location: &mut SystemLocation, t: f64, y: &[f64], excited: bool) {
        let ask_again = Regime::Ask(t + REPLAN_PERIODS * self.period);
        let (resolved, regime) = if location.mode.sense() == 0 {
            self.in_linear_motion(location, t, excited)
        } else if self.is_smooth(t) {
            (false, Regime::Keep)
        } else if self.dynamics.stability_margin(location, t, y) < 0.0 {
            (true, ask_again)
        } else {
            let w = self.relative_velocity(location, t, y);
            let (bent, silent) = self.stride_ahead(t, w).unwrap_or((f64::NEG_INFINITY, t));
            let (quiet_until, calm) = self.forecast(t, w).map_or((t, None), |forecast| {
                let quiet = forecast.last_quiet_time(QUIET_E_FOLDS).unwrap_or(f64::INFINITY);
                let bends = forecast.time_of_speed(bent).unwrap_or(f64::INFINITY);
                let calm = forecast.time_of_damping(QUIET_E_FOLDS);
                (quiet.min(bends), calm.map(|calm| calm.max(silent)))
            });
            match calm {
                Some(calm) if excited && calm < quiet_until => (true, Regime::Relax(calm)),
                _ if excited || quiet_until <= t + SHORTEST_STRETCH * self.period => (true, ask_again),
                _ if quiet_until.is_finite() => (false, Regime::Resolve(quiet_until)),
                _ => (false, Regime::Keep),
            }
        };
        self.regime = regime;
        location.resolved = resolved;
    }

    /// The same in stick and in separation.
    fn in_linear_motion(&self, location: &SystemLocation, t: f64, excited: bool) -> (bool, Regime) {
        let slow = self.dynamics.slow_motion(location.mode);
        match slow.filter(|slow| self.steps.integrates_linear_motion && slow.fast_decay > 0.0) {
            Some(slow) if excited => (true, Regime::Relax(t + QUIET_E_FOLDS / slow.fast_decay)),
            Some(_) => (false, Regime::Keep),
            None => (true, Regime::Keep),
        }
    }

    /// For long strides in the slip at `t` with the relative velocity `w` (rad/s): the speed (rad/s) below which it bends too much,
    /// and when the ringing of the normal force has died.
    fn stride_ahead(&self, t: f64, w: f64) -> Option<(f64, f64)> {
        let Stride { step, relative } = self.steps.stride?;
        let SystemDynamics { system, excitation, .. } = &*self.dynamics;
        let force = excitation.highest_pressing_force_after(t);
        let bent = bent_sliding(system, force, w.abs(), step, relative)?;
        Some((bent, excitation.dies_by(t, QUIET_E_FOLDS)))
    }

    /// The loss of stability of the slip at `t` with this relative velocity (rad/s), foreseen.
    fn forecast(&mut self, t: f64, w: f64) -> Option<&Forecast> {
        let known = self.forecast.take().filter(|known| (known.0, known.1) == (t, w));
        let SystemDynamics { system, excitation, .. } = &*self.dynamics;
        let (force, corner) = (|t| excitation.smooth_force(t), |t| excitation.next_corner(t));
        let forecast = match known {
            Some(known) => known,
            None => {
                let found = Forecast::of_slip(system, &mut self.modes, force, corner, (t, w), self.end_time)?;
                (t, w, found)
            }
        };
        Some(&self.forecast.insert(forecast).2)
    }

    /// Plans the steps after something that may have set the fast modes going a little: a corner of a signal, or of the law.
    pub fn pass_corner(&mut self, location: &mut SystemLocation, t: f64, y: &[f64], resolved: bool) {
        self.disturb(location, t, y);
        let excited = resolved || self.steps.stride.is_some() && location.mode.sense() != 0;
        self.look_ahead(location, t, y, excited);
    }

    /// Notes that something has set the fast modes going, or may have.
    fn disturb(&mut self, location: &SystemLocation, t: f64, y: &[f64]) {
        self.smooth_until = f64::NEG_INFINITY;
        if self.foresee_smooth_sliding(location, t, y) {
            return;
        }
        self.calm_from = self.time_of_calm(location, t, y);
    }

    /// From when on what excites the fast modes at `t` will be gone; infinite if nothing says so.
    fn time_of_calm(&mut self, location: &SystemLocation, t: f64, y: &[f64]) -> f64 {
        if location.mode.sense() == 0 || self.dynamics.stability_margin(location, t, y) < 0.0 {
            return f64::INFINITY;
        }
        let w = self.relative_velocity(location, t, y);
        let calm = self
            .forecast(t, w)
            .and_then(|forecast| forecast.time_of_damping(CALM_E_FOLDS));
        calm.unwrap_or(f64::INFINITY)
    }

    /// Whether the slip at `t` stays smooth sliding up to the next corner of F, or where none is left to its stop: the
    /// disturbance of now then dies by more e-folds than instability can bring back, and an L-stable method that
    /// strides over the fast modes stays where the exact solution is.
    fn foresee_smooth_sliding(&mut self, location: &SystemLocation, t: f64, y: &[f64]) -> bool {
        let w = self.relative_velocity(location, t, y);
        let SystemDynamics { system, excitation, .. } = &*self.dynamics;
        // At a knot of the friction law the slow manifold has a step, which excites the fast modes a little.
        let ends_at = system.law.ends_at();
        let is_smooth = system.law.knots().iter().all(|knot| *knot >= ends_at);
        if !self.steps.follows_smooth_sliding || location.mode.sense() == 0 || !is_smooth {
            return false;
        }
        let force = Bounds {
            least: excitation.lowest_pressing_force_after(t),
            most: excitation.highest_pressing_force_after(t),
        };
        let quiet = QuietStretch::of_slip(system, &mut self.modes, force, t, w);
        let Some(quiet) = quiet.filter(|quiet| quiet.time_scale_ratio <= LARGEST_TIME_SCALE_RATIO) else {
            return false;
        };
        let from = t.max(excitation.silent_from(t));
        let smooth_until = match excitation.next_corner(t) {
            Some(corner) if corner + QUIET_E_FOLDS / quiet.damping < quiet.until => corner,
            None if (quiet.until - from) * quiet.damping > CALM_E_FOLDS + quiet.growth => f64::INFINITY,
            _ => return false,
        };
        self.calm_from = from + CALM_E_FOLDS / quiet.damping;
        self.smooth_until = smooth_until;
        true
    }

    /// The time for which a question was set has come.
    pub fn ask(&mut self, location: &mut SystemLocation, t: f64, y: &[f64]) {
        if t == 0.0 {
            self.disturb(location, t, y);
        }
        if matches!(self.regime, Regime::Relax(_)) {
            self.foresee_smooth_sliding(location, t, y);
        }
        if matches!(self.regime, Regime::Resolve(_)) {
            self.regime = Regime::Ask(t + REPLAN_PERIODS * self.period);
            // Within the lead to the instability a question would be answered the same way again.
            location.resolved = true;
        } else {
            // A slip that starts with its case does not ring, as far as that is left to the steps.
            let rings = t > 0.0 || location.mode.sense() == 0 || self.steps.stride.is_some();
            let excited = matches!(self.regime, Regime::Ask(_)) && location.resolved && rings;
            self.look_ahead(location, t, y, excited);
        }
    }

    /// The state that a kick of `delta` (rad/s) is added to.
    ///
    /// Where sliding has been undisturbed for long, exact sliding is on the slow manifold, and what the computed state
    /// has beside it is rounding, amplified since the loss of stability. A kick of 1e-4 rad/s that is added to the
    /// manifold itself keeps four more digits than one that is added to that noise. A deviation that is too large for
    /// noise is left alone, and so is one that the manifold's own error may account for: where friction changes fast, its
    /// series is less accurate than what an integrator keeps since the loss of stability.
    pub fn before_kick(&self, location: &SystemLocation, t: f64, y: &[f64], delta: f64) -> Option<Vec<f64>> {
        let SystemDynamics { system, excitation, .. } = &*self.dynamics;
        let slips = matches!(location.mode, Mode::SlipForward | Mode::SlipBackward);
        if !slips || t < self.calm_from || !excitation.is_silent(t) {
            return None;
        }
        let pressing = excitation.line(location.stretch, t);
        let slip = Slip::undriven(location.sign(), location.piece, &pressing);
        let slow = on_slow_manifold(system, &slip, y);
        let w = |y: &[f64]| self.relative_velocity(location, t, y);
        let deviation = w(&slow.state) - w(y);
        let away: Vec<f64> = slow.state.iter().zip(y).map(|(slow, y)| slow - y).collect();
        let better = slow.settled || oscillation(system, &slow.error) < ERROR_OF_MANIFOLD * oscillation(system, &away);
        (better && deviation.abs() < NOISE_OF_KICK * delta.abs()).then_some(slow.state)
    }
}
