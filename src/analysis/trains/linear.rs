//! The equations of two trains about a state, as matrices, and their eigenvalues.

use super::impedance::Crossings;
use super::modes_report::TrainMode;
use crate::analysis::modes::eigenvector;
use crate::friction::Law;
use crate::model::Mode;
use crate::model::trains::system::{Driving, Engagement, Outside, Side, TrainSystem};
use crate::numerics::eigenvalues::eigenvalues;
use nalgebra::{Complex, DMatrix, DVector};
use std::f64::consts::TAU;

/// Eigenvalues and real parts below this share of the largest eigenvalue are rounding.
pub(super) const ROUNDING: f64 = 1e-12;
/// An imaginary part below this share of its eigenvalue is what rounding makes of two equal real ones.
const DOUBLE: f64 = 1e-7;

/// Sliding at omega_r = `w` with nothing else in motion, bristles deflected as in steady sliding, under F_n.
pub(super) fn state(system: &TrainSystem, w: f64, force: f64) -> (Outside, Vec<f64>) {
    let mut y = vec![0.0; system.dimension];
    let mut outside = Outside {
        normal_force: force,
        ..Outside::default()
    };
    match system.rotor.speed {
        Some(index) => y[index] = w,
        None => outside.rotor.speed = w,
    }
    if let Engagement::Bristles(stiffness, .., at) = system.engagement
        && w != 0.0
    {
        y[at] = w.signum() * system.law_in(system.piece_of(w)).coefficient(w.abs()) / stiffness;
    }
    (outside, y)
}

/// Of what the motion depends on.
pub(super) fn jacobian(system: &TrainSystem, mode: Mode, sense: f64, outside: &Outside, y: &[f64]) -> DMatrix<f64> {
    let mut whole = DMatrix::zeros(system.dimension, system.dimension);
    let w = system.relative_velocity(outside, y);
    let piece = system.piece_of(w);
    system.jacobian(mode, sense, piece, outside, y, &mut whole.as_view_mut());
    // Without contact bristles stand still.
    let rows = match (system.engagement, mode) {
        (Engagement::Bristles(.., at), Mode::Separated) => at,
        _ => system.mechanical(),
    };
    whole.view((0, 0), (rows, rows)).into_owned()
}

/// The rates per unit of interface torque, and what omega_r is made of.
pub(super) fn columns(system: &TrainSystem) -> (DVector<f64>, DVector<f64>) {
    let (n, nothing) = (system.mechanical(), Outside::default());
    let mut unit = vec![0.0; system.dimension];
    let g = DVector::from_fn(n, |k, _| {
        unit.fill(0.0);
        unit[k] = 1.0;
        system.relative_velocity(&nothing, &unit)
    });
    let b = DVector::from_iterator(n, system.interface_rates().iter().copied().take(n));
    (b, g)
}

/// The size of the rate of each state over its own, 1/s: of a twist the frequency of its shaft, else 1.
fn weights(system: &TrainSystem) -> Vec<f64> {
    let mut weights = vec![1.0; system.mechanical()];
    for side in [&system.rotor, &system.stator] {
        for i in 0..side.shafts() {
            let inertia = |k: usize| side.inertia.get(k).map_or(0.0, |j| 1.0 / j);
            let frequency = (side.stiffness[i] * (inertia(i) + inertia(i + 1))).sqrt();
            if frequency > 0.0 {
                weights[side.twists + 2 * i] = frequency;
            }
        }
    }
    if let Engagement::Bristles(stiffness, .., at) = system.engagement {
        weights[at] = stiffness;
    }
    weights
}

/// The same matrix with its states scaled to each other's size: the eigenvalues stay, their rounding shrinks.
pub(super) fn scaled(system: &TrainSystem, matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let weights = weights(system);
    DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| {
        matrix[(i, j)] * weights[i] / weights[j]
    })
}

/// Where the motion of stick is: omega_r = 0, and of two trains that are both held, with the surfaces where they stuck.
pub(super) fn stuck(system: &TrainSystem) -> DMatrix<f64> {
    let (_, g) = columns(system);
    let (n, weights) = (g.len(), weights(system));
    let mut held = vec![DVector::from_fn(n, |k, _| g[k] / weights[k])];
    if system.rotor.speed.is_none() && system.stator.speed.is_none() {
        let offset = |k: usize| {
            if k + 1 < n && k.is_multiple_of(2) {
                g[k + 1] / weights[k]
            } else {
                0.0
            }
        };
        held.push(DVector::from_fn(n, |k, _| offset(k)));
    }
    // The rest of an orthonormal basis that begins with what is held.
    let mut basis: Vec<DVector<f64>> = Vec::new();
    let count = held.len();
    let unit = |k: usize| DVector::from_fn(n, |i, _| f64::from(u8::from(i == k)));
    for vector in held.into_iter().chain((0..n).map(unit)) {
        let mut rest = vector.clone();
        for _ in 0..2 {
            for known in &basis {
                rest -= known * known.dot(&rest);
            }
        }
        if rest.norm() > 1e-6 * vector.norm() && basis.len() < n {
            basis.push(rest.normalize());
        }
    }
    let free = &basis[count.min(basis.len())..];
    DMatrix::from_fn(n, free.len(), |i, j| free[j][i])
}

/// The modes of a matrix in scaled coordinates, of which `basis` are the ones that move.
pub(super) fn modes_of(system: &TrainSystem, matrix: &DMatrix<f64>, basis: Option<&DMatrix<f64>>) -> Vec<TrainMode> {
    let whole = scaled(system, matrix);
    let inner = match basis {
        Some(basis) => basis.transpose() * &whole * basis,
        None => whole,
    };
    if inner.nrows() == 0 {
        return Vec::new();
    }
    let found = eigenvalues(&inner);
    let largest = found.iter().map(|l| l.norm()).fold(0.0, f64::max);
    let real = |l: &Complex<f64>| l.im.abs() <= DOUBLE * l.norm();
    let mut kept: Vec<Complex<f64>> = found.into_iter().filter(|l| real(l) || l.im > 0.0).collect();
    kept.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
    let weights = weights(system);
    let describe = |lambda: Complex<f64>| {
        let vector = eigenvector(&inner, lambda);
        let moved: Vec<Complex<f64>> = match basis {
            Some(basis) => (0..basis.nrows())
                .map(|i| (0..vector.len()).map(|j| vector[j] * basis[(i, j)]).sum())
                .collect(),
            None => vector,
        };
        let still = lambda.norm() <= ROUNDING * largest;
        let oscillates = !real(&lambda) && !still;
        let decay = if still || lambda.re.abs() <= ROUNDING * largest {
            0.0
        } else {
            -lambda.re
        };
        TrainMode {
            frequency: oscillates.then(|| lambda.norm() / TAU),
            damping_ratio: oscillates.then(|| if decay == 0.0 { 0.0 } else { decay / lambda.norm() }),
            decay,
            moves: mover(system, &weights, &moved),
        }
    };
    kept.into_iter().map(describe).collect()
}

/// The inertia with the largest kinetic energy, if any moves.
fn mover(system: &TrainSystem, weights: &[f64], moved: &[Complex<f64>]) -> Option<String> {
    let part = |of: fn(&Complex<f64>) -> f64| -> Vec<f64> {
        let mut y = vec![0.0; system.dimension];
        for (k, value) in moved.iter().enumerate() {
            y[k] = of(value) / weights[k];
        }
        y
    };
    let (re, im) = (part(|c| c.re), part(|c| c.im));
    let still = Driving::default();
    let of_side = |name: &str, side: &Side| -> Vec<(f64, String)> {
        let speeds = side.speeds(&still, &re).into_iter().zip(side.speeds(&still, &im));
        let energies = speeds.zip(&side.inertia).map(|((a, b), j)| j * (a * a + b * b));
        energies
            .enumerate()
            .map(|(i, energy)| (energy, format!("{name} {i}")))
            .collect()
    };
    let all = of_side("rotor", &system.rotor)
        .into_iter()
        .chain(of_side("stator", &system.stator));
    // Of equal parts the first, whatever their last digit says.
    let most = all.reduce(|best, next| if next.0 > best.0 * (1.0 + 1e-9) { next } else { best });
    most.filter(|(energy, _)| *energy > 0.0).map(|(_, name)| name)
}

pub(super) fn crossings(system: &TrainSystem) -> Crossings {
    let rest = Outside::default();
    let y = vec![0.0; system.dimension];
    let mut natural = Vec::new();
    for mode in [Mode::Separated, Mode::Stick] {
        let matrix = jacobian(system, mode, 1.0, &rest, &y);
        let found = eigenvalues(&scaled(system, &matrix));
        let largest = found.iter().map(|l| l.norm()).fold(0.0, f64::max);
        for lambda in found {
            let frequencies = [lambda.norm(), lambda.im.abs()];
            natural.extend(frequencies.into_iter().filter(|&w| w > 1e-7 * largest));
        }
    }
    Crossings::new(&system.rotor, &system.stator, &natural)
}
