//! A benchmark set: problems with certified answers, stated without this program, and what its rules say of a submission.
//!
//! | file | what it is |
//! |---|---|
//! | `set` | `set.toml`: what the set asks for |
//! | `answer` | the files of a problem |
//! | `rows` | a candidate's rows as functions of time |
//! | `score` | the rules |

mod answer;
mod rows;
mod score;
mod set;

pub use score::{
    BenchmarkScore, ColumnScore, Deviation, EventScore, PeriodError, SamplesScore, Scores, SequenceScore, SummaryScore,
};
pub use set::{Budget, Combination, Extreme, Problem, ProblemColumn, ProblemSet, Summary, SummaryOf};

use super::CompareError;
use super::candidate::plain::Plain;
use crate::analysis::SavedRun;
use crate::case::{Case, CaseSource};
use answer::Answer;
pub(super) use score::Settings;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A problem that candidates are held against: its answer, and a run of its case.
#[derive(Debug)]
pub(super) struct BenchmarkProblem {
    pub folder: PathBuf,
    /// Its columns, and the names by which comparisons know them.
    pub columns: Vec<ProblemColumn>,
    answer: Answer,
    /// The run's file, which is gone with this.
    run: TempDir,
}

/// The name of the run's file.
const RUN: &str = "run.h5";

impl BenchmarkProblem {
    /// Reads the problem in `folder`, and runs its case.
    ///
    /// # Errors
    /// A folder that is no problem of a set, one of its files, or the run.
    pub fn open(folder: &Path) -> Result<BenchmarkProblem, CompareError> {
        let answer = Answer::read(folder)?;
        let parent = folder.canonicalize().map_err(CompareError::io(folder))?;
        let beside = parent.parent().unwrap_or(Path::new("/"));
        if !beside.join(set::SET).is_file() {
            let what = format!("there is no {} beside it, which says how its case is run", set::SET);
            return Err(CompareError::whole(folder, what, "leave the folders of a set together"));
        }
        let set = ProblemSet::open(beside)?;
        let name = &answer.statement.problem;
        let problem = set.problems.iter().find(|problem| problem.name == *name);
        let problem = problem.ok_or_else(|| {
            let what = format!("is of the problem {name}, which the set.toml beside it does not have");
            CompareError::whole(folder, what, "leave the folders of a set together")
        })?;
        let case = set.case_of(problem);
        let failed = |error: &dyn std::fmt::Display| {
            CompareError::whole(&case, format!("cannot be run: {error}"), "take the set again")
        };
        let read = CaseSource::file(&case).and_then(|source| Case::read(&source, &[]));
        let read = read.map_err(|error| failed(&error))?;
        let run = tempfile::tempdir().map_err(CompareError::io(&std::env::temp_dir()))?;
        SavedRun::new(&read, &run.path().join(RUN))
            .start()
            .map_err(|error| failed(&error))?;
        Ok(BenchmarkProblem {
            folder: folder.to_owned(),
            columns: problem.columns.clone(),
            answer,
            run,
        })
    }

    /// Whether the candidate at `path` states its events.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn is_stated(&self, path: &Path) -> Result<bool, CompareError> {
        Plain::states_events(path)
    }

    /// What the rules say of the candidate at `path`.
    ///
    /// # Errors
    /// If the file cannot be read, or is no table of the problem.
    pub fn score(&self, path: &Path, settings: Settings<'_>) -> Result<BenchmarkScore, CompareError> {
        self.answer.score(path, settings)
    }

    /// The file of the run.
    pub fn run(&self) -> PathBuf {
        self.run.path().join(RUN)
    }
}
