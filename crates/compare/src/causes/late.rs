//! One event that is late, an early stick, or a breakaway that a solver steps over; all other events by the equations.

use super::evidence::Evidence;
use super::fit::fitted;
use super::judge::{ALL, Judged, OF_FITTED};
use super::motion::{MotionNode, Played, Traced};
use super::search::Search;
use super::{Cause, Proposal, proposals};
use crate::diagnosis::CauseKind;
use std::ops::Range;
use stickslip_engine::workers::over_processors;
use stickslip_system::model::Mode;
use stickslip_system::record::EventKind;
use stickslip_system::record::sequence::SequenceEvent;

const MOST_EXPANSIONS: usize = 1000;

/// Initial delays of a fitted event, in natural periods.
const BEGIN: [f64; 6] = [1e-4, 1e-3, 3e-3, 0.01, 0.025, 0.06];
/// Largest delay, in natural periods; beyond it the event is another.
const FAR: f64 = 0.125;
/// Differences above this part of the largest show where a candidate departs from the reference.
const PARTS_AT: f64 = 1e-3;

/// An event of the reference that comes late, or a stick that comes early; or a slip that does not begin, so that the
/// stick lasts until its limit is passed again.
#[derive(Debug)]
pub(crate) struct OneLate {
    /// Time of the event in the reference, and its delay, s.
    time: f64,
    late: f64,
    /// The surfaces then have one speed.
    joined: bool,
    missed: bool,
}

/// Numbers of the events of a run near which the candidate departs from it.
fn departs_near(evidence: &Evidence<'_>, traced: &Traced) -> Range<usize> {
    let events = &traced.played.events;
    let parts = match evidence.observation {
        Some(seen) => seen.parts(PARTS_AT),
        None => {
            let mut pairs = evidence.word.iter().zip(events);
            let far = |(a, b): &(&SequenceEvent, &SequenceEvent)| (a.time - b.time).abs() > PARTS_AT * evidence.period;
            pairs.find(far).map(|(a, b)| a.time.max(b.time))
        }
    };
    let Some(parts) = parts else { return 0..0 };
    let next = events.partition_point(|event| event.time <= parts);
    next.saturating_sub(2)..(next + 1).min(events.len())
}

impl OneLate {
    /// Number of the event in the reference's sequence, and its kind.
    fn event(&self, evidence: &Evidence<'_>) -> (usize, &'static str) {
        let off = |event: &SequenceEvent| (event.time - self.time).abs();
        let events = evidence.reference.iter().enumerate();
        let nearest = events.min_by(|a, b| off(a.1).total_cmp(&off(b.1)));
        nearest.map_or((0, "event"), |(number, event)| (number, event.kind.name()))
    }

    /// Delay (s) with which the candidate shows an event of the reference.
    fn shown(evidence: &Evidence<'_>, event: &SequenceEvent) -> Option<f64> {
        let late = |theirs: &SequenceEvent| theirs.time - event.time;
        let same = evidence.word.iter().filter(|theirs| theirs.kind == event.kind);
        let nearest = same.min_by(|a, b| late(a).abs().total_cmp(&late(b).abs()))?;
        Some(late(nearest)).filter(|late| *late != 0.0 && late.abs() < FAR * evidence.period)
    }

    fn motion(&self, evidence: &Evidence<'_>, traced: &Traced) -> Option<Played> {
        let number = traced.played.events.iter().position(|event| event.time == self.time)?;
        let event = traced.played.events[number];
        if self.late < 0.0 && event.kind != EventKind::Stick {
            return None;
        }
        let at = event.time + self.late;
        let is_before = |node: &&MotionNode| node.0 < event.time.min(at);
        let before: Vec<MotionNode> = traced.nodes.iter().filter(is_before).cloned().collect();
        let (time, mode, state) = before.last()?;
        let (mut course, mut y) = (evidence.physics.course(), state.clone());
        if !course.go(*mode, (*time, at), &mut y, MOST_EXPANSIONS, &mut |_, _| {}) {
            return None;
        }
        if self.joined {
            evidence.physics.system().join(&course.outside(at), &mut y);
        }
        let rest = evidence.traced_from(at, y)?;
        let is_kept = |event: &&SequenceEvent| event.time < at;
        let events = traced.played.events[..number].iter().filter(is_kept).copied();
        let moved = SequenceEvent { time: at, ..event };
        let after = rest.played.events.iter().filter(|event| event.time > at).copied();
        let played = Played {
            events: events.chain([moved]).chain(after).collect(),
            steps: traced.played.steps + rest.played.steps,
            values: Vec::new(),
        };
        let nodes = before.into_iter().chain(rest.nodes).collect();
        let traced = Traced { nodes, played };
        Some(match evidence.observation {
            Some(observation) => traced.sampled(&mut course, evidence.physics, observation),
            None => traced.played,
        })
    }
}

impl Cause for OneLate {
    /// Events near which the candidate departs from the reference, each with the delay that brings the motion closest
    /// to it.
    fn propose(search: &Search<'_>) -> Vec<Proposal> {
        let evidence = search.evidence;
        let Some(traced) = evidence.unchanged.first().and_then(Option::as_ref) else {
            return Vec::new();
        };
        let (events, period) = (&traced.played.events, evidence.period);
        let numbers = departs_near(evidence, traced);
        // The surfaces have one speed in a stick. At a reversal a solver may have set them equal.
        let all = numbers.flat_map(|number| match events[number].kind {
            EventKind::Reversal => vec![(number, false), (number, true)],
            _ => vec![(number, true)],
        });
        let all: Vec<(usize, bool)> = all.collect();
        let found = over_processors(all.len(), &|| false, |k| {
            let (number, joined) = all[k];
            let time = events[number].time;
            let with = |late: f64| OneLate {
                time,
                late,
                joined,
                missed: false,
            };
            let play = |late: f64, until: f64| with(late).motion(&evidence.until(until), traced);
            // The motion is at most quadratic in the delay of a stick, so near zero there is no slope.
            let left = |late: &f64| {
                let judged = evidence.judged(&play(*late, f64::INFINITY)?, f64::INFINITY)?;
                Some((judged.left, *late))
            };
            let shown = OneLate::shown(evidence, &events[number]);
            let begin: Vec<f64> = BEGIN.map(|part| part * period).into_iter().chain(shown).collect();
            let (_, begin) = begin.iter().filter_map(left).min_by(|a, b| a.0.total_cmp(&b.0))?;
            let late = fitted(evidence, begin, begin, &play)?;
            (late.abs() <= FAR * period).then(|| with(late))
        });
        let slips = departs_near(evidence, traced).filter(|number| events[*number].kind == EventKind::Slip);
        let missed = slips.filter_map(|number| {
            let time = events[number].time;
            Some(OneLate {
                time,
                late: next_breakaway(evidence, traced, time)?,
                joined: true,
                missed: true,
            })
        });
        proposals(found.into_iter().flatten().chain(missed))
    }

    fn run(&self, evidence: &Evidence<'_>, start: usize) -> Option<Played> {
        self.motion(evidence, evidence.unchanged.get(start)?.as_ref()?)
    }

    fn judge(&self, evidence: &Evidence<'_>, played: &Played) -> Option<Judged> {
        // An event that the candidate does not have is not late.
        match self.missed || evidence.has_event(self.time + self.late) {
            true => evidence.judged(played, f64::INFINITY),
            false => Some(Judged::far()),
        }
    }

    fn least(&self, _: &Evidence<'_>) -> f64 {
        if self.missed { 1.0 - ALL } else { OF_FITTED }
    }

    fn complexity(&self, _: &Evidence<'_>) -> usize {
        if self.missed { 1 } else { 2 }
    }

    fn is_like_steps(&self) -> bool {
        true
    }

    fn words(&self, search: &Search<'_>) -> (CauseKind, String) {
        let (number, kind) = self.event(search.evidence);
        if self.missed {
            let words = format!(
                "the breakaway at {:.6} s, event {number} of the sequence, is stepped over: the torque is below the limit of stick again \
                 at the end of the step, and exceeds it next at {:.6} s",
                self.time,
                self.time + self.late
            );
            return (CauseKind::MissedBreakaway, words);
        }
        let side = if self.late < 0.0 { "early" } else { "late" };
        let words = format!(
            "one event alone is wrong: its {kind} at {:.6} s, event {number} of the sequence, is {:.3e} s {side}, and what comes \
             after follows from that",
            self.time,
            self.late.abs()
        );
        (CauseKind::EventLate, words)
    }
}

/// Checks of the torque in a natural period, and the largest number of checks.
const LOOKS: f64 = 64.0;
const MOST_LOOKS: usize = 20_000;
const HALVINGS: usize = 50;

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
