//! Pseudo-arclength continuation of a branch: past folds and changes of the sequence of events, with special points.

use super::ending::{EndReason, flip_near, hopf_near};
use super::manifold::Measured;
use super::special::{Special, Station, Trial, row, scaled, tests, unit};
use crate::cycle::{Guess, Local, Manifold, NewtonEquations as _, NewtonSolution, What, degenerate, solve, tangent};
use crate::error::{Error, attempt};
use nalgebra::DVector;
use std::collections::VecDeque;

const SHORTEST: f64 = 1e-7;

/// Least cosine between successive directions. Steps grow only above the second value.
const LEAST_COSINE: f64 = 0.85;
const GOOD_COSINE: f64 = 0.985;

/// Least cosine between the flow at a solution and at the previous point, across which the phase is fixed. Below it,
/// the tangent of the branch uses the phase of the solution itself.
const LEAST_PHASE_COSINE: f64 = 0.9;

/// Steps grow after at most this many iterations, and shrink above the second number.
const FEW_ITERATIONS: usize = 6;
const MANY_ITERATIONS: usize = 9;

/// Largest distance of a solution from its prediction, in steps.
const FARTHEST: f64 = 1.5;

/// Bisections of a step in the search for a special point, and the final fraction of the step.
pub(super) const MOST_HALVINGS: usize = 60;
pub(super) const LOCATED: f64 = 1e-14;

/// Points kept before the current one. A border can be sought from a point at some distance.
const KEPT: usize = 40;

/// A failing step is halved to this fraction of the longest step; then a border is sought.
pub(super) const SHORT: f64 = 1e-3;

/// Fraction of the largest swing of omega_r below which cycles may have shrunk to steady sliding. The second value
/// holds if a step fails.
const SHRUNK: f64 = 0.02;
const SMALL: f64 = 0.1;

/// Fraction of the largest swing of omega_r below which the motion has come to rest.
const RESTED: f64 = 1e-4;

/// Ratio to the first period above which a period counts as infinite.
const INFINITE: f64 = 1e3;

#[derive(Debug, Clone)]
pub(crate) struct FollowSteps {
    /// Range of the varied parameter, SI.
    pub range: (f64, f64),
    /// Longest step, as a fraction of range and motion size together.
    pub longest: f64,
    pub most: usize,
}

#[derive(Debug, Clone)]
pub(crate) enum FoundPoint {
    Point(Box<Station>),
    Special(Special, Box<Station>),
    End(EndReason),
}

/// Journal record of a finding: special point, end (-1: none), time, period, step, period of the measurement, numbers of
/// components and parameters; then state, parameters, those of the measurement ([`Measured::at`]), and direction.
pub(super) const MARKED: usize = 8;
pub(super) const IS_SPECIAL: usize = 0;
pub(super) const IS_END: usize = 1;

/// A point in scaled unknowns, and a direction from it.
pub(super) struct Ray<'l, 'a> {
    pub local: &'l mut Local<'a>,
    pub x: &'l DVector<f64>,
    pub along: &'l DVector<f64>,
}

pub(crate) struct BranchFollower<'a> {
    pub(super) manifold: Manifold<'a>,
    pub(super) steps: &'a FollowSteps,
    pub(super) current: Station,
    pub(super) before: VecDeque<Station>,
    pub(super) step: f64,
    first: Guess,
    first_swing: f64,
    swing: f64,
    /// Distance of a period-doubled cycle from itself after half a period: previous, current, largest.
    halves: [f64; 3],
    points: usize,
    pub(super) failure: Option<String>,
}

/// Whether a special point lies on the cycles of half the period.
pub(super) fn is_half(special: &Guess, cycle: &Guess) -> bool {
    special.period < 0.75 * cycle.period
}

/// The tangent of the branch lies on the side of `toward`, a direction in scaled unknowns.
fn station_at(
    manifold: Manifold<'_>,
    measured: Measured,
    toward: impl FnOnce(&Local<'_>) -> DVector<f64>,
) -> Result<Station, Error> {
    let mut local = manifold.local(&measured.guess)?;
    let (_, jacobian) = local.evaluate(&local.unknowns(&measured.guess))?;
    let found = tangent(&jacobian, &toward(&local)).ok_or_else(|| degenerate(measured.guess.period))?;
    Ok(Station::new(manifold.what, &local, measured, &found, &jacobian))
}

impl<'a> BranchFollower<'a> {
    /// Starts from a solution, toward a rising (`up`) or falling parameter, or in a given direction.
    pub fn new(
        manifold: Manifold<'a>,
        steps: &'a FollowSteps,
        guess: &Guess,
        direction: Option<&DVector<f64>>,
        up: bool,
    ) -> Result<BranchFollower<'a>, Error> {
        let measured = manifold.measure(guess)?;
        let swing = measured.swing();
        let current = station_at(manifold, measured, |local| match direction {
            Some(direction) => scaled(local, direction),
            None => {
                let along = unit(local.scale().len(), local.scale().len() - 1);
                if up { along } else { -along }
            }
        })?;
        Ok(BranchFollower {
            manifold,
            steps,
            current,
            before: VecDeque::new(),
            step: 0.1 * steps.longest,
            first: guess.clone(),
            first_swing: swing,
            swing,
            halves: [0.0; 3],
            points: 0,
            failure: None,
        })
    }

    pub fn mark(&self, found: &FoundPoint) -> Vec<f64> {
        let (station, special, end) = match found {
            FoundPoint::Point(station) => (&**station, -1, -1),
            FoundPoint::Special(special, station) => (&**station, special.code(), -1),
            FoundPoint::End(reason) => (&self.current, -1, *reason as i8),
        };
        let Measured { guess, at, .. } = &station.measured;
        let head: [f64; MARKED] = [
            special.into(),
            end.into(),
            guess.time,
            guess.period,
            self.step,
            at.0,
            guess.state.len() as f64,
            guess.values.len() as f64,
        ];
        let direction = station.direction.as_slice();
        [&head, guess.state.as_slice(), &guess.values, &at.1, direction].concat()
    }

    pub fn resume(&mut self, mark: &[f64]) -> Result<FoundPoint, Error> {
        let torn = || Error::input("the journal has a record that is none of a branch; start anew with --force");
        let (head, rest) = mark.split_at_checked(MARKED).ok_or_else(torn)?;
        if head[IS_END] >= 0.0 {
            return Ok(FoundPoint::End(EndReason::of_code(head[IS_END])));
        }
        let (state, rest) = rest.split_at_checked(head[6] as usize).ok_or_else(torn)?;
        let (values, rest) = rest.split_at_checked(head[7] as usize).ok_or_else(torn)?;
        let (measured_values, direction) = rest.split_at_checked(head[7] as usize).ok_or_else(torn)?;
        let guess = Guess {
            time: head[2],
            state: DVector::from_column_slice(state),
            period: head[3],
            values: values.to_vec(),
        };
        // Cycles end in steady sliding, or on cycles of half their period.
        let what = match self.manifold.what {
            What::Cycles(_) if guess.period.is_nan() => {
                let forwards = self.current.measured.orbit.relative_velocity.1 > 0.0;
                What::Steady(if forwards { 1 } else { -1 })
            }
            What::Cycles(multiple) if multiple > 1 && is_half(&guess, &self.current.measured.guess) => {
                What::Cycles(multiple / 2)
            }
            what => what,
        };
        let manifold = Manifold { what, ..self.manifold };
        let beside = Guess {
            period: head[5],
            values: measured_values.to_vec(),
            ..guess.clone()
        };
        let mut measured = manifold.measure(&beside)?;
        measured.guess = guess.clone();
        let mut local = manifold.local(&guess)?;
        let (_, jacobian) = local.evaluate(&local.unknowns(&guess))?;
        let direction = DVector::from_column_slice(direction);
        let station = Station {
            tests: tests(what, &measured, &scaled(&local, &direction), &jacobian),
            measured,
            direction,
        };
        if head[IS_SPECIAL] >= 0.0 {
            let special = Special::ALL.get(head[IS_SPECIAL] as usize).ok_or_else(torn)?;
            return Ok(FoundPoint::Special(*special, Box::new(station)));
        }
        self.accept(station.clone());
        self.step = head[4];
        Ok(FoundPoint::Point(Box::new(station)))
    }

    pub(super) fn reason(&self, local: &mut Local<'a>, beyond: &DVector<f64>) -> String {
        if let Err(error) = local.evaluate(beyond) {
            return error.to_string();
        }
        let near = self.current.measured.orbit.nearest.map(|nearest| {
            let (words, distance) = (nearest.border.words(), nearest.distance);
            format!("; the nearest change of its events ({words}) is at a relative distance of {distance:.1e}")
        });
        let near = near.unwrap_or_default();
        format!("Newton's method does not converge there by the shortest steps{near}")
    }

    pub(super) fn accept(&mut self, station: Station) {
        self.swing = self.swing.max(station.measured.swing());
        self.points += 1;
        let now = self.manifold.half_way(&station.measured);
        self.halves = [self.halves[1], now, self.halves[2].max(now)];
        self.before.push_front(std::mem::replace(&mut self.current, station));
        self.before.truncate(KEPT);
    }

    /// Next points and special points. The last finding of a branch is its end.
    pub fn advance(&mut self) -> Result<Vec<FoundPoint>, Error> {
        if self.points >= self.steps.most {
            return Ok(vec![FoundPoint::End(EndReason::Points)]);
        }
        let [before, now, most] = self.halves;
        if now < before && now < SMALL * most {
            let flip = flip_near(self.manifold, &self.current)?;
            let flip = flip.map(|station| FoundPoint::Special(Special::Flip, Box::new(station)));
            return Ok(flip.into_iter().chain([FoundPoint::End(EndReason::Halved)]).collect());
        }
        let mut local = self.manifold.local(&self.current.measured.guess)?;
        let x = local.unknowns(&self.current.measured.guess);
        let along = scaled(&local, &self.current.direction);
        let shortest = SHORTEST * self.steps.longest;
        let ray = &mut Ray {
            local: &mut local,
            x: &x,
            along: &along,
        };
        loop {
            let trial = attempt(self.trial(ray, self.step))?.flatten();
            self.failure = None;
            let Some(trial) = trial else {
                let small = self.current.measured.swing() < SMALL * self.swing;
                if small
                    && self.manifold.is_of_autonomous_cycles()
                    && let Some(found) = self.shrunk()?
                {
                    return Ok(found);
                }
                if self.step <= SHORT * self.steps.longest
                    && let Some(found) = self.border(ray, self.step)?
                {
                    return Ok(found);
                }
                self.step /= 2.0;
                continue;
            };
            let Trial { solution, station } = trial;
            let (next, step, is_last) = match self.outside(&station) {
                None => (station, self.step, false),
                Some(bound) => match self.clipped(ray.local, &station, bound)? {
                    Some((share, clipped)) => (clipped, share * self.step, true),
                    None if self.step > SHORT * self.steps.longest => {
                        self.step /= 2.0;
                        continue;
                    }
                    None => {
                        let mut end = solution.x.clone();
                        let last = end.len() - 1;
                        end[last] = bound / ray.local.scale()[last];
                        self.failure = Some(self.reason(ray.local, &end));
                        return Ok(vec![FoundPoint::End(EndReason::Lost)]);
                    }
                },
            };
            if next.measured.orbit.word != self.current.measured.orbit.word {
                if let Some(found) = self.border(ray, step)? {
                    return Ok(found);
                }
                self.step = step / 2.0;
                continue;
            }
            if is_last {
                let mut found = self.between(ray, step, &next)?;
                found.push(FoundPoint::Point(Box::new(next)));
                found.push(FoundPoint::End(EndReason::Range));
                return Ok(found);
            }
            let cosine = scaled(ray.local, &next.direction).dot(&along);
            log::debug!(
                "at {:?}: step {step:.2e}, cosine {cosine:.6}, {} iterations",
                next.measured.guess.values,
                solution.iterations
            );
            if cosine < LEAST_COSINE && self.step > 10.0 * shortest {
                self.step /= 2.0;
                continue;
            }
            if let Some(end) = self.ends(ray.local, &next)? {
                return Ok(end);
            }
            let mut found = self.between(ray, self.step, &next)?;
            if cosine > GOOD_COSINE && solution.iterations <= FEW_ITERATIONS {
                self.step = (1.5 * self.step).min(self.steps.longest);
            } else if cosine < LEAST_COSINE.max(0.95) || solution.iterations > MANY_ITERATIONS {
                self.step = (0.7 * self.step).max(shortest);
            }
            self.slow_before_rest(&next);
            found.push(self.take(next)?);
            return Ok(found);
        }
    }

    fn slow_before_rest(&mut self, next: &Station) {
        let (before, now) = (self.current.measured.swing(), next.measured.swing());
        if self.manifold.is_of_autonomous_cycles() && now < before {
            let slope = (before - now) / self.step;
            self.step = self.step.min(0.5 * now / slope);
        }
    }

    fn shrunk(&self) -> Result<Option<Vec<FoundPoint>>, Error> {
        let hopf = hopf_near(self.manifold, &self.current)?;
        Ok(hopf.map(|station| {
            vec![
                FoundPoint::Special(Special::Hopf, Box::new(station)),
                FoundPoint::End(EndReason::Shrunk),
            ]
        }))
    }

    pub(super) fn take(&mut self, station: Station) -> Result<FoundPoint, Error> {
        let moved = self.manifold.away_from_events(&station.measured, &station.direction)?;
        let station = match moved {
            Some((measured, direction)) => station_at(self.manifold, measured, |local| scaled(local, &direction))?,
            None => station,
        };
        self.accept(station.clone());
        Ok(FoundPoint::Point(Box::new(station)))
    }

    /// Solution at a distance along a direction; `None` if Newton's method converges elsewhere.
    pub(super) fn trial(&self, ray: &mut Ray<'_, 'a>, step: f64) -> Result<Option<Trial>, Error> {
        self.trial_near(ray, step, step.max(1e-9))
    }

    fn measured(&self, local: &Local<'a>, solution: NewtonSolution, along: &DVector<f64>) -> Result<Trial, Error> {
        let guess = local.guess(&solution.x)?;
        let measured = self.manifold.measure(&guess)?;
        if local.phase_cosine() < LEAST_PHASE_COSINE {
            let along = along.component_mul(local.scale());
            let station = station_at(self.manifold, measured, |local| scaled(local, &along))?;
            return Ok(Trial { solution, station });
        }
        let direction = tangent(&solution.jacobian, along).ok_or_else(|| degenerate(guess.period))?;
        let station = Station::new(self.manifold.what, local, measured, &direction, &solution.jacobian);
        Ok(Trial { solution, station })
    }

    fn value(&self, station: &Station) -> f64 {
        station.measured.guess.values[station.measured.guess.values.len() - 1]
    }

    fn outside(&self, station: &Station) -> Option<f64> {
        let (low, high) = self.steps.range;
        let value = self.value(station);
        (!(low..=high).contains(&value)).then_some(if value < low { low } else { high })
    }

    /// Point at the end of the range, and its fraction of the step; `next` lies beyond.
    fn clipped(&self, local: &mut Local<'a>, next: &Station, bound: f64) -> Result<Option<(f64, Station)>, Error> {
        let (before, after) = (self.value(&self.current), self.value(next));
        let share = (bound - before) / (after - before);
        let [start, end] = [&self.current, next].map(|station| local.unknowns(&station.measured.guess));
        let along = scaled(local, &self.current.direction);
        let mut at = &start + (end - &start) * share;
        let last = at.len() - 1;
        at[last] = bound / local.scale()[last];
        let Some(solution) = self.solved(local, &at, &unit(at.len(), last))? else {
            return Ok(None);
        };
        let share = along.dot(&(&solution.x - &start)) / self.step;
        let station = self.measured(local, solution, &along)?.station;
        Ok(Some((share.clamp(0.0, 1.0), station)))
    }

    fn ends(&mut self, local: &mut Local<'a>, next: &Station) -> Result<Option<Vec<FoundPoint>>, Error> {
        let Measured { guess, orbit, .. } = &next.measured;
        let (least, largest) = orbit.relative_velocity;
        let is_cycle = matches!(self.manifold.what, What::Cycles(_));
        if self.manifold.is_of_autonomous_cycles() {
            let swing = next.measured.swing();
            let shrinks = swing < self.current.measured.swing().min(SHRUNK * self.swing);
            let passed = || self.current.tests.passed(&next.tests, self.manifold.what);
            // A step may have passed size zero to the mirror image, where the parameter turns back.
            let mirrored = || swing < SMALL * self.swing && passed().contains(&Special::Fold);
            if (shrinks || mirrored())
                && let Some(found) = self.shrunk()?
            {
                return Ok(Some(found));
            }
        }
        let reason = if is_cycle && least.abs().max(largest.abs()) < RESTED * self.swing {
            EndReason::Rest
        } else if is_cycle && guess.period > INFINITE * self.first.period {
            EndReason::Infinite
        } else if self.points > 8 && self.returns(local, next) {
            EndReason::Closed
        } else {
            return Ok(None);
        };
        let point = FoundPoint::Point(Box::new(next.clone()));
        Ok(Some(vec![point, FoundPoint::End(reason)]))
    }

    fn returns(&self, local: &Local<'a>, next: &Station) -> bool {
        let number = self.value(next);
        let first = self.first.values[self.first.values.len() - 1];
        let between = (first - self.value(&self.current)) * (first - number) <= 0.0;
        let near = |a: f64, b: f64, size: f64| (a - b).abs() <= 3.0 * self.step * size;
        let width = local.scale()[local.scale().len() - 1];
        let same_period = self.first.period.is_nan()
            || (self.first.period - next.measured.guess.period).abs() <= 0.02 * self.first.period;
        let swing = next.measured.swing();
        let same_state = match self.manifold.what {
            What::Cycles(_) => (swing - self.first_swing).abs() <= 0.02 * self.swing,
            What::Steady(_) => {
                let apart = local.unknowns(&self.first) - local.unknowns(&next.measured.guess);
                apart.norm() <= 3.0 * self.step
            }
        };
        between && near(first, number, width) && same_period && same_state
    }

    pub(super) fn between(&self, ray: &mut Ray<'_, 'a>, step: f64, next: &Station) -> Result<Vec<FoundPoint>, Error> {
        let mut found = Vec::new();
        for special in self.current.tests.passed(&next.tests, self.manifold.what) {
            let located = self.located(ray, step, special, next)?;
            if let Some((share, station)) = located {
                found.push((share, special, station));
            }
        }
        // A fold is not a crossing of branches.
        let folds = found.iter().any(|one| one.1 == Special::Fold);
        found.retain(|one| !(folds && one.1 == Special::BranchPoint));
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(found
            .into_iter()
            .map(|(_, special, station)| FoundPoint::Special(special, Box::new(station)))
            .collect())
    }

    /// Special point by regula falsi (Illinois).
    fn located(
        &self,
        ray: &mut Ray<'_, 'a>,
        step: f64,
        special: Special,
        next: &Station,
    ) -> Result<Option<(f64, Station)>, Error> {
        let value = |station: &Station| station.tests.value(special, &station.measured);
        let (mut low, mut high) = ((0.0, value(&self.current)), (step, value(next)));
        let mut best = next.clone();
        if (low.1 * high.1).partial_cmp(&0.0) != Some(std::cmp::Ordering::Less) {
            // A pair became real on the way: bisection finds where the count changes.
            return self.halved(ray, step, special);
        }
        let mut side = 0;
        for _ in 0..MOST_HALVINGS {
            let share = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
            let middle = 0.5 * (low.0 + high.0);
            let share = if share.is_finite() { share } else { middle };
            let Some(trial) = self.trial_near(ray, share, step)? else {
                return Ok(None);
            };
            let found = value(&trial.station);
            best = trial.station;
            if found == 0.0 || (high.0 - low.0).abs() <= LOCATED * step || found.abs() <= 1e-15 {
                return Ok(Some((share, best)));
            }
            let before = if found * low.1 > 0.0 { low.0 } else { high.0 };
            if found * low.1 > 0.0 {
                low = (share, found);
                if side == -1 {
                    high.1 /= 2.0;
                }
                side = -1;
            } else {
                high = (share, found);
                if side == 1 {
                    low.1 /= 2.0;
                }
                side = 1;
            }
            if (share - before).abs() <= 1e-13 * step {
                return Ok(Some((share, best)));
            }
        }
        Ok(Some((0.5 * (low.0 + high.0), best)))
    }

    fn halved(&self, ray: &mut Ray<'_, 'a>, step: f64, special: Special) -> Result<Option<(f64, Station)>, Error> {
        let (mut low, mut high, mut best) = (0.0, step, None);
        for _ in 0..MOST_HALVINGS {
            let middle = 0.5 * (low + high);
            if high - low <= LOCATED * step {
                break;
            }
            let Some(trial) = self.trial_near(ray, middle, step)? else {
                return Ok(None);
            };
            let passed = self.current.tests.passed(&trial.station.tests, self.manifold.what);
            if passed.contains(&special) {
                high = middle;
                best = Some(trial.station);
            } else {
                low = middle;
            }
        }
        // Two multipliers that meet and separate are not a bifurcation.
        Ok(best
            .filter(|station| station.tests.value(special, &station.measured).abs() < 1e-6)
            .map(|best| (high, best)))
    }

    /// Uses the tolerance of the whole step.
    pub(super) fn trial_near(&self, ray: &mut Ray<'_, 'a>, share: f64, step: f64) -> Result<Option<Trial>, Error> {
        let Ray { local, x, along } = ray;
        let expected = *x + *along * share;
        let near = |solution: &NewtonSolution| (&solution.x - &expected).norm() <= FARTHEST * step;
        let solution = self.solved(local, &expected, along)?.filter(near);
        solution
            .map(|solution| self.measured(local, solution, along))
            .transpose()
    }

    fn solved(
        &self,
        local: &mut Local<'a>,
        at: &DVector<f64>,
        across: &DVector<f64>,
    ) -> Result<Option<NewtonSolution>, Error> {
        attempt(solve(local, at, &row(across), self.current.measured.guess.period))
    }
}
