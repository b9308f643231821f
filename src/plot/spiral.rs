//! Amplitudes of a spiral, turn by turn.

/// Amplitudes of an oscillation, from its samples in order. A turn lasts from one maximum to the next. Its amplitude
/// is half of the distance between the mean of the maxima and the minimum between them.
#[derive(Debug, Clone, Default)]
pub struct Turns {
    previous: Option<f64>,
    rising: bool,
    top: Option<f64>,
    bottom: f64,
    amplitudes: Vec<f64>,
}

/// Turns smaller than this, relative to the largest, are rounding.
const NOISE: f64 = 1e-9;

impl Turns {
    /// Adds a sample.
    pub fn push(&mut self, value: f64) {
        let Some(previous) = self.previous.replace(value) else {
            self.bottom = value;
            return;
        };
        if self.rising && value < previous {
            // The previous sample was a maximum.
            if let Some(top) = self.top {
                self.amplitudes.push((0.5 * (top + previous) - self.bottom) / 2.0);
            }
            self.top = Some(previous);
            self.bottom = value;
        }
        if value != previous {
            self.rising = value > previous;
        }
        self.bottom = self.bottom.min(value);
    }

    /// Amplitudes of all complete turns, in the unit of the samples.
    pub fn amplitudes(&self) -> Vec<f64> {
        let largest = self.amplitudes.iter().copied().fold(0.0, f64::max);
        let heard = |a: &f64| *a > NOISE * largest;
        self.amplitudes.iter().copied().filter(heard).collect()
    }
}

/// Geometric mean of the ratios of successive amplitudes. The spiral diverges above 1. `None` below two turns.
pub fn factor_per_turn(amplitudes: &[f64]) -> Option<f64> {
    let (first, last) = (amplitudes.first()?, amplitudes.last()?);
    (amplitudes.len() > 1).then(|| (last / first).powf(1.0 / (amplitudes.len() - 1) as f64))
}
