//! Signals: stretches between corners, in which a signal is linear plus harmonics.

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
    omega: Float<N>,
    phase: Float<N>,
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
    };
    parts.waves.iter().map(period).fold(f64::INFINITY, f64::min)
}

impl<const N: usize> SignalCourse<N> {
    pub fn new(drive: &Drive<BigRational>, table: &Elementary<N>) -> Self {
        let mut parts = Parts::default();
        parts.gather(drive);
        let ends = parts.waves.iter().flat_map(|wave| wave.from.iter().chain(&wave.to));
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
        let harmonic = |wave: &&Wave<BigRational>| HarmonicCourse {
            shape: wave.shape,
            amplitude: Float::from_rational(&wave.amplitude),
            omega: match &wave.frequency {
                Frequency::Angular(omega) => Float::from_rational(omega),
                Frequency::Cycles(frequency) => {
                    let twice = frequency * BigRational::from_integer(BigInt::from(2));
                    &table.pi * &Float::from_rational(&twice)
                }
            },
            phase: Float::from_rational(&wave.phase),
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
        let time = self.stretches[next].start;
        let sum = |index: usize, others: usize| {
            let of = |stretch: usize| &self.stretches[stretch].waves;
            let changed = of(index).iter().filter(|wave| !of(others).contains(wave));
            changed.fold(Float::zero(), |sum, wave| {
                &sum + &self.waves[*wave].at_corner(&time, table)
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
            let derivatives = wave.derivatives(time, table);
            (derivatives, wave.omega)
        };
        CourseSeries {
            coefficients: Vec::new(),
            linear: [value + &(slope * &(time - &stretch.start)), *slope],
            waves: stretch.waves.iter().map(wave).collect(),
        }
    }
}

impl<const N: usize> HarmonicCourse<N> {
    fn derivatives(&self, time: &Float<N>, table: &Elementary<N>) -> [Float<N>; 2] {
        let [sine, cosine] = table.sine_and_cosine(&(&(&self.omega * time) + &self.phase));
        match self.shape {
            HarmonicShape::Sine => [&self.amplitude * &sine, &self.amplitude * &cosine],
            HarmonicShape::Cosine => [&self.amplitude * &cosine, -&(&self.amplitude * &sine)],
        }
    }

    /// Value where the wave begins or ends. A value that is zero up to rounding counts as zero.
    fn at_corner(&self, time: &Float<N>, table: &Elementary<N>) -> Float<N> {
        let [value, _] = self.derivatives(time, table);
        let angle = (&self.omega * time).log2().max(self.phase.log2()).max(0.0);
        let rounding = self.amplitude.log2() + angle - Float::<N>::BITS as f64 + 12.0;
        if value.log2() < rounding { Float::zero() } else { value }
    }
}

#[derive(Debug)]
pub(super) struct CourseSeries<const N: usize> {
    pub coefficients: Vec<Float<N>>,
    linear: [Float<N>; 2],
    /// For each wave: its next coefficient, the source of the following coefficient, and omega.
    waves: Vec<([Float<N>; 2], Float<N>)>,
}

impl<const N: usize> CourseSeries<N> {
    pub fn extend(&mut self, k: usize, reciprocals: &[Float<N>]) {
        for k in self.coefficients.len()..=k {
            let mut sum = self.linear.get(k).copied().unwrap_or_default();
            for ([value, slope], omega) in &mut self.waves {
                sum += value;
                // s' = omega c, c' = -omega s.
                let by = omega as &Float<N> * &reciprocals[k + 1];
                (*value, *slope) = (&*slope * &by, -&(&*value * &by));
            }
            self.coefficients.push(sum);
        }
    }

    pub fn is_linear(&self) -> bool {
        self.waves.is_empty()
    }
}
