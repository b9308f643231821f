//! The parameters as exact rationals: decimals as written, units by their exact factors.

use super::{Axial, BreakawayTest, Contact, Initial, Kick, Parameters, Torsion};
use crate::friction::{Friction, FrictionLaw};
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
    /// mu(x).
    pub law: ExactLaw,
    /// omega_0, rad/s.
    pub speed: BigRational,
    /// In the order given.
    pub kicks: Vec<Kick<BigRational>>,
}

/// A friction law, as [`FrictionLaw`]: its name, and its parameters by their keys in a case.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactLaw {
    /// The word of `friction.law`.
    pub name: &'static str,
    /// Key and value of each parameter that is a number, SI.
    pub numbers: Vec<(&'static str, BigRational)>,
    /// Of each that is a list of numbers.
    pub lists: Vec<(&'static str, Vec<BigRational>)>,
    /// Of each that is one of several words.
    pub words: Vec<(&'static str, &'static str)>,
}

impl ExactLaw {
    /// The value of a parameter; zero of one that the law does not have.
    pub fn number(&self, key: &str) -> BigRational {
        let found = self.numbers.iter().find(|number| number.0 == key);
        found.map_or_else(BigRational::default, |number| number.1.clone())
    }

    /// The values of a list; empty for one that the law does not have.
    pub fn list(&self, key: &str) -> &[BigRational] {
        let found = self.lists.iter().find(|list| list.0 == key);
        found.map_or(&[], |list| &list.1)
    }

    /// The word of a parameter; empty for one that the law does not have.
    pub fn word(&self, key: &str) -> &'static str {
        let found = self.words.iter().find(|word| word.0 == key);
        found.map_or("", |word| word.1)
    }

    /// The number of a parameter to be changed, where the law has it.
    pub fn number_mut(&mut self, key: &str) -> Option<&mut BigRational> {
        let found = self.numbers.iter_mut().find(|number| number.0 == key);
        found.map(|number| &mut number.1)
    }

    /// The same of an element of a list.
    pub fn element_mut(&mut self, key: &str, index: usize) -> Option<&mut BigRational> {
        let found = self.lists.iter_mut().find(|list| list.0 == key);
        found.and_then(|list| list.1.get_mut(index))
    }

    /// With the nearest doubles.
    pub fn rounded(&self) -> FrictionLaw {
        let mut law = FrictionLaw::unset(self.name).expect("an exact law is one of those that there are");
        for (key, value) in &self.numbers {
            law.set_number(key, nearest_double(value));
        }
        for (key, word) in &self.words {
            law.set_word(key, word);
        }
        for (key, values) in &self.lists {
            law.set_list(key, values.iter().map(nearest_double).collect());
        }
        law
    }
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
                law: self.law.rounded(),
            },
            initial: Initial {
                speed: round(&self.speed),
            },
            perturbations: self
                .kicks
                .iter()
                .map(|kick| Kick {
                    time: kick.time.map(nearest_double),
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
