//! Friction as a cubic of the sliding speed, up to a stated speed.

use super::cubic::{Cubic, CubicSeries};
use super::parameters::{LOW_SPEED, LawParameter, LawValue, numbers};
use super::{Bounds, Law};
use crate::numerics::Number;

/// mu(x) = mu_s + c_1 x + c_2 x^2 + c_3 x^3, x = |omega_r|, up to a given speed: of Popp and others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Polynomial {
    /// mu_s, the limit at vanishing sliding speed.
    pub low_speed: f64,
    /// c_1, s/rad.
    pub linear: f64,
    /// c_2, (s/rad)^2.
    pub quadratic: f64,
    /// c_3, (s/rad)^3.
    pub cubic: f64,
    /// Largest speed of the law, rad/s.
    pub valid_below: f64,
}

numbers!(Polynomial, "polynomial", at rest low_speed:
    low_speed = LOW_SPEED,
    linear = LawParameter::new(LawValue::Any, -1,
        "c_1, slope of the friction coefficient at vanishing sliding speed"),
    quadratic = LawParameter::new(LawValue::Any, -2, "c_2, coefficient of the square of the sliding speed").or("0"),
    cubic = LawParameter::new(LawValue::Any, -3, "c_3, coefficient of the cube of the sliding speed").or("0"),
    valid_below = LawParameter::new(LawValue::Positive, 1,
        "sliding speed up to which the polynomial is given; a run that gets there ends with an error");
    complaints |law| law.negative());

impl Polynomial {
    #[inline]
    fn whole(&self) -> Cubic {
        Cubic {
            origin: 0.0,
            coefficients: [self.low_speed, self.linear, self.quadratic, self.cubic],
        }
    }

    fn negative(&self) -> Vec<(String, String)> {
        let least = self.coefficient_bounds(0.0, self.valid_below).least;
        if least >= 0.0 {
            return Vec::new();
        }
        let message = format!(
            "must be a speed up to which the friction coefficient is not negative, but below {:?} rad/s it falls to {least:?}: \
             lower valid_below, or change the coefficients",
            self.valid_below
        );
        vec![("valid_below".to_owned(), message)]
    }
}

impl Law for Polynomial {
    type Series<T: Number, const N: usize> = CubicSeries<T, N>;

    #[inline]
    fn coefficient_and_slope(&self, x: f64) -> (f64, f64) {
        let whole = self.whole();
        (whole.value(x), whole.slope(x))
    }

    fn at_vanishing_speed(&self) -> f64 {
        self.low_speed
    }

    fn coefficient_bounds(&self, from: f64, to: f64) -> Bounds {
        self.whole().bounds(from, to.min(self.valid_below).max(from))
    }

    fn slope_bounds(&self, from: f64, to: f64) -> Bounds {
        self.whole().slope_bounds(from, to.min(self.valid_below).max(from))
    }

    fn knots(&self) -> &[f64] {
        std::slice::from_ref(&self.valid_below)
    }

    fn ends_at(&self) -> f64 {
        self.valid_below
    }

    /// At most two.
    fn damping_zeros(&self, damping: f64, weight: f64) -> Vec<f64> {
        let mut zeros = self.whole().speeds_of_slope(-damping / weight, 0.0, self.valid_below);
        // A slope that only touches this value changes no sign.
        if zeros.len() == 1 {
            let sign = |x: f64| damping + weight * self.whole().slope(x) > 0.0;
            if sign(0.0) == sign(self.valid_below) {
                zeros.clear();
            }
        }
        zeros.reverse();
        zeros
    }

    /// Without a zero, the slope at the end of the law decides.
    fn damped_from(&self, damping: f64, weight: f64) -> f64 {
        if damping + weight * self.whole().slope(self.valid_below) < 0.0 {
            return f64::INFINITY;
        }
        self.damping_zeros(damping, weight).first().copied().unwrap_or(0.0)
    }

    fn steepness_rate(&self, _: f64) -> f64 {
        let slopes = self.slope_bounds(0.0, f64::INFINITY);
        let largest = slopes.most.abs().max(slopes.least.abs());
        if largest > 0.0 {
            self.whole().largest_curvature(0.0, self.valid_below) / largest
        } else {
            0.0
        }
    }

    fn followed_fall(&self, x: f64, share: f64) -> f64 {
        share / self.steepness_rate(x)
    }

    fn speed_of_derivative(&self, order: i32, _: f64) -> f64 {
        if order > 3 { 0.0 } else { self.valid_below }
    }

    fn extent(&self) -> f64 {
        self.valid_below
    }

    fn series<T: Number, const N: usize>(&self) -> CubicSeries<T, N> {
        CubicSeries::new(&self.whole())
    }
}
