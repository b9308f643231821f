//! The methods from the user's side: help, errors, and the description of the method in a result.

use crate::common::cli::{Folder, output};
use crate::common::rows;
use crate::common::unlocked;
use stickslip::simulation::Method;

#[test]
fn cli_the_key_of_the_method_lists_every_method() {
    let folder = Folder::new();
    let keys = folder.ok("case --keys solver.method");
    // The table is wrapped to the width of a terminal.
    let keys: Vec<&str> = keys.split_whitespace().collect();
    for method in Method::all() {
        assert!(keys.contains(&method.name()), "{}", method.name());
    }
    folder.refused_short("--method erk-dormandprince", "did you mean \"erk-dormand-prince-54\"");
    folder.refused_short("--method euler", "case --keys solver.method");
}

#[test]
fn cli_a_fixed_step_needs_a_method_a_unit_and_stability() {
    let folder = Folder::new();
    // For Dormand and Prince's method, |R| along the slope of this mode is 1 at |h lambda| = 2.3.
    for [arguments, words] in rows(
        r#"
        --method arkode --set 'solver.fixed_step=1 us' | solver.fixed_step & only the explicit Runge-Kutta
        --method paper --set 'solver.fixed_step=1 us' | only the explicit Runge-Kutta
        --method erk --set 'solver.fixed_step=1 N' | solver.fixed_step
        --method erk --set solver.fixed_step=0 | greater than 0
        --method erk --set solver.fixed_step=1e-13 | at least 1e-12 s
        --method erk --set 'solver.fixed_step=1 us' --set 'solver.max_step=1 us' | max_step has no meaning
        --method erk-dormand-prince-54 --set 'solver.fixed_step=89 us' |
            unstable & 8.798e-5 s & 4.157 kHz & power of 5
        --method paper --set solver.atol_rate=1e-9 | solver.atol_rate & no meaning with method "paper"
        --method rk4 | solver.step is missing: length of every step & write step =
        --method rk4 --set 'solver.step=1 N' | solver.step & a force
        --method rk4 --set 'solver.step=120 us' | solver.step & unstable & power of 4
        --method rk4 --set 'solver.step=1 us' --set solver.atol_rate=1e-9 | solver.atol_rate & no meaning with method "rk4"
        --method rk4 --set 'solver.step=1 us' --set 'solver.max_step=1 us' | solver.step & max_step has no meaning
        --method rk4 --set 'solver.step=1 us' --set 'solver.fixed_step=1 us' | solver.fixed_step & is solver.step
        --set 'solver.step=1 us' | solver.step & belongs to method "rk4" & solver={method="rk4", step=...}
    "#,
    ) {
        folder.refused_short(arguments, words);
    }
    let steps = "--method erk-dormand-prince-54 --set 'solver.fixed_step=87 us' -o fixed.h5";
    folder.ok_short(steps);
    let meta = folder.result("fixed.h5").meta().unwrap();
    let value = |name: &str| format!("{:?}", meta.iter().find(|entry| entry.0 == name).unwrap().1);
    assert!(value("method").contains("erk-dormand-prince-54"));
    assert!(value("fixed_step").contains("8.7e-5"), "{}", value("fixed_step"));
    assert!(value("event_location").contains("\"located\""));
}

/// The result of a method that locates nothing says so, in /meta and at the events, warns, and is the input of the same run.
#[test]
fn cli_methods_that_locate_nothing_are_flagged() {
    let folder = Folder::new();
    for (method, settings) in [("paper", &[][..]), ("rk4", &["--set", "solver.step=2e-6"])] {
        let file = format!("{method}.h5");
        let arguments = ["--method", method, "-o", &file];
        let (_, warned) = output(&mut folder.short_run(&[&arguments[..], settings].concat()), 0);
        assert!(warned.contains("nothing was located"), "{warned}");
        let opened = unlocked::open(folder.path(&file)).unwrap();
        for group in ["events", "meta"] {
            let attribute = opened.group(group).unwrap().attr("event_location").unwrap();
            let text = attribute.read_scalar::<hdf5::types::VarLenUnicode>().unwrap();
            assert_eq!(text.as_str(), "end-of-step", "/{group}");
        }
        drop(opened);
        let first = folder.result(&file);
        let segments = first.segments().unwrap();
        assert!(segments.iter().all(|segment| segment.solver == method));
        let samples = first.samples(0..first.sample_count().unwrap()).unwrap();
        drop(first);
        folder.ok(format!("run {file} -o again.h5 --force").as_str());
        let again = folder.result("again.h5");
        assert_eq!(again.samples(0..again.sample_count().unwrap()).unwrap(), samples);
    }
}
