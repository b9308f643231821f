//! Samples and events of a reference's file in order of time.

use super::Physics;
use crate::model::Mode;
use crate::record::{Event, EventKind, State};
use crate::results::{ResultError, ResultFile};
use crate::simulation::Course;
use std::ops::Range;

/// Samples read at a time.
const BLOCK: usize = 16_384;

/// Whether a segment ends at an event of this kind.
pub(crate) fn breaks_segment(kind: EventKind) -> bool {
    kind.in_event_sequence() || matches!(kind, EventKind::Kick | EventKind::Corner)
}

/// A state of the reference: the end of one gap and mostly the start of the next.
#[derive(Debug, Clone)]
pub(super) struct Node {
    /// s.
    pub time: f64,
    pub mode: Mode,
    /// The state before an event: its gap ends here, and the next one starts from the state after it.
    pub closes: bool,
    pub y: Vec<f64>,
}

/// The states before and after an event.
pub(crate) type BeforeAndAfter = (Vec<f64>, Vec<f64>);

/// Those of each event of a file.
pub(crate) fn states_at_events(
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

/// See the module.
#[derive(Debug)]
pub(super) struct Nodes<'a> {
    file: &'a ResultFile,
    physics: &'a Physics,
    /// Columns beyond those that every file has.
    further: Vec<String>,
    rows: usize,
    /// At which a derivative or a value jumps, in order of time: time (s), and the nodes before and after.
    breaks: Vec<(f64, Node, Node)>,
    next_break: usize,
    /// The state after an event whose state before it was the last node.
    after: Option<Node>,
    row: usize,
    block: Vec<Node>,
    block_start: usize,
}

impl<'a> Nodes<'a> {
    /// From the first one on.
    ///
    /// # Errors
    /// Of the file.
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

    /// The next one; a sample at the time of an event is left out.
    ///
    /// # Errors
    /// Of the file.
    pub fn next(&mut self) -> Result<Option<Node>, ResultError> {
        if let Some(after) = self.after.take() {
            return Ok(Some(after));
        }
        // A sample at the time of an event.
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
