//! Friction with another constant coefficient for each sense of sliding.

use super::coulomb::CoulombSeries;
use super::parameters::{KINETIC, LawParameter, numbers};
use super::{Backward, Bounds, Coulomb, Law};
use crate::numerics::Number;

/// mu(x) = mu_d in forward and mu_d- in backward sliding, with a breakaway coefficient for each: of a surface with a
/// grain, such as brushes, fabrics and scales.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asymmetric {
    /// mu_d, for omega_r > 0.
    pub kinetic: f64,
    /// mu_d-, for omega_r < 0.
    pub kinetic_backward: f64,
    /// mu_0-, at which a stick breaks away into omega_r < 0.
    pub breakaway_backward: f64,
}

numbers!(Asymmetric, "asymmetric", at rest kinetic:
    kinetic = KINETIC,
    kinetic_backward = LawParameter::coefficient(
        "mu_d-, friction coefficient in backward sliding, omega_r < 0; kinetic is then that in forward sliding"),
    breakaway_backward = LawParameter::coefficient(
        "mu_0-, friction coefficient at rest against backward sliding; breakaway is then that against forward sliding");
    complaints |law| law.weak_breakaway());

impl Asymmetric {
    fn forward(&self) -> Coulomb {
        Coulomb { kinetic: self.kinetic }
    }

    fn weak_breakaway(&self) -> Vec<(String, String)> {
        let (breakaway, sliding) = (self.breakaway_backward, self.kinetic_backward);
        if breakaway < sliding {
            let message = format!(
                "must be at least friction.kinetic_backward: {breakaway:?} is below {sliding:?}, and between the two torques \
                 neither stick nor slip is consistent; raise breakaway_backward or lower kinetic_backward"
            );
            return vec![("breakaway_backward".to_owned(), message)];
        }
        Vec::new()
    }
}

impl Law for Asymmetric {
    type Series<T: Number, const N: usize> = CoulombSeries<T>;

    fn coefficient_and_slope(&self, x: f64) -> (f64, f64) {
        self.forward().coefficient_and_slope(x)
    }

    fn at_vanishing_speed(&self) -> f64 {
        self.kinetic
    }

    fn backward(&self) -> Option<Backward> {
        Some(Backward {
            law: Coulomb {
                kinetic: self.kinetic_backward,
            }
            .into(),
            breakaway: self.breakaway_backward,
        })
    }

    fn coefficient_bounds(&self, _: f64, _: f64) -> Bounds {
        Bounds::between(self.kinetic, self.kinetic_backward)
    }

    fn series<T: Number, const N: usize>(&self) -> CoulombSeries<T> {
        Law::series::<T, N>(&self.forward())
    }
}
