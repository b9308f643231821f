//! Objects of an HDF5 file, and tables: groups whose variables share dimensions, as in netCDF.

use std::ops::Range;

use super::{FileSource, joined};
use crate::{Reason, ResultError, schema};

pub(crate) struct GroupMember {
    pub(crate) name: String,
    pub(crate) is: Object,
}

pub(crate) enum Object {
    Group(String),
    Dataset(DatasetInfo),
    Not(Reason),
    /// Named types and dangling links.
    Other,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DatasetInfo {
    /// Empty for a scalar.
    pub(crate) shape: Vec<usize>,
    pub(crate) holds: Holds,
    pub(crate) chunk: Option<Vec<usize>>,
    pub(crate) chunks: Option<usize>,
}

impl DatasetInfo {
    pub(crate) fn size(&self) -> usize {
        self.shape.iter().product()
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Holds {
    Integers(usize),
    Unsigned(usize),
    Floats(usize),
    Texts,
    Other(String),
}

impl Holds {
    pub(crate) fn is_number(&self) -> bool {
        matches!(self, Holds::Integers(_) | Holds::Unsigned(_) | Holds::Floats(_))
    }

    pub(crate) fn name(&self) -> String {
        match self {
            Holds::Integers(bytes) => format!("int{}", 8 * bytes),
            Holds::Unsigned(bytes) => format!("uint{}", 8 * bytes),
            Holds::Floats(bytes) => format!("float{}", 8 * bytes),
            Holds::Texts => "string".to_owned(),
            Holds::Other(name) => name.clone(),
        }
    }
}

/// The columns of a group, all as long as its first variable. Readers fail for a missing column, or one of another
/// length.
#[derive(Debug)]
pub struct TableReader<'a> {
    source: &'a FileSource,
    group: String,
    rows: usize,
}

impl TableReader<'_> {
    /// The values of a column.
    pub fn column(&self, name: &str) -> Result<Vec<f64>, ResultError> {
        Ok(self.read(name, 1)?.0)
    }

    /// The values of a column that has a second dimension, row by row, and the length of that dimension.
    pub fn matrix(&self, name: &str) -> Result<(Vec<f64>, usize), ResultError> {
        let (values, shape) = self.read(name, 2)?;
        Ok((values, shape[1]))
    }

    fn read(&self, name: &str, dimensions: usize) -> Result<(Vec<f64>, Vec<usize>), ResultError> {
        let path = joined(&self.group, name);
        let info = self.source.dataset(&path)?;
        let info = info.ok_or_else(|| self.source.missing(format!("variable {path}")))?;
        if info.shape.len() != dimensions || info.shape[0] != self.rows {
            return Err(uneven(&path, &info.shape, &[self.rows]).of(self.source.path()));
        }
        let all: Vec<Range<usize>> = info.shape.iter().map(|&length| 0..length).collect();
        Ok((self.source.read(&path, &all)?, info.shape))
    }
}

/// The error of a variable whose shape does not fit the columns of its table.
pub(crate) fn uneven(path: &str, shape: &[usize], lengths: &[usize]) -> Reason {
    let (group, name) = path.rsplit_once('/').unwrap_or(("", path));
    let listed = |lengths: &[usize], by: &str| lengths.iter().map(ToString::to_string).collect::<Vec<_>>().join(by);
    let what = if shape.len() == 1 { "rows" } else { "values" };
    let (found, expected) = (listed(shape, " x "), listed(lengths, " or "));
    Reason::Uneven {
        variable: format!("/{path}"),
        what: format!("/{group} differ in length: {name} has {found} {what}, and the table {expected}"),
    }
}

impl FileSource {
    pub(crate) fn table(&self, group: &str) -> Result<TableReader<'_>, ResultError> {
        let members = self.members(group)?;
        let mut columns = members.iter().filter_map(|member| match &member.is {
            Object::Dataset(info) => info.shape.first(),
            _ => None,
        });
        Ok(TableReader {
            source: self,
            group: group.to_owned(),
            rows: columns.next().copied().unwrap_or(0),
        })
    }

    /// Fails at the first variable that is not over the dimensions of its group.
    pub(crate) fn check_tables(&self) -> Result<(), ResultError> {
        self.uneven(1)?.into_iter().next().map_or(Ok(()), Err)
    }

    /// Returns the first `most` variables that are not over the dimensions of their groups. A group without a
    /// coordinate variable is a table in studies alone: other programs may add groups to the result of a run.
    pub(crate) fn uneven(&self, most: usize) -> Result<Vec<ResultError>, ResultError> {
        let mut groups: Vec<(String, Vec<(String, DatasetInfo)>)> = vec![(String::new(), Vec::new())];
        self.walk(&mut |path, member| {
            match member.is {
                Object::Group(_) => groups.push((path.to_owned(), Vec::new())),
                // Earlier versions stored checksums next to the variables.
                Object::Dataset(info) if !info.shape.is_empty() && member.name != "checksums" => {
                    let of = path.rsplit_once('/').map_or("", |(group, _)| group);
                    if let Some(group) = groups.iter_mut().rev().find(|group| group.0 == of) {
                        group.1.push((path.to_owned(), info));
                    }
                }
                _ => {}
            }
            Ok(())
        })?;
        let is_run = self.text_attribute("", schema::root::FORMAT)?.as_deref() == Some(schema::FORMAT);
        let mut found = Vec::new();
        for (_, variables) in groups {
            let mut lengths = Vec::new();
            for (path, info) in &variables {
                let is_scale = || self.text_attribute(path, schema::attribute::CLASS);
                if info.shape.len() == 1 && is_scale()?.as_deref() == Some(schema::SCALE) {
                    lengths.push(info.shape[0]);
                }
            }
            if lengths.is_empty() && !is_run {
                lengths.extend(variables.first().map(|(_, info)| info.shape[0]));
            }
            let is_over = |info: &DatasetInfo| info.shape.iter().all(|length| lengths.contains(length));
            let odd = variables
                .iter()
                .filter(|(_, info)| !lengths.is_empty() && !is_over(info));
            found.extend(odd.map(|(path, info)| uneven(path, &info.shape, &lengths).of(self.path())));
            if found.len() >= most {
                break;
            }
        }
        Ok(found)
    }
}
