//! Writer of NumPy archives: an array for each column, and one array with the metadata as JSON.

use super::metadata::{MARK, TableOrigin, metadata, raw};
use super::table::ExportTable;
use crate::Error;
use crate::output::Product;
use std::cell::RefCell;
use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::Path;
use stickslip_files::schema::StorageKind;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

fn array_header(descr: &str, shape: &str) -> Vec<u8> {
    let mut text = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}");
    let unpadded = 10 + text.len() + 1;
    text.push_str(&" ".repeat(unpadded.next_multiple_of(64) - unpadded));
    text.push('\n');
    let mut header = b"\x93NUMPY\x01\x00".to_vec();
    header.extend((text.len() as u16).to_le_bytes());
    header.extend(text.into_bytes());
    header
}

/// A file that keeps its first error and then pretends to accept everything. An archive that cannot be finished would
/// otherwise print a message on standard error when it is dropped.
struct FirstError<'a> {
    file: &'a File,
    error: &'a RefCell<Option<io::Error>>,
}

impl Write for FirstError<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.error.borrow().is_some() {
            return Ok(bytes.len());
        }
        match self.file.write(bytes) {
            Err(error) if error.kind() != io::ErrorKind::Interrupted => {
                *self.error.borrow_mut() = Some(error);
                Ok(bytes.len())
            }
            written => written,
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for FirstError<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

pub(super) fn write(table: &ExportTable, origin: &TableOrigin, file: &File, path: &Path) -> Result<(), Error> {
    let failed = |error: io::Error| Product::Table.failed(path, "writing", error);
    let error = RefCell::new(None);
    let go_on = || error.take().map_or(Ok(()), |error| Err(failed(error)));
    let mut archive = ZipWriter::new(BufWriter::new(FirstError { file, error: &error }));
    archive.set_comment(MARK).map_err(|error| failed(error.into()))?;
    let options = |bytes: usize| {
        SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .large_file(bytes as u64 > u64::from(u32::MAX) / 2)
    };
    let member = |archive: &mut ZipWriter<_>, name: &str, bytes: usize| {
        archive
            .start_file(format!("{name}.npy"), options(bytes))
            .map_err(|error| failed(error.into()))
    };
    for (k, column) in table.columns.iter().enumerate() {
        let (descr, size) = match column.kind {
            StorageKind::Float64 => ("<f8", 8),
            StorageKind::Int32 | StorageKind::Int64 => ("<i8", 8),
            StorageKind::Int8 => ("|i1", 1),
        };
        member(&mut archive, &column.name, size * table.rows)?;
        archive
            .write_all(&array_header(descr, &format!("({},)", table.rows)))
            .map_err(failed)?;
        for rows in table.blocks() {
            let values = table.read(k, rows)?;
            archive.write_all(&raw(column, &values)).map_err(failed)?;
            // Nothing is written after an error.
            if error.borrow().is_some() {
                drop(archive);
                return go_on();
            }
        }
    }
    let text = metadata(table, origin);
    member(&mut archive, "metadata", 4 * text.len())?;
    let units: Vec<u8> = text.chars().flat_map(|c| u32::from(c).to_le_bytes()).collect();
    archive
        .write_all(&array_header(&format!("<U{}", text.len()), "()"))
        .and_then(|()| archive.write_all(&units))
        .map_err(failed)?;
    let mut sink = archive.finish().map_err(|error| failed(error.into()))?;
    sink.flush().map_err(failed)?;
    go_on()
}
