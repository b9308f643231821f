//! The cost of an exact run by its number of digits: the last half second of the paper's brake, with its sticks and slips,
//! and a tenth of a second of sliding with as many digits as a case without a perturbation may need.
//!
//!     cargo bench --bench oracle

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use std::ops::ControlFlow;
use stickslip::case::{Case, CaseSource, Override};
use stickslip::model::system::ExactSystem;
use stickslip::oracle::{self, OracleOptions, rational};

/// `paper-si` from a lower speed, so that it stops after a quarter of a second.
fn short_brake() -> ExactSystem {
    let overrides = [
        "initial.speed=3",
        "actuation={profile=\"ramp\", force=2225, rise_time=0.02}",
        "perturbation=[{time=\"instability\", relative_velocity=1e-4}]",
    ]
    .map(|text| Override::parse(text).expect("an override"));
    let source = CaseSource::built_in("paper-si").expect("a case");
    Case::exact(&source, &overrides).expect("valid").system
}

fn runs(criterion: &mut Criterion) {
    let exact = short_brake();
    let mut group = criterion.benchmark_group("oracle");
    group.sample_size(10);
    for (digits, end) in [
        (13, "0.4"),
        (33, "0.4"),
        (52, "0.4"),
        (71, "0.4"),
        (187, "0.1"),
        (611, "0.01"),
    ] {
        let options = OracleOptions {
            digits,
            end_time: rational(end).expect("a decimal"),
            ..OracleOptions::default()
        };
        group.bench_function(
            BenchmarkId::from_parameter(format!("{digits} digits to {end} s")),
            |bencher| {
                bencher.iter(|| oracle::run(black_box(&exact), &options, &mut |_| ControlFlow::Continue(())));
            },
        );
    }
    group.finish();
}

criterion_group!(benches, runs);
criterion_main!(benches);
