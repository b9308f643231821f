//! Which points of a study belong to which of its shards.
//!
//! Points are dealt out like cards: point n goes to shard n mod N. In a grid this would repeat itself after some rows (the
//! lines along its last axis), so that the same values of an axis could always go to the same shard, and the one with the
//! expensive ones (a slow method, say) would be the last to end; there the dealing moves on by one shard.

/// How the points of a study are dealt out to shards.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Partition {
    /// Lengths of the axes of a grid; the number of points alone for a table.
    shape: Vec<usize>,
    shards: usize,
    /// Length of the last axis.
    row: usize,
    /// Points after which the dealing would repeat itself: whole rows, and the same number for every shard.
    cycle: usize,
}

/// A regular part of a grid that is a regular part of the rows of a shard: start, stride, count and block of each
/// dimension.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Patch {
    /// In the points of the shard, which are in the order of their numbers.
    pub rows: Stride,
    /// In the grid, for each axis; blocks of one.
    pub cells: Vec<Stride>,
}

/// `count` blocks of `block` elements, `step` apart, from `start` on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Stride {
    pub start: usize,
    pub step: usize,
    pub count: usize,
    pub block: usize,
}

impl Stride {
    /// This many elements in a row.
    pub(super) fn solid(start: usize, length: usize) -> Stride {
        Stride {
            start,
            step: 1,
            count: 1,
            block: length,
        }
    }
}

impl Partition {
    /// Of the points of a grid with axes of these lengths, or of a table with this number of rows, into `shards` parts.
    /// All numbers are at least 1.
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

    /// Lengths of the axes of a grid; the number of points alone for a table.
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// How many points there are.
    pub fn points(&self) -> usize {
        self.shape.iter().product()
    }

    /// How many shards there are.
    pub fn shards(&self) -> usize {
        self.shards
    }

    /// The shard of a point, counted from 0.
    pub(crate) fn owner(&self, number: usize) -> usize {
        (number % self.shards + number / self.cycle % self.shards) % self.shards
    }

    /// How many points a shard has.
    pub fn size(&self, shard: usize) -> usize {
        let rows = self.points() / self.row;
        self.before(shard, rows)
    }

    /// The first column of a shard in a row, and how many of its columns it has.
    fn columns(&self, shard: usize, row: usize) -> (usize, usize) {
        let first = (shard + self.shards - self.owner(row * self.row)) % self.shards;
        (first, self.row.saturating_sub(first).div_ceil(self.shards))
    }

    /// How many points a shard has in the rows before this one.
    fn before(&self, shard: usize, row: usize) -> usize {
        let rows = self.cycle / self.row;
        let begun = row / rows * rows;
        let rest: usize = (begun..row).map(|row| self.columns(shard, row).1).sum();
        row / rows * (self.cycle / self.shards) + rest
    }

    /// The grid's cells of a shard, in pieces that are regular in the grid and in the shard.
    pub(crate) fn patches(&self, shard: usize) -> Vec<Patch> {
        let outer = self.shape.len().saturating_sub(2);
        let lines = if self.shape.len() > 1 { self.shape[outer] } else { 1 };
        // Rows so far apart have the same columns.
        let period = self.cycle / self.row * self.shards;
        let apart = self.cycle;
        let mut patches = Vec::new();
        for plane in 0..self.points() / (lines * self.row) {
            for line in 0..period.min(lines) {
                let row = plane * lines + line;
                let (first, columns) = self.columns(shard, row);
                if columns == 0 {
                    continue;
                }
                let count = (lines - line).div_ceil(period);
                let mut rest = plane;
                let mut cells: Vec<Stride> = Vec::with_capacity(self.shape.len());
                for length in self.shape[..outer].iter().rev() {
                    cells.push(Stride::solid(rest % length, 1));
                    rest /= length;
                }
                cells.reverse();
                if self.shape.len() > 1 {
                    cells.push(Stride {
                        start: line,
                        step: period,
                        count,
                        block: 1,
                    });
                }
                cells.push(Stride {
                    start: first,
                    step: self.shards,
                    count: columns,
                    block: 1,
                });
                let rows = Stride {
                    start: self.before(shard, row),
                    step: apart,
                    count,
                    block: columns,
                };
                patches.push(Patch { rows, cells });
            }
        }
        patches
    }
}

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn elements(stride: &Stride) -> impl Iterator<Item = usize> {
        let Stride {
            start,
            step,
            count,
            block,
        } = *stride;
        (0..count).flat_map(move |k| (0..block).map(move |b| start + k * step + b))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(256))]

        /// Shards are of one size up to one point, and the patches of all of them cover every cell once, each cell with
        /// the row that its point has among those of its shard.
        #[test]
        fn property_every_point_is_in_one_shard_and_where_its_patch_says(
            shape in proptest::collection::vec(1usize..9, 1..4), shards in 1usize..9,
        ) {
            let partition = Partition::new(&shape, shards);
            let points = partition.points();
            let mut members = vec![Vec::new(); shards];
            for number in 0..points {
                members[partition.owner(number)].push(number);
            }
            let mut covered = vec![0; points];
            for (shard, numbers) in members.iter().enumerate() {
                prop_assert_eq!(partition.size(shard), numbers.len());
                prop_assert!(numbers.len() == points / shards || numbers.len() == points / shards + 1);
                for patch in partition.patches(shard) {
                    let mut cells = vec![0];
                    for (stride, length) in patch.cells.iter().zip(&shape) {
                        cells = cells
                            .into_iter()
                            .flat_map(|outer: usize| elements(stride).map(move |index| outer * length + index))
                            .collect();
                    }
                    let rows: Vec<usize> = elements(&patch.rows).collect();
                    prop_assert_eq!(cells.len(), rows.len());
                    for (cell, row) in cells.into_iter().zip(rows) {
                        covered[cell] += 1;
                        prop_assert_eq!(numbers[row], cell);
                    }
                }
            }
            prop_assert!(covered.iter().all(|&times| times == 1));
        }
    }

    #[test]
    fn analytic_no_shard_keeps_to_one_value() {
        // Two methods as the last axis, dealt to two shards: each has every method for half of the rows.
        let partition = Partition::new(&[10, 2], 2);
        let first_column = |shard| (0..20).filter(|&n| partition.owner(n) == shard && n % 2 == 0).count();
        assert_eq!((first_column(0), first_column(1)), (5, 5));
        // Three values of the axis before the last: each of three shards has a third of each.
        let partition = Partition::new(&[6, 3, 2], 3);
        for shard in 0..3 {
            for value in 0..3 {
                let of_value = (0..36).filter(|&n| partition.owner(n) == shard && n / 2 % 3 == value);
                assert_eq!(of_value.count(), 4);
            }
        }
    }
}
