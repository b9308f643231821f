//! A brake by its short form and as two trains: the same events, the loss of stability among them, by every kind of method.

use crate::common::cases::parsed;
use crate::common::disks;
use crate::common::random_brakes::{Random, difference, random_brake, random_release};
use std::ops::ControlFlow;
use std::time::Duration;
use stickslip::Run;
use stickslip::analysis::{Modes, Summary};
use stickslip::case::{Case, CaseSource, Origin, Override};
use stickslip::friction::Law;
use stickslip::model::Torsion;
use stickslip::model::equations::{Outside, SystemEquations};
use stickslip::model::system::System;
use stickslip::oracle::{self, OracleRequest, rational};
use stickslip::record::{Event, EventKind};
use stickslip::simulation::{Method, RunReport, SolverOptions};

/// A kick where sliding loses its stability.
const AT_INSTABILITY: &str = "perturbation=[{time=\"instability\", relative_velocity=1e-4}]";

/// Built-in brakes and changes of them; the forward and the backward sense, and every breakaway test.
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

/// With the largest error against the oracle (s): it grows from the loss of stability on.
const METHODS: [(Method, f64); 3] = [(Method::Series, 1e-12), (Method::Auto, 1e-11), (Method::Cvode, 1e-8)];

fn steps(report: &RunReport) -> u64 {
    report.work.iter().map(|work| work.steps).sum()
}

fn brake(name: &str, changes: &[Override]) -> Case {
    Case::read(&CaseSource::built_in(name).unwrap(), changes).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn changed(name: &str, changes: &[&str]) -> Case {
    let changes = parsed(changes);
    brake(name, &changes)
}

/// The reports of a run of the case and of the same written as two trains, which are one system; a run that fails is as long as it
/// is.
fn both(case: &Case, method: Method) -> [RunReport; 2] {
    let solver = SolverOptions {
        method,
        ..case.solver.clone()
    };
    let trains = as_trains(case);
    assert_eq!(trains.system, case.system);
    [case, &trains].map(|case| {
        let run = Run::new(case).solver(&solver);
        run.start().unwrap_or_else(|failure| failure.report)
    })
}

fn kinds(events: &[Event]) -> Vec<EventKind> {
    events.iter().map(|event| event.kind).collect()
}

/// The largest distance of the times of two methods, where all kinds are the same.
fn distance(name: &str, [one, other]: [&[Event]; 2]) -> f64 {
    assert_eq!(kinds(one), kinds(other), "{name}");
    let pairs = one.iter().zip(other);
    pairs
        .map(|(one, other)| (one.time - other.time).abs())
        .fold(0.0, f64::max)
}

/// The same steps, and the same events to the last bit.
fn assert_same(label: &str, brake: &RunReport, trains: &RunReport) {
    assert_eq!(steps(brake), steps(trains), "{label}");
    assert_eq!(brake.events, trains.events, "{label}");
}

#[test]
fn analytic_a_brake_as_trains_has_its_events() {
    for (name, changes) in BRAKES {
        let case = changed(name, changes);
        for (method, _) in METHODS {
            let reports = both(&case, method);
            let label = format!("{name} {changes:?} by {}", method.name());
            let [brake, trains] = &reports;
            assert_same(&label, brake, trains);
            assert!(brake.events.len() > 30, "{label}");
            assert_eq!(brake.kicks_never_given, trains.kicks_never_given, "{label}");
            assert_eq!(
                brake.kicks_without_instability, trains.kicks_without_instability,
                "{label}"
            );
            let lost = |report: &RunReport| report.digest.instability.map(|event| event.kind);
            assert_eq!(lost(brake), Some(EventKind::Destabilised), "{label}");
            assert_eq!(lost(trains), lost(brake), "{label}");
        }
    }
}

/// Without a perturbation sliding is smooth up to its stop, and rounding does not grow: one stick, by either form.
#[test]
fn analytic_an_unperturbed_brake_as_trains_stops_once() {
    for (name, changes) in [("unperturbed", &[][..]), ("paper-si", &["perturbation=[]"])] {
        let [brake, trains] = both(&changed(name, changes), Method::Series);
        assert_same(name, &brake, &trains);
        let sticks = trains.events.iter().filter(|event| event.kind == EventKind::Stick);
        assert_eq!(sticks.count(), 1, "{name}");
        assert!(brake.stopped_smoothly && trains.stopped_smoothly, "{name}");
        assert!(steps(&trains) < 300, "{name}: {} steps", steps(&trains));
    }
}

/// Growth, kick and warning of a brake do not depend on its form.
#[test]
fn analytic_a_brake_as_trains_has_its_growth() {
    for (name, changes) in [
        ("paper", &[][..]),
        ("paper", &[AT_INSTABILITY, "initial.speed=-100"]),
        ("paper-si", &["perturbation=[{time=2, relative_velocity=0.5}]"]),
        ("release", &[]),
        ("unperturbed", &["solver.method=auto"]),
    ] {
        let case = changed(name, changes);
        let general = as_trains(&case);
        let [short, long] = [case.clone(), general].map(|case| {
            let report = Run::new(&case).start().unwrap();
            Summary::of_run(&case.system, &report)
        });
        let label = format!("{name} {changes:?}");
        for (what, of) in [
            ("G", (|summary| summary.growth_exponent) as fn(&Summary) -> Option<f64>),
            ("to the onset", |summary| summary.growth_to_onset),
            ("from the kick", |summary| summary.e_folds_gained),
            ("above rounding", |summary| summary.kick_above_noise),
        ] {
            match (of(&short), of(&long)) {
                (Some(short), Some(long)) => assert!((short - long).abs() < 1e-9 * short.abs(), "{label}, {what}"),
                (short, long) => assert_eq!(short, long, "{label}, {what}"),
            }
        }
        assert!(long.growth_exponent.unwrap() > 50.0, "{label}");
        assert_eq!(long.noise_determined, short.noise_determined, "{label}");
        assert!(long.noise_determined || name != "unperturbed", "{label}");
    }
}

/// G does not depend on which of the disks is free. With the rotor halved by a shaft of a hundred times the stiffness it changes by less
/// than the share J/I = 5e-3 with which the rotor takes part in the swing.
#[test]
fn analytic_growth_of_a_turned_brake_and_of_a_longer_one() {
    let case = changed("paper", &["output.end_time=6.98"]);
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
    // Of this one the state at the loss of stability is known by its relative velocity alone.
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

/// What is said of a brake's modes and of its loss of stability does not depend on its form. What its sliding loses its stability to
/// swings at the frequency of the disks: that the rotor slows down faster under falling friction is no instability.
#[test]
fn analytic_a_brake_as_trains_has_its_modes() {
    let case = changed("paper", &[]);
    let modes = [case.clone(), as_trains(&case)].map(|case| {
        let case = &case;
        Modes::of_case(&case.system, &case.solver, case.output.end_time)
    });
    let [short, long] = &modes;
    assert_eq!(short.general, long.general);
    let [short, long] = modes
        .each_ref()
        .map(|modes| modes.slowing.as_ref().expect("it slows down"));
    assert_eq!(short.critical_speed, long.critical_speed);
    assert_eq!(short.effective_damping, long.effective_damping);
    let [one, other] = [short, long].map(|slowing| slowing.instability.expect("it loses its stability"));
    assert!((one.growth_exponent - other.growth_exponent).abs() < 1e-9 * one.growth_exponent);
    let crossing = one.eigenvalue_crossing.expect("a crossing");
    for modes in &modes {
        let [change] = modes.general.critical_relative_velocities.changes[..] else {
            panic!("{:?}", modes.general.critical_relative_velocities)
        };
        // The force is the largest here, and still rings by 1e-9 of it there.
        assert!((change.value - crossing.relative_velocity).abs() < 1e-6);
        let frequency = change.frequency.expect("a swing");
        assert!((frequency * short.natural_period - 1.0).abs() < 0.01, "{frequency}");
    }
}

/// The procedure of the paper steps the same disks by either form.
#[test]
fn analytic_a_brake_as_trains_by_the_procedure_of_the_paper() {
    let case = changed("paper", &["solver.method=paper", "output.end_time=6.98"]);
    let report = |case: &Case| Run::new(case).start().unwrap();
    let (brake, trains) = (case.clone(), as_trains(&case));
    assert_eq!(report(&brake).events, report(&trains).events);
}

/// A brake written as `[rotor]` and `[stator]`.
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

/// A kick that waits comes at the loss of stability, and one that waits in vain is counted.
#[test]
fn analytic_a_kick_waits_for_the_instability() {
    let case = changed("paper", &[AT_INSTABILITY]);
    let [_, trains] = both(&case, Method::Series);
    let lost = trains
        .events
        .iter()
        .position(|event| event.kind == EventKind::Destabilised)
        .expect("a loss of stability");
    let kick = &trains.events[lost + 1];
    assert_eq!((kick.kind, kick.time), (EventKind::Kick, trains.events[lost].time));
    let jump = kick.after.relative_velocity - kick.before.relative_velocity;
    assert!((jump - 1e-4).abs() < 1e-15, "{jump}");
    let case = changed("paper", &[AT_INSTABILITY, "friction.decay=0"]);
    for report in both(&case, Method::Series) {
        assert_eq!((report.kicks_never_given, report.kicks_without_instability), (1, 1));
    }
}

#[test]
fn property_random_brakes_as_trains_have_their_events() {
    // Every fifth has no kick, and its stick-slip is rounding.
    let ramps = (0..12)
        .filter(|index| index % 5 != 4)
        .map(|index| ("paper-si", random_brake(index)));
    let releases = (0..8).map(|index| ("release", random_release(index)));
    for (name, changes) in ramps.chain(releases) {
        let case = brake(name, &changes);
        let [brake, trains] = both(&case, Method::Series);
        let label = format!("{name} {changes:?}");
        assert_same(&label, &brake, &trains);
    }
}

/// The margin of equal surfaces is c_t + 2 r F_n mu', to the bit.
#[test]
fn analytic_the_margin_of_a_lowered_brake() {
    let mut random = Random(7);
    for name in ["paper", "paper-si", "release", "unperturbed"] {
        let case = changed(name, &[]);
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

/// Two surfaces that are not equal, with bearings, longer chains, and a force that swings.
const UNEQUAL: &str = r#"
[rotor]
inertia = [0.01, 0.03, 2.0]
stiffness = [4e6, 3e6]
damping = [15.0, 20.0]
viscous = [0.5, 0.0, 0.1]
end = "free"

[stator]
inertia = [0.02, 0.05]
stiffness = [7e6, 6e6]
damping = [20.0, 30.0]
end = "fixed"

[contact]
radius = 0.05
normal_force = { profile = "sine", mean = 2000.0, amplitude = 30.0, frequency = 900.0 }

[friction]
breakaway = 0.6
low_speed = 0.6
high_speed = 0.3
decay = 3.5

[initial]
speed = 1.5

[[perturbation]]
time = "instability"
relative_velocity = 1e-3

[output]
end_time = 0.1
"#;

fn unequal() -> CaseSource {
    CaseSource {
        text: UNEQUAL.to_owned(),
        origin: Origin::File("unequal.toml".into()),
    }
}

/// Long steps of chains: a slide of 1.1 s, a kick near its end, and every stick after it. By `erk`, which resolves all modes, such a
/// run takes 23,000 steps.
#[test]
fn multiprecision_long_steps_of_chains() {
    let swinging = r#"{ profile = "sine", mean = 2000.0, amplitude = 30.0, frequency = 900.0 }"#;
    let source = CaseSource {
        text: UNEQUAL.replace(swinging, "2000.0"),
        origin: Origin::File("chains.toml".into()),
    };
    let changes = [
        "perturbation=[{time=1.1, relative_velocity=1e-3}]",
        "initial.speed=20",
        "output.end_time=1.2",
    ];
    let changes = parsed(&changes);
    let case = Case::read(&source, &changes).unwrap();
    let request = OracleRequest {
        digits: 20,
        end_time: rational("1.2").unwrap(),
        longest: Duration::from_secs(120),
        ..OracleRequest::default()
    };
    let exact = Case::exact(&source, &changes).unwrap().system;
    let truth = oracle::solve(&exact, &request, &mut |_| ControlFlow::Continue(())).unwrap();
    let exact = &truth.report.events;
    let solver = SolverOptions {
        method: Method::Series,
        ..case.solver.clone()
    };
    let run = Run::of_system(&case.system, 0.0, &solver, &case.output);
    let report = run.start().unwrap();
    let expected: Vec<EventKind> = exact.iter().map(|event| event.kind).collect();
    assert_eq!(kinds(&report.events), expected);
    assert!(expected.iter().filter(|kind| **kind == EventKind::Stick).count() > 10);
    let pairs = report.events.iter().zip(exact);
    let errors = pairs.map(|(own, exact)| difference(own.time, &exact.time).abs());
    let worst = errors.fold(0.0, f64::max);
    println!("{} events within {worst:e} s, {} steps", expected.len(), steps(&report));
    assert!(worst < 1e-11, "{worst:e}");
    assert!(steps(&report) < 2000, "{} steps", steps(&report));
}

/// The loss of stability of unequal surfaces, the kick that waits for it, and all that follows.
#[test]
fn multiprecision_the_margin_of_unequal_surfaces() {
    let case = Case::read(&unequal(), &[]).unwrap();
    let request = OracleRequest {
        digits: 20,
        end_time: rational("0.1").unwrap(),
        longest: Duration::from_secs(120),
        ..OracleRequest::default()
    };
    let exact = Case::exact(&unequal(), &[]).unwrap().system;
    let truth = oracle::solve(&exact, &request, &mut |_| ControlFlow::Continue(())).unwrap();
    let exact = &truth.report.events;
    assert_eq!(exact[0].kind, EventKind::Destabilised);
    for (method, within) in METHODS {
        let events = by(&case, method);
        let expected: Vec<EventKind> = exact.iter().map(|event| event.kind).collect();
        assert_eq!(kinds(&events), expected, "{}", method.name());
        let pairs = events.iter().zip(exact);
        let errors = pairs.map(|(own, exact)| difference(own.time, &exact.time).abs());
        let worst = errors.fold(0.0, f64::max);
        assert!(worst < within, "{}: {worst:e}", method.name());
    }
}

fn by(case: &Case, method: Method) -> Vec<Event> {
    let solver = SolverOptions {
        method,
        ..case.solver.clone()
    };
    let report = Run::of_system(&case.system, 0.0, &solver, &case.output).start();
    report
        .unwrap_or_else(|failure| panic!("{}: {failure}", method.name()))
        .events
}

/// The one-sided tests of unequal surfaces, by solvers that share nothing but the equations and the rules.
#[test]
fn sundials_one_sided_tests_of_unequal_surfaces() {
    let transmitted = by(&Case::read(&unequal(), &[]).unwrap(), Method::Series);
    for test in ["rotor", "stator"] {
        // Later the tests chatter.
        let changes = [
            format!("contact.breakaway_test={test}"),
            "output.end_time=0.075".to_owned(),
        ];
        let changes = parsed(&changes);
        let case = Case::read(&unequal(), &changes).unwrap();
        let series = by(&case, Method::Series);
        let far = distance(test, [&series, &by(&case, Method::Cvode)]);
        assert!(far < 2e-9, "{test}: {far:e}");
        let first = |events: &[Event]| {
            events
                .iter()
                .find(|event| event.kind == EventKind::Slip)
                .map(|slip| slip.time)
        };
        assert!(first(&series) != first(&transmitted), "{test} changes nothing");
    }
}

/// A margin that is zero throughout has no zeros: neither form has events of it.
#[test]
fn property_a_margin_that_is_zero_throughout_is_not_watched() {
    let shared = r#"
[contact]
radius = 0.1
normal_force = 1000
[friction]
law = "coulomb"
breakaway = 0.5
kinetic = 0.4
[initial]
speed = 2
[output]
end_time = 0.2
"#;
    let trains = format!(
        "[rotor]\ninertia = [0.01, 2.0]\nstiffness = 1000\nend = \"free\"\n[stator]\ninertia = 0.01\nstiffness = 2000\nend = \"fixed\"\n{shared}"
    );
    let axial = "[axial]\nmass = 4.5\nstiffness = 5.5e7\ndamping = 8.7e3\n[actuation]\nprofile = \"ramp\"\nforce = 1000\nrise_time = 0.02\n";
    let short = format!(
        "[torsion]\nrotor_inertia = 2.0\nsurface_inertia = 0.01\nstiffness = 1000\ndamping = 0\n{axial}{}",
        shared.replace("normal_force = 1000\n", "")
    );
    for text in [trains, short] {
        for method in ["series", "auto", "cvode"] {
            let changes = [Override::parse(&format!("solver.method={method}")).unwrap()];
            let case = Case::read(&CaseSource::text(&text), &changes).unwrap();
            let report = Run::new(&case).start().unwrap();
            assert_eq!(
                report
                    .digest
                    .cycles
                    .count(&[EventKind::Destabilised, EventKind::Restabilised]),
                0,
                "{method}"
            );
        }
    }
}
