//! What the linear part of the torsional system is written as, against M q'' + C q' + K q = -b T with q = (theta, phi_2,
//! phi_1): rates, Jacobians, energies and momentum.

use nalgebra::{DMatrix, SVector, Vector3};
use proptest::prelude::*;
use stickslip::model::Torsion;
use stickslip::model::linear_part::{Matrices, relative_velocity, speeds};
use stickslip::model::state::{Components, DYNAMIC, TorsionState};

/// Every entry is a sum of two or three products and quotients.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

fn torsions() -> impl Strategy<Value = Torsion> {
    let number = || (-2.0..2.0f64).prop_map(|exponent| 10f64.powf(exponent));
    (number(), number(), number(), prop_oneof![number(), Just(0.0)]).prop_map(
        |(rotor_inertia, surface_inertia, stiffness, damping)| Torsion {
            rotor_inertia,
            surface_inertia,
            stiffness,
            damping,
        },
    )
}

/// q and q' of a state; theta is taken as zero, and only twists count.
fn angles(y: &Components) -> (Vector3<f64>, Vector3<f64>) {
    let twists = Vector3::new(0.0, -y.rotor_twist, y.stator_twist);
    (twists, Vector3::from(speeds(&y.state())))
}

/// q'' with the torque `t_i` through the interface, or, if `joined`, with that which keeps omega_r as it is.
fn accelerations(m: &Matrices, y: &Components, joined: bool, t_i: f64) -> Vector3<f64> {
    let (q, q_dot) = angles(y);
    let inverse = m.inertia.try_inverse().unwrap();
    let free = -inverse * (m.damping * q_dot + m.stiffness * q);
    let by_torque = -inverse * m.contact;
    let torque = if joined {
        -m.contact.dot(&free) / m.contact.dot(&by_torque)
    } else {
        t_i
    };
    free + by_torque * torque
}

fn states() -> impl Strategy<Value = Components> {
    prop::array::uniform5(-1.0..1.0f64).prop_map(|[u, u_dot, v, v_dot, speed]| Components {
        rotor_twist: u,
        rotor_twist_rate: u_dot,
        stator_twist: v,
        stator_twist_rate: v_dot,
        rotor_speed: speed,
        ..Components::default()
    })
}

/// A state in which both surfaces have one speed.
fn stuck(y: &Components) -> Components {
    Components {
        rotor_speed: y.rotor_twist_rate + y.stator_twist_rate,
        ..*y
    }
}

fn rates(torsion: &Torsion, joined: bool, t_i: f64, y: &TorsionState) -> TorsionState {
    let mut rates = TorsionState::default();
    if joined {
        torsion.joined_rates(y, &mut rates);
    } else {
        torsion.free_rates(t_i, y, &mut rates);
    }
    rates
}

proptest! {
    #[test]
    fn analytic_rates_are_those_of_the_matrices(
        torsion in torsions(), y in states(), t_i in -1.0..1.0f64, joined: bool,
    ) {
        let m = torsion.matrices();
        let y = if joined { stuck(&y) } else { y };
        let q_ddot = accelerations(&m, &y, joined, t_i);
        let found = Components::of(&rates(&torsion, joined, t_i, &y.state()));
        // Damping and stiffness up to 100, of states up to 2, over the least inertia.
        let least = torsion.rotor_inertia.min(torsion.surface_inertia);
        let close = |a: f64, b: f64| (a - b).abs() <= ROUNDING * (2.0 * (torsion.stiffness + torsion.damping) + 1.0) * 2.0 / least;
        prop_assert!(close(found.rotor_speed, q_ddot[0]));
        prop_assert!(close(found.rotor_twist_rate, q_ddot[0] - q_ddot[1]));
        prop_assert!(close(found.stator_twist_rate, q_ddot[2]));
        prop_assert_eq!((found.rotor_twist, found.stator_twist), (y.rotor_twist_rate, y.stator_twist_rate));
        // omega_r = b . q', and stick keeps it.
        let w = m.contact.dot(&angles(&y).1);
        prop_assert!((relative_velocity(&y.state()) - w).abs() <= ROUNDING);
        let slip = if joined { 0.0 } else { relative_velocity(&y.state()) };
        prop_assert_eq!(found.slip, slip);
        if joined {
            prop_assert!(close(relative_velocity(&found.state()), 0.0));
        }
    }

    /// The rates are linear in the state, but for the losses: the Jacobian has them column by column.
    #[test]
    fn analytic_jacobians_have_the_rates_of_unit_states(torsion in torsions(), slope in -1.0..1.0f64, joined: bool) {
        let mut jacobian = DMatrix::zeros(8, 8);
        torsion.jacobian(joined, slope, &TorsionState::default(), &mut jacobian.as_view_mut());
        for column in 0..DYNAMIC {
            let mut unit = TorsionState::default();
            unit[column] = 1.0;
            let expected = rates(&torsion, joined, slope * relative_velocity(&unit), &unit);
            for row in 0..=DYNAMIC {
                let entry = jacobian[(row, column)];
                let terms = (torsion.stiffness + torsion.damping + 1.0) * 2.0
                    / torsion.rotor_inertia.min(torsion.surface_inertia);
                prop_assert!((entry - expected[row]).abs() <= ROUNDING * terms, "{row} {column}");
            }
        }
    }

    #[test]
    fn analytic_energies_and_momentum_are_those_of_the_matrices(torsion in torsions(), y in states()) {
        let (m, state) = (torsion.matrices(), y.state());
        let (q, q_dot) = angles(&y);
        let near = |found: f64, expected: f64, size: f64| (found - expected).abs() <= ROUNDING * size;
        let inertia = torsion.rotor_inertia + torsion.surface_inertia;
        prop_assert!(near(torsion.kinetic_energy(&state), 0.5 * q_dot.dot(&(m.inertia * q_dot)), 8.0 * inertia));
        prop_assert!(near(torsion.elastic_energy(&state), 0.5 * q.dot(&(m.stiffness * q)), 4.0 * torsion.stiffness));
        prop_assert!(near(torsion.damping_power(&state), q_dot.dot(&(m.damping * q_dot)), 16.0 * torsion.damping));
        // Of rotor and rotor surface as one: a motion in which their shaft is stiff.
        let rigid = Vector3::new(1.0, 1.0, 0.0);
        let momentum = rigid.dot(&(m.inertia * q_dot));
        prop_assert!(near(torsion.slow_momentum(&state), momentum, 4.0 * inertia));
        prop_assert_eq!(torsion.rigid_inertia(), rigid.dot(&(m.inertia * rigid)));
        let speed = torsion.speed_of_momentum(torsion.slow_momentum(&state), y.rotor_twist_rate);
        prop_assert!(near(speed, y.rotor_speed, 16.0));
        // Its rate is minus the torque through the interface, whatever the shafts do.
        let torque = 0.7;
        let change = torsion.slow_momentum(&rates(&torsion, false, torque, &state));
        let size = inertia * (torsion.stiffness + torsion.damping + 1.0) * 4.0
            / torsion.rotor_inertia.min(torsion.surface_inertia);
        prop_assert!(near(change, -torque, size));
    }

    /// The rate of what the damping takes, by a central difference along the motion: exact but for rounding, as it is of
    /// second degree.
    #[test]
    fn analytic_the_rate_of_the_damping_is_its_derivative(torsion in torsions(), y in states(), dy in states()) {
        let at = |share: f64| {
            let [y, dy] = [y, dy].map(|part| SVector::<f64, 8>::from(part.state()));
            torsion.damping_power((y + dy * share).as_slice())
        };
        let found = torsion.damping_power_rate(&y.state(), &dy.state());
        prop_assert!((found - (at(0.5) - at(-0.5))).abs() <= 16.0 * ROUNDING * torsion.damping);
    }
}
