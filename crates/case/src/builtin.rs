//! Cases that come with the program: the files of `data/cases`.

use super::{CaseError, suggest};
use stickslip_system::quote::shown;

/// A case or a study embedded in the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BuiltIn {
    /// Name by which it is requested.
    pub name: &'static str,
    /// TOML.
    pub text: &'static str,
}

/// The case that is run if none is named.
pub const DEFAULT: &str = "paper";

/// Makes a list of [`BuiltIn`](crate::builtin::BuiltIn) texts from a folder of `data`.
#[macro_export]
macro_rules! built_in {
    ($folder:literal: $($name:literal),* $(,)?) => {
        &[$($crate::builtin::BuiltIn {
            name: $name,
            text: include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/", $folder, "/", $name, ".toml")),
        }),*]
    };
}

/// Every built-in case in the short form, the default first.
pub const CASES: &[BuiltIn] = built_in!["cases": "paper", "paper-si", "unperturbed", "release"];

/// Every built-in case in the general form.
pub const TRAINS: &[BuiltIn] = built_in![
    "cases":
    "belt-coulomb",
    "belt-leine",
    "belt-leine-arctan",
    "belt-leine-tanh",
    "belt-exponential",
    "block",
    "hairer",
    "den-hartog",
    "groan",
    "drill-string",
    "clutch",
    "lugre-slider",
];

/// Every built-in case: those in the short form, then those in the general one.
pub fn all() -> Vec<BuiltIn> {
    [CASES, TRAINS].concat()
}

/// Finds a built-in file by its name. `kind` ("case", "study") is a noun for the message.
///
/// # Errors
/// There is no such name; the message lists the known ones.
pub fn find(kind: &str, among: &[BuiltIn], name: &str) -> Result<BuiltIn, CaseError> {
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
