//! Roots of a polynomial in (0, 1], isolated with Descartes' rule of signs for its Bernstein coefficients.
//!
//! The number of sign changes of the Bernstein coefficients on an interval exceeds the number of roots inside by zero
//! or an even number. No sign change means no root, and one means exactly one root. All other intervals are halved,
//! so that no root is missed or found twice. A zero coefficient counts as positive, as if the polynomial were raised
//! slightly. Two roots closer than 2^-40 of the interval, or a root that only touches zero, do not count.

use super::taylor;
use std::ops::ControlFlow;

/// Number of halvings after which the values at the ends of an interval decide.
const DEPTH: u32 = 40;

/// An interval within [0, 1] that contains exactly one sign change of the polynomial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bracket {
    /// Position before the sign change.
    pub low: f64,
    /// Position after the sign change.
    pub high: f64,
    /// Whether the sign changes from positive (or zero) to negative.
    pub falling: bool,
}

/// Calls `visit` for each sign change of the polynomial (coefficients, lowest first) in (0, 1], from left to right,
/// until it returns `Break`.
pub fn isolate<const N: usize>(coefficients: &[f64; N], visit: &mut impl FnMut(Bracket) -> ControlFlow<()>) {
    let bernstein = bernstein(coefficients);
    let _ = search(&bernstein, 0.0, 1.0, 0, visit);
}

/// The first root in (0, 1] at which the polynomial falls from positive to negative, accurate to the last place.
pub fn first_falling<const N: usize>(coefficients: &[f64; N]) -> Option<f64> {
    // A constant above the sum of all negative coefficients, the usual case, excludes a root.
    let mut least = coefficients[0];
    for c in &coefficients[1..] {
        if *c < 0.0 {
            least += c;
        }
    }
    if least > 0.0 {
        return None;
    }
    let mut found = None;
    isolate(coefficients, &mut |bracket| {
        if bracket.falling {
            found = Some(bracket);
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    });
    found.map(|bracket| refine(coefficients, bracket))
}

/// The root in a bracket, from Newton's method with bisection, accurate to about the last place.
pub fn refine(coefficients: &[f64], bracket: Bracket) -> f64 {
    let Bracket {
        mut low,
        mut high,
        falling,
    } = bracket;
    let mut x = (low + high) * 0.5;
    // More rounds than any number type has digits. Newton's method takes five.
    for _ in 0..1000 {
        let (value, rate) = taylor::value_and_rate(coefficients, x);
        if value == 0.0 {
            return x;
        }
        if (value > 0.0) == falling {
            low = x;
        } else {
            high = x;
        }
        let newton = x - value / rate;
        let next = if newton > low && newton < high {
            newton
        } else {
            (low + high) * 0.5
        };
        if next == x || next == low || next == high {
            return next;
        }
        x = next;
    }
    x
}

/// Bernstein coefficients on [0, 1]: b_j is the sum over k <= j of C(j, k) / C(N - 1, k) c_k.
fn bernstein<const N: usize>(coefficients: &[f64; N]) -> [f64; N] {
    let mut b = *coefficients;
    let degree = N - 1;
    let mut binomial = 1.0;
    for (k, c) in b.iter_mut().enumerate().skip(1) {
        binomial *= (degree + 1 - k) as f64 / k as f64;
        *c /= binomial;
    }
    for round in 1..N {
        for j in (round..N).rev() {
            b[j] += b[j - 1];
        }
    }
    b
}

fn search<const N: usize>(
    b: &[f64; N],
    low: f64,
    high: f64,
    depth: u32,
    visit: &mut impl FnMut(Bracket) -> ControlFlow<()>,
) -> ControlFlow<()> {
    let negative = |x: &f64| *x < 0.0;
    let changes = b.windows(2).filter(|p| negative(&p[0]) != negative(&p[1])).count();
    let (first, last) = (negative(&b[0]), negative(&b[N - 1]));
    if changes == 0 || (depth == DEPTH && first == last) {
        return ControlFlow::Continue(());
    }
    if changes == 1 || depth == DEPTH {
        return visit(Bracket {
            low,
            high,
            falling: !first,
        });
    }
    let middle = (low + high) * 0.5;
    // De Casteljau's algorithm: the left half is at the beginning of the triangle, the right half at its end.
    let (mut left, mut right) = (*b, *b);
    for (round, coefficient) in left.iter_mut().enumerate().skip(1) {
        for j in 0..N - round {
            right[j] = (right[j] + right[j + 1]) * 0.5;
        }
        *coefficient = right[0];
    }
    search(&left, low, middle, depth + 1, visit)?;
    search(&right, middle, high, depth + 1, visit)
}
