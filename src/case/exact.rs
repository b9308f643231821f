//! The physical parameters of a case without rounding.

use super::document::{self, Node, Override, Value};
use super::error::{CaseError, Problem};
use super::quantity::{self, Dimension};
use super::schema::{self, Key};
use super::{Case, CaseSource, Motion, key_of};
use crate::friction::FrictionLaw;
use crate::model::contact::{uniform_pressure_radius, uniform_wear_radius};
use crate::model::{Axial, ExactLaw, ExactParameters, Kick, KickTime};
use num_bigint::BigInt;
use num_rational::BigRational;

pub(super) fn read(source: &CaseSource, overrides: &[Override]) -> Result<ExactParameters, CaseError> {
    let (case, root) = parsed(source, overrides)?;
    let reader = Reader {
        root: &root,
        motion: Motion::Rotation,
    };
    let actuation = case.parameters.actuation.try_map(|field, index, _| {
        let path = schema::actuation_path(field);
        let dimension = dimension_of(&path);
        let element = index.map_or(String::new(), |index| format!(".{index}"));
        reader.number(&format!("{path}{element}"), dimension)
    })?;
    let kicks = case.parameters.perturbations.iter().enumerate().map(|(index, kick)| {
        Ok(Kick {
            time: match kick.time {
                KickTime::Instability => KickTime::Instability,
                KickTime::At(_) => KickTime::At(reader.number(&format!("perturbation.{index}.time"), Dimension::Time)?),
            },
            relative_velocity: reader.number(
                &format!("perturbation.{index}.relative_velocity"),
                Dimension::AngularVelocity,
            )?,
        })
    });
    Ok(ExactParameters {
        mass: reader.number("axial.mass", Dimension::Mass)?,
        axial_stiffness: reader.number("axial.stiffness", Dimension::Stiffness)?,
        axial_damping: reader.number("axial.damping", Dimension::Damping)?,
        ringing_floor: match root.at(schema::AXIAL_RINGING_FLOOR) {
            Some(_) => reader.number(schema::AXIAL_RINGING_FLOOR, Dimension::Length)?,
            None => decimal(schema::AXIAL_RINGING_FLOOR, Axial::RINGING_FLOOR)?,
        },
        actuation,
        rotor_inertia: reader.number("torsion.rotor_inertia", Dimension::Inertia)?,
        surface_inertia: reader.number("torsion.surface_inertia", Dimension::Inertia)?,
        torsional_stiffness: reader.number("torsion.stiffness", Dimension::TorsionalStiffness)?,
        torsional_damping: reader.number("torsion.damping", Dimension::TorsionalDamping)?,
        radius: reader.radius()?,
        breakaway_test: case.parameters.contact.breakaway_test,
        breakaway: reader.number("friction.breakaway", Dimension::Number)?,
        law: reader.law(&case.parameters.friction.law)?,
        speed: reader.number("initial.speed", Dimension::AngularVelocity)?,
        kicks: kicks.collect::<Result<_, CaseError>>()?,
    })
}

/// Of a key that is a number or a list of them.
pub(super) fn dimension_of(path: &str) -> Dimension {
    key_of(path).and_then(Key::dimension).unwrap_or(Dimension::Number)
}

/// The case, whose reader finds and reports whatever is wrong with it, and the tree of its values.
fn parsed(source: &CaseSource, overrides: &[Override]) -> Result<(Case, Node), CaseError> {
    let case = Case::parse(source, overrides)?;
    let mut root = document::read(&source.text, &source.label())?;
    for change in overrides {
        document::apply(&mut root, change).map_err(|problem| CaseError {
            problems: vec![problem],
        })?;
    }
    Ok((case, root))
}

/// Of each number of the case that is written as such, half a unit of its last digit, SI, by dotted path. A plain number
/// counts as the shortest decimal of its double: zeros at its end are not told from none.
pub(super) fn half_last_digits(source: &CaseSource, overrides: &[Override]) -> Result<Vec<(String, f64)>, CaseError> {
    let (case, root) = parsed(source, overrides)?;
    let half = |path: &str, dimension: Dimension| {
        // A plain number is in SI, whatever it stands for.
        let (text, dimension) = match &root.at(path)?.value {
            Value::Integer(number) => (number.to_string(), Dimension::Number),
            Value::Float(number) => (format!("{number:e}"), Dimension::Number),
            Value::Text(text) => (text.clone(), dimension),
            _ => return None,
        };
        quantity::printed(&text, dimension).ok().map(|(_, half)| half)
    };
    let paths = case.number_paths().into_iter();
    Ok(paths
        .filter(|(path, _)| path != schema::AXIAL_RINGING_FLOOR)
        .filter_map(|(path, key)| {
            let half = half(&path, key.dimension().unwrap_or(Dimension::Number))?;
            Some((path, half))
        })
        .collect())
}

/// The shortest decimal of a double.
pub(super) fn decimal(path: &str, number: f64) -> Result<BigRational, CaseError> {
    quantity::decimal(&format!("{number:e}")).map_err(|message| problem(path, message))
}

fn problem(path: &str, message: String) -> CaseError {
    CaseError {
        problems: vec![Problem {
            place: String::new(),
            key: path.to_owned(),
            message,
        }],
    }
}

/// Reads numbers of a valid case from the tree of its values.
pub(super) struct Reader<'a> {
    pub(super) root: &'a Node,
    /// What the numbers measure.
    pub(super) motion: Motion,
}

impl Reader<'_> {
    pub(super) fn number(&self, path: &str, dimension: Dimension) -> Result<BigRational, CaseError> {
        let value = match self.root.at(path).map(|node| &node.value) {
            Some(Value::Integer(number)) => Ok(BigRational::from_integer(BigInt::from(*number))),
            Some(Value::Float(number)) => return decimal(path, *number),
            Some(Value::Text(text)) => quantity::exact(text, dimension),
            _ => Err("expected a number".to_owned()),
        };
        value.map_err(|message| problem(path, message))
    }

    fn series(&self, path: &str, length: usize, dimension: Dimension) -> Result<Vec<BigRational>, CaseError> {
        (0..length)
            .map(|index| self.number(&format!("{path}.{index}"), dimension))
            .collect()
    }

    /// The parameters of the friction law; those that are left out by their defaults.
    pub(super) fn law(&self, law: &FrictionLaw) -> Result<ExactLaw, CaseError> {
        let mut exact = ExactLaw {
            name: law.name(),
            numbers: Vec::new(),
            lists: Vec::new(),
            words: Vec::new(),
        };
        for &key in FrictionLaw::keys_of(law.name()) {
            let path = format!("friction.{key}");
            let dimension = self.motion.dimension(dimension_of(&path));
            if let Some(values) = law.list(key) {
                exact.lists.push((key, self.series(&path, values.len(), dimension)?));
            } else if let Some(word) = law.word(key) {
                exact.words.push((key, word));
            } else {
                let value = match (self.root.at(&path), law.number(key)) {
                    (None, Some(default)) => decimal(&path, default)?,
                    _ => self.number(&path, dimension)?,
                };
                exact.numbers.push((key, value));
            }
        }
        Ok(exact)
    }

    /// r, given or from the diameters by equation (6) or (7).
    pub(super) fn radius(&self) -> Result<BigRational, CaseError> {
        if self.root.at("contact.radius").is_some() {
            return self.number("contact.radius", Dimension::Length);
        }
        let outer = self.number("contact.outer_diameter", Dimension::Length)?;
        let inner = self.number("contact.inner_diameter", Dimension::Length)?;
        let pressure = matches!(
            self.root.at("contact.wear").map(|node| &node.value),
            Some(Value::Text(wear)) if wear == schema::UNIFORM_PRESSURE
        );
        Ok(if pressure {
            uniform_pressure_radius(outer, inner)
        } else {
            uniform_wear_radius(outer, inner)
        })
    }
}
