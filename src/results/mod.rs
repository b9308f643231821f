//! The result file: HDF5 that is also valid netCDF-4. Schema, writer, reader; no physics.
//!
//! A run streams into `NAME.partial.h5` through [`ResultWriter`], which is marked interrupted and
//! flushed block by block; [`ResultWriter::finish`] gives a complete run its own name.
//! [`ResultFile`] reads both, [`ForeignFile`] the HDF5 files of other programs. Every name, unit and code is in [`schema`].
//!
//! | module | what it is |
//! |---|---|
//! | `schema` | names, units, descriptions and codes |
//! | `writer`, `rows`, `table`, `packed`, `values`, `attributes` | a run written as it is computed: rows, tables, chunks, columns, attributes |
//! | `header`, `stick_slip`, `certificate` | what a file says beside its rows |
//! | `sweep`, `work_precision`, `continuation` | the files of studies |
//! | `kept` | the rows of a run in memory |
//! | `target`, `lock`, `disk` | where a file goes, who writes it, files on the disk |
//! | `reader`, `dense`, `contents` | reading tables, polynomials, and what a file holds |
//! | `source`, `raw` | a file opened by a process of its own; HDF5 calls that the binding lacks |
//! | `foreign` | HDF5 files of other programs |
//! | `check`, `checksums`, `seal` | whether a file is as it was written |
//! | `error` | what can go wrong |

mod attributes;
mod certificate;
mod check;
mod checksums;
mod contents;
mod continuation;
mod dense;
pub(crate) mod disk;
mod error;
mod foreign;
mod header;
mod kept;
mod lock;
mod packed;
mod raw;
mod reader;
mod rows;
pub mod schema;
mod seal;
mod source;
mod stick_slip;
mod sweep;
mod table;
pub(crate) mod target;
mod values;
mod work_precision;
mod writer;

pub use attributes::AttributeValue;
pub(crate) use attributes::quantity;
pub use certificate::{Addition, serve_if_asked, write_certified};
pub use check::{CheckReport, Problem, check, check_sound, open_sound};
pub use contents::{AttributeInfo, Contents, FlagInfo, VariableInfo};
pub(crate) use continuation::ContinuationFile;
pub use continuation::{ContinuationColumn, StoredContinuation};
pub use dense::{DenseOutput, Side};
pub(crate) use disk::{folder_of, is_hdf5};
pub use error::{Reason, ResultError};
pub use foreign::{ForeignColumn, ForeignFile};
pub use header::{Header, Status};
pub use kept::{KeptEnd, KeptRows, KeptTable, KeptView};
pub use reader::{AddedGroup, Matrix, ResultFile, TableColumn};
pub use source::{end_reading, follow_external, read_apart};
pub use stick_slip::{Extra, StickSlipTable};
pub(crate) use sweep::SweepHeader;
pub(crate) use sweep::{EventForm, Partition, ShardFile, ShardPlan, SweepAxis, SweepPlan, SweepRow, SweepWriter};
pub use sweep::{MergeError, MergeOptions, MergeReport, SweepFile, SweepLayout, merge};
pub use target::{Overwrite, Reservation, check_target, partial_path};
pub use values::{Column, Values};
pub use work_precision::{WorkPrecisionFile, WorkPrecisionRow};
pub use writer::{ResultWriter, SavedRows};
