//! The verdict of a comparison in short: whether the runs agree or where they part, the likely cause, what to do next.

use super::causes::CLOSE;
use super::comparison::{Comparison, Unexplained};
use super::diagnosis::{CauseKind, percent};
use super::event_errors::{CycleErrors, EventError};
use super::follows::Follows;
use super::states::Phase;
use stickslip_system::record::sequence::{Difference, Fault};

/// Errors of all cycles that differ by less than this part of the largest are one constant.
const CONSTANT: f64 = 0.01;

/// A time with two digits: "1.0 ms", "0.14 s".
pub(crate) fn seconds(seconds: f64) -> String {
    const UNITS: [(f64, &str); 5] = [(1.0, "s"), (1e-3, "ms"), (1e-6, "us"), (1e-9, "ns"), (1e-12, "ps")];
    // 0.1 s and more are seconds, as people say it.
    let fits = |(size, unit): &&(f64, &str)| seconds.abs() >= if *unit == "s" { 0.1 } else { 0.9995 * size };
    let (size, unit) = UNITS.iter().find(fits).unwrap_or(&UNITS[4]);
    let value = seconds / size;
    match value.abs() {
        0.0 => "0 s".to_owned(),
        small if small < 1.0 => format!("{value:.2} {unit}"),
        middle if middle < 10.0 => format!("{value:.1} {unit}"),
        _ => format!("{value:.0} {unit}"),
    }
}

impl CycleErrors {
    /// Whether all errors are one constant.
    fn is_constant(&self) -> bool {
        let same = CONSTANT * self.largest;
        !self.drifts && self.scatter < same && (self.last - self.first).abs() < same
    }

    /// For example "constant error: every event is 0.14 s early"; `None` without a drift or a constant.
    fn words(&self) -> Option<String> {
        if self.drifts {
            let [per_cycle, first, last] = [self.per_cycle, self.first, self.last].map(signed);
            return Some(format!(
                "the error drifts by {per_cycle} per cycle, from {first} to {last}"
            ));
        }
        let side = if self.first < 0.0 { "early" } else { "late" };
        let by = seconds(self.first.abs());
        self.is_constant()
            .then(|| format!("constant error: every {} is {by} {side}", self.of))
    }
}

/// The fault of an event: "is missing".
pub(super) fn words_of(difference: &Difference) -> String {
    let words = match difference.fault {
        Fault::Missing => "is missing",
        Fault::Spurious => "is not in the reference",
        Fault::Doubled => "is there twice",
        Fault::Swapped => "has changed places with its neighbour",
        Fault::Renamed => return format!("is a {}", difference.candidate_kind.unwrap_or("different event")),
    };
    words.to_owned()
}

/// An error of an event, for example "0.14 s early".
fn off(error: f64) -> String {
    let side = if error < 0.0 { "early" } else { "late" };
    format!("{} {side}", seconds(error.abs()))
}

fn signed(time: f64) -> String {
    let sign = if time < 0.0 { "" } else { "+" };
    format!("{sign}{}", seconds(time))
}

impl Comparison {
    /// Two or three short lines.
    pub(super) fn find_summary(&mut self) {
        let lines = std::iter::once(self.agreement())
            .chain(self.likely_cause())
            .chain(self.next());
        self.summary = lines.collect();
    }

    /// Whether the events agree, or where they part.
    fn agreement(&self) -> String {
        let (errors, all) = (&self.event_errors, self.reference_events + self.uncovered);
        let cover = match self.uncovered {
            0 => String::new(),
            _ if self.reference_events == 0 => {
                return format!("The candidate covers none of the {all} events of the reference.");
            }
            _ => format!(" The candidate covers {} of {all} events.", self.reference_events),
        };
        let digits = self.digits();
        let states = digits.map(|digits| match digits {
            none if none < 0.0 => " The states do not agree.".to_owned(),
            one if one < 1.5 => " The states agree to one digit at most.".to_owned(),
            digits => format!(" The states agree to {digits:.0} digits."),
        });
        let states = states.unwrap_or_default();
        if let Some(first) = self.sequence.first() {
            return self.parted(first) + &cover;
        }
        let Some(max) = errors.max else {
            return match all {
                0 => format!("Neither run has an event.{states}"),
                _ => format!("No event could be compared.{states}"),
            };
        };
        let events = match errors.matched {
            1 => "The event agrees".to_owned(),
            all => format!("All {all} events agree"),
        };
        let times = match max {
            0.0 => "at the same times".to_owned(),
            _ => format!("within {}", seconds(max)),
        };
        let how = match &self.first_wrong {
            Some(wrong) => {
                let text = match errors.matched {
                    1 => "The event comes at another time".to_owned(),
                    all => format!("All {all} events come in the same order, but not at the same times"),
                };
                let cycles = self.cycles.as_ref().and_then(CycleErrors::words);
                let first = |error: f64| {
                    let (kind, time, off) = (wrong.kind, wrong.time, off(error));
                    format!("the {kind} at {time:.6} s is {off}")
                };
                let first = || wrong.error.map_or_else(|| wrong.words(), first);
                format!("{text}: {}.", cycles.unwrap_or_else(first))
            }
            None if self.agrees_to_resolution => {
                let bound = seconds(errors.largest_bound());
                format!("{events} {times}; the samples resolve {bound}.")
            }
            None => {
                let cycles = self.cycles.as_ref().filter(|_| !self.causes.is_empty());
                let cycles = cycles.and_then(CycleErrors::words);
                let cycles = cycles.map_or_else(String::new, |words| format!("; {words}"));
                format!("{events} {times}{cycles}.")
            }
        };
        how + &states + &cover
    }

    fn parted(&self, first: &Difference) -> String {
        let instead = if first.fault == Fault::Renamed { " instead" } else { "" };
        let what = words_of(first) + instead;
        let before = self.before(first.position);
        let (kind, time) = (first.kind, first.time);
        format!(
            "The events part: the {kind} at {time:.9} s {what} ({} missing, {} spurious).{before}",
            self.missing, self.spurious
        )
    }

    /// The matched events before this position in the reference's word: how close they are, or which goes wrong first.
    fn before(&self, position: usize) -> String {
        let before = || {
            self.event_errors
                .events
                .iter()
                .take_while(|event| event.position < position)
        };
        let largest = before().map(|event| event.error.abs()).fold(0.0, f64::max);
        let tolerance = self.first_wrong.as_ref().map_or(0.0, |wrong| wrong.tolerance);
        let wrong = |event: &&EventError| event.error.abs() > tolerance.max(event.bound);
        let wrong = before().find(wrong).filter(|_| largest > CLOSE * self.natural_period);
        let within = seconds(largest);
        match (before().count(), wrong) {
            (0, _) => String::new(),
            (_, Some(event)) => {
                let (kind, time) = (event.kind, event.time);
                let most = match seconds(event.error.abs()) == within {
                    true => String::new(),
                    false => format!(", and the largest error is {within}"),
                };
                format!(
                    " Before it, the {kind} at {time:.6} s is already {}{most}.",
                    off(event.error)
                )
            }
            (1, None) => format!(" The event before it is within {within}."),
            (count, None) => format!(" The {count} events before it are within {within}."),
        }
    }

    /// Fewest digits of a channel. Where some events match, segments of one run alone are not its states.
    fn digits(&self) -> Option<f64> {
        let counts = |phase: Phase| phase != Phase::Apart || self.event_errors.max.is_none();
        let rated = self.channels.iter().filter(|row| counts(row.phase));
        rated.filter_map(|row| row.mescd).min_by(f64::total_cmp)
    }

    fn likely_cause(&self) -> Option<String> {
        if let Some(first) = self.causes.first() {
            let brief = match first.brief.is_empty() {
                true => format!("{}.", first.evidence),
                false => first.brief.clone(),
            };
            return Some(format!("Likely cause: {}: {brief}", first.cause.name()));
        }
        let unexplained = self.unexplained.as_ref()?;
        let mut text = match self.out_of_time {
            Some(_) => "No cause was found in the time that was allowed".to_owned(),
            None if unexplained.too_few_samples => {
                "There are too few samples to name a cause of the difference".to_owned()
            }
            None => "No single cause explains the difference".to_owned(),
        };
        if let Some(begins) = unexplained.begins {
            text += &format!(", which begins at {begins:.6} s, {}", unexplained.during);
        }
        match &unexplained.follows {
            Some(Follows { holds: true, .. }) => text += ". Between its events it follows the equations",
            Some(Follows { channels, .. }) => {
                text += &format!(". It does not follow the equations of {}", channels.join(" and "))
            }
            None => {}
        }
        if let Some(interval) = self.within_an_interval() {
            let interval = seconds(interval);
            text += &format!(
                ". Every event is within one interval of the samples ({interval}), as with events at the ends of steps"
            );
        } else if let Some(closest) = unexplained.shown_closest() {
            let part = percent(closest.explained);
            let why_not = closest.why_not();
            text += &format!(". The closest is {} ({part} %){why_not}", closest.cause.name());
        }
        Some(text + ".")
    }

    /// The interval of the samples (s), if no event is missing or off by more.
    fn within_an_interval(&self) -> Option<f64> {
        let (max, interval) = (self.event_errors.max?, self.interval?);
        (self.sequence.is_empty() && max <= interval).then_some(interval)
    }

    fn next(&self) -> Option<String> {
        let what = match (self.causes.first(), &self.unexplained) {
            (Some(first), _) => first.cause.advice().to_owned(),
            (None, Some(unexplained)) if unexplained.too_few_samples && self.out_of_time.is_none() => {
                "write more samples, and compare again".to_owned()
            }
            (None, Some(_)) if self.within_an_interval().is_some() => CauseKind::EventsLate.advice().to_owned(),
            (
                None,
                Some(Unexplained {
                    would_tell: Some(more), ..
                }),
            ) => format!("add {more} to the candidate, which would tell more"),
            (None, Some(_)) if self.out_of_time.is_some() => "allow more time (--max-wall-time)".to_owned(),
            (None, Some(_)) => format!(
                "see where they part: stickslip plot {} --candidate {}",
                self.reference, self.candidate
            ),
            (None, None) => match &self.score_command {
                Some(command) => format!("score it by the rules of the set: {command}"),
                None if self.agrees_to_resolution => {
                    "give its events (--events FILE) to have the solver judged, not its sampling".to_owned()
                }
                None => return None,
            },
        };
        // A period would be part of a command.
        let end = if what.contains(": ") { "" } else { "." };
        Some(format!("Next: {what}{end}"))
    }
}
