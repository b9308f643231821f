//! Residuals of the equations of a case, each in its integral form over a stretch of samples.
//!
//! | equation | residual |
//! |---|---|
//! | each inertia | J_i w_i' = s (S_i - S_(i-1)) - d_i w_i + M_i; inside a surface is the contact torque, T = s mu r F_n in slip |
//! | surfaces, in stick | sum of both surfaces' equations, in which T cancels |
//! | each shaft | q_i' is the rate of its twist q_i: shows an integrator's error, but no other parameter |
//! | bristles | z' = w - sigma_0 abs(w) z/g |
//! | axial | m z'' = -F - c_a z' - k_e z, and z' is the rate of z |
//! | contact | F_n = max(0, -c_a z' - k_e z), or the applied force |
//! | friction, without stick | its torque is T |

use super::stretches::{POINTS, Stretch};
use std::rc::Rc;
use stickslip_engine::simulation::Excitation;
use stickslip_system::friction::Law;
use stickslip_system::model::equations::{Engagement, Outside, SystemEquations};
use stickslip_system::model::system::{Pressing, System, Train};
use stickslip_system::model::{Axial, Mode};

/// External actions at a sample, with the force unless the candidate has its own; and F, N.
#[derive(Debug, Clone, Copy, Default)]
struct Acting {
    outside: Outside,
    applied: f64,
}

#[derive(Debug, Clone)]
pub(crate) struct Equations {
    trains: System,
    system: SystemEquations,
    /// Places of the channels of [`Stretch::motion`] in the state.
    places: Vec<usize>,
    acting: Rc<[[Acting; POINTS]]>,
}

/// Residual of an equation and the size of its terms; `None` if the equation cannot be read.
pub(crate) type Missed = Option<(f64, f64)>;

fn acting(trains: &System, stretches: &[Stretch]) -> Rc<[[Acting; POINTS]]> {
    let excitation = Excitation::new(trains);
    let at = |t: f64| {
        let mut outside = excitation.at(excitation.stretch(t), t);
        outside.normal_force = outside.normal_force.max(0.0);
        Acting {
            outside,
            applied: excitation.axial().map_or(0.0, |axial| axial.at(t).force),
        }
    };
    stretches.iter().map(|stretch| stretch.time.map(at)).collect()
}

fn alike(a: &System, b: &System) -> bool {
    let alike = |a: &Train, b: &Train| a.end == b.end && a.torque == b.torque;
    a.pressing == b.pressing && alike(&a.rotor, &b.rotor) && alike(&a.stator, &b.stator)
}

fn balance(terms: &[f64]) -> Missed {
    let size = terms.iter().map(|term| term * term).sum::<f64>().sqrt();
    Some((terms.iter().sum::<f64>(), size))
}

impl Equations {
    /// Equations of a system for `stretches`; `places` are those of their channels in the state.
    pub fn new(trains: System, places: &[usize], stretches: &[Stretch]) -> Equations {
        let acting = acting(&trains, stretches);
        Equations::under(trains, places, acting)
    }

    pub fn with(&self, trains: System, stretches: &[Stretch]) -> Equations {
        let acting = match alike(&trains, &self.trains) {
            true => self.acting.clone(),
            false => acting(&trains, stretches),
        };
        Equations::under(trains, &self.places, acting)
    }

    fn under(trains: System, places: &[usize], acting: Rc<[[Acting; POINTS]]>) -> Equations {
        Equations {
            system: SystemEquations::new(&trains),
            places: places.to_vec(),
            acting,
            trains,
        }
    }

    pub fn count(&self) -> usize {
        let sides = [&self.system.rotor, &self.system.stator];
        let of_sides: usize = sides.iter().map(|side| side.inertia.len() + side.shafts()).sum();
        // The pair in stick, bristles, two axial equations, contact, friction.
        of_sides + 6
    }

    /// Residuals of all equations in stretch number `index`; `coarse`: by the quadrature through three of its samples.
    pub fn missed(&self, stretch: &Stretch, index: usize, coarse: bool) -> Vec<Missed> {
        let (system, acting) = (&self.system, &self.acting[index]);
        let weights = if coarse { &stretch.coarse } else { &stretch.fine };
        let integral = |values: &[f64; POINTS]| -> f64 { values.iter().zip(weights).map(|(x, w)| x * w).sum() };
        let change = |values: &[f64; POINTS]| values[POINTS - 1] - values[0];
        let each = |f: &dyn Fn(usize) -> f64| -> [f64; POINTS] { std::array::from_fn(f) };
        let axial = match &self.trains.pressing {
            Pressing::Axial { axial, .. } => stretch.axial.as_ref().map(|motion| (axial, motion)),
            Pressing::Force(_) => None,
        };
        let pressed_by = |(axial, [z, z_dot]): (&Axial, &[[f64; POINTS]; 2])| {
            each(&|k| (-axial.damping * z_dot[k] - axial.stiffness * z[k]).max(0.0))
        };
        let expected = axial.map_or_else(|| acting.map(|at| at.outside.normal_force), pressed_by);
        let force = stretch.force.unwrap_or(expected);
        let mut missed = Vec::with_capacity(self.count());
        if force.iter().any(|force| *force <= 0.0) {
            missed.resize(self.count(), None);
            return missed;
        }
        let states: Option<[Vec<f64>; POINTS]> = stretch.motion.as_ref().map(|motion| {
            std::array::from_fn(|k| {
                let mut y = vec![0.0; system.dimension];
                for (&place, values) in self.places.iter().zip(motion) {
                    y[place] = values[k];
                }
                y
            })
        });
        let friction = self.friction(stretch, states.as_ref(), &force);
        match &states {
            None => missed.resize(self.count() - 5, None),
            Some(states) => {
                let of = |f: &dyn Fn(usize, &[f64]) -> f64| each(&|k| f(k, &states[k]));
                // Sum of the surfaces' equations, in which the contact torque cancels.
                let mut pair = Some(Vec::new());
                for side in [&system.rotor, &system.stator] {
                    let driving = |k: usize| match side.sign > 0.0 {
                        true => acting[k].outside.rotor,
                        false => acting[k].outside.stator,
                    };
                    let speeds: [Vec<f64>; POINTS] = std::array::from_fn(|k| side.speeds(&driving(k), &states[k]));
                    for (i, (inertia, viscous)) in side.inertia.iter().zip(&side.viscous).enumerate() {
                        let speed = each(&|k| speeds[k][i]);
                        let mut terms = vec![inertia * change(&speed), viscous * integral(&speed)];
                        let inside = i.checked_sub(1).map(|inside| (inside, side.sign));
                        let outside = (i < side.shafts()).then_some((i, -side.sign));
                        for (shaft, sign) in inside.into_iter().chain(outside) {
                            let twist = of(&|_, y| side.twist(shaft, y));
                            let rate = of(&|_, y| side.twist_rate(shaft, y));
                            terms.push(sign * side.stiffness[shaft] * integral(&twist));
                            terms.push(sign * side.damping[shaft] * integral(&rate));
                        }
                        if side.takes_torque[i] {
                            terms.push(-integral(&each(&|k| driving(k).torque)));
                        }
                        if i > 0 {
                            missed.push(balance(&terms));
                        } else if let Some(friction) = &friction {
                            terms.push(side.sign * integral(friction));
                            missed.push(balance(&terms));
                        } else {
                            missed.push(None);
                            pair.iter_mut().for_each(|pair| pair.extend(&terms));
                        }
                    }
                    if side.inertia.is_empty() {
                        pair = None;
                    }
                    for shaft in 0..side.shafts() {
                        let (twist, rate) = (of(&|_, y| side.twist(shaft, y)), of(&|_, y| side.twist_rate(shaft, y)));
                        missed.push(balance(&[change(&twist), -integral(&rate)]));
                    }
                }
                missed.push(
                    pair.filter(|_| stretch.mode == Mode::Stick)
                        .and_then(|pair| balance(&pair)),
                );
            }
        }
        missed.push(states.as_ref().and_then(|states| {
            let Engagement::Bristles(.., at) = system.engagement else {
                return None;
            };
            let deflection = each(&|k| states[k][at]);
            let rate = each(&|k| self.engaged(stretch, k, &states[k]).1);
            balance(&[change(&deflection), -integral(&rate)])
        }));
        missed.extend(match axial {
            Some((axial, [z, z_dot])) => [
                balance(&[
                    axial.mass * change(z_dot),
                    axial.damping * integral(z_dot),
                    axial.stiffness * integral(z),
                    integral(&acting.map(|at| at.applied)),
                ]),
                balance(&[change(z), -integral(z_dot)]),
            ],
            None => [None, None],
        });
        let stated = stretch.force.as_ref();
        missed.push(stated.and_then(|stated| balance(&[integral(stated), -integral(&expected)])));
        let stated = stretch.friction.as_ref().zip(friction.as_ref());
        missed.push(stated.and_then(|(stated, friction)| balance(&[integral(stated), -integral(friction)])));
        missed
    }

    /// Contact torque over r F_n at a sample without stick, and the rate of the bristles.
    fn engaged(&self, stretch: &Stretch, k: usize, y: &[f64]) -> (f64, f64) {
        let w = stretch.velocity[k];
        let law = self.system.law_in(w, self.system.piece_of(w));
        self.system.engaged(law, w.signum(), w, y)
    }

    /// Contact torque in slip, N m; `None` in stick, and for bristles with unknown deflection.
    fn friction(
        &self,
        stretch: &Stretch,
        states: Option<&[Vec<f64>; POINTS]>,
        force: &[f64; POINTS],
    ) -> Option<[f64; POINTS]> {
        let system = &self.system;
        let share = |k: usize| match (system.engagement, states) {
            (Engagement::StickSlip, _) => {
                let w = stretch.velocity[k];
                w.signum() * system.law_of(w).coefficient(w.abs())
            }
            (_, Some(states)) => self.engaged(stretch, k, &states[k]).0,
            (_, None) => self.engaged(stretch, k, &[]).0,
        };
        let unknown = states.is_none() && matches!(system.engagement, Engagement::Bristles(..));
        let known = stretch.mode != Mode::Stick && !unknown;
        known.then(|| std::array::from_fn(|k| share(k) * system.radius * force[k]))
    }
}
