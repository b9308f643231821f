//! Thinning of long curves and trajectories, block by block, without a visible change of the picture.
//!
//! Curves of a figure keep what their pixels show. A trajectory on a page becomes a sequence of entries: single samples, or buckets
//! with the least and the largest value of each channel over consecutive samples. A run that fits is kept whole. Otherwise the samples
//! around events are kept and buckets cover the rest, so that no extreme of a channel is lost at any zoom.

use std::collections::HashSet;
use std::ops::Range;
use stickslip_files::ResultError;

/// A curve over increasing x, in buckets as wide as a pixel. Each bucket keeps its first, least, largest and last
/// point, so that the line covers the same pixels and no extreme is lost. Memory is four points for each bucket.
#[derive(Debug, Clone)]
pub struct MinMax {
    from: f64,
    per_x: f64,
    buckets: usize,
    current: Option<(usize, Bucket)>,
    kept: Vec<(f64, f64)>,
}

/// First, least, largest and last point, with their positions in the bucket, from which the order is restored.
#[derive(Debug, Clone, Copy)]
struct Bucket {
    count: u64,
    points: [(u64, (f64, f64)); 4],
}

impl Bucket {
    fn new(point: (f64, f64)) -> Self {
        Bucket {
            count: 1,
            points: [(0, point); 4],
        }
    }

    fn push(&mut self, point: (f64, f64)) {
        let (own, [_, least, largest, last]) = ((self.count, point), &mut self.points);
        if point.1 < least.1.1 {
            *least = own;
        }
        if point.1 > largest.1.1 {
            *largest = own;
        }
        *last = own;
        self.count += 1;
    }

    fn points(mut self) -> impl Iterator<Item = (f64, f64)> {
        self.points.sort_by_key(|point| point.0);
        let mut previous = None;
        let new = self
            .points
            .into_iter()
            .filter(move |point| previous.replace(point.0) != Some(point.0));
        new.map(|point| point.1)
    }
}

impl MinMax {
    /// An empty curve for x from `from` to `to`. Points outside go to the first or the last bucket.
    pub fn new(from: f64, to: f64, buckets: usize) -> Self {
        let buckets = buckets.max(1);
        let width = to - from;
        MinMax {
            from,
            per_x: if width > 0.0 { buckets as f64 / width } else { 0.0 },
            buckets,
            current: None,
            kept: Vec::new(),
        }
    }

    /// Adds a point whose x is not below the previous one. NaN is skipped.
    pub fn push(&mut self, x: f64, y: f64) {
        if x.is_nan() || y.is_nan() {
            return;
        }
        // The cast turns a negative value into 0.
        let bucket = (((x - self.from) * self.per_x) as usize).min(self.buckets - 1);
        match &mut self.current {
            Some((index, points)) if *index == bucket => points.push((x, y)),
            current => {
                if let Some((_, done)) = current.replace((bucket, Bucket::new((x, y)))) {
                    self.kept.extend(done.points());
                }
            }
        }
    }

    /// Returns the kept points in order.
    pub fn finish(mut self) -> Vec<(f64, f64)> {
        if let Some((_, last)) = self.current.take() {
            self.kept.extend(last.points());
        }
        self.kept
    }
}

/// Number of cells along each side of a portrait. At column width a cell is 0.1 mm wide.
const CELLS: f64 = 900.0;

/// A curve with any x and y on a grid of cells. A point in the cell of the previous point is skipped, and a passage
/// between two cells is drawn once. The deviation is less than one cell. Visited cells bound the memory.
#[derive(Debug, Clone)]
pub struct DecimatedPortrait {
    from: (f64, f64),
    per_unit: (f64, f64),
    cell: Option<(i32, i32)>,
    last: (f64, f64),
    drawn: HashSet<[i32; 4]>,
    lines: Vec<Vec<(f64, f64)>>,
    broken: bool,
    seen: bool,
}

impl DecimatedPortrait {
    /// An empty curve for these ranges of x and y.
    pub fn new(x: (f64, f64), y: (f64, f64)) -> Self {
        let per_unit = |(low, high): (f64, f64)| if high > low { CELLS / (high - low) } else { 0.0 };
        DecimatedPortrait {
            from: (x.0, y.0),
            per_unit: (per_unit(x), per_unit(y)),
            cell: None,
            last: (0.0, 0.0),
            drawn: HashSet::new(),
            lines: Vec::new(),
            broken: true,
            seen: false,
        }
    }

    /// Adds a point. NaN is skipped.
    pub fn push(&mut self, x: f64, y: f64) {
        if x.is_nan() || y.is_nan() {
            return;
        }
        self.seen = true;
        let cell = (
            ((x - self.from.0) * self.per_unit.0) as i32,
            ((y - self.from.1) * self.per_unit.1) as i32,
        );
        let before = self.cell.replace(cell);
        if before == Some(cell) {
            return;
        }
        if let Some(before) = before {
            let is_new = self.drawn.insert([before.0, before.1, cell.0, cell.1]);
            if is_new {
                if self.broken {
                    self.lines.push(vec![self.last]);
                }
                if let Some(line) = self.lines.last_mut() {
                    line.push((x, y));
                }
            }
            self.broken = !is_new;
        }
        self.last = (x, y);
    }

    pub(crate) fn lift(&mut self) {
        (self.cell, self.broken) = (None, true);
    }

    /// Returns the kept lines, or a single point if the curve never leaves its cell.
    pub fn finish(mut self) -> Vec<Vec<(f64, f64)>> {
        if self.lines.is_empty() && self.seen {
            self.lines.push(vec![self.last]);
        }
        self.lines
    }
}

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

/// Largest n up to `most` for which the monotone `fits` is true; 0 without any.
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
