//! Engines that advance a segment: one interface for SUNDIALS, closed forms, and a model's own methods.

use super::sundials::SundialsEngine;
use super::{ChosenSolver, Dynamics, Rules};
use crate::sundials::{Counters, SolverError};
use std::sync::Arc;

/// A segment to be advanced.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EngineSegment<'a, L> {
    /// Location, constant within the segment.
    pub location: L,
    /// Start time, s.
    pub start: f64,
    /// End time if no guard fires before, s.
    pub stop: f64,
    /// State at the start.
    pub state: &'a [f64],
}

impl<L> EngineSegment<'_, L> {
    /// Longest possible duration, s.
    pub fn span(&self) -> f64 {
        self.stop - self.start
    }
}

/// Guards that fire together, by their indices in [`Dynamics::guards`] (at most 32).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fired(u32);

impl Fired {
    /// One guard alone.
    pub fn one(index: usize) -> Self {
        Fired(1 << index)
    }

    pub(crate) fn by_index(fires: impl Iterator<Item = bool>) -> Self {
        Fired(
            fires
                .enumerate()
                .fold(0, |set, (index, fires)| set | u32::from(fires) << index),
        )
    }

    /// Whether guard `index` fires.
    pub fn contains(self, index: usize) -> bool {
        self.0 & 1 << index != 0
    }

    /// Lowest index.
    pub fn first(self) -> usize {
        self.0.trailing_zeros() as usize
    }
}

/// Outcome of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Advance {
    /// The step ended before the segment does.
    Stepped,
    /// The step ended at the segment's stop time.
    Stop,
    /// The step ended where these guards fire.
    Guards(Fired),
    /// No guard fires up to the end of the step; a new segment continues the search.
    Searched,
}

/// Why an engine failed.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "each variant is described by its message")]
pub enum EngineError {
    #[error(transparent)]
    Sundials(#[from] SolverError),
    #[error("the error test or Newton's method still fails at a step of {step:.1e} s")]
    StepTooShort { step: f64 },
    #[error("a step ended with values that are not finite")]
    NotFinite,
    #[error("the model has no such solver")]
    Missing,
}

/// Integrates segments of a hybrid system, one after the other, and locates their guards. Times (s) are on the
/// segment's clock, which starts at zero.
pub trait Engine<L>: Send {
    /// Begins a segment. Fails if the solver refuses its settings or the state.
    fn begin(&mut self, segment: &EngineSegment<'_, L>, chosen: &ChosenSolver) -> Result<(), EngineError>;

    /// Takes one step, to the first guard at most. If it fails, the segment stays where it was.
    fn advance(&mut self) -> Result<Advance, EngineError>;

    /// Present time, s.
    fn time(&self) -> f64;

    /// Present state.
    fn state(&self) -> &[f64];

    /// Writes the state at `tau` (s) within the last step. Fails if this needs another step, and that step fails.
    fn state_at(&mut self, tau: f64, out: &mut [f64]) -> Result<(), EngineError>;

    /// Whether the last step followed the slow motion alone, without any fast mode, whether stable or unstable.
    fn is_slow(&self) -> bool {
        false
    }

    /// Time (s) and index of a guard with a near miss in the last step: it came as near to its boundary as the engine
    /// can tell and turned, or had just left it.
    fn grazed(&mut self) -> Option<(f64, usize)> {
        None
    }

    /// Work since [`Self::begin`]. Fails if the solver does not report a counter.
    fn counters(&mut self) -> Result<Counters, EngineError>;
}

type Made<L> = (ChosenSolver, Box<dyn Engine<L>>);

pub(super) struct Engines<D: Dynamics> {
    dynamics: Arc<D>,
    made: Vec<Made<D::Location>>,
}

impl<D: Dynamics> Engines<D> {
    pub(super) fn new(dynamics: Arc<D>) -> Self {
        Engines {
            dynamics,
            made: Vec::new(),
        }
    }

    pub(super) fn take(
        &mut self,
        chosen: &ChosenSolver,
        segment: &EngineSegment<'_, D::Location>,
        rules: &impl Rules<D>,
    ) -> Result<Box<dyn Engine<D::Location>>, EngineError> {
        let same = |made: &ChosenSolver| made.kind == chosen.kind && made.fixed_step == chosen.fixed_step;
        if let Some(position) = self.made.iter().position(|(made, _)| same(made)) {
            return Ok(self.made.swap_remove(position).1);
        }
        match rules.engine(&chosen.kind) {
            Some(own) => Ok(own),
            None => Ok(Box::new(SundialsEngine::new(self.dynamics.clone(), chosen, segment)?)),
        }
    }

    pub(super) fn put(&mut self, chosen: &ChosenSolver, engine: Box<dyn Engine<D::Location>>) {
        self.made.push((chosen.clone(), engine));
    }
}
