//! Forces that fall to zero at a corner, just before or after it, or only touch zero, against the oracle.
//!
//! `STICKSLIP_CORNERS=0..400 cargo test --release --test multiprecision corners_long -- --ignored --nocapture` takes more
//! brakes and blocks than the default.

use crate::common::campaign::corners;
use crate::common::campaign::hold_drawn;
use crate::common::cases::{difference, parsed, recorded, source, truth};
use crate::common::random_brakes::Random;
use std::fmt::Write as _;
use std::ops::Range;
use stickslip::case::{Case, CaseSource};
use stickslip::record::EventKind;
use stickslip::simulation::Method;

fn range(default: Range<u64>) -> Range<u64> {
    let text = std::env::var("STICKSLIP_CORNERS").ok();
    let ends = text.as_deref().and_then(|text| text.split_once(".."));
    let ends = ends.and_then(|(from, to)| Some(from.parse().ok()?..to.parse().ok()?));
    ends.unwrap_or(default)
}

/// Compares the events of a case by these methods with the oracle's: all kinds except corners in their order,
/// separations and contacts to the last place of a time, other events within `allowed` (s). Returns the differences.
fn differs(source: &CaseSource, settings: &[String], methods: &[Method], allowed: f64) -> Vec<String> {
    let changes = parsed(settings);
    let mut case = Case::read(source, &changes).unwrap_or_else(|error| panic!("{error}\n{}", source.text));
    case.output.follow.around = None;
    let exact = match truth((source, &changes), &case, 25) {
        Ok(solution) => solution
            .report
            .events
            .into_iter()
            .filter(|event| event.kind != EventKind::Corner),
        Err(error) => return vec![format!("no oracle: {error}")],
    };
    let exact: Vec<_> = exact.collect();
    let mut found = Vec::new();
    for &method in methods {
        case.solver.method = method;
        let events = recorded(&case).events;
        // Where a change of the contact has the time of a corner in doubles, the corner may come before it.
        let events: Vec<_> = events.iter().filter(|event| event.kind != EventKind::Corner).collect();
        let kinds: Vec<&str> = events.iter().map(|event| event.kind.name()).collect();
        let expected: Vec<&str> = exact.iter().map(|event| event.kind.name()).collect();
        if kinds != expected {
            let at = kinds.iter().zip(&expected).take_while(|(a, b)| a == b).count();
            let own = events.get(at).map(|event| (event.kind.name(), event.time));
            let other = exact
                .get(at)
                .map(|event| (event.kind.name(), event.time.to_decimal(20)));
            found.push(format!("{}: {own:?} for {other:?}, number {at}", method.name()));
            continue;
        }
        for (event, exact) in events.iter().zip(&exact) {
            let error = difference(event.time, &exact.time).abs();
            let by_force = matches!(event.kind, EventKind::Separation | EventKind::Contact);
            let allowed = if by_force {
                2.0 * f64::EPSILON * event.time + 1e-17
            } else {
                allowed
            };
            if error > allowed {
                let name = event.kind.name();
                found.push(format!(
                    "{}: {name} at {} is off by {error:e} s",
                    method.name(),
                    event.time
                ));
            }
        }
    }
    found
}

/// A brake whose force falls to `end` (N) at 0.31578 s. It has stopped ringing 0.2 s before.
fn released(end: &str, then: &str, more: &[&str]) -> Vec<String> {
    let actuation = format!(
        "actuation={{profile=\"table\", time=[0, 0.0059, 0.05892, 0.31578{}], force=[0, 5359.15, 5359.15, {end}{}]}}",
        then.split('|').next().unwrap_or_default(),
        then.split('|').nth(1).unwrap_or_default()
    );
    let mut settings: Vec<String> = [
        "torsion.surface_inertia=0.010577",
        "torsion.stiffness=12058709.4",
        "torsion.damping=5.023",
        "friction.breakaway=0.4643",
        "friction.low_speed=0.2973",
        "friction.high_speed=0.2058",
        "friction.decay=39.4538",
        "initial.speed=16.521",
        "perturbation=[]",
        "output.end_time=0.33",
        "output.window=[]",
    ]
    .map(str::to_owned)
    .to_vec();
    settings.push(actuation);
    settings.extend(more.iter().map(|text| (*text).to_owned()));
    settings
}

const METHODS: [Method; 4] = [Method::Series, Method::Cvode, Method::Arkode, Method::Esdirk];

/// Zero at the corner, or a force on either side of zero that is below the rounding of the applied force, with kicks
/// and steps there.
#[test]
fn multiprecision_a_release_to_zero_opens_the_contact_once() {
    let brake = CaseSource::built_in("paper-si").unwrap();
    let kick = "perturbation=[{kind=\"kick\", time=0.31578, relative_velocity=-30}]";
    let mut faults = Vec::new();
    for (end, then, more) in [
        ("0", "|", &[][..]),
        ("0", ", 0.41807, 0.42807|, 0, 3972.18", &[]),
        ("0", "|", &[kick]),
        ("1e-13", "|", &["output.end_time=0.317"]),
        ("-1e-13", "|", &[]),
        ("-1e-13", "|", &[kick]),
        ("1e-3", ", 0.3157800001|, 0", &[]),
        ("0", ", 0.3157800001|, 0.001", &["output.end_time=0.3165"]),
        ("0", ", 0.31578000000001|, 100", &["output.end_time=0.3165"]),
        // A touch, and steps from zero and to zero.
        ("0", ", 0.32|, 900", &[]),
        ("0", ", 0.31578|, 900", &[]),
        ("100", ", 0.31578|, 0", &[]),
        ("0", ", 0.31578|, -900", &[]),
        ("0", ", 0.31578|, -900", &[kick]),
    ] {
        let settings = released(end, then, more);
        let found = differs(&brake, &settings, &METHODS, 1e-9);
        faults.extend(found.iter().map(|fault| format!("{end}, {then}, {more:?}: {fault}")));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// A table of a force with few digits, which stays at zero, touches it, or steps to it and from it.
fn table(random: &mut Random, count: usize) -> String {
    let (mut times, mut values) = (String::new(), String::new());
    let mut time = 0.0;
    for _ in 0..count {
        let value = match (random.next() * 6.0) as usize {
            0..=2 => "0".to_owned(),
            3 => format!("{:.1}", random.within(-1.0, 1.0)),
            _ => format!("{:.1}", random.within(0.0, 3.0)),
        };
        let _ = write!(times, "{time:.3}, ");
        let _ = write!(values, "{value}, ");
        time += match (random.next() * 4.0) as usize {
            // A step, if the last two times differ.
            0 if !times.ends_with(&format!("{time:.3}, {time:.3}, ")) => 0.0,
            1 => 0.001,
            _ => random.within(0.1, 0.6),
        };
    }
    format!("{{ profile = \"table\", time = [{times}], value = [{values}] }}")
}

/// A block on a moving belt, or a mass that slides to its stop, under a given force that is sometimes zero.
fn block(index: u64) -> String {
    let random = &mut Random(0x0c0f_fee0 + 7919 * index);
    let count = 4 + (random.next() * 6.0) as usize;
    let own = table(random, count);
    let force = match index % 3 {
        // Decimals whose sum is zero, although the sum of their doubles is not.
        0 => format!(
            "{{ profile = \"sum\", signals = [0.1, 0.2, -0.3, {own}, {{ profile = \"ramp\", value = -0.1, rise_time = 0.7 }}, {{ \
             profile = \"ramp\", value = 0.1, rise_time = 0.7 }}] }}"
        ),
        _ => own,
    };
    let end = format!("{:.2}", 0.35 * count as f64 + 0.5);
    let kick = match (random.next() * 3.0) as usize {
        0 => format!(
            "[[perturbation]]\ntime = {:.2}\nrelative_velocity = -0.7\n",
            random.within(0.2, 1.5)
        ),
        _ => String::new(),
    };
    let parts = match index % 2 {
        0 => {
            "rotor = { end = \"driven\", speed = 0.5 }\nstator = { end = \"fixed\", inertia = 1.0, stiffness = 30.0, damping = 0.2 }\n"
        }
        _ => "rotor = { end = \"free\", inertia = 1.0 }\nstator = { end = \"fixed\" }\ninitial = { speed = 1.5 }\n",
    };
    format!(
        "title = \"block {index}\"\nmotion = \"translation\"\n{parts}contact = {{ normal_force = {force} }}\nfriction = {{ law = \
         \"coulomb\", breakaway = 0.5, kinetic = 0.4 }}\noutput = {{ end_time = {end}, interval = 0.1 }}\n{kick}"
    )
}

fn blocks(indices: Range<u64>) {
    let mut faults = Vec::new();
    for index in indices {
        let source = source(&block(index));
        let found = differs(&source, &[], &METHODS, 1e-9);
        faults.extend(
            found
                .iter()
                .map(|fault| format!("block {index}: {fault}\n{}", source.text)),
        );
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn multiprecision_given_forces_that_are_zero_at_corners() {
    blocks(0..12);
}

#[test]
#[ignore = "minutes; CI runs it"]
fn multiprecision_corners_long_given_forces_that_are_zero_at_corners() {
    blocks(range(0..200));
}

/// A force that touches zero at a corner and steps up there. Ringing below rounding separates the surfaces for 3.4e-18
/// s, less than the spacing of doubles: neither methods nor certificate count it.
#[test]
fn multiprecision_a_separation_below_the_spacing_of_doubles_is_a_touch() {
    let outcome = hold_drawn(32, &corners::draw(32));
    assert_eq!((outcome.reason, outcome.faults), (None, Vec::new()));
    assert!(outcome.held.len() > 4);
}

/// Certificates of brakes that release at a corner where the force is zero or almost zero: no event is farther from
/// the oracle than certified, and none is missing.
#[test]
#[ignore = "minutes; CI runs it"]
fn multiprecision_corners_long_certificates_of_releases_hold() {
    let outcomes: Vec<_> = range(0..40)
        .map(|index| hold_drawn(index, &corners::draw(index)))
        .collect();
    let held = outcomes.iter().map(|outcome| outcome.held.len()).sum::<usize>();
    let faults = outcomes.iter().flat_map(|outcome| {
        let failed = outcome.reason.iter().cloned();
        let faults = failed.chain(outcome.faults.iter().cloned());
        faults.map(|fault| {
            format!(
                "brake {} ({}): {fault}\n{}",
                outcome.index,
                outcome.family.name(),
                outcome.command
            )
        })
    });
    let faults: Vec<String> = faults.collect();
    println!("{held} converged events of {} brakes", outcomes.len());
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(held > 10 * outcomes.len(), "{held}");
}
