//! The loss of stability of a brake's steady sliding, foreseen.

use super::axial::AxialMotion;
use super::torsion::TorsionModel;
pub(crate) use super::trains::stability::{Forecast, QuietStretch};
use crate::friction::Law;

impl Forecast {
    /// Of the slip at `t` (s) with this relative velocity (rad/s), as far as `until` (s).
    pub fn new(model: &TorsionModel, axial: &AxialMotion, t: f64, relative_velocity: f64, until: f64) -> Self {
        let sense = if relative_velocity < 0.0 { -1.0 } else { 1.0 };
        let inertia = model.torsion.rigid_inertia();
        let surface = model.torsion.surface_inertia;
        let radius = model.contact.radius;
        let slowing =
            |t: f64, x: f64| model.friction.law.coefficient(x) * radius * axial.force.value(t).max(0.0) / inertia;
        let margin = |t: f64, x: f64| model.stability_margin(1.0, x, axial.force.value(t).max(0.0));
        let decay = |t: f64, x: f64| {
            let margin = margin(t, x);
            (margin >= 0.0).then_some(margin / (2.0 * surface))
        };
        let corner = |t: f64| axial.force.next_corner(t);
        let start = (t, sense * relative_velocity);
        Self::follow(&model.friction.law, start, until, slowing, decay, corner)
    }
}

impl QuietStretch {
    /// Of the slip at `t` with this relative velocity (rad/s).
    pub fn new(model: &TorsionModel, axial: &AxialMotion, t: f64, relative_velocity: f64) -> Self {
        let (torsion, law) = (&model.torsion, &model.friction.law);
        let inertia = torsion.rigid_inertia();
        let (least, most) = (
            axial.lowest_pressing_force_after(t).max(0.0),
            axial.highest_pressing_force_after(t).max(0.0),
        );
        let weight = model.slope_weight(most);
        let coefficient = law.bounds_below(relative_velocity.abs());
        // -2 r F_n mu', the most that falling friction takes from the margin
        let negative_damping = -weight * law.slope_bounds(0.0, f64::INFINITY).least;
        // Below this speed the margin may be less than c_t (1 - part).
        let critical = |part: f64| law.damped_from(part * torsion.damping, weight);
        let slowing = |mu: f64, force: f64| mu * model.contact.radius * force / inertia;
        let fastest = slowing(coefficient.most, most);
        let half = critical(0.5);
        let until = if half > 0.0 {
            t + 0.9 * (relative_velocity.abs() - half) / fastest
        } else {
            f64::INFINITY
        };
        let unstable = critical(1.0);
        let growth = if unstable > 0.0 {
            let slowest = slowing(coefficient.least, least);
            // A real pair grows at most twice as fast as its mean.
            1.2 * (negative_damping - torsion.damping) / torsion.surface_inertia * unstable / slowest
        } else {
            0.0
        };
        QuietStretch {
            until,
            damping: torsion.damping / (4.0 * torsion.surface_inertia),
            growth,
            time_scale_ratio: negative_damping / torsion.stiffness * law.steepness_rate(0.0) * fastest,
        }
    }
}
