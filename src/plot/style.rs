//! Colours and sizes, in one place.

use crate::model::Mode;
use crate::record::EventKind;
use plotters::style::RGBColor;

/// Units of the drawing in a millimetre: coordinates are integers.
pub(crate) const UNITS_PER_MM: f64 = 100.0;

/// Column of a journal, mm.
pub const COLUMN_WIDTH: f64 = 85.0;

/// Font sizes and strokes in drawing units; 7.5 and 7 points stay readable in print.
pub(crate) const TITLE_SIZE: f64 = 265.0;
/// Of ticks, axis names and legend.
pub(crate) const LABEL_SIZE: f64 = 247.0;
/// Distance of lines of text.
pub(crate) const LINE_HEIGHT: f64 = 320.0;
/// Stroke of a curve.
pub(crate) const CURVE_STROKE: u32 = 22;
/// Stroke of axes.
pub(crate) const AXIS_STROKE: u32 = 12;
/// Stroke of the grid and of events.
pub(crate) const THIN_STROKE: u32 = 9;
/// Length of a tick.
pub(crate) const TICK: i32 = 50;
/// Radius of a point.
pub(crate) const POINT_RADIUS: u32 = 42;

/// Radius of a point among many.
pub(crate) const DOT_RADIUS: u32 = 16;
/// Where a map has no value.
pub(crate) const NOTHING: RGBColor = RGBColor(214, 214, 214);

/// The colours of Okabe and Ito, told apart with every kind of colour vision; in the order of use for lines.
pub(crate) const PALETTE: [RGBColor; 7] = [BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK];
/// Okabe-Ito black.
pub(crate) const BLACK: RGBColor = RGBColor(0, 0, 0);
/// Okabe-Ito orange.
pub(crate) const ORANGE: RGBColor = RGBColor(230, 159, 0);
/// Okabe-Ito sky blue.
pub(crate) const SKY: RGBColor = RGBColor(86, 180, 233);
/// Okabe-Ito bluish green.
pub(crate) const GREEN: RGBColor = RGBColor(0, 158, 115);
/// Okabe-Ito blue.
pub const BLUE: RGBColor = RGBColor(0, 114, 178);
/// Okabe-Ito vermillion.
pub(crate) const VERMILLION: RGBColor = RGBColor(213, 94, 0);
/// Okabe-Ito reddish purple.
pub(crate) const PURPLE: RGBColor = RGBColor(204, 121, 167);
/// Grid and separated contact.
pub(crate) const GREY: RGBColor = RGBColor(120, 120, 120);

/// Colour and opacity of the ground behind a mode.
pub fn ground(mode: Mode) -> (RGBColor, f64) {
    match mode {
        Mode::SlipForward | Mode::Engaged => (SKY, 0.16),
        Mode::SlipBackward => (PURPLE, 0.22),
        Mode::Stick => (ORANGE, 0.32),
        Mode::Separated => (GREY, 0.28),
    }
}

/// Colour of a curve in a mode, where one curve passes through several.
pub fn of_mode(mode: Mode) -> RGBColor {
    match mode {
        Mode::SlipForward | Mode::Engaged => BLUE,
        Mode::SlipBackward => PURPLE,
        Mode::Stick => VERMILLION,
        Mode::Separated => GREY,
    }
}

/// Colour of the line that marks an event.
pub(crate) fn of_event(kind: EventKind) -> RGBColor {
    match kind {
        EventKind::Stick => VERMILLION,
        EventKind::Slip => BLUE,
        EventKind::Reversal => PURPLE,
        EventKind::Separation | EventKind::Contact | EventKind::Corner => GREY,
        EventKind::Kick => GREEN,
        EventKind::Destabilised | EventKind::Restabilised => BLACK,
    }
}

/// Colour of the n-th line.
pub(crate) fn line_color(number: usize) -> RGBColor {
    PALETTE[number % PALETTE.len()]
}
