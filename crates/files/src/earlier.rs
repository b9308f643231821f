//! What an existing file of this program holds.

use super::schema::{self, group, root};
use super::source::FileSource;
use std::path::Path;

/// Kinds of files of this program, in the words of messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// Result of a run.
    Run,
    /// Result of a run with a certificate.
    CertifiedRun,
    /// One period of a periodic motion.
    Cycle,
    /// The same with a certificate.
    CertifiedCycle,
    /// Points of a sweep.
    Sweep,
    /// Runs of a calibration.
    Calibration,
    /// A part of a sweep.
    Shard,
    /// Runs of a work-precision study.
    WorkPrecision,
    /// Branches of a continuation.
    Branches,
}

impl FileKind {
    /// The kind of the file at `path`; `None` if it is no readable file of this program.
    pub fn of(path: &Path) -> Option<FileKind> {
        let source = FileSource::open_known(path).ok()?;
        let members = source.members("").unwrap_or_default();
        let has = |name: &str| members.iter().any(|member| member.name == name);
        let format = source.text_attribute("", root::FORMAT).ok()??;
        Some(match format.as_str() {
            schema::FORMAT if has(group::CYCLE_CERTIFICATE) => FileKind::CertifiedCycle,
            schema::FORMAT if has(group::CYCLE) => FileKind::Cycle,
            schema::FORMAT if has(group::CERTIFICATE) => FileKind::CertifiedRun,
            schema::FORMAT => FileKind::Run,
            schema::SWEEP_FORMAT if has(CALIBRATION) => FileKind::Calibration,
            schema::SWEEP_FORMAT => FileKind::Sweep,
            schema::SWEEP_SHARD_FORMAT => FileKind::Shard,
            schema::WORK_PRECISION_FORMAT => FileKind::WorkPrecision,
            schema::CONTINUATION_FORMAT => FileKind::Branches,
            _ => return None,
        })
    }

    /// The kind in words, without an article.
    pub fn name(self) -> &'static str {
        match self {
            FileKind::Run => "run",
            FileKind::CertifiedRun => "certified run",
            FileKind::Cycle => "cycle",
            FileKind::CertifiedCycle => "certified cycle",
            FileKind::Sweep => "sweep",
            FileKind::Calibration => "calibration",
            FileKind::Shard => "part of a sweep",
            FileKind::WorkPrecision => "work-precision study",
            FileKind::Branches => "continuation",
        }
    }

    /// Whether a file of this kind has everything that one of another kind has, if both have the same settings.
    pub fn includes(self, other: FileKind) -> bool {
        self == other
            || matches!(
                (self, other),
                (FileKind::CertifiedRun, FileKind::Run) | (FileKind::CertifiedCycle, FileKind::Cycle)
            )
    }
}

/// Group of a calibration's parameters.
pub const CALIBRATION: &str = "calibration";
