//! What is computed from a run: stick-slip statistics, and how much the run amplifies a perturbation; and from a case:
//! its modes and its loss of stability.

pub mod growth;
pub mod headline;
pub mod modes;
pub mod smooth_sliding;
pub mod stability_path;
pub mod stick_slip;
pub mod summary;

pub use crate::simulation::{Cycle, CycleStatistics};
pub use growth::Growth;
pub use headline::{Headline, HeadlineRow};
pub use modes::Modes;
pub use stick_slip::StickSlip;
pub use summary::Summary;
