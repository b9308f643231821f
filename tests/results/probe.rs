//! The probe of files without a seal: messages about the end of its process.
#![cfg(unix)]

use crate::common::rows;
use std::ffi::OsString;
use std::path::Path;
use std::time::{Duration, Instant};
use stickslip::results::{Reason, run_probe};

fn said_of(script: &str) -> String {
    let command = ["sh", "-c", script].map(OsString::from);
    let verdict = run_probe(&command, Path::new("file.h5"), false);
    verdict.map_or_else(|reason| reason.to_string(), |()| "sound".to_owned())
}

/// Every end of the process has its message. Only the file's own faults are blamed on it.
#[test]
fn analytic_the_end_of_the_process_is_the_verdict() {
    for [script, words] in rows(
        "
        exit 0                   | sound
        echo of its own; exit 10 | truncated or damaged (of its own)
        echo too many; exit 11   | too many; no file of this program
        exit 12                  | in use by another program
        exit 13                  | was changed while it was read
        exit 101                 | damaged (the process that read it gave up)
        exit 2                   | ended by itself, with exit status: 2
        kill -SEGV $$            | damaged (the process that read it crashed with signal 11
        kill -XCPU $$            | damaged (reading it came to no end within 3 s of processor time)
        kill -KILL $$            | was ended from outside, with signal 9
    ",
    ) {
        let said = said_of(script);
        assert!(said.contains(words), "{script}: {said}");
    }
    let missing = run_probe(&["/no/such/program".into()], Path::new("file.h5"), false);
    assert!(matches!(missing, Err(Reason::NoReader(why)) if why.contains("did not start")));
}

/// A process that waits for ever is abandoned, and the file is not blamed.
#[cfg(target_os = "linux")]
#[test]
fn analytic_a_process_at_a_standstill_is_given_up() {
    let begun = Instant::now();
    let said = said_of("exec sleep 100");
    assert!(said.contains("neither computed nor read"), "{said}");
    // Three times the permitted standstill.
    assert!(begun.elapsed() < Duration::from_secs(18));
}
