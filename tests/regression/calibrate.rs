//! Results of the built-in calibrations: the paper's values, and its unpublished decay rate of friction.
use crate::common::cases::built_in;
use stickslip::Run;
use stickslip::analysis::Summary;
use stickslip::calibrate::{CALIBRATIONS, Calibration, CalibrationStudy, Determined, Role, calibrate};
use stickslip::sweep::StudySource;

fn study(name: &str) -> CalibrationStudy {
    CalibrationStudy::parse(StudySource::find(name, CALIBRATIONS).unwrap(), &[]).unwrap()
}

fn found(study: &CalibrationStudy) -> Calibration {
    calibrate(study, 2, &()).unwrap()
}

fn role(study: &CalibrationStudy, calibration: &Calibration, name: &str) -> Role {
    let place = study.targets.iter().position(|target| target.name() == name).unwrap();
    calibration.targets[place].role
}

#[test]
fn regression_the_us_values_meet_the_papers_numbers_near_five() {
    let study = study("paper-decay");
    let calibration = found(&study);
    // All quoted values are met, except "nearly constant" slips of 0.00019 s: they fall to 0.00018 s.
    for target in &study.targets {
        let expected = match target.name() {
            "shortest_slip_duration" => Role::OutOfReach,
            _ => Role::Held,
        };
        assert_eq!(role(&study, &calibration, target.name()), expected, "{}", target.name());
    }
    // The final stick is printed to 0.1 ms and moves by 2.7 ms per s/rad, which allows at most 0.04 s/rad. The
    // duration of the last stick, which jumps when a stick vanishes, reduces this to 0.008 s/rad.
    let decay = calibration.intervals[0];
    assert_eq!(decay.determined, Determined::Both);
    assert!(decay.least > 4.97 && decay.largest < 5.01, "{decay:?}");
    // Calibrations use `series`. With the SUNDIALS solvers, the optimum meets the same values.
    let mut case = study.case_at(&calibration.shares).unwrap();
    case.solver.method = built_in("paper", &[]).solver.method;
    let report = Run::new(&case).start().unwrap();
    let summary = Summary::of_run(&case.system, &report);
    let within = |here: Option<f64>, value: f64, half: f64| (here.unwrap() - value).abs() <= half;
    assert!(within(summary.onset_time, 6.975, 5e-4), "{summary:?}");
    assert!(within(summary.final_stick_time, 6.9896, 5e-5), "{summary:?}");
    assert!(within(summary.first_stick_duration, 5e-5, 5e-6), "{summary:?}");
    assert!(within(summary.first_slip_duration, 1.9e-4, 5e-6), "{summary:?}");
    assert!(within(summary.first_period, 2.4e-4, 5e-6), "{summary:?}");
    assert!(within(summary.last_stick_duration, 5.3e-4, 5e-6), "{summary:?}");
}

#[test]
#[ignore = "long: a search that ends in a contradiction"]
fn regression_long_with_the_rounded_si_values_the_papers_numbers_contradict_each_other() {
    let study = study("paper-si-decay");
    let calibration = found(&study);
    for held in ["onset_time", "final_stick_time", "first_stick_duration", "first_period"] {
        assert_eq!(role(&study, &calibration, held), Role::Held, "{held}");
    }
    assert_eq!(role(&study, &calibration, "last_stick_duration"), Role::Contradicts);
    assert_eq!(role(&study, &calibration, "shortest_slip_duration"), Role::OutOfReach);
    let decay = calibration.intervals[0];
    assert!(decay.least > 3.45 && decay.largest < 3.75, "{decay:?}");
    // Local searches among jumps find the best compromise only to its first digit.
    let compromise = calibration.compromise.unwrap();
    assert!((2.0..4.5).contains(&compromise.worst), "{compromise:?}");
}
