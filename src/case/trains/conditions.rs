//! The conditions between the values of a case in the general form.

use crate::case::conditions::{self as shared, COARSEST_CLOCK, Violation};
use crate::case::draft::Draft;
use crate::case::{Case, Motion};
use crate::friction::Law as _;
use crate::model::absolute_angles::AbsoluteModel;
use crate::model::margin;
use crate::model::system::{ContactLaw, End, KickSide, Pressing, System, Train};
use crate::model::{BreakawayTest, KickTime};
use crate::simulation::Method;
use crate::simulation::procedure::FOREIGN;

/// Every condition that the case does not meet; `draft` has the keys that it shares with the short form.
pub(super) fn violated(case: &Case, draft: &Draft) -> Vec<Violation> {
    let trains = &case.system;
    let mut found = shared::in_common(draft, matches!(trains.pressing, Pressing::Axial { .. }));
    let mut complain = |path: &str, with: &[&str], message: String| found.push(Violation::new(path, with, message));
    if trains.rotor.is_rigid() && trains.stator.is_rigid() {
        let message = "missing: no inertia anywhere, neither of the rotor nor of the stator: nothing moves but what is driven; give \
                       one of the trains an inertia";
        complain("rotor.inertia", &["stator.inertia"], message.to_owned());
    }
    if case.solver.method == Method::Paper && AbsoluteModel::new(trains).is_none() {
        complain("solver.method", &[], FOREIGN.to_owned());
    }
    if matches!(trains.contact, ContactLaw::Bristles(_)) {
        for key in ["low_speed", "high_speed"] {
            if trains.law.number(key) == Some(0.0) {
                let message = "must be greater than 0 with law \"lugre\": the bristles' rate is divided by it";
                complain(&format!("friction.{key}"), &[], message.to_owned());
            }
        }
    }
    outside_the_law(case, &mut complain);
    one_sided_test(trains, &mut complain);
    for (index, kick) in trains.kicks.iter().enumerate() {
        if kick.time == KickTime::Instability
            && let Err(why) = margin::resistance(trains)
        {
            let message = format!("no loss of stability that a kick could wait for: {why}; give a time, in s");
            complain(&format!("perturbation.{index}.time"), &[], message);
        }
        let side = match kick.on {
            KickSide::Rotor => ("rotor", &trains.rotor),
            KickSide::Stator => ("stator", &trains.stator),
            KickSide::Both => continue,
        };
        if side.1.is_rigid() {
            let message = format!(
                "the surface of the {} has no inertia that a kick could move: kick the other one, or both",
                side.0
            );
            complain(&format!("perturbation.{index}.on"), &[], message);
        }
    }
    let frequency = fastest(&trains.rotor).max(fastest(&trains.stator));
    let end_time = case.output.end_time;
    let clock = f64::EPSILON * end_time;
    if frequency > 0.0 && clock > COARSEST_CLOCK * std::f64::consts::TAU / frequency {
        let message = format!(
            "is too late for double precision: times near {end_time:?} s are {clock:.0e} s apart, and the trains have oscillations \
             with periods down to {:.0e} s; end earlier",
            std::f64::consts::TAU / frequency
        );
        complain("output.end_time", &[], message);
    }
    found
}

/// A breakaway test of one surface that has no torque of its own, or of a contact without stick.
fn one_sided_test(trains: &System, complain: &mut impl FnMut(&str, &[&str], String)) {
    let (name, train) = match trains.breakaway_test {
        BreakawayTest::Transmitted => return,
        BreakawayTest::Rotor => ("rotor", &trains.rotor),
        BreakawayTest::Stator => ("stator", &trains.stator),
    };
    let message = if trains.contact != ContactLaw::StickSlip {
        "belongs to a contact with stick, and this one has none: remove it".to_owned()
    } else if train.is_rigid() {
        format!(
            "the surface of the {name} has no inertia, so that the torque on it says nothing: take \"transmitted\", or the other \
             surface"
        )
    } else {
        return;
    };
    complain("contact.breakaway_test", &[], message);
}

/// A bound of the angular frequencies of a train by itself, rad/s: twice the stiffness of both shafts of an inertia.
fn fastest(train: &Train) -> f64 {
    let shaft = |index: Option<usize>| {
        index
            .and_then(|index| train.stiffness.get(index))
            .copied()
            .unwrap_or(0.0)
    };
    let of_inertia = |(index, inertia): (usize, &f64)| {
        let stiffness = shaft(index.checked_sub(1)) + shaft(Some(index));
        (2.0 * stiffness / inertia).sqrt()
    };
    train.inertia.iter().enumerate().map(of_inertia).fold(0.0, f64::max)
}

/// The speed of a surface at t = 0.
fn at_start(train: &Train, speeds: &[f64]) -> f64 {
    match (&train.end, speeds.first()) {
        (_, Some(&speed)) => speed,
        (End::Driven(speed), None) => speed.at_start(),
        (_, None) => 0.0,
    }
}

/// A law that ends below the relative velocity at the start.
fn outside_the_law(case: &Case, complain: &mut impl FnMut(&str, &[&str], String)) {
    let trains = &case.system;
    let initial = &trains.initial;
    let speed = at_start(&trains.rotor, &initial.rotor_speed) - at_start(&trains.stator, &initial.stator_speed);
    let end = trains.law.ends_at();
    if speed.abs() >= end {
        let unit = match case.motion() {
            Motion::Rotation => "rad/s",
            Motion::Translation => "m/s",
        };
        complain(
            "friction.valid_below",
            &[],
            format!(
                "the friction law ends below the relative velocity at t = 0: {:?} {unit} is not below {end:?} {unit}; start slower, \
                 raise valid_below if the law holds there, or take a law that is given at every speed",
                speed.abs()
            ),
        );
    }
}
