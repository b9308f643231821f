//! The loss of stability of a brake's steady sliding, foreseen.

use super::axial::AxialMotion;
use super::torsion::TorsionModel;
pub(crate) use super::trains::stability::Forecast;
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
