//! Dry friction problems of the literature, which are built-in cases. The oracle is compared to all known digits, and
//! every kind of method to its stated accuracy.
//!
//! | problem | source | compared with |
//! |---|---|---|
//! | block on a moving belt | Leine, van Campen, de Kraker, van den Steen 1998, doi 10.1023/A:1008289604683 | period, largest deflection, first stick |
//! | y'' + 0.2 y' + 4 sgn y' + y = 2 cos(pi t) | Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.6 | ten switching times |
//! | x'' + x + q sgn x' = cos(beta t) | Den Hartog 1931 | amplitude in closed form |
//! | a block under 8 cos t with a friction of 0.8 9.81 N | its equation, piece by piece | four switching times |
//!
//! Digits beyond those of the publications come from integration with 30 digits, independent of this program.

use crate::common::cases::{attractor, built_in, by, near, parsed, recorded, summary};
use num_rational::BigRational;
use num_traits::Zero;
use std::f64::consts::{PI, TAU};
use std::ops::ControlFlow;
use stickslip::case::{Case, CaseSource};
use stickslip::model::{Mode, nearest_double};
use stickslip::oracle::{self, ExactDouble, OracleOptions, OracleReport, rational};
use stickslip::record::EventKind::{self, Reversal, Slip, Stick};
use stickslip::simulation::Method;

type Real = BigRational;

/// Every kind of method, its relative tolerance, and the accuracy of its times and states. For `series` and `arkode`
/// it is the accuracy stated for the default. For the others it is a thousand times the tolerance, the possible sum of
/// the local errors of some thousand steps.
const METHODS: [(&str, f64, f64); 7] = [
    ("series", 1e-10, 1e-12),
    ("arkode", 1e-10, 1e-9),
    ("cvode", 1e-10, 1e-9),
    ("erk", 1e-12, 1e-9),
    ("esdirk", 1e-12, 1e-9),
    ("cvode-adams", 1e-12, 1e-9),
    ("cvode-bdf", 1e-12, 1e-8),
];

#[derive(Clone)]
struct Known(Real, f64);

/// A printed number, with an uncertainty of one unit of its last digit.
fn known(printed: &str) -> Known {
    let decimals = printed.split_once('.').map_or(0, |(_, decimals)| decimals.len()) as i32;
    Known(rational(printed).unwrap(), 10f64.powi(-decimals))
}

impl Known {
    fn plus(&self, other: &Known, times: i32) -> Known {
        let share = &other.0 * Real::from_integer(times.into());
        Known(&self.0 + share, self.1 + other.1 * f64::from(times))
    }

    #[track_caller]
    fn holds(&self, found: &Real, within: f64) {
        let error = nearest_double(&(found - &self.0)).abs();
        let allowed = self.1 + within;
        assert!(error <= allowed, "off by {error:.1e} of {allowed:.1e}");
    }
}

/// An event, its time, and the position of the stator at that time, if known.
type Expected = (EventKind, Known, Option<Known>);

fn exact(number: &ExactDouble) -> Real {
    number.to_rational().unwrap()
}

fn double(number: f64) -> Real {
    Real::from_float(number).unwrap()
}

fn by_oracle(name: &str, settings: &[&str], end: &str, samples: &[Real]) -> OracleReport {
    let case = Case::exact(&CaseSource::built_in(name).unwrap(), &parsed(settings)).unwrap();
    let options = OracleOptions {
        digits: 40,
        end_time: rational(end).unwrap(),
        sample_times: samples.to_vec(),
        threshold: case.threshold,
        ..OracleOptions::default()
    };
    oracle::run(&case.system, &options, &mut |_| ControlFlow::Continue(())).unwrap()
}

/// Compares a run of the oracle and runs of all methods with the events of a case up to `end` (s). If the run begins
/// at the limit of stick, some methods report the immediate slip as an event.
fn hold(name: &str, settings: &[&str], end: &str, expected: &[Expected]) {
    let compare = |what: &str, found: Vec<(EventKind, Real, Real)>, within: f64| {
        let late = |event: &&(EventKind, Real, Real)| nearest_double(&event.1) > 1e-9;
        let found: Vec<_> = found.iter().filter(late).collect();
        let kinds: Vec<EventKind> = found.iter().map(|event| event.0).collect();
        let wanted: Vec<EventKind> = expected.iter().map(|event| event.0).collect();
        assert_eq!(kinds, wanted, "{name} by {what}");
        for ((_, time, position), (_, at, place)) in found.into_iter().zip(expected) {
            at.holds(time, within);
            if let Some(place) = place {
                place.holds(position, within);
            }
        }
    };
    let events = by_oracle(name, settings, end, &[]).events;
    let place = |event: &oracle::OracleEvent| event.state.stator_twist.first().map_or(Real::zero(), exact);
    let found = events
        .iter()
        .map(|event| (event.kind, exact(&event.time), place(event)));
    compare("the oracle", found.collect(), 0.0);
    for (method, rtol, within) in METHODS {
        let mut case = by(&built_in(name, settings), Method::from_name(method).unwrap());
        case.solver.rtol = rtol;
        case.output.end_time = end.parse().unwrap();
        let events = recorded(&case).events;
        let found = events
            .iter()
            .map(|event| (event.kind, double(event.time), double(event.before.phi1)));
        compare(method, found.collect(), within);
    }
}

/// m = k = 1, v_dr = 0.2, F = F_s / (1 + 3 |v_rel|), F_s = 1: from the first slip, as in the paper, and from a slack
/// spring, 5 s earlier. At x = 1 the holding force is exactly at its limit, and the automaton must release the
/// contact.
#[test]
fn published_belt_of_leine_et_al() {
    const LARGEST: &str = "1.133944676441656840";
    let (slip, period) = (known("4.295999525480154883"), known("12.00103129483057865"));
    let restick = known("-0.5410063538700847527");
    for (settings, start) in [(&["initial.stator_twist=1"][..], "0"), (&[][..], "5")] {
        let start = Known(rational(start).unwrap(), 1e-36);
        let first = (start.0 != Real::zero()).then(|| (Slip, start.clone(), None));
        let cycles = (0..8).flat_map(|cycle| {
            let begun = start.plus(&period, cycle);
            [
                (Stick, begun.plus(&slip, 1), Some(restick.clone())),
                (Slip, begun.plus(&period, 1), None),
            ]
        });
        let mut expected: Vec<Expected> = first.into_iter().chain(cycles).collect();
        expected.retain(|(_, time, _)| time.0 < rational("99").unwrap());
        hold("belt-leine", settings, "99", &expected);
    }
    for (method, within) in [(Method::Series, 1e-12), (Method::Arkode, 1e-9)] {
        let summary = summary(&by(&built_in("belt-leine", &[]), method));
        let attractor = attractor(&summary);
        near(attractor.period, nearest_double(&period.0), within / 7.0);
        assert_eq!((attractor.sticks, attractor.sections), (1, 1));
        // `series` integrates the period again, whatever the method.
        near(
            attractor.extremes.as_ref().unwrap().position.1,
            LARGEST.parse().unwrap(),
            within,
        );
    }
    // The oracle finds the zero of x' by the secant method.
    let speed = |t: &Real| {
        let report = by_oracle("belt-leine", &["initial.stator_twist=1"], "3", std::slice::from_ref(t));
        let state = &report.samples[0].1;
        (exact(&state.stator_speed[0]), exact(&state.stator_twist[0]))
    };
    let (mut a, mut b) = (rational("1").unwrap(), rational("1.5").unwrap());
    let mut at_a = speed(&a).0;
    let largest = loop {
        let (at_b, x) = speed(&b);
        let change = &at_b * (&b - &a) / (&at_b - &at_a);
        if nearest_double(&change).abs() < 1e-14 {
            break x;
        }
        let next = exact(&ExactDouble::from_rational(&(&b - change), 128));
        (a, at_a, b) = (b, at_b, next);
    };
    known(LARGEST).holds(&largest, 0.0);
}

/// Explicit codes replace the stick by a steep slope. At 1 mm/s, regularised friction shortens Leine's period by 5.9 %
/// (arc tangent) and 0.84 % (hyperbolic tangent).
#[test]
fn published_regularised_belts_have_shorter_periods() {
    for (name, period, percent) in [
        ("belt-leine-arctan", 11.298_150_66, "5.9"),
        ("belt-leine-tanh", 11.900_599_94, "0.84"),
    ] {
        let report = by_oracle(name, &[], "40", &[]);
        assert!(report.events.iter().all(|event| event.mode_after == Mode::Engaged));
        let slips: Vec<_> = report.events.iter().filter(|event| event.kind == Slip).collect();
        let [.., before, last] = &slips[..] else {
            panic!("two slips")
        };
        // The published values have eight decimals.
        near(last.time.minus(&before.time), period, 5.1e-9);
        for method in [Method::Series, Method::Arkode] {
            let found = attractor(&summary(&by(&built_in(name, &[]), method))).period;
            near(found, period, 5.1e-9);
            let short = 100.0 * (1.0 - found / 12.001_031_294_830_578);
            let digits = percent.len() - 2;
            assert_eq!(format!("{short:.digits$}"), percent);
        }
    }
}

fn switching(times: &[(EventKind, &str)]) -> Vec<Expected> {
    times.iter().map(|(kind, time)| (*kind, known(time), None)).collect()
}

#[test]
fn published_block_under_a_harmonic_force() {
    let expected = switching(&[
        (Stick, "0.33860818467198061736"),
        (Slip, "2.946346791223862957"),
        (Stick, "3.532834608886999449"),
        (Slip, "6.087939444813656195"),
    ]);
    hold("block", &[], "6.5", &expected);
    for method in [Method::Series, Method::Arkode] {
        let summary = summary(&by(&built_in("block", &[]), method));
        near(attractor(&summary).period, TAU, 1e-13);
        assert_eq!(attractor(&summary).sticks, 2);
    }
}

#[test]
fn published_dry_friction_of_hairer_norsett_wanner() {
    let expected = switching(&[
        (Reversal, "0.5628053252453"),
        (Stick, "2.0352004340435"),
        (Slip, "2.6281267558097"),
        (Stick, "3.7271965227420"),
        (Slip, "4.6848821753725"),
        (Stick, "5.6179464655653"),
        (Slip, "6.7193536862180"),
        (Stick, "7.5513518942033"),
        (Slip, "8.7436750797238"),
        (Stick, "9.5042427407817"),
    ]);
    hold("hairer", &[], "10", &expected);
}

/// X = sqrt(V^2 - q^2 U^2), V = 1/(1 - beta^2), U = sin(pi/beta)/(beta (1 + cos(pi/beta))), with reversals every
/// pi/beta. The run starts at the turning point of the periodic motion, whose phase has cosine X/V and sine -q U/V.
/// The start is rounded to doubles, so the motion is periodic up to the growth of this rounding. From rest, 400 half
/// periods leave nothing of the start: each reversal multiplies the deviation of the speed by the ratio of the
/// accelerations after and before it, which is below 1.
#[test]
fn published_steady_motion_of_den_hartog() {
    for (beta, q, printed) in [
        (0.5, 0.3, 1.333_333_333_333),
        (2.0, 0.3, 0.297_676_184_992),
        (0.8, 0.4, 2.501_787_881_002),
        (1.5, 0.5, 0.553_774_924_195),
        (0.6, 0.3, 1.535_601_809_281),
    ] {
        let half = PI / beta;
        let v = 1.0 / (1.0 - beta * beta);
        let u = match beta {
            0.5 => 0.0,
            _ => half.sin() / (beta * (1.0 + half.cos())),
        };
        let amplitude = f64::sqrt(v * v - q * q * u * u);
        near(amplitude, printed, 6e-13);
        let start = |twist: f64| {
            vec![
                format!("stator.torque.angular_frequency={beta:e}"),
                format!("friction.kinetic={q:e}"),
                format!("friction.breakaway={q:e}"),
                format!("initial.stator_twist={twist:e}"),
                format!("stator.torque.phase={:e}", f64::atan2(-q * u / v, amplitude / v)),
            ]
        };
        let periodic = start(amplitude);
        let periodic: Vec<&str> = periodic.iter().map(String::as_str).collect();
        let count = (100.0 / half) as usize;
        let expected: Vec<Expected> = (1..=count)
            .map(|k| {
                let place = if k % 2 == 0 { amplitude } else { -amplitude };
                (
                    Reversal,
                    Known(double(k as f64 * half), 1e-12),
                    Some(Known(double(place), 1e-12)),
                )
            })
            .collect();
        let end = format!("{}", (count as f64 + 0.5) * half);
        hold("den-hartog", &periodic, &end, &expected);
        for method in [Method::Series, Method::Arkode] {
            let summary = summary(&by(&built_in("den-hartog", &periodic), method));
            let attractor = attractor(&summary);
            near(attractor.period, TAU / beta, 1e-12);
            assert_eq!(attractor.sticks, 0);
            let found = attractor.extremes.as_ref().unwrap().amplitude.unwrap();
            near(found, amplitude, 1e-12);
            near(found, printed, 2e-12);
        }
        // For beta = 1/2 no steady motion attracts strictly, so the motion keeps its start.
        if beta != 0.5 {
            let settings = start(0.0);
            let settings: Vec<&str> = settings.iter().map(String::as_str).collect();
            let mut case = by(&built_in("den-hartog", &settings), Method::Arkode);
            case.output.end_time = 400.5 * half;
            let events = recorded(&case).events;
            for pair in events[events.len() - 6..].windows(2) {
                assert_eq!(pair[0].kind, Reversal, "beta {beta}");
                near(pair[1].time - pair[0].time, half, 2e-12);
                near(pair[1].before.phi1.abs(), printed, 2e-12);
                assert!(pair[0].before.phi1 * pair[1].before.phi1 < 0.0, "beta {beta}");
            }
        }
    }
}
