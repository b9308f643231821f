//! Decides where the steps of a slip must resolve the fast modes, and where they may step over them.

use crate::hybrid::dynamics::{SystemDynamics, SystemLocation};
use std::sync::Arc;
use stickslip_system::friction::{Bounds, Law};
use stickslip_system::model::Mode;
use stickslip_system::model::slow_manifold::{Slip, has_slow_manifold, on_slow_manifold, oscillation};
use stickslip_system::model::stability::{FastModes, Forecast, QuietStretch, bent_sliding};

/// Damping, in e-folds, after which an excitation of the fast mode has vanished: e^-40 is below the rounding of any
/// double. The same damping must lie between the last unresolved step and the instability, so that errors of
/// unresolved steps decay before they can be amplified.
pub(super) const QUIET_E_FOLDS: f64 = 40.0;

/// Damping, in e-folds, after which exact sliding is on the slow manifold to every digit, even if growth of e^20
/// follows.
const CALM_E_FOLDS: f64 = 60.0;

/// Largest [`QuietStretch::time_scale_ratio`] at which sliding follows its slow manifold. Here the manifold's series
/// gives a stop to 1e-12 s; at four times the ratio, to 1e-9 s.
pub(super) const LARGEST_TIME_SCALE_RATIO: f64 = 0.01;

/// Share of a kick below which deviations from the slow manifold are noise.
const NOISE_OF_KICK: f64 = 1e-3;

/// Largest error of the manifold's series, relative to the deviation from it, for which the deviation belongs to the
/// state.
const ERROR_OF_MANIFOLD: f64 = 0.1;

/// Periods of the fast mode between two decisions while it is resolved.
pub(super) const REPLAN_PERIODS: f64 = 50.0;

#[derive(Debug, Clone, Copy)]
enum Regime {
    /// Time of a change from unresolved to resolved steps, s.
    Resolve(f64),
    /// Time of a change to unresolved steps, if they are still allowed then, s.
    Relax(f64),
    Ask(f64),
    Keep,
}

impl Regime {
    fn time(&self) -> Option<f64> {
        match *self {
            Regime::Resolve(t) | Regime::Relax(t) | Regime::Ask(t) => Some(t),
            Regime::Keep => None,
        }
    }
}

const SHORTEST_STRETCH: f64 = 5.0;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Steps {
    /// Whether the method stays on smooth sliding even where it is unstable.
    pub follows_smooth_sliding: bool,
    /// Whether stick and separation are integrated; otherwise they are solved as linear motions.
    pub integrates_linear_motion: bool,
    /// For a method of high order that steps over a decayed oscillation, but not over an active one.
    pub stride: Option<Stride>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stride {
    /// Shortest stride, s.
    pub step: f64,
    pub relative: f64,
}

#[derive(Clone)]
pub(super) struct Regimes {
    dynamics: Arc<SystemDynamics>,
    modes: FastModes,
    period: f64,
    end_time: f64,
    steps: Steps,
    regime: Regime,
    /// Time from which the fast modes have decayed by [`CALM_E_FOLDS`] since the last disturbance, s.
    calm_from: f64,
    /// Time until which the present slip is smooth to every digit, so that nothing has to be resolved, s.
    smooth_until: f64,
    /// Time (s), relative velocity (rad/s), and last forecast: one instant may need it twice.
    forecast: Option<(f64, f64, Forecast)>,
}

impl Regimes {
    /// `None` if sliding does not slow down by itself, or if a part has no spring.
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

    pub fn time(&self) -> Option<f64> {
        self.regime.time()
    }

    pub fn is_smooth(&self, t: f64) -> bool {
        t < self.smooth_until
    }

    fn relative_velocity(&self, location: &SystemLocation, t: f64, y: &[f64]) -> f64 {
        let outside = self.dynamics.outside(location, t);
        self.dynamics.system.relative_velocity(&outside, y)
    }

    pub fn enter(&mut self, location: &mut SystemLocation, t: f64, y: &[f64]) {
        self.smooth_until = f64::NEG_INFINITY;
        self.calm_from = self.time_of_calm(location, t, y);
        self.look_ahead(location, t, y, true);
    }

    /// Decides whether steps must resolve the fast modes at `t` (s), and until when. `excited`: something may just
    /// have excited the fast modes.
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

    fn in_linear_motion(&self, location: &SystemLocation, t: f64, excited: bool) -> (bool, Regime) {
        let slow = self.dynamics.slow_motion(location.mode);
        match slow.filter(|slow| self.steps.integrates_linear_motion && slow.fast_decay > 0.0) {
            Some(slow) if excited => (true, Regime::Relax(t + QUIET_E_FOLDS / slow.fast_decay)),
            Some(_) => (false, Regime::Keep),
            None => (true, Regime::Keep),
        }
    }

    /// For long strides in the slip at `t` (s) with the relative velocity `w` (rad/s): the speed (rad/s) below which
    /// the motion bends too much, and the time (s) at which the ringing of the normal force has decayed.
    fn stride_ahead(&self, t: f64, w: f64) -> Option<(f64, f64)> {
        let Stride { step, relative } = self.steps.stride?;
        let SystemDynamics { system, excitation, .. } = &*self.dynamics;
        let force = excitation.highest_pressing_force_after(t);
        let bent = bent_sliding(system, force, w.abs(), step, relative)?;
        Some((bent, excitation.dies_by(t, QUIET_E_FOLDS)))
    }

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

    /// A corner of a signal or of the law excites the fast modes only weakly.
    pub fn pass_corner(&mut self, location: &mut SystemLocation, t: f64, y: &[f64], resolved: bool) {
        self.disturb(location, t, y);
        let excited = resolved || self.steps.stride.is_some() && location.mode.sense() != 0;
        self.look_ahead(location, t, y, excited);
    }

    fn disturb(&mut self, location: &SystemLocation, t: f64, y: &[f64]) {
        self.smooth_until = f64::NEG_INFINITY;
        if self.foresee_smooth_sliding(location, t, y) {
            return;
        }
        self.calm_from = self.time_of_calm(location, t, y);
    }

    /// Time at which an excitation of the fast modes at `t` will have decayed, s; infinite if unknown.
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

    /// Whether the slip at `t` (s) stays smooth up to the next corner of F or to its stop. The present disturbance
    /// then decays by more e-folds than instability can restore, and an L-stable method that steps over the fast modes
    /// follows the exact solution.
    fn foresee_smooth_sliding(&mut self, location: &SystemLocation, t: f64, y: &[f64]) -> bool {
        let w = self.relative_velocity(location, t, y);
        let SystemDynamics { system, excitation, .. } = &*self.dynamics;
        // At a knot of the friction law the slow manifold has a step, which excites the fast modes.
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

    pub fn ask(&mut self, location: &mut SystemLocation, t: f64, y: &[f64]) {
        if t == 0.0 {
            self.disturb(location, t, y);
        }
        if matches!(self.regime, Regime::Relax(_)) {
            self.foresee_smooth_sliding(location, t, y);
        }
        if matches!(self.regime, Regime::Resolve(_)) {
            self.regime = Regime::Ask(t + REPLAN_PERIODS * self.period);
            // In the lead time before the instability the decision would be the same.
            location.resolved = true;
        } else {
            // A slip at the start of its case counts as excited only for a method with strides.
            let rings = t > 0.0 || location.mode.sense() == 0 || self.steps.stride.is_some();
            let excited = matches!(self.regime, Regime::Ask(_)) && location.resolved && rings;
            self.look_ahead(location, t, y, excited);
        }
    }

    /// The state to which a kick of `delta` (rad/s) is added, if it is not the computed state.
    ///
    /// After long undisturbed sliding the exact motion is on the slow manifold, and deviations of the computed state
    /// are rounding, amplified since the loss of stability. A kick of 1e-4 rad/s on the manifold itself keeps four
    /// more digits. Deviations are kept if they are too large for noise, or if the error of the manifold's series
    /// explains them: the series is less accurate than an integrator if friction changes fast.
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
