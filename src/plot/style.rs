//! Colours and sizes.

use super::figure::CurveStyle;
use stickslip_system::model::Mode;
use stickslip_system::record::EventKind;

/// Red, green and blue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RGBColor(pub u8, pub u8, pub u8);

/// Drawing units per millimetre at [`FONT_SIZE`]. Coordinates are integers.
pub(crate) const UNITS_PER_MM: f64 = 100.0;

/// Width of a journal's column, mm.
pub const COLUMN_WIDTH: f64 = 85.0;

/// Default size of ticks, axis names and legend, points.
pub const FONT_SIZE: f64 = 7.0;

/// Least usable width at [`FONT_SIZE`], mm. It is proportional to the font size.
pub const LEAST_WIDTH: f64 = 60.0;

/// Size of a figure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layout {
    /// Width of the figure, mm.
    pub width: f64,
    /// Size of ticks, axis names and legend, points. Lines scale with it.
    pub font_size: f64,
    /// Whether the title is drawn.
    pub title: bool,
}

impl Default for Layout {
    fn default() -> Self {
        Layout {
            width: COLUMN_WIDTH,
            font_size: FONT_SIZE,
            title: true,
        }
    }
}

impl From<f64> for Layout {
    /// A layout with this width, mm.
    fn from(width: f64) -> Self {
        Layout {
            width,
            ..Layout::default()
        }
    }
}

impl Layout {
    pub(crate) fn units_per_mm(&self) -> f64 {
        UNITS_PER_MM * FONT_SIZE / self.font_size
    }

    /// Least width at this font size, mm.
    pub fn least_width(&self) -> f64 {
        LEAST_WIDTH * self.font_size / FONT_SIZE
    }
}

/// Font sizes and strokes in drawing units. 7.5 and 7 points are legible in print.
pub(crate) const TITLE_SIZE: f64 = 265.0;
pub(crate) const LABEL_SIZE: f64 = 247.0;
pub(crate) const LINE_HEIGHT: f64 = 320.0;
pub(crate) const CURVE_STROKE: u32 = 22;
pub(crate) const AXIS_STROKE: u32 = 12;
pub(crate) const THIN_STROKE: u32 = 9;
pub(crate) const TICK: i32 = 50;
pub(crate) const POINT_RADIUS: u32 = 42;

/// Radius of each point if there are many.
pub(crate) const DOT_RADIUS: u32 = 16;
pub(crate) const NOTHING: RGBColor = RGBColor(214, 214, 214);

/// Okabe-Ito palette in the order of use for lines. It can be distinguished with every kind of colour vision.
pub(crate) const PALETTE: [RGBColor; 7] = [BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK];
pub(crate) const WHITE: RGBColor = RGBColor(255, 255, 255);
pub(crate) const BLACK: RGBColor = RGBColor(0, 0, 0);
pub(crate) const ORANGE: RGBColor = RGBColor(230, 159, 0);
pub(crate) const SKY: RGBColor = RGBColor(86, 180, 233);
pub(crate) const GREEN: RGBColor = RGBColor(0, 158, 115);
/// Okabe-Ito blue.
pub const BLUE: RGBColor = RGBColor(0, 114, 178);
pub(crate) const VERMILLION: RGBColor = RGBColor(213, 94, 0);
pub(crate) const PURPLE: RGBColor = RGBColor(204, 121, 167);
pub(crate) const YELLOW: RGBColor = RGBColor(240, 228, 66);
pub(crate) const GREY: RGBColor = RGBColor(120, 120, 120);
/// Visible on the background of every mode.
pub(crate) const WINE: RGBColor = RGBColor(136, 34, 85);
pub(crate) const OLIVE: RGBColor = RGBColor(105, 105, 0);

/// Name of a colour in the style of pages, which have another shade of it on a dark ground; else its digits.
pub(super) fn name(color: RGBColor) -> String {
    let known = NAMED.iter().find(|named| named.1 == color);
    known.map_or_else(|| super::figure::hex(color), |named| named.0.to_owned())
}

/// The colours of figures: name in the style of pages, colour on white, and colour on a dark ground.
pub const NAMED: [(&str, RGBColor, RGBColor); 10] = [
    ("black", BLACK, RGBColor(242, 240, 236)),
    ("blue", BLUE, RGBColor(92, 184, 240)),
    ("vermillion", VERMILLION, RGBColor(255, 138, 69)),
    ("green", GREEN, RGBColor(53, 199, 156)),
    ("orange", ORANGE, RGBColor(245, 188, 60)),
    ("purple", PURPLE, RGBColor(232, 160, 200)),
    ("sky", SKY, RGBColor(140, 208, 245)),
    ("grey", GREY, RGBColor(165, 165, 165)),
    ("wine", WINE, RGBColor(229, 139, 176)),
    ("olive", OLIVE, RGBColor(194, 194, 74)),
];

/// The ground of dark pages, for the inside of open marks.
const DARK_GROUND: RGBColor = RGBColor(13, 17, 23);

/// The colour on a dark ground; others than those of figures remain.
pub(super) fn on_dark([red, green, blue]: [u8; 3]) -> [u8; 3] {
    let color = RGBColor(red, green, blue);
    let known = NAMED.iter().find(|named| named.1 == color).map(|named| named.2);
    let white = (color == WHITE).then_some(DARK_GROUND);
    known
        .or(white)
        .map_or([red, green, blue], |RGBColor(r, g, b)| [r, g, b])
}

/// Curve colours that no mode's ground has.
const OVER_GROUND: [RGBColor; 7] = [BLUE, VERMILLION, GREEN, PURPLE, BLACK, OLIVE, WINE];

/// Colour and opacity of a mode's background.
pub fn ground(mode: Mode) -> (RGBColor, f64) {
    match mode {
        Mode::SlipForward | Mode::Engaged => (SKY, 0.16),
        Mode::SlipBackward => (PURPLE, 0.22),
        Mode::Stick => (YELLOW, 0.34),
        Mode::Separated => (GREY, 0.28),
    }
}

/// Colour of a curve in a mode, for a curve that passes through several modes.
pub fn of_mode(mode: Mode) -> RGBColor {
    match mode {
        Mode::SlipForward | Mode::Engaged => BLUE,
        Mode::SlipBackward => PURPLE,
        Mode::Stick => VERMILLION,
        Mode::Separated => GREY,
    }
}

/// Colour and line of a run among several. The first line is solid, and the others are dashed over it: where runs
/// agree, both colours are visible.
pub(crate) fn of_run(number: usize) -> (RGBColor, CurveStyle) {
    let style = if number == 0 {
        CurveStyle::Solid
    } else {
        CurveStyle::Dashed
    };
    (line_color(number), style)
}

/// Line of an event, which distinguishes kinds of similar colours.
pub(crate) fn line_of_event(kind: EventKind) -> CurveStyle {
    match kind {
        EventKind::Corner => CurveStyle::Dotted,
        EventKind::Destabilised | EventKind::Restabilised => CurveStyle::Dashed,
        _ => CurveStyle::Solid,
    }
}

pub(crate) fn of_event(kind: EventKind) -> RGBColor {
    match kind {
        EventKind::Stick => VERMILLION,
        EventKind::Slip => BLUE,
        EventKind::Reversal => PURPLE,
        EventKind::Separation | EventKind::Contact | EventKind::Corner => GREY,
        EventKind::Kick => GREEN,
        EventKind::Destabilised | EventKind::Restabilised => WINE,
    }
}

pub(crate) fn line_color(number: usize) -> RGBColor {
    OVER_GROUND[number % OVER_GROUND.len()]
}

/// Lightness L* at the ends of the scale.
pub const LIGHTNESS: (f64, f64) = (18.0, 92.0);
/// Hue at the ends, degrees in the (a*, b*) plane: blue-violet and yellow.
const HUE: (f64, f64) = (300.0, 100.0);
/// Least chroma with its share of the scale, and the increase towards either end. Screens have least at blue-green.
const CHROMA: (f64, f64) = (26.8, 0.35);
const MORE_CHROMA: (f64, f64) = (18.0, 48.0);

/// The colour at a share (0 to 1) of the colour scale, from dark blue over green to light yellow, in equal steps of
/// lightness: its order is visible in grey and with every kind of colour vision. Shares outside are clamped.
pub fn shade(share: f64) -> RGBColor {
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
pub fn shade_of_code(number: usize, count: usize) -> RGBColor {
    shade(number as f64 / (count.max(2) - 1) as f64)
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
