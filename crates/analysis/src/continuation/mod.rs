//! Branches of steady sliding and of cycles over a parameter of the case, and their special points.
//!
//! Pseudo-arclength continuation follows a branch: a step along its direction, then Newton's method on the plane
//! across it. This passes folds. At a change of the sequence of events, the border is located, and the branch
//! continues with the derivatives of the other side.
//!
//! | module | what it is |
//! |---|---|
//! | `study` | study file |
//! | `manifold` | measurements at a point |
//! | `special` | points of a branch; special points and their test functions |
//! | `follow` | a branch, from point to point |
//! | `border` | changes of the sequence of events |
//! | `ending` | ends of branches; cycles that shrink to steady sliding |
//! | `curve` | special points in two parameters |
//! | `explore` | all branches of a study |
//! | `file` | from a study to its file, and back |

mod border;
mod curve;
mod ending;
mod explore;
mod file;
mod follow;
mod manifold;
mod special;
mod study;

pub use curve::CurvePoint;
pub use ending::EndReason;
pub use explore::{Branch, BranchPoint, Explored, SpecialCurve};
pub use file::{Continuation, ContinuationReport, Stored};
pub use special::Special;
pub(crate) use study::KEY_TABLES;
pub use study::{CONTINUATIONS, ContinuationStudy};
