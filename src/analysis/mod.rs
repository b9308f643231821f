//! What is computed from a run: stick-slip statistics, and how much the run amplifies a perturbation; and from a case:
//! its modes and its loss of stability; from a study: methods by tolerances; and how far two runs agree.

pub mod advice;
mod attractor;
pub mod bands;
pub mod certificate;
mod certification;
mod deadline;
pub mod distribution;
pub mod exact;
pub mod headline;
mod kept_run;
pub mod ladder;
pub mod linearised;
mod recorded;
mod saved_run;
pub mod sensitivity;
mod sequence;
pub mod stability;
pub mod summary;
pub mod truth;
mod verdict;
pub mod warning;
pub mod witness;
pub mod work_precision;

pub use crate::record::{Cycle, CycleStatistics};
pub use attractor::{Attractor, Extremes, LONGEST_PERIOD, RECURRENCE_TOLERANCE};
pub use certificate::{Certificate, certify};
pub use certification::{Certified, Certify, Stage, Written};
pub use deadline::Deadline;
pub use headline::{HeadlineRow, headline};
pub use kept_run::{KeptReport, KeptReportEnd, KeptRun};
pub use recorded::Recorded;
pub(crate) use recorded::recorded;
pub use saved_run::{SavedReport, SavedRun};
pub use stability::Growth;
pub use stability::Modes;
pub use summary::{Outcome, Summary};
pub use warning::Warning;
pub use witness::{Witness, witness};
