//! Texts of figures with subscripts and superscripts: widths and SVG.
//!
//! T_f and c_t are symbols with an index, and 10^−5 is a power. Unicode's small letters (ωᵣ, φ₁, 10⁻⁵) are set alike.

use super::html::escaped;

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
    let digit = |from: u32| char::from_digit(c as u32 - from, 10).unwrap_or(c);
    match c {
        '₀'..='₉' => (Level::Index, digit(0x2080)),
        'ᵣ' => (Level::Index, 'r'),
        'ₙ' => (Level::Index, 'n'),
        '¹' => (Level::Exponent, '1'),
        '²' => (Level::Exponent, '2'),
        '³' => (Level::Exponent, '3'),
        '⁰' | '⁴'..='⁹' => (Level::Exponent, digit(0x2070)),
        '⁻' => (Level::Exponent, '−'),
        _ => (Level::Line, c),
    }
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
        content += &format!("<tspan dy=\"{shift:.1}\"{small}>{piece}</tspan>");
    }
    content
}
