//! What the numbers of a case of trains do to the events of its run, and to what the run comes to.
//!
//! A derivative is a difference between runs by `series`, whose events are exact to rounding: at six steps, each a sixteenth of
//! the one before, with the leading error extrapolated away. It counts where every narrower step confirms it: where small changes
//! grow, wide steps know nothing of the slope, and some agree with each other by chance. So everything is
//! differentiated that a case can have, table, harmonic or bristle, by what the case file says of it.

use crate::analysis::attractor::{Attractor, Recurrence};
use crate::analysis::influence::ParameterName;
use crate::analysis::sensitivity::{
    Affected, Outcome, Rerun, Sensitivities, Sensitivity, difference, in_event_sequence, invalid,
};
use crate::case::{CaseError, CaseSource, Override, TrainCase, TrainNumber};
use crate::hybrid::RunError;
use crate::model::Mode;
use crate::record::{Event, EventKind, Recorder, RecorderError, Sample, Segment};
use crate::run::Run;
use crate::simulation::{Method, OutputOptions, SolverOptions};
use crate::workers::over_processors;
use std::ops::ControlFlow;

/// Relative tolerance of the runs.
const RTOL: f64 = 1e-13;

/// Steps of Taylor series that the run of the case may take for others to be made, and a rerun: about a second.
const MOST_STEPS: usize = 40_000;
const RERUN_FACTOR: usize = 4;

/// The steps of a difference, relative to the number: the widest, and how many times narrower the next is.
const WIDEST: f64 = 1.0 / 256.0;
const NARROWING: f64 = 16.0;
const WIDTHS: usize = 6;

/// The slopes below and above a number, as long as they differ by no more than this share and their noise, are one: else there is
/// a corner between them, as where two corners of signals fall together, or the step is too wide.
const ONE_SLOPE: f64 = 0.2;

/// What is confirmed lies within this many times the noise.
const WITHIN_NOISE: f64 = 4.0;

/// Noise beyond this many times that of rounding is no noise, but a motion that the narrowest steps do not resolve.
const MOST_NOISE: f64 = 1e4;

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
    /// From the first on, those that are the same as in the run of the case itself.
    agreeing: usize,
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
    /// The run of the case with this number changed, in `factor` times the steps that the case itself may take.
    fn run(&self, change: Option<(&str, f64)>, factor: usize) -> Result<Outrun, NoRun> {
        let mut overrides = self.overrides.to_vec();
        overrides.extend(change.map(|(path, value)| Override::number(path, value)));
        let case = TrainCase::parse(self.source, &overrides).map_err(NoRun::Invalid)?;
        let solver = SolverOptions {
            method: Method::Series,
            rtol: RTOL,
            max_events: case.solver.max_events,
            max_steps: Some(factor * MOST_STEPS),
            ..SolverOptions::default()
        };
        let output = OutputOptions::at_the_ends(case.output.end_time);
        let trains = &case.parameters;
        let threshold = case.threshold.unwrap_or(0.0);
        let mut times = Times::default();
        let mut recurrence = Recurrence::new(trains, &mut times);
        let ended = Run::of_trains(trains, threshold, &solver, &output)
            .record(&mut recurrence)
            .control(|_| match (self.stop)() {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            })
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
            agreeing: times.0.len(),
            events: times.0,
            attractor,
            final_stick,
            sticks,
        })
    }
}

/// What is differentiated: `certain` events of the run `base`, and its result.
struct Differences<'a> {
    written: Written<'a>,
    base: Outrun,
    certain: usize,
    /// The last of them that is an event of the contact.
    last: usize,
    of: Option<Affected>,
}

/// What became of the case with a number changed.
enum Side {
    Run(Outrun),
    /// The case cannot have the number.
    Invalid,
    /// The run failed, or takes too long.
    Unknown,
}

impl Side {
    fn run(&self) -> Option<&Outrun> {
        match self {
            Side::Run(run) => Some(run),
            _ => None,
        }
    }
}

/// A number changed by a step, downwards and upwards.
struct Pair {
    /// In the unit of the number.
    step: f64,
    sides: [Side; 2],
}

/// What one number does.
struct Row {
    events: Vec<Slope>,
    result: Option<Sensitivity>,
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
    let base = written.run(None, 1).map_err(|why| match why {
        NoRun::Invalid(error) => error.to_string(),
        NoRun::Failed(text) => format!("series does not run this case: {text}"),
        NoRun::TooLong => format!("a run by series takes more than {MOST_STEPS} steps, and some 150 runs are needed"),
        NoRun::Interrupted => "interrupted".to_owned(),
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
    let differences = Differences {
        written,
        base,
        certain: own.len(),
        last: last.unwrap_or_default(),
        of,
    };
    let rows: Option<Vec<Row>> = over_processors(numbers.len(), stop, |index| differences.row(&numbers[index]))
        .into_iter()
        .collect();
    let rows = rows.filter(|rows| rows.len() == numbers.len());
    let Some(rows) = rows else {
        return Err("interrupted".to_owned());
    };
    Ok(TrainSensitivities {
        parameters: numbers.iter().map(name).collect(),
        events: (0..own.len())
            .map(|event| rows.iter().map(|row| row.events[event]).collect())
            .collect(),
        result: of.zip(differences.result()).map(|(of, (time, _))| Sensitivities {
            of,
            time,
            rows: rows.into_iter().filter_map(|row| row.result).collect(),
            without_reruns: None,
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

impl Differences<'_> {
    fn result(&self) -> Option<(f64, f64)> {
        self.base.result(self.of?, self.last)
    }

    /// What one number does; `None` if it was interrupted.
    fn row(&self, number: &TrainNumber) -> Option<Row> {
        let mut pairs: Vec<Pair> = Vec::with_capacity(WIDTHS);
        let mut width = WIDEST;
        for _ in 0..WIDTHS {
            let step = width * number.value.abs();
            pairs.push(Pair {
                step,
                sides: [self.side(number, -step)?, self.side(number, step)?],
            });
            width /= NARROWING;
        }
        let events = (0..self.certain)
            .map(|event| {
                let own = self.base.events[event].0;
                let of = |run: &Outrun| (event < run.agreeing).then(|| run.events[event].0);
                slope(&pairs, own, of, ROUNDING * f64::EPSILON * own)
            })
            .collect();
        let result = match self.of {
            None => None,
            Some(of) => Some(self.of_result(of, number, &pairs)?),
        };
        Some(Row { events, result })
    }

    /// The run with a number changed; `None` if it was interrupted.
    fn side(&self, number: &TrainNumber, change: f64) -> Option<Side> {
        match self
            .written
            .run(Some((&number.path, number.value + change)), RERUN_FACTOR)
        {
            Ok(mut run) => {
                run.agreeing = agreeing(&run.events, &self.base.events);
                Some(Side::Run(run))
            }
            Err(NoRun::Invalid(_)) => Some(Side::Invalid),
            Err(NoRun::Interrupted) => None,
            Err(NoRun::Failed(_) | NoRun::TooLong) => Some(Side::Unknown),
        }
    }

    /// What one number does to the result; `None` if it was interrupted.
    fn of_result(&self, of: Affected, number: &TrainNumber, pairs: &[Pair]) -> Option<Sensitivity> {
        let last = self.last;
        let (value, noise) = self.result()?;
        let at = |run: &Outrun| {
            let like = run.is_like(of, &self.base, last);
            like.then(|| run.result(of, last)).flatten()
        };
        let runs = pairs.iter().flat_map(|pair| &pair.sides).filter_map(Side::run);
        let noise = runs.filter_map(at).fold(noise, |noise, (_, other)| noise.max(other));
        let found = slope(pairs, value, |run| Some(at(run)?.0), noise);
        // What is not known to a digit is not said.
        let negligible = (found.value.abs() + found.uncertainty) * number.value.abs() < NEGLIGIBLE * value;
        let slope = if found.uncertainty < 0.1 * found.value.abs() {
            Some(found.value)
        } else {
            negligible.then_some(0.0)
        };
        let reruns = match number.half_last_digit {
            None => None,
            Some(half) => {
                let rerun = |change: f64| self.rerun(of, number, number.value + change, value);
                Some([rerun(-half)?, rerun(half)?])
            }
        };
        Some(Sensitivity {
            parameter: name(number),
            slope,
            half_last_digit: number.half_last_digit,
            reruns,
        })
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
        let run = match self.written.run(Some((&number.path, value)), RERUN_FACTOR) {
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

/// The derivative of what `of` takes from a run, which is `own` in the run of the case itself: by central differences at several
/// steps, or by one-sided ones where the case cannot have the number on the other side. `noise` is what the value varies by
/// between runs whose numbers hardly differ.
fn slope(pairs: &[Pair], own: f64, of: impl Fn(&Outrun) -> Option<f64>, noise: f64) -> Slope {
    let at_limit = |side: usize| pairs.iter().all(|pair| matches!(pair.sides[side], Side::Invalid));
    let one_sided = at_limit(0) || at_limit(1);
    let difference = |pair: &Pair, noise: f64| {
        let of_side = |side: usize| {
            let value = pair.sides[side].run().and_then(&of)?;
            Some((value - own) / if side == 0 { -pair.step } else { pair.step })
        };
        if one_sided {
            return of_side(usize::from(at_limit(0)));
        }
        let (below, above) = (of_side(0)?, of_side(1)?);
        let noise = WITHIN_NOISE * 2.0 * noise / pair.step;
        let one = (above - below).abs() <= ONE_SLOPE * above.abs().max(below.abs()) + noise;
        one.then(|| f64::midpoint(below, above))
    };
    // What the narrowest steps scatter by is noise that has grown on the way to the event.
    let scattered = |pair: &[Pair]| {
        let any = f64::INFINITY;
        let (wide, narrow) = (difference(&pair[0], any)?, difference(&pair[1], any)?);
        Some((wide - narrow).abs() * pair[1].step / 2.0)
    };
    let last = pairs.len().saturating_sub(3);
    let scatter = pairs[last..].windows(2).map(scattered);
    let Some(grown) = scatter.reduce(|one, other| Some(one?.max(other?))).flatten() else {
        return Slope::NONE;
    };
    if grown > MOST_NOISE * noise {
        return Slope::NONE;
    }
    let noise = noise.max(grown);
    // (difference, what the noise of its values makes of it)
    let mut differences: Vec<Option<(f64, f64)>> = pairs
        .iter()
        .map(|pair| Some((difference(pair, noise)?, 2.0 * noise / pair.step)))
        .collect();
    // The error of a one-sided difference is of first order, that of a central one of second.
    if one_sided {
        differences = extrapolated(&differences, NARROWING);
    }
    let better = extrapolated(&differences, NARROWING * NARROWING);
    let candidates = better.iter().enumerate().filter_map(|(index, better)| {
        let better = (*better)?;
        let narrow = differences[index + 1]?;
        let found = Slope {
            value: better.0,
            uncertainty: (better.0 - narrow.0).abs() + better.1,
        };
        let narrower = &differences[index + 2..];
        let confirms = |other: &Option<(f64, f64)>| {
            other.is_some_and(|(value, noise)| (value - found.value).abs() <= found.uncertainty + WITHIN_NOISE * noise)
        };
        (!narrower.is_empty() && narrower.iter().all(confirms)).then_some(found)
    });
    candidates
        .min_by(|a, b| a.uncertainty.total_cmp(&b.uncertainty))
        .unwrap_or(Slope::NONE)
}

/// Takes away an error that falls by `factor` from each to the next.
fn extrapolated(differences: &[Option<(f64, f64)>], factor: f64) -> Vec<Option<(f64, f64)>> {
    let pairs = differences.windows(2);
    pairs
        .map(|pair| {
            let (wide, narrow) = (pair[0]?, pair[1]?);
            let share = 1.0 / (factor - 1.0);
            Some((
                narrow.0 + share * (narrow.0 - wide.0),
                narrow.1 + share * (narrow.1 + wide.1),
            ))
        })
        .collect()
}
