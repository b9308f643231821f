//! Distribution of a quantity over many runs: percentiles and a histogram.

/// Reported percentiles, %.
pub const PERCENTILES: [f64; 7] = [1.0, 5.0, 25.0, 50.0, 75.0, 95.0, 99.0];

const BARS: (usize, usize) = (5, 40);

/// Distribution of finite values.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Distribution {
    /// Number of finite values.
    pub count: usize,
    /// Number of missing values (NaN).
    pub without: usize,
    /// Least value, in the unit of the values.
    pub least: f64,
    /// The largest value.
    pub largest: f64,
    /// Arithmetic mean.
    pub mean: f64,
    /// Values at [`PERCENTILES`], linear between sorted values: the k-th of n, from 0, is at 100 k/(n - 1) %.
    pub percentiles: [f64; 7],
    /// Adjacent bars (from, to, count). A value on a boundary belongs to the upper bar; the largest to the last.
    pub bars: Vec<(f64, f64, usize)>,
}

impl Distribution {
    /// Distribution of the finite values; `None` if there are none. Bars of `whole` numbers are centred on them.
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

fn percentile(sorted: &[f64], percent: f64) -> f64 {
    let place = percent / 100.0 * (sorted.len() - 1) as f64;
    let (low, part) = (place.floor() as usize, place.fract());
    match sorted.get(low + 1) {
        Some(next) if part > 0.0 => sorted[low] + part * (next - sorted[low]),
        _ => sorted[low],
    }
}

/// Bars of a round width near 2 (q75 - q25) n^(-1/3), the rule of Freedman and Diaconis.
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
    // Rounded boundaries may leave an empty last bar.
    while bars.len() > 1 && bars.last().is_some_and(|bar| bar.2 == 0) {
        bars.pop();
    }
    bars
}

/// Largest of 1, 2 or 5 times a power of ten up to `wish`.
fn round_width(wish: f64) -> f64 {
    let power = 10f64.powf(wish.log10().floor());
    let factor = [5.0, 2.0, 1.0]
        .into_iter()
        .find(|factor| factor * power <= wish * (1.0 + 1e-9));
    factor.unwrap_or(1.0) * power
}
