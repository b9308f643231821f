//! Derivatives of cycles and of events through every event agree with differences of the flow to eight digits.

use crate::common::cases::{near, parsed, recorded, source};
use crate::common::random_brakes::Random;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use stickslip::analysis::linearised::linearise;
use stickslip::case::WrittenCase;
use stickslip::cycle::{CycleSearch, CycleStability, Family, MultiplierKind, Orbit, find};
use stickslip::model::system::System;
use stickslip::numerics::eigenvalues::eigenvalues;
use stickslip::record::EventKind;
use stickslip::simulation::{Method, MovedCases, MovedSystem, WantedResults, shoot};

/// Error of a derivative, relative to the largest derivative of its kind.
const EIGHT_DIGITS: f64 = 1e-8;

/// A difference is trusted if two steps, one half of the other, agree to this relative error.
const TRUSTED: f64 = 2e-9;

/// Relative change of a parameter in differences of fourth order, as in a study.
const WIDTH: f64 = 1.0 / 262_144.0;

/// A random motion on a belt or the ground. No inertia is a power of two, so quotients such as k/m are rounded.
fn drawn(index: u64) -> String {
    let mut random = Random(50_000 + index);
    let mut number = |low: f64, high: f64| format!("{:.4}", random.within(low, high)).parse::<f64>().unwrap();
    let (mass, own, ratio) = (number(0.3, 3.0), number(1.0, 15.0), number(0.002, 0.1));
    let (stiffness, damping) = (mass * own * own, 2.0 * ratio * mass * own);
    let (kinetic, drop, above) = (number(0.1, 0.6), number(0.01, 0.4), number(0.01, 0.3));
    let low_speed = kinetic + drop;
    let force = number(0.5, 20.0);
    // Slips of some size: the belt moves by a fraction of the static stretch within a radian.
    let stretch = (low_speed + above) * force / (mass * own);
    let speed = number(0.03, 0.6) * stretch;
    let omega = own * number(0.15, 1.7);
    let constant = index.is_multiple_of(2);
    let friction = match index % 4 {
        0 => format!(
            "law = 'coulomb'\nbreakaway = {:?}\nkinetic = {kinetic:?}",
            kinetic + above
        ),
        1 => format!(
            "law = 'hyperbolic'\nbreakaway = {:?}\nlow_speed = {low_speed:?}\nhigh_speed = {kinetic:?}\nscale = {:?}",
            low_speed + above,
            speed * number(0.5, 3.0)
        ),
        2 => format!(
            "law = 'exponential'\nbreakaway = {low_speed:?}\nlow_speed = {low_speed:?}\nhigh_speed = {kinetic:?}\ndecay = {:?}",
            number(0.3, 2.0) / speed
        ),
        _ => format!(
            "law = 'stribeck'\nbreakaway = {:?}\nlow_speed = {low_speed:?}\nhigh_speed = {kinetic:?}\nscale = {:?}\n\
             exponent = 2\nviscous = 0.001",
            low_speed + above,
            speed * number(0.5, 3.0)
        ),
    };
    let wave = |mean: f64, share: f64| {
        format!(
            "{{ profile = 'sine', mean = {mean:?}, amplitude = {:?}, angular_frequency = {omega:?} }}",
            mean * share
        )
    };
    let share = number(0.05, 0.7);
    let mass_on = |start: f64| {
        format!("inertia = {mass:?}\nstiffness = {stiffness:?}\ndamping = {damping:?}\nend = 'fixed'\n")
            + &match start {
                0.0 => String::new(),
                start => {
                    format!("torque = {{ profile = 'cosine', amplitude = {start:?}, angular_frequency = {omega:?} }}\n")
                }
            }
    };
    let belt = |speed: &str| format!("end = 'driven'\nspeed = {speed}\n");
    let steady = format!("{speed:?}");
    let (rotor, stator, pressed) = match index % 5 {
        0 => (belt(&steady), mass_on(0.0), wave(force, share)),
        1 => (belt(&wave(speed, 2.0 * share)), mass_on(0.0), format!("{force:?}")),
        2 => (
            "end = 'fixed'\n".to_owned(),
            mass_on(force * (0.6 + kinetic + low_speed)),
            format!("{force:?}"),
        ),
        3 => (
            belt(&steady),
            format!(
                "inertia = [{mass:?}, {:?}]\nstiffness = [{stiffness:?}, {:?}]\ndamping = [{damping:?}, {:?}]\nend = 'fixed'\n",
                mass * 1.7,
                stiffness * 0.9,
                damping * 1.3
            ),
            if constant {
                format!("{force:?}")
            } else {
                wave(force, share)
            },
        ),
        _ => (
            format!(
                "inertia = {:?}\nstiffness = {:?}\ndamping = {damping:?}\n{}",
                mass * 1.3,
                stiffness * 7.3,
                belt(&steady)
            ),
            mass_on(0.0),
            if constant {
                format!("{force:?}")
            } else {
                wave(force, share)
            },
        ),
    };
    let end = 40.0 * std::f64::consts::TAU / omega.min(own);
    format!(
        "motion = 'translation'\n[rotor]\n{rotor}[stator]\n{stator}[contact]\nnormal_force = {pressed}\n[friction]\n{friction}\n\
         [output]\nend_time = {end:?}\n"
    )
}

/// Central difference of sixth order with the step `h`.
fn central(of: &dyn Fn(f64) -> Option<DVector<f64>>, h: f64) -> Option<DVector<f64>> {
    let pair = |k: f64| Some(of(k * h)? - of(-k * h)?);
    Some((pair(1.0)? * 0.75 - pair(2.0)? * 0.15 + pair(3.0)? / 60.0) / h)
}

/// Derivative of a flow at 0, with its error; `None` if no step has the same events on both sides.
fn derivative(of: &dyn Fn(f64) -> Option<DVector<f64>>) -> Option<(DVector<f64>, f64)> {
    let mut best: Option<(DVector<f64>, f64)> = None;
    let mut before: Option<DVector<f64>> = None;
    for halvings in 6..14 {
        let Some(now) = central(of, 0.5f64.powi(halvings)) else {
            continue;
        };
        if let Some(before) = before {
            let error = (&now - before).amax();
            if best.as_ref().is_none_or(|best| error < best.1) {
                best = Some((now.clone(), error));
            }
        }
        before = Some(now);
    }
    best
}

/// A parameter moved to both sides, as the program moves it; `None` near a limit of the parameter.
fn moved(written: &WrittenCase, path: &str, value: f64) -> Option<MovedCases> {
    let h = WIDTH * value.abs();
    let copy = |steps: f64, weight: f64| {
        let (system, threshold) = written.moved(path, value + steps * h)?;
        Some(MovedSystem {
            system,
            threshold,
            weight: weight / h,
            bend: 1.0,
        })
    };
    let all = [
        (1.0, 2.0 / 3.0),
        (-1.0, -2.0 / 3.0),
        (2.0, -1.0 / 12.0),
        (-2.0, 1.0 / 12.0),
    ];
    let copies = all.map(|(steps, weight)| copy(steps, weight));
    Some(MovedCases {
        copies: copies.into_iter().collect::<Option<_>>()?,
        rounded: None,
    })
}

/// Largest difference of two matrices; infinite if an element is NaN.
fn apart(one: &[f64], other: &[f64]) -> f64 {
    let distances = one.iter().zip(other).map(|(a, b)| (a - b).abs());
    distances.fold(0.0, |most, distance| {
        if distance.is_nan() {
            f64::INFINITY
        } else {
            distance.max(most)
        }
    })
}

fn orbit_of(text: &str) -> Option<(WrittenCase, Orbit)> {
    let written = WrittenCase::read(&source(text), &[]).unwrap();
    let family = Family::new(written.clone(), &[]).unwrap();
    let orbit = find(&family, &[], &CycleSearch::default(), &|| false).ok()?;
    Some((written, orbit))
}

/// Largest error of the derivatives of a cycle's period map with respect to the state and to two parameters, relative
/// to the largest derivative. `None` without a cycle that has events, or near a border, where differences have other
/// events.
fn error_of_cycle(index: u64) -> Option<Result<f64, String>> {
    let text = drawn(index);
    let (written, orbit) = orbit_of(&text)?;
    if orbit.events.is_empty() {
        return None;
    }
    let system = &written.case().system;
    let in_motion = |path: &str| !path.starts_with("initial") && !path.starts_with("output");
    let numbers = written.numbers().iter();
    let numbers = numbers.filter(|number| number.value != 0.0 && in_motion(&number.path));
    let numbers = numbers.filter_map(|number| Some((number, moved(&written, &number.path, number.value)?)));
    let numbers: Vec<_> = numbers.collect();
    let picked = [0, 1].map(|k| (index as usize * 7 + k * 3) % numbers.len());
    let picked = numbers.into_iter().enumerate().filter(|(k, _)| picked.contains(k));
    let (chosen, copies): (Vec<_>, Vec<_>) = picked.map(|(_, number)| number).unzip();
    let state = DVector::from_column_slice(&orbit.state);
    let shot = |system: &System, state: &DVector<f64>, derivatives: Option<&[MovedCases]>| {
        let wanted = WantedResults {
            derivatives,
            extrema: false,
            stop: &|| false,
        };
        shoot((system, 0.0), (orbit.time, state), orbit.period, wanted).ok()
    };
    let own = shot(system, &state, Some(&copies))?;
    let kinds =
        |shot: &stickslip::simulation::Shot| shot.events.iter().map(|event| event.kind).collect::<Vec<EventKind>>();
    let n = state.len();
    let sizes = own.sizes.iter();
    let sizes: Vec<f64> = sizes.map(|&size| if size > 0.0 { size } else { 1.0 }).collect();
    let end = |system: &System, state: &DVector<f64>| {
        let shot = shot(system, state, None)?;
        (kinds(&shot) == kinds(&own)).then(|| DVector::from_fn(n, |i, _| shot.end[i] / sizes[i]))
    };
    let mut matrix = DMatrix::zeros(n, n);
    let (mut worst, mut uncertain) = (0.0f64, 0.0f64);
    for k in 0..n {
        let (column, error) = derivative(&|h| {
            let mut state = state.clone();
            state[k] += h * sizes[k];
            end(system, &state)
        })?;
        matrix.set_column(k, &column);
        uncertain = uncertain.max(error);
    }
    let scaled = DMatrix::from_fn(n, n, |i, j| own.by_state[(i, j)] * sizes[j] / sizes[i]);
    let largest = matrix.amax();
    if uncertain > TRUSTED * largest {
        return None;
    }
    worst = worst.max(apart(scaled.as_slice(), matrix.as_slice()) / largest);
    for (column, number) in chosen.iter().enumerate() {
        let (expected, error) = derivative(&|h| {
            let (system, _) = written.moved(&number.path, number.value * (1.0 + h))?;
            end(&system, &state)
        })?;
        let found = DVector::from_fn(n, |i, _| own.by_number[(i, column)] * number.value / sizes[i]);
        let largest = expected.amax().max(matrix.amax());
        if error > TRUSTED * largest {
            return None;
        }
        worst = worst.max(apart(found.as_slice(), expected.as_slice()) / largest);
    }
    if worst > EIGHT_DIGITS {
        let multipliers = orbit.multipliers.iter();
        let multipliers = multipliers.map(|one| format!("{:.9}{:+.9}i", one.real, one.imaginary));
        let expected = eigenvalues(&matrix);
        return Some(Err(format!(
            "cycle {index}: off by {worst:.1e}; multipliers {:?}, differences have {expected:?}\n{text}",
            multipliers.collect::<Vec<_>>()
        )));
    }
    Some(Ok(worst))
}

/// Largest error of d(time)/d(parameter) for a run's first events, relative to the largest derivative by the
/// parameter, or to time/parameter.
fn error_of_events(index: u64) -> Option<Result<f64, String>> {
    let text = drawn(index);
    let whole = WrittenCase::read(&source(&text), &[]).unwrap();
    let end = whole.case().output.end_time / 8.0;
    let short = WrittenCase::read(&source(&text), &parsed(&[format!("output.end_time={end:?}")])).unwrap();
    let linearised = linearise(&short, None, &|| false).ok()?;
    let numbers: Vec<_> = linearised
        .parameters
        .iter()
        .enumerate()
        .filter(|(_, number)| {
            number.value != 0.0 && !number.path.starts_with("initial") && !number.path.starts_with("output")
        })
        .collect();
    let own: Vec<EventKind> = linearised.events.iter().map(|event| event.kind).collect();
    if own.is_empty() {
        return None;
    }
    let mut worst = 0.0f64;
    for k in 0..2 {
        let (column, number) = numbers[(index as usize * 5 + k * 4) % numbers.len()];
        let times = |h: f64| {
            let mut case = short.with(&number.path, number.value * (1.0 + h)).ok()?;
            (case.solver.method, case.solver.rtol) = (Method::Series, 1e-13);
            let events = recorded(&case).events;
            let same = events.iter().map(|event| event.kind).eq(own.iter().copied());
            same.then(|| DVector::from_iterator(events.len(), events.iter().map(|event| event.time)))
        };
        let (expected, error) = derivative(&times)?;
        let largest = expected.amax().max(0.1 * end);
        if error > TRUSTED * largest {
            return None;
        }
        for (event, expected) in expected.iter().enumerate() {
            let slope = linearised.slope(event, column);
            let off = (slope.value * number.value - expected).abs() / largest;
            if off.is_nan() || off > EIGHT_DIGITS {
                return Some(Err(format!(
                    "run {index}: {} at event {event}: {:e} instead of {expected:e}\n{text}",
                    number.path,
                    slope.value * number.value
                )));
            }
            worst = worst.max(off);
        }
    }
    Some(Ok(worst))
}

#[track_caller]
fn hold(what: &str, count: usize, of: impl Fn(u64) -> Option<Result<f64, String>> + Sync) {
    let mut held: Vec<Result<f64, String>> = Vec::new();
    let (mut next, batch) = (0, count.min(32) as u64);
    while held.len() < count {
        let more: Vec<_> = (next..next + batch).into_par_iter().filter_map(&of).collect();
        held.extend(more);
        next += batch;
        assert!(
            next < 100 * count as u64,
            "{what}: only {} can be held against differences",
            held.len()
        );
    }
    let worst = held.iter().flatten().fold(0.0f64, |worst, error| worst.max(*error));
    let wrong: Vec<&String> = held.iter().filter_map(|one| one.as_ref().err()).collect();
    println!(
        "{what}: {} of {next} held, {} wrong, within {worst:.1e}",
        held.len(),
        wrong.len()
    );
    assert!(
        wrong.is_empty(),
        "{what}: {} of {} wrong\n{}",
        wrong.len(),
        held.len(),
        wrong[0]
    );
}

#[test]
fn property_derivatives_of_random_cycles_are_those_of_the_flow() {
    hold("cycles", 8, error_of_cycle);
    hold("runs", 4, error_of_events);
}

#[test]
#[ignore = "takes minutes"]
fn property_long_derivatives_of_random_cycles_are_those_of_the_flow() {
    hold("cycles", 200, error_of_cycle);
    hold("runs", 200, error_of_events);
}

/// A mass that sticks to a rigid surface has two eigenvalues of zero, which the rounding of k/m makes tiny. Its stick
/// ends when a signal changes: the normal force, or the speed of the belt.
#[test]
fn property_multipliers_of_a_stick_that_ends_by_a_signal() {
    let pressed = |mass: f64| {
        format!(
            "motion = 'translation'\n[rotor]\nend = 'driven'\nspeed = 0.06\n[stator]\nend = 'fixed'\ninertia = {mass:?}\n\
             stiffness = 9.7\ndamping = 0.08\n[contact]\nnormal_force = {{ profile = 'sine', mean = 2.0, amplitude = 1.2, \
             angular_frequency = 2.0 }}\n[friction]\nlaw = 'coulomb'\nbreakaway = 0.85\nkinetic = 0.6\n[initial]\n\
             stator_speed = 0.06\n[output]\nend_time = 240.0\n"
        )
    };
    let belt = "motion = 'translation'\n[rotor]\nend = 'driven'\nspeed = { profile = 'sine', mean = 1.0533, amplitude = \
                0.5113058858976764, angular_frequency = 3.426640441777496 }\n[stator]\nend = 'fixed'\ninertia = 1.1511\n\
                stiffness = 5.5582\ndamping = 0.04198862953409173\n[contact]\nnormal_force = 16.1299\n[friction]\nlaw = \
                'coulomb'\nbreakaway = 0.3874\nkinetic = 0.1191\n[initial]\nstator_speed = 1.0533\n[output]\nend_time = 428.9\n";
    for (text, multiplier) in [
        (pressed(0.65), -0.517584950),
        (pressed(0.1), -0.048158),
        (belt.to_owned(), -0.108926),
    ] {
        let (_, orbit) = orbit_of(&text).unwrap();
        let mut multipliers = orbit.multipliers.iter();
        let free = multipliers.find(|one| one.kind == MultiplierKind::Free).unwrap();
        near(free.real, multiplier, 6e-7);
        assert_eq!(orbit.stability, CycleStability::Stable);
    }
}
