//! Built-in cases and studies, with the commands that accept them.

use super::CommandError;
use serde::Serialize;
use stickslip_analysis::analysis::work_precision;
use stickslip_analysis::calibrate::{CALIBRATIONS, CalibrationStudy};
use stickslip_analysis::continuation::{CONTINUATIONS, ContinuationStudy};
use stickslip_analysis::sweep::{STUDIES, Study, StudySource};
use stickslip_case::{Case, CaseSource, builtin};

/// An entry of `case --list`.
#[derive(Serialize)]
pub(super) struct ListedCase {
    pub name: &'static str,
    /// Kind of case or study.
    pub kind: &'static str,
    pub command: &'static str,
    pub title: String,
}

pub(super) fn listed() -> Result<Vec<ListedCase>, CommandError> {
    let mut listed = Vec::new();
    let mut add = |name, kind, command, title| {
        listed.push(ListedCase {
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
        let title = Study::parse(source, &[])?.head.title;
        add(study.name, "study", "sweep", title);
    }
    for study in CALIBRATIONS {
        let source = StudySource::text(study.name, study.text);
        let title = CalibrationStudy::parse(source, &[])?.runs.head.title;
        add(study.name, "study", "calibrate", title);
    }
    for study in CONTINUATIONS {
        let source = StudySource::text(study.name, study.text);
        let title = ContinuationStudy::parse(source, &[])?.head.title;
        add(study.name, "study", "continue", title);
    }
    for study in work_precision::STUDIES {
        let source = StudySource::text(study.name, study.text);
        let title = work_precision::PrecisionStudy::parse(source)?.head.title;
        add(study.name, "study", "work-precision", title);
    }
    Ok(listed)
}
