//! The integrators against closed forms, and against what SUNDIALS documents of its interface.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::DMatrixViewMut;
use proptest::prelude::*;
use stickslip::engine::{Error, ErrorKind};
use stickslip::sundials::{
    AdvanceTarget, Advanced, Callback, Counters, CvodeOptions, Direction, ErkTable, Multistep, Nonlinear, OdeSystem,
    ShortSteps, Solver, SolverMethod, Tolerances,
};

/// x'' = -x: x = cos t, v = -sin t from (1, 0). Crossings of x and of v.
#[derive(Default)]
struct Oscillator {
    jacobian: bool,
    rhs_calls: u64,
    jacobian_calls: u64,
    root_calls: u64,
}

impl Oscillator {
    fn with_jacobian() -> Self {
        Self {
            jacobian: true,
            ..Self::default()
        }
    }
}

impl OdeSystem for Oscillator {
    fn dimension(&self) -> usize {
        2
    }

    fn rhs(&mut self, _t: f64, y: &[f64], ydot: &mut [f64]) {
        self.rhs_calls += 1;
        ydot[0] = y[1];
        ydot[1] = -y[0];
    }

    fn has_jacobian(&self) -> bool {
        self.jacobian
    }

    fn jacobian(&mut self, _t: f64, _y: &[f64], _ydot: &[f64], mut j: DMatrixViewMut<'_, f64>) {
        self.jacobian_calls += 1;
        assert!(j.iter().all(|&entry| entry == 0.0), "the matrix arrives zeroed");
        j[(0, 1)] = 1.0;
        j[(1, 0)] = -1.0;
    }

    fn roots(&mut self, _t: f64, y: &[f64], g: &mut [f64]) {
        self.root_calls += 1;
        g.copy_from_slice(&y[..g.len()]);
    }
}

const START: [f64; 2] = [1.0, 0.0];

fn tight() -> Tolerances {
    Tolerances::uniform(1e-10, 1e-10, 2)
}

fn cvode(method: Multistep, nonlinear: Nonlinear) -> Solver<Oscillator> {
    let options = CvodeOptions {
        method,
        nonlinear,
        max_order: None,
        ..CvodeOptions::ADAMS
    };
    Solver::new(Oscillator::with_jacobian(), options, 0.0, &START, &tight()).unwrap()
}

fn erk() -> Solver<Oscillator> {
    Solver::new(
        Oscillator::default(),
        ErkTable::DormandPrince7s45,
        0.0,
        &START,
        &tight(),
    )
    .unwrap()
}

fn esdirk() -> Solver<Oscillator> {
    Solver::new(Oscillator::with_jacobian(), SolverMethod::ESDIRK, 0.0, &START, &tight()).unwrap()
}

/// One of each kind, to be put through the same test.
macro_rules! for_each_integrator {
    ($solver:ident => $test:block) => {{
        for method in [Multistep::Adams, Multistep::Bdf] {
            for nonlinear in [Nonlinear::Newton, Nonlinear::FixedPoint] {
                #[allow(unused_mut)]
                let mut $solver = cvode(method, nonlinear);
                $test
            }
        }
        {
            #[allow(unused_mut)]
            let mut $solver = erk();
            $test
        }
        {
            #[allow(unused_mut)]
            let mut $solver = esdirk();
            $test
        }
    }};
}

/// The largest error of the oscillator's state at its time.
fn error(solver: &Solver<Oscillator>) -> f64 {
    let (sin, cos) = solver.time().sin_cos();
    let y = solver.state();
    (y[0] - cos).abs().max((y[1] + sin).abs())
}

// --- Crossings ---------------------------------------------------------------------------------------------------

/// x crosses zero at pi/2 falling and at 3 pi/2 rising, v at pi rising (at 0 it starts). A local tolerance of 1e-10
/// adds up to some 1e-7 over a hundred steps at worst; the interpolant's error is of that size as well.
#[test]
fn analytic_oscillator_crossings_in_order_and_direction() {
    use Direction::{Falling, Rising};
    for_each_integrator!(solver => {
        solver.set_max_step(Some(0.1)).unwrap();
        solver.set_crossings(&[Direction::Either, Direction::Either]).unwrap();
        for (time, found) in [
            (FRAC_PI_2, [Some(Falling), None]),
            (PI, [None, Some(Rising)]),
            (3.0 * FRAC_PI_2, [Some(Rising), None]),
            (2.0 * PI, [None, Some(Falling)]),
        ] {
            assert_eq!(solver.advance(10.0, AdvanceTarget::Normal).unwrap(), Advanced::Roots);
            assert!((solver.time() - time).abs() < 1e-7, "{} for {time}", solver.time());
            assert_eq!(solver.crossings_found(), found);
        }
    });
}

#[test]
fn analytic_oscillator_crossings_filtered_by_direction() {
    for_each_integrator!(solver => {
        solver.set_max_step(Some(0.1)).unwrap();
        solver.set_crossings(&[Direction::Rising]).unwrap();
        assert_eq!(solver.advance(20.0, AdvanceTarget::Normal).unwrap(), Advanced::Roots);
        assert!((solver.time() - 3.0 * FRAC_PI_2).abs() < 1e-7);
        assert_eq!(solver.crossings_found(), [Some(Direction::Rising)]);
        // From here on the other one.
        solver.set_crossings(&[Direction::Falling]).unwrap();
        assert_eq!(solver.advance(20.0, AdvanceTarget::Normal).unwrap(), Advanced::Roots);
        assert!((solver.time() - 5.0 * FRAC_PI_2).abs() < 1e-7);
        assert_eq!(solver.crossings_found(), [Some(Direction::Falling)]);
        // And none.
        solver.set_crossings(&[]).unwrap();
        assert_eq!(solver.advance(20.0, AdvanceTarget::Normal).unwrap(), Advanced::Reached);
        assert!(solver.crossings_found().is_empty());
    });
}

/// v is zero at the start: not a crossing. After the restart x is not zero, and has to be watched from the first step
/// although it was the function that was zero when the solver started before.
#[test]
fn sundials_a_function_that_is_zero_at_the_start_is_watched_when_it_has_left() {
    for_each_integrator!(solver => {
        solver.set_max_step(Some(0.1)).unwrap();
        solver.set_crossings(&[Direction::Either, Direction::Either]).unwrap();
        solver.restart(0.0, &[0.0, 0.0]).unwrap();
        assert_eq!(solver.advance(1.0, AdvanceTarget::Normal).unwrap(), Advanced::Reached);
        // x = -1e-9 + 1e-3 t crosses zero within the first step.
        solver.set_initial_step(Some(1e-3)).unwrap();
        solver.restart(0.0, &[-1e-9, 1e-3]).unwrap();
        assert_eq!(solver.advance(1.0, AdvanceTarget::Normal).unwrap(), Advanced::Roots);
        assert_eq!(solver.crossings_found(), [Some(Direction::Rising), None]);
        assert!((solver.time() - 1e-6).abs() < 1e-9, "{}", solver.time());
    });
}

// --- Stop times, tasks, dense output, restarts ----------------------------------------------------------------------

#[test]
fn sundials_a_stop_time_is_hit_exactly_and_once() {
    for_each_integrator!(solver => {
        solver.set_stop_time(Some(1.5)).unwrap();
        assert_eq!(solver.advance(3.0, AdvanceTarget::Normal).unwrap(), Advanced::StopTime);
        assert_eq!(solver.time(), 1.5);
        assert_eq!(solver.mesh_time().unwrap(), 1.5);
        assert!(error(&solver) < added_up(&mut solver, 1e-10), "{}", error(&solver));
        assert_eq!(solver.advance(3.0, AdvanceTarget::Normal).unwrap(), Advanced::Reached);
        // A restart clears it, and so does None.
        solver.set_stop_time(Some(3.5)).unwrap();
        solver.restart(3.0, &[3f64.cos(), -3f64.sin()]).unwrap();
        assert_eq!(solver.advance(4.0, AdvanceTarget::Normal).unwrap(), Advanced::Reached);
        solver.set_stop_time(Some(5.0)).unwrap();
        solver.set_stop_time(None).unwrap();
        assert_eq!(solver.advance(6.0, AdvanceTarget::Normal).unwrap(), Advanced::Reached);
        assert!(error(&solver) < 1e-7);
    });
}

/// The step before a stop time is cut, and its Newton matrix is that of another step. The method follows its tolerance all the
/// same.
#[test]
fn analytic_a_cut_step_converges() {
    for stop in [1.0, 1.5, 2.0] {
        let mut solver = esdirk();
        solver.set_max_steps(None).unwrap();
        solver.set_stop_time(Some(stop)).unwrap();
        assert_eq!(solver.advance(9.0, AdvanceTarget::Normal).unwrap(), Advanced::StopTime);
        let bound = added_up(&mut solver, 1e-10);
        assert!(error(&solver) < bound, "{stop}: {}", error(&solver));
    }
}

#[test]
fn sundials_one_step_goes_to_the_mesh() {
    for_each_integrator!(solver => {
        let mut before = 0.0;
        for _ in 0..20 {
            assert_eq!(solver.advance(10.0, AdvanceTarget::OneStep).unwrap(), Advanced::Stepped);
            assert_eq!(solver.time(), solver.mesh_time().unwrap());
            let step = solver.last_step_size().unwrap();
            assert!((before + step - solver.time()).abs() <= 1e-15, "{before} + {step} = {}", solver.time());
            before = solver.time();
        }
        assert_eq!(solver.counters().unwrap().steps, 20);
    });
}

#[test]
fn analytic_oscillator_backwards_in_time() {
    for_each_integrator!(solver => {
        solver.set_crossings(&[Direction::Either]).unwrap();
        solver.set_max_step(Some(0.1)).unwrap();
        assert_eq!(solver.advance(-2.0, AdvanceTarget::Normal).unwrap(), Advanced::Roots);
        assert!((solver.time() + FRAC_PI_2).abs() < 1e-7);
        assert_eq!(solver.advance(-2.0, AdvanceTarget::Normal).unwrap(), Advanced::Reached);
        assert!(error(&solver) < 1e-7);
    });
}

/// The dense output has at least degree 3; in a step of at most 0.02 its error is some h^4/384 = 4e-10 and less.
#[test]
fn analytic_dense_output_within_the_last_step() {
    for_each_integrator!(solver => {
        solver.set_max_step(Some(0.02)).unwrap();
        solver.set_max_steps(None).unwrap();
        assert_eq!(solver.advance(3.0, AdvanceTarget::Normal).unwrap(), Advanced::Reached);
        let (end, step) = (solver.mesh_time().unwrap(), solver.last_step_size().unwrap());
        let mut out = [0.0; 2];
        for part in 0..=10 {
            let t = end - step * f64::from(part) / 10.0;
            solver.interpolate(t, 0, &mut out).unwrap();
            assert!((out[0] - t.cos()).abs() < 1e-7 && (out[1] + t.sin()).abs() < 1e-7);
            solver.interpolate(t, 1, &mut out).unwrap();
            assert!((out[0] + t.sin()).abs() < 1e-5 && (out[1] + t.cos()).abs() < 1e-5);
        }
        assert!(solver.interpolate(end - 2.0 * step, 0, &mut out).is_err(), "outside of the step");
        assert!(solver.interpolate(f64::NAN, 0, &mut out).is_err());
        assert!(matches!(solver.interpolate(end, 0, &mut [0.0]), Err(Error { kind: ErrorKind::Length { expected: 2, found: 1 }, .. })));
        // The solution itself is not touched.
        assert_eq!(solver.time(), 3.0);
        assert!(error(&solver) < 1e-7);
    });
}

#[test]
fn sundials_nothing_to_interpolate_before_the_first_step() {
    for_each_integrator!(solver => {
        let mut out = [0.0; 2];
        assert!(matches!(solver.interpolate(0.0, 0, &mut out), Err(Error { kind: ErrorKind::NoStep, .. })));
        solver.advance(1.0, AdvanceTarget::OneStep).unwrap();
        assert!(solver.interpolate(solver.time(), 0, &mut out).is_ok());
        solver.restart(0.0, &START).unwrap();
        assert!(matches!(solver.interpolate(0.0, 0, &mut out), Err(Error { kind: ErrorKind::NoStep, .. })));
    });
}

/// A restarted solver does what a new one does, bit by bit, in steps, counters and crossings.
#[test]
fn sundials_a_restart_is_as_good_as_new() {
    for_each_integrator!(solver => {
        let run = |solver: &mut dyn FnMut() -> (Advanced, f64, Vec<f64>, Counters)| {
            let mut trace = Vec::new();
            for _ in 0..40 {
                trace.push(solver());
            }
            trace
        };
        solver.set_crossings(&[Direction::Either, Direction::Either]).unwrap();
        let mut once = || {
            let outcome = solver.advance(10.0, AdvanceTarget::OneStep).unwrap();
            (outcome, solver.time(), solver.state().to_vec(), solver.counters().unwrap())
        };
        let first = run(&mut once);
        solver.restart(0.0, &START).unwrap();
        assert_eq!(solver.counters().unwrap(), Counters::default());
        assert_eq!(solver.crossings_found(), [None, None]);
        assert_eq!((solver.time(), solver.state()), (0.0, &START[..]));
        let mut once = || {
            let outcome = solver.advance(10.0, AdvanceTarget::OneStep).unwrap();
            (outcome, solver.time(), solver.state().to_vec(), solver.counters().unwrap())
        };
        let second = run(&mut once);
        for (first, second) in first.iter().zip(&second) {
            assert_eq!(first, second);
        }
    });
}

/// The solver's counters against the system's own.
#[test]
fn sundials_counters_count_the_calls() {
    for_each_integrator!(solver => {
        solver.set_crossings(&[Direction::Either]).unwrap();
        while solver.advance(10.0, AdvanceTarget::Normal).unwrap() == Advanced::Roots {}
        let counters = solver.counters().unwrap();
        let system = solver.system();
        assert_eq!(counters.rhs_evaluations, system.rhs_calls);
        assert_eq!(counters.jacobian_evaluations, system.jacobian_calls);
        assert_eq!(counters.root_evaluations, system.root_calls);
    });
    let options = CvodeOptions::BDF;
    let mut solver = Solver::new(Oscillator::default(), options, 0.0, &START, &tight()).unwrap();
    solver.advance(1.0, AdvanceTarget::Normal).unwrap();
    let found = solver.counters().unwrap().rhs_evaluations;
    assert_eq!(found, solver.system().rhs_calls, "with differences");
    assert_eq!(solver.system().jacobian_calls, 0);
    let mut solver = Solver::new(Oscillator::default(), SolverMethod::ESDIRK, 0.0, &START, &tight()).unwrap();
    solver.advance(1.0, AdvanceTarget::Normal).unwrap();
    let found = solver.counters().unwrap().rhs_evaluations;
    assert_eq!(found, solver.system().rhs_calls, "with differences");
}

// --- Tables -------------------------------------------------------------------------------------------------------

/// Error after a quarter of a period in `steps` steps, at a step's end.
fn fixed_step_error(solver: &mut Solver<Oscillator>, steps: u32) -> f64 {
    for _ in 0..steps {
        assert_eq!(solver.advance(10.0, AdvanceTarget::OneStep).unwrap(), Advanced::Stepped);
    }
    error(solver)
}

/// The order that the error shows when the step is halved as often as something is to be seen of it; the coefficients of
/// Verner's 9-stage table are good to 13 digits.
fn observed_order(error: impl Fn(u32) -> f64) -> f64 {
    let errors: Vec<f64> = (0..8)
        .map(|halvings| error(2 << halvings))
        .take_while(|&error| error > 1e-12)
        .collect();
    let [.., coarse, fine] = errors[..] else {
        panic!("no two errors to compare: {errors:?}")
    };
    (coarse / fine).log2()
}

/// Of the oscillator some methods have a higher order than in general; none has a lower one. Half an order tells it
/// from its neighbour: the two or three long steps of order 8 that it takes are not yet in the limit.
fn assert_order(observed: f64, order: u32, table: &str) {
    let order = f64::from(order);
    assert!(
        (order - 0.5..order + 1.5).contains(&observed),
        "{table}: {observed} for {order}"
    );
}

#[test]
fn analytic_explicit_tables_converge_with_their_order() {
    for &table in ErkTable::ALL {
        let observed = observed_order(|steps| {
            let fixed_step = Some(1.5 / f64::from(steps));
            let options = SolverMethod::Erk { table, fixed_step };
            let mut solver = Solver::new(Oscillator::default(), options, 0.0, &START, &tight()).unwrap();
            fixed_step_error(&mut solver, steps)
        });
        assert_order(observed, table.order(), table.name());
    }
}

/// The iteration has to converge below the errors that are seen.
#[test]
fn analytic_esdirk_converges_with_its_order() {
    let observed = observed_order(|steps| {
        let options = SolverMethod::Esdirk {
            fixed_step: Some(1.5 / f64::from(steps)),
            trust_convergence_rate: false,
        };
        let tolerances = Tolerances::uniform(1e-15, 1e-15, 2);
        let mut solver = Solver::new(Oscillator::with_jacobian(), options, 0.0, &START, &tolerances).unwrap();
        fixed_step_error(&mut solver, steps)
    });
    assert_order(observed, 5, "ESDIRK");
}

/// What errors of a step may add up to. A norm of 1 allows a step the error 2 (relative + absolute) of a component of
/// size 1; the oscillator damps and amplifies nothing.
fn added_up(solver: &mut Solver<Oscillator>, tolerance: f64) -> f64 {
    4.0 * tolerance * solver.counters().unwrap().steps as f64
}

/// With their error control every explicit table and ESDIRK keep to a tolerance.
#[test]
fn analytic_one_step_methods_follow_a_tolerance() {
    let tolerances = Tolerances::uniform(1e-8, 1e-8, 2);
    for &table in ErkTable::ALL {
        let mut solver = Solver::new(Oscillator::default(), table, 0.0, &START, &tolerances).unwrap();
        solver.set_max_steps(None).unwrap();
        while solver.time() < 6.0 {
            solver.advance(6.0, AdvanceTarget::OneStep).unwrap();
        }
        assert!(
            error(&solver) < added_up(&mut solver, 1e-8),
            "{table}: {}",
            error(&solver)
        );
        assert_eq!(solver.counters().unwrap().last_order, table.order());
    }
    let mut solver = Solver::new(
        Oscillator::with_jacobian(),
        SolverMethod::ESDIRK,
        0.0,
        &START,
        &tolerances,
    )
    .unwrap();
    solver.set_max_steps(None).unwrap();
    while solver.time() < 6.0 {
        solver.advance(6.0, AdvanceTarget::OneStep).unwrap();
    }
    let bound = added_up(&mut solver, 1e-8);
    assert!(error(&solver) < bound, "{}", error(&solver));
    assert_eq!(solver.counters().unwrap().last_order, 5);
}

/// The digits of the C names are stages, embedded order and order.
#[test]
fn sundials_table_names_say_their_properties() {
    let digits = |name: &str| {
        let digits: Vec<u32> = name.rsplit('_').take(3).map(|digit| digit.parse().unwrap()).collect();
        [digits[2], digits[1], digits[0]]
    };
    for &table in ErkTable::ALL {
        let found = [table.stages(), table.embedded_order(), table.order()];
        assert_eq!(found, digits(table.name()), "{table}");
    }
}

// --- Values that are not finite -------------------------------------------------------------------------------------

/// y' = y from 1, not a number from `edge` on; the solution reaches e at t = 1.
struct Edge {
    edge: f64,
    met: u32,
    jacobian: Option<f64>,
    root: f64,
}

impl Edge {
    fn new(edge: f64) -> Self {
        Self {
            edge,
            met: 0,
            jacobian: None,
            root: 1.0,
        }
    }
}

impl OdeSystem for Edge {
    fn dimension(&self) -> usize {
        1
    }

    fn rhs(&mut self, _t: f64, y: &[f64], ydot: &mut [f64]) {
        ydot[0] = if y[0] < self.edge { y[0] } else { f64::NAN };
        self.met += u32::from(ydot[0].is_nan());
    }

    fn has_jacobian(&self) -> bool {
        self.jacobian.is_some()
    }

    fn jacobian(&mut self, _t: f64, _y: &[f64], _ydot: &[f64], mut j: DMatrixViewMut<'_, f64>) {
        j[(0, 0)] = self.jacobian.unwrap_or(1.0);
    }

    fn roots(&mut self, _t: f64, _y: &[f64], g: &mut [f64]) {
        g[0] = self.root;
    }
}

/// Coarse enough for steps that overshoot.
fn coarse() -> Tolerances {
    Tolerances::uniform(1e-3, 1e-3, 1)
}

fn edge_cvode(system: Edge, nonlinear: Nonlinear) -> Solver<Edge> {
    let options = CvodeOptions {
        nonlinear,
        ..CvodeOptions::BDF
    };
    Solver::new(system, options, 0.0, &[1.0], &coarse()).unwrap()
}

/// One of each kind.
macro_rules! for_each_edge_solver {
    ($system:expr, $solver:ident => $test:block) => {{
        for nonlinear in [Nonlinear::Newton, Nonlinear::FixedPoint] {
            #[allow(unused_mut)]
            let mut $solver = edge_cvode($system, nonlinear);
            $test
        }
        {
            #[allow(unused_mut)]
            let mut $solver = Solver::new($system, ErkTable::DormandPrince7s45, 0.0, &[1.0], &coarse()).unwrap();
            $test
        }
        {
            #[allow(unused_mut)]
            let mut $solver = Solver::new($system, SolverMethod::ESDIRK, 0.0, &[1.0], &coarse()).unwrap();
            $test
        }
    }};
}

/// The stop time is where y = e; a step that overshoots it in its stages, as a first step of 0.9 with a step of 2 to
/// come does, meets the edge at 1.02 e and has to be shortened. A tolerance of 1e-3, a few times over.
#[test]
fn analytic_a_step_beyond_the_edge_is_taken_back() {
    for_each_edge_solver!(Edge::new(1.02 * 1f64.exp()), solver => {
        solver.set_initial_step(Some(3.0)).unwrap();
        solver.set_stop_time(None).unwrap();
        while solver.time() < 0.9 {
            solver.advance(0.9, AdvanceTarget::Normal).unwrap();
        }
        assert_eq!(solver.time(), 0.9);
        assert!(solver.system().met > 0, "the edge was met");
        assert!((solver.state()[0] - 0.9f64.exp()).abs() < 2e-2, "{}", solver.state()[0]);
        let counters = solver.counters().unwrap();
        assert!(counters.steps > 0 && counters.rhs_evaluations > 0);
    });
}

/// For ERKStep: the estimate of the first step meets the edge already.
#[test]
fn analytic_a_first_step_beyond_the_edge_is_taken_back() {
    for_each_edge_solver!(Edge::new(1.0 + 1e-6), solver => {
        solver.set_max_steps(None).unwrap();
        assert_eq!(solver.advance(5e-7, AdvanceTarget::Normal).unwrap(), Advanced::Reached);
        assert!((solver.state()[0] - 5e-7f64.exp()).abs() < 1e-9);
    });
    let mut solver = Solver::new(Edge::new(1.0 + 1e-6), ErkTable::Verner13s78, 0.0, &[1.0], &coarse()).unwrap();
    assert_eq!(solver.advance(1.0, AdvanceTarget::OneStep).unwrap(), Advanced::Stepped);
    assert!(solver.system().met > 0 && solver.time() > 0.0 && solver.time() < 1e-6);
}

/// Behind the edge there is nothing: after some steps up to it every solver has to say so, and stand where it stood.
#[test]
fn analytic_a_wall_is_an_error_that_names_the_value() {
    for_each_edge_solver!(Edge::new(2.0), solver => {
        solver.set_max_steps(None).unwrap();
        assert_eq!(solver.advance(0.5, AdvanceTarget::Normal).unwrap(), Advanced::Reached);
        let before = solver.state().to_vec();
        let error = solver.advance(3.0, AdvanceTarget::Normal).unwrap_err();
        let cause = error.cause.expect("the value is named");
        assert_eq!((cause.callback, cause.component), (Callback::RightHandSide, 0));
        assert!(cause.value.is_nan() && cause.time > 0.5 && cause.time < 3.0);
        let text = error.to_string();
        assert!(text.contains("the right-hand side gave NaN in component 0 at t = "), "{text}");
        assert_eq!((solver.time(), solver.state()), (0.5, &before[..]));
        // y reaches 2 at ln 2.
        assert!(matches!(error.kind, ErrorKind::Flag(_) | ErrorKind::Stalled), "{error}");
        let time = error.time;
        assert!(time > 0.5 && time < 2f64.ln() + 0.01, "{time}");

        // It does not go on, but it can start anew.
        assert!(matches!(solver.advance(3.0, AdvanceTarget::Normal), Err(Error { kind: ErrorKind::NotRestarted, .. })));
        assert!(matches!(solver.interpolate(0.5, 0, &mut [0.0]), Err(Error { kind: ErrorKind::NoStep, .. })));
        solver.restart(0.0, &[1.0]).unwrap();
        assert_eq!(solver.advance(0.5, AdvanceTarget::Normal).unwrap(), Advanced::Reached);
        assert_eq!(solver.state(), before);
    });
}

#[test]
fn sundials_a_right_hand_side_without_a_first_value_is_an_error() {
    for_each_edge_solver!(Edge::new(0.5), solver => {
        let error = solver.advance(1.0, AdvanceTarget::Normal).unwrap_err();
        assert_eq!(error.cause.expect("the value is named").time, 0.0);
        assert!(error.to_string().contains("RHSFUNC"), "{error}");
    });
}

#[test]
fn sundials_a_fixed_step_cannot_be_shortened() {
    let options = SolverMethod::Erk {
        table: ErkTable::DormandPrince7s45,
        fixed_step: Some(0.1),
    };
    let mut solver = Solver::new(Edge::new(2.0), options, 0.0, &[1.0], &coarse()).unwrap();
    let error = solver.advance(1.0, AdvanceTarget::Normal).unwrap_err();
    assert!(error.cause.is_some(), "{error}");
}

#[test]
fn sundials_a_jacobian_that_is_not_finite_is_an_error_that_names_the_value() {
    for value in [f64::NAN, f64::INFINITY] {
        let system = || Edge {
            jacobian: Some(value),
            ..Edge::new(1e300)
        };
        let error = edge_cvode(system(), Nonlinear::Newton)
            .advance(1.0, AdvanceTarget::Normal)
            .unwrap_err();
        let found = error.cause.expect("the value is named").callback;
        assert_eq!(found, Callback::Jacobian, "{error}");
        assert!(error.to_string().contains("in row 0, column 0 at t = "), "{error}");
        let mut solver = Solver::new(system(), SolverMethod::ESDIRK, 0.0, &[1.0], &coarse()).unwrap();
        let error = solver.advance(1.0, AdvanceTarget::Normal).unwrap_err();
        let found = error.cause.expect("the value is named").callback;
        assert_eq!(found, Callback::Jacobian, "{error}");
    }
}

#[test]
fn sundials_a_crossing_function_that_is_not_finite_is_an_error_at_once() {
    for_each_edge_solver!(Edge::new(1e300), solver => {
        solver.set_crossings(&[Direction::Either]).unwrap();
        solver.advance(0.5, AdvanceTarget::Normal).unwrap();
        solver.system_mut().root = f64::NAN;
        let error = solver.advance(1.0, AdvanceTarget::Normal).unwrap_err();
        assert_eq!(error.cause.expect("the value is named").callback, Callback::Crossing);
        assert!(error.to_string().contains("RTFUNC_FAIL (-12)"), "{error}");
        assert!(error.to_string().contains("the crossing function gave NaN in component 0"), "{error}");
        assert_eq!(solver.time(), 0.5);
    });
}

// --- Errors -------------------------------------------------------------------------------------------------------

#[test]
fn sundials_too_many_steps_is_an_error_that_one_may_go_on_after() {
    for_each_integrator!(solver => {
        solver.set_max_steps(Some(5)).unwrap();
        let error = solver.advance(10.0, AdvanceTarget::Normal).unwrap_err();
        assert!(matches!(error.kind, ErrorKind::Flag(flag) if flag.number() == -1));
        assert!(error.to_string().contains("TOO_MUCH_WORK (-1)"), "{error}");
        assert!(error.to_string().contains("mxstep"), "SUNDIALS' own words are in {error}");
        assert!(error.cause.is_none());
        assert_eq!((solver.time(), solver.state()), (0.0, &START[..]));
        solver.set_max_steps(None).unwrap();
        assert_eq!(solver.advance(10.0, AdvanceTarget::Normal).unwrap(), Advanced::Reached);
        assert!(error_below(&solver, 1e-6));
    });
}

fn error_below(solver: &Solver<Oscillator>, bound: f64) -> bool {
    error(solver) < bound
}

#[test]
fn sundials_wrong_arguments_are_errors() {
    let new = |y0: &[f64], tolerances: &Tolerances| {
        Solver::new(Oscillator::default(), CvodeOptions::ADAMS, 0.0, y0, tolerances).map(|_| ())
    };
    let refused = |y0: &[f64], tolerances: &Tolerances, kind: ErrorKind, what: &str| {
        let error = new(y0, tolerances).unwrap_err();
        assert!(error.kind == kind && error.to_string().starts_with(what), "{error}");
    };
    let short = ErrorKind::Length { expected: 2, found: 1 };
    refused(&[1.0], &tight(), short, "initial state");
    refused(
        &START,
        &Tolerances::uniform(1e-6, 1e-6, 1),
        short,
        "absolute tolerances",
    );
    let negative = Tolerances::uniform(-1e-6, 1e-6, 2);
    refused(&START, &negative, ErrorKind::Argument, "relative tolerance");
    let nan = Tolerances::uniform(1e-6, f64::NAN, 2);
    refused(&START, &nan, ErrorKind::Argument, "absolute tolerance");
    refused(&[f64::NAN, 0.0], &tight(), ErrorKind::Argument, "initial state");

    for_each_integrator!(solver => {
        for t in [f64::NAN, f64::INFINITY] {
            assert!(matches!(solver.advance(t, AdvanceTarget::Normal), Err(Error { kind: ErrorKind::Argument, .. })));
            assert!(matches!(solver.set_stop_time(Some(t)), Err(Error { kind: ErrorKind::Argument, .. })));
            assert!(matches!(solver.restart(t, &START), Err(Error { kind: ErrorKind::Argument, .. })));
            assert!(matches!(solver.set_max_step(Some(t)), Err(Error { kind: ErrorKind::Argument, .. })));
            assert!(matches!(solver.set_max_step(Some(-1.0)), Err(Error { kind: ErrorKind::Argument, .. })));
            assert!(matches!(solver.set_initial_step(Some(t)), Err(Error { kind: ErrorKind::Argument, .. })));
        }
        assert!(matches!(solver.restart(0.0, &[1.0; 3]), Err(Error { kind: ErrorKind::Length { expected: 2, found: 3 }, .. })));
        assert!(solver.set_tolerances(&Tolerances::uniform(1e-6, 1e-6, 3)).is_err());
        let error = solver.advance(0.0, AdvanceTarget::Normal).unwrap_err();
        assert!(error.to_string().contains("TOO_CLOSE"), "{error}");
        // None of that has hurt.
        assert_eq!(solver.advance(1.0, AdvanceTarget::Normal).unwrap(), Advanced::Reached);
        assert!(error_below(&solver, 1e-7));
    });
}

#[test]
fn sundials_an_error_has_function_flag_time_and_message() {
    let mut solver = cvode(Multistep::Bdf, Nonlinear::Newton);
    solver.advance(1.0, AdvanceTarget::Normal).unwrap();
    let error = solver.set_stop_time(Some(0.5)).unwrap_err();
    assert!(matches!(error.kind, ErrorKind::Flag(flag) if flag.name() == "CV_ILL_INPUT"));
    let text = error.to_string();
    assert!(
        text.starts_with("CVodeSetStopTime returned CV_ILL_INPUT (-22) at t = "),
        "{text}"
    );
    assert!(text.contains("is behind current t"), "{text}");
}

#[test]
fn sundials_integrators_run_in_parallel_threads() {
    let results: Vec<f64> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4)
            .map(|_| {
                // Made here, run there.
                let mut solver = esdirk();
                scope.spawn(move || {
                    solver.advance(5.0, AdvanceTarget::Normal).unwrap();
                    solver.state()[0]
                })
            })
            .collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert!(results.iter().all(|&result| result == results[0]));
}

// --- Regression and properties ------------------------------------------------------------------------------------

/// Modes that decay, at rates over two decades.
struct Decays;

impl Decays {
    const COUNT: usize = 12;

    fn rate(mode: usize) -> f64 {
        10f64.powf(mode as f64 / 5.0)
    }
}

impl OdeSystem for Decays {
    fn dimension(&self) -> usize {
        Self::COUNT
    }

    fn rhs(&mut self, _t: f64, y: &[f64], ydot: &mut [f64]) {
        for (mode, (rate, y)) in ydot.iter_mut().zip(y).enumerate() {
            *rate = -Self::rate(mode) * y;
        }
    }
}

/// Where the highest order is raised between two steps, CVODE reads a vector of its history that it has not written. Its steps must
/// not depend on what the memory held before.
#[test]
fn sundials_memory_that_was_used_before_decides_no_order() {
    let steps = |before: f64, until: f64| {
        // Blocks of the size of a vector, handed back: the solver's own are the next that have this size.
        drop(vec![vec![before; Decays::COUNT]; 100]);
        let options = CvodeOptions {
            max_order: Some(4),
            short_steps: Some(ShortSteps { max_order: 2, until }),
            ..CvodeOptions::BDF
        };
        let tolerances = Tolerances::uniform(1e-8, 1e-10, Decays::COUNT);
        let mut solver = Solver::new(Decays, options, 0.0, &[1.0; Decays::COUNT], &tolerances).unwrap();
        solver.set_max_steps(None).unwrap();
        while solver.advance(3.0, AdvanceTarget::Normal).unwrap() != Advanced::Reached {}
        solver.counters().unwrap().steps
    };
    for k in 0..24 {
        let until = 1e-5 * 1.3f64.powi(k);
        let (clean, used) = (steps(0.0, until), steps(1e200, until));
        assert_eq!(clean, used, "{until:e} s");
    }
}

/// The solver's path on one run of each kind: a change says that numbers move.
#[test]
fn regression_counters_of_one_period() {
    let mut text = String::new();
    for_each_integrator!(solver => {
        solver.set_crossings(&[Direction::Either]).unwrap();
        while solver.advance(2.0 * PI, AdvanceTarget::Normal).unwrap() == Advanced::Roots {}
        let Counters {
            steps,
            rhs_evaluations,
            jacobian_evaluations,
            linear_solver_setups,
            error_test_failures,
            nonlinear_iterations,
            nonlinear_convergence_failures,
            root_evaluations,
            last_order,
            ..
        } = solver.counters().unwrap();
        text += &format!(
            "steps {steps}, rhs {rhs_evaluations}, jacobians {jacobian_evaluations}, setups {linear_solver_setups}, \
             refused {error_test_failures}, iterations {nonlinear_iterations}, \
             diverged {nonlinear_convergence_failures}, roots {root_evaluations}, order {last_order}\n"
        );
    });
    insta::assert_snapshot!(text, @r"
    steps 107, rhs 124, jacobians 2, setups 18, refused 3, iterations 121, diverged 0, roots 131, order 7
    steps 166, rhs 327, jacobians 0, setups 0, refused 2, iterations 324, diverged 0, roots 186, order 5
    steps 255, rhs 276, jacobians 5, setups 27, refused 0, iterations 273, diverged 0, roots 280, order 5
    steps 262, rhs 501, jacobians 0, setups 0, refused 0, iterations 498, diverged 0, roots 277, order 5
    steps 203, rhs 1237, jacobians 0, setups 0, refused 0, iterations 0, diverged 0, roots 218, order 5
    steps 156, rhs 2826, jacobians 4, setups 18, refused 0, iterations 1869, diverged 1, roots 173, order 5
    ");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, failure_persistence: None, ..ProptestConfig::default() })]

    /// x + v tan(phase) is zero where the phase says, whatever the amplitude.
    #[test]
    fn property_crossing_times_do_not_depend_on_the_amplitude(phase in 0.1..1.4f64, amplitude in 1e-3..1e3f64) {
        let tolerances = Tolerances::uniform(1e-10, 1e-10 * amplitude, 2);
        let (sin, cos) = phase.sin_cos();
        let start = [amplitude * cos, -amplitude * sin];
        let mut solver = Solver::new(Oscillator::default(), ErkTable::Verner8s56, 0.0, &start, &tolerances).unwrap();
        solver.set_max_step(Some(0.1)).unwrap();
        solver.set_crossings(&[Direction::Falling]).unwrap();
        prop_assert_eq!(solver.advance(10.0, AdvanceTarget::Normal).unwrap(), Advanced::Roots);
        prop_assert!((solver.time() - (FRAC_PI_2 - phase)).abs() < 1e-8);
    }
}

/// Ten thousand cycles in one run: the watch for a solver that no longer moves leaves a long one alone.
#[test]
fn analytic_a_long_run_is_not_taken_for_a_stalled_one() {
    let tolerances = Tolerances::uniform(1e-6, 1e-6, 2);
    let end = 2e4 * std::f64::consts::PI;
    for options in [CvodeOptions::ADAMS, CvodeOptions::BDF] {
        let mut solver = Solver::new(Oscillator::default(), options, 0.0, &[1.0, 0.0], &tolerances).unwrap();
        solver.set_max_steps(None).unwrap();
        assert_eq!(solver.advance(end, AdvanceTarget::Normal).unwrap(), Advanced::Reached);
        assert!(solver.counters().unwrap().rhs_evaluations > 100_000);
    }
}
