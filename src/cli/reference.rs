//! The argument that names a reference.

use std::path::Path;
use stickslip_analysis::SavedRun;
use stickslip_compare::{CompareError, Reference};

/// Opens a result file, or runs the case in the folder of a benchmark problem.
pub(super) fn open_reference(path: &Path) -> Result<Reference, CompareError> {
    if !path.is_dir() {
        return Reference::open(path);
    }
    Reference::of_problem(path, |case, file| {
        let run = SavedRun::new(case, file).start();
        run.map(drop).map_err(|error| error.to_string())
    })
}
