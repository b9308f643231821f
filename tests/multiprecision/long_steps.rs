//! Long steps of `series` where sliding does not slow down by itself: against the oracle, and against steps that
//! resolve every mode.

use crate::common::cases::{kinds, run, source, truth, written};
use stickslip::case::Case;
use stickslip::record::{Event, MemoryRecorder, State};
use stickslip::simulation::{Method, SolverOptions};

const DISK: &str = "inertia = 0.0113\nstiffness = 7.708e6\ndamping = 22.6\n";

/// The paper's law, with which these disks slide stably above 0.55 rad/s, and one that falls less.
const STEEP: &str = "low_speed = 0.6\nhigh_speed = 0.3\ndecay = 5";
const FLAT: &str = "low_speed = 0.4\nhigh_speed = 0.38\ndecay = 0.5";

fn case((rotor, stator): (&str, &str), law: &str, more: &str, end: f64) -> String {
    format!(
        "title = \"Long steps\"\n[rotor]\n{rotor}\nend = \"driven\"\n[stator]\n{stator}\nend = \"fixed\"\n\
         [contact]\nradius = \"52.3875 mm\"\nnormal_force = 2224\n\
         [friction]\nbreakaway = 0.6\n{law}\n\
         {more}\n[output]\nend_time = {end}\ninterval = 0.1\n"
    )
}

fn table(times: &[f64], speeds: &[f64]) -> String {
    format!("speed = {{ profile = \"table\", time = {times:?}, value = {speeds:?} }}")
}

fn kick(time: f64, size: f64) -> String {
    format!("[[perturbation]]\nkind = \"kick\"\ntime = {time}\nrelative_velocity = {size}\n")
}

/// With steps no longer than this (s) every mode is resolved: it is less than four periods of the fastest mode, and
/// longer than the steps that the series then takes.
const RESOLVED: f64 = 4e-4;

/// Number of steps, and events.
fn by_series(case: &Case, max_step: Option<f64>) -> (u64, MemoryRecorder) {
    let solver = SolverOptions {
        method: Method::Series,
        max_step,
        ..case.solver.clone()
    };
    let mut record = MemoryRecorder::default();
    let report = run(case, &solver, &mut record).unwrap_or_else(|failure| panic!("{}", failure.error));
    (report.work.iter().map(|work| work.steps).sum(), record)
}

/// A free rotor behind a soft shaft, whose end slows down: it oscillates into the unstable range.
fn behind_a_soft_shaft() -> String {
    let shafts = "inertia = [0.0113, 2.26]\nstiffness = [7.708e6, 50]\ndamping = [22.6, 0.5]\n";
    shafts.to_owned() + &table(&[0.0, 1.0, 5.0], &[4.0, 4.0, 1.0])
}

/// Steps are long while the fast modes are quiet, and no event is lost when these modes become unstable. Drives slow
/// down through the unstable range, and a kick before it or in it starts the stick-slip. The rotor's kick, before it,
/// first decays to 1e-8 rad/s, of which rounding is a part.
#[test]
fn multiprecision_long_steps_end_before_an_instability() {
    let slower = DISK.to_owned() + &table(&[0.0, 4.0, 6.5], &[3.0, 3.0, 0.4]);
    let chain = "inertia = [0.0113, 0.02]\nstiffness = [7.708e6, 3e6]\ndamping = [60, 200]\n";
    let reversed = chain.to_owned() + &table(&[0.0, 3.0], &[4.0, -0.1]);
    let shaft = behind_a_soft_shaft();
    let damped = DISK.replace("22.6", "60");
    let systems = [(&*slower, DISK), (&*shaft, DISK), (&*reversed, &*damped)];
    for (name, text, bound) in [
        (
            "a disk, kicked before",
            case(systems[0], STEEP, &kick(6.33, 1e-3), 6.42),
            1e-12,
        ),
        (
            "a disk, kicked in it",
            case(systems[0], STEEP, &kick(6.4, 1e-3), 6.425),
            1e-12,
        ),
        (
            "a rotor, kicked in it",
            case(systems[1], STEEP, &kick(2.9, 1e-3), 2.915),
            1e-12,
        ),
        (
            "a rotor, kicked before",
            case(systems[1], STEEP, &kick(2.86, 1e-3), 2.92),
            1e-9,
        ),
        ("a chain, reversed", case(systems[2], FLAT, "", 2.94), 1e-12),
    ] {
        let source = source(&text);
        let case = written(&text, &[]);
        let truth = truth((&source, &[]), &case, 20).unwrap_or_else(|error| panic!("{name}: {error}"));
        let exact: Vec<f64> = truth.report.events.iter().map(|event| event.time.to_f64()).collect();
        let (steps, own) = by_series(&case, None);
        let (all, resolved) = by_series(&case, Some(RESOLVED));
        let errors = [&own, &resolved].map(|record| farthest(&record.events, &exact));
        println!(
            "{name}: {} events, errors {:.1e} s and {:.1e} s, steps {steps} for {all}",
            exact.len(),
            errors[0],
            errors[1]
        );
        assert!(own.events.len() >= 6, "{name}");
        assert_eq!(kinds(&own.events), kinds(&resolved.events), "{name}");
        assert!(errors[0] <= bound, "{name}");
        assert!(errors[0] <= (10.0 * errors[1]).max(1e-12), "{name}");
        assert!(5 * steps <= all, "{name}");
    }
}

/// Without any event the states equal those of resolved steps.
#[test]
fn multiprecision_long_steps_keep_a_quiet_slip() {
    let constant = "inertia = [0.0113, 2.26]\nstiffness = [7.708e6, 50]\ndamping = [22.6, 5]\nspeed = 3.0\n";
    let text = case((constant, DISK), STEEP, "", 5.0);
    let case = written(&text, &[]);
    let (steps, own) = by_series(&case, None);
    let (all, resolved) = by_series(&case, Some(RESOLVED));
    println!("steps {steps} for {all}");
    assert!(20 * steps <= all);
    assert_eq!(own.samples.len(), resolved.samples.len());
    let mut worst = [0.0f64; 4];
    for (own, resolved) in own.samples.iter().zip(&resolved.samples) {
        let of = |state: &State| [state.relative_velocity, state.theta_dot, state.rotor_twist, state.phi1];
        let pairs = of(&own.state).into_iter().zip(of(&resolved.state));
        for (worst, (own, resolved)) in worst.iter_mut().zip(pairs) {
            *worst = worst.max((own - resolved).abs());
        }
    }
    println!(
        "omega_r and the rotor's speed within {:.1e} rad/s, twists within {:.1e} rad",
        worst[0].max(worst[1]),
        worst[2].max(worst[3])
    );
    assert!(worst[0].max(worst[1]) < 1e-12 && worst[2].max(worst[3]) < 1e-17);
}
/// The largest difference of corresponding events, s, without kicks and corners, whose times are given.
fn farthest(one: &[Event], times: &[f64]) -> f64 {
    assert_eq!(one.len(), times.len());
    let apart = one.iter().zip(times).map(|(event, time)| (event.time - time).abs());
    apart.fold(0.0, f64::max)
}
