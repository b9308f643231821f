//! Thinning of long curves, block by block, without a visible change of the picture.

use std::collections::HashSet;

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
