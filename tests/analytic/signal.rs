//! The signals against the properties that the rest of the program relies on: each profile by its definition, and the
//! stated properties of any signal by its own values.

use crate::common::systems::ramp;
use proptest::prelude::*;
use stickslip::signal::{Signal, TimeTable};

#[test]
fn analytic_a_ramp_rises_and_holds() {
    let pieces = ramp(8.0, 4.0).pieces();
    for (time, value, slope, integral) in [
        (0.0, 0.0, 2.0, 0.0),
        (1.0, 2.0, 2.0, 1.0),
        (4.0, 8.0, 0.0, 16.0),
        (6.0, 8.0, 0.0, 32.0),
    ] {
        let found = (pieces.value(time), pieces.slope(time), pieces.integral(time));
        assert_eq!(found, (value, slope, integral));
    }
    assert_eq!((pieces.next_corner(0.0), pieces.next_corner(4.0)), (Some(4.0), None));
    assert_eq!((pieces.shortest_change(), pieces.largest()), (4.0, 8.0));
    assert!(pieces.starts_positive());
}

#[test]
fn analytic_a_ramp_without_rise_is_a_step() {
    let pieces = ramp(-8.0, 0.0).pieces();
    let found = (pieces.value(0.0), pieces.slope(0.0), pieces.integral(3.0));
    assert_eq!(found, (-8.0, 0.0, -24.0));
    assert_eq!((pieces.corners().count(), pieces.largest()), (0, 8.0));
    assert_eq!(pieces.shortest_change(), f64::INFINITY);
    assert!(!pieces.starts_positive());
}

/// The first value is valid before the points, the last after them; points before t = 0 are cut off.
#[test]
fn analytic_a_table_goes_through_its_points() {
    let signal = |time: &[f64], value: &[f64]| {
        let (time, value) = (time.to_vec(), value.to_vec());
        Signal::TimeTable(TimeTable { time, value }).pieces()
    };
    let late = signal(&[1.0, 2.0, 4.0], &[3.0, 5.0, -1.0]);
    for (time, value) in [
        (0.0, 3.0),
        (1.0, 3.0),
        (1.5, 4.0),
        (2.0, 5.0),
        (3.0, 2.0),
        (4.0, -1.0),
        (9.0, -1.0),
    ] {
        assert_eq!(late.value(time), value);
    }
    assert_eq!(late.corners().collect::<Vec<_>>(), [1.0, 2.0, 4.0]);
    assert_eq!((late.integral(4.0), late.integral(5.0)), (11.0, 10.0));
    let early = signal(&[-3.0, -1.0, 1.0], &[7.0, 0.0, 4.0]);
    assert_eq!((early.value(0.0), early.slope(0.0), early.value(2.0)), (2.0, 2.0, 4.0));
    assert_eq!((early.corners().count(), early.shortest_change()), (1, 1.0));
    let past = signal(&[-3.0, -1.0], &[7.0, 2.0]);
    assert_eq!((past.value(0.0), past.corners().count()), (2.0, 0));
}

/// The second value is valid from its time on, also at t = 0 and before the table.
#[test]
fn analytic_two_points_of_one_time_are_a_step() {
    let signal = |time: &[f64], value: &[f64]| {
        let (time, value) = (time.to_vec(), value.to_vec());
        Signal::TimeTable(TimeTable { time, value }).pieces()
    };
    let pieces = signal(&[1.0, 1.0, 3.0, 3.0], &[2.0, 6.0, 4.0, -9.0]);
    for (time, value, slope, integral) in [
        (0.0, 2.0, 0.0, 0.0),
        (1.0, 6.0, -1.0, 2.0),
        (2.0, 5.0, -1.0, 7.5),
        (3.0, -9.0, 0.0, 12.0),
        (4.0, -9.0, 0.0, 3.0),
    ] {
        let found = (pieces.value(time), pieces.slope(time), pieces.integral(time));
        assert_eq!(found, (value, slope, integral));
    }
    assert_eq!(pieces.corners().collect::<Vec<_>>(), [1.0, 3.0]);
    assert_eq!((pieces.largest(), pieces.shortest_change()), (9.0, 2.0));
    let ends: Vec<f64> = pieces.all().iter().map(|piece| piece.end_value).collect();
    assert_eq!(ends, [2.0, 4.0, -9.0]);
    let early = signal(&[0.0, 0.0, 2.0], &[5.0, 1.0, 1.0]);
    assert_eq!((early.value(0.0), early.corners().count()), (1.0, 1));
}

/// Near its end a stretch has the sign of its value and slope there. The rounding of a sum from the start loses this
/// sign: 5359.15 - 5359.15/0.25686 0.25686 is 9e-13.
#[test]
fn analytic_a_value_beside_an_end_has_the_sign_of_the_table() {
    for (start, end) in [(0.05892, 0.31578), (0.1, 0.3), (0.7, 1.9)] {
        for value in [0.0, 1e-17, -1e-17] {
            let table = TimeTable {
                time: vec![start, end],
                value: vec![5359.15, value],
            };
            let pieces = Signal::TimeTable(table).pieces();
            let piece = pieces.all()[1];
            assert!(piece.beside_ends(end.next_down()) > 0.0);
            assert!(piece.beside_ends(end.next_up()) < 0.0);
            assert_eq!((piece.beside_ends(end), piece.beside_ends(start)), (value, 5359.15));
        }
    }
}

/// A case finds each profile and its parameters by their names.
#[test]
fn property_every_profile_is_found_by_its_name() {
    for name in Signal::NAMES {
        assert_eq!(Signal::blank(name).unwrap().name(), *name);
    }
    assert!(Signal::blank("none").is_none());
    let table = Signal::TimeTable(TimeTable {
        time: vec![1.0, 2.0],
        value: vec![3.0, 4.0],
    });
    let mut names = Vec::new();
    let negated = table.try_map(|name, index, number| {
        names.push((name, index));
        Ok::<f64, ()>(-number)
    });
    let listed = ["time", "value"]
        .into_iter()
        .flat_map(|name| [(name, Some(0)), (name, Some(1))]);
    assert_eq!(names, listed.collect::<Vec<_>>());
    let expected = Signal::TimeTable(TimeTable {
        time: vec![-1.0, -2.0],
        value: vec![-3.0, -4.0],
    });
    assert_eq!(negated.unwrap(), expected);
    assert_eq!(table.try_map(|name, _, _| Err::<f64, _>(name)), Err("time"));
}

fn tables() -> impl Strategy<Value = Signal> {
    prop::collection::vec((0.01..1.0f64, -5.0..5.0f64), 1..7).prop_map(|points| {
        let mut now = -0.7;
        let times = points.iter().map(|&(step, _)| {
            now += step;
            now
        });
        let time = times.collect();
        let value = points.iter().map(|&(_, value)| value).collect();
        Signal::TimeTable(TimeTable { time, value })
    })
}

proptest! {
    /// The stated properties of a signal agree with its values: slope and integral by differences over a stretch
    /// without a corner, where they are exact except for rounding (1e-15 of values of 5 over h); no jump at a corner;
    /// the largest value; and a constant value from the last corner on.
    #[test]
    fn property_a_signal_agrees_with_its_own_values(signal in tables(), t in 0.0..5.0f64) {
        const H: f64 = 1e-3;
        let pieces = signal.pieces();
        let next = pieces.next_corner(t);
        prop_assert_eq!(next, pieces.corners().find(|&corner| corner > t));
        let (here, value) = (pieces.value(t), pieces.value(t + H));
        if next.is_none_or(|corner| corner > t + H) {
            prop_assert!(((value - here) / H - pieces.slope(t)).abs() < 1e-10);
            let area = H * (here + value) / 2.0;
            prop_assert!((pieces.integral(t + H) - pieces.integral(t) - area).abs() < 1e-13);
        }
        if let Some(corner) = next {
            prop_assert!((pieces.value(corner) - pieces.value(corner.next_down())).abs() < 1e-10);
        }
        prop_assert!(here.abs() <= pieces.largest() * (1.0 + 1e-14));
        let still = pieces.corners().last().unwrap_or(0.0);
        prop_assert_eq!(pieces.value(still.max(t)), pieces.value(still + 100.0));
    }
}
