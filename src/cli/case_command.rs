//! `stickslip case`.

use super::arguments::{CaseOptions, Common};
use super::input::bad_case;
use super::{CommandError, End, print, print_json, terminal};
use crate::analysis::work_precision;
use crate::calibrate::{CALIBRATIONS, CalibrationStudy};
use crate::case::{Case, CaseSource, Origin, TrainCase, builtin};
use crate::sweep::{STUDIES, Study, StudySource};
use serde::Serialize;

#[derive(Serialize)]
struct Listed {
    name: &'static str,
    /// What it is.
    kind: &'static str,
    /// The command that takes it.
    command: &'static str,
    title: String,
}

/// Prints a built-in case or study, or lists them.
pub(super) fn case(options: &CaseOptions, common: &Common) -> Result<End, CommandError> {
    let input = bad_case;
    if let Some(name) = &options.name {
        let studies = STUDIES.iter().chain(CALIBRATIONS).chain(work_precision::STUDIES);
        let source = match studies.into_iter().find(|study| study.name == name) {
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
            kind: "case",
            command: "run",
            title,
        });
    }
    for study in STUDIES {
        let source = StudySource::built_in(study.name).map_err(input)?;
        listed.push(Listed {
            name: study.name,
            kind: "study",
            command: "sweep",
            title: Study::parse(source, &[]).map_err(input)?.title,
        });
    }
    for study in CALIBRATIONS {
        let source = CalibrationStudy::built_in(study.name).map_err(input)?;
        listed.push(Listed {
            name: study.name,
            kind: "study",
            command: "calibrate",
            title: CalibrationStudy::parse(source, &[]).map_err(input)?.runs.title,
        });
    }
    for study in work_precision::STUDIES {
        listed.push(Listed {
            name: study.name,
            kind: "study",
            command: "work-precision",
            title: work_precision::Study::find(study.name).map_err(input)?.title,
        });
    }
    if common.json {
        print_json(&listed)?;
    } else {
        let mut table = terminal::table(&["name", "for stickslip", "title"]);
        for case in &listed {
            table.add_row([case.name, case.command, &case.title]);
        }
        let hint = "`stickslip case NAME` prints the text of a case or a study, to start from";
        print(&format!("{}\n{hint}\n", terminal::show(&table)))?;
    }
    Ok(End::Done)
}
