//! The font of figures. It is embedded, so that no figure depends on installed fonts.

use super::typeset;
use std::sync::OnceLock;
use tiny_skia::PathBuilder;
use ttf_parser::{Face, GlyphId, OutlineBuilder};

/// DejaVu Sans, reduced to the letters that figures use (see data/fonts).
const DATA: &[u8] = include_bytes!("../../data/fonts/DejaVuSans.subset.ttf");

/// Font families in SVG. Verdana has the same widths.
pub(crate) const FAMILIES: &str = "DejaVu Sans, Verdana, sans-serif";

/// The embedded font.
pub fn face() -> &'static Face<'static> {
    static FACE: OnceLock<Face<'static>> = OnceLock::new();
    FACE.get_or_init(|| Face::parse(DATA, 0).expect("the program's own font can be read"))
}

/// Glyphs of a text, with their widths in ems. A box replaces a missing letter.
fn letters(text: &str) -> impl Iterator<Item = (GlyphId, f64)> {
    let face = face();
    let em = f64::from(face.units_per_em());
    text.chars().map(move |c| {
        let glyph = face.glyph_index(c).unwrap_or_default();
        (glyph, f64::from(face.glyph_hor_advance(glyph).unwrap_or_default()) / em)
    })
}

/// Width of a line in the unit of `size`, the font size. Indices and exponents are smaller.
pub fn text_width(text: &str, size: f64) -> f64 {
    let pieces = typeset::pieces(text).into_iter();
    pieces
        .map(|(level, piece)| plain_width(&piece, level.place(size).0))
        .sum()
}

pub(super) fn plain_width(text: &str, size: f64) -> f64 {
    size * letters(text).map(|(_, width)| width).sum::<f64>()
}

/// Adds the outlines of a text to `path`, starting at (x, y) on the baseline.
pub(super) fn add_letters(path: &mut PathBuilder, text: &str, size: f64, (x, y): (f64, f64)) {
    let scale = (size / f64::from(face().units_per_em())) as f32;
    let mut pen = Pen {
        path,
        scale,
        x: x as f32,
        y: y as f32,
    };
    let mut before = 0.0;
    for (glyph, width) in letters(text) {
        pen.x = (x + size * before) as f32;
        face().outline_glyph(glyph, &mut pen);
        before += width;
    }
}

/// Draws a glyph, whose y axis points upwards, at a place of a path.
struct Pen<'a> {
    path: &'a mut PathBuilder,
    scale: f32,
    x: f32,
    y: f32,
}

impl Pen<'_> {
    fn place(&self, x: f32, y: f32) -> (f32, f32) {
        (self.x + self.scale * x, self.y - self.scale * y)
    }
}

impl OutlineBuilder for Pen<'_> {
    fn move_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.place(x, y);
        self.path.move_to(x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.place(x, y);
        self.path.line_to(x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let ((x1, y1), (x, y)) = (self.place(x1, y1), self.place(x, y));
        self.path.quad_to(x1, y1, x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let ((x1, y1), (x2, y2), (x, y)) = (self.place(x1, y1), self.place(x2, y2), self.place(x, y));
        self.path.cubic_to(x1, y1, x2, y2, x, y);
    }

    fn close(&mut self) {
        self.path.close();
    }
}

/// Breaks `text` at blanks into lines up to `width`. A single word may be wider.
fn wrapped(text: &str, size: f64, width: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if text_width(&format!("{line} {word}"), size) <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// A title in lines up to `width`. A long title is first broken after its colon.
pub fn wrapped_title(title: &str, size: f64, width: f64) -> Vec<String> {
    let lines = wrapped(title, size, width);
    match title.split_once(": ") {
        Some((head, tail)) if lines.len() > 1 => {
            let mut lines = wrapped(&format!("{head}:"), size, width);
            lines.extend(wrapped(tail, size, width));
            lines
        }
        _ => lines,
    }
}
