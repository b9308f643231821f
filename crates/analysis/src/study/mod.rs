//! Study files: common parts of all kinds.
//!
//! | module | what it is |
//! |---|---|
//! | `source` | text and origin |
//! | `reading` | reader of tables: all problems by file, line and key |
//! | `head` | title, base case and settings |
//! | `run` | builder of a run into a file |

mod head;
mod reading;
mod run;
mod source;

pub use head::StudyHead;
pub(crate) use head::{PROBES, check_points, hash_of, written};
pub(crate) use reading::{StudyReader, plain};
pub use run::StudyRun;
pub use source::StudySource;
