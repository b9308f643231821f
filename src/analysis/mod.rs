//! What is computed from a run: stick-slip statistics, and how much the run amplifies a perturbation; and from a case:
//! its modes and its loss of stability; from a study: methods by tolerances; and how far two runs agree.

pub mod advice;
pub mod bands;
pub mod certificate;
mod certification;
pub mod distribution;
mod eigenvalues;
mod equations;
pub mod exact;
pub mod growth;
mod growth_rate;
pub mod headline;
mod influence;
mod kept_run;
pub mod ladder;
pub mod linearised;
pub mod modes;
pub mod onset;
mod path;
mod rounding;
mod saved_run;
pub mod sensitivity;
pub mod smooth_sliding;
pub mod stability_path;
pub mod stick_slip;
pub mod summary;
pub mod trains;
pub mod truth;
mod verdict;
pub mod warning;
pub mod witness;
pub mod work_precision;

pub use crate::record::{Cycle, CycleStatistics};
pub use certificate::{Certificate, certify};
pub use certification::{Certified, Certify, Stage};
pub use growth::Growth;
pub use headline::{Headline, HeadlineRow};
pub use kept_run::{KeptReport, KeptReportEnd, KeptRun, KeptSummary, KeptWitness};
pub use modes::Modes;
pub use saved_run::{SavedReport, SavedRun};
pub use stick_slip::StickSlip;
pub use summary::Summary;
pub use trains::{SavedTrainReport, SavedTrainRun, TrainSummary};
pub use warning::Warning;
pub use witness::{Witness, witness};
