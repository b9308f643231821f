//! Dense output: polynomials of every channel, fitted piece by piece during the run.

use super::options::OutputOptions;
use crate::Error;
use nalgebra::DMatrix;
use stickslip_system::model::Mode;
use stickslip_system::numerics::chebyshev::{self, COEFFICIENTS};
use stickslip_system::record::{DensePiece, Recorder, channel};

/// A piece is resolved if the last two coefficients of each channel are below this share of the channel's largest
/// value so far,
const RESOLVED: f64 = 1e-14;

/// or this share of the relative tolerance.
const OF_TOLERANCE: f64 = 1e-3;

/// If halving a piece improves its smoothness by less than this factor, its last coefficients are rounding,
const SMOOTHER: f64 = 0.1;

/// provided that they are below this share of the largest value, or that the piece is as short as the first of a
/// segment, in which every motion is smooth.
const ROUGH: f64 = 1e-9;

/// Roughness of such a short piece, relative to the tolerance. States inside a step of a one-step method come from
/// other steps, which differ by as much.
const INSIDE_STEPS: f64 = 0.05;

/// Coefficients are rounding if none exceeds the last two by more than this factor.
const FLAT: f64 = 8.0;

/// Length of the first piece of a segment in shortest periods. Each later piece is at most twice as long as the one
/// before.
const FIRST_SHARE: f64 = 0.25;

/// Pieces of short steps are joined, up to this many shortest periods.
const LONGEST_JOINED: f64 = 2.0;

/// Largest number of pieces in a file: 200 MB before compression.
const MOST_PIECES: usize = 60_000;

#[derive(Debug, Clone)]
struct KeptState {
    start: f64,
    end: f64,
    mode: Mode,
    segment: u32,
    coefficients: DMatrix<f64>,
}

impl KeptState {
    fn value(&self, column: usize, t: f64) -> f64 {
        let x = chebyshev::place(t, self.start, self.end);
        chebyshev::value(self.coefficients.column(column).as_slice(), x)
    }
}

#[derive(Debug)]
pub(super) struct Follower {
    first: f64,
    /// Length of the next attempt, s; 0 at the start of a segment.
    next: f64,
    largest: Vec<f64>,
    longest_joined: f64,
    resolved: f64,
    inside_steps: f64,
    open: Option<KeptState>,
    pieces_left: usize,
    /// Column of the energy residual, which is rounding.
    residual: Option<usize>,
}

pub(super) struct FollowerState<'a> {
    pub mode: Mode,
    pub segment: u32,
    /// State, channels without products, and further values at a time.
    pub row: &'a mut dyn FnMut(f64) -> Result<Vec<f64>, Error>,
}

impl Follower {
    /// `None` without dense output. `shortest` is the period of the fastest motion, s; `rtol` the relative tolerance.
    pub(super) fn new(output: &OutputOptions, shortest: f64, rtol: f64, recorder: &dyn Recorder) -> Option<Follower> {
        if !recorder.stores_motion() || !output.follow.dense {
            return None;
        }
        Some(Follower {
            first: FIRST_SHARE * shortest,
            next: 0.0,
            longest_joined: LONGEST_JOINED * shortest,
            resolved: RESOLVED.max(OF_TOLERANCE * rtol),
            inside_steps: INSIDE_STEPS * rtol,
            open: None,
            largest: Vec::new(),
            pieces_left: MOST_PIECES,
            residual: channel::all()
                .filter(|channel| channel.product.is_none())
                .position(|channel| channel.name == "energy_residual"),
        })
    }

    pub(super) fn wants_inside(&self) -> bool {
        self.pieces_left > 0
    }

    pub(super) fn segment_ended(&mut self) {
        self.next = 0.0;
    }

    pub(super) fn inside(
        &mut self,
        from: f64,
        to: f64,
        at: &mut FollowerState<'_>,
        recorder: &mut dyn Recorder,
    ) -> Result<(), Error> {
        let mut start = from;
        while start < to {
            let wish = if self.next > 0.0 { self.next } else { self.first };
            let left = to - start;
            let length = match left / wish {
                parts if parts <= 1.0 => left,
                parts if parts < 2.0 => 0.5 * left,
                _ => wish,
            };
            start = self.piece(start, if length < left { start + length } else { to }, at, recorder)?;
        }
        Ok(())
    }

    fn piece(
        &mut self,
        start: f64,
        mut end: f64,
        at: &mut FollowerState<'_>,
        recorder: &mut dyn Recorder,
    ) -> Result<f64, Error> {
        let (mut coefficients, mut rough) = self.fitted(start, end, at)?;
        while !self.is_smooth(end - start, rough) {
            let middle = start + 0.5 * (end - start);
            if middle <= start || middle >= end {
                break;
            }
            let (shorter, of_shorter) = self.fitted(start, middle, at)?;
            if (rough < ROUGH || end - start <= self.first) && of_shorter > SMOOTHER * rough {
                break;
            }
            (coefficients, rough, end) = (shorter, of_shorter, middle);
        }
        // The next piece can be longer if the last quarter of the coefficients is small, or only rounding.
        let quarter = self.roughness(&coefficients, 3 * COEFFICIENTS / 4);
        let easy = quarter <= self.resolved.max(FLAT * rough);
        self.next = if easy { 2.0 } else { 1.0 } * (end - start);
        let kept = KeptState {
            start,
            end,
            mode: at.mode,
            segment: at.segment,
            coefficients,
        };
        match self.open.take() {
            None => self.open = Some(kept),
            Some(before) => match self.joined(&before, &kept) {
                Some(joined) => self.open = Some(joined),
                None => {
                    self.close(&before, recorder)?;
                    self.open = Some(kept);
                }
            },
        }
        Ok(end)
    }

    fn is_smooth(&self, length: f64, rough: f64) -> bool {
        rough <= self.resolved || (length <= self.first && rough <= self.inside_steps)
    }

    fn joined(&self, before: &KeptState, after: &KeptState) -> Option<KeptState> {
        let length = after.end - before.start;
        if before.end != after.start || before.segment != after.segment || length > self.longest_joined {
            return None;
        }
        let times = chebyshev::nodes(before.start, after.end);
        let columns = before.coefficients.ncols();
        let mut coefficients = DMatrix::from_fn(COEFFICIENTS, columns, |k, column| {
            let part = if times[k] <= before.end { before } else { after };
            part.value(column, times[k])
        });
        chebyshev::fit(&times, &mut coefficients);
        let rough = self.roughness(&coefficients, COEFFICIENTS - 2);
        self.is_smooth(length, rough).then_some(KeptState {
            end: after.end,
            coefficients,
            ..*before
        })
    }

    fn close(&mut self, piece: &KeptState, recorder: &mut dyn Recorder) -> Result<(), Error> {
        if self.pieces_left == 0 {
            return Ok(());
        }
        self.pieces_left -= 1;
        if self.pieces_left == 0 {
            log::warn!(
                "the dense output ends at {:?} s, with {MOST_PIECES} pieces: end the run earlier to have it whole",
                piece.end
            );
        }
        let piece = DensePiece {
            start: piece.start,
            end: piece.end,
            mode: piece.mode,
            segment: piece.segment,
            coefficients: piece.coefficients.as_slice(),
        };
        recorder.piece(&piece).map_err(Error::recorder)
    }

    pub(super) fn finish(&mut self, recorder: &mut dyn Recorder) -> Result<(), Error> {
        self.open.take().map_or(Ok(()), |piece| self.close(&piece, recorder))
    }

    fn fitted(&mut self, start: f64, end: f64, at: &mut FollowerState<'_>) -> Result<(DMatrix<f64>, f64), Error> {
        let times = chebyshev::nodes(start, end);
        let mut columns = DMatrix::zeros(0, 0);
        for (k, &t) in times.iter().enumerate() {
            let row = (at.row)(t)?;
            if k == 0 {
                columns = DMatrix::zeros(COEFFICIENTS, row.len());
                self.largest.resize(row.len(), 0.0);
            }
            for (column, &value) in row.iter().enumerate() {
                columns[(k, column)] = value;
                self.largest[column] = self.largest[column].max(value.abs());
            }
        }
        chebyshev::fit(&times, &mut columns);
        let rough = self.roughness(&columns, COEFFICIENTS - 2);
        Ok((columns, rough))
    }

    /// Largest coefficient from `first` on, relative to the channel's largest value so far.
    fn roughness(&self, coefficients: &DMatrix<f64>, first: usize) -> f64 {
        let columns = coefficients.column_iter().zip(&self.largest).enumerate();
        let resolvable = columns.filter(|(column, (_, largest))| Some(*column) != self.residual && **largest > 0.0);
        let rough = resolvable.map(|(_, (c, largest))| {
            let tail = c.as_slice()[first..].iter().fold(0.0, |most: f64, c| most.max(c.abs()));
            tail / largest
        });
        rough.fold(0.0, f64::max)
    }
}
