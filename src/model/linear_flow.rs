//! Linear motion with constant coefficients, x' = A x, by its matrix exponential.

use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, Dim, OMatrix, OVector, RowOVector, U1};
use std::sync::OnceLock;

/// Number of doublings of the smallest tabulated time.
const LEVELS: usize = 48;

/// Order of the Taylor series over less than the smallest of them.
const ORDER: u32 = 11;

/// x' = A x with an energy x^T P x that never grows.
///
/// exp(A h 2^k) - 1 is tabulated as far as it is asked for, so that exp(A tau) x takes one product for each binary digit
/// of tau / h and a short Taylor series for the rest. That needs no eigenvectors, and so loses nothing near a double
/// eigenvalue; and without the 1 a component that changes slowly is rounded by its change, not by its size, in each of the
/// products. The energy bounds every linear function of x for all later times, which makes root isolation and "never
/// again" provable.
///
/// Coordinates may be without energy, such as an angle or a constant: their rows of P are zero. They drive and follow the
/// others, and the bounds are those of functions of the others.
#[derive(Debug, Clone)]
pub(crate) struct LinearFlow<D: Dim>
where
    DefaultAllocator: Allocator<D, D>,
{
    a: OMatrix<f64, D, D>,
    energy: OMatrix<f64, D, D>,
    energy_inverse: OMatrix<f64, D, D>,
    base: f64,
    /// exp(A h 2^k) - 1, as far as times have come.
    changes: Vec<OnceLock<OMatrix<f64, D, D>>>,
}

/// A linear function c x of the state, with what bounds it and its second derivative by the energy.
#[derive(Debug, Clone)]
pub(crate) struct Functional<D: Dim>
where
    DefaultAllocator: Allocator<U1, D>,
{
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
    /// `a` must be scaled so that its entries are of one size; `energy` is P, symmetric and positive definite but for its rows
    /// of zeros.
    ///
    /// Where the energy has no inverse in double precision there are no bounds: see [`Self::has_bounds`].
    pub fn new(a: OMatrix<f64, D, D>, energy: OMatrix<f64, D, D>) -> Self {
        let (rows, columns) = a.shape_generic();
        let without: Vec<usize> = (0..energy.nrows())
            .filter(|&k| energy.row(k).iter().all(|&entry| entry == 0.0))
            .collect();
        let mut definite = energy.clone();
        without.iter().for_each(|&k| definite[(k, k)] = 1.0);
        let mut energy_inverse = definite
            .try_inverse()
            .unwrap_or_else(|| OMatrix::repeat_generic(rows, columns, f64::NAN));
        without.iter().for_each(|&k| energy_inverse[(k, k)] = 0.0);
        let norm = a.abs().row_sum().max().max(a.abs().column_sum().max());
        // ||A h|| <= 1/16: the Taylor series of order 11 leaves 16^-12/12!, 1e-23.
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
        LinearFlow {
            a,
            energy,
            energy_inverse,
            base,
            changes,
        }
    }

    /// Whether the energy bounds functions of the state.
    pub fn has_bounds(&self) -> bool {
        self.energy_inverse.iter().all(|entry| entry.is_finite())
            && (0..self.energy_inverse.nrows()).all(|k| self.energy_inverse[(k, k)] >= 0.0)
    }

    /// exp(A h 2^k) - 1.
    fn change(&self, k: usize) -> &OMatrix<f64, D, D> {
        self.changes[k].get_or_init(|| doubled(self.change(k - 1)))
    }

    pub(crate) fn functional(&self, row: RowOVector<f64, D>) -> Functional<D> {
        let bound = |r: &RowOVector<f64, D>| (r * &self.energy_inverse * r.transpose())[0].max(0.0).sqrt();
        let rate_row = &row * &self.a;
        let second = &rate_row * &self.a;
        Functional {
            value_bound: bound(&row),
            curvature_bound: bound(&second),
            row,
            rate_row,
        }
    }

    /// exp(A tau) x for tau >= 0.
    pub fn advance(&self, x: &OVector<f64, D>, tau: f64) -> OVector<f64, D> {
        let mut x = x.clone();
        let units = (tau / self.base).floor();
        if !units.is_finite() {
            x.fill(f64::NAN);
            return x;
        }
        let longest = (1u64 << LEVELS) as f64;
        // Beyond the table the doubling goes on, at most to the largest double: heavy damping over a long time.
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

    /// sqrt(x^T P x).
    pub(crate) fn energy_norm(&self, x: &OVector<f64, D>) -> f64 {
        (x.transpose() * &self.energy * x)[0].max(0.0).sqrt()
    }
}

/// (1 + E)^2 - 1.
fn doubled<D: Dim>(change: &OMatrix<f64, D, D>) -> OMatrix<f64, D, D>
where
    DefaultAllocator: Allocator<D, D>,
{
    change * 2.0 + change * change
}

impl<D: Dim> Functional<D>
where
    DefaultAllocator: Allocator<D, D> + Allocator<D> + Allocator<U1, D>,
{
    pub fn value(&self, x: &OVector<f64, D>) -> f64 {
        (&self.row * x)[0]
    }

    pub fn rate(&self, x: &OVector<f64, D>) -> f64 {
        (&self.rate_row * x)[0]
    }

    /// The largest |c x| from here on, given the energy norm here.
    pub(crate) fn largest_later(&self, energy_norm: f64) -> f64 {
        self.value_bound * energy_norm
    }

    /// The largest |(c x)''| from here on, given the energy norm here.
    pub(crate) fn largest_curvature_later(&self, energy_norm: f64) -> f64 {
        self.curvature_bound * energy_norm
    }
}
