//! How far samples miss the equations of a case, each in its integral form over a stretch.
//!
//! | equation | what it holds |
//! |---|---|
//! | rotor | I theta'' = -T_r |
//! | surfaces, in slip | J phi_2'' = T_r - s mu r F_n and J phi_1'' = s mu r F_n - T_s |
//! | pair, in stick | J (phi_1'' + phi_2'') = T_r - T_s |
//! | twists | u' and v' are the rates of u and v: an integrator's error shows here, another parameter does not |
//! | axial | m z'' = -F - c_a z' - k_e z, and z' is the rate of z |
//! | contact | F_n = max(0, -c_a z' - k_e z) |
//! | friction, in slip | its torque is s mu r F_n |

use super::stretches::{POINTS, Stretch};
use crate::friction::Law;
use crate::model::axial::AxialMotion;
use crate::model::torsion::TorsionModel;
use crate::model::{Axial, Mode, Parameters};

/// How many equations there are.
pub(super) const EQUATIONS: usize = 10;

/// The equations of a case with one set of numbers.
#[derive(Debug)]
pub(super) struct Equations {
    model: TorsionModel,
    axial: Axial,
    motion: AxialMotion,
    /// The force without a candidate's own, which other numbers than those of the axial motion leave as it is.
    pressing: Vec<[(f64, f64); POINTS]>,
}

/// What an equation misses, and the size of its terms; `None` where it cannot be read.
pub(super) type Missed = [Option<(f64, f64)>; EQUATIONS];

impl Equations {
    /// Of the parameters, to be asked about `stretches`.
    pub fn new(parameters: &Parameters, stretches: &[Stretch]) -> Equations {
        let motion = parameters.axial_motion();
        let at = |stretch: &Stretch| {
            stretch.time.map(|t| {
                let state = motion.at(t);
                (state.pressing_force.max(0.0), state.force)
            })
        };
        Equations {
            model: TorsionModel::new(parameters),
            axial: parameters.axial,
            pressing: stretches.iter().map(at).collect(),
            motion,
        }
    }

    /// The same with other parameters, of which those of the axial motion and its force are the same.
    pub fn with(&self, parameters: &Parameters) -> Equations {
        Equations {
            model: TorsionModel::new(parameters),
            axial: parameters.axial,
            motion: self.motion.clone(),
            pressing: self.pressing.clone(),
        }
    }

    /// What stretch number `index` misses; `coarse` by the quadrature through three of its samples.
    pub fn missed(&self, stretch: &Stretch, index: usize, coarse: bool) -> Missed {
        let weights = if coarse { &stretch.coarse } else { &stretch.fine };
        let integral = |values: &[f64; POINTS]| -> f64 { values.iter().zip(weights).map(|(x, w)| x * w).sum() };
        let change = |values: &[f64; POINTS]| values[POINTS - 1] - values[0];
        let each = |f: &dyn Fn(usize) -> f64| -> [f64; POINTS] { std::array::from_fn(f) };
        let balance = |terms: &[f64]| {
            let size = terms.iter().map(|term| term * term).sum::<f64>().sqrt();
            Some((terms.iter().sum::<f64>(), size))
        };
        let mut missed: Missed = [None; EQUATIONS];
        let of_axial = |[z, z_dot]: &[[f64; POINTS]; 2]| {
            let Axial { stiffness, damping, .. } = self.axial;
            each(&|k| (-damping * z_dot[k] - stiffness * z[k]).max(0.0))
        };
        let own = stretch.force.or(stretch.axial.as_ref().map(of_axial));
        let force = own.unwrap_or_else(|| self.pressing[index].map(|(pressing, _)| pressing));
        if force.iter().any(|force| *force <= 0.0) {
            return missed;
        }
        let sense = f64::from(stretch.mode.sense());
        let radius = self.model.contact.radius;
        let law = &self.model.friction.law;
        let friction = each(&|k| sense * law.coefficient(stretch.velocity[k].abs()) * radius * force[k]);
        let slips = stretch.mode != Mode::Stick;
        if let Some([u, u_dot, v, v_dot, speed]) = &stretch.motion {
            let p = &self.model.torsion;
            let (rotor, stator) = (p.rotor_inertia, p.surface_inertia);
            let spring = |x: &[f64; POINTS]| p.stiffness * integral(x);
            let damper = |x: &[f64; POINTS]| p.damping * integral(x);
            let surface = stator * (change(speed) - change(u_dot));
            let bottom = stator * change(v_dot);
            missed[0] = balance(&[rotor * change(speed), spring(u), damper(u_dot)]);
            if slips {
                let pressed = integral(&friction);
                missed[1] = balance(&[surface, -spring(u), -damper(u_dot), pressed]);
                missed[2] = balance(&[bottom, spring(v), damper(v_dot), -pressed]);
            } else {
                missed[3] = balance(&[surface + bottom, -spring(u), -damper(u_dot), spring(v), damper(v_dot)]);
            }
            missed[4] = balance(&[change(u), -integral(u_dot)]);
            missed[5] = balance(&[change(v), -integral(v_dot)]);
        }
        if let Some([z, z_dot]) = &stretch.axial {
            let Axial {
                mass,
                stiffness,
                damping,
                ..
            } = self.axial;
            let applied = integral(&self.pressing[index].map(|(_, force)| force));
            missed[6] = balance(&[
                mass * change(z_dot),
                damping * integral(z_dot),
                stiffness * integral(z),
                applied,
            ]);
            missed[7] = balance(&[change(z), -integral(z_dot)]);
        }
        if let Some(stated) = &stretch.force {
            let expected = match &stretch.axial {
                Some(axial) => of_axial(axial),
                None => self.pressing[index].map(|(pressing, _)| pressing),
            };
            missed[8] = balance(&[integral(stated), -integral(&expected)]);
        }
        if let (Some(stated), true) = (&stretch.friction, slips) {
            missed[9] = balance(&[integral(stated), -integral(&friction)]);
        }
        missed
    }
}
