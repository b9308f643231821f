//! Files, groups and growing tables: the common parts of all HDF5 writers.

use std::path::Path;

use hdf5::dataset::DatasetBuilder;
use hdf5::plist::dataset_create::{DatasetCreateBuilder, FillTime};
use hdf5::plist::file_access::LibraryVersion;
use hdf5::plist::file_create::{FileSpaceStrategy, LinkCreationOrder};
use hdf5::plist::{DatasetAccess, DatasetCreate, LinkCreate};
use hdf5::{Dataset, Dataspace, Datatype, Extents, Group, Selection};
use ndarray::{ArrayViewD, IxDyn};

use super::attributes::describe;
use super::packed::{DEFLATE_LEVEL, Packer};
use super::raw;
use super::schema::{StorageKind, TableSchema, Variable};
use super::values::{ColumnValues, StoredNumber, each, with_type};

impl ColumnValues<'_> {
    pub(super) fn write(&self, dataset: &Dataset) -> hdf5::Result<()> {
        each!(self, list => dataset.write_raw(&list[..]))
    }

    /// Writes the values to a part of `dataset` with this shape, and clears them.
    pub(super) fn write_block(&mut self, dataset: &Dataset, shape: &[usize], part: Selection) -> hdf5::Result<()> {
        each!(self, list => {
            let block = ArrayViewD::from_shape(IxDyn(shape), &list[..]).map_err(|error| error.to_string())?;
            dataset.write_slice(block, part)?;
            list.to_mut().clear();
        });
        Ok(())
    }
}

pub(super) struct TableWriter {
    columns: Vec<Growing>,
    packer: Packer,
    chunk: usize,
    written: usize,
    rows: usize,
    /// Rows of the last, incomplete chunk in the file and all later rows, row by row. Chunks are written as a whole.
    buffer: Vec<f64>,
}

struct Growing {
    dataset: raw::RowRange,
    kind: StorageKind,
}

impl TableWriter {
    pub(super) fn create(file: &hdf5::File, table: &TableSchema) -> hdf5::Result<Self> {
        let group = create_group(file, table.group)?;
        let forms = ColumnForms::new(table.chunk)?;
        let mut columns: Vec<Growing> = Vec::with_capacity(table.variables.len());
        for variable in &table.variables {
            let dataset = forms.create(&group, variable)?;
            match columns.first() {
                None => raw::set_scale(&dataset, &variable.name)?,
                Some(scale) => raw::attach_scale(&dataset, &scale.dataset, 0)?,
            }
            columns.push(Growing {
                dataset: raw::RowRange::new(dataset)?,
                kind: variable.kind,
            });
        }
        Ok(TableWriter {
            buffer: Vec::with_capacity(columns.len() * table.chunk),
            columns,
            packer: Packer::new(),
            chunk: table.chunk,
            written: 0,
            rows: 0,
        })
    }

    /// Number of rows in the file, without the buffer.
    pub(super) fn written(&self) -> usize {
        self.written
    }

    pub(super) fn rows(&self) -> usize {
        self.rows
    }

    pub(super) fn width(&self) -> usize {
        self.columns.len()
    }

    /// Buffers a row that comes in consecutive parts. Returns true if the row completes a chunk. Numbers are rounded
    /// to the type of their column.
    pub(super) fn push(&mut self, row: &[&[f64]]) -> bool {
        let end = self.buffer.len() + self.columns.len();
        row.iter().for_each(|part| self.buffer.extend_from_slice(part));
        debug_assert_eq!(self.buffer.len(), end);
        self.buffer.resize(end, f64::NAN);
        self.rows += 1;
        self.rows.is_multiple_of(self.chunk)
    }

    pub(super) fn append(&mut self) -> hdf5::Result<()> {
        if self.rows == self.written {
            return Ok(());
        }
        let known = self.written % self.chunk;
        for index in 0..self.columns.len() {
            with_type!(self.columns[index].kind, Self::write_column(self, index, known))?;
        }
        self.written = self.rows;
        let full = self.rows - self.rows % self.chunk;
        let left = (self.rows - full) * self.columns.len();
        self.buffer.drain(..self.buffer.len() - left);
        Ok(())
    }

    /// Writes the chunks of a column that have new values. The first `known` buffered values are in the file already.
    fn write_column<T: StoredNumber>(&mut self, index: usize, known: usize) -> hdf5::Result<()> {
        let width = self.columns.len();
        let dataset = &self.columns[index].dataset;
        let values: Vec<T> = self
            .buffer
            .iter()
            .skip(index)
            .step_by(width)
            .map(|&value| T::of(value))
            .collect();
        dataset.resize([self.rows])?;
        for (part, values) in values.chunks(self.chunk).enumerate() {
            let start = self.written - known + part * self.chunk;
            self.packer.write(dataset, start, self.chunk, values)?;
        }
        Ok(())
    }
}

/// Creates a file in the earliest HDF5 format, which every reader knows, with variables in the order of creation.
pub(super) fn create_file(path: &Path) -> hdf5::Result<hdf5::File> {
    hdf5::File::with_options()
        // HDF5's own lock would exclude readers. `WriteLock` excludes writers.
        .with_fapl(|access| {
            access
                .file_locking(false)
                .libver_bounds(LibraryVersion::Earliest, LibraryVersion::latest())
        })
        .with_fcpl(|create| {
            create
                .link_creation_order(LinkCreationOrder::Indexed)
                .obj_track_times(false)
                // Freed space is not reused: until the next flush the metadata on disk refers to it.
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

struct ColumnForms {
    shape: Dataspace,
    link: LinkCreate,
    creation: DatasetCreate,
    access: DatasetAccess,
}

impl ColumnForms {
    fn new(chunk: usize) -> hdf5::Result<Self> {
        Ok(ColumnForms {
            shape: Dataspace::try_new(0..)?,
            link: LinkCreate::try_new()?,
            creation: packed(&mut DatasetCreate::build())
                .chunk(chunk)
                .fill_time(FillTime::Alloc)
                .finish()?,
            // Without a cache every chunk is written to new space at the end of the file. No metadata on disk refers
            // to this space, and the next flush writes metadata only.
            access: DatasetAccess::build().chunk_cache(1, 0, 0.0).finish()?,
        })
    }

    fn create(&self, group: &Group, variable: &Variable) -> hdf5::Result<Dataset> {
        let kind = with_type!(variable.kind, Datatype::from_type())?;
        let lists = [self.link.id(), self.creation.id(), self.access.id()];
        let dataset = raw::create_dataset(group, &variable.name, &kind, &self.shape, lists)?;
        describe(&dataset, variable)?;
        Ok(dataset)
    }
}

pub(super) fn compressed(group: &Group) -> DatasetBuilder {
    group.new_dataset_builder().with_dcpl(packed)
}

fn packed(list: &mut DatasetCreateBuilder) -> &mut DatasetCreateBuilder {
    list.obj_track_times(false)
        .shuffle()
        .deflate(DEFLATE_LEVEL)
        .fletcher32()
}

pub(super) fn create_empty<T: StoredNumber>(
    builder: DatasetBuilder,
    shape: impl Into<Extents>,
    name: &str,
) -> hdf5::Result<Dataset> {
    builder.empty::<T>().shape(shape).create(name)
}
