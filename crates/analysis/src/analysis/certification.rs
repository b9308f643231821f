//! [`Certify`]: certificate of a result by ladder and oracle, and sensitivities of its events.

use super::certificate::{Certificate, certify_until};
use super::exact::{LONGEST, ORACLE_DIGITS, settle};
use super::ladder::{CertifiedEvent, Deadline, Verdict};
use super::sensitivity::{CaseSensitivities, sensitivities};
use crate::error::Error;
use std::time::Duration;
use stickslip_case::{Case, CaseError, CaseSource, ExactCase, Override, WrittenCase};
use stickslip_oracle::OracleSolution;
use stickslip_system::record::{Event, MemoryRecorder};
use stickslip_system::watch::Watch;

/// Text of a case with its parameters as written.
#[derive(Debug, Clone)]
pub struct Written {
    source: CaseSource,
    overrides: Vec<Override>,
    /// Text before resolution, if it gives the same case.
    given: Option<CaseSource>,
}

impl Written {
    /// Text of `case`, from `resolved` and `overrides`. The original text `given` is used only if it gives the same
    /// case.
    pub fn new(case: &Case, given: Option<CaseSource>, resolved: &CaseSource, overrides: &[Override]) -> Written {
        let same = |text: &CaseSource| {
            let read = Case::read(text, &[]);
            read.is_ok_and(|read| {
                let read = &read;
                (&read.system, read.threshold) == (&case.system, case.threshold)
            })
        };
        match given {
            Some(text) if same(&text) => Written {
                source: text,
                overrides: Vec::new(),
                given: None,
            },
            given => Written {
                source: resolved.clone(),
                overrides: overrides.to_vec(),
                given,
            },
        }
    }

    fn case(&self) -> Result<WrittenCase, CaseError> {
        let case = WrittenCase::read(&self.source, &self.overrides)?;
        Ok(match &self.given {
            Some(given) => case.digits_of(given),
            None => case,
        })
    }

    /// Reads the case without rounding.
    ///
    /// # Errors
    /// All problems of the text.
    pub fn exact(&self) -> Result<ExactCase, CaseError> {
        Case::exact(&self.source, &self.overrides)
    }
}

#[derive(Debug, Clone)]
struct Question<'a> {
    exact: &'a ExactCase,
    digits: u32,
    longest: Duration,
    required: bool,
}

/// Builder of a certification; [`Certify::start`] computes it.
///
/// ```
/// use stickslip_analysis::Certify;
/// use stickslip_case::{Case, CaseSource, Override};
/// use stickslip_engine::Run;
/// use stickslip_system::record::MemoryRecorder;
///
/// let short = Override::parse("output.end_time=0.01")?;
/// let case = Case::read(&CaseSource::built_in("paper-si")?, &[short])?;
/// let mut result = MemoryRecorder::default();
/// Run::new(&case).record(&mut result).start()?;
/// let certified = Certify::new(&case).start(&result)?;
/// println!("{:?} digits", certified.certificate.least_digits());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use = "nothing is computed before `start`"]
pub struct Certify<'a> {
    case: &'a Case,
    written: Option<&'a Written>,
    oracle: Option<Question<'a>>,
    deadline: Deadline,
    watch: &'a dyn Watch,
}

/// Certificate and sensitivities of a result.
#[derive(Debug)]
pub struct Certified {
    /// Certificate of the ladder, overruled by the oracle if requested.
    pub certificate: Certificate,
    /// Sensitivities of the converged events and of the run's result, if requested, or the reason for their absence.
    pub sensitivities: Option<Result<CaseSensitivities, String>>,
    /// The oracle's events, if requested.
    pub exact: Option<OracleSolution>,
    /// Interrupted stage; its results and those of later stages are missing.
    pub interrupted: Option<Stage>,
}

/// Part of a certification that can be missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Reruns with one changed parameter.
    Sensitivities,
    /// Exact events.
    Oracle,
}

impl<'a> Certify<'a> {
    /// Certification of a result that the case's own settings reproduce.
    pub fn new(case: &'a Case) -> Self {
        Certify {
            case,
            written: None,
            oracle: None,
            deadline: Deadline::default(),
            watch: &(),
        }
    }

    /// Adds the sensitivities to each written parameter and the effect of half a unit in its last digit.
    pub fn sensitivities(mut self, written: &'a Written) -> Self {
        self.written = Some(written);
        self
    }

    /// Lets the oracle decide, with at least `digits` true digits in each event time. `exact`: see [`Case::exact`].
    pub fn oracle(mut self, exact: &'a ExactCase, digits: u32) -> Self {
        self.oracle = Some(Question {
            exact,
            digits: digits.max(ORACLE_DIGITS),
            longest: LONGEST,
            required: true,
        });
        self
    }

    /// Like [`Self::oracle`], within a time limit. If the oracle fails, the ladder's certificate stays with the
    /// reason.
    pub fn oracle_within(mut self, exact: &'a ExactCase, digits: u32, longest: Duration) -> Self {
        self.oracle = Some(Question {
            exact,
            digits,
            longest,
            required: false,
        });
        self
    }

    /// Sets a deadline. After it, ladder and oracle fail; sensitivities are left out.
    pub fn until(mut self, deadline: Deadline) -> Self {
        self.deadline = deadline;
        self
    }

    /// Sets the observer, which learns the oracle's progress and may interrupt the certification.
    pub fn watch(mut self, watch: &'a dyn Watch) -> Self {
        self.watch = watch;
        self
    }

    /// Certifies a result.
    ///
    /// # Errors
    /// The case with its own settings fails, the oracle finds no solution, or the certification is interrupted before
    /// the certificate is complete.
    pub fn start(self, result: &MemoryRecorder) -> Result<Certified, Error> {
        let Certify {
            case, deadline, watch, ..
        } = self;
        let stopped = || watch.stopped();
        let written = self.written.map(Written::case);
        let readable = written.as_ref().and_then(|written| written.as_ref().ok());
        let mut certified = Certified {
            certificate: certify_until(case, readable, result, &deadline, &stopped)?,
            sensitivities: None,
            exact: None,
            interrupted: None,
        };
        if let Some(question) = self.oracle {
            log::info!("the exact solver begins");
            let left = deadline.limit(None).map(Duration::try_from_secs_f64);
            let longest = left
                .and_then(Result::ok)
                .map_or(question.longest, |left| left.min(question.longest));
            let settled = settle(
                &mut certified.certificate,
                case,
                question.exact,
                &result.events,
                (question.digits, longest),
                watch,
            );
            match settled {
                Ok(solution) => certified.exact = Some(solution),
                Err(error) if error.is_interrupted() => {
                    certified.interrupted = Some(Stage::Oracle);
                    return Ok(certified);
                }
                Err(error) if question.required => return Err(error),
                Err(error) => certified.certificate.without_oracle = Some(error.to_string()),
            }
        }
        let certificate = &certified.certificate;
        certified.sensitivities = written.map(|written| {
            let written = written.map_err(|error| error.to_string())?;
            of_written(&written, certificate, &result.events, &deadline, &stopped)
        });
        certified.interrupted = stopped().then_some(Stage::Sensitivities);
        Ok(certified)
    }
}

/// Sensitivities of a result to the written parameters of its case. The leading converged events count as certain. If
/// time is too short for reruns, the slopes remain and `without_reruns` gives the reason.
///
/// # Errors
/// The reason why there are no sensitivities.
pub fn of_written(
    written: &WrittenCase,
    certificate: &Certificate,
    events: &[Event],
    deadline: &Deadline,
    stopped: &dyn Watch,
) -> Result<CaseSensitivities, String> {
    let given_up = || stopped.stopped() || deadline.is_over();
    let explain = |why| deadline.explain(why, stopped.stopped());
    let converged = |event: &&CertifiedEvent| event.verdict == Verdict::Converged;
    let count = certificate.events.iter().take_while(converged).count();
    let known = Some(&certificate.linearised).filter(|known| !known.parameters.is_empty());
    let mut found = sensitivities(written, known, events, count, &given_up).map_err(explain)?;
    if let Some(result) = &mut found.result {
        result.without_reruns = result.without_reruns.take().map(explain);
    }
    Ok(found)
}
