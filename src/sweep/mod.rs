//! Many runs: a study varies the keys of a case, and a sweep runs its points.
//!
//! A [`Study`] is read from a TOML file: a base case, [`Axis`]es over its keys, and which points they make: a grid, a
//! sample, a table, or the points that tracing a boundary asks for. Points are numbered; what a point comes to depends on
//! the study alone. [`run_points`] computes them on a pool of threads, [`Journal`] keeps every outcome as it comes, and the
//! sweep file ([`crate::results::SweepWriter`]) is made from the journal in the order of the numbers.

mod axis;
mod boundary;
mod boundary_tables;
mod contour;
mod criterion;
mod journal;
mod lattice;
mod limit;
mod nose;
mod output;
mod quantities;
mod reading;
mod runner;
mod sampling;
mod source;
mod study;

pub use axis::{Axis, Range, Spacing};
pub use boundary::{Boundaries, BoundaryPoint, Branch, Curve, Line};
pub use criterion::{BoundarySpec, Comparison, Criterion};
pub use journal::{Existing, Journal, JournalError, journal_path};
pub use output::{SweepError, SweepOptions, SweepProgress, SweepReport, sweep};
pub use quantities::{EventRow, NO_COUNT, Outcome, QUANTITIES, Quantity, Values, quantity_index};
pub use runner::{Integrate, IntegrateError, Stopped, run_point, run_points, without_a_file};
pub use sampling::SampleMethod;
pub use source::{BuiltInStudy, STUDIES, StudySource};
pub use study::{Design, Keep, Point, STUDY_RTOL, Study};
