//! Binary floating-point numbers of a chosen precision, and their exact exchange with rationals and decimals.

use astro_float::{BigFloat, Consts, RoundingMode, Sign, WORD_BIT_SIZE, Word};
use num_bigint::{BigInt, BigUint, Sign as BigSign};
use num_rational::BigRational;
use num_traits::{One, Pow, Signed, ToPrimitive, Zero};
use std::cmp::Ordering;
use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

/// Results are cut off, at less than one unit in the last place: the guard digits are there for that, and it is the
/// cheapest.
const CUT: RoundingMode = RoundingMode::None;

/// A number with its precision. Operations have the precision of their left operand.
#[derive(Debug, Clone)]
pub struct Number {
    value: BigFloat,
    /// Of the mantissa, a multiple of the machine word.
    bits: usize,
}

impl Number {
    /// Zero, exactly.
    pub fn zero(bits: usize) -> Number {
        Number::new(BigFloat::new(bits), bits)
    }

    fn new(value: BigFloat, bits: usize) -> Number {
        Number { value, bits }
    }

    /// The double `value`, exactly.
    pub fn from_f64(value: f64, bits: usize) -> Number {
        Number::new(BigFloat::from_f64(value, bits.max(64)), bits)
    }

    /// The rational `value`, to the precision of `bits`.
    pub fn from_rational(value: &BigRational, bits: usize) -> Number {
        if value.is_zero() {
            return Number::zero(bits);
        }
        let (numerator, denominator) = (value.numer().magnitude(), value.denom().magnitude());
        // A quotient of a word more than `bits`, shifted so that its first bit is that of its first word.
        let length = bits + 2 * WORD_BIT_SIZE;
        let shift = length as i64 - (numerator.bits() as i64 - denominator.bits() as i64);
        let quotient = if shift >= 0 {
            (numerator << shift as u64) / denominator
        } else {
            numerator / (denominator << shift.unsigned_abs())
        };
        let excess = quotient.bits() as i64;
        let align = (WORD_BIT_SIZE as i64 - excess % WORD_BIT_SIZE as i64) % WORD_BIT_SIZE as i64;
        let words = words_of(&(quotient << align as u64));
        let sign = if value.is_negative() { Sign::Neg } else { Sign::Pos };
        let mut number = BigFloat::from_words(&words, sign, (excess - shift) as i32);
        // Cutting a mantissa does not fail.
        let _ = number.set_precision(bits, CUT);
        Number::new(number, bits)
    }

    /// The exact value; `None` if the number is not finite.
    pub fn to_rational(&self) -> Option<BigRational> {
        let (words, _, sign, exponent, _) = self.value.as_raw_parts()?;
        let magnitude = words.iter().rev().fold(BigUint::zero(), |sum, &word| {
            (sum << WORD_BIT_SIZE) | BigUint::from(word)
        });
        let sign = match sign {
            Sign::Pos => BigSign::Plus,
            Sign::Neg => BigSign::Minus,
        };
        let mantissa = BigRational::from_integer(BigInt::from_biguint(sign, magnitude));
        let power = i64::from(exponent) - (words.len() * WORD_BIT_SIZE) as i64;
        let scale = BigRational::from_integer(BigInt::one() << power.unsigned_abs());
        Some(if power >= 0 { mantissa * scale } else { mantissa / scale })
    }

    /// The nearest double, or one beside it; 0 below the range of doubles.
    pub fn to_f64(&self) -> f64 {
        let Some((words, _, sign, exponent, _)) = self.value.as_raw_parts() else {
            return f64::NAN;
        };
        let base = 2f64.powi(WORD_BIT_SIZE as i32);
        let mantissa = words.iter().rev().take(2).fold((0.0, 1.0), |(sum, unit), &word| {
            let unit = unit / base;
            (sum + word as f64 * unit, unit)
        });
        let magnitude = scale_by_power(mantissa.0, i64::from(exponent));
        if sign == Sign::Neg { -magnitude } else { magnitude }
    }

    /// log2 of the magnitude, to about a double's precision; negative infinity for zero.
    pub fn log2(&self) -> f64 {
        match (
            self.value.exponent(),
            self.value.mantissa_digits().and_then(<[Word]>::last),
        ) {
            (Some(exponent), Some(&top)) if top != 0 => {
                f64::from(exponent) + (top as f64).log2() - WORD_BIT_SIZE as f64
            }
            _ if self.value.is_nan() || self.value.is_inf() => f64::NAN,
            _ => f64::NEG_INFINITY,
        }
    }

    /// e to the power of this.
    pub fn exp(&self, constants: &mut Consts) -> Number {
        Number::new(self.value.exp(self.bits, CUT, constants), self.bits)
    }

    /// The quotient.
    pub fn over(&self, divisor: &Number) -> Number {
        Number::new(self.value.div(&divisor.value, self.bits, CUT), self.bits)
    }

    /// The precision, bits of the mantissa.
    pub fn bits(&self) -> usize {
        self.bits
    }

    /// Whether it is zero, exactly.
    pub fn is_zero(&self) -> bool {
        self.value.is_zero()
    }

    /// Whether it is neither infinite nor undefined.
    pub fn is_finite(&self) -> bool {
        !self.value.is_nan() && !self.value.is_inf()
    }

    /// -1, 0 or 1.
    pub fn signum(&self) -> i8 {
        match self.value.is_zero() {
            true => 0,
            false if self.value.is_negative() => -1,
            false => 1,
        }
    }

    /// Half of it, exactly.
    pub fn half(&self) -> Number {
        let mut half = self.clone();
        if let (false, Some(exponent)) = (half.is_zero(), half.value.exponent()) {
            half.value.set_exponent(exponent - 1);
        }
        half
    }

    /// Rounded to `digits` significant decimal digits, such as `6.97413067386` or `-4.0177e-05`.
    pub fn to_decimal(&self, digits: usize) -> String {
        match self.to_rational() {
            Some(value) => decimal(&value, digits),
            None => "nan".to_owned(),
        }
    }
}

/// `value` rounded to `digits` significant decimal digits; with an exponent where the plain form would be long.
pub fn decimal(value: &BigRational, digits: usize) -> String {
    if value.is_zero() {
        return "0".to_owned();
    }
    let digits = digits.max(1);
    let (numerator, denominator) = (value.numer().magnitude(), value.denom().magnitude());
    let bits = numerator.bits() as f64 - denominator.bits() as f64;
    // Right, or off by one, which the length of the digits shows.
    let mut exponent = (bits * std::f64::consts::LOG10_2).floor() as i64;
    let rounded = loop {
        let power = exponent - (digits as i64 - 1);
        let ten = BigUint::from(10u8).pow(power.unsigned_abs());
        let (n, d) = if power >= 0 {
            (numerator.clone(), denominator * ten)
        } else {
            (numerator * ten, denominator.clone())
        };
        let text = ((n * 2u8 + &d) / (d * 2u8)).to_string();
        match text.len().cmp(&digits) {
            Ordering::Equal => break text,
            Ordering::Less => exponent -= 1,
            Ordering::Greater => exponent += 1,
        }
    };
    let sign = if value.is_negative() { "-" } else { "" };
    let trim = |text: &str| text.trim_end_matches('0').trim_end_matches('.').to_owned();
    if (-4..digits as i64).contains(&exponent) {
        let body = if exponent >= 0 {
            let (whole, rest) = rounded.split_at(exponent as usize + 1);
            format!("{whole}.{rest}")
        } else {
            format!("0.{}{rounded}", "0".repeat((-exponent - 1) as usize))
        };
        format!("{sign}{}", trim(&body))
    } else {
        let (whole, rest) = rounded.split_at(1);
        let direction = if exponent < 0 { '-' } else { '+' };
        let body = trim(&format!("{whole}.{rest}"));
        format!("{sign}{body}e{direction}{:02}", exponent.abs())
    }
}

/// Powers of ten beyond this are no numbers of a brake, and would take very long.
const LARGEST_EXPONENT: i32 = 100_000;

/// The exact value of a decimal number such as `-4.0177e-05`; `None` if it is none.
pub fn rational(text: &str) -> Option<BigRational> {
    let (mantissa, exponent) = text.trim().split_once(['e', 'E']).unwrap_or((text.trim(), "0"));
    let exponent: i32 = exponent.parse().ok()?;
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let digits: BigInt = format!("{whole}{fraction}").parse().ok()?;
    let power = exponent.checked_sub(i32::try_from(fraction.len()).ok()?)?;
    if power.abs() > LARGEST_EXPONENT {
        return None;
    }
    let ten = BigRational::from_integer(BigInt::from(10));
    Some(BigRational::from_integer(digits) * Pow::pow(ten, power))
}

/// The double nearest to a rational.
pub fn nearest_double(value: &BigRational) -> f64 {
    value.to_f64().unwrap_or(f64::NAN)
}

/// The words of an integer, the least significant first.
fn words_of(integer: &BigUint) -> Vec<Word> {
    let per_word = WORD_BIT_SIZE / 32;
    integer
        .to_u32_digits()
        .chunks(per_word)
        .map(|chunk| {
            let word = chunk
                .iter()
                .rev()
                .fold(0u64, |sum, &digit| (sum << 32) | u64::from(digit));
            word as Word
        })
        .collect()
}

/// x times 2^power, in steps that neither overflow nor underflow on their way.
fn scale_by_power(mut x: f64, mut power: i64) -> f64 {
    while power != 0 && x != 0.0 && x.is_finite() {
        let step = power.clamp(-1000, 1000);
        x *= 2f64.powi(step as i32);
        power -= step;
    }
    x
}

impl PartialEq for Number {
    fn eq(&self, other: &Number) -> bool {
        self.partial_cmp(other) == Some(Ordering::Equal)
    }
}

impl PartialOrd for Number {
    fn partial_cmp(&self, other: &Number) -> Option<Ordering> {
        self.value.cmp(&other.value).map(|order| order.cmp(&0))
    }
}

impl Add for &Number {
    type Output = Number;
    fn add(self, other: &Number) -> Number {
        Number::new(self.value.add(&other.value, self.bits, CUT), self.bits)
    }
}

impl Sub for &Number {
    type Output = Number;
    fn sub(self, other: &Number) -> Number {
        Number::new(self.value.sub(&other.value, self.bits, CUT), self.bits)
    }
}

impl Mul for &Number {
    type Output = Number;
    fn mul(self, other: &Number) -> Number {
        Number::new(self.value.mul(&other.value, self.bits, CUT), self.bits)
    }
}

impl Neg for &Number {
    type Output = Number;
    fn neg(self) -> Number {
        Number::new(BigFloat::neg(&self.value), self.bits)
    }
}

impl AddAssign<&Number> for Number {
    fn add_assign(&mut self, other: &Number) {
        self.value = self.value.add(&other.value, self.bits, CUT);
    }
}

impl SubAssign<&Number> for Number {
    fn sub_assign(&mut self, other: &Number) {
        self.value = self.value.sub(&other.value, self.bits, CUT);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn property_decimals_pass_through_unharmed() {
        for text in [
            "6.97413067386339914422662167099",
            "-4.01769591910436980859516070784e-05",
            "2e-2713",
            "100",
            "0.0375",
        ] {
            let exact = rational(text).expect("a decimal");
            let back = Number::from_rational(&exact, 192).to_decimal(30);
            assert_eq!(rational(&back), Some(exact), "{text} became {back}");
        }
    }

    #[test]
    fn property_doubles_pass_through_unharmed() {
        for value in [1.0, -0.1, 1e-300, 6.02e23, 123_456.789] {
            assert_eq!(Number::from_f64(value, 128).to_f64(), value);
            let log2 = Number::from_f64(value, 128).log2();
            // The logarithm of a double by double arithmetic.
            assert!((log2 - value.abs().log2()).abs() < 1e-12, "{value}: {log2}");
        }
    }

    #[test]
    fn analytic_a_rational_is_rounded_to_the_precision() {
        let third = BigRational::new(BigInt::from(1), BigInt::from(3));
        let number = Number::from_rational(&third, 128).to_rational().expect("finite");
        let error = nearest_double(&((number - &third) / third));
        // One unit in the last of 128 bits.
        assert!(error.abs() < 2f64.powi(-127), "{error:e}");
    }
}
