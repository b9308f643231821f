//! Friction that falls as the inverse of the sliding speed.

use super::parameters::{HIGH_SPEED, LOW_SPEED, SCALE, numbers};
use super::{Bounds, Factors, Law, LawSeries};
use crate::numerics::Number;
use crate::numerics::taylor::{Unfolding, zeros};

/// Below this value of 1 + x/x_s the law continues along its tangent, away from the pole at -x_s.
const NEAREST_TO_POLE: f64 = 0.5;

/// Share of the distance to the pole over which some twenty coefficients represent the law: 4^-28 is 1e-17.
const REACH: f64 = 0.25;

/// mu(x) = mu_d + (mu_s - mu_d)/(1 + x/x_s), x = |omega_r|, of Galvanetto and Bishop, and of Leine et al. with
/// mu_d = 0. With mu_s < mu_d it rises with speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hyperbolic {
    /// mu_s, the limit at vanishing sliding speed.
    pub low_speed: f64,
    /// mu_d, the limit at high speed.
    pub high_speed: f64,
    /// x_s, rad/s: half of the difference is left there.
    pub scale: f64,
}

numbers!(Hyperbolic, "hyperbolic", at rest low_speed:
    low_speed = LOW_SPEED, high_speed = HIGH_SPEED, scale = SCALE);

impl Hyperbolic {
    #[inline]
    fn friction_drop(&self) -> f64 {
        self.low_speed - self.high_speed
    }

    /// (1/(1 + x/x_s), its derivative times x_s).
    #[inline]
    fn shape(&self, x: f64) -> (f64, f64) {
        let base = 1.0 + x / self.scale;
        if base < NEAREST_TO_POLE {
            let shape = 1.0 / NEAREST_TO_POLE;
            let slope = -shape * shape;
            (shape + slope * (base - NEAREST_TO_POLE), slope)
        } else {
            let shape = 1.0 / base;
            (shape, -shape * shape)
        }
    }

    fn slope(&self, x: f64) -> f64 {
        self.friction_drop() / self.scale * self.shape(x).1
    }
}

impl Law for Hyperbolic {
    type Series<T: Number, const N: usize> = HyperbolicSeries<T, N>;

    #[inline]
    fn coefficient_and_slope(&self, x: f64) -> (f64, f64) {
        let (shape, slope) = self.shape(x);
        (
            self.high_speed + self.friction_drop() * shape,
            self.friction_drop() / self.scale * slope,
        )
    }

    fn at_vanishing_speed(&self) -> f64 {
        self.low_speed
    }

    fn coefficient_bounds(&self, from: f64, to: f64) -> Bounds {
        let at = |x: f64| if x == 0.0 { self.low_speed } else { self.coefficient(x) };
        Bounds::between(at(from), at(to))
    }

    fn slope_bounds(&self, from: f64, to: f64) -> Bounds {
        Bounds::between(self.slope(from), self.slope(to))
    }

    /// At most one, where (1 + x/x_s)^2 is the ratio of the negative damping at rest to the damping.
    fn damping_zeros(&self, damping: f64, weight: f64) -> Vec<f64> {
        let ratio = weight * self.friction_drop() / self.scale / damping;
        if ratio.is_finite() && ratio >= 1.0 {
            vec![self.scale * (ratio.sqrt() - 1.0)]
        } else {
            Vec::new()
        }
    }

    #[inline]
    fn steepness_rate(&self, x: f64) -> f64 {
        2.0 / (self.scale + x)
    }

    /// The speed scale shrinks on the way down, by a half at most over a share of the scale at `x`.
    #[inline]
    fn followed_fall(&self, x: f64, share: f64) -> f64 {
        0.5 * share / self.steepness_rate(x)
    }

    /// A share of the distance to the pole at -x_s.
    fn expandable_share(&self, x: f64, change: f64) -> f64 {
        let reach = REACH * (self.scale + x);
        if change <= reach { 1.0 } else { reach / change }
    }

    /// |d^n mu/dx^n| = |mu_s - mu_d| n!/x_s^n (1 + x/x_s)^-(n + 1).
    fn speed_of_derivative(&self, order: i32, size: f64) -> f64 {
        let factorial: f64 = (1..=order).map(f64::from).product();
        let at_rest = self.friction_drop().abs() * factorial / self.scale.powi(order);
        self.scale * ((at_rest / size).powf(1.0 / f64::from(order + 1)) - 1.0)
    }

    /// A tenth of the difference is left at nine x_s.
    fn extent(&self) -> f64 {
        12.0 * self.scale
    }

    fn series<T: Number, const N: usize>(&self) -> HyperbolicSeries<T, N> {
        let (low, high) = (T::of(self.low_speed), T::of(self.high_speed));
        HyperbolicSeries {
            friction_drop: low - high,
            high_speed: high,
            scale: T::of(self.scale),
            step: T::of(0.0),
            ratio: zeros(),
            shape: Unfolding::new(),
            plain: zeros(),
            square: Unfolding::new(),
        }
    }
}

/// Taylor coefficients of q = 1/(1 + x/x_s), from q (1 + x/x_s) = 1, and of q^2, the shape of mu'.
#[derive(Debug, Clone)]
pub struct HyperbolicSeries<T, const N: usize> {
    high_speed: T,
    friction_drop: T,
    scale: T,
    step: T,
    /// Coefficients of x/x_s, except the first.
    ratio: [T; N],
    shape: Unfolding<T, N>,
    plain: [T; N],
    square: Unfolding<T, N>,
}

impl<T: Number, const N: usize> LawSeries<T, N> for HyperbolicSeries<T, N> {
    #[inline(always)]
    fn factors(&self, of_coefficient: T, of_slope: T) -> Factors<T> {
        Factors {
            constant: of_coefficient * self.high_speed,
            shape: of_coefficient * self.friction_drop,
            slope: -(of_slope * self.friction_drop / self.scale),
        }
    }

    #[inline(always)]
    fn start(&mut self, x: T, unit: T) {
        self.step = unit / self.scale;
        // Leftovers of another motion may not be finite.
        (self.ratio, self.plain) = (zeros(), zeros());
        let shape = T::of(1.0) / (T::of(1.0) + x / self.scale);
        self.plain[0] = shape;
        self.square.set(0, shape * shape);
        self.shape.set(0, shape);
    }

    #[inline(always)]
    fn extend(&mut self, n: usize, rate: T, reciprocal: T) {
        self.ratio[n] = self.step * rate * reciprocal;
        let next = -(self.plain[0] * self.shape.product(&self.ratio, n, 1, n));
        self.shape.set(n, next);
        self.plain[n] = next;
        let square = self.shape.product(&self.plain, n, 0, n);
        self.square.set(n, square);
    }

    #[inline(always)]
    fn shapes(&self) -> Option<[&Unfolding<T, N>; 2]> {
        Some([&self.shape, &self.square])
    }
}
