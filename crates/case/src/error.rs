//! Problems of a case, each with its place.

use std::fmt;
use stickslip_system::quote::shown;

/// All problems found in a case file, in its overrides, or in a value set in a case.
///
/// It is displayed with one line for each problem: `paper.toml:12: torsion.damping: what is wrong; what to do`.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}", self.problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
pub struct CaseError {
    /// The problems, at least one, in the order of the file.
    pub problems: Vec<CaseProblem>,
}

/// A problem of a case.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CaseProblem {
    /// `paper.toml:12`, `--set torsion.damping`, or empty for a value set by the program.
    pub place: String,
    /// Dotted path of the key; empty if the problem has none.
    pub key: String,
    /// The defect and its remedy.
    pub message: String,
}

impl fmt::Display for CaseProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let key = shown(&self.key);
        let set = self.place.strip_prefix("--set ");
        let place = set.map_or_else(|| self.place.clone(), |set| format!("--set {}", shown(set)));
        match set {
            // An override names its own key already, or the table that contains the key.
            Some(set) if set == self.key || self.key.is_empty() => write!(f, "{place}: ")?,
            // The message may concern another key, whose value conflicts with the override.
            Some(set) if !self.key.starts_with(set) => {
                let verb = if self.message.starts_with("missing") { "is " } else { "" };
                write!(f, "{place}: then {key} {verb}")?;
            }
            _ => {
                for part in [&place, &key].into_iter().filter(|part| !part.is_empty()) {
                    write!(f, "{part}: ")?;
                }
            }
        }
        f.write_str(&self.message)
    }
}

impl CaseError {
    /// An error with a single problem: its place (file and line), key and message.
    pub fn one(place: impl Into<String>, key: impl Into<String>, message: impl Into<String>) -> CaseError {
        CaseError {
            problems: vec![CaseProblem {
                place: place.into(),
                key: key.into(),
                message: message.into(),
            }],
        }
    }
}
