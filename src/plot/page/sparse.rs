//! Stretches between events that have too few samples for a straight line between them.

use serde::Serialize;

use crate::plot::html::Doubles;
use crate::plot::run::widest_gap;
use crate::plot::{PlotError, Run};

/// Stretches on a page.
const MOST: usize = 5_000;

/// Samples in the shortest of the stretches that the remedy asks for.
const SAMPLES_EACH: f64 = 20.0;

/// Samples that the remedy asks for at most.
const MOST_SAMPLES: f64 = 1e6;

/// The stretches, in order of time, as figures mark them.
#[derive(Debug, Default, Serialize)]
pub(super) struct Sparse {
    /// When they begin and end, s.
    from: Doubles,
    to: Doubles,
    #[serde(skip)]
    stretches: Vec<(f64, f64)>,
}

impl Sparse {
    /// Those of a run whose case is known.
    ///
    /// # Errors
    /// The file cannot be read.
    pub(super) fn of(run: &Run) -> Result<Sparse, PlotError> {
        let mut stretches = run.undersampled(run.times)?.stretches;
        let growth = growth(run)?;
        // Unless figures mark it by themselves.
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

    /// The command that repeats the run of the file `name` with enough samples.
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
            "For samples there: stickslip run {name} -o NEW.h5 --set \
             'output.window=[{{from={from:.6}, to={to:.6}, interval={interval:.0e}}}]'."
        ))
    }
}

/// The stretch in which an oscillation grows, from the loss of stability to the first event of the contact, from where on two
/// samples of it are further apart than figures allow.
fn growth(run: &Run) -> Result<Option<(f64, f64)>, PlotError> {
    let Some(((begin, end), period)) = run.growth().zip(run.natural_period) else {
        return Ok(None);
    };
    let gap = widest_gap(period);
    let dense = run.dense_until((begin, end), gap)?.unwrap_or(begin);
    Ok((end - dense > gap).then_some((dense, end)))
}
