//! What is computed from a run of two trains: statistics, and the attractor that it comes to.
//!
//! | module | what it is |
//! |---|---|
//! | `attractor` | whether the motion repeats itself, with which period, and its extremes |
//! | `summary` | the headline of a run |
//! | `saved_run` | a run into its result file |

mod attractor;
mod saved_run;
mod summary;

pub use attractor::{Attractor, Extremes, RECURRENCE_TOLERANCE};
pub use saved_run::{SavedTrainReport, SavedTrainRun};
pub use summary::{Outcome, TrainSummary};
