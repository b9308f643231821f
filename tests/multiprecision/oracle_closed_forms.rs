//! The oracle against closed forms and plain doubles. Numbers of the literature: `published/problems`.

use crate::common::random_brakes::Random;
use num_rational::BigRational;
use num_traits::Zero;
use std::f64::consts::{PI, TAU};
use std::ops::ControlFlow;
use std::time::Duration;
use stickslip::model::system::{
    Bristles, ContactLaw, End, ExactSystem, Initial, Kick, KickSide, Pressing, Regularisation, Smoothing, Torque, Train,
};
use stickslip::model::{BreakawayTest, ExactLaw, KickTime, Mode, nearest_double};
use stickslip::oracle::{
    self, ExactDouble, OracleEvent, OracleOptions, OracleReport, OracleRequest, OracleState, rational,
};
use stickslip::record::EventKind::{
    self, Contact, Corner, Destabilised, Restabilised, Reversal, Separation, Slip, Stick,
};
use stickslip::signal::{Drive, Frequency, HarmonicShape, Ramp, Signal, TimeTable, Timeline, Wave};

type Real = BigRational;

fn r(text: &str) -> Real {
    rational(text).expect("a decimal")
}

fn list(texts: &[&str]) -> Vec<Real> {
    texts.iter().map(|text| r(text)).collect()
}

fn value(text: &str) -> Drive<Real> {
    Drive::Value(r(text))
}

/// amplitude cos(omega t).
fn cosine(amplitude: &str, frequency: Frequency<Real>) -> Wave<Real> {
    Wave {
        shape: HarmonicShape::Cosine,
        mean: Real::zero(),
        amplitude: r(amplitude),
        frequency,
        phase: Real::zero(),
        from: None,
        to: None,
    }
}

fn table(time: &[&str], value: &[&str]) -> Drive<Real> {
    Drive::Linear(Signal::TimeTable(TimeTable {
        time: list(time),
        value: list(value),
    }))
}

fn law(text: &'static str) -> ExactLaw {
    let mut words = text.split(' ');
    let name = words.next().unwrap();
    let number = |word: &'static str| {
        let (key, value) = word.split_once('=').unwrap();
        (key, r(value))
    };
    ExactLaw {
        name,
        numbers: words.map(number).collect(),
        lists: Vec::new(),
        words: Vec::new(),
    }
}

fn coulomb(kinetic: &str) -> ExactLaw {
    ExactLaw {
        numbers: vec![("kinetic", r(kinetic))],
        ..law("coulomb")
    }
}

fn kick(time: &str, relative_velocity: &str, on: KickSide) -> Kick<Real> {
    Kick {
        time: KickTime::At(r(time)),
        relative_velocity: r(relative_velocity),
        on,
    }
}

fn bristles(stiffness: &str, damping: &str, viscous: &str) -> ContactLaw<Real> {
    ContactLaw::Bristles(Bristles {
        stiffness: r(stiffness),
        damping: r(damping),
        viscous: r(viscous),
        deflection: BigRational::default(),
    })
}

fn regularised(function: Smoothing, speed: &str) -> ContactLaw<Real> {
    let speed = r(speed);
    ContactLaw::Regularised(Regularisation { function, speed })
}

fn torque(signal: Drive<Real>, on: usize) -> Option<Torque<Real>> {
    Some(Torque { signal, on })
}

/// amplitude cos(omega t) with a period beyond any run, so that it is almost constant.
fn constant(mean: &str, amplitude: &str, from: &str) -> Wave<Real> {
    Wave {
        mean: r(mean),
        from: Some(r(from)),
        ..cosine(amplitude, Frequency::Angular(r("1e-30")))
    }
}

fn flywheel(inertia: &str) -> Train<Real> {
    train(&[inertia], &[], &[], End::Free)
}

fn ramp(value: &str, rise_time: &str) -> Drive<Real> {
    Drive::Linear(Signal::Ramp(Ramp {
        value: r(value),
        rise_time: r(rise_time),
    }))
}

/// A train without viscous damping, and one dashpot for each spring.
fn train(inertia: &[&str], stiffness: &[&str], damping: &[&str], end: End<Real>) -> Train<Real> {
    Train {
        inertia: list(inertia),
        stiffness: list(stiffness),
        damping: list(damping),
        viscous: vec![Real::zero(); inertia.len()],
        end,
        torque: None,
    }
}

fn rigid(end: End<Real>) -> Train<Real> {
    train(&[], &[], &[], end)
}

fn problem(rotor: Train<Real>, stator: Train<Real>, force: Drive<Real>, breakaway: &str, law: ExactLaw) -> ExactSystem {
    let zeros = |count: usize| vec![Real::zero(); count];
    let initial = Initial {
        rotor_twist: zeros(rotor.stiffness.len()),
        rotor_speed: zeros(rotor.inertia.len()),
        stator_twist: zeros(stator.stiffness.len()),
        stator_speed: zeros(stator.inertia.len()),
    };
    ExactSystem {
        rotor,
        stator,
        radius: r("1"),
        pressing: Pressing::Force(force),
        breakaway: r(breakaway),
        breakaway_test: BreakawayTest::Transmitted,
        law,
        contact: ContactLaw::StickSlip,
        initial,
        kicks: Vec::new(),
    }
}

/// The speed below which a regularised contact counts as stuck, 10 eps; `None` for other contacts.
fn threshold(parameters: &ExactSystem) -> Option<Real> {
    match &parameters.contact {
        ContactLaw::Regularised(regularisation) => Some(&regularisation.speed * r("10")),
        ContactLaw::StickSlip | ContactLaw::Bristles(_) => None,
    }
}

fn options(parameters: &ExactSystem, digits: u32, end: &str, samples: &[Real]) -> OracleOptions {
    OracleOptions {
        digits,
        end_time: r(end),
        sample_times: samples.to_vec(),
        threshold: threshold(parameters),
        ..OracleOptions::default()
    }
}

fn sampled(parameters: &ExactSystem, digits: u32, end: &str, samples: &[Real]) -> OracleReport {
    let options = options(parameters, digits, end, samples);
    oracle::run(parameters, &options, &mut |_| ControlFlow::Continue(())).unwrap()
}

fn run(parameters: &ExactSystem, digits: u32, end: &str) -> OracleReport {
    sampled(parameters, digits, end, &[])
}

fn kinds(report: &OracleReport) -> Vec<EventKind> {
    report.events.iter().map(|event| event.kind).collect()
}

fn exact(number: &ExactDouble) -> Real {
    number.to_rational().expect("finite")
}

/// Compares kinds and times of the events, and one component of the state at each.
#[track_caller]
fn follows(report: &OracleReport, expected: &[(EventKind, &str, &str)], of: impl Fn(&OracleState) -> &ExactDouble) {
    assert_eq!(kinds(report), expected.iter().map(|row| row.0).collect::<Vec<_>>());
    for (event, (_, time, value)) in report.events.iter().zip(expected) {
        near(&event.time, time, 1e-36);
        near(of(&event.state), value, 1e-36);
    }
}

#[track_caller]
fn near(found: &ExactDouble, expected: &str, tolerance: f64) {
    near_exact(found, &r(expected), tolerance);
}

#[track_caller]
fn near_exact(found: &ExactDouble, expected: &Real, tolerance: f64) {
    let error = nearest_double(&(exact(found) - expected)).abs();
    assert!(error <= tolerance, "{} is off by {error:.1e}", found.to_decimal(25));
}

#[track_caller]
fn near_double(found: &ExactDouble, expected: f64, tolerance: f64) {
    let error = (found.to_f64() - expected).abs();
    assert!(error <= tolerance, "{} instead of {expected}", found.to_decimal(20));
}

fn print(report: &OracleReport) {
    for event in &report.events {
        let state = &event.state;
        let twists = state.rotor_twist.iter().chain(&state.stator_twist);
        let twists: Vec<String> = twists.map(|twist| twist.to_decimal(22)).collect();
        println!(
            "{} {} {} {}",
            event.time.to_decimal(25),
            event.kind.name(),
            event.mode_after.name(),
            twists.join(" ")
        );
    }
    println!("{} steps", report.steps);
}

const PI_DIGITS: &str = "3.14159265358979323846264338327950288419716939937510582097494";

// The loss of stability.

/// A rotor that slows down on a stator with another surface and shaft than its own, under mu = 0.3 + 0.3 exp(-3.5 x)
/// and 2 kN.
fn braking(relative_velocity: &str) -> ExactSystem {
    let exponential = law("exponential low_speed=0.6 high_speed=0.3 decay=3.5");
    let mut problem = problem(
        train(&["0.01", "2"], &["4e6"], &["15"], End::Free),
        train(&["0.02"], &["7e6"], &["20"], End::Fixed),
        value("2000"),
        "0.6",
        exponential,
    );
    problem.radius = r("0.05");
    problem.initial.rotor_speed = list(&["1.5", "1.5"]);
    problem.kicks = vec![Kick {
        time: KickTime::Instability,
        ..kick("0", relative_velocity, KickSide::Both)
    }];
    problem
}

/// The time at which the margin 2 (R + r F_n mu') is zero, with R by bisection of Im Z between the two natural
/// frequencies; the tolerance of 1e-9 is that of doubles. The kick that waits for it comes at that instant.
#[test]
fn analytic_instability_of_unequal_surfaces() {
    let report = run(&braking("1e-4"), 25, "0.1");
    assert_eq!(kinds(&report)[..2], [Destabilised, EventKind::Kick]);
    let [lost, kick] = [&report.events[0], &report.events[1]];
    assert_eq!(lost.time.to_decimal(25), kick.time.to_decimal(25));
    let kicked = lost.state.relative_velocity.to_f64() + 1e-4;
    near_double(&kick.state.relative_velocity, kicked, 1e-14);
    let impedance = |omega: f64| {
        let of = |inertia: f64, damping: f64, stiffness: f64| {
            nalgebra::Complex::new(damping, omega * inertia - stiffness / omega)
        };
        let [rotor, stator] = [of(0.01, 15.0, 4e6), of(0.02, 20.0, 7e6)];
        rotor * stator / (rotor + stator)
    };
    let (mut below, mut above) = (3.5e8f64.sqrt(), 4e8f64.sqrt());
    for _ in 0..60 {
        let middle = 0.5 * (below + above);
        if impedance(middle).im < 0.0 {
            below = middle;
        } else {
            above = middle;
        }
    }
    let x = lost.state.relative_velocity.to_f64();
    let kappa = -0.05 * 2000.0 * 3.5 * 0.3 * (-3.5 * x).exp();
    let resistance = impedance(below).re;
    let error = (resistance + kappa).abs();
    assert!(error < 1e-9 * resistance, "{resistance} and {kappa}");
}

/// If the margin is not watched, or if a torque keeps the rotor turning, there is no change of stability, and the
/// waiting kick does not come.
#[test]
fn analytic_no_instability_where_nothing_is_watched() {
    let mut driven = braking("1e-4");
    driven.rotor.torque = torque(value("1"), 1);
    let unwatched = OracleOptions {
        stability: false,
        ..OracleOptions::default()
    };
    for (problem, options) in [(driven, OracleOptions::default()), (braking("1e-4"), unwatched)] {
        let options = OracleOptions {
            end_time: r("0.05"),
            ..options
        };
        let report = oracle::run(&problem, &options, &mut |_| ControlFlow::Continue(())).unwrap();
        let of_stability = [Destabilised, Restabilised, EventKind::Kick];
        assert!(!kinds(&report).iter().any(|kind| of_stability.contains(kind)));
    }
}

// A mass on a belt.

/// The belt is the rotor, the mass the stator.
fn belt(mass: &str, stiffness: &str, speed: &str, breakaway: &str, law: ExactLaw) -> ExactSystem {
    problem(
        rigid(End::Driven(value(speed))),
        train(&[mass], &[stiffness], &["0"], End::Fixed),
        value("1"),
        breakaway,
        law,
    )
}

/// Slip (pi + 2 atan(v k/(w D)))/w, stick 2 D/(k v). With m = k = 1 and v = D the arc tangent is pi/4.
#[test]
fn analytic_a_belt_with_coulomb_friction() {
    let mut belt = belt("1", "1", "0.25", "0.75", coulomb("0.5"));
    belt.initial.stator_speed = list(&["0.25"]);
    let report = run(&belt, 40, "40");
    print(&report);
    let times: Vec<Real> = report.events.iter().map(|event| exact(&event.time)).collect();
    assert_eq!(kinds(&report)[..4], [Slip, Stick, Slip, Stick]);
    // The spring is stretched from zero to 0.75 in three seconds.
    near_exact(&report.events[0].time, &r("3"), 1e-36);
    let slip = r(PI_DIGITS) * r("1.5");
    for pair in times.windows(2).step_by(2) {
        assert!(nearest_double(&(&pair[1] - &pair[0] - &slip)).abs() < 1e-35);
    }
    for pair in times[1..].windows(2).step_by(2) {
        assert!(nearest_double(&(&pair[1] - &pair[0] - r("2"))).abs() < 1e-35);
    }
}

/// The same for other parameters, in doubles.
#[test]
fn analytic_belts_with_coulomb_friction_of_any_size() {
    for [m, k, v, s, d] in [
        ["2", "30", "0.1", "9", "5"],
        ["1e-3", "4e3", "0.02", "0.6", "0.1"],
        ["7e3", "1e7", "3", "4e5", "1e5"],
    ] {
        let mut belt = belt(m, k, v, s, coulomb(d));
        belt.initial.stator_speed = list(&[v]);
        let [m, k, v, drop] = [r(m), r(k), r(v), r(s) - r(d)].map(|x| nearest_double(&x));
        let w = (k / m).sqrt();
        let (slip, stick) = ((PI + 2.0 * (v * k / (w * drop)).atan()) / w, 2.0 * drop / (k * v));
        let end = format!("{:.6e}", nearest_double(&r(s)) / (k * v) + 3.5 * (slip + stick));
        let report = run(&belt, 40, &end);
        let times: Vec<&ExactDouble> = report.events.iter().map(|event| &event.time).collect();
        assert!(times.len() >= 7);
        for (index, pair) in times.windows(2).enumerate() {
            let expected = if index % 2 == 0 { slip } else { stick };
            assert!((pair[1].minus(pair[0]) / expected - 1.0).abs() < 1e-14);
        }
    }
}

// Clutches.

/// Two flywheels that a constant or a growing force brings to a common speed, which follows from their momentum.
#[test]
fn analytic_a_clutch_locks_two_flywheels() {
    let clutch = |force| {
        let (rotor, stator) = (flywheel("2"), flywheel("3"));
        let mut clutch = problem(rotor, stator, force, "0.4", coulomb("0.4"));
        clutch.radius = r("0.5");
        clutch.initial.rotor_speed = list(&["10"]);
        clutch.initial.stator_speed = list(&["-5"]);
        clutch
    };
    // omega_r' = -mu r F_n (1/2 + 1/3), here -1/6 F_n.
    let root = "7.745966692414833770358530799564799221665843410583181653175147532";
    for (force, lock) in [(value("30"), "3"), (ramp("30", "10"), root)] {
        let report = run(&clutch(force), 40, "9");
        assert_eq!(kinds(&report), [Stick]);
        let event = &report.events[0];
        near(&event.time, lock, 1e-36);
        for speed in [&event.state.rotor_speed[0], &event.state.stator_speed[0]] {
            near(speed, "1", 1e-36);
        }
    }
}

/// A rotor of two inertias against a flywheel. When they lock, the surfaces have the speed of their common momentum,
/// and the total momentum is unchanged.
#[test]
fn property_a_clutch_with_a_shaft_keeps_its_momentum() {
    let rotor = train(&["0.2", "1.5"], &["800"], &["0.3"], End::Free);
    let stator = train(&["0.3", "4"], &["500"], &["0.2"], End::Free);
    let force = table(&["0", "0.1", "0.3", "0.35"], &["0", "200", "150", "400"]);
    let mut clutch = problem(
        rotor,
        stator,
        force,
        "0.5",
        law("exponential low_speed=0.45 high_speed=0.3 decay=2"),
    );
    clutch.radius = r("0.1");
    clutch.initial.rotor_speed = list(&["20", "20"]);
    clutch.kicks = vec![kick("0.12", "0.7", KickSide::Both)];
    let report = sampled(&clutch, 40, "8", &list(&["0.05", "0.2", "1", "7.5"]));
    print(&report);
    assert!(kinds(&report).contains(&Stick));
    let momentum = |state: &OracleState| {
        let inertias = clutch.rotor.inertia.iter().chain(&clutch.stator.inertia);
        let speeds = state.rotor_speed.iter().chain(&state.stator_speed);
        inertias.zip(speeds).map(|(j, w)| j * exact(w)).sum::<Real>()
    };
    let samples = report.samples.iter().map(|sample| &sample.1);
    let states = samples.chain(report.events.iter().map(|event| &event.state));
    for state in states {
        assert!(nearest_double(&(momentum(state) - r("34"))).abs() < 1e-33);
    }
}

// Signals.

/// A free flywheel under each kind of signal: its speed is the integral of the signal.
#[test]
fn analytic_speeds_under_signals() {
    let wave = Wave {
        shape: HarmonicShape::Sine,
        mean: r("0.5"),
        amplitude: r("3"),
        frequency: Frequency::Cycles(r("0.7")),
        phase: r("0.4"),
        from: Some(r("0.3")),
        to: Some(r("2")),
    };
    let w = TAU * 0.7;
    let of_wave = |t: f64| {
        let integral = |t: f64| -3.0 / w * (w * t + 0.4).cos();
        0.5 * t + integral(t.clamp(0.3, 2.0)) - integral(0.3)
    };
    let chirp = |start: &str, end: &str, duration: &str| {
        let [start, end, duration] = [start, end, duration].map(r);
        Drive::Wave(Wave {
            frequency: Frequency::Sweep { start, end, duration },
            from: None,
            to: None,
            ..wave.clone()
        })
    };
    // The antiderivative in doubles, which the analytic tests of signals hold against quadratures.
    let of_chirp = |drive: &Drive<Real>| -> Box<dyn Fn(f64) -> f64> {
        let timeline = Timeline::new(&[&drive.map(nearest_double)]);
        Box::new(move |t| timeline.integral(0, t))
    };
    let steep = ramp("2", "1");
    let ramp = |t: f64| if t < 1.0 { t * t } else { 1.0 + 2.0 * (t - 1.0) };
    let points = |t: f64| match t {
        t if t < 1.0 => t,
        t if t < 3.0 => t - (t - 1.0).powi(2) / 2.0,
        t => 1.0 - (t - 3.0),
    };
    let bent = table(&["-1", "1", "3"], &["1", "1", "-1"]);
    type Case<'a> = (Drive<Real>, Box<dyn Fn(f64) -> f64 + 'a>, &'a [&'a str]);
    let cases: Vec<Case> = vec![
        (value("2"), Box::new(|t| 2.0 * t), &[]),
        (steep.clone(), Box::new(ramp), &["1"]),
        (bent.clone(), Box::new(points), &["1", "3"]),
        (Drive::Wave(wave.clone()), Box::new(of_wave), &["0.3", "2"]),
        (chirp("0.2", "3", "1.3"), of_chirp(&chirp("0.2", "3", "1.3")), &["1.3"]),
        (chirp("3", "0.2", "1.3"), of_chirp(&chirp("3", "0.2", "1.3")), &["1.3"]),
        (
            Drive::Sum(vec![steep, Drive::Sum(vec![bent, Drive::Wave(wave)])]),
            Box::new(move |t| ramp(t) + points(t) + of_wave(t)),
            &["0.3", "1", "2", "3"],
        ),
    ];
    for (signal, expected, corners) in cases {
        let mut rotor = flywheel("4");
        rotor.torque = torque(signal, 0);
        let problem = problem(rotor, rigid(End::Fixed), value("0"), "1", coulomb("1"));
        let times = list(&["0", "0.2", "0.7", "1.6", "2.5", "4"]);
        let report = sampled(&problem, 30, "5", &times);
        let found: Vec<Real> = report.events.iter().map(|event| exact(&event.time)).collect();
        assert_eq!(kinds(&report), vec![Corner; corners.len()]);
        for (found, corner) in found.iter().zip(corners) {
            assert!(nearest_double(&(found - r(corner))).abs() < 1e-28);
        }
        for ((_, state), t) in report.samples.iter().zip(&times) {
            near_double(&state.rotor_speed[0], expected(nearest_double(t)) / 4.0, 2e-15);
        }
    }
}

/// A driven end and viscous damping: J w' + d w = c (V - w) with V = a t, without a spring, from rest. The twist rate
/// of the dashpot is V - w.
#[test]
fn analytic_a_driven_dashpot() {
    let drive = table(&["0", "10"], &["0", "30"]);
    let mut rotor = train(&["2"], &["0"], &["1"], End::Driven(drive));
    rotor.viscous = list(&["0.5"]);
    let problem = problem(rotor, rigid(End::Fixed), value("0"), "1", coulomb("1"));
    let times = list(&["0.1", "1", "5", "9"]);
    let report = sampled(&problem, 40, "9.5", &times);
    for ((_, state), t) in report.samples.iter().zip(&times) {
        let t = nearest_double(t);
        // w' + 0.75 w = 1.5 t.
        let speed = 2.0 * t - 2.0 / 0.75 * (1.0 - (-0.75 * t).exp());
        near_double(&state.rotor_speed[0], speed, 1e-14);
        near_double(&state.rotor_twist_rate[0], 3.0 * t - speed, 1e-14);
    }
}

/// A belt that starts, reverses and stops by jumps: the mass on it slips, reverses twice, and rests again.
#[test]
fn analytic_a_belt_that_jumps() {
    let wave = |from: &str, to: &str, amplitude: &str| {
        let to = Some(r(to));
        Drive::Wave(Wave {
            to,
            ..constant("0", amplitude, from)
        })
    };
    // The speeds 0, 2, -1 and 0 are almost constant.
    let speed = Drive::Sum(vec![wave("1", "2", "2"), wave("2", "3.5", "-1")]);
    let belt = problem(rigid(End::Driven(speed)), flywheel("1"), value("1"), "1", coulomb("1"));
    let report = run(&belt, 40, "6");
    let expected = [
        (Corner, "1", "0"),
        (Slip, "1", "0"),
        (Corner, "2", "1"),
        (Reversal, "2", "1"),
        (Corner, "3.5", "-0.5"),
        (Reversal, "3.5", "-0.5"),
        (Stick, "4", "0"),
    ];
    follows(&report, &expected, |state| &state.stator_speed[0]);
}

// Kicks.

/// A kick on one surface, in slip and in stick, where both surfaces take its momentum.
#[test]
fn analytic_kicks_on_one_side() {
    let (rotor, stator) = (flywheel("1"), flywheel("3"));
    let force = table(&["0", "4", "4.5"], &["0", "0", "12"]);
    let mut pair = problem(rotor, stator, force, "1", coulomb("1"));
    pair.initial.rotor_speed = list(&["4"]);
    use KickSide::{Both, Rotor, Stator};
    let kicks = [
        ("1", Rotor),
        ("2", Stator),
        ("3", Both),
        ("8", Rotor),
        ("9", Stator),
        ("10", Both),
    ];
    pair.kicks = kicks.map(|(time, on)| kick(time, "1", on)).to_vec();
    let report = run(&pair, 40, "11");
    let expected = [
        (EventKind::Kick, "5", "0"),
        (EventKind::Kick, "5", "-1"),
        (EventKind::Kick, "5.75", "-1.25"),
        (Corner, "5.75", "-1.25"),
        (Contact, "5.75", "-1.25"),
        (Corner, "2.75", "-0.25"),
        (Stick, "0.5", "0.5"),
        (EventKind::Kick, "0.75", "0.75"),
        (EventKind::Kick, "0", "0"),
        (EventKind::Kick, "0", "0"),
    ];
    assert_eq!(report.events.len(), expected.len());
    for (event, (kind, rotor, stator)) in report.events.iter().zip(expected) {
        assert_eq!(event.kind, kind);
        near(&event.state.rotor_speed[0], rotor, 1e-36);
        near(&event.state.stator_speed[0], stator, 1e-36);
    }
}

// Pressing.

/// A force that rises through zero and falls through it again, and one that only touches zero at a point of its table.
#[test]
fn analytic_contact_and_separation_under_a_given_force() {
    let pair = |force| {
        let (rotor, stator) = (flywheel("1"), flywheel("1"));
        let mut pair = problem(rotor, stator, force, "1", coulomb("1"));
        pair.initial.rotor_speed = list(&["1000"]);
        pair
    };
    let turns = [(Contact, "1"), (Corner, "2"), (Separation, "3"), (Corner, "4")];
    let rests = [
        (Corner, "0.1"),
        (Separation, "0.1"),
        (Corner, "0.3"),
        (Contact, "0.3"),
        (Corner, "0.7"),
    ];
    let touches = [(Corner, "0.1"), (Corner, "0.7")];
    for (time, value, expected) in [
        (&["0", "2", "4"][..], &["-1", "1", "-1"][..], &turns[..]),
        (&["0", "0.1", "0.3", "0.7"], &["1", "0", "0", "1"], &rests),
        (&["0", "0.1", "0.7"], &["1", "0", "1"], &touches),
    ] {
        let report = run(&pair(table(time, value)), 40, "5");
        print(&report);
        let kinds: Vec<_> = expected.iter().map(|(kind, _)| *kind).collect();
        assert_eq!(self::kinds(&report), kinds);
        for (event, (_, time)) in report.events.iter().zip(expected) {
            near(&event.time, time, 1e-35);
        }
    }
    // sin(2 pi t) - 0.5: above zero from 1/12 to 5/12 s.
    let wave = Wave {
        shape: HarmonicShape::Sine,
        mean: r("-0.5"),
        ..cosine("1", Frequency::Cycles(r("1")))
    };
    let report = run(&pair(Drive::Wave(wave)), 40, "2");
    assert_eq!(kinds(&report), [Contact, Separation, Contact, Separation]);
    for (event, twelfths) in report.events.iter().zip(["1", "5", "13", "17"]) {
        near_exact(&event.time, &(r(twelfths) / r("12")), 1e-36);
    }
}

// Bristles.

/// LuGre's mass on a belt against the Runge-Kutta method in doubles, whose error is about 1e-10 here.
#[test]
fn analytic_bristles_by_runge_and_kutta() {
    let law = law("stribeck low_speed=1.5 high_speed=1 viscous=0 exponent=2 scale=0.1");
    let mut belt = belt("1", "2", "0.1", "1.5", law);
    belt.contact = bristles("100", "5", "0.4");
    let times: Vec<Real> = (1..=12).map(|k| r(&format!("{k}"))).collect();
    let options = OracleOptions {
        threshold: Some(r("0.01")),
        ..options(&belt, 30, "12.5", &times)
    };
    let report = oracle::run(&belt, &options, &mut |_| ControlFlow::Continue(())).unwrap();
    print(&report);
    assert!(report.events.len() >= 2);
    // x, v, z.
    let rates = |[x, v, z]: [f64; 3]| {
        let w = 0.1 - v;
        let g = 1.0 + 0.5 * (-(w / 0.1) * (w / 0.1)).exp();
        let z_dot = w - 100.0 * w.abs() * z / g;
        [v, 100.0 * z + 5.0 * z_dot + 0.4 * w - 2.0 * x, z_dot]
    };
    let (mut y, h) = ([0.0, 0.0, 0.0], 1e-4);
    for (_, state) in &report.samples {
        for _ in 0..10_000 {
            let moved = |k: [f64; 3], by: f64| std::array::from_fn(|i| y[i] + by * k[i]);
            let a = rates(y);
            let b = rates(moved(a, h / 2.0));
            let c = rates(moved(b, h / 2.0));
            let d = rates(moved(c, h));
            y = std::array::from_fn(|i| y[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
        }
        let z = state.deflection.as_ref().expect("bristles");
        near_double(&state.stator_twist[0], y[0], 1e-8);
        near_double(&state.stator_speed[0], y[1], 1e-8);
        near_double(z, y[2], 1e-8);
    }
}

/// A driven surface that oscillates carries a mass, as rotor and as stator. The mass slips where m A = mu_0 F_n, here
/// with A = a sin(2 pi t) and a = 2 mu_0 F_n/m at t = 1/12 s.
#[test]
fn analytic_a_mass_on_an_accelerated_surface() {
    let speed = |sign: &str| {
        // Minus cos(2 pi t): the surface moves backwards first.
        Drive::Wave(Wave {
            mean: r("0"),
            ..cosine(sign, Frequency::Cycles(r("1")))
        })
    };
    // a = 2 pi times the amplitude of the speed, 1.
    let force = Drive::Value(r("3") * r(PI_DIGITS));
    for (sign, kind) in [("-1", Mode::SlipForward), ("1", Mode::SlipBackward)] {
        let opposite = |sign: &str| vec![r(sign)];

        let driven = rigid(End::Driven(speed(sign)));
        let mut by_rotor = problem(driven.clone(), flywheel("3"), force.clone(), "1", coulomb("0.5"));
        by_rotor.initial.stator_speed = opposite(sign);
        let mut by_stator = problem(flywheel("3"), driven, force.clone(), "1", coulomb("0.5"));
        by_stator.initial.rotor_speed = opposite(sign);
        for (problem, mirrored) in [(by_rotor, false), (by_stator, true)] {
            let report = run(&problem, 40, "0.1");
            assert_eq!(kinds(&report), [Slip]);
            let event = &report.events[0];
            near_exact(&event.time, &(r("1") / r("12")), 1e-36);
            assert_eq!(event.mode_after == kind, !mirrored);
        }
    }
}

/// A torque that sets in at once exceeds a stick's limit; a force that does so opens and closes a contact at once.
#[test]
fn analytic_signals_that_jump() {
    let jump = |mean: &str, amplitude: &str, from: &str| Drive::Wave(constant(mean, amplitude, from));
    let mut rotor = flywheel("2");
    rotor.torque = torque(jump("0.5", "-3", "1"), 0);
    let mut block = problem(rotor, rigid(End::Fixed), jump("1", "-1.5", "4"), "1", coulomb("0.5"));
    block.pressing = Pressing::Force(Drive::Sum(vec![jump("1", "-1.5", "4"), jump("0", "2.5", "5")]));
    let report = run(&block, 40, "6");
    let expected = [
        (Corner, "1", "0"),
        (Slip, "1", "0"),
        // -1 = (-2.5 + 0.5)/2, then -1.25, then (-2.5 + 1)/2.
        (Corner, "4", "-3"),
        (Separation, "4", "-3"),
        (Corner, "5", "-4.25"),
        (Contact, "5", "-4.25"),
    ];
    follows(&report, &expected, |state| &state.rotor_speed[0]);
}

/// If a drive jumps behind a shaft, the inertias keep their speeds, and the dashpot of the shaft breaks a stick.
#[test]
fn analytic_a_drive_that_jumps_behind_a_shaft() {
    let speed = Drive::Wave(Wave {
        to: Some(r("2")),
        ..constant("0", "4", "1")
    });
    let rotor = train(&["2"], &["0"], &["0.5"], End::Driven(speed));
    let block = problem(rotor, rigid(End::Fixed), value("1"), "1", coulomb("1"));
    let report = run(&block, 40, "4");
    print(&report);
    assert_eq!(kinds(&report), [Corner, Slip, Corner, Stick]);
    let [before, slip, after, stick] = &report.events[..] else {
        panic!("four events")
    };
    near(&before.state.rotor_twist_rate[0], "4", 1e-36);
    near(&slip.state.rotor_speed[0], "0", 1e-36);
    // 2 w' = 0.5 (4 - w) - 1 up to t = 2, then 2 w' = -0.5 w - 1.
    let speed = 2.0 * (1.0 - (-0.25_f64).exp());
    near_double(&after.state.rotor_speed[0], speed, 1e-14);
    near_double(&after.state.rotor_twist_rate[0], -speed, 1e-14);
    near_double(&stick.time, 2.0 + 4.0 * (1.0 + speed / 2.0).ln(), 1e-14);
}

/// Both surfaces of a stick take a kick on one side. The change of the dashpots' torques may break the stick.
#[test]
fn analytic_a_kick_breaks_a_stick_by_its_dashpot() {
    let rotor = flywheel("1");
    let stator = train(&["1"], &["0"], &["3"], End::Fixed);
    for (delta, expected) in [("1", vec![EventKind::Kick]), ("2", vec![EventKind::Kick, Slip])] {
        let mut pair = problem(rotor.clone(), stator.clone(), value("1"), "1", coulomb("0.5"));
        pair.kicks = vec![kick("1", delta, KickSide::Rotor)];
        let report = run(&pair, 40, "1.1");
        // T_f = 3/2 times the common speed, delta/2.
        assert_eq!(kinds(&report), expected);
        let sticks = |event: &OracleEvent| event.state.relative_velocity.to_f64() == 0.0;
        assert!(report.events.iter().all(sticks));
    }
}

// Engaged contacts against plain doubles.

/// Absolute angles, forces by their differences, and the Runge-Kutta method: nothing in common with the oracle.
struct Plain<'a> {
    problem: &'a ExactSystem,
    friction: &'a dyn Fn(f64) -> f64,
}

impl Plain<'_> {
    fn signal(drive: &Drive<Real>, t: f64) -> f64 {
        match drive {
            Drive::Value(value) => nearest_double(value),
            Drive::Sum(drives) => drives.iter().map(|drive| Self::signal(drive, t)).sum(),
            Drive::Wave(wave) => {
                let omega = match &wave.frequency {
                    Frequency::Angular(omega) => nearest_double(omega),
                    Frequency::Cycles(frequency) => TAU * nearest_double(frequency),
                    Frequency::Sweep { .. } => panic!("none of these"),
                };
                let angle = omega * t + nearest_double(&wave.phase);
                let shape = match wave.shape {
                    HarmonicShape::Sine => angle.sin(),
                    HarmonicShape::Cosine => angle.cos(),
                };
                nearest_double(&wave.mean) + nearest_double(&wave.amplitude) * shape
            }
            Drive::Linear(_) => panic!("none of these"),
        }
    }

    /// Inertias, then the angle of the far end, for both trains; and the deflection of the bristles.
    fn rates(&self, t: f64, y: &[f64]) -> Vec<f64> {
        let (rotor, stator) = (&self.problem.rotor, &self.problem.stator);
        let [n, m] = [rotor, stator].map(|train| train.inertia.len());
        let (first, second) = y.split_at(2 * n + 1);
        let surface = |train: &Train<Real>, y: &[f64]| match (&train.end, train.inertia.len()) {
            (End::Driven(drive), 0) => Self::signal(drive, t),
            (_, 0) => 0.0,
            (_, n) => y[n],
        };
        let w = surface(rotor, first) - surface(stator, second);
        let z = y[2 * n + 2 * m + 2];
        let Pressing::Force(force) = &self.problem.pressing else {
            panic!("a force")
        };
        let pressed = Self::signal(force, t).max(0.0) * nearest_double(&self.problem.radius);
        let mu = (self.friction)(w.abs());
        let (coefficient, z_dot) = match &self.problem.contact {
            ContactLaw::Regularised(Regularisation { function, speed }) => {
                let ratio = w / nearest_double(speed);
                let smooth = match function {
                    Smoothing::Tanh => ratio.tanh(),
                    Smoothing::Arctan => ratio.atan() * 2.0 / PI,
                };
                (mu * smooth, 0.0)
            }
            ContactLaw::Bristles(bristles) => {
                let [a, b, c] = [&bristles.stiffness, &bristles.damping, &bristles.viscous].map(nearest_double);
                let z_dot = w - a * w.abs() * z / mu;
                (a * z + b * z_dot + c * w, z_dot)
            }
            ContactLaw::StickSlip => panic!("an engaged contact"),
        };
        let torque = coefficient * pressed;
        let mut rates = Vec::new();
        for (train, y, torque) in [(rotor, first, -torque), (stator, second, torque)] {
            let n = train.inertia.len();
            let (angles, speeds) = (&y[..n], &y[n..2 * n]);
            let end = match &train.end {
                End::Driven(drive) => Self::signal(drive, t),
                _ => 0.0,
            };
            let mut sums: Vec<f64> = (0..n).map(|i| -nearest_double(&train.viscous[i]) * speeds[i]).collect();
            for i in 0..train.stiffness.len() {
                let far = (y[2 * n], end);
                let (angle, speed) = if i + 1 < n { (angles[i + 1], speeds[i + 1]) } else { far };
                let shaft = nearest_double(&train.stiffness[i]) * (angle - angles[i])
                    + nearest_double(&train.damping[i]) * (speed - speeds[i]);
                sums[i] += shaft;
                if i + 1 < n {
                    sums[i + 1] -= shaft;
                }
            }
            if let Some(external) = &train.torque {
                sums[external.on] += Self::signal(&external.signal, t);
            }
            if n > 0 {
                sums[0] += torque;
            }
            rates.extend(speeds);
            rates.extend(sums.iter().zip(&train.inertia).map(|(sum, j)| sum / nearest_double(j)));
            rates.push(end);
        }
        rates.push(z_dot);
        rates
    }

    fn step(&self, t: f64, y: &mut [f64], h: f64) {
        let moved = |k: &[f64], by: f64| y.iter().zip(k).map(|(y, k)| y + by * k).collect::<Vec<_>>();
        let a = self.rates(t, y);
        let b = self.rates(t + h / 2.0, &moved(&a, h / 2.0));
        let c = self.rates(t + h / 2.0, &moved(&b, h / 2.0));
        let d = self.rates(t + h, &moved(&c, h));
        for (i, y) in y.iter_mut().enumerate() {
            *y += h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
        }
    }
}

/// Every law and every contact without stick on trains of several inertias under harmonics.
#[test]
fn property_engaged_contacts_by_runge_and_kutta() {
    let wave = |mean: &str, amplitude: &str, frequency: &str, shape| {
        Drive::Wave(Wave {
            mean: r(mean),
            phase: r("0.3"),
            shape,
            ..cosine(amplitude, Frequency::Cycles(r(frequency)))
        })
    };
    let points = ExactLaw {
        lists: vec![
            ("speed", list(&["0", "0.5", "1.2", "2"])),
            ("coefficient", list(&["0.5", "0.4", "0.35", "0.37"])),
        ],
        words: vec![("interpolation", "linear")],
        ..law("table")
    };
    type Named = (ExactLaw, Box<dyn Fn(f64) -> f64>);
    let named = |text, of: fn(f64) -> f64| -> Named { (law(text), Box::new(of)) };
    let laws: Vec<Named> = vec![
        named("exponential low_speed=0.5 high_speed=0.3 decay=2", |x| {
            0.3 + 0.2 * (-2.0 * x).exp()
        }),
        named("coulomb kinetic=0.4", |_| 0.4),
        named("hyperbolic low_speed=0.5 high_speed=0.3 scale=0.5", |x| {
            0.3 + 0.2 / (1.0 + x / 0.5)
        }),
        named(
            "stribeck low_speed=0.5 high_speed=0.3 scale=0.5 exponent=2 viscous=0.05",
            |x| 0.3 + 0.2 * (-(x / 0.5) * (x / 0.5)).exp() + 0.05 * x,
        ),
        named(
            "polynomial low_speed=0.5 linear=-0.1 quadratic=0.01 cubic=0.002 valid_below=50",
            |x| 0.5 - 0.1 * x + 0.01 * x * x + 0.002 * x * x * x,
        ),
        (
            points,
            Box::new(|x| match x {
                x if x < 0.5 => 0.5 - 0.2 * x,
                x if x < 1.2 => 0.4 - 0.05 / 0.7 * (x - 0.5),
                x if x < 2.0 => 0.35 + 0.025 * (x - 1.2),
                _ => 0.37,
            }),
        ),
    ];
    for (law, friction) in &laws {
        for contact in [
            regularised(Smoothing::Tanh, "0.2"),
            regularised(Smoothing::Arctan, "0.2"),
            bristles("40", "1", "0.1"),
        ] {
            let mut rotor = train(&["0.5", "2", "1"], &["300", "40"], &["0.1", "0.5"], End::Free);
            rotor.viscous = list(&["0.01", "0", "0.3"]);
            rotor.torque = torque(wave("2", "8", "0.4", HarmonicShape::Cosine), 1);
            let drive = wave("0.1", "0.3", "0.7", HarmonicShape::Sine);
            let mut stator = train(&["0.4", "1"], &["200", "90"], &["0.05", "0.1"], End::Driven(drive));
            stator.viscous = list(&["0.02", "0.2"]);
            let force = wave("30", "10", "1.1", HarmonicShape::Cosine);
            let mut problem = problem(rotor, stator, force, "0.6", law.clone());
            problem.radius = r("0.3");
            problem.contact = contact;
            problem.initial = Initial {
                rotor_twist: list(&["0.01", "-0.02"]),
                rotor_speed: list(&["1", "0.5", "0.7"]),
                stator_twist: list(&["-0.01", "0.03"]),
                stator_speed: list(&["-1", "0.2"]),
            };
            let report = sampled(&problem, 25, "3", &list(&["0.5", "1", "1.5", "2", "2.5", "3"]));
            assert_eq!(report.samples.len(), 6);
            let plain = Plain {
                problem: &problem,
                friction,
            };
            // Angles outwards: for the rotor by adding its twists, for the stator by subtracting them.
            let mut y = vec![0.0, 0.01, -0.01, 1.0, 0.5, 0.7, 0.0, 0.0, 0.01, -1.0, 0.2, -0.02, 0.0];
            let (h, mut t) = (5e-5, 0.0);
            let mut worst = 0.0_f64;
            for (_, state) in &report.samples {
                for _ in 0..10_000 {
                    plain.step(t, &mut y, h);
                    t += h;
                }
                let pairs = [
                    (&state.rotor_twist[0], y[1] - y[0]),
                    (&state.rotor_twist[1], y[2] - y[1]),
                    (&state.rotor_speed[0], y[3]),
                    (&state.rotor_speed[1], y[4]),
                    (&state.rotor_speed[2], y[5]),
                    (&state.stator_twist[0], y[7] - y[8]),
                    (&state.stator_twist[1], y[8] - y[11]),
                    (&state.stator_speed[0], y[9]),
                    (&state.stator_speed[1], y[10]),
                    (&state.relative_velocity, y[3] - y[9]),
                    (state.deflection.as_ref().expect("engaged"), y[12]),
                ];
                let errors = pairs.map(|(found, expected)| (found.to_f64() - expected).abs());
                worst = errors.into_iter().fold(worst, f64::max);
            }
            println!(
                "{} {:?}: {worst:.1e}, {} steps",
                law.name, problem.contact, report.steps
            );
            // The error of a step across a kink of mu(|omega_r|), or of a table, is its square: 2.5e-9 times a share
            // of the torque.
            assert!(worst < 1e-7);
        }
    }
}

/// w' = -a tanh(w/eps), so that sinh(w/eps) falls as exp(-a t/eps); a kick is a slip if it takes |w| above the
/// threshold.
#[test]
fn analytic_a_kick_in_a_regularised_contact() {
    let mut pair = problem(flywheel("1"), flywheel("1"), value("1"), "0.5", coulomb("0.5"));
    pair.contact = regularised(Smoothing::Tanh, "0.01");
    for (on, size, [rotor, stator]) in [
        (KickSide::Both, "1", ["0.5", "-0.5"]),
        (KickSide::Rotor, "-1", ["-1", "0"]),
        (KickSide::Stator, "1", ["0", "-1"]),
    ] {
        pair.kicks = vec![kick("1", size, on)];
        let report = run(&pair, 40, "3");
        assert_eq!(kinds(&report), [EventKind::Kick, Slip, Stick]);
        let [kick, slip, stick] = &report.events[..] else {
            panic!("three events")
        };
        for event in [kick, slip] {
            near(&event.time, "1", 1e-36);
            near(&event.state.rotor_speed[0], rotor, 1e-36);
            near(&event.state.stator_speed[0], stator, 1e-36);
        }
        let log_sinh = |x: f64| x + (-(-2.0 * x).exp()).ln_1p();
        near_double(&stick.time, 1.0 + 0.01 * (log_sinh(100.0) - log_sinh(10.0)), 1e-14);
    }
}

/// Bristles that lose contact have no deflection, and none until they touch again.
#[test]
fn analytic_bristles_let_go() {
    let force = table(&["0", "1", "1.5", "2"], &["1", "-1", "-1", "1"]);
    let mut pair = problem(flywheel("1"), flywheel("1"), force, "0.5", coulomb("0.5"));
    pair.contact = bristles("100", "1", "0");
    pair.initial.rotor_speed = list(&["3"]);
    let report = sampled(&pair, 40, "2.5", &list(&["0.25", "0.75", "1.6", "1.8"]));
    assert_eq!(kinds(&report), [Separation, Corner, Corner, Contact, Corner]);
    near(&report.events[0].time, "0.5", 1e-36);
    near(&report.events[3].time, "1.75", 1e-36);
    let samples = report.samples.iter();
    let deflections = samples.map(|sample| sample.1.deflection.clone().expect("bristles"));
    let [first, open, waiting, last] = deflections.collect::<Vec<_>>().try_into().expect("four");
    // In steady sliding z = mu/sigma_0.
    near_double(&first, 0.005, 1e-8);
    near(&open, "0", 0.0);
    near(&waiting, "0", 0.0);
    near_double(&last, 0.005, 1e-8);
}

// Digits that the runs claim.

fn stiff_pair() -> ExactSystem {
    let drive = Drive::Wave(Wave {
        mean: r("1"),
        ..cosine("0.4", Frequency::Cycles(r("0.3")))
    });
    let rotor = train(&["0.5", "2"], &["300", "40"], &["0.1", "0.5"], End::Driven(drive));
    let mut stator = train(&["0.4", "1"], &["200", "900"], &["0.05", "0.1"], End::Fixed);
    stator.viscous = list(&["0.01", "0.2"]);
    let law = law("stribeck low_speed=0.5 high_speed=0.3 scale=0.3 exponent=2 viscous=0.01");
    let mut pair = problem(rotor, stator, value("100"), "0.6", law);
    pair.radius = r("0.3");
    pair.initial.rotor_speed = list(&["1", "1"]);
    pair
}

/// With more digits every event keeps its place; the claims of a solution are true for a run with more digits.
#[test]
fn multiprecision_more_digits_change_nothing() {
    let mut engaged = stiff_pair();
    engaged.contact = regularised(Smoothing::Tanh, "0.02");
    for parameters in [stiff_pair(), engaged] {
        let request = OracleRequest {
            digits: 25,
            growth: 5.0,
            end_time: r("6"),
            longest: Duration::from_secs(3600),
            threshold: threshold(&parameters),
            ..OracleRequest::default()
        };
        let solution = oracle::solve(&parameters, &request, &()).unwrap();
        let finer = run(&parameters, solution.digits_computed + 20, "6");
        println!(
            "{} events, {} digits, {:.2} s",
            finer.events.len(),
            solution.digits,
            solution.seconds
        );
        assert!(finer.events.len() > 4);
        assert_eq!(kinds(&finer), kinds(&solution.report));
        for (index, (found, exact)) in solution.report.events.iter().zip(&finer.events).enumerate() {
            assert!(found.time.minus(&exact.time).abs() <= solution.errors[index]);
            assert!(solution.digits_of_event(index) >= 25);
        }
    }
}

/// The same system from the other side: rotor and stator exchanged, and every speed and torque reversed.
fn mirrored(problem: &ExactSystem) -> ExactSystem {
    fn opposite(values: &[Real]) -> Vec<Real> {
        values.iter().map(|x| -x).collect()
    }
    fn reversed(drive: &Drive<Real>) -> Drive<Real> {
        match drive {
            Drive::Value(value) => Drive::Value(-value),
            Drive::Sum(drives) => Drive::Sum(drives.iter().map(reversed).collect()),
            Drive::Wave(wave) => Drive::Wave(Wave {
                mean: -&wave.mean,
                amplitude: -&wave.amplitude,
                ..wave.clone()
            }),
            Drive::Linear(Signal::TimeTable(TimeTable { time, value })) => {
                let (time, value) = (time.clone(), opposite(value));
                Drive::Linear(Signal::TimeTable(TimeTable { time, value }))
            }
            Drive::Linear(Signal::Ramp(Ramp { value, rise_time })) => {
                let (value, rise_time) = (-value, rise_time.clone());
                Drive::Linear(Signal::Ramp(Ramp { value, rise_time }))
            }
        }
    }
    let of = |train: &Train<Real>| Train {
        end: match &train.end {
            End::Driven(drive) => End::Driven(reversed(drive)),
            end => end.clone(),
        },
        torque: train.torque.as_ref().map(|torque| Torque {
            signal: reversed(&torque.signal),
            on: torque.on,
        }),
        ..train.clone()
    };
    let mirror = |kick: &Kick<Real>| Kick {
        on: match kick.on {
            KickSide::Both => KickSide::Both,
            KickSide::Rotor => KickSide::Stator,
            KickSide::Stator => KickSide::Rotor,
        },
        ..kick.clone()
    };
    let initial = &problem.initial;
    ExactSystem {
        rotor: of(&problem.stator),
        stator: of(&problem.rotor),
        initial: Initial {
            rotor_twist: initial.stator_twist.clone(),
            rotor_speed: opposite(&initial.stator_speed),
            stator_twist: initial.rotor_twist.clone(),
            stator_speed: opposite(&initial.rotor_speed),
        },
        kicks: problem.kicks.iter().map(mirror).collect(),
        ..problem.clone()
    }
}

/// Two trains of up to three inertias each, with any ends, signals, laws and kicks.
fn random_trains(index: u64) -> ExactSystem {
    let mut random = Random(index);
    let number = |x: f64| r(&format!("{x:.6}"));
    let mut within = |low: f64, high: f64| random.within(low, high);
    let signal = |within: &mut dyn FnMut(f64, f64) -> f64, mean: f64, size: f64| {
        let wave = |within: &mut dyn FnMut(f64, f64) -> f64| Wave {
            shape: [HarmonicShape::Cosine, HarmonicShape::Sine][usize::from(within(0.0, 1.0) < 0.5)],
            mean: number(mean),
            amplitude: number(size * within(0.2, 1.0)),
            frequency: Frequency::Cycles(number(within(0.1, 3.0))),
            phase: number(within(0.0, 6.0)),
            from: None,
            to: None,
        };
        match within(0.0, 5.0) as u8 {
            0 => Drive::Value(number(mean)),
            1 => Drive::Wave(wave(within)),
            2 => Drive::Wave(Wave {
                from: Some(number(within(0.1, 1.0))),
                to: Some(number(within(1.0, 2.5))),
                ..wave(within)
            }),
            3 => Drive::Linear(Signal::TimeTable(TimeTable {
                time: [0.0, 0.7, 1.5, 2.0].map(number).to_vec(),
                value: (0..4).map(|_| number(mean + size * within(-1.0, 1.0))).collect(),
            })),
            _ => Drive::Sum(vec![
                Drive::Linear(Signal::Ramp(Ramp {
                    value: number(size / 2.0),
                    rise_time: number(within(0.2, 1.0)),
                })),
                Drive::Wave(wave(within)),
            ]),
        }
    };
    let train = |within: &mut dyn FnMut(f64, f64) -> f64, least: usize| {
        let inertias = least.max(within(0.0, 4.0) as usize);
        let end = match within(0.0, 3.0) as u8 {
            0 if inertias > 0 => End::Free,
            1 => End::Driven(signal(within, 0.5, 0.5)),
            _ => End::Fixed,
        };
        let shafts = if end == End::Free { inertias - 1 } else { inertias };
        let torque = (inertias > 0 && within(0.0, 1.0) < 0.5).then(|| Torque {
            signal: signal(within, 3.0, 8.0),
            on: within(0.0, inertias as f64) as usize,
        });
        let mut numbers = |count: usize, low: f64, high: f64| (0..count).map(|_| number(within(low, high))).collect();
        Train {
            inertia: numbers(inertias, 0.2, 2.0),
            stiffness: numbers(shafts, 20.0, 400.0),
            damping: numbers(shafts, 0.0, 1.0),
            viscous: numbers(inertias, 0.0, 0.3),
            end,
            torque,
        }
    };
    let rotor = train(&mut within, 0);
    let stator = train(&mut within, usize::from(rotor.is_rigid()));
    let force = signal(&mut within, 30.0, 35.0);
    let law = match within(0.0, 3.0) as u8 {
        0 => law("exponential low_speed=0.5 high_speed=0.3 decay=2"),
        1 => coulomb("0.5"),
        _ => law("hyperbolic low_speed=0.5 high_speed=0.2 scale=0.5"),
    };
    let breakaway = if within(0.0, 1.0) < 0.5 { "0.5" } else { "0.6" };
    let mut problem = problem(rotor, stator, force, breakaway, law);
    problem.radius = r("0.3");
    let initial = &mut problem.initial;
    for speed in initial.rotor_speed.iter_mut().chain(&mut initial.stator_speed) {
        *speed = number(within(-1.0, 1.0));
    }
    problem.kicks = [KickSide::Both, KickSide::Rotor, KickSide::Stator]
        .into_iter()
        .map(|on| Kick {
            time: KickTime::At(number(within(0.0, 3.0))),
            relative_velocity: number(within(-1.0, 1.0)),
            on,
        })
        .collect();
    problem
}

/// With more digits, and from the other side, every event keeps its place.
#[test]
fn property_random_trains_by_more_digits_and_from_the_other_side() {
    let mut count = [0; 9];
    // 147 comes to rest before its contact opens and closes; 173, regularised, before its sense changes by rounding
    // alone.
    for index in (0..32).chain([147, 173]) {
        let mut problem = random_trains(index);
        problem.contact = match index % 4 {
            1 => regularised(Smoothing::Tanh, "0.05"),
            2 => bristles("50", "1", "0.1"),
            _ => ContactLaw::StickSlip,
        };
        let (short, long) = (run(&problem, 30, "3"), run(&problem, 60, "3"));
        let other = run(&mirrored(&problem), 60, "3");
        assert_eq!(kinds(&short), kinds(&long), "{index}");
        assert_eq!(kinds(&other), kinds(&long), "{index}");
        let mut worst = 0.0_f64;
        for ((a, b), c) in short.events.iter().zip(&long.events).zip(&other.events) {
            assert!(a.mode_after == b.mode_after && b.mode_after == c.mode_after);
            worst = worst.max(a.time.minus(&b.time).abs());
            assert!(b.time.minus(&c.time).abs() < 1e-40, "{index}");
            if let Some(counted) = count.get_mut(b.kind as usize) {
                *counted += 1;
            }
        }
        assert!(worst < 1e-20, "{index}: {worst:.1e}");
    }
    println!("{count:?}");
}
