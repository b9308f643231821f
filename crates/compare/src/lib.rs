//! What is wrong with that other solver? Its result is compared with a reference: the event sequence, the times of the events, then
//! the states.
//!
//! A [`Reference`] is opened once, from a result file or from the folder of a benchmark problem, and compares any number of
//! candidates. A candidate is a result file of this program, a file of another one with a time column and channels, or a table of
//! events; a [`Mapping`] names its columns and their units. Events that it does not state are found in its relative velocity.
//! The event sequences are aligned first ([`stickslip_system::record::sequence`]). Matched events give the errors of event times, and
//! the stretches in which both runs are in the same segment. There the channels are compared with the reference sample by sample,
//! and nothing is compared across an event. A [`CauseKind`] is named if the reference's run with the mistake reproduces the
//! candidate. The [`Comparison`] has all of it.
//!
//! A reference, and a table of the events of a solver that is a microsecond late at the second one:
//!
//! ```
//! use stickslip_case::{Case, CaseSource, Override};
//! use stickslip_compare::{Mapping, Reference};
//! use stickslip_engine::Run;
//! use stickslip_files::{Header, Overwrite, ResultWriter, Status, StickSlipTable};
//!
//! let folder = tempfile::tempdir()?;
//! let path = folder.path().join("paper-si.h5");
//! let case = Case::read(&CaseSource::built_in("paper-si")?, &[Override::parse("solver.method=series")?])?;
//! let header = Header { title: case.title.clone(), resolved: case.resolved(), ..Header::default() };
//! let mut writer = ResultWriter::create(&path, Overwrite::OwnResults, &[], &header)?;
//! Run::new(&case).record(&mut writer).start()?;
//! writer.finish(Status::Complete, &StickSlipTable::default(), 0.0)?;
//!
//! let events = stickslip_files::ResultFile::open(&path)?.events()?;
//! let mut table = "time,kind\n".to_owned();
//! for (number, event) in events.iter().filter(|event| event.kind.in_event_sequence()).enumerate() {
//!     let late = if number == 1 { 1e-6 } else { 0.0 };
//!     table += &format!("{},{}\n", event.time + late, event.kind.name());
//! }
//! let mine = folder.path().join("mine.csv");
//! std::fs::write(&mine, table)?;
//!
//! let reference = Reference::open(&path)?;
//! let mapping = Mapping { quick: true, ..Mapping::default() }; // without a search for the cause
//! let comparison = reference.compare(&mine, &mapping)?;
//! assert_eq!((comparison.missing, comparison.spurious), (0, 0));
//! let worst = comparison.event_errors.max.ok_or("no event")?;
//! assert!((worst - 1e-6).abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The crate neither prints nor draws. It takes a reference as true. Which of its digits are, the certificate of the reference says
//! (`stickslip-analysis`).

pub mod benchmark;
mod candidate;
#[doc(hidden)]
pub mod causes;
mod comparison;
#[doc(hidden)]
pub mod detect;
mod diagnosis;
mod error;
#[doc(hidden)]
pub mod event_errors;
mod follows;
mod integrals;
mod locate;
pub mod reference;
#[doc(hidden)]
pub mod resolution;
mod score;
mod states;
#[doc(hidden)]
pub mod statistics;
mod summary;
#[doc(hidden)]
pub mod survey;
mod trajectory;
#[doc(hidden)]
pub mod vocabulary;

pub(crate) use candidate::Candidate;

pub use candidate::{Block, Mapping, TimeOffset};
pub use causes::clock::{FoundOffset, OtherClock};
pub use causes::{Agreement, EventAgreement as TriedAgain, FoundBy, OtherKick, OtherNumber, OtherParameters};
pub use comparison::{Absent, ChannelErrors, Closest, Comparison, Requirement, Span, Unexplained};
pub use detect::{Detection, Detector, Found, HysteresisEffect, Point};
pub use diagnosis::{CaseDifference, CauseKind, Diagnosis};
pub use error::{CompareError, OutOfTime};
pub use event_errors::{CycleErrors, EventError, WrongEvent};
pub use follows::Follows;
pub use integrals::{EnergyDrift, ImpulseErrors};
pub use resolution::{Resolution, Rounding};
pub use score::{CreepScore, PeriodScore, PositionScore, RestScore, Score};
pub use statistics::{ComparedAttractor, Statistic};
pub use trajectory::Trajectory;
pub use vocabulary::{Channel, Vocabulary};

use benchmark::BenchmarkProblem;
use causes::smooth::{Creep, CreepPass};
use causes::{Causes, EXPLAINED, JumpPass, ObservationPass, Passes, Shown, clock};
use comparison::channel_errors;
use detect::{DEFAULT_HYSTERESIS, DEFAULT_TOLERANCE, HysteresisPass};
use error::{DEFAULT_WALL_TIME, Limit};
use event_errors::EventErrors;
use integrals::{EnergyPass, ImpulsePass};
use reference::{BeforeAndAfter, Physics, Rerun as RepeatedRun, states_at_events};
use score::ScorePass;
use states::{Grid, Phase, StatePass, Window, windows, without_small_shifts};
use statistics::{PositionRange, of_attractors, statistics};
use std::fmt::Arguments;
use std::path::Path;
use std::sync::Mutex;
use stickslip_case::quantity::Dimension;
use stickslip_case::{Case, CaseSource};
use stickslip_files::{ResultError, ResultFile, open_sound};
use stickslip_system::model::Mode;
use stickslip_system::record::sequence::{Alignment, SequenceEvent};
use stickslip_system::record::{Event, EventKind};
use stickslip_system::watch::Watch;
use survey::{FOUND, Survey, resolution_of, sequence, without_open_contact};

/// Errors of stated event times up to this, s, need no explanation; and of events found in samples.
const AGREED: f64 = 1e-9;
const AGREED_IN_SAMPLES: f64 = 1e-7;

/// A reference, opened once for any number of candidates.
#[derive(Debug)]
pub struct Reference {
    file: ResultFile,
    physics: Physics,
    rerun: RepeatedRun,
    attractor: Option<ComparedAttractor>,
    starts_in_slip: bool,
    starts_in_stick: bool,
    events: Vec<Event>,
    word: Vec<SequenceEvent>,
    start: f64,
    end: f64,
    problem: Option<BenchmarkProblem>,
}

/// Largest velocity tolerance for a reference that is at rest or slower, rad/s or m/s.
const LEAST_SPEED: f64 = 0.01;

/// A sample of a candidate.
#[derive(Debug, Clone, Copy)]
pub struct SamplePair<'a> {
    /// Time, s.
    pub time: f64,
    /// Candidate's channels, in SI units, in the order of [`Reference::traced`].
    pub candidate: &'a [f64],
    /// Reference's channels at that time; `None` outside the reference, and where it is unknown between samples.
    pub reference: Option<&'a [f64]>,
}

impl Reference {
    /// Opens the folder of a problem of a benchmark set as a reference. `integrate` runs a case into a result file at a
    /// path; its error is a message.
    ///
    /// # Errors
    /// If the folder is no problem of a set, or the run fails.
    pub fn of_problem(
        folder: &Path,
        integrate: impl FnOnce(&Case, &Path) -> Result<(), String>,
    ) -> Result<Reference, CompareError> {
        let problem = BenchmarkProblem::open(folder, integrate)?;
        let mut reference = Reference::open(&problem.run())?;
        for column in &problem.columns {
            reference.physics.vocabulary.also(&column.channel, &column.name);
        }
        reference.physics.kinds_are_events = true;
        reference.problem = Some(problem);
        Ok(reference)
    }

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
        file.check_times()?;
        let (start, end) = if rows > 0 {
            (file.column("time", 0..1)?[0], file.column("time", rows - 1..rows)?[0])
        } else {
            (0.0, last.max(0.0))
        };
        let word = sequence(&events, true);
        let first = file.states(0..rows.min(1))?;
        Ok(Reference {
            physics: Physics::new(case, &word, end),
            word,
            rerun: RepeatedRun::default(),
            attractor: ComparedAttractor::of_file(&file)?,
            starts_in_slip: first.iter().any(|(_, mode, _)| mode.sense() != 0),
            starts_in_stick: first.iter().any(|(_, mode, _)| *mode == Mode::Stick),
            file,
            events,
            start,
            end,
            problem: None,
        })
    }

    /// An empty mapping with the names and units of this reference.
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
        self.compare_watched(path, mapping, &())
    }

    /// Like [`Self::compare`], and reports the progress after each block of samples and each run. All stages have the
    /// same weight.
    pub fn compare_watched(
        &self,
        path: &Path,
        mapping: &Mapping,
        watch: &dyn Watch,
    ) -> Result<Comparison, CompareError> {
        let physics = &self.physics;
        let limit = Limit::from_now(mapping.max_wall_time.unwrap_or(DEFAULT_WALL_TIME));
        self.rerun.limit.set(Some(limit));
        // Runs of causes end on several threads, and further runs may be added: a smaller share than before is not reported.
        let reported = Mutex::new(0.0);
        let say = |stage: f64, share: f64, what: Arguments<'_>| {
            let done = (stage + share) / if mapping.quick { 2.0 } else { 3.0 };
            if let Ok(mut reported) = reported.lock()
                && done >= *reported
            {
                *reported = done;
                let _ = watch.at(done, 1.0, format_args!("{}: {what}", path.display()));
            }
        };
        let passed = |time: f64| match (time - self.start) / (self.end - self.start) {
            share if share.is_nan() => 1.0,
            share => share.clamp(0.0, 1.0),
        };
        let events_up_to = |time: f64| say(0.0, passed(time), format_args!("events, t = {time:.6} s"));
        let states_up_to = |time: f64| say(1.0, passed(time), format_args!("states, t = {time:.6} s"));
        let runs_done = |runs: usize, of: usize| match of {
            0 => say(2.0, runs as f64, format_args!("trying causes")),
            _ => say(
                2.0,
                runs as f64 / of as f64,
                format_args!("trying causes, {runs} of {of} runs"),
            ),
        };
        let mut candidate = Candidate::open(path, mapping, physics)?;
        let detection = self.detection(&candidate, mapping)?;
        if let TimeOffset::Seconds(offset) = mapping.time_offset {
            candidate.shift(offset);
        }
        let events_given = candidate.events.is_some();
        let shows_contact = events_given || candidate.has(Channel::NORMAL_FORCE);
        let own = sequence(&self.events, shows_contact);
        let (mut survey, mut found) = self.survey(&candidate, detection, &events_up_to)?;
        let mut applied = None;
        if mapping.time_offset == TimeOffset::Auto {
            let offset = self.offset(&own, &found).ok_or_else(|| {
                let what = "no offset of the clock makes four events in five agree with the reference's";
                CompareError::content(path, "time_offset", what, "give it in seconds, --time-offset 6.966")
            })?;
            candidate.shift(offset.seconds);
            applied = Some(offset);
            (survey, found) = self.survey(&candidate, detection, &events_up_to)?;
        }
        if !shows_contact {
            found = without_open_contact(&found, &self.events);
        }
        let interval = survey.interval.unwrap_or(0.0);
        // A candidate that slips from rest at once has omega_r = 0 in its first sample, which is no stick.
        let begins = match survey.span {
            Some((begins, _)) if self.starts_in_slip && !events_given => begins + interval,
            _ => f64::NEG_INFINITY,
        };
        let at_once = |event: &Found| event.kind == EventKind::Slip && event.time <= begins;
        if found.first().is_some_and(at_once) {
            found.remove(0);
        }
        let span = self.span(&candidate, &survey);

        let all: Vec<SequenceEvent> = found.iter().map(SequenceEvent::from).collect();
        let within = |e: &&SequenceEvent| e.time >= span.from && e.time <= span.to;
        let reference_word: Vec<SequenceEvent> = own.iter().filter(within).copied().collect();
        let word: Vec<SequenceEvent> = all.iter().filter(within).copied().collect();
        let bound_of = |event: &Found| match candidate.events_rounding.filter(|_| events_given) {
            Some(rounding) => candidate.clock.quantum(rounding, event.time),
            None => event.bound,
        };
        let bounds = found.iter().filter(|event| within(&&SequenceEvent::from(*event)));
        let bounds: Vec<f64> = bounds.map(bound_of).collect();
        let uncovered = own.len() - reference_word.len();
        let period = physics.natural_period();
        let mut alignment = Alignment::of(&reference_word, &word, period);
        // In a run of many cycles a drift of the times is no exchange of events.
        if !physics.coasts() && !alignment.differences.is_empty() {
            alignment = Alignment::drifting(&reference_word, &word, period, alignment);
        }
        if !events_given {
            alignment.mark_unseen(&reference_word, interval);
        }
        let errors = EventErrors::of(&reference_word, &word, &bounds, &alignment);

        // With a shifted clock nearly all events lack a partner or have a wrong one.
        let parted = errors.matched * 2 < found.len() || errors.max.is_some_and(|max| max > period / 8.0);
        let proposed = match mapping.time_offset {
            TimeOffset::None if parted => self.offset(&own, &found),
            _ => None,
        };
        // In another motion some events agree by chance after a shift; with a shifted clock all do.
        let proposed = proposed.filter(|offset| {
            let all = 20 * offset.agree >= 19 * offset.of && offset.rms <= period / 50.0;
            all && offset.seconds.abs() > period / 8.0
        });
        let resolution = resolution_of(&candidate, &survey, &errors);
        let resolved = resolution.as_ref().map_or(0.0, |resolution| resolution.event_error);
        let resolved = if events_given { resolved } else { resolved.max(interval) };
        let first_wrong = WrongEvent::first(&errors, &alignment.differences, period, resolved);
        // Both ends of a period found in samples may err by an interval.
        let slack = if events_given { 0.0 } else { 2.0 * interval };
        let mut states = if candidate.has_rows() {
            let mut windows = windows(&reference_word, &word, &alignment, span.from_start, span.to_end);
            if !events_given {
                without_small_shifts(&mut windows, interval);
            }
            let position = self.position(&candidate, &all, slack);
            let wrong = first_wrong.as_ref().map_or(span.from, |event| event.time);
            let passes = self.passes(&candidate, (wrong - period, wrong + period));
            let found = (!events_given).then_some((&found[..], begins));
            self.states(&candidate, windows, (detection, found), position, passes, &states_up_to)?
        } else {
            States::default()
        };
        let attractors = (!physics.coasts()).then(|| {
            let found = candidate.attractor.or_else(|| {
                let (attractor, _) = self.attractor_of(&all, slack).filter(|_| !candidate.is_own())?;
                let amplitude = states.amplitude;
                Some(ComparedAttractor { amplitude, ..attractor })
            });
            [self.attractor, found]
        });

        let of_time = diagnosis::unit_of_time(&self.time_pairs(&all, &survey));
        let mut unit_faults: Vec<_> = of_time.into_iter().collect();
        if let Some(pass) = &states.pass {
            let together = [Phase::Sliding, Phase::StickSlip, Phase::After];
            let of_channel = |(k, &channel): (usize, &Channel)| {
                let tallies = together.map(|phase| pass.tallies(phase)[k]);
                diagnosis::unit_of_channel(channel, physics.vocabulary(), &tallies)
            };
            unit_faults.extend(pass.channels.iter().enumerate().filter_map(of_channel));
        }
        unit_faults.retain(|fault| fault.explained >= EXPLAINED);
        // A motion negated as a whole is another phase, torque or start of a symmetric system.
        let opposite = unit_faults.iter().filter(|fault| fault.is_opposite()).count();
        if opposite > 1 && states.pass.as_ref().is_some_and(|pass| pass.channels.len() == opposite) {
            unit_faults.clear();
        }
        let mut found_causes = Causes {
            said: unit_faults.iter().map(diagnosis::wrong_units).collect(),
            ..Causes::default()
        };
        // The case of a result file already shows the differences.
        if !candidate.is_own() && unit_faults.is_empty() && !mapping.quick {
            let floor = resolution.as_ref().map_or(0.0, |resolution| resolution.event_error);
            let shown = Shown {
                candidate: &candidate,
                reference: &own,
                covered: &reference_word,
                alignment: &alignment,
                found: &found,
                grid: states.pass.as_ref().map_or(Grid::default(), |pass| pass.grid),
                plateau: survey.plateau,
                creep: states.creep,
                shows_contact,
                limit,
                span,
                word: &all,
                offset: proposed,
                // The events of a solver that switches at samples are uncertain by some intervals, whatever the bounds
                // are.
                bound: floor.max(match events_given {
                    true => AGREED,
                    false => bounds
                        .iter()
                        .copied()
                        .fold(AGREED_IN_SAMPLES.max(FOUND * interval), f64::max),
                }),
                rounding: self.rounding(&candidate, &survey),
                worst: match alignment.differences.iter().all(|d| d.shorter_than_interval) {
                    true => errors.max,
                    false => Some(f64::INFINITY),
                },
                wrong: first_wrong.as_ref().map(|event| event.time),
                tolerance: detection.velocity_tolerance,
                detected: (!events_given).then_some(detection),
            };
            found_causes = self.causes(&shown, states.passes.take(), &runs_done)?;
        }
        let mut causes = found_causes.said;
        diagnosis::add_case(&mut causes, candidate.differences());

        let mut statistics = statistics(&reference_word, &word, (span.from_start, span.to_end), uncovered);
        if let Some(attractors) = &attractors {
            statistics.retain(|statistic| attractors[0].is_none() || statistic.name != "final_stick");
            let unit = physics.vocabulary().motion().dimension(Dimension::Angle).unit();
            statistics.extend(of_attractors(attractors, unit));
        }
        let (was_rerun, pass) = (self.was_repeated(), states.pass.as_ref());
        let coarsest = candidate.coarsest(&self.seen_by(&candidate)).filter(|_| !events_given);
        let problem = self.problem.as_ref();
        let mut comparison = Comparison {
            reference: match problem {
                Some(problem) => problem.folder.display().to_string(),
                None => self.file.path().display().to_string(),
            },
            reference_changed: self.file.changed(),
            candidate: candidate.path.display().to_string(),
            format: candidate.format,
            resolution,
            time_offset: Some(candidate.clock.offset).filter(|offset| *offset != 0.0),
            found_time_offset: applied.or(proposed),
            verdict: String::new(),
            summary: Vec::new(),
            causes,
            case_differences: candidate.differences().to_vec(),
            parameters: found_causes.parameters,
            kick: found_causes.kick,
            clock: found_causes.clock,
            unexplained: found_causes.unexplained,
            out_of_time: found_causes.out_of_time,
            values: coarsest.map(Rounding::name),
            agrees_to_resolution: false,
            detection: (!events_given).then_some(detection),
            score: states.score.as_ref().and_then(|score| self.score(score, span)),
            hysteresis: states.hysteresis,
            natural_period: period,
            velocity_unit: physics.vocabulary().unit(Channel::RELATIVE_VELOCITY),
            span: candidate.has_rows().then_some(span),
            interval: survey.interval,
            reference_events: reference_word.len(),
            uncovered,
            candidate_events: word.len(),
            missing: alignment.missing(),
            spurious: alignment.spurious(),
            sequence: alignment.differences,
            first_wrong,
            cycles: (!physics.coasts()).then(|| CycleErrors::of(&errors)).flatten(),
            event_errors: errors,
            statistics,
            channels: pass.map_or_else(Vec::new, |pass| channel_errors(pass, physics)),
            samples: pass.map_or(0, StatePass::samples),
            samples_outside: pass.map_or(0, StatePass::samples_outside),
            samples_too_sparse: pass.map_or(0, StatePass::too_sparse),
            reference_repeated: pass.is_some_and(StatePass::integrated) || was_rerun,
            was_rerun,
            energy_drift: states.energy,
            impulses: states.impulses,
            time_scale: (!physics.coasts()).then(|| physics.scale.clone()),
            attractors,
            absent: candidate.left_out().map(Absent::of).collect(),
            score_command: problem.and_then(|problem| problem.score_command(path, &candidate, mapping)),
        };
        let lacking = physics.state.iter().filter(|&&channel| !candidate.has(channel));
        comparison.find_absent(&lacking.map(|channel| channel.name()).collect::<Vec<_>>());
        if !shows_contact {
            comparison.leave_out_contacts(&self.events, span);
        }
        let creeps = self.last_stick().is_some() && states.creep.is_some();
        comparison.find_verdict(mapping.quick, creeps);
        Ok(comparison)
    }

    /// The time scale, s.
    pub fn natural_period(&self) -> f64 {
        self.physics.natural_period()
    }

    /// The channels of a candidate that [`Self::trace`] gives; none for an event table.
    ///
    /// # Errors
    /// If the candidate cannot be read.
    pub fn traced(&self, path: &Path, mapping: &Mapping) -> Result<Vec<Channel>, CompareError> {
        let candidate = Candidate::open(path, mapping, &self.physics)?;
        Ok(match candidate.has_rows() {
            true => candidate.compared_channels(&self.physics),
            false => Vec::new(),
        })
    }

    /// Passes every sample of a candidate to `take`, with the reference at the same time. Errors of states in a
    /// comparison are timed from the last matched event instead.
    ///
    /// # Errors
    /// If the candidate or the reference cannot be read.
    pub fn trace(&self, path: &Path, mapping: &Mapping, take: &mut dyn FnMut(SamplePair)) -> Result<(), CompareError> {
        let candidate = Candidate::open(path, mapping, &self.physics)?;
        if !candidate.has_rows() {
            return Ok(());
        }
        let channels = candidate.compared_channels(&self.physics);
        let mut reference = self.evaluator(&channels)?;
        let mut rows = candidate.rows(&channels, &self.physics)?;
        let mut block = Block::default();
        let (mut own, mut other) = (vec![0.0; channels.len()], vec![0.0; channels.len()]);
        while rows.next(&mut block)? {
            for (row, &time) in block.time.iter().enumerate() {
                for (value, column) in own.iter_mut().zip(&block.columns) {
                    *value = column[row];
                }
                let known = reference.known_at(time, &mut other)?;
                take(SamplePair {
                    time,
                    candidate: &own,
                    reference: known.then_some(&other[..]),
                });
            }
        }
        Ok(())
    }

    fn detection(&self, candidate: &Candidate, mapping: &Mapping) -> Result<Detection, CompareError> {
        // A contact without stick has one threshold for the beginning and the end of a stick.
        let threshold = self.physics.threshold();
        let refused =
            |place: &str, what: &str, remedy: &str| Err(CompareError::content(&candidate.path, place, what, remedy));
        if threshold.is_some() && mapping.hysteresis.is_some() {
            let what = "the contact of the reference has no stick, and its events are the crossings of one threshold";
            let remedy = "leave out --hysteresis, or [detection].hysteresis; --velocity-tolerance is the threshold";
            return refused("hysteresis", what, remedy);
        }
        if let Some(tolerance) = mapping.velocity_tolerance.filter(|_| candidate.events.is_none()) {
            let largest = self.largest_speed()?.max(LEAST_SPEED);
            if tolerance > largest {
                let unit = self.physics.vocabulary().unit(Channel::RELATIVE_VELOCITY);
                let what = format!(
                    "at {tolerance:.3e} {unit} every slip is a stick: the reference is never faster than {largest:.3e} {unit}"
                );
                let remedy = "give a --velocity-tolerance that only a contact at rest is below";
                return refused("velocity tolerance", &what, remedy);
            }
        }
        // Rounding of a relative velocity of zero, with a margin.
        let of_times = candidate.clock_error_of(Channel::RELATIVE_VELOCITY, &self.physics, self.times());
        let printed = 1.01 * (candidate.rounding_of(Channel::RELATIVE_VELOCITY, 0.0) + of_times);
        let default = DEFAULT_TOLERANCE.max(printed);
        Ok(Detection {
            velocity_tolerance: mapping.velocity_tolerance.or(threshold).unwrap_or(default),
            hysteresis: match threshold {
                Some(_) => 1.0,
                None => mapping.hysteresis.unwrap_or(DEFAULT_HYSTERESIS),
            },
        })
    }

    /// Largest magnitude of the reference's relative velocity, rad/s.
    fn largest_speed(&self) -> Result<f64, CompareError> {
        let mut largest = 0.0_f64;
        for block in self.file.column_blocks(&Channel::RELATIVE_VELOCITY.name())? {
            largest = block?.into_iter().fold(largest, |most, speed| most.max(speed.abs()));
        }
        Ok(largest)
    }

    fn seen_by(&self, candidate: &Candidate) -> Vec<Channel> {
        let state = &self.physics.state;
        match state.iter().all(|&channel| candidate.has(channel)) {
            true => [&state[..], &[Channel::RELATIVE_VELOCITY]].concat(),
            false => vec![Channel::RELATIVE_VELOCITY],
        }
    }

    /// Mean square effect of rounding in a candidate's file on its samples, in parts of the channels' sizes.
    fn rounding(&self, candidate: &Candidate, survey: &Survey) -> f64 {
        // A motion may exceed its size by this factor.
        const LARGER: f64 = 2.0;
        let physics = &self.physics;
        let channels: Vec<Channel> = candidate.channels(physics);
        let square = |&channel: &Channel| {
            let size = physics.size(channel, false);
            (candidate.rounding_of(channel, LARGER * size) / size).powi(2)
        };
        let of_values = channels.iter().map(square).sum::<f64>() / channels.len().max(1) as f64;
        let to = survey.span.map_or(0.0, |(_, to)| to);
        let quantum = survey
            .rounding
            .map_or(0.0, |rounding| candidate.clock.quantum(rounding, to));
        of_values + (LARGER * physics.natural_angular_frequency() * quantum / 2.0).powi(2)
    }

    fn passes(&self, candidate: &Candidate, window: (f64, f64)) -> Option<Passes<'_>> {
        if candidate.is_own() {
            return None;
        }
        let physics = &self.physics;
        let channels = candidate.channels(physics);
        let kick = self.kick_event().map_or(f64::INFINITY, |kick| kick.time);
        Some(Passes {
            jump: JumpPass::new(physics, &channels, kick),
            observation: ObservationPass::new(&channels, candidate, window),
        })
    }

    fn kick_event(&self) -> Option<&Event> {
        let onset = self.word.first().map_or(f64::INFINITY, |e| e.time);
        self.events
            .iter()
            .rfind(|e| e.kind == EventKind::Kick && e.time < onset)
    }

    fn offset(&self, own: &[SequenceEvent], found: &[Found]) -> Option<FoundOffset> {
        let word: Vec<SequenceEvent> = found.iter().map(SequenceEvent::from).collect();
        clock::find(own, &word, self.physics.natural_period() / 8.0)
    }

    /// From ten natural periods before the first event of the word to the last one, s.
    fn stretch(&self) -> (f64, f64) {
        let margin = 10.0 * self.physics.natural_period();
        let first = self.word.first().map_or(0.0, |e| e.time - margin);
        (first, self.word.last().map_or(self.end, |e| e.time))
    }

    fn span(&self, candidate: &Candidate, survey: &Survey) -> Span {
        let (first, last) = (self.word.first(), self.word.last());
        let (mut from, mut to) = survey.span.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
        // Located events may lie slightly outside the samples that show them.
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
            // A candidate that starts after the reference's end keeps its own end.
            to: if from < self.end { to.min(self.end) } else { to },
            from_start,
            to_end,
        }
    }

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
        windows: Vec<Window>,
        (detection, found): (Detection, Option<(&[Found], f64)>),
        position: Option<(Channel, (f64, f64))>,
        mut passes: Option<Passes<'a>>,
        progress: &dyn Fn(f64),
    ) -> Result<States<'a>, CompareError> {
        let physics = &self.physics;
        let mut channels = candidate.channels(physics);
        // Impulses are last, because they are compared separately.
        channels.sort_by_key(|channel| channel.is_impulse());
        let compared = channels.iter().filter(|channel| !channel.is_impulse()).count();
        let mut impulses = ImpulsePass::new(&channels, |forces| self.walk(forces))?;
        let compared = &channels[..compared];
        let walks = [self.walk(compared)?, self.walk(compared)?];
        let mut pass = StatePass::new(walks, physics, compared, windows);
        let (state_columns, mut y) = (physics.columns(&channels), vec![0.0; physics.system().dimension]);
        let mut range = position.and_then(|(channel, (from, to))| {
            let column = channels.iter().position(|known| *known == channel)?;
            Some((column, PositionRange::new(from, to)))
        });
        let mut hysteresis = found.and_then(|(found, begins)| HysteresisPass::new(&channels, detection, found, begins));
        let mut score = self.score_pass(&channels)?;
        let mut energy = EnergyPass::new(physics, detection.velocity_tolerance, self.kick_works()?);
        let mut creep = (!candidate.is_own()).then(|| CreepPass::new(physics));
        let mut rows = candidate.rows(&channels, physics)?;
        let mut block = Block::default();
        while rows.next(&mut block)? {
            pass.add(&block)?;
            if let Some(passes) = &mut passes {
                passes.jump.add(&block);
                passes.observation.add(&block);
            }
            impulses.as_mut().map_or(Ok(()), |impulses| impulses.add(&block))?;
            if let Some(columns) = &state_columns {
                for (row, &time) in block.time.iter().enumerate() {
                    physics.set(&mut y, |k| block.columns[columns[k]][row]);
                    creep.iter_mut().for_each(|creep| creep.add(time, &y));
                    energy.add(time, &y);
                }
            }
            score.as_mut().map_or(Ok(()), |score| score.add(&block))?;
            hysteresis.iter_mut().for_each(|hysteresis| hysteresis.add(&block));
            range.iter_mut().for_each(|(column, range)| range.add(&block, *column));
            progress(block.time[block.time.len() - 1]);
        }
        Ok(States {
            pass: Some(pass.finish()),
            passes,
            impulses: impulses.map_or_else(Vec::new, |impulses| impulses.finish(physics)),
            creep: creep.and_then(CreepPass::finish).filter(|_| physics.sticks()),
            amplitude: range.and_then(|(_, range)| range.amplitude()),
            energy: energy.finish(),
            hysteresis: hysteresis.map(HysteresisPass::finish),
            score,
        })
    }

    /// Attractor of a candidate's events and the start of its last period (s); `slack`: uncertainty of the times, s.
    fn attractor_of(&self, events: &[SequenceEvent], slack: f64) -> Option<(ComparedAttractor, f64)> {
        let reference = self.attractor.map(|attractor| (&self.word[..], attractor.period));
        ComparedAttractor::of_events(events, slack, reference)
    }

    /// The channel that shows the amplitude of a candidate's attractor, and the time (s) of a period.
    fn position(&self, candidate: &Candidate, events: &[SequenceEvent], slack: f64) -> Option<(Channel, (f64, f64))> {
        if self.physics.coasts() {
            return None;
        }
        let position = self.physics.position().filter(|&channel| candidate.has(channel))?;
        let (attractor, from) = self.attractor_of(events, slack)?;
        Some((position, (from, from + attractor.period)))
    }

    fn kicks(&self) -> Result<Vec<(&Event, BeforeAndAfter)>, ResultError> {
        let states = states_at_events(&self.file, &self.physics.course, &self.events)?;
        let kicks = self.events.iter().zip(states);
        Ok(kicks.filter(|(event, _)| event.kind == EventKind::Kick).collect())
    }

    fn kick_works(&self) -> Result<Vec<(f64, f64)>, ResultError> {
        let physics = &self.physics;
        let kinetic = |t: f64, y: &[f64]| physics.system().kinetic_energy(&physics.course.driving(t), y);
        let work = |(e, (before, after)): (&Event, BeforeAndAfter)| kinetic(e.time, &after) - kinetic(e.time, &before);
        let kicks = self.kicks()?.into_iter();
        Ok(kicks.map(|kick| (kick.0.time, work(kick))).collect())
    }
}

fn saved_case(path: &Path, file: &ResultFile) -> Result<Case, CompareError> {
    let source = CaseSource::result(path, file.resolved()?);
    let refused = |why| CompareError::whole(path, format!("its case cannot be read: {why}"), "repeat the run");
    Case::read(&source, &[]).map_err(refused)
}

/// What the samples of a candidate show; nothing without samples.
#[derive(Default)]
struct States<'a> {
    pass: Option<StatePass<'a>>,
    passes: Option<Passes<'a>>,
    impulses: Vec<ImpulseErrors>,
    energy: Option<EnergyDrift>,
    hysteresis: Option<HysteresisEffect>,
    score: Option<ScorePass<'a>>,
    creep: Option<Creep>,
    /// Half the range of the candidate's position over its last period, rad.
    amplitude: Option<f64>,
}
