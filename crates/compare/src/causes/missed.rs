//! A breakaway that a solver steps over: the limit of stick is passed and is no longer at the end of the step.

use super::evidence::Evidence;
use super::judge::ALL;
use super::late::{OneLate, departs_near};
use super::motion::{Played, Traced};
use super::search::Search;
use super::{Cause, Proposal};
use crate::diagnosis::CauseKind;
use std::sync::Arc;
use stickslip_system::model::Mode;
use stickslip_system::record::EventKind;

/// Checks of the torque in a natural period, and the largest number of checks.
const LOOKS: f64 = 64.0;
const MOST_LOOKS: usize = 20_000;
const HALVINGS: usize = 50;
const MOST_EXPANSIONS: usize = 1000;

/// A slip of the reference that does not begin; the stick lasts until its limit is passed again.
#[derive(Debug)]
pub(crate) struct MissedBreakaway {
    /// Time of the slip in the reference, and from then to the next breakaway, s.
    slip: OneLate,
}

/// The time from a breakaway (s) to that at which the limit of stick is passed again, s.
fn next_breakaway(evidence: &Evidence<'_>, traced: &Traced, time: f64) -> Option<f64> {
    let (physics, system) = (evidence.physics, evidence.physics.system());
    let (from, mode, state) = traced.nodes.iter().rfind(|node| node.0 < time)?;
    if *mode != Mode::Stick {
        return None;
    }
    let (mut course, mut y) = (physics.course(), state.clone());
    let mut go =
        |from: f64, to: f64, y: &mut Vec<f64>| course.go(Mode::Stick, (from, to), y, MOST_EXPANSIONS, &mut |_, _| {});
    let excess = |time: f64, y: &[f64]| {
        let outside = physics.course.outside(time);
        let torque = system.tested_torque(&outside, y);
        torque.abs() - system.breakaway_torque(torque, outside.normal_force)
    };
    if !go(*from, time, &mut y) {
        return None;
    }
    let (mut at, mut has_held, mut step) = (time, false, evidence.period / LOOKS);
    let mut looks = 0..MOST_LOOKS;
    loop {
        looks.next()?;
        let mut next = y.clone();
        if at + step > evidence.end || !go(at, at + step, &mut next) {
            return None;
        }
        let exceeds = excess(at + step, &next) > 0.0;
        if has_held && exceeds {
            break;
        }
        has_held |= !exceeds;
        (at, y) = (at + step, next);
    }
    for _ in 0..HALVINGS {
        step *= 0.5;
        let mut middle = y.clone();
        if !go(at, at + step, &mut middle) {
            return None;
        }
        if excess(at + step, &middle) <= 0.0 {
            (at, y) = (at + step, middle);
        }
    }
    Some(at + step - time)
}

impl Cause for MissedBreakaway {
    /// Slips near which the candidate departs from the reference.
    fn propose(search: &Search<'_>) -> Vec<Proposal> {
        let evidence = search.evidence;
        let Some(traced) = evidence.unchanged.first().and_then(Option::as_ref) else {
            return Vec::new();
        };
        let events = departs_near(evidence, traced).map(|number| traced.played.events[number]);
        let slips = events.filter(|event| event.kind == EventKind::Slip);
        let missed = slips.filter_map(|event| {
            let late = next_breakaway(evidence, traced, event.time)?;
            let slip = OneLate {
                time: event.time,
                late,
                joined: true,
            };
            Some(Arc::new(MissedBreakaway { slip }) as Proposal)
        });
        missed.collect()
    }

    fn run(&self, evidence: &Evidence<'_>, start: usize) -> Option<Played> {
        self.slip.run(evidence, start)
    }

    fn least(&self, _: &Evidence<'_>) -> f64 {
        1.0 - ALL
    }

    fn words(&self, search: &Search<'_>) -> (CauseKind, String) {
        let (number, _) = self.slip.event(search.evidence);
        let words = format!(
            "the breakaway at {:.6} s, event {number} of the sequence, is stepped over: the torque is below the limit of stick again at \
             the end of the step, and exceeds it next at {:.6} s",
            self.slip.time,
            self.slip.time + self.slip.late
        );
        (CauseKind::MissedBreakaway, words)
    }

    fn complexity(&self, _: &Evidence<'_>) -> usize {
        1
    }

    fn is_like_steps(&self) -> bool {
        true
    }
}
