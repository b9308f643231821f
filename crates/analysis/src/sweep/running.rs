//! Points of a running sweep: those that are not in the journal.

use super::error::SweepEnd;
use super::executor::{Executor, run_elsewhere};
use super::journal::Journal;
use super::outcome::PointOutcome;
use super::runner::{Integrate, run_points};
use super::study::{Study, StudyPoint};
use std::collections::HashSet;
use stickslip_case::Setting;
use stickslip_files::ShardPlan;
use stickslip_system::watch::Watch;

pub(super) struct RunningPoints<'a> {
    study: &'a Study,
    /// Points of a traced boundary. The study itself has all other points.
    pub(super) asked: Vec<Vec<Setting>>,
}

impl<'a> RunningPoints<'a> {
    pub(super) fn of(study: &'a Study) -> Self {
        let asked = Vec::new();
        RunningPoints { study, asked }
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

pub(super) struct Running<'a> {
    pub(super) study: &'a Study,
    pub(super) workers: usize,
    pub(super) integrate: &'a Integrate<'a>,
    pub(super) executor: Option<&'a mut dyn Executor>,
    pub(super) watch: &'a dyn Watch,
    pub(super) journal: Journal,
    pub(super) failed: u64,
}

impl Running<'_> {
    /// Runs the points below `count`, or of a shard, that are not in the journal.
    pub(super) fn run_numbers(&mut self, count: u64, part: Option<&ShardPlan>) -> Result<(), SweepEnd> {
        let study = self.study;
        // Determined before the writer of outcomes borrows the journal.
        let held: HashSet<u64> = self.journal.numbers().collect();
        let total = part.map_or(count, |part| part.points() as u64);
        let points = (0..count)
            .filter(|&number| part.is_none_or(|part| part.holds(number)) && !held.contains(&number))
            .filter_map(|number| study.point(number));
        self.run(points, total, false)
    }

    /// Runs a round of points after the first `start`, and returns all their outcomes in order.
    pub(super) fn round(&mut self, start: u64, coordinates: &[Vec<Setting>]) -> Result<Vec<PointOutcome>, SweepEnd> {
        let numbered = |k: usize| start + k as u64;
        let held: Vec<bool> = (0..coordinates.len())
            .map(|k| self.journal.holds(numbered(k)))
            .collect();
        let points = coordinates
            .iter()
            .enumerate()
            .filter(|(k, _)| !held[*k])
            .map(|(k, coordinates)| StudyPoint {
                number: numbered(k),
                coordinates: coordinates.clone(),
            });
        self.run(points, start + coordinates.len() as u64, true)?;
        let mut outcomes = Vec::with_capacity(coordinates.len());
        for k in 0..coordinates.len() {
            outcomes.push(self.journal.read(numbered(k))?.ok_or(SweepEnd::Interrupted)?);
        }
        Ok(outcomes)
    }

    fn run(&mut self, points: impl Iterator<Item = StudyPoint> + Send, total: u64, open: bool) -> Result<(), SweepEnd> {
        let Running {
            study,
            workers,
            integrate,
            executor,
            watch,
            journal,
            failed,
        } = self;
        let more = if open { " or more" } else { "" };
        let show = |done: u64, failed: u64| {
            let failures = match failed {
                0 => String::new(),
                failed => format!(", {failed} failed"),
            };
            let _ = watch.at(
                done as f64,
                total as f64,
                format_args!("{total}{more} points{failures}"),
            );
        };
        show(journal.points(), *failed);
        let deliver = |group: Vec<PointOutcome>| {
            journal.append(&group)?;
            *failed += group.iter().filter(|outcome| outcome.result.is_err()).count() as u64;
            show(journal.points(), *failed);
            Ok(())
        };
        match executor {
            Some(executor) => run_elsewhere(study, points, &mut **executor, *watch, deliver),
            None => run_points(study, points, *workers, *watch, *integrate, deliver).map_err(SweepEnd::from),
        }
    }
}
