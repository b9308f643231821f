//! The parameters as exact rationals: decimals as written, units by their exact factors.

use super::{Axial, BreakawayTest, Contact, Initial, Kick, KickTime, Parameters, Torsion};
use crate::friction::{Exponential, Friction};
use crate::signal::Signal;
use num_rational::BigRational;
use num_traits::ToPrimitive;

/// Everything that defines the physical problem, in SI units and radians, without rounding. The fields are those of
/// [`Parameters`], which holds the same numbers rounded to doubles.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactParameters {
    /// m, kg.
    pub mass: BigRational,
    /// k_e, N/m.
    pub axial_stiffness: BigRational,
    /// c_a, N s/m.
    pub axial_damping: BigRational,
    /// Amplitude below which a ringing open contact stays open while F does not press, m.
    pub ringing_floor: BigRational,
    /// F(t), N.
    pub actuation: Signal<BigRational>,
    /// I, kg m^2.
    pub rotor_inertia: BigRational,
    /// J, kg m^2, of each disk.
    pub surface_inertia: BigRational,
    /// k_t, N m/rad, of each disk.
    pub torsional_stiffness: BigRational,
    /// c_t, N m s/rad, of each disk.
    pub torsional_damping: BigRational,
    /// r, m.
    pub radius: BigRational,
    /// Which torque is held against mu_0 r F_n in stick.
    pub breakaway_test: BreakawayTest,
    /// mu_0.
    pub breakaway: BigRational,
    /// mu_s.
    pub low_speed: BigRational,
    /// mu_d.
    pub high_speed: BigRational,
    /// alpha, s/rad.
    pub decay: BigRational,
    /// omega_0, rad/s.
    pub speed: BigRational,
    /// In the order given.
    pub kicks: Vec<ExactKick>,
}

/// A jump of the relative velocity, half on each surface.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactKick {
    /// s; `None` is the loss of stability.
    pub time: Option<BigRational>,
    /// delta, rad/s.
    pub relative_velocity: BigRational,
}

impl ExactParameters {
    /// The nearest doubles.
    pub fn rounded(&self) -> Parameters {
        let round = nearest_double;
        Parameters {
            axial: Axial {
                mass: round(&self.mass),
                stiffness: round(&self.axial_stiffness),
                damping: round(&self.axial_damping),
                ringing_floor: round(&self.ringing_floor),
            },
            actuation: self.actuation.map(nearest_double),
            torsion: Torsion {
                rotor_inertia: round(&self.rotor_inertia),
                surface_inertia: round(&self.surface_inertia),
                stiffness: round(&self.torsional_stiffness),
                damping: round(&self.torsional_damping),
            },
            contact: Contact {
                radius: round(&self.radius),
                breakaway_test: self.breakaway_test,
            },
            friction: Friction {
                breakaway: round(&self.breakaway),
                law: Exponential {
                    low_speed: round(&self.low_speed),
                    high_speed: round(&self.high_speed),
                    decay: round(&self.decay),
                }
                .into(),
            },
            initial: Initial {
                speed: round(&self.speed),
            },
            perturbations: self
                .kicks
                .iter()
                .map(|kick| Kick {
                    time: kick
                        .time
                        .as_ref()
                        .map_or(KickTime::Instability, |t| KickTime::At(round(t))),
                    relative_velocity: round(&kick.relative_velocity),
                })
                .collect(),
        }
    }
}

/// The double nearest to `value`.
pub fn nearest_double(value: &BigRational) -> f64 {
    value.to_f64().unwrap_or(f64::NAN)
}
