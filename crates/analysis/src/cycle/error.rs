//! Errors of the search for a periodic motion.

use super::forcing::NotPeriodic;
use stickslip_engine::hybrid::RunError;
use stickslip_engine::simulation::ShotError;

/// Error of the search for a periodic motion.
#[derive(Debug, thiserror::Error)]
pub enum CycleError {
    /// The case has no periodic motion in the long run.
    #[error(transparent)]
    NotPeriodic(#[from] NotPeriodic),
    /// A parameter has an invalid value.
    #[error("{0}")]
    NoCase(String),
    /// The motion failed on the way.
    #[error("the motion could not be followed: {0}")]
    Run(String),
    /// The motion has no slip.
    #[error(
        "the contact sticks from {from:.6} s on, over {time:.6} s: the motion has no slip, and no cycle to look for. Start from a \
         state that slips ([initial] and --from initial), or drive it harder"
    )]
    Sticks {
        /// Start of the stick, s.
        from: f64,
        /// Length of the observation, s.
        time: f64,
    },
    /// The relative velocity has no maxima.
    #[error(
        "the section was never crossed: the relative velocity has {found} maxima within {time:.6} s after t = {from:.6} s, and two \
         are needed. The motion has come to rest or to steady sliding; start from a state beside it (--from initial, with \
         [initial] at the cycle), or let it run longer (output.end_time)"
    )]
    NoReturn {
        /// Start of the observation, s.
        from: f64,
        /// Length of the observation, s.
        time: f64,
        /// Number of maxima.
        found: usize,
    },
    /// The motion decays to steady sliding.
    #[error(
        "the motion decays to steady sliding: after t = {from:.6} s the relative velocity varies by less and less. No cycle attracts it; \
         for an unstable one start from a state beside that (--from initial, with [initial] there)"
    )]
    Decays {
        /// Start of the decay, s.
        from: f64,
    },
    /// Newton's method found no cycle.
    #[error(
        "Newton's method found no cycle: from a period of {period:.9} s, after {iterations} iterations, the motion misses itself by \
         {residual:.1e} of its size (at the start by {first:.1e}). Start nearer to the cycle: from the end of a longer run \
         (output.end_time), from a state beside it (--from initial), or with --periods for one that repeats after several turns"
    )]
    Diverged {
        /// Period of the guess, s.
        period: f64,
        /// Number of iterations.
        iterations: usize,
        /// Least relative residual.
        residual: f64,
        /// Relative residual of the guess.
        first: f64,
    },
    /// The motion closes but is not an isolated cycle.
    #[error(
        "the motion closes over {period:.9} s, but is no cycle of its own: its derivatives are singular or missing, as of a contact that \
         sticks, of a motion among others like it, or where two events coincide. Change a parameter a little"
    )]
    Degenerate {
        /// Period, s.
        period: f64,
    },
    /// Newton's method shrank the cycle to rest.
    #[error(
        "Newton's method came to rest: the periodic motion from a period of {period:.9} s shrank to steady sliding or to a stick. \
         Start from a state farther from it (--from initial)"
    )]
    Collapsed {
        /// Period of the guess, s.
        period: f64,
    },
    /// No steady sliding exists in this sense.
    #[error("there is no steady sliding in this sense")]
    NoSteadySliding,
    /// The search was interrupted.
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
