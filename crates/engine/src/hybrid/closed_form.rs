//! Segments in closed form.

use super::{Advance, ChosenSolver, Dynamics, Engine, EngineError, EngineSegment, Fired};
use crate::sundials::Counters;
use std::sync::Arc;

/// End of a segment solved in closed form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ClosedEnd {
    /// A guard fires.
    Guard {
        /// Time since the segment's start, s.
        after: f64,
        /// Index of the guard.
        index: usize,
    },
    /// No guard fires up to here; later times have not been searched.
    Unknown {
        /// Time since the segment's start, s.
        after: f64,
    },
    /// No guard fires within the time asked for.
    None,
}

/// Dynamics with some locations that have a known solution.
pub trait WithClosedForms: Dynamics {
    /// State `tau` (s) after the state `y` at `t`.
    fn closed_state(&self, location: &Self::Location, t: f64, y: &[f64], tau: f64, out: &mut [f64]);

    /// First guard of the location that fires within `within` (s) after the state `y` at `t`.
    fn closed_end(&self, location: &Self::Location, t: f64, y: &[f64], within: f64) -> ClosedEnd;
}

/// Takes a whole segment as one step, in closed form.
pub struct ClosedFormEngine<D: WithClosedForms> {
    dynamics: Arc<D>,
    location: Option<D::Location>,
    /// Start and stop, s.
    span: (f64, f64),
    start: Vec<f64>,
    tau: f64,
    state: Vec<f64>,
}

impl<D: WithClosedForms> ClosedFormEngine<D> {
    /// An engine for a model.
    pub fn new(dynamics: Arc<D>) -> Self {
        let zeros = vec![0.0; dynamics.dimension()];
        ClosedFormEngine {
            dynamics,
            location: None,
            span: (0.0, 0.0),
            start: zeros.clone(),
            tau: 0.0,
            state: zeros,
        }
    }
}

impl<D: WithClosedForms> Engine<D::Location> for ClosedFormEngine<D> {
    fn begin(&mut self, segment: &EngineSegment<'_, D::Location>, _chosen: &ChosenSolver) -> Result<(), EngineError> {
        self.location = Some(segment.location);
        self.span = (segment.start, segment.stop);
        self.start.copy_from_slice(segment.state);
        self.state.copy_from_slice(segment.state);
        self.tau = 0.0;
        Ok(())
    }

    fn advance(&mut self) -> Result<Advance, EngineError> {
        let location = self.location.ok_or(EngineError::Missing)?;
        let (start, stop) = self.span;
        let span = stop - start;
        let (after, advance) = match self.dynamics.closed_end(&location, start, &self.start, span) {
            ClosedEnd::Guard { after, index } if after < span => (after, Advance::Guards(Fired::one(index))),
            ClosedEnd::Unknown { after } if start + after < stop => (after, Advance::Searched),
            _ => (span, Advance::Stop),
        };
        self.dynamics
            .closed_state(&location, start, &self.start, after, &mut self.state);
        self.tau = after;
        Ok(advance)
    }

    fn time(&self) -> f64 {
        self.tau
    }

    fn state(&self) -> &[f64] {
        &self.state
    }

    fn state_at(&mut self, tau: f64, out: &mut [f64]) -> Result<(), EngineError> {
        let location = self.location.ok_or(EngineError::Missing)?;
        self.dynamics
            .closed_state(&location, self.span.0, &self.start, tau, out);
        Ok(())
    }

    fn counters(&mut self) -> Result<Counters, EngineError> {
        Ok(Counters::default())
    }
}
