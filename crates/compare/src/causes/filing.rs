//! Rows of a right motion that another program has processed: exchanged, moved, repeated, averaged or filtered.

use super::evidence::Evidence;
use super::fit::{fitted, golden};
use super::judge::{ALL, EXACT, Judged};
use super::motion::Played;
use super::observation::{Observation, ObservedValues};
use super::search::{Search, Tried};
use super::{Cause, Causes, Proposal, proposals};
use crate::diagnosis::{CauseKind, Diagnosis};
use std::f64::consts::{PI, SQRT_2, TAU};
use stickslip_case::quantity::Dimension;
use stickslip_engine::workers::over_processors;

/// Processing of the rows.
#[derive(Debug)]
enum Filing {
    /// Columns are exchanged.
    Swapped,
    /// Constants that are added to the channels, each in its unit.
    Offset(Vec<f64>),
    /// Each row stands so many times; its values belong to the first of these times.
    Repeated(usize),
    /// Speeds are by this time (s) later than their rows.
    HalfStep(f64),
    /// The mean of so many samples.
    Average(usize, MeanPlace),
    /// Filtered with a corner frequency, Hz; forward and backward, which delays nothing, if so.
    LowPass(Filter, bool, f64),
}

/// Place of the samples of a mean.
#[derive(Debug, Clone, Copy, PartialEq)]
enum MeanPlace {
    /// They end at the row.
    Last,
    /// The row is the middle one, or behind the middle.
    Middle,
    /// Likewise, and beyond the ends of the file they are zero.
    Padded,
}

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

/// Rows that are processed, and the motion of which they are.
#[derive(Debug)]
pub(crate) struct FiledRows {
    filing: Filing,
    /// The channels that are processed.
    which: Vec<bool>,
    values: ObservedValues,
}

/// Largest distance of a sample from an even time, in intervals.
const UNEVEN: f64 = 0.1;
/// Most rows of the motion that are computed.
const MOST_ROWS: usize = 400_000;
/// Largest remaining part of the mean square of a channel that is off by a constant.
const OF_CONSTANT: f64 = 0.01;
/// Most samples of a moving average.
const MOST_AVERAGED: usize = 256;
/// Corners that are tried first, in periods per interval, each so many times the one before.
const HIGHEST: f64 = 0.45;
const LOWEST: f64 = 1e-4;
const FINER: f64 = 0.6;
/// Smallest explained part of the difference with which a value is fitted.
const PROMISING: f64 = 0.5;
/// Time constants after which a filter has forgotten how it began, and largest part of the rows that is left out for
/// that.
const SETTLED: f64 = 16.0;
const UNSETTLED: f64 = 0.04;

impl Filter {
    /// Coefficients b0, b1, b2 for x, and a1, a2 for y.
    fn coefficients(self, corner: f64) -> [f64; 5] {
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
                let [a1, a2] = [2.0 * (k * k - 1.0) * scale, (1.0 - SQRT_2 * k + k * k) * scale];
                [b, 2.0 * b, b, a1, a2]
            }
        }
    }

    /// Filters values in their order, from rest at the first one.
    fn forward<'a>(self, corner: f64, values: impl Iterator<Item = &'a mut f64>) {
        let [b0, b1, b2, a1, a2] = self.coefficients(corner);
        let mut past: Option<[f64; 4]> = None;
        for value in values {
            let x = *value;
            let [x1, x2, y1, y2] = past.unwrap_or([x; 4]);
            *value = b0 * x + b1 * x1 + b2 * x2 - a1 * y1 - a2 * y2;
            past = Some([x, x1, *value, y1]);
        }
    }

    /// Filters values, of which the first may be unknown; NaN where the filter remembers how it began.
    fn filtered(self, both_ways: bool, corner: f64, values: &[f64]) -> Vec<f64> {
        let mut filtered = values.to_vec();
        let first = values.iter().position(|value| value.is_finite());
        let known = &mut filtered[first.unwrap_or(values.len())..];
        let unsettled = (SETTLED / (TAU * corner)).min(UNSETTLED * known.len() as f64) as usize;
        self.forward(corner, known.iter_mut());
        if both_ways {
            self.forward(corner, known.iter_mut().rev());
            let end = known.len() - unsettled;
            known[end..].fill(f64::NAN);
        }
        known[..unsettled].fill(f64::NAN);
        filtered
    }
}

/// The unchanged motion at even times, among which are those of the candidate's samples.
struct EvenRows {
    /// s.
    interval: f64,
    /// Number of rows before the first sample.
    before: usize,
    /// The observed channels; NaN where the motion is unknown.
    values: ObservedValues,
    /// Row of each sample of the candidate.
    places: Vec<usize>,
}

impl EvenRows {
    /// Rows up to the last sample; `None` if the samples are not even.
    fn of(evidence: &Evidence<'_>, seen: &Observation) -> Option<EvenRows> {
        let (interval, first) = (seen.interval?, *seen.time.first()?);
        let before = MOST_AVERAGED;
        let place = |time: &f64| {
            let number = (time - first) / interval;
            let is_even = (number - number.round()).abs() <= UNEVEN && number <= MOST_ROWS as f64;
            is_even.then_some(number.round() as usize + before)
        };
        let places: Vec<usize> = seen.time.iter().map(place).collect::<Option<_>>()?;
        let count = places.last().map(|last| last + 1).filter(|count| *count <= MOST_ROWS)?;
        let time = |row: usize| first + (row as f64 - before as f64) * interval;
        let times: Vec<f64> = (0..count).map(time).collect();
        Some(EvenRows {
            interval,
            before,
            values: evidence.unchanged_case_at(&times)?,
            places,
        })
    }

    /// Channels at the candidate's samples, by a function of all rows of a channel.
    fn sampled(&self, process: impl Fn(&[f64]) -> Vec<f64>) -> ObservedValues {
        let each = self.values.iter().map(|rows| {
            let processed = process(rows);
            self.places.iter().map(|&row| processed[row]).collect()
        });
        each.collect()
    }

    fn filtered(&self, filter: Filter, both_ways: bool, corner: f64) -> ObservedValues {
        self.sampled(|rows| {
            let (before, rows) = rows.split_at(self.before);
            [before, &filter.filtered(both_ways, corner, rows)].concat()
        })
    }

    /// Means by the sums of the rows of each channel, from the first row that is known.
    fn averaged(&self, sums: &[(usize, Vec<f64>)], count: usize, place: MeanPlace) -> ObservedValues {
        let after = if place == MeanPlace::Last { 0 } else { (count - 1) / 2 };
        let of_channel = |(known, sums): &(usize, Vec<f64>)| {
            // NaN if not all of the rows are known.
            let mean = |&row: &usize| {
                let mut end = (row + after + 1).checked_sub(*known)?;
                let mut begin = end.checked_sub(count);
                if place == MeanPlace::Padded {
                    end = end.min(sums.len() - 1);
                    begin = Some(begin.unwrap_or(0).max(self.before.saturating_sub(*known)));
                }
                Some((sums.get(end)? - sums.get(begin?)?) / count as f64)
            };
            self.places.iter().map(|row| mean(row).unwrap_or(f64::NAN)).collect()
        };
        sums.iter().map(of_channel).collect()
    }

    fn sums(&self) -> Vec<(usize, Vec<f64>)> {
        let of_channel = |values: &Vec<f64>| {
            let known = values.iter().position(|value| value.is_finite());
            let known = known.unwrap_or(values.len());
            let sums = values[known..].iter().scan(0.0, |sum, value| {
                *sum += value;
                Some(*sum)
            });
            (known, [0.0].into_iter().chain(sums).collect())
        };
        self.values.iter().map(of_channel).collect()
    }
}

/// Channels of the candidate's own columns that the processed values bring closer to the candidate than `plain` ones
/// do, with the mean squares that are left then, in parts of the sizes; `None` if there are none.
fn closer(seen: &Observation, plain: &ObservedValues, processed: &ObservedValues) -> Option<(f64, Vec<bool>)> {
    let mut left = 0.0;
    let mut which = vec![false; seen.channels.len()];
    for channel in seen.columns() {
        let [plain, processed] = [plain, processed].map(|values| seen.left_in(channel, &values[channel]));
        which[channel] = processed < plain;
        left += if which[channel] { processed } else { plain };
    }
    which.contains(&true).then_some((left, which))
}

/// A value with four digits or more before the point.
fn four_digits(value: f64) -> String {
    let decimals = (3.0 - value.abs().log10().floor()).clamp(0.0, 12.0);
    format!("{value:.*}", decimals as usize)
}

impl FiledRows {
    /// Rows of which only these channels, and those that follow from them in the candidate's file, are processed.
    fn of(
        evidence: &Evidence<'_>,
        filing: Filing,
        which: Vec<bool>,
        plain: &ObservedValues,
        processed: &ObservedValues,
    ) -> Option<FiledRows> {
        let columns = plain.iter().zip(processed).zip(&which);
        let mut values: ObservedValues = columns
            .map(|((plain, processed), which)| if *which { processed } else { plain }.clone())
            .collect();
        evidence.observation?.derive(&mut values, evidence.physics);
        Some(FiledRows { filing, which, values })
    }

    /// Each column is the channel that is closest to it, if no two are the same one.
    fn swapped(evidence: &Evidence<'_>, seen: &Observation) -> Option<FiledRows> {
        let columns: Vec<usize> = seen.columns().collect();
        let mut places: Vec<usize> = (0..seen.channels.len()).collect();
        for &channel in &columns {
            let left = |of: &usize| seen.left_in(channel, &seen.reference[*of]);
            let closest = columns.iter().copied().min_by(|a, b| left(a).total_cmp(&left(b)));
            // A column that is equal to its own channel is not another.
            places[channel] = closest.filter(|of| left(of) < left(&channel)).unwrap_or(channel);
        }
        let mut sorted = places.clone();
        sorted.sort_unstable();
        let is_exchange = sorted.iter().enumerate().all(|(place, of)| place == *of) && sorted != places;
        let which = places.iter().enumerate().map(|(place, of)| place != *of).collect();
        let moved = places.iter().map(|&of| seen.reference[of].clone()).collect();
        FiledRows::of(evidence, Filing::Swapped, which, &seen.reference, &moved).filter(|_| is_exchange)
    }

    /// Channels that are off by their mean difference.
    fn offset(evidence: &Evidence<'_>, seen: &Observation) -> Option<FiledRows> {
        let channels = 0..seen.channels.len();
        let constants: Vec<f64> = channels.clone().map(|channel| seen.mean_off(channel)).collect();
        let each = seen.reference.iter().zip(&constants);
        let moved = each.map(|(values, constant)| values.iter().map(|value| value + constant).collect());
        let moved: ObservedValues = moved.collect();
        let is_off = |channel: usize| {
            let left = [&moved, &seen.reference].map(|values| seen.left_in(channel, &values[channel]));
            seen.is_column(channel) && left[0] <= OF_CONSTANT * left[1] && constants[channel] != 0.0
        };
        let which: Vec<bool> = channels.map(is_off).collect();
        let any = which.contains(&true);
        FiledRows::of(evidence, Filing::Offset(constants), which, &seen.reference, &moved).filter(|_| any)
    }

    fn repeated(evidence: &Evidence<'_>, seen: &Observation) -> Option<FiledRows> {
        let filing = Filing::Repeated(seen.repeated?);
        let held = evidence.unchanged_case_at(&seen.since)?;
        FiledRows::of(evidence, filing, vec![true; held.len()], &held, &held)
    }

    /// Half of the interval of the samples, or what the samples show, on the likelier side.
    fn half_step(evidence: &Evidence<'_>, seen: &Observation) -> Option<FiledRows> {
        let half = 0.5 * seen.interval?;
        let is_speed = |&channel: &usize| {
            let dimension = seen.channels[channel].dimension();
            matches!(dimension, Dimension::AngularVelocity | Dimension::Velocity)
        };
        let (speeds, others): (Vec<usize>, Vec<usize>) = seen.columns().partition(is_speed);
        if speeds.is_empty() || others.is_empty() {
            return None;
        }
        let which: Vec<bool> = (0..seen.channels.len()).map(|k| speeds.contains(&k)).collect();
        let plain = evidence.unchanged_case_at(&seen.time)?;
        let with = |late: f64| {
            let times: Vec<f64> = seen.time.iter().map(|time| time + late).collect();
            let later = evidence.unchanged_case_at(&times)?;
            FiledRows::of(evidence, Filing::HalfStep(late), which.clone(), &plain, &later)
        };
        let left = |rows: &FiledRows| seen.left(&rows.values, f64::INFINITY);
        let sides = [-half, half].into_iter().filter_map(|late| Some((late, with(late)?)));
        let (begin, best) = sides.min_by(|a, b| left(&a.1).total_cmp(&left(&b.1)))?;
        if left(&best) > (1.0 - PROMISING) * seen.left(&seen.reference, f64::INFINITY) {
            return None;
        }
        let play = |late: f64, _: f64| Some(with(late)?.played(evidence));
        let shown = fitted(evidence, begin, half, &play).and_then(with);
        // The fitted value has to be clearly better.
        let better = shown.filter(|shown| 2.0 * left(shown) < left(&best));
        Some(better.unwrap_or(best))
    }

    /// The number of samples with which the averages are closest to the candidate.
    fn average(evidence: &Evidence<'_>, rows: &EvenRows, plain: &ObservedValues) -> Option<FiledRows> {
        let seen = evidence.observation?;
        let sums = rows.sums();
        let left = |count: usize, place: MeanPlace| closer(seen, plain, &rows.averaged(&sums, count, place));
        let best = |counts: Vec<usize>, places: &[MeanPlace]| {
            let mut each = Vec::new();
            for count in counts {
                each.extend(places.iter().map(|&place| (left(count, place), count, place)));
            }
            let each = each
                .into_iter()
                .filter_map(|(left, count, place)| Some((left?, count, place)));
            each.min_by(|a, b| a.0.0.total_cmp(&b.0.0))
        };
        // Large numbers are tried at intervals, then those around the best.
        let next = |count: &usize| Some((count + 1).max(count * 17 / 16)).filter(|count| *count <= MOST_AVERAGED);
        let places = [MeanPlace::Last, MeanPlace::Middle, MeanPlace::Padded];
        let (_, about, place) = best(std::iter::successors(Some(2), next).collect(), &places)?;
        let near = about - about / 16..=(about + about / 16).min(MOST_AVERAGED);
        let ((_, which), count, place) = best(near.collect(), &[place])?;
        let averaged = rows.averaged(&sums, count, place);
        FiledRows::of(evidence, Filing::Average(count, place), which, plain, &averaged)
    }

    /// A filter with the corner that brings it closest to the candidate.
    fn low_pass(
        evidence: &Evidence<'_>,
        rows: &EvenRows,
        plain: &ObservedValues,
        (filter, both_ways): (Filter, bool),
    ) -> Option<FiledRows> {
        let seen = evidence.observation?;
        let columns = seen.columns();
        let unfiltered: f64 = columns.map(|channel| seen.left_in(channel, &plain[channel])).sum();
        let with = |corner: f64| {
            let filtered = rows.filtered(filter, both_ways, corner);
            let (left, which) = closer(seen, plain, &filtered)?;
            Some((left, which, filtered))
        };
        let left = |corner: f64| with(corner).map_or(f64::INFINITY, |(left, ..)| left);
        let corners = std::iter::successors(Some(HIGHEST), |corner| Some(FINER * corner));
        let corners = corners.take_while(|corner| *corner > LOWEST);
        let tried = corners.map(|corner| (left(corner), corner));
        let (best, begin) = tried.min_by(|a, b| a.0.total_cmp(&b.0))?;
        if best > (1.0 - PROMISING) * unfiltered {
            return None;
        }
        let corner = golden((FINER * begin).ln(), (begin / FINER).min(HIGHEST).ln(), |ln| {
            left(ln.exp())
        })
        .exp();
        let (_, which, filtered) = with(corner)?;
        let filing = Filing::LowPass(filter, both_ways, corner / rows.interval);
        FiledRows::of(evidence, filing, which, plain, &filtered)
    }

    fn played(&self, evidence: &Evidence<'_>) -> Played {
        Played {
            values: self.values.clone(),
            events: evidence.reference.to_vec(),
            steps: 0,
        }
    }

    /// Names of the channels that are processed: "phi1 and phi1_dot", or "each column".
    fn names(&self, search: &Search<'_>) -> String {
        let Some(seen) = search.evidence.observation else {
            return String::new();
        };
        let (named, others): (Vec<usize>, Vec<usize>) = seen.columns().partition(|&channel| self.which[channel]);
        if named.len() > 2 && others.is_empty() {
            return "each column".to_owned();
        }
        let names = named
            .into_iter()
            .map(|k| search.shown.candidate.name_of(seen.channels[k]));
        names.collect::<Vec<_>>().join(" and ")
    }
}

impl Cause for FiledRows {
    fn propose(search: &Search<'_>) -> Vec<Proposal> {
        let evidence = search.evidence;
        let Some(seen) = evidence.observation else {
            return Vec::new();
        };
        let mut all = vec![
            FiledRows::swapped(evidence, seen),
            FiledRows::offset(evidence, seen),
            FiledRows::repeated(evidence, seen),
            FiledRows::half_step(evidence, seen),
        ];
        if let Some(rows) = EvenRows::of(evidence, seen) {
            let plain = rows.sampled(<[f64]>::to_vec);
            all.push(FiledRows::average(evidence, &rows, &plain));
            let filters = [Filter::Steps, Filter::Lines, Filter::Butterworth];
            let filters = filters.map(|filter| [(filter, false), (filter, true)]).concat();
            all.extend(over_processors(filters.len(), &|| false, |k| {
                FiledRows::low_pass(evidence, &rows, &plain, filters[k])
            }));
        }
        proposals(all.into_iter().flatten())
    }

    fn run(&self, evidence: &Evidence<'_>, _: usize) -> Option<Played> {
        Some(self.played(evidence))
    }

    /// By its samples: the events that are found in them are those of the processing.
    fn judge(&self, evidence: &Evidence<'_>, played: &Played) -> Option<Judged> {
        let judged = evidence.judged(played, f64::INFINITY)?.by_samples_if(true);
        Some(match self.filing {
            Filing::Offset(_) => judged.by_constants(),
            _ => judged,
        })
    }

    fn least(&self, _: &Evidence<'_>) -> f64 {
        1.0 - ALL
    }

    fn complexity(&self, _: &Evidence<'_>) -> usize {
        match self.filing {
            Filing::Swapped | Filing::Repeated(_) => 0,
            Filing::Offset(_) => self.which.iter().filter(|which| **which).count(),
            Filing::HalfStep(_) | Filing::Average(..) | Filing::LowPass(..) => 1,
        }
    }

    fn is_of_file(&self) -> bool {
        true
    }

    /// No mistake of the motion leaves as little by chance.
    fn is_certain(&self, _: &Evidence<'_>, judged: &Judged) -> bool {
        judged.explained >= EXACT
    }

    fn has_events(&self, _: &Judged) -> bool {
        false
    }

    fn words(&self, search: &Search<'_>) -> (CauseKind, String) {
        let names = self.names(search);
        match &self.filing {
            Filing::Swapped => (CauseKind::SwappedColumns, format!("the columns {names} are exchanged")),
            Filing::Offset(constants) => {
                let channels = search.evidence.observation.map_or(&[][..], |seen| &seen.channels);
                let off = channels.iter().zip(constants).zip(&self.which);
                let each = off.filter(|(_, which)| **which).map(|((&channel, constant), _)| {
                    let unit = search.evidence.physics.vocabulary().unit(channel);
                    format!(
                        "{} is off by {constant:.4e} {unit}",
                        search.shown.candidate.name_of(channel)
                    )
                });
                (CauseKind::ChannelOffset, each.collect::<Vec<_>>().join(" and "))
            }
            Filing::Repeated(times) => {
                let words = format!("the values of each row stand in {times} successive rows, while the time goes on");
                (CauseKind::RepeatedRows, words)
            }
            Filing::HalfStep(late) => {
                let side = if *late > 0.0 { "after" } else { "before" };
                let words = format!(
                    "its speeds are those of {:.3e} s, half a step, {side} its positions, as the leap-frog method stores them",
                    late.abs()
                );
                (CauseKind::HalfStep, words)
            }
            Filing::Average(count, place) => {
                let place = match place {
                    MeanPlace::Last => "which ends at the row",
                    MeanPlace::Middle => "centred at the row",
                    MeanPlace::Padded => "centred at the row, with zeros beyond the ends of the file",
                };
                (
                    CauseKind::MovingAverage,
                    format!("{names}: a moving average of {count} samples, {place}"),
                )
            }
            Filing::LowPass(filter, both_ways, corner) => {
                let order = if *filter == Filter::Butterworth { 2 } else { 1 };
                let ways = if *both_ways { ", forward and backward" } else { "" };
                let corner = four_digits(*corner);
                let words = format!("{names}: a low-pass filter of order {order} with its corner at {corner} Hz{ways}");
                (CauseKind::LowPassFilter, words)
            }
        }
    }
}

/// Other mistakes that explain as much as the first of `all`, which is a mistake of the file. Mistakes of the file are
/// returned in words. The first one of the motion becomes a diagnosis, which says that `name` and it look alike.
pub(super) fn beside(search: &Search<'_>, name: &str, all: &[Tried], causes: &mut Causes) -> String {
    let (of_file, of_motion): (Vec<Tried>, Vec<Tried>) =
        all[1..].iter().cloned().partition(|tried| tried.cause.is_of_file());
    let is_two = |other: &Tried| other.cause.stepper().is_some() && !other.cause.numbers().is_empty();
    if let Some(other) = of_motion.first().filter(|other| !is_two(other)) {
        let (kind, words) = match other.cause.numbers() {
            [] => other.cause.words(search),
            _ => other.cause.report(search, &of_motion, causes),
        };
        let words = format!("{words}; {name} and this cannot be told apart by what the candidate shows");
        causes.said.push(Diagnosis::tried(kind, words, other.judged.explained));
    }
    let mut named = vec![all[0].cause.words(search).0];
    let mut text = String::new();
    for tried in of_file {
        let (kind, words) = tried.cause.words(search);
        if !named.contains(&kind) {
            text += &format!("; as much is explained by {}: {words}", kind.name());
            named.push(kind);
        }
    }
    text
}
