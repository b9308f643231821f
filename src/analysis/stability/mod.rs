//! What grows: modes of a case, steady sliding and where it changes its stability, and how far a perturbation grows in a run.
//!
//! | module | what it is |
//! |---|---|
//! | `modes` | the modes of a case, and what becomes of sliding that slows down by itself |
//! | `states` | natural frequencies and damping by state, and operating points |
//! | `modes_report` | the same as data for a report |
//! | `sliding` | steady sliding, and the searches for changes of its stability |
//! | `linear` | the equations about a state as matrices, and their eigenvalues |
//! | `impedance` | how much negative damping of the contact the chains can bear |
//! | `smooth_sliding` | sliding without oscillation |
//! | `growth_rate`, `growth` | how fast the fast oscillation grows, and how far |
//! | `onset` | the onset of stick-slip against the tolerance |

pub mod growth;
mod growth_rate;
mod impedance;
mod linear;
pub mod modes;
mod modes_report;
pub mod onset;
mod sliding;
mod smooth_sliding;
pub mod states;

pub use growth::Growth;
pub use impedance::Verdict;
pub use modes::Modes;
pub use states::{SystemModes, steady_stability};
