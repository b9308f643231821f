//! How fast the fast oscillation grows or decays in steady sliding.

use super::eigenvalues::leading_block;
use crate::model::Torsion;
use crate::model::axial::AxialMotion;
use crate::model::state::DYNAMIC;
use crate::model::torsion::TorsionModel;
use crate::numerics::eigenvalues::eigenvalues;
use nalgebra::Complex;

/// The largest real part among the fast eigenvalues of the slip state's Jacobian at `t` and |omega_r| = `x`, 1/s.
///
/// From the characteristic polynomial where its root is known well enough to start from, else from all eigenvalues.
pub(crate) fn fast_growth_rate(torsion: &TorsionModel, axial: &AxialMotion, sense: f64, t: f64, x: f64) -> f64 {
    let force = axial.pressing_force(t).max(0.0);
    relative_root(torsion, torsion.stability_margin(1.0, x, force)).unwrap_or_else(|| {
        let eigenvalues = fast_eigenvalues(torsion, axial, sense, t, x);
        eigenvalues.iter().map(|l| l.re).fold(f64::NEG_INFINITY, f64::max)
    })
}

/// Share of c_t that friction must have taken from the margin for the relative mode to be less damped than the other
/// one, whatever the rotor does to both: its share is J/I.
const APART: f64 = 0.1;

/// Rounds of Newton's method: six are usual.
const MOST_ROUNDS: usize = 20;

/// The real part of the fast root that belongs to the relative mode, 1/s, for a stability margin of steady sliding
/// (N m s/rad); `None` where another may be larger, or Newton's method does not settle.
///
/// With h = (c_t - margin)/2, the slope of the friction torque, a root satisfies
/// J lambda D_u D_v = h ((lambda^2 + (k_t + c_t lambda)/I) D_v + lambda^2 D_u), where
/// D_v = lambda^2 + (k_t + c_t lambda)/J and D_u = D_v + (k_t + c_t lambda)/I. With the rotor at rest the roots are those
/// of J lambda^2 + margin lambda + k_t.
fn relative_root(torsion: &TorsionModel, margin: f64) -> Option<f64> {
    let Torsion {
        rotor_inertia: i,
        surface_inertia: j,
        stiffness,
        damping,
    } = torsion.torsion;
    let slope = 0.5 * (damping - margin);
    // Where the other mode is overdamped its slower root is the larger one while the relative mode is stable.
    let overdamped = damping * damping > 2.0 * stiffness * j;
    if slope <= APART * damping || i <= j || (margin > 0.0 && overdamped) {
        return None;
    }
    let (mean, omega) = (-0.5 * margin / j, torsion.natural_angular_frequency());
    let split = mean * mean - omega * omega;
    let mut root = match split {
        s if s < 0.0 => Complex::new(mean, (-s).sqrt()),
        // Two real roots: without growth the slower one decides, and the other mode's may be slower still.
        s if mean > 0.0 => Complex::new(mean + s.sqrt(), 0.0),
        _ => return None,
    };
    for _ in 0..MOST_ROUNDS {
        let square = root * root;
        let spring = root * damping + stiffness;
        let (d_v, d_u) = (square + spring / j, square + spring * (1.0 / i + 1.0 / j));
        let (d_v_rate, d_u_rate) = (root * 2.0 + damping / j, root * 2.0 + damping * (1.0 / i + 1.0 / j));
        let (driven, driven_rate) = (square + spring / i, root * 2.0 + damping / i);
        let value = root * d_u * d_v * j - (driven * d_v + square * d_u) * slope;
        let rate = (d_u * d_v + root * (d_u_rate * d_v + d_u * d_v_rate)) * j
            - (driven_rate * d_v + driven * d_v_rate + root * 2.0 * d_u + square * d_u_rate) * slope;
        let change = value / rate;
        root -= change;
        if change.norm() <= 1e-13 * root.norm() {
            return Some(root.re);
        }
    }
    None
}

/// The eigenvalues of the slip state's Jacobian but the slow root of the rotor, 1/s. Of the state the Jacobian depends
/// on the relative velocity alone.
pub(crate) fn fast_eigenvalues(
    torsion: &TorsionModel,
    axial: &AxialMotion,
    sense: f64,
    t: f64,
    x: f64,
) -> Vec<Complex<f64>> {
    let jacobian = torsion.sliding_jacobian(sense, axial.pressing_force(t).max(0.0), x);
    let mut eigenvalues = eigenvalues(&leading_block(&jacobian, DYNAMIC, torsion));
    eigenvalues.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
    eigenvalues.truncate(DYNAMIC - 1);
    eigenvalues
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, CaseSource, Override};
    use crate::model::Parameters;

    /// The polynomial's root against the eigenvalues of the matrix, over the plane of the critical curve and all speeds at
    /// which friction takes something from the margin. Both round at 1e-14 of omega_n; near a double root by its square
    /// root.
    #[test]
    fn analytic_the_growth_rate_is_that_of_all_eigenvalues() {
        let source = CaseSource::built_in("paper").unwrap();
        let mut by_polynomial = 0;
        for decay in [0.1, 1.0, 5.0, 40.0, 200.0, 600.0] {
            for damping in [0.0, 2.0, 20.0, 300.0, 3000.0] {
                let set = |key: &str, value: f64| Override::parse(&format!("{key}={value}")).unwrap();
                let case = Case::parse(
                    &source,
                    &[set("friction.decay", decay), set("torsion.damping", damping)],
                )
                .unwrap();
                let disks = Parameters::of(&case.system).unwrap();
                let torsion = TorsionModel::new(&disks);
                let axial = disks.axial_motion();
                let omega = torsion.natural_angular_frequency();
                for step in 0..60 {
                    let x = 0.1 * f64::from(step) / decay;
                    let margin = torsion.stability_margin(1.0, x, axial.pressing_force(5.0));
                    let all = fast_eigenvalues(&torsion, &axial, 1.0, 5.0, x);
                    let expected = all.iter().map(|l| l.re).fold(f64::NEG_INFINITY, f64::max);
                    let found = fast_growth_rate(&torsion, &axial, 1.0, 5.0, x);
                    by_polynomial += u32::from(relative_root(&torsion, margin).is_some());
                    let scale = omega.max(margin.abs() / torsion.torsion.surface_inertia);
                    assert!(
                        (found - expected).abs() < 1e-7 * scale,
                        "{decay} {damping} {x}: {found} {expected}"
                    );
                }
            }
        }
        assert!(by_polynomial > 1000, "{by_polynomial}");
    }
}
