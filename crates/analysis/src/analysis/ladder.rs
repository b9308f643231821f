//! The ladder: runs of a case by independent methods at several tolerances, matched with the events of a result, and the
//! verdict on each event.

use serde::Serialize;
use std::time::{Duration, Instant};
use stickslip_case::Case;
use stickslip_engine::run::Run;
use stickslip_engine::simulation::{Method, OutputOptions, RunReport, SolverOptions, natural_period, single_method};
use stickslip_engine::workers::over_processors;
use stickslip_system::model::margin;
use stickslip_system::named;
use stickslip_system::record::{Event, FurtherColumns, MemoryRecorder};
use stickslip_system::watch::Watch;

/// Methods and tolerances, the finest of each method last. The short runs of `series` at the end fill idle processors.
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

/// Ladder for cases that cannot lose stability: rounding is not amplified, so one tolerance per method suffices.
const SHORT: [(Method, f64); 3] = [
    (Method::Series, 1e-10),
    (Method::Arkode, 1e-13),
    (Method::CvodeAdams, 1e-13),
];

const STAND_IN: f64 = 1e-12;

/// Natural periods of a long ladder: 100 times those of a brake whose contact damps the fast mode until the onset.
const MANY_PERIODS: f64 = 3000.0;

/// Whether a long ladder has a run for a result of this method. It has only each method's finest run, and only as many
/// witnesses as must agree. `cvode-bdf` is by far the most expensive. If everything is resolved, the error of
/// `cvode-adams` is a hundred times that of `series`, so it only replaces a witness of the result's own method.
fn is_worth_its_time((method, rtol): (Method, f64), of: Method) -> bool {
    let needed = match method {
        Method::CvodeBdf => false,
        Method::CvodeAdams => of == Method::Series || repeats(Method::Erk, of),
        Method::Erk => !repeats(Method::Erk, of),
        _ => true,
    };
    needed && !RUNGS.iter().any(|rung| rung.0 == method && rung.1 < rtol)
}

/// Whether sliding slows down by itself and can lose stability. Deviations then grow until the first stick.
pub(super) fn can_lose_stability(case: &Case) -> bool {
    margin::resistance(&case.system).is_ok()
}

/// Time scale of events, s: the natural period, or the whole run if the system has none.
pub(super) fn time_scale(case: &Case) -> f64 {
    natural_period(&case.system).unwrap_or(case.output.end_time)
}

fn resolved_periods(case: &Case, run: &MemoryRecorder) -> f64 {
    let period = time_scale(case);
    let segments = run.segments.iter();
    let resolved = segments.filter(|segment| segment.mode.sense() != 0 && segment.resolved == Some(true));
    resolved.map(|segment| segment.end - segment.start).sum::<f64>() / period
}

/// Natural periods over which the ladder must resolve the fast mode, if there are many. `own` is the run by the case's
/// own settings. `series` counts them for the paper's procedure, which cannot tell what it resolves.
pub(super) fn many_periods(case: &Case, own: &Finished, deadline: &Deadline, stop: &dyn Watch) -> Option<f64> {
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
    /// Leading events of the sequence whose kinds agree with the result's.
    pub agreeing: usize,
    /// Events of the sequence.
    pub events: usize,
    /// Largest distance to the result over the agreeing events, s; `None` without any.
    pub distance: Option<f64>,
    /// Time of the first stick, s.
    pub onset: Option<f64>,
    /// Whether the run followed smooth sliding, free of rounding, to its stop: only `series` can.
    pub smooth_stop: bool,
    /// Wall time, s.
    pub seconds: f64,
    /// Reason of a failure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
}

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

pub(super) fn run(case: &Case, solver: &SolverOptions, output: &OutputOptions, stop: &dyn Watch) -> Finished {
    let clock = Instant::now();
    let mut recorder = MemoryRecorder::default();
    let run = Run::new(case).solver(solver).output(output).record(&mut recorder);
    let (report, failure) = match run.watch(stop).start() {
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

pub(super) struct Ladder {
    pub runs: Vec<Finished>,
    pub left_out: Option<String>,
}

/// All runs in the order of [`RUNGS`], on all processors. `own`, the run by the case's own settings, may be one of
/// them. With [`many_periods`], only the runs of [`is_worth_its_time`].
pub(super) fn climb(
    case: &Case,
    result: &[Event],
    output: &OutputOptions,
    own: Option<Finished>,
    many_periods: Option<f64>,
    deadline: &Deadline,
    stop: &dyn Watch,
) -> Ladder {
    let settings = |(method, rtol): (Method, f64)| SolverOptions {
        method,
        rtol,
        fixed_step: None,
        ..case.solver.clone()
    };
    // A later run gets the remaining time.
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
             cvode-bdf, and of cvode-adams only where the sequence needs a second check"
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
        // Only the finest run of each method needs its rows.
        if rungs[index + 1..].iter().any(|other| other.0 == rungs[index].0) {
            run.drop_rows();
        }
        run
    });
    let mut runs: Vec<Finished> = std::iter::once(first).chain(others).collect();
    // A run that failed or has another sequence needs a substitute.
    let stand_in = match can_lose_stability {
        true => Method::CvodeAdams,
        false => single_method(&case.system),
    };
    let events = word(result).len();
    let is_alike = |run: &&&Finished| run.rung.agreeing == events && run.rung.events == events;
    let alike = witnesses(&runs, of).iter().filter(is_alike).count();
    let missing = !runs.iter().any(|run| run.method == stand_in);
    if missing && alike < LEAST_WITNESSES && !stop.stopped() {
        let mut run = run((stand_in, STAND_IN));
        compare(&mut run, result);
        runs.push(run);
    }
    Ladder { runs, left_out }
}

fn word(events: &[Event]) -> Vec<&Event> {
    events.iter().filter(|event| event.kind.in_event_sequence()).collect()
}

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

pub(super) fn agree(a: &Finished, b: &Finished, distance: f64) -> bool {
    let (a, b) = (word(&a.recorder.events), word(&b.recorder.events));
    let near = |(a, b): (&&Event, &&Event)| is_like(a, b) && (a.time - b.time).abs() <= distance;
    a.len() == b.len() && a.iter().zip(&b).all(near)
}

pub(super) fn finest(ladder: &[Finished]) -> Vec<&Finished> {
    let mut finest: Vec<&Finished> = Vec::new();
    for run in ladder {
        finest.retain(|other| other.method != run.method);
        finest.push(run);
    }
    finest.retain(|run| run.rung.failure.is_none());
    finest
}

/// Finest run of each method except `arkode` and the result's own method, which would repeat the result's error.
pub(super) fn witnesses(ladder: &[Finished], of: Method) -> Vec<&Finished> {
    let mut witnesses = finest(ladder);
    witnesses.retain(|run| run.method != Method::Arkode && !repeats(run.method, of));
    witnesses
}

fn repeats(method: Method, of: Method) -> bool {
    method == of || (of.explicit_table().is_some() && method.explicit_table() == of.explicit_table())
}

/// Whether a run resolves the unstable window by the result's method. Near rounding both have the same error, so the
/// run confirms the sequence but not the times.
pub(super) fn shares_errors(run: &Finished, of: Method) -> bool {
    let adams = |method| matches!(method, Method::Cvode | Method::CvodeAdams);
    (of.resolving_table().is_some() && run.method.resolving_table() == of.resolving_table())
        || (adams(of) && adams(run.method))
}

pub(super) fn finest_arkode(ladder: &[Finished]) -> Option<&Finished> {
    finest(ladder).into_iter().find(|run| run.method == Method::Arkode)
}

pub(super) fn matched(result: &[Event], run: &Finished) -> Vec<f64> {
    let time = |event: Option<&Event>| event.map_or(f64::NAN, |event| event.time);
    counterparts(result, run).into_iter().map(time).collect()
}

pub(super) fn counterparts<'a>(result: &[Event], run: &'a Finished) -> Vec<Option<&'a Event>> {
    let mut word = word(&run.recorder.events).into_iter().take(run.rung.agreeing);
    // Events outside the sequence are matched by their index within their kind.
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

/// Number of independent witnesses that must confirm the result's sequence of events.
pub(super) const LEAST_WITNESSES: usize = 2;

named! {
    /// Verdict on an event.
    pub enum Verdict {
        /// Independent methods agree.
        Converged: "converged",
        /// Amplified rounding: no tolerance makes the event converge.
        NoiseDetermined: "noise-determined",
        /// Independent methods find another sequence from here on.
        SequenceDiffers: "sequence-differs",
    }
}

/// Event of the certified result. In JSON, a number that is not finite is null.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CertifiedEvent {
    /// Time, s.
    pub time: f64,
    /// Kind of the event.
    pub kind: &'static str,
    /// Verdict on the event.
    pub verdict: Verdict,
    /// Bound on the distance from the exact solution, s; infinite unless the event has converged.
    pub uncertainty: f64,
    /// Verdict of the ladder alone; equal to `verdict` without the oracle.
    pub ladder_verdict: Verdict,
    /// Uncertainty by the ladder alone, s; infinite unless the event has converged there.
    pub ladder_uncertainty: f64,
    /// Own time less the oracle's, s; `None` without an exact event.
    pub true_error: Option<f64>,
    /// Exact time with its true digits; `None` without the oracle.
    pub exact: Option<String>,
    /// Limit of double precision, s: rounding of parameters, and of state and clock at earlier events; NaN if unknown.
    pub rounding: f64,
    /// e-folds of a deviation from the loss of stability to just after the event.
    pub growth: Option<f64>,
}

impl CertifiedEvent {
    /// True significant decimal digits of the time; 0 unless the event has converged.
    pub fn digits(&self) -> u32 {
        significant(self.time, self.uncertainty)
    }

    /// Largest number of digits of the time in double precision; `None` if unknown.
    pub fn most_digits(&self) -> Option<u32> {
        (!self.rounding.is_nan()).then(|| significant(self.time, self.rounding))
    }
}

pub(super) fn significant(value: f64, error: f64) -> u32 {
    let digits = (value.abs() / error).log10().floor();
    if digits >= 1.0 { digits.min(17.0) as u32 } else { 0 }
}

pub(super) const INTERRUPTED: &str = "interrupted";

/// Deadline of a command; none by default.
#[derive(Debug, Clone, Copy, Default)]
pub struct Deadline {
    /// `None` without a limit, or if the limit exceeds the clock's range.
    end: Option<Instant>,
    allowed: f64,
}

impl Deadline {
    /// Deadline `seconds` after `begin`.
    pub fn after(begin: Instant, seconds: Option<f64>) -> Deadline {
        let duration = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
        Deadline {
            end: duration.and_then(|duration| begin.checked_add(duration)),
            allowed: seconds.unwrap_or_default(),
        }
    }

    /// Whether the deadline has passed.
    pub fn is_over(&self) -> bool {
        self.end.is_some_and(|end| Instant::now() >= end)
    }

    /// Wall time (s) left for a run that begins now and may have a limit of its own.
    pub fn limit(&self, own: Option<f64>) -> Option<f64> {
        let left = self
            .end
            .map(|end| end.saturating_duration_since(Instant::now()).as_secs_f64());
        own.into_iter().chain(left).reduce(f64::min)
    }

    /// Reason why a part is missing. An interruption that the user did not request is due to the deadline.
    pub fn explain(&self, why: String, stopped: bool) -> String {
        if why != INTERRUPTED || stopped {
            return why;
        }
        format!(
            "the wall time of {} s was over before their runs were done; allow more (--max-wall-time)",
            self.allowed
        )
    }
}
