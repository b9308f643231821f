//! The file of a candidate, which is read several times, as columns of numbers, block by block.

use super::super::CompareError;
use super::super::resolution::Rounding;
use std::collections::HashMap;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use stickslip_system::quote::shown;

pub(super) const BLOCK: usize = 65_536;

/// A pass over some columns of a table. It replaces them by the next rows, at most [`BLOCK`]; none at the end. Its
/// errors name the place.
pub(super) type Pass<'a> = Box<dyn FnMut(&mut [Vec<f64>]) -> Result<(), CompareError> + 'a>;

pub(super) trait CandidateTable: std::fmt::Debug {
    fn path(&self) -> &Path;
    /// Names of the columns, as a mapping writes them.
    fn names(&self) -> Vec<String>;
    /// Whether there is a column of this name, which may be a slice.
    fn has(&self, name: &str) -> bool;
    fn has_texts(&self, _name: &str) -> bool {
        false
    }
    /// Columns with this name, or with a similar name if not `exact`.
    fn columns_of(&self, name: &str, exact: bool) -> Vec<String> {
        let found = exact && self.has(name);
        found.then(|| name.to_owned()).into_iter().collect()
    }
    /// Rounding of the numbers of each column; `None` unless they are stored as text.
    fn roundings(&self, names: &[String]) -> Result<Vec<Option<Rounding>>, CompareError> {
        Ok(vec![None; names.len()])
    }
    fn left_out(&self) -> &[LeftOut] {
        &[]
    }
    fn paths_of(&self, _name: &str) -> Vec<String> {
        Vec::new()
    }
    fn shape(&self, _name: &str) -> Option<Vec<usize>> {
        None
    }
    fn unit(&self, _name: &str) -> Option<String> {
        None
    }
    fn pass(&self, columns: &[String]) -> Result<Pass<'_>, CompareError>;
    /// A column as text, for kinds of events; empty for a format without texts.
    fn texts(&self, _column: &str) -> Result<Vec<String>, CompareError> {
        Ok(Vec::new())
    }
}

pub(super) fn place(row: u64, column: &str) -> String {
    format!("row {row} of {column}")
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct LeftOut {
    pub name: String,
    pub why: String,
    pub remedy: String,
}

impl LeftOut {
    /// Whether a name refers to it: its full path or the last part.
    pub fn is(&self, name: &str) -> bool {
        let name = Slice::parse(name).array.trim_start_matches('/');
        let end = self.name.rsplit('/').next().unwrap_or_default();
        [&self.name, end].iter().any(|known| known.eq_ignore_ascii_case(name))
    }

    pub fn error(self, path: &Path) -> CompareError {
        CompareError::content(path, shown(&self.name), self.why, self.remedy)
    }
}

pub(super) fn unread(table: &dyn CandidateTable, name: &str) -> Option<LeftOut> {
    let of = |why: String, remedy: &str| LeftOut {
        name: Slice::parse(name).array.to_owned(),
        why,
        remedy: remedy.to_owned(),
    };
    let known = table.left_out().iter().find(|left_out| left_out.is(name));
    known.cloned().or_else(|| {
        let paths = table.paths_of(name);
        if paths.len() > 1 {
            let why = format!("is the last part of several paths, {}", paths.join(", "));
            return Some(of(why, "name one of them in a mapping or with --column"));
        }
        match table.shape(name).as_deref() {
            Some([]) => Some(of("is a single number".to_owned(), "give a value for each row")),
            Some(shape @ ([_] | [_, _])) => {
                let why = format!("is of shape {shape:?}, not a column");
                Some(of(why, "name a slice of it, such as y[2]"))
            }
            Some(shape) => {
                let why = format!("is of shape {shape:?}, not a column");
                Some(of(why, "save one dimension of it"))
            }
            None => table
                .has_texts(name)
                .then(|| of("holds texts".to_owned(), "save numbers")),
        }
    })
}

/// Checks that names in a line, whose columns count from 1, are unique.
pub(super) fn each_once<'a>(
    path: &Path,
    line: u64,
    names: impl Iterator<Item = (usize, &'a str)>,
) -> Result<(), CompareError> {
    let mut places = HashMap::new();
    for (place, name) in names.filter(|(_, name)| !name.is_empty()) {
        if let Some(first) = places.insert(name, place) {
            let what = format!("columns {first} and {place} are both called \"{}\"", shown(name));
            let remedy = "give each column a name of its own";
            return Err(CompareError::content(path, format!("line {line}"), what, remedy));
        }
    }
    Ok(())
}

/// Position of a name in a list: the exact name, or else the first one that differs only in case.
pub(super) fn place_of<'a>(mut names: impl Iterator<Item = &'a str> + Clone, name: &str) -> Option<usize> {
    let exact = names.clone().position(|known| known == name);
    exact.or_else(|| names.position(|known| known.eq_ignore_ascii_case(name)))
}

pub(super) fn of_one_length(path: &Path, name: &str, rows: usize, other: (&str, usize)) -> Result<(), CompareError> {
    if rows == other.1 {
        return Ok(());
    }
    let what = format!("has {rows} rows, but {} has {}", other.0, other.1);
    Err(CompareError::content(path, name, what, "columns are of one length"))
}

pub(super) fn no_column(path: &Path, name: &str, shape: &[usize]) -> CompareError {
    let what = format!("is of shape {shape:?}, not a column");
    CompareError::content(path, name, what, "name a slice of it, such as y[2]")
}

/// Meaning of `NAME[2]`, `NAME[2,:]` or `NAME[:,2]`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Slice<'a> {
    pub array: &'a str,
    /// Index of the row (`true`) or column (`false`) of a two-dimensional array; `None` for a one-dimensional array.
    pub of: Option<(usize, Option<bool>)>,
}

impl<'a> Slice<'a> {
    pub fn parse(name: &'a str) -> Slice<'a> {
        let inside = name.strip_suffix(']').and_then(|start| start.split_once('['));
        let sliced = inside.and_then(|(array, index)| {
            let number = |text: &str| text.parse::<usize>().ok();
            let parts: Vec<&str> = index.split(',').map(str::trim).collect();
            let of = match parts[..] {
                [k] => (number(k)?, None),
                [k, ":"] => (number(k)?, Some(true)),
                [":", k] => (number(k)?, Some(false)),
                _ => return None,
            };
            Some(Slice { array, of: Some(of) })
        });
        sliced.unwrap_or(Slice { array: name, of: None })
    }

    /// Start, stride and number of the elements in an array of this shape, stored row by row; `None` if it has no such
    /// slice. `NAME[2]` is a row if the array has fewer rows than columns.
    pub fn elements(&self, shape: &[usize]) -> Option<(usize, usize, usize)> {
        match (shape, self.of) {
            ([n] | [n, 1] | [1, n], None) => Some((0, 1, *n)),
            (&[rows, columns], Some((k, row))) => {
                if row.unwrap_or(rows < columns) {
                    (k < rows).then(|| (k.saturating_mul(columns), 1, columns))
                } else {
                    (k < columns).then_some((k, columns, rows))
                }
            }
            _ => None,
        }
    }
}

/// Largest input through a pipe, bytes. It is kept in a temporary file.
const MOST_PIPED: u64 = 1 << 30;

#[derive(Debug)]
pub(super) struct CandidateSource {
    path: PathBuf,
    /// Temporary file without a name, so that nothing is left if a signal ends the program.
    piped: Option<Arc<File>>,
}

impl CandidateSource {
    /// Opens a file; a pipe is read to its end. Fails for a missing file, a folder, a device, or an unreadable file.
    pub fn open(path: &Path) -> Result<CandidateSource, CompareError> {
        let failed = CompareError::io(path);
        let refused = |what: &str, remedy: &str| Err(CompareError::whole(path, what, remedy));
        let kind = std::fs::metadata(path).map_err(&failed)?.file_type();
        if kind.is_dir() {
            return refused("this is a folder", "name a file in it");
        }
        let mut source = CandidateSource {
            path: path.to_owned(),
            piped: None,
        };
        if kind.is_file() {
            return Ok(source);
        }
        #[cfg(unix)]
        if !std::os::unix::fs::FileTypeExt::is_fifo(&kind) && !std::os::unix::fs::FileTypeExt::is_socket(&kind) {
            return refused("this is a device", "name a file");
        }
        let mut kept = temporary()?;
        let mut pipe = File::open(path).map_err(&failed)?.take(MOST_PIPED + 1);
        let count = io::copy(&mut pipe, &mut kept).map_err(failed)?;
        if count > MOST_PIPED {
            let what = format!("more than {} MB came through the pipe", MOST_PIPED >> 20);
            return refused(&what, "save it in a file, and name that");
        }
        source.piped = Some(Arc::new(kept));
        Ok(source)
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn is_piped(&self) -> bool {
        self.piped.is_some()
    }

    pub fn file(&self) -> Result<CandidatePlace, CompareError> {
        let file = match &self.piped {
            Some(kept) => Arc::clone(kept),
            None => Arc::new(File::open(&self.path).map_err(CompareError::io(&self.path))?),
        };
        Ok(CandidatePlace { file, at: 0 })
    }

    pub fn head(&self, bytes: u64) -> Result<Vec<u8>, CompareError> {
        let mut head = Vec::new();
        let read = self.file()?.take(bytes).read_to_end(&mut head);
        read.map_err(CompareError::io(&self.path))?;
        Ok(head)
    }
}

pub(super) fn temporary() -> Result<File, CompareError> {
    tempfile::tempfile().map_err(CompareError::temporary)
}

#[derive(Debug, Clone)]
pub(super) struct CandidatePlace {
    file: Arc<File>,
    at: u64,
}

impl From<File> for CandidatePlace {
    fn from(file: File) -> Self {
        let file = Arc::new(file);
        CandidatePlace { file, at: 0 }
    }
}

impl CandidatePlace {
    pub fn length(&self) -> io::Result<u64> {
        Ok(self.file.metadata()?.len())
    }

    /// Fills `bytes` from the byte `at` of the file.
    pub fn read_at(&self, at: u64, bytes: &mut [u8]) -> io::Result<()> {
        let file = Arc::clone(&self.file);
        CandidatePlace { file, at }.read_exact(bytes)
    }
}

impl Read for CandidatePlace {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        #[cfg(unix)]
        let count = std::os::unix::fs::FileExt::read_at(&*self.file, buffer, self.at)?;
        #[cfg(windows)]
        let count = std::os::windows::fs::FileExt::seek_read(&*self.file, buffer, self.at)?;
        self.at += count as u64;
        Ok(count)
    }
}

impl Seek for CandidatePlace {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let at = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::Current(by) => self.at.checked_add_signed(by),
            SeekFrom::End(by) => self.length()?.checked_add_signed(by),
        };
        self.at = at.ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "a place before the beginning"))?;
        Ok(self.at)
    }
}
