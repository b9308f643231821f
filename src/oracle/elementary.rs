//! Sine, cosine, arc tangent and hyperbolic tangent, and the tables that they and the recurrences need.

use super::float::Float;
use num_bigint::{BigInt, BigUint};
use num_rational::BigRational;
use num_traits::{One, Zero};

/// The constants of the arithmetic.
#[derive(Debug)]
pub(super) struct Elementary<const N: usize> {
    /// 1/k; of k = 0 it is 1.
    pub reciprocals: Vec<Float<N>>,
    /// k.
    pub integers: Vec<Float<N>>,
    /// ln 2.
    pub ln_2: Float<N>,
    /// pi.
    pub pi: Float<N>,
}

impl<const N: usize> Elementary<N> {
    /// With tables up to `largest`.
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

    /// sin x and cos x, each to the last bits of 1, and of x if that is larger.
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

    /// The angle whose tangent is y: a double near it, and what that lacks by the tangent of a difference.
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

    /// tanh y and 1 - tanh^2 y for y near 0 or positive, the second to its own last bits.
    pub fn hyperbolic_tangent(&self, y: &Float<N>) -> [Float<N>; 2] {
        let one = Float::from_f64(1.0);
        let e = (&-y - y).exp(&self.ln_2, &self.reciprocals);
        let sum = &one + &e;
        let four = Float::from_f64(4.0);
        [(&one - &e).over(&sum), (&four * &e).over(&(&sum * &sum))]
    }
}

/// Machin: pi = 16 arctan(1/5) - 4 arctan(1/239).
fn pi<const N: usize>() -> Float<N> {
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

#[cfg(test)]
mod tests {
    use super::*;

    type Real = Float<4>;

    fn small(value: &Real, bits: f64) -> bool {
        value.log2() < bits
    }

    /// Digits 1 to 60 of pi, as printed in any table.
    #[test]
    fn published_digits_of_pi() {
        let text = "3.14159265358979323846264338327950288419716939937510582097494";
        let expected = Real::from_rational(&crate::oracle::rational(text).unwrap());
        assert!(small(&(&pi::<4>() - &expected), -190.0));
    }

    /// Doubles, the theorem of Pythagoras, and double angles, to some bits of the 256.
    #[test]
    fn analytic_sines_and_cosines() {
        let table = Elementary::<4>::new(200);
        for x in [0.0, 1e-20, 0.4, -0.8, 1.6, 3.0, -5.1, 100.25, 12_345.678] {
            let value = Real::from_f64(x);
            let [sine, cosine] = table.sine_and_cosine(&value);
            assert!((sine.to_f64() - x.sin()).abs() < 1e-15 && (cosine.to_f64() - x.cos()).abs() < 1e-15);
            let one = &(&sine * &sine) + &(&cosine * &cosine);
            assert!(small(&(&one - &Real::from_f64(1.0)), -248.0), "{x}");
            let [twice, _] = table.sine_and_cosine(&(&value + &value));
            let product = &sine * &cosine;
            assert!(small(&(&twice - &(&product + &product)), -236.0), "{x}");
        }
    }

    /// Doubles, and the tangent of the arc tangent.
    #[test]
    fn analytic_arc_tangents() {
        let table = Elementary::<4>::new(200);
        for y in [0.0, 1e-30, 0.3, -0.9, 1.0, 7.5, -4000.25] {
            let value = Real::from_f64(y);
            let angle = table.arc_tangent(&value);
            assert!((angle.to_f64() - y.atan()).abs() < 1e-15);
            let [sine, cosine] = table.sine_and_cosine(&angle);
            assert!(small(&(&(&value * &cosine) - &sine), -238.0), "{y}");
        }
        let quarter = table.arc_tangent(&Real::from_f64(1.0));
        assert!(small(&(&quarter - &table.pi.half().half()), -250.0));
    }

    /// Doubles, and the identity between the two.
    #[test]
    fn analytic_hyperbolic_tangents() {
        let table = Elementary::<4>::new(200);
        for y in [0.0, 1e-10, 0.3, 2.0, 30.0, 300.0] {
            let [tangent, rest] = table.hyperbolic_tangent(&Real::from_f64(y));
            assert!((tangent.to_f64() - y.tanh()).abs() < 1e-15);
            let sum = &(&tangent * &tangent) + &rest;
            assert!(small(&(&sum - &Real::from_f64(1.0)), -248.0), "{y}");
            assert!((rest.to_f64() / y.cosh().powi(-2) - 1.0).abs() < 1e-12 * y.max(1.0));
        }
    }
}
