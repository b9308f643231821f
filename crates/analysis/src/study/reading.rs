//! Reader of a study's tables: all problems by file, line and key.

use super::head::HEAD_KEYS;
use super::keys::StudyKey;
use std::ops::RangeInclusive;
use stickslip_case::document::{self, CaseValue, PlacedValue, TextPlace};
use stickslip_case::{CaseError, CaseProblem, suggest};

pub(crate) struct StudyReader {
    pub(crate) label: String,
    /// Problems, each with the rank of its place in the file.
    problems: Vec<(usize, CaseProblem)>,
}

impl StudyReader {
    /// Reader of a text with its `label` in messages, and the text's root table, whose keys are those of every study and
    /// `own`.
    pub(crate) fn open(text: &str, label: String, own: &[StudyKey]) -> Result<(StudyReader, PlacedValue), CaseError> {
        let root = document::read(text, &label)?;
        let mut reader = StudyReader {
            label,
            problems: Vec::new(),
        };
        reader.check_keys(&root, "", &[HEAD_KEYS, own].concat());
        Ok((reader, root))
    }

    pub(crate) fn report(&mut self, node: &PlacedValue, key: &str, message: impl Into<String>) {
        self.report_at(&node.place, key, message);
    }

    pub(crate) fn report_at(&mut self, place: &TextPlace, key: &str, message: impl Into<String>) {
        self.problems.push((
            place.rank(),
            CaseProblem {
                place: place.show(&self.label),
                key: key.to_owned(),
                message: message.into(),
            },
        ));
    }

    pub(crate) fn refuse<T>(&mut self, node: &PlacedValue, key: &str, message: impl Into<String>) -> Option<T> {
        self.report(node, key, message);
        None
    }

    pub(crate) fn expected<T>(&mut self, node: &PlacedValue, key: &str, what: &str) -> Option<T> {
        self.refuse(node, key, format!("expected {what}, but got {}", node.value.describe()))
    }

    /// The value; `None` if it is an error, which is then reported.
    pub(crate) fn found<T>(&mut self, node: &PlacedValue, key: &str, value: Result<T, String>) -> Option<T> {
        value.map_err(|message| self.report(node, key, message)).ok()
    }

    pub(crate) fn is_clean(&self) -> bool {
        self.problems.is_empty()
    }

    pub(crate) fn into_error(mut self) -> CaseError {
        self.problems.sort_by_key(|&(rank, _)| rank);
        CaseError {
            problems: self.problems.into_iter().map(|(_, problem)| problem).collect(),
        }
    }

    pub(crate) fn check_keys(&mut self, node: &PlacedValue, path: &str, known: &[StudyKey]) {
        let CaseValue::Table(entries) = &node.value else {
            return;
        };
        let known: Vec<&str> = known.iter().map(|key| key.name).collect();
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

    /// A table with `known` keys; `None` after a report.
    pub(crate) fn table<'a>(
        &mut self,
        node: &'a PlacedValue,
        path: &str,
        known: &[StudyKey],
    ) -> Option<&'a PlacedValue> {
        let CaseValue::Table(_) = node.value else {
            return self.expected(node, path, "a table");
        };
        self.check_keys(node, path, known);
        Some(node)
    }

    /// Tables `[[name]]` with their paths. Reports another kind of node, or `missing` if there is none.
    pub(crate) fn tables<'a>(
        &mut self,
        root: &'a PlacedValue,
        name: &str,
        missing: Option<&str>,
    ) -> Vec<(String, &'a PlacedValue)> {
        let node = root.at(name);
        match node.map(|node| (node, &node.value)) {
            Some((_, CaseValue::Array(elements))) if !elements.is_empty() => {
                let paths = (0..elements.len()).map(|index| format!("{name}.{index}"));
                return paths.zip(elements).collect();
            }
            Some((_, CaseValue::Array(_))) | None => {
                if let Some(missing) = missing {
                    self.report(node.unwrap_or(root), name, missing);
                }
            }
            Some((node, other)) => {
                let message = format!("expected tables: write [[{name}]], not {}", other.describe());
                self.report(node, name, message);
            }
        }
        Vec::new()
    }

    /// Elements of a list by `read`; `None` if one is wrong.
    pub(crate) fn list<T>(
        &mut self,
        node: &PlacedValue,
        path: &str,
        mut read: impl FnMut(&mut StudyReader, &PlacedValue, &str) -> Option<T>,
    ) -> Option<Vec<T>> {
        let CaseValue::Array(elements) = &node.value else {
            return self.expected(node, path, "a list in brackets");
        };
        let read = elements
            .iter()
            .enumerate()
            .map(|(index, element)| read(self, element, &join(path, &index.to_string())));
        // All elements are read, to find all problems.
        read.collect::<Vec<_>>().into_iter().collect()
    }

    pub(crate) fn text(&mut self, node: &PlacedValue, path: &str) -> Option<String> {
        match &node.value {
            CaseValue::Text(text) => Some(text.clone()),
            _ => self.expected(node, path, "text in quotes"),
        }
    }

    /// A switch, off by default.
    pub(crate) fn flag(&mut self, parent: &PlacedValue, table: &str, name: &str) -> bool {
        match parent.at(name).map(|node| (node, &node.value)) {
            None => false,
            Some((_, CaseValue::Flag(flag))) => *flag,
            Some((node, _)) => self
                .expected(node, &join(table, name), "true or false")
                .unwrap_or(false),
        }
    }

    /// A plain number that satisfies `fits`; otherwise `None`, and a report says what was `expected`.
    pub(crate) fn number(
        &mut self,
        node: &PlacedValue,
        path: &str,
        expected: &str,
        fits: impl Fn(f64) -> bool,
    ) -> Option<f64> {
        let number = plain(&node.value).filter(|&number| fits(number));
        number.or_else(|| self.expected(node, path, expected))
    }

    pub(crate) fn whole_number(&mut self, node: &PlacedValue, path: &str, range: RangeInclusive<u64>) -> Option<u64> {
        let number = match node.value {
            CaseValue::Integer(number) => u64::try_from(number).ok(),
            _ => None,
        };
        let number = number.filter(|number| range.contains(number));
        let (least, most) = range.into_inner();
        number.or_else(|| self.expected(node, path, &format!("a whole number from {least} to {most}")))
    }

    pub(crate) fn whole_or(
        &mut self,
        table: &PlacedValue,
        path: &str,
        name: &str,
        range: RangeInclusive<u64>,
        default: u64,
    ) -> Option<u64> {
        table
            .at(name)
            .map_or(Some(default), |node| self.whole_number(node, &join(path, name), range))
    }

    /// The value of a required key, or a report that it is `missing`.
    pub(crate) fn needed<'a>(
        &mut self,
        table: &'a PlacedValue,
        path: &str,
        name: &str,
        missing: &str,
    ) -> Option<&'a PlacedValue> {
        table
            .at(name)
            .or_else(|| self.refuse(table, &join(path, name), missing))
    }

    /// A plain number that satisfies `fits`, by default `default`.
    pub(crate) fn number_or(
        &mut self,
        table: &PlacedValue,
        (path, name): (&str, &str),
        default: f64,
        expected: &str,
        fits: impl Fn(f64) -> bool,
    ) -> Option<f64> {
        let node = table.at(name);
        node.map_or(Some(default), |node| {
            self.number(node, &join(path, name), expected, fits)
        })
    }

    /// Place of a word among `words`, by default of the first one.
    pub(crate) fn choice(
        &mut self,
        table: &PlacedValue,
        (path, name): (&str, &str),
        words: &[&str],
        expected: &str,
    ) -> Option<usize> {
        let Some(node) = table.at(name) else { return Some(0) };
        let found = match &node.value {
            CaseValue::Text(text) => words.iter().position(|word| word == text),
            _ => None,
        };
        found.or_else(|| self.expected(node, &join(path, name), expected))
    }

    /// One key or a list of keys, as dotted paths.
    pub(crate) fn keys(&mut self, node: &PlacedValue, path: &str) -> Option<Vec<String>> {
        let texts = match &node.value {
            CaseValue::Text(text) => vec![text.clone()],
            CaseValue::Array(elements) if !elements.is_empty() => {
                let texts = elements.iter().map(|element| self.text(element, path));
                texts.collect::<Option<_>>()?
            }
            _ => return self.expected(node, path, "a key in quotes, or a list of them"),
        };
        Some(texts.iter().map(|text| dotted(text.trim())).collect())
    }
}

pub(crate) fn plain(value: &CaseValue) -> Option<f64> {
    match value {
        CaseValue::Integer(number) => Some(*number as f64),
        CaseValue::Float(number) => Some(*number).filter(|number| number.is_finite()),
        _ => None,
    }
}

/// Path with `[0]` written as `.0`.
pub(super) fn dotted(path: &str) -> String {
    path.replace('[', ".").replace(']', "")
}

pub(super) fn join(path: &str, name: &str) -> String {
    if path.is_empty() {
        name.to_owned()
    } else {
        format!("{path}.{name}")
    }
}
