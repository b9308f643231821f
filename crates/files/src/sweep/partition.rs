//! Distribution of a study's points among its shards.
//!
//! Point n goes to shard n mod N, as cards are dealt. In a grid this pattern can repeat after some rows (lines along
//! the last axis), so that one value of an axis, such as a slow method, would always go to the same shard. The
//! dealing then shifts by one shard.

/// Distribution of a study's points among shards.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Partition {
    shape: Vec<usize>,
    shards: usize,
    row: usize,
    /// Number of points after which the dealing would repeat: whole rows, and equally many points for every shard.
    cycle: usize,
}

impl Partition {
    /// Divides the points of a grid with these axis lengths, or of a table with this many rows, into `shards` parts.
    /// All numbers must be at least 1.
    pub fn new(shape: &[usize], shards: usize) -> Self {
        let row = shape.last().copied().unwrap_or(1).max(1);
        let shards = shards.max(1);
        let common = greatest_common_divisor(row, shards);
        Partition {
            shape: shape.to_vec(),
            shards,
            row,
            cycle: (row / common).saturating_mul(shards),
        }
    }

    /// Axis lengths of a grid, or the number of points of a table.
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.shape.iter().product()
    }

    /// Number of shards.
    pub fn shards(&self) -> usize {
        self.shards
    }

    /// Shard of a point, from 0.
    pub fn owner(&self, number: usize) -> usize {
        (number % self.shards + number / self.cycle % self.shards) % self.shards
    }

    /// Number of points in a shard.
    pub fn size(&self, shard: usize) -> usize {
        let (rows, rows_of_cycle) = (self.points() / self.row, self.cycle / self.row);
        let cycles = rows / rows_of_cycle;
        let in_row = |row: usize| {
            let first = (shard + self.shards - self.owner(row * self.row)) % self.shards;
            self.row.saturating_sub(first).div_ceil(self.shards)
        };
        let rest: usize = (cycles * rows_of_cycle..rows).map(in_row).sum();
        cycles * (self.cycle / self.shards) + rest
    }
}

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}
