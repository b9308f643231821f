//! What reproduces a candidate: symptoms propose, the reference's own run decides ([`super::hypotheses`]).

use super::candidate::Candidate;
use super::clock::{self, FoundOffset, OtherClock};
use super::comparison::{Closest, Span, Unexplained};
use super::detect::Found;
use super::diagnosis::{self, Cause, Diagnosis, Symptoms};
use super::follows::follows;
use super::hypotheses::{
    Apart, Bench, Change, Evidence, Fit, Found as HypothesesFound, Judged, Observation, Played, Tried,
};
use super::parameters::{
    self, FoundBy, Material, OtherKick, OtherNumber, OtherParameters, Rerun, Start, StretchPass, other_kick,
    other_parameters,
};
use super::{CompareError, Passes, Reference, torques};
use crate::case::WrittenCase;
use crate::record::EventKind;
use crate::record::sequence::SequenceEvent;

/// Samples that differ by less than this part of the sizes of their channels, in the root mean square, need no explanation.
const SAMPLES_AGREE: f64 = 1e-6;
/// Nor do events that differ by less than this part of the natural period.
const EVENTS_AGREE: f64 = 1e-6;
/// What a first sample differs by at least, in root mean squares of what rounding changes samples by, if it is another state.
const OF_ROUNDING: f64 = 10.0;

/// How long before an onset without a kick its oscillation is below what is compared, in natural periods.
const BEFORE_ONSET: f64 = 20.0;

/// How many events of a candidate and of the reference say how their clocks may differ.
const LOOKED_AT: (usize, usize) = (4, 12);
/// Clocks that differ by less than this part of the natural period are one.
const LEAST_CLOCK: f64 = 1e-6;
/// Events, without samples, of which a cause can be told.
const FEWEST_EVENTS: usize = 2;
/// What another clock that is fitted to samples explains, at least.
const OF_CLOCK: f64 = 0.999;

/// What rounding makes of a motion, at least, in parts of a difference that it is the cause of.
const AMPLIFIED: f64 = 0.1;

/// What a candidate shows that causes are held against.
pub(super) struct Shown<'a> {
    pub candidate: &'a Candidate,
    pub symptoms: Symptoms<'a>,
    pub span: Span,
    /// Its events.
    pub word: &'a [SequenceEvent],
    /// An offset of its clock by which nearly all of its events agree.
    pub offset: Option<FoundOffset>,
    /// To which its event times are known, s.
    pub bound: f64,
    /// The mean square of what rounding changes its samples by, in parts of the sizes of their channels.
    pub rounding: f64,
    /// The largest error of an event, s; infinite where the sequences differ.
    pub worst: Option<f64>,
    /// When the first event is wrong, s.
    pub wrong: Option<f64>,
    /// Its events were found in its samples.
    pub detected: bool,
}

/// What reproduces a candidate.
#[derive(Default)]
pub(super) struct Causes {
    pub said: Vec<Diagnosis>,
    pub clock: Option<OtherClock>,
    pub kick: Option<OtherKick>,
    pub parameters: Option<OtherParameters>,
    pub unexplained: Option<Unexplained>,
}

impl Reference {
    /// What reproduces a candidate by another program. `runs_done` is told how many runs are done, of how many.
    ///
    /// # Errors
    /// Of the file.
    pub(super) fn causes(
        &self,
        shown: &Shown<'_>,
        passes: Option<Passes<'_>>,
        runs_done: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Causes, CompareError> {
        let (physics, symptoms, span) = (&self.physics, &shown.symptoms, shown.span);
        let period = physics.natural_period();
        let kick = self.kick_event();
        let (mut stretches, mut jumped, mut first, mut observation) = (None, None, None, None);
        if let Some(passes) = passes {
            (jumped, first) = (passes.jump.finish(), passes.jump.first());
            stretches = Some(passes.stretches);
            observation = Some(passes.observation.finish(physics, self.walk()?)?);
        }
        let observation = observation.filter(Observation::overlaps);
        // Without a kick the onset is amplified rounding, which no run repeats.
        let onset = self.word.iter().chain(shown.word).map(|event| event.time);
        let is_noise = physics.coasts() && physics.trains.kicks.is_empty();
        let known = onset.min_by(f64::total_cmp).filter(|_| is_noise);
        let known = known.map_or(f64::INFINITY, |onset| onset - BEFORE_ONSET * period);
        let samples_agree = observation.as_ref().and_then(|observation| {
            // Behind an onset that is noise there is nothing to compare.
            let left = Some(observation.left(&observation.reference, known)).filter(|left| !left.is_nan())?;
            Some(left <= shown.rounding.max(SAMPLES_AGREE * SAMPLES_AGREE))
        });
        let least = shown.bound.max(EVENTS_AGREE * period);
        let events_agree = shown.worst.is_none_or(|worst| worst <= least);
        if samples_agree.unwrap_or(events_agree) {
            return Ok(Causes::default());
        }
        // Beyond the reference's end nobody knows what comes.
        let last = shown.word.last().map_or(f64::NEG_INFINITY, |e| e.time);
        let to = match span.from < self.end {
            true => span.to.min(self.end),
            false => span.to.max(last),
        };
        let has_rows = shown.candidate.has_rows();
        let from = if has_rows { span.from } else { f64::NEG_INFINITY };
        let evidence = Evidence {
            observation: observation.as_ref(),
            word: shown.word,
            reference: &self.word,
            covered: (from, to.min(known)),
            period,
            bound: shown.bound,
            detected: shown.detected,
            is_smooth: known.is_finite(),
            before: Default::default(),
        };
        // Any change at all moves one event to where it is.
        if observation.is_none() && shown.word.len() < FEWEST_EVENTS {
            return Ok(Causes {
                unexplained: Some(self.unexplained(shown, None, &[])),
                ..Causes::default()
            });
        }
        // Another time of one motion may be another state that it begins in.
        let clock = self.other_clock(shown, &evidence)?;
        let clock = match clock {
            // A brake stops once: its motion begins at no other time.
            Some((causes, _))
                if physics.coasts() && causes.clock.as_ref().is_some_and(|clock| clock.counts_from.is_some()) =>
            {
                return Ok(causes);
            }
            other => other,
        };
        let kicked = kick.as_ref().map(|kick| kick.time);
        let kick = match kick {
            None => None,
            Some(kick) => self.kicks()?.into_iter().find(|(event, _)| *event == kick),
        };
        let kick = kick.map(|(event, states)| (event.time, states));
        let at_kick = kick.as_ref().map(|(time, (_, after))| Start::At(*time, after.clone()));
        let near = |time: f64| (time - period..time + period).contains(&from);
        let begins_at_kick = kick.as_ref().is_some_and(|(time, _)| near(*time));
        let starts = match first.clone() {
            Some((time, state)) if time > self.start => vec![Start::At(time, state), Start::Case],
            Some((time, state)) => vec![Start::Case, Start::At(time, state)],
            None if begins_at_kick => at_kick.into_iter().chain([Start::Case]).collect(),
            None => [Start::Case].into_iter().chain(at_kick.filter(|_| !has_rows)).collect(),
        };
        let numbers = WrittenCase::of(&physics.case);
        let bench = Bench {
            physics,
            numbers: &numbers,
            evidence,
            starts,
            first,
            origin: None,
            kicked,
            watch: runs_done,
            runs: Default::default(),
            most_steps: None,
            end: if to.is_finite() { to } else { self.end },
        }
        .prepared();
        let breakaway = self.breakaway(symptoms.found);
        let material = Material {
            numbers: &numbers,
            system: &physics.trains,
            places: &physics.places,
            stretches: stretches.filter(StretchPass::is_of_use),
            starts: bench.starts.clone(),
            word: shown.word,
            covered: (from, to),
            period,
            breakaway,
            events_differ: !events_agree,
        };
        let of_samples = observation.is_some();
        let mut proposals = symptoms.proposals();
        proposals.told = proposals.changes.clone();
        proposals.with_steps = has_rows && !events_agree || !physics.coasts();
        let (reading, proposed) = other_parameters(material);
        if let Some(other) = &proposed {
            let each = |number: &OtherNumber| (number.path.clone(), number.value);
            let best = Change::Numbers(other.numbers.iter().map(each).collect());
            let or = other.or.iter().map(|number| Change::Numbers(vec![each(number)]));
            let all: Vec<Change> = std::iter::once(best).chain(or).collect();
            // A table of events has nothing but them.
            if other.found_by == FoundBy::Equations || !of_samples {
                proposals.told.extend(all.iter().cloned());
            }
            proposals.changes.extend(all);
        }
        if let Some((value, _)) = breakaway {
            proposals
                .changes
                .push(Change::Numbers(vec![("friction.breakaway".to_owned(), value)]));
            let share = value / physics.system().breakaway;
            proposals.breakaway = Some(share).filter(|share| (share - 1.0).abs() > 1e-3);
        }
        let other = kick.as_ref().zip(jumped.as_ref());
        let other = other.and_then(|((time, states), jumped)| other_kick(physics, (*time, states), jumped));
        // From the onset on a run without a kick is amplified rounding, which no run repeats.
        let onset = self.word.first().map(|event| event.time);
        let seen = jumped.is_none() || other.as_ref().is_some_and(OtherKick::is_absent);
        let quiet = kick
            .as_ref()
            .zip(onset)
            .filter(|_| seen)
            .and_then(|(_, onset)| bench.unkicked(onset));
        if let Some(Tried { judged, .. }) = quiet {
            let words = format!(
                "the reference is kicked, the candidate is not; a run without the kick explains {} % of the squared difference of its \
                 samples up to the first event of the reference, and from its onset on it is amplified rounding",
                diagnosis::percent(judged.explained)
            );
            return Ok(Causes {
                said: vec![Diagnosis::tried(Cause::UnperturbedRun, words, judged.explained)],
                ..Causes::default()
            });
        }
        let events = shown.word.len();
        let events = if known.is_finite() { 0 } else { events };
        let outcome = |tried: &Tried| {
            let judged = &tried.judged;
            match (known.is_finite(), tried.until) {
                (true, _) => {
                    diagnosis::reproduced(judged, of_samples, 0) + " up to the onset, which is amplified rounding"
                }
                (false, Some(until)) => {
                    let up_to = format!(
                        " up to {until:.6} s, where rounding begins to decide at the end of which step an event comes"
                    );
                    diagnosis::reproduced(judged, of_samples, 0) + &up_to
                }
                (false, None) => diagnosis::reproduced(judged, of_samples, events),
            }
        };
        let mut causes = Causes::default();
        // What its own steps err by before its first sample is no other state.
        let least = SAMPLES_AGREE.max(OF_ROUNDING * shown.rounding.sqrt());
        let apart = |seen: &Observation| seen.begins_apart().is_none_or(|part| part > least);
        proposals.with_state = other.is_some() || observation.as_ref().is_none_or(apart);
        let found = bench.find(proposals, &reading, self.start);
        // What explains more than another clock is the cause.
        let best = match &found {
            HypothesesFound::Causes(all) => Some(all[0].judged),
            HypothesesFound::Unexplained(_) => None,
        };
        let clock = clock.filter(|(_, by_clock)| best.is_none_or(|best| by_clock.as_much_as(&best)));
        if let Some((mut causes, by_clock)) = clock {
            if let HypothesesFound::Causes(all) = &found
                && all[0].judged.as_much_as(&by_clock)
                && !matches!(all[0].change, Change::Both(..))
            {
                let parameters = self.parameters(&numbers, all, proposed.as_ref(), (events, of_samples));
                let (cause, words) = match &all[0].change {
                    Change::Numbers(_) => diagnosis::of_numbers(&parameters, physics, &numbers, &outcome(&all[0])),
                    change => symptoms.named(change),
                };
                let words = format!("{words}; another clock and this cannot be told apart by what the candidate shows");
                causes
                    .said
                    .push(Diagnosis::tried(cause, words, all[0].judged.explained));
                causes.parameters = Some(parameters).filter(|other| !other.numbers.is_empty());
            }
            return Ok(causes);
        }
        match found {
            HypothesesFound::Causes(all) => {
                let best = &all[0];
                let judged = &best.judged;
                let (mut second, mut other_named) = (None, None);
                let (cause, mut evidence) = match &best.change {
                    Change::Numbers(_) | Change::Both(..) => {
                        let parameters = self.parameters(&numbers, &all, proposed.as_ref(), (events, of_samples));
                        let words = diagnosis::of_numbers(&parameters, physics, &numbers, &outcome(best));
                        other_named = all[1..].iter().find(|tried| match &tried.change {
                            Change::Numbers(numbers) => {
                                let is_said = |or: &OtherNumber| (&or.path, or.value) == (&numbers[0].0, numbers[0].1);
                                parameters.or.first().is_some_and(is_said)
                            }
                            _ => false,
                        });
                        causes.parameters = Some(parameters);
                        if let Change::Both(_, stepper) = &best.change {
                            let (cause, words) = symptoms.named(&Change::Stepper(*stepper));
                            second = Some(Diagnosis::tried(
                                cause,
                                words + ", at once with the other number",
                                judged.explained,
                            ));
                        }
                        words
                    }
                    Change::State if other.is_some() => {
                        let other = other.map(|kick| OtherKick {
                            rerun: (events > 0).then(|| Rerun::of(events, judged.before, judged.after)),
                            ..kick
                        });
                        let words = other.as_ref().map(OtherKick::words).unwrap_or_default();
                        causes.kick = other;
                        (Cause::AnotherKick, format!("{words}: {}", outcome(best)))
                    }
                    change => {
                        let (cause, words) = symptoms.named(change);
                        (cause, format!("{words}: {}", outcome(best)))
                    }
                };
                let mut named = vec![cause];
                for tried in all[1..]
                    .iter()
                    .filter(|tried| !matches!(tried.change, Change::Numbers(_) | Change::Both(..)))
                {
                    let (cause, words) = symptoms.named(&tried.change);
                    if !named.contains(&cause) {
                        evidence += &format!("; as much is explained by {}: {words}", cause.name());
                        named.push(cause);
                        other_named = other_named.or(Some(tried));
                    }
                }
                if let Some(apart) = other_named.and_then(|other| bench.apart(best, other)) {
                    evidence += &self.told_apart(&apart);
                }
                causes.said.push(Diagnosis::tried(cause, evidence, judged.explained));
                causes.said.extend(second);
            }
            HypothesesFound::Unexplained(tried) => {
                let digit = symptoms.last_digit_of_angles();
                let amplified = digit.and_then(|digit| Some((digit, bench.amplified(digit)?)));
                if let Some((digit, part)) = amplified.filter(|(_, part)| *part >= AMPLIFIED) {
                    let words = symptoms.absolute_angles(digit, part);
                    causes.said.push(Diagnosis::shown(Cause::AbsoluteAngles, words));
                } else {
                    causes.unexplained = Some(self.unexplained(shown, observation.as_ref(), &tried));
                }
            }
        }
        Ok(causes)
    }

    /// What would tell two causes apart that explain as much.
    fn told_apart(&self, apart: &Apart) -> String {
        match apart {
            Apart::Nowhere => {
                "; the first two are one motion: another start, drive or force tells them apart".to_owned()
            }
            Apart::Event { number, by } => {
                format!(
                    "; the first two differ most at event {number}, by {by:.1e} s: more digits or samples tell them apart"
                )
            }
            Apart::Channel {
                channel,
                shown,
                time,
                by,
            } => {
                let (name, unit) = (channel.name(), self.physics.vocabulary().unit(*channel));
                let lacking = if *shown { "" } else { ", which the candidate lacks" };
                format!("; the first two differ most in {name}{lacking}, by {by:.1e} {unit} at {time:.6} s")
            }
        }
    }

    /// Where a difference begins that nothing explains, what came closest, and what would tell more.
    fn unexplained(&self, shown: &Shown<'_>, observation: Option<&Observation>, tried: &[Tried]) -> Unexplained {
        /// Samples in a natural period from which the equations can be read.
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
        // The best of each cause, the closest first.
        let mut each: Vec<Closest> = Vec::new();
        for Tried { change, judged, .. } in tried {
            let (cause, explained) = (shown.symptoms.named(change).0, judged.explained);
            if each.iter().all(|known| known.cause != cause) {
                each.push(Closest { cause, explained });
            }
        }
        let mut all = each.into_iter();
        let closest = all.next();
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
            closest,
            ruled_out: all.collect(),
        }
    }

    /// Numbers that reproduce the candidate, the best of them with those that do as well.
    fn parameters(
        &self,
        numbers: &WrittenCase,
        all: &[Tried],
        proposed: Option<&OtherParameters>,
        (events, of_samples): (usize, bool),
    ) -> OtherParameters {
        let judged = &all[0].judged;
        let known = |path: &str, value: f64| {
            let mut known = proposed
                .into_iter()
                .flat_map(|other| other.numbers.iter().chain(&other.or));
            known.find(|number| number.path == path && number.value == value)
        };
        // By how much a number may differ without leaving more than it leaves.
        let number = |(path, value): &(String, f64)| {
            let own = numbers.number(path).map_or(0.0, |number| number.value);
            let error = 3.0 * (value - own).abs() * (1.0 - judged.explained).max(0.0).sqrt();
            let error = known(path, *value).map_or(error, |number| number.error);
            OtherNumber::of(numbers, path, *value, error)
        };
        let of = |tried: &Tried| match &tried.change {
            Change::Numbers(numbers) | Change::Both(numbers, _) => numbers.iter().map(number).collect(),
            _ => Vec::new(),
        };
        let best: Vec<OtherNumber> = of(&all[0]);
        let from_proposed = best.iter().all(|number| known(&number.path, number.value).is_some());
        // Two at once are no other number each; those that follow the speed of a drive are.
        let is_one = |numbers: &[OtherNumber]| numbers.windows(2).all(|two| two[0].value == two[1].value);
        let mut or: Vec<OtherNumber> = Vec::new();
        for other in all[1..]
            .iter()
            .map(of)
            .filter(|other: &Vec<OtherNumber>| is_one(other) && is_one(&best))
        {
            or.extend(other.into_iter().take(1));
        }
        or.retain(|number| best.iter().all(|best| best.path != number.path));
        or.dedup_by(|a, b| a.path == b.path);
        OtherParameters {
            found_by: match proposed {
                Some(other) if from_proposed => other.found_by,
                _ if best.iter().all(|number| number.path == "friction.breakaway") => FoundBy::Breakaways,
                _ if of_samples => FoundBy::Samples,
                _ => FoundBy::Events,
            },
            numbers: best,
            explained: judged.explained,
            or,
            rerun: (events > 0 && judged.has_events()).then(|| Rerun::of(events, judged.before, judged.after)),
        }
    }

    /// Another clock, if all that differs is that.
    ///
    /// # Errors
    /// Of the file.
    fn other_clock(
        &self,
        shown: &Shown<'_>,
        evidence: &Evidence<'_>,
    ) -> Result<Option<(Causes, Judged)>, CompareError> {
        let physics = &self.physics;
        let first = self.word.first().map(|e| match e.kind {
            EventKind::Stick => ("the first stick", e.time),
            _ => ("the first event", e.time),
        });
        let corner = if physics.coasts() {
            "a corner of F(t)"
        } else {
            "a corner of a signal"
        };
        let corners = self
            .events
            .iter()
            .filter(|e| e.kind == EventKind::Corner && e.time > 0.0);
        let kick = self.kick_event().map(|kick| ("the kick", kick.time));
        let anchors = kick.into_iter().chain(first).chain(corners.map(|e| (corner, e.time)));
        let anchors: Vec<(&'static str, f64)> = anchors.collect();
        let clock = clock::other_clock(&self.word, shown.word, &anchors, physics.natural_period());
        let shifted = |add: f64| -> Vec<SequenceEvent> {
            let moved = |e: &SequenceEvent| SequenceEvent {
                time: e.time - add,
                kind: e.kind,
            };
            self.word.iter().map(moved).collect()
        };
        let play = |add: &[f64]| {
            let values = match evidence.observation {
                Some(observation) => observation.reference_at(self.walk().ok()?, add[0]).ok()?,
                None => Vec::new(),
            };
            Some(Played {
                values,
                events: shifted(add[0]),
                steps: 0,
            })
        };
        let judged = |add: f64| evidence.judged(&play(&[add])?, f64::INFINITY);
        let (add, judged) = match (&clock, shown.offset) {
            (Some(clock), _) => (clock.to_add(), judged(clock.to_add())),
            (None, Some(offset)) => (offset.seconds, judged(offset.seconds)),
            // By the samples, from what single events propose.
            (None, None) => {
                let period = physics.natural_period();
                let near = |add: &f64| {
                    let moved = parameters::agreement(&shifted(*add), shown.word, period);
                    moved.cost
                };
                let mut begin: Vec<f64> = Vec::new();
                for theirs in shown.word.iter().take(LOOKED_AT.0) {
                    let same = self.word.iter().filter(|ours| ours.kind == theirs.kind);
                    begin.extend(same.take(LOOKED_AT.1).map(|ours| ours.time - theirs.time));
                }
                begin.retain(|add| add.abs() > LEAST_CLOCK * period);
                begin.sort_by(f64::total_cmp);
                begin.dedup();
                let best = begin
                    .iter()
                    .map(|add| (near(add), *add))
                    .min_by(|a, b| a.0.total_cmp(&b.0));
                let Some((_, begin)) = best else { return Ok(None) };
                let fit = Fit {
                    evidence,
                    play: &play,
                    units: &[0.1 * period],
                };
                let Some(point) = fit.refined(vec![begin]) else {
                    return Ok(None);
                };
                let (add, found) = (point.values[0], judged(point.values[0]));
                (add, found.filter(|judged| judged.explained >= OF_CLOCK))
            }
        };
        let Some(judged) = judged.filter(Judged::is_cause) else {
            return Ok(None);
        };
        let clock = match (clock, shown.offset) {
            (None, None) => Some(OtherClock {
                offset: -add,
                counts_from: None,
                left: judged.after.max,
            }),
            (clock, _) => clock,
        };
        // Where the times count from says more than that events agree, and that more than an offset.
        // To an offset that was given.
        let given = shown.candidate.clock.offset;
        let words = match (&clock, shown.offset) {
            (Some(OtherClock { counts_from: None, .. }) | None, Some(offset)) => FoundOffset {
                seconds: offset.seconds + given,
                ..offset
            }
            .words(),
            (Some(clock), _) => {
                let add = clock.to_add() + given;
                format!("{}; repeat with --time-offset {add:.9}", clock.words())
            }
            (None, None) => String::new(),
        };
        let said = vec![Diagnosis::tried(Cause::TimeOffset, words, judged.explained)];
        let causes = Causes {
            said,
            clock,
            ..Causes::default()
        };
        Ok(Some((causes, judged)))
    }

    /// mu_0 by the torque that the reference tests, at the middle one of the candidate's breakaways, and what half of them differ by.
    fn breakaway(&self, found: &[Found]) -> Option<(f64, f64)> {
        let ratios = torques::breakaway_ratios(&self.physics, found, self.physics.trains.breakaway_test);
        let at = |share: usize| ratios.get(share * ratios.len() / 4).copied();
        let breakaway = self.physics.system().breakaway;
        Some((at(2)? * breakaway, (at(3)? - at(1)?) * breakaway))
    }
}
