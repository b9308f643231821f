//! Events of an independent code with more digits, from a JSON file such as those of data/truth.

use crate::model::system::{Pressing, System};
use crate::model::{BreakawayTest, KickTime};
use crate::record::EventKind;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Two parameters are the same if they differ by no more than this share: the texts are exact, conversions rounded once.
const SAME: f64 = 1e-14;

/// Why a file of true events is of no use.
#[derive(Debug, thiserror::Error)]
pub enum TruthError {
    /// It cannot be read.
    #[error("{path}: the true events cannot be read: {why}; check the name, which counts from the folder of the study")]
    Unreadable {
        /// Of the file.
        path: PathBuf,
        /// In words.
        why: String,
    },
    /// It is not such a file.
    #[error("{path}: not a file of true events: {why}; data/truth has three that show the form")]
    Form {
        /// Of the file.
        path: PathBuf,
        /// In words.
        why: String,
    },
    /// It belongs to another case.
    #[error(
        "{path}: these events are of another case: {name} is {there:?} there and {here:?} in the case of the study; name \
         the case that they belong to, or other events"
    )]
    OtherCase {
        /// Of the file.
        path: PathBuf,
        /// Of the parameter, by the paper's symbol.
        name: &'static str,
        /// Its value in the file, SI; NaN if it is not there.
        there: f64,
        /// Its value in the case, SI; NaN if the case has none.
        here: f64,
    },
}

/// The event sequence of a case, to more digits than a double has.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// How it was computed, in the words of the file.
    pub method: String,
    /// Kinds and times (s), in order.
    pub events: Vec<(EventKind, f64)>,
    /// Names and values of the case's parameters, in SI.
    parameters: Vec<(String, f64)>,
    path: PathBuf,
}

impl Truth {
    /// Reads a file: an object with `method`, `parameters` (decimal texts by the paper's symbols) and `events` (each with
    /// `kind` and `time`).
    ///
    /// # Errors
    /// If it cannot be read or has another form.
    pub fn read(path: &Path) -> Result<Truth, TruthError> {
        let unreadable = |why: String| TruthError::Unreadable {
            path: path.to_owned(),
            why,
        };
        let form = |why: String| TruthError::Form {
            path: path.to_owned(),
            why,
        };
        let text = std::fs::read_to_string(path).map_err(|error| {
            unreadable(match error.kind() {
                std::io::ErrorKind::NotFound => "no such file".to_owned(),
                _ => error.to_string(),
            })
        })?;
        let json: Value = serde_json::from_str(&text).map_err(|error| form(format!("not JSON: {error}")))?;
        let events = json.get("events").and_then(Value::as_array);
        let events = events.ok_or_else(|| form("it has no list \"events\"".to_owned()))?;
        if events.is_empty() {
            return Err(form("its list \"events\" is empty".to_owned()));
        }
        let events = events.iter().enumerate().map(|(index, event)| {
            let kind = event.get("kind").and_then(Value::as_str).unwrap_or_default();
            let kind = EventKind::ALL
                .into_iter()
                .find(|k| k.name() == kind && k.in_event_sequence());
            let time = event.get("time").and_then(decimal);
            kind.zip(time).ok_or_else(|| {
                form(format!(
                    "event {index} has no kind of the event sequence, or no time that is a decimal text"
                ))
            })
        });
        let events: Vec<(EventKind, f64)> = events.collect::<Result<_, _>>()?;
        if let Some(index) = events.windows(2).position(|pair| pair[1].1 < pair[0].1) {
            return Err(form(format!("event {} comes before event {index}", index + 1)));
        }
        let parameters = json.get("parameters").and_then(Value::as_object);
        let parameters = parameters.ok_or_else(|| form("it has no object \"parameters\"".to_owned()))?;
        let parameters = parameters
            .iter()
            .map(|(name, value)| {
                let value = decimal(value).ok_or_else(|| form(format!("parameter {name} is no decimal text")))?;
                Ok((name.clone(), value))
            })
            .collect::<Result<_, _>>()?;
        Ok(Truth {
            method: json
                .get("method")
                .and_then(Value::as_str)
                .unwrap_or("not said")
                .to_owned(),
            events,
            parameters,
            path: path.to_owned(),
        })
    }

    /// Whether the events are those of this case, which ends at `end_time` (s).
    ///
    /// # Errors
    /// With the first parameter that differs or is not in the file.
    pub(crate) fn check_case(&self, case: &System, end_time: f64) -> Result<(), TruthError> {
        // A run that ends elsewhere in the final stick has the same events.
        let until = self.events.last().map_or(0.0, |event| event.1);
        let end = if end_time > until { f64::NAN } else { end_time };
        for (name, here) in symbols(case).into_iter().chain([("t_end", end)]) {
            let there = self.parameters.iter().find(|p| p.0 == name).map_or(f64::NAN, |p| p.1);
            let same = name == "t_end" && here.is_nan()
                || (there - here).abs() <= SAME * there.abs()
                || (there.is_nan() && here.is_nan());
            if !same {
                return Err(TruthError::OtherCase {
                    path: self.path.clone(),
                    name,
                    there,
                    here,
                });
            }
        }
        Ok(())
    }
}

fn decimal(value: &Value) -> Option<f64> {
    let text = value.as_str()?;
    text.parse().ok().filter(|x: &f64| x.is_finite())
}

/// The parameters under the names of such a file; NaN for what the case does not have. What such a file cannot say has a
/// name that none of its parameters bears.
fn symbols(case: &System) -> Vec<(&'static str, f64)> {
    const NONE: f64 = f64::NAN;
    let (mass, stiffness, damping, ramp) = match &case.pressing {
        Pressing::Axial { axial, actuation } => (axial.mass, axial.stiffness, axial.damping, actuation.as_ramp()),
        Pressing::Force(_) => (NONE, NONE, NONE, None),
    };
    let (force, rise_time) = ramp.map_or((NONE, NONE), |ramp| (ramp.value, ramp.rise_time));
    let (rotor, stator) = (&case.rotor, &case.stator);
    // What both trains have alike.
    let alike = |of_rotor: &[f64], of_stator: &[f64]| match (of_rotor, of_stator) {
        ([one], [other]) if one == other => *one,
        _ => NONE,
    };
    let surfaces = alike(&rotor.inertia[..rotor.inertia.len().min(1)], &stator.inertia);
    let undisturbed = rotor.viscous.iter().chain(&stator.viscous).all(|d| *d == 0.0);
    let disk = match rotor.inertia.as_slice() {
        [_, disk] if undisturbed => *disk,
        _ => NONE,
    };
    let speed = match case.initial.rotor_speed.as_slice() {
        [one, other] if one == other => *one,
        _ => NONE,
    };
    let (kick_time, kick) = match case.kicks.as_slice() {
        [kick] => match kick.time {
            KickTime::At(time) => (time, kick.relative_velocity),
            KickTime::Instability => (f64::INFINITY, kick.relative_velocity),
        },
        _ => (f64::NAN, f64::NAN),
    };
    let several = if case.kicks.len() > 1 {
        case.kicks.len() as f64
    } else {
        f64::NAN
    };
    let law = case.law.as_exponential();
    let test = if case.breakaway_test == BreakawayTest::Transmitted {
        f64::NAN
    } else {
        1.0
    };
    vec![
        ("k_e", stiffness),
        ("c_a", damping),
        ("m", mass),
        ("F_0", force),
        ("t_0", rise_time),
        ("k_t", alike(&rotor.stiffness, &stator.stiffness)),
        ("c_t", alike(&rotor.damping, &stator.damping)),
        ("r", case.radius),
        ("I", disk),
        ("J", surfaces),
        ("mu_0", case.breakaway),
        ("mu_s", law.map_or(f64::NAN, |law| law.low_speed)),
        ("mu_d", law.map_or(f64::NAN, |law| law.high_speed)),
        ("alpha", law.map_or(f64::NAN, |law| law.decay)),
        ("omega_0", speed),
        ("kick_time", kick_time),
        ("kick_relative_velocity", kick),
        ("number of kicks", several),
        ("breakaway test", test),
    ]
}
