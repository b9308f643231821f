//! Derivatives of the events by the parameters of a case, against closed forms and the other form of the case, and the
//! bands of a trajectory against a closed form.

use crate::common::cases::{certified, parsed, recorded, source};
use std::f64::consts::PI;
use std::time::{Duration, Instant};
use stickslip::analysis::certificate::Verdict;
use stickslip::analysis::linearised::linearise;
use stickslip::analysis::sensitivity::{Affected, CaseSensitivities, RerunOutcome, sensitivities};
use stickslip::analysis::{Certify, Deadline, Written};
use stickslip::case::{Case, CaseSource, Override, WrittenCase};
use stickslip::model::Mode;
use stickslip::record::Event;

fn events(source: &CaseSource, changes: &[Override]) -> Vec<Event> {
    recorded(&Case::read(source, changes).unwrap()).events
}

fn of_events(source: &CaseSource, changes: &[Override], own: &[Event]) -> Result<CaseSensitivities, String> {
    let written = WrittenCase::read(source, changes).unwrap();
    sensitivities(&written, None, own, own.len(), &|| false)
}

fn of_case(source: &CaseSource, changes: &[Override]) -> CaseSensitivities {
    of_events(source, changes, &events(source, changes)).unwrap()
}

fn column(found: &CaseSensitivities, path: &str) -> usize {
    let position = found.parameters.iter().position(|parameter| parameter.path == path);
    position.unwrap_or_else(|| panic!("{path} in {:?}", found.parameters))
}

/// Stick and slip of the mass on a belt under Coulomb friction: T = 2 d/v + 2 (pi - atan(d w/v))/w with d = (mu_0 - mu_d) F/k
/// and w = sqrt(k/m).
fn period([mass, stiffness, force, speed, breakaway, kinetic]: [f64; 6]) -> f64 {
    let d = (breakaway - kinetic) * force / stiffness;
    let w = (stiffness / mass).sqrt();
    2.0 * d / speed + 2.0 * (PI - (d * w / speed).atan()) / w
}

#[test]
fn analytic_the_period_of_the_coulomb_belt_and_its_events() {
    let source = CaseSource::built_in("belt-coulomb").unwrap();
    let found = of_case(&source, &[]);
    let result = found.result.as_ref().unwrap();
    assert_eq!(result.of, Affected::AttractorPeriod);
    let numbers = [1.0, 100.0, 10.0, 0.1, 0.4, 0.3];
    assert!((result.time - period(numbers)).abs() < 1e-14, "{}", result.time);
    let paths = [
        "stator.inertia",
        "stator.stiffness",
        "contact.normal_force",
        "rotor.speed",
        "friction.breakaway",
        "friction.kinetic",
    ];
    for (index, path) in paths.into_iter().enumerate() {
        let at = |factor: f64| {
            let mut changed = numbers;
            changed[index] *= factor;
            period(changed)
        };
        // Differences of fourth order: 1e-11 of the derivative, with rounding of 1e-13.
        let h = 1e-3;
        let exact =
            (8.0 * (at(1.0 + h) - at(1.0 - h)) - (at(1.0 + 2.0 * h) - at(1.0 - 2.0 * h))) / (12.0 * h * numbers[index]);
        let row = &result.rows[column(&found, path)];
        let slope = row.slope.unwrap();
        let off = (slope - exact).abs();
        assert!(off <= 1e-8 * exact.abs(), "{path}: {slope:e} instead of {exact:e}");
        // At another speed of the belt the mass does not begin with a stick: no event is the same.
        if path == "rotor.speed" {
            assert!(found.events.iter().all(|row| row[column(&found, path)].value.is_nan()));
            continue;
        }
        // Slip k and slip k + 1 are a period apart, whatever the first slip does.
        let of_event = |event: usize| found.events[event][column(&found, path)];
        let last = found.events.len() - 2;
        let (early, late) = (of_event(last - 2), of_event(last));
        let error = (late.value - early.value - exact).abs();
        let uncertainty = late.uncertainty + early.uncertainty;
        assert!(
            error <= uncertainty && uncertainty <= 1e-7 * exact.abs() * last as f64,
            "{path}: {error:e}, {uncertainty:e}"
        );
    }
    // Parameters that no longer affect the motion.
    for path in ["initial.stator_twist", "initial.stator_speed"] {
        assert_eq!(result.rows[column(&found, path)].slope, Some(0.0), "{path}");
    }
    // Half a unit of "0.1 m/s" is half of the speed: the belt is then too fast for sticking.
    let speed = &result.rows[column(&found, "rotor.speed")];
    assert!((speed.parameter.half_last_digit.unwrap() - 0.05).abs() < 1e-15);
    let reruns = speed.reruns.as_ref().unwrap();
    assert_eq!(reruns[0].outcome, RerunOutcome::SameEvents);
    let exact = period([1.0, 100.0, 10.0, 0.05, 0.4, 0.3]) - period(numbers);
    assert!((reruns[0].shift.unwrap() - exact).abs() < 1e-12, "{:?}", reruns[0]);
    assert_eq!(speed.nonlinear(), Some(true));
}

/// A short slide with a kick, as the short form of the brake and as trains.
const QUICK: &str = r#"
axial = { mass = 4.5359237, stiffness = 5.5358e7, damping = 8756.34 }
actuation = { profile = "ramp", force = 2225, rise_time = 0.02 }
contact = { radius = 0.0523875 }
friction = { breakaway = 0.6, low_speed = 0.6, high_speed = 0.3, decay = 5 }
initial = { speed = 3 }
perturbation = [{ time = 0.1685, relative_velocity = 1e-4 }]
output = { end_time = 0.4, interval = 0.01 }
solver = { rtol = 1e-12 }
"#;

const SHORT: &str = r#"
torsion = { rotor_inertia = 2.26, surface_inertia = 0.0113, stiffness = 7.708e6, damping = 22.6 }
"#;

const TRAINS: &str = r#"
rotor = { inertia = [0.0113, 2.26], stiffness = [7.708e6], damping = [22.6], end = "free" }
stator = { inertia = [0.0113], stiffness = [7.708e6], damping = [22.6], end = "fixed" }
"#;

/// A key of the short form moves both places that it sets; the other keys are the same parameters.
#[test]
fn analytic_the_brake_as_trains_has_the_slopes_of_its_short_form() {
    let brake = Case::read(&source(&format!("{SHORT}{QUICK}")), &[]).unwrap();
    let linear = linearise(&WrittenCase::of(&brake), None, &|| false).unwrap();
    let source = source(&format!("{TRAINS}{QUICK}"));
    let found = of_case(&source, &[]);
    let own = events(&source, &[]);
    assert!(own.len() > 10, "{}", own.len());
    let of_brake = &linear.events;
    assert_eq!(of_brake.len(), own.len());
    let shared = [
        "contact.radius",
        "friction.breakaway",
        "friction.low_speed",
        "friction.high_speed",
        "friction.decay",
        "initial.speed",
        "perturbation.0.relative_velocity",
        "perturbation.0.time",
        "actuation.force",
        "actuation.rise_time",
        "axial.stiffness",
    ];
    for path in shared {
        let theirs = linear.parameters.iter().position(|p| p.path == path).unwrap();
        let ours = column(&found, path);
        let value = linear.parameters[theirs].value;
        for (event, row) in of_brake.iter().zip(&found.events) {
            let (exact, slope) = (event.by_parameter[theirs].value, row[ours]);
            // Radau IIA on the steps of the run has an error of 1e-6 of the slope, or of a nanosecond for a change of
            // the parameter by itself.
            let bound = slope.uncertainty + 2e-5 * exact.abs() + 1e-9 / value.abs();
            assert!(
                (slope.value - exact).abs() <= bound,
                "{path}, {} at {}: {:e} +- {:e} instead of {exact:e}",
                event.kind.name(),
                event.time,
                slope.value,
                slope.uncertainty
            );
        }
    }
}

/// Without convergence there is no derivative, and the reason is given.
#[test]
fn property_events_that_series_does_not_have_are_refused() {
    let source = CaseSource::built_in("belt-coulomb").unwrap();
    let mut own = events(&source, &[]);
    own[4].kind = stickslip::record::EventKind::Reversal;
    let error = of_events(&source, &[], &own).unwrap_err();
    assert!(error.contains("agrees with 4 of the 29 events"), "{error}");
}

/// Two masses on a belt whose friction falls with the speed and rises again: small changes grow by e^10 within 45
/// events, and differences over wide steps do not show the slope. A returned slope is correct, or none is returned.
#[test]
fn property_slopes_of_a_motion_that_small_changes_upset() {
    let source = source(
        r#"
motion = "translation"
rotor = { end = "driven", speed = "0.1 m/s" }
stator = { inertia = ["1 kg", "0.4 kg"], stiffness = ["100 N/m", "60 N/m"], damping = [0.1, 0], end = "fixed" }
contact = { normal_force = "10 N" }
friction = { law = "polynomial", breakaway = 0.42, low_speed = 0.4, linear = "-0.6 s/m", cubic = "0.9 s^3/m^3",
    valid_below = "2 m/s" }
initial = { stator_speed = ["0.1 m/s", 0] }
output = { end_time = "30 s", interval = "10 ms" }
"#,
    );
    let found = of_case(&source, &[]);
    let (mut given, mut missing) = (0, 0);
    for path in ["stator.inertia.0", "stator.stiffness.1", "contact.normal_force"] {
        let index = column(&found, path);
        let value = found.parameters[index].value;
        let series = Override::parse("solver.method=series").unwrap();
        // Differences with steps far below those at which the sequence changes.
        let at = |share: f64| {
            events(
                &source,
                &[series.clone(), Override::number(path, value * (1.0 + share))],
            )
        };
        let slopes = |share: f64| -> Vec<f64> {
            let (below, above) = (at(-share), at(share));
            let pairs = below.iter().zip(&above);
            pairs
                .map(|(below, above)| (above.time - below.time) / (2.0 * share * value))
                .collect()
        };
        let (narrow, narrower) = (slopes(1e-7), slopes(2e-8));
        for (event, row) in found.events.iter().enumerate() {
            let slope = row[index];
            if slope.value.is_nan() {
                missing += 1;
                continue;
            }
            given += 1;
            let own = (narrow[event] - narrower[event]).abs() + 1e-6 / value;
            assert!(
                (slope.value - narrow[event]).abs() <= slope.uncertainty + 3.0 * own,
                "{path}, event {event}: {:e} +- {:e} instead of {:e}",
                slope.value,
                slope.uncertainty,
                narrow[event]
            );
        }
    }
    println!("{given} slopes given, {missing} not");
    assert!(given > 90, "{given}, {missing}");
}

/// Two corners of signals at one time: on the two sides of a parameter's value different signals have the event. It
/// gets no slope, and a rerun does not count it as the same.
#[test]
fn property_corners_at_one_time_have_no_slope() {
    let source = source(
        r#"
rotor = { inertia = 0.2, end = "free", torque = { profile = "table", time = [0, 0.25, 0.5], value = [80, 80, 90] } }
stator = { inertia = 1.5, end = "free" }
contact = { radius = 0.1, normal_force = { profile = "ramp", value = 5000, rise_time = 0.5 } }
friction = { law = "coulomb", breakaway = 0.3, kinetic = 0.3 }
initial = { speed = 200 }
output = { end_time = 2, interval = 0.002 }
"#,
    );
    let found = of_case(&source, &[]);
    let rise = column(&found, "contact.normal_force.rise_time");
    // The corner at 0.25 s belongs to another signal; the corner at 0.5 s belongs to both.
    assert_eq!(found.events[0][rise].value, 0.0);
    assert!(found.events[1][rise].value.is_nan(), "{:?}", found.events[1][rise]);
    let result = found.result.as_ref().unwrap();
    assert_eq!(result.of, Affected::FinalStick);
}

/// A step without time left fails, or is omitted, with the reason.
#[test]
fn property_after_the_deadline_a_certificate_says_what_it_lacks() {
    let source = CaseSource::built_in("belt-coulomb").unwrap();
    let case = Case::read(&source, &[]).unwrap();
    let exact = Case::exact(&source, &[]).unwrap();
    let record = recorded(&case);
    let written = Written::new(&case, None, &source, &[]);
    let nothing = Deadline::after(Instant::now(), Some(0.0));
    let late = Certify::new(&case)
        .until(nothing)
        .oracle_within(&exact, 18, Duration::from_secs(600))
        .sensitivities(&written)
        .start(&record)
        .unwrap();
    let why = late.sensitivities.unwrap().unwrap_err();
    assert!(why.contains("wall time of 0 s was over"), "{why}");
    let certificate = late.certificate;
    assert!(certificate.ladder.len() >= 3);
    for rung in &certificate.ladder {
        assert!(
            rung.failure.as_deref().is_some_and(|why| why.contains("wall time")),
            "{rung:?}"
        );
    }
    let why = certificate.without_oracle.unwrap();
    assert!(why.contains("is allowed 0.0 s"), "{why}");
}

/// Rows of coarse runs by SUNDIALS methods against the closed form of the belt: the bands cover every error, and are
/// not much wider than the largest.
#[test]
fn analytic_bands_cover_the_rows_of_the_coulomb_belt() {
    let source = CaseSource::built_in("belt-coulomb").unwrap();
    for settings in [
        ["solver.method=cvode-bdf", "solver.rtol=1e-8"],
        ["solver.method=erk", "solver.rtol=1e-9"],
        ["solver.method=cvode-adams", "solver.rtol=1e-11"],
    ] {
        let changes = parsed(&settings);
        let (_, record, certificate) = certified(&source, &changes, 18);
        let certificate = certificate.certificate;
        assert_eq!(certificate.verdict, Verdict::Converged, "{settings:?}");
        let position = |name: &str| {
            let mut channels = certificate.bands.channels.iter();
            let named = channels.position(|channel| channel.name == name);
            named.unwrap()
        };
        let (phi1, speed) = (position("phi1"), position("phi1_dot"));
        let (w, belt): (f64, f64) = (10.0, 0.1);
        // The exact switches: slip at 0.02/v and then once per period, stick one slip later. At t = 0 the mass is at
        // rest on the belt.
        let (xe, d) = (0.03, 0.01);
        let slip = 2.0 * (PI - (d * w / belt).atan()) / w;
        let (first, whole) = (0.2, 0.2 + slip);
        let exact = |time: f64| -> (Mode, f64, f64) {
            let cycle = ((time - first) / whole).floor();
            let tau = time - first - cycle * whole;
            if time >= first && tau < slip {
                let (sin, cos) = (w * tau).sin_cos();
                let x = xe + d * cos + belt / w * sin;
                (Mode::SlipForward, x, -d * w * sin + belt * cos)
            } else {
                // Up to the next breakaway at x = 0.04 m.
                let next = if time < first { first - time } else { whole - tau };
                (Mode::Stick, 0.04 - belt * next, belt)
            }
        };
        let mut largest = [0.0f64; 2];
        let mut checked = 0;
        for stretch in &certificate.bands.stretches {
            let within = |time: f64| {
                time > stretch.start + stretch.time_uncertainty && time < stretch.end - stretch.time_uncertainty
            };
            let rows = record.samples.iter().enumerate();
            for (number, row) in rows.filter(|(_, row)| within(row.time)) {
                let values = record.values(number);
                let (mode, x, v) = exact(row.time);
                if (mode == Mode::Stick) != (row.mode == Mode::Stick) {
                    continue;
                }
                for (index, (column, exact)) in [(phi1, x), (speed, v)].into_iter().enumerate() {
                    let error = (values[column] - exact).abs();
                    let band = stretch.at_fixed_time(column);
                    assert!(error <= band, "{settings:?} at {}: {error:e}, band {band:e}", row.time);
                    largest[index] = largest[index].max(error);
                }
                checked += 1;
            }
        }
        assert!(checked > 4900, "{checked}");
        for (index, column) in [phi1, speed].into_iter().enumerate() {
            let band = certificate.bands.channels[column].at_fixed_time;
            assert!(
                band <= 10.0 * largest[index].max(1e-12),
                "{settings:?}: {band:e}, {largest:?}"
            );
        }
    }
}
