//! The onset of stick-slip against the tolerance: by several methods, with a kick and without.

use crate::model::KickTime;
use crate::model::system::{Kick, KickSide, System};
use crate::record::{Event, EventKind, Recorder, RecorderError};
use crate::run::Run;
use crate::simulation::{Method, OutputOptions, SolverOptions};
use crate::workers::over_processors;
use serde::Serialize;
use std::cell::Cell;

/// The methods, of which the first follows sliding without a kick to its exact stop.
pub(crate) const METHODS: [Method; 5] = [
    Method::Series,
    Method::Arkode,
    Method::Erk,
    Method::CvodeAdams,
    Method::CvodeBdf,
];

/// Relative tolerances, from coarse to fine.
pub(crate) const TOLERANCES: [f64; 8] = [1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13];

/// The kick of a case that has none, rad/s: far above rounding, and far below the speeds of stick-slip.
pub(crate) const KICK: f64 = 1e-4;

/// The first stick of one run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Onset {
    /// Name of the method.
    pub method: &'static str,
    /// Relative tolerance.
    pub rtol: f64,
    /// Whether the run was kicked.
    pub kicked: bool,
    /// s; `None` if there was none, or the run failed before it.
    pub first_stick: Option<f64>,
}

/// The first stick of a system whose sliding slows down by itself, by every method at every tolerance up to `end_time` (s): without a
/// kick, and with those of the system, or with one of `KICK` at the instability where it has none. The runs go over all processors
/// and end at the first stick. `stop` is asked now and then; `None` if it said so.
pub fn onsets(
    trains: &System,
    solver: &SolverOptions,
    end_time: f64,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<Vec<Onset>> {
    let (mut without, mut with) = (trains.clone(), trains.clone());
    without.kicks.clear();
    if with.kicks.is_empty() {
        with.kicks.push(Kick {
            time: KickTime::Instability,
            relative_velocity: KICK,
            on: KickSide::Both,
        });
    }
    let mut jobs = Vec::with_capacity(2 * METHODS.len() * TOLERANCES.len());
    for (kicked, trains) in [(false, &without), (true, &with)] {
        for method in METHODS {
            jobs.extend(TOLERANCES.map(|rtol| (kicked, trains, method, rtol)));
        }
    }
    let output = OutputOptions::at_the_ends(end_time);
    let found = over_processors(jobs.len(), stop, |index| {
        let (kicked, trains, method, rtol) = jobs[index];
        let solver = SolverOptions {
            method,
            rtol,
            fixed_step: None,
            ..solver.clone()
        };
        let first = FirstStick::default();
        let mut recorder = &first;
        // A failure behind the first stick does not matter, and one before it leaves none.
        let _ = Run::of_system(trains, 0.0, &solver, &output)
            .record(&mut recorder)
            .stop(|| stop() || first.0.get().is_some())
            .start();
        Onset {
            method: method.name(),
            rtol,
            kicked,
            first_stick: first.0.get(),
        }
    });
    (!stop()).then_some(found)
}

/// The time of the first stick, s.
#[derive(Debug, Default)]
struct FirstStick(Cell<Option<f64>>);

impl Recorder for &FirstStick {
    fn stores_motion(&self) -> bool {
        false
    }

    fn event(&mut self, event: &Event) -> Result<(), RecorderError> {
        if event.kind == EventKind::Stick && self.0.get().is_none() {
            self.0.set(Some(event.time));
        }
        Ok(())
    }
}
