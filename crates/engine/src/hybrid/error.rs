//! Reasons for which a run fails.

use super::budget::STRIDE;
use super::{EngineError, ObserverError};

/// Why a run failed.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "each variant is described by its message")]
pub enum RunError {
    #[error("{solver} failed at t = {time:.12} s in {location}: {source}")]
    Engine {
        solver: &'static str,
        time: f64,
        location: String,
        source: EngineError,
    },
    #[error(
        "chattering at t = {time:.12} s: {count} transitions {}, the last from {location} by the guard \"{guard}\"",
        duration(*window)
    )]
    Chattering {
        time: f64,
        count: usize,
        window: f64,
        location: String,
        guard: String,
    },
    #[error(
        "the event budget of {budget} transitions is used up at t = {time:.12} s, the last from {location} by the guard \"{guard}\""
    )]
    TooManyEvents {
        time: f64,
        budget: usize,
        location: String,
        guard: String,
    },
    #[error("the state is not finite at t = {time:.12} s in {location}: component {component} is {value}")]
    NotFinite {
        time: f64,
        location: String,
        component: usize,
        value: f64,
    },
    #[error("a value is not finite at t = {time:.12} s in {location}: {what} is {value}")]
    Overflow {
        time: f64,
        location: String,
        what: &'static str,
        value: f64,
    },
    #[error("the model ends at t = {time:.12} s in {location}: {what}")]
    Outside { time: f64, location: String, what: String },
    #[error("the budget of {budget} steps is used up at t = {time:.12} s in {location}")]
    TooManySteps { time: f64, budget: u64, location: String },
    #[error("the budget of {budget} s of wall time is used up at t = {time:.12} s in {location}")]
    OutOfTime { time: f64, budget: f64, location: String },
    #[error("the run stands still at t = {time:.12} s in {location}: {why}")]
    Standstill { time: f64, location: String, why: String },
    #[error(
        "the run makes no progress at t = {time:.12} s in {location}: the last {STRIDE} steps of {solver} came {covered:.1e} s \
         on, and {ahead:.1e} s lie ahead, more than {most:.0e} such steps"
    )]
    NoProgress {
        time: f64,
        location: String,
        solver: &'static str,
        covered: f64,
        ahead: f64,
        most: f64,
    },
    #[error("{0}")]
    Refused(&'static str),
    #[error(transparent)]
    Observer(ObserverError),
}

/// Reported by an observer if a value is not finite. The run has failed then, not the observer.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{what} is {value} at t = {time:.12} s")]
pub(crate) struct Overflow {
    pub time: f64,
    pub what: &'static str,
    pub value: f64,
}

impl RunError {
    /// # Errors
    /// If a component of the state at `time` (s) is not finite.
    pub(crate) fn check_finite(state: &[f64], time: f64, location: impl FnOnce() -> String) -> Result<(), RunError> {
        match state.iter().enumerate().find(|(_, value)| !value.is_finite()) {
            None => Ok(()),
            Some((component, &value)) => Err(RunError::NotFinite {
                time,
                location: location(),
                component,
                value,
            }),
        }
    }

    pub(crate) fn observed(error: ObserverError, location: impl FnOnce() -> String) -> RunError {
        match error.downcast::<Overflow>() {
            Ok(overflow) => RunError::Overflow {
                time: overflow.time,
                location: location(),
                what: overflow.what,
                value: overflow.value,
            },
            Err(error) => RunError::Observer(error),
        }
    }
}

fn duration(window: f64) -> String {
    if window > 0.0 {
        format!("within {window:.1e} s")
    } else {
        "at one instant".to_owned()
    }
}
