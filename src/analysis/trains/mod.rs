//! What is computed from a run of a system, and from a case: its modes.
//!
//! | module | what it is |
//! |---|---|
//! | `modes` | natural frequencies and damping of a case, its steady sliding, and where that loses its stability |
//! | `modes_report` | what is said of them |
//! | `sliding` | steady sliding, and the searches for changes of its stability |
//! | `linear` | the equations about a state as matrices, and their eigenvalues |
//! | `impedance` | how much negative damping of the contact the trains can bear |

mod impedance;
mod linear;
pub mod modes;
mod modes_report;
mod sliding;

pub use impedance::Verdict;
pub use modes::{TrainModes, steady_stability};
