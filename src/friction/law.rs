//! The interface of a friction law.

use crate::numerics::Number;
use crate::numerics::taylor::Unfolding;

/// A law mu(x) of the sliding speed x = |omega_r| >= 0, rad/s.
///
/// The law is smooth through x = 0, so that a solver may evaluate it a little beyond the end of a slip, and between its
/// [`knots`](Self::knots). A speed of infinity stands for the limit at high speed. What a method calls a bound need not be
/// attained.
pub trait Law {
    /// Its Taylor coefficients along a motion.
    type Series<T: Number, const N: usize>: LawSeries<T, N>;

    /// mu(x).
    fn coefficient(&self, x: f64) -> f64;

    /// (mu(x), mu'(x)); mu' in s/rad.
    fn coefficient_and_slope(&self, x: f64) -> (f64, f64);

    /// mu_s, the limit of mu(x) at vanishing speed. A contact at rest must hold as much: mu_0 >= mu_s.
    fn at_vanishing_speed(&self) -> f64;

    /// Bounds of mu at speeds from `from` to `to` (rad/s, `to` may be infinite).
    fn coefficient_bounds(&self, from: f64, to: f64) -> Bounds;

    /// Bounds of mu' (s/rad) at speeds from `from` to `to` (rad/s, `to` may be infinite).
    fn slope_bounds(&self, from: f64, to: f64) -> Bounds;

    /// Bounds of mu (as [`Self::coefficient_bounds`]) for sliding that slows down from `speed` (rad/s): at every speed where
    /// that has an upper bound, else at those up to `speed`.
    fn bounds_below(&self, speed: f64) -> Bounds {
        let everywhere = self.coefficient_bounds(0.0, f64::INFINITY);
        if everywhere.most.is_finite() {
            everywhere
        } else {
            self.coefficient_bounds(0.0, speed)
        }
    }

    /// The coefficient by which friction is measured in a motion with sliding speeds up to `speed` (rad/s): the largest one.
    /// Tolerances and scales are made of it. What the law is beyond the speeds of a motion is no scale of the motion.
    fn typical_coefficient(&self, speed: f64) -> f64 {
        self.coefficient_bounds(0.0, speed).most
    }

    /// The speed (rad/s) up to which a figure shows the law: six of its scales, or where it ends. Infinite for a law that is the
    /// same at every speed.
    fn extent(&self) -> f64 {
        6.0 / self.steepness_rate(0.0)
    }

    /// The speeds (rad/s, increasing) at which some derivative of the law jumps: no step of an integrator and no series may
    /// cross one. A smooth law has none.
    fn knots(&self) -> &[f64] {
        &[]
    }

    /// The speed (rad/s) beyond which the law is not given: one of its knots, and the end of a run that gets there. Infinite
    /// for a law that is given at every speed.
    fn ends_at(&self) -> f64 {
        f64::INFINITY
    }

    /// The law that goes on smoothly from between the knots `piece` - 1 and `piece` to all speeds. Without knots it is itself.
    fn continued(&self, _piece: usize) -> Self
    where
        Self: Sized + Clone,
    {
        self.clone()
    }

    /// The speeds (rad/s) at which `damping` + `weight` mu'(x) changes its sign, the highest first. With c_t for the damping
    /// (N m s/rad) and 2 r F_n for the weight (N m) these are the zeros of the stability margin of steady sliding: where the
    /// negative damping of falling friction, -2 r F_n mu', outweighs c_t below the first of them, it no longer does below the
    /// second, and so on.
    fn damping_zeros(&self, damping: f64, weight: f64) -> Vec<f64>;

    /// The speed (rad/s) from which on `damping` + `weight` mu'(x) is never negative; 0 if it nowhere is, infinite if it is
    /// at every speed.
    fn damped_from(&self, damping: f64, weight: f64) -> f64 {
        match self.damping_zeros(damping, weight).first() {
            Some(&highest) => highest,
            None if damping + weight * self.coefficient_and_slope(0.0).1 < 0.0 => f64::INFINITY,
            None => 0.0,
        }
    }

    /// Whether mu falls with speed anywhere. A law that does not cannot make steady sliding unstable.
    fn falls(&self) -> bool {
        self.slope_bounds(0.0, f64::INFINITY).least < 0.0
    }

    /// How fast mu' changes with speed at `x` and above, s/rad: |mu''| is at most about this times the largest |mu'| there,
    /// alpha for exp(-alpha x). Its inverse is the law's speed scale: over that, its slope changes by a factor of e. Zero
    /// for a law with a constant slope. It decides on steps, and enters no result.
    fn steepness_rate(&self, x: f64) -> f64;

    /// How far the speed may fall from `x` (rad/s) in one step of a method of low order that is to follow the law: by
    /// `share` of its speed scale, or, where the law is flat to rounding, half of the way down to where it no longer is.
    fn followed_fall(&self, x: f64, share: f64) -> f64;

    /// Up to which share (in 0 to 1) of a change of speed `change` (rad/s, either way) from `x` the law may be taken from
    /// some twenty Taylor coefficients, whose last ones then say what is left out.
    fn expandable_share(&self, x: f64, change: f64) -> f64;

    /// The speed (rad/s) below which the derivative of mu of this order may be larger than `size` (in (s/rad)^order); zero
    /// or negative where it never is.
    fn speed_of_derivative(&self, order: i32, size: f64) -> f64;

    /// Room for its Taylor coefficients along a motion, of which none is known yet.
    fn series<T: Number, const N: usize>(&self) -> Self::Series<T, N> {
        self.series_in(&mut T::of)
    }

    /// The same with parameters that `number` makes of those in doubles, asked for one after the other and always in the same order.
    fn series_in<T: Number, const N: usize>(&self, number: &mut impl FnMut(f64) -> T) -> Self::Series<T, N>;

    /// Whether the coefficients of both follow by the same steps, each with its own parameters.
    fn is_alike(&self, other: &Self) -> bool;
}

/// The Taylor coefficients of a law along a motion x(t), made known one by one, by powers of time in any unit, for any
/// type of numbers.
///
/// mu(x(t)) is a constant plus a factor times a shape, and mu'(x(t)) is a factor times another shape: the shapes'
/// coefficients are what takes the work, and the [`Factors`] may take those of the caller in.
pub trait LawSeries<T: Number, const N: usize> {
    /// The factors of the law, times `of_coefficient` those of mu and times `of_slope` that of mu'.
    fn factors(&self, of_coefficient: T, of_slope: T) -> Factors<T>;

    /// Makes coefficients 0 known, of a motion at the speed `x` now. The rates that follow are in multiples of `unit`.
    fn start(&mut self, x: T, unit: T);

    /// Makes coefficients `n` >= 1 known, when those up to n - 1 are. `rate` times the unit of [`Self::start`] is
    /// coefficient n - 1 of x', or n times coefficient n of x; `reciprocal` is 1/n.
    fn extend(&mut self, n: usize, rate: T, reciprocal: T);

    /// The same from the coefficients of x up to n, where the unit of [`Self::start`] is 1.
    fn extend_from(&mut self, n: usize, x: &[T; N]) {
        let order = T::of(n as f64);
        self.extend(n, order * x[n], T::of(1.0) / order);
    }

    /// The shapes of mu and of mu', as far as they are known; `None` where both are zero.
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

    /// Coefficient `n` of the shape of mu times a force, both known up to n. Coefficients of `force` beyond `degree` are zero,
    /// and all are finite.
    #[inline(always)]
    fn pressed(&self, force: &[T; N], n: usize, degree: usize) -> T {
        let Some([shape, _]) = self.shapes() else {
            return T::of(0.0);
        };
        let newest = force[0] * shape.get(n);
        match degree.min(n) {
            0 => newest,
            // A straight line, as F_n is once the axial motion has died away.
            1 => force[1] * shape.get(n - 1) + newest,
            _ => shape.product(force, n, 1, degree) + newest,
        }
    }
}

/// What a quantity is at least and at most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// The lower bound.
    pub least: f64,
    /// The upper bound.
    pub most: f64,
}

impl Bounds {
    /// Of these and a value.
    pub fn with(self, value: f64) -> Bounds {
        Bounds {
            least: self.least.min(value),
            most: self.most.max(value),
        }
    }

    /// Of all between two values.
    pub fn between(a: f64, b: f64) -> Bounds {
        Bounds {
            least: a.min(b),
            most: a.max(b),
        }
    }
}

/// What makes mu and mu' of their shapes.
#[derive(Debug, Clone)]
pub struct Factors<T> {
    /// The part of mu that does not depend on the speed.
    pub constant: T,
    /// Of the shape of mu.
    pub shape: T,
    /// Of the shape of mu', s/rad.
    pub slope: T,
}
