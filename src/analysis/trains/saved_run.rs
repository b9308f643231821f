//! A run of two trains into its result file.

use super::TrainSummary;
use super::attractor::Recurrence;
use super::witness::{TrainWitness, witness};
use crate::case::TrainCase;
use crate::record::{EventKind, NoRecorder, Recorder};
use crate::results::{Header, Overwrite, ResultError, ResultWriter, SavedRows, Status};
use crate::run::Run;
use crate::simulation::{Progress, RunFailure, RunReport};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// A run of trains without a file: its report, which has the events, and what it comes to.
///
/// # Errors
/// Those of [`Run::start`].
pub fn summarised(
    case: &TrainCase,
    control: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<(RunReport, TrainSummary), Box<RunFailure>> {
    let (trains, threshold) = (&case.parameters, case.threshold.unwrap_or(0.0));
    let mut nobody = NoRecorder;
    let mut recurrence = Recurrence::new(trains, &mut nobody);
    let report = Run::of_trains(trains, threshold, &case.solver, &case.output)
        .record(&mut recurrence)
        .control(control)
        .start()?;
    let attractor = recurrence.attractor(trains, threshold);
    let summary = TrainSummary::new(&report, attractor, case.threshold, recurrence.end());
    Ok((report, summary))
}

/// What a run of trains gives: its report, what makes its summary of that, and times (s) and kinds of its events.
pub(crate) type Recorded = (
    Result<RunReport, Box<RunFailure>>,
    Box<dyn FnOnce(&RunReport) -> TrainSummary>,
    Vec<(f64, EventKind)>,
);

/// A run of trains into a recorder. Its report keeps the events, too, if it is to.
pub(crate) fn recorded(
    case: &TrainCase,
    recorder: &mut dyn Recorder,
    keeps_events: bool,
    control: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Recorded {
    let threshold = case.threshold.unwrap_or(0.0);
    let trains = &case.parameters;
    let mut recurrence = Recurrence::new(trains, recorder);
    if keeps_events {
        recurrence.keep_events();
    }
    let result = Run::of_trains(trains, threshold, &case.solver, &case.output)
        .record(&mut recurrence)
        .control(control)
        .start();
    let attractor = recurrence.attractor(trains, threshold);
    let (end, stick_threshold) = (recurrence.end(), case.threshold);
    let summary = move |report: &RunReport| TrainSummary::new(report, attractor, stick_threshold, end);
    (result, Box::new(summary), recurrence.into_events())
}

/// A run of trains into a result file that is being prepared; [`SavedTrainRun::start`] computes it. The counterpart of
/// [`SavedRun`](crate::SavedRun).
#[must_use = "nothing is computed before `start`"]
pub struct SavedTrainRun<'a> {
    case: &'a TrainCase,
    path: &'a Path,
    header: Header,
    overwrite: Overwrite,
    inputs: &'a [PathBuf],
    keeps_events: bool,
    witness: bool,
    stop: Option<&'a AtomicBool>,
    control: Option<Box<dyn FnMut(Progress) -> ControlFlow<()> + 'a>>,
}

/// What a run into a file came to.
#[derive(Debug)]
pub struct SavedTrainReport {
    /// The result, or the partial file of a run that is not complete.
    pub file: PathBuf,
    /// As the run ended; that of the file, unless there is something [`Self::unsaved`].
    pub status: Status,
    /// Of what was computed, be it saved or not.
    pub report: RunReport,
    /// The same in numbers.
    pub summary: TrainSummary,
    /// What another method makes of the case, if that was asked for; none beside a run that is not complete.
    pub witness: Option<TrainWitness>,
    /// Why the run failed; its report is [`Self::report`].
    pub failure: Option<Box<RunFailure>>,
    /// Why the file could not be written to its end: then it is marked interrupted.
    pub unsaved: Option<ResultError>,
    /// Rows that the file had for certain before its end was written.
    pub saved: SavedRows,
    /// Of the run, s.
    pub wall_time: f64,
}

impl<'a> SavedTrainRun<'a> {
    /// The run that a case describes, into a file that replaces no other but a result of this program.
    pub fn new(case: &'a TrainCase, path: &'a Path) -> Self {
        let mut header = Header::of_trains(case, String::new());
        header.case_text.clone_from(&header.resolved);
        SavedTrainRun {
            case,
            path,
            header,
            overwrite: Overwrite::OwnResults,
            inputs: &[],
            keeps_events: false,
            witness: false,
            stop: None,
            control: None,
        }
    }

    /// The case as it was given, for the file; else it holds the resolved one twice.
    pub fn text(mut self, text: &str) -> Self {
        text.clone_into(&mut self.header.case_text);
        self
    }

    /// Another title than the case's.
    pub fn title(mut self, title: String) -> Self {
        self.header.title = title;
        self
    }

    /// Keep the events in the report, too.
    pub fn keep_events(mut self) -> Self {
        self.keeps_events = true;
        self
    }

    /// What may be replaced.
    pub fn overwrite(mut self, overwrite: Overwrite) -> Self {
        self.overwrite = overwrite;
        self
    }

    /// Files that the case was read from: they are never replaced.
    pub fn inputs(mut self, inputs: &'a [PathBuf]) -> Self {
        self.inputs = inputs;
        self
    }

    /// Ask another method, after the run.
    pub fn witness(mut self, wanted: bool) -> Self {
        self.witness = wanted;
        self
    }

    /// Set from outside to end the run, and its witness, in good order.
    pub fn stop(mut self, stop: &'a AtomicBool) -> Self {
        self.stop = Some(stop);
        self
    }

    /// What is asked now and then while the run goes on; `Break` ends it in good order.
    pub fn control(mut self, control: impl FnMut(Progress) -> ControlFlow<()> + 'a) -> Self {
        self.control = Some(Box::new(control));
        self
    }

    /// Computes the run, to its end or as far as it comes; what was computed is in the file.
    ///
    /// # Errors
    /// If the file cannot be created, or another is there that may not be replaced. A run that fails, and a file that
    /// cannot be written to its end, are part of the report.
    pub fn start(self) -> Result<SavedTrainReport, ResultError> {
        let SavedTrainRun { case, stop, .. } = self;
        let mut writer = ResultWriter::create(self.path, self.overwrite, self.inputs, &self.header)?;
        let partial = writer.partial().to_owned();
        let stopped = || stop.is_some_and(|stop| stop.load(Ordering::Relaxed));
        let mut control = self.control;
        let mut asked = |progress: Progress| {
            if let Some(control) = &mut control {
                control(progress)?;
            }
            match stopped() {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            }
        };
        let (result, summary, events) = recorded(case, &mut writer, self.keeps_events, &mut asked);
        let (report, failure) = match result {
            Ok(report) => (report, None),
            Err(mut failure) => (std::mem::take(&mut failure.report), Some(failure)),
        };
        let summary = summary(&report);
        let status = match &failure {
            Some(error) => Status::Failed(error.to_string()),
            None if report.interrupted => Status::Interrupted,
            None => Status::Complete,
        };
        let wall_time = writer.elapsed();
        // Beside a complete run only, and never a reason for it to fail.
        let witness = (status == Status::Complete && self.witness)
            .then(|| witness(case, &events, &report.work, &stopped))
            .flatten();
        let saved = writer.saved();
        let said = witness
            .as_ref()
            .map_or(Ok(()), |witness| writer.witness(&witness.attributes()));
        let finished = said.and_then(|()| writer.finish(status.clone(), &summary.table(case.motion), wall_time));
        let (file, unsaved) = match finished {
            Ok(file) => (file, None),
            Err(error) => (partial, Some(error)),
        };
        Ok(SavedTrainReport {
            file,
            status,
            report,
            summary,
            witness,
            failure,
            unsaved,
            saved,
            wall_time,
        })
    }
}
