//! Whether a TOML text is a case or a study, and for which command, by its tables.

use stickslip_case::document::{self, CaseValue, PlacedValue};
use stickslip_case::{schema, train_keys};

/// Kind of a TOML text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TextKind {
    /// A case, for `stickslip run`.
    Case,
    /// A study, for one of these commands; the likeliest is the first.
    Study(Vec<&'static str>),
}

/// Tables that only the studies of some commands have.
const TABLES: [(&str, &[&str]); 9] = [
    ("sample", &["sweep"]),
    ("points", &["sweep"]),
    ("keep", &["sweep"]),
    ("show", &["sweep"]),
    ("boundary", &["sweep"]),
    ("free", &["calibrate"]),
    ("target", &["calibrate"]),
    ("branch", &["continue"]),
    ("series", &["work-precision"]),
];

/// The kind of a text; `None` if it is not TOML, or has the tables of neither.
pub fn kind_of(text: &str) -> Option<TextKind> {
    let root = document::read(text, "").ok()?;
    let CaseValue::Table(entries) = &root.value else {
        return None;
    };
    let has = |name: &str| entries.iter().any(|(key, _)| key == name);
    if let Some((_, commands)) = TABLES.iter().find(|(table, _)| has(table)) {
        return Some(TextKind::Study(commands.to_vec()));
    }
    if let Some(axes) = root.at("axis") {
        let has_points = |axis: &PlacedValue| ["count", "values"].iter().any(|key| axis.at(key).is_some());
        // An axis without points is followed, or lacks them by mistake.
        return Some(TextKind::Study(match &axes.value {
            CaseValue::Array(axes) if axes.iter().any(has_points) => vec!["sweep"],
            _ => vec!["continue", "sweep"],
        }));
    }
    let mut keys = schema::keys().chain(train_keys());
    let is_case = keys.any(|key| key.path.split_once('.').is_some_and(|(table, _)| has(table)));
    is_case.then_some(TextKind::Case)
}
