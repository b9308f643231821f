//! The cases that come with the program: the files of `data/cases`.

use super::{CaseError, suggest};
use crate::quote::shown;

/// A case or a study embedded in the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BuiltIn {
    /// By which it is asked for.
    pub name: &'static str,
    /// TOML.
    pub text: &'static str,
}

/// The case that is run if none is named.
pub const DEFAULT: &str = "paper";

/// Every built-in case of the brake; the default first.
pub const CASES: &[BuiltIn] = &[
    BuiltIn {
        name: DEFAULT,
        text: include_str!("../../data/cases/paper.toml"),
    },
    BuiltIn {
        name: "paper-si",
        text: include_str!("../../data/cases/paper-si.toml"),
    },
    BuiltIn {
        name: "unperturbed",
        text: include_str!("../../data/cases/unperturbed.toml"),
    },
    BuiltIn {
        name: "release",
        text: include_str!("../../data/cases/release.toml"),
    },
];

/// Every built-in case of trains.
pub const TRAINS: &[BuiltIn] = &[
    BuiltIn {
        name: "belt-coulomb",
        text: include_str!("../../data/cases/belt-coulomb.toml"),
    },
    BuiltIn {
        name: "belt-leine",
        text: include_str!("../../data/cases/belt-leine.toml"),
    },
    BuiltIn {
        name: "belt-leine-arctan",
        text: include_str!("../../data/cases/belt-leine-arctan.toml"),
    },
    BuiltIn {
        name: "belt-leine-tanh",
        text: include_str!("../../data/cases/belt-leine-tanh.toml"),
    },
    BuiltIn {
        name: "belt-exponential",
        text: include_str!("../../data/cases/belt-exponential.toml"),
    },
    BuiltIn {
        name: "block",
        text: include_str!("../../data/cases/block.toml"),
    },
    BuiltIn {
        name: "hairer",
        text: include_str!("../../data/cases/hairer.toml"),
    },
    BuiltIn {
        name: "den-hartog",
        text: include_str!("../../data/cases/den-hartog.toml"),
    },
    BuiltIn {
        name: "groan",
        text: include_str!("../../data/cases/groan.toml"),
    },
    BuiltIn {
        name: "drill-string",
        text: include_str!("../../data/cases/drill-string.toml"),
    },
    BuiltIn {
        name: "clutch",
        text: include_str!("../../data/cases/clutch.toml"),
    },
    BuiltIn {
        name: "lugre-slider",
        text: include_str!("../../data/cases/lugre-slider.toml"),
    },
];

/// Every built-in case of either kind: the brakes, then the trains.
pub fn all() -> Vec<BuiltIn> {
    [CASES, TRAINS].concat()
}

/// The one of that name among those of a kind: "case", "study".
///
/// # Errors
/// If there is none; the text lists those there are.
pub(crate) fn find(kind: &str, among: &[BuiltIn], name: &str) -> Result<BuiltIn, CaseError> {
    let names: Vec<&str> = among.iter().map(|one| one.name).collect();
    among.iter().find(|one| one.name == name).copied().ok_or_else(|| {
        let hint = suggest(name, names.iter().copied())
            .map(|close| format!(" (did you mean {close}?)"))
            .unwrap_or_default();
        let message = format!(
            "there is no built-in {kind} \"{name}\"{hint}; there {} {}, and any TOML file by its path",
            if names.len() == 1 { "is" } else { "are" },
            names.join(", "),
            name = shown(name)
        );
        CaseError::one("", "", message)
    })
}
