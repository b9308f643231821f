//! Growth rate of the fast oscillations in steady sliding.

use nalgebra::Complex;
use stickslip_system::model::equations::{Side, SystemEquations};
use stickslip_system::model::stability::fast_modes;

/// Largest real part of the fast eigenvalues of a slip, 1/s. Friction adds `contact_damping` = r F_n mu' (N m s/rad).
/// For two equal disks it comes from the characteristic polynomial, if a start value is known.
pub fn fast_growth_rate(system: &SystemEquations, contact_damping: f64) -> f64 {
    let by_polynomial = Disks::of(system).and_then(|disks| disks.relative_root(contact_damping));
    by_polynomial.unwrap_or_else(|| {
        let rates = fast_modes(system, contact_damping).into_iter().map(|mode| mode.re);
        rates.fold(f64::NEG_INFINITY, f64::max)
    })
}

/// Fraction of c_t that friction must remove to make the relative mode the less damped; rotor: order J/I.
const APART: f64 = 0.1;

/// Newton iterations; six are usual.
const MOST_ROUNDS: usize = 20;

/// Two equal surfaces, each on one shaft: one to the ground, the other to a heavier free inertia I.
#[derive(Debug, Clone, Copy)]
pub struct Disks {
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
    /// Disks of a system; `None` for another system.
    pub fn of(system: &SystemEquations) -> Option<Disks> {
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

    /// Real part of the relative mode's fast root, 1/s; `None` if another root may be larger, or if Newton's method
    /// diverges. With h = -r F_n mu' a root satisfies J lambda D_u D_v = h ((lambda^2 + (k_t + c_t lambda)/I) D_v +
    /// lambda^2 D_u), where D_v = lambda^2 + (k_t + c_t lambda)/J and D_u = D_v + (k_t + c_t lambda)/I. With the rotor
    /// at rest the roots are those of J lambda^2 + (c_t - 2 h) lambda + k_t.
    pub fn relative_root(&self, contact_damping: f64) -> Option<f64> {
        let Disks {
            rotor_inertia: i,
            surface_inertia: j,
            stiffness,
            damping,
        } = *self;
        let slope = -contact_damping;
        let margin = damping - 2.0 * slope;
        // An overdamped other mode has the larger root while the relative mode is stable.
        let overdamped = damping * damping > 2.0 * stiffness * j;
        if slope <= APART * damping || (margin > 0.0 && overdamped) {
            return None;
        }
        let (mean, omega) = (-0.5 * margin / j, (stiffness / j).sqrt());
        let split = mean * mean - omega * omega;
        let mut root = match split {
            s if s < 0.0 => Complex::new(mean, (-s).sqrt()),
            // Two real roots: without growth the slower root decides, and the other mode may have a still slower one.
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
