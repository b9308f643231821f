//! Branches of a study: the first ones, those that start at special points, and curves of special points.

use super::curve::{CurvePoint, CurveSteps, trace};
use super::ending::EndReason;
use super::follow::{BranchFollower, FollowSteps, FoundPoint, Mark, is_half};
use super::manifold::{Manifold, Measured, What};
use super::special::{Special, critical_pair};
use super::station::Station;
use super::study::ContinuationStudy;
use crate::analysis::stability::Modes;
use crate::cycle::{CycleError, CycleStability, Family, Guess, find, solve};
use crate::sweep::{Journal, JournalError, PointOutcome};
use nalgebra::{Complex, DMatrix, DVector};
use std::collections::VecDeque;
use std::f64::consts::TAU;
use std::time::{Duration, Instant};
use stickslip_system::numerics::eigenvalues::null_vector;

const MOST_BRANCHES: usize = 64;

/// Fraction of the range within which special points of one kind are the same.
const SAME: f64 = 1e-7;

/// Fraction of the range within which successive borders are the same.
const SAME_BORDER: f64 = 1e-8;

/// Fraction of the range within which a special point lies on a curve traced through another point.
const ON_CURVE: f64 = 2e-3;

/// Ratio of the first step on an emerging branch to the longest step.
const FIRST_STEP: f64 = 0.3;

/// Largest relative change of the period in that step.
const OTHER_PERIOD: f64 = 0.2;

/// Journal numbers: distance between branches, and the first number of curves.
const OF_BRANCH: u64 = 1 << 32;
const OF_CURVES: u64 = 1 << 62;

/// Longest time before points reach the disk.
const BETWEEN_WRITES: Duration = Duration::from_secs(1);

/// Points on each side of a border from which its curve may start.
const BESIDE: usize = 4;

const CURVE_POINTS: usize = 400;

/// Point of a branch.
#[derive(Debug, Clone, Default)]
pub struct BranchPoint {
    /// Value of the varied parameter, SI.
    pub value: f64,
    /// Period, s; NaN for steady sliding. At a Hopf point it is the period of the emerging cycles.
    pub period: f64,
    /// Least and largest position, rad (m in translation).
    pub position: (f64, f64),
    /// Least and largest relative velocity omega_r, rad/s (m/s in translation).
    pub relative_velocity: (f64, f64),
    /// Stability against small disturbances.
    pub stability: CycleStability,
    /// Multipliers with magnitude above 1, or eigenvalues with positive real part.
    pub unstable: usize,
    /// Real and imaginary parts of multipliers, or of eigenvalues (1/s); the most unstable first.
    pub spectrum: Vec<(f64, f64)>,
    /// Sticks in a period.
    pub sticks: usize,
    /// Shortest stick, s; NaN without a stick.
    pub shortest_stick: f64,
    /// Relative distance of the nearest other sequence of events; NaN if none is near.
    pub margin: f64,
    /// Events of a period in words.
    pub sequence: String,
    /// Kind of the special point.
    pub special: Option<Special>,
    /// Phase of the drives at the start of the period, s.
    pub time: f64,
    /// State at the start of the period.
    pub state: Vec<f64>,
}

impl BranchPoint {
    fn new(measured: &Measured, special: Option<Special>) -> BranchPoint {
        let guess = &measured.guess;
        let born = match special {
            Some(Special::Hopf) => critical_pair(Special::Hopf, &measured.spectrum).map(|pair| TAU / pair.im),
            _ => None,
        };
        BranchPoint {
            value: guess.values[0],
            period: born.unwrap_or(guess.period),
            position: measured.position,
            relative_velocity: measured.relative_velocity,
            stability: measured.stability,
            unstable: measured.unstable,
            spectrum: measured.spectrum.iter().map(|one| (one.re, one.im)).collect(),
            sticks: measured.sticks,
            shortest_stick: measured.shortest_stick,
            margin: measured.nearest.map_or(f64::NAN, |nearest| nearest.1),
            sequence: measured.sequence.clone(),
            special,
            time: guess.time,
            state: guess.state.as_slice().to_vec(),
        }
    }

    /// The birth point as a cycle of size zero, whose free multiplier is 1.
    fn on_cycles(self) -> BranchPoint {
        match self.special {
            Some(Special::Hopf) => BranchPoint {
                spectrum: vec![(1.0, 0.0)],
                unstable: 0,
                ..self
            },
            _ => self,
        }
    }

    /// The birth point as the first of the emerging cycles.
    fn of_the_born(self) -> BranchPoint {
        match self.special {
            Some(Special::Flip) => BranchPoint {
                period: 2.0 * self.period,
                // Multipliers over two periods are the squares.
                spectrum: self
                    .spectrum
                    .iter()
                    .map(|&(re, im)| (re * re - im * im, 2.0 * re * im))
                    .collect(),
                ..self
            },
            _ => self.on_cycles(),
        }
    }
}

/// Branch of steady sliding or cycles.
#[derive(Debug, Clone)]
pub struct Branch {
    /// Whether the branch is steady sliding.
    pub steady: bool,
    /// Periods of the drives in a cycle; `None` for an autonomous system.
    pub multiple: Option<u32>,
    /// Parent branch, and index of the birth point there.
    pub parent: Option<(usize, usize)>,
    /// Points from the start onwards.
    pub points: Vec<BranchPoint>,
    /// Reason for its end.
    pub end: EndReason,
}

/// Curve of special points in two parameters.
#[derive(Debug, Clone)]
pub struct SpecialCurve {
    /// Kind of the points.
    pub special: Special,
    /// Points in order.
    pub points: Vec<CurvePoint>,
}

/// Branches and curves of a study.
#[derive(Debug, Clone, Default)]
pub struct Explored {
    /// Branches in the order in which they were followed.
    pub branches: Vec<Branch>,
    /// Curves in two parameters.
    pub curves: Vec<SpecialCurve>,
    /// Whether the study was interrupted.
    pub interrupted: bool,
    /// Failures, in words.
    pub remarks: Vec<String>,
}

impl Explored {
    /// Number of points.
    pub fn points(&self) -> usize {
        let curves = self.curves.iter().map(|curve| curve.points.len());
        self.branches.iter().map(|branch| branch.points.len()).sum::<usize>() + curves.sum::<usize>()
    }
}

/// Error of a continuation.
#[derive(Debug, thiserror::Error)]
pub enum ExploreError {
    /// No start was found.
    #[error("{0}")]
    NoStart(CycleError),
    /// The case cannot be followed.
    #[error("{0}")]
    Case(CycleError),
    /// There is no steady sliding.
    #[error(
        "there is no steady sliding to follow: no relative velocity balances what drives the case, or a harmonic drives it; follow \
         cycles instead (branch.of = \"cycle\")"
    )]
    NotSteady,
    /// The journal failed.
    #[error(transparent)]
    Journal(#[from] JournalError),
}

enum Halt {
    Interrupted,
    Failed(ExploreError),
}

impl<E: Into<ExploreError>> From<E> for Halt {
    fn from(error: E) -> Halt {
        Halt::Failed(error.into())
    }
}

struct Job {
    what: What,
    guess: Guess,
    /// Direction in physical units; `None` follows the parameter upwards (`up`) or downwards.
    direction: Option<DVector<f64>>,
    up: bool,
    parent: Option<(usize, usize)>,
    birth: Option<Box<BranchPoint>>,
}

struct SpecialStart {
    special: Special,
    what: What,
    guess: Guess,
    at: (usize, usize),
}

pub(crate) struct Explorer<'a> {
    pub study: &'a ContinuationStudy,
    pub family: &'a Family,
    pub journal: &'a mut Journal,
    /// Points that are not yet in the journal, and time of the last write.
    pub waiting: (Vec<PointOutcome>, Instant),
    pub stop: &'a dyn Fn() -> bool,
    pub told: &'a dyn Fn(&Explored),
}

impl Explorer<'_> {
    fn write(&mut self) -> Result<(), ExploreError> {
        self.journal.append(&std::mem::take(&mut self.waiting.0))?;
        self.waiting.1 = Instant::now();
        Ok(())
    }

    pub fn explore(&mut self) -> Result<Explored, ExploreError> {
        let mut explored = Explored::default();
        let ended = self.follow_all(&mut explored);
        self.write()?;
        match ended {
            Ok(()) => {}
            Err(Halt::Interrupted) => explored.interrupted = true,
            Err(Halt::Failed(error)) => return Err(error),
        }
        Ok(explored)
    }

    fn follow_all(&mut self, explored: &mut Explored) -> Result<(), Halt> {
        let mut jobs = self.starts(explored)?;
        let mut known: Vec<(Special, f64, f64)> = Vec::new();
        let mut specials: Vec<SpecialStart> = Vec::new();
        while let Some(job) = jobs.pop_front() {
            if explored.branches.len() >= MOST_BRANCHES {
                explored.remarks.push(format!(
                    "more than {MOST_BRANCHES} branches: the others were not followed"
                ));
                break;
            }
            let index = explored.branches.len();
            self.branch(index, job, explored, &mut known, &mut specials, &mut jobs)?;
        }
        if !self.study.curves.is_empty() && self.study.axes.len() > 1 {
            self.curves(&specials, explored)?;
        }
        Ok(())
    }

    fn widths(&self) -> Vec<f64> {
        let (low, high) = self.study.range(0);
        vec![high - low]
    }

    fn starts(&self, explored: &mut Explored) -> Result<VecDeque<Job>, Halt> {
        let key = &self.study.axes[0].keys[0];
        let case = self.family.case();
        let own = case.number(key);
        let own = own.map_err(|error| ExploreError::Case(CycleError::NoCase(error.to_string())))?;
        let mut jobs = VecDeque::new();
        let mut both = |what: What, guess: &Guess| {
            for (up, wanted) in [(true, self.study.directions.0), (false, self.study.directions.1)] {
                if wanted {
                    jobs.push_back(Job {
                        what,
                        guess: guess.clone(),
                        direction: None,
                        up,
                        parent: None,
                        birth: None,
                    });
                }
            }
        };
        let mut why = Vec::new();
        if self.study.steady {
            match self.steady(own) {
                Ok((guess, sense)) => both(What::Steady(sense), &guess),
                Err(error) => why.push(error),
            }
        }
        if self.study.cycle {
            match find(self.family, &[own], &self.study.search, self.stop) {
                Ok(orbit) => both(What::Cycles(orbit.multiple.unwrap_or(1)), &orbit.guess()),
                Err(CycleError::Interrupted) => return Err(Halt::Interrupted),
                Err(error) => why.push(ExploreError::NoStart(error)),
            }
        }
        if jobs.is_empty()
            && let Some(error) = why.pop()
        {
            return Err(error.into());
        }
        explored
            .remarks
            .extend(why.iter().map(|error| format!("not followed: {error}")));
        Ok(jobs)
    }

    fn steady(&self, value: f64) -> Result<(Guess, i8), ExploreError> {
        if !self.family.is_autonomous() {
            return Err(ExploreError::NotSteady);
        }
        let member = self.family.at(&[value], false).map_err(ExploreError::Case)?;
        let modes = Modes::linear(&member.system);
        let point = modes
            .operating_points
            .iter()
            .find(|point| point.steady)
            .ok_or(ExploreError::NotSteady)?;
        let state = stickslip_engine::simulation::state_of_parts(
            &member.system,
            (&point.rotor_twist, &point.stator_twist),
            (point.rotor_speed.unwrap_or(0.0), point.stator_speed.unwrap_or(0.0)),
        );
        let sense = if point.relative_velocity < 0.0 { -1 } else { 1 };
        let widths = self.widths();
        let manifold = Manifold {
            family: self.family,
            what: What::Steady(sense),
            widths: &widths,
            stop: self.stop,
        };
        let guess = Guess {
            time: 0.0,
            state,
            period: f64::NAN,
            values: vec![value],
        };
        let mut local = manifold.local(&guess).map_err(ExploreError::Case)?;
        let x = local.unknowns(&guess);
        let mut held = DMatrix::zeros(1, x.len());
        held[x.len() - 1] = 1.0;
        let solution = solve(&mut local, &x, &held).map_err(|_| ExploreError::NotSteady)?;
        let guess = local.guess(&solution.x).map_err(ExploreError::Case)?;
        Ok((guess, sense))
    }

    fn branch(
        &mut self,
        index: usize,
        job: Job,
        explored: &mut Explored,
        known: &mut Vec<(Special, f64, f64)>,
        specials: &mut Vec<SpecialStart>,
        jobs: &mut VecDeque<Job>,
    ) -> Result<(), Halt> {
        let born_at = |point: &BranchPoint| {
            let birth = job.birth.as_ref().filter(|birth| birth.special == Some(Special::Hopf));
            birth.is_some_and(|birth| (birth.value - point.value).abs() <= SAME * self.widths()[0])
        };
        let ends_there = |branch: &Branch| {
            let last = branch
                .points
                .last()
                .filter(|point| point.special == Some(Special::Hopf));
            branch.end == EndReason::Shrunk && last.is_some_and(born_at)
        };
        if explored.branches.iter().any(ends_there) {
            // The branch was already followed from the other end.
            return Ok(());
        }
        let widths = self.widths();
        let manifold = Manifold {
            family: self.family,
            what: job.what,
            widths: &widths,
            stop: self.stop,
        };
        let steps = FollowSteps {
            range: self.study.range(0),
            longest: self.study.step,
            most: self.study.points,
        };
        let guess = match (&job.birth, &job.direction) {
            (Some(_), Some(direction)) => match born(manifold, &job.guess, direction, &steps) {
                Ok(guess) => guess,
                Err(CycleError::Interrupted) => return Err(Halt::Interrupted),
                Err(error) => {
                    let value = job.guess.values[0];
                    explored
                        .remarks
                        .push(format!("the branch that is born at {value:.9} was not found: {error}"));
                    return Ok(());
                }
            },
            _ => job.guess.clone(),
        };
        let follower = BranchFollower::new(manifold, &steps, &guess, job.direction.as_ref(), job.up);
        let mut follower = match follower {
            Ok(follower) => follower,
            Err(CycleError::Interrupted) => return Err(Halt::Interrupted),
            Err(error) => {
                let value = guess.values[0];
                explored
                    .remarks
                    .push(format!("the branch from {value:.9} on was not followed: {error}"));
                return Ok(());
            }
        };
        let mut branch = Branch {
            steady: matches!(job.what, What::Steady(_)),
            multiple: match job.what {
                What::Cycles(multiple) if !self.family.is_autonomous() => Some(multiple),
                _ => None,
            },
            parent: job.parent,
            points: job.birth.into_iter().map(|birth| birth.of_the_born()).collect(),
            end: EndReason::Interrupted,
        };
        branch.points.push(BranchPoint::new(&follower.current().measured, None));
        explored.branches.push(branch);
        let mut number = index as u64 * OF_BRANCH;
        loop {
            let found = match self.recorded(number, &mut follower)? {
                Some(found) => found,
                None => {
                    let found = match follower.advance() {
                        Err(CycleError::Interrupted) => return Err(Halt::Interrupted),
                        Err(error) => {
                            explored.remarks.push(format!("branch {index} ends: {error}"));
                            vec![FoundPoint::End(EndReason::Lost)]
                        }
                        Ok(found) => found,
                    };
                    let marks = found.iter().map(|found| follower.mark(found));
                    let outcomes = marks.zip(number..).map(|(mark, number)| PointOutcome {
                        number,
                        result: Ok(flat(&mark)),
                        events: Vec::new(),
                    });
                    self.waiting.0.extend(outcomes);
                    if self.waiting.1.elapsed() >= BETWEEN_WRITES {
                        self.write()?;
                    }
                    found
                }
            };
            number += found.len() as u64;
            let mut ended = false;
            for one in &found {
                let branch = &mut explored.branches[index];
                match one {
                    FoundPoint::Point(station) => branch.points.push(BranchPoint::new(&station.measured, None)),
                    // Two events of a symmetric motion change at the same time.
                    FoundPoint::Special(special, station) if again(branch, *special, station, self.study.range(0)) => {}
                    FoundPoint::Special(special, station) => {
                        let birth = BranchPoint::new(&station.measured, Some(*special));
                        // The flip at which the branch was born is a point of the cycles of half the period.
                        let (what, on_branch) = match job.what {
                            What::Steady(_) => (job.what, birth.clone()),
                            What::Cycles(multiple)
                                if multiple > 1
                                    && is_half(&station.measured.guess, &follower.current().measured.guess) =>
                            {
                                (What::Cycles(multiple / 2), birth.clone().of_the_born())
                            }
                            What::Cycles(_) => (job.what, birth.clone().on_cycles()),
                        };
                        branch.points.push(on_branch);
                        let at = (index, branch.points.len() - 1);
                        let born = (what == job.what).then_some(&mut *jobs);
                        self.special(*special, station, what, (at, birth), known, specials, born);
                    }
                    FoundPoint::End(reason) => {
                        branch.end = *reason;
                        ended = true;
                        if *reason == EndReason::Lost {
                            let value = branch.points.last().map_or(f64::NAN, |point| point.value);
                            let why = match follower.failure() {
                                Some(why) => format!("no solution was found beyond: {why}"),
                                None => "no solution was found beyond".to_owned(),
                            };
                            explored
                                .remarks
                                .push(format!("branch {index} is lost at {value:.9}: {why}"));
                        }
                    }
                }
            }
            (self.told)(explored);
            if ended {
                return Ok(());
            }
        }
    }

    /// Journal entries from `number` to the next point or end; `None` if incomplete.
    fn recorded(&mut self, number: u64, follower: &mut BranchFollower<'_>) -> Result<Option<Vec<FoundPoint>>, Halt> {
        let mut marks = Vec::new();
        for number in number.. {
            let Some(outcome) = self.journal.read(number)? else {
                return Ok(None);
            };
            let Some(mark) = outcome.result.ok().and_then(|values| unflat(&values)) else {
                return Ok(None);
            };
            let closes = mark.special.is_none();
            // A last point may precede an end.
            let last_point = closes && mark.end.is_none() && self.journal.holds(number + 1);
            let ends_next = last_point
                && self.journal.read(number + 1)?.is_some_and(|next| {
                    next.result
                        .ok()
                        .and_then(|values| unflat(&values))
                        .is_some_and(|next| next.end.is_some())
                });
            marks.push(mark);
            if closes && !ends_next {
                break;
            }
        }
        let found = marks.iter().map(|mark| follower.resume(mark));
        let found = found.collect::<Result<Vec<_>, _>>().map_err(|error| match error {
            CycleError::Interrupted => Halt::Interrupted,
            error => Halt::Failed(ExploreError::Case(error)),
        })?;
        Ok(Some(found))
    }

    #[expect(clippy::too_many_arguments, reason = "lists that grow on the way")]
    fn special(
        &self,
        special: Special,
        station: &Station,
        what: What,
        (at, birth): ((usize, usize), BranchPoint),
        known: &mut Vec<(Special, f64, f64)>,
        specials: &mut Vec<SpecialStart>,
        jobs: Option<&mut VecDeque<Job>>,
    ) {
        let guess = &station.measured.guess;
        let width = self.widths()[0];
        let period = if guess.period.is_nan() { 0.0 } else { guess.period };
        let same = |other: &(Special, f64, f64)| {
            other.0 == special
                && (other.1 - guess.values[0]).abs() <= SAME * width
                && (other.2 - period).abs() <= 1e-5 * period
        };
        if known.iter().any(same) {
            return;
        }
        known.push((special, guess.values[0], period));
        let on = match special {
            Special::Hopf if birth.relative_velocity.1 < 0.0 => What::Steady(-1),
            Special::Hopf => What::Steady(1),
            _ => what,
        };
        specials.push(SpecialStart {
            special,
            what: on,
            guess: guess.clone(),
            at,
        });
        let Some(jobs) = jobs.filter(|_| self.study.follow.contains(&special)) else {
            return;
        };
        let birth = Some(Box::new(birth));
        match (special, what) {
            (Special::Hopf, What::Steady(_)) => {
                let matrix = &station.measured.matrix;
                let Some(pair) = critical_pair(special, &station.measured.spectrum) else {
                    return;
                };
                let Some(vector) = null_vector(matrix, Complex::new(0.0, pair.im)) else {
                    return;
                };
                let n = guess.state.len();
                // Components: state, period of an autonomous motion, parameter.
                let mut direction = DVector::zeros(n + 2);
                direction.rows_mut(0, n).copy_from(&vector.map(|one| one.re));
                jobs.push_back(Job {
                    what: What::Cycles(1),
                    guess: Guess {
                        period: TAU / pair.im,
                        ..guess.clone()
                    },
                    direction: Some(direction),
                    up: true,
                    parent: Some(at),
                    birth,
                });
            }
            (Special::Flip, What::Cycles(multiple)) => {
                let Some(vector) = null_vector(&station.measured.matrix, Complex::new(-1.0, 0.0)) else {
                    return;
                };
                let (n, all) = (guess.state.len(), station.direction.len());
                let mut direction = DVector::zeros(all);
                direction.rows_mut(0, n).copy_from(&vector.map(|one| one.re));
                jobs.push_back(Job {
                    what: What::Cycles(2 * multiple),
                    guess: Guess {
                        period: 2.0 * guess.period,
                        ..guess.clone()
                    },
                    direction: Some(direction),
                    up: true,
                    parent: Some(at),
                    birth,
                });
            }
            _ => {}
        }
    }

    fn curves(&mut self, specials: &[SpecialStart], explored: &mut Explored) -> Result<(), Halt> {
        let written = self.study.written();
        let written = written.map_err(|error| ExploreError::Case(CycleError::NoCase(error.to_string())))?;
        let second = written.case().number(&self.study.axes[1].keys[0]);
        let second = second.map_err(|error| ExploreError::Case(CycleError::NoCase(error.to_string())))?;
        let keys: Vec<Vec<String>> = self.study.axes.iter().map(|axis| axis.keys.clone()).collect();
        let family = Family::new(written, &keys).map_err(ExploreError::Case)?;
        let ranges = [self.study.range(0), self.study.range(1)];
        let widths = ranges.map(|(low, high)| high - low);
        let steps = CurveSteps {
            ranges,
            longest: self.study.step,
            most: CURVE_POINTS,
        };
        for kind in &self.study.curves {
            if !specials.iter().any(|one| one.special == *kind) {
                let message = format!("no curve of {}: no branch has such a point", kind.name());
                explored.remarks.push(message);
            }
        }
        let wanted = specials.iter().filter(|one| self.study.curves.contains(&one.special));
        for (index, one) in wanted.enumerate() {
            let SpecialStart { special, guess, .. } = one;
            let on = |point: &CurvePoint| {
                (point.values[0] - guess.values[0]).abs() <= ON_CURVE * widths[0]
                    && (point.values[1] - second).abs() <= ON_CURVE * widths[1]
            };
            let traced = explored.curves.iter().filter(|curve| curve.special == *special);
            if traced.flat_map(|curve| &curve.points).any(on) {
                continue;
            }
            let number = OF_CURVES + index as u64;
            let recorded = self.journal.read(number)?.and_then(|outcome| outcome.result.ok());
            let points = match recorded {
                Some(values) => values
                    .chunks_exact(3)
                    .map(|three| CurvePoint {
                        values: [three[0], three[1]],
                        period: three[2],
                    })
                    .collect(),
                None => {
                    let manifold = Manifold {
                        family: &family,
                        what: one.what,
                        widths: &widths,
                        stop: self.stop,
                    };
                    let mut points = Vec::new();
                    for mut start in starts_beside(one, &explored.branches[one.at.0]) {
                        start.values.push(second);
                        match trace(manifold, *special, &start, &steps) {
                            Err(CycleError::Interrupted) => return Err(Halt::Interrupted),
                            Err(error) => log::debug!("a curve of {}: {error}", special.name()),
                            Ok(found) => points = found,
                        }
                        if !points.is_empty() {
                            break;
                        }
                    }
                    let values = points
                        .iter()
                        .flat_map(|point| [point.values[0], point.values[1], point.period]);
                    self.waiting.0.push(PointOutcome {
                        number,
                        result: Ok(values.collect()),
                        events: Vec::new(),
                    });
                    self.write()?;
                    points
                }
            };
            if points.is_empty() {
                let value = guess.values[0];
                explored
                    .remarks
                    .push(format!("no curve of {} was found from {value:.9} on", special.name()));
                continue;
            }
            explored.curves.push(SpecialCurve {
                special: *special,
                points,
            });
            (self.told)(explored);
        }
        Ok(())
    }
}

/// Starts of a curve: the point itself. Beyond a border no distance exists, so its neighbours on the branch are added.
fn starts_beside(one: &SpecialStart, branch: &Branch) -> Vec<Guess> {
    let mut starts = vec![one.guess.clone()];
    if !matches!(one.special, Special::Border(_)) {
        return starts;
    }
    let place = one.at.1;
    let beside = (1..=BESIDE).flat_map(|k| [place.checked_sub(k), Some(place + k)]);
    let points = beside.flatten().filter_map(|k| branch.points.get(k));
    starts.extend(points.filter(|point| point.special.is_none()).map(|point| Guess {
        time: point.time,
        state: DVector::from_column_slice(&point.state),
        period: point.period,
        values: vec![point.value],
    }));
    starts
}

fn again(branch: &Branch, special: Special, station: &Station, (low, high): (f64, f64)) -> bool {
    let value = station.measured.guess.values[0];
    let same = |point: &BranchPoint| {
        point.special == Some(special) && (point.value - value).abs() <= SAME_BORDER * (high - low)
    };
    matches!(special, Special::Border(_)) && branch.points.iter().rev().take(3).any(same)
}

fn born(
    manifold: Manifold<'_>,
    guess: &Guess,
    direction: &DVector<f64>,
    steps: &FollowSteps,
) -> Result<Guess, CycleError> {
    let found = born_at(manifold, guess, direction, FIRST_STEP * steps.longest)?;
    let (low, high) = steps.range;
    let moved = (found.values[0] - guess.values[0]).abs();
    // Every motion closes over zero time, so the period must not change much.
    let same_period = (found.period / guess.period - 1.0).abs() <= OTHER_PERIOD;
    match same_period && moved <= steps.longest * (high - low) {
        true => Ok(found),
        false => Err(CycleError::Collapsed { period: guess.period }),
    }
}

fn born_at(manifold: Manifold<'_>, guess: &Guess, direction: &DVector<f64>, step: f64) -> Result<Guess, CycleError> {
    let n = guess.state.len();
    // Scales are those of the special point, where the system may be at rest.
    let local = manifold.local(guess)?;
    let scale = local.scale().rows(0, n).into_owned();
    let scaled = direction.rows(0, n).component_div(&scale);
    let moved = Guess {
        state: &guess.state + direction.rows(0, n) * (step / scaled.norm()),
        ..guess.clone()
    };
    let mut local = manifold.local(&moved)?;
    let x = local.unknowns(&moved);
    let mut plane = DMatrix::zeros(1, x.len());
    for k in 0..n {
        plane[k] = direction[k] / local.scale()[k];
    }
    let plane = &plane / plane.norm();
    match solve(&mut local, &x, &plane) {
        Ok(solution) => local.guess(&solution.x),
        Err(none) => Err(none.into_error(guess.period)),
    }
}

fn flat(mark: &Mark) -> Vec<f64> {
    let code = |code: Option<f64>| code.unwrap_or(-1.0);
    let end = mark
        .end
        .and_then(|end| EndReason::ALL.iter().position(|one| *one == end));
    let mut all = vec![
        code(mark.special.map(f64::from)),
        code(end.map(|end| end as f64)),
        mark.time,
        mark.period,
        mark.step,
        mark.measured.0,
        mark.state.len() as f64,
        mark.values.len() as f64,
    ];
    all.extend(
        mark.state
            .iter()
            .chain(&mark.values)
            .chain(&mark.measured.1)
            .chain(&mark.direction),
    );
    all
}

fn unflat(all: &[f64]) -> Option<Mark> {
    let (head, rest) = all.split_at_checked(8)?;
    let (state, rest) = rest.split_at_checked(head[6] as usize)?;
    let (values, rest) = rest.split_at_checked(head[7] as usize)?;
    let (measured, direction) = rest.split_at_checked(head[7] as usize)?;
    Some(Mark {
        special: (head[0] >= 0.0).then_some(head[0] as i8),
        end: match head[1] {
            code if code >= 0.0 => Some(*EndReason::ALL.get(code as usize)?),
            _ => None,
        },
        time: head[2],
        period: head[3],
        step: head[4],
        state: state.to_vec(),
        values: values.to_vec(),
        direction: direction.to_vec(),
        measured: (head[5], measured.to_vec()),
    })
}
