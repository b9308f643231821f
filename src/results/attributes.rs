//! Attributes of HDF5 files: their values, written and read.

use hdf5::types::{TypeDescriptor, VarLenAscii, VarLenUnicode};
use hdf5::{Attribute, Group, Location};
use serde::Serialize;

use super::{raw, schema};

/// The value of an attribute of /meta or /events.
#[derive(Debug, Clone, PartialEq)]
pub enum MetaValue {
    Text(String),
    Number(f64),
}

/// The value of an attribute.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum AttributeValue {
    Text(String),
    Integer(i64),
    Number(f64),
    Integers(Vec<i64>),
    Numbers(Vec<f64>),
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
    let dataset = raw::write_text(group, name, text)?;
    write_text_attribute(&dataset, schema::attribute::UNITS, "1")?;
    write_text_attribute(&dataset, schema::attribute::LONG_NAME, long_name)
}

pub(super) fn text_attribute(location: &Location, name: &str) -> Option<String> {
    match attribute_value(&location.attr(name).ok()?)? {
        AttributeValue::Text(text) => Some(text),
        _ => None,
    }
}

/// All attributes in alphabetical order.
pub(super) fn all(location: &Location) -> hdf5::Result<Vec<(String, AttributeValue)>> {
    let mut names = location.attr_names()?;
    names.sort();
    let mut attributes = Vec::with_capacity(names.len());
    for name in names {
        if let Some(value) = attribute_value(&location.attr(&name)?) {
            attributes.push((name, value));
        }
    }
    Ok(attributes)
}

/// The value of an attribute; `None` for what is HDF5's own (references of dimension scales).
pub(super) fn attribute_value(attribute: &Attribute) -> Option<AttributeValue> {
    let scalar = attribute.is_scalar();
    match attribute.dtype().ok()?.to_descriptor().ok()? {
        TypeDescriptor::VarLenUnicode if scalar => {
            let text = attribute.read_scalar::<VarLenUnicode>().ok()?;
            Some(AttributeValue::Text(text.as_str().to_owned()))
        }
        TypeDescriptor::VarLenAscii if scalar => {
            let text = attribute.read_scalar::<VarLenAscii>().ok()?;
            Some(AttributeValue::Text(text.as_str().to_owned()))
        }
        TypeDescriptor::FixedUnicode(_) | TypeDescriptor::FixedAscii(_) => {
            raw::read_text(attribute).ok()?.map(AttributeValue::Text)
        }
        TypeDescriptor::Integer(_) | TypeDescriptor::Unsigned(_) => {
            let values = attribute.read_raw::<i64>().ok()?;
            Some(if scalar {
                AttributeValue::Integer(values[0])
            } else {
                AttributeValue::Integers(values)
            })
        }
        TypeDescriptor::Float(_) => {
            let values = attribute.read_raw::<f64>().ok()?;
            Some(if scalar {
                AttributeValue::Number(values[0])
            } else {
                AttributeValue::Numbers(values)
            })
        }
        _ => None,
    }
}
