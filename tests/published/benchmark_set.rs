//! The answers of the benchmark set (benchmarks) against closed forms, published numbers and an independent code with 30 digits.
//! That they are what the oracle says is checked where they are made: `benchmark_set --check`.

use num_rational::BigRational;
use num_traits::{One, Zero};
use std::path::{Path, PathBuf};
use stickslip::compare::benchmark::{ProblemSet, SummaryOf};
use stickslip::oracle::{decimal, rational};

fn folder(problem: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("benchmarks").join(problem)
}

/// The cells of a table by column, as they are written.
fn column(problem: &str, table: &str, name: &str) -> Vec<String> {
    let mut reader = csv::Reader::from_path(folder(problem).join(table)).unwrap();
    let index = reader
        .headers()
        .unwrap()
        .iter()
        .position(|known| known == name)
        .unwrap();
    reader.records().map(|row| row.unwrap()[index].to_owned()).collect()
}

fn times(problem: &str) -> Vec<String> {
    column(problem, "events.csv", "time")
}

fn kinds(problem: &str) -> String {
    column(problem, "events.csv", "kind").join(" ")
}

fn number(text: &str) -> BigRational {
    rational(text).unwrap()
}

/// A number of a problem's summary, as it is written.
fn summary(problem: &str, name: &str) -> String {
    let text = std::fs::read_to_string(folder(problem).join("summary.json")).unwrap();
    let line = text
        .lines()
        .find(|line| line.contains(&format!("\"name\": \"{name}\"")))
        .unwrap();
    let (_, rest) = line.split_once("\"value\": ").unwrap();
    rest.split(',').next().unwrap().to_owned()
}

/// That a number is written as `exact` rounds to its digits.
fn is(written: &str, exact: &BigRational) {
    let digits = written
        .trim_start_matches(['-', '0', '.'])
        .chars()
        .filter(char::is_ascii_digit)
        .count();
    assert_eq!(number(written), number(&decimal(exact, digits)), "{written}");
}

/// That a number begins as a published one, up to half a unit of its last digit.
fn begins(written: &str, published: &str) {
    let places = published.split_once('.').map_or(0, |(_, fraction)| fraction.len()) as i32;
    let unit = number(&format!("1e-{places}"));
    let distance = number(written) - number(published);
    assert!(
        &distance + &distance <= unit && -(&distance + &distance) <= unit,
        "{written} for {published}"
    );
}

/// pi, to more digits than any answer has.
const PI: &str = "3.14159265358979323846264338327950288419716939937511";

#[test]
fn analytic_a_launched_mass_stops_where_it_should() {
    let problem = "01-launched-mass";
    assert_eq!(kinds(problem), "stick");
    is(&times(problem)[0], &(number("3") / number("4.905")));
    is(&summary(problem, "rest_position"), &(number("9") / number("9.81")));
}

#[test]
fn analytic_an_incline_holds_or_lets_go() {
    assert_eq!(
        (times("02-incline-holds").len(), times("03-incline-slides").len()),
        (0, 0)
    );
    assert!(column("02-incline-holds", "samples.csv", "x").iter().all(|x| x == "0"));
    // 0.8 x 9.81 N times a thousandth accelerates 1 kg.
    let acceleration = number("0.007848");
    let times = column("03-incline-slides", "samples.csv", "time");
    for (time, x) in times.iter().zip(column("03-incline-slides", "samples.csv", "x")) {
        let time = number(time);
        is(&x, &(&acceleration * &time * &time / number("2")));
    }
}

#[test]
fn published_a_block_under_a_harmonic_force() {
    let found = times("04-block");
    let known = [
        "0.33860818467198061736",
        "2.946346791223862957",
        "3.532834608886999449",
        "6.087939444813656195",
    ];
    for (found, known) in found.iter().zip(known) {
        begins(found, known);
    }
    assert_eq!(found.len(), 31);
    is(&summary("04-block", "period"), &(number(PI) + number(PI)));
}

#[test]
fn analytic_den_hartogs_oscillator_turns_with_its_force() {
    let problem = "07-den-hartog";
    for (k, time) in (1..).zip(times(problem)) {
        is(&time, &(number(PI) * BigRational::from_integer((2 * k).into())));
    }
    is(&summary(problem, "amplitude"), &(number("4") / number("3")));
}

#[test]
fn analytic_a_belt_with_coulomb_friction_has_a_cycle_in_closed_form() {
    let problem = "09-belt-coulomb";
    // v k/(w D) = 1, whose arc tangent is pi/4.
    is(&summary(problem, "slip"), &(number(PI) * number("0.15")));
    is(&summary(problem, "stick"), &number("0.2"));
    is(&times(problem)[0], &number("0.2"));
    // 0.03 + 0.01 sqrt 2.
    is(
        &summary(problem, "largest_position"),
        &number("0.04414213562373095048801688724209698"),
    );
}

#[test]
fn published_leines_belt_and_its_regularised_cousins() {
    let problem = "10-belt-leine";
    begins(&summary(problem, "slip"), "4.295999525480154883");
    begins(&summary(problem, "period"), "12.00103129483057865");
    begins(&summary(problem, "largest_position"), "1.133944676441656840");
    begins(&summary("11-belt-tanh", "period"), "11.90059994");
    begins(&summary("12-belt-arctan", "period"), "11.29815066");
}

#[test]
fn analytic_a_clutch_locks() {
    let problem = "15-clutch";
    // The torque rises to 150 N m within 0.5 s. 200 rad/s + (80 t - T t)/0.2 meets T t/1.5, T t less what the ramp lacks.
    let lock = number("11") / number("12");
    is(&times(problem)[0], &lock);
    let impulse = number("150") * (&lock - number("0.25"));
    let speed = impulse / number("1.5");
    is(&column(problem, "events.csv", "vehicle_speed")[0], &speed);
    is(&column(problem, "events.csv", "engine_speed")[0], &speed);
}

#[test]
fn analytic_a_kicked_oscillator_swings_by_half_periods() {
    // pi/sqrt(40).
    is(
        &summary("19-kick", "half_swing"),
        &number("0.49672941328980506171727613140371748"),
    );
    assert_eq!(kinds("19-kick"), "reversal reversal reversal reversal stick");
    assert_eq!(times("19-kick")[0], "0.1");
}

/// data/truth is by another code, in another language.
#[test]
fn multiprecision_the_brake_has_the_events_of_an_independent_code() {
    for (problem, truth) in [("22-brake", "si-kick"), ("23-brake-unperturbed", "si-unperturbed")] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("data/truth/{truth}.json"));
        let truth: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
        let truth = truth["events"].as_array().unwrap();
        let (found, kinds) = (times(problem), column(problem, "events.csv", "kind"));
        assert_eq!(found.len(), truth.len(), "{problem}");
        for ((found, kind), truth) in found.iter().zip(kinds).zip(truth) {
            assert_eq!(kind, truth["kind"].as_str().unwrap());
            is(found, &number(truth["time"].as_str().unwrap()));
        }
    }
}

/// The brake from its kick is the brake: only the rounding of the state at the kick, amplified e^14 times, lies between them.
#[test]
fn property_the_brake_from_its_kick_has_the_same_sequence() {
    assert_eq!(kinds("21-brake-from-kick"), kinds("22-brake"));
    let kick = number("6.9697");
    for (late, early) in times("22-brake").iter().zip(times("21-brake-from-kick")) {
        let distance = number(late) - (&kick + number(&early));
        let distance = if distance < BigRational::zero() {
            -distance
        } else {
            distance
        };
        assert!(distance < number("1e-9"), "{late} and {early}");
    }
}

/// Every number of the summaries that follows from events does.
#[test]
fn property_durations_are_differences_of_events() {
    let set = ProblemSet::open(&folder("")).unwrap();
    assert!(set.problems.len() >= 16);
    let mut checked = 0;
    for problem in &set.problems {
        let times: Vec<BigRational> = times(&problem.name).iter().map(|time| number(time)).collect();
        for one in &problem.summary {
            if let SummaryOf::Events { first, last, count } = &one.of {
                let time =
                    |index: i64| usize::try_from(index).map_or(BigRational::zero(), |index| times[index].clone());
                let exact =
                    (time(*last) - time(*first)) / (BigRational::one() * BigRational::from_integer((*count).into()));
                let written = number(&summary(&problem.name, &one.name));
                let distance = (written - &exact) / exact;
                assert!(
                    distance < number("1e-18") && distance > number("-1e-18"),
                    "{} {}",
                    problem.name,
                    one.name
                );
                checked += 1;
            }
        }
    }
    assert!(checked > 40, "{checked}");
}
