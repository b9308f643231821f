//! Checksums of all that a file holds, which show whether it is damaged.
//!
//! The chunks of the tables have Fletcher-32 checksums, which HDF5 verifies whenever it reads them; but a chunk that its
//! index has lost is read as zeros. Each file therefore has `/meta/checksums`: a line for every group and variable, with the
//! CRC-32 of its attributes, type and shape, and of its values. The values of a table have a CRC-32 of their own, a second
//! one in the line, which the writer has made before HDF5 had them. Left out are what differs between identical runs (the
//! attributes of /meta, `history`), the `status`, which is written after all else, and the values of virtual datasets,
//! which are in other files.

use std::collections::{BTreeMap, HashMap};
use std::fmt::Write;

use hdf5::{Dataset, File};

use super::attributes::AttributeValue;
use super::schema::{self, CHECKSUMS, attribute, group, root};
use super::source::{DatasetInfo, Fault, Holds, Object, Source};
use super::values::Number;
use super::{ResultError, raw};

const DESCRIPTION: &str =
    "path, CRC-32 of attributes, type, shape and values; of a table the values have a CRC-32 of their own";

/// What need not be read of variables that are stored in chunks with checksums of HDF5's, by path without a leading slash.
#[derive(Default)]
pub(super) struct Known {
    /// Checksums of the values; `None` where they cannot be read.
    pub values: HashMap<String, Option<u32>>,
    /// All attributes but HDF5's own.
    pub attributes: HashMap<String, Vec<(&'static str, AttributeValue)>>,
}

/// Adds values to a sum.
pub(super) fn add<T: Number>(sum: &mut crc32fast::Hasher, values: &[T]) {
    let mut bytes = [[0; 8]; 512];
    for values in values.chunks(bytes.len()) {
        let bytes = &mut bytes[..values.len()];
        for (bytes, value) in bytes.iter_mut().zip(values) {
            *bytes = value.wide();
        }
        sum.update(bytes.as_flattened());
    }
}

/// The sums of the values of some datasets, as they are written: in the order of the rows.
#[derive(Default)]
pub(super) struct Sums(HashMap<String, crc32fast::Hasher>);

impl Sums {
    pub(super) fn add<T: Number>(&mut self, dataset: &Dataset, values: &[T]) {
        add(self.0.entry(dataset.name()).or_default(), values);
    }

    pub(super) fn known(&self) -> Known {
        let sums = self.0.iter();
        let sums = sums.map(|(path, sum)| (path.trim_matches('/').to_owned(), Some(sum.clone().finalize())));
        Known {
            values: sums.collect(),
            ..Known::default()
        }
    }
}

/// The lines of an open file: path and checksums, `/` for the root. Values whose sum is not `known` are read.
pub(super) fn of(source: &Source, known: &Known) -> Result<String, ResultError> {
    let mut lines = String::new();
    let mut add = |path: &str, sum: u32, values: Option<u32>| {
        let values = values.map_or(String::new(), |sum| format!(" {sum:08x}"));
        let _ = writeln!(lines, "/{path} {sum:08x}{values}");
    };
    add("", of_group(source, "")?, None);
    source.walk(&mut |path, member| {
        match &member.is {
            Object::Group(_) => add(path, of_group(source, path)?, None),
            Object::Dataset(_) if path == CHECKSUMS => {}
            Object::Dataset(info) => {
                let values = match known.values.get(path) {
                    _ if !is_summed_apart(info) => None,
                    Some(known) => *known,
                    None => Some(of_values(source, path, info)?),
                };
                let attributes = known.attributes.get(path).map(Vec::as_slice);
                add(path, of_dataset(source, path, info, attributes)?, values);
            }
            // Nothing that this program wrote.
            Object::Not(Fault::Unnamed(_)) => {}
            Object::Not(fault) => return Err(source.fault(fault)),
            Object::Other => {}
        }
        Ok(())
    })?;
    Ok(lines)
}

/// Writes the lines into a file that is whole but for them, in place of those it has. Values whose sum is not `known` are
/// read back.
pub(super) fn write(file: &File, known: &Known) -> hdf5::Result<()> {
    let failed = |error: ResultError| hdf5::Error::from(error.to_string());
    let meta = file.group(group::META)?;
    let name = CHECKSUMS.rsplit('/').next().unwrap_or(CHECKSUMS);
    if meta.link_exists(name) {
        meta.unlink(name)?;
    }
    let mut lines = of(&Source::of_open(file), known).map_err(failed)?;
    let mut own = crc32fast::Hasher::new();
    for (name, text) in [(attribute::LONG_NAME, DESCRIPTION), (attribute::UNITS, "1")] {
        add_attribute(name, &AttributeValue::Text(text.to_owned()), &mut own);
    }
    let _ = writeln!(lines, "/{CHECKSUMS} {:08x}", own.finalize());
    let dataset = raw::write_text(&meta, name, &lines)?;
    super::attributes::describe_text(&dataset, "1", DESCRIPTION)
}

/// The line of the checksums themselves, of whose attributes alone it is.
pub(super) fn own_line(source: &Source) -> Result<String, ResultError> {
    let mut sum = crc32fast::Hasher::new();
    add_attributes(source, CHECKSUMS, &mut sum)?;
    Ok(format!("/{CHECKSUMS} {:08x}\n", sum.finalize()))
}

/// The sums of values that the lines of a file have: those of a file to which something is added stand for what was written
/// first, and not for what the copy has.
pub(super) fn known(lines: &str) -> Known {
    let parsed = lines.lines().filter_map(parts);
    let sums = parsed.filter_map(|(path, sums)| Some((path.trim_matches('/').to_owned(), Some(*sums.get(1)?))));
    Known {
        values: sums.collect(),
        ..Known::default()
    }
}

/// Path and sums of a line.
fn parts(line: &str) -> Option<(&str, Vec<u32>)> {
    let (mut path, mut sums) = (line, Vec::new());
    while let Some((before, last)) = path.rsplit_once(' ')
        && last.len() == 8
        && sums.len() < 2
        && let Ok(sum) = u32::from_str_radix(last, 16)
    {
        path = before;
        sums.insert(0, sum);
    }
    (!sums.is_empty()).then_some((path, sums))
}

/// What differs between the lines that a file has and those that it should have: paths without a leading slash. Values
/// for which either has no sum are not held against each other.
pub(super) fn differences(stored: &str, found: &str) -> Vec<String> {
    let split = |lines| -> BTreeMap<String, Vec<u32>> {
        let lines = str::lines(lines).map(|line| parts(line).unwrap_or((line, Vec::new())));
        lines.map(|(path, sums)| (path.to_owned(), sums)).collect()
    };
    let (stored, found) = (split(stored), split(found));
    let mut paths: Vec<String> = stored.keys().chain(found.keys()).cloned().collect();
    paths.sort();
    paths.dedup();
    paths.retain(|path| match (stored.get(path), found.get(path)) {
        (Some(stored), Some(found)) if !stored.is_empty() && !found.is_empty() => {
            stored.iter().zip(found).any(|(stored, found)| stored != found)
        }
        _ => true,
    });
    paths
}

/// Whether the values have a sum of their own: the writer hands them over while the variable is still growing.
pub(super) fn is_summed_apart(info: &DatasetInfo) -> bool {
    info.covered && info.chunk.is_some() && info.holds.is_number()
}

/// The sum of all values, the last dimension fastest.
pub(super) fn of_values(source: &Source, path: &str, info: &DatasetInfo) -> Result<u32, ResultError> {
    let mut sum = crc32fast::Hasher::new();
    add_values(source, path, info, &mut sum)?;
    Ok(sum.finalize())
}

fn add_values(source: &Source, path: &str, info: &DatasetInfo, sum: &mut crc32fast::Hasher) -> Result<(), ResultError> {
    if matches!(info.holds, Holds::Integers(_)) {
        source.blocks(path, &info.shape, BLOCK, &mut |values: Vec<i64>| add(sum, &values))
    } else {
        source.blocks(path, &info.shape, BLOCK, &mut |values: Vec<f64>| add(sum, &values))
    }
}

fn of_group(source: &Source, path: &str) -> Result<u32, ResultError> {
    let mut sum = crc32fast::Hasher::new();
    if path != group::META {
        add_attributes(source, path, &mut sum)?;
    }
    Ok(sum.finalize())
}

fn of_dataset(
    source: &Source,
    path: &str,
    info: &DatasetInfo,
    attributes: Option<&[(&'static str, AttributeValue)]>,
) -> Result<u32, ResultError> {
    let mut sum = crc32fast::Hasher::new();
    sum.update(format!("{} {:?}", info.holds.name(), info.shape).as_bytes());
    match attributes {
        Some(known) => {
            let mut known: Vec<_> = known.iter().collect();
            // As they are read.
            known.sort_by_key(|(name, _)| *name);
            known
                .into_iter()
                .for_each(|(name, value)| add_attribute(name, value, &mut sum));
        }
        None => add_attributes(source, path, &mut sum)?,
    }
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
        holds if holds.is_number() => add_values(source, path, info, &mut sum)?,
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
        add_attribute(&name, &value, sum);
    }
    Ok(())
}

fn add_attribute(name: &str, value: &AttributeValue, sum: &mut crc32fast::Hasher) {
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
