//! Errors of result files, with place and remedy.

use std::io;
use std::path::{Path, PathBuf};

/// An error of a result file; the message names file and remedy.
#[derive(Debug, thiserror::Error)]
#[error("{}{reason}", place(.path))]
pub struct ResultError {
    /// File; empty if several are at fault.
    pub path: PathBuf,
    /// Defect and remedy.
    pub reason: Reason,
}

/// Defects of a result file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "each variant is described by its message")]
pub enum Reason {
    #[error("this is an input of the run, and a run never overwrites its input; choose another name with -o")]
    IsInput,
    #[error("this is a folder; name a file in it with -o, for example {}", .0.display())]
    IsFolder(PathBuf),
    #[error("the name is not UTF-8, which those of HDF5 files are here; choose another name with -o")]
    NotUtf8,
    #[error("a sweep keeps {what} under this name; choose another name with -o, such as {}", .instead.display())]
    Reserved { what: &'static str, instead: PathBuf },
    #[error("results are HDF5, and this name says otherwise; give -o {instead}; then {further}")]
    OtherFormat { instead: String, further: String },
    #[error(
        "the name is too long for the file system with what is added to it until the file is complete; choose a shorter one with -o"
    )]
    NameTooLong,
    #[error("not a usable file name; name a file with -o")]
    NoFileName,
    #[error("the folder {} does not exist; create it, or choose another with -o", .0.display())]
    NoFolder(PathBuf),
    #[error("no permission to write there; change the permissions of {}, or choose another folder with -o", .0.display())]
    NoPermission(PathBuf),
    #[error("the file system is read-only; choose another folder with -o")]
    ReadOnly,
    #[error(
        "exists and is not a result of this program, so it is not replaced; choose another name with -o, or replace it with --force"
    )]
    Foreign,
    #[error("holds {0}; name another file with -o, or replace it with --force")]
    Another(String),
    #[error("a pipe or a device, which no file replaces; choose another name with -o")]
    PipeOrDevice,
    #[error("no file can be created there ({0}); choose another folder with -o")]
    NotCreated(io::Error),
    #[error("exists and is write-protected; choose another name with -o, or replace it with --force")]
    Protected,
    #[error("in use by another program, which holds a lock on it; close it there, or choose another name with -o")]
    InUse,
    #[error("another run is writing this file; wait for its end, or choose another name with -o")]
    AnotherRun,
    #[error("the disk is full (or the quota used up); free some space, or choose another folder with -o{}", and_kept(.kept))]
    DiskFull { kept: bool },
    #[error("the system lets the file grow no further (see `ulimit -f`, or the limits of the file system); raise the limit, sample less with output.interval, or choose another folder with -o{}", and_kept(.kept))]
    TooLarge { kept: bool },
    #[error("writing failed: {detail}; check the disk and its quota, or choose another folder with -o{}", and_kept(.kept))]
    Write { detail: String, kept: bool },
    #[error("{action} failed: {source}; check the file and its folder")]
    Io { action: &'static str, source: io::Error },

    #[error("no such file; check the name")]
    NotFound,
    #[error("this is a folder; give a result file, as written by `stickslip run`")]
    FolderIsNoResult,
    #[error("not an HDF5 file; give a result file, as written by `stickslip run`")]
    NotHdf5,
    #[error(
        "an HDF5 file, but not a result of a run ({}; a result has format=\"{}\"); give a result file, as written by `stickslip run`",
        their_format(.0),
        super::schema::FORMAT
    )]
    NotAResult(Option<String>),
    #[error("{0}")]
    AnotherKind(&'static str),
    #[error("not the file of a sweep; give one written by `stickslip sweep`")]
    NotASweep,
    #[error("holds one shard of a sweep, not the whole; put its shards together with `stickslip merge`")]
    OnlyAShard,
    #[error("not the file of a shard; give those written by `stickslip sweep --shard`")]
    NotAShard,
    #[error("exists; choose another name with -o, or replace it with --force")]
    Exists,
    #[error("{0}")]
    Shards(String),
    #[error(
        "a sweep without a boundary, and plot draws the boundaries of studies with a [boundary]; its map opens in any program that reads netCDF, as in xarray.open_dataset(\"{}\").stick_count.plot()",
        .0.display()
    )]
    NoBoundary(PathBuf),
    #[error(
        "written in format version {found}, and this program reads up to {known}; use a newer version of the program"
    )]
    Newer { found: i64, known: i64 },
    #[error("damaged, and nothing is made from it: {0}; copy it again, or repeat the run")]
    NotAsWritten(String),
    #[error("truncated or damaged ({0}); copy it again, or repeat the run")]
    Damaged(String),
    #[error(
        "row {row} of /trajectory/time is {time:?} s, after {before:?} s, and times increase; it was not written by \
         this program, or was changed since: repeat the run"
    )]
    Times { row: usize, time: f64, before: f64 },
    #[error(
        "row {row} of /trajectory/{name} is {value:?}, and no value of a run is; it was not written by this \
         program, or was changed since: repeat the run"
    )]
    NotFinite { row: usize, name: &'static str, value: f64 },
    #[error("{0}; no file of this program is so, and reading it would take too much: see docs/reference/limits.md")]
    BeyondLimits(String),
    #[error("{0} is kept in another file, which is read only with --follow-external; give it if you trust the file")]
    Elsewhere(String),
    #[error(
        "not read, as the process that reads a file without an intact seal first {0}; nothing says that the file is at \
         fault: try again"
    )]
    NoReader(String),
    #[error("the name {0} is not UTF-8, and what it names is not read; give it another")]
    Unnamed(String),
    #[error("was changed while it was read; try again")]
    Changed,
    #[error("a part of {0}; put the file back that the part is in, or merge the shards anew")]
    Absent(String),
    #[error("still being written, and it changed whenever it was read; try again")]
    Growing,
    #[error("the run that was writing it has just ended; look at the file that it was to become")]
    Ended,
    #[error(
        "the columns of the table {what}; it was not written by this program, or was changed since: repeat the run"
    )]
    Uneven { variable: String, what: String },
    #[error("has no {0}; it was not written by this program, or was changed since")]
    Missing(String),
    #[error("{what} has an unknown code {code}; use a newer version of the program")]
    UnknownCode { what: &'static str, code: i8 },
}

impl Reason {
    /// Returns the error with this reason for the file at `path`.
    pub fn of(self, path: &Path) -> ResultError {
        ResultError {
            path: path.to_owned(),
            reason: self,
        }
    }
}

/// An error of HDF5 in reading.
impl From<hdf5::Error> for Reason {
    fn from(error: hdf5::Error) -> Self {
        let detail = describe(&error);
        match detail.contains("unable to lock file") || detail.contains("already open for write") {
            true => Reason::InUse,
            false => Reason::Damaged(detail),
        }
    }
}

fn place(path: &Path) -> String {
    match path.as_os_str().is_empty() {
        true => String::new(),
        false => format!("{}: ", path.display()),
    }
}

fn their_format(found: &Option<String>) -> String {
    match found {
        Some(format) => format!(
            "its root attribute format is {}",
            stickslip_system::quote::quoted(format)
        ),
        None => "it has no root attribute format".to_owned(),
    }
}

fn and_kept(kept: &bool) -> &'static str {
    match kept {
        true => " (the file is readable up to the last block that was saved)",
        false => "",
    }
}

impl ResultError {
    /// Whether the system failed to read or write, so that the request itself was right.
    pub fn is_of_the_system(&self) -> bool {
        matches!(
            self.reason,
            Reason::Io { .. }
                | Reason::NotCreated(_)
                | Reason::Write { .. }
                | Reason::DiskFull { .. }
                | Reason::TooLarge { .. }
                | Reason::NoReader(_)
        )
    }

    /// Error of the operating system on creating a file.
    pub fn not_created(path: &Path, source: io::Error) -> Self {
        match Self::io(path, "creating the file", source).reason {
            Reason::Io { source, .. } => Reason::NotCreated(source).of(path),
            known => known.of(path),
        }
    }

    pub(super) fn write(path: &Path, kept: bool, error: &hdf5::Error) -> Self {
        let detail = describe(error);
        let reason = if detail.contains("No space left") || detail.contains("quota") {
            Reason::DiskFull { kept }
        } else if detail.contains("File too large") {
            Reason::TooLarge { kept }
        } else {
            Reason::Write { detail, kept }
        };
        reason.of(path)
    }

    /// Error of the operating system during `action` at `path`.
    pub fn io(path: &Path, action: &'static str, source: io::Error) -> Self {
        let folder = super::disk::folder_of(path);
        let reason = match source.kind() {
            io::ErrorKind::NotFound if !folder.exists() => Reason::NoFolder(folder),
            io::ErrorKind::NotADirectory => Reason::NoFolder(folder),
            io::ErrorKind::PermissionDenied => {
                let existing = folder.ancestors().find(|folder| folder.exists()).map(Path::to_owned);
                Reason::NoPermission(existing.unwrap_or(folder))
            }
            io::ErrorKind::ReadOnlyFilesystem => Reason::ReadOnly,
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => Reason::DiskFull { kept: false },
            io::ErrorKind::FileTooLarge => Reason::TooLarge { kept: false },
            _ => Reason::Io { action, source },
        };
        reason.of(path)
    }
}

/// Outermost and innermost message of HDF5's error stack, and the operating system's message if there is one.
pub(super) fn describe(error: &hdf5::Error) -> String {
    let Some(stack) = error.stack() else {
        return error.to_string();
    };
    // The stack contains names from the file, which the binding takes for UTF-8.
    let frames = stack.iter();
    let frames = frames.map(|frame| String::from_utf8_lossy(frame.desc().as_bytes()).into_owned());
    let frames: Vec<String> = frames.collect();
    let outer = frames.first().map_or("", String::as_str);
    let inner = frames.last().map_or("", String::as_str);
    let system = frames.iter().find(|frame| frame.contains("errno"));
    let system = system.map_or(inner, String::as_str);
    // HDF5 adds buffers and offsets to the system's words.
    match system
        .split_once("error message = '")
        .and_then(|(_, rest)| rest.split_once('\''))
    {
        Some((words, _)) => format!("{}: {words}", system.split(':').next().unwrap_or(outer)),
        None if outer == system => outer.to_owned(),
        None => format!("{outer}: {system}"),
    }
}
