//! The parts of a run: forces, steps, times of samples, derivatives by the parameters of a case.

mod excitation {
    use crate::common::systems::{self, AXIAL, pair, ramp, train};
    use stickslip::friction::Coulomb;
    use stickslip::model::system::{End, Pressing};
    use stickslip::signal::{Drive, Frequency, HarmonicShape, Wave};
    use stickslip::simulation::Excitation;

    fn pressed(pressing: Pressing) -> Excitation {
        let free = train(&[1.0], &[], &[], End::Free);
        let ground = train(&[], &[], &[], End::Fixed);
        let mut system = pair(free, ground, pressing, Coulomb { kinetic: 0.3 });
        system.initial.rotor_speed = vec![1.0];
        Excitation::new(&system)
    }

    fn wave(amplitude: f64, from: Option<f64>, to: Option<f64>) -> Drive {
        Drive::Wave(Wave {
            mean: 10.0,
            from,
            to,
            ..systems::wave(HarmonicShape::Sine, amplitude, Frequency::Angular(20.0), 0.3)
        })
    }

    /// A force, and whether it is a straight line at 0.7 s and at 2.5 s.
    fn forces() -> Vec<(Pressing, [bool; 2])> {
        let (axial, actuation) = (AXIAL, ramp(2000.0, 1.0));
        let linear = Drive::Linear(ramp(100.0, 1.0));
        let waving = Drive::Sum(vec![linear.clone(), wave(-30.0, Some(0.5), Some(2.0))]);
        vec![
            (Pressing::Force(Drive::Value(5.0)), [true, true]),
            (Pressing::Force(linear), [true, true]),
            (Pressing::Force(waving), [false, true]),
            (Pressing::Force(wave(30.0, None, None)), [false, false]),
            (Pressing::Axial { axial, actuation }, [false, true]),
        ]
    }

    /// Bounds against samples. They are wider only by the harmonic on a line, or by the ringing of 2 N that follows a
    /// corner.
    #[test]
    fn property_the_force_keeps_its_bounds() {
        for (pressing, silent) in forces() {
            let excitation = pressed(pressing);
            let force = |t: f64| excitation.normal_force(excitation.stretch(t), t);
            for from in [0.0, 0.3, 0.7, 1.5, 2.5] {
                let samples = (0..4000).map(|k| from + 1e-3 * f64::from(k));
                let least = samples.clone().map(force).fold(f64::INFINITY, f64::min);
                let most = samples.map(force).fold(f64::NEG_INFINITY, f64::max);
                let low = excitation.lowest_pressing_force_after(from);
                let high = excitation.highest_pressing_force_after(from);
                let (rounding, wide) = (1e-12 * most, 65.0);
                let said = format!("{from}: {least} to {most} in {low} to {high}");
                assert!(low <= least + rounding && most <= high + rounding, "{said}");
                assert!(least - low <= wide && high - most <= wide, "{said}");
                let next = excitation.corners().iter().copied().find(|corner| *corner > from);
                assert_eq!(excitation.next_corner(from), next);
                let smooth = excitation.smooth_force(from);
                if excitation.axial().is_none() {
                    assert!((smooth.value - force(from)).abs() <= smooth.swing + rounding, "{from}");
                }
                if excitation.is_silent(from) {
                    assert!((smooth.value - force(from)).abs() <= rounding, "{from}");
                    assert!(smooth.swing == 0.0, "{from}");
                    assert!(excitation.silent_from(from) <= from);
                }
            }
            assert_eq!([0.7, 2.5].map(|t| excitation.is_silent(t)), silent);
        }
    }

    /// The bound of the curvature against differences, whose own error is that of the fourth derivative.
    #[test]
    fn property_the_force_bends_no_more_than_is_said() {
        let h = 1e-4;
        for (number, (pressing, _)) in forces().into_iter().enumerate() {
            let excitation = pressed(pressing);
            let force = |t: f64| excitation.normal_force(excitation.stretch(t), t);
            let mut sharpest: f64 = 0.0;
            for from in [0.0, 0.6, 1.2, 2.5] {
                let end = excitation.next_corner(from).unwrap_or(from + 1.0);
                let curvature = excitation.curvature_bound(from);
                let times = (1..400).map(|k| from + (end - from) * f64::from(k) / 400.0);
                for t in times.filter(|t| t + h < end && t - h > from) {
                    let bend = ((force(t + h) - 2.0 * force(t) + force(t - h)) / (h * h)).abs();
                    // Rounding of a force up to 2000 N, over h^2.
                    let rounding = 8.0 * f64::EPSILON * force(t).abs() / (h * h);
                    assert!(bend <= curvature + rounding, "{t}: {bend} and {curvature}");
                    sharpest = sharpest.max(bend / curvature);
                }
            }
            // A harmonic alone attains the bound.
            assert!(number != 3 || sharpest > 0.99, "{sharpest}");
        }
    }
}

mod fixed_step {
    use stickslip::model::Torsion;
    use stickslip::simulation::stepping::longest_stable_step;
    use stickslip::sundials::ErkTable;

    /// A mode with so much damping that both roots are real. The published stability intervals are 2 for the methods
    /// of order 2 with two stages, 2.51 for order 3 with three, and 3.31 for Dormand-Prince (Hairer, Norsett, Wanner:
    /// Solving Ordinary Differential Equations II, IV.2).
    #[test]
    fn published_stability_on_the_real_axis() {
        let torsion = Torsion {
            rotor_inertia: 1e9,
            surface_inertia: 1.0,
            stiffness: 1e-3,
            damping: 1.0,
        };
        for (table, length) in [
            (ErkTable::HeunEuler2s12, 2.0),
            (ErkTable::ShuOsher3s23, 2.513),
            (ErkTable::BogackiShampine4s23, 2.513),
            (ErkTable::DormandPrince7s45, 3.307),
        ] {
            let step = longest_stable_step(&table.coefficients(), &torsion);
            // The root is -0.999, and the published digits are four.
            assert!((step * 0.999 - length).abs() < 2e-3, "{table}: {step}");
        }
    }
}

mod stepping {
    use stickslip::simulation::stepping::{ExplicitStep, classical};
    use stickslip::sundials::ErkTable;

    /// y' = (y_2, -y_1): halving the step divides the error over a fixed span by 2^order.
    #[test]
    fn analytic_order_of_every_explicit_method() {
        let pairs = ErkTable::ALL
            .iter()
            .map(|table| (table.name(), table.coefficients(), table.order()));
        for (name, coefficients, order) in pairs.chain([("rk4", classical(), 4)]) {
            let mut method = ExplicitStep::new(coefficients, [0.0; 2]);
            let mut error = |steps: usize| {
                let step = 1.0 / steps as f64;
                let mut y = [1.0, 0.0];
                for k in 0..steps {
                    method.take(k as f64 * step, &y, step, |_, y, dydt| *dydt = [y[1], -y[0]]);
                    y = method.solution;
                }
                (y[0] - 1f64.cos()).hypot(y[1] + 1f64.sin())
            };
            // Few steps, so that order 9 stays above rounding.
            let (coarse, fine) = (error(2), error(4));
            let (found, expected) = ((coarse / fine).log2(), f64::from(order));
            // Some have an error constant that vanishes on linear problems.
            assert!(found > expected - 0.5, "{name}: {found}");
        }
    }
}

mod sampling {
    use stickslip::simulation::OutputOptions;
    use stickslip::simulation::sampling::SampleTimes;
    use stickslip::simulation::{Following, OutputWindow};

    fn all(output: &OutputOptions) -> Vec<f64> {
        let mut times = SampleTimes::new(output);
        let mut list = Vec::new();
        while times.next.is_finite() {
            list.push(times.next);
            times.advance();
        }
        list
    }

    #[test]
    fn analytic_windows_are_denser_and_nothing_is_doubled() {
        let windows = vec![OutputWindow {
            from: 0.25,
            to: 0.5,
            interval: 0.125,
        }];
        let list = all(&OutputOptions {
            end_time: 1.0,
            interval: 0.25,
            windows,
            steps: false,
            follow: Following::default(),
        });
        assert_eq!(list, [0.0, 0.25, 0.375, 0.5, 0.75, 1.0]);
    }

    #[test]
    fn analytic_times_increase_strictly_and_end_at_the_end() {
        let windows = vec![
            OutputWindow {
                from: 0.31,
                to: 0.62,
                interval: 0.01,
            },
            OutputWindow {
                from: 0.5,
                to: 0.9,
                interval: 0.003,
            },
        ];
        let list = all(&OutputOptions {
            end_time: 1.05,
            interval: 0.1,
            windows,
            steps: false,
            follow: Following::default(),
        });
        assert!(list.windows(2).all(|p| p[0] < p[1]));
        assert_eq!(list.first(), Some(&0.0));
        assert_eq!(list.last(), Some(&1.05));
    }
}

mod variation {
    use stickslip::Run;
    use stickslip::case::{Case, CaseSource, Override, WrittenCase};
    use stickslip::record::MemoryRecorder;
    use stickslip::simulation::{Method, OutputOptions, SolverOptions};
    use stickslip::simulation::{MovedCases, MovedSystem, variation};

    /// Against differences of runs with the parameter moved, extrapolated from two widths.
    #[test]
    fn analytic_slopes_are_those_of_moved_runs() {
        for (name, end, least) in [
            ("drill-string", 30.0, 40),
            ("clutch", 2.0, 4),
            ("block", 3.0, 2),
            ("hairer", 20.0, 100),
            ("den-hartog", 20.0, 4),
        ] {
            let source = CaseSource::built_in(name).unwrap();
            let end = Override::number("output.end_time", end);
            let moved = |path: &str, value: f64| {
                let changes = [end.clone(), Override::number(path, value)];
                Case::read(&source, &changes)
            };
            let case = Case::read(&source, std::slice::from_ref(&end)).unwrap();
            let numbers = WrittenCase::read(&source, std::slice::from_ref(&end)).unwrap();
            let numbers = numbers.numbers();
            let mut columns = Vec::new();
            for number in numbers {
                let h = number.value.abs() / f64::from(1 << 16);
                let copies = [h, -h].map(|h| moved(&number.path, number.value + h).map(|case| (case, 0.5 / h)));
                let copies = copies.into_iter().flatten().map(|(case, weight)| MovedSystem {
                    threshold: case.threshold,
                    system: case.system,
                    weight,
                    bend: 1.0,
                });
                columns.push(MovedCases {
                    copies: copies.collect(),
                    rounded: None,
                });
            }
            let output = OutputOptions::at_the_ends(case.output.end_time);
            let found = variation((&case.system, case.threshold), &columns, &case.solver, &output, &()).unwrap();
            let times = |path: &str, value: f64| -> Vec<f64> {
                let case = moved(path, value).unwrap();
                let solver = SolverOptions {
                    method: Method::Series,
                    ..case.solver.clone()
                };
                let mut kept = MemoryRecorder::default();
                let run = Run::new(&case).solver(&solver).output(&output).record(&mut kept);
                run.start().unwrap();
                kept.events.iter().map(|event| event.time).collect()
            };
            let mut compared = 0;
            for (column, number) in numbers.iter().enumerate() {
                let size = number.value.abs();
                if columns[column].copies.len() < 2 || !found.alike[column] {
                    continue;
                }
                let difference = |width: f64| -> Vec<f64> {
                    let [forth, back] = [width, -width].map(|width| times(&number.path, number.value + width * size));
                    let pairs = forth.iter().zip(&back);
                    pairs.map(|(a, b)| (a - b) / (2.0 * width * size)).collect()
                };
                let (wide, narrow) = (difference(1e-5), difference(1e-6));
                assert_eq!(found.events.len(), narrow.len(), "{name} {}", number.path);
                for (event, row) in found.passages.iter().map(|event| &event.times).enumerate() {
                    let best = narrow[event] + (narrow[event] - wide[event]) / 99.0;
                    // Rounding of the times in the narrow difference.
                    let noise = 1e-8 * case.output.end_time / size;
                    let error = (row[column] - best).abs();
                    assert!(
                        error < 1e-6 * best.abs() + noise,
                        "{name} {} event {event}: {:e} and {best:e}",
                        number.path,
                        row[column]
                    );
                    compared += 1;
                }
            }
            assert!(compared >= least, "{name}: {compared}");
        }
    }
}
