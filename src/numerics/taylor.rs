//! Truncated power series: a slice holds the coefficients c_n of the sum of c_n x^n, lowest first.
//!
//! x is time in some unit of the caller's. A unit near the time scale of the solution keeps the coefficients within the
//! range of a double: with seconds, those of a 4 kHz oscillation grow by 26,000 from one to the next.

use super::Number;

/// A series whose coefficients become known one by one, kept backwards, so that those of its products are plain sums.
#[derive(Debug, Clone)]
pub struct Unfolding<T, const N: usize> {
    /// Coefficient n at N - 1 - n; zeros behind, for those with a negative index.
    backwards: [[T; N]; 2],
}

impl<T: Number, const N: usize> Unfolding<T, N> {
    /// None is known.
    pub fn new() -> Self {
        Unfolding {
            backwards: [zeros(); 2],
        }
    }

    /// Coefficient n, once known.
    #[inline(always)]
    pub fn get(&self, n: usize) -> T {
        self.backwards[0][N - 1 - n]
    }

    /// Makes coefficient n known.
    #[inline(always)]
    pub fn set(&mut self, n: usize, coefficient: T) {
        self.backwards[0][N - 1 - n] = coefficient;
    }

    /// The sum over k from `from` to n of `a[k]` times coefficient n - k, which must be known. All of `a` must be finite,
    /// and zero beyond `degree`, which is at least `from`.
    #[inline(always)]
    pub fn product(&self, a: &[T; N], n: usize, from: usize, degree: usize) -> T {
        // In whole groups of four: what is beyond n meets the zeros.
        let terms = (degree.min(n) + 1 - from).next_multiple_of(4).min(N - from);
        let offset = N - 1 - n + from;
        T::dot(
            &a[from..from + terms],
            &self.backwards.as_flattened()[offset..offset + terms],
        )
    }

    /// Makes coefficient n of exp(a) known, n >= 1, when those up to n - 1 are: e' = a' e. `rate` holds k a_k up to n - 1 and zeros
    /// from there on; `newest` is n a_n, which it takes up.
    #[inline(always)]
    pub fn exponential(&mut self, rate: &mut [T; N], n: usize, newest: T, reciprocal: T) -> T {
        debug_assert!(rate[n] == T::of(0.0));
        // The rest of the sum need not wait for the newest.
        let rest = self.product(rate, n, 1, n);
        rate[n] = newest;
        let next = (rest + newest * self.get(0)) * reciprocal;
        self.set(n, next);
        next
    }
}

impl<T: Number, const N: usize> Default for Unfolding<T, N> {
    fn default() -> Self {
        Self::new()
    }
}

/// Coefficients of nothing.
#[inline(always)]
pub fn zeros<T: Number, const N: usize>() -> [T; N] {
    [T::of(0.0); N]
}

/// The coefficients of a b, all of them. Those of both must be finite.
#[inline]
pub fn product<T: Number, const N: usize>(a: &[T; N], b: &[T; N]) -> [T; N] {
    let mut unfolding = Unfolding::new();
    for (n, coefficient) in b.iter().enumerate() {
        unfolding.set(n, *coefficient);
    }
    std::array::from_fn(|n| unfolding.product(a, n, 0, N - 1))
}

/// Coefficient `n` of a b, where those of both up to n are known and those of `a` beyond `degree` are zero. In partial sums as
/// [`Number::dot`].
#[inline(always)]
pub(crate) fn convolved<T: Number>(a: &[T], b: &[T], n: usize, degree: usize) -> T {
    let mut sums = zeros::<T, 4>();
    let (quads, rest) = a[..=degree.min(n)].as_chunks::<4>();
    let mut behind = n + 1;
    for a in quads {
        let b = &b[behind - 4..behind];
        for j in 0..4 {
            sums[j] = sums[j] + a[j] * b[3 - j];
        }
        behind -= 4;
    }
    for (sum, a) in sums.iter_mut().zip(rest) {
        behind -= 1;
        *sum = *sum + *a * b[behind];
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

/// Adds `factor` a b to a series whose number of coefficients is a multiple of four, to as many as `b` has. `a` is zero beyond
/// its end.
#[inline(always)]
pub(crate) fn add_product<T: Number, const N: usize>(sum: &mut [T; N], factor: T, a: &[T], b: &[T]) {
    const { assert!(N.is_multiple_of(4)) };
    // Behind zeros, for those with a negative index.
    let mut behind = [zeros::<T, N>(); 2];
    behind[1][..b.len()].copy_from_slice(b);
    let behind = behind.as_flattened();
    let groups = sum.as_chunks_mut::<4>().0;
    for (group, sums) in groups.iter_mut().take(b.len().div_ceil(4)).enumerate() {
        let end = 4 * (group + 1);
        let mut found = zeros::<T, 4>();
        for (a, b) in a[..end.min(a.len())].iter().zip(behind[..N + end].windows(4).rev()) {
            for (found, b) in found.iter_mut().zip(b) {
                *found = *found + *a * *b;
            }
        }
        for (sum, found) in sums.iter_mut().zip(found) {
            *sum = *sum + factor * found;
        }
    }
}

/// Adds `factor` a^2 to a series whose number of coefficients is a multiple of four, to as many as `a` has. Each pair is taken
/// once.
#[inline(always)]
pub(crate) fn add_square<T: Number, const N: usize>(sum: &mut [T; N], factor: T, a: &[T]) {
    const { assert!(N.is_multiple_of(4)) };
    let mut all = zeros::<T, N>();
    all[..a.len()].copy_from_slice(a);
    let two = T::of(2.0);
    let groups = sum.as_chunks_mut::<4>().0;
    for (group, sums) in groups.iter_mut().take(a.len().div_ceil(4)).enumerate() {
        // Coefficients 4 group + j, j < 4: pairs of which one is below `half`, and those of four from there on.
        let half = 2 * group;
        let mut found = zeros::<T, 4>();
        for (a, b) in all[..half].iter().zip(all[..2 * half + 4].windows(4).rev()) {
            for (found, b) in found.iter_mut().zip(b) {
                *found = *found + *a * *b;
            }
        }
        let [a, b, c, d] = std::array::from_fn(|j| all[half + j]);
        let middle = [a * a, two * (a * b), two * (a * c) + b * b, two * (a * d + b * c)];
        for (sum, (found, middle)) in sums.iter_mut().zip(found.into_iter().zip(middle)) {
            *sum = *sum + factor * (two * found + middle);
        }
    }
}

/// Fills `c` with the coefficients of the solution of q'' + 2 sigma q' + omega0_squared q = 0 from its value and its
/// derivative; all of them in the unit of x. At least two coefficients.
pub(crate) fn damped_oscillation<T: Number>(sigma: T, omega0_squared: T, value: T, rate: T, c: &mut [T]) {
    c[0] = value;
    c[1] = rate;
    for n in 0..c.len() - 2 {
        let restoring = T::of(2.0 * (n + 1) as f64) * sigma * c[n + 1] + omega0_squared * c[n];
        c[n + 2] = -restoring / T::of(((n + 1) * (n + 2)) as f64);
    }
}

/// The value at `x`.
#[inline]
pub fn value<T: Number>(c: &[T], x: T) -> T {
    let mut sum = T::of(0.0);
    for term in c.iter().rev() {
        sum = sum * x + *term;
    }
    sum
}

/// Value and derivative at `x`.
#[inline]
pub(crate) fn value_and_rate<T: Number>(c: &[T], x: T) -> (T, T) {
    let (mut sum, mut rate) = (T::of(0.0), T::of(0.0));
    for term in c.iter().rev() {
        rate = rate * x + sum;
        sum = sum * x + *term;
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
                let mut rate = [0.0; N];
                let mut e = Unfolding::<f64, N>::new();
                e.set(0, (sign * a[0]).exp());
                for (n, a) in a.iter().enumerate().skip(1) {
                    e.exponential(&mut rate, n, sign * n as f64 * a, 1.0 / n as f64);
                }
                std::array::from_fn::<f64, N, _>(|n| e.get(n))
            };
            let (plus, minus) = (exp(1.0), exp(-1.0));
            let ones = product(&plus, &minus);
            for n in 0..N {
                let size: f64 = (0..=n).map(|k| (plus[k] * minus[n - k]).abs()).sum();
                let expected = if n == 0 { 1.0 } else { 0.0 };
                prop_assert!((ones[n] - expected).abs() <= 1e-14 * (1.0 + size));
            }
        }

        /// In groups of four as in a plain loop, at any degree, and in a number of coefficients that is no
        /// multiple of four.
        #[test]
        fn property_products_are_their_sums(
            a in proptest::array::uniform24(-1.0..1.0f64), b in proptest::array::uniform24(-1.0..1.0f64),
            degree in 1..N, from in 0..2usize,
        ) {
            const SHORT: usize = N - 3;
            let a: [f64; SHORT] = std::array::from_fn(|k| if k > degree { 0.0 } else { a[k] });
            let b: [f64; SHORT] = std::array::from_fn(|k| b[k]);
            let all = product(&a, &b);
            let mut unfolding = Unfolding::<f64, SHORT>::new();
            for n in 0..SHORT {
                let plain: f64 = (0..=n).map(|k| a[k] * b[n - k]).sum();
                prop_assert!((all[n] - plain).abs() <= 1e-14 * N as f64);
                unfolding.set(n, b[n]);
                if n >= from {
                    let some = unfolding.product(&a, n, from, degree);
                    let left_out: f64 = (0..from).map(|k| a[k] * b[n - k]).sum();
                    prop_assert!((some - (plain - left_out)).abs() <= 1e-14 * N as f64);
                }
            }
        }
    }

    proptest! {
        /// Products in groups of four are those of a plain loop, at any degree of the one factor and any number of
        /// coefficients, and what is behind those is not looked at.
        #[test]
        fn property_added_products_are_their_sums(
            a in proptest::array::uniform24(-1.0..1.0f64), b in proptest::array::uniform24(-1.0..1.0f64),
            degree in 0..N, terms in 1..=N,
        ) {
            let (mut product, mut square) = ([0.5; N], [0.5; N]);
            add_product(&mut product, 3.0, &a[..=degree.min(terms - 1)], &b[..terms]);
            add_square(&mut square, 3.0, &b[..terms]);
            for n in 0..terms {
                let of_product: f64 = (0..=n.min(degree)).map(|k| a[k] * b[n - k]).sum();
                let of_square: f64 = (0..=n).map(|k| b[k] * b[n - k]).sum();
                prop_assert!((product[n] - (0.5 + 3.0 * of_product)).abs() <= 1e-14 * N as f64);
                prop_assert!((square[n] - (0.5 + 3.0 * of_square)).abs() <= 1e-14 * N as f64);
            }
        }
    }

    #[test]
    fn analytic_an_oscillation_is_its_closed_form() {
        // Damping ratio 0.3: exp(-0.3 x) (cos w x + (0.7 + 0.3)/w sin w x) with w^2 = 0.91
        let mut c = [0.0; 32];
        damped_oscillation(0.3, 1.0, 1.0, 0.7, &mut c);
        let w = 0.91f64.sqrt();
        for x in [0.1, 0.9, 2.0] {
            let exact = (-0.3 * x).exp() * ((w * x).cos() + (w * x).sin() / w);
            // Terms are at most 2^2/2 in size, and the first left out is 2^32/32!, 2e-26.
            assert!((value(&c, x) - exact).abs() < 1e-15 * 8.0);
            let (again, rate) = value_and_rate(&c, x);
            let ahead = value(&c, x + 1e-5) - value(&c, x - 1e-5);
            assert_eq!(again, value(&c, x));
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
