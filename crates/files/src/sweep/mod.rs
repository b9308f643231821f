//! Files of sweeps and their shards.
//!
//! | module | contents |
//! |---|---|
//! | `schema` | names and plan of a sweep file |
//! | `partition` | distribution of points among shards |
//! | `columns` | datasets of points, events, and further tables |
//! | `shard` | reader of shard files |
//! | `writer` | writer of both |
//! | `merge` | shards merged into one file |

mod columns;
mod merge;
mod partition;
pub(crate) mod schema;
mod shard;
mod writer;

pub use merge::{MergeReport, merge};
pub use partition::Partition;
pub use schema::SweepLayout;
pub use schema::{EventForm, ShardPlan, SweepAxis, SweepPlan, SweepRow};
pub use shard::ShardFile;
pub use writer::SweepWriter;
