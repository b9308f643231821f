//! Gauss-Newton fit of a motion to a candidate, first over the time in which the two are close, then over a growing
//! time; and the parameters that are fitted: those of the case, and those that are zero or absent in it.

use super::evidence::Evidence;
use super::motion::Played;
use super::number::is_coefficient;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use stickslip_case::CaseNumber;
use stickslip_engine::workers::over_processors;
use stickslip_system::model::system::{End, Pressing, System, Train};
use stickslip_system::signal::Drive;

const STEP: f64 = 1e-6;
/// Gauss-Newton steps while the window grows, and in all: with all samples the fit goes on until it has converged.
const STEPS: usize = 12;
const MOST_STEPS: usize = 30;
/// Shortenings of a step.
const SHORTER: usize = 5;
const LONGEST: f64 = 0.5;
/// Part of the time that is computed first, the factor by which it grows, and that by which it is beyond the window.
const FIRST: f64 = 0.1;
const LONGER: f64 = 3.2;
const BEHIND: f64 = 1.1;

pub(crate) struct Fit<'a> {
    pub evidence: &'a Evidence<'a>,
    /// The motion with these values, at least up to a time, s.
    pub play: &'a dyn Fn(&[f64], f64) -> Option<Played>,
    /// Unit of each value's changes.
    pub units: &'a [f64],
}

/// The value, found from `begin`, with which a motion is closest to the candidate; `play` gives the motion at least up to
/// a time, s.
pub(super) fn fitted(
    evidence: &Evidence<'_>,
    begin: f64,
    unit: f64,
    play: &dyn Fn(f64, f64) -> Option<Played>,
) -> Option<f64> {
    let fit = Fit {
        evidence,
        play: &|values: &[f64], until| play(values[0], until),
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
    /// The motion is computed as far as it is close to the candidate, and at least up to a time, s.
    fn at(&self, values: Vec<f64>, at_least: f64) -> Option<FitPoint> {
        let (begins, end) = self.evidence.span();
        let mut part = match self.evidence.observation {
            Some(_) => FIRST.max(BEHIND * (at_least - begins) / (end - begins)),
            None => 1.0,
        };
        loop {
            let until = begins + part * (end - begins);
            let is_all = part >= 1.0;
            let played = (self.play)(&values, if is_all { f64::INFINITY } else { until });
            let point = played.map(|played| {
                let window = self.evidence.window(&played);
                let is_known = |column: &Vec<f64>| column.get(window).is_none_or(|value| value.is_finite());
                (played.values.iter().all(is_known), played, window)
            });
            match point {
                Some((is_enough, played, window)) if is_all || is_enough => {
                    return Some(FitPoint { values, played, window });
                }
                None if is_all => return None,
                // An event that is moved may lie behind the part, too.
                _ => {}
            }
            part *= LONGER;
        }
    }

    /// d(residual)/d(value), in units of the value; `None` if it is not finite.
    pub fn slope(&self, at: &FitPoint, which: usize) -> Option<Vec<f64>> {
        let own = self.evidence.residual(&at.played, at.window);
        let until = self.evidence.time_of(at.window);
        let side = |step: f64| {
            let mut values = at.values.clone();
            values[which] += step * self.units[which];
            let moved = self.evidence.residual(&(self.play)(&values, until)?, at.window);
            let slope: Vec<f64> = moved.iter().zip(&own).map(|(a, b)| (a - b) / step).collect();
            slope.iter().all(|x| x.is_finite()).then_some(slope)
        };
        side(STEP).or_else(|| side(-STEP))
    }

    fn slopes(&self, at: &FitPoint) -> Option<Vec<Vec<f64>>> {
        (0..self.units.len()).map(|which| self.slope(at, which)).collect()
    }

    /// Three standard deviations of each value, by the scatter of the residual.
    pub fn errors(&self, at: &FitPoint) -> Option<Vec<f64>> {
        let residual = self.evidence.residual(&at.played, at.window);
        let (_, inverse) = least_squares(&self.slopes(at)?, &residual)?;
        let variance = square(&residual) / residual.len().checked_sub(self.units.len()).filter(|n| *n > 0)? as f64;
        let each = self.units.iter().zip(inverse);
        Some(
            each.map(|(unit, inverse)| 3.0 * unit * (inverse * variance).sqrt())
                .collect(),
        )
    }

    pub fn refined(&self, values: Vec<f64>) -> Option<FitPoint> {
        let mut at = self.at(values, f64::NEG_INFINITY)?;
        for number in 0..MOST_STEPS {
            if number >= STEPS && !self.evidence.is_whole(&at.played, at.window) {
                break;
            }
            let Some(slopes) = self.slopes(&at) else { break };
            let now = self.evidence.residual(&at.played, at.window);
            let Some((step, _)) = least_squares(&slopes, &now) else {
                break;
            };
            let left = square(&now);
            let better = (0..SHORTER).find_map(|times| {
                let shrink = 0.25f64.powi(times as i32);
                let each = at.values.iter().zip(&step).zip(self.units);
                let values = each.map(|((value, step), unit)| value + (shrink * step).clamp(-LONGEST, LONGEST) * unit);
                let next = self.at(values.collect(), self.evidence.time_of(at.window))?;
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

/// The argument in an interval at which a function with one minimum there is least, by the golden section.
pub(super) fn golden(mut low: f64, mut high: f64, value: impl Fn(f64) -> f64) -> f64 {
    const GOLDEN: f64 = 0.618_034;
    const SECTIONS: usize = 40;
    let inside = |low: f64, high: f64| [high - GOLDEN * (high - low), low + GOLDEN * (high - low)];
    let [inner, outer] = inside(low, high);
    let (mut of_inner, mut of_outer) = (value(inner), value(outer));
    for _ in 0..SECTIONS {
        if of_inner < of_outer {
            (high, of_outer) = (inside(low, high)[1], of_inner);
            of_inner = value(inside(low, high)[0]);
        } else {
            (low, of_inner) = (inside(low, high)[0], of_outer);
            of_outer = value(inside(low, high)[1]);
        }
    }
    0.5 * (low + high)
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

/// The motion with changed parameters (keys and values in SI), up to a time (s).
type Replay<'a> = dyn Fn(&[(String, f64)], f64) -> Option<Played> + Sync + 'a;

/// Number of parameters, and of pairs, that are fitted completely after the first window.
const CLOSEST: usize = 12;
const CLOSEST_PAIRS: usize = 6;

/// Values of one parameter (or of two) with which a motion comes closest to the candidate, and their places in
/// `unknown`. `base` is the motion without changes; `guesses` are initial values of single parameters.
pub(super) fn closest(
    evidence: &Evidence<'_>,
    play: &Replay<'_>,
    base: &Played,
    unknown: &[Unknown],
    pairs: bool,
    guesses: &[(String, f64)],
) -> Vec<(Vec<usize>, FitPoint)> {
    let window = evidence.window(base);
    let now = evidence.residual(base, window);
    if now.is_empty() || now.iter().any(|x| !x.is_finite()) {
        return Vec::new();
    }
    let slopes = over_processors(unknown.len(), &|| false, |k| {
        let fit = Fit {
            evidence,
            play: &|values: &[f64], until| play(&unknown[k].changes(values[0]), until),
            units: &[unknown[k].unit],
        };
        let point = FitPoint {
            values: vec![unknown[k].value],
            played: base.clone(),
            window,
        };
        fit.slope(&point, 0)
    });
    let known: Vec<(usize, &[f64])> = slopes
        .iter()
        .enumerate()
        .filter_map(|(k, slope)| Some((k, slope.as_deref()?)))
        .collect();
    let groups: Vec<Vec<(usize, &[f64])>> = match pairs {
        false => known.iter().map(|&one| vec![one]).collect(),
        true => {
            let each = known.iter().enumerate();
            each.flat_map(|(n, &a)| known[n + 1..].iter().map(move |&b| vec![a, b]))
                .collect()
        }
    };
    let ranked = groups.into_iter().map(|group| {
        let slopes: Vec<&[f64]> = group.iter().map(|(_, slope)| *slope).collect();
        (left(&slopes, &now), group.iter().map(|(k, _)| *k).collect::<Vec<_>>())
    });
    let mut ranked: Vec<(f64, Vec<usize>)> = ranked.filter(|(left, _)| left.is_finite()).collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    ranked.truncate(if pairs { CLOSEST_PAIRS } else { CLOSEST });
    let own = |group: Vec<usize>| {
        let values = group.iter().map(|&k| unknown[k].value).collect();
        (group, values)
    };
    let mut begin: Vec<(Vec<usize>, Vec<f64>)> = ranked.into_iter().map(|(_, group)| own(group)).collect();
    for (path, value) in guesses.iter().take(CLOSEST).filter(|_| !pairs) {
        let known = unknown
            .iter()
            .position(|unknown| unknown.path == *path && unknown.is_alone());
        begin.extend(known.map(|k| (vec![k], vec![*value])));
    }
    let found = over_processors(begin.len(), &|| false, |index| {
        let (which, values) = &begin[index];
        let units: Vec<f64> = which.iter().map(|&k| unknown[k].unit).collect();
        let fit = Fit {
            evidence,
            play: &|values: &[f64], until| play(&Unknown::changes_of(unknown, which, values), until),
            units: &units,
        };
        Some((which.clone(), fit.refined(values.clone())?))
    });
    found.into_iter().flatten().collect()
}

#[derive(Debug, Clone, Default)]
pub(crate) struct Unknown {
    pub path: String,
    pub value: f64,
    pub unit: f64,
    pub with: Vec<String>,
    /// Other parameters that change by the same factor, with their values.
    pub scaled: Numbers,
    pub mistaken: Vec<f64>,
}

pub(crate) type Numbers = Vec<(String, f64)>;

/// Common mistakes of a parameter, as factors: double, half, zero, other sign, degrees.
const MISTAKEN: [f64; 6] = [2.0, 0.5, 0.0, -1.0, TAU / 360.0, 360.0 / TAU];

/// Mistakes of a phase besides its sign: a sine for a cosine, or the opposite direction.
const TURNS: [f64; 3] = [FRAC_PI_2, -FRAC_PI_2, PI];

impl Unknown {
    fn of(path: &str, value: f64) -> Unknown {
        Unknown {
            path: path.to_owned(),
            value,
            unit: value.abs(),
            mistaken: MISTAKEN.map(|factor| factor * value).to_vec(),
            ..Unknown::default()
        }
    }

    fn phase(path: &str, value: f64) -> Unknown {
        let turned = TURNS.map(|turn| value + turn).into_iter();
        Unknown {
            unit: 1.0,
            mistaken: turned.chain((value != 0.0).then_some(-value)).collect(),
            ..Unknown::of(path, value)
        }
    }

    pub fn changes(&self, value: f64) -> Numbers {
        let paths = [&self.path].into_iter().chain(&self.with);
        let same = paths.map(|path| (path.clone(), value));
        let scaled = self.scaled.iter();
        same.chain(scaled.map(|(path, own)| (path.clone(), own * value / self.value)))
            .collect()
    }

    /// Changes of several parameters to these values.
    pub fn changes_of(all: &[Unknown], which: &[usize], values: &[f64]) -> Numbers {
        let each = which.iter().zip(values);
        each.flat_map(|(&k, value)| all[k].changes(*value)).collect()
    }

    /// Whether it changes alone.
    pub fn is_alone(&self) -> bool {
        self.with.is_empty() && self.scaled.is_empty()
    }
}

fn signal_of_torque(train: &Train) -> Option<&Drive> {
    train.torque.as_ref().map(|torque| &torque.signal)
}

/// Paths of the phases of the harmonics in a system.
fn phases(system: &System) -> impl Iterator<Item = &'static str> {
    let (rotor, stator) = (&system.rotor, &system.stator);
    let speed = |train: &Train| matches!(&train.end, End::Driven(Drive::Wave(_)));
    let torque = |train: &Train| matches!(signal_of_torque(train), Some(Drive::Wave(_)));
    let is_wave = [
        ("rotor.torque.phase", torque(rotor)),
        ("rotor.speed.phase", speed(rotor)),
        ("stator.torque.phase", torque(stator)),
        ("stator.speed.phase", speed(stator)),
        (
            "contact.normal_force.phase",
            matches!(&system.pressing, Pressing::Force(Drive::Wave(_))),
        ),
    ];
    is_wave
        .into_iter()
        .filter(|(_, is_wave)| *is_wave)
        .map(|(path, _)| path)
}

impl Evidence<'_> {
    pub(crate) fn unknown(&self) -> Vec<Unknown> {
        let (system, trains) = (self.physics.system(), &self.physics.trains);
        let omega = self.physics.natural_angular_frequency();
        let speed = self.physics.speed();
        let torque = system.breakaway * system.radius * self.physics.course.largest_force();
        let of_case = self.case.numbers().iter().filter(|number| number.value != 0.0);
        let of_number = |number: &CaseNumber| match number.path.ends_with(".phase") {
            true => Unknown::phase(&number.path, number.value),
            false => Unknown::of(&number.path, number.value),
        };
        let mut unknown: Vec<Unknown> = of_case.map(of_number).collect();
        // The speed of a driven end, together with equal speeds at t = 0.
        for end in ["rotor.speed", "stator.speed"] {
            let number = self.case.number(end).map(|number| number.value);
            let Some(value) = number.filter(|speed| *speed != 0.0) else {
                continue;
            };
            let initial = self.case.numbers().iter();
            let same = initial.filter(|n| n.path.starts_with("initial.") && n.value == value);
            let with: Vec<String> = same.map(|number| number.path.clone()).collect();
            if !with.is_empty() {
                let alone = Unknown::of(end, value);
                unknown.push(Unknown { with, ..alone });
            }
        }
        // All coefficients of friction, which a mistaken size or unit of the force changes together.
        let coefficients = self.case.numbers().iter();
        let coefficients = coefficients.filter(|number| number.value != 0.0 && is_coefficient(&number.path));
        let mut coefficients = coefficients.map(|number| (number.path.clone(), number.value));
        if let Some((path, value)) = coefficients.next() {
            let scaled: Numbers = coefficients.collect();
            if !scaled.is_empty() {
                let alone = Unknown::of(&path, value);
                unknown.push(Unknown { scaled, ..alone });
            }
        }
        let mut add = |absent: Unknown| {
            // The first element of a list may be written as a number.
            fn bare(path: &str) -> &str {
                path.strip_suffix(".0").unwrap_or(path)
            }
            let is_known = unknown.iter().any(|known| bare(&known.path) == bare(&absent.path));
            if !is_known && absent.unit.is_finite() && absent.unit > 0.0 {
                unknown.push(absent);
            }
        };
        let mut absent = |path: String, unit: f64| {
            add(Unknown {
                path,
                unit,
                ..Unknown::default()
            });
        };
        for (name, train) in [("rotor", &trains.rotor), ("stator", &trains.stator)] {
            let inertia = |i: usize| train.inertia.get(i).copied().unwrap_or(f64::NAN);
            for i in 0..train.shafts() {
                absent(format!("{name}.damping.{i}"), inertia(i) * omega);
                absent(format!("initial.{name}_twist.{i}"), speed / omega);
            }
            for i in 0..train.inertia.len() {
                absent(format!("{name}.viscous.{i}"), inertia(i) * omega);
                absent(format!("initial.{name}_speed.{i}"), speed);
            }
            if !train.inertia.is_empty() {
                let is_wave = matches!(signal_of_torque(train), Some(Drive::Wave(_)));
                let mean = if is_wave { ".mean" } else { "" };
                absent(format!("{name}.torque{mean}"), torque);
            }
        }
        for path in phases(trains) {
            add(Unknown::phase(path, 0.0));
        }
        unknown
    }
}
