//! Truncated power series: a slice contains the coefficients c_n of the sum of c_n x^n, lowest first.
//!
//! x is time in a unit chosen by the caller. A unit near the time scale of the solution keeps the coefficients within
//! the range of doubles. In seconds, each coefficient of a 4 kHz oscillation would be 26,000 times the one before.

use super::Number;

/// A series whose coefficients are computed one by one. They are stored backwards, so that the coefficients of its
/// products are plain sums.
#[derive(Debug, Clone)]
pub struct Unfolding<T, const N: usize> {
    /// Coefficient n is at N - 1 - n. The zeros that follow stand for negative indices.
    backwards: [[T; N]; 2],
}

impl<T: Number, const N: usize> Unfolding<T, N> {
    /// A series without known coefficients.
    pub fn new() -> Self {
        Unfolding {
            backwards: [zeros(); 2],
        }
    }

    /// Coefficient n, which must be known.
    #[inline(always)]
    pub fn get(&self, n: usize) -> T {
        self.backwards[0][N - 1 - n]
    }

    /// Sets coefficient n.
    #[inline(always)]
    pub fn set(&mut self, n: usize, coefficient: T) {
        self.backwards[0][N - 1 - n] = coefficient;
    }

    /// The sum over k from `from` to n of `a[k]` times coefficient n - k, all of which must be known. All of `a` must
    /// be finite, and zero beyond `degree`, which is at least `from`.
    #[inline(always)]
    pub fn product(&self, a: &[T; N], n: usize, from: usize, degree: usize) -> T {
        // Whole groups of four are summed. Terms beyond n are multiplied by the zeros.
        let terms = (degree.min(n) + 1 - from).next_multiple_of(4).min(N - from);
        let offset = N - 1 - n + from;
        T::dot(
            &a[from..from + terms],
            &self.backwards.as_flattened()[offset..offset + terms],
        )
    }

    /// Computes coefficient n >= 1 of exp(a) from those up to n - 1, by e' = a' e. `rate` contains k a_k up to n - 1
    /// followed by zeros, and receives `newest`, n a_n.
    #[inline(always)]
    pub fn exponential(&mut self, rate: &mut [T; N], n: usize, newest: T, reciprocal: T) -> T {
        debug_assert!(rate[n] == T::of(0.0));
        // The rest of the sum does not depend on the newest term, so that it need not wait for it.
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

/// Zero coefficients.
#[inline(always)]
pub fn zeros<T: Number, const N: usize>() -> [T; N] {
    [T::of(0.0); N]
}

/// All coefficients of a b. Both series must be finite.
#[inline]
pub fn product<T: Number, const N: usize>(a: &[T; N], b: &[T; N]) -> [T; N] {
    let mut unfolding = Unfolding::new();
    for (n, coefficient) in b.iter().enumerate() {
        unfolding.set(n, *coefficient);
    }
    std::array::from_fn(|n| unfolding.product(a, n, 0, N - 1))
}

/// Coefficient `n` of a b, with both known up to n and `a` zero beyond `degree`. It uses partial sums like
/// [`Number::dot`].
#[inline(always)]
pub fn convolved<T: Number>(a: &[T], b: &[T], n: usize, degree: usize) -> T {
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

/// Adds `factor` a b to a series whose length is a multiple of four, for as many coefficients as `b` has. `a` counts
/// as zero beyond its end.
#[inline(always)]
pub fn add_product<T: Number, const N: usize>(sum: &mut [T; N], factor: T, a: &[T], b: &[T]) {
    const { assert!(N.is_multiple_of(4)) };
    // The leading zeros stand for negative indices.
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

/// Adds `factor` a^2 to a series whose length is a multiple of four, for as many coefficients as `a` has. Each pair
/// of factors is computed once.
#[inline(always)]
pub fn add_square<T: Number, const N: usize>(sum: &mut [T; N], factor: T, a: &[T]) {
    const { assert!(N.is_multiple_of(4)) };
    let mut all = zeros::<T, N>();
    all[..a.len()].copy_from_slice(a);
    let two = T::of(2.0);
    let groups = sum.as_chunks_mut::<4>().0;
    for (group, sums) in groups.iter_mut().take(a.len().div_ceil(4)).enumerate() {
        // Coefficients 4 group + j, j < 4: pairs with one index below `half`, and pairs among the four from there on.
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

/// Fills `c` (at least two elements) with the coefficients of the solution of q'' + 2 sigma q' + omega0_squared q = 0
/// with this initial value and rate, all in the unit of x.
pub fn damped_oscillation<T: Number>(sigma: T, omega0_squared: T, value: T, rate: T, c: &mut [T]) {
    c[0] = value;
    c[1] = rate;
    for n in 0..c.len() - 2 {
        let restoring = T::of(2.0 * (n + 1) as f64) * sigma * c[n + 1] + omega0_squared * c[n];
        c[n + 2] = -restoring / T::of(((n + 1) * (n + 2)) as f64);
    }
}

/// The value of the series at `x`.
#[inline]
pub fn value<T: Number>(c: &[T], x: T) -> T {
    let mut sum = T::of(0.0);
    for term in c.iter().rev() {
        sum = sum * x + *term;
    }
    sum
}

/// Value and derivative of the series at `x`.
#[inline]
pub fn value_and_rate<T: Number>(c: &[T], x: T) -> (T, T) {
    let (mut sum, mut rate) = (T::of(0.0), T::of(0.0));
    for term in c.iter().rev() {
        rate = rate * x + sum;
        sum = sum * x + *term;
    }
    (sum, rate)
}

/// The longest x for which both of the last two terms stay below 1. `size(n)` is coefficient n divided by its
/// tolerance, for the last index `order` and the one before. Infinite if both sizes are zero.
///
/// Two terms are tested, because every other coefficient of an even or odd solution vanishes.
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
