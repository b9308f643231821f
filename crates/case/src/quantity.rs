//! Quantities: a number with a unit, converted to SI exactly and rounded once.
//!
//! A unit expression is a product of the symbols of [`UNITS`]. A space, `*` or `·` multiplies; `/` divides by the
//! **next unit only**, so `N m s/rad` is (N m s)/rad, `N/m/s` is N/(m s) and `N/m s` is (N/m) s; `1/s` may begin an
//! expression. Powers are written `m^2`, `m2` or `m²`. There are no parentheses and no sums.
//!
//! The radian is a unit of its own, so that `deg`, `rev` and `rpm` are converted and a misplaced angle is detected.
//! It may be omitted: `N m` is accepted for `N m/rad`, `1/s` for `rad/s`.

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{One, Pow, ToPrimitive, Zero};
use std::cell::RefCell;
use std::collections::HashMap;
use stickslip_system::quote::{quoted, shown};

macro_rules! dimensions {
    ($($(#[$about:meta])* $dimension:ident: $unit:literal, $name:literal, $example:literal;)*) => {
        /// Physical dimension of a number in a case file.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum Dimension {
            $($(#[$about])* #[doc = concat!("Unit ", $unit, ".")] $dimension,)*
        }

        impl Dimension {
            /// Every dimension.
            pub const ALL: [Dimension; [$($unit),*].len()] = [$(Dimension::$dimension),*];

            fn facts(self) -> (&'static str, &'static str, &'static str) {
                match self {
                    $(Dimension::$dimension => ($unit, $name, $example),)*
                }
            }
        }
    };
}

dimensions! {
    Number: "1", "a plain number", "0.6";
    Mass: "kg", "a mass", "10 lbm";
    Stiffness: "N/m", "a stiffness", "3.161e5 lbf/in";
    Damping: "N s/m", "a damping coefficient", "50 lbf s/in";
    Force: "N", "a force", "500 lbf";
    Time: "s", "a time", "1 ms";
    Length: "m", "a length", "2.0625 in";
    Inertia: "kg m^2", "a moment of inertia", "20 slug in ft";
    TorsionalStiffness: "N m/rad", "a torsional stiffness", "6.822e7 lbf in/rad";
    TorsionalDamping: "N m s/rad", "a torsional damping coefficient", "200 lbf in s/rad";
    AngularVelocity: "rad/s", "an angular velocity", "955 rpm";
    Angle: "rad", "an angle", "1 urad";
    FrictionDecay: "s/rad", "a friction decay rate", "5 s/rad";
    FrictionCurvature: "s^2/rad^2", "a coefficient of the square of a speed", "0.1 s^2/rad^2";
    FrictionThird: "s^3/rad^3", "a coefficient of the cube of a speed", "0.1 s^3/rad^3";
    Velocity: "m/s", "a velocity", "1 mm/s";
    Torque: "N m", "a torque", "600 lbf in";
    /// Cycles per second.
    Frequency: "Hz", "a frequency", "50 Hz";
    InverseAngle: "1/rad", "a stiffness of bristles", "1e5 1/rad";
    InverseLength: "1/m", "a stiffness of bristles", "1e5 1/m";
    /// [`Dimension::FrictionDecay`] in translation.
    SlidingDecay: "s/m", "a friction decay rate", "5 s/m";
    SlidingCurvature: "s^2/m^2", "a coefficient of the square of a speed", "0.1 s^2/m^2";
    SlidingThird: "s^3/m^3", "a coefficient of the cube of a speed", "0.1 s^3/m^3";
    Impulse: "N s", "an impulse", "1 N s";
    AngularImpulse: "N m s", "an angular impulse", "1 N m s";
    Energy: "J", "an energy", "12 kJ";
    Power: "W", "a power", "5 kW";
}

impl Dimension {
    /// The SI unit, in the notation of this module; `1` for a plain number.
    pub fn unit(self) -> &'static str {
        self.facts().0
    }

    /// The dimension of a unit as UDUNITS writes it, such as "rad s-1"; `None` for any other unit.
    pub fn of_udunits(unit: &str) -> Option<Dimension> {
        let written = |dimension: &Dimension| {
            let mut parts = dimension.unit().split('/');
            let above = parts.next().filter(|above| *above != "1");
            let above = above.map(|above| above.replace('^', ""));
            let below = parts.map(|below| match below.split_once('^') {
                Some((symbol, power)) => format!("{symbol}-{power}"),
                None => format!("{below}-1"),
            });
            above.into_iter().chain(below).collect::<Vec<_>>().join(" ") == unit
        };
        match unit {
            "1" => Some(Dimension::Number),
            _ => Dimension::ALL.into_iter().find(written),
        }
    }

    /// Name with its article, as in "expected a torsional stiffness".
    pub fn name(self) -> &'static str {
        self.facts().1
    }

    /// A number of this dimension in the words of a remedy: `a number in N or "500 lbf"`.
    pub(super) fn number(self) -> String {
        match self {
            Dimension::Number => "a number".to_owned(),
            _ => format!("a number in {} or \"{}\"", self.unit(), self.example()),
        }
    }

    /// Example of a quantity in the notation of the case file.
    pub fn example(self) -> &'static str {
        self.facts().2
    }
}

/// Kind of a case's coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Motion {
    /// Angles: radians, N m, kg m^2.
    #[default]
    Rotation,
    /// Positions: metres, newtons, kilograms.
    Translation,
}

impl Motion {
    /// Both kinds.
    pub const ALL: [Motion; 2] = [Motion::Rotation, Motion::Translation];

    /// The word of the key `motion`.
    pub fn name(self) -> &'static str {
        match self {
            Motion::Rotation => "rotation",
            Motion::Translation => "translation",
        }
    }

    /// The dimension that replaces `of_rotation` in this motion.
    pub fn dimension(self, of_rotation: Dimension) -> Dimension {
        use Dimension as D;
        match of_rotation {
            other if self == Motion::Rotation => other,
            D::Inertia => D::Mass,
            D::TorsionalStiffness => D::Stiffness,
            D::TorsionalDamping => D::Damping,
            D::AngularVelocity => D::Velocity,
            D::Angle => D::Length,
            D::Torque => D::Force,
            D::FrictionDecay => D::SlidingDecay,
            D::FrictionCurvature => D::SlidingCurvature,
            D::FrictionThird => D::SlidingThird,
            D::InverseAngle => D::InverseLength,
            D::AngularImpulse => D::Impulse,
            other => other,
        }
    }
}

/// A unit symbol and its definition.
#[derive(Debug, Clone, Copy)]
pub struct Unit {
    /// Symbol in a case file, such as `lbf`.
    pub symbol: &'static str,
    /// A quantity in other units of the table; empty for the base units.
    pub definition: &'static str,
}

const fn unit(symbol: &'static str, definition: &'static str) -> Unit {
    Unit { symbol, definition }
}

/// Every unit that a case file may use. Definitions are exact (NIST SP 811, appendix B), except the two with pi,
/// which have 40 digits. A bare `lb` is deliberately missing: `lbm` and `lbf` are unambiguous.
pub const UNITS: &[Unit] = &[
    unit("kg", ""),
    unit("m", ""),
    unit("s", ""),
    unit("rad", ""),
    unit("t", "1000 kg"),
    unit("g", "0.001 kg"),
    unit("mg", "1e-6 kg"),
    unit("lbm", "0.45359237 kg"),
    unit("slug", "1 lbf s^2/ft"),
    unit("km", "1000 m"),
    unit("cm", "0.01 m"),
    unit("mm", "0.001 m"),
    unit("um", "1e-6 m"),
    unit("µm", "1e-6 m"),
    unit("nm", "1e-9 m"),
    unit("in", "0.0254 m"),
    unit("ft", "0.3048 m"),
    unit("ms", "0.001 s"),
    unit("us", "1e-6 s"),
    unit("µs", "1e-6 s"),
    unit("ns", "1e-9 s"),
    unit("min", "60 s"),
    unit("h", "3600 s"),
    unit("N", "1 kg m/s^2"),
    unit("mN", "0.001 N"),
    unit("kN", "1000 N"),
    unit("MN", "1e6 N"),
    unit("GN", "1e9 N"),
    unit("lbf", "9.80665 lbm m/s^2"),
    unit("kip", "1000 lbf"),
    unit("kgf", "9.80665 N"),
    unit("J", "1 N m"),
    unit("kJ", "1000 J"),
    unit("W", "1 J/s"),
    unit("kW", "1000 W"),
    unit("mrad", "0.001 rad"),
    unit("urad", "1e-6 rad"),
    unit("µrad", "1e-6 rad"),
    unit("deg", "0.01745329251994329576923690768488612713443 rad"),
    unit("rev", "6.283185307179586476925286766559005768394 rad"),
    unit("rpm", "1 rev/min"),
    unit("Hz", "1 1/s"),
    unit("kHz", "1000 Hz"),
    unit("MHz", "1e6 Hz"),
];

#[derive(Debug, Clone, PartialEq)]
struct Exact {
    value: BigRational,
    exponents: [i32; 4],
}

const LARGEST_POWER: i32 = 9;
/// Larger decimal exponents are outside double precision, whatever the unit.
const LARGEST_EXPONENT: i32 = 400;
const LONGEST_NUMBER: usize = 100;
/// Longest unit, bytes. It bounds the time to look up and multiply the symbols.
const LONGEST_UNIT: usize = 200;

const MOST_KNOWN: usize = 2048;
const LONGEST_KNOWN: usize = 64;

thread_local! {
    // Exact arithmetic takes most of the time when a case is read repeatedly with different overrides.
    static KNOWN: RefCell<HashMap<(Dimension, String), f64>> = RefCell::default();
}

/// Converts `text` to the SI unit of `dimension`: the exact product, rounded once to the nearest double.
///
/// # Errors
/// The error text names the defect of the quantity, and what was expected.
pub fn parse(text: &str, dimension: Dimension) -> Result<f64, String> {
    let key = (dimension, text.to_owned());
    if let Some(value) = KNOWN.with_borrow(|known| known.get(&key).copied()) {
        return Ok(value);
    }
    let value = exact(text, dimension)?.to_f64().filter(|value| value.is_finite());
    let value = value.ok_or_else(|| beyond_doubles(text))?;
    if text.len() <= LONGEST_KNOWN {
        KNOWN.with_borrow_mut(|known| {
            if known.len() >= MOST_KNOWN {
                known.clear();
            }
            known.insert(key, value);
        });
    }
    Ok(value)
}

/// Converts `text` to the SI unit of `dimension` exactly.
///
/// # Errors
/// Errors of [`parse`].
pub fn exact(text: &str, dimension: Dimension) -> Result<BigRational, String> {
    let (number, expression) = split_number(text).ok_or_else(|| {
        let (expected, example) = (expectation(dimension), written(dimension));
        format!(
            "{} is not a quantity: expected {expected}, such as {example}",
            quoted(text)
        )
    })?;
    if let Some(what) = decimal_comma(text).or_else(|| too_large(text)) {
        return Err(what);
    }
    if dimension == Dimension::Number {
        return Err(format!(
            "expected a plain number, without quotes or unit, but got {}",
            quoted(text)
        ));
    }
    if expression.is_empty() {
        let (text, unit, example) = (quoted(text), dimension.unit(), written(dimension));
        return Err(format!(
            "{text} has no unit: write {number} without quotes if it is in {unit}, or add the unit, such as {example}"
        ));
    }
    if expression.len() > LONGEST_UNIT {
        return Err(format!(
            "a unit of more than {LONGEST_UNIT} characters is not accepted; expected {}, such as {}",
            expectation(dimension),
            written(dimension)
        ));
    }
    let number = decimal(number)?;
    let unit = expand(expression)?;
    // A cycle is not a radian. Because the radian may be omitted, cycles would otherwise be read as radians, which is
    // wrong by a factor 2 pi.
    let cycles = |symbol: &&str| ["Hz", "kHz", "MHz"].contains(symbol);
    let symbols = expression.split(|c: char| !c.is_alphabetic());
    if let Some(symbol) = symbols.into_iter().find(cycles)
        && dimension != Dimension::Frequency
    {
        return Err(format!(
            "\"{symbol}\" counts cycles, and is no unit of {}: {}",
            expectation(dimension),
            match dimension {
                Dimension::AngularVelocity => "write rad/s, rev/s or rpm".to_owned(),
                _ => format!("write {}", dimension.unit()),
            }
        ));
    }
    let expected = expand(dimension.unit())?;
    let mut without_angle = expected.exponents;
    without_angle[3] = 0;
    if unit.exponents != expected.exponents && unit.exponents != without_angle {
        let (expected, found) = (expectation(dimension), describe(unit.exponents));
        return Err(format!("expected {expected}, but {} is {found}", quoted(text)));
    }
    Ok(number * unit.value)
}

/// A printed number and half a unit of its last digit, both in the SI unit of `dimension`: `6.975 s` means within
/// 0.0005 s. A plain number in quotes, such as `48`, is accepted here.
///
/// # Errors
/// Errors of [`parse`].
pub fn printed(text: &str, dimension: Dimension) -> Result<(f64, f64), String> {
    let plain = dimension == Dimension::Number;
    let number = split_number(text).filter(|(_, unit)| !plain || unit.is_empty());
    let (number, unit) = number.ok_or_else(|| format!("{} is not {}", quoted(text), expectation(dimension)))?;
    let value = if plain {
        decimal(number)?
    } else {
        exact(text, dimension)?
    };
    let (mantissa, exponent) = number.split_once(['e', 'E']).unwrap_or((number, "0"));
    let places = mantissa.split_once('.').map_or(0, |(_, fraction)| fraction.len());
    let last = exponent.parse::<i32>().unwrap_or(0) - places as i32;
    let half = decimal("0.5")? * power_of_ten(last);
    let half = if plain { half } else { half * expand(unit)?.value };
    match (value.to_f64(), half.to_f64()) {
        (Some(value), Some(half)) if value.is_finite() && half.is_finite() => Ok((value, half)),
        _ => Err(beyond_doubles(text)),
    }
}

/// Conversion factor of `unit` to the SI unit of `dimension`: 0.10471... for `rpm` as an angular velocity.
///
/// # Errors
/// The error text names the defect of the unit.
pub fn factor(unit: &str, dimension: Dimension) -> Result<f64, String> {
    parse(&format!("1 {unit}"), dimension)
}

/// A quantity with one blank between its number and its unit; any other text as it is.
pub(super) fn spaced(text: &str) -> String {
    match split_number(text) {
        Some((number, unit)) if !unit.is_empty() => format!("{number} {unit}"),
        _ => text.to_owned(),
    }
}

/// Name and unit of a dimension: "a torsional stiffness, N m/rad".
pub fn expectation(dimension: Dimension) -> String {
    match dimension {
        Dimension::Number => dimension.name().to_owned(),
        _ => format!("{}, {}", dimension.name(), dimension.unit()),
    }
}

fn written(dimension: Dimension) -> String {
    match dimension {
        Dimension::Number => dimension.example().to_owned(),
        _ => format!("\"{}\"", dimension.example()),
    }
}

fn describe(exponents: [i32; 4]) -> String {
    let known = Dimension::ALL
        .into_iter()
        .filter(|&d| d != Dimension::Number)
        .find(|d| expand(d.unit()).is_ok_and(|unit| unit.exponents == exponents));
    if let Some(dimension) = known {
        return expectation(dimension);
    }
    if expand("rad/s^2").is_ok_and(|unit| unit.exponents == exponents) {
        return "an angular acceleration, rad/s^2".to_owned();
    }
    let symbols = ["kg", "m", "s", "rad"];
    let factors = symbols.into_iter().zip(exponents).filter(|&(_, power)| power != 0);
    let factors = factors.map(|(symbol, power)| match power {
        1 => symbol.to_owned(),
        _ => format!("{symbol}^{power}"),
    });
    match factors.collect::<Vec<_>>().join(" ").as_str() {
        "" => "a plain number".to_owned(),
        factors => format!("in {factors}"),
    }
}

/// Splits `text` into its leading decimal number and the trimmed rest; `None` without a leading number.
fn split_number(text: &str) -> Option<(&str, &str)> {
    let text = text.trim();
    let bytes = text.as_bytes();
    let digits = |from: usize| bytes[from..].iter().take_while(|b| b.is_ascii_digit()).count();
    let mut end = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let whole = digits(end);
    end += whole;
    let mut fraction = 0;
    if bytes.get(end) == Some(&b'.') {
        fraction = digits(end + 1);
        end += 1 + fraction;
    }
    if whole + fraction == 0 {
        return None;
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent = digits((end + 1 + sign).min(bytes.len()));
        if exponent > 0 {
            end += 1 + sign + exponent;
        }
    }
    Some((&text[..end], text[end..].trim_start()))
}

pub(super) fn decimal(number: &str) -> Result<BigRational, String> {
    let outside = || format!("{number} is outside the range of double precision");
    if number.len() > LONGEST_NUMBER {
        return Err(format!(
            "a number of more than {LONGEST_NUMBER} characters is not accepted"
        ));
    }
    let (mantissa, exponent) = number.split_once(['e', 'E']).unwrap_or((number, "0"));
    let exponent: i32 = exponent.parse().map_err(|_| outside())?;
    if exponent.abs() > LARGEST_EXPONENT {
        return Err(outside());
    }
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let digits: BigInt = format!("{whole}{fraction}").parse().map_err(|_| outside())?;
    Ok(BigRational::from_integer(digits) * power_of_ten(exponent - fraction.len() as i32))
}

fn power_of_ten(exponent: i32) -> BigRational {
    Pow::pow(BigRational::from_integer(BigInt::from(10)), exponent)
}

fn expand(expression: &str) -> Result<Exact, String> {
    let mut product = Exact {
        value: BigRational::one(),
        exponents: [0; 4],
    };
    let mut rest = expression.trim();
    let mut divide = false;
    // A factor must follow at the start, and after `/`, `*` or `·`.
    let mut operand_due = true;
    if let Some(after) = rest.strip_prefix('1') {
        // The 1 is the numerator of "1/s", or the whole unit of a plain number.
        rest = after.trim_start();
        operand_due = false;
        if !(rest.is_empty() || rest.starts_with('/')) {
            return Err(malformed(expression, "a number can only come first, as in \"100 1/s\""));
        }
    }
    while let Some(first) = rest.chars().next() {
        match first {
            '/' | '*' | '·' | '⋅' => {
                if operand_due {
                    return Err(malformed(expression, &format!("a unit is missing before \"{first}\"")));
                }
                divide = first == '/';
                operand_due = true;
                rest = &rest[first.len_utf8()..];
            }
            '(' | ')' => {
                return Err(malformed(
                    expression,
                    "parentheses are not used; a \"/\" divides by the next unit only, so write N/m/s for N/(m s)",
                ));
            }
            _ if first.is_alphabetic() => {
                let length = rest.find(|c: char| !c.is_alphabetic()).unwrap_or(rest.len());
                let (symbol, after) = rest.split_at(length);
                let (power, after) = split_power(after)
                    .ok_or_else(|| malformed(expression, "a power is a small whole number, as in m^2"))?;
                let unit = look_up(symbol)?;
                let power = if divide { -power } else { power };
                product.value *= Pow::pow(unit.value, power);
                for (total, exponent) in product.exponents.iter_mut().zip(unit.exponents) {
                    *total += power * exponent;
                }
                divide = false;
                operand_due = false;
                rest = after;
            }
            _ => return Err(malformed(expression, &format!("\"{first}\" is not expected"))),
        }
        rest = rest.trim_start();
    }
    if operand_due {
        return Err(malformed(expression, "a unit is missing at its end"));
    }
    Ok(product)
}

/// Message about a number with a decimal comma, such as `0,2 m/s`; `None` for any other text.
pub fn decimal_comma(text: &str) -> Option<String> {
    let (number, rest) = split_number(text)?;
    let after = rest.strip_prefix(',')?;
    let digits = after.bytes().take_while(u8::is_ascii_digit).count();
    let (fraction, unit) = after.split_at(digits);
    let unit = shown(unit);
    let is_plain = number
        .bytes()
        .all(|byte| byte.is_ascii_digit() || matches!(byte, b'+' | b'-'));
    // Groups of three digits may also be thousands.
    let other = match digits {
        3 => format!(", or {number}{fraction}{unit} without a comma"),
        _ => String::new(),
    };
    (digits > 0 && is_plain).then(|| format!("write {number}.{fraction}{unit} with a point{other}"))
}

/// Message about a number without a unit that no double can hold, such as `1e400`; `None` for any other text.
pub fn too_large(text: &str) -> Option<String> {
    let (number, unit) = split_number(text)?;
    let is_infinite = number.parse::<f64>().is_ok_and(f64::is_infinite);
    (is_infinite && unit.is_empty()).then(|| beyond_doubles(text))
}

fn beyond_doubles(text: &str) -> String {
    format!("{} is too large for double precision", quoted(text))
}

fn malformed(expression: &str, why: &str) -> String {
    format!("the unit {} cannot be read: {why}", quoted(expression))
}

/// Splits `text` into its leading power (1 if absent) and the rest; `None` if the power is malformed.
fn split_power(text: &str) -> Option<(i32, &str)> {
    for (mark, power) in [("²", 2), ("³", 3)] {
        if let Some(rest) = text.strip_prefix(mark) {
            return Some((power, rest));
        }
    }
    let (explicit, text) = match text.strip_prefix('^') {
        Some(rest) => (true, rest),
        None => (false, text),
    };
    let sign = usize::from(explicit && text.starts_with('-'));
    let digits = text[sign..].bytes().take_while(u8::is_ascii_digit).count();
    if digits == 0 {
        return (!explicit).then_some((1, text));
    }
    let (power, rest) = text.split_at(sign + digits);
    let power: i32 = power.parse().ok()?;
    (power.abs() <= LARGEST_POWER).then_some((power, rest))
}

fn look_up(symbol: &str) -> Result<Exact, String> {
    // The micro sign and the Greek letter look alike.
    let symbol = &symbol.replace('\u{3bc}', "\u{b5}");
    let Some(index) = UNITS.iter().position(|unit| unit.symbol == symbol) else {
        return Err(unknown_unit(symbol));
    };
    if UNITS[index].definition.is_empty() {
        let mut exponents = [0; 4];
        exponents[index] = 1;
        return Ok(Exact {
            value: BigRational::one(),
            exponents,
        });
    }
    let (number, expression) = split_number(UNITS[index].definition).unwrap_or(("1", UNITS[index].definition));
    let mut exact = expand(expression)?;
    exact.value *= decimal(number)?;
    debug_assert!(!exact.value.is_zero());
    Ok(exact)
}

fn unknown_unit(symbol: &str) -> String {
    let known = UNITS.iter().map(|unit| unit.symbol);
    let hint = match symbol {
        "lb" | "lbs" => "write lbm for mass or lbf for force".to_owned(),
        _ => match super::suggest(symbol, known.clone()) {
            Some(close) => format!("did you mean \"{close}\"?"),
            None => format!("the units are {}", known.collect::<Vec<_>>().join(" ")),
        },
    };
    format!("unknown unit {}: {hint}", quoted(symbol))
}
