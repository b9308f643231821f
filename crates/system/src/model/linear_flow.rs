//! Linear motion with constant coefficients, x' = A x, computed with its matrix exponential.

use super::breakaway::Bounded;
use nalgebra::allocator::Allocator;
use nalgebra::{Const, DMatrix, DVector, DefaultAllocator, Dim, Dyn, OMatrix, OVector, RowOVector, U1};
use std::fmt::Debug;
use std::sync::OnceLock;

const LEVELS: usize = 48;

const ORDER: u32 = 11;

/// The motion x' = A x with an energy x^T P x that never grows, and a linear function c x.
pub(super) trait DecayingFlow: Debug + Send + Sync {
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
pub(super) fn flow(a: &DMatrix<f64>, energy: &DMatrix<f64>, row: &DVector<f64>) -> Box<dyn DecayingFlow> {
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
