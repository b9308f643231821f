//! Which points of a study are drawn.

use super::data::StudyData;
use super::{Choice, refused};
use crate::plot::PlotError;

/// Points, and what they have in common.
pub(super) struct Selection {
    /// Places of the points.
    pub points: Vec<usize>,
    /// What is held, in words.
    pub held: Vec<String>,
}

/// The points at which axes have the values that are asked for.
pub(super) fn selected(data: &StudyData, choice: &Choice) -> Result<Selection, PlotError> {
    let mut points: Vec<usize> = (0..data.status.len()).collect();
    let mut held = Vec::new();
    for (name, text) in &choice.at {
        let axis = &data.axes[data.axis(name)?];
        let wish = match axis.words.iter().position(|word| word == text) {
            Some(code) => code as f64,
            None => text.parse().unwrap_or(f64::NAN),
        };
        // By the size of the value: every value is within a millionth of an infinite wish.
        let close = |value: f64| (value - wish).abs() <= 1e-6 * value.abs();
        let Some(value) = axis.values.iter().copied().find(|value| close(*value)) else {
            let mut levels = axis.values.clone();
            levels.sort_by(f64::total_cmp);
            levels.dedup();
            let more = if levels.len() > 12 { ", ..." } else { "" };
            let levels: Vec<String> = levels.iter().take(12).map(|level| axis.said(*level)).collect();
            return Err(refused(
                data,
                format!(
                    "no point has {}={text}; there are {}{more}",
                    axis.keys[0],
                    levels.join(", ")
                ),
            ));
        };
        points.retain(|&point| axis.values[point] == value);
        held.push(axis.said(value));
    }
    if points.is_empty() {
        return Err(refused(
            data,
            "no point has all of these values; ask for fewer with --at".to_owned(),
        ));
    }
    Ok(Selection { points, held })
}
