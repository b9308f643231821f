//! The outcome of a comparison.

use super::attractor::Attractor;
use super::benchmark::BenchmarkScore;
use super::case_differences::CaseDifference;
use super::cycles::CycleErrors;
use super::detect::Detection;
use super::diagnosis::{Cause, Diagnosis, percent};
use super::energy::EnergyDrift;
use super::event_errors::EventErrors;
use super::follows::Follows;
use super::hysteresis::HysteresisEffect;
use super::impulse::ImpulseErrors;
use super::reference::{Physics, TimeScale};
use super::resolution::Resolution;
use super::score::Score;
use super::states::{StatePass, Tally};
use super::statistics::Statistic;
use super::windows::Phase;
use super::wrong_event::WrongEvent;
use super::{Channel, FoundOffset, OtherClock, OtherKick, OtherParameters};
use crate::record::sequence::{Difference, Fault};
use serde::Serialize;
use std::borrow::Cow;

/// How far a candidate agrees with its reference. Errors are candidate minus reference.
#[derive(Debug, Clone, Serialize)]
pub struct Comparison {
    /// The reference's file.
    pub reference: String,
    /// The candidate's file.
    pub candidate: String,
    /// "result file", "HDF5", "CSV", "NPZ", "OpenRadioss T01", "LS-DYNA binout", "Abaqus XY report" or "events table".
    pub format: &'static str,
    /// What its times resolve, where they are rounded.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resolution: Option<Resolution>,
    /// What was added to its times, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_offset: Option<f64>,
    /// What is to be added to its times by its events: what was added, or what is proposed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub found_time_offset: Option<FoundOffset>,
    /// In one line.
    pub verdict: String,
    /// What explains the differences, the most fundamental first.
    pub causes: Vec<Diagnosis>,
    /// It differs, and no change of the reference's run that was tried reproduces it. Written as `null` otherwise: whoever
    /// reads `causes` reads it next.
    pub unexplained: Option<Unexplained>,
    /// Keys of the case in which the two runs differ, in SI; empty if the candidate's case is unknown.
    pub case_differences: Vec<CaseDifference>,
    /// Of a candidate by another program: numbers of the case that it has otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub parameters: Option<OtherParameters>,
    /// Of the same: its kick, if it is another than the reference's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kick: Option<OtherKick>,
    /// Of the same: where its times count from, if from elsewhere. Its offset is an error, candidate minus reference.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clock: Option<OtherClock>,
    /// Where events were found in samples: the coarsest numbers that they follow from, if any are rounded.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub values: Option<String>,
    /// Where events were found in samples: all differences of the events are within what the samples resolve, and the samples have no
    /// other cause to differ.
    pub agrees_to_resolution: bool,
    /// How events were found by the relative velocity; `None` if the candidate states them.
    pub detection: Option<Detection>,
    /// What the hysteresis of the detection moves; `None` if it has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hysteresis: Option<HysteresisEffect>,
    /// The unit of its tolerance: "rad/s", or "m/s" in translation.
    #[serde(skip)]
    pub velocity_unit: &'static str,
    /// What the candidate covers; `None` for a table of events.
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
    /// The first event that is wrong, if one is.
    pub first_wrong: Option<WrongEvent>,
    /// Errors of the times of matched events.
    pub event_errors: EventErrors,
    /// The paper's numbers of both runs.
    pub statistics: Vec<Statistic>,
    /// Errors of the samples that depend on no threshold; `None` of a table of events.
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
    /// Whether the reference's equations were integrated again between samples in more than one step, or its run was repeated to have
    /// its states where its samples are too sparse.
    pub reference_repeated: bool,
    /// Whether its run was repeated.
    #[serde(skip)]
    pub was_rerun: bool,
    /// The energy balance of the candidate's own channels, if it has the twists, their rates and the rotor speed.
    pub energy_drift: Option<EnergyDrift>,
    /// By which times are measured; `None` of a system that slows down by itself, which has its natural period.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_scale: Option<TimeScale>,
    /// Of a system that does not slow down by itself: how the errors of events grow, if there are some cycles.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cycles: Option<CycleErrors>,
    /// Of the same: the periodic motion of reference and candidate, each `None` where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub attractors: Option<[Option<Attractor>; 2]>,
    /// What is not here, with the reason.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub absent: Vec<Absent>,
    /// Of a problem of a benchmark set: what the set's own rules say.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub benchmark: Option<BenchmarkScore>,
}

/// Something that a comparison does not have.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Absent {
    /// Its name.
    pub what: String,
    /// Why.
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
    /// Where it begins, s: the first sample that is a thousandth of its channel's size off, or the first event that is wrong.
    pub begins: Option<f64>,
    /// The root mean square of the differences of the samples, in parts of the sizes of their channels; `None` of events alone.
    pub difference: Option<f64>,
    /// What the contact of the reference does there: "in stick", "in slip", "before the first event".
    pub during: &'static str,
    /// Whether its samples follow the reference's equations between its events; `None` if they do not show the whole state.
    pub follows: Option<Follows>,
    /// What would tell more.
    pub would_tell: Option<String>,
    /// What came closest; `None` if nothing could be run.
    pub closest: Option<Closest>,
    /// The other causes that were tried, each at its best, the closest first.
    pub ruled_out: Vec<Closest>,
}

/// A change of the reference's run that does not reproduce the candidate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Closest {
    /// What it would be.
    pub cause: Cause,
    /// Part of the squared difference that it takes away; negative if it adds to it.
    pub explained: f64,
}

/// The part of the reference that a candidate covers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Span {
    /// s.
    pub from: f64,
    /// s.
    pub to: f64,
    /// Whether it begins before the reference's first event.
    pub from_start: bool,
    /// Whether it ends after the reference's last event.
    pub to_end: bool,
}

/// The errors of one channel in one phase.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChannelErrors {
    /// What part of the run.
    pub phase: Phase,
    /// The channel's name in /trajectory.
    pub channel: Cow<'static, str>,
    /// Its SI unit.
    pub unit: &'static str,
    /// How many were compared.
    pub samples: u64,
    /// Largest absolute error, in `unit`.
    pub max: f64,
    /// The candidate's time of it, s.
    pub max_at: f64,
    /// Root mean square of the error, in `unit`.
    pub rms: f64,
    /// -log10 of the largest error in parts of the largest |reference| of the phase; 17 if there is no error.
    pub scd: Option<f64>,
    /// -log10 of the largest |error|/(size + |reference|), with the channel's natural size; 17 if there is no error.
    pub mescd: Option<f64>,
}

impl Comparison {
    /// What a motion that does not come to its end by itself should have and this does not, and why. `lacking` are the channels of
    /// the state that the candidate has not.
    pub(super) fn find_absent(&mut self, lacking: &[Cow<'static, str>]) {
        let Some([reference, candidate]) = self.attractors else {
            return;
        };
        let mut add = |what: &str, why: &str| {
            self.absent.push(Absent::of((what, why)));
        };
        if reference.is_some() {
            add(
                "final_stick",
                "a motion in cycles has no last stick: period, sticks in a period and amplitude are compared instead",
            );
        }
        match (reference, candidate) {
            (Some(_), Some(candidate)) if candidate.amplitude.is_none() => {
                let why = "the candidate has no column of the position over its last period";
                add("amplitude", why);
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
        } else if self.energy_drift.is_none() {
            let why = match lacking {
                [] => "the samples are nowhere eight to a natural period, or an energy is beyond the largest number"
                    .to_owned(),
                _ => format!("the candidate has no {}", lacking.join(", ")),
            };
            add("energy_drift", &why);
        }
    }

    /// One line: whether the sequences agree, else where they part; how far the times agree; and the likely cause.
    pub(super) fn find_verdict(&mut self, quick: bool) {
        // Without a search for causes nobody knows whether the samples agree.
        self.agrees_to_resolution = !quick
            && self.detection.is_some()
            && self.sequence.iter().all(|difference| difference.shorter_than_interval)
            && self.event_errors.matched > 0
            && self.event_errors.within() == self.event_errors.matched
            && self.causes.is_empty()
            && self.unexplained.is_none();
        let (errors, uncovered) = (&self.event_errors, self.uncovered);
        let (covered, of_all) = (self.reference_events, self.reference_events + uncovered);
        let mut text = match self.sequence.first() {
            None => match errors.matched {
                0 if uncovered > 0 => format!("the candidate covers none of the reference's {of_all} events"),
                0 => "neither run has an event".to_owned(),
                _ => "the event sequences agree".to_owned(),
            },
            Some(first) => {
                let what = match first.fault {
                    Fault::Missing => "is missing".to_owned(),
                    Fault::Spurious => "is not in the reference".to_owned(),
                    Fault::Doubled => "is there twice".to_owned(),
                    Fault::Swapped => "has changed places with its neighbour".to_owned(),
                    Fault::Renamed => format!("is a {}", first.candidate_kind.unwrap_or("different event")),
                };
                let (position, kind, time) = (first.position, first.kind, first.time);
                let unseen = match self.sequence.iter().filter(|d| d.shorter_than_interval).count() {
                    0 => String::new(),
                    all if all == self.sequence.len() => {
                        ", of a motion shorter than the interval of the samples, as are all differences".to_owned()
                    }
                    some => format!(
                        "; {some} of {} differences are of motions shorter than the interval of the samples",
                        self.sequence.len()
                    ),
                };
                format!("the event sequences part at event {position}: the {kind} at {time:.9} s {what}{unseen}")
            }
        };
        if covered > 0 && uncovered > 0 {
            text += &format!(" (the candidate covers {covered} of {of_all} events)");
        }
        if let Some(max) = errors.max {
            text += &match max {
                0.0 => "; matched events have the same times".to_owned(),
                _ => format!("; matched events are within {max:.1e} s"),
            };
            // What is below the resolution of a file is no error of a solver.
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
        let worst = self.channels.iter().filter_map(|row| Some((row, row.mescd?)));
        match worst.min_by(|a, b| a.1.total_cmp(&b.1)) {
            // The error of a channel is larger than its values.
            Some((row, digits)) if digits < 0.0 => {
                let (channel, max, unit) = (&row.channel, row.max, row.unit);
                text += &format!(
                    "; states do not agree: {channel} is off by {max:.1e} {unit} at {:.6} s",
                    row.max_at
                );
            }
            Some((_, digits)) if errors.max.is_none() => text += &format!("; states agree to {digits:.1} digits"),
            _ => {}
        }
        if let Some(first) = self.causes.first() {
            text += &format!("; likely cause: {}: {}", first.cause.name(), first.evidence);
        } else if let Some(unexplained) = &self.unexplained {
            text += "; no single cause explains the difference";
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
            if let Some(Closest { cause, explained }) = unexplained.closest.filter(|closest| closest.explained > 0.01) {
                text += &format!(
                    "; the closest, {}, explains {} % of the squared difference",
                    cause.name(),
                    percent(explained)
                );
                if explained >= super::hypotheses::EXPLAINED {
                    text += ", which is not enough for it, or its events are elsewhere, or others do as well";
                }
            }
            let is_named = unexplained.closest.is_some_and(|closest| closest.explained > 0.01);
            let less = |other: &&Closest| {
                unexplained
                    .closest
                    .is_some_and(|closest| other.explained < closest.explained)
            };
            let others = unexplained
                .ruled_out
                .iter()
                .filter(less)
                .map(|other| other.cause.name());
            let others: Vec<&str> = others.filter(|_| is_named).collect();
            if !others.is_empty() {
                let verb = if others.len() == 1 { "explains" } else { "explain" };
                text += &format!("; {} {verb} less", others.join(", "));
            }
            if let Some(more) = &unexplained.would_tell {
                text += &format!("; {more} would tell more");
            }
        }
        self.verdict = text;
    }
}

/// The errors of the channels in each phase that has samples.
pub(super) fn channel_errors(pass: &StatePass<'_>, physics: &Physics) -> Vec<ChannelErrors> {
    let of_phase = |phase: Phase| {
        let tallies = pass.channels.iter().zip(&pass.tallies[phase as usize]);
        let errors = move |(&channel, tally): (&Channel, &Tally)| ChannelErrors {
            phase,
            channel: channel.name(),
            unit: physics.vocabulary().unit(channel),
            samples: tally.samples,
            max: tally.max,
            max_at: tally.max_at,
            rms: tally.rms(),
            scd: tally.scd(),
            mescd: tally.mescd(),
        };
        tallies.filter(|(_, tally)| tally.samples > 0).map(errors)
    };
    Phase::ALL.into_iter().flat_map(of_phase).collect()
}
