//! What each number of a case does to the equations.

use super::equations::Equations;
use crate::case::quantity::Dimension;
use crate::case::{Case, schema};
use crate::model::KickTime;

/// Relative step of differences by a parameter. The equations are smooth in all of them: the error is its square.
pub(super) const STEP: f64 = 1e-6;

/// A parameter of the case.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterName {
    /// Dotted path, such as `torsion.damping`.
    pub path: String,
    /// SI, in the notation of the case file.
    pub unit: &'static str,
    /// In that unit.
    pub value: f64,
}

impl ParameterName {
    /// Whether it is the time of the corner of F(t) at `time` (s).
    pub(super) fn is_corner(&self, time: f64) -> bool {
        self.path.starts_with("actuation.") && self.unit == Dimension::Time.unit() && self.value == time
    }
}

/// What a parameter does.
pub(super) enum Influence {
    /// On the equations: at p + d and p - d, and 2 d.
    Equations(Box<Equations>, Box<Equations>, f64),
    /// omega_0.
    Speed,
    /// The time of a kick, s.
    KickTime(f64),
    /// The size of the kick of that time.
    KickSize(KickTime),
    /// None that can be differentiated.
    Undefined,
}

/// The parameters of the case with what each does.
pub(super) fn influences(case: &Case) -> Vec<(ParameterName, Influence)> {
    // The floor of a ringing contact is a convention: it moves no event, it leaves some out. The first speed of a friction
    // table is standstill, and no other.
    let physical = |path: &str| {
        !path.starts_with("solver.")
            && !path.starts_with("output.")
            && ![schema::AXIAL_RINGING_FLOOR, schema::FIRST_SPEED].contains(&path)
    };
    case.number_paths()
        .into_iter()
        .filter(|(path, _)| physical(path))
        .filter_map(|(path, key)| {
            let value = case.number(&path).ok()?;
            let unit = key.dimension().map_or("1", |dimension| dimension.unit());
            let influence = influence(case, &path, value);
            Some((ParameterName { path, unit, value }, influence))
        })
        .collect()
}

fn influence(case: &Case, path: &str, value: f64) -> Influence {
    let kick = path
        .strip_prefix("perturbation.")
        .and_then(|rest| rest.split_once('.'))
        .and_then(|(index, name)| Some((index.parse::<usize>().ok()?, name)));
    match kick {
        Some((_, "time")) => return Influence::KickTime(value),
        Some((index, _)) => return Influence::KickSize(case.parameters.perturbations[index].time),
        None => {}
    }
    if path == "initial.speed" {
        return Influence::Speed;
    }
    // A step at t = 0 is another profile than any ramp.
    if path == "actuation.rise_time" && value == 0.0 {
        return Influence::Undefined;
    }
    let step = if value == 0.0 { STEP } else { STEP * value.abs() };
    let at = |value: f64| Box::new(Equations::new(&case.parameters_with(path, value)));
    Influence::Equations(at(value + step), at(value - step), 2.0 * step)
}
