//! Texts of a figure with their sub- and superscripts: how wide they are, and how SVG has them.
//!
//! In a text, T_f and c_t are symbols with an index, 10^−5 is a power, and the letters that Unicode has for either (ωᵣ, φ₁, 10⁻⁵)
//! are set as the others are: smaller, and below or above the line.

/// Size of an index or exponent in that of its text.
pub(crate) const SMALL: f64 = 0.72;
/// How far an index stands below the line, in the size of the text.
const BELOW: f64 = 0.2;
/// How far an exponent stands above it.
const ABOVE: f64 = 0.36;

/// Where a piece of text stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Level {
    Line,
    Index,
    Exponent,
}

/// A text as pieces on one level each.
pub(crate) fn pieces(text: &str) -> Vec<(Level, String)> {
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

/// Whether the index of a symbol begins at an underscore, and how long it is: a symbol is one letter, its index one or two
/// letters or digits, so that no name of a file or a channel is taken for one.
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

/// Whether the exponent of a number begins here, and how long it is.
fn exponent_at(letters: &[char], k: usize) -> Option<usize> {
    let after_digit = k.checked_sub(1).is_some_and(|before| letters[before].is_ascii_digit());
    let is_of_number = |c: &&char| c.is_ascii_digit() || matches!(c, '−' | '-' | '.');
    let length = letters[k + 1..].iter().take_while(is_of_number).count();
    (letters[k] == '^' && after_digit && length > 0).then_some(length)
}

/// A letter of Unicode's that stands below or above the line, as the one that it is a form of.
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

/// The content of an SVG text of that size, which is escaped already and stays so.
pub(crate) fn spans(text: &str, size: f64) -> String {
    let mut below = 0.0;
    let mut content = String::with_capacity(text.len());
    for (level, piece) in pieces(text) {
        let place = match level {
            Level::Line => 0.0,
            Level::Index => BELOW,
            Level::Exponent => -ABOVE,
        };
        // What is shifted stays so for all that follows.
        let shift = place - below;
        below = place;
        if level == Level::Line && shift == 0.0 {
            content += &piece;
            continue;
        }
        let small = if level == Level::Line {
            String::new()
        } else {
            format!(" font-size=\"{:.1}\"", SMALL * size)
        };
        content += &format!("<tspan dy=\"{:.1}\"{small}>{piece}</tspan>", shift * size);
    }
    content
}

#[cfg(test)]
mod tests {
    use super::*;
    use Level::{Exponent, Index, Line};

    #[test]
    fn analytic_symbols_and_powers_are_set() {
        let set = |text: &str| pieces(text);
        let own = |list: &[(Level, &str)]| -> Vec<(Level, String)> {
            list.iter().map(|(level, text)| (*level, (*text).to_owned())).collect()
        };
        assert_eq!(
            set("torque T_f, c_t"),
            own(&[(Line, "torque T"), (Index, "f"), (Line, ", c"), (Index, "t")])
        );
        assert_eq!(set("10^−5 m"), own(&[(Line, "10"), (Exponent, "−5"), (Line, " m")]));
        assert_eq!(set("10⁻¹²"), own(&[(Line, "10"), (Exponent, "−12")]));
        assert_eq!(
            set("|ωᵣ| φ₁′"),
            own(&[(Line, "|ω"), (Index, "r"), (Line, "| φ"), (Index, "1"), (Line, "′")])
        );
    }

    /// What is called by the user is no symbol.
    #[test]
    fn analytic_names_stay_as_they_are() {
        for name in [
            "paper_si", "run_1", "a_b_c", "c_tt_", "_f", "T_", "T_fric", "x^y", "mu_s", "^2",
        ] {
            assert_eq!(pieces(name), [(Line, name.to_owned())], "{name}");
        }
    }

    #[test]
    fn analytic_spans_return_to_the_line() {
        assert_eq!(
            spans("T_f (N)", 100.0),
            "T<tspan dy=\"20.0\" font-size=\"72.0\">f</tspan><tspan dy=\"-20.0\"> (N)</tspan>"
        );
    }
}
