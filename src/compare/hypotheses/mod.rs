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

pub(super) use judge::{EXPLAINED, Evidence, Judged};
pub(super) use observation::{Observation, ObservationPass};
pub(super) use play::{Played, Score};
pub(super) use stepper::{Scheme, Stepper, Stop};

use super::creep::SHAPES;
use super::parameters::{Reading, Start, of_normal_force};
use super::reference::Physics;
use crate::case::WrittenCase;
use crate::model::BreakawayTest;
use crate::model::system::{ContactLaw, Regularisation, System};
use crate::workers::over_processors;
use judge::ALL;
use numbers::Unknown;
use std::f64::consts::TAU;

/// What hypotheses are tried on.
pub(super) struct Bench<'a> {
    pub physics: &'a Physics,
    pub numbers: &'a WrittenCase,
    pub evidence: Evidence<'a>,
    /// Where the candidate begins, the likeliest first.
    pub starts: Vec<Start>,
    /// The state (and time, s) with which the candidate begins, or the reference there.
    pub first: Option<(f64, Vec<f64>)>,
    /// Steps of a run at most: what takes many times the steps of the reference is not the candidate's.
    pub most_steps: Option<usize>,
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
    /// Numbers of the case, by a solver with steps.
    Both(Vec<(String, f64)>, Stepper),
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
            Change::NoKick => 0,
            // Several that have one value are one.
            Change::Numbers(numbers) => values(numbers),
            Change::Test(_) => 1,
            Change::Smooth(..) => 2,
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
    /// From the candidate's own first state.
    own_state: bool,
    pub judged: Judged,
}

/// Steps of a run, as a multiple of the reference's, and some more.
const MOST_STEPS: (u64, u64) = (20, 5000);

/// Events of a run, as a multiple of the candidate's, and some more.
const MOST_EVENTS: (usize, usize) = (3, 50);

impl Bench<'_> {
    /// The same, with a bound on the steps of its runs by those of the case as it is.
    pub fn bounded(mut self) -> Self {
        let case = self.numbers.case();
        let runs = self
            .starts
            .iter()
            .filter_map(|start| self.score(&case.system, case.threshold, start));
        let steps = runs.map(|run| run.steps).max();
        self.most_steps = steps.and_then(|steps| usize::try_from(MOST_STEPS.0 * steps + MOST_STEPS.1).ok());
        self
    }

    fn score(&self, system: &System, threshold: f64, start: &Start) -> Option<Played> {
        let score = Score {
            system,
            threshold,
            start,
            end: self.evidence.covered.1,
            most_events: MOST_EVENTS.0 * self.evidence.word.len() + MOST_EVENTS.1,
            most_steps: self.most_steps,
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
                    let (time, state) = self.first.as_ref()?;
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
            Change::Both(numbers, stepper) => {
                let (time, state) = self.first.as_ref()?;
                let numbers: Vec<(&str, f64)> = numbers.iter().map(|(path, value)| (path.as_str(), *value)).collect();
                let case = self.numbers.with_all(&numbers).ok()?;
                let physics = Physics::new(case, self.evidence.reference, self.evidence.covered.1);
                stepper.play(&physics, (*time, state), self.evidence.observation?)
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
            Change::Stepper(_) | Change::Both(..) => 0..1,
            _ => 0..self.starts.len(),
        };
        let judged =
            starts.filter_map(|start| Some((start, self.evidence.judged(&self.played(&change, start)?, until)?)));
        let (start, mut judged) = judged.min_by(|a, b| a.1.left.total_cmp(&b.1.left))?;
        let with_steps = matches!(change, Change::Stepper(_) | Change::Both(..));
        let own_state = with_steps || matches!(self.starts.get(start), Some(Start::At(..)));
        if matches!(change, Change::Smooth(..)) && self.evidence.observation.is_some() {
            judged = judged.by_samples();
        }
        Some(Tried {
            change,
            own_state,
            judged,
        })
    }

    /// Changes, judged; those that explain most first.
    pub fn all_tried(&self, changes: Vec<Change>) -> Vec<Tried> {
        let tried = over_processors(changes.len(), &|| false, |k| {
            self.tried(changes[k].clone(), f64::INFINITY)
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
        Reading::Fail => tried.judged.explained >= 1.0 - ALL,
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
}

/// What was found.
#[derive(Debug)]
pub(super) enum Found {
    /// Changes that reproduce the candidate equally well, the simplest first.
    Causes(Vec<Tried>),
    /// None does. What came closest, if anything could be run.
    Unexplained(Option<Tried>),
}

/// Steps to an interval of samples.
const PARTS: [f64; 4] = [1.0, 2.0, 5.0, 10.0];

/// What one mistakes a number for most: its double and its half, the other sign, degrees.
const MISTAKEN: [f64; 5] = [2.0, 0.5, -1.0, TAU / 360.0, 360.0 / TAU];

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
        let mut changes = proposals.changes;
        changes.push(Change::State);
        if !self.numbers.case().system.kicks.is_empty() {
            changes.push(Change::NoKick);
        }
        let own = self.numbers.case().system.breakaway_test;
        let tests = [BreakawayTest::Transmitted, BreakawayTest::Stator, BreakawayTest::Rotor];
        changes.extend(tests.into_iter().filter(|test| *test != own).map(Change::Test));
        if proposals.with_steps {
            changes.extend(
                self.steppers(&proposals.tolerances, proposals.breakaway)
                    .into_iter()
                    .map(Change::Stepper),
            );
        }
        let mut tried = self.all_tried(changes);
        // Where the state at the start explains much, what is run from it has that cause in it.
        let is_state = |tried: &Tried| matches!(tried.change, Change::State);
        let by_state = tried
            .iter()
            .any(|tried| is_state(tried) && tried.judged.explained >= MUCH);
        if by_state {
            tried.retain(|tried| is_state(tried) || !tried.own_state);
        }
        // A cause that leaves more may be half of the truth: numbers are then looked for as well.
        let explains_all = |tried: &[Tried]| {
            let best = tried.iter().find(|tried| tried.judged.is_cause() && !is_state(tried));
            best.is_some_and(|best| best.judged.explained >= 1.0 - ALL)
        };
        // A number that the equations tell is better known by them than by samples, which events at the ends of steps move.
        let is_number = |tried: &Tried| matches!(tried.change, Change::Numbers(_)) && tried.judged.is_cause();
        let told = matches!(reading, Reading::Mended) && tried.iter().any(is_number);
        // From a state behind the start of the reference numbers of that start are none.
        let from_start = self.first.as_ref().is_none_or(|(time, _)| *time <= begins);
        for pairs in [false, true] {
            let enough = match pairs {
                false => told || explains_all(&tried) || by_state && !from_start,
                true => tried.iter().any(|tried| tried.judged.is_cause()),
            };
            if enough || self.evidence.observation.is_none() {
                break;
            }
            let unknown = self.unknown();
            let guesses: Vec<(String, f64)> = tried
                .iter()
                .filter_map(|tried| match &tried.change {
                    Change::Numbers(numbers) if numbers.len() == 1 && tried.judged.explained > 0.0 => {
                        Some(numbers[0].clone())
                    }
                    _ => None,
                })
                .collect();
            for (start, at) in self.starts.iter().enumerate() {
                if by_state && matches!(at, Start::At(..)) {
                    continue;
                }
                let proposed = numbers::propose(self, start, &unknown, pairs, &guesses);
                let changed = proposed.into_iter().map(Change::Numbers);
                tried.extend(self.all_tried(changed.collect()));
            }
            if !pairs && !explains_all(&tried) {
                let mistaken = unknown.iter().filter(|unknown| unknown.value != 0.0);
                let mistaken =
                    mistaken.flat_map(|unknown| MISTAKEN.map(|factor| unknown.changes(factor * unknown.value)));
                tried.extend(self.all_tried(mistaken.map(Change::Numbers).collect()));
            }
        }
        let mut tried = sorted(tried);
        if proposals.with_steps && !explains_all(&tried) {
            let numbers = tried.iter().filter_map(|tried| match &tried.change {
                Change::Numbers(numbers) => Some(numbers.clone()),
                _ => None,
            });
            let steppers = self.steppers(&[], None);
            let of_order = |stepper: &&Stepper| !stepper.scheme.is_low();
            let both = numbers.take(CLOSEST).flat_map(|numbers| {
                let each = steppers.iter().filter(of_order);
                each.map(|stepper| Change::Both(numbers.clone(), *stepper))
                    .collect::<Vec<_>>()
            });
            tried.extend(self.all_tried(both.collect()));
            tried = sorted(tried);
        }
        tried.retain(|tried| self.is_large(&tried.change) && allowed(tried, reading));
        tried.dedup_by(|a, b| a.change == b.change);
        if by_state {
            tried.retain(|tried| is_state(tried) || !tried.own_state);
        }
        let Some(best) = tried.iter().find(|tried| tried.judged.is_cause()).cloned() else {
            return Found::Unexplained(tried.into_iter().next());
        };
        tried.retain(|tried| tried.judged.is_cause() && tried.judged.as_much_as(&best.judged));
        // Of numbers that do as well, the force and its times come last.
        tried.sort_by_key(|tried| (tried.change.rank(), tried.change.is_of_normal_force()));
        // What takes more than the simplest, and explains no more, is not needed.
        let simplest = tried[0].change.rank();
        tried.retain(|tried| {
            tried.change.rank() == simplest || !matches!(tried.change, Change::Numbers(_) | Change::State)
        });
        Found::Causes(tried)
    }

    /// A run without the kicks, if it reproduces the candidate up to a time (s).
    pub fn unkicked(&self, until: f64) -> Option<Tried> {
        self.evidence.observation?;
        self.tried(Change::NoKick, until)
            .filter(|tried| tried.judged.is_cause())
    }

    /// What the rounding of a twist to multiples of a digit (rad) makes of the motion with the candidate's steps, in parts of what the
    /// candidate differs by.
    pub fn amplified(&self, digit: f64) -> Option<f64> {
        let (observation, (time, state)) = (self.evidence.observation?, self.first.as_ref()?);
        let motion = |digit: f64| {
            let stepper = Stepper {
                step: observation.interval?,
                scheme: Scheme::RungeKutta,
                stop: Stop::Sign,
                breakaway: 1.0,
                digit,
            };
            Some(stepper.play(self.physics, (*time, state), observation)?.values)
        };
        let square = observation.between(&motion(0.0)?, &motion(digit)?);
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
                with: Vec::new(),
            })
            .collect();
        // The speed of a driven end, and with it the speeds at t = 0 that are the same.
        for end in ["rotor.speed", "stator.speed"] {
            let Some(speed) = self
                .numbers
                .number(end)
                .map(|number| number.value)
                .filter(|speed| *speed != 0.0)
            else {
                continue;
            };
            let initial = self
                .numbers
                .numbers()
                .iter()
                .filter(|n| n.path.starts_with("initial.") && n.value == speed);
            let with: Vec<String> = initial.map(|number| number.path.clone()).collect();
            if !with.is_empty() {
                unknown.push(Unknown {
                    path: end.to_owned(),
                    value: speed,
                    unit: speed.abs(),
                    with,
                });
            }
        }
        let sides = [
            ("rotor", &system.rotor, &trains.rotor),
            ("stator", &system.stator, &trains.stator),
        ];
        let mut absent = |path: String, unit: f64| {
            if self.numbers.number(&path).is_none_or(|number| number.value == 0.0) && unit.is_finite() && unit > 0.0 {
                let with = Vec::new();
                let value = 0.0;
                unknown.push(Unknown {
                    path,
                    value,
                    unit,
                    with,
                });
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

    /// Solvers with the candidate's own steps, or some to each of its intervals.
    fn steppers(&self, tolerances: &[f64], breakaway: Option<f64>) -> Vec<Stepper> {
        let interval = self.evidence.observation.and_then(|observation| observation.interval);
        let Some(interval) = interval else { return Vec::new() };
        let mut all = Vec::new();
        for scheme in Scheme::ALL {
            let mut add = |parts: f64, stop: Stop, breakaway: f64| {
                all.push(Stepper {
                    step: interval / parts,
                    scheme,
                    stop,
                    breakaway,
                    digit: 0.0,
                });
            };
            // Two mistakes at once are not tried with every tolerance.
            for &tolerance in tolerances.iter().filter(|_| !scheme.is_low()) {
                add(1.0, Stop::Within(tolerance), 1.0);
                add(1.0, Stop::Frozen(tolerance), 1.0);
            }
            for parts in PARTS {
                add(parts, Stop::Sign, 1.0);
            }
            if let Some(breakaway) = breakaway.filter(|_| !scheme.is_low()) {
                add(1.0, Stop::Sign, breakaway);
            }
        }
        all
    }
}
