//! Gauss-Newton fit of a motion to a candidate, first over the time in which the two are close, then over a growing
//! time.

use super::evidence::Evidence;
use super::motion::Played;

const STEP: f64 = 1e-6;
/// Gauss-Newton steps while the window grows, and in all: with all samples the fit goes on until it has converged.
const STEPS: usize = 12;
const MOST_STEPS: usize = 30;
/// Shortenings of a step.
const SHORTER: usize = 5;
const LONGEST: f64 = 0.5;

pub(crate) struct Fit<'a> {
    pub evidence: &'a Evidence<'a>,
    pub play: &'a dyn Fn(&[f64]) -> Option<Played>,
    /// Unit of each value's changes.
    pub units: &'a [f64],
}

/// The value, found from `begin`, with which a motion is closest to the candidate.
pub(super) fn fitted(
    evidence: &Evidence<'_>,
    begin: f64,
    unit: f64,
    play: &dyn Fn(f64) -> Option<Played>,
) -> Option<f64> {
    let fit = Fit {
        evidence,
        play: &|values: &[f64]| play(values[0]),
        units: &[unit],
    };
    Some(fit.refined(vec![begin])?.values[0])
}

#[derive(Debug, Clone)]
pub(crate) struct FitPoint {
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
        for number in 0..MOST_STEPS {
            if number >= STEPS && !self.evidence.is_whole(&at.played, at.window) {
                break;
            }
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

pub(crate) fn square(values: &[f64]) -> f64 {
    values.iter().map(|x| x * x).sum()
}

/// Sum of squares of `now` that remains after the best step along the slopes; infinite without one.
pub(crate) fn left<S: AsRef<[f64]>>(slopes: &[S], now: &[f64]) -> f64 {
    let Some((step, _)) = least_squares(slopes, now) else {
        return f64::INFINITY;
    };
    let each = now.iter().enumerate().map(|(k, x)| {
        let moved: f64 = slopes
            .iter()
            .zip(&step)
            .map(|(slope, step)| slope.as_ref()[k] * step)
            .sum();
        (x + moved) * (x + moved)
    });
    each.sum()
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The least-squares step for one or two slopes, and the diagonal of the inverse of the normal matrix.
pub(crate) fn least_squares<S: AsRef<[f64]>>(slopes: &[S], now: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
    match slopes {
        [a] => {
            let a = a.as_ref();
            let aa = square(a);
            (aa > 0.0).then(|| (vec![-product(a, now) / aa], vec![1.0 / aa]))
        }
        [a, b] => {
            let (a, b) = (a.as_ref(), b.as_ref());
            let (aa, bb, ab) = (square(a), square(b), product(a, b));
            let det = aa * bb - ab * ab;
            let (an, bn) = (product(a, now), product(b, now));
            (det > 1e-10 * aa * bb).then(|| {
                let step = vec![(ab * bn - bb * an) / det, (ab * an - aa * bn) / det];
                (step, vec![bb / det, aa / det])
            })
        }
        _ => None,
    }
}
