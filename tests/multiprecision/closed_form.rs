//! The closed form of stick against the independent multiprecision states (data/truth).

use crate::common::json::*;
use crate::common::truth;
use num_rational::BigRational;
use stickslip::model::closed_form::ClosedForm;
use stickslip::model::equations::SystemEquations;
use stickslip::model::system::System;
use stickslip::model::{Mode, nearest_double};
use stickslip::oracle::rational;

/// The change of the rotor's speed from the state of each stick event to the slip that ends it. This takes a sum for
/// each binary digit of the duration, about eight, each rounded by half a unit in the last place of the speed: four
/// units at most. These roundings have no preferred sign, so that their sum over all sticks is some units times the
/// square root of the number of sticks. An error with one sign in every stick would add up, and move the last events
/// of a long stick-slip. With the rotor's speed as the sum of u' and v' it was 170 units in a stick, nearly all of one
/// sign.
#[test]
fn multiprecision_sticks_change_the_rotor_speed_without_bias() {
    for (name, case) in [("paper", "paper"), ("paper-si", "si-kick")] {
        let json: serde_json::Value = {
            let path = format!("{}/data/truth/{case}.json", env!("CARGO_MANIFEST_DIR"));
            serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
        };
        let parameters = truth(case).parameters;
        let system = SystemEquations::new(&System::from(&parameters));
        let trains = ClosedForm::default();
        let trains = trains.of(&system, Mode::Stick).unwrap();
        let events = json["events"].list();
        let exact = |value: &serde_json::Value| -> BigRational { rational(value.text()).unwrap() };
        let mut sticks = 0;
        let (mut sum, mut worst) = (0.0f64, 0.0f64);
        for pair in events.windows(2).filter(|pair| pair[0]["kind"] == "stick") {
            let at = |name: &str| nearest_double(&exact(&pair[0]["state_after"][name]));
            let speed = at("theta_dot");
            let duration = nearest_double(&(exact(&pair[1]["time"]) - exact(&pair[0]["time"])));
            let [before, after] = [0, 1].map(|k| exact(&pair[k]["state_after"]["theta_dot"]));
            let change = nearest_double(&(after - before));
            let unit = f64::EPSILON * speed.abs().log2().floor().exp2();
            let rotor = system.rotor.speed.unwrap();
            let mut start = vec![0.0; system.dimension];
            for (side, twist, rate) in [
                (&system.rotor, at("rotor_twist"), speed - at("phi1_dot")),
                (&system.stator, at("stator_twist"), at("phi1_dot")),
            ] {
                (start[side.twists], start[side.twists + 1]) = (twist, rate);
            }
            start[rotor] = speed;
            let mut end = start.clone();
            trains.state(&start, [0.0, 0.0], duration, &mut end);
            // Both speeds are within a binade or two: their difference is exact.
            let error = ((end[rotor] - speed) - change) / unit;
            (sum, worst) = (sum + error, worst.max(error.abs()));
            sticks += 1;
        }
        assert!(sticks > 40);
        let bias = sum.abs() / f64::from(sticks).sqrt();
        println!("{name}: {sticks} sticks, at most {worst:.2} units in the last place, bias {bias:.2}");
        assert!(worst < 4.0 && bias < 1.0, "{name}: {worst} {bias}");
    }
}
