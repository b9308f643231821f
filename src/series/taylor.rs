//! Truncated power series: a slice holds the coefficients c_n of the sum of c_n x^n, lowest first.
//!
//! x is time in some unit of the caller's. A unit near the time scale of the solution keeps the coefficients within the
//! range of a double: with seconds, those of a 4 kHz oscillation grow by 26,000 from one to the next.

use super::Number;

/// Coefficient n of a b. Needs both up to n.
#[inline]
pub fn product<T: Number>(a: &[T], b: &[T], n: usize) -> T {
    T::convolution(&a[..=n], &b[..=n])
}

/// Coefficient n >= 1 of e = exp(a), from e' = a' e. `rate` holds k a_k up to n, and e is known up to n - 1.
#[inline]
pub fn exponential<T: Number>(rate: &[T], e: &[T], n: usize) -> T {
    T::convolution(&rate[1..=n], &e[..n]) / T::of(n as f64)
}

/// Fills `c` with the coefficients of the solution of q'' + 2 sigma q' + omega0_squared q = 0 from its value and its
/// derivative; all of them in the unit of x. At least two coefficients.
pub fn damped_oscillation<T: Number>(sigma: &T, omega0_squared: &T, value: T, rate: T, c: &mut [T]) {
    c[0] = value;
    c[1] = rate;
    for n in 0..c.len() - 2 {
        let restoring = T::of(2.0 * (n + 1) as f64) * sigma.clone() * c[n + 1].clone();
        let restoring = restoring + omega0_squared.clone() * c[n].clone();
        c[n + 2] = -restoring / T::of(((n + 1) * (n + 2)) as f64);
    }
}

/// The value at `x`.
#[inline]
pub fn value<T: Number>(c: &[T], x: &T) -> T {
    let mut sum = T::of(0.0);
    for term in c.iter().rev() {
        sum = sum * x.clone() + term.clone();
    }
    sum
}

/// Value and derivative at `x`.
#[inline]
pub fn value_and_rate<T: Number>(c: &[T], x: &T) -> (T, T) {
    let (mut sum, mut rate) = (T::of(0.0), T::of(0.0));
    for term in c.iter().rev() {
        rate = rate * x.clone() + sum.clone();
        sum = sum * x.clone() + term.clone();
    }
    (sum, rate)
}

/// The longest x for which each of the last two terms stays below 1, where `size(n)` is the size of coefficient n over
/// what is tolerated, for the last index `order` and the one before it. Infinite if both sizes are zero.
///
/// Two, because every other coefficient of an even or odd solution vanishes.
pub fn step(order: usize, mut size: impl FnMut(usize) -> f64) -> f64 {
    let longest = |n: usize, size: f64| {
        if size > 0.0 {
            size.powf(-1.0 / n as f64)
        } else {
            f64::INFINITY
        }
    };
    longest(order, size(order)).min(longest(order - 1, size(order - 1)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const N: usize = 24;

    proptest! {
        /// exp(a) exp(-a) = 1, coefficient by coefficient: to the rounding of sums of N terms of the sizes of exp(|a|)^2.
        #[test]
        fn property_an_exponential_times_its_inverse_is_one(a in proptest::array::uniform24(-0.5..0.5f64)) {
            let exp = |sign: f64| {
                let rate: [f64; N] = std::array::from_fn(|k| sign * k as f64 * a[k]);
                let mut e = [0.0; N];
                e[0] = (sign * a[0]).exp();
                for n in 1..N {
                    e[n] = exponential(&rate, &e, n);
                }
                e
            };
            let (plus, minus) = (exp(1.0), exp(-1.0));
            for n in 0..N {
                let size: f64 = (0..=n).map(|k| (plus[k] * minus[n - k]).abs()).sum();
                let expected = if n == 0 { 1.0 } else { 0.0 };
                prop_assert!((product(&plus, &minus, n) - expected).abs() <= 1e-14 * (1.0 + size));
            }
        }

        /// The four partial sums add what a plain loop adds.
        #[test]
        fn property_a_convolution_is_its_sum(a in proptest::array::uniform24(-1.0..1.0f64), n in 0..N) {
            let plain: f64 = (0..=n).map(|k| a[k] * (1.0 - a[n - k])).sum();
            let b = a.map(|x| 1.0 - x);
            prop_assert!((product(&a, &b, n) - plain).abs() <= 1e-14 * N as f64);
        }
    }

    #[test]
    fn analytic_an_oscillation_is_its_closed_form() {
        // Damping ratio 0.3: exp(-0.3 x) (cos w x + (0.7 + 0.3)/w sin w x) with w^2 = 0.91
        let mut c = [0.0; 32];
        damped_oscillation(&0.3, &1.0, 1.0, 0.7, &mut c);
        let w = 0.91f64.sqrt();
        for x in [0.1, 0.9, 2.0] {
            let exact = (-0.3 * x).exp() * ((w * x).cos() + (w * x).sin() / w);
            // Terms are at most 2^2/2 in size, and the first left out is 2^32/32!, 2e-26.
            assert!((value(&c, &x) - exact).abs() < 1e-15 * 8.0);
            let (again, rate) = value_and_rate(&c, &x);
            let ahead = value(&c, &(x + 1e-5)) - value(&c, &(x - 1e-5));
            assert_eq!(again, value(&c, &x));
            // A central difference: 1e-10 of the third derivative, and rounding over 2e-5.
            assert!((rate - ahead / 2e-5).abs() < 1e-9);
        }
    }

    #[test]
    fn analytic_a_step_is_where_the_last_terms_are_one() {
        // cos and sin: one of the last two coefficients vanishes
        let factorial: f64 = (1..=24).map(f64::from).product();
        let step = step(24, |n| if n == 24 { 1.0 / factorial } else { 0.0 });
        assert!((step.powi(24) / factorial - 1.0).abs() < 1e-13);
    }
}
