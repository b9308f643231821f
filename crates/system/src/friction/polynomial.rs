//! Friction as a cubic of the sliding speed, up to a stated speed. The pieces of a table are cubics, too.

use super::parameters::{LOW_SPEED, LawParameter, LawValue, numbers};
use super::{Bounds, Factors, Law, LawSeries};
use crate::numerics::Number;
use crate::numerics::taylor::{Unfolding, zeros};

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

/// c_0 + c_1 d + c_2 d^2 + c_3 d^3 with d = x - origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cubic {
    pub origin: f64,
    /// c_0 to c_3, (s/rad)^k.
    pub coefficients: [f64; 4],
}

impl Cubic {
    #[inline]
    pub fn value(&self, x: f64) -> f64 {
        let (d, [a, b, c, e]) = (x - self.origin, self.coefficients);
        a + d * (b + d * (c + d * e))
    }

    #[inline]
    pub fn slope(&self, x: f64) -> f64 {
        let (d, [_, b, c, e]) = (x - self.origin, self.coefficients);
        b + d * (2.0 * c + d * 3.0 * e)
    }

    fn curvature(&self, x: f64) -> f64 {
        let (d, [_, _, c, e]) = (x - self.origin, self.coefficients);
        2.0 * c + 6.0 * d * e
    }

    /// Speeds inside (`from`, `to`) with this slope, increasing.
    pub fn speeds_of_slope(&self, slope: f64, from: f64, to: f64) -> Vec<f64> {
        let [_, b, c, e] = self.coefficients;
        let constant = b - slope;
        // 3 e d^2 + 2 c d + constant = 0, in the form without cancellation.
        let discriminant = c * c - 3.0 * e * constant;
        let mut found = Vec::new();
        if discriminant >= 0.0 {
            let q = -(c + discriminant.sqrt().copysign(c));
            found.extend([q / (3.0 * e), constant / q]);
        }
        let mut found: Vec<f64> = found
            .into_iter()
            .map(|d| self.origin + d)
            .filter(|x| *x > from && *x < to)
            .collect();
        found.sort_by(f64::total_cmp);
        found.dedup();
        found
    }

    /// Speed strictly inside (`from`, `to`) at which the slope is extreme.
    fn of_no_curvature(&self, from: f64, to: f64) -> Option<f64> {
        let [_, _, c, e] = self.coefficients;
        let x = self.origin - c / (3.0 * e);
        (x > from && x < to).then_some(x)
    }

    pub fn bounds(&self, from: f64, to: f64) -> Bounds {
        let inside = self.speeds_of_slope(0.0, from, to).into_iter();
        let ends = Bounds::between(self.value(from), self.value(to));
        inside.fold(ends, |all, x| all.with(self.value(x)))
    }

    pub fn slope_bounds(&self, from: f64, to: f64) -> Bounds {
        let ends = Bounds::between(self.slope(from), self.slope(to));
        self.of_no_curvature(from, to)
            .map_or(ends, |x| ends.with(self.slope(x)))
    }

    /// The largest |mu''|, which is at an end.
    pub fn largest_curvature(&self, from: f64, to: f64) -> f64 {
        self.curvature(from).abs().max(self.curvature(to).abs())
    }
}

/// Taylor coefficients of a cubic and its slope, which are their own shapes.
#[derive(Debug, Clone)]
pub struct CubicSeries<T, const N: usize> {
    origin: T,
    coefficients: [T; 4],
    unit: T,
    /// d backwards and forwards, and d^2.
    distance: Unfolding<T, N>,
    plain: [T; N],
    square: [T; N],
    coefficient: Unfolding<T, N>,
    slope: Unfolding<T, N>,
}

impl<T: Number, const N: usize> CubicSeries<T, N> {
    pub(super) fn new(cubic: &Cubic) -> Self {
        CubicSeries {
            origin: T::of(cubic.origin),
            coefficients: cubic.coefficients.map(T::of),
            unit: T::of(1.0),
            distance: Unfolding::new(),
            plain: zeros(),
            square: zeros(),
            coefficient: Unfolding::new(),
            slope: Unfolding::new(),
        }
    }

    pub(super) fn follow(&mut self, cubic: &Cubic) {
        self.origin = T::of(cubic.origin);
        self.coefficients = cubic.coefficients.map(T::of);
    }

    /// All coefficients n from that of d.
    #[inline(always)]
    fn complete(&mut self, n: usize, distance: T) {
        self.distance.set(n, distance);
        self.plain[n] = distance;
        self.square[n] = self.distance.product(&self.plain, n, 0, n);
        let cube = self.distance.product(&self.square, n, 0, n);
        let [a, b, c, e] = self.coefficients;
        let (d, square) = (self.plain[n], self.square[n]);
        let value = b * d + c * square + e * cube;
        let slope = T::of(2.0) * c * d + T::of(3.0) * e * square;
        let (value, slope) = if n == 0 { (a + value, b + slope) } else { (value, slope) };
        self.coefficient.set(n, value);
        self.slope.set(n, slope);
    }
}

impl<T: Number, const N: usize> LawSeries<T, N> for CubicSeries<T, N> {
    #[inline(always)]
    fn factors(&self, of_coefficient: T, of_slope: T) -> Factors<T> {
        Factors {
            constant: T::of(0.0),
            shape: of_coefficient,
            slope: of_slope,
        }
    }

    #[inline(always)]
    fn start(&mut self, x: T, unit: T) {
        self.unit = unit;
        // Leftovers of another motion may not be finite.
        (self.plain, self.square) = (zeros(), zeros());
        self.complete(0, x - self.origin);
    }

    #[inline(always)]
    fn extend(&mut self, n: usize, rate: T, reciprocal: T) {
        self.complete(n, self.unit * rate * reciprocal);
    }

    #[inline(always)]
    fn shapes(&self) -> Option<[&Unfolding<T, N>; 2]> {
        Some([&self.coefficient, &self.slope])
    }
}
