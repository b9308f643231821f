//! What half a unit in the last digit of each number of a case does to a result of its run, such as the final stick: by the
//! slope, and by runs.
//!
//! A slope tells of small changes. Half a unit of the last printed digit is often none: it can move the stop by seconds, past
//! a kick whose time is held, or across a graze. So the case is run again with each number half a unit lower and higher, by
//! `series`, which takes milliseconds.

use super::Summary;
use super::certificate::Certificate;
use super::deadline::INTERRUPTED;
use super::linearised::{Linearised, ParameterName};
use crate::case::{Case, CaseError};
use crate::model::KickTime;
use crate::record::EventKind;
use crate::results::SensitivityTables;
use crate::run::Run;
use crate::simulation::{Method, OutputOptions, Progress, RunReport, SolverOptions};
use crate::workers::over_processors;
use serde::Serialize;
use std::ops::ControlFlow;

/// A number counts as nonlinear where slope and rerun differ by more than this share of the larger of the two shifts.
pub(crate) const NONLINEAR_SHARE: f64 = 0.1;

/// Differences of shifts below this, s, are the error of the reruns: `series` is within 1e-12 s of exact events.
const RERUN_ERROR: f64 = 1e-12;

/// Relative tolerance of the reruns.
const RTOL: f64 = 1e-12;

/// What a run of the case may take for reruns to be made: questions of its control between two events, each after 256 steps
/// or some 2 ms, and events. A rerun may take so many times as much. Counted in steps, so that the same case always has the
/// same reruns.
const MOST_QUESTIONS: usize = 200;
const MOST_EVENTS: usize = 10_000;
const RERUN_FACTOR: usize = 4;

/// What a rerun came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// The same sequence of events.
    SameEvents,
    /// Another sequence, with a final stick.
    OtherEvents,
    /// A sequence whose onset is amplified rounding: its final stick is known as well as such an onset is.
    NoiseDetermined,
    /// Something follows the last stick, or there is none.
    NoFinalStick,
    /// The value is none that a case can have.
    Invalid,
    /// The run failed.
    Failed,
    /// The run would take too long.
    TooLong,
    /// The motion does not repeat itself any more.
    NoPeriod,
}

impl Outcome {
    /// All of them, in the order of their codes.
    pub const ALL: [Outcome; 8] = [
        Outcome::SameEvents,
        Outcome::OtherEvents,
        Outcome::NoiseDetermined,
        Outcome::NoFinalStick,
        Outcome::Invalid,
        Outcome::Failed,
        Outcome::TooLong,
        Outcome::NoPeriod,
    ];

    /// The code in result files.
    pub fn code(self) -> i8 {
        self as i8
    }

    /// The name in result files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Outcome::SameEvents => "same-events",
            Outcome::OtherEvents => "other-events",
            Outcome::NoiseDetermined => "noise-determined",
            Outcome::NoFinalStick => "no-final-stick",
            Outcome::Invalid => "invalid",
            Outcome::Failed => "failed",
            Outcome::TooLong => "too-long",
            Outcome::NoPeriod => "no-period",
        }
    }
}

/// A result of a run that its numbers move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Affected {
    /// When the stick begins in which the run ends.
    FinalStick,
    /// The period of the motion that two trains come to.
    AttractorPeriod,
    /// When the last event is that is certain.
    LastEvent,
}

impl Affected {
    /// The name in result files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Affected::FinalStick => "final-stick",
            Affected::AttractorPeriod => "attractor-period",
            Affected::LastEvent => "last-event",
        }
    }

    /// In words, with its article.
    pub fn words(self) -> &'static str {
        match self {
            Affected::FinalStick => "the final stick",
            Affected::AttractorPeriod => "the period of the attractor",
            Affected::LastEvent => "the last event",
        }
    }

    /// What a positive shift of it says.
    pub fn shift(self) -> &'static str {
        match self {
            Affected::FinalStick => "how much later the final stick is",
            Affected::AttractorPeriod => "how much longer the period of the attractor is",
            Affected::LastEvent => "how much later the last event is",
        }
    }

    /// What a rerun can come to.
    pub fn outcomes(self) -> Vec<Outcome> {
        let possible = |outcome: &Outcome| match outcome {
            Outcome::NoPeriod => self == Affected::AttractorPeriod,
            Outcome::NoFinalStick => self == Affected::FinalStick,
            _ => true,
        };
        Outcome::ALL.into_iter().filter(possible).collect()
    }
}

/// The case run again with one number changed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rerun {
    /// The number, in the unit of the parameter.
    pub value: f64,
    /// What came of it.
    pub outcome: Outcome,
    /// By how much the result comes later, or is longer, s; `None` without one.
    pub shift: Option<f64>,
    /// Number of sticks; `None` where there was no run to its end.
    pub sticks: Option<usize>,
    /// What there is to say but for the shift; empty with the same events.
    pub remark: String,
}

/// What one number does to a result.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivity {
    /// The number.
    pub parameter: ParameterName,
    /// d(result)/d(parameter), s per unit; `None` where there is no derivative.
    pub slope: Option<f64>,
    /// Half a unit in its last written digit, in its unit; `None` if it is not written as a number.
    pub half_last_digit: Option<f64>,
    /// Half a unit lower and half a unit higher; `None` if they were not made.
    pub reruns: Option<[Rerun; 2]>,
}

impl Sensitivity {
    /// The shift by half a unit upwards, by the slope, s.
    pub fn predicted(&self) -> Option<f64> {
        Some(self.slope? * self.half_last_digit?)
    }

    /// Whether slope and rerun differ on either side by more than `NONLINEAR_SHARE`, or a rerun has other events; `None`
    /// if there is nothing to hold against the slope.
    pub fn nonlinear(&self) -> Option<bool> {
        let predicted = self.predicted();
        let sides = self.reruns.as_ref()?.iter().zip([-1.0, 1.0]);
        sides
            .filter_map(|(rerun, side)| match (rerun.outcome, rerun.shift) {
                (Outcome::SameEvents, Some(shift)) => {
                    let predicted = side * predicted?;
                    let difference = (shift - predicted).abs();
                    Some(difference > (NONLINEAR_SHARE * shift.abs().max(predicted.abs())).max(RERUN_ERROR))
                }
                (Outcome::OtherEvents | Outcome::NoiseDetermined | Outcome::NoFinalStick | Outcome::NoPeriod, _) => {
                    Some(true)
                }
                _ => None,
            })
            .reduce(|one, other| one || other)
    }

    /// The largest shift that is known, s: of the reruns, else by the slope.
    pub fn largest(&self) -> f64 {
        let reruns = self.reruns.iter().flatten().filter_map(|rerun| rerun.shift);
        let largest = reruns.map(f64::abs).reduce(f64::max);
        largest.or(self.predicted().map(f64::abs)).unwrap_or(0.0)
    }
}

/// What the numbers of a case do to a result of its run.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivities {
    /// Which one.
    pub of: Affected,
    /// When it is, or how long, s.
    pub time: f64,
    /// One for each physical number of the case, in its order.
    pub rows: Vec<Sensitivity>,
    /// Why there are slopes only, if so.
    pub without_reruns: Option<String>,
    /// What a changed number leaves in its place, and what it takes along; empty without a kick.
    pub held: String,
}

/// What half a unit of the last written digit of each number of the case does to the final stick, by the slopes of
/// `linearised`, which is this case's, and by reruns over all processors. `half_last_digits` are those of
/// [`Case::half_last_digits`], by path. `None` if the run has no final stick. `stop` is asked now and then: once it says so
/// the slopes come without reruns.
pub fn of_final_stick(
    case: &Case,
    half_last_digits: &[(String, f64)],
    linearised: &Linearised,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<Sensitivities> {
    let last = linearised.events.iter().rfind(|event| event.kind.in_event_sequence())?;
    if last.kind != EventKind::Stick {
        return None;
    }
    let half = |path: &str| Some(half_last_digits.iter().find(|half| half.0 == path)?.1);
    let mut rows: Vec<Sensitivity> = linearised
        .parameters
        .iter()
        .zip(&last.by_parameter)
        .map(|(parameter, slope)| Sensitivity {
            slope: slope.is_finite().then_some(*slope),
            half_last_digit: half(&parameter.path),
            parameter: parameter.clone(),
            reruns: None,
        })
        .collect();
    let word: Vec<EventKind> = linearised.events.iter().map(|event| event.kind).collect();
    let without_reruns = match Baseline::new(case, &in_event_sequence(word), stop) {
        Ok(baseline) => baseline.rerun(&mut rows, stop),
        Err(reason) => Some(reason),
    };
    Some(Sensitivities {
        of: Affected::FinalStick,
        time: last.time,
        rows,
        without_reruns,
        held: held(case),
    })
}

/// [`of_final_stick`] of a certified result, if its final stick is converged.
pub(crate) fn of_certificate(
    case: &Case,
    half_last_digits: &[(String, f64)],
    certificate: &Certificate,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<Sensitivities> {
    let last = certificate.in_event_sequence().last()?;
    let linear = certificate
        .linearised
        .events
        .iter()
        .rfind(|event| event.kind.in_event_sequence())?;
    let known = last.uncertainty.is_finite() && last.kind == linear.kind.name();
    known.then(|| of_final_stick(case, half_last_digits, &certificate.linearised, stop))?
}

pub(super) fn in_event_sequence(kinds: impl IntoIterator<Item = EventKind>) -> Vec<EventKind> {
    kinds.into_iter().filter(|kind| kind.in_event_sequence()).collect()
}

/// What a change of another number does to the kicks.
fn held(case: &Case) -> String {
    let kicks: Vec<String> = case
        .parameters
        .perturbations
        .iter()
        .map(|kick| {
            let size = kick.relative_velocity;
            match kick.time {
                KickTime::At(time) => format!(
                    "the kick of {size:e} rad/s stays at {time} s, whatever the changed number does to the loss of \
                     stability and to the stop"
                ),
                KickTime::Instability => format!("the kick of {size:e} rad/s goes along with the loss of stability"),
            }
        })
        .collect();
    match kicks.is_empty() {
        true => String::new(),
        false => format!("One number is changed at a time: {}.", kicks.join("; ")),
    }
}

/// What half a last digit of each of so many parameters does to a result; nothing is known without one.
pub(crate) fn columns(found: Option<&Sensitivities>, of: Affected, parameters: usize) -> SensitivityTables {
    let row = |column: usize| found.map(|found| &found.rows[column]);
    let numbers = |of: &dyn Fn(&Sensitivity) -> Option<f64>| -> Vec<f64> {
        (0..parameters)
            .map(|column| row(column).and_then(of).unwrap_or(f64::NAN))
            .collect()
    };
    let rerun = |column: usize, side: usize| -> Option<&Rerun> { Some(&row(column)?.reruns.as_ref()?[side]) };
    let codes = |side: usize| -> Vec<i8> {
        let code = |column| rerun(column, side).map_or(SensitivityTables::NONE, |rerun| rerun.outcome.code());
        (0..parameters).map(code).collect()
    };
    let sticks = |side: usize| -> Vec<i64> {
        let count = |column| {
            rerun(column, side)
                .and_then(|rerun| rerun.sticks)
                .map_or(-1, |sticks| sticks as i64)
        };
        (0..parameters).map(count).collect()
    };
    let shifts = |side: usize| numbers(&|row| row.reruns.as_ref()?[side].shift);
    let nonlinear = |column| match row(column).and_then(Sensitivity::nonlinear) {
        Some(nonlinear) => i8::from(nonlinear),
        None => SensitivityTables::NONE,
    };
    SensitivityTables {
        half_last_digit: numbers(&|row| row.half_last_digit),
        shift: [shifts(0), shifts(1)],
        outcome: [codes(0), codes(1)],
        outcomes: of.outcomes().iter().map(|o| (o.code(), o.name())).collect(),
        shifts: of.shift(),
        sticks: [sticks(0), sticks(1)],
        nonlinear: (0..parameters).map(nonlinear).collect(),
        texts: vec![
            ("held", found.map_or_else(String::new, |found| found.held.clone())),
            (
                "without_reruns",
                found.map_or_else(
                    || format!("no {} that is converged", of.words().trim_start_matches("the ")),
                    |found| found.without_reruns.clone().unwrap_or_default(),
                ),
            ),
        ],
    }
}

/// The case as it is, by the method of the reruns.
struct Baseline {
    case: Case,
    word: Vec<EventKind>,
    /// s.
    final_stick: f64,
    smooth: bool,
    /// A kick comes before the first stick.
    kicked: bool,
}

/// Why a run has no report.
enum NoReport {
    Failed(String),
    TooLong,
    Interrupted,
}

impl Baseline {
    /// Runs the case; an error says why it cannot stand beside a run with the sequence `word`.
    fn new(case: &Case, word: &[EventKind], stop: &dyn Fn() -> bool) -> Result<Baseline, String> {
        let mut case = case.clone();
        case.solver = SolverOptions {
            method: Method::Series,
            rtol: RTOL,
            max_events: case.solver.max_events,
            ..SolverOptions::default()
        };
        let report = run(&case, 1, stop).map_err(|error| match error {
            NoReport::Failed(text) => format!("series does not run this case: {text}"),
            NoReport::TooLong => "a run by series takes more steps than reruns may".to_owned(),
            NoReport::Interrupted => INTERRUPTED.to_owned(),
        })?;
        let own = in_event_sequence(report.events.iter().map(|event| event.kind));
        if own != word {
            let difference = difference(&own, word);
            return Err(format!("series finds another sequence of events: {difference}"));
        }
        let Some(final_stick) = report.digest.cycles.final_stick_time else {
            return Err("there is no final stick".to_owned());
        };
        if Summary::of_run(&case.parameters, &report).noise_determined {
            return Err("the onset is amplified rounding".to_owned());
        }
        Ok(Baseline {
            case,
            word: own,
            final_stick,
            smooth: report.stopped_smoothly,
            kicked: !report.digest.kicks.is_empty(),
        })
    }

    /// Fills in the reruns; says why not, if they were not made.
    fn rerun(&self, rows: &mut [Sensitivity], stop: &(dyn Fn() -> bool + Sync)) -> Option<String> {
        let jobs: Vec<(usize, f64)> = rows
            .iter()
            .enumerate()
            .filter_map(|(index, row)| Some((index, row.half_last_digit?)))
            .flat_map(|(index, half)| [(index, -half), (index, half)])
            .collect();
        let done = over_processors(jobs.len(), stop, |job| {
            let (index, change) = jobs[job];
            let parameter = &rows[index].parameter;
            self.with(&parameter.path, parameter.value + change, stop)
        });
        // A rerun that was cut short has no result; then none is told.
        let Some(done) = done
            .into_iter()
            .collect::<Option<Vec<Rerun>>>()
            .filter(|done| done.len() == jobs.len())
        else {
            return Some(INTERRUPTED.to_owned());
        };
        let mut done = done.into_iter();
        for pair in jobs.chunks_exact(2) {
            if let (Some(below), Some(above)) = (done.next(), done.next()) {
                rows[pair[0].0].reruns = Some([below, above]);
            }
        }
        None
    }

    /// The case with another number; `None` if it was interrupted.
    fn with(&self, path: &str, value: f64, stop: &dyn Fn() -> bool) -> Option<Rerun> {
        let rerun = |outcome, remark| Rerun {
            value,
            outcome,
            shift: None,
            sticks: None,
            remark,
        };
        let mut case = self.case.clone();
        if let Err(error) = case.set_number(path, value) {
            return Some(rerun(Outcome::Invalid, invalid(&error, path)));
        }
        let report = match run(&case, RERUN_FACTOR, stop) {
            Ok(report) => report,
            Err(NoReport::Failed(text)) => return Some(rerun(Outcome::Failed, format!("the run failed: {text}"))),
            Err(NoReport::TooLong) => return Some(rerun(Outcome::TooLong, "the run takes too long".to_owned())),
            Err(NoReport::Interrupted) => return None,
        };
        let word = in_event_sequence(report.events.iter().map(|event| event.kind));
        let final_stick = report.digest.cycles.final_stick_time;
        let noise = Summary::of_run(&case.parameters, &report).noise_determined;
        let outcome = match final_stick {
            None => Outcome::NoFinalStick,
            Some(_) if noise => Outcome::NoiseDetermined,
            Some(_) if word == self.word => Outcome::SameEvents,
            Some(_) => Outcome::OtherEvents,
        };
        let mut remarks = Vec::new();
        match word.last() {
            _ if final_stick.is_some() => {}
            Some(last) => remarks.push(format!("no final stick: the last event is a {}", last.name())),
            None => remarks.push("no final stick: the run ends sliding".to_owned()),
        }
        if word != self.word {
            remarks.push(difference(&word, &self.word));
        }
        if noise {
            remarks.push("amplified rounding".to_owned());
        }
        if self.kicked && report.digest.kicks.is_empty() {
            remarks.push("the kick comes after the first stick".to_owned());
        } else if report.stopped_smoothly && !self.smooth {
            remarks.push("the kick has died out".to_owned());
        }
        Some(Rerun {
            value,
            outcome,
            shift: final_stick.map(|time| time - self.final_stick),
            sticks: Some(report.digest.cycles.stick_count),
            remark: remarks.join(", "),
        })
    }
}

/// The run of a case, of which nothing is recorded, in `factor` times the steps that the case itself may take.
fn run(case: &Case, factor: usize, stop: &dyn Fn() -> bool) -> Result<RunReport, NoReport> {
    let output = OutputOptions::at_the_ends(case.output.end_time);
    let (mut questions, mut events, mut too_long) = (0, 0, false);
    let control = &mut |progress: Progress| {
        questions = if progress.events == events {
            questions + 1
        } else {
            questions
        };
        events = progress.events;
        too_long = questions > factor * MOST_QUESTIONS || events > factor * MOST_EVENTS;
        match too_long || stop() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    };
    match Run::new(case).output(&output).control(control).start() {
        Err(failure) => Err(NoReport::Failed(failure.to_string())),
        Ok(_) if too_long => Err(NoReport::TooLong),
        Ok(report) if report.interrupted => Err(NoReport::Interrupted),
        Ok(report) => Ok(report),
    }
}

/// In which count a sequence of events differs from another: "51 sticks instead of 54".
pub(super) fn difference(own: &[EventKind], other: &[EventKind]) -> String {
    let count = |word: &[EventKind], kind: EventKind| word.iter().filter(|k| **k == kind).count();
    EventKind::ALL
        .into_iter()
        .map(|kind| (kind, count(own, kind), count(other, kind)))
        .find(|(_, own, other)| own != other)
        .map_or_else(
            || "the same events in another order".to_owned(),
            |(kind, own, other)| {
                let plural = if own == 1 { "" } else { "s" };
                format!("{own} {}{plural} instead of {other}", kind.name())
            },
        )
}

/// Why a case cannot have a value, in a few words.
pub(super) fn invalid(error: &CaseError, path: &str) -> String {
    let Some(problem) = error.problems.first() else {
        return "impossible".to_owned();
    };
    // What comes after is the values, and what to do about a case that someone wrote.
    let complaint = problem.message.split([':', ';', ',']).next().unwrap_or_default();
    let key = if problem.key.is_empty() { path } else { &problem.key };
    format!("{key}: {complaint}")
}
