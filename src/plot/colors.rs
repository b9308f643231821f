//! The colours of a scale: from dark blue by green to light yellow, in equal steps of lightness, so that the order of the
//! values shows in grey and with every kind of colour vision.

use plotters::style::RGBColor;

/// Lightness L*, at the ends of the scale.
const LIGHTNESS: (f64, f64) = (18.0, 92.0);
/// Hue at the ends, degrees in the plane of a* and b*: blue-violet and yellow.
const HUE: (f64, f64) = (300.0, 100.0);
/// Chroma where a screen has least of it, at blue-green, and that share of the scale; what it grows by to either end.
const CHROMA: (f64, f64) = (26.8, 0.35);
const MORE_CHROMA: (f64, f64) = (18.0, 48.0);

/// The colour at a share of the scale, 0 to 1; shares beyond are those of its ends.
pub fn at(share: f64) -> RGBColor {
    let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
    let between = |(from, to): (f64, f64)| from + (to - from) * share;
    let (lightness, hue) = (between(LIGHTNESS), between(HUE).to_radians());
    // Within what a screen has at each lightness and hue, without a bend that would look like a line.
    let (least, middle) = CHROMA;
    let mut chroma = if share < middle {
        least + MORE_CHROMA.0 * ((middle - share) / middle).powf(2.5)
    } else {
        least + MORE_CHROMA.1 * ((share - middle) / (1.0 - middle)).powf(1.5)
    };
    loop {
        let linear = linear_rgb(lightness, chroma * hue.cos(), chroma * hue.sin());
        if chroma <= 0.0 || linear.iter().all(|part| (0.0..=1.0).contains(part)) {
            let [r, g, b] = linear.map(|part| (255.0 * encoded(part.clamp(0.0, 1.0))).round() as u8);
            return RGBColor(r, g, b);
        }
        chroma -= 0.1;
    }
}

/// The n-th colour of `count` that are told apart by their lightness.
pub fn of_code(number: usize, count: usize) -> RGBColor {
    at(number as f64 / (count.max(2) - 1) as f64)
}

/// CIE L*a*b* under D65 as linear sRGB (IEC 61966-2-1), which may lie outside of 0 to 1.
fn linear_rgb(lightness: f64, a: f64, b: f64) -> [f64; 3] {
    let middle = (lightness + 16.0) / 116.0;
    let part = |f: f64| {
        if f > 6.0 / 29.0 {
            f.powi(3)
        } else {
            3.0 * (6.0f64 / 29.0).powi(2) * (f - 4.0 / 29.0)
        }
    };
    let (x, y, z) = (
        0.95047 * part(middle + a / 500.0),
        part(middle),
        1.08883 * part(middle - b / 200.0),
    );
    [
        3.2406 * x - 1.5372 * y - 0.4986 * z,
        -0.9689 * x + 1.8758 * y + 0.0415 * z,
        0.0557 * x - 0.2040 * y + 1.0570 * z,
    ]
}

fn encoded(linear: f64) -> f64 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// L* of a colour, back from its luminance (ITU-R BT.709): what a grey print and eyes without a kind of cone have.
    fn lightness(RGBColor(r, g, b): RGBColor) -> f64 {
        let part = |value: u8| match f64::from(value) / 255.0 {
            value if value <= 0.04045 => value / 12.92,
            value => ((value + 0.055) / 1.055).powf(2.4),
        };
        let luminance: f64 = 0.2126 * part(r) + 0.7152 * part(g) + 0.0722 * part(b);
        116.0 * luminance.cbrt() - 16.0
    }

    /// 64 steps, each lighter than the one before by what an even scale has; rounding to 8 bits is below half a unit of L*.
    #[test]
    fn analytic_the_scale_is_even_in_grey() {
        let step = (LIGHTNESS.1 - LIGHTNESS.0) / 63.0;
        for k in 0..64 {
            let own = lightness(at(f64::from(k) / 63.0));
            assert!((own - (LIGHTNESS.0 + step * f64::from(k))).abs() < 0.5, "{k}: {own}");
        }
    }

    #[test]
    fn analytic_ends_and_beyond() {
        assert_eq!(at(-1.0), at(0.0));
        assert_eq!(at(f64::NAN), at(0.0));
        assert_eq!(at(7.0), at(1.0));
        assert_eq!(of_code(0, 1), at(0.0));
    }
}
