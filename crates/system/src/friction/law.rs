//! The interface of a friction law.

use super::FrictionLaw;
use crate::numerics::Number;
use crate::numerics::taylor::Unfolding;

/// A law mu(x) of the sliding speed x = |omega_r| >= 0, rad/s.
///
/// The law is smooth through x = 0, so that a solver may evaluate it slightly beyond the end of a slip, and between its
/// [`knots`](Self::knots). An infinite speed means the limit at high speed. Bounds need not be attained. Values are those
/// of forward sliding if the law differs in [`backward`](Self::backward) sliding; bounds and scales hold in both. Defaults
/// are those of a law that does not depend on the speed.
pub trait Law {
    /// Taylor coefficients along a motion.
    type Series<T: Number, const N: usize>: LawSeries<T, N>;

    /// mu(x).
    #[inline]
    fn coefficient(&self, x: f64) -> f64 {
        self.coefficient_and_slope(x).0
    }

    /// (mu(x), mu'(x)); mu' in s/rad.
    fn coefficient_and_slope(&self, x: f64) -> (f64, f64);

    /// mu_s, the limit of mu(x) at vanishing speed. A contact at rest must hold as much: mu_0 >= mu_s.
    fn at_vanishing_speed(&self) -> f64;

    /// Friction in backward sliding (omega_r < 0), if it differs from forward sliding; then the law has no knots.
    fn backward(&self) -> Option<Backward> {
        None
    }

    /// Bounds of mu at speeds from `from` to `to` (rad/s, `to` may be infinite).
    fn coefficient_bounds(&self, from: f64, to: f64) -> Bounds;

    /// Bounds of mu' (s/rad) at speeds from `from` to `to` (rad/s, `to` may be infinite).
    fn slope_bounds(&self, _from: f64, _to: f64) -> Bounds {
        Bounds::between(0.0, 0.0)
    }

    /// Bounds of mu for sliding that slows down from `speed` (rad/s): at every speed if the upper bound is finite, else
    /// up to `speed`.
    fn bounds_below(&self, speed: f64) -> Bounds {
        let everywhere = self.coefficient_bounds(0.0, f64::INFINITY);
        if everywhere.most.is_finite() {
            everywhere
        } else {
            self.coefficient_bounds(0.0, speed)
        }
    }

    /// Scale of the friction coefficient for motions with sliding speeds up to `speed` (rad/s): its largest value.
    /// Tolerances and scales follow from it.
    fn typical_coefficient(&self, speed: f64) -> f64 {
        self.coefficient_bounds(0.0, speed).most
    }

    /// Largest speed (rad/s) in figures: six speed scales, or the end of the law. Infinite for a constant law.
    fn extent(&self) -> f64 {
        6.0 / self.steepness_rate(0.0)
    }

    /// Speeds (rad/s, increasing) at which a derivative of the law jumps: no step of an integrator and no series may
    /// cross one. A smooth law has none.
    fn knots(&self) -> &[f64] {
        &[]
    }

    /// Speed (rad/s) beyond which the law is not given: one of its knots, where a run ends with an error. Infinite if
    /// the law is given at every speed.
    fn ends_at(&self) -> f64 {
        f64::INFINITY
    }

    /// The law between the knots `piece` - 1 and `piece`, smoothly continued to all speeds. A law without knots returns
    /// itself.
    fn continued(&self, _piece: usize) -> Self
    where
        Self: Sized + Clone,
    {
        self.clone()
    }

    /// Speeds (rad/s) at which `damping` + `weight` mu'(x) changes its sign, the highest first. For the damping c_t (N
    /// m s/rad) and the weight 2 r F_n (N m) these are the zeros of the stability margin of steady sliding: the
    /// negative damping of falling friction, -2 r F_n mu', outweighs c_t below the first zero, no longer below the
    /// second, and so on.
    fn damping_zeros(&self, _damping: f64, _weight: f64) -> Vec<f64> {
        Vec::new()
    }

    /// Speed (rad/s) above which `damping` + `weight` mu'(x) is never negative; 0 if it never is, infinite if it always
    /// is.
    fn damped_from(&self, damping: f64, weight: f64) -> f64 {
        match self.damping_zeros(damping, weight).first() {
            Some(&highest) => highest,
            None if damping + weight * self.coefficient_and_slope(0.0).1 < 0.0 => f64::INFINITY,
            None => 0.0,
        }
    }

    /// Whether mu falls with speed anywhere. Otherwise it cannot make steady sliding unstable.
    fn falls(&self) -> bool {
        self.slope_bounds(0.0, f64::INFINITY).least < 0.0
    }

    /// Whether mu falls at every speed, by one formula. At high speeds its slope may be zero in doubles.
    fn only_falls(&self) -> bool {
        let slopes = self.slope_bounds(0.0, f64::INFINITY);
        self.knots().is_empty() && slopes.most <= 0.0 && slopes.least < 0.0
    }

    /// Relative rate of change of mu' at `x` and above, s/rad: |mu''| is at most about this times the largest |mu'|
    /// there (alpha for exp(-alpha x)). Its inverse is the speed scale of the law; zero for a constant slope. It
    /// decides on steps and enters no result.
    fn steepness_rate(&self, _x: f64) -> f64 {
        0.0
    }

    /// Largest fall of the speed from `x` (rad/s) in one step of a method of low order: `share` of the speed scale, or,
    /// if the law is flat to rounding, half of the way down to where it is not.
    fn followed_fall(&self, _x: f64, _share: f64) -> f64 {
        f64::INFINITY
    }

    /// Share (0 to 1) of a change of speed `change` (rad/s, either way) from `x` over which some twenty Taylor
    /// coefficients represent the law, with an error shown by the last ones.
    fn expandable_share(&self, _x: f64, _change: f64) -> f64 {
        1.0
    }

    /// Speed (rad/s) below which the derivative of mu of this order may exceed `size` ((s/rad)^order); zero or negative
    /// if it never does.
    fn speed_of_derivative(&self, _order: i32, _size: f64) -> f64 {
        0.0
    }

    /// Memory for the Taylor coefficients along a motion.
    fn series<T: Number, const N: usize>(&self) -> Self::Series<T, N>;
}

/// Taylor coefficients of a law along a motion x(t), computed one by one, in any unit of time and any type of numbers.
///
/// mu(x(t)) is a constant plus a factor times a shape, and mu'(x(t)) a factor times another shape. The work is in the
/// shapes; the [`Factors`] may include factors of the caller.
pub trait LawSeries<T: Number, const N: usize> {
    /// The factors of the law; those of mu are multiplied by `of_coefficient`, that of mu' by `of_slope`.
    fn factors(&self, of_coefficient: T, of_slope: T) -> Factors<T>;

    /// Computes coefficients 0, for a motion with the present speed `x`. Later rates are in multiples of `unit`.
    fn start(&mut self, x: T, unit: T);

    /// Computes coefficients `n` >= 1 from those up to n - 1. `rate` times the unit of [`Self::start`] is coefficient
    /// n - 1 of x', or n times coefficient n of x; `reciprocal` is 1/n.
    fn extend(&mut self, n: usize, rate: T, reciprocal: T);

    /// Like [`Self::extend`] with unit 1, from the coefficients of x up to n.
    fn extend_from(&mut self, n: usize, x: &[T; N]) {
        let order = T::of(n as f64);
        self.extend(n, order * x[n], T::of(1.0) / order);
    }

    /// The shapes of mu and of mu', as far as known; `None` if both are zero.
    fn shapes(&self) -> Option<[&Unfolding<T, N>; 2]>;

    /// Coefficient `n` of the shape of mu, once known.
    #[inline(always)]
    fn shape(&self, n: usize) -> T {
        self.shapes().map_or(T::of(0.0), |[shape, _]| shape.get(n))
    }

    /// Coefficient `n` of the shape of mu', once known.
    #[inline]
    fn slope_shape(&self, n: usize) -> T {
        self.shapes().map_or(T::of(0.0), |[_, slope]| slope.get(n))
    }

    /// Coefficient `n` of the shape of mu times a force, both known up to n. Coefficients of `force` beyond `degree`
    /// are zero; all are finite.
    #[inline(always)]
    fn pressed(&self, force: &[T; N], n: usize, degree: usize) -> T {
        let Some([shape, _]) = self.shapes() else {
            return T::of(0.0);
        };
        let newest = force[0] * shape.get(n);
        match degree.min(n) {
            0 => newest,
            1 => force[1] * shape.get(n - 1) + newest,
            _ => shape.product(force, n, 1, degree) + newest,
        }
    }
}

/// Friction in backward sliding.
#[derive(Debug, Clone, PartialEq)]
pub struct Backward {
    /// mu(x), x = -omega_r; the same in both senses.
    pub law: FrictionLaw,
    /// mu_0, the coefficient at which a stick breaks away into backward sliding.
    pub breakaway: f64,
}

/// Lower and upper bound of a quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// The lower bound.
    pub least: f64,
    /// The upper bound.
    pub most: f64,
}

impl Bounds {
    /// Extended to contain `value`.
    pub fn with(self, value: f64) -> Bounds {
        Bounds {
            least: self.least.min(value),
            most: self.most.max(value),
        }
    }

    /// Bounds of all values between `a` and `b`.
    pub fn between(a: f64, b: f64) -> Bounds {
        Bounds {
            least: a.min(b),
            most: a.max(b),
        }
    }
}

/// Factors from the shapes to mu and mu'.
#[derive(Debug, Clone)]
pub struct Factors<T> {
    /// The part of mu that does not depend on the speed.
    pub constant: T,
    /// Factor of the shape of mu.
    pub shape: T,
    /// Factor of the shape of mu', s/rad.
    pub slope: T,
}
