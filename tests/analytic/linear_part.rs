//! The equations in twist coordinates against M q'' + C q' + K q = -b T in the angles q of all inertias: rates,
//! energies, losses, and the torque of a stick, for any two chains.

use crate::common::systems::{pair, train};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use stickslip::friction::Coulomb;
use stickslip::model::Mode;
use stickslip::model::equations::{DAMPING_LOSS, Driving, FRICTION_LOSS, Outside, Side, SystemEquations};
use stickslip::model::system::{End, Pressing, System, Train};
use stickslip::signal::Drive;

/// Every entry is a sum of a few products and quotients, for at most three inertias.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// mu r F_n, N m.
const FRICTION: f64 = 0.7;

fn chain() -> impl Strategy<Value = Train> {
    let number = || (-2.0..2.0f64).prop_map(|exponent| 10f64.powf(exponent));
    let numbers = move |count: usize| prop::collection::vec(number(), count);
    let maybe = move |count: usize| prop::collection::vec(prop_oneof![number(), Just(0.0)], count);
    (1..=3usize, any::<bool>()).prop_flat_map(move |(count, free)| {
        let shafts = count - usize::from(free);
        (numbers(count), numbers(shafts), maybe(shafts), maybe(count)).prop_map(
            move |(inertia, stiffness, damping, viscous)| {
                let end = if free { End::Free } else { End::Fixed };
                Train {
                    viscous,
                    ..train(&inertia, &stiffness, &damping, end)
                }
            },
        )
    })
}

fn system(rotor: &Train, stator: &Train) -> SystemEquations {
    let force = Pressing::Force(Drive::Value(1.0));
    let law = Coulomb { kinetic: FRICTION };
    SystemEquations::new(&System {
        radius: 0.1,
        ..pair(rotor.clone(), stator.clone(), force, law)
    })
}

/// M q'' + C q' + K q = -b T. The rotor's inertias come first, each train from its surface outwards.
struct Matrices {
    inertia: DMatrix<f64>,
    damping: DMatrix<f64>,
    stiffness: DMatrix<f64>,
    contact: DVector<f64>,
}

impl Matrices {
    fn new(rotor: &Train, stator: &Train) -> Matrices {
        let n = rotor.inertia.len() + stator.inertia.len();
        let mut matrices = Matrices {
            inertia: DMatrix::zeros(n, n),
            damping: DMatrix::zeros(n, n),
            stiffness: DMatrix::zeros(n, n),
            contact: DVector::zeros(n),
        };
        for (train, first, sign) in [(rotor, 0, 1.0), (stator, rotor.inertia.len(), -1.0)] {
            matrices.contact[first] = sign;
            for (i, inertia) in train.inertia.iter().enumerate() {
                matrices.inertia[(first + i, first + i)] = *inertia;
                matrices.damping[(first + i, first + i)] = train.viscous[i];
            }
            for i in 0..train.stiffness.len() {
                let mut shaft = DVector::zeros(n);
                shaft[first + i] = -1.0;
                if i + 1 < train.inertia.len() {
                    shaft[first + i + 1] = 1.0;
                }
                matrices.damping += &shaft * shaft.transpose() * train.damping[i];
                matrices.stiffness += &shaft * shaft.transpose() * train.stiffness[i];
            }
        }
        matrices
    }

    /// q'' under the torque `interface`; without one, under the torque that keeps omega_r constant. Returns this
    /// torque too.
    fn accelerations(&self, q: &DVector<f64>, q_dot: &DVector<f64>, interface: Option<f64>) -> (DVector<f64>, f64) {
        let inverse = self.inertia.clone().try_inverse().unwrap();
        let free = -&inverse * (&self.damping * q_dot + &self.stiffness * q);
        let by_torque = -inverse * &self.contact;
        let torque = interface.unwrap_or_else(|| -self.contact.dot(&free) / self.contact.dot(&by_torque));
        (free + by_torque * torque, torque)
    }
}

fn state(system: &SystemEquations, q: &DVector<f64>, q_dot: &DVector<f64>) -> Vec<f64> {
    let mut y = vec![0.0; system.dimension];
    let mut first = 0;
    for side in [&system.rotor, &system.stator] {
        let count = side.inertia.len();
        for i in 0..side.shafts() {
            let between = |q: &DVector<f64>| {
                let outer = if i + 1 < count { q[first + i + 1] } else { 0.0 };
                side.sign * (outer - q[first + i])
            };
            y[side.twists + 2 * i] = between(q);
            y[side.twists + 2 * i + 1] = between(q_dot);
        }
        if let Some(speed) = side.speed {
            y[speed] = q_dot[first + count - 1];
        }
        first += count;
    }
    y
}

fn close(found: f64, expected: f64, size: f64) -> bool {
    (found - expected).abs() <= ROUNDING * size
}

proptest! {
    #[test]
    fn analytic_rates_and_energies_are_those_of_the_matrices(
        rotor in chain(), stator in chain(),
        angles in prop::array::uniform6(-1.0..1.0f64), speeds in prop::array::uniform6(-1.0..1.0f64),
    ) {
        let (system, m) = (system(&rotor, &stator), Matrices::new(&rotor, &stator));
        let n = m.contact.len();
        let part = |values: [f64; 6]| DVector::from_iterator(n, values.into_iter().take(n));
        let (q, moving) = (part(angles), part(speeds));
        // Angles and speeds of size 1, and the torques of two shafts and a bearing on each inertia.
        let torques = 4.0 * (m.stiffness.amax() + m.damping.amax()) + 1.0;
        let inertias = m.inertia.diagonal();
        let size = 4.0 * torques / inertias.min();
        let outside = Outside { normal_force: 10.0, ..Outside::default() };
        let still = Driving::default();
        for mode in [Mode::Separated, Mode::SlipForward, Mode::SlipBackward, Mode::Stick] {
            let mut q_dot = moving.clone();
            if mode == Mode::Stick {
                q_dot[rotor.inertia.len()] = q_dot[0];
            }
            let w = m.contact.dot(&q_dot);
            let sense = f64::from(mode.sense());
            let interface = match mode {
                Mode::Stick => None,
                _ => Some(sense * FRICTION),
            };
            let y = state(&system, &q, &q_dot);
            let (expected, torque) = m.accelerations(&q, &q_dot, interface);
            let mut rates = vec![0.0; system.dimension];
            system.rates(mode, sense, 0, &outside, &y, &mut rates);
            // The rate of a speed is an acceleration.
            let of = |side: &Side| side.speeds(&still, &rates);
            let found = [of(&system.rotor), of(&system.stator)].concat();
            for (found, expected) in found.iter().zip(expected.iter()) {
                prop_assert!(close(*found, *expected, size), "{mode:?}: {found} for {expected}");
            }
            for side in [&system.rotor, &system.stator] {
                for i in 0..side.shafts() {
                    prop_assert_eq!(side.twist(i, &rates), side.twist_rate(i, &y));
                }
            }
            prop_assert!(close(system.relative_velocity(&outside, &y), w, 8.0));
            let slip = if mode == Mode::Stick { 0.0 } else { w };
            prop_assert!(close(rates[system.slip], slip, 8.0));
            let transmitted = system.transmitted_torque(&outside, &y);
            if mode == Mode::Stick {
                prop_assert!(close(transmitted, torque, 8.0 * torques));
            } else {
                prop_assert!(close(rates[system.slip + FRICTION_LOSS], torque * w, 8.0));
            }
            let lost = q_dot.dot(&(&m.damping * &q_dot));
            prop_assert!(close(rates[system.slip + DAMPING_LOSS], lost, 16.0 * m.damping.amax() + 1.0));
            let kinetic = 0.5 * q_dot.dot(&(&m.inertia * &q_dot));
            prop_assert!(close(system.kinetic_energy(&outside, &y), kinetic, 8.0 * inertias.max()));
            let elastic = 0.5 * q.dot(&(&m.stiffness * &q));
            prop_assert!(close(system.elastic_energy(&y), elastic, 16.0 * m.stiffness.amax()));
        }
    }

    /// The rates are linear in the state: the rates of unit states are the columns of the Jacobian.
    #[test]
    fn analytic_jacobians_have_the_rates_of_unit_states(rotor in chain(), stator in chain()) {
        let (system, m) = (system(&rotor, &stator), Matrices::new(&rotor, &stator));
        let (n, outside) = (system.dimension, Outside::default());
        // In a stick the entries are differences of such terms.
        let size = 4.0 * (m.stiffness.amax() + m.damping.amax()) / m.inertia.diagonal().min() + 1.0;
        for mode in [Mode::Separated, Mode::Stick] {
            let mut jacobian = DMatrix::zeros(n, n);
            system.jacobian(mode, 0.0, 0, &outside, &vec![0.0; n], &mut jacobian.as_view_mut());
            for column in 0..system.mechanical() {
                let (mut unit, mut rates) = (vec![0.0; n], vec![0.0; n]);
                unit[column] = 1.0;
                system.rates(mode, 0.0, 0, &outside, &unit, &mut rates);
                for row in 0..=system.slip {
                    prop_assert!(close(jacobian[(row, column)], rates[row], size), "{mode:?} ({row}, {column})");
                }
            }
        }
    }
}
