//! Points of a study run side by side, a lane for each, and come to what each comes to alone.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use stickslip::case::Case;
use stickslip::simulation::Progress;
use stickslip::simulation::ensemble::Seat;
use stickslip::sweep::{Integrate, Outcome, Stopped, Study, StudySource, run_point, run_points, without_a_file};

fn study(text: &str) -> Study {
    let method = if text.contains("solver.method") {
        ""
    } else {
        "solver.method = \"series\""
    };
    let (case, rest) = text.split_once('\n').unwrap();
    let text = format!("{case}\n[keep]\nevents = true\n[set]\n{method}\n{rest}");
    Study::parse(StudySource::text("ensemble", &text), &[]).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// Every outcome to the last bit, as `Debug` writes it.
fn alone(study: &Study) -> BTreeMap<u64, String> {
    let points = (0..study.point_count().unwrap()).filter_map(|number| study.point(number));
    points
        .map(|point| {
            let outcome = run_point(study, &point, &without_a_file, &|| false).unwrap().unwrap();
            (outcome.number, format!("{outcome:?}"))
        })
        .collect()
}

fn together(study: &Study, threads: usize, integrate: &Integrate) -> BTreeMap<u64, String> {
    let points = (0..study.point_count().unwrap()).filter_map(|number| study.point(number));
    let mut found = BTreeMap::new();
    let keep = |group: Vec<Outcome>| {
        found.extend(group.iter().map(|outcome| (outcome.number, format!("{outcome:?}"))));
        Ok::<(), ()>(())
    };
    run_points(study, points, threads, &AtomicBool::new(false), integrate, keep).unwrap();
    found
}

/// For every built-in case, and for every law: brakes and trains, driven, forced and held, with stick, smooth and with bristles. Seven
/// points, so that lanes are left empty at the end. Of all runs the events, the numbers and the errors are the same to the last bit.
#[test]
fn property_no_row_depends_on_which_points_ran_together() {
    let force = |law: &str| {
        format!(
            "case = \"belt-exponential\"\noutput.end_time = 3\n{law}\n[[axis]]\nkey = \"contact.normal_force\"\nvalues = [5, 8, 9, 10, 11, 12, 30]\n"
        )
    };
    let axis = |case: &str, key: &str, values: &str| {
        format!("case = \"{case}\"\n[[axis]]\nkey = \"{key}\"\nvalues = [{values}]\n")
    };
    let forces = "0.5, 0.8, 0.9, 1.0, 1.1, 1.2, 3.0";
    let stribeck = "friction = { law = \"stribeck\", breakaway = 0.4, low_speed = 0.4, high_speed = 0.2, scale = 0.2, exponent = 2, viscous = 0.01 }";
    let studies = vec![
        axis("paper-si", "friction.decay", "0.5, 2, 3.5, 6, 10, 30, 100"),
        axis("paper", "torsion.damping", "10, 20, 22, 25, 30, 60, 900"),
        axis("unperturbed", "torsion.damping", "20, 21, 22, 23, 24, 25, 26"),
        axis("release", "friction.decay", "1, 2, 3, 4, 5, 6, 7"),
        axis("groan", "friction.decay", "5, 6, 7, 8, 9, 10, 11"),
        axis("clutch", "friction.kinetic", "0.1, 0.15, 0.2, 0.25, 0.27, 0.29, 0.3"),
        axis("drill-string", "friction.decay", "0.5, 0.7, 0.9, 1.1, 1.3, 1.5, 1.7"),
        axis("drill-string", "rotor.viscous.0", "0, 10, 20, 30, 40, 50, 60"),
        axis("block", "contact.normal_force", "2, 4, 6, 8, 9.81, 10, 12"),
        axis("hairer", "contact.normal_force", "1, 2, 3, 3.5, 4, 4.5, 5"),
        axis("belt-coulomb", "contact.normal_force", "6, 8, 9, 10, 11, 12, 14"),
        axis("den-hartog", "contact.normal_force", forces),
        axis("belt-leine", "contact.normal_force", forces),
        axis("belt-leine-tanh", "contact.normal_force", forces),
        axis("belt-leine-arctan", "contact.normal_force", forces),
        axis("lugre-slider", "contact.normal_force", forces),
        force("friction.decay = 4"),
        force(stribeck),
        // Points that do not run by the same steps.
        format!(
            "case = \"belt-exponential\"\noutput.end_time = 3\n{stribeck}\n[[axis]]\nkey = \"friction.exponent\"\nvalues = [1, 2]\n[[axis]]\nkey = \"friction.scale\"\nvalues = [0.1, 0.2, 0.3]\n"
        ),
        force(
            "friction = { law = \"polynomial\", breakaway = 0.4, low_speed = 0.4, linear = -0.4, quadratic = 0.2, cubic = 0.05, valid_below = 3 }",
        ),
        force(
            "friction = { law = \"table\", breakaway = 0.4, speed = [0, 0.1, 0.3, 1], coefficient = [0.4, 0.33, 0.28, 0.25] }",
        ),
        // Runs that fail beside runs that do not.
        axis("paper-si", "solver.max_events", "100000, 3, 5, 100001, 7, 1, 100002"),
        // Runs by other methods between them.
        format!(
            "{}[[axis]]\nkey = \"solver.method\"\nvalues = [\"series\", \"cvode\"]\n",
            axis("paper-si", "torsion.damping", "20, 22, 25")
        ),
    ];
    for text in studies {
        let study = study(&text);
        let expected = alone(&study);
        assert!(
            expected.values().filter(|outcome| outcome.contains("Ok(")).count() > 2,
            "{expected:?}"
        );
        for threads in [1, 2] {
            assert_eq!(together(&study, threads, &without_a_file), expected, "{text}");
        }
    }
}

/// A run that panics is a failed row, and those beside it are what they are.
#[test]
fn property_a_panic_is_one_failed_row() {
    let study =
        study("case = \"paper-si\"\n[[axis]]\nkey = \"torsion.damping\"\nvalues = [20, 21, 22, 23, 24, 25, 26, 27]\n");
    let mut expected = alone(&study);
    let panicking =
        |number: u64, case: &Case, seat: Option<&Arc<Seat>>, control: &mut dyn FnMut(Progress) -> ControlFlow<()>| {
            let mut asked = 0;
            let mut control = |progress: Progress| {
                asked += 1;
                assert!(number != 2 || asked < 40, "planted");
                control(progress)
            };
            without_a_file(number, case, seat, &mut control)
        };
    let mut found = together(&study, 1, &panicking);
    assert!(found.remove(&2).unwrap().contains("internal error: the run panicked"));
    expected.remove(&2);
    assert_eq!(found, expected);
}

/// The end of a sweep from outside leaves no run waiting for another.
#[test]
fn property_runs_side_by_side_end_together() {
    let study = study(
        "case = \"paper-si\"\n[sample]\nmethod = \"sobol\"\ncount = 4096\n[[axis]]\nkey = \"torsion.damping\"\nfrom = 15\nto = 40\n",
    );
    let points = (0..4096).filter_map(|number| study.point(number));
    let (stop, mut done) = (AtomicBool::new(false), 0);
    let ended = run_points(&study, points, 1, &stop, &without_a_file, |group| {
        done += group.len();
        stop.store(true, Ordering::Relaxed);
        Ok::<(), ()>(())
    });
    assert!(matches!(ended, Err(Stopped::Interrupted)));
    assert!((1..4096).contains(&done), "{done}");
}
