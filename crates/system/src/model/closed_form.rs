//! Stick and separation in closed form, for ends at rest and constant torques.
//!
//! The matrix exponential is exact at any time, and its energy can prove that a stick never breaks away again. The
//! coordinates are those of `Chains`.

use super::OfLinearModes;
use super::chains::{Chains, Drifting, TermSum, Turning};
use super::equations::{ANGLE, DAMPING_LOSS, SystemEquations, WORK};
use crate::model::Mode;
use crate::model::breakaway::{Bounded, Breakaway, BreakawaySearch, first_breakaway};
use nalgebra::allocator::Allocator;
use nalgebra::{Const, DMatrix, DVector, DefaultAllocator, Dim, Dyn, OMatrix, OVector, RowOVector, U1};
use std::fmt::Debug;
use std::sync::OnceLock;

/// Largest number of coordinates with a closed form. Its work grows with the square of their number, a Taylor series'
/// in proportion.
const MOST: usize = 16;

/// The linear motions of a system, in stick and in separation. Each is made on first use.
pub type ClosedForm = OfLinearModes<LinearMotion>;

impl ClosedForm {
    /// The motion of a mode. `None` without a closed form: in slip, if a shaft has no stiffness, if nothing moves by
    /// itself, and for long chains.
    pub fn of(&self, system: &SystemEquations, mode: Mode) -> Option<&LinearMotion> {
        self.get(mode, || LinearMotion::new(system, mode == Mode::Stick))
    }
}

/// The linear motion of one mode.
#[derive(Debug)]
pub struct LinearMotion {
    /// Its linear function is the torque that the breakaway test uses, N m.
    flow: Box<dyn DecayingFlow>,
    energy: DMatrix<f64>,
    dimension: usize,
    entries: Vec<TermSum>,
    speeds: Vec<TermSum>,
    /// Coordinate, state entry and factor of each twist: x = factor y.
    twists: Vec<(usize, usize, f64)>,
    /// Side, coordinate and factor of each torque: x = torque / factor.
    torques: Vec<(usize, usize, f64)>,
    drifting: Vec<Drifting>,
    driven: [Option<Turning>; 2],
    surfaces: [Option<Turning>; 2],
    /// Angle of the stator's outermost inertia; `None` unless both chains are free.
    outermost: Option<Turning>,
    /// Matrix from the initial coordinates to those at rest; `None` if these are zero.
    rest: Option<DMatrix<f64>>,
    stuck: bool,
    slip: usize,
}

impl LinearMotion {
    fn new(system: &SystemEquations, stuck: bool) -> Option<LinearMotion> {
        let chains = Chains::new(system, stuck).filter(|chains| chains.dimension() <= MOST)?;
        let (a, energy) = (chains.flow(), chains.energy());
        let flow = linear_flow(&a, &energy, &chains.tested(system));
        flow.has_bounds().then_some(())?;
        Some(LinearMotion {
            flow,
            energy,
            dimension: chains.dimension(),
            entries: chains.entries(),
            speeds: chains.speeds(),
            twists: chains.twists(),
            torques: chains.torques().to_vec(),
            drifting: chains.drifting(),
            driven: [0, 1].map(|side| chains.driven(side)),
            surfaces: [0, 1].map(|side| chains.surface(side)),
            outermost: chains.outermost(),
            rest: chains.rest(&a)?,
            stuck,
            slip: system.slip,
        })
    }

    fn coordinates(&self, y: &[f64], torques: [f64; 2]) -> DVector<f64> {
        let mut x = DVector::zeros(self.dimension);
        for &(coordinate, entry, factor) in &self.twists {
            x[coordinate] = factor * y[entry];
        }
        for speed in &self.speeds {
            x[speed.of] = speed.over(y);
        }
        for &(side, coordinate, factor) in &self.torques {
            x[coordinate] = torques[side] / factor;
        }
        x
    }

    /// Writes to `out` the state a time `tau` >= 0 (s) after `y`, under the external torques of rotor and stator (N
    /// m). In stick both surfaces have the same speed.
    pub fn state(&self, y: &[f64], torques: [f64; 2], tau: f64, out: &mut [f64]) {
        let start = self.coordinates(y, torques);
        let mut x = start.clone();
        self.flow.advance(start.as_slice(), tau, x.as_mut_slice());
        out.copy_from_slice(y);
        for entry in &self.entries {
            out[entry.of] = entry.over(x.as_slice());
        }
        let change = &x - &start;
        let mut common = [0.0; 2];
        for (drifting, common) in self.drifting.iter().zip(&mut common) {
            let acceleration = drifting.acceleration(torques);
            for (index, row) in &drifting.speeds {
                out[*index] = y[*index] + row.dot(&change) + acceleration * tau;
            }
            if let Some((index, row)) = drifting.speeds.first() {
                *common = (y[*index] - row.dot(&start) + 0.5 * acceleration * tau) * tau;
            }
        }
        let beside = |turning: &Option<Turning>| turning.as_ref().map_or(0.0, |turning| turning.row.dot(&change));
        let turned = |turning: &Option<Turning>| {
            let drifting = turning.as_ref().and_then(|turning| turning.drifting);
            beside(turning) + drifting.map_or(0.0, |index| common[index])
        };
        let quadratures = &mut out[self.slip..];
        if !self.stuck {
            quadratures[0] += turned(&self.surfaces[0]) - turned(&self.surfaces[1]);
        }
        let mut work = 0.0;
        for &(side, ..) in &self.torques {
            quadratures[WORK] += torques[side] * turned(&self.driven[side]);
            work += torques[side] * beside(&self.driven[side]);
        }
        let energy = 0.5 * (change.transpose() * &self.energy * (x + start))[0];
        quadratures[DAMPING_LOSS] += work - energy;
        if let (Some(angle), Some(_)) = (quadratures.get_mut(ANGLE), &self.outermost) {
            *angle += turned(&self.outermost);
        }
    }

    /// The torque (N m) of the breakaway test in stick at `y`, under the external torques of rotor and stator (N m).
    pub fn tested_torque(&self, y: &[f64], torques: [f64; 2]) -> f64 {
        self.flow.value(self.coordinates(y, torques).as_slice())
    }

    /// Breakaway of a stick that begins with `y`, under the external torques of rotor and stator (N m). `limit` gives
    /// the breakaway torque into a sense (+1 or -1) a time after the start, and `lowest` the least from there on, N m.
    pub fn breakaway(
        &self,
        y: &[f64],
        torques: [f64; 2],
        search: BreakawaySearch,
        limit: impl Fn(f64, f64) -> Bounded,
        lowest: impl Fn(f64) -> f64,
    ) -> Breakaway {
        let start = self.coordinates(y, torques);
        let rest = self.rest.as_ref().map(|rest| rest * &start);
        let at_rest = rest.as_ref().map_or(0.0, |rest| self.flow.value(rest.as_slice()).abs());
        let tested = |tau: f64| {
            let mut x = start.clone();
            self.flow.advance(start.as_slice(), tau, x.as_mut_slice());
            let (torque, swing) = match &rest {
                Some(rest) => self.flow.bounded(x.as_slice(), (&x - rest).as_slice()),
                None => self.flow.bounded(x.as_slice(), x.as_slice()),
            };
            (torque, at_rest + swing)
        };
        first_breakaway(search, tested, limit, lowest)
    }
}

const LEVELS: usize = 48;

const ORDER: u32 = 11;

/// The motion x' = A x with an energy x^T P x that never grows, and a linear function c x.
trait DecayingFlow: Debug + Send + Sync {
    fn advance(&self, x: &[f64], tau: f64, out: &mut [f64]);

    fn has_bounds(&self) -> bool;

    fn value(&self, x: &[f64]) -> f64;

    /// c x with its bounds, and the largest later distance of c x from its value at rest. `moving`: coordinates minus
    /// those at rest.
    fn bounded(&self, x: &[f64], moving: &[f64]) -> (Bounded, f64);
}

/// The flow for the matrices A and P and the row c. The sizes of small systems are known to the compiler.
///
/// `a` must be scaled to entries of similar size. P is symmetric, and positive definite except for zero rows. If it
/// has no inverse in double precision, there are no bounds: see [`DecayingFlow::has_bounds`].
fn linear_flow(a: &DMatrix<f64>, energy: &DMatrix<f64>, row: &DVector<f64>) -> Box<dyn DecayingFlow> {
    match a.nrows() {
        2 => Box::new(LinearFlow::new(Const::<2>, a, energy, row)),
        3 => Box::new(LinearFlow::new(Const::<3>, a, energy, row)),
        4 => Box::new(LinearFlow::new(Const::<4>, a, energy, row)),
        n => Box::new(LinearFlow::new(Dyn(n), a, energy, row)),
    }
}

/// The implementation of [`DecayingFlow`].
///
/// exp(A h 2^k) - 1 is tabulated on demand, so that exp(A tau) x takes one product for each binary digit of tau / h,
/// and a short Taylor series for the rest. This needs no eigenvectors, and loses no accuracy near a double
/// eigenvalue. Because of the -1, the rounding of a slow component is that of its change, not of its size. The energy
/// bounds every linear function of x at all later times. These bounds serve to isolate roots, and to prove that an
/// event never occurs again.
///
/// Coordinates without energy, such as an angle or a constant, have zero rows in P. They can drive or follow the
/// others. The bounds apply to functions of the others.
#[derive(Debug)]
struct LinearFlow<D: Dim>
where
    DefaultAllocator: Allocator<D, D> + Allocator<U1, D>,
{
    dimension: D,
    a: OMatrix<f64, D, D>,
    energy: OMatrix<f64, D, D>,
    energy_inverse: OMatrix<f64, D, D>,
    base: f64,
    changes: Vec<OnceLock<OMatrix<f64, D, D>>>,
    /// c, followed by the row of its rate.
    row: RowOVector<f64, D>,
    rate_row: RowOVector<f64, D>,
    /// |c x| <= value_bound sqrt(x^T P x)
    value_bound: f64,
    /// |(c x)''| <= curvature_bound sqrt(x^T P x)
    curvature_bound: f64,
}

impl<D: Dim> LinearFlow<D>
where
    DefaultAllocator: Allocator<D, D> + Allocator<D> + Allocator<U1, D>,
{
    fn new(dimension: D, a: &DMatrix<f64>, energy: &DMatrix<f64>, row: &DVector<f64>) -> Self {
        let of = |matrix: &DMatrix<f64>| OMatrix::from_column_slice_generic(dimension, dimension, matrix.as_slice());
        let (a, energy) = (of(a), of(energy));
        let row = RowOVector::from_column_slice_generic(Const::<1>, dimension, row.as_slice());
        let without: Vec<usize> = (0..energy.nrows())
            .filter(|&k| energy.row(k).iter().all(|&entry| entry == 0.0))
            .collect();
        let mut definite = energy.clone();
        without.iter().for_each(|&k| definite[(k, k)] = 1.0);
        let mut energy_inverse = definite
            .try_inverse()
            .unwrap_or_else(|| OMatrix::repeat_generic(dimension, dimension, f64::NAN));
        without.iter().for_each(|&k| energy_inverse[(k, k)] = 0.0);
        let norm = a.abs().row_sum().max().max(a.abs().column_sum().max());
        // ||A h|| <= 1/16. The error of the Taylor series of order 11 is then 16^-12/12!, 1e-23.
        let base = if norm > 0.0 {
            2f64.powi(-((16.0 * norm).log2().ceil() as i32))
        } else {
            1.0
        };
        let mut term = &a * base;
        let mut change = term.clone();
        for n in 2..=ORDER {
            term = &term * &a * (base / f64::from(n));
            change += &term;
        }
        let mut changes = vec![OnceLock::from(change)];
        changes.resize_with(LEVELS, OnceLock::new);
        let bound = |r: &RowOVector<f64, D>| (r * &energy_inverse * r.transpose())[0].max(0.0).sqrt();
        let rate_row = &row * &a;
        LinearFlow {
            value_bound: bound(&row),
            curvature_bound: bound(&(&rate_row * &a)),
            dimension,
            a,
            energy,
            energy_inverse,
            base,
            changes,
            row,
            rate_row,
        }
    }

    fn vector(&self, x: &[f64]) -> OVector<f64, D> {
        OVector::from_column_slice_generic(self.dimension, Const::<1>, x)
    }

    fn change(&self, k: usize) -> &OMatrix<f64, D, D> {
        self.changes[k].get_or_init(|| doubled(self.change(k - 1)))
    }

    fn advanced(&self, mut x: OVector<f64, D>, tau: f64) -> OVector<f64, D> {
        let units = (tau / self.base).floor();
        if !units.is_finite() {
            x.fill(f64::NAN);
            return x;
        }
        let longest = (1u64 << LEVELS) as f64;
        // Beyond the table the doubling continues, up to the largest double. It occurs with heavy damping over long
        // times.
        let mut beyond = (units / longest).floor();
        let mut bits = (units - beyond * longest) as u64;
        if beyond >= 1.0 {
            let mut change = self.change(LEVELS - 1).clone();
            while beyond >= 1.0 {
                change = doubled(&change);
                if beyond % 2.0 == 1.0 {
                    x += &change * &x;
                }
                beyond = (beyond / 2.0).floor();
            }
        }
        let mut k = 0;
        while bits != 0 {
            if bits & 1 == 1 {
                x += self.change(k) * &x;
            }
            bits >>= 1;
            k += 1;
        }
        let rest = tau - units * self.base;
        let mut term = x.clone();
        for n in 1..=ORDER {
            term = &self.a * &term * (rest / f64::from(n));
            x += &term;
        }
        x
    }
}

fn doubled<D: Dim>(change: &OMatrix<f64, D, D>) -> OMatrix<f64, D, D>
where
    DefaultAllocator: Allocator<D, D>,
{
    change * 2.0 + change * change
}

impl<D: Dim> DecayingFlow for LinearFlow<D>
where
    DefaultAllocator: Allocator<D, D> + Allocator<D> + Allocator<U1, D>,
    Self: Debug + Send + Sync,
{
    fn advance(&self, x: &[f64], tau: f64, out: &mut [f64]) {
        out.copy_from_slice(self.advanced(self.vector(x), tau).as_slice());
    }

    fn has_bounds(&self) -> bool {
        self.energy_inverse.iter().all(|entry| entry.is_finite())
            && (0..self.energy_inverse.nrows()).all(|k| self.energy_inverse[(k, k)] >= 0.0)
    }

    fn value(&self, x: &[f64]) -> f64 {
        (&self.row * self.vector(x))[0]
    }

    fn bounded(&self, x: &[f64], moving: &[f64]) -> (Bounded, f64) {
        let (x, moving) = (self.vector(x), self.vector(moving));
        let norm = (moving.transpose() * &self.energy * &moving)[0].max(0.0).sqrt();
        let value = Bounded {
            value: (&self.row * &x)[0],
            rate: (&self.rate_row * &x)[0],
            curvature: self.curvature_bound * norm,
        };
        (value, self.value_bound * norm)
    }
}
