//! The parts of a comparison: clocks, crossings, drifts, detection, resolution, words.

mod attractor {
    use stickslip::compare::ComparedAttractor;
    use stickslip::record::EventKind;
    use stickslip::record::sequence::SequenceEvent;

    #[test]
    fn analytic_a_word_that_repeats_has_a_period() {
        let word = cycles(
            5,
            &[
                (0.0, EventKind::Slip),
                (1.0, EventKind::Reversal),
                (2.0, EventKind::Stick),
            ],
            3.0,
        );
        let (attractor, from) = ComparedAttractor::of_events(&word, 0.0, None).unwrap();
        assert_eq!((attractor.period, attractor.sticks, from), (3.0, 1, 10.0));
        assert!(ComparedAttractor::of_events(&word[..6], 0.0, None).is_none());
    }

    fn cycles(count: u32, events: &[(f64, EventKind)], period: f64) -> Vec<SequenceEvent> {
        let cycle = |k: u32| {
            let event = move |&(time, kind): &(f64, EventKind)| SequenceEvent {
                time: period * f64::from(k) + time,
                kind,
            };
            events.iter().map(event).collect::<Vec<_>>()
        };
        (0..count).flat_map(cycle).collect()
    }

    /// The same kinds of events at the same times in both directions.
    #[test]
    fn analytic_a_motion_that_is_the_same_either_way_has_the_period_of_its_reference() {
        let word = cycles(12, &[(0.0, EventKind::Slip), (1.0, EventKind::Stick)], 3.0);
        let (attractor, _) = ComparedAttractor::of_events(&word, 0.0, Some((&word, 6.0))).unwrap();
        assert_eq!((attractor.period, attractor.sticks), (6.0, 2));
        // A motion that differs between the directions has its own period.
        let slant = [
            (0.0, EventKind::Slip),
            (1.0, EventKind::Stick),
            (3.1, EventKind::Slip),
            (4.0, EventKind::Stick),
        ];
        let slant = cycles(6, &slant, 6.0);
        let (attractor, _) = ComparedAttractor::of_events(&slant, 0.0, Some((&word, 6.0))).unwrap();
        assert_eq!((attractor.period, attractor.sticks), (6.0, 2));
        let (attractor, _) = ComparedAttractor::of_events(&word, 0.0, Some((&slant, 6.0))).unwrap();
        assert_eq!((attractor.period, attractor.sticks), (3.0, 1));
    }

    /// Times that are known to the interval of the samples only.
    #[test]
    fn analytic_a_period_of_samples_is_no_multiple_of_itself() {
        let mut word = cycles(12, &[(0.0, EventKind::Slip), (0.2, EventKind::Stick)], 0.67);
        for (k, event) in word.iter_mut().enumerate() {
            // Times scattered by up to half an interval of 2 ms.
            event.time += 1e-3 * (1.7 * k as f64).sin();
        }
        assert!(ComparedAttractor::of_events(&word, 0.0, None).is_none());
        let (attractor, _) = ComparedAttractor::of_events(&word, 4e-3, None).unwrap();
        assert!((attractor.period - 0.67).abs() < 2e-3 && attractor.sticks == 1);
    }
}

mod clock {
    use stickslip::compare::causes::clock::{find, other_clock};
    use stickslip::record::EventKind::{Slip, Stick};
    use stickslip::record::sequence::SequenceEvent;

    #[test]
    fn analytic_the_offset_of_a_shifted_word_is_found() {
        // Cycles that grow, so that a shift by one cycle fits less well.
        let event = |k: u32| SequenceEvent {
            time: 7.0 + 1e-3 * f64::from(k) + 1e-6 * f64::from(k * k),
            kind: if k.is_multiple_of(2) { Stick } else { Slip },
        };
        let reference: Vec<SequenceEvent> = (0..40).map(event).collect();
        let shifted = |by: f64| {
            move |e: &SequenceEvent| SequenceEvent {
                time: e.time - by,
                kind: e.kind,
            }
        };
        let whole: Vec<SequenceEvent> = reference.iter().map(shifted(6.99)).collect();
        let found = find(&reference, &whole, 2e-4).unwrap();
        assert!((found.seconds - 6.99).abs() < 1e-12 && found.agree == 40, "{found:?}");
        let part: Vec<SequenceEvent> = reference[5..25].iter().map(shifted(-3.0)).collect();
        let found = find(&reference, &part, 2e-4).unwrap();
        assert!((found.seconds + 3.0).abs() < 1e-12 && found.agree == 20, "{found:?}");
        assert_eq!(find(&reference, &whole[..3], 2e-4), None);
    }

    #[test]
    fn analytic_an_offset_is_named_by_what_it_counts_from() {
        let word = |offset: f64, drift: f64| -> Vec<SequenceEvent> {
            let at = |k: u32| 7.0 + 1e-4 * f64::from(k) * (1.0 + drift) + offset;
            let kind = |k: u32| {
                if k.is_multiple_of(2) { Stick } else { Slip }
            };
            (0..9)
                .map(|k| SequenceEvent {
                    time: at(k),
                    kind: kind(k),
                })
                .collect()
        };
        let anchors = [("the kick", 6.966), ("the first event", 7.0)];
        let clock = |offset, drift| other_clock(&word(0.0, 0.0), &word(offset, drift), &anchors, 2.4e-4);
        assert_eq!(clock(-6.966, 0.0).unwrap().counts_from, Some("the kick"));
        assert_eq!(clock(-7.0, 0.0).unwrap().counts_from, Some("the first event"));
        assert_eq!(clock(0.3, 0.0).unwrap().counts_from, None);
        // The same offset with the other sign.
        let word_late = clock(0.3, 0.0).unwrap();
        let found = find(&word(0.0, 0.0), &word(0.3, 0.0), 3e-5).unwrap();
        assert!((found.seconds - word_late.to_add()).abs() < 1e-9, "{found:?}");
        // With a drift, or without an offset, there is no shift to report.
        assert!(clock(0.3, 0.1).is_none() && clock(0.0, 0.0).is_none() && clock(1e-5, 1e-3).is_none());
    }
}

mod crossings {
    use stickslip::compare::detect::Crossings;
    use stickslip::record::EventKind;

    #[test]
    fn analytic_a_threshold_is_crossed_where_the_parabola_does() {
        let mut crossings = Crossings::new(0.5, 0.0);
        for k in 0..40 {
            let t = 0.1 * f64::from(k);
            crossings.add(t, 1.0 - (t - 1.93).powi(2));
        }
        let events = crossings.events;
        // |1 - x^2| = 1/2 at x = -+ sqrt(3/2) and -+ sqrt(1/2).
        let expected = [-(1.5f64.sqrt()), -(0.5f64.sqrt()), 0.5f64.sqrt(), 1.5f64.sqrt()];
        assert_eq!(events.len(), 4);
        for (event, x) in events.iter().zip(expected) {
            assert!((event.time - 1.93 - x).abs() < 1e-12, "{event:?}");
        }
        assert_eq!(events[0].kind, EventKind::Stick);
        assert_eq!(events[1].kind, EventKind::Slip);
    }
}

mod cycles {
    use stickslip::compare::CycleErrors;
    use stickslip::compare::EventError;
    use stickslip::compare::event_errors::EventErrors;

    /// Slips every 2 s with these errors, s.
    fn cycles(error: impl Fn(usize) -> f64) -> CycleErrors {
        let events = (0..10).map(|k| EventError {
            position: k,
            kind: "slip",
            time: 5.0 + 2.0 * k as f64,
            error: error(k),
            bound: 0.0,
        });
        let errors = EventErrors {
            matched: 10,
            max: None,
            max_at: None,
            rms: None,
            events: events.collect(),
        };
        CycleErrors::of(&errors).unwrap()
    }

    #[test]
    fn analytic_a_drift_is_the_slope_of_the_errors() {
        let cycles = cycles(|k| 1e-3 + 1e-4 * k as f64);
        assert_eq!((cycles.of, cycles.cycles, cycles.drifts), ("slip", 10, true));
        assert!((cycles.per_cycle - 1e-4).abs() < 1e-15 && (cycles.relative - 5e-5).abs() < 1e-15);
        assert!(cycles.scatter < 1e-15);
    }

    #[test]
    fn analytic_a_late_event_a_step_and_a_scatter_are_no_drift() {
        for late in 0..10 {
            let cycles = cycles(|k| if k == late { 8.58e-3 } else { 1e-9 });
            assert!(!cycles.drifts, "{late}: {cycles:?}");
            let found = (cycles.largest, cycles.largest_position, cycles.others);
            assert_eq!(found, (8.58e-3, late, 1e-9));
            assert_eq!(cycles.largest_at, 5.0 + 2.0 * late as f64);
        }
        for from in 1..10 {
            assert!(!cycles(|k| if k < from { 0.0 } else { 8.58e-3 }).drifts, "{from}");
        }
        assert!(!cycles(|k| 1e-6 * (7.0 * k as f64).sin()).drifts);
        // Equal errors have no trend.
        let same = cycles(|_| 1e-3);
        assert!(!same.drifts && same.explained == 0.0);
    }

    /// A drift as large as its scatter is found if there are enough cycles.
    #[test]
    fn analytic_a_drift_stands_out_of_its_scatter() {
        let cycles = cycles(|k| 1e-4 * (k as f64 + (7.0 * k as f64).sin()));
        assert!(cycles.drifts, "{cycles:?}");
        assert!((cycles.per_cycle - 1e-4).abs() < 3.0 * cycles.uncertainty, "{cycles:?}");
    }
}

mod detect {
    use stickslip::compare::{Detection, Detector, Found, Point};
    use stickslip::record::EventKind;

    const SIMPLE: Detection = Detection {
        velocity_tolerance: 1e-6,
        hysteresis: 2.0,
    };

    fn found(detection: Detection, velocity: impl Fn(f64) -> f64, times: impl Iterator<Item = f64>) -> Vec<Found> {
        let mut detector = Detector::new(detection);
        for time in times {
            detector.add(Point {
                time,
                velocity: velocity(time),
                normal_force: f64::INFINITY,
                torques: None,
            });
        }
        detector.finish()
    }

    /// Stops with a parabola at 1.2345, breaks away with a parabola and a cubic at 2.3456.
    fn stick_and_slip(t: f64) -> f64 {
        if t < 1.2345 {
            let x = 1.2345 - t;
            x + 0.3 * x * x
        } else if t < 2.3456 {
            0.0
        } else {
            0.7 * (t - 2.3456).powi(2) - 0.4 * (t - 2.3456).powi(3)
        }
    }

    #[test]
    fn analytic_times_between_samples_are_those_of_parabolas() {
        let events = found(SIMPLE, stick_and_slip, (0..300).map(|k| 0.01 * f64::from(k)));
        let found = events.iter().map(|e| e.kind).collect::<Vec<_>>();
        assert_eq!(found, [EventKind::Stick, EventKind::Slip]);
        // Exact except for rounding, which the differences of samples amplify by 1/h^2 (1e4), and for the end of the
        // secant method.
        assert!((events[0].time - 1.2345).abs() < 1e-11, "{events:?}");
        assert!((events[1].time - 2.3456).abs() < 1e-10, "{events:?}");
    }

    #[test]
    fn analytic_crossings_are_reversals_also_through_a_sample_at_zero() {
        let times = (0..21).map(|k| 0.1 * f64::from(k) - 1.0);
        let events = found(SIMPLE, |t| -t, times.clone());
        assert_eq!(events.len(), 1);
        assert_eq!(events[0].kind, EventKind::Reversal);
        assert!(events[0].time.abs() < 1e-12);
        let events = found(SIMPLE, |t| 0.05 - t, times);
        assert_eq!(events.len(), 1);
        assert!((events[0].time - 0.05).abs() < 1e-12);
    }

    #[test]
    fn analytic_noise_below_the_hysteresis_ends_no_stick() {
        let noisy = |t: f64| if t < 1.0 { 1.0 - t } else { 1.9e-6 * (1e4 * t).sin() };
        let times = || (0..300).map(|k| 0.01 * f64::from(k));
        assert_eq!(found(SIMPLE, noisy, times()).len(), 1);
        let tight = Detection {
            velocity_tolerance: 1e-9,
            hysteresis: 2.0,
        };
        assert!(found(tight, noisy, times()).len() > 20);
    }

    #[test]
    fn analytic_the_speed_that_a_wide_tolerance_drops_is_seen() {
        let dropped = |t: f64| if t < 0.7 { 1.0 - t } else { 0.0 };
        let events = found(SIMPLE, dropped, (0..100).map(|k| 0.01 * f64::from(k)));
        let left = events[0].dropped.unwrap();
        assert!((left - 0.3).abs() < 0.011, "{left}");
    }
}

mod hysteresis {
    use stickslip::compare::Block;
    use stickslip::compare::Channel;
    use stickslip::compare::detect::HysteresisPass;
    use stickslip::compare::{Detection, Detector, Found, Point};
    use stickslip::record::EventKind;

    /// In samples of 1 ms: a stick that creeps with 0.015 rad/s from 0.1 s on, and ends by a rise from 0.3 s on; and
    /// one that ends by a relative velocity of 0.1 t rad/s.
    #[test]
    fn analytic_hysteresis_delays_the_end_of_a_creeping_stick() {
        let creeping = |t: f64| match t {
            _ if t < 0.0995 => 0.0,
            _ if t < 0.3 => 0.015,
            _ => 0.015 + (t - 0.3),
        };
        assert!((delay_of(creeping) - 0.2).abs() < 2e-3);
        // The rise begins at 0, whatever the thresholds are.
        assert!(delay_of(|t| 0.1 * t.max(0.0)).abs() < 2e-3);
    }

    fn delay_of(stick: impl Fn(f64) -> f64) -> f64 {
        let detection = Detection {
            velocity_tolerance: 1e-2,
            hysteresis: 2.0,
        };
        let time: Vec<f64> = (-2000..2000).map(|k| 1e-3 * f64::from(k)).collect();
        let velocity = |&t: &f64| if t < -1.0 { -1.0 - t } else { stick(t) };
        let block = Block {
            columns: vec![time.iter().map(velocity).collect()],
            time,
        };
        let mut detector = Detector::new(detection);
        for (&time, &velocity) in block.time.iter().zip(&block.columns[0]) {
            detector.add(Point {
                time,
                velocity,
                normal_force: f64::INFINITY,
                torques: None,
            });
        }
        let found = detector.finish();
        let mut pass = HysteresisPass::new(&[Channel::RelativeVelocity], detection, &found, f64::NEG_INFINITY).unwrap();
        pass.add(&block);
        let effect = pass.finish();
        assert_eq!((effect.events, effect.events_without, effect.chatters), (2, 2, false));
        assert_eq!((effect.stick_begins, effect.stick_ends), (1e-2, 2e-2));
        assert_eq!(effect.largest, effect.slips_later);
        effect.slips_later.unwrap()
    }

    /// Noise between the two thresholds: without hysteresis each excursion is a slip.
    #[test]
    fn analytic_chatter_between_the_thresholds_is_counted_up_to_a_limit() {
        let detection = Detection {
            velocity_tolerance: 1e-2,
            hysteresis: 2.0,
        };
        let time: Vec<f64> = (0..9000).map(|k| 1e-3 * f64::from(k)).collect();
        let velocity = |&t: &f64| {
            if t < 1.0 {
                1.0
            } else {
                1.5e-2 * f64::from((1e3 * t) as u32 % 2)
            }
        };
        let block = Block {
            columns: vec![time.iter().map(velocity).collect()],
            time,
        };
        let stick = [Found::new(1.0, EventKind::Stick)];
        let mut pass = HysteresisPass::new(&[Channel::RelativeVelocity], detection, &stick, 0.0).unwrap();
        pass.add(&block);
        let effect = pass.finish();
        assert!(effect.chatters && effect.events_without >= 1010, "{effect:?}");
        assert_eq!((effect.slips_later, effect.largest), (None, None));
    }

    #[test]
    fn analytic_one_threshold_has_nothing_to_compare() {
        let plain = Detection {
            velocity_tolerance: 1e-2,
            hysteresis: 1.0,
        };
        assert!(HysteresisPass::new(&[Channel::RelativeVelocity], plain, &[], 0.0).is_none());
    }
}

mod equations {
    use stickslip::compare::causes::equations::{POINTS, weights};

    #[test]
    fn analytic_weights_integrate_polynomials_through_uneven_samples() {
        let time = [1.0, 1.1, 1.25, 1.6, 2.0];
        let fine = weights(&time, &[0, 1, 2, 3, 4]).unwrap();
        let coarse = weights(&time, &[0, 2, 4]).unwrap();
        let integral = |weights: &[f64; POINTS], power: i32| -> f64 {
            time.iter().zip(weights).map(|(t, w)| w * t.powi(power)).sum()
        };
        for power in 0..=4 {
            let exact = (2f64.powi(power + 1) - 1.0) / f64::from(power + 1);
            assert!((integral(&fine, power) - exact).abs() < 1e-12, "{power}");
            assert!(power > 2 || (integral(&coarse, power) - exact).abs() < 1e-12, "{power}");
        }
    }
}

mod range {
    use stickslip::compare::Block;
    use stickslip::compare::statistics::PositionRange;

    #[test]
    fn analytic_extremes_between_samples_are_those_of_parabolas() {
        let block = Block {
            time: (0..20).map(f64::from).collect(),
            columns: vec![(0..20).map(|k| 1.0 - (f64::from(k) - 7.3).powi(2)).collect()],
        };
        let mut range = PositionRange::new(2.0, 11.0);
        range.add(&block, 0);
        let (low, high) = range.extremes.unwrap();
        assert!((high - 1.0).abs() < 1e-12 && (low - (1.0 - 5.3f64.powi(2))).abs() < 1e-12);
    }
}

mod resolution {
    use stickslip::compare::Rounding;
    use stickslip::compare::resolution::{ClockWatch, Digits};

    #[test]
    fn analytic_neighbours_of_numbers_in_files() {
        // 24 binary digits: between 4 and 8 they are 2^-21 apart.
        assert_eq!(Rounding::Single.quantum(7.0), 2f64.powi(-21));
        assert!((Rounding::Digits(7).quantum(6.975) / 1e-6 - 1.0).abs() < 1e-12);
        assert!((Rounding::Decimals(6).quantum(123.0) / 1e-6 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn analytic_digits_of_texts() {
        let of = |texts: &[&str]| {
            let mut digits = Digits::default();
            texts.iter().for_each(|text| digits.add(text));
            digits.rounding()
        };
        assert_eq!(of(&["6.975001e+00", "6.975002e+00"]), Some(Rounding::Digits(7)));
        assert_eq!(of(&["0.000000", "6.975002"]), Some(Rounding::Decimals(6)));
        assert_eq!(of(&["0.", "47.5732E-06", "1.1888E-03"]), Some(Rounding::Digits(6)));
        assert_eq!(of(&["6.9750014941234", "6.975"]), None);
    }

    #[test]
    fn analytic_a_clock_that_numbers_hold_exactly_is_not_rounded() {
        let rounded = |rounding: Rounding, times: &mut dyn Iterator<Item = f64>| {
            let mut watch = ClockWatch::default();
            times.for_each(|time| watch.add(rounding, time));
            watch.is_rounded()
        };
        let single = |step: f64| (0..2000).map(move |k| f64::from((6.97 + step * f64::from(k)) as f32));
        assert!(rounded(Rounding::Single, &mut single(1e-6)));
        assert!(!rounded(
            Rounding::Single,
            &mut (0..2000).map(|k| f64::from(k) / 1024.0)
        ));
        let decimal = |step: f64| (0..2000).map(move |k| ((6.97 + step * f64::from(k)) * 1e6).round() / 1e6);
        assert!(rounded(Rounding::Digits(7), &mut decimal(2.5e-6)));
        assert!(!rounded(Rounding::Digits(7), &mut decimal(2e-6)));
    }
}

mod torques {
    use stickslip::compare::Found;
    use stickslip::compare::survey::TorqueWatch;
    use stickslip::record::EventKind;

    #[test]
    fn analytic_parabolas_are_extrapolated_exactly_and_not_over_an_event() {
        let events = [
            (0.35, EventKind::Stick),
            (0.72, EventKind::Slip),
            (0.95, EventKind::Slip),
        ];
        let mut watch = TorqueWatch::new(events.map(|(time, kind)| Found::new(time, kind)).to_vec());
        for k in 0..=10 {
            let t = 0.1 * f64::from(k);
            watch.add(t, 1.0 + t * t, 2.0 - 3.0 * t);
        }
        let found = watch.events;
        let (rotor, stator) = found[1].torques.unwrap();
        assert!((rotor - 1.5184).abs() < 1e-13 && (stator + 0.16).abs() < 1e-13);
        assert_eq!((found[0].torques, found[2].torques), (None, None));
    }
}

mod vocabulary {
    use stickslip::case::{Case, CaseSource};
    use stickslip::compare::Channel;
    use stickslip::compare::Vocabulary;
    use stickslip::compare::vocabulary::Known;
    use stickslip::simulation::TrainSide;

    fn of(case: &str) -> Vocabulary {
        let case = Case::read(&CaseSource::built_in(case).unwrap(), &[]).unwrap();
        Vocabulary::of(case.words, &case.system)
    }

    /// The names of the short form are the inertias and shafts of its general form.
    #[test]
    fn analytic_the_short_form_has_the_channels_of_every_file() {
        let paper = of("paper");
        let channels: Vec<Channel> = paper.channels().collect();
        assert_eq!(channels[..Channel::ALL.len()], Channel::ALL);
        assert_eq!(paper.find("v"), Some(Channel::Phi1));
        assert_eq!(paper.find("stator_twist_0"), Some(Channel::Phi1));
        let derived = paper.derived(&[Channel::ThetaDot, Channel::RotorTwistRate, Channel::Phi1Dot]);
        let derived: Vec<Channel> = derived.into_iter().map(|(channel, _)| channel).collect();
        assert_eq!(derived, [Channel::RelativeVelocity, Channel::Phi2Dot]);
    }

    #[test]
    fn analytic_channels_follow_from_absolute_coordinates() {
        let drill = of("drill-string");
        let channels: Vec<String> = drill.channels().map(|channel| channel.name().into_owned()).collect();
        assert_eq!(channels[..3], ["relative_velocity", "rotor_twist", "rotor_twist_rate"]);
        let direct = [
            drill.find("rotor_angle_0").unwrap(),
            drill.find("rotor_angle_1").unwrap(),
        ];
        let derived = drill.derived(&direct);
        let (_, twist) = derived.iter().find(|(c, _)| *c == Channel::RotorTwist).unwrap();
        assert_eq!((twist.terms.len(), twist.known.len()), (2, 0));
        let factor = |k: usize| twist.terms.iter().find(|t| t.0 == k).unwrap().1;
        assert_eq!((factor(0), factor(1)), (-1.0, 1.0));
        assert!(derived.iter().all(|(c, _)| *c != Channel::RelativeVelocity));
    }

    #[test]
    fn analytic_the_speed_of_a_belt_is_known() {
        let belt = of("belt-leine");
        assert_eq!(belt.unit(Channel::Phi1), "m");
        let velocity = belt.find("v").unwrap();
        assert_eq!(velocity, Channel::Phi1Dot);
        assert_eq!(belt.find("stator_twist_rate_0"), Some(Channel::Phi1Dot));
        let derived = belt.derived(&[velocity]);
        assert_eq!(derived.len(), 1);
        let (channel, sum) = &derived[0];
        assert_eq!(*channel, Channel::RelativeVelocity);
        assert_eq!(sum.terms, [(0, -1.0)]);
        let end = Known {
            of: TrainSide::Rotor,
            is_rate: true,
        };
        assert_eq!(sum.known, [(end, 1.0)]);
    }
}

mod wrong_event {
    use stickslip::compare::EventError;
    use stickslip::compare::WrongEvent;
    use stickslip::compare::event_errors::EventErrors;

    fn first(error: impl Fn(usize) -> f64, resolved: f64) -> Option<WrongEvent> {
        let events = (0..20).map(|k| EventError {
            position: k,
            kind: "slip",
            time: k as f64,
            error: error(k),
            bound: 0.0,
        });
        let errors = EventErrors {
            matched: 20,
            max: None,
            max_at: None,
            rms: None,
            events: events.collect(),
        };
        WrongEvent::first(&errors, &[], 1.0, resolved)
    }

    #[test]
    fn analytic_the_first_event_that_stands_out_is_wrong_and_not_the_largest() {
        // Two late events, of which the second has the larger error; both are late by less than a hundredth of the
        // period.
        let late = |k: usize| match k {
            7 => 2e-3,
            12 => 9e-3,
            _ => 1e-9,
        };
        let wrong = first(late, 0.0).unwrap();
        assert_eq!((wrong.position, wrong.error, wrong.tolerance), (7, Some(2e-3), 1e-4));
        assert_eq!(wrong.words(), "event 7, a slip at 7.000000 s, is off by 2.0e-3 s");
        // Errors that the samples do not resolve are not wrong.
        assert_eq!(first(late, 3e-3).unwrap().position, 12);
        assert_eq!(first(late, 1e-2), None);
    }

    #[test]
    fn analytic_an_event_that_shifts_all_later_ones_is_the_first_wrong_one() {
        let wrong = first(|k| if k < 7 { 0.0 } else { 2e-3 }, 0.0).unwrap();
        assert_eq!(wrong.position, 7);
    }

    #[test]
    fn analytic_errors_that_are_alike_have_no_wrong_event_up_to_a_hundredth_of_the_period() {
        assert_eq!(first(|k| 9e-3 * (k as f64).sin(), 0.0), None);
        let drift = |k: usize| 1e-3 * k as f64;
        assert_eq!(first(drift, 0.0).unwrap().position, 11);
        // Nor are errors below 1e-4 of the period, however one of them stands out.
        assert_eq!(first(|k| if k == 3 { 9e-5 } else { 0.0 }, 0.0), None);
    }
}
