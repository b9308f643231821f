//! What can go wrong with a result file: what, where, and what to do.

use std::io;
use std::path::{Path, PathBuf};

/// An error of the result file; each message names the file and the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "each variant is described by its message")]
pub enum ResultError {
    #[error("{path}: this is an input of the run, and a run never overwrites its input; choose another name with -o")]
    IsInput { path: PathBuf },
    #[error("{path}: this is a folder; name a file in it with -o, for example {}", .path.join("result.h5").display())]
    IsFolder { path: PathBuf },
    #[error("{}: the name is not UTF-8, which those of HDF5 files are here; choose another name with -o", .path.display())]
    NotUtf8 { path: PathBuf },
    #[error("{path}: a sweep keeps {what} under this name; choose another name with -o, such as {}", .path.with_extension("h5").display())]
    Reserved { path: PathBuf, what: &'static str },
    #[error("{path}: not a usable file name; name a file with -o")]
    NoFileName { path: PathBuf },
    #[error("{path}: the folder {folder} does not exist; create it, or choose another with -o")]
    NoFolder { path: PathBuf, folder: PathBuf },
    #[error(
        "{path}: no permission to write there; change the permissions of {folder}, or choose another folder with -o"
    )]
    NoPermission { path: PathBuf, folder: PathBuf },
    #[error("{path}: the file system is read-only; choose another folder with -o")]
    ReadOnly { path: PathBuf },
    #[error(
        "{path}: exists and is not a result of this program, so it is not replaced; choose another name with -o, or replace it with --force"
    )]
    Foreign { path: PathBuf },
    #[error("{path}: a pipe or a device, which no file replaces; choose another name with -o")]
    PipeOrDevice { path: PathBuf },
    #[error("{path}: no file can be created there ({source}); choose another folder with -o")]
    NotCreated { path: PathBuf, source: io::Error },
    #[error("{path}: exists and is write-protected; choose another name with -o, or replace it with --force")]
    Protected { path: PathBuf },
    #[error(
        "{path}: in use by another program, which holds a lock on it; close it there, or choose another name with -o"
    )]
    InUse { path: PathBuf },
    #[error("{path}: another run is writing this file; wait for its end, or choose another name with -o")]
    AnotherRun { path: PathBuf },
    #[error("{path}: the disk is full (or the quota used up); free some space, or choose another folder with -o{}", and_kept(.kept))]
    DiskFull { path: PathBuf, kept: bool },
    #[error("{path}: the system lets the file grow no further (see `ulimit -f`, or the limits of the file system); raise the limit, sample less with output.interval, or choose another folder with -o{}", and_kept(.kept))]
    TooLarge { path: PathBuf, kept: bool },
    #[error("{path}: writing failed: {detail}; check the disk and its quota, or choose another folder with -o{}", and_kept(.kept))]
    Write { path: PathBuf, detail: String, kept: bool },
    #[error("{path}: {action} failed: {source}; check the file and its folder")]
    Io {
        path: PathBuf,
        action: &'static str,
        source: io::Error,
    },

    #[error("{path}: no such file; check the name")]
    NotFound { path: PathBuf },
    #[error("{path}: this is a folder; give a result file, as written by `stickslip run`")]
    FolderIsNoResult { path: PathBuf },
    #[error("{path}: not an HDF5 file; give a result file, as written by `stickslip run`")]
    NotHdf5 { path: PathBuf },
    #[error(
        "{path}: an HDF5 file, but not a result of a run ({}; a result has format=\"{}\"); give a result file, as written by `stickslip run`",
        their_format(.found),
        super::schema::FORMAT
    )]
    NotAResult { path: PathBuf, found: Option<String> },
    #[error("{path}: {}", another_kind(.format))]
    AnotherKind { path: PathBuf, format: &'static str },
    #[error("{path}: not the file of a sweep; give one written by `stickslip sweep`")]
    NotASweep { path: PathBuf },
    #[error("{path}: holds one shard of a sweep, not the whole; put its shards together with `stickslip merge`")]
    OnlyAShard { path: PathBuf },
    #[error("{path}: not the file of a shard; give those written by `stickslip sweep --shard`")]
    NotAShard { path: PathBuf },
    #[error(
        "{path}: a sweep without a boundary, and plot draws the boundaries of studies with a [boundary]; its map opens in any program that reads netCDF, as in xarray.open_dataset(\"{path}\").stick_count.plot()"
    )]
    NoBoundary { path: PathBuf },
    #[error(
        "{path}: written in format version {found}, and this program reads up to {known}; use a newer version of the program"
    )]
    Newer { path: PathBuf, found: i64, known: i64 },
    #[error("{path}: damaged, and nothing is made from it: {problems}; copy it again, or repeat the run")]
    NotAsWritten { path: PathBuf, problems: String },
    #[error("{path}: truncated or damaged ({detail}); copy it again, or repeat the run")]
    Damaged { path: PathBuf, detail: String },
    #[error(
        "{path}: row {row} of /trajectory/time is {time:?} s, after {before:?} s, and times increase; it was not written by \
         this program, or was changed since: repeat the run"
    )]
    Times {
        path: PathBuf,
        row: usize,
        time: f64,
        before: f64,
    },
    #[error(
        "{path}: row {row} of /trajectory/{name} is {value:?}, and no value of a run is; it was not written by this \
         program, or was changed since: repeat the run"
    )]
    NotFinite {
        path: PathBuf,
        row: usize,
        name: &'static str,
        value: f64,
    },
    #[error("{path}: {what}; no file of this program is so, and reading it would take too much: see docs/limits.md")]
    BeyondLimits { path: PathBuf, what: String },
    #[error(
        "{path}: {what} is kept in another file, which is read only with --follow-external; give it if you trust the file"
    )]
    Elsewhere { path: PathBuf, what: String },
    #[error(
        "{path}: not read, as the process that reads HDF5 files for this program {detail}; nothing says that the file is at \
         fault: try again"
    )]
    NoReader { path: PathBuf, detail: String },
    #[error("{path}: the name {place} is not UTF-8, and what it names is not read; give it another")]
    Unnamed { path: PathBuf, place: String },
    #[error("{path}: was changed while it was read; try again")]
    Changed { path: PathBuf },
    #[error("{path}: a part of {what}; put the file back that the part is in, or merge the shards anew")]
    Absent { path: PathBuf, what: String },
    #[error("{path}: still being written, and it changed whenever it was read; try again")]
    Growing { path: PathBuf },
    #[error("{path}: the run that was writing it has just ended; look at the file that it was to become")]
    Ended { path: PathBuf },
    #[error("{path}: has no {what}; it was not written by this program, or was changed since")]
    Missing { path: PathBuf, what: String },
    #[error("{path}: {what} has an unknown code {code}; use a newer version of the program")]
    UnknownCode {
        path: PathBuf,
        what: &'static str,
        code: i8,
    },
}

fn another_kind(format: &str) -> &'static str {
    if format == super::schema::SWEEP_FORMAT {
        "holds the many runs of a sweep, not the result of one; `stickslip inspect` lists it, `stickslip plot` draws it, \
         and with trajectory = true in [keep] a study leaves a result file of each run"
    } else {
        "holds a work-precision study, not the result of a run; `stickslip inspect` lists it, `stickslip plot` draws it, and \
         `stickslip run` writes results"
    }
}

fn their_format(found: &Option<String>) -> String {
    match found {
        Some(format) => format!("its root attribute format is {}", crate::quote::quoted(format)),
        None => "it has no root attribute format".to_owned(),
    }
}

fn and_kept(kept: &bool) -> &'static str {
    if *kept {
        " (the file is readable up to the last block that was saved)"
    } else {
        ""
    }
}

impl ResultError {
    /// The file that it is about.
    pub fn path(&self) -> &Path {
        match self {
            ResultError::IsInput { path, .. }
            | ResultError::IsFolder { path, .. }
            | ResultError::NotUtf8 { path, .. }
            | ResultError::Reserved { path, .. }
            | ResultError::NoFileName { path, .. }
            | ResultError::NoFolder { path, .. }
            | ResultError::NoPermission { path, .. }
            | ResultError::ReadOnly { path, .. }
            | ResultError::Foreign { path, .. }
            | ResultError::PipeOrDevice { path, .. }
            | ResultError::NotCreated { path, .. }
            | ResultError::Protected { path, .. }
            | ResultError::InUse { path, .. }
            | ResultError::AnotherRun { path, .. }
            | ResultError::DiskFull { path, .. }
            | ResultError::TooLarge { path, .. }
            | ResultError::Write { path, .. }
            | ResultError::Io { path, .. }
            | ResultError::NotFound { path, .. }
            | ResultError::FolderIsNoResult { path, .. }
            | ResultError::NotHdf5 { path, .. }
            | ResultError::NotAResult { path, .. }
            | ResultError::AnotherKind { path, .. }
            | ResultError::NotASweep { path, .. }
            | ResultError::OnlyAShard { path, .. }
            | ResultError::NotAShard { path, .. }
            | ResultError::NoBoundary { path, .. }
            | ResultError::Newer { path, .. }
            | ResultError::NotAsWritten { path, .. }
            | ResultError::Damaged { path, .. }
            | ResultError::Times { path, .. }
            | ResultError::NotFinite { path, .. }
            | ResultError::BeyondLimits { path, .. }
            | ResultError::Elsewhere { path, .. }
            | ResultError::NoReader { path, .. }
            | ResultError::Unnamed { path, .. }
            | ResultError::Changed { path, .. }
            | ResultError::Absent { path, .. }
            | ResultError::Growing { path, .. }
            | ResultError::Ended { path, .. }
            | ResultError::Missing { path, .. }
            | ResultError::UnknownCode { path, .. } => path,
        }
    }

    /// Whether the system failed to write or read, and nothing is wrong with what was asked for.
    pub fn is_of_the_system(&self) -> bool {
        matches!(
            self,
            ResultError::Io { .. }
                | ResultError::NotCreated { .. }
                | ResultError::Write { .. }
                | ResultError::DiskFull { .. }
                | ResultError::TooLarge { .. }
                | ResultError::NoReader { .. }
        )
    }

    /// An error of the operating system where a file was to be created.
    pub(crate) fn not_created(path: &Path, source: io::Error) -> Self {
        match Self::io(path, "creating the file", source) {
            ResultError::Io { path, source, .. } => ResultError::NotCreated { path, source },
            known => known,
        }
    }

    /// An error of the HDF5 library while `path` was written.
    pub(super) fn write(path: &Path, kept: bool, error: &hdf5::Error) -> Self {
        Self::write_detail(path, kept, describe(error))
    }

    /// The same in HDF5's words.
    pub(super) fn write_detail(path: &Path, kept: bool, detail: String) -> Self {
        let path = path.to_owned();
        if detail.contains("No space left") || detail.contains("quota") {
            ResultError::DiskFull { path, kept }
        } else if detail.contains("File too large") {
            ResultError::TooLarge { path, kept }
        } else {
            ResultError::Write { path, detail, kept }
        }
    }

    /// What HDF5 says while `path` is read.
    pub(super) fn read_detail(path: &Path, detail: String) -> Self {
        let path = path.to_owned();
        if detail.contains("unable to lock file") || detail.contains("already open for write") {
            ResultError::InUse { path }
        } else {
            ResultError::Damaged { path, detail }
        }
    }

    /// An error of the operating system at `path`.
    pub(crate) fn io(path: &Path, action: &'static str, source: io::Error) -> Self {
        let (path, folder) = (path.to_owned(), super::disk::folder_of(path));
        match source.kind() {
            io::ErrorKind::NotFound if !folder.exists() => ResultError::NoFolder { path, folder },
            io::ErrorKind::NotADirectory => ResultError::NoFolder { path, folder },
            io::ErrorKind::PermissionDenied => ResultError::NoPermission { path, folder },
            io::ErrorKind::ReadOnlyFilesystem => ResultError::ReadOnly { path },
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => ResultError::DiskFull { path, kept: false },
            io::ErrorKind::FileTooLarge => ResultError::TooLarge { path, kept: false },
            _ => ResultError::Io { path, action, source },
        }
    }
}

/// The outermost and the innermost message of HDF5's error stack, with the operating system's own
/// words where there are any.
pub(super) fn describe(error: &hdf5::Error) -> String {
    let Some(stack) = error.stack() else {
        return error.to_string();
    };
    // Names from the file are in it, and the binding takes them for UTF-8.
    let frames: Vec<String> = stack
        .iter()
        .map(|frame| String::from_utf8_lossy(frame.desc().as_bytes()).into_owned())
        .collect();
    let outer = frames.first().map_or("", String::as_str);
    let inner = frames.last().map_or("", String::as_str);
    let system = frames.iter().find(|frame| frame.contains("errno"));
    let system = system.map_or(inner, String::as_str);
    // HDF5 pads its message with buffers and offsets that help nobody: the system's words suffice.
    match system
        .split_once("error message = '")
        .and_then(|(_, rest)| rest.split_once('\''))
    {
        Some((words, _)) => format!("{}: {words}", system.split(':').next().unwrap_or(outer)),
        None if outer == system => outer.to_owned(),
        None => format!("{outer}: {system}"),
    }
}
