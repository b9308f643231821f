//! A cubic of the sliding speed, for the law `polynomial` and the pieces of a table.

use super::{Bounds, Factors, LawSeries};
use crate::numerics::Number;
use crate::numerics::taylor::{Unfolding, zeros};

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
    pub(crate) fn largest_curvature(&self, from: f64, to: f64) -> f64 {
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
