//! Numbers as a run gives them: exact, and independent of the precision that it computed with.

use crate::model::nearest_double;
use num_bigint::{BigInt, BigUint};
use num_rational::BigRational;
use num_traits::{One, Pow, Signed, Zero};
use std::cmp::Ordering;

/// A binary floating-point number: what a run of some precision found, exactly.
#[derive(Debug, Clone)]
pub struct Number {
    /// `None`: not finite.
    mantissa: Option<BigInt>,
    /// Of the power of two that the mantissa counts.
    exponent: i64,
    /// Of the arithmetic that it comes from.
    bits: usize,
}

impl Number {
    pub(super) fn new(mantissa: Option<BigInt>, exponent: i64, bits: usize) -> Number {
        Number {
            mantissa,
            exponent,
            bits,
        }
    }

    /// The same number, as one of a precision of `bits`.
    pub(super) fn with_bits(self, bits: usize) -> Number {
        Number { bits, ..self }
    }

    /// The rational `value`, cut off after `bits`.
    pub fn from_rational(value: &BigRational, bits: usize) -> Number {
        let lengths = value.numer().magnitude().bits() as i64 - value.denom().magnitude().bits() as i64;
        let exponent = lengths - bits as i64;
        let power = BigInt::one() << exponent.unsigned_abs();
        let mantissa = if exponent >= 0 {
            value.numer() / (value.denom() * power)
        } else {
            value.numer() * power / value.denom()
        };
        Number::new(Some(mantissa), exponent, bits)
    }

    /// The exact value; `None` if the number is not finite.
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

    /// Bits of the mantissa in the arithmetic that it comes from.
    pub fn bits(&self) -> usize {
        self.bits
    }

    /// Rounded to `digits` significant decimal digits, such as `6.97413067386` or `-4.0177e-05`.
    pub fn to_decimal(&self, digits: usize) -> String {
        match self.to_rational() {
            Some(value) => decimal(&value, digits),
            None => "nan".to_owned(),
        }
    }

    /// This less `other`, rounded to a double once.
    pub fn minus(&self, other: &Number) -> f64 {
        match (self.to_rational(), other.to_rational()) {
            (Some(a), Some(b)) => nearest_double(&(a - b)),
            _ => f64::NAN,
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

/// Powers of ten beyond this are no numbers of a case, and would take very long.
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
