//! Files, groups and growing tables: what every writer of HDF5 files is made of.

use std::path::Path;

use hdf5::dataset::DatasetBuilder;
pub(super) use hdf5::plist::file_access::LibraryVersion;
use hdf5::plist::file_create::{FileSpaceStrategy, LinkCreationOrder};
use hdf5::{Dataset, Extents, Group, Selection};
use ndarray::{ArrayViewD, IxDyn};

use super::attributes::describe;
use super::checksums::{Known, Sums};
use super::raw;
use super::schema::{Kind, Table, Variable};
use super::values::{Number, Values, each, with_type};

/// gzip: the smallest level does nearly all that can be done to shuffled doubles, at a third of the time.
const DEFLATE_LEVEL: u8 = 1;

impl Values<'_> {
    /// Writes all values to a dataset of their size.
    pub(super) fn write(&self, dataset: &Dataset) -> hdf5::Result<()> {
        each!(self, list => dataset.write_raw(&list[..]))
    }

    /// Adds the values to `dataset`, which has `start` rows, and forgets them.
    pub(super) fn append(&mut self, dataset: &Dataset, start: usize, sums: &mut Sums) -> hdf5::Result<()> {
        let end = start + self.len();
        dataset.resize([end])?;
        self.write_block(dataset, &[end - start], (start..end).into(), sums)
    }

    /// Writes the values to a part of `dataset` that has this shape, and forgets them.
    pub(super) fn write_block(
        &mut self,
        dataset: &Dataset,
        shape: &[usize],
        part: Selection,
        sums: &mut Sums,
    ) -> hdf5::Result<()> {
        each!(self, list => {
            sums.add(dataset, list);
            let block = ArrayViewD::from_shape(IxDyn(shape), &list[..]).map_err(|error| error.to_string())?;
            dataset.write_slice(block, part)?;
            list.to_mut().clear();
        });
        Ok(())
    }
}

/// A group of columns that grow together.
pub(super) struct TableWriter {
    columns: Vec<(Dataset, Values<'static>)>,
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
        let mut columns: Vec<(Dataset, Values<'static>)> = Vec::with_capacity(table.variables.len());
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

    /// Buffers a row; true if it is the last of a chunk.
    pub(super) fn push(&mut self, row: impl IntoIterator<Item = f64>) -> bool {
        for ((_, buffer), value) in self.columns.iter_mut().zip(row) {
            buffer.push(value);
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

/// A new file with variables in their own order, not the alphabet's, in the formats that readers from a version of HDF5 on know.
pub(super) fn create_file(path: &Path, version: LibraryVersion) -> hdf5::Result<hdf5::File> {
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
    // No cache: a block goes to new space at the end of the file at once, which no metadata on
    // disk refers to yet, and the flush that follows has only metadata to write.
    let builder = compressed(group).chunk(chunk).chunk_cache(1, 0, 0.0);
    let dataset = with_type!(variable.kind, create_empty(builder, 0.., &variable.name))?;
    describe(&dataset, variable)?;
    Ok(dataset)
}

/// A dataset whose chunks are compressed, and have checksums of HDF5's.
pub(super) fn compressed(group: &Group) -> DatasetBuilder {
    let builder = group.new_dataset_builder();
    builder
        .obj_track_times(false)
        .shuffle()
        .deflate(DEFLATE_LEVEL)
        .fletcher32()
}

/// A dataset of this type of numbers, which has none yet.
pub(super) fn create_empty<T: Number>(
    builder: DatasetBuilder,
    shape: impl Into<Extents>,
    name: &str,
) -> hdf5::Result<Dataset> {
    builder.empty::<T>().shape(shape).create(name)
}
