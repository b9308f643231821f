//! Who runs the points of a sweep: the threads of this process, or those of many.

use super::journal::JournalError;
use super::quantities::Outcome;
use super::runner::{Integrate, Stopped, run_points};
use super::study::{Point, Study};
use std::sync::atomic::AtomicBool;

/// What every worker needs to know.
#[derive(Clone, Copy)]
pub struct Work<'a> {
    /// The points and their cases.
    pub study: &'a Study,
    /// Threads of each process.
    pub workers: usize,
    /// Makes one run.
    pub integrate: &'a Integrate<'a>,
    /// Set from outside to end the work in good order.
    pub stop: &'a AtomicBool,
}

/// Outcomes on their way to the journal of a sweep.
#[derive(Debug)]
pub enum Delivery {
    /// To be stored by whom they are handed to.
    Unstored(Vec<Outcome>),
    /// In the journal of the member that ran them already; without their events.
    Stored(Vec<Outcome>),
}

/// Runs points.
pub trait WorkerPool {
    /// Called once, when the journal of the sweep is open and before the first point.
    fn begin(&mut self) {}

    /// Runs points and hands on what they come to, in the order of completion. A sweep may call this several times.
    ///
    /// # Errors
    /// Why not all points were run.
    fn run(
        &mut self,
        work: &Work,
        points: &mut (dyn Iterator<Item = Point> + Send),
        deliver: &mut dyn FnMut(Delivery) -> Result<(), JournalError>,
    ) -> Result<(), Stopped<JournalError>>;

    /// Called once, after the last point: the others close their journals. Returns those that do not answer any more.
    fn dismiss(&mut self) -> Vec<usize> {
        Vec::new()
    }
}

/// The threads of this process.
#[derive(Debug, Clone, Copy, Default)]
pub struct Threads;

impl WorkerPool for Threads {
    fn run(
        &mut self,
        work: &Work,
        points: &mut (dyn Iterator<Item = Point> + Send),
        deliver: &mut dyn FnMut(Delivery) -> Result<(), JournalError>,
    ) -> Result<(), Stopped<JournalError>> {
        run_points(work.study, points, work.workers, work.stop, work.integrate, |group| {
            deliver(Delivery::Unstored(group))
        })
    }
}
