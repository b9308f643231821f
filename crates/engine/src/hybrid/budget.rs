//! Limits that end a run without progress: budgets of events and steps, chattering, and steps that become too short.

use crate::error::{Error, ErrorKind, ErrorPlace};
use std::collections::VecDeque;

/// Largest number of successive steps and restarts that leave the time unchanged (within its rounding at the end).
const STANDSTILL: u32 = 10_000;

/// Steps and restarts over which the pace of a run is measured.
const STRIDE: u32 = 100_000;

/// Steps that a search of a closed-form segment without result counts as.
const SEARCH: u32 = 5000;

/// Bound on the steps of a run with restarts. It is larger, because a run of many short segments may become faster
/// later.
const MOST_RESTARTS: f64 = 1e10;

const CHATTER_COUNT: usize = 32;

/// Limits that end a run without progress.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Largest number of events of the sequence.
    pub max_events: usize,
    /// Time (s) within which 32 events of the sequence are chattering.
    pub chatter_window: f64,
    /// Largest number of solver steps.
    pub max_steps: Option<u64>,
    /// The run fails if the pace of a segment predicts more steps than this.
    pub foreseen_steps: Option<f64>,
}

pub(super) struct StepBudget {
    limits: Limits,
    end_time: f64,
    transitions: usize,
    recent: VecDeque<f64>,
    steps: u64,
    came_to: f64,
    idle: u32,
    /// Start of the present stride (s), steps and restarts in it, and whether a new segment has begun since.
    from: f64,
    taken: u32,
    restarted: bool,
}

impl StepBudget {
    pub(super) fn new(limits: Limits, start: f64, end_time: f64) -> Self {
        StepBudget {
            limits,
            end_time,
            transitions: 0,
            recent: VecDeque::with_capacity(CHATTER_COUNT + 1),
            steps: 0,
            came_to: start,
            idle: 0,
            from: start,
            taken: 0,
            restarted: false,
        }
    }

    pub(super) fn transition(&mut self, place: ErrorPlace, guard: &str) -> Result<(), Error> {
        self.transitions += 1;
        if self.transitions > self.limits.max_events {
            return Err(place.too_many_events(self.limits.max_events, guard));
        }
        self.recent.push_back(place.time);
        if self.recent.len() > CHATTER_COUNT {
            self.recent.pop_front();
            let taken = place.time - self.recent[0];
            if taken < self.limits.chatter_window {
                let within = match taken > 0.0 {
                    true => format!(": {} transitions within {taken:.1e} s", self.recent.len()),
                    false => format!(": {} transitions at one instant", self.recent.len()),
                };
                return Err(place.fired(ErrorKind::Chattering, "chattering", &within, guard));
            }
        }
        Ok(())
    }

    pub(super) fn step(&mut self, place: ErrorPlace, stop: f64, solver: &'static str) -> Result<(), Error> {
        self.steps += 1;
        if let Some(budget) = self.limits.max_steps.filter(|&budget| self.steps > budget) {
            return Err(place.too_many_steps(budget));
        }
        self.get_on(place, stop, solver, 1)
    }

    pub(super) fn restart(&mut self, place: ErrorPlace) -> Result<(), Error> {
        self.restarted = true;
        self.get_on(place, self.end_time, "the solvers", 1)
    }

    pub(super) fn search(&mut self, place: ErrorPlace, stop: f64) -> Result<(), Error> {
        self.get_on(place, stop, "the search for a breakaway", SEARCH)
    }

    pub(super) fn search_for_time_event(&mut self, place: ErrorPlace) -> Result<(), Error> {
        self.get_on(place, self.end_time, "the search for the next event", STRIDE)
    }

    fn get_on(&mut self, place: ErrorPlace, stop: f64, solver: &'static str, taken: u32) -> Result<(), Error> {
        if place.time > self.came_to + f64::EPSILON * self.end_time {
            (self.came_to, self.idle) = (place.time, 0);
        } else {
            self.idle += 1;
        }
        if self.idle > STANDSTILL {
            let time = self.came_to;
            let why = format!("{STANDSTILL} steps and restarts in a row have not moved the time");
            return Err(ErrorPlace { time, ..place }.standstill(&why));
        }
        self.taken += taken;
        if self.taken < STRIDE {
            return Ok(());
        }
        let covered = place.time - self.from;
        let foreseen = self.limits.foreseen_steps;
        let (ahead, most) = if self.restarted {
            (self.end_time - place.time, foreseen.map(|_| MOST_RESTARTS))
        } else {
            (stop - place.time, foreseen)
        };
        (self.from, self.taken, self.restarted) = (place.time, 0, false);
        match most {
            Some(most) if ahead * f64::from(STRIDE) > covered * most => {
                let why = format!(
                    ": the last {STRIDE} steps of {solver} came {covered:.1e} s on, and {ahead:.1e} s lie ahead, more than \
                     {most:.0e} such steps"
                );
                Err(place.error(ErrorKind::NoProgress, "the run makes no progress", why))
            }
            _ => Ok(()),
        }
    }
}
