//! Sweeps: a study varies the keys of a case, and a sweep runs its points.
//!
//! A [`Study`] is a TOML file with a base case, [`ParameterAxis`]es over its keys, and the choice of points: a grid, a sample,
//! a table, or the trace of a boundary. Points are numbered, and the outcome of a point depends only on the study.
//! Threads of this process ([`run_points`]) or an [`Executor`] compute them. The [`Journal`] keeps every outcome. The
//! sweep file (`stickslip_files::SweepWriter`) is made from the journal in the order of the numbers. A [`Shard`] is a
//! part of the points with its own file.
//!
//! | module | what it is |
//! |---|---|
//! | `study`, `axis`, `criterion`, `sampling` | the study file: axes, boundaries, samples |
//! | `run`, `running`, `runner` | from a study to its file; remaining points; points on threads |
//! | `executor`, `shard` | points in other processes; parts of a study on several machines |
//! | `quantities`, `record` | outcome of a point, and its record |
//! | `journal`, `earlier` | outcomes in order of completion; complete file of an earlier start |
//! | `boundary`, `tracer`, `lattice`, `fold`, `contour`, `limit` | tracing a boundary |
//! | `curves`, `boundary_tables` | traced curves, and their tables in a file |
//! | `file`, `point_file` | sweep file; result file for each point |
//! | `report`, `error` | report; errors |

mod axis;
mod boundary;
mod boundary_tables;
pub mod contour;
mod criterion;
mod curves;
mod earlier;
mod error;
mod executor;
mod file;
mod fold;
mod journal;
pub mod lattice;
mod limit;
mod outcome;
mod point_file;
mod record;
mod report;
mod run;
mod runner;
mod running;
mod sampling;
mod shard;
mod study;
mod tracer;

pub(crate) use crate::analysis::quantity::asked_for;
pub use crate::analysis::quantity::{QUANTITIES, Quantity, quantity_index};
pub use crate::study::StudySource;
pub use axis::{AxisRange, ParameterAxis, Spacing};
pub(crate) use axis::{case_along, read as read_axis};
pub use criterion::{BoundarySpec, Criterion, ThresholdTest};
pub use curves::{Boundaries, BoundaryCurve, BoundaryPoint, ContourLine, CurveBranch};
pub use error::SweepError;
pub use executor::{Executor, evaluate};
pub(crate) use file::{header, sweep_variables};
pub use journal::{Existing, Journal, JournalError, journal_path};
pub use outcome::{EventRow, PointOutcome, Values};
pub use report::SweepReport;
pub use run::Sweep;
pub use runner::{Integrate, IntegrateError, Integrated, Stopped, run_point, run_points, without_a_file};
pub(crate) use sampling::sobol;
pub use shard::Shard;
pub(crate) use study::WALL_TIME;
pub use study::{Design, Keep, STUDIES, STUDY_RTOL, Study, StudyPoint};
