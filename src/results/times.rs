//! Whether the times of a trajectory are times.

use super::{Reason, ResultError, ResultFile};

impl ResultFile {
    /// Reads the times of the trajectory, block by block, and holds each against the one before it. Whoever looks for a
    /// time in a file, or divides by the distance of two, relies on it.
    ///
    /// # Errors
    /// A time that is not finite, or not after the one before it; or of the file.
    pub(crate) fn check_times(&self) -> Result<(), ResultError> {
        let (mut row, mut before) = (0, f64::NEG_INFINITY);
        for block in self.column_blocks("time")? {
            for time in block? {
                if !(time > before && time.is_finite()) {
                    return Err(Reason::Times { row, time, before }.of(self.path()));
                }
                (row, before) = (row + 1, time);
            }
        }
        Ok(())
    }
}
