//! Contents of a file, for a listing.

use std::path::Path;

use serde::Serialize;

use super::attributes::AttributeValue;
use super::check::check_sound;
use super::source::{BLOCK, DatasetInfo, FileSource, Object};
use super::{Reason, ResultError, ResultFile};

/// Contents of a file of this program.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Contents {
    /// Attributes of the root and of the groups.
    pub attributes: Vec<AttributeInfo>,
    /// Variables in the order of the file.
    pub variables: Vec<VariableInfo>,
    /// Whether a run was still writing the file; the listing shows the last flush.
    pub growing: bool,
    /// Damage found by the seal and the sums of chunks; `None` if there is none, or neither.
    pub damage: Option<String>,
}

impl Contents {
    /// Lists the contents of a file of this program: the result of a run, a sweep, or a work-precision study.
    ///
    /// # Errors
    /// The file is missing, of another program, of a newer version, or damaged.
    pub fn read(path: &Path) -> Result<Contents, ResultError> {
        let mut contents = match ResultFile::open(path) {
            Ok(file) => file.contents()?,
            Err(ResultError {
                reason: Reason::AnotherKind(_),
                ..
            }) => of_file(&FileSource::open_known(path)?)?,
            Err(error) => return Err(error),
        };
        if !contents.growing {
            contents.damage = match check_sound(path) {
                Err(ResultError {
                    reason: Reason::NotAsWritten(problems),
                    ..
                }) => Some(problems),
                checked => checked.map(|()| None)?,
            };
        }
        Ok(contents)
    }
}

impl ResultFile {
    /// Lists all contents of the file, including additions of later versions. Checksums are not verified.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn contents(&self) -> Result<Contents, ResultError> {
        of_file(&self.source)
    }
}

fn of_file(source: &FileSource) -> Result<Contents, ResultError> {
    let mut contents = Contents {
        attributes: Vec::new(),
        variables: Vec::new(),
        growing: source.is_growing(),
        damage: None,
    };
    list(source, "", &mut contents)?;
    source.walk(&mut |path, member| match member.is {
        Object::Group(_) => list(source, path, &mut contents),
        Object::Dataset(info) => {
            contents.variables.push(describe(source, path, member.name, info)?);
            Ok(())
        }
        Object::Not(Reason::Unnamed(_)) => {
            contents.variables.push(VariableInfo {
                group: group_of(path, &member.name),
                name: member.name,
                kind: "not read: the name is not UTF-8".to_owned(),
                ..VariableInfo::default()
            });
            Ok(())
        }
        Object::Not(reason) => Err(reason.of(source.path())),
        Object::Other => Ok(()),
    })?;
    Ok(contents)
}

fn list(source: &FileSource, group: &str, contents: &mut Contents) -> Result<(), ResultError> {
    for (name, value) in source.attributes(group)? {
        contents.attributes.push(AttributeInfo {
            group: format!("/{group}"),
            name,
            value,
        });
    }
    Ok(())
}

fn group_of(path: &str, name: &str) -> String {
    let group = path.strip_suffix(name).unwrap_or_default().trim_end_matches('/');
    format!("/{group}")
}

fn describe(source: &FileSource, path: &str, name: String, info: DatasetInfo) -> Result<VariableInfo, ResultError> {
    let described = source.described(path)?;
    let bounds = match info.holds.is_number() && !info.shape.is_empty() {
        true => bounds(source, path, &info, described.fill.and_then(|fill| fill.number()))?,
        false => None,
    };
    let flag = |(value, meaning)| FlagInfo { value, meaning };
    Ok(VariableInfo {
        group: group_of(path, &name),
        name,
        kind: info.holds.name(),
        shape: info.shape,
        units: described.units,
        long_name: described.long_name,
        flags: described.flags.into_iter().map(flag).collect(),
        min: bounds.map(|bounds| bounds.0),
        max: bounds.map(|bounds| bounds.1),
    })
}

fn bounds(
    source: &FileSource,
    path: &str,
    info: &DatasetInfo,
    fill: Option<f64>,
) -> Result<Option<(f64, f64)>, ResultError> {
    let mut bounds: Option<(f64, f64)> = None;
    source.blocks(path, &info.shape, BLOCK, &mut |values: Vec<f64>| {
        for value in values
            .into_iter()
            .filter(|value| !value.is_nan() && Some(*value) != fill)
        {
            bounds = Some(bounds.map_or((value, value), |(least, most)| (least.min(value), most.max(value))));
        }
    })?;
    Ok(bounds)
}

/// An attribute of a group.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AttributeInfo {
    /// "/", "/meta", ...
    pub group: String,
    /// Name of the attribute.
    pub name: String,
    /// Stored value.
    pub value: AttributeValue,
}

/// A variable of a group.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct VariableInfo {
    /// "/trajectory", ...
    pub group: String,
    /// Path in the file.
    pub name: String,
    /// "float64", "int8", "string", ...
    #[serde(rename = "type")]
    pub kind: String,
    /// Lengths of the dimensions; empty for a scalar.
    pub shape: Vec<usize>,
    /// Stored unit.
    pub units: Option<String>,
    /// Stored description.
    pub long_name: Option<String>,
    /// Meanings of codes; empty if there are none.
    pub flags: Vec<FlagInfo>,
    /// Smallest value, apart from NaN and the fill value.
    pub min: Option<f64>,
    /// Largest value, apart from NaN and the fill value.
    pub max: Option<f64>,
}

/// The meaning of a code.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FlagInfo {
    /// Code.
    pub value: i64,
    /// Meaning of the code.
    pub meaning: String,
}
