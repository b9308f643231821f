//! Motion of a case sampled like a candidate: its events, and its channels at the candidate's times.

use super::evidence::TrialStart;
use super::observation::{Observation, ObservedValues};
use crate::Channel;
use crate::error::Limit;
use crate::reference::Physics;
use crate::survey::sequence;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use stickslip_engine::simulation::{Course, Method, OutputOptions, Simulation, SolverOptions, simulate_from};
use stickslip_system::model::Mode;
use stickslip_system::model::system::System;
use stickslip_system::record::sequence::SequenceEvent;
use stickslip_system::record::{Event, Recorder, RecorderError, Sample, Segment};

/// The tolerance of a certificate's reruns: within 1e-12 s of exact events.
const RTOL: f64 = 1e-12;
/// Effort of a run: stop checks between two events, each after 256 steps or some 2 ms.
const MOST_QUESTIONS: usize = 400;
const MOST_EXPANSIONS: usize = 10_000;
/// Most states of a run that are kept.
const MOST_NODES: usize = 500_000;

/// A run: its start, its end (s), and its most events and steps.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MotionRequest<'a> {
    pub system: &'a System,
    /// Threshold of a contact without stick, rad/s.
    pub threshold: f64,
    pub start: &'a TrialStart,
    pub end: f64,
    pub most_events: usize,
    pub most_steps: Option<usize>,
    /// The candidate shows when the contact opens and closes.
    pub shows_contact: bool,
    pub limit: Limit,
}

#[derive(Debug, Clone, Default)]
pub(crate) struct Played {
    /// NaN where the motion is unknown.
    pub values: ObservedValues,
    pub events: Vec<SequenceEvent>,
    pub steps: u64,
}

impl Played {
    /// A motion of which only the events are known.
    pub fn of_events(events: Vec<SequenceEvent>) -> Played {
        Played {
            events,
            ..Played::default()
        }
    }
}

impl MotionRequest<'_> {
    /// Events of the run; `None` if it fails or takes too long.
    pub fn events(&self) -> Option<Played> {
        let pace = Pace::default();
        self.run(false, &pace, &mut &pace)
    }

    /// Events, and the channels of the observation at its times.
    pub fn sampled(&self, physics: &Physics, observation: &Observation) -> Option<Played> {
        let (mut course, traced) = self.kept()?;
        Some(traced.sampled(&mut course, physics, observation))
    }

    /// Events, and the states at the ends of the steps.
    pub fn traced(&self) -> Option<Traced> {
        self.kept().map(|(_, traced)| traced)
    }

    fn kept(&self) -> Option<(Course, Traced)> {
        let pace = Pace::default();
        let mut kept = KeptMotion {
            pace: &pace,
            course: Course::new(self.system, self.threshold, &self.solver()),
            further: Vec::new(),
            nodes: Vec::new(),
            begins: None,
        };
        let played = self.run(true, &pace, &mut kept)?;
        let mut nodes = kept.nodes;
        // A run from a state has no sample at its start.
        if let (TrialStart::At(time, y), Some(mode)) = (self.start, kept.begins)
            && nodes.first().is_none_or(|node| node.0 > *time)
        {
            nodes.insert(0, (*time, mode, y.clone()));
        }
        Some((kept.course, Traced { nodes, played }))
    }

    fn solver(&self) -> SolverOptions {
        SolverOptions {
            method: Method::Series,
            rtol: RTOL,
            max_steps: self.most_steps,
            ..SolverOptions::default()
        }
    }

    fn run(&self, steps: bool, pace: &Pace, recorder: &mut dyn Recorder) -> Option<Played> {
        if self.limit.is_over() {
            return None;
        }
        let problem = Simulation {
            system: self.system,
            threshold: self.threshold,
            further: steps,
        };
        let start = match self.start {
            TrialStart::Case => None,
            TrialStart::At(time, state) => Some((*time, &state[..])),
        };
        let output = OutputOptions {
            steps,
            ..OutputOptions::at_the_ends(self.end)
        };
        let given_up = || pace.is_over() || pace.events.load(Relaxed) > self.most_events || self.limit.is_over();
        let report = simulate_from(problem, start, &self.solver(), &output, recorder, &given_up).ok()?;
        if report.interrupted {
            return None;
        }
        Some(Played {
            values: Vec::new(),
            events: sequence(&report.events, self.shows_contact),
            steps: report.work.iter().map(|work| work.steps).sum(),
        })
    }
}

/// Pace of a run: events of its sequence, and stop checks since the last one.
#[derive(Debug, Default)]
struct Pace {
    events: AtomicUsize,
    questions: AtomicUsize,
}

impl Pace {
    fn event(&self, event: &Event) {
        if event.kind.in_event_sequence() {
            self.events.fetch_add(1, Relaxed);
            self.questions.store(0, Relaxed);
        }
    }

    fn is_over(&self) -> bool {
        self.questions.fetch_add(1, Relaxed) > MOST_QUESTIONS
    }
}

impl Recorder for &Pace {
    fn event(&mut self, event: &Event) -> Result<(), RecorderError> {
        Pace::event(self, event);
        Ok(())
    }

    fn stores_motion(&self) -> bool {
        false
    }
}

/// A state of a run: time (s), mode from there on, state.
pub(crate) type MotionNode = (f64, Mode, Vec<f64>);

/// A run with its states at the ends of its steps.
#[derive(Debug, Clone)]
pub(crate) struct Traced {
    pub nodes: Vec<MotionNode>,
    pub played: Played,
}

impl Traced {
    /// Mode and state at a time, s.
    pub fn state_at(&self, physics: &Physics, time: f64) -> Option<(Mode, Vec<f64>)> {
        let (from, mode, y) = self.nodes.iter().rfind(|node| node.0 <= time)?;
        let mut y = y.clone();
        let mut course = physics.course();
        let arrived = course.go(*mode, (*from, time), &mut y, MOST_EXPANSIONS, &mut |_, _| {});
        arrived.then_some((*mode, y))
    }

    /// Channels at increasing times (s); NaN where the motion is unknown.
    pub fn values_at(
        &self,
        course: &mut Course,
        physics: &Physics,
        channels: &[Channel],
        times: &[f64],
    ) -> ObservedValues {
        sampled(course, &self.nodes, physics, channels, times)
    }

    pub fn sampled(&self, course: &mut Course, physics: &Physics, observation: &Observation) -> Played {
        let mut values = self.values_at(course, physics, &observation.channels, &observation.time);
        observation.complete(&mut values, physics, course, 0.0);
        Played {
            values,
            ..self.played.clone()
        }
    }
}

struct KeptMotion<'a> {
    pace: &'a Pace,
    course: Course,
    /// State of the next sample, or before and after the next event.
    further: Vec<f64>,
    nodes: Vec<MotionNode>,
    begins: Option<Mode>,
}

impl Recorder for KeptMotion<'_> {
    fn further(&mut self, values: &[f64]) -> Result<(), RecorderError> {
        self.further.extend_from_slice(values);
        Ok(())
    }

    fn segment(&mut self, segment: &Segment) -> Result<(), RecorderError> {
        self.begins.get_or_insert(segment.mode);
        Ok(())
    }

    fn sample(&mut self, sample: &Sample) -> Result<(), RecorderError> {
        let y = self.course.state(&sample.state, &self.further);
        self.further.clear();
        self.nodes.push((sample.time, sample.mode, y));
        match self.nodes.len() > MOST_NODES {
            true => Err("more states than are kept".into()),
            false => Ok(()),
        }
    }

    fn event(&mut self, event: &Event) -> Result<(), RecorderError> {
        self.pace.event(event);
        let y = self.course.state(&event.after, &self.further[self.further.len() / 2..]);
        self.further.clear();
        self.nodes.push((event.time, event.mode_after, y));
        Ok(())
    }
}

/// The channels at increasing times (s) of the motion that leads from each node to the next.
fn sampled(
    course: &mut Course,
    nodes: &[MotionNode],
    physics: &Physics,
    channels: &[Channel],
    times: &[f64],
) -> ObservedValues {
    let mut values = vec![vec![f64::NAN; times.len()]; channels.len()];
    let mut row = 0;
    for (k, (from, mode, y)) in nodes.iter().enumerate() {
        let to = nodes.get(k + 1).map_or(*from, |next| next.0);
        let last = k + 1 == nodes.len();
        row += times[row..].partition_point(|time| *time < *from);
        let inside = |row: usize| times.get(row).is_some_and(|time| *time < to || last && *time == to);
        if !inside(row) {
            continue;
        }
        let (mut at, mut y) = (*from, y.clone());
        for _ in 0..MOST_EXPANSIONS {
            let length = course.expand(*mode, at, &y, (to - at).max(f64::MIN_POSITIVE));
            let end = if at + length >= to { to } else { at + length };
            let first = row;
            row += times[row..].partition_point(|time| *time < end || last && end == to && *time == to);
            if first < row {
                // Most steps have one or two samples, too few for a series of each channel.
                for (column, &channel) in values.iter_mut().zip(channels) {
                    let since = times[first..row].iter().map(|time| time - at);
                    course.values(physics.quantity(channel), since, &mut column[first..row]);
                }
            }
            if end == to || !inside(row) || end == at {
                break;
            }
            course.after(length, &mut y);
            at = end;
        }
    }
    values
}
