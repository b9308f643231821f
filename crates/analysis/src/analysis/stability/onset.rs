//! Onset of stick-slip over the tolerance: by several methods, with and without a kick.

use serde::Serialize;
use std::cell::Cell;
use stickslip_engine::run::Run;
use stickslip_engine::simulation::{Method, OutputOptions, SolverOptions};
use stickslip_engine::workers::over_processors;
use stickslip_system::model::KickTime;
use stickslip_system::model::system::{Kick, KickSide, System};
use stickslip_system::record::{Event, EventKind, Recorder, RecorderError};

/// The first method follows sliding without a kick to its exact stop.
pub const METHODS: [Method; 5] = [
    Method::Series,
    Method::Arkode,
    Method::Erk,
    Method::CvodeAdams,
    Method::CvodeBdf,
];

pub(crate) const TOLERANCES: [f64; 8] = [1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13];

/// Kick for a case without one, rad/s: far above rounding and far below the speeds of stick-slip.
pub(crate) const KICK: f64 = 1e-4;

/// First stick of one run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Onset {
    /// Name of the method.
    pub method: &'static str,
    /// Relative tolerance.
    pub rtol: f64,
    /// Whether the run was kicked.
    pub kicked: bool,
    /// Time, s; `None` without a stick before the end or a failure.
    pub first_stick: Option<f64>,
}

/// First stick of sliding that slows down by itself, for every method and tolerance, up to `end_time` (s). Runs are
/// made without a kick, and with the system's kicks; without such kicks, one of `KICK` at the instability. They use
/// all processors and end at the first stick. `stop` is polled; the result is `None` if it returns `true`.
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
        // A failure after the first stick does not matter. Before it, there is no stick.
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
