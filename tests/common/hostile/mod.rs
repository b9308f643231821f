//! Files that nobody should write, and what a command may do with them: end by itself, with an exit status of its own.

use super::cli::Arguments;
use super::random_brakes::Random;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A command may take so long before it counts as one that never ends. Not a measurement: it is far above what any needs.
const PATIENCE: Duration = Duration::from_secs(240);
/// Memory of a process, in KiB of address space, so that what asks for more fails.
const MEMORY_KIB: usize = 1 << 20;

/// Runs the program on hostile input, with at most 1 GiB of memory for each of its processes.
///
/// # Panics
/// If it ends by a signal or a panic, with a status that it does not have, or not at all; if it prints what is not UTF-8 or
/// a message of HDF5's own, or says nothing of an error.
pub fn survive(folder: &Path, arguments: impl Arguments) -> (i32, String, String) {
    let arguments = arguments.list();
    let program = env!("CARGO_BIN_EXE_stickslip");
    let limited = format!("ulimit -v {MEMORY_KIB} && exec \"$0\" \"$@\"");
    let mut child = Command::new("sh")
        .args(["-c", &limited, program])
        .args(&arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(std::fs::File::create(folder.join("stdout")).unwrap())
        .stderr(std::fs::File::create(folder.join("stderr")).unwrap())
        .spawn()
        .unwrap();
    let since = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if since.elapsed() > PATIENCE {
            child.kill().unwrap();
            child.wait().unwrap();
            panic!("{arguments:?} came to no end");
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    let text = |name: &str| {
        let bytes = std::fs::read(folder.join(name)).unwrap();
        String::from_utf8(bytes).unwrap_or_else(|_| panic!("{arguments:?} printed what is not UTF-8"))
    };
    let (stdout, stderr) = (text("stdout"), text("stderr"));
    let code = status
        .code()
        .unwrap_or_else(|| panic!("{arguments:?} ended by {status}: {stderr}"));
    assert!((0..=2).contains(&code), "{arguments:?}: {code}, {stderr}");
    for word in ["panicked", "HDF5-DIAG", "free()", "malloc()", "realloc()"] {
        assert!(!stderr.contains(word), "{arguments:?}: {stderr}");
    }
    assert!(
        code == 0 || stderr.starts_with("stickslip: "),
        "{arguments:?}: {stderr}"
    );
    (code, stdout, stderr)
}

/// Damages a file: bits that flip, a lost end, overwritten ranges, blocks that change places, in any number.
pub fn damage(bytes: &mut Vec<u8>, dice: &mut Random) {
    // Structures of HDF5 begin with these: damage behind them does more than in the middle of numbers.
    let marks: Vec<usize> = [b"TREE", b"HEAP", b"SNOD", b"GCOL", b"OHDR", b"FRHP", b"BTHD"]
        .iter()
        .flat_map(|mark| (0..bytes.len().saturating_sub(4)).filter(|&at| bytes[at..].starts_with(*mark)))
        .collect();
    for _ in 0..1 + dice.below(6) {
        let length = bytes.len();
        if length < 64 {
            return;
        }
        let at = match dice.below(3) {
            0 if !marks.is_empty() => (marks[dice.below(marks.len())] + dice.below(256)).min(length - 1),
            1 => dice.below(length.min(4096)),
            _ => dice.below(length),
        };
        match dice.below(7) {
            0 => bytes[at] ^= 1 << dice.below(8),
            1 => bytes[at] = dice.bits() as u8,
            2 => {
                let end = (at + 1 + dice.below(16)).min(length);
                bytes[at..end].fill([0, 0xff, 0x7f][dice.below(3)]);
            }
            3 => {
                let end = (at + 8).min(length);
                let number = (dice.bits() >> dice.below(64)).to_le_bytes();
                bytes[at..end].copy_from_slice(&number[..end - at]);
            }
            4 => {
                let block = 8 << dice.below(8);
                let other = dice.below(length);
                if at.abs_diff(other) >= block && at.max(other) + block <= length {
                    for k in 0..block {
                        bytes.swap(at + k, other + k);
                    }
                }
            }
            5 if dice.below(4) == 0 => bytes.truncate(at),
            _ => {
                let end = (at + 1 + dice.below(64)).min(length);
                for byte in &mut bytes[at..end] {
                    *byte = dice.bits() as u8;
                }
            }
        }
    }
}
