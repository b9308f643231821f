//! What a file holds, for a listing.

use std::path::Path;

use serde::Serialize;

use super::attributes::{AttributeValue, plain};
use super::check::check_sound;
use super::source::{DatasetInfo, Fault, Object, Source};
use super::{Reason, ResultError, ResultFile};

/// What a file of this program holds, for a listing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Contents {
    /// Attributes of the root and of the groups.
    pub attributes: Vec<AttributeInfo>,
    /// In the order of the file.
    pub variables: Vec<VariableInfo>,
    /// Whether a run was still writing the file; it is listed as the last flush left it.
    pub growing: bool,
    /// What its checksums say is not as it was written; `None` where they agree, or there are none.
    pub damage: Option<String>,
}

/// About so many values are read at a time.
const BLOCK: usize = 65_536;

impl Contents {
    /// What a file of this program holds: the result of a run, a sweep, or a work-precision study.
    ///
    /// # Errors
    /// A file that is not there, of another program, of a newer version of this one, or damaged.
    pub fn read(path: &Path) -> Result<Contents, ResultError> {
        let mut contents = match ResultFile::open(path) {
            Ok(file) => file.contents()?,
            Err(ResultError {
                reason: Reason::AnotherKind(_),
                ..
            }) => of_file(&Source::open_known(path)?)?,
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
    /// Everything that the file holds, also what later versions of the program have added to it; its checksums are not looked at.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn contents(&self) -> Result<Contents, ResultError> {
        of_file(&self.source)
    }
}

/// Everything in a file, group by group.
fn of_file(source: &Source) -> Result<Contents, ResultError> {
    let mut contents = Contents {
        attributes: Vec::new(),
        variables: Vec::new(),
        growing: source.is_growing(),
        damage: None,
    };
    list(source, "", &mut contents)?;
    source.walk(&mut |path, member| match &member.is {
        Object::Group(_) => list(source, path, &mut contents),
        Object::Dataset(info) => {
            contents.variables.push(describe(source, path, &member.name, info)?);
            Ok(())
        }
        Object::Not(Fault::Unnamed(_)) => {
            // Nobody can ask for it by its name; whether it is a variable is not known.
            let kind = "not read: the name is not UTF-8".to_owned();
            contents.variables.push(VariableInfo {
                group: group_of(path, &member.name),
                name: member.name.clone(),
                kind,
                ..VariableInfo::default()
            });
            Ok(())
        }
        Object::Not(fault) => Err(source.fault(fault)),
        Object::Other => Ok(()),
    })?;
    Ok(contents)
}

/// Adds the attributes of a group.
fn list(source: &Source, group: &str, contents: &mut Contents) -> Result<(), ResultError> {
    for (name, value) in source.attributes(group)? {
        contents.attributes.push(AttributeInfo {
            group: format!("/{group}"),
            name,
            value,
        });
    }
    Ok(())
}

/// The group of an object, with a leading slash.
fn group_of(path: &str, name: &str) -> String {
    let group = path.strip_suffix(name).unwrap_or_default().trim_end_matches('/');
    format!("/{group}")
}

fn describe(source: &Source, path: &str, name: &str, info: &DatasetInfo) -> Result<VariableInfo, ResultError> {
    let described = source.described(path)?;
    let bounds = if info.holds.is_number() && !info.shape.is_empty() {
        bounds(source, path, info, described.fill.and_then(|fill| fill.number()))?
    } else {
        None
    };
    let flag = |(value, meaning)| FlagInfo { value, meaning };
    Ok(VariableInfo {
        group: group_of(path, name),
        name: name.to_owned(),
        kind: info.holds.name(),
        shape: info.shape.clone(),
        units: described.units,
        long_name: described.long_name,
        flags: described.flags.into_iter().map(flag).collect(),
        min: bounds.map(|bounds| bounds.0),
        max: bounds.map(|bounds| bounds.1),
    })
}

/// Least and largest value, a block after the other.
fn bounds(
    source: &Source,
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
    /// Within its object.
    pub name: String,
    /// As stored.
    #[serde(serialize_with = "plain")]
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
    /// Empty for a scalar.
    pub shape: Vec<usize>,
    /// As stored.
    pub units: Option<String>,
    /// As stored.
    pub long_name: Option<String>,
    /// What its codes mean; empty where it is no code.
    pub flags: Vec<FlagInfo>,
    /// Least value that is neither NaN nor the fill value; `None` where there is none.
    pub min: Option<f64>,
    /// Of the finite values.
    pub max: Option<f64>,
}

/// The meaning of a code.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FlagInfo {
    /// As stored.
    pub value: i64,
    /// What the value stands for.
    pub meaning: String,
}
