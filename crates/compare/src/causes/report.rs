//! The causes of a difference in a comparison: the evidence is collected, the search runs, and its result is said.

use super::evidence::{Evidence, TrialStart};
use super::kick::{JumpPass, OtherKick, other_kick};
use super::observation::{Observation, ObservationPass};
use super::parameters::OtherParameters;
use super::search::{FoundCauses, Search, Tried};
use super::smooth::Creep;
use super::steps;
use crate::candidate::Candidate;
use crate::clock::{FoundOffset, OtherClock};
use crate::comparison::{Closest, Span, Unexplained};
use crate::detect::{Detection, Found};
use crate::diagnosis::{CauseKind, Diagnosis, LAST_DIGIT, absolute_angles};
use crate::error::{Limit, OutOfTime};
use crate::follows::follows;
use crate::states::Grid;
use crate::{Channel, CompareError, Reference, survey};
use std::sync::atomic::Ordering;
use stickslip_case::WrittenCase;
use stickslip_system::record::EventKind;
use stickslip_system::record::sequence::{Alignment, SequenceEvent};

/// Root mean square difference of samples, in parts of the channels' sizes, that needs no explanation.
const SAMPLES_AGREE: f64 = 1e-6;
/// Difference of event times, in natural periods, that needs no explanation.
const EVENTS_AGREE: f64 = 1e-6;
/// A first sample is another state if it differs by more than this many times the root mean square of rounding.
const OF_ROUNDING: f64 = 10.0;
/// Natural periods before an onset without a kick at which its oscillation is still negligible.
const BEFORE_ONSET: f64 = 20.0;
const FEWEST_EVENTS: usize = 2;
/// Smallest effect of rounding, in parts of the difference, to be its cause.
const AMPLIFIED: f64 = 0.1;

/// Results of a comparison before the search.
pub(crate) struct Shown<'a> {
    pub candidate: &'a Candidate,
    /// Events of the reference, as far as the candidate can show them, and those that it covers.
    pub reference: &'a [SequenceEvent],
    pub covered: &'a [SequenceEvent],
    pub alignment: &'a Alignment,
    pub found: &'a [Found],
    pub grid: Grid,
    /// |omega_r| at which the candidate stands still outside the tolerance, rad/s.
    pub plateau: f64,
    pub creep: Option<Creep>,
    pub shows_contact: bool,
    pub limit: Limit,
    pub span: Span,
    pub word: &'a [SequenceEvent],
    pub offset: Option<FoundOffset>,
    pub bound: f64,
    /// Mean square effect of rounding on the samples, in parts of the channels' sizes.
    pub rounding: f64,
    /// Largest error of an event, s; infinite if the sequences differ.
    pub worst: Option<f64>,
    pub wrong: Option<f64>,
    /// |omega_r| up to which the contact sticks, rad/s.
    pub tolerance: f64,
    /// How its events were found in its samples; `None` if they were stated.
    pub detected: Option<Detection>,
}

/// Passes over a candidate of another program that collect the evidence.
pub(crate) struct Passes<'a> {
    pub jump: JumpPass<'a>,
    pub observation: ObservationPass,
}

/// The causes of a difference.
#[derive(Default)]
pub(crate) struct Causes {
    pub said: Vec<Diagnosis>,
    pub clock: Option<OtherClock>,
    pub kick: Option<OtherKick>,
    pub parameters: Option<OtherParameters>,
    pub unexplained: Option<Unexplained>,
    pub out_of_time: Option<OutOfTime>,
}

impl Reference {
    /// Searches the causes of a difference of another program's candidate. `watch` receives the mistakes tried and their
    /// number so far.
    pub(crate) fn causes(
        &self,
        shown: &Shown<'_>,
        passes: Option<Passes<'_>>,
        watch: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Causes, CompareError> {
        let (physics, span) = (&self.physics, shown.span);
        let period = physics.natural_period();
        let (mut jumped, mut first, mut observation) = (None, None, None);
        if let Some(passes) = passes {
            (jumped, first) = (passes.jump.finish(), passes.jump.first());
            observation = Some(passes.observation.finish(self)?);
        }
        let observation = observation.filter(Observation::overlaps);
        let of_values = observation.as_ref().map_or(0.0, Observation::rounding);
        let rounding = shown.rounding.max(of_values);
        // Without a kick the onset is amplified rounding, which no run repeats. Nothing has grown out of rounding some
        // periods before it.
        let onset = shown.reference.iter().chain(shown.word).map(|event| event.time);
        let is_noise = physics.amplifies() && physics.coasts() && physics.trains.kicks.is_empty();
        let known = onset.min_by(f64::total_cmp).map(|onset| onset - BEFORE_ONSET * period);
        let known = known
            .filter(|known| is_noise && *known > self.start)
            .unwrap_or(f64::INFINITY);
        let samples_agree = observation.as_ref().and_then(|observation| {
            // Behind an onset from noise no comparison is possible.
            let left = Some(observation.left(&observation.reference, known)).filter(|left| !left.is_nan())?;
            Some(left <= rounding.max(SAMPLES_AGREE * SAMPLES_AGREE))
        });
        let least = shown.bound.max(EVENTS_AGREE * period);
        let events_agree = shown.worst.is_none_or(|worst| worst <= least);
        // Creep is small beside the speeds that the force of a stick could give.
        let creeps = !events_agree && shown.creep.is_some() && self.last_stick().is_some();
        if samples_agree.unwrap_or(events_agree) && !creeps {
            return Ok(Causes::default());
        }
        // A single event is moved to its place by any change.
        if observation.is_none() && shown.word.len() < FEWEST_EVENTS {
            return Ok(Causes {
                unexplained: Some(self.unexplained(shown, None, Vec::new())),
                ..Causes::default()
            });
        }
        // The reference is unknown beyond its end.
        let last = shown.word.last().map_or(f64::NEG_INFINITY, |e| e.time);
        let to = match span.from < self.end {
            true => span.to.min(self.end),
            false => span.to.max(last),
        };
        let has_rows = shown.candidate.has_rows();
        let kick = match self.kick_event() {
            None => None,
            Some(kick) => self.kicks()?.into_iter().find(|(event, _)| *event == kick),
        };
        let kick = kick.map(|(event, states)| (event.time, states));
        let at_kick = kick
            .as_ref()
            .map(|(time, (_, after))| TrialStart::At(*time, after.clone()));
        let near = |time: f64| (time - period..time + period).contains(&span.from);
        let begins_at_kick = has_rows && kick.as_ref().is_some_and(|(time, _)| near(*time));
        let starts = match first.clone() {
            Some((time, state)) if time > self.start => vec![TrialStart::At(time, state), TrialStart::Case],
            Some((time, state)) => vec![TrialStart::Case, TrialStart::At(time, state)],
            None if begins_at_kick => at_kick.into_iter().chain([TrialStart::Case]).collect(),
            None => [TrialStart::Case]
                .into_iter()
                .chain(at_kick.filter(|_| !has_rows))
                .collect(),
        };
        let case = WrittenCase::of(&physics.case);
        let evidence = Evidence {
            physics,
            case: &case,
            observation: observation.as_ref(),
            word: shown.word,
            reference: shown.reference,
            covered: (if has_rows { span.from } else { f64::NEG_INFINITY }, to.min(known)),
            period,
            bound: shown.bound,
            detected: shown.detected,
            shows_contact: shown.shows_contact,
            least: SAMPLES_AGREE.max(OF_ROUNDING * rounding.sqrt()),
            is_smooth: known.is_finite(),
            begins: self.start,
            end: if to.is_finite() { to } else { self.end },
            starts,
            unchanged: Default::default(),
            first,
            origin: None,
            most_steps: None,
            kicked: kick.as_ref().map(|(time, _)| *time),
            limit: shown.limit,
            runs: Default::default(),
            before: Default::default(),
            found: Default::default(),
        }
        .prepared();
        let other = kick.as_ref().zip(jumped.as_ref());
        let other = other.and_then(|((time, states), jumped)| other_kick(physics, (*time, states), jumped));
        // The error of its own steps before its first sample is no other state.
        let apart = |seen: &Observation| seen.begins_apart().is_none_or(|part| part > evidence.least);
        let mut search = Search {
            evidence: &evidence,
            reference: self,
            shown,
            breakaway: self.breakaway(shown.found),
            onset: self.word.first().map(|event| event.time),
            jumped: jumped.as_ref(),
            with_steps: has_rows && !events_agree || !physics.coasts(),
            with_state: other.is_some() || observation.as_ref().is_none_or(apart),
            other_kick: other,
            watch,
            counts: Default::default(),
            tried: Vec::new(),
            too_few_samples: false,
        };
        let found = search.find();
        let mut causes = Causes::default();
        match found {
            FoundCauses::Causes(all) => {
                let (kind, mut words) = all[0].cause.report(&search, &all, &mut causes);
                if !all[0].cause.is_of_file() {
                    words += &search.others(kind, &all);
                }
                let brief = search.brief(kind, &all[0], &causes);
                let said = Diagnosis::tried(kind, words, all[0].judged.explained);
                causes.said.insert(0, Diagnosis { brief, ..said });
            }
            FoundCauses::Unexplained(tried) => {
                // Rounding is a cause if an instability amplifies it.
                let is_amplified = physics.coasts() && shown.grid.is_rounded();
                let part = is_amplified.then(|| steps::amplified(&evidence, LAST_DIGIT)).flatten();
                if let Some(part) = part.filter(|part| *part >= AMPLIFIED) {
                    causes.said.push(absolute_angles(physics, part));
                } else {
                    let mut each: Vec<Closest> = Vec::new();
                    for Tried { cause, judged, .. } in &tried {
                        let kind = cause.words(&search).0;
                        if each.iter().all(|known| known.cause != kind) {
                            each.push(Closest {
                                cause: kind,
                                explained: judged.explained,
                                why_not: judged.why_not(cause.least(&evidence)),
                            });
                        }
                    }
                    causes.unexplained = Some(Unexplained {
                        too_few_samples: search.too_few_samples,
                        ..self.unexplained(shown, observation.as_ref(), each)
                    });
                }
            }
        }
        causes.out_of_time = evidence.is_over().then(|| OutOfTime {
            allowed: shown.limit.allowed,
            tried: search.counts[0].load(Ordering::Relaxed),
            runs: evidence.runs.load(Ordering::Relaxed),
        });
        Ok(causes)
    }

    fn unexplained(&self, shown: &Shown<'_>, observation: Option<&Observation>, tried: Vec<Closest>) -> Unexplained {
        /// Samples in a natural period that reveal the equations.
        const PER_PERIOD: f64 = 20.0;
        let physics = &self.physics;
        let begins = match observation {
            Some(seen) => seen.time.get(seen.close(&seen.reference, 1e-3)).copied(),
            None => shown.wrong,
        };
        let before = begins.and_then(|begins| self.word.iter().rfind(|event| event.time <= begins));
        let lacking = physics.state.iter().filter(|&&channel| !shown.candidate.has(channel));
        let lacking: Vec<_> = lacking.map(|channel| channel.name()).collect();
        let dense = physics.natural_period() / PER_PERIOD;
        let mean = |seen: &Observation| Some((seen.time.last()? - seen.time.first()?) / seen.time.len() as f64);
        let interval = observation.and_then(|seen| seen.interval.or(mean(seen)));
        let sparse = interval.is_some_and(|interval| interval > dense);
        let mut tried = tried.into_iter();
        Unexplained {
            begins,
            difference: observation.map(|seen| seen.left(&seen.reference, f64::INFINITY).sqrt()),
            during: match before.map(|event| event.kind) {
                None => "before the first event",
                Some(EventKind::Stick) => "in stick",
                Some(EventKind::Separation) => "while the contact is open",
                Some(_) => "in slip",
            },
            follows: observation.and_then(|seen| {
                let row = seen.close(&seen.reference, 1e-3);
                follows(
                    (physics, shown.candidate, seen),
                    (shown.word, shown.bound),
                    &self.breaks(),
                    row,
                )
            }),
            would_tell: match lacking.is_empty() {
                false => Some(lacking.join(", ")),
                true => sparse.then(|| format!("samples every {dense:.1e} s")),
            },
            too_few_samples: false,
            closest: tried.next(),
            ruled_out: tried.collect(),
        }
    }

    /// mu_0 by the reference's breakaway torque: median over the candidate's breakaways.
    fn breakaway(&self, found: &[Found]) -> Option<f64> {
        let ratios = survey::breakaway_ratios(&self.physics, found, self.physics.trains.breakaway_test);
        Some(ratios.get(ratios.len() / 2)? * self.physics.system().breakaway)
    }
}

impl Search<'_> {
    /// Other kinds of mistakes that explain as much as the first of `all`, and where the first two differ most.
    fn others(&self, kind: CauseKind, all: &[Tried]) -> String {
        let (first, others) = (&all[0], &all[1..]);
        let mut words = String::new();
        let is_number = |tried: &Tried| !tried.cause.numbers().is_empty();
        // The report of the first parameter has the alternatives.
        let is_alternative = |tried: &&Tried| is_number(tried) && tried.cause.stepper().is_none();
        let mut second = others.iter().find(is_alternative).filter(|_| is_number(first));
        let mut named = vec![kind];
        for tried in others.iter().filter(|tried| !is_number(tried)) {
            let (kind, other) = tried.cause.words(self);
            if !named.contains(&kind) {
                words += &format!("; as much is explained by {}: {other}", kind.name());
                named.push(kind);
                second = second.or(Some(tried));
            }
        }
        let apart = second.and_then(|second| apart(self.evidence, first, second));
        words + &apart.unwrap_or_default()
    }
}

const ROUNDING: f64 = 1e-12;

/// Where two mistakes differ most at the candidate's times, in parts of the channels' sizes, in words; `None` if one of
/// them cannot be run again.
fn apart(evidence: &Evidence<'_>, one: &Tried, other: &Tried) -> Option<String> {
    let one_motion = "; the first two are one motion: another start, drive or force tells them apart".to_owned();
    let Some(seen) = evidence.observation else {
        let [one, other] = [one, other].map(|tried| tried.cause.run(evidence, tried.start));
        let (one, other) = (one?.events, other?.events);
        let off = one.iter().zip(&other).map(|(a, b)| (a.time - b.time).abs());
        let (mut number, mut by) = off.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
        if by <= ROUNDING * evidence.period {
            if one.len() == other.len() {
                return Some(one_motion);
            }
            let last = one.iter().chain(&other).map(|event| event.time).fold(0.0, f64::max);
            (number, by) = (one.len().min(other.len()), (evidence.covered.1 - last).abs());
        }
        return Some(format!(
            "; the first two differ most at event {number}, by {by:.1e} s: more digits or samples tell them apart"
        ));
    };
    let physics = evidence.physics;
    let compared = seen.channels.iter().zip(&seen.sizes);
    let compared = compared.filter(|(_, size)| size.is_finite());
    let mut channels: Vec<Channel> = compared.map(|(channel, _)| *channel).collect();
    let shown = channels.len();
    let state = physics.state.iter().copied();
    let lacking: Vec<Channel> = state.filter(|channel| !channels.contains(channel)).collect();
    channels.extend(lacking);
    let unknown = vec![vec![f64::NAN; seen.time.len()]; channels.len()];
    let sizes = channels.iter().map(|&channel| physics.size(channel, false));
    let all = Observation {
        sizes: sizes.collect(),
        time: seen.time.clone(),
        values: unknown.clone(),
        reference: unknown,
        channels,
        ..Observation::default()
    };
    let evidence = evidence.observed_as(Some(&all));
    let [one, other] = [one, other].map(|tried| tried.cause.run(&evidence, tried.start));
    let (one, other) = (one?.values, other?.values);
    let mut largest = (ROUNDING, one_motion);
    for (k, &channel) in all.channels.iter().enumerate() {
        for (row, (a, b)) in one[k].iter().zip(&other[k]).enumerate() {
            let by = (a - b).abs();
            if by / all.sizes[k] > largest.0 {
                let (name, unit) = (channel.name(), physics.vocabulary().unit(channel));
                let lacking = if k < shown { "" } else { ", which the candidate lacks" };
                let words = format!(
                    "; the first two differ most in {name}{lacking}, by {by:.1e} {unit} at {:.6} s",
                    seen.time[row]
                );
                largest = (by / all.sizes[k], words);
            }
        }
    }
    Some(largest.1)
}
