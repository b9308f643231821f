//! Columns of one of four types, in memory and in a file; files, groups and growing tables.

use std::borrow::Cow;
use std::path::Path;

use hdf5::dataset::DatasetBuilder;
use hdf5::plist::dataset_create::{DatasetCreateBuilder, FillTime};
use hdf5::plist::file_access::LibraryVersion;
use hdf5::plist::file_create::{FileSpaceStrategy, LinkCreationOrder};
use hdf5::plist::{DatasetAccess, DatasetCreate, LinkCreate};
use hdf5::types::OwnedDynValue;
use hdf5::{Dataset, Dataspace, Datatype, Extents, Group, H5Type, Selection};
use ndarray::{ArrayViewD, IxDyn};

use super::attributes::describe;
use super::packed::{DEFLATE_LEVEL, Packer};
use super::schema::{StorageKind, TableSchema, Variable};
use super::source::TableReader;
use super::{ResultError, raw};

pub(super) trait StoredNumber: H5Type + Copy + Into<OwnedDynValue> {
    fn of(value: f64) -> Self;
    /// Bytes as in the file, the first byte lowest.
    fn bytes(self) -> u64;
}

macro_rules! numbers {
    ($($type:ty, $bits:ty;)*) => {
        $(impl StoredNumber for $type {
            fn of(value: f64) -> Self {
                value as $type
            }
            fn bytes(self) -> u64 {
                <$bits>::from_le_bytes(self.to_ne_bytes()).into()
            }
        })*
    };
}

numbers! {
    i8, u8;
    i32, u32;
    i64, u64;
    f64, u64;
}

macro_rules! with_type {
    ($kind:expr, $($function:ident)::+ ($($argument:expr),*)) => {
        match $kind {
            $crate::schema::StorageKind::Int8 => $($function)::+::<i8>($($argument),*),
            $crate::schema::StorageKind::Int32 => $($function)::+::<i32>($($argument),*),
            $crate::schema::StorageKind::Int64 => $($function)::+::<i64>($($argument),*),
            $crate::schema::StorageKind::Float64 => $($function)::+::<f64>($($argument),*),
        }
    };
}
pub(super) use with_type;

/// Values of a column, owned or borrowed.
#[derive(Debug, Clone, PartialEq)]
pub enum ColumnValues<'a> {
    /// Codes.
    Int8(Cow<'a, [i8]>),
    /// Indices.
    Int32(Cow<'a, [i32]>),
    /// Counts.
    Int64(Cow<'a, [i64]>),
    /// Quantities.
    Float64(Cow<'a, [f64]>),
}

macro_rules! each {
    ($values:expr, $list:ident => $then:expr) => {
        match $values {
            ColumnValues::Int8($list) => $then,
            ColumnValues::Int32($list) => $then,
            ColumnValues::Int64($list) => $then,
            ColumnValues::Float64($list) => $then,
        }
    };
}

pub(super) use each;

impl ColumnValues<'_> {
    pub(super) fn of(kind: StorageKind, values: impl IntoIterator<Item = f64>) -> Self {
        let mut list = match kind {
            StorageKind::Int8 => ColumnValues::Int8(Cow::default()),
            StorageKind::Int32 => ColumnValues::Int32(Cow::default()),
            StorageKind::Int64 => ColumnValues::Int64(Cow::default()),
            StorageKind::Float64 => ColumnValues::Float64(Cow::default()),
        };
        values.into_iter().for_each(|value| list.push(value));
        list
    }

    /// Number of values.
    pub fn len(&self) -> usize {
        each!(self, list => list.len())
    }

    /// Whether there are no values.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Borrows the values.
    pub fn view(&self) -> ColumnValues<'_> {
        match self {
            ColumnValues::Int8(list) => ColumnValues::Int8(Cow::Borrowed(list)),
            ColumnValues::Int32(list) => ColumnValues::Int32(Cow::Borrowed(list)),
            ColumnValues::Int64(list) => ColumnValues::Int64(Cow::Borrowed(list)),
            ColumnValues::Float64(list) => ColumnValues::Float64(Cow::Borrowed(list)),
        }
    }

    /// Value of a row as a double, exact because counts are at most 2^53.
    pub(super) fn at(&self, row: usize) -> f64 {
        match self {
            ColumnValues::Int8(list) => f64::from(list[row]),
            ColumnValues::Int32(list) => f64::from(list[row]),
            ColumnValues::Int64(list) => list[row] as f64,
            ColumnValues::Float64(list) => list[row],
        }
    }

    pub(super) fn push(&mut self, value: f64) {
        each!(self, list => list.to_mut().push(StoredNumber::of(value)));
    }

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

/// A column with its values.
#[derive(Debug, Clone, PartialEq)]
pub struct FileColumn {
    /// Name, unit and description.
    pub variable: Variable,
    /// Values.
    pub values: ColumnValues<'static>,
}

impl FileColumn {
    /// A column of these numbers, which are stored as the variable's type.
    pub fn new(variable: Variable, numbers: impl IntoIterator<Item = f64>) -> Self {
        let values = ColumnValues::of(variable.kind, numbers);
        FileColumn { variable, values }
    }

    /// A column of doubles. A missing value is NaN.
    pub fn numbers(name: &str, units: &str, long_name: &str, values: impl IntoIterator<Item = f64>) -> Self {
        FileColumn {
            variable: Variable::quantity(name, units, long_name),
            values: ColumnValues::Float64(values.into_iter().collect()),
        }
    }

    /// A column of integers.
    pub fn counts(name: &str, long_name: &str, values: impl IntoIterator<Item = i64>) -> Self {
        FileColumn {
            variable: Variable::count(name, long_name),
            values: ColumnValues::Int64(values.into_iter().collect()),
        }
    }

    /// A column of codes. `words` lists the meanings.
    pub fn codes(name: &str, long_name: &str, values: impl IntoIterator<Item = i8>, words: Vec<(i64, String)>) -> Self {
        FileColumn {
            variable: Variable::words(name, long_name, words),
            values: ColumnValues::Int8(values.into_iter().collect()),
        }
    }
}

/// Column of a table with rows `R`, declared once to be written and read.
#[derive(Debug)]
pub struct DeclaredColumn<R> {
    /// Name, unit and description.
    pub variable: fn() -> Variable,
    /// Number of a row.
    pub get: fn(&R) -> f64,
    /// Gives a row its number.
    pub set: fn(&mut R, f64),
}

impl<R> DeclaredColumn<R> {
    /// The column of these rows.
    pub fn of<'a>(&self, rows: impl IntoIterator<Item = &'a R>) -> FileColumn
    where
        R: 'a,
    {
        FileColumn::new((self.variable)(), rows.into_iter().map(self.get))
    }

    /// The variable with the number of a row.
    pub fn quantity(&self, row: &R) -> (Variable, f64) {
        ((self.variable)(), (self.get)(row))
    }

    /// Gives the rows of a table their numbers. Fails if the column is missing.
    pub fn read(&self, table: &TableReader<'_>, rows: &mut [R]) -> Result<(), ResultError> {
        let values = table.column(&(self.variable)().name)?;
        let pairs = rows.iter_mut().zip(values);
        pairs.for_each(|(row, value)| (self.set)(row, value));
        Ok(())
    }
}

/// Declares columns: a [`Variable`](crate::schema::Variable), the number of a row, and the assignment of a number to
/// the row. The list begins with the names of row and number. Columns that are only written have no assignment.
#[macro_export]
macro_rules! columns {
    ($row:ident: $($variable:expr, $get:expr;)*) => {
        [$($crate::DeclaredColumn {
            variable: || $variable,
            get: |$row| $get,
            set: |_, _| {},
        }),*]
    };
    ($row:ident, $number:ident: $($variable:expr, $get:expr, $set:expr;)*) => {
        [$($crate::DeclaredColumn {
            variable: || $variable,
            get: |$row| $get,
            set: |$row, $number| $set,
        }),*]
    };
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
        let values = self.buffer.iter().skip(index).step_by(width);
        let values: Vec<T> = values.map(|&value| T::of(value)).collect();
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
