//! All that is found out about one result: the ladder, what moves its final stick, and the oracle's last word.

use super::certificate::{Certificate, CertifyError, certify_until};
use super::deadline::Deadline;
use super::exact::settle;
use super::sensitivity::{Sensitivities, of_certificate};
use crate::case::Case;
use crate::model::ExactParameters;
use crate::oracle::{OracleProgress, OracleSolution};
use crate::record::MemoryRecorder;
use std::sync::atomic::{AtomicBool, Ordering};

/// A certification that is being prepared; [`Certify::start`] makes it.
///
/// ```
/// use stickslip::{Certify, Run};
/// use stickslip::case::{Case, CaseSource, Override};
/// use stickslip::record::MemoryRecorder;
///
/// let short = Override::parse("output.end_time=0.01")?;
/// let case = Case::parse(&CaseSource::built_in("paper-si")?, &[short])?;
/// let mut result = MemoryRecorder::default();
/// Run::new(&case).record(&mut result).start()?;
/// let certified = Certify::new(&case).start(&result)?;
/// println!("{:?} digits", certified.certificate.least_digits());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use = "nothing is computed before `start`"]
pub struct Certify<'a> {
    case: &'a Case,
    half_last_digits: Option<&'a [(String, f64)]>,
    oracle: Option<(&'a ExactParameters, u32)>,
    deadline: Deadline,
    stop: Option<&'a AtomicBool>,
    progress: Option<Box<dyn FnMut(OracleProgress) + 'a>>,
}

/// What was found out about a result.
#[derive(Debug)]
pub struct Certified {
    /// Of the ladder; settled by the oracle where that was asked.
    pub certificate: Certificate,
    /// What moves the final stick, if that was asked and there is a final stick that is converged.
    pub final_stick: Option<Sensitivities>,
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
            half_last_digits: None,
            oracle: None,
            deadline: Deadline::default(),
            stop: None,
            progress: None,
        }
    }

    /// Find out, too, what moves the final stick, and what half a unit in the last digit of each number does to it: key and
    /// half unit in SI, as by [`Case::half_last_digits`].
    pub fn sensitivities(mut self, half_last_digits: &'a [(String, f64)]) -> Self {
        self.half_last_digits = Some(half_last_digits);
        self
    }

    /// Let the oracle have the last word, with so many true digits of every event time at least. `exact` are the case's own
    /// parameters without rounding, as by [`Case::exact_parameters`].
    pub fn oracle(mut self, exact: &'a ExactParameters, digits: u32) -> Self {
        self.oracle = Some((exact, digits));
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
        let certificate = certify_until(case, result, &deadline, &stopped)?;
        let final_stick = self
            .half_last_digits
            .and_then(|digits| of_final_stick(case, digits, &certificate, &deadline, &stopped));
        let mut certified = Certified {
            certificate,
            final_stick,
            exact: None,
            interrupted: None,
        };
        if stopped() {
            certified.interrupted = Some(Stage::Sensitivities);
            return Ok(certified);
        }
        let Some((exact, digits)) = self.oracle else {
            return Ok(certified);
        };
        log::info!("the oracle begins");
        let mut progress = self.progress;
        let mut show = |now| {
            if let Some(progress) = &mut progress {
                progress(now);
            }
        };
        let mut limited = case.clone();
        limited.solver.max_wall_time = deadline.limit(case.solver.max_wall_time);
        let certificate = &mut certified.certificate;
        match settle(
            certificate,
            &limited,
            exact,
            &result.events,
            digits,
            &stopped,
            &mut show,
        ) {
            Err(CertifyError::Interrupted) => certified.interrupted = Some(Stage::Oracle),
            solution => certified.exact = Some(solution?),
        }
        Ok(certified)
    }
}

/// What moves the final stick, with slopes alone once the deadline is over.
fn of_final_stick(
    case: &Case,
    half_last_digits: &[(String, f64)],
    certificate: &Certificate,
    deadline: &Deadline,
    stopped: &(dyn Fn() -> bool + Sync),
) -> Option<Sensitivities> {
    let given_up = || stopped() || deadline.is_over();
    let mut found = of_certificate(case, half_last_digits, certificate, &given_up)?;
    let why = found.without_reruns.take();
    found.without_reruns = why.map(|why| deadline.explain(why, stopped()));
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::certify;
    use crate::case::{CaseSource, Override};
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
        let case = Case::parse(&source, &short).unwrap();
        let halves = Case::half_last_digits(&source, &short).unwrap();
        let mut result = MemoryRecorder::default();
        Run::new(&case).record(&mut result).start().unwrap();
        let certificate = certify(&case, &result, &|| false).unwrap();
        let found = |deadline: &Deadline, stop: bool| of_final_stick(&case, &halves, &certificate, deadline, &|| stop);
        let nothing = Deadline::after(Instant::now(), Some(0.0));
        let late = found(&nothing, false).unwrap();
        let why = late.without_reruns.unwrap();
        assert!(why.contains("wall time of 0 s was over"), "{why}");
        assert!(late.rows.iter().all(|row| row.reruns.is_none()));
        assert!(late.rows.iter().any(|row| row.slope.is_some()));
        let stopped = found(&nothing, true).unwrap();
        assert_eq!(stopped.without_reruns.as_deref(), Some("interrupted"));
        let whole = found(&Deadline::default(), false).unwrap();
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
