//! Longest fixed steps of an explicit method.

use crate::sundials::{Coefficients, ErkTable};
use nalgebra::Complex;
use stickslip_system::model::Torsion;

/// Growth per step that still counts as stable: on the imaginary axis, without damping, methods of some orders grow
/// slightly at any step.
const GROWTH: f64 = 1e-6;

/// Longest step |h lambda| of the search; no explicit method with 16 stages reaches it.
const FARTHEST: f64 = 40.0;

const RESOLUTION: usize = 4000;

/// Longest step (s) for which the torsional oscillations of both disks do not grow: |R(h lambda)| <= 1 for the
/// eigenvalues lambda of J x'' + c_t x' + k_t x = 0, and with the rotor's inertia. Friction is left out: growth by
/// friction is physical.
pub fn longest_stable_step(table: ErkTable, torsion: &Torsion) -> f64 {
    let coefficients = table.coefficients();
    let stator = 1.0 / torsion.surface_inertia;
    [stator, stator + 1.0 / torsion.rotor_inertia]
        .into_iter()
        .flat_map(|inverse| roots(torsion.damping * inverse, torsion.stiffness * inverse))
        .map(|root| limit(&coefficients, root))
        .fold(f64::INFINITY, f64::min)
}

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
