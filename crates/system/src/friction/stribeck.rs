//! Stribeck's curve: an exponential of a power of the sliding speed, and a rising viscous part.

use super::parameters::{HIGH_SPEED, LOW_SPEED, LawParameter, LawValue, SCALE, numbers};
use super::{Bounds, Factors, Law, LawSeries};
use crate::numerics::Number;
use crate::numerics::bisection::bisect;
use crate::numerics::taylor::{Unfolding, zeros};

const LARGEST_EXPONENT: usize = 4;

/// Value of u^delta from which on exp(-u^delta) is below the rounding of the rest.
const FLAT: f64 = 40.0;

/// Largest change of the exponential, in e-folds over delta, over the reach of its Taylor coefficients: as in
/// [`super::Exponential`], and less because the terms of a higher power fall more slowly.
const E_FOLDS: f64 = 6.0;

const NEGLIGIBLE: f64 = 1e-18;

/// The largest |d^2 exp(-u^delta)/du^2| at u >= 0, rounded up, for delta = 1 to 4.
const LARGEST_CURVATURE: [f64; LARGEST_EXPONENT] = [1.0, 2.0, 2.16, 3.84];

/// mu(x) = mu_d + (mu_s - mu_d) exp(-(x/x_s)^delta) + mu_v x, x = |omega_r|. With delta = 2 it is flat at rest, falls,
/// and with mu_v rises again. With delta = 1 and mu_v = 0 it is the exponential law with alpha = 1/x_s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stribeck {
    /// mu_s, the limit at vanishing sliding speed.
    pub low_speed: f64,
    /// mu_d, the limit of the falling part at high speed.
    pub high_speed: f64,
    /// x_s, Stribeck's speed, rad/s.
    pub scale: f64,
    /// delta, a whole number: otherwise the law has no Taylor series at rest.
    pub exponent: f64,
    /// mu_v, s/rad.
    pub viscous: f64,
}

numbers!(Stribeck, "stribeck", at rest low_speed:
    low_speed = LOW_SPEED, high_speed = HIGH_SPEED, scale = SCALE,
    exponent = LawParameter::new(LawValue::Positive, 0,
        "delta, power of the sliding speed over the scale in the exponential; 1, 2, 3 or 4").or("2"),
    viscous = LawParameter::new(LawValue::NotNegative, -1,
        "mu_v, rise of the friction coefficient with sliding speed").or("0");
    complaints |law| law.wrong_exponent());

impl Stribeck {
    fn wrong_exponent(&self) -> Vec<(String, String)> {
        let whole = (1..=LARGEST_EXPONENT).any(|delta| delta as f64 == self.exponent);
        let message = || {
            format!(
                "must be 1, 2, 3 or 4, but is {:?}: with any other the law has no Taylor series at standstill, where slips begin \
                 and end, and no method keeps its accuracy there; take a whole number, or law = \"table\" with points of the curve",
                self.exponent
            )
        };
        if whole {
            Vec::new()
        } else {
            vec![("exponent".to_owned(), message())]
        }
    }

    #[inline]
    fn power(&self) -> usize {
        (self.exponent.round() as usize).clamp(1, LARGEST_EXPONENT)
    }

    /// u to the power of delta + `less` (0 or -1). Sensitivities take differences by delta, so it need not be whole.
    #[inline]
    fn raised(&self, u: f64, less: i32) -> f64 {
        let power = self.power();
        if power as f64 == self.exponent {
            u.powi(power as i32 + less)
        } else {
            u.max(0.0).powf(self.exponent + f64::from(less))
        }
    }

    #[inline]
    fn friction_drop(&self) -> f64 {
        self.low_speed - self.high_speed
    }

    /// -d exp(-u^delta)/du at u = x/x_s: rises from 0 (1 for delta = 1) to the steepest speed, then falls to 0.
    #[inline]
    fn fall(&self, x: f64) -> f64 {
        let u = x / self.scale;
        let before = self.raised(u, -1);
        let exponential = (-before * u).exp();
        if exponential == 0.0 {
            0.0
        } else {
            self.exponent * before * exponential
        }
    }

    #[inline]
    fn slope(&self, x: f64) -> f64 {
        self.viscous - self.friction_drop() / self.scale * self.fall(x)
    }

    /// The speed at which the exponential falls fastest, rad/s: mu'' = 0.
    fn steepest(&self) -> f64 {
        self.scale * ((self.exponent - 1.0) / self.exponent).powf(1.0 / self.exponent)
    }

    fn flat_from(&self) -> f64 {
        self.scale * FLAT.powf(1.0 / self.exponent)
    }

    fn sign_changes(&self, damping: f64, weight: f64) -> Vec<f64> {
        let value = |x: f64| damping + weight * self.slope(x);
        let steepest = self.steepest();
        let between = |from: f64, to: f64| {
            let sign = |x: f64| value(x) > 0.0;
            if value(from) == 0.0 || value(to) == 0.0 || sign(from) == sign(to) {
                return None;
            }
            let (a, b) = bisect(from, to, usize::MAX, |x| sign(x) == sign(from));
            Some(if value(a).abs() < value(b).abs() { a } else { b })
        };
        // Above this speed the slope is mu_v to the last digit.
        let high = 20.0 * self.flat_from();
        [between(high, steepest), between(steepest, 0.0)]
            .into_iter()
            .flatten()
            .collect()
    }
}

impl Law for Stribeck {
    type Series<T: Number, const N: usize> = StribeckSeries<T, N>;

    #[inline]
    fn coefficient_and_slope(&self, x: f64) -> (f64, f64) {
        let share = self.raised(x / self.scale, 0);
        let coefficient = self.high_speed + self.friction_drop() * (-share).exp() + self.viscous * x;
        (coefficient, self.slope(x))
    }

    fn at_vanishing_speed(&self) -> f64 {
        self.low_speed
    }

    /// At the ends, or at a zero of the slope.
    fn coefficient_bounds(&self, from: f64, to: f64) -> Bounds {
        let at = |x: f64| match x {
            0.0 => self.low_speed,
            f64::INFINITY if self.viscous == 0.0 => self.high_speed,
            f64::INFINITY => f64::INFINITY,
            _ => self.coefficient(x),
        };
        let inside = self
            .sign_changes(0.0, 1.0)
            .into_iter()
            .filter(|x| (from..to).contains(x));
        inside.map(at).fold(Bounds::between(at(from), at(to)), Bounds::with)
    }

    /// At the ends, or at the steepest speed.
    fn slope_bounds(&self, from: f64, to: f64) -> Bounds {
        let at = |x: f64| if x.is_infinite() { self.viscous } else { self.slope(x) };
        let ends = Bounds::between(at(from), at(to));
        let steepest = self.steepest();
        match (from..to).contains(&steepest) {
            true => ends.with(at(steepest)),
            false => ends,
        }
    }

    /// At most two: below the upper one the falling part outweighs the damping, below the lower one the law is flat
    /// again.
    fn damping_zeros(&self, damping: f64, weight: f64) -> Vec<f64> {
        self.sign_changes(damping, weight)
    }

    /// The slope at rest may be zero, so the steepest slope decides.
    fn damped_from(&self, damping: f64, weight: f64) -> f64 {
        match self.damping_zeros(damping, weight).first() {
            Some(&highest) => highest,
            None if damping + weight * self.slope(self.steepest()) < 0.0 => f64::INFINITY,
            None => 0.0,
        }
    }

    fn steepness_rate(&self, _: f64) -> f64 {
        let drop = self.friction_drop().abs();
        if drop == 0.0 {
            return 0.0;
        }
        let curvature = drop / (self.scale * self.scale) * LARGEST_CURVATURE[self.power() - 1];
        let slope = self.slope(self.steepest()).abs().max(self.viscous.abs());
        curvature / slope
    }

    #[inline]
    fn followed_fall(&self, x: f64, share: f64) -> f64 {
        (share * self.scale / self.exponent).max(0.5 * (x - self.flat_from()))
    }

    /// A change by some e-folds of the exponential, or until it is negligible.
    fn expandable_share(&self, x: f64, change: f64) -> f64 {
        let u = (x / self.scale).max(0.0);
        let here = self.raised(u, 0);
        let allowed = (here + NEGLIGIBLE.ln()).max(E_FOLDS / self.exponent);
        let reach = self.scale * ((here + allowed).powf(1.0 / self.exponent) - u);
        if change <= reach { 1.0 } else { reach / change }
    }

    /// By the leading power of u in the derivative of the exponential.
    fn speed_of_derivative(&self, order: i32, size: f64) -> f64 {
        let drop = self.friction_drop().abs();
        if drop == 0.0 {
            return 0.0;
        }
        let n = f64::from(order);
        let at_rest = (drop / size).ln() + n * (self.exponent / self.scale).ln();
        let mut u = at_rest.max(0.0).powf(1.0 / self.exponent);
        for _ in 0..4 {
            let power = n * (self.exponent - 1.0) * u.max(1.0).ln();
            u = (at_rest + power).max(0.0).powf(1.0 / self.exponent);
        }
        self.scale * u
    }

    /// The speed at which the exponential is e^-6 of its value at rest.
    fn extent(&self) -> f64 {
        self.scale * 6f64.powf(1.0 / self.exponent)
    }

    fn series<T: Number, const N: usize>(&self) -> StribeckSeries<T, N> {
        let drop = T::of(self.low_speed) - T::of(self.high_speed);
        let scale = T::of(self.scale);
        StribeckSeries {
            high_speed: T::of(self.high_speed),
            slope_factor: -(drop * T::of(self.exponent) / scale),
            friction_drop: drop,
            viscous: T::of(self.viscous),
            // mu_v x = mu_v x_s u
            viscous_share: T::of(self.viscous) * scale,
            per_scale: T::of(1.0) / scale,
            step: T::of(0.0),
            power: self.power(),
            ratio: Unfolding::new(),
            powers: std::array::from_fn(|_| zeros()),
            exponent_rate: zeros(),
            exponential: Unfolding::new(),
            coefficient: Unfolding::new(),
            slope: Unfolding::new(),
        }
    }
}

/// Taylor coefficients of mu - mu_d and of mu', from u = x/x_s, its powers, and e = exp(a) with e' = a' e.
#[derive(Debug, Clone)]
pub struct StribeckSeries<T, const N: usize> {
    high_speed: T,
    friction_drop: T,
    /// -(mu_s - mu_d) delta/x_s.
    slope_factor: T,
    viscous: T,
    viscous_share: T,
    per_scale: T,
    step: T,
    power: usize,
    ratio: Unfolding<T, N>,
    /// u, u^2, ... up to u^delta.
    powers: [[T; N]; LARGEST_EXPONENT],
    /// k times coefficient k of -u^delta.
    exponent_rate: [T; N],
    exponential: Unfolding<T, N>,
    coefficient: Unfolding<T, N>,
    slope: Unfolding<T, N>,
}

impl<T: Number, const N: usize> StribeckSeries<T, N> {
    /// Coefficients n of the powers of u, from that of u.
    #[inline(always)]
    fn raise(&mut self, n: usize, of_ratio: T) {
        self.ratio.set(n, of_ratio);
        self.powers[0][n] = of_ratio;
        for k in 1..self.power {
            self.powers[k][n] = self.ratio.product(&self.powers[k - 1], n, 0, n);
        }
    }

    #[inline(always)]
    fn complete(&mut self, n: usize) {
        let exponential = self.exponential.get(n);
        let rise = self.viscous_share * self.powers[0][n];
        self.coefficient.set(n, self.friction_drop * exponential + rise);
        let falling = match self.power {
            1 => exponential,
            power => self.exponential.product(&self.powers[power - 2], n, 0, n),
        };
        let falling = self.slope_factor * falling;
        self.slope.set(n, if n == 0 { falling + self.viscous } else { falling });
    }
}

impl<T: Number, const N: usize> LawSeries<T, N> for StribeckSeries<T, N> {
    #[inline(always)]
    fn factors(&self, of_coefficient: T, of_slope: T) -> Factors<T> {
        Factors {
            constant: of_coefficient * self.high_speed,
            shape: of_coefficient,
            slope: of_slope,
        }
    }

    #[inline(always)]
    fn start(&mut self, x: T, unit: T) {
        self.step = unit * self.per_scale;
        // Leftovers of another motion may not be finite.
        self.powers = std::array::from_fn(|_| zeros());
        self.exponent_rate = zeros();
        self.raise(0, x * self.per_scale);
        self.exponential.set(0, (-self.powers[self.power - 1][0]).exp());
        self.complete(0);
    }

    #[inline(always)]
    fn extend(&mut self, n: usize, rate: T, reciprocal: T) {
        self.raise(n, self.step * rate * reciprocal);
        let newest = -(T::of(n as f64) * self.powers[self.power - 1][n]);
        self.exponential
            .exponential(&mut self.exponent_rate, n, newest, reciprocal);
        self.complete(n);
    }

    #[inline(always)]
    fn shapes(&self) -> Option<[&Unfolding<T, N>; 2]> {
        Some([&self.coefficient, &self.slope])
    }
}
