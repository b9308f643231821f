//! The steps of `series` take no memory from the heap.
#![allow(unsafe_code)] // an allocator that counts

mod common;

use common::{output, run, solver, truth};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::Arc;
use stickslip::hybrid::{Advance, Engine, Segment};
use stickslip::model::Mode;
use stickslip::model::state::{DIMENSION, TorsionState, index::*};
use stickslip::record::{EventKind, State};
use stickslip::simulation::brake::{Brake, Location, Watch};
use stickslip::simulation::semi_analytic::SemiAnalyticEngine;
use stickslip::simulation::{Method, SolverOptions, chosen_solvers};

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

/// Counts what each thread allocates.
struct Counting;

// SAFETY: all is handed on to the system's allocator; the counter is a plain number that needs no memory of the heap.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocations() -> u64 {
    ALLOCATIONS.with(Cell::get)
}

fn torsion_state(state: &State) -> TorsionState {
    let mut y = [0.0; DIMENSION];
    y[ROTOR_TWIST] = state.rotor_twist;
    y[ROTOR_TWIST_RATE] = state.rotor_twist_rate;
    y[STATOR_TWIST] = state.phi1;
    y[STATOR_TWIST_RATE] = state.phi1_dot;
    y[ROTOR_SPEED] = state.theta_dot;
    y
}

/// Every slip of the stick-slip window, and the sliding before it up to the kick: the expansions, Radau steps, steps along
/// the slow manifold, samples and roots of a whole run.
#[test]
fn regression_a_step_allocates_nothing() {
    let before = allocations();
    drop(Box::new(0u8));
    assert!(allocations() > before, "the counter counts");

    let parameters = truth("si-kick").parameters;
    let (recorder, _) = run(&parameters, &solver(Method::Series, 1e-10), &output(7.1, 7.1));
    let brake = Arc::new(Brake::new(&parameters));
    let mut stepper = SemiAnalyticEngine::new(brake);
    let options = SolverOptions {
        method: Method::Series,
        ..SolverOptions::default()
    };
    let (smooth, resolved) = chosen_solvers(&parameters, &options);
    let mut starts = vec![(0.0, [0.0; DIMENSION], false, 1.0), (1.0, [0.0; DIMENSION], false, 5.0)];
    starts[0].1[ROTOR_SPEED] = parameters.initial.speed;
    for event in &recorder.events {
        let state = torsion_state(&event.after);
        match event.kind {
            EventKind::Corner => starts[1].1 = state,
            EventKind::Destabilised => starts.push((event.time, state, false, 1e-3)),
            EventKind::Slip => starts.push((event.time, state, true, 1e-3)),
            _ => {}
        }
    }
    assert!(starts.len() > 50);
    let (mut steps, mut guards, mut jacobians) = (0, 0, 0);
    let mut sample = [0.0; DIMENSION];
    for (t, y, is_resolved, span) in starts {
        let location = Location {
            mode: Mode::SlipForward,
            resolved: is_resolved,
            watch: if is_resolved { Watch::Off } else { Watch::Stable },
            piece: 0,
        };
        let chosen = if is_resolved { &resolved } else { &smooth };
        let before = allocations();
        let segment = Segment {
            location,
            start: t,
            stop: t + span,
            state: &y,
        };
        stepper.begin(&segment, chosen).expect("a start");
        loop {
            let advance = stepper.advance().expect("a step");
            steps += 1;
            stepper.state_at(stepper.time(), &mut sample).expect("a state");
            match advance {
                Advance::Stepped => {}
                Advance::Stop | Advance::Searched => break,
                Advance::Guards(_) => {
                    guards += 1;
                    break;
                }
            }
        }
        jacobians += stepper.counters().expect("counters").jacobian_evaluations;
        assert_eq!(allocations() - before, 0, "from {t} s");
    }
    println!("{steps} steps to {guards} guards, {jacobians} Jacobians");
    assert!(steps > 500 && guards > 50 && jacobians > 5);
}
