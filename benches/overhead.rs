//! The cost of the safe solver layer: the same CVODE with the same right-hand side, once through `stickslip::sundials` and
//! once by the C functions alone, with callbacks that catch no panic, check no value and watch no time. The latter
//! executes the same instructions as a C program.
//!
//! Both make their solver, go to the end step by step and free it. Both have the same settings, Jacobian and crossing
//! functions, and the states must agree to the last bit. The functions of a problem are compiled once, for arrays of a
//! known length as in C, and both call the same machine code. Otherwise the compiler would inline them on one side only,
//! and the ratio would show that instead of the layer. The work of a callback before and after the function belongs to
//! the layer; so does everything around a step.
//!
//!     cargo bench --bench overhead
//!
//! The lines "of the time of C alone" are the answer: the ratio of the shortest times, taken by turns in one run.
//! Criterion's own times of the two are minutes apart, and differ by more than the ratio on a machine with other load.
#![allow(unsafe_code)] // the C functions alone

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::DMatrixViewMut;
use std::ffi::{c_int, c_void};
use std::hint::black_box;
use std::marker::PhantomData;
use std::time::{Duration, Instant};
use stickslip::case::{Case, CaseSource};
use stickslip::model::Mode;
use stickslip::model::Parameters;
use stickslip::model::equations::{Outside, SystemEquations};
use stickslip::signal::{Ramp, Signal};
use stickslip::sundials::{AdvanceTarget, Advanced, CvodeOptions, Direction, OdeSystem, Solver, Tolerances};
use sundials_sys as c;

/// A problem of N components and G crossing functions, which both sides share. The functions are never inlined, see
/// above.
trait Problem<const N: usize, const G: usize>: 'static {
    const NAME: &'static str;
    /// BDF with Newton and the Jacobian, or Adams with fixed-point iteration.
    const STIFF: bool;
    fn start() -> [f64; N];
    fn tolerances() -> Tolerances;
    fn end() -> f64;
    fn rhs(&self, y: &[f64; N], ydot: &mut [f64; N]);
    fn jacobian(&self, y: &[f64; N], jacobian: DMatrixViewMut<'_, f64>);
    fn roots(&self, y: &[f64; N], g: &mut [f64; G]);
}

/// `cvRoberts_dns.c` of the SUNDIALS distribution, to t = 4e10.
#[derive(Clone, Copy)]
struct Roberts;

impl Problem<3, 2> for Roberts {
    const NAME: &'static str = "roberts-bdf";
    const STIFF: bool = true;
    fn start() -> [f64; 3] {
        [1.0, 0.0, 0.0]
    }
    fn tolerances() -> Tolerances {
        Tolerances {
            relative: 1e-8,
            absolute: vec![1e-12, 1e-16, 1e-10],
        }
    }
    fn end() -> f64 {
        4e10
    }
    #[inline(never)]
    fn rhs(&self, y: &[f64; 3], ydot: &mut [f64; 3]) {
        ydot[0] = -0.04 * y[0] + 1.0e4 * y[1] * y[2];
        ydot[2] = 3.0e7 * y[1] * y[1];
        ydot[1] = -ydot[0] - ydot[2];
    }
    #[inline(never)]
    fn jacobian(&self, y: &[f64; 3], mut j: DMatrixViewMut<'_, f64>) {
        j[(0, 0)] = -0.04;
        j[(0, 1)] = 1.0e4 * y[2];
        j[(0, 2)] = 1.0e4 * y[1];
        j[(1, 0)] = 0.04;
        j[(1, 1)] = -1.0e4 * y[2] - 6.0e7 * y[1];
        j[(1, 2)] = -1.0e4 * y[1];
        j[(2, 1)] = 6.0e7 * y[1];
    }
    #[inline(never)]
    fn roots(&self, y: &[f64; 3], g: &mut [f64; 2]) {
        g[0] = y[0] - 0.0001;
        g[1] = y[2] - 0.01;
    }
}

/// The brake of the case "paper-si", sliding at full force from 2 rad/s, which excites its fast mode: 80 periods, all
/// resolved.
#[derive(Clone)]
struct Slip {
    system: SystemEquations,
    outside: Outside,
}

/// The state: the rotor's twist, twist rate and speed, the stator's twist and twist rate, and four quadratures.
const DIMENSION: usize = 9;
const ROTOR_SPEED: usize = 2;
const TWISTS: [usize; 2] = [0, 3];

impl Slip {
    fn new() -> Self {
        let case = Case::read(&CaseSource::built_in("paper-si").unwrap(), &[]).unwrap();
        let Signal::Ramp(Ramp { value: force, .. }) = Parameters::of(&case.system).unwrap().actuation else {
            unreachable!("the paper's case has a ramp")
        };
        Slip {
            system: SystemEquations::new(&case.system),
            outside: Outside {
                normal_force: force,
                ..Outside::default()
            },
        }
    }
}

impl Problem<DIMENSION, 1> for Slip {
    const NAME: &'static str = "slip-adams";
    const STIFF: bool = false;
    fn start() -> [f64; DIMENSION] {
        let mut y = [0.0; DIMENSION];
        y[ROTOR_SPEED] = 2.0;
        y
    }
    fn tolerances() -> Tolerances {
        let mut absolute = vec![1e-6; DIMENSION];
        for twist in TWISTS {
            absolute[twist] = 1e-16;
            absolute[twist + 1] = 1e-12;
        }
        Tolerances {
            relative: 1e-10,
            absolute,
        }
    }
    fn end() -> f64 {
        0.02
    }
    #[inline(never)]
    fn rhs(&self, y: &[f64; DIMENSION], ydot: &mut [f64; DIMENSION]) {
        self.system.rates(Mode::SlipForward, 1.0, 0, &self.outside, y, ydot);
    }
    #[inline(never)]
    fn jacobian(&self, y: &[f64; DIMENSION], mut jacobian: DMatrixViewMut<'_, f64>) {
        self.system
            .jacobian(Mode::SlipForward, 1.0, 0, &self.outside, y, &mut jacobian);
    }
    #[inline(never)]
    fn roots(&self, y: &[f64; DIMENSION], g: &mut [f64; 1]) {
        g[0] = self.system.relative_velocity(&self.outside, y);
    }
}

struct Safe<P, const N: usize, const G: usize>(P);

impl<P: Problem<N, G>, const N: usize, const G: usize> OdeSystem for Safe<P, N, G> {
    fn dimension(&self) -> usize {
        N
    }
    fn rhs(&mut self, _t: f64, y: &[f64], ydot: &mut [f64]) {
        self.0.rhs(y.try_into().unwrap(), ydot.try_into().unwrap());
    }
    fn has_jacobian(&self) -> bool {
        true
    }
    fn jacobian(&mut self, _t: f64, y: &[f64], _ydot: &[f64], jacobian: DMatrixViewMut<'_, f64>) {
        self.0.jacobian(y.try_into().unwrap(), jacobian);
    }
    fn roots(&mut self, _t: f64, y: &[f64], g: &mut [f64]) {
        self.0.roots(y.try_into().unwrap(), g.try_into().unwrap());
    }
}

/// Steps to the end by the layer; returns the number of steps and the state.
fn by_the_layer<P: Problem<N, G>, const N: usize, const G: usize>(problem: P) -> (u64, Vec<f64>) {
    let options = if P::STIFF {
        CvodeOptions::BDF
    } else {
        CvodeOptions::ADAMS
    };
    let mut solver = Solver::new(Safe(problem), options, 0.0, &P::start(), &P::tolerances()).unwrap();
    solver.set_crossings(&[Direction::Either; G]).unwrap();
    solver.set_stop_time(Some(P::end())).unwrap();
    while solver.advance(P::end(), AdvanceTarget::OneStep).unwrap() != Advanced::StopTime {}
    (solver.counters().unwrap().steps, solver.state().to_vec())
}

unsafe fn data<'a, const N: usize>(vector: c::N_Vector) -> &'a mut [f64; N] {
    // SAFETY: only serial vectors of that length are made here.
    unsafe { &mut *(*(*vector).content.cast::<c::_N_VectorContent_Serial>()).data.cast() }
}

struct Raw<P, const N: usize, const G: usize>(PhantomData<P>);

impl<P: Problem<N, G>, const N: usize, const G: usize> Raw<P, N, G> {
    unsafe extern "C" fn rhs(_t: f64, y: c::N_Vector, ydot: c::N_Vector, user: *mut c_void) -> c_int {
        // SAFETY: CVODE passes the pointers that it was given.
        unsafe { (*user.cast::<P>()).rhs(data(y), data(ydot)) };
        0
    }

    unsafe extern "C" fn jacobian(
        _t: f64,
        y: c::N_Vector,
        _ydot: c::N_Vector,
        matrix: c::SUNMatrix,
        user: *mut c_void,
        _: c::N_Vector,
        _: c::N_Vector,
        _: c::N_Vector,
    ) -> c_int {
        // SAFETY: as above; the matrix is the dense one made below.
        unsafe {
            let content = (*matrix).content.cast::<c::_SUNMatrixContent_Dense>();
            let entries = std::slice::from_raw_parts_mut((*content).data, N * N);
            (*user.cast::<P>()).jacobian(data(y), DMatrixViewMut::from_slice(entries, N, N));
        }
        0
    }

    unsafe extern "C" fn roots(_t: f64, y: c::N_Vector, g: *mut f64, user: *mut c_void) -> c_int {
        // SAFETY: as above; CVODE makes room for as many values as were announced.
        unsafe { (*user.cast::<P>()).roots(data(y), &mut *g.cast()) };
        0
    }
}

fn by_c<P: Problem<N, G>, const N: usize, const G: usize>(mut problem: P) -> (u64, Vec<f64>) {
    // SAFETY: every object is made, used and freed in this function, in the order that SUNDIALS asks for.
    unsafe {
        let mut context = std::ptr::null_mut();
        assert_eq!(c::SUNContext_Create(c::SUN_COMM_NULL, &mut context), 0);
        let y = c::N_VNew_Serial(N as c::sunindextype, context);
        let absolute = c::N_VNew_Serial(N as c::sunindextype, context);
        *data(y) = P::start();
        let tolerances = P::tolerances();
        data::<N>(absolute).copy_from_slice(&tolerances.absolute);
        let mut memory = c::CVodeCreate(if P::STIFF { c::CV_BDF } else { c::CV_ADAMS }, context);
        assert_eq!(c::CVodeInit(memory, Some(Raw::<P, N, G>::rhs), 0.0, y), 0);
        c::CVodeSetUserData(memory, (&raw mut problem).cast());
        c::CVodeSVtolerances(memory, tolerances.relative, absolute);
        let (mut matrix, mut linear, mut fixed_point) =
            (std::ptr::null_mut(), std::ptr::null_mut(), std::ptr::null_mut());
        if P::STIFF {
            matrix = c::SUNDenseMatrix(N as c::sunindextype, N as c::sunindextype, context);
            linear = c::SUNLinSol_Dense(y, matrix, context);
            assert_eq!(c::CVodeSetLinearSolver(memory, linear, matrix), 0);
            assert_eq!(c::CVodeSetJacFn(memory, Some(Raw::<P, N, G>::jacobian)), 0);
        } else {
            fixed_point = c::SUNNonlinSol_FixedPoint(y, 0, context);
            assert_eq!(c::CVodeSetNonlinearSolver(memory, fixed_point), 0);
        }
        assert_eq!(c::CVodeRootInit(memory, G as c_int, Some(Raw::<P, N, G>::roots)), 0);
        assert_eq!(c::CVodeSetStopTime(memory, P::end()), 0);
        let mut t = 0.0;
        loop {
            let flag = c::CVode(memory, P::end(), y, &mut t, c::CV_ONE_STEP);
            assert!(flag >= 0, "{flag}");
            if flag == c::CV_TSTOP_RETURN {
                break;
            }
        }
        let mut steps = 0;
        c::CVodeGetNumSteps(memory, &mut steps);
        let state = data::<N>(y).to_vec();
        c::CVodeFree(&mut memory);
        if P::STIFF {
            c::SUNLinSolFree(linear);
            c::SUNMatDestroy(matrix);
        } else {
            c::SUNNonlinSolFree(fixed_point);
        }
        c::N_VDestroy(absolute);
        c::N_VDestroy(y);
        c::SUNContext_Free(&mut context);
        (steps as u64, state)
    }
}

/// Ratio of the shortest times of the layer and of C. They run in turns for so long that each is undisturbed at some
/// time, and each comes first equally often, even on a machine that is busy with other work.
fn ratio_by_turns<P: Problem<N, G> + Clone, const N: usize, const G: usize>(problem: P) -> f64 {
    let layer = || {
        let start = Instant::now();
        black_box(by_the_layer(black_box(problem.clone())));
        start.elapsed()
    };
    let plain = || {
        let start = Instant::now();
        black_box(by_c(black_box(problem.clone())));
        start.elapsed()
    };
    let (mut shortest_layer, mut shortest_plain) = (Duration::MAX, Duration::MAX);
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(8) {
        shortest_plain = shortest_plain.min(plain());
        shortest_layer = shortest_layer.min(layer()).min(layer());
        shortest_plain = shortest_plain.min(plain());
    }
    shortest_layer.as_secs_f64() / shortest_plain.as_secs_f64()
}

fn compare<P: Problem<N, G> + Clone, const N: usize, const G: usize>(criterion: &mut Criterion, problem: P) {
    let (layer, plain) = (by_the_layer(problem.clone()), by_c(problem.clone()));
    assert_eq!(layer, plain, "the same arithmetic");
    println!("{}: {} steps, the same to the last bit", P::NAME, layer.0);
    println!(
        "{}: {:.4} of the time of C alone, by turns",
        P::NAME,
        ratio_by_turns(problem.clone())
    );
    let mut group = criterion.benchmark_group(P::NAME);
    group.bench_function("c", |b| b.iter(|| by_c(black_box(problem.clone()))));
    group.bench_function("layer", |b| b.iter(|| by_the_layer(black_box(problem.clone()))));
    group.finish();
}

fn overhead(criterion: &mut Criterion) {
    compare(criterion, Roberts);
    compare(criterion, Slip::new());
}

criterion_group!(benches, overhead);
criterion_main!(benches);
