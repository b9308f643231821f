//! Files of sweeps and their shards.
//!
//! | module | contents |
//! |---|---|
//! | `schema` | names and plan of a sweep file |
//! | `partition` | distribution of points among shards |
//! | `columns` | datasets of points, events, and further tables |
//! | `file`, `shard` | readers of sweep and shard files |
//! | `writer` | writer of both |
//! | `merge` | shards merged into one file |

mod columns;
mod file;
mod merge;
mod partition;
mod schema;
mod shard;
mod writer;

pub use file::SweepFile;
pub use merge::{MergeError, MergeOptions, MergeReport, merge};
pub use partition::Partition;
pub use schema::SweepHeader;
pub use schema::SweepLayout;
pub use schema::{EventForm, ShardPlan, SweepAxis, SweepPlan, SweepRow};
pub use shard::ShardFile;
pub use writer::SweepWriter;
