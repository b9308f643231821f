//! Friction that falls exponentially with speed, equation (8).

use super::parameters::{HIGH_SPEED, LOW_SPEED, LawParameter, LawValue, numbers};
use super::{Bounds, Factors, Law, LawSeries};
use crate::numerics::Number;
use crate::numerics::taylor::{Unfolding, zeros};

/// Below this exponent exp is zero in doubles, and slow to compute.
const VANISHED: f64 = -746.0;

/// E-folds after which the exponential is below the rounding of the rest.
const FLAT: f64 = 40.0;

/// Least decay (s/rad) for steps: a change over more than 1000 rad/s needs no following.
const SLOWEST_DECAY: f64 = 1e-3;

/// Largest change of the exponential, in e-folds, over the reach of its Taylor coefficients: its terms grow up to that
/// index, and only the terms beyond it show the error.
const E_FOLDS: f64 = 6.0;

const NEGLIGIBLE: f64 = 1e-18;

/// mu(x) = mu_d + (mu_s - mu_d) exp(-alpha x), x = |omega_r|. With mu_s < mu_d it rises with speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exponential {
    /// mu_s, the limit at vanishing sliding speed.
    pub low_speed: f64,
    /// mu_d, at high speed.
    pub high_speed: f64,
    /// alpha, s/rad.
    pub decay: f64,
}

numbers!(Exponential, "exponential", at rest low_speed:
    low_speed = LOW_SPEED, high_speed = HIGH_SPEED,
    decay = LawParameter::new(LawValue::NotNegative, -1, "alpha, decay of the friction coefficient with sliding speed"));

impl Exponential {
    #[inline]
    fn friction_drop(&self) -> f64 {
        self.low_speed - self.high_speed
    }

    #[inline]
    fn excess(&self, x: f64) -> f64 {
        let exponent = -self.decay * x;
        if exponent < VANISHED {
            return 0.0;
        }
        self.friction_drop() * exponent.exp()
    }

    fn slope(&self, x: f64) -> f64 {
        self.coefficient_and_slope(x).1
    }
}

impl Law for Exponential {
    type Series<T: Number, const N: usize> = ExponentialSeries<T, N>;

    #[inline]
    fn coefficient_and_slope(&self, x: f64) -> (f64, f64) {
        let excess = self.excess(x);
        (self.high_speed + excess, -self.decay * excess)
    }

    fn at_vanishing_speed(&self) -> f64 {
        self.low_speed
    }

    /// Monotonic: bounds are at the ends. Even without decay the limit at high speed counts as mu_d.
    fn coefficient_bounds(&self, from: f64, to: f64) -> Bounds {
        let at = |x: f64| match x {
            0.0 => self.low_speed,
            f64::INFINITY => self.high_speed,
            _ => self.coefficient(x),
        };
        Bounds::between(at(from), at(to))
    }

    fn slope_bounds(&self, from: f64, to: f64) -> Bounds {
        let at = |x: f64| if x.is_infinite() { 0.0 } else { self.slope(x) };
        Bounds::between(at(from), at(to))
    }

    /// At most one: the negative damping falls with speed.
    fn damping_zeros(&self, damping: f64, weight: f64) -> Vec<f64> {
        let left_at_rest = damping + weight * self.slope(0.0);
        let taken_at_rest = damping - left_at_rest;
        let ratio = taken_at_rest / damping;
        if taken_at_rest > 0.0 && ratio.is_finite() && ratio >= 1.0 {
            vec![ratio.ln() / self.decay]
        } else {
            Vec::new()
        }
    }

    #[inline]
    fn steepness_rate(&self, _: f64) -> f64 {
        self.decay
    }

    #[inline]
    fn followed_fall(&self, x: f64, share: f64) -> f64 {
        let decay = self.decay.max(SLOWEST_DECAY);
        (share / decay).max(0.5 * (x - FLAT / decay))
    }

    /// A change by six e-folds, or until the exponential is negligible.
    fn expandable_share(&self, x: f64, change: f64) -> f64 {
        let allowed = (self.decay * x + NEGLIGIBLE.ln()).max(E_FOLDS);
        if self.decay * change <= allowed {
            1.0
        } else {
            allowed / (self.decay * change)
        }
    }

    fn speed_of_derivative(&self, order: i32, size: f64) -> f64 {
        ((self.friction_drop().abs() / size).ln() + f64::from(order) * self.decay.ln()) / self.decay
    }

    fn series<T: Number, const N: usize>(&self) -> ExponentialSeries<T, N> {
        let (low, high) = (T::of(self.low_speed), T::of(self.high_speed));
        ExponentialSeries {
            friction_drop: low - high,
            high_speed: high,
            decay: T::of(self.decay),
            step: T::of(0.0),
            exponent_rate: zeros(),
            exponential: Unfolding::new(),
        }
    }
}

/// Taylor coefficients of exp(-alpha x(t)), the shape of mu and of mu': e = exp(a) follows from e' = a' e.
#[derive(Debug, Clone)]
pub struct ExponentialSeries<T, const N: usize> {
    high_speed: T,
    friction_drop: T,
    decay: T,
    step: T,
    /// k times coefficient k of -alpha x.
    exponent_rate: [T; N],
    exponential: Unfolding<T, N>,
}

impl<T: Number, const N: usize> LawSeries<T, N> for ExponentialSeries<T, N> {
    #[inline(always)]
    fn factors(&self, of_coefficient: T, of_slope: T) -> Factors<T> {
        Factors {
            constant: of_coefficient * self.high_speed,
            shape: of_coefficient * self.friction_drop,
            slope: -(of_slope * self.decay * self.friction_drop),
        }
    }

    #[inline(always)]
    fn start(&mut self, x: T, unit: T) {
        self.step = -(self.decay * unit);
        // Leftovers of another motion may not be finite.
        self.exponent_rate = zeros();
        let exponent = -(self.decay * x);
        self.exponential.set(0, exponent.exp());
    }

    #[inline(always)]
    fn extend(&mut self, n: usize, rate: T, reciprocal: T) {
        self.exponential
            .exponential(&mut self.exponent_rate, n, self.step * rate, reciprocal);
    }

    #[inline(always)]
    fn shapes(&self) -> Option<[&Unfolding<T, N>; 2]> {
        Some([&self.exponential; 2])
    }
}
