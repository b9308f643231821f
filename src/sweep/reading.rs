//! Reading the tables of a study, with every problem on the way by file, line and key.

use crate::case::document::{Node, Value};
use crate::case::{CaseError, Problem, suggest};

/// Collects what is wrong with a study.
pub(crate) struct Reader {
    pub(crate) label: String,
    /// Each with the rank of its place.
    problems: Vec<(usize, Problem)>,
}

impl Reader {
    pub(crate) fn new(label: String) -> Self {
        Reader {
            label,
            problems: Vec::new(),
        }
    }

    /// Reports a problem at the place of `node`.
    pub(crate) fn report(&mut self, node: &Node, key: &str, message: impl Into<String>) {
        self.problems.push((
            node.place.rank(),
            Problem {
                place: node.place.show(&self.label),
                key: key.to_owned(),
                message: message.into(),
            },
        ));
    }

    /// Reports that a node is not what was expected; nothing, in place of what would be read.
    pub(crate) fn expected<T>(&mut self, node: &Node, key: &str, what: &str) -> Option<T> {
        self.report(node, key, format!("expected {what}, but got {}", node.value.describe()));
        None
    }

    pub(crate) fn is_clean(&self) -> bool {
        self.problems.is_empty()
    }

    /// What was found, in the order of the file.
    pub(crate) fn into_error(mut self) -> CaseError {
        self.problems.sort_by_key(|&(rank, _)| rank);
        CaseError {
            problems: self.problems.into_iter().map(|(_, problem)| problem).collect(),
        }
    }

    /// Reports every key of the table that is not among `known`.
    pub(crate) fn check_keys(&mut self, node: &Node, path: &str, known: &[&str]) {
        let Value::Table(entries) = &node.value else {
            return;
        };
        for (name, child) in entries {
            if !known.contains(&name.as_str()) {
                let message = match suggest(name, known.iter().copied()) {
                    Some(close) => format!("unknown key; did you mean {close}?"),
                    None => format!("unknown key; there are {}", known.join(", ")),
                };
                self.report(child, &join(path, name), message);
            }
        }
    }

    /// A text, or nothing with a report.
    pub(crate) fn text(&mut self, node: &Node, path: &str) -> Option<String> {
        match &node.value {
            Value::Text(text) => Some(text.clone()),
            _ => self.expected(node, path, "text in quotes"),
        }
    }

    /// A switch, `default` where it is not given.
    pub(crate) fn flag(&mut self, parent: &Node, table: &str, name: &str, default: bool) -> bool {
        match parent.at(name) {
            None => default,
            Some(Node {
                value: Value::Flag(flag),
                ..
            }) => *flag,
            Some(node) => self
                .expected(node, &join(table, name), "true or false")
                .unwrap_or(default),
        }
    }

    /// A plain number that fits `fits`, or nothing with a report of what was `expected`.
    pub(crate) fn number(
        &mut self,
        node: &Node,
        path: &str,
        expected: &str,
        fits: impl Fn(f64) -> bool,
    ) -> Option<f64> {
        let number = match node.value {
            Value::Integer(number) => Some(number as f64),
            Value::Float(number) => Some(number),
            _ => None,
        };
        let number = number.filter(|&number| number.is_finite() && fits(number));
        number.or_else(|| self.expected(node, path, expected))
    }
}

/// A whole number between two bounds, or nothing with a report.
pub(crate) fn whole_number(reader: &mut Reader, node: &Node, path: &str, least: u64, most: u64) -> Option<u64> {
    let number = match node.value {
        Value::Integer(number) => u64::try_from(number).ok(),
        _ => None,
    };
    let number = number.filter(|number| (least..=most).contains(number));
    number.or_else(|| reader.expected(node, path, &format!("a whole number from {least} to {most}")))
}

/// A key, or a list of keys, as dotted paths with `[0]` written as `.0`.
pub(crate) fn keys_of(reader: &mut Reader, node: &Node, path: &str) -> Option<Vec<String>> {
    let plain = |text: &str| text.trim().replace('[', ".").replace(']', "");
    match &node.value {
        Value::Text(text) => Some(vec![plain(text)]),
        Value::Array(elements) if !elements.is_empty() => {
            let mut keys = Vec::with_capacity(elements.len());
            for element in elements {
                keys.push(plain(&reader.text(element, path)?));
            }
            Some(keys)
        }
        _ => reader.expected(node, path, "a key in quotes, or a list of them"),
    }
}

pub(crate) fn join(path: &str, name: &str) -> String {
    if path.is_empty() {
        name.to_owned()
    } else {
        format!("{path}.{name}")
    }
}
