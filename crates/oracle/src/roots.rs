//! The first zero of a polynomial on a step.
//!
//! In the Bernstein basis a polynomial lies within the hull of its coefficients. If all coefficients are positive
//! there is no root; with one sign change there is exactly one. All other intervals are halved. The search uses
//! doubles with a rounding bound; undecided intervals and the root itself use the polynomial's own precision.

use super::float::Float;

/// Behaviour of a guard during a step.
#[derive(Debug, Clone, PartialEq)]
pub enum Crossing<const N: usize> {
    /// The guard stays positive.
    None,
    /// Time of the first zero from the start of the step, s.
    At(Float<N>),
    /// The guard is not positive at the start.
    Beyond,
}

/// Intervals shorter than this share of the step are expanded around their start, in full precision: far from the
/// first centre the terms cancel, on a short interval they do not.
const RECENTRED_BELOW: f64 = 1.0 / 32.0;

/// Most such expansions. The remaining interval, some 1e-9 of the step, is decided in full precision.
const MOST_RECENTRED: u32 = 5;

/// Rounding of the coefficients in double precision, relative to the sum of their magnitudes. The conversion has three
/// roundings per coefficient, because a factor passes from term to term. Each halving down to [`RECENTRED_BELOW`] and
/// each sum has one.
fn rounding(coefficients: usize) -> f64 {
    (4 * coefficients + 300) as f64 * (f64::EPSILON / 2.0)
}

/// First zero of a guard with these Taylor coefficients, for `0 < t <= step`. The first `known_zeros` coefficients
/// vanish by the initial conditions and are removed; so are exact zeros.
pub fn first_zero<const N: usize>(coefficients: &[Float<N>], known_zeros: usize, step: &Float<N>) -> Crossing<N> {
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

fn first_share<const N: usize>(polynomial: Vec<Float<N>>, recentred: u32) -> Option<Float<N>> {
    let doubles = in_doubles(&polynomial);
    let size: f64 = doubles.iter().map(|a| a.abs()).sum();
    let rounding = rounding(doubles.len());
    if doubles[0] > (size - doubles[0].abs()) * (1.0 + rounding) {
        return None;
    }
    let search = RootSearch {
        bound: rounding * size,
        polynomial,
        recentred,
    };
    search.first(0.0, 1.0, bernstein(&doubles))
}

/// The coefficients in doubles, scaled so that the largest is about 1.
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

/// From powers to the Bernstein basis on [0, 1]: b_j = sum over i <= j of C(j, i)/C(n, i) a_i.
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

/// Both halves of a polynomial in the Bernstein basis, by de Casteljau's rule.
fn halves(mut b: Vec<f64>) -> (Vec<f64>, Vec<f64>) {
    let n = b.len();
    let mut left = Vec::with_capacity(n);
    for level in (1..=n).rev() {
        left.push(b[0]);
        for i in 0..level - 1 {
            b[i] = 0.5 * (b[i] + b[i + 1]);
        }
    }
    // `b` now holds the last coefficient of each level, from its end.
    (left, b)
}

struct RootSearch<const N: usize> {
    bound: f64,
    polynomial: Vec<Float<N>>,
    recentred: u32,
}

impl<const N: usize> RootSearch<N> {
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

    /// Decides an interval in which doubles do not show whether the guard crosses zero, touches it or misses it.
    fn decide(&self, from: f64, to: f64) -> Option<Float<N>> {
        let value = |x: f64| evaluate(&self.polynomial, &self.number(x)).signum();
        if value(from) <= 0 {
            return Some(self.number(from));
        }
        if value(to) < 0 {
            return Some(self.falling_root(&self.polynomial, from, to));
        }
        // Positive at both ends: the minimum decides. So short an interval has at most one.
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

    fn falling_root(&self, polynomial: &[Float<N>], from: f64, to: f64) -> Float<N> {
        self.bisected(polynomial, self.number(from), self.number(to))
    }

    /// Newton's method within a bracket that shrinks with every sign.
    fn bisected(&self, polynomial: &[Float<N>], mut from: Float<N>, mut to: Float<N>) -> Float<N> {
        let derivative = derivative(polynomial);
        let bits = Float::<N>::BITS;
        // A smaller bracket on the step of length 1 is below the last bits.
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

pub(super) fn evaluate<const N: usize>(coefficients: &[Float<N>], x: &Float<N>) -> Float<N> {
    let mut rest = coefficients.iter().rev();
    let Some(last) = rest.next() else {
        return Float::zero();
    };
    rest.fold(*last, |sum, coefficient| &(&sum * x) + coefficient)
}

/// Coefficients around `centre`, by repeated division.
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
