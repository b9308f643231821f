//! A second method beside a run of two trains: whether it finds the same events.

use crate::analysis::witness::Testimony;
use crate::case::TrainCase;
use crate::hybrid::{RunError, SolverKind};
use crate::record::{Event, EventKind, Recorder, RecorderError, Sample, Segment};
use crate::results::{MetaValue, WitnessAttributes};
use crate::run::Run;
use crate::simulation::trains::method_without_series;
use crate::simulation::{Method, OutputOptions, SolverOptions, SolverWork};
use serde::Serialize;
use std::ops::ControlFlow;

/// The witness is given up after this multiple of the run's own steps, and not before so many: a count, so that the same case
/// always has the same witness.
const PATIENCE: (u64, u64) = (10, 50_000);

/// Events of two methods that are farther apart than this share of the time between them and their neighbours are not the
/// same: something has grown between the two.
const SAME: f64 = 1e-3;

/// What another method makes of the same case; times in s.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrainWitness {
    /// Which method.
    pub method: &'static str,
    /// Its relative tolerance.
    pub rtol: f64,
    /// What it says.
    pub testimony: Testimony,
    /// Events that it finds.
    pub events: usize,
    /// Events up to the first that is another; all, where `differs` is `None`.
    pub agreeing: usize,
    /// The largest distance of those.
    pub largest_distance: f64,
    /// When the first event comes that is another; of a witness that ran to its end.
    pub differs: Option<f64>,
    /// The same in words.
    pub statement: String,
}

/// Holds the events of a second run against those of the first.
struct Beside<'a> {
    own: &'a [(f64, EventKind)],
    index: usize,
    /// Of the second run so far.
    events: usize,
    largest: f64,
    differs: Option<f64>,
    /// A segment of the second run is by another solver than the series.
    leaves_series: bool,
}

impl Beside<'_> {
    fn take(&mut self, time: f64, kind: EventKind) {
        self.events += 1;
        if self.differs.is_some() {
            return;
        }
        let own = self.own.get(self.index);
        let before = self
            .index
            .checked_sub(1)
            .and_then(|index| self.own.get(index))
            .map_or(0.0, |event| event.0);
        let near = |own: &(f64, EventKind)| {
            let apart = (own.0 - time).abs();
            apart <= SAME * (own.0 - before).max(f64::EPSILON * own.0) || apart <= 1e-9
        };
        match own {
            Some(own) if own.1 == kind && near(own) => {
                self.largest = self.largest.max((own.0 - time).abs());
                self.index += 1;
            }
            Some(own) => self.differs = Some(own.0.min(time)),
            None => self.differs = Some(time),
        }
    }
}

impl Recorder for Beside<'_> {
    fn stores_motion(&self) -> bool {
        false
    }

    fn sample(&mut self, _: &Sample) -> Result<(), RecorderError> {
        Ok(())
    }

    fn event(&mut self, event: &Event) -> Result<(), RecorderError> {
        self.take(event.time, event.kind);
        Ok(())
    }

    fn segment(&mut self, segment: &Segment) -> Result<(), RecorderError> {
        self.leaves_series |= !is_exact(segment.solver);
        Ok(())
    }

    fn stores_events(&self) -> bool {
        true
    }
}

/// Whether a solver is one of those of `series`.
fn is_exact(solver: &str) -> bool {
    [SolverKind::Series, SolverKind::ClosedForm]
        .iter()
        .any(|kind| kind.name() == solver)
}

/// How a case is run for its events alone, by this method with the steps of its own control.
pub(super) fn by_another_method(case: &TrainCase, method: Method, rtol: f64) -> (SolverOptions, OutputOptions) {
    let solver = SolverOptions {
        method,
        rtol,
        fixed_step: None,
        ..case.solver.clone()
    };
    let output = OutputOptions::at_the_ends(case.output.end_time);
    (solver, output)
}

/// What another method makes of a run of `case` with these events, which took so much work; `None` where it is stopped.
///
/// A run by the series alone, of any method, is no witness of another: of a linear case `auto` and `series` are one method.
pub(crate) fn witness(
    case: &TrainCase,
    own: &[(f64, EventKind)],
    work: &[SolverWork],
    stopped: &dyn Fn() -> bool,
) -> Option<TrainWitness> {
    let rtol = case.solver.rtol.min(1e-12);
    let by_series = work.iter().all(|work| is_exact(work.solver));
    let steps = work.iter().map(|work| work.steps).sum();
    let methods: &[(Method, f64)] = match (by_series, case.solver.method) {
        (false, _) => &[(Method::Series, case.solver.rtol)],
        (true, Method::Series) => &[(Method::Auto, rtol), (method_without_series(&case.parameters), rtol)],
        (true, _) => &[(method_without_series(&case.parameters), rtol)],
    };
    let mut witness = None;
    for &method in methods {
        let (said, leaves_series) = ask(case, own, method, steps, stopped)?;
        witness = Some(said);
        if leaves_series || !by_series {
            break;
        }
    }
    witness
}

/// What a method makes of it, and whether it left the series anywhere.
fn ask(
    case: &TrainCase,
    own: &[(f64, EventKind)],
    (method, rtol): (Method, f64),
    steps: u64,
    stopped: &dyn Fn() -> bool,
) -> Option<(TrainWitness, bool)> {
    let (mut solver, output) = by_another_method(case, method, rtol);
    let patience = (PATIENCE.0 * steps).max(PATIENCE.1);
    solver.max_steps = usize::try_from(patience).ok();
    let mut beside = Beside {
        own,
        index: 0,
        events: 0,
        largest: 0.0,
        differs: None,
        leaves_series: false,
    };
    let ended = Run::new(case)
        .solver(&solver)
        .output(&output)
        .record(&mut beside)
        .control(|_| match stopped() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        })
        .start();
    let testimony = match ended {
        // What it found until then counts.
        Err(_) if beside.differs.is_some() => Testimony::SequenceDiffers,
        Err(failure) if matches!(failure.error, RunError::TooManySteps { .. }) => Testimony::LeftOut,
        Err(_) => Testimony::Failed,
        Ok(report) if report.interrupted => return None,
        Ok(_) => {
            if beside.differs.is_none() {
                beside.differs = own.get(beside.index).map(|event| event.0);
            }
            match beside.differs {
                None => Testimony::SameSequence,
                Some(_) => Testimony::SequenceDiffers,
            }
        }
    };
    let name = method.name();
    let statement = match (testimony, beside.differs) {
        (Testimony::LeftOut, _) => format!("witness: method {name} was given up: it takes too long"),
        (Testimony::Failed, _) => format!("witness: method {name} fails"),
        (_, None) => match own.len() {
            0 => format!("witness: method {name} finds no event either"),
            1 => format!(
                "witness: method {name} finds the same event, {:.1e} s away",
                beside.largest
            ),
            events => format!(
                "witness: method {name} finds the same {events} events, the farthest {:.1e} s away",
                beside.largest
            ),
        },
        (_, Some(time)) => format!(
            "another method, {name}, agrees with {} only: from t = {time:.6} s on it finds others, or the same more than a \
             thousandth of the time between two events away. What follows may be amplified error of the methods, and no result: \
             stickslip certify says which events hold; a smaller solver.rtol helps where the error is the method's, and a \
             [[perturbation]] where an instability starts from rounding",
            match beside.index {
                0 => "no event".to_owned(),
                1 => "one event".to_owned(),
                events => format!("{events} events"),
            }
        ),
    };
    let witness = TrainWitness {
        method: name,
        rtol,
        testimony,
        events: beside.events,
        agreeing: beside.index,
        largest_distance: beside.largest,
        differs: beside.differs,
        statement,
    };
    Some((witness, beside.leaves_series))
}

impl TrainWitness {
    /// For the file.
    pub(crate) fn attributes(&self) -> WitnessAttributes {
        let text = |text: &str| MetaValue::Text(text.to_owned());
        let count = |count: usize, about: &'static str| (MetaValue::Number(count as f64), Some(("1", about)));
        let (events, of_events) = count(self.events, "events that the witness finds");
        let (agreeing, of_agreeing) = count(
            self.agreeing,
            "events that agree with those of the result, from the first on",
        );
        WitnessAttributes(vec![
            ("method", text(self.method), None),
            (
                "rtol",
                MetaValue::Number(self.rtol),
                Some(("1", "relative tolerance of the witness")),
            ),
            ("testimony", text(self.testimony.name()), None),
            ("events", events, of_events),
            ("agreeing_events", agreeing, of_agreeing),
            (
                "largest_difference",
                MetaValue::Number(self.largest_distance),
                Some(("s", "largest difference of the times of the agreeing events")),
            ),
            (
                "differs_from",
                MetaValue::Number(self.differs.unwrap_or(f64::NAN)),
                Some(("s", "time of the first event that is another; NaN: there is none")),
            ),
            ("statement", text(&self.statement), None),
        ])
    }
}
