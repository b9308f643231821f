//! Steps over the fast modes in slips of a system that does not slow down by itself.
//!
//! No formula predicts such a slip. It is integrated ahead of the run, with an accuracy that suffices for sliding speed
//! and normal force. At each step the spectrum of the linearised slip must show that the fast modes decay for every
//! contact damping in the step. The slow modes limit the step, so that a resolved mode may grow. The prediction decides
//! about steps only, and never enters a result.

use super::plan::sizes;
use super::regime::{QUIET_E_FOLDS, REPLAN_PERIODS};
use super::series::collocation::SlipProblem;
use super::series::{STAGES, tableau};
use crate::hybrid::dynamics::{SystemDynamics, SystemLocation};
use std::f64::consts::TAU;
use std::sync::Arc;
use stickslip_system::friction::{Bounds, Law};
use stickslip_system::model::stability::{Slow, Spectrum, last_quiet_time};
use stickslip_system::numerics::radau::{Attempt, Radau};

/// Relative tolerance of the prediction. Smaller oscillations are stepped over in the prediction, and left to the run.
const RELATIVE: f64 = 1e-4;

/// Most attempted steps of a prediction. A longer slip is predicted piece by piece.
const MOST_ATTEMPTS: usize = 200;

/// Shortest worthwhile step in periods of the fastest mode. Modes that turn by less than a radian in it are slow.
pub(super) const LONG: f64 = 4.0;

/// Shortest worthwhile sequence of such steps, in the same periods.
const SHORTEST_STRETCH: f64 = 50.0;

/// With more twists and speeds the spectra cost more than the saved steps.
const MOST_COMPONENTS: usize = 40;

/// Number of doublings of the waiting time after predictions that find no quiet time.
const MOST_DOUBLINGS: i32 = 4;

const LARGEST_GROWTH: f64 = 4.0;

const NONE: Bounds = Bounds {
    least: f64::INFINITY,
    most: f64::NEG_INFINITY,
};

#[derive(Debug, Clone, Copy)]
struct ForeseenQuiet {
    until: f64,
    /// Longest step that resolves the slow modes and the signals, s.
    longest: f64,
}

#[derive(Clone)]
pub(super) struct Foresight {
    dynamics: Arc<SystemDynamics>,
    spectrum: Spectrum,
    period: f64,
    /// Times of corners of signals and of kicks, increasing, s. A prediction ends at the next one.
    disturbances: Vec<f64>,
    end_time: f64,
    radau: Radau<STAGES>,
    /// Time of the next prediction (s), and number of failed predictions since the last quiet time or disturbance.
    ask_at: f64,
    in_vain: i32,
    longest: f64,
}

impl Foresight {
    /// For a run to `end_time` (s) with kicks at these times (s). `None` if nothing moves by itself, or if the system
    /// is large.
    pub fn new(dynamics: &Arc<SystemDynamics>, kicks: impl Iterator<Item = f64>, end_time: f64) -> Option<Foresight> {
        let (system, fastest) = (&dynamics.system, dynamics.rates.fastest);
        let mut disturbances: Vec<f64> = dynamics.excitation.corners().iter().copied().chain(kicks).collect();
        disturbances.sort_by(f64::total_cmp);
        (fastest > 0.0 && system.mechanical() <= MOST_COMPONENTS).then(|| Foresight {
            spectrum: Spectrum::new(system, None, Slow::UpTo(fastest / (TAU * LONG))),
            period: TAU / fastest,
            disturbances,
            end_time,
            radau: Radau::new(tableau().clone(), system.mechanical(), system.dimension),
            ask_at: 0.0,
            in_vain: 0,
            longest: f64::INFINITY,
            dynamics: dynamics.clone(),
        })
    }

    pub fn time(&self) -> Option<f64> {
        self.ask_at.is_finite().then_some(self.ask_at)
    }

    pub fn longest_step(&self, location: &SystemLocation) -> Option<f64> {
        let strides = !location.resolved && location.mode.sense() != 0;
        strides.then_some(self.longest).filter(|longest| longest.is_finite())
    }

    /// Restarts planning after a change of mode, a kick or a corner at `t` (s), which excites the fast modes.
    pub fn enter(&mut self, location: &mut SystemLocation, t: f64) {
        location.resolved = true;
        self.in_vain = 0;
        self.ask_at = match location.mode.sense() {
            0 => f64::INFINITY,
            _ => t + REPLAN_PERIODS * self.period,
        };
    }

    /// Predicts a slip from `t` (s): decides whether steps must resolve the fast modes, and until when.
    pub fn ask(&mut self, location: &mut SystemLocation, t: f64, y: &[f64]) {
        if location.mode.sense() == 0 {
            return self.enter(location, t);
        }
        let quiet = self.look_ahead(location, t, y);
        location.resolved = quiet.is_none();
        if let Some(ForeseenQuiet { until, longest }) = quiet {
            self.in_vain = 0;
            self.longest = longest;
            // A slow mode may grow, so that the next prediction comes halfway through the quiet time.
            let half = 0.5 * (until.min(self.end_time) - t);
            self.ask_at = until.min(t + half.max(SHORTEST_STRETCH * self.period));
        } else {
            self.ask_at = t + REPLAN_PERIODS * self.period * f64::from(1 << self.in_vain);
            self.in_vain = (self.in_vain + 1).min(MOST_DOUBLINGS);
        }
    }

    fn look_ahead(&mut self, location: &SystemLocation, t: f64, y: &[f64]) -> Option<ForeseenQuiet> {
        let dynamics = self.dynamics.clone();
        let (system, excitation) = (&dynamics.system, &dynamics.excitation);
        let law = system.law_in(location.sign(), location.piece);
        let least = LONG * self.period;
        let disturbance = self.disturbances.iter().find(|at| **at > t);
        let next = disturbance.map_or(self.end_time, |at| at.min(self.end_time));
        let span = next - t;
        let slip = SlipProblem {
            dynamics: &dynamics,
            location: *location,
            origin: t,
        };
        let outside = excitation.at(location.stretch, t);
        let mut weights: Vec<f64> = sizes(&dynamics, location.stretch, &outside, y)
            .into_iter()
            .map(|size| RELATIVE * size)
            .collect();
        weights[system.slip..].fill(f64::INFINITY);
        let harmonics = excitation.fastest(location.stretch);
        let mut longest = if harmonics > 0.0 {
            1.0 / harmonics
        } else {
            f64::INFINITY
        };
        let (mut y, mut stage) = (y.to_vec(), y.to_vec());
        let (mut tau, mut damping) = (0.0, 0.0);
        let mut path = vec![(t, damping)];
        let mut step = 2.0 * least;
        let mut predicted = false;
        for _ in 0..MOST_ATTEMPTS {
            let left = span - tau;
            let length = step.min(longest).min(left);
            if length <= 0.0 || length < least && length < left {
                break;
            }
            let error = match self.radau.attempt(&slip, tau, &y, length, &weights, predicted) {
                Attempt::Solved { error } if error.is_finite() => error,
                _ => f64::INFINITY,
            };
            let factor = 0.9 * error.powf(-1.0 / f64::from(Radau::<STAGES>::ESTIMATE_ORDER));
            step = length * factor.clamp(0.1, LARGEST_GROWTH);
            predicted = error.is_finite();
            if error > 1.0 {
                continue;
            }
            // Speeds and forces in the step, while it stays in this slip and on this piece of the law.
            let (mut speeds, mut forces) = (NONE, NONE);
            let mut take = |tau: f64, y: &[f64]| {
                let outside = excitation.at(location.stretch, t + tau);
                let speed = location.sign() * system.relative_velocity(&outside, y);
                speeds = speeds.with(speed);
                forces = forces.with(outside.normal_force);
                speed > 0.0 && system.piece_of(speed) == location.piece && outside.normal_force > 0.0
            };
            let mut slips = take(tau, &y);
            for i in 0..STAGES {
                self.radau.stage(i, &mut stage);
                slips = slips && take(tau + self.radau.node(i) * length, &stage);
            }
            if !slips {
                break;
            }
            let slopes = law.slope_bounds(speeds.least, speeds.most);
            let slopes = [slopes.least, slopes.most].into_iter();
            let kappas =
                slopes.flat_map(|slope| [forces.least, forces.most].map(|force| system.radius * force * slope));
            let rates = self.spectrum.over(system, kappas.fold(NONE, Bounds::with));
            let decays = rates.decay > 0.0 && rates.decay.is_finite();
            if !decays {
                break;
            }
            longest = longest.min(1.0 / rates.slow);
            y.copy_from_slice(&stage);
            tau = if length < left { tau + length } else { span };
            damping += rates.decay * length;
            path.push((t + tau, damping));
        }
        // After the end of the run nothing amplifies an error.
        let until = match tau == span && next == self.end_time {
            true => f64::INFINITY,
            false => last_quiet_time(&path, QUIET_E_FOLDS)?,
        };
        let worth = longest >= least && until >= t + SHORTEST_STRETCH * self.period;
        worth.then_some(ForeseenQuiet { until, longest })
    }
}
