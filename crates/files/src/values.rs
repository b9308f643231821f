//! Values of a column, of one of four types, in memory and in a file.

use std::borrow::Cow;

use hdf5::H5Type;
use hdf5::types::OwnedDynValue;

use super::ResultError;
use super::schema::{StorageKind, Variable};
use super::source::TableReader;

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

    /// Gives the rows of a table their numbers. Fails if the column is missing.
    pub fn read(&self, table: &TableReader<'_>, rows: &mut [R]) -> Result<(), ResultError> {
        let values = table.column(&(self.variable)().name)?;
        let pairs = rows.iter_mut().zip(values);
        pairs.for_each(|(row, value)| (self.set)(row, value));
        Ok(())
    }
}

/// Declares columns: a [`Variable`](crate::schema::Variable), the number of a row, and the assignment of a number to
/// the row. The list begins with the names of row and number.
#[macro_export]
macro_rules! columns {
    ($row:ident, $number:ident: $($variable:expr, $get:expr, $set:expr;)*) => {
        [$($crate::DeclaredColumn {
            variable: || $variable,
            get: |$row| $get,
            set: |$row, $number| $set,
        }),*]
    };
}
