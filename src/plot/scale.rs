//! Shown values of an axis, from SI values: prefixes, offsets, ticks.

/// Largest ratio of the range to the values for which an offset is shown. In a wider range five digits suffice.
const OFFSET_SHARE: f64 = 1.5e-3;

/// Most powers of ten between which there are ticks.
const MOST_POWERS: f64 = 5.0;

/// Largest offset that is written in the shown unit; beyond it has its own prefix.
const MOST_OFFSET: f64 = 1e6;

/// SI prefixes for powers of a thousand, from -5.
const PREFIXES: [&str; 8] = ["f", "p", "n", "µ", "m", "", "k", "M"];

/// Scale of an axis: shown value = (value - offset) * factor.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    /// Offset, in SI.
    pub offset: f64,
    /// Shown units per SI unit.
    pub factor: f64,
    /// Range of the shown values.
    pub shown: (f64, f64),
    /// Unit in brackets; empty for a pure number.
    pub unit: String,
    /// Offset in words, " − 6.97 s" or, in the shown unit, " + 40200"; empty without an offset.
    pub off: String,
    /// Whether the shown values are decimal logarithms.
    pub logarithmic: bool,
}

impl Scale {
    /// A logarithmic scale for positive values from `low` to `high`.
    pub fn by_powers((low, high): (f64, f64), unit: &str) -> Scale {
        let positive = |x: f64| if x.is_finite() && x > 0.0 { x.log10() } else { 0.0 };
        let (low, high) = (positive(low), positive(high));
        // At least one power on both sides of the middle, so that two powers have labels.
        let (middle, half) = (0.5 * (low + high), (0.5 * (high - low)).max(1.0));
        Scale {
            offset: 0.0,
            factor: 1.0,
            shown: (middle - half, middle + half),
            unit: human_unit(unit),
            off: String::new(),
            logarithmic: true,
        }
    }

    /// A linear scale for values from `low` to `high`, in a unit of UDUNITS.
    pub fn new((low, high): (f64, f64), unit_given: &str) -> Scale {
        let (low, high) = widened(low, high);
        let (span, size) = (high - low, low.abs().max(high.abs()));
        let base = human_unit(unit_given);
        let (offset, grid) = if span < OFFSET_SHARE * size {
            let grid = 10f64.powi(span.log10().floor() as i32);
            // A rounder value inside the range is a better offset, such as 1 s for the corner of a ramp.
            let coarse = 10.0 * grid;
            let rounder = (low / coarse).ceil() * coarse;
            if rounder <= high {
                (rounder, coarse)
            } else {
                ((low / grid).floor() * grid, grid)
            }
        } else {
            (0.0, 1.0)
        };
        let size = (low - offset).abs().max((high - offset).abs());
        let power = (size.log10() / 3.0 + 1e-9).floor() as i32;
        // Thousands of radians are easier to read than kiloradians.
        let up = matches!(base.chars().next(), Some('N' | 'J' | 'W'));
        let apart = base.is_empty() || base == "s";
        let (power, unit) = if !base.is_empty() && (-5..=if up { 2 } else { 0 }).contains(&power) {
            (power, format!("{}{base}", PREFIXES[(power + 5) as usize]))
        } else if (1e-3..1e5).contains(&size) {
            (0, base)
        } else {
            let unit = format!("10{} {base}", superscript(3 * power));
            (power, unit.trim_end().to_owned())
        };
        let factor = 10f64.powi(-3 * power);
        // Times are easier to find in seconds, and numbers as they are.
        let off = match offset {
            0.0 => String::new(),
            _ if !apart && offset.abs() * factor < MOST_OFFSET => offset_text(offset * factor, grid * factor, ""),
            _ => offset_text(offset, grid, &human_unit(unit_given)),
        };
        Scale {
            offset,
            factor,
            shown: ((low - offset) * factor, (high - offset) * factor),
            unit,
            off,
            logarithmic: false,
        }
    }

    /// The shown form of `value`.
    pub fn show(&self, value: f64) -> f64 {
        if self.logarithmic {
            return value.log10();
        }
        (value - self.offset) * self.factor
    }

    /// The title of the axis: its name with offset and unit.
    pub fn title(&self, label: &str) -> String {
        match &*self.unit {
            "" => format!("{label}{}", self.off),
            unit => format!("{label}{} ({unit})", self.off),
        }
    }

    /// At most `count` round values, and the number of their decimals.
    pub fn ticks(&self, count: usize) -> (Vec<f64>, usize) {
        let ticks = round_values(self.shown, count);
        let whole = |decimals: usize| {
            let power = 10f64.powi(decimals as i32);
            ticks.iter().all(|t| (t * power - (t * power).round()).abs() < 1e-4)
        };
        let decimals = (0..12).find(|&d| whole(d)).unwrap_or(12);
        (ticks, decimals)
    }

    /// Places of 2 to 9 times each power of ten in the range, for ticks without labels; none on a linear axis or over
    /// more than five powers.
    pub fn minor_ticks(&self) -> Vec<f64> {
        let (low, high) = self.shown;
        if !self.logarithmic || high - low > MOST_POWERS {
            return Vec::new();
        }
        let powers = low.floor() as i32..=high.floor() as i32;
        let places = powers.flat_map(|power| (2..=9).map(move |digit| f64::from(power) + f64::from(digit).log10()));
        places.filter(|place| (low..=high).contains(place)).collect()
    }

    /// The largest usable number of ticks up to `count`. On a logarithmic axis only whole powers are usable.
    pub fn best_count(&self, count: usize) -> usize {
        let whole = |n: &usize| self.ticks(*n).0.iter().all(|tick| (tick - tick.round()).abs() < 1e-9);
        if self.logarithmic {
            (2..=count).rev().find(whole).unwrap_or(2)
        } else {
            count
        }
    }

    /// The label of a tick.
    pub fn label(&self, tick: f64, decimals: usize) -> String {
        if self.logarithmic && decimals == 0 {
            format!("10{}", superscript(tick as i32))
        } else if self.logarithmic {
            format!("10^{}", number(tick, decimals))
        } else {
            number(tick, decimals)
        }
    }
}

/// At most `most` multiples of 1, 2 or 5 times a power of ten, from `low` to `high`.
fn round_values((low, high): (f64, f64), most: usize) -> Vec<f64> {
    // Without a width no step ends the loops.
    let width = (high - low).abs();
    if width.is_nan() || width < f64::EPSILON {
        return vec![low];
    }
    let ends = |step: f64| {
        let beyond = |value: f64| {
            let rest = value - (value / step).floor() * step;
            if (rest - step).abs() < f64::EPSILON { 0.0 } else { rest }
        };
        let first = low - beyond(low);
        (if first < low { first + step } else { first }, high - beyond(high))
    };
    let mut step = 10f64.powf((high - low).log(10.0).floor());
    if 1 + ((high - low) / step).floor() as usize > most {
        step *= 10.0;
    }
    let mut unit = step / 10.0;
    'finer: loop {
        let whole = step;
        for parts in [2.0, 5.0, 10.0] {
            let (first, last) = ends(whole / parts);
            if (1.0 + (last - first) / whole * parts).round() as usize > most {
                break 'finer;
            }
            step = whole / parts;
        }
        unit /= 10.0;
    }
    let (first, last) = ends(step);
    // In two parts, because a step may vanish beside a large value.
    let base = (first / unit).floor() * unit;
    let mut values = Vec::new();
    let mut place = first - base;
    while last - place - base >= -f64::EPSILON {
        values.push(place + base);
        place += step;
    }
    values
}

fn offset_text(offset: f64, grid: f64, base: &str) -> String {
    let sign = if offset < 0.0 { '+' } else { '−' };
    // No prefix from a tenth of a unit on, as in 0.99 s.
    let power = ((offset.abs().log10() + 1.0) / 3.0 + 1e-9).floor().clamp(-5.0, 0.0);
    let power = if base.is_empty() { 0 } else { power as i32 };
    let factor = 10f64.powi(-3 * power);
    let decimals = (-(grid * factor).log10()).round().max(0.0) as usize;
    let text = format!(
        " {sign} {:.decimals$} {}{base}",
        offset.abs() * factor,
        PREFIXES[(power + 5) as usize]
    );
    text.trim_end().to_owned()
}

fn widened(low: f64, high: f64) -> (f64, f64) {
    let size = low.abs().max(high.abs());
    if !(low.is_finite() && high.is_finite()) {
        (0.0, 1.0)
    } else if high - low > 1e-12 * size && high - low > 1e-300 {
        (low, high)
    } else if size > 1e-290 {
        (low - 1e-3 * size, high + 1e-3 * size)
    } else {
        (-1.0, 1.0)
    }
}

/// A number with a typographic minus sign.
pub fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.chars().all(|c| c == '0' || c == '.') => digits.to_owned(),
        Some(digits) => format!("−{digits}"),
        None => text,
    }
}

/// A unit of UDUNITS in common notation: "rad s-1" becomes rad/s.
fn human_unit(unit: &str) -> String {
    match unit {
        "1" | "" => String::new(),
        "s-1" => "s⁻¹".to_owned(),
        _ => match unit.strip_suffix(" s-1") {
            Some(above) => format!("{above}/s"),
            None => unit.to_owned(),
        },
    }
}

pub(super) fn superscript(power: i32) -> String {
    let digits = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let raised = |c: char| c.to_digit(10).map_or('⁻', |digit| digits[digit as usize]);
    power.to_string().chars().map(raised).collect()
}
