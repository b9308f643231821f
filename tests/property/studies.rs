//! Parts of studies: shards, journal and threads; also the phases of a cycle.

mod partition {
    use proptest::prelude::*;
    use stickslip::results::Partition;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(256))]

        /// The sizes of shards differ by at most one point.
        #[test]
        fn property_shards_have_the_points_that_they_own(
            shape in proptest::collection::vec(1usize..9, 1..4), shards in 1usize..9,
        ) {
            let partition = Partition::new(&shape, shards);
            let points = partition.points();
            for shard in 0..shards {
                let size = (0..points).filter(|&number| partition.owner(number) == shard).count();
                prop_assert_eq!(partition.size(shard), size);
                prop_assert!(size == points / shards || size == points / shards + 1);
            }
        }
    }

    #[test]
    fn analytic_no_shard_keeps_to_one_value() {
        // Two methods as the last axis, dealt to two shards: each has every method for half of the rows.
        let partition = Partition::new(&[10, 2], 2);
        let first_column = |shard| (0..20).filter(|&n| partition.owner(n) == shard && n % 2 == 0).count();
        assert_eq!((first_column(0), first_column(1)), (5, 5));
        // The axis before the last has three values. Each of three shards has a third of each value.
        let partition = Partition::new(&[6, 3, 2], 3);
        for shard in 0..3 {
            for value in 0..3 {
                let of_value = (0..36).filter(|&n| partition.owner(n) == shard && n / 2 % 3 == value);
                assert_eq!(of_value.count(), 4);
            }
        }
    }
}

mod journal {
    use proptest::prelude::*;
    use stickslip::record::EventKind;
    use stickslip::sweep::{Existing, Journal, PointOutcome};
    use stickslip_analysis::ErrorKind;

    fn outcome(number: u64) -> PointOutcome {
        let result = if number % 3 == 1 {
            Err(format!("point {number} failed: ä"))
        } else {
            // As many values as the study has quantities.
            Ok((0..20 + number).map(|k| number as f64 + k as f64 / 7.0).collect())
        };
        let events = (0..number % 4)
            .map(|k| [k as f64, EventKind::Stick.code().into(), 1.0, -0.5, 2.0])
            .collect();
        PointOutcome { number, result, events }
    }

    const DIGEST: &str = "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef";

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn property_a_damaged_journal_is_good_up_to_the_damage(cut in 0.0..1.0f64, flip in any::<bool>()) {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("x.journal");
            let mut journal = Journal::open(&path, DIGEST, Existing::Refuse).unwrap();
            let length = || std::fs::metadata(&path).unwrap().len();
            let mut ends = vec![length()];
            for number in 0..12 {
                journal.append(&[outcome(11 - number)]).unwrap();
                ends.push(length());
            }
            drop(journal);
            let mut bytes = std::fs::read(&path).unwrap();
            let first = ends[0] as usize;
            let at = first + (cut * (bytes.len() - first) as f64) as usize;
            if flip { bytes[at] ^= 0x10 } else { bytes.truncate(at) }
            std::fs::write(&path, &bytes).unwrap();
            let whole = ends.iter().filter(|&&end| end <= at as u64).count() as u64 - 1;
            let mut journal = Journal::open(&path, DIGEST, Existing::Resume).unwrap();
            prop_assert_eq!(journal.points(), whole);
            for number in 0..12 {
                let found = journal.read(number).unwrap();
                prop_assert_eq!(found, (11 - number < whole).then(|| outcome(number)));
            }
        }
    }

    #[test]
    fn property_a_journal_of_another_study_or_in_use_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.journal");
        let mut journal = Journal::open(&path, DIGEST, Existing::Refuse).unwrap();
        journal.append(&[outcome(3)]).unwrap();
        let open = |digest: &str, existing| Journal::open(&path, digest, existing);
        let refused = |digest: &str, existing, why: &str| {
            let error = open(digest, existing).unwrap_err();
            assert!(matches!(error.kind, ErrorKind::Input), "{error:?}");
            assert!(error.message.contains(why), "{error}");
        };
        refused(DIGEST, Existing::Resume, "another sweep is writing there");
        drop(journal);
        let other = DIGEST.replace('0', "f");
        refused(
            &other,
            Existing::Resume,
            "belongs to another study, or to this one before it was changed",
        );
        refused(DIGEST, Existing::Refuse, "holds 1 points of an interrupted study");
        assert_eq!(open(&other, Existing::Discard).unwrap().points(), 0);
        std::fs::write(
            &path,
            "something else that is long enough to be somebody's text, and is not ours at all.",
        )
        .unwrap();
        refused(DIGEST, Existing::Resume, "not the journal of a sweep");
    }
}

mod workers {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use stickslip_engine::workers::{in_order, on_threads};

    #[test]
    fn property_results_stand_in_the_places_of_their_jobs() {
        for threads in [0, 1, 3, 100] {
            let mut finished = 0;
            let squares = in_order(threads, 50, |k| Some(k * k), &mut |count| finished = count);
            assert_eq!(squares, (0..50).map(|k| Some(k * k)).collect::<Vec<_>>());
            assert_eq!(finished, 50);
        }
        assert!(in_order(4, 0, Some, &mut |_| {}).is_empty());
    }

    /// There are more results than may wait, and a slow receiver takes them one by one.
    #[test]
    fn property_no_result_is_lost_where_they_have_to_wait() {
        let begun = AtomicUsize::new(0);
        let job = |k: usize| {
            begun.fetch_add(1, Ordering::Relaxed);
            Some(k)
        };
        let mut seen: Vec<usize> = on_threads(2, 1, 0..1000, job, |receiver| receiver.iter().collect());
        seen.sort_unstable();
        assert_eq!(seen, (0..1000).collect::<Vec<_>>());
        assert_eq!(begun.into_inner(), 1000);
    }

    #[test]
    fn property_a_job_that_comes_to_nothing_ends_the_work() {
        let results = in_order(1, 10, |k| (k < 4).then_some(k), &mut |_| {});
        assert_eq!(results.iter().flatten().count(), 4);
    }
}

mod orbit {
    use stickslip::cycle::orbit::{vanishing, whole};
    use stickslip::model::Mode;
    use stickslip::simulation::{Border, ShotPhase};

    #[test]
    fn property_what_vanishes_is_measured_by_the_largest_slip_and_force() {
        let phase = |mode, from: f64, to: f64, depth: f64| ShotPhase { mode, from, to, depth };
        let found = vanishing(&whole(&[
            phase(Mode::SlipForward, 0.0, 1.0, 2.0),
            phase(Mode::Stick, 1.0, 2.0, 0.0),
            phase(Mode::SlipBackward, 2.0, 3.0, 1.0),
            phase(Mode::Separated, 3.0, 4.0, 0.125),
            phase(Mode::SlipForward, 4.0, 5.0, 4.0),
        ]));
        let found: Vec<_> = found.iter().map(|one| (one.border, one.time, one.distance)).collect();
        // The slip that the period cuts is the largest one and has no margin.
        assert_eq!(found, [(Border::Slip, 2.0, 0.25), (Border::Separation, 3.0, 0.125)]);
    }
}
