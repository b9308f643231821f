//! What numbers of a case do to the events of its run: [`hybrid::Carried`](crate::hybrid::Carried) for trains.

use super::dynamics::TrainDynamics;
use super::plan::TrainPlan;
use super::readings::TrainReadings;
use super::rules::TrainRules;
use super::start;
use crate::hybrid::{Carried, CarryingRules, MovedCopy, RunError, Start};
use crate::model::trains::Trains;
use crate::record::{EventDigest, Recorder};
use crate::simulation::observer::Recording;
use crate::simulation::readings::Readings as _;
use crate::simulation::{Method, OutputOptions, Progress, RunFailure, RunReport, SolverOptions, automaton};
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, PoisonError};

/// The trains of a case in which a number is moved.
pub(crate) struct MovedTrains {
    /// With the number moved.
    pub trains: Trains,
    /// As in [`Run::of_trains`](crate::Run::of_trains), rad/s.
    pub threshold: f64,
    /// Per unit of the number. Over all copies the weights add up to zero, and weight times value to the derivative of a value.
    pub weight: f64,
}

/// Runs the trains by `series`, into `recorder`, and gives d(time)/d(number) of every event, for each of the numbers.
///
/// # Errors
/// Those of a run.
pub(crate) fn variation(
    (trains, threshold): (&Trains, f64),
    numbers: &[Vec<MovedTrains>],
    solver: &SolverOptions,
    output: &OutputOptions,
    recorder: &mut dyn Recorder,
    control: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<(RunReport, Vec<Vec<f64>>), Box<RunFailure>> {
    let solver = SolverOptions {
        method: Method::Series,
        ..solver.clone()
    };
    let prepared = |trains: &Trains, threshold: f64| {
        let dynamics = Arc::new(TrainDynamics::new(trains, threshold));
        let mut state = start(trains, &dynamics);
        let plan = TrainPlan::new(trains, &dynamics, &state, &solver);
        let rules = TrainRules::new(dynamics.clone(), trains, plan, 0.0, output.end_time);
        let location = rules.initial_location(&mut state);
        (dynamics, rules, location, state)
    };
    let (dynamics, rules, location, state) = prepared(trains, threshold);
    let copies = |moved: &Vec<MovedTrains>| -> Vec<_> {
        let copy = |moved: &MovedTrains| {
            let (dynamics, rules, _, start) = prepared(&moved.trains, moved.threshold);
            MovedCopy {
                dynamics,
                rules,
                weight: moved.weight,
                start,
            }
        };
        moved.iter().map(copy).collect()
    };
    let moving = dynamics.system.mechanical();
    let carried = Carried::new(dynamics.clone(), moving, numbers.iter().map(copies).collect());
    let carried = Arc::new(Mutex::new(carried));
    let mut rules = CarryingRules::new(rules, carried.clone());
    let readings = TrainReadings { dynamics: &dynamics };
    let channels = readings.channels(0.0, &location, &state);
    let energy = channels.energy_kinetic + channels.energy_elastic;
    let recording = Recording::new(
        readings,
        EventDigest::without_instability(),
        output,
        recorder,
        control,
        energy,
    );
    let start = Start {
        time: 0.0,
        location,
        state,
    };
    let (result, report): (Result<(), RunError>, RunReport) =
        automaton(&dynamics, &mut rules, start, &solver, output, recording);
    let report = report.ended(result)?;
    drop(rules);
    let carried = Arc::into_inner(carried).map(|carried| carried.into_inner().unwrap_or_else(PoisonError::into_inner));
    Ok((report, carried.map_or_else(Vec::new, Carried::into_times)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{CaseSource, Override, TrainCase};
    use crate::record::{MemoryRecorder, NoRecorder};
    use crate::run::Run;

    /// Against differences of runs with the number moved, extrapolated from two widths.
    #[test]
    fn analytic_slopes_are_those_of_moved_runs() {
        for (name, end) in [
            ("belt-leine", 20.0),
            ("drill-string", 30.0),
            ("clutch", 2.0),
            ("block", 3.0),
            ("hairer", 20.0),
            ("den-hartog", 20.0),
            ("lugre-slider", 5.0),
            ("belt-leine-tanh", 20.0),
        ] {
            let source = CaseSource::built_in(name).unwrap();
            let end = Override::number("output.end_time", end);
            let parse = |changes: &[Override]| {
                let changes: Vec<_> = std::iter::once(end.clone()).chain(changes.iter().cloned()).collect();
                TrainCase::parse(&source, &changes)
            };
            let case = parse(&[]).unwrap();
            let numbers = TrainCase::numbers(&source, &[end.clone()]).unwrap();
            let moved = |path: &str, value: f64| parse(&[Override::number(path, value)]);
            let mut names = Vec::new();
            let mut columns = Vec::new();
            for number in &numbers {
                let h = number.value.abs() / f64::from(1 << 16);
                let sides = [h, -h].map(|h| moved(&number.path, number.value + h));
                let [Ok(forth), Ok(back)] = sides else { continue };
                let copy = |case: TrainCase, weight: f64| MovedTrains {
                    threshold: case.threshold.unwrap_or(0.0),
                    trains: case.parameters,
                    weight,
                };
                names.push(number);
                columns.push(vec![copy(forth, 0.5 / h), copy(back, -0.5 / h)]);
            }
            let output = OutputOptions::at_the_ends(case.output.end_time);
            let clock = std::time::Instant::now();
            let (_, slopes) = variation(
                (&case.parameters, case.threshold.unwrap_or(0.0)),
                &columns,
                &case.solver,
                &output,
                &mut NoRecorder,
                &mut |_| ControlFlow::Continue(()),
            )
            .unwrap();
            println!("{name}: {} events, {} numbers, {:?}", slopes.len(), columns.len(), clock.elapsed());
            let times = |path: &str, value: f64| -> Vec<f64> {
                let case = moved(path, value).unwrap();
                let solver = SolverOptions {
                    method: Method::Series,
                    ..case.solver.clone()
                };
                let mut kept = MemoryRecorder::default();
                Run::new(&case).solver(&solver).output(&output).record(&mut kept).start().unwrap();
                kept.events.iter().map(|event| event.time).collect()
            };
            for (column, number) in names.iter().enumerate() {
                let difference = |width: f64| -> Vec<f64> {
                    let h = number.value.abs() * width;
                    let [forth, back] = [h, -h].map(|h| times(&number.path, number.value + h));
                    forth.iter().zip(&back).map(|(a, b)| (a - b) / (2.0 * h)).collect()
                };
                let (wide, narrow) = (difference(1e-5), difference(1e-6));
                for (event, row) in slopes.iter().enumerate() {
                    let (Some(wide), Some(narrow)) = (wide.get(event), narrow.get(event)) else { continue };
                    let best = narrow + (narrow - wide) / 99.0;
                    let scale = end_scale(&slopes, column) ;
                    let error = (row[column] - best).abs() / scale.max(1e-9 / number.value.abs());
                    if error > 1e-5 {
                        println!("  {} event {event}: {:e} and {best:e} ({wide:e})", number.path, row[column]);
                    }
                }
            }
        }
    }

    fn end_scale(slopes: &[Vec<f64>], column: usize) -> f64 {
        slopes.iter().map(|row| row[column].abs()).fold(0.0, f64::max)
    }
}
