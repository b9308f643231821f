//! Study files: what every kind of study has in common, read in one way.
//!
//! | module | what it is |
//! |---|---|
//! | `source` | the text, and where it is from |
//! | `reading` | the reader of its tables: every problem by file, line and key |
//! | `head` | title, base case and settings |

mod head;
mod reading;
mod source;

pub(crate) use head::{Head, PROBES, check_points, written};
pub(crate) use reading::{Reader, plain};
pub use source::StudySource;
