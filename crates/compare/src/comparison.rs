//! The outcome of a comparison, its verdict, and requirements on it: `onset<1e-6`.

use super::causes::EXPLAINED;
use super::detect::{Detection, HysteresisEffect};
use super::diagnosis::{CaseDifference, CauseKind, Diagnosis, percent};
use super::error::OutOfTime;
use super::event_errors::{CycleErrors, EventErrors, WrongEvent};
use super::follows::Follows;
use super::integrals::{EnergyDrift, ImpulseErrors};
use super::reference::{Physics, TimeScale};
use super::resolution::Resolution;
use super::score::Score;
use super::states::{Phase, StatePass, Tally};
use super::statistics::{ComparedAttractor, OF_ATTRACTORS, STATISTICS, Statistic};
use super::summary::words_of;
use super::{Channel, FoundOffset, OtherClock, OtherKick, OtherParameters};
use serde::Serialize;
use std::borrow::Cow;
use stickslip_system::quote::shown;
use stickslip_system::record::sequence::Difference;
use stickslip_system::record::{Event, EventKind};

/// How far a candidate agrees with its reference. Errors are candidate minus reference.
#[derive(Debug, Clone, Serialize)]
pub struct Comparison {
    /// The reference's file.
    pub reference: String,
    /// Overrides with which the reference was run, in words.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub reference_changed: Vec<String>,
    /// The candidate's file.
    pub candidate: String,
    /// "result file", "HDF5", "CSV", "NPZ" or "events table".
    pub format: &'static str,
    /// Resolution of the candidate's times, if they are rounded.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resolution: Option<Resolution>,
    /// Offset that was added to the candidate's times, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_offset: Option<f64>,
    /// Offset found from the events: the one that was added, or a proposal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub found_time_offset: Option<FoundOffset>,
    /// Result in one line.
    pub verdict: String,
    /// The same in two or three short lines: whether the runs agree or where they part, the likely cause, what to do next.
    pub summary: Vec<String>,
    /// Causes of the differences, the most fundamental first.
    pub causes: Vec<Diagnosis>,
    /// A difference that none of the changes to the reference's run reproduces. Otherwise written as `null`, because
    /// readers of `causes` read it next.
    pub unexplained: Option<Unexplained>,
    /// Present if the search for causes was ended by its limit of wall time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub out_of_time: Option<OutOfTime>,
    /// Keys of the case in which the two runs differ, in SI; empty if the candidate's case is unknown.
    pub case_differences: Vec<CaseDifference>,
    /// Parameters of the case that differ in another program's candidate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub parameters: Option<OtherParameters>,
    /// Kick of another program's candidate, if it differs from the reference's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kick: Option<OtherKick>,
    /// Clock of another program's candidate, if its times have another origin. Its offset is an error, candidate minus
    /// reference.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clock: Option<OtherClock>,
    /// The coarsest rounding of the samples in which events were found, if they are rounded.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub values: Option<String>,
    /// Events were found in samples, all their differences are within the resolution of the samples, and the samples
    /// show no other cause.
    pub agrees_to_resolution: bool,
    /// Parameters of event detection by the relative velocity; `None` if the candidate states its events.
    pub detection: Option<Detection>,
    /// Effect of the hysteresis of the detection; `None` without hysteresis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hysteresis: Option<HysteresisEffect>,
    /// The reference's natural period, s.
    #[serde(skip)]
    pub natural_period: f64,
    /// Unit of the velocity tolerance: "rad/s", or "m/s" in translation.
    #[serde(skip)]
    pub velocity_unit: &'static str,
    /// Part of the reference that the candidate covers; `None` for an event table.
    pub span: Option<Span>,
    /// Mean interval of the candidate's samples in the reference's stick-slip, s.
    pub interval: Option<f64>,
    /// Events of the reference's word in the candidate's span.
    pub reference_events: usize,
    /// Events of the reference's word outside the candidate's span, which are neither matched nor missing.
    pub uncovered: usize,
    /// Events of the candidate's word.
    pub candidate_events: usize,
    /// Events of the reference that the candidate does not have.
    pub missing: usize,
    /// Events of the candidate that the reference does not have.
    pub spurious: usize,
    /// Where and how the words differ; empty if they are equal.
    pub sequence: Vec<Difference>,
    /// The first wrong event.
    pub first_wrong: Option<WrongEvent>,
    /// Errors of the times of matched events.
    pub event_errors: EventErrors,
    /// Statistics of the paper for both runs.
    pub statistics: Vec<Statistic>,
    /// Errors of the samples that depend on no threshold; `None` for an event table.
    pub score: Option<Score>,
    /// Errors of channels by phase.
    pub channels: Vec<ChannelErrors>,
    /// Errors of impulses.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub impulses: Vec<ImpulseErrors>,
    /// Samples of the candidate that were compared.
    pub samples: u64,
    /// Samples at an event, or in a segment that only one of the runs has.
    pub samples_outside: u64,
    /// Samples in gaps of the reference that are too wide to interpolate.
    pub samples_too_sparse: u64,
    /// Whether the reference's equations were integrated again between samples in more than one step, or its run was
    /// repeated where its samples are too sparse.
    pub reference_repeated: bool,
    /// Whether the reference's run was repeated.
    #[serde(skip)]
    pub was_rerun: bool,
    /// The energy balance of the candidate's own channels, if it has the twists, their rates and the rotor speed.
    pub energy_drift: Option<EnergyDrift>,
    /// The time scale; `None` for a system that slows down by itself, whose time scale is the natural period.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_scale: Option<TimeScale>,
    /// Growth of event errors in a system that does not slow down by itself, if there are enough cycles.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cycles: Option<CycleErrors>,
    /// Attractors of reference and candidate in a system that does not slow down by itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub attractors: Option<[Option<ComparedAttractor>; 2]>,
    /// Missing results, with the reasons.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub absent: Vec<Absent>,
    /// The command that scores the candidate by the rules of a benchmark set, if the reference is one of its problems.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub score_command: Option<String>,
}

/// A result that a comparison lacks.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Absent {
    /// Name of the result.
    pub what: String,
    /// Reason.
    pub why: String,
}

impl Absent {
    pub(super) fn of((what, why): (&str, &str)) -> Absent {
        let (what, why) = (what.to_owned(), why.to_owned());
        Absent { what, why }
    }
}

/// A difference without a cause.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Unexplained {
    /// Start of the difference, s: the first sample that is off by a thousandth of its channel's size, or the first
    /// wrong event.
    pub begins: Option<f64>,
    /// Root mean square of the differences of the samples, in parts of the channels' sizes; `None` without samples.
    pub difference: Option<f64>,
    /// Phase of the reference at that time: "in stick", "in slip", "before the first event".
    pub during: &'static str,
    /// Whether its samples follow the reference's equations between its events; `None` if they do not show the whole
    /// state.
    pub follows: Option<Follows>,
    /// Data that would help to find the cause.
    pub would_tell: Option<String>,
    /// The samples are too few to name a cause with fitted values.
    #[serde(skip)]
    pub too_few_samples: bool,
    /// The closest change; `None` if nothing could be run.
    pub closest: Option<Closest>,
    /// The other causes that were tried, each at its best, the closest first.
    pub ruled_out: Vec<Closest>,
}

impl Unexplained {
    /// The closest change, if it removes a part of the difference that is worth a word.
    pub(super) fn shown_closest(&self) -> Option<Closest> {
        let closest = self.closest.filter(|closest| closest.explained > 0.01);
        closest.filter(|_| !self.too_few_samples)
    }
}

/// A change of the reference's run that does not reproduce the candidate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Closest {
    /// The cause that the change stands for.
    pub cause: CauseKind,
    /// Part of the squared difference that the change removes; negative if it adds to it.
    pub explained: f64,
    /// Why it is no cause though it explains nearly all, in words.
    #[serde(skip)]
    pub why_not: &'static str,
}

impl Closest {
    /// Why it is no cause, if it explains nearly all.
    pub(super) fn why_not(&self) -> &'static str {
        if self.explained >= EXPLAINED { self.why_not } else { "" }
    }
}

/// The part of the reference that a candidate covers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Span {
    /// First time, s.
    pub from: f64,
    /// Last time, s.
    pub to: f64,
    /// Whether it begins before the reference's first event.
    pub from_start: bool,
    /// Whether it ends after the reference's last event.
    pub to_end: bool,
}

/// The errors of one channel in one phase.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChannelErrors {
    /// Phase of the run.
    pub phase: Phase,
    /// The channel's name in /trajectory.
    pub channel: Cow<'static, str>,
    /// Its SI unit.
    pub unit: &'static str,
    /// Number of compared samples.
    pub samples: u64,
    /// Largest absolute error, in `unit`.
    pub max: f64,
    /// Time of the largest error in the candidate, s.
    pub max_at: f64,
    /// Root mean square of the error, in `unit`.
    pub rms: f64,
    /// -log10 of the largest error relative to the largest |reference| of the phase; 17 without an error.
    pub scd: Option<f64>,
    /// -log10 of the largest |error|/(size + |reference|), with the channel's natural size; 17 without an error.
    pub mescd: Option<f64>,
}

impl Comparison {
    /// Notes missing results of a system that does not come to rest by itself, with reasons. `lacking` are the state's
    /// channels that the candidate lacks.
    pub(super) fn find_absent(&mut self, lacking: &[Cow<'static, str>]) {
        let Some([reference, candidate]) = self.attractors else {
            return;
        };
        let mut add = |what: &str, why: &str| self.absent.push(Absent::of((what, why)));
        if reference.is_some() {
            let why =
                "a motion in cycles has no last stick: period, sticks in a period and amplitude are compared instead";
            add("final_stick", why);
        }
        match (reference, candidate) {
            (Some(_), Some(ComparedAttractor { amplitude: None, .. })) => {
                add(
                    "amplitude",
                    "the candidate has no column of the position over its last period",
                );
            }
            (Some(_), None) => {
                let why = "its last two periods do not agree to 1e-4, or are not in what it covers";
                add("attractor of the candidate", why);
            }
            (None, _) => {
                let why = "its run does not repeat itself by the end, or was not run to it";
                add("attractor of the reference", why);
            }
            _ => {}
        }
        if self.span.is_none() {
            add("states", "the candidate is a table of events");
        } else if self.energy_drift.is_none() && lacking.is_empty() {
            let why = "the samples are nowhere eight to a natural period, or an energy is beyond the largest number";
            add("energy_drift", why);
        } else if self.energy_drift.is_none() {
            add("energy_drift", &format!("the candidate has no {}", lacking.join(", ")));
        }
    }

    /// Notes separations and contacts, in the reference's `events`, that a candidate without a normal force cannot show.
    pub(super) fn leave_out_contacts(&mut self, events: &[Event], span: Span) {
        let is_change = |event: &&Event| {
            matches!(event.kind, EventKind::Separation | EventKind::Contact)
                && (span.from..=span.to).contains(&event.time)
        };
        let count = events.iter().filter(is_change).count();
        if count > 0 {
            let why = format!("the candidate has no normal_force, which would show the {count} of the reference");
            self.absent.push(Absent::of(("separations and contacts", &why)));
        }
    }

    /// One line: whether the sequences agree or where they part, how far the times agree, and the likely cause.
    pub(super) fn find_verdict(&mut self, quick: bool, creeps: bool) {
        self.agrees_to_resolution = !quick
            && self.detection.is_some()
            && self.sequence.iter().all(|difference| difference.shorter_than_interval)
            && self.event_errors.matched > 0
            && self.event_errors.within() == self.event_errors.matched
            && self.causes.is_empty()
            && self.unexplained.is_none()
            && self.out_of_time.is_none();
        let (errors, uncovered) = (&self.event_errors, self.uncovered);
        let (covered, of_all) = (self.reference_events, self.reference_events + uncovered);
        let creep = self.score.as_ref().and_then(|score| score.creep).filter(|_| creeps);
        let creep = creep.map(|creep| creep.words());
        let mut text = match self.sequence.first() {
            _ if creep.is_some() && of_all == 0 => "the reference sticks throughout, and the candidate".to_owned(),
            None => match errors.matched {
                0 if uncovered > 0 => format!("the candidate covers none of the reference's {of_all} events"),
                0 => "neither run has an event".to_owned(),
                _ => "the event sequences agree".to_owned(),
            },
            Some(first) => {
                let what = words_of(first);
                let (position, kind, time) = (first.position, first.kind, first.time);
                let all = self.sequence.len();
                let unseen = match self.sequence.iter().filter(|d| d.shorter_than_interval).count() {
                    0 => String::new(),
                    some if some == all => {
                        ", of a motion shorter than the interval of the samples, as are all differences".to_owned()
                    }
                    some => {
                        format!("; {some} of {all} differences are of motions shorter than the interval of the samples")
                    }
                };
                format!("the event sequences part at event {position}: the {kind} at {time:.9} s {what}{unseen}")
            }
        };
        if let Some(creep) = &creep {
            text += match of_all {
                0 => " ",
                _ => "; in the stick that lasts to the end it ",
            };
            text += creep;
        }
        if covered > 0 && uncovered > 0 {
            text += &format!(" (the candidate covers {covered} of {of_all} events)");
        }
        if let Some(max) = errors.max {
            text += &match max {
                0.0 => "; matched events have the same times".to_owned(),
                _ => format!("; matched events are within {max:.1e} s"),
            };
            // A difference below the resolution of a file is no error of a solver.
            if self.agrees_to_resolution {
                let bound = errors.largest_bound();
                text += &format!(", below the resolution of its file, {bound:.1e} s: it agrees to its resolution");
                let times = self.resolution.as_ref().map(|resolution| ("times", &resolution.of));
                let values = self.values.as_ref().map(|values| ("values", values));
                let printed = times.into_iter().chain(values);
                let printed: Vec<String> = printed.map(|(what, of)| format!("its {what} are {of}")).collect();
                if !printed.is_empty() {
                    text += &format!(" ({})", printed.join(", "));
                }
            } else if let Some(resolution) = self.resolution.as_ref().filter(|r| r.events_below > 0 && max > 0.0) {
                let (below, of_file) = (resolution.events_below, resolution.event_error);
                if below < errors.matched {
                    text += &format!(", {below} of {}", errors.matched);
                }
                text += if below < errors.matched { " below" } else { ", below" };
                text += &format!(" the resolution of its file, {of_file:.1e} s");
            }
        }
        // Where some events match, segments of one run alone are not its states.
        let counts = |row: &&ChannelErrors| row.phase != Phase::Apart || errors.max.is_none();
        let rated = self
            .channels
            .iter()
            .filter(counts)
            .filter_map(|row| Some((row, row.mescd?)));
        match rated.min_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((worst, digits)) if digits < 0.0 => {
                let (channel, max, unit, max_at) = (&worst.channel, worst.max, worst.unit, worst.max_at);
                text += &format!("; states do not agree: {channel} is off by {max:.1e} {unit} at {max_at:.6} s");
            }
            Some((_, digits)) if errors.max.is_none() && creep.is_none() => {
                text += &format!("; states agree to {digits:.1} digits")
            }
            _ => {}
        }
        if let Some(first) = self.causes.first() {
            text += &format!("; likely cause: {}: {}", first.cause.name(), first.evidence);
        } else if let Some(unexplained) = &self.unexplained {
            text += match self.out_of_time {
                Some(_) => "; no cause was found of the difference",
                None if unexplained.too_few_samples => "; too few samples to name a cause of the difference",
                None => "; no single cause explains the difference",
            };
            if let Some(difference) = unexplained.difference {
                text += &format!(" of {difference:.1e} of the channels' sizes");
            }
            if let Some(begins) = unexplained.begins {
                text += &format!(", which begins at {begins:.6} s, {}", unexplained.during);
            }
            match &unexplained.follows {
                Some(Follows { holds: true, .. }) => {
                    text += "; between its events its samples follow the equations of the reference, so that it differs by \
                             its events or by how it begins";
                }
                Some(Follows { channels, from, .. }) => {
                    let from = from.map_or(String::new(), |from| format!(" from {from:.6} s on"));
                    text += &format!(
                        "; its samples do not follow the equations of {}{from}",
                        channels.join(" and ")
                    );
                }
                None => {}
            }
            if let Some(closest) = unexplained.shown_closest() {
                let (name, part) = (closest.cause.name(), percent(closest.explained));
                text += &format!("; the closest, {name}, explains {part} % of the squared difference");
                text += closest.why_not();
                let others = unexplained.ruled_out.iter();
                let others = others.filter(|other| other.explained < closest.explained);
                let others: Vec<&str> = others.map(|other| other.cause.name()).collect();
                match others.len() {
                    0 => {}
                    1 => text += &format!("; {} explains less", others[0]),
                    _ => text += &format!("; {} explain less", others.join(", ")),
                }
            }
            if let Some(more) = &unexplained.would_tell {
                text += &format!("; {more} would tell more");
            }
        }
        if let Some(out) = self.out_of_time {
            text += &out.words();
        }
        self.verdict = text;
        self.find_summary();
    }
}

pub(super) fn channel_errors(pass: &StatePass<'_>, physics: &Physics) -> Vec<ChannelErrors> {
    let of_phase = |phase: Phase| {
        let tallies = pass.channels.iter().zip(pass.tallies(phase));
        let errors = move |(&channel, tally): (&Channel, &Tally)| ChannelErrors {
            phase,
            channel: channel.name(),
            unit: physics.vocabulary().unit(channel),
            samples: tally.errors.samples,
            max: tally.errors.max,
            max_at: tally.errors.max_at,
            rms: tally.errors.rms(),
            scd: tally.scd(),
            mescd: tally.mescd(),
        };
        tallies.filter(|(_, tally)| tally.errors.samples > 0).map(errors)
    };
    Phase::ALL.into_iter().flat_map(of_phase).collect()
}

/// A bound on one number of a comparison.
#[derive(Debug, Clone, PartialEq)]
pub struct Requirement {
    text: String,
    metric: String,
    comparator: &'static str,
    bound: f64,
}

type Metric = fn(&Comparison) -> Option<f64>;

/// Metrics other than statistics: absolute errors, counts, and the fewest digits of any channel.
const METRICS: [(&str, Metric); 12] = [
    ("events", |c| c.event_errors.max),
    ("events_rms", |c| c.event_errors.rms),
    ("missing", |c| c.count(c.missing)),
    ("spurious", |c| c.count(c.spurious)),
    ("uncovered", |c| Some(c.uncovered as f64)),
    ("scd", |c| {
        c.channels.iter().filter_map(|row| row.scd).min_by(f64::total_cmp)
    }),
    ("mescd", |c| {
        c.channels.iter().filter_map(|row| row.mescd).min_by(f64::total_cmp)
    }),
    ("drift", |c| Some(c.cycles.as_ref()?.per_cycle.abs())),
    ("score_position", |c| {
        Some(c.score.as_ref()?.position.as_ref()?.relative)
    }),
    ("score_period", |c| Some(c.score.as_ref()?.period.as_ref()?.relative)),
    ("score_rest", |c| Some(c.score.as_ref()?.rest.as_ref()?.relative)),
    ("score_creep", |c| Some(c.score.as_ref()?.creep?.relative)),
];

impl Comparison {
    /// A number of events; `None` if the candidate covers none of the reference's.
    fn count(&self, events: usize) -> Option<f64> {
        let is_uncovered = self.reference_events == 0 && self.uncovered > 0;
        (!is_uncovered).then_some(events as f64)
    }
}

impl Requirement {
    /// Names of all metrics.
    pub fn metrics() -> impl Iterator<Item = &'static str> {
        let own = METRICS.into_iter().map(|metric| metric.0);
        own.chain(STATISTICS.map(|s| s.0)).chain(OF_ATTRACTORS)
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
                METRICS.map(|metric| metric.0).join(", "),
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

    /// The bounded number.
    fn value(&self, comparison: &Comparison) -> Option<f64> {
        if let Some((_, value)) = METRICS.iter().find(|metric| metric.0 == self.metric) {
            return value(comparison);
        }
        let mut statistics = comparison.statistics.iter();
        let statistic = statistics.find(|statistic| statistic.name == self.metric)?;
        statistic.error().map(f64::abs)
    }
}
