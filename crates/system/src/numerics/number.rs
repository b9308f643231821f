//! Operations that the recurrences require of a number.

use std::array;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A real number: `f64` for a run, or an enclosure for a proof.
///
/// The recurrences use the same operations in the same order for every type. If each operation of an enclosure
/// contains the `f64` results for all points inside, so do the recurrences.
pub trait Number:
    Copy
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// The number nearest to `x`.
    fn of(x: f64) -> Self;

    /// pi.
    fn pi() -> Self;

    /// e^self.
    fn exp(self) -> Self;

    /// e^self - 1.
    fn exp_m1(self) -> Self;

    /// Square root.
    fn sqrt(self) -> Self;

    /// Sine and cosine.
    fn sin_cos(self) -> (Self, Self);

    /// Hyperbolic tangent.
    fn tanh(self) -> Self;

    /// Hyperbolic cosine.
    fn cosh(self) -> Self;

    /// Arc tangent.
    fn atan(self) -> Self;

    /// Whether the magnitude is certainly below `bound`.
    fn is_within(self, bound: f64) -> bool {
        Self::of(-bound) < self && self < Self::of(bound)
    }

    /// self times `factor`, which often is a sign.
    #[inline(always)]
    fn times(self, factor: f64) -> Self {
        Self::of(factor) * self
    }

    /// The sum over k of `a[k] b[k]`, for slices of equal length. Each of four partial sums takes every fourth
    /// product, because a single sum would wait for each addition.
    #[inline(always)]
    fn dot(a: &[Self], b: &[Self]) -> Self {
        let mut sums = [Self::of(0.0); 4];
        let ((quads, ends), (others, other_ends)) = (a.as_chunks::<4>(), b.as_chunks::<4>());
        for (x, y) in quads.iter().zip(others) {
            sums = array::from_fn(|j| sums[j] + x[j] * y[j]);
        }
        for (sum, (x, y)) in sums.iter_mut().zip(ends.iter().zip(other_ends)) {
            *sum = *sum + *x * *y;
        }
        (sums[0] + sums[1]) + (sums[2] + sums[3])
    }
}

macro_rules! own {
    ($($function:ident -> $value:ty),+) => {
        $(#[inline]
        fn $function(self) -> $value {
            f64::$function(self)
        })+
    };
}

impl Number for f64 {
    #[inline]
    fn of(x: f64) -> f64 {
        x
    }

    #[inline]
    fn pi() -> f64 {
        std::f64::consts::PI
    }

    own!(exp -> f64, exp_m1 -> f64, sqrt -> f64, sin_cos -> (f64, f64), tanh -> f64, cosh -> f64, atan -> f64);
}
