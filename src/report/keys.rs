//! `stickslip case --keys`: every key of cases, signals and studies, from their declarations.

use super::{Page, PageTable, Report};
use serde::Serialize;
use stickslip_analysis::study;
use stickslip_case::schema::{self, Key};
use stickslip_case::{Motion, PROFILES, SIGNAL_KEYS};

/// A key of a file.
#[derive(Debug, Serialize)]
pub(crate) struct ListedKey {
    /// Dotted path; `[]` stands for an index. `SIGNAL` stands for a key that takes a signal.
    pub key: String,
    /// Files that may have the key.
    pub of: String,
    /// Type of the value.
    pub takes: String,
    /// SI unit; `None` for other types, and for a signal's own values.
    pub unit: Option<&'static str>,
    /// Unit with `motion = "translation"`, if it is another.
    pub unit_of_translation: Option<&'static str>,
    /// Words that the key takes; empty for other types.
    pub words: Vec<&'static str>,
    /// Default, or when the key is required.
    pub default: String,
    /// One line about the key.
    pub meaning: String,
}

const CASES: [&str; 3] = ["every case", "cases with [torsion]", "cases with [rotor] and [stator]"];
const SIGNALS: &str = "signals";

fn of_case(key: &Key) -> ListedKey {
    let (short, general) = key.forms();
    let dimension = key.dimension();
    let unit = dimension.map(|dimension| dimension.unit());
    let of_translation = dimension.map(|dimension| Motion::Translation.dimension(dimension).unit());
    ListedKey {
        key: key.path.to_owned(),
        of: CASES[if short && general { 0 } else { 1 + usize::from(general) }].to_owned(),
        takes: key.takes().to_owned(),
        unit,
        unit_of_translation: of_translation.filter(|&other| general && unit != Some(other)),
        words: key.choices(),
        default: key.default_in_words(),
        meaning: key.description.to_owned(),
    }
}

fn of_signals() -> impl Iterator<Item = ListedKey> {
    let listed = |name: &str, takes: &str, default: &str, meaning: &str| ListedKey {
        key: format!("SIGNAL.{name}"),
        of: SIGNALS.to_owned(),
        takes: takes.to_owned(),
        unit: None,
        unit_of_translation: None,
        words: Vec::new(),
        default: default.to_owned(),
        meaning: meaning.to_owned(),
    };
    let profile = ListedKey {
        words: PROFILES.to_vec(),
        ..listed(
            "profile",
            "word",
            "required; a number alone is a constant",
            "shape of the signal",
        )
    };
    let others = SIGNAL_KEYS.iter().map(move |key| {
        let own = key.profiles.join(", ");
        let default = match key.default {
            "" => format!("required with profile {own}"),
            default => format!("{default}, with profile {own}"),
        };
        ListedKey {
            unit: key.dimension.map(|dimension| dimension.unit()),
            ..listed(key.name, key.takes(), &default, key.description)
        }
    });
    std::iter::once(profile).chain(others)
}

fn of_studies() -> impl Iterator<Item = ListedKey> {
    study::tables().into_iter().flat_map(|table| {
        table.keys.iter().map(move |key| ListedKey {
            key: match table.name {
                "" => key.name.to_owned(),
                name => format!("{name}.{}", key.name),
            },
            of: format!("studies of {}", table.commands),
            takes: key.takes.to_owned(),
            unit: None,
            unit_of_translation: None,
            words: Vec::new(),
            default: match key.default {
                "" => "required".to_owned(),
                default => default.to_owned(),
            },
            meaning: key.about.to_owned(),
        })
    })
}

/// Every key of cases, signals and studies, in the order of their declarations.
pub(crate) fn listed_keys() -> Vec<ListedKey> {
    let of_cases = schema::all_keys().map(of_case);
    of_cases.chain(of_signals()).chain(of_studies()).collect()
}

impl ListedKey {
    /// Whether path, meaning, type or words contain this text, in upper or lower case.
    pub fn contains(&self, text: &str) -> bool {
        let own = [self.key.as_str(), &self.meaning, &self.takes];
        let mut all = own.into_iter().chain(self.words.iter().copied());
        all.any(|one| one.to_lowercase().contains(&text.to_lowercase()))
    }

    /// Type and unit in words; the first ones if there are many.
    pub fn type_and_unit(&self, most_words: usize) -> String {
        if !self.words.is_empty() {
            let shown = self
                .words
                .iter()
                .take(most_words)
                .copied()
                .collect::<Vec<_>>()
                .join(" | ");
            let more = self.words.len().saturating_sub(most_words);
            return match more {
                0 => shown,
                more => format!("{shown} | {more} more"),
            };
        }
        let unit = self
            .unit
            .filter(|&unit| unit != "1")
            .map(|unit| match self.unit_of_translation {
                Some(other) => format!("{unit} or {other}"),
                None => unit.to_owned(),
            });
        match (self.takes.as_str(), unit) {
            ("number", Some(unit)) => unit,
            (takes, Some(unit)) => format!("{takes}, {unit}"),
            (takes, None) => takes.to_owned(),
        }
    }
}

/// Words of a key in a table of several keys. A single key shows all.
const MOST_WORDS: usize = 6;

/// Keys by file.
impl Report for Vec<ListedKey> {
    fn page(&self) -> Page {
        let mut groups: Vec<&str> = Vec::new();
        for key in self {
            if !groups.contains(&key.of.as_str()) {
                groups.push(&key.of);
            }
        }
        let most_words = if self.len() == 1 { usize::MAX } else { MOST_WORDS };
        let tables = groups.into_iter().map(|group| {
            PageTable::of(self.iter().filter(|key| key.of == group))
                .text("key", |key| &key.key)
                .text("unit or type", |key| key.type_and_unit(most_words))
                .text("default", |key| &key.default)
                .text("meaning", |key| &key.meaning)
                .done()
                .titled(group)
        });
        Page::default().with_all(tables)
    }
}
