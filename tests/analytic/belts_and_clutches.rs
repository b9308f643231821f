//! Runs of belts, clutches, blocks and drill strings against closed forms, and in one case against the oracle's
//! samples. Published numbers: `published/problems`.

use crate::common::cases::{
    attractor, built_in, by, expect, kinds, near, parsed, recorded, reported, summary, written,
};
use num_rational::BigRational;
use std::f64::consts::{PI, TAU};
use std::ops::ControlFlow;
use stickslip::Run;
use stickslip::analysis::Outcome;
use stickslip::analysis::witness::{Sequence, Testimony, witness};
use stickslip::case::builtin::TRAINS;
use stickslip::case::{Case, CaseSource};
use stickslip::oracle::{self, OracleOptions};
use stickslip::record::{Channels, Event, EventKind, Recorder as _};
use stickslip::simulation::Method;

/// The error of the series is rounding: some units in the last place of the time (1.4e-14 s at 100 s) at each of some
/// tens of events.
const SERIES: f64 = 1e-12;

/// The promise of `arkode` with default settings: 1e-9 s.
const PROMISED: f64 = 1e-9;

fn with(case: &Case, method: &str) -> Case {
    by(case, Method::from_name(method).unwrap())
}

fn case_by(name: &str, method: &str, settings: &[&str]) -> Case {
    with(&built_in(name, settings), method)
}

fn case_of(text: &str, method: &str) -> Case {
    with(&written(text, &[]), method)
}

fn energies(c: &Channels) -> [f64; 5] {
    [
        c.energy_kinetic,
        c.energy_elastic,
        c.work_applied,
        c.dissipated_friction,
        c.dissipated_damping,
    ]
}

// Masses on a belt.

/// A mass on a spring, on a ground that holds it less one way than the other: each half swing takes 2 mu_d F_n/k of its own sense
/// from the amplitude, until the spring is below the breakaway force of the sense in which it pulls.
#[test]
fn analytic_asymmetric_friction_takes_its_own_share_of_each_half_swing() {
    let (mass, stiffness, force, start) = (2.0, 50.0, 10.0, 1.0);
    // omega_r is minus the speed of the mass: from x > 0 it slides forward. Kinetic and breakaway coefficients.
    let (forward, backward) = ((0.3, 0.9), (0.1, 0.25));
    let text = format!(
        r#"
title = "a mass on a ground with a grain"
motion = "translation"
rotor = {{ end = "fixed" }}
stator = {{ inertia = {mass}, stiffness = {stiffness}, end = "fixed" }}
contact = {{ normal_force = {force} }}
friction = {{ law = "asymmetric", kinetic = {}, breakaway = {}, kinetic_backward = {}, breakaway_backward = {} }}
initial = {{ stator_twist = {start} }}
output = {{ end_time = 10.0 }}
"#,
        forward.0, forward.1, backward.0, backward.1
    );
    let half = PI * f64::sqrt(mass / stiffness);
    let (mut x, mut expected): (f64, Vec<(EventKind, f64)>) = (start, Vec::new());
    while expected.last().is_none_or(|event| event.0 != EventKind::Stick) {
        let taken = if x > 0.0 { forward.0 } else { backward.0 };
        x = -x.signum() * (x.abs() - 2.0 * taken * force / stiffness);
        let holds = if x > 0.0 { forward.1 } else { backward.1 };
        let kind = match stiffness * x.abs() <= holds * force {
            true => EventKind::Stick,
            false => EventKind::Reversal,
        };
        expected.push((kind, (expected.len() + 1) as f64 * half));
    }
    assert_eq!(expected.len(), 12);
    for (method, within) in [
        ("series", SERIES),
        ("cvode", PROMISED),
        ("arkode", PROMISED),
        ("erk", PROMISED),
        ("cvode-adams", 1e-7),
        ("cvode-bdf", 1e-7),
        ("esdirk", 1e-7),
    ] {
        let recorder = recorded(&case_of(&text, method));
        expect(&recorder.events, &expected, within);
        near(recorder.samples.last().unwrap().state.phi1, x, 1e-6);
    }
}

/// The belt that runs backward, with the coefficients exchanged, is the mirror image of the belt that runs forward.
#[test]
fn property_exchanged_coefficients_mirror_the_motion() {
    let of = |settings: &str, method: &str| {
        let settings: Vec<&str> = settings.split(' ').collect();
        recorded(&case_by("belt-coulomb", method, &settings)).events
    };
    let one = "friction.law=asymmetric friction.kinetic=0.3 friction.breakaway=0.4 friction.kinetic_backward=0.1 \
               friction.breakaway_backward=0.2";
    let other = "friction.law=asymmetric friction.kinetic=0.1 friction.breakaway=0.2 friction.kinetic_backward=0.3 \
                 friction.breakaway_backward=0.4";
    let same = "friction.law=asymmetric friction.kinetic=0.3 friction.breakaway=0.4 friction.kinetic_backward=0.3 \
                friction.breakaway_backward=0.4";
    for method in ["series", "cvode", "arkode"] {
        let forward = of(one, method);
        let mirrored = of(
            &format!("{other} rotor.speed=-0.1 initial.stator_twist=-0.02 initial.stator_speed=-0.1"),
            method,
        );
        let times = |events: &[Event]| events.iter().map(|event| (event.kind, event.time)).collect::<Vec<_>>();
        assert!(forward.len() > 10);
        assert_eq!(times(&forward), times(&mirrored), "{method}");
        // Equal coefficients are Coulomb's law, to the last bit.
        let coulomb = of("friction.kinetic=0.3 friction.breakaway=0.4", method);
        assert_eq!(times(&of(same, method)), times(&coulomb), "{method}");
    }
}

/// Slip (pi + 2 atan(v k/(w D)))/w, stick 2 D/(k v), of the built-in numbers and of others. The first stick begins with a slack
/// spring, or in the middle: where the spring has a twist of x it lasts (mu_0 F_n/k - x)/v.
#[test]
fn analytic_mass_on_a_belt_with_coulomb_friction() {
    let others = "stator.inertia=2 stator.stiffness=3 rotor.speed=0.3 contact.normal_force=1 friction.kinetic=0.5 \
                  friction.breakaway=0.8 initial.stator_twist=0.1 initial.stator_speed=0.3 output.end_time=100 \
                  output.interval=1";
    let others: Vec<&str> = others.split(' ').collect();
    // (m, k, v, F_s, F_k, x_0).
    let problems: [(&[&str], [f64; 6], f64); 2] = [
        (&[], [1.0, 100.0, 0.1, 4.0, 3.0, 0.02], 10.0),
        (&others, [2.0, 3.0, 0.3, 0.8, 0.5, 0.1], 100.0),
    ];
    for (settings, [m, k, v, at_rest, sliding, start], end) in problems {
        let w = (k / m).sqrt();
        let drop = at_rest - sliding;
        let slip = (PI + 2.0 * (v * k / (w * drop)).atan()) / w;
        let stick = 2.0 * drop / (k * v);
        let mut expected = Vec::new();
        let mut time = (at_rest / k - start) / v;
        while time < end {
            let kind = if expected.len() % 2 == 0 {
                EventKind::Slip
            } else {
                EventKind::Stick
            };
            expected.push((kind, time));
            time += if kind == EventKind::Slip { slip } else { stick };
        }
        for (method, factor) in [("series", 1.0), ("cvode", 100.0), ("arkode", 100.0)] {
            expect(
                &recorded(&case_by("belt-coulomb", method, settings)).events,
                &expected,
                factor * SERIES,
            );
            let summary = summary(&case_by("belt-coulomb", method, settings));
            let attractor = attractor(&summary);
            near(attractor.period, slip + stick, factor * 1e-13 * end);
            // The position oscillates about F_k/k, with the amplitude of an oscillation through x = F_s/k at the speed
            // of the belt.
            let amplitude = (drop / k).hypot(v / w);
            let extremes = attractor.extremes.as_ref().unwrap();
            // The extremes have the errors of cubics through 4000 points (2e-14 of the amplitude) and of rounding.
            near(extremes.position.0, sliding / k - amplitude, factor * 1e-13);
            near(extremes.position.1, sliding / k + amplitude, factor * 1e-13);
            near(extremes.relative_velocity.1, v + amplitude * w, factor * 1e-12);
            assert_eq!(attractor.sticks, 1);
        }
    }
}

/// Steady sliding is stable above x* = ln(alpha (mu_s - mu_d) F_n/c)/alpha = ln(10)/5. Small deviations grow or decay
/// as exp(-(c + F_n dmu/dx) t/2 m), with the sign of the belt's speed minus 0.46051701859880914 m/s.
#[test]
fn analytic_hopf_speed_of_a_belt() {
    let critical = 10f64.ln() / 5.0;
    for speed in [0.44, critical, 0.48] {
        let mu = 0.2 + 0.2 * (-5.0 * speed).exp();
        let (rest, deviation) = (10.0 * mu / 100.0, 1e-6);
        let decay = (1.0 - 10.0 * (-5.0 * speed).exp()) / 2.0;
        let omega = (100.0 - decay * decay).sqrt();
        let settings = [
            format!("rotor.speed={speed:e}"),
            format!("initial.stator_twist={:e}", rest + deviation),
            "initial.stator_speed=0".to_owned(),
        ];
        let settings: Vec<&str> = settings.iter().map(String::as_str).collect();
        let recorder = recorded(&case_by("belt-exponential", "series", &settings));
        assert_eq!(recorder.events.len(), 0);
        // The size of a damped oscillation. The curvature of the law changes it by the order of the deviation, 1e-4.
        let size = |u: f64, rate: f64| u.hypot((rate + decay * u) / omega);
        let start = size(deviation, 0.0);
        let last = recorder.samples.last().unwrap();
        let end = size(last.state.phi1 - rest, last.state.phi1_dot);
        near((end / start).ln(), -decay * last.time, 1e-4);
    }
}

// The brake, and conservation.

/// `arkode` adds its tolerance, 1e-12 of the speed, where it restarts at the loss of stability; the growth up to the
/// kick multiplies this error. By the series a stick is one step of a closed form; so is the last one, of three
/// seconds.
#[test]
fn analytic_the_paper_brake_has_the_events_of_series_by_the_solvers_of_sundials() {
    // If the margin passes zero where omega_r turns, its zero is ill-conditioned: tests/analytic/loss_of_stability.rs
    // has such cases.
    let sharp = |event: &&Event| !matches!(event.kind, EventKind::Destabilised | EventKind::Restabilised);
    let by = |method| reported(&case_by("paper-si", method, &[]));
    let (expected, by_series) = by("series");
    let events = expected.events.iter();
    let sticks = events.filter(|event| event.kind == EventKind::Stick).count();
    let closed = by_series.work.iter().find(|work| work.solver == "closed-form").unwrap();
    assert_eq!((closed.segments, closed.steps), (sticks as u64, 0));
    for method in ["cvode", "arkode"] {
        let (found, report) = by(method);
        // Only the last stick, which cannot end, is in closed form.
        let closed = report.work.iter().find(|work| work.solver == "closed-form").unwrap();
        assert!(closed.segments <= 2, "{method}: {} segments", closed.segments);
        let [expected, found] = [&expected, &found].map(|run| run.events.iter().filter(sharp).collect::<Vec<_>>());
        assert!(expected.len() > 100 && found.len() == expected.len());
        for (a, b) in found.iter().zip(&expected) {
            assert_eq!((a.kind, a.mode_after), (b.kind, b.mode_after));
            near(a.time, b.time, 1e-11);
            near(a.before.phi1, b.before.phi1, 1e-10);
            // The speed changes by some 14 rad/s^2.
            near(a.before.theta_dot, b.before.theta_dot, 1e-9);
        }
    }
}

/// Kinetic and elastic energy and losses minus works stay constant, in every built-in case. The error of a step of the
/// series is less than 1e-14 of the energies, that of a step of ARKODE 1e-12; some tens of them add up.
#[test]
fn analytic_energy_balances_of_every_built_in_case_of_trains() {
    for case in TRAINS {
        for (method, tolerance) in [("series", 1e-12), ("cvode", 1e-11), ("arkode", 1e-10)] {
            let (recorder, report) = reported(&case_by(case.name, method, &[]));
            let mut size = f64::MIN_POSITIVE;
            for sample in &recorder.samples {
                let c = &sample.channels;
                size = energies(c).iter().fold(size, |size, value| size.max(value.abs()));
                let balance = c.energy_kinetic + c.energy_elastic + c.dissipated_friction + c.dissipated_damping
                    - c.work_applied
                    - c.work_perturbation
                    - report.initial_energy;
                near(balance, c.energy_residual, 1e-13 * size);
            }
            println!(
                "{} by {method}: {:.1e} of {size:.1e} J",
                case.name,
                report.energy_residual / size
            );
            assert!(report.energy_residual < tolerance * size, "{} by {method}", case.name);
        }
    }
}

/// The engine and the vehicle lock by momentum, at 11/12 s with 200/3 rad/s on both sides, and then gain 80/1.7 rad/s
/// per second.
#[test]
fn analytic_a_clutch_locks_by_momentum() {
    for method in ["series", "arkode"] {
        let recorder = recorded(&case_by("clutch", method, &[]));
        expect(
            &recorder.events,
            &[(EventKind::Corner, 0.5), (EventKind::Stick, 11.0 / 12.0)],
            1e-14,
        );
        let locked = &recorder.events[1].after;
        near(locked.phi2_dot, 200.0 / 3.0, 1e-12);
        near(locked.phi1_dot, 200.0 / 3.0, 1e-12);
        let last = recorder.samples.last().unwrap();
        near(
            last.state.theta_dot,
            200.0 / 3.0 + 80.0 / 1.7 * (2.0 - 11.0 / 12.0),
            1e-12,
        );
        for sample in &recorder.samples {
            // The momentum grows by the engine's torque, whatever the clutch does.
            let momentum = 0.2 * sample.state.phi2_dot + 1.5 * sample.state.phi1_dot;
            near(momentum, 40.0 + 80.0 * sample.time, 1e-12 * 200.0);
        }
    }
}

/// A clutch that nothing drives: its torque T = mu r F_n is constant, omega_r = omega - T (1/J_1 + 1/J_2) t, and friction
/// turns omega_r T into heat until it locks. What it has then turned into heat is J_1 J_2/(J_1 + J_2) omega^2/2.
#[test]
fn analytic_the_power_of_a_clutch_is_torque_times_slip() {
    let text = "[rotor]\ninertia = 0.2\nend = \"free\"\n[stator]\ninertia = 1.5\nend = \"free\"\n[contact]\nradius = 0.1\n\
                normal_force = 5e3\n[friction]\nlaw = \"coulomb\"\nbreakaway = 0.3\nkinetic = 0.3\n[initial]\nspeed = 200\n\
                [output]\nend_time = 0.5\ninterval = 1e-2\n";
    let (torque, omega, rate) = (150.0, 200.0, 1.0 / 0.2 + 1.0 / 1.5);
    for method in ["series", "cvode", "arkode"] {
        let case = case_of(text, method);
        let rows = recorded(&case);
        let (mut slipping, mut last) = (0, 0.0);
        for sample in &rows.samples {
            let slip = (omega - torque * rate * sample.time).max(0.0);
            near(sample.channels.contact_power, torque * slip, 1e-8 * torque * omega);
            assert!(sample.channels.contact_power.is_sign_positive(), "{method}");
            slipping += usize::from(slip > 0.0);
            last = sample.channels.dissipated_friction;
        }
        assert!(slipping > 20 && slipping < rows.samples.len(), "{method}: {slipping}");
        near(last, 0.5 * omega * omega / rate, 1e-8 * torque * omega);
    }
}

/// A mass that nothing holds, on a belt that goes at 1 + cos(2 pi t) up to 2 s and at 1 from then on: it rides along, slips where
/// the belt's speed falls from 2 to 1, and sticks again after 1/(mu_d g) s.
#[test]
fn analytic_a_driven_speed_that_jumps() {
    let case = written(
        r#"
title = "a belt that jumps"
motion = "translation"
rotor = { end = "driven", speed = { profile = "cosine", mean = 1.0, amplitude = 1.0, frequency = 1.0, to = 2.0 } }
stator = { inertia = 2.0, end = "free" }
contact = { normal_force = 20.0 }
friction = { law = "coulomb", breakaway = 0.7, kinetic = 0.4 }
initial = { stator_speed = 2.0 }
output = { end_time = 3.0 }
"#,
        &[],
    );
    for method in ["series", "arkode"] {
        let recorder = recorded(&with(&case, method));
        let events = recorder.events.iter().filter(|event| event.kind != EventKind::Corner);
        let of_contact: Vec<Event> = events.copied().collect();
        for event in &recorder.events {
            println!("{:.16} {:?} {:?}", event.time, event.kind, event.mode_after);
        }
        expect(&of_contact, &[(EventKind::Slip, 2.0), (EventKind::Stick, 2.25)], 1e-14);
        near(of_contact[0].after.relative_velocity, -1.0, 1e-14);
        near(of_contact[1].after.phi1_dot, 1.0, 1e-14);
        let last = recorder.samples.last().unwrap().state;
        // The belt has moved by 2 m and 1 m; the mass by the same distance before the jump, and then by 1.5/4 + 3/4 m.
        near(last.phi2, 3.0, 1e-13);
        near(last.slip_displacement, -0.125, 1e-13);
    }
}

/// A mass without spring, pressed on a belt by F cos(omega t), from rest. The contact opens at pi/(2 omega) and closes
/// half a period later, and so on; in each half period of contact the mass gains 2 mu F/(m omega), in the first one
/// half of it.
#[test]
fn analytic_a_normal_force_opens_and_closes_the_contact() {
    let case = written(
        r#"
title = "a belt that is touched"
motion = "translation"
rotor = { end = "driven", speed = 50.0 }
stator = { inertia = 2.0, end = "free" }
contact = { normal_force = { profile = "cosine", amplitude = 10.0, angular_frequency = 3.0 } }
friction = { law = "coulomb", breakaway = 0.4, kinetic = 0.3 }
output = { end_time = 10.0 }
"#,
        &[],
    );
    for (method, within) in [("series", 1e-13), ("cvode", 1e-12), ("arkode", 1e-12)] {
        let recorder = recorded(&with(&case, method));
        let quarter = PI / 6.0;
        let expected: Vec<_> = (0..9)
            .map(|k| {
                let kind = if k % 2 == 0 {
                    EventKind::Separation
                } else {
                    EventKind::Contact
                };
                (kind, f64::from(2 * k + 1) * quarter)
            })
            .collect();
        let events = &recorder.events[..9];
        expect(events, &expected, within);
        for (k, event) in events.iter().enumerate() {
            let halves = (k / 2) as f64;
            near(
                event.before.phi1_dot,
                (1.0 + 2.0 * halves) * 0.3 * 10.0 / (2.0 * 3.0),
                within,
            );
        }
    }
}

/// A block on rigid ground under F_n = 0.5 + sin(omega t). Friction stops it, and nothing else acts on it: it then
/// stays at rest, and its contact opens and closes where the sine is -1/2. The torque and its limit fall to zero at
/// the same instant.
#[test]
fn analytic_a_block_at_rest_stays_there_while_its_contact_opens_and_closes() {
    let omega = 4.643;
    // From rest; from sliding; from sliding with a bearing.
    for (speed, viscous) in [(0.0, 0.0), (0.1, 0.0), (0.1, 0.2)] {
        let case = written(
            &format!(
                r#"
title = "a block whose normal force comes and goes"
motion = "translation"
rotor = {{ end = "free", inertia = 1.0, viscous = {viscous} }}
stator = {{ end = "fixed" }}
contact = {{ normal_force = {{ profile = "sine", mean = 0.5, amplitude = 1.0, angular_frequency = {omega} }} }}
friction = {{ breakaway = 0.8, low_speed = 0.8, high_speed = 0.3, decay = 7.0 }}
initial = {{ speed = {speed} }}
output = {{ end_time = 20.0, interval = 1.0 }}
"#
            ),
            &[],
        );
        let mut expected = Vec::new();
        for turn in 0..15 {
            let turns = TAU * f64::from(turn);
            expected.push((EventKind::Separation, (turns + 7.0 / 6.0 * PI) / omega));
            expected.push((EventKind::Contact, (turns + 11.0 / 6.0 * PI) / omega));
        }
        expected.retain(|(_, time)| *time < 20.0);
        for method in ["series", "arkode", "erk", "esdirk", "cvode", "cvode-adams"] {
            let recorder = recorded(&with(&case, method));
            let (before, events) = recorder.events.split_at(usize::from(speed != 0.0));
            assert!(before.iter().all(|event| event.kind == EventKind::Stick));
            expect(events, &expected, 1e-14);
            for event in events {
                assert_eq!((event.before.phi2_dot, event.after.phi2_dot), (0.0, 0.0));
            }
        }
    }
}

/// In a stick between tied ends every position follows from the positions of the ends. Rounding does not add up,
/// however long the stick lasts. A mass on a shaken plate has the plate's position, (1 - cos 20 t)/20; two masses
/// share one position.
#[test]
fn analytic_a_stick_between_shaken_ends_does_not_drift() {
    let case = |rotor: &str| {
        written(
            &format!(
                r#"
title = "stick between two shaken ends"
motion = "translation"
rotor = {{ end = "driven", speed = {{ profile = "sine", amplitude = 1.0, angular_frequency = 20.0 }}{rotor} }}
stator = {{ end = "fixed", inertia = 1.0, stiffness = 100.0 }}
contact = {{ normal_force = 1000.0 }}
friction = {{ law = "coulomb", breakaway = 0.5, kinetic = 0.4 }}
output = {{ end_time = 500.0, interval = 10.0 }}
solver = {{ method = "series" }}
"#
            ),
            &[],
        )
    };
    let (shaken, report) = reported(&case(""));
    assert!(shaken.events.is_empty(), "{report:?}");
    // One or two roundings of positions up to 0.1.
    for sample in &shaken.samples {
        near(sample.state.phi1, (1.0 - (20.0 * sample.time).cos()) / 20.0, 1e-16);
    }
    let joined = recorded(&case(
        ", inertia = [2.0, 0.7], stiffness = [300.0, 500.0], damping = [3.0, 2.0]",
    ));
    assert!(joined.events.is_empty());
    for sample in &joined.samples {
        // The masses met without twist. The distance is the sum of three twists.
        near(sample.state.phi2 - sample.state.phi1, 0.0, 3e-16);
    }
}

/// A kick on both surfaces keeps their momentum, a kick on one side leaves the other surface unchanged; omega_r rises
/// by the same amount.
#[test]
fn analytic_kicks_on_one_side() {
    for (on, rotor, stator) in [("both", 0.75, -0.25), ("rotor", 1.0, 0.0), ("stator", 0.0, -1.0)] {
        let case = written(
            &format!(
                r#"
title = "a clutch that is hit"
rotor = {{ inertia = 1.0, end = "free" }}
stator = {{ inertia = 3.0, end = "free" }}
contact = {{ radius = 1.0, normal_force = 2.0 }}
friction = {{ law = "coulomb", breakaway = 0.3, kinetic = 0.3 }}
initial = {{ rotor_speed = 4.0 }}
perturbation = [{{ kind = "kick", time = 1.5, relative_velocity = 1.0, on = "{on}" }}]
output = {{ end_time = 10.0 }}
"#
            ),
            &[],
        );
        let (recorder, report) = reported(&case);
        // omega_r falls by 0.6 + 0.2 per second, from 4 and, after the kick, from 2.8 + 1.
        expect(
            &recorder.events,
            &[(EventKind::Kick, 1.5), (EventKind::Stick, 6.25)],
            1e-12,
        );
        let [kick, stick] = [&recorder.events[0], &recorder.events[1]];
        near(kick.after.phi2_dot - kick.before.phi2_dot, rotor, 1e-14);
        near(kick.after.phi1_dot - kick.before.phi1_dot, stator, 1e-14);
        near(kick.after.relative_velocity - kick.before.relative_velocity, 1.0, 1e-14);
        // The momentum before and that of the kick, over both inertias.
        let common = (4.0 + rotor + 3.0 * stator) / 4.0;
        near(stick.after.phi2_dot, common, 1e-14);
        near(stick.after.phi1_dot, common, 1e-14);
        assert!(report.energy_residual < 1e-14 * 8.0);
    }
}

// Long trains, long runs.

/// The drill string with its pipe in `count - 1` pieces.
fn drill_string(count: usize, end: f64) -> Case {
    let shafts = (count - 1) as f64;
    let list = |values: &[f64]| format!("{values:?}");
    let mut inertia = vec![30.0; count];
    inertia[0] = 374.0;
    inertia[count - 1] = 2122.0;
    let mut viscous = vec![0.0; count];
    viscous[0] = 50.0;
    viscous[count - 1] = 425.0;
    written(
        &format!(
            r#"
title = "a drill string in pieces"
rotor = {{ inertia = {}, stiffness = {}, damping = {}, viscous = {}, end = "free", torque = "6 kN m" }}
stator = {{ end = "fixed" }}
contact = {{ radius = "155.575 mm", normal_force = "53.018 kN" }}
friction = {{ breakaway = 0.8, low_speed = 0.8, high_speed = 0.5, decay = "0.9 s/rad" }}
output = {{ end_time = {end}, interval = 1.0 }}
"#,
            list(&inertia),
            list(&vec![473.0 * shafts; count - 1]),
            list(&vec![23.2 * shafts; count - 1]),
            list(&viscous),
        ),
        &[],
    )
}

/// The cost of a cycle, in evaluations of the right-hand side, does not rise with time: the costs in the last and in
/// the middle third of a run differ by less than a tenth. Nor does any state drift: the energy balance is as good at
/// the end.
#[test]
fn analytic_long_trains_cost_the_same_in_every_cycle() {
    for count in [10, 20] {
        for method in [Method::Series, Method::Arkode] {
            let mut case = drill_string(count, 150.0);
            case.solver.method = method;
            let (recorder, report) = reported(&case);
            let cost = |from: f64, to: f64| {
                let within = recorder.segments.iter().filter(|s| s.start >= from && s.end <= to);
                let (time, work) = within.fold((0.0, 0), |(time, work), s| {
                    (time + s.end - s.start, work + s.counters.rhs_evaluations)
                });
                work as f64 / time
            };
            let (middle, last) = (cost(50.0, 100.0), cost(100.0, 150.0));
            let events = recorder.events;
            let slips = events.iter().filter(|event| event.kind == EventKind::Slip).count();
            println!(
                "{count} by {}: {slips} slips, {middle:.1} and {last:.1} evaluations in a second",
                method.name()
            );
            assert!(slips > 15, "{slips}");
            assert!((last / middle - 1.0).abs() < 0.1, "{middle} {last}");
            let turned_over = recorder.samples.last().unwrap().channels.work_applied;
            assert!(report.energy_residual < 1e-10 * turned_over);
        }
    }
}

// Samples.

/// The states between the events also agree with the oracle: the creep-groaning brake at intervals of 0.1 s.
#[test]
fn multiprecision_samples_of_a_groaning_brake() {
    let settings = ["output.interval=0.1", "solver.method=\"series\""];
    let recorder = recorded(&built_in("groan", &settings));
    let exact = Case::exact(&CaseSource::built_in("groan").unwrap(), &parsed(&settings))
        .unwrap()
        .system;
    let rational = |value: f64| BigRational::from_float(value).unwrap();
    let options = OracleOptions {
        digits: 40,
        end_time: rational(2.0),
        sample_times: recorder.samples.iter().map(|sample| rational(sample.time)).collect(),
        ..OracleOptions::default()
    };
    let truth = oracle::run(&exact, &options, &mut |_| ControlFlow::Continue(())).unwrap();
    assert_eq!(truth.samples.len(), recorder.samples.len());
    for (sample, (_, exact)) in recorder.samples.iter().zip(&truth.samples) {
        let state = &sample.state;
        // Twists are up to 0.05 rad and speeds up to 2 rad/s. At some 1e3 rad/s^2 an event's error of 1e-13 s is 1e-10
        // rad/s.
        near(state.rotor_twist, exact.rotor_twist[0].to_f64(), 1e-12);
        near(state.phi1, exact.stator_twist[0].to_f64(), 1e-12);
        near(state.phi1_dot, exact.stator_speed[0].to_f64(), 1e-10);
        near(state.theta_dot, exact.rotor_speed[1].to_f64(), 1e-10);
        near(state.relative_velocity, exact.relative_velocity.to_f64(), 1e-10);
    }
}

/// The outcome in a case without an attractor.
#[test]
fn analytic_a_clutch_is_stuck_in_the_end() {
    match summary(&built_in("clutch", &[])).outcome {
        Some(Outcome::Stuck { since }) => near(since, 11.0 / 12.0, 1e-14),
        other => panic!("{other:?}"),
    }
}

// Scales: tolerances follow from the motion.

/// The largest differences between a run and one by the series: of events (s), and of works and energies as a share of
/// the energy turnover.
#[track_caller]
fn from_series(case: &Case, method: &str) -> (f64, f64) {
    let (exact, turnover) = reported(&with(case, "series"));
    let (found, report) = reported(&with(case, method));
    assert_eq!(kinds(&found.events), kinds(&exact.events), "{method}");
    let times = found.events.iter().zip(&exact.events);
    let events = times.map(|(a, b)| (a.time - b.time).abs()).fold(0.0, f64::max);
    let rows = found.samples.iter().zip(&exact.samples);
    let same = rows.filter(|(a, b)| a.time == b.time);
    let apart = same.flat_map(|(a, b)| std::iter::zip(energies(&a.channels), energies(&b.channels)));
    let farthest = apart.map(|(a, b)| (a - b).abs()).fold(report.energy_residual, f64::max);
    (events, farthest / turnover.energy_turnover)
}

fn on_a_belt(speed: &str, stator: &str, force: &str, friction: &str, end: &str) -> Case {
    written(
        &format!(
            "title = \"belt\"\nmotion = \"translation\"\n[rotor]\nend = \"driven\"\nspeed = {speed}\n[stator]\nend = \"fixed\"\n\
         {stator}\n[contact]\nnormal_force = {force}\n[friction]\n{friction}\n[output]\nend_time = {end}\ninterval = 0.1\n"
        ),
        &[],
    )
}

/// The stick of a mass on a belt has a double zero among its eigenvalues, which rounding splits; this is no time
/// scale. It once made tolerances of energies 1e5 times too large, and works wrong by 10 to 30 %. Multistep methods
/// keep the balance to some 1e-8.
#[test]
fn property_works_do_not_depend_on_the_eigenvalues_of_a_stick() {
    let cases = [
        on_a_belt(
            "1.0",
            "inertia = 0.7\nstiffness = 100.0\ndamping = 0.3",
            "100.0",
            "law = \"coulomb\"\nbreakaway = 0.6\nkinetic = 0.3",
            "5.0",
        ),
        on_a_belt(
            "0.19",
            "inertia = 0.538\nstiffness = 6957.0\ndamping = 5.746",
            "1.0",
            "breakaway = 6.0\nlow_speed = 6.0\nhigh_speed = 2.0\ndecay = 10.0",
            "3.0",
        ),
    ];
    for case in &cases {
        for method in ["cvode", "cvode-bdf", "cvode-adams", "erk", "esdirk"] {
            let (events, energies) = from_series(case, method);
            println!("{method}: events {events:.1e} s, energies {energies:.1e}");
            // The documents promise this of events; for BDF alone they promise 1e-6 s, and it reaches 1e-8 s here.
            // Energies have the errors that CVODE's step control leaves.
            let bound = if method == "cvode-bdf" { 1e-8 } else { 1e-9 };
            assert!(events < bound, "{method}: {events:e} s");
            assert!(energies < 1e-7, "{method}: {energies:e}");
        }
    }
}

/// A polynomial that is declared valid up to a million times the belt's speed has coefficients of 1e10 up to there.
/// They are no scale of the motion. They once made a run lose events, or find them 2e-2 s off.
#[test]
fn property_digits_do_not_depend_on_where_a_law_ends() {
    let friction =
        "law = \"polynomial\"\nbreakaway = 0.8\nlow_speed = 0.8\nlinear = -0.6\ncubic = 0.1\nvalid_below = 1e6";
    let stator = "inertia = [1.0, 0.7]\nstiffness = [10.0, 3.0]\ndamping = [0.02, 0.02]";
    let case = on_a_belt("0.5", stator, "1.0", friction, "40.0");
    for method in ["cvode", "cvode-adams", "arkode", "erk", "esdirk"] {
        let (events, energies) = from_series(&case, method);
        println!("{method}: events {events:.1e} s, energies {energies:.1e}");
        assert!(events < 1e-9, "{method}: {events:e} s");
        assert!(energies < 1e-7, "{method}: {energies:e}");
    }
}

/// A Stribeck curve whose width is a thousandth or a ten-thousandth of the belt's speed: all stages of a step of the
/// order of a period lie beyond the curve. `arkode` was once 9e-4 s off.
#[test]
fn property_steps_see_a_narrow_friction_law() {
    for scale in ["1e-3", "1e-4"] {
        let friction = format!(
            "law = \"stribeck\"\nbreakaway = 0.5\nlow_speed = 0.5\nhigh_speed = 0.3\nscale = {scale}\nexponent = 2"
        );
        let case = on_a_belt("1.0", "inertia = 1.0\nstiffness = 100.0", "10.0", &friction, "5.0");
        for method in ["arkode", "erk", "cvode"] {
            let (events, _) = from_series(&case, method);
            println!("{scale} {method}: events {events:.1e} s");
            assert!(events < PROMISED, "{method}: {events:e} s");
        }
    }
}

/// A kick throws a mass back through a belt's regularised friction, whose width is a hundredth of the speed. The law
/// itself is constant, and a step whose stages are all on the flat sides of tanh does not see the part between:
/// `arkode` was 6e-9 s off.
#[test]
fn property_steps_see_a_narrow_regularisation() {
    for smoothing in ["tanh", "arctan"] {
        for (scale, kick) in [(0.01, -0.93), (0.002, -0.71)] {
            let case = written(
                &format!(
                    "title = \"thrown back\"\nmotion = \"translation\"\n[rotor]\nend = \"driven\"\nspeed = 1.0\n[stator]\nend = \"fixed\"\n\
                 inertia = 1.0\nstiffness = 100.0\n[contact]\nnormal_force = 10.0\n[friction]\nlaw = \"coulomb\"\nkinetic = 0.3\n\
                 regularisation = {{ function = \"{smoothing}\", speed = {scale} }}\nthreshold = 0.05\n[initial]\nstator_speed = -1.0\n\
                 [output]\nend_time = 2.0\ninterval = 0.1\n[[perturbation]]\nkind = \"kick\"\ntime = 0.3\nrelative_velocity = {kick}\n\
                 on = \"both\"\n"
                ),
                &[],
            );
            for method in ["arkode", "erk", "esdirk", "cvode"] {
                let (events, _) = from_series(&case, method);
                println!("{smoothing} {scale} {method}: events {events:.1e} s");
                assert!(events < PROMISED, "{smoothing} {scale} {method}: {events:e} s");
            }
        }
    }
}

/// A mass that a cosine pushes just beyond the friction of its contact: it slips for 4.6 us at each maximum of the
/// force.
const PUSHED: &str = "title = \"graze\"\nmotion = \"translation\"\n[rotor]\nend = \"fixed\"\n[stator]\nend = \"fixed\"\n\
    inertia = 0.2252\nstiffness = 619.8\ndamping = 1.481\n\
    torque = { profile = \"cosine\", amplitude = 36.87, angular_frequency = 13.47, phase = -2.003 }\ntorque_on = 0\n\
    [contact]\nnormal_force = 83.4540515895505\n[friction]\nlaw = \"polynomial\"\nbreakaway = 0.4418\nlow_speed = 0.4418\n\
    linear = -0.1837\nquadratic = 0.129\nvalid_below = 299700.0\n[output]\nend_time = 0.8683\ninterval = 0.0124\n";

/// Two trains that swing as one and slip once, for 4.4 us, where the torque just reaches its limit.
const SWUNG: &str = "title = \"graze\"\nmotion = \"translation\"\n[rotor]\nend = \"fixed\"\ninertia = [59.16, 22.72]\n\
    stiffness = [118.4, 15810.0]\ndamping = [7.066, 84.22]\n[stator]\nend = \"fixed\"\ninertia = 10.48\nstiffness = 83710.0\n\
    damping = 6.547\nviscous = [13.48]\n\
    torque = { profile = \"sine\", amplitude = 51.4, angular_frequency = 0.4212, phase = 1.511 }\ntorque_on = 0\n\
    [contact]\nnormal_force = 22.047241897583\n[friction]\nlaw = \"exponential\"\nbreakaway = 0.5081\nlow_speed = 0.5081\n\
    high_speed = 0.2287\ndecay = 70.18\n[output]\nend_time = 4.7\ninterval = 0.0671\n";

/// Two driven trains with a first stick of 0.5 us: their speeds just become equal.
const TOUCHED: &str = "title = \"graze\"\nmotion = \"translation\"\n[rotor]\nend = \"driven\"\ninertia = [7.786, 0.2422]\n\
    stiffness = [129000.0, 6269.0]\ndamping = [53.13, 0.3492]\nspeed = 0.0006226\n[stator]\nend = \"driven\"\n\
    inertia = [10.15, 3.377, 0.8998]\nstiffness = [12590.0, 8297.0, 6388.0]\ndamping = [3.174, 9.661, 9.784]\n\
    speed = -0.0006131\n[contact]\nnormal_force = 0.240200328649394\n[friction]\nlaw = \"polynomial\"\nbreakaway = 0.6025\n\
    low_speed = 0.6025\nlinear = -30.69\nquadratic = 3410.0\ncubic = 25090.0\nvalid_below = 1295.0\n\
    [output]\nend_time = 0.5607\ninterval = 0.00801\n";

/// The witness of a run by `cvode` with near misses. If an event is wrong, for example by a loose tolerance, the
/// witness states its error; correct runs get no warning.
#[test]
fn property_a_witness_says_how_far_a_grazing_event_is_off() {
    for (text, rtol, right) in [
        (PUSHED, "1e-10", true),
        (TOUCHED, "1e-10", true),
        (SWUNG, "1e-7", false),
    ] {
        let case = with(&written(text, &[&format!("solver.rtol={rtol}")]), "cvode");
        let (events, _) = from_series(&case, "cvode");
        let mut sequence = Sequence::default();
        Run::new(&case).record(&mut sequence).start().unwrap();
        let said = witness(&case, &sequence, false, &|| false).expect("nobody stops it");
        println!("{}", said.statement);
        if right {
            assert!(events < 1e-9, "{events:e} s");
            assert_eq!(said.testimony, Testimony::SameSequence);
            assert_eq!((said.differs_by, said.differs_by_share), (None, None));
            continue;
        }
        assert_eq!(said.testimony, Testimony::SequenceDiffers);
        let (apart, share) = (said.differs_by.unwrap(), said.differs_by_share.unwrap());
        assert!((apart / events - 1.0).abs() < 1e-3, "{apart:e} s for {events:e} s");
        assert!((share * 4.352e-6 / apart - 1.0).abs() < 0.1, "{share:e} of the slip");
    }
}

/// The witness also compares changes of stability, which are no events of the sequence.
#[test]
fn property_a_witness_compares_changes_of_stability() {
    let case = built_in("paper-si", &["output={end_time=6.97, interval=1}"]);
    let record = recorded(&case);
    let said = |events: &[Event]| {
        let mut sequence = Sequence::default();
        events.iter().for_each(|event| sequence.event(event).unwrap());
        witness(&case, &sequence, false, &|| false).expect("nobody stops it")
    };
    let right = said(&record.events);
    let found = (right.testimony, right.other_stability);
    assert_eq!(found, (Testimony::SameSequence, None));
    let lost = record
        .events
        .iter()
        .position(|event| event.kind == EventKind::Destabilised);
    let lost = lost.expect("a loss of stability");
    let mut more = record.events.clone();
    for kind in [EventKind::Destabilised, EventKind::Restabilised] {
        let time = more[lost].time + 1e-14;
        more.insert(
            lost + 1,
            Event {
                kind,
                time,
                ..more[lost]
            },
        );
    }
    let wrong = said(&more);
    println!("{}", wrong.statement);
    assert!(wrong.statement.len() <= 80);
    assert_eq!(wrong.testimony, Testimony::SequenceDiffers);
    let stability = wrong.other_stability.unwrap();
    assert_eq!((stability.found, stability.expected), (1, 3));
    assert!((stability.from - more[lost].time).abs() < 1e-12);
    assert_eq!(wrong.differs_from, Some(stability.from));
}

/// The force on a mass begins at 0 and rises within `rise` (s) to 2 N from 0.1 s on: the mass stops after 1 s +
/// rise/2.
fn steep(rise: f64) -> String {
    format!(
        "motion = \"translation\"\nrotor = {{ end = \"free\", inertia = \"1 kg\" }}\nstator = {{ end = \"fixed\" }}\n\
         contact = {{ normal_force = {{ profile = \"table\", time = [0, 0.1, {:?}], value = [0, 0, 2] }} }}\n\
         friction = {{ law = \"coulomb\", breakaway = 0.5, kinetic = 0.5 }}\ninitial = {{ speed = \"1 m/s\" }}\n\
         output = {{ end_time = \"2 s\", interval = \"1 ms\" }}\n",
        0.1 + rise
    )
}

/// A force that begins at zero on a steep ramp: its present value would set tolerances below the rounding of the time.
/// Also a step of the force, as two points at one time.
#[test]
fn analytic_a_force_may_begin_on_a_steep_ramp() {
    const STEPS: u64 = 2000;
    for rise in [1e-2, 1e-4, 1e-6, 1e-9, 1e-12, 0.0] {
        let text = steep(rise);
        for method in ["cvode", "series", "arkode", "erk", "esdirk", "cvode-adams", "cvode-bdf"] {
            let (record, report) = reported(&case_of(&text, method));
            let steps: u64 = report.work.iter().map(|work| work.steps).sum();
            println!("{rise:e} s by {method}: {steps} steps");
            let stick = record.events.last().unwrap();
            assert_eq!(stick.kind, EventKind::Stick);
            near(
                stick.time,
                1.1 + rise / 2.0,
                if method == "cvode" { 1e-12 } else { 1e-9 },
            );
            assert!(steps < STEPS, "{rise:e} s by {method}: {steps} steps");
        }
    }
}

/// A mass at rest that is set in motion by a torque, by a spring, or by a belt that starts: within `rise` (s) from 0.1
/// s on.
#[test]
fn analytic_a_torque_or_a_belt_may_begin_on_a_steep_ramp() {
    for rise in [1e-2, 1e-4, 1e-6] {
        let signal = format!(
            "{{ profile = \"table\", time = [0, 0.1, {:?}], value = [0, 0, 2] }}",
            0.1 + rise
        );
        let pushed = format!(
            "motion = \"translation\"\nrotor = {{ end = \"free\", inertia = 1.0, torque = {signal} }}\nstator = {{ end = \"fixed\" \
             }}\ncontact = {{ normal_force = 1.0 }}\nfriction = {{ law = \"coulomb\", breakaway = 0.5, kinetic = 0.5 }}\n\
             output = {{ end_time = 2, interval = 0.1 }}\n"
        );
        let belt = format!(
            "motion = \"translation\"\nrotor = {{ end = \"driven\", speed = {signal} }}\nstator = {{ end = \"fixed\", inertia = 1.0, \
             stiffness = 4.0 }}\ncontact = {{ normal_force = 1.0 }}\nfriction = {{ law = \"coulomb\", breakaway = 0.5, kinetic = \
             0.5 }}\noutput = {{ end_time = 2, interval = 0.1 }}\n"
        );
        for text in [pushed, belt] {
            let exact = reported(&case_of(&text, "series")).0;
            for method in ["cvode", "arkode", "erk", "esdirk"] {
                let (record, report) = reported(&case_of(&text, method));
                let steps: u64 = report.work.iter().map(|work| work.steps).sum();
                println!("{rise:e} s by {method}: {steps} steps");
                assert_eq!(kinds(&record.events), kinds(&exact.events));
                for (own, exact) in record.events.iter().zip(&exact.events) {
                    near(own.time, exact.time, 1e-9);
                }
                assert!(steps < 3000, "{rise:e} s by {method}: {steps} steps");
            }
        }
    }
}

/// Slips of some microseconds. Their speed is below the resolution of a multistep method's tolerances, and the slip is
/// over before the method has left order 1: `cvode` was 1.5e-7 s off, and the run once stood still there. An error of
/// 1e-11 of the torque moves the breakaway of the second case by 6e-9 s, and its stop by twice that. The single
/// multistep methods are off by a third of the slip, or lose it, and report this.
#[test]
fn property_a_slip_of_microseconds_is_right_or_said() {
    for (text, one_step, multistep) in [(PUSHED, 1e-11, 1e-11), (SWUNG, 4e-9, 3e-8)] {
        let case = written(text, &[]);
        for method in ["arkode", "erk", "esdirk", "cvode"] {
            let tolerance = if method == "cvode" { multistep } else { one_step };
            let (events, _) = from_series(&case, method);
            println!("{method}: events {events:.1e} s");
            assert!(events < tolerance, "{method}: {events:e} s");
            assert_eq!(reported(&with(&case, method)).1.grazing, None, "{method}");
        }
        for method in ["cvode-adams", "cvode-bdf"] {
            let grazing = reported(&with(&case, method)).1.grazing;
            println!("{method}: {grazing:?}");
            assert!(grazing.is_some(), "{method}");
        }
    }
    // A breakaway that does not graze.
    let plain = on_a_belt(
        "1.0",
        "inertia = 1.0\nstiffness = 100.0",
        "10.0",
        "law = \"coulomb\"\nbreakaway = 0.5\nkinetic = 0.3",
        "3.0",
    );
    for method in ["cvode", "cvode-adams", "cvode-bdf"] {
        assert_eq!(reported(&with(&plain, method)).1.grazing, None, "{method}");
    }
}

/// A contact without stick that begins at rest leaves it as the square of time. In the first 2e-7 s omega_r, a
/// difference of two speeds, is rounding, and its sign is arbitrary. Each change of sign once ended a segment,
/// thousands of times.
#[test]
fn property_rounding_of_a_speed_at_rest_ends_no_segment() {
    for law in [
        "law = \"hyperbolic\"\nlow_speed = 1.0\nhigh_speed = 0.0\nscale = 0.3\n\
         regularisation = { function = \"arctan\", speed = 1e-3 }",
        "law = \"lugre\"\nlow_speed = 1.5\nhigh_speed = 1.0\nscale = 1e-3\nexponent = 2\nbristle_stiffness = 1e5\n\
         bristle_damping = 316.0\nviscous = 0.4",
    ] {
        let case = written(
            &format!(
                "title = \"from rest\"\nmotion = \"translation\"\n[rotor]\nend = \"driven\"\nspeed = 0.1\ninertia = 1.0\nstiffness = 2.0\n\
             [stator]\nend = \"fixed\"\n[contact]\nnormal_force = 1.0\n[friction]\n{law}\n[initial]\nrotor_speed = 0.0\n\
             [output]\nend_time = 1.0\ninterval = 0.1\n"
            ),
            &[],
        );
        for method in ["series", "arkode", "esdirk", "cvode"] {
            let segments = reported(&with(&case, method)).0.segments.len();
            assert!(segments <= 2, "{method}: {segments}");
        }
    }
}

/// Speeds of both ends jump behind the shafts of surfaces that stick. The speeds of the surfaces do not jump, except
/// by rounding.
#[test]
fn property_jumps_of_the_ends_end_no_stick() {
    let case = written(
        r#"
title = "two shaken ends"
motion = "translation"
rotor = { inertia = [1.3, 0.7], stiffness = [31.0, 17.0], end = "driven",
    speed = { profile = "cosine", amplitude = 0.137, frequency = 1.3, mean = 0.0311, from = 0.413, to = 3.217 } }
stator = { inertia = 0.9, stiffness = 23.0, end = "driven",
    speed = { profile = "sine", amplitude = 0.03, frequency = 0.9, phase = 0.7, from = 0.2, to = 2.9 } }
contact = { normal_force = 100.0 }
friction = { law = "coulomb", breakaway = 0.5, kinetic = 0.4 }
output = { end_time = 5.0 }
"#,
        &[],
    );
    let kinds: Vec<EventKind> = reported(&case).0.events.iter().map(|event| event.kind).collect();
    assert!(!kinds.contains(&EventKind::Slip), "{kinds:?}");
    assert_eq!(kinds.iter().filter(|kind| **kind == EventKind::Corner).count(), 4);
}
