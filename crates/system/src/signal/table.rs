//! Linear interpolation between points.

use super::pieces::without_rounding;
use super::{Piece, Profile};

/// Points (time, value), with linear interpolation; constant before the first and after the last. Two points at the
/// same time are a step: the second value holds from that time on.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeTable<T = f64> {
    /// Times, s, in order; at most two are equal.
    pub time: Vec<T>,
    /// Value at each time, in the unit of the driven quantity.
    pub value: Vec<T>,
}

impl<T> TimeTable<T> {
    pub(super) fn try_map<U, E>(
        &self,
        number: &mut impl FnMut(&'static str, Option<usize>, &T) -> Result<U, E>,
    ) -> Result<TimeTable<U>, E> {
        let mut list = |name: &'static str, values: &[T]| -> Result<Vec<U>, E> {
            let numbers = values.iter().enumerate();
            numbers.map(|(index, value)| number(name, Some(index), value)).collect()
        };
        Ok(TimeTable {
            time: list("time", &self.time)?,
            value: list("value", &self.value)?,
        })
    }
}

impl Profile for TimeTable {
    const NAME: &'static str = "table";

    fn blank() -> TimeTable {
        TimeTable {
            time: Vec::new(),
            value: Vec::new(),
        }
    }

    /// Points before t = 0 are cut off.
    fn stretches(&self) -> Vec<Piece> {
        let TimeTable { time, value } = self;
        let mut stretches = Vec::with_capacity(time.len() + 1);
        if time[0] > 0.0 {
            stretches.push(Piece {
                end: time[0],
                ..Piece::constant(0.0, value[0])
            });
        }
        for k in 0..time.len() {
            let Some(&next) = time.get(k + 1) else {
                stretches.push(Piece::constant(time[k].max(0.0), value[k]));
                break;
            };
            // A step has no stretch of its own.
            if next <= 0.0 || next == time[k] {
                continue;
            }
            let slope = (value[k + 1] - value[k]) / (next - time[k]);
            let start = time[k].max(0.0);
            stretches.push(Piece {
                start,
                end: next,
                value: without_rounding(value[k], slope * (start - time[k])),
                end_value: value[k + 1],
                slope,
            });
        }
        stretches
    }
}
