//! The signals of trains against closed forms, and their stated properties against their own values.

use crate::common::systems::{self, wave};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

use num_rational::BigRational;
use num_traits::ToPrimitive;
use proptest::prelude::*;
use stickslip::signal::{Drive, Frequency, HarmonicShape, Timeline, Wave};

fn ramp(value: f64, rise_time: f64) -> Drive {
    Drive::Linear(systems::ramp(value, rise_time))
}

fn table(time: &[f64], value: &[f64]) -> Drive {
    Drive::Linear(systems::table(time, value))
}

#[test]
fn analytic_a_timeline_has_the_corners_of_all_its_drives_once() {
    let mut gated = wave(HarmonicShape::Sine, 1.0, Frequency::Cycles(1.0), 0.0);
    (gated.from, gated.to) = (Some(1.0), Some(3.0));
    let drives = [
        ramp(2.0, 1.0),
        Drive::Sum(vec![Drive::Wave(gated), table(&[-1.0, 0.0, 2.0], &[0.0, 1.0, 5.0])]),
        Drive::Value(7.0),
    ];
    let timeline = Timeline::new(&drives.iter().collect::<Vec<_>>());
    assert_eq!(timeline.corners(), [1.0, 2.0, 3.0]);
    let found = [0.0, 0.5, 1.0, 2.5, 3.0, 9.0].map(|t| timeline.stretch(t));
    assert_eq!(found, [0, 0, 1, 2, 3, 3]);
    let found = (0..4).map(|k| timeline.fastest(k)).collect::<Vec<_>>();
    assert_eq!(found, [0.0, TAU, TAU, 0.0]);
    let found = (timeline.start(1), timeline.end(1), timeline.end(3));
    assert_eq!(found, (1.0, 2.0, f64::INFINITY));
    // Beyond the end of its stretch a ramp continues.
    assert_eq!((timeline.value(0, 0, 1.5), timeline.value(0, 1, 1.5)), (3.0, 2.0));
    assert_eq!((timeline.slope(1, 0, 0.5), timeline.slope(1, 2, 2.0)), (2.0, TAU));
}

#[test]
fn analytic_harmonics_are_sine_and_cosine() {
    for (shape, of) in [
        (HarmonicShape::Sine, f64::sin as fn(f64) -> f64),
        (HarmonicShape::Cosine, f64::cos),
    ] {
        for phase in [0.0, 0.4, -FRAC_PI_2] {
            let drive = Drive::Wave(Wave {
                mean: 0.5,
                ..wave(shape, 3.0, Frequency::Angular(7.0), phase)
            });
            let timeline = Timeline::new(&[&drive]);
            for t in [0.0, 0.1, 1.0, 10.0] {
                // 3 times some roundings of an argument up to 70.
                assert!((timeline.value(0, 0, t) - 0.5 - 3.0 * of(7.0 * t + phase)).abs() < 5e-14);
            }
        }
    }
}

/// A harmonic whose frequency in cycles is a whole number returns to its start at each whole second, however late.
#[test]
fn analytic_late_harmonics_keep_their_phase() {
    let drive = Drive::Wave(wave(HarmonicShape::Sine, 1.0, Frequency::Cycles(50.0), 0.3));
    let timeline = Timeline::new(&[&drive]);
    for t in [0.0, 1.0, 1e3, 86_400.0, 1e5, 1e9] {
        assert_eq!(timeline.value(0, 0, t), 0.3f64.sin());
        assert_eq!(timeline.slope(0, 0, t), TAU * 50.0 * 0.3f64.cos());
    }
}

#[test]
fn analytic_integrals_are_the_antiderivatives() {
    let sine = Drive::Wave(wave(HarmonicShape::Sine, 2.0, Frequency::Angular(3.0), 0.0));
    let cosine = Drive::Wave(wave(HarmonicShape::Cosine, 2.0, Frequency::Cycles(0.5), 0.7));
    let sum = Drive::Sum(vec![ramp(4.0, 2.0), Drive::Value(1.0)]);
    let timeline = Timeline::new(&[&sine, &cosine, &sum]);
    for t in [0.0, 0.01, 1.0, 2.0, 31.4] {
        assert!((timeline.integral(0, t) - 2.0 / 3.0 * (1.0 - (3.0 * t).cos())).abs() < 1e-13);
        assert!((timeline.integral(1, t) - 2.0 / PI * ((PI * t + 0.7).sin() - 0.7f64.sin())).abs() < 1e-13);
        let rise = if t < 2.0 { t * t } else { 4.0 + 4.0 * (t - 2.0) };
        assert!((timeline.integral(2, t) - rise - t).abs() < 1e-13);
    }
    // Whole turns add nothing, however many there have been.
    assert_eq!(timeline.integral(1, 1e9), 0.0);
}

#[test]
fn analytic_a_number_goes_by_the_path_of_its_key() {
    let drive = Drive::Sum(vec![
        Drive::Value(1.0),
        table(&[0.0, 1.0], &[2.0, 3.0]),
        Drive::Sum(vec![Drive::Wave(wave(
            HarmonicShape::Sine,
            1.0,
            Frequency::Cycles(2.0),
            0.0,
        ))]),
    ]);
    let mut of_chirp = Vec::new();
    let same = chirp(SWEEPS[0]).try_map(|path, value| {
        of_chirp.push(path.to_owned());
        Ok::<f64, ()>(*value)
    });
    assert_eq!(same.unwrap(), chirp(SWEEPS[0]));
    let keys = [
        "mean",
        "amplitude",
        "start_frequency",
        "end_frequency",
        "duration",
        "phase",
    ];
    assert_eq!(of_chirp, keys);
    let mut paths = Vec::new();
    let same = drive.try_map(|path, value| {
        paths.push(path.to_owned());
        Ok::<f64, ()>(*value)
    });
    assert_eq!(same.unwrap(), drive);
    let wave = ["mean", "amplitude", "frequency", "phase"].map(|key| format!("signals.2.signals.0.{key}"));
    let others = [
        "signals.0",
        "signals.1.time.0",
        "signals.1.time.1",
        "signals.1.value.0",
        "signals.1.value.1",
    ];
    let values = others.iter().map(|&path| path.to_owned());
    let expected = values.chain(wave).collect::<Vec<_>>();
    assert_eq!(paths, expected);
    Drive::Value(1.0)
        .try_map(|path, _| {
            assert_eq!(path, "");
            Ok::<f64, ()>(0.0)
        })
        .unwrap();
}

/// Frequencies at the start and end of a sweep, Hz, and its duration, s.
const SWEEPS: [(f64, f64, f64); 6] = [
    (0.7, 41.3, 3.1),
    (41.3, 0.7, 3.1),
    (1e-3, 250.0, 0.3),
    (1e-3, 12.0, 0.02),
    (7.0, 7.000001, 11.0),
    (300.0, 900.0, 60.0),
];

fn chirp((start, end, duration): (f64, f64, f64)) -> Drive {
    let frequency = Frequency::Sweep { start, end, duration };
    Drive::Wave(Wave {
        mean: 0.25,
        ..wave(HarmonicShape::Sine, 3.0, frequency, 0.4)
    })
}

/// The turns of a chirp in exact arithmetic, less the whole ones, and the frequency (Hz).
fn exact_turns((start, end, duration): (f64, f64, f64), t: f64) -> (f64, f64) {
    let [start, end, duration, t] = [start, end, duration, t].map(|x| BigRational::from_float(x).unwrap());
    let two = BigRational::from_integer(2.into());
    let slope = (&end - &start) / &duration;
    let (turns, frequency) = if t < duration {
        (&t * (&start + &slope * &t / two), &start + slope * &t)
    } else {
        (&end * &t - &slope * &duration * &duration / two, end)
    };
    let rest = &turns - turns.round();
    (rest.to_f64().unwrap(), frequency.to_f64().unwrap())
}

#[test]
fn analytic_chirps_are_sines_of_the_exact_turns() {
    for sweep in SWEEPS {
        let drive = chirp(sweep);
        let timeline = Timeline::new(&[&drive]);
        let (start, end, duration) = sweep;
        assert_eq!(timeline.corners(), [duration]);
        assert_eq!([0, 1].map(|k| timeline.fastest(k)), [TAU * start.max(end), TAU * end]);
        for share in [0.0, 0.1, 0.37, 0.5, 0.99, 1.0, 1.7, 12.3, 1e3, 1e7] {
            let t = share * duration;
            let stretch = timeline.stretch(t);
            let (turns, frequency) = exact_turns(sweep, t);
            let (sine, cosine) = (TAU * turns + 0.4).sin_cos();
            let (value, slope) = (timeline.value(0, stretch, t), timeline.slope(0, stretch, t));
            assert!((value - 0.25 - 3.0 * sine).abs() < 8e-15, "{sweep:?} at {t}");
            let scale = 3.0 * TAU * frequency;
            assert!((slope - scale * cosine).abs() < 4e-15 * scale, "{sweep:?} at {t}");
        }
        // No jump at the end of the sweep.
        assert_eq!(timeline.value(0, 0, duration), timeline.value(0, 1, duration));
        let slopes = [0, 1].map(|stretch| timeline.slope(0, stretch, duration));
        assert_eq!(slopes[0], slopes[1]);
    }
}

/// sin(phi0 + omega tau + a tau^2/2) is the product of the series of both exponentials.
#[test]
fn analytic_series_of_chirps_are_products_of_exponentials() {
    for sweep in SWEEPS {
        let (start, end, duration) = sweep;
        let timeline = Timeline::new(&[&chirp(sweep)]);
        for share in [0.0, 0.2, 0.9, 1.0, 2.0] {
            let t = share * duration;
            let stretch = timeline.stretch(t);
            let (turns, frequency) = exact_turns(sweep, t);
            let acceleration = if stretch == 0 {
                TAU * (end - start) / duration
            } else {
                0.0
            };
            let unit = 0.7 / (TAU * start.max(end)).max(acceleration.abs().sqrt());
            let (a, b) = (TAU * frequency * unit, acceleration * unit * unit / 2.0);
            let mut found = [0.0; 20];
            timeline.series(0, stretch, t, unit, &mut found);
            for (n, found) in found.into_iter().enumerate() {
                // Over k: a^(n-2k) b^k i^(n-k) / ((n-2k)! k!).
                let factorial = |n: usize| (1..=n).map(|k| k as f64).product::<f64>();
                let (mut exact, mut size) = (if n == 0 { 0.25 } else { 0.0 }, 0.0);
                for k in 0..=n / 2 {
                    let term =
                        3.0 * a.powi((n - 2 * k) as i32) * b.powi(k as i32) / factorial(n - 2 * k) / factorial(k);
                    exact += term * (TAU * turns + 0.4 + FRAC_PI_2 * (n - k) as f64).sin();
                    size += term.abs();
                }
                assert!(
                    (found - exact).abs() <= 2e-14 * size + f64::EPSILON,
                    "{sweep:?} at {t}: {n}"
                );
            }
        }
    }
}

/// Fresnel's integrals against quadratures of the values.
#[test]
fn analytic_integrals_of_chirps_are_quadratures() {
    for sweep in &SWEEPS[..5] {
        let &(start, end, duration) = sweep;
        let timeline = Timeline::new(&[&chirp(*sweep)]);
        let panel = 0.1 / (TAU * start.max(end));
        let mut sum = 0.0;
        for k in 0..40 {
            let [from, to] = [k, k + 1].map(|k| f64::from(k) * duration / 32.0);
            let stretch = timeline.stretch(from);
            // The error of a panel of 0.1 rad is below rounding.
            let count = ((to - from) / panel).ceil();
            let width = (to - from) / count;
            let parts = (0..count as usize).map(|j| {
                let left = from + j as f64 * width;
                quadrature(left, left + width, |t| timeline.value(0, stretch, t))
            });
            let part: f64 = parts.sum();
            sum += part;
            let scale = 3.0 * duration;
            let found = timeline.integral_from(0, stretch, from, to - from);
            assert!((found - part).abs() < 2e-14 * scale, "{sweep:?}: {k}: {found} {part}");
            let found = timeline.integral(0, to);
            assert!((found - sum).abs() < 1e-13 * scale, "{sweep:?}: {to}: {found} {sum}");
        }
    }
}

fn any_wave() -> impl Strategy<Value = Drive> {
    let frequency = (0..3, 0.1..5.0f64, 0.1..5.0f64, 0.3..5.0f64);
    let frequency = frequency.prop_map(|(kind, frequency, end, duration)| match kind {
        0 => Frequency::Cycles(frequency),
        1 => Frequency::Angular(frequency),
        _ => Frequency::Sweep {
            start: frequency,
            end,
            duration,
        },
    });
    let window = (0.0..2.0f64, 0.1..3.0f64, any::<bool>(), any::<bool>());
    (
        any::<bool>(),
        -1.0..1.0f64,
        -2.0..2.0f64,
        frequency,
        -4.0..4.0f64,
        window,
    )
        .prop_map(
            |(sine, mean, amplitude, frequency, phase, (from, length, begins, ends))| {
                Drive::Wave(Wave {
                    shape: if sine {
                        HarmonicShape::Sine
                    } else {
                        HarmonicShape::Cosine
                    },
                    mean,
                    amplitude,
                    frequency,
                    phase,
                    from: begins.then_some(from),
                    to: ends.then_some(from + length),
                })
            },
        )
}

fn any_drive() -> impl Strategy<Value = Drive> {
    let points = proptest::collection::vec((0.05..1.0f64, -3.0..3.0f64), 1..5);
    let one = prop_oneof![
        (-3.0..3.0f64).prop_map(Drive::Value),
        (-3.0..3.0f64, 0.0..2.0f64).prop_map(|(value, rise_time)| ramp(value, rise_time)),
        (points, -1.0..1.0f64).prop_map(|(points, mut at)| {
            let (mut time, mut value) = (Vec::new(), Vec::new());
            for (after, here) in points {
                at += after;
                time.push(at);
                value.push(here);
            }
            table(&time, &value)
        }),
        any_wave(),
    ];
    one.prop_recursive(2, 6, 3, |inner| {
        proptest::collection::vec(inner, 1..4).prop_map(Drive::Sum)
    })
}

fn quadrature(from: f64, to: f64, value: impl Fn(f64) -> f64) -> f64 {
    const RULE: [(f64, f64); 3] = [
        (0.0, 128.0 / 225.0),
        (0.538_469_310_105_683, 0.478_628_670_499_366_5),
        (0.906_179_845_938_664, 0.236_926_885_056_189_1),
    ];
    let count = ((to - from) / 0.02).ceil().max(1.0);
    let half = (to - from) / count / 2.0;
    let panel = |k: usize| {
        let middle = from + (2 * k + 1) as f64 * half;
        let pair = |(x, w): (f64, f64)| w * (value(middle - half * x) + value(middle + half * x));
        half * (RULE[0].1 * value(middle) + pair(RULE[1]) + pair(RULE[2]))
    };
    (0..count as usize).map(panel).sum()
}

proptest! {
    #[test]
    fn property_series_are_values_and_integrals_are_quadratures(first in any_drive(), second in any_drive(), t in 0.0..6.0f64) {
        let timeline = Timeline::new(&[&first, &second]);
        for (index, drive) in [&first, &second].into_iter().enumerate() {
            let stretch = timeline.stretch(t);
            let mut series = [0.0; 24];
            timeline.series(index, stretch, t, 0.05, &mut series);
            for tau in [-0.05, 0.02, 0.05f64] {
                let sum: f64 = (0..24).map(|n| series[n] * (tau / 0.05).powi(n as i32)).sum();
                // Frequencies are at most 31 rad/s, and change by at most 100 rad/s^2, so that the first omitted term
                // is below 1.8^24/24! of 18, 4e-17. The
                // rest is rounding of values up to some 30, and of arguments up to 200.
                prop_assert!((sum - timeline.value(index, stretch, t + tau)).abs() < 1e-12);
            }
            prop_assert!((series[1] / 0.05 - timeline.slope(index, stretch, t)).abs() < 1e-11);
            let bound = timeline.amplitude(index, stretch, 2) * (1.0 + 1e-12) + 1e-12;
            prop_assert!((2.0 * series[2] / 0.05f64.powi(2)).abs() <= bound);
            prop_assert!(timeline.value(index, stretch, t).abs() <= drive.largest() * (1.0 + 1e-14));

            let mut integral = 0.0;
            for k in 0..=stretch {
                let (from, to) = (timeline.start(k), timeline.end(k).min(t));
                let part = quadrature(from, to, |t| timeline.value(index, k, t));
                prop_assert!((timeline.integral_from(index, k, from, to - from) - part).abs() < 1e-11);
                integral += part;
            }
            // The rule's error is below (31 * 0.02)^10 / 1e10 of the size of a panel.
            prop_assert!((timeline.integral(index, t) - integral).abs() < 1e-11, "{} {}", timeline.integral(index, t), integral);
        }
    }
}
