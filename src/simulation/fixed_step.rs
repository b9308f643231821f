//! How long the fixed steps of an explicit method may be.

use crate::model::Torsion;
use crate::sundials::{Coefficients, ErkTable};
use nalgebra::Complex;

/// A step by which the mode grows by less than this is stable: on the imaginary axis, without damping, methods of some
/// orders grow by rounding-like amounts at any step.
const GROWTH: f64 = 1e-6;

/// The longest step |h lambda| that is looked at; no explicit method with 16 stages reaches it.
const FARTHEST: f64 = 40.0;

/// Steps of the search.
const RESOLUTION: usize = 4000;

/// The longest step (s) with which the method follows the torsional oscillations of both disks without making them grow:
/// |R(h lambda)| <= 1 for the eigenvalues lambda of J x'' + c_t x' + k_t x = 0, and of the same with the rotor's inertia.
/// Friction is left out: where it makes the oscillation grow, a method has to follow that.
pub(crate) fn longest_stable_step(table: ErkTable, torsion: &Torsion) -> f64 {
    let coefficients = table.coefficients();
    let stator = 1.0 / torsion.surface_inertia;
    [stator, stator + 1.0 / torsion.rotor_inertia]
        .into_iter()
        .flat_map(|inverse| roots(torsion.damping * inverse, torsion.stiffness * inverse))
        .map(|root| limit(&coefficients, root))
        .fold(f64::INFINITY, f64::min)
}

/// Both roots of x^2 + p x + q.
fn roots(p: f64, q: f64) -> [Complex<f64>; 2] {
    let root = Complex::new(0.25 * p * p - q, 0.0).sqrt();
    [-0.5 * p - root, -0.5 * p + root]
}

fn limit(coefficients: &Coefficients, root: Complex<f64>) -> f64 {
    let size = root.norm();
    if size == 0.0 {
        return f64::INFINITY;
    }
    let grows = |z: f64| coefficients.stability_function(root / size * z).norm() > 1.0 + GROWTH;
    let step = FARTHEST / RESOLUTION as f64;
    let Some(first) = (1..=RESOLUTION).map(|k| k as f64 * step).find(|&z| grows(z)) else {
        return FARTHEST / size;
    };
    let (mut low, mut high) = (first - step, first);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if grows(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    low / size
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mode so heavily damped that both roots are real: the stability intervals of the literature are 2 for the methods
    /// of order 2 with two stages, 2.51 for order 3 with three, and 3.31 for Dormand-Prince
    /// (Hairer, Norsett, Wanner: Solving Ordinary Differential Equations II, IV.2).
    #[test]
    fn published_stability_on_the_real_axis() {
        let torsion = Torsion {
            rotor_inertia: 1e9,
            surface_inertia: 1.0,
            stiffness: 1e-3,
            damping: 1.0,
        };
        for (table, length) in [
            (ErkTable::HeunEuler2s12, 2.0),
            (ErkTable::ShuOsher3s23, 2.513),
            (ErkTable::BogackiShampine4s23, 2.513),
            (ErkTable::DormandPrince7s45, 3.307),
        ] {
            let step = longest_stable_step(table, &torsion);
            // The root is -0.999, and the published digits are four.
            assert!((step * 0.999 - length).abs() < 2e-3, "{table}: {step}");
        }
    }
}
