//! The parts of the model: coordinates, margins, slow motions, and the zeros of dips.

mod absolute_angles {
    use stickslip::case::{Case, CaseSource};
    use stickslip::model::absolute_angles::{
        AbsoluteModel, AbsoluteState, DIMENSION, PHI1, PHI1_DOT, PHI2, PHI2_DOT, THETA, THETA_DOT, Z, Z_DOT,
    };
    use stickslip::model::equations::{Outside, SystemEquations};
    use stickslip::model::{Mode, Parameters};

    /// Far from any switch both sets of equations agree: the accelerations of the twist coordinates are the
    /// differences of the angles' accelerations. The angles are small here, so that no digits are lost.
    #[test]
    fn property_same_accelerations_as_in_twist_coordinates() {
        let source = CaseSource::built_in("paper").unwrap();
        let system = Case::read(&source, &[]).unwrap().system;
        let model = AbsoluteModel::new(&system).unwrap();
        let system = SystemEquations::new(&system);
        let speed = system.rotor.speed.unwrap();
        let (rotor, stator) = (system.rotor.twists, system.stator.twists);
        let twists = |y: &AbsoluteState| {
            let mut twists = vec![0.0; system.dimension];
            twists[rotor] = y[THETA] - y[PHI2];
            twists[rotor + 1] = y[THETA_DOT] - y[PHI2_DOT];
            twists[stator] = y[PHI1];
            twists[stator + 1] = y[PHI1_DOT];
            twists[speed] = y[THETA_DOT];
            twists
        };
        let mut y = [0.0; DIMENSION];
        for (component, value) in [
            (THETA, 3e-5),
            (THETA_DOT, 7.0),
            (PHI1, 4e-6),
            (PHI1_DOT, 0.1),
            (PHI2, 2e-5),
            (PHI2_DOT, 6.5),
            (Z, -4e-5),
            (Z_DOT, 1e-4),
        ] {
            y[component] = value;
        }
        let mut rates = [0.0; DIMENSION];
        for (mode, backward) in [
            (Mode::SlipForward, false),
            (Mode::SlipForward, true),
            (Mode::Stick, false),
            (Mode::Separated, false),
        ] {
            let mut y = y;
            if backward {
                y[PHI1_DOT] = 7.0;
            }
            model.rhs(mode, 2.0, &y, &mut rates);
            let mode = if backward { Mode::SlipBackward } else { mode };
            let outside = Outside {
                normal_force: model.pressing_force(&y),
                ..Outside::default()
            };
            let (mut expected, found) = (vec![0.0; system.dimension], twists(&rates));
            system.rates(mode, f64::from(mode.sense()), 0, &outside, &twists(&y), &mut expected);
            for k in [rotor + 1, stator + 1, speed] {
                assert!(
                    (found[k] - expected[k]).abs() < 1e-12 * expected[k].abs().max(1.0),
                    "{mode:?}: component {k}: {} and {}",
                    found[k],
                    expected[k]
                );
            }
        }
    }

    #[test]
    fn analytic_the_state_of_the_contact_is_that_of_equation_9() {
        let source = CaseSource::built_in("paper").unwrap();
        let system = Case::read(&source, &[]).unwrap().system;
        let model = AbsoluteModel::new(&system).unwrap();
        let mut y = [0.0; DIMENSION];
        y[Z] = -4e-5;
        let limit = model.breakaway_torque(1.0, model.pressing_force(&y));
        let stiffness = Parameters::of(&system).unwrap().torsion.stiffness;
        let twist = |share: f64| share * limit / stiffness;
        let at = |w: f64, share: f64| {
            let mut y = y;
            y[PHI2_DOT] = w;
            // T_f is the mean of both torques.
            y[THETA] = twist(share);
            y[PHI1] = twist(share);
            model.contact(&y, false, 1e-5)
        };
        assert_eq!(at(0.9e-5, 0.0), Mode::Stick);
        assert_eq!(at(1.1e-5, 0.0), Mode::SlipForward);
        assert_eq!(at(-1.1e-5, 0.0), Mode::SlipBackward);
        assert_eq!(at(0.0, 0.999), Mode::Stick);
        assert_eq!(at(0.0, 1.001), Mode::SlipForward);
        assert_eq!(at(0.0, -1.001), Mode::SlipBackward);
        y[Z] = 1e-9;
        assert_eq!(model.contact(&y, false, 1e-5), Mode::Separated);
        y[Z] = 0.0;
        assert_eq!(model.contact(&y, true, 1e-5), Mode::Separated);
        assert_eq!(model.contact(&y, false, 1e-5), Mode::Stick);
    }
}

mod bounds {
    use proptest::prelude::*;
    use stickslip::model::breakaway::positive_for;

    proptest! {
        #[test]
        fn property_the_bound_is_the_parabolas_zero(g in 1e-9..1e3f64, rate in -1e6..1e6f64, curvature in 1e-9..1e9f64) {
            let x = positive_for(g, rate, curvature);
            let size = g + (rate * x).abs() + curvature * x * x / 2.0;
            prop_assert!(x > 0.0);
            prop_assert!((g + rate * x - curvature * x * x / 2.0).abs() < 1e-12 * size);
        }
    }
}

mod chain_coordinates {
    use nalgebra::DMatrix;
    use stickslip::case::{Case, CaseSource, Origin};
    use stickslip::model::Mode;
    use stickslip::model::chain_coordinates::{ChainCoordinates, HALF_WIDTH};
    use stickslip::model::equations::{Engagement, Outside, SystemEquations};
    use stickslip::numerics::band::BandMut;

    /// Trains with both kinds of ends, with bearings on every inertia; a rigid surface; bristles.
    fn systems() -> Vec<SystemEquations> {
        let friction = "[friction]\nbreakaway = 0.8\nlow_speed = 0.8\nhigh_speed = 0.5\ndecay = 0.9\n";
        let lugre = "[friction]\nlaw = \"lugre\"\nlow_speed = 0.8\nhigh_speed = 0.5\nscale = 0.4\nbristle_stiffness = 1e3\n\
                     bristle_damping = 3.0\nviscous = 0.02\n";
        let train = |inertias: usize, shafts: usize, end: &str| {
            let list = |base: f64, length: usize| -> Vec<f64> {
                (0..length).map(|i| base * (1.3 + (i as f64).sin())).collect()
            };
            format!(
                "inertia = {:?}\nstiffness = {:?}\ndamping = {:?}\nviscous = {:?}\n{end}\n",
                list(2.0, inertias),
                list(50.0, shafts),
                list(0.3, shafts),
                list(0.1, inertias)
            )
        };
        let free = "end = \"free\"";
        let fixed = "end = \"fixed\"";
        let driven = "end = \"driven\"\nspeed = 2.0\n".to_owned();
        let trains = [
            (train(5, 4, free), train(3, 3, fixed), friction),
            (train(1, 0, free), train(7, 6, free), friction),
            (driven.clone(), train(6, 6, fixed), friction),
            (driven, train(6, 6, fixed), lugre),
            (train(4, 4, "end = \"driven\"\nspeed = 1.0"), train(3, 2, free), lugre),
        ];
        let system = |(rotor, stator, friction): &(String, String, &str)| {
            let text = format!(
                "[rotor]\n{rotor}[stator]\n{stator}[contact]\nradius = 0.2\nnormal_force = 30.0\n{friction}[output]\nend_time = 1.0\n"
            );
            let source = CaseSource {
                text,
                origin: Origin::File("chain.toml".into()),
            };
            SystemEquations::new(&Case::read(&source, &[]).unwrap().system)
        };
        trains.iter().map(system).collect()
    }

    #[test]
    fn property_the_band_is_the_jacobian_in_other_coordinates() {
        for (number, system) in systems().iter().enumerate() {
            let n = system.dimension;
            let outside = Outside {
                normal_force: 30.0,
                ..Outside::default()
            };
            let chain = ChainCoordinates::new(system);
            let y: Vec<f64> = (0..n).map(|k| 0.3 * (1.0 + k as f64).sin()).collect();
            let modes: &[Mode] = match system.engagement {
                Engagement::StickSlip => &[Mode::Separated, Mode::Stick, Mode::SlipForward],
                _ => &[Mode::Separated, Mode::Engaged],
            };
            for &mode in modes {
                let mut dense = DMatrix::zeros(n, n);
                system.jacobian(mode, 1.0, 0, &outside, &y, &mut dense.as_view_mut());
                let stride = 2 * HALF_WIDTH + 1;
                let mut entries = vec![0.0; stride * n];
                let mut band = BandMut::new(&mut entries, stride, HALF_WIDTH, HALF_WIDTH);
                chain.jacobian(system, (mode, 1.0, 0), &outside, &y, &mut band);
                let entry = |i: usize, j: usize| match i.abs_diff(j) {
                    0..=HALF_WIDTH => entries[j * stride + HALF_WIDTH + i - j],
                    _ => 0.0,
                };
                let band = DMatrix::from_fn(n, n, entry);
                // By T J x = J_z T x for every unit x.
                let (mut x, mut z, mut image) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
                let largest = dense.amax();
                for k in 0..n {
                    x[k] = 1.0;
                    chain.enter(system, &x, &mut z);
                    x[k] = 0.0;
                    chain.enter(system, dense.column(k).as_slice(), &mut image);
                    let through = &band * DMatrix::from_column_slice(n, 1, &z);
                    for (i, (a, b)) in through.iter().zip(&image).enumerate() {
                        assert!(
                            (a - b).abs() < 1e-13 * largest,
                            "{number}, {mode:?}, ({i}, {k}): {a} and {b}"
                        );
                    }
                    let mut back = vec![0.0; n];
                    chain.leave(system, &z, &mut back);
                    assert!(back.iter().enumerate().all(|(i, x)| *x == f64::from(u8::from(i == k))));
                }
            }
        }
    }
}

mod margin {
    use stickslip::model::margin::{MarginSurface, of_both};

    fn surface([inertia, damping, stiffness]: [f64; 3]) -> MarginSurface {
        MarginSurface {
            inertia,
            damping,
            stiffness,
        }
    }

    /// Real and imaginary part of Z by complex division.
    fn impedance(surfaces: [[f64; 3]; 2], omega: f64) -> [f64; 2] {
        let of = |[j, a, k]: [f64; 3]| nalgebra::Complex::new(a, omega * j - k / omega);
        let [one, other] = surfaces.map(of);
        let both = one * other / (one + other);
        [both.re, both.im]
    }

    /// Against a scan of the zeros of Im Z. The scan's step of 1e-5 of omega leaves an error of 1e-4 of R.
    #[test]
    fn analytic_the_least_resistance_is_that_of_a_scan() {
        for surfaces in [
            [[1.0, 3.0, 100.0], [2.0, 1.0, 900.0]],
            [[1.0, 1.0, 100.0], [2.0, 3.0, 900.0]],
            [[5.0, 2.0, 400.0], [1.0, 1.0, 81.0]],
            [[3.0, 40.0, 100.0], [2.0, 1.0, 900.0]],
            [[2.0, 0.0, 0.0], [1.0, 1.0, 100.0]],
            [[2.0, 0.5, 0.0], [1.0, 1.0, 100.0]],
        ] {
            let at = |k: i32| impedance(surfaces, 0.5 * (1.0 + 1e-5f64).powi(k));
            let zeros = (0..500_000).filter(|k| at(*k)[1] * at(k + 1)[1] <= 0.0);
            let least = zeros.map(|k| 2.0 * at(k)[0]).fold(f64::INFINITY, f64::min);
            for [one, other] in [surfaces, [surfaces[1], surfaces[0]]] {
                let found = of_both(&surface(one), &surface(other)).expect("a swing");
                let error = (found - least).abs();
                assert!(error < 1e-3 * least, "{surfaces:?}: {found} and {least}");
            }
        }
    }

    /// For nearly equal frequencies the resistance is that of equal ones.
    #[test]
    fn analytic_nearly_equal_frequencies_are_no_special_case() {
        let (one, other) = (surface([1.0, 3.0, 100.0]), surface([2.0, 1.0, 200.0]));
        let equal = of_both(&one, &other).expect("a swing");
        assert_eq!(equal, 1.5);
        for change in [f64::EPSILON, 1e-12, 1e-8] {
            let near = surface([2.0, 1.0, 200.0 * (1.0 + change)]);
            let found = of_both(&one, &near).expect("a swing");
            assert!((found - equal).abs() < 1e-14 + change, "{change:e}: {found}");
        }
    }

    /// Two surfaces without springs do not swing; an undamped oscillation has no resistance.
    #[test]
    fn analytic_a_swing_needs_a_spring() {
        let loose = surface([1.0, 2.0, 0.0]);
        assert_eq!(of_both(&loose, &surface([3.0, 1.0, 0.0])), None);
        assert_eq!(of_both(&loose, &surface([3.0, 0.0, 1.0])), Some(0.0));
    }
}

mod oscillator {
    use proptest::prelude::*;
    use stickslip::model::oscillator::DampedOscillator;

    proptest! {
        /// The flow composes: two short advances equal one long advance, in every damping regime.
        #[test]
        fn property_advance_composes(damping in 0.0..6.0f64, first in 0.0..3.0f64, second in 0.0..3.0f64) {
            let o = DampedOscillator::new(1.0, damping, 1.0);
            let (q, r) = o.advance(0.3, -0.7, first);
            let (q, r) = o.advance(q, r, second);
            let (q1, r1) = o.advance(0.3, -0.7, first + second);
            prop_assert!((q - q1).abs() < 1e-14 && (r - r1).abs() < 1e-14);
        }
    }

    #[test]
    fn analytic_critical_damping_is_the_limit_of_both_sides() {
        let critical = DampedOscillator::new(1.0, 2.0, 1.0).advance(1.0, 0.5, 2.0);
        let exact = (-2.0f64).exp() * (1.0 + 1.5 * 2.0);
        assert!((critical.0 - exact).abs() < 1e-15);
        for damping in [2.0 - 1e-9, 2.0 + 1e-9] {
            let near = DampedOscillator::new(1.0, damping, 1.0).advance(1.0, 0.5, 2.0);
            assert!((near.0 - exact).abs() < 1e-8);
        }
    }
}

mod slow_manifold {
    use crate::common::systems;
    use stickslip::friction::Law;
    use stickslip::model::Mode;
    use stickslip::model::equations::{Outside, SystemEquations};
    use stickslip::model::slow_manifold::{
        Slip, SlowSeries, derivative, has_slow_manifold, on_slow_manifold, slow_momenta,
    };
    use stickslip::model::system::{End, System, Torque};
    use stickslip::numerics::taylor;
    use stickslip::signal::Drive;

    /// The equations of the system, an independent code, hold along the motion: with a free rotor, a free stator,
    /// bearings, an external torque, a driven end, and a curved force.
    #[test]
    fn analytic_the_motion_of_chains_solves_their_equations() {
        let mut cases = [
            systems::chains(),
            systems::chains(),
            systems::chains(),
            systems::chains(),
            // Brakes whose friction changes slowly enough for the expansion to reach rounding.
            (0..60)
                .map(|index| System::from(&systems::brake(index)))
                .find(|brake| {
                    let system = SystemEquations::new(brake);
                    let mut start = vec![0.0; system.dimension];
                    start[system.rotor.speed.unwrap()] = 12.0;
                    on_slow_manifold(&system, &Slip::undriven(1.0, 0, &[2000.0, 300.0, -4000.0]), &start).settled
                })
                .expect("most brakes are such"),
        ];
        let [turned, torque, driven] = [1, 2, 3];
        {
            let case: &mut System = &mut cases[turned];
            std::mem::swap(&mut case.rotor, &mut case.stator);
        }
        cases[torque].rotor.torque = Some(Torque {
            signal: Drive::Value(30.0),
            on: 1,
        });
        cases[driven].stator.end = End::Driven(Drive::Value(4.0));
        for (number, case) in cases.iter().enumerate() {
            let system = SystemEquations::new(case);
            assert!(has_slow_manifold(&system));
            let pressing = [2000.0, 300.0, -4000.0];
            let mut outside = Outside::default();
            if number == torque {
                outside.rotor.torque = 30.0;
            }
            if number == driven {
                outside.stator.speed = 4.0;
            }
            let mut slip = Slip::undriven(if number == turned { -1.0 } else { 1.0 }, 0, &pressing);
            slip.outside = outside;
            let mut start = vec![0.0; system.dimension];
            for index in [system.rotor.speed, system.stator.speed].into_iter().flatten() {
                start[index] = 12.0;
            }
            let momenta = slow_momenta(&system, &outside, &start);
            let slow = on_slow_manifold(&system, &slip, &start);
            assert!(slow.settled);
            let kept = slow_momenta(&system, &outside, &slow.state);
            for (now, before) in kept.iter().zip(momenta) {
                assert!((now - before).abs() <= 1e-14 * before.abs(), "{now} and {before}");
            }
            let series = SlowSeries::<20>::new(&system, &slip, momenta);
            let tau = 5e-4;
            let mut y = vec![0.0; system.dimension];
            series.states(&system, |index, series| y[index] = taylor::value(series, tau));
            let mut now = outside;
            now.normal_force = taylor::value(&pressing, tau);
            let mode = Mode::sliding(slip.sense);
            let mut rates = vec![0.0; system.dimension];
            system.rates(mode, slip.sense, 0, &now, &y, &mut rates);
            let w = system.relative_velocity(&now, &y);
            assert!((taylor::value(&series.relative_velocity(), tau) - w).abs() <= 1e-13 * w.abs());
            let torque = system.interface_torque(mode, slip.sense, 0, &now, &y);
            assert!((taylor::value(&series.torque, tau) - torque).abs() <= 1e-13 * torque.abs());
            let slope = system.law.coefficient_and_slope(w.abs()).1;
            let damping = taylor::value(&series.contact_damping(&system, &pressing), tau);
            let expected = system.radius * now.normal_force * slope;
            assert!((damping - expected).abs() <= 1e-12 * expected.abs());
            let mut checked = 0;
            series.states(&system, |index, series| {
                let rate = taylor::value(&derivative(series), tau);
                // An acceleration is a sum of torques over an inertia. T is the largest torque; 0.009 is the smallest
                // inertia.
                let rounding = 8.0 * f64::EPSILON * torque.abs() / 0.009;
                assert!(
                    (rate - rates[index]).abs() <= 1e-12 * rate.abs() + rounding,
                    "case {number}, component {index}: {rate:e} and {:e}",
                    rates[index]
                );
                checked += 1;
            });
            assert_eq!(checked, system.mechanical());
        }
    }
}

mod slow_motion {
    use crate::common::systems;
    use stickslip::model::Mode;
    use stickslip::model::equations::SystemEquations;
    use stickslip::model::slow_motion::{GAP, SlowMotion};
    use stickslip::model::system::System;
    use stickslip::numerics::eigenvalues::eigenvalues;

    /// P is a projector that commutes with A. It keeps a rotor that swings on both shafts, and removes the disks' own
    /// mode.
    #[test]
    fn analytic_what_is_kept_of_a_stick_is_its_slow_mode() {
        for number in 0..20 {
            let system = SystemEquations::new(&System::from(&systems::brake(number)));
            for mode in [Mode::Stick, Mode::Separated] {
                let slow = SlowMotion::new(&system, mode).expect("a rotor is heavier than its disk");
                let (p, a) = (
                    system.balanced(slow.projector.clone()),
                    system.balanced(system.linear_matrix(mode)),
                );
                assert!((&p * &p - &p).norm() < 1e-11, "{number}, {mode:?}");
                assert!((&p * &a - &a * &p).norm() < 1e-11 * a.norm(), "{number}, {mode:?}");
                let kept = p.trace().round();
                assert_eq!(kept, if mode == Mode::Stick { 3.0 } else { 1.0 }, "{number}");
                let largest =
                    |modes: Vec<nalgebra::Complex<f64>>| modes.iter().map(|mode| mode.norm()).fold(0.0, f64::max);
                assert!(largest(eigenvalues(&(&p * &a))) * GAP <= largest(eigenvalues(&a)));
                assert!(slow.fast_decay > 0.0, "{number}");
            }
        }
    }
}

mod stability {
    use crate::common::systems;
    use stickslip::friction::Bounds;
    use stickslip::model::Parameters;
    use stickslip::model::equations::SystemEquations;
    use stickslip::model::stability::{FastModes, Forecast, QuietStretch, Slow, SmoothForce, fastest_growth, rates};
    use stickslip::model::system::{End, System};

    fn general(parameters: &Parameters) -> (SystemEquations, FastModes) {
        let system = SystemEquations::new(&System::from(parameters));
        let modes = FastModes::new(&system, parameters.torsion.damping);
        (system, modes)
    }

    fn fast_decay(system: &SystemEquations, kappa: f64) -> f64 {
        rates(system, kappa, Slow::OfFreeChains).decay
    }

    /// The closed form of equal disks holds the far end of the rotor's shaft. A rotor that gives way mistunes the
    /// disks, and the least damped mode then decays faster.
    #[test]
    fn analytic_alike_disks_decay_as_their_spectrum_says() {
        for number in 0..40 {
            let mut parameters = systems::brake(number);
            for heavier in [1.0, 1e7] {
                parameters.torsion.rotor_inertia *= heavier;
                let (system, mut modes) = general(&parameters);
                let torsion = parameters.torsion;
                let own = torsion.damping / (2.0 * torsion.surface_inertia);
                for part in [0.0, -0.1, -0.3, -0.45] {
                    let kappa = part * torsion.damping;
                    let (closed, exact) = (modes.decay(&system, kappa), fast_decay(&system, kappa));
                    assert!(closed <= exact + 1e-6 * own, "{number}: {closed} and {exact}");
                    assert!(
                        heavier == 1.0 || exact <= closed + 1e-4 * own,
                        "{number}: {closed} and {exact}"
                    );
                }
            }
        }
    }

    /// Unequal disks of the same frequency whose shafts end in a heavy rotor and in the ground: R = a_1 a_2/(a_1 +
    /// a_2) in closed form, and there the fast modes become unstable.
    #[test]
    fn analytic_the_decay_is_zero_where_the_margin_is() {
        let mut case = systems::chains();
        case.rotor.inertia = vec![0.01, 1e4];
        case.rotor.stiffness = vec![5e6];
        case.rotor.damping = vec![30.0];
        case.rotor.viscous = vec![0.0; 2];
        case.stator.inertia = vec![0.02];
        case.stator.stiffness = vec![1e7];
        case.stator.damping = vec![10.0];
        case.stator.viscous = vec![2.0];
        let system = SystemEquations::new(&case);
        let twice_resistance = 2.0 * 30.0 * 12.0 / 42.0;
        let mut modes = FastModes::new(&system, twice_resistance);
        let resistance = twice_resistance / 2.0;
        let own = modes.decay(&system, 0.0);
        assert!(own > 100.0);
        // An oscillation at the margin's zero decays by half of its small damping over the mean inertia; the two disks
        // differ by a factor of 2.
        assert!(modes.decay(&system, -resistance).abs() < 2e-3 * own);
        assert!(modes.decay(&system, -0.99 * resistance) > 0.0);
        assert!(modes.decay(&system, -1.01 * resistance) < 0.0);
        // Between its nodes the decay is interpolated linearly. It is compared with the spectrum itself.
        for part in [-0.97, -0.5, -0.3, 0.2, 3.0] {
            let kappa = part * resistance;
            let (line, exact) = (modes.decay(&system, kappa), fast_decay(&system, kappa));
            assert!((line - exact).abs() < 0.01 * own, "{part}: {line} and {exact}");
        }
    }

    /// The bounds are compared with the spectrum of longer chains; the forecast loses stability where the bounds allow
    /// it.
    #[test]
    fn property_a_quiet_stretch_of_chains_bounds_its_spectrum() {
        for stiffer in [1.0, 3.0, 0.3] {
            let mut case = systems::chains();
            case.stator.stiffness[0] *= stiffer;
            case.rotor.damping[0] *= stiffer;
            let system = SystemEquations::new(&case);
            let twice_resistance = 8.0;
            let mut modes = FastModes::new(&system, twice_resistance);
            let force = Bounds {
                least: 1900.0,
                most: 2100.0,
            };
            let quiet = QuietStretch::of_slip(&system, &mut modes, force, 1.0, 80.0).unwrap();
            let smooth = |_: f64| SmoothForce {
                value: 2000.0,
                swing: 100.0,
            };
            let forecast = Forecast::of_slip(&system, &mut modes, smooth, |_| None, (1.0, 80.0), 200.0).unwrap();
            let lost = forecast.instability.expect("it stops");
            assert!(quiet.until < lost && quiet.damping > 0.0, "{quiet:?}, lost at {lost}");
            // The quiet stretch decays no faster than the forecast says.
            let calm = forecast.time_of_damping(40.0).unwrap();
            assert!(calm <= 1.0 + 40.0 / quiet.damping, "{quiet:?}, calm at {calm}");
            let resistance = twice_resistance / 2.0;
            for part in [0.0, -0.25, -0.5] {
                assert!(fast_decay(&system, part * resistance) >= quiet.damping * (1.0 - 1e-9));
            }
            let mut grown = 0.0;
            for part in [-1.5, -3.0, -10.0] {
                let kappa = part * resistance;
                let (bound, growth) = (fastest_growth(&system, kappa), -fast_decay(&system, kappa));
                assert!(bound >= growth, "{part}: {bound} and {growth}");
                grown = growth;
            }
            assert!(grown > 0.0);
        }
    }

    #[test]
    fn property_only_one_free_train_slows_down_by_itself() {
        let mut case = systems::chains();
        case.stator.end = End::Free;
        case.stator.stiffness.pop();
        case.stator.damping.pop();
        let system = SystemEquations::new(&case);
        let mut modes = FastModes::new(&system, 8.0);
        let force = Bounds { least: 1.0, most: 2.0 };
        assert!(QuietStretch::of_slip(&system, &mut modes, force, 0.0, 10.0).is_none());
    }
}

mod dips {
    use stickslip::hybrid::dips::may_reach_zero;

    /// The parabola t^2 - 1 + c over -1.1 to 1.2: its tangents detect every dip, and exclude parabolas far above zero.
    #[test]
    fn analytic_tangents_see_every_dip() {
        let ends = |c: f64| ((1.21 - 1.0 + c, -2.2), (1.44 - 1.0 + c, 2.4));
        for c in [0.0, 0.5, 0.9, 0.999, 1.0] {
            let (before, after) = ends(c);
            assert!(may_reach_zero(before, after, 2.3), "{c}");
        }
        let (before, after) = ends(4.0);
        assert!(!may_reach_zero(before, after, 2.3));
    }
}
