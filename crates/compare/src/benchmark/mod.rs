//! A benchmark set: problems with certified answers, stated without this program. Its `check.py` scores solutions.

mod set;

pub use set::{Budget, Combination, Extreme, Problem, ProblemColumn, ProblemSet, ProblemSummary, SummaryOf};

use super::CompareError;
use super::candidate::{Candidate, Mapping, TimeOffset};
use std::path::{Path, PathBuf};
use stickslip_case::{Case, CaseSource};
use stickslip_system::quote::in_shell;
use tempfile::TempDir;

#[derive(Debug)]
pub(super) struct BenchmarkProblem {
    pub folder: PathBuf,
    pub columns: Vec<ProblemColumn>,
    /// The folder of the run; dropping it deletes the folder.
    run: TempDir,
}

const RUN: &str = "run.h5";

impl BenchmarkProblem {
    /// Reads the problem in `folder`. `integrate` runs its case into a result file at the given path.
    pub fn open(
        folder: &Path,
        integrate: impl FnOnce(&Case, &Path) -> Result<(), String>,
    ) -> Result<BenchmarkProblem, CompareError> {
        let path = folder.canonicalize().map_err(CompareError::io(folder))?;
        let beside = path.parent().unwrap_or(Path::new("/"));
        let not_a_problem = |what: &str| {
            let remedy =
                "give a result file, or the folder of a problem in its set, such as benchmarks/09-belt-coulomb";
            CompareError::whole(folder, what, remedy)
        };
        if !beside.join(set::SET).is_file() {
            return Err(not_a_problem(
                "a folder without a set.toml beside it, and no problem of a benchmark set",
            ));
        }
        let set = ProblemSet::open(beside)?;
        let name = path.file_name().unwrap_or_default();
        let problem = set.problems.iter().find(|problem| *problem.name == *name);
        let problem = problem.ok_or_else(|| not_a_problem("no problem in the set.toml beside it"))?;
        let case = set.case_of(problem);
        let failed = |error: &dyn std::fmt::Display| {
            CompareError::whole(&case, format!("cannot be run: {error}"), "take the set again")
        };
        let read = CaseSource::file(&case).and_then(|source| Case::read(&source, &[]));
        let read = read.map_err(|error| failed(&error))?;
        let run = tempfile::tempdir().map_err(CompareError::temporary)?;
        integrate(&read, &run.path().join(RUN)).map_err(|error| failed(&error))?;
        Ok(BenchmarkProblem {
            folder: folder.to_owned(),
            columns: problem.columns.clone(),
            run,
        })
    }

    /// The command of the set's checker, for a candidate that it can read: CSV with its names of the columns, or events.
    pub fn score_command(&self, path: &Path, candidate: &Candidate, mapping: &Mapping) -> Option<String> {
        let known = |name: &String| {
            ["time", "relative_velocity"].contains(&name.as_str()) || self.columns.iter().any(|c| c.name == *name)
        };
        let is_text = || {
            path.extension()
                .is_none_or(|extension| extension != "npz" && extension != "h5")
        };
        let is_read = match candidate.format {
            "CSV" => candidate.columns().iter().all(known),
            "events table" => is_text(),
            _ => false,
        };
        let is_plain = mapping.kinds.is_empty() && matches!(mapping.time_offset, TimeOffset::None);
        if !is_read || !is_plain {
            return None;
        }
        let folder = &self.folder;
        let checker = match folder.file_name() {
            Some(_) => folder.with_file_name("check.py"),
            None => folder.join("../check.py"),
        };
        let mut command = "python3".to_owned();
        for path in [&checker, folder, path] {
            command += &format!(" {}", in_shell(&path.to_string_lossy()));
        }
        if let Some(events) = &mapping.event_file {
            command += &format!(" --events {}", in_shell(&events.to_string_lossy()));
        }
        if let Some(threshold) = mapping.velocity_tolerance {
            command += &format!(" --threshold {threshold:e}");
        }
        if let Some(hysteresis) = mapping.hysteresis {
            command += &format!(" --hysteresis {hysteresis}");
        }
        Some(command)
    }

    pub fn run(&self) -> PathBuf {
        self.run.path().join(RUN)
    }
}
