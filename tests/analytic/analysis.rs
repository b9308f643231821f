//! Quantities computed from a run: bands, distributions, exponents, periods of forcing, growth.

mod bands {
    use stickslip::Run;
    use stickslip::analysis::bands::columns;
    use stickslip::case::{Case, CaseSource};
    use stickslip::record::MemoryRecorder;
    use stickslip::simulation::{Course, Following, OutputOptions};

    /// A sample is advanced to the next one, forwards and backwards, over 1/200 of the natural period, in slip, stick
    /// and separation. The result must be the run's own columns, to its tolerance.
    #[test]
    fn property_a_sample_moved_to_its_neighbour_is_the_neighbour() {
        let case = Case::read(&CaseSource::built_in("release").unwrap(), &[]).unwrap();
        let case = &case;
        let course = Course::new(&case.system, case.threshold, &case.solver);
        let output = OutputOptions {
            end_time: 0.9,
            interval: 1.2e-6,
            windows: Vec::new(),
            steps: false,
            follow: Following::default(),
        };
        let mut record = MemoryRecorder::default();
        Run::new(case).output(&output).record(&mut record).start().unwrap();
        let names: Vec<(String, String)> = columns(case).collect();
        let mut largest = vec![0.0_f64; names.len()];
        for row in 0..record.samples.len() {
            for (largest, x) in largest.iter_mut().zip(record.values(row)) {
                *largest = largest.max(x.abs());
            }
        }
        let mut modes = Vec::new();
        for next in 1..record.samples.len() {
            let (a, b) = (&record.samples[next - 1], &record.samples[next]);
            let between = record.events.iter().any(|e| (a.time..=b.time).contains(&e.time));
            if a.segment != b.segment || between {
                continue;
            }
            for (from, to) in [(next - 1, next), (next, next - 1)] {
                let row = &record.samples[from];
                let dt = record.samples[to].time - row.time;
                let change = course.change(row, record.further(from), dt);
                let values = record.values(from).into_iter().zip(record.values(to)).zip(change);
                for (k, ((before, after), change)) in values.enumerate() {
                    let error = (before + change - after).abs();
                    // 1e-10 for the run, and (2 pi/200)^5/120 = 3e-10 of an oscillation for the step; the oscillation
                    // is no larger than the column. Damping and friction have terms of that order too: together below
                    // 2e-8. The residual is rounding of energies.
                    let residual = names[k].0 == "energy_residual";
                    let scale = if residual { 1e-3 } else { largest[k] };
                    let (name, t) = (&names[k].0, row.time);
                    assert!(error <= 2e-8 * scale, "{name} at {t}: {error:e} of {scale:e}");
                }
            }
            if !modes.contains(&a.mode) {
                modes.push(a.mode);
            }
        }
        assert_eq!(modes.len(), 3, "{modes:?}");
    }
}

mod distribution {
    use stickslip::analysis::distribution::{Distribution, PERCENTILES};

    #[test]
    fn analytic_percentiles_of_a_ramp() {
        let ramp: Vec<f64> = (0..=100).rev().map(f64::from).chain([f64::NAN; 3]).collect();
        let found = Distribution::of(&ramp, false).unwrap();
        assert_eq!((found.count, found.without), (101, 3));
        for (own, percent) in found.percentiles.iter().zip(PERCENTILES) {
            assert!((own - percent).abs() < 1e-12, "{own}");
        }
        assert_eq!((found.least, found.largest, found.mean), (0.0, 100.0, 50.0));
        assert_eq!(found.bars.iter().map(|bar| bar.2).sum::<usize>(), 101);
        // A histogram takes this many bars.
        assert!((5..=41).contains(&found.bars.len()));
    }

    #[test]
    fn analytic_whole_numbers_stand_in_the_middle_of_their_bars() {
        let found = Distribution::of(&[3.0, 3.0, 4.0, 6.0], true).unwrap();
        assert_eq!(found.bars, [(2.5, 3.5, 2), (3.5, 4.5, 1), (4.5, 5.5, 0), (5.5, 6.5, 1)]);
        assert_eq!(Distribution::of(&[f64::NAN], false), None);
        assert_eq!(Distribution::of(&[7.0, 7.0], false).unwrap().bars, [(7.0, 7.0, 2)]);
    }
}

mod exponent {
    use stickslip::analysis::exponent::exponent;
    use stickslip::analysis::{Exponent, Neighbours};
    use stickslip::case::{Case, CaseSource, Origin};
    use stickslip::model::Mode;
    use stickslip::simulation::Section;

    /// The exponent of a mass on a belt that never reaches the belt's speed, forced by two harmonics without a common
    /// period. It is that of the linear oscillator x'' + c x' + x = 0.
    fn of_linear_oscillator(damping: f64) -> Exponent {
        let harmonic = |omega: f64| format!("{{ profile = \"sine\", amplitude = 0.1, angular_frequency = {omega:?} }}");
        let text = format!(
            "motion = \"translation\"\nrotor = {{ end = \"driven\", speed = 5.0 }}\ncontact = {{ normal_force = 1.0 }}\n\
             friction = {{ law = \"coulomb\", breakaway = 0.3, kinetic = 0.3 }}\noutput = {{ end_time = 2000.0 }}\n[stator]\n\
             inertia = 1.0\nstiffness = 1.0\ndamping = {damping:?}\nend = \"fixed\"\n\
             torque = {{ profile = \"sum\", signals = [{}, {}] }}\n",
            harmonic(0.5),
            harmonic(0.5f64.sqrt())
        );
        let origin = Origin::File("case.toml".into());
        let case = Case::read(&CaseSource { text, origin }, &[]).unwrap();
        let end = Section {
            time: 2000.0,
            mode: Mode::SlipForward,
            sense: 1,
            further: vec![0.3, 0.1, 0.1],
        };
        exponent(&case.system, case.threshold, &end, None).unwrap()
    }

    #[test]
    fn analytic_a_damped_oscillator_has_half_its_damping_as_exponent() {
        let found = of_linear_oscillator(0.1);
        assert!((found.value + 0.05).abs() < 1e-4, "{found:?}");
        assert!(found.uncertainty < 1e-3, "{found:?}");
        assert_eq!(found.neighbours(), Neighbours::Meet);
    }

    #[test]
    fn analytic_a_motion_on_a_torus_has_no_exponent() {
        let found = of_linear_oscillator(0.0);
        assert!(found.value.abs() < 1e-4, "{found:?}");
        assert_eq!(found.neighbours(), Neighbours::Stay);
    }
}

mod forcing {
    use std::f64::consts::TAU;
    use stickslip::analysis::forcing::{Harmonic, common_period};

    fn harmonic(angular_frequency: f64) -> Harmonic {
        Harmonic {
            angular_frequency,
            acts: (0.0, f64::INFINITY),
        }
    }

    #[test]
    fn analytic_the_common_period_holds_whole_turns_of_each() {
        let period = |frequencies: &[f64]| {
            let harmonics: Vec<Harmonic> = frequencies.iter().copied().map(harmonic).collect();
            common_period(&harmonics)
        };
        let is = |frequencies: &[f64], expected: f64| {
            let found = period(frequencies).unwrap();
            assert!((found - expected).abs() <= 1e-14 * expected, "{frequencies:?}: {found}");
        };
        is(&[1.709], TAU / 1.709);
        is(&[2.0, 3.0], TAU);
        is(&[0.7, 0.5], TAU / 0.1);
        is(&[0.3, 0.2, 0.7], TAU / 0.1);
        is(&[1.0, 1.0], TAU);
        is(&[0.1, 3.0], TAU / 0.1);
        // Frequencies in Hz.
        is(&[TAU * 440.0, TAU * 60.0], 0.05);
        assert_eq!(period(&[]), None);
        assert_eq!(period(&[1.0, 2.0f64.sqrt()]), None);
        assert_eq!(period(&[0.5, 0.5000002]), None);
        assert_eq!(period(&[1.0, 0.0]), None);
        assert_eq!(period(&[0.0]), None);
    }
}

mod growth {
    use stickslip::Run;
    use stickslip::analysis::stability::growth::Growth;
    use stickslip::case::{Case, CaseSource, Override};
    use stickslip::record::MemoryRecorder;

    /// A kick reverses the slip, which then loses its stability. Smooth sliding in that sense does not exist, and its
    /// path has no length; followed nevertheless, the path was NaN.
    #[test]
    fn regression_growth_where_a_kick_turns_the_slip() {
        let changes = [
            "axial.mass=5.540203543435869",
            "axial.stiffness=441101935.4355345",
            "axial.damping=49242.97470294818",
            "torsion.surface_inertia=0.7436364960809474",
            "torsion.rotor_inertia=81.78984040117506",
            "torsion.stiffness=986609.1472740709",
            "torsion.damping=69.54924980074699",
            "friction.breakaway=0.8181204716362555",
            "friction.low_speed=0.8181204716362555",
            "friction.high_speed=0.7296425720203465",
            "friction.decay=134.9667145864564",
            "initial.speed=90.82619909031959",
            "actuation={profile=\"ramp\",force=156.84880099552018,rise_time=12.059132431217796}",
            "perturbation=[{kind=\"kick\",time=19.904894134713516,relative_velocity=64.36110248123921},\
             {kind=\"kick\",time=17.188076480014825,relative_velocity=-114.30165801443698},\
             {kind=\"kick\",time=2.1635393315026006,relative_velocity=-5.333492895183853}]",
            "output.window=[]",
            "output.around=none",
            "output.interval=10",
            "output.end_time=21.81964290642463",
            "solver.method=series",
        ];
        let overrides = changes.map(|change| Override::parse(change).unwrap());
        let case = Case::read(&CaseSource::built_in("paper-si").unwrap(), &overrides).unwrap();
        let mut recorder = MemoryRecorder::default();
        Run::new(&case).record(&mut recorder).start().unwrap();
        let trains = case.system.clone();
        let growth = Growth::of_run(&trains, &recorder.events, case.output.end_time);
        let growth = growth.expect("stability is lost");
        assert_eq!((growth.exponent, growth.smooth_end), (0.0, growth.instability));
    }
}

mod growth_rate {
    use stickslip::case::{Case, CaseSource, Override};
    use stickslip::friction::Law;
    use stickslip::model::Parameters;
    use stickslip::model::equations::SystemEquations;
    use stickslip::model::stability::fast_growth_rate;

    /// Largest real part of the roots of J s^2 + c s + k = 0.
    fn of_swing(inertia: f64, damping: f64, stiffness: f64) -> f64 {
        let apart = damping * damping - 4.0 * inertia * stiffness;
        (apart.max(0.0).sqrt() - damping) / (2.0 * inertia)
    }

    /// The eigenvalues of the matrix against the closed form of two equal disks on shafts whose far ends are held, with
    /// J/I below 1e-9: the surfaces swing against each other with the damping c_t + 2 r F_n mu', and together with c_t.
    /// Over the plane of the critical curve and all speeds at which friction reduces the margin. Both have a rounding of
    /// 1e-14 omega_n; near a double root its square root.
    #[test]
    fn analytic_the_growth_rate_is_that_of_two_swings() {
        let source = CaseSource::built_in("paper").unwrap();
        let mut growing = 0;
        for decay in [0.1, 1.0, 5.0, 40.0, 200.0, 600.0] {
            for damping in [0.0, 2.0, 20.0, 300.0, 3000.0] {
                let set = |key: &str, value: f64| Override::parse(&format!("{key}={value}")).unwrap();
                let changes = [
                    set("friction.decay", decay),
                    set("torsion.damping", damping),
                    set("torsion.rotor_inertia", 1e8),
                ];
                let case = Case::read(&source, &changes).unwrap();
                let system = SystemEquations::new(&case.system);
                let torsion = Parameters::of(&case.system).unwrap().torsion;
                let (inertia, stiffness) = (torsion.surface_inertia, torsion.stiffness);
                for step in 0..60 {
                    let x = 0.1 * f64::from(step) / decay;
                    let kappa = system.radius * 2225.0 * system.law.coefficient_and_slope(x).1;
                    let swing = |damping: f64| of_swing(inertia, damping, stiffness);
                    let expected = swing(damping + 2.0 * kappa).max(swing(damping));
                    let found = fast_growth_rate(&system, kappa);
                    growing += u32::from(found > 0.0);
                    let scale = (stiffness / inertia)
                        .sqrt()
                        .max((damping + 2.0 * kappa).abs() / inertia);
                    let error = (found - expected).abs();
                    assert!(error < 1e-7 * scale, "{decay} {damping} {x}: {found} {expected}");
                }
            }
        }
        assert!(growing > 500, "{growing}");
    }
}
