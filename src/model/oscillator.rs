//! The free damped oscillator in closed form, uniform in the damping ratio.

use crate::numerics::{Number, taylor};

/// q'' + 2 sigma q' + omega0^2 q = 0, with sigma >= 0 (1/s) and omega0 > 0 (rad/s).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DampedOscillator<T = f64> {
    sigma: T,
    omega0_squared: T,
}

impl<T: Number> DampedOscillator<T> {
    /// From mass, damping and stiffness of m q'' + c q' + k q = 0.
    pub fn new(mass: T, damping: T, stiffness: T) -> Self {
        DampedOscillator {
            sigma: damping / (T::of(2.0) * mass),
            omega0_squared: stiffness / mass,
        }
    }

    /// (q, q') a time `tau >= 0` after (q, q') = (`q`, `rate`).
    pub fn advance(&self, q: T, rate: T, tau: T) -> (T, T) {
        let (c, s) = self.kernel(tau);
        (
            c * q + s * (rate + self.sigma * q),
            c * rate - s * (self.omega0_squared * q + self.sigma * rate),
        )
    }

    /// q'' of (q, q').
    pub fn curvature(&self, (q, rate): (T, T)) -> T {
        T::of(-2.0) * self.sigma * rate - self.omega0_squared * q
    }

    /// The Taylor coefficients of q by powers of time over `unit` (s) from (q, q') = (`q`, `rate`), as many as `out` holds.
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
            // sigma - sqrt(sigma^2 - omega0^2) without cancellation
            self.omega0_squared / (self.sigma + (-discriminant).sqrt())
        }
    }

    /// exp(-sigma tau) times (cos w tau, sin(w tau)/w), with the hyperbolic functions above critical damping and
    /// their common limit at it.
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
            // exponents joined, so that strong damping neither overflows nor cancels
            let slow = (-self.slowest_decay() * tau).exp();
            let gap = -(T::of(-2.0) * w * tau).exp_m1();
            (slow * (two - gap) / two, slow * gap / (two * w))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// The flow composes: advancing twice equals advancing once, in every damping regime.
        #[test]
        fn property_advance_composes(damping in 0.0..6.0f64, first in 0.0..3.0f64, second in 0.0..3.0f64) {
            let o = DampedOscillator::new(1.0, damping, 1.0);
            let (q, r) = o.advance(0.3, -0.7, first);
            let (q, r) = o.advance(q, r, second);
            let (q1, r1) = o.advance(0.3, -0.7, first + second);
            prop_assert!((q - q1).abs() < 1e-14 && (r - r1).abs() < 1e-14);
        }
    }

    #[test]
    fn analytic_critical_damping_is_the_limit_of_both_sides() {
        let critical = DampedOscillator::new(1.0, 2.0, 1.0).advance(1.0, 0.5, 2.0);
        let exact = (-2.0f64).exp() * (1.0 + 1.5 * 2.0);
        assert!((critical.0 - exact).abs() < 1e-15);
        for damping in [2.0 - 1e-9, 2.0 + 1e-9] {
            let near = DampedOscillator::new(1.0, damping, 1.0).advance(1.0, 0.5, 2.0);
            assert!((near.0 - exact).abs() < 1e-8);
        }
    }
}
