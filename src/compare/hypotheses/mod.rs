//! Which change of the reference's own run makes it the candidate?
//!
//! A hypothesis is a change: another number of the case, another state at the start, no kick, a smooth law, another stick test, a
//! solver with steps. Each is run and sampled as the candidate is ([`play`], [`stepper`]), and held against what the candidate shows
//! ([`observation`], [`judge`]). What does not reproduce the difference is no cause. What symptoms propose only says where to begin.

mod apart;
mod fit;
mod judge;
mod late;
mod numbers;
mod observation;
mod play;
mod smooth;
mod stepper;
mod steps;
mod unknown;

pub(super) use apart::Apart;
pub(super) use fit::Fit;
pub(super) use judge::{EXPLAINED, Evidence, Judged};
pub(super) use observation::{Observation, ObservationPass};
pub(super) use play::{Played, Score, Traced};
pub(super) use stepper::{Scheme, Stepper, Stop};

use super::creep::SHAPES;
use super::parameters::{Reading, Start, of_normal_force};
use super::reference::Physics;
use crate::case::WrittenCase;
use crate::model::system::{ContactLaw, KickSide, Regularisation, System};
use crate::model::{BreakawayTest, KickTime};
use crate::workers::over_processors;
use judge::{ALL, CLOSE, EXACT};
use std::sync::atomic::{AtomicUsize, Ordering};
use unknown::{Numbers, Unknown};

/// What hypotheses are tried on.
pub(super) struct Bench<'a> {
    pub physics: &'a Physics,
    pub numbers: &'a WrittenCase,
    pub evidence: Evidence<'a>,
    /// Where the candidate begins, the likeliest first.
    pub starts: Vec<Start>,
    /// The state (and time, s) with which the candidate begins, if it shows it.
    pub first: Option<(f64, Vec<f64>)>,
    /// The same, or else that of the reference there.
    pub origin: Option<(f64, Vec<f64>)>,
    /// Steps of a run at most: what takes many times the steps of the reference is not the candidate's.
    pub most_steps: Option<usize>,
    /// Where runs end at the latest, s.
    pub end: f64,
    /// When the reference was kicked before its first event, s.
    pub kicked: Option<f64>,
    /// Told how many runs are done, of how many.
    pub watch: &'a (dyn Fn(usize, usize) + Sync),
    pub runs: [AtomicUsize; 2],
}

/// A change of the reference's run.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Change {
    /// The candidate's own state at its start, and nothing else.
    State,
    /// Numbers of the case.
    Numbers(Numbers),
    /// Without its kicks.
    NoKick,
    /// Its kicks on one surface alone.
    KickOn(KickSide),
    /// A function of [`SHAPES`] in the place of the sign, with its speed (rad/s).
    Smooth(usize, f64),
    /// Another torque is held against what stick can carry.
    Test(BreakawayTest),
    /// The event that the reference has at a time comes so much later, s. Whether the surfaces then have one speed.
    Late(f64, f64, bool),
    /// A solver with steps.
    Stepper(Stepper),
    /// Numbers of the case, by a solver with steps.
    Both(Numbers, Stepper),
}

/// How many values numbers have: those that follow a drive have its own.
fn values(numbers: &[(String, f64)]) -> usize {
    let mut values: Vec<f64> = numbers.iter().map(|(_, value)| *value).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    values.len()
}

impl Change {
    /// How much it takes, of changes that explain as much the least first.
    fn rank(&self) -> usize {
        match self {
            Change::NoKick | Change::KickOn(_) => 0,
            // Several that have one value are one.
            Change::Numbers(numbers) => values(numbers),
            Change::Test(_) => 1,
            Change::Smooth(..) | Change::Late(..) => 2,
            Change::Stepper(_) => 3,
            Change::Both(numbers, _) => 3 + values(numbers),
            Change::State => 4,
        }
    }
}

impl Change {
    /// Whether it is one of a number that F_n follows from.
    fn is_of_normal_force(&self) -> bool {
        matches!(self, Change::Numbers(numbers) | Change::Both(numbers, _) if numbers.iter().any(|(path, _)| of_normal_force(path)))
    }
}

/// A change, from one of the starts, with its judgement.
#[derive(Debug, Clone)]
pub(super) struct Tried {
    pub change: Change,
    /// Which of the starts of the bench.
    start: usize,
    /// From the candidate's own first state.
    own_state: bool,
    /// The candidate shows it apart from what the motion comes to: by its equations, or by its creep.
    told: bool,
    /// What is compared ends before the first event.
    is_smooth: bool,
    /// There are no samples.
    of_events: bool,
    /// Up to where it is judged, if not to the end: from there on rounding decides what its solver does, s.
    pub until: Option<f64>,
    /// Of a solver with steps, samples up to which it is close to the candidate.
    close: usize,
    pub judged: Judged,
}

/// What values that are fitted to samples explain, at least: some one of them brings any two motions closer. Numbers and functions are
/// fitted by their derivatives, to the end.
const OF_FITTED: f64 = 0.999;
const OF_SMOOTH: f64 = 1.0 - 1e-6;

impl Tried {
    /// Whether it is said.
    fn is_cause(&self) -> bool {
        let least = match &self.change {
            Change::Numbers(_) if self.of_events => EXACT,
            Change::Numbers(numbers) if self.told && values(numbers) > 1 => OF_FITTED,
            _ if self.told => EXPLAINED,
            _ if self.until.is_some() => OF_FITTED,
            // Before an onset that is noise a motion is smooth, and many numbers change it alike.
            Change::Numbers(_) if self.is_smooth => OF_SMOOTH,
            // Two of all pairs come close to much that is neither.
            Change::Numbers(numbers) if values(numbers) > 1 => EXACT,
            Change::Numbers(_) | Change::Both(..) | Change::Smooth(..) => 1.0 - ALL,
            Change::Late(..) => OF_FITTED,
            Change::Stepper(_) => OF_FITTED,
            _ => EXPLAINED,
        };
        self.judged.is_cause() && self.judged.explained >= least
    }
}

/// Runs that begin so far apart, in parts of the state, are one but for rounding; those that differ by so much of a channel's size are
/// two.
const ROUNDED: f64 = 1e-12;
const PARTED: f64 = 1e-3;
/// Events that such a run has where the candidate has parted from the reference.
const FEWEST_EVENTS: usize = 2;
/// Solvers with steps that are judged up to where their runs part.
const CLOSEST_STEPPERS: usize = 8;

/// Steps of a run, as a multiple of the reference's, and some more.
const MOST_STEPS: (u64, u64) = (20, 5000);

/// Events of a run, as a multiple of the candidate's, and some more.
const MOST_EVENTS: (usize, usize) = (3, 50);

impl Bench<'_> {
    /// The same, with a bound on the steps of its runs by those of the case as it is, and with where solvers with steps begin.
    pub fn prepared(mut self) -> Self {
        let mut traced: Vec<Traced> = (0..self.starts.len()).filter_map(|start| self.traced(start)).collect();
        let steps = traced.iter().map(|run| run.played.steps).max();
        self.most_steps = steps.and_then(|steps| usize::try_from(MOST_STEPS.0 * steps + MOST_STEPS.1).ok());
        let from = self.evidence.observation.and_then(|seen| seen.time.first().copied());
        let of_reference = || {
            let run = traced.first_mut()?;
            let time = from.unwrap_or(run.nodes.first()?.0).max(run.nodes.first()?.0);
            Some((time, run.state_at(time)?.1))
        };
        self.origin = self.first.clone().or_else(of_reference);
        self
    }

    fn score_of<'a>(&self, system: &'a System, threshold: f64, start: &'a Start) -> Score<'a> {
        Score {
            system,
            threshold,
            start,
            end: self.evidence.covered.1.min(self.end),
            most_events: MOST_EVENTS.0 * self.evidence.word.len().max(self.evidence.reference.len()) + MOST_EVENTS.1,
            most_steps: self.most_steps,
        }
    }

    /// A system whose kicks wait for a loss of stability is kicked when the reference was: a run from a state on does not know whether it
    /// has been.
    fn kicked(&self, system: &System) -> System {
        let mut system = system.clone();
        for kick in &mut system.kicks {
            if let (KickTime::Instability, Some(time)) = (kick.time, self.kicked) {
                kick.time = KickTime::At(time);
            }
        }
        system
    }

    fn score(&self, system: &System, threshold: f64, start: &Start) -> Option<Played> {
        let system = &match start {
            Start::Case => system.clone(),
            Start::At(..) => self.kicked(system),
        };
        let score = self.score_of(system, threshold, start);
        match self.evidence.observation {
            Some(observation) => score.play(self.physics, observation),
            None => score.events(),
        }
    }

    /// The motion of the case with other numbers.
    fn with_numbers(&self, start: usize, changes: &[(String, f64)]) -> Option<Played> {
        let changes: Vec<(&str, f64)> = changes.iter().map(|(path, value)| (path.as_str(), *value)).collect();
        let case = self.numbers.with_all(&changes).ok()?;
        self.score(&case.system, case.threshold, self.starts.get(start)?)
    }

    fn played(&self, change: &Change, start: usize) -> Option<Played> {
        let own = &self.numbers.case().system;
        let threshold = self.numbers.case().threshold;
        let at = self.starts.get(start)?;
        match change {
            Change::State => match at {
                Start::At(..) => self.score(own, threshold, at),
                Start::Case => None,
            },
            Change::Numbers(changes) => self.with_numbers(start, changes),
            Change::NoKick => {
                let mut system = own.clone();
                system.kicks.clear();
                self.score(&system, threshold, at)
            }
            Change::Smooth(shape, speed) => {
                let Some(function) = SHAPES[*shape].smoothing else {
                    let (time, state) = self.origin.as_ref()?;
                    return stepper::creeping(
                        self.physics,
                        (*shape, *speed),
                        (*time, state),
                        self.evidence.observation?,
                    );
                };
                let mut system = own.clone();
                let speed = *speed;
                system.contact = ContactLaw::Regularised(Regularisation { function, speed });
                self.score(&system, 10.0 * speed, at)
            }
            Change::Test(test) => {
                let mut system = own.clone();
                system.breakaway_test = *test;
                self.score(&system, threshold, at)
            }
            Change::KickOn(side) => {
                let mut system = own.clone();
                system.kicks.iter_mut().for_each(|kick| kick.on = *side);
                self.score(&system, threshold, at)
            }
            Change::Late(time, late, joined) => {
                let traced = self.traced(start)?;
                let number = traced.played.events.iter().position(|event| event.time == *time)?;
                self.late(&traced, number, *late, *joined)
            }
            Change::Both(numbers, stepper) => {
                let numbers: Vec<(&str, f64)> = numbers.iter().map(|(path, value)| (path.as_str(), *value)).collect();
                let case = self.numbers.with_all(&numbers).ok()?;
                let physics = Physics::new(case, self.evidence.reference, self.evidence.covered.1);
                self.stepped_from(&physics, stepper, 1.0, usize::MAX)
            }
            Change::Stepper(stepper) => self.stepped(stepper, usize::MAX),
        }
    }

    /// A change, judged from the start from which it explains most, by what is shown up to a time (s).
    fn tried(&self, change: Change, until: f64) -> Option<Tried> {
        let starts = match change {
            Change::Stepper(_) | Change::Both(..) => 0..1,
            _ => 0..self.starts.len(),
        };
        let mut close = 0;
        let judged = starts.filter_map(|start| {
            let played = self.played(&change, start)?;
            let judged = self.evidence.judged(&played, until);
            if let (Change::Stepper(_), Some(seen)) = (&change, self.evidence.observation) {
                close = seen.close(&played.values, CLOSE);
                return Some((start, judged.unwrap_or_else(Judged::far)));
            }
            Some((start, judged?))
        });
        let (start, mut judged) = judged.min_by(|a, b| a.1.left.total_cmp(&b.1.left))?;
        let with_steps = matches!(change, Change::Stepper(_) | Change::Both(..));
        let own_state = with_steps || matches!(self.starts.get(start), Some(Start::At(..)));
        if matches!(change, Change::Smooth(..)) && self.evidence.observation.is_some() {
            judged = judged.by_samples();
        }
        Some(Tried {
            change,
            start,
            own_state,
            told: false,
            is_smooth: self.evidence.is_smooth,
            of_events: self.evidence.observation.is_none(),
            until: None,
            close,
            judged,
        })
    }

    /// Solvers with steps, judged by what is shown before rounding decides what they do: where events come sooner or later by a step,
    /// two of their runs part that begin [`ROUNDED`] apart. Before that the candidate has to part from the reference.
    fn up_to_where_known(&self, tried: &[Tried]) -> Vec<Tried> {
        let Some(seen) = self.evidence.observation else {
            return Vec::new();
        };
        let parts = seen.close(&seen.reference, CLOSE);
        let steppers = tried.iter().filter_map(|tried| match tried.change {
            Change::Stepper(stepper) if tried.close > parts => Some((tried.close, stepper)),
            _ => None,
        });
        let mut close: Vec<(usize, Stepper)> = steppers.collect();
        close.sort_by_key(|(rows, _)| std::cmp::Reverse(*rows));
        close.truncate(CLOSEST_STEPPERS);
        let known = over_processors(close.len(), &|| false, |k| {
            let (rows, stepper) = &close[k];
            let played = &self.stepped(stepper, usize::MAX)?;
            let other = self.stepped_from(self.physics, stepper, 1.0 + ROUNDED, usize::MAX)?;
            let until = seen
                .parting(&played.values, &other.values, PARTED)
                .filter(|until| *until > parts)?;
            // One event may be where it is by chance.
            let (from, until) = (seen.time[parts], seen.time[until]);
            let events = played.events.iter().filter(|event| (from..until).contains(&event.time));
            if events.count() < FEWEST_EVENTS {
                return None;
            }
            let mut judged = self.evidence.judged(played, until)?;
            if self.evidence.detected {
                judged = judged.by_samples();
            }
            Some(Tried {
                change: Change::Stepper(*stepper),
                start: 0,
                own_state: true,
                told: false,
                is_smooth: self.evidence.is_smooth,
                of_events: false,
                until: Some(until),
                close: *rows,
                judged,
            })
        });
        // The one that is known longest.
        let mut known: Vec<Tried> = known.into_iter().flatten().filter(Tried::is_cause).collect();
        known.sort_by(|a, b| b.until.partial_cmp(&a.until).unwrap_or(std::cmp::Ordering::Equal));
        known.truncate(1);
        known
    }

    /// Changes, judged; those that explain most first.
    pub fn all_tried(&self, changes: Vec<Change>) -> Vec<Tried> {
        let [done, of] = &self.runs;
        of.fetch_add(changes.len(), Ordering::Relaxed);
        let tried = over_processors(changes.len(), &|| false, |k| {
            let tried = self.tried(changes[k].clone(), f64::INFINITY);
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            (self.watch)(done, of.load(Ordering::Relaxed));
            tried
        });
        sorted(tried.into_iter().flatten().collect())
    }
}

/// Whether what the samples say of the equations leaves room for other numbers: none of those that they hold, and where no number
/// mends the equations, only what explains nearly all.
fn allowed(tried: &Tried, reading: &Reading) -> bool {
    let (Change::Numbers(numbers) | Change::Both(numbers, _)) = &tried.change else {
        return true;
    };
    match reading {
        Reading::Hold(held) => numbers.iter().all(|(path, _)| !held.contains(path)),
        Reading::Fail => tried.judged.explained >= EXACT,
        Reading::None | Reading::Mended => true,
    }
}

fn sorted(mut tried: Vec<Tried>) -> Vec<Tried> {
    tried.sort_by(|a, b| a.judged.left.total_cmp(&b.judged.left));
    tried
}

/// What symptoms propose.
#[derive(Debug, Default)]
pub(super) struct Proposals {
    pub changes: Vec<Change>,
    /// Speeds up to which the candidate seems to stick, rad/s.
    pub tolerances: Vec<f64>,
    /// At which multiple of mu_0 its sticks seem to end.
    pub breakaway: Option<f64>,
    /// Whether solvers with steps are tried.
    pub with_steps: bool,
    /// Whether its first sample shows another state.
    pub with_state: bool,
    /// Those of the changes that the candidate shows apart from what the motion comes to.
    pub told: Vec<Change>,
}

/// What was found.
#[derive(Debug)]
pub(super) enum Found {
    /// Changes that reproduce the candidate equally well, the simplest first.
    Causes(Vec<Tried>),
    /// None does, or two pairs of numbers equally well. What was run, the closest first.
    Unexplained(Vec<Tried>),
}

/// A part of the squared difference that is much of it.
const MUCH: f64 = 0.5;

/// Numbers that come closest, which are tried with steps as well.
const CLOSEST: usize = 2;

/// A change of a number by less than this part of it is not told from the error of a method: with a hundred steps in a natural period
/// one of order 2 changes its frequency by 5e-4.
const LEAST: f64 = 5e-4;

impl Bench<'_> {
    /// The changes that reproduce the candidate, each alone, or two at once. The reference begins at a time (s).
    pub fn find(&self, proposals: Proposals, reading: &Reading, begins: f64) -> Found {
        let Proposals {
            mut changes,
            mut tolerances,
            breakaway,
            with_steps,
            with_state,
            told,
        } = proposals;
        changes.push(Change::State);
        let system = &self.numbers.case().system;
        if !system.kicks.is_empty() {
            changes.push(Change::NoKick);
            let sides = [KickSide::Both, KickSide::Rotor, KickSide::Stator].into_iter();
            let other = sides.filter(|side| system.kicks.iter().any(|kick| kick.on != *side));
            changes.extend(other.map(Change::KickOn));
        }
        let tests = [BreakawayTest::Transmitted, BreakawayTest::Stator, BreakawayTest::Rotor];
        changes.extend(
            tests
                .into_iter()
                .filter(|test| *test != system.breakaway_test)
                .map(Change::Test),
        );
        if let Some(mut traced) = self.traced(0) {
            changes.extend(self.one_late(&traced));
            if self.physics.sticks() {
                let (speeds, bands) = self.bands(&mut traced);
                tolerances.extend(speeds);
                tolerances.sort_by(f64::total_cmp);
                tolerances.dedup_by(|a, b| (*a / *b - 1.0).abs() < 1e-4);
                changes.extend(bands);
            }
        }
        let mut tried = self.all_tried(changes);
        tried
            .iter_mut()
            .for_each(|tried| tried.told = told.contains(&tried.change));
        // Where the state at the start explains much, what is run from it has that cause in it.
        let is_state = |tried: &Tried| matches!(tried.change, Change::State);
        let by_state = tried
            .iter()
            .any(|tried| is_state(tried) && tried.judged.explained >= MUCH);
        if by_state && !with_state {
            // All that differs comes of what it errs by before its first sample.
            return Found::Unexplained(Vec::new());
        }
        if by_state {
            tried.retain(|tried| is_state(tried) || !tried.own_state);
        }
        // A number that the equations tell is better known by them than by samples, which events at the ends of steps move.
        let is_number = |tried: &Tried| matches!(tried.change, Change::Numbers(_)) && tried.judged.is_cause();
        let told = tried.iter().any(|tried| tried.told && is_number(tried));
        // From a state behind the start of the reference numbers of that start are none.
        let from_start = self.first.as_ref().is_none_or(|(time, _)| *time <= begins);
        let unknown = self.unknown();
        let explains_all = |tried: &[Tried]| {
            let all = tried.iter().filter(|tried| tried.judged.is_cause() && !is_state(tried));
            all.clone().any(|tried| tried.judged.explained >= 1.0 - ALL)
        };
        if !(told || by_state && !from_start) {
            let found = self.numbers(&unknown, false, &tried, by_state);
            tried.extend(found);
        }
        // What else leaves nothing needs no steps; but where each event is late, the first may make nearly all of the difference.
        let is_of_steps = |change: &Change| matches!(change, Change::Late(..) | Change::Stepper(_));
        let is_exact =
            |tried: &Tried| !is_of_steps(&tried.change) && tried.is_cause() && tried.judged.explained >= EXACT;
        if with_steps && !tried.iter().any(is_exact) {
            let steppers = self.steppers(&tolerances, breakaway).into_iter();
            tried.extend(self.all_tried(steppers.map(Change::Stepper).collect()));
        }
        if with_steps && !told && !explains_all(&tried) {
            let methods = self.methods().into_iter().map(Change::Stepper).collect();
            tried.extend(self.all_tried(methods));
        }
        if !told && !explains_all(&tried) {
            tried.extend(self.all_tried(self.smooth()));
        }
        if with_steps && !told && !explains_all(&tried) {
            let bands = self.usual_bands().into_iter().map(Change::Stepper).collect();
            tried.extend(self.all_tried(bands));
        }
        if !explains_all(&tried) && !told {
            let found = self.numbers(&unknown, true, &tried, by_state);
            tried.extend(found);
        }
        let mut tried = sorted(tried);
        if with_steps && !explains_all(&tried) {
            let numbers = tried.iter().filter_map(|tried| match &tried.change {
                Change::Numbers(numbers) => Some(numbers.clone()),
                _ => None,
            });
            let steppers = self.steppers(&[], None);
            let both = numbers.take(CLOSEST).flat_map(|numbers| {
                let each = steppers
                    .iter()
                    .map(move |stepper| Change::Both(numbers.clone(), *stepper));
                each.collect::<Vec<_>>()
            });
            tried.extend(self.all_tried(both.collect()));
            tried = sorted(tried);
        }
        tried.retain(|tried| self.is_large(&tried.change) && allowed(tried, reading));
        tried.dedup_by(|a, b| a.change == b.change);
        if by_state {
            tried.retain(|tried| is_state(tried) || !tried.own_state);
        }
        if with_steps && !tried.iter().any(Tried::is_cause) {
            let known = self.up_to_where_known(&tried);
            tried.splice(0..0, known);
        }
        let Some(best) = tried.iter().find(|tried| tried.is_cause()).cloned() else {
            return Found::Unexplained(tried);
        };
        let all = tried.clone();
        tried.retain(|tried| tried.is_cause() && tried.judged.as_much_as(&best.judged));
        // Of numbers that do as well, the force and its times come last.
        tried.sort_by_key(|tried| (tried.change.rank(), tried.change.is_of_normal_force()));
        // What takes more than the simplest, and explains no more, is not needed.
        let simplest = tried[0].change.rank();
        tried.retain(|tried| {
            tried.change.rank() == simplest || !matches!(tried.change, Change::Numbers(_) | Change::State)
        });
        // Of two pairs neither is the cause.
        let is_pair = |tried: &Tried| matches!(&tried.change, Change::Numbers(numbers) if values(numbers) > 1);
        if is_pair(&tried[0]) && tried.len() > 1 {
            return Found::Unexplained(all);
        }
        Found::Causes(tried)
    }

    /// Numbers, one or two at once, with which the motion comes closest to the candidate. Not from its own first state where that
    /// explains much.
    fn numbers(&self, unknown: &[Unknown], pairs: bool, tried: &[Tried], by_state: bool) -> Vec<Tried> {
        let guesses = tried.iter().filter_map(|tried| match &tried.change {
            Change::Numbers(numbers) if numbers.len() == 1 && tried.judged.explained > 0.0 => Some(numbers[0].clone()),
            _ => None,
        });
        let mut guesses: Vec<(String, f64)> = guesses.collect();
        let mut found = Vec::new();
        if !pairs {
            let mistaken = unknown
                .iter()
                .flat_map(|unknown| unknown.mistaken.iter().map(|value| unknown.changes(*value)));
            let mistaken = self.all_tried(mistaken.map(Change::Numbers).collect());
            let better = mistaken.iter().filter(|tried| tried.judged.explained > 0.0);
            guesses.extend(better.filter_map(|tried| match &tried.change {
                Change::Numbers(numbers) if numbers.len() == 1 => Some(numbers[0].clone()),
                _ => None,
            }));
            found.extend(mistaken);
        }
        for (start, at) in self.starts.iter().enumerate() {
            if by_state && matches!(at, Start::At(..)) {
                continue;
            }
            let proposed = numbers::propose(self, start, unknown, pairs, &guesses);
            found.extend(self.all_tried(proposed.into_iter().map(Change::Numbers).collect()));
        }
        found
    }

    /// A run without the kicks, if it reproduces the candidate up to a time (s).
    pub fn unkicked(&self, until: f64) -> Option<Tried> {
        self.evidence.observation?;
        // A brake that has stopped before the kick says nothing of it.
        let first = self.evidence.word.first().map_or(f64::INFINITY, |event| event.time);
        if self.kicked.is_some_and(|kicked| first <= kicked) {
            return None;
        }
        self.tried(Change::NoKick, until)
            .filter(|tried| tried.judged.is_cause())
    }

    /// What the rounding of a twist to multiples of a digit (rad) makes of the motion with the candidate's steps, in parts of what the
    /// candidate differs by. `None` if the motion is not the candidate's before the rounding shows.
    pub fn amplified(&self, digit: f64) -> Option<f64> {
        let observation = self.evidence.observation?;
        let motion = |digit: f64| {
            let stepper = Stepper {
                digit,
                ..self.stepper(Scheme::RungeKutta, false, observation.interval?)
            };
            Some(self.stepped(&stepper, observation.time.len())?.values)
        };
        let (exact, rounded) = (motion(0.0)?, motion(digit)?);
        // It has to be the candidate before rounding shows.
        let parts = observation.parting(&exact, &rounded, PARTED)?;
        if observation.close(&exact, CLOSE) < parts {
            return None;
        }
        let square = observation.between(&exact, &rounded);
        Some((square / observation.left(&observation.reference, f64::INFINITY)).sqrt())
    }

    /// Whether a change of numbers is more than the error of a method.
    fn is_large(&self, change: &Change) -> bool {
        let (Change::Numbers(numbers) | Change::Both(numbers, _)) = change else {
            return true;
        };
        numbers.iter().all(|(path, value)| {
            let own = self.numbers.number(path).map_or(0.0, |number| number.value);
            own == 0.0 || (value / own - 1.0).abs() >= LEAST
        })
    }
}
