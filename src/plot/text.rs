//! Texts of figures: the embedded font, widths and outlines of letters, indices and exponents.
//!
//! T_f and c_t are symbols with an index, and 10^−5 is a power. Unicode's small letters (ωᵣ, φ₁, 10⁻⁵) are set alike.

use super::html::escaped;
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
    let pieces = pieces(text).into_iter();
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

/// A title in lines up to `width`. A long title is first broken after its colon, if a line has room for that part.
pub fn wrapped_title(title: &str, size: f64, width: f64) -> Vec<String> {
    let lines = wrapped(title, size, width);
    match title.split_once(": ") {
        Some((head, tail)) if lines.len() > 1 => {
            let mut broken = wrapped(&format!("{head}:"), size, width);
            if broken.len() > 1 {
                return lines;
            }
            broken.extend(wrapped(tail, size, width));
            broken
        }
        _ => lines,
    }
}

/// Sizes and distances relative to the font size.
const SMALL: f64 = 0.72;
const BELOW: f64 = 0.2;
const ABOVE: f64 = 0.36;

/// Vertical position of a piece of text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// On the line.
    Line,
    /// Below the line.
    Index,
    /// Above the line.
    Exponent,
}

impl Level {
    /// Font size, and distance below the line, in a text of this size.
    pub(crate) fn place(self, size: f64) -> (f64, f64) {
        match self {
            Level::Line => (size, 0.0),
            Level::Index => (SMALL * size, BELOW * size),
            Level::Exponent => (SMALL * size, -ABOVE * size),
        }
    }
}

/// A text as pieces, each on a single level.
pub fn pieces(text: &str) -> Vec<(Level, String)> {
    let letters: Vec<char> = text.chars().collect();
    let mut pieces: Vec<(Level, String)> = Vec::new();
    let mut add = |level: Level, c: char| match pieces.last_mut() {
        Some((last, piece)) if *last == level => piece.push(c),
        _ => pieces.push((level, c.to_string())),
    };
    let mut k = 0;
    while k < letters.len() {
        let index = index_at(&letters, k).map(|length| (Level::Index, length));
        let exponent = || exponent_at(&letters, k).map(|length| (Level::Exponent, length));
        if let Some((level, length)) = index.or_else(exponent) {
            letters[k + 1..=k + length].iter().for_each(|&c| add(level, c));
            k += length;
        } else {
            let (level, c) = plain(letters[k]);
            add(level, c);
        }
        k += 1;
    }
    pieces
}

/// Length of the index that starts at an underscore. A symbol is one letter, and its index one or two letters or
/// digits, so that names of files and channels are not symbols.
fn index_at(letters: &[char], k: usize) -> Option<usize> {
    let is_word = |k: usize| letters.get(k).is_some_and(|c| c.is_alphanumeric() || *c == '_');
    let symbol = k.checked_sub(1).filter(|&s| letters[s].is_alphabetic())?;
    if letters[k] != '_' || symbol.checked_sub(1).is_some_and(is_word) {
        return None;
    }
    let length = (1..=3).find(|&n| !is_word(k + n))? - 1;
    let alike = letters[k + 1..=k + length].iter().all(|c| c.is_alphanumeric());
    (length > 0 && alike).then_some(length)
}

fn exponent_at(letters: &[char], k: usize) -> Option<usize> {
    let after_digit = k.checked_sub(1).is_some_and(|before| letters[before].is_ascii_digit());
    let is_of_number = |c: &&char| c.is_ascii_digit() || matches!(c, '−' | '-' | '.');
    let length = letters[k + 1..].iter().take_while(is_of_number).count();
    (letters[k] == '^' && after_digit && length > 0).then_some(length)
}

fn plain(c: char) -> (Level, char) {
    let place = |small: &str, plain: &str| small.chars().zip(plain.chars()).find(|pair| pair.0 == c);
    let index = place("₀₁₂₃₄₅₆₇₈₉ᵣₙ", "0123456789rn").map(|pair| (Level::Index, pair.1));
    let exponent = || place("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789−").map(|pair| (Level::Exponent, pair.1));
    index.or_else(exponent).unwrap_or((Level::Line, c))
}

/// The content of an SVG text in this size.
pub fn spans(text: &str, size: f64) -> String {
    let mut line = 0.0;
    let mut content = String::with_capacity(text.len());
    for (level, piece) in pieces(text) {
        let (own_size, below) = level.place(size);
        // A shift applies to all following text.
        let shift = below - line;
        line = below;
        // Some programs drop a blank at the edge of a span, even if it is a no-break space.
        let at_edge = piece.starts_with(' ') || piece.ends_with(' ');
        let space = if at_edge { " xml:space=\"preserve\"" } else { "" };
        let piece = escaped(&piece);
        if level == Level::Line && shift == 0.0 {
            content += &piece;
            continue;
        }
        let small = if level == Level::Line {
            String::new()
        } else {
            format!(" font-size=\"{own_size:.1}\"")
        };
        content += &format!("<tspan dy=\"{shift:.1}\"{small}{space}>{piece}</tspan>");
    }
    content
}
