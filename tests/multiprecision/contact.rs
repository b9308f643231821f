//! Separations, contacts and the order of events at one instant against the oracle.

use crate::common::cases::{errors, exact_events, kinds, parsed, recorded};
use stickslip::case::{Case, CaseSource};
use stickslip::oracle::OracleEvent;
use stickslip::record::{Event, EventKind};

fn both(settings: &[String]) -> (Vec<Event>, Vec<OracleEvent>) {
    let overrides = parsed(settings);
    let source = CaseSource::built_in("paper-si").unwrap();
    let case = Case::read(&source, &overrides).unwrap_or_else(|error| panic!("{error}"));
    let recorder = recorded(&case);
    let exact = exact_events(&source, &overrides, case.output.end_time, 33);
    (recorder.events, exact)
}

/// A brake that grips, releases to zero, and grips again after a rest of `rest` (s).
fn released(rest: f64, end: f64, more: &[&str]) -> Vec<String> {
    let (open, grip) = (0.06, format!("{:.5}", 0.06 + rest));
    let last = format!("{:.5}", 0.06 + rest + 0.01);
    let mut settings = vec![
        "initial.speed=8".to_owned(),
        format!(
            "actuation={{profile=\"table\", time=[0.0, 0.03, 0.05, {open}, {grip}, {last}], force=[0.0, 2000, 2000, 0.0, \
             0.0, 1500]}}"
        ),
        "perturbation=[]".to_owned(),
        "output.window=[]".to_owned(),
        "output.around=none".to_owned(),
        format!("output.end_time={end}"),
    ];
    settings.extend(more.iter().map(|text| (*text).to_owned()));
    settings
}

/// The same events in the same order; separations and contacts agree to a unit of the double that holds their time.
fn check(name: &str, settings: &[String]) -> Vec<EventKind> {
    use EventKind::{Contact, Corner, Separation};
    let (events, exact) = both(settings);
    for (event, error) in events.iter().zip(errors(name, &events, &exact)) {
        // A unit in the last place; in a separation also the rounding of F and its slope, of 2000 N and 2e5 N/s here.
        let allowed = f64::EPSILON * event.time + 1e-17;
        let by_force = matches!(event.kind, Separation | Contact | Corner);
        assert!(!by_force || error <= allowed, "{name}: {event:?} is off by {error:e} s");
    }
    kinds(&events)
}

/// After a rest the pressing force grows from the remaining ringing with the square of the time, so that a rounding of
/// 1e-13 N in it is 3e-11 s in the time of contact. No part of the ringing is lost, however short or long the rest: it
/// decays by 6 to 700 e-folds, and at 1.2 s is below the range of doubles.
#[test]
fn multiprecision_contact_after_a_rest_is_exact() {
    for rest in [0.006, 0.0127, 0.0181, 0.0269, 0.0432, 0.0711, 0.31, 1.2] {
        let kinds = check(&format!("rest {rest}"), &released(rest, 0.075 + rest, &[]));
        let count = |kind: EventKind| kinds.iter().filter(|other| **other == kind).count();
        assert!(count(EventKind::Contact) >= 1 && count(EventKind::Contact) == count(EventKind::Separation));
    }
}

/// Other regimes of the axial mode, and other floors. Without damping, or with very little, the ringing never falls
/// below the floor; above critical damping there is no ringing.
#[test]
fn multiprecision_contact_in_every_regime_of_the_axial_mode() {
    for rest in [0.0113, 0.0417, 0.2] {
        for setting in [
            "axial.damping=0",
            "axial.damping=40",
            "axial.damping=31713.1921",
            "axial.damping=60000",
            "axial.damping=900000",
            "axial.ringing_floor=1e-13",
            "axial.ringing_floor=0.3 um",
        ] {
            check(
                &format!("rest {rest}, {setting}"),
                &released(rest, 0.075 + rest, &[setting]),
            );
        }
    }
}

/// A higher floor omits touches, and changes no other event.
#[test]
fn property_the_floor_only_leaves_out_touches() {
    let contacts = |floor: &str| {
        let (events, _) = both(&released(0.05, 0.13, &[&format!("axial.ringing_floor={floor}")]));
        let of = |event: &&Event| event.kind == EventKind::Contact;
        events.iter().filter(of).map(|event| event.time).collect::<Vec<f64>>()
    };
    let (coarse, fine) = (contacts("10 nm"), contacts("1e-14"));
    assert!(coarse.len() < fine.len(), "{coarse:?}, {fine:?}");
    // The first touches and the grip after the rest are the same to the last bit.
    assert_eq!(coarse.last(), fine.last());
    assert_eq!(coarse[..coarse.len() - 1], fine[..coarse.len() - 1]);
}

/// Disks that never touched, and disks that are pulled apart after a rest.
#[test]
fn multiprecision_disks_at_rest_touch_when_they_are_pressed() {
    let table = |time: &str, force: &str, end: f64| {
        vec![
            "initial.speed=5".to_owned(),
            format!("actuation={{profile=\"table\", time={time}, force={force}}}"),
            "perturbation=[]".to_owned(),
            "output.window=[]".to_owned(),
            "output.around=none".to_owned(),
            format!("output.end_time={end}"),
        ]
    };
    check("late", &table("[0.0, 0.01, 0.02]", "[0.0, 0.0, 1500]", 0.05));
    let apart = check("never", &table("[0.0, 0.01, 0.02]", "[0.0, 0.0, -1500]", 0.05));
    assert!(!apart.contains(&EventKind::Contact));
    check(
        "pulled",
        &table("[0.0, 0.01, 0.02, 0.03]", "[-100, -500, 0.0, 900]", 0.06),
    );
    check(
        "pulled after a rest",
        &table(
            "[0.0, 0.01, 0.02, 0.05, 0.06, 0.07]",
            "[0.0, 1500, 0.0, 0.0, -800, 700]",
            0.1,
        ),
    );
}

/// At one instant the corner comes first, then the contact that belongs to it, then kicks in the order of the case.
/// Kicks that reverse the slip make this order visible in the sequence of events.
#[test]
fn multiprecision_events_of_one_instant_have_one_order() {
    for rest in [0.0127, 0.31, 0.3104, 1.2] {
        let corner = format!("{:.5}", 0.06 + rest);
        for times in [
            [corner.as_str(), "0.03"],
            [corner.as_str(), corner.as_str()],
            ["0.06", "0.05"],
        ] {
            let kicks = format!(
                "perturbation=[{{time={}, relative_velocity=-30}}, {{time={}, relative_velocity=1e-3}}]",
                times[0], times[1]
            );
            check(
                &format!("rest {rest}, kicks {times:?}"),
                &released(rest, 0.075 + rest, &[&kicks]),
            );
        }
    }
    // At t = 0, under a step, and at the end of the ramp.
    for (rise, time) in [("0", "0"), ("0.02", "0.02"), ("20 ms", "0.02"), ("0.02", "0")] {
        let settings = [
            "initial.speed=5".to_owned(),
            format!("actuation.rise_time={rise}"),
            format!("perturbation=[{{time={time}, relative_velocity=-9}}, {{time={time}, relative_velocity=2}}]"),
            "output.window=[]".to_owned(),
            "output.around=none".to_owned(),
            "output.end_time=0.06".to_owned(),
        ];
        check(&format!("rise {rise}, kicks at {time}"), &settings);
    }
}
