//! Binary floating-point numbers of N words, stored in place: they need no allocation, and the compiler knows N. The
//! speed of the exact solver comes from this, and from inner products that are aligned once and normalised once.
//!
//! Results are truncated: the error is less than one unit in the last place (in an inner product: of its largest
//! term). The guard digits of a run absorb it.

// Carries run through the words of two numbers, which is clearer with indices than with iterators.
#![allow(clippy::needless_range_loop)]

use super::number::ExactDouble;
use num_bigint::{BigInt, BigUint, Sign};
use num_rational::BigRational;
use num_traits::{One, Signed, Zero};
use std::cmp::Ordering;
use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

pub(super) const WORD_BITS: usize = 64;

/// Exponents of finite nonzero numbers are smaller in magnitude.
const LARGEST_EXPONENT: i64 = 1 << 39;

/// Exponent of a number that is not finite; zero has minus this exponent. No product with a finite number changes the
/// kind.
const NO_EXPONENT: i64 = 2 * LARGEST_EXPONENT;

/// Plus or minus 0.mantissa times 2^exponent.
#[derive(Debug, Clone, Copy)]
pub struct Float<const N: usize> {
    /// Least significant word first. The top bit of the last word is set, unless the number is zero.
    words: [u64; N],
    /// The magnitude is in [1/2, 1) 2^exponent. Not finite: `NO_EXPONENT`; zero: minus that.
    pub exponent: i64,
    negative: bool,
}

/// A product of two mantissas, in [1/4, 1), or a part of it: N words and one more below.
#[derive(Clone, Copy)]
struct Wide<const N: usize> {
    words: [u64; N],
    below: u64,
}

/// The first N + 1 words of the product, without carries from lower words. The error is below N 2^-64 of the last
/// word.
#[inline(always)]
fn product<const N: usize>(a: &[u64; N], b: &[u64; N]) -> Wide<N> {
    let mut wide = Wide {
        words: [0; N],
        below: 0,
    };
    let mut sum: u128 = 0;
    for column in N.saturating_sub(2)..2 * N - 1 {
        let mut over = 0;
        for i in column.saturating_sub(N - 1)..=column.min(N - 1) {
            let term = u128::from(a[i]) * u128::from(b[column - i]);
            let (next, carried) = sum.overflowing_add(term);
            sum = next;
            over += u64::from(carried);
        }
        match column.checked_sub(N) {
            Some(word) => wide.words[word] = sum as u64,
            None if column + 1 == N => wide.below = sum as u64,
            None => {}
        }
        sum = (sum >> WORD_BITS) | (u128::from(over) << WORD_BITS);
    }
    wide.words[N - 1] = sum as u64;
    wide
}

/// The low one of two words, shifted right by less than a word.
#[inline(always)]
fn funnel(high: u64, low: u64, by: u32) -> u64 {
    (((u128::from(high) << WORD_BITS) | u128::from(low)) >> by) as u64
}

impl<const N: usize> Wide<N> {
    #[inline(always)]
    fn shifted(&self, by: u64) -> Wide<N> {
        let bits = (by % WORD_BITS as u64) as u32;
        let words = (by / WORD_BITS as u64) as usize;
        let from = if words == 0 { *self } else { self.moved(words) };
        let mut shifted = from;
        shifted.below = funnel(from.words[0], from.below, bits);
        for k in 0..N {
            let above = if k + 1 < N { from.words[k + 1] } else { 0 };
            shifted.words[k] = funnel(above, from.words[k], bits);
        }
        shifted
    }

    #[inline(never)]
    fn moved(&self, words: usize) -> Wide<N> {
        let at = |k: usize| self.words.get(k).copied().unwrap_or(0);
        Wide {
            below: at(words - 1),
            words: std::array::from_fn(|k| at(k + words)),
        }
    }
}

/// A sum of [`Wide`]s in two's complement, with a sign word above.
struct Accumulator<const N: usize> {
    above: u64,
    wide: Wide<N>,
}

impl<const N: usize> Accumulator<N> {
    #[inline(always)]
    fn zero() -> Self {
        Accumulator {
            above: 0,
            wide: Wide {
                words: [0; N],
                below: 0,
            },
        }
    }

    #[inline(always)]
    fn add(&mut self, term: &Wide<N>, negative: bool) {
        // A negative term is its complement plus one.
        let mask = if negative { u64::MAX } else { 0 };
        let (below, first) = self.wide.below.overflowing_add(term.below ^ mask);
        let (below, second) = below.overflowing_add(mask & 1);
        self.wide.below = below;
        let mut carry = first | second;
        for k in 0..N {
            let (sum, first) = self.wide.words[k].overflowing_add(term.words[k] ^ mask);
            let (sum, second) = sum.overflowing_add(u64::from(carry));
            self.wide.words[k] = sum;
            carry = first | second;
        }
        self.above = self.above.wrapping_add(mask).wrapping_add(u64::from(carry));
    }

    /// The sum as a number whose first word has this exponent if there are no carries.
    #[inline(always)]
    fn finish(mut self, exponent: i64) -> Float<N> {
        let negative = (self.above as i64) < 0;
        if negative {
            let mut carry;
            (self.wide.below, carry) = (!self.wide.below).overflowing_add(1);
            for word in &mut self.wide.words {
                (*word, carry) = (!*word).overflowing_add(u64::from(carry));
            }
            self.above = (!self.above).wrapping_add(u64::from(carry));
        }
        if self.above == 0 && self.wide.words[N - 1] >> (WORD_BITS - 1) == 1 {
            return Float::new(self.wide.words, exponent, negative);
        }
        if self.above != 0 {
            let up = WORD_BITS as u32 - self.above.leading_zeros();
            let wide = self.wide;
            let carried = if up == 64 {
                let mut words = [0; N];
                words[..N - 1].copy_from_slice(&wide.words[1..]);
                words[N - 1] = self.above;
                words
            } else {
                std::array::from_fn(|k| {
                    let above = if k + 1 < N { wide.words[k + 1] } else { self.above };
                    funnel(above, wide.words[k], up)
                })
            };
            return Float::new(carried, exponent + i64::from(up), negative);
        }
        self.wide.normalised(exponent, negative)
    }
}

impl<const N: usize> Wide<N> {
    #[inline(always)]
    fn normalised(&self, exponent: i64, negative: bool) -> Float<N> {
        let top = self.words[N - 1];
        if top != 0 {
            let up = top.leading_zeros();
            if up == 0 {
                return Float::new(self.words, exponent, negative);
            }
            let words = std::array::from_fn(|k| {
                let below = if k == 0 { self.below } else { self.words[k - 1] };
                funnel(self.words[k], below, WORD_BITS as u32 - up)
            });
            return Float::new(words, exponent - i64::from(up), negative);
        }
        self.cancelled(exponent, negative)
    }

    #[cold]
    #[inline(never)]
    fn cancelled(&self, exponent: i64, negative: bool) -> Float<N> {
        let at = |k: usize| if k == 0 { self.below } else { self.words[k - 1] };
        let Some(first) = (0..=N).rev().find(|&k| at(k) != 0) else {
            return Float::zero();
        };
        let lost = N - first;
        let moved = Wide {
            below: 0,
            words: std::array::from_fn(|k| if k + 1 < lost { 0 } else { at(k + 1 - lost) }),
        };
        moved.normalised(exponent - (lost * WORD_BITS) as i64, negative)
    }
}

impl<const N: usize> Float<N> {
    /// Bits of the mantissa.
    pub const BITS: usize = N * WORD_BITS;

    /// Zero.
    #[inline]
    pub const fn zero() -> Self {
        Float {
            words: [0; N],
            exponent: -NO_EXPONENT,
            negative: false,
        }
    }

    const LOST: Self = Float {
        words: [1 << 63; N],
        exponent: NO_EXPONENT,
        negative: false,
    };

    /// From a mantissa whose top bit is set.
    #[inline(always)]
    fn new(words: [u64; N], exponent: i64, negative: bool) -> Self {
        if exponent.abs() < LARGEST_EXPONENT {
            return Float {
                words,
                exponent,
                negative,
            };
        }
        if exponent > 0 { Self::LOST } else { Self::zero() }
    }

    /// Keeps the first `bits` of the mantissa, and clears the others.
    pub fn cut(&mut self, bits: usize) {
        let mut beyond = Self::BITS.saturating_sub(bits);
        for word in &mut self.words {
            let cleared = beyond.min(WORD_BITS);
            *word &= u64::MAX.checked_shl(cleared as u32).unwrap_or(0);
            beyond -= cleared;
        }
    }

    /// The double `value`, exactly.
    pub fn from_f64(value: f64) -> Self {
        if value == 0.0 {
            return Self::zero();
        }
        if !value.is_finite() {
            return Self::LOST;
        }
        let bits = value.abs().to_bits();
        let (mantissa, shift) = match bits >> 52 {
            0 => (bits, 0),
            biased => ((bits & ((1 << 52) - 1)) | (1 << 52), biased as i64 - 1),
        };
        let up = mantissa.leading_zeros();
        let mut words = [0; N];
        words[N - 1] = mantissa << up;
        // The mantissa of a double counts in units of 2^-1074 2^shift.
        Self::new(words, shift - 1074 + 64 - i64::from(up), value < 0.0)
    }

    /// The rational `value`, truncated.
    pub fn from_rational(value: &BigRational) -> Self {
        if value.is_zero() {
            return Self::zero();
        }
        Self::quotient(
            value.numer().magnitude(),
            value.denom().magnitude(),
            0,
            value.is_negative(),
        )
    }

    pub(super) fn quotient(numerator: &BigUint, denominator: &BigUint, exponent: i64, negative: bool) -> Self {
        let shift = (Self::BITS + 2) as i64 - (numerator.bits() as i64 - denominator.bits() as i64);
        let quotient = if shift >= 0 {
            (numerator << shift as u64) / denominator
        } else {
            numerator / (denominator << shift.unsigned_abs())
        };
        let excess = quotient.bits() as i64 - Self::BITS as i64;
        let mantissa = if excess >= 0 {
            quotient >> excess as u64
        } else {
            quotient << excess.unsigned_abs()
        };
        let mut words = [0; N];
        for (word, digit) in words.iter_mut().zip(mantissa.to_u64_digits()) {
            *word = digit;
        }
        Self::new(words, exponent + excess - shift + Self::BITS as i64, negative)
    }

    fn mantissa(&self) -> BigUint {
        let halves = self.words.iter().flat_map(|word| [*word as u32, (*word >> 32) as u32]);
        BigUint::new(halves.collect())
    }

    /// The nearest double, or one next to it.
    pub fn to_f64(self) -> f64 {
        if !self.is_finite() {
            return f64::NAN;
        }
        self.scaled(0)
    }

    /// self/2^exponent as a double; 0 below the range of doubles.
    pub fn scaled(&self, exponent: i64) -> f64 {
        let below = if N > 1 {
            self.words[N - 2] as f64 * 2f64.powi(-64)
        } else {
            0.0
        };
        let mantissa = (self.words[N - 1] as f64 + below) * 2f64.powi(-64);
        let power = self.exponent - exponent;
        // Two steps, so that neither leaves the range too early.
        let half = power.clamp(-2200, 2200) / 2;
        let rest = power.clamp(-2200, 2200) - half;
        let magnitude = mantissa * 2f64.powi(half as i32) * 2f64.powi(rest as i32);
        if self.negative { -magnitude } else { magnitude }
    }

    /// log2 of the magnitude, to about double precision; negative infinity for zero.
    pub fn log2(&self) -> f64 {
        if self.is_zero() {
            return f64::NEG_INFINITY;
        }
        if !self.is_finite() {
            return f64::NAN;
        }
        self.exponent as f64 + (self.words[N - 1] as f64).log2() - WORD_BITS as f64
    }

    /// self/divisor.
    pub fn over(&self, divisor: &Self) -> Self {
        if divisor.is_zero() || !divisor.is_finite() || !self.is_finite() {
            return Self::LOST;
        }
        if self.is_zero() {
            return Self::zero();
        }
        let exponent = self.exponent - divisor.exponent;
        let negative = self.negative != divisor.negative;
        Self::quotient(&self.mantissa(), &divisor.mantissa(), exponent, negative)
    }

    /// Whether the number is exactly zero.
    #[inline]
    pub fn is_zero(&self) -> bool {
        self.words[N - 1] == 0
    }

    /// Whether the number is finite.
    #[inline]
    pub fn is_finite(&self) -> bool {
        self.exponent < LARGEST_EXPONENT
    }

    /// Sign: -1, 0 or 1.
    #[inline]
    pub fn signum(&self) -> i8 {
        match self.is_zero() {
            true => 0,
            false if self.negative => -1,
            false => 1,
        }
    }

    /// The exact half.
    #[inline]
    pub fn half(&self) -> Self {
        let mut half = *self;
        if !self.is_zero() && self.is_finite() {
            half.exponent -= 1;
        }
        half
    }

    #[inline(always)]
    fn sum(&self, other: &Self, negated: bool) -> Self {
        let theirs = other.negative != negated;
        if other.is_zero() || !self.is_finite() {
            return *self;
        }
        if self.is_zero() || !other.is_finite() {
            return Float {
                negative: theirs,
                ..*other
            };
        }
        let (large, small, negative) = if self.exponent >= other.exponent {
            (self, other, self.negative)
        } else {
            (other, self, theirs)
        };
        let shift = (large.exponent - small.exponent) as u64;
        if shift > (Self::BITS + WORD_BITS) as u64 {
            return Float { negative, ..*large };
        }
        let term = Wide {
            words: small.words,
            below: 0,
        }
        .shifted(shift);
        let mut words = large.words;
        if self.negative == theirs {
            let mut carry = false;
            for k in 0..N {
                let (sum, first) = words[k].overflowing_add(term.words[k]);
                let (sum, second) = sum.overflowing_add(u64::from(carry));
                words[k] = sum;
                carry = first | second;
            }
            if !carry {
                return Self::new(words, large.exponent, negative);
            }
            let halved = std::array::from_fn(|k| {
                let above = if k + 1 < N { words[k + 1] } else { 1 };
                funnel(above, words[k], 1)
            });
            return Self::new(halved, large.exponent + 1, negative);
        }
        let (below, mut borrow) = 0u64.overflowing_sub(term.below);
        for k in 0..N {
            let (rest, first) = words[k].overflowing_sub(term.words[k]);
            let (rest, second) = rest.overflowing_sub(u64::from(borrow));
            words[k] = rest;
            borrow = first | second;
        }
        if borrow {
            // With equal exponents the second number was larger.
            let mut carry = true;
            for word in &mut words {
                (*word, carry) = (!*word).overflowing_add(u64::from(carry));
            }
            return Wide { words, below: 0 }.normalised(large.exponent, !negative);
        }
        Wide { words, below }.normalised(large.exponent, negative)
    }

    /// The sum of the products of `a` with `b` reversed.
    pub fn convolution(a: &[Self], b: &[Self]) -> Self {
        let mut largest = -NO_EXPONENT;
        for (a, b) in a.iter().zip(b.iter().rev()) {
            largest = largest.max(a.exponent + b.exponent);
        }
        if largest <= -LARGEST_EXPONENT {
            return Self::zero();
        }
        if largest >= LARGEST_EXPONENT {
            return Self::LOST;
        }
        let mut sum = Accumulator::zero();
        for (a, b) in a.iter().zip(b.iter().rev()) {
            let shift = (largest - a.exponent - b.exponent) as u64;
            if shift > (Self::BITS + WORD_BITS) as u64 {
                continue;
            }
            let term = product(&a.words, &b.words).shifted(shift);
            sum.add(&term, a.negative != b.negative);
        }
        sum.finish(largest)
    }

    /// e^self. `reciprocals` are 1/k from k = 0, enough for a Taylor series on |r| <= ln 2 / 2.
    pub fn exp(&self, ln_2: &Self, reciprocals: &[Self]) -> Self {
        let one = Self::from_f64(1.0);
        if self.is_zero() {
            return one;
        }
        let approximate = self.to_f64() / std::f64::consts::LN_2;
        if approximate.is_nan() || approximate >= LARGEST_EXPONENT as f64 {
            return Self::LOST;
        }
        if approximate <= -(LARGEST_EXPONENT as f64) {
            return Self::zero();
        }
        let power = approximate.round();
        let rest = self - &(ln_2 * &Self::from_f64(power));
        // Terms of the series for e^0.35 above the last bit, and one more.
        let mut terms = 1;
        let mut size = 0.0;
        while size > -(Self::BITS as f64) - 2.0 && terms + 1 < reciprocals.len() {
            size += 0.35f64.log2() - (terms as f64).log2();
            terms += 1;
        }
        let mut sum = one;
        for k in (1..terms).rev() {
            sum = &(&(&sum * &rest) * &reciprocals[k]) + &one;
        }
        sum.exponent += power as i64;
        sum
    }

    /// ln 2 = 2 (1/3 + 1/(3 3^3) + 1/(5 3^5) + ...).
    pub fn ln_2() -> Self {
        let unit = BigUint::one() << (Self::BITS + WORD_BITS);
        let (mut sum, mut power, mut k) = (BigUint::zero(), &unit / 3u32 * 2u32, 1u32);
        while !power.is_zero() {
            sum += &power / k;
            power /= 9u32;
            k += 2;
        }
        Self::quotient(&sum, &unit, 0, false)
    }
}

impl<const N: usize> From<&Float<N>> for ExactDouble {
    fn from(float: &Float<N>) -> ExactDouble {
        let sign = match float.signum() {
            -1 => Sign::Minus,
            0 => Sign::NoSign,
            _ => Sign::Plus,
        };
        let mantissa = float.is_finite().then(|| BigInt::from_biguint(sign, float.mantissa()));
        ExactDouble::new(mantissa, float.exponent - Float::<N>::BITS as i64, Float::<N>::BITS)
    }
}

impl ExactDouble {
    /// The double `value`, exactly, as a number with a precision of `bits`.
    pub fn from_f64(value: f64, bits: usize) -> ExactDouble {
        // Any length holds the mantissa of a double.
        let exact = ExactDouble::from(&Float::<2>::from_f64(value));
        exact.with_bits(bits)
    }
}

impl<const N: usize> Default for Float<N> {
    fn default() -> Self {
        Self::zero()
    }
}

impl<const N: usize> PartialEq for Float<N> {
    fn eq(&self, other: &Self) -> bool {
        self.partial_cmp(other) == Some(Ordering::Equal)
    }
}

impl<const N: usize> PartialOrd for Float<N> {
    #[inline]
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        if !self.is_finite() || !other.is_finite() {
            return None;
        }
        let sign = self.signum();
        let by_sign = sign.cmp(&other.signum());
        if by_sign != Ordering::Equal || sign == 0 {
            return Some(by_sign);
        }
        let by_size = self
            .exponent
            .cmp(&other.exponent)
            .then_with(|| self.words.iter().rev().cmp(other.words.iter().rev()));
        Some(if sign < 0 { by_size.reverse() } else { by_size })
    }
}

impl<const N: usize> Add for &Float<N> {
    type Output = Float<N>;
    #[inline]
    fn add(self, other: &Float<N>) -> Float<N> {
        self.sum(other, false)
    }
}

impl<const N: usize> Sub for &Float<N> {
    type Output = Float<N>;
    #[inline]
    fn sub(self, other: &Float<N>) -> Float<N> {
        self.sum(other, true)
    }
}

impl<const N: usize> Mul for &Float<N> {
    type Output = Float<N>;
    #[inline]
    fn mul(self, other: &Float<N>) -> Float<N> {
        if self.is_zero() || other.is_zero() {
            return Float::zero();
        }
        let exponent = self.exponent + other.exponent;
        product(&self.words, &other.words).normalised(exponent, self.negative != other.negative)
    }
}

impl<const N: usize> Neg for &Float<N> {
    type Output = Float<N>;
    #[inline]
    fn neg(self) -> Float<N> {
        Float {
            negative: !self.negative,
            ..*self
        }
    }
}

impl<const N: usize> AddAssign<&Float<N>> for Float<N> {
    #[inline]
    fn add_assign(&mut self, other: &Float<N>) {
        *self = self.sum(other, false);
    }
}

impl<const N: usize> SubAssign<&Float<N>> for Float<N> {
    #[inline]
    fn sub_assign(&mut self, other: &Float<N>) {
        *self = self.sum(other, true);
    }
}
