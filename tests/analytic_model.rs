//! The model against closed forms, differences and balances.

use nalgebra::DMatrix;
use proptest::prelude::*;
use stickslip::case::{Case, CaseSource};
use stickslip::friction::{Exponential, Friction};
use stickslip::model::axial::{AxialMotion, ChangeCause};
use stickslip::model::contact::{uniform_pressure_radius, uniform_wear_radius};
use stickslip::model::state::{Components, DIMENSION, index::*};
use stickslip::model::torsion::TorsionModel;
use stickslip::model::trains::Trains;
use stickslip::model::trains::system::{
    DAMPING_LOSS as LOST_IN_DAMPERS, FRICTION_LOSS as LOST_IN_FRICTION, Outside, TrainSystem,
};
use stickslip::model::{Axial, BreakawayTest, Contact, Mode, Parameters, Torsion};
use stickslip::signal::{Ramp, Signal, Table};

const AXIAL: Axial = Axial {
    mass: 4.54,
    stiffness: 55.38e6,
    damping: 8760.0,
    ringing_floor: Axial::RINGING_FLOOR,
};

fn model() -> TorsionModel {
    TorsionModel {
        torsion: Torsion {
            rotor_inertia: 2.262,
            surface_inertia: 0.0113,
            stiffness: 7.71e6,
            damping: 22.606,
        },
        contact: Contact {
            radius: 0.052388,
            breakaway_test: BreakawayTest::Transmitted,
        },
        friction: Friction {
            breakaway: 0.6,
            law: Exponential {
                low_speed: 0.6,
                high_speed: 0.3,
                decay: 3.5,
            }
            .into(),
        },
    }
}

/// Equation (6) and (7) for D = 0.13, d = 0.08: r = 0.0525 and 0.0532539682...
#[test]
fn analytic_effective_radii() {
    assert!((uniform_wear_radius(0.13_f64, 0.08) - 0.0525).abs() < 1e-17);
    let direct = (0.13f64.powi(3) - 0.08f64.powi(3)) / (3.0 * (0.13f64.powi(2) - 0.08f64.powi(2)));
    assert!((uniform_pressure_radius(0.13, 0.08) - direct).abs() < 1e-15);
    // a ring without width
    assert!((uniform_pressure_radius(0.1_f64, 0.1) - 0.05).abs() < 1e-17);
}

fn tables() -> impl Strategy<Value = Signal> {
    prop::collection::vec((0.001..0.05f64, -500.0..3000.0f64), 1..6).prop_map(|rows| {
        let mut t = 0.0;
        let (time, force) = rows
            .into_iter()
            .map(|(dt, f)| {
                t += dt;
                (t, f)
            })
            .unzip();
        Signal::Table(Table { time, value: force })
    })
}

/// On a ramp the contact stays, as above; where each search has more steps than it may take, it comes on and finds nothing.
#[test]
fn property_a_search_for_contact_changes_has_an_end() {
    let stiff = Axial {
        stiffness: 4e26,
        damping: 0.0,
        ..AXIAL
    };
    let actuation = Signal::Ramp(Ramp {
        value: 2225.0,
        rise_time: 1.0,
    });
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

/// A motion of the short form as a state of the general one.
fn general(system: &TrainSystem, y: &Components) -> Vec<f64> {
    let mut general = vec![0.0; system.dimension];
    let (rotor, stator) = (system.rotor.twists, system.stator.twists);
    (general[rotor], general[rotor + 1]) = (y.rotor_twist, y.rotor_twist_rate);
    (general[stator], general[stator + 1]) = (y.stator_twist, y.stator_twist_rate);
    general[system.rotor.speed.unwrap()] = y.rotor_speed;
    general[system.slip] = y.slip;
    general[system.slip + LOST_IN_FRICTION] = y.friction_loss;
    general[system.slip + LOST_IN_DAMPERS] = y.damping_loss;
    general
}

proptest! {
    /// In slip and separated both forms do the same operations on twists and speeds, and agree to the bit. T_f is halved in the
    /// one and weighted by inertias in the other, a stick gives both surfaces one acceleration in the one, and sums of energies
    /// have another order: there they agree to some roundings of their parts.
    #[test]
    fn property_the_short_form_has_the_equations_of_the_general_one(
        twists in prop::array::uniform2(-1e-4..1e-4f64),
        rates in prop::array::uniform2(-5.0..5.0f64),
        speed in -60.0..60.0f64,
        force in 0.0..3000.0f64,
    ) {
        let case = Case::read(&CaseSource::built_in("paper").unwrap(), &[]).unwrap();
        let parameters = Parameters::of(&case.system).unwrap();
        let (short, system) = (TorsionModel::new(&parameters), TrainSystem::new(&Trains::from(&parameters)));
        let outside = Outside { normal_force: force, ..Outside::default() };
        let motion = Components {
            rotor_twist: twists[0],
            rotor_twist_rate: rates[0],
            stator_twist: twists[1],
            stator_twist_rate: rates[1],
            rotor_speed: speed,
            ..Components::default()
        };
        let (y, z) = (motion.state(), general(&system, &motion));
        let close = |a: f64, b: f64, parts: f64| (a - b).abs() <= 8.0 * f64::EPSILON * parts.abs();
        let w = short.relative_velocity(&y);
        prop_assert_eq!(system.relative_velocity(&outside, &z), w);
        prop_assert_eq!(system.breakaway_torque(force), short.breakaway_torque(force));
        let torques = short.torsion.rotor_torque(&y).abs() + short.torsion.stator_torque(&y).abs();
        prop_assert!(close(system.transmitted_torque(&outside, &z), short.transmitted_torque(&y), torques));
        let energy = short.torsion.kinetic_energy(&y);
        prop_assert!(close(system.kinetic_energy(&outside, &z), energy, energy));
        let energy = short.torsion.elastic_energy(&y);
        prop_assert!(close(system.elastic_energy(&z), energy, energy));
        for mode in [Mode::sliding(w), Mode::Separated, Mode::Stick] {
            let (mut found, mut rates) = (vec![0.0; system.dimension], [0.0; DIMENSION]);
            system.rates(mode, f64::from(mode.sense()), 0, &outside, &z, &mut found);
            short.rates(mode, || force, &y, &mut rates);
            let expected = general(&system, &Components::of(&rates));
            let parts = torques / parameters.torsion.surface_inertia;
            for (k, (&found, &expected)) in found.iter().zip(&expected).enumerate() {
                let same = if k > system.slip || mode == Mode::Stick {
                    close(found, expected, expected.abs().max(parts))
                } else {
                    found == expected
                };
                prop_assert!(same, "{mode:?}, component {k}: {found:e} for {expected:e}");
            }
        }
    }
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

    /// Kinetic + elastic + dissipated - work = 0 from rest; each has its own closed form.
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

    /// The zeros of the pressing force are those that dense sampling sees, and none is missed.
    #[test]
    fn property_contact_changes_are_all_found(actuation in tables(), damping in 0.0..20_000.0f64) {
        let motion = AxialMotion::new(&Axial { damping, ..AXIAL }, &actuation);
        let (end, n) = (0.3, 60_000);
        let mut sampled = Vec::new();
        let mut closed = motion.force.starts_positive();
        let started_closed = closed;
        for k in 1..=n {
            let t = end * k as f64 / n as f64;
            let force = motion.pressing_force(t);
            // what rounding and the ringing floor leave open is no change
            if (force > 1.0) != closed && force.abs() > 1.0 {
                closed = force > 0.0;
                sampled.push(t);
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
        for s in sampled {
            prop_assert!(found.iter().any(|f| (f - s).abs() < 2e-3), "{s} not among {found:?}");
        }
        for f in &found {
            prop_assert!(motion.pressing_force(*f).abs() < 1e-5, "{f}: {}", motion.pressing_force(*f));
        }
    }

    /// On a rising ramp the contact force is slope (t - (the ringing, of |rate| < 1)) > 0: contact starts at t = 0, with a
    /// force and a rate of zero up to rounding, and stays.
    #[test]
    fn property_contact_that_starts_with_a_ramp_stays(
        force in 100.0..5000.0f64, rise_time in 0.01..2.0f64, damping in 0.0..60_000.0f64,
    ) {
        let actuation = Signal::Ramp(Ramp { value: force, rise_time });
        let motion = AxialMotion::new(&Axial { damping, ..AXIAL }, &actuation);
        prop_assert!(motion.force.starts_positive());
        prop_assert_eq!(motion.next_contact_change(0.0, true, true, rise_time), None);
    }

    /// Analytic Jacobians against central differences, in all modes and senses.
    #[test]
    fn property_jacobians_match_differences(
        y in prop::array::uniform8(-1.0..1.0f64), force in 0.0..3000.0f64, mode in 0..4usize, decay in 0.0..10.0f64,
    ) {
        let mut model = model();
        model.friction.law.set_number("decay", decay);
        let scale = [1e-5, 0.2, 1e-5, 0.2, 0.5, 1.0, 1.0, 1.0];
        let y: Vec<f64> = y.iter().zip(scale).map(|(a, b)| a * b).collect();
        let rhs = |y: &[f64]| {
            model.rates_at(Mode::ALL[mode], || force, y)
        };
        let mut jacobian = DMatrix::zeros(DIMENSION, DIMENSION);
        model.jacobian(Mode::ALL[mode], || force, &y, &mut jacobian.as_view_mut());
        for column in 0..DIMENSION {
            let h = 1e-6 * scale[column];
            let (mut up, mut down) = (y.clone(), y.clone());
            up[column] += h;
            down[column] -= h;
            let (up, down) = (rhs(&up), rhs(&down));
            for row in 0..DIMENSION {
                let difference = (up[row] - down[row]) / (2.0 * h);
                let exact = jacobian[(row, column)];
                // rounding of torques of 80 N m over J, divided by h
                let noise = 1e-13 * (80.0 / model.torsion.surface_inertia) / h;
                prop_assert!((difference - exact).abs() < 1e-6 * exact.abs() + noise, "({row}, {column})");
            }
        }
    }

    /// A kick and a joining of the surfaces keep the momenta that they must keep.
    #[test]
    fn property_jumps_keep_momentum(y in prop::array::uniform8(-1.0..1.0f64), delta in -1.0..1.0f64) {
        let model = model();
        let momenta = |y: &[f64]| {
            let (phi1_dot, theta_dot) = (y[STATOR_TWIST_RATE], y[ROTOR_SPEED]);
            (theta_dot, phi1_dot, phi1_dot + model.relative_velocity(y))
        };
        let (theta, phi1, phi2) = momenta(&y);
        let (theta_k, phi1_k, phi2_k) = momenta(&model.kicked(&y, delta));
        prop_assert!((theta_k - theta).abs() < 1e-15);
        prop_assert!((phi2_k - phi2 - delta / 2.0).abs() < 1e-15 && (phi1_k - phi1 + delta / 2.0).abs() < 1e-15);
        let (theta_j, phi1_j, phi2_j) = momenta(&model.joined(&y));
        prop_assert!((theta_j - theta).abs() < 1e-15);
        prop_assert!((phi1_j + phi2_j - phi1 - phi2).abs() < 1e-15 && (phi1_j - phi2_j).abs() < 1e-15);
    }
}
