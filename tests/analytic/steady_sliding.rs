//! The modes of two trains, their steady sliding, and its loss of stability, against closed forms and against
//! eigenvalues of equations in absolute coordinates that are set up here.

use crate::common::cases::{near, parsed};
use crate::common::systems;
use nalgebra::DMatrix;
use proptest::prelude::*;
use std::f64::consts::TAU;
use stickslip::analysis::stability::SlidingVerdict;
use stickslip::analysis::stability::modes::{Modes, StabilityChange, SystemState};
use stickslip::case::{Case, CaseSource};
use stickslip::friction::{FrictionLaw, Law, Stribeck};
use stickslip::model::system::*;
use stickslip::signal::Drive;

/// Rounding of a closed form of a dozen operations, and of a bisection down to neighbouring doubles.
const CLOSED_FORM: f64 = 1e-12;

fn built_in(name: &str, overrides: &[&str]) -> System {
    let overrides = parsed(overrides);
    let source = CaseSource::built_in(name).unwrap();
    Case::read(&source, &overrides).unwrap().system
}

fn modes(name: &str, overrides: &[&str]) -> Modes {
    Modes::linear(&built_in(name, overrides))
}

#[track_caller]
fn assert_close(value: f64, expected: f64, relative: f64) {
    near(value, expected, relative * expected.abs());
}

#[track_caller]
fn only(changes: &[StabilityChange]) -> StabilityChange {
    assert_eq!(changes.len(), 1, "{changes:?}");
    changes[0]
}

#[track_caller]
fn state<'a>(modes: &'a Modes, name: &str) -> &'a SystemState {
    let found = modes.states.iter().find(|state| state.state == name);
    found.unwrap_or_else(|| panic!("no {name} among {:?}", modes.states))
}

fn train(inertia: &[f64], stiffness: &[f64], damping: &[f64], viscous: &[f64], end: End) -> Train {
    Train {
        viscous: viscous.to_vec(),
        ..systems::train(inertia, stiffness, damping, end)
    }
}

/// At rest, except for the driven parts.
fn pair(rotor: Train, stator: Train, radius: f64, force: f64, law: FrictionLaw) -> System {
    System {
        radius,
        ..systems::pair(rotor, stator, Pressing::Force(Drive::Value(force)), law)
    }
}

fn exponential(low: f64, high: f64, decay: f64) -> FrictionLaw {
    systems::exponential(low, high, decay).into()
}

/// x* = ln(alpha (mu_s - mu_d) F_n/c)/alpha, and the same equation solved for F_n and for c.
#[test]
fn analytic_hopf_of_the_exponential_belt() {
    let modes = modes("belt-exponential", &[]);
    let speed = only(&modes.critical_relative_velocities.changes);
    assert_close(speed.value, 10f64.ln() / 5.0, CLOSED_FORM);
    assert!(!speed.unstable_above);
    assert_close(speed.frequency.unwrap(), 10.0 / TAU, CLOSED_FORM);
    let force = only(&modes.critical_normal_forces.as_ref().unwrap().changes);
    assert_close(force.value, 1.5f64.exp(), CLOSED_FORM);
    assert!(force.unstable_above);
    let damping = only(&modes.critical_stator_damping.as_ref().unwrap().changes);
    assert_close(damping.value, 10.0 * (-1.5f64).exp(), CLOSED_FORM);
    assert!(!damping.unstable_above);
    assert_eq!(modes.critical_rotor_damping, None);

    let point = &modes.operating_points[0];
    assert!(point.steady);
    assert_eq!(modes.operating_points.len(), 1);
    assert_close(point.relative_velocity, 0.3, CLOSED_FORM);
    assert_eq!(point.stability, SlidingVerdict::Unstable);
    let friction = 10.0 * (0.2 + 0.2 * (-1.5f64).exp());
    assert_close(point.interface_torque, friction, CLOSED_FORM);
    assert_close(point.stator_twist[0], friction / 100.0, CLOSED_FORM);
    let mode = &state(&modes, "slip").modes[0];
    // lambda = -h/2 +- i sqrt(100 - h^2/4), h = c + F_n mu'.
    let h = 1.0 - 10.0 * (-1.5f64).exp();
    assert_close(mode.frequency.unwrap(), 10.0 / TAU, CLOSED_FORM);
    assert_close(mode.decay, h / 2.0, CLOSED_FORM);
    assert_close(mode.damping_ratio.unwrap(), h / 20.0, CLOSED_FORM);
    assert_eq!(mode.moves.as_deref(), Some("stator 0"));
    let separated = &state(&modes, "separated").modes[0];
    assert_close(separated.decay, 0.5, CLOSED_FORM);
    // The mass moves with the belt: nothing can swing.
    assert!(modes.states.iter().all(|state| state.state != "stick"));
    assert!(modes.absent.iter().any(|absent| absent.what == "stick mode"));

    let above = Modes::linear(&built_in("belt-exponential", &["rotor.speed=0.5"]));
    assert_eq!(above.operating_points[0].stability, SlidingVerdict::Stable);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    /// The same in rotation, with any parameters, for a driven or a fixed rotor and with a bearing besides the shaft.
    #[test]
    fn analytic_hopf_of_one_grounded_inertia(
        inertia in 1e-3..1e3f64, stiffness in 1.0..1e6f64, ratio in 1e-6..0.9f64, bearing in 0.0..1.0f64,
        radius in 0.01..1.0f64, force in 1.0..1e5f64, decay in 0.1..50.0f64, share in 0.01..0.95f64, turned in any::<bool>(),
    ) {
        // c is a share of the damping that friction removes at rest, so that there is a critical speed.
        let steepest = decay * 0.2 * radius * force;
        let total = share * steepest * ratio;
        let (shaft, bearing) = (total * (1.0 - bearing), total * bearing);
        let grounded = train(&[inertia], &[stiffness], &[shaft], &[bearing], End::Fixed);
        let driven = train(&[], &[], &[], &[], End::Driven(Drive::Value(0.7)));
        let law = exponential(0.5, 0.3, decay);
        let trains = match turned {
            false => pair(driven, grounded, radius, force, law),
            true => pair(grounded, driven, radius, force, law),
        };
        let modes = Modes::linear(&trains);
        let expected = (decay * (0.5 - 0.3) * force * radius / (shaft + bearing)).ln() / decay;
        let speed = only(&modes.critical_relative_velocities.changes);
        // mu_s - mu_d is rounded in the law as it is here; near x* = 0 its rounding affects ln.
        prop_assert!((speed.value - expected).abs() <= CLOSED_FORM * expected.max(0.01 / decay), "{} {}", speed.value, expected);
        prop_assert!((speed.frequency.unwrap() * TAU / (stiffness / inertia).sqrt() - 1.0).abs() < CLOSED_FORM);
        let point = &modes.operating_points[0];
        prop_assert_eq!(point.relative_velocity, if turned { -0.7 } else { 0.7 });
        prop_assert_eq!(point.stability.is_unstable(), 0.7 < expected);
    }
}

/// The eigenvalues of sliding in absolute angles: M x'' + C x' + K x = 0 with the damping kappa between the surfaces.
/// Unconstrained angles add zeros, which are omitted.
fn eigenvalues(trains: &System, kappa: f64) -> Vec<nalgebra::Complex<f64>> {
    let sides = [&trains.rotor, &trains.stator];
    let first = [0, trains.rotor.inertia.len()];
    let n = first[1] + trains.stator.inertia.len();
    let (mut c, mut k) = (DMatrix::<f64>::zeros(n, n), DMatrix::<f64>::zeros(n, n));
    let spring = |matrix: &mut DMatrix<f64>, a: Option<usize>, b: Option<usize>, value: f64| {
        for i in [a, b].into_iter().flatten() {
            matrix[(i, i)] += value;
        }
        if let (Some(a), Some(b)) = (a, b) {
            matrix[(a, b)] -= value;
            matrix[(b, a)] -= value;
        }
    };
    let mut mass: Vec<f64> = Vec::new();
    for (train, first) in sides.iter().zip(first) {
        let at = |i: usize| (i < train.inertia.len()).then_some(first + i);
        for (i, (&stiffness, &damping)) in train.stiffness.iter().zip(&train.damping).enumerate() {
            spring(&mut k, at(i), at(i + 1), stiffness);
            spring(&mut c, at(i), at(i + 1), damping);
        }
        for (i, &viscous) in train.viscous.iter().enumerate() {
            spring(&mut c, at(i), None, viscous);
        }
        mass.extend(&train.inertia);
    }
    let surface = |side: usize| (!sides[side].inertia.is_empty()).then_some(first[side]);
    spring(&mut c, surface(0), surface(1), kappa);
    let matrix = DMatrix::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
        (true, true) => 0.0,
        (true, false) => f64::from(u8::from(i == j - n)),
        (false, true) => -k[(i - n, j)] / mass[i - n],
        (false, false) => -c[(i - n, j - n)] / mass[i - n],
    });
    let all = matrix.complex_eigenvalues();
    let largest = all.iter().map(|l| l.norm()).fold(0.0, f64::max);
    all.iter().copied().filter(|l| l.norm() > 1e-8 * largest).collect()
}

/// Whether a disturbance of sliding grows. For a free rotor without drive one real root may grow: it is the slowing
/// down of the rotor, which is sliding itself. This happens where friction falls faster than the bearings' torque
/// rises.
fn grows(trains: &System, kappa: f64) -> bool {
    let growing = eigenvalues(trains, kappa).iter().filter(|l| l.re > 0.0).count();
    let slows = matches!((&trains.rotor.end, &trains.stator.end), (End::Free, End::Fixed));
    let bearings: f64 = trains.rotor.viscous.iter().sum();
    growing > usize::from(slows && kappa + bearings < 0.0)
}

/// A chain whose parameters are within a factor of ten of each other, so that eigenvalues have some ten digits.
fn chain(length: std::ops::Range<usize>, end: End) -> impl Strategy<Value = Train> {
    length.prop_flat_map(move |n| {
        let end = end.clone();
        let shafts = if matches!(end, End::Free) { n - 1 } else { n };
        let list = |range: std::ops::Range<f64>, count: usize| proptest::collection::vec(range, count);
        let numbers = (
            list(0.3..3.0, n),
            list(30.0..300.0, shafts),
            list(0.02..0.2, shafts),
            list(0.005..0.05, n),
        );
        numbers.prop_map(move |(inertia, stiffness, damping, viscous)| {
            train(&inertia, &stiffness, &damping, &viscous, end.clone())
        })
    })
}

fn any_pair() -> impl Strategy<Value = (Train, Train)> {
    let driven = || End::Driven(Drive::Value(1.0));
    let rigid = || Just(train(&[], &[], &[], &[], End::Driven(Drive::Value(1.0))));
    prop_oneof![
        (rigid().boxed(), chain(1..4, End::Fixed).boxed()),
        (chain(1..4, driven()).boxed(), chain(1..4, End::Fixed).boxed()),
        (chain(1..4, End::Free).boxed(), chain(1..3, End::Fixed).boxed()),
        (chain(2..4, End::Free).boxed(), chain(2..4, End::Free).boxed()),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, failure_persistence: None, ..ProptestConfig::default() })]

    /// On both sides of each critical speed the eigenvalues in absolute angles confirm the stated stability, and
    /// between critical speeds everywhere. A change of the speed by 1e-6 changes the damping of the contact by some
    /// 1e-6 of the trains', and the real parts by more than the rounding of the eigenvalues, some 1e-11.
    #[test]
    fn property_critical_speeds_are_those_of_absolute_angles(
        (rotor, stator) in any_pair(), force in 0.2..20.0f64, decay in 1.0..5.0f64,
    ) {
        let trains = pair(rotor, stator, 1.0, force, exponential(0.5, 0.3, decay));
        let modes = Modes::linear(&trains);
        let grows = |x: f64| grows(&trains, force * trains.law.coefficient_and_slope(x).1);
        let search = &modes.critical_relative_velocities;
        let mut ends = vec![0.0];
        for change in &search.changes {
            // Near the zero of the angle an equally small real root cannot be distinguished from it; further off it is
            // some 1e-6 of the largest.
            let aside = if change.frequency.is_some() { 1e-6 } else { 1e-3 };
            let (below, above) = (grows(change.value * (1.0 - aside)), grows(change.value * (1.0 + aside)));
            prop_assert!(below != above && above == change.unstable_above, "at {}", change.value);
            if let Some(frequency) = change.frequency {
                let kappa = force * trains.law.coefficient_and_slope(change.value).1;
                let least = eigenvalues(&trains, kappa).into_iter().min_by(|a, b| a.re.abs().total_cmp(&b.re.abs()));
                let found = least.unwrap().im.abs() / TAU;
                prop_assert!((found - frequency).abs() < 1e-6 * frequency, "{found} {frequency}");
            }
            ends.push(change.value);
        }
        ends.push(search.to);
        for (k, pair) in ends.windows(2).enumerate() {
            for share in [0.01, 0.3, 0.7, 0.99] {
                let x = pair[0] + share * (pair[1] - pair[0]);
                let unstable = match search.changes.get(k) {
                    Some(next) => !next.unstable_above,
                    None => search.changes.last().map_or(search.throughout == Some(SlidingVerdict::Unstable), |last| last.unstable_above),
                };
                prop_assert_eq!(grows(x), unstable, "at {}", x);
            }
        }
        // The eigenvalues themselves, as far as both sets have them: absolute angles add zeros.
        let slip = modes.states.iter().find(|state| state.state == "slip");
        if let Some(slip) = slip {
            let kappa = force * trains.law.coefficient_and_slope(slip.relative_velocity.unwrap().abs()).1;
            let all = eigenvalues(&trains, kappa);
            for mode in slip.modes.iter().filter(|mode| mode.frequency.is_some()) {
                let norm = TAU * mode.frequency.unwrap();
                let distance = all.iter().map(|l| (l.norm() - norm).abs() + (l.re + mode.decay).abs());
                prop_assert!(distance.fold(f64::INFINITY, f64::min) < 1e-8 * norm, "{mode:?} of {all:?}");
            }
        }
    }

    /// At the critical multiple of a damping the stability by the eigenvalues in absolute angles changes, too.
    #[test]
    fn property_critical_damping_is_that_of_absolute_angles(
        (rotor, stator) in any_pair(), force in 0.2..20.0f64, decay in 1.0..5.0f64,
    ) {
        let trains = pair(rotor, stator, 1.0, force, exponential(0.5, 0.3, decay));
        let modes = Modes::linear(&trains);
        if modes.operating_points.is_empty() {
            return Ok(());
        }
        let x = modes.operating_points[0].relative_velocity.abs();
        let kappa = force * trains.law.coefficient_and_slope(x).1;
        let grows = |rotor: f64, stator: f64| {
            let mut other = trains.clone();
            other.rotor.damping.iter_mut().for_each(|c| *c *= rotor);
            other.stator.damping.iter_mut().for_each(|c| *c *= stator);
            grows(&other, kappa)
        };
        let searches = [(&modes.critical_rotor_damping, true), (&modes.critical_stator_damping, false)];
        for (search, of_rotor) in searches {
            for change in search.iter().flat_map(|search| &search.changes) {
                let at = |k: f64| if of_rotor { grows(k, 1.0) } else { grows(1.0, k) };
                let (below, above) = (at(change.value * (1.0 - 1e-5)), at(change.value * (1.0 + 1e-5)));
                prop_assert!(below != above && above == change.unstable_above, "at {}", change.value);
            }
        }
    }
}

/// The zero of a function that changes its sign once, by bisection.
fn zero(mut below: f64, mut above: f64, function: impl Fn(f64) -> f64) -> f64 {
    let first = function(below) < 0.0;
    assert_ne!(first, function(above) < 0.0);
    for _ in 0..200 {
        let middle = 0.5 * (below + above);
        if (function(middle) < 0.0) == first {
            below = middle;
        } else {
            above = middle;
        }
    }
    0.5 * (below + above)
}

/// A law that falls late and rises again has two critical speeds: with delta = 2, mu' = -2 D x/x_s^2 exp(-(x/x_s)^2) +
/// mu_v.
#[test]
fn analytic_stribeck_has_two_critical_speeds() {
    let law: FrictionLaw = Stribeck {
        low_speed: 0.4,
        high_speed: 0.2,
        scale: 0.2,
        exponent: 2.0,
        viscous: 0.01,
    }
    .into();
    let modes = Modes::linear(&System {
        law,
        ..built_in("belt-exponential", &[])
    });
    let margin = |x: f64| 1.0 + 10.0 * (0.01 - 2.0 * 0.2 * x / 0.04 * (-(x / 0.2f64).powi(2)).exp());
    let peak = 0.2 / 2f64.sqrt();
    let expected = [zero(1e-6, peak, margin), zero(peak, 1.0, margin)];
    let changes = &modes.critical_relative_velocities.changes;
    assert_eq!(changes.len(), 2, "{changes:?}");
    for (change, expected) in changes.iter().zip(expected) {
        assert_close(change.value, expected, CLOSED_FORM);
    }
    assert!(changes[0].unstable_above && !changes[1].unstable_above);
}

/// The slope of mu(x) tanh(x/eps) exceeds c where the margin of the product says so.
#[test]
fn analytic_regularised_sliding_loses_stability_near_rest() {
    let modes = modes(
        "belt-leine-tanh",
        &["stator.damping=0.5", "friction.regularisation.speed=0.05"],
    );
    let (eps, scale) = (0.05, 1.0 / 3.0);
    let margin = |x: f64| {
        let (mu, slope) = (1.0 / (1.0 + x / scale), -1.0 / scale / (1.0 + x / scale).powi(2));
        let shape = (x / eps).tanh();
        0.5 + slope * shape + mu * (1.0 - shape * shape) / eps
    };
    let changes = &modes.critical_relative_velocities.changes;
    assert_eq!(changes.len(), 2, "{changes:?}");
    assert_close(changes[0].value, zero(0.01, 0.15, margin), CLOSED_FORM);
    assert_close(changes[1].value, zero(0.15, 5.0, margin), CLOSED_FORM);
    assert!(modes.absent.iter().any(|absent| absent.what == "stick mode"));
    // At rest the contact is a damper: F_n/eps against the stiffness.
    let rest = state(&modes, "engaged");
    assert_eq!(rest.relative_velocity, Some(0.0));
    let h = 0.5 + 1.0 / eps;
    let fast = h / 2.0 + (h * h / 4.0 - 1.0).sqrt();
    assert_close(rest.modes[0].decay, fast, CLOSED_FORM);
    assert_close(rest.modes[1].decay, 1.0 / fast, 1e-10);
}

/// Bit and top drive turn at the same speed where the torque of the drive balances bearings and rock. There are two
/// such speeds, because friction falls. The lower one is unstable without oscillation.
#[test]
fn analytic_steady_sliding_of_the_drill_string() {
    let modes = modes("drill-string", &[]);
    let friction = |x: f64| (0.5 + 0.3 * (-0.9 * x).exp()) * 0.155575 * 53018.0;
    let balance = |x: f64| 6000.0 - 475.0 * x - friction(x);
    let expected = [zero(2.0, 6.0, balance), zero(0.1, 2.0, balance)];
    assert_eq!(modes.operating_points.len(), 2);
    for (point, expected) in modes.operating_points.iter().zip(expected) {
        assert!(point.steady);
        assert_close(point.relative_velocity, expected, CLOSED_FORM);
        assert_close(point.rotor_speed.unwrap(), expected, CLOSED_FORM);
        // The pipe carries the torque of rock and mud on the bit.
        let carried = friction(expected) + 50.0 * expected;
        assert_close(point.rotor_twist[0], carried / 473.0, CLOSED_FORM);
        assert!(point.stator_twist.is_empty());
    }
    assert_eq!(modes.operating_points[1].stability, SlidingVerdict::Unstable);
    // If the bit sticks, the top drive swings on the pipe.
    let stick = state(&modes, "stick");
    assert_eq!(stick.modes.len(), 1);
    assert_close(
        stick.modes[0].frequency.unwrap(),
        (473.0f64 / 2122.0).sqrt() / TAU,
        CLOSED_FORM,
    );
    assert_close(stick.modes[0].decay, (23.2 + 425.0) / 2122.0 / 2.0, CLOSED_FORM);
    assert_eq!(stick.modes[0].moves.as_deref(), Some("rotor 1"));
}

/// Joined surfaces swing on both shafts together, J_1 + J_2 on k_1 + k_2.
#[test]
fn analytic_stick_joins_the_surfaces() {
    let grounded = |inertia: f64, stiffness: f64, end: End| train(&[inertia], &[stiffness], &[0.0], &[0.0], end);
    let trains = pair(
        grounded(2.0, 300.0, End::Driven(Drive::Value(0.1))),
        grounded(3.0, 700.0, End::Fixed),
        1.0,
        10.0,
        exponential(0.5, 0.3, 2.0),
    );
    let modes = Modes::linear(&trains);
    let stick = state(&modes, "stick");
    assert_eq!(stick.modes.len(), 1, "{stick:?}");
    assert_close(stick.modes[0].frequency.unwrap(), 200f64.sqrt() / TAU, CLOSED_FORM);
    assert_eq!(stick.modes[0].decay, 0.0);
    // Without damping, falling friction is unstable at every speed.
    let search = &modes.critical_relative_velocities;
    assert!(search.changes.is_empty());
    assert_eq!(search.throughout, Some(SlidingVerdict::Unstable));
}

/// Constant friction without damping neither excites nor damps; a clutch does not slide steadily.
#[test]
fn analytic_coulomb_friction_is_neutral() {
    let belt = modes("belt-coulomb", &[]);
    assert_eq!(belt.operating_points[0].stability, SlidingVerdict::Neutral);
    let expected = Some(SlidingVerdict::Neutral);
    assert_eq!(belt.critical_relative_velocities.throughout, expected);
    let clutch = modes("clutch", &[]);
    assert_eq!(clutch.operating_points.len(), 1);
    assert!(!clutch.operating_points[0].steady);
    assert_eq!(clutch.operating_points[0].relative_velocity, 200.0);
    assert!(
        clutch
            .absent
            .iter()
            .any(|absent| absent.what == "steady sliding" && absent.why.starts_with("not steady"))
    );
}

/// At rest bristles are springs with sigma_0 F_n and dampers with sigma_1 F_n; at 0.1 m/s the law has reached its
/// final value.
#[test]
fn analytic_bristles() {
    let modes = modes("lugre-slider", &[]);
    let rest = state(&modes, "engaged");
    assert_eq!(rest.relative_velocity, Some(0.0));
    let (k, c): (f64, f64) = (1e5 + 2.0, 1e5f64.sqrt() + 0.4);
    // The mode of the spring and the bristles. Since the place of rest is free, there is a third eigenvalue of about
    // zero.
    let swing = rest.modes.iter().find(|mode| mode.frequency.is_some()).unwrap();
    assert_close(swing.frequency.unwrap(), k.sqrt() / TAU, CLOSED_FORM);
    assert_close(swing.decay, c / 2.0, CLOSED_FORM);
    let point = &modes.operating_points[0];
    assert_close(point.relative_velocity, 0.1, CLOSED_FORM);
    // g(0.1) = 1: exp(-10^4) vanishes.
    assert_close(point.interface_torque, 1.0 + 0.4 * 0.1, CLOSED_FORM);
    assert_close(point.rotor_twist[0], 1.04 / 2.0, CLOSED_FORM);
    assert_eq!(point.stability, SlidingVerdict::Stable);
    // The critical speed by this test's own characteristic polynomial: (s + b)(s^2 + 0.4 s + 2) + (sigma_0 + sigma_1 s) a s = 0
    // with a = x g'/g and b = sigma_0 x/g; by Hurwitz it is stable where p_2 p_1 > p_0
    // (p_2 > 0 from 2 mm/s on).
    let hurwitz = |x: f64| {
        let fall = 0.5 * (-(x / 1e-3f64).powi(2)).exp();
        let (g, slope) = (1.0 + fall, -2.0 * x / 1e-6 * fall);
        let (a, b) = (x * slope / g, 1e5 * x / g);
        let (p2, p1, p0) = (b + 0.4 + 1e5f64.sqrt() * a, 2.0 + 0.4 * b + 1e5 * a, 2.0 * b);
        p2 * p1 - p0
    };
    let changes = &modes.critical_relative_velocities.changes;
    let last = changes.last().unwrap();
    // Eigenvalues of up to 1e5 1/s have 1e-11 of absolute rounding; a real part of 1e-3 has eight digits.
    assert_close(last.value, zero(2e-3, 1e-2, hurwitz), 1e-8);
    assert!(!last.unstable_above);
}
