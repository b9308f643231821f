//! A panic of a callback goes through C without unwinding it, and comes out of `advance` as it went in. Small enough
//! for `valgrind --leak-check=full --error-exitcode=1`, and without the test harness, whose threads show up there.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, panic_any};
use std::rc::Rc;

use nalgebra::DMatrixViewMut;
use stickslip::engine::{Error, ErrorKind};
use stickslip::numerics::band::BandMut;
use stickslip::sundials::{
    AdvanceTarget, Advanced, CvodeOptions, Direction, ErkTable, Multistep, Nonlinear, OdeSystem, Solver, SolverMethod,
    Tolerances,
};

#[derive(Clone, Copy, Debug, PartialEq)]
enum Where {
    Nowhere,
    Rhs,
    Jacobian,
    Roots,
    /// Of a system with a band in its own coordinates.
    BandJacobian,
    Enter,
    Leave,
}

/// Not a string: it has to arrive whole.
#[derive(Debug, PartialEq)]
struct Payload {
    place: Where,
    time: f64,
}

/// y' = -y, with a panic after `after` calls in one of the functions.
struct Grenade {
    place: Where,
    after: u32,
    calls: Cell<u32>,
    /// Counts the systems that are alive.
    _alive: Rc<()>,
}

impl Grenade {
    fn new(place: Where, after: u32, alive: &Rc<()>) -> Self {
        Self {
            place,
            after,
            calls: Cell::new(0),
            _alive: alive.clone(),
        }
    }

    fn tick(&self, place: Where, time: f64) {
        if place == self.place {
            self.calls.update(|calls| calls + 1);
            if self.calls.get() > self.after {
                panic_any(Payload { place, time });
            }
        }
    }
}

impl OdeSystem for Grenade {
    fn dimension(&self) -> usize {
        1
    }

    fn rhs(&mut self, t: f64, y: &[f64], ydot: &mut [f64]) {
        self.tick(Where::Rhs, t);
        ydot[0] = -y[0];
    }

    fn has_jacobian(&self) -> bool {
        true
    }

    fn jacobian(&mut self, t: f64, _y: &[f64], _ydot: &[f64], mut j: DMatrixViewMut<'_, f64>) {
        self.tick(Where::Jacobian, t);
        j[(0, 0)] = -1.0;
    }

    fn half_width(&self) -> Option<usize> {
        let of_a_band = [Where::BandJacobian, Where::Enter, Where::Leave];
        of_a_band.contains(&self.place).then_some(0)
    }

    fn band_jacobian(&mut self, t: f64, _y: &[f64], _ydot: &[f64], j: &mut BandMut<'_>) {
        self.tick(Where::BandJacobian, t);
        j.add(0, 0, -1.0);
    }

    fn enter_band(&self, x: &[f64], z: &mut [f64]) {
        self.tick(Where::Enter, 0.0);
        z[0] = 2.0 * x[0];
    }

    fn leave_band(&self, z: &[f64], b: &[f64], x: &mut [f64]) {
        self.tick(Where::Leave, 0.0);
        assert!(b[0].is_finite());
        x[0] = z[0] / 2.0;
    }

    fn roots(&mut self, t: f64, y: &[f64], g: &mut [f64]) {
        self.tick(Where::Roots, t);
        g[0] = y[0] + 1.0;
    }
}

fn tolerances() -> Tolerances {
    Tolerances::uniform(1e-6, 1e-6, 1)
}

fn cvode(system: Grenade, method: Multistep, nonlinear: Nonlinear) -> Solver<Grenade> {
    let options = CvodeOptions {
        method,
        nonlinear,
        ..CvodeOptions::ADAMS
    };
    Solver::new(system, options, 0.0, &[1.0], &tolerances()).unwrap()
}

/// Runs it to the panic, and then, disarmed, to the end.
fn explode(mut solver: Solver<Grenade>) {
    let place = solver.system().place;
    solver.set_crossings(&[Direction::Either]).unwrap();
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        while solver.time() < 100.0 {
            solver.advance(100.0, AdvanceTarget::OneStep).unwrap();
        }
    }));
    let payload = outcome
        .expect_err("a panic")
        .downcast::<Payload>()
        .expect("the payload of the callback");
    assert_eq!(payload.place, place);
    assert!((0.0..100.0).contains(&payload.time));
    // What was handed out last is still there: y = exp(-t), to a few steps of the tolerance.
    assert!(solver.time() < 100.0);
    assert!((solver.state()[0] - (-solver.time()).exp()).abs() < 1e-4);

    solver.system_mut().place = Where::Nowhere;
    assert!(matches!(
        solver.advance(100.0, AdvanceTarget::Normal),
        Err(Error {
            kind: ErrorKind::NotRestarted,
            ..
        })
    ));
    solver.restart(0.0, &[1.0]).unwrap();
    assert_eq!(solver.advance(1.0, AdvanceTarget::Normal).unwrap(), Advanced::Reached);
    assert!((solver.state()[0] - (-1f64).exp()).abs() < 1e-4);
}

/// sundials_a_panic_in_a_callback_arrives_whole_and_nothing_leaks
fn main() {
    // Nobody wants to read of these panics.
    std::panic::set_hook(Box::new(|info| {
        if !info.payload().is::<Payload>() {
            eprintln!("{info}");
        }
    }));
    let alive = Rc::new(());
    for after in [0, 1, 5, 20] {
        for place in [Where::Rhs, Where::Roots] {
            let fixed_point = Nonlinear::FixedPoint;
            explode(cvode(Grenade::new(place, after, &alive), Multistep::Adams, fixed_point));
            explode(cvode(
                Grenade::new(place, after, &alive),
                Multistep::Bdf,
                Nonlinear::Newton,
            ));
            let system = Grenade::new(place, after, &alive);
            explode(Solver::new(system, ErkTable::Verner8s56, 0.0, &[1.0], &tolerances()).unwrap());
            let system = Grenade::new(place, after, &alive);
            explode(Solver::new(system, SolverMethod::ESDIRK, 0.0, &[1.0], &tolerances()).unwrap());
        }
    }
    let of_newton = [
        (Where::Jacobian, 0),
        (Where::BandJacobian, 0),
        (Where::Enter, 0),
        (Where::Enter, 7),
        (Where::Leave, 0),
        (Where::Leave, 7),
    ];
    for (place, after) in of_newton {
        let system = Grenade::new(place, after, &alive);
        explode(cvode(system, Multistep::Bdf, Nonlinear::Newton));
        let system = Grenade::new(place, after, &alive);
        explode(Solver::new(system, SolverMethod::ESDIRK, 0.0, &[1.0], &tolerances()).unwrap());
    }

    // The dense output of degree 5 calls the right-hand side, too.
    let mut solver = Solver::new(
        Grenade::new(Where::Nowhere, 0, &alive),
        ErkTable::Verner8s56,
        0.0,
        &[1.0],
        &tolerances(),
    )
    .unwrap();
    solver.advance(1.0, AdvanceTarget::OneStep).unwrap();
    solver.system_mut().place = Where::Rhs;
    let time = solver.time() / 2.0;
    let outcome = catch_unwind(AssertUnwindSafe(|| solver.interpolate(time, 0, &mut [0.0])));
    assert!(outcome.expect_err("a panic").is::<Payload>());
    drop(solver);

    // A solver that could not be made, and one that is dropped by a panic.
    let wrong = Tolerances::uniform(1e-6, 1e-6, 2);
    assert!(
        Solver::new(
            Grenade::new(Where::Rhs, 0, &alive),
            ErkTable::Verner8s56,
            0.0,
            &[1.0],
            &wrong
        )
        .is_err()
    );
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        let mut solver = cvode(Grenade::new(Where::Rhs, 3, &alive), Multistep::Bdf, Nonlinear::Newton);
        solver.advance(1.0, AdvanceTarget::Normal)
    }));
    assert!(outcome.is_err());
    assert_eq!(Rc::strong_count(&alive), 1, "all systems are gone");
    let _ = std::panic::take_hook();
}
