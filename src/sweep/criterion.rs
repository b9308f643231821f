//! What a study of a boundary asks for: a plane, a criterion on the summary of a run, and how finely.

use super::axis::{Axis, Range};
use super::quantities::{Outcome, Quantity, quantities, unknown_quantity};
use super::reading::{Reader, whole_number};
use crate::case::document::{Node, Value};
use crate::case::{Setting, Words};
use crate::quote::shown;

/// A condition on one quantity of a run's summary.
#[derive(Clone, Copy, PartialEq)]
pub struct Criterion {
    /// Place among the quantities of the study.
    pub quantity: usize,
    of: &'static Quantity,
    /// Between quantity and value.
    pub comparison: Comparison,
    /// In the quantity's unit.
    pub threshold: f64,
}

/// What decides it: part of what identifies a study.
impl std::fmt::Debug for Criterion {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("Criterion")
            .field("quantity", &self.quantity)
            .field("comparison", &self.comparison)
            .field("threshold", &self.threshold)
            .finish()
    }
}

/// How a value is held against a threshold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Comparison {
    /// >=
    AtLeast,
    /// >
    Above,
    /// <=
    AtMost,
    /// <
    Below,
}

const COMPARISONS: [(&str, Comparison); 4] = [
    (">=", Comparison::AtLeast),
    ("<=", Comparison::AtMost),
    (">", Comparison::Above),
    ("<", Comparison::Below),
];

impl Criterion {
    /// Reads a text such as `stick_count >= 2`, on a run with these quantities.
    ///
    /// # Errors
    /// A text that says what was expected instead.
    pub fn parse(words: Words, text: &str) -> Result<Criterion, String> {
        let Some((sign, comparison)) = COMPARISONS.into_iter().find(|(sign, _)| text.contains(sign)) else {
            return Err(format!(
                "expected a quantity, one of >= > <= <, and a number, as in \"stick_count >= 2\", but got \"{text}\"",
                text = shown(text)
            ));
        };
        let (name, number) = text.split_once(sign).unwrap_or((text, ""));
        let (name, number) = (name.trim(), number.trim());
        let Some(quantity) = quantities(words).iter().position(|quantity| quantity.name == name) else {
            return Err(unknown_quantity(words, name, "", |_| true));
        };
        match number.parse::<f64>() {
            Ok(threshold) if threshold.is_finite() => Ok(Criterion {
                quantity,
                of: &quantities(words)[quantity],
                comparison,
                threshold,
            }),
            _ => Err(format!(
                "\"{number}\" is not a number; times are in s, as in \"onset_time > 6.975\"",
                number = shown(number)
            )),
        }
    }

    /// Whether a run meets it; a run that failed or has no such value does not. What a run that failed would have come
    /// to is not known, so its side is no side of a boundary.
    pub fn is_met(&self, outcome: &Outcome) -> bool {
        let value = outcome.value(self.quantity);
        match self.comparison {
            Comparison::AtLeast => value >= self.threshold,
            Comparison::Above => value > self.threshold,
            Comparison::AtMost => value <= self.threshold,
            Comparison::Below => value < self.threshold,
        }
    }

    /// As it is written.
    pub fn text(&self) -> String {
        let sign = COMPARISONS
            .iter()
            .find(|entry| entry.1 == self.comparison)
            .map_or("", |entry| entry.0);
        format!("{} {sign} {}", self.of.name, self.threshold)
    }
}

/// How a boundary is traced.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundarySpec {
    /// Indices of the two axes of the plane, x and y; any other axis gives one boundary for each of its values.
    pub plane: [usize; 2],
    /// Nodes of the first grid along x and y.
    pub nodes: [usize; 2],
    /// Met on one side of the boundary.
    pub criterion: Criterion,
    /// How often a cell of the first grid that the boundary crosses is halved.
    pub refinements: u32,
    /// Width to which a crossing is bisected, as a share of the axis' range (of its logarithm on a log axis).
    pub width: f64,
    /// Values of the growth exponent G whose contours are given beside.
    pub growth_contours: Vec<f64>,
}

impl BoundarySpec {
    /// The two ranges of the plane.
    pub fn ranges(&self, axes: &[Axis]) -> Option<[Range; 2]> {
        let [x, y] = self.plane.map(|axis| axes[axis].range);
        Some([x?, y?])
    }

    /// The first corner of the first plane.
    pub(super) fn corner(axes: &[Axis]) -> Vec<Setting> {
        axes.iter().map(|axis| axis.levels[0].clone()).collect()
    }
}

const BOUNDARY_KEYS: &[&str] = &["x", "y", "criterion", "refinements", "width", "growth_contours"];

/// Stick-slip, as the maps count it.
const DEFAULT_CRITERION: &str = "stick_count >= 2";
const DEFAULT_REFINEMENTS: u64 = 2;
const DEFAULT_WIDTH: f64 = 1e-4;

/// Reads `[boundary]`.
pub(super) fn read_boundary(reader: &mut Reader, words: Words, node: &Node, axes: &[Axis]) -> Option<BoundarySpec> {
    if let Value::Table(_) = node.value {
        reader.check_keys(node, "boundary", BOUNDARY_KEYS);
    } else {
        reader.report(
            node,
            "boundary",
            format!("expected a table, but got {}", node.value.describe()),
        );
        return None;
    }
    let ranges: Vec<usize> = (0..axes.len()).filter(|&k| axes[k].range.is_some()).collect();
    let mut axis = |name: &str, default: Option<usize>| {
        let path = format!("boundary.{name}");
        match node.at(name) {
            None if default.is_none() => {
                reader.report(
                    node,
                    &path,
                    "missing: a boundary lies in the plane of two axes given by from, to and count",
                );
                None
            }
            None => default,
            Some(given) => {
                let key = reader.text(given, &path)?;
                let found = ranges.iter().copied().find(|&k| axes[k].keys[0] == key);
                if found.is_none() {
                    reader.report(
                        given,
                        &path,
                        format!(
                            "\"{key}\" is not the key of an axis given by from, to and count",
                            key = shown(&key)
                        ),
                    );
                }
                found
            }
        }
    };
    let x = axis("x", ranges.first().copied());
    let y = axis("y", ranges.iter().copied().find(|&k| Some(k) != x));
    let criterion = match node.at("criterion") {
        None => Criterion::parse(words, DEFAULT_CRITERION).ok(),
        Some(given) => {
            let text = reader.text(given, "boundary.criterion")?;
            Criterion::parse(words, &text)
                .map_err(|message| reader.report(given, "boundary.criterion", message))
                .ok()
        }
    };
    let refinements = match node.at("refinements") {
        None => Some(DEFAULT_REFINEMENTS),
        Some(given) => whole_number(reader, given, "boundary.refinements", 0, 10),
    };
    let width = match node.at("width") {
        None => Some(DEFAULT_WIDTH),
        Some(given) => reader.number(
            given,
            "boundary.width",
            "a share of the axis between 1e-12 and 0.1",
            |w| (1e-12..=0.1).contains(&w),
        ),
    };
    let mut growth_contours = Vec::new();
    if let Some(given) = node.at("growth_contours") {
        if !words.lists_growth() {
            let message = "contours of the growth exponent belong to studies whose base case is in the short form, [torsion]: write the \
                           brake so, or remove them (the line where steady sliding loses its stability is given beside)";
            reader.report(given, "boundary.growth_contours", message);
            return None;
        }
        let Value::Array(elements) = &given.value else {
            reader.report(
                given,
                "boundary.growth_contours",
                "expected a list of values of G, as in [20, 40, 60]",
            );
            return None;
        };
        for element in elements {
            let path = "boundary.growth_contours";
            growth_contours.push(reader.number(element, path, "a positive number of e-folds", |g| g > 0.0)?);
        }
    }
    let (x, y) = (x?, y?);
    if x == y {
        reader.report(node, "boundary.y", "x and y are the same axis");
        return None;
    }
    for k in [x, y] {
        if axes[k].levels.len() < 3 {
            let message = format!(
                "{} needs a count of at least 3: it is the first grid on which the boundary is looked for",
                axes[k].keys[0]
            );
            reader.report(node, "boundary", message);
            return None;
        }
    }
    Some(BoundarySpec {
        plane: [x, y],
        nodes: [axes[x].levels.len(), axes[y].levels.len()],
        criterion: criterion?,
        refinements: refinements? as u32,
        width: width?,
        growth_contours,
    })
}
