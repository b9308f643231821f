//! The effective radius of the contact, equations (6) and (7).

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
