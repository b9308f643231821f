//! What a file holds, for a listing.

use hdf5::types::{FloatSize, IntSize, TypeDescriptor};
use serde::Serialize;

use super::attributes::AttributeValue;

/// What a result file holds, for a listing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Contents {
    /// Attributes of the root and of the groups.
    pub attributes: Vec<AttributeInfo>,
    pub variables: Vec<VariableInfo>,
}

/// An attribute of a group.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AttributeInfo {
    /// "/", "/meta", ...
    pub group: String,
    pub name: String,
    pub value: AttributeValue,
}

/// A variable of a group.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VariableInfo {
    /// "/trajectory", ...
    pub group: String,
    pub name: String,
    /// "float64", "int8", "string", ...
    #[serde(rename = "type")]
    pub kind: String,
    /// Empty for a scalar.
    pub shape: Vec<usize>,
    pub units: Option<String>,
    pub long_name: Option<String>,
    /// What its codes mean; empty where it is no code.
    pub flags: Vec<FlagInfo>,
    /// Least value that is not NaN; `None` where there is none.
    pub min: Option<f64>,
    pub max: Option<f64>,
}

/// A group of which this version of the program knows the name only.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AddedGroup {
    /// In alphabetical order.
    pub attributes: Vec<(String, AttributeValue)>,
    /// In the order of the file.
    pub columns: Vec<AddedColumn>,
}

/// A variable of such a group.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AddedColumn {
    /// As in the file.
    pub name: String,
    /// UDUNITS.
    pub units: Option<String>,
    /// What it is.
    pub long_name: Option<String>,
    /// Rows in the file, of which `values` are the first.
    pub rows: usize,
    pub values: Vec<f64>,
}

/// The meaning of a code.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FlagInfo {
    pub value: i64,
    pub meaning: String,
}

pub(super) fn is_number(descriptor: &TypeDescriptor) -> bool {
    matches!(
        descriptor,
        TypeDescriptor::Integer(_) | TypeDescriptor::Unsigned(_) | TypeDescriptor::Float(_)
    )
}

/// The name that NumPy has for a type.
pub(super) fn type_name(descriptor: &TypeDescriptor) -> String {
    let bits = |size: &IntSize| 8 * *size as usize;
    match descriptor {
        TypeDescriptor::Integer(size) => format!("int{}", bits(size)),
        TypeDescriptor::Unsigned(size) => format!("uint{}", bits(size)),
        TypeDescriptor::Float(FloatSize::U4) => "float32".to_owned(),
        TypeDescriptor::Float(_) => "float64".to_owned(),
        TypeDescriptor::FixedAscii(_)
        | TypeDescriptor::FixedUnicode(_)
        | TypeDescriptor::VarLenAscii
        | TypeDescriptor::VarLenUnicode => "string".to_owned(),
        other => format!("{other:?}").to_lowercase(),
    }
}
