//! The callbacks pass every finite value to C and no other value, at any place and next to values of any size. Slices
//! have the right lengths and the system's own dimension.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};

use nalgebra::DMatrixViewMut;
use stickslip::engine::{Error, ErrorKind};
use stickslip::sundials::{
    AdvanceTarget, Callback, CvodeOptions, Direction, ErkTable, OdeSystem, Solver, SolverMethod, Tolerances,
};

const BAD: [f64; 3] = [f64::INFINITY, f64::NEG_INFINITY, f64::NAN];

/// Constant values of all functions. An empty list writes nothing.
#[derive(Default)]
struct Constants {
    dimension: Cell<usize>,
    slopes: Vec<f64>,
    jacobian: Vec<f64>,
    crossings: Vec<f64>,
    /// Values that the crossing functions find in their slice.
    found: Vec<f64>,
}

impl OdeSystem for Constants {
    fn dimension(&self) -> usize {
        self.dimension.get()
    }
    fn rhs(&mut self, _t: f64, y: &[f64], ydot: &mut [f64]) {
        assert_eq!((y.len(), ydot.len()), (self.slopes.len(), self.slopes.len()));
        ydot.copy_from_slice(&self.slopes);
    }
    fn has_jacobian(&self) -> bool {
        true
    }
    fn jacobian(&mut self, _t: f64, y: &[f64], ydot: &[f64], mut j: DMatrixViewMut<'_, f64>) {
        assert_eq!((y.len(), ydot.len()), (j.nrows(), j.ncols()));
        for (entry, value) in j.iter_mut().zip(&self.jacobian) {
            *entry = *value;
        }
    }
    fn roots(&mut self, _t: f64, y: &[f64], g: &mut [f64]) {
        assert_eq!(y.len(), self.slopes.len());
        self.found.extend_from_slice(g);
        g[..self.crossings.len()].copy_from_slice(&self.crossings);
    }
}

/// `count` values of the largest size, except for one. From two on, their sum overflows.
fn largest_but(count: usize, place: usize, value: f64) -> Vec<f64> {
    let mut values = vec![f64::MAX; count];
    values[place] = value;
    values
}

fn solver(system: Constants, options: CvodeOptions) -> Solver<Constants> {
    let dimension = system.slopes.len();
    system.dimension.set(dimension);
    let tolerances = Tolerances::uniform(1e-6, 1.0, dimension);
    let mut solver = Solver::new(system, options, 0.0, &vec![1.0; dimension], &tolerances).unwrap();
    solver
        .set_crossings(&vec![Direction::Either; solver.system().crossings.len()])
        .unwrap();
    solver
}

/// Row and column that the error names.
fn named(solver: &mut Solver<Constants>, callback: Callback, value: f64) -> (usize, usize) {
    let error = solver
        .advance(1.0, AdvanceTarget::Normal)
        .expect_err("the value is refused");
    let cause = error.cause.expect("the value is named");
    assert_eq!((cause.callback, cause.value.to_bits()), (callback, value.to_bits()));
    (cause.component, cause.column)
}

#[test]
fn property_a_value_that_is_not_finite_is_found_wherever_it_stands() {
    for count in 1..=9 {
        for (place, value) in (0..count).flat_map(|place| BAD.map(|value| (place, value))) {
            let system = Constants {
                slopes: largest_but(count, place, value),
                ..Constants::default()
            };
            let mut slopes = solver(system, CvodeOptions::ADAMS);
            assert_eq!(named(&mut slopes, Callback::RightHandSide, value), (place, 0));

            let system = Constants {
                slopes: vec![1.0],
                crossings: largest_but(count, place, value),
                ..Constants::default()
            };
            let mut crossings = solver(system, CvodeOptions::ADAMS);
            assert_eq!(named(&mut crossings, Callback::Crossing, value), (place, 0));
        }
    }
    for n in 1..=4 {
        for (place, value) in (0..n * n).flat_map(|place| BAD.map(|value| (place, value))) {
            let system = Constants {
                slopes: vec![1.0; n],
                jacobian: largest_but(n * n, place, value),
                ..Constants::default()
            };
            let mut jacobian = solver(system, CvodeOptions::BDF);
            // The matrix is stored column by column.
            assert_eq!(named(&mut jacobian, Callback::Jacobian, value), (place % n, place / n));
        }
    }
}

/// y' = 2^1023 in both components: a step of 2^-1003 advances by exactly 2^20. The sum of the slopes is 2^1024, more
/// than a double holds. So is the sum of the crossing functions, none of which crosses.
#[test]
fn property_finite_values_are_taken_even_if_their_sum_overflows() {
    let huge = 2f64.powi(1023);
    for count in 1..=5 {
        let system = Constants {
            dimension: Cell::new(2),
            slopes: vec![huge; 2],
            crossings: vec![huge; count],
            ..Constants::default()
        };
        let step = 2f64.powi(-1003);
        let options = SolverMethod::Erk {
            table: ErkTable::HeunEuler2s12,
            fixed_step: Some(step),
        };
        let tolerances = Tolerances::uniform(1e-6, 1.0, 2);
        let mut solver = Solver::new(system, options, 0.0, &[0.0; 2], &tolerances).unwrap();
        solver.set_crossings(&vec![Direction::Either; count]).unwrap();
        for k in 1..=4 {
            solver.advance(1.0, AdvanceTarget::OneStep).unwrap();
            let k = f64::from(k);
            assert_eq!((solver.time(), solver.state()), (k * step, &[k * 2f64.powi(20); 2][..]));
        }
    }
}

#[test]
fn property_crossing_functions_arrive_zeroed() {
    for count in 1..=9 {
        let system = Constants {
            slopes: vec![1.0],
            crossings: vec![1.0; count],
            ..Constants::default()
        };
        let mut solver = solver(system, CvodeOptions::ADAMS);
        solver.advance(1.0, AdvanceTarget::Normal).unwrap();
        let found = &solver.system().found;
        assert!(found.len() > 2 * count && found.iter().all(|&value| value == 0.0));
    }
}

/// The memory behind the slices has the length of the integrator's creation, so another length must be impossible.
#[test]
fn property_a_dimension_that_changes_is_a_panic() {
    let constants = || Constants {
        slopes: vec![1.0; 3],
        jacobian: vec![0.0; 9],
        crossings: vec![1.0],
        ..Constants::default()
    };
    for other in [0, 2, 4, usize::MAX] {
        for options in [CvodeOptions::ADAMS, CvodeOptions::BDF] {
            let mut solver = solver(constants(), options);
            solver.advance(1.0, AdvanceTarget::OneStep).unwrap();
            solver.system_mut().dimension.set(other);
            let panic =
                catch_unwind(AssertUnwindSafe(|| solver.advance(1.0, AdvanceTarget::Normal))).expect_err("a panic");
            let text = panic.downcast_ref::<String>().expect("a text");
            assert!(text.contains(&format!("dimension returned {other}, but 3")), "{text}");

            solver.system_mut().dimension.set(3);
            assert!(matches!(
                solver.advance(1.0, AdvanceTarget::Normal),
                Err(Error {
                    kind: ErrorKind::NotRestarted,
                    ..
                })
            ));
            solver.restart(0.0, &[0.0; 3]).unwrap();
            solver.advance(1.0, AdvanceTarget::Normal).unwrap();
            assert!(solver.state().iter().all(|y| (y - 1.0).abs() < 1e-6));
        }
    }
}
