//! `stickslip case`: the text of a case, and the keys of cases.

use super::arguments::{CaseOptions, Common};
use super::{CommandEnd, CommandError, builtins, print, print_json, terminal};
use stickslip_analysis::analysis::work_precision;
use stickslip_analysis::calibrate::CALIBRATIONS;
use stickslip_analysis::continuation::CONTINUATIONS;
use stickslip_analysis::sweep::STUDIES;
use stickslip_case::{CaseSource, Origin};

pub(super) fn case(options: &CaseOptions, common: &Common) -> Result<CommandEnd, CommandError> {
    if let Some(name) = &options.name {
        let studies = STUDIES
            .iter()
            .chain(CALIBRATIONS)
            .chain(CONTINUATIONS)
            .chain(work_precision::STUDIES);
        let source = match studies.into_iter().find(|study| study.name == name) {
            Some(study) => CaseSource {
                text: study.text.to_owned(),
                origin: Origin::BuiltIn(study.name.to_owned()),
            },
            None => CaseSource::built_in(name)?,
        };
        if common.json {
            print_json(&serde_json::json!({ "name": name, "text": source.text }))?;
        } else {
            print(&source.text)?;
        }
        return Ok(CommandEnd::Done);
    }
    let listed = builtins::listed()?;
    if common.json {
        print_json(&listed)?;
    } else {
        let rows = listed
            .iter()
            .map(|case| [case.name, case.command, &case.title].map(str::to_owned).to_vec());
        let table = terminal::lines(&["name", "for stickslip", "title"], rows, []);
        let hint = "`stickslip case NAME` prints the text of a case or a study, to start from";
        print(&format!("{table}\n{hint}\n"))?;
    }
    Ok(CommandEnd::Done)
}
