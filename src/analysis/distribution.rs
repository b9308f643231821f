//! The distribution of a quantity over many runs: percentiles and a histogram.

/// The percentiles that are reported, %.
pub const PERCENTILES: [f64; 7] = [1.0, 5.0, 25.0, 50.0, 75.0, 95.0, 99.0];

/// Bars of a histogram: at least and at most.
const BARS: (usize, usize) = (5, 40);

/// How values are spread.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Distribution {
    /// Values.
    pub count: usize,
    /// Of the others there is none: NaN.
    pub without: usize,
    /// In the unit of the values, as all that follows.
    pub least: f64,
    /// The largest value.
    pub largest: f64,
    /// Arithmetic.
    pub mean: f64,
    /// At [`PERCENTILES`], by a straight line between the values in order: the k-th of n, from 0, is at 100 k/(n - 1) %.
    pub percentiles: [f64; 7],
    /// (from, to, values in it) of every bar, one beside the other; a value on a boundary is in the bar above it, the
    /// largest in the last.
    pub bars: Vec<(f64, f64, usize)>,
}

impl Distribution {
    /// Of all values that are numbers; `None` if there is none. `whole` values have bars of whole widths around them.
    pub fn of(values: &[f64], whole: bool) -> Option<Distribution> {
        let mut sorted: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let (&least, &largest) = (sorted.first()?, sorted.last()?);
        let percentiles = PERCENTILES.map(|percent| percentile(&sorted, percent));
        Some(Distribution {
            count: sorted.len(),
            without: values.len() - sorted.len(),
            least,
            largest,
            mean: sorted.iter().sum::<f64>() / sorted.len() as f64,
            percentiles,
            bars: bars(&sorted, whole),
        })
    }
}

/// By a straight line between the two values beside it, of values in order.
fn percentile(sorted: &[f64], percent: f64) -> f64 {
    let place = percent / 100.0 * (sorted.len() - 1) as f64;
    let (low, part) = (place.floor() as usize, place.fract());
    match sorted.get(low + 1) {
        Some(next) if part > 0.0 => sorted[low] + part * (next - sorted[low]),
        _ => sorted[low],
    }
}

/// Bars of a round width near that of Freedman and Diaconis, 2 (q75 - q25) n^(-1/3).
fn bars(sorted: &[f64], whole: bool) -> Vec<(f64, f64, usize)> {
    let (least, largest) = (sorted[0], sorted[sorted.len() - 1]);
    let extent = largest - least;
    if extent <= 0.0 || !extent.is_finite() {
        let half = if whole { 0.5 } else { 0.0 };
        return vec![(least - half, largest + half, sorted.len())];
    }
    let spread = percentile(sorted, 75.0) - percentile(sorted, 25.0);
    let wish = 2.0 * spread / (sorted.len() as f64).cbrt();
    let most = extent / BARS.0 as f64;
    let mut width = round_width(wish.clamp(extent / BARS.1 as f64, most));
    if whole {
        width = width.round().max(1.0);
    }
    let start = if whole {
        least - 0.5
    } else {
        (least / width).floor() * width
    };
    let count = (((largest - start) / width).floor() as usize + 1).min(4 * BARS.1);
    let mut bars: Vec<(f64, f64, usize)> = (0..count)
        .map(|k| (start + k as f64 * width, start + (k + 1) as f64 * width, 0))
        .collect();
    for &value in sorted {
        let place = ((value - start) / width) as usize;
        bars[place.min(count - 1)].2 += 1;
    }
    // The rounding of the boundaries may leave a last bar without a value.
    while bars.len() > 1 && bars.last().is_some_and(|bar| bar.2 == 0) {
        bars.pop();
    }
    bars
}

/// 1, 2 or 5 times a power of ten, the largest up to `wish`.
fn round_width(wish: f64) -> f64 {
    let power = 10f64.powf(wish.log10().floor());
    let factor = [5.0, 2.0, 1.0]
        .into_iter()
        .find(|factor| factor * power <= wish * (1.0 + 1e-9));
    factor.unwrap_or(1.0) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_percentiles_of_a_ramp() {
        let ramp: Vec<f64> = (0..=100).rev().map(f64::from).chain([f64::NAN; 3]).collect();
        let found = Distribution::of(&ramp, false).unwrap();
        assert_eq!((found.count, found.without), (101, 3));
        for (own, percent) in found.percentiles.iter().zip(PERCENTILES) {
            assert!((own - percent).abs() < 1e-12, "{own}");
        }
        assert_eq!((found.least, found.largest, found.mean), (0.0, 100.0, 50.0));
        assert_eq!(found.bars.iter().map(|bar| bar.2).sum::<usize>(), 101);
        assert!((BARS.0..=BARS.1 + 1).contains(&found.bars.len()));
    }

    #[test]
    fn analytic_whole_numbers_stand_in_the_middle_of_their_bars() {
        let found = Distribution::of(&[3.0, 3.0, 4.0, 6.0], true).unwrap();
        assert_eq!(found.bars, [(2.5, 3.5, 2), (3.5, 4.5, 1), (4.5, 5.5, 0), (5.5, 6.5, 1)]);
        assert_eq!(Distribution::of(&[f64::NAN], false), None);
        assert_eq!(Distribution::of(&[7.0, 7.0], false).unwrap().bars, [(7.0, 7.0, 2)]);
    }
}
