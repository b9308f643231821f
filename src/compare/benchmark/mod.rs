//! A benchmark set: problems with certified answers, stated without this program, and what its rules say of a submission.
//!
//! | file | what it is |
//! |---|---|
//! | `set` | what the set asks for |

mod set;

pub use set::{Combination, Extreme, Problem, ProblemColumn, ProblemSet, Summary, SummaryOf};
