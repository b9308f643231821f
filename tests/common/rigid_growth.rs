//! Growth along smooth sliding by another way: rotor and surface as one rigid inertia, and the relative mode alone.

use stickslip::friction::Exponential;
use stickslip::model::Parameters;

/// Integral of max(0, Re lambda) from the time `start`, with the relative velocity `speed` there, up to `end` or the stop.
///
/// (I + J) x' = -r mu(x) F and J lambda^2 + (c_t - 2 r F alpha (mu_s - mu_d) exp(-alpha x)) lambda + k_t = 0: it leaves
/// out the twists, the rotor's part in the mode, and the lag of the contact force.
pub fn rigid_growth(parameters: &Parameters, start: f64, speed: f64, end: f64) -> f64 {
    let axial = stickslip::model::axial::AxialMotion::new(&parameters.axial, &parameters.actuation);
    let force = |t: f64| axial.force.value(t).max(0.0);
    let (torsion, friction, r) = (parameters.torsion, &parameters.friction, parameters.contact.radius);
    let &Exponential {
        low_speed,
        high_speed,
        decay,
    } = friction.law.as_exponential().unwrap();
    let friction_drop = low_speed - high_speed;
    let mu = |x: f64| high_speed + friction_drop * (-decay * x.max(0.0)).exp();
    let inertia = torsion.rotor_inertia + torsion.surface_inertia;
    let slope = |t: f64, x: f64| -r * mu(x) * force(t) / inertia;
    let rate = |t: f64, x: f64| {
        let falling = 2.0 * r * force(t) * decay * friction_drop * (-decay * x.max(0.0)).exp();
        let damping = torsion.damping - falling;
        let half = -damping / (2.0 * torsion.surface_inertia);
        let real = half * half - torsion.stiffness / torsion.surface_inertia;
        if half > 0.0 { half + real.max(0.0).sqrt() } else { 0.0 }
    };
    let (mut t, mut x, mut sum) = (start, speed.abs(), 0.0);
    // A ten-thousandth of the speed, and of a corner's distance in these tests.
    let longest = 1e-4 * (end - start).clamp(0.01, 1.0);
    while x > 1e-4 * speed.abs() && t < end {
        let step = (1e-4 * speed.abs() / slope(t, x).abs()).min(longest).min(end - t);
        let middle = x + 0.5 * step * slope(t, x);
        let next = x + step * slope(t + 0.5 * step, middle);
        sum += 0.5 * step * (rate(t, x) + rate(t + step, next));
        (t, x) = (t + step, next);
        if t + step <= t {
            break;
        }
    }
    sum
}
