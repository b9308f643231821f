//! The friction law (8) and the effective radii (6) and (7).

use super::Friction;

/// Below this exponent exp is zero in doubles, which it takes long to find.
const NOTHING: f64 = -746.0;

impl Friction {
    /// (mu_s - mu_d) exp(-alpha x): what mu(x) is above mu_d.
    #[inline]
    fn weakening(&self, x: f64) -> f64 {
        let exponent = -self.decay * x;
        if exponent < NOTHING {
            return 0.0;
        }
        (self.low_speed - self.high_speed) * exponent.exp()
    }

    /// mu(x), equation (8), at sliding speed x = |omega_r| in rad/s. Smooth through x = 0, so that a solver may
    /// evaluate it beyond the end of a slip.
    #[inline]
    pub fn coefficient(&self, x: f64) -> f64 {
        self.high_speed + self.weakening(x)
    }

    /// (mu(x), mu'(x)); mu' in s/rad.
    #[inline]
    pub fn coefficient_and_slope(&self, x: f64) -> (f64, f64) {
        let weakening = self.weakening(x);
        (self.high_speed + weakening, -self.decay * weakening)
    }
}

/// r = (D + d)/4, uniform wear, equation (6); diameters and radius in m.
pub fn uniform_wear_radius(outer_diameter: f64, inner_diameter: f64) -> f64 {
    (outer_diameter + inner_diameter) / 4.0
}

/// r = (D^3 - d^3) / (3 (D^2 - d^2)), uniform pressure, equation (7); diameters and radius in m.
///
/// Evaluated as (D^2 + D d + d^2) / (3 (D + d)), which does not lose digits for narrow rings.
pub fn uniform_pressure_radius(outer_diameter: f64, inner_diameter: f64) -> f64 {
    let (outer, inner) = (outer_diameter, inner_diameter);
    (outer * outer + outer * inner + inner * inner) / (3.0 * (outer + inner))
}
