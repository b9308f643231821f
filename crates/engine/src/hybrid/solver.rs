//! The solver of a segment, with its settings.

use crate::sundials::{CvodeOptions, ErkTable, Multistep, Tolerances};

/// Kind of solver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SolverKind {
    /// CVODE with these options.
    Cvode {
        /// Options of CVODE.
        options: CvodeOptions,
        /// Time (s) after a restart during which guards count as being on their allowed side and steps are kept short.
        settling: f64,
    },
    /// Explicit pair.
    Erk(ErkTable),
    /// Singly diagonally implicit pair, for stiff problems.
    Esdirk,
    /// A solution in closed form, see [`Rules::engine`](super::Rules::engine).
    ClosedForm,
    /// The model's own engine, see [`Rules::engine`](super::Rules::engine).
    Series,
    /// Fixed steps without location of guards, see [`Rules::engine`](super::Rules::engine).
    Rk4,
}

impl SolverKind {
    /// Name in result files.
    pub fn name(&self) -> &'static str {
        match self {
            SolverKind::Cvode { options, .. } => match options.method {
                Multistep::Adams => "cvode-adams",
                Multistep::Bdf => "cvode-bdf",
            },
            SolverKind::Erk(_) => "erk",
            SolverKind::Esdirk => "esdirk",
            SolverKind::ClosedForm => "closed-form",
            SolverKind::Series => "series",
            SolverKind::Rk4 => "rk4",
        }
    }
}

/// A solver and its settings for one segment.
#[derive(Debug, Clone, PartialEq)]
pub struct ChosenSolver {
    /// Kind of solver.
    pub kind: SolverKind,
    /// Tolerances of the local error.
    pub tolerances: Tolerances,
    /// Longest step, s.
    pub max_step: Option<f64>,
    /// Constant step (s) without error control; the last before an event or a stop time is shorter. Only for
    /// [`SolverKind::Erk`] and [`SolverKind::Rk4`].
    pub fixed_step: Option<f64>,
}
