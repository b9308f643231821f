//! The built-in cases and studies, with the commands that take them.

use super::CommandError;
use crate::analysis::work_precision;
use crate::calibrate::{CALIBRATIONS, CalibrationStudy};
use crate::case::{Case, CaseSource, builtin};
use crate::continuation::{CONTINUATIONS, ContinuationStudy};
use crate::sweep::{STUDIES, Study, StudySource};
use serde::Serialize;

/// One of them, as `case --list` says it.
#[derive(Serialize)]
pub(super) struct Listed {
    pub name: &'static str,
    /// What it is.
    pub kind: &'static str,
    /// The command that takes it.
    pub command: &'static str,
    pub title: String,
}

/// Every one of them: cases, then studies.
pub(super) fn listed() -> Result<Vec<Listed>, CommandError> {
    let mut listed = Vec::new();
    let mut add = |name, kind, command, title| {
        listed.push(Listed {
            name,
            kind,
            command,
            title,
        });
    };
    for case in builtin::all() {
        let source = CaseSource::built_in(case.name)?;
        let read = Case::read(&source, &[])?;
        add(case.name, "case", "run", read.title);
    }
    for study in STUDIES {
        let source = StudySource::text(study.name, study.text);
        let title = Study::parse(source, &[])?.title;
        add(study.name, "study", "sweep", title);
    }
    for study in CALIBRATIONS {
        let source = StudySource::text(study.name, study.text);
        let title = CalibrationStudy::parse(source, &[])?.runs.title;
        add(study.name, "study", "calibrate", title);
    }
    for study in CONTINUATIONS {
        let source = StudySource::text(study.name, study.text);
        let title = ContinuationStudy::parse(source, &[])?.title;
        add(study.name, "study", "continue", title);
    }
    for study in work_precision::STUDIES {
        let source = StudySource::text(study.name, study.text);
        let title = work_precision::Study::parse(source)?.title;
        add(study.name, "study", "work-precision", title);
    }
    Ok(listed)
}
