//! Stability: modes of a case, steady sliding and its changes, and the growth of a perturbation in a run.
//!
//! | module | what it is |
//! |---|---|
//! | `modes` | the report of modes, and stability of sliding that slows down by itself |
//! | `states` | natural frequencies and damping by state, and operating points |
//! | `sliding` | steady sliding, and the searches for changes of its stability |
//! | `linear` | the equations about a state as matrices, their eigenvalues, and negative contact damping that the chains tolerate |
//! | `sliding_path` | sliding without oscillation, with the growth rate along it |
//! | `growth` | extent of the growth of fast oscillations; the onset of stick-slip against the tolerance |

pub mod growth;
mod linear;
pub mod modes;
mod sliding;
mod sliding_path;
pub mod states;

pub use growth::Growth;
pub use linear::SlidingVerdict;
pub use modes::Modes;
pub use states::steady_stability;
