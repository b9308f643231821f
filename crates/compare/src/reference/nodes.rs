//! Samples and events of a reference's file in order of time.

use super::Physics;
use std::ops::Range;
use stickslip_engine::simulation::Course;
use stickslip_files::{ResultError, ResultFile};
use stickslip_system::model::Mode;
use stickslip_system::record::{Event, EventKind, State};

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
