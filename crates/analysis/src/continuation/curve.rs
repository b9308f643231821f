//! Curves of special points in two parameters.

use super::manifold::Measured;
use super::special::{Special, critical_pair, row, unit};
use crate::cycle::{
    Border, Guess, Local, Manifold, NewtonEquations, NewtonSolution, no_steady_sliding, solve, tangent,
};
use crate::error::{Error, attempt};
use nalgebra::{DMatrix, DVector};

/// Step in scaled unknowns for the derivatives of the condition.
const MOVE: f64 = 2e-7;

/// Relative distance at which borders are followed, and its multiples for extrapolation to zero.
pub(super) const DISTANCE: f64 = 6e-5;
const SHARES: [f64; 4] = [2.0, 1.0, 0.5, 0.25];
/// The smallest multiples may be too near the border for derivatives.
const LEAST_SHARES: usize = 3;

/// Fraction of these distances for a graze, near which a motion changes with the root of the distance.
const NEARER: f64 = 1.0 / 16.0;

/// Weights of polynomial extrapolation to zero from the first distances, or from their roots.
fn weights(border: Border, count: usize) -> Vec<f64> {
    let nodes = if border.grazes() { SHARES.map(f64::sqrt) } else { SHARES };
    let nodes = &nodes[..count];
    let weight = |own: &f64| {
        let others = nodes.iter().filter(|other| *other != own);
        others.map(|other| other / (other - own)).product()
    };
    nodes.iter().map(weight).collect()
}

/// As on a branch: ratio of shortest to longest step, and least cosine of successive directions.
const SHORTEST: f64 = 1e-5;
const LEAST_COSINE: f64 = 0.9;

/// Point of a curve.
#[derive(Debug, Clone, PartialEq)]
pub struct CurvePoint {
    /// Values of the two parameters, SI.
    pub values: [f64; 2],
    /// Period of the cycle, s; at a Hopf point, period of the emerging cycles.
    pub period: f64,
}

struct Conditioned<'a> {
    local: Local<'a>,
    manifold: Manifold<'a>,
    special: Special,
    level: f64,
    /// Bordering vectors of the matrix that is singular at a fold or flip.
    border: Option<(DVector<f64>, DVector<f64>)>,
}

fn null_vectors(matrix: &DMatrix<f64>) -> Option<(DVector<f64>, DVector<f64>)> {
    let svd = matrix.clone().svd(true, true);
    let (index, _) = svd.singular_values.argmin();
    Some((svd.u?.column(index).into_owned(), svd.v_t?.row(index).transpose()))
}

impl Conditioned<'_> {
    fn singular(&self, jacobian: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let rows = jacobian.nrows();
        match self.special {
            Special::Fold => Some(jacobian.columns(0, rows).into_owned()),
            Special::Flip => {
                let shot = self.local.last.as_ref()?;
                let (scale, n) = (self.local.scale(), shot.end.len());
                Some(DMatrix::from_fn(n, n, |i, j| {
                    shot.by_state[(i, j)] * scale[j] / scale[i] + f64::from(i == j)
                }))
            }
            _ => None,
        }
    }

    /// The equations must have just been evaluated at this point.
    fn condition(&mut self, x: &DVector<f64>, jacobian: &DMatrix<f64>) -> Result<f64, Error> {
        if let Some(matrix) = self.singular(jacobian) {
            let n = matrix.nrows();
            if self.border.is_none() {
                self.border = null_vectors(&matrix);
            }
            let (left, right) = self.border.as_ref().ok_or_else(no_steady_sliding)?;
            let mut bordered = DMatrix::zeros(n + 1, n + 1);
            bordered.view_mut((0, 0), (n, n)).copy_from(&matrix);
            bordered.view_mut((0, n), (n, 1)).copy_from(left);
            bordered.view_mut((n, 0), (1, n)).copy_from(&right.transpose());
            let solved = bordered.lu().solve(&unit(n + 1, n)).ok_or_else(no_steady_sliding)?;
            return Ok(solved[n]);
        }
        let measured = self.manifold.measure(&self.local.guess(x)?)?;
        Ok(value(self.special, &measured).unwrap_or(f64::NAN) - self.level)
    }
}

/// Zero at a special point that has no singular matrix.
fn value(special: Special, measured: &Measured) -> Option<f64> {
    match special {
        Special::Hopf => {
            let fastest = measured.spectrum.iter().map(|one| one.norm()).fold(0.0, f64::max);
            critical_pair(special, &measured.spectrum).map(|pair| pair.re / fastest)
        }
        Special::Torus => critical_pair(special, &measured.spectrum).map(|pair| pair.norm() - 1.0),
        Special::Border(border) => nearest(measured, border),
        _ => None,
    }
}

fn nearest(measured: &Measured, border: Border) -> Option<f64> {
    let margins = measured.orbit.margins.iter().filter(|margin| margin.border == border);
    margins.map(|margin| margin.distance).min_by(f64::total_cmp)
}

impl NewtonEquations for Conditioned<'_> {
    fn evaluate(&mut self, x: &DVector<f64>) -> Result<(DVector<f64>, DMatrix<f64>), Error> {
        let (residual, jacobian) = self.local.evaluate(x)?;
        let own = self.condition(x, &jacobian)?;
        let (rows, columns) = jacobian.shape();
        let mut all = DVector::zeros(rows + 1);
        all.rows_mut(0, rows).copy_from(&residual);
        all[rows] = own;
        let mut slopes = DMatrix::zeros(rows + 1, columns);
        slopes.rows_mut(0, rows).copy_from(&jacobian);
        for column in 0..columns {
            let mut side = |sign: f64| -> Result<f64, Error> {
                let mut moved = x.clone();
                moved[column] += sign * MOVE;
                let (_, jacobian) = self.local.evaluate(&moved)?;
                self.condition(&moved, &jacobian)
            };
            slopes[(rows, column)] = (side(1.0)? - side(-1.0)?) / (2.0 * MOVE);
        }
        match all.iter().chain(slopes.iter()).all(|x| x.is_finite()) {
            true => Ok((all, slopes)),
            false => Err(no_steady_sliding()),
        }
    }
}

/// Border near a solution, extrapolated from its regular side; `None` if not found.
pub(crate) fn border_point(
    manifold: Manifold<'_>,
    border: Border,
    near: &Guess,
    held: Option<usize>,
) -> Result<Option<(Guess, Measured)>, Error> {
    let special = Special::Border(border);
    let mut found: Vec<Guess> = Vec::new();
    for share in SHARES {
        let last = found.last().unwrap_or(near);
        let Some(mut equations) = attempt(at(manifold, special, last, share * level(special)))? else {
            break;
        };
        let x = equations.local.unknowns(last);
        // There are as many equations as unknowns, except for a fixed parameter.
        let numbers = manifold.widths.len();
        let plane = match held {
            Some(number) => row(&unit(x.len(), x.len() - numbers + number)),
            None => DMatrix::zeros(0, x.len()),
        };
        let Some(solution) = attempt(solve(&mut equations, &x, &plane, last.period))? else {
            break;
        };
        found.push(equations.local.guess(&solution.x)?);
    }
    if found.len() < LEAST_SHARES {
        return Ok(None);
    }
    let weights = weights(border, found.len());
    let line = |of: &dyn Fn(&Guess) -> f64| -> f64 {
        let pairs = found.iter().zip(&weights);
        pairs.map(|(guess, weight)| weight * of(guess)).sum()
    };
    let nearest = &found[found.len() - 1];
    let guess = Guess {
        time: nearest.time,
        // State on the side where a distance exists, so that a curve can start from it.
        state: nearest.state.clone(),
        period: line(&|guess| guess.period),
        values: (0..nearest.values.len())
            .map(|k| line(&|guess| guess.values[k]))
            .collect(),
    };
    Ok(Some((guess, manifold.measure(nearest)?)))
}

pub(crate) struct CurveSteps {
    pub ranges: [(f64, f64); 2],
    pub longest: f64,
    pub most: usize,
}

/// Curve through a special point, traced to both ends. `manifold` has two parameters.
pub(crate) fn trace(
    manifold: Manifold<'_>,
    special: Special,
    start: &Guess,
    steps: &CurveSteps,
) -> Result<Vec<CurvePoint>, Error> {
    let forth = one_way(manifold, special, start, steps, 1.0)?;
    let back = one_way(manifold, special, start, steps, -1.0)?;
    let mut all: Vec<CurvePoint> = back.into_iter().skip(1).rev().collect();
    all.extend(forth);
    Ok(all)
}

fn at<'a>(manifold: Manifold<'a>, special: Special, guess: &Guess, level: f64) -> Result<Conditioned<'a>, Error> {
    Ok(Conditioned {
        local: manifold.local(guess)?,
        manifold,
        special,
        level,
        border: None,
    })
}

fn level(special: Special) -> f64 {
    match special {
        Special::Border(border) if border.grazes() => NEARER * DISTANCE,
        Special::Border(_) => DISTANCE,
        _ => 0.0,
    }
}

/// Solution on the plane through `x`; `guess` is the start of the equations.
fn solved(
    equations: &mut Conditioned<'_>,
    x: &DVector<f64>,
    plane: &DVector<f64>,
    guess: &Guess,
) -> Result<Option<NewtonSolution>, Error> {
    attempt(solve(equations, x, &row(plane), guess.period))
}

fn point(manifold: Manifold<'_>, special: Special, guess: &Guess, held: usize) -> Result<CurvePoint, Error> {
    let measured = manifold.measure(guess)?;
    let period = match special {
        Special::Hopf => {
            critical_pair(special, &measured.spectrum).map_or(f64::NAN, |pair| std::f64::consts::TAU / pair.im)
        }
        _ => guess.period,
    };
    let mut found = CurvePoint {
        values: [guess.values[0], guess.values[1]],
        period,
    };
    // Lies at the border itself, with one parameter fixed.
    if let Special::Border(border) = special
        && let Some((edge, _)) = border_point(manifold, border, guess, Some(held))?
    {
        found.values = [edge.values[0], edge.values[1]];
        found.period = edge.period;
    }
    Ok(found)
}

/// A solution with the tangent of the curve there, on the side of `along`.
fn with_tangent(found: Option<NewtonSolution>, along: &DVector<f64>) -> Option<(DVector<f64>, DVector<f64>)> {
    let NewtonSolution { x, jacobian, .. } = found?;
    Some((x, tangent(&jacobian, along)?))
}

fn one_way(
    manifold: Manifold<'_>,
    special: Special,
    start: &Guess,
    steps: &CurveSteps,
    sign: f64,
) -> Result<Vec<CurvePoint>, Error> {
    let mut equations = at(manifold, special, start, level(special))?;
    let x = equations.local.unknowns(start);
    let held = unit(x.len(), x.len() - 1);
    let found = solved(&mut equations, &x, &held, start)?;
    let Some((found, mut direction)) = with_tangent(found, &(held * sign)) else {
        return Ok(Vec::new());
    };
    let mut guess = equations.local.guess(&found)?;
    direction = direction.component_mul(equations.local.scale());
    let mut points = vec![point(manifold, special, &guess, 1)?];
    let mut step = 0.2 * steps.longest;
    while points.len() < steps.most {
        let mut equations = at(manifold, special, &guess, level(special))?;
        let x = equations.local.unknowns(&guess);
        let along = direction.component_div(equations.local.scale()).normalize();
        let found = solved(&mut equations, &(&x + &along * step), &along, &guess)?;
        let found = with_tangent(found, &along);
        let near = found.filter(|(next, turned)| turned.dot(&along) > LEAST_COSINE && (next - &x).norm() < 2.0 * step);
        let Some((next, turned)) = near else {
            step /= 2.0;
            if step < SHORTEST * steps.longest {
                break;
            }
            continue;
        };
        if turned.dot(&along) > 0.99 {
            step = (1.5 * step).min(steps.longest);
        }
        let reached = equations.local.guess(&next)?;
        let outside = |k: usize| {
            let (low, high) = steps.ranges[k];
            let value = reached.values[k];
            (!(low..=high).contains(&value)).then_some((k, if value < low { low } else { high }))
        };
        if let Some((k, bound)) = outside(0).or(outside(1)) {
            let index = x.len() - 2 + k;
            let (from, to) = (guess.values[k], reached.values[k]);
            let mut last = &x + (&next - &x) * ((bound - from) / (to - from));
            last[index] = bound / equations.local.scale()[index];
            if let Some(last) = solved(&mut equations, &last, &unit(x.len(), index), &guess)? {
                points.push(point(manifold, special, &equations.local.guess(&last.x)?, k)?);
            }
            break;
        }
        points.push(point(manifold, special, &reached, 1)?);
        direction = turned.component_mul(equations.local.scale());
        let measured = manifold.measure(&reached)?;
        (guess, direction) = match manifold.away_from_events(&measured, &direction)? {
            Some((measured, direction)) => (measured.guess, direction),
            None => (reached, direction),
        };
    }
    Ok(points)
}
