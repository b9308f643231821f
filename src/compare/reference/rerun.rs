//! The run of the reference, repeated with samples as dense as interpolation needs them.

use super::nodes::breaks_segment;
use super::{Node, Physics};
use crate::case::Case;
use crate::record::{Event, Recorder, RecorderError, Sample, Segment};
use crate::run::Run;
use crate::simulation::{Following, OutputOptions, OutputWindow};
use std::cell::OnceCell;

/// Samples in a natural period while the fast mode is about.
const PER_PERIOD: f64 = 96.0;
/// Interval of samples while it is not, s, and how many of them there are at most: slow sliding changes over 0.1 s.
const SLOW: f64 = 1e-3;
const MOST_SLOW: f64 = 1e5;
/// E-folds of damping after the last event until the fast mode is quiet.
const DECAY: f64 = 60.0;
/// Samples that are kept at most; beyond it they become less dense.
const MOST: f64 = 4e6;
/// Events of the repeated run that differ from the file's by more than this, s, make it another run. An identical
/// program repeats to the bit; another machine or version differs by rounding, which the instability amplifies.
const SAME: f64 = 1e-9;

/// Repeats the run of a reference, once and only if it is needed.
#[derive(Debug)]
pub struct Rerun {
    case: Case,
    events: Vec<Event>,
    decay: f64,
    period: f64,
    nodes: OnceCell<Option<Vec<Node>>>,
}

impl Rerun {
    /// Of a case and the events that its file holds.
    pub fn new(case: &Case, physics: &Physics, events: &[Event]) -> Rerun {
        let p = &physics.torsion.torsion;
        Rerun {
            case: case.clone(),
            events: events.to_vec(),
            // The slowest of the fast modes: that of sticking disks and that of the stator alone.
            decay: p.damping / (4.0 * p.surface_inertia),
            period: physics.natural_period,
            nodes: OnceCell::new(),
        }
    }

    /// Whether the run was repeated.
    pub(crate) fn was_made(&self) -> bool {
        self.nodes.get().is_some_and(Option::is_some)
    }

    /// Its samples in order of time; `None` if it cannot be repeated, or comes out otherwise than the file.
    pub fn nodes(&self) -> Option<&[Node]> {
        self.nodes.get_or_init(|| self.run()).as_deref()
    }

    fn run(&self) -> Option<Vec<Node>> {
        let breaks = self.events.iter().filter(|e| breaks_segment(e.kind)).map(|e| e.time);
        // F(t) begins with a corner.
        let fast: Vec<f64> = std::iter::once(0.0).chain(breaks).collect();
        let end_time = self.case.output.end_time;
        let mut output = OutputOptions {
            steps: true,
            interval: self.case.output.interval.min(SLOW).max(end_time / MOST_SLOW),
            windows: Vec::new(),
            follow: Following::default(),
            ..self.case.output.clone()
        };
        // The fast mode is about from an event on until it has decayed; steps of the integrator serve elsewhere.
        let quiet = if self.decay > 0.0 {
            DECAY / self.decay
        } else {
            f64::INFINITY
        };
        let mut window: Option<(f64, f64)> = None;
        for time in fast.iter().copied().chain(std::iter::once(f64::INFINITY)) {
            match &mut window {
                Some((_, to)) if time <= *to => *to = (time + quiet).min(end_time),
                _ => {
                    if let Some((from, to)) = window.filter(|(from, to)| from < to) {
                        output.windows.push(OutputWindow {
                            from,
                            to,
                            interval: (self.period / PER_PERIOD).max((to - from) / MOST),
                        });
                    }
                    window = Some((time.min(end_time), (time + quiet).min(end_time)));
                }
            }
        }
        let mut kept = Kept::default();
        let parameters = &self.case.parameters;
        let result = Run::of(parameters, &self.case.solver, &output)
            .record(&mut kept)
            .start();
        if let Err(failure) = result {
            log::debug!("the reference's run cannot be repeated: {failure}");
            return None;
        }
        let of_file = self.events.iter().filter(|e| breaks_segment(e.kind));
        let same = kept.events.len() + 1 == fast.len()
            && of_file
                .zip(&kept.events)
                .all(|(a, b)| a.kind == b.kind && (a.time - b.time).abs() <= SAME);
        if !same {
            log::warn!(
                "this program does not repeat the reference's run as it is in the file; where its samples are sparse, \
                 states are left out"
            );
        }
        same.then_some(kept.nodes)
    }
}

/// Keeps states only.
#[derive(Debug, Default)]
struct Kept {
    nodes: Vec<Node>,
    events: Vec<Event>,
}

impl Recorder for Kept {
    fn sample(&mut self, sample: &Sample) -> Result<(), RecorderError> {
        self.nodes
            .push(Node::new(sample.time, sample.mode, false, &sample.state));
        Ok(())
    }

    fn event(&mut self, event: &Event) -> Result<(), RecorderError> {
        if breaks_segment(event.kind) {
            self.events.push(*event);
        }
        Ok(())
    }

    fn segment(&mut self, _: &Segment) -> Result<(), RecorderError> {
        Ok(())
    }
}
