//! Samples and events of a reference's file in order of time.

use crate::record::EventKind;
use crate::results::ResultError;
use std::ops::Range;

/// Samples read at a time.
const BLOCK: usize = 16_384;

/// Whether a segment ends at an event of this kind.
pub(crate) fn breaks_segment(kind: EventKind) -> bool {
    kind.in_event_sequence() || matches!(kind, EventKind::Kick | EventKind::Corner)
}

/// Where samples are read from.
pub(super) trait Samples {
    /// A sample, or the state on one side of an event.
    type Node: Clone;
    /// How many there are.
    fn rows(&self) -> usize;
    /// Some of them.
    ///
    /// # Errors
    /// Of the file.
    fn read(&self, rows: Range<usize>) -> Result<Vec<Self::Node>, ResultError>;
    /// The time of a node, s.
    fn time(node: &Self::Node) -> f64;
}

/// See the module.
#[derive(Debug)]
pub(super) struct Nodes<S: Samples> {
    samples: S,
    /// At which a derivative or a value jumps, in order of time: time (s), and the nodes before and after.
    breaks: Vec<(f64, S::Node, S::Node)>,
    next_break: usize,
    /// The state after an event whose state before it was the last node.
    after: Option<S::Node>,
    row: usize,
    block: Vec<S::Node>,
    block_start: usize,
}

impl<S: Samples> Nodes<S> {
    pub fn new(samples: S, breaks: Vec<(f64, S::Node, S::Node)>) -> Nodes<S> {
        Nodes {
            samples,
            breaks,
            next_break: 0,
            after: None,
            row: 0,
            block: Vec::new(),
            block_start: 0,
        }
    }

    fn sample(&mut self) -> Result<Option<S::Node>, ResultError> {
        let rows = self.samples.rows();
        if self.row >= rows {
            return Ok(None);
        }
        if self.row >= self.block_start + self.block.len() {
            self.block_start = self.row;
            self.block = self.samples.read(self.row..rows.min(self.row + BLOCK))?;
        }
        Ok(self.block.get(self.row - self.block_start).cloned())
    }

    /// The next one; a sample at the time of an event is left out.
    pub fn next(&mut self) -> Result<Option<S::Node>, ResultError> {
        if let Some(after) = self.after.take() {
            return Ok(Some(after));
        }
        loop {
            let sample = self.sample()?;
            let event = self.breaks.get(self.next_break);
            match (sample, event) {
                (Some(s), Some(e)) if S::time(&s) == e.0 => self.row += 1,
                (Some(s), Some(e)) if S::time(&s) < e.0 => {
                    self.row += 1;
                    return Ok(Some(s));
                }
                (_, Some((_, before, after))) => {
                    self.next_break += 1;
                    self.after = Some(after.clone());
                    return Ok(Some(before.clone()));
                }
                (Some(s), None) => {
                    self.row += 1;
                    return Ok(Some(s));
                }
                (None, None) => return Ok(None),
            }
        }
    }
}
