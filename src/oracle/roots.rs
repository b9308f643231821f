//! The first zero of a polynomial on a step.
//!
//! In the basis of Bernstein a polynomial lies within the hull of its coefficients: where none of them reaches zero there
//! is no root, and where their signs change once there is exactly one. Intervals that are neither are halved. All that
//! is done in double precision with a bound on its rounding; what it cannot decide, and the root itself, is settled
//! with the polynomial's own precision.

use super::float::Float;

/// What a guard does on a step.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Crossing<const N: usize> {
    /// It stays positive.
    None,
    /// It reaches zero first at this time from the start of the step, s.
    At(Float<N>),
    /// It is not positive at its start.
    Beyond,
}

/// What is left of an interval after this much halving is expanded anew around its start, with full precision: far from the
/// first centre the terms cancel, and on a short interval they do not.
const RECENTRED_BELOW: f64 = 1.0 / 32.0;

/// So often. What is left then, some 1e-9 of the step, is decided with full precision.
const MOST_RECENTRED: u32 = 5;

/// Rounding of the double-precision coefficients, as a share of the sum of their magnitudes: of a conversion three for each
/// coefficient, for a factor that its terms pass on, and one for each halving down to [`RECENTRED_BELOW`] and each sum.
fn rounding(coefficients: usize) -> f64 {
    (4 * coefficients + 300) as f64 * (f64::EPSILON / 2.0)
}

/// Of a guard given by its Taylor coefficients, over `0 < t <= step`. The first `known_zeros` coefficients are zero by the
/// conditions from which the motion starts, and are taken out; so are exact zeros.
pub(super) fn first_zero<const N: usize>(
    coefficients: &[Float<N>],
    known_zeros: usize,
    step: &Float<N>,
) -> Crossing<N> {
    let exact = coefficients
        .iter()
        .skip(known_zeros)
        .take_while(|c| c.is_zero())
        .count();
    let coefficients = &coefficients[coefficients.len().min(known_zeros.saturating_add(exact))..];
    let Some(first) = coefficients.first() else {
        return Crossing::None;
    };
    if first.signum() < 0 {
        return Crossing::Beyond;
    }
    match first_share(in_steps(coefficients, step), 0) {
        Some(share) => Crossing::At(&share * step),
        None => Crossing::None,
    }
}

/// The first root of a polynomial on [0, 1].
fn first_share<const N: usize>(polynomial: Vec<Float<N>>, recentred: u32) -> Option<Float<N>> {
    let doubles = in_doubles(&polynomial);
    let size: f64 = doubles.iter().map(|a| a.abs()).sum();
    let rounding = rounding(doubles.len());
    if doubles[0] > (size - doubles[0].abs()) * (1.0 + rounding) {
        return None;
    }
    let search = Search {
        bound: rounding * size,
        polynomial,
        recentred,
    };
    search.first(0.0, 1.0, bernstein(&doubles))
}

/// The coefficients in doubles, with a common factor that makes the largest about 1.
fn in_doubles<const N: usize>(polynomial: &[Float<N>]) -> Vec<f64> {
    let largest = polynomial.iter().map(|c| c.exponent).max().unwrap_or(0);
    polynomial.iter().map(|c| c.scaled(largest)).collect()
}

/// c_k step^k.
fn in_steps<const N: usize>(coefficients: &[Float<N>], step: &Float<N>) -> Vec<Float<N>> {
    let mut scaled = Vec::with_capacity(coefficients.len());
    let mut power: Option<Float<N>> = None;
    for c in coefficients {
        scaled.push(power.as_ref().map_or(*c, |p| p * c));
        power = Some(power.map_or(*step, |p| &p * step));
    }
    scaled
}

/// From powers to the basis of Bernstein on [0, 1]: b_j = sum over i <= j of C(j, i)/C(n, i) a_i.
fn bernstein(powers: &[f64]) -> Vec<f64> {
    let n = powers.len() - 1;
    let reciprocals: Vec<f64> = (0..=n).map(|i| 1.0 / (n - i).max(1) as f64).collect();
    (0..=n)
        .map(|j| {
            let mut ratio = 1.0;
            let mut sum = 0.0;
            for (i, (a, reciprocal)) in powers.iter().zip(&reciprocals).enumerate().take(j + 1) {
                sum += ratio * a;
                ratio *= (j - i) as f64 * reciprocal;
            }
            sum
        })
        .collect()
}

/// The halves of a polynomial in the basis of Bernstein, by de Casteljau's rule.
fn halves(mut b: Vec<f64>) -> (Vec<f64>, Vec<f64>) {
    let n = b.len();
    let mut left = Vec::with_capacity(n);
    for level in (1..=n).rev() {
        left.push(b[0]);
        for i in 0..level - 1 {
            b[i] = 0.5 * (b[i] + b[i + 1]);
        }
    }
    // What is left in place, from its end, are the last ones of each level.
    (left, b)
}

struct Search<const N: usize> {
    /// Smaller magnitudes are rounding.
    bound: f64,
    /// In shares of the step.
    polynomial: Vec<Float<N>>,
    /// How often it was expanded anew.
    recentred: u32,
}

impl<const N: usize> Search<N> {
    /// The first root in [from, to], on which the coefficients of Bernstein are `b`.
    fn first(&self, from: f64, to: f64, b: Vec<f64>) -> Option<Float<N>> {
        if b.iter().all(|&b| b > self.bound) {
            return None;
        }
        let clear = b.iter().all(|b| b.abs() > self.bound);
        let changes = b.windows(2).filter(|pair| (pair[0] > 0.0) != (pair[1] > 0.0)).count();
        if clear && changes == 1 && b[0] > 0.0 {
            return Some(self.falling_root(&self.polynomial, from, to));
        }
        if to - from < RECENTRED_BELOW {
            if self.recentred == MOST_RECENTRED {
                return self.decide(from, to);
            }
            let (start, width) = (self.number(from), self.number(to - from));
            let local = in_steps(&shifted(&self.polynomial, &start), &width);
            return first_share(local, self.recentred + 1).map(|y| &start + &(&width * &y));
        }
        let middle = 0.5 * (from + to);
        let (left, right) = halves(b);
        self.first(from, middle, left).or_else(|| self.first(middle, to, right))
    }

    fn number(&self, x: f64) -> Float<N> {
        Float::from_f64(x)
    }

    /// An interval in which double precision does not see whether the guard crosses zero, touches it or misses it.
    fn decide(&self, from: f64, to: f64) -> Option<Float<N>> {
        let value = |x: f64| evaluate(&self.polynomial, &self.number(x)).signum();
        if value(from) <= 0 {
            return Some(self.number(from));
        }
        if value(to) < 0 {
            return Some(self.falling_root(&self.polynomial, from, to));
        }
        // Positive at both ends: the least value in between decides, and on so short an interval there is one at most.
        let derivative = derivative(&self.polynomial);
        let slope = |x: f64| evaluate(&derivative, &self.number(x)).signum();
        if slope(from) >= 0 || slope(to) <= 0 {
            return None;
        }
        let rising: Vec<Float<N>> = derivative.iter().map(|c| -c).collect();
        let lowest = self.falling_root(&rising, from, to);
        if evaluate(&self.polynomial, &lowest).signum() > 0 {
            return None;
        }
        Some(self.bisected(&self.polynomial, self.number(from), lowest))
    }

    /// The root between an end where the polynomial is positive and one where it is negative.
    fn falling_root(&self, polynomial: &[Float<N>], from: f64, to: f64) -> Float<N> {
        self.bisected(polynomial, self.number(from), self.number(to))
    }

    /// Newton's method, held within a bracket that shrinks with every sign.
    fn bisected(&self, polynomial: &[Float<N>], mut from: Float<N>, mut to: Float<N>) -> Float<N> {
        let derivative = derivative(polynomial);
        let bits = Float::<N>::BITS;
        // A step of one: what is left of the bracket then is below the last bits.
        let fine = -(bits as f64) + 4.0;
        let mut x = (&from + &to).half();
        for _ in 0..4 * bits {
            let value = evaluate(polynomial, &x);
            match value.signum() {
                0 => return x,
                1 => from = x,
                _ => to = x,
            }
            let newton = &x - &value.over(&evaluate(&derivative, &x));
            let next = if newton.is_finite() && newton > from && newton < to {
                newton
            } else {
                (&from + &to).half()
            };
            let change = (&next - &x).log2();
            x = next;
            if change < fine || (&to - &from).log2() < fine {
                break;
            }
        }
        x
    }
}

/// A polynomial at `x`, by Horner's rule.
pub(super) fn evaluate<const N: usize>(coefficients: &[Float<N>], x: &Float<N>) -> Float<N> {
    let mut rest = coefficients.iter().rev();
    let Some(last) = rest.next() else {
        return Float::zero();
    };
    rest.fold(*last, |sum, coefficient| &(&sum * x) + coefficient)
}

/// The coefficients around `centre`, by repeated division.
fn shifted<const N: usize>(polynomial: &[Float<N>], centre: &Float<N>) -> Vec<Float<N>> {
    let mut shifted = polynomial.to_vec();
    let n = shifted.len();
    for first in 0..n {
        for k in (first..n - 1).rev() {
            let carried = &shifted[k + 1] * centre;
            shifted[k] += &carried;
        }
    }
    shifted
}

fn derivative<const N: usize>(polynomial: &[Float<N>]) -> Vec<Float<N>> {
    let mut factor = Float::zero();
    let one = Float::from_f64(1.0);
    polynomial
        .iter()
        .skip(1)
        .map(|c| {
            factor += &one;
            c * &factor
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    type Real = Float<3>;

    /// Coefficients of the product of (x - root), times `sign`.
    fn with_roots(roots: &[f64], sign: f64) -> Vec<Real> {
        let mut product = vec![Real::from_f64(sign)];
        for &root in roots {
            let root = Real::from_f64(root);
            let mut next = vec![Real::zero(); product.len() + 1];
            for (k, c) in product.iter().enumerate() {
                next[k + 1] += c;
                next[k] -= &(c * &root);
            }
            product = next;
        }
        product
    }

    fn first(coefficients: &[Real], known: usize) -> Option<f64> {
        match first_zero(coefficients, known, &Real::from_f64(1.0)) {
            Crossing::At(x) => Some(x.to_f64()),
            Crossing::None => None,
            Crossing::Beyond => panic!("the polynomial starts positive"),
        }
    }

    /// The factorised polynomial knows its roots; 2^-50 is the rounding of the comparison in doubles.
    #[test]
    fn analytic_the_first_of_the_roots_is_found() {
        for (roots, expected) in [
            (vec![0.7, 0.2, 0.9], Some(0.2)),
            (vec![0.5, 0.5 + 1e-13], Some(0.5)),
            (vec![1.5, -0.5], None),
            (vec![1.0 - 1e-15, 3.0], Some(1.0 - 1e-15)),
        ] {
            let sign = if roots.iter().filter(|&&r| r > 0.0).count() % 2 == 1 {
                -1.0
            } else {
                1.0
            };
            let found = first(&with_roots(&roots, sign), 0);
            match expected {
                Some(x) => assert!(
                    (found.expect("a root") - x).abs() < 2f64.powi(-50),
                    "{roots:?}: {found:?}"
                ),
                None => assert_eq!(found, None, "{roots:?}"),
            }
        }
    }

    /// x^2 (0.3 - x): the double root at the start is where the motion begins, and no crossing.
    #[test]
    fn analytic_a_tangential_start_is_no_root() {
        let found = first(&with_roots(&[0.0, 0.0, 0.3], -1.0), 2).expect("a root");
        assert!((found - 0.3).abs() < 2f64.powi(-50));
    }

    /// (x - 1/2)^2 + e stays positive for e > 0 however small, and has two roots for e < 0; doubles see no difference.
    #[test]
    fn analytic_a_graze_is_told_from_a_crossing() {
        let graze = |e: f64| {
            let mut p = with_roots(&[0.5, 0.5], 1.0);
            p[0] += &Real::from_f64(e);
            first(&p, 0)
        };
        assert_eq!(graze(1e-30), None);
        let root = graze(-1e-30).expect("two roots");
        assert!((root - (0.5 - 1e-15)).abs() < 1e-16, "{root:e}");
    }
}
