//! Files, groups and growing tables: what every writer of HDF5 files is made of.

use std::path::Path;

use hdf5::dataset::DatasetBuilder;
use hdf5::plist::dataset_create::{DatasetCreateBuilder, FillTime};
pub(super) use hdf5::plist::file_access::LibraryVersion;
use hdf5::plist::file_create::{FileSpaceStrategy, LinkCreationOrder};
use hdf5::plist::{DatasetAccess, DatasetCreate, LinkCreate};
use hdf5::{Dataset, Dataspace, Datatype, Extents, Group, Selection};
use ndarray::{ArrayViewD, IxDyn};

use super::attributes::{AttributeValue, attributes_of, describe};
use super::checksums::{self, Known, Sums};
use super::packed::{DEFLATE_LEVEL, Packer};
use super::raw;
use super::schema::{Kind, Table, Variable};
use super::values::{Number, Values, each, with_type};

impl Values<'_> {
    /// Writes all values to a dataset of their size.
    pub(super) fn write(&self, dataset: &Dataset) -> hdf5::Result<()> {
        each!(self, list => dataset.write_raw(&list[..]))
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
    columns: Vec<Growing>,
    packer: Packer,
    chunk: usize,
    /// Rows in the file.
    written: usize,
    rows: usize,
    /// Rows of the last, incomplete chunk in the file and all later ones, row by row: a chunk is written as a whole.
    buffer: Vec<f64>,
}

/// A column that grows.
struct Growing {
    dataset: raw::Rows,
    kind: Kind,
    /// Without the leading slash.
    path: String,
    attributes: Vec<(&'static str, AttributeValue)>,
    /// Of the values in the file.
    sum: crc32fast::Hasher,
}

impl TableWriter {
    pub(super) fn create(file: &hdf5::File, table: &Table) -> hdf5::Result<Self> {
        let group = create_group(file, table.group)?;
        let forms = Forms::new(table.chunk)?;
        let mut columns: Vec<Growing> = Vec::with_capacity(table.variables.len());
        for variable in &table.variables {
            let dataset = forms.create(&group, variable)?;
            match columns.first() {
                None => raw::set_scale(&dataset, &variable.name)?,
                Some(scale) => raw::attach_scale(&dataset, &scale.dataset, 0)?,
            }
            columns.push(Growing {
                dataset: raw::Rows::new(dataset)?,
                kind: variable.kind,
                path: format!("{}/{}", table.group.trim_matches('/'), variable.name),
                attributes: attributes_of(variable),
                sum: crc32fast::Hasher::new(),
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

    /// Rows in the file, without those that are buffered.
    pub(super) fn written(&self) -> usize {
        self.written
    }

    /// What need not be read of the columns that are in the file.
    pub(super) fn tell(&self, known: &mut Known) {
        for column in &self.columns {
            known
                .values
                .insert(column.path.clone(), Some(column.sum.clone().finalize()));
            known.attributes.insert(column.path.clone(), column.attributes.clone());
        }
    }

    /// Rows, with those that are buffered.
    pub(super) fn rows(&self) -> usize {
        self.rows
    }

    /// Buffers a row, whose parts are one after the other; true if it is the last of a chunk. A number that the type of its
    /// column does not have becomes the nearest that it has.
    pub(super) fn push(&mut self, row: &[&[f64]]) -> bool {
        let end = self.buffer.len() + self.columns.len();
        row.iter().for_each(|part| self.buffer.extend_from_slice(part));
        debug_assert_eq!(self.buffer.len(), end);
        self.buffer.resize(end, f64::NAN);
        self.rows += 1;
        self.rows.is_multiple_of(self.chunk)
    }

    /// Writes what is buffered.
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

    /// Writes the chunks of a column that have new values; the first `known` that are buffered are in the file.
    fn write_column<T: Number>(&mut self, index: usize, known: usize) -> hdf5::Result<()> {
        let width = self.columns.len();
        let Growing { dataset, sum, .. } = &mut self.columns[index];
        let values: Vec<T> = self
            .buffer
            .iter()
            .skip(index)
            .step_by(width)
            .map(|&value| T::of(value))
            .collect();
        checksums::add(sum, &values[known..]);
        dataset.resize([self.rows])?;
        for (part, values) in values.chunks(self.chunk).enumerate() {
            let start = self.written - known + part * self.chunk;
            self.packer.write(dataset, start, self.chunk, values)?;
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

/// What the columns of a table are created with. Each list is made once.
struct Forms {
    shape: Dataspace,
    link: LinkCreate,
    creation: DatasetCreate,
    access: DatasetAccess,
}

impl Forms {
    fn new(chunk: usize) -> hdf5::Result<Self> {
        Ok(Forms {
            shape: Dataspace::try_new(0..)?,
            link: LinkCreate::try_new()?,
            creation: packed(&mut DatasetCreate::build())
                .chunk(chunk)
                .fill_time(FillTime::Alloc)
                .finish()?,
            // No cache: a chunk goes to new space at the end of the file at once, which no metadata on disk refers to yet,
            // and the flush that follows has only metadata to write.
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

/// A dataset whose chunks are compressed, and have checksums of HDF5's.
pub(super) fn compressed(group: &Group) -> DatasetBuilder {
    group.new_dataset_builder().with_dcpl(packed)
}

/// The same in a list of properties.
fn packed(list: &mut DatasetCreateBuilder) -> &mut DatasetCreateBuilder {
    list.obj_track_times(false)
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
