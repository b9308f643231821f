//! Columns that are low-pass filtered.

use super::evidence::Evidence;
use super::judge::ALL;
use super::motion::Played;
use super::observation::ObservedValues;
use super::rows::EvenRows;
use super::search::Search;
use super::{Cause, Proposal, rows};
use crate::diagnosis::CauseKind;
use std::f64::consts::{PI, SQRT_2, TAU};
use std::sync::Arc;
use stickslip_engine::workers::over_processors;

/// A filter for samples at even times, by its corner in periods per interval.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Filter {
    /// y' = (x - y)/T with x constant in each interval: exponential smoothing.
    Steps,
    /// y' = (x - y)/T with x on a straight line in each interval.
    Lines,
    /// Butterworth filter of order 2, by the bilinear transform.
    Butterworth,
}

/// Coefficients of a filter: b0, b1, b2 for x, and a1, a2 for y.
type FilterCoefficients = [f64; 5];

/// Corners that are tried first, in periods per interval, each so many times the one before.
const HIGHEST: f64 = 0.45;
const LOWEST: f64 = 1e-4;
const FINER: f64 = 0.6;
/// Smallest explained part of the difference for which the corner is fitted.
const PROMISING: f64 = 0.5;
/// Steps of the golden section.
const STEPS: usize = 40;
/// Time constants after which a filter has forgotten how it began.
const SETTLED: f64 = 16.0;
/// Largest part of the rows that is left out for that.
const UNSETTLED: f64 = 0.04;

/// y by x with this corner (Hz).
#[derive(Debug)]
pub(crate) struct LowPass {
    filter: Filter,
    /// Forward and backward, which delays nothing.
    both_ways: bool,
    corner: f64,
    which: Vec<bool>,
}

impl Filter {
    const ALL: [Filter; 3] = [Filter::Steps, Filter::Lines, Filter::Butterworth];

    fn coefficients(self, corner: f64) -> FilterCoefficients {
        let ratio = TAU * corner;
        let kept = (-ratio).exp();
        match self {
            Filter::Steps => [1.0 - kept, 0.0, 0.0, -kept, 0.0],
            Filter::Lines => {
                let mean = (1.0 - kept) / ratio;
                [1.0 - mean, mean - kept, 0.0, -kept, 0.0]
            }
            Filter::Butterworth => {
                let k = (PI * corner).tan();
                let scale = 1.0 / (1.0 + SQRT_2 * k + k * k);
                let b = k * k * scale;
                [
                    b,
                    2.0 * b,
                    b,
                    2.0 * (k * k - 1.0) * scale,
                    (1.0 - SQRT_2 * k + k * k) * scale,
                ]
            }
        }
    }

    fn order(self) -> usize {
        match self {
            Filter::Steps | Filter::Lines => 1,
            Filter::Butterworth => 2,
        }
    }
}

/// Filters values in their order, from rest at the first one.
fn forward<'a>([b0, b1, b2, a1, a2]: FilterCoefficients, values: impl Iterator<Item = &'a mut f64>) {
    let mut past: Option<[f64; 4]> = None;
    for value in values {
        let x = *value;
        let [x1, x2, y1, y2] = past.unwrap_or([x; 4]);
        *value = b0 * x + b1 * x1 + b2 * x2 - a1 * y1 - a2 * y2;
        past = Some([x, x1, *value, y1]);
    }
}

impl LowPass {
    /// Rows of a channel, filtered; NaN where the filter remembers how it began.
    fn filtered(&self, interval: f64, values: &[f64]) -> Vec<f64> {
        let corner = self.corner * interval;
        let coefficients = self.filter.coefficients(corner);
        let mut filtered = values.to_vec();
        let first = values
            .iter()
            .position(|value| value.is_finite())
            .unwrap_or(values.len());
        let known = &mut filtered[first..];
        let unsettled = (SETTLED / (TAU * corner)).min(UNSETTLED * known.len() as f64) as usize;
        forward(coefficients, known.iter_mut());
        if self.both_ways {
            forward(coefficients, known.iter_mut().rev());
            known
                .iter_mut()
                .rev()
                .take(unsettled)
                .for_each(|value| *value = f64::NAN);
        }
        known.iter_mut().take(unsettled).for_each(|value| *value = f64::NAN);
        filtered
    }

    fn of_rows(&self, rows: &EvenRows) -> ObservedValues {
        rows.sampled(|values| {
            let filtered = self.filtered(rows.interval, values);
            move |row| filtered[row]
        })
    }
}

/// A value with four digits or more before the point.
fn four_digits(value: f64) -> String {
    let decimals = (3.0 - value.abs().log10().floor()).clamp(0.0, 12.0);
    format!("{value:.*}", decimals as usize)
}

impl Cause for LowPass {
    /// Each filter with the corner that brings it closest to the candidate.
    fn propose(search: &Search<'_>) -> Vec<Proposal> {
        let evidence = search.evidence;
        let rows = rows::start_of_case(evidence).and_then(|start| EvenRows::of(evidence, start, 0));
        let Some((seen, rows)) = evidence.observation.zip(rows) else {
            return Vec::new();
        };
        let plain = rows.plain();
        let columns = (0..seen.channels.len()).filter(|&channel| seen.is_column(channel));
        let unfiltered: f64 = columns.map(|channel| seen.left_in(channel, &plain[channel])).sum();
        let filters = Filter::ALL
            .into_iter()
            .flat_map(|filter| [(filter, false), (filter, true)]);
        let filters: Vec<(Filter, bool)> = filters.collect();
        let found = over_processors(filters.len(), &|| false, |k| {
            let (filter, both_ways) = filters[k];
            let with = |corner: f64| {
                let mut with = LowPass {
                    filter,
                    both_ways,
                    corner: corner / rows.interval,
                    which: Vec::new(),
                };
                let (left, which) = rows::closer(seen, &plain, &with.of_rows(&rows))?;
                with.which = which;
                Some((left, with))
            };
            let left = |corner: f64| with(corner).map_or(f64::INFINITY, |(left, _)| left);
            let corners = std::iter::successors(Some(HIGHEST), |corner| Some(FINER * corner));
            let corners = corners
                .take_while(|corner| *corner > LOWEST)
                .map(|corner| (left(corner), corner));
            let (best, begin) = corners.min_by(|a, b| a.0.total_cmp(&b.0))?;
            if best > (1.0 - PROMISING) * unfiltered {
                return None;
            }
            // The golden section in the logarithm of the corner.
            const GOLDEN: f64 = 0.618_034;
            let (mut low, mut high) = ((FINER * begin).ln(), (begin / FINER).min(HIGHEST).ln());
            for _ in 0..STEPS {
                let [inner, outer] = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)];
                match left(inner.exp()) < left(outer.exp()) {
                    true => high = outer,
                    false => low = inner,
                }
            }
            Some(Arc::new(with((0.5 * (low + high)).exp())?.1) as Proposal)
        });
        found.into_iter().flatten().collect()
    }

    fn run(&self, evidence: &Evidence<'_>, start: usize) -> Option<Played> {
        let rows = EvenRows::of(evidence, start, 0)?;
        rows::played(evidence, &self.which, rows.plain(), self.of_rows(&rows))
    }

    fn least(&self, _: &Evidence<'_>) -> f64 {
        1.0 - ALL
    }

    fn words(&self, search: &Search<'_>) -> (CauseKind, String) {
        let names = rows::names(search.evidence, &self.which);
        let ways = if self.both_ways { ", forward and backward" } else { "" };
        let words = format!(
            "{names}: a low-pass filter of order {} with its corner at {} Hz{ways}",
            self.filter.order(),
            four_digits(self.corner),
        );
        (CauseKind::LowPassFilter, words)
    }

    fn complexity(&self, _: &Evidence<'_>) -> usize {
        1
    }

    fn is_of_rows(&self) -> bool {
        true
    }
}
