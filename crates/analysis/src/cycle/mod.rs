//! Periodic motions: search, description, certification.
//!
//! The period of a forced motion is a multiple of the period of its forcing. The period of an autonomous motion is
//! unknown. Newton's method finds stable and unstable motions, with derivatives through every event
//! (`hybrid::variation`).
//!
//! | module | what it is |
//! |---|---|
//! | `forcing` | a case in the long run, and the common period of its drives |
//! | `family` | case with varied parameters |
//! | `equations`, `newton` | shooting over a period, and Newton's method for it |
//! | `find` | search from a run or a stated state |
//! | `orbit` | description of a cycle: multipliers, events, margins |
//! | `saved` | cycle as a case, and its groups in a file |
//! | `certify` | certification by the independent oracle |
//! | `error` | errors of the search |

mod certify;
mod equations;
mod error;
mod family;
mod find;
mod forcing;
mod newton;
pub mod orbit;
mod saved;

pub use certify::{CycleCertificate, Enclosed, EnclosedEvent, NotCertified, certify};
pub(crate) use equations::{Guess, Shooting, scales};
pub use error::CycleError;
pub use family::Family;
pub use find::{CycleSearch, From, LONGEST, find, refine};
pub(crate) use find::{apart, later, motion, to_slip};
pub use forcing::NotPeriodic;
pub(crate) use newton::{NewtonEquations, NewtonSolution, NoSolution, solve, tangent};
pub(crate) use orbit::word;
pub use orbit::{CycleStability, Multiplier, MultiplierKind, NEUTRAL, Nearest, Orbit, OrbitEvent};
pub use saved::{CycleFileError, CycleOrigin, from_file};
pub use stickslip_engine::simulation::Border;
