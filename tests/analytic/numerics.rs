//! Taylor series, roots of polynomials, Radau IIA, Chebyshev series, eigenvalues.

mod polynomial_roots {
    use proptest::prelude::*;
    use std::ops::ControlFlow;
    use stickslip::numerics::polynomial_roots::{first_falling, isolate, refine};
    use stickslip::numerics::taylor;

    /// Coefficients of scale times the product of (x - root), in a polynomial with room for more terms.
    fn with_roots<const N: usize>(roots: &[f64], scale: f64) -> [f64; N] {
        let mut c = [0.0; N];
        c[0] = scale;
        for (k, root) in roots.iter().enumerate() {
            for j in (0..=k).rev() {
                c[j + 1] += c[j];
                c[j] *= -root;
            }
        }
        c
    }

    fn all<const N: usize>(c: &[f64; N]) -> Vec<(f64, bool)> {
        let mut found = Vec::new();
        isolate(c, &mut |bracket| {
            let falling = bracket.falling;
            found.push((refine(c, bracket), falling));
            ControlFlow::Continue(())
        });
        found
    }

    proptest! {
        /// Every root in (0, 1) and no other, in order, with its direction, whatever lies outside.
        #[test]
        fn property_every_root_is_found_in_order(
            gaps in proptest::collection::vec(0.02..0.3f64, 1..7),
            outside in proptest::collection::vec(prop_oneof![-3.0..-0.05f64, 1.05..3.0f64], 0..4),
            scale in prop_oneof![Just(1.0), Just(-1e-9)],
        ) {
            let roots: Vec<f64> =
                gaps.iter().scan(0.0, |x, gap| { *x += gap; Some(*x) }).filter(|x| *x < 0.98).collect();
            let product: Vec<f64> = roots.iter().chain(&outside).copied().collect();
            let c: [f64; 16] = with_roots(&product, scale);
            let found = all(&c);
            prop_assert_eq!(found.len(), roots.len());
            let size: f64 = c.iter().map(|c| c.abs()).sum();
            let mut falling = c[0] > 0.0;
            for (&(x, down), &root) in found.iter().zip(&roots) {
                // As close as the rounding of the coefficients allows.
                let (_, rate) = taylor::value_and_rate(&c, root);
                prop_assert!((x - root).abs() < 1e-14 * size / rate.abs(), "{} {}", x, root);
                prop_assert_eq!(down, falling);
                falling = !falling;
            }
            let first = first_falling(&c);
            let expected = found.iter().find(|r| r.1).map(|r| r.0);
            prop_assert_eq!(first, expected);
        }
    }

    #[test]
    fn analytic_a_root_where_an_interval_is_halved_is_found_once() {
        let c: [f64; 8] = with_roots(&[0.25, 0.5, 0.75], 1.0);
        let found: Vec<f64> = all(&c).iter().map(|r| r.0).collect();
        assert_eq!(found.len(), 3);
        for (x, root) in found.iter().zip([0.25, 0.5, 0.75]) {
            assert!((x - root).abs() < 1e-15);
        }
        assert_eq!(first_falling(&c), Some(found[1]));
    }

    #[test]
    fn analytic_a_touch_from_above_is_no_crossing() {
        let touching: [f64; 4] = with_roots(&[0.5, 0.5], 1.0);
        assert_eq!(first_falling(&touching), None);
        let raised: [f64; 4] = std::array::from_fn(|k| touching[k] + if k == 0 { 1e-12 } else { 0.0 });
        assert!(all(&raised).is_empty());
        // Two roots 2e-6 apart are found as two.
        let lowered: [f64; 4] = std::array::from_fn(|k| touching[k] - if k == 0 { 1e-12 } else { 0.0 });
        let found = all(&lowered);
        assert_eq!(found.len(), 2);
        assert!((found[0].0 - (0.5 - 1e-6)).abs() < 1e-10 && (found[1].0 - (0.5 + 1e-6)).abs() < 1e-10);
    }

    #[test]
    fn analytic_the_ends_belong_to_the_interval_on_the_right_only() {
        let at_start: [f64; 2] = [0.0, -1.0];
        assert!(all(&at_start).len() == 1, "zero counts as positive");
        let at_end: [f64; 2] = [1.0, -1.0];
        assert!(all(&at_end).is_empty(), "it has not gone below zero yet");
    }
}

mod radau {
    use nalgebra::{Complex, DMatrix};
    use stickslip::numerics::radau::invert;

    /// Matrices with the sizes of a contact's systems, with a zero first on the diagonal: the product with the inverse
    /// is the identity to rounding.
    #[test]
    fn analytic_an_inverse_is_one() {
        for n in [1, 2, 5, 9] {
            let entry = |i: usize, j: usize| {
                let angle = (3 * i + 7 * j + 1) as f64;
                let diagonal = if i == j && i > 0 { 4.0 } else { 0.0 };
                let real = if (n, i, j) == (n.max(2), 0, 0) {
                    0.0
                } else {
                    angle.sin()
                };
                Complex::new(diagonal + real, 0.3 * angle.cos())
            };
            let matrix = DMatrix::from_fn(n, n, entry);
            let mut inverse = matrix.clone();
            assert!(invert(&mut inverse, &mut vec![0; n]));
            let error = (&matrix * inverse - DMatrix::identity(n, n)).map(|x: Complex<f64>| x.norm());
            assert!(error.max() < 1e-13, "{n}: {error}");
        }
        assert!(!invert(&mut DMatrix::from_element(3, 3, 1.0), &mut [0; 3]));
    }
}

mod radau_tableau {
    use nalgebra::Complex;
    use stickslip::numerics::radau::{RadauTableau, legendre, legendre_integrals};

    const S: usize = 7;

    /// B(2S - 1), C(S) and D(S - 1) of Butcher: together they give order 2S - 1.
    #[test]
    fn analytic_order_conditions() {
        let t = RadauTableau::<S>::new();
        for k in 1..=2 * S - 1 {
            let sum: f64 = (0..S).map(|i| t.b[i] * t.c[i].powi(k as i32 - 1)).sum();
            assert!((sum - 1.0 / k as f64).abs() < 4e-16, "B({k}): {sum}");
        }
        for k in 1..=S {
            for i in 0..S {
                let sum: f64 = (0..S).map(|j| t.a[(i, j)] * t.c[j].powi(k as i32 - 1)).sum();
                let exact = t.c[i].powi(k as i32) / k as f64;
                assert!((sum - exact).abs() < 1e-15, "C({k}): {sum} {exact}");
            }
        }
        for k in 1..S {
            for j in 0..S {
                let sum: f64 = (0..S).map(|i| t.b[i] * t.c[i].powi(k as i32 - 1) * t.a[(i, j)]).sum();
                let exact = t.b[j] * (1.0 - t.c[j].powi(k as i32)) / k as f64;
                assert!((sum - exact).abs() < 1e-15, "D({k}): {sum} {exact}");
            }
        }
    }

    #[test]
    fn analytic_the_last_stage_is_the_result() {
        let t = RadauTableau::<S>::new();
        assert_eq!(t.c[S - 1], 1.0);
        for j in 0..S {
            assert!((t.a[(S - 1, j)] - t.b[j]).abs() < 4e-16);
        }
    }

    /// |R| <= 1 on the imaginary axis, R = 0 at infinity, and no pole to the left (the eigenvalues of A lie to the
    /// right), so that |R| <= 1 there by the maximum principle. Near 0, R is the exponential to order 2S - 1.
    #[test]
    fn analytic_l_stability() {
        let t = RadauTableau::<S>::new();
        assert!(t.real.inverse > 0.0 && t.complex.len() == (S - 1) / 2);
        assert!(t.complex.iter().all(|l| l.inverse.re > 0.0 && l.inverse.im != 0.0));
        for k in -40..=60 {
            let y = 10f64.powf(f64::from(k) / 10.0);
            // For large z, R is evaluated with a rounding of some 1e-13.
            assert!(t.stability(Complex::new(0.0, y)).norm() <= 1.0 + 1e-12, "at {y} i");
        }
        assert!(t.stability(Complex::new(-1e9, 0.0)).norm() < 1e-7);
        assert!(t.stability(Complex::new(0.0, 1e9)).norm() < 1e-7);
        for z in [Complex::new(-0.5, 0.3), Complex::new(0.2, 0.9)] {
            // |z|^14 / 14! times a constant below 1e-3
            assert!((t.stability(z) - z.exp()).norm() < 1e-14);
        }
    }

    #[test]
    fn analytic_the_transformation_is_a() {
        let t = RadauTableau::<S>::new();
        for i in 0..S {
            for j in 0..S {
                let complex = t.complex.iter();
                let pairs: f64 = complex.map(|l| 2.0 * (l.right[i] * l.left[j] / l.inverse).re).sum();
                let sum = t.real.right[i] * t.real.left[j] / t.real.inverse + pairs;
                // The eigenvectors' condition number is some 1e3.
                assert!((sum - t.a[(i, j)]).abs() < 1e-12, "{sum} {}", t.a[(i, j)]);
            }
        }
    }

    /// RADAU5's coefficients are known in closed form (Hairer and Wanner II, table IV.5.6).
    #[test]
    fn published_three_stages() {
        let t = RadauTableau::<3>::new();
        let six = 6f64.sqrt();
        assert!((t.c[0] - (4.0 - six) / 10.0).abs() < 1e-16 * 4.0);
        assert!((t.c[1] - (4.0 + six) / 10.0).abs() < 1e-16 * 4.0);
        assert!((t.a[(0, 0)] - (88.0 - 7.0 * six) / 360.0).abs() < 1e-15);
        assert!((t.a[(0, 2)] - (-2.0 + 3.0 * six) / 225.0).abs() < 1e-15);
        assert!((t.b[1] - (16.0 + six) / 36.0).abs() < 1e-15);
    }

    /// Integrals of the basis: from their own coefficients, and by the method's quadrature.
    #[test]
    fn analytic_integrals_of_the_basis() {
        let t = RadauTableau::<S>::new();
        for x in [0.0, 0.3, 1.0, 1.7] {
            let integrals = legendre_integrals::<S>(x);
            for k in 0..S {
                let by_quadrature: f64 = (0..S).map(|i| x * t.b[i] * legendre::<S>(x * t.c[i])[k]).sum();
                assert!((integrals[k] - by_quadrature).abs() < 1e-14 * 1.7f64.powi(8) * 100.0);
            }
        }
        // The interpolant through the stages ends at the last stage: rows of the integrals invert `to_legendre`.
        for i in 0..S {
            let row = legendre_integrals::<S>(t.c[i]).transpose() * t.to_legendre;
            for j in 0..S {
                assert!((row[j] - f64::from(u8::from(i == j))).abs() < 1e-12);
            }
        }
    }
}

mod taylor {
    use proptest::prelude::*;
    use stickslip::numerics::taylor::{
        Unfolding, add_product, add_square, damped_oscillation, product, step, value, value_and_rate,
    };

    const N: usize = 24;

    proptest! {
        /// exp(a) exp(-a) = 1, coefficient by coefficient, to the rounding of sums of N terms of the size of
        /// exp(|a|)^2.
        #[test]
        fn property_an_exponential_times_its_inverse_is_one(a in proptest::array::uniform24(-0.5..0.5f64)) {
            let exp = |sign: f64| {
                let mut rate = [0.0; N];
                let mut e = Unfolding::<f64, N>::new();
                e.set(0, (sign * a[0]).exp());
                for (n, a) in a.iter().enumerate().skip(1) {
                    e.exponential(&mut rate, n, sign * n as f64 * a, 1.0 / n as f64);
                }
                std::array::from_fn::<f64, N, _>(|n| e.get(n))
            };
            let (plus, minus) = (exp(1.0), exp(-1.0));
            let ones = product(&plus, &minus);
            for n in 0..N {
                let size: f64 = (0..=n).map(|k| (plus[k] * minus[n - k]).abs()).sum();
                let expected = if n == 0 { 1.0 } else { 0.0 };
                prop_assert!((ones[n] - expected).abs() <= 1e-14 * (1.0 + size));
            }
        }

        /// Products in groups of four equal those of a plain loop, at any degree, also for a number of coefficients
        /// that is no multiple of four.
        #[test]
        fn property_products_are_their_sums(
            a in proptest::array::uniform24(-1.0..1.0f64), b in proptest::array::uniform24(-1.0..1.0f64),
            degree in 1..N, from in 0..2usize,
        ) {
            const SHORT: usize = N - 3;
            let a: [f64; SHORT] = std::array::from_fn(|k| if k > degree { 0.0 } else { a[k] });
            let b: [f64; SHORT] = std::array::from_fn(|k| b[k]);
            let all = product(&a, &b);
            let mut unfolding = Unfolding::<f64, SHORT>::new();
            for n in 0..SHORT {
                let plain: f64 = (0..=n).map(|k| a[k] * b[n - k]).sum();
                prop_assert!((all[n] - plain).abs() <= 1e-14 * N as f64);
                unfolding.set(n, b[n]);
                if n >= from {
                    let some = unfolding.product(&a, n, from, degree);
                    let left_out: f64 = (0..from).map(|k| a[k] * b[n - k]).sum();
                    prop_assert!((some - (plain - left_out)).abs() <= 1e-14 * N as f64);
                }
            }
        }
    }

    proptest! {
        /// Products in groups of four equal those of a plain loop, at any degree of the one factor and any number of
        /// coefficients. Values beyond these are not read.
        #[test]
        fn property_added_products_are_their_sums(
            a in proptest::array::uniform24(-1.0..1.0f64), b in proptest::array::uniform24(-1.0..1.0f64),
            degree in 0..N, terms in 1..=N,
        ) {
            let (mut product, mut square) = ([0.5; N], [0.5; N]);
            add_product(&mut product, 3.0, &a[..=degree.min(terms - 1)], &b[..terms]);
            add_square(&mut square, 3.0, &b[..terms]);
            for n in 0..terms {
                let of_product: f64 = (0..=n.min(degree)).map(|k| a[k] * b[n - k]).sum();
                let of_square: f64 = (0..=n).map(|k| b[k] * b[n - k]).sum();
                prop_assert!((product[n] - (0.5 + 3.0 * of_product)).abs() <= 1e-14 * N as f64);
                prop_assert!((square[n] - (0.5 + 3.0 * of_square)).abs() <= 1e-14 * N as f64);
            }
        }
    }

    #[test]
    fn analytic_an_oscillation_is_its_closed_form() {
        // Damping ratio 0.3: exp(-0.3 x) (cos w x + (0.7 + 0.3)/w sin w x) with w^2 = 0.91
        let mut c = [0.0; 32];
        damped_oscillation(0.3, 1.0, 1.0, 0.7, &mut c);
        let w = 0.91f64.sqrt();
        for x in [0.1_f64, 0.9, 2.0] {
            let exact = (-0.3 * x).exp() * ((w * x).cos() + (w * x).sin() / w);
            // Terms are at most 2^2/2, and the first omitted term is 2^32/32!, 2e-26.
            assert!((value(&c, x) - exact).abs() < 1e-15 * 8.0);
            let (again, rate) = value_and_rate(&c, x);
            let ahead = value(&c, x + 1e-5) - value(&c, x - 1e-5);
            assert_eq!(again, value(&c, x));
            // A central difference: 1e-10 of the third derivative, and rounding over 2e-5.
            assert!((rate - ahead / 2e-5).abs() < 1e-9);
        }
    }

    #[test]
    fn analytic_a_step_is_where_the_last_terms_are_one() {
        // cos and sin: one of the last two coefficients vanishes
        let factorial: f64 = (1..=24).map(f64::from).product();
        let step = step(24, |n| if n == 24 { 1.0 / factorial } else { 0.0 });
        assert!((step.powi(24) / factorial - 1.0).abs() < 1e-13);
    }
}

mod chebyshev {
    use nalgebra::DMatrix;
    use stickslip::numerics::chebyshev::{COEFFICIENTS, fit, nodes, place, value};

    fn fitted(start: f64, end: f64, motion: impl Fn(f64) -> f64) -> Vec<f64> {
        let times = nodes(start, end);
        let mut column = DMatrix::from_fn(COEFFICIENTS, 1, |k, _| motion(times[k]));
        fit(&times, &mut column);
        column.as_slice().to_vec()
    }

    /// An oscillation with a quarter of a period in the stretch, at a time where neighbouring doubles are 9e-16 s
    /// apart. Its phase is known to 2e-11 rad only if the rounded nodes are used as they are.
    #[test]
    fn analytic_an_oscillation_late_in_a_run_is_met_to_the_rounding_of_its_argument() {
        let omega = 25_000.0;
        let (start, end) = (7.0, 7.0 + 0.25 * std::f64::consts::TAU / omega);
        let motion = |t: f64| (omega * (t - 7.0)).sin();
        let c = fitted(start, end, motion);
        for k in 0..=1000 {
            let t = start + (end - start) * f64::from(k) / 1000.0;
            let error = value(&c, place(t, start, end)) - motion(t);
            assert!(error.abs() < 5e-14, "{t}: {error:e}");
        }
        assert!(c[14].abs().max(c[15].abs()) < 1e-14, "{c:?}");
    }

    #[test]
    fn analytic_a_polynomial_has_its_coefficients() {
        // T_3 + 2 on [1, 3]
        let c = fitted(1.0, 3.0, |t| {
            let x = t - 2.0;
            4.0 * x * x * x - 3.0 * x + 2.0
        });
        for (j, c) in c.iter().enumerate() {
            let expected = [2.0, 0.0, 0.0, 1.0].get(j).copied().unwrap_or(0.0);
            assert!((c - expected).abs() < 1e-14, "{j}: {c}");
        }
    }

    #[test]
    fn analytic_a_stretch_of_a_few_roundings_is_a_line() {
        let end = 7.0 + 100.0 * f64::EPSILON;
        let c = fitted(7.0, end, |t| if t == 7.0 { 1.0 } else { 2.0 });
        assert_eq!((value(&c, -1.0), value(&c, 1.0)), (1.0, 2.0));
    }
}

mod eigenvalues {
    use nalgebra::{Complex, DMatrix};
    use std::f64::consts::TAU;
    use stickslip::numerics::eigenvalues::eigenvalues;

    /// The eigenvalues of a cyclic permutation are the roots of unity. All are well-conditioned, because the matrix is
    /// orthogonal: rounding and the tolerance of a second attempt leave 1e-13.
    #[test]
    fn analytic_eigenvalues_of_what_the_shifts_leave_alone() {
        for rows in [3, 4, 5, 6] {
            let cycle = DMatrix::from_fn(rows, rows, |i, j| f64::from(u8::from(i == (j + 1) % rows)));
            let found = eigenvalues(&cycle);
            for k in 0..rows {
                let expected = Complex::from_polar(1.0, TAU * k as f64 / rows as f64);
                let values = found.iter().map(|l| (l - expected).norm());
                let nearest = values.fold(f64::INFINITY, f64::min);
                assert!(nearest < 1e-13, "{rows} rows, {expected}: {nearest:e}");
            }
        }
    }

    /// A chain of equal inertias and shafts with one fixed end, in closed form. A long chain takes more sweeps than a
    /// short one.
    #[test]
    fn analytic_eigenvalues_of_chains() {
        for inertias in [1, 2, 10, 60] {
            let rows = 2 * inertias;
            let chain = DMatrix::from_fn(rows, rows, |i, j| match (i % 2, i / 2, j % 2, j / 2) {
                (0, i, 1, j) => f64::from(u8::from(i == j)),
                (1, i, 0, j) if i == j => {
                    if i + 1 == inertias {
                        -1.0
                    } else {
                        -2.0
                    }
                }
                (1, i, 0, j) => f64::from(u8::from(i.abs_diff(j) == 1)),
                _ => 0.0,
            });
            let mut found = eigenvalues(&chain);
            found.retain(|l| l.im > 0.0);
            found.sort_by(|a, b| a.im.total_cmp(&b.im));
            assert_eq!(found.len(), inertias);
            for (k, found) in found.iter().enumerate() {
                let angle = (2 * k + 1) as f64 * TAU / (4 * (2 * inertias + 1)) as f64;
                let expected = Complex::new(0.0, 2.0 * angle.sin());
                assert!((found - expected).norm() < 1e-12, "{inertias}, {k}: {found}");
            }
        }
    }

    #[test]
    fn property_what_is_no_number_has_no_eigenvalues() {
        for entry in [f64::NAN, f64::INFINITY] {
            let mut matrix = DMatrix::identity(5, 5);
            matrix[(1, 3)] = entry;
            assert!(eigenvalues(&matrix).iter().all(|l| l.re.is_nan()));
        }
    }
}
