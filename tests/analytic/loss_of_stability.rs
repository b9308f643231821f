//! The loss of stability of sliding that slows down by itself: its margin, its growth, and kicks that wait for it. A
//! brake is the same system in both forms of the case file.

use crate::common::cases::{built_in, by, from_truth, kinds, parsed, reported, source, truth, written};
use crate::common::disks;
use crate::common::random_brakes::{Random, random_brake, random_release};
use stickslip::Run;
use stickslip::analysis::{Modes, Summary};
use stickslip::case::{Case, CaseSource, Override};
use stickslip::friction::Law;
use stickslip::model::Torsion;
use stickslip::model::equations::{Outside, SystemEquations};
use stickslip::model::system::System;
use stickslip::record::{Event, EventKind};
use stickslip::simulation::{Method, RunReport};

const AT_INSTABILITY: &str = "perturbation=[{time=\"instability\", relative_velocity=1e-4}]";

/// Built-in brakes and changes to them: both senses, and every breakaway test.
const BRAKES: &[(&str, &[&str])] = &[
    ("paper", &[]),
    ("paper-si", &[]),
    ("release", &[]),
    ("paper", &[AT_INSTABILITY]),
    ("paper", &[AT_INSTABILITY, "initial.speed=-100"]),
    ("paper-si", &[AT_INSTABILITY]),
    ("release", &[AT_INSTABILITY]),
    ("release", &["initial.speed=-14"]),
    ("paper-si", &["contact.breakaway_test=rotor"]),
    (
        "paper",
        &[AT_INSTABILITY, "contact.breakaway_test=rotor", "initial.speed=-100"],
    ),
    ("paper", &[AT_INSTABILITY, "contact.breakaway_test=stator"]),
    (
        "paper",
        &[
            AT_INSTABILITY,
            // The margin jumps at the knots.
            "friction={law=\"table\", breakaway=0.6, speed=[0, 0.4, 1, 3, 150], coefficient=[0.6, 0.5, 0.4, 0.31, 0.3], \
             interpolation=\"linear\"}",
        ],
    ),
];

/// Methods with their largest error against the oracle (s), which grows from the loss of stability on.
const METHODS: [(Method, f64); 3] = [(Method::Series, 1e-12), (Method::Arkode, 1e-11), (Method::Cvode, 1e-8)];

fn steps(report: &RunReport) -> u64 {
    report.work.iter().map(|work| work.steps).sum()
}

fn brake(name: &str, changes: &[Override]) -> Case {
    Case::read(&CaseSource::built_in(name).unwrap(), changes).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// The report of a run; for a failed run the report up to its failure.
fn report(case: &Case, method: Method) -> RunReport {
    let run = Run::new(&by(case, method)).start();
    run.unwrap_or_else(|failure| failure.report)
}

fn completed(case: &Case, method: Method) -> RunReport {
    reported(&by(case, method)).1
}

/// Equal systems have equal runs, modes and growth.
#[test]
fn property_a_brake_written_as_rotor_and_stator_is_the_same_system() {
    let written = BRAKES.iter().map(|(name, changes)| (*name, parsed(changes)));
    let random = (0..12).map(|index| ("paper-si", random_brake(index)));
    let releases = (0..8).map(|index| ("release", random_release(index)));
    for (name, changes) in written.chain(random).chain(releases) {
        let case = brake(name, &changes);
        let general = as_trains(&case);
        assert_eq!(general.system, case.system, "{name} {changes:?}");
        assert_eq!((general.solver, general.output), (case.solver, case.output), "{name}");
    }
}

#[test]
fn analytic_every_brake_loses_its_stability_by_every_kind_of_method() {
    for (name, changes) in BRAKES {
        for (method, _) in METHODS {
            let report = report(&built_in(name, changes), method);
            let label = format!("{name} {changes:?} by {}", method.name());
            assert!(report.events.len() > 30, "{label}");
            let lost = report.digest.instability.map(|event| event.kind);
            assert_eq!(lost, Some(EventKind::Destabilised), "{label}");
        }
    }
}

/// Without a perturbation sliding is smooth up to its stop, and rounding does not grow: one stick.
#[test]
fn analytic_an_unperturbed_brake_stops_once() {
    for (name, changes) in [("unperturbed", &[][..]), ("paper-si", &["perturbation=[]"])] {
        let report = report(&built_in(name, changes), Method::Series);
        let sticks = report.events.iter().filter(|event| event.kind == EventKind::Stick);
        assert_eq!(sticks.count(), 1, "{name}");
        assert!(report.stopped_smoothly, "{name}");
        assert!(steps(&report) < 300, "{name}: {} steps", steps(&report));
    }
}

#[test]
fn analytic_growth_of_a_brake_is_known() {
    for (name, changes) in [
        ("paper", &[][..]),
        ("paper", &[AT_INSTABILITY, "initial.speed=-100"]),
        ("paper-si", &["perturbation=[{time=2, relative_velocity=0.5}]"]),
        ("release", &[]),
        ("unperturbed", &["solver.method=arkode"]),
    ] {
        let case = built_in(name, changes);
        let summary = Summary::of_run(&case.system, &Run::new(&case).start().unwrap());
        assert!(summary.growth_exponent.unwrap() > 50.0, "{name} {changes:?}");
        assert!(summary.noise_determined || name != "unperturbed", "{name} {changes:?}");
    }
}

/// G does not depend on which of the disks is free. If a shaft of a hundred times the stiffness divides the rotor in
/// two, G changes by less than J/I = 5e-3, the rotor's part in the oscillation.
#[test]
fn analytic_growth_of_a_turned_brake_and_of_a_longer_one() {
    let case = built_in("paper", &["output.end_time=6.98"]);
    let trains = case.system.clone();
    let growth = |trains: &System| {
        let report = Run::of_system(trains, 0.0, &case.solver, &case.output).start().unwrap();
        let summary = Summary::of_run(trains, &report);
        assert!(summary.e_folds_gained.is_some_and(|gained| gained > 10.0));
        summary.growth_exponent.expect("it loses its stability")
    };
    let expected = growth(&trains);
    let mut turned = trains.clone();
    std::mem::swap(&mut turned.rotor, &mut turned.stator);
    std::mem::swap(&mut turned.initial.rotor_twist, &mut turned.initial.stator_twist);
    std::mem::swap(&mut turned.initial.rotor_speed, &mut turned.initial.stator_speed);
    // Here the state at the loss of stability is known by its relative velocity alone.
    let found = growth(&turned);
    assert!((found - expected).abs() < 1e-6 * expected, "{found} for {expected}");
    let mut longer = trains.clone();
    let (rotor, initial) = (&mut longer.rotor, &mut longer.initial);
    rotor.inertia = vec![rotor.inertia[0], 0.5 * rotor.inertia[1], 0.5 * rotor.inertia[1]];
    rotor.stiffness.push(100.0 * rotor.stiffness[0]);
    rotor.damping.push(100.0 * rotor.damping[0]);
    rotor.viscous.push(0.0);
    initial.rotor_twist.push(0.0);
    initial.rotor_speed.push(initial.rotor_speed[0]);
    let found = growth(&longer);
    assert!((found - expected).abs() < 5e-3 * expected, "{found} for {expected}");
}

/// Sliding loses its stability to an oscillation at the frequency of the disks. The faster slowing down of the rotor
/// under falling friction is no instability.
#[test]
fn analytic_a_brake_loses_its_stability_to_the_swing_of_its_disks() {
    let case = built_in("paper", &[]);
    let modes = Modes::of_case(&case.system, &case.solver, case.output.end_time);
    let slowing = modes.slowing.expect("it slows down");
    let crossing = slowing.instability.unwrap().eigenvalue_crossing.expect("a crossing");
    let [change] = modes.critical_relative_velocities.changes[..] else {
        panic!("{:?}", modes.critical_relative_velocities)
    };
    // The force is the largest here, and still rings by 1e-9 of its value.
    assert!((change.value - crossing.relative_velocity).abs() < 1e-6);
    let frequency = change.frequency.expect("a swing");
    assert!((frequency * slowing.natural_period - 1.0).abs() < 0.01, "{frequency}");
}

fn as_trains(case: &Case) -> Case {
    let Torsion {
        rotor_inertia,
        surface_inertia,
        stiffness,
        damping,
    } = disks(case).torsion;
    let shaft = format!("stiffness = {stiffness:?}\ndamping = {damping:?}");
    let written = format!(
        "[rotor]\ninertia = [{surface_inertia:?}, {rotor_inertia:?}]\n{shaft}\nend = \"free\"\n\n\
         [stator]\ninertia = {surface_inertia:?}\n{shaft}\nend = \"fixed\"\n\n"
    );
    let text = case.resolved();
    let start = text.find("[torsion]").expect("a short form");
    let end = start + 1 + text[start + 1..].find("\n[").expect("a table after it");
    let text = [&text[..start], &written, &text[end..]].concat();
    Case::read(&CaseSource::text(&text), &[]).unwrap()
}

/// A waiting kick comes at the loss of stability. If there is none, the kick is counted as not given.
#[test]
fn analytic_a_kick_waits_for_the_instability() {
    let case = built_in("paper", &[AT_INSTABILITY]);
    let report = report(&case, Method::Series);
    let lost = report
        .events
        .iter()
        .position(|event| event.kind == EventKind::Destabilised)
        .expect("a loss of stability");
    let kick = &report.events[lost + 1];
    assert_eq!((kick.kind, kick.time), (EventKind::Kick, report.events[lost].time));
    let jump = kick.after.relative_velocity - kick.before.relative_velocity;
    assert!((jump - 1e-4).abs() < 1e-15, "{jump}");
    let case = built_in("paper", &[AT_INSTABILITY, "friction.decay=0"]);
    let report = self::report(&case, Method::Series);
    assert_eq!((report.kicks_never_given, report.kicks_without_instability), (1, 1));
}

/// Variants of `paper-si` without torsional damping: a ramp, a release with separations, a force that begins late, and
/// speeds at which the slope of friction is zero in doubles.
const UNDAMPED: [&[&str]; 4] = [
    &[
        "axial.damping=0",
        "torsion={rotor_inertia=0.096, surface_inertia=0.102, stiffness=28281.4, damping=0}",
    ],
    &["actuation={profile=\"table\", time=[0, 0.02, 0.03, 0.04, 0.05, 0.06], force=[0, 900, 900, 0, 0, 700]}"],
    &["actuation={profile=\"table\", time=[0, 0.02, 0.0200001], force=[0, 0, 900]}"],
    &["friction.decay=90", "friction.high_speed=0.2"],
];

/// Without damping the margin has the sign of the slope of friction, and vanishes only with the normal force. Sliding
/// is unstable from the first contact on, by every method and by the oracle.
#[test]
fn multiprecision_without_damping_sliding_is_unstable_from_the_first_contact_on() {
    let source = CaseSource::built_in("paper-si").unwrap();
    for (changes, contact) in UNDAMPED.iter().zip([0.0, 0.0, 0.02, 0.0]) {
        let common = [
            "torsion.damping=0",
            "perturbation=[]",
            "output={end_time=0.08, interval=0.01}",
        ];
        let changes = parsed(&[&common, *changes].concat());
        let case = Case::read(&source, &changes).unwrap();
        let of_stability = |kind: &EventKind| matches!(kind, EventKind::Destabilised | EventKind::Restabilised);
        let exact = truth((&source, &changes), &case, 18).unwrap().report.events;
        let mut exact = exact.iter().filter(|event| of_stability(&event.kind));
        let [Some(lost), None] = [exact.next(), exact.next()] else {
            panic!("{changes:?}")
        };
        assert_eq!((lost.kind, lost.time.to_f64()), (EventKind::Destabilised, contact));
        for method in [
            Method::Series,
            Method::Cvode,
            Method::Arkode,
            Method::Erk,
            Method::Esdirk,
            Method::CvodeAdams,
            Method::CvodeBdf,
        ] {
            let report = report(&case, method);
            let found: Vec<&Event> = report.events.iter().filter(|event| of_stability(&event.kind)).collect();
            let [found] = found[..] else {
                panic!("{} by {}: {} changes", changes.len(), method.name(), found.len())
            };
            assert_eq!(found.kind, EventKind::Destabilised);
            // `cvode` skips guards in its first steps.
            assert!(
                (0.0..1e-9).contains(&(found.time - contact)),
                "{} {}",
                method.name(),
                found.time
            );
        }
    }
}

/// The margin of equal surfaces is c_t + 2 r F_n mu', to the bit.
#[test]
fn analytic_the_margin_of_a_lowered_brake() {
    let mut random = Random(7);
    for name in ["paper", "paper-si", "release", "unperturbed"] {
        let case = built_in(name, &[]);
        let system = SystemEquations::new(&case.system);
        let damping = disks(&case).torsion.damping;
        assert_eq!(system.twice_resistance, Some(damping));
        let mut state = vec![0.0; system.dimension];
        let speed = system.rotor.speed.expect("a free train");
        for _ in 0..1000 {
            let (w, force) = (random.within(-3.0, 3.0), random.within(0.0, 4000.0));
            state[speed] = w;
            let outside = Outside {
                normal_force: force,
                ..Outside::default()
            };
            let margin = system.stability_margin(w.signum(), 0, &outside, &state);
            let slope = disks(&case).friction.law.coefficient_and_slope(w.abs()).1;
            let expected = damping + 2.0 * disks(&case).contact.radius * force * slope;
            assert_eq!(margin, expected, "{name} {w} {force}");
        }
    }
}

/// Two unequal surfaces, with bearings, longer chains, and an oscillating force.
const UNEQUAL: &str = r#"
rotor = { inertia = [0.01, 0.03, 2.0], stiffness = [4e6, 3e6], damping = [15.0, 20.0], viscous = [0.5, 0.0, 0.1],
    end = "free" }
stator = { inertia = [0.02, 0.05], stiffness = [7e6, 6e6], damping = [20.0, 30.0], end = "fixed" }
contact = { radius = 0.05, normal_force = { profile = "sine", mean = 2000.0, amplitude = 30.0, frequency = 900.0 } }
friction = { breakaway = 0.6, low_speed = 0.6, high_speed = 0.3, decay = 3.5 }
initial = { speed = 1.5 }
perturbation = [{ time = "instability", relative_velocity = 1e-3 }]
output = { end_time = 0.1 }
"#;

/// Long steps of chains: a slide of 1.1 s, a kick near its end, and every stick after it. By `erk`, which resolves all
/// modes, such a run takes 23,000 steps.
#[test]
fn multiprecision_long_steps_of_chains() {
    let swinging = r#"{ profile = "sine", mean = 2000.0, amplitude = 30.0, frequency = 900.0 }"#;
    let source = source(&UNEQUAL.replace(swinging, "2000.0"));
    let kick = "perturbation=[{time=1.1, relative_velocity=1e-3}]";
    let changes = parsed(&[kick, "initial.speed=20", "output.end_time=1.2"]);
    let case = Case::read(&source, &changes).unwrap();
    let truth = truth((&source, &changes), &case, 20).unwrap();
    let report = completed(&case, Method::Series);
    let sticks = report.events.iter().filter(|event| event.kind == EventKind::Stick);
    assert!(sticks.count() > 10);
    let worst = from_truth("series", &report.events, &truth);
    println!(
        "{} events within {worst:e} s, {} steps",
        report.events.len(),
        steps(&report)
    );
    assert!(worst < 1e-11, "{worst:e}");
    assert!(steps(&report) < 2000, "{} steps", steps(&report));
}

/// The loss of stability of unequal surfaces, the kick that waits for it, and everything after it.
#[test]
fn multiprecision_the_margin_of_unequal_surfaces() {
    let case = written(UNEQUAL, &[]);
    let truth = truth((&source(UNEQUAL), &[]), &case, 20).unwrap();
    assert_eq!(truth.report.events[0].kind, EventKind::Destabilised);
    for (method, within) in METHODS {
        let worst = from_truth(method.name(), &completed(&case, method).events, &truth);
        assert!(worst < within, "{}: {worst:e}", method.name());
    }
}

/// The one-sided tests of unequal surfaces, by solvers that share only the equations and the rules.
#[test]
fn sundials_one_sided_tests_of_unequal_surfaces() {
    let transmitted = completed(&written(UNEQUAL, &[]), Method::Series).events;
    for test in ["rotor", "stator"] {
        // Later the contact chatters with these tests.
        let case = written(
            UNEQUAL,
            &[&format!("contact.breakaway_test={test}"), "output.end_time=0.075"],
        );
        let [series, cvode] = [Method::Series, Method::Cvode].map(|method| completed(&case, method).events);
        assert_eq!(kinds(&series), kinds(&cvode), "{test}");
        let times = series.iter().zip(&cvode);
        let far = times
            .map(|(one, other)| (one.time - other.time).abs())
            .fold(0.0, f64::max);
        assert!(far < 2e-9, "{test}: {far:e}");
        let slip = |events: &[Event]| {
            events
                .iter()
                .find(|event| event.kind == EventKind::Slip)
                .map(|slip| slip.time)
        };
        assert!(slip(&series) != slip(&transmitted), "{test} changes nothing");
    }
}

/// A margin that is zero everywhere has no zeros.
#[test]
fn property_a_margin_that_is_zero_throughout_is_not_watched() {
    let shared = "[friction]\nlaw = \"coulomb\"\nbreakaway = 0.5\nkinetic = 0.4\n[initial]\nspeed = 2\n[output]\nend_time = 0.2\n";
    let trains = r#"
rotor = { inertia = [0.01, 2.0], stiffness = 1000, end = "free" }
stator = { inertia = 0.01, stiffness = 2000, end = "fixed" }
contact = { radius = 0.1, normal_force = 1000 }
"#;
    let short = r#"
torsion = { rotor_inertia = 2.0, surface_inertia = 0.01, stiffness = 1000, damping = 0 }
axial = { mass = 4.5, stiffness = 5.5e7, damping = 8.7e3 }
actuation = { profile = "ramp", force = 1000, rise_time = 0.02 }
contact = { radius = 0.1 }
"#;
    for text in [trains, short] {
        for method in [Method::Series, Method::Arkode, Method::Cvode] {
            let report = completed(&written(&format!("{text}{shared}"), &[]), method);
            let crossings = [EventKind::Destabilised, EventKind::Restabilised];
            assert_eq!(report.digest.cycles.count(&crossings), 0, "{}", method.name());
        }
    }
}
