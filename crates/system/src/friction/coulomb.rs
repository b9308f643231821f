//! Friction independent of the sliding speed.

use super::parameters::{KINETIC, numbers};
use super::{Bounds, Factors, Law, LawSeries};
use crate::numerics::Number;
use crate::numerics::taylor::Unfolding;

/// mu(x) = mu_d at every speed: Coulomb's law. The breakaway coefficient may be larger.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coulomb {
    /// mu_d.
    pub kinetic: f64,
}

numbers!(Coulomb, "coulomb", at rest kinetic: kinetic = KINETIC);

impl Law for Coulomb {
    type Series<T: Number, const N: usize> = CoulombSeries<T>;

    #[inline]
    fn coefficient_and_slope(&self, _: f64) -> (f64, f64) {
        (self.kinetic, 0.0)
    }

    fn at_vanishing_speed(&self) -> f64 {
        self.kinetic
    }

    fn coefficient_bounds(&self, _: f64, _: f64) -> Bounds {
        Bounds::between(self.kinetic, self.kinetic)
    }

    fn series<T: Number, const N: usize>(&self) -> CoulombSeries<T> {
        CoulombSeries {
            kinetic: T::of(self.kinetic),
        }
    }
}

/// A constant without a shape.
#[derive(Debug, Clone)]
pub struct CoulombSeries<T> {
    kinetic: T,
}

impl<T: Number, const N: usize> LawSeries<T, N> for CoulombSeries<T> {
    fn factors(&self, of_coefficient: T, _: T) -> Factors<T> {
        Factors {
            constant: of_coefficient * self.kinetic,
            shape: T::of(0.0),
            slope: T::of(0.0),
        }
    }

    #[inline(always)]
    fn start(&mut self, _: T, _: T) {}

    #[inline(always)]
    fn extend(&mut self, _: usize, _: T, _: T) {}

    #[inline(always)]
    fn shapes(&self) -> Option<[&Unfolding<T, N>; 2]> {
        None
    }
}
