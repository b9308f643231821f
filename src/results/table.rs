//! Files, groups and growing tables: what every writer of HDF5 files is made of.

use std::path::Path;

use hdf5::plist::file_access::LibraryVersion;
use hdf5::plist::file_create::{FileSpaceStrategy, LinkCreationOrder};
use hdf5::{Dataset, Group};

use super::attributes::{describe, write_codes};
use super::checksums::{Known, Summed, Sums};
use super::raw;
use super::schema::{Kind, Table, Variable};

/// gzip: the smallest level does nearly all that can be done to shuffled doubles, at a third of the time.
pub(super) const DEFLATE_LEVEL: u8 = 1;

/// One value of a row.
#[derive(Debug, Clone, Copy)]
pub(super) enum Cell {
    I8(i8),
    I32(i32),
    I64(i64),
    F64(f64),
}

/// The values of a column, or those that are not yet in the file.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Codes.
    Int8(Vec<i8>),
    /// Indices.
    Int32(Vec<i32>),
    /// Counts.
    Int64(Vec<i64>),
    /// Quantities.
    Float64(Vec<f64>),
}

impl Values {
    pub(super) fn new(kind: Kind, capacity: usize) -> Self {
        match kind {
            Kind::Int8 => Values::Int8(Vec::with_capacity(capacity)),
            Kind::Int32 => Values::Int32(Vec::with_capacity(capacity)),
            Kind::Int64 => Values::Int64(Vec::with_capacity(capacity)),
            Kind::Float64 => Values::Float64(Vec::with_capacity(capacity)),
        }
    }

    pub(super) fn push(&mut self, cell: Cell) {
        match (self, cell) {
            (Values::Int8(buffer), Cell::I8(value)) => buffer.push(value),
            (Values::Int32(buffer), Cell::I32(value)) => buffer.push(value),
            (Values::Int64(buffer), Cell::I64(value)) => buffer.push(value),
            (Values::Float64(buffer), Cell::F64(value)) => buffer.push(value),
            (_, cell) => unreachable!("{cell:?} is not what the schema has in this column"),
        }
    }

    /// Writes the rows to `dataset` from row `start` on, and forgets them.
    fn append(&mut self, dataset: &Dataset, start: usize, sums: &mut Sums) -> hdf5::Result<()> {
        match self {
            Values::Int8(rows) => append(rows, dataset, start, sums),
            Values::Int32(rows) => append(rows, dataset, start, sums),
            Values::Int64(rows) => append(rows, dataset, start, sums),
            Values::Float64(rows) => append(rows, dataset, start, sums),
        }
    }
}

/// Writes `rows` to `dataset` from row `start` on, and forgets them.
fn append<T: hdf5::H5Type + Summed>(
    rows: &mut Vec<T>,
    dataset: &Dataset,
    start: usize,
    sums: &mut Sums,
) -> hdf5::Result<()> {
    let end = start + rows.len();
    sums.add(dataset, rows);
    dataset.resize([end])?;
    dataset.write_slice(&rows[..], start..end)?;
    rows.clear();
    Ok(())
}

/// A group of columns that grow together.
pub(super) struct TableWriter {
    columns: Vec<(Dataset, Values)>,
    /// Of the values in the file.
    sums: Sums,
    chunk: usize,
    /// Rows in the file.
    written: usize,
    buffered: usize,
}

impl TableWriter {
    pub(super) fn create(file: &hdf5::File, table: &Table) -> hdf5::Result<Self> {
        let group = create_group(file, table.group)?;
        let mut columns: Vec<(Dataset, Values)> = Vec::with_capacity(table.variables.len());
        for variable in &table.variables {
            let dataset = create_variable(&group, variable, table.chunk)?;
            match columns.first() {
                None => raw::set_scale(&dataset, &variable.name)?,
                Some((scale, _)) => raw::attach_scale(&dataset, scale, 0)?,
            }
            columns.push((dataset, Values::new(variable.kind, table.chunk)));
        }
        Ok(TableWriter {
            columns,
            sums: Sums::default(),
            chunk: table.chunk,
            written: 0,
            buffered: 0,
        })
    }

    /// Rows in the file, without those that are buffered.
    pub(super) fn written(&self) -> usize {
        self.written
    }

    /// The checksums of what is in the file.
    pub(super) fn sums(&self) -> Known {
        self.sums.known()
    }

    /// Rows, with those that are buffered.
    pub(super) fn rows(&self) -> usize {
        self.written + self.buffered
    }

    pub(super) fn next_index(&self) -> i32 {
        i32::try_from(self.rows()).unwrap_or(i32::MAX)
    }

    /// Buffers a row; true if it is the last of a chunk.
    pub(super) fn push(&mut self, cells: impl IntoIterator<Item = Cell>) -> bool {
        let mut cells = cells.into_iter();
        for ((_, buffer), cell) in self.columns.iter_mut().zip(&mut cells) {
            buffer.push(cell);
        }
        self.buffered += 1;
        self.rows().is_multiple_of(self.chunk)
    }

    /// Writes what is buffered.
    pub(super) fn append(&mut self) -> hdf5::Result<()> {
        if self.buffered > 0 {
            for (dataset, buffer) in &mut self.columns {
                buffer.append(dataset, self.written, &mut self.sums)?;
            }
            self.written += self.buffered;
            self.buffered = 0;
        }
        Ok(())
    }
}

/// A new file with variables in their own order, not the alphabet's.
pub(super) fn create_file(path: &Path) -> hdf5::Result<hdf5::File> {
    create_file_since(path, LibraryVersion::Earliest)
}

/// The same in the formats that readers from this version of HDF5 on know.
pub(super) fn create_file_since(path: &Path, version: LibraryVersion) -> hdf5::Result<hdf5::File> {
    hdf5::File::with_options()
        // No lock of HDF5's own, which would keep readers out; `WriteLock` keeps writers out.
        .with_fapl(|access| {
            access
                .file_locking(false)
                .libver_bounds(version, LibraryVersion::latest())
        })
        .with_fcpl(|create| {
            create
                .link_creation_order(LinkCreationOrder::Indexed)
                .obj_track_times(false)
                // Freed space is not used again: until the next flush, what is on disk refers to it.
                .file_space_strategy(FileSpaceStrategy::None)
        })
        .create_excl(path)
}

pub(super) fn create_group(parent: &Group, name: &str) -> hdf5::Result<Group> {
    parent
        .create_group_builder()
        .with_gcpl(|create| {
            create
                .link_creation_order(LinkCreationOrder::Indexed)
                .obj_track_times(false)
        })
        .create(name)
}

fn create_variable(group: &Group, variable: &Variable, chunk: usize) -> hdf5::Result<Dataset> {
    let builder = group
        .new_dataset_builder()
        .obj_track_times(false)
        .shuffle()
        .deflate(DEFLATE_LEVEL)
        .fletcher32()
        .chunk(chunk)
        // No cache: a block goes to new space at the end of the file at once, which no metadata on
        // disk refers to yet, and the flush that follows has only metadata to write.
        .chunk_cache(1, 0, 0.0);
    let dataset = match variable.kind {
        Kind::Int8 => builder.empty::<i8>(),
        Kind::Int32 => builder.empty::<i32>(),
        Kind::Int64 => builder.empty::<i64>(),
        Kind::Float64 => builder.empty::<f64>(),
    }
    .shape(0..)
    .create(variable.name.as_str())?;
    describe(&dataset, variable.units, &variable.long_name)?;
    if !variable.flags.is_empty() {
        write_codes(&dataset, variable.flags.iter().copied())?;
    }
    Ok(dataset)
}
