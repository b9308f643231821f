//! Gauss-Newton fit of a motion to a candidate, first over the time in which the two are close, then over a growing
//! time.

use super::judge::Evidence;
use super::play::Played;
use crate::parameters::least_squares;

const STEP: f64 = 1e-6;
/// Gauss-Newton steps, and shortenings of a step.
const STEPS: usize = 12;
const SHORTER: usize = 5;
const LONGEST: f64 = 0.5;

pub(in super::super) struct Fit<'a> {
    pub evidence: &'a Evidence<'a>,
    pub play: &'a dyn Fn(&[f64]) -> Option<Played>,
    /// Unit of each value's changes.
    pub units: &'a [f64],
}

#[derive(Debug, Clone)]
pub(in super::super) struct FitPoint {
    pub values: Vec<f64>,
    pub played: Played,
    /// Number of samples, or events, that are compared.
    pub window: usize,
}

impl Fit<'_> {
    pub fn at(&self, values: Vec<f64>) -> Option<FitPoint> {
        let played = (self.play)(&values)?;
        let window = self.evidence.window(&played);
        Some(FitPoint { values, played, window })
    }

    /// d(residual)/d(value), in units of the value; `None` if it is not finite.
    pub fn slope(&self, at: &FitPoint, which: usize) -> Option<Vec<f64>> {
        let own = self.evidence.residual(&at.played, at.window);
        let side = |step: f64| {
            let mut values = at.values.clone();
            values[which] += step * self.units[which];
            let moved = self.evidence.residual(&(self.play)(&values)?, at.window);
            let slope: Vec<f64> = moved.iter().zip(&own).map(|(a, b)| (a - b) / step).collect();
            slope.iter().all(|x| x.is_finite()).then_some(slope)
        };
        side(STEP).or_else(|| side(-STEP))
    }

    pub fn refined(&self, values: Vec<f64>) -> Option<FitPoint> {
        let mut at = self.at(values)?;
        for _ in 0..STEPS {
            let slopes: Option<Vec<Vec<f64>>> = (0..self.units.len()).map(|which| self.slope(&at, which)).collect();
            let Some(slopes) = slopes else { break };
            let now = self.evidence.residual(&at.played, at.window);
            let Some((step, _)) = least_squares(&slopes, &now) else {
                break;
            };
            let left = square(&now);
            let better = (0..SHORTER).find_map(|times| {
                let shrink = 0.25f64.powi(times as i32);
                let each = at.values.iter().zip(&step).zip(self.units);
                let values = each.map(|((value, step), unit)| value + (shrink * step).clamp(-LONGEST, LONGEST) * unit);
                let next = self.at(values.collect())?;
                let same = square(&self.evidence.residual(&next.played, at.window));
                (same < left).then_some((next, same))
            });
            let Some((next, same)) = better else { break };
            let settled = next.window == at.window && same > 0.999 * left;
            at = next;
            if settled {
                break;
            }
        }
        Some(at)
    }
}

fn square(values: &[f64]) -> f64 {
    values.iter().map(|x| x * x).sum()
}

pub(super) fn left(slopes: &[&[f64]], now: &[f64]) -> f64 {
    let Some((step, _)) = least_squares(slopes, now) else {
        return f64::INFINITY;
    };
    let each = now.iter().enumerate().map(|(k, x)| {
        let moved: f64 = slopes.iter().zip(&step).map(|(slope, step)| slope[k] * step).sum();
        (x + moved) * (x + moved)
    });
    each.sum()
}
