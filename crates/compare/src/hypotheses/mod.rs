//! Search for the change of the reference's run that reproduces the candidate.
//!
//! A hypothesis is a change: another parameter of the case, another initial state, no kick, a smooth law, another stick
//! test, or a solver with steps. Each change is run and sampled as the candidate is ([`play`], [`stepper`]), and
//! compared with it ([`observation`], [`judge`]). A change that does not reproduce the candidate is no cause. Symptoms
//! only propose where to begin.

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
pub(super) use play::{PlayScore, Played, Traced};
pub(super) use stepper::{Scheme, Stepper, Stop};

use super::creep::SHAPES;
use super::limit::Limit;
use super::parameters::{Reading, TrialStart, of_normal_force};
use super::reference::Physics;
use judge::{ALL, CLOSE, EXACT};
use std::sync::atomic::{AtomicUsize, Ordering};
use stickslip_case::WrittenCase;
use stickslip_engine::workers::over_processors;
use stickslip_system::model::system::{ContactLaw, KickSide, Regularisation, System};
use stickslip_system::model::{BreakawayTest, KickTime};
use unknown::{Numbers, Unknown};

pub(super) struct Bench<'a> {
    pub physics: &'a Physics,
    /// Start of the reference, s.
    pub begins: f64,
    pub numbers: &'a WrittenCase,
    pub evidence: Evidence<'a>,
    pub starts: Vec<TrialStart>,
    /// Time (s) and state of the candidate's first sample, if it shows the state.
    pub first: Option<(f64, Vec<f64>)>,
    /// Like `first`, or else the reference's state there.
    pub origin: Option<(f64, Vec<f64>)>,
    /// Most steps of a run: a run with many times the reference's steps is not the candidate.
    pub most_steps: Option<usize>,
    pub shows_contact: bool,
    pub limit: Limit,
    pub end: f64,
    /// Time of the reference's kick before its first event, s.
    pub kicked: Option<f64>,
    pub watch: &'a (dyn Fn(usize, usize) + Sync),
    pub runs: [AtomicUsize; 2],
}

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Change {
    State,
    Numbers(Numbers),
    NoKick,
    KickOn(KickSide),
    /// A function of [`SHAPES`] that replaces the sign, with its speed (rad/s).
    Smooth(usize, f64),
    /// Another torque is compared with the limit of stick.
    Test(BreakawayTest),
    /// Time (s) of a reference event, its delay (s), and whether the surfaces then have one speed.
    Late(f64, f64, bool),
    Stepper(Stepper),
    Both(Numbers, Stepper),
}

impl Change {
    pub fn numbers(&self) -> &[(String, f64)] {
        match self {
            Change::Numbers(numbers) | Change::Both(numbers, _) => numbers,
            _ => &[],
        }
    }

    /// Place among changes that explain as much and are as simple: coefficients of friction are mistaken most, then come
    /// the others, the normal force, and the radius.
    fn unlikely(&self) -> usize {
        let of = |(path, _): &(String, f64)| match path.as_str() {
            path if path.starts_with("friction.") => 0,
            RADIUS => 3,
            path => 1 + usize::from(of_normal_force(path)),
        };
        self.numbers().iter().map(of).max().unwrap_or(0)
    }
}

const RADIUS: &str = "contact.radius";

/// Numbers by which friction is proportional if they change by one factor.
const COEFFICIENTS: [&str; 11] = [
    "breakaway",
    "breakaway_backward",
    "kinetic",
    "kinetic_backward",
    "low_speed",
    "high_speed",
    "viscous",
    "linear",
    "quadratic",
    "cubic",
    "coefficient",
];

#[derive(Debug, Clone)]
pub(super) struct Tried {
    pub change: Change,
    start: usize,
    own_state: bool,
    /// The candidate shows the change directly, by its equations or its creep.
    told: bool,
    /// The compared part ends before the first event.
    is_smooth: bool,
    of_events: bool,
    /// End of the judged part, s, if rounding decides what the solver does from there on.
    pub until: Option<f64>,
    /// For a solver with steps: number of samples up to which it is close to the candidate.
    close: usize,
    /// Numbers that change independently: those that change by one factor are one.
    pub values: usize,
    /// From its value on, away from the reference's, the motion does not depend on the number.
    pub beyond: bool,
    pub judged: Judged,
}

/// Smallest explained part for values fitted to samples, because some value brings any two motions closer. Parameters
/// and functions are fitted by their derivatives until convergence.
const OF_FITTED: f64 = 0.999;
const OF_SMOOTH: f64 = 1.0 - 1e-6;

impl Tried {
    /// Complexity of the change. Of changes that explain as much, the least comes first.
    fn rank(&self) -> usize {
        match &self.change {
            Change::NoKick | Change::KickOn(_) => 0,
            Change::Numbers(_) => self.values,
            Change::Test(_) => 1,
            Change::Smooth(..) | Change::Late(..) => 2,
            Change::Stepper(_) => 3,
            Change::Both(..) => 3 + self.values,
            Change::State => 4,
        }
    }

    fn is_cause(&self) -> bool {
        let least = match &self.change {
            Change::Numbers(_) if self.of_events => EXACT,
            Change::Numbers(_) if self.told && self.values > 1 => OF_FITTED,
            // One smooth function is much like another.
            Change::Smooth(..) if self.told => 1.0 - ALL,
            Change::Smooth(..) => EXACT,
            _ if self.told => EXPLAINED,
            _ if self.until.is_some() => OF_FITTED,
            // Before an onset from noise a motion is smooth, and many parameters change it alike.
            Change::Numbers(_) if self.is_smooth => OF_SMOOTH,
            // Some of all pairs fit many motions by chance.
            Change::Numbers(_) if self.values > 1 => EXACT,
            Change::Numbers(_) | Change::Both(..) => 1.0 - ALL,
            Change::Late(..) | Change::Stepper(_) => OF_FITTED,
            _ => EXPLAINED,
        };
        self.judged.is_cause() && self.judged.explained >= least
    }
}

/// Two runs that start this far apart, in parts of the state, differ by rounding only. They have parted when they
/// differ by this part of a channel's size.
const ROUNDED: f64 = 1e-12;
const PARTED: f64 = 1e-3;
/// Fewest events of such a run after the candidate has departed from the reference.
const FEWEST_EVENTS: usize = 2;
const CLOSEST_STEPPERS: usize = 8;

/// Most steps of a run: a multiple of the reference's, and a constant.
const MOST_STEPS: (u64, u64) = (20, 5000);
/// Most steps of a smooth law that the candidate shows by its creep.
const MOST_SMOOTH: usize = 300_000;

const MOST_EVENTS: (usize, usize) = (3, 50);

impl Bench<'_> {
    /// Sets the bound on steps from the unchanged case, and the origin of solvers with steps.
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
        // A state at the reference's start that is not the reference's is a change of its own.
        let later = self.first.clone().filter(|(time, _)| *time > self.begins);
        self.origin = later.or_else(of_reference);
        self
    }

    /// Whether a run of a change begins at one of the starts: another state at the reference's start is a change of its own.
    fn begins_at(&self, change: &Change, start: usize) -> bool {
        let first = self.first.as_ref().filter(|(time, _)| *time <= self.begins);
        let own =
            matches!((self.starts.get(start), first), (Some(TrialStart::At(at, _)), Some((time, _))) if at == time);
        !own || matches!(change, Change::State)
    }

    /// Number of factors by which numbers change, or of values for those that are 0.
    fn factors(&self, numbers: &[(String, f64)]) -> usize {
        let own = |path: &str| self.numbers.number(path).map_or(0.0, |number| number.value);
        let factor = |(path, value): &(String, f64)| match own(path) {
            0.0 => *value,
            own => value / own,
        };
        let mut factors: Vec<f64> = numbers.iter().map(factor).collect();
        factors.sort_by(f64::total_cmp);
        factors.dedup_by(|a, b| (*a - *b).abs() <= 1e-12 * a.abs());
        factors.len()
    }

    /// All coefficients of friction times the factor of a radius or a normal force, which is the same friction.
    fn as_friction(&self, change: &Change) -> Option<Change> {
        let [(path, value)] = change.numbers() else { return None };
        if path != RADIUS && !of_normal_force(path) {
            return None;
        }
        let factor = value / self.numbers.number(path)?.value;
        let is_coefficient = |path: &str| {
            let name = path.strip_prefix("friction.").and_then(|name| name.split('.').next());
            name.is_some_and(|name| COEFFICIENTS.contains(&name))
        };
        let all = self
            .numbers
            .numbers()
            .iter()
            .filter(|number| is_coefficient(&number.path));
        Some(Change::Numbers(
            all.map(|number| (number.path.clone(), factor * number.value)).collect(),
        ))
    }

    /// The last value of a number, on the way to the reference's, from which on the motion is that of the change.
    fn beyond(&self, tried: &Tried) -> Option<Change> {
        const FARTHER: f64 = 1.01;
        const HALVINGS: usize = 24;
        let (Change::Numbers(numbers), 1) = (&tried.change, tried.values) else {
            return None;
        };
        let at = |part: f64| -> Change {
            let moved = numbers.iter().map(|(path, value)| {
                let own = self.numbers.number(path).map_or(0.0, |number| number.value);
                (path.clone(), own + part * (value - own))
            });
            Change::Numbers(moved.collect())
        };
        let base = self.played(&tried.change, tried.start)?;
        // None where no run was made: nothing is known of that value.
        let is_same = |part: f64| {
            let other = self.played(&at(part), tried.start)?;
            Some(self.evidence.is_same(&base, &other))
        };
        if !is_same(FARTHER)? && !is_same(1.0 / FARTHER)? {
            return None;
        }
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            *(if is_same(middle)? { &mut high } else { &mut low }) = middle;
        }
        Some(at(high))
    }

    fn score_of<'a>(&self, system: &'a System, threshold: f64, start: &'a TrialStart) -> PlayScore<'a> {
        PlayScore {
            system,
            threshold,
            start,
            end: self.evidence.covered.1.min(self.end),
            most_events: MOST_EVENTS.0 * self.evidence.word.len().max(self.evidence.reference.len()) + MOST_EVENTS.1,
            most_steps: self.most_steps,
            shows_contact: self.shows_contact,
            limit: self.limit,
        }
    }

    /// Fixes the time of kicks that wait for a loss of stability, because a run from a later state does not know
    /// whether it was kicked.
    fn kicked(&self, system: &System) -> System {
        let mut system = system.clone();
        for kick in &mut system.kicks {
            if let (KickTime::Instability, Some(time)) = (kick.time, self.kicked) {
                kick.time = KickTime::At(time);
            }
        }
        system
    }

    fn score(&self, system: &System, threshold: f64, start: &TrialStart) -> Option<Played> {
        self.score_within(self.most_steps, system, threshold, start)
    }

    fn score_within(
        &self,
        most_steps: Option<usize>,
        system: &System,
        threshold: f64,
        start: &TrialStart,
    ) -> Option<Played> {
        let system = &match start {
            TrialStart::Case => system.clone(),
            TrialStart::At(..) => self.kicked(system),
        };
        let score = PlayScore {
            most_steps,
            ..self.score_of(system, threshold, start)
        };
        match self.evidence.observation {
            Some(observation) => score.play(self.physics, observation),
            None => score.events(),
        }
    }

    fn with_numbers(&self, start: usize, changes: &[(String, f64)]) -> Option<Played> {
        let changes: Vec<(&str, f64)> = changes.iter().map(|(path, value)| (path.as_str(), *value)).collect();
        let case = self.numbers.with_all(&changes).ok()?;
        self.score(&case.system, case.threshold, self.starts.get(start)?)
    }

    fn played(&self, change: &Change, start: usize) -> Option<Played> {
        if self.limit.is_over() {
            return None;
        }
        let own = &self.numbers.case().system;
        let threshold = self.numbers.case().threshold;
        let at = self.starts.get(start)?;
        match change {
            Change::State => match at {
                TrialStart::At(..) => self.score(own, threshold, at),
                TrialStart::Case => None,
            },
            Change::Numbers(changes) => self.with_numbers(start, changes),
            Change::NoKick => {
                let mut system = own.clone();
                system.kicks.clear();
                self.score(&system, threshold, at)
            }
            // A smooth law takes many steps in a stick.
            Change::Smooth(shape, speed) => self.smoothed((*shape, *speed), at, Some(MOST_SMOOTH)),
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

    /// The motion with a function of [`SHAPES`] that replaces the sign, with its speed (rad/s).
    fn smoothed(&self, (shape, speed): (usize, f64), at: &TrialStart, most_steps: Option<usize>) -> Option<Played> {
        let Some(function) = SHAPES[shape].smoothing else {
            let (time, state) = self.origin.as_ref()?;
            let seen = self.evidence.observation?;
            return stepper::creeping(self.physics, (shape, speed), (*time, state), seen);
        };
        let mut system = self.numbers.case().system.clone();
        system.contact = ContactLaw::Regularised(Regularisation { function, speed });
        self.score_within(most_steps, &system, 10.0 * speed, at)
    }

    /// A change, judged up to a time (s) from the start with which it explains most.
    fn tried(&self, change: Change, until: f64) -> Option<Tried> {
        let starts = match change {
            Change::Stepper(_) | Change::Both(..) => 0..1,
            _ => 0..self.starts.len(),
        };
        let mut close = 0;
        let starts = starts.filter(|start| self.begins_at(&change, *start));
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
        let own_state = with_steps || matches!(self.starts.get(start), Some(TrialStart::At(..)));
        if matches!(change, Change::Smooth(..)) && self.evidence.observation.is_some() {
            judged = judged.by_samples();
        }
        // An event that the candidate does not have is not late.
        if let Change::Late(time, late, _) = change
            && !self.evidence.has_event(time + late)
        {
            judged = Judged::far();
        }
        Some(Tried {
            values: self.factors(change.numbers()),
            beyond: false,
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

    /// Judges solvers with steps before rounding decides what they do. Events move by whole steps, so two of their runs
    /// that start [`ROUNDED`] apart diverge. The candidate must depart from the reference before that.
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
            let (from, until) = (seen.time[parts], seen.time[until]);
            let events = played.events.iter().filter(|event| (from..until).contains(&event.time));
            if events.count() < FEWEST_EVENTS {
                return None;
            }
            let mut judged = self.evidence.judged(played, until)?;
            if self.evidence.detected.is_some() {
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
                values: 0,
                beyond: false,
                judged,
            })
        });
        let mut known: Vec<Tried> = known.into_iter().flatten().filter(Tried::is_cause).collect();
        known.sort_by(|a, b| b.until.partial_cmp(&a.until).unwrap_or(std::cmp::Ordering::Equal));
        known.truncate(1);
        known
    }

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

/// Whether the equations read from the samples allow these parameters: none that the samples confirm, and if no
/// parameter mends the equations, only one that explains nearly all.
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

#[derive(Debug, Default)]
pub(super) struct Proposals {
    pub changes: Vec<Change>,
    /// Speeds up to which the candidate seems to stick, rad/s.
    pub tolerances: Vec<f64>,
    /// Multiple of mu_0 at which its sticks seem to end.
    pub breakaway: Option<f64>,
    pub with_steps: bool,
    pub with_state: bool,
    pub told: Vec<Change>,
}

#[derive(Debug)]
pub(super) enum FoundChange {
    /// Changes that reproduce the candidate equally well, the simplest first.
    Causes(Vec<Tried>),
    /// No change, or two pairs of parameters equally well. The tried changes, the closest first.
    Unexplained(Vec<Tried>),
}

const MUCH: f64 = 0.5;

const CLOSEST: usize = 2;

/// Smaller relative changes of a parameter cannot be told from the error of a method: with 100 steps in a natural
/// period, order 2 changes the frequency by 5e-4.
const LEAST: f64 = 5e-4;

impl Bench<'_> {
    /// Changes that reproduce the candidate, alone or two at once.
    pub fn find(&self, proposals: Proposals, reading: &Reading) -> FoundChange {
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
        let tests = [BreakawayTest::Transmitted, BreakawayTest::Stator, BreakawayTest::Rotor].into_iter();
        // A surface without inertia has no torque of its own to test.
        let tests = tests.filter(|test| match test {
            BreakawayTest::Transmitted => true,
            BreakawayTest::Stator => !system.stator.inertia.is_empty(),
            BreakawayTest::Rotor => !system.rotor.inertia.is_empty(),
        });
        let others = tests.filter(|test| *test != system.breakaway_test);
        changes.extend(others.map(Change::Test));
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
        // If the initial state explains much, runs from that state include this cause.
        let is_state = |tried: &Tried| matches!(tried.change, Change::State);
        let by_state = tried
            .iter()
            .any(|tried| is_state(tried) && tried.judged.explained >= MUCH);
        if by_state && !with_state {
            // The errors before its first sample explain the difference.
            return FoundChange::Unexplained(Vec::new());
        }
        if by_state {
            tried.retain(|tried| is_state(tried) || !tried.own_state);
        }
        // Equations give a parameter more accurately than samples, because events at the ends of steps move the
        // samples.
        let is_number = |tried: &Tried| matches!(tried.change, Change::Numbers(_)) && tried.judged.is_cause();
        let told = tried.iter().any(|tried| tried.told && is_number(tried));
        // A start after the reference's start does not show initial values.
        let from_start = self.first.as_ref().is_none_or(|(time, _)| *time <= self.begins);
        let unknown = self.unknown();
        let explains_all = |tried: &[Tried]| {
            let all = tried.iter().filter(|tried| tried.judged.is_cause() && !is_state(tried));
            all.clone().any(|tried| tried.judged.explained >= 1.0 - ALL)
        };
        if !(told || by_state && !from_start) {
            let found = self.numbers(&unknown, false, &tried, by_state);
            tried.extend(found);
        }
        // A change that leaves nothing needs no steps. But if each event is late, the first may cause nearly all of the
        // difference.
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
        for told in [false, true] {
            let known = tried.iter().filter(|tried| tried.told == told && tried.is_cause());
            let friction = known.filter_map(|tried| self.as_friction(&tried.change)).collect();
            let friction = self.all_tried(friction);
            tried.extend(friction.into_iter().map(|tried| Tried { told, ..tried }));
        }
        tried = sorted(tried);
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
            return FoundChange::Unexplained(tried);
        };
        let all = tried.clone();
        tried.retain(|tried| tried.is_cause() && tried.judged.as_much_as(&best.judged));
        tried.sort_by_key(|tried| (tried.rank(), tried.change.unlikely()));
        // A more complex change that explains no more is not needed.
        let simplest = tried[0].rank();
        tried.retain(|tried| tried.rank() == simplest || !matches!(tried.change, Change::Numbers(_) | Change::State));
        // If two pairs explain as much, neither is the cause.
        let is_pair = matches!(tried[0].change, Change::Numbers(_)) && tried[0].values > 1;
        if is_pair && tried.len() > 1 {
            return FoundChange::Unexplained(all);
        }
        for tried in &mut tried {
            if let Some(change) = self.beyond(tried) {
                (tried.change, tried.beyond) = (change, true);
            }
        }
        FoundChange::Causes(tried)
    }

    /// Parameters, one or two at once, with which the motion comes closest to the candidate. The candidate's own first
    /// state is not a start if that state explains much.
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
            let other = Change::Numbers(Vec::new());
            if by_state && matches!(at, TrialStart::At(..)) || !self.begins_at(&other, start) {
                continue;
            }
            let proposed = numbers::propose(self, start, unknown, pairs, &guesses);
            found.extend(self.all_tried(proposed.into_iter().map(Change::Numbers).collect()));
        }
        found
    }

    /// A run without kicks, if it reproduces the candidate up to a time (s).
    pub fn unkicked(&self, until: f64) -> Option<Tried> {
        self.evidence.observation?;
        // A brake that stops before the kick does not show it.
        let first = self.evidence.word.first().map_or(f64::INFINITY, |event| event.time);
        if self.kicked.is_some_and(|kicked| first <= kicked) {
            return None;
        }
        self.tried(Change::NoKick, until)
            .filter(|tried| tried.judged.is_cause())
    }

    /// Effect of rounding the twist to multiples of a digit (rad) on the motion with the candidate's steps, in parts of
    /// the candidate's difference. `None` if the motion departs from the candidate before the rounding shows.
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
        // The motion must be the candidate's before rounding shows.
        let parts = observation.parting(&exact, &rounded, PARTED)?;
        if observation.close(&exact, CLOSE) < parts {
            return None;
        }
        let square = observation.between(&exact, &rounded);
        Some((square / observation.left(&observation.reference, f64::INFINITY)).sqrt())
    }

    /// Whether a change of parameters exceeds the error of a method.
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
