//! The case that a result file holds, of a brake or of two trains.

use super::CompareError;
use crate::case::{AnyCase, CaseSource};
use crate::results::ResultFile;
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
