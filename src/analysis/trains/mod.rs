//! What is computed from a run of two trains: statistics, and the attractor that it comes to; and from a case: its modes.
//!
//! | module | what it is |
//! |---|---|
//! | `certification` | how far its events can be from the exact ones |
//! | `bands` | how far its rows can be |
//! | `sensitivity` | what the numbers of the case do to its events |
//! | `attractor` | whether the motion repeats itself, with which period, and its extremes |
//! | `summary` | the headline of a run |
//! | `headline` | the same in words |
//! | `witness` | whether another method finds the same events |
//! | `saved_run` | a run into its result file |
//! | `modes` | natural frequencies and damping of a case, its steady sliding, and where that loses its stability |
//! | `modes_report` | what is said of them |
//! | `sliding` | steady sliding, and the searches for changes of its stability |
//! | `linear` | the equations about a state as matrices, and their eigenvalues |
//! | `impedance` | how much negative damping of the contact the trains can bear |

mod attractor;
mod bands;
mod certification;
pub mod headline;
mod impedance;
mod linear;
pub mod modes;
mod modes_report;
mod saved_run;
mod sensitivity;
mod sliding;
mod summary;
mod witness;

pub use attractor::{Attractor, Extremes, LONGEST_PERIOD, RECURRENCE_TOLERANCE};
pub use bands::{TrainBand, TrainBands, TrainRecord, TrainRow, TrainStretch};
pub use certification::{CertifiedTrainEvent, TrainCertificate, TrainCertifyRequest, TrainRung, certify};
pub use impedance::Verdict;
pub use modes::{TrainModes, steady_stability};
pub(crate) use saved_run::recorded;
pub use saved_run::{SavedTrainReport, SavedTrainRun, summarised};
pub use sensitivity::{Slope, TrainSensitivities, sensitivities};
pub use summary::{Outcome, TrainSummary};
pub(crate) use witness::witness;
pub use witness::{TrainWitness, warnings};
