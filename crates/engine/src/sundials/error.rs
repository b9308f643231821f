//! Errors of a solver.

use super::flags::Flag;

/// Why a solver call failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SolverError {
    /// A C function returned a failure flag.
    #[error(transparent)]
    Sundials(Box<Failure>),

    /// The steps are too short to advance the time, as before a singularity.
    #[error("the steps at t = {time} are too short to be seen in the time{}", cause.map(|c| format!("; {c}")).unwrap_or_default())]
    Stalled {
        /// Last time that the solver reached.
        time: f64,
        /// Recent callback value that was not finite.
        cause: Option<NonFinite>,
    },

    /// A C constructor returned no object: out of memory.
    #[error("{function} made nothing: out of memory")]
    Allocation {
        /// The C function.
        function: &'static str,
    },

    /// A slice has the wrong length.
    #[error("{what}: expected {expected} values, got {found}")]
    Length {
        /// Name of the argument.
        what: &'static str,
        /// Required length.
        expected: usize,
        /// Given length.
        found: usize,
    },

    /// A value is out of range, or not finite.
    #[error("{what} cannot be {value}")]
    Argument {
        /// Name of the argument.
        what: &'static str,
        /// Given value.
        value: f64,
    },

    /// A step failed, and the solver has not been restarted.
    #[error("the solver failed at t = {time} and was not restarted")]
    NotRestarted {
        /// Time of the solution handed out last.
        time: f64,
    },

    /// No step to interpolate since the start, the last restart or a failure.
    #[error("no step has been taken since t = {time}, so there is nothing to interpolate")]
    NoStep {
        /// Time of the solution handed out last.
        time: f64,
    },
}

/// A C function's failure, with the callback value that caused it.
#[derive(Debug, thiserror::Error)]
#[error("{function} returned {flag} at t = {time}{}{message}{}{}", if message.is_empty() { "" } else { ": " },
    if cause.is_some() { "; " } else { "" }, cause.map(|c| c.to_string()).unwrap_or_default())]
pub struct Failure {
    /// The C function.
    pub function: &'static str,
    /// Returned flag.
    pub flag: Flag,
    /// Last time that the solver reached.
    pub time: f64,
    /// Message of SUNDIALS; may be empty.
    pub message: String,
    /// Callback value that was not finite, if it caused the failure.
    pub cause: Option<NonFinite>,
}

impl SolverError {
    /// Flag of the failed C function.
    pub fn flag(&self) -> Option<Flag> {
        match self {
            Self::Sundials(failure) => Some(failure.flag),
            _ => None,
        }
    }

    /// Callback value that was not finite, if it caused the failure.
    pub fn cause(&self) -> Option<NonFinite> {
        match self {
            Self::Sundials(failure) => failure.cause,
            Self::Stalled { cause, .. } => *cause,
            _ => None,
        }
    }
}

/// A function of an [`OdeSystem`](super::OdeSystem).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Callback {
    /// [`OdeSystem::rhs`](super::OdeSystem::rhs)
    RightHandSide,
    /// [`OdeSystem::jacobian`](super::OdeSystem::jacobian); or, with row and column in band coordinates,
    /// [`OdeSystem::band_jacobian`](super::OdeSystem::band_jacobian)
    Jacobian,
    /// [`OdeSystem::roots`](super::OdeSystem::roots)
    Crossing,
}

/// A callback returned an infinite value or NaN.
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
    /// The callback.
    pub callback: Callback,
    /// Index of the value, from 0; in a Jacobian the row.
    pub component: usize,
    /// Column in a Jacobian, from 0; otherwise 0.
    pub column: usize,
    /// Time of the call.
    pub time: f64,
    /// The value.
    pub value: f64,
}
