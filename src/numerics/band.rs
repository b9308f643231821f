//! Band matrices, as LAPACK and SUNDIALS store them.

/// A square band matrix to write, in the memory of another.
#[derive(Debug)]
pub struct BandMut<'a> {
    /// Column after column; element (i, j) is `above + i - j` behind the start of its column.
    entries: &'a mut [f64],
    stride: usize,
    above: usize,
    half_width: usize,
}

impl<'a> BandMut<'a> {
    /// Of a matrix whose columns are `stride` apart, with the diagonal `above` behind the start of each: elements up to
    /// `half_width` from the diagonal may be written.
    ///
    /// # Panics
    /// A column has no room for them.
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
    /// It is outside of the band, or the column is outside of the matrix.
    #[inline]
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        assert!(
            row.abs_diff(column) <= self.half_width,
            "({row}, {column}) is outside of the band"
        );
        self.entries[column * self.stride + self.above + row - column] += value;
    }
}
