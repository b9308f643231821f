//! Parameters of a case, one or two at once, with which a motion comes closest to a candidate.

use super::Bench;
use super::fit::{Fit, FitPoint, left};
use super::unknown::{Numbers, Unknown};
use stickslip_engine::workers::over_processors;

/// Number of parameters, and of pairs, that are fitted completely after the first window.
const CLOSEST: usize = 12;
const CLOSEST_PAIRS: usize = 6;

/// Values of one parameter (or of two) with which a motion from a start comes closest to the candidate. `guesses` are
/// initial values of single parameters.
pub(super) fn propose(
    bench: &Bench<'_>,
    start: usize,
    unknown: &[Unknown],
    pairs: bool,
    guesses: &[(String, f64)],
) -> Vec<Numbers> {
    let changes = |which: &[usize], values: &[f64]| -> Numbers {
        let each = which.iter().zip(values);
        each.flat_map(|(&k, value)| unknown[k].changes(*value)).collect()
    };
    let Some(base) = bench.with_numbers(start, &[]) else {
        return Vec::new();
    };
    let window = bench.evidence.window(&base);
    let now = bench.evidence.residual(&base, window);
    if now.is_empty() || now.iter().any(|x| !x.is_finite()) {
        return Vec::new();
    }
    let slopes = over_processors(unknown.len(), &|| false, |k| {
        let fit = Fit {
            evidence: &bench.evidence,
            play: &|values: &[f64]| unknown[k].played(bench, start, values[0]),
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
            .position(|unknown| unknown.path == *path && unknown.with.is_empty());
        begin.extend(known.map(|k| (vec![k], vec![*value])));
    }
    let found = over_processors(begin.len(), &|| false, |index| {
        let (which, values) = &begin[index];
        let units: Vec<f64> = which.iter().map(|&k| unknown[k].unit).collect();
        let fit = Fit {
            evidence: &bench.evidence,
            play: &|values: &[f64]| bench.with_numbers(start, &changes(which, values)),
            units: &units,
        };
        let point = fit.refined(values.clone())?;
        Some(changes(which, &point.values))
    });
    found.into_iter().flatten().collect()
}
