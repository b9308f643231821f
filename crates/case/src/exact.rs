//! The parameters of a case without rounding.

use super::document::{CaseError, CaseValue, PlacedValue};
use super::quantity::{self, Dimension};
use super::reader::ReadCase;
use super::{Case, Motion, Words, schema, written};
use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{One, Signed, Zero};
use stickslip_system::friction::FrictionLaw;
use stickslip_system::model::contact::{uniform_pressure_radius, uniform_wear_radius};
use stickslip_system::model::system::{
    Bristles, ContactLaw, End, ExactSystem, Initial, Kick, Pressing, Regularisation, Torque, Train,
};
use stickslip_system::model::{Axial, ExactLaw, KickTime};
use stickslip_system::signal::{Drive, HarmonicShape, Ramp, Signal, TimeTable, Wave};

/// The system of a case without rounding. Decimals are exact as written, and units have exact factors.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactCase {
    /// The system.
    pub system: ExactSystem,
    /// Sliding speed (rad/s) below which a contact without stick counts as stuck; `None` with stick and slip.
    pub threshold: Option<BigRational>,
}

pub(super) fn read(read: &ReadCase) -> Result<ExactCase, CaseError> {
    let exact = ExactReader {
        case: &read.case,
        written: &read.written,
    };
    Ok(ExactCase {
        system: exact.system()?,
        threshold: exact.threshold()?,
    })
}

struct ExactReader<'a> {
    case: &'a Case,
    written: &'a PlacedValue,
}

type FoundExact<T> = Result<T, CaseError>;

impl ExactReader<'_> {
    fn system(&self) -> FoundExact<ExactSystem> {
        let system = &self.case.system;
        let rotor = self.train("rotor", &system.rotor)?;
        let stator = self.train("stator", &system.stator)?;
        let initial = &system.initial;
        let kicks = system.kicks.iter().enumerate().map(|(index, kick)| {
            let number = |name: &str, value| self.number(&format!("perturbation.{index}.{name}"), value);
            Ok(Kick {
                time: match kick.time {
                    KickTime::At(time) => KickTime::At(number("time", time)?),
                    KickTime::Instability => KickTime::Instability,
                },
                relative_velocity: number("relative_velocity", kick.relative_velocity)?,
                on: kick.on,
            })
        });
        Ok(ExactSystem {
            radius: self.radius()?,
            pressing: match &system.pressing {
                Pressing::Force(force) => Pressing::Force(self.drive("contact.normal_force", force)?),
                Pressing::Axial { axial, actuation } => Pressing::Axial {
                    axial: Axial {
                        mass: self.number("axial.mass", axial.mass)?,
                        stiffness: self.number("axial.stiffness", axial.stiffness)?,
                        damping: self.number("axial.damping", axial.damping)?,
                        ringing_floor: self.number(schema::AXIAL_RINGING_FLOOR, axial.ringing_floor)?,
                    },
                    actuation: actuation.try_map(|field, index, value| {
                        let field = if field == "value" { "force" } else { field };
                        let element = index.map_or(String::new(), |index| format!(".{index}"));
                        self.number(&format!("actuation.{field}{element}"), *value)
                    })?,
                },
            },
            law: self.law(&system.law)?,
            contact: match &system.contact {
                ContactLaw::StickSlip => ContactLaw::StickSlip,
                ContactLaw::Regularised(regularisation) => ContactLaw::Regularised(Regularisation {
                    function: regularisation.function,
                    speed: self.smoothing_speed(regularisation)?,
                }),
                ContactLaw::Bristles(bristles) => ContactLaw::Bristles(Bristles {
                    stiffness: self.number("friction.bristle_stiffness", bristles.stiffness)?,
                    damping: self.number("friction.bristle_damping", bristles.damping)?,
                    viscous: self.number("friction.viscous", bristles.viscous)?,
                    deflection: self.number("friction.bristle_deflection", bristles.deflection)?,
                }),
            },
            breakaway: self.breakaway()?,
            breakaway_test: system.breakaway_test,
            initial: Initial {
                rotor_twist: self.list("initial.rotor_twist", &initial.rotor_twist)?,
                rotor_speed: self.speeds("rotor", &rotor, &initial.rotor_speed)?,
                stator_twist: self.list("initial.stator_twist", &initial.stator_twist)?,
                stator_speed: self.speeds("stator", &stator, &initial.stator_speed)?,
            },
            kicks: kicks.collect::<FoundExact<_>>()?,
            rotor,
            stator,
        })
    }

    /// Sliding speed (rad/s) below which statistics count a stick: as written, or the default.
    fn threshold(&self) -> FoundExact<Option<BigRational>> {
        const PATH: &str = "friction.threshold";
        let ten = BigRational::from_integer(10.into());
        Ok(match &self.case.system.contact {
            ContactLaw::StickSlip => None,
            _ if self.written.at(PATH).is_some() => Some(self.number(PATH, f64::NAN)?),
            ContactLaw::Regularised(regularisation) => Some(self.smoothing_speed(regularisation)? * ten),
            ContactLaw::Bristles(_) => Some(self.law(&self.case.system.law)?.number("scale") / ten),
        })
    }

    fn smoothing_speed(&self, regularisation: &Regularisation) -> FoundExact<BigRational> {
        self.number("friction.regularisation.speed", regularisation.speed)
    }

    /// Parameters of the friction law, including defaults. With bristles this is the law of their limits: the key
    /// `viscous` is then sigma_2, and no parameter of the law.
    fn law(&self, law: &FrictionLaw) -> FoundExact<ExactLaw> {
        let mut exact = ExactLaw {
            name: law.name(),
            numbers: Vec::new(),
            lists: Vec::new(),
            words: Vec::new(),
        };
        let bristles = matches!(self.case.system.contact, ContactLaw::Bristles(_));
        for parameter in FrictionLaw::parameters_of(law.name()) {
            let (key, path) = (parameter.key(), parameter.path);
            if let Some(values) = law.list(key) {
                exact.lists.push((key, self.list(path, values)?));
            } else if let Some(word) = law.word(key) {
                exact.words.push((key, word));
            } else {
                let default = law.number(key).unwrap_or(f64::NAN);
                let number = match bristles && key == "viscous" {
                    true => decimal(path, default),
                    false => self.number(path, default),
                };
                exact.numbers.push((key, number?));
            }
        }
        Ok(exact)
    }

    /// The friction radius r: as written, or from the diameters by equation (6) or (7); 1 in translation.
    fn radius(&self) -> FoundExact<BigRational> {
        let number = |path: &str| self.number(path, self.case.system.radius);
        if self.case.motion() == Motion::Translation || self.written.at("contact.radius").is_some() {
            return number("contact.radius");
        }
        let (outer, inner) = (number("contact.outer_diameter")?, number("contact.inner_diameter")?);
        let wear = self.written.at("contact.wear").map(|node| &node.value);
        Ok(match wear {
            Some(CaseValue::Text(wear)) if wear == schema::UNIFORM_PRESSURE => uniform_pressure_radius(outer, inner),
            _ => uniform_wear_radius(outer, inner),
        })
    }

    /// The number at `path` of the general form as written, or `default` (exactly this double) if it is not written.
    fn number(&self, path: &str, default: f64) -> FoundExact<BigRational> {
        let dimension = written::dimension(path, Words::general(self.case.motion())).unwrap_or(Dimension::Number);
        let value = match self.value(path) {
            None => return decimal(path, default),
            Some(CaseValue::Integer(number)) => Ok(BigRational::from_integer(BigInt::from(*number))),
            Some(CaseValue::Float(number)) => return decimal(path, *number),
            Some(CaseValue::Text(text)) => quantity::exact(text, dimension),
            Some(_) => Err("expected a number".to_owned()),
        };
        value.map_err(|message| CaseError::one("", path, message))
    }

    /// The value that is written at `path`, at its key in the short form, or instead of the list that it is in.
    fn value(&self, path: &str) -> Option<&CaseValue> {
        let mut same = schema::SAME.iter().filter(|_| self.case.words.short);
        let path = same.find(|same| same.1.contains(&path)).map_or(path, |same| same.0);
        let written = |path: &str| self.written.at(path).map(|node| &node.value);
        let instead = |list: &str| written(list).filter(|value| value.is_single());
        written(path).or_else(|| path.strip_suffix(".0").and_then(instead))
    }

    fn list(&self, path: &str, values: &[f64]) -> FoundExact<Vec<BigRational>> {
        let number = |(index, value): (usize, &f64)| self.number(&format!("{path}.{index}"), *value);
        values.iter().enumerate().map(number).collect()
    }

    fn drive(&self, path: &str, drive: &Drive) -> FoundExact<Drive<BigRational>> {
        drive.try_map(|inner, value| self.number(format!("{path}.{inner}").trim_end_matches('.'), *value))
    }

    fn train(&self, side: &str, train: &Train) -> FoundExact<Train<BigRational>> {
        let list = |name: &str, values: &[f64]| self.list(&format!("{side}.{name}"), values);
        let torque = train.torque.as_ref().map(|torque| {
            let signal = self.drive(&format!("{side}.torque"), &torque.signal)?;
            Ok(Torque { signal, on: torque.on })
        });
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
            torque: torque.transpose()?,
        })
    }

    fn speeds(&self, side: &str, train: &Train<BigRational>, speeds: &[f64]) -> FoundExact<Vec<BigRational>> {
        let path = format!("initial.{side}_speed");
        if side == "rotor" && self.written.at("initial.speed").is_some() {
            return Ok(vec![self.number("initial.speed", f64::NAN)?; speeds.len()]);
        }
        let mut found = self.list(&path, speeds)?;
        if let End::Driven(speed) = &train.end {
            let turning = at_start(speed);
            for (index, found) in found.iter_mut().enumerate() {
                if self.value(&format!("{path}.{index}")).is_none() {
                    found.clone_from(&turning);
                }
            }
        }
        Ok(found)
    }

    fn breakaway(&self) -> FoundExact<BigRational> {
        let system = &self.case.system;
        let key = match self.written.at("friction.breakaway") {
            Some(_) => "breakaway",
            None => system.law.key_at_vanishing_speed(),
        };
        self.number(&format!("friction.{key}"), system.breakaway)
    }
}

fn decimal(path: &str, number: f64) -> FoundExact<BigRational> {
    quantity::decimal(&format!("{number:e}")).map_err(|message| CaseError::one("", path, message))
}

fn at_start(drive: &Drive<BigRational>) -> BigRational {
    match drive {
        Drive::Value(value) => value.clone(),
        Drive::Linear(Signal::Ramp(Ramp { value, rise_time })) => {
            let is_step = !rise_time.is_positive();
            if is_step { value.clone() } else { BigRational::zero() }
        }
        Drive::Linear(Signal::TimeTable(TimeTable { time, value })) => {
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
    // A valid wave ends after t = 0.
    if wave.from.as_ref().is_some_and(|from| from.is_positive()) {
        return wave.mean.clone();
    }
    let (sine, cosine) = sine_and_cosine(&wave.phase);
    let shape = match wave.shape {
        HarmonicShape::Sine => sine,
        HarmonicShape::Cosine => cosine,
    };
    &wave.mean + &wave.amplitude * shape
}

/// Fractional bits of an irrational sine or cosine. The oracle's longest numbers have 2048 bits; this is enough even
/// for a result of 1e-100.
const BITS: u64 = 2400;

/// Sine and cosine of an angle (rad), with an error up to 2^-[`BITS`]; exact for angle 0.
fn sine_and_cosine(angle: &BigRational) -> (BigRational, BigRational) {
    // A series for an angle below 2^-8, followed by repeated doubling. Each doubling costs two bits.
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
