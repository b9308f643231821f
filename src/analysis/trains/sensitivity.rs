//! What the numbers of a case of trains do to the events of its run, and to what the run comes to.
//!
//! Derivatives are carried along a run by `series` ([`variation`](crate::simulation::trains::variation)), with the number moved in
//! copies of the case: so everything is differentiated that a case can have, table, harmonic or bristle, by what the case file says
//! of it. Two widths of the moves tell how far a derivative can be off. What half a last digit does is told by a run of its own.

use crate::analysis::attractor::{Attractor, Recurrence};
use crate::analysis::deadline::INTERRUPTED;
use crate::analysis::influence::ParameterName;
use crate::analysis::sensitivity::{
    Affected, Outcome, Rerun, Sensitivities, Sensitivity, difference, in_event_sequence, invalid,
};
use crate::case::{CaseError, CaseSource, Override, TrainCase, TrainNumber};
use crate::hybrid::RunError;
use crate::model::Mode;
use crate::record::{Event, EventKind, Recorder, RecorderError, Sample, Segment};
use crate::run::Run;
use crate::simulation::trains::{MovedTrains, variation};
use crate::simulation::{Method, OutputOptions, SolverOptions};
use crate::workers::over_processors;
use std::ops::ControlFlow;

/// Relative tolerance of the runs.
const RTOL: f64 = 1e-13;

/// Steps of Taylor series that the run of the case may take for others to be made of it: about a second. A rerun may take some
/// times as many.
const MOST_STEPS: usize = 40_000;
const RERUN_FACTOR: usize = 4;

/// The moves of a number, relative to it: the one whose derivatives count, and a wider one that tells their error.
const WIDTHS: [f64; 2] = [1.0 / 262_144.0, 1.0 / 131_072.0];

/// Numbers whose derivatives one run carries.
const TOGETHER: usize = 8;

/// Roundings of a time in a difference of two, over the move.
const DIFFERENCE_ROUNDING: f64 = 4.0;

/// The error of the integration, as a share of the largest derivative so far.
const CARRIED: f64 = 1e-9;

/// Units of the last place that the time of an event varies by between two runs whose numbers hardly differ: the rounding of
/// the state at every event before it.
const ROUNDING: f64 = 16.0;

/// A result that would change by less than this share if a number were changed by all of itself does not depend on it.
const NEGLIGIBLE: f64 = 1e-8;

/// A derivative, and how far it can be off; NaN where there is none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slope {
    /// s per unit of the parameter.
    pub value: f64,
    /// In the same unit.
    pub uncertainty: f64,
}

impl Slope {
    const NONE: Slope = Slope {
        value: f64::NAN,
        uncertainty: f64::NAN,
    };
}

/// What the numbers of a case do.
#[derive(Debug, Clone)]
pub struct TrainSensitivities {
    /// The numbers of the case as it is written, zeros left out.
    pub parameters: Vec<ParameterName>,
    /// d(event time)/d(parameter): a row of all parameters for each event that is certain.
    pub events: Vec<Vec<Slope>>,
    /// What half a last digit does to what the run comes to; `None` without an event of the contact.
    pub result: Option<Sensitivities>,
}

/// Keeps times, kinds and modes of the events.
#[derive(Debug, Default)]
struct Times(Vec<(f64, EventKind, Mode)>);

impl Recorder for Times {
    fn stores_motion(&self) -> bool {
        false
    }

    fn sample(&mut self, _: &Sample) -> Result<(), RecorderError> {
        Ok(())
    }

    fn event(&mut self, event: &Event) -> Result<(), RecorderError> {
        self.0.push((event.time, event.kind, event.mode_after));
        Ok(())
    }

    fn segment(&mut self, _: &Segment) -> Result<(), RecorderError> {
        Ok(())
    }

    fn stores_events(&self) -> bool {
        true
    }
}

/// What a run came to.
struct Outrun {
    events: Vec<(f64, EventKind, Mode)>,
    steps: usize,
    attractor: Option<Attractor>,
    final_stick: Option<f64>,
    sticks: usize,
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
    Invalid(CaseError),
    Failed(String),
    TooLong,
    Interrupted,
}

/// The case as it is written, and how it is run.
struct Written<'a> {
    source: &'a CaseSource,
    overrides: &'a [Override],
    stop: &'a (dyn Fn() -> bool + Sync),
}

impl Written<'_> {
    /// The case with this number changed.
    fn case(&self, change: Option<(&str, f64)>) -> Result<TrainCase, CaseError> {
        let mut overrides = self.overrides.to_vec();
        overrides.extend(change.map(|(path, value)| Override::number(path, value)));
        TrainCase::parse(self.source, &overrides)
    }

    fn solver(&self, case: &TrainCase, max_steps: Option<usize>) -> SolverOptions {
        SolverOptions {
            method: Method::Series,
            rtol: RTOL,
            max_events: case.solver.max_events,
            max_steps,
            ..SolverOptions::default()
        }
    }

    fn go_on(&self) -> ControlFlow<()> {
        match (self.stop)() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }

    /// The run of the case with this number changed, in so many steps at most.
    fn run(&self, change: Option<(&str, f64)>, max_steps: Option<usize>) -> Result<Outrun, NoRun> {
        let case = self.case(change).map_err(NoRun::Invalid)?;
        let solver = self.solver(&case, max_steps);
        let output = OutputOptions::at_the_ends(case.output.end_time);
        let trains = &case.parameters;
        let threshold = case.threshold.unwrap_or(0.0);
        let mut times = Times::default();
        let mut recurrence = Recurrence::new(trains, &mut times);
        let ended = Run::of_trains(trains, threshold, &solver, &output)
            .record(&mut recurrence)
            .control(|_| self.go_on())
            .start();
        let report = match ended {
            Err(failure) if matches!(failure.error, RunError::TooManySteps { .. }) => return Err(NoRun::TooLong),
            Err(failure) => return Err(NoRun::Failed(failure.to_string())),
            Ok(report) if report.interrupted => return Err(NoRun::Interrupted),
            Ok(report) => report,
        };
        let attractor = recurrence.attractor(trains, threshold);
        let sticks = report.digest.cycles.stick_count;
        let final_stick = report.digest.cycles.final_stick_time;
        Ok(Outrun {
            steps: report.work.iter().map(|work| work.steps as usize).sum(),
            events: times.0,
            attractor,
            final_stick,
            sticks,
        })
    }
}

/// What is differentiated: events of the run `base`, and its result.
struct Differentiated<'a> {
    written: Written<'a>,
    base: Outrun,
    /// The last certain event that is one of the contact.
    last: usize,
    of: Option<Affected>,
}

/// What one number does.
struct Row {
    /// To every event of the run.
    events: Vec<Slope>,
    /// Whether the run begins alike with the number moved, so that its events are the same.
    alike: bool,
}

/// Differentiates the events of a run of a case, as it is written in `source` with `overrides`, of which the first `certain`
/// are. `given`, where the source is a resolved case, is the text that it was made of: the last digit of a number is that of the
/// same number there, and not known of others. `stop` is asked now and then.
///
/// # Errors
/// In words, why there are no derivatives.
pub fn sensitivities(
    source: &CaseSource,
    overrides: &[Override],
    given: Option<&CaseSource>,
    certain: &[Event],
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<TrainSensitivities, String> {
    let mut numbers = TrainCase::numbers(source, overrides).map_err(|error| error.to_string())?;
    if let Some(given) = given {
        let written = TrainCase::numbers(given, &[]).unwrap_or_default();
        for number in &mut numbers {
            // One number may stand for a list of one.
            let same = |other: &&TrainNumber| {
                let of_list = number.path.strip_suffix(".0");
                (other.path == number.path || of_list == Some(&other.path)) && other.value == number.value
            };
            number.half_last_digit = written.iter().find(same).and_then(|other| other.half_last_digit);
        }
    }
    let written = Written {
        source,
        overrides,
        stop,
    };
    let base = written.run(None, None).map_err(|why| match why {
        NoRun::Invalid(error) => error.to_string(),
        NoRun::Failed(text) => format!("series does not run this case: {text}"),
        NoRun::TooLong => "series takes too many steps".to_owned(),
        NoRun::Interrupted => INTERRUPTED.to_owned(),
    })?;
    let own: Vec<_> = certain.iter().map(|e| (e.time, e.kind, e.mode_after)).collect();
    let same = agreeing(&own, &base.events);
    if same < own.len() {
        return Err(format!(
            "series agrees with {same} of the {} events that are certain",
            own.len()
        ));
    }
    let all = own.len() == base.events.len();
    let sticks = TrainCase::parse(source, overrides).is_ok_and(|case| case.threshold.is_none());
    // A corner of a signal is no result.
    let last = own.iter().rposition(|event| event.1.in_event_sequence());
    let of = match (&base.attractor, base.final_stick) {
        _ if last.is_none() => None,
        (Some(_), _) if all => Some(Affected::AttractorPeriod),
        // A contact without stick comes to none that lasts.
        (None, Some(_)) if all && sticks => Some(Affected::FinalStick),
        _ => Some(Affected::LastEvent),
    };
    let differentiated = Differentiated {
        written,
        base,
        last: last.unwrap_or_default(),
        of,
    };
    let groups: Vec<&[TrainNumber]> = numbers.chunks(TOGETHER).collect();
    let rows = over_processors(groups.len(), stop, |index| differentiated.rows(groups[index]));
    let rows: Option<Vec<Vec<Row>>> = rows.into_iter().collect();
    let rows: Vec<Row> = rows.unwrap_or_default().into_iter().flatten().collect();
    if rows.len() != numbers.len() {
        return Err(INTERRUPTED.to_owned());
    }
    let reruns = over_processors(numbers.len(), stop, |index| differentiated.reruns(&numbers[index]));
    let reruns: Option<Vec<_>> = reruns.into_iter().collect();
    let Some(reruns) = reruns.filter(|reruns| reruns.len() == numbers.len()) else {
        return Err(INTERRUPTED.to_owned());
    };
    let of_result = |(number, (row, reruns)): (&TrainNumber, (&Row, Option<[Rerun; 2]>))| Sensitivity {
        parameter: name(number),
        slope: differentiated.slope_of_result(number, row),
        half_last_digit: number.half_last_digit,
        reruns,
    };
    Ok(TrainSensitivities {
        parameters: numbers.iter().map(name).collect(),
        events: (0..own.len())
            .map(|event| rows.iter().map(|row| row.of_event(event)).collect())
            .collect(),
        result: of.zip(differentiated.result()).map(|(of, (time, _))| Sensitivities {
            of,
            time,
            rows: numbers.iter().zip(rows.iter().zip(reruns)).map(of_result).collect(),
            without_reruns: differentiated.without_reruns(),
            held: String::new(),
        }),
    })
}

fn name(number: &TrainNumber) -> ParameterName {
    ParameterName {
        path: number.path.clone(),
        unit: number.unit,
        value: number.value,
    }
}

impl Row {
    /// What the number does to an event; nothing where runs with the number moved have another there.
    fn of_event(&self, event: usize) -> Slope {
        if self.alike { self.events[event] } else { Slope::NONE }
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
    fn result(&self) -> Option<(f64, f64)> {
        self.base.result(self.of?, self.last)
    }

    /// The case with a number moved by so much, to both sides, or twice to the one to which it can be moved. None where it
    /// cannot be moved.
    fn moved(&self, number: &TrainNumber, width: f64) -> Vec<MovedTrains> {
        let h = width * number.value.abs();
        let copy = |steps: f64, weight: f64, bend: f64| {
            let case = self.written.case(Some((&number.path, number.value + steps * h))).ok()?;
            Some(MovedTrains {
                threshold: case.threshold.unwrap_or(0.0),
                trains: case.parameters,
                weight: weight / h,
                bend,
            })
        };
        let all = |copies: &[(f64, f64, f64)]| -> Option<Vec<MovedTrains>> {
            copies
                .iter()
                .map(|&(steps, weight, bend)| copy(steps, weight, bend))
                .collect()
        };
        let one_sided = |side: f64| {
            all(&[
                (0.0, -1.5 * side, 1.0),
                (side, 2.0 * side, -2.0),
                (2.0 * side, -0.5 * side, 1.0),
            ])
        };
        let central = all(&[(1.0, 0.5, 1.0), (-1.0, -0.5, 1.0)]);
        let found = central.or_else(|| one_sided(1.0)).or_else(|| one_sided(-1.0));
        found.unwrap_or_default()
    }

    /// What each of these numbers does to the events; `None` if it was interrupted.
    fn rows(&self, numbers: &[TrainNumber]) -> Option<Vec<Row>> {
        let columns: Vec<Vec<MovedTrains>> = numbers
            .iter()
            .flat_map(|number| WIDTHS.map(|width| self.moved(number, width)))
            .collect();
        let case = self.written.case(None).ok()?;
        let mut times = Times::default();
        let carried = variation(
            (&case.parameters, case.threshold.unwrap_or(0.0)),
            &columns,
            &self.written.solver(&case, None),
            &OutputOptions::at_the_ends(case.output.end_time),
            &mut times,
            &mut |_| self.written.go_on(),
        );
        if (self.written.stop)() {
            return None;
        }
        // The same steps have been made before.
        let Ok(found) = carried else {
            return Some(numbers.iter().map(|_| self.none()).collect());
        };
        if agreeing(&times.0, &self.base.events) < self.base.events.len() || found.times.len() < times.0.len() {
            return Some(numbers.iter().map(|_| self.none()).collect());
        }
        let row = |(index, number): (usize, &TrainNumber)| {
            let size = number.value.abs();
            let mut largest = 0.0f64;
            let slope = |(event, row): (usize, &Vec<f64>)| {
                let (value, wide) = (row[2 * index], row[2 * index + 1]);
                largest = largest.max(value.abs());
                let rounding = DIFFERENCE_ROUNDING * f64::EPSILON * self.base.events[event].0 / (WIDTHS[0] * size);
                Slope {
                    value,
                    uncertainty: (value - wide).abs() + CARRIED * largest + rounding,
                }
            };
            let known = !columns[2 * index].is_empty();
            Row {
                events: match known {
                    true => found.times.iter().enumerate().map(slope).collect(),
                    false => self.none().events,
                },
                alike: found.alike[2 * index],
            }
        };
        Some(numbers.iter().enumerate().map(row).collect())
    }

    fn none(&self) -> Row {
        Row {
            events: vec![Slope::NONE; self.base.events.len()],
            alike: false,
        }
    }

    /// d(result)/d(number), s per unit, if it is known to a digit.
    fn slope_of_result(&self, number: &TrainNumber, row: &Row) -> Option<f64> {
        let (value, _) = self.result()?;
        let found = match self.of? {
            Affected::AttractorPeriod => self.slope_of_period(row)?,
            Affected::FinalStick => {
                let at = self.base.final_stick?;
                row.of_event(self.base.events.iter().position(|event| event.0 == at)?)
            }
            Affected::LastEvent => row.of_event(self.last),
        };
        // What is not known to a digit is not said.
        let negligible = (found.value.abs() + found.uncertainty) * number.value.abs() < NEGLIGIBLE * value;
        if found.uncertainty < 0.1 * found.value.abs() {
            Some(found.value)
        } else {
            negligible.then_some(0.0)
        }
    }

    /// That of the last period of the motion: by how much it still changes from period to period it is uncertain.
    fn slope_of_period(&self, row: &Row) -> Option<Slope> {
        let sections = self.base.attractor.as_ref()?.sections;
        let events = self.base.events.iter().enumerate();
        let hits = events.filter(|(_, event)| matches!(event.1, EventKind::Slip | EventKind::Reversal));
        let hits: Vec<usize> = hits.map(|(index, _)| index).collect();
        let from_last = |back: usize| Some(row.events[hits[hits.len().checked_sub(1 + back * sections)?]]);
        let (last, before, first) = (from_last(0)?, from_last(1)?, from_last(2)?);
        let (period, earlier) = (last.minus(before), before.minus(first));
        Some(Slope {
            value: period.value,
            uncertainty: period.uncertainty + (period.value - earlier.value).abs(),
        })
    }

    /// Why there are no reruns, where there are none.
    fn without_reruns(&self) -> Option<String> {
        (self.base.steps > MOST_STEPS).then(|| {
            format!("the run takes more than {MOST_STEPS} steps, and two more runs are needed for each number")
        })
    }

    /// What half a last digit of a number does to the result, if that is known; outer `None` if it was interrupted.
    fn reruns(&self, number: &TrainNumber) -> Option<Option<[Rerun; 2]>> {
        let (Some(half), Some(of), None) = (number.half_last_digit, self.of, self.without_reruns()) else {
            return Some(None);
        };
        let (value, _) = self.result()?;
        let rerun = |change: f64| self.rerun(of, number, number.value + change, value);
        Some(Some([rerun(-half)?, rerun(half)?]))
    }

    /// The case with another number; `None` if it was interrupted.
    fn rerun(&self, of: Affected, number: &TrainNumber, value: f64, own: f64) -> Option<Rerun> {
        let rerun = |outcome, shift, sticks, remark: String| {
            Some(Rerun {
                value,
                outcome,
                shift,
                sticks,
                remark,
            })
        };
        let last = self.last;
        let run = match self
            .written
            .run(Some((&number.path, value)), Some(RERUN_FACTOR * MOST_STEPS))
        {
            Ok(run) => run,
            Err(NoRun::Interrupted) => return None,
            Err(NoRun::Invalid(error)) => return rerun(Outcome::Invalid, None, None, invalid(&error, &number.path)),
            Err(NoRun::Failed(text)) => {
                return rerun(Outcome::Failed, None, None, format!("the run failed: {text}"));
            }
            Err(NoRun::TooLong) => return rerun(Outcome::TooLong, None, None, "the run takes too long".to_owned()),
        };
        let noise = self.result().map_or(0.0, |(_, noise)| noise);
        // A difference that the convergence of the two attractors leaves open is none.
        let shift = run.result(of, last).map(|(time, other)| {
            let shift = time - own;
            if of == Affected::AttractorPeriod && shift.abs() <= noise + other {
                0.0
            } else {
                shift
            }
        });
        let like = run.is_like(of, &self.base, last);
        let outcome = match (shift, of) {
            (Some(_), _) if like => Outcome::SameEvents,
            (None, Affected::AttractorPeriod) => Outcome::NoPeriod,
            (None, Affected::FinalStick) => Outcome::NoFinalStick,
            _ => Outcome::OtherEvents,
        };
        let remark = match (outcome, &run.attractor, &self.base.attractor) {
            (Outcome::SameEvents, ..) => String::new(),
            (Outcome::NoPeriod, ..) => "the motion does not repeat itself by the end of the run".to_owned(),
            (Outcome::NoFinalStick, ..) => "the run does not end in a stick".to_owned(),
            (_, Some(other), Some(base)) => format!(
                "{} sticks and {} sections in a period instead of {} and {}",
                other.sticks, other.sections, base.sticks, base.sections
            ),
            _ => difference(&run.word(), &self.base.word()),
        };
        // The time of another event is no shift of this one.
        let shift = shift.filter(|_| like || of != Affected::LastEvent);
        rerun(outcome, shift, Some(run.sticks), remark)
    }
}
