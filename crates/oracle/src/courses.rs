//! Signals: stretches between corners, in which a signal is linear plus harmonics and sweeps of a frequency.

use super::elementary::Elementary;
use super::float::Float;
use super::pieces::{ExactPiece, pieces};
use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{Signed, Zero};
use stickslip_system::model::nearest_double;
use stickslip_system::signal::{Drive, Frequency, HarmonicShape, Wave};

#[derive(Debug)]
pub(super) struct SignalCourse<const N: usize> {
    stretches: Vec<CourseStretch<N>>,
    waves: Vec<HarmonicCourse<N>>,
    current: usize,
}

#[derive(Debug)]
struct CourseStretch<const N: usize> {
    exact_start: BigRational,
    start: Float<N>,
    linear: [Float<N>; 2],
    /// Jump of the linear part at the start.
    step: Float<N>,
    waves: Vec<usize>,
}

#[derive(Debug)]
struct HarmonicCourse<const N: usize> {
    shape: HarmonicShape,
    amplitude: Float<N>,
    /// In a chirp's sweep, or always.
    angle: Angle<N>,
    /// End of the sweep, and the angle from then on.
    later: Option<(BigRational, Angle<N>)>,
}

/// phase + omega t + bend t^2.
#[derive(Debug, Clone)]
struct Angle<const N: usize> {
    phase: Float<N>,
    omega: Float<N>,
    bend: Option<Float<N>>,
}

#[derive(Default)]
struct Parts<'a> {
    linear: Vec<Vec<ExactPiece>>,
    waves: Vec<&'a Wave<BigRational>>,
}

impl<'a> Parts<'a> {
    fn gather(&mut self, drive: &'a Drive<BigRational>) {
        let constant = |value: &BigRational| vec![ExactPiece::constant(BigRational::zero(), value.clone())];
        match drive {
            Drive::Value(value) => self.linear.push(constant(value)),
            Drive::Linear(signal) => self.linear.push(pieces(signal)),
            Drive::Wave(wave) => {
                self.linear.push(constant(&wave.mean));
                self.waves.push(wave);
            }
            Drive::Sum(drives) => drives.iter().for_each(|drive| self.gather(drive)),
        }
    }
}

/// Whether a wave acts just after `time`.
fn acts(wave: &Wave<BigRational>, time: &BigRational) -> bool {
    wave.from.as_ref().is_none_or(|from| from <= time) && wave.to.as_ref().is_none_or(|to| time < to)
}

/// The shortest period of the waves, s; infinite without waves.
pub(super) fn shortest_period(drive: &Drive<BigRational>) -> f64 {
    let mut parts = Parts::default();
    parts.gather(drive);
    let period = |wave: &&Wave<BigRational>| match &wave.frequency {
        Frequency::Angular(omega) => std::f64::consts::TAU / nearest_double(omega).abs(),
        Frequency::Cycles(frequency) => 1.0 / nearest_double(frequency).abs(),
        Frequency::Sweep { start, end, .. } => 1.0 / nearest_double(start.max(end)),
    };
    parts.waves.iter().map(period).fold(f64::INFINITY, f64::min)
}

impl<const N: usize> SignalCourse<N> {
    pub fn new(drive: &Drive<BigRational>, table: &Elementary<N>) -> Self {
        let mut parts = Parts::default();
        parts.gather(drive);
        let ends = parts.waves.iter().flat_map(|wave| {
            let sweep = match &wave.frequency {
                Frequency::Sweep { duration, .. } => Some(duration),
                _ => None,
            };
            wave.from.iter().chain(&wave.to).chain(sweep)
        });
        let starts = parts.linear.iter().flatten().map(|piece| &piece.start);
        let mut corners: Vec<BigRational> = starts.chain(ends).filter(|t| t.is_positive()).cloned().collect();
        corners.push(BigRational::zero());
        corners.sort();
        corners.dedup();
        let stretch = |start: BigRational| {
            let [mut value, mut slope, mut step] = [(); 3].map(|()| BigRational::zero());
            for part in &parts.linear {
                let at = |piece: &ExactPiece| &piece.force + &piece.slope * (&start - &piece.start);
                if let Some(piece) = part.iter().rev().find(|piece| piece.start <= start) {
                    value += at(piece);
                    slope += &piece.slope;
                    let before = part.iter().rev().find(|piece| piece.start < start);
                    step += before.map_or_else(BigRational::zero, |before| at(piece) - at(before));
                }
            }
            let acting = |index: &usize| acts(parts.waves[*index], &start);
            CourseStretch {
                start: Float::from_rational(&start),
                linear: [Float::from_rational(&value), Float::from_rational(&slope)],
                step: Float::from_rational(&step),
                waves: (0..parts.waves.len()).filter(acting).collect(),
                exact_start: start,
            }
        };
        let harmonic = |wave: &&Wave<BigRational>| {
            let phase = Float::from_rational(&wave.phase);
            let pi_times = |number: &BigRational| &table.pi * &Float::from_rational(number);
            let of_cycles =
                |frequency: &BigRational| pi_times(&(frequency * BigRational::from_integer(BigInt::from(2))));
            let steady = |omega: Float<N>| Angle {
                phase,
                omega,
                bend: None,
            };
            let (angle, later) = match &wave.frequency {
                Frequency::Angular(omega) => (steady(Float::from_rational(omega)), None),
                Frequency::Cycles(frequency) => (steady(of_cycles(frequency)), None),
                // 2 pi (start t + (end - start) t^2/(2 duration)), then 2 pi (end t - (end - start) duration/2).
                Frequency::Sweep { start, end, duration } => {
                    let rise = end - start;
                    let bend = Some(pi_times(&(&rise / duration)));
                    let settled = Angle {
                        phase: &phase - &pi_times(&(rise * duration)),
                        ..steady(of_cycles(end))
                    };
                    let swept = Angle {
                        bend,
                        ..steady(of_cycles(start))
                    };
                    (swept, Some((duration.clone(), settled)))
                }
            };
            HarmonicCourse {
                shape: wave.shape,
                amplitude: Float::from_rational(&wave.amplitude),
                angle,
                later,
            }
        };
        SignalCourse {
            waves: parts.waves.iter().map(harmonic).collect(),
            stretches: corners.into_iter().map(stretch).collect(),
            current: 0,
        }
    }

    pub fn corners(&self) -> impl Iterator<Item = &BigRational> {
        self.stretches[1..].iter().map(|stretch| &stretch.exact_start)
    }

    pub fn size(&self) -> f64 {
        let linear = self.stretches.iter().flat_map(|stretch| {
            let value = &stretch.linear[0];
            [value.to_f64(), (value - &stretch.step).to_f64()]
        });
        let largest = linear.fold(0.0, |largest: f64, value| largest.max(value.abs()));
        let waves = self.waves.iter().map(|wave| wave.amplitude.to_f64().abs());
        largest + waves.sum::<f64>()
    }

    /// Enters the stretch that begins at `corner`, if there is one; returns the jump of the signal there.
    pub fn advance(&mut self, corner: &BigRational, table: &Elementary<N>) -> Float<N> {
        let next = self.current + 1;
        if self
            .stretches
            .get(next)
            .is_none_or(|stretch| stretch.exact_start != *corner)
        {
            return Float::zero();
        }
        let sum = |index: usize, others: usize| {
            let of = |stretch: usize| &self.stretches[stretch].waves;
            let changed = of(index).iter().filter(|wave| !of(others).contains(wave));
            changed.fold(Float::zero(), |sum, wave| {
                &sum + &self.waves[*wave].at_corner(&self.stretches[next], table)
            })
        };
        let jump = &sum(next, self.current) - &sum(self.current, next);
        self.current = next;
        &jump + &self.stretches[next].step
    }

    pub fn series(&self, time: &Float<N>, table: &Elementary<N>) -> CourseSeries<N> {
        let stretch = &self.stretches[self.current];
        let [value, slope] = &stretch.linear;
        let wave = |index: &usize| {
            let wave = &self.waves[*index];
            let angle = wave.angle_in(stretch);
            let bend = angle.bend.map(|bend| (&bend + &bend, [Float::zero(); 2]));
            WaveSeries {
                next: wave.derivatives(angle, time, table),
                omega: match &bend {
                    Some((twice, _)) => &angle.omega + &(twice * time),
                    None => angle.omega,
                },
                bend,
            }
        };
        CourseSeries {
            coefficients: Vec::new(),
            linear: [value + &(slope * &(time - &stretch.start)), *slope],
            waves: stretch.waves.iter().map(wave).collect(),
        }
    }
}

impl<const N: usize> HarmonicCourse<N> {
    fn angle_in(&self, stretch: &CourseStretch<N>) -> &Angle<N> {
        match &self.later {
            Some((end, settled)) if stretch.exact_start >= *end => settled,
            _ => &self.angle,
        }
    }

    fn derivatives(&self, angle: &Angle<N>, time: &Float<N>, table: &Elementary<N>) -> [Float<N>; 2] {
        let mut turned = &angle.omega * time;
        if let Some(bend) = &angle.bend {
            turned += &(&(bend * time) * time);
        }
        let [sine, cosine] = table.sine_and_cosine(&(&turned + &angle.phase));
        match self.shape {
            HarmonicShape::Sine => [&self.amplitude * &sine, &self.amplitude * &cosine],
            HarmonicShape::Cosine => [&self.amplitude * &cosine, -&(&self.amplitude * &sine)],
        }
    }

    /// Value where the wave begins or ends. A value that is zero up to rounding counts as zero.
    fn at_corner(&self, stretch: &CourseStretch<N>, table: &Elementary<N>) -> Float<N> {
        let (angle, time) = (self.angle_in(stretch), &stretch.start);
        let [value, _] = self.derivatives(angle, time, table);
        let angle = (&angle.omega * time).log2().max(angle.phase.log2()).max(0.0);
        let rounding = self.amplitude.log2() + angle - Float::<N>::BITS as f64 + 12.0;
        if value.log2() < rounding { Float::zero() } else { value }
    }
}

#[derive(Debug)]
pub(super) struct CourseSeries<const N: usize> {
    pub coefficients: Vec<Float<N>>,
    linear: [Float<N>; 2],
    waves: Vec<WaveSeries<N>>,
}

#[derive(Debug)]
struct WaveSeries<const N: usize> {
    /// The next coefficient, and the source of the following coefficient.
    next: [Float<N>; 2],
    /// omega at the time of the series.
    omega: Float<N>,
    /// The slope of omega, and the coefficients before `next`.
    bend: Option<(Float<N>, [Float<N>; 2])>,
}

impl<const N: usize> CourseSeries<N> {
    pub fn extend(&mut self, k: usize, reciprocals: &[Float<N>]) {
        for k in self.coefficients.len()..=k {
            let mut sum = self.linear.get(k).copied().unwrap_or_default();
            for wave in &mut self.waves {
                let [value, slope] = wave.next;
                sum += &value;
                // s' = omega c, c' = -omega s.
                let by = &wave.omega * &reciprocals[k + 1];
                wave.next = [&slope * &by, -&(&value * &by)];
                if let Some((bend, before)) = &mut wave.bend {
                    let by = &*bend * &reciprocals[k + 1];
                    wave.next[0] += &(&before[1] * &by);
                    wave.next[1] -= &(&before[0] * &by);
                    *before = [value, slope];
                }
            }
            self.coefficients.push(sum);
        }
    }

    pub fn is_linear(&self) -> bool {
        self.waves.is_empty()
    }
}
