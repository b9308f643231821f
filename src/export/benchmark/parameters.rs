//! Parameters of the resolved case, with units and meanings from its comments.

use serde::Serialize;
use stickslip_case::input::json_of_value;
use toml_edit::{DocumentMut, Item, Table, Value};

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Parameter {
    /// Dotted key with indices of elements: torsion.damping, perturbation.0.time.
    pub key: String,
    pub value: serde_json::Value,
    /// SI unit; `None` for dimensionless parameters.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub meaning: Option<String>,
}

pub(super) fn read(resolved: &str) -> Vec<Parameter> {
    let mut found = Vec::new();
    if let Ok(document) = resolved.parse::<DocumentMut>() {
        table("", document.as_table(), &mut found);
    }
    found
}

fn table(at: &str, table_here: &Table, found: &mut Vec<Parameter>) {
    for (name, item) in table_here {
        let key = if at.is_empty() {
            name.to_owned()
        } else {
            format!("{at}.{name}")
        };
        match item {
            Item::Value(value) => found.push(parameter(key, value)),
            Item::Table(inner) => table(&key, inner, found),
            Item::ArrayOfTables(list) => {
                for (k, inner) in list.iter().enumerate() {
                    table(&format!("{key}.{k}"), inner, found);
                }
            }
            Item::None => {}
        }
    }
}

fn parameter(key: String, value: &Value) -> Parameter {
    let comment = value
        .decor()
        .suffix()
        .and_then(|suffix| suffix.as_str())
        .unwrap_or_default();
    let comment = comment.trim().trim_start_matches('#').trim();
    // The unit is at the end of the comment.
    let (meaning, unit) = match comment.strip_suffix(']').and_then(|text| text.rsplit_once('[')) {
        Some((meaning, unit)) => (meaning.trim(), Some(unit.to_owned())),
        None => (comment, None),
    };
    Parameter {
        key,
        value: json_of_value(value),
        unit,
        meaning: Some(meaning.to_owned()).filter(|text| !text.is_empty()),
    }
}

pub(super) fn document(parameters: &[Parameter]) -> String {
    let document = serde_json::json!({ "parameters": parameters });
    serde_json::to_string_pretty(&document).unwrap_or_default() + "\n"
}
