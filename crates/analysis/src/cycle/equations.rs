//! Equations of steady sliding and of cycles, and Newton's method for underdetermined equations.

use super::family::{Family, Member};
use crate::error::{Error, ErrorKind};
use nalgebra::{DMatrix, DVector};
use stickslip_engine::simulation::{Shot, WantedResults, shoot, sliding, weights};
use stickslip_system::watch::Watch;

/// Least scale of a component, as a speed, relative to the largest speed of the motion.
const LEAST_SHARE: f64 = 0.05;

/// Scale of each state component: its own size, at least a fraction of the largest one. Sizes are compared as speeds.
pub(crate) fn scales(sizes: &[f64], weights: &[f64]) -> Vec<f64> {
    let pairs = || sizes.iter().zip(weights);
    let largest = pairs().map(|(size, weight)| size * weight).fold(0.0, f64::max);
    let scale = |(size, weight): (&f64, &f64)| match size.max(LEAST_SHARE * largest / weight) {
        scale if scale > 0.0 => scale,
        _ => 1.0,
    };
    pairs().map(scale).collect()
}

#[derive(Debug, Clone)]
pub(crate) struct Guess {
    /// Phase of the drives at the start, s.
    pub time: f64,
    pub state: DVector<f64>,
    pub period: f64,
    pub values: Vec<f64>,
}

/// Motion without derivatives. `extrema` adds peaks and margins.
pub(crate) fn motion(
    member: &Member,
    from: (f64, &DVector<f64>),
    time: f64,
    extrema: bool,
    stop: &dyn Watch,
) -> Result<Shot, Error> {
    let wanted = WantedResults {
        derivatives: None,
        extrema,
        stop,
    };
    Ok(shoot((&member.system, member.threshold), from, time, wanted)?)
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum What {
    /// Steady sliding with this sense.
    Steady(i8),
    /// Cycles over this many periods of the drives.
    Cycles(u32),
}

#[derive(Clone, Copy)]
pub(crate) struct Manifold<'a> {
    pub family: &'a Family,
    pub what: What,
    /// Scales of the varied parameters.
    pub widths: &'a [f64],
    pub stop: &'a dyn Watch,
}

impl<'a> Manifold<'a> {
    pub fn is_of_autonomous_cycles(&self) -> bool {
        matches!(self.what, What::Cycles(_)) && self.family.is_autonomous()
    }

    pub fn local(&self, guess: &Guess) -> Result<Local<'a>, Error> {
        let member = self.family.at(&guess.values, false)?;
        let (weights, n) = (weights(&member.system), guess.state.len());
        let mut local = match self.what {
            What::Steady(sense) => {
                let here = sliding((&member.system, member.threshold), sense, &guess.state);
                let sizes: Vec<f64> = guess.state.iter().map(|y| y.abs()).collect();
                let least = LEAST_SHARE * here.relative_velocity.abs();
                let scale = scales(&sizes, &weights).into_iter().zip(&weights);
                let scale: Vec<f64> = scale.map(|(scale, weight)| scale.max(least / weight)).collect();
                let scaled = DMatrix::from_fn(n, n, |i, j| here.jacobian[(i, j)] * scale[j] / scale[i]);
                Local {
                    manifold: *self,
                    start: guess.clone(),
                    flow: DVector::zeros(n),
                    scale: DVector::from_vec(scale),
                    fastest: scaled.amax(),
                    sizes,
                    last: None,
                }
            }
            What::Cycles(_) => {
                let shot = motion(&member, (guess.time, &guess.state), guess.period, false, self.stop)?;
                let scale = DVector::from_vec(scales(&shot.sizes, &weights));
                Local {
                    manifold: *self,
                    start: guess.clone(),
                    flow: shot.start_rates.component_div(&scale).normalize(),
                    scale,
                    fastest: f64::NAN,
                    sizes: shot.sizes,
                    last: None,
                }
            }
        };
        let period = self.is_of_autonomous_cycles().then_some(guess.period);
        let more = period.into_iter().chain(self.widths.iter().copied());
        local.scale.extend(more);
        Ok(local)
    }
}

/// Equations about a start in scaled unknowns: state, period of autonomous cycles, varied parameters. In steady sliding
/// d(state)/dt = 0; the state of a cycle repeats after a period. The plane through the start across the flow fixes the
/// phase of an autonomous cycle.
pub(crate) struct Local<'a> {
    manifold: Manifold<'a>,
    start: Guess,
    /// Direction of the flow of a cycle in scaled components.
    flow: DVector<f64>,
    scale: DVector<f64>,
    /// Fastest rate of steady sliding, 1/s.
    fastest: f64,
    /// Largest magnitude of each component of the state.
    pub sizes: Vec<f64>,
    pub last: Option<Shot>,
}

impl Local<'_> {
    pub fn scale(&self) -> &DVector<f64> {
        &self.scale
    }

    /// Cosine between the flow at the last start and the flow of the guess, whose plane fixes the phase of an
    /// autonomous cycle; 1 for other motions.
    pub fn phase_cosine(&self) -> f64 {
        match &self.last {
            Some(shot) if self.manifold.is_of_autonomous_cycles() => {
                let scale = self.scale.rows(0, self.moving());
                let flow = shot.start_rates.component_div(&scale);
                flow.dot(&self.flow) / flow.norm()
            }
            _ => 1.0,
        }
    }

    fn moving(&self) -> usize {
        self.start.state.len()
    }

    pub fn unknowns(&self, guess: &Guess) -> DVector<f64> {
        let period = self.manifold.is_of_autonomous_cycles().then_some(&guess.period);
        let all: Vec<f64> = guess.state.iter().chain(period).chain(&guess.values).copied().collect();
        DVector::from_vec(all).component_div(&self.scale)
    }

    pub fn guess(&self, x: &DVector<f64>) -> Result<Guess, Error> {
        let (u, n) = (x.component_mul(&self.scale), self.moving());
        let has_period = self.manifold.is_of_autonomous_cycles();
        let values = u.as_slice()[n + usize::from(has_period)..].to_vec();
        let period = match self.manifold.what {
            What::Steady(_) => f64::NAN,
            What::Cycles(_) if has_period => u[n],
            What::Cycles(multiple) => {
                f64::from(multiple) * self.manifold.family.at(&values, false)?.period.unwrap_or(f64::NAN)
            }
        };
        Ok(Guess {
            time: self.start.time,
            state: u.rows(0, n).into_owned(),
            period,
            values,
        })
    }

    /// Plane of constant parameters.
    pub fn held(&self) -> DMatrix<f64> {
        let (varying, all) = (self.manifold.family.numbers(), self.scale.len());
        DMatrix::from_fn(varying, all, |i, j| f64::from(j == all - varying + i))
    }

    fn steady(&self, sense: i8, guess: &Guess, member: &Member) -> Result<(DVector<f64>, DMatrix<f64>), Error> {
        let n = self.moving();
        let here = sliding((&member.system, member.threshold), sense, &guess.state);
        if here.relative_velocity * f64::from(sense) <= 0.0 {
            return Err(no_steady_sliding());
        }
        let row = |i: usize| 1.0 / (self.scale[i] * self.fastest);
        let residual = DVector::from_fn(n, |i, _| here.rates[i] * row(i));
        let mut jacobian = DMatrix::zeros(n, self.scale.len());
        for i in 0..n {
            for j in 0..n {
                jacobian[(i, j)] = here.jacobian[(i, j)] * self.scale[j] * row(i);
            }
        }
        for (column, moved) in (n..).zip(&member.moved) {
            for copy in &moved.copies {
                let other = sliding((&copy.system, copy.threshold), sense, &guess.state);
                for i in 0..n {
                    jacobian[(i, column)] += copy.weight * other.rates[i] * self.scale[column] * row(i);
                }
            }
        }
        Ok((residual, jacobian))
    }
}

impl NewtonEquations for Local<'_> {
    fn evaluate(&mut self, x: &DVector<f64>) -> Result<(DVector<f64>, DMatrix<f64>), Error> {
        let guess = self.guess(x)?;
        let n = self.moving();
        let member: Member = self.manifold.family.at(&guess.values, true)?;
        let multiple = match self.manifold.what {
            What::Steady(sense) => return self.steady(sense, &guess, &member),
            What::Cycles(multiple) => f64::from(multiple),
        };
        let autonomous = self.manifold.family.is_autonomous();
        if guess.period.is_nan() || guess.period <= 0.0 {
            return Err(collapsed(guess.period));
        }
        let wanted = WantedResults {
            derivatives: Some(&member.moved),
            extrema: false,
            stop: self.manifold.stop,
        };
        let start = (guess.time, &guess.state);
        let shot = shoot((&member.system, member.threshold), start, guess.period, wanted)?;
        let rows = n + usize::from(autonomous);
        let mut residual = DVector::zeros(rows);
        let mut jacobian = DMatrix::zeros(rows, x.len());
        for i in 0..n {
            let size = self.scale[i];
            residual[i] = (shot.end[i] - guess.state[i]) / size;
            for j in 0..n {
                jacobian[(i, j)] = (shot.by_state[(i, j)] - f64::from(i == j)) * self.scale[j] / size;
            }
            if autonomous {
                jacobian[(i, n)] = shot.end_rates[i] * self.scale[n] / size;
            }
            for (number, slope) in member.period_slopes.iter().enumerate() {
                // A change of the drives' period moves the end.
                let by_end = match autonomous {
                    true => 0.0,
                    false => shot.end_rates[i] * multiple * slope,
                };
                let column = rows + number;
                jacobian[(i, column)] = (shot.by_number[(i, number)] + by_end) * self.scale[column] / size;
            }
        }
        if autonomous {
            for j in 0..n {
                residual[n] += self.flow[j] * (guess.state[j] - self.start.state[j]) / self.scale[j];
                jacobian[(n, j)] = self.flow[j];
            }
        }
        self.last = Some(shot);
        Ok((residual, jacobian))
    }
}

pub(crate) fn no_steady_sliding() -> Error {
    Error::computation("there is no steady sliding in this sense")
}

/// Error of a search that came from a cycle of this period (s) to rest.
pub(crate) fn collapsed(period: f64) -> Error {
    let message = format!(
        "Newton's method came to rest: the periodic motion from a period of {period:.9} s shrank to steady sliding or to a stick. \
         Start from a state farther from it (--from initial)"
    );
    Error::new(ErrorKind::NoCycle, message)
}

/// Error of a motion that closes over this period (s) without being an isolated cycle.
pub(crate) fn degenerate(period: f64) -> Error {
    Error::computation(format!(
        "the motion closes over {period:.9} s, but is no cycle of its own: its derivatives are singular or missing, as of a contact that \
         sticks, of a motion among others like it, or where two events coincide. Change a parameter a little"
    ))
}

/// Equations in scaled unknowns of order 1.
pub(crate) trait NewtonEquations {
    /// Scaled residuals, and their derivatives with respect to the unknowns.
    fn evaluate(&mut self, x: &DVector<f64>) -> Result<(DVector<f64>, DMatrix<f64>), Error>;
}

#[derive(Debug, Clone)]
pub(crate) struct NewtonSolution {
    pub x: DVector<f64>,
    pub jacobian: DMatrix<f64>,
    /// Length of the last step, an error bound.
    pub error: f64,
    pub iterations: usize,
}

const MOST_ITERATIONS: usize = 25;

const MOST_HALVINGS: usize = 15;

/// Step below which convergence is quadratic.
const NEAR: f64 = 1e-6;

/// A step below `EXACT` is rounding. A step below `SOLVED` suffices if steps have not shrunk `STUCK` times.
const EXACT: f64 = 1e-14;
const SOLVED: f64 = 1e-9;
const STUCK: u32 = 2;

/// Fraction of the largest singular value below which a direction is neutral and is not corrected.
const NEUTRAL: f64 = 1e-13;

/// Solution with `plane` (x - start) = 0. The plane has one row for each surplus unknown. `period` (s) is that of the start.
pub(crate) fn solve(
    equations: &mut dyn NewtonEquations,
    start: &DVector<f64>,
    plane: &DMatrix<f64>,
    period: f64,
) -> Result<NewtonSolution, Error> {
    let mut x = start.clone();
    let (mut residual, mut jacobian) = equations.evaluate(&x)?;
    let first = residual.amax();
    let diverged = |iterations: usize, residual: &DVector<f64>| {
        let residual = residual.amax();
        let message = format!(
            "Newton's method found no cycle: from a period of {period:.9} s, after {iterations} iterations, the motion misses itself by \
             {residual:.1e} of its size (at the start by {first:.1e}). Start nearer to the cycle: from the end of a longer run \
             (output.end_time), from a state beside it (--from initial), or with --periods for one that repeats after several turns"
        );
        Error::new(ErrorKind::Diverged(residual), message)
    };
    let (mut shortest, mut stuck) = (f64::INFINITY, 0);
    let mut halvings = 0;
    for iterations in 1..=MOST_ITERATIONS {
        let Some(step) = step(&jacobian, &residual, plane, &(&x - start)) else {
            return Err(diverged(iterations, &residual));
        };
        let length = step.amax();
        // Steps that no longer shrink are rounding.
        stuck = if length > 0.5 * shortest { stuck + 1 } else { 0 };
        shortest = shortest.min(length);
        if length <= EXACT || length <= SOLVED && stuck >= STUCK {
            return Ok(NewtonSolution {
                x: &x + &step,
                jacobian,
                error: length,
                iterations,
            });
        }
        let mut share = 1.0;
        loop {
            let next = &x + &step * share;
            match equations.evaluate(&next) {
                Ok((found, slopes)) if length < NEAR || found.amax() < (1.0 - 1e-3 * share) * residual.amax() => {
                    (x, residual, jacobian) = (next, found, slopes);
                    break;
                }
                Err(error) if error.is_interrupted() => return Err(error),
                _ if halvings >= MOST_HALVINGS => return Err(diverged(iterations, &residual)),
                _ => {
                    share /= 2.0;
                    halvings += 1;
                }
            }
        }
    }
    Err(diverged(MOST_ITERATIONS, &residual))
}

fn step(
    jacobian: &DMatrix<f64>,
    residual: &DVector<f64>,
    plane: &DMatrix<f64>,
    moved: &DVector<f64>,
) -> Option<DVector<f64>> {
    let (rows, more) = (jacobian.nrows(), plane.nrows());
    let mut matrix = DMatrix::zeros(rows + more, jacobian.ncols());
    matrix.rows_mut(0, rows).copy_from(jacobian);
    matrix.rows_mut(rows, more).copy_from(plane);
    let mut right = DVector::zeros(rows + more);
    right.rows_mut(0, rows).copy_from(&-residual);
    right.rows_mut(rows, more).copy_from(&-(plane * moved));
    if !matrix.iter().chain(right.iter()).all(|x| x.is_finite()) {
        return None;
    }
    let svd = matrix.svd(true, true);
    let largest = svd.singular_values.max();
    svd.solve(&right, NEUTRAL * largest).ok()
}

/// Unit direction along which equations with one surplus unknown stay solved, on the side of `before`.
pub(crate) fn tangent(jacobian: &DMatrix<f64>, before: &DVector<f64>) -> Option<DVector<f64>> {
    if !jacobian.iter().all(|x| x.is_finite()) {
        return None;
    }
    // Only a square matrix gives a whole basis.
    let columns = jacobian.ncols();
    let mut square = DMatrix::zeros(columns, columns);
    square.rows_mut(0, jacobian.nrows()).copy_from(jacobian);
    let svd = square.svd(false, true);
    let (index, _) = svd.singular_values.argmin();
    let direction = svd.v_t?.row(index).transpose();
    Some(if direction.dot(before) < 0.0 {
        -direction
    } else {
        direction
    })
}
