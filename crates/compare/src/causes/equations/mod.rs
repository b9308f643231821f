//! Parameters of a case fitted to the equations that a candidate's samples satisfy between its events. They are
//! proposals, and need no run.

mod residual;
pub mod stretches;

use super::fit::{least_squares, left, square};
use super::number::BREAKAWAY;
use super::parameters::of_normal_force;
use residual::{Equations, Missed};
use stickslip_case::WrittenCase;
use stickslip_system::model::system::System;
use stretches::Stretch;
pub(crate) use stretches::StretchPass;

/// An equation holds if its root mean square residual is below this part of its terms, which covers quadrature and
/// rounding, or below this part of the change by a quadrature through fewer samples.
const MISSED: f64 = 1e-7;
const QUADRATURE: f64 = 0.01;
/// Largest remaining part of the root mean square residual for a parameter that explains it.
const LEFT: f64 = 0.05;
/// Two parameters explain equally if their remaining squares differ by less than this factor. Below the floor, a part
/// of the terms, they cannot be distinguished.
const AS_MUCH: f64 = 2.0;
const FLOOR: f64 = 3e-9;
/// Smallest change of a known parameter, in standard deviations.
const KNOWN: f64 = 20.0;
const STEP: f64 = 1e-6;
const STEPS: usize = 8;
/// Smallest factor of a parameter that determines F_n.
const LEAST_FORCE: f64 = 1e-2;
const CLOSEST: usize = 5;
const FEWEST: usize = 10;
/// A stretch whose residual exceeds this multiple of the median is an outlier: a kick, or a missed event.
const ACCIDENT: f64 = 30.0;
const ACCIDENTS: f64 = 0.02;
/// A change of a parameter by 100 % must change the equations by this part of their terms to explain the samples.
const TOUCHED: f64 = 1e-7;

/// A parameter: its path, its value in SI, and the error of the value.
pub(crate) type FittedNumber = (String, f64, f64);

/// Parameters, one or two at once, with which the samples satisfy the equations.
#[derive(Debug)]
pub(crate) struct Fitted {
    pub numbers: Vec<FittedNumber>,
    /// Other parameters that do as well, each alone.
    pub or: Vec<FittedNumber>,
}

struct FitProblem<'a> {
    numbers: &'a WrittenCase,
    absent: Vec<(&'a str, f64)>,
    stretches: &'a [Stretch],
    base: Equations,
    scale: Vec<f64>,
}

struct Solution<'a> {
    paths: Vec<&'a str>,
    values: Vec<f64>,
    deviations: Vec<f64>,
    left: f64,
}

impl<'a> FitProblem<'a> {
    /// Residuals of all stretches with these parameters, in parts of the equations' terms; NaN if the parameters are
    /// invalid.
    fn missed(&self, changes: &[(&str, f64)], coarse: bool) -> Vec<f64> {
        let changed;
        let equations = if changes.is_empty() {
            &self.base
        } else {
            let Some((trains, _)) = self.numbers.moved_all(changes) else {
                return vec![f64::NAN; self.stretches.len() * self.scale.len()];
            };
            changed = self.base.with(trains, self.stretches);
            &changed
        };
        let mut all = Vec::with_capacity(self.stretches.len() * self.scale.len());
        for (index, stretch) in self.stretches.iter().enumerate() {
            let missed = equations.missed(stretch, index, coarse);
            let scaled = missed.iter().zip(&self.scale);
            all.extend(scaled.map(|(missed, scale)| missed.map_or(0.0, |(missed, _)| missed * scale)));
        }
        all
    }

    fn value(&self, path: &str) -> f64 {
        self.numbers.number(path).map_or(0.0, |number| number.value)
    }

    fn unit(&self, path: &str) -> f64 {
        let absent = self.absent.iter().find(|(known, _)| *known == path);
        absent.map_or_else(|| self.value(path), |(_, unit)| *unit)
    }

    fn slope(&self, changes: &[(&str, f64)], which: usize, coarse: bool) -> Vec<f64> {
        let unit = self.unit(changes[which].0);
        let moved = |by: f64| {
            let mut changes = changes.to_vec();
            changes[which].1 += by * unit;
            self.missed(&changes, coarse)
        };
        let known = |missed: &[f64]| missed.iter().all(|x| x.is_finite());
        let (mut ends, mut width) = ([moved(-STEP), moved(STEP)], 2.0 * STEP);
        // At the end of the valid range only one side exists.
        if let Some(side) = ends.iter().position(|missed| !known(missed)) {
            (ends[side], width) = (moved(0.0), STEP);
        }
        let [below, above] = ends;
        above.iter().zip(&below).map(|(a, b)| (a - b) / width).collect()
    }

    /// Values of the parameters that minimise the residual, starting from the case; `None` if there are none.
    fn solve(&self, paths: &[&'a str], mask: &[bool], coarse: bool) -> Option<Solution<'a>> {
        let mut values: Vec<f64> = paths.iter().map(|path| self.value(path)).collect();
        let named =
            |values: &[f64]| -> Vec<(&str, f64)> { paths.iter().copied().zip(values.iter().copied()).collect() };
        let mut now = masked(self.missed(&named(&values), coarse), mask);
        let mut left = square(&now);
        let mut deviations = vec![f64::INFINITY; paths.len()];
        for _ in 0..STEPS {
            let changes = named(&values);
            let slopes = (0..paths.len()).map(|which| masked(self.slope(&changes, which, coarse), mask));
            let (step, inverse) = least_squares(&slopes.collect::<Vec<_>>(), &now)?;
            let better = (0..6).find_map(|times| {
                let shrink = 0.25f64.powi(times);
                let moved = values.iter().zip(&step).zip(paths).map(|((value, step), path)| {
                    let unit = self.unit(path);
                    // A term may vanish, but not the force, without which the equations cannot be read.
                    let least = if of_normal_force(path) { LEAST_FORCE } else { 0.0 };
                    (value / unit + (shrink * step).clamp(-1.0, 1.0)).max(least) * unit
                });
                let moved: Vec<f64> = moved.collect();
                let missed = masked(self.missed(&named(&moved), coarse), mask);
                let sum = square(&missed);
                (sum.is_finite() && sum <= left).then_some((moved, missed, sum))
            });
            let settled = better.is_none() || step.iter().all(|step| step.abs() < 1e-12);
            if let Some(better) = better {
                (values, now, left) = better;
            }
            let count = mask.iter().filter(|on| **on).count().max(paths.len() + 1);
            let deviation = (left / (count - paths.len()) as f64).sqrt();
            deviations = inverse.iter().map(|d| d.sqrt() * deviation).collect();
            if settled {
                break;
            }
        }
        let deviations = deviations.iter().zip(paths);
        let deviations = deviations.map(|(d, path)| d * self.unit(path).abs()).collect();
        Some(Solution {
            paths: paths.to_vec(),
            values,
            deviations,
            left,
        })
    }
}

fn masked(mut values: Vec<f64>, mask: &[bool]) -> Vec<f64> {
    for (value, on) in values.iter_mut().zip(mask) {
        if !on {
            *value = 0.0;
        }
    }
    values
}

/// Paths of damping and drag that are 0 in the case.
fn absent(system: &System) -> Vec<String> {
    let mut found = Vec::new();
    for (name, train) in [("rotor", &system.rotor), ("stator", &system.stator)] {
        for (key, values) in [("damping", &train.damping), ("viscous", &train.viscous)] {
            let zeros = (0..values.len()).filter(|&index| values[index] == 0.0);
            found.extend(zeros.map(|index| format!("{name}.{key}.{index}")));
        }
    }
    found
}

/// Parameters with which the equations of a case hold for a candidate's samples; `None` if they hold as they are, if no
/// parameters mend them, or if the samples do not show them. `places` are those of the channels in the state.
pub(crate) fn fitted(numbers: &WrittenCase, places: &[usize], stretches: StretchPass) -> Option<Fitted> {
    // Changes are factors, so a parameter that is 0 has none.
    let shown = numbers.numbers().iter().filter(|number| number.value != 0.0);
    let shown = shown.map(|number| number.path.as_str());
    let is_shown =
        |path: &&str| !path.starts_with("perturbation.") && !path.starts_with("initial.") && *path != BREAKAWAY;
    let paths: Vec<&str> = shown.filter(is_shown).collect();
    fit(
        numbers,
        places,
        &stretches.finish(),
        &paths,
        &absent(&numbers.case().system),
    )
}

fn fit<'a>(
    numbers: &'a WrittenCase,
    places: &[usize],
    stretches: &'a [Stretch],
    paths: &[&'a str],
    absent: &'a [String],
) -> Option<Fitted> {
    let (case, _) = numbers.moved_all(&[]).filter(|_| stretches.len() >= FEWEST)?;
    let base = Equations::new(case, places, stretches);
    let equations = base.count();
    let stretch_by_stretch = stretches.iter().enumerate();
    let missed: Vec<Missed> = stretch_by_stretch
        .flat_map(|(index, s)| base.missed(s, index, false))
        .collect();
    let present: Vec<bool> = missed.iter().map(Option::is_some).collect();
    let count = present.iter().filter(|there| **there).count();
    if count < FEWEST {
        return None;
    }
    let scale = (0..equations).map(|equation| {
        let of_equation = missed.iter().skip(equation).step_by(equations).flatten();
        let (sum, count) = of_equation.fold((0.0, 0u32), |(sum, count), (_, terms)| (sum + terms * terms, count + 1));
        if sum > 0.0 {
            (f64::from(count) / sum).sqrt()
        } else {
            0.0
        }
    });
    let mut problem = FitProblem {
        numbers,
        absent: absent.iter().map(|path| (path.as_str(), 1.0)).collect(),
        stretches,
        scale: scale.collect(),
        base,
    };
    let raw = problem.missed(&[], false);
    let root = |sum: f64| (sum / count as f64).sqrt();
    if is_satisfied(&raw, &problem.missed(&[], true), &present, equations) {
        return None;
    }
    // Slopes at the case's own values.
    let mut columns: Vec<(&str, Vec<f64>)> = Vec::new();
    for &path in paths {
        let slope = problem.slope(&[(path, problem.value(path))], 0, false);
        if slope.iter().all(|x| x.is_finite()) && root(square(&slope)) > TOUCHED {
            columns.push((path, slope));
        }
    }
    let in_case = columns.len();
    for index in 0..problem.absent.len() {
        let (path, _) = problem.absent[index];
        let mut slope = problem.slope(&[(path, 0.0)], 0, false);
        let size = root(square(&slope));
        if size.is_finite() && size > 0.0 {
            slope.iter_mut().for_each(|x| *x /= size);
            problem.absent[index].1 = 1.0 / size;
            columns.push((path, slope));
        }
    }
    let mut mask = present.clone();
    let closest = |groups: &mut dyn Iterator<Item = Vec<usize>>, mask: &[bool]| -> Vec<Solution<'a>> {
        let now = masked(raw.clone(), mask);
        let ranked = groups.map(|group| {
            let slopes = group.iter().map(|&k| masked(columns[k].1.clone(), mask));
            let left = left(&slopes.collect::<Vec<_>>(), &now);
            (left, group.iter().map(|&k| columns[k].0).collect::<Vec<_>>())
        });
        let mut ranked: Vec<(f64, Vec<&'a str>)> = ranked.collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        let solved = ranked.iter().take(CLOSEST);
        solved
            .filter_map(|(_, paths)| problem.solve(paths, mask, false))
            .collect()
    };
    let mut solved = closest(&mut (0..columns.len()).map(|k| vec![k]), &mask);
    // The residual of the best shows the outliers.
    if let Some(best) = solved.iter().min_by(|a, b| a.left.total_cmp(&b.left)) {
        let left = problem.missed(&[(best.paths[0], best.values[0])], false);
        let fewer = without_accidents(&left, &present, equations);
        let dropped = count - fewer.iter().filter(|on| **on).count();
        if dropped > 0 && dropped as f64 <= ACCIDENTS * count as f64 {
            mask = fewer;
            let again = solved
                .iter()
                .filter_map(|known| problem.solve(&known.paths, &mask, false));
            solved = again.collect();
        }
    }
    let before = square(&masked(raw.clone(), &mask));
    let floor = FLOOR * FLOOR * count as f64;
    let as_much = |left: f64, best: f64| left + floor <= AS_MUCH * (best + floor);
    let explains = |solution: &&Solution| {
        let values = solution.values.iter().zip(&solution.deviations);
        let mut known = solution.paths.iter().zip(values);
        let is_known = known.all(|(path, (value, deviation))| (value - problem.value(path)).abs() > KNOWN * deviation);
        solution.left <= LEFT * LEFT * before && is_known
    };
    // The quadrature through fewer samples bounds the error of the values.
    let with_error = |solution: &Solution<'a>| -> Vec<FittedNumber> {
        let coarse = problem.solve(&solution.paths, &mask, true);
        let each = solution.paths.iter().enumerate().map(|(k, path)| {
            let (value, deviation) = (solution.values[k], solution.deviations[k]);
            let quadrature = coarse.as_ref().map_or(0.0, |coarse| (coarse.values[k] - value).abs());
            ((*path).to_owned(), value, (3.0 * deviation).max(0.1 * quadrature))
        });
        each.collect()
    };
    let explained = |best: &Solution<'a>, or: Vec<FittedNumber>| {
        Some(Fitted {
            numbers: with_error(best),
            or,
        })
    };
    solved.sort_by(|a, b| a.left.total_cmp(&b.left));
    // Of parameters that explain as much, the force comes last.
    let least = solved.first().map_or(0.0, |best| best.left);
    solved.sort_by_key(|solution| {
        let as_much = as_much(solution.left, least);
        (!as_much, as_much && of_normal_force(solution.paths[0]))
    });
    if let Some(best) = solved.first().filter(explains) {
        let or = solved[1..]
            .iter()
            .filter(|other| as_much(other.left, best.left))
            .filter(explains);
        return explained(best, or.flat_map(with_error).collect());
    }
    let mut pairs = (0..in_case).flat_map(|a| (a + 1..in_case).map(move |b| vec![a, b]));
    let mut solved = closest(&mut pairs, &mask);
    solved.sort_by(|a, b| a.left.total_cmp(&b.left));
    match solved.first().filter(explains) {
        Some(best) if solved.get(1).is_none_or(|next| !as_much(next.left, best.left)) => explained(best, Vec::new()),
        _ => None,
    }
}

fn is_satisfied(fine: &[f64], coarse: &[f64], present: &[bool], equations: usize) -> bool {
    (0..equations).all(|equation| {
        let entries = || (equation..fine.len()).step_by(equations).filter(|&k| present[k]);
        let root = |of: &dyn Fn(usize) -> f64| {
            let squares: f64 = entries().map(|k| of(k) * of(k)).sum();
            (squares / entries().count().max(1) as f64).sqrt()
        };
        root(&|k| fine[k]) <= MISSED.max(QUADRATURE * root(&|k| fine[k] - coarse[k]))
    })
}

fn without_accidents(missed: &[f64], present: &[bool], equations: usize) -> Vec<bool> {
    let mut mask = present.to_vec();
    for equation in 0..equations {
        let entries = || (equation..missed.len()).step_by(equations);
        let mut sizes: Vec<f64> = entries().filter(|&k| present[k]).map(|k| missed[k].abs()).collect();
        if sizes.is_empty() {
            continue;
        }
        let middle = sizes.len() / 2;
        let median = *sizes.select_nth_unstable_by(middle, f64::total_cmp).1;
        for k in entries() {
            mask[k] &= missed[k].abs() <= (ACCIDENT * median).max(MISSED);
        }
    }
    mask
}
