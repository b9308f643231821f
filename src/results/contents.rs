//! What a file holds, for a listing.

use std::path::Path;

use hdf5::types::{FloatSize, IntSize, TypeDescriptor};
use hdf5::{Dataset, Group, Hyperslab, IndexType, IterationOrder, Selection, SliceOrIndex};
use ndarray::IxDyn;
use serde::Serialize;

use super::attributes::{self, AttributeValue, text_attribute};
use super::schema::{self, attribute};
use super::{ResultError, ResultFile, target};

/// What a file of this program holds, for a listing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Contents {
    /// Attributes of the root and of the groups.
    pub attributes: Vec<AttributeInfo>,
    pub variables: Vec<VariableInfo>,
}

/// About so many values are read at a time.
const BLOCK: usize = 65_536;

impl Contents {
    /// What a file of this program holds: the result of a run, a sweep, or a work-precision study.
    ///
    /// # Errors
    /// A file that is not there, of another program, of a newer version of this one, or damaged.
    pub fn read(path: &Path) -> Result<Contents, ResultError> {
        match ResultFile::open(path) {
            Ok(file) => file.contents(),
            Err(ResultError::AnotherKind { .. }) => {
                let file = target::open_to_read(path)?;
                let version = file.attr(schema::root::FORMAT_VERSION);
                let known = i64::from(schema::FORMAT_VERSION);
                match version.and_then(|attribute| attribute.read_scalar::<i64>()) {
                    Ok(found) if found > known => Err(ResultError::Newer {
                        path: path.to_owned(),
                        found,
                        known,
                    }),
                    _ => of_file(path, &file),
                }
            }
            Err(error) => Err(error),
        }
    }
}

/// Everything in a file, group by group.
pub(super) fn of_file(path: &Path, file: &hdf5::File) -> Result<Contents, ResultError> {
    let mut contents = Contents {
        attributes: Vec::new(),
        variables: Vec::new(),
    };
    list("/", file, &mut contents).map_err(|error| ResultError::read(path, &error))?;
    Ok(contents)
}

fn list(path: &str, group: &Group, contents: &mut Contents) -> hdf5::Result<()> {
    for (name, value) in attributes::all(group)? {
        contents.attributes.push(AttributeInfo {
            group: path.to_owned(),
            name,
            value,
        });
    }
    // In the order of creation where the file knows it.
    let names = group
        .member_names_by(IndexType::CreationOrder, IterationOrder::Increasing)
        .or_else(|_| group.member_names())?;
    for name in names {
        if let Ok(dataset) = group.dataset(&name) {
            contents.variables.push(describe(path, name, &dataset)?);
        } else if let Ok(child) = group.group(&name) {
            list(&format!("{}/{name}", path.trim_end_matches('/')), &child, contents)?;
        }
    }
    Ok(())
}

fn describe(group: &str, name: String, dataset: &Dataset) -> hdf5::Result<VariableInfo> {
    let descriptor = dataset.dtype()?.to_descriptor()?;
    let shape = dataset.shape();
    let bounds = if is_number(&descriptor) && !shape.is_empty() {
        bounds(dataset, &shape)?
    } else {
        None
    };
    let codes = dataset
        .attr(attribute::FLAG_VALUES)
        .and_then(|values| values.read_raw::<i64>())
        .unwrap_or_default();
    let meanings = text_attribute(dataset, attribute::FLAG_MEANINGS).unwrap_or_default();
    let flags = codes.into_iter().zip(meanings.split_whitespace());
    Ok(VariableInfo {
        group: group.to_owned(),
        name,
        kind: type_name(&descriptor),
        shape,
        units: text_attribute(dataset, attribute::UNITS),
        long_name: text_attribute(dataset, attribute::LONG_NAME),
        flags: flags
            .map(|(value, meaning)| FlagInfo {
                value,
                meaning: meaning.to_owned(),
            })
            .collect(),
        min: bounds.map(|bounds| bounds.0),
        max: bounds.map(|bounds| bounds.1),
    })
}

/// Least and largest value, a block of rows after the other.
fn bounds(dataset: &Dataset, shape: &[usize]) -> hdf5::Result<Option<(f64, f64)>> {
    let fill = dataset
        .attr(attribute::FILL_VALUE)
        .and_then(|fill| fill.read_raw::<f64>())
        .ok()
        .and_then(|fill| fill.first().copied());
    let row: usize = shape[1..].iter().product();
    let rows = (BLOCK / row.max(1)).max(1);
    let mut bounds: Option<(f64, f64)> = None;
    for start in (0..shape[0]).step_by(rows) {
        let mut slices = vec![SliceOrIndex::from(start..shape[0].min(start + rows))];
        slices.extend(shape[1..].iter().map(|&length| SliceOrIndex::from(0..length)));
        let block = Selection::Hyperslab(Hyperslab::from(slices));
        let values = dataset.read_slice::<f64, _, IxDyn>(block)?;
        for &value in values.iter().filter(|value| !value.is_nan() && Some(**value) != fill) {
            bounds = Some(bounds.map_or((value, value), |(least, most)| (least.min(value), most.max(value))));
        }
    }
    Ok(bounds)
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
    /// Least value that is neither NaN nor the fill value; `None` where there is none.
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
