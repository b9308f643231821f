//! Reports on a file: its contents, and whether it is as it was written.

use super::{NumberFormat, Page, PagePart, PageTable, Report, below_changes, exponent};
use serde::{Serialize, Serializer};
use std::path::Path;
use stickslip_files::schema::attribute::{LONG_NAME_SUFFIX, UNITS_SUFFIX};
use stickslip_files::schema::{INPUT_CHANGED, group, root};
use stickslip_files::{AttributeInfo, CheckReport, Contents, MergeReport, VariableInfo};

impl Report for Contents {
    /// What the file is, and its groups with their sizes. Details are the contents group by group: attributes as
    /// NAME = VALUE, variables as a table.
    fn page(&self) -> Page {
        let of_attributes = self.attributes.iter().map(|a| a.group.as_str());
        let groups = of_attributes.chain(self.variables.iter().map(|v| v.group.as_str()));
        let mut seen = std::collections::HashSet::new();
        let groups: Vec<&str> = groups.filter(|group| seen.insert(*group)).collect();
        let parts = groups.iter().flat_map(|&group| {
            let attributes: Vec<_> = self.attributes.iter().filter(|a| a.group == group).collect();
            let variables: Vec<_> = self.variables.iter().filter(|v| v.group == group).collect();
            let attributes = (!attributes.is_empty()).then(|| attribute_table(&attributes));
            let variables = (!variables.is_empty()).then(|| variable_parts(&variables));
            let mut parts: Vec<PagePart> = attributes.into_iter().map(PagePart::Table).collect();
            parts.extend(variables.into_iter().flatten());
            if let Some(PagePart::Table(first)) = parts.first_mut() {
                group.clone_into(&mut first.title);
            }
            parts
        });
        let changed = attribute(self, "input", INPUT_CHANGED);
        let changed = changed.map(|lines| lines.lines().map(str::to_owned).collect::<Vec<_>>());
        let title = attribute(self, "", root::TITLE).unwrap_or_default();
        Page::new(title, below_changes(&changed.unwrap_or_default(), ""))
            .with(PageTable::pairs(headline(self)))
            .with(sizes(self, &groups))
            .details(parts)
    }
}

fn attribute(contents: &Contents, group: &str, name: &str) -> Option<String> {
    let mut attributes = contents.attributes.iter();
    let found = attributes.find(|a| a.group.strip_prefix('/') == Some(group) && a.name == name);
    found.map(|a| a.value.to_string())
}

/// What the file is, how it was made, and how far the run goes.
fn headline(contents: &Contents) -> Vec<(&'static str, String)> {
    let of = |group: &str, names: &[&str]| {
        let values = names.iter().filter_map(|name| attribute(contents, group, name));
        values.collect::<Vec<_>>().join(", ")
    };
    let variable = |group: &str, name: &str| {
        let mut variables = contents.variables.iter();
        variables.find(|v| v.group.strip_prefix('/') == Some(group) && v.name == name)
    };
    let times = variable(group::TRAJECTORY, "time");
    let end = times.and_then(|times| times.max);
    let counts = ["stick_count", "slip_count"]
        .into_iter()
        .filter_map(|name| Some((name.split('_').next()?, attribute(contents, group::STICK_SLIP, name)?)))
        .map(|(noun, count)| format!("{count} {noun}s"));
    let events = variable(group::EVENTS, "time").and_then(|events| events.shape.first());
    let counts: Vec<String> = events
        .map(|count| format!("{count} events"))
        .into_iter()
        .chain(counts)
        .collect();
    let rtol = attribute(contents, group::META, "rtol").map(|rtol| format!(", rtol {rtol}"));
    let rows = [
        ("file", of("", &[root::FORMAT, root::STATUS])),
        ("made by", of("", &[root::SOURCE])),
        ("history", of("", &[root::HISTORY])),
        ("method", of(group::META, &["method"]) + &rtol.unwrap_or_default()),
        ("end", end.map(|end| format!("{end} s")).unwrap_or_default()),
        ("counts", counts.join(", ")),
    ];
    rows.into_iter().filter(|(_, value)| !value.is_empty()).collect()
}

/// The groups, each with its largest variable's size.
fn sizes(contents: &Contents, groups: &[&str]) -> PageTable {
    let rows = |group: &str| {
        let variables = contents.variables.iter().filter(|v| v.group == group);
        let largest = variables.max_by_key(|v| v.shape.iter().product::<usize>());
        largest.map(size).unwrap_or_default()
    };
    PageTable::of(groups.iter().copied())
        .text("group", |group| group)
        .count("rows", rows)
        .count("variables", |group| {
            contents.variables.iter().filter(|v| v.group == group).count()
        })
        .count("attributes", |group| {
            contents.attributes.iter().filter(|a| a.group == group).count()
        })
        .done()
}

fn size(variable: &VariableInfo) -> String {
    variable
        .shape
        .iter()
        .map(usize::to_string)
        .collect::<Vec<_>>()
        .join(" x ")
}

/// Units and descriptions, which are separate attributes in the file, follow their quantity.
fn attribute_table(attributes: &[&AttributeInfo]) -> PageTable {
    let companion = |name: &str, suffix: &str| {
        let name = format!("{name}{suffix}");
        attributes.iter().find(|a| a.name == name).map(|a| a.value.to_string())
    };
    let is_companion = |a: &AttributeInfo| {
        let stems = [UNITS_SUFFIX, LONG_NAME_SUFFIX].map(|suffix| a.name.strip_suffix(suffix));
        let mut stems = stems.into_iter().flatten();
        stems.any(|stem| attributes.iter().any(|other| other.name == stem))
    };
    let value = |a: &AttributeInfo| {
        let unit = companion(&a.name, UNITS_SUFFIX).filter(|unit| unit != "1");
        let value: Vec<String> = std::iter::once(a.value.to_string()).chain(unit).collect();
        value.join(" ")
    };
    let meaning = |a: &AttributeInfo| companion(&a.name, LONG_NAME_SUFFIX);
    let described = attributes.iter().any(|a| meaning(a).is_some());
    PageTable::of(attributes.iter().copied().filter(|a| !is_companion(a)))
        .text("", |a| a.name.clone())
        .text("", value)
        .text("", |a| meaning(a).unwrap_or_default())
        .only_if(described)
        .done()
}

/// A short table; the JSON document has types and all digits.
fn variable_parts(variables: &[&VariableInfo]) -> Vec<PagePart> {
    const BOUND: NumberFormat = exponent(3).or("");
    let bound = |v: &VariableInfo, x: Option<f64>| match x {
        Some(x) if v.kind.starts_with("int") => format!("{x}"),
        x => BOUND.print(x),
    };
    let table = PageTable::of(variables.iter().copied())
        .text("variable", |v| v.name.clone())
        .count("rows", size)
        .text("units", |v| v.units.clone().unwrap_or_default())
        .count("least", |v| bound(v, v.min))
        .count("largest", |v| bound(v, v.max))
        .text("description", |v| v.long_name.clone().unwrap_or_default())
        .done();
    let flags = variables.iter().filter(|v| !v.flags.is_empty()).map(|v| {
        let meanings: Vec<String> = v.flags.iter().map(|f| format!("{} {}", f.value, f.meaning)).collect();
        PagePart::Below(Box::new(format!("{}: {}", v.name, meanings.join(", ")).into()))
    });
    std::iter::once(PagePart::Table(table)).chain(flags).collect()
}

impl Report for CheckReport {
    fn page(&self) -> Page {
        if !self.problems.is_empty() {
            return Page::default().below(self.problems.iter().map(ToString::to_string));
        }
        let sums = match self.sealed {
            true => "all checksums agree",
            false => "the checksums of its chunks agree, but there is none of all bytes (docs/reference/limits.md)",
        };
        let (file, format, status, variables) = (self.file.display(), &self.format, &self.status, self.variables);
        Page::new(
            format!("{file}: {format}, {status}; {variables} variables read, {sums}"),
            "",
        )
    }
}

impl Report for MergeReport {
    fn page(&self) -> Page {
        let failed = match self.failed {
            0 => String::new(),
            failed => format!(" ({failed} failed)"),
        };
        let (points, shards, file) = (self.points, self.shards, self.file.display());
        Page::new(format!("{points} points{failed} of {shards} shards"), file.to_string())
    }
}

/// Files that a command has written; with a folder, by their names in it.
#[derive(Serialize)]
pub(crate) struct FilesReport<'a, F> {
    pub files: &'a [F],
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "displayed")]
    pub folder: Option<&'a Path>,
}

fn displayed<S: Serializer>(path: &Option<&Path>, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&path.unwrap_or(Path::new("")).display())
}

impl<F: AsRef<Path> + Serialize> Report for FilesReport<'_, F> {
    fn page(&self) -> Page {
        let folder = self.folder.unwrap_or(Path::new(""));
        let paths = self.files.iter().map(|file| folder.join(file).display().to_string());
        Page::default().below(paths)
    }
}
