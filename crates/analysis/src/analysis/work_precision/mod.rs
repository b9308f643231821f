//! Work-precision study: methods and tolerances on one case, compared with a reference.
//!
//! Errors are those of event times, because hybrid runs cannot be compared pointwise: first stick, final stick, and
//! the largest error over all events. The last one requires the reference's sequence. The first two only require such
//! a stick in both runs.

mod study;

pub use crate::study::StudySource;
pub(crate) use study::KEY_TABLES;
pub use study::{Knob, PrecisionStudy, ReferenceChoice, STUDIES};

use study::{FALLBACK, TIGHTEST};

use super::exact::{Truth, request as oracle_request};
use crate::error::Error;
use crate::provenance;
use crate::study::StudyRun;
use serde::{Serialize, Serializer};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use stickslip_case::{Case, ExactCase};
use stickslip_engine::run::Run;
use stickslip_engine::simulation::{Method, RunReport};
use stickslip_files::schema::{INPUT_RESOLVED, Variable, WORK_PRECISION_FORMAT, group, kind_flags};
use stickslip_files::{
    Addition, DeclaredColumn, FileColumn, FileKind, Reason, Reservation, ResultError, Status, StudyFile, StudyHeader,
    columns,
};
use stickslip_oracle::{OracleRequest, solve};
use stickslip_system::record::{Event, EventKind, NoRecorder};
use stickslip_system::watch::Watch;

/// Reference events of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct PrecisionReference {
    /// Origin, in words.
    pub description: String,
    /// Kinds and times (s), in order.
    pub events: Vec<(EventKind, f64)>,
    /// Uncertainty of each time, s: distance to an independent method, or spacing of doubles for exact times.
    pub uncertainties: Vec<f64>,
}

/// Errors of one run, s; `None` if they cannot be compared.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct MethodErrors {
    /// Error of the first stick.
    pub onset: Option<f64>,
    /// Error of the stick that ends the run.
    pub final_stick: Option<f64>,
    /// Largest error over all events, if the sequence is the reference's.
    #[serde(rename = "largest_event")]
    pub largest: Option<f64>,
}

/// One run of a study.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measurement {
    /// Integration method.
    #[serde(serialize_with = "by_name")]
    pub method: Method,
    /// Tolerance or step.
    #[serde(flatten)]
    pub knob: Knob,
    /// Errors against the reference.
    #[serde(rename = "error")]
    pub errors: MethodErrors,
    /// Number of events in the sequence.
    pub events: usize,
    /// Whether the sequence is the reference's.
    pub same_sequence: bool,
    /// Accepted steps.
    pub steps: u64,
    /// Calls of the right-hand side.
    pub rhs_evaluations: u64,
    /// Evaluations of the Jacobian.
    pub jacobian_evaluations: u64,
    /// Least wall time of the repetitions, s.
    pub wall_time: f64,
    /// Reason of a failure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
}

impl Measurement {
    fn new(method: Method, knob: Knob) -> Self {
        Measurement {
            method,
            knob,
            errors: MethodErrors::default(),
            events: 0,
            same_sequence: false,
            steps: 0,
            rhs_evaluations: 0,
            jacobian_evaluations: 0,
            wall_time: f64::INFINITY,
            failure: None,
        }
    }
}

fn by_name<S: Serializer>(method: &Method, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(method.name())
}

/// Results of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyResult {
    /// Reference of the errors.
    pub reference: PrecisionReference,
    /// Uncertainty of the reference in each error.
    pub uncertainty: MethodErrors,
    /// Runs in the order of the study.
    pub measurements: Vec<Measurement>,
    /// Whether the study was interrupted.
    pub interrupted: bool,
}

/// Builder of a work-precision study; `start` runs it into its file.
pub type PrecisionRun<'a> = StudyRun<'a, PrecisionStudy>;

impl PrecisionRun<'_> {
    /// Runs the study, and returns the path of its file and the results. An incomplete study keeps the partial name.
    ///
    /// # Errors
    /// There is no reference, the study was interrupted before there was one, the file is protected, or the disk fails.
    pub fn start(self) -> Result<(PathBuf, StudyResult), Error> {
        let of_study = header(self.study, String::new());
        let place = self.place(FileKind::WorkPrecision, &of_study, None, &self.study.head.files)?;
        let started = provenance::now();
        let result = run(self.study, self.watch)?;
        let file = result.write(self.study, &started, &place).map_err(Error::computation)?;
        Ok((file, result))
    }
}

/// Runs a study. A stop ends the study with its results so far. Failed runs are [`Measurement`]s with a failure.
///
/// # Errors
/// There is no reference, or the study was interrupted before there was one.
pub fn run(study: &PrecisionStudy, watch: &dyn Watch) -> Result<StudyResult, Error> {
    let reference = reference(study, watch)?;
    let mut result = StudyResult {
        uncertainty: uncertainty(&reference),
        reference,
        measurements: Vec::with_capacity(study.runs.len()),
        interrupted: false,
    };
    for (done, (method, knob, case)) in (study.reference_cases.len()..).zip(&study.runs) {
        let begun = begin(study, done, *method, watch);
        let measured = begun.and_then(|()| measure(*method, *knob, case, &result.reference, study.repeat, watch));
        let Some(measurement) = measured.ok() else {
            result.interrupted = true;
            break;
        };
        result.measurements.push(measurement);
    }
    Ok(result)
}

/// Reports the start of a run by `method` after `done` runs, including the reference's. Fails if stopped.
fn begin(study: &PrecisionStudy, done: usize, method: Method, watch: &dyn Watch) -> Result<(), Error> {
    let (of, method) = (study.reference_cases.len() + study.runs.len(), method.name());
    match watch.at(done as f64, of as f64, format_args!("{done} of {of} runs, {method}")) {
        ControlFlow::Break(()) => Err(Error::interrupted()),
        ControlFlow::Continue(()) => Ok(()),
    }
}

type MethodSequence = Vec<(EventKind, f64)>;

fn sequence(events: &[Event]) -> MethodSequence {
    let events = events.iter().filter(|event| event.kind.in_event_sequence());
    events.map(|event| (event.kind, event.time)).collect()
}

/// Report of a run. Fails only if stopped; the inner error is that of the run.
fn integrate(case: &Case, watch: &dyn Watch) -> Result<Result<RunReport, String>, Error> {
    let mut recorder = NoRecorder;
    match Run::new(case).record(&mut recorder).watch(&|| watch.stopped()).start() {
        Ok(report) if report.interrupted => Err(Error::interrupted()),
        report => Ok(report.map_err(|failure| failure.to_string())),
    }
}

fn reference(study: &PrecisionStudy, watch: &dyn Watch) -> Result<PrecisionReference, Error> {
    let reference = match &study.reference {
        ReferenceChoice::Truth(path) => {
            let truth = Truth::read(path).map_err(Error::input)?;
            if let Some((_, _, case)) = study.runs.first() {
                truth.check_case(case).map_err(Error::input)?;
            }
            PrecisionReference {
                description: format!("{}: {}", path.display(), truth.method),
                uncertainties: truth.events.iter().map(|event| event.1.next_up() - event.1).collect(),
                events: truth.events,
            }
        }
        ReferenceChoice::Oracle(exact) => match by_oracle(study, exact, watch) {
            Err(error) if !error.is_interrupted() => {
                let mut reference = by_runs(study, FALLBACK, TIGHTEST, watch)?;
                reference.description += &format!("; the exact solver was not used: {error}");
                reference
            }
            reference => reference?,
        },
        ReferenceChoice::Runs { method, check, rtol } => by_runs(study, [*method, *check], *rtol, watch)?,
    };
    match reference.events.is_empty() {
        true => Err(Error::computation(
            "the reference has no event of the sequence (no stick, slip, reversal, separation or contact): let the case run longer",
        )),
        false => Ok(reference),
    }
}

/// Reference by one run. Its uncertainty is the distance to a run by an independent method.
fn by_runs(
    study: &PrecisionStudy,
    [method, check]: [Method; 2],
    rtol: f64,
    watch: &dyn Watch,
) -> Result<PrecisionReference, Error> {
    let mut sequences = Vec::with_capacity(2);
    for (done, case) in study.reference_cases.iter().enumerate() {
        let by = case.solver.method;
        begin(study, done, by, watch)?;
        let report = integrate(case, watch)?.map_err(|failure| {
            let by = by.name();
            Error::computation(format!(
                "the reference cannot be computed: method {by} fails: {failure}; name other methods in [reference], or a truth"
            ))
        })?;
        sequences.push(sequence(&report.events));
    }
    let checked = sequences.pop().unwrap_or_default();
    let events = sequences.pop().unwrap_or_default();
    if !alike(&events, &checked) {
        let parting = events.iter().zip(&checked).position(|(a, b)| a.0 != b.0);
        let parting = parting.unwrap_or(events.len().min(checked.len()));
        let event = events.get(parting).or(checked.get(parting));
        let time = event.map_or(f64::NAN, |event| event.1);
        return Err(Error::computation(format!(
            "there is no reference: {} and {} at rtol {rtol:e} disagree in the sequence of events ({} and {}), first at t = {time:.9} s, \
             so no error can be measured. Without a perturbation that stands above rounding no method converges: set one, tighten \
             reference.rtol, or name a truth",
            method.name(),
            check.name(),
            events.len(),
            checked.len()
        )));
    }
    Ok(PrecisionReference {
        description: format!(
            "{} at rtol {rtol:e}; its uncertainty is the distance of {} at the same tolerance",
            method.name(),
            check.name()
        ),
        uncertainties: events.iter().zip(&checked).map(|(a, b)| (a.1 - b.1).abs()).collect(),
        events,
    })
}

const LONGEST: Duration = Duration::from_secs(30);

/// Digits of the oracle's events: more than a double has.
const DIGITS: u32 = 18;

fn by_oracle(study: &PrecisionStudy, exact: &ExactCase, watch: &dyn Watch) -> Result<PrecisionReference, Error> {
    let (by, _, case) = study.runs.first().ok_or_else(|| Error::input("the study has no run"))?;
    let request = OracleRequest {
        threshold: exact.threshold.clone(),
        ..oracle_request(&case.solver, &case.output, DIGITS, LONGEST)
    };
    begin(study, 0, *by, watch)?;
    let solution = solve(&exact.system, &request, &|| watch.stopped())?;
    let events = solution.report.events.iter().zip(&solution.errors);
    let in_word = events.filter(|(event, _)| event.kind.in_event_sequence());
    let (events, uncertainties) = in_word
        .map(|(event, error)| {
            let time = event.time.to_f64();
            ((event.kind, time), error.max(time.next_up() - time))
        })
        .unzip();
    Ok(PrecisionReference {
        description: format!(
            "the exact solver with {} digits; its uncertainty is the distance of neighbouring doubles",
            solution.digits_computed
        ),
        events,
        uncertainties,
    })
}

fn alike(a: &[(EventKind, f64)], b: &[(EventKind, f64)]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.0 == b.0)
}

fn sticks(events: &[(EventKind, f64)]) -> [Option<usize>; 2] {
    let first = events.iter().position(|event| event.0 == EventKind::Stick);
    let last = events.len().checked_sub(1).filter(|&k| events[k].0 == EventKind::Stick);
    [first, last]
}

fn uncertainty(reference: &PrecisionReference) -> MethodErrors {
    let [onset, final_stick] = sticks(&reference.events).map(|k| k.map(|k| reference.uncertainties[k]));
    MethodErrors {
        onset,
        final_stick,
        largest: Some(reference.uncertainties.iter().copied().fold(0.0, f64::max)),
    }
}

fn errors(reference: &PrecisionReference, events: &[(EventKind, f64)]) -> MethodErrors {
    let (there, here) = (sticks(&reference.events), sticks(events));
    let error = |here: usize, there: usize| (events[here].1 - reference.events[there].1).abs();
    let [onset, final_stick] = [0, 1].map(|k| Some(error(here[k]?, there[k]?)));
    let largest = alike(events, &reference.events).then(|| (0..events.len()).map(|k| error(k, k)).fold(0.0, f64::max));
    MethodErrors {
        onset,
        final_stick,
        largest,
    }
}

fn measure(
    method: Method,
    knob: Knob,
    case: &Case,
    reference: &PrecisionReference,
    repeat: usize,
    watch: &dyn Watch,
) -> Result<Measurement, Error> {
    let mut measurement = Measurement::new(method, knob);
    for _ in 0..repeat {
        let clock = Instant::now();
        let result = integrate(case, watch)?;
        measurement.wall_time = measurement.wall_time.min(clock.elapsed().as_secs_f64());
        match result {
            Ok(report) => {
                let events = sequence(&report.events);
                measurement.errors = errors(reference, &events);
                measurement.events = events.len();
                measurement.same_sequence = alike(&events, &reference.events);
                let sum = |of: fn(&stickslip_engine::simulation::SolverWork) -> u64| report.work.iter().map(of).sum();
                measurement.steps = sum(|w| w.steps);
                measurement.rhs_evaluations = sum(|w| w.rhs_evaluations);
                measurement.jacobian_evaluations = sum(|w| w.jacobian_evaluations);
            }
            Err(failure) => {
                measurement.failure = Some(failure);
                return Ok(measurement);
            }
        }
    }
    Ok(measurement)
}

/// Columns of /runs after the method.
const RUN_COLUMNS: &[DeclaredColumn<Measurement>] = &columns! { run, x:
    Variable::quantity("rtol", "1", "solver.rtol, NaN with a fixed step"),
        known(run.knob.rtol_and_step().0), run.knob = Knob::Tolerance(x);
    Variable::quantity("fixed_step", "s", "solver.fixed_step, NaN with a tolerance"),
        known(run.knob.rtol_and_step().1), if x.is_finite() { run.knob = Knob::FixedStep(x) };
    Variable::code("outcome", "whether the run came to its end", &[(0, "complete"), (1, "failed")]),
        run.failure.is_some().into(), run.failure = (x != 0.0).then(String::new);
    Variable::code("same_sequence", "whether the events are those of the reference, in its order", &[(0, "no"), (1, "yes")]),
        run.same_sequence.into(), run.same_sequence = x != 0.0;
    Variable::count("events", "events of the sequence"), run.events as f64, run.events = x as usize;
    Variable::quantity("onset_error", "s", "error of the first stick, NaN where there is none to compare"),
        known(run.errors.onset), run.errors.onset = finite(x);
    Variable::quantity("final_stick_error", "s", "error of the stick in which the run ends, NaN where there is none to compare"),
        known(run.errors.final_stick), run.errors.final_stick = finite(x);
    Variable::quantity("largest_event_error", "s", "largest error of all events, NaN where their sequence is another"),
        known(run.errors.largest), run.errors.largest = finite(x);
    Variable::count("steps", "steps of the integrators"), run.steps as f64, run.steps = x as u64;
    Variable::count("rhs_evaluations", "evaluations of the right-hand side"),
        run.rhs_evaluations as f64, run.rhs_evaluations = x as u64;
    Variable::count("jacobian_evaluations", "evaluations of the Jacobian"),
        run.jacobian_evaluations as f64, run.jacobian_evaluations = x as u64;
    Variable::quantity("wall_time", "s", "time of the integration, the least of its repetitions"),
        run.wall_time, run.wall_time = x;
};

/// Attributes of /reference: smaller errors count as zero.
const UNCERTAINTIES: &[DeclaredColumn<MethodErrors>] = &columns! { errors, x:
    Variable::quantity("onset_uncertainty", "s", "uncertainty of the first stick"),
        known(errors.onset), errors.onset = finite(x);
    Variable::quantity("final_stick_uncertainty", "s", "uncertainty of the stick in which the run ends"),
        known(errors.final_stick), errors.final_stick = finite(x);
    Variable::quantity("largest_event_uncertainty", "s", "largest uncertainty of all events"),
        known(errors.largest), errors.largest = finite(x);
};

fn known(value: Option<f64>) -> f64 {
    value.unwrap_or(f64::NAN)
}

fn finite(value: f64) -> Option<f64> {
    Some(value).filter(|value| value.is_finite())
}

fn header(study: &PrecisionStudy, history: String) -> StudyHeader {
    let resolved = study.runs.first().map(|run| run.2.resolved()).unwrap_or_default();
    let about = "every parameter of the first run in SI units (TOML)";
    StudyHeader {
        inputs: vec![(INPUT_RESOLVED, about, resolved)],
        ..study.head.of_file(history)
    }
}

impl StudyResult {
    fn write(&self, study: &PrecisionStudy, started: &str, place: &Reservation) -> Result<PathBuf, ResultError> {
        let header = StudyHeader {
            meta: provenance::program(started),
            ..header(study, format!("{started} {}", provenance::command_line()))
        };
        let mut methods: Vec<Method> = Vec::new();
        for run in &self.measurements {
            if !methods.contains(&run.method) {
                methods.push(run.method);
            }
        }
        let words = methods.iter().map(|method| method.name().to_owned());
        let code = |run: &Measurement| methods.iter().position(|&method| method == run.method);
        let codes = self.measurements.iter().map(|run| code(run).unwrap_or_default() as i8);
        let mut runs = Addition::new(group::RUNS);
        runs.dimension("run", self.measurements.len(), "index of the run");
        let words = (0..).zip(words).collect();
        let method = FileColumn::codes("method", "integration method", codes, words);
        let columns = RUN_COLUMNS.iter().map(|column| column.of(&self.measurements));
        for column in std::iter::once(method).chain(columns) {
            runs.over(&["run"], column);
        }
        let PrecisionReference {
            description,
            events,
            uncertainties,
        } = &self.reference;
        let mut reference = Addition::new(group::REFERENCE);
        reference.attribute("description", description.as_str());
        reference.quantities(
            UNCERTAINTIES
                .iter()
                .map(|one| ((one.variable)(), (one.get)(&self.uncertainty))),
        );
        reference.dimension("event", events.len(), "index of the event");
        let kinds = Variable::code("kind", "what happened", &kind_flags());
        let uncertainties = uncertainties.iter().copied();
        for column in [
            FileColumn::new(kinds, events.iter().map(|event| event.0.code().into())),
            FileColumn::numbers("time", "s", "time", events.iter().map(|event| event.1)),
            FileColumn::numbers("time_uncertainty", "s", "uncertainty of the time", uncertainties),
        ] {
            reference.over(&["event"], column);
        }
        let status = Status::of(self.interrupted);
        header.write(WORK_PRECISION_FORMAT, &[runs, reference], place, &status)
    }

    /// Reads title and results of a study for a figure, without the events of the reference.
    ///
    /// # Errors
    /// The file is missing, of another kind, of a newer version, or damaged.
    pub fn read(path: &Path) -> Result<(String, StudyResult), ResultError> {
        let file = StudyFile::open(path, WORK_PRECISION_FORMAT)?;
        let runs = file.table(group::RUNS)?;
        let methods = file.variable("runs/method")?.flags;
        let codes = runs.column("method")?.into_iter();
        let found = codes.map(|code| {
            let name = methods.get(code as usize).filter(|_| code >= 0.0);
            let (what, code) = ("/runs/method", code as i8);
            let method = name.and_then(|(_, name)| Method::from_name(name));
            let method = method.ok_or_else(|| Reason::UnknownCode { what, code }.of(path))?;
            Ok(Measurement::new(method, Knob::Tolerance(f64::NAN)))
        });
        let mut measurements = found.collect::<Result<Vec<_>, ResultError>>()?;
        for column in RUN_COLUMNS {
            column.read(&runs, &mut measurements)?;
        }
        let mut uncertainty = MethodErrors::default();
        for one in UNCERTAINTIES {
            let value = file.number(&format!("{}/{}", group::REFERENCE, (one.variable)().name))?;
            (one.set)(&mut uncertainty, value.unwrap_or(f64::NAN));
        }
        let description = file.text(&format!("{}/description", group::REFERENCE))?;
        let result = StudyResult {
            reference: PrecisionReference {
                description: description.unwrap_or_default(),
                events: Vec::new(),
                uncertainties: Vec::new(),
            },
            uncertainty,
            measurements,
            interrupted: false,
        };
        Ok((file.text("title")?.unwrap_or_default(), result))
    }
}
