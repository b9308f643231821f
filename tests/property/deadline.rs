//! A wall time that ends a certification: missing parts, and their reasons.

mod certification {
    use std::time::Instant;
    use stickslip::Run;
    use stickslip::analysis::Deadline;
    use stickslip::analysis::certification::{Certify, of_written};
    use stickslip::analysis::certify;
    use stickslip::case::{Case, CaseSource, Override, WrittenCase};
    use stickslip::record::MemoryRecorder;

    #[test]
    fn property_after_the_deadline_there_are_no_reruns() {
        let settings = [
            "initial.speed=3",
            "actuation={profile=\"ramp\", force=2225, rise_time=0.02}",
            "perturbation=[{time=\"instability\", relative_velocity=1e-4}]",
            "output={end_time=0.4, interval=0.01}",
        ];
        let short = settings.map(|setting| Override::parse(setting).unwrap());
        let source = CaseSource::built_in("paper").unwrap();
        let case = Case::read(&source, &short).unwrap();
        let written = WrittenCase::read(&source, &short).unwrap();
        let mut result = MemoryRecorder::default();
        Run::new(&case).record(&mut result).start().unwrap();
        let certificate = certify(&case, &result, &|| false).unwrap();
        let found = |deadline: &Deadline, stop: bool| {
            of_written(&written, &certificate, &result.events, deadline, &|| stop)
                .unwrap()
                .result
                .unwrap()
        };
        let nothing = Deadline::after(Instant::now(), Some(0.0));
        let late = found(&nothing, false);
        let why = late.without_reruns.unwrap();
        assert!(why.contains("wall time of 0 s was over"), "{why}");
        assert!(late.rows.iter().all(|row| row.reruns.is_none()));
        assert!(late.rows.iter().any(|row| row.slope.is_some()));
        let stopped = found(&nothing, true);
        assert_eq!(stopped.without_reruns.as_deref(), Some("interrupted"));
        let whole = found(&Deadline::default(), false);
        assert_eq!(whole.without_reruns, None);
        assert!(whole.rows.iter().any(|row| row.reruns.is_some()));
        // The ladder, too, gets only the remaining time.
        let late = Certify::new(&case).until(nothing).start(&result);
        assert!(
            matches!(&late, Err(error) if error.message.contains("wall time")),
            "{late:?}"
        );
    }
}

mod limits {
    use std::time::Instant;
    use stickslip::analysis::Deadline;

    #[test]
    fn property_a_limit_is_never_more_than_what_is_left() {
        let now = Instant::now();
        let none = Deadline::after(now, None);
        assert!(!none.is_over() && !Deadline::default().is_over());
        assert_eq!((none.limit(None), none.limit(Some(3.0))), (None, Some(3.0)));
        let nothing = Deadline::after(now, Some(0.0));
        assert!(nothing.is_over());
        assert_eq!((nothing.limit(None), nothing.limit(Some(3.0))), (Some(0.0), Some(0.0)));
        let hour = Deadline::after(now, Some(3600.0));
        assert!(!hour.is_over());
        assert_eq!(hour.limit(Some(3.0)), Some(3.0));
        assert!(hour.limit(None).is_some_and(|left| left > 0.0 && left <= 3600.0));
        // Beyond the range of every clock.
        assert!(!Deadline::after(now, Some(1e300)).is_over());
    }

    #[test]
    fn property_who_stopped_a_part_is_told_apart() {
        let deadline = Deadline::after(Instant::now(), Some(3.0));
        assert_eq!(deadline.explain("interrupted".to_owned(), true), "interrupted");
        assert_eq!(deadline.explain("no series".to_owned(), false), "no series");
        let said = deadline.explain("interrupted".to_owned(), false);
        assert!(said.contains("3 s") && said.contains("--max-wall-time"), "{said}");
    }
}
