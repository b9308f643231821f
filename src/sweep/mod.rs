//! Many runs: a study varies the keys of a case, and a sweep runs its points.
//!
//! A [`Study`] is read from a TOML file: a base case, [`Axis`]es over its keys, and which points they make: a grid, a
//! sample, a table, or the points that tracing a boundary asks for. Points are numbered; what a point comes to depends on
//! the study alone. A [`WorkerPool`] computes them: a pool of threads ([`run_points`]), or the ranks of an MPI job
//! (feature `mpi`). [`Journal`] keeps every outcome as it comes, and the sweep file (`results::SweepWriter`) is made from the
//! journal in the order of the numbers; a [`Shard`] is a part of the points with a file of its own.
//!
//! | module | what it is |
//! |---|---|
//! | `study`, `axis`, `criterion`, `sampling` | the study file: axes, boundaries, samples |
//! | `run`, `running`, `runner` | from a study to its file; points that are left; points on threads |
//! | `worker_pool`, `mpi`, `shard` | threads, ranks of MPI, parts of a study on several machines |
//! | `quantities`, `record` | the outcome of a point, and its record |
//! | `journal`, `earlier` | outcomes as they come; what an earlier start has left |
//! | `boundary`, `tracer`, `lattice`, `fold`, `contour`, `limit` | tracing a boundary |
//! | `curves`, `boundary_tables` | the traced curves, and their tables in a file |
//! | `file`, `point_file` | the sweep file; a result file for each point |
//! | `report`, `error` | progress and report; why there is no file |

mod axis;
mod boundary;
mod boundary_tables;
mod contour;
mod criterion;
mod curves;
mod earlier;
mod error;
mod file;
mod fold;
mod journal;
mod lattice;
mod limit;
#[cfg(feature = "mpi")]
pub mod mpi;
mod point_file;
mod quantities;
mod record;
mod report;
mod run;
mod runner;
mod running;
mod sampling;
mod shard;
mod study;
mod tracer;
mod worker_pool;

pub use crate::study::StudySource;
pub use axis::{Axis, Range, Spacing};
pub(crate) use axis::{case_along, read as read_axis};
pub use criterion::{BoundarySpec, Comparison, Criterion};
pub use curves::{Boundaries, BoundaryPoint, Branch, Curve, Line};
pub use error::SweepError;
pub(crate) use file::{command_attribute, header, sweep_variables};
pub use journal::{Existing, Journal, JournalError, journal_path};
pub(crate) use quantities::asked_for;
pub use quantities::{EventRow, Outcome, QUANTITIES, Quantity, Values, quantity_index};
pub use report::{SweepProgress, SweepReport};
pub use run::Sweep;
pub use runner::{Integrate, IntegrateError, Integrated, Stopped, run_point, run_points, without_a_file};
pub(crate) use sampling::sobol;
pub use shard::Shard;
pub use study::{Design, Keep, Point, STUDIES, STUDY_RTOL, Study};
pub use worker_pool::{Delivery, Threads, Work, WorkerPool};
