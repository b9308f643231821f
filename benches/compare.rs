//! How many samples of a candidate a second `stickslip compare` goes through, beside what reading them costs.
//!
//! The candidate is an HDF5 file of another program with time and relative velocity, of four million samples over the
//! stick-slip of the built-in case `paper`; its events have to be found, so it is read twice.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use std::ops::ControlFlow;
use std::path::Path;
use stickslip::analysis::compare::{Mapping, Reference};
use stickslip::case::{Case, CaseSource, Override};
use stickslip::results::{ForeignFile, Header, Overwrite, ResultWriter, Status, StickSlipTable};
use stickslip::simulation::{OutputWindow, Recorder, simulate};

const SAMPLES: usize = 4_000_000;

fn write(path: &Path, case: &Case, recorder_to: &mut dyn FnMut(&Path)) {
    let header = Header {
        title: case.title.clone(),
        source: "benchmark".to_owned(),
        references: String::new(),
        history: String::new(),
        case_text: String::new(),
        resolved: case.resolved(),
        meta: Vec::new(),
        events: Vec::new(),
    };
    let mut writer = ResultWriter::create(path, Overwrite::Force, &[], &header).unwrap();
    let recorder: &mut dyn Recorder = &mut writer;
    let go_on = &mut |_| ControlFlow::Continue(());
    simulate(&case.parameters, &case.solver, &case.output, recorder, go_on).unwrap();
    writer
        .finish(Status::Complete, &StickSlipTable::default(), 0.0)
        .unwrap();
    recorder_to(path);
}

fn samples(c: &mut Criterion) {
    let folder = tempfile::tempdir().unwrap();
    let source = CaseSource::built_in("paper").unwrap();
    let mut case = Case::parse(&source, &[] as &[Override]).unwrap();
    let reference = folder.path().join("paper.h5");
    write(&reference, &case, &mut |_| {});
    case.output.windows = vec![OutputWindow {
        from: 6.97,
        to: 6.99,
        interval: 0.02 / 100_000.0,
    }];
    let dense = folder.path().join("dense.h5");
    let candidate = folder.path().join("candidate.h5");
    write(&dense, &case, &mut |path| {
        let file = stickslip::results::ResultFile::open(path).unwrap();
        let rows = file.sample_count().unwrap();
        let times = file.column("time", 0..rows).unwrap();
        let speeds = file.column("relative_velocity", 0..rows).unwrap();
        // Forty samples on the straight line between two: what they hold does not matter for the speed.
        let each = SAMPLES / (rows - 1);
        let line = |values: &[f64]| -> Vec<f64> {
            let points = values.windows(2);
            points
                .flat_map(|p| (0..each).map(move |k| p[0] + (p[1] - p[0]) * k as f64 / each as f64))
                .collect()
        };
        let file = hdf5::File::create(&candidate).unwrap();
        for (name, values) in [("time", line(&times)), ("relative_velocity", line(&speeds))] {
            file.new_dataset_builder().with_data(&values).create(name).unwrap();
        }
    });
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
                        black_box(column.read(start..count.min(start + 65_536)).unwrap());
                    }
                }
            }
        });
    });
    group.finish();
}

criterion_group!(benches, samples);
criterion_main!(benches);
