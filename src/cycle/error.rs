//! Why a periodic motion is not found.

use super::forcing::NotPeriodic;
use crate::hybrid::RunError;
use crate::simulation::ShotError;

/// Why a periodic motion is not found.
#[derive(Debug, thiserror::Error)]
pub enum CycleError {
    /// The case has none in the long run.
    #[error(transparent)]
    NotPeriodic(#[from] NotPeriodic),
    /// A number of the case has a value that makes no valid case.
    #[error("{0}")]
    NoCase(String),
    /// The motion failed on the way.
    #[error("the motion could not be followed: {0}")]
    Run(String),
    /// There is no slip in the motion.
    #[error(
        "the contact sticks from {from:.6} s on, over {time:.6} s: the motion has no slip, and no cycle to look for. Start from a \
         state that slips ([initial] and --from initial), or drive it harder"
    )]
    Sticks {
        /// s.
        from: f64,
        /// s.
        time: f64,
    },
    /// The relative velocity has no maxima.
    #[error(
        "the section was never crossed: the relative velocity has {found} maxima within {time:.6} s after t = {from:.6} s, and two \
         are needed. The motion has come to rest or to steady sliding; start from a state beside it (--from initial, with \
         [initial] at the cycle), or let it run longer (output.end_time)"
    )]
    NoReturn {
        /// s.
        from: f64,
        /// s.
        time: f64,
        /// How many.
        found: usize,
    },
    /// The motion comes to steady sliding.
    #[error(
        "the motion decays to steady sliding: after t = {from:.6} s the relative velocity varies by less and less. No cycle attracts it; \
         for an unstable one start from a state beside that (--from initial, with [initial] there)"
    )]
    Decays {
        /// s.
        from: f64,
    },
    /// Newton's method came to an end without a cycle.
    #[error(
        "Newton's method found no cycle: from a period of {period:.9} s, after {iterations} iterations, the motion misses itself by \
         {residual:.1e} of its size (at the start by {first:.1e}). Start nearer to the cycle: from the end of a longer run \
         (output.end_time), from a state beside it (--from initial), or with --periods for one that repeats after several turns"
    )]
    Diverged {
        /// Of the guess, s.
        period: f64,
        /// How many.
        iterations: usize,
        /// Of the best, relative.
        residual: f64,
        /// Of the guess, relative.
        first: f64,
    },
    /// A motion that closes, but is no isolated cycle.
    #[error(
        "the motion closes over {period:.9} s, but is no cycle of its own: its derivatives are singular or missing, as of a contact that \
         sticks, of a motion among others like it, or where two events coincide. Change a number of the case a little"
    )]
    Degenerate {
        /// s.
        period: f64,
    },
    /// Newton's method found a motion without a period.
    #[error(
        "Newton's method came to rest: the periodic motion from a period of {period:.9} s shrank to steady sliding or to a stick. \
         Start from a state farther from it (--from initial)"
    )]
    Collapsed {
        /// Of the guess, s.
        period: f64,
    },
    /// Sliding in the other sense, or none.
    #[error("there is no steady sliding in this sense")]
    NoSteadySliding,
    /// It was asked to end.
    #[error("interrupted")]
    Interrupted,
}

impl From<ShotError> for CycleError {
    fn from(error: ShotError) -> CycleError {
        match error {
            ShotError::Interrupted => CycleError::Interrupted,
            ShotError::Run(error) => CycleError::from(error),
        }
    }
}

impl From<RunError> for CycleError {
    fn from(error: RunError) -> CycleError {
        CycleError::Run(error.to_string())
    }
}
