//! The font of the figures, which is part of the program: no figure depends on what a system has installed.

use super::typeset::{self, Level};
use std::sync::OnceLock;

/// DejaVu Sans, reduced to the letters that figures use: see data/fonts.
pub(crate) const DATA: &[u8] = include_bytes!("../../data/fonts/DejaVuSans.subset.ttf");

/// Families in the SVG: where the first is missing, Verdana has the same widths.
pub(crate) const FAMILIES: &str = "DejaVu Sans, Verdana, sans-serif";

/// Width of a character that the font does not have, in ems: that of its replacement box.
const MISSING: f64 = 0.6;

fn face() -> Option<&'static ttf_parser::Face<'static>> {
    static FACE: OnceLock<Option<ttf_parser::Face<'static>>> = OnceLock::new();
    FACE.get_or_init(|| ttf_parser::Face::parse(DATA, 0).ok()).as_ref()
}

/// Width of a line of text in the unit of `size`, its font size; indices and exponents are smaller.
pub(crate) fn text_width(text: &str, size: f64) -> f64 {
    let pieces = typeset::pieces(text).into_iter();
    let width = |(level, piece): (Level, String)| match level {
        Level::Line => plain_width(&piece, size),
        Level::Index | Level::Exponent => plain_width(&piece, typeset::SMALL * size),
    };
    pieces.map(width).sum()
}

fn plain_width(text: &str, size: f64) -> f64 {
    let Some(face) = face() else {
        return MISSING * size * text.chars().count() as f64;
    };
    let em = f64::from(face.units_per_em());
    let width = |c: char| {
        let advance = face.glyph_index(c).and_then(|glyph| face.glyph_hor_advance(glyph));
        advance.map_or(MISSING, |advance| f64::from(advance) / em)
    };
    size * text.chars().map(width).sum::<f64>()
}

/// `text` broken at blanks into lines no wider than `width`, as far as single words allow.
pub fn wrapped(text: &str, size: f64, width: f64) -> Vec<String> {
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

/// A title as lines no wider than `width`: what does not fit in one breaks after its colon first.
pub(crate) fn wrapped_title(title: &str, size: f64, width: f64) -> Vec<String> {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// DejaVu Sans: "0" is 1303 of 2048 units wide, and so is every digit.
    #[test]
    fn published_widths() {
        assert_eq!(text_width("0000", 2048.0), 4.0 * 1303.0);
        assert_eq!(text_width("7", 2048.0), 1303.0);
        assert!(text_width("ωᵣ φ₁′ θ µ −", 1.0) > 5.0);
    }

    #[test]
    fn analytic_a_long_title_breaks_after_its_colon() {
        let title = "Stator surface before the first stick: diverges, ×1.505 per turn";
        let width = text_width(title, 1.0);
        let halves = ["Stator surface before the first stick:", "diverges, ×1.505 per turn"];
        assert_eq!(wrapped_title(title, 1.0, 0.95 * width), halves);
        assert_eq!(wrapped_title(title, 1.0, 1.01 * width), [title]);
        assert_eq!(
            wrapped_title("no colon here", 1.0, text_width("no colon", 1.0)),
            ["no colon", "here"]
        );
    }

    #[test]
    fn analytic_every_symbol_of_the_labels_is_in_the_font() {
        let face = face().unwrap();
        for c in "ωᵣφ₁₂θµ−′₀αΔ×·≤²³¹⁻".chars() {
            assert!(face.glyph_index(c).is_some(), "{c}");
        }
    }
}
