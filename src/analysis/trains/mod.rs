//! What is computed from a run of two trains, and from a case: its modes.
//!
//! | module | what it is |
//! |---|---|
//! | `certification` | how far its events can be from the exact ones |
//! | `bands` | how far its rows can be |
//! | `sensitivity` | what the numbers of the case do to its events |
//! | `witness` | whether another method finds the same events |
//! | `modes` | natural frequencies and damping of a case, its steady sliding, and where that loses its stability |
//! | `modes_report` | what is said of them |
//! | `sliding` | steady sliding, and the searches for changes of its stability |
//! | `linear` | the equations about a state as matrices, and their eigenvalues |
//! | `impedance` | how much negative damping of the contact the trains can bear |

mod bands;
mod certification;
mod impedance;
mod linear;
pub mod modes;
mod modes_report;
mod sensitivity;
mod sliding;
mod witness;

pub use bands::{TrainBand, TrainBands, TrainRecord, TrainRow, TrainStretch};
pub use certification::{CertifiedTrainEvent, TrainCertificate, TrainCertifyRequest, TrainRung, certify};
pub use impedance::Verdict;
pub use modes::{TrainModes, steady_stability};
pub use sensitivity::{Slope, TrainSensitivities, sensitivities};
pub use witness::TrainWitness;
pub(crate) use witness::witness;
