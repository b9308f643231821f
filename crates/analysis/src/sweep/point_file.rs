//! A result file for each point.

use super::runner::{IntegrateError, Integrated};
use super::study::Study;
use crate::analysis::SavedRun;
use std::path::{Path, PathBuf};
use stickslip_case::Case;
use stickslip_engine::hybrid::RunError;
use stickslip_system::watch::Watch;

/// Folder of the runs: `map.runs` next to `map.h5`.
pub(super) fn folder_of_runs(path: &Path) -> PathBuf {
    path.with_extension("runs")
}

/// Integrates a point into its result file `FOLDER/NUMBER.h5`.
pub(super) fn into_a_file(
    folder: &Path,
    study: &Study,
    number: u64,
    case: &Case,
    watch: &dyn Watch,
) -> Result<Integrated, IntegrateError> {
    std::fs::create_dir_all(folder).map_err(|error| {
        IntegrateError::Storage(format!(
            "{}: cannot be created: {error}; check its folder",
            folder.display()
        ))
    })?;
    let path = folder.join(format!("{number:06}.h5"));
    let title = format!("{}, point {number}", study.title);
    let saved = SavedRun::new(case, &path)
        .title(title)
        .inputs(&study.files)
        .keep_events()
        .watch(watch)
        .start()
        .map_err(|error| IntegrateError::Storage(error.to_string()))?;
    match (saved.unsaved, saved.run.failure) {
        (Some(error), _) => Err(IntegrateError::Storage(error.to_string())),
        (None, Some(failure)) => Err(match &failure.error {
            RunError::Observer(error) => IntegrateError::Storage(error.to_string()),
            _ => IntegrateError::Run(failure),
        }),
        (None, None) => Ok(Integrated::new(saved.run.report, &saved.run.summary)),
    }
}
