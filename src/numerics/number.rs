//! The operations that a number needs for the recurrences.

use std::array;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A real number: `f64` for a run, several of them side by side for an ensemble, an enclosure for a proof.
///
/// The recurrences take the same operations in the same order for every type. An enclosure whose operations hold what those of
/// `f64` give for all points inside therefore holds what the recurrences give in `f64`.
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

    /// e to the power of it.
    fn exp(self) -> Self;

    /// The same less 1.
    fn exp_m1(self) -> Self;

    /// Its square root.
    fn sqrt(self) -> Self;

    /// Its sine and cosine.
    fn sin_cos(self) -> (Self, Self);

    /// Its hyperbolic tangent.
    fn tanh(self) -> Self;

    /// Its hyperbolic cosine.
    fn cosh(self) -> Self;

    /// Its arc tangent.
    fn atan(self) -> Self;

    /// Whether it is certainly below `bound` in magnitude.
    fn is_within(self, bound: f64) -> bool {
        Self::of(-bound) < self && self < Self::of(bound)
    }

    /// It times `factor`, which is often a sign.
    #[inline(always)]
    fn times(self, factor: f64) -> Self {
        Self::of(factor) * self
    }

    /// The sum over k of `a[k] b[k]`: both slices have the same length. In four partial sums, of every fourth product: one alone
    /// would wait for each addition.
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

/// The functions that `f64` has itself.
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
