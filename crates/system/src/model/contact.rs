//! Effective radius of the contact, equations (6) and (7), in doubles or exact numbers.

use num_traits::Num;

/// r = (D + d)/4, uniform wear, equation (6). Diameters and radius are in m.
pub fn uniform_wear_radius<T: Num + Clone>(outer_diameter: T, inner_diameter: T) -> T {
    let two = T::one() + T::one();
    (outer_diameter + inner_diameter) / (two.clone() * two)
}

/// r = (D^3 - d^3) / (3 (D^2 - d^2)), uniform pressure, equation (7). Diameters and radius are in m.
///
/// The common factor D - d is divided out, so that nothing cancels for narrow rings.
pub fn uniform_pressure_radius<T: Num + Clone>(outer_diameter: T, inner_diameter: T) -> T {
    let (outer, inner) = (outer_diameter, inner_diameter);
    let share = inner.clone() / (outer.clone() + inner.clone());
    (outer + inner * share) / (T::one() + T::one() + T::one())
}
