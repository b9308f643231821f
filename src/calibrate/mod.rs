//! Calibration: parameters that reproduce measured numbers, and how far the numbers leave them open.
//!
//! A [`CalibrationStudy`] names free parameters with the ranges in which they are looked for, and [`Target`]s: quantities
//! of a run's summary with their rounding intervals. A number that was rounded says where the quantity lies and nothing
//! about where in there, so a target holds or it does not: its residual is the distance from the measured value in
//! half-widths of the interval, and it holds up to 1.
//!
//! [`calibrate`] looks for the parameters whose largest residual is least, over a Sobol sample and by local searches
//! from its best points. If not all targets can hold together, those are set aside without which the others hold. Then
//! the set of all parameters for which they hold is explored: its extent along each parameter is the spread that the
//! data leave. Everything is decided by the study and its seed, whatever the number of threads.

mod evaluate;
mod local;
mod output;
mod region;
mod search;
mod study;
mod target;

pub use output::write_file;
pub use region::{Correlation, Determined, Interval};
pub use search::{Calibration, CalibrationError, CalibrationOptions, CalibrationProgress, Compromise, calibrate};
pub use study::{CALIBRATIONS, CalibrationStudy, Search};
pub use target::{Role, Target, TargetResult};
