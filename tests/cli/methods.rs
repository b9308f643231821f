//! The methods from the user's side: help, errors, and the description of the method in a result.

use crate::common::cli::{Folder, output};
use crate::common::rows;
use crate::common::unlocked;
use stickslip::simulation::Method;

#[test]
fn cli_help_and_errors_list_every_method() {
    let folder = Folder::new();
    let help = folder.ok("run --help");
    let said = folder.refused_short(
        "--method erk-dormandprince",
        &["did you mean \"erk-dormand-prince-54\""],
    );
    // The help is wrapped to the width of a terminal.
    let help: String = help.split_whitespace().collect();
    for method in Method::all() {
        assert!(help.contains(method.name()), "{}", method.name());
        assert!(said.contains(&format!("\"{}\"", method.name())), "{}", method.name());
    }
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

/// The result of the paper's procedure says in /meta and at the events that nothing was located. The run warns, and
/// its result can be run again.
#[test]
fn cli_the_papers_procedure_is_flagged() {
    let folder = Folder::new();
    let paper = ["--method", "paper", "-o", "paper.h5"];
    let (_, warned) = output(&mut folder.short_run(&paper), 0);
    assert!(warned.contains("nothing was located"), "{warned}");
    let file = unlocked::open(folder.path("paper.h5")).unwrap();
    for group in ["events", "meta"] {
        let attribute = file.group(group).unwrap().attr("event_location").unwrap();
        let text = attribute.read_scalar::<hdf5::types::VarLenUnicode>().unwrap();
        assert_eq!(text.as_str(), "end-of-step", "/{group}");
    }
    drop(file);
    let first = folder.result("paper.h5");
    assert!(
        first
            .segments()
            .unwrap()
            .iter()
            .all(|segment| segment.solver == "paper")
    );
    let samples = first.samples(0..first.sample_count().unwrap()).unwrap();
    drop(first);
    folder.ok("run paper.h5 -o again.h5");
    let again = folder.result("again.h5");
    assert_eq!(again.samples(0..again.sample_count().unwrap()).unwrap(), samples);
}
