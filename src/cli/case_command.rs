//! `stickslip case`.

use super::arguments::{CaseOptions, Common};
use super::input::bad_case;
use super::{CommandError, End, print, print_json, terminal};
use crate::calibrate::{CALIBRATIONS, CalibrationStudy};
use crate::case::{Case, CaseSource, Origin, TrainCase, builtin};
use crate::sweep::{STUDIES, Study, StudySource};
use serde::Serialize;

#[derive(Serialize)]
struct Listed {
    name: &'static str,
    title: String,
}

/// Prints a built-in case or study, or lists them.
pub(super) fn case(options: &CaseOptions, common: &Common) -> Result<End, CommandError> {
    let input = bad_case;
    if let Some(name) = &options.name {
        let source = match STUDIES.iter().chain(CALIBRATIONS).find(|study| study.name == name) {
            Some(study) => CaseSource {
                text: study.text.to_owned(),
                origin: Origin::BuiltIn(study.name.to_owned()),
            },
            None => CaseSource::built_in(name).map_err(input)?,
        };
        if common.json {
            print_json(&serde_json::json!({ "name": name, "text": source.text }))?;
        } else {
            print(&source.text)?;
        }
        return Ok(End::Done);
    }
    let mut listed = Vec::new();
    for built_in in builtin::all() {
        let source = CaseSource::built_in(built_in.name).map_err(input)?;
        let title = if TrainCase::is_one(&source, &[]) {
            TrainCase::parse(&source, &[]).map_err(input)?.title
        } else {
            Case::parse(&source, &[]).map_err(input)?.title
        };
        listed.push(Listed {
            name: built_in.name,
            title,
        });
    }
    for study in STUDIES {
        let source = StudySource::built_in(study.name).map_err(input)?;
        listed.push(Listed {
            name: study.name,
            title: Study::parse(source, &[]).map_err(input)?.title,
        });
    }
    for study in CALIBRATIONS {
        let source = CalibrationStudy::built_in(study.name).map_err(input)?;
        listed.push(Listed {
            name: study.name,
            title: CalibrationStudy::parse(source, &[]).map_err(input)?.runs.title,
        });
    }
    if common.json {
        print_json(&listed)?;
    } else {
        let mut table = terminal::table(&["case", "title"]);
        for case in &listed {
            table.add_row([case.name, &case.title]);
        }
        print(&terminal::show(&table))?;
    }
    Ok(End::Done)
}
