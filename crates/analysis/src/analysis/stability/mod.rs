//! Stability: modes of a case, steady sliding and its changes, and the growth of a perturbation in a run.
//!
//! | module | what it is |
//! |---|---|
//! | `modes` | modes of a case, and stability of sliding that slows down by itself |
//! | `states` | natural frequencies and damping by state, and operating points |
//! | `modes_report` | the same as data for a report |
//! | `sliding` | steady sliding, and the searches for changes of its stability |
//! | `linear` | the equations about a state as matrices, and their eigenvalues |
//! | `impedance` | negative contact damping that the chains tolerate |
//! | `smooth_sliding` | sliding without oscillation |
//! | `growth_rate`, `growth` | rate and extent of the growth of fast oscillations |
//! | `onset` | the onset of stick-slip against the tolerance |

pub mod growth;
pub mod growth_rate;
mod impedance;
mod linear;
pub mod modes;
mod modes_report;
pub mod onset;
mod sliding;
mod smooth_sliding;
pub mod states;

pub use growth::Growth;
pub use impedance::SlidingVerdict;
pub use modes::Modes;
pub use states::{SystemModes, steady_stability};
