//! The reference as a function of time: between its samples, and never across an event.
//!
//! The Taylor series of the equations leads from one sample to the next. Its miss there shows whether the file's motion
//! is that of its case. If the samples are so far apart that an instability amplifies rounding, the case in the file is
//! run again with denser samples.

use crate::error::Limit;
pub use physics::{Physics, TimeScale};
use std::cell::{Cell, OnceCell};
use std::ops::Range;
use stickslip_engine::run::Run;
use stickslip_engine::simulation::{Course, Following, OutputOptions};
use stickslip_files::{ResultError, ResultFile};
use stickslip_system::model::Mode;
use stickslip_system::record::{Event, EventKind, Recorder, RecorderError, Sample, State};
pub(crate) use walk::Walk;

mod physics;
mod walk;

const BLOCK: usize = 16_384;

pub(crate) fn breaks_segment(kind: EventKind) -> bool {
    kind.in_event_sequence() || matches!(kind, EventKind::Kick | EventKind::Corner)
}

/// A state of the reference: the end of one gap and usually the start of the next.
#[derive(Debug, Clone)]
pub(super) struct Node {
    pub time: f64,
    pub mode: Mode,
    /// The state before an event. Its gap ends here, and the next one starts from the state after it.
    pub closes: bool,
    pub y: Vec<f64>,
}

/// The states before and after an event.
pub type BeforeAndAfter = (Vec<f64>, Vec<f64>);

/// The states before and after each event of a file.
pub fn states_at_events(
    file: &ResultFile,
    course: &Course,
    events: &[Event],
) -> Result<Vec<BeforeAndAfter>, ResultError> {
    let names = course.further();
    let side = |side: &str| {
        let columns = names
            .iter()
            .map(|one| file.event_column(&format!("{}_{side}", one.name)));
        columns.collect::<Result<Vec<Vec<f64>>, ResultError>>()
    };
    let (before, after) = (side("before")?, side("after")?);
    let y = |state: &State, columns: &[Vec<f64>], row: usize| {
        let further: Vec<f64> = columns.iter().map(|column| column[row]).collect();
        course.state(state, &further)
    };
    let sides = |(row, event): (usize, &Event)| (y(&event.before, &before, row), y(&event.after, &after, row));
    Ok(events.iter().enumerate().map(sides).collect())
}

#[derive(Debug)]
pub(super) struct Nodes<'a> {
    file: &'a ResultFile,
    physics: &'a Physics,
    further: Vec<String>,
    rows: usize,
    /// Discontinuities of a value or a derivative, in order of time: time (s), and the nodes before and after.
    breaks: Vec<(f64, Node, Node)>,
    next_break: usize,
    after: Option<Node>,
    row: usize,
    block: Vec<Node>,
    block_start: usize,
}

impl<'a> Nodes<'a> {
    pub fn new(file: &'a ResultFile, physics: &'a Physics, events: &[Event]) -> Result<Nodes<'a>, ResultError> {
        let at_events = states_at_events(file, &physics.course, events)?;
        let node = |event: &Event, closes: bool, y: Vec<f64>| Node {
            time: event.time,
            mode: event.mode_after,
            closes,
            y,
        };
        let breaks = events.iter().zip(at_events).filter(|(e, _)| breaks_segment(e.kind));
        let breaks = breaks.map(|(e, (before, after))| (e.time, node(e, true, before), node(e, false, after)));
        Ok(Nodes {
            file,
            physics,
            further: physics.course.further().into_iter().map(|one| one.name).collect(),
            rows: file.sample_count()?,
            breaks: breaks.collect(),
            next_break: 0,
            after: None,
            row: 0,
            block: Vec::new(),
            block_start: 0,
        })
    }

    fn read(&self, rows: Range<usize>) -> Result<Vec<Node>, ResultError> {
        let column = |name: &String| self.file.column(name, rows.clone());
        let columns = self.further.iter().map(column).collect::<Result<Vec<_>, _>>()?;
        let states = self.file.states(rows.clone())?.into_iter().enumerate();
        let node = |(row, (time, mode, state))| {
            let further: Vec<f64> = columns.iter().map(|column: &Vec<f64>| column[row]).collect();
            Node {
                time,
                mode,
                closes: false,
                y: self.physics.course.state(&state, &further),
            }
        };
        Ok(states.map(node).collect())
    }

    fn sample(&mut self) -> Result<Option<Node>, ResultError> {
        if self.row >= self.rows {
            return Ok(None);
        }
        if self.row >= self.block_start + self.block.len() {
            self.block_start = self.row;
            self.block = self.read(self.row..self.rows.min(self.row + BLOCK))?;
        }
        Ok(self.block.get(self.row - self.block_start).cloned())
    }

    /// The next node; a sample at the time of an event is left out.
    pub fn next(&mut self) -> Result<Option<Node>, ResultError> {
        if let Some(after) = self.after.take() {
            return Ok(Some(after));
        }
        let at = self
            .breaks
            .get(self.next_break)
            .map_or(f64::INFINITY, |(time, ..)| *time);
        let mut sample = self.sample()?;
        while sample.as_ref().is_some_and(|sample| sample.time == at) {
            self.row += 1;
            sample = self.sample()?;
        }
        if sample.as_ref().is_some_and(|sample| sample.time < at) {
            self.row += 1;
            return Ok(sample);
        }
        let Some((_, before, after)) = self.breaks.get(self.next_break) else {
            return Ok(None);
        };
        self.next_break += 1;
        self.after = Some(after.clone());
        Ok(Some(before.clone()))
    }
}

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
