//! Columns of NumPy's NPZ archives (and single NPY arrays).

use super::super::CompareError;
use super::absent;
use super::source::{Place, Source, temporary};
use super::table::{BLOCK, LeftOut, Pass, Slice, Table, no_column, of_one_length, place_of};
use crate::quote::shown;
use npyz::{DType, Endianness, NpyHeader, Order, TypeChar};
use std::collections::HashSet;
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
pub(super) struct NpzTable {
    path: PathBuf,
    arrays: Vec<Array>,
    left_out: Vec<LeftOut>,
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
    /// No such file, no zip archive, a damaged one, one with two members of a name, or none with arrays of numbers.
    pub fn open(source: &Source) -> Result<NpzTable, CompareError> {
        let path = source.path();
        let io = CompareError::io(path);
        let damaged = |what: String| CompareError::whole(path, what, "write it again with numpy.savez");
        let whole = source.file()?;
        let length = whole.length().map_err(&io)?;
        let mut archive =
            zip::ZipArchive::new(whole.clone()).map_err(|error| damaged(format!("no NPZ archive: {error}")))?;
        if let Some(name) = doubled(&whole, archive.central_directory_start()).map_err(&io)? {
            let what = "is in the archive twice";
            return Err(CompareError::content(
                path,
                shown(&name),
                what,
                "write each array once, with numpy.savez",
            ));
        }
        let (mut arrays, mut left_out) = (Vec::new(), Vec::new());
        let mut unpacked = MOST_UNPACKED;
        // Members that are stored as they are lie one after the other: all of them are no longer than the archive.
        let mut unread = length;
        let too_much = || {
            let what = format!("unpacks to more than {} GB", MOST_UNPACKED >> 30);
            let remedy = "write it with numpy.savez, which does not compress";
            CompareError::whole(path, what, remedy)
        };
        for index in 0..archive.len() {
            let mut member = archive.by_index(index).map_err(|error| damaged(error.to_string()))?;
            let name = member.name().map_err(|error| damaged(error.to_string()))?.into_owned();
            let Some(name) = name.strip_suffix(".npy").map(str::to_owned) else {
                left_out.push(LeftOut {
                    name,
                    why: "is no array".to_owned(),
                    remedy: "write arrays with numpy.savez".to_owned(),
                });
                continue;
            };
            let of_member = |what: &str| damaged(format!("{}{what}", shown(&name)));
            let not_read = |error: std::io::Error| {
                let what = format!("{}: {error}", shown(&name));
                let remedy = "the file was damaged on its way: copy it again, or write it again with numpy.savez";
                CompareError::whole(path, what, remedy)
            };
            let (mut file, first, bytes);
            if member.compression() == zip::CompressionMethod::Stored {
                file = whole.clone();
                first = member.data_start().ok_or_else(|| of_member(" has no data"))?;
                let left = unread.checked_sub(member.size());
                unread = left.ok_or_else(|| of_member(" is longer than the archive"))?;
                // To its end, for its checksum: what is read in place has none.
                std::io::copy(&mut member, &mut std::io::sink()).map_err(not_read)?;
                bytes = member.size().min(length.saturating_sub(first));
                file.seek(SeekFrom::Start(first)).map_err(&io)?;
            } else {
                // What the archive itself says is not unpacked to find out.
                if member.size() > unpacked {
                    return Err(too_much());
                }
                let mut kept = temporary()?;
                bytes = std::io::copy(&mut member.take(unpacked + 1), &mut kept).map_err(not_read)?;
                unpacked = unpacked.checked_sub(bytes).ok_or_else(too_much)?;
                (file, first) = (Place::from(kept), 0);
            }
            // The header is read as a whole, so that its length is not taken on trust.
            let mut head = Vec::new();
            let mut start = file.take(bytes.min(LONGEST_HEADER));
            start.read_to_end(&mut head).map_err(&io)?;
            if header_end(&head).is_none_or(|end| end > head.len() as u64) {
                return Err(of_member(" has no whole header"));
            }
            let mut cursor = std::io::Cursor::new(head);
            let header = NpyHeader::from_reader(&mut cursor);
            let header = header.map_err(|error| of_member(&format!(": {}", shown(&error.to_string()))))?;
            let element = match Element::of(&header.dtype()) {
                Ok(element) => element,
                Err((why, remedy)) => {
                    let remedy = remedy.replace("NAME", &shown(&name));
                    left_out.push(LeftOut { name, why, remedy });
                    continue;
                }
            };
            let shape = shape_of(&header, element, bytes.saturating_sub(cursor.position()));
            arrays.push(Array {
                shape: shape.ok_or_else(|| of_member(" is longer than its member of the archive"))?,
                file: start.into_inner(),
                start: first + cursor.position(),
                fortran: header.order() == Order::Fortran,
                element,
                name,
            });
        }
        // Checksums are of the contents alone: each name is stored twice, and both are to be the same.
        let sound = archive.validate_header_consistency();
        sound.map_err(|error| damaged(format!("is damaged: {error}")))?;
        if arrays.is_empty() {
            let first = left_out
                .first()
                .map(|one| format!(": {} {}", shown(&one.name), one.why));
            return Err(damaged(
                "holds no array of numbers".to_owned() + &first.unwrap_or_default(),
            ));
        }
        let path = path.to_owned();
        Ok(NpzTable { path, arrays, left_out })
    }

    fn find(&self, name: &str) -> Option<&Array> {
        let place = place_of(self.arrays.iter().map(|array| array.name.as_str()), name)?;
        Some(&self.arrays[place])
    }

    fn column(&self, name: &str) -> Result<Column<'_>, CompareError> {
        let slice = Slice::parse(name);
        let array = self.find(slice.array).ok_or_else(|| absent(self, name))?;
        if array.element.is_text() {
            let what = "is an array of texts";
            return Err(CompareError::content(
                &self.path,
                name,
                what,
                "name an array of numbers",
            ));
        }
        let (start, stride, left) = array
            .elements(&slice)
            .ok_or_else(|| no_column(&self.path, name, &array.shape))?;
        Ok(Column {
            path: &self.path,
            name: name.to_owned(),
            array,
            next: array.start + (start * array.element.bytes) as u64,
            stride,
            left,
            bytes: Vec::new(),
        })
    }
}

/// A name that two members of an archive have, by its directory, which begins at a byte.
fn doubled(file: &Place, mut at: u64) -> std::io::Result<Option<String>> {
    let mut names = HashSet::new();
    let mut entry = [0; 46];
    let end = file.length()?;
    while at + 46 <= end {
        file.read_at(at, &mut entry)?;
        if !entry.starts_with(b"PK\x01\x02") {
            break;
        }
        let length = |from: usize| u64::from(u16::from_le_bytes([entry[from], entry[from + 1]]));
        let mut name = vec![0; length(28) as usize];
        if at + 46 + length(28) > end {
            break;
        }
        file.read_at(at + 46, &mut name)?;
        at += 46 + length(28) + length(30) + length(32);
        let text = String::from_utf8_lossy(&name).trim_end_matches(".npy").to_owned();
        if !names.insert(name) {
            return Ok(Some(text));
        }
    }
    Ok(None)
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
    /// How values of a type are read; of others what they are, and what to save instead.
    fn of(dtype: &DType) -> Result<Element, (String, &'static str)> {
        let DType::Plain(text) = dtype else {
            return Err(("holds records".to_owned(), "save each of their fields as an array"));
        };
        let (kind, size) = (text.type_char(), text.size_field() as usize);
        let known = match kind {
            TypeChar::Float => matches!(size, 2 | 4 | 8),
            TypeChar::Int | TypeChar::Uint => matches!(size, 1 | 2 | 4 | 8),
            TypeChar::Bool => size == 1,
            TypeChar::UnicodeStr | TypeChar::ByteStr => true,
            _ => false,
        };
        let bytes = size.checked_mul(if kind == TypeChar::UnicodeStr { 4 } else { 1 });
        let big = text.endianness() == Endianness::Big;
        let floats = "save it as floats, NAME.astype(float)";
        let (what, remedy) = match (bytes.filter(|_| known), kind) {
            (Some(bytes), _) => return Ok(Element { kind, bytes, big }),
            (None, TypeChar::Complex) => ("complex numbers", "save its real part, NAME.real"),
            (None, TypeChar::Object) => ("Python objects", floats),
            (None, TypeChar::DateTime | TypeChar::TimeDelta) => ("dates or times of NumPy", "save seconds as floats"),
            (None, _) => ("values of a type that is not read", floats),
        };
        Err((format!("holds {what} ({text})"), remedy))
    }

    fn is_text(self) -> bool {
        matches!(self.kind, TypeChar::UnicodeStr | TypeChar::ByteStr)
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
            (TypeChar::Float, 2) => half(whole as u16),
            (TypeChar::Float, _) => f64::from(f32::from_bits(whole as u32)),
            // The sign is extended from the highest byte that is there.
            (TypeChar::Int, _) => ((whole << (64 - 8 * n)) as i64 >> (64 - 8 * n)) as f64,
            _ => whole as f64,
        }
    }

    fn text(self, raw: &[u8]) -> String {
        if self.kind == TypeChar::ByteStr {
            let text = raw.split(|&byte| byte == 0).next().unwrap_or_default();
            return String::from_utf8_lossy(text).into_owned();
        }
        let code = |c: &[u8]| {
            let c = [c[0], c[1], c[2], c[3]];
            if self.big {
                u32::from_be_bytes(c)
            } else {
                u32::from_le_bytes(c)
            }
        };
        let codes = raw.chunks_exact(4).map(code).take_while(|&c| c != 0);
        codes.filter_map(char::from_u32).collect()
    }
}

/// The value of a float of 16 bits.
fn half(bits: u16) -> f64 {
    let (exponent, fraction) = (i32::from(bits >> 10 & 0x1f), f64::from(bits & 0x3ff));
    let size = match exponent {
        0 => fraction * 2f64.powi(-24),
        0x1f if fraction == 0.0 => f64::INFINITY,
        0x1f => f64::NAN,
        _ => (1.0 + fraction / 1024.0) * 2f64.powi(exponent - 15),
    };
    if bits >> 15 == 0 { size } else { -size }
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
        let array = self.find(slice.array).filter(|array| !array.element.is_text());
        array.is_some_and(|array| array.elements(&slice).is_some())
    }

    fn columns_of(&self, name: &str, exact: bool) -> Vec<String> {
        let (array, slice) = name.split_at(Slice::parse(name).array.len());
        let is_it = |known: &&Array| match exact {
            true => known.name == array,
            false => known.name.eq_ignore_ascii_case(array),
        };
        let columns = self.arrays.iter().filter(is_it);
        let columns = columns.map(|array| format!("{}{slice}", array.name));
        columns.filter(|name| self.has(name)).collect()
    }

    fn left_out(&self) -> &[LeftOut] {
        &self.left_out
    }

    fn shape(&self, name: &str) -> Option<Vec<usize>> {
        let array = self.find(Slice::parse(name).array)?;
        (!array.element.is_text()).then(|| array.shape.clone())
    }

    fn has_texts(&self, name: &str) -> bool {
        let slice = Slice::parse(name);
        let array = self.find(slice.array);
        array.is_some_and(|array| array.elements(&slice).is_some())
    }

    fn pass(&self, columns: &[String]) -> Result<Pass<'_>, CompareError> {
        let columns = columns.iter().map(|name| self.column(name));
        let mut sources = columns.collect::<Result<Vec<_>, _>>()?;
        for pair in sources.windows(2) {
            of_one_length(&self.path, &pair[1].name, pair[1].left, (&pair[0].name, pair[0].left))?;
        }
        Ok(Box::new(move |columns| {
            let mut pairs = sources.iter_mut().zip(columns);
            pairs.try_for_each(|(source, column)| source.read(column))
        }))
    }

    fn texts(&self, column: &str) -> Result<Vec<String>, CompareError> {
        if let Some(array) = self.find(column).filter(|array| array.element.is_text()) {
            let rows: usize = array.shape.iter().product();
            let mut raw = vec![0; rows * array.element.bytes];
            let read = array.file.read_at(array.start, &mut raw);
            read.map_err(CompareError::io(&self.path))?;
            let texts = raw.chunks_exact(array.element.bytes.max(1));
            return Ok(texts.map(|text| array.element.text(text)).collect());
        }
        let (mut column, mut texts) = (self.column(column)?, Vec::new());
        let mut block = Vec::new();
        loop {
            column.read(&mut block)?;
            if block.is_empty() {
                return Ok(texts);
            }
            texts.extend(block.iter().map(f64::to_string));
        }
    }
}

struct Column<'a> {
    path: &'a Path,
    name: String,
    array: &'a Array,
    /// Of the next element, bytes.
    next: u64,
    /// Elements from one to the next.
    stride: usize,
    left: usize,
    bytes: Vec<u8>,
}

impl Column<'_> {
    fn read(&mut self, column: &mut Vec<f64>) -> Result<(), CompareError> {
        column.clear();
        let (rows, element) = (self.left.min(BLOCK), self.array.element);
        let (size, step) = (element.bytes, self.stride * element.bytes);
        // What lies between the elements of a column of a wide array is read with them, so not all rows at once.
        let at_once = (MOST_READ / step.max(1)).max(1);
        while column.len() < rows {
            let rows = at_once.min(rows - column.len());
            self.bytes.resize((rows - 1) * step + size, 0);
            let read = self.array.file.read_at(self.next, &mut self.bytes);
            read.map_err(|error| {
                let (what, remedy) = (
                    format!("ends too early ({error})"),
                    "the file was cut off: write it again",
                );
                CompareError::content(self.path, self.name.as_str(), what, remedy)
            })?;
            column.extend((0..rows).map(|k| element.value(&self.bytes[k * step..k * step + size])));
            self.next += (rows * step) as u64;
        }
        self.left -= rows;
        Ok(())
    }
}
