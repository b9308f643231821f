//! `stickslip case`: the text of a built-in case or study, and a list of them with the commands that accept them.

use super::arguments::{CaseOptions, Common};
use super::{CommandEnd, print, print_json, show, tell};
use crate::Error;
use crate::output::{Output, Product};
use crate::report::{FilesReport, ListedKey, Page, PageTable, Report, listed_keys};
use serde::Serialize;
use stickslip_analysis::analysis::work_precision::{self, PrecisionStudy};
use stickslip_analysis::calibrate::{CALIBRATIONS, CalibrationStudy};
use stickslip_analysis::continuation::{CONTINUATIONS, ContinuationStudy};
use stickslip_analysis::sweep::{STUDIES, Study, StudySource};
use stickslip_case::builtin::{self, BuiltIn};
use stickslip_case::{Case, CaseError, CaseSource, Origin, suggest};
use stickslip_system::quote::shown;

/// Built-in studies: command, studies, title of one.
pub(super) type StudiesOfCommand = (
    &'static str,
    &'static [BuiltIn],
    fn(StudySource) -> Result<String, CaseError>,
);

pub(super) const OF_COMMANDS: [StudiesOfCommand; 4] = [
    ("sweep", STUDIES, |source| Ok(Study::parse(source, &[])?.head.title)),
    ("calibrate", CALIBRATIONS, |source| {
        Ok(CalibrationStudy::parse(source, &[])?.runs.head.title)
    }),
    ("continue", CONTINUATIONS, |source| {
        Ok(ContinuationStudy::parse(source, &[])?.head.title)
    }),
    ("work-precision", work_precision::STUDIES, |source| {
        Ok(PrecisionStudy::parse(source)?.head.title)
    }),
];

/// An entry of `case --list`.
#[derive(Serialize)]
pub(super) struct ListedCase {
    pub name: &'static str,
    /// Kind of case or study.
    pub kind: &'static str,
    pub command: &'static str,
    pub title: String,
}

pub(super) fn listed() -> Result<Vec<ListedCase>, Error> {
    let entry = |name, kind, command, title| ListedCase {
        name,
        kind,
        command,
        title,
    };
    let mut listed = Vec::new();
    for case in builtin::all() {
        let title = Case::read(&CaseSource::built_in(case.name)?, &[])?.title;
        listed.push(entry(case.name, "case", "run", title));
    }
    for (command, studies, title) in OF_COMMANDS {
        for study in studies {
            let title = title(StudySource::text(study.name, study.text))?;
            listed.push(entry(study.name, "study", command, title));
        }
    }
    Ok(listed)
}

/// Built-in cases and studies.
impl Report for Vec<ListedCase> {
    fn page(&self) -> Page {
        let table = PageTable::of(self)
            .text("name", |case| case.name)
            .text("for stickslip", |case| case.command)
            .text("title", |case| &case.title)
            .done();
        let hint = "`stickslip case NAME` prints the text of a case or a study, to start from";
        Page::default().with(table).with(hint)
    }
}

/// The keys that contain a word.
///
/// # Errors
/// There is none.
fn keys_with(word: &str) -> Result<Vec<ListedKey>, Error> {
    let mut keys = listed_keys();
    let names: Vec<String> = keys.iter().map(|key| key.key.clone()).collect();
    keys.retain(|key| key.contains(word));
    if !keys.is_empty() {
        return Ok(keys);
    }
    let parts = names
        .iter()
        .flat_map(|name| name.split('.'))
        .chain(names.iter().map(String::as_str));
    let hint = match suggest(word, parts) {
        Some(close) => format!("did you mean {close}?"),
        None => "`stickslip case --keys` lists all".to_owned(),
    };
    Err(Error::input(format!(
        "no key of a case or a study contains \"{}\"; {hint}",
        shown(word)
    )))
}

#[derive(Serialize)]
struct CaseText<'a> {
    name: &'a str,
    text: &'a str,
}

fn unknown(name: &str) -> Error {
    let cases: Vec<&str> = builtin::all().iter().map(|case| case.name).collect();
    let studies = OF_COMMANDS.into_iter().flat_map(|(_, studies, _)| studies);
    let studies: Vec<&str> = studies.map(|study| study.name).collect();
    let close = suggest(name, cases.iter().chain(&studies).copied());
    let hint = close.map_or_else(String::new, |close| format!(" (did you mean {close}?)"));
    Error::input(format!(
        "there is no built-in case or study \"{}\"{hint}; the cases are {}; the studies are {}",
        shown(name),
        cases.join(", "),
        studies.join(", ")
    ))
}

pub(super) fn case(options: &CaseOptions, common: &Common) -> Result<CommandEnd, Error> {
    if let Some(word) = &options.keys {
        return show(common, &keys_with(word)?);
    }
    let Some(name) = &options.name else {
        return show(common, &listed()?);
    };
    let mut studies = OF_COMMANDS.into_iter().flat_map(|(_, studies, _)| studies);
    let source = match studies.find(|study| study.name == name) {
        Some(study) => CaseSource {
            text: study.text.to_owned(),
            origin: Origin::BuiltIn(study.name.to_owned()),
        },
        None => CaseSource::built_in(name).map_err(|_| unknown(name))?,
    };
    let text = &source.text;
    if let Some(path) = &options.output {
        let output = Output::new(path, Product::Case("-o"), &[], options.force)?;
        output.write(&[text.as_bytes()])?;
        let files = [path];
        return tell(
            common,
            &FilesReport {
                files: &files,
                folder: None,
            },
        );
    }
    match common.json {
        true => print_json(&CaseText { name, text })?,
        false => print(text)?,
    }
    Ok(CommandEnd::Done)
}
