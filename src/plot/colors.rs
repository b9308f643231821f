//! Colour scale from dark blue over green to light yellow, in equal steps of lightness. Its order is visible in grey
//! and with every kind of colour vision.

use plotters::style::RGBColor;

/// Lightness L* at the ends of the scale.
pub const LIGHTNESS: (f64, f64) = (18.0, 92.0);
/// Hue at the ends, degrees in the (a*, b*) plane: blue-violet and yellow.
const HUE: (f64, f64) = (300.0, 100.0);
/// Least chroma with its share of the scale, and the increase towards either end. Screens have least at blue-green.
const CHROMA: (f64, f64) = (26.8, 0.35);
const MORE_CHROMA: (f64, f64) = (18.0, 48.0);

/// The colour at a share (0 to 1) of the scale. Shares outside are clamped.
pub fn at(share: f64) -> RGBColor {
    let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
    let between = |(from, to): (f64, f64)| from + (to - from) * share;
    let (lightness, hue) = (between(LIGHTNESS), between(HUE).to_radians());
    // Smooth within the gamut of screens, because a bend would look like a line.
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

/// Colour `number` (from 0) of `count` colours with distinct lightness.
pub fn of_code(number: usize, count: usize) -> RGBColor {
    at(number as f64 / (count.max(2) - 1) as f64)
}

/// Linear sRGB (IEC 61966-2-1) of CIE L*a*b* under D65. The values may lie outside 0 to 1.
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
