//! Texts of input and output: quotes, rows of tables, remedies.

mod quote {
    use proptest::prelude::*;
    use stickslip_system::quote::{LONGEST_LINE, MOST_LINES, for_terminal, in_json, lines, quoted, shown};

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

mod input {
    use std::io::{BufReader, Read};
    use stickslip_case::input::{InputRows, LONGEST_LINE};

    /// The reader of a table keeps at most one row, whatever quotes it contains.
    #[test]
    fn property_a_row_has_an_end() {
        let rows = "1,2,3\n".repeat(6 * LONGEST_LINE / 10);
        let read = |text: &str| {
            let rows = InputRows::new(BufReader::new(text.as_bytes()).take(u64::MAX));
            let mut table = csv::ReaderBuilder::new().from_reader(rows);
            let (mut record, mut count) = (csv::ByteRecord::new(), 0);
            loop {
                match table.read_byte_record(&mut record) {
                    Ok(true) => count += 1,
                    Ok(false) => return Ok(count),
                    Err(error) => return Err(error.to_string()),
                }
                table.get_mut().taken();
            }
        };
        assert_eq!(read(&rows), Ok(6 * LONGEST_LINE / 10 - 1));
        let unclosed = format!("1,2,3\n1,\"2,3\n{rows}");
        assert!(read(&unclosed).unwrap_err().contains("quote"));
    }
}

mod report {
    use stickslip::engine::{Error, ErrorKind};
    use stickslip::simulation::{RunFailure, RunReport};

    /// The breakaway test is blamed only if it can be the cause.
    #[test]
    fn property_a_remedy_is_of_the_breakaway_test_that_chatters() {
        let said = |one_sided_test: bool| {
            let error = Error {
                kind: ErrorKind::Chattering,
                time: 1.0,
                message: "chattering at t = 1 s".to_owned(),
                cause: None,
            };
            let report = RunReport {
                one_sided_test,
                ..RunReport::default()
            };
            RunFailure { error, report }.to_string()
        };
        assert!(said(true).contains("contact.breakaway_test"));
        assert!(!said(false).contains("contact."), "{}", said(false));
        assert!(said(false).contains("solver.method"), "{}", said(false));
    }
}
