//! The conditions between the values of a case.

use super::draft::Draft;
use crate::friction::Law;
use crate::signal::{Ramp, Signal, Table};
use crate::simulation::Method;
use crate::simulation::fixed_step::longest_stable_step;

/// More samples than this are a slip of the pen: a terabyte.
const MOST_SAMPLES: f64 = 1e9;

/// Shorter runs (s) are a slip of the pen, and leave an integrator no room for a step.
pub(super) const SHORTEST_RUN: f64 = 1e-12;

/// Doubles at the end of the run must be closer to each other than this part of the natural period, or
/// what happens in one cannot be told apart.
pub(super) const COARSEST_CLOCK: f64 = 1e-4;

const FIXED_STEP: &str = "solver.fixed_step";

/// A condition between values that a case does not meet.
pub(super) struct Violation {
    /// The value that the message is about.
    pub(super) path: String,
    /// The others that take part.
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

/// The conditions of what both forms have: friction, the actuation where the axial mode presses, the solver, and the samples.
pub(super) fn in_common(case: &Draft, axial: bool) -> Vec<Violation> {
    let mut found = Vec::new();
    let mut complain = |path: &str, with: &[&str], message: String| found.push(Violation::new(path, with, message));
    friction(case, &mut complain);
    if axial {
        actuation(case, &mut complain);
    }
    fixed_step_method(case, &mut complain);
    paper_tolerances(case, &mut complain);
    output_windows(case, &mut complain);
    let end_time = case.output.end_time;
    if end_time < SHORTEST_RUN {
        let message = format!("must be at least {SHORTEST_RUN:?} s, but is {end_time:?} s");
        complain("output.end_time", &[], message);
    }
    found
}

/// Every condition that a case in the short form does not meet.
pub(super) fn of_short_form(case: &Draft) -> Vec<Violation> {
    let mut found = in_common(case, true);
    let mut complain = |path: &str, with: &[&str], message: String| found.push(Violation::new(path, with, message));
    let law = &case.parameters.friction.law;
    let (speed, end) = (case.parameters.initial.speed.abs(), law.ends_at());
    if speed >= end {
        complain(
            "initial.speed",
            &["friction.valid_below"],
            format!(
                "must be below friction.valid_below, where the friction law ends: {speed:?} rad/s is not below {end:?} rad/s; \
                 start slower, raise valid_below if the law holds there, or take a law that is given at every speed"
            ),
        );
    }
    fixed_step(case, &mut complain);
    let output = &case.output;
    let torsion = &case.parameters.torsion;
    let axial = &case.parameters.axial;
    let clock = f64::EPSILON * output.end_time;
    let periods = [
        (
            "natural",
            "torsion.surface_inertia",
            torsion.surface_inertia,
            "torsion.stiffness",
            torsion.stiffness,
        ),
        ("axial", "axial.mass", axial.mass, "axial.stiffness", axial.stiffness),
    ];
    let [torsional, axial] = periods.map(|p| std::f64::consts::TAU * (p.2 / p.4).sqrt());
    let (period, shortest) = if axial < torsional { (axial, 1) } else { (torsional, 0) };
    let (name, inertia, _, stiffness, _) = periods[shortest];
    if output.end_time >= SHORTEST_RUN && clock > COARSEST_CLOCK * period {
        complain(
            "output.end_time",
            &[inertia, stiffness],
            format!(
                "is too late for double precision: times near {:?} s are {clock:.0e} s apart, and the {name} period \
                 2 pi sqrt({inertia}/{stiffness}) is {period:.0e} s; end earlier",
                output.end_time
            ),
        );
    }
    found
}

/// What friction needs at rest, and the parameters of its law together.
fn friction(case: &Draft, complain: &mut impl FnMut(&str, &[&str], String)) {
    let friction = &case.parameters.friction;
    let sliding = friction.law.at_vanishing_speed();
    if friction.breakaway < sliding {
        let key = friction.law.key_at_vanishing_speed();
        complain(
            "friction.breakaway",
            &[&format!("friction.{key}")],
            format!(
                "must be at least friction.{key}: {:?} is below {:?}, and between the two torques neither stick nor \
                 slip is consistent; raise breakaway or lower {key}",
                friction.breakaway, sliding
            ),
        );
    }
    for (key, message) in friction.law.complaints() {
        complain(&format!("friction.{key}"), &["friction"], message);
    }
}

/// Dense samples in a natural period: in more, neighbouring times late in a run are hardly apart.
const MOST_PER_PERIOD: f64 = 1e5;

/// Windows that have a length, and samples that can be counted.
fn output_windows(case: &Draft, complain: &mut impl FnMut(&str, &[&str], String)) {
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
    if let Some(samples) = output
        .follow
        .samples_per_period
        .filter(|samples| *samples > MOST_PER_PERIOD)
    {
        complain(
            "output.samples_per_period",
            &[],
            format!(
                "must be at most {MOST_PER_PERIOD:?}, but is {samples:?}; for every time there is output.dense = true"
            ),
        );
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
}

/// What the numbers of a profile need.
fn actuation(case: &Draft, complain: &mut impl FnMut(&str, &[&str], String)) {
    match &case.parameters.actuation {
        Signal::Ramp(Ramp { rise_time, .. }) => {
            if *rise_time > 0.0 && *rise_time < SHORTEST_RUN {
                let message = format!("must be 0 (a step) or at least {SHORTEST_RUN:?} s, but is {rise_time:?} s");
                complain("actuation.rise_time", &[], message);
            }
        }
        Signal::Table(Table { time, value }) => {
            points(
                "actuation.time",
                time,
                ("actuation.force", "forces", value.len()),
                complain,
            );
        }
    }
}

/// What a table of points in time needs: the path of its times, these, and the path of the values, what they are, and how many.
pub(super) fn points(
    path: &str,
    time: &[f64],
    (value, values, count): (&str, &str, usize),
    complain: &mut impl FnMut(&str, &[&str], String),
) {
    let times = time.len();
    if times == 0 {
        complain(path, &[], "must hold at least one time".to_owned());
    }
    if times != count {
        let message = format!("must be as long as {path}: {count} {values} for {times} times");
        complain(value, &[path], message);
    }
    if let Some(index) = (1..times).find(|&index| time[index] <= time[index - 1]) {
        let [before, here] = [index - 1, index].map(|index| format!("{path}.{index}"));
        let message = format!(
            "times must increase: {:?} s follows {:?} s",
            time[index],
            time[index - 1]
        );
        complain(&here, &[&before], message);
    }
}

/// A fixed step that the solver can take: one of a method that takes it, without another bound.
fn fixed_step_method(case: &Draft, complain: &mut impl FnMut(&str, &[&str], String)) {
    const PATH: &str = FIXED_STEP;
    let Some(step) = case.solver.fixed_step else { return };
    let method = case.solver.method;
    if method.explicit_table().is_none() {
        let message = format!(
            "only the explicit Runge-Kutta methods take fixed steps: with method \"{}\" remove it, or set solver.method to \
             \"erk\" or one of \"erk-NAME\"",
            method.name()
        );
        complain(PATH, &["solver.method"], message);
    } else if case.solver.max_step.is_some() {
        let message = "every step has this length, so that solver.max_step has no meaning: remove one of them";
        complain(PATH, &["solver.max_step"], message.to_owned());
    } else if step < SHORTEST_RUN {
        let message = format!("must be at least {SHORTEST_RUN:?} s, but is {step:?} s");
        complain(PATH, &[], message);
    }
}

/// What a fixed step needs besides: stability.
fn fixed_step(case: &Draft, complain: &mut impl FnMut(&str, &[&str], String)) {
    const PATH: &str = FIXED_STEP;
    let step = case.solver.fixed_step.filter(|_| case.solver.max_step.is_none());
    let Some((step, table)) = step.zip(case.solver.method.explicit_table()) else {
        return;
    };
    let method = case.solver.method;
    let torsion = &case.parameters.torsion;
    let longest = longest_stable_step(table, torsion);
    // Of a case that is wrong elsewhere nothing is known.
    if step > longest {
        let frequency = (torsion.stiffness / torsion.surface_inertia).sqrt() / std::f64::consts::TAU;
        complain(
            PATH,
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
                table.order(),
            ),
        );
    }
}

/// The paper's procedure has one tolerance, which is rtol's.
fn paper_tolerances(case: &Draft, complain: &mut impl FnMut(&str, &[&str], String)) {
    if case.solver.method != Method::Paper {
        return;
    }
    let solver = &case.solver;
    for (path, given) in [
        ("solver.atol_twist", solver.atol_twist),
        ("solver.atol_rate", solver.atol_rate),
        ("solver.atol_speed", solver.atol_speed),
    ] {
        if given.is_some() {
            let message =
                "has no meaning with method \"paper\", whose one tolerance is a tenth of solver.rtol: remove it";
            complain(path, &["solver.method"], message.to_owned());
        }
    }
}
