//! Resolution of the times of a candidate's file.
//!
//! A 32-bit number near 7 s stands for all times within 2.4e-7 s, and a number with seven digits for those within 5e-7
//! s. Smaller errors of an event cannot be detected. If the times are multiples of a step that the numbers hold
//! exactly, they are not rounded.

use serde::Serialize;

/// Rounding of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rounding {
    /// 24 binary digits.
    Single,
    /// The same, printed as decimals.
    PrintedSingle,
    /// This many significant decimal digits.
    Digits(u32),
    /// This many digits after the point.
    Decimals(u32),
}

const MOST_DIGITS: u32 = 12;

impl Rounding {
    /// Distance of two neighbouring numbers at `value`.
    pub fn quantum(self, value: f64) -> f64 {
        let size = value.abs();
        match self {
            Rounding::Single | Rounding::PrintedSingle => {
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

    /// Whether rounding may give several rows of samples one time; numbers with fewer digits were written by hand.
    pub(crate) fn repeats(self) -> bool {
        match self {
            Rounding::Single | Rounding::PrintedSingle => true,
            Rounding::Digits(n) => n >= 4,
            Rounding::Decimals(n) => n >= 3,
        }
    }

    pub(crate) fn hold(self, values: &[f64]) -> bool {
        values.iter().all(|&value| self.holds(value))
    }

    fn holds(self, value: f64) -> bool {
        match self {
            Rounding::Single => f64::from(value as f32) == value,
            Rounding::PrintedSingle => true,
            _ => {
                let multiple = value / self.quantum(value);
                // The relative error of a double, 1e-16, is 1e-5 of the last of twelve digits.
                (multiple - multiple.round()).abs() < 1e-3
            }
        }
    }

    /// Whether values in order of time are rounded to this, and not exact.
    fn is_uneven(self, values: &[f64]) -> bool {
        let third = |v: &[f64]| v[3] - v[0] - 3.0 * (v[2] - v[1]);
        let uneven = |v: &&[f64]| third(v).abs() > 0.5 * self.quantum(v[0]);
        let count = values.windows(4).filter(uneven).count();
        count as f64 > UNEVEN * values.len() as f64
    }

    pub(crate) fn name(self) -> String {
        let plural = |n: u32| if n == 1 { "" } else { "s" };
        match self {
            Rounding::Single | Rounding::PrintedSingle => "32-bit floating-point numbers".to_owned(),
            Rounding::Digits(n) => format!("numbers of {n} digit{}", plural(n)),
            Rounding::Decimals(n) => format!("numbers with {n} decimal{}", plural(n)),
        }
    }
}

/// Determines the rounding of numbers from their texts.
#[derive(Debug, Default, Clone)]
pub struct Digits {
    count: u64,
    significant: u32,
    decimals: Option<u32>,
    /// All have the same number of decimals, and none an exponent.
    fixed: bool,
    /// Not all are 32-bit numbers, printed with nine digits or as few as identify them.
    no_single: bool,
    /// Most significant digits without zeros at the end.
    longest: u32,
}

/// Digits that identify every 32-bit number, and those with which a number may be any.
const OF_SINGLE: u32 = 9;
const FEWER: u32 = 7;

fn is_single(text: &str) -> bool {
    let Ok(value) = text.parse::<f64>() else { return false };
    let single = value as f32;
    let printed = [format!("{single:e}"), format!("{single:.8e}")];
    f64::from(single) == value || printed.iter().any(|printed| printed.parse() == Ok(value))
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
        let significant = digits.clone().skip_while(|digit| *digit == b'0').count() as u32;
        let zeros = digits.rev().take_while(|digit| *digit == b'0').count() as u32;
        if self.count == 0 {
            self.decimals = Some(decimals);
            self.fixed = true;
        }
        self.fixed &= !exponent && self.decimals == Some(decimals);
        self.significant = self.significant.max(significant);
        self.longest = self.longest.max(significant.saturating_sub(zeros));
        self.no_single = self.no_single || significant > OF_SINGLE || !is_single(text);
        self.count += 1;
    }

    /// The rounding; `None` for numbers with nearly all digits of a double.
    pub fn rounding(&self) -> Option<Rounding> {
        if self.count < 2 || self.significant == 0 || self.significant > MOST_DIGITS {
            return None;
        }
        if !self.no_single && self.longest > FEWER {
            return Some(Rounding::PrintedSingle);
        }
        Some(match self.decimals.filter(|_| self.fixed) {
            Some(decimals) => Rounding::Decimals(decimals),
            None => Rounding::Digits(self.significant),
        })
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Digital {
    pub rounding: Option<Rounding>,
    /// Largest of the first values.
    pub largest: f64,
}

/// Number of different values that confirm a rounding, because doubles may be short too, such as 0.0 and 0.5.
const CONFIRMED_BY: usize = 4;
/// Most decimals of doubles that were rounded.
const MOST_DECIMALS: u32 = 9;
/// Third differences of a smooth signal are below its rounding, and those of rounded values are not in this part of the
/// samples. A sequence that is exact in few decimals, such as a constant deceleration, has none.
const UNEVEN: f64 = 0.1;

impl Digital {
    pub fn of(values: &[f64], of_texts: Option<Rounding>) -> Digital {
        let mut different: Vec<f64> = Vec::new();
        for &value in values.iter().filter(|value| **value != 0.0) {
            if different.len() < CONFIRMED_BY && !different.contains(&value) {
                different.push(value);
            }
        }
        let confirmed = |rounding: &Rounding| different.len() == CONFIRMED_BY && rounding.hold(values);
        let of_values = || {
            (0..MOST_DECIMALS)
                .map(Rounding::Decimals)
                .find(|r| confirmed(r) && r.is_uneven(values))
        };
        let of_file = of_texts.or(Some(Rounding::Single)).filter(confirmed);
        Digital {
            rounding: of_file.or_else(of_values),
            largest: values.iter().fold(0.0, |largest, value| largest.max(value.abs())),
        }
    }

    pub fn error(&self, value: f64) -> f64 {
        self.rounding
            .map_or(f64::EPSILON * value.abs(), |rounding| rounding.quantum(value))
            / 2.0
    }
}

#[derive(Debug, Clone)]
pub(crate) struct Clock {
    /// Seconds per unit.
    pub factor: f64,
    /// Time added, s.
    pub offset: f64,
    pub rounding: Option<Rounding>,
}

impl Default for Clock {
    /// A clock of seconds.
    fn default() -> Clock {
        Clock {
            factor: 1.0,
            offset: 0.0,
            rounding: None,
        }
    }
}

impl Clock {
    #[inline]
    pub fn time(&self, raw: f64) -> f64 {
        raw * self.factor + self.offset
    }

    /// Distance of neighbouring times at a time (s), s.
    pub fn quantum(&self, rounding: Rounding, time: f64) -> f64 {
        rounding.quantum((time - self.offset) / self.factor) * self.factor.abs()
    }
}

/// Examines the times of a file to confirm that they are rounded.
#[derive(Debug, Clone, Default)]
pub struct ClockWatch {
    last: Option<f64>,
    step: Option<f64>,
    rows: u64,
    irregular: u64,
    refuted: bool,
    /// Rows that repeat the time of the row before.
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

    /// Whether the times are rounded: the rounding preserves them, and their steps are less even than those of a clock
    /// that such numbers hold exactly.
    pub fn is_rounded(&self) -> bool {
        let few = (self.rows / 500).max(4);
        !self.refuted && (self.repeated > 0 || self.irregular > few)
    }
}

/// Resolution of a candidate's file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Resolution {
    /// Kind of its times: "32-bit floating-point numbers", "numbers of 7 digits".
    pub of: String,
    /// Distance of two neighbouring times at the end, s.
    pub seconds: f64,
    /// Time at which `seconds` applies, s.
    pub at: f64,
    /// Rows that were left out because they repeat a time.
    pub repeated: u64,
    /// Largest error of an event due to the file, s: one distance of its times if they are stated, two if events were
    /// found in samples.
    pub event_error: f64,
    /// Matched events whose error is at most `event_error`.
    pub events_below: usize,
}
