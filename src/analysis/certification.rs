//! [`Certify`]: the certificate of a result by the ladder and the oracle, and the sensitivities of its events.

use super::certificate::{Certificate, CertifyError, certify_until};
use super::deadline::Deadline;
use super::exact::{LONGEST, ORACLE_DIGITS, settle};
use super::sensitivity::{CaseSensitivities, sensitivities};
use super::verdict::{CertifiedEvent, Verdict};
use crate::case::{Case, CaseError, CaseSource, ExactCase, Override, WrittenCase};
use crate::oracle::{OracleProgress, OracleSolution};
use crate::record::{Event, MemoryRecorder};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// A case where its numbers are as they were written.
#[derive(Debug, Clone)]
pub struct Written {
    /// The text.
    source: CaseSource,
    /// What changes its numbers.
    overrides: Vec<Override>,
    /// Where the source is a resolved case: the text that it was made of.
    given: Option<CaseSource>,
}

impl Written {
    /// Of a case that `resolved` gives with these overrides. `given` is the text that it was made of, if there is one: it counts
    /// where it alone gives the same case.
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

    /// The case with its numbers.
    fn case(&self) -> Result<WrittenCase, CaseError> {
        let case = WrittenCase::read(&self.source, &self.overrides)?;
        Ok(match &self.given {
            Some(given) => case.digits_of(given),
            None => case,
        })
    }

    /// The case without rounding.
    ///
    /// # Errors
    /// All problems that were found.
    pub fn exact(&self) -> Result<ExactCase, CaseError> {
        Case::exact(&self.source, &self.overrides)
    }
}

/// How the oracle is asked.
#[derive(Debug, Clone)]
struct Question<'a> {
    exact: &'a ExactCase,
    digits: u32,
    longest: Duration,
    /// Without its answer there is no certificate.
    required: bool,
}

/// A certification that is being prepared; [`Certify::start`] makes it.
///
/// ```
/// use stickslip::{Certify, Run};
/// use stickslip::case::{Case, CaseSource, Override};
/// use stickslip::record::MemoryRecorder;
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
    stop: Option<&'a AtomicBool>,
    progress: Option<Box<dyn FnMut(OracleProgress) + 'a>>,
}

/// What was found out about a result.
#[derive(Debug)]
pub struct Certified {
    /// Of the ladder; settled by the oracle where that was asked.
    pub certificate: Certificate,
    /// What the numbers of the case do to the events that are converged and to what the run comes to, if that was asked; or why
    /// that is not known.
    pub sensitivities: Option<Result<CaseSensitivities, String>>,
    /// The oracle's events, if it was asked.
    pub exact: Option<OracleSolution>,
    /// What was under way when it was interrupted: that part, and what would follow, is missing.
    pub interrupted: Option<Stage>,
}

/// A part of a certification that can be missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Reruns with one number of the case changed.
    Sensitivities,
    /// The exact events.
    Oracle,
}

impl<'a> Certify<'a> {
    /// Of a result of this case, which its own settings would give again.
    pub fn new(case: &'a Case) -> Self {
        Certify {
            case,
            written: None,
            oracle: None,
            deadline: Deadline::default(),
            stop: None,
            progress: None,
        }
    }

    /// Find out, too, what the numbers of the case, as it is written, do to the events and to what the run comes to, and what half
    /// a unit in the last digit of each does.
    pub fn sensitivities(mut self, written: &'a Written) -> Self {
        self.written = Some(written);
        self
    }

    /// Let the oracle have the last word, with so many true digits of every event time at least. `exact` is the case without
    /// rounding, as by [`Case::exact`].
    pub fn oracle(mut self, exact: &'a ExactCase, digits: u32) -> Self {
        self.oracle = Some(Question {
            exact,
            digits: digits.max(ORACLE_DIGITS),
            longest: LONGEST,
            required: true,
        });
        self
    }

    /// Let the oracle have the last word, with so many true digits of every event time, if it comes to it in that time. Else the
    /// certificate is that of the ladder, and says why.
    pub fn oracle_within(mut self, exact: &'a ExactCase, digits: u32, longest: Duration) -> Self {
        self.oracle = Some(Question {
            exact,
            digits,
            longest,
            required: false,
        });
        self
    }

    /// Be done by then. The ladder and the oracle fail for lack of time, the sensitivities are left out.
    pub fn until(mut self, deadline: Deadline) -> Self {
        self.deadline = deadline;
        self
    }

    /// Set from outside to end it.
    pub fn stop(mut self, stop: &'a AtomicBool) -> Self {
        self.stop = Some(stop);
        self
    }

    /// Told now and then how far the oracle is.
    pub fn progress(mut self, progress: impl FnMut(OracleProgress) + 'a) -> Self {
        self.progress = Some(Box::new(progress));
        self
    }

    /// Certifies a result.
    ///
    /// # Errors
    /// If the case with its own settings fails, the oracle does not solve it, or it was interrupted before there was a
    /// certificate.
    pub fn start(self, result: &MemoryRecorder) -> Result<Certified, CertifyError> {
        let Certify {
            case, deadline, stop, ..
        } = self;
        let stopped = || stop.is_some_and(|stop| stop.load(Ordering::Relaxed));
        let written = self.written.map(Written::case);
        let readable = written.as_ref().and_then(|written| written.as_ref().ok());
        let mut certified = Certified {
            certificate: certify_until(case, readable, result, &deadline, &stopped)?,
            sensitivities: None,
            exact: None,
            interrupted: None,
        };
        if let Some(question) = self.oracle {
            log::info!("the oracle begins");
            let mut progress = self.progress;
            let mut show = |now| {
                if let Some(progress) = &mut progress {
                    progress(now);
                }
            };
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
                &stopped,
                &mut show,
            );
            match settled {
                Ok(solution) => certified.exact = Some(solution),
                Err(CertifyError::Interrupted) => {
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

/// What the numbers of a case, as it is written, do to the events of a result, of which the first that are converged are certain.
fn of_written(
    written: &WrittenCase,
    certificate: &Certificate,
    events: &[Event],
    deadline: &Deadline,
    stopped: &(dyn Fn() -> bool + Sync),
) -> Result<CaseSensitivities, String> {
    let given_up = || stopped() || deadline.is_over();
    let explain = |why| deadline.explain(why, stopped());
    let converged = |event: &&CertifiedEvent| event.verdict == Verdict::Converged;
    let count = certificate.events.iter().take_while(converged).count();
    let known = Some(&certificate.linearised).filter(|known| !known.parameters.is_empty());
    let mut found = sensitivities(written, known, events, count, &given_up).map_err(explain)?;
    if let Some(result) = &mut found.result {
        result.without_reruns = result.without_reruns.take().map(explain);
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::certify;
    use crate::case::{Case, CaseSource, Override};
    use crate::run::Run;
    use std::time::Instant;

    #[test]
    fn property_after_the_deadline_there_are_no_reruns() {
        let settings = [
            "initial.speed=3",
            "actuation={profile=\"ramp\", force=2225, rise_time=0.02}",
            "perturbation=[{time=\"instability\", relative_velocity=1e-4}]",
            "output={end_time=0.4, interval=0.01}",
        ];
        let short = settings.map(|setting| Override::parse(setting).unwrap());
        let source = CaseSource::built_in("paper").unwrap();
        let case = Case::read(&source, &short).unwrap();
        let written = WrittenCase::read(&source, &short).unwrap();
        let mut result = MemoryRecorder::default();
        Run::new(&case).record(&mut result).start().unwrap();
        let certificate = certify(&case, &result, &|| false).unwrap();
        let found = |deadline: &Deadline, stop: bool| {
            of_written(&written, &certificate, &result.events, deadline, &|| stop)
                .unwrap()
                .result
                .unwrap()
        };
        let nothing = Deadline::after(Instant::now(), Some(0.0));
        let late = found(&nothing, false);
        let why = late.without_reruns.unwrap();
        assert!(why.contains("wall time of 0 s was over"), "{why}");
        assert!(late.rows.iter().all(|row| row.reruns.is_none()));
        assert!(late.rows.iter().any(|row| row.slope.is_some()));
        let stopped = found(&nothing, true);
        assert_eq!(stopped.without_reruns.as_deref(), Some("interrupted"));
        let whole = found(&Deadline::default(), false);
        assert_eq!(whole.without_reruns, None);
        assert!(whole.rows.iter().any(|row| row.reruns.is_some()));
        // The ladder has what is left, too.
        let late = Certify::new(&case).until(nothing).start(&result);
        assert!(
            matches!(&late, Err(CertifyError::Run(why)) if why.contains("wall time")),
            "{late:?}"
        );
    }
}
