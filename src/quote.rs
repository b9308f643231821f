//! How texts that were written by others are quoted: in errors, in reports, on the terminal.
//!
//! What a file says is not the program's own: it can be of any length, and hold characters that move the cursor of a
//! terminal, change its colours or turn its writing direction. Quoted it is short, and such characters are spelt out.

// Lines and the terminal are the program's.
#![cfg_attr(not(feature = "cli"), allow(dead_code))]

/// A text in an error is cut to so many characters: enough to find it again.
const LONGEST_QUOTE: usize = 80;

/// And a line of an error or a report to so many, from its middle: what it begins with says where, its end what to do.
const LONGEST_LINE: usize = 1000;

/// An error says so many lines.
pub(crate) const MOST_LINES: usize = 30;

/// `text` in double quotes.
pub(crate) fn quoted(text: &str) -> String {
    format!("\"{}\"", shown(text))
}

/// `text` without quotes, such as a key or a name.
pub(crate) fn shown(text: &str) -> String {
    let mut start = text.chars().take(LONGEST_QUOTE + 1);
    let short: String = start.by_ref().take(LONGEST_QUOTE).collect();
    let more = if start.next().is_some() { "..." } else { "" };
    spelt_out(&short, |_| false) + more
}

/// An argument as a POSIX shell takes it.
pub(crate) fn in_shell(argument: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=:,+@".contains(c);
    if !argument.is_empty() && argument.chars().all(plain) {
        argument.to_owned()
    } else {
        format!("'{}'", argument.replace('\'', r"'\''"))
    }
}

/// The lines of an error, each of bounded length; those beyond [`MOST_LINES`] are counted.
pub(crate) fn lines(text: &str) -> String {
    let mut lines = text.lines();
    let mut shown: Vec<String> = lines.by_ref().take(MOST_LINES).map(line).collect();
    match lines.count() {
        0 => {}
        more => shown.push(format!("and {more} more")),
    }
    shown.join("\n")
}

fn line(text: &str) -> String {
    let text = spelt_out(text, |_| false);
    let count = text.chars().count();
    if count <= LONGEST_LINE {
        return text;
    }
    let half = LONGEST_LINE / 2;
    let start: String = text.chars().take(half).collect();
    let end: String = text.chars().skip(count - half).collect();
    format!("{start} ... {end}")
}

/// A report as the terminal gets it: line ends and tabs stay.
pub(crate) fn for_terminal(text: &str) -> String {
    spelt_out(text, |c| matches!(c, '\n' | '\t'))
}

/// A JSON document without such characters, and without those that `also` says: in its texts, the only place where it can
/// have them besides its line ends, they are written as `\u001b`.
#[cfg_attr(not(any(feature = "cli", feature = "plot")), allow(dead_code))]
pub(crate) fn in_json(document: &str, also: impl Fn(char) -> bool) -> String {
    let mut safe = String::with_capacity(document.len());
    for c in document.chars() {
        if c != '\n' && (steers(c) || also(c)) {
            safe.push_str(&format!("\\u{:04x}", u32::from(c)));
        } else {
            safe.push(c);
        }
    }
    safe
}

/// Control characters, and those that turn the writing direction, as `\u{1b}`.
fn spelt_out(text: &str, stays: impl Fn(char) -> bool) -> String {
    let is_harmless = |c: char| stays(c) || !steers(c);
    if text.chars().all(is_harmless) {
        return text.to_owned();
    }
    let mut spelt = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if is_harmless(c) {
            spelt.push(c);
        } else {
            spelt.extend(c.escape_default());
        }
    }
    spelt
}

/// Whether a character would steer a terminal, or turn the writing direction.
pub(crate) fn steers(c: char) -> bool {
    c.is_control() || turns(c)
}

fn turns(c: char) -> bool {
    matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{2028}' | '\u{2029}')
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn property_a_quote_is_short_and_harmless() {
        assert_eq!(quoted("10 lbf"), "\"10 lbf\"");
        assert_eq!(quoted("\u{1b}[2J\u{202e}"), "\"\\u{1b}[2J\\u{202e}\"");
        assert_eq!(shown(&"ä".repeat(80)), "ä".repeat(80));
        assert_eq!(shown(&"ä".repeat(81)), "ä".repeat(80) + "...");
        assert_eq!(for_terminal("a\tb\n\u{7}c\rd"), "a\tb\n\\u{7}c\\rd");
        let document = serde_json::to_string_pretty(&["\u{7f}\u{1b}\u{9b}\u{202e}<"]).unwrap();
        let safe = in_json(&document, |c| c == '<');
        assert_eq!(safe, "[\n  \"\\u007f\\u001b\\u009b\\u202e\\u003c\"\n]");
        let error = lines(&"a:1: x\n".repeat(100));
        assert_eq!(error.lines().count(), MOST_LINES + 1);
        assert!(error.ends_with("and 70 more"), "{error}");
    }

    proptest! {
        #[test]
        fn property_no_text_reaches_the_terminal_as_a_command(text in any::<String>()) {
            for safe in [quoted(&text), lines(&text), for_terminal(&text)] {
                prop_assert!(!safe.chars().any(|c| c.is_control() && c != '\n' && c != '\t'));
            }
            prop_assert!(lines(&text).chars().count() <= (MOST_LINES + 1) * (LONGEST_LINE + 16));
        }
    }
}
