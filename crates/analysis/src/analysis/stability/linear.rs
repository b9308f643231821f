//! The linearised equations of two trains as matrices, and their eigenvalues.
//!
//! Mechanical impedance of two trains at their contact, and the negative contact damping that they tolerate.
//!
//! With T = kappa omega_r about steady sliding (kappa = r F_n dmu/dx for a friction law) the motion exp(s t) exists
//! where Z(s) + kappa = 0, 1/Z = 1/Z_rotor + 1/Z_stator. The impedance of a train follows from its far end inwards:
//!
//! ```text
//! Z_i = s J_i + d_i + (outer side of inertia i),   outer side = shaft and Z_(i+1) in series,   shaft = c + k/s.
//! ```
//!
//! Stability changes at s = i omega: at the zeros of Im Z(i omega), where kappa = -Re Z. No matrix is involved, so for
//! one grounded inertia the result is its damping to the last digit. When kappa falls through -Re Z, a pair of
//! eigenvalues moves right if Im Z rises with omega, and left if it falls. Without contact the trains are passive: for
//! kappa >= 0 nothing grows.

use super::modes::{ShapeComponent, SystemMode};
use nalgebra::{Complex, DMatrix, DVector};
use serde::Serialize;
use std::f64::consts::TAU;
use stickslip_system::friction::Law;
use stickslip_system::model::equations::{Driving, Engagement, Outside, Side, SystemEquations};
use stickslip_system::model::{Axial, Mode};
use stickslip_system::numerics::bisection::bisect;
use stickslip_system::numerics::eigenvalues::{eigenvalues, null_vector};

/// Fraction of the largest eigenvalue below which eigenvalues and real parts are rounding.
pub(super) const ROUNDING: f64 = 1e-12;
/// Fraction of an eigenvalue below which its imaginary part comes from two equal real roots, rounded.
const DOUBLE: f64 = 1e-7;

/// Steady sliding at omega_r = `w` under F_n: bristles are deflected, everything else is at rest.
pub(super) fn state(system: &SystemEquations, w: f64, force: f64) -> (Outside, Vec<f64>) {
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
        y[at] = w.signum() * system.law_in(w, system.piece_of(w)).coefficient(w.abs()) / stiffness;
    }
    (outside, y)
}

/// Jacobian of the mechanical states, without quadratures.
pub(super) fn jacobian(system: &SystemEquations, mode: Mode, sense: f64, outside: &Outside, y: &[f64]) -> DMatrix<f64> {
    let mut whole = DMatrix::zeros(system.dimension, system.dimension);
    let w = system.relative_velocity(outside, y);
    let piece = system.piece_of(w);
    system.jacobian(mode, sense, piece, outside, y, &mut whole.as_view_mut());
    // Bristles do not move without contact.
    let rows = match (system.engagement, mode) {
        (Engagement::Bristles(.., at), Mode::Separated) => at,
        _ => system.mechanical(),
    };
    whole.view((0, 0), (rows, rows)).into_owned()
}

/// Rates per unit of interface torque, and coefficients of omega_r.
pub(super) fn columns(system: &SystemEquations) -> (DVector<f64>, DVector<f64>) {
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

/// Basis of motion in stick: omega_r = 0, and fixed surfaces if both trains are held.
pub(super) fn stuck(system: &SystemEquations) -> DMatrix<f64> {
    let (_, g) = columns(system);
    let n = g.len();
    let mut held = vec![DVector::from_fn(n, |k, _| g[k] / system.weight(k))];
    if system.rotor.speed.is_none() && system.stator.speed.is_none() {
        let offset = |k: usize| {
            if k + 1 < n && k.is_multiple_of(2) {
                g[k + 1] / system.weight(k)
            } else {
                0.0
            }
        };
        held.push(DVector::from_fn(n, |k, _| offset(k)));
    }
    // Completes an orthonormal basis that begins with the held directions.
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

type ModeShape = (String, Vec<ShapeComponent>, Option<String>);

/// Modes of the eigenvalues with Im >= 0, the fastest first. `describe` gives name, shape and mover by the right eigenvector.
fn eigenmodes(matrix: &DMatrix<f64>, describe: impl Fn(DVector<Complex<f64>>) -> ModeShape) -> Vec<SystemMode> {
    if matrix.nrows() == 0 {
        return Vec::new();
    }
    let found = eigenvalues(matrix);
    let largest = found.iter().map(|l| l.norm()).fold(0.0, f64::max);
    let real = |l: &Complex<f64>| l.im.abs() <= DOUBLE * l.norm();
    let mut kept: Vec<Complex<f64>> = found.into_iter().filter(|l| real(l) || l.im > 0.0).collect();
    kept.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
    let mode = |lambda: Complex<f64>| {
        let magnitude = lambda.norm();
        let still = magnitude <= ROUNDING * largest;
        let vector = null_vector(matrix, lambda).unwrap_or_else(|| DVector::zeros(matrix.nrows()));
        let (name, shape, moves) = describe(vector);
        let growth_rate = match still || lambda.re.abs() <= ROUNDING * largest {
            true => 0.0,
            false => lambda.re,
        };
        let oscillates = !(real(&lambda) || still);
        let frequency = oscillates.then(|| magnitude / TAU);
        // Adding zero drops the sign of -0.
        let decay = -growth_rate + 0.0;
        SystemMode {
            name,
            growth_rate,
            angular_frequency: if oscillates { lambda.im } else { 0.0 },
            natural_frequency: frequency,
            frequency,
            damping_ratio: oscillates.then(|| decay / magnitude),
            decay,
            moves,
            shape,
        }
    };
    kept.into_iter().map(mode).collect()
}

/// Modes of the axial oscillator (1), m z'' + c_a z' + k_e z = 0.
pub(super) fn axial_modes(axial: &Axial) -> Vec<SystemMode> {
    let omega = (axial.stiffness / axial.mass).sqrt();
    let matrix = DMatrix::from_row_slice(2, 2, &[0.0, omega, -omega, -axial.damping / axial.mass]);
    let shape = ShapeComponent {
        coordinate: "z".to_owned(),
        amplitude: 1.0,
        phase: 0.0,
    };
    eigenmodes(&matrix, |_| ("axial".to_owned(), vec![shape.clone()], None))
}

pub(super) fn modes_of(
    system: &SystemEquations,
    matrix: DMatrix<f64>,
    stuck: Option<&DMatrix<f64>>,
) -> Vec<SystemMode> {
    let whole = system.balanced(matrix);
    let inner = match stuck {
        Some(basis) => basis.transpose() * &whole * basis,
        None => whole,
    };
    eigenmodes(&inner, |vector| {
        let moved = match stuck {
            Some(basis) => basis.map(Complex::from) * vector,
            None => vector,
        };
        let bodies = bodies(system, moved.as_slice(), stuck.is_some());
        let largest = largest(bodies.iter().map(|body| body.velocity));
        let shape = bodies.iter().map(|body| {
            let relative = if largest.norm() > 0.0 {
                body.velocity / largest
            } else {
                body.velocity
            };
            ShapeComponent {
                coordinate: body.coordinate.clone(),
                amplitude: relative.norm(),
                phase: relative.arg(),
            }
        });
        (name(&bodies, stuck.is_some()), shape.collect(), mover(&bodies))
    })
}

fn largest(numbers: impl Iterator<Item = Complex<f64>>) -> Complex<f64> {
    numbers.fold(Complex::new(0.0, 0.0), |best, c| {
        if c.norm() > best.norm() * (1.0 + 1e-9) { c } else { best }
    })
}

struct LinearBody {
    /// "rotor" or "stator".
    side: &'static str,
    count: usize,
    /// Index in the train; 0 is the surface.
    index: usize,
    inertia: f64,
    velocity: Complex<f64>,
    /// File column of the angle, or of the speed if there is no angle.
    coordinate: String,
}

impl LinearBody {
    fn is_surface(&self) -> bool {
        self.index == 0
    }
}

fn bodies(system: &SystemEquations, moved: &[Complex<f64>], joined: bool) -> Vec<LinearBody> {
    let part = |of: fn(&Complex<f64>) -> f64| -> Vec<f64> {
        let mut y = vec![0.0; system.dimension];
        for (k, value) in moved.iter().enumerate() {
            y[k] = of(value) / system.weight(k);
        }
        y
    };
    let (re, im) = (part(|c| c.re), part(|c| c.im));
    let still = Driving::default();
    let of_side = |name: &'static str, side: &Side| -> Vec<LinearBody> {
        let speeds = side.speeds(&still, &re).into_iter().zip(side.speeds(&still, &im));
        let count = side.inertia.len();
        let body = |(index, ((re, im), inertia)): (usize, ((f64, f64), &f64))| LinearBody {
            side: name,
            count,
            index,
            inertia: *inertia,
            velocity: Complex::new(re, im),
            coordinate: match (name, index) {
                ("rotor", 0) => "phi2".to_owned(),
                ("stator", 0) => "phi1".to_owned(),
                ("rotor", outermost) if outermost + 1 == count => "theta".to_owned(),
                _ => format!("{name}_speed_{index}"),
            },
        };
        speeds.zip(&side.inertia).enumerate().map(body).collect()
    };
    let mut all = of_side("rotor", &system.rotor);
    let surface = all.first().map(|body| body.velocity);
    all.reverse();
    all.extend(of_side("stator", &system.stator));
    if let (true, Some(surface)) = (joined, surface) {
        // The mode makes them equal; their sums were rounded.
        let surfaces = all.iter_mut().filter(|body| body.is_surface());
        surfaces.for_each(|body| body.velocity = surface);
    }
    all
}

/// Name of the largest motion: an inertia, one surface, or both together or against each other.
fn name(bodies: &[LinearBody], joined: bool) -> String {
    let outer = bodies.iter().filter(|body| !body.is_surface());
    let outer = outer.reduce(|best, body| {
        if body.velocity.norm() > best.velocity.norm() {
            body
        } else {
            best
        }
    });
    let surface = |side: &str| bodies.iter().find(|body| body.is_surface() && body.side == side);
    let (rotor, stator) = (surface("rotor"), surface("stator"));
    let of = |body: Option<&LinearBody>| body.map_or(Complex::from(0.0), |body| body.velocity);
    let (phi2, phi1) = (of(rotor), of(stator));
    let most = phi2.norm().max(phi1.norm());
    // The rotor carries its own surface along. In that mode the rotor is the largest part.
    let share = if joined { 1.0 } else { 0.9 };
    if let Some(outer) = outer.filter(|outer| outer.velocity.norm() > share * most) {
        return match outer.count {
            2 => outer.side.to_owned(),
            _ => format!("{} {}", outer.side, outer.index),
        };
    }
    let name = match (rotor, stator) {
        _ if most == 0.0 => "bristles",
        (Some(_), Some(_)) if joined => "surfaces",
        _ if phi2.norm() < 0.5 * phi1.norm() => "stator surface",
        _ if phi1.norm() < 0.5 * phi2.norm() => "rotor surface",
        _ if (phi2 - phi1).norm() >= (phi2 + phi1).norm() => "relative",
        _ => "common",
    };
    name.to_owned()
}

fn mover(bodies: &[LinearBody]) -> Option<String> {
    let of_side = |side: &'static str| {
        let mut found: Vec<&LinearBody> = bodies.iter().filter(|body| body.side == side).collect();
        found.sort_by_key(|body| body.index);
        found.into_iter()
    };
    let energies = of_side("rotor").chain(of_side("stator"));
    let energies = energies.map(|body| (body.inertia * body.velocity.norm_sqr(), body));
    // The first of equal energies, up to rounding.
    let most = energies.reduce(|best, next| if next.0 > best.0 * (1.0 + 1e-9) { next } else { best });
    most.filter(|(energy, _)| *energy > 0.0)
        .map(|(_, body)| format!("{} {}", body.side, body.index))
}

pub(super) fn crossings(system: &SystemEquations, creeps: bool) -> ImpedanceCrossings {
    let rest = Outside::default();
    let y = vec![0.0; system.dimension];
    let mut natural = Vec::new();
    for mode in [Mode::Separated, Mode::Stick] {
        let matrix = jacobian(system, mode, 1.0, &rest, &y);
        let found = eigenvalues(&system.balanced(matrix));
        let largest = found.iter().map(|l| l.norm()).fold(0.0, f64::max);
        for lambda in found {
            let frequencies = [lambda.norm(), lambda.im.abs()];
            natural.extend(frequencies.into_iter().filter(|&w| w > 1e-7 * largest));
        }
    }
    ImpedanceCrossings::new(&system.rotor, &system.stator, &natural, creeps)
}

/// Zeros are sought from the smallest natural frequency divided by this factor to the largest one multiplied by it.
const BEYOND: f64 = 1e4;
const POINTS: usize = 1200;
/// Around each natural frequency w, points lie at w (1 +- 10^(-k/4)), with k up to this number.
const NEAR: i32 = 40;
const CROSSING_ROUNDING: f64 = 1e-14;

/// Stability of steady sliding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SlidingVerdict {
    /// A small disturbance decays.
    Stable,
    /// A small disturbance neither grows nor decays, to first order.
    Neutral,
    /// A small disturbance grows.
    Unstable,
}

impl SlidingVerdict {
    /// Whether a small disturbance grows.
    pub fn is_unstable(self) -> bool {
        self == SlidingVerdict::Unstable
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ImpedanceCrossing {
    /// -kappa, N m s/rad, at least 0.
    pub resistance: f64,
    /// Angular frequency of the neutral motion, rad/s; 0 without oscillation.
    pub angular_frequency: f64,
    /// Increase of the number of growing motions as the damping falls.
    change: i32,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct ImpedanceCrossings(pub Vec<ImpedanceCrossing>);

fn in_series(a: Complex<f64>, b: Complex<f64>) -> Complex<f64> {
    a * b / (a + b)
}

/// `None` for a prescribed surface.
fn of_train(side: &Side, omega: f64) -> Option<Complex<f64>> {
    let shaft = |i: usize| Complex::new(side.damping[i], -side.stiffness[i] / omega);
    let inertia = |i: usize| Complex::new(side.viscous[i], omega * side.inertia[i]);
    let last = side.inertia.len().checked_sub(1)?;
    let mut z = inertia(last);
    if side.shafts() > last {
        z += shaft(last);
    }
    for i in (0..last).rev() {
        z = inertia(i) + in_series(shaft(i), z);
    }
    Some(z)
}

fn of_both(rotor: &Side, stator: &Side, omega: f64) -> Complex<f64> {
    match (of_train(rotor, omega), of_train(stator, omega)) {
        (Some(rotor), Some(stator)) => in_series(rotor, stator),
        (Some(one), None) | (None, Some(one)) => one,
        (None, None) => Complex::new(f64::NAN, f64::NAN),
    }
}

/// Damping against a steady difference of the surface speeds; `None` if a train cannot turn steadily.
fn steady(rotor: &Side, stator: &Side) -> Option<f64> {
    let ground = |side: &Side| side.speed.map(|_| side.viscous.iter().sum::<f64>());
    match (ground(rotor), ground(stator)) {
        (Some(a), Some(b)) if a > 0.0 && b > 0.0 => Some(a * b / (a + b)),
        (Some(_), Some(_)) => Some(0.0),
        (Some(one), None) | (None, Some(one)) => Some(one),
        (None, None) => None,
    }
}

impl ImpedanceCrossings {
    /// Crossings near and beyond the natural frequencies (rad/s). `creeps`: whether a steady difference of the surface
    /// speeds counts as growing, at omega = 0. In a train without drive, that motion is the sliding itself.
    pub(super) fn new(rotor: &Side, stator: &Side, natural: &[f64], creeps: bool) -> ImpedanceCrossings {
        let moving = || natural.iter().copied().filter(|&w| w > 0.0 && w.is_finite());
        let (least, most) = (moving().fold(f64::INFINITY, f64::min), moving().fold(0.0, f64::max));
        let (least, most) = if most > 0.0 { (least, most) } else { (1.0, 1.0) };
        let (from, to) = (least / BEYOND, most * BEYOND);
        let mut grid: Vec<f64> = (0..=POINTS)
            .map(|k| from * (to / from).powf(k as f64 / POINTS as f64))
            .collect();
        for omega in moving() {
            let near = (0..=NEAR).map(|k| 10f64.powf(-f64::from(k) / 4.0));
            grid.extend(near.flat_map(|share| [omega * (1.0 - share), omega * (1.0 + share)]));
        }
        grid.retain(|&omega| omega >= from);
        grid.sort_by(f64::total_cmp);
        grid.dedup();
        let impedance = |omega: f64| of_both(rotor, stator, omega);
        let mut found = Vec::new();
        let reactance: Vec<(f64, f64)> = grid.iter().map(|&omega| (omega, impedance(omega).im)).collect();
        let of_creep = steady(rotor, stator).filter(|_| creeps);
        if let (Some(resistance), Some(first)) = (of_creep, reactance.first()) {
            found.push(ImpedanceCrossing {
                resistance,
                angular_frequency: 0.0,
                change: if first.1 >= 0.0 { 1 } else { -1 },
            });
        }
        for pair in reactance.windows(2) {
            let (below, above) = (pair[0], pair[1]);
            let rises = above.1 > below.1;
            if !(below.1.is_finite() && above.1.is_finite()) || (below.1 < 0.0) == (above.1 < 0.0) {
                continue;
            }
            let size = below.1.abs().max(above.1.abs());
            let like_below = |omega: f64| (impedance(omega).im < 0.0) == (below.1 < 0.0);
            let ends = bisect(below.0, above.0, usize::MAX, like_below);
            let [first, second] = [ends.0, ends.1].map(|omega| (omega, impedance(omega)));
            // At an undamped resonance the reactance jumps; no resistance is left to cross.
            let nearest = if first.1.im.abs() <= second.1.im.abs() {
                first
            } else {
                second
            };
            if nearest.1.im.abs() <= size {
                found.push(ImpedanceCrossing {
                    resistance: nearest.1.re.max(0.0),
                    angular_frequency: nearest.0,
                    change: if rises { 2 } else { -2 },
                });
            }
        }
        found.retain(|crossing| crossing.resistance.is_finite());
        found.sort_by(|a, b| a.resistance.total_cmp(&b.resistance));
        ImpedanceCrossings(found)
    }

    pub(super) fn verdict(&self, kappa: f64) -> SlidingVerdict {
        let lost = -kappa;
        let near = |crossing: &ImpedanceCrossing| {
            (crossing.resistance - lost).abs() <= CROSSING_ROUNDING * crossing.resistance.max(lost)
        };
        let growing: i32 = self
            .0
            .iter()
            .filter(|crossing| crossing.resistance < lost && !near(crossing))
            .map(|crossing| crossing.change)
            .sum();
        match growing {
            1.. => SlidingVerdict::Unstable,
            _ if self.0.iter().any(near) => SlidingVerdict::Neutral,
            _ => SlidingVerdict::Stable,
        }
    }

    /// Angular frequency of the neutral motion with the contact damping nearest to `kappa`, rad/s.
    pub(super) fn frequency(&self, kappa: f64) -> Option<f64> {
        let away = |crossing: &&ImpedanceCrossing| (crossing.resistance + kappa).abs();
        let nearest = self.0.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
        nearest.map(|crossing| crossing.angular_frequency)
    }
}
