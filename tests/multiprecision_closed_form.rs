//! The closed form of stick against the independent multiprecision states (data/truth).

mod common;

use common::truth;
use num_rational::BigRational;
use stickslip::model::closed_form::ClosedForm;
use stickslip::model::nearest_double;
use stickslip::model::state::{DIMENSION, TorsionState, index::*};
use stickslip::model::torsion::TorsionModel;
use stickslip::oracle::rational;

/// From the state of each stick event to the slip that ends it, by how much the rotor's speed changes. That takes a sum for
/// each binary digit of the duration, eight or so, each rounded by half a unit in the last place of the speed: four units
/// at most, and as these have no preferred sign, their sum over all sticks is some units times the square root of the
/// number of sticks. What has one sign in every stick adds up instead, and moves the last events of a long stick-slip.
/// With the rotor's speed as the sum of u' and v' it was 170 units in a stick, and nearly all of one sign.
#[test]
fn multiprecision_sticks_change_the_rotor_speed_without_bias() {
    for (name, case) in [("paper", "paper"), ("paper-si", "si-kick")] {
        let json: serde_json::Value = {
            let path = format!("{}/data/truth/{case}.json", env!("CARGO_MANIFEST_DIR"));
            serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
        };
        let model = TorsionModel::new(&truth(case).parameters);
        let closed = ClosedForm::new(&model);
        let events = json["events"].as_array().unwrap();
        let exact = |value: &serde_json::Value| -> BigRational { rational(value.as_str().unwrap()).unwrap() };
        let (mut sticks, mut sum, mut worst) = (0, 0.0f64, 0.0f64);
        for pair in events.windows(2).filter(|pair| pair[0]["kind"] == "stick") {
            let at = |name: &str| nearest_double(&exact(&pair[0]["state_after"][name]));
            let mut y: TorsionState = [0.0; DIMENSION];
            y[ROTOR_TWIST] = at("rotor_twist");
            y[STATOR_TWIST] = at("stator_twist");
            y[STATOR_TWIST_RATE] = at("phi1_dot");
            y[ROTOR_SPEED] = at("theta_dot");
            y[ROTOR_TWIST_RATE] = y[ROTOR_SPEED] - y[STATOR_TWIST_RATE];
            let duration = nearest_double(&(exact(&pair[1]["time"]) - exact(&pair[0]["time"])));
            let end = closed.stick(&y, duration);
            let [before, after] = [0, 1].map(|k| exact(&pair[k]["state_after"]["theta_dot"]));
            let change = nearest_double(&(after - before));
            let unit = f64::EPSILON * y[ROTOR_SPEED].abs().log2().floor().exp2();
            // Both speeds are within a binade or two: their difference is exact.
            let error = ((end[ROTOR_SPEED] - y[ROTOR_SPEED]) - change) / unit;
            (sum, worst, sticks) = (sum + error, worst.max(error.abs()), sticks + 1);
        }
        let bias = sum.abs() / f64::from(sticks).sqrt();
        println!("{name}: {sticks} sticks, at most {worst:.2} units in the last place, bias {bias:.2}");
        assert!(sticks > 40);
        assert!(worst < 4.0 && bias < 1.0, "{name}: {worst} {bias}");
    }
}
