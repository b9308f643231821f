//! Periodic motions: search, description, certification.
//!
//! The period of a forced motion is a multiple of the period of its forcing. The period of an autonomous motion is
//! unknown. Newton's method finds stable and unstable motions, with derivatives through every event
//! (`hybrid::variation`).
//!
//! | module | what it is |
//! |---|---|
//! | `family` | case with varied parameters in the long run, and the common period of its drives |
//! | `equations` | shooting over a period, and Newton's method for it |
//! | `find` | search from a run or a stated state |
//! | `orbit` | description of a cycle: multipliers, events, margins |
//! | `saved` | cycle as a case, and its groups in a file |
//! | `certify` | certification by the independent oracle |
//! | `file` | search and certification into files |

mod certify;
mod equations;
mod family;
mod file;
mod find;
pub mod orbit;
mod saved;

pub use certify::{CycleCertificate, Enclosed, EnclosedEvent, certify};
pub(crate) use equations::{
    Guess, Local, Manifold, NewtonEquations, NewtonSolution, What, collapsed, degenerate, motion, no_steady_sliding,
    scales, solve, tangent,
};
pub use family::Family;
pub use file::{CertifiedCycle, CycleFile, SavedCycle};
pub use find::{CycleSearch, From, LONGEST, find, refine};
pub(crate) use find::{apart, later, to_slip};
pub(crate) use orbit::word;
pub use orbit::{CycleStability, Multiplier, MultiplierKind, NEUTRAL, Nearest, Orbit, OrbitEvent};
pub(crate) use saved::in_units;
pub use saved::{CycleOrigin, from_file};
pub use stickslip_engine::simulation::Border;
