//! Band matrices, as LAPACK and SUNDIALS store them.

/// A square band matrix that writes into memory owned by a caller.
#[derive(Debug)]
pub struct BandMut<'a> {
    /// Columns in sequence. Element (i, j) is at `above + i - j` from the start of its column.
    entries: &'a mut [f64],
    stride: usize,
    above: usize,
    half_width: usize,
}

impl<'a> BandMut<'a> {
    /// A matrix whose columns are `stride` apart, with the diagonal at `above` from the start of each column.
    /// Elements up to `half_width` from the diagonal may be written.
    ///
    /// # Panics
    /// A column is too short for these elements.
    pub fn new(entries: &'a mut [f64], stride: usize, above: usize, half_width: usize) -> Self {
        assert!(half_width <= above && above + half_width < stride);
        BandMut {
            entries,
            stride,
            above,
            half_width,
        }
    }

    /// Adds to an element.
    ///
    /// # Panics
    /// The element is outside the band, or the column outside the matrix.
    #[inline]
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        assert!(
            row.abs_diff(column) <= self.half_width,
            "({row}, {column}) is outside of the band"
        );
        self.entries[column * self.stride + self.above + row - column] += value;
    }
}
