//! Which change of the reference's own run makes it the candidate?
//!
//! A hypothesis is a change: another number of the case, another state at the start, no kick, a smooth law, another stick test, a
//! solver with steps. Each is run and sampled as the candidate is ([`play`], [`stepper`]), and held against what the candidate shows
//! ([`observation`], [`judge`]). What does not reproduce the difference is no cause. What symptoms propose only says where to begin.

mod judge;
mod numbers;
mod observation;
mod play;
mod stepper;

pub(super) use judge::{Evidence, Judged};
pub(super) use observation::{Observation, ObservationPass};
pub(super) use play::{Played, Score};
pub(super) use stepper::{Scheme, Stepper, Stop};

use super::creep::SHAPES;
use super::parameters::Start;
use super::reference::Physics;
use crate::case::WrittenCase;
use crate::model::BreakawayTest;
use crate::model::system::{ContactLaw, Regularisation, System};
use crate::workers::over_processors;
use numbers::Unknown;

/// What hypotheses are tried on.
pub(super) struct Bench<'a> {
    pub physics: &'a Physics,
    pub numbers: &'a WrittenCase,
    pub evidence: Evidence<'a>,
    /// Where the candidate begins, the likeliest first.
    pub starts: Vec<Start>,
    /// The state (and time, s) with which the candidate begins, or the reference there.
    pub first: Option<(f64, Vec<f64>)>,
}

/// A change of the reference's run.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Change {
    /// The candidate's own state at its start, and nothing else.
    State,
    /// Numbers of the case.
    Numbers(Vec<(String, f64)>),
    /// Without its kicks.
    NoKick,
    /// A function of [`SHAPES`] in the place of the sign, with its speed (rad/s).
    Smooth(usize, f64),
    /// Another torque is held against what stick can carry.
    Test(BreakawayTest),
    /// A solver with steps.
    Stepper(Stepper),
}

impl Change {
    /// How much it takes, of changes that explain as much the least first.
    fn rank(&self) -> usize {
        match self {
            Change::NoKick => 0,
            Change::Numbers(numbers) => numbers.len(),
            Change::Test(_) => 1,
            Change::Smooth(..) => 2,
            Change::Stepper(_) => 3,
            Change::State => 4,
        }
    }
}

/// A change, from one of the starts, with its judgement.
#[derive(Debug, Clone)]
pub(super) struct Tried {
    pub change: Change,
    pub judged: Judged,
}

/// Events of a run, as a multiple of the candidate's, and some more.
const MOST_EVENTS: (usize, usize) = (3, 50);

impl Bench<'_> {
    fn score(&self, system: &System, threshold: f64, start: &Start) -> Option<Played> {
        let score = Score {
            system,
            threshold,
            start,
            end: self.evidence.covered.1,
            most_events: MOST_EVENTS.0 * self.evidence.word.len() + MOST_EVENTS.1,
        };
        match self.evidence.observation {
            Some(observation) => score.play(self.physics, observation),
            None => score.events(),
        }
    }

    /// The motion of the case with other numbers.
    fn with_numbers(&self, start: usize, changes: &[(String, f64)]) -> Option<Played> {
        let changes: Vec<(&str, f64)> = changes.iter().map(|(path, value)| (path.as_str(), *value)).collect();
        let case = self.numbers.with_all(&changes).ok()?;
        self.score(&case.system, case.threshold(), self.starts.get(start)?)
    }

    fn played(&self, change: &Change, start: usize) -> Option<Played> {
        let own = &self.numbers.case().system;
        let threshold = self.numbers.case().threshold();
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
                    let (time, state) = self.first.as_ref()?;
                    return stepper::creeping(self.physics, (*shape, *speed), (*time, state), self.evidence.observation?);
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
            Change::Stepper(stepper) => {
                let (time, state) = self.first.as_ref()?;
                stepper.play(self.physics, (*time, state), self.evidence.observation?)
            }
        }
    }

    /// A change, judged from the start from which it explains most, by what is shown up to a time (s).
    fn tried(&self, change: Change, until: f64) -> Option<Tried> {
        let starts = match change {
            Change::Stepper(_) => 0..1,
            _ => 0..self.starts.len(),
        };
        let judged = starts.filter_map(|start| self.evidence.judged(&self.played(&change, start)?, until));
        let judged = judged.min_by(|a, b| a.left.total_cmp(&b.left))?;
        Some(Tried { change, judged })
    }

    /// Changes, judged; those that explain most first.
    pub fn all_tried(&self, changes: Vec<Change>) -> Vec<Tried> {
        let tried = over_processors(changes.len(), &|| false, |k| self.tried(changes[k].clone(), f64::INFINITY));
        sorted(tried.into_iter().flatten().collect())
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
    /// Whether solvers with steps are tried.
    pub with_steps: bool,
}

/// What was found.
#[derive(Debug)]
pub(super) enum Found {
    /// Changes that reproduce the candidate equally well, the simplest first.
    Causes(Vec<Tried>),
    /// None does. What came closest, if anything could be run.
    Unexplained(Option<Tried>),
}

/// A cause that leaves more than this part of the square may be half of the truth: numbers are then looked for as well.
const ALL: f64 = 1e-4;

/// A change of a number by less than this part of it is not told from the error of a method: with a hundred steps in a natural period
/// one of order 2 changes its frequency by 5e-4.
const LEAST: f64 = 5e-4;

impl Bench<'_> {
    /// The changes that reproduce the candidate, each alone, or two numbers at once.
    pub fn find(&self, proposals: Proposals) -> Found {
        let mut changes = proposals.changes;
        changes.push(Change::State);
        if !self.numbers.case().system.kicks.is_empty() {
            changes.push(Change::NoKick);
        }
        let own = self.numbers.case().system.breakaway_test;
        let tests = [BreakawayTest::Transmitted, BreakawayTest::Stator, BreakawayTest::Rotor];
        changes.extend(tests.into_iter().filter(|test| *test != own).map(Change::Test));
        if proposals.with_steps {
            changes.extend(self.steppers(&proposals.tolerances).map(Change::Stepper));
        }
        let mut tried = self.all_tried(changes);
        let explains_all = |tried: &[Tried]| {
            let best = tried.iter().find(|tried| tried.judged.is_cause());
            best.is_some_and(|best| best.judged.explained >= 1.0 - ALL)
        };
        for pairs in [false, true] {
            let enough = match pairs {
                false => explains_all(&tried),
                true => tried.iter().any(|tried| tried.judged.is_cause()),
            };
            if enough || self.evidence.observation.is_none() {
                break;
            }
            let unknown = self.unknown();
            for start in 0..self.starts.len() {
                let proposed = numbers::propose(self, start, &unknown, pairs);
                let changed = proposed.into_iter().map(Change::Numbers);
                tried.extend(self.all_tried(changed.collect()));
            }
        }
        let mut tried = sorted(tried);
        tried.retain(|tried| self.is_large(&tried.change));
        tried.dedup_by(|a, b| a.change == b.change);
        let Some(best) = tried.iter().find(|tried| tried.judged.is_cause()).cloned() else {
            return Found::Unexplained(tried.into_iter().next());
        };
        tried.retain(|tried| tried.judged.is_cause() && tried.judged.as_much_as(&best.judged));
        tried.sort_by_key(|tried| tried.change.rank());
        // What takes more than the simplest, and explains no more, is not needed.
        let simplest = tried[0].change.rank();
        tried.retain(|tried| tried.change.rank() == simplest || !matches!(tried.change, Change::Numbers(_) | Change::State));
        Found::Causes(tried)
    }

    /// A run without the kicks, if it reproduces the candidate up to a time (s).
    pub fn unkicked(&self, until: f64) -> Option<Tried> {
        let quiet = [Change::NoKick, Change::State];
        quiet
            .into_iter()
            .filter_map(|change| self.tried(change, until))
            .find(|tried| tried.judged.is_cause())
    }

    /// Whether a change of numbers is more than the error of a method.
    fn is_large(&self, change: &Change) -> bool {
        let Change::Numbers(numbers) = change else { return true };
        numbers.iter().all(|(path, value)| {
            let own = self.numbers.number(path).map_or(0.0, |number| number.value);
            own == 0.0 || (value / own - 1.0).abs() >= LEAST
        })
    }

    /// The numbers of the case, and those that are zero in it.
    fn unknown(&self) -> Vec<Unknown> {
        let (system, trains) = (self.physics.system(), &self.physics.trains);
        let omega = self.physics.natural_angular_frequency();
        let speed = self.physics.speed();
        let force = self.physics.course.largest_force();
        let numbers = self.numbers.numbers().iter().filter(|number| number.value != 0.0);
        let mut unknown: Vec<Unknown> = numbers
            .map(|number| Unknown {
                path: number.path.clone(),
                value: number.value,
                unit: number.value.abs(),
            })
            .collect();
        let sides = [("rotor", &system.rotor, &trains.rotor), ("stator", &system.stator, &trains.stator)];
        let mut absent = |path: String, unit: f64| {
            if self.numbers.number(&path).is_none_or(|number| number.value == 0.0) && unit.is_finite() && unit > 0.0 {
                unknown.push(Unknown { path, value: 0.0, unit });
            }
        };
        for (name, side, train) in sides {
            let inertia = side.surface_inertia();
            let zeros = |values: &[f64]| -> Vec<usize> { (0..values.len()).filter(|&k| values[k] == 0.0).collect() };
            for index in zeros(&train.damping) {
                absent(format!("{name}.damping.{index}"), inertia * omega);
            }
            for index in zeros(&train.viscous) {
                absent(format!("{name}.viscous.{index}"), inertia * omega);
            }
            if !inertia.is_finite() {
                continue;
            }
            absent(format!("{name}.torque"), system.breakaway * system.radius * force);
            absent(format!("initial.{name}_speed"), speed);
            absent(format!("initial.{name}_twist"), speed / omega);
        }
        unknown
    }

    /// Solvers with the candidate's own steps.
    fn steppers(&self, tolerances: &[f64]) -> impl Iterator<Item = Stepper> {
        let step = self.evidence.observation.and_then(|observation| observation.interval);
        let within = tolerances.iter().flat_map(|&w| [Stop::Within(w), Stop::Frozen(w)]);
        let stops: Vec<Stop> = [Stop::Sign].into_iter().chain(within).collect();
        step.into_iter().flat_map(move |step| {
            let stops = stops.clone();
            let of_scheme = move |scheme: Scheme| {
                let stops = stops.clone();
                stops.into_iter().map(move |stop| Stepper {
                    step,
                    scheme,
                    stop,
                    breakaway: 1.0,
                })
            };
            Scheme::ALL.into_iter().flat_map(of_scheme)
        })
    }
}
