//! The keys of study files: each reader declares those of its tables, with type, default and meaning, and this module lists
//! all of them.

use super::head::HEAD_KEYS;
use crate::analysis::work_precision;
use crate::{calibrate, continuation, sweep};

/// A key of a study file.
#[derive(Debug, Clone, Copy)]
pub struct StudyKey {
    /// Name in its table.
    pub name: &'static str,
    /// Type of the value, with its unit.
    pub takes: &'static str,
    /// Default in words; empty for a required key.
    pub default: &'static str,
    /// One line about the key.
    pub about: &'static str,
}

/// Keys of a table: name, type of the value, default, meaning.
macro_rules! keys {
    ($($name:literal: $takes:literal, $default:expr => $about:literal;)*) => {
        &[$($crate::study::StudyKey { name: $name, takes: $takes, default: $default, about: $about }),*]
    };
}
pub(crate) use keys;

/// A table of study files.
#[derive(Debug, Clone, Copy)]
pub struct StudyKeyTable {
    /// Commands whose studies have the table.
    pub commands: &'static str,
    /// Name, with `[]` for an array of tables; empty for the keys outside tables.
    pub name: &'static str,
    /// Keys, in the order of messages.
    pub keys: &'static [StudyKey],
}

/// All tables of study files.
pub fn tables() -> Vec<StudyKeyTable> {
    const ALL: &str = "sweep, calibrate, continue, work-precision";
    let of = |commands, own: &[(&'static str, &'static [StudyKey])]| {
        let tables = own.iter().map(|&(name, keys)| StudyKeyTable { commands, name, keys });
        tables.collect::<Vec<_>>()
    };
    [
        of(ALL, &[("", HEAD_KEYS)]),
        of("sweep, continue", &[("axis[]", sweep::AXIS_KEYS)]),
        of("sweep", sweep::KEY_TABLES),
        of("calibrate", calibrate::KEY_TABLES),
        of("continue", continuation::KEY_TABLES),
        of("work-precision", work_precision::KEY_TABLES),
    ]
    .concat()
}
