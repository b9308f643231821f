//! Against the output that the SUNDIALS distribution publishes for its examples, version 7.1.1.

use nalgebra::DMatrixViewMut;
use stickslip::sundials::{
    AdvanceTarget, Advanced, CvodeOptions, Direction, ErkTable, Multistep, Nonlinear, OdeSystem, Solver, Tolerances,
};

/// `examples/cvode/serial/cvRoberts_dns.c`: three species, the classic stiff problem of Robertson.
struct Roberts;

impl OdeSystem for Roberts {
    fn dimension(&self) -> usize {
        3
    }

    fn rhs(&mut self, _t: f64, y: &[f64], ydot: &mut [f64]) {
        let [y1, y2, y3] = [y[0], y[1], y[2]];
        ydot[0] = -0.04 * y1 + 1.0e4 * y2 * y3;
        ydot[2] = 3.0e7 * y2 * y2;
        ydot[1] = -ydot[0] - ydot[2];
    }

    fn has_jacobian(&self) -> bool {
        true
    }

    fn jacobian(&mut self, _t: f64, y: &[f64], _ydot: &[f64], mut j: DMatrixViewMut<'_, f64>) {
        let [y2, y3] = [y[1], y[2]];
        j[(0, 0)] = -0.04;
        j[(0, 1)] = 1.0e4 * y3;
        j[(0, 2)] = 1.0e4 * y2;
        j[(1, 0)] = 0.04;
        j[(1, 1)] = -1.0e4 * y3 - 6.0e7 * y2;
        j[(1, 2)] = -1.0e4 * y2;
        j[(2, 1)] = 6.0e7 * y2;
    }

    fn roots(&mut self, _t: f64, y: &[f64], g: &mut [f64]) {
        g[0] = y[0] - 0.0001;
        g[1] = y[2] - 0.01;
    }
}

/// As C's `%.*e` prints it.
fn e(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$e}");
    let (mantissa, exponent) = text.split_once('e').expect("an exponent");
    let exponent: i32 = exponent.parse().expect("a number");
    format!(
        "{mantissa}e{}{:02}",
        if exponent < 0 { '-' } else { '+' },
        exponent.abs()
    )
}

/// The digits that `cvRoberts_dns.out` prints are those of the same floating point operations in the same order,
/// so that all of them are asked for, and the statistics exactly.
#[test]
fn published_roberts_by_bdf_with_jacobian_and_roots() {
    const PUBLISHED: &str = "\
At t = 2.6391e-01      y =  9.899653e-01    3.470564e-05    1.000000e-02
    rootsfound[] =   0   1
At t = 4.0000e-01      y =  9.851641e-01    3.386242e-05    1.480205e-02
At t = 4.0000e+00      y =  9.055097e-01    2.240338e-05    9.446793e-02
At t = 4.0000e+01      y =  7.158017e-01    9.185037e-06    2.841892e-01
At t = 4.0000e+02      y =  4.505360e-01    3.223271e-06    5.494608e-01
At t = 4.0000e+03      y =  1.832299e-01    8.944378e-07    8.167692e-01
At t = 4.0000e+04      y =  3.898902e-02    1.622006e-07    9.610108e-01
At t = 4.0000e+05      y =  4.936383e-03    1.984224e-08    9.950636e-01
At t = 4.0000e+06      y =  5.168093e-04    2.068293e-09    9.994832e-01
At t = 2.0790e+07      y =  1.000000e-04    4.000397e-10    9.999000e-01
    rootsfound[] =  -1   0
At t = 4.0000e+07      y =  5.202440e-05    2.081083e-10    9.999480e-01
At t = 4.0000e+08      y =  5.201061e-06    2.080435e-11    9.999948e-01
At t = 4.0000e+09      y =  5.258603e-07    2.103442e-12    9.999995e-01
At t = 4.0000e+10      y =  6.934511e-08    2.773804e-13    9.999999e-01
";
    let tolerances = Tolerances {
        relative: 1e-4,
        absolute: vec![1e-8, 1e-14, 1e-6],
    };
    let mut solver = Solver::new(Roberts, CvodeOptions::BDF, 0.0, &[1.0, 0.0, 0.0], &tolerances).unwrap();
    solver.set_crossings(&[Direction::Either, Direction::Either]).unwrap();

    let mut printed = String::new();
    let mut t_out = 0.4;
    let mut outputs = 0;
    while outputs < 12 {
        let outcome = solver.advance(t_out, AdvanceTarget::Normal).unwrap();
        let y = solver.state();
        let [y1, y2, y3] = [e(y[0], 6), e(y[1], 6), e(y[2], 6)];
        printed += &format!("At t = {}      y ={y1:>14}  {y2:>14}  {y3:>14}\n", e(solver.time(), 4));
        match outcome {
            Advanced::Reached => {
                outputs += 1;
                t_out *= 10.0;
            }
            Advanced::Roots => {
                let found = solver.crossings_found().iter().map(|found| match found {
                    None => 0,
                    Some(Direction::Rising) => 1,
                    Some(_) => -1,
                });
                let found: Vec<i32> = found.collect();
                printed += &format!("    rootsfound[] = {:3} {:3}\n", found[0], found[1]);
            }
            other => panic!("unexpected {other:?}"),
        }
    }
    assert_eq!(printed, PUBLISHED);

    let counters = solver.counters().unwrap();
    assert_eq!(counters.steps, 542);
    assert_eq!(counters.error_test_failures, 22);
    assert_eq!(counters.rhs_evaluations, 754);
    assert_eq!(counters.nonlinear_iterations, 751);
    assert_eq!(counters.nonlinear_convergence_failures, 3);
    assert_eq!(counters.linear_solver_setups, 107);
    assert_eq!(counters.jacobian_evaluations, 11);
    assert_eq!(counters.root_evaluations, 570);
    assert_eq!(counters.last_order, 4);
}

/// `examples/arkode/C_serial/ark_analytic_nonlin.c`: u' = (t + 1) exp(-u), u = ln(t^2/2 + t + 1).
struct AnalyticNonlinear;

impl OdeSystem for AnalyticNonlinear {
    fn dimension(&self) -> usize {
        1
    }

    fn rhs(&mut self, t: f64, y: &[f64], ydot: &mut [f64]) {
        ydot[0] = (t + 1.0) * (-y[0]).exp();
    }
}

/// ERKStep's default of order 4 is the table of Zonneveld. All printed digits, and the statistics.
#[test]
fn published_analytic_nonlinear_by_explicit_runge_kutta() {
    const PUBLISHED: [&str; 10] = [
        "0.916291", "1.609437", "2.140066", "2.564949", "2.917770", "3.218876", "3.481240", "3.713572", "3.921973",
        "4.110874",
    ];
    let tolerances = Tolerances::uniform(1e-6, 1e-10, 1);
    let mut solver = Solver::new(AnalyticNonlinear, ErkTable::Zonneveld5s34, 0.0, &[0.0], &tolerances).unwrap();
    for (t, published) in (1..=10).zip(PUBLISHED) {
        let found = solver.advance(f64::from(t), AdvanceTarget::Normal).unwrap();
        assert_eq!(found, Advanced::Reached);
        assert_eq!(format!("{:.6}", solver.state()[0]), published);
    }
    let counters = solver.counters().unwrap();
    assert_eq!(counters.steps, 82);
    assert_eq!(counters.error_test_failures, 1);
    assert_eq!(counters.rhs_evaluations, 417);
    assert!((counters.last_step - 0.4463519264234082).abs() < 1e-12);
    assert!((solver.mesh_time().unwrap() - 10.12157090914652).abs() < 1e-11);
}

/// Problem 1 of `examples/cvode/serial/cvDirectDemo_ls.c`: van der Pol's oscillator.
struct VanDerPol {
    jacobian: bool,
}

impl OdeSystem for VanDerPol {
    fn dimension(&self) -> usize {
        2
    }

    fn rhs(&mut self, _t: f64, y: &[f64], ydot: &mut [f64]) {
        let [x, v] = [y[0], y[1]];
        ydot[0] = v;
        ydot[1] = (1.0 - x * x) * 3.0 * v - x;
    }

    fn has_jacobian(&self) -> bool {
        self.jacobian
    }

    fn jacobian(&mut self, _t: f64, y: &[f64], _ydot: &[f64], mut j: DMatrixViewMut<'_, f64>) {
        let [x, v] = [y[0], y[1]];
        j[(0, 1)] = 1.0;
        j[(1, 0)] = -2.0 * 3.0 * x * v - 1.0;
        j[(1, 1)] = 3.0 * (1.0 - x * x);
    }
}

/// Steps, right-hand sides, iterations and refused steps of each run that `cvDirectDemo_ls.out` tells of, and its
/// printed digits at the first two outputs. At the second x passes zero, so that what is printed is error: the same
/// error takes the same arithmetic.
#[test]
fn published_van_der_pol_by_adams_and_bdf() {
    let newton = Nonlinear::Newton;
    let fixed_point = Nonlinear::FixedPoint;
    for (method, nonlinear, jacobian, [steps, rhs, iterations, failures], x) in [
        (Multistep::Adams, fixed_point, false, [196, 390, 387, 15], -2.12391e-05),
        (Multistep::Adams, newton, true, [266, 365, 362, 23], 2.42943e-06),
        (Multistep::Adams, newton, false, [195, 267 + 8, 264, 15], -2.28046e-05),
        (Multistep::Bdf, fixed_point, false, [262, 497, 494, 22], -1.35636e-04),
    ] {
        let options = CvodeOptions {
            method,
            nonlinear,
            ..CvodeOptions::ADAMS
        };
        let tolerances = Tolerances::uniform(0.0, 1e-6, 2);
        let mut solver = Solver::new(VanDerPol { jacobian }, options, 0.0, &[2.0, 0.0], &tolerances).unwrap();
        let mut outputs = Vec::new();
        for output in 0..4 {
            let t_out = 1.39283880203 + f64::from(output) * 2.214773875;
            assert_eq!(solver.advance(t_out, AdvanceTarget::Normal).unwrap(), Advanced::Reached);
            outputs.push(solver.state().to_vec());
        }
        let run = format!("{method:?}, {nonlinear:?}");
        assert_eq!(format!("{:.5}", outputs[0][0]), "1.68010", "{run}");
        assert_eq!(e(outputs[1][0], 5), e(x, 5), "{run}");
        let counters = solver.counters().unwrap();
        assert_eq!(counters.steps, steps, "{run}");
        assert_eq!(counters.rhs_evaluations, rhs, "{run}");
        assert_eq!(counters.nonlinear_iterations, iterations, "{run}");
        assert_eq!(counters.error_test_failures, failures, "{run}");
    }
}
