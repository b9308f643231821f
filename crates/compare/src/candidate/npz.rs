//! Columns of NumPy's NPZ archives (and single NPY arrays).

use super::super::CompareError;
use super::absent;
use super::npy::{Element, LONGEST_HEADER, NpyHeader};
use super::source::{CandidatePlace, CandidateSource, temporary};
use super::table::{BLOCK, CandidateTable, LeftOut, Pass, Slice, no_column, of_one_length, place_of};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use stickslip_system::quote::shown;

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
    file: CandidatePlace,
    /// Of the first element, bytes.
    start: u64,
    shape: Vec<usize>,
    fortran: bool,
    element: Element,
}

impl NpzTable {
    /// Opens an archive and reads the headers of its arrays.
    ///
    /// # Errors
    /// No such file, no zip archive, a damaged one, one with two members of a name, or none with arrays of numbers.
    pub fn open(source: &CandidateSource) -> Result<NpzTable, CompareError> {
        let path = source.path();
        let io = CompareError::io(path);
        let damaged = |what: String| CompareError::whole(path, what, "write it again with numpy.savez");
        let whole = source.file()?;
        let mut archive =
            zip::ZipArchive::new(whole.clone()).map_err(|error| damaged(format!("no NPZ archive: {error}")))?;
        // No name twice, no overlapping members. Each name is stored twice, and checksums are of the contents alone.
        let sound = archive.validate_header_consistency();
        sound.map_err(|error| damaged(format!("is damaged: {error}")))?;
        let (mut arrays, mut left_out) = (Vec::new(), Vec::new());
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
                // What the archive itself says is not unpacked to find out.
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
            arrays.push(Array {
                shape: shape.ok_or_else(|| of_member(" is longer than its member of the archive"))?,
                file: start.into_inner(),
                start: first + header.end as u64,
                fortran: header.fortran,
                element,
                name,
            });
        }
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

    fn column(&self, name: &str) -> Result<NpzColumn<'_>, CompareError> {
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
        Ok(NpzColumn {
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

impl CandidateTable for NpzTable {
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

struct NpzColumn<'a> {
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

impl NpzColumn<'_> {
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
