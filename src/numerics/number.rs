//! What the series need of a number.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A real number of some precision: `f64`, or one with more digits.
pub trait Number:
    Clone
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// The number nearest to `x`.
    fn of(x: f64) -> Self;

    /// e to the power of it.
    fn exp(&self) -> Self;

    /// The sum over k of `a[k] b[k]`: both slices have the same length.
    fn dot(a: &[Self], b: &[Self]) -> Self {
        let mut sum = Self::of(0.0);
        for (x, y) in a.iter().zip(b) {
            sum = sum + x.clone() * y.clone();
        }
        sum
    }
}

impl Number for f64 {
    #[inline]
    fn of(x: f64) -> f64 {
        x
    }

    #[inline]
    fn exp(&self) -> f64 {
        f64::exp(*self)
    }

    /// Four partial sums: one alone would wait for each addition.
    #[inline]
    fn dot(a: &[f64], b: &[f64]) -> f64 {
        let mut sums = [0.0; 4];
        let (quads, others) = (a.chunks_exact(4), b.chunks_exact(4));
        let (ends, other_ends) = (quads.remainder(), others.remainder());
        for (x, y) in quads.zip(others) {
            for j in 0..4 {
                sums[j] += x[j] * y[j];
            }
        }
        for (sum, (x, y)) in sums.iter_mut().zip(ends.iter().zip(other_ends)) {
            *sum += x * y;
        }
        (sums[0] + sums[1]) + (sums[2] + sums[3])
    }
}
