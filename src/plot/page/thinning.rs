//! Which samples of a long run are kept, and what stands for the others.
//!
//! The trajectory becomes a sequence of entries. An entry is either one sample, as it is in the file, or a
//! bucket: the least and the largest value of every channel over some consecutive samples. A run that fits is
//! kept whole. Of one that does not, the samples around the events are kept, and buckets take the rest, so that no
//! extreme of any channel is lost at any zoom.

use crate::results::ResultError;
use std::ops::Range;

/// Samples kept on each side of an event, at least.
const LEAST_REACH: usize = 16;
/// The part of the room for samples around events; buckets have the rest.
const NEAR_EVENTS: f64 = 0.75;

/// Consecutive rows of the trajectory that are kept in the same way.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Stretch {
    pub(super) rows: Range<usize>,
    /// Rows in a bucket (fewer in the last); `None` where every sample is kept.
    pub(super) bucket: Option<usize>,
}

impl Stretch {
    pub(super) fn entries(&self) -> usize {
        self.rows.len().div_ceil(self.bucket.unwrap_or(1))
    }
}

/// How every row of a trajectory is kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Plan {
    /// In order, without gaps.
    pub(super) stretches: Vec<Stretch>,
    /// How many events have the samples around them: all, unless there are too many.
    pub(super) events_covered: usize,
}

impl Plan {
    /// Of `rows` samples as many as fit into the room that `room` samples take; a bucket takes as much as two.
    /// `events` are the rows at which events are, in order; rows from `whole`, which goes to the last, are kept before
    /// those around events: as many of the last of them as half of that room takes.
    pub(super) fn new(rows: usize, events: &[usize], whole: Range<usize>, room: usize) -> Plan {
        if rows <= room {
            return Plan {
                stretches: vec![Stretch {
                    rows: 0..rows,
                    bucket: None,
                }],
                events_covered: events.len(),
            };
        }
        let near = (NEAR_EVENTS * room as f64) as usize;
        let whole = whole.start.max(rows.saturating_sub(near / 2)).min(rows)..rows;
        let full = |events: &[usize], reach: usize| with_end(around(events, reach, rows), whole.clone());
        let size = |events: &[usize], reach: usize| full(events, reach).iter().map(Range::len).sum::<usize>();
        // Both searches: the largest value that fits, as what it takes grows with it.
        let covered = largest(events.len(), |n| size(&events[..n], LEAST_REACH) <= near);
        let events = &events[..covered];
        let reach = largest(rows, |reach| size(events, reach) <= near);
        let full = full(events, reach);
        let kept = full.iter().map(Range::len).sum::<usize>();
        // A gap ends with a bucket of its own, which is why each takes one of the buckets.
        let buckets = ((room - kept) / 2).saturating_sub(full.len() + 1).max(1);
        let bucket = Some((rows - kept).div_ceil(buckets));
        let mut stretches = Vec::new();
        let mut next = 0;
        for range in full.into_iter().chain(std::iter::once(rows..rows)) {
            stretches.push(Stretch {
                rows: next..range.start,
                bucket,
            });
            next = range.end;
            stretches.push(Stretch {
                rows: range,
                bucket: None,
            });
        }
        stretches.retain(|stretch| !stretch.rows.is_empty());
        Plan {
            stretches,
            events_covered: covered,
        }
    }

    /// Samples that are kept as they are.
    pub(super) fn kept(&self) -> usize {
        let full = self.stretches.iter().filter(|stretch| stretch.bucket.is_none());
        full.map(|stretch| stretch.rows.len()).sum()
    }

    /// The rows of each entry, and whether it is a bucket.
    fn entries(&self) -> impl Iterator<Item = (Range<usize>, bool)> + '_ {
        self.stretches.iter().flat_map(|stretch| {
            let Range { start, end } = stretch.rows;
            let step = stretch.bucket.unwrap_or(1);
            (start..end)
                .step_by(step)
                .map(move |first| (first..end.min(first + step), stretch.bucket.is_some()))
        })
    }

    /// Folds a column, given block by block, into the plan's entries.
    ///
    /// # Errors
    /// The first error among the blocks.
    pub(super) fn fold(&self, blocks: Blocks) -> Result<Column, ResultError> {
        let mut column = Column::default();
        let mut entries = self.entries();
        let mut entry = entries.next();
        let (mut row, mut first, mut low, mut high) = (0, None, f64::NAN, f64::NAN);
        for block in blocks {
            for value in block? {
                let Some((rows, bucket)) = &entry else {
                    return Ok(column);
                };
                first.get_or_insert(value);
                // NaN only where there is nothing else: min and max leave it out.
                (low, high) = (low.min(value), high.max(value));
                row += 1;
                if row == rows.end {
                    if *bucket {
                        column.values.push(low);
                        column.highs.push(high);
                    } else {
                        column.values.push(value);
                    }
                    column.firsts.push(first.unwrap_or(value));
                    column.lasts.extend(bucket.then_some(value));
                    entry = entries.next();
                    (first, low, high) = (None, f64::NAN, f64::NAN);
                }
            }
        }
        Ok(column)
    }
}

/// A column, block by block.
pub(super) type Blocks<'s> = Box<dyn Iterator<Item = Result<Vec<f64>, ResultError>> + 's>;

/// A column as the plan keeps it.
#[derive(Debug, Default)]
pub(super) struct Column {
    /// For each entry its value, or the least of its bucket.
    pub(super) values: Vec<f64>,
    /// For each bucket its largest value.
    pub(super) highs: Vec<f64>,
    /// For each entry its first value.
    pub(super) firsts: Vec<f64>,
    /// For each bucket its last value.
    pub(super) lasts: Vec<f64>,
}

/// The rows within `reach` of the events, as ranges that do not touch.
fn around(events: &[usize], reach: usize, rows: usize) -> Vec<Range<usize>> {
    let mut ranges: Vec<Range<usize>> = Vec::new();
    for &row in events {
        let (start, end) = (row.saturating_sub(reach), rows.min(row.saturating_add(reach)));
        match ranges.last_mut() {
            Some(last) if start <= last.end => last.end = last.end.max(end),
            _ if start < end => ranges.push(start..end),
            _ => {}
        }
    }
    ranges
}

/// Ranges in order that do not touch, with one more that goes beyond all of them or to where the last of them ends.
fn with_end(mut ranges: Vec<Range<usize>>, end: Range<usize>) -> Vec<Range<usize>> {
    if end.is_empty() {
        return ranges;
    }
    let mut start = end.start;
    while let Some(last) = ranges.pop_if(|last| last.end >= start) {
        start = start.min(last.start);
    }
    ranges.push(start..end.end);
    ranges
}

/// The largest n up to `most` for which `fits` holds, if it holds for every smaller n as well; 0 if it never does.
fn largest(most: usize, fits: impl Fn(usize) -> bool) -> usize {
    let (mut low, mut high) = (0, most);
    while low < high {
        let middle = low + (high - low).div_ceil(2);
        if fits(middle) {
            low = middle;
        } else {
            high = middle - 1;
        }
    }
    low
}
