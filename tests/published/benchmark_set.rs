//! Answers of the benchmark set (benchmarks), compared with closed forms, published values and an independent code
//! with 30 digits. `benchmark_set --check` verifies that the oracle gives these answers.

use crate::common::json::*;
use num_rational::BigRational;
use num_traits::{One, Zero};
use std::path::{Path, PathBuf};
use stickslip::compare::benchmark::{ProblemSet, SummaryOf};
use stickslip::oracle::{decimal, rational};

fn folder(problem: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("benchmarks").join(problem)
}

fn column(problem: &str, table: &str, name: &str) -> Vec<String> {
    let mut reader = csv::Reader::from_path(folder(problem).join(table)).unwrap();
    let headers = reader.headers().unwrap();
    let index = headers.iter().position(|known| known == name).unwrap();
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

fn summary(problem: &str, name: &str) -> String {
    let text = std::fs::read_to_string(folder(problem).join("summary.json")).unwrap();
    let line = text
        .lines()
        .find(|line| line.contains(&format!("\"name\": \"{name}\"")))
        .unwrap();
    let (_, rest) = line.split_once("\"value\": ").unwrap();
    rest.split(',').next().unwrap().to_owned()
}

/// Asserts that the written number is `exact` rounded to its digits.
fn is(written: &str, exact: &BigRational) {
    let digits = written
        .trim_start_matches(['-', '0', '.'])
        .chars()
        .filter(char::is_ascii_digit)
        .count();
    assert_eq!(number(written), number(&decimal(exact, digits)), "{written}");
}

/// Asserts that a number agrees with a published one within half a unit of the published last digit.
fn begins(written: &str, published: &str) {
    let places = published.split_once('.').map_or(0, |(_, fraction)| fraction.len()) as i32;
    let unit = number(&format!("1e-{places}"));
    let distance = number(written) - number(published);
    assert!(&distance + &distance <= unit, "{written} for {published}");
    assert!(-(&distance + &distance) <= unit, "{written} for {published}");
}

/// pi with more digits than any answer.
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
    let found = (times("02-incline-holds").len(), times("03-incline-slides").len());
    assert_eq!(found, (0, 0));
    assert!(column("02-incline-holds", "samples.csv", "x").iter().all(|x| x == "0"));
    // A thousandth of 0.8 x 9.81 N accelerates 1 kg.
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

/// At the start of a slip the force is at its limit, which depends only on time.
#[test]
fn analytic_blocks_break_away_at_their_limit() {
    type Limit = fn(f64) -> f64;
    let problems: [(&str, Limit); 3] = [
        ("04-block", |_| 0.8 * 9.81),
        ("05-varying-load", |t| 0.8 * (9.81 + 4.905 * (3.0 * t).sin())),
        ("06-static-friction", |_| 0.8 * 9.81),
    ];
    for (problem, limit) in problems {
        let mut slips = 0;
        for (time, kind) in times(problem).iter().zip(column(problem, "events.csv", "kind")) {
            let time: f64 = time.parse().unwrap();
            if kind == "slip" {
                let excess = (8.0 * time.cos()).abs() - limit(time);
                assert!(excess.abs() < 1e-13, "{problem} at {time}: {excess:e}");
                slips += 1;
            }
        }
        assert!(slips >= 15, "{problem}: {slips}");
    }
}

/// The contact of a mass on a belt opens and closes. The belt stretches the spring until the force reaches the limit.
#[test]
fn analytic_a_contact_that_opens_breaks_away_at_its_limit() {
    let time: f64 = times("20-release")[0].parse().unwrap();
    let excess = 100.0 * (0.02 + 0.1 * time) - 0.4 * (9.0 + 10.0 * (6.0 * time).cos());
    assert!(excess.abs() < 1e-13, "{excess:e}");
    assert_eq!(column("20-release", "events.csv", "kind")[0], "slip");
}

/// Ten switching times of the oscillator of Hairer, Norsett and Wanner, as in the test of the built-in case.
#[test]
fn published_hairers_oscillator_switches_when_it_should() {
    let known = [
        "0.5628053252453",
        "2.0352004340435",
        "2.6281267558097",
        "3.7271965227420",
        "4.6848821753725",
        "5.6179464655653",
        "6.7193536862180",
        "7.5513518942033",
        "8.7436750797238",
        "9.5042427407817",
    ];
    for (found, known) in times("08-hairer").iter().zip(known) {
        begins(found, known);
    }
}

/// A sample at the time of an event is the state right after the event, in particular after a kick.
#[test]
fn property_samples_at_events_are_the_states_after_them() {
    let set = ProblemSet::open(&folder("")).unwrap();
    let mut met = 0;
    for problem in &set.problems {
        let (events, samples) = (times(&problem.name), column(&problem.name, "samples.csv", "time"));
        for (row, event) in samples.iter().enumerate().filter_map(|(row, time)| {
            let event = events.iter().position(|event| event == time)?;
            Some((row, event))
        }) {
            for one in &problem.columns {
                let [after, sample] =
                    ["events.csv", "samples.csv"].map(|table| column(&problem.name, table, &one.name));
                assert_eq!(after[event], sample[row], "{} at {}", problem.name, samples[row]);
            }
            met += 1;
        }
    }
    assert!(met > 0);
    assert_eq!(
        column("19-kick", "samples.csv", "v")[20],
        column("19-kick", "events.csv", "v")[0]
    );
}

#[test]
fn property_statements_name_what_the_files_have() {
    let set = ProblemSet::open(&folder("")).unwrap();
    for problem in &set.problems {
        let text = std::fs::read_to_string(folder(&problem.name).join("README.md")).unwrap();
        let (_, tables) = text.split_once("## What to compute").unwrap();
        let (tables, _) = tables.split_once("\n## ").unwrap();
        let rows = tables
            .lines()
            .filter_map(|line| line.strip_prefix("| `")?.split_once('`'));
        let mut named: Vec<&str> = rows.map(|(name, _)| name).filter(|name| *name != "time").collect();
        let columns = problem.columns.iter().map(|column| column.name.as_str());
        let mut there: Vec<&str> = columns
            .chain(problem.summary.iter().map(|one| one.name.as_str()))
            .collect();
        named.sort_unstable();
        there.sort_unstable();
        assert_eq!(named, there, "{}", problem.name);
    }
}

#[test]
fn published_leines_belt_and_its_regularised_cousins() {
    let problem = "10-belt-leine";
    begins(&summary(problem, "slip"), "4.295999525480154883");
    begins(&summary(problem, "period"), "12.00103129483057865");
    begins(&summary(problem, "largest_position"), "1.1339446764416568");
    begins(&summary("11-belt-tanh", "period"), "11.90059994");
    begins(&summary("12-belt-arctan", "period"), "11.29815066");
}

#[test]
fn analytic_a_clutch_locks() {
    let problem = "15-clutch";
    // The torque rises to 150 N m within 0.5 s. 200 rad/s + (80 t - T t)/0.2 equals T t/1.5, where T t lacks the part
    // lost in the ramp.
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

/// data/truth is from another code in another language.
#[test]
fn multiprecision_the_brake_has_the_events_of_an_independent_code() {
    for (problem, truth) in [("22-brake", "si-kick"), ("23-brake-unperturbed", "si-unperturbed")] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("data/truth/{truth}.json"));
        let truth: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
        let truth = truth["events"].list();
        let (found, kinds) = (times(problem), column(problem, "events.csv", "kind"));
        assert_eq!(found.len(), truth.len(), "{problem}");
        for ((found, kind), truth) in found.iter().zip(kinds).zip(truth) {
            assert_eq!(kind, truth["kind"].text());
            is(found, &number(truth["time"].text()));
        }
    }
}

/// The brake from its kick has the same sequence. Only the rounding of the state at the kick, times e^8, differs.
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
        assert!(distance < number("2e-12"), "{late} and {early}");
    }
}

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
                assert!(distance < number("1e-18"), "{} {}", problem.name, one.name);
                assert!(distance > number("-1e-18"), "{} {}", problem.name, one.name);
                checked += 1;
            }
        }
    }
    assert!(checked > 40, "{checked}");
}
