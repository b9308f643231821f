//! How fast the fast oscillations grow or decay in steady sliding.

use crate::model::equations::{Side, SystemEquations};
use crate::model::stability::fast_modes;
use nalgebra::Complex;

/// The largest real part among the fast eigenvalues of a slip whose friction adds `contact_damping` = r F_n mu' (N m s/rad) to the
/// contact, 1/s. Of the slip the eigenvalues depend on nothing else.
///
/// Two alike disks have it from their characteristic polynomial, where its root is known well enough to start from; else it comes
/// from all eigenvalues.
pub(crate) fn fast_growth_rate(system: &SystemEquations, contact_damping: f64) -> f64 {
    let by_polynomial = Disks::of(system).and_then(|disks| disks.relative_root(contact_damping));
    by_polynomial.unwrap_or_else(|| {
        let rates = fast_modes(system, contact_damping).into_iter().map(|mode| mode.re);
        rates.fold(f64::NEG_INFINITY, f64::max)
    })
}

/// Share of c_t that friction must have taken from the margin for the relative mode to be less damped than the other
/// one, whatever the rotor does to both: its share is J/I.
const APART: f64 = 0.1;

/// Rounds of Newton's method: six are usual.
const MOST_ROUNDS: usize = 20;

/// Two alike surfaces, each on one shaft: one to the ground, the other to a heavier inertia I that is free.
#[derive(Debug, Clone, Copy)]
struct Disks {
    /// I, kg m^2.
    rotor_inertia: f64,
    /// J, kg m^2.
    surface_inertia: f64,
    /// k_t, N m/rad.
    stiffness: f64,
    /// c_t, N m s/rad.
    damping: f64,
}

impl Disks {
    fn of(system: &SystemEquations) -> Option<Disks> {
        let (free, tied) = match (system.rotor.speed, system.stator.speed) {
            (Some(_), None) => (&system.rotor, &system.stator),
            (None, Some(_)) => (&system.stator, &system.rotor),
            _ => return None,
        };
        let &[surface_inertia, rotor_inertia] = &free.inertia[..] else {
            return None;
        };
        let undamped = |side: &Side| side.viscous.iter().all(|viscous| *viscous == 0.0);
        let alike = tied.inertia[..] == [surface_inertia]
            && free.stiffness == tied.stiffness
            && free.damping == tied.damping
            && undamped(free)
            && undamped(tied);
        (alike && rotor_inertia > surface_inertia).then(|| Disks {
            rotor_inertia,
            surface_inertia,
            stiffness: free.stiffness[0],
            damping: free.damping[0],
        })
    }

    /// The real part of the fast root that belongs to the relative mode, 1/s; `None` where another may be larger, or Newton's method
    /// does not settle.
    ///
    /// With h = -r F_n mu' a root satisfies
    /// J lambda D_u D_v = h ((lambda^2 + (k_t + c_t lambda)/I) D_v + lambda^2 D_u), where
    /// D_v = lambda^2 + (k_t + c_t lambda)/J and D_u = D_v + (k_t + c_t lambda)/I. With the rotor at rest the roots are those
    /// of J lambda^2 + (c_t - 2 h) lambda + k_t.
    fn relative_root(&self, contact_damping: f64) -> Option<f64> {
        let Disks {
            rotor_inertia: i,
            surface_inertia: j,
            stiffness,
            damping,
        } = *self;
        let slope = -contact_damping;
        let margin = damping - 2.0 * slope;
        // Where the other mode is overdamped its slower root is the larger one while the relative mode is stable.
        let overdamped = damping * damping > 2.0 * stiffness * j;
        if slope <= APART * damping || (margin > 0.0 && overdamped) {
            return None;
        }
        let (mean, omega) = (-0.5 * margin / j, (stiffness / j).sqrt());
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, CaseSource, Override};
    use crate::friction::Law;

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
                let changes = [set("friction.decay", decay), set("torsion.damping", damping)];
                let case = Case::read(&source, &changes).unwrap();
                let system = SystemEquations::new(&case.system);
                let disks = Disks::of(&system).unwrap();
                let omega = (disks.stiffness / disks.surface_inertia).sqrt();
                for step in 0..60 {
                    let x = 0.1 * f64::from(step) / decay;
                    let kappa = system.radius * 2225.0 * system.law.coefficient_and_slope(x).1;
                    let all = fast_modes(&system, kappa).into_iter().map(|mode| mode.re);
                    let expected = all.fold(f64::NEG_INFINITY, f64::max);
                    let found = fast_growth_rate(&system, kappa);
                    by_polynomial += u32::from(disks.relative_root(kappa).is_some());
                    let scale = omega.max((damping + 2.0 * kappa).abs() / disks.surface_inertia);
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
