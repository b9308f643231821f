//! Requirements on a comparison: `onset<1e-6`.

use super::statistics::{OF_ATTRACTORS, STATISTICS};
use super::{ChannelErrors, Comparison};
use stickslip_system::quote::shown;

/// A bound on one number of a comparison.
#[derive(Debug, Clone, PartialEq)]
pub struct Requirement {
    text: String,
    metric: String,
    comparator: &'static str,
    bound: f64,
}

const METRICS: [&str; 12] = [
    "events",
    "events_rms",
    "missing",
    "spurious",
    "uncovered",
    "scd",
    "mescd",
    "drift",
    "score_position",
    "score_period",
    "score_rest",
    "score_creep",
];

impl Requirement {
    /// Names of all metrics.
    pub fn metrics() -> impl Iterator<Item = &'static str> {
        METRICS.into_iter().chain(STATISTICS.map(|s| s.0)).chain(OF_ATTRACTORS)
    }

    /// Parses `METRIC<BOUND`, or with `<=`, `>`, `>=`; the bound is a number, in seconds if the metric is a time.
    ///
    /// # Errors
    /// The text says what is wrong and what can be required.
    pub fn parse(text: &str) -> Result<Requirement, String> {
        let mut comparators = ["<=", ">=", "<", ">"].into_iter();
        let found = comparators.find_map(|c| text.split_once(c).map(|parts| (c, parts)));
        let Some((comparator, (metric, bound))) = found else {
            return Err(format!("--require {text}: expected METRIC<BOUND, such as onset<1e-6"));
        };
        let (metric, bound) = (metric.trim(), bound.trim());
        if metric == "digits" {
            return Err(format!(
                "--require {text}: the digits of a problem of the benchmark set are told by its check.py, which takes --require digits=6, too"
            ));
        }
        if !Requirement::metrics().any(|name| name == metric) {
            return Err(format!(
                "--require {text}: unknown metric \"{metric}\"; there are {}, {}, and of trains {}",
                METRICS.join(", "),
                STATISTICS.map(|s| s.0).join(", "),
                OF_ATTRACTORS.join(", "),
                metric = shown(metric)
            ));
        }
        let number = bound.parse().ok().filter(|number: &f64| number.is_finite());
        Ok(Requirement {
            bound: number.ok_or_else(|| {
                let bound = shown(bound);
                format!("--require {text}: \"{bound}\" is not a number; write one, such as onset<1e-6")
            })?,
            text: text.to_owned(),
            metric: metric.to_owned(),
            comparator,
        })
    }

    /// Words for an unmet requirement; `None` if it is met. A missing number meets no requirement.
    pub fn shortfall(&self, comparison: &Comparison) -> Option<String> {
        let value = self.value(comparison);
        let met = value.is_some_and(|value| match self.comparator {
            "<" => value < self.bound,
            "<=" => value <= self.bound,
            ">" => value > self.bound,
            _ => value >= self.bound,
        });
        let value = value.map_or_else(|| "does not exist".to_owned(), |value| format!("is {value:.3e}"));
        let (of, metric, text) = (&comparison.candidate, &self.metric, &self.text);
        (!met).then(|| format!("{of}: {metric} {value}, where {text} is required"))
    }

    /// The bounded number: an absolute error, a count, or the fewest digits of any channel.
    fn value(&self, comparison: &Comparison) -> Option<f64> {
        let fewest = |digits: fn(&ChannelErrors) -> Option<f64>| {
            comparison.channels.iter().filter_map(digits).min_by(f64::total_cmp)
        };
        match self.metric.as_str() {
            "events" => comparison.event_errors.max,
            "events_rms" => comparison.event_errors.rms,
            "missing" | "spurious" if comparison.reference_events == 0 && comparison.uncovered > 0 => None,
            "missing" => Some(comparison.missing as f64),
            "spurious" => Some(comparison.spurious as f64),
            "uncovered" => Some(comparison.uncovered as f64),
            "scd" => fewest(|row| row.scd),
            "mescd" => fewest(|row| row.mescd),
            "drift" => comparison.cycles.as_ref().map(|cycles| cycles.per_cycle.abs()),
            "score_position" => comparison.score.as_ref()?.position.as_ref().map(|of| of.relative),
            "score_period" => comparison.score.as_ref()?.period.as_ref().map(|of| of.relative),
            "score_rest" => comparison.score.as_ref()?.rest.as_ref().map(|of| of.relative),
            "score_creep" => comparison.score.as_ref()?.creep.as_ref().map(|of| of.relative),
            name => {
                let statistic = comparison.statistics.iter().find(|s| s.name == name)?;
                statistic.error().map(f64::abs)
            }
        }
    }
}
