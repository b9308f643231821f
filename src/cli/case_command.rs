//! `stickslip case`: the text of a case, and the keys of cases.

use super::arguments::{CaseOptions, Common};
use super::builtins::{self, ListedCase};
use super::{CommandEnd, print, print_json, show};
use crate::Error;
use crate::report::{Page, PageTable, Report};
use serde::Serialize;
use stickslip_analysis::analysis::work_precision;
use stickslip_analysis::calibrate::CALIBRATIONS;
use stickslip_analysis::continuation::CONTINUATIONS;
use stickslip_analysis::sweep::STUDIES;
use stickslip_case::{CaseSource, Origin};

#[derive(Serialize)]
struct CaseText<'a> {
    name: &'a str,
    text: &'a str,
}

/// Built-in cases and studies.
impl Report for Vec<ListedCase> {
    fn page(&self) -> Page {
        let table = PageTable::of(self)
            .text("name", |case| case.name)
            .text("for stickslip", |case| case.command)
            .text("title", |case| case.title.clone())
            .done();
        Page::default()
            .with(table)
            .with("`stickslip case NAME` prints the text of a case or a study, to start from")
    }
}

pub(super) fn case(options: &CaseOptions, common: &Common) -> Result<CommandEnd, Error> {
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
            let text = &source.text;
            print_json(&CaseText { name, text })?;
        } else {
            print(&source.text)?;
        }
        return Ok(CommandEnd::Done);
    }
    show(common, &builtins::listed()?)?;
    Ok(CommandEnd::Done)
}
