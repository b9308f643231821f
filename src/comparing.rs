//! The inputs of a comparison: the reference, and how the columns of its candidates are read.

use crate::Error;
use std::path::{Path, PathBuf};
use stickslip_analysis::SavedRun;
use stickslip_compare::{CompareError, Mapping, Reference};
use stickslip_files::{ResultFile, is_hdf5};

/// How the columns of a candidate are read, as texts. A missing option leaves the default of [`Mapping`].
#[derive(Debug, Clone, Copy, Default)]
pub struct MappingOptions<'a> {
    /// Mapping file.
    pub map: Option<&'a Path>,
    /// Single columns, `CHANNEL=[-]COLUMN[:UNIT]`, which override those of the file.
    pub columns: &'a [String],
    /// Table of the candidate's events.
    pub events: Option<&'a Path>,
    /// Time that is added to the candidate's times, s or with a unit, or `auto`.
    pub time_offset: Option<&'a str>,
    /// Relative velocity that counts as zero, rad/s (m/s in translation) or with a unit.
    pub velocity_tolerance: Option<&'a str>,
    /// Number of tolerances beyond which a stick ends.
    pub hysteresis: Option<f64>,
    /// Whether causes are left out.
    pub quick: bool,
    /// Wall time of the search for causes, s or with a unit.
    pub max_wall_time: Option<&'a str>,
}

impl MappingOptions<'_> {
    /// The mapping, with the names of a reference.
    ///
    /// # Errors
    /// The mapping file cannot be read; an option is malformed or impossible.
    pub fn of(&self, reference: &Reference) -> Result<Mapping, CompareError> {
        let mut mapping = match self.map {
            Some(path) => reference.mapping().with_file(path)?,
            None => reference.mapping(),
        };
        self.columns.iter().try_for_each(|column| mapping.add_option(column))?;
        if let Some(path) = self.events {
            mapping.event_file = Some(path.to_owned());
        }
        if let Some(text) = self.velocity_tolerance {
            mapping.set_tolerance(text)?;
        }
        if let Some(text) = self.time_offset {
            mapping.set_time_offset(text)?;
        }
        mapping.quick = self.quick;
        if let Some(text) = self.max_wall_time {
            mapping.set_max_wall_time(text)?;
        }
        if let Some(factor) = self.hysteresis {
            let set = mapping.set_hysteresis(factor);
            set.map_err(|what| CompareError::Option(format!("--hysteresis: {what}")))?;
        }
        Ok(mapping)
    }
}

/// Opens a result file, or runs the case in the folder of a benchmark problem.
///
/// # Errors
/// The file is no result of this program, or is damaged; the folder is no problem, or its run fails.
pub fn open_reference(path: &Path) -> Result<Reference, CompareError> {
    if !path.is_dir() {
        return Reference::open(path);
    }
    Reference::of_problem(path, |case, file| {
        let run = SavedRun::new(case, file).start();
        run.map(drop).map_err(|error| error.to_string())
    })
}

/// Refuses a table in place of the reference if the only candidate is a result.
///
/// # Errors
/// The two are exchanged.
pub fn refuse_swapped(reference: &Path, candidates: &[PathBuf]) -> Result<(), Error> {
    match candidates {
        [candidate] if reference.is_file() && !is_hdf5(reference) && ResultFile::open(candidate).is_ok() => {
            let (table, result) = (reference.display(), candidate.display());
            let why = format!(
                "no result of this program, but {result} is; the reference comes first: stickslip compare {result} {table}"
            );
            Err(Error::of_file(reference, why))
        }
        _ => Ok(()),
    }
}
