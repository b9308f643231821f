//! Numbers of a case by Gauss and Newton on a candidate's samples: first over the time in which the two motions are close, then over
//! more and more of it.

use super::Bench;
use super::observation::Values;
use super::play::Played;
use crate::compare::parameters::least_squares;
use crate::workers::over_processors;

/// Relative step of differences by a number.
const STEP: f64 = 1e-6;
/// Motions are close while no channel differs by more than this part of its size; a window has so many samples more.
const CLOSE: f64 = 0.05;
const FEWEST: usize = 8;
/// Steps of Gauss and Newton, and how often one is made shorter.
const STEPS: usize = 10;
const SHORTER: usize = 5;
/// How many of the numbers, and of the pairs, that explain most of the first window are fitted to the end.
const CLOSEST: usize = 6;
/// A step of a number in parts of its unit at most.
const LONGEST: f64 = 0.5;

/// Numbers of a case, each with what it is changed in parts of.
pub(super) struct Unknown {
    pub path: String,
    pub value: f64,
    pub unit: f64,
    /// Others that have the same value.
    pub with: Vec<String>,
}

impl Unknown {
    /// What changes with another value.
    pub fn changes(&self, value: f64) -> Proposal {
        let paths = [&self.path].into_iter().chain(&self.with);
        paths.map(|path| (path.clone(), value)).collect()
    }
}

/// Numbers with values that bring the motion close to the candidate.
pub(super) type Proposal = Vec<(String, f64)>;

struct Fit<'a> {
    bench: &'a Bench<'a>,
    start: usize,
    unknown: &'a [Unknown],
}

/// A motion with some numbers at some values.
struct Point {
    values: Vec<f64>,
    played: Played,
    /// Samples in its window.
    rows: usize,
}

impl Fit<'_> {
    fn changes(&self, which: &[usize], values: &[f64]) -> Proposal {
        let each = which.iter().zip(values);
        each.flat_map(|(&k, value)| self.unknown[k].changes(*value)).collect()
    }

    fn play(&self, which: &[usize], values: &[f64]) -> Option<Played> {
        self.bench.with_numbers(self.start, &self.changes(which, values))
    }

    fn at(&self, which: &[usize], values: Vec<f64>) -> Option<Point> {
        let played = self.play(which, &values)?;
        let rows = self.rows(&played.values);
        Some(Point { values, played, rows })
    }

    fn rows(&self, values: &Values) -> usize {
        let Some(observation) = self.bench.evidence.observation else {
            return 0;
        };
        // Some of what is behind an event that comes at another time show by how much.
        (observation.close(values, CLOSE) + FEWEST).min(observation.time.len())
    }

    fn residual(&self, values: &Values, rows: usize) -> Vec<f64> {
        let observation = self.bench.evidence.observation;
        observation.map_or_else(Vec::new, |observation| observation.residual(values, rows))
    }

    /// d(motion)/d(number), in parts of its unit.
    fn slope(&self, which: &[usize], at: &Point, number: usize) -> Option<Vec<f64>> {
        let unit = self.unknown[which[number]].unit;
        let side = |step: f64| {
            let mut values = at.values.clone();
            values[number] += step * unit;
            let moved = self.residual(&self.play(which, &values)?.values, at.rows);
            let own = self.residual(&at.played.values, at.rows);
            let slope: Vec<f64> = moved.iter().zip(&own).map(|(a, b)| (a - b) / step).collect();
            slope.iter().all(|x| x.is_finite()).then_some(slope)
        };
        side(STEP).or_else(|| side(-STEP))
    }

    /// The numbers fitted from a point on.
    fn refined(&self, which: &[usize], mut at: Point) -> Option<Point> {
        for _ in 0..STEPS {
            let slopes = (0..which.len()).map(|number| self.slope(which, &at, number));
            let slopes: Vec<Vec<f64>> = slopes.collect::<Option<_>>()?;
            let now = self.residual(&at.played.values, at.rows);
            let (step, _) = least_squares(&slopes, &now)?;
            let left = square(&now);
            let better = (0..SHORTER).find_map(|times| {
                let shrink = 0.25f64.powi(times as i32);
                let each = at.values.iter().zip(&step).zip(which);
                let values = each
                    .map(|((value, step), &k)| value + (shrink * step).clamp(-LONGEST, LONGEST) * self.unknown[k].unit);
                let next = self.at(which, values.collect())?;
                let same = square(&self.residual(&next.played.values, at.rows));
                (same < left).then_some((next, same))
            });
            let Some((next, same)) = better else { break };
            let settled = next.rows == at.rows && same > 0.999 * left;
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

/// What the best step along the slopes leaves of the square.
fn left(slopes: &[Vec<f64>], now: &[f64]) -> f64 {
    let Some((step, _)) = least_squares(slopes, now) else {
        return f64::INFINITY;
    };
    let each = now.iter().enumerate().map(|(k, x)| {
        let moved: f64 = slopes.iter().zip(&step).map(|(slope, step)| slope[k] * step).sum();
        (x + moved) * (x + moved)
    });
    each.sum()
}

/// Values of one number (or of two) with which a motion from a start comes closest to the candidate.
/// `guesses` are values of single numbers to begin with.
pub(super) fn propose(
    bench: &Bench<'_>,
    start: usize,
    unknown: &[Unknown],
    pairs: bool,
    guesses: &[(String, f64)],
) -> Vec<Proposal> {
    let fit = Fit { bench, start, unknown };
    let Some(base) = fit.at(&[], Vec::new()) else {
        return Vec::new();
    };
    let now = fit.residual(&base.played.values, base.rows);
    if now.iter().any(|x| !x.is_finite()) {
        return Vec::new();
    }
    let slopes = over_processors(unknown.len(), &|| false, |k| {
        let point = Point {
            values: vec![unknown[k].value],
            played: base.played.clone(),
            rows: base.rows,
        };
        fit.slope(&[k], &point, 0)
    });
    let known: Vec<usize> = (0..unknown.len()).filter(|&k| slopes[k].is_some()).collect();
    let groups: Vec<Vec<usize>> = match pairs {
        false => known.iter().map(|&k| vec![k]).collect(),
        true => {
            let each = known.iter().enumerate();
            each.flat_map(|(n, &a)| known[n + 1..].iter().map(move |&b| vec![a, b]))
                .collect()
        }
    };
    let ranked = groups.into_iter().map(|group| {
        let of_group: Vec<Vec<f64>> = group.iter().filter_map(|&k| slopes[k].clone()).collect();
        (left(&of_group, &now), group)
    });
    let mut ranked: Vec<(f64, Vec<usize>)> = ranked.filter(|(left, _)| left.is_finite()).collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    ranked.truncate(CLOSEST);
    let own = |group: Vec<usize>| {
        let values = group.iter().map(|&k| unknown[k].value).collect();
        (group, values)
    };
    let mut begin: Vec<(Vec<usize>, Vec<f64>)> = ranked.into_iter().map(|(_, group)| own(group)).collect();
    for (path, value) in guesses.iter().take(CLOSEST).filter(|_| !pairs) {
        let known = unknown
            .iter()
            .position(|unknown| unknown.path == *path && unknown.with.is_empty());
        begin.extend(known.map(|k| (vec![k], vec![*value])));
    }
    let found = over_processors(begin.len(), &|| false, |index| {
        let (group, values) = &begin[index];
        let point = fit.refined(group, fit.at(group, values.clone())?)?;
        Some(fit.changes(group, &point.values))
    });
    found.into_iter().flatten().collect()
}
