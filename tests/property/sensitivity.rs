//! Effect of half a unit in the last digit of a parameter on the final stick: by slopes and by reruns.

use crate::common::cases::{built_in, near, recorded};
use std::sync::atomic::{AtomicUsize, Ordering};
use stickslip::Watch;
use stickslip::analysis::linearised::linearise;
use stickslip::analysis::sensitivity::{
    Affected, CaseSensitivities, RerunOutcome, Sensitivities, Sensitivity, sensitivities as of_case,
};
use stickslip::case::{Case, WrittenCase};
use stickslip::model::Parameters;
use stickslip::record::Event;

fn case(settings: &[&str]) -> Case {
    built_in("paper-si", settings)
}

/// A short slide from a low speed with a kick at the loss of stability: it sticks and slips within 0.25 s.
const QUICK: [&str; 4] = [
    "initial.speed=3",
    "actuation={profile=\"ramp\", force=2225, rise_time=0.02}",
    "perturbation=[{time=\"instability\", relative_velocity=1e-4}]",
    "output={end_time=0.4, interval=0.01}",
];

fn written(case: &Case, halves: &[(&str, f64)]) -> WrittenCase {
    let plain = WrittenCase::of(case);
    let with = |written: WrittenCase, half: &(&str, f64)| written.with_half_last_digit(half.0, half.1);
    halves.iter().fold(plain, with)
}

fn events(case: &Case) -> Vec<Event> {
    let recorder = recorded(case);
    recorder.events
}

fn found(case: &WrittenCase, events: &[Event], stop: &dyn Watch) -> Result<CaseSensitivities, String> {
    of_case(case, None, events, events.len(), stop)
}

fn sensitivities(case: &Case, halves: &[(&str, f64)]) -> Option<Sensitivities> {
    let found = found(&written(case, halves), &events(case), &|| false).unwrap();
    found.result.filter(|result| result.of == Affected::FinalStick)
}

fn row<'a>(found: &'a Sensitivities, path: &str) -> &'a Sensitivity {
    found.rows.iter().find(|row| row.parameter.path == path).unwrap()
}

/// For constant friction, F_n integrates to the work of the ramp, and the momentum falls. At the stop, when the
/// vibration from the ramp has decayed by e^-800, (I + J) omega_0 = mu r F (t - t_0/2). The stop is therefore at
/// t = (I + J) omega_0/(mu r F) + t_0/2 exactly.
#[test]
fn analytic_shifts_of_the_stop_under_constant_friction() {
    let case = case(&[
        "friction={breakaway=0.6, low_speed=0.6, high_speed=0.6, decay=0}",
        "perturbation=[]",
        "initial.speed=6",
        "actuation={profile=\"ramp\", force=2225, rise_time=0.1}",
        "output={end_time=1, interval=0.1}",
    ]);
    let stop = |path: &str, value: f64| {
        let case = WrittenCase::of(&case).with(path, value).unwrap();
        let p = &Parameters::of(&case.system).unwrap();
        let inertia = p.torsion.rotor_inertia + p.torsion.surface_inertia;
        let force = case.number("actuation.force").unwrap();
        let torque = 0.6 * p.contact.radius * force;
        inertia * p.initial.speed / torque + 0.5 * case.number("actuation.rise_time").unwrap()
    };
    let halves = [
        ("initial.speed", 0.5),
        ("actuation.force", 50.0),
        ("torsion.rotor_inertia", 0.05),
        ("contact.radius", 0.005),
        ("actuation.rise_time", 0.005),
    ];
    let found = sensitivities(&case, &halves).unwrap();
    assert_eq!(found.without_reruns, None);
    let at = |path: &str| case.number(path).unwrap();
    // The rounding is that of a sum of about 1e3 steps up to the stop.
    near(found.time, stop("initial.speed", 6.0), 1e-12);
    for (path, half) in halves {
        let row = row(&found, path);
        let mut bent = 0.0_f64;
        for (rerun, value) in row
            .reruns
            .as_ref()
            .unwrap()
            .iter()
            .zip([at(path) - half, at(path) + half])
        {
            let exact = stop(path, value) - stop(path, at(path));
            let shift = rerun.shift.unwrap();
            let got = (rerun.value, rerun.outcome, rerun.sticks);
            assert_eq!(got, (value, RerunOutcome::SameEvents, Some(1)));
            assert!((shift - exact).abs() < 1e-12, "{path} {value}: {shift:e} {exact:e}");
            let predicted = row.slope.unwrap() * (value - at(path));
            bent = bent.max((shift - predicted).abs() / shift.abs().max(predicted.abs()));
        }
        // (I + J) omega_0/(mu r F) is linear in speed and inertia, and bent by h/p in force and radius.
        let expected = bent > 0.1;
        assert_eq!(row.nonlinear(), Some(expected), "{path}: {bent}");
        assert!(!expected, "{path}: {bent}");
    }
    // A bend of 0.1 is reached near h/p = 0.1/0.9 on the lower side.
    let coarse = sensitivities(&case, &[("actuation.force", 300.0)]).unwrap();
    assert_eq!(row(&coarse, "actuation.force").nonlinear(), Some(true));
    assert_eq!(row(&coarse, "contact.radius").reruns, None);
}

/// For a small enough change, the rerun agrees with the slope, up to its own error and a curvature of second order.
#[test]
fn property_small_changes_move_the_final_stick_as_the_slope_says() {
    let case = case(&QUICK);
    let paths = [
        "torsion.stiffness",
        "torsion.damping",
        "torsion.surface_inertia",
        "friction.decay",
        "friction.high_speed",
        "initial.speed",
        "perturbation.0.relative_velocity",
    ];
    let values = paths.iter().map(|path| (*path, 1e-6 * case.number(path).unwrap()));
    let halves: Vec<(&str, f64)> = values.collect();
    let found = sensitivities(&case, &halves).unwrap();
    for (path, half) in halves {
        let row = row(&found, path);
        let slope = row.slope.unwrap();
        let [below, above] = row.reruns.as_ref().unwrap();
        let (below, above) = (below.shift.unwrap(), above.shift.unwrap());
        let difference = (above - below) / (2.0 * half);
        // Central difference: 1e-13 s of the runs, and curvatures over a relative 1e-6.
        let error = 1e-13 / half + 1e-5 * slope.abs();
        assert!((difference - slope).abs() < error, "{path}: {difference:e} {slope:e}");
        assert_eq!(row.nonlinear(), Some(false), "{path}");
    }
}

/// With mu_0 = mu_s the take-off is tangential. A higher breakaway delays every slip; a lower one is invalid.
#[test]
fn property_a_tangential_take_off_is_one_sided() {
    let case = case(&QUICK);
    let found = sensitivities(&case, &[("friction.breakaway", 1e-3), ("friction.low_speed", 1e-3)]).unwrap();
    let breakaway = row(&found, "friction.breakaway");
    assert!(breakaway.predicted().unwrap().abs() < 1e-12);
    let [below, above] = breakaway.reruns.as_ref().unwrap();
    let got = (below.outcome, below.shift, below.sticks);
    assert_eq!(got, (RerunOutcome::Invalid, None, None));
    assert_eq!(below.remark, "friction.breakaway: must be at least friction.low_speed");
    assert!(above.shift.unwrap().abs() > 1e-7, "{above:?}");
    assert_eq!(breakaway.nonlinear(), Some(true));
    let [below, above] = row(&found, "friction.low_speed").reruns.as_ref().unwrap();
    assert_ne!(below.outcome, RerunOutcome::Invalid);
    assert_eq!(above.outcome, RerunOutcome::Invalid);
}

/// Parameters so coarse that they decide which events occur: each kind of difference in a rerun, in words.
#[test]
fn property_reruns_with_other_events_say_so() {
    let case = case(&QUICK);
    let found = sensitivities(
        &case,
        &[
            ("initial.speed", 2.0),
            ("actuation.force", 2224.0),
            ("perturbation.0.relative_velocity", 9.9e-5),
            ("friction.decay", 3.4),
        ],
    )
    .unwrap();
    let sticks = |path: &str, side: usize| {
        let rerun = &row(&found, path).reruns.as_ref().unwrap()[side];
        (rerun.outcome, rerun.remark.clone())
    };
    // With hardly any force, the brake slides to the end.
    let (outcome, remark) = sticks("actuation.force", 0);
    assert_eq!(outcome, RerunOutcome::NoFinalStick);
    assert!(
        remark.starts_with("no final stick: the run ends sliding, 0 sticks instead of "),
        "{remark}"
    );
    // A kick of a hundredth of the size reaches the sliding speed later.
    let (outcome, remark) = sticks("perturbation.0.relative_velocity", 0);
    assert_eq!(outcome, RerunOutcome::OtherEvents);
    assert!(remark.contains(" sticks instead of "), "{remark}");
    // Friction hardly falls with speed.
    let (_, remark) = sticks("friction.decay", 0);
    assert!(remark.starts_with("1 stick instead of "), "{remark}");
    for row in found.rows.iter().filter(|row| row.reruns.is_some()) {
        // The force is complete before the window. More speed takes more time at constant friction; the kick moves
        // too.
        let linear = row.parameter.path == "initial.speed";
        assert_eq!(row.nonlinear(), Some(!linear), "{row:?}");
    }
    assert!(
        found.held.contains("goes along with the loss of stability"),
        "{}",
        found.held
    );
}

/// A kick at a fixed time does not move. If the stop comes earlier, the kick comes after the stop.
#[test]
fn property_a_kick_at_a_fixed_time_is_held() {
    // In a short slide, the vibration from the ramp or its rounding would start the stick-slip, not the kick.
    let found = sensitivities(&case(&[]), &[("initial.speed", 0.5)]).unwrap();
    let [below, above] = row(&found, "initial.speed").reruns.as_ref().unwrap();
    assert_eq!(below.sticks, Some(1));
    assert!(
        below.remark.ends_with("the kick comes after the first stick"),
        "{below:?}"
    );
    assert!(below.shift.unwrap() < 0.0 && above.shift.unwrap() > 0.0);
    assert!(found.held.contains("stays at"), "{}", found.held);
}

/// Without a final stick there is no result. If reruns cannot be compared with the slopes, the slopes stand alone.
#[test]
fn property_without_reruns_the_slopes_stand_alone() {
    let sliding = case(&[QUICK[0], QUICK[1], QUICK[2], "output={end_time=0.1, interval=0.01}"]);
    assert_eq!(sensitivities(&sliding, &[]), None);
    let case = case(&QUICK);
    let halves = written(&case, &[("friction.decay", 0.05)]);
    let own = events(&case);
    let linearised = linearise(&halves, None, &|| false).unwrap();
    let asked = AtomicUsize::new(0);
    for most in [0, 1, 5] {
        asked.store(0, Ordering::Relaxed);
        let stop = || asked.fetch_add(1, Ordering::Relaxed) >= most;
        let found = of_case(&halves, Some(&linearised), &own, own.len(), &stop).unwrap();
        let found = found.result.unwrap();
        assert_eq!(found.without_reruns.as_deref(), Some("interrupted"));
        assert!(found.rows.iter().all(|row| row.reruns.is_none()));
        assert!(found.rows.iter().filter(|row| row.slope.is_some()).count() > 12);
        assert_eq!(row(&found, "friction.decay").parameter.half_last_digit, Some(0.05));
    }
    // Events of another case.
    let other = events(&sliding);
    let stick = own.iter().find(|event| event.kind.name() == "stick").unwrap();
    let other: Vec<Event> = other.into_iter().chain([*stick]).collect();
    let error = found(&halves, &other, &|| false).unwrap_err();
    assert!(error.starts_with("series agrees with "), "{error}");
    // More events than the case allows.
    let mut few = case.clone();
    few.solver.max_events = 3;
    let error = found(&written(&few, &[]), &own, &|| false).unwrap_err();
    assert!(
        error.starts_with("series does not run this case: the event budget"),
        "{error}"
    );
}
