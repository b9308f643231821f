//! Quantities: exact conversion, notation, wrong units.

use fend_core::Context;
use proptest::prelude::*;
use stickslip::case::quantity::{Dimension, UNITS, parse, printed};

/// The exact SI value of each quantity with 16 or more digits, typed from the definitions in NIST SP 811, appendix B.
#[test]
fn published_conversions_are_exact_to_the_last_bit() {
    let conversions = [
        (
            "6.822e7 lbf in/rad",
            Dimension::TorsionalStiffness,
            "7707825.036264011274",
        ),
        ("200 lbf in s/rad", Dimension::TorsionalDamping, "22.59696580552334"),
        ("20 slug in ft", Dimension::Inertia, "2.259696580552334"),
        ("0.1 slug in ft", Dimension::Inertia, "0.01129848290276167"),
        ("3.161e5 lbf/in", Dimension::Stiffness, "55357592.62141118307"),
        ("50 lbf s/in", Dimension::Damping, "8756.341762323818898"),
        ("2.0625 in", Dimension::Length, "0.0523875"),
        ("10 lbm", Dimension::Mass, "4.5359237"),
        ("1 slug", Dimension::Mass, "14.59390293720636483"),
        ("500 lbf", Dimension::Force, "2224.11080763025"),
        ("1 kip", Dimension::Force, "4448.2216152605"),
        ("1 kgf", Dimension::Force, "9.80665"),
        ("55.38 MN/m", Dimension::Stiffness, "55380000"),
        ("40 um", Dimension::Length, "0.00004"),
        ("40 µm", Dimension::Length, "0.00004"),
        ("40 μm", Dimension::Length, "0.00004"),
        ("1 ms", Dimension::Time, "0.001"),
        ("2 min", Dimension::Time, "120"),
        ("30 deg/s", Dimension::AngularVelocity, "0.5235987755982988731"),
        ("1 rev/s", Dimension::AngularVelocity, "6.283185307179586477"),
        ("955 rpm", Dimension::AngularVelocity, "100.0073661392750848"),
        ("0.05 s/deg", Dimension::FrictionDecay, "2.864788975654116044"),
        ("1 t", Dimension::Mass, "1000"),
    ];
    for (text, dimension, exact) in conversions {
        assert_eq!(parse(text, dimension), Ok(exact.parse().unwrap()), "{text}");
    }
}

/// fend has its own units and factors. It lacks slug, and its name for lbm is lb.
#[test]
fn the_factors_are_those_of_an_independent_unit_evaluator() {
    let mut compared = 0;
    for unit in UNITS {
        let (dimension, si) = [
            (Dimension::Mass, "kilogram"),
            (Dimension::Length, "meter"),
            (Dimension::Time, "second"),
            (Dimension::Force, "newton"),
            (Dimension::Angle, "radian"),
            (Dimension::AngularVelocity, "radian/second"),
            (Dimension::Frequency, "hertz"),
            (Dimension::Energy, "joule"),
            (Dimension::Power, "watt"),
        ]
        .into_iter()
        .find(|&(dimension, _)| parse(&format!("1 {}", unit.symbol), dimension).is_ok())
        .unwrap();
        let theirs = match unit.symbol {
            "lbm" => "lb".to_owned(),
            "slug" => "lbf second^2 / foot".to_owned(),
            "in" => "inch".to_owned(),
            "h" => "hour".to_owned(),
            // fend has no prefixes for the radian.
            "mrad" => "radian/1000".to_owned(),
            "urad" | "µrad" => "radian/1000000".to_owned(),
            "kip" => "1000 lbf".to_owned(),
            symbol => symbol.replace('µ', "u"),
        };
        let answer = fend_core::evaluate(&format!("1 ({theirs}) to ({si}) to 25 sf"), &mut Context::new())
            .unwrap_or_else(|error| panic!("{}: {error}", unit.symbol));
        let number = answer.get_main_result().trim_start_matches("approx. ");
        let number: f64 = number.split(' ').next().unwrap().parse().unwrap();
        let found = parse(&format!("1 {}", unit.symbol), dimension);
        assert_eq!(found, Ok(number), "{}", unit.symbol);
        compared += 1;
    }
    assert_eq!(compared, UNITS.len());
}

#[test]
fn one_unit_is_written_in_many_ways() {
    let ways = [
        "6 N m s/rad",
        "6 N*m*s/rad",
        "6 N·m·s/rad",
        "6N m s/rad",
        "+6.0e0 N  m s / rad",
        "6 N m s rad^-1",
        "6 N m s",
    ];
    for text in ways {
        assert_eq!(parse(text, Dimension::TorsionalDamping), Ok(6.0), "{text}");
    }
    for text in ["6 kg m^2", "6 kg m2", "6 kg m²", "6 kg m m", "6 kg m^3/m", " 6 kg m^2 "] {
        assert_eq!(parse(text, Dimension::Inertia), Ok(6.0), "{text}");
    }
    for text in ["6 rad/s", "6 1/s", "6 s^-1", "6 rad s^-1"] {
        assert_eq!(parse(text, Dimension::AngularVelocity), Ok(6.0), "{text}");
    }
}

#[test]
fn a_slash_divides_by_the_next_unit_only() {
    assert_eq!(parse("6 N s/m", Dimension::Damping), Ok(6.0));
    assert_eq!(parse("6 N/m s", Dimension::Damping), Ok(6.0));
    assert_eq!(parse("6 N/m/s", Dimension::Stiffness).ok(), None);
    assert_eq!(parse("6 kg m/s/s", Dimension::Force), Ok(6.0));
    assert_eq!(parse("6 kg m/s^2", Dimension::Force), Ok(6.0));
}

#[test]
fn an_angle_may_be_left_out_but_not_misplaced() {
    assert_eq!(parse("6 N m", Dimension::TorsionalStiffness), Ok(6.0));
    assert!(parse("6 N m rad", Dimension::TorsionalStiffness).is_err());
    assert!(parse("6 N/rad", Dimension::Force).is_err());
    assert!(parse("6 rad s", Dimension::Time).is_err());
}

/// A cycle is 2 pi radians. Cycles are no unit of angular velocity, in which the radian may be omitted.
#[test]
fn a_frequency_is_no_angular_velocity() {
    assert_eq!(parse("50 Hz", Dimension::Frequency), Ok(50.0));
    assert_eq!(parse("0.05 kHz", Dimension::Frequency), Ok(50.0));
    assert_eq!(parse("50 1/s", Dimension::Frequency), Ok(50.0));
    for text in ["50 Hz", "50 kHz", "50 rad Hz"] {
        assert!(parse(text, Dimension::AngularVelocity).is_err(), "{text}");
    }
    assert!(parse("50 rad/s", Dimension::Frequency).is_err());
    assert!(parse("50 N Hz", Dimension::Damping).is_err());
}

#[test]
fn the_example_of_every_dimension_is_a_quantity_of_it() {
    assert_eq!(Dimension::of_udunits("rad s-1"), Some(Dimension::AngularVelocity));
    assert_eq!(Dimension::of_udunits("N m"), Some(Dimension::Torque));
    assert_eq!(Dimension::of_udunits("s2 rad-2"), Some(Dimension::FrictionCurvature));
    assert_eq!(Dimension::of_udunits("rad s-2"), None);
    for dimension in Dimension::ALL.into_iter().filter(|&d| d != Dimension::Number) {
        assert!(parse(dimension.example(), dimension).is_ok(), "{dimension:?}");
        let found = parse(&format!("6 {}", dimension.unit()), dimension);
        assert_eq!(found, Ok(6.0), "{dimension:?}");
    }
}

/// Only the last bit matters here: decimals of any length must be rounded as Rust's own parser rounds them.
#[test]
fn a_subnormal_and_a_huge_quantity_round_correctly() {
    for number in "5e-324 2e-324 2.2250738585072011e-308 1.7976931348623157e308 0 -0.1".split(' ') {
        let found = parse(&format!("{number} m"), Dimension::Length);
        assert_eq!(found, Ok(number.parse().unwrap()), "{number}");
    }
    assert!(parse("1.8e308 m", Dimension::Length).is_err());
}

/// A measured number is known to half a unit of its last printed digit.
#[test]
fn analytic_the_last_printed_digit_gives_the_interval() {
    let interval = |text, dimension| printed(text, dimension).unwrap();
    assert_eq!(interval("6.975 s", Dimension::Time), (6.975, 0.0005));
    assert_eq!(interval("6.9750 s", Dimension::Time), (6.975, 0.00005));
    assert_eq!(interval("0.00019 s", Dimension::Time), (0.00019, 5e-6));
    assert_eq!(interval("190 us", Dimension::Time), (0.00019, 5e-7));
    assert_eq!(interval("1.9e2 us", Dimension::Time), (0.00019, 5e-6));
    assert_eq!(interval("48", Dimension::Number), (48.0, 0.5));
    assert!(printed("6.975", Dimension::Time).is_err());
    assert!(printed("48 s", Dimension::Number).is_err());
}

proptest! {
    #[test]
    fn property_an_si_quantity_is_the_number_itself(number in proptest::num::f64::NORMAL | proptest::num::f64::SUBNORMAL) {
        prop_assert_eq!(parse(&format!("{number:e} N m/rad"), Dimension::TorsionalStiffness), Ok(number));
    }

    #[test]
    fn property_long_decimals_round_to_nearest(digits in "[0-9]{1,17}\\.[0-9]{1,40}e-?[0-9]{1,2}") {
        let expected: f64 = digits.parse().unwrap();
        prop_assert_eq!(parse(&format!("{digits} kg"), Dimension::Mass), Ok(expected));
    }

    /// A power of two scales exactly, whatever the unit.
    #[test]
    fn property_scaling_the_number_scales_the_quantity(number in 1u32..1_000_000, power in 0u32..20) {
        let once = parse(&format!("{number} slug in ft"), Dimension::Inertia).unwrap();
        let scaled = u64::from(number) << power;
        let many = parse(&format!("{scaled} slug in ft"), Dimension::Inertia).unwrap();
        prop_assert_eq!(many, once * f64::from(1u32 << power));
    }

    /// Prefixes only move the decimal point.
    #[test]
    fn property_prefixes_agree(number in 0u32..u32::MAX) {
        let newtons = parse(&format!("{number}e3 N"), Dimension::Force);
        prop_assert_eq!(&newtons, &parse(&format!("{number} kN"), Dimension::Force));
        prop_assert_eq!(&newtons, &parse(&format!("{number}e6 mN"), Dimension::Force));
        prop_assert_eq!(&newtons, &parse(&format!("{number}e-3 MN"), Dimension::Force));
    }

    #[test]
    fn property_no_text_panics(text in "\\PC*", number in "[-+.0-9eE]{0,12}") {
        let _ = parse(&text, Dimension::Force);
        let _ = parse(&format!("{number}{text}"), Dimension::Force);
        let _ = parse(&format!("1 {text}"), Dimension::Force);
        let _ = parse(&format!("1 N{text}"), Dimension::Force);
    }

    #[test]
    fn property_no_unit_expression_panics(text in "[ */^·²1-9Nmsrad()-]{0,20}") {
        let _ = parse(&format!("1 {text}"), Dimension::Force);
    }
}
