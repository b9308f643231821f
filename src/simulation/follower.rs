//! Dense output: polynomials of every channel, fitted piece by piece as the run goes.

use super::options::OutputOptions;
use crate::model::Mode;
use crate::numerics::chebyshev::{self, COEFFICIENTS};
use crate::record::{Channels, Piece, Recorder, RecorderError, State};
use nalgebra::DMatrix;

/// A piece is short enough where the last two coefficients of each channel are below this part of the largest value that the
/// channel has had in the run,
const RESOLVED: f64 = 1e-14;

/// or below this part of the relative tolerance.
const OF_TOLERANCE: f64 = 1e-3;

/// Where a piece of half the length is no smoother than by this factor, rounding is all that is left of its last coefficients,
const SMOOTHER: f64 = 0.1;

/// if they are below this part of the channel's largest value, or the piece is as short as the first of a segment: then every
/// motion is smooth in it.
const ROUGH: f64 = 1e-9;

/// So short a piece may be rough to this part of the relative tolerance. The states inside a step of a one-step method are those of
/// other steps, which differ by as much where one of them is taken in two.
const INSIDE_STEPS: f64 = 0.05;

/// Coefficients are all rounding where none is larger than the last two by more than this factor.
const FLAT: f64 = 8.0;

/// The first piece of a segment is this part of the shortest period; the next ones are at most twice as long as the last.
const FIRST_SHARE: f64 = 0.25;

/// Pieces of steps that are shorter than the motion needs are joined, up to so many of the shortest periods.
const LONGEST_JOINED: f64 = 2.0;

/// Pieces that a file has at most: 200 MB before compression.
const MOST_PIECES: usize = 60_000;

/// Position of the energy residual among the columns: a difference of rounded sums, which no polynomial resolves.
fn is_rounding(column: usize) -> bool {
    column + 1 == State::COUNT + Channels::COUNT
}

/// A piece with its coefficients, one column for each channel.
#[derive(Debug, Clone)]
struct Kept {
    start: f64,
    end: f64,
    mode: Mode,
    segment: u32,
    coefficients: DMatrix<f64>,
}

impl Kept {
    fn value(&self, column: usize, t: f64) -> f64 {
        let x = chebyshev::place(t, self.start, self.end);
        chebyshev::value(self.coefficients.column(column).as_slice(), x)
    }
}

/// See the module.
#[derive(Debug)]
pub(super) struct Follower {
    /// The length of the first piece of a segment, s.
    first: f64,
    /// The length to try next, s; 0 at the start of a segment.
    next: f64,
    /// The largest value of each channel so far.
    largest: Vec<f64>,
    /// Pieces of steps are joined up to this length, s.
    longest_joined: f64,
    /// How rough any piece may be, and a short one inside steps.
    resolved: f64,
    inside_steps: f64,
    /// The last piece, which might be joined with the next.
    open: Option<Kept>,
    pieces_left: usize,
}

/// What a run is, as far as it is followed.
pub(super) struct At<'a> {
    pub mode: Mode,
    pub segment: u32,
    /// State, channels and the rest at a time, in one row.
    pub row: &'a mut dyn FnMut(f64) -> Result<Vec<f64>, RecorderError>,
}

impl Follower {
    /// `None` where no dense output is asked for. `shortest` is the period of the fastest motion, s; `rtol` the relative tolerance.
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
        })
    }

    /// Whether the motion inside steps is wanted still.
    pub(super) fn wants_inside(&self) -> bool {
        self.pieces_left > 0
    }

    /// A segment has ended.
    pub(super) fn segment_ended(&mut self) {
        self.next = 0.0;
    }

    /// A step from `from` to `to` (s).
    pub(super) fn inside(
        &mut self,
        from: f64,
        to: f64,
        at: &mut At<'_>,
        recorder: &mut dyn Recorder,
    ) -> Result<(), RecorderError> {
        let mut start = from;
        while start < to {
            let wish = if self.next > 0.0 { self.next } else { self.first };
            let left = to - start;
            // No remainder that is far shorter than the rest.
            let length = match left / wish {
                parts if parts <= 1.0 => left,
                parts if parts < 2.0 => 0.5 * left,
                _ => wish,
            };
            start = self.piece(start, if length < left { start + length } else { to }, at, recorder)?;
        }
        Ok(())
    }

    /// Fits a piece from `start` on, which ends at `end` at the latest; returns its end.
    fn piece(
        &mut self,
        start: f64,
        mut end: f64,
        at: &mut At<'_>,
        recorder: &mut dyn Recorder,
    ) -> Result<f64, RecorderError> {
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
        // The last quarter of the coefficients tells whether a longer piece would do: small ones, or, where rounding is all that
        // is left, none that stands out.
        let quarter = self.roughness(&coefficients, 3 * COEFFICIENTS / 4);
        let easy = quarter <= self.resolved.max(FLAT * rough);
        self.next = if easy { 2.0 } else { 1.0 } * (end - start);
        let kept = Kept {
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

    /// One piece in the place of two that follow each other, as where steps are shorter than the motion needs; `None` where one is
    /// not enough.
    fn joined(&self, before: &Kept, after: &Kept) -> Option<Kept> {
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
        self.is_smooth(length, rough).then_some(Kept {
            end: after.end,
            coefficients,
            ..*before
        })
    }

    /// Hands a piece on.
    fn close(&mut self, piece: &Kept, recorder: &mut dyn Recorder) -> Result<(), RecorderError> {
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
        recorder.piece(&Piece {
            start: piece.start,
            end: piece.end,
            mode: piece.mode,
            segment: piece.segment,
            coefficients: piece.coefficients.as_slice(),
        })
    }

    /// Hands on the last piece: at the end of the run.
    pub(super) fn finish(&mut self, recorder: &mut dyn Recorder) -> Result<(), RecorderError> {
        self.open.take().map_or(Ok(()), |piece| self.close(&piece, recorder))
    }

    /// The coefficients from `start` to `end` (s), and the largest of the last two as part of the largest value so far.
    fn fitted(&mut self, start: f64, end: f64, at: &mut At<'_>) -> Result<(DMatrix<f64>, f64), RecorderError> {
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

    /// The largest coefficient from `first` on as a part of the channel's largest value so far.
    fn roughness(&self, coefficients: &DMatrix<f64>, first: usize) -> f64 {
        let columns = coefficients.column_iter().zip(&self.largest).enumerate();
        let resolvable = columns.filter(|(column, (_, largest))| !is_rounding(*column) && **largest > 0.0);
        let rough = resolvable.map(|(_, (c, largest))| {
            let tail = c.as_slice()[first..].iter().fold(0.0, |most: f64, c| most.max(c.abs()));
            tail / largest
        });
        rough.fold(0.0, f64::max)
    }
}
