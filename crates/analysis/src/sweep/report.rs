//! Report of a sweep.

use super::curves::Boundaries;
use std::path::PathBuf;

/// Result of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepReport {
    /// Sweep file, or partial file of an interrupted sweep.
    pub file: PathBuf,
    /// Whether the sweep was interrupted; it can be resumed.
    pub interrupted: bool,
    /// Finished points in the file.
    pub points: u64,
    /// Points that this start has run.
    pub run_now: u64,
    /// Failed points and reasons. If there are many, only the first ones.
    pub failures: Vec<(u64, String)>,
    /// Points whose run failed.
    pub failed: u64,
    /// Points without a lasting stick, or without a lasting motion; `None` if the sweep was already complete.
    pub unfinished: Option<u64>,
    /// Boundaries, in a boundary study.
    pub boundaries: Option<Boundaries>,
}

pub(super) const NAMED_FAILURES: usize = 5;
