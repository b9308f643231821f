//! How the numbers of a case change the events and the outcome of its run.
//!
//! A slope ([`linearise`]) tells of small changes. Half a unit of the last printed digit is often none: it can move the stop by
//! seconds, past a kick whose time is held, or across a graze. So the case is run again with each number half a unit lower and
//! higher, by `series`, which takes milliseconds.

use super::Summary;
use super::attractor::{Attractor, Recurrence};
use super::deadline::INTERRUPTED;
use super::linearised::{Linearised, Slope, Times, by_series, linearise};
use crate::case::quantity::Dimension;
use crate::case::{Case, CaseError, CaseNumber, WrittenCase};
use crate::hybrid::RunError;
use crate::model::system::ContactLaw;
use crate::model::{KickTime, Mode};
use crate::record::{Event, EventKind};
use crate::results::{Addition, Column};
use crate::run::Run;
use crate::simulation::OutputOptions;
use crate::workers::over_processors;
use serde::Serialize;

/// A number counts as nonlinear where slope and rerun differ by more than this share of the larger of the two shifts.
pub(crate) const NONLINEAR_SHARE: f64 = 0.1;

/// Differences of shifts below this, s, are the error of the reruns: `series` is within 1e-12 s of exact events.
const RERUN_ERROR: f64 = 1e-12;

/// Steps of Taylor series that the run of the case may take for others to be made of it: about a second. A rerun may take some
/// times as many. Counted in steps, so that the same case always has the same reruns.
const MOST_STEPS: usize = 40_000;
const RERUN_FACTOR: usize = 4;

/// Units of the last place that the time of an event varies by between two runs whose numbers hardly differ: the rounding of
/// the state at every event before it.
const ROUNDING: f64 = 16.0;

/// A result that would change by less than this share if a number were changed by all of itself does not depend on it.
const NEGLIGIBLE: f64 = 1e-6;

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
        self.texts().0
    }

    /// In words, with its article.
    pub fn words(self) -> &'static str {
        self.texts().1
    }

    /// What a positive shift of it says.
    pub fn shift(self) -> &'static str {
        self.texts().2
    }

    fn texts(self) -> (&'static str, &'static str, &'static str) {
        match self {
            Affected::FinalStick => ("final-stick", "the final stick", "how much later the final stick is"),
            Affected::AttractorPeriod => (
                "attractor-period",
                "the period of the attractor",
                "how much longer the period of the attractor is",
            ),
            Affected::LastEvent => ("last-event", "the last event", "how much later the last event is"),
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
    pub parameter: CaseNumber,
    /// d(result)/d(parameter), s per unit; `None` where there is no derivative.
    pub slope: Option<f64>,
    /// Half a unit lower and half a unit higher; `None` if they were not made.
    pub reruns: Option<[Rerun; 2]>,
}

impl Sensitivity {
    /// The shift by half a unit upwards, by the slope, s.
    pub fn predicted(&self) -> Option<f64> {
        Some(self.slope? * self.parameter.half_last_digit?)
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

/// What the numbers of a case do.
#[derive(Debug, Clone)]
pub struct CaseSensitivities {
    /// The numbers of the case.
    pub parameters: Vec<CaseNumber>,
    /// d(event time)/d(parameter): a row of all parameters for each event, as far as the run by `series` has the same.
    pub events: Vec<Vec<Slope>>,
    /// What half a last digit does to what the run comes to; `None` without an event of the contact that is certain.
    pub result: Option<Sensitivities>,
}

/// What a run came to.
struct Outrun {
    events: Vec<(f64, EventKind, Mode)>,
    steps: usize,
    attractor: Option<Attractor>,
    final_stick: Option<f64>,
    sticks: usize,
    /// The first stop came at the end of smooth sliding.
    smooth: bool,
    /// A kick comes before the first stick.
    kicked: bool,
    /// The onset of stick-slip is amplified rounding.
    noise: bool,
}

impl Outrun {
    fn word(&self) -> Vec<EventKind> {
        in_event_sequence(self.events.iter().map(|event| event.1))
    }

    /// The result, and by how many seconds it varies between runs whose numbers hardly differ.
    fn result(&self, of: Affected, last: usize) -> Option<(f64, f64)> {
        let rounding = |time: f64| ROUNDING * f64::EPSILON * time;
        match of {
            Affected::AttractorPeriod => {
                let attractor = self.attractor.as_ref()?;
                let until = self.events.last()?.0;
                Some((
                    attractor.period,
                    attractor.distance * attractor.period + rounding(until),
                ))
            }
            Affected::FinalStick => self.final_stick.map(|time| (time, rounding(time))),
            Affected::LastEvent => self.events.get(last).map(|event| (event.0, rounding(event.0))),
        }
    }

    /// Whether its result is of the same making as another's.
    fn is_like(&self, of: Affected, other: &Outrun, last: usize) -> bool {
        match of {
            Affected::AttractorPeriod => match (&self.attractor, &other.attractor) {
                (Some(own), Some(others)) => own.sticks == others.sticks && own.sections == others.sections,
                _ => false,
            },
            Affected::FinalStick => self.word() == other.word(),
            // A sequence that goes on after it is known as far as the event itself.
            Affected::LastEvent if last + 1 < other.events.len() => agreeing(&self.events, &other.events) > last,
            Affected::LastEvent => agreeing(&self.events, &other.events) == self.events.len().max(other.events.len()),
        }
    }
}

/// From the first on, how many events of two runs are the same but for their times.
fn agreeing(own: &[(f64, EventKind, Mode)], other: &[(f64, EventKind, Mode)]) -> usize {
    let pairs = own.iter().zip(other);
    pairs.take_while(|(a, b)| a.1 == b.1 && a.2 == b.2).count()
}

/// Why a run has no result.
enum NoRun {
    Failed(String),
    TooLong,
    Interrupted,
}

/// The run of a case by `series`, in so many steps at most.
fn run(case: &Case, max_steps: Option<usize>, stop: &dyn Fn() -> bool) -> Result<Outrun, NoRun> {
    let solver = by_series(case, max_steps);
    let output = OutputOptions::at_the_ends(case.output.end_time);
    let (trains, threshold) = (&case.system, case.threshold);
    let mut times = Times::default();
    let mut recurrence = Recurrence::new(trains, &mut times, false, None);
    let ended = Run::new(case)
        .solver(&solver)
        .output(&output)
        .record(&mut recurrence)
        .stop(stop)
        .start();
    let report = match ended {
        Err(failure) if matches!(failure.error, RunError::TooManySteps { .. }) => return Err(NoRun::TooLong),
        Err(failure) => return Err(NoRun::Failed(failure.to_string())),
        Ok(report) if report.interrupted => return Err(NoRun::Interrupted),
        Ok(report) => report,
    };
    let attractor = recurrence.attractor_of_events(trains, threshold);
    Ok(Outrun {
        steps: report.work.iter().map(|work| work.steps as usize).sum(),
        events: times.0,
        attractor,
        final_stick: report.digest.cycles.final_stick_time,
        sticks: report.digest.cycles.stick_count,
        smooth: report.stopped_smoothly,
        kicked: !report.digest.kicks.is_empty(),
        noise: Summary::of_run(&case.system, &report).noise_determined,
    })
}

/// What is differentiated: events of the run `base`, and its result.
struct Differentiated<'a> {
    written: &'a WrittenCase,
    linearised: &'a Linearised,
    stop: &'a (dyn Fn() -> bool + Sync),
    base: Outrun,
    /// The last certain event that is one of the contact.
    last: usize,
    of: Affected,
}

/// What the numbers of a case do to the events of a run of it, of which the first `certain` are, and what half a unit of the last
/// written digit of each does to what the run comes to. `known` is the linearisation of the written case, if it has been made.
/// `stop` is asked now and then: once it says so the slopes come without reruns, if they are known.
///
/// # Errors
/// In words, why there are no derivatives.
pub fn sensitivities(
    written: &WrittenCase,
    known: Option<&Linearised>,
    events: &[Event],
    certain: usize,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<CaseSensitivities, String> {
    let numbers = written.numbers();
    let made;
    let linearised = match known {
        Some(known) => known,
        None => {
            made = linearise(written, None, stop).map_err(|why| format!("series does not run this case: {why}"))?;
            if stop() {
                return Err(INTERRUPTED.to_owned());
            }
            &made
        }
    };
    let own: Vec<_> = events.iter().map(|e| (e.time, e.kind, e.mode_after)).collect();
    let found = linearised.events.iter().map(|e| (e.time, e.kind, e.mode_after));
    let found: Vec<_> = found.collect();
    let same = agreeing(&own, &found);
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
        result: of_result(written, linearised, &found[..certain], stop),
    })
}

/// What the numbers do to what the run comes to, of which these events are certain.
fn of_result(
    written: &WrittenCase,
    linearised: &Linearised,
    certain: &[(f64, EventKind, Mode)],
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<Sensitivities> {
    // A corner of a signal is no result.
    let last = certain.iter().rposition(|event| event.1.in_event_sequence())?;
    let case = written.case();
    let base = run(case, None, &|| false).ok()?;
    let all = certain.len() == base.events.len();
    // A contact without stick comes to none that lasts.
    let sticks = case.system.contact == ContactLaw::StickSlip;
    let of = match (&base.attractor, base.final_stick) {
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

/// What a change of another number does to the kicks.
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
    /// d(result)/d(number), s per unit, if it is known to a digit.
    fn slope_of_result(&self, number: usize) -> Option<f64> {
        let (result, _) = self.base.result(self.of, self.last)?;
        let found = match self.of {
            Affected::AttractorPeriod => self.slope_of_period(number)?,
            Affected::FinalStick => {
                let at = self.base.final_stick?;
                let event = self.base.events.iter().position(|event| event.0 == at)?;
                self.linearised.slope(event, number)
            }
            Affected::LastEvent => self.linearised.slope(self.last, number),
        };
        // What is not known to a digit is not said.
        let size = self.linearised.parameters[number].value.abs();
        let negligible = (found.value.abs() + found.uncertainty) * size < NEGLIGIBLE * result;
        if found.uncertainty < 0.1 * found.value.abs() {
            Some(found.value)
        } else {
            negligible.then_some(0.0)
        }
    }

    /// That of the last period of the motion: by how much it still changes from period to period it is uncertain. Where the run
    /// begins in another mode with the number moved, its events are others, but not its periods.
    fn slope_of_period(&self, number: usize) -> Option<Slope> {
        let sections = self.base.attractor.as_ref()?.sections;
        let events = self.base.events.iter().enumerate();
        let hits = events.filter(|(_, event)| matches!(event.1, EventKind::Slip | EventKind::Reversal));
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

    /// Fills in the reruns, over all processors; says why not, if they were not made.
    fn rerun_all(&self, rows: &mut [Sensitivity]) -> Option<String> {
        if self.base.noise {
            return Some("the onset is amplified rounding".to_owned());
        }
        if self.base.steps > MOST_STEPS {
            return Some(format!(
                "the run takes more than {MOST_STEPS} steps, and two more runs are needed for each number"
            ));
        }
        let rows_with = rows.iter().enumerate();
        let halves = rows_with.filter_map(|(index, row)| Some((index, row.parameter.half_last_digit?)));
        let jobs: Vec<(usize, f64)> = halves
            .flat_map(|(index, half)| [(index, -half), (index, half)])
            .collect();
        let done = over_processors(jobs.len(), self.stop, |job| {
            let (index, change) = jobs[job];
            let number = &rows[index].parameter;
            self.rerun(&number.path, number.value + change)
        });
        // A rerun that was cut short has no result; then none is told.
        let done: Option<Vec<Rerun>> = done.into_iter().collect();
        let Some(done) = done.filter(|done| done.len() == jobs.len()) else {
            return Some(INTERRUPTED.to_owned());
        };
        for (pair, of_pair) in jobs.chunks_exact(2).zip(done.chunks_exact(2)) {
            rows[pair[0].0].reruns = Some([of_pair[0].clone(), of_pair[1].clone()]);
        }
        None
    }

    /// The case with another number; `None` if it was interrupted.
    fn rerun(&self, path: &str, value: f64) -> Option<Rerun> {
        let without = |outcome, remark| {
            Some(Rerun {
                value,
                outcome,
                shift: None,
                sticks: None,
                remark,
            })
        };
        let case = match self.written.with(path, value) {
            Ok(case) => case,
            Err(error) => return without(Outcome::Invalid, invalid(&error, path)),
        };
        let other = match run(&case, Some(RERUN_FACTOR * MOST_STEPS), self.stop) {
            Ok(other) => other,
            Err(NoRun::Interrupted) => return None,
            Err(NoRun::Failed(text)) => return without(Outcome::Failed, format!("the run failed: {text}")),
            Err(NoRun::TooLong) => return without(Outcome::TooLong, "the run takes too long".to_owned()),
        };
        let (own, noise) = self.base.result(self.of, self.last)?;
        // A difference that the convergence of the two attractors leaves open is none.
        let shift = other.result(self.of, self.last).map(|(time, others)| {
            let shift = time - own;
            match self.of == Affected::AttractorPeriod && shift.abs() <= noise + others {
                true => 0.0,
                false => shift,
            }
        });
        let like = other.is_like(self.of, &self.base, self.last);
        let outcome = match (shift, self.of) {
            (Some(_), _) if other.noise => Outcome::NoiseDetermined,
            (Some(_), _) if like => Outcome::SameEvents,
            (None, Affected::AttractorPeriod) => Outcome::NoPeriod,
            (None, Affected::FinalStick) => Outcome::NoFinalStick,
            _ => Outcome::OtherEvents,
        };
        Some(Rerun {
            value,
            outcome,
            // The time of another event is no shift of this one.
            shift: shift.filter(|_| like || self.of != Affected::LastEvent),
            sticks: Some(other.sticks),
            remark: self.remarks(&other, outcome).join(", "),
        })
    }

    /// What there is to say of a rerun but for its shift.
    fn remarks(&self, other: &Outrun, outcome: Outcome) -> Vec<String> {
        let base = &self.base;
        let (word, own) = (other.word(), base.word());
        let mut remarks = Vec::new();
        match (outcome, word.last()) {
            (Outcome::NoPeriod, _) => {
                remarks.push("the motion does not repeat itself by the end of the run".to_owned())
            }
            (Outcome::NoFinalStick, Some(last)) => {
                remarks.push(format!("no final stick: the last event is a {}", last.name()));
            }
            (Outcome::NoFinalStick, None) => remarks.push("no final stick: the run ends sliding".to_owned()),
            _ => {}
        }
        match (outcome, &other.attractor, &base.attractor) {
            (Outcome::SameEvents | Outcome::NoPeriod, ..) => {}
            (_, Some(others), Some(own)) => remarks.push(format!(
                "{} sticks and {} sections in a period instead of {} and {}",
                others.sticks, others.sections, own.sticks, own.sections
            )),
            _ if word != own || outcome == Outcome::OtherEvents => remarks.push(difference(&word, &own)),
            _ => {}
        }
        if other.noise {
            remarks.push("amplified rounding".to_owned());
        }
        if base.kicked && !other.kicked {
            remarks.push("the kick comes after the first stick".to_owned());
        } else if other.smooth && !base.smooth {
            remarks.push("the kick has died out".to_owned());
        }
        remarks
    }
}

/// Adds to the group of a file what half a last digit of each of so many parameters does, over its dimension `parameter`; nothing
/// is known without `found`.
pub fn add_sensitivities(group: &mut Addition, found: Option<&Sensitivities>, of: Affected, parameters: usize) {
    /// The code where no rerun was made.
    const NONE: i8 = -1;
    let row = |column: usize| found.map(|found| &found.rows[column]);
    let numbers = |name: &str, unit: &str, long_name: &str, of: &dyn Fn(&Sensitivity) -> Option<f64>| {
        let value = |column| row(column).and_then(of).unwrap_or(f64::NAN);
        Column::numbers(name, unit, long_name, (0..parameters).map(value))
    };
    let rerun = |column: usize, side: usize| -> Option<&Rerun> { Some(&row(column)?.reruns.as_ref()?[side]) };
    group.attribute("held", found.map_or("", |found| &found.held));
    let without_reruns = match found {
        Some(found) => found.without_reruns.clone().unwrap_or_default(),
        None => format!("no {} that is converged", of.words().trim_start_matches("the ")),
    };
    group.attribute("without_reruns", without_reruns);
    let long_name =
        "half a unit in the last written digit, in the unit of the parameter (attribute parameter_units of the group)";
    let mut columns = vec![numbers("half_last_digit", "1", long_name, &|row| {
        row.parameter.half_last_digit
    })];
    let outcomes = of.outcomes().into_iter().map(|o| (o.code(), o.name()));
    let words: Vec<(i64, String)> = [(NONE, "not-made")]
        .into_iter()
        .chain(outcomes)
        .map(|(code, word)| (code.into(), word.to_owned()))
        .collect();
    for (side, (name, where_to)) in [("minus", "lower"), ("plus", "higher")].into_iter().enumerate() {
        let shifts = format!("{} with the parameter half_last_digit {where_to}, by a run", of.shift());
        columns.push(numbers(&format!("shift_{name}"), "s", &shifts, &|row| {
            row.reruns.as_ref()?[side].shift
        }));
        let outcome = |column| rerun(column, side).map_or(NONE, |rerun| rerun.outcome.code());
        let outcomes = (0..parameters).map(outcome);
        columns.push(Column::codes(
            &format!("outcome_{name}"),
            "what that run came to",
            outcomes,
            words.clone(),
        ));
        let sticks = |column| {
            rerun(column, side)
                .and_then(|rerun| rerun.sticks)
                .map_or(-1, |sticks| sticks as i64)
        };
        let long_name = "number of sticks of that run; -1 without one";
        columns.push(Column::counts(
            &format!("sticks_{name}"),
            long_name,
            (0..parameters).map(sticks),
        ));
    }
    let nonlinear = |column| row(column).and_then(Sensitivity::nonlinear).map_or(NONE, i8::from);
    let long_name =
        "whether these runs differ from what time_sensitivity says by more than a tenth, or in their events";
    let words = [(-1, "unknown"), (0, "linear"), (1, "nonlinear")].map(|(code, word)| (code, word.to_owned()));
    columns.push(Column::codes(
        "nonlinear",
        long_name,
        (0..parameters).map(nonlinear),
        words.to_vec(),
    ));
    columns
        .into_iter()
        .for_each(|column| group.over(&["parameter"], column));
}

/// In which count a sequence of events differs from another: "51 sticks instead of 54".
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

/// Why a case cannot have a value, in a few words.
fn invalid(error: &CaseError, path: &str) -> String {
    let Some(problem) = error.problems.first() else {
        return "impossible".to_owned();
    };
    // What comes after is the values, and what to do about a case that someone wrote.
    let complaint = problem.message.split([':', ';', ',']).next().unwrap_or_default();
    let key = if problem.key.is_empty() { path } else { &problem.key };
    format!("{key}: {complaint}")
}
