//! The file of a candidate, which is read several times, as columns of numbers, block by block.

use super::super::CompareError;
use super::super::resolution::Rounding;
use super::mapping::{self, MappedColumn};
use std::collections::HashMap;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use stickslip_case::quantity::Dimension;
use stickslip_system::quote::shown;

pub(super) const BLOCK: usize = 65_536;

/// A pass over some columns of a table. It replaces them by the next rows, at most [`BLOCK`]; none at the end. Its
/// errors name the place.
pub(super) type Pass<'a> = Box<dyn FnMut(&mut [Vec<f64>]) -> Result<(), CompareError> + 'a>;

/// Reads the arrays of a file.
pub(super) trait ArrayReader: std::fmt::Debug {
    fn pass(&self, columns: Vec<CandidateColumn>) -> Result<Pass<'_>, CompareError>;

    /// An array as texts, for kinds of events; `None` if it is to be read as numbers.
    fn texts(&self, _array: usize) -> Result<Option<Vec<String>>, CompareError> {
        Ok(None)
    }

    fn unit(&self, _array: usize) -> Option<String> {
        None
    }

    /// Rounding of the numbers of each array; `None` unless they are stored as text.
    fn roundings(&self, arrays: &[usize]) -> Result<Vec<Option<Rounding>>, CompareError> {
        Ok(vec![None; arrays.len()])
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ArrayValues {
    Numbers,
    Texts,
    Either,
}

#[derive(Debug)]
pub(super) struct TableArray {
    pub name: String,
    pub values: ArrayValues,
    /// `None` for a column with a value in each row of the table.
    pub shape: Option<Vec<usize>>,
    /// Stored column by column.
    pub fortran: bool,
}

impl TableArray {
    pub fn of_rows(name: impl Into<String>, values: ArrayValues) -> TableArray {
        TableArray {
            name: name.into(),
            values,
            shape: None,
            fortran: false,
        }
    }

    /// Start, stride and number of the elements of a row or column in the order of storage; `None` if the array has no
    /// such slice. `NAME[2]` is a row if the array has fewer rows than columns.
    fn elements(&self, slice: Option<(usize, Option<bool>)>) -> Option<(usize, usize, usize)> {
        match (self.shape.as_deref(), slice) {
            (None, None) => Some((0, 1, usize::MAX)),
            (Some(&([n] | [n, 1] | [1, n])), None) => Some((0, 1, n)),
            (Some(&[rows, columns]), Some((k, is_row))) => {
                let is_row = is_row.unwrap_or(rows < columns);
                let (each, length) = if is_row { (rows, columns) } else { (columns, rows) };
                let (start, stride) = match is_row != self.fortran {
                    true => (k.saturating_mul(length), 1),
                    false => (k, each),
                };
                (k < each).then_some((start, stride, length))
            }
            _ => None,
        }
    }

    fn is_listed(&self) -> bool {
        self.values == ArrayValues::Numbers && self.shape.as_ref().is_none_or(|shape| matches!(shape.len(), 1 | 2))
    }
}

/// A column of a table: some elements of an array.
#[derive(Debug, Clone)]
pub(super) struct CandidateColumn {
    pub name: String,
    pub array: usize,
    /// First element, distance of elements, and number of them.
    pub elements: (usize, usize, usize),
}

/// A file as arrays of numbers and texts.
#[derive(Debug)]
pub(super) struct CandidateTable {
    pub path: PathBuf,
    pub arrays: Vec<TableArray>,
    pub left_out: Vec<LeftOut>,
    /// Names of arrays are paths in the file. The last part is enough if it is unique.
    pub by_path: bool,
    pub reader: Box<dyn ArrayReader>,
}

impl CandidateTable {
    /// Names of the columns, as a mapping writes them.
    pub fn names(&self) -> Vec<String> {
        let listed = self.arrays.iter().filter(|array| !self.by_path || array.is_listed());
        listed.map(|array| array.name.clone()).collect()
    }

    /// A name as the arrays have it: a path may begin with a slash.
    fn plain<'a>(&self, name: &'a str) -> &'a str {
        if self.by_path {
            name.trim_start_matches('/')
        } else {
            name
        }
    }

    fn is_exact(&self, array: &TableArray, name: &str) -> bool {
        array.name == self.plain(name)
    }

    /// Whether names differ in case or blanks alone. OpenRadioss's th_to_csv fills titles with blanks.
    fn is_near(&self, array: &TableArray, name: &str) -> bool {
        let known = match self.by_path {
            true => array.name.rsplit('/').next().unwrap_or_default(),
            false => &array.name,
        };
        let words = |name: &str| name.split_ascii_whitespace().collect::<Vec<_>>().join(" ");
        words(known).eq_ignore_ascii_case(&words(self.plain(name)))
    }

    /// The array with a name, which may differ in case.
    fn find(&self, name: &str, fits: impl Fn(&TableArray) -> bool) -> Option<usize> {
        let among = |listed: bool| {
            let is_one = |k: &usize| fits(&self.arrays[*k]) && (!listed || self.arrays[*k].is_listed());
            let fitting = || (0..self.arrays.len()).filter(is_one);
            let exact = fitting().find(|&k| self.is_exact(&self.arrays[k], name));
            exact.or_else(|| {
                let mut near = fitting().filter(|&k| self.is_near(&self.arrays[k], name));
                let first = near.next()?;
                (!self.by_path || near.next().is_none()).then_some(first)
            })
        };
        // A scalar of the same name in another group is no second column.
        among(true).or_else(|| among(false))
    }

    fn column_of(&self, name: &str, fits: impl Fn(&TableArray) -> bool) -> Option<CandidateColumn> {
        let is_whole = |array: &TableArray| fits(array) && array.shape.is_none() && self.is_exact(array, name);
        let (array, slice) = match self.arrays.iter().position(is_whole) {
            Some(array) => (array, None),
            None => {
                let (array, slice) = slice_of(name);
                (self.find(array, &fits)?, slice)
            }
        };
        Some(CandidateColumn {
            name: name.to_owned(),
            array,
            elements: self.arrays[array].elements(slice)?,
        })
    }

    /// Whether there is a column of numbers of this name, which may be a slice.
    pub fn has(&self, name: &str) -> bool {
        self.column_of(name, is_number).is_some()
    }

    pub fn has_texts(&self, name: &str) -> bool {
        self.has(name) || self.column_of(name, |array| !is_number(array)).is_some()
    }

    fn column(&self, name: &str) -> Result<CandidateColumn, CompareError> {
        if let Some(column) = self.column_of(name, is_number) {
            return Ok(column);
        }
        if self.has_texts(name) {
            let remedy = "name an array of numbers";
            return Err(CompareError::content(&self.path, name, "is an array of texts", remedy));
        }
        let array = self.find(slice_of(name).0, is_number);
        let Some(shape) = array.and_then(|k| self.arrays[k].shape.as_ref()) else {
            return Err(self.absent(name));
        };
        let what = format!("is of shape {shape:?}, not a column");
        Err(CompareError::content(
            &self.path,
            name,
            what,
            "name a slice of it, such as y[2]",
        ))
    }

    fn columns(&self, names: &[String]) -> Result<Vec<CandidateColumn>, CompareError> {
        names.iter().map(|name| self.column(name)).collect()
    }

    pub fn pass(&self, names: &[String]) -> Result<Pass<'_>, CompareError> {
        let columns = self.columns(names)?;
        for pair in columns.windows(2) {
            let (rows, before) = (pair[1].elements.2, pair[0].elements.2);
            if rows != before {
                let what = format!("has {rows} rows, but {} has {before}", pair[0].name);
                let remedy = "columns are of one length";
                return Err(CompareError::content(&self.path, &*pair[1].name, what, remedy));
            }
        }
        self.reader.pass(columns)
    }

    pub fn roundings(&self, names: &[String]) -> Result<Vec<Option<Rounding>>, CompareError> {
        let arrays: Vec<usize> = self.columns(names)?.iter().map(|column| column.array).collect();
        self.reader.roundings(&arrays)
    }

    /// All values of a column.
    pub fn values(&self, name: &str) -> Result<Vec<f64>, CompareError> {
        let mut pass = self.pass(&[name.to_owned()])?;
        let (mut values, mut block) = (Vec::new(), [Vec::new()]);
        loop {
            pass(&mut block)?;
            if block[0].is_empty() {
                return Ok(values);
            }
            values.append(&mut block[0]);
        }
    }

    /// A column as texts.
    pub fn texts(&self, name: &str) -> Result<Vec<String>, CompareError> {
        let texts = self.find(name, |array| array.values != ArrayValues::Numbers);
        let array = match texts {
            Some(array) => array,
            None => self.column(name)?.array,
        };
        match self.reader.texts(array)? {
            Some(texts) => Ok(texts),
            None => Ok(self.values(name)?.iter().map(f64::to_string).collect()),
        }
    }

    /// Columns with this name, or with a similar name if not `exact`.
    fn columns_named(&self, name: &str, exact: bool) -> Vec<String> {
        let array_name = slice_of(name).0;
        let is_it = |array: &&TableArray| match exact {
            true => self.is_exact(array, array_name),
            false => self.is_near(array, array_name),
        };
        let named = self.arrays.iter().filter(|array| is_number(array)).filter(is_it);
        let found = named.map(|array| array.name.clone() + &name[array_name.len()..]);
        let mut found: Vec<String> = found.filter(|name| self.has(name)).collect();
        if self.by_path && found.len() > 1 {
            found.clear();
        }
        found
    }

    /// The only column that matches one of `names`, exactly or else nearly; `None` if there is none, an error if there
    /// are several. `taken` are columns of other channels.
    pub fn only(
        &self,
        what: &str,
        names: &[&str],
        taken: &dyn Fn(&str) -> bool,
    ) -> Result<Option<String>, CompareError> {
        for exact in [true, false] {
            let mut found: Vec<String> = Vec::new();
            for column in names.iter().flat_map(|name| self.columns_named(name, exact)) {
                if !taken(&column) && !found.contains(&column) {
                    found.push(column);
                }
            }
            if found.len() > 1 {
                let several = format!("several columns have names of {what}: {}", listed(&found));
                let remedy = format!("say which it is with --column {what}=NAME or in a mapping");
                return Err(CompareError::whole(&self.path, several, &remedy));
            }
            if found.len() == 1 {
                return Ok(found.pop());
            }
        }
        Ok(None)
    }

    /// The column that a mapping names.
    pub fn mapped(&self, what: &str, name: &str) -> Result<String, CompareError> {
        if !self.has(name) {
            return Err(self.absent(name));
        }
        Ok(self.only(what, &[name], &|_| false)?.unwrap_or_else(|| name.to_owned()))
    }

    fn absent(&self, name: &str) -> CompareError {
        if let Some(left_out) = self.unread(name) {
            return left_out.error(&self.path);
        }
        let names = self.names();
        let hint = match stickslip_case::suggest(name, names.iter().map(String::as_str)) {
            Some(close) => format!("did you mean {close}?"),
            None => format!("there are {}", listed(&names)),
        };
        let what = format!("has no column \"{}\"; {hint}", shown(name));
        CompareError::whole(&self.path, what, "correct the mapping or the option --column")
    }

    /// The factor to SI: from the mapping, from the file, or 1. It has the sign of the mapping.
    pub fn factor(&self, name: &str, mapped: Option<&MappedColumn>, dimension: Dimension) -> Result<f64, CompareError> {
        let sign = mapped.map_or(1.0, MappedColumn::sign);
        if let Some(factor) = mapped.and_then(|column| column.factor) {
            return Ok(sign * factor);
        }
        let array = self.find(slice_of(name).0, is_number);
        let Some(unit) = array.and_then(|k| self.reader.unit(k)) else {
            return Ok(sign);
        };
        let factor = mapping::factor(&unit, dimension).map(|factor| sign * factor);
        factor.map_err(|what| {
            let what = format!("its unit \"{}\": {what}", shown(&unit));
            let remedy = "say its unit in a mapping, or as --column CHANNEL=COLUMN:UNIT";
            CompareError::content(&self.path, name, what, remedy)
        })
    }

    /// Why contents of this name are not read.
    pub fn unread(&self, name: &str) -> Option<LeftOut> {
        let array = slice_of(name).0;
        let of = |why: String, remedy: &str| LeftOut {
            name: array.to_owned(),
            why,
            remedy: remedy.to_owned(),
        };
        if let Some(known) = self.left_out.iter().find(|left_out| left_out.is(array)) {
            return Some(known.clone());
        }
        let ends = |known: &&TableArray| self.by_path && known.is_listed() && self.is_near(known, array);
        let paths = self.arrays.iter().filter(ends);
        let paths: Vec<_> = paths.map(|known| shown(&known.name)).collect();
        if paths.len() > 1 {
            let why = format!("is the last part of several paths, {}", paths.join(", "));
            return Some(of(why, "name one of them in a mapping or with --column"));
        }
        let known = self.find(array, |array| array.values == ArrayValues::Numbers);
        let Some(shape) = known.and_then(|k| self.arrays[k].shape.as_ref()) else {
            let is_text = self.has_texts(name);
            return is_text.then(|| of("holds texts".to_owned(), "save numbers"));
        };
        if shape.is_empty() {
            return Some(of("is a single number".to_owned(), "give a value for each row"));
        }
        let remedy = match shape.len() {
            1 | 2 => "name a slice of it, such as y[2]",
            _ => "save one dimension of it",
        };
        Some(of(format!("is of shape {shape:?}, not a column"), remedy))
    }
}

fn is_number(array: &TableArray) -> bool {
    array.values != ArrayValues::Texts
}

pub(super) const MOST_NAMED: usize = 20;

pub(super) fn listed(names: &[String]) -> String {
    if names.is_empty() {
        return "no columns of numbers".to_owned();
    }
    let more = if names.len() > MOST_NAMED { ", ..." } else { "" };
    let shown: Vec<String> = names.iter().take(MOST_NAMED).map(|name| shown(name)).collect();
    shown.join(", ") + more
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
    fn is(&self, name: &str) -> bool {
        let end = self.name.rsplit('/').next().unwrap_or_default();
        [&self.name, end]
            .iter()
            .any(|known| known.eq_ignore_ascii_case(name.trim_start_matches('/')))
    }

    pub fn error(self, path: &Path) -> CompareError {
        CompareError::content(path, shown(&self.name), self.why, self.remedy)
    }
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

/// Array and slice of a name: `NAME[2]`, row `NAME[2,:]` (`true`) or column `NAME[:,2]` (`false`).
fn slice_of(name: &str) -> (&str, Option<(usize, Option<bool>)>) {
    let inside = name.strip_suffix(']').and_then(|start| start.split_once('['));
    let sliced = inside.and_then(|(array, index)| {
        let number = |text: &str| text.parse::<usize>().ok();
        let parts: Vec<&str> = index.split(',').map(str::trim).collect();
        let slice = match parts[..] {
            [k] => (number(k)?, None),
            [k, ":"] => (number(k)?, Some(true)),
            [":", k] => (number(k)?, Some(false)),
            _ => return None,
        };
        Some((array, Some(slice)))
    });
    sliced.unwrap_or((name, None))
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
