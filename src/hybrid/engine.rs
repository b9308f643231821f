//! What advances a segment: one interface for SUNDIALS, closed forms, and a model's own methods.

use super::sundials::SundialsEngine;
use super::{ChosenSolver, Dynamics, Rules};
use crate::sundials::{Counters, SolverError};
use std::sync::Arc;

/// A segment to be advanced.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment<'a, L> {
    /// Constant within the segment.
    pub location: L,
    /// s.
    pub start: f64,
    /// Where it ends if no guard fires before, s.
    pub stop: f64,
    /// At the start.
    pub state: &'a [f64],
}

impl<L> Segment<'_, L> {
    /// How long it is at most, s.
    pub fn span(&self) -> f64 {
        self.stop - self.start
    }
}

/// Guards that fire together, by their indices in [`Dynamics::guards`], of which there are at most 32.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fired(u32);

impl Fired {
    /// One guard alone.
    pub fn one(index: usize) -> Self {
        Fired(1 << index)
    }

    /// Guards by whether they fire.
    pub(crate) fn by_index(fires: impl Iterator<Item = bool>) -> Self {
        Fired(
            fires
                .enumerate()
                .fold(0, |set, (index, fires)| set | u32::from(fires) << index),
        )
    }

    /// Whether guard `index` is among them.
    pub fn contains(self, index: usize) -> bool {
        self.0 & 1 << index != 0
    }

    /// The first of them.
    pub fn first(self) -> usize {
        self.0.trailing_zeros() as usize
    }
}

/// What a step came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Advance {
    /// It ended before the segment does.
    Stepped,
    /// It ended where the segment stops.
    Stop,
    /// It ended where these guards fire.
    Guards(Fired),
    /// No step was taken: what it needs is computed with that of other runs. To be called again after [`Observer::progress`](super::Observer::progress), which lets
    /// them go on; until then [`Engine::state`] is void.
    Waiting,
    /// No guard fires up to where it ended; what follows has to be searched from there, as a segment of its own.
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

/// Integrates segments of a hybrid system, one after the other, and locates their guards. Times are those of the
/// segment's clock, which starts at zero.
pub trait Engine<L>: Send {
    /// Begins a segment.
    ///
    /// # Errors
    /// The solver refuses its settings or the state.
    fn begin(&mut self, segment: &Segment<'_, L>, chosen: &ChosenSolver) -> Result<(), EngineError>;

    /// Takes one step, to the first guard at most, or says that it waits.
    ///
    /// # Errors
    /// A step that cannot be made; the segment then stands where it stood.
    fn advance(&mut self) -> Result<Advance, EngineError>;

    /// Where it stands, s.
    fn time(&self) -> f64;

    /// The state there.
    fn state(&self) -> &[f64];

    /// The state at `tau` (s) within the last step.
    ///
    /// # Errors
    /// Where the state inside a step is another step, which can fail like any.
    fn state_at(&mut self, tau: f64, out: &mut [f64]) -> Result<(), EngineError>;

    /// Whether the last step was one of the slow motion alone: no fast mode is in it, stable or not.
    fn is_slow(&self) -> bool {
        false
    }

    /// When (s), and which guard, was as near to its boundary in the last step as the engine can tell, and turned, or had just
    /// left it.
    fn grazed(&mut self) -> Option<(f64, usize)> {
        None
    }

    /// What has been done since [`Self::begin`].
    ///
    /// # Errors
    /// A counter that the solver does not give.
    fn counters(&mut self) -> Result<Counters, EngineError>;
}

/// The settings of a solver and the engine that was made for them.
type Made<L> = (ChosenSolver, Box<dyn Engine<L>>);

/// The engines of a run: each is made when it is first needed, and begins anew with every segment.
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

    /// The engine for `chosen`, taken out while it is at work.
    pub(super) fn take(
        &mut self,
        chosen: &ChosenSolver,
        segment: &Segment<'_, D::Location>,
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

    /// Puts an engine back for the next segment of its kind.
    pub(super) fn put(&mut self, chosen: &ChosenSolver, engine: Box<dyn Engine<D::Location>>) {
        self.made.push((chosen.clone(), engine));
    }
}
