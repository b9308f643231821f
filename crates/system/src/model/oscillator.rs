//! The free damped oscillator in closed form, uniform in the damping ratio.

use crate::numerics::{Number, taylor};

/// Terms of the series for [`DampedOscillator::lag`]. Over 0.1 of the time of the fastest motion the error is
/// 0.1^13/13!.
const LAG_TERMS: u32 = 14;

/// q'' + 2 sigma q' + omega0^2 q = 0, with sigma >= 0 (1/s) and omega0 > 0 (rad/s).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DampedOscillator<T = f64> {
    sigma: T,
    omega0_squared: T,
}

impl<T: Number> DampedOscillator<T> {
    /// The oscillator m q'' + c q' + k q = 0 with this mass, damping and stiffness.
    pub fn new(mass: T, damping: T, stiffness: T) -> Self {
        DampedOscillator {
            sigma: damping / (T::of(2.0) * mass),
            omega0_squared: stiffness / mass,
        }
    }

    /// (q, q') at a time `tau` >= 0 (s) after (q, q') = (`q`, `rate`).
    pub fn advance(&self, q: T, rate: T, tau: T) -> (T, T) {
        let (c, s) = self.kernel(tau);
        (
            c * q + s * (rate + self.sigma * q),
            c * rate - s * (self.omega0_squared * q + self.sigma * rate),
        )
    }

    /// tau - S(tau) (s) and its rate for a short `tau` (s), from a series. S is the response to (q, q') = (0, 1). A
    /// force of slope 1 leads its response by this difference.
    pub fn lag(&self, tau: T) -> (T, T) {
        let (mut last, mut term) = (T::of(0.0), tau);
        let (mut lag, mut rate) = (T::of(0.0), T::of(0.0));
        for n in 2..LAG_TERMS {
            let [order, before] = [n, n - 1].map(|n| T::of(f64::from(n)));
            let damped = T::of(2.0) * self.sigma * before * tau * term;
            let next = -(damped + self.omega0_squared * tau * tau * last) / (order * before);
            (last, term) = (term, next);
            lag = lag - next;
            rate = rate - order * next;
        }
        (lag, rate / tau)
    }

    /// q'' at (q, q').
    pub fn curvature(&self, (q, rate): (T, T)) -> T {
        T::of(-2.0) * self.sigma * rate - self.omega0_squared * q
    }

    /// Fills `out` with Taylor coefficients of q, by powers of time over `unit` (s), from (q, q') = (`q`, `rate`).
    pub fn series(&self, q: T, rate: T, unit: T, out: &mut [T]) {
        taylor::damped_oscillation(
            self.sigma * unit,
            self.omega0_squared * unit * unit,
            q,
            rate * unit,
            out,
        );
    }

    /// The slowest rate of decay, 1/s.
    pub(crate) fn slowest_decay(&self) -> T {
        let discriminant = self.omega0_squared - self.sigma * self.sigma;
        if discriminant >= T::of(0.0) {
            self.sigma
        } else {
            // sigma - sqrt(sigma^2 - omega0^2) without cancellation.
            self.omega0_squared / (self.sigma + (-discriminant).sqrt())
        }
    }

    /// exp(-sigma tau) times (cos w tau, sin(w tau)/w). Above critical damping these are hyperbolic functions, at
    /// critical damping their common limit.
    fn kernel(&self, tau: T) -> (T, T) {
        let [one, two] = [1.0, 2.0].map(T::of);
        let discriminant = self.omega0_squared - self.sigma * self.sigma;
        let x = discriminant * tau * tau;
        if x.is_within(1e-7) {
            let decay = (-self.sigma * tau).exp();
            return (
                decay * (one - x / two + x * x / T::of(24.0)),
                decay * tau * (one - x / T::of(6.0) + x * x / T::of(120.0)),
            );
        }
        if discriminant > T::of(0.0) {
            let w = discriminant.sqrt();
            let decay = (-self.sigma * tau).exp();
            let (sin, cos) = (w * tau).sin_cos();
            (decay * cos, decay * sin / w)
        } else {
            let w = (-discriminant).sqrt();
            // The exponents are joined, so that strong damping neither overflows nor cancels.
            let slow = (-self.slowest_decay() * tau).exp();
            let gap = -(T::of(-2.0) * w * tau).exp_m1();
            (slow * (two - gap) / two, slow * gap / (two * w))
        }
    }
}
