//! Effects of a case's parameters on the events and the outcome of its run.
//!
//! A slope ([`linearise`]) describes small changes. Half a unit of the last printed digit is often not small: it can
//! move the stop by seconds, past a kick at a fixed time, or across a grazing event. So the case is run again by
//! `series`, with each parameter half a unit lower and higher. A rerun takes milliseconds.

use super::Summary;
use super::attractor::{Attractor, Recurrence};
use super::ladder::INTERRUPTED;
use super::linearised::{Linearised, Slope, by_series, linearise};
use serde::Serialize;
use stickslip_case::quantity::Dimension;
use stickslip_case::{Case, CaseError, CaseNumber, WrittenCase};
use stickslip_engine::ErrorKind;
use stickslip_engine::run::Run;
use stickslip_engine::simulation::{OutputOptions, RunReport};
use stickslip_engine::workers::over_processors;
use stickslip_system::model::system::ContactLaw;
use stickslip_system::model::{KickTime, Mode};
use stickslip_system::named;
use stickslip_system::record::{CycleStatistics, Event, EventKind, NoRecorder};
use stickslip_system::watch::Watch;

/// A parameter is nonlinear if slope and rerun differ by more than this fraction of the larger shift.
pub(crate) const NONLINEAR_SHARE: f64 = 0.1;

/// Error of a difference between reruns, s: `series` is within 1e-12 s of the exact events.
const RERUN_ERROR: f64 = 1e-12;

/// Limit for a run, about one second, in steps to be reproducible. A rerun may take `RERUN_FACTOR` times as many.
const MOST_STEPS: usize = 40_000;
const RERUN_FACTOR: usize = 4;

/// Rounding of an event's time between nearly equal runs, in units of its last place.
const ROUNDING: f64 = 16.0;

/// A result is independent of a parameter if a relative change of 1 would change it by less than this fraction.
const NEGLIGIBLE: f64 = 1e-6;

named! {
    /// Outcome of a rerun.
    pub enum RerunOutcome {
        /// Unchanged sequence of events.
        SameEvents: "same-events",
        /// Another sequence, with a final stick.
        OtherEvents: "other-events",
        /// The onset is amplified rounding, and the final stick is equally uncertain.
        NoiseDetermined: "noise-determined",
        /// No final stick.
        NoFinalStick: "no-final-stick",
        /// Value that the case cannot have.
        Invalid: "invalid",
        /// Failed run.
        Failed: "failed",
        /// Run that would take too long.
        TooLong: "too-long",
        /// The motion is no longer periodic.
        NoPeriod: "no-period",
    }
}

named! {
    /// Result of a run that depends on its parameters. Its words have the article.
    pub enum Affected {
        FinalStick: "final-stick", "the final stick";
        AttractorPeriod: "attractor-period", "the period of the attractor";
        LastEvent: "last-event", "the last event";
    }
}

impl Affected {
    /// Meaning of a positive shift, in words.
    pub fn shift(self) -> String {
        let much = if self == Affected::AttractorPeriod {
            "longer"
        } else {
            "later"
        };
        format!("how much {much} {} is", self.words())
    }

    /// Codes and names of the possible outcomes of a rerun.
    pub(super) fn outcomes(self) -> impl Iterator<Item = (i64, String)> {
        RerunOutcome::codes()
            .into_iter()
            .filter(move |outcome| match outcome.1.as_str() {
                "no-period" => self == Affected::AttractorPeriod,
                "no-final-stick" => self == Affected::FinalStick,
                _ => true,
            })
    }
}

/// Rerun with one changed parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SensitivityRerun {
    /// Value in the unit of the parameter.
    pub value: f64,
    /// Outcome of the rerun.
    pub outcome: RerunOutcome,
    /// Delay or increase of the result, s; `None` without a result.
    pub shift: Option<f64>,
    /// Number of sticks; `None` if the run did not finish.
    pub sticks: Option<usize>,
    /// Remarks other than the shift; empty for the same events.
    pub remark: String,
}

/// Effect of one parameter on a result.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivity {
    /// The parameter.
    pub parameter: CaseNumber,
    /// d(result)/d(parameter), s per unit; `None` without a derivative.
    pub slope: Option<f64>,
    /// Reruns half a unit lower and higher; `None` if not made.
    pub reruns: Option<[SensitivityRerun; 2]>,
}

impl Sensitivity {
    /// Shift by half a unit upwards, from the slope, s.
    pub fn predicted(&self) -> Option<f64> {
        Some(self.slope? * self.parameter.half_last_digit?)
    }

    /// Whether slope and rerun differ by more than `NONLINEAR_SHARE`, or a rerun has other events; `None` if unknown.
    pub fn nonlinear(&self) -> Option<bool> {
        let predicted = self.predicted();
        let sides = self.reruns.as_ref()?.iter().zip([-1.0, 1.0]);
        sides
            .filter_map(|(rerun, side)| match (rerun.outcome, rerun.shift) {
                (RerunOutcome::SameEvents, Some(shift)) => {
                    let predicted = side * predicted?;
                    let difference = (shift - predicted).abs();
                    Some(difference > (NONLINEAR_SHARE * shift.abs().max(predicted.abs())).max(RERUN_ERROR))
                }
                (
                    RerunOutcome::OtherEvents
                    | RerunOutcome::NoiseDetermined
                    | RerunOutcome::NoFinalStick
                    | RerunOutcome::NoPeriod,
                    _,
                ) => Some(true),
                _ => None,
            })
            .reduce(|one, other| one || other)
    }

    /// Largest known shift, s: from the reruns, otherwise from the slope.
    pub fn largest(&self) -> f64 {
        let reruns = self.reruns.iter().flatten().filter_map(|rerun| rerun.shift);
        let largest = reruns.map(f64::abs).reduce(f64::max);
        largest.or(self.predicted().map(f64::abs)).unwrap_or(0.0)
    }
}

/// Sensitivities of one result of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sensitivities {
    /// The result.
    #[serde(skip)]
    pub of: Affected,
    /// Time or duration of the result, s.
    pub time: f64,
    /// One row for each physical parameter of the case, in its order.
    #[serde(skip)]
    pub rows: Vec<Sensitivity>,
    /// Reason for missing reruns.
    pub without_reruns: Option<String>,
    /// Text on the times of kicks when a parameter changes; empty without a kick.
    pub held: String,
}

/// Sensitivities of a case.
#[derive(Debug, Clone)]
pub struct CaseSensitivities {
    /// Physical parameters of the case.
    pub parameters: Vec<CaseNumber>,
    /// d(event time)/d(parameter): one row of all parameters for each event that the run by `series` shares.
    pub events: Vec<Vec<Slope>>,
    /// Effect of half a unit in the last digit on the run's result; `None` without a certain event of the contact.
    pub result: Option<Sensitivities>,
}

struct Outrun {
    report: RunReport,
    attractor: Option<Attractor>,
    noise: bool,
}

impl Outrun {
    fn word(&self) -> Vec<EventKind> {
        in_event_sequence(self.report.events.iter().map(|event| event.kind))
    }

    fn cycles(&self) -> &CycleStatistics {
        &self.report.digest.cycles
    }

    /// The result and its variation between nearly equal runs, s.
    fn result(&self, of: Affected, last: usize) -> Option<(f64, f64)> {
        let rounding = |time: f64| ROUNDING * f64::EPSILON * time;
        match of {
            Affected::AttractorPeriod => {
                let attractor = self.attractor.as_ref()?;
                let until = self.report.events.last()?.time;
                Some((
                    attractor.period,
                    attractor.distance * attractor.period + rounding(until),
                ))
            }
            Affected::FinalStick => self.cycles().final_stick_time.map(|time| (time, rounding(time))),
            Affected::LastEvent => self
                .report
                .events
                .get(last)
                .map(|event| (event.time, rounding(event.time))),
        }
    }

    fn is_like(&self, of: Affected, other: &Outrun, last: usize) -> bool {
        match of {
            Affected::AttractorPeriod => match (&self.attractor, &other.attractor) {
                (Some(own), Some(others)) => own.sticks == others.sticks && own.sections == others.sections,
                _ => false,
            },
            Affected::FinalStick => self.word() == other.word(),
            // If the sequence continues, only the events up to this event must agree.
            Affected::LastEvent => {
                let (own, others) = (&self.report.events, &other.report.events);
                let same = agreeing(own.iter().map(after), others.iter().map(after));
                if last + 1 < others.len() {
                    same > last
                } else {
                    same == own.len().max(others.len())
                }
            }
        }
    }
}

fn after(event: &Event) -> (EventKind, Mode) {
    (event.kind, event.mode_after)
}

fn agreeing<T: PartialEq>(own: impl Iterator<Item = T>, other: impl Iterator<Item = T>) -> usize {
    own.zip(other).take_while(|(a, b)| a == b).count()
}

/// Fails with the outcome and a remark, or `None` if stopped.
fn run(case: &Case, max_steps: Option<usize>, stop: &dyn Watch) -> Result<Outrun, Option<(RerunOutcome, String)>> {
    let solver = by_series(case, max_steps);
    let output = OutputOptions::at_the_ends(case.output.end_time);
    let mut nobody = NoRecorder;
    let mut recurrence = Recurrence::new(&case.system, &mut nobody, true, None);
    let ended = Run::new(case)
        .solver(&solver)
        .output(&output)
        .record(&mut recurrence)
        .watch(stop)
        .start();
    let report = match ended {
        Err(failure) if failure.error.kind == ErrorKind::TooManySteps => {
            return Err(Some((RerunOutcome::TooLong, "the run takes too long".to_owned())));
        }
        Err(failure) => return Err(Some((RerunOutcome::Failed, format!("the run failed: {failure}")))),
        Ok(report) if report.interrupted => return Err(None),
        Ok(report) => report,
    };
    Ok(Outrun {
        attractor: recurrence.attractor_of_events(&case.system, case.threshold),
        noise: Summary::of_run(&case.system, &report).noise_determined,
        report,
    })
}

struct Differentiated<'a> {
    written: &'a WrittenCase,
    linearised: &'a Linearised,
    stop: &'a dyn Watch,
    base: Outrun,
    /// Index of the last certain event of the contact.
    last: usize,
    of: Affected,
}

/// Effects of the parameters on the events of a run, and of half a unit in each last written digit on the run's
/// result. The first `certain` events are certain. `known`: linearisation of the written case, if available. Once
/// `stop` is `true`, known slopes come without reruns. An error says why there are no derivatives.
pub fn sensitivities(
    written: &WrittenCase,
    known: Option<&Linearised>,
    events: &[Event],
    certain: usize,
    stop: &dyn Watch,
) -> Result<CaseSensitivities, String> {
    let numbers = written.numbers();
    let made;
    let linearised = match known {
        Some(known) => known,
        None => {
            made = linearise(written, None, stop).map_err(|why| format!("series does not run this case: {why}"))?;
            if stop.stopped() {
                return Err(INTERRUPTED.to_owned());
            }
            &made
        }
    };
    let found = linearised.events.iter().map(|event| (event.kind, event.mode_after));
    let same = agreeing(events.iter().map(after), found);
    if same < certain {
        return Err(format!(
            "series agrees with {same} of the {certain} events that are certain"
        ));
    }
    let slopes = |event| {
        (0..numbers.len())
            .map(|number| linearised.slope(event, number))
            .collect()
    };
    Ok(CaseSensitivities {
        parameters: numbers.to_vec(),
        events: (0..same).map(slopes).collect(),
        result: of_result(written, linearised, certain, stop),
    })
}

/// Sensitivity of the run's result to each parameter. The first `certain` events are known to be true.
fn of_result(
    written: &WrittenCase,
    linearised: &Linearised,
    certain: usize,
    stop: &dyn Watch,
) -> Option<Sensitivities> {
    // A corner of a signal is not a result.
    let known = &linearised.events[..certain];
    let last = known.iter().rposition(|event| event.kind.in_event_sequence())?;
    let case = written.case();
    let base = run(case, None, &|| false).ok()?;
    let all = certain == base.report.events.len();
    // A contact without sticking has no lasting final stick.
    let sticks = case.system.contact == ContactLaw::StickSlip;
    let of = match (&base.attractor, base.cycles().final_stick_time) {
        (Some(_), _) if all => Affected::AttractorPeriod,
        (None, Some(_)) if all && sticks => Affected::FinalStick,
        _ => Affected::LastEvent,
    };
    let time = base.result(of, last)?.0;
    let differentiated = Differentiated {
        written,
        linearised,
        stop,
        base,
        last,
        of,
    };
    let row = |(index, number): (usize, &CaseNumber)| Sensitivity {
        parameter: number.clone(),
        slope: differentiated.slope_of_result(index),
        reruns: None,
    };
    let mut rows: Vec<Sensitivity> = written.numbers().iter().enumerate().map(row).collect();
    let without_reruns = differentiated.rerun_all(&mut rows);
    Some(Sensitivities {
        of,
        time,
        rows,
        without_reruns,
        held: held(case),
    })
}

fn in_event_sequence(kinds: impl IntoIterator<Item = EventKind>) -> Vec<EventKind> {
    kinds.into_iter().filter(|kind| kind.in_event_sequence()).collect()
}

fn held(case: &Case) -> String {
    let of_stop = match case.stops() {
        true => ", whatever the changed number does to the loss of stability and to the stop",
        false => "",
    };
    let speed = case.motion().dimension(Dimension::AngularVelocity).unit();
    let kicks = case.system.kicks.iter().map(|kick| {
        let place = match kick.time {
            KickTime::At(time) => format!("stays at {time} s{of_stop}"),
            KickTime::Instability => "goes along with the loss of stability".to_owned(),
        };
        format!("the kick of {:e} {speed} {place}", kick.relative_velocity)
    });
    match kicks.collect::<Vec<_>>().join("; ") {
        kicks if kicks.is_empty() => kicks,
        kicks => format!("One number is changed at a time: {kicks}."),
    }
}

impl Slope {
    fn minus(self, other: Slope) -> Slope {
        Slope {
            value: self.value - other.value,
            uncertainty: self.uncertainty + other.uncertainty,
        }
    }
}

impl Differentiated<'_> {
    /// d(result)/d(parameter), s per unit, if at least one digit is certain.
    fn slope_of_result(&self, number: usize) -> Option<f64> {
        let (result, _) = self.base.result(self.of, self.last)?;
        let found = match self.of {
            Affected::AttractorPeriod => self.slope_of_period(number)?,
            Affected::FinalStick => {
                let at = self.base.cycles().final_stick_time?;
                let event = self.base.report.events.iter().position(|event| event.time == at)?;
                self.linearised.slope(event, number)
            }
            Affected::LastEvent => self.linearised.slope(self.last, number),
        };
        let size = self.linearised.parameters[number].value.abs();
        let negligible = (found.value.abs() + found.uncertainty) * size < NEGLIGIBLE * result;
        if found.uncertainty < 0.1 * found.value.abs() {
            Some(found.value)
        } else {
            negligible.then_some(0.0)
        }
    }

    /// Derivative of the last period. Its remaining change per period adds to the uncertainty. If the moved run begins
    /// in another mode, its events differ but its periods do not.
    fn slope_of_period(&self, number: usize) -> Option<Slope> {
        let sections = self.base.attractor.as_ref()?.sections;
        let events = self.base.report.events.iter().enumerate();
        let hits = events.filter(|(_, event)| matches!(event.kind, EventKind::Slip | EventKind::Reversal));
        let hits: Vec<usize> = hits.map(|(index, _)| index).collect();
        let from_last = |back: usize| {
            let event = hits[hits.len().checked_sub(1 + back * sections)?];
            Some(self.linearised.events.get(event)?.by_parameter[number])
        };
        let (last, before, first) = (from_last(0)?, from_last(1)?, from_last(2)?);
        let (period, earlier) = (last.minus(before), before.minus(first));
        Some(Slope {
            value: period.value,
            uncertainty: period.uncertainty + (period.value - earlier.value).abs(),
        })
    }

    /// Returns the reason if no reruns were made. They use all processors.
    fn rerun_all(&self, rows: &mut [Sensitivity]) -> Option<String> {
        if self.base.noise {
            return Some("the onset is amplified rounding".to_owned());
        }
        let work = self.base.report.work.iter();
        if work.map(|work| work.steps as usize).sum::<usize>() > MOST_STEPS {
            return Some(format!(
                "the run takes more than {MOST_STEPS} steps, and two more runs are needed for each parameter"
            ));
        }
        let rows_with = rows.iter().enumerate();
        let halves = rows_with.filter_map(|(index, row)| Some((index, row.parameter.half_last_digit?)));
        // An exact number has no other value.
        let halves = halves.filter(|(_, half)| *half > 0.0);
        let jobs: Vec<(usize, f64)> = halves
            .flat_map(|(index, half)| [(index, -half), (index, half)])
            .collect();
        let done = over_processors(jobs.len(), self.stop, |job| {
            let (index, change) = jobs[job];
            let number = &rows[index].parameter;
            self.rerun(&number.path, number.value + change)
        });
        // Incomplete sets of reruns are dropped.
        let done: Option<Vec<SensitivityRerun>> = done.into_iter().collect();
        let Some(done) = done.filter(|done| done.len() == jobs.len()) else {
            return Some(INTERRUPTED.to_owned());
        };
        for (pair, of_pair) in jobs.chunks_exact(2).zip(done.chunks_exact(2)) {
            rows[pair[0].0].reruns = Some([of_pair[0].clone(), of_pair[1].clone()]);
        }
        None
    }

    fn rerun(&self, path: &str, value: f64) -> Option<SensitivityRerun> {
        let without = |outcome, remark| {
            Some(SensitivityRerun {
                value,
                outcome,
                shift: None,
                sticks: None,
                remark,
            })
        };
        let case = match self.written.with(path, value) {
            Ok(case) => case,
            Err(error) => return without(RerunOutcome::Invalid, invalid(&error, path)),
        };
        let other = match run(&case, Some(RERUN_FACTOR * MOST_STEPS), self.stop) {
            Ok(other) => other,
            Err(failure) => return failure.and_then(|(outcome, remark)| without(outcome, remark)),
        };
        let (own, noise) = self.base.result(self.of, self.last)?;
        // Differences within the convergence of the two attractors count as zero.
        let shift = other.result(self.of, self.last).map(|(time, others)| {
            let shift = time - own;
            match self.of == Affected::AttractorPeriod && shift.abs() <= noise + others {
                true => 0.0,
                false => shift,
            }
        });
        let like = other.is_like(self.of, &self.base, self.last);
        let outcome = match (shift, self.of) {
            (Some(_), _) if other.noise => RerunOutcome::NoiseDetermined,
            (Some(_), _) if like => RerunOutcome::SameEvents,
            (None, Affected::AttractorPeriod) => RerunOutcome::NoPeriod,
            (None, Affected::FinalStick) => RerunOutcome::NoFinalStick,
            _ => RerunOutcome::OtherEvents,
        };
        Some(SensitivityRerun {
            value,
            outcome,
            // The time of a different event is not a shift.
            shift: shift.filter(|_| like || self.of != Affected::LastEvent),
            sticks: Some(other.cycles().stick_count),
            remark: self.remarks(&other, outcome).join(", "),
        })
    }

    fn remarks(&self, other: &Outrun, outcome: RerunOutcome) -> Vec<String> {
        let base = &self.base;
        let (word, own) = (other.word(), base.word());
        let mut remarks = Vec::new();
        match (outcome, word.last()) {
            (RerunOutcome::NoPeriod, _) => {
                remarks.push("the motion does not repeat itself by the end of the run".to_owned())
            }
            (RerunOutcome::NoFinalStick, Some(last)) => {
                remarks.push(format!("no final stick: the last event is a {}", last.name()));
            }
            (RerunOutcome::NoFinalStick, None) => remarks.push("no final stick: the run ends sliding".to_owned()),
            _ => {}
        }
        match (outcome, &other.attractor, &base.attractor) {
            (RerunOutcome::SameEvents | RerunOutcome::NoPeriod, ..) => {}
            (_, Some(others), Some(own)) => remarks.push(format!(
                "{} sticks and {} sections in a period instead of {} and {}",
                others.sticks, others.sections, own.sticks, own.sections
            )),
            _ if word != own || outcome == RerunOutcome::OtherEvents => remarks.push(difference(&word, &own)),
            _ => {}
        }
        if other.noise {
            remarks.push("amplified rounding".to_owned());
        }
        let is_kicked = |run: &Outrun| !run.report.digest.kicks.is_empty();
        if is_kicked(base) && !is_kicked(other) {
            remarks.push("the kick comes after the first stick".to_owned());
        } else if other.report.stopped_smoothly && !base.report.stopped_smoothly {
            remarks.push("the kick has died out".to_owned());
        }
        remarks
    }
}

/// First difference in the counts of two sequences, such as "51 sticks instead of 54".
fn difference(own: &[EventKind], other: &[EventKind]) -> String {
    let count = |word: &[EventKind], kind: EventKind| word.iter().filter(|k| **k == kind).count();
    for kind in EventKind::ALL {
        let (own, other) = (count(own, kind), count(other, kind));
        if own != other {
            let plural = if own == 1 { "" } else { "s" };
            return format!("{own} {}{plural} instead of {other}", kind.name());
        }
    }
    "the same events in another order".to_owned()
}

fn invalid(error: &CaseError, path: &str) -> String {
    let Some(problem) = error.problems.first() else {
        return "impossible".to_owned();
    };
    // The rest of the message lists values and advice for hand-written cases.
    let complaint = problem.message.split([':', ';', ',']).next().unwrap_or_default();
    let key = if problem.key.is_empty() { path } else { &problem.key };
    format!("{key}: {complaint}")
}
