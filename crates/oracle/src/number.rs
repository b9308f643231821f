//! Results of a run: exact numbers, independent of the precision of its arithmetic.

use num_bigint::{BigInt, BigUint};
use num_rational::BigRational;
use num_traits::{One, Pow, Signed, Zero};
use std::cmp::Ordering;
use stickslip_system::model::nearest_double;

/// A binary floating-point number of a run, exactly.
#[derive(Debug, Clone)]
pub struct ExactDouble {
    mantissa: Option<BigInt>,
    /// Power of two of the last bit of the mantissa.
    exponent: i64,
    bits: usize,
}

impl ExactDouble {
    pub(super) fn new(mantissa: Option<BigInt>, exponent: i64, bits: usize) -> ExactDouble {
        ExactDouble {
            mantissa,
            exponent,
            bits,
        }
    }

    pub(super) fn with_bits(self, bits: usize) -> ExactDouble {
        ExactDouble { bits, ..self }
    }

    /// The rational `value`, truncated to `bits`.
    pub fn from_rational(value: &BigRational, bits: usize) -> ExactDouble {
        let lengths = value.numer().magnitude().bits() as i64 - value.denom().magnitude().bits() as i64;
        let exponent = lengths - bits as i64;
        let power = BigInt::one() << exponent.unsigned_abs();
        let mantissa = if exponent >= 0 {
            value.numer() / (value.denom() * power)
        } else {
            value.numer() * power / value.denom()
        };
        ExactDouble::new(Some(mantissa), exponent, bits)
    }

    /// The exact value; `None` if not finite.
    pub fn to_rational(&self) -> Option<BigRational> {
        let mantissa = BigRational::from_integer(self.mantissa.clone()?);
        if mantissa.is_zero() {
            return Some(mantissa);
        }
        let scale = BigRational::from_integer(BigInt::one() << self.exponent.unsigned_abs());
        Some(if self.exponent >= 0 {
            mantissa * scale
        } else {
            mantissa / scale
        })
    }

    /// The nearest double; 0 below the range of doubles.
    pub fn to_f64(&self) -> f64 {
        self.to_rational().map_or(f64::NAN, |value| nearest_double(&value))
    }

    /// Bits of precision of the arithmetic that computed the number.
    pub fn bits(&self) -> usize {
        self.bits
    }

    /// The number rounded to `digits` significant decimal digits, such as `6.97413067386` or `-4.0177e-05`.
    pub fn to_decimal(&self, digits: usize) -> String {
        match self.to_rational() {
            Some(value) => decimal(&value, digits),
            None => "nan".to_owned(),
        }
    }

    /// |self - other|, rounded up to a double.
    pub fn distance(&self, other: &ExactDouble) -> f64 {
        let (Some(a), Some(b)) = (self.to_rational(), other.to_rational()) else {
            return f64::NAN;
        };
        let distance = (a - b).abs();
        let nearest = nearest_double(&distance);
        let is_below = BigRational::from_float(nearest).is_some_and(|nearest| nearest < distance);
        if is_below { nearest.next_up() } else { nearest }
    }

    /// self - other, rounded to a double once.
    pub fn minus(&self, other: &ExactDouble) -> f64 {
        match (self.to_rational(), other.to_rational()) {
            (Some(a), Some(b)) => nearest_double(&(a - b)),
            _ => f64::NAN,
        }
    }
}

/// `value` rounded to `digits` significant decimal digits, with an exponent if the plain form is long.
pub fn decimal(value: &BigRational, digits: usize) -> String {
    if value.is_zero() {
        return "0".to_owned();
    }
    let digits = digits.max(1);
    let (numerator, denominator) = (value.numer().magnitude(), value.denom().magnitude());
    let bits = numerator.bits() as f64 - denominator.bits() as f64;
    // The estimate is right or off by one; the number of digits shows which.
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

/// Larger powers of ten occur in no case, and would take very long.
const LARGEST_EXPONENT: i32 = 100_000;

/// The exact value of a decimal number such as `-4.0177e-05`; `None` if malformed.
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
