//! Repeated run of the reference, with samples dense enough for the equations to connect them.

use super::Physics;
use super::nodes::{Node, breaks_segment};
use crate::limit::Limit;
use std::cell::{Cell, OnceCell};
use stickslip_engine::run::Run;
use stickslip_engine::simulation::{Following, OutputOptions};
use stickslip_system::record::{Event, Recorder, RecorderError, Sample};

/// Interval of samples in natural periods. Instabilities grow over it by some e-folds, which do not amplify rounding to
/// a visible size.
pub(super) const INTERVAL: f64 = 4.0;
/// Most evenly spaced samples; longer runs have larger intervals.
const MOST: f64 = 2.5e5;
/// Most states that are kept, with those at the steps of the solver.
const MOST_NODES: usize = 2_000_000;
/// Largest difference of event times from the file, s. The same program repeats a run to the bit; another machine or
/// version differs by rounding, which the instability amplifies.
const SAME: f64 = 1e-9;

#[derive(Debug, Default)]
pub(crate) struct Rerun {
    nodes: OnceCell<Option<Vec<Node>>>,
    /// Limit of the present comparison.
    pub limit: Cell<Option<Limit>>,
}

impl Rerun {
    pub fn was_made(&self) -> bool {
        self.nodes.get().is_some_and(Option::is_some)
    }

    /// Samples in order of time; `None` if the run cannot be repeated, or has other events than the file's `events`.
    pub(super) fn nodes(&self, physics: &Physics, events: &[Event]) -> Option<&[Node]> {
        let limit = self.limit.get();
        if self.nodes.get().is_none() {
            let nodes = run(physics, events, limit);
            // A run that the limit of one comparison ended may fit into that of the next.
            if nodes.is_none() && limit.is_some_and(|limit| limit.is_over()) {
                return None;
            }
            let _ = self.nodes.set(nodes);
        }
        self.nodes.get()?.as_deref()
    }
}

fn run(physics: &Physics, events: &[Event], limit: Option<Limit>) -> Option<Vec<Node>> {
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
        limit,
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

struct Kept<'a> {
    physics: &'a Physics,
    limit: Option<Limit>,
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
        if self.nodes.len() == MOST_NODES || self.limit.is_some_and(|limit| limit.is_over()) {
            return Err("it takes too long, or has more states than are kept".into());
        }
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
