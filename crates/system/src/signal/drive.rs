//! The signals of a train: a constant, a profile, a harmonic, or a sum.
//!
//! Between its corners ([`Timeline::corners`]) a drive is linear plus harmonics and sweeps of a frequency, so that its
//! Taylor series and antiderivative have closed forms.

use std::convert::Infallible;
use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use super::pieces::sum_without_rounding;
use super::{Piece, Pieces, Signal};
use crate::numerics::Number;

/// A signal of a train. `T` is the number type: doubles or exact numbers.
#[derive(Debug, Clone, PartialEq)]
pub enum Drive<T = f64> {
    /// Constant.
    Value(T),
    /// A ramp or a table.
    Linear(Signal<T>),
    /// A harmonic.
    Wave(Wave<T>),
    /// A sum.
    Sum(Vec<Drive<T>>),
}

/// The signal mean + amplitude sin(omega t + phase), or the same with the cosine. With `from` (inclusive) or `to`,
/// the harmonic part acts between these times only; outside, the signal is the mean. t is the time of the run, not
/// the time since `from`. For a [sweep](Frequency::Sweep), omega t is the integral of omega.
#[derive(Debug, Clone, PartialEq)]
pub struct Wave<T = f64> {
    /// Sine or cosine.
    pub shape: HarmonicShape,
    /// Mean, in the unit of the driven quantity.
    pub mean: T,
    /// Amplitude, in the unit of the driven quantity.
    pub amplitude: T,
    /// Frequency.
    pub frequency: Frequency<T>,
    /// Phase, rad.
    pub phase: T,
    /// Start of the harmonic part, s.
    pub from: Option<T>,
    /// End of the harmonic part, s.
    pub to: Option<T>,
}

/// Sine or cosine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HarmonicShape {
    /// sin.
    Sine,
    /// cos.
    Cosine,
}

/// Frequency of a harmonic.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Frequency<T = f64> {
    /// f, Hz: omega = 2 pi f.
    Cycles(T),
    /// omega, rad/s.
    Angular(T),
    /// Of a chirp: it runs linearly from `start` at t = 0 to `end` at t = `duration`, and then stays.
    Sweep {
        /// Frequency at t = 0, Hz.
        start: T,
        /// Frequency from `duration` on, Hz.
        end: T,
        /// Duration of the sweep, s.
        duration: T,
    },
}

impl<T> Drive<T> {
    /// Converts each number with `number`, which gets the number's path and value. The path is relative to the
    /// signal's key: empty for a value, or such as `amplitude`, `time.3`, `signals.0.value`.
    ///
    /// # Errors
    /// The first error of `number`.
    pub fn try_map<U, E>(&self, mut number: impl FnMut(&str, &T) -> Result<U, E>) -> Result<Drive<U>, E> {
        self.mapped("", &mut number)
    }

    fn mapped<U, E>(&self, prefix: &str, number: &mut dyn FnMut(&str, &T) -> Result<U, E>) -> Result<Drive<U>, E> {
        Ok(match self {
            Drive::Value(value) => Drive::Value(number(prefix.strip_suffix('.').unwrap_or(prefix), value)?),
            Drive::Linear(signal) => Drive::Linear(signal.try_map(|field, index, value| {
                let element = index.map_or(String::new(), |index| format!(".{index}"));
                number(&format!("{prefix}{field}{element}"), value)
            })?),
            Drive::Wave(wave) => Drive::Wave(wave.mapped(prefix, number)?),
            Drive::Sum(signals) => {
                let terms = signals.iter().enumerate();
                let terms = terms.map(|(index, term)| term.mapped(&format!("{prefix}{SIGNALS}.{index}."), number));
                Drive::Sum(terms.collect::<Result<_, E>>()?)
            }
        })
    }

    /// Converts each number.
    pub fn map<U>(&self, number: impl Fn(&T) -> U) -> Drive<U> {
        match self.try_map(|_, value| Ok::<U, Infallible>(number(value))) {
            Ok(drive) => drive,
        }
    }
}

/// Key for the terms of a sum.
pub const SIGNALS: &str = "signals";

impl<T> Wave<T> {
    fn mapped<U, E>(&self, prefix: &str, number: &mut dyn FnMut(&str, &T) -> Result<U, E>) -> Result<Wave<U>, E> {
        let mut at = |key: &str, value: &T| number(&format!("{prefix}{key}"), value);
        Ok(Wave {
            shape: self.shape,
            mean: at("mean", &self.mean)?,
            amplitude: at("amplitude", &self.amplitude)?,
            frequency: match &self.frequency {
                Frequency::Cycles(frequency) => Frequency::Cycles(at("frequency", frequency)?),
                Frequency::Angular(frequency) => Frequency::Angular(at("angular_frequency", frequency)?),
                Frequency::Sweep { start, end, duration } => Frequency::Sweep {
                    start: at("start_frequency", start)?,
                    end: at("end_frequency", end)?,
                    duration: at("duration", duration)?,
                },
            },
            phase: at("phase", &self.phase)?,
            from: self.from.as_ref().map(|time| at("from", time)).transpose()?,
            to: self.to.as_ref().map(|time| at("to", time)).transpose()?,
        })
    }
}

impl<T> Drive<T> {
    /// The harmonics of the drive.
    pub fn waves(&self) -> Vec<&Wave<T>> {
        match self {
            Drive::Wave(wave) => vec![wave],
            Drive::Sum(terms) => terms.iter().flat_map(Drive::waves).collect(),
            Drive::Value(_) | Drive::Linear(_) => Vec::new(),
        }
    }
}

impl Drive {
    /// Bound of the signal's magnitude at all times t >= 0.
    pub fn largest(&self) -> f64 {
        match self {
            Drive::Value(value) => value.abs(),
            Drive::Linear(signal) => signal.pieces().largest(),
            Drive::Wave(wave) => wave.mean.abs() + wave.amplitude.abs(),
            Drive::Sum(signals) => signals.iter().map(Drive::largest).sum(),
        }
    }

    /// Value at t = 0.
    pub fn at_start(&self) -> f64 {
        Timeline::new(&[self]).value(0, 0, 0.0)
    }
}

/// The fractional part of `frequency` times `t`, and the rounding of the product.
fn turns(frequency: f64, t: f64) -> [f64; 2] {
    let turns = frequency * t;
    [turns - turns.round(), frequency.mul_add(t, -turns)]
}

/// a + b and its rounding.
fn exact_sum(a: f64, b: f64) -> [f64; 2] {
    let sum = a + b;
    let added = sum - a;
    [sum, (a - (sum - added)) + (b - added)]
}

/// Turns from t = 0 to `t` (s) in a sweep, up to whole ones. No product or sum of the large turns is rounded.
fn swept_turns<T: Number>(start: f64, end: f64, duration: f64, t: f64) -> T {
    let [change, of_change] = exact_sum(end, -start);
    let share = t / duration;
    let of_share = (-share).mul_add(duration, t);
    let half = change * (share / 2.0);
    let of_half = change.mul_add(share / 2.0, -half);
    let [mean, of_mean] = exact_sum(start, half);
    let [part, of_part] = turns(mean, t);
    let [change, of_change, of_share, of_half, of_mean, now] =
        [change, of_change, of_share, of_half, of_mean, t].map(T::of);
    let rest = of_mean + of_half + (change * of_share + of_change * now) / T::of(2.0 * duration);
    T::of(part) + T::of(of_part) + rest * now
}

impl Wave {
    /// omega, rad/s; of a sweep that after it.
    pub fn angular_frequency(&self) -> f64 {
        match self.frequency {
            Frequency::Sweep { end, .. } => TAU * end,
            _ => self.rate(0.0),
        }
    }

    /// Start and end of the harmonic part within t >= 0, s.
    pub fn acts(&self) -> (f64, f64) {
        (self.from.unwrap_or(0.0).max(0.0), self.to.unwrap_or(f64::INFINITY))
    }

    /// The parts of the wave that are smooth: one, or those during and after a sweep.
    fn smooth_parts(&self) -> Vec<Wave> {
        let Frequency::Sweep { duration, .. } = self.frequency else {
            return vec![self.clone()];
        };
        let (from, to) = self.acts();
        let mut parts = Vec::new();
        for (from, to) in [(from, to.min(duration)), (from.max(duration), to)] {
            if from < to {
                parts.push(Wave {
                    from: Some(from),
                    to: Some(to),
                    ..self.clone()
                });
            }
        }
        parts
    }

    /// Start, end (Hz) and duration (s) if this smooth part is a sweep.
    fn sweep(&self) -> Option<(f64, f64, f64)> {
        match self.frequency {
            Frequency::Sweep { start, end, duration } if self.acts().0 < duration => Some((start, end, duration)),
            _ => None,
        }
    }

    /// omega of a smooth part at `t` (s), rad/s.
    fn rate<T: Number>(&self, t: f64) -> T {
        let cycles = match (self.frequency, self.sweep()) {
            (Frequency::Angular(frequency), _) => return T::of(frequency),
            (_, Some((start, end, duration))) => {
                let share = T::of(t) / T::of(duration);
                T::of(start) * (T::of(1.0) - share) + T::of(end) * share
            }
            (Frequency::Cycles(frequency) | Frequency::Sweep { end: frequency, .. }, None) => T::of(frequency),
        };
        T::of(2.0) * T::pi() * cycles
    }

    /// Slope of omega of a smooth part, rad/s^2; `None` if omega is constant.
    fn acceleration<T: Number>(&self) -> Option<T> {
        let (start, end, duration) = self.sweep()?;
        Some(T::of(2.0) * T::pi() * (T::of(end) - T::of(start)) / T::of(duration))
    }

    /// Largest omega of a smooth part, rad/s.
    fn fastest(&self) -> f64 {
        let rate = |t: f64| self.rate::<f64>(t).abs();
        self.sweep()
            .map_or_else(|| rate(0.0), |(.., duration)| rate(0.0).max(rate(duration)))
    }

    /// Bound of the derivative of an order of a smooth part.
    fn bound(&self, order: i32) -> f64 {
        // The derivative is one of the argument times the harmonic; y' = omega z gives
        // |y^(n+1)| <= omega |z^(n)| + n omega' |z^(n-1)|.
        let (omega, acceleration) = (self.fastest(), self.acceleration().map_or(0.0, f64::abs));
        let (mut before, mut bound) = (0.0, 1.0);
        for n in 0..order {
            (before, bound) = (bound, omega * bound + f64::from(n) * acceleration * before);
        }
        (self.amplitude * bound).abs()
    }

    /// Sine or cosine at `t` (s), and its derivative with respect to the argument. The product of frequency and time
    /// is not rounded.
    fn shape_and_slope<T: Number>(&self, t: f64) -> (T, T) {
        let of_turns = |turns: T| (T::of(2.0) * T::pi() * turns + T::of(self.phase)).sin_cos();
        let (sine, cosine) = match self.frequency {
            Frequency::Cycles(frequency) => {
                let [turns, rest] = turns(frequency, t).map(T::of);
                of_turns(turns + rest)
            }
            Frequency::Angular(frequency) => {
                let angle = frequency * t;
                let rest = frequency.mul_add(t, -angle);
                let (sine, cosine) = T::of(angle).sin_cos();
                let (phase_sine, phase_cosine) = (T::of(self.phase) + T::of(rest)).sin_cos();
                (
                    sine * phase_cosine + cosine * phase_sine,
                    cosine * phase_cosine - sine * phase_sine,
                )
            }
            Frequency::Sweep { start, end, duration } if self.sweep().is_some() => {
                of_turns(swept_turns(start, end, duration, t))
            }
            Frequency::Sweep { start, end, duration } => {
                let [since, of_since] = exact_sum(t, -duration);
                let [turns, rest] = turns(end, since).map(T::of);
                let later = turns + rest + T::of(end) * T::of(of_since);
                of_turns(swept_turns::<T>(start, end, duration, duration) + later)
            }
        };
        match self.shape {
            HarmonicShape::Sine => (sine, cosine),
            HarmonicShape::Cosine => (cosine, -sine),
        }
    }

    /// Adds the Taylor coefficients of a smooth part about `t` (s), by powers of tau/`unit` (s).
    fn add_series<T: Number>(&self, t: f64, unit: T, out: &mut [T]) {
        let (shape, slope) = self.shape_and_slope::<T>(t);
        let rate = self.rate::<T>(t) * unit;
        let amplitude = T::of(self.amplitude);
        let Some(acceleration) = self.acceleration::<T>() else {
            // The derivatives with respect to the argument repeat with a period of four.
            let turning = [shape, slope, -shape, -slope];
            let mut size = amplitude;
            for (n, coefficient) in out.iter_mut().enumerate() {
                *coefficient = *coefficient + size * turning[n % 4];
                size = size * (rate / T::of((n + 1) as f64));
            }
            return;
        };
        // y' = (rate + bend tau) z, z' = -(rate + bend tau) y.
        let bend = acceleration * unit * unit;
        let (mut before, mut now) = ([T::of(0.0); 2], [amplitude * shape, amplitude * slope]);
        for (n, coefficient) in out.iter_mut().enumerate() {
            *coefficient = *coefficient + now[0];
            let next = |k: usize| (rate * now[k] + bend * before[k]) / T::of((n + 1) as f64);
            (before, now) = (now, [next(1), -next(0)]);
        }
    }

    fn value(&self, t: f64) -> f64 {
        self.amplitude * self.shape_and_slope::<f64>(t).0
    }

    /// Integral of the harmonic part from `from` (s) to `from` + `tau` (s), as if the wave acted at all times.
    fn integral(&self, from: f64, tau: f64) -> f64 {
        let (shape, slope) = self.shape_and_slope::<f64>(from);
        if self.sweep().is_some() && self.fastest() * tau.abs() < 1.0 {
            let mut series = [0.0; SHORT];
            self.add_series(from, tau, &mut series);
            let terms = series.iter().enumerate().rev();
            return tau * terms.map(|(n, c)| c / (n + 1) as f64).sum::<f64>();
        }
        let omega: f64 = self.rate(from);
        let half = omega * tau / 2.0;
        if self.sweep().is_none() && half.abs() < 1.0 {
            // Starts from the middle, because the antiderivatives at both ends hardly differ.
            let mean = if half == 0.0 { 1.0 } else { half.sin() / half };
            return self.amplitude * tau * mean * (shape * half.cos() + slope * half.sin());
        }
        let to = from + tau;
        let added = to - from;
        let rounded = (from - (to - added)) + (tau - added);
        let (end, end_slope) = self.shape_and_slope::<f64>(to);
        let exact = match self.acceleration() {
            None => (slope - end_slope) / omega,
            Some(acceleration) => {
                let tail = |t: f64, shape: f64, slope: f64| {
                    let [real, imaginary] = tail(self.rate(t), f64::abs(acceleration) / 2.0);
                    slope * imaginary + shape * real * f64::signum(acceleration)
                };
                tail(from, shape, slope) - tail(to, end, end_slope)
            }
        };
        self.amplitude * (exact + end * rounded)
    }
}

/// Terms of the integral over a radian of a sweep: 1/20! = 4e-19.
const SHORT: usize = 20;

/// The integral of exp(i (omega s + bend s^2)) over s from 0 to infinity, for omega > 0 and bend >= 0: Fresnel's
/// integrals without their oscillation. On the ray s = exp(i pi/4) u the integrand decays, and the trapezoidal rule
/// for u = exp(x - exp(-x)) converges exponentially.
fn tail(omega: f64, bend: f64) -> [f64; 2] {
    const STEP: f64 = 1.0 / 32.0;
    let decay = omega * FRAC_1_SQRT_2;
    let unit = 1.0 / decay.max(bend.sqrt());
    let [mut real, mut imaginary] = [0.0; 2];
    for k in -160..=160 {
        let x = f64::from(k) * STEP;
        let inner = (-x).exp();
        let u = unit * (x - inner).exp();
        let weight = STEP * u * (1.0 + inner) * (-(decay + bend * u) * u).exp();
        let (sine, cosine) = (decay * u).sin_cos();
        real += weight * (cosine - sine);
        imaginary += weight * (cosine + sine);
    }
    [real * FRAC_1_SQRT_2, imaginary * FRAC_1_SQRT_2]
}

/// Several drives as functions of the time t >= 0, over common stretches on which all of them are smooth. A drive is
/// identified by its index in the list.
///
/// Values continue smoothly beyond both ends of a stretch, because a solver may evaluate slightly outside.
#[derive(Debug, Clone, PartialEq)]
pub struct Timeline {
    corners: Vec<f64>,
    tracks: Vec<Track>,
}

#[derive(Debug, Clone, PartialEq)]
struct Track {
    lines: Vec<DriveLine>,
    waves: Vec<Wave>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct DriveLine {
    start: f64,
    value: f64,
    slope: f64,
    before: f64,
}

impl DriveLine {
    #[inline]
    fn at(&self, t: f64) -> f64 {
        self.value + self.slope * (t - self.start)
    }

    fn integral(&self, t: f64) -> f64 {
        self.before + self.integral_from(self.start, t - self.start)
    }

    fn integral_from(&self, from: f64, tau: f64) -> f64 {
        (self.at(from) + self.slope * tau / 2.0) * tau
    }
}

fn parts(drive: &Drive, linear: &mut Vec<Pieces>, waves: &mut Vec<Wave>) {
    let constant = |value: f64| Pieces(vec![Piece::constant(0.0, value)]);
    match drive {
        Drive::Value(value) => linear.push(constant(*value)),
        Drive::Linear(signal) => linear.push(signal.pieces()),
        Drive::Wave(wave) => {
            linear.push(constant(wave.mean));
            waves.extend(wave.smooth_parts());
        }
        Drive::Sum(signals) => {
            for signal in signals {
                parts(signal, linear, waves);
            }
        }
    }
}

impl Timeline {
    /// A timeline of valid drives. Their tables have increasing times and as many values.
    pub fn new(drives: &[&Drive]) -> Timeline {
        let mut split = Vec::with_capacity(drives.len());
        let mut corners = Vec::new();
        for drive in drives {
            let (mut linear, mut waves) = (Vec::new(), Vec::new());
            parts(drive, &mut linear, &mut waves);
            corners.extend(linear.iter().flat_map(Pieces::corners));
            corners.extend(waves.iter().flat_map(|wave| {
                let (from, to) = wave.acts();
                [from, to].into_iter().filter(|time| *time > 0.0 && time.is_finite())
            }));
            split.push((linear, waves));
        }
        corners.sort_by(f64::total_cmp);
        corners.dedup();
        let tracks = split.into_iter().map(|(linear, waves)| Track {
            lines: lines(&linear, &corners),
            waves,
        });
        Timeline {
            tracks: tracks.collect(),
            corners,
        }
    }

    /// Times t > 0 (s, increasing) at which any drive has a corner or a jump: end of a ramp, points of a table, start
    /// and end of a harmonic, end of a chirp's sweep.
    pub fn corners(&self) -> &[f64] {
        &self.corners
    }

    /// The stretch that contains `t` (s): the number of corners up to and including `t`.
    #[inline]
    pub fn stretch(&self, t: f64) -> usize {
        self.corners.partition_point(|&corner| corner <= t)
    }

    /// Start of a stretch, s.
    pub fn start(&self, stretch: usize) -> f64 {
        stretch.checked_sub(1).map_or(0.0, |before| self.corners[before])
    }

    /// End of a stretch, s; infinite for the last.
    pub fn end(&self, stretch: usize) -> f64 {
        self.corners.get(stretch).copied().unwrap_or(f64::INFINITY)
    }

    fn waves(&self, drive: usize, stretch: usize) -> impl Iterator<Item = &Wave> {
        let start = self.start(stretch);
        self.tracks[drive].waves.iter().filter(move |wave| {
            let (from, to) = wave.acts();
            from <= start && start < to
        })
    }

    fn harmonics(&self, drive: usize, stretch: usize, of: impl Fn(&Wave) -> f64) -> f64 {
        self.waves(drive, stretch).map(of).sum()
    }

    /// The value of a drive at `t` (s).
    pub fn value(&self, drive: usize, stretch: usize, t: f64) -> f64 {
        self.tracks[drive].lines[stretch].at(t) + self.harmonics(drive, stretch, |wave| wave.value(t))
    }

    /// The slope of a drive at `t` (s), per second.
    pub fn slope(&self, drive: usize, stretch: usize, t: f64) -> f64 {
        let harmonics = self.harmonics(drive, stretch, |wave| {
            wave.amplitude * wave.rate::<f64>(t) * wave.shape_and_slope::<f64>(t).1
        });
        self.tracks[drive].lines[stretch].slope + harmonics
    }

    /// Whether a drive is constant over a stretch.
    pub fn is_constant(&self, drive: usize, stretch: usize) -> bool {
        self.tracks[drive].lines[stretch].slope == 0.0 && self.waves(drive, stretch).all(|wave| wave.amplitude == 0.0)
    }

    /// The integral of a drive from 0 to `t` (s), from antiderivatives.
    pub fn integral(&self, drive: usize, t: f64) -> f64 {
        let track = &self.tracks[drive];
        let harmonics = track.waves.iter().map(|wave| {
            let (from, to) = wave.acts();
            if to.min(t) > from {
                wave.integral(from, to.min(t) - from)
            } else {
                0.0
            }
        });
        track.lines[self.stretch(t)].integral(t) + harmonics.sum::<f64>()
    }

    /// The integral of a drive from `from` (s) to `from` + `tau` (s), with its stretch continued.
    pub fn integral_from(&self, drive: usize, stretch: usize, from: f64, tau: f64) -> f64 {
        let harmonics = self.harmonics(drive, stretch, |wave| wave.integral(from, tau));
        self.tracks[drive].lines[stretch].integral_from(from, tau) + harmonics
    }

    /// Fills `out` with the Taylor coefficients of a drive about `t` (s), by powers of tau/`unit` (s). For
    /// enclosures, the parameters of lines and harmonics are the doubles stored here.
    pub fn series<T: Number>(&self, drive: usize, stretch: usize, t: f64, unit: f64, out: &mut [T]) {
        let line = &self.tracks[drive].lines[stretch];
        let [now, start, value, slope, unit] = [t, line.start, line.value, line.slope, unit].map(T::of);
        for (n, coefficient) in out.iter_mut().enumerate() {
            *coefficient = match n {
                0 => value + slope * (now - start),
                1 => slope * unit,
                _ => T::of(0.0),
            };
        }
        for wave in self.waves(drive, stretch) {
            wave.add_series(t, unit, out);
        }
    }

    /// The value of a drive at `t` (s) without its harmonics.
    pub fn mean(&self, drive: usize, stretch: usize, t: f64) -> f64 {
        self.tracks[drive].lines[stretch].at(t)
    }

    /// Sum over a drive's harmonics in a stretch of a bound of the derivative of an order: the amplitude times the
    /// angular frequency to the power `order`, and more for a sweep.
    pub fn amplitude(&self, drive: usize, stretch: usize, order: i32) -> f64 {
        self.harmonics(drive, stretch, |wave| wave.bound(order))
    }

    /// Lower and upper bound of a drive from `t` (s) to the end of a stretch.
    pub fn bounds(&self, drive: usize, stretch: usize, t: f64) -> (f64, f64) {
        let line = &self.tracks[drive].lines[stretch];
        let swing = self.amplitude(drive, stretch, 0);
        let from = line.at(t);
        let to = if line.slope == 0.0 {
            from
        } else {
            line.at(self.end(stretch))
        };
        (from.min(to) - swing, from.max(to) + swing)
    }

    /// Largest angular frequency (rad/s) of any drive's harmonics in a stretch; 0 if there are none.
    pub fn fastest(&self, stretch: usize) -> f64 {
        let acting = (0..self.tracks.len()).flat_map(|drive| self.waves(drive, stretch));
        let frequencies = acting.filter(|wave| wave.amplitude != 0.0);
        frequencies.map(Wave::fastest).fold(0.0, f64::max)
    }
}

/// Sums linear signals over the stretches between `corners`, which include all corners of the signals.
fn lines(linear: &[Pieces], corners: &[f64]) -> Vec<DriveLine> {
    let mut found: Vec<DriveLine> = Vec::with_capacity(corners.len() + 1);
    for start in std::iter::once(0.0).chain(corners.iter().copied()) {
        let value = sum_without_rounding(linear.iter().map(|pieces| pieces.value(start)));
        let slope = sum_without_rounding(linear.iter().map(|pieces| pieces.slope(start)));
        let before = found.last().map_or(0.0, |line| line.integral(start));
        found.push(DriveLine {
            start,
            value,
            slope,
            before,
        });
    }
    found
}
