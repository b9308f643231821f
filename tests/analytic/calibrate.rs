//! Calibrations with an answer in closed form: T_n = 2 pi sqrt(J/k_t) alone decides them.

use std::f64::consts::TAU;
use stickslip::calibrate::{Calibration, CalibrationStudy, Determined, Role, calibrate};
use stickslip::sweep::StudySource;

/// Short runs: T_n needs no sliding.
const QUICK: &str = r#"
case = "paper"

[set]
output.end_time = 0.02
"actuation.rise_time" = 0.01
perturbation = []

[search]
points = 64
starts = 4
"#;

/// k_t of the case `paper`, N m/rad: 6.822e7 lbf in/rad.
const STIFFNESS: f64 = 6.822e7 * 4.4482216152605 * 0.0254;

fn found(free_and_targets: &str) -> Calibration {
    let source = StudySource::text("test", &format!("{QUICK}\n{free_and_targets}"));
    let study = CalibrationStudy::parse(source, &[]).unwrap();
    calibrate(&study, 2, &()).unwrap()
}

fn inertia(period: f64) -> f64 {
    STIFFNESS * (period / TAU).powi(2)
}

#[test]
fn analytic_the_interval_of_one_parameter_is_that_of_the_rounding() {
    let calibration = found(
        r#"
[[free]]
key = "torsion.surface_inertia"
from = 0.005
to = 0.03
[[target]]
quantity = "natural_period"
value = "0.00024 s"
"#,
    );
    assert_eq!(calibration.targets[0].role, Role::Held);
    assert!(!calibration.interrupted && calibration.compromise.is_none());
    let interval = calibration.intervals[0];
    assert_eq!(interval.determined, Determined::Both);
    let (least, largest) = (inertia(2.35e-4), inertia(2.45e-4));
    // Only points that meet the target count, so that the interval lies within the true one. The last search along a
    // parameter ends within a thousandth of the region.
    let slack = 0.01 * (largest - least);
    assert!(interval.least >= least - 1e-12, "{interval:?}");
    assert!(interval.least < least + slack, "{interval:?}");
    assert!(interval.largest <= largest + 1e-12, "{interval:?}");
    assert!(interval.largest > largest - slack, "{interval:?}");
    // The least largest residual for one target is 0, at the measured value itself.
    assert!(calibration.worst < 0.01, "{}", calibration.worst);
    let optimum = calibration.parameters[0];
    assert!((optimum - inertia(2.4e-4)).abs() < slack, "{optimum}");
}

#[test]
fn analytic_two_parameters_that_act_by_their_quotient_are_traded_and_undetermined() {
    let calibration = found(
        r#"
[[free]]
key = "torsion.surface_inertia"
from = 0.008
to = 0.016
spacing = "log"
[[free]]
key = "torsion.stiffness"
from = 5.5e6
to = 11e6
spacing = "log"
[[target]]
quantity = "natural_period"
value = "240.0 us"
"#,
    );
    // Over the same factor of 2 both parameters can take every value, except those that 240 us excludes: J/k_t is then
    // 1.459e-9 s^2, against 1.4545e-9 for equal positions in the two ranges.
    for interval in &calibration.intervals {
        assert_eq!(interval.determined, Determined::Not, "{interval:?}");
    }
    let pair = calibration.correlations[0];
    assert_eq!(pair.parameters, [0, 1]);
    // A strip of 0.08 % of a factor in a square of a factor of 2: 1 - 1e-6.
    assert!(pair.coefficient > 0.999, "{pair:?}");
}

#[test]
fn analytic_a_number_that_no_parameter_reaches_is_out_of_reach() {
    let calibration = found(
        r#"
[[free]]
key = "torsion.surface_inertia"
from = 0.005
to = 0.03
[[target]]
quantity = "natural_period"
value = "0.00024 s"
[[target]]
quantity = "stick_count"
value = 48
[[target]]
quantity = "slip_count"
value = 0
weight = 0
"#,
    );
    let roles: Vec<Role> = calibration.targets.iter().map(|target| target.role).collect();
    assert_eq!(roles, [Role::Held, Role::OutOfReach, Role::Compared]);
    // Nothing sticks within 0.02 s: 48 sticks are 96 half-widths away.
    assert_eq!(calibration.targets[1].nearest, -96.0);
    assert_eq!(calibration.targets[2].residual, 0.0);
}

#[test]
fn analytic_what_has_no_effect_is_undetermined() {
    let calibration = found(
        r#"
[[free]]
key = "torsion.surface_inertia"
from = 0.005
to = 0.03
[[free]]
key = "friction.decay"
from = 8
to = 2
[[target]]
quantity = "natural_period"
value = "0.00024 s"
"#,
    );
    let determined: Vec<Determined> = calibration.intervals.iter().map(|found| found.determined).collect();
    assert_eq!(determined, [Determined::Both, Determined::Not]);
    // For a uniform sample of a box; a hundred independent points or more scatter by less.
    assert!(calibration.correlations[0].coefficient.abs() < 0.5);
}
