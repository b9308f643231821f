//! Calibration: parameters that reproduce measured numbers, and their remaining freedom.
//!
//! A [`CalibrationStudy`] has free parameters with ranges, and [`Target`]s: quantities of a run's summary with their
//! rounding intervals. A rounded number is equally good anywhere in its interval, so a target is met or missed. Its
//! residual is the distance from the measured value in half-widths; it is met up to 1.
//!
//! [`calibrate`] minimises the largest residual over a Sobol sample and by local searches from its best points. If not
//! all targets can be met together, it sets targets aside so that the others are met. Then the set of all valid
//! parameters is explored. Its extent along each parameter is the spread that the data allow. The result depends only
//! on the study and its seed, not on the number of threads.

mod local;
mod output;
pub mod region;
mod search;
mod study;

pub use output::CalibrationRun;
pub use region::{Correlation, Determined, Interval};
pub use search::{Calibration, Compromise, calibrate};
pub(crate) use study::KEY_TABLES;
pub use study::{CALIBRATIONS, CalibrationSearch, CalibrationStudy, Role, Target, TargetResult};
