//! Samples of a candidate that `stickslip compare` handles per second, and the cost of reading them.
//!
//! The candidate is an HDF5 file of another program with time and relative velocity: four million samples in the
//! stick-slip window of the built-in case `paper`. Its events have to be found, so that it is read twice.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use std::path::Path;
use stickslip::Run;
use stickslip::case::{Case, CaseSource, Override};
use stickslip::compare::{Mapping, Reference};
use stickslip::record::Recorder;
use stickslip::results::{ForeignFile, Header, Overwrite, ResultFile, ResultWriter, Status, StickSlipTable};
use stickslip::simulation::OutputWindow;

const SAMPLES: usize = 4_000_000;

fn write(path: &Path, case: &Case) {
    let header = Header {
        title: case.title.clone(),
        source: "benchmark".to_owned(),
        references: String::new(),
        history: String::new(),
        case_text: String::new(),
        resolved: case.resolved(),
        meta: Vec::new(),
        events: Vec::new(),
        asked: None,
        changed: Vec::new(),
        extension: Default::default(),
    };
    let mut writer = ResultWriter::create(path, Overwrite::Force, &[], &header).unwrap();
    let recorder: &mut dyn Recorder = &mut writer;
    Run::new(case).record(recorder).start().unwrap();
    writer
        .finish(Status::Complete, &StickSlipTable::default(), 0.0)
        .unwrap();
}

/// Writes some forty samples on the straight line between two samples of a result. Their values do not affect the
/// speed.
fn write_candidate(candidate: &Path, dense: &Path) {
    let file = ResultFile::open(dense).unwrap();
    let rows = file.sample_count().unwrap();
    let times = file.column("time", 0..rows).unwrap();
    let speeds = file.column("relative_velocity", 0..rows).unwrap();
    let mut points: Vec<(f64, f64)> = times.into_iter().zip(speeds).collect();
    // There may be no room between a sample and a neighbouring event.
    points.dedup_by(|b, a| b.0 - a.0 < 1e-9);
    let each = SAMPLES / (points.len() - 1);
    let line = |of: fn(&(f64, f64)) -> f64| -> Vec<f64> {
        let between = |a: f64, b: f64| (0..each).map(move |k| a + (b - a) * k as f64 / each as f64);
        points.windows(2).flat_map(|p| between(of(&p[0]), of(&p[1]))).collect()
    };
    let file = hdf5::File::create(candidate).unwrap();
    for (name, values) in [("time", line(|p| p.0)), ("relative_velocity", line(|p| p.1))] {
        file.new_dataset_builder().with_data(&values).create(name).unwrap();
    }
}

fn samples(c: &mut Criterion) {
    let folder = tempfile::tempdir().unwrap();
    let source = CaseSource::built_in("paper").unwrap();
    let mut case = Case::read(&source, &[] as &[Override]).unwrap();
    let reference = folder.path().join("paper.h5");
    write(&reference, &case);
    case.output.windows = vec![OutputWindow {
        from: 6.97,
        to: 6.99,
        interval: 0.02 / 100_000.0,
    }];
    let dense = folder.path().join("dense.h5");
    let candidate = folder.path().join("candidate.h5");
    write(&dense, &case);
    write_candidate(&candidate, &dense);
    let count = ForeignFile::open(&candidate).unwrap().shape("time").unwrap()[0];

    let mut group = c.benchmark_group("samples");
    group.sample_size(10).throughput(Throughput::Elements(count as u64));
    let opened = Reference::open(&reference).unwrap();
    group.bench_function("compare", |b| {
        b.iter(|| black_box(opened.compare(&candidate, &Mapping::default()).unwrap()));
    });
    group.bench_function("read twice", |b| {
        b.iter(|| {
            let file = ForeignFile::open(&candidate).unwrap();
            for _ in 0..2 {
                for name in ["time", "relative_velocity"] {
                    let column = file.column(name).unwrap();
                    for start in (0..count).step_by(65_536) {
                        black_box(
                            column
                                .read(std::slice::from_ref(&(start..count.min(start + 65_536))))
                                .unwrap(),
                        );
                    }
                }
            }
        });
    });
    group.finish();
}

criterion_group!(benches, samples);
criterion_main!(benches);
