//! The numbers of a case without rounding.

use super::document::{Node, Value};
use super::error::CaseError;
use super::quantity::{self, Dimension};
use super::reader::Read;
use super::schema::{self, Key};
use super::trains::keys;
use super::trains::signals;
use super::{Case, Motion, key_of};
use crate::friction::FrictionLaw;
use crate::model::contact::{uniform_pressure_radius, uniform_wear_radius};
use crate::model::system::{
    Bristles, ContactLaw, End, ExactSystem, Initial, Kick, Pressing, Regularisation, Torque, Train,
};
use crate::model::{Axial, ExactLaw, KickTime};
use crate::signal::{Drive, Ramp, Shape, Signal, Table, Wave};
use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{One, Signed, Zero};

/// What a case describes, without rounding: decimals as they are written, units by their exact factors.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactCase {
    /// The system.
    pub system: ExactSystem,
    /// The sliding speed (rad/s) below which a contact without stick counts as stuck; `None` of others.
    pub threshold: Option<BigRational>,
}

/// The numbers of a case as they are written.
pub(super) fn read(read: &Read) -> Result<ExactCase, CaseError> {
    let exact = Exact {
        case: &read.case,
        of_law: &read.of_law,
        written: &read.written,
    };
    Ok(ExactCase {
        system: exact.system()?,
        threshold: exact.threshold()?,
    })
}

/// Of a key of the schema that is a number or a list of them.
fn dimension_of(path: &str) -> Dimension {
    key_of(path).and_then(Key::dimension).unwrap_or(Dimension::Number)
}

/// The shortest decimal of a double.
fn decimal(path: &str, number: f64) -> Result<BigRational, CaseError> {
    quantity::decimal(&format!("{number:e}")).map_err(|message| CaseError::one("", path, message))
}

/// The number that is written at `path`.
fn number_at(root: &Node, path: &str, dimension: Dimension) -> Result<BigRational, CaseError> {
    let value = match root.at(path).map(|node| &node.value) {
        Some(Value::Integer(number)) => Ok(BigRational::from_integer(BigInt::from(*number))),
        Some(Value::Float(number)) => return decimal(path, *number),
        Some(Value::Text(text)) => quantity::exact(text, dimension),
        _ => Err("expected a number".to_owned()),
    };
    value.map_err(|message| CaseError::one("", path, message))
}

/// The key of the short form that says what stands at a path of the general one.
fn short_key(path: &str) -> Option<&'static str> {
    Some(match path {
        "rotor.inertia.0" | "stator.inertia.0" => "torsion.surface_inertia",
        "rotor.inertia.1" => "torsion.rotor_inertia",
        "rotor.stiffness.0" | "stator.stiffness.0" => "torsion.stiffness",
        "rotor.damping.0" | "stator.damping.0" => "torsion.damping",
        _ => return None,
    })
}

struct Exact<'a> {
    case: &'a Case,
    /// The tree in which `friction` holds a law without memory.
    of_law: &'a Node,
    /// The tree as written.
    written: &'a Node,
}

impl Exact<'_> {
    fn system(&self) -> Result<ExactSystem, CaseError> {
        let trains = &self.case.system;
        let rotor = self.train("rotor", &trains.rotor)?;
        let stator = self.train("stator", &trains.stator)?;
        let initial = &trains.initial;
        let kicks = trains.kicks.iter().enumerate().map(|(index, kick)| {
            let path = |name: &str| format!("perturbation.{index}.{name}");
            Ok(Kick {
                time: match kick.time {
                    KickTime::At(time) => KickTime::At(self.number(&path("time"), Dimension::Time, time)?),
                    KickTime::Instability => KickTime::Instability,
                },
                relative_velocity: self.number(
                    &path("relative_velocity"),
                    Dimension::AngularVelocity,
                    kick.relative_velocity,
                )?,
                on: kick.on,
            })
        });
        Ok(ExactSystem {
            radius: match self.case.motion() {
                Motion::Rotation => self.radius()?,
                Motion::Translation => decimal("contact.radius", 1.0)?,
            },
            pressing: match &trains.pressing {
                Pressing::Force(force) => Pressing::Force(self.drive("contact.normal_force", force)?),
                Pressing::Axial { axial, actuation } => Pressing::Axial {
                    axial: Axial {
                        mass: self.number("axial.mass", Dimension::Mass, axial.mass)?,
                        stiffness: self.number("axial.stiffness", Dimension::Stiffness, axial.stiffness)?,
                        damping: self.number("axial.damping", Dimension::Damping, axial.damping)?,
                        ringing_floor: self.number(
                            schema::AXIAL_RINGING_FLOOR,
                            Dimension::Length,
                            axial.ringing_floor,
                        )?,
                    },
                    actuation: actuation.try_map(|field, index, value| {
                        let path = schema::actuation_path(field);
                        let dimension = dimension_of(&path);
                        let element = index.map_or(String::new(), |index| format!(".{index}"));
                        self.number(&format!("{path}{element}"), dimension, *value)
                    })?,
                },
            },
            law: self.law(&trains.law)?,
            contact: match &trains.contact {
                ContactLaw::StickSlip => ContactLaw::StickSlip,
                ContactLaw::Regularised(regularisation) => {
                    ContactLaw::Regularised(self.regularisation(regularisation)?)
                }
                ContactLaw::Bristles(bristles) => ContactLaw::Bristles(Bristles {
                    stiffness: self.number(
                        "friction.bristle_stiffness",
                        Dimension::InverseAngle,
                        bristles.stiffness,
                    )?,
                    damping: self.number("friction.bristle_damping", Dimension::FrictionDecay, bristles.damping)?,
                    viscous: self.number("friction.viscous", Dimension::FrictionDecay, bristles.viscous)?,
                }),
            },
            breakaway: self.breakaway()?,
            breakaway_test: trains.breakaway_test,
            initial: Initial {
                rotor_twist: self.list("initial.rotor_twist", &initial.rotor_twist)?,
                rotor_speed: self.speeds("rotor", &rotor, &initial.rotor_speed)?,
                stator_twist: self.list("initial.stator_twist", &initial.stator_twist)?,
                stator_speed: self.speeds("stator", &stator, &initial.stator_speed)?,
            },
            kicks: kicks.collect::<Result<_, CaseError>>()?,
            rotor,
            stator,
        })
    }

    /// |omega_r| below which statistics count a stick: as it is written, or what stands for it where it is left out.
    fn threshold(&self) -> Result<Option<BigRational>, CaseError> {
        const PATH: &str = "friction.threshold";
        let ten = BigRational::from_integer(10.into());
        Ok(match &self.case.system.contact {
            ContactLaw::StickSlip => None,
            _ if self.written.at(PATH).is_some() => Some(self.number(PATH, Dimension::AngularVelocity, f64::NAN)?),
            ContactLaw::Regularised(regularisation) => Some(self.regularisation(regularisation)?.speed * ten),
            ContactLaw::Bristles(_) => {
                let law = self.law(&self.case.system.law)?;
                let scale = law.numbers.into_iter().find(|(key, _)| *key == "scale");
                Some(match scale {
                    Some((_, scale)) => scale / ten,
                    None => decimal(PATH, self.case.threshold)?,
                })
            }
        })
    }

    /// The parameters of the friction law; those that are left out by their defaults.
    fn law(&self, law: &FrictionLaw) -> Result<ExactLaw, CaseError> {
        let mut exact = ExactLaw {
            name: law.name(),
            numbers: Vec::new(),
            lists: Vec::new(),
            words: Vec::new(),
        };
        for &key in FrictionLaw::keys_of(law.name()) {
            let path = format!("friction.{key}");
            let dimension = self.case.motion().dimension(dimension_of(&path));
            let number = |path: &str| number_at(self.of_law, path, dimension);
            if let Some(values) = law.list(key) {
                let numbers = (0..values.len()).map(|index| number(&format!("{path}.{index}")));
                exact.lists.push((key, numbers.collect::<Result<_, _>>()?));
            } else if let Some(word) = law.word(key) {
                exact.words.push((key, word));
            } else {
                let value = match (self.of_law.at(&path), law.number(key)) {
                    (None, Some(default)) => decimal(&path, default)?,
                    _ => number(&path)?,
                };
                exact.numbers.push((key, value));
            }
        }
        Ok(exact)
    }

    /// r, given or from the diameters by equation (6) or (7).
    fn radius(&self) -> Result<BigRational, CaseError> {
        let length = |path: &str| number_at(self.written, path, Dimension::Length);
        if self.written.at("contact.radius").is_some() {
            return length("contact.radius");
        }
        let (outer, inner) = (length("contact.outer_diameter")?, length("contact.inner_diameter")?);
        let pressure = matches!(
            self.written.at("contact.wear").map(|node| &node.value),
            Some(Value::Text(wear)) if wear == schema::UNIFORM_PRESSURE
        );
        Ok(if pressure {
            uniform_pressure_radius(outer, inner)
        } else {
            uniform_wear_radius(outer, inner)
        })
    }

    fn regularisation(&self, regularisation: &Regularisation) -> Result<Regularisation<BigRational>, CaseError> {
        const PATH: &str = "friction.regularisation.speed";
        Ok(Regularisation {
            function: regularisation.function,
            speed: self.number(PATH, Dimension::AngularVelocity, regularisation.speed)?,
        })
    }

    /// The number at `path`, whose dimension in rotation this is; what it became in the case if it is not written.
    fn number(&self, path: &str, dimension: Dimension, default: f64) -> Result<BigRational, CaseError> {
        self.raw(path, self.case.motion().dimension(dimension), default)
    }

    /// As [`Self::number`], of a dimension that no motion changes.
    fn raw(&self, path: &str, dimension: Dimension, default: f64) -> Result<BigRational, CaseError> {
        match self.place(path) {
            Some(place) => number_at(self.written, place, dimension),
            None => decimal(path, default),
        }
    }

    /// Where the number of a path is written: there, at the key of the short form, or as a number for a list of one.
    fn place<'p>(&self, path: &'p str) -> Option<&'p str> {
        let path = match self.case.words.short {
            true => short_key(path).unwrap_or(path),
            false => path,
        };
        if self.written.at(path).is_some() {
            return Some(path);
        }
        path.strip_suffix(".0").filter(|list| {
            let node = self.written.at(list).map(|node| &node.value);
            matches!(node, Some(Value::Integer(_) | Value::Float(_) | Value::Text(_)))
        })
    }

    /// The list of a key of the general form.
    fn list(&self, path: &str, values: &[f64]) -> Result<Vec<BigRational>, CaseError> {
        let (dimension, _) = keys::measure(path);
        let elements = values.iter().enumerate();
        elements
            .map(|(index, value)| self.number(&format!("{path}.{index}"), dimension, *value))
            .collect()
    }

    /// The signal of a key of the general form.
    fn drive(&self, path: &str, drive: &Drive) -> Result<Drive<BigRational>, CaseError> {
        let (dimension, _) = keys::measure(path);
        drive.try_map(|inner, value| {
            let dimension = signals::dimension_of(inner, dimension, self.case.motion());
            let path = if inner.is_empty() {
                path.to_owned()
            } else {
                format!("{path}.{inner}")
            };
            self.raw(&path, dimension, *value)
        })
    }

    fn train(&self, side: &str, train: &Train) -> Result<Train<BigRational>, CaseError> {
        let list = |name: &str, values: &[f64]| self.list(&format!("{side}.{name}"), values);
        Ok(Train {
            inertia: list("inertia", &train.inertia)?,
            stiffness: list("stiffness", &train.stiffness)?,
            damping: list("damping", &train.damping)?,
            viscous: list("viscous", &train.viscous)?,
            end: match &train.end {
                End::Free => End::Free,
                End::Fixed => End::Fixed,
                End::Driven(speed) => End::Driven(self.drive(&format!("{side}.speed"), speed)?),
            },
            torque: match &train.torque {
                None => None,
                Some(torque) => Some(Torque {
                    signal: self.drive(&format!("{side}.torque"), &torque.signal)?,
                    on: torque.on,
                }),
            },
        })
    }

    /// The speeds of a train's inertias at t = 0: those that are given, or that of a driven end.
    fn speeds(&self, side: &str, train: &Train<BigRational>, speeds: &[f64]) -> Result<Vec<BigRational>, CaseError> {
        let path = format!("initial.{side}_speed");
        if side == "rotor" && self.written.at("initial.speed").is_some() {
            let speed = self.number("initial.speed", Dimension::AngularVelocity, f64::NAN)?;
            return Ok(vec![speed; speeds.len()]);
        }
        let mut found = self.list(&path, speeds)?;
        if let End::Driven(speed) = &train.end {
            let turning = at_start(speed);
            for (index, found) in found.iter_mut().enumerate() {
                if self.place(&format!("{path}.{index}")).is_none() {
                    found.clone_from(&turning);
                }
            }
        }
        Ok(found)
    }

    /// mu_0, or what stands for it where it is left out.
    fn breakaway(&self) -> Result<BigRational, CaseError> {
        const PATH: &str = "friction.breakaway";
        let system = &self.case.system;
        match self.written.at(PATH) {
            Some(_) => self.number(PATH, Dimension::Number, f64::NAN),
            None => {
                let key = system.law.key_at_vanishing_speed();
                self.number(&format!("friction.{key}"), Dimension::Number, system.breakaway)
            }
        }
    }
}

/// The value of a signal at t = 0.
fn at_start(drive: &Drive<BigRational>) -> BigRational {
    match drive {
        Drive::Value(value) => value.clone(),
        Drive::Linear(Signal::Ramp(Ramp { value, rise_time })) => {
            if rise_time.is_positive() {
                BigRational::zero()
            } else {
                value.clone()
            }
        }
        Drive::Linear(Signal::Table(Table { time, value })) => {
            let after = time.iter().position(|time| time.is_positive()).unwrap_or(time.len());
            match after {
                0 => value[0].clone(),
                last if last == time.len() => value[last - 1].clone(),
                next => {
                    let slope = (&value[next] - &value[next - 1]) / (&time[next] - &time[next - 1]);
                    &value[next - 1] - slope * &time[next - 1]
                }
            }
        }
        Drive::Wave(wave) => wave_at_start(wave),
        Drive::Sum(terms) => terms.iter().map(at_start).sum(),
    }
}

fn wave_at_start(wave: &Wave<BigRational>) -> BigRational {
    // The end of a valid wave is after t = 0.
    if wave.from.as_ref().is_some_and(|from| from.is_positive()) {
        return wave.mean.clone();
    }
    let (sine, cosine) = sine_and_cosine(&wave.phase);
    let shape = match wave.shape {
        Shape::Sine => sine,
        Shape::Cosine => cosine,
    };
    &wave.mean + &wave.amplitude * shape
}

/// Bits behind the point of a sine or cosine, which is no rational: more than the longest numbers of the oracle have, 2048, where
/// it is 1e-100.
const BITS: u64 = 2400;

/// Sine and cosine of an angle (rad), to 2^-[`BITS`]; exact where the angle is zero.
fn sine_and_cosine(angle: &BigRational) -> (BigRational, BigRational) {
    // The series of an angle below 2^-8, and then as many times that of twice the angle, which costs two bits each time.
    let halvings = (angle.numer().bits() + 9).saturating_sub(angle.denom().bits());
    let bits = BITS + 2 * halvings + 32;
    let unit = BigInt::one() << bits;
    let small = (angle.numer() << (bits - halvings)) / angle.denom();
    let [mut sine, mut cosine] = [BigInt::zero(), BigInt::zero()];
    let mut term = unit.clone();
    for n in 1_u32.. {
        if term.is_zero() {
            break;
        }
        let sum = if n % 2 == 1 { &mut cosine } else { &mut sine };
        match n % 4 {
            1 | 2 => *sum += &term,
            _ => *sum -= &term,
        }
        term = ((term * &small) >> bits) / n;
    }
    for _ in 0..halvings {
        let product = &sine * &cosine;
        cosine = &unit - ((&sine * &sine) >> (bits - 1));
        sine = product >> (bits - 1);
    }
    let rational = |value: BigInt| BigRational::new(value, unit.clone());
    (rational(sine), rational(cosine))
}
