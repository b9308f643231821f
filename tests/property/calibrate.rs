//! Calibration with rounded values from known parameters finds these parameters within the stated spread.
use stickslip::Run;
use stickslip::analysis::Summary;
use stickslip::calibrate::{Calibration, CalibrationStudy, Role, calibrate};
use stickslip::case::{Case, CaseSource, Override};
use stickslip::sweep::StudySource;

fn found(text: &str) -> Calibration {
    let source = StudySource::text("test", text);
    let study = CalibrationStudy::parse(source, &[]).unwrap();
    calibrate(&study, 2, &()).unwrap()
}

/// Summary of a brake with these settings and a kick at the instability. The solver is not the one of calibrations.
fn measured(settings: &[&str]) -> Summary {
    let base = CaseSource::built_in("paper").unwrap();
    let mut overrides = vec![
        Override::parse("perturbation=[{kind=\"kick\", time=\"instability\", relative_velocity=1e-6}]").unwrap(),
        Override::parse("output.interval=1").unwrap(),
        Override::parse("output.window=[]").unwrap(),
        Override::parse("output.around=none").unwrap(),
    ];
    overrides.extend(settings.iter().map(|setting| Override::parse(setting).unwrap()));
    let case = Case::read(&base, &overrides).unwrap();
    let report = Run::new(&case).start().unwrap();
    Summary::of_run(&case.system, &report)
}

/// A study that seeks a decay rate and a kick with these targets.
fn study(settings: &str, targets: &[(&str, String)]) -> String {
    let mut text = format!(
        r#"
case = "paper"
[search]
points = 512
starts = 12
[[free]]
key = "friction.decay"
from = 2
to = 9
[[free]]
key = "perturbation.0.relative_velocity"
from = 1e-10
to = 1e-3
spacing = "log"
[set]
perturbation = [{{ kind = "kick", time = "instability", relative_velocity = 1e-6 }}]
{settings}
"#
    );
    for (quantity, value) in targets {
        text += &format!("[[target]]\nquantity = \"{quantity}\"\nvalue = \"{value} s\"\n");
    }
    text
}

#[test]
fn property_known_parameters_are_found_again_within_the_spread() {
    // The brakes differ in decay rate, kick, damping and speed.
    for (decay, kick, others) in [
        (4.3, 2e-6, ["torsion.damping=18.0", "initial.speed=60.0"]),
        (6.2, 3e-8, ["torsion.damping=26.0", "initial.speed=25.0"]),
    ] {
        let (alpha, delta) = (
            format!("friction.decay={decay}"),
            format!("perturbation.0.relative_velocity={kick}"),
        );
        let summary = measured(&[&alpha, &delta, others[0], others[1]]);
        assert!(summary.sticks > 10, "{summary:?}");
        let onset = format!("{:.4}", summary.onset_time.unwrap());
        let last = format!("{:.4}", summary.final_stick_time.unwrap());
        let first = format!("{:.5}", summary.first_stick_duration.unwrap());
        let targets = [
            ("onset_time", onset),
            ("final_stick_time", last),
            ("first_stick_duration", first),
        ];
        let calibration = found(&study(&others.join("\n"), &targets));
        assert!(calibration.worst <= 1.0, "{calibration:?}");
        assert!(calibration.targets.iter().all(|target| target.role == Role::Held));
        for (interval, truth) in calibration.intervals.iter().zip([decay, kick]) {
            // The set of valid parameters contains the truth, but the found part may end a little before the edge.
            let slack = 0.03 * (interval.largest - interval.least);
            assert!(
                (interval.least - slack..=interval.largest + slack).contains(&truth),
                "{truth} is not in {interval:?}"
            );
        }
        // The data determine the parameter: less than a third of the range is left.
        let alpha = calibration.intervals[0];
        assert!(alpha.largest - alpha.least < 7.0 / 3.0, "{alpha:?}");
    }
}

#[test]
#[ignore = "long: a search that ends in a contradiction"]
fn property_long_numbers_of_two_brakes_contradict_each_other() {
    let summaries = [5.0, 5.5].map(|decay| measured(&[&format!("friction.decay={decay}")]));
    // Sliding loses stability at a speed that depends only on the decay rate, and so does the stop, up to about ten
    // microseconds. Each brake gives one of the two values.
    let targets = [
        (
            "instability_time",
            format!("{:.5}", summaries[0].instability_time.unwrap()),
        ),
        (
            "final_stick_time",
            format!("{:.4}", summaries[1].final_stick_time.unwrap()),
        ),
    ];
    let text = study("", &targets);
    let calibration = found(&text);
    let roles: Vec<Role> = calibration.targets.iter().map(|target| target.role).collect();
    let found = roles.iter().filter(|role| **role == Role::Contradicts).count();
    assert_eq!(found, 1, "{roles:?}");
    assert_eq!(roles.iter().filter(|role| **role == Role::Held).count(), 1, "{roles:?}");
    let (index, other) = if roles[0] == Role::Contradicts { (0, 1) } else { (1, 0) };
    assert!(calibration.targets[index].together > 1.0);
    assert_eq!(calibration.targets[index].instead, [other]);
    let compromise = calibration.compromise.unwrap();
    assert_eq!(compromise.worst, calibration.targets[index].together);
    // Between the two brakes, or next to them.
    assert!((4.9..5.6).contains(&compromise.parameters[0]), "{compromise:?}");
}
