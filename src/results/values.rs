//! The values of a column in the four types that columns have, in memory and in a file.

use std::borrow::Cow;

use hdf5::H5Type;
use hdf5::types::OwnedDynValue;
use serde::{Deserialize, Serialize};

use super::schema::{Kind, Variable};

/// A type of the values of columns.
pub(super) trait Number: H5Type + Copy + Into<OwnedDynValue> {
    const KIND: Kind;
    /// What is read of a virtual dataset where the file of a shard is not found: NaN, -1, or of codes the status "missing". No kind
    /// of event has a negative code, so that for them there is no better one.
    const ABSENT: Self;
    /// The number in eight bytes, as it is summed.
    fn wide(self) -> [u8; 8];
    fn of(value: f64) -> Self;
    /// Numbers as they come from a reading process.
    fn from_bytes(bytes: &[u8]) -> Vec<Self>;
    fn to_bytes(values: impl Iterator<Item = Self>) -> Vec<u8>;
    /// The bytes as the file has them, the first one lowest.
    fn bytes(self) -> u64;
}

macro_rules! numbers {
    ($($type:ty, $kind:ident, $wide:ty, $bits:ty, $absent:expr;)*) => {
        $(impl Number for $type {
            const KIND: Kind = Kind::$kind;
            const ABSENT: Self = $absent;
            fn wide(self) -> [u8; 8] {
                <$wide>::from(self).to_le_bytes()
            }
            fn of(value: f64) -> Self {
                value as $type
            }
            fn from_bytes(bytes: &[u8]) -> Vec<Self> {
                let (values, _) = bytes.as_chunks::<{ size_of::<$type>() }>();
                values.iter().map(|bytes| <$type>::from_le_bytes(*bytes)).collect()
            }
            fn to_bytes(values: impl Iterator<Item = Self>) -> Vec<u8> {
                values.flat_map(<$type>::to_le_bytes).collect()
            }
            fn bytes(self) -> u64 {
                <$bits>::from_le_bytes(self.to_ne_bytes()).into()
            }
        })*
    };
}

numbers! {
    i8, Int8, i64, u8, 2;
    i32, Int32, i64, u32, -1;
    i64, Int64, i64, u64, -1;
    f64, Float64, f64, u64, f64::NAN;
}

/// Calls a generic function with the type of a kind.
macro_rules! with_type {
    ($kind:expr, $($function:ident)::+ ($($argument:expr),*)) => {
        match $kind {
            Kind::Int8 => $($function)::+::<i8>($($argument),*),
            Kind::Int32 => $($function)::+::<i32>($($argument),*),
            Kind::Int64 => $($function)::+::<i64>($($argument),*),
            Kind::Float64 => $($function)::+::<f64>($($argument),*),
        }
    };
}
pub(super) use with_type;

/// The values of a column, its own or those of another place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Values<'a> {
    /// Codes.
    Int8(Cow<'a, [i8]>),
    /// Indices.
    Int32(Cow<'a, [i32]>),
    /// Counts.
    Int64(Cow<'a, [i64]>),
    /// Quantities.
    Float64(Cow<'a, [f64]>),
}

/// The same expression of the values of any type.
macro_rules! each {
    ($values:expr, $list:ident => $then:expr) => {
        match $values {
            Values::Int8($list) => $then,
            Values::Int32($list) => $then,
            Values::Int64($list) => $then,
            Values::Float64($list) => $then,
        }
    };
}

pub(super) use each;

impl Values<'_> {
    pub(super) fn new(kind: Kind, capacity: usize) -> Self {
        match kind {
            Kind::Int8 => Values::Int8(Vec::with_capacity(capacity).into()),
            Kind::Int32 => Values::Int32(Vec::with_capacity(capacity).into()),
            Kind::Int64 => Values::Int64(Vec::with_capacity(capacity).into()),
            Kind::Float64 => Values::Float64(Vec::with_capacity(capacity).into()),
        }
    }

    /// Number of values.
    pub fn len(&self) -> usize {
        each!(self, list => list.len())
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The same values, borrowed.
    pub fn view(&self) -> Values<'_> {
        match self {
            Values::Int8(list) => Values::Int8(Cow::Borrowed(list)),
            Values::Int32(list) => Values::Int32(Cow::Borrowed(list)),
            Values::Int64(list) => Values::Int64(Cow::Borrowed(list)),
            Values::Float64(list) => Values::Float64(Cow::Borrowed(list)),
        }
    }

    /// The value of a row; of counts one of at most 2^53, as all are.
    pub(super) fn at(&self, row: usize) -> f64 {
        match self {
            Values::Int8(list) => f64::from(list[row]),
            Values::Int32(list) => f64::from(list[row]),
            Values::Int64(list) => list[row] as f64,
            Values::Float64(list) => list[row],
        }
    }

    /// Adds a value. A number that the type does not have becomes the nearest that it has.
    pub(super) fn push(&mut self, value: f64) {
        each!(self, list => list.to_mut().push(Number::of(value)));
    }
}

/// A column with its values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Column {
    /// Name, unit and description.
    pub variable: Variable,
    /// Its values.
    pub values: Values<'static>,
}

impl Column {
    /// Doubles; NaN where there is none.
    pub fn numbers(name: &str, units: &str, long_name: &str, values: impl IntoIterator<Item = f64>) -> Self {
        Column {
            variable: Variable::quantity(name, units, long_name),
            values: Values::Float64(values.into_iter().collect()),
        }
    }

    /// Whole numbers.
    pub fn counts(name: &str, long_name: &str, values: impl IntoIterator<Item = i64>) -> Self {
        Column {
            variable: Variable::count(name, long_name),
            values: Values::Int64(values.into_iter().collect()),
        }
    }

    /// Codes, and what they mean.
    pub fn codes(name: &str, long_name: &str, values: impl IntoIterator<Item = i8>, words: Vec<(i64, String)>) -> Self {
        let mut variable = Variable::code(name, long_name, &[]);
        variable.flags = words;
        Column {
            variable,
            values: Values::Int8(values.into_iter().collect()),
        }
    }
}
