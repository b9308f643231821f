//! The run of the reference, repeated with samples as dense as an instability lets the equations lead from one to the next.

use super::Physics;
use super::nodes::{Node, breaks_segment};
use crate::record::{Event, Recorder, RecorderError, Sample};
use crate::run::Run;
use crate::simulation::{Following, OutputOptions};
use std::cell::OnceCell;

/// Interval of samples in natural periods: what grows does so by some e-folds over it, not by those of a rounding.
pub(super) const INTERVAL: f64 = 4.0;
/// Samples of equal distance at most; beyond it they become less dense.
const MOST: f64 = 2.5e5;
/// Events of the repeated run that differ from the file's by more than this, s, make it another run. An identical
/// program repeats to the bit; another machine or version differs by rounding, which the instability amplifies.
const SAME: f64 = 1e-9;

/// Repeats the run of a reference, once and only if it is needed.
#[derive(Debug, Default)]
pub(crate) struct Rerun {
    nodes: OnceCell<Option<Vec<Node>>>,
}

impl Rerun {
    /// Whether the run was repeated.
    pub fn was_made(&self) -> bool {
        self.nodes.get().is_some_and(Option::is_some)
    }

    /// Its samples in order of time; `None` if it cannot be repeated, or has other events than `events`, which are those of the file.
    pub(super) fn nodes(&self, physics: &Physics, events: &[Event]) -> Option<&[Node]> {
        self.nodes.get_or_init(|| run(physics, events)).as_deref()
    }
}

fn run(physics: &Physics, events: &[Event]) -> Option<Vec<Node>> {
    let case = &physics.case;
    let asked = &case.output;
    let output = OutputOptions {
        steps: true,
        interval: (INTERVAL * physics.natural_period()).max(asked.end_time / MOST),
        windows: Vec::new(),
        follow: Following::default(),
        ..asked.clone()
    };
    let mut kept = Kept {
        physics,
        further: Vec::new(),
        nodes: Vec::new(),
        events: Vec::new(),
    };
    let result = Run::new(case).output(&output).record(&mut kept).start();
    if let Err(failure) = result {
        log::debug!("the reference's run cannot be repeated: {failure}");
        return None;
    }
    let of_file: Vec<&Event> = events.iter().filter(|e| breaks_segment(e.kind)).collect();
    let mut pairs = of_file.iter().zip(&kept.events);
    let same = pairs.all(|(a, b)| a.kind == b.kind && (a.time - b.time).abs() <= SAME);
    let same = same && kept.events.len() == of_file.len();
    if !same {
        log::warn!(
            "this program does not repeat the reference's run as it is in the file; where its samples are sparse, states are left \
             out"
        );
    }
    same.then_some(kept.nodes)
}

/// Keeps states only.
struct Kept<'a> {
    physics: &'a Physics,
    further: Vec<f64>,
    nodes: Vec<Node>,
    events: Vec<Event>,
}

impl Recorder for Kept<'_> {
    fn further(&mut self, values: &[f64]) -> Result<(), RecorderError> {
        self.further.clear();
        self.further.extend_from_slice(values);
        Ok(())
    }

    fn sample(&mut self, sample: &Sample) -> Result<(), RecorderError> {
        self.nodes.push(Node {
            time: sample.time,
            mode: sample.mode,
            closes: false,
            y: self.physics.course.state(&sample.state, &self.further),
        });
        Ok(())
    }

    fn event(&mut self, event: &Event) -> Result<(), RecorderError> {
        if breaks_segment(event.kind) {
            self.events.push(*event);
        }
        Ok(())
    }
}
