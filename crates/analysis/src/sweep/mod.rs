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
//! | `run` | from a study, or a shard of it, to its file |
//! | `runner`, `executor` | remaining points on threads, or in other processes |
//! | `journal` | outcome of a point; outcomes in order of completion |
//! | `boundary`, `tracer`, `lattice` | tracing a boundary |
//! | `curves` | traced curves, and their tables in a file |
//! | `file` | sweep file |

mod axis;
mod boundary;
mod criterion;
mod curves;
mod distributed;
mod executor;
mod file;
mod journal;
pub mod lattice;
mod run;
mod runner;
mod sampling;
mod study;
mod tracer;

pub(crate) use crate::analysis::quantity::asked_for;
pub use crate::analysis::quantity::{QUANTITIES, Quantity, quantity_index};
pub use crate::study::StudySource;
pub(crate) use axis::AXIS_KEYS;
pub use axis::{AxisRange, ParameterAxis, Spacing};
pub(crate) use axis::{case_along, read as read_axis};
pub use criterion::{BoundarySpec, Criterion, ThresholdTest};
pub use curves::{Boundaries, BoundaryCurve, BoundaryPoint, ContourLine, CurveBranch};
pub use distributed::AxisDistribution;
pub use executor::{Executor, evaluate};
pub(crate) use file::{header, sweep_variables};
pub use journal::{Existing, Journal, PointOutcome, Values, journal_path};
pub use run::{Shard, Sweep, SweepReport};
pub use runner::{Integrate, run_point, run_points, without_a_file};
pub(crate) use sampling::sobol;
pub(crate) use study::KEY_TABLES;
pub use study::{Design, Keep, STUDIES, STUDY_RTOL, Study, StudyPoint};
