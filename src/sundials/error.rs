//! What can go wrong in a solver.

use super::flags::Flag;

/// Why a solver call failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SolverError {
    /// A C function returned a flag that is not a success.
    #[error(transparent)]
    Sundials(Box<Failure>),

    /// The steps are too short to move the time, as in front of a point that no step gets over.
    #[error("the steps at t = {time} are too short to be seen in the time{}", cause.map(|c| format!("; {c}")).unwrap_or_default())]
    Stalled {
        /// The last time that the solver reached.
        time: f64,
        /// The value of a callback that is not a number, if there was one lately.
        cause: Option<NonFinite>,
    },

    /// A C function that makes an object returned none: no memory.
    #[error("{function} made nothing: out of memory")]
    Allocation {
        /// The C function.
        function: &'static str,
    },

    /// A slice is not as long as it has to be.
    #[error("{what}: expected {expected} values, got {found}")]
    Length {
        /// Which argument.
        what: &'static str,
        /// The length that the system asks for.
        expected: usize,
        /// The length that came.
        found: usize,
    },

    /// A number is out of its range, or not finite where it has to be.
    #[error("{what} cannot be {value}")]
    Argument {
        /// Which argument.
        what: &'static str,
        /// What came.
        value: f64,
    },

    /// A failed step leaves the solver nowhere; only a restart helps.
    #[error("the solver failed at t = {time} and was not restarted")]
    NotRestarted {
        /// Where the solution handed out last stands.
        time: f64,
    },

    /// There is no step yet (since the start, the last restart or a failure) that could be interpolated.
    #[error("no step has been taken since t = {time}, so there is nothing to interpolate")]
    NoStep {
        /// Where the solution handed out last stands.
        time: f64,
    },
}

/// A C function's failure. Its source is what a callback did, if a callback is to blame.
#[derive(Debug, thiserror::Error)]
#[error("{function} returned {flag} at t = {time}{}{message}{}{}", if message.is_empty() { "" } else { ": " },
    if cause.is_some() { "; " } else { "" }, cause.map(|c| c.to_string()).unwrap_or_default())]
pub struct Failure {
    /// The C function.
    pub function: &'static str,
    /// What it returned.
    pub flag: Flag,
    /// The last time that the solver reached.
    pub time: f64,
    /// What SUNDIALS said about it; may be empty.
    pub message: String,
    /// The value of a callback that is not a number, if that is the reason.
    pub cause: Option<NonFinite>,
}

impl SolverError {
    /// The flag of the C function, if one failed.
    pub fn flag(&self) -> Option<Flag> {
        match self {
            Self::Sundials(failure) => Some(failure.flag),
            _ => None,
        }
    }

    /// The callback value that is not finite, if that is the reason.
    pub fn cause(&self) -> Option<NonFinite> {
        match self {
            Self::Sundials(failure) => failure.cause,
            Self::Stalled { cause, .. } => *cause,
            _ => None,
        }
    }
}

/// Which function of an [`OdeSystem`](super::OdeSystem).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Callback {
    /// [`OdeSystem::rhs`](super::OdeSystem::rhs)
    RightHandSide,
    /// [`OdeSystem::jacobian`](super::OdeSystem::jacobian), or
    /// [`OdeSystem::band_jacobian`](super::OdeSystem::band_jacobian) with row and column of the band
    Jacobian,
    /// [`OdeSystem::roots`](super::OdeSystem::roots)
    Crossing,
}

/// A callback gave a value that is infinite or not a number.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("the {} gave {value} in {} at t = {time}", match callback {
    Callback::RightHandSide => "right-hand side",
    Callback::Jacobian => "Jacobian",
    Callback::Crossing => "crossing function",
}, match callback {
    Callback::Jacobian => format!("row {component}, column {column}"),
    _ => format!("component {component}"),
})]
pub struct NonFinite {
    /// Which function.
    pub callback: Callback,
    /// Index from 0 of the value; of a Jacobian the row.
    pub component: usize,
    /// Index from 0 of the column of a Jacobian; else 0.
    pub column: usize,
    /// Time of the call.
    pub time: f64,
    /// The value.
    pub value: f64,
}
