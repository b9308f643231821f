//! Default tolerance of the points of a study: its accuracy, and exceptions from it.

use std::collections::BTreeMap;
use stickslip::case::Override;
use stickslip::sweep::{
    PointOutcome, STUDY_RTOL, Study, StudySource, Values, quantity_index, run_points, without_a_file,
};

fn study(text: &str) -> Study {
    study_with(text, &[])
}

fn study_with(text: &str, settings: &[&str]) -> Study {
    let settings: Vec<Override> = settings.iter().map(|text| Override::parse(text).unwrap()).collect();
    Study::parse(StudySource::text("tolerance", text), &settings).unwrap()
}

/// The plane of the critical curve. The kicks range from nearly hidden by rounding to those that need little growth.
fn map(count: usize) -> Study {
    study(&format!(
        r#"
case = "paper"
set = {{ perturbation = [{{ kind = "kick", time = "instability", relative_velocity = 1e-6 }}] }}
sample = {{ method = "sobol", count = {count} }}
axis = [
    {{ key = "friction.decay", from = 0.3, to = 300, spacing = "log" }},
    {{ key = "torsion.damping", from = 2, to = 1000, spacing = "log" }},
    {{ key = "perturbation.0.relative_velocity", from = 1e-8, to = 1e-4, spacing = "log" }},
]
"#
    ))
}

fn values(study: &Study, settings: &[&str]) -> BTreeMap<u64, Values> {
    let study = study_with(&study.head.source.text, settings);
    let points = (0..study.point_count().unwrap()).filter_map(|number| study.point(number));
    let mut found = BTreeMap::new();
    let keep = |group: Vec<PointOutcome>| {
        found.extend(
            group
                .into_iter()
                .map(|outcome| (outcome.number, outcome.result.unwrap())),
        );
        Ok(())
    };
    run_points(&study, points, 2, &(), &without_a_file, keep).unwrap();
    found
}

/// At the default tolerance, onset and final stick are within 1e-8 s (`series`: 1e-10 s, it has digits to spare) of
/// those of tight runs, whose own error is five orders smaller. The counts are the same. Two in three of the 64 points
/// have stick-slip, with up to 400 sticks.
#[test]
fn property_onset_and_final_stick_of_a_study_hold_to_1e_8_s() {
    let study = map(64);
    assert_eq!(study.default_tolerance(), Some(STUDY_RTOL));
    let tight = values(&study, &["solver.method=series", "solver.rtol=1e-13"]);
    let [count, onset, last] =
        ["stick_count", "onset_time", "final_stick_time"].map(|name| quantity_index(name).unwrap());
    let sticking = tight.values().filter(|values| values[count] >= 2.0).count();
    assert!((32..60).contains(&sticking), "{sticking}");
    for (method, bound) in [("cvode", 1e-8), ("arkode", 1e-8), ("series", 1e-10)] {
        let mut largest: f64 = 0.0;
        let found = values(&study, &[&format!("solver.method={method}")]);
        assert_eq!(found.len(), 64);
        for (number, values) in found {
            let reference = &tight[&number];
            assert_eq!(values[count], reference[count], "{method}, point {number}");
            for quantity in [onset, last] {
                let error = (values[quantity] - reference[quantity]).abs();
                assert!(error <= bound, "{method}, point {number}: {error:e} s");
                largest = largest.max(error);
            }
        }
        println!("{method}: {largest:.1e} s");
    }
}

const AXIS: &str = "[[axis]]\nkey = \"friction.decay\"\nvalues = [5]\n";

/// A tolerance given by the user applies, wherever it is given. Methods for which the default is not known to suffice
/// keep the tolerance of a single run.
#[test]
fn property_a_tolerance_that_is_given_wins() {
    let rtol = |study: &Study| {
        let point = study.point(0).unwrap();
        study.case_at(&point.coordinates).unwrap().solver.rtol
    };
    let with = |settings: &[&str]| study_with(&format!("case = \"paper\"\n{AXIS}"), settings);
    assert_eq!(rtol(&with(&[])), STUDY_RTOL);
    assert_eq!(rtol(&with(&["solver.rtol=1e-11"])), 1e-11);
    assert_eq!(rtol(&with(&["solver.method=series"])), STUDY_RTOL);
    for method in ["cvode-bdf", "erk", "paper"] {
        assert_eq!(rtol(&with(&[&format!("solver.method={method}")])), 1e-10, "{method}");
    }
    let set = study(&format!("case = \"paper\"\n[set]\nsolver.rtol = 1e-12\n{AXIS}"));
    assert_eq!(rtol(&set), 1e-12);
    assert_eq!(set.default_tolerance(), None);
    let varied = study("case = \"paper\"\n[[axis]]\nkey = \"solver.rtol\"\nvalues = [1e-7, 1e-9]\n");
    assert_eq!(rtol(&varied), 1e-7);
    let folder = tempfile::tempdir().unwrap();
    let case = stickslip::case::CaseSource::built_in("paper").unwrap().text;
    let tight = case.replace("[contact]", "[solver]\nrtol = 3e-11\n\n[contact]");
    assert_ne!(tight, case);
    std::fs::write(folder.path().join("mine.toml"), tight).unwrap();
    let source = StudySource {
        text: format!("case = \"mine.toml\"\n{AXIS}"),
        path: Some(folder.path().join("study.toml")),
        name: "mine".to_owned(),
    };
    assert_eq!(rtol(&Study::parse(source, &[]).unwrap()), 3e-11);
}

/// Once a stick is proved to be permanent, nothing is integrated any more. A run to 1000 s takes the steps of a run to
/// 10 s, except for the shift by longer forecasts.
#[test]
fn property_a_run_ends_its_work_when_it_sticks_for_good() {
    let study = map(8);
    let [steps, last] = ["steps", "final_stick_time"].map(|name| quantity_index(name).unwrap());
    for method in ["cvode", "arkode", "series"] {
        let method = format!("solver.method={method}");
        let short = values(&study, &[&method]);
        let long = values(&study, &[&method, "output.end_time=1000"]);
        for (number, values) in &short {
            let more = long[number][steps] / values[steps];
            // With strong damping, stability limits the steps of Adams' method, and their number is random.
            assert!(more < 1.1, "{method}, point {number}: {more}");
            let error = (long[number][last] - values[last]).abs();
            assert!(error < 1e-8, "{method}, point {number}");
        }
    }
}

/// For other systems, periods and onsets at the default are within 1e-8 s of those at 1e-12, amplitudes within a
/// relative 1e-8, and the counts are the same. With `series` nothing depends on the tolerance.
#[test]
fn property_periods_and_amplitudes_of_trains_hold_to_1e_8() {
    for (case, key, from, to) in [
        ("belt-leine", "rotor.speed", 0.05, 0.5),
        ("belt-exponential", "rotor.speed", 0.1, 0.4),
        ("belt-leine-tanh", "rotor.speed", 0.1, 0.4),
        ("drill-string", "friction.breakaway", 0.8, 0.9),
    ] {
        let study = study(&format!(
            "case = \"{case}\"\n[[axis]]\nkey = \"{key}\"\nfrom = {from}\nto = {to}\ncount = 3\n"
        ));
        assert_eq!(study.default_tolerance(), Some(STUDY_RTOL));
        let place = |name: &str| quantity_index(name).unwrap();
        let counts = ["motion", "stick_count", "event_count", "attractor_sticks"].map(place);
        let times = [
            "onset_time",
            "attractor_period",
            "last_stick_duration",
            "last_slip_duration",
        ]
        .map(place);
        let amplitude = place("attractor_amplitude");
        let tight = values(&study, &["solver.rtol=1e-12"]);
        let loose = values(&study, &[]);
        for (number, values) in &loose {
            let reference = &tight[number];
            for k in counts {
                assert_eq!(values[k], reference[k], "{case}, point {number}");
            }
            assert!(values[times[1]] > 0.0, "{case}, point {number} is not periodic");
            for k in times {
                let error = (values[k] - reference[k]).abs();
                assert!(error <= 1e-8, "{case}, point {number}: {error:e} s");
            }
            let error = (values[amplitude] / reference[amplitude] - 1.0).abs();
            assert!(error <= 1e-8, "{case}, point {number}: {error:e}");
        }
        let series = ["solver.method=series", "solver.rtol=1e-13"];
        let found = format!("{:?}", values(&study, &series[..1]));
        assert_eq!(found, format!("{:?}", values(&study, &series)));
    }
}
