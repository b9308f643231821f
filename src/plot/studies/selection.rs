//! The points of a study to draw.

use super::data::{StudyData, levels};
use super::{Choice, refused};
use crate::Error;

pub(super) struct Selection {
    pub points: Vec<usize>,
    /// Axes that are held constant, in words.
    pub held: Vec<String>,
}

impl Selection {
    pub(super) fn said(&self) -> String {
        match self.held.is_empty() {
            true => String::new(),
            false => format!(", at {}", self.held.join(", ")),
        }
    }
}

pub(super) fn selected(data: &StudyData, choice: &Choice) -> Result<Selection, Error> {
    let mut points: Vec<usize> = (0..data.status.len()).collect();
    let mut held = Vec::new();
    for (name, text) in &choice.at {
        let axis = &data.axes[data.axis(name)?];
        let wish = match axis.words.iter().position(|word| word == text) {
            Some(code) => code as f64,
            None => text.parse().unwrap_or(f64::NAN),
        };
        // Relative to the value, so that no value is close to infinity.
        let close = |value: f64| (value - wish).abs() <= 1e-6 * value.abs();
        let Some(value) = axis.values.iter().copied().find(|value| close(*value)) else {
            let levels = levels(axis.values.iter().copied());
            let more = if levels.len() > 12 { ", ..." } else { "" };
            let levels: Vec<String> = levels.iter().take(12).map(|level| axis.said(*level)).collect();
            let (key, levels) = (&axis.keys[0], levels.join(", "));
            return refused(data, format!("no point has {key}={text}; there are {levels}{more}"));
        };
        points.retain(|&point| axis.values[point] == value);
        held.push(axis.said(value));
    }
    if points.is_empty() {
        return refused(data, "no point has all of these values; ask for fewer with --at");
    }
    Ok(Selection { points, held })
}
