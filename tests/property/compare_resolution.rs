//! Samples without error: the findings of `compare` are within the stated bounds, and no cause is named.

use crate::common::cases::built_in;
use crate::common::compare::{self, causes};
use std::fmt::Write;

use stickslip::compare::Comparison;
use stickslip::results::ResultFile;
use stickslip::simulation::OutputWindow;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Digits {
    /// All digits of a double.
    All,
    Nine,
    SixDecimals,
}

impl Digits {
    fn print(self, value: f64) -> String {
        match self {
            Digits::All => format!("{value:?}"),
            Digits::Nine => format!("{value:.8e}"),
            Digits::SixDecimals => format!("{value:.6}"),
        }
    }
}

/// A case, the sampled window (s), and sampling intervals (s): a twentieth of the natural period, and others.
struct Sampled {
    case: &'static str,
    window: (f64, f64),
    intervals: &'static [f64],
}

const fn sampled(case: &'static str, window: (f64, f64), intervals: &'static [f64]) -> Sampled {
    Sampled {
        case,
        window,
        intervals,
    }
}

const CASES: [Sampled; 16] = [
    sampled("paper", (6.97, 6.99), &[1.2e-5, 2.5e-6]),
    sampled("paper-si", (6.97, 6.99), &[1.2e-5]),
    sampled("unperturbed", (6.97, 7.01), &[1.2e-5]),
    sampled("release", (0.0, 1.2), &[1.2e-5]),
    sampled("belt-coulomb", (0.0, 10.0), &[0.3, 1e-2, 5e-4]),
    sampled("belt-leine", (0.0, 100.0), &[0.3, 1e-2]),
    sampled("belt-leine-arctan", (0.0, 100.0), &[1e-2]),
    sampled("belt-leine-tanh", (0.0, 100.0), &[1e-2]),
    sampled("belt-exponential", (0.0, 10.0), &[0.03, 1e-2, 5e-4]),
    sampled("block", (0.0, 50.0), &[0.3, 1e-2]),
    sampled("hairer", (0.0, 10.0), &[1e-2, 5e-4]),
    sampled("den-hartog", (0.0, 100.0), &[0.3, 1e-2]),
    sampled("groan", (0.0, 2.0), &[2e-3, 5e-4]),
    sampled("drill-string", (0.0, 100.0), &[0.3, 1e-2]),
    sampled("clutch", (0.0, 2.0), &[1e-2, 5e-4]),
    sampled("lugre-slider", (0.0, 30.0), &[1e-2, 5e-4]),
];

/// Columns of the state of any case, and the relative velocity.
fn columns_of_state(file: &ResultFile) -> Vec<String> {
    let short = [
        "rotor_twist",
        "rotor_twist_rate",
        "phi1",
        "phi1_dot",
        "theta_dot",
        "bristle_deflection",
        "normal_force",
    ];
    let of_parts = |side: &str| -> Vec<String> {
        let names = (0..20).flat_map(|k| [format!("twist_{k}"), format!("twist_rate_{k}"), format!("speed_{k}")]);
        names.map(|name| format!("{side}_{name}")).collect()
    };
    let all = short.map(str::to_owned).into_iter();
    let all = all.chain(of_parts("rotor"));
    let all = all.chain(of_parts("stator")).chain(["relative_velocity".to_owned()]);
    all.filter(|name| file.column(name, 0..0).is_ok()).collect()
}

/// Some columns of a run with samples at one interval in a window.
fn samples(sampled: &Sampled, interval: f64) -> (Vec<String>, Vec<Vec<f64>>) {
    let mut case = built_in(sampled.case, &["output.around=none"]);
    let (from, to) = sampled.window;
    case.output.interval = case.output.end_time;
    case.output.windows = vec![OutputWindow { from, to, interval }];
    let run = compare::kept(&case);
    let state = columns_of_state(&ResultFile::open(&run.path).unwrap());
    let mut columns = run.columns(&state.iter().map(String::as_str).collect::<Vec<_>>());
    let names = [vec!["time".to_owned()], state].concat();
    let rows = 0..columns[0].len();
    let kept: Vec<usize> = rows.filter(|&k| (from..=to).contains(&columns[0][k])).collect();
    for column in &mut columns {
        *column = kept.iter().map(|&k| column[k]).collect();
    }
    (names, columns)
}

/// These columns suffice to find events without the state.
const VELOCITY_AND_FORCE: [&str; 2] = ["relative_velocity", "normal_force"];

fn csv((names, columns): &(Vec<String>, Vec<Vec<f64>>), digits: Digits, kept: impl Fn(&str) -> bool) -> String {
    let places: Vec<usize> = (0..names.len()).filter(|&k| k == 0 || kept(&names[k])).collect();
    let header: Vec<&str> = places.iter().map(|&k| names[k].as_str()).collect();
    let mut text = header.join(",") + "\n";
    for (row, time) in columns[0].iter().enumerate() {
        let others = places[1..].iter().map(|&k| digits.print(columns[k][row]));
        let values: Vec<String> = std::iter::once(digits.print(*time)).chain(others).collect();
        writeln!(text, "{}", values.join(",")).unwrap();
    }
    text
}

/// For a single mass without a shaft, no sample shows when a stick began: its speed is zero from then on.
const WITHOUT_MEMORY: [&str; 2] = ["block", "clutch"];

/// Result of a comparison, as a line of the table in docs/reference/compare.md.
fn line(sampled: &Sampled, interval: f64, digits: Digits, whole: bool, c: &Comparison) -> String {
    let bounds: Vec<f64> = sorted(c.event_errors.events.iter().map(|event| event.bound));
    let channels = if whole { "state" } else { "omega_r" };
    format!(
        "{:17} {interval:.1e} s {digits:?}, {channels}: {} of {} events, largest error {:.1e} s, bounds {:.1e} to {:.1e} s",
        sampled.case,
        c.event_errors.matched,
        c.reference_events,
        c.event_errors.max.unwrap_or(0.0),
        bounds[bounds.len() / 2],
        bounds[bounds.len() - 1],
    )
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

/// Every event is within its bound, and no cause is named. Events that samples miss are shorter than their interval.
#[test]
fn property_perfect_samples_agree_to_their_resolution() {
    let mut faults = Vec::new();
    for sampled in &CASES {
        let reference = compare::kept(&built_in(sampled.case, &[]));
        for &interval in sampled.intervals {
            let samples = samples(sampled, interval);
            for (digits, whole) in [
                (Digits::All, true),
                (Digits::Nine, true),
                (Digits::SixDecimals, true),
                (Digits::All, false),
            ] {
                let text = csv(&samples, digits, |name| whole || VELOCITY_AND_FORCE.contains(&name));
                let c = reference.compared(&text, |_| {});
                let line = line(sampled, interval, digits, whole, &c);
                println!("{line}");
                let unseen = c.sequence.iter().all(|difference| difference.shorter_than_interval);
                let within = c
                    .event_errors
                    .events
                    .iter()
                    .all(|event| event.error.abs() <= event.bound);
                if !(unseen && within && c.agrees_to_resolution && causes(&c).is_empty()) {
                    faults.push(format!("{line}\n    {}", c.verdict));
                }
                // With the whole state and all digits, at least half of the events are known far better.
                let bounds = sorted(c.event_errors.events.iter().map(|event| event.bound));
                let fine = bounds[bounds.len() / 2] < 1e-2 * interval;
                let finest = sampled.intervals.last() == Some(&interval);
                if digits == Digits::All && whole && finest && !fine && !WITHOUT_MEMORY.contains(&sampled.case) {
                    faults.push(format!("{line}\n    known to no less than the interval"));
                }
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
