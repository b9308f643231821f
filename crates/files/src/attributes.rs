//! Attributes of HDF5 files.

use hdf5::types::VarLenUnicode;
use hdf5::{Dataset, File, Group, H5Type, Location};
use serde::Serialize;

use super::raw;
use super::schema::{self, Variable};
use super::table::{ColumnValues, each};

/// Value of an HDF5 attribute.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum AttributeValue {
    /// UTF-8 text.
    Text(String),
    /// Integer of any width.
    Integer(i64),
    /// Double.
    Number(f64),
    /// Array of integers.
    Integers(Vec<i64>),
    /// Array of doubles.
    Numbers(Vec<f64>),
}

macro_rules! values_of {
    ($($type:ty => $variant:ident),*) => {
        $(impl From<$type> for AttributeValue {
            fn from(value: $type) -> Self {
                AttributeValue::$variant(value.into())
            }
        })*
    };
}

values_of!(&str => Text, &String => Text, String => Text, i64 => Integer, f64 => Number, Vec<i64> => Integers);

/// Writes a number with an exponent if that is shorter: 1e-10.
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
    pub fn number(&self) -> Option<f64> {
        match self {
            AttributeValue::Number(number) => Some(*number),
            AttributeValue::Numbers(list) => list.first().copied(),
            other => other.integer().map(|number| number as f64),
        }
    }

    pub(super) fn integer(&self) -> Option<i64> {
        match self {
            AttributeValue::Integer(number) => Some(*number),
            AttributeValue::Integers(list) => list.first().copied(),
            _ => None,
        }
    }
}

pub(super) fn write_root(file: &File, texts: &[(&str, &str)]) -> hdf5::Result<()> {
    for &(name, text) in texts {
        write_attribute(file, name, text)?;
    }
    let version = file.new_attr::<i32>().create(schema::root::FORMAT_VERSION)?;
    version.write_scalar(&schema::FORMAT_VERSION)
}

pub(super) fn attributes_of(variable: &Variable) -> Vec<(&'static str, AttributeValue)> {
    // A NUL becomes a blank, as in reading.
    let text = |text: &str| text.replace('\0', " ").into();
    let mut attributes = vec![
        (schema::attribute::UNITS, text(&variable.units)),
        (schema::attribute::LONG_NAME, text(&variable.long_name)),
    ];
    if let Some(fill) = variable.fill {
        attributes.push((schema::attribute::FILL_VALUE, vec![fill].into()));
    }
    if !variable.flags.is_empty() {
        let codes: Vec<i64> = variable.flags.iter().map(|(code, _)| *code).collect();
        let words: Vec<&str> = variable.flags.iter().map(|(_, word)| word.as_str()).collect();
        attributes.push((schema::attribute::FLAG_VALUES, codes.into()));
        attributes.push((schema::attribute::FLAG_MEANINGS, text(&words.join(" "))));
    }
    attributes
}

pub(super) fn describe(dataset: &Dataset, variable: &Variable) -> hdf5::Result<()> {
    attributes_of(variable)
        .into_iter()
        .try_for_each(|(name, value)| match value {
            // Codes have the type of their variable.
            AttributeValue::Integers(codes) if name == schema::attribute::FLAG_VALUES => {
                let values = ColumnValues::of(variable.kind, codes.iter().map(|&code| code as f64));
                each!(&values, list => write_array(dataset, name, list))
            }
            value => write_attribute(dataset, name, value),
        })
}

pub(super) fn describe_text(dataset: &Dataset, units: &str, long_name: &str) -> hdf5::Result<()> {
    write_attribute(dataset, schema::attribute::UNITS, units)?;
    write_attribute(dataset, schema::attribute::LONG_NAME, long_name)
}

/// A quantity as attributes: its value, unit and description.
pub fn quantity(
    name: &str,
    value: impl Into<AttributeValue>,
    units: &str,
    long_name: &str,
) -> [(String, AttributeValue); 3] {
    [
        (name.to_owned(), value.into()),
        (format!("{name}{}", schema::attribute::UNITS_SUFFIX), units.into()),
        (
            format!("{name}{}", schema::attribute::LONG_NAME_SUFFIX),
            long_name.into(),
        ),
    ]
}

pub(super) fn write_attributes(group: &Group, attributes: &[(String, AttributeValue)]) -> hdf5::Result<()> {
    attributes
        .iter()
        .try_for_each(|(name, value)| write_attribute(group, name, value.clone()))
}

pub(super) fn write_attribute(location: &Location, name: &str, value: impl Into<AttributeValue>) -> hdf5::Result<()> {
    match value.into() {
        AttributeValue::Text(text) => raw::write_text_attribute(location, name, &text),
        AttributeValue::Integer(number) => location.new_attr::<i64>().create(name)?.write_scalar(&number),
        AttributeValue::Number(number) => location.new_attr::<f64>().create(name)?.write_scalar(&number),
        AttributeValue::Integers(list) => write_array(location, name, &list),
        AttributeValue::Numbers(list) => write_array(location, name, &list),
    }
}

fn write_array<T: H5Type>(location: &Location, name: &str, list: &[T]) -> hdf5::Result<()> {
    location.new_attr_builder().with_data(list).create(name).map(drop)
}

pub(super) fn text_value(text: &str) -> hdf5::Result<VarLenUnicode> {
    // A C string ends at its first NUL.
    text.replace('\0', " ")
        .parse()
        .map_err(|error| format!("not a text for HDF5: {error:?}").into())
}

/// Writes overrides of the case as an attribute of /input, one in each line, if there are any.
pub(super) fn write_changed(input: &Group, changed: &[String]) -> hdf5::Result<()> {
    match changed.is_empty() {
        true => Ok(()),
        false => write_attribute(input, schema::INPUT_CHANGED, changed.join("\n").as_str()),
    }
}

pub(super) fn write_input(group: &Group, name: &str, text: &str, long_name: &str) -> hdf5::Result<()> {
    describe_text(&raw::write_text(group, name, text)?, "1", long_name)
}
