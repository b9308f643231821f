//! Attributes of HDF5 files: their values, written and read.

use hdf5::types::VarLenUnicode;
use hdf5::{Dataset, File, Group, H5Type, Location};
use serde::Serialize;

use super::{raw, schema};

/// The value of an attribute of /meta or /events.
#[derive(Debug, Clone, PartialEq)]
pub enum MetaValue {
    /// UTF-8.
    Text(String),
    /// A double.
    Number(f64),
}

/// The value of an attribute.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum AttributeValue {
    /// UTF-8.
    Text(String),
    /// Of any width.
    Integer(i64),
    /// A double.
    Number(f64),
    /// An array.
    Integers(Vec<i64>),
    /// An array.
    Numbers(Vec<f64>),
}

/// As a text; a number with an exponent where that is shorter: 1e-10, not 0.0000000001.
impl std::fmt::Display for AttributeValue {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            AttributeValue::Text(text) => f.write_str(text),
            AttributeValue::Integer(number) => write!(f, "{number}"),
            AttributeValue::Number(number) => write!(f, "{number:?}"),
            AttributeValue::Integers(list) => write!(f, "{list:?}"),
            AttributeValue::Numbers(list) => write!(f, "{list:?}"),
        }
    }
}

impl AttributeValue {
    /// The number, or the first of several.
    pub(super) fn number(&self) -> Option<f64> {
        match self {
            AttributeValue::Number(number) => Some(*number),
            AttributeValue::Numbers(list) => list.first().copied(),
            other => other.integer().map(|number| number as f64),
        }
    }

    /// The whole number, or the first of several.
    pub(super) fn integer(&self) -> Option<i64> {
        match self {
            AttributeValue::Integer(number) => Some(*number),
            AttributeValue::Integers(list) => list.first().copied(),
            _ => None,
        }
    }
}

/// Writes the root attributes of a file, and the version of its format.
pub(super) fn write_root(file: &File, texts: &[(&str, &str)]) -> hdf5::Result<()> {
    for (name, text) in texts {
        write_text_attribute(file, name, text)?;
    }
    let version = file.new_attr::<i32>().create(schema::root::FORMAT_VERSION)?;
    version.write_scalar(&schema::FORMAT_VERSION)
}

/// Writes the unit and the description of a variable.
pub(super) fn describe(dataset: &Dataset, units: &str, long_name: &str) -> hdf5::Result<()> {
    write_text_attribute(dataset, schema::attribute::UNITS, units)?;
    write_text_attribute(dataset, schema::attribute::LONG_NAME, long_name)
}

/// Writes what the codes of a variable mean.
pub(super) fn write_codes<'a, T: H5Type>(
    dataset: &Dataset,
    codes: impl IntoIterator<Item = (T, &'a str)>,
) -> hdf5::Result<()> {
    let (values, meanings): (Vec<T>, Vec<&str>) = codes.into_iter().unzip();
    let attribute = dataset.new_attr_builder().with_data(&values[..]);
    attribute.create(schema::attribute::FLAG_VALUES)?;
    write_text_attribute(dataset, schema::attribute::FLAG_MEANINGS, &meanings.join(" "))
}

pub(super) fn write_companions(location: &Location, name: &str, units: &str, long_name: &str) -> hdf5::Result<()> {
    write_text_attribute(location, &format!("{name}{}", schema::attribute::UNITS_SUFFIX), units)?;
    write_text_attribute(
        location,
        &format!("{name}{}", schema::attribute::LONG_NAME_SUFFIX),
        long_name,
    )
}

pub(super) fn write_attributes(group: &Group, attributes: &[(String, MetaValue)]) -> hdf5::Result<()> {
    attributes.iter().try_for_each(|(name, value)| match value {
        MetaValue::Text(text) => write_text_attribute(group, name, text),
        MetaValue::Number(number) => write_number_attribute(group, name, *number),
    })
}

pub(super) fn write_number_attribute(location: &Location, name: &str, value: f64) -> hdf5::Result<()> {
    location.new_attr::<f64>().create(name)?.write_scalar(&value)
}

pub(super) fn write_text_attribute(location: &Location, name: &str, text: &str) -> hdf5::Result<()> {
    location
        .new_attr::<VarLenUnicode>()
        .create(name)?
        .write_scalar(&text_value(text)?)
}

pub(super) fn text_value(text: &str) -> hdf5::Result<VarLenUnicode> {
    // A C string ends at its first NUL.
    text.replace('\0', " ")
        .parse()
        .map_err(|error| format!("not a text for HDF5: {error:?}").into())
}

/// A text of /input.
pub(super) fn write_input(group: &Group, name: &str, text: &str, long_name: &str) -> hdf5::Result<()> {
    describe(&raw::write_text(group, name, text)?, "1", long_name)
}
