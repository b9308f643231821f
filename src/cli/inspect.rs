//! `stickslip inspect`.

use super::arguments::{Common, InspectOptions};
use super::{CommandError, End, print, print_json, terminal};
use crate::results::{AttributeValue, ResultError, ResultFile};

/// Lists what a result file holds.
pub(super) fn inspect(options: &InspectOptions, common: &Common) -> Result<End, CommandError> {
    let input = |error: ResultError| CommandError::Input(error.to_string());
    let contents = ResultFile::open(&options.file)
        .and_then(|file| file.contents())
        .map_err(input)?;
    if common.json {
        print_json(&contents)?;
        return Ok(End::Done);
    }
    let mut attributes = terminal::table(&["group", "attribute", "value"]);
    for a in &contents.attributes {
        let value = match &a.value {
            AttributeValue::Text(text) => text.clone(),
            AttributeValue::Integer(n) => n.to_string(),
            AttributeValue::Number(x) => x.to_string(),
            AttributeValue::Integers(list) => format!("{list:?}"),
            AttributeValue::Numbers(list) => format!("{list:?}"),
        };
        attributes.add_row([a.group.clone(), a.name.clone(), value]);
    }
    let mut variables = terminal::table(&["variable", "type", "shape", "units", "least", "largest", "description"]);
    for v in &contents.variables {
        let shape = v.shape.iter().map(usize::to_string).collect::<Vec<_>>().join(" x ");
        let bound = |x: Option<f64>| x.map_or_else(String::new, |x| format!("{x:.6e}"));
        let meanings: Vec<String> = v.flags.iter().map(|f| format!("{} {}", f.value, f.meaning)).collect();
        let mut description = v.long_name.clone().unwrap_or_default();
        if !meanings.is_empty() {
            description += &format!(" ({})", meanings.join(", "));
        }
        variables.add_row([
            format!("{}/{}", v.group.trim_end_matches('/'), v.name),
            v.kind.clone(),
            shape,
            v.units.clone().unwrap_or_default(),
            bound(v.min),
            bound(v.max),
            description,
        ]);
    }
    print(&format!("{attributes}\n\n{variables}\n"))?;
    Ok(End::Done)
}
