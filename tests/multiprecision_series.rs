//! The recurrences and the roots of the series in 192 bits, against the independent multiprecision events: the same code
//! that works in double precision, with another number type.

mod common;

use astro_float::{BigFloat, Consts, Radix, RoundingMode};
use common::truth;
use std::cell::RefCell;
use std::ops::{Add, Div, Mul, Neg, Sub};
use stickslip::model::slip_series::SlipSeries;
use stickslip::model::state::{DIMENSION, index::*};
use stickslip::model::torsion::TorsionModel;
use stickslip::numerics::Number;
use stickslip::numerics::polynomial_roots::first_falling;

const BITS: usize = 192;
const ROUNDING: RoundingMode = RoundingMode::ToEven;

thread_local! {
    static CONSTANTS: RefCell<Consts> = RefCell::new(Consts::new().expect("memory for constants"));
}

#[derive(Debug, Clone, PartialEq, PartialOrd)]
struct Wide(BigFloat);

impl Wide {
    fn parse(decimal: &str) -> Wide {
        CONSTANTS.with_borrow_mut(|c| Wide(BigFloat::parse(decimal, Radix::Dec, BITS, ROUNDING, c)))
    }

    /// Rounded: by way of its decimal digits.
    fn double(&self) -> f64 {
        self.0.to_string().parse().expect("a number")
    }
}

macro_rules! operator {
    ($($name:ident $method:ident)+) => {
        $(impl $name for Wide {
            type Output = Wide;
            fn $method(self, other: Wide) -> Wide {
                Wide(self.0.$method(&other.0, BITS, ROUNDING))
            }
        })+
    };
}
operator! { Add add Sub sub Mul mul Div div }

impl Neg for Wide {
    type Output = Wide;
    fn neg(self) -> Wide {
        Wide(self.0.neg())
    }
}

impl Number for Wide {
    fn of(x: f64) -> Wide {
        Wide(BigFloat::from_f64(x, BITS))
    }

    fn exp(&self) -> Wide {
        CONSTANTS.with_borrow_mut(|c| Wide(self.0.exp(BITS, ROUNDING, c)))
    }
}

const TERMS: usize = 48;

/// From the state of a slip event to where omega_r falls to zero: the time that takes, and the state there.
fn slip(model: &TorsionModel, start: [Wide; DIMENSION], force: f64) -> (Wide, [Wide; DIMENSION]) {
    let mut series = SlipSeries::<Wide, TERMS>::new(model, Wide::of(1.0 / model.natural_angular_frequency()));
    let mut pressing: [Wide; TERMS] = std::array::from_fn(|_| Wide::of(0.0));
    pressing[0] = Wide::of(force);
    // A sixtieth of a natural period: 48 terms leave less than 1e-30 of it.
    let step = Wide::of(0.1);
    let (mut units, mut y) = (Wide::of(0.0), start);
    for round in 0..1000 {
        series.expand(1.0, &y, &pressing, 0);
        let mut power = Wide::of(1.0);
        let mut guard = series.relative_velocity.clone().map(|c| {
            let scaled = c * power.clone();
            power = power.clone() * step.clone();
            scaled
        });
        if round == 0 {
            // A tangential departure: a double root, divided out.
            guard.rotate_left(2);
            guard[TERMS - 2..].fill(Wide::of(0.0));
        }
        if let Some(share) = first_falling(&guard) {
            let x = share * step;
            return ((units + x.clone()) * series.unit.clone(), series.at(&x));
        }
        y = series.at(&step);
        units = units + step.clone();
    }
    panic!("it slips on");
}

/// From the 30 digits of each slip event to the stick that ends it. What a parameter loses as a double, half of 1e-16,
/// moves the end of a slip of 2e-4 s by some 1e-20 s, and its states by 1e-16 of their size. The digits of the
/// truth are those of a time near 7 s: 1e-29 s.
#[test]
fn multiprecision_slips_end_where_the_truth_says() {
    let json: serde_json::Value = {
        let path = format!("{}/data/truth/si-kick.json", env!("CARGO_MANIFEST_DIR"));
        serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
    };
    let model = TorsionModel::new(&truth("si-kick").parameters);
    let events = json["events"].as_array().unwrap();
    let decimal = |value: &serde_json::Value| Wide::parse(value.as_str().unwrap());
    let (mut slips, mut worst, mut worst_state) = (0, 0.0f64, 0.0f64);
    for pair in events.windows(2).filter(|pair| pair[0]["kind"] == "slip").step_by(6) {
        assert_eq!(pair[1]["kind"], "stick");
        let state = |event: &serde_json::Value| {
            let at = |name: &str| decimal(&event["state_after"][name]);
            let mut y: [Wide; DIMENSION] = std::array::from_fn(|_| Wide::of(0.0));
            y[ROTOR_TWIST] = at("rotor_twist");
            y[ROTOR_TWIST_RATE] = at("theta_dot") - at("phi2_dot");
            y[STATOR_TWIST] = at("stator_twist");
            y[STATOR_TWIST_RATE] = at("phi1_dot");
            y[ROTOR_SPEED] = at("theta_dot");
            y
        };
        let (duration, end) = slip(&model, state(&pair[0]), 2225.0);
        let expected = decimal(&pair[1]["time"]) - decimal(&pair[0]["time"]);
        worst = worst.max((duration - expected).double().abs());
        let expected = state(&pair[1]);
        for k in [ROTOR_TWIST, STATOR_TWIST, ROTOR_SPEED] {
            let size = expected[k].double().abs();
            let error = (end[k].clone() - expected[k].clone()).double().abs();
            worst_state = worst_state.max(error / size);
        }
        slips += 1;
    }
    println!("{slips} slips end within {worst:.1e} s and {worst_state:.1e} of their state");
    assert!(slips >= 8);
    assert!(worst < 1e-18, "{worst:e} s");
    assert!(worst_state < 1e-15, "{worst_state:e}");
}
