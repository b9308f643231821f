//! Instructions of the whole command: the paper's case by `series` without a witness, with its 21,653 samples and without
//! them, and the start of the program alone. The load of the machine changes the count by a thousandth, because a file
//! that takes more than a second is flushed.
//!
//!     cargo bench --bench instructions
//!
//! It needs valgrind, whose tool callgrind counts. The limits hold on an x86-64 with AVX2, with Debian 12's HDF5 1.10.8
//! and C library 2.36. Other machines differ by some per cent, so that it fails only if the whole is a twentieth above.

use std::error::Error;
use std::path::Path;
use std::process::Command;

/// Most instructions of the whole command, and bytes of its file.
const MOST_INSTRUCTIONS: u64 = 300_000_000;
const MOST_BYTES: u64 = 2_500_000;

const RUN: &[&str] = &[
    "run",
    "paper",
    "--method",
    "series",
    "--no-witness",
    "--quiet",
    "-o",
    "run.h5",
];
/// Only the first and the last sample are left.
const WITHOUT_SAMPLES: &[&str] = &[
    "--set",
    "output.interval=10",
    "--set",
    "output.window=[]",
    "--set",
    "output.around=none",
];

fn instructions(folder: &Path, arguments: &[&str]) -> Result<u64, Box<dyn Error>> {
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(env!("CARGO_BIN_EXE_stickslip"))
        .args(arguments)
        .current_dir(folder)
        .output()?;
    let said = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() {
        return Err(said.into());
    }
    let count = said.lines().find_map(|line| line.split_once("Collected :"));
    let (_, count) = count.ok_or_else(|| format!("no count in what valgrind says: {said}"))?;
    Ok(count.trim().parse()?)
}

fn main() -> Result<(), Box<dyn Error>> {
    // `cargo test` runs benchmarks, too.
    if !std::env::args().any(|argument| argument == "--bench") {
        return Ok(());
    }
    let folder = tempfile::tempdir()?;
    let within = folder.path();
    let whole = instructions(within, RUN)?;
    let bytes = std::fs::metadata(within.join("run.h5"))?.len();
    std::fs::remove_file(within.join("run.h5"))?;
    let without = instructions(within, &[RUN, WITHOUT_SAMPLES].concat())?;
    let start = instructions(within, &["--version"])?;
    for (what, count) in [
        ("run paper --method series --no-witness", whole),
        ("without samples", without),
        ("--version", start),
    ] {
        println!("{:6.1} million instructions  {what}", count as f64 / 1e6);
    }
    println!("{:6.2} MB  its file", bytes as f64 / 1e6);
    println!("promised: at most {MOST_INSTRUCTIONS} instructions and {MOST_BYTES} bytes");
    if whole > MOST_INSTRUCTIONS / 20 * 21 || bytes > MOST_BYTES {
        return Err("more than is promised".into());
    }
    Ok(())
}
