//! `stickslip inspect`.

use super::arguments::{Common, InspectOptions};
use super::{CommandError, End, complain, print, print_json, terminal};
use crate::results::schema::attribute::{LONG_NAME_SUFFIX, UNITS_SUFFIX};
use crate::results::{AttributeInfo, Contents, VariableInfo};

/// Lists what a file of this program holds: of a run, a sweep or a work-precision study.
pub(super) fn inspect(options: &InspectOptions, common: &Common) -> Result<End, CommandError> {
    let contents = Contents::read(&options.file)?;
    if contents.growing && !common.quiet {
        complain(&format!(
            "{}: still being written; this is what the last flush left",
            options.file.display()
        ));
    }
    if let Some(problems) = contents.damage.as_ref().filter(|_| !common.quiet) {
        complain(&format!(
            "warning: {}: damaged, and what is listed may be wrong: {problems}; copy it again, or repeat the run",
            options.file.display()
        ));
    }
    if common.json {
        print_json(&contents)?;
    } else {
        print(&listing(&contents))?;
    }
    Ok(End::Done)
}

/// Group by group: the attributes as NAME = VALUE, then the variables as a table.
fn listing(contents: &Contents) -> String {
    let mut groups: Vec<&str> = Vec::new();
    let of_attributes = contents.attributes.iter().map(|a| a.group.as_str());
    for group in of_attributes.chain(contents.variables.iter().map(|v| v.group.as_str())) {
        if !groups.contains(&group) {
            groups.push(group);
        }
    }
    let mut parts = Vec::with_capacity(groups.len());
    for group in groups {
        let attributes: Vec<_> = contents.attributes.iter().filter(|a| a.group == group).collect();
        let variables: Vec<_> = contents.variables.iter().filter(|v| v.group == group).collect();
        let mut part = format!("{group}\n");
        if !attributes.is_empty() {
            part += &attribute_lines(&attributes);
        }
        if !variables.is_empty() {
            if !attributes.is_empty() {
                part.push('\n');
            }
            part += &variable_lines(&variables);
        }
        parts.push(part);
    }
    parts.join("\n")
}

/// A quantity's unit and description are attributes of their own in the file; here they stand beside it.
fn attribute_lines(attributes: &[&AttributeInfo]) -> String {
    let companion = |name: &str, suffix: &str| {
        let name = format!("{name}{suffix}");
        attributes.iter().find(|a| a.name == name).map(|a| a.value.to_string())
    };
    let is_companion = |a: &AttributeInfo| {
        [UNITS_SUFFIX, LONG_NAME_SUFFIX].iter().any(|suffix| {
            a.name
                .strip_suffix(suffix)
                .is_some_and(|stem| attributes.iter().any(|other| other.name == stem))
        })
    };
    let described = attributes
        .iter()
        .any(|a| companion(&a.name, LONG_NAME_SUFFIX).is_some());
    let mut table = terminal::table(&[]);
    for a in attributes.iter().filter(|a| !is_companion(a)) {
        let unit = companion(&a.name, UNITS_SUFFIX).filter(|unit| unit != "1");
        let value = [Some(a.value.to_string()), unit]
            .into_iter()
            .flatten()
            .collect::<Vec<_>>();
        let mut row = vec![a.name.clone(), value.join(" ")];
        if described {
            row.push(companion(&a.name, LONG_NAME_SUFFIX).unwrap_or_default());
        }
        table.add_row(row);
    }
    terminal::show(&table)
}

/// What fits a terminal; the JSON document has the types and all digits.
fn variable_lines(variables: &[&VariableInfo]) -> String {
    let mut table = terminal::table(&["variable", "rows", "units", "least", "largest", "description"]);
    for v in variables {
        let shape = v.shape.iter().map(usize::to_string).collect::<Vec<_>>().join(" x ");
        let whole = v.kind.starts_with("int");
        let bound = |x: Option<f64>| match x {
            None => String::new(),
            Some(x) if whole => format!("{x}"),
            Some(x) => format!("{x:.3e}"),
        };
        table.add_row([
            v.name.clone(),
            shape,
            v.units.clone().unwrap_or_default(),
            bound(v.min),
            bound(v.max),
            v.long_name.clone().unwrap_or_default(),
        ]);
    }
    terminal::align_right(&mut table, [1, 3, 4]);
    let mut lines = terminal::show(&table);
    for v in variables.iter().filter(|v| !v.flags.is_empty()) {
        let meanings: Vec<String> = v.flags.iter().map(|f| format!("{} {}", f.value, f.meaning)).collect();
        lines += &format!("{}: {}\n", v.name, meanings.join(", "));
    }
    lines
}
