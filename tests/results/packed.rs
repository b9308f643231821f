//! Chunks that are packed outside HDF5.

use crate::common::results::{header, sample, stick_slip};
use proptest::prelude::*;
use stickslip::record::{Recorder, Sample};
use stickslip::results::packed::fletcher32;
use stickslip::results::{Overwrite, ResultWriter, Status};

/// The checksum as defined in HDF5's documentation, word by word.
fn by_words(bytes: &[u8]) -> u32 {
    let (mut first, mut second) = (0_u32, 0_u32);
    for pair in bytes.chunks(2) {
        let word = u32::from(pair[0]) << 8 | u32::from(pair.get(1).copied().unwrap_or(0));
        first += word;
        first = (first & 0xffff) + (first >> 16);
        second += first;
        second = (second & 0xffff) + (second >> 16);
    }
    second << 16 | first
}

proptest! {
    #[test]
    fn property_sums_are_those_of_single_words(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
        prop_assert_eq!(fletcher32(&bytes), by_words(&bytes));
    }
}

#[test]
fn property_sums_of_long_and_of_full_words() {
    for bytes in [vec![0; 300_000], vec![0xff; 300_001], vec![0xff; 2]] {
        assert_eq!(fletcher32(&bytes), by_words(&bytes));
    }
}

/// HDF5 itself unpacks the chunks. A chunk that was not full when the file was saved is written again.
#[test]
fn property_chunks_are_read_by_the_library() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.h5");
    let mut writer = ResultWriter::create(&path, Overwrite::OwnResults, &[], &header()).unwrap();
    for row in 0..5000 {
        writer.sample(&sample(row)).unwrap();
        if [69, 100, 4200].contains(&row) {
            writer.flush().unwrap();
        }
    }
    writer.finish(Status::Complete, &stick_slip(), 0.25).unwrap();
    let file = hdf5::File::open(&path).unwrap();
    for (name, channel) in [
        ("time", (|row| row.time) as fn(Sample) -> f64),
        ("z", |row| row.state.z),
        ("normal_force", |row| row.channels.normal_force),
    ] {
        let dataset = file.dataset(&format!("trajectory/{name}")).unwrap();
        let found = dataset.read_raw::<f64>().unwrap();
        let expected: Vec<u64> = (0..5000).map(|row| channel(sample(row)).to_bits()).collect();
        let got = found.into_iter().map(f64::to_bits).collect::<Vec<_>>();
        assert_eq!(got, expected, "{name}");
    }
}
