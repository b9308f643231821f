//! How do results lie on disk? Tables of results in HDF5 files that are also valid netCDF-4; no physics.
//!
//! A run streams into `NAME.partial.h5` through [`ResultWriter`]. The partial file is marked as interrupted and
//! flushed block by block. [`ResultWriter::finish`] gives a complete run its own name and a seal. [`ResultFile`]
//! reads both, [`ForeignFile`] reads HDF5 files of other programs, and [`StudyFile`] those of
//! studies. [`KeptRows`] keeps the columns of a run in memory. Every name, unit and code is in [`schema`].
//!
//! ```
//! use stickslip_files::{Header, Overwrite, ResultFile, ResultWriter, Status, StickSlipTable, check};
//! use stickslip_system::model::Mode;
//! use stickslip_system::record::{Channels, Recorder, Sample, State};
//!
//! let folder = tempfile::tempdir()?;
//! let path = folder.path().join("run.h5");
//! let header = Header { title: "Free fall".to_owned(), ..Header::default() };
//!
//! let mut writer = ResultWriter::create(&path, Overwrite::OwnResults, &[], &header)?;
//! for row in 0..1000 {
//!     let time = 1e-3 * f64::from(row);
//!     let state = State { z: -4.905 * time * time, z_dot: -9.81 * time, ..State::default() };
//!     let channels = Channels::default();
//!     writer.sample(&Sample { time, mode: Mode::Separated, segment: 0, state, channels })?;
//! }
//! assert!(!path.exists()); // the rows are in run.partial.h5
//! writer.finish(Status::Complete, &StickSlipTable::default(), 0.1)?;
//!
//! let file = ResultFile::open(&path)?;
//! assert_eq!(file.title(), "Free fall");
//! assert_eq!(file.status(), &Status::Complete);
//! assert_eq!(file.sample_count()?, 1000);
//! assert_eq!(file.column("z_dot", 500..501)?, [-9.81 * (1e-3 * 500.0)]);
//!
//! // A check reads every value. It says that the rows belong to a segment which nobody has written.
//! let report = check(&path)?;
//! assert!(report.sealed);
//! assert_eq!(report.problems[0].what, "there is no segment 0");
//! # Ok::<(), Box<dyn std::error::Error + Send + Sync>>(())
//! ```
//!
//! | module | contents |
//! |---|---|
//! | [`schema`] | names, units, descriptions and codes |
//! | `writer`, `rows`, `table`, [`packed`], `attributes` | a run, written while it is computed or kept in memory: rows, tables of columns, chunks, attributes |
//! | `parts` | parts of a file that are not rows |
//! | `study`, `sweep` | the files of studies: head and reader, points |
//! | `target`, [`disk`] | place of a file, its writer, and files on the disk |
//! | `reader`, `dense`, `contents` | readers of tables and polynomials, and a listing of a file |
//! | `source`, `raw` | careful access to a file that this process did not write; HDF5 calls that the binding lacks |
//! | `foreign` | HDF5 files of other programs |
//! | `check`, `seal` | checks whether a file is as it was written |
//! | `error` | errors of files |
//!
//! The crate reads no case: a file holds the case's text, and its parameters in SI as TOML. The crate writes neither
//! CSV nor NPZ nor MAT; the module `export` of `stickslip` does. A seal shows damage, but is no protection against
//! malice.

mod attributes;
mod check;
mod contents;
mod dense;
pub mod disk;
mod earlier;
mod error;
mod foreign;
#[doc(hidden)]
pub mod packed;
mod parts;
mod raw;
mod reader;
mod rows;
pub mod schema;
mod seal;
mod source;
mod study;
mod sweep;
mod table;
pub(crate) mod target;
mod writer;

pub use attributes::AttributeValue;
pub use attributes::quantity;
pub use check::{CheckReport, FileDefect, check, check_sound, open_sound};
pub use contents::{AttributeInfo, Contents, FlagInfo, VariableInfo};
pub use dense::{DenseOutput, EventSide};
pub use disk::{folder_of, is_hdf5};
pub use earlier::{CALIBRATION, FileKind};
pub use error::{Reason, ResultError};
pub use foreign::{ForeignColumn, ForeignFile};
pub use parts::{Addition, Extra, Header, Status, StickSlipTable, write_certified};
pub use reader::{AddedGroup, Matrix, ResultFile};
pub use rows::{KeptRows, KeptTable, KeptView};
pub use source::{TableReader, follow_external, probe, probe_by_this_program, probe_if_asked, run_probe, set_probe};
pub use study::{ShapedColumn, StudyFile, StudyHeader};
pub use sweep::{EventForm, ShardFile, ShardPlan, SweepAxis, SweepEvent, SweepPlan, SweepRow, SweepWriter};
pub use sweep::{MergeReport, Partition, SweepLayout, merge};
pub use table::{ColumnValues, DeclaredColumn, FileColumn};
pub use target::{Overwrite, Reservation, check_target, partial_path};
pub use writer::{ResultWriter, SavedRows};
