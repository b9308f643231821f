//! Progress and report of a sweep.

use super::curves::Boundaries;
use std::path::PathBuf;

/// How far a sweep is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SweepProgress {
    /// Points that are done, with those of an earlier start.
    pub done: u64,
    /// Points of the study, or as many as are known of so far.
    pub total: u64,
    /// Whether there may be more than [`Self::total`].
    pub open: bool,
    /// Number of points whose run failed.
    pub failed: u64,
}

/// What a sweep came to.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepReport {
    /// The sweep file, or the partial file of an interrupted sweep.
    pub file: PathBuf,
    /// Somebody ended the sweep; it can be resumed.
    pub interrupted: bool,
    /// Points in the file that are done.
    pub points: u64,
    /// Points that were run now, not before.
    pub run_now: u64,
    /// Points that failed, by number, and why; the first of them only, if there are many.
    pub failures: Vec<(u64, String)>,
    /// Number of points whose run failed.
    pub failed: u64,
    /// Points whose runs end before a stick that lasts, so that their sticks may not be all; of trains, before the motion
    /// repeats itself or settles. Not counted again for a sweep that had been complete before.
    pub unfinished: Option<u64>,
    /// Of a study of a boundary.
    pub boundaries: Option<Boundaries>,
}

/// This many failures are named in a report.
pub(super) const NAMED_FAILURES: usize = 5;
