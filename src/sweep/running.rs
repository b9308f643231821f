//! The points of a sweep under way: those that the journal does not hold are run.

use super::error::SweepEnd;
use super::journal::Journal;
use super::quantities::Outcome;
use super::report::SweepProgress;
use super::study::{Point, Study};
use super::worker_pool::{Delivery, Work, WorkerPool};
use crate::case::Setting;
use crate::results::ShardPlan;
use std::collections::HashMap;

/// The points of a study by their numbers.
pub(super) struct Points<'a> {
    study: &'a Study,
    /// Those that tracing a boundary has asked for; else they are as the study has them.
    pub(super) asked: Vec<Vec<Setting>>,
}

impl<'a> Points<'a> {
    pub(super) fn of(study: &'a Study) -> Self {
        let asked = Vec::new();
        Points { study, asked }
    }

    pub(super) fn count(&self) -> u64 {
        self.study.point_count().unwrap_or(self.asked.len() as u64)
    }

    pub(super) fn coordinates(&self, number: u64) -> Vec<Setting> {
        match self.study.point(number) {
            Some(point) => point.coordinates,
            None => self.asked[number as usize].clone(),
        }
    }
}

/// A sweep under way.
pub(super) struct Running<'a> {
    pub(super) work: &'a Work<'a>,
    pub(super) journal: Journal,
    pub(super) worker_pool: &'a mut dyn WorkerPool,
    pub(super) progress: &'a mut dyn FnMut(SweepProgress),
    pub(super) failed: u64,
    /// Points that others have stored, and what they came to where a boundary is traced.
    pub(super) stored: u64,
    pub(super) outcomes: HashMap<u64, Outcome>,
}

impl Running<'_> {
    /// Runs the points below `count`, of a shard if there is one, that the journal does not hold.
    pub(super) fn run_numbers(&mut self, count: u64, part: Option<&ShardPlan>) -> Result<(), SweepEnd> {
        let study = self.work.study;
        // Asked before the journal is lent to the writer of outcomes; a bit for each point.
        let wanted = |number: u64| part.is_none_or(|part| part.holds(number));
        let left: Vec<bool> = (0..count)
            .map(|number| wanted(number) && !self.journal.holds(number))
            .collect();
        let total = part.map_or(count, |part| part.points() as u64);
        let points = (0..count)
            .filter(|&number| left[number as usize])
            .filter_map(|number| study.point(number));
        self.run(points, total, false)
    }

    /// Runs a round of points that come after the first `start`, and returns the outcomes of all of them in their order.
    pub(super) fn round(&mut self, start: u64, coordinates: &[Vec<Setting>]) -> Result<Vec<Outcome>, SweepEnd> {
        let numbered = |k: usize| start + k as u64;
        let held: Vec<bool> = (0..coordinates.len())
            .map(|k| self.journal.holds(numbered(k)))
            .collect();
        let points = coordinates
            .iter()
            .enumerate()
            .filter(|(k, _)| !held[*k])
            .map(|(k, coordinates)| Point {
                number: numbered(k),
                coordinates: coordinates.clone(),
            });
        self.run(points, start + coordinates.len() as u64, true)?;
        let mut outcomes = Vec::with_capacity(coordinates.len());
        for k in 0..coordinates.len() {
            let outcome = match self.outcomes.remove(&numbered(k)) {
                Some(outcome) => Some(outcome),
                None => self.journal.read(numbered(k))?,
            };
            outcomes.push(outcome.ok_or(SweepEnd::Interrupted)?);
        }
        Ok(outcomes)
    }

    fn run(&mut self, mut points: impl Iterator<Item = Point> + Send, total: u64, open: bool) -> Result<(), SweepEnd> {
        let Running {
            work,
            journal,
            worker_pool,
            progress,
            failed,
            stored,
            outcomes,
        } = self;
        let mut show = |done: u64, failed: u64| {
            progress(SweepProgress {
                done,
                total,
                open,
                failed,
            });
        };
        show(journal.points() + *stored, *failed);
        let mut deliver = |delivery: Delivery| {
            let (Delivery::Unstored(group) | Delivery::Stored(group)) = &delivery;
            let failures = group.iter().filter(|outcome| outcome.result.is_err()).count() as u64;
            match delivery {
                Delivery::Unstored(group) => journal.append(&group)?,
                Delivery::Stored(group) => {
                    *stored += group.len() as u64;
                    if open {
                        outcomes.extend(group.into_iter().map(|outcome| (outcome.number, outcome)));
                    }
                }
            }
            *failed += failures;
            show(journal.points() + *stored, *failed);
            Ok(())
        };
        worker_pool.run(work, &mut points, &mut deliver).map_err(SweepEnd::from)
    }
}
