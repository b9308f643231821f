//! Two measurements behind docs/theory.md, with the solver layer alone: what the dense output of a method of high
//! order is worth, and what it costs to trust the convergence rate of earlier Newton iterations.
//!
//!     cargo run --release --example solver_choices

use std::f64::consts::TAU;

use nalgebra::DMatrixViewMut;
use stickslip::engine::Error;
use stickslip::sundials::{AdvanceTarget, Advanced, ErkTable, OdeSystem, Solver, SolverMethod, Tolerances};

fn main() -> Result<(), Error> {
    println!("x'' = -x, 20 steps in a period, one period, largest error of x and x'");
    for table in [ErkTable::Fehlberg13s78, ErkTable::Verner13s78] {
        let (at_steps, between) = dense_output(table)?;
        println!("  {table:?}: at the steps {at_steps:.1e}, between them {between:.1e}");
    }

    println!("the same from t = 0 to 10 at tolerances of 1e-10, largest error at the steps");
    for trust_convergence_rate in [true, false] {
        let (error, steps) = stopped(trust_convergence_rate)?;
        println!("  ESDIRK, trust_convergence_rate = {trust_convergence_rate}: {error:.1e} in {steps} steps");
    }
    Ok(())
}

struct Oscillator;

impl OdeSystem for Oscillator {
    fn dimension(&self) -> usize {
        2
    }
    fn rhs(&mut self, _t: f64, y: &[f64], ydot: &mut [f64]) {
        ydot[0] = y[1];
        ydot[1] = -y[0];
    }
    fn has_jacobian(&self) -> bool {
        true
    }
    fn jacobian(&mut self, _t: f64, _y: &[f64], _ydot: &[f64], mut j: DMatrixViewMut<'_, f64>) {
        j[(0, 1)] = 1.0;
        j[(1, 0)] = -1.0;
    }
}

fn error(t: f64, y: &[f64]) -> f64 {
    (y[0] - t.cos()).abs().max((y[1] + t.sin()).abs())
}

/// The largest errors at the ends of the steps, and at nine points inside each.
fn dense_output(table: ErkTable) -> Result<(f64, f64), Error> {
    let step = TAU / 20.0;
    let options = SolverMethod::Erk {
        table,
        fixed_step: Some(step),
    };
    let mut solver = Solver::new(
        Oscillator,
        options,
        0.0,
        &[1.0, 0.0],
        &Tolerances::uniform(1e-10, 1e-10, 2),
    )?;
    let (mut at_steps, mut between) = (0.0f64, 0.0f64);
    for _ in 0..20 {
        solver.advance(TAU, AdvanceTarget::OneStep)?;
        let end = solver.time();
        at_steps = at_steps.max(error(end, solver.state()));
        let mut y = [0.0; 2];
        for k in 1..10 {
            let t = end - step * f64::from(k) / 10.0;
            solver.interpolate(t, 0, &mut y)?;
            between = between.max(error(t, &y));
        }
    }
    Ok((at_steps, between))
}

/// The largest error over a run with many stop times, for each of which a step is cut, and the number of steps.
fn stopped(trust_convergence_rate: bool) -> Result<(f64, u64), Error> {
    let options = SolverMethod::Esdirk {
        fixed_step: None,
        trust_convergence_rate,
    };
    let mut solver = Solver::new(
        Oscillator,
        options,
        0.0,
        &[1.0, 0.0],
        &Tolerances::uniform(1e-10, 1e-10, 2),
    )?;
    let mut largest = 0.0f64;
    for stop in 1..=10 {
        let stop = f64::from(stop);
        solver.set_stop_time(Some(stop))?;
        loop {
            let outcome = solver.advance(stop, AdvanceTarget::OneStep)?;
            largest = largest.max(error(solver.time(), solver.state()));
            if outcome == Advanced::StopTime {
                break;
            }
        }
    }
    Ok((largest, solver.counters()?.steps))
}
