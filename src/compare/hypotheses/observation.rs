//! What a candidate shows of its motion: some of its samples, beside the reference at the same times.

use super::super::Channel;
use super::super::candidate::Block;
use super::super::reference::{Curve, Physics, Walk};
use crate::results::ResultError;

/// Samples kept over the whole span, and around the first difference. Where there are more of the first, every second one is dropped,
/// and so on.
const KEPT: usize = 4096;

/// Channels that are integrals of others and grow without bound: what moves them is in the others.
fn is_integral(channel: Channel) -> bool {
    use Channel::{Phi2, SlipDisplacement, Theta};
    channel.is_impulse() || matches!(channel, Theta | Phi2 | SlipDisplacement | Channel::Angle(_))
}

/// Collects samples while they go by.
#[derive(Debug)]
pub(in super::super) struct ObservationPass {
    /// Which of the blocks' columns are kept.
    columns: Vec<usize>,
    channels: Vec<Channel>,
    /// Kept whole, s.
    window: (f64, f64),
    /// Every so many are kept, as a power of 2, and how many came; elsewhere, and in the window.
    thinned: [u32; 2],
    came: [u64; 2],
    /// Time and values of each sample; of those in the window apart.
    kept: [Vec<(f64, Vec<f64>)>; 2],
    /// What the intervals of samples are, s.
    intervals: Intervals,
    /// The last sample, s.
    last: Option<f64>,
}

impl ObservationPass {
    /// Before the first sample; `channels` are those of the blocks, of which some are the candidate's `own`. Samples in `window` (s)
    /// are all kept.
    pub fn new(channels: &[Channel], own: impl Fn(Channel) -> bool, window: (f64, f64)) -> ObservationPass {
        let all = |wanted: &dyn Fn(Channel) -> bool| -> Vec<usize> {
            (0..channels.len())
                .filter(|&k| own(channels[k]) && wanted(channels[k]))
                .collect()
        };
        let mut columns = all(&|channel| !is_integral(channel));
        if columns.is_empty() {
            columns = all(&|channel| !channel.is_impulse());
        }
        ObservationPass {
            channels: columns.iter().map(|&k| channels[k]).collect(),
            columns,
            window,
            thinned: [0; 2],
            came: [0; 2],
            kept: Default::default(),
            intervals: Intervals::default(),
            last: None,
        }
    }

    /// Takes the next samples.
    pub fn add(&mut self, block: &Block) {
        for (row, &time) in block.time.iter().enumerate() {
            if let Some(last) = self.last.replace(time) {
                self.intervals.add(time - last);
            }
            let place = usize::from(time >= self.window.0 && time <= self.window.1);
            let wanted = self.came[place] & ((1 << self.thinned[place]) - 1) == 0;
            self.came[place] += 1;
            if wanted {
                let values = self.columns.iter().map(|&k| block.columns[k][row]).collect();
                self.kept[place].push((time, values));
            }
            if self.kept[place].len() > 2 * KEPT {
                self.thinned[place] += 1;
                let mut number = 0;
                self.kept[place].retain(|_| {
                    number += 1;
                    number % 2 == 1
                });
            }
        }
    }

    /// What was kept, with the reference beside it.
    ///
    /// # Errors
    /// Of the reference's file.
    pub fn finish(self, physics: &Physics, walk: Walk<'_>) -> Result<Observation, ResultError> {
        let mut rows: Vec<(f64, Vec<f64>)> = self.kept.into_iter().flatten().collect();
        rows.sort_by(|a, b| a.0.total_cmp(&b.0));
        let time: Vec<f64> = rows.iter().map(|row| row.0).collect();
        let column = |k: usize| rows.iter().map(|row| row.1[k]).collect();
        let reference = at(walk, &self.channels, &time)?;
        Ok(Observation {
            values: (0..self.channels.len()).map(column).collect(),
            sizes: self
                .channels
                .iter()
                .map(|&channel| physics.size(channel, false))
                .collect(),
            interval: self.intervals.even(),
            channels: self.channels,
            reference,
            time,
        })
    }
}

/// Intervals of samples that differ by less than this part of one are the same, and where so many are, they are even: rows at events,
/// and a last one, may stand between.
const UNEVEN: f64 = 1e-2;
const MANY: f64 = 0.9;
/// As many intervals are looked at before another is taken for the common one.
const FIRST: u64 = 16;

/// The intervals of samples.
#[derive(Debug, Default)]
struct Intervals {
    /// One of them, s, and how many are the same, with their sum.
    one: f64,
    same: u64,
    sum: f64,
    /// Since that one was taken.
    all: u64,
}

impl Intervals {
    fn add(&mut self, interval: f64) {
        if self.all == 0 || self.all == FIRST && 2 * self.same < self.all {
            *self = Intervals {
                one: interval,
                ..Intervals::default()
            };
        }
        self.all += 1;
        if (interval - self.one).abs() <= UNEVEN * self.one {
            self.same += 1;
            self.sum += interval;
        }
    }

    /// The interval (s), if they are even.
    fn even(&self) -> Option<f64> {
        let even = self.same > 0 && self.same as f64 >= MANY * self.all as f64;
        even.then(|| self.sum / self.same as f64)
    }
}

/// Part of the samples at which a motion may be unknown, as the reference is by another clock.
const UNKNOWN: f64 = 0.1;

/// The channels of a reference at some times (s) in order; not a number where it has none.
fn at(mut walk: Walk<'_>, channels: &[Channel], times: &[f64]) -> Result<Vec<Vec<f64>>, ResultError> {
    let mut values = vec![vec![f64::NAN; times.len()]; channels.len()];
    let mut curves: Vec<Curve> = Vec::new();
    for (row, &time) in times.iter().enumerate() {
        let Some((left, right, _)) = walk.at(time)? else {
            continue;
        };
        if walk.curves(channels, &mut curves) == Some(true) {
            let part = (time - left) / (right - left);
            for (column, curve) in values.iter_mut().zip(&curves) {
                column[row] = curve.at(part);
            }
        }
    }
    Ok(values)
}

/// What a candidate shows.
#[derive(Debug)]
pub(in super::super) struct Observation {
    pub channels: Vec<Channel>,
    /// The size of each channel, in its unit.
    pub sizes: Vec<f64>,
    /// s.
    pub time: Vec<f64>,
    /// By channel, at the times.
    pub values: Vec<Vec<f64>>,
    /// Of the reference; not a number where it has none.
    pub reference: Vec<Vec<f64>>,
    /// Between all samples of the candidate, s; `None` where it is not even.
    pub interval: Option<f64>,
}

/// The channels of a motion at the times of an observation.
pub(super) type Values = Vec<Vec<f64>>;

impl Observation {
    /// The reference where the candidate's clock is set right by an offset to add (s).
    ///
    /// # Errors
    /// Of the reference's file.
    pub fn reference_at(&self, walk: Walk<'_>, add: f64) -> Result<Values, ResultError> {
        let times: Vec<f64> = self.time.iter().map(|time| time + add).collect();
        at(walk, &self.channels, &times)
    }

    /// The differences of the candidate from a motion at one time, in parts of the sizes.
    fn differences<'a>(&'a self, motion: &'a Values, row: usize) -> impl Iterator<Item = f64> + 'a {
        let columns = self.values.iter().zip(motion).zip(&self.sizes);
        columns.map(move |((theirs, ours), size)| (theirs[row] - ours[row]) / size)
    }

    /// When the candidate parts from the reference, s: the first difference that is more than a part of the largest.
    pub fn parts(&self, part: f64) -> Option<f64> {
        let of = |row: usize| self.difference(&self.reference, row).unwrap_or(0.0);
        let rows = 0..self.time.len();
        let largest = rows.clone().map(of).fold(0.0, f64::max);
        let mut differs = rows.filter(|&row| of(row) > part * part * largest);
        differs.next().map(|row| self.time[row])
    }

    /// The square of the difference from a motion at one time, in parts of the sizes; `None` where it is not known.
    pub fn difference(&self, motion: &Values, row: usize) -> Option<f64> {
        let square = self.differences(motion, row).map(|x| x * x).sum::<f64>();
        square.is_finite().then_some(square)
    }

    /// Times at which the reference is known.
    fn known(&self, row: usize) -> bool {
        self.reference.iter().all(|column| column[row].is_finite())
    }

    /// The mean square of the differences from a motion, in parts of the sizes, up to a time (s) and where the reference is known; not
    /// a number where the motion is not, but for some ends.
    pub fn left(&self, motion: &Values, until: f64) -> f64 {
        let rows = self.time.partition_point(|time| *time <= until);
        let (mut sum, mut count, mut unknown) = (0.0, 0usize, 0usize);
        for row in (0..rows).filter(|&row| self.known(row)) {
            let squares = self.differences(motion, row).map(|x| x * x).sum::<f64>();
            if squares.is_nan() {
                unknown += 1;
            } else {
                (sum, count) = (sum + squares, count + 1);
            }
        }
        if count == 0 || unknown as f64 > UNKNOWN * (count + unknown) as f64 {
            return f64::NAN;
        }
        sum / (count * self.channels.len()).max(1) as f64
    }

    /// The mean square of the difference of two motions, in parts of the sizes, where both are known.
    pub fn between(&self, a: &Values, b: &Values) -> f64 {
        let columns = a.iter().zip(b).zip(&self.sizes);
        let squares = columns.flat_map(|((a, b), size)| a.iter().zip(b).map(move |(a, b)| ((a - b) / size).powi(2)));
        let known = squares.filter(|square| square.is_finite());
        let (sum, count) = known.fold((0.0, 0u32), |(sum, count), square| (sum + square, count + 1));
        sum / f64::from(count.max(1))
    }

    /// The sum of the squares of the differences from a motion, in parts of the sizes, where it is known.
    pub fn square(&self, motion: &Values) -> f64 {
        (0..self.time.len())
            .filter_map(|row| self.difference(motion, row))
            .sum()
    }

    /// The last sample before two motions differ by more than a part of the size of a channel, or one of them ends; `None` if they
    /// differ at once, or never.
    pub fn parting(&self, a: &Values, b: &Values, part: f64) -> Option<usize> {
        let columns = || a.iter().zip(b).zip(&self.sizes);
        let known = |row: &usize| columns().all(|((a, b), _)| a[*row].is_finite() && b[*row].is_finite());
        let far = |row: &usize| !columns().all(|((a, b), size)| (a[*row] - b[*row]).abs() <= part * size);
        let first = (0..self.time.len()).find(known)?;
        (first..self.time.len()).find(far)?.checked_sub(1)
    }

    /// |omega_r| of the candidate (rad/s) in the last sample up to a time (s) and in the next, if it shows it.
    pub fn speeds_near(&self, time: f64) -> Option<[f64; 2]> {
        let column = self
            .channels
            .iter()
            .position(|channel| *channel == Channel::RelativeVelocity)?;
        let next = self.time.partition_point(|other| *other <= time * (1.0 + 1e-12));
        let speed = |row: usize| self.values[column].get(row).map(|speed| speed.abs());
        Some([speed(next.checked_sub(1)?)?, speed(next)?])
    }

    /// The largest difference from the reference in the first sample at which that is known, in parts of the sizes.
    pub fn begins_apart(&self) -> Option<f64> {
        let row = (0..self.time.len()).find(|&row| self.known(row))?;
        self.differences(&self.reference, row).map(f64::abs).reduce(f64::max)
    }

    /// Whether the reference is known at any of the times.
    pub fn overlaps(&self) -> bool {
        (0..self.time.len()).any(|row| self.known(row))
    }

    /// Samples up to the first that differs from a motion by more than a part of the size of a channel.
    pub fn close(&self, motion: &Values, part: f64) -> usize {
        let far =
            |row: &usize| self.known(*row) && self.differences(motion, *row).any(|x| x.is_nan() || x.abs() > part);
        (0..self.time.len()).find(far).unwrap_or(self.time.len())
    }

    /// Samples up to the first at which a motion is not known, of some.
    pub fn known_up_to(&self, motion: &Values, rows: usize) -> usize {
        let unknown = |row: &usize| self.differences(motion, *row).any(|x| !x.is_finite());
        (0..rows).find(unknown).unwrap_or(rows)
    }

    /// What a motion differs by from the candidate in its first samples, in parts of the sizes, channel by channel.
    pub fn residual(&self, motion: &Values, rows: usize) -> Vec<f64> {
        let columns = self.values.iter().zip(motion).zip(&self.sizes);
        let each = columns.flat_map(|((theirs, ours), size)| {
            let pairs = theirs[..rows].iter().zip(&ours[..rows]);
            pairs.map(move |(theirs, ours)| (ours - theirs) / size)
        });
        each.collect()
    }
}
