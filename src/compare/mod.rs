//! How far a run of any solver agrees with a reference: the event sequence, the times of the events, then the states.
//!
//! A `Candidate` is a result file of this program, a file of another one with a time column and channels, or a table of
//! events; a [`Mapping`] says what its columns are. Events that it does not state are found in its relative velocity.
//! The event sequences are aligned first ([`crate::record::sequence`]). Matched events give the errors of event times, and the
//! stretches in which both runs are in the same segment. There the channels are compared with the reference sample by sample,
//! and nothing is compared across an event. A cause is named where the candidate's numbers are evidence for it.
//!
//! | module | what it is |
//! |---|---|
//! | `candidate` | results of other solvers: formats, columns, units, events |
//! | `reference`, `evaluate` | the reference as a function of time |
//! | `channel`, `vocabulary` | the channels that are compared, and their names |
//! | `detect`, `crossings`, `torques`, `resolution` | events and torques found in samples; what the times of a file resolve |
//! | `event_errors`, `cycles`, `clock`, `attractor` | errors of event times, over cycles, by an offset of the clock, of periodic motion |
//! | `windows`, `states`, `impulse`, `energy`, `range` | common stretches; errors of channels, impulses and energies; range of the position |
//! | `statistics` | the paper's numbers of both runs |
//! | `diagnosis`, `units`, `creep`, `parameters`, `case_differences` | causes: wrong units, regularised friction, another number of the case |
//! | `comparison`, `requirement`, `trace`, `error` | the outcome, bounds on it, what is drawn of it, why there is none |

mod attractor;
mod candidate;
mod case_differences;
mod channel;
mod clock;
mod comparison;
mod creep;
mod crossings;
mod cycles;
mod detect;
mod diagnosis;
mod energy;
mod error;
mod evaluate;
mod event_errors;
mod impulse;
mod parameters;
mod range;
pub(crate) mod reference;
mod requirement;
mod resolution;
mod states;
mod statistics;
mod torques;
mod trace;
mod units;
mod vocabulary;
mod windows;

pub(crate) use candidate::Candidate;

pub use attractor::Attractor;
pub use candidate::{Mapping, TimeOffset};
pub use case_differences::CaseDifference;
pub use channel::Channel;
pub use clock::{FoundOffset, OtherClock};
pub use comparison::{Absent, ChannelErrors, Comparison, Span};
pub use cycles::CycleErrors;
pub use detect::{Detection, Detector, Found, Point};
pub use diagnosis::{Cause, Diagnosis};
pub use error::CompareError;
pub use evaluate::Evaluator;
pub use event_errors::EventError;
pub use impulse::ImpulseErrors;
pub use parameters::{Agreement, FoundBy, OtherKick, OtherNumber, OtherParameters, Rerun as TriedAgain};
pub use requirement::Requirement;
pub use resolution::{Resolution, Rounding};
pub use statistics::Statistic;
pub use trace::Pair;
pub use vocabulary::Vocabulary;

use crate::case::quantity::Dimension;
use crate::case::{Case, CaseSource, WrittenCase};
use crate::record::sequence::{Alignment, SequenceEvent};
use crate::record::{Event, EventKind};
use crate::results::{ResultError, ResultFile, open_sound};
use candidate::Block;
use comparison::channel_errors;
use creep::{Creep, CreepPass};
use crossings::Crossings;
use detect::{DEFAULT_HYSTERESIS, DEFAULT_TOLERANCE};
use diagnosis::Evidence;
use energy::{EnergyDrift, EnergyPass};
use event_errors::EventErrors;
use impulse::ImpulsePass;
use parameters::{Found as Explained, JumpPass, Material, Start, StretchPass, other_kick, other_parameters};
use range::Range;
use reference::{BeforeAndAfter, Physics, Rerun, states_at_events};
use states::{Grid, Probe, StatePass};
use statistics::{of_attractors, statistics};
use std::path::Path;
use torques::TorqueWatch;

/// Event times that agree to this, s, need no explanation; where they are found in samples, to that.
const AGREED: f64 = 1e-9;
const AGREED_IN_SAMPLES: f64 = 1e-7;

/// Events of a candidate beyond this are chattering.
const MOST_EVENTS: usize = 1_000_000;

/// A reference, opened once for any number of candidates.
#[derive(Debug)]
pub struct Reference {
    file: ResultFile,
    physics: Physics,
    rerun: Rerun,
    /// Its periodic motion.
    attractor: Option<Attractor>,
    /// It slips from the first sample on.
    starts_in_slip: bool,
    events: Vec<Event>,
    word: Vec<SequenceEvent>,
    /// Its first sample, s.
    start: f64,
    /// Its last sample, s.
    end: f64,
}

/// How far a comparison is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CompareProgress {
    /// Share of the passes over the candidate's samples that is done, 0 to 1, by the simulated time.
    pub done: f64,
    /// Simulated time of the pass under way, s.
    pub time: f64,
    /// The first pass finds the events, the second compares the states.
    pub pass: u8,
}

/// Passes over a candidate's samples.
const PASSES: u8 = 2;

/// What one pass over a candidate's samples gives beside its events.
#[derive(Debug, Default)]
struct Survey {
    span: Option<(f64, f64)>,
    /// Mean interval of samples in the stick-slip of the reference, s.
    interval: Option<f64>,
    plateau: f64,
    /// To what the times are rounded, if they are, and rows left out for it.
    rounding: Option<Rounding>,
    repeated: u64,
}

impl Reference {
    /// Opens a result file as a reference.
    ///
    /// # Errors
    /// If it is no result file, damaged, or its case or events are unreadable.
    pub fn open(path: &Path) -> Result<Reference, CompareError> {
        let file = open_sound(path)?;
        let case = saved_case(path, &file)?;
        let events = file.events()?;
        let last = candidate::events::last_in_order(path, &events)?;
        let rows = file.sample_count()?;
        // That its states are finite is seen where they are compared.
        file.check_times()?;
        let (start, end) = if rows > 0 {
            (file.column("time", 0..1)?[0], file.column("time", rows - 1..rows)?[0])
        } else {
            (0.0, last.max(0.0))
        };
        let in_word = events.iter().filter(|e| e.kind.in_event_sequence());
        let word: Vec<SequenceEvent> = in_word.map(SequenceEvent::from).collect();
        let first = file.states(0..rows.min(1))?;
        Ok(Reference {
            physics: Physics::new(case, &word, end),
            word,
            rerun: Rerun::default(),
            attractor: Attractor::of_file(&file)?,
            starts_in_slip: first.iter().any(|(_, mode, _)| mode.sense() != 0),
            file,
            events,
            start,
            end,
        })
    }

    /// A mapping in which nothing is said yet, by the names and units of this reference.
    pub fn mapping(&self) -> Mapping {
        Mapping {
            vocabulary: self.physics.vocabulary().clone(),
            ..Mapping::default()
        }
    }

    /// Opens and compares a candidate, block by block.
    ///
    /// # Errors
    /// If the candidate cannot be read, or holds times or values that cannot be compared.
    pub fn compare(&self, path: &Path, mapping: &Mapping) -> Result<Comparison, CompareError> {
        self.compare_watched(path, mapping, &mut |_| {})
    }

    /// Does what [`Self::compare`] does, and says after each block of samples how far it is.
    ///
    /// # Errors
    /// Those of [`Self::compare`].
    pub fn compare_watched(
        &self,
        path: &Path,
        mapping: &Mapping,
        watch: &mut dyn FnMut(CompareProgress),
    ) -> Result<Comparison, CompareError> {
        let physics = &self.physics;
        let mut candidate = Candidate::open(path, mapping, physics)?;
        let mut watch = |pass: u8, time: f64| {
            let share = ((time - self.start) / (self.end - self.start)).clamp(0.0, 1.0);
            let done = (f64::from(pass - 1) + if share.is_nan() { 1.0 } else { share }) / f64::from(PASSES);
            watch(CompareProgress { done, time, pass });
        };
        let detection = self.detection(path, mapping)?;
        if let TimeOffset::Seconds(offset) = mapping.time_offset {
            candidate.shift(offset);
        }
        let (mut survey, mut found) = self.survey(&candidate, detection, &mut watch)?;
        let mut applied = None;
        if mapping.time_offset == TimeOffset::Auto {
            let offset = self.offset(&found).ok_or_else(|| {
                let what = "no offset of the clock makes four events in five agree with the reference's";
                CompareError::content(path, "time_offset", what, "give it in seconds, --time-offset 6.966")
            })?;
            candidate.shift(offset.seconds);
            applied = Some(offset);
            (survey, found) = self.survey(&candidate, detection, &mut watch)?;
        }
        let events_given = candidate.events.is_some();
        let interval = survey.interval.unwrap_or(0.0);
        // One that slips from rest at once has omega_r = 0 in its first sample, which is no stick.
        let (begins, _) = survey.span.unwrap_or_default();
        let at_once = |event: &Found| event.kind == EventKind::Slip && event.time - begins <= interval;
        if self.starts_in_slip && !events_given && found.first().is_some_and(at_once) {
            found.remove(0);
        }
        let span = self.span(&candidate, &survey);

        let all: Vec<SequenceEvent> = found.iter().map(SequenceEvent::from).collect();
        let within = |e: &&SequenceEvent| e.time >= span.from && e.time <= span.to;
        let reference_word: Vec<SequenceEvent> = self.word.iter().filter(within).copied().collect();
        let word: Vec<SequenceEvent> = all.iter().filter(within).copied().collect();
        let uncovered = self.word.len() - reference_word.len();
        let period = physics.natural_period();
        let mut alignment = Alignment::of(&reference_word, &word, period);
        // In a run of many cycles a drift of the times is no exchange of events.
        if !physics.coasts() && !alignment.differences.is_empty() {
            alignment = Alignment::drifting(&reference_word, &word, period, alignment);
        }
        let errors = EventErrors::of(&reference_word, &word, &alignment);

        // Nearly all events of a clock that starts elsewhere are without a partner, or have a wrong one.
        let parted = errors.matched * 2 < found.len() || errors.max.is_some_and(|max| max > period / 8.0);
        let proposed = match mapping.time_offset {
            TimeOffset::None if parted => self.offset(&found),
            _ => None,
        };
        // Of a run that goes otherwise, some events agree by chance when it is shifted; of one by another clock all do.
        let proposed = proposed.filter(|offset| {
            let all = 20 * offset.agree >= 19 * offset.of && offset.rms <= period / 50.0;
            all && offset.seconds.abs() > period / 8.0
        });
        let resolution = resolution_of(&candidate, &survey, &errors);
        // Both ends of a period that is found in samples may err by an interval.
        let slack = if events_given { 0.0 } else { 2.0 * interval };
        let mut states = if candidate.has_rows() {
            let mut windows = windows::windows(&reference_word, &word, &alignment, span.from_start, span.to_end);
            if !events_given {
                windows::without_small_shifts(&mut windows, interval);
            }
            let firsts = [reference_word.first(), word.first()].into_iter().flatten();
            let onset = firsts.map(|e| e.time).fold(span.to, f64::min);
            let position = self.position(&candidate, &all, slack);
            let passes = self.passes(&candidate, &found, detection);
            Some(self.states(&candidate, windows, (detection, onset), position, passes, &mut watch)?)
        } else {
            None
        };
        let attractors = (!physics.coasts()).then(|| {
            let found = candidate.attractor.or_else(|| {
                let (attractor, _) = self.attractor_of(&all, slack).filter(|_| !candidate.is_own())?;
                let amplitude = states.as_ref().and_then(|states| states.amplitude);
                Some(Attractor { amplitude, ..attractor })
            });
            [self.attractor, found]
        });

        let mut unit_faults: Vec<_> = units::of_time(&self.time_pairs(&all, &survey)).into_iter().collect();
        if let Some(StatePass { channels, tallies, .. }) = states.as_ref().map(|states| &states.pass) {
            let of_channel = |(k, &channel): (usize, &Channel)| {
                units::of_channel(channel, physics.vocabulary(), &tallies.each_ref().map(|phase| phase[k]))
            };
            unit_faults.extend(channels.iter().enumerate().filter_map(of_channel));
        }
        let mut causes = diagnosis::diagnose(&Evidence {
            physics,
            floor: resolution.as_ref().map_or(0.0, |resolution| resolution.event_error),
            offset: proposed,
            reference: &reference_word,
            found: &found,
            alignment: &alignment,
            errors: &errors,
            units: unit_faults,
            kick: self.kick_event(),
            probes: states.as_ref().map_or(&[][..], |s| &s.pass.probes),
            grid: states.as_ref().map_or(Grid::default(), |s| s.pass.grid),
            interval: survey.interval,
            plateau: survey.plateau,
            detected: !events_given,
            creep: states.as_ref().and_then(|s| s.creep),
        });
        let agreed = if events_given { AGREED } else { AGREED_IN_SAMPLES };
        let differs = !alignment.differences.is_empty() || errors.max.is_none_or(|max| max > agreed);
        let passes = states.as_mut().and_then(|states| states.passes.take());
        let other = match candidate.is_own() {
            false => self.other_inputs(&candidate, passes, (&found, &all), span, differs, &mut causes)?,
            true => Others::default(),
        };
        diagnosis::add_case(&mut causes, candidate.differences());

        let mut statistics = statistics(&reference_word, &word, (span.from_start, span.to_end), uncovered);
        if let Some(attractors) = &attractors {
            // In a cycle there is no last stick.
            statistics.retain(|statistic| attractors[0].is_none() || statistic.name != "final_stick");
            let unit = physics.vocabulary().motion().dimension(Dimension::Angle).unit();
            statistics.extend(of_attractors(attractors, unit));
        }
        let (was_rerun, pass) = (self.was_repeated(), states.as_ref().map(|states| &states.pass));
        let mut comparison = Comparison {
            reference: self.file.path().display().to_string(),
            candidate: candidate.path.display().to_string(),
            format: candidate.format,
            resolution,
            time_offset: Some(candidate.clock.offset).filter(|offset| *offset != 0.0),
            found_time_offset: applied.or(proposed),
            verdict: String::new(),
            causes,
            case_differences: candidate.differences().to_vec(),
            parameters: other.parameters,
            kick: other.kick,
            clock: other.clock,
            detection: (!events_given).then_some(detection),
            velocity_unit: physics.vocabulary().unit(Channel::RelativeVelocity),
            span: candidate.has_rows().then_some(span),
            interval: survey.interval,
            reference_events: reference_word.len(),
            uncovered,
            candidate_events: word.len(),
            missing: alignment.missing(),
            spurious: alignment.spurious(),
            sequence: alignment.differences,
            cycles: (!physics.coasts()).then(|| CycleErrors::of(&errors)).flatten(),
            event_errors: errors,
            statistics,
            channels: pass.map_or_else(Vec::new, |pass| channel_errors(pass, physics)),
            samples: pass.map_or(0, StatePass::samples),
            samples_outside: pass.map_or(0, |pass| pass.outside),
            samples_too_sparse: pass.map_or(0, |pass| pass.too_sparse),
            reference_repeated: pass.is_some_and(|pass| pass.walk.integrated) || was_rerun,
            was_rerun,
            energy_drift: states.as_ref().and_then(|states| states.energy),
            impulses: states.map_or_else(Vec::new, |states| states.impulses),
            time_scale: (!physics.coasts()).then(|| physics.scale.clone()),
            attractors,
            absent: candidate.left_out().map(Absent::of).collect(),
        };
        let lacking = physics.state.iter().filter(|&&channel| !candidate.has(channel));
        comparison.find_absent(&lacking.map(|channel| channel.name()).collect::<Vec<_>>());
        comparison.find_verdict();
        Ok(comparison)
    }

    /// How events are found: as the mapping says, else by what the contact of the reference needs.
    fn detection(&self, path: &Path, mapping: &Mapping) -> Result<Detection, CompareError> {
        // A contact without stick counts one below a threshold, and for as long.
        let threshold = self.physics.threshold();
        if threshold.is_some() && mapping.hysteresis.is_some() {
            return Err(CompareError::content(
                path,
                "hysteresis",
                "the contact of the reference has no stick, and its events are the crossings of one threshold",
                "leave out --hysteresis, or [detection].hysteresis; --velocity-tolerance is the threshold",
            ));
        }
        Ok(Detection {
            velocity_tolerance: mapping.velocity_tolerance.or(threshold).unwrap_or(DEFAULT_TOLERANCE),
            hysteresis: match threshold {
                Some(_) => 1.0,
                None => mapping.hysteresis.unwrap_or(DEFAULT_HYSTERESIS),
            },
        })
    }

    /// What is collected of a candidate by another program to find another number of the case in.
    fn passes(&self, candidate: &Candidate, found: &[Found], detection: Detection) -> Option<Passes<'_>> {
        if candidate.is_own() {
            return None;
        }
        let physics = &self.physics;
        let (channels, period) = (candidate.channels(physics), physics.natural_period());
        let of_reference = self.events.iter().filter(|e| !e.kind.in_event_sequence());
        let breaks = found.iter().map(|f| f.time).chain(of_reference.map(|e| e.time));
        let stick_slip = match (found.first(), found.last()) {
            (Some(first), Some(last)) => (first.time - 40.0 * period, last.time + 10.0 * period),
            _ => self.stretch(),
        };
        let tolerance = detection.velocity_tolerance;
        let kick = self.kick_event().map_or(f64::INFINITY, |kick| kick.time);
        Some(Passes {
            stretches: StretchPass::new(physics, &channels, tolerance, stick_slip, breaks.collect()),
            jump: JumpPass::new(physics, &channels, kick),
        })
    }

    /// The last kick before the first event of the word, as an event.
    fn kick_event(&self) -> Option<&Event> {
        let onset = self.word.first().map_or(f64::INFINITY, |e| e.time);
        self.events
            .iter()
            .rfind(|e| e.kind == EventKind::Kick && e.time < onset)
    }

    /// Another clock, another kick, another number of the case: what explains a candidate by another program. The causes that it makes
    /// needless are taken out, and it is put among them.
    ///
    /// # Errors
    /// Of the file.
    fn other_inputs(
        &self,
        candidate: &Candidate,
        passes: Option<Passes<'_>>,
        (found, all): (&[Found], &[SequenceEvent]),
        span: Span,
        differs: bool,
        causes: &mut Vec<Diagnosis>,
    ) -> Result<Others, CompareError> {
        if causes.iter().any(|known| known.cause == Cause::WrongUnits) {
            return Ok(Others::default());
        }
        let physics = &self.physics;
        let period = physics.natural_period();
        let kick = self.kick_event();
        let mut others = Others::default();
        if differs {
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
            let kick = kick.map(|kick| ("the kick", kick.time));
            let anchors = kick.into_iter().chain(first).chain(corners.map(|e| (corner, e.time)));
            let anchors: Vec<(&'static str, f64)> = anchors.collect();
            others.clock = clock::other_clock(&self.word, all, &anchors, period);
        }
        if let Some(clock) = others.clock.as_ref().filter(|clock| clock.counts_from.is_some()) {
            diagnosis::add_clock(causes, clock);
            return Ok(others);
        }
        let kick = match kick {
            None => None,
            Some(kick) => self.kicks()?.into_iter().find(|(event, _)| *event == kick),
        };
        let kick = kick.map(|(event, states)| (event.time, states));
        let jumped = passes.as_ref().and_then(|passes| passes.jump.finish());
        let first = passes.as_ref().and_then(|passes| passes.jump.first());
        let has_rows = candidate.has_rows();
        let from = if has_rows { span.from } else { f64::NEG_INFINITY };
        let at_kick = kick.as_ref().map(|(time, (_, after))| Start::At(*time, after.clone()));
        let begins_at_kick = kick
            .as_ref()
            .is_some_and(|(time, _)| (time - period..time + period).contains(&from));
        let starts = match first {
            Some((time, state)) if time > self.start => vec![Start::At(time, state), Start::Case],
            Some(_) => vec![Start::Case],
            None if begins_at_kick => at_kick.into_iter().chain([Start::Case]).collect(),
            None => [Start::Case].into_iter().chain(at_kick.filter(|_| !has_rows)).collect(),
        };
        // Beyond the reference's end nobody knows what comes.
        let last = all.last().map_or(f64::NEG_INFINITY, |e| e.time);
        let to = span.to.max(last).min(self.end.max(last));
        let numbers = WrittenCase::of(&physics.case);
        let material = Material {
            numbers: &numbers,
            system: &physics.trains,
            places: &physics.places,
            stretches: passes.map(|passes| passes.stretches).filter(StretchPass::is_of_use),
            starts,
            word: all,
            covered: (from, to),
            period,
            breakaway: self.breakaway(found),
            events_differ: differs,
            by_events: !causes
                .iter()
                .any(|known| [Cause::AbsoluteAngles, Cause::RegularisedLaw, Cause::EventsLate].contains(&known.cause)),
        };
        if let Some(((time, states), jumped)) = kick.zip(jumped) {
            others.kick = other_kick(physics, (time, &states), &jumped).map(|mut other| {
                let reference = Start::At(time, states.1);
                other.rerun = material.confirmed_from(reference, Start::At(time, jumped.after));
                other
            });
        }
        if let Some(kick) = others.kick.as_ref().filter(|kick| kick.rerun.is_some()) {
            diagnosis::add_kick(causes, kick);
            return Ok(others);
        }
        let explained = other_parameters(material, others.kick.is_some());
        match (explained, &others.kick, &others.clock) {
            (Explained::Numbers(parameters), ..) => {
                others.clock = None;
                // Other equations lead to another state at the kick.
                others.kick = None;
                diagnosis::add_parameters(causes, &parameters);
                others.parameters = Some(parameters);
            }
            (Explained::Satisfied, Some(kick), _) => diagnosis::add_kick(causes, kick),
            (_, _, Some(clock)) => {
                diagnosis::add_clock(causes, clock);
                others.kick = None;
            }
            _ => others.kick = None,
        }
        Ok(others)
    }

    /// mu_0 by the torque that the reference tests, at the middle one of the candidate's breakaways, and what half of them differ by.
    fn breakaway(&self, found: &[Found]) -> Option<(f64, f64)> {
        let ratios = torques::breakaway_ratios(&self.physics, found, self.physics.trains.breakaway_test);
        let at = |share: usize| ratios.get(share * ratios.len() / 4).copied();
        let breakaway = self.physics.system().breakaway;
        Some((at(2)? * breakaway, (at(3)? - at(1)?) * breakaway))
    }

    /// Goes through the times, through the relative velocity if events have to be found by it, and through the twists for
    /// the torques at breakaways. The events are those of the candidate, or those found.
    fn survey(
        &self,
        candidate: &Candidate,
        detection: Detection,
        watch_progress: &mut dyn FnMut(u8, f64),
    ) -> Result<(Survey, Vec<Found>), CompareError> {
        let physics = &self.physics;
        let given = candidate.events.clone();
        if !candidate.has_rows() {
            return Ok((Survey::default(), given.unwrap_or_default()));
        }
        let twists = physics.torque_channels();
        let with_twists = !candidate.is_own() && twists.iter().all(|&channel| candidate.has(channel));
        let mut channels = Vec::new();
        if given.is_none() {
            channels.push(Channel::RelativeVelocity);
            channels.extend(Some(Channel::NormalForce).filter(|&force| candidate.has(force)));
        }
        let twist = channels.len();
        if with_twists {
            channels.extend_from_slice(&twists);
        }
        let torques = |block: &Block, row: usize| {
            with_twists.then(|| physics.torques_by(block.time[row], |k| block.columns[twist + k][row]))
        };
        let mut finder = match (given, physics.threshold()) {
            (Some(events), _) => Finder::Given(TorqueWatch::new(events)),
            (None, Some(_)) => Finder::Crossings(Crossings::new(detection.velocity_tolerance)),
            (None, None) => Finder::Detector(Box::new(Detector::new(detection))),
        };
        let mut rows = candidate.rows(&channels, physics)?;
        let mut block = Block::default();
        let mut span: Option<(f64, f64)> = None;
        // Samples in the stick-slip: how many, the first and the last, s.
        let (stretch, mut inside) = (self.stretch(), None);
        while rows.next(&mut block)? {
            let (time, c) = (&block.time, &block.columns);
            let to = time[time.len() - 1];
            span = Some((span.map_or(time[0], |span| span.0), to));
            watch_progress(1, to);
            let first = time.partition_point(|t| *t < stretch.0);
            let last = time.partition_point(|t| *t <= stretch.1);
            if first < last {
                let (count, from, _) = inside.unwrap_or((0, time[first], 0.0));
                inside = Some((count + (last - first) as u64, from, time[last - 1]));
            }
            let count = match &mut finder {
                Finder::Crossings(crossings) => {
                    time.iter()
                        .zip(&c[0])
                        .for_each(|(&time, &velocity)| crossings.add(time, velocity));
                    crossings.events.len()
                }
                Finder::Given(watch) => {
                    for (row, &time) in time.iter().enumerate() {
                        torques(&block, row)
                            .into_iter()
                            .for_each(|(rotor, stator)| watch.add(time, rotor, stator));
                    }
                    0
                }
                Finder::Detector(detector) => {
                    let forces = if twist == 2 { &c[1][..] } else { &[] };
                    let mut row = 0;
                    while row < time.len() {
                        row += detector.skip(&c[0][row..], forces.get(row..).unwrap_or_default());
                        detector.add(Point {
                            time: time[row],
                            velocity: c[0][row],
                            normal_force: forces.get(row).copied().unwrap_or(f64::INFINITY),
                            torques: torques(&block, row),
                        });
                        row += 1;
                    }
                    detector.count()
                }
            };
            if count > MOST_EVENTS {
                let what = format!("more than {MOST_EVENTS} events up to {to:.6} s: omega_r chatters about zero");
                let remedy = "raise --velocity-tolerance above the size of the chatter";
                return Err(CompareError::content(
                    &candidate.path,
                    "relative_velocity",
                    what,
                    remedy,
                ));
            }
        }
        if span.is_none() {
            return Err(CompareError::whole(
                &candidate.path,
                "holds no samples",
                "check how it was written",
            ));
        }
        let inside = inside.filter(|inside| inside.0 > 1);
        let survey = Survey {
            span,
            interval: inside.map(|(count, from, to)| (to - from) / (count - 1) as f64),
            plateau: match &finder {
                Finder::Detector(detector) => detector.plateau(),
                _ => 0.0,
            },
            repeated: rows.watch().repeated,
            rounding: candidate.clock.rounding.filter(|_| rows.watch().is_rounded()),
        };
        Ok((survey, finder.finish()))
    }

    /// What has to be added to the times of events so that they agree with those of the reference.
    fn offset(&self, found: &[Found]) -> Option<FoundOffset> {
        let word: Vec<SequenceEvent> = found.iter().map(SequenceEvent::from).collect();
        clock::find(&self.word, &word, self.physics.natural_period() / 8.0)
    }

    /// From ten natural periods before the first event of the word to the last one, s.
    fn stretch(&self) -> (f64, f64) {
        let margin = 10.0 * self.physics.natural_period();
        let first = self.word.first().map_or(0.0, |e| e.time - margin);
        (first, self.word.last().map_or(self.end, |e| e.time))
    }

    /// Which part of the reference the candidate covers. A table of events alone counts as whole.
    fn span(&self, candidate: &Candidate, survey: &Survey) -> Span {
        let (first, last) = (self.word.first(), self.word.last());
        let (mut from, mut to) = survey.span.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
        // Located events may lie a little outside the samples that show them.
        let margin = 0.25 * self.physics.natural_period();
        let from_start = first.is_none_or(|e| from <= e.time + margin) || !candidate.has_rows();
        let to_end = last.is_none_or(|e| to >= e.time - margin) || !candidate.has_rows();
        if from_start {
            from = from.min(first.map_or(from, |e| e.time));
        }
        if to_end {
            to = to.max(last.map_or(to, |e| e.time));
        }
        Span {
            from,
            // A candidate of another time altogether keeps its own.
            to: if from < self.end { to.min(self.end) } else { to },
            from_start,
            to_end,
        }
    }

    /// Times that should be the same in both runs: first and last event, or the ends.
    fn time_pairs(&self, candidate: &[SequenceEvent], survey: &Survey) -> Vec<(f64, f64)> {
        let firsts = self.word.first().zip(candidate.first());
        let lasts = self.word.last().zip(candidate.last());
        let of_events = firsts.into_iter().chain(lasts).map(|(r, c)| (r.time, c.time));
        let ends = survey.span.filter(|_| firsts.is_none()).map(|(_, to)| (self.end, to));
        of_events.chain(ends).collect()
    }

    fn states<'a>(
        &'a self,
        candidate: &Candidate,
        windows: Vec<windows::Window>,
        (detection, onset): (Detection, f64),
        position: Option<(Channel, (f64, f64))>,
        mut passes: Option<Passes<'a>>,
        watch_progress: &mut dyn FnMut(u8, f64),
    ) -> Result<States<'a>, CompareError> {
        let physics = &self.physics;
        let mut channels = candidate.channels(physics);
        // Impulses stand last: they are compared by themselves.
        channels.sort_by_key(|channel| channel.is_impulse());
        let compared = channels.iter().filter(|channel| !channel.is_impulse()).count();
        let mut impulses = ImpulsePass::new(&channels, || self.walk())?;
        let period = physics.natural_period();
        let kick = self.kick_event().map_or(f64::NEG_INFINITY, |kick| kick.time);
        let probes = [
            (kick - 2.0 * period, kick),
            (kick, kick + 2.0 * period),
            (onset - 4.0 * period, onset),
        ];
        let probes = probes.map(|(from, to)| Probe {
            from,
            to,
            points: Vec::new(),
        });
        let mut pass = StatePass::new(self.walk()?, physics, &channels[..compared], windows, probes.to_vec());
        let (state_columns, mut y) = (physics.columns(&channels), vec![0.0; physics.system().dimension]);
        let mut range = position.and_then(|(channel, (from, to))| {
            let column = channels.iter().position(|known| *known == channel)?;
            Some((column, Range::new(from, to)))
        });
        let mut energy = EnergyPass::new(physics, detection.velocity_tolerance, self.kick_works()?);
        // What a candidate of another program does in its equations.
        let mut creep = (!candidate.is_own()).then(|| CreepPass::new(physics));
        let mut rows = candidate.rows(&channels, physics)?;
        let mut block = Block::default();
        while rows.next(&mut block)? {
            pass.add(&block)?;
            if let Some(passes) = &mut passes {
                passes.stretches.add(&block);
                passes.jump.add(&block);
            }
            if let Some(impulses) = &mut impulses {
                impulses.add(&block)?;
            }
            if let Some(columns) = &state_columns {
                for (row, &time) in block.time.iter().enumerate() {
                    physics.set(&mut y, |k| block.columns[columns[k]][row]);
                    creep.iter_mut().for_each(|creep| creep.add(time, &y));
                    energy.add(time, &y);
                }
            }
            if let Some((column, range)) = &mut range {
                range.add(&block, *column);
            }
            watch_progress(PASSES, block.time[block.time.len() - 1]);
        }
        Ok(States {
            pass,
            passes,
            impulses: impulses.map_or_else(Vec::new, |impulses| impulses.finish(physics)),
            creep: creep.and_then(CreepPass::finish).filter(|_| physics.sticks()),
            amplitude: range.and_then(|(_, range)| range.amplitude()),
            energy: energy.finish(),
        })
    }

    /// The periodic motion of a candidate's events, whose times are known to `slack` (s), with where its last period begins (s).
    fn attractor_of(&self, events: &[SequenceEvent], slack: f64) -> Option<(Attractor, f64)> {
        let reference = self.attractor.map(|attractor| (&self.word[..], attractor.period));
        Attractor::of_events(events, slack, reference)
    }

    /// Of what a candidate's attractor has its amplitude, and over which time (s).
    fn position(&self, candidate: &Candidate, events: &[SequenceEvent], slack: f64) -> Option<(Channel, (f64, f64))> {
        if self.physics.coasts() {
            return None;
        }
        let position = self.physics.position().filter(|&channel| candidate.has(channel))?;
        let (attractor, from) = self.attractor_of(events, slack)?;
        Some((position, (from, from + attractor.period)))
    }

    /// Every kick, with the states before and after it.
    fn kicks(&self) -> Result<Vec<(&Event, BeforeAndAfter)>, ResultError> {
        let states = states_at_events(&self.file, &self.physics.course, &self.events)?;
        let kicks = self.events.iter().zip(states);
        Ok(kicks.filter(|(event, _)| event.kind == EventKind::Kick).collect())
    }

    /// Time (s) and work (J) of each kick.
    fn kick_works(&self) -> Result<Vec<(f64, f64)>, ResultError> {
        let physics = &self.physics;
        let kinetic = |t: f64, y: &[f64]| physics.system().kinetic_energy(&physics.course.driving(t), y);
        let work = |(e, (before, after)): (&Event, BeforeAndAfter)| kinetic(e.time, &after) - kinetic(e.time, &before);
        let kicks = self.kicks()?.into_iter();
        Ok(kicks.map(|kick| (kick.0.time, work(kick))).collect())
    }
}

/// Where the events of a candidate come from.
enum Finder {
    /// It states them, and its samples have the torques before them.
    Given(TorqueWatch),
    /// Its relative velocity, of a contact that sticks, and of one that does not.
    Detector(Box<Detector>),
    Crossings(Crossings),
}

impl Finder {
    /// The events, after the last sample.
    fn finish(self) -> Vec<Found> {
        match self {
            Finder::Given(watch) => watch.events,
            Finder::Detector(detector) => detector.finish(),
            Finder::Crossings(crossings) => crossings.events,
        }
    }
}

/// The case that a result file holds.
fn saved_case(path: &Path, file: &ResultFile) -> Result<Case, CompareError> {
    let source = CaseSource::result(path, file.resolved()?);
    let refused = |why| CompareError::whole(path, format!("its case cannot be read: {why}"), "repeat the run");
    Case::read(&source, &[]).map_err(refused)
}

/// What is collected of a candidate to find another number of the case in.
struct Passes<'a> {
    stretches: StretchPass,
    jump: JumpPass<'a>,
}

/// What a candidate has otherwise than the case says.
#[derive(Default)]
struct Others {
    clock: Option<OtherClock>,
    kick: Option<OtherKick>,
    parameters: Option<OtherParameters>,
}

/// What the times of a candidate resolve, if they are rounded.
fn resolution_of(candidate: &Candidate, survey: &Survey, errors: &EventErrors) -> Option<Resolution> {
    /// The error of an event found in samples: those of the samples around it, in distances of times.
    const FOUND: f64 = 2.0;
    let clock = &candidate.clock;
    let stated = candidate.events.is_some();
    let rounding = survey.rounding.or(candidate.events_rounding.filter(|_| stated))?;
    let of_event = if stated {
        candidate.events_rounding
    } else {
        survey.rounding
    };
    let last = errors.events.last().map(|event| event.time + event.error);
    let at = last.or(survey.span.map(|(_, to)| to)).unwrap_or(0.0);
    let limit = |time: f64| {
        let several = if stated { 1.0 } else { FOUND };
        of_event.map_or(0.0, |rounding| several * clock.quantum(rounding, time))
    };
    let below = |event: &&event_errors::EventError| event.error.abs() <= limit(event.time + event.error);
    Some(Resolution {
        of: rounding.name(),
        seconds: clock.quantum(rounding, at),
        at,
        repeated: survey.repeated,
        event_error: limit(at),
        events_below: errors.events.iter().filter(below).count(),
    })
}

/// What the pass over the states gives.
struct States<'a> {
    pass: StatePass<'a>,
    passes: Option<Passes<'a>>,
    impulses: Vec<ImpulseErrors>,
    energy: Option<EnergyDrift>,
    /// Of a candidate by another program: how it creeps.
    creep: Option<Creep>,
    /// Half of the range of a candidate's position over its last period, rad.
    amplitude: Option<f64>,
}
