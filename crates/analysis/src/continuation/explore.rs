//! Branches of a study: the first ones, those that start at special points, and curves of special points.

use super::curve::{CurvePoint, CurveSteps, trace};
use super::ending::EndReason;
use super::follow::{BranchFollower, FollowSteps, FoundPoint, IS_END, IS_SPECIAL, MARKED, is_half};
use super::manifold::Measured;
use super::special::{Special, Station, critical_pair, row, unit};
use super::study::ContinuationStudy;
use crate::analysis::stability::Modes;
use crate::cycle::{CycleStability, Family, Guess, Manifold, What, collapsed, find, solve};
use crate::error::{Error, attempt};
use crate::sweep::{Journal, PointOutcome};
use nalgebra::{Complex, DMatrix, DVector};
use std::collections::VecDeque;
use std::f64::consts::TAU;
use std::time::{Duration, Instant};
use stickslip_system::numerics::eigenvalues::null_vector;
use stickslip_system::watch::Watch;

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
        let Measured { guess, orbit, .. } = measured;
        let born = match special {
            Some(Special::Hopf) => critical_pair(Special::Hopf, &measured.spectrum).map(|pair| TAU / pair.im),
            _ => None,
        };
        BranchPoint {
            value: guess.values[0],
            period: born.unwrap_or(guess.period),
            position: orbit.position,
            relative_velocity: orbit.relative_velocity,
            stability: orbit.stability,
            unstable: measured.unstable,
            spectrum: measured.spectrum.iter().map(|one| (one.re, one.im)).collect(),
            sticks: orbit.sticks,
            shortest_stick: orbit.shortest_stick.unwrap_or(f64::NAN),
            margin: orbit.nearest.map_or(f64::NAN, |nearest| nearest.distance),
            sequence: orbit.sequence(),
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
#[derive(Debug, Clone, Default)]
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

struct Job {
    what: What,
    guess: Guess,
    /// Direction in physical units; `None` follows the parameter upwards (`up`) or downwards.
    direction: Option<DVector<f64>>,
    up: bool,
    /// Branch, index of the birth point there, and this point.
    birth: Option<((usize, usize), Box<BranchPoint>)>,
}

struct SpecialStart {
    special: Special,
    what: What,
    guess: Guess,
    at: (usize, usize),
}

pub(crate) struct Explorer<'a> {
    study: &'a ContinuationStudy,
    family: &'a Family,
    journal: &'a mut Journal,
    stop: &'a dyn Watch,
    told: &'a dyn Fn(&Explored),
    explored: Explored,
    jobs: VecDeque<Job>,
    /// Kind, value and period (0 for steady sliding) of the special points so far.
    known: Vec<(Special, f64, f64)>,
    specials: Vec<SpecialStart>,
    /// Points that are not yet in the journal, and time of the last write.
    waiting: (Vec<PointOutcome>, Instant),
}

impl<'a> Explorer<'a> {
    pub fn new(
        study: &'a ContinuationStudy,
        family: &'a Family,
        journal: &'a mut Journal,
        stop: &'a dyn Watch,
        told: &'a dyn Fn(&Explored),
    ) -> Self {
        Explorer {
            study,
            family,
            journal,
            stop,
            told,
            explored: Explored::default(),
            jobs: VecDeque::new(),
            known: Vec::new(),
            specials: Vec::new(),
            waiting: (Vec::new(), Instant::now()),
        }
    }

    fn write(&mut self) -> Result<(), Error> {
        self.journal.append(&std::mem::take(&mut self.waiting.0))?;
        self.waiting.1 = Instant::now();
        Ok(())
    }

    fn keep(&mut self, number: u64, values: Vec<f64>) {
        self.waiting.0.push(PointOutcome {
            number,
            result: Ok(values),
            events: Vec::new(),
        });
    }

    fn kept(&mut self, number: u64) -> Result<Option<Vec<f64>>, Error> {
        Ok(self.journal.read(number)?.and_then(|outcome| outcome.result.ok()))
    }

    fn remark(&mut self, remark: String) {
        self.explored.remarks.push(remark);
    }

    /// `None` and a remark instead of a failure. An interruption stays an error.
    fn or_remark<T>(&mut self, found: Result<T, Error>, what: String) -> Result<Option<T>, Error> {
        match found {
            Ok(found) => Ok(Some(found)),
            Err(error) if error.is_interrupted() => Err(error),
            Err(error) => {
                self.remark(format!("{what}: {error}"));
                Ok(None)
            }
        }
    }

    pub fn explore(mut self) -> Result<Explored, Error> {
        let ended = self.follow_all();
        self.write()?;
        match ended {
            Err(error) if error.is_interrupted() => self.explored.interrupted = true,
            ended => ended?,
        }
        Ok(self.explored)
    }

    fn follow_all(&mut self) -> Result<(), Error> {
        self.start()?;
        while let Some(job) = self.jobs.pop_front() {
            if self.explored.branches.len() >= MOST_BRANCHES {
                self.remark(format!(
                    "more than {MOST_BRANCHES} branches: the others were not followed"
                ));
                break;
            }
            self.branch(job)?;
        }
        if !self.study.curves.is_empty() && self.study.axes.len() > 1 {
            self.curves()?;
        }
        Ok(())
    }

    fn width(&self) -> f64 {
        let (low, high) = self.study.range(0);
        high - low
    }

    fn manifold<'m>(&self, what: What, widths: &'m [f64]) -> Manifold<'m>
    where
        'a: 'm,
    {
        Manifold {
            family: self.family,
            what,
            widths,
            stop: self.stop,
        }
    }

    fn start(&mut self) -> Result<(), Error> {
        let own = self.family.case().number(&self.study.axes[0].keys[0])?;
        let mut starts = Vec::new();
        if self.study.steady {
            starts.push(self.steady(own).map(|(guess, sense)| (What::Steady(sense), guess)));
        }
        if self.study.cycle {
            let orbit = find(self.family, &[own], &self.study.search, self.stop);
            starts.push(orbit.map(|orbit| (What::Cycles(orbit.multiple.unwrap_or(1)), orbit.guess())));
        }
        let mut why = Vec::new();
        for start in starts {
            match start {
                Ok((what, guess)) => {
                    let ways = [(true, self.study.directions.0), (false, self.study.directions.1)];
                    self.jobs
                        .extend(ways.into_iter().filter(|way| way.1).map(|(up, _)| Job {
                            what,
                            guess: guess.clone(),
                            direction: None,
                            up,
                            birth: None,
                        }));
                }
                Err(error) if error.is_interrupted() => return Err(error),
                Err(error) => why.push(error),
            }
        }
        if self.jobs.is_empty()
            && let Some(error) = why.pop()
        {
            return Err(error);
        }
        why.iter()
            .for_each(|error| self.remark(format!("not followed: {error}")));
        Ok(())
    }

    fn steady(&self, value: f64) -> Result<(Guess, i8), Error> {
        let not_steady = || {
            Error::input(
                "there is no steady sliding to follow: no relative velocity balances what drives the case, or a harmonic drives it; \
                 follow cycles instead (branch.of = \"cycle\")",
            )
        };
        if !self.family.is_autonomous() {
            return Err(not_steady());
        }
        let member = self.family.at(&[value], false)?;
        let modes = Modes::linear(&member.system);
        let point = modes.operating_points.iter().find(|point| point.steady);
        let point = point.ok_or_else(not_steady)?;
        let twists = (&point.rotor_twist[..], &point.stator_twist[..]);
        let speeds = (point.rotor_speed.unwrap_or(0.0), point.stator_speed.unwrap_or(0.0));
        let state = stickslip_engine::simulation::state_of_parts(&member.system, twists, speeds);
        let sense = if point.relative_velocity < 0.0 { -1 } else { 1 };
        let guess = Guess {
            time: 0.0,
            state,
            period: f64::NAN,
            values: vec![value],
        };
        let widths = [self.width()];
        let mut local = self.manifold(What::Steady(sense), &widths).local(&guess)?;
        let x = local.unknowns(&guess);
        let held = row(&unit(x.len(), x.len() - 1));
        let solution = solve(&mut local, &x, &held, guess.period).map_err(|_| not_steady())?;
        Ok((local.guess(&solution.x)?, sense))
    }

    fn branch(&mut self, job: Job) -> Result<(), Error> {
        let index = self.explored.branches.len();
        let widths = [self.width()];
        let birth = job.birth.as_ref().map(|(_, birth)| birth);
        let born_at = |point: &BranchPoint| {
            let birth = birth.filter(|birth| birth.special == Some(Special::Hopf));
            birth.is_some_and(|birth| (birth.value - point.value).abs() <= SAME * widths[0])
        };
        let ends_there = |branch: &Branch| {
            let last = branch.points.last();
            let last = last.filter(|point| point.special == Some(Special::Hopf));
            branch.end == EndReason::Shrunk && last.is_some_and(born_at)
        };
        if self.explored.branches.iter().any(ends_there) {
            // The branch was already followed from the other end.
            return Ok(());
        }
        let manifold = self.manifold(job.what, &widths);
        let steps = FollowSteps {
            range: self.study.range(0),
            longest: self.study.step,
            most: self.study.points,
        };
        let mut guess = job.guess.clone();
        if let (Some(_), Some(direction)) = (&birth, &job.direction) {
            let what = format!("the branch that is born at {:.9} was not found", guess.values[0]);
            match self.or_remark(born(manifold, &guess, direction, &steps), what)? {
                Some(found) => guess = found,
                None => return Ok(()),
            }
        }
        let follower = BranchFollower::new(manifold, &steps, &guess, job.direction.as_ref(), job.up);
        let what = format!("the branch from {:.9} on was not followed", guess.values[0]);
        let Some(mut follower) = self.or_remark(follower, what)? else {
            return Ok(());
        };
        let (parent, birth) = job.birth.unzip();
        let mut points: Vec<BranchPoint> = birth.into_iter().map(|birth| birth.of_the_born()).collect();
        points.push(BranchPoint::new(&follower.current.measured, None));
        self.explored.branches.push(Branch {
            steady: matches!(job.what, What::Steady(_)),
            multiple: match job.what {
                What::Cycles(multiple) if !self.family.is_autonomous() => Some(multiple),
                _ => None,
            },
            parent,
            points,
            end: EndReason::Interrupted,
        });
        let mut number = index as u64 * OF_BRANCH;
        let mut ended = false;
        while !ended {
            let found = match self.recorded(number, &mut follower)? {
                Some(found) => found,
                None => self.advanced(index, number, &mut follower)?,
            };
            number += found.len() as u64;
            for one in &found {
                let branch = &mut self.explored.branches[index];
                match one {
                    FoundPoint::Point(station) => branch.points.push(BranchPoint::new(&station.measured, None)),
                    FoundPoint::Special(special, station) => {
                        let cycle = &follower.current.measured.guess;
                        self.special(*special, station, (job.what, cycle), index);
                    }
                    FoundPoint::End(reason) => {
                        branch.end = *reason;
                        ended = true;
                        if *reason == EndReason::Lost {
                            let value = branch.points.last().map_or(f64::NAN, |point| point.value);
                            let why = follower.failure.as_ref().map(|why| format!(": {why}"));
                            let why = why.unwrap_or_default();
                            self.remark(format!(
                                "branch {index} is lost at {value:.9}: no solution was found beyond{why}"
                            ));
                        }
                    }
                }
            }
            (self.told)(&self.explored);
        }
        Ok(())
    }

    /// Next points by computation, which go to the journal.
    fn advanced(
        &mut self,
        index: usize,
        number: u64,
        follower: &mut BranchFollower<'_>,
    ) -> Result<Vec<FoundPoint>, Error> {
        let found = self.or_remark(follower.advance(), format!("branch {index} ends"))?;
        let found = found.unwrap_or_else(|| vec![FoundPoint::End(EndReason::Lost)]);
        for (found, number) in found.iter().zip(number..) {
            self.keep(number, follower.mark(found));
        }
        if self.waiting.1.elapsed() >= BETWEEN_WRITES {
            self.write()?;
        }
        Ok(found)
    }

    /// Journal entries from `number` to the next point or end; `None` if incomplete.
    fn recorded(&mut self, number: u64, follower: &mut BranchFollower<'_>) -> Result<Option<Vec<FoundPoint>>, Error> {
        let mut marks = Vec::new();
        for number in number.. {
            let Some(mark) = self.kept(number)?.filter(|mark| mark.len() >= MARKED) else {
                return Ok(None);
            };
            let is = |mark: &[f64], what: usize| mark.get(what).is_some_and(|code| *code >= 0.0);
            // A last point may precede an end.
            let goes_on = is(&mark, IS_SPECIAL)
                || !is(&mark, IS_END) && self.kept(number + 1)?.is_some_and(|next| is(&next, IS_END));
            marks.push(mark);
            if !goes_on {
                break;
            }
        }
        let found = marks.iter().map(|mark| follower.resume(mark));
        found.collect::<Result<_, _>>().map(Some)
    }

    /// Adds a special point to a branch of `on`, and starts the branch that is born there. `cycle` is its last motion.
    fn special(&mut self, special: Special, station: &Station, (on, cycle): (What, &Guess), index: usize) {
        let branch = &mut self.explored.branches[index];
        let guess = &station.measured.guess;
        let (low, high) = self.study.range(0);
        // Two events of a symmetric motion change at the same time.
        let again = |point: &BranchPoint| {
            point.special == Some(special) && (point.value - guess.values[0]).abs() <= SAME_BORDER * (high - low)
        };
        if matches!(special, Special::Border(_)) && branch.points.iter().rev().take(3).any(again) {
            return;
        }
        let birth = BranchPoint::new(&station.measured, Some(special));
        // The flip at which the branch was born is a point of the cycles of half the period.
        let (what, on_branch) = match on {
            What::Steady(_) => (on, birth.clone()),
            What::Cycles(multiple) if multiple > 1 && is_half(guess, cycle) => {
                (What::Cycles(multiple / 2), birth.clone().of_the_born())
            }
            What::Cycles(_) => (on, birth.clone().on_cycles()),
        };
        branch.points.push(on_branch);
        let at = (index, branch.points.len() - 1);
        let period = if guess.period.is_nan() { 0.0 } else { guess.period };
        let same = |other: &(Special, f64, f64)| {
            other.0 == special
                && (other.1 - guess.values[0]).abs() <= SAME * (high - low)
                && (other.2 - period).abs() <= 1e-5 * period
        };
        if self.known.iter().any(same) {
            return;
        }
        self.known.push((special, guess.values[0], period));
        self.specials.push(SpecialStart {
            special,
            what: match special {
                Special::Hopf if birth.relative_velocity.1 < 0.0 => What::Steady(-1),
                Special::Hopf => What::Steady(1),
                _ => what,
            },
            guess: guess.clone(),
            at,
        });
        if what != on || !self.study.follow.contains(&special) {
            return;
        }
        let Measured { orbit, spectrum, .. } = &station.measured;
        let n = guess.state.len();
        let (value, what, period, components) = match (special, what, critical_pair(special, spectrum)) {
            // Components: state, period of an autonomous motion, parameter.
            (Special::Hopf, What::Steady(_), Some(pair)) => {
                (Complex::new(0.0, pair.im), What::Cycles(1), TAU / pair.im, n + 2)
            }
            (Special::Flip, What::Cycles(multiple), _) => (
                Complex::new(-1.0, 0.0),
                What::Cycles(2 * multiple),
                2.0 * guess.period,
                station.direction.len(),
            ),
            _ => return,
        };
        let Some(vector) = null_vector(&orbit.by_state, value) else {
            return;
        };
        let mut direction = DVector::zeros(components);
        direction.rows_mut(0, n).copy_from(&vector.map(|one| one.re));
        self.jobs.push_back(Job {
            what,
            guess: Guess {
                period,
                ..guess.clone()
            },
            direction: Some(direction),
            up: true,
            birth: Some((at, Box::new(birth))),
        });
    }

    fn curves(&mut self) -> Result<(), Error> {
        let study = self.study;
        let written = study.written()?;
        let second = written.case().number(&study.axes[1].keys[0])?;
        let keys: Vec<Vec<String>> = study.axes.iter().map(|axis| axis.keys.clone()).collect();
        let family = Family::new(written, &keys)?;
        let ranges = [study.range(0), study.range(1)];
        let widths = ranges.map(|(low, high)| high - low);
        let steps = CurveSteps {
            ranges,
            longest: study.step,
            most: CURVE_POINTS,
        };
        for kind in &study.curves {
            if !self.specials.iter().any(|one| one.special == *kind) {
                self.remark(format!("no curve of {}: no branch has such a point", kind.name()));
            }
        }
        let mut wanted = std::mem::take(&mut self.specials);
        wanted.retain(|one| study.curves.contains(&one.special));
        for (one, number) in wanted.iter().zip(OF_CURVES..) {
            let SpecialStart { special, guess, .. } = one;
            let on = |point: &CurvePoint| {
                (point.values[0] - guess.values[0]).abs() <= ON_CURVE * widths[0]
                    && (point.values[1] - second).abs() <= ON_CURVE * widths[1]
            };
            let traced = self.explored.curves.iter().filter(|curve| curve.special == *special);
            if traced.flat_map(|curve| &curve.points).any(on) {
                continue;
            }
            let points: Vec<CurvePoint> = match self.kept(number)? {
                Some(values) => {
                    let points = values.chunks_exact(3).map(|three| CurvePoint {
                        values: [three[0], three[1]],
                        period: three[2],
                    });
                    points.collect()
                }
                None => {
                    let manifold = Manifold {
                        family: &family,
                        what: one.what,
                        widths: &widths,
                        stop: self.stop,
                    };
                    let mut points = Vec::new();
                    for mut start in starts_beside(one, &self.explored.branches[one.at.0]) {
                        start.values.push(second);
                        points = attempt(trace(manifold, *special, &start, &steps))?.unwrap_or(points);
                        if !points.is_empty() {
                            break;
                        }
                    }
                    let values = points
                        .iter()
                        .flat_map(|point| [point.values[0], point.values[1], point.period]);
                    self.keep(number, values.collect());
                    self.write()?;
                    points
                }
            };
            if points.is_empty() {
                let value = guess.values[0];
                self.remark(format!("no curve of {} was found from {value:.9} on", special.name()));
                continue;
            }
            self.explored.curves.push(SpecialCurve {
                special: *special,
                points,
            });
            (self.told)(&self.explored);
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

/// First cycle of the branch that is born in this direction.
fn born(manifold: Manifold<'_>, guess: &Guess, direction: &DVector<f64>, steps: &FollowSteps) -> Result<Guess, Error> {
    let n = guess.state.len();
    // Scales are those of the special point, where the system may be at rest.
    let local = manifold.local(guess)?;
    let scale = local.scale().rows(0, n).into_owned();
    let scaled = direction.rows(0, n).component_div(&scale);
    let moved = Guess {
        state: &guess.state + direction.rows(0, n) * (FIRST_STEP * steps.longest / scaled.norm()),
        ..guess.clone()
    };
    let mut local = manifold.local(&moved)?;
    let x = local.unknowns(&moved);
    let mut plane = DMatrix::zeros(1, x.len());
    for k in 0..n {
        plane[k] = direction[k] / local.scale()[k];
    }
    let plane = &plane / plane.norm();
    let solution = solve(&mut local, &x, &plane, guess.period)?;
    let found = local.guess(&solution.x)?;
    let (low, high) = steps.range;
    let moved = (found.values[0] - guess.values[0]).abs();
    // Every motion closes over zero time, so the period must not change much.
    let same_period = (found.period / guess.period - 1.0).abs() <= OTHER_PERIOD;
    match same_period && moved <= steps.longest * (high - low) {
        true => Ok(found),
        false => Err(collapsed(guess.period)),
    }
}
