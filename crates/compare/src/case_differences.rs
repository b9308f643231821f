//! Physical keys in which two cases differ.

use serde::Serialize;
use stickslip_case::Case;

pub(super) const NOT_SET: &str = "not set";

/// A key of the case with its value in both runs, as in /input/resolved; "not set" if a run does not have it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct CaseDifference {
    /// Dotted path.
    pub key: String,
    /// Value in the reference.
    pub reference: String,
    /// Value in the candidate.
    pub candidate: String,
}

/// Physical keys of two cases whose values differ, in the general form if only one is in the short form. Keys of
/// integration and sampling do not count.
pub(super) fn case_differences(reference: &Case, candidate: &Case) -> Vec<CaseDifference> {
    let is_like = reference.words == candidate.words;
    let text = |case: &Case| match is_like {
        true => case.resolved(),
        false => case.in_general_form().resolved(),
    };
    let (r, c) = (keys(&text(reference)), keys(&text(candidate)));
    let value = |keys: &[(String, String)], key: &str| {
        let found = keys.iter().find(|(name, _)| name == key);
        found.map_or_else(|| NOT_SET.to_owned(), |(_, value)| value.clone())
    };
    let mut names: Vec<&String> = r.iter().map(|(name, _)| name).collect();
    let known = names.len();
    for (name, _) in &c {
        if !names[..known].contains(&name) {
            names.push(name);
        }
    }
    let difference = |name: &String| CaseDifference {
        key: name.clone(),
        reference: value(&r, name),
        candidate: value(&c, name),
    };
    let differences = names.into_iter().map(difference);
    differences.filter(|d| d.reference != d.candidate).collect()
}

fn keys(resolved: &str) -> Vec<(String, String)> {
    let Ok(document) = resolved.parse::<toml_edit::DocumentMut>() else {
        return Vec::new();
    };
    let mut keys = Vec::new();
    for (name, item) in document.iter() {
        match item {
            _ if matches!(name, "solver" | "output") => {}
            toml_edit::Item::Table(table) => add(&mut keys, name, table),
            toml_edit::Item::ArrayOfTables(tables) => {
                for (index, table) in tables.iter().enumerate() {
                    add(&mut keys, &format!("{name}.{index}"), table);
                }
            }
            _ => {}
        }
    }
    keys
}

fn add(keys: &mut Vec<(String, String)>, prefix: &str, table: &toml_edit::Table) {
    for (name, item) in table {
        let path = format!("{prefix}.{name}");
        match item {
            toml_edit::Item::Value(value) => keys.push((path, value.clone().decorated("", "").to_string())),
            toml_edit::Item::Table(table) => add(keys, &path, table),
            _ => {}
        }
    }
}
