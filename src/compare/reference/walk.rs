//! Walks through the reference from its start to its end, gap by gap.

use super::super::Channel;
use super::{Curve, Gap, Node, Physics, Rerun};
use crate::record::{Event, EventKind};
use crate::results::{ResultError, ResultFile};

/// Samples read at a time.
const BLOCK: usize = 16_384;

/// Whether a segment ends at an event of this kind.
pub(crate) fn breaks_segment(kind: EventKind) -> bool {
    kind.in_event_sequence() || matches!(kind, EventKind::Kick | EventKind::Corner)
}

/// A walk in order of time over the samples of a reference's file, and over those of its repeated run where the file's
/// are too sparse.
#[derive(Debug)]
pub(crate) struct Walk<'a> {
    file: &'a ResultFile,
    physics: &'a Physics,
    rerun: &'a Rerun,
    /// Nodes that stand between the last one and the rest of the file, the next one last.
    inserted: Vec<Node>,
    /// Until here, s, gaps have been filled.
    filled: f64,
    /// Events at which a derivative or a value jumps, in order of time.
    breaks: Vec<Event>,
    next_break: usize,
    /// The state after an event whose state before it was the last node.
    after: Option<Node>,
    rows: usize,
    row: usize,
    block: Vec<Node>,
    block_start: usize,
    gap: Option<Gap>,
    last: Option<Node>,
}

impl<'a> Walk<'a> {
    /// At the start of the reference.
    ///
    /// # Errors
    /// Of the file.
    pub fn new(
        file: &'a ResultFile,
        physics: &'a Physics,
        rerun: &'a Rerun,
        events: &[Event],
    ) -> Result<Walk<'a>, ResultError> {
        let mut walk = Walk {
            file,
            physics,
            rerun,
            inserted: Vec::new(),
            filled: f64::NEG_INFINITY,
            breaks: events.iter().filter(|e| breaks_segment(e.kind)).copied().collect(),
            next_break: 0,
            after: None,
            rows: file.sample_count()?,
            row: 0,
            block: Vec::new(),
            block_start: 0,
            gap: None,
            last: None,
        };
        walk.last = walk.next_node()?;
        walk.advance()?;
        Ok(walk)
    }

    fn sample(&mut self) -> Result<Option<Node>, ResultError> {
        if self.row >= self.rows {
            return Ok(None);
        }
        if self.row >= self.block_start + self.block.len() {
            self.block_start = self.row;
            let range = self.row..self.rows.min(self.row + BLOCK);
            let states = self.file.states(range)?;
            self.block = states
                .into_iter()
                .map(|(t, mode, s)| Node::new(t, mode, false, &s))
                .collect();
        }
        Ok(self.block.get(self.row - self.block_start).copied())
    }

    /// Samples and events in order of time; a sample at the time of an event is left out.
    fn next_node(&mut self) -> Result<Option<Node>, ResultError> {
        if let Some(node) = self.inserted.pop() {
            return Ok(Some(node));
        }
        if let Some(after) = self.after.take() {
            return Ok(Some(after));
        }
        loop {
            let sample = self.sample()?;
            let event = self.breaks.get(self.next_break);
            match (sample, event) {
                (Some(s), Some(e)) if s.time == e.time => self.row += 1,
                (Some(s), Some(e)) if s.time < e.time => {
                    self.row += 1;
                    return Ok(Some(s));
                }
                (_, Some(e)) => {
                    self.next_break += 1;
                    self.after = Some(Node::new(e.time, e.mode_after, false, &e.after));
                    return Ok(Some(Node::new(e.time, e.mode_after, true, &e.before)));
                }
                (Some(s), None) => {
                    self.row += 1;
                    return Ok(Some(s));
                }
                (None, None) => return Ok(None),
            }
        }
    }

    /// The next gap; `false` at the end of the reference.
    fn advance(&mut self) -> Result<bool, ResultError> {
        loop {
            let (Some(left), Some(right)) = (self.last, self.next_node()?) else {
                self.gap = None;
                return Ok(false);
            };
            self.last = Some(right);
            if !left.closes && right.time > left.time {
                self.gap = Some(Gap::new(left, right));
                return Ok(true);
            }
        }
    }

    /// The gap that holds `time` (s), which may not lie before an earlier one; `None` beyond the end of the reference.
    ///
    /// # Errors
    /// Of the file.
    pub fn at(&mut self, time: f64) -> Result<Option<&Gap>, ResultError> {
        while self.gap.as_ref().is_some_and(|gap| gap.right.time < time) {
            if !self.advance()? {
                break;
            }
        }
        let sparse = self
            .gap
            .as_mut()
            .is_some_and(|gap| gap.left.time < time && !gap.prepare(self.physics));
        if sparse && self.fill()? {
            return self.at(time);
        }
        Ok(self.gap.as_ref().filter(|gap| gap.left.time <= time))
    }

    /// Fills the present gap with samples of the repeated run; `false` if that has been done or there are none.
    fn fill(&mut self) -> Result<bool, ResultError> {
        let Some(gap) = &self.gap else {
            return Ok(false);
        };
        let (left, right) = (gap.left, gap.right);
        if right.time <= self.filled {
            return Ok(false);
        }
        self.filled = right.time;
        let Some(dense) = self.rerun.nodes() else {
            return Ok(false);
        };
        let first = dense.partition_point(|node| node.time <= left.time);
        let last = dense.partition_point(|node| node.time < right.time);
        self.inserted.push(right);
        self.inserted.extend(dense[first..last.max(first)].iter().rev());
        self.last = Some(left);
        self.advance()
    }

    /// theta at the start of the present gap, rad.
    pub(crate) fn rotor_angle(&self) -> f64 {
        self.gap.as_ref().map_or(0.0, Gap::rotor_angle)
    }

    /// The curves of `channels` in the present gap; `false` if its samples are too sparse for its inside, `None` past the
    /// end.
    pub fn curves(&mut self, channels: &[Channel], curves: &mut Vec<Curve>) -> Option<bool> {
        let gap = self.gap.as_mut()?;
        let sound = gap.prepare(self.physics);
        curves.clear();
        curves.extend(channels.iter().map(|&channel| gap.curve(self.physics, channel)));
        Some(sound)
    }
}
