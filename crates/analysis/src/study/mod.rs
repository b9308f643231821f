//! Common parts of all studies: the reader of study files (`reading`), their head, the kind of a
//! text (`kind`), and the builder of a run into a file.

mod head;
mod keys;
mod kind;
mod reading;

pub(crate) use head::{PROBES, check_points, hash_of, written};
pub use head::{StudyHead, StudySource};
pub(crate) use keys::keys;
pub use keys::{StudyKey, StudyKeyTable, tables};
pub use kind::{TextKind, kind_of};
pub(crate) use reading::{StudyReader, plain};

use crate::earlier::spare_study;
use crate::error::Error;
use crate::sweep::{Executor, Existing, Journal, Shard, journal_path};
use std::path::{Path, PathBuf};
use stickslip_engine::workers::processors;
use stickslip_files::{FileKind, Overwrite, Reservation, StudyHeader};
use stickslip_system::watch::Watch;

/// Builder of a study's run into a file; `start` computes it.
///
/// Every outcome first goes to a journal next to the file, from which an interrupted study can resume. A complete file
/// replaces the journal.
#[must_use = "nothing is computed before `start`"]
pub struct StudyRun<'a, S> {
    pub(crate) study: &'a S,
    pub(crate) path: &'a Path,
    pub(crate) overwrite: Overwrite,
    pub(crate) resume: bool,
    pub(crate) watch: &'a dyn Watch,
    pub(crate) workers: usize,
    pub(crate) shard: Option<Shard>,
    pub(crate) executor: Option<&'a mut dyn Executor>,
}

impl<'a, S> StudyRun<'a, S> {
    /// Run of a study. By default, the file may only replace results of this program.
    pub fn new(study: &'a S, path: &'a Path) -> Self {
        StudyRun {
            study,
            path,
            overwrite: Overwrite::OwnResults,
            resume: false,
            watch: &(),
            workers: processors(),
            shard: None,
            executor: None,
        }
    }

    /// Sets which files may be replaced.
    pub fn overwrite(mut self, overwrite: Overwrite) -> Self {
        self.overwrite = overwrite;
        self
    }

    /// Resumes an interrupted run of the same study.
    pub fn resume(mut self, resume: bool) -> Self {
        self.resume = resume;
        self
    }

    /// Sets the observer, which learns the progress, and may interrupt the study.
    pub fn watch(mut self, watch: &'a dyn Watch) -> Self {
        self.watch = watch;
        self
    }

    /// Sets the number of threads.
    pub fn workers(mut self, workers: usize) -> Self {
        self.workers = workers;
        self
    }

    /// Reserves the place of the file, unless it holds a study of another kind or with other settings.
    pub(crate) fn place(
        &self,
        kind: FileKind,
        header: &StudyHeader,
        digest: Option<&str>,
        inputs: &[PathBuf],
    ) -> Result<Reservation, Error> {
        spare_study(self.path, self.overwrite, kind, header, digest, None)?;
        Ok(Reservation::take(self.path, self.overwrite, inputs)?)
    }

    pub(crate) fn journal(&self, digest: &str) -> Result<Journal, Error> {
        let existing = match (self.resume, self.overwrite) {
            (true, _) => Existing::Resume,
            (false, Overwrite::Force) => Existing::Discard,
            (false, _) => Existing::Refuse,
        };
        Journal::open(&journal_path(self.path), digest, existing)
    }
}
