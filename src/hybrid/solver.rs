//! The solver of a segment, with its settings.

use crate::sundials::{CvodeOptions, ErkTable, EsdirkTable, Multistep, Tolerances};

/// Which solver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SolverKind {
    /// CVODE with these options. For `settling` (s) after a segment's start its guards count as being on their allowed side.
    Cvode {
        /// Of CVODE.
        options: CvodeOptions,
        /// After a restart, s: until then the first steps are kept short.
        settling: f64,
    },
    /// Explicit pair.
    Erk(ErkTable),
    /// Singly diagonally implicit pair.
    Esdirk(EsdirkTable),
    /// [`ClosedForm`](super::ClosedForm).
    ClosedForm,
    /// The model's own, see [`Rules::engine`](super::Rules::engine).
    Series,
}

impl SolverKind {
    /// The name in result files.
    pub fn name(&self) -> &'static str {
        match self {
            SolverKind::Cvode { options, .. } => match options.method {
                Multistep::Adams => "cvode-adams",
                Multistep::Bdf => "cvode-bdf",
            },
            SolverKind::Erk(_) => "erk",
            SolverKind::Esdirk(_) => "esdirk",
            SolverKind::ClosedForm => "closed-form",
            SolverKind::Series => "series",
        }
    }
}

/// A solver with its settings for one segment.
#[derive(Debug, Clone, PartialEq)]
pub struct ChosenSolver {
    /// Which solver.
    pub kind: SolverKind,
    /// Of its local error.
    pub tolerances: Tolerances,
    /// s.
    pub max_step: Option<f64>,
    /// Steps of this length (s) without control of the error; the last before an event or a stop time is shorter. Only
    /// [`SolverKind::Erk`] takes them.
    pub fixed_step: Option<f64>,
}
