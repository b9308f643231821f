//! Search for the causes of a difference: symptoms propose, runs of the reference decide ([`super::hypotheses`]).

use super::candidate::Candidate;
use super::clock::{self, FoundOffset, OtherClock};
use super::comparison::{Closest, Span, Unexplained};
use super::detect::{Detection, Found};
use super::diagnosis::{self, Cause, Diagnosis, Symptoms};
use super::follows::follows;
use super::hypotheses::{
    Apart, Bench, Change, Evidence, Fit, FoundChange as HypothesesFound, Judged, Observation, Played, Tried,
};
use super::limit::{Limit, OutOfTime};
use super::parameters::{
    self, EventAgreement, FoundBy, Material, OtherKick, OtherNumber, OtherParameters, StretchPass, TrialStart,
    other_kick, other_parameters,
};
use super::{CompareError, Passes, Reference, torques};
use std::sync::atomic::Ordering;
use stickslip_case::WrittenCase;
use stickslip_system::record::EventKind;
use stickslip_system::record::sequence::SequenceEvent;

/// Root mean square difference of samples, in parts of the channels' sizes, that needs no explanation.
const SAMPLES_AGREE: f64 = 1e-6;
/// Difference of event times, in natural periods, that needs no explanation.
const EVENTS_AGREE: f64 = 1e-6;
/// A first sample is another state if it differs by more than this many times the root mean square of rounding.
const OF_ROUNDING: f64 = 10.0;

/// Natural periods before an onset without a kick at which its oscillation is still negligible.
const BEFORE_ONSET: f64 = 20.0;

/// Events of the candidate and of the reference that are tried as starts of another clock.
const LOOKED_AT: (usize, usize) = (4, 12);
const LEAST_CLOCK: f64 = 1e-6;
const FEWEST_EVENTS: usize = 2;
/// Smallest part that another clock must explain: with the right offset nothing is left.
const OF_CLOCK: f64 = 1.0 - 1e-6;

/// Smallest effect of rounding, in parts of the difference, to be its cause.
const AMPLIFIED: f64 = 0.1;

pub(super) struct Shown<'a> {
    pub candidate: &'a Candidate,
    pub symptoms: Symptoms<'a>,
    /// Events of the reference, as far as the candidate can show them.
    pub reference: &'a [SequenceEvent],
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
    /// How its events were found in its samples; `None` if they were stated.
    pub detected: Option<Detection>,
}

#[derive(Default)]
pub(super) struct Causes {
    pub said: Vec<Diagnosis>,
    pub clock: Option<OtherClock>,
    pub kick: Option<OtherKick>,
    pub parameters: Option<OtherParameters>,
    pub unexplained: Option<Unexplained>,
    pub out_of_time: Option<OutOfTime>,
}

impl Reference {
    /// Searches the causes of a difference of another program's candidate. `runs_done` receives the runs done and their
    /// total.
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
        let of_values = observation.as_ref().map_or(0.0, Observation::rounding);
        let rounding = shown.rounding.max(of_values);
        // Without a kick the onset is amplified rounding, which no run repeats.
        let onset = shown.reference.iter().chain(shown.word).map(|event| event.time);
        let is_noise = physics.amplifies() && physics.coasts() && physics.trains.kicks.is_empty();
        let known = onset.min_by(f64::total_cmp).map(|onset| onset - BEFORE_ONSET * period);
        // Nothing has grown out of rounding in so few periods.
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
        let creeps = !events_agree && symptoms.creep.is_some() && self.last_stick().is_some();
        if samples_agree.unwrap_or(events_agree) && !creeps {
            return Ok(Causes::default());
        }
        // The reference is unknown beyond its end.
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
            reference: shown.reference,
            covered: (from, to.min(known)),
            period,
            bound: shown.bound,
            detected: shown.detected,
            sticks: physics.sticks(),
            least: SAMPLES_AGREE.max(OF_ROUNDING * rounding.sqrt()),
            is_smooth: known.is_finite(),
            before: Default::default(),
            found: Default::default(),
        };
        // A single event is moved to its place by any change.
        if observation.is_none() && shown.word.len() < FEWEST_EVENTS {
            return Ok(Causes {
                unexplained: Some(self.unexplained(shown, None, &[])),
                ..Causes::default()
            });
        }
        let clock = self.other_clock(shown, &evidence)?;
        let clock = match clock {
            // A brake stops once, so its motion begins at no other time.
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
        let at_kick = kick
            .as_ref()
            .map(|(time, (_, after))| TrialStart::At(*time, after.clone()));
        let near = |time: f64| (time - period..time + period).contains(&from);
        let begins_at_kick = kick.as_ref().is_some_and(|(time, _)| near(*time));
        let starts = match first.clone() {
            Some((time, state)) if time > self.start => vec![TrialStart::At(time, state), TrialStart::Case],
            Some((time, state)) => vec![TrialStart::Case, TrialStart::At(time, state)],
            None if begins_at_kick => at_kick.into_iter().chain([TrialStart::Case]).collect(),
            None => [TrialStart::Case]
                .into_iter()
                .chain(at_kick.filter(|_| !has_rows))
                .collect(),
        };
        let numbers = WrittenCase::of(&physics.case);
        let bench = Bench {
            physics,
            begins: self.start,
            numbers: &numbers,
            evidence,
            starts,
            first,
            origin: None,
            kicked,
            watch: runs_done,
            runs: Default::default(),
            most_steps: None,
            shows_contact: shown.shows_contact,
            limit: shown.limit,
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
            shows_contact: shown.shows_contact,
            limit: shown.limit,
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
        // From the onset on, a run without a kick is amplified rounding, which no run repeats.
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
            // Creep that is never at rest has no events.
            let is_creep = matches!(tried.change, Change::Smooth(..)) && judged.after.unmatched > 0;
            let events = if is_creep { 0 } else { events };
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
        // The error of its own steps before its first sample is no other state.
        let apart = |seen: &Observation| seen.begins_apart().is_none_or(|part| part > bench.evidence.least);
        proposals.with_state = other.is_some() || observation.as_ref().is_none_or(apart);
        let found = bench.find(proposals, &reading);
        let out_of_time = shown.limit.is_over().then(|| OutOfTime {
            allowed: shown.limit.allowed,
            tried: bench.runs[0].load(Ordering::Relaxed),
        });
        causes.out_of_time = out_of_time;
        let best = match &found {
            HypothesesFound::Causes(all) => Some(all[0].judged),
            HypothesesFound::Unexplained(_) => None,
        };
        let clock = clock.filter(|(_, by_clock)| best.is_none_or(|best| by_clock.as_much_as(&best)));
        if let Some((mut causes, by_clock)) = clock {
            causes.out_of_time = out_of_time;
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
                            rerun: (events > 0).then(|| EventAgreement::of(events, judged.before, judged.after)),
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

    fn unexplained(&self, shown: &Shown<'_>, observation: Option<&Observation>, tried: &[Tried]) -> Unexplained {
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
        // Uncertainty of the parameter, from the part of the difference that remains.
        let number = |(path, value): &(String, f64), beyond: bool| {
            let own = numbers.number(path).map_or(0.0, |number| number.value);
            let error = match known(path, *value) {
                _ if beyond => f64::NAN,
                Some(number) => number.error,
                None => 3.0 * (value - own).abs() * (1.0 - judged.explained).max(0.0).sqrt(),
            };
            OtherNumber::of(numbers, path, *value, error)
        };
        let of = |tried: &Tried| match &tried.change {
            Change::Numbers(numbers) | Change::Both(numbers, _) => {
                numbers.iter().map(|one| number(one, tried.beyond)).collect()
            }
            _ => Vec::new(),
        };
        let best: Vec<OtherNumber> = of(&all[0]);
        let from_proposed = best.iter().all(|number| known(&number.path, number.value).is_some());
        // Parameters that change together, such as those that follow the speed of a drive, are one alternative.
        let mut or: Vec<OtherNumber> = Vec::new();
        // All coefficients of friction at once are none where one of them does.
        let is_alone = |tried: &Tried| match tried.change.numbers() {
            [_] => true,
            several => several.iter().all(|(path, _)| !path.starts_with("friction.")),
        };
        let others = all[1..].iter().filter(|other| other.values == 1 && is_alone(other));
        for other in others.filter(|_| all[0].values == 1) {
            let first: Option<OtherNumber> = of(other).into_iter().next();
            let is_new = |number: &OtherNumber| best.iter().chain(&or).all(|known| known.path != number.path);
            or.extend(first.filter(is_new));
        }
        OtherParameters {
            found_by: match proposed {
                _ if all[0].beyond && of_samples => FoundBy::Samples,
                Some(other) if from_proposed => other.found_by,
                _ if best.iter().all(|number| number.path == "friction.breakaway") => FoundBy::Breakaways,
                _ if of_samples => FoundBy::Samples,
                _ => FoundBy::Events,
            },
            numbers: best,
            explained: judged.explained,
            or,
            rerun: (events > 0 && judged.has_events()).then(|| EventAgreement::of(events, judged.before, judged.after)),
        }
    }

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
                Some(observation) => {
                    let mut values = observation.reference_at(self.walk().ok()?, add[0]).ok()?;
                    observation.complete(&mut values, physics, &physics.course, add[0]);
                    values
                }
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
            // From the samples, starting at offsets of single events.
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
                (point.values[0], judged(point.values[0]))
            }
        };
        // A clock whose zero is an event of the reference may be that of a solver with errors of its own.
        let has_origin = clock.as_ref().is_some_and(|clock| clock.counts_from.is_some());
        let is_cause = |judged: &Judged| judged.is_cause() && (has_origin || judged.explained >= OF_CLOCK);
        let Some(judged) = judged.filter(is_cause) else {
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
        // A known origin of the times says most, then agreement of the events, then the offset. The proposal includes
        // an offset that was given.
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

    /// mu_0 by the reference's breakaway torque: median over the candidate's breakaways, and interquartile range.
    fn breakaway(&self, found: &[Found]) -> Option<(f64, f64)> {
        let ratios = torques::breakaway_ratios(&self.physics, found, self.physics.trains.breakaway_test);
        let at = |share: usize| ratios.get(share * ratios.len() / 4).copied();
        let breakaway = self.physics.system().breakaway;
        Some((at(2)? * breakaway, (at(3)? - at(1)?) * breakaway))
    }
}
