//! A point of a study gives the same row alone and with others, on one thread and on two.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use stickslip::Watch;
use stickslip::case::Case;
use stickslip::sweep::{Integrate, PointOutcome, Study, StudySource, run_point, run_points, without_a_file};

fn study(text: &str) -> Study {
    let method = if text.contains("solver.method") {
        ""
    } else {
        "solver.method = \"series\""
    };
    let (case, rest) = text.split_once('\n').unwrap();
    let text = format!("{case}\n[keep]\nevents = true\n[set]\n{method}\n{rest}");
    Study::parse(StudySource::text("points", &text), &[]).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// Every outcome to the last bit, as printed by `Debug`.
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
    let keep = |group: Vec<PointOutcome>| {
        found.extend(group.iter().map(|outcome| (outcome.number, format!("{outcome:?}"))));
        Ok(())
    };
    run_points(study, points, threads, &(), integrate, keep).unwrap();
    found
}

/// Brakes and other systems, in stick, with smooth contacts and with bristles, by two methods. Some runs fail. Events,
/// values and errors are the same to the last bit.
#[test]
fn property_a_row_depends_on_its_point_alone() {
    let axis = |case: &str, key: &str, values: &str| {
        format!("case = \"{case}\"\n[[axis]]\nkey = \"{key}\"\nvalues = [{values}]\n")
    };
    let forces = "0.5, 0.8, 0.9, 1.0, 1.1, 1.2, 3.0";
    let studies = [
        axis("paper-si", "friction.decay", "0.5, 2, 3.5, 6, 10, 30, 100"),
        axis("release", "friction.decay", "1, 2, 3, 4, 5, 6, 7"),
        axis("drill-string", "rotor.viscous.0", "0, 10, 20, 30, 40, 50, 60"),
        axis("belt-leine-tanh", "contact.normal_force", forces),
        axis("lugre-slider", "contact.normal_force", forces),
        axis("paper-si", "solver.max_events", "100000, 3, 5, 100001, 7, 1, 100002"),
        format!(
            "{}[[axis]]\nkey = \"solver.method\"\nvalues = [\"series\", \"cvode\"]\n",
            axis("paper-si", "torsion.damping", "20, 22, 25")
        ),
    ];
    for text in studies {
        let study = study(&text);
        let expected = alone(&study);
        let found = expected.values().filter(|outcome| outcome.contains("Ok(")).count();
        assert!(found > 2, "{expected:?}");
        for threads in [1, 2] {
            assert_eq!(together(&study, threads, &without_a_file), expected, "{text}");
        }
    }
}

#[test]
fn property_a_panic_is_one_failed_row() {
    let study =
        study("case = \"paper-si\"\n[[axis]]\nkey = \"torsion.damping\"\nvalues = [20, 21, 22, 23, 24, 25, 26, 27]\n");
    let mut expected = alone(&study);
    let panicking = |number: u64, case: &Case, watch: &dyn Watch| {
        let asked = AtomicUsize::new(0);
        let stopped = || {
            let before = asked.fetch_add(1, Ordering::Relaxed);
            assert!(number != 2 || before < 10, "planted");
            watch.stopped()
        };
        without_a_file(number, case, &stopped)
    };
    let mut found = together(&study, 1, &panicking);
    assert!(found.remove(&2).unwrap().contains("internal error: the run panicked"));
    expected.remove(&2);
    assert_eq!(found, expected);
}

/// A stop from outside ends a sweep before all its points have run. Finished points are delivered.
#[test]
fn property_a_stop_ends_a_sweep_early() {
    let study = study(
        "case = \"paper-si\"\n[sample]\nmethod = \"sobol\"\ncount = 4096\n[[axis]]\nkey = \"torsion.damping\"\nfrom = 15\nto = 40\n",
    );
    let points = (0..4096).filter_map(|number| study.point(number));
    let (stop, mut done) = (AtomicBool::new(false), 0);
    let ended = run_points(&study, points, 1, &stop, &without_a_file, |group| {
        done += group.len();
        stop.store(true, Ordering::Relaxed);
        Ok(())
    });
    assert!(ended.unwrap_err().is_interrupted());
    assert!((1..4096).contains(&done), "{done}");
}
