//! Taylor steps: of the slip, and along its slow manifold.

use super::super::brake::GUARD_STOPPING;
use super::super::rules::LARGEST_TIME_SCALE_RATIO;
use super::{Last, STEP_NOISE, SemiAnalyticEngine, TERMS};
use crate::friction::Law;
use crate::hybrid::{Advance, EngineError, Fired};
use crate::model::slow_manifold::SlowSeries;
use crate::model::state::{Components, DYNAMIC, TorsionState};
use crate::numerics::polynomial_roots::first_falling;
use crate::numerics::taylor;

/// The last coefficient of a series along the slow manifold that is to be trusted.
pub(in crate::simulation) const SLOW_ORDER: usize = TERMS - 4;

/// Shortest step along the slow manifold, in natural periods: below it there is none to speak of.
pub(in crate::simulation) const SHORTEST_SLOW: f64 = 2.0;

/// Share of the torques within which their sum counts as zero at a tangential departure: mu_0 r F_n against mu_s r F_n,
/// at a breakaway located to the last place.
const DEPARTURE_NOISE: f64 = 1e-10;

impl SemiAnalyticEngine {
    /// Expands the slip about where it stands.
    pub(super) fn expand(&mut self) {
        let t = self.origin + self.tau;
        let degree = self.brake.axial.pressing_series(t, self.unit, &mut self.force);
        // Steps along the slow manifold leave another one.
        self.series.unit = self.unit;
        self.series.expand(self.sense(), &self.y, &self.force, degree);
        self.counters.rhs_evaluations += 1;
    }

    /// How fast the fast mode moves (rad/s), from an expansion: an oscillation A cos(omega_n t) has the last coefficient
    /// A / (TERMS - 1)! in the series' unit, and nothing slower comes near that.
    pub(super) fn ringing_rate(&self) -> f64 {
        let factorial: f64 = (1..TERMS).map(|n| n as f64).product();
        let last = Components::of(&self.series.state.each_ref().map(|series| series[TERMS - 1].abs()));
        factorial * last.rotor_twist_rate.max(last.stator_twist_rate)
    }

    /// A step along the slow manifold, if the slip is on it, to what a step may leave beside it: the motion without the
    /// fast mode is a series of its own, and stays where it is even where the manifold is unstable. What is too large for
    /// the error of a step is left alone.
    pub(super) fn slow_step(&mut self) -> Result<Option<Advance>, EngineError> {
        let t = self.origin + self.tau;
        let brake = self.brake.clone();
        if !brake.axial.is_silent(t) {
            return Ok(None);
        }
        let (torsion, sense) = (brake.torsion_in(&self.location), self.sense());
        let axial = brake.axial.at(t);
        let pressing = (axial.pressing_force, axial.pressing_rate);
        let slow = SlowSeries::<TERMS>::new(torsion, sense, pressing, torsion.torsion.slow_momentum(&self.y));
        let (start, weights) = (slow.start(), self.weights());
        if !(0..DYNAMIC).all(|k| (start[k] - self.y[k]).abs() <= STEP_NOISE * weights[k]) {
            return Ok(None);
        }
        slow.write(torsion, sense, pressing, &self.y, &mut self.series);
        let longest = self.longest_expansion(SLOW_ORDER, &weights);
        let left = self.span - self.tau;
        let rate = self.series.relative_velocity[1];
        let slope = torsion.torsion.damping - self.series.stability_margin[0];
        let law = &brake.torsion.friction.law;
        let steepness = law.steepness_rate(self.series.relative_velocity[0].abs());
        let time_scale_ratio = slope / torsion.torsion.stiffness * steepness * rate.abs();
        let short = longest < left && longest < SHORTEST_SLOW * torsion.natural_period();
        if longest.is_nan() || short || time_scale_ratio > LARGEST_TIME_SCALE_RATIO {
            return Ok(None);
        }
        self.expansion_step(longest).map(Some)
    }

    /// The longest step of at most `longest` (s) over which the friction law may be taken from its Taylor coefficients. The
    /// speed's terms, all taken as positive, bound its change, and grow faster than the step.
    fn within_law(&self, longest: f64) -> f64 {
        let speed = &self.series.relative_velocity;
        let longest = longest.min(self.span - self.tau);
        let x = longest / self.series.unit;
        let change = speed[1..=SLOW_ORDER]
            .iter()
            .rev()
            .fold(0.0, |sum, c| (sum + c.abs()) * x);
        longest * self.brake.torsion.friction.law.expandable_share(speed[0].abs(), change)
    }

    /// The longest step of the expansion whose terms fall below what is tolerated by this order (s), no longer than to the
    /// end of the segment.
    pub(super) fn longest_expansion(&self, order: usize, weights: &TorsionState) -> f64 {
        let size = |n: usize| {
            (0..DYNAMIC)
                .map(|k| self.series.state[k][n].abs() / weights[k])
                .fold(0.0, |a: f64, b| if b <= a { a } else { b })
        };
        self.within_law(taylor::step(order, size) * self.series.unit)
    }

    /// A step of at most `longest` (s) by the expansion about where it stands.
    pub(super) fn expansion_step(&mut self, longest: f64) -> Result<Advance, EngineError> {
        let unit = self.series.unit;
        if longest.is_nan() {
            return Err(EngineError::NotFinite);
        }
        let left = self.span - self.tau;
        let bound = longest.min(self.max_step);
        let reaches = bound >= left;
        let length = if reaches { left } else { bound };
        let tau = self.tau + length;
        if tau <= self.tau {
            return Err(EngineError::StepTooShort { step: length });
        }
        let mut earliest: Option<(f64, usize)> = None;
        for (index, sign) in self.guards() {
            if let Some(share) = self.first_root(index, sign, length / unit)
                && earliest.is_none_or(|(before, _)| share < before)
            {
                earliest = Some((share, index));
            }
        }
        self.last = Last::Expansion(self.tau);
        self.first = false;
        self.counters.steps += 1;
        self.counters.last_order = TERMS as u32 - 1;
        let length = earliest.map_or(length, |(share, _)| share * length);
        self.counters.last_step = length;
        self.y = self.series.at(&(length / unit));
        self.tau = if earliest.is_some() { self.tau + length } else { tau };
        self.beyond = self.beyond && self.guard(GUARD_STOPPING, self.tau, &self.y) < 0.0;
        Ok(match earliest {
            Some((_, index)) => Advance::Guards(Fired::one(index)),
            None if reaches => Advance::Stop,
            None => Advance::Stepped,
        })
    }

    /// The first share of the expansion's first `x` units at which a guard fires.
    fn first_root(&mut self, index: usize, sign: f64, x: f64) -> Option<f64> {
        self.counters.root_evaluations += 1;
        // (the series, its sign, what is added to it)
        let (series, sign, constant) = match self.end_of_piece(index) {
            None if index == GUARD_STOPPING => (&self.series.relative_velocity, sign * self.sense(), 0.0),
            None => (&self.series.stability_margin, sign, 0.0),
            Some(above) => {
                let (sign, knot) = self.brake.end_of_piece(&self.location, above)?;
                (&self.series.relative_velocity, sign * self.sense(), -sign * knot)
            }
        };
        let mut power = sign;
        let mut guard = series.map(|c| {
            let scaled = c * power;
            power *= x;
            scaled
        });
        if constant != 0.0 {
            guard[0] += constant;
        }
        if self.first && guard[0].abs() <= self.noise(index) {
            // It leaves zero here: the root, simple or double, is divided out.
            let torsion = &self.brake.torsion;
            let torques = torsion.torsion.rotor_torque(&self.y).abs() + torsion.torsion.stator_torque(&self.y).abs();
            let slope_noise = DEPARTURE_NOISE * torques / torsion.torsion.surface_inertia * self.series.unit * x;
            // Without c_t the margin's zero is the force's, which a force that sets in at a corner leaves tangentially.
            let (force_noise, rate_noise) = self.noise_of_force();
            let double = if index == GUARD_STOPPING || self.end_of_piece(index).is_some() {
                guard[1].abs() <= slope_noise
            } else {
                torsion.torsion.damping < force_noise && guard[1].abs() < rate_noise * self.series.unit * x
            };
            let roots = if double { 2 } else { 1 };
            guard.rotate_left(roots);
            guard[TERMS - roots..].fill(0.0);
        }
        if guard[0] < 0.0 && !(self.beyond && index == GUARD_STOPPING) {
            Some(0.0)
        } else {
            first_falling(&guard)
        }
    }
}
