//! Branches of steady sliding and of cycles as a number of the case varies, and their special points.
//!
//! A branch is followed by pseudo-arclength: along its direction to the next point, and by Newton's method on the plane across that,
//! so that it passes folds. Where the sequence of events changes, the border is located, and the branch goes on with the derivatives of
//! the other side.
//!
//! | module | what it is |
//! |---|---|
//! | `study` | the study file |
//! | `manifold` | what is followed: equations about a point, and what is measured there |
//! | `special` | what points are special for, and what changes its sign there |
//! | `station` | a point of a branch, and a trial of the next one |
//! | `follow` | a branch, from point to point |
//! | `border` | where the sequence of events changes, and beyond |
//! | `ending` | why branches end; cycles that shrink to steady sliding |
//! | `curve` | special points in two numbers |
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
pub use run::{Continuation, ContinuationError, ContinuationProgress, ContinuationReport};
pub use special::Special;
pub use study::{CONTINUATIONS, ContinuationStudy};
