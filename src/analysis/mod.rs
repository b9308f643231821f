//! What is computed from a run: stick-slip statistics, and how much the run amplifies a perturbation.

pub mod growth;
pub mod headline;
pub mod stick_slip;
pub mod summary;

pub use growth::Growth;
pub use headline::{Headline, HeadlineRow};
pub use stick_slip::{Cycle, StickSlip};
pub use summary::Summary;
