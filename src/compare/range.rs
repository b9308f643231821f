//! The range of a candidate's position over a stretch of time.

use super::candidate::Block;

/// The range of one column over a stretch of time, between samples by parabolas.
#[derive(Debug)]
pub(super) struct Range {
    from: f64,
    to: f64,
    recent: [Option<(f64, f64)>; 2],
    extremes: Option<(f64, f64)>,
}

impl Range {
    /// Over a stretch (s).
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

    /// Half of it.
    pub fn amplitude(&self) -> Option<f64> {
        self.extremes.map(|(low, high)| (high - low) / 2.0)
    }
}

/// The extreme of the parabola through three points.
fn vertex(a: (f64, f64), b: (f64, f64), c: (f64, f64)) -> f64 {
    let (left, right) = ((b.1 - a.1) / (b.0 - a.0), (c.1 - b.1) / (c.0 - b.0));
    let bend = (right - left) / (c.0 - a.0);
    let slope = left + bend * (b.0 - a.0);
    b.1 - slope * slope / (4.0 * bend)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_extremes_between_samples_are_those_of_parabolas() {
        let block = Block {
            time: (0..20).map(f64::from).collect(),
            columns: vec![(0..20).map(|k| 1.0 - (f64::from(k) - 7.3).powi(2)).collect()],
        };
        let mut range = Range::new(2.0, 11.0);
        range.add(&block, 0);
        let (low, high) = range.extremes.unwrap();
        assert!((high - 1.0).abs() < 1e-12 && (low - (1.0 - 5.3f64.powi(2))).abs() < 1e-12);
    }
}
