//! Sine, cosine, arc tangent and hyperbolic tangent, with tables for the recurrences.

use super::float::Float;
use num_bigint::{BigInt, BigUint};
use num_rational::BigRational;
use num_traits::{One, Zero};

/// Tables and constants of the arithmetic.
#[derive(Debug)]
pub struct Elementary<const N: usize> {
    /// 1/k; 1 for k = 0.
    pub reciprocals: Vec<Float<N>>,
    /// k.
    pub integers: Vec<Float<N>>,
    /// ln 2.
    pub ln_2: Float<N>,
    /// pi.
    pub pi: Float<N>,
}

impl<const N: usize> Elementary<N> {
    /// Tables up to `largest`.
    pub fn new(largest: usize) -> Self {
        let integer = |k: usize| BigRational::from_integer(BigInt::from(k));
        let number = Float::from_rational;
        Elementary {
            reciprocals: (0..=largest).map(|k| number(&integer(k.max(1)).recip())).collect(),
            integers: (0..=largest).map(|k| number(&integer(k))).collect(),
            ln_2: Float::ln_2(),
            pi: pi(),
        }
    }

    /// sin x and cos x, with an error in the last bits of max(1, |x|).
    pub fn sine_and_cosine(&self, x: &Float<N>) -> [Float<N>; 2] {
        let half_pi = self.pi.half();
        let quarters = (x.to_f64() / std::f64::consts::FRAC_PI_2).round();
        if !quarters.is_finite() {
            return [x.over(&Float::zero()), x.over(&Float::zero())];
        }
        let rest = x - &(&half_pi * &Float::from_f64(quarters));
        let square = -&(&rest * &rest);
        let series = |first: Float<N>, index: usize| {
            let (mut term, mut sum, mut k) = (first, first, index);
            while term.exponent > -(Float::<N>::BITS as i64) - 4 && k + 2 < self.reciprocals.len() {
                term = &(&(&term * &square) * &self.reciprocals[k + 1]) * &self.reciprocals[k + 2];
                sum += &term;
                k += 2;
            }
            sum
        };
        let (sine, cosine) = (series(rest, 1), series(Float::from_f64(1.0), 0));
        match quarters.rem_euclid(4.0) as u8 {
            0 => [sine, cosine],
            1 => [cosine, -&sine],
            2 => [-&sine, -&cosine],
            _ => [-&cosine, sine],
        }
    }

    /// The angle whose tangent is y: a double near it, corrected by the tangent of the difference.
    pub fn arc_tangent(&self, y: &Float<N>) -> Float<N> {
        let near = Float::from_f64(y.to_f64().atan());
        let [sine, cosine] = self.sine_and_cosine(&near);
        let tangent = (&(y * &cosine) - &sine).over(&(&cosine + &(y * &sine)));
        let square = -&(&tangent * &tangent);
        let (mut power, mut sum, mut k) = (tangent, tangent, 1);
        while power.exponent > -(Float::<N>::BITS as i64) - 4 && k + 2 < self.reciprocals.len() {
            power = &power * &square;
            k += 2;
            sum += &(&power * &self.reciprocals[k]);
        }
        &near + &sum
    }

    /// tanh y and 1 - tanh^2 y, for y near 0 or positive. The second is accurate to its own last bits.
    pub fn hyperbolic_tangent(&self, y: &Float<N>) -> [Float<N>; 2] {
        let one = Float::from_f64(1.0);
        let e = (&-y - y).exp(&self.ln_2, &self.reciprocals);
        let sum = &one + &e;
        let four = Float::from_f64(4.0);
        [(&one - &e).over(&sum), (&four * &e).over(&(&sum * &sum))]
    }
}

/// pi = 16 arctan(1/5) - 4 arctan(1/239) (Machin).
pub fn pi<const N: usize>() -> Float<N> {
    let unit = BigUint::one() << (Float::<N>::BITS + 64);
    let inverse = |n: u32| {
        let (mut power, mut plus, mut minus, mut k) = (&unit / n, BigUint::zero(), BigUint::zero(), 0u32);
        while !power.is_zero() {
            let term = &power / (2 * k + 1);
            if k.is_multiple_of(2) {
                plus += term;
            } else {
                minus += term;
            }
            power /= n * n;
            k += 1;
        }
        plus - minus
    };
    let sum = inverse(5) * 16u32 - inverse(239) * 4u32;
    Float::quotient(&sum, &unit, 0, false)
}
