//! The model against closed forms, differences and balances.

use crate::common::cases::built_in;
use crate::common::systems::ramp;
use nalgebra::DMatrix;
use proptest::prelude::*;
use stickslip::model::axial::{AxialMotion, ChangeCause};
use stickslip::model::contact::{uniform_pressure_radius, uniform_wear_radius};
use stickslip::model::equations::{Outside, SystemEquations};
use stickslip::model::{Axial, Mode};
use stickslip::signal::{Signal, TimeTable};

const AXIAL: Axial = Axial {
    mass: 4.54,
    stiffness: 55.38e6,
    damping: 8760.0,
    ringing_floor: Axial::RINGING_FLOOR,
};

/// The paper's disks.
fn system(changes: &[&str]) -> SystemEquations {
    SystemEquations::new(&built_in("paper-si", changes).system)
}

/// Equations (6) and (7) for D = 0.13, d = 0.08: r = 0.0525 and 0.0532539682...
#[test]
fn analytic_effective_radii() {
    assert!((uniform_wear_radius(0.13_f64, 0.08) - 0.0525).abs() < 1e-17);
    let direct = (0.13f64.powi(3) - 0.08f64.powi(3)) / (3.0 * (0.13f64.powi(2) - 0.08f64.powi(2)));
    assert!((uniform_pressure_radius(0.13, 0.08) - direct).abs() < 1e-15);
    // a ring without width
    assert!((uniform_pressure_radius(0.1_f64, 0.1) - 0.05).abs() < 1e-17);
}

fn tables() -> impl Strategy<Value = Signal> {
    prop::collection::vec((0.001..0.05f64, -500.0..3000.0f64, any::<bool>()), 1..6).prop_map(|rows| {
        let (mut time, mut force) = (Vec::new(), Vec::new());
        let mut t = 0.0;
        for (dt, f, steps) in rows {
            t += dt;
            time.push(t);
            force.push(f);
            if steps {
                time.push(t);
                force.push(900.0 - f);
            }
        }
        Signal::TimeTable(TimeTable { time, value: force })
    })
}

/// On a ramp the contact stays closed, as above. If each search needs more steps than it may take, the search
/// continues, and finds nothing.
#[test]
fn property_a_search_for_contact_changes_has_an_end() {
    let stiff = Axial {
        stiffness: 4e26,
        damping: 0.0,
        ..AXIAL
    };
    let actuation = ramp(2225.0, 1.0);
    let motion = AxialMotion::new(&stiff, &actuation);
    let (mut t, mut departing, mut searches) = (0.0, true, 0);
    while let Some(next) = motion.next_contact_change(t, true, departing, 0.5) {
        assert_eq!(next.cause, ChangeCause::Searched);
        assert!(next.time > t && !next.departs() && !next.at_corner());
        (t, departing, searches) = (next.time, false, searches + 1);
    }
    // sqrt(2 omega t) steps, by t'(n) = sqrt(2 t/omega)
    assert!((1..10).contains(&searches), "{searches}");
}

proptest! {
    /// m z'' + c z' + k z = -F by central differences of the closed form, in every damping regime.
    #[test]
    fn property_axial_motion_satisfies_its_equation(
        actuation in tables(), damping in 0.0..60_000.0f64, t in 0.0001..0.2f64,
    ) {
        let axial = Axial { damping, ..AXIAL };
        let motion = AxialMotion::new(&axial, &actuation);
        let h = 1e-7;
        prop_assume!(motion.force.next_corner(t - 2.0 * h).is_none_or(|c| c > t + 2.0 * h));
        let (before, here, after) = (motion.at(t - h), motion.at(t), motion.at(t + h));
        let velocity = (after.displacement - before.displacement) / (2.0 * h);
        // Difference error h^2/6 * omega^2 * v, plus the rounding of z over h.
        prop_assert!((velocity - here.velocity).abs() < 1e-6 * (0.2 + here.velocity.abs()));
        let acceleration = (after.velocity - before.velocity) / (2.0 * h);
        let residual = axial.mass * acceleration + here.force - here.pressing_force;
        prop_assert!(residual.abs() < 1e-3 * (3000.0 + here.force.abs()), "{residual}");
        let pressing = -axial.damping * here.velocity - axial.stiffness * here.displacement;
        prop_assert!((pressing - here.pressing_force).abs() < 1e-8 * (3000.0 + pressing.abs()));
        let slope = (after.pressing_force - before.pressing_force) / (2.0 * h);
        prop_assert!((slope - here.pressing_rate).abs() < 1e-4 * (1e6 + slope.abs()));
    }

    /// Kinetic + elastic + dissipated - work = 0 from rest; each term has its own closed form.
    #[test]
    fn property_axial_energy_balances(
        actuation in tables(), damping in 0.0..60_000.0f64, t in 0.0..0.5f64,
    ) {
        let axial = Axial { damping, ..AXIAL };
        let s = AxialMotion::new(&axial, &actuation).at(t);
        let stored = 0.5 * (axial.mass * s.velocity.powi(2) + axial.stiffness * s.displacement.powi(2));
        prop_assert!((stored + s.dissipated - s.work).abs() < 1e-12);
        prop_assert!(s.dissipated > -1e-14);
    }

    /// The zeros of the pressing force are those that dense sampling finds; none is missed.
    #[test]
    fn property_contact_changes_are_all_found(actuation in tables(), damping in 0.0..20_000.0f64) {
        let motion = AxialMotion::new(&Axial { damping, ..AXIAL }, &actuation);
        let (end, n) = (0.3, 60_000);
        let mut sampled = Vec::new();
        // The last time with a clear sign of the force: a slow force changes its sign long before the new sign is
        // clear.
        let mut clear = 0.0;
        let mut closed = motion.force.starts_positive();
        let started_closed = closed;
        for k in 1..=n {
            let t = end * k as f64 / n as f64;
            let force = motion.pressing_force(t);
            // A sign that depends on rounding or on the ringing floor is no change.
            if force.abs() > 1.0 {
                if (force > 0.0) != closed {
                    closed = force > 0.0;
                    sampled.push((clear, t));
                }
                clear = t;
            }
        }
        let mut found = Vec::new();
        let (mut t, mut closed) = (0.0, started_closed);
        let mut departing = true;
        while let Some(next) = motion.next_contact_change(t, closed, departing, end) {
            prop_assert!(next.time >= t);
            found.push(next.time);
            (t, closed, departing) = (next.time, !closed, next.departs());
            prop_assert!(found.len() < 10_000);
        }
        for (from, to) in sampled {
            prop_assert!(found.iter().any(|f| (from..=to).contains(f)), "none of {found:?} from {from} to {to}");
        }
        for f in &found {
            prop_assert!(motion.pressing_force(*f).abs() < 1e-5, "{f}: {}", motion.pressing_force(*f));
        }
    }

    /// On a rising ramp the contact force is slope (t - (the ringing, of |rate| < 1)) > 0. Contact starts at t = 0,
    /// with a force and a rate of zero up to rounding, and stays.
    #[test]
    fn property_contact_that_starts_with_a_ramp_stays(
        force in 100.0..5000.0f64, rise_time in 0.01..2.0f64, damping in 0.0..60_000.0f64,
    ) {
        let actuation = ramp(force, rise_time);
        let motion = AxialMotion::new(&Axial { damping, ..AXIAL }, &actuation);
        prop_assert!(motion.force.starts_positive());
        prop_assert_eq!(motion.next_contact_change(0.0, true, true, rise_time), None);
    }

    /// Analytic Jacobians against central differences, in all modes and senses.
    #[test]
    fn property_jacobians_match_differences(
        y in prop::array::uniform5(-1.0..1.0f64), force in 0.0..3000.0f64, mode in 0..4usize, decay in 0.0..10.0f64,
    ) {
        let system = system(&[&format!("friction.decay={decay:?}")]);
        let (n, mechanical, mode) = (system.dimension, system.mechanical(), Mode::ALL[mode]);
        let outside = Outside { normal_force: force, ..Outside::default() };
        // u, u', theta', v, v'
        let scale = [1e-5, 0.2, 0.5, 1e-5, 0.2];
        let y: Vec<f64> = (0..n).map(|k| if k < mechanical { y[k] * scale[k] } else { 0.0 }).collect();
        let sense = f64::from(mode.sense());
        let rhs = |y: &[f64]| {
            let mut rates = vec![0.0; n];
            system.rates(mode, sense, 0, &outside, y, &mut rates);
            rates
        };
        let mut jacobian = DMatrix::zeros(n, n);
        system.jacobian(mode, sense, 0, &outside, &y, &mut jacobian.as_view_mut());
        for column in 0..mechanical {
            let h = 1e-6 * scale[column];
            let (mut up, mut down) = (y.clone(), y.clone());
            up[column] += h;
            down[column] -= h;
            let (up, down) = (rhs(&up), rhs(&down));
            for row in 0..=system.slip {
                let difference = (up[row] - down[row]) / (2.0 * h);
                let exact = jacobian[(row, column)];
                // rounding of torques of 80 N m over J, divided by h
                let noise = 1e-13 * (80.0 / system.rotor.surface_inertia()) / h;
                prop_assert!((difference - exact).abs() < 1e-6 * exact.abs() + noise, "({row}, {column})");
            }
        }
    }

    /// A kick and a joining of the surfaces keep the momenta that they must keep.
    #[test]
    fn property_jumps_keep_momentum(y in prop::array::uniform5(-1.0..1.0f64), delta in -1.0..1.0f64) {
        let system = system(&[]);
        let outside = Outside::default();
        let mut state = vec![0.0; system.dimension];
        state[..5].copy_from_slice(&y);
        let speeds = |y: &[f64]| {
            let [rotor, stator] = [&system.rotor, &system.stator].map(|side| side.speeds(&outside.rotor, y));
            (rotor[1], stator[0], rotor[0])
        };
        let (theta, phi1, phi2) = speeds(&state);
        let mut kicked = state.clone();
        let (rotor, stator) = system.shares();
        system.push(rotor * delta, -stator * delta, &mut kicked);
        let (theta_k, phi1_k, phi2_k) = speeds(&kicked);
        prop_assert!((theta_k - theta).abs() < 1e-15);
        prop_assert!((phi2_k - phi2 - delta / 2.0).abs() < 1e-15 && (phi1_k - phi1 + delta / 2.0).abs() < 1e-15);
        let mut joined = state.clone();
        system.join(&outside, &mut joined);
        let (theta_j, phi1_j, phi2_j) = speeds(&joined);
        prop_assert!((theta_j - theta).abs() < 1e-15);
        prop_assert!((phi1_j + phi2_j - phi1 - phi2).abs() < 1e-15 && (phi1_j - phi2_j).abs() < 1e-15);
    }
}
