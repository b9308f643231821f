//! The recorded path of a run, dense enough to be followed between its samples.

use super::equations::Dynamic;
use crate::case::Case;
use crate::model::Mode;
use crate::model::state::DYNAMIC;
use crate::model::torsion::TorsionModel;
use crate::record::{Event, MemoryRecorder, Sample, Segment, State};
use crate::simulation::{Following, OutputOptions, OutputWindow};
use std::iter::Peekable;

/// Samples in a natural period where the fast mode moves: a cubic between them is good to 1e-6 of its amplitude.
const PER_PERIOD: f64 = 64.0;

/// Samples in the whole run elsewhere.
const ELSEWHERE: f64 = 8000.0;

/// At most so many dense samples, which bounds memory where the fast mode never rests: 24 in each of 29,000 periods, over which
/// the linearisation then errs by 3 % of the amplitude (its steps by (2 pi/24)^6/7200 each).
const MOST: f64 = 700_000.0;

/// A state on the path.
#[derive(Debug, Clone, Copy)]
pub(super) struct Node {
    /// s.
    pub time: f64,
    pub state: Dynamic,
}

impl Node {
    pub fn before(event: &Event) -> Node {
        Node {
            time: event.time,
            state: dynamic(&event.before),
        }
    }

    pub fn after(event: &Event) -> Node {
        Node {
            time: event.time,
            state: dynamic(&event.after),
        }
    }

    /// At the share `x` of the way to another node: the cubic with the states and their rates at both ends.
    pub fn towards(&self, to: &Node, rates: &[Dynamic; 2], x: f64) -> Dynamic {
        let h = to.time - self.time;
        let rest = 1.0 - x;
        self.state * (rest * rest * (1.0 + 2.0 * x))
            + to.state * (x * x * (3.0 - 2.0 * x))
            + rates[0] * (h * x * rest * rest)
            - rates[1] * (h * x * x * rest)
    }
}

fn dynamic(state: &State) -> Dynamic {
    Dynamic::from_column_slice(&state.torsional().state()[..DYNAMIC])
}

/// The nodes up to an event, from the one behind the event before it; takes the samples on the way.
pub(super) fn nodes_before<'a>(
    event: &Event,
    mode: Mode,
    start: Option<Node>,
    samples: &mut Peekable<impl Iterator<Item = &'a Sample>>,
) -> Vec<Node> {
    let mut nodes: Vec<Node> = start.into_iter().collect();
    while let Some(sample) = samples.next_if(|sample| sample.time < event.time) {
        // A sample at the instant of the last event is the event's own state.
        if nodes.last().is_none_or(|last| sample.time > last.time) && sample.mode == mode {
            nodes.push(Node {
                time: sample.time,
                state: dynamic(&sample.state),
            });
        }
    }
    nodes.push(Node::before(event));
    nodes
}

/// Whether the fast mode may move in a segment: it does in a stick and where the disks are apart, and in a slip where steps
/// have to resolve it.
fn moves_fast(segment: &Segment) -> bool {
    segment.mode.sense() == 0 || segment.resolved != Some(false)
}

/// Samples for the linearisation of a run whose events and segments are known: dense wherever the fast mode moves,
/// up to the last event.
pub(super) fn resolving_output(case: &Case, run: &MemoryRecorder) -> OutputOptions {
    let last = run.events.last().map_or(0.0, |event| event.time);
    let end_time = case.output.end_time;
    let resolved: Vec<_> = run
        .segments
        .iter()
        .filter(|segment| segment.start < last && moves_fast(segment))
        .collect();
    let whole: f64 = resolved.iter().map(|segment| segment.end - segment.start).sum();
    let period = TorsionModel::new(&case.parameters).natural_period();
    let interval = (period / PER_PERIOD).max(whole / MOST);
    OutputOptions {
        end_time,
        interval: end_time / ELSEWHERE,
        windows: resolved
            .iter()
            .map(|segment| OutputWindow {
                from: segment.start,
                to: segment.end,
                interval,
            })
            .collect(),
        steps: true,
        follow: Following::default(),
    }
}
