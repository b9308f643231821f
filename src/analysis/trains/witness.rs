//! A second method beside a run of two trains: whether it finds the same events.

use crate::case::TrainCase;
use crate::record::{Event, EventKind, Recorder, RecorderError, Sample, Segment};
use crate::run::Run;
use crate::simulation::{Method, OutputOptions, SolverOptions};
use serde::Serialize;
use std::ops::ControlFlow;
use std::time::Instant;

/// The witness is given up after this multiple of the run's own time, and not before so many seconds.
const PATIENCE: (f64, f64) = (4.0, 2.0);

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
    /// Events up to the first that is another; all, where `differs` is `None`.
    pub agreeing: usize,
    /// The largest distance of those.
    pub largest_distance: f64,
    /// When the first event comes that is another.
    pub differs: Option<f64>,
    /// The same in words.
    pub statement: String,
}

/// Holds the events of a second run against those of the first.
struct Beside<'a> {
    own: &'a [(f64, EventKind)],
    index: usize,
    largest: f64,
    differs: Option<f64>,
}

impl Beside<'_> {
    fn take(&mut self, time: f64, kind: EventKind) {
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
    fn sample(&mut self, _: &Sample) -> Result<(), RecorderError> {
        Ok(())
    }

    fn event(&mut self, event: &Event) -> Result<(), RecorderError> {
        self.take(event.time, event.kind);
        Ok(())
    }

    fn segment(&mut self, _: &Segment) -> Result<(), RecorderError> {
        Ok(())
    }

    fn stores_events(&self) -> bool {
        true
    }
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

/// What another method makes of a run of `case` with these events, which took `seconds`; `None` where it fails, takes too long,
/// or is stopped.
pub(super) fn witness(
    case: &TrainCase,
    own: &[(f64, EventKind)],
    seconds: f64,
    stopped: &dyn Fn() -> bool,
) -> Option<TrainWitness> {
    let (method, rtol) = match case.solver.method {
        Method::Series => (Method::Auto, case.solver.rtol.min(1e-12)),
        _ => (Method::Series, case.solver.rtol),
    };
    let (solver, output) = by_another_method(case, method, rtol);
    let mut beside = Beside {
        own,
        index: 0,
        largest: 0.0,
        differs: None,
    };
    let (clock, longest) = (Instant::now(), (PATIENCE.0 * seconds).max(PATIENCE.1));
    let report = Run::of_trains(&case.parameters, case.threshold.unwrap_or(0.0), &solver, &output)
        .record(&mut beside)
        .control(|_| match stopped() || clock.elapsed().as_secs_f64() > longest {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        })
        .start()
        .ok()?;
    if report.interrupted {
        return None;
    }
    if beside.differs.is_none() {
        beside.differs = own.get(beside.index).map(|event| event.0);
    }
    let name = method.name();
    let statement = match beside.differs {
        None => format!(
            "witness: method {name} finds the same {} events, the farthest {:.1e} s away",
            own.len(),
            beside.largest
        ),
        Some(time) => format!(
            "another method, {name}, agrees with {} events only: from t = {time:.6} s on it finds others, or the same more than a \
             thousandth of the time between two events away. What follows may be amplified error of the methods, and no result: \
             stickslip certify says which events hold; a smaller solver.rtol helps where the error is the method's, and a \
             [[perturbation]] where an instability starts from rounding",
            beside.index
        ),
    };
    Some(TrainWitness {
        method: name,
        rtol,
        agreeing: beside.index,
        largest_distance: beside.largest,
        differs: beside.differs,
        statement,
    })
}
