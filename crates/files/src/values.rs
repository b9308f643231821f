//! Values of a column, of one of four types, in memory and in a file.

use std::borrow::Cow;

use hdf5::H5Type;
use hdf5::types::OwnedDynValue;

use super::schema::{StorageKind, Variable};

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
            StorageKind::Int8 => $($function)::+::<i8>($($argument),*),
            StorageKind::Int32 => $($function)::+::<i32>($($argument),*),
            StorageKind::Int64 => $($function)::+::<i64>($($argument),*),
            StorageKind::Float64 => $($function)::+::<f64>($($argument),*),
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
    pub(super) fn new(kind: StorageKind, capacity: usize) -> Self {
        match kind {
            StorageKind::Int8 => ColumnValues::Int8(Vec::with_capacity(capacity).into()),
            StorageKind::Int32 => ColumnValues::Int32(Vec::with_capacity(capacity).into()),
            StorageKind::Int64 => ColumnValues::Int64(Vec::with_capacity(capacity).into()),
            StorageKind::Float64 => ColumnValues::Float64(Vec::with_capacity(capacity).into()),
        }
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
        let mut variable = Variable::code(name, long_name, &[]);
        variable.flags = words;
        FileColumn {
            variable,
            values: ColumnValues::Int8(values.into_iter().collect()),
        }
    }
}

/// Columns of a table, each with a value for each of its rows.
#[derive(Debug)]
pub struct FileRows<'a, R> {
    pub(super) rows: &'a [R],
    pub(super) columns: Vec<FileColumn>,
}

impl<'a, R> FileRows<'a, R> {
    /// A table of these rows, without columns yet.
    pub fn of(rows: &'a [R]) -> Self {
        let columns = Vec::new();
        FileRows { rows, columns }
    }

    /// Adds a column.
    pub fn column(mut self, column: FileColumn) -> Self {
        self.columns.push(column);
        self
    }

    /// Adds a column of doubles. A missing value is NaN.
    pub fn numbers(self, name: &str, units: &str, long_name: &str, of: impl Fn(&'a R) -> f64) -> Self {
        let values = self.rows.iter().map(of);
        self.column(FileColumn::numbers(name, units, long_name, values))
    }

    /// Adds a column of integers.
    pub fn counts(self, name: &str, long_name: &str, of: impl Fn(&'a R) -> i64) -> Self {
        let values = self.rows.iter().map(of);
        self.column(FileColumn::counts(name, long_name, values))
    }

    /// Adds a column of codes with their words.
    pub fn codes(self, name: &str, long_name: &str, words: &[(i64, String)], of: impl Fn(&'a R) -> i8) -> Self {
        let values = self.rows.iter().map(of);
        self.column(FileColumn::codes(name, long_name, values, words.to_vec()))
    }

    /// The columns in their order.
    pub fn columns(self) -> Vec<FileColumn> {
        self.columns
    }
}
