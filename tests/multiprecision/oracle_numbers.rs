//! The oracle's own arithmetic: floats of any length, roots, elementary functions.

mod roots {
    use stickslip::oracle::float::Float;
    use stickslip::oracle::roots::{Crossing, first_zero};

    type Real = Float<3>;

    /// Coefficients of the product of (x - root), times `sign`.
    fn with_roots(roots: &[f64], sign: f64) -> Vec<Real> {
        let mut product = vec![Real::from_f64(sign)];
        for &root in roots {
            let root = Real::from_f64(root);
            let mut next = vec![Real::zero(); product.len() + 1];
            for (k, c) in product.iter().enumerate() {
                next[k + 1] += c;
                next[k] -= &(c * &root);
            }
            product = next;
        }
        product
    }

    fn first(coefficients: &[Real], known: usize) -> Option<f64> {
        match first_zero(coefficients, known, &Real::from_f64(1.0)) {
            Crossing::At(x) => Some(x.to_f64()),
            Crossing::None => None,
            Crossing::Beyond => panic!("the polynomial starts positive"),
        }
    }

    /// The roots of the factorised polynomial are known; 2^-50 is the rounding of the comparison in doubles.
    #[test]
    fn analytic_the_first_of_the_roots_is_found() {
        for (roots, expected) in [
            (vec![0.7, 0.2, 0.9], Some(0.2)),
            (vec![0.5, 0.5 + 1e-13], Some(0.5)),
            (vec![1.5, -0.5], None),
            (vec![1.0 - 1e-15, 3.0], Some(1.0 - 1e-15)),
        ] {
            let sign = if roots.iter().filter(|&&r| r > 0.0).count() % 2 == 1 {
                -1.0
            } else {
                1.0
            };
            let found = first(&with_roots(&roots, sign), 0);
            match expected {
                Some(x) => assert!(
                    (found.expect("a root") - x).abs() < 2f64.powi(-50),
                    "{roots:?}: {found:?}"
                ),
                None => assert_eq!(found, None, "{roots:?}"),
            }
        }
    }

    /// x^2 (0.3 - x): the double root at the start is the start of the motion, and no crossing.
    #[test]
    fn analytic_a_tangential_start_is_no_root() {
        let found = first(&with_roots(&[0.0, 0.0, 0.3], -1.0), 2).expect("a root");
        assert!((found - 0.3).abs() < 2f64.powi(-50));
    }

    /// (x - 1/2)^2 + e stays positive for any e > 0, however small, and has two roots for e < 0; doubles see no
    /// difference.
    #[test]
    fn analytic_a_graze_is_told_from_a_crossing() {
        let graze = |e: f64| {
            let mut p = with_roots(&[0.5, 0.5], 1.0);
            p[0] += &Real::from_f64(e);
            first(&p, 0)
        };
        assert_eq!(graze(1e-30), None);
        let root = graze(-1e-30).expect("two roots");
        assert!((root - (0.5 - 1e-15)).abs() < 1e-16, "{root:e}");
    }
}

mod number {
    use num_bigint::BigInt;
    use num_rational::BigRational;
    use stickslip::model::nearest_double;
    use stickslip::oracle::{ExactDouble, rational};

    #[test]
    fn property_decimals_pass_through_unharmed() {
        for text in [
            "6.97413067386339914422662167099",
            "-4.01769591910436980859516070784e-05",
            "2e-2713",
            "100",
            "0.0375",
        ] {
            let exact = rational(text).expect("a decimal");
            let back = ExactDouble::from_rational(&exact, 192).to_decimal(30);
            assert_eq!(rational(&back), Some(exact), "{text} became {back}");
        }
    }

    #[test]
    fn property_doubles_pass_through_unharmed() {
        for value in [1.0, -0.1, 1e-300, 6.02e23, 123_456.789] {
            assert_eq!(ExactDouble::from_f64(value, 128).to_f64(), value);
        }
    }

    #[test]
    fn analytic_a_rational_is_rounded_to_the_precision() {
        let third = BigRational::new(BigInt::from(1), BigInt::from(3));
        let number = ExactDouble::from_rational(&third, 128).to_rational().expect("finite");
        let error = nearest_double(&((number - &third) / third));
        // One unit in the last of 128 bits.
        assert!(error.abs() < 2f64.powi(-127), "{error:e}");
    }
}

mod float {
    use num_bigint::BigInt;
    use num_rational::BigRational;
    use num_traits::{One, Signed};
    use proptest::prelude::*;
    use stickslip::model::nearest_double;
    use stickslip::oracle::ExactDouble;
    use stickslip::oracle::float::Float;

    fn exact<const N: usize>(float: &Float<N>) -> BigRational {
        ExactDouble::from(float).to_rational().expect("finite")
    }

    /// Exact arithmetic on the same numbers. The truncation is less than two units in the last place of `scale`.
    fn near<const N: usize>(found: &Float<N>, expected: &BigRational, scale: &BigRational) {
        let error = (exact(found) - expected).abs();
        let unit = scale.abs() / BigRational::from_integer(BigInt::one() << (Float::<N>::BITS - 1));
        assert!(error <= unit.clone() + unit, "{error} of {scale}");
    }

    fn check<const N: usize>(pairs: &[(f64, f64, i32)]) {
        let third = Float::<N>::from_rational(&BigRational::new(BigInt::one(), BigInt::from(3)));
        let numbers: Vec<(Float<N>, Float<N>)> = pairs
            .iter()
            .map(|(a, b, power)| {
                // All words are used, and the exponents differ.
                let a = &Float::from_f64(*a) * &third;
                let b = &(&Float::from_f64(*b) * &third) * &Float::from_f64(2f64.powi(*power));
                (a, b)
            })
            .collect();
        for (a, b) in &numbers {
            let (x, y) = (exact(a), exact(b));
            near(&(a + b), &(&x + &y), &x.abs().max(y.abs()));
            near(&(a - b), &(&x - &y), &x.abs().max(y.abs()));
            near(&(a * b), &(&x * &y), &(&x * &y));
            assert_eq!(a.partial_cmp(b), Some(x.cmp(&y)));
            assert_eq!(exact(&a.half()) * BigInt::from(2), x);
            if !b.is_zero() {
                near(&a.over(b), &(&x / &y), &(&x / &y));
            }
            // The remainder after all but the last bits cancel.
            let c = a + &(b * &Float::from_f64(2f64.powi(-(Float::<N>::BITS as i32) / 2)));
            near(&(&c - a), &(exact(&c) - &x), &(exact(&c) - &x));
        }
        let (a, b): (Vec<_>, Vec<_>) = numbers.iter().copied().unzip();
        let products = || a.iter().zip(b.iter().rev()).map(|(a, b)| exact(a) * exact(b));
        let largest = products().map(|p| p.abs()).max().expect("pairs");
        near(&Float::convolution(&a, &b), &products().sum(), &largest);
    }

    proptest! {
        #[test]
        fn property_sums_products_and_quotients_are_cut_at_the_last_place(
            pairs in prop::collection::vec((-1e3..1e3f64, -1e3..1e3f64, -300..300i32), 1..20)
        ) {
            check::<2>(&pairs);
            check::<4>(&pairs);
            check::<10>(&pairs);
        }
    }

    /// 2/3 in bits: 1010...
    #[test]
    fn analytic_a_cut_number_keeps_its_first_bits() {
        let exactly = BigRational::new(BigInt::from(2), BigInt::from(3));
        for bits in [1, 59, 63, 64, 65, 128, 187, 255, 256, 300] {
            let mut cut = Float::<4>::from_rational(&exactly);
            cut.cut(bits);
            let unit = BigInt::one() << bits.min(256);
            let expected =
                (&exactly * BigRational::from_integer(unit.clone())).floor() / BigRational::from_integer(unit);
            assert_eq!(exact(&cut), expected, "{bits}");
        }
    }

    #[test]
    fn analytic_sums_carry_and_cancel() {
        // 2^-64 below 1: both ends of the words.
        let (one, small) = (Float::<2>::from_f64(1.0), Float::<2>::from_f64(2f64.powi(-127)));
        let below = &one - &small;
        assert!(below < one && exact(&(&below + &small)) == exact(&one));
        assert!((&below - &below).is_zero());
        assert!((&below - &one).signum() < 0);
        let terms = [one; 200];
        assert_eq!(Float::convolution(&terms, &terms).to_f64(), 200.0);
        let signs: Vec<_> = (0..200).map(|k| if k % 2 == 0 { one } else { -&one }).collect();
        assert!(Float::convolution(&terms, &signs).is_zero());
    }

    /// exp(a) exp(-a) = 1, and a comparison with doubles.
    #[test]
    fn analytic_exponentials() {
        let reciprocals: Vec<_> = (0..400)
            .map(|k| Float::<5>::from_rational(&BigRational::new(BigInt::one(), BigInt::from(k.max(1)))))
            .collect();
        let ln_2 = Float::ln_2();
        for x in [0.3, -1.0, 20.5, -350.0, 1e-30] {
            let [up, down] = [x, -x].map(|x| Float::from_f64(x).exp(&ln_2, &reciprocals));
            assert!((up.to_f64() / f64::exp(x) - 1.0).abs() < 1e-13, "{x}");
            let one = exact(&(&up * &down));
            let error = nearest_double(&(one - BigRational::one()));
            // |x| roundings of ln 2, and the roundings of some sixty terms.
            assert!(error.abs() < 2f64.powi(-320) * (64.0 + 4.0 * x.abs()), "{x}: {error:e}");
        }
        assert!(exact(&ln_2.exp(&ln_2, &reciprocals)) == BigRational::from_integer(BigInt::from(2)));
        assert!(Float::<5>::from_f64(-1e15).exp(&ln_2, &reciprocals).is_zero());
        assert!(!Float::<5>::from_f64(1e15).exp(&ln_2, &reciprocals).is_finite());
    }

    #[test]
    fn property_what_is_lost_stays_lost() {
        let lost = Float::<3>::from_f64(1.0).over(&Float::zero());
        let one = Float::from_f64(1.0);
        for value in [&lost * &one, &lost + &one, &one - &lost, &lost - &lost, one.over(&lost)] {
            assert!(!value.is_finite());
        }
        assert!(lost.partial_cmp(&one).is_none() && lost.to_f64().is_nan());
    }

    #[test]
    fn property_doubles_pass_through_unharmed() {
        for value in [1.0, -0.1, 1e-300, 5e-324, 6.02e23, 123_456.789] {
            assert_eq!(Float::<2>::from_f64(value).to_f64(), value);
            let log2 = Float::<2>::from_f64(value).log2();
            // The logarithm of a double by double arithmetic.
            assert!((log2 - value.abs().log2()).abs() < 1e-12, "{value}: {log2}");
        }
    }
}

mod elementary {
    use stickslip::oracle::elementary::{Elementary, pi};
    use stickslip::oracle::float::Float;

    type Real = Float<4>;

    fn small(value: &Real, bits: f64) -> bool {
        value.log2() < bits
    }

    /// Digits 1 to 60 of pi, as printed in any table.
    #[test]
    fn published_digits_of_pi() {
        let text = "3.14159265358979323846264338327950288419716939937510582097494";
        let expected = Real::from_rational(&stickslip::oracle::rational(text).unwrap());
        assert!(small(&(&pi::<4>() - &expected), -190.0));
    }

    /// Comparison with doubles; the theorem of Pythagoras and double angles, to some bits of the 256.
    #[test]
    fn analytic_sines_and_cosines() {
        let table = Elementary::<4>::new(200);
        for x in [0.0, 1e-20, 0.4, -0.8, 1.6, 3.0, -5.1, 100.25, 12_345.678] {
            let value = Real::from_f64(x);
            let [sine, cosine] = table.sine_and_cosine(&value);
            assert!((sine.to_f64() - x.sin()).abs() < 1e-15 && (cosine.to_f64() - x.cos()).abs() < 1e-15);
            let one = &(&sine * &sine) + &(&cosine * &cosine);
            assert!(small(&(&one - &Real::from_f64(1.0)), -248.0), "{x}");
            let [twice, _] = table.sine_and_cosine(&(&value + &value));
            let product = &sine * &cosine;
            assert!(small(&(&twice - &(&product + &product)), -236.0), "{x}");
        }
    }

    /// Comparison with doubles; the tangent of the arc tangent.
    #[test]
    fn analytic_arc_tangents() {
        let table = Elementary::<4>::new(200);
        for y in [0.0, 1e-30, 0.3, -0.9, 1.0, 7.5, -4000.25] {
            let value = Real::from_f64(y);
            let angle = table.arc_tangent(&value);
            assert!((angle.to_f64() - y.atan()).abs() < 1e-15);
            let [sine, cosine] = table.sine_and_cosine(&angle);
            assert!(small(&(&(&value * &cosine) - &sine), -238.0), "{y}");
        }
        let quarter = table.arc_tangent(&Real::from_f64(1.0));
        assert!(small(&(&quarter - &table.pi.half().half()), -250.0));
    }

    /// Comparison with doubles; the identity between the two.
    #[test]
    fn analytic_hyperbolic_tangents() {
        let table = Elementary::<4>::new(200);
        for y in [0.0, 1e-10, 0.3, 2.0, 30.0, 300.0] {
            let [tangent, rest] = table.hyperbolic_tangent(&Real::from_f64(y));
            assert!((tangent.to_f64() - y.tanh()).abs() < 1e-15);
            let sum = &(&tangent * &tangent) + &rest;
            assert!(small(&(&sum - &Real::from_f64(1.0)), -248.0), "{y}");
            assert!((rest.to_f64() / y.cosh().powi(-2) - 1.0).abs() < 1e-12 * y.max(1.0));
        }
    }
}

mod margin {
    use num_rational::BigRational;
    use stickslip::oracle::margin::{ExactSurface, of_both};

    fn surface([inertia, damping, stiffness]: [i64; 3]) -> ExactSurface {
        let [inertia, damping, stiffness] = [inertia, damping, stiffness].map(|n| BigRational::from_integer(n.into()));
        ExactSurface {
            inertia,
            damping,
            stiffness,
        }
    }

    /// Real and imaginary part of Z by complex division.
    fn impedance(surfaces: [[i64; 3]; 2], omega: f64) -> [f64; 2] {
        let of = |[j, a, k]: [i64; 3]| nalgebra::Complex::new(a as f64, omega * j as f64 - k as f64 / omega);
        let [one, other] = surfaces.map(of);
        let both = one * other / (one + other);
        [both.re, both.im]
    }

    /// Against a scan of the zeros of Im Z. The scan's step of 1e-5 of omega leaves an error of 1e-4 of R.
    #[test]
    fn analytic_the_least_resistance_is_that_of_a_scan() {
        for surfaces in [
            [[1, 3, 100], [2, 1, 900]],
            [[1, 1, 100], [2, 3, 900]],
            [[5, 2, 400], [1, 1, 81]],
            [[3, 40, 100], [2, 1, 900]],
            [[2, 0, 0], [1, 1, 100]],
        ] {
            let found = of_both::<4>(&surface(surfaces[0]), &surface(surfaces[1]))
                .expect("a swing")
                .to_f64();
            let at = |k: i32| impedance(surfaces, 0.5 * (1.0 + 1e-5f64).powi(k));
            let zeros = (0..500_000).filter(|k| at(*k)[1] * at(k + 1)[1] <= 0.0);
            let least = zeros.map(|k| 2.0 * at(k)[0]).fold(f64::INFINITY, f64::min);
            let error = (found - least).abs();
            assert!(error < 1e-3 * least, "{surfaces:?}: {found} and {least}");
        }
    }

    /// Two equal disks have half the resistance of one, exactly.
    #[test]
    fn analytic_equal_disks_have_the_damping_of_one() {
        let disk = || surface([1, 7, 100]);
        let found = of_both::<2>(&disk(), &disk()).expect("a swing");
        assert_eq!(found.to_f64(), 7.0);
    }
}
