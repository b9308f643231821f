//! A candidate's rows as functions of time, and means of what they give.

use super::super::candidate::plain::Plain;
use super::set::Extreme;

/// Rows nearer to a point of the grid than this part of the grid's step are at it.
const SAME_TIME: f64 = 1e-9;

/// Rows of a candidate.
#[derive(Debug)]
pub(super) struct Rows<'a> {
    grid: &'a [f64],
    pub time: &'a [f64],
    columns: &'a [(String, Vec<f64>)],
    /// A column that follows from others.
    derived: Option<(&'static str, Vec<f64>)>,
}

impl<'a> Rows<'a> {
    pub fn new(grid: &'a [f64], table: &'a Plain) -> Rows<'a> {
        Rows {
            grid,
            time: &table.time,
            columns: &table.columns,
            derived: None,
        }
    }

    /// Adds a column that follows from others.
    pub fn add(&mut self, name: &'static str, values: Vec<f64>) {
        self.derived = Some((name, values));
    }

    pub fn is_derived(&self, name: &str) -> bool {
        self.derived.as_ref().is_some_and(|derived| derived.0 == name)
    }

    pub fn names(&self) -> impl Iterator<Item = &str> {
        let own = self.columns.iter().map(|column| column.0.as_str());
        own.chain(self.derived.iter().map(|derived| derived.0))
    }

    pub fn column(&self, name: &str) -> Option<&[f64]> {
        let own = self
            .columns
            .iter()
            .find(|column| column.0 == name)
            .map(|column| &column.1[..]);
        own.or_else(|| {
            self.derived
                .as_ref()
                .filter(|derived| derived.0 == name)
                .map(|derived| &derived.1[..])
        })
    }

    /// First and last time, s.
    pub fn span(&self) -> (f64, f64) {
        let [first, last] = [self.time.first(), self.time.last()].map(|time| time.copied().unwrap_or(0.0));
        (first, last)
    }

    /// The smaller interval beside point k of the grid, s.
    fn step(&self, k: usize) -> f64 {
        let grid = self.grid;
        let before = if k > 0 { grid[k] - grid[k - 1] } else { f64::INFINITY };
        let after = if k + 1 < grid.len() {
            grid[k + 1] - grid[k]
        } else {
            f64::INFINITY
        };
        before.min(after)
    }

    /// The rows (first and end) from which a value at point k of the grid follows; `None` outside of the rows.
    pub fn place_of(&self, k: usize) -> Option<(usize, usize)> {
        self.place(self.grid[k], SAME_TIME * self.step(k))
    }

    fn place(&self, time: f64, near: f64) -> Option<(usize, usize)> {
        let times = self.time;
        let after = times.partition_point(|known| *known < time);
        let mut close = after.min(times.len().checked_sub(1)?);
        if after > 0 && (after == times.len() || time - times[after - 1] <= times[after] - time) {
            close = after - 1;
        }
        if (times[close] - time).abs() <= near {
            return Some((close, close + 1));
        }
        (after > 0 && after < times.len()).then(|| (after.saturating_sub(2), (after + 2).min(times.len())))
    }

    /// The value of a column that there is, at `time` (s): that of one row, or of the polynomial through several.
    pub fn value(&self, name: &str, (first, end): (usize, usize), time: f64) -> f64 {
        let column = self.column(name).unwrap_or_default();
        let mut values = column[first..end].to_vec();
        // By Neville's scheme.
        for width in 1..values.len() {
            for k in 0..values.len() - width {
                let (near, far) = (self.time[first + k], self.time[first + k + width]);
                let part = (time - near) / (far - near);
                values[k] += part * (values[k + 1] - values[k]);
            }
        }
        values[0]
    }

    /// The value of a column at any time (s) within the rows.
    pub fn at(&self, name: &str, time: f64) -> Option<f64> {
        let place = self.place(time, SAME_TIME * self.step(nearest(self.grid, time)?))?;
        Some(self.value(name, place, time))
    }

    /// The extreme value of a column between two times (s), by the parabola through three rows.
    pub fn extremum(&self, name: &str, what: Extreme, [start, end]: [f64; 2]) -> Option<f64> {
        let (times, column, near) = (self.time, self.column(name)?, SAME_TIME * (end - start));
        let sign = if what == Extreme::Maximum { 1.0 } else { -1.0 };
        let first = times.partition_point(|time| *time < start - near);
        let last = times.partition_point(|time| *time <= end + near).checked_sub(1)?;
        if first > last || *times.first()? > start + near || *times.last()? < end - near {
            return None;
        }
        let best = (first + 1..=last).fold(first, |best, k| {
            if sign * column[k] > sign * column[best] {
                k
            } else {
                best
            }
        });
        let top = column[best];
        if !(first < best && best < last && column[best - 1] != top && column[best + 1] != top) {
            return Some(top);
        }
        let (before, after) = (times[best] - times[best - 1], times[best + 1] - times[best]);
        let (rise, fall) = ((top - column[best - 1]) / before, (column[best + 1] - top) / after);
        let bend = (fall - rise) / (before + after);
        let slope = (rise * after + fall * before) / (before + after);
        Some(if bend == 0.0 {
            top
        } else {
            top - slope * slope / (4.0 * bend)
        })
    }
}

/// The index of the nearest time; of two that are equally near, the earlier one.
pub(super) fn nearest(times: &[f64], time: f64) -> Option<usize> {
    let after = times.partition_point(|known| *known < time);
    let earlier = after == times.len() || (after > 0 && time - times[after - 1] <= times[after] - time);
    if earlier { after.checked_sub(1) } else { Some(after) }
}

/// Root mean square.
pub(super) fn rms(values: &[f64]) -> f64 {
    let total: f64 = values.iter().fold(0.0, |sum, value| sum + value * value);
    (total / values.len() as f64).sqrt()
}

/// The mean, and the root mean square about it.
pub(super) fn mean_and_size(values: &[f64]) -> (f64, f64) {
    let mean = values.iter().fold(0.0, |sum, value| sum + value) / values.len() as f64;
    let about: Vec<f64> = values.iter().map(|value| value - mean).collect();
    (mean, rms(&about))
}

/// error/size. 0 if the error is 0; `None` if the size is 0.
pub(super) fn relative(error: f64, size: f64) -> Option<f64> {
    match error == 0.0 {
        true => Some(0.0),
        false => (size > 0.0).then(|| error / size),
    }
}
