//! Cycles of a run, and the alignment of two event sequences.

mod digest {
    use stickslip::record::EventKind;
    use stickslip::record::{Cycle, CycleStatistics};

    #[test]
    fn analytic_cycles_of_a_short_sequence() {
        let (stick, slip) = (|t| (t, EventKind::Stick), |t| (t, EventKind::Slip));
        let kick = (0.5, EventKind::Kick);
        let (s, cycles) = CycleStatistics::of_events([kick, stick(1.0), slip(1.25), stick(2.0), slip(2.5), stick(4.0)]);
        assert_eq!((s.stick_count, s.slip_count, cycles.len()), (3, 2, 2));
        assert_eq!((s.onset_time, s.final_stick_time), (Some(1.0), Some(4.0)));
        let expected = Cycle {
            stick_duration: 0.5,
            slip_duration: 1.5,
            period: 2.0,
        };
        assert_eq!(cycles[1], expected);
        assert_eq!((s.first_period(), s.last_period()), (Some(1.0), Some(2.0)));
    }

    #[test]
    fn analytic_a_run_that_ends_slipping_has_no_final_stick() {
        let (s, cycles) = CycleStatistics::of_events([(1.0, EventKind::Stick), (2.0, EventKind::Separation)]);
        assert_eq!((s.stick_count, cycles.len(), s.final_stick_time), (1, 0, None));
    }
}

mod sequence {
    use stickslip::record::EventKind;
    use stickslip::record::sequence::{Alignment, Fault, SequenceEvent};

    /// The natural period of a motion whose cycle is 12 s, with a slip and a stick in each.
    const NATURAL: f64 = 6.0;

    fn periodic(cycles: usize, period: f64) -> Vec<SequenceEvent> {
        let cycle = |k: usize| {
            let at = 5.0 + k as f64 * period;
            [(at, EventKind::Slip), (at + 4.3, EventKind::Stick)].map(|(time, kind)| SequenceEvent { time, kind })
        };
        (0..cycles).flat_map(cycle).collect()
    }

    fn aligned(reference: &[SequenceEvent], candidate: &[SequenceEvent]) -> Alignment {
        let by_time = Alignment::of(reference, candidate, NATURAL);
        Alignment::drifting(reference, candidate, NATURAL, by_time)
    }

    /// The index `reference - candidate` of every match, before and after a position of the reference.
    fn offsets(alignment: &Alignment, position: usize) -> [Vec<isize>; 2] {
        let of = |before: bool| {
            let matched = alignment.matched().filter(|&(r, _)| (r < position) == before);
            let mut found: Vec<isize> = matched.map(|(r, c)| r as isize - c as isize).collect();
            found.dedup();
            found
        };
        [of(true), of(false)]
    }

    /// A drift that ends several cycles away, a missing or additional pair, and both.
    #[test]
    fn analytic_a_cycle_that_is_missing_shifts_no_later_one() {
        for drift in [0.0, 1e-3, -1e-3, 0.1, -0.1, 0.5] {
            let reference = periodic(200, 12.0);
            let other = periodic(200, 12.0 + drift);
            let whole = aligned(&reference, &other);
            assert!(whole.differences.is_empty(), "{drift}: {:?}", whole.differences);

            for gap in [1, 2, 3] {
                let mut missing = other.clone();
                missing.drain(150..150 + 2 * gap);
                let a = aligned(&reference, &missing);
                assert_eq!((a.missing(), a.spurious()), (2 * gap, 0), "{drift}");
                assert_eq!(offsets(&a, 150), [vec![0], vec![2 * gap as isize]], "{drift}");
                assert!(a.differences.iter().all(|d| d.fault == Fault::Missing));
            }

            // A short cycle within a stick.
            let mut spurious = other.clone();
            let at = spurious[149].time;
            let kinds = [(at + 2.0, EventKind::Slip), (at + 4.0, EventKind::Stick)];
            spurious.splice(150..150, kinds.map(|(time, kind)| SequenceEvent { time, kind }));
            let a = aligned(&reference, &spurious);
            assert_eq!((a.missing(), a.spurious()), (0, 2), "{drift}");
            assert_eq!(offsets(&a, 150), [vec![0], vec![-2]], "{drift}");

            // A missing pair hides an additional one from the number of events.
            spurious.drain(300..302);
            let a = aligned(&reference, &spurious);
            assert_eq!((a.missing(), a.spurious()), (2, 2), "{drift}");
        }
    }

    /// A longer cycle, of which fewer have begun by the end.
    #[test]
    fn analytic_a_drift_that_loses_the_last_cycles_is_a_drift() {
        let reference = periodic(200, 12.0);
        let candidate = periodic(195, 12.3);
        let a = aligned(&reference, &candidate);
        assert_eq!((a.missing(), a.spurious()), (10, 0));
        assert_eq!(offsets(&a, 400), [vec![0], vec![]]);
    }

    /// The first events of the sequence may be missing, even more than a drift may omit.
    #[test]
    fn analytic_missing_events_at_the_start_are_missing_there() {
        let reference = periodic(100, 12.0);
        for lost in [1, 2, 5, 20, 60] {
            let a = aligned(&reference, &reference[lost..]);
            assert_eq!((a.missing(), a.spurious()), (lost, 0), "{lost}");
            assert_eq!(offsets(&a, 0), [vec![], vec![lost as isize]]);
        }
    }
}
