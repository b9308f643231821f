//! Reports on a file: its contents, and whether it is as it was written.

use super::{NumberFormat, Page, PagePart, PageTable, Report, exponent};
use serde::{Serialize, Serializer};
use std::path::Path;
use stickslip_case::changed_line;
use stickslip_files::schema::INPUT_CHANGED;
use stickslip_files::schema::attribute::{LONG_NAME_SUFFIX, UNITS_SUFFIX};
use stickslip_files::{AttributeInfo, CheckReport, Contents, MergeReport, VariableInfo};

impl Report for Contents {
    /// The contents group by group: attributes as NAME = VALUE, variables as a table.
    fn page(&self) -> Page {
        let of_attributes = self.attributes.iter().map(|a| a.group.as_str());
        let groups = of_attributes.chain(self.variables.iter().map(|v| v.group.as_str()));
        let mut seen = std::collections::HashSet::new();
        let parts = groups.filter(|group| seen.insert(*group)).flat_map(|group| {
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
        let changed = self
            .attributes
            .iter()
            .find(|a| a.group == "/input" && a.name == INPUT_CHANGED);
        let changed = changed.map(|a| a.value.to_string().lines().map(str::to_owned).collect::<Vec<_>>());
        Page::default()
            .with_all(changed.map(|lines| changed_line(&lines)))
            .with_all(parts)
    }
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
        .count("rows", |v| {
            v.shape.iter().map(usize::to_string).collect::<Vec<_>>().join(" x ")
        })
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
