//! The case that a result file holds, and its general form.

use super::CompareError;
use crate::case::{AnyCase, CaseSource, Motion};
use crate::model::trains::Trains;
use crate::results::ResultFile;
use std::borrow::Cow;
use std::path::Path;

/// That of a result file.
///
/// # Errors
/// Of the file, or of the case in it.
pub(super) fn saved_case(path: &Path, file: &ResultFile) -> Result<AnyCase, CompareError> {
    let source = CaseSource::result(path, file.resolved()?);
    AnyCase::read(&source, &[]).map_err(|source| CompareError::Case {
        path: path.to_owned(),
        source,
    })
}

/// What a case describes, in its general form.
pub(super) fn general(case: &AnyCase) -> Cow<'_, Trains> {
    match case {
        AnyCase::Brake(case) => Cow::Owned(Trains::from(&case.parameters)),
        AnyCase::Trains(case) => Cow::Borrowed(&case.parameters),
    }
}

/// What its coordinates are.
pub(super) fn motion(case: &AnyCase) -> Motion {
    match case {
        AnyCase::Brake(_) => Motion::Rotation,
        AnyCase::Trains(case) => case.motion,
    }
}
