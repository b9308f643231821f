//! Runs of two trains: cycles of a block on a belt by method, and by the number of inertias.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use stickslip::Run;
use stickslip::case::{Case, CaseSource, Origin};
use stickslip::simulation::{Following, Method, OutputOptions, SolverOptions};

fn run(case: &Case, method: Method, end_time: f64) -> usize {
    let solver = SolverOptions {
        method,
        max_events: 1_000_000,
        ..case.solver.clone()
    };
    let output = OutputOptions {
        end_time,
        interval: end_time,
        windows: Vec::new(),
        steps: false,
        follow: Following::default(),
    };
    let report = Run::of_system(&case.system, 0.0, &solver, &output).start().unwrap();
    report.events.len()
}

/// A chain of so many equal inertias on a belt.
fn chain(inertias: usize) -> Case {
    let list = |value: f64| format!("{:?}", vec![value; inertias]);
    let text = format!(
        "motion = \"translation\"\n[rotor]\nend = \"driven\"\nspeed = 0.2\n[stator]\nend = \"fixed\"\ninertia = {}\n\
         stiffness = {}\ndamping = {}\n[contact]\nnormal_force = 1.0\n[friction]\nlaw = \"hyperbolic\"\nbreakaway = 1.0\n\
         low_speed = 1.0\nhigh_speed = 0.3\nscale = 0.3\n[output]\nend_time = 400.0\n",
        list(1.0),
        list(4.0),
        list(0.02)
    );
    let source = CaseSource {
        text,
        origin: Origin::File("chain.toml".into()),
    };
    Case::read(&source, &[]).unwrap()
}

fn trains(criterion: &mut Criterion) {
    let belt = Case::read(&CaseSource::built_in("belt-leine").unwrap(), &[]).unwrap();
    let mut cycles = criterion.benchmark_group("1000 cycles of Leine's belt");
    cycles.sample_size(10);
    for method in [Method::Series, Method::Arkode] {
        cycles.bench_function(method.name(), |bencher| {
            bencher.iter(|| black_box(run(&belt, method, 12_006.0)));
        });
    }
    cycles.finish();
    let mut chains = criterion.benchmark_group("400 s of a chain on a belt by series");
    chains.sample_size(10);
    for inertias in [1, 5, 20] {
        let case = chain(inertias);
        chains.bench_function(BenchmarkId::from_parameter(inertias), |bencher| {
            bencher.iter(|| black_box(run(&case, Method::Series, 400.0)));
        });
    }
    chains.finish();
}

criterion_group!(benches, trains);
criterion_main!(benches);
