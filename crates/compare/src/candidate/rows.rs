//! Rows of a candidate in SI units, checked while they are read.

use super::super::reference::Physics;
use super::super::resolution::{Clock, ClockWatch, Digital, Rounding};
use super::super::vocabulary::{Known, Sum};
use super::super::{Channel, CompareError};
use super::table::{CandidateTable, Pass, place};

/// Consecutive samples of a candidate, in SI units and radians.
#[derive(Debug, Clone, Default)]
pub struct Block {
    /// Times, s, strictly increasing.
    pub time: Vec<f64>,
    /// One column for each channel, as long as `time`.
    pub columns: Vec<Vec<f64>>,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Supply {
    pub channel: Channel,
    sum: Sum,
}

impl Supply {
    /// The motion of driven ends that it contains, which the reference supplies.
    pub fn drive(&self) -> &[(Known, f64)] {
        &self.sum.known
    }

    /// Whether it is a sum, of several columns or of one and the motion of a driven end.
    pub fn is_computed(&self) -> bool {
        self.sum.terms.len() > 1 || !self.drive().is_empty()
    }

    /// Largest change of the motion of the driven ends in it over a time (s), at times of a span (s) without a corner.
    pub fn change_of_drive(&self, physics: &Physics, (from, to): (f64, f64), over: f64) -> f64 {
        const TIMES: usize = 1000;
        let driven = |time: f64| {
            let parts = self.sum.known.iter();
            parts
                .map(|(known, factor)| factor * physics.driven(*known, time))
                .sum::<f64>()
        };
        let times = (0..TIMES).map(|k| from + (to - over - from) * k as f64 / TIMES as f64);
        let next_corner = |time: f64| physics.course.next_corner(time).unwrap_or(f64::INFINITY);
        let smooth = times.filter(|&time| next_corner(time) > time + over);
        smooth
            .map(|time| (driven(time + over) - driven(time)).abs())
            .fold(0.0, f64::max)
    }

    /// Columns and factors of the sum.
    pub fn terms(&self) -> &[(usize, f64)] {
        &self.sum.terms
    }

    pub fn columns(&self) -> impl Iterator<Item = usize> + '_ {
        self.sum.terms.iter().map(|term| term.0)
    }

    /// Error bound of a value due to rounding in the file. A sum may be much smaller than its terms.
    pub fn rounding(&self, value: f64, digital: &[Digital]) -> f64 {
        let error = |&(column, factor): &(usize, f64)| {
            let digital = digital.get(column).copied().unwrap_or_default();
            let size = match self.is_computed() {
                false => value / factor,
                true => digital.largest,
            };
            factor.abs() * digital.error(size)
        };
        self.sum.terms.iter().map(error).sum()
    }

    pub fn direct(channel: Channel, factor: f64, column: usize) -> Supply {
        let terms = vec![(column, factor)];
        let known = Vec::new();
        Supply {
            channel,
            sum: Sum { terms, known },
        }
    }
}

pub(super) fn derive(supplies: &mut Vec<Supply>, physics: &Physics) {
    let direct = supplies.clone();
    let channels: Vec<Channel> = direct.iter().map(|supply| supply.channel).collect();
    for (channel, mut sum) in physics.vocabulary().derived(&channels) {
        for (place, sign) in &mut sum.terms {
            let (column, factor) = direct[*place].sum.terms[0];
            (*place, *sign) = (column, *sign * factor);
        }
        supplies.push(Supply { channel, sum });
    }
}

pub(crate) struct Rows<'a> {
    table: &'a CandidateTable,
    pass: Pass<'a>,
    names: Vec<String>,
    raw: Vec<Vec<f64>>,
    clock: &'a Clock,
    watch: ClockWatch,
    supplies: Vec<Supply>,
    physics: &'a Physics,
    row: u64,
    last: f64,
}

impl<'a> Rows<'a> {
    pub(super) fn new(
        table: &'a CandidateTable,
        columns: &[String],
        clock: &'a Clock,
        mut supplies: Vec<Supply>,
        physics: &'a Physics,
    ) -> Result<Rows<'a>, CompareError> {
        let mut names = vec![columns[0].clone()];
        for (column, _) in supplies.iter_mut().flat_map(|supply| &mut supply.sum.terms) {
            let name = &columns[*column];
            *column = names.iter().position(|known| known == name).unwrap_or_else(|| {
                names.push(name.clone());
                names.len() - 1
            });
        }
        Ok(Rows {
            table,
            pass: table.pass(&names)?,
            raw: vec![Vec::new(); names.len()],
            names,
            clock,
            watch: ClockWatch::default(),
            supplies,
            physics,
            row: 0,
            last: f64::NEG_INFINITY,
        })
    }

    /// Replaces `block` by the next rows; `false` at the end. Fails at a time that does not increase and at a value
    /// that is not finite.
    pub fn next(&mut self, block: &mut Block) -> Result<bool, CompareError> {
        // All rows of a block may repeat the time before it.
        let mut taken = 0;
        let rows = loop {
            self.row += taken;
            (self.pass)(&mut self.raw)?;
            taken = self.raw[0].len() as u64;
            self.finite()?;
            block.time.clear();
            block.time.extend(self.raw[0].iter().map(|&raw| self.clock.time(raw)));
            self.check_range(&block.time, &self.names[0])?;
            self.check_times(&mut block.time)?;
            if !block.time.is_empty() || taken == 0 {
                break block.time.len();
            }
        };
        block.columns.resize(self.supplies.len(), Vec::new());
        for (supply, column) in self.supplies.iter().zip(&mut block.columns) {
            column.clear();
            match supply.sum.terms[..] {
                [(k, 1.0)] => column.extend_from_slice(&self.raw[k]),
                [(k, f)] => column.extend(self.raw[k].iter().map(|x| f * x)),
                [(k, f), (l, g)] => column.extend(self.raw[k].iter().zip(&self.raw[l]).map(|(x, y)| f * x + g * y)),
                ref terms => {
                    let sum = |row: usize| terms.iter().map(|&(k, f)| f * self.raw[k][row]).sum::<f64>();
                    column.extend((0..rows).map(sum));
                }
            }
            for (known, factor) in &supply.sum.known {
                for (value, &time) in column.iter_mut().zip(&block.time) {
                    *value += factor * self.physics.driven(*known, time);
                }
            }
            self.check_range(column, &supply.channel.name())?;
        }
        self.row += taken;
        Ok(rows > 0)
    }

    pub(crate) fn watch(&self) -> &ClockWatch {
        &self.watch
    }

    fn finite(&self) -> Result<(), CompareError> {
        for (column, name) in self.raw.iter().zip(&self.names) {
            if let Some(row) = not_finite(column) {
                let what = format!("{} is not a finite number", column[row]);
                return Err(self.fault(row, name, what, "leave out the row, or the column"));
            }
        }
        Ok(())
    }

    fn check_range(&self, values: &[f64], name: &str) -> Result<(), CompareError> {
        not_finite(values).map_or(Ok(()), |row| {
            let what = "is beyond the largest number in SI units".to_owned();
            Err(self.fault(row, name, what, "check the values and their unit"))
        })
    }

    fn fault(&self, row: usize, column: &str, what: String, remedy: &str) -> CompareError {
        let place = place(self.row + row as u64, column);
        CompareError::content(&self.table.path, place, what, remedy)
    }

    /// Checks that times increase. If they are rounded, rows that repeat a time are dropped. Otherwise the first and the
    /// last row of one time are the states before and after an event: if they differ, the first one is moved to the
    /// double below the time, so that times increase. The state before an event at the very start is left out.
    fn check_times(&mut self, times: &mut Vec<f64>) -> Result<(), CompareError> {
        let Some(&first) = times.first() else {
            return Ok(());
        };
        if let Some(rounding) = self.clock.rounding {
            self.raw[0].iter().for_each(|&raw| self.watch.add(rounding, raw));
        }
        // No branch in the loop, for speed.
        let increasing = times.windows(2).fold(true, |sound, pair| sound & (pair[0] < pair[1]));
        if increasing && first > self.last {
            self.last = times[times.len() - 1];
            return Ok(());
        }
        let repeats = self.clock.rounding.is_some_and(Rounding::repeats);
        let too_few = if repeats { None } else { too_few_digits(&self.raw[0]) };
        let mut kept: Vec<(usize, f64)> = Vec::with_capacity(times.len());
        let mut row = 0;
        while row < times.len() {
            let time = times[row];
            let count = times[row..].iter().take_while(|other| **other == time).count();
            if repeats {
                let is_new = time > self.last;
                self.watch.repeated += count as u64 - u64::from(is_new);
                kept.extend(is_new.then_some((row, time)));
            }
            if time < self.last {
                let what = format!("the time {time:?} s comes after {:?} s", self.last);
                return Err(self.fault(row, &self.names[0], what, "sort the rows by time"));
            }
            if !repeats {
                if (count > 1 || time == self.last)
                    && let Some((digits, repeated)) = too_few
                {
                    let what = format!(
                        "the times have {digits} digits, too few for the samples: {time:?} s is there twice, and so are {} others",
                        repeated - 1
                    );
                    let remedy = "write them with 17 digits, in Python with \"%.17g\"";
                    return Err(self.fault(row + usize::from(count > 1), &self.names[0], what, remedy));
                }
                let before = kept.last().map_or(self.last, |last| last.1);
                let end = row + count - 1;
                let differ = self.raw.iter().skip(1).any(|column| column[row] != column[end]);
                // The block before may have ended with the state before the event.
                let (left, right) = match time == self.last {
                    true => (None, time.next_up()),
                    false => (differ.then(|| time.next_down()), time),
                };
                let is_between = |left: &f64| before.is_finite() && *left > before;
                kept.extend(left.filter(is_between).map(|left| (row, left)));
                kept.extend((right > before).then_some((end, right)));
            }
            self.last = time;
            row += count;
        }
        *times = kept.iter().map(|&(_, time)| time).collect();
        for column in &mut self.raw {
            *column = kept.iter().map(|&(row, _)| column[row]).collect();
        }
        Ok(())
    }
}

fn not_finite(values: &[f64]) -> Option<usize> {
    // No branch in the loop, for speed.
    let sound = values.iter().fold(true, |sound, x| sound & x.is_finite());
    (!sound).then(|| values.iter().position(|x| !x.is_finite())).flatten()
}

/// Number of digits of the times and number of repeated times, if too few digits explain the repetitions: several times
/// repeat, and none has more digits than a single-precision number is usually printed with.
fn too_few_digits(times: &[f64]) -> Option<(usize, usize)> {
    const MOST_DIGITS: usize = 9;
    const SEVERAL: usize = 3;
    let repeated = times.windows(2).filter(|pair| pair[0] == pair[1]).count();
    if repeated < SEVERAL {
        return None;
    }
    let digits = |time: &f64| {
        let text = format!("{time:e}");
        let mantissa = text.split('e').next().unwrap_or_default();
        mantissa.chars().filter(char::is_ascii_digit).count()
    };
    let most = times.iter().map(digits).max()?;
    (most <= MOST_DIGITS).then_some((most, repeated))
}
