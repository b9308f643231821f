//! Columns of NumPy's NPZ archives (and single NPY arrays).

use super::super::CompareError;
use super::source::{Place, Source};
use super::table::{BLOCK, Pass, Slice, Table, of_one_length};
use crate::quote::shown;
use npyz::{DType, Endianness, NpyHeader, Order, TypeChar};
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// The header of an array is no longer, bytes.
const LONGEST_HEADER: u64 = 1 << 20;

/// Compressed members are unpacked into a temporary file, up to so many bytes in all.
const MOST_UNPACKED: u64 = 4 << 30;

/// Bytes of a wide array that are read at once, at least a row.
const MOST_READ: usize = 4 << 20;

/// An NPZ archive. Members that are stored as they are (`numpy.savez`) are read in place, after their CRC-32 was checked;
/// compressed ones are unpacked into a temporary file.
#[derive(Debug)]
pub(crate) struct NpzTable {
    path: PathBuf,
    arrays: Vec<Array>,
}

#[derive(Debug)]
struct Array {
    name: String,
    file: Place,
    /// Of the first element, bytes.
    start: u64,
    shape: Vec<usize>,
    fortran: bool,
    element: Element,
}

/// How an element is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Element {
    kind: TypeChar,
    bytes: usize,
    big: bool,
}

impl NpzTable {
    /// Opens an archive and reads the headers of its arrays.
    ///
    /// # Errors
    /// No such file, no zip archive, a damaged one, or none with arrays of numbers.
    pub(super) fn open(source: &Source) -> Result<NpzTable, CompareError> {
        let path = source.path();
        let open = || source.file();
        let damaged = |what: String| CompareError::whole(path, what, "write it again with numpy.savez");
        let mut archive = zip::ZipArchive::new(open()?).map_err(|error| damaged(format!("no NPZ archive: {error}")))?;
        let mut table = NpzTable {
            path: path.to_owned(),
            arrays: Vec::new(),
        };
        let mut unpacked = MOST_UNPACKED;
        // Members that are stored as they are lie one after the other: all of them are no longer than the archive.
        let mut unread = open()?.length().map_err(|error| CompareError::io(path, &error))?;
        let too_much = || {
            let what = format!("unpacks to more than {} GB", MOST_UNPACKED >> 30);
            let remedy = "write it with numpy.savez, which does not compress";
            CompareError::whole(path, what, remedy)
        };
        for index in 0..archive.len() {
            let mut member = archive.by_index(index).map_err(|error| damaged(error.to_string()))?;
            let name = member.name().map_err(|error| damaged(error.to_string()))?.into_owned();
            let Some(name) = name.strip_suffix(".npy").map(str::to_owned) else {
                continue;
            };
            let stored = member.compression() == zip::CompressionMethod::Stored;
            let mut file;
            let length;
            if stored {
                file = open()?;
                let start = member
                    .data_start()
                    .ok_or_else(|| damaged(format!("{} has no data", shown(&name))))?;
                unread = unread
                    .checked_sub(member.size())
                    .ok_or_else(|| damaged(format!("{} is longer than the archive", shown(&name))))?;
                // To its end, for its checksum: what is read in place has none.
                std::io::copy(&mut member, &mut std::io::sink())
                    .map_err(|error| damaged(format!("{}: {error}", shown(&name))))?;
                let whole = file.length().map_err(|error| CompareError::io(path, &error))?;
                length = member.size().min(whole.saturating_sub(start));
                file.seek(SeekFrom::Start(start))
                    .map_err(|error| CompareError::io(path, &error))?;
            } else {
                // What the archive itself says is not unpacked to find out.
                if member.size() > unpacked {
                    return Err(too_much());
                }
                let mut kept = tempfile::tempfile().map_err(|error| CompareError::io(&std::env::temp_dir(), &error))?;
                length = std::io::copy(&mut member.take(unpacked + 1), &mut kept)
                    .map_err(|error| damaged(format!("{}: {error}", shown(&name))))?;
                unpacked = unpacked.checked_sub(length).ok_or_else(too_much)?;
                file = Place::from(kept);
            }
            let first = file.stream_position().map_err(|error| CompareError::io(path, &error))?;
            // The header is read as a whole, so that its length is not taken on trust.
            let mut head = Vec::new();
            std::io::Read::by_ref(&mut file)
                .take(length.min(LONGEST_HEADER))
                .read_to_end(&mut head)
                .map_err(|error| CompareError::io(path, &error))?;
            if header_end(&head).is_none_or(|end| end > head.len() as u64) {
                return Err(damaged(format!("{} has no whole header", shown(&name))));
            }
            let mut cursor = std::io::Cursor::new(head);
            let header = NpyHeader::from_reader(&mut cursor)
                .map_err(|error| damaged(format!("{}: {}", shown(&name), shown(&error.to_string()))))?;
            let start = first + cursor.position();
            if let Some(element) = Element::of(&header.dtype()) {
                let shape = shape_of(&header, element, length.saturating_sub(cursor.position()))
                    .ok_or_else(|| damaged(format!("{} is longer than its member of the archive", shown(&name))))?;
                table.arrays.push(Array {
                    name,
                    file,
                    start,
                    shape,
                    fortran: header.order() == Order::Fortran,
                    element,
                });
            }
        }
        if table.arrays.is_empty() {
            return Err(damaged("holds no array of numbers".to_owned()));
        }
        Ok(table)
    }

    fn find(&self, name: &str) -> Option<&Array> {
        let exact = self.arrays.iter().find(|a| a.name == name);
        exact.or_else(|| self.arrays.iter().find(|a| a.name.eq_ignore_ascii_case(name)))
    }

    fn column(&self, name: &str) -> Result<Column, CompareError> {
        let slice = Slice::parse(name);
        let fault = |what: String, remedy: &str| CompareError::content(&self.path, name, what, remedy);
        let array = self.find(slice.array).ok_or_else(|| {
            let what = format!("there is no such array; there are {}", super::listed(&self.names()));
            fault(what, "name one of them with --column or in a mapping")
        })?;
        if array.element.kind == TypeChar::UnicodeStr {
            return Err(fault("is an array of texts".to_owned(), "name an array of numbers"));
        }
        let Some((start, stride, rows)) = array.elements(&slice) else {
            let what = format!("is of shape {:?}, not a column", array.shape);
            return Err(fault(what, "name a slice of it, such as y[2]"));
        };
        Ok(Column {
            path: self.path.clone(),
            name: name.to_owned(),
            file: array.file.clone(),
            next: array.start + (start * array.element.bytes) as u64,
            stride,
            left: rows,
            element: array.element,
            bytes: Vec::new(),
        })
    }
}

/// Where the header of an array ends by its own account, bytes; `None` if there is none.
fn header_end(head: &[u8]) -> Option<u64> {
    let field = |from: usize, to: usize| head.get(from..to).filter(|_| head.starts_with(b"\x93NUMPY"));
    match head.get(6)? {
        1 => Some(10 + u64::from(u16::from_le_bytes(field(8, 10)?.try_into().ok()?))),
        _ => Some(12 + u64::from(u32::from_le_bytes(field(8, 12)?.try_into().ok()?))),
    }
}

/// The shape of an array whose elements are within so many bytes.
fn shape_of(header: &NpyHeader, element: Element, bytes: u64) -> Option<Vec<usize>> {
    let mut elements = 1u64;
    let mut shape = Vec::with_capacity(header.shape().len());
    for &n in header.shape() {
        elements = elements.checked_mul(n)?;
        shape.push(usize::try_from(n).ok()?);
    }
    // Of texts without a letter there is one for each byte at most, too.
    let needed = elements.checked_mul(element.bytes.max(1) as u64)?;
    (needed <= bytes).then_some(shape)
}

impl Array {
    /// Start, stride and number of the elements of a slice, whichever way the array is stored.
    fn elements(&self, slice: &Slice<'_>) -> Option<(usize, usize, usize)> {
        match (&self.shape[..], self.fortran) {
            (&[rows, columns], true) => {
                // The transposed array, stored row by row.
                let of = slice.of.map(|(k, row)| (k, Some(!row.unwrap_or(rows < columns))));
                Slice { of, ..slice.clone() }.elements(&[columns, rows])
            }
            (shape, _) => slice.elements(shape),
        }
    }
}

impl Element {
    fn of(dtype: &DType) -> Option<Element> {
        let DType::Plain(text) = dtype else {
            return None;
        };
        let (kind, size) = (text.type_char(), text.size_field() as usize);
        let known = match kind {
            TypeChar::Float => matches!(size, 4 | 8),
            TypeChar::Int | TypeChar::Uint => matches!(size, 1 | 2 | 4 | 8),
            TypeChar::Bool => size == 1,
            TypeChar::UnicodeStr => true,
            _ => false,
        };
        let bytes = if kind == TypeChar::UnicodeStr {
            size.checked_mul(4)?
        } else {
            size
        };
        let big = text.endianness() == Endianness::Big;
        known.then_some(Element { kind, bytes, big })
    }

    fn value(self, raw: &[u8]) -> f64 {
        let mut bytes = [0; 8];
        let n = self.bytes;
        bytes[..n].copy_from_slice(raw);
        if self.big {
            bytes[..n].reverse();
        }
        let whole = u64::from_le_bytes(bytes);
        match (self.kind, n) {
            (TypeChar::Float, 8) => f64::from_bits(whole),
            (TypeChar::Float, _) => f64::from(f32::from_bits(whole as u32)),
            // The sign is extended from the highest byte that is there.
            (TypeChar::Int, _) => ((whole << (64 - 8 * n)) as i64 >> (64 - 8 * n)) as f64,
            _ => whole as f64,
        }
    }

    fn text(self, raw: &[u8]) -> String {
        let code = |c: &[u8]| {
            let c = [c[0], c[1], c[2], c[3]];
            if self.big {
                u32::from_be_bytes(c)
            } else {
                u32::from_le_bytes(c)
            }
        };
        raw.chunks_exact(4)
            .map(code)
            .take_while(|&c| c != 0)
            .filter_map(char::from_u32)
            .collect()
    }
}

impl Table for NpzTable {
    fn path(&self) -> &Path {
        &self.path
    }

    fn names(&self) -> Vec<String> {
        self.arrays.iter().map(|a| a.name.clone()).collect()
    }

    fn has(&self, name: &str) -> bool {
        let slice = Slice::parse(name);
        self.find(slice.array)
            .is_some_and(|array| array.elements(&slice).is_some())
    }

    fn pass(&self, columns: &[String]) -> Result<Box<dyn Pass>, CompareError> {
        let columns = columns
            .iter()
            .map(|name| self.column(name))
            .collect::<Result<Vec<_>, _>>()?;
        for pair in columns.windows(2) {
            of_one_length(&self.path, &pair[1].name, pair[1].left, (&pair[0].name, pair[0].left))?;
        }
        Ok(Box::new(NpzPass { columns }))
    }

    fn texts(&self, column: &str) -> Result<Vec<String>, CompareError> {
        match self.find(column) {
            Some(array) if array.element.kind == TypeChar::UnicodeStr => {
                let rows: usize = array.shape.iter().product();
                let raw = read_at(array.file.clone(), array.start, rows * array.element.bytes)
                    .map_err(|error| CompareError::io(&self.path, &error))?;
                Ok(raw
                    .chunks_exact(array.element.bytes.max(1))
                    .map(|c| array.element.text(c))
                    .collect())
            }
            _ => {
                let mut column = self.column(column)?;
                let mut texts = Vec::new();
                loop {
                    let mut block = Vec::new();
                    column.read(&mut block)?;
                    if block.is_empty() {
                        return Ok(texts);
                    }
                    texts.extend(block.iter().map(f64::to_string));
                }
            }
        }
    }
}

/// Bytes of a file, from a place on.
fn read_at(mut file: Place, start: u64, bytes: usize) -> std::io::Result<Vec<u8>> {
    file.seek(SeekFrom::Start(start))?;
    let mut raw = vec![0; bytes];
    file.read_exact(&mut raw)?;
    Ok(raw)
}

struct NpzPass {
    columns: Vec<Column>,
}

impl Pass for NpzPass {
    fn next(&mut self, columns: &mut [Vec<f64>]) -> Result<(), CompareError> {
        for (source, column) in self.columns.iter_mut().zip(columns) {
            source.read(column)?;
        }
        Ok(())
    }
}

struct Column {
    path: PathBuf,
    name: String,
    file: Place,
    /// Of the next element, bytes.
    next: u64,
    /// Elements from one to the next.
    stride: usize,
    left: usize,
    element: Element,
    bytes: Vec<u8>,
}

impl Column {
    fn read(&mut self, column: &mut Vec<f64>) -> Result<(), CompareError> {
        column.clear();
        let rows = self.left.min(BLOCK);
        if rows == 0 {
            return Ok(());
        }
        let (size, step) = (self.element.bytes, self.stride * self.element.bytes);
        // What lies between the elements of a column of a wide array is read with them, so not all rows at once.
        let at_once = (MOST_READ / step.max(1)).max(1);
        while column.len() < rows {
            let rows = at_once.min(rows - column.len());
            self.bytes.resize((rows - 1) * step + size, 0);
            let read = self
                .file
                .seek(SeekFrom::Start(self.next))
                .and_then(|_| self.file.read_exact(&mut self.bytes));
            read.map_err(|error| {
                let what = format!("ends too early ({error})");
                CompareError::content(
                    &self.path,
                    self.name.as_str(),
                    what,
                    "the file was cut off: write it again",
                )
            })?;
            column.extend((0..rows).map(|k| self.element.value(&self.bytes[k * step..k * step + size])));
            self.next += (rows * step) as u64;
        }
        self.left -= rows;
        Ok(())
    }
}
