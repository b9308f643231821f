//! Branches of steady sliding and of cycles over a parameter of the case, and their special points.
//!
//! Pseudo-arclength continuation follows a branch: a step along its direction, then Newton's method on the plane
//! across it. This passes folds. At a change of the sequence of events, the border is located, and the branch
//! continues with the derivatives of the other side.
//!
//! | module | what it is |
//! |---|---|
//! | `study` | study file |
//! | `manifold` | equations about a point, and measurements there |
//! | `special` | kinds of special points, and their test functions |
//! | `station` | point of a branch, and trial of the next one |
//! | `follow` | a branch, from point to point |
//! | `border` | changes of the sequence of events |
//! | `ending` | ends of branches; cycles that shrink to steady sliding |
//! | `curve` | special points in two parameters |
//! | `explore` | all branches of a study |
//! | `run`, `file` | from a study to its file, and back |

mod border;
mod curve;
mod ending;
mod explore;
mod file;
mod follow;
mod manifold;
mod run;
mod special;
mod station;
mod study;

pub use curve::CurvePoint;
pub use ending::EndReason;
pub use explore::{Branch, BranchPoint, ExploreError, Explored, SpecialCurve};
pub use file::Stored;
pub use run::{Continuation, ContinuationError, ContinuationReport};
pub use special::Special;
pub use study::{CONTINUATIONS, ContinuationStudy};
