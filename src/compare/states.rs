//! Errors of the channels, sample by sample, in one pass over both runs.

use super::Channel;
use super::candidate::Block;
use super::reference::{Curve, Physics, Walk};
use super::windows::{Phase, Window};
use crate::results::ResultError;

/// The errors of one channel in one phase. Candidate minus reference, in the channel's SI unit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Tally {
    /// Samples compared.
    pub samples: u64,
    /// Largest absolute error.
    pub max: f64,
    /// The candidate's time of the largest error, s.
    pub max_at: f64,
    /// Of the errors.
    pub squares: Squares,
    /// Largest |reference|.
    pub largest: f64,
    /// Largest |error| / (scale + |reference|).
    pub max_mixed: f64,
    /// Sums of candidate times reference, reference squared and candidate squared: a common factor shows in them.
    pub products: [f64; 3],
}

impl Tally {
    #[inline]
    fn add(&mut self, time: f64, candidate: f64, reference: f64, scale: f64) {
        let error = (candidate - reference).abs();
        let size = reference.abs();
        self.samples += 1;
        if error > self.max {
            self.max = error;
            self.max_at = time;
        }
        self.squares.add(error);
        // In a product, as a division takes longer than the rest.
        if error > self.max_mixed * (scale + size) {
            self.max_mixed = (error / (scale + size)).min(f64::MAX);
        }
        self.largest = self.largest.max(size);
        self.products[0] += candidate * reference;
        self.products[1] += reference * reference;
        self.products[2] += candidate * candidate;
    }

    /// Significant correct digits, -log10 of the largest error in parts of the largest |reference|: most channels pass
    /// through zero, where an error relative to the value itself says nothing. 17 if there is no error, `None` if the
    /// reference is zero throughout.
    pub fn scd(&self) -> Option<f64> {
        (self.largest > 0.0)
            .then(|| digits(self.samples, (self.max / self.largest).min(f64::MAX)))
            .flatten()
    }

    /// The mixed digits, -log10 of the largest |error|/(scale + |reference|); 17 if there is no error.
    pub fn mescd(&self) -> Option<f64> {
        digits(self.samples, self.max_mixed)
    }

    /// Root mean square of the error.
    pub fn rms(&self) -> f64 {
        self.squares.rms(self.samples)
    }
}

/// A sum of squares, of which none overflows.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Squares {
    sum: f64,
    /// In units of [`LARGE`] squared.
    of_large: f64,
}

/// The square of the largest double in this unit is finite, and so is the sum of any number of them.
const LARGE: f64 = f64::from_bits((1023 + 600) << 52);

impl Squares {
    /// Adds the square of a number.
    #[inline]
    pub fn add(&mut self, x: f64) {
        let large = x * (1.0 / LARGE);
        self.sum += x * x;
        self.of_large += large * large;
    }

    /// Whether this sum is less than another one.
    pub fn is_less(&self, other: &Squares) -> bool {
        match self.sum.is_finite() && other.sum.is_finite() {
            true => self.sum < other.sum,
            false => self.of_large < other.of_large,
        }
    }

    /// The root mean square of so many numbers.
    pub fn rms(&self, count: u64) -> f64 {
        let count = count.max(1) as f64;
        match self.sum.is_finite() {
            true => (self.sum / count).sqrt(),
            false => (self.of_large / count).sqrt() * LARGE,
        }
    }
}

/// More digits than a double has are not claimed.
const MOST_DIGITS: f64 = 17.0;

fn digits(samples: u64, error: f64) -> Option<f64> {
    (samples > 0).then(|| (-error.log10()).min(MOST_DIGITS))
}

/// Samples that a probe keeps, and that are tested for the grid of rounded angles.
const MOST_PROBED: usize = 200_000;

/// A stretch of time in which omega_r of both runs is kept, to see what differs there.
#[derive(Debug, Clone, Default)]
pub(crate) struct Probe {
    /// s.
    pub from: f64,
    /// s.
    pub to: f64,
    /// Time (s), error (rad/s) and the reference's value (rad/s) of each sample.
    pub points: Vec<(f64, f64, f64)>,
}

/// How many values of the rotor twist are multiples of the rounding of the rotor's angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Grid {
    /// Multiples.
    pub on: usize,
    /// All that were looked at.
    pub of: usize,
}

/// The pass: fed with blocks of the candidate, it walks through the reference beside them.
#[derive(Debug)]
pub(crate) struct StatePass<'a> {
    pub walk: Walk<'a>,
    /// Those of the blocks, in their order.
    pub channels: Vec<Channel>,
    windows: Vec<Window>,
    window: usize,
    curves: Vec<Curve>,
    /// By phase, then by channel.
    pub tallies: [Vec<Tally>; 3],
    scales: [Vec<f64>; 3],
    /// Samples beside which the reference has none close enough.
    pub too_sparse: u64,
    /// Stretches looked at closely.
    pub probes: Vec<Probe>,
    /// What the rotor twist is a multiple of.
    pub grid: Grid,
    /// Samples at or across an event, or in a segment that only one of the runs has.
    pub outside: u64,
}

impl<'a> StatePass<'a> {
    /// Before the first sample. `channels` are those of the blocks to come.
    pub fn new(
        walk: Walk<'a>,
        physics: &Physics,
        channels: &[Channel],
        windows: Vec<Window>,
        probes: Vec<Probe>,
    ) -> Self {
        let scales = Phase::ALL.map(|phase| {
            // Until the stick-slip, speeds are of the size of the initial one.
            let scale = |&channel: &Channel| physics.size(channel, phase == Phase::Sliding);
            channels.iter().map(scale).collect()
        });
        StatePass {
            walk,
            channels: channels.to_vec(),
            windows,
            window: 0,
            curves: Vec::new(),
            tallies: Phase::ALL.map(|_| vec![Tally::default(); channels.len()]),
            scales,
            too_sparse: 0,
            outside: 0,
            probes,
            grid: Grid::default(),
        }
    }

    /// Compares a block, whose columns are the channels in their order.
    ///
    /// # Errors
    /// Of the reference's file.
    pub fn add(&mut self, block: &Block) -> Result<(), ResultError> {
        let time = &block.time;
        let mut i = 0;
        while i < time.len() {
            while self.windows.get(self.window).is_some_and(|w| time[i] >= w.to) {
                self.window += 1;
            }
            let Some(&window) = self.windows.get(self.window) else {
                self.outside += (time.len() - i) as u64;
                break;
            };
            if time[i] <= window.from {
                let skipped = time[i..].partition_point(|&t| t <= window.from);
                self.outside += skipped as u64;
                i += skipped;
                continue;
            }
            let Some((left, right, closes)) = self.walk.at(time[i] - window.shift)? else {
                self.outside += 1;
                i += 1;
                continue;
            };
            let mut count = time[i..].partition_point(|&t| t < window.to && t - window.shift <= right);
            // At a kick or a corner it is open which side of it a sample shows.
            if closes && time[i + count - 1] - window.shift == right {
                count -= 1;
                self.outside += 1;
                if count == 0 {
                    i += 1;
                    continue;
                }
            }
            let sound = self.walk.curves(&self.channels, &mut self.curves).unwrap_or(false);
            self.run(block, i..i + count, &window, (left, right), sound);
            i += count;
        }
        Ok(())
    }

    /// Compares samples that lie in one gap of the reference.
    fn run(
        &mut self,
        block: &Block,
        rows: std::ops::Range<usize>,
        window: &Window,
        (left, right): (f64, f64),
        sound: bool,
    ) {
        let width = right - left;
        let phase = window.phase as usize;
        // Where the reference is too sparse for its inside, its own samples still stand.
        let usable = |s: f64| sound || s == 0.0 || s == 1.0;
        let part = |t: f64| (t - left - window.shift) / width;
        if !sound {
            self.too_sparse += rows.clone().filter(|&i| !usable(part(block.time[i]))).count() as u64;
        }
        let times = &block.time[rows.clone()];
        for (k, curve) in self.curves.iter().enumerate() {
            let (tally, scale) = (&mut self.tallies[phase][k], self.scales[phase][k]);
            let samples = times.iter().zip(&block.columns[k][rows.clone()]);
            // Added up in a copy, which the processor keeps in registers.
            let mut sum = *tally;
            if sound {
                // In a product, as a division takes longer than the rest.
                let (from, per_width) = (left + window.shift, 1.0 / width);
                let part = |t: f64| (t - from) * per_width;
                samples.for_each(|(&t, &v)| sum.add(t, v, curve.at(part(t)), scale));
            } else {
                for (&t, &value) in samples.filter(|&(&t, _)| usable(part(t))) {
                    sum.add(t, value, curve.at(part(t)), scale);
                }
            }
            *tally = sum;
        }
        if window.phase == Phase::Sliding && sound {
            self.probe(block, rows.clone(), &part);
        }
        self.look_for_grid(block, rows);
    }

    fn probe(&mut self, block: &Block, rows: std::ops::Range<usize>, part: &dyn Fn(f64) -> f64) {
        let Some(k) = self.channels.iter().position(|&c| c == Channel::RelativeVelocity) else {
            return;
        };
        let (first, last) = (block.time[rows.start], block.time[rows.end - 1]);
        for probe in self.probes.iter_mut().filter(|p| p.from <= last && first < p.to) {
            for i in rows.clone() {
                let t = block.time[i];
                if (probe.from..probe.to).contains(&t) && probe.points.len() < MOST_PROBED {
                    let reference = self.curves[k].at(part(t));
                    probe.points.push((t, block.columns[k][i] - reference, reference));
                }
            }
        }
    }

    /// Samples compared: all channels have the same.
    pub fn samples(&self) -> u64 {
        let firsts = self.tallies.iter().filter_map(|phase| phase.first());
        firsts.map(|tally| tally.samples).sum()
    }

    /// A difference of two angles is a multiple of their last digit; a twist that was integrated is none.
    fn look_for_grid(&mut self, block: &Block, rows: std::ops::Range<usize>) {
        if self.grid.of >= MOST_PROBED {
            return;
        }
        let Some(k) = self.channels.iter().position(|&c| c == Channel::RotorTwist) else {
            return;
        };
        let angle = self.walk.rotor_angle().abs();
        if angle < 1.0 {
            return;
        }
        // Of the binade below, as the candidate's angle may be a little smaller.
        let unit = 2f64.powi(angle.log2().floor() as i32 - 53);
        for &twist in &block.columns[k][rows] {
            let multiple = twist / unit;
            self.grid.of += 1;
            self.grid.on += usize::from(multiple == multiple.round());
        }
    }
}
