//! A solver of the model's own, beside those of SUNDIALS.

use super::ChosenSolver;
use crate::sundials::Counters;

/// What a step came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Advance {
    /// It ended before the segment does.
    Stepped,
    /// It ended where the segment does.
    Stop,
    /// It ended where the guard of this index of [`Dynamics::guards`](super::Dynamics::guards) fires.
    Guard(usize),
}

/// Why a step failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StepperError {
    #[error("the error test or Newton's method still fails at a step of {step:.1e} s")]
    StepTooShort { step: f64 },
    #[error("a step ended with values that are not finite")]
    NotFinite,
}

/// Integrates segments of a hybrid system with its own equations, and locates their guards. Times are those of the
/// segment's clock, which starts at zero.
pub trait Stepper<L>: Send {
    /// Begins the segment of `location` that starts at `t` with `y` and lasts at most `span` (s).
    fn begin(&mut self, location: &L, t: f64, y: &[f64], span: f64, chosen: &ChosenSolver);

    /// Takes one step, to the first guard at most.
    ///
    /// # Errors
    /// A step that cannot be made, see [`StepperError`]; the segment then stands where it stood.
    fn advance(&mut self) -> Result<Advance, StepperError>;

    /// Where it stands (s).
    fn time(&self) -> f64;

    /// The state there.
    fn state(&self) -> &[f64];

    /// The state at `tau` (s) within the last step.
    fn state_at(&self, tau: f64, out: &mut [f64]);

    /// What has been done since [`Self::begin`].
    fn counters(&self) -> Counters;
}
