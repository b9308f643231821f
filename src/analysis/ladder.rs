//! The ladder: one case by independent methods, at several tolerances, and its events matched with those of a result.

use super::deadline::Deadline;
use super::verdict::LEAST_WITNESSES;
use crate::case::Case;
use crate::model::margin;
use crate::record::{Event, FurtherColumns, MemoryRecorder};
use crate::run::Run;
use crate::simulation::{Method, OutputOptions, RunReport, SolverOptions};
use crate::simulation::{natural_period, single_method};
use crate::workers::over_processors;
use serde::Serialize;
use std::time::Instant;

/// Methods and relative tolerances of the ladder. Of each method the last is the finest. `series` is last, as its
/// milliseconds fill what the others leave of the processors' time.
pub(crate) const RUNGS: [(Method, f64); 11] = [
    (Method::Arkode, 1e-9),
    (Method::Arkode, 1e-12),
    (Method::Erk, 1e-9),
    (Method::Erk, 1e-12),
    (Method::CvodeAdams, 1e-9),
    (Method::CvodeAdams, 1e-12),
    (Method::CvodeBdf, 1e-9),
    (Method::CvodeBdf, 1e-11),
    (Method::CvodeBdf, 1e-13),
    (Method::Series, 1e-9),
    (Method::Series, 1e-12),
];

/// Those of a system that does not slow down through a loss of stability. Nothing amplifies its rounding on the way to a first
/// stick: one tolerance of each method says what several would.
const SHORT: [(Method, f64); 3] = [
    (Method::Series, 1e-10),
    (Method::Arkode, 1e-13),
    (Method::CvodeAdams, 1e-13),
];

/// Relative tolerance of a run that stands in for a witness.
const STAND_IN: f64 = 1e-12;

/// Natural periods that a run has to resolve for its ladder to be a long one: a hundred times what a brake has whose contact
/// damps the fast mode until it loses stability.
const MANY_PERIODS: f64 = 3000.0;

/// Whether a long ladder has a run for a result of this method: of each method the finest run only, and no more witnesses than
/// have to agree with the result. `cvode-bdf` is the most expensive by far, and where everything is resolved `cvode-adams`
/// errs a hundred times as much as `series`: it only stands in for a witness that is the result's own method.
fn is_worth_its_time((method, rtol): (Method, f64), of: Method) -> bool {
    let needed = match method {
        Method::CvodeBdf => false,
        Method::CvodeAdams => of == Method::Series || repeats(Method::Erk, of),
        Method::Erk => !repeats(Method::Erk, of),
        _ => true,
    };
    needed && !RUNGS.iter().any(|rung| rung.0 == method && rung.1 < rtol)
}

/// Whether sliding slows down by itself and can lose its stability on the way: what was a deviation then grows until the first
/// stick.
pub(super) fn can_lose_stability(case: &Case) -> bool {
    margin::resistance(&case.system).is_ok()
}

/// What times of events are measured by, s: the natural period, or the whole run where nothing moves by itself.
pub(super) fn time_scale(case: &Case) -> f64 {
    natural_period(&case.system).unwrap_or(case.output.end_time)
}

/// How many natural periods a run has to resolve.
fn resolved_periods(case: &Case, run: &MemoryRecorder) -> f64 {
    let period = time_scale(case);
    let segments = run.segments.iter();
    let resolved = segments.filter(|segment| segment.mode.sense() != 0 && segment.resolved == Some(true));
    resolved.map(|segment| segment.end - segment.start).sum::<f64>() / period
}

/// The natural periods over which the runs of a ladder have to resolve the fast mode, if they are so many that the ladder is a
/// long one; `own` is the case by its own settings. The paper's procedure does not know what it resolves: `series` tells in
/// its place.
pub(super) fn many_periods(
    case: &Case,
    own: &Finished,
    deadline: &Deadline,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<f64> {
    let periods = if own.method.locates_events() {
        resolved_periods(case, &own.recorder)
    } else {
        let solver = SolverOptions {
            method: Method::Series,
            max_wall_time: deadline.limit(None),
            ..SolverOptions::default()
        };
        let output = OutputOptions::at_the_ends(case.output.end_time);
        resolved_periods(case, &run(case, &solver, &output, stop).recorder)
    };
    Some(periods).filter(|periods| *periods > MANY_PERIODS)
}

/// One run of the ladder.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rung {
    /// Name of the method.
    pub method: &'static str,
    /// Relative tolerance.
    pub rtol: f64,
    /// Events of the sequence that agree with the result's in kind, from the first on.
    pub agreeing: usize,
    /// Events of the sequence.
    pub events: usize,
    /// Largest distance to the result over the agreeing events, s; `None` if there is none.
    pub distance: Option<f64>,
    /// First stick, s.
    pub onset: Option<f64>,
    /// The run followed smooth sliding itself, free of rounding, through the instability to its stop: only `series` can.
    pub smooth_stop: bool,
    /// Wall time, s.
    pub seconds: f64,
    /// Why the run failed, if it did.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
}

/// A finished run of the ladder.
pub(super) struct Finished {
    pub rung: Rung,
    pub method: Method,
    pub recorder: MemoryRecorder,
    pub report: RunReport,
}

impl Finished {
    fn drop_rows(&mut self) {
        self.recorder.samples = Vec::new();
        self.recorder.further = FurtherColumns::default();
    }
}

/// One run, in memory, with the rows of `output`; a failure is in its rung.
pub(super) fn run(
    case: &Case,
    solver: &SolverOptions,
    output: &OutputOptions,
    stop: &(dyn Fn() -> bool + Sync),
) -> Finished {
    let clock = Instant::now();
    let mut recorder = MemoryRecorder::default();
    let run = Run::new(case).solver(solver).output(output).record(&mut recorder);
    let (report, failure) = match run.stop(stop).start() {
        Ok(report) => (report, None),
        Err(failure) => {
            let text = failure.to_string();
            (failure.report, Some(text))
        }
    };
    Finished {
        rung: Rung {
            method: solver.method.name(),
            rtol: solver.rtol,
            agreeing: 0,
            events: 0,
            distance: None,
            onset: report.digest.cycles.onset_time,
            smooth_stop: report.stopped_smoothly,
            seconds: clock.elapsed().as_secs_f64(),
            failure,
        },
        method: solver.method,
        recorder,
        report,
    }
}

/// The runs of a ladder, and what of it was left out, in a sentence.
pub(super) struct Ladder {
    pub runs: Vec<Finished>,
    pub left_out: Option<String>,
}

/// Every rung, over all processors; in the order of [`RUNGS`]. `own` is the case by its own settings, which may be one
/// of them. Where the fast mode has to be resolved for long ([`many_periods`]), because nothing damps it, only those that
/// are worth their time.
pub(super) fn climb(
    case: &Case,
    result: &[Event],
    output: &OutputOptions,
    own: Option<Finished>,
    many_periods: Option<f64>,
    deadline: &Deadline,
    stop: &(dyn Fn() -> bool + Sync),
) -> Ladder {
    let settings = |(method, rtol): (Method, f64)| SolverOptions {
        method,
        rtol,
        fixed_step: None,
        ..case.solver.clone()
    };
    // A run that begins late has what is left.
    let run = |rung: (Method, f64)| {
        let solver = SolverOptions {
            max_wall_time: deadline.limit(case.solver.max_wall_time),
            ..settings(rung)
        };
        run(case, &solver, output, stop)
    };
    let left_out = many_periods.map(|periods| {
        format!(
            "the fast mode is undamped over {periods:.0} natural periods: of each method only the finest run was made, none of \
             cvode-bdf, and of cvode-adams only where it is needed for a second witness"
        )
    });
    let of = case.solver.method;
    let can_lose_stability = can_lose_stability(case);
    let mut rungs: Vec<(Method, f64)> = match can_lose_stability {
        true => RUNGS.to_vec(),
        false => SHORT.to_vec(),
    };
    rungs.retain(|rung| many_periods.is_none() || is_worth_its_time(*rung, of));
    let own = own.filter(|_| settings(rungs[0]) == case.solver);
    let mut first = own.unwrap_or_else(|| run(rungs[0]));
    compare(&mut first, result);
    let rungs = &rungs[1..];
    if rungs.iter().any(|other| other.0 == first.method) {
        first.drop_rows();
    }
    let others = over_processors(rungs.len(), stop, |index| {
        let mut run = run(rungs[index]);
        compare(&mut run, result);
        // Rows are compared with those of the finest run of each method.
        if rungs[index + 1..].iter().any(|other| other.0 == rungs[index].0) {
            run.drop_rows();
        }
        run
    });
    let mut runs: Vec<Finished> = std::iter::once(first).chain(others).collect();
    // One that has failed, or has another sequence, has to be stood in for.
    let stand_in = match can_lose_stability {
        true => Method::CvodeAdams,
        false => single_method(&case.system),
    };
    let events = word(result).len();
    let is_alike = |run: &&&Finished| run.rung.agreeing == events && run.rung.events == events;
    let alike = witnesses(&runs, of).iter().filter(is_alike).count();
    let missing = !runs.iter().any(|run| run.method == stand_in);
    if missing && alike < LEAST_WITNESSES && !stop() {
        let mut run = run((stand_in, STAND_IN));
        compare(&mut run, result);
        runs.push(run);
    }
    Ladder { runs, left_out }
}

fn word(events: &[Event]) -> Vec<&Event> {
    events.iter().filter(|event| event.kind.in_event_sequence()).collect()
}

/// Whether the same happens in two events.
fn is_like(a: &Event, b: &Event) -> bool {
    a.kind == b.kind && a.mode_after == b.mode_after
}

fn compare(run: &mut Finished, result: &[Event]) {
    let (own, result) = (word(&run.recorder.events), word(result));
    let same = |(a, b): &(&&Event, &&Event)| is_like(a, b);
    let agreeing = own.iter().zip(&result).take_while(same).count();
    run.rung.events = own.len();
    run.rung.agreeing = agreeing;
    let distances = own.iter().zip(&result).take(agreeing);
    run.rung.distance = distances.map(|(a, b)| (a.time - b.time).abs()).reduce(f64::max);
}

/// Whether two runs have the same sequence of events, each event within `distance` (s).
pub(super) fn agree(a: &Finished, b: &Finished, distance: f64) -> bool {
    let (a, b) = (word(&a.recorder.events), word(&b.recorder.events));
    let near = |(a, b): (&&Event, &&Event)| is_like(a, b) && (a.time - b.time).abs() <= distance;
    a.len() == b.len() && a.iter().zip(&b).all(near)
}

/// The finest run of each method, if it did not fail.
pub(super) fn finest(ladder: &[Finished]) -> Vec<&Finished> {
    let mut finest: Vec<&Finished> = Vec::new();
    for run in ladder {
        finest.retain(|other| other.method != run.method);
        finest.push(run);
    }
    finest.retain(|run| run.rung.failure.is_none());
    finest
}

/// The finest run of each method but `arkode` and that of the result itself, which would repeat the result's own error.
pub(super) fn witnesses(ladder: &[Finished], of: Method) -> Vec<&Finished> {
    let mut witnesses = finest(ladder);
    witnesses.retain(|run| run.method != Method::Arkode && !repeats(run.method, of));
    witnesses
}

/// Whether a method is that of the result, by this name or another.
fn repeats(method: Method, of: Method) -> bool {
    method == of || (of.explicit_table().is_some() && method.explicit_table() == of.explicit_table())
}

/// Whether a run goes through the unstable window with the explicit pair of the result's method, or with Adams' method as
/// it does. Close to rounding both then have the same error, of which the distance between them tells nothing: the run
/// bears out the sequence, not the times.
pub(super) fn shares_errors(run: &Finished, of: Method) -> bool {
    let adams = |method| matches!(method, Method::Cvode | Method::CvodeAdams);
    (of.resolving_table().is_some() && run.method.resolving_table() == of.resolving_table())
        || (adams(of) && adams(run.method))
}

/// The finest run of `arkode`.
pub(super) fn finest_arkode(ladder: &[Finished]) -> Option<&Finished> {
    finest(ladder).into_iter().find(|run| run.method == Method::Arkode)
}

/// Times of the events that match those of the result, kind by kind: NaN where there is no counterpart.
pub(super) fn matched(result: &[Event], run: &Finished) -> Vec<f64> {
    let time = |event: Option<&Event>| event.map_or(f64::NAN, |event| event.time);
    counterparts(result, run).into_iter().map(time).collect()
}

/// The events that match those of the result, kind by kind.
pub(super) fn counterparts<'a>(result: &[Event], run: &'a Finished) -> Vec<Option<&'a Event>> {
    let mut word = word(&run.recorder.events).into_iter().take(run.rung.agreeing);
    // Events outside the word are matched by their count among their kind.
    let other = |index: usize| {
        let kind = result[index].kind;
        let number = result[..index].iter().filter(|event| event.kind == kind).count();
        let mut same = run.recorder.events.iter().filter(|event| event.kind == kind);
        same.nth(number)
    };
    (0..result.len())
        .map(|index| match result[index].kind.in_event_sequence() {
            true => word.next(),
            false => other(index),
        })
        .collect()
}
