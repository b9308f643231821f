//! Signatures by which the program recognises its products.

use std::path::PathBuf;

/// Keyword of a PNG's text chunk, and start of its text.
pub const PNG: (&str, &str) = ("Software", "stickslip");

/// Start of `<desc>` in SVG, and of the producer in PDF.
pub const FIGURE: &str = "stickslip figure";

const SOURCE: (&str, &str) = (" of [", "]");

/// Most bytes of the names in a signature.
const LONGEST_SOURCE: usize = 1000;

/// Names of a product's files, which follow its signature: " of [a.h5, b.h5]", in ASCII without markup; empty without
/// files.
pub fn source(files: &[PathBuf]) -> String {
    if files.is_empty() {
        return String::new();
    }
    let name = |file: &PathBuf| {
        let name = file.to_string_lossy();
        let plain = |c: char| c.is_ascii_alphanumeric() || "._-/ ".contains(c);
        let name = name.trim_start_matches("./").chars();
        name.map(|c| {
            if plain(c) {
                c.to_string()
            } else {
                format!("%{:X}", u32::from(c))
            }
        })
        .collect::<String>()
    };
    let mut names = files.iter().map(name).collect::<Vec<_>>().join(", ");
    names.truncate(LONGEST_SOURCE);
    format!("{}{names}{}", SOURCE.0, SOURCE.1)
}

/// The names from [`source`] in a text that follows a signature, up to the end of its element.
pub fn names_in(text: &str) -> Option<&str> {
    let text = text.split(['<', '>', ')']).next()?;
    Some(text.split_once(SOURCE.0)?.1.split_once(SOURCE.1)?.0)
}

/// Signature of a page, near its start.
pub const PAGE: &str = "<meta name=\"generator\" content=\"stickslip";

/// Signature of a comparison's report, near its start: in a Markdown comment, or as the generator of a page.
pub const REPORT: &str = "stickslip compare";
