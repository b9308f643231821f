//! What is computed from a run: stick-slip statistics, and how much the run amplifies a perturbation; and from a case:
//! its modes and its loss of stability; how far a run agrees with a reference; and from a study: methods by tolerances.

pub mod compare;
pub mod growth;
pub mod headline;
pub mod modes;
pub mod stability_path;
pub mod stick_slip;
pub mod summary;
pub mod truth;
pub mod work_precision;

pub use growth::Growth;
pub use headline::{Headline, HeadlineRow};
pub use modes::Modes;
pub use stick_slip::{Cycle, StickSlip};
pub use summary::Summary;
