//! Walks through a reference of two trains from its start to its end.
//!
//! From a sample on, the Taylor series of the equations gives the motion up to the next one, in as many steps as that takes: no
//! sample is too far from the next, unless the motion between them is not that of the case.

use super::super::Channel;
use super::nodes::{Nodes, Samples, breaks_segment};
use super::{Curve, TrainPhysics};
use crate::model::Mode;
use crate::record::{Event, State};
use crate::results::{ResultError, ResultFile};
use crate::simulation::trains::{Course, Further, further};
use std::ops::Range;

/// A motion that misses the next sample by more than this part of its own size is not the file's.
const LARGEST_MISS: f64 = 1e-6;

/// Steps of the series between two samples at most.
const MOST_STEPS: usize = 100_000;

/// A state of the reference.
#[derive(Debug, Clone)]
pub(super) struct TrainNode {
    time: f64,
    mode: Mode,
    /// The state before an event: its gap ends here.
    closes: bool,
    y: Vec<f64>,
}

/// The states of two trains.
#[derive(Debug)]
struct States<'a> {
    file: &'a ResultFile,
    physics: &'a TrainPhysics,
    further: Vec<Further>,
    rows: usize,
}

impl States<'_> {
    fn node(&self, time: f64, mode: Mode, closes: bool, state: &State, columns: &[Vec<f64>], row: usize) -> TrainNode {
        let further: Vec<f64> = columns.iter().map(|column| column[row]).collect();
        TrainNode {
            time,
            mode,
            closes,
            y: self.physics.course.state(state, &further),
        }
    }
}

impl Samples for States<'_> {
    type Node = TrainNode;

    fn rows(&self) -> usize {
        self.rows
    }

    fn read(&self, rows: Range<usize>) -> Result<Vec<TrainNode>, ResultError> {
        let column = |one: &Further| self.file.column(&one.name, rows.clone());
        let columns = self.further.iter().map(column).collect::<Result<Vec<_>, _>>()?;
        let states = self.file.states(rows.clone())?.into_iter().enumerate();
        Ok(states
            .map(|(row, (t, mode, s))| self.node(t, mode, false, &s, &columns, row))
            .collect())
    }

    fn time(node: &TrainNode) -> f64 {
        node.time
    }
}

/// See the module.
#[derive(Debug)]
pub(crate) struct TrainWalk<'a> {
    nodes: Nodes<States<'a>>,
    physics: &'a TrainPhysics,
    course: Course,
    left: Option<TrainNode>,
    right: Option<TrainNode>,
    /// Where the steps of the series between the two begin, with the state; empty before it is needed.
    steps: Vec<(f64, Vec<f64>)>,
    /// Whether they lead to the right one.
    sound: bool,
    /// The step that holds the time asked for last.
    step: usize,
    /// The one that the course stands at.
    expanded: Option<usize>,
    /// Steps beyond the first of a gap have been taken.
    filled: bool,
}

/// The states before and after an event.
type BeforeAndAfter = (Vec<f64>, Vec<f64>);

/// Those of each event of a file.
pub(crate) fn states_at_events(
    file: &ResultFile,
    physics: &TrainPhysics,
    events: &[Event],
) -> Result<Vec<BeforeAndAfter>, ResultError> {
    let names = further(&physics.case.parameters);
    let side = |side: &str| -> Result<Vec<Vec<f64>>, ResultError> {
        names
            .iter()
            .map(|one| file.event_column(&format!("{}_{side}", one.name)))
            .collect()
    };
    let (before, after) = (side("before")?, side("after")?);
    let y = |state: &State, columns: &[Vec<f64>], row: usize| {
        let further: Vec<f64> = columns.iter().map(|column| column[row]).collect();
        physics.course.state(state, &further)
    };
    let states = events.iter().enumerate();
    Ok(states
        .map(|(row, event)| (y(&event.before, &before, row), y(&event.after, &after, row)))
        .collect())
}

impl<'a> TrainWalk<'a> {
    /// At the start of the reference.
    ///
    /// # Errors
    /// Of the file.
    pub fn new(
        file: &'a ResultFile,
        physics: &'a TrainPhysics,
        events: &[Event],
    ) -> Result<TrainWalk<'a>, ResultError> {
        let states = States {
            file,
            physics,
            further: further(&physics.case.parameters),
            rows: file.sample_count()?,
        };
        let at_events = states_at_events(file, physics, events)?;
        let node = |event: &Event, closes: bool, y: Vec<f64>| TrainNode {
            time: event.time,
            mode: event.mode_after,
            closes,
            y,
        };
        let breaks = events.iter().zip(at_events).filter(|(e, _)| breaks_segment(e.kind));
        let breaks = breaks.map(|(e, (before, after))| (e.time, node(e, true, before), node(e, false, after)));
        let mut walk = TrainWalk {
            nodes: Nodes::new(states, breaks.collect()),
            physics,
            course: physics.course(),
            left: None,
            right: None,
            steps: Vec::new(),
            sound: false,
            step: 0,
            expanded: None,
            filled: false,
        };
        walk.right = walk.nodes.next()?;
        walk.advance()?;
        Ok(walk)
    }

    /// The next gap; `false` at the end of the reference.
    fn advance(&mut self) -> Result<bool, ResultError> {
        loop {
            self.left = self.right.take();
            self.right = self.nodes.next()?;
            self.steps.clear();
            (self.expanded, self.step) = (None, 0);
            let (Some(left), Some(right)) = (&self.left, &self.right) else {
                return Ok(false);
            };
            if !left.closes && right.time > left.time {
                return Ok(true);
            }
        }
    }

    /// Takes the steps of the present gap.
    fn prepare(&mut self) {
        let (Some(left), Some(right)) = (&self.left, &self.right) else {
            return;
        };
        let (mut time, mut y) = (left.time, left.y.clone());
        self.steps.clear();
        self.sound = false;
        while time < right.time && self.steps.len() < MOST_STEPS {
            let rest = right.time - time;
            let length = self.course.expand(left.mode, time, &y, rest);
            self.steps.push((time, y.clone()));
            let next = if length >= rest { right.time } else { time + length };
            if next.is_nan() || next <= time {
                break;
            }
            self.course.after(next - time, &mut y);
            time = next;
        }
        self.expanded = Some(self.steps.len().saturating_sub(1));
        self.filled |= self.steps.len() > 1;
        let sizes = self.course.sizes();
        let close = |k: usize| (y[k] - right.y[k]).abs() <= LARGEST_MISS * (sizes[k] + right.y[k].abs());
        self.sound = time >= right.time && (0..self.physics.system().mechanical()).all(close);
    }

    /// Start, end and whether an event ends it, of what holds `time` (s), which may not lie before an earlier one; `None` beyond
    /// the end of the reference.
    ///
    /// # Errors
    /// Of the file.
    pub fn at(&mut self, time: f64) -> Result<Option<(f64, f64, bool)>, ResultError> {
        while self.right.as_ref().is_some_and(|right| right.time < time) {
            if !self.advance()? {
                break;
            }
        }
        let (Some(left), Some(right)) = (&self.left, &self.right) else {
            return Ok(None);
        };
        if left.time > time {
            return Ok(None);
        }
        let (from, to, closes) = (left.time, right.time, right.closes);
        if self.steps.is_empty() {
            self.prepare();
        }
        if !self.sound {
            return Ok(Some((from, to, closes)));
        }
        while self.end_of(self.step).is_some_and(|end| end < time) {
            self.step += 1;
        }
        let end = self.end_of(self.step);
        Ok(Some((
            self.steps[self.step].0,
            end.unwrap_or(to),
            closes && end.is_none(),
        )))
    }

    /// Where a step ends that is not the last, s.
    fn end_of(&self, step: usize) -> Option<f64> {
        self.steps.get(step + 1).map(|next| next.0)
    }

    /// The curves of `channels` in what [`Self::at`] has found; `false` if its inside is not known, `None` past the end.
    pub fn curves(&mut self, channels: &[Channel], curves: &mut Vec<Curve<'a>>) -> Option<bool> {
        let (left, right) = (self.left.as_ref()?, self.right.as_ref()?);
        curves.clear();
        let (course, physics) = (&mut self.course, self.physics);
        if !self.sound {
            // Its own samples still stand.
            self.expanded = None;
            let mut ends = [left, right].map(|node| {
                course.expand(left.mode, node.time, &node.y, right.time - left.time);
                let value = |&channel: &Channel| course.series(physics.quantity(channel), 0.0).0[0];
                channels.iter().map(value).collect::<Vec<f64>>()
            });
            let [from, to] = &mut ends;
            curves.extend(
                from.iter()
                    .zip(to)
                    .map(|(a, b)| Curve::Polynomial([*a, *b - *a, 0.0, 0.0, 0.0, 0.0])),
            );
            return Some(false);
        }
        let end = self.steps.get(self.step + 1).map_or(right.time, |next| next.0);
        let (start, y) = &self.steps[self.step];
        let length = end - start;
        if self.expanded != Some(self.step) {
            course.expand(left.mode, *start, y, length);
            self.expanded = Some(self.step);
        }
        for &channel in channels {
            let (series, terms) = course.series(physics.quantity(channel), length);
            curves.push(Curve::Series(series, terms));
        }
        Some(true)
    }

    /// What the contact does between the two samples.
    pub fn mode(&self) -> Mode {
        self.left.as_ref().map_or(Mode::Separated, |left| left.mode)
    }

    /// Whether the equations were integrated again between two samples in more than one step.
    pub fn was_filled(&self) -> bool {
        self.filled
    }
}
