//! Whole runs of the brake against exact solutions, balances and symmetries.

use crate::common::cases::built_in;
use crate::common::linear_brake::LinearBrake;
use crate::common::systems::{exponential, ramp, table};
use crate::common::{disks, event_sequence, output, run, solver, truth};
use stickslip::case::builtin;
use stickslip::friction::{Friction, Law};
use stickslip::model::{DiskKick, KickTime, Mode, Parameters};
use stickslip::record::{EventKind, MemoryRecorder, Sample, State};
use stickslip::simulation::{Method, OutputOptions, OutputWindow, SolverOptions};

fn rtol() -> f64 {
    SolverOptions::default().rtol
}

fn brake() -> Parameters {
    Parameters {
        perturbations: Vec::new(),
        ..truth("si-kick").parameters
    }
}

/// The SI brake from 2 rad/s with constant friction: it stops after 0.14 s and rings.
fn short_brake(friction: Friction, rise_time: f64) -> Parameters {
    let mut parameters = brake();
    parameters.initial.speed = 2.0;
    parameters.friction = friction;
    parameters.actuation = ramp(2225.0, rise_time);
    parameters
}

fn kick(time: f64, relative_velocity: f64) -> DiskKick {
    DiskKick {
        time: KickTime::At(time),
        relative_velocity,
    }
}

const TABLE_TIMES: [f64; 10] = [0.0, 0.02, 0.12, 0.125, 0.14, 0.145, 0.16, 0.18, 0.185, 0.195];
const TABLE_END: f64 = 0.22;

/// A run with everything, under constant friction: grip, stop, release until the contact slips to and fro, separation,
/// grip, and a release to a force that is too small to stop the surfaces, where they only reverse. Kicks come at a
/// corner, twice at one time, one that reverses the sliding, one in stick and one in separation.
fn table_case(breakaway: f64) -> Parameters {
    let mut parameters = brake();
    parameters.initial.speed = 1.2;
    parameters.friction = Friction {
        breakaway,
        law: exponential(0.3, 0.3, 3.5).into(),
    };
    parameters.actuation = table(
        &TABLE_TIMES,
        &[0.0, 2000.0, 2000.0, 100.0, 100.0, -100.0, -100.0, 500.0, 500.0, 15.0],
    );
    parameters.perturbations = vec![
        kick(0.02, 0.1),
        kick(0.05, 0.2),
        kick(0.05, -0.05),
        kick(0.06, -3.0),
        kick(0.115, 1.0),
        kick(0.15, 0.4),
    ];
    parameters
}

struct Accuracy {
    /// Error of an event, s.
    time: f64,
    /// Error of a state, relative to the channel's largest value.
    state: f64,
}

/// Where twenty steps resolve every period of 0.24 ms, ARKODE's method of order 8 is limited by rounding: 1e-16 of the
/// fast phase in each of some thousand steps. At order 5, and where an explicit method steps at the edge of its
/// stability and lets the fast mode oscillate slightly, errors come near the tolerance of 1e-10. The errors of the
/// multistep methods add up over thousands of steps in a weakly damped phase; where the run is quiet BDF has order 2
/// and drifts with the rotor's ringing, finally by 1e-6. An event's time is the phase over 26 krad/s; a tangential
/// departure from stick magnifies its error.
fn accuracy(method: Method) -> Accuracy {
    let (time, state) = match method {
        Method::Arkode | Method::Series => (1e-11, 1e-9),
        Method::Erk | Method::Esdirk | Method::ErkPair(_) => (1e-10, 1e-8),
        Method::Cvode => (1e-9, 1e-7),
        Method::CvodeBdf | Method::CvodeAdams => (1e-8, 1e-5),
        Method::Paper | Method::Rk4 => unreachable!("they locate nothing"),
    };
    Accuracy { time, state }
}

/// Compares events and samples of a run with constant friction with the piecewise linear solution.
fn hold_against_oracle(name: &str, parameters: &Parameters, end: f64, method: Method) -> MemoryRecorder {
    let oracle = LinearBrake::run(parameters, end);
    let (recorder, _) = run(parameters, &solver(method, rtol()), &output(end, 0.000_25));
    let accuracy = accuracy(method);
    let (kinds, expected): (Vec<_>, Vec<_>) = (
        recorder
            .events
            .iter()
            .filter(|e| is_oracles(e.kind))
            .map(|e| (e.kind, e.mode_after))
            .collect(),
        oracle.events.iter().map(|e| (e.kind, e.mode_after)).collect(),
    );
    assert_eq!(kinds, expected, "{name} by {}", method.name());
    let mut worst: f64 = 0.0;
    for (event, expected) in recorder
        .events
        .iter()
        .filter(|e| is_oracles(e.kind))
        .zip(&oracle.events)
    {
        worst = worst.max((event.time - expected.time).abs());
    }
    println!(
        "{name} by {}: {} events within {worst:.1e} s",
        method.name(),
        kinds.len()
    );
    assert!(
        worst < accuracy.time,
        "{name} by {}: an event is off by {worst:e} s",
        method.name()
    );

    const CHANNELS: [&str; 9] = ["u", "u'", "v", "v'", "theta'", "z", "z'", "F_n", "slip"];
    let rows: Vec<(f64, Mode, [f64; 9], [f64; 9])> = recorder
        .samples
        .iter()
        // A sample that is closer to an event than its error may be on its other side.
        .filter(|s| oracle.events.iter().all(|e| (e.time - s.time).abs() > 1e-8))
        .map(|s| {
            let e = oracle.at(s.time);
            assert_eq!(s.mode, e.mode, "{name} by {} at {}", method.name(), s.time);
            let state = &s.state;
            let computed = [
                state.rotor_twist,
                state.rotor_twist_rate,
                state.phi1,
                state.phi1_dot,
                state.theta_dot,
                state.z,
                state.z_dot,
                s.channels.normal_force,
                state.slip_displacement,
            ];
            let expected = [
                e.rotor_twist,
                e.rotor_twist_rate,
                e.stator_twist,
                e.stator_twist_rate,
                e.theta_dot,
                e.z,
                e.z_dot,
                e.normal_force.max(0.0),
                e.slip,
            ];
            (s.time, s.mode, computed, expected)
        })
        .collect();
    let cvode = matches!(method, Method::Cvode | Method::CvodeBdf | Method::CvodeAdams);
    for (k, channel) in CHANNELS.iter().enumerate() {
        if cvode && *channel == "slip" {
            continue; // see analytic_quadratures_by_every_method
        }
        let scale = rows.iter().map(|r| r.3[k].abs()).fold(0.0, f64::max);
        for mode in Mode::ALL {
            let of_mode = rows.iter().filter(|r| r.1 == mode);
            let (error, time) = of_mode
                .map(|r| ((r.2[k] - r.3[k]).abs() / scale, r.0))
                .fold((0.0, 0.0), |a: (f64, f64), b| if b.0 > a.0 { b } else { a });
            assert!(
                error < accuracy.state,
                "{name} by {}: {channel} in {} is off by {error:e} of its size at {time}",
                method.name(),
                mode.name()
            );
        }
    }
    recorder
}

/// The piecewise linear solution has no loss of stability.
fn is_oracles(kind: EventKind) -> bool {
    !matches!(kind, EventKind::Destabilised | EventKind::Restabilised)
}

/// Slip under a ramp and under a constant force, where friction is constant for either reason, and the stick after it.
/// All are linear, so that the matrix exponential is exact in the slip and in the stick of every method.
#[test]
fn analytic_constant_friction_by_every_method() {
    let friction = |low_speed: f64, high_speed: f64, decay: f64| Friction {
        breakaway: low_speed,
        law: exponential(low_speed, high_speed, decay).into(),
    };
    for (name, friction, rise_time) in [
        ("mu_s = mu_d, ramp", friction(0.3, 0.3, 3.5), 0.02),
        ("alpha = 0, ramp", friction(0.3, 0.1, 0.0), 0.02),
        ("mu_s = mu_d, step", friction(0.3, 0.3, 3.5), 0.0),
    ] {
        for method in Method::KINDS {
            let recorder = hold_against_oracle(name, &short_brake(friction.clone(), rise_time), 0.2, method);
            assert!(recorder.samples.iter().filter(|s| s.mode == Mode::Stick).count() > 100);
            let stick_solver = match method {
                // The stick never ends.
                Method::Series | Method::Cvode | Method::Arkode => "closed-form",
                _ => method.name(),
            };
            let sticks = recorder.segments.iter().filter(|s| s.mode == Mode::Stick);
            assert!(sticks.clone().count() > 0 && sticks.clone().all(|s| s.solver == stick_solver));
        }
    }
}

/// Every kind of event in one run, with tangential departures from stick.
#[test]
fn analytic_every_event_with_mu_0_equal_to_mu_s() {
    for method in Method::KINDS {
        every_event("mu_0 = mu_s", 0.3, method);
    }
}

/// The same events, with departures from stick at a finite acceleration.
#[test]
fn analytic_every_event_with_mu_0_above_mu_s() {
    for method in Method::KINDS {
        every_event("mu_0 > mu_s", 0.35, method);
    }
}

fn every_event(name: &str, breakaway: f64, method: Method) {
    let recorder = hold_against_oracle(name, &table_case(breakaway), TABLE_END, method);
    for kind in EventKind::ALL.into_iter().filter(|k| is_oracles(*k)) {
        assert!(
            recorder.events.iter().any(|e| e.kind == kind),
            "{name}: no {}",
            kind.name()
        );
    }
}

/// Kinetic + elastic + dissipated - work keeps its initial value, to the errors of some ten thousand steps. The
/// right-hand side integrates the losses along with the state, and one-step methods keep a sum of quadratures and
/// squares far better than their tolerance. CVODE steps over smooth sliding by BDF, whose errors add up, most where
/// the normal force changes (`release`).
#[test]
fn analytic_energy_balances_over_the_built_in_cases() {
    for case in builtin::CASES {
        let found = built_in(case.name, &[]);
        let (recorder, report) = run(&disks(&found), &found.solver, &found.output);
        let relative = report.energy_residual / report.initial_energy;
        println!("{}: {relative:.1e}", case.name);
        let most = if case.name == "release" { 1e-9 } else { 1e-11 };
        assert!(relative < most, "{}: {relative:e}", case.name);
        // The channel is this sum.
        for sample in &recorder.samples {
            let c = &sample.channels;
            let sum = c.energy_kinetic + c.energy_elastic + c.dissipated_friction + c.dissipated_damping
                - c.work_applied
                - c.work_perturbation
                - report.initial_energy;
            assert!((sum - c.energy_residual).abs() <= 1e-15 * report.initial_energy);
        }
    }
}

/// The slip displacement and the dissipated energies by the methods other than `arkode`: against the exact solution,
/// and by the energy of the whole run.
///
/// Where F_n is constant and friction has reached mu_d, the state is linear in time: any step of any order follows it,
/// and a step control that ignores the quadratures, which are parabolas then, loses them.
#[test]
fn analytic_quadratures_by_every_method() {
    let friction = table_case(0.3).friction;
    let parameters = short_brake(friction, 0.02);
    let oracle = LinearBrake::run(&parameters, 0.2);
    for method in Method::KINDS {
        let (recorder, report) = run(&parameters, &solver(method, rtol()), &output(0.2, 0.001));
        let relative = report.energy_residual / report.initial_energy;
        let samples = recorder.samples.iter();
        let slip = samples.map(|s| (s.state.slip_displacement - oracle.at(s.time).slip).abs());
        let slip = slip.fold(0.0, f64::max);
        println!("{}: energy {relative:.1e}, slip {slip:.1e} rad", method.name());
        // The program's own requirement for the state.
        assert!(relative < 1e-6, "{}: {relative:e} {slip:e} rad", method.name());
        assert!(slip < 1e-6, "{}: {relative:e} {slip:e} rad", method.name());
    }
}

fn interface_torque(p: &Parameters, mode: Mode, s: &State) -> (f64, f64) {
    let t = p.torsion;
    let (r_fn, r_fn_rate) = (p.contact.radius * 2225.0, 0.0);
    let rotor = t.damping * s.rotor_twist_rate + t.stiffness * s.rotor_twist;
    let stator = t.damping * s.phi1_dot + t.stiffness * s.phi1;
    let w = s.relative_velocity;
    let torque = match mode {
        Mode::Stick => (rotor + stator) / 2.0,
        Mode::Separated => 0.0,
        _ => {
            let sense = f64::from(mode.sense());
            sense * p.friction.law.coefficient(sense * w) * r_fn
        }
    };
    let (theta_ddot, phi2_ddot) = (-rotor / t.rotor_inertia, (rotor - torque) / t.surface_inertia);
    let phi1_ddot = (torque - stator) / t.surface_inertia;
    let rate = match mode {
        Mode::Stick => {
            let rotor_rate = t.damping * (theta_ddot - phi2_ddot) + t.stiffness * s.rotor_twist_rate;
            let stator_rate = t.damping * phi1_ddot + t.stiffness * s.phi1_dot;
            (rotor_rate + stator_rate) / 2.0
        }
        Mode::Separated => 0.0,
        _ => {
            let sense = f64::from(mode.sense());
            let (mu, slope) = p.friction.law.coefficient_and_slope(sense * w);
            slope * (phi2_ddot - phi1_ddot) * r_fn + sense * mu * r_fn_rate
        }
    };
    (torque, rate)
}

/// I theta' + J phi_2' falls by the integral of the interface torque, and J phi_1' rises by this integral minus that
/// of T_s. A kick adds J delta / 2 to the first and subtracts it from the second.
///
/// The test covers the whole stick-slip window, from sample to sample and event to event, with the corrected
/// trapezoidal rule. In a smooth stretch its error is h^4 / 720 times the difference of the torque's third derivatives
/// at the ends: with 20 N m at 26 krad/s and steps of 0.5 us up to 6e-14 N m s, and a few times that where a stretch
/// ends in a shorter step.
#[test]
fn analytic_momentum_follows_the_interface_torque() {
    let truth = truth("si-kick");
    let parameters = &truth.parameters;
    let (from, to) = (6.9690, 6.9900);
    let options = OutputOptions {
        windows: vec![OutputWindow {
            from,
            to,
            interval: 5e-7,
        }],
        ..output(6.9901, 0.1)
    };
    let (recorder, _) = run(parameters, &solver(Method::Arkode, rtol()), &options);
    let t = parameters.torsion;
    let momenta = |s: &State| {
        let rotor = t.rotor_inertia * s.theta_dot + t.surface_inertia * s.phi2_dot;
        (rotor, t.surface_inertia * s.phi1_dot)
    };
    // All states in order: samples, and both sides of events; each with the mode that follows.
    let mut states: Vec<(f64, Mode, State)> = Vec::new();
    let samples = recorder.samples.iter();
    let mut samples = samples.filter(|s| (from..to).contains(&s.time)).peekable();
    let mut mode = Mode::SlipForward;
    let mut kicked = 0.0;
    for event in recorder.events.iter().filter(|e| (from..to).contains(&e.time)) {
        while let Some(sample) = samples.next_if(|s| s.time < event.time) {
            states.push((sample.time, sample.mode, sample.state));
        }
        states.push((event.time, mode, event.before));
        mode = event.mode_after;
        states.push((event.time, mode, event.after));
        let (before, after) = (momenta(&event.before), momenta(&event.after));
        let (rotor, stator) = (after.0 - before.0, after.1 - before.1);
        let jump = if event.kind == EventKind::Kick {
            kicked += 1e-4;
            t.surface_inertia * 1e-4 / 2.0
        } else {
            0.0
        };
        let rounding = 4.0 * f64::EPSILON * before.0.abs();
        // After long undisturbed sliding a kick also removes the rounding of the fast mode, which is far smaller than
        // the kick.
        let noise = 1e-6 * jump;
        assert!((rotor - jump).abs() < rounding, "{event:?}");
        assert!((stator + jump).abs() < rounding + noise, "{event:?}");
    }
    states.extend(samples.map(|s| (s.time, s.mode, s.state)));
    assert_eq!(kicked, 1e-4);
    assert!(states.len() > 42_000);

    let (mut rotor_integral, mut stator_integral) = (0.0, 0.0);
    let (mut rotor_jump, mut largest): (f64, (f64, f64)) = (0.0, (0.0, 0.0));
    let first = momenta(&states[0].2);
    for pair in states.windows(2) {
        let ((t0, mode, a), (t1, _, b)) = (&pair[0], &pair[1]);
        let h = t1 - t0;
        if h == 0.0 {
            rotor_jump += momenta(b).0 - momenta(a).0;
        } else {
            let ((torque_a, rate_a), (torque_b, rate_b)) = (
                interface_torque(parameters, *mode, a),
                interface_torque(parameters, *mode, b),
            );
            let interface = h * (torque_a + torque_b) / 2.0 + h * h * (rate_a - rate_b) / 12.0;
            // The integral of T_s = c_t phi_1' + k_t phi_1: the first part exactly, the second by the rule.
            let stator = t.damping * (b.phi1 - a.phi1)
                + t.stiffness * (h * (a.phi1 + b.phi1) / 2.0 + h * h * (a.phi1_dot - b.phi1_dot) / 12.0);
            rotor_integral -= interface;
            stator_integral += interface - stator;
        }
        let now = momenta(b);
        let rotor_error = now.0 - first.0 - rotor_integral - rotor_jump;
        let stator_error = now.1 - first.1 - stator_integral + rotor_jump;
        largest = (largest.0.max(rotor_error.abs()), largest.1.max(stator_error.abs()));
    }
    // 107 stretches, whose errors all have one sign.
    println!("rotor {:.1e}, stator {:.1e} N m s", largest.0, largest.1);
    assert!(largest.0 < 2e-11 && largest.1 < 2e-11, "{largest:?}");
    assert!((rotor_jump - t.surface_inertia * 1e-4 / 2.0).abs() < 1e-14);
}

/// In slip and in separation a kick adds delta to the relative velocity, half to each surface; in stick it changes
/// nothing. No other quantity changes.
#[test]
fn analytic_kicks_change_exactly_what_they_must() {
    for method in Method::KINDS {
        let parameters = table_case(0.3);
        let (recorder, _) = run(&parameters, &solver(method, rtol()), &output(TABLE_END, 0.001));
        let kicks: Vec<_> = recorder.events.iter().filter(|e| e.kind == EventKind::Kick).collect();
        assert_eq!(kicks.len(), parameters.perturbations.len());
        let mut modes = Vec::new();
        for (event, given) in kicks.iter().zip(&parameters.perturbations) {
            assert_eq!(KickTime::At(event.time), given.time);
            modes.push(event.mode_after);
            let (before, after) = (event.before, event.after);
            if event.mode_after == Mode::Stick {
                assert_eq!(before, after);
                continue;
            }
            let delta = given.relative_velocity;
            // Speeds are of size 1, so that their rounding is a few times 1e-16.
            for (what, change, expected) in [
                ("phi_2'", after.phi2_dot - before.phi2_dot, delta / 2.0),
                ("phi_1'", after.phi1_dot - before.phi1_dot, -delta / 2.0),
                ("omega_r", after.relative_velocity - before.relative_velocity, delta),
                ("u'", after.rotor_twist_rate - before.rotor_twist_rate, -delta / 2.0),
            ] {
                let error = (change - expected).abs();
                assert!(error < 2e-15, "{what} changes by {change}, not {expected}");
            }
            let unchanged = State {
                phi2_dot: before.phi2_dot,
                phi1_dot: before.phi1_dot,
                relative_velocity: before.relative_velocity,
                rotor_twist_rate: before.rotor_twist_rate,
                ..after
            };
            assert_eq!(unchanged, before);
        }
        assert!(modes.contains(&Mode::Stick), "{modes:?}");
        assert!(modes.contains(&Mode::Separated), "{modes:?}");
    }
}

/// The departure from stick: omega_r' = 2 r F_n (mu_0 - mu_s) / J. If both coefficients are equal this is zero, and
/// omega_r starts with the parabola of omega_r'' = 2 T_f' / J. If mu_0 is above mu_s, omega_r starts with a finite
/// slope.
#[test]
fn analytic_take_off_is_tangential_or_with_a_drop() {
    for (breakaway, least) in [(0.6, 10), (0.63, 5)] {
        let mut parameters = truth("si-kick").parameters;
        parameters.friction.breakaway = breakaway;
        let interval = 1e-7;
        let options = OutputOptions {
            windows: vec![OutputWindow {
                from: 6.974,
                to: 6.982,
                interval,
            }],
            ..output(6.982, 0.1)
        };
        let (recorder, _) = run(&parameters, &solver(Method::Arkode, rtol()), &options);
        let (t, friction) = (parameters.torsion, &parameters.friction);
        let r_fn = parameters.contact.radius * 2225.0;
        let slips: Vec<_> = recorder.events.iter().filter(|e| e.kind == EventKind::Slip).collect();
        assert!(slips.len() >= least, "{}", slips.len());
        for event in slips {
            let s = &event.after;
            let sense = f64::from(event.mode_after.sense());
            // The surfaces had one speed: omega_r is the rounding of three speeds of size 0.3.
            assert!(s.relative_velocity.abs() < 1e-15);
            let force = event.internal_force * parameters.contact.radius;
            assert!((force - sense * breakaway * r_fn).abs() < 1e-9 * r_fn, "{force}");
            let slope =
                sense * 2.0 * r_fn * (friction.breakaway - friction.law.at_vanishing_speed()) / t.surface_inertia;
            let (_, held_rate) = interface_torque(&parameters, Mode::Stick, s);
            // Falling friction contributes once omega_r grows.
            let (_, fall) = friction.law.coefficient_and_slope(0.0);
            let spring = (t.damping + 2.0 * fall * r_fn) / t.surface_inertia;
            let curvature = 2.0 * held_rate / t.surface_inertia - spring * slope * if slope == 0.0 { 0.0 } else { 1.0 };
            let later: Vec<&Sample> = recorder
                .samples
                .iter()
                .filter(|x| x.time > event.time + interval && x.time < event.time + 5.0 * interval)
                .collect();
            assert!(later.len() >= 3);
            for sample in later {
                let tau = sample.time - event.time;
                let expected = slope * tau + curvature * tau * tau / 2.0;
                let w = sample.state.relative_velocity;
                // The next term is smaller by tau times the fast frequency of 26 krad/s, 0.013 at most; the mode is
                // hardly longer than that away from its turning point.
                let error = (w - expected).abs();
                assert!(error < 0.05 * expected.abs() + 1e-13, "{w} {expected} after {tau}");
                assert!(sense * w > 0.0);
            }
        }
    }
}

/// A kick exactly at a corner of F is given once, and the corner is recorded once; the run is the limit of kicks just
/// after the corner.
#[test]
fn analytic_a_kick_at_a_corner_is_the_limit_of_later_kicks() {
    let with_kick_at = |time: f64| {
        let mut parameters = table_case(0.3);
        parameters.perturbations = vec![kick(time, 0.1)];
        run(&parameters, &solver(Method::Arkode, rtol()), &output(TABLE_END, 0.001)).0
    };
    let (at, after) = (with_kick_at(0.02), with_kick_at(0.02 + 1e-9));
    let at_corner: Vec<_> = at.events.iter().filter(|e| e.time == 0.02).map(|e| e.kind).collect();
    assert_eq!(at_corner.len(), 2);
    assert!(at_corner.contains(&EventKind::Corner) && at_corner.contains(&EventKind::Kick));
    let (word, later) = (event_sequence(&at), event_sequence(&after));
    assert_eq!(word.len(), later.len());
    for (a, b) in word.iter().zip(&later) {
        assert_eq!(a.0, b.0);
        // The shift of the kick, and the solver's error.
        assert!((a.1 - b.1).abs() < 2e-9, "{a:?} {b:?}");
    }
}

/// Two kicks at one time are one kick of their sum, in either order.
#[test]
fn analytic_two_kicks_at_one_time_add_up() {
    let with = |kicks: &[f64]| {
        let mut parameters = table_case(0.3);
        parameters.perturbations = kicks.iter().map(|&delta| kick(0.05, delta)).collect();
        run(&parameters, &solver(Method::Arkode, rtol()), &output(TABLE_END, 0.001)).0
    };
    let (one, two, swapped) = (with(&[0.15]), with(&[0.2, -0.05]), with(&[-0.05, 0.2]));
    for recorder in [&two, &swapped] {
        let kicks: Vec<_> = recorder.events.iter().filter(|e| e.kind == EventKind::Kick).collect();
        assert_eq!(kicks.len(), 2);
        assert_eq!(kicks[0].after, kicks[1].before);
        let (word, expected) = (event_sequence(recorder), event_sequence(&one));
        assert_eq!(word.len(), expected.len());
        for (a, b) in word.iter().zip(&expected) {
            assert_eq!(a.0, b.0);
            assert!((a.1 - b.1).abs() < 1e-11, "{a:?} {b:?}");
        }
    }
}

/// Every corner of F after t = 0 is an event once, at exactly its time, in any mode.
#[test]
fn analytic_corners_are_recorded_once_each() {
    let corners = |recorder: &MemoryRecorder| -> Vec<f64> {
        let corners = recorder.events.iter().filter(|e| e.kind == EventKind::Corner);
        corners.clone().for_each(|e| assert_eq!(e.before, e.after));
        corners.map(|e| e.time).collect()
    };
    for method in Method::KINDS {
        let (recorder, _) = run(&table_case(0.3), &solver(method, rtol()), &output(TABLE_END, 0.001));
        assert_eq!(corners(&recorder), TABLE_TIMES[1..]);
    }
    let friction = table_case(0.3).friction;
    for (rise_time, expected) in [(0.02, &[0.02][..]), (0.0, &[])] {
        let (recorder, _) = run(
            &short_brake(friction.clone(), rise_time),
            &solver(Method::Arkode, rtol()),
            &output(0.1, 0.001),
        );
        assert_eq!(corners(&recorder), expected);
    }
}

/// From a negative speed with negated kicks the run is the mirror image. Every operation of the solvers is odd or even
/// in the torsional state, so that no bit differs.
#[test]
fn analytic_a_negative_speed_mirrors_the_run() {
    let si_kick = truth("si-kick");
    for (parameters, end, methods) in [
        (table_case(0.3), TABLE_END, &Method::KINDS[..]),
        (si_kick.parameters, si_kick.end_time, &[Method::Arkode]),
    ] {
        let mut mirrored = parameters.clone();
        mirrored.initial.speed *= -1.0;
        for kick in &mut mirrored.perturbations {
            kick.relative_velocity *= -1.0;
        }
        for &method in methods {
            let (a, _) = run(&parameters, &solver(method, rtol()), &output(end, 0.001));
            let (b, _) = run(&mirrored, &solver(method, rtol()), &output(end, 0.001));
            assert_eq!(a.events.len(), b.events.len(), "{}", method.name());
            for (x, y) in a.events.iter().zip(&b.events) {
                assert_eq!((x.time, x.kind), (y.time, y.kind), "{}", method.name());
                assert_eq!(x.mode_after.sense(), -y.mode_after.sense());
                assert_eq!(x.after, mirror(&y.after), "{} at {}", method.name(), x.time);
            }
            for (x, y) in a.samples.iter().zip(&b.samples) {
                assert_eq!(x.state, mirror(&y.state), "{} at {}", method.name(), x.time);
                assert_eq!(x.channels.friction_torque, -y.channels.friction_torque);
                assert_eq!(x.channels.energy_kinetic, y.channels.energy_kinetic);
            }
        }
    }
}

fn mirror(s: &State) -> State {
    State {
        z: s.z,
        z_dot: s.z_dot,
        theta: -s.theta,
        theta_dot: -s.theta_dot,
        phi1: -s.phi1,
        phi1_dot: -s.phi1_dot,
        phi2: -s.phi2,
        phi2_dot: -s.phi2_dot,
        rotor_twist: -s.rotor_twist,
        rotor_twist_rate: -s.rotor_twist_rate,
        relative_velocity: -s.relative_velocity,
        slip_displacement: -s.slip_displacement,
    }
}
