//! Specification of a boundary study: plane, criterion on a run's summary, and resolution.

use super::axis::{AxisRange, ParameterAxis};
use super::{PointOutcome, QUANTITIES, asked_for};
use crate::study::{StudyKey, StudyReader, keys};
use stickslip_case::Setting;
use stickslip_case::document::PlacedValue;
use stickslip_system::model::system::System;
use stickslip_system::quote::shown;

/// Condition on one quantity of a run's summary.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Criterion {
    /// Index in the quantities of a run.
    pub quantity: usize,
    /// Comparison of quantity and threshold.
    pub comparison: ThresholdTest,
    /// Threshold in the quantity's unit.
    pub threshold: f64,
}

/// Comparison of a value with a threshold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ThresholdTest {
    /// >=
    AtLeast,
    /// >
    Above,
    /// <=
    AtMost,
    /// <
    Below,
}

const COMPARISONS: [(&str, ThresholdTest); 4] = [
    (">=", ThresholdTest::AtLeast),
    ("<=", ThresholdTest::AtMost),
    (">", ThresholdTest::Above),
    ("<", ThresholdTest::Below),
];

impl Criterion {
    fn parse(system: Option<&System>, text: &str) -> Result<Criterion, String> {
        let Some((sign, comparison)) = COMPARISONS.into_iter().find(|(sign, _)| text.contains(sign)) else {
            return Err(format!(
                "expected a quantity, one of >= > <= <, and a number, as in \"stick_count >= 2\", but got \"{text}\"",
                text = shown(text)
            ));
        };
        let (name, number) = text.split_once(sign).unwrap_or((text, ""));
        let (name, number) = (name.trim(), number.trim());
        let quantity = asked_for(name, system, "", |_| true)?;
        match number.parse::<f64>() {
            Ok(threshold) if threshold.is_finite() => Ok(Criterion {
                quantity,
                comparison,
                threshold,
            }),
            _ => Err(format!(
                "\"{number}\" is not a number; times are in s, as in \"onset_time > 6.975\"",
                number = shown(number)
            )),
        }
    }

    /// Whether a run meets the criterion. A run without the value does not; a failed run is on no side of a boundary.
    pub fn is_met(&self, outcome: &PointOutcome) -> bool {
        let value = outcome.value(self.quantity);
        match self.comparison {
            ThresholdTest::AtLeast => value >= self.threshold,
            ThresholdTest::Above => value > self.threshold,
            ThresholdTest::AtMost => value <= self.threshold,
            ThresholdTest::Below => value < self.threshold,
        }
    }

    /// Text as in a study.
    pub fn text(&self) -> String {
        let sign = COMPARISONS
            .iter()
            .find(|entry| entry.1 == self.comparison)
            .map_or("", |entry| entry.0);
        format!("{} {sign} {}", QUANTITIES[self.quantity].name, self.threshold)
    }
}

/// Specification of a boundary.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundarySpec {
    /// Indices of the two axes of the plane, x and y. Each value of another axis gives its own boundary.
    pub plane: [usize; 2],
    /// Nodes of the first grid along x and y.
    pub nodes: [usize; 2],
    /// Criterion that is met on one side of the boundary.
    pub criterion: Criterion,
    /// Number of halvings of the first grid's cells on the boundary.
    pub refinements: u32,
    /// Width of a bisected crossing, as a fraction of the axis's range (of its logarithm on a log axis).
    pub width: f64,
    /// Values of the growth exponent G for additional contours.
    pub growth_contours: Vec<f64>,
}

impl BoundarySpec {
    /// Ranges of the two axes.
    pub fn ranges(&self, axes: &[ParameterAxis]) -> Option<[AxisRange; 2]> {
        let [x, y] = self.plane.map(|axis| axes[axis].range);
        Some([x?, y?])
    }

    pub(super) fn corner(axes: &[ParameterAxis]) -> Vec<Setting> {
        axes.iter().map(|axis| axis.levels[0].clone()).collect()
    }
}

pub(super) const BOUNDARY_KEYS: &[StudyKey] = keys! {
    "x": "text", "the first range" => "key of the axis x of the plane";
    "y": "text", "the second range" => "key of the axis y of the plane";
    "criterion": "text", DEFAULT_CRITERION => "a quantity, one of >= > <= <, and a number";
    "refinements": "whole number", "2" => "how often the cells on the boundary are halved";
    "width": "number", "1e-4" =>
        "width of a bisected crossing, as a fraction of the axis, of its logarithm on a log axis";
    "growth_contours": "list", "[]" => "values of the growth exponent G with contours of their own";
};

/// Stick-slip as the maps count it.
const DEFAULT_CRITERION: &str = "stick_count >= 2";
const DEFAULT_REFINEMENTS: u64 = 2;
const DEFAULT_WIDTH: f64 = 1e-4;

pub(super) fn read_boundary(
    reader: &mut StudyReader,
    system: Option<&System>,
    node: &PlacedValue,
    axes: &[ParameterAxis],
) -> Option<BoundarySpec> {
    reader.table(node, "boundary", BOUNDARY_KEYS)?;
    let ranges: Vec<usize> = (0..axes.len()).filter(|&k| axes[k].range.is_some()).collect();
    let mut axis = |name: &str, default: Option<usize>| {
        let path = format!("boundary.{name}");
        let Some(given) = node.at(name) else {
            let missing = "missing: a boundary lies in the plane of two axes given by from, to and count";
            return default.or_else(|| reader.refuse(node, &path, missing));
        };
        let key = reader.text(given, &path)?;
        let found = ranges.iter().copied().find(|&k| axes[k].keys[0] == key);
        found.or_else(|| {
            let key = shown(&key);
            let message = format!("\"{key}\" is not the key of an axis given by from, to and count");
            reader.refuse(given, &path, message)
        })
    };
    let x = axis("x", ranges.first().copied());
    let y = axis("y", ranges.iter().copied().find(|&k| Some(k) != x));
    let criterion = match node.at("criterion") {
        None => Criterion::parse(system, DEFAULT_CRITERION).ok(),
        Some(given) => {
            let text = reader.text(given, "boundary.criterion")?;
            reader.found(given, "boundary.criterion", Criterion::parse(system, &text))
        }
    };
    let refinements = reader.whole_or(node, "boundary", "refinements", 0..=10, DEFAULT_REFINEMENTS);
    let expected = "a share of the axis between 1e-12 and 0.1";
    let fits = |width: f64| (1e-12..=0.1).contains(&width);
    let width = reader.number_or(node, ("boundary", "width"), DEFAULT_WIDTH, expected, fits);
    let mut growth_contours = Vec::new();
    if let Some(given) = node.at("growth_contours") {
        let path = "boundary.growth_contours";
        reader.found(given, path, asked_for("growth_exponent", system, "", |_| true))?;
        growth_contours = reader.list(given, path, |reader, element, path| {
            reader.number(element, path, "a positive number of e-folds", |g| g > 0.0)
        })?;
    }
    let (x, y) = (x?, y?);
    if x == y {
        return reader.refuse(node, "boundary.y", "x and y are the same axis");
    }
    if let Some(k) = [x, y].into_iter().find(|&k| axes[k].levels.len() < 3) {
        let message = format!(
            "{} needs a count of at least 3: it is the first grid on which the boundary is looked for",
            axes[k].keys[0]
        );
        return reader.refuse(node, "boundary", message);
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
