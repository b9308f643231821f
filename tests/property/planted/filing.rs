//! What a program may do to a right motion when it stores or processes it.

use std::f64::consts::TAU;

/// Processing of the rows of a motion at even intervals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Filing {
    /// A constant is added to a column (from 0).
    Offset(usize, f64),
    /// The times are multiplied.
    Rate(f64),
    /// Each row is the mean of so many rows, of which it is the last. The first rows are left out.
    Average(usize),
    /// Each row is the sum of so many rows around it, divided by their number; beyond the ends they are zero:
    /// `np.convolve(x, np.ones(n)/n, "same")`.
    Same(usize),
    /// y' = (x - y)/T, whose corner frequency (Hz) is 1/(2 pi T).
    LowPass(f64),
    /// Speeds are those of half an interval after their row (1), or before it (-1).
    HalfStep(i8),
    /// Two columns are exchanged.
    Swapped(usize, usize),
    /// Each row stands so many times, while the time goes on.
    Repeated(usize),
}

pub(super) fn is_speed(name: &str) -> bool {
    let marks = ["_speed", "_dot", "_rate", "velocity"];
    name == "v" || marks.iter().any(|mark| name.contains(mark))
}

impl Filing {
    /// Rows of the motion in an interval of the file.
    pub fn rows_in_an_interval(self) -> usize {
        match self {
            Filing::HalfStep(_) => 2,
            _ => 1,
        }
    }

    /// Processes the times and the columns with these names. A row is lost where a filter does not know it.
    pub fn apply(self, time: &mut Vec<f64>, columns: &mut [Vec<f64>], names: &[&str]) {
        match self {
            Filing::Offset(place, constant) => columns[place].iter_mut().for_each(|value| *value += constant),
            Filing::Rate(rate) => time.iter_mut().for_each(|time| *time *= rate),
            Filing::Average(count) => {
                time.drain(..count - 1);
                for column in columns {
                    let means = column
                        .windows(count)
                        .map(|rows| rows.iter().sum::<f64>() / count as f64);
                    *column = means.collect();
                }
            }
            Filing::Same(count) => {
                for column in columns {
                    let around =
                        |row: usize| row.saturating_sub(count / 2)..(row + count.div_ceil(2)).min(column.len());
                    let mean = |row: usize| column[around(row)].iter().sum::<f64>() / count as f64;
                    *column = (0..column.len()).map(mean).collect();
                }
            }
            Filing::LowPass(corner) => {
                let share = 1.0 - (-TAU * corner * (time[1] - time[0])).exp();
                for column in columns {
                    let mut filtered = column[0];
                    for value in column {
                        filtered += share * (*value - filtered);
                        *value = filtered;
                    }
                }
            }
            Filing::HalfStep(side) => {
                let every = |column: &[f64], by: isize| -> Vec<f64> {
                    let rows = (0..column.len()).step_by(2);
                    let inside = |row: usize| row.saturating_add_signed(by).min(column.len() - 1);
                    rows.map(|row| column[inside(row)]).collect()
                };
                *time = every(time, 0);
                for (column, name) in columns.iter_mut().zip(names) {
                    *column = every(column, if is_speed(name) { isize::from(side) } else { 0 });
                }
            }
            Filing::Swapped(one, other) => columns.swap(one, other),
            Filing::Repeated(count) => {
                for column in columns {
                    *column = (0..column.len()).map(|row| column[row - row % count]).collect();
                }
            }
        }
    }
}
