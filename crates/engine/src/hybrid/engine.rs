//! Engines that advance a segment: one interface for SUNDIALS, closed forms, and a model's own methods.

use super::sundials::SundialsEngine;
use super::{ChosenSolver, Rules, SystemDynamics, SystemLocation};
use crate::Error;
use crate::sundials::Counters;
use std::sync::Arc;

/// A segment to be advanced.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EngineSegment<'a> {
    /// Location, constant within the segment.
    pub location: SystemLocation,
    /// Start time, s.
    pub start: f64,
    /// End time if no guard fires before, s.
    pub stop: f64,
    /// State at the start.
    pub state: &'a [f64],
}

impl EngineSegment<'_> {
    /// Longest possible duration, s.
    pub fn span(&self) -> f64 {
        self.stop - self.start
    }
}

/// Guards that fire together, by their indices in a location (at most 32).
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

/// Integrates segments of a hybrid system, one after the other, and locates their guards. Times (s) are on the
/// segment's clock, which starts at zero.
pub trait Engine: Send {
    /// Begins a segment. Fails if the solver refuses its settings or the state.
    fn begin(&mut self, segment: &EngineSegment<'_>, chosen: &ChosenSolver) -> Result<(), Error>;

    /// Takes one step, to the first guard at most. If it fails, the segment stays where it was.
    fn advance(&mut self) -> Result<Advance, Error>;

    /// Present time, s.
    fn time(&self) -> f64;

    /// Present state.
    fn state(&self) -> &[f64];

    /// Writes the state at `tau` (s) within the last step. Fails if this needs another step, and that step fails.
    fn state_at(&mut self, tau: f64, out: &mut [f64]) -> Result<(), Error>;

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
    fn counters(&mut self) -> Result<Counters, Error>;
}

pub(super) struct Engines {
    dynamics: Arc<SystemDynamics>,
    made: Vec<(ChosenSolver, Box<dyn Engine>)>,
}

impl Engines {
    pub(super) fn new(dynamics: Arc<SystemDynamics>) -> Self {
        Engines {
            dynamics,
            made: Vec::new(),
        }
    }

    pub(super) fn take(
        &mut self,
        chosen: &ChosenSolver,
        segment: &EngineSegment<'_>,
        rules: &dyn Rules,
    ) -> Result<Box<dyn Engine>, Error> {
        let same = |made: &ChosenSolver| made.kind == chosen.kind && made.fixed_step == chosen.fixed_step;
        if let Some(position) = self.made.iter().position(|(made, _)| same(made)) {
            return Ok(self.made.swap_remove(position).1);
        }
        match rules.engine(&chosen.kind) {
            Some(own) => Ok(own),
            None => Ok(Box::new(SundialsEngine::new(self.dynamics.clone(), chosen, segment)?)),
        }
    }

    pub(super) fn put(&mut self, chosen: &ChosenSolver, engine: Box<dyn Engine>) {
        self.made.push((chosen.clone(), engine));
    }
}
