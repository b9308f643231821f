//! The friction laws against the properties that the rest of the program relies on.

use crate::common::systems::exponential;
use proptest::prelude::*;
use stickslip::friction::{
    self, Asymmetric, Bounds, Coulomb, Exponential, FrictionLaw, Hyperbolic, Law, LawSeries, Stribeck,
};
use stickslip::numerics::taylor;

const TERMS: usize = 28;

fn grid(from: f64, to: f64, count: usize) -> impl Iterator<Item = f64> {
    (0..=count).map(move |k| from + (to - from) * k as f64 / count as f64)
}

/// Properties of every law, at speeds up to `end`; `damping` and `weight` define a margin.
fn hold(law: &impl Law, end: f64, damping: f64, weight: f64) -> Result<(), TestCaseError> {
    let largest = law.coefficient_bounds(0.0, end).most;
    let steepest = law.slope_bounds(0.0, f64::INFINITY);
    let slope_scale = steepest.most.abs().max(steepest.least.abs());
    // Values at the ends of an interval are rounded like those inside.
    let (rounding, slope_rounding) = (4.0 * f64::EPSILON * largest, 1e-14 * slope_scale);
    prop_assert!((law.coefficient(0.0) - law.at_vanishing_speed()).abs() <= rounding);
    prop_assert!(law.knots().iter().all(|knot| *knot >= end));
    for (from, to) in [
        (0.0, end),
        (0.0, f64::INFINITY),
        (0.1 * end, 0.4 * end),
        (0.3 * end, f64::INFINITY),
    ] {
        let (mu, slopes) = (law.coefficient_bounds(from, to), law.slope_bounds(from, to));
        for x in grid(from, to.min(end), 500) {
            let (value, slope) = law.coefficient_and_slope(x);
            prop_assert_eq!(value, law.coefficient(x));
            prop_assert!(
                mu.least - rounding <= value && value <= mu.most + rounding,
                "{x}: {value} in {mu:?}"
            );
            prop_assert!(
                slopes.least - slope_rounding <= slope && slope <= slopes.most + slope_rounding,
                "{x}: {slope}"
            );
        }
    }
    for x in grid(0.05 * end, end, 100) {
        // Central differences: h^2/6 of the third derivative, h = 1e-4 of the scale, and rounding over h.
        let h = 1e-4 / law.steepness_rate(x);
        let (before, after) = (law.coefficient_and_slope(x - h), law.coefficient_and_slope(x + h));
        let slope = (after.0 - before.0) / (2.0 * h);
        let expected = law.coefficient_and_slope(x).1;
        let error = 1e-7 * slope_scale + 2.0 * rounding / h;
        prop_assert!((slope - expected).abs() < error, "{x}: {slope} {expected}");
        // mu'' against the largest slope, as far as differences resolve it.
        let curvature = (after.1 - before.1).abs() / (2.0 * h);
        let bound = law.steepness_rate(x) * slope_scale;
        prop_assert!(
            curvature <= 1.001 * bound + 1e-10 * slope_scale / h,
            "{x}: {curvature} {bound}"
        );
        prop_assert!(law.followed_fall(x, 0.05) > 0.0);
    }
    zeros_are_sign_changes(law, end, damping, weight)
}

fn zeros_are_sign_changes(law: &impl Law, end: f64, damping: f64, weight: f64) -> Result<(), TestCaseError> {
    let margin = |x: f64| damping + weight * law.coefficient_and_slope(x).1;
    let zeros = law.damping_zeros(damping, weight);
    prop_assert!(zeros.windows(2).all(|pair| pair[0] > pair[1]));
    for &x in &zeros {
        prop_assert!(margin(x).abs() < 1e-12 * damping.max(weight), "{x}: {}", margin(x));
    }
    let near = |x: f64| zeros.iter().any(|zero| (zero - x).abs() < 1e-6 * end);
    for x in grid(0.0, end, 500).filter(|&x| !near(x)) {
        let above = zeros.iter().filter(|&&zero| zero > x).count();
        // Above all zeros sliding is damped.
        prop_assert_eq!(margin(x) > 0.0, above % 2 == 0, "{}: {} of {:?}", x, margin(x), zeros);
        prop_assert!(margin(x) > 0.0 || x < law.damped_from(damping, weight));
    }
    Ok(())
}

/// The coefficients along x(t) = x_0 + x_1 t + x_2 t^2, |t| <= 1, against the law itself, as far as the law allows.
/// The last four terms bound the remainder (in an even motion every other term vanishes, and the others may fall by as
/// little as a factor of 0.8), and sums of terms up to e^6 of the result have rounding.
fn series_are_the_law(law: &impl Law, x: [f64; 3]) -> Result<(), TestCaseError> {
    let end = 0.999 * law.expandable_share(x[0], x[1].abs() + x[2].abs());
    let steepest = law.slope_bounds(0.0, f64::INFINITY);
    let (mu_scale, slope_scale) = (
        law.coefficient_bounds(0.0, 2.0 * x[0]).most,
        steepest.most.max(-steepest.least),
    );
    for by_rates in [true, false] {
        let mut series = law.series::<f64, TERMS>();
        let mut speed = [0.0; TERMS];
        speed[..3].copy_from_slice(&x);
        let unit = if by_rates { -0.25 } else { 1.0 };
        series.start(x[0], unit);
        for n in 1..TERMS {
            if by_rates {
                series.extend(n, n as f64 * speed[n] / unit, 1.0 / n as f64);
            } else {
                series.extend_from(n, &speed);
            }
        }
        let factors = series.factors(1.0, 1.0);
        let force: [f64; TERMS] = std::array::from_fn(|n| [3.0, 0.5].get(n).copied().unwrap_or(0.0));
        let mut mu: [f64; TERMS] = std::array::from_fn(|n| factors.shape * series.shape(n));
        mu[0] += factors.constant;
        let slope: [f64; TERMS] = std::array::from_fn(|n| factors.slope * series.slope_shape(n));
        let pressed: [f64; TERMS] = std::array::from_fn(|n| factors.shape * series.pressed(&force, n, 1));
        for t in grid(-end, end, 20) {
            let (value, rate) = law.coefficient_and_slope(taylor::value(&speed, t));
            let force = 3.0 + 0.5 * t;
            for (coefficients, expected, scale) in [
                (&mu, value, mu_scale),
                (&slope, rate, slope_scale),
                (&pressed, (value - factors.constant) * force, 4.0 * mu_scale),
            ] {
                let term = |n: usize| (coefficients[n] * t.powi(n as i32)).abs();
                let error = (taylor::value(coefficients, t) - expected).abs();
                let last: f64 = (TERMS - 4..TERMS).map(term).sum();
                let allowed = 4.0 * last + 1e-12 * (scale + expected.abs());
                prop_assert!(error < allowed, "{t}: {error:e} over {allowed:e}");
            }
        }
    }
    Ok(())
}

proptest! {
    #[test]
    fn analytic_the_exponential_law(
        low_speed in 0.1..1.0f64, high_speed in 0.05..1.0f64, decay in 0.05..200.0f64,
        ratio in 0.2..50.0f64, x in 0.3..8.0f64, change in prop::array::uniform2(-1.5..1.5f64),
    ) {
        let law = FrictionLaw::from(Exponential { low_speed, high_speed, decay });
        let weight = 100.0;
        let damping = weight * decay * (low_speed - high_speed).abs().max(1e-3) / ratio;
        hold(&law, 12.0 / decay, damping, weight)?;
        series_are_the_law(&law, [x, change[0], change[1]].map(|x| x / decay))?;
        prop_assert_eq!(law.falls(), low_speed > high_speed);
        // |mu^(n)| = |mu_s - mu_d| alpha^n exp(-alpha x)
        let of_third = (low_speed - high_speed).abs() * decay.powi(3) * (-x).exp();
        prop_assert!((law.speed_of_derivative(3, of_third) - x / decay).abs() < 1e-12 / decay);
    }

    #[test]
    fn analytic_the_coulomb_law(kinetic in 0.0..1.0f64, x in -1.5..1.5f64) {
        let law = FrictionLaw::from(Coulomb { kinetic });
        let (mu, slope) = law.coefficient_and_slope(x);
        prop_assert_eq!((mu, slope, law.at_vanishing_speed()), (kinetic, 0.0, kinetic));
        prop_assert_eq!(law.coefficient_bounds(0.0, f64::INFINITY), Bounds::between(kinetic, kinetic));
        prop_assert!(!law.falls() && law.damping_zeros(20.0, 100.0).is_empty());
        prop_assert_eq!(law.damped_from(20.0, 100.0), 0.0);
        let mut series = law.series::<f64, TERMS>();
        series.start(x, 1.0);
        series.extend(1, x, 1.0);
        let factors = series.factors(2.0, 2.0);
        let pressed = series.pressed(&[3.0; TERMS], 1, 1);
        prop_assert_eq!((factors.constant, factors.slope * series.slope_shape(1)), (2.0 * kinetic, 0.0));
        prop_assert_eq!(factors.shape * series.shape(0) + factors.shape * pressed, 0.0);
    }

    /// Coulomb's law in each sense, with bounds for both.
    #[test]
    fn analytic_the_asymmetric_law(
        kinetic in 0.0..1.0f64, kinetic_backward in 0.0..1.0f64, reserve in -0.5..0.5f64, x in -1.5..1.5f64,
    ) {
        let breakaway_backward = kinetic_backward + reserve;
        let law = FrictionLaw::from(Asymmetric { kinetic, kinetic_backward, breakaway_backward });
        let backward = law.backward().unwrap();
        prop_assert_eq!(&backward.law, &FrictionLaw::from(Coulomb { kinetic: kinetic_backward }));
        prop_assert_eq!(backward.breakaway, breakaway_backward);
        prop_assert_eq!(law.coefficient_and_slope(x), Coulomb { kinetic }.coefficient_and_slope(x));
        prop_assert_eq!(law.at_vanishing_speed(), kinetic);
        let (mu, slopes) = (law.coefficient_bounds(0.0, x.abs()), law.slope_bounds(0.0, f64::INFINITY));
        prop_assert_eq!(mu, Bounds::between(kinetic, kinetic_backward));
        prop_assert_eq!(slopes, Bounds::between(0.0, 0.0));
        prop_assert_eq!(law.typical_coefficient(x.abs()), kinetic.max(kinetic_backward));
        prop_assert!(!law.falls() && law.damping_zeros(20.0, 100.0).is_empty() && law.extent().is_infinite());
        let mut series = law.series::<f64, TERMS>();
        series.start(x, 1.0);
        prop_assert_eq!((series.factors(2.0, 2.0).constant, series.slope_shape(0)), (2.0 * kinetic, 0.0));
        // Only a backward breakaway below backward sliding is complained of.
        let complaints = law.complaints();
        prop_assert_eq!(complaints.is_empty(), breakaway_backward >= kinetic_backward);
        prop_assert!(complaints.iter().all(|(key, _)| key == "breakaway_backward"));
        let laws = [FrictionLaw::from(Coulomb { kinetic }), backward.law];
        prop_assert!(laws.iter().all(|law| law.backward().is_none()));
    }

    #[test]
    fn analytic_the_hyperbolic_law(
        low_speed in 0.1..1.0f64, high_speed in 0.0..1.0f64, scale in 0.01..10.0f64,
        ratio in 0.2..50.0f64, x in 0.1..8.0f64, change in prop::array::uniform2(-1.5..1.5f64),
    ) {
        let law = FrictionLaw::from(Hyperbolic { low_speed, high_speed, scale });
        let weight = 100.0;
        let damping = weight * (low_speed - high_speed).abs().max(1e-3) / scale / ratio;
        hold(&law, 20.0 * scale, damping, weight)?;
        series_are_the_law(&law, [x, change[0], change[1]].map(|x| x * scale))?;
        prop_assert_eq!(law.falls(), low_speed > high_speed);
        // Finite beyond the pole, and without a jump where the tangent replaces the law.
        prop_assert!(law.coefficient(-scale).is_finite() && law.coefficient(-3.0 * scale).is_finite());
        let jump = law.coefficient(-0.5 * scale * (1.0 + 1e-9)) - law.coefficient(-0.5 * scale * (1.0 - 1e-9));
        prop_assert!(jump.abs() < 1e-7);
    }

    #[test]
    fn analytic_the_stribeck_law(
        low_speed in 0.1..1.0f64, high_speed in 0.1..1.0f64, scale in 0.01..10.0f64, rise in 0.0..1.2f64,
        exponent in 1..=4i32, ratio in 0.2..50.0f64, x in 0.3..4.0f64, change in prop::array::uniform2(-1.5..1.5f64),
    ) {
        let drop = low_speed - high_speed;
        // A constant has no scale for a difference.
        prop_assume!(drop.abs() > 1e-3);
        // Every third law has no rise.
        let viscous = (rise - 0.4).max(0.0) * drop.abs() / scale;
        let law = FrictionLaw::from(Stribeck {
            low_speed, high_speed, scale, exponent: f64::from(exponent), viscous,
        });
        let weight = 100.0;
        hold(&law, 8.0 * scale, weight * drop.abs().max(1e-3) / scale / ratio, weight)?;
        series_are_the_law(&law, [x, change[0], change[1]].map(|x| x * scale))?;
        // Below this speed no derivative is missed.
        let size = 1e-6 * (drop.abs() / scale.powi(5)).max(1e-300);
        prop_assert!(law.speed_of_derivative(5, size) >= scale);
    }

    /// With the exponent 1 and no rise it is the exponential law.
    #[test]
    fn analytic_the_stribeck_law_has_the_exponential_one(
        low_speed in 0.1..1.0f64, high_speed in 0.1..1.0f64, scale in 0.01..10.0f64, x in 0.0..8.0f64,
    ) {
        let one = Stribeck { low_speed, high_speed, scale, exponent: 1.0, viscous: 0.0 };
        let other = Exponential { low_speed, high_speed, decay: 1.0 / scale };
        let ((a, a_slope), (b, b_slope)) = (one.coefficient_and_slope(x * scale), other.coefficient_and_slope(x * scale));
        prop_assert!((a - b).abs() < 1e-14 && (a_slope - b_slope).abs() < 1e-13 / scale);
        prop_assert!((one.steepness_rate(0.0) * scale - 1.0).abs() < 1e-14 || low_speed == high_speed);
    }

    #[test]
    fn analytic_the_polynomial_law(
        low_speed in 0.1..1.5f64, end in 0.1..10.0f64, c in prop::array::uniform3(-0.5..0.5f64),
        ratio in 0.2..50.0f64, x in 0.1..0.9f64, change in prop::array::uniform2(-0.5..0.5f64),
    ) {
        // A straight line has no scale for a difference.
        prop_assume!(c[1].abs() + c[2].abs() > 0.02);
        let [linear, quadratic, cubic] = [c[0] / end, c[1] / end.powi(2), c[2] / end.powi(3)];
        let polynomial = friction::Polynomial { low_speed, linear, quadratic, cubic, valid_below: end };
        let law = FrictionLaw::from(polynomial);
        // The only complaint is about a coefficient that is negative somewhere.
        let least = grid(0.0, end, 500).map(|x| law.coefficient(x)).fold(f64::INFINITY, f64::min);
        prop_assert!(least.abs() < 1e-5 || law.complaints().is_empty() == (least > 0.0));
        prop_assert_eq!((law.ends_at(), law.knots()), (end, &[end][..]));
        if least < 1e-3 {
            return Ok(());
        }
        // A margin that is damped at the end of the law.
        let weight = 100.0;
        let steepest = law.coefficient_and_slope(end).1;
        let damping = weight * (1.0 / end / ratio - steepest.min(0.0));
        hold(&law, end * (1.0 - 1e-9), damping, weight)?;
        series_are_the_law(&law, [x, change[0], change[1]].map(|x| x * end))?;
    }

    #[test]
    fn analytic_the_table_law(
        widths in prop::collection::vec(0.05..2.0f64, 1..8), mu in prop::collection::vec(0.0..1.0f64, 9),
        linear in prop::bool::ANY, ratio in 0.05..2.0f64, ahead in 0.0..3.0f64,
    ) {
        let mut speed = vec![0.0];
        for width in &widths {
            speed.push(speed[speed.len() - 1] + width);
        }
        let mu = mu[..speed.len()].to_vec();
        let interpolation = friction::Interpolation::ALL[usize::from(linear)];
        let table = friction::Table::new(speed.clone(), mu.clone(), interpolation);
        let law = FrictionLaw::from(table);
        prop_assert!(law.complaints().is_empty());
        prop_assert_eq!(law.knots(), &speed[1..]);
        // Through the points, and constant above the last one.
        for (x, y) in speed.iter().zip(&mu) {
            prop_assert!((law.coefficient(*x) - y).abs() < 1e-14);
        }
        let end = speed[speed.len() - 1];
        prop_assert_eq!(law.coefficient_and_slope(end + 1.0), (mu[mu.len() - 1], 0.0));
        // Between two points the curve stays within their coefficients: it adds no extremes.
        for (k, pair) in speed.windows(2).enumerate() {
            let (least, most) = (mu[k].min(mu[k + 1]), mu[k].max(mu[k + 1]));
            let bounds = law.coefficient_bounds(pair[0], pair[1]);
            prop_assert!(bounds.least >= least - 1e-12 && bounds.most <= most + 1e-12, "{bounds:?}");
            let slopes = law.slope_bounds(pair[0], pair[1]);
            let piece = law.continued(k);
            // The last speed of the grid may lie beyond its end by a rounding.
            for x in grid(pair[0], pair[1], 50).skip(1).map(|x| x.min(pair[1])) {
                let (value, slope) = law.coefficient_and_slope(x);
                prop_assert_eq!(value, law.coefficient(x));
                prop_assert!(bounds.least <= value + 1e-12 && value <= bounds.most + 1e-12);
                prop_assert!(slopes.least <= slope + 1e-10 && slope <= slopes.most + 1e-10);
                prop_assert_eq!(piece.coefficient_and_slope(x), (value, slope));
            }
            prop_assert!(piece.knots().is_empty() && piece.coefficient(pair[1] + ahead).is_finite());
            // The series of the whole law is that of its piece at the start, to the rounding of sums of some terms.
            let width = pair[1] - pair[0];
            let x = [f64::midpoint(pair[0], pair[1]), 0.4 * width, 0.05 * width];
            let mut series = law.series::<f64, TERMS>();
            let mut motion = [0.0; TERMS];
            motion[..3].copy_from_slice(&x);
            series.start(x[0], 1.0);
            for n in 1..TERMS {
                series.extend_from(n, &motion);
            }
            let factors = series.factors(1.0, 1.0);
            let of_mu: [f64; TERMS] = std::array::from_fn(|n| factors.shape * series.shape(n));
            let of_slope: [f64; TERMS] = std::array::from_fn(|n| factors.slope * series.slope_shape(n));
            for t in [-1.0, -0.3, 0.5, 1.0] {
                let (value, slope) = law.coefficient_and_slope(taylor::value(&motion, t));
                let found = factors.constant + taylor::value(&of_mu, t);
                prop_assert!((found - value).abs() < 1e-13, "{found} {value}");
                prop_assert!((taylor::value(&of_slope, t) - slope).abs() < 1e-13 / width);
            }
        }
        // The slope of the curve itself has no jumps.
        if !linear {
            for x in &speed[1..speed.len() - 1] {
                let jump = law.coefficient_and_slope(x * (1.0 + 1e-12)).1 - law.coefficient_and_slope(*x).1;
                prop_assert!(jump.abs() < 1e-8, "{jump}");
            }
        }
        // Every change of sign of the margin, in the pieces or at a knot.
        let (damping, weight) = (ratio, 1.0);
        let zeros = law.damping_zeros(damping, weight);
        let margin = |x: f64| damping + weight * law.coefficient_and_slope(x).1;
        let near = |x: f64| zeros.iter().any(|zero| (zero - x).abs() < 1e-6);
        prop_assert!(zeros.windows(2).all(|pair| pair[0] > pair[1]));
        for x in grid(0.0, end, 700).filter(|&x| !near(x)) {
            let above = zeros.iter().filter(|&&zero| zero > x).count();
            prop_assert!((margin(x) >= 0.0) == (above % 2 == 0) || margin(x).abs() < 1e-9, "{} {:?}", x, zeros);
            prop_assert!(margin(x) >= 0.0 || x <= law.damped_from(damping, weight));
        }
    }

    #[test]
    fn analytic_the_stribeck_law_falls_or_rises(
        drop in 0.05..0.5f64, high_speed in 0.1..1.0f64, scale in 0.01..10.0f64, rise in 0.001..1.2f64,
        ratio in 0.2..50.0f64, x in 0.3..4.0f64, change in prop::array::uniform2(-1.5..1.5f64),
    ) {
        let law = Stribeck { low_speed: high_speed + drop, high_speed, scale, exponent: 2.0, viscous: rise * drop / scale };
        let weight = 100.0;
        hold(&law, 8.0 * scale, weight * drop / scale / ratio, weight)?;
        series_are_the_law(&law, [x, change[0], change[1]].map(|x| x * scale))?;
        // The steepest fall, sqrt(2/e) of drop/x_s, against the rise.
        prop_assert_eq!(law.falls(), rise < (2.0 / std::f64::consts::E).sqrt());
    }
}

/// With a rise, sliding is unstable between two speeds, and stable above and below: `damped_from` gives the upper
/// speed.
#[test]
fn analytic_a_law_that_rises_again_restabilises() {
    let law = Stribeck {
        low_speed: 0.6,
        high_speed: 0.3,
        scale: 0.5,
        exponent: 2.0,
        viscous: 0.01,
    };
    let zeros = law.damping_zeros(20.0, 100.0);
    assert_eq!(zeros.len(), 2);
    assert_eq!(law.damped_from(20.0, 100.0), zeros[0]);
    let least = law.coefficient_bounds(0.0, 10.0).least;
    assert!(least < law.coefficient(10.0) && least < law.coefficient(0.0));
}

/// Without damping sliding is unstable at every speed if friction falls, and at none if it does not fall.
#[test]
fn analytic_without_damping_all_speeds_are_alike() {
    let law = |low_speed: f64, decay: f64| exponential(low_speed, 0.3, decay);
    assert_eq!(law(0.6, 5.0).damped_from(0.0, 100.0), f64::INFINITY);
    for still in [law(0.2, 5.0), law(0.3, 5.0), law(0.6, 0.0)] {
        assert_eq!(still.damped_from(0.0, 100.0), 0.0);
        assert!(!still.falls());
    }
}
