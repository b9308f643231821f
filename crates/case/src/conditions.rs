//! Conditions that several values of a case must satisfy together.

use std::f64::consts::TAU;

use super::{Case, Motion};
use stickslip_engine::simulation::Method;
use stickslip_engine::simulation::procedure::FOREIGN;
use stickslip_engine::simulation::stepping::longest_stable_step;
use stickslip_system::friction::Law as _;
use stickslip_system::model::absolute_angles::AbsoluteModel;
use stickslip_system::model::system::{ContactLaw, End, KickSide, Pressing, Train};
use stickslip_system::model::{BreakawayTest, KickTime, Parameters, margin};
use stickslip_system::signal::{Ramp, Signal, TimeTable};

/// A larger number of samples, a terabyte, is a typing error.
const MOST_SAMPLES: f64 = 1e9;

/// A shorter run (s) is a typing error, and leaves an integrator no room for a step.
pub(super) const SHORTEST_RUN: f64 = 1e-12;

/// Largest spacing of doubles at the end of the run, relative to the shortest period. With a coarser clock, times
/// within a period cannot be told apart.
const COARSEST_CLOCK: f64 = 1e-4;

/// Largest number of dense samples per natural period. With more, late neighbouring times hardly differ.
const MOST_PER_PERIOD: f64 = 1e5;

pub(super) struct Violation {
    pub(super) path: String,
    pub(super) with: Vec<String>,
    pub(super) message: String,
}

impl Violation {
    pub(super) fn new(path: &str, with: &[&str], message: String) -> Violation {
        Violation {
            path: path.to_owned(),
            with: with.iter().map(|&other| other.to_owned()).collect(),
            message,
        }
    }
}

pub(super) fn violated(case: &Case) -> Vec<Violation> {
    let mut found = Vec::new();
    let mut complain = |path: &str, with: &[&str], message: String| found.push(Violation::new(path, with, message));
    friction(case, &mut complain);
    actuation(case, &mut complain);
    fixed_step(case, &mut complain);
    without_location(case, &mut complain);
    output(case, &mut complain);
    start(case, &mut complain);
    one_sided_test(case, &mut complain);
    kicks(case, &mut complain);
    clock(case, &mut complain);
    found
}

pub(super) fn below_shortest(time: f64) -> String {
    format!("must be at least {SHORTEST_RUN:?} s, but is {time:?} s")
}

pub(super) fn too_short(time: f64) -> String {
    format!("must be 0 (a step) or at least {SHORTEST_RUN:?} s, but is {time:?} s")
}

fn friction(case: &Case, complain: &mut impl FnMut(&str, &[&str], String)) {
    let (breakaway, law) = (case.system.breakaway, &case.system.law);
    let sliding = law.at_vanishing_speed();
    if breakaway < sliding {
        let key = law.key_at_vanishing_speed();
        complain(
            "friction.breakaway",
            &[&format!("friction.{key}")],
            format!(
                "must be at least friction.{key}: {breakaway:?} is below {sliding:?}, and between the two torques neither stick nor \
                 slip is consistent; raise breakaway or lower {key}"
            ),
        );
    }
    for (key, message) in law.complaints() {
        complain(&format!("friction.{key}"), &["friction"], message);
    }
    if matches!(case.system.contact, ContactLaw::Bristles(_)) {
        for key in ["low_speed", "high_speed"] {
            if law.number(key) == Some(0.0) {
                let message = "must be greater than 0 with law \"lugre\": the bristles' rate is divided by it";
                complain(&format!("friction.{key}"), &[], message.to_owned());
            }
        }
    }
}

fn actuation(case: &Case, complain: &mut impl FnMut(&str, &[&str], String)) {
    match &case.system.pressing {
        Pressing::Axial {
            actuation: Signal::Ramp(Ramp { rise_time, .. }),
            ..
        } if *rise_time > 0.0 && *rise_time < SHORTEST_RUN => {
            complain("actuation.rise_time", &[], too_short(*rise_time));
        }
        Pressing::Axial {
            actuation: Signal::TimeTable(TimeTable { time, value }),
            ..
        } => {
            for wrong in points("actuation.time", time, ("actuation.force", "forces", value.len())) {
                let with: Vec<&str> = wrong.with.iter().map(String::as_str).collect();
                complain(&wrong.path, &with, wrong.message);
            }
        }
        _ => {}
    }
}

/// Checks a table over time: the path of the times, the times, and the path, noun and number of the values.
pub(super) fn points(path: &str, time: &[f64], (value, values, count): (&str, &str, usize)) -> Vec<Violation> {
    let mut found = Vec::new();
    let times = time.len();
    if times == 0 {
        found.push(Violation::new(path, &[], "must hold at least one time".to_owned()));
    }
    if times != count {
        let message = format!("must be as long as {path}: {count} {values} for {times} times");
        found.push(Violation::new(value, &[path], message));
    }
    // Two points at the same time are a step.
    let is_third = |index: usize| index > 1 && time[index] == time[index - 2];
    if let Some(index) = (1..times).find(|&index| time[index] < time[index - 1] || is_third(index)) {
        let [before, here] = [index - 1, index].map(|index| format!("{path}.{index}"));
        let (time, last) = (time[index], time[index - 1]);
        let message = match time < last {
            true => format!("times must increase: {time:?} s follows {last:?} s"),
            false => {
                format!("two points of one time are a step, but {time:?} s has three: remove the one in the middle")
            }
        };
        found.push(Violation::new(&here, &[&before], message));
    }
    found
}

/// A fixed step needs an explicit method without another bound on the step, and must be stable.
fn fixed_step(case: &Case, complain: &mut impl FnMut(&str, &[&str], String)) {
    let Some(step) = case.solver.fixed_step else { return };
    let method = case.solver.method;
    let key = method.step_key();
    let Some((coefficients, order)) = method.fixed_steps() else {
        let message = format!(
            "only the explicit Runge-Kutta methods take fixed steps: with method \"{}\" remove it, or set solver.method to \
             \"erk\" or one of \"erk-NAME\"",
            method.name()
        );
        return complain(key, &["solver.method"], message);
    };
    if case.solver.max_step.is_some() {
        let message = "every step has this length, so that solver.max_step has no meaning: remove one of them";
        return complain(key, &["solver.max_step"], message.to_owned());
    }
    if step < SHORTEST_RUN {
        complain(key, &[], below_shortest(step));
    }
    // The stability bound is known only for two disks of the short form.
    let Some(Parameters { torsion, .. }) = Parameters::of(&case.system).filter(|_| case.words.short) else {
        return;
    };
    let longest = longest_stable_step(&coefficients, &torsion);
    if step > longest {
        let frequency = (torsion.stiffness / torsion.surface_inertia).sqrt() / TAU;
        complain(
            key,
            &[
                "solver.method",
                "torsion.stiffness",
                "torsion.surface_inertia",
                "torsion.damping",
            ],
            format!(
                "{step:?} s is unstable: with steps above {longest:.3e} s method \"{}\" makes the torsional oscillation of \
                 {:.3} kHz grow without bound; give a shorter step (its error falls with the step to the power of {}), or \
                 leave the steps to the tolerances",
                method.name(),
                1e-3 * frequency,
                order,
            ),
        );
    }
}

/// Methods without location of events have no absolute tolerances, and the paper's procedure is for its own disks.
fn without_location(case: &Case, complain: &mut impl FnMut(&str, &[&str], String)) {
    let solver = &case.solver;
    let why = match solver.method {
        Method::Paper => "with method \"paper\", whose one tolerance is a tenth of solver.rtol",
        Method::Rk4 => "with method \"rk4\", which has steps of one length and no tolerance",
        _ => return,
    };
    for (path, given) in [
        ("solver.atol_twist", solver.atol_twist),
        ("solver.atol_rate", solver.atol_rate),
        ("solver.atol_speed", solver.atol_speed),
    ] {
        if given.is_some() {
            complain(path, &["solver.method"], format!("has no meaning {why}: remove it"));
        }
    }
    if solver.method == Method::Paper && AbsoluteModel::new(&case.system).is_none() {
        complain("solver.method", &[], FOREIGN.to_owned());
    }
}

fn output(case: &Case, complain: &mut impl FnMut(&str, &[&str], String)) {
    let output = &case.output;
    for (index, window) in output.windows.iter().enumerate() {
        if window.from >= window.to {
            complain(
                &format!("output.window.{index}.to"),
                &[&format!("output.window.{index}.from")],
                format!("must be after from: {:?} s is not after {:?} s", window.to, window.from),
            );
        }
    }
    let dense = output.follow.samples_per_period;
    if let Some(samples) = dense.filter(|samples| *samples > MOST_PER_PERIOD) {
        let message = format!(
            "must be at most {MOST_PER_PERIOD:?}, but is {samples:?}; for every time there is output.dense = true"
        );
        complain("output.samples_per_period", &[], message);
    }
    let samples = |span: f64, interval: f64| span.max(0.0) / interval;
    let mut total = samples(output.end_time, output.interval);
    let mut densest = ("output.interval".to_owned(), total);
    for (index, window) in output.windows.iter().enumerate() {
        let here = samples(window.to.min(output.end_time) - window.from, window.interval);
        total += here;
        if here > densest.1 {
            densest = (format!("output.window.{index}.interval"), here);
        }
    }
    if total.is_nan() || total > MOST_SAMPLES {
        complain(
            &densest.0,
            &["output.end_time"],
            format!("asks for {total:.1e} samples, more than {MOST_SAMPLES:.0e}: raise the interval or end earlier"),
        );
    }
    let end_time = output.end_time;
    if end_time < SHORTEST_RUN {
        complain("output.end_time", &[], below_shortest(end_time));
    }
}

/// Something must move, and the law must be defined at the relative velocity at t = 0.
fn start(case: &Case, complain: &mut impl FnMut(&str, &[&str], String)) {
    let system = &case.system;
    if system.rotor.is_rigid() && system.stator.is_rigid() {
        let message = "missing: no inertia anywhere, neither of the rotor nor of the stator: nothing moves but what is driven; give \
                       one of the trains an inertia";
        complain("rotor.inertia", &["stator.inertia"], message.to_owned());
    }
    let speed = |train: &Train, speeds: &[f64]| match (&train.end, speeds.first()) {
        (_, Some(&speed)) => speed,
        (End::Driven(speed), None) => speed.at_start(),
        (_, None) => 0.0,
    };
    let initial = &system.initial;
    let relative = speed(&system.rotor, &initial.rotor_speed) - speed(&system.stator, &initial.stator_speed);
    let (relative, end) = (relative.abs(), system.law.ends_at());
    if relative < end {
        return;
    }
    let unit = match case.motion() {
        Motion::Rotation => "rad/s",
        Motion::Translation => "m/s",
    };
    let (path, with, what): (&str, &[&str], &str) = match case.words.short {
        true => (
            "initial.speed",
            &["friction.valid_below"],
            "must be below friction.valid_below, where the friction law ends",
        ),
        false => (
            "friction.valid_below",
            &[],
            "the friction law ends below the relative velocity at t = 0",
        ),
    };
    let message = format!(
        "{what}: {relative:?} {unit} is not below {end:?} {unit}; start slower, raise valid_below if the law holds there, or take a \
         law that is given at every speed"
    );
    complain(path, with, message);
}

fn one_sided_test(case: &Case, complain: &mut impl FnMut(&str, &[&str], String)) {
    let (name, train) = match case.system.breakaway_test {
        BreakawayTest::Transmitted => return,
        BreakawayTest::Rotor => ("rotor", &case.system.rotor),
        BreakawayTest::Stator => ("stator", &case.system.stator),
    };
    let message = if case.system.contact != ContactLaw::StickSlip {
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

/// Each kick must fall into the run, and act on a surface that it can move.
fn kicks(case: &Case, complain: &mut impl FnMut(&str, &[&str], String)) {
    for (index, kick) in case.system.kicks.iter().enumerate() {
        if kick.time == KickTime::Instability
            && let Err(why) = margin::resistance(&case.system)
        {
            let message = format!("no loss of stability that a kick could wait for: {why}; give a time, in s");
            complain(&format!("perturbation.{index}.time"), &[], message);
        }
        let (name, train) = match kick.on {
            KickSide::Rotor => ("rotor", &case.system.rotor),
            KickSide::Stator => ("stator", &case.system.stator),
            KickSide::Both => continue,
        };
        if train.is_rigid() {
            let message =
                format!("the surface of the {name} has no inertia that a kick could move: kick the other one, or both");
            complain(&format!("perturbation.{index}.on"), &[], message);
        }
    }
}

fn clock(case: &Case, complain: &mut impl FnMut(&str, &[&str], String)) {
    let end_time = case.output.end_time;
    let clock = f64::EPSILON * end_time;
    let too_late = |rest: String| {
        format!(
            "is too late for double precision: times near {end_time:?} s are {clock:.0e} s apart, and {rest}; end earlier"
        )
    };
    let Some(disks) = Parameters::of(&case.system).filter(|_| case.words.short) else {
        let frequency = fastest(&case.system.rotor).max(fastest(&case.system.stator));
        let period = TAU / frequency;
        if frequency > 0.0 && clock > COARSEST_CLOCK * period {
            let rest = format!("the trains have oscillations with periods down to {period:.0e} s");
            complain("output.end_time", &[], too_late(rest));
        }
        return;
    };
    let torsional = TAU * (disks.torsion.surface_inertia / disks.torsion.stiffness).sqrt();
    let axial = TAU * (disks.axial.mass / disks.axial.stiffness).sqrt();
    let (period, name, inertia, stiffness) = match axial < torsional {
        true => (axial, "axial", "axial.mass", "axial.stiffness"),
        false => (torsional, "natural", "torsion.surface_inertia", "torsion.stiffness"),
    };
    if end_time >= SHORTEST_RUN && clock > COARSEST_CLOCK * period {
        let rest = format!("the {name} period 2 pi sqrt({inertia}/{stiffness}) is {period:.0e} s");
        complain("output.end_time", &[inertia, stiffness], too_late(rest));
    }
}

/// Upper bound of the angular frequencies of a train, rad/s, from twice the stiffness of both shafts at a body.
fn fastest(train: &Train) -> f64 {
    let shaft = |index: usize| train.stiffness.get(index).copied().unwrap_or(0.0);
    let of_inertia = |(index, inertia): (usize, &f64)| {
        let stiffness = index.checked_sub(1).map_or(0.0, shaft) + shaft(index);
        (2.0 * stiffness / inertia).sqrt()
    };
    train.inertia.iter().enumerate().map(of_inertia).fold(0.0, f64::max)
}
