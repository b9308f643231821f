//! `stickslip inspect`: lists what a file contains.

use super::arguments::{Common, InspectOptions};
use super::{CommandEnd, CommandError, complain, print, print_json, terminal};
use stickslip_files::schema::attribute::{LONG_NAME_SUFFIX, UNITS_SUFFIX};
use stickslip_files::{AttributeInfo, Contents, VariableInfo};

pub(super) fn inspect(options: &InspectOptions, common: &Common) -> Result<CommandEnd, CommandError> {
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
    Ok(CommandEnd::Done)
}

/// The contents group by group: attributes as NAME = VALUE, variables as a table.
fn listing(contents: &Contents) -> String {
    let of_attributes = contents.attributes.iter().map(|a| a.group.as_str());
    let all = of_attributes.chain(contents.variables.iter().map(|v| v.group.as_str()));
    let mut seen = std::collections::HashSet::new();
    let part = |group: &str| {
        let attributes: Vec<_> = contents.attributes.iter().filter(|a| a.group == group).collect();
        let variables: Vec<_> = contents.variables.iter().filter(|v| v.group == group).collect();
        let tables = [
            (!attributes.is_empty()).then(|| attribute_lines(&attributes)),
            (!variables.is_empty()).then(|| variable_lines(&variables)),
        ];
        format!(
            "{group}\n{}",
            tables.into_iter().flatten().collect::<Vec<_>>().join("\n")
        )
    };
    all.filter(|group| seen.insert(*group))
        .map(part)
        .collect::<Vec<_>>()
        .join("\n")
}

/// Units and descriptions, which are separate attributes in the file, follow their quantity.
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
    let rows = attributes.iter().filter(|a| !is_companion(a)).map(|a| {
        let unit = companion(&a.name, UNITS_SUFFIX).filter(|unit| unit != "1");
        let value: Vec<String> = std::iter::once(a.value.to_string()).chain(unit).collect();
        let meaning = companion(&a.name, LONG_NAME_SUFFIX).unwrap_or_default();
        let row = [a.name.clone(), value.join(" ")].into_iter();
        row.chain(described.then_some(meaning)).collect()
    });
    terminal::lines(&[], rows, [])
}

/// A short table; the JSON document has types and all digits.
fn variable_lines(variables: &[&VariableInfo]) -> String {
    let rows = variables.iter().map(|v| {
        let whole = v.kind.starts_with("int");
        let bound = |x: Option<f64>| match x {
            None => String::new(),
            Some(x) if whole => format!("{x}"),
            Some(x) => format!("{x:.3e}"),
        };
        vec![
            v.name.clone(),
            v.shape.iter().map(usize::to_string).collect::<Vec<_>>().join(" x "),
            v.units.clone().unwrap_or_default(),
            bound(v.min),
            bound(v.max),
            v.long_name.clone().unwrap_or_default(),
        ]
    });
    let header = ["variable", "rows", "units", "least", "largest", "description"];
    let mut lines = terminal::lines(&header, rows, [1, 3, 4]);
    for v in variables.iter().filter(|v| !v.flags.is_empty()) {
        let meanings: Vec<String> = v.flags.iter().map(|f| format!("{} {}", f.value, f.meaning)).collect();
        lines += &format!("{}: {}\n", v.name, meanings.join(", "));
    }
    lines
}
