//! The linear modes of two trains, whether they slide steadily, and where that changes.

use super::impedance::{Crossings, Verdict};
use crate::analysis::eigenvalues::eigenvalues;
use crate::analysis::modes::{axial_modes, eigenvector};
use crate::friction::Law;
use crate::model::Mode;
use crate::model::trains::system::{Driving, Engagement, Outside, Side, TrainSystem};
use crate::model::trains::{End, Pressing, Train, Trains};
use crate::signal::Drive;
use nalgebra::{Complex, DMatrix, DVector};
use serde::Serialize;
use std::f64::consts::TAU;

/// Eigenvalues and real parts below this share of the largest eigenvalue are rounding.
const ROUNDING: f64 = 1e-12;
/// An imaginary part below this share of its eigenvalue is what rounding makes of two equal real ones.
const DOUBLE: f64 = 1e-7;
/// Decades over which relative velocities are searched, and points in each.
const DECADES: i32 = 9;
/// Points of a decade.
const POINTS: i32 = 80;
/// The normal force and the damping are searched from the inverse of this to this, as multiples of the case's own.
const MULTIPLES: f64 = 1e3;

/// Everything that `stickslip modes` says of a case of trains. SI units and radians; in translation metres, newtons and
/// kilograms stand for radians, newton metres and kilogram square metres.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrainModes {
    /// What drives the trains, as numbers.
    pub driving: Vec<Driven>,
    /// Where they slide steadily, the fastest first. Where they cannot, the relative velocity at t = 0.
    pub operating_points: Vec<OperatingPoint>,
    /// Without contact, at rest, and at each of those.
    pub states: Vec<TrainState>,
    /// Relative velocities at which the stability of sliding changes, under F_n.
    pub critical_relative_velocities: Search,
    /// Normal forces at which that of steady sliding changes, N, under the same drives.
    pub critical_normal_forces: Option<Search>,
    /// Multiples of the damping of the rotor's shafts at which that of the first operating point changes.
    pub critical_rotor_damping: Option<Search>,
    /// The same of the stator's.
    pub critical_stator_damping: Option<Search>,
    /// What this case does not have, and why.
    pub absent: Vec<Absent>,
}

/// A signal as a number.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Driven {
    /// Its key in the case.
    pub key: &'static str,
    /// In its own unit.
    pub value: f64,
    /// Which value of the signal it is.
    pub taken: &'static str,
}

/// Sliding at one relative velocity.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OperatingPoint {
    /// Whether twists and speeds stay as they are there.
    pub steady: bool,
    /// omega_r, rad/s.
    pub relative_velocity: f64,
    /// Of every inertia of the rotor, if steady, rad/s.
    pub rotor_speed: Option<f64>,
    /// Of every inertia of the stator, if steady, rad/s.
    pub stator_speed: Option<f64>,
    /// Of the interface, on the stator, N m.
    pub interface_torque: f64,
    /// If steady, rad.
    pub rotor_twist: Vec<f64>,
    /// If steady, rad.
    pub stator_twist: Vec<f64>,
    /// What becomes of a small disturbance.
    pub stability: Verdict,
}

/// The modes of one state.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrainState {
    /// "axial", "separated", "stick", "slip" or "engaged".
    pub state: &'static str,
    /// About which the state is linear, rad/s; `None` where it does not matter.
    pub relative_velocity: Option<f64>,
    /// The fastest first.
    pub modes: Vec<TrainMode>,
}

/// One eigenvalue, with its complex conjugate if it is complex.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrainMode {
    /// |lambda|/(2 pi), Hz: the frequency without damping; `None` for a real root.
    pub frequency: Option<f64>,
    /// -Re lambda/|lambda|; `None` for a real root.
    pub damping_ratio: Option<f64>,
    /// -Re lambda, 1/s; negative: grows. 0 where it is no more than rounding.
    pub decay: f64,
    /// The inertia with the largest kinetic energy, such as "stator 0"; inertia 0 is the surface. `None` where none moves.
    pub moves: Option<String>,
}

/// Where stability changes while one number is varied.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Search {
    /// The range that was searched.
    pub from: f64,
    /// Its upper end.
    pub to: f64,
    /// In rising order.
    pub changes: Vec<Change>,
    /// Where nothing changes, what holds over the whole range.
    pub throughout: Option<Verdict>,
}

/// A change of stability.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Change {
    /// Of what was varied.
    pub value: f64,
    /// |omega_r| there, rad/s.
    pub relative_velocity: f64,
    /// Of the motion that neither grows nor dies out, Hz; `None` where it does not oscillate.
    pub frequency: Option<f64>,
    /// Whether sliding is unstable at larger values.
    pub unstable_above: bool,
}

/// What a case does not have.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Absent {
    /// What.
    pub what: &'static str,
    /// Why.
    pub why: String,
}

/// A signal as one number: what it holds in the end, and of a harmonic its mean.
fn settled(drive: &Drive) -> (f64, &'static str) {
    match drive {
        Drive::Value(value) => (*value, "constant"),
        Drive::Linear(signal) => (
            signal.pieces().all().last().map_or(0.0, |piece| piece.value),
            "held in the end",
        ),
        Drive::Wave(wave) => (wave.mean, "mean"),
        Drive::Sum(terms) => (
            terms.iter().map(|term| settled(term).0).sum(),
            "sum of means and final values",
        ),
    }
}

/// Of one train.
struct Base {
    /// V of a tied train, or the torque M over D of one that bearings hold; `None` of one that nothing holds.
    speed: Option<f64>,
    /// 1/D of one that bearings hold, else 0, rad/(N m s).
    yielding: f64,
    torque: f64,
}

impl Base {
    fn new(train: &Train, speed: f64, torque: f64) -> Base {
        if !matches!(train.end, End::Free) {
            return Base {
                speed: Some(speed),
                yielding: 0.0,
                torque,
            };
        }
        let ground: f64 = train.viscous.iter().sum();
        let held = ground > 0.0;
        Base {
            speed: held.then_some(torque / ground),
            yielding: if held { 1.0 / ground } else { 0.0 },
            torque,
        }
    }
}

/// What steady sliding with the sense s at x = |omega_r| must meet, T being the torque of friction at x.
#[derive(Clone, Copy)]
enum Balance {
    /// x + yielding T = speed.
    Speed { speed: f64, yielding: f64 },
    /// T = torque.
    Torque(f64),
    /// Nothing holds the trains.
    Never,
}

/// The trains about sliding at a speed.
struct Sliding<'a> {
    trains: &'a Trains,
    system: TrainSystem,
    crossings: Crossings,
}

impl<'a> Sliding<'a> {
    fn new(trains: &'a Trains) -> Sliding<'a> {
        let system = TrainSystem::new(trains);
        Sliding {
            crossings: crossings(&system),
            trains,
            system,
        }
    }

    /// The same with other damping of the shafts.
    fn damped(&self, rotor: f64, stator: f64) -> (TrainSystem, Crossings) {
        let mut trains = self.trains.clone();
        trains.rotor.damping.iter_mut().for_each(|c| *c *= rotor);
        trains.stator.damping.iter_mut().for_each(|c| *c *= stator);
        let system = TrainSystem::new(&trains);
        let crossings = crossings(&system);
        (system, crossings)
    }

    fn is_engaged(&self) -> bool {
        self.system.engagement != Engagement::StickSlip
    }

    fn mode(&self, sense: f64) -> Mode {
        match (self.is_engaged(), sense < 0.0) {
            (true, _) => Mode::Engaged,
            (false, false) => Mode::SlipForward,
            (false, true) => Mode::SlipBackward,
        }
    }

    /// The torque of the interface in steady sliding at `x` > 0, over r F_n.
    fn coefficient(&self, x: f64) -> f64 {
        let (outside, y) = state(&self.system, x, 1.0 / self.system.radius);
        let piece = self.system.piece_of(x);
        self.system.interface_torque(self.mode(1.0), 1.0, piece, &outside, &y)
    }

    /// The damping of the contact at `x` over r F_n, s/rad; bristles have one that depends on the frequency, which is not it.
    fn slope(&self, x: f64) -> f64 {
        let (system, law) = (&self.system, self.system.law_in(self.system.piece_of(x)));
        let (outside, y) = state(system, x, 1.0 / system.radius);
        match system.engagement {
            Engagement::StickSlip => law.coefficient_and_slope(x).1,
            _ => {
                // The column of the interface is known from the mode without contact.
                let with = jacobian(system, Mode::Engaged, 1.0, &outside, &y);
                let without = jacobian(system, Mode::Separated, 1.0, &outside, &y);
                let (b, g) = columns(system);
                let row = b.icamax();
                let column = g.icamax();
                (with[(row, column)] - without[(row, column)]) / (b[row] * g[column])
            }
        }
    }

    fn has_bristles(&self) -> bool {
        matches!(self.system.engagement, Engagement::Bristles(..))
    }

    fn verdict(&self, x: f64, force: f64) -> Verdict {
        self.verdict_of(&self.system, &self.crossings, x, force)
    }

    fn verdict_of(&self, system: &TrainSystem, crossings: &Crossings, x: f64, force: f64) -> Verdict {
        if !self.has_bristles() {
            return crossings.verdict(self.slope(x) * system.radius * force);
        }
        let (outside, y) = state(system, x, force);
        let matrix = jacobian(system, Mode::Engaged, 1.0, &outside, &y);
        let found = eigenvalues(&scaled(system, &matrix));
        let rounding = ROUNDING * found.iter().map(|l| l.norm()).fold(0.0, f64::max);
        let moving = found.iter().filter(|l| l.norm() > rounding);
        let most = moving.map(|l| l.re).fold(f64::NEG_INFINITY, f64::max);
        match most {
            most if most > rounding => Verdict::Unstable,
            most if most >= -rounding => Verdict::Neutral,
            _ => Verdict::Stable,
        }
    }

    /// Of the motion that neither grows nor dies out at a change of stability, Hz.
    fn frequency(&self, system: &TrainSystem, crossings: &Crossings, x: f64, force: f64) -> Option<f64> {
        let omega = if self.has_bristles() {
            let (outside, y) = state(system, x, force);
            let found = eigenvalues(&scaled(system, &jacobian(system, Mode::Engaged, 1.0, &outside, &y)));
            let rounding = ROUNDING * found.iter().map(|l| l.norm()).fold(0.0, f64::max);
            let moving = found.iter().filter(|l| l.norm() > rounding);
            moving
                .min_by(|a, b| a.re.abs().total_cmp(&b.re.abs()))
                .map(|l| l.im.abs())
        } else {
            crossings.frequency(self.slope(x) * system.radius * force)
        };
        omega.filter(|&omega| omega > 0.0).map(|omega| omega / TAU)
    }

    /// Relative velocities to look at, rising, up to `to`: in equal ratios and equal steps, about the knots of the law, and
    /// between the speeds where its slope makes up for a resistance of the trains.
    fn grid(&self, to: f64, force: f64) -> Vec<f64> {
        let count = DECADES * POINTS;
        let mut grid: Vec<f64> = (0..=count)
            .flat_map(|k| {
                let share = f64::from(k) / f64::from(count);
                [to * 10f64.powf(f64::from(DECADES) * (share - 1.0)), to * share]
            })
            .collect();
        let mut marks: Vec<f64> = self.system.law.knots().to_vec();
        grid.extend(marks.iter().flat_map(|knot| [knot * (1.0 - 1e-9), knot * (1.0 + 1e-9)]));
        if !self.is_engaged() {
            marks.extend(self.zeros(force));
        }
        marks.sort_by(f64::total_cmp);
        grid.extend(marks.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])));
        grid.retain(|&x| x > 0.0 && x <= to);
        grid.sort_by(f64::total_cmp);
        grid.dedup();
        grid
    }

    fn zeros(&self, force: f64) -> Vec<f64> {
        let weight = self.system.radius * force;
        let of = |resistance: f64| self.system.law.damping_zeros(resistance, weight);
        let all = self.crossings.0.iter().flat_map(|crossing| of(crossing.resistance));
        all.filter(|x| x.is_finite() && *x > 0.0).collect()
    }

    /// Up to where relative velocities are searched: beyond all that the law, its smoothing, and the case have to say.
    fn reach(&self, force: f64, sliding: f64) -> f64 {
        let law = &self.system.law;
        let smoothing = match self.system.engagement {
            Engagement::Regularised(_, speed) => 1e3 * speed,
            _ => 0.0,
        };
        let known = [
            law.extent(),
            law.knots().last().copied().unwrap_or(0.0),
            smoothing,
            2.0 * sliding,
        ];
        let zeros = self.zeros(force).into_iter().map(|x| 2.0 * x);
        let most = known
            .into_iter()
            .chain(zeros)
            .filter(|x| x.is_finite())
            .fold(0.0, f64::max);
        let most = if most > 0.0 { most } else { 1.0 };
        // Of a law that ends, its last speed is none of it.
        most.min(law.ends_at() * (1.0 - f64::EPSILON))
    }
}

/// Sliding at omega_r = `w` with nothing else in motion, bristles deflected as in steady sliding, under F_n.
fn state(system: &TrainSystem, w: f64, force: f64) -> (Outside, Vec<f64>) {
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
fn jacobian(system: &TrainSystem, mode: Mode, sense: f64, outside: &Outside, y: &[f64]) -> DMatrix<f64> {
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
fn columns(system: &TrainSystem) -> (DVector<f64>, DVector<f64>) {
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
fn scaled(system: &TrainSystem, matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let weights = weights(system);
    DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| {
        matrix[(i, j)] * weights[i] / weights[j]
    })
}

/// Where the motion of stick is: omega_r = 0, and of two trains that are both held, with the surfaces where they stuck.
fn stuck(system: &TrainSystem) -> DMatrix<f64> {
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
fn modes_of(system: &TrainSystem, matrix: &DMatrix<f64>, basis: Option<&DMatrix<f64>>) -> Vec<TrainMode> {
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

fn crossings(system: &TrainSystem) -> Crossings {
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

/// The numbers at which `verdict` changes between the points of a rising grid, each to the last digit.
fn changes(grid: &[f64], verdict: impl Fn(f64) -> Verdict) -> (Vec<(f64, bool)>, Option<Verdict>) {
    let known: Vec<(f64, Verdict)> = grid.iter().map(|&value| (value, verdict(value))).collect();
    let mut found = Vec::new();
    for pair in known.windows(2) {
        let (mut below, mut above) = (pair[0].0, pair[1].0);
        let (first, last) = (pair[0].1.is_unstable(), pair[1].1.is_unstable());
        if first == last {
            continue;
        }
        loop {
            let middle = 0.5 * (below + above);
            if middle <= below || middle >= above {
                break;
            }
            if verdict(middle).is_unstable() == first {
                below = middle;
            } else {
                above = middle;
            }
        }
        found.push((above, last));
    }
    let throughout = match (found.is_empty(), known.first()) {
        // A stretch without any slope amid others is neutral: it is the least that holds throughout.
        (true, Some(first)) if known.iter().all(|(_, verdict)| *verdict == first.1) => Some(first.1),
        (true, Some(first)) if !first.1.is_unstable() => Some(Verdict::Neutral),
        _ => None,
    };
    (found, throughout)
}

fn multiples() -> Vec<f64> {
    let count = 6 * POINTS;
    (0..=count)
        .map(|k| MULTIPLES.powf(2.0 * f64::from(k) / f64::from(count) - 1.0))
        .collect()
}

impl TrainModes {
    /// Of a case.
    pub fn of_case(trains: &Trains) -> TrainModes {
        let sliding = Sliding::new(trains);
        let system = &sliding.system;
        let mut absent = Vec::new();
        let mut driving = Vec::new();
        let rotor = base(&trains.rotor, ["rotor.speed", "rotor.torque"], &mut driving);
        let stator = base(&trains.stator, ["stator.speed", "stator.torque"], &mut driving);
        let force = pressing(trains, &mut driving);

        let mut states = Vec::new();
        match &trains.pressing {
            Pressing::Axial { axial, .. } => states.push(axial_state(&axial.axial())),
            Pressing::Force(_) => absent.push(Absent {
                what: "axial mode",
                why: "the normal force is given directly".to_owned(),
            }),
        }
        let rest = vec![0.0; system.dimension];
        let pressed = Outside {
            normal_force: force,
            ..Outside::default()
        };
        let of = |mode: Mode, sense: f64, outside: &Outside, y: &[f64], basis: Option<&DMatrix<f64>>| {
            modes_of(system, &jacobian(system, mode, sense, outside, y), basis)
        };
        states.push(TrainState {
            state: "separated",
            relative_velocity: None,
            modes: of(Mode::Separated, 1.0, &pressed, &rest, None),
        });
        if sliding.is_engaged() {
            absent.push(Absent {
                what: "stick mode",
                why: "the contact has none, it creeps; engaged at omega_r = 0 is its rest".to_owned(),
            });
            states.push(TrainState {
                state: "engaged",
                relative_velocity: Some(0.0),
                modes: of(Mode::Engaged, 1.0, &pressed, &rest, None),
            });
        } else {
            let modes = of(Mode::Stick, 1.0, &pressed, &rest, Some(&stuck(system)));
            if modes.is_empty() {
                absent.push(Absent {
                    what: "stick mode",
                    why: "in stick everything moves as it is driven, and no mode is left".to_owned(),
                });
            } else {
                states.push(TrainState {
                    state: "stick",
                    relative_velocity: None,
                    modes,
                });
            }
        }

        let start = at_start(trains);
        let balances = [1.0, -1.0].map(|sense| (sense, balance(&rotor, &stator, sense)));
        let mut operating_points = Vec::new();
        for (sense, balance) in balances {
            for x in sliding.steady(balance, force, start.abs()) {
                operating_points.push(sliding.operating(sense, x, force, Some((&rotor, &stator))));
            }
        }
        operating_points.sort_by(|a, b| b.relative_velocity.abs().total_cmp(&a.relative_velocity.abs()));
        if operating_points.is_empty() {
            let why = if force <= 0.0 {
                "the contact is open: its normal force is not positive".to_owned()
            } else if start == 0.0 {
                "no relative velocity balances what drives the trains, and at t = 0 there is none".to_owned()
            } else {
                "not steady: no relative velocity balances what drives the trains; that of t = 0 is taken".to_owned()
            };
            absent.push(Absent {
                what: "steady sliding",
                why,
            });
            if force > 0.0 && start != 0.0 {
                operating_points.push(sliding.operating(start.signum(), start.abs(), force, None));
            }
        }
        for point in &operating_points {
            let w = point.relative_velocity;
            let (outside, y) = state(system, w, force);
            let mode = sliding.mode(w);
            states.push(TrainState {
                state: if sliding.is_engaged() { "engaged" } else { "slip" },
                relative_velocity: Some(w),
                modes: of(mode, w.signum(), &outside, &y, None),
            });
        }

        let first = operating_points.first();
        let x = first.map(|point| point.relative_velocity.abs());
        let critical_relative_velocities = sliding.critical_velocities(force, x.unwrap_or(0.0));
        let critical_normal_forces = first.filter(|_| force > 0.0).map(|point| {
            let balance = if point.steady {
                balance(&rotor, &stator, point.relative_velocity.signum())
            } else {
                Balance::Never
            };
            sliding.critical_forces(force, point.relative_velocity.abs(), balance)
        });
        let mut damping = |what: &'static str, train: &Train, scale: fn(f64) -> (f64, f64)| {
            if !train.damping.iter().any(|&c| c > 0.0) {
                absent.push(Absent {
                    what,
                    why: "its shafts have no damping".to_owned(),
                });
                return None;
            }
            x.map(|x| sliding.critical_damping(force, x, scale))
        };
        let critical_rotor_damping = damping("critical damping of the rotor", &trains.rotor, |k| (k, 1.0));
        let critical_stator_damping = damping("critical damping of the stator", &trains.stator, |k| (1.0, k));
        TrainModes {
            driving,
            operating_points,
            states,
            critical_relative_velocities,
            critical_normal_forces,
            critical_rotor_damping,
            critical_stator_damping,
            absent,
        }
    }
}

/// What holds a train, with its signals as numbers.
fn base(train: &Train, keys: [&'static str; 2], driving: &mut Vec<Driven>) -> Base {
    let mut take = |key, drive: &Drive| {
        let (value, taken) = settled(drive);
        driving.push(Driven { key, value, taken });
        value
    };
    let speed = match &train.end {
        End::Driven(speed) => take(keys[0], speed),
        End::Free | End::Fixed => 0.0,
    };
    let torque = train
        .torque
        .as_ref()
        .map_or(0.0, |torque| take(keys[1], &torque.signal));
    Base::new(train, speed, torque)
}

/// F_n, N.
fn pressing(trains: &Trains, driving: &mut Vec<Driven>) -> f64 {
    let (key, (value, taken), largest) = match &trains.pressing {
        Pressing::Force(force) => ("contact.normal_force", settled(force), force.largest()),
        Pressing::Axial { actuation, .. } => {
            let pieces = actuation.pieces();
            let last = pieces.all().last().map_or(0.0, |piece| piece.value);
            ("actuation", (last, "held in the end"), pieces.largest())
        }
    };
    // A contact that opens in the end had been pressed before.
    let (value, taken) = if value > 0.0 {
        (value, taken)
    } else {
        (largest, "largest")
    };
    driving.push(Driven { key, value, taken });
    value
}

/// omega_r at t = 0, rad/s.
fn at_start(trains: &Trains) -> f64 {
    let of = |train: &Train, speeds: &[f64]| match (&train.end, speeds.first()) {
        (_, Some(&speed)) => speed,
        (End::Driven(speed), None) => speed.at_start(),
        (_, None) => 0.0,
    };
    of(&trains.rotor, &trains.initial.rotor_speed) - of(&trains.stator, &trains.initial.stator_speed)
}

fn balance(rotor: &Base, stator: &Base, sense: f64) -> Balance {
    match (rotor.speed, stator.speed) {
        (Some(a), Some(b)) => Balance::Speed {
            speed: sense * (a - b),
            yielding: rotor.yielding + stator.yielding,
        },
        (None, Some(_)) => Balance::Torque(sense * rotor.torque),
        (Some(_), None) => Balance::Torque(-sense * stator.torque),
        (None, None) => Balance::Never,
    }
}

fn axial_state(axial: &crate::model::Axial) -> TrainState {
    let modes = axial_modes(axial).modes.into_iter().map(|mode| TrainMode {
        frequency: mode.natural_frequency,
        damping_ratio: mode.damping_ratio,
        decay: -mode.growth_rate,
        moves: None,
    });
    TrainState {
        state: "axial",
        relative_velocity: None,
        modes: modes.collect(),
    }
}

impl Sliding<'_> {
    /// |omega_r| of steady sliding, rad/s.
    fn steady(&self, balance: Balance, force: f64, start: f64) -> Vec<f64> {
        let pressed = self.system.radius * force;
        let torque = |x: f64| pressed * self.coefficient(x);
        let ends = self.system.law.ends_at();
        let (to, missing): (f64, Box<dyn Fn(f64) -> f64 + '_>) = match balance {
            _ if force <= 0.0 => return Vec::new(),
            Balance::Speed { speed, yielding: 0.0 } => {
                return Some(speed).filter(|&x| x > 0.0 && x < ends).into_iter().collect();
            }
            Balance::Speed { speed, yielding } => {
                // Friction only takes speed away.
                (speed, Box::new(move |x| x + yielding * torque(x) - speed))
            }
            Balance::Torque(held) => (self.reach(force, start), Box::new(move |x| torque(x) - held)),
            Balance::Never => return Vec::new(),
        };
        if to.is_nan() || to <= 0.0 {
            return Vec::new();
        }
        let to = to.min(ends * (1.0 - f64::EPSILON));
        let grid = self.grid(to, force);
        let mut found = Vec::new();
        for pair in grid.windows(2) {
            let (mut below, mut above) = (pair[0], pair[1]);
            let first = missing(below) < 0.0;
            if first == (missing(above) < 0.0) {
                continue;
            }
            loop {
                let middle = 0.5 * (below + above);
                if middle <= below || middle >= above {
                    break;
                }
                if (missing(middle) < 0.0) == first {
                    below = middle;
                } else {
                    above = middle;
                }
            }
            found.push(above);
        }
        found
    }

    fn operating(&self, sense: f64, x: f64, force: f64, bases: Option<(&Base, &Base)>) -> OperatingPoint {
        let interface = sense * self.system.radius * force * self.coefficient(x);
        let stability = self.verdict(x, force);
        let mut point = OperatingPoint {
            steady: bases.is_some(),
            relative_velocity: sense * x,
            rotor_speed: None,
            stator_speed: None,
            interface_torque: interface,
            rotor_twist: Vec::new(),
            stator_twist: Vec::new(),
            stability,
        };
        let Some((rotor, stator)) = bases else {
            return point;
        };
        let of_rotor = rotor.speed.map(|speed| speed - rotor.yielding * interface);
        let of_stator = stator.speed.map(|speed| speed + stator.yielding * interface);
        let (of_rotor, of_stator) = match (of_rotor, of_stator) {
            (None, Some(other)) => (other + sense * x, other),
            (Some(other), None) => (other, other - sense * x),
            (Some(rotor), Some(stator)) => (rotor, stator),
            (None, None) => return point,
        };
        point.rotor_speed = Some(of_rotor);
        point.stator_speed = Some(of_stator);
        point.rotor_twist = twists(&self.system.rotor, rotor.torque, interface, of_rotor);
        point.stator_twist = twists(&self.system.stator, stator.torque, interface, of_stator);
        point
    }

    fn critical_velocities(&self, force: f64, sliding: f64) -> Search {
        let to = self.reach(force, sliding);
        let (found, throughout) = changes(&self.grid(to, force), |x| self.verdict(x, force));
        let change = |(x, unstable_above): (f64, bool)| Change {
            value: x,
            relative_velocity: x,
            frequency: self.frequency(&self.system, &self.crossings, x, force),
            unstable_above,
        };
        Search {
            from: 0.0,
            to,
            changes: found.into_iter().map(change).collect(),
            throughout,
        }
    }

    /// Along the branches of steady sliding, on which the speed follows the force; without one, at the speed `x`.
    fn critical_forces(&self, force: f64, x: f64, balance: Balance) -> Search {
        let (from, to) = (force / MULTIPLES, force * MULTIPLES);
        let of_speed = |x: f64| {
            let unit = self.system.radius * self.coefficient(x);
            match balance {
                Balance::Speed { speed, yielding } => (speed - x) / (yielding * unit),
                Balance::Torque(held) => held / unit,
                Balance::Never => f64::NAN,
            }
        };
        let follows = match balance {
            Balance::Speed { yielding, .. } => yielding > 0.0,
            Balance::Torque(_) => true,
            Balance::Never => false,
        };
        let mut search = if follows {
            let end = match balance {
                Balance::Speed { speed, .. } => speed,
                _ => self.reach(force, x),
            };
            let within = |x: &f64| (from..=to).contains(&of_speed(*x));
            let grid: Vec<f64> = self.grid(end, force).into_iter().filter(within).collect();
            let (found, throughout) = changes(&grid, |x| self.verdict(x, of_speed(x)));
            let mut all = Vec::new();
            for (x, unstable) in found {
                let value = of_speed(x);
                // Where the speed falls as the force rises, what is above in speed is below in force.
                let rising = of_speed(x * (1.0 + 1e-6)) > of_speed(x * (1.0 - 1e-6));
                all.push(Change {
                    value,
                    relative_velocity: x,
                    frequency: self.frequency(&self.system, &self.crossings, x, value),
                    unstable_above: unstable == rising,
                });
            }
            Search {
                from,
                to,
                changes: all,
                throughout,
            }
        } else {
            let grid: Vec<f64> = multiples().into_iter().map(|k| k * force).collect();
            let (found, throughout) = changes(&grid, |force| self.verdict(x, force));
            let change = |(value, unstable_above): (f64, bool)| Change {
                value,
                relative_velocity: x,
                frequency: self.frequency(&self.system, &self.crossings, x, value),
                unstable_above,
            };
            Search {
                from,
                to,
                changes: found.into_iter().map(change).collect(),
                throughout,
            }
        };
        search.changes.sort_by(|a, b| a.value.total_cmp(&b.value));
        search
    }

    fn critical_damping(&self, force: f64, x: f64, scale: fn(f64) -> (f64, f64)) -> Search {
        let with = |k: f64| {
            let (rotor, stator) = scale(k);
            self.damped(rotor, stator)
        };
        let (found, throughout) = changes(&multiples_coarse(), |k| {
            let (system, crossings) = with(k);
            self.verdict_of(&system, &crossings, x, force)
        });
        let change = |(value, unstable_above): (f64, bool)| {
            let (system, crossings) = with(value);
            Change {
                value,
                relative_velocity: x,
                frequency: self.frequency(&system, &crossings, x, force),
                unstable_above,
            }
        };
        Search {
            from: 1.0 / MULTIPLES,
            to: MULTIPLES,
            changes: found.into_iter().map(change).collect(),
            throughout,
        }
    }
}

/// As [`multiples`], for what takes longer.
fn multiples_coarse() -> Vec<f64> {
    multiples().into_iter().step_by(4).collect()
}

/// Of the shafts under steady torques, rad.
fn twists(side: &Side, external: f64, interface: f64, speed: f64) -> Vec<f64> {
    let mut torque = interface;
    (0..side.shafts())
        .map(|i| {
            let own = if side.torque_on == Some(i) { external } else { 0.0 };
            torque += side.sign * (side.viscous[i] * speed - own);
            torque / side.stiffness[i]
        })
        .collect()
}
