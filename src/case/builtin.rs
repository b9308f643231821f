//! The cases that come with the program: the files of `data/cases`.

/// A case file embedded in the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BuiltIn {
    /// The name by which it is called.
    pub name: &'static str,
    /// The TOML text.
    pub text: &'static str,
}

/// The case that is run if none is named.
pub const DEFAULT: &str = "paper";

/// Every built-in case; the default first.
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

/// The built-in case of that name.
pub fn find(name: &str) -> Option<&'static BuiltIn> {
    CASES.iter().find(|case| case.name == name)
}
