//! Costs of the built-in reference runs, as snapshots: a change of cost must be seen and accepted.
//!
//! After an intended change: `INSTA_UPDATE=always cargo test --test reference solver_counters::`, and read the diff.
//!
//! The last bit of a right-hand side decides which steps a solver takes. It depends on the mathematical library and
//! the processor. If both are those of the snapshots, every count must agree exactly; otherwise within [`SHARE`].

use crate::common::cases::built_in;
use std::fmt::Write as _;
use stickslip::record::Segment;
use stickslip::simulation::{Method, SolverOptions};

type Counter = fn(&Segment) -> u64;

/// Sums over the segments of each solver.
fn counters(case: &str, method: Method) -> String {
    let case = built_in(case, &[]);
    let solver = SolverOptions {
        method,
        ..case.solver.clone()
    };
    let (recorder, _) = crate::common::run(&crate::common::disks(&case), &solver, &case.output);
    let mut solvers: Vec<&'static str> = recorder.segments.iter().map(|s| s.solver).collect();
    solvers.sort_unstable();
    solvers.dedup();
    let mut text = format!(
        "events: {}\nsamples: {}\n",
        recorder.events.len(),
        recorder.samples.len()
    );
    for solver in solvers {
        let segments: Vec<&Segment> = recorder.segments.iter().filter(|s| s.solver == solver).collect();
        writeln!(text, "{solver}: {} segments", segments.len()).unwrap();
        let counts: [(&str, Counter); 8] = [
            ("steps", |s| s.counters.steps),
            ("right-hand sides", |s| s.counters.rhs_evaluations),
            ("Jacobians", |s| s.counters.jacobian_evaluations),
            ("linear solver setups", |s| s.counters.linear_solver_setups),
            ("refused steps", |s| s.counters.error_test_failures),
            ("nonlinear iterations", |s| s.counters.nonlinear_iterations),
            ("nonlinear failures", |s| s.counters.nonlinear_convergence_failures),
            ("guard evaluations", |s| s.counters.root_evaluations),
        ];
        for (name, count) in counts {
            let sum: u64 = segments.iter().map(|s| count(s)).sum();
            if sum > 0 {
                writeln!(text, "  {name}: {sum}").unwrap();
            }
        }
    }
    text
}

/// Relative difference of a count, or absolute difference if that is larger, under another arithmetic. With glibc's
/// variants of exp, sin and cos for processors without fused multiply-add, whose last bits differ, steps and
/// right-hand sides differ by at most 3 %, and rarer counts, such as Jacobians and refused steps, by at most 8 % or by
/// one (GLIBC_TUNABLES=glibc.cpu.hwcaps=-FMA,-AVX2). Another compiler of SUNDIALS may add as much.
const SHARE: f64 = 0.2;
const AT_LEAST: f64 = 10.0;

/// Digest (FNV-1a) of exp, sin and cos at ten thousand places on the machine of the snapshots: x86-64, glibc 2.36,
/// with fused multiply-add.
const DIGEST: u64 = 0x1057_6ee4_552a_cc61;

fn digest() -> u64 {
    (0..10_000)
        .map(|k| std::hint::black_box(-1e-3 * f64::from(k)))
        .flat_map(|x| [x.exp(), x.sin(), x.cos()])
        .flat_map(f64::to_le_bytes)
        .fold(0xcbf2_9ce4_8422_2325, |digest: u64, byte| {
            (digest ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        })
}

fn hold(name: &str, counters: &str) {
    // On other processors a C compiler may fuse operations in ways that Rust's mathematical functions do not reveal.
    let digest = digest();
    if cfg!(target_arch = "x86_64") && digest == DIGEST {
        insta::assert_snapshot!(name, counters);
        return;
    }
    println!("another arithmetic (digest {digest:#x}): counters within {SHARE} of the snapshot");
    let path = format!(
        "{}/tests/regression/snapshots/reference__regression__solver_counters__{name}.snap",
        env!("CARGO_MANIFEST_DIR")
    );
    let snapshot = std::fs::read_to_string(path).unwrap();
    let expected = snapshot.splitn(3, "---\n").nth(2).expect("a header and the text");
    let rows = |text: &str| -> Vec<(String, f64)> {
        text.lines()
            .map(|line| line.split_once(": ").expect("a name and a count"))
            .map(|(name, count)| (name.to_owned(), count.split(' ').next().unwrap().parse().unwrap()))
            .collect()
    };
    let (expected, found) = (rows(expected), rows(counters));
    for ((name, expected), (found_name, found)) in expected.iter().zip(&found) {
        assert_eq!(name, found_name, "{counters}");
        // Events, samples and segments belong to the solution, not to the steps.
        let bound = if name.starts_with(' ') {
            (SHARE * expected).max(AT_LEAST)
        } else {
            0.0
        };
        assert!((found - expected).abs() <= bound, "{name}: {found}, not {expected}");
    }
    assert_eq!(expected.len(), found.len(), "{counters}");
}

#[test]
fn regression_counters_of_paper_by_arkode() {
    hold("paper-arkode", &counters("paper", Method::Arkode));
}

#[test]
fn regression_counters_of_paper_si_by_cvode() {
    hold("paper-si", &counters("paper-si", Method::Cvode));
}

#[test]
fn regression_counters_of_paper_by_cvode() {
    hold("paper", &counters("paper", Method::Cvode));
}
