//! Quotation of foreign text in errors, in reports and on the terminal.
//!
//! The text of a file can have any length, and can contain characters that move the cursor of a terminal, change its
//! colours or reverse its writing direction. A quotation is short, and spells such characters out.

/// Longest quoted text in an error, characters. It is long enough to find the text again.
const LONGEST_QUOTE: usize = 80;

/// Longest line of an error or report, characters. The middle of a longer line is cut: the beginning names the place,
/// the end the remedy.
pub const LONGEST_LINE: usize = 1000;

/// Most lines of an error.
pub const MOST_LINES: usize = 30;

/// `text` in double quotes.
pub fn quoted(text: &str) -> String {
    format!("\"{}\"", shown(text))
}

/// `text` without quotes, for keys and names.
pub fn shown(text: &str) -> String {
    let mut start = text.chars().take(LONGEST_QUOTE + 1);
    let short: String = start.by_ref().take(LONGEST_QUOTE).collect();
    let more = if start.next().is_some() { "..." } else { "" };
    spelt_out(&short, |_| false) + more
}

/// A bound in scientific notation with this many decimals. It is rounded up, so that it is still a bound.
pub fn bound(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$e}");
    let read = |text: &str| text.parse::<f64>().ok();
    match (read(&text), text.split_once('e')) {
        (Some(printed), Some((_, exponent))) if printed < value => {
            let unit = read(&format!("1e{exponent}")).unwrap_or(0.0) * 10f64.powi(-(decimals as i32));
            format!("{:.decimals$e}", printed + unit)
        }
        _ => text,
    }
}

/// An argument in the syntax of a POSIX shell.
pub fn in_shell(argument: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=:,+@".contains(c);
    if !argument.is_empty() && argument.chars().all(plain) {
        argument.to_owned()
    } else {
        format!("'{}'", argument.replace('\'', r"'\''"))
    }
}

/// The lines of an error, each of limited length. Lines beyond [`MOST_LINES`] are only counted.
pub fn lines(text: &str) -> String {
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

/// A report for the terminal. Line ends and tabs remain.
pub fn for_terminal(text: &str) -> String {
    spelt_out(text, |c| matches!(c, '\n' | '\t'))
}

/// A JSON document in which control characters, and those selected by `also`, are written as `\u001b`. They can only
/// occur in its texts. Line ends between the texts remain.
pub fn in_json(document: &str, also: impl Fn(char) -> bool) -> String {
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

/// Writes control characters, and characters that reverse the writing direction, as `\u{1b}`.
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

pub(crate) fn steers(c: char) -> bool {
    c.is_control() || turns(c)
}

fn turns(c: char) -> bool {
    matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{2028}' | '\u{2029}')
}
