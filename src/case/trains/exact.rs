//! The trains without rounding.

use super::TrainCase;
use super::keys::{self, TrainKind};
use super::signals::dimension_of;
use crate::case::document::{Node, Value};
use crate::case::exact::{self, decimal};
use crate::case::quantity::Dimension;
use crate::case::schema;
use crate::case::{CaseError, Motion};
use crate::model::KickTime;
use crate::model::trains::parameters::AxialOf;
use crate::model::trains::{
    Bristles, ContactLaw, End, ExactTrains, Initial, Kick, Pressing, Regularisation, Torque, Train,
};
use crate::signal::{Drive, Ramp, Shape, Signal, Table, Wave};
use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{One, Signed, Zero};

/// |omega_r| below which statistics count a stick: as it is written in `whole`, or what stands for it where it is left out.
pub(super) fn threshold(case: &TrainCase, root: &Node, whole: &Node) -> Result<Option<BigRational>, CaseError> {
    const PATH: &str = "friction.threshold";
    let Some(double) = case.threshold else {
        return Ok(None);
    };
    let exact = Exact::new(case, root, whole);
    if exact.written.root.at(PATH).is_some() {
        return exact.number(PATH, Dimension::AngularVelocity, double).map(Some);
    }
    let ten = BigRational::from_integer(10.into());
    Ok(Some(match &case.parameters.contact {
        ContactLaw::Regularised(regularisation) => exact.regularisation(regularisation)?.speed * ten,
        ContactLaw::StickSlip | ContactLaw::Bristles(_) => {
            let law = exact.of_law.law(&case.parameters.law)?;
            let scale = law.numbers.into_iter().find(|(key, _)| *key == "scale");
            match scale {
                Some((_, scale)) => scale / ten,
                None => decimal(PATH, double)?,
            }
        }
    }))
}

/// The numbers of `case` as they are written in `root`.
pub(super) fn read(case: &TrainCase, root: &Node, whole: &Node) -> Result<ExactTrains, CaseError> {
    let motion = case.motion;
    let exact = Exact::new(case, root, whole);
    let trains = &case.parameters;
    let rotor = exact.train("rotor", &trains.rotor)?;
    let stator = exact.train("stator", &trains.stator)?;
    let initial = &trains.initial;
    let kicks = trains.kicks.iter().enumerate().map(|(index, kick)| {
        let path = |name: &str| format!("perturbation.{index}.{name}");
        Ok(Kick {
            time: match kick.time {
                KickTime::At(time) => KickTime::At(exact.number(&path("time"), Dimension::Time, time)?),
                KickTime::Instability => KickTime::Instability,
            },
            relative_velocity: exact.number(
                &path("relative_velocity"),
                Dimension::AngularVelocity,
                kick.relative_velocity,
            )?,
            on: kick.on,
        })
    });
    Ok(ExactTrains {
        radius: match motion {
            Motion::Rotation => exact.of_law.radius()?,
            Motion::Translation => exact::decimal("contact.radius", 1.0)?,
        },
        pressing: match &trains.pressing {
            Pressing::Force(force) => Pressing::Force(exact.drive("contact.normal_force", force)?),
            Pressing::Axial { axial, actuation } => Pressing::Axial {
                axial: AxialOf {
                    mass: exact.number("axial.mass", Dimension::Mass, axial.mass)?,
                    stiffness: exact.number("axial.stiffness", Dimension::Stiffness, axial.stiffness)?,
                    damping: exact.number("axial.damping", Dimension::Damping, axial.damping)?,
                    ringing_floor: exact.number(schema::AXIAL_RINGING_FLOOR, Dimension::Length, axial.ringing_floor)?,
                },
                actuation: actuation.try_map(|field, index, value| {
                    let path = schema::actuation_path(field);
                    let dimension = exact::dimension_of(&path);
                    let element = index.map_or(String::new(), |index| format!(".{index}"));
                    exact.number(&format!("{path}{element}"), dimension, *value)
                })?,
            },
        },
        law: exact.of_law.law(&trains.law)?,
        contact: match &trains.contact {
            ContactLaw::StickSlip => ContactLaw::StickSlip,
            ContactLaw::Regularised(regularisation) => ContactLaw::Regularised(exact.regularisation(regularisation)?),
            ContactLaw::Bristles(bristles) => ContactLaw::Bristles(Bristles {
                stiffness: exact.number(
                    "friction.bristle_stiffness",
                    Dimension::InverseAngle,
                    bristles.stiffness,
                )?,
                damping: exact.number("friction.bristle_damping", Dimension::FrictionDecay, bristles.damping)?,
                viscous: exact.number("friction.viscous", Dimension::FrictionDecay, bristles.viscous)?,
            }),
        },
        breakaway: exact.breakaway(case)?,
        breakaway_test: trains.breakaway_test,
        initial: Initial {
            rotor_twist: exact.list("initial.rotor_twist", &initial.rotor_twist)?,
            rotor_speed: exact.speeds("rotor", &rotor, &initial.rotor_speed)?,
            stator_twist: exact.list("initial.stator_twist", &initial.stator_twist)?,
            stator_speed: exact.speeds("stator", &stator, &initial.stator_speed)?,
        },
        kicks: kicks.collect::<Result<_, CaseError>>()?,
        rotor,
        stator,
    })
}

struct Exact<'a> {
    /// Of the tree in which `friction` holds a law without memory.
    of_law: exact::Reader<'a>,
    /// Of the tree as written.
    written: exact::Reader<'a>,
}

impl<'a> Exact<'a> {
    fn new(case: &TrainCase, root: &'a Node, whole: &'a Node) -> Self {
        let motion = case.motion;
        Exact {
            of_law: exact::Reader { root, motion },
            written: exact::Reader { root: whole, motion },
        }
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
        self.raw(path, self.written.motion.dimension(dimension), default)
    }

    /// As [`Self::number`], of a dimension that no motion changes.
    fn raw(&self, path: &str, dimension: Dimension, default: f64) -> Result<BigRational, CaseError> {
        match self.place(path) {
            Some(place) => self.written.number(place, dimension),
            None => decimal(path, default),
        }
    }

    /// Where the number of a path is written: there, or as a number for a list of one.
    fn place<'p>(&self, path: &'p str) -> Option<&'p str> {
        if self.written.root.at(path).is_some() {
            return Some(path);
        }
        path.strip_suffix(".0").filter(|list| {
            let node = self.written.root.at(list).map(|node| &node.value);
            matches!(node, Some(Value::Integer(_) | Value::Float(_) | Value::Text(_)))
        })
    }

    /// The list of a key of trains.
    fn list(&self, path: &str, values: &[f64]) -> Result<Vec<BigRational>, CaseError> {
        let TrainKind::List(dimension) = keys::find(path).kind else {
            unreachable!("{path} is a list");
        };
        let elements = values.iter().enumerate();
        elements
            .map(|(index, value)| self.number(&format!("{path}.{index}"), dimension, *value))
            .collect()
    }

    /// The signal of a key of trains.
    fn drive(&self, path: &str, drive: &Drive) -> Result<Drive<BigRational>, CaseError> {
        let TrainKind::Signal(dimension) = keys::find(path).kind else {
            unreachable!("{path} is a signal");
        };
        drive.try_map(|inner, value| {
            let dimension = dimension_of(inner, dimension, self.written.motion);
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
        if side == "rotor" && self.written.root.at("initial.speed").is_some() {
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
    fn breakaway(&self, case: &TrainCase) -> Result<BigRational, CaseError> {
        const PATH: &str = "friction.breakaway";
        if self.written.root.at(PATH).is_some() {
            return self.number(PATH, Dimension::Number, f64::NAN);
        }
        let key = case.parameters.law.key_at_vanishing_speed();
        self.number(&format!("friction.{key}"), Dimension::Number, case.parameters.breakaway)
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
