//! Runs of two trains: cycles of a block on a belt by method, and the cost of a step by the number of inertias.
//!
//!     cargo bench --bench trains
//!
//! The lines "a step" give this cost: the shortest time of five runs to 300 s minus that of five runs to 50 s, over the
//! difference of their steps. This leaves out the cost of a run before its first step.

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use std::time::Instant;
use stickslip::Run;
use stickslip::case::{Case, CaseSource, Origin};
use stickslip::simulation::{Following, Method, OutputOptions, RunReport, SolverOptions};

fn run(case: &Case, method: Method, end_time: f64) -> RunReport {
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
    Run::of_system(&case.system, 0.0, &solver, &output).start().unwrap()
}

/// A chain of this many equal inertias on a belt.
fn chain(inertias: u32) -> Case {
    let list = |value: f64| format!("{:?}", vec![value; inertias as usize]);
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
    // `cargo test` runs benchmarks, too.
    if std::env::args().any(|argument| argument == "--bench") {
        for method in [Method::Series, Method::Cvode, Method::CvodeBdf, Method::Arkode] {
            costs_of_a_step(method);
        }
    }
}

/// Prints the cost of a step in chains of several lengths, and its ratio to the number of inertias.
fn costs_of_a_step(method: Method) {
    let shortest = |case: &Case, end_time: f64| {
        let runs = (0..5).map(|_| {
            let clock = Instant::now();
            let report = black_box(run(case, method, end_time));
            let steps: u64 = report.work.iter().map(|work| work.steps).sum();
            (clock.elapsed().as_secs_f64(), steps as f64)
        });
        runs.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
    };
    for inertias in [1, 3, 10, 30, 100] {
        let case = chain(inertias);
        let (short, long) = (shortest(&case, 50.0), shortest(&case, 300.0));
        let microseconds = 1e6 * (long.0 - short.0) / (long.1 - short.1);
        println!(
            "{inertias:4} inertias by {}: a step {microseconds:.2} us, {:.3} us an inertia; before the first {:.1} ms",
            method.name(),
            microseconds / f64::from(inertias),
            1e3 * (short.0 - 1e-6 * microseconds * short.1)
        );
    }
}

criterion_group!(benches, trains);
criterion_main!(benches);
