//! The roots of a polynomial in (0, 1], isolated by Descartes' rule of signs on its Bernstein coefficients.
//!
//! The number of sign changes of the Bernstein coefficients on an interval is at least the number of roots inside, and
//! exceeds it by an even number: none means no root, one means exactly one. Anything else is halved. So no root is
//! passed over, and none is found twice. A coefficient of zero counts as positive, as if the polynomial were raised by
//! next to nothing; two roots closer than 2^-40 of the interval, or a root that only touches zero, are none.

use super::taylor;
use std::ops::ControlFlow;

/// Halvings after which what is left is decided by its ends.
const DEPTH: u32 = 40;

/// An interval within [0, 1] that holds exactly one change of sign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bracket {
    /// Where the polynomial is still on the one side.
    pub low: f64,
    /// Where it is on the other.
    pub high: f64,
    /// From positive (or zero) to negative.
    pub falling: bool,
}

/// Hands each change of sign of the polynomial with these coefficients (lowest first) in (0, 1] to `visit`, from left
/// to right, until that breaks.
pub fn isolate<const N: usize>(coefficients: &[f64; N], visit: &mut impl FnMut(Bracket) -> ControlFlow<()>) {
    let bernstein = bernstein(coefficients);
    let _ = search(&bernstein, 0.0, 1.0, 0, visit);
}

/// The first root in (0, 1] at which the polynomial falls from positive to negative, to the last place.
pub fn first_falling<const N: usize>(coefficients: &[f64; N]) -> Option<f64> {
    // Most often there is plainly none: the constant outweighs everything that could pull it down.
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

/// The root in a bracket, by Newton's method held inside it by bisection; to the last place or nearly so.
pub fn refine(coefficients: &[f64], bracket: Bracket) -> f64 {
    let Bracket {
        mut low,
        mut high,
        falling,
    } = bracket;
    let mut x = (low + high) * 0.5;
    // More rounds than the digits of any number in use; Newton's method takes five.
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
    // The binomial transform, by sums of neighbours.
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
    // de Casteljau: the left half leaves the triangle at its beginning, the right half at its end.
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Coefficients of scale times the product of (x - root), in a polynomial with room for more.
    fn with_roots<const N: usize>(roots: &[f64], scale: f64) -> [f64; N] {
        let mut c = [0.0; N];
        c[0] = scale;
        for (k, root) in roots.iter().enumerate() {
            for j in (0..=k).rev() {
                c[j + 1] += c[j];
                c[j] *= -root;
            }
        }
        c
    }

    fn all<const N: usize>(c: &[f64; N]) -> Vec<(f64, bool)> {
        let mut found = Vec::new();
        isolate(c, &mut |bracket| {
            let falling = bracket.falling;
            found.push((refine(c, bracket), falling));
            ControlFlow::Continue(())
        });
        found
    }

    proptest! {
        /// Every root in (0, 1), none else, in order, with its direction, whatever lies outside.
        #[test]
        fn property_every_root_is_found_in_order(
            gaps in proptest::collection::vec(0.02..0.3f64, 1..7),
            outside in proptest::collection::vec(prop_oneof![-3.0..-0.05f64, 1.05..3.0f64], 0..4),
            scale in prop_oneof![Just(1.0), Just(-1e-9)],
        ) {
            let roots: Vec<f64> =
                gaps.iter().scan(0.0, |x, gap| { *x += gap; Some(*x) }).filter(|x| *x < 0.98).collect();
            let product: Vec<f64> = roots.iter().chain(&outside).copied().collect();
            let c: [f64; 16] = with_roots(&product, scale);
            let found = all(&c);
            prop_assert_eq!(found.len(), roots.len());
            let size: f64 = c.iter().map(|c| c.abs()).sum();
            let mut falling = c[0] > 0.0;
            for (&(x, down), &root) in found.iter().zip(&roots) {
                // As near as the rounding of the coefficients lets a root be.
                let (_, rate) = taylor::value_and_rate(&c, root);
                prop_assert!((x - root).abs() < 1e-14 * size / rate.abs(), "{} {}", x, root);
                prop_assert_eq!(down, falling);
                falling = !falling;
            }
            let first = first_falling(&c);
            let expected = found.iter().find(|r| r.1).map(|r| r.0);
            prop_assert_eq!(first, expected);
        }
    }

    #[test]
    fn analytic_a_root_where_an_interval_is_halved_is_found_once() {
        let c: [f64; 8] = with_roots(&[0.25, 0.5, 0.75], 1.0);
        let found: Vec<f64> = all(&c).iter().map(|r| r.0).collect();
        assert_eq!(found.len(), 3);
        for (x, root) in found.iter().zip([0.25, 0.5, 0.75]) {
            assert!((x - root).abs() < 1e-15);
        }
        assert_eq!(first_falling(&c), Some(found[1]));
    }

    #[test]
    fn analytic_a_touch_from_above_is_no_crossing() {
        let touching: [f64; 4] = with_roots(&[0.5, 0.5], 1.0);
        assert_eq!(first_falling(&touching), None);
        let raised: [f64; 4] = std::array::from_fn(|k| touching[k] + if k == 0 { 1e-12 } else { 0.0 });
        assert!(all(&raised).is_empty());
        // Two roots 2e-6 apart are two.
        let lowered: [f64; 4] = std::array::from_fn(|k| touching[k] - if k == 0 { 1e-12 } else { 0.0 });
        let found = all(&lowered);
        assert_eq!(found.len(), 2);
        assert!((found[0].0 - (0.5 - 1e-6)).abs() < 1e-10 && (found[1].0 - (0.5 + 1e-6)).abs() < 1e-10);
    }

    #[test]
    fn analytic_the_ends_belong_to_the_interval_on_the_right_only() {
        let at_start: [f64; 2] = [0.0, -1.0];
        assert!(all(&at_start).len() == 1, "zero counts as positive");
        let at_end: [f64; 2] = [1.0, -1.0];
        assert!(all(&at_end).is_empty(), "it has not gone below zero yet");
    }
}
