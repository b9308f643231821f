//! What is stored, in short: by it a damaged file is told from a good one.
//!
//! The chunks of the tables have Fletcher-32 checksums, which HDF5 verifies whenever it reads them. For all the rest (texts,
//! attributes, types, shapes) each file has `/meta/checksums`: a line for every group and variable, with the CRC-32 of what
//! HDF5 would not notice. Left out are what differs between identical runs (the attributes of /meta, `history`), and the
//! `status`, which is written after all else.

use std::fmt::Write;

use hdf5::File;

use super::attributes::AttributeValue;
use super::schema::{self, CHECKSUMS, attribute, group, root};
use super::source::{DatasetInfo, Holds, Kind, Source};
use super::{ResultError, raw};

/// The lines of an open file: path and checksum, `/` for the root.
pub(super) fn of(source: &Source) -> Result<String, ResultError> {
    let mut lines = String::new();
    let mut add = |path: &str, sum: u32| {
        let _ = writeln!(lines, "/{path} {sum:08x}");
    };
    add("", of_group(source, "")?);
    source.walk(&mut |path, member| {
        match &member.is {
            Kind::Group(_) => add(path, of_group(source, path)?),
            Kind::Dataset(_) if path == CHECKSUMS => {}
            Kind::Dataset(info) => add(path, of_dataset(source, path, info)?),
            Kind::Not(fault) => return Err(source.fault(fault)),
            Kind::Other => {}
        }
        Ok(())
    })?;
    Ok(lines)
}

/// Writes the lines into a file that is whole but for them, in place of those it has.
pub(super) fn write(file: &File) -> hdf5::Result<()> {
    let failed = |error: ResultError| hdf5::Error::from(error.to_string());
    let meta = file.group(group::META)?;
    let name = CHECKSUMS.rsplit('/').next().unwrap_or(CHECKSUMS);
    if meta.link_exists(name) {
        meta.unlink(name)?;
    }
    let lines = of(&Source::of_open(file)).map_err(failed)?;
    let dataset = raw::write_text(&meta, name, &lines)?;
    let describe = super::attributes::write_text_attribute;
    describe(&dataset, attribute::UNITS, "1")?;
    describe(
        &dataset,
        attribute::LONG_NAME,
        "CRC-32 of what has no checksum of HDF5's: path and sum",
    )
}

/// What differs between the lines that a file has and those that it should have: paths without a leading slash.
pub(super) fn differences(stored: &str, found: &str) -> Vec<String> {
    let path = |line: &str| line.rsplit_once(' ').map_or(line, |(path, _)| path).to_owned();
    let missing = |of: &str, from: &str| {
        let lines: std::collections::HashSet<&str> = from.lines().collect();
        of.lines()
            .filter(|line| !lines.contains(line))
            .map(path)
            .collect::<Vec<_>>()
    };
    let mut paths = missing(stored, found);
    paths.extend(missing(found, stored));
    paths.sort();
    paths.dedup();
    paths
}

fn of_group(source: &Source, path: &str) -> Result<u32, ResultError> {
    let mut sum = crc32fast::Hasher::new();
    if path != group::META {
        add_attributes(source, path, &mut sum)?;
    }
    Ok(sum.finalize())
}

fn of_dataset(source: &Source, path: &str, info: &DatasetInfo) -> Result<u32, ResultError> {
    let mut sum = crc32fast::Hasher::new();
    sum.update(format!("{} {:?}", info.holds.name(), info.shape).as_bytes());
    add_attributes(source, path, &mut sum)?;
    match &info.holds {
        _ if info.covered => {}
        Holds::Texts if info.shape.is_empty() => {
            sum.update(source.text(path)?.unwrap_or_default().as_bytes());
        }
        Holds::Texts => {
            for text in source.texts(path)? {
                sum.update(text.as_bytes());
                sum.update(&[0]);
            }
        }
        Holds::Integers(_) => source.blocks(path, &info.shape, BLOCK, &mut |values: Vec<i64>| {
            values.iter().for_each(|value| sum.update(&value.to_le_bytes()));
        })?,
        holds if holds.is_number() => source.blocks(path, &info.shape, BLOCK, &mut |values: Vec<f64>| {
            values.iter().for_each(|value| sum.update(&value.to_le_bytes()));
        })?,
        _ => {}
    }
    Ok(sum.finalize())
}

/// Values read at a time.
const BLOCK: usize = 65_536;

fn add_attributes(source: &Source, path: &str, sum: &mut crc32fast::Hasher) -> Result<(), ResultError> {
    for (name, value) in source.attributes(path)? {
        if path.is_empty() && [root::HISTORY, root::STATUS].contains(&name.as_str()) {
            continue;
        }
        // HDF5's own, of dimension scales.
        if schema::attribute::OF_HDF5.contains(&name.as_str()) {
            continue;
        }
        sum.update(name.as_bytes());
        match value {
            AttributeValue::Text(text) => sum.update(text.as_bytes()),
            AttributeValue::Integer(value) => sum.update(&value.to_le_bytes()),
            AttributeValue::Number(value) => sum.update(&value.to_le_bytes()),
            AttributeValue::Integers(values) => values.iter().for_each(|value| sum.update(&value.to_le_bytes())),
            AttributeValue::Numbers(values) => values.iter().for_each(|value| sum.update(&value.to_le_bytes())),
        }
        sum.update(&[0]);
    }
    Ok(())
}
