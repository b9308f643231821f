//! One late event, or one early stick; all other events by the equations.

use super::fit::Fit;
use super::play::{PlayNode, Played, Traced};
use super::{Bench, Change, PlayScore, TrialStart};
use stickslip_engine::simulation::Course;
use stickslip_engine::workers::over_processors;
use stickslip_system::record::EventKind;
use stickslip_system::record::sequence::SequenceEvent;

const MOST_EXPANSIONS: usize = 1000;

/// Initial delays of a fitted event, in natural periods.
const BEGIN: [f64; 6] = [1e-4, 1e-3, 3e-3, 0.01, 0.025, 0.06];
/// Largest delay, in natural periods; beyond it the event is another.
const FAR: f64 = 0.125;
/// Differences above this part of the largest show where a candidate departs from the reference.
const PARTS_AT: f64 = 1e-3;

impl Bench<'_> {
    /// Events near which the candidate departs from the reference, each with the delay that brings the motion closest
    /// to it.
    pub(super) fn one_late(&self, traced: &Traced) -> Vec<Change> {
        let events = &traced.played.events;
        let period = self.evidence.period;
        let parts = match self.evidence.observation {
            Some(seen) => seen.parts(PARTS_AT),
            None => {
                let mut pairs = self.evidence.word.iter().zip(events);
                let far = |(a, b): &(&SequenceEvent, &SequenceEvent)| (a.time - b.time).abs() > PARTS_AT * period;
                pairs.find(far).map(|(a, b)| a.time.max(b.time))
            }
        };
        let Some(parts) = parts else { return Vec::new() };
        let next = events.partition_point(|event| event.time <= parts);
        let numbers = next.saturating_sub(2)..(next + 1).min(events.len());
        // The surfaces have one speed in a stick. At a reversal a solver may have set them equal.
        let all = numbers.flat_map(|number| match events[number].kind {
            EventKind::Reversal => vec![(number, false), (number, true)],
            _ => vec![(number, true)],
        });
        let all: Vec<(usize, bool)> = all.collect();
        let found = over_processors(all.len(), &|| false, |k| {
            let (number, joined) = all[k];
            let play = |late: f64| self.late(traced, number, late, joined);
            // The motion is at most quadratic in the delay of a stick, so near zero there is no slope.
            let left = |late: &f64| Some((self.evidence.judged(&play(*late)?, f64::INFINITY)?.left, *late));
            let shown = self.shown_late(&events[number]);
            let begin: Vec<f64> = BEGIN.map(|part| part * period).into_iter().chain(shown).collect();
            let (_, begin) = begin.iter().filter_map(left).min_by(|a, b| a.0.total_cmp(&b.0))?;
            let fit = Fit {
                evidence: &self.evidence,
                play: &|values: &[f64]| play(values[0]),
                units: &[begin],
            };
            let late = fit.refined(vec![begin])?.values[0];
            (late.abs() <= FAR * period).then_some(Change::Late(events[number].time, late, joined))
        });
        found.into_iter().flatten().collect()
    }

    fn shown_late(&self, event: &SequenceEvent) -> Option<f64> {
        let late = |theirs: &SequenceEvent| theirs.time - event.time;
        let same = self.evidence.word.iter().filter(|theirs| theirs.kind == event.kind);
        let nearest = same.min_by(|a, b| late(a).abs().total_cmp(&late(b).abs()))?;
        Some(late(nearest)).filter(|late| *late != 0.0 && late.abs() < FAR * self.evidence.period)
    }

    pub(super) fn traced(&self, start: usize) -> Option<Traced> {
        let case = self.numbers.case();
        self.score_of(&case.system, case.threshold, self.starts.get(start)?)
            .traced()
    }

    /// The motion in which event `number` is `late` (s), and the surfaces are then `joined`; a stick may be early.
    pub(super) fn late(&self, traced: &Traced, number: usize, late: f64, joined: bool) -> Option<Played> {
        let event = *traced.played.events.get(number)?;
        if late < 0.0 && event.kind != EventKind::Stick {
            return None;
        }
        let at = event.time + late;
        let before: Vec<PlayNode> = traced
            .nodes
            .iter()
            .filter(|node| node.0 < event.time.min(at))
            .cloned()
            .collect();
        let (time, mode, state) = before.last()?;
        let mut y = state.clone();
        let mut course = self.course();
        if !course.go(*mode, (*time, at), &mut y, MOST_EXPANSIONS, &mut |_, _| {}) {
            return None;
        }
        let system = self.physics.system();
        if joined {
            system.join(&course.outside(at), &mut y);
        }
        let case = self.numbers.case();
        let start = TrialStart::At(at, y);
        let rest = PlayScore {
            start: &start,
            ..self.score_of(&case.system, case.threshold, &start)
        }
        .traced()?;
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
        let traced = Traced { course, nodes, played };
        Some(match self.evidence.observation {
            Some(observation) => traced.sampled(self.physics, observation),
            None => traced.played,
        })
    }

    fn course(&self) -> Course {
        self.physics.course()
    }
}
