//! Walks through the reference from its start to its end, gap by gap.

use super::super::Channel;
use super::nodes::{Nodes, Samples, breaks_segment};
use super::{Curve, Gap, Node, Physics, Rerun};
use crate::model::Mode;
use crate::record::Event;
use crate::results::{ResultError, ResultFile};
use std::ops::Range;

/// The states of a brake.
#[derive(Debug)]
struct States<'a> {
    file: &'a ResultFile,
    rows: usize,
}

impl Samples for States<'_> {
    type Node = Node;

    fn rows(&self) -> usize {
        self.rows
    }

    fn read(&self, rows: Range<usize>) -> Result<Vec<Node>, ResultError> {
        let states = self.file.states(rows)?.into_iter();
        Ok(states.map(|(t, mode, s)| Node::new(t, mode, false, &s)).collect())
    }

    fn time(node: &Node) -> f64 {
        node.time
    }
}

/// A walk in order of time over the samples of a reference's file, and over those of its repeated run where the file's
/// are too sparse.
#[derive(Debug)]
pub(crate) struct Walk<'a> {
    nodes: Nodes<States<'a>>,
    physics: &'a Physics,
    rerun: &'a Rerun,
    /// Nodes that stand between the last one and the rest of the file, the next one last.
    inserted: Vec<Node>,
    /// Until here, s, gaps have been filled.
    filled: f64,
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
        let breaks = events.iter().filter(|e| breaks_segment(e.kind)).map(|e| {
            let before = Node::new(e.time, e.mode_after, true, &e.before);
            (e.time, before, Node::new(e.time, e.mode_after, false, &e.after))
        });
        let rows = file.sample_count()?;
        let mut walk = Walk {
            nodes: Nodes::new(States { file, rows }, breaks.collect()),
            physics,
            rerun,
            inserted: Vec::new(),
            filled: f64::NEG_INFINITY,
            gap: None,
            last: None,
        };
        walk.last = walk.next_node()?;
        walk.advance()?;
        Ok(walk)
    }

    fn next_node(&mut self) -> Result<Option<Node>, ResultError> {
        match self.inserted.pop() {
            Some(node) => Ok(Some(node)),
            None => self.nodes.next(),
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

    /// What the contact does in the present gap.
    pub(crate) fn mode(&self) -> Mode {
        self.gap.as_ref().map_or(Mode::Separated, Gap::mode)
    }

    /// theta at the start of the present gap, rad.
    pub(crate) fn rotor_angle(&self) -> f64 {
        self.gap.as_ref().map_or(0.0, Gap::rotor_angle)
    }

    /// The curves of `channels` in the present gap; `false` if its samples are too sparse for its inside, `None` past the
    /// end.
    pub fn curves(&mut self, channels: &[Channel], curves: &mut Vec<Curve<'a>>) -> Option<bool> {
        let gap = self.gap.as_mut()?;
        let sound = gap.prepare(self.physics);
        curves.clear();
        curves.extend(channels.iter().map(|&channel| gap.curve(self.physics, channel)));
        Some(sound)
    }
}
