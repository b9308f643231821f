//! The file of a sweep, of a shard of one, and of shards put together.
//!
//! | module | what it is |
//! |---|---|
//! | `schema` | the names in a sweep file, and what one is made of |
//! | `partition` | which points belong to which shard |
//! | `storage` | datasets of one file, or virtual ones over the files of shards |
//! | `columns` | the datasets of the points, their events, and further tables |
//! | `file`, `shard` | reading a sweep file, and the file of a shard |
//! | `writer` | writing either |
//! | `merge` | from the files of shards to that of the whole |

mod columns;
mod file;
mod merge;
mod partition;
mod schema;
mod shard;
mod storage;
mod writer;

pub use file::SweepFile;
pub use merge::{MergeError, MergeOptions, MergeReport, merge};
pub(crate) use partition::Partition;
pub(crate) use schema::SweepHeader;
pub use schema::SweepLayout;
pub(crate) use schema::{EventForm, ShardPlan, SweepAxis, SweepPlan, SweepRow};
pub(crate) use shard::ShardFile;
pub(crate) use writer::SweepWriter;
