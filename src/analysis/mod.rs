//! What is computed from a run or a case: what it comes to, how accurate it is, what it depends on, and what grows.
//!
//! | module | what it is |
//! |---|---|
//! | `recorded`, `saved_run`, `kept_run` | a run into a recorder, into its file, or into memory, with its summary |
//! | `summary`, `headline` | main numbers and outcome; the same in words |
//! | `attractor`, `section`, `smooth`, `forcing` | whether the motion repeats: by its events, by the period of what forces it, without either |
//! | `exponent` | the largest Lyapunov exponent of a motion that does not |
//! | `warning`, `witness`, `sequence` | what to know before a result is used; the same case by another method |
//! | `finer`, `repetition` | a run again with finer settings, where its witness does not agree |
//! | `certification` | the certificate of a result and its sensitivities, by the modules below |
//! | `ladder`, `certificate`, `verdict`, `bands` | runs by independent methods; uncertainties of events; error bands of channels |
//! | `exact`, `truth` | events of the oracle, or of another code with more digits |
//! | `advice` | remedies for a result with too few true digits |
//! | `linearised`, `sensitivity` | derivatives of a run; what the numbers of the case change |
//! | [`stability`] | modes, steady sliding and its stability, growth |
//! | [`work_precision`] | errors and costs of methods by tolerances |
//! | `distribution`, `deadline` | a quantity over many runs; the time limit of a command |

pub mod advice;
mod attractor;
pub mod bands;
pub mod certificate;
mod certification;
mod deadline;
pub mod distribution;
pub mod exact;
mod exponent;
mod finer;
pub(crate) mod forcing;
pub mod headline;
mod kept_run;
pub mod ladder;
pub mod linearised;
mod recorded;
mod repetition;
mod saved_run;
mod section;
pub mod sensitivity;
mod sequence;
mod smooth;
pub mod stability;
pub mod summary;
pub mod truth;
mod verdict;
pub mod warning;
pub mod witness;
pub mod work_precision;

pub use crate::record::{Cycle, CycleStatistics};
pub use attractor::{Attractor, Extremes};
pub use certificate::{Certificate, certify};
pub use certification::{Certified, Certify, Stage, Written};
pub use deadline::Deadline;
pub use exponent::{Exponent, Neighbours};
pub use headline::{HeadlineRow, headline};
pub use kept_run::{KeptReport, KeptReportEnd, KeptRun};
pub use recorded::Recorded;
pub(crate) use recorded::recorded;
pub use saved_run::{SavedReport, SavedRun};
pub use section::{LONGEST_PERIOD, RECURRENCE_TOLERANCE};
pub use stability::Growth;
pub use stability::Modes;
pub use summary::{Outcome, Summary};
pub use warning::Warning;
pub use witness::{Witness, witness};
