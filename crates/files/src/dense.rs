//! Dense output of a run: every channel at any time.

use super::schema::{self, group};
use super::{ResultError, ResultFile};
use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;
use stickslip_system::numerics::chebyshev::{self, COEFFICIENTS};
use stickslip_system::record::channel;

const BLOCK: usize = 4096;

/// Side of an event, at the time of the event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EventSide {
    /// The state before the event.
    Before,
    /// The state after the event.
    After,
}

/// First piece of a cached block, and the block's coefficients.
type Held = (usize, Rc<Vec<f64>>);

/// The dense output of a result file. Between two events every channel is a chain of polynomials, each with 16
/// Chebyshev coefficients (docs/reference/columns.md).
#[derive(Debug)]
pub struct DenseOutput<'f> {
    file: &'f ResultFile,
    starts: Vec<f64>,
    ends: Vec<f64>,
    held: RefCell<HashMap<String, Held>>,
}

impl ResultFile {
    /// The dense output, if the run has one. Fails if the file cannot be read.
    pub fn dense(&self) -> Result<Option<DenseOutput<'_>>, ResultError> {
        if !self.source.has(group::DENSE)? {
            return Ok(None);
        }
        let [pieces, coefficients] = schema::dense_tables(&schema::trajectory());
        let count = self.few(&pieces)?.min(self.rows(&coefficients)? / COEFFICIENTS);
        let column = |name: &str| self.values::<f64>(group::DENSE, name, 0..count);
        let (starts, ends) = (column("start")?, column("end")?);
        let in_order = starts.iter().zip(&ends).all(|(start, end)| start < end)
            && ends.iter().zip(starts.iter().skip(1)).all(|(end, next)| end <= next);
        if !in_order {
            return Err(self.source.missing("pieces in order of time in /dense"));
        }
        Ok(Some(DenseOutput {
            file: self,
            starts,
            ends,
            held: RefCell::default(),
        }))
    }
}

impl DenseOutput<'_> {
    /// Number of pieces.
    pub fn pieces(&self) -> usize {
        self.starts.len()
    }

    /// Start and end of each piece, s, in order of time.
    pub fn spans(&self) -> impl Iterator<Item = (f64, f64)> {
        self.starts.iter().copied().zip(self.ends.iter().copied())
    }

    /// Whether the dense output reaches from `from` to `to`, both in s.
    pub fn covers(&self, from: f64, to: f64) -> bool {
        self.span().is_some_and(|(start, end)| start <= from && to <= end)
    }

    /// Start and end of the dense output, s; `None` without pieces.
    pub fn span(&self) -> Option<(f64, f64)> {
        Some((*self.starts.first()?, *self.ends.last()?))
    }

    /// Index of the piece that contains `t` (s). At an event, or between two pieces, `side` decides.
    pub fn piece_at(&self, t: f64, side: EventSide) -> Option<usize> {
        let index = match side {
            EventSide::After => self.starts.partition_point(|start| *start <= t).checked_sub(1)?,
            EventSide::Before => self.ends.partition_point(|end| *end < t),
        };
        // The first piece has no neighbour before it, the last none after it.
        let index = index.min(self.starts.len().checked_sub(1)?);
        (self.starts[index] <= t && t <= self.ends[index]).then_some(index)
    }

    /// The Chebyshev coefficients of a channel in a piece. Fails without such a channel, or if the file cannot be
    /// read.
    pub fn coefficients(&self, channel: &str, piece: usize) -> Result<[f64; COEFFICIENTS], ResultError> {
        let first = piece / BLOCK * BLOCK;
        let held = self.held.borrow().get(channel).filter(|held| held.0 == first).cloned();
        let (_, block) = match held {
            Some(held) => held,
            None => {
                let rows = first * COEFFICIENTS..self.pieces().min(first + BLOCK) * COEFFICIENTS;
                let block = Rc::new(self.file.values::<f64>(group::DENSE_COEFFICIENTS, channel, rows)?);
                self.held
                    .borrow_mut()
                    .insert(channel.to_owned(), (first, block.clone()));
                (first, block)
            }
        };
        let from = (piece - first) * COEFFICIENTS;
        Ok(std::array::from_fn(|degree| {
            block.get(from + degree).copied().unwrap_or(f64::NAN)
        }))
    }

    /// Values of a /trajectory column at `times` (s): a channel, the time itself, or mode and segment of the piece.
    /// Fails like [`Self::coefficients`].
    pub fn column(&self, name: &str, times: &[f64], side: EventSide) -> Result<Vec<f64>, ResultError> {
        match name {
            "time" => Ok(times.to_vec()),
            "mode" | "segment" => {
                let codes = self.file.values::<f64>(group::DENSE, name, 0..self.pieces())?;
                let code = |&t: &f64| self.piece_at(t, side).map_or(f64::NAN, |piece| codes[piece]);
                Ok(times.iter().map(code).collect())
            }
            channel => self.values(channel, times, side),
        }
    }

    /// Values of a channel at `times` (s), in the channel's unit; NaN outside the dense output. Sorted times are
    /// fast. Fails like [`Self::coefficients`].
    pub fn values(&self, channel: &str, times: &[f64], side: EventSide) -> Result<Vec<f64>, ResultError> {
        if let Some(factors) = channel::factors(channel) {
            let [a, b] = factors.map(|factor| self.values(factor, times, side));
            return Ok(channel::products(a?, b?));
        }
        if self.file.lacking(group::DENSE_COEFFICIENTS, channel)?.is_some() {
            return Ok(vec![f64::NAN; times.len()]);
        }
        let mut last: Option<(usize, [f64; COEFFICIENTS])> = None;
        times
            .iter()
            .map(|&t| {
                let Some(piece) = self.piece_at(t, side) else {
                    return Ok(f64::NAN);
                };
                let coefficients = match last {
                    Some((index, known)) if index == piece => known,
                    _ => last.insert((piece, self.coefficients(channel, piece)?)).1,
                };
                let x = chebyshev::place(t, self.starts[piece], self.ends[piece]);
                Ok(chebyshev::value(&coefficients, x))
            })
            .collect()
    }
}
