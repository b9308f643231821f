//! Data that are written are read back unchanged.

use crate::common::results::{Rows, bits, header, record, stick_slip, write};
use stickslip::record::{Channels, Recorder, State};
use stickslip::results::{AttributeValue, Overwrite, ResultFile, ResultWriter, Status};

fn read(file: &ResultFile) -> Rows {
    Rows {
        samples: file.samples(0..file.sample_count().unwrap()).unwrap(),
        events: file.events().unwrap(),
        segments: file.segments().unwrap(),
        ..Rows::default()
    }
}

/// Over several chunks, the last of which is incomplete.
#[test]
fn roundtrip_rows_are_read_back_bit_by_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.h5");
    for count in [0, 1, 4096, 9000, 30_000] {
        write(&path, count);
        let mut expected = Rows::default();
        record(&mut expected, count).unwrap();
        let file = ResultFile::open(&path).unwrap();
        assert_eq!(bits(&read(&file)), bits(&expected), "{count} samples");
        let blocks: Vec<f64> = file.column_blocks("theta").unwrap().flat_map(Result::unwrap).collect();
        let wanted = expected.samples.iter().map(|row| row.state.theta).collect::<Vec<_>>();
        assert_eq!(blocks, wanted);
    }
}

#[test]
fn roundtrip_header_and_stick_slip() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.h5");
    write(&path, 500);
    let file = ResultFile::open(&path).unwrap();
    let header = header();
    assert_eq!(file.status(), &Status::Complete);
    assert_eq!(file.title(), header.title);
    assert_eq!(file.case_text().unwrap(), header.case_text);
    assert_eq!(file.resolved().unwrap(), header.resolved);
    assert_eq!(file.text("history").unwrap(), header.history);
    let meta = file.meta().unwrap();
    assert!(meta.contains(&("rtol".to_owned(), AttributeValue::Number(1e-10))));
    assert!(meta.contains(&("wall_time_s".to_owned(), AttributeValue::Number(0.25))));
    assert!(meta.contains(&("method".to_owned(), AttributeValue::Text("arkode".to_owned()))));
    // Compared by Debug, because NaN is not equal to itself.
    let found = format!("{:?}", file.stick_slip().unwrap().unwrap());
    assert_eq!(found, format!("{:?}", stick_slip()));
}

#[test]
fn roundtrip_failed_run_keeps_its_rows_and_its_message() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.h5");
    let mut writer = ResultWriter::create(&path, Overwrite::OwnResults, &[], &header()).unwrap();
    record(&mut writer, 700).unwrap();
    let failed = Status::Failed("too much work at t = 6.97 s".to_owned());
    let partial = writer.finish(failed.clone(), &stick_slip(), 1.0).unwrap();
    assert_eq!(partial, folder.path().join("run.partial.h5"));
    assert!(!path.exists());
    let file = ResultFile::open(&partial).unwrap();
    assert_eq!(file.status(), &failed);
    assert_eq!(file.sample_count().unwrap(), 700);
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig::with_cases(32))]

    /// Any bit pattern of a double in any column, including payloads of NaN.
    #[test]
    fn property_any_double_is_read_back_bit_by_bit(
        patterns in proptest::collection::vec(proptest::num::u64::ANY, 1..200),
    ) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.h5");
        let mut expected = Rows::default();
        let mut writer = ResultWriter::create(&path, Overwrite::OwnResults, &[], &header()).unwrap();
        for (row, pattern) in patterns.iter().enumerate() {
            let value = |k: usize| f64::from_bits(pattern.rotate_left(k as u32));
            let mut sample = crate::common::results::sample(row);
            sample.state = State::from_values(std::array::from_fn(value));
            sample.channels = Channels::from_values(std::array::from_fn(|k| value(k + 20)));
            let mut event = crate::common::results::event(row);
            event.after = State::from_values(std::array::from_fn(|k| value(k + 40)));
            for recorder in [&mut writer as &mut dyn Recorder, &mut expected] {
                recorder.sample(&sample).unwrap();
                recorder.event(&event).unwrap();
            }
            if row % 50 == 7 {
                writer.flush().unwrap();
            }
        }
        writer.finish(Status::Complete, &stick_slip(), 0.0).unwrap();
        let read = read(&ResultFile::open(&path).unwrap());
        proptest::prop_assert_eq!(bits(&read), bits(&expected));
    }
}
