//! Columns of NumPy's NPZ archives, whose arrays are of version 1.0, 2.0 or 3.0 of its format.

use super::super::CompareError;
use super::table::{
    ArrayReader, ArrayValues, BLOCK, CandidateColumn, CandidatePlace, CandidateSource, CandidateTable, LeftOut, Pass,
    TableArray, temporary,
};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use stickslip_system::quote::{quoted, shown};
use winnow::ascii::{digit1, multispace0, take_escaped};
use winnow::combinator::{alt, cut_err, delimited, opt, preceded, separated, terminated};
use winnow::error::ContextError;
use winnow::prelude::*;
use winnow::token::{any, one_of, take_till, take_while};

/// Compressed members are unpacked into a temporary file, up to so many bytes in all.
const MOST_UNPACKED: u64 = 4 << 30;

/// Bytes of a wide array that are read at once, at least a row.
const MOST_READ: usize = 4 << 20;

#[derive(Debug)]
struct NpzReader {
    path: PathBuf,
    arrays: Vec<NpyArray>,
}

#[derive(Debug)]
struct NpyArray {
    file: CandidatePlace,
    /// Offset of the first element, bytes.
    start: u64,
    count: usize,
    element: Element,
}

/// An NPZ archive. Members that are stored uncompressed (`numpy.savez`) are read in place, after their CRC-32 was
/// checked; compressed ones are unpacked into a temporary file. Fails for a missing, damaged or other file, and without
/// an array of numbers.
pub(super) fn npz_table(source: &CandidateSource) -> Result<CandidateTable, CompareError> {
    let path = source.path();
    let io = CompareError::io(path);
    let damaged = |what: String| CompareError::whole(path, what, "write it again with numpy.savez");
    let whole = source.file()?;
    let mut archive =
        zip::ZipArchive::new(whole.clone()).map_err(|error| damaged(format!("no NPZ archive: {error}")))?;
    // No name twice, no overlapping members. Each name is stored twice, and checksums are of the contents alone.
    let sound = archive.validate_header_consistency();
    sound.map_err(|error| damaged(format!("is damaged: {error}")))?;
    let (mut arrays, mut places, mut left_out) = (Vec::new(), Vec::new(), Vec::new());
    let mut unpacked = MOST_UNPACKED;
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
            // To its end, for its checksum: what is read in place has none.
            bytes = std::io::copy(&mut member, &mut std::io::sink()).map_err(not_read)?;
            file.seek(SeekFrom::Start(first)).map_err(&io)?;
        } else {
            // A member that is too large by its own entry is not unpacked.
            if member.size() > unpacked {
                return Err(too_much());
            }
            let mut kept = temporary()?;
            let mut rest = member.take(unpacked + 1);
            let (mut block, mut length) = (vec![0; 1 << 16], 0);
            loop {
                let count = rest.read(&mut block).map_err(not_read)?;
                if count == 0 {
                    break;
                }
                kept.write_all(&block[..count]).map_err(CompareError::temporary)?;
                length += count as u64;
            }
            bytes = length;
            unpacked = unpacked.checked_sub(bytes).ok_or_else(too_much)?;
            (file, first) = (CandidatePlace::from(kept), 0);
        }
        // The header is read as a whole, so that its length is not taken on trust.
        let mut head = Vec::new();
        let mut start = file.take(bytes.min(LONGEST_HEADER as u64));
        start.read_to_end(&mut head).map_err(&io)?;
        let header = NpyHeader::read(&head).map_err(|why| of_member(&format!(" {why}")))?;
        let element = match Element::of(&header) {
            Ok(element) => element,
            Err((why, remedy)) => {
                let remedy = remedy.replace("NAME", &shown(&name));
                left_out.push(LeftOut { name, why, remedy });
                continue;
            }
        };
        let shape = header.shape_within(bytes - header.end as u64, element);
        let shape = shape.ok_or_else(|| of_member(" is longer than its member of the archive"))?;
        places.push(NpyArray {
            file: start.into_inner(),
            start: first + header.end as u64,
            count: shape.iter().product(),
            element,
        });
        arrays.push(TableArray {
            name,
            values: match element.is_text() {
                true => ArrayValues::Texts,
                false => ArrayValues::Numbers,
            },
            shape: Some(shape),
            fortran: header.fortran,
        });
    }
    if arrays.is_empty() {
        let first = left_out
            .first()
            .map(|one| format!(": {} {}", shown(&one.name), one.why));
        let what = "holds no array of numbers".to_owned();
        return Err(damaged(what + &first.unwrap_or_default()));
    }
    let path = path.to_owned();
    Ok(CandidateTable {
        path: path.clone(),
        arrays,
        left_out,
        by_path: false,
        reader: Box::new(NpzReader { path, arrays: places }),
    })
}

impl ArrayReader for NpzReader {
    fn pass(&self, columns: Vec<CandidateColumn>) -> Result<Pass<'_>, CompareError> {
        let column = |column: CandidateColumn| {
            let (array, (start, stride, left)) = (&self.arrays[column.array], column.elements);
            NpzColumn {
                path: &self.path,
                name: column.name,
                array,
                next: array.start + (start * array.element.bytes) as u64,
                stride,
                left,
                bytes: Vec::new(),
            }
        };
        let mut sources: Vec<_> = columns.into_iter().map(column).collect();
        Ok(Box::new(move |columns| {
            let mut pairs = sources.iter_mut().zip(columns);
            pairs.try_for_each(|(source, column)| source.read(column))
        }))
    }

    fn texts(&self, array: usize) -> Result<Option<Vec<String>>, CompareError> {
        let NpyArray {
            file,
            start,
            count,
            element,
        } = &self.arrays[array];
        if !element.is_text() {
            return Ok(None);
        }
        let mut raw = vec![0; count * element.bytes];
        file.read_at(*start, &mut raw).map_err(CompareError::io(&self.path))?;
        let texts = raw.chunks_exact(element.bytes.max(1));
        Ok(Some(texts.map(|text| element.text(text)).collect()))
    }
}

struct NpzColumn<'a> {
    path: &'a Path,
    name: String,
    array: &'a NpyArray,
    /// Offset of the next element, bytes.
    next: u64,
    /// Distance of two elements.
    stride: usize,
    left: usize,
    bytes: Vec<u8>,
}

impl NpzColumn<'_> {
    fn read(&mut self, column: &mut Vec<f64>) -> Result<(), CompareError> {
        column.clear();
        let (rows, element) = (self.left.min(BLOCK), self.array.element);
        let (size, step) = (element.bytes, self.stride * element.bytes);
        // Elements between those of a column of a wide array are read as well, so rows are read in parts.
        let at_once = (MOST_READ / step.max(1)).max(1);
        while column.len() < rows {
            let rows = at_once.min(rows - column.len());
            self.bytes.resize((rows - 1) * step + size, 0);
            let read = self.array.file.read_at(self.next, &mut self.bytes);
            read.map_err(|error| {
                let what = format!("ends too early ({error})");
                CompareError::content(self.path, &*self.name, what, "the file was cut off: write it again")
            })?;
            column.extend((0..rows).map(|k| element.value(&self.bytes[k * step..k * step + size])));
            self.next += (rows * step) as u64;
        }
        self.left -= rows;
        Ok(())
    }
}

/// The header, with what is in front of it, is no longer, bytes.
pub(super) const LONGEST_HEADER: usize = 1 << 20;

#[derive(Debug)]
pub(super) struct NpyHeader {
    /// The name of its type, such as `<f8`; `None`: it holds records.
    pub kind: Option<String>,
    pub fortran: bool,
    pub shape: Vec<u64>,
    /// Where its elements begin, bytes.
    pub end: usize,
}

impl NpyHeader {
    /// Reads the header from the first bytes of an array, its end or [`LONGEST_HEADER`] of them; else says what is wrong.
    pub fn read(start: &[u8]) -> Result<NpyHeader, String> {
        const CUT: &str = "ends within its header";
        let versioned = start.strip_prefix(b"\x93NUMPY").ok_or("is no array of NumPy")?;
        let (version, sized) = versioned.split_first_chunk().ok_or(CUT)?;
        let bytes = match version {
            [1, 0] => 2,
            [2 | 3, 0] => 4,
            [major, minor] => {
                let why = format!("is of version {major}.{minor} of NumPy's format, not of 1.0, 2.0 or 3.0");
                return Err(why);
            }
        };
        let (length, text) = sized.split_at_checked(bytes).ok_or(CUT)?;
        let length = length.iter().rev().fold(0, |sum, &byte| 256 * sum + usize::from(byte));
        let front = start.len() - text.len();
        if length > LONGEST_HEADER - front {
            return Err(format!("says that its header has {length} bytes, more than 1 MB"));
        }
        let text = text.get(..length).ok_or(CUT)?;
        let entries = dictionary.parse(text).map_err(|error| {
            match String::from_utf8_lossy(&text[error.offset().min(length)..]).trim() {
                "" => "has a header that breaks off".to_owned(),
                rest => format!("has a header that cannot be read from {} on", quoted(rest)),
            }
        })?;
        let (mut kind, mut fortran, mut shape) = (None, None, None);
        for entry in entries {
            let twice = match entry {
                NpyEntry::Kind(its) => kind.replace(its).map(|_| "descr"),
                NpyEntry::Fortran(its) => fortran.replace(its).map(|_| "fortran_order"),
                NpyEntry::Shape(its) => shape.replace(its).map(|_| "shape"),
            };
            if let Some(key) = twice {
                return Err(format!("has a header that states {key} twice"));
            }
        }
        let missing = |key: &str| format!("has a header without {key}");
        Ok(NpyHeader {
            kind: kind.ok_or_else(|| missing("descr"))?,
            fortran: fortran.ok_or_else(|| missing("fortran_order"))?,
            shape: shape.ok_or_else(|| missing("shape"))?,
            end: front + length,
        })
    }

    /// The shape, if its elements of this size are within so many bytes.
    pub fn shape_within(&self, bytes: u64, element: Element) -> Option<Vec<usize>> {
        // Without the zeros of an empty array, so that a step from one row to the next is in range, too. Of texts without a letter
        // there is one for each byte at most.
        let mut of_one = self.shape.iter().map(|&n| n.max(1));
        let size = of_one.try_fold(element.bytes.max(1) as u64, u64::checked_mul)?;
        isize::try_from(size).ok()?;
        let fits = self.shape.contains(&0) || size <= bytes;
        let shape = self.shape.iter().map(|&n| usize::try_from(n).ok());
        shape.collect::<Option<_>>().filter(|_| fits)
    }
}

enum NpyEntry {
    Kind(Option<String>),
    Fortran(bool),
    Shape(Vec<u64>),
}

/// `{'descr': '<f8', 'fortran_order': False, 'shape': (3, 4), }`
fn dictionary(input: &mut &[u8]) -> ModalResult<Vec<NpyEntry>> {
    let kind = alt((
        text.map(|name| Some(String::from_utf8_lossy(name).into_owned())),
        records.value(None),
    ));
    let truth = alt((b"True".value(true), b"False".value(false)));
    // Python 2 wrote 3L.
    let number = terminated(digit1.parse_to::<u64>(), opt(b'L'));
    let shape = delimited(b'(', separated(0.., token(number), b','), (opt(token(b',')), b')'));
    let entry = alt((
        preceded(key(b"descr"), cut_err(token(kind))).map(NpyEntry::Kind),
        preceded(key(b"fortran_order"), cut_err(token(truth))).map(NpyEntry::Fortran),
        preceded(key(b"shape"), cut_err(token(shape))).map(NpyEntry::Shape),
    ));
    delimited(
        token(b'{'),
        separated(0.., entry, b','),
        (opt(token(b',')), token(b'}')),
    )
    .parse_next(input)
}

/// With the blanks around it.
fn token<'a, T>(parser: impl ModalParser<&'a [u8], T, ContextError>) -> impl ModalParser<&'a [u8], T, ContextError> {
    delimited(multispace0, parser, multispace0)
}

fn key<'a>(name: &'static [u8]) -> impl ModalParser<&'a [u8], (), ContextError> {
    (token(text.verify(move |text: &[u8]| text == name)), b':').void()
}

/// What is between quotes, as it is written: no key and no name of a type has anything to unescape.
fn text<'a>(input: &mut &'a [u8]) -> ModalResult<&'a [u8]> {
    let quote = one_of(b"'\"").parse_next(input)?;
    terminated(take_escaped(take_till(1.., [quote, b'\\']), b'\\', any), quote).parse_next(input)
}

/// The list of the fields of records, which may have records in them; nothing of it is read but where it ends.
fn records(input: &mut &[u8]) -> ModalResult<()> {
    b'['.parse_next(input)?;
    let mut open = 1;
    while open > 0 {
        let blank = take_while(1.., b", \t\r\n0123456789L");
        open += alt((
            one_of(b"[(").value(1),
            one_of(b")]").value(-1),
            alt((blank, text)).value(0),
        ))
        .parse_next(input)?;
    }
    Ok(())
}

/// How an element is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Element {
    kind: Kind,
    /// Its size.
    pub bytes: usize,
    big: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Float,
    Signed,
    /// Or a boolean.
    Unsigned,
    /// Of four bytes a letter.
    Text,
    TextOfBytes,
}

impl Element {
    /// How values of a type are read; of others what they are, and what to save instead.
    pub fn of(header: &NpyHeader) -> Result<Element, (String, &'static str)> {
        let Some(text) = &header.kind else {
            return Err(("holds records".to_owned(), "save each of their fields as an array"));
        };
        let mut rest = text.chars();
        let (order, letter, size) = (rest.next(), rest.next().unwrap_or(' '), rest.as_str());
        // `parse` would take a sign, too.
        let size = size.parse::<usize>().ok().filter(|_| !size.starts_with('+'));
        let known = size.and_then(|size| match (letter, size) {
            ('f', 2 | 4 | 8) => Some((Kind::Float, size)),
            ('i', 1 | 2 | 4 | 8) => Some((Kind::Signed, size)),
            ('u', 1 | 2 | 4 | 8) | ('b', 1) => Some((Kind::Unsigned, size)),
            ('U', _) => Some((Kind::Text, size.checked_mul(4)?)),
            ('S' | 'a', _) => Some((Kind::TextOfBytes, size)),
            _ => None,
        });
        let ordered = |&(kind, bytes): &(Kind, usize)| match order {
            Some('<' | '>') => true,
            Some('|') => bytes == 1 || kind == Kind::TextOfBytes,
            _ => false,
        };
        if let Some((kind, bytes)) = known.filter(ordered) {
            let big = order == Some('>');
            return Ok(Element { kind, bytes, big });
        }
        let floats = "save it as floats, NAME.astype(float)";
        let (what, remedy) = match letter {
            'c' => ("complex numbers", "save its real part, NAME.real"),
            'O' => ("Python objects", floats),
            'm' | 'M' => ("dates or times of NumPy", "save seconds as floats"),
            _ => ("values of a type that is not read", floats),
        };
        Err((format!("holds {what} ({})", shown(text)), remedy))
    }

    pub fn is_text(self) -> bool {
        matches!(self.kind, Kind::Text | Kind::TextOfBytes)
    }

    pub fn value(self, raw: &[u8]) -> f64 {
        let mut bytes = [0; 8];
        let n = self.bytes;
        bytes[..n].copy_from_slice(raw);
        if self.big {
            bytes[..n].reverse();
        }
        let whole = u64::from_le_bytes(bytes);
        match (self.kind, n) {
            (Kind::Float, 8) => f64::from_bits(whole),
            (Kind::Float, 2) => half(whole as u16),
            (Kind::Float, _) => f64::from(f32::from_bits(whole as u32)),
            // The sign is extended from the highest byte that is there.
            (Kind::Signed, _) => ((whole << (64 - 8 * n)) as i64 >> (64 - 8 * n)) as f64,
            _ => whole as f64,
        }
    }

    pub fn text(self, raw: &[u8]) -> String {
        if self.kind == Kind::TextOfBytes {
            let text = raw.split(|&byte| byte == 0).next().unwrap_or_default();
            return String::from_utf8_lossy(text).into_owned();
        }
        let (letters, _) = raw.as_chunks::<4>();
        let code = if self.big {
            u32::from_be_bytes
        } else {
            u32::from_le_bytes
        };
        let codes = letters.iter().map(|letter| code(*letter)).take_while(|&c| c != 0);
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
