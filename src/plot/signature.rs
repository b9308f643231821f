//! Marks by which the program recognises its own figures and pages.

/// Keyword and text of a PNG's text chunk.
pub const PNG: (&str, &str) = ("Software", "stickslip");

/// Of every SVG the beginning of its `<desc>`, of a PDF the producer, of an EPS the creator.
pub const FIGURE: &str = "stickslip figure";

/// A page has this near its beginning.
pub const PAGE: &str = "<meta name=\"generator\" content=\"stickslip";

/// A report of a comparison has this near its beginning: in a comment of Markdown, or as the generator of a page.
pub const REPORT: &str = "stickslip compare";
