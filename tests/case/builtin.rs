//! The built-in cases, compared with the parameters of the independent exact solution.

use crate::common::cases::built_in;
use stickslip::case::{Case, CaseSource, builtin};
use stickslip::model::system::{Kick, KickSide};
use stickslip::model::{BreakawayTest, KickTime, Parameters};
use stickslip::signal::{Signal, TimeTable};

fn case(name: &str) -> Case {
    built_in(name, &[])
}

#[test]
fn every_built_in_case_is_valid_and_the_default_is_one_of_them() {
    for built_in in builtin::CASES {
        case(built_in.name);
    }
    assert!(CaseSource::built_in(builtin::DEFAULT).is_ok());
}

/// The parameters of data/truth/paper.json were converted there with 33 digits.
#[test]
fn multiprecision_paper_parameters_are_the_exact_conversions() {
    let paper = case("paper");
    // Each decimal is the exact conversion with 16 or more digits. A single rounding must give its nearest double.
    let truth = [
        ("axial.stiffness", "55357592.62141118307"),
        ("axial.damping", "8756.341762323818898"),
        ("axial.mass", "4.5359237"),
        ("actuation.force", "2224.11080763025"),
        ("actuation.rise_time", "1"),
        ("torsion.stiffness", "7707825.036264011274"),
        ("torsion.damping", "22.59696580552334"),
        ("contact.radius", "0.0523875"),
        ("torsion.rotor_inertia", "2.259696580552334"),
        ("torsion.surface_inertia", "0.01129848290276167"),
        ("friction.breakaway", "0.6"),
        ("friction.low_speed", "0.6"),
        ("friction.high_speed", "0.3"),
        ("friction.decay", "5"),
        ("initial.speed", "100"),
        ("perturbation.0.time", "6.966"),
        ("perturbation.0.relative_velocity", "1.3e-6"),
        ("output.end_time", "10"),
    ];
    for (path, exact) in truth {
        assert_eq!(paper.number(path).unwrap(), exact.parse::<f64>().unwrap(), "{path}");
    }
    assert_eq!(paper.system.kicks.len(), 1);
    assert_eq!(paper.system.breakaway_test, BreakawayTest::Transmitted);
}

/// The parameters of data/truth/si-kick.json are those that the paper prints.
#[test]
fn published_si_parameters_are_taken_as_printed() {
    let printed = [
        ("axial.stiffness", 55.38e6),
        ("axial.damping", 8760.0),
        ("axial.mass", 4.54),
        ("actuation.force", 2225.0),
        ("actuation.rise_time", 1.0),
        ("torsion.stiffness", 7.71e6),
        ("torsion.damping", 22.606),
        ("contact.radius", 0.052388),
        ("torsion.rotor_inertia", 2.262),
        ("torsion.surface_inertia", 0.0113),
        ("friction.breakaway", 0.6),
        ("friction.low_speed", 0.6),
        ("friction.high_speed", 0.3),
        ("friction.decay", 3.5),
        ("initial.speed", 100.0),
    ];
    let [kicked, unperturbed] = [case("paper-si"), case("unperturbed")];
    for (path, value) in printed {
        assert_eq!(kicked.number(path).unwrap(), value, "{path}");
        assert_eq!(unperturbed.number(path).unwrap(), value, "{path}");
    }
    let kick = Kick {
        time: KickTime::At(6.9697),
        relative_velocity: 1e-4,
        on: KickSide::Both,
    };
    assert_eq!(kicked.system.kicks, [kick]);
    assert!(unperturbed.system.kicks.is_empty());
}

#[test]
fn the_release_case_lets_go_completely_and_grips_again() {
    let release = case("release");
    let Signal::TimeTable(TimeTable { time, value: force }) = &Parameters::of(&release.system).unwrap().actuation
    else {
        panic!("the force of the release case is a table");
    };
    assert_eq!(time.len(), force.len());
    let released = force.iter().skip(1).position(|&f| f == 0.0).unwrap() + 1;
    assert!(force[..released].iter().any(|&f| f > 0.0) && force[released..].iter().any(|&f| f > 0.0));
    assert_eq!(release.system.kicks[0].time, KickTime::Instability);
}

#[test]
fn an_unknown_built_in_name_is_answered_with_the_known_ones() {
    let error = CaseSource::built_in("papper").unwrap_err();
    insta::assert_snapshot!(error, @r#"there is no built-in case "papper" (did you mean paper?); there are paper, paper-si, unperturbed, release, belt-coulomb, belt-leine, belt-leine-arctan, belt-leine-tanh, belt-exponential, block, hairer, den-hartog, groan, drill-string, clutch, lugre-slider, and any TOML file by its path"#);
}
