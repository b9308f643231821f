//! What the times of a candidate's file can tell apart.
//!
//! A 32-bit number near 7 s stands for all times within 2.4e-7 s of it, and one that was written with seven digits for those
//! within 5e-7 s. An event cannot be told to be wrong by less, whatever the solver does. Of a file whose times are multiples of one step
//! which its numbers hold exactly, this says nothing: they are not rounded.

use serde::Serialize;

/// To what numbers are rounded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rounding {
    /// 24 binary digits.
    Single,
    /// So many significant decimal digits.
    Digits(u32),
    /// So many digits after the point.
    Decimals(u32),
}

/// Texts with more digits than this are not called rounded.
const MOST_DIGITS: u32 = 12;

impl Rounding {
    /// The distance of two neighbouring numbers at `value`.
    pub(crate) fn quantum(self, value: f64) -> f64 {
        let size = value.abs();
        match self {
            Rounding::Single => {
                let single = (size as f32).min(f32::MAX.next_down());
                f64::from(single.next_up() - single)
            }
            Rounding::Digits(n) => {
                let decade = if size > 0.0 { size.log10().floor() as i32 } else { -300 };
                10f64.powi(decade.clamp(-300, 300) + 1 - n as i32)
            }
            Rounding::Decimals(n) => 10f64.powi(-(n as i32)),
        }
    }

    /// Whether rounding may give several rows of a table of samples one time: what has fewer digits was written by hand.
    pub(crate) fn repeats(self) -> bool {
        match self {
            Rounding::Single => true,
            Rounding::Digits(n) => n >= 4,
            Rounding::Decimals(n) => n >= 3,
        }
    }

    /// Whether such a file can hold all of these.
    pub(crate) fn hold(self, values: &[f64]) -> bool {
        values.iter().all(|&value| self.holds(value))
    }

    /// Whether `value` can stand in such a file.
    fn holds(self, value: f64) -> bool {
        match self {
            Rounding::Single => f64::from(value as f32) == value,
            _ => {
                let multiple = value / self.quantum(value);
                // A double errs by 1e-16 of itself, a hundredth of a thousandth of the last of twelve digits.
                (multiple - multiple.round()).abs() < 1e-3
            }
        }
    }

    /// In words.
    pub(crate) fn name(self) -> String {
        let plural = |n: u32| if n == 1 { "" } else { "s" };
        match self {
            Rounding::Single => "32-bit floating-point numbers".to_owned(),
            Rounding::Digits(n) => format!("numbers of {n} digit{}", plural(n)),
            Rounding::Decimals(n) => format!("numbers with {n} decimal{}", plural(n)),
        }
    }
}

/// Finds out how numbers were written, by their texts.
#[derive(Debug, Default, Clone)]
pub(crate) struct Digits {
    count: u64,
    significant: u32,
    decimals: Option<u32>,
    /// All have the same number of decimals, and none an exponent.
    fixed: bool,
}

impl Digits {
    /// Takes the next text of a number.
    pub fn add(&mut self, text: &str) {
        let text = text.trim().trim_start_matches(['+', '-']);
        let (mantissa, exponent) = match text.split_once(['e', 'E']) {
            Some((mantissa, _)) => (mantissa, true),
            None => (text, false),
        };
        let decimals = mantissa.split_once('.').map_or(0, |(_, fraction)| fraction.len()) as u32;
        let digits = mantissa.bytes().filter(u8::is_ascii_digit);
        let significant = digits.skip_while(|digit| *digit == b'0').count() as u32;
        if self.count == 0 {
            self.decimals = Some(decimals);
            self.fixed = true;
        }
        self.fixed &= !exponent && self.decimals == Some(decimals);
        self.significant = self.significant.max(significant);
        self.count += 1;
    }

    /// To what they are rounded; `None` of those with all digits of a double, or nearly.
    pub fn rounding(&self) -> Option<Rounding> {
        if self.count < 2 || self.significant == 0 || self.significant > MOST_DIGITS {
            return None;
        }
        Some(match self.decimals.filter(|_| self.fixed) {
            Some(decimals) => Rounding::Decimals(decimals),
            None => Rounding::Digits(self.significant),
        })
    }
}

/// How the values of a column stand in its file.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Digital {
    /// To what they are rounded; `None` of doubles.
    pub rounding: Option<Rounding>,
    /// The largest of the first ones.
    pub largest: f64,
}

/// So many different values confirm a rounding: short numbers such as 0.0 and 0.5 are also those of doubles.
const CONFIRMED_BY: usize = 4;

impl Digital {
    /// By the first values, and by what their texts say.
    pub fn of(values: &[f64], of_texts: Option<Rounding>) -> Digital {
        let mut different: Vec<f64> = Vec::new();
        for &value in values.iter().filter(|value| **value != 0.0) {
            if different.len() < CONFIRMED_BY && !different.contains(&value) {
                different.push(value);
            }
        }
        let confirmed = |rounding: &Rounding| different.len() == CONFIRMED_BY && rounding.hold(values);
        Digital {
            rounding: of_texts.or(Some(Rounding::Single)).filter(confirmed),
            largest: values.iter().fold(0.0, |largest, value| largest.max(value.abs())),
        }
    }

    /// The largest error of a value of this size.
    pub fn error(&self, value: f64) -> f64 {
        self.rounding
            .map_or(f64::EPSILON * value.abs(), |rounding| rounding.quantum(value))
            / 2.0
    }
}

/// Looks at the times of a candidate as they stand in its file.
#[derive(Debug, Clone)]
pub(crate) struct Clock {
    /// How many seconds its unit is.
    pub factor: f64,
    /// What is added to its times, s.
    pub offset: f64,
    /// To what its numbers seem to be rounded.
    pub rounding: Option<Rounding>,
}

impl Clock {
    /// Of times in seconds.
    pub fn seconds() -> Clock {
        Clock {
            factor: 1.0,
            offset: 0.0,
            rounding: None,
        }
    }

    /// Of a number of the file, s.
    #[inline]
    pub fn time(&self, raw: f64) -> f64 {
        raw * self.factor + self.offset
    }

    /// What is resolved at a time (s), s.
    pub fn quantum(&self, rounding: Rounding, time: f64) -> f64 {
        rounding.quantum((time - self.offset) / self.factor) * self.factor.abs()
    }
}

/// Goes through the times of a file and confirms that they are rounded.
#[derive(Debug, Clone, Default)]
pub(crate) struct ClockWatch {
    last: Option<f64>,
    step: Option<f64>,
    rows: u64,
    irregular: u64,
    refuted: bool,
    /// Rows that have the time of the one before them.
    pub repeated: u64,
}

impl ClockWatch {
    /// Takes the next number of the file.
    pub fn add(&mut self, rounding: Rounding, raw: f64) {
        self.rows += 1;
        self.refuted |= !rounding.holds(raw);
        if let Some(last) = self.last {
            let step = raw - last;
            if let Some(before) = self.step {
                self.irregular += u64::from((step - before).abs() > 0.25 * rounding.quantum(raw));
            }
            self.step = Some(step);
        }
        self.last = Some(raw);
    }

    /// Whether the times are rounded: they are what such numbers can be, and their steps are not as even as those of a clock
    /// that such numbers hold exactly.
    pub fn is_rounded(&self) -> bool {
        // Intervals change here and there.
        let few = (self.rows / 500).max(4);
        !self.refuted && (self.repeated > 0 || self.irregular > few)
    }
}

/// What a candidate's file resolves.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Resolution {
    /// What its times are: "32-bit floating-point numbers", "numbers of 7 digits".
    pub of: String,
    /// The distance of two neighbouring times at the end, s.
    pub seconds: f64,
    /// Where that is, s.
    pub at: f64,
    /// Rows that were left out, as they have the time of the one before them.
    pub repeated: u64,
    /// Up to this an error of an event is one of the file, s: one distance of its times where they are stated, two where events were found in
    /// samples.
    pub event_error: f64,
    /// Matched events whose error is no larger than that.
    pub events_below: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_neighbours_of_numbers_in_files() {
        // 24 binary digits: between 4 and 8 they are 2^-21 apart.
        assert_eq!(Rounding::Single.quantum(7.0), 2f64.powi(-21));
        assert!((Rounding::Digits(7).quantum(6.975) / 1e-6 - 1.0).abs() < 1e-12);
        assert!((Rounding::Decimals(6).quantum(123.0) / 1e-6 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn analytic_digits_of_texts() {
        let of = |texts: &[&str]| {
            let mut digits = Digits::default();
            texts.iter().for_each(|text| digits.add(text));
            digits.rounding()
        };
        assert_eq!(of(&["6.975001e+00", "6.975002e+00"]), Some(Rounding::Digits(7)));
        assert_eq!(of(&["0.000000", "6.975002"]), Some(Rounding::Decimals(6)));
        assert_eq!(of(&["0.", "47.5732E-06", "1.1888E-03"]), Some(Rounding::Digits(6)));
        assert_eq!(of(&["6.9750014941234", "6.975"]), None);
    }

    #[test]
    fn analytic_a_clock_that_numbers_hold_exactly_is_not_rounded() {
        let rounded = |rounding: Rounding, times: &mut dyn Iterator<Item = f64>| {
            let mut watch = ClockWatch::default();
            times.for_each(|time| watch.add(rounding, time));
            watch.is_rounded()
        };
        let single = |step: f64| (0..2000).map(move |k| f64::from((6.97 + step * f64::from(k)) as f32));
        assert!(rounded(Rounding::Single, &mut single(1e-6)));
        assert!(!rounded(
            Rounding::Single,
            &mut (0..2000).map(|k| f64::from(k) / 1024.0)
        ));
        let decimal = |step: f64| (0..2000).map(move |k| ((6.97 + step * f64::from(k)) * 1e6).round() / 1e6);
        assert!(rounded(Rounding::Digits(7), &mut decimal(2.5e-6)));
        assert!(!rounded(Rounding::Digits(7), &mut decimal(2e-6)));
    }
}
