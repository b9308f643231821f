//! Search for one parameter of a case by the events of its runs.
//!
//! The secant rule first brings a landmark (the last event, the first one, the duration of a cycle) to the candidate's.
//! If the events then have partners, Gauss-Newton fits all their times.

use super::mistake::{Agreement, of_normal_force};
use super::trials::{Trials, landmarks};
use stickslip_engine::workers::over_processors;
use stickslip_system::record::sequence::{Alignment, SequenceEvent};

const STEP: f64 = 1e-6;
/// Secants for each landmark, and Gauss-Newton steps.
const SECANTS: usize = 5;
const STEPS: usize = 5;
const FACTOR: f64 = 2.5;
/// Largest remaining part of the errors if all events had a partner; and of the natural period if they had not,
const LEFT: f64 = 0.05;
const CLOSE: f64 = 1e-3;
/// or if other evidence than events supports the parameter.
const CLOSE_ENOUGH: f64 = 0.02;
/// Two parameters explain equally if their errors differ by less than this factor, with a floor in s for the error of
/// runs.
const AS_MUCH: f64 = 1.5;
const FLOOR: f64 = 1e-10;

#[derive(Debug, Clone)]
pub(super) struct Hit {
    pub path: String,
    pub value: f64,
    /// Three standard deviations.
    pub error: f64,
    /// ln(value/reference).
    pub change: f64,
    pub after: Agreement,
}

/// Smallest relative change that events alone can show, because a method of low order moves them in the same way. With
/// 20 steps in a natural period, order 2 changes the frequency by some percent; with 100 by 5e-4.
const LEAST_BY_EVENTS: f64 = 5e-4;

struct SearchLine<'a> {
    trials: &'a Trials<'a>,
    path: &'a str,
    value: f64,
}

/// A point of a line: the logarithm of the factor, its events, and their agreement.
#[derive(Clone)]
struct SearchPoint {
    s: f64,
    word: Vec<SequenceEvent>,
    agreement: Agreement,
}

impl SearchLine<'_> {
    fn run(&self, s: f64) -> Option<Vec<SequenceEvent>> {
        self.trials.run(&[(self.path, self.value * s.exp())])
    }

    /// A run slightly above a point, and the step; below it if no value above is valid: mu_s is at most mu_0.
    fn beside(&self, s: f64) -> Option<(Vec<SequenceEvent>, f64)> {
        let at = |step: f64| Some((self.run(s + step)?, step));
        at(STEP).or_else(|| at(-STEP))
    }

    fn at(&self, s: f64) -> Option<SearchPoint> {
        let word = self.run(s)?;
        let agreement = self.trials.agreement(&word);
        Some(SearchPoint { s, word, agreement })
    }

    fn search(&self, base: &SearchPoint, guesses: &[f64]) -> Option<SearchPoint> {
        let target = landmarks(self.trials.word);
        let own = landmarks(&base.word);
        let (beside, step_beside) = self.beside(0.0)?;
        let moved = landmarks(&beside);
        let mut best = base.clone();
        let mut consider = |point: &SearchPoint| {
            if point.agreement.cost < best.agreement.cost {
                best = point.clone();
            }
        };
        for guess in guesses {
            if let Some(point) = self.at(*guess) {
                consider(&point);
            }
        }
        for (k, wanted) in target.into_iter().enumerate() {
            let (Some(wanted), Some(now), Some(then)) = (wanted, own[k], moved[k]) else {
                continue;
            };
            let slope = (then - now) / step_beside;
            let (mut s, mut miss) = (0.0, now - wanted);
            let mut step = -miss / slope;
            for _ in 0..SECANTS {
                if !step.is_finite() || step == 0.0 {
                    break;
                }
                let next = s + step.clamp(-FACTOR.ln(), FACTOR.ln());
                let Some(point) = self.at(next) else { break };
                consider(&point);
                let Some(there) = landmarks(&point.word)[k] else { break };
                let error = there - wanted;
                if error.abs() < 1e-12 || error == miss {
                    break;
                }
                step = -error * (next - s) / (error - miss);
                (s, miss) = (next, error);
            }
        }
        Some(best)
    }

    /// Fits the times of events with partners. Returns the point, and the deviation of the logarithm.
    fn refine(&self, from: SearchPoint) -> (SearchPoint, f64) {
        let (mut at, mut deviation) = (from, f64::INFINITY);
        for _ in 0..STEPS {
            let Some((beside, step_beside)) = self.beside(at.s) else {
                break;
            };
            let same = beside.len() == at.word.len() && beside.iter().zip(&at.word).all(|(a, b)| a.kind == b.kind);
            if !same || at.agreement.matched < 2 {
                break;
            }
            let related = 0.25 * self.trials.period;
            let alignment = Alignment::of(&at.word, self.trials.word, self.trials.period);
            let (mut product, mut square, mut errors, mut count) = (0.0, 0.0, 0.0, 0);
            for (r, c) in alignment.matched() {
                let error = self.trials.word[c].time - at.word[r].time;
                if error.abs() <= related {
                    let slope = (beside[r].time - at.word[r].time) / step_beside;
                    product += error * slope;
                    square += slope * slope;
                    errors += error * error;
                    count += 1;
                }
            }
            if square == 0.0 || count < 2 {
                break;
            }
            deviation = (errors / (count - 1) as f64 / square).sqrt();
            let step = product / square;
            let Some(next) = self.at(at.s + step.clamp(-0.3, 0.3)) else {
                break;
            };
            if next.agreement.cost >= at.agreement.cost {
                break;
            }
            let settled = step.abs() < 1e-13;
            at = next;
            if settled {
                break;
            }
        }
        (at, deviation)
    }
}

/// Parameters of `paths` that, each alone, reproduce the candidate's events, the best first, with the agreement of the
/// unchanged case. A path may have values to try; `supported` has other evidence than events. `None` if the case cannot
/// be run.
pub(super) fn search(
    trials: &Trials<'_>,
    paths: &[(String, Vec<f64>)],
    supported: Option<&str>,
) -> Option<(Agreement, Vec<Hit>)> {
    let word = trials.run(&[])?;
    let agreement = trials.agreement(&word);
    let base = SearchPoint {
        s: 0.0,
        word,
        agreement,
    };
    let found = over_processors(paths.len(), &|| false, |index| {
        let (path, guesses) = &paths[index];
        let value = trials.numbers.number(path)?.value;
        let line = SearchLine { trials, path, value };
        // Twice or half a value is the most common mistake.
        let factors = guesses.iter().map(|guess| guess / value).filter(|factor| *factor > 0.0);
        let logarithms: Vec<f64> = [2.0, 0.5].into_iter().chain(factors).map(f64::ln).collect();
        let coarse = line.search(&base, &logarithms)?;
        let (point, deviation) = line.refine(coarse);
        let supported = supported == Some(path.as_str());
        let explains = explains(&base.agreement, &point.agreement, trials.period, supported);
        (explains && deviation.is_finite()).then(|| Hit {
            path: path.clone(),
            value: value * point.s.exp(),
            change: point.s,
            error: 3.0 * deviation * (value * point.s.exp()).abs(),
            after: point.agreement,
        })
    });
    let mut hits: Vec<Hit> = found.into_iter().flatten().collect();
    hits.sort_by(|a, b| a.after.cost.total_cmp(&b.after.cost));
    if let Some(least) = hits.first().map(|hit| hit.after.rms) {
        hits.retain(|hit| hit.after.rms + FLOOR <= AS_MUCH * (least + FLOOR));
        // Of parameters that explain as much, the force and its times come last.
        hits.sort_by_key(|hit| of_normal_force(&hit.path));
        // If the best explanation may be the error of a method, the others may be, too.
        let is_small = |hit: &Hit| supported != Some(hit.path.as_str()) && hit.change.abs() < LEAST_BY_EVENTS;
        if hits.iter().any(is_small) {
            hits.clear();
        }
    }
    Some((base.agreement, hits))
}

/// Whether the events now agree; `supported` if other evidence supports the parameter.
fn explains(before: &Agreement, after: &Agreement, period: f64, supported: bool) -> bool {
    let close = if supported { CLOSE_ENOUGH } else { CLOSE };
    let missed = if before.unmatched > 0 {
        close * period
    } else {
        LEFT * before.rms
    };
    after.unmatched == 0 && after.matched > 0 && after.rms <= missed
}
