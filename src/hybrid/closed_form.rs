//! Segments in closed form.

use super::{Advance, ChosenSolver, Dynamics, Engine, EngineError, Fired, Segment};
use crate::sundials::Counters;
use std::sync::Arc;

/// How a segment solved in closed form ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ClosedEnd {
    /// A guard fires.
    Guard {
        /// From the segment's start, s.
        after: f64,
        /// Which guard.
        index: usize,
    },
    /// No guard fires as far as this; beyond is not known yet.
    Unknown {
        /// From the segment's start, s.
        after: f64,
    },
    /// No guard fires within the time asked for.
    None,
}

/// Dynamics with locations whose solution is known.
pub trait ClosedForm: Dynamics {
    /// The state `tau` (s) after the state `y` at `t`.
    fn closed_state(&self, location: &Self::Location, t: f64, y: &[f64], tau: f64, out: &mut [f64]);

    /// When the location's first guard fires after the state `y` at `t`, as far as `within` (s).
    fn closed_end(&self, location: &Self::Location, t: f64, y: &[f64], within: f64) -> ClosedEnd;
}

/// Takes a whole segment as one step, by its closed form.
pub struct ClosedFormEngine<D: ClosedForm> {
    dynamics: Arc<D>,
    location: Option<D::Location>,
    /// Start and stop, s.
    span: (f64, f64),
    start: Vec<f64>,
    tau: f64,
    state: Vec<f64>,
}

impl<D: ClosedForm> ClosedFormEngine<D> {
    /// Of a model.
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

impl<D: ClosedForm> Engine<D::Location> for ClosedFormEngine<D> {
    fn begin(&mut self, segment: &Segment<'_, D::Location>, _chosen: &ChosenSolver) -> Result<(), EngineError> {
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
