//! The motion between the samples: polynomials of every channel, and dense samples around events.
//!
//! Which stretches are worth samples is known once their events are. The motion is therefore fitted as it is computed, piece by
//! piece; the pieces of the last [`Around`] margin are kept, and samples wait so long, so that they come in order.

use super::options::{Around, OutputOptions};
use crate::model::Mode;
use crate::numerics::chebyshev::{self, COEFFICIENTS};
use crate::record::{Channels, EventKind, Piece, Recorder, RecorderError, Sample, State};
use nalgebra::DMatrix;
use std::collections::VecDeque;

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

/// The widest margin around events, natural periods: so much of the motion waits in memory.
const WIDEST_MARGIN: f64 = 1000.0;

/// Pieces that a file has at most: 200 MB before compression.
const MOST_PIECES: usize = 60_000;

/// Samples around events that a file has at most.
const MOST_SAMPLES: usize = 300_000;

/// A sample around an event that is nearer to another one than this part of their interval is left out.
const APART: f64 = 1e-3;

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

    /// The row at `t`, with what the state has beyond [`State`].
    fn sample(&self, t: f64) -> (Sample, Vec<f64>) {
        let sample = Sample {
            time: t,
            mode: self.mode,
            segment: self.segment,
            state: State::from_values(std::array::from_fn(|k| self.value(k, t))),
            channels: Channels::from_values(std::array::from_fn(|k| self.value(State::COUNT + k, t))),
        };
        let further = State::COUNT + Channels::COUNT..self.coefficients.ncols();
        (sample, further.map(|column| self.value(column, t)).collect())
    }
}

/// See the module.
#[derive(Debug)]
pub(super) struct Follower {
    /// Which events, the margin and the interval (s).
    around: Option<(Around, f64, f64)>,
    dense: bool,
    end_time: f64,
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
    /// Just before the step that is under way, s.
    before_step: f64,
    pieces_left: usize,
    samples_left: usize,
    sticks: usize,
    /// Those of the last margin.
    pieces: VecDeque<Kept>,
    /// Samples that wait, in order of time.
    waiting: VecDeque<(Sample, Vec<f64>)>,
    /// Stretches that want dense samples, disjoint, in order of time.
    wanted: VecDeque<(f64, f64)>,
    /// Time of the last sample that was handed on.
    last: f64,
}

/// What a run is, as far as it is followed.
pub(super) struct At<'a> {
    pub mode: Mode,
    pub segment: u32,
    /// State, channels and the rest at a time, in one row.
    pub row: &'a mut dyn FnMut(f64) -> Result<Vec<f64>, RecorderError>,
}

impl Follower {
    /// `None` where nothing is asked for. Of the periods (s) the first spaces the samples around events, and the other is that of
    /// the fastest motion; `rtol` is the relative tolerance.
    pub(super) fn new(
        output: &OutputOptions,
        (period, shortest): (f64, f64),
        rtol: f64,
        recorder: &dyn Recorder,
    ) -> Option<Follower> {
        let wanted = &output.follow;
        if !recorder.stores_motion() || !(wanted.dense || wanted.around.is_some()) {
            return None;
        }
        let (mut margin, interval) = wanted.sampling(period);
        if margin > WIDEST_MARGIN * period {
            margin = WIDEST_MARGIN * period;
            log::warn!(
                "output.margin is taken for {margin:.1e} s, {WIDEST_MARGIN} natural periods: set a window for more"
            );
        }
        Some(Follower {
            around: wanted.around.map(|around| (around, margin, interval)),
            dense: wanted.dense,
            end_time: output.end_time,
            first: FIRST_SHARE * shortest,
            next: 0.0,
            longest_joined: LONGEST_JOINED * shortest,
            resolved: RESOLVED.max(OF_TOLERANCE * rtol),
            inside_steps: INSIDE_STEPS * rtol,
            open: None,
            before_step: f64::NEG_INFINITY,
            largest: Vec::new(),
            pieces_left: MOST_PIECES,
            samples_left: MOST_SAMPLES,
            sticks: 0,
            pieces: VecDeque::new(),
            waiting: VecDeque::new(),
            wanted: VecDeque::new(),
            last: f64::NEG_INFINITY,
        })
    }

    /// Whether the motion inside steps is wanted still.
    pub(super) fn wants_inside(&self) -> bool {
        (self.dense && self.pieces_left > 0) || (self.around.is_some() && self.samples_left > 0)
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
        // Samples that are due in the step are still to come.
        self.before_step = from.next_down();
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
                    self.close(before, recorder)?;
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
    fn close(&mut self, piece: Kept, recorder: &mut dyn Recorder) -> Result<(), RecorderError> {
        if self.dense && self.pieces_left > 0 {
            recorder.piece(&Piece {
                start: piece.start,
                end: piece.end,
                mode: piece.mode,
                segment: piece.segment,
                coefficients: piece.coefficients.as_slice(),
            })?;
            self.pieces_left -= 1;
            if self.pieces_left == 0 {
                log::warn!(
                    "the dense output ends at {:?} s, with {MOST_PIECES} pieces: end the run earlier to have it \
                     whole",
                    piece.end
                );
            }
        }
        if let Some((_, margin, _)) = self.around {
            let until = (piece.end - margin).min(self.before_step);
            self.pieces.push_back(piece);
            self.hand_on(until, recorder)?;
        }
        Ok(())
    }

    /// Hands on all that waits: at the end of the run.
    pub(super) fn finish(&mut self, recorder: &mut dyn Recorder) -> Result<(), RecorderError> {
        if let Some(piece) = self.open.take() {
            self.close(piece, recorder)?;
        }
        self.hand_on(f64::INFINITY, recorder)
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

    /// An event, s.
    pub(super) fn event(&mut self, t: f64, kind: EventKind) {
        if let Some((around, margin, _)) = self.around
            && around.takes(kind, self.sticks)
        {
            let (from, to) = ((t - margin).max(0.0), (t + margin).min(self.end_time));
            match self.wanted.back_mut() {
                Some(last) if from <= last.1 => last.1 = to,
                _ => self.wanted.push_back((from, to)),
            }
        }
        self.sticks += usize::from(kind == EventKind::Stick);
    }

    /// Whether samples wait here.
    pub(super) fn holds_samples(&self) -> bool {
        self.around.is_some()
    }

    /// A sample that was due.
    pub(super) fn sample(
        &mut self,
        sample: Sample,
        further: &[f64],
        recorder: &mut dyn Recorder,
    ) -> Result<(), RecorderError> {
        self.waiting.push_back((sample, further.to_vec()));
        if self.samples_left == 0 {
            // Nothing comes between them any more.
            self.wanted.clear();
            return self.hand_on(f64::INFINITY, recorder);
        }
        Ok(())
    }

    /// The next time on the grid of the samples around events that is wanted.
    fn next_dense(&mut self) -> Option<f64> {
        let (_, _, interval) = self.around?;
        while let Some(&(from, to)) = self.wanted.front() {
            let mut count = (from / interval).ceil();
            if self.last >= from {
                count = count.max((self.last / interval + APART).ceil());
                if count * interval - self.last < APART * interval {
                    count += 1.0;
                }
            }
            let t = count * interval;
            if t < to && self.samples_left > 0 {
                return Some(t);
            }
            self.wanted.pop_front();
        }
        None
    }

    /// Hands on all samples up to `until` (s), before which no other stretch will be wanted.
    fn hand_on(&mut self, until: f64, recorder: &mut dyn Recorder) -> Result<(), RecorderError> {
        let Some((_, _, interval)) = self.around else {
            return Ok(());
        };
        loop {
            let dense = self.next_dense().unwrap_or(f64::INFINITY);
            let plain = self.waiting.front().map_or(f64::INFINITY, |(sample, _)| sample.time);
            let t = dense.min(plain);
            if !(t <= until && t < f64::INFINITY) {
                break;
            }
            let row = if plain <= dense + APART * interval {
                self.waiting.pop_front()
            } else {
                self.followed(dense)
            };
            match row {
                Some((sample, further)) => {
                    self.last = sample.time;
                    recorder.further(&further)?;
                    recorder.sample(&sample)?;
                }
                // Beyond what was computed.
                None => {
                    self.wanted.clear();
                }
            }
        }
        while self.pieces.len() > 1 && self.pieces.front().is_some_and(|piece| piece.end < until) {
            self.pieces.pop_front();
        }
        Ok(())
    }

    /// The sample at `t`, which is not before one that was asked for earlier.
    fn followed(&mut self, t: f64) -> Option<(Sample, Vec<f64>)> {
        while self.pieces.get(1).is_some_and(|next| next.start <= t) {
            self.pieces.pop_front();
        }
        let piece = self.pieces.front().filter(|piece| piece.start <= t && t <= piece.end)?;
        self.samples_left -= 1;
        if self.samples_left == 0 {
            log::warn!(
                "there are no more dense samples around events from {t:?} s on, after {MOST_SAMPLES} of them: set output.margin or \
                 output.samples_per_period lower to have them later in the run"
            );
        }
        Some(piece.sample(t))
    }
}
