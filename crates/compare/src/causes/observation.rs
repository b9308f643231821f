//! Observation of a candidate: some of its samples, with the reference at the same times.

use super::judge::FARTHER;
use crate::candidate::{Block, Candidate};
use crate::detect::{Crossings, Detection, Detector, Point};
use crate::reference::Physics;
use crate::resolution::Rounding;
use crate::vocabulary::Known;
use crate::{Channel, Found, Reference};
use stickslip_engine::simulation::Course;
use stickslip_files::ResultError;
use stickslip_system::record::{self, sequence::SequenceEvent};

/// Most samples kept over the whole span, and around the first difference. Beyond that, every second one is dropped
/// repeatedly.
const KEPT: usize = 4096;

/// Channels that are integrals of others and grow without bound, and products. Their causes show in the other channels.
fn is_integral(channel: Channel) -> bool {
    match channel {
        Channel::Recorded("theta" | "phi2" | "slip_displacement") | Channel::Angle(_) => true,
        Channel::Recorded(name) => record::channel::factors(name).is_some(),
        _ => channel.is_impulse(),
    }
}

/// Time and values of a sample, and the time (s) since which the rows have been the same.
#[derive(Debug)]
struct KeptRow {
    time: f64,
    values: Vec<f64>,
    since: f64,
}

/// Counts of rows that repeat the one before.
#[derive(Debug, Default)]
struct Repetitions {
    last: Vec<f64>,
    since: f64,
    /// Length of the present run of equal rows, and the number of runs of each length.
    length: usize,
    runs: Vec<u64>,
}

/// Longest run of equal rows that is no rest.
const LONGEST_RUN: usize = 64;
/// Part of the runs that must have one length. Rows are the same at rest, too, but most others are not.
const REPEATED: f64 = 0.5;

impl Repetitions {
    /// Takes a row; returns the time since which it has been the same, s.
    fn add(&mut self, time: f64, row: impl Iterator<Item = f64> + Clone) -> f64 {
        let is_same = self.length > 0 && row.clone().eq(self.last.iter().copied());
        if !is_same {
            self.end();
            self.last.clear();
            self.last.extend(row);
            (self.since, self.length) = (time, 0);
        }
        self.length += 1;
        self.since
    }

    fn end(&mut self) {
        if (1..=LONGEST_RUN).contains(&self.length) {
            self.runs.resize(LONGEST_RUN + 1, 0);
            self.runs[self.length] += 1;
        }
    }

    /// Number of successive equal rows, if most rows are repeated equally often; `None` if they are not repeated.
    fn times(&self) -> Option<usize> {
        let all: u64 = self.runs.iter().sum();
        let (times, runs) = self.runs.iter().enumerate().max_by_key(|(_, runs)| **runs)?;
        (times > 1 && *runs as f64 > REPEATED * all as f64).then_some(times)
    }
}

#[derive(Debug)]
pub(crate) struct ObservationPass {
    columns: Vec<usize>,
    channels: Vec<Channel>,
    /// Number of channels that are compared; a relative velocity behind them only shows events.
    compared: usize,
    drive: Vec<(Known, f64)>,
    /// Time in which all samples are kept, s.
    window: (f64, f64),
    /// Base-2 logarithm of the thinning and number of samples, outside and inside the window.
    thinned: [u32; 2],
    came: [u64; 2],
    /// Samples outside and inside the window.
    kept: [Vec<KeptRow>; 2],
    intervals: Intervals,
    last: Option<f64>,
    sums: Vec<Vec<(usize, f64)>>,
    repetitions: Repetitions,
}

impl ObservationPass {
    /// `channels` are the channels of the blocks. All samples in `window` (s) are kept.
    pub fn new(channels: &[Channel], candidate: &Candidate, window: (f64, f64)) -> ObservationPass {
        let all = |wanted: &dyn Fn(Channel) -> bool| -> Vec<usize> {
            (0..channels.len())
                .filter(|&k| candidate.is_its_own(channels[k]) && wanted(channels[k]))
                .collect()
        };
        let mut columns = all(&|channel| !is_integral(channel));
        if columns.is_empty() {
            columns = all(&|channel| !channel.is_impulse());
        }
        let compared = columns.len();
        let velocity = channels
            .iter()
            .position(|&channel| channel == Channel::RELATIVE_VELOCITY);
        columns.extend(velocity.filter(|place| !columns.contains(place)));
        let observed: Vec<Channel> = columns.iter().map(|&k| channels[k]).collect();
        let sum = |&channel: &Channel| {
            let of = candidate.sum_of(channel).into_iter();
            let places = of.map(|(of, factor)| Some((observed.iter().position(|known| *known == of)?, factor)));
            places.collect::<Option<_>>().unwrap_or_default()
        };
        ObservationPass {
            sums: observed.iter().map(sum).collect(),
            repetitions: Repetitions::default(),
            compared,
            drive: candidate.drive_of(Channel::RELATIVE_VELOCITY).to_vec(),
            channels: observed,
            columns,
            window,
            thinned: [0; 2],
            came: [0; 2],
            kept: Default::default(),
            intervals: Intervals::default(),
            last: None,
        }
    }

    pub fn add(&mut self, block: &Block) {
        for (row, &time) in block.time.iter().enumerate() {
            if let Some(last) = self.last.replace(time) {
                self.intervals.add(time - last);
            }
            let place = usize::from(time >= self.window.0 && time <= self.window.1);
            let compared = self.columns[..self.compared].iter();
            let since = self.repetitions.add(time, compared.map(|&k| block.columns[k][row]));
            let wanted = self.came[place] & ((1 << self.thinned[place]) - 1) == 0;
            self.came[place] += 1;
            if wanted {
                let values = self.columns.iter().map(|&k| block.columns[k][row]).collect();
                self.kept[place].push(KeptRow { time, values, since });
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

    pub fn finish(self, reference: &Reference) -> Result<Observation, ResultError> {
        let mut rows: Vec<KeptRow> = self.kept.into_iter().flatten().collect();
        rows.sort_by(|a, b| a.time.total_cmp(&b.time));
        let time: Vec<f64> = rows.iter().map(|row| row.time).collect();
        let column = |k: usize| rows.iter().map(|row| row.values[k]).collect();
        let size = |(k, &channel): (usize, &Channel)| match k < self.compared {
            true => reference.physics.size(channel, false),
            false => f64::INFINITY,
        };
        let mut seen = Observation {
            values: (0..self.channels.len()).map(column).collect(),
            sizes: self.channels.iter().enumerate().map(size).collect(),
            interval: self.intervals.even(),
            spacing: self.intervals.mean(),
            drive: self.drive,
            channels: self.channels,
            constants: 0.0,
            sums: self.sums,
            since: rows.iter().map(|row| row.since).collect(),
            repeated: self.repetitions.times(),
            reference: Vec::new(),
            time,
        };
        seen.reference = seen.reference_at(reference, 0.0)?;
        seen.constants = seen.left_by_constants();
        Ok(seen)
    }
}

/// Intervals that differ by less than this part are equal. Sampling is even if this part of the intervals is equal;
/// rows at events and a last row may stand between.
const UNEVEN: f64 = 1e-2;
const MANY: f64 = 0.9;
/// Intervals examined before another becomes the common interval.
const FIRST: u64 = 16;

#[derive(Debug, Default)]
struct Intervals {
    /// The common interval, s, how many intervals equal it, and their sum.
    one: f64,
    same: u64,
    sum: f64,
    all: u64,
    span: f64,
}

impl Intervals {
    fn add(&mut self, interval: f64) {
        if self.all == 0 || self.all == FIRST && 2 * self.same < self.all {
            *self = Intervals {
                one: interval,
                span: self.span,
                ..Intervals::default()
            };
        }
        self.all += 1;
        self.span += interval;
        if (interval - self.one).abs() <= UNEVEN * self.one {
            self.same += 1;
            self.sum += interval;
        }
    }

    fn even(&self) -> Option<f64> {
        let even = self.same > 0 && self.same as f64 >= MANY * self.all as f64;
        even.then(|| self.sum / self.same as f64)
    }

    fn mean(&self) -> f64 {
        self.span / self.all as f64
    }
}

/// Part of the samples at which a motion may be unknown, as the reference is under another clock.
const UNKNOWN: f64 = 0.1;

/// 0 without values.
fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0u32), |(sum, count), value| (sum + value, count + 1));
    sum / f64::from(count.max(1))
}

#[derive(Debug, Default)]
pub(crate) struct Observation {
    pub channels: Vec<Channel>,
    /// Size of each channel, in its unit; infinite for a relative velocity that follows from the reference's drive.
    pub sizes: Vec<f64>,
    pub time: Vec<f64>,
    pub values: Vec<Vec<f64>>,
    /// Values of the reference; NaN if unknown.
    pub reference: Vec<Vec<f64>>,
    pub interval: Option<f64>,
    /// Mean interval of the samples, s.
    pub spacing: f64,
    /// Motion of driven ends in the relative velocity, which the reference supplies.
    pub drive: Vec<(Known, f64)>,
    /// Places and factors of the channels of which a channel is the sum; empty for a column of the file.
    pub sums: Vec<Vec<(usize, f64)>>,
    /// Time since which the rows up to each sample are the same, s.
    pub since: Vec<f64>,
    /// Number of successive equal rows, if rows are repeated.
    pub repeated: Option<usize>,
    /// Mean square of the difference from the reference, in parts of the sizes, less a constant of each channel.
    pub constants: f64,
}

/// Rows in a row that contradict a motion, behind the first: a sample at the time of an event may show either side of it.
const CONTRADICT: usize = 2;

pub(crate) type ObservedValues = Vec<Vec<f64>>;

impl Observation {
    /// Channels of a reference at times that are `add` (s) later; NaN if unknown.
    pub fn reference_at(&self, reference: &Reference, add: f64) -> Result<ObservedValues, ResultError> {
        let mut walk = reference.walk(&self.channels)?;
        let mut values = vec![vec![f64::NAN; self.time.len()]; self.channels.len()];
        for (row, time) in self.time.iter().map(|time| time + add).enumerate() {
            let Some((left, right, _)) = walk.at(time)? else {
                continue;
            };
            if walk.expand() {
                let part = (time - left) / (right - left);
                for (column, curve) in values.iter_mut().zip(&walk.curves) {
                    column[row] = curve.at(part);
                }
            }
        }
        Ok(values)
    }

    /// Exchanges the motion of driven ends in the relative velocity of a motion under `course`, `add` (s) later, for the
    /// reference's, with which a file without that velocity is completed.
    pub fn complete(&self, values: &mut ObservedValues, physics: &Physics, course: &Course, add: f64) {
        let Some(velocity) = self.velocity().filter(|_| !self.drive.is_empty()) else {
            return;
        };
        for (value, &time) in values[velocity].iter_mut().zip(&self.time) {
            for (known, factor) in &self.drive {
                let own = course.ends(time + add)[known.of as usize];
                let own = if known.is_rate { own.1 } else { own.0 };
                *value += factor * (physics.driven(*known, time) - own);
            }
        }
    }

    fn place(&self, channel: Channel) -> Option<usize> {
        self.channels.iter().position(|known| *known == channel)
    }

    fn velocity(&self) -> Option<usize> {
        self.place(Channel::RELATIVE_VELOCITY)
    }

    /// Events of a motion as they are found in the candidate; `None` without a relative velocity. `sticks`: the contact
    /// has a stick.
    pub fn found(&self, motion: &ObservedValues, detection: Detection, sticks: bool) -> Option<Vec<SequenceEvent>> {
        let velocity = &motion[self.velocity()?];
        let force = self.place(Channel::NORMAL_FORCE);
        let rows = (0..self.time.len()).filter(|&row| velocity[row].is_finite());
        let points = rows.map(|row| Point {
            time: self.time[row],
            velocity: velocity[row],
            normal_force: force.map_or(f64::INFINITY, |force| motion[force][row]),
            torques: None,
        });
        let found: Vec<Found> = if sticks {
            let mut detector = Detector::new(detection);
            points.for_each(|point| detector.add(point));
            detector.finish()
        } else {
            let mut crossings = Crossings::new(detection.velocity_tolerance, 0.0);
            points.for_each(|point| crossings.add(point.time, point.velocity));
            crossings.events
        };
        Some(found.iter().map(SequenceEvent::from).collect())
    }

    /// Whether a motion differs from the candidate, up to a time (s), where the candidate is still the reference. That is
    /// up to a difference of `least`, or of a thousandth of the largest, in parts of the sizes.
    pub fn contradicts(&self, motion: &ObservedValues, least: f64, until: f64) -> bool {
        const FIRST: f64 = 1e-3;
        let rows = 0..self.time.partition_point(|time| *time <= until);
        let off = |of: &ObservedValues, row: usize| self.difference(of, row).map(f64::sqrt);
        let reference: Vec<Option<f64>> = rows.map(|row| off(&self.reference, row)).collect();
        let largest = reference.iter().flatten().copied().fold(0.0, f64::max);
        [least, FIRST * largest].into_iter().any(|level| {
            let same = reference
                .iter()
                .take_while(|off| off.is_none_or(|off| off <= level))
                .count();
            let far = |row: usize| off(motion, row).is_some_and(|off| off > FARTHER * level);
            same > 0 && far(0) || (CONTRADICT..=same).any(|end| (end - CONTRADICT..end).all(far))
        })
    }

    /// Mean square effect of decimals beyond which all values of a channel are zero, in parts of the sizes.
    pub fn rounding(&self) -> f64 {
        const MOST: u32 = 9;
        const DIFFERENT: usize = 64;
        let columns = self.values.iter().zip(&self.sizes);
        let squares = columns.map(|(values, size)| {
            let decimals = (0..MOST).map(Rounding::Decimals).find(|decimals| decimals.hold(values));
            let quantum = decimals.map_or(0.0, |decimals| decimals.quantum(1.0));
            // Small values are multiples of anything, namely none.
            let mut multiples: Vec<f64> = values.iter().map(|value| (value / quantum).round()).collect();
            multiples.sort_by(f64::total_cmp);
            multiples.dedup();
            let is_known = decimals.is_some() && multiples.len() >= DIFFERENT;
            if is_known { (0.5 * quantum / size).powi(2) } else { 0.0 }
        });
        squares.sum::<f64>() / self.channels.len().max(1) as f64
    }

    /// Whether a compared channel is a column of the file, and not the sum of others.
    pub fn is_column(&self, channel: usize) -> bool {
        self.sizes[channel].is_finite() && self.sums.get(channel).is_some_and(Vec::is_empty)
    }

    /// Places of the channels that are columns of the file.
    pub fn columns(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.channels.len()).filter(|&channel| self.is_column(channel))
    }

    /// Computes the channels that are sums of others as they are in the candidate's file.
    pub fn derive(&self, values: &mut ObservedValues, physics: &Physics) {
        let sums = self.sums.iter().enumerate().filter(|(_, sum)| !sum.is_empty());
        for (place, sum) in sums {
            let is_velocity = self.channels[place] == Channel::RELATIVE_VELOCITY;
            let drive = if is_velocity { &self.drive[..] } else { &[] };
            let value = |(row, &time): (usize, &f64)| {
                let of_drive = drive
                    .iter()
                    .map(|(known, factor)| factor * physics.driven(*known, time));
                let of_columns = sum.iter().map(|&(column, factor)| factor * values[column][row]);
                of_columns.chain(of_drive).sum::<f64>()
            };
            values[place] = self.time.iter().enumerate().map(value).collect();
        }
    }

    /// Mean square of the differences of a channel from a motion, in parts of its size, where both are known.
    pub fn left_in(&self, channel: usize, motion: &[f64]) -> f64 {
        let pairs = self.values[channel].iter().zip(motion).zip(&self.reference[channel]);
        let known = pairs.filter(|((_, motion), reference)| motion.is_finite() && reference.is_finite());
        mean(known.map(|((theirs, motion), _)| ((theirs - motion) / self.sizes[channel]).powi(2)))
    }

    /// Mean difference of a channel from the reference, in its unit.
    pub fn mean_off(&self, channel: usize) -> f64 {
        let pairs = self.values[channel].iter().zip(&self.reference[channel]);
        mean(pairs.map(|(theirs, ours)| theirs - ours).filter(|off| off.is_finite()))
    }

    fn left_by_constants(&self) -> f64 {
        let of_channel = |(channel, values): (usize, &Vec<f64>)| {
            let mean = self.mean_off(channel);
            let moved: Vec<f64> = values.iter().map(|value| value + mean).collect();
            self.left_in(channel, &moved)
        };
        let each = self.reference.iter().enumerate().map(of_channel);
        each.sum::<f64>() / self.channels.len().max(1) as f64
    }

    /// Differences of the candidate from a motion in one sample, in parts of the sizes.
    fn differences<'a>(&'a self, motion: &'a ObservedValues, row: usize) -> impl Iterator<Item = f64> + 'a {
        let columns = self.values.iter().zip(motion).zip(&self.sizes);
        columns.map(move |((theirs, ours), size)| (theirs[row] - ours[row]) / size)
    }

    /// Time at which the candidate departs from the reference, s: the first difference above this part of the largest.
    pub fn parts(&self, part: f64) -> Option<f64> {
        let of = |row: usize| self.difference(&self.reference, row).unwrap_or(0.0);
        let rows = 0..self.time.len();
        let largest = rows.clone().map(of).fold(0.0, f64::max);
        let mut differs = rows.filter(|&row| of(row) > part * part * largest);
        differs.next().map(|row| self.time[row])
    }

    /// Square of the difference from a motion in one sample, in parts of the sizes; `None` if unknown.
    pub fn difference(&self, motion: &ObservedValues, row: usize) -> Option<f64> {
        let square = self.differences(motion, row).map(|x| x * x).sum::<f64>();
        square.is_finite().then_some(square)
    }

    fn known(&self, row: usize) -> bool {
        self.reference.iter().all(|column| column[row].is_finite())
    }

    /// Mean square of the differences from a motion, in parts of the sizes, up to a time (s) and where the reference is
    /// known; NaN if the motion is unknown in more than a few samples.
    pub fn left(&self, motion: &ObservedValues, until: f64) -> f64 {
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

    /// Mean square of the difference of two motions, in parts of the sizes, where both are known.
    pub fn between(&self, a: &ObservedValues, b: &ObservedValues) -> f64 {
        let columns = a.iter().zip(b).zip(&self.sizes);
        let squares = columns.flat_map(|((a, b), size)| a.iter().zip(b).map(move |(a, b)| ((a - b) / size).powi(2)));
        mean(squares.filter(|square| square.is_finite()))
    }

    /// Sum of squares of the differences from a motion, in parts of the sizes, where it is known.
    pub fn square(&self, motion: &ObservedValues) -> f64 {
        (0..self.time.len())
            .filter_map(|row| self.difference(motion, row))
            .sum()
    }

    /// Last sample before two motions differ by more than a part of a channel's size, or one of them ends; `None` if
    /// they differ at once, or never.
    pub fn parting(&self, a: &ObservedValues, b: &ObservedValues, part: f64) -> Option<usize> {
        let columns = || a.iter().zip(b).zip(&self.sizes);
        let known = |row: &usize| columns().all(|((a, b), _)| a[*row].is_finite() && b[*row].is_finite());
        let far = |row: &usize| !columns().all(|((a, b), size)| (a[*row] - b[*row]).abs() <= part * size);
        let first = (0..self.time.len()).find(known)?;
        (first..self.time.len()).find(far)?.checked_sub(1)
    }

    /// |omega_r| of the candidate (rad/s) in the last sample up to a time (s) and in the next.
    pub fn speeds_near(&self, time: f64) -> Option<[f64; 2]> {
        let column = self.velocity()?;
        let next = self.time.partition_point(|other| *other <= time * (1.0 + 1e-12));
        let speed = |row: usize| self.values[column].get(row).map(|speed| speed.abs());
        Some([speed(next.checked_sub(1)?)?, speed(next)?])
    }

    /// Largest difference from the reference in the first sample at which it is known, in parts of the sizes.
    pub fn begins_apart(&self) -> Option<f64> {
        let row = (0..self.time.len()).find(|&row| self.known(row))?;
        self.differences(&self.reference, row).map(f64::abs).reduce(f64::max)
    }

    pub fn overlaps(&self) -> bool {
        (0..self.time.len()).any(|row| self.known(row))
    }

    /// Number of samples before the first that differs from a motion by more than a part of a channel's size.
    pub fn close(&self, motion: &ObservedValues, part: f64) -> usize {
        let far =
            |row: &usize| self.known(*row) && self.differences(motion, *row).any(|x| x.is_nan() || x.abs() > part);
        (0..self.time.len()).find(far).unwrap_or(self.time.len())
    }

    /// Number of samples, at most `rows`, before the first at which a motion is unknown.
    pub fn known_up_to(&self, motion: &ObservedValues, rows: usize) -> usize {
        let unknown = |row: &usize| self.differences(motion, *row).any(|x| !x.is_finite());
        (0..rows).find(unknown).unwrap_or(rows)
    }

    /// Differences of a motion from the candidate in its first samples, channel by channel in parts of the sizes.
    pub fn residual(&self, motion: &ObservedValues, rows: usize) -> Vec<f64> {
        let columns = self.values.iter().zip(motion).zip(&self.sizes);
        let each = columns.flat_map(|((theirs, ours), size)| {
            let pairs = theirs[..rows].iter().zip(&ours[..rows]);
            pairs.map(move |(theirs, ours)| (ours - theirs) / size)
        });
        each.collect()
    }
}
