//! Stretches between events with too few samples for straight lines.

use serde::Serialize;

use crate::plot::html::Doubles;
use crate::plot::run::widest_gap;
use crate::plot::{DrawnRun, Error};

const MOST: usize = 5_000;

/// Samples in the shortest stretch after the remedy.
const SAMPLES_EACH: f64 = 20.0;

/// Largest number of samples in the remedy.
const MOST_SAMPLES: f64 = 1e6;

#[derive(Debug, Default, Serialize)]
pub(super) struct Sparse {
    /// Start and end, s.
    from: Doubles,
    to: Doubles,
    #[serde(skip)]
    stretches: Vec<(f64, f64)>,
}

impl Sparse {
    pub(super) fn of(run: &DrawnRun) -> Result<Sparse, Error> {
        let mut stretches = run.undersampled(run.times)?.stretches;
        let growth = growth(run)?;
        // Unless figures mark it already.
        let known = |end: f64| stretches.first().is_some_and(|first| first.0 < end);
        if let Some(growth) = growth.filter(|growth| !known(growth.1)) {
            stretches.insert(0, growth);
        }
        let shown = stretches.iter().take(MOST);
        Ok(Sparse {
            from: shown.clone().map(|stretch| stretch.0).collect(),
            to: shown.map(|stretch| stretch.1).collect(),
            stretches,
        })
    }

    /// The command that repeats the run `name` with enough samples.
    pub(super) fn remedy(&self, name: &str) -> Option<String> {
        let (from, to) = (self.stretches.first()?.0, self.stretches.last()?.1);
        // The stretch of growth is the first, and longer than a natural period.
        let lengths = self.stretches.iter().map(|(from, to)| to - from);
        let finest = lengths.fold(f64::INFINITY, f64::min) / SAMPLES_EACH;
        let wanted = finest.max((to - from) / MOST_SAMPLES);
        let power = 10f64.powf(wanted.log10().floor());
        let interval = [5.0, 2.0, 1.0]
            .into_iter()
            .map(|m| m * power)
            .find(|&one| one <= wanted)?;
        let margin = (to - from) * 0.02;
        let (from, to) = ((from - margin).max(0.0), to + margin);
        Some(format!(
            "stickslip run {name} -o NEW.h5 --set 'output.window=[{{from={from:.6}, to={to:.6}, interval={interval:.0e}}}]'"
        ))
    }
}

/// The part of the growth before the first contact event that has wider gaps than figures allow.
fn growth(run: &DrawnRun) -> Result<Option<(f64, f64)>, Error> {
    let Some(((begin, end), period)) = run.growth().zip(run.natural_period) else {
        return Ok(None);
    };
    let gap = widest_gap(period);
    let dense = run.dense_until((begin, end), gap)?.unwrap_or(begin);
    Ok((end - dense > gap).then_some((dense, end)))
}
