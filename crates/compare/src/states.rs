//! Errors of the channels, sample by sample, in one pass over both runs.
//!
//! After a matched event that is off, the runs are compared at the same time since that event, and at the same time. What
//! is closer counts, window by window: a late motion is compared in its phase, but a right one whose event was found late
//! is not shifted.

use super::Channel;
use super::candidate::Block;
use super::reference::{Physics, Walk};
use serde::Serialize;
use std::ops::Range;
use stickslip_files::ResultError;
use stickslip_system::record::sequence::{Alignment, SequenceEvent};

/// The errors of some samples.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct ErrorSum {
    pub samples: u64,
    /// Largest absolute error, and its time, s.
    pub max: f64,
    pub max_at: f64,
    pub squares: Squares,
}

impl ErrorSum {
    #[inline]
    pub fn add(&mut self, time: f64, error: f64) {
        self.samples += 1;
        if error.abs() > self.max {
            (self.max, self.max_at) = (error.abs(), time);
        }
        self.squares.add(error);
    }

    fn append(&mut self, other: &ErrorSum) {
        self.samples += other.samples;
        if other.max > self.max {
            (self.max, self.max_at) = (other.max, other.max_at);
        }
        self.squares.append(other.squares);
    }

    pub fn rms(&self) -> f64 {
        self.squares.rms(self.samples)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Tally {
    pub errors: ErrorSum,
    pub largest: f64,
    pub max_mixed: f64,
    /// Sums of candidate times reference, reference squared and candidate squared, which reveal a common factor.
    pub products: [f64; 3],
}

impl Tally {
    #[inline]
    fn add(&mut self, time: f64, candidate: f64, reference: f64, scale: f64) {
        let error = (candidate - reference).abs();
        let size = reference.abs();
        self.errors.add(time, error);
        // A product, because a division is slower.
        if error > self.max_mixed * (scale + size) {
            self.max_mixed = (error / (scale + size)).min(f64::MAX);
        }
        self.largest = self.largest.max(size);
        self.products[0] += candidate * reference;
        self.products[1] += reference * reference;
        self.products[2] += candidate * candidate;
    }

    fn append(&mut self, other: &Tally) {
        self.errors.append(&other.errors);
        self.largest = self.largest.max(other.largest);
        self.max_mixed = self.max_mixed.max(other.max_mixed);
        let products = self.products.iter_mut().zip(other.products);
        products.for_each(|(sum, product)| *sum += product);
    }

    /// Significant correct digits, -log10 of the largest error relative to the largest |reference|. Most channels pass
    /// through zero, where a relative error is meaningless. 17 without an error, `None` if the reference is zero
    /// throughout.
    pub fn scd(&self) -> Option<f64> {
        let relative = (self.errors.max / self.largest).min(f64::MAX);
        digits(self.errors.samples, relative).filter(|_| self.largest > 0.0)
    }

    /// Mixed digits, -log10 of the largest |error|/(scale + |reference|); 17 without an error.
    pub fn mescd(&self) -> Option<f64> {
        digits(self.errors.samples, self.max_mixed)
    }
}

/// A sum of squares that does not overflow.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Squares {
    sum: f64,
    /// In units of [`LARGE`] squared.
    of_large: f64,
}

/// In this unit the square of the largest double, and any sum of such squares, is finite.
const LARGE: f64 = f64::from_bits((1023 + 600) << 52);

impl Squares {
    #[inline]
    pub fn add(&mut self, x: f64) {
        let large = x * (1.0 / LARGE);
        self.sum += x * x;
        self.of_large += large * large;
    }

    fn append(&mut self, other: Squares) {
        self.sum += other.sum;
        self.of_large += other.of_large;
    }

    pub fn is_less(&self, other: &Squares) -> bool {
        match self.sum.is_finite() && other.sum.is_finite() {
            true => self.sum < other.sum,
            false => self.of_large < other.of_large,
        }
    }

    pub fn rms(&self, count: u64) -> f64 {
        let count = count.max(1) as f64;
        match self.sum.is_finite() {
            true => (self.sum / count).sqrt(),
            false => (self.of_large / count).sqrt() * LARGE,
        }
    }
}

const MOST_DIGITS: f64 = 17.0;

fn digits(samples: u64, error: f64) -> Option<f64> {
    (samples > 0).then(|| (-error.log10()).min(MOST_DIGITS))
}

const MOST_PROBED: usize = 200_000;

/// Count of rotor twists that are multiples of the rounding of the rotor's angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Grid {
    on: usize,
    of: usize,
}

/// A part of the samples.
#[derive(Debug, Clone, Default)]
struct SamplePart {
    tallies: Vec<Tally>,
    outside: u64,
    too_sparse: u64,
}

impl SamplePart {
    fn samples(&self) -> u64 {
        self.tallies.first().map_or(0, |tally| tally.errors.samples)
    }

    fn append(&mut self, other: &SamplePart) {
        self.outside += other.outside;
        self.too_sparse += other.too_sparse;
        let each = self.tallies.iter_mut().zip(&other.tallies);
        each.for_each(|(sum, tally)| sum.append(tally));
    }

    fn clear(&mut self) {
        self.tallies.fill(Tally::default());
        (self.outside, self.too_sparse) = (0, 0);
    }

    /// Mean square of the errors, in parts of the channels' sizes; infinite without samples.
    fn error(&self, scales: &[f64]) -> f64 {
        let each = self.tallies.iter().zip(scales);
        match self.samples() {
            0 => f64::INFINITY,
            _ => each.map(|(tally, scale)| (tally.errors.rms() / scale).powi(2)).sum(),
        }
    }
}

impl Walk<'_> {
    /// Compares rows of a block with the reference at their times less a shift, s.
    fn compare(
        &mut self,
        scales: &[f64],
        (block, rows): (&Block, Range<usize>),
        shift: f64,
        part: &mut SamplePart,
        mut grid: Option<&mut Grid>,
    ) -> Result<(), ResultError> {
        let time = &block.time[..rows.end];
        let mut i = rows.start;
        while i < rows.end {
            let Some((left, right, closes)) = self.at(time[i] - shift)? else {
                part.outside += 1;
                i += 1;
                continue;
            };
            let mut count = time[i..].partition_point(|&t| t - shift <= right);
            // At a kick or a corner a sample may show either side.
            if closes && time[i + count - 1] - shift == right {
                count -= 1;
                part.outside += 1;
                if count == 0 {
                    i += 1;
                    continue;
                }
            }
            let sound = self.expand();
            self.compare_inside(scales, (block, i..i + count), shift, (left, right), sound, part);
            if let Some(grid) = &mut grid {
                grid.look(self.channels(), block, i..i + count, self.rotor_angle());
            }
            i += count;
        }
        Ok(())
    }

    fn compare_inside(
        &self,
        scales: &[f64],
        (block, rows): (&Block, Range<usize>),
        shift: f64,
        (left, right): (f64, f64),
        sound: bool,
        to: &mut SamplePart,
    ) {
        let width = right - left;
        // In a sparse gap only the reference's own samples are valid.
        let usable = |s: f64| sound || s == 0.0 || s == 1.0;
        let part = |t: f64| (t - left - shift) / width;
        if !sound {
            to.too_sparse += rows.clone().filter(|&i| !usable(part(block.time[i]))).count() as u64;
        }
        let times = &block.time[rows.clone()];
        for (k, curve) in self.curves.iter().enumerate() {
            let (tally, scale) = (&mut to.tallies[k], scales[k]);
            let samples = times.iter().zip(&block.columns[k][rows.clone()]);
            // A copy, which the processor keeps in registers.
            let mut sum = *tally;
            if sound {
                // A product, because a division is slower.
                let (from, per_width) = (left + shift, 1.0 / width);
                let part = |t: f64| (t - from) * per_width;
                samples.for_each(|(&t, &v)| sum.add(t, v, curve.at(part(t)), scale));
            } else {
                for (&t, &value) in samples.filter(|&(&t, _)| usable(part(t))) {
                    sum.add(t, value, curve.at(part(t)), scale);
                }
            }
            *tally = sum;
        }
    }
}

/// A pass over blocks of the candidate, which walks through the reference in parallel.
#[derive(Debug)]
pub(crate) struct StatePass<'a> {
    /// Timed from the last matched event, and at the candidate's own times.
    walks: [Walk<'a>; 2],
    pub channels: Vec<Channel>,
    windows: Vec<Window>,
    window: usize,
    parts: [SamplePart; Phase::ALL.len()],
    /// The present window by both walks.
    present: [SamplePart; 2],
    scales: [Vec<f64>; Phase::ALL.len()],
    pub grid: Grid,
}

impl<'a> StatePass<'a> {
    pub fn new(walks: [Walk<'a>; 2], physics: &Physics, channels: &[Channel], windows: Vec<Window>) -> Self {
        let scales = Phase::ALL.map(|phase| {
            // Before stick-slip, speeds have the size of the initial speed.
            let scale = |&channel: &Channel| physics.size(channel, phase == Phase::Sliding);
            channels.iter().map(scale).collect()
        });
        let part = SamplePart {
            tallies: vec![Tally::default(); channels.len()],
            ..SamplePart::default()
        };
        StatePass {
            walks,
            channels: channels.to_vec(),
            windows,
            window: 0,
            parts: std::array::from_fn(|_| part.clone()),
            present: [part.clone(), part],
            scales,
            grid: Grid::default(),
        }
    }

    pub fn add(&mut self, block: &Block) -> Result<(), ResultError> {
        let time = &block.time;
        let mut i = 0;
        while i < time.len() {
            while self.windows.get(self.window).is_some_and(|w| time[i] >= w.to) {
                self.close();
                self.window += 1;
            }
            let Some(&window) = self.windows.get(self.window) else {
                self.outside(time.len() - i);
                break;
            };
            if time[i] <= window.from {
                let skipped = time[i..].partition_point(|&t| t <= window.from);
                self.outside(skipped);
                i += skipped;
                continue;
            }
            let end = i + time[i..].partition_point(|&t| t < window.to);
            let (phase, shift) = (window.phase as usize, window.shift);
            let scales = &self.scales[phase][..];
            let ([shifted, same], part) = (&mut self.walks, &mut self.parts[phase]);
            if window.phase == Phase::Apart {
                same.compare(scales, (block, i..end), 0.0, part, None)?;
            } else if shift == 0.0 {
                shifted.compare(scales, (block, i..end), 0.0, part, Some(&mut self.grid))?;
            } else {
                let [by_event, by_time] = &mut self.present;
                shifted.compare(scales, (block, i..end), shift, by_event, Some(&mut self.grid))?;
                // Where both runs are in the segment.
                let (from, to) = (window.from.max(window.from - shift), window.to.min(window.to - shift));
                let first = i + time[i..end].partition_point(|&t| t <= from);
                let last = first.max(i + time[i..end].partition_point(|&t| t < to));
                same.compare(scales, (block, first..last), 0.0, by_time, None)?;
                by_time.outside += (end - i - (last - first)) as u64;
            }
            i = end;
        }
        Ok(())
    }

    fn outside(&mut self, samples: usize) {
        self.parts[Phase::Apart as usize].outside += samples as u64;
    }

    /// Takes the closer part of a window.
    fn close(&mut self) {
        let Some(window) = self.windows.get(self.window).filter(|w| w.shift != 0.0) else {
            return;
        };
        let phase = window.phase as usize;
        let [by_event, by_time] = &mut self.present;
        let scales = &self.scales[phase];
        let is_closer = by_time.error(scales) < by_event.error(scales);
        self.parts[phase].append(if is_closer { by_time } else { by_event });
        by_event.clear();
        by_time.clear();
    }

    /// Ends the last window.
    pub fn finish(mut self) -> Self {
        self.close();
        self
    }

    pub fn tallies(&self, phase: Phase) -> &[Tally] {
        &self.parts[phase as usize].tallies
    }

    pub fn samples(&self) -> u64 {
        self.parts.iter().map(SamplePart::samples).sum()
    }

    /// Samples at an event, or in a segment of one run alone that was not compared.
    pub fn samples_outside(&self) -> u64 {
        self.parts.iter().map(|part| part.outside).sum()
    }

    pub fn too_sparse(&self) -> u64 {
        self.parts.iter().map(|part| part.too_sparse).sum()
    }

    pub fn integrated(&self) -> bool {
        self.walks.iter().any(|walk| walk.integrated)
    }
}

impl Grid {
    /// Whether nearly all are such multiples.
    pub fn is_rounded(&self) -> bool {
        self.of >= 16 && self.on as f64 >= 0.999 * self.of as f64
    }

    /// A difference of two angles is a multiple of their last digit, but an integrated twist is not. `angle` is the
    /// rotor's, rad.
    fn look(&mut self, channels: &[Channel], block: &Block, rows: Range<usize>, angle: f64) {
        let column = channels.iter().position(|&c| c == Channel::ROTOR_TWIST);
        let Some(k) = column.filter(|_| self.of < MOST_PROBED && angle.abs() >= 1.0) else {
            return;
        };
        // The binade below, because the candidate's angle may be slightly smaller.
        let unit = 2f64.powi(angle.abs().log2().floor() as i32 - 53);
        for &twist in &block.columns[k][rows] {
            let multiple = twist / unit;
            self.of += 1;
            self.on += usize::from(multiple == multiple.round());
        }
    }
}

/// Part of a run, which determines how samples are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// Before the first event of the sequence: at the same time.
    Sliding,
    /// After a matched event: at the same time since that event, or at the same time if that is closer.
    StickSlip,
    /// After the last event, if it is matched: at the same time again.
    After,
    /// In a segment that only one of the runs has: at the same time.
    Apart,
}

impl Phase {
    /// Every phase.
    pub const ALL: [Phase; 4] = [Phase::Sliding, Phase::StickSlip, Phase::After, Phase::Apart];

    /// Name for reports.
    pub fn name(self) -> &'static str {
        match self {
            Phase::Sliding => "before the first event",
            Phase::StickSlip => "between events, timed from the last matched one",
            Phase::After => "after the last event",
            Phase::Apart => "in a segment of one run alone",
        }
    }
}

/// A compared stretch of the candidate, without its ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Part of the run.
    pub phase: Phase,
    /// Start in the candidate's time, s.
    pub from: f64,
    /// End in the candidate's time, s.
    pub to: f64,
    /// The candidate's time minus the reference's, s.
    pub shift: f64,
}

/// The compared stretches, in order of time: those in which both runs are in the same segment, and those with unmatched
/// events. `from_start`: both words begin with the first event of the run; `to_end`: the reference's word ends with its
/// last event.
pub fn windows(
    reference: &[SequenceEvent],
    candidate: &[SequenceEvent],
    alignment: &Alignment,
    from_start: bool,
    to_end: bool,
) -> Vec<Window> {
    let start = |word: &[SequenceEvent], k: usize| word.get(k).map_or(f64::INFINITY, |e| e.time);
    let matched: Vec<(usize, usize)> = alignment.matched().collect();
    let mut windows = Vec::with_capacity(reference.len() + 1);
    let mut add = |phase: Phase, from: f64, to: f64, shift: f64| windows.push(Window { phase, from, to, shift });
    // Stretch up to the next matched event, unless that is the next one of both words.
    let apart = |from: f64, (r, c): (usize, usize), next: Option<&(usize, usize)>| {
        let is_next = match next {
            Some(next) => *next == (r, c),
            None => r == reference.len() && c == candidate.len(),
        };
        let to = next.map_or(f64::INFINITY, |next| candidate[next.1].time);
        (!is_next && to > from).then_some((from, to))
    };
    if from_start {
        let to = start(reference, 0).min(start(candidate, 0));
        add(Phase::Sliding, f64::NEG_INFINITY, to, 0.0);
        if let Some((from, to)) = apart(to, (0, 0), matched.first()) {
            add(Phase::Apart, from, to, 0.0);
        }
    } else if matched.is_empty() {
        add(Phase::Apart, f64::NEG_INFINITY, f64::INFINITY, 0.0);
    }
    for (k, &(r, c)) in matched.iter().enumerate() {
        let (time, shift) = (candidate[c].time, candidate[c].time - reference[r].time);
        if to_end && r + 1 == reference.len() && c + 1 == candidate.len() {
            add(Phase::After, time.max(reference[r].time), f64::INFINITY, 0.0);
            break;
        }
        let to = start(candidate, c + 1).min(start(reference, r + 1) + shift);
        add(Phase::StickSlip, time, to, shift);
        if let Some((from, to)) = apart(to, (r + 1, c + 1), matched.get(k + 1)) {
            add(Phase::Apart, from, to, 0.0);
        }
    }
    windows
}

/// Drops shifts smaller than `resolution` (s), the accuracy of events found in samples. Otherwise a shift by their
/// error would count as an error of the states.
pub(crate) fn without_small_shifts(windows: &mut [Window], resolution: f64) {
    for w in windows.iter_mut().filter(|w| w.shift.abs() < resolution) {
        w.from = w.from.max(w.from - w.shift);
        w.to = w.to.min(w.to - w.shift);
        w.shift = 0.0;
    }
}
