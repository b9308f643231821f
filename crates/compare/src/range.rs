//! The range of a candidate's position over a stretch of time.

use super::candidate::Block;

/// The range of one column over a stretch of time, with parabolas between samples.
#[derive(Debug)]
pub struct Range {
    from: f64,
    to: f64,
    recent: [Option<(f64, f64)>; 2],
    /// Least and largest value so far.
    pub extremes: Option<(f64, f64)>,
}

impl Range {
    /// Starts with a stretch (s).
    pub fn new(from: f64, to: f64) -> Range {
        Range {
            from,
            to,
            recent: [None; 2],
            extremes: None,
        }
    }

    /// Takes the next samples.
    pub fn add(&mut self, block: &Block, column: usize) {
        let first = block.time.partition_point(|t| *t < self.from);
        for (&t, &x) in block.time[first..].iter().zip(&block.columns[column][first..]) {
            if t > self.to {
                break;
            }
            self.take(x);
            if let [Some(b), Some(a)] = self.recent
                && (b.1 - a.1) * (x - b.1) < 0.0
            {
                self.take(vertex(a, b, (t, x)));
            }
            self.recent = [Some((t, x)), self.recent[0]];
        }
    }

    fn take(&mut self, x: f64) {
        let (low, high) = self.extremes.unwrap_or((x, x));
        self.extremes = Some((low.min(x), high.max(x)));
    }

    /// Half of the range.
    pub fn amplitude(&self) -> Option<f64> {
        self.extremes.map(|(low, high)| (high - low) / 2.0)
    }
}

fn vertex(a: (f64, f64), b: (f64, f64), c: (f64, f64)) -> f64 {
    let (left, right) = ((b.1 - a.1) / (b.0 - a.0), (c.1 - b.1) / (c.0 - b.0));
    let bend = (right - left) / (c.0 - a.0);
    let slope = left + bend * (b.0 - a.0);
    b.1 - slope * slope / (4.0 * bend)
}
