//! Periodic motions: found, described, certified.
//!
//! A periodic motion comes back to where it was after its period: that of what drives it, or a whole multiple; or of an autonomous
//! system one that is unknown as well. Newton's method finds it whether it is stable or not, with the derivatives that are carried
//! through every event (`hybrid::variation`).
//!
//! | module | what it is |
//! |---|---|
//! | `forcing` | a case in the long run, and the common period of its drives |
//! | `family` | a case with numbers that vary |
//! | `equations`, `newton` | shooting over a period, and Newton's method for it |
//! | `find` | the search, from a run or a stated state |
//! | `orbit` | what is said of a cycle: multipliers, events, margins |
//! | `saved` | a cycle as a case, and what its file says of it |
//! | `certify` | a cycle by the independent oracle, with digits that are known to be true |
//! | `error` | why there is none |

mod certify;
mod equations;
mod error;
mod family;
mod find;
mod forcing;
mod newton;
mod orbit;
mod saved;

pub use crate::simulation::Border;
pub use certify::{CycleCertificate, Enclosed, NotCertified, certify};
pub(crate) use equations::{Guess, Shooting, scales};
pub use error::CycleError;
pub use family::Family;
pub use find::{From, LONGEST, Search, find, refine};
pub(crate) use find::{apart, later, motion, to_slip};
pub use forcing::NotPeriodic;
pub(crate) use newton::{Equations, NoSolution, Solution, solve, tangent};
pub(crate) use orbit::word;
pub use orbit::{Multiplier, MultiplierKind, NEUTRAL, Nearest, Orbit, OrbitEvent, Stability};
pub use saved::{CycleFileError, Origin, from_file};
