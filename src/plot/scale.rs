//! From SI values to what stands at an axis: prefixes, offsets, ticks.

use plotters::coord::ranged1d::{BoldPoints, Ranged};
use plotters::coord::types::RangedCoordf64;

/// A range this many times smaller than its values is shown from an offset: wider ones are told apart by five digits.
const OFFSET_SHARE: f64 = 1.5e-3;

/// SI prefixes by powers of a thousand, from -5 on.
const PREFIXES: [&str; 8] = ["f", "p", "n", "µ", "m", "", "k", "M"];

/// How values of an axis are shown: (value - offset) * factor.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Scale {
    pub offset: f64,
    pub factor: f64,
    /// Range of what is shown.
    pub shown: (f64, f64),
    /// What stands in brackets; empty for a pure number.
    pub unit: String,
    /// " − 6.97 s" or " + 40.2 µm": what is taken off, with its unit; empty without an offset.
    pub off: String,
    /// What is shown are the decimal logarithms.
    pub logarithmic: bool,
}

impl Scale {
    /// Of powers of ten, for values above zero from `low` to `high`.
    pub(crate) fn by_powers((low, high): (f64, f64), unit: &str) -> Scale {
        let positive = |x: f64| if x.is_finite() && x > 0.0 { x.log10() } else { 0.0 };
        let (low, high) = (positive(low), positive(high));
        // At least a whole power on either side of the middle, so that there are two to be named.
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

    /// For values from `low` to `high` in a UDUNITS unit.
    pub fn new((low, high): (f64, f64), unit: &str) -> Scale {
        let (low, high) = widened(low, high);
        let (span, size) = (high - low, low.abs().max(high.abs()));
        let base = human_unit(unit);
        let (offset, off) = if span < OFFSET_SHARE * size {
            let grid = 10f64.powi(span.log10().floor() as i32);
            // A rounder value inside of the range is what the reader looks from, such as the corner of a ramp at 1 s.
            let coarse = 10.0 * grid;
            let rounder = (low / coarse).ceil() * coarse;
            if rounder <= high {
                (rounder, offset_text(rounder, coarse, &base))
            } else {
                let offset = (low / grid).floor() * grid;
                (offset, offset_text(offset, grid, &base))
            }
        } else {
            (0.0, String::new())
        };
        let size = (low - offset).abs().max((high - offset).abs());
        let power = (size.log10() / 3.0 + 1e-9).floor() as i32;
        // Thousands of radians are read more easily than kiloradians.
        let up = matches!(base.chars().next(), Some('N' | 'J' | 'W'));
        let (power, unit) = if !base.is_empty() && (-5..=if up { 2 } else { 0 }).contains(&power) {
            (power, format!("{}{base}", PREFIXES[(power + 5) as usize]))
        } else if (1e-3..1e5).contains(&size) {
            (0, base)
        } else {
            let unit = format!("10{} {base}", superscript(3 * power));
            (power, unit.trim_end().to_owned())
        };
        let factor = 10f64.powi(-3 * power);
        Scale {
            offset,
            factor,
            shown: ((low - offset) * factor, (high - offset) * factor),
            unit,
            off,
            logarithmic: false,
        }
    }

    /// What is shown for a value.
    pub fn show(&self, value: f64) -> f64 {
        if self.logarithmic {
            return value.log10();
        }
        (value - self.offset) * self.factor
    }

    /// The name of the axis with offset and unit.
    pub fn title(&self, label: &str) -> String {
        match &*self.unit {
            "" => format!("{label}{}", self.off),
            unit => format!("{label}{} ({unit})", self.off),
        }
    }

    /// At most `count` round values, and with how many decimals they are written.
    pub fn ticks(&self, count: usize) -> (Vec<f64>, usize) {
        let (low, high) = self.shown;
        let ticks = RangedCoordf64::from(low..high).key_points(BoldPoints(count));
        let whole = |decimals: usize| {
            let power = 10f64.powi(decimals as i32);
            ticks.iter().all(|t| (t * power - (t * power).round()).abs() < 1e-4)
        };
        let decimals = (0..12).find(|&d| whole(d)).unwrap_or(12);
        (ticks, decimals)
    }

    /// The most ticks up to `count` that stand at values fit to be named: of powers of ten only whole ones are.
    pub(crate) fn best_count(&self, count: usize) -> usize {
        let whole = |n: &usize| self.ticks(*n).0.iter().all(|tick| (tick - tick.round()).abs() < 1e-9);
        if self.logarithmic {
            (2..=count).rev().find(whole).unwrap_or(2)
        } else {
            count
        }
    }

    /// What stands at a tick.
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

/// The offset as a sum, with the digits that its grid has.
fn offset_text(offset: f64, grid: f64, base: &str) -> String {
    let sign = if offset < 0.0 { '+' } else { '−' };
    // From a tenth of a unit on without a prefix: 0.99 s.
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

/// A range that is not empty and not absurd.
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

/// A number with a true minus sign.
pub fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.chars().all(|c| c == '0' || c == '.') => digits.to_owned(),
        Some(digits) => format!("−{digits}"),
        None => text,
    }
}

/// UDUNITS as people write it: "rad s-1" is rad/s.
fn human_unit(unit: &str) -> String {
    match unit {
        "1" | "" => String::new(),
        _ => match unit.strip_suffix(" s-1") {
            Some(above) => format!("{above}/s"),
            None => unit.to_owned(),
        },
    }
}

fn superscript(power: i32) -> String {
    let digit = |c| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        c => char::from_u32(0x2070 + c as u32 - '0' as u32).unwrap_or(c),
    };
    power.to_string().chars().map(digit).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_prefixes_and_offsets() {
        let z = Scale::new((-40.2e-6, 0.0), "m");
        assert_eq!((z.title("z").as_str(), z.show(-40.2e-6).round()), ("z (µm)", -40.0));
        let t = Scale::new((6.9748, 6.9768), "s");
        assert_eq!(t.title("time"), "time − 6.974 s (ms)");
        assert!((t.show(6.975) - 1.0).abs() < 1e-9);
        assert_eq!(Scale::new((-40.21e-6, -40.18e-6), "m").title("z"), "z + 40.2 µm (nm)");
        // A corner at 1 s stands at 1 s, or at 0.
        assert_eq!(Scale::new((0.998, 1.009), "s").title("time"), "time (s)");
        assert_eq!(Scale::new((0.9993, 1.0004), "s").title("time"), "time − 1.00 s (µs)");
        assert_eq!(Scale::new((0.0, 100.0), "rad s-1").title("ω"), "ω (rad/s)");
        assert_eq!(Scale::new((0.0, 2224.0), "N").title("F"), "F (kN)");
        assert_eq!(Scale::new((0.0, 371.0), "rad").title("θ"), "θ (rad)");
        assert_eq!(Scale::new((0.0, 4e300), "N").title("F"), "F (10³⁰⁰ N)");
        assert_eq!(Scale::new((0.0, 2e-8), "1").title("x"), "x (10⁻⁹)");
    }

    #[test]
    fn analytic_ticks_have_the_digits_they_need() {
        let (ticks, decimals) = Scale::new((0.0, 0.6), "1").ticks(5);
        assert!(ticks.len() >= 3 && ticks.len() <= 5, "{ticks:?}");
        assert_eq!(decimals, 1);
        assert_eq!(number(-0.0, 1), "0.0");
        assert_eq!(number(-2.5, 1), "−2.5");
    }

    #[test]
    fn analytic_powers_of_ten_stand_at_whole_ticks() {
        let scale = Scale::by_powers((3e-13, 2e-3), "s");
        assert_eq!(scale.title("error"), "error (s)");
        assert!((scale.show(1e-7) + 7.0).abs() < 1e-12);
        for count in 2..10 {
            let (ticks, decimals) = scale.ticks(scale.best_count(count));
            assert!(ticks.iter().all(|t| t.fract() == 0.0), "{count}: {ticks:?}");
            assert_eq!(decimals, 0);
        }
        assert_eq!(scale.label(-7.0, 0), "10⁻⁷");
    }

    #[test]
    fn analytic_a_constant_has_a_range() {
        for value in [0.0, 3.0, -1e-7, 1e-320] {
            let scale = Scale::new((value, value), "m");
            assert!(scale.shown.1 > scale.shown.0, "{value}: {scale:?}");
            assert!(scale.ticks(5).0.len() >= 2, "{value}: {scale:?} {:?}", scale.ticks(5));
        }
    }
}
