//! [`SavedCertificate`]: the certificate of a case or of a result file, written into a copy of the result.

use super::advice::{DIGITS_OF_DOUBLE, remedy, shortfall};
use super::bands::{Compared, columns, compared_output};
use super::certificate::Verdict;
use super::certification::{Certified, Certify, Stage, Written};
use super::certify_report::{CertifyReport, least_digits};
use super::ladder::Deadline;
use super::run::SavedRun;
use super::warning::Warning;
use crate::earlier::{spare_certificate, spare_run};
use crate::error::{Error, ErrorKind};
use crate::given::GivenCase;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use stickslip_case::{Case, CaseSource, Origin, Override, builtin};
use stickslip_files::{
    FileKind, Overwrite, Reservation, ResultError, ResultFile, Status, partial_path, write_certified,
};
use stickslip_oracle as oracle;
use stickslip_system::quote::in_shell;
use stickslip_system::record::{Channels, MemoryRecorder, State};
use stickslip_system::watch::Watch;

const ROWS_AT_A_TIME: usize = 65_536;

/// Limits of the exact solution if it was not requested: digits, and the time after which the ladder decides.
const UNASKED: (u32, Duration) = (18, Duration::from_secs(600));

/// Whether the exact solution decides without a request. For a run that slows down by itself the ladder has its own
/// verdict, down to the effect of rounding.
fn oracle_decides(case: &Case) -> bool {
    !case.stops()
}

/// Requirements of a certificate.
#[derive(Debug, Clone, Copy, Default)]
pub struct CertificateRequest {
    /// Digits required in the time of every event.
    pub digits: Option<u32>,
    /// Whether the exact solver is required.
    pub oracle: bool,
    /// Files that may be replaced.
    pub overwrite: Overwrite,
}

/// A certification into a file. [`SavedCertificate::prepare`] reserves the file, and [`SavedCertificate::start`] computes.
#[derive(Debug)]
pub struct SavedCertificate<'a> {
    given: &'a GivenCase,
    changes: &'a [Override],
    case: Case,
    target: &'a Path,
    place: Reservation,
    request: CertificateRequest,
    clock: Instant,
}

/// A certified result in its file.
#[derive(Debug)]
pub struct CertifiedFile<'a> {
    saving: &'a SavedCertificate<'a>,
    /// Certificate, sensitivities and exact solution.
    pub certified: Certified,
    deadline: Deadline,
}

impl<'a> SavedCertificate<'a> {
    /// Reads the case with its changes and reserves `target`. The wall time of the case begins.
    ///
    /// # Errors
    /// The digits are more than there can be; the case is wrong; `target` cannot be written, is written by another
    /// process, or holds what the certificate must not replace.
    pub fn prepare(
        given: &'a GivenCase,
        changes: &'a [Override],
        target: &'a Path,
        request: CertificateRequest,
    ) -> Result<Self, Error> {
        let clock = Instant::now();
        check_digits(request)?;
        let case = Case::read(&given.source, changes).map_err(|error| without_case(error.into()))?;
        let place = Reservation::take(target, request.overwrite, &given.files)?;
        spare_run(target, request.overwrite, FileKind::CertifiedRun, &case.resolved())?;
        let by_oracle = request.oracle || oracle_decides(&case);
        spare_certificate(target, request.overwrite, by_oracle, None)?;
        Ok(SavedCertificate {
            given,
            changes,
            case,
            target,
            place,
            request,
            clock,
        })
    }

    /// The case.
    pub fn case(&self) -> &Case {
        &self.case
    }

    /// Runs the case, unless it is that of a result, certifies the result, and writes a copy of it with its certificate.
    ///
    /// # Errors
    /// The run, the ladder or a requested exact solution fails; the file cannot be written; there is a better
    /// certificate. After an interruption before the certificate is complete, the message says when it came.
    pub fn start(&'a self, watch: &dyn Watch) -> Result<CertifiedFile<'a>, Error> {
        let interrupted =
            |when: &str| Error::new(ErrorKind::Interrupted, format!("{when}; no certificate was written"));
        let (case, overwrite) = (&self.case, self.request.overwrite);
        let obtained = self.obtain(watch)?;
        let obtained = obtained.ok_or_else(|| interrupted("during the run that was to be certified"))?;
        let deadline = Deadline::after(self.clock, case.solver.max_wall_time);
        let certified = self
            .examine(&obtained.record, deadline, watch)
            .map_err(|error| match watch.stopped() {
                true => interrupted("during the ladder of independent runs"),
                false => error,
            })?;
        let exact_digits = certified.exact.as_ref().map(least_digits);
        let digits = exact_digits.or(certified.certificate.least_digits()).unwrap_or(0);
        spare_certificate(self.target, overwrite, certified.certificate.by_oracle, Some(digits))?;
        write_certified(&obtained.path, &self.place, &certified.additions(case))?;
        Ok(CertifiedFile {
            saving: self,
            certified,
            deadline,
        })
    }

    /// The given result file, or a run of the case next to the target; `None` if interrupted.
    fn obtain(&self, watch: &dyn Watch) -> Result<Option<Obtained>, Error> {
        let (given, case) = (self.given, &self.case);
        if let Origin::Result(path) = &given.source.origin {
            let file = ResultFile::open(path)?;
            if *file.status() != Status::Complete {
                return Err(Error::input(format!(
                    "{}: the run is {}, and only a complete one can be certified; repeat it with stickslip run {}",
                    path.display(),
                    file.status().name(),
                    path.display()
                )));
            }
            return Ok(Some(Obtained {
                path: path.clone(),
                record: read_back(&file, case)?,
                _scratch: None,
            }));
        }
        let stem = self.target.file_stem().unwrap_or_default().to_string_lossy();
        let path = self
            .target
            .with_file_name(format!(".{stem}.{}.uncertified.h5", std::process::id()));
        let scratch = Scratch(path.clone());
        let saved = SavedRun::new(case, &path).text(&given.text).inputs(&given.files);
        let saved = saved.changed(given.changed(self.changes)).watch(watch).start()?;
        if let Some(failure) = saved.run.failure {
            return Err(Error::computation(failure));
        }
        if saved.run.report.interrupted {
            return Ok(None);
        }
        // The user did not name this file.
        let failed = |error: ResultError| Error::computation(error);
        saved.unsaved.map_or(Ok(()), Err).map_err(failed)?;
        let record = ResultFile::open(&path).and_then(|file| read_back(&file, case));
        Ok(Some(Obtained {
            record: record.map_err(failed)?,
            path,
            _scratch: Some(scratch),
        }))
    }

    /// Computes the ladder, the exact solution if required, and the sensitivities. A later interruption keeps the ladder.
    fn examine(&self, record: &MemoryRecorder, deadline: Deadline, watch: &dyn Watch) -> Result<Certified, Error> {
        let (given, case) = (self.given, &self.case);
        let text = matches!(given.source.origin, Origin::Result(_)).then(|| CaseSource {
            text: given.text.clone(),
            origin: given.source.origin.clone(),
        });
        let written = Written::new(case, text, &given.source, self.changes);
        let wanted = self.request.oracle || oracle_decides(case);
        let exact = wanted.then(|| written.exact()).transpose()?;
        let digits = self.request.digits.unwrap_or(0);
        let certify = Certify::new(case).sensitivities(&written).until(deadline).watch(watch);
        match &exact {
            Some(exact) if oracle_decides(case) => certify.oracle_within(exact, digits.max(UNASKED.0), UNASKED.1),
            Some(exact) => certify.oracle(exact, digits),
            None => certify,
        }
        .start(record)
    }
}

impl CertifiedFile<'_> {
    /// The case.
    pub fn case(&self) -> &Case {
        &self.saving.case
    }

    /// Whether the wall time of the case is over.
    pub fn is_late(&self) -> bool {
        self.deadline.is_over()
    }

    /// When an interruption came after the certificate was complete, and what the file lacks.
    pub fn interrupted(&self) -> Option<String> {
        let (when, without) = match self.certified.interrupted? {
            Stage::Sensitivities => ("during the reruns for the sensitivities", "without these"),
            Stage::Oracle => ("while the exact solver computed", "without exact events"),
        };
        let kept = self.saving.target.display();
        Some(format!("{when}; {kept} has the certificate, {without}"))
    }

    /// The report on the certificate.
    pub fn report(&self) -> CertifyReport<'_> {
        let SavedCertificate { given, target, .. } = self.saving;
        let file = target.display().to_string();
        let mut report = CertifyReport::new(&self.saving.case, &self.certified, given.source.label(), file);
        report.changed = given.changed(self.saving.changes);
        report.shows_exact = self.saving.request.oracle;
        report.seconds = self.saving.clock.elapsed().as_secs_f64();
        report
    }

    fn by_ladder(&self) -> Option<String> {
        let why = self.certified.certificate.without_oracle.as_ref()?;
        Some(format!("the uncertainties are those of the ladder alone: {why}"))
    }

    /// Warnings beyond the verdict, which reports an onset that noise determines.
    pub fn warnings(&self) -> Vec<String> {
        let is_said = |warning: &&Warning| matches!(warning, Warning::NoiseDetermined { .. });
        let others = self.certified.certificate.warnings.iter();
        let others = others.filter(|warning| !is_said(warning)).map(Warning::to_string);
        others.chain(self.by_ladder()).collect()
    }

    /// Reasons to doubt the certificate: all warnings, or else a verdict other than converged.
    pub fn doubts(&self) -> Vec<String> {
        let certificate = &self.certified.certificate;
        let warnings = certificate.warnings.iter().map(Warning::to_string);
        let mut doubts: Vec<String> = warnings.chain(self.by_ladder().map(|why| why + ".")).collect();
        if certificate.verdict != Verdict::Converged && doubts.is_empty() {
            doubts.push(format!("the verdict on the events is {}.", certificate.verdict.name()));
        }
        doubts
    }

    /// Why required digits are missing, with settings that give more; or why events that the exact solver decides are not
    /// certified. Without the digits, runs with other settings are tried until `stop`.
    pub fn shortfall(&self, stop: &dyn Watch) -> Option<String> {
        let (case, certificate) = (&self.saving.case, &self.certified.certificate);
        let command = match self.saving.given.source.origin {
            Origin::Result(_) => of_case(self.saving.given),
            _ => String::new(),
        };
        let given_up = || stop.stopped() || self.is_late();
        let exact = self.certified.exact.as_ref();
        let missing = |digits| shortfall((case, &command), certificate, exact, digits, &given_up);
        let uncertain = oracle_decides(case) && certificate.verdict != Verdict::Converged;
        let missing = self.saving.request.digits.and_then(missing);
        missing.or_else(|| uncertain.then(|| self.not_certified()))
    }

    fn not_certified(&self) -> String {
        let certificate = &self.certified.certificate;
        let from = "from the one marked sequence-differs on";
        let unfinished = certificate.ladder.iter().find_map(|rung| rung.failure.as_ref());
        match unfinished.filter(|_| !certificate.by_oracle) {
            Some(failure) => {
                format!(
                    "the events {from} are not certified, as not every run of the ladder came to its end: {failure}"
                )
            }
            None => format!(
                "the events of the run are not those of the exact solution {from}; {}",
                remedy(certificate)
            ),
        }
    }
}

fn check_digits(request: CertificateRequest) -> Result<(), Error> {
    let of_oracle = *oracle::DIGITS.end();
    let (most, remedy) = match request.oracle {
        true => (
            of_oracle,
            "the exact solver computes with no more, and the growth of perturbations takes some of them".to_owned(),
        ),
        false => (
            DIGITS_OF_DOUBLE,
            format!("a double holds no more; for a table with up to {of_oracle} digits add --oracle, the exact solver"),
        ),
    };
    match request.digits.filter(|digits| !(1..=most).contains(digits)) {
        Some(digits) => Err(Error::input(format!(
            "--digits {digits}: from 1 to {most} digits can be asked for; {remedy}"
        ))),
        None => Ok(()),
    }
}

/// The command that certifies the case of a result file, to which settings are added.
fn of_case(given: &GivenCase) -> String {
    let all = builtin::all();
    let built_in = all.iter().find(|built_in| built_in.text == given.text);
    let mut command = format!("stickslip certify {}", built_in.map_or("CASE", |case| case.name));
    for change in given.changed(&[]) {
        command += &format!(" --set {}", in_shell(&change.replacen(" = ", "=", 1)));
    }
    command
}

/// The error of a result file without its case, with the remedy.
pub fn without_case(mut error: Error) -> Error {
    if error.message.contains("/input") {
        error.message +=
            ". A result is certified by runs of its case, which this file no longer holds: certify the case itself";
    }
    error
}

struct Obtained {
    path: PathBuf,
    record: MemoryRecorder,
    /// Removes the file if it was created here.
    _scratch: Option<Scratch>,
}

/// A temporary result. It is removed with its partial file, however the certification ends.
struct Scratch(PathBuf);

impl Drop for Scratch {
    fn drop(&mut self) {
        for path in [&self.0, &partial_path(&self.0)] {
            let _ = std::fs::remove_file(path);
        }
    }
}

fn read_back(file: &ResultFile, case: &Case) -> Result<MemoryRecorder, ResultError> {
    let mut compared = Compared::new(&compared_output(&case.output));
    let further: Vec<String> = columns(case)
        .skip(State::COUNT + Channels::COUNT)
        .map(|(name, _)| name)
        .collect();
    let mut record = MemoryRecorder::default();
    let names = ["before", "after"].map(|side| further.iter().map(move |name| format!("{name}_{side}")));
    let at_events = names.into_iter().flatten().map(|name| file.event_column(&name));
    let at_events = at_events.collect::<Result<Vec<Vec<f64>>, _>>()?;
    for (index, event) in file.events()?.iter().enumerate() {
        let of_event: Vec<f64> = at_events.iter().map(|column| column[index]).collect();
        record.push_event(event, &of_event);
    }
    let count = file.sample_count()?;
    for from in (0..count).step_by(ROWS_AT_A_TIME) {
        let range = from..count.min(from + ROWS_AT_A_TIME);
        let samples = file.finite_samples(range.clone())?;
        let beyond = further.iter().map(|name| file.column(name, range.clone()));
        let beyond = beyond.collect::<Result<Vec<_>, _>>()?;
        let picked = samples.iter().enumerate().filter(|(_, row)| compared.takes(row.time));
        for (index, sample) in picked {
            let of_row: Vec<f64> = beyond.iter().map(|column| column[index]).collect();
            record.push(sample, &of_row);
        }
    }
    Ok(record)
}
