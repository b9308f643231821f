//! The comparison finds the changes that were made in a copy of the reference.

use crate::common::cases::near;
use crate::common::compare::{compare, compare_quick, csv, events_csv, paper, rows_of, run, word_of, write};
use crate::common::unlocked;
use stickslip::compare::{Comparison, Detection, Detector, Mapping, Point, Reference};
use stickslip::record::sequence::Fault;
use stickslip::results::ResultFile;

/// Comparison of a copy of the reference with changed values of one variable.
fn changed(variable: &str, change: impl Fn(usize, f64) -> f64) -> Comparison {
    let folder = tempfile::tempdir().unwrap();
    let copy = folder.path().join("copy.h5");
    std::fs::copy(paper(), &copy).unwrap();
    let file = unlocked::open_rw(&copy).unwrap();
    let dataset = file.dataset(variable).unwrap();
    let values = dataset.read_raw::<f64>().unwrap();
    let values = values.into_iter().enumerate();
    let values: Vec<f64> = values.map(|(k, value)| change(k, value)).collect();
    dataset.write(&values).unwrap();
    drop((dataset, file));
    compare(&copy, &Mapping::default())
}

fn word_rows() -> Vec<usize> {
    let events = ResultFile::open(paper()).unwrap().events().unwrap();
    (0..events.len())
        .filter(|&k| events[k].kind.in_event_sequence())
        .collect()
}

fn channel(c: &Comparison, name: &str) -> f64 {
    let channels = c.channels.iter().filter(|row| row.channel == name);
    channels.map(|row| row.max).fold(0.0, f64::max)
}

#[test]
fn property_a_copy_has_no_errors() {
    let c = changed("events/time", |_, t| t);
    assert_eq!(c.event_errors.max, Some(0.0));
    assert!(c.sequence.is_empty() && c.causes.is_empty());
    assert_eq!(c.samples_too_sparse, 0);
    // Rounding of one polynomial: the digits of the largest value of a channel, minus one.
    let channels = c.channels.iter();
    let worst = channels.filter_map(|row| row.scd).fold(f64::INFINITY, f64::min);
    assert!(worst > 12.0, "{:?}", c.channels);
}

#[test]
fn property_the_error_of_one_event_comes_back() {
    let row = word_rows()[11];
    let c = changed("events/time", |k, t| if k == row { t + 3.5e-8 } else { t });
    near(c.event_errors.max.unwrap(), 3.5e-8, 2e-15);
    let off: Vec<_> = c.event_errors.events.iter().filter(|e| e.error != 0.0).collect();
    assert_eq!((off.len(), off[0].position), (1, 11));
    assert!((c.event_errors.rms.unwrap() - 3.5e-8 / 95f64.sqrt()).abs() < 1e-15);
}

#[test]
fn property_the_error_of_one_channel_comes_back() {
    let c = changed("trajectory/rotor_twist", |k, u| if k == 7000 { u + 2e-9 } else { u });
    // The interpolation rounds by 1e-21 rad.
    near(channel(&c, "rotor_twist"), 2e-9, 1e-17);
    assert!(channel(&c, "phi1") < 1e-17);
    let time = ResultFile::open(paper()).unwrap().column("time", 7000..7001).unwrap()[0];
    let channels = c.channels.iter().filter(|row| row.channel == "rotor_twist");
    let worst = channels.max_by(|a, b| a.max.total_cmp(&b.max));
    assert_eq!(worst.unwrap().max_at, time);
}

fn faults(change: impl Fn(&mut Vec<(f64, String)>)) -> Vec<(Fault, &'static str, usize)> {
    let folder = tempfile::tempdir().unwrap();
    let mut word = word_of(paper());
    change(&mut word);
    let c = compare_quick(&write(&folder, "events.csv", &events_csv(&word)), Mapping::default());
    c.sequence.iter().map(|d| (d.fault, d.kind, d.position)).collect()
}

#[test]
fn property_dropped_doubled_swapped_and_renamed_events_are_named() {
    assert_eq!(faults(|_| {}), []);
    // The first and the last event are included.
    for at in [0, 20, 33, 94] {
        let kind = if at % 2 == 0 { "stick" } else { "slip" };
        let dropped = faults(|word| {
            word.remove(at);
        });
        assert_eq!(dropped, [(Fault::Missing, kind, at)]);
        let doubled = faults(|word| {
            let (time, kind) = word[at].clone();
            word.insert(at + 1, (time + 1e-9, kind));
        });
        assert_eq!(doubled.len(), 1);
        assert_eq!((doubled[0].0, doubled[0].1), (Fault::Doubled, kind));
    }
    let renamed = faults(|word| word[20].1 = "reversal".to_owned());
    assert_eq!(renamed, [(Fault::Renamed, "stick", 20)]);
    // The kinds change places, and the times stay in order.
    let swapped = faults(|word| {
        let kind = word[20].1.clone();
        word[20].1 = word[21].1.clone();
        word[21].1 = kind;
    });
    assert_eq!(swapped.len(), 1, "{swapped:?}");
    assert_eq!(swapped[0].0, Fault::Swapped);
}

/// The candidate's own event comes, in time, before each event of the reference, and in its word after some of them.
#[test]
fn property_events_before_the_parting_are_those_of_the_word() {
    let folder = tempfile::tempdir().unwrap();
    let begins = |early: f64, own: f64| {
        let word = word_of(paper());
        let onset = word[0].0;
        let mut word: Vec<(f64, String)> = word.into_iter().map(|(t, kind)| (t - early, kind)).collect();
        let before = word.partition_point(|(t, _)| *t < onset - own);
        word.insert(before, (onset - own, "reversal".to_owned()));
        let c = compare_quick(&write(&folder, "events.csv", &events_csv(&word)), Mapping::default());
        assert_eq!((c.sequence[0].fault, c.sequence[0].position), (Fault::Spurious, before));
        assert!(c.sequence[0].time < onset && before > 0);
        (before, c.summary[0].clone())
    };
    let (count, text) = begins(1e-6, 0.5e-6);
    assert_eq!(count, 1);
    assert!(text.ends_with(" The event before it is within 1.0 us."), "{text}");
    let (count, text) = begins(4.5e-3, 1e-4);
    assert!(count > 1 && text.starts_with("The events part: "), "{text}");
    assert!(text.contains("4.5 ms") && !text.contains("within 0 s"), "{text}");
    // Half a second is more than a quarter of a period.
    let (_, text) = begins(0.5, 0.1);
    assert!(text.contains("s is already ") && text.ends_with(" early."), "{text}");
}

/// Some value of nearly any parameter reproduces three samples.
#[test]
fn property_three_samples_name_no_parameter() {
    let folder = tempfile::tempdir().unwrap();
    let text = "time,relative_velocity\n1,90\n2,80\n3,70\n";
    let c = compare(&write(&folder, "three.csv", text), &Mapping::default());
    assert!(c.causes.is_empty() && c.parameters.is_none(), "{}", c.verdict);
    assert!(c.verdict.contains("too few samples to name a cause"), "{}", c.verdict);
    assert!(
        c.summary
            .iter()
            .any(|line| line.contains("too few samples to name a cause")),
        "{:?}",
        c.summary
    );
}

#[test]
fn property_a_shifted_run_has_the_errors_of_its_shift_and_none_in_its_phase() {
    let folder = tempfile::tempdir().unwrap();
    let shift = 2e-6;
    let shifted = rows_of(paper(), 6.9749)
        .into_iter()
        .map(|(t, values)| (t + shift, values))
        .collect();
    let series = write(&folder, "shifted.csv", &csv(&shifted));
    let word = word_of(paper()).into_iter().map(|(t, kind)| (t + shift, kind));
    let word: Vec<(f64, String)> = word.collect();
    let mapping = Mapping {
        event_file: Some(write(&folder, "events.csv", &events_csv(&word))),
        ..Mapping::default()
    };
    let c = compare_quick(&series, mapping);
    assert!((c.event_errors.max.unwrap() - shift).abs() < 4e-15);
    let in_phase = c.channels.iter().filter(|row| row.phase.name().contains("between"));
    let of_velocity = in_phase
        .filter(|row| row.channel == "relative_velocity")
        .map(|row| row.max);
    // Times of 7 s are rounded to 1e-15 s, and omega_r changes by 8e3 rad/s^2. This gives 1e-11 rad/s.
    assert!(of_velocity.fold(0.0, f64::max) < 3e-11);
}

#[test]
fn property_events_found_in_a_series_are_those_of_its_table() {
    let folder = tempfile::tempdir().unwrap();
    let series = write(&folder, "series.csv", &csv(&rows_of(paper(), 6.966)));
    let c = compare(&series, &Mapping::default());
    let found = (c.missing, c.spurious, c.event_errors.matched);
    assert_eq!(found, (0, 0, 95), "{}", c.verdict);
    assert!(c.detection.is_some());
    // The error of a parabola and a cubic over samples of T_n/96 is about (3 * 2 pi/96)^2/2, 2 %, of a sample of 2.5
    // us at a breakaway, and less at a stop.
    assert!(c.event_errors.max.unwrap() < 5e-8, "{}", c.verdict);
    assert!(c.causes.is_empty(), "{}", c.verdict);
}

#[test]
fn property_a_sparse_reference_is_run_again_for_its_states() {
    let folder = tempfile::tempdir().unwrap();
    let sparse = folder.path().join("sparse.h5");
    // There is no window: one sample in 10 ms, none of them in the middle of a stick or slip.
    run(&sparse, "paper", &["output.window=[]", "output.around=none"]);
    let reference = Reference::open(&sparse).unwrap();
    let c = reference.compare(paper(), &Mapping::default()).unwrap();
    assert!(c.reference_repeated);
    assert_eq!(c.samples_too_sparse, 0);
    // The rounding of an event's time is 1e-13 s on the clock of its segment, at 8e3 rad/s^2.
    let found = channel(&c, "relative_velocity");
    assert!(found < 2e-9, "{found}");
}

#[test]
fn property_a_part_of_a_run_is_held_against_that_part() {
    let folder = tempfile::tempdir().unwrap();
    let rows = rows_of(paper(), 6.9771).into_iter().filter(|(t, _)| *t < 6.98);
    let rows: Vec<_> = rows.collect();
    let c = compare(&write(&folder, "part.csv", &csv(&rows)), &Mapping::default());
    assert_eq!((c.missing, c.spurious), (0, 0), "{}", c.verdict);
    assert!(c.reference_events > 10 && c.reference_events < 40);
    let of = |name: &str| c.statistics.iter().find(|s| s.name == name).unwrap();
    assert_eq!((of("onset").candidate, of("final_stick").candidate), (None, None));
}

#[test]
fn property_the_energy_balance_of_a_result_closes_and_a_false_rate_opens_it() {
    let of = |path: &std::path::Path| compare_quick(path, Mapping::default()).energy_drift.unwrap();
    // Events lie between samples of T_n/96. Each costs at most the power times a part of that interval.
    let drift = of(paper());
    assert!(drift.max < 1e-6 * drift.initial, "{drift:?}");
    let folder = tempfile::tempdir().unwrap();
    let wrong = rows_of(paper(), 6.966).into_iter().map(|(t, mut values)| {
        // As if 1 % of the rotor's kinetic energy came back at the end.
        values[4] *= if t > 6.98 { 1.005 } else { 1.0 };
        (t, values)
    });
    let series = write(&folder, "drift.csv", &csv(&wrong.collect()));
    let right = write(&folder, "right.csv", &csv(&rows_of(paper(), 6.966)));
    let found = of(&series).max;
    assert!(found > 100.0 * of(&right).max, "{:?} {:?}", of(&series), of(&right));
}

/// Samples inside a continuing slip are skipped. The result is the same to the bit, wherever blocks end.
#[test]
fn property_events_are_found_without_looking_at_every_sample() {
    let rows = rows_of(paper(), 6.966);
    let velocities: Vec<f64> = rows.iter().map(|row| row.1[5]).collect();
    // Separations in slip, in stick, and over a single sample.
    let away = |k: usize| k % 1777 < 5 || k % 901 == 17;
    let forces: Vec<f64> = (0..rows.len()).map(|k| if away(k) { -1.0 } else { 1.0 }).collect();
    for (with_force, velocity_tolerance) in [(false, 1e-8), (true, 1e-8), (false, 1.0), (true, 0.0)] {
        let detection = Detection {
            velocity_tolerance,
            hysteresis: 2.0,
        };
        let found = |block: usize| {
            let mut detector = Detector::new(detection);
            let mut seen = 0;
            for from in (0..rows.len()).step_by(block) {
                let to = rows.len().min(from + block);
                let mut row = from;
                while row < to {
                    let of = if with_force { &forces[row..to] } else { &[] };
                    row += detector.skip(&velocities[row..to], of);
                    detector.add(Point {
                        time: rows[row].0,
                        velocity: velocities[row],
                        normal_force: if with_force { forces[row] } else { f64::INFINITY },
                        torques: None,
                    });
                    (row, seen) = (row + 1, seen + 1);
                }
            }
            (detector.plateau(), detector.finish(), seen)
        };
        // Blocks of one sample allow no skipping.
        let (plateau, events, seen) = found(1);
        assert_eq!(seen, rows.len());
        for block in [7, 1000, rows.len()] {
            let (same_plateau, same, seen) = found(block);
            assert_eq!((same_plateau, &same), (plateau, &events), "{block}, {with_force}");
            // A tolerance above all remaining values of omega_r gives one stick, with every sample examined.
            assert!(velocity_tolerance > 0.1 || seen < rows.len());
        }
    }
}
