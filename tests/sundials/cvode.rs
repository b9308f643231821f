//! `cvode`, CVODE on its best path, against `series`, which shares nothing with it but the equations and the rules.
//!
//! It promises 1e-9 s by default and 1e-10 s at rtol = 1e-13 (measured: 7.4e-10 and 4.7e-11 s, both in `release`), on brakes
//! whose sticks are not those of rounding. `series` is within 2e-14 s of the oracle on them (`multiprecision/series_brakes`).

use crate::common::random_brakes::{random_brake, random_release};
use crate::common::{disks, event_sequence, run};
use stickslip::Run;
use stickslip::analysis::Summary;
use stickslip::case::{Case, CaseSource, Origin, Override};
use stickslip::model::Mode;
use stickslip::record::{EventKind, MemoryRecorder};
use stickslip::simulation::{Method, SolverOptions};

/// The largest difference of an event's time (s) at an rtol; `None` if the onset belongs to rounding.
fn difference(name: &str, overrides: &[Override], rtol: f64) -> Option<f64> {
    let case = Case::read(&CaseSource::built_in(name).unwrap(), overrides).unwrap();
    let by = |method, rtol| {
        let solver = SolverOptions {
            method,
            rtol,
            ..case.solver.clone()
        };
        run(&disks(&case), &solver, &case.output)
    };
    let (own, report) = by(Method::Cvode, rtol);
    if Summary::of_run(&case.system, &report).noise_determined {
        return None;
    }
    // All of it, but for a stick in which nothing happens any more.
    let last = own.segments.iter().rposition(|s| s.solver != "closed-form").unwrap();
    let (before, after) = own.segments.split_at(last + 1);
    assert!(before.iter().all(|s| ["cvode-adams", "cvode-bdf"].contains(&s.solver)));
    assert!(after.iter().all(|s| s.mode == Mode::Stick));
    let (own, exact) = (event_sequence(&own), event_sequence(&by(Method::Series, 1e-12).0));
    let kinds = |word: &[(EventKind, f64)]| word.iter().map(|event| event.0).collect::<Vec<_>>();
    assert_eq!(kinds(&own), kinds(&exact), "{name}, rtol {rtol:e}");
    own.iter().zip(&exact).map(|(a, b)| (a.1 - b.1).abs()).reduce(f64::max)
}

fn hold(label: &str, name: &str, overrides: &[Override]) -> bool {
    for (rtol, limit) in [(SolverOptions::default().rtol, 1e-9), (1e-13, 1e-10)] {
        let Some(difference) = difference(name, overrides, rtol) else {
            println!("{label}: the onset belongs to rounding");
            return false;
        };
        println!("{label}: rtol {rtol:e}: {difference:.1e} s");
        assert!(difference < limit, "{label}, rtol {rtol:e}: {difference:e} s");
    }
    true
}

#[test]
fn sundials_cvode_on_the_built_in_cases() {
    for name in ["paper", "paper-si", "release"] {
        assert!(hold(name, name, &[]), "{name}");
    }
}

#[test]
fn sundials_cvode_on_random_brakes() {
    let held = (0..8)
        .filter(|&k| hold(&format!("brake {k}"), "paper-si", &random_brake(k)))
        .count();
    assert!(held >= 5, "{held}");
}

#[test]
fn sundials_cvode_through_random_releases() {
    let held = (0..2)
        .filter(|&k| hold(&format!("release {k}"), "release", &random_release(k)))
        .count();
    assert!(held >= 1, "{held}");
}

/// A chain on a belt whose linear systems are solved along the chain: every implicit method has the events of `series`, which
/// solves none, also where a free end makes every speed a sum.
#[test]
fn sundials_long_chains_have_the_events_of_series() {
    let list = |value: f64, count: usize| format!("{:?}", vec![value; count]);
    let belt = |end: &str, shafts: usize| {
        format!(
            "motion = \"translation\"\n[rotor]\nend = \"driven\"\nspeed = 0.2\n[stator]\n{end}\ninertia = {}\nstiffness = {}\n\
             damping = {}\nviscous = {}\n[contact]\nnormal_force = 1.0\n[friction]\nlaw = \"hyperbolic\"\nbreakaway = 1.0\n\
             low_speed = 1.0\nhigh_speed = 0.3\nscale = 0.3\n[output]\nend_time = 60.0\n",
            list(1.0, 14),
            list(40.0, shafts),
            list(0.02, shafts),
            list(0.01, 14)
        )
    };
    for (text, least) in [
        (belt("end = \"fixed\"", 14), 4),
        (belt("end = \"free\"\ntorque = -0.8", 13), 2),
    ] {
        let source = CaseSource {
            text,
            origin: Origin::File("chain.toml".into()),
        };
        let case = Case::read(&source, &[]).unwrap();
        let by = |method| {
            let solver = SolverOptions {
                method,
                ..case.solver.clone()
            };
            let mut recorder = MemoryRecorder::default();
            let run = Run::of_system(&case.system, 0.0, &solver, &case.output).record(&mut recorder);
            run.start().unwrap();
            event_sequence(&recorder)
        };
        let exact = by(Method::Series);
        assert!(exact.len() >= least, "{exact:?}");
        // As promised by default; BDF alone is the least accurate, by some thousand times.
        for (method, limit) in [(Method::Cvode, 1e-9), (Method::Arkode, 1e-9), (Method::CvodeBdf, 1e-5)] {
            let found = by(method);
            assert_eq!(found.len(), exact.len(), "{method:?}: {found:?} and {exact:?}");
            for (a, b) in found.iter().zip(&exact) {
                assert_eq!(a.0, b.0, "{method:?}");
                assert!((a.1 - b.1).abs() < limit, "{method:?}: {a:?} and {b:?}");
            }
        }
    }
}
