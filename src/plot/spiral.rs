//! Whether a motion spirals in or out: its amplitude turn by turn.

/// Amplitudes of the turns of an oscillation, from its samples in order. A turn goes from one largest value to the next;
/// its amplitude is half the way down to the least value between.
#[derive(Debug, Clone, Default)]
pub struct Turns {
    previous: Option<f64>,
    rising: bool,
    top: Option<f64>,
    bottom: f64,
    amplitudes: Vec<f64>,
}

/// Turns smaller than this share of the largest are rounding.
const NOISE: f64 = 1e-9;

impl Turns {
    /// The next sample.
    pub fn push(&mut self, value: f64) {
        let Some(previous) = self.previous.replace(value) else {
            self.bottom = value;
            return;
        };
        if self.rising && value < previous {
            // The sample before was the top of a turn.
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

    /// Amplitudes of the whole turns, in the unit of the samples.
    pub fn amplitudes(&self) -> Vec<f64> {
        let largest = self.amplitudes.iter().copied().fold(0.0, f64::max);
        let heard = |a: &f64| *a > NOISE * largest;
        self.amplitudes.iter().copied().filter(heard).collect()
    }
}

/// Geometric mean of the amplitude's factor from turn to turn: above 1 the spiral diverges, below it converges. `None`
/// for fewer than two turns.
pub fn factor_per_turn(amplitudes: &[f64]) -> Option<f64> {
    let (first, last) = (amplitudes.first()?, amplitudes.last()?);
    (amplitudes.len() > 1).then(|| (last / first).powf(1.0 / (amplitudes.len() - 1) as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// exp(-a t) cos t loses the factor exp(-2 pi a) with each turn; sampled 200 times in a turn, its extremes are met
    /// to (pi/200)^2/2 = 1e-4.
    #[test]
    fn analytic_decaying_cosine() {
        for rate in [-0.05, 0.02] {
            let mut turns = Turns::default();
            for k in 0..2000 {
                let t = k as f64 * std::f64::consts::TAU / 200.0;
                turns.push((rate * t).exp() * (t + 0.3).cos());
            }
            let amplitudes = turns.amplitudes();
            assert_eq!(amplitudes.len(), 9);
            let factor = factor_per_turn(&amplitudes).unwrap();
            let expected = (rate * std::f64::consts::TAU).exp();
            assert!((factor / expected - 1.0).abs() < 2e-4, "{factor} {expected}");
        }
    }

    #[test]
    fn analytic_a_monotone_motion_has_no_turn() {
        let mut turns = Turns::default();
        (0..100).for_each(|k| turns.push(f64::from(k)));
        assert_eq!((turns.amplitudes(), factor_per_turn(&[])), (vec![], None));
    }
}
