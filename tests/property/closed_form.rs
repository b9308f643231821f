//! Closed forms of stick and separation, compared with Taylor series.

use crate::common::systems::{self, exponential, pair, wave};
use proptest::prelude::*;
use std::sync::Arc;
use stickslip::friction::FrictionLaw;
use stickslip::hybrid::{Advance, ChosenSolver, Engine, EngineSegment, SolverKind};
use stickslip::model::equations::{ANGLE, DAMPING_LOSS, FRICTION_LOSS, WORK};
use stickslip::model::system::{End, Pressing, System, Torque, Train};
use stickslip::model::{BreakawayTest, Mode};
use stickslip::signal::{Drive, Frequency, HarmonicShape, Wave};
use stickslip::simulation::series::TaylorEngine;
use stickslip::simulation::{ClosedFormEngine, SystemDynamics, SystemLocation};
use stickslip::sundials::Tolerances;

/// Constant friction, so that no rate of slip is the fastest rate of a system under a large force.
fn law() -> FrictionLaw {
    exponential(0.5, 0.5, 2.0).into()
}

fn of_chains(rotor: Train, stator: Train, force: Drive) -> System {
    pair(rotor, stator, Pressing::Force(force), law())
}

/// A train of up to three inertias. All of them draw their shaft, bearing and torque from the same ranges.
fn train() -> impl Strategy<Value = Train> {
    let numbers = prop::collection::vec((0.1..10.0f64, 1.0..1e4f64, 0.0..2.0f64, 0.0..1.0f64), 0..4);
    (
        numbers,
        0..3usize,
        any::<bool>(),
        prop::option::of((-20.0..20.0f64, 0..3usize)),
    )
        .prop_map(|(numbers, end, braked, torque)| {
            let n = numbers.len();
            let end = match (n, end) {
                (_, 0) => End::Fixed,
                (_, 1) => End::Driven(Drive::Value(0.0)),
                (0, _) => End::Fixed,
                _ => End::Free,
            };
            let shafts = if matches!(end, End::Free) { n - 1 } else { n };
            Train {
                inertia: numbers.iter().map(|numbers| numbers.0).collect(),
                stiffness: numbers[..shafts].iter().map(|numbers| numbers.1).collect(),
                damping: numbers[..shafts].iter().map(|numbers| numbers.2).collect(),
                viscous: numbers.iter().map(|n| if braked { n.3 } else { 0.0 }).collect(),
                torque: torque.filter(|_| n > 0).map(|(torque, on)| Torque {
                    signal: Drive::Value(torque),
                    on: on % n,
                }),
                end,
            }
        })
}

/// A state of random twists and speeds, joined in stick, with quadratures of zero.
fn state(dynamics: &SystemDynamics, mode: Mode, draws: &[f64], common: f64) -> Vec<f64> {
    let system = &dynamics.system;
    let mut y = vec![0.0; system.dimension];
    for (y, draw) in y[..system.mechanical()].iter_mut().zip(draws) {
        *y = *draw;
    }
    for side in [&system.rotor, &system.stator] {
        for i in 0..side.shafts() {
            y[side.twists + 2 * i] *= (side.inertia[i] / side.stiffness[i]).sqrt();
        }
        if let Some(index) = side.speed {
            y[index] += common;
        }
    }
    if mode == Mode::Stick {
        let outside = dynamics.outside(&SystemLocation::new(mode, 0), 0.0);
        system.join(&outside, &mut y);
    }
    y
}

fn series() -> (SolverKind, f64) {
    (SolverKind::Series, 1e-17)
}

/// Runs an engine to the end of a segment or to the first guard. Returns the time, the state and the guard.
fn run(engine: &mut dyn Engine, mode: Mode, y: &[f64], span: f64) -> (f64, Vec<f64>, Option<usize>, u32) {
    let (kind, relative) = series();
    let chosen = ChosenSolver {
        kind,
        tolerances: Tolerances {
            relative,
            absolute: vec![1e-18; y.len()],
        },
        max_step: None,
        fixed_step: None,
    };
    let segment = EngineSegment {
        location: SystemLocation::new(mode, 0),
        start: 0.0,
        stop: span,
        state: y,
    };
    engine.begin(&segment, &chosen).unwrap();
    let mut steps = 0;
    loop {
        steps += 1;
        let guard = match engine.advance().unwrap() {
            Advance::Stepped => continue,
            Advance::Guards(fired) => Some(fired.first()),
            Advance::Stop | Advance::Searched => None,
        };
        return (engine.time(), engine.state().to_vec(), guard, steps);
    }
}

/// Largest energy of the motion. It gives the sizes of the errors.
fn turnover(dynamics: &SystemDynamics, mode: Mode, y: &[f64], end: &[f64]) -> f64 {
    let system = &dynamics.system;
    let outside = dynamics.outside(&SystemLocation::new(mode, 0), 0.0);
    let of = |y: &[f64]| system.kinetic_energy(&outside, y) + system.elastic_energy(y);
    of(y).max(of(end)) + end[system.slip + WORK].abs() + end[system.slip + DAMPING_LOSS].abs()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// Closed forms of stick and separation agree with the Taylor series of any chains over some hundred periods, and
    /// their energy is conserved.
    #[test]
    fn property_closed_forms_are_the_taylor_series(
        rotor in train(), stator in train(), stuck: bool, draws in prop::array::uniform16(-1.0..1.0f64),
        common in prop_oneof![Just(0.0), -100.0..100.0f64], long in 0.0..1.0f64,
    ) {
        prop_assume!(!rotor.is_rigid() || !stator.is_rigid());
        let mode = if stuck { Mode::Stick } else { Mode::Separated };
        let force = if stuck { 1e9 } else { -1.0 };
        let dynamics = Arc::new(SystemDynamics::new(&of_chains(rotor, stator, Drive::Value(force)), 0.0));
        let system = &dynamics.system;
        let y = state(&dynamics, mode, &draws, common);
        if !dynamics.has_closed_form(&SystemLocation::new(mode, 0), 0.0, &y) {
            let walls = [&system.rotor, &system.stator].into_iter().all(|side| side.shafts() == 0);
            prop_assert!(walls, "every system with a shaft has a closed form");
            return Ok(());
        }
        let span = dynamics.unit(0) * 10f64.powf(3.0 * long);
        let (_, taylor, ..) = run(&mut TaylorEngine::new(dynamics.clone()), mode, &y, span);
        let (time, closed, guard, steps) = run(&mut ClosedFormEngine::new(dynamics.clone()), mode, &y, span);
        prop_assert!(time == span && guard.is_none() && steps == 1);
        let energy = turnover(&dynamics, mode, &y, &taylor);
        let mut size = vec![0.0; system.dimension];
        let speed = |inertia: f64| (2.0 * energy / inertia).sqrt();
        let mut angle = span * (y[..system.mechanical()].iter().fold(0.0f64, |most, y| most.max(y.abs())));
        for side in [&system.rotor, &system.stator] {
            let lightest = side.inertia.iter().copied().fold(f64::INFINITY, f64::min);
            for i in 0..side.shafts() {
                size[side.twists + 2 * i] = (2.0 * energy / side.stiffness[i]).sqrt();
                size[side.twists + 2 * i + 1] = speed(lightest);
                angle = angle.max(size[side.twists + 2 * i]);
            }
            if let Some(index) = side.speed {
                size[index] = speed(lightest);
            }
            angle = angle.max(span * speed(lightest));
        }
        size[system.slip..].fill(energy);
        size[system.slip] = angle;
        if let Some(of_stator) = size.get_mut(system.slip + ANGLE) {
            *of_stator = angle;
        }
        // Both methods round the frequencies, so the phases err in proportion to time.
        let tolerance = 1e-13 + 1e-15 * span / dynamics.unit(0);
        for k in 0..system.dimension {
            let error = (closed[k] - taylor[k]).abs();
            prop_assert!(error <= tolerance * size[k], "{k}: {} {} {}", closed[k], taylor[k], size[k]);
        }
        if stuck {
            let outside = dynamics.outside(&SystemLocation::new(mode, 0), span);
            let terms = system.relative_velocity_terms(&outside, &closed);
            // Each term is a sum over up to sixteen modes of both chains, of numbers as large as the terms.
            prop_assert!(system.relative_velocity(&outside, &closed).abs() <= 32.0 * f64::EPSILON * terms);
            prop_assert!(closed[system.slip] == 0.0 && closed[system.slip + FRICTION_LOSS] == 0.0);
        }
        let outside = dynamics.outside(&SystemLocation::new(mode, 0), 0.0);
        let total = |y: &[f64]| {
            let quadratures = &y[system.slip..];
            system.kinetic_energy(&outside, y) + system.elastic_energy(y) + quadratures[DAMPING_LOSS]
                - quadratures[WORK]
        };
        prop_assert!((total(&closed) - total(&y)).abs() <= 1e-14 * energy);
    }

    /// A stick breaks away at the time given by its Taylor series, under a constant, a falling and a rippled force.
    /// The tested torque reaches its limit at that time and not before.
    #[test]
    fn property_breakaway_is_that_of_the_taylor_series(
        rotor in train(), stator in train(), draws in prop::array::uniform16(-1.0..1.0f64), share in 1.01..3.0f64,
        ripple in prop_oneof![Just(0.0), 0.0..0.5f64], test in 0..3usize,
    ) {
        prop_assume!(!rotor.is_rigid() || !stator.is_rigid());
        let mut system = of_chains(rotor, stator, Drive::Value(1.0));
        let probe = SystemDynamics::new(&system, 0.0);
        let y = state(&probe, Mode::Stick, &draws, 0.0);
        let outside = probe.outside(&SystemLocation::new(Mode::Stick, 0), 0.0);
        let transmitted = probe.system.transmitted_torque(&outside, &y);
        let (of_rotor, of_stator) = probe.system.surface_torques(&outside, &y);
        let (test, torque) = [
            (BreakawayTest::Transmitted, transmitted),
            (BreakawayTest::Rotor, of_rotor),
            (BreakawayTest::Stator, of_stator),
        ][test];
        system.breakaway_test = test;
        let force = share * torque.abs().max(1.0) / system.breakaway;
        system.pressing = Pressing::Force(Drive::Wave(Wave {
            shape: HarmonicShape::Cosine,
            mean: force,
            amplitude: ripple * force,
            frequency: Frequency::Angular(0.3 / probe.unit(0)),
            phase: 0.0,
            from: None,
            to: None,
        }));
        let dynamics = Arc::new(SystemDynamics::new(&system, 0.0));
        if !dynamics.has_closed_form(&SystemLocation::new(Mode::Stick, 0), 0.0, &y) {
            return Ok(());
        }
        let span = 200.0 * dynamics.unit(0);
        let (time, end, guard, _) = run(&mut ClosedFormEngine::new(dynamics.clone()), Mode::Stick, &y, span);
        let gap = |t: f64, y: &[f64]| {
            let outside = dynamics.outside(&SystemLocation::new(Mode::Stick, 0), t);
            let torque = match test {
                BreakawayTest::Transmitted => dynamics.system.transmitted_torque(&outside, y),
                BreakawayTest::Rotor => dynamics.system.surface_torques(&outside, y).0,
                BreakawayTest::Stator => dynamics.system.surface_torques(&outside, y).1,
            };
            let limit = dynamics.system.breakaway_torque(1.0, outside.normal_force);
            (limit - torque.abs(), limit)
        };
        let mut inside = y.clone();
        for k in 0..500 {
            let t = time * f64::from(k) / 500.0;
            dynamics.closed_state(&SystemLocation::new(Mode::Stick, 0), &y, t, &mut inside);
            let (gap, limit) = gap(t, &inside);
            prop_assert!(gap >= -1e-12 * limit, "{t}: {gap} {limit}");
        }
        if guard.is_some() {
            let (gap, limit) = gap(time, &end);
            prop_assert!(gap.abs() <= 1e-12 * limit);
        }
        if test == BreakawayTest::Transmitted {
            let (other, _, by_series, _) = run(&mut TaylorEngine::new(dynamics.clone()), Mode::Stick, &y, span);
            // If the torque only just reaches its limit, rounding decides the time, and whether the limit is reached.
            let h = 1e-6 * dynamics.unit(0);
            dynamics.closed_state(&SystemLocation::new(Mode::Stick, 0), &y, (time - h).max(0.0), &mut inside);
            let slope = gap((time - h).max(0.0), &inside).0 / h;
            let (_, limit) = gap(time, &end);
            if slope * dynamics.unit(0) > 1e-3 * limit {
                prop_assert_eq!(guard, by_series);
                let rounding = 1e-13 * limit / slope;
                prop_assert!((time - other).abs() <= 1e-14 * time + rounding, "{time} {other} {rounding}");
            }
        }
    }
}

/// A stick whose motion has died takes one step to any time under a constant force, and also under a ripple.
#[test]
fn analytic_a_stick_that_never_ends_is_one_step() {
    let mut block = systems::train(&[1.0], &[1e6], &[10.0], End::Fixed);
    let signal = Drive::Value(2.0);
    block.torque = Some(Torque { signal, on: 0 });
    let force = Drive::Wave(Wave {
        mean: 20.0,
        ..wave(HarmonicShape::Sine, 10.0, Frequency::Angular(3.0), 0.0)
    });
    let two = of_chains(block.clone(), block, force);
    let dynamics = Arc::new(SystemDynamics::new(&two, 0.0));
    // The blocks lie between two walls, and their twists sum to 4e-6 rad. Both torques push them the same way.
    let y = [3e-6, 0.0, 1e-6, 0.0, 0.0, 0.0, 0.0, 0.0];
    let (time, end, guard, steps) = run(&mut ClosedFormEngine::new(dynamics), Mode::Stick, &y, 1e9);
    assert_eq!((time, guard, steps), (1e9, None, 1));
    assert!(end[0].abs() < 1e-20 && (end[2] - 4e-6).abs() < 1e-20, "{end:?}");
    // The blocks have moved by 3e-6 rad against 4 N m.
    assert!((end[4 + WORK] - 12e-6).abs() < 1e-19, "{end:?}");
}
