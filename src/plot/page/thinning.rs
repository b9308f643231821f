//! Thinning of long trajectories.
//!
//! The trajectory becomes a sequence of entries: single samples, or buckets with the least and the largest value of
//! each channel over consecutive samples. A run that fits is kept whole. Otherwise the samples around events are kept
//! and buckets cover the rest, so that no extreme of a channel is lost at any zoom.

use std::ops::Range;
use stickslip_files::ResultError;

/// Least number of samples kept on each side of an event.
const LEAST_REACH: usize = 16;
/// Share of the room for samples around events; buckets have the rest.
const NEAR_EVENTS: f64 = 0.75;

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ThinnedStretch {
    pub(super) rows: Range<usize>,
    /// Rows per bucket (fewer in the last); `None`: every sample is kept.
    pub(super) bucket: Option<usize>,
}

impl ThinnedStretch {
    pub(super) fn entries(&self) -> usize {
        self.rows.len().div_ceil(self.bucket.unwrap_or(1))
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Plan {
    pub(super) stretches: Vec<ThinnedStretch>,
    /// Number of events with the samples around them: all, unless there are too many.
    pub(super) events_covered: usize,
}

impl Plan {
    /// `rows` samples in the room of `room`; a bucket takes the room of two. `events`: rows of the events, in order.
    /// `whole`: the last rows, kept first, up to half of the room around events.
    pub(super) fn new(rows: usize, events: &[usize], whole: Range<usize>, room: usize) -> Plan {
        if rows <= room {
            return Plan {
                stretches: vec![ThinnedStretch {
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
        // Both sizes grow monotonically, so that the largest fitting value can be searched.
        let covered = largest(events.len(), |n| size(&events[..n], LEAST_REACH) <= near);
        let events = &events[..covered];
        let reach = largest(rows, |reach| size(events, reach) <= near);
        let full = full(events, reach);
        let kept = full.iter().map(Range::len).sum::<usize>();
        // Each gap ends with a bucket of its own, hence one bucket per gap is reserved.
        let buckets = ((room - kept) / 2).saturating_sub(full.len() + 1).max(1);
        let bucket = Some((rows - kept).div_ceil(buckets));
        let mut stretches = Vec::new();
        let mut next = 0;
        for range in full.into_iter().chain(std::iter::once(rows..rows)) {
            stretches.push(ThinnedStretch {
                rows: next..range.start,
                bucket,
            });
            next = range.end;
            stretches.push(ThinnedStretch {
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

    pub(super) fn fold(&self, blocks: Blocks) -> Result<ThinnedColumn, ResultError> {
        let mut column = ThinnedColumn::default();
        let mut entries = self.entries();
        let mut entry = entries.next();
        let (mut row, mut first, mut low, mut high) = (0, None, f64::NAN, f64::NAN);
        for block in blocks {
            for value in block? {
                let Some((rows, bucket)) = &entry else {
                    return Ok(column);
                };
                first.get_or_insert(value);
                // `min` and `max` ignore NaN unless there is nothing else.
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

pub(super) type Blocks<'s> = Box<dyn Iterator<Item = Result<Vec<f64>, ResultError>> + 's>;

#[derive(Debug, Default)]
pub(super) struct ThinnedColumn {
    /// Value of each entry; the least one for a bucket.
    pub(super) values: Vec<f64>,
    /// Largest value of each bucket.
    pub(super) highs: Vec<f64>,
    /// First value of each entry.
    pub(super) firsts: Vec<f64>,
    /// Last value of each bucket.
    pub(super) lasts: Vec<f64>,
}

/// Disjoint ranges of the rows within `reach` of the events.
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

/// Disjoint ordered ranges, merged with a range that ends at or after the last of them.
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

/// Largest n up to `most` for which the monotone `fits` is true; 0 if there is none.
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
