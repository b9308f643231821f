//! The closed forms of stick, of a brake and of two trains, against the independent multiprecision states (data/truth).

mod common;

use common::truth;
use num_rational::BigRational;
use stickslip::model::closed_form::ClosedForm;
use stickslip::model::state::{DIMENSION, TorsionState, index::*};
use stickslip::model::torsion::TorsionModel;
use stickslip::model::trains::Trains;
use stickslip::model::trains::closed_form::ClosedForm as ClosedTrains;
use stickslip::model::trains::system::TrainSystem;
use stickslip::model::{BreakawayTest, Mode, nearest_double};
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
        let parameters = truth(case).parameters;
        let closed = ClosedForm::new(&TorsionModel::new(&parameters));
        let system = TrainSystem::new(&Trains::from(&parameters));
        let trains = ClosedTrains::new(BreakawayTest::Transmitted);
        let trains = trains.of(&system, Mode::Stick).unwrap();
        let events = json["events"].as_array().unwrap();
        let exact = |value: &serde_json::Value| -> BigRational { rational(value.as_str().unwrap()).unwrap() };
        let mut sticks = 0;
        let mut found = [("brake", 0.0f64, 0.0f64), ("two trains", 0.0, 0.0)];
        for pair in events.windows(2).filter(|pair| pair[0]["kind"] == "stick") {
            let at = |name: &str| nearest_double(&exact(&pair[0]["state_after"][name]));
            let mut y: TorsionState = [0.0; DIMENSION];
            y[ROTOR_TWIST] = at("rotor_twist");
            y[STATOR_TWIST] = at("stator_twist");
            y[STATOR_TWIST_RATE] = at("phi1_dot");
            y[ROTOR_SPEED] = at("theta_dot");
            y[ROTOR_TWIST_RATE] = y[ROTOR_SPEED] - y[STATOR_TWIST_RATE];
            let duration = nearest_double(&(exact(&pair[1]["time"]) - exact(&pair[0]["time"])));
            let [before, after] = [0, 1].map(|k| exact(&pair[k]["state_after"]["theta_dot"]));
            let change = nearest_double(&(after - before));
            let unit = f64::EPSILON * y[ROTOR_SPEED].abs().log2().floor().exp2();
            let rotor = system.rotor.speed.unwrap();
            let mut start = vec![0.0; system.dimension];
            for (side, twist, rate) in [
                (&system.rotor, y[ROTOR_TWIST], y[ROTOR_TWIST_RATE]),
                (&system.stator, y[STATOR_TWIST], y[STATOR_TWIST_RATE]),
            ] {
                (start[side.twists], start[side.twists + 1]) = (twist, rate);
            }
            start[rotor] = y[ROTOR_SPEED];
            let mut end = start.clone();
            trains.state(&start, [0.0, 0.0], duration, &mut end);
            let ends = [closed.stick(&y, duration)[ROTOR_SPEED], end[rotor]];
            for ((_, sum, worst), end) in found.iter_mut().zip(ends) {
                // Both speeds are within a binade or two: their difference is exact.
                let error = ((end - y[ROTOR_SPEED]) - change) / unit;
                (*sum, *worst) = (*sum + error, worst.max(error.abs()));
            }
            sticks += 1;
        }
        assert!(sticks > 40);
        for (form, sum, worst) in found {
            let bias = sum.abs() / f64::from(sticks).sqrt();
            println!("{name} as {form}: {sticks} sticks, at most {worst:.2} units in the last place, bias {bias:.2}");
            assert!(worst < 4.0 && bias < 1.0, "{name} as {form}: {worst} {bias}");
        }
    }
}
