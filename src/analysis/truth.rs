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
        let text_of = |of: &Value, key: &str| of.get(key).and_then(Value::as_str).map(str::to_owned);
        let events = json.get("events").and_then(Value::as_array);
        let events = events.ok_or_else(|| form("it has no list \"events\"".to_owned()))?;
        if events.is_empty() {
            return Err(form("its list \"events\" is empty".to_owned()));
        }
        let event = |(index, event): (usize, &Value)| {
            let name = text_of(event, "kind");
            let kinds = EventKind::ALL.into_iter().filter(|kind| kind.in_event_sequence());
            let kind = kinds.into_iter().find(|kind| Some(kind.name()) == name.as_deref());
            let wrong = format!("event {index} has no kind of the event sequence, or no time that is a decimal text");
            kind.zip(event.get("time").and_then(decimal)).ok_or_else(|| form(wrong))
        };
        let events: Vec<(EventKind, f64)> = events.iter().enumerate().map(event).collect::<Result<_, _>>()?;
        if let Some(index) = events.windows(2).position(|pair| pair[1].1 < pair[0].1) {
            return Err(form(format!("event {} comes before event {index}", index + 1)));
        }
        let parameters = json.get("parameters").and_then(Value::as_object);
        let parameters = parameters.ok_or_else(|| form("it has no object \"parameters\"".to_owned()))?;
        let parameter = |(name, value): (&String, &Value)| {
            let value = decimal(value).ok_or_else(|| form(format!("parameter {name} is no decimal text")))?;
            Ok((name.clone(), value))
        };
        Ok(Truth {
            method: text_of(&json, "method").unwrap_or_else(|| "not said".to_owned()),
            events,
            parameters: parameters.iter().map(parameter).collect::<Result<_, _>>()?,
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
fn symbols(case: &System) -> [(&'static str, f64); 19] {
    let one = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let (axial, ramp) = match &case.pressing {
        Pressing::Axial { axial, actuation } => (Some(axial), actuation.as_ramp()),
        Pressing::Force(_) => (None, None),
    };
    let (rotor, stator) = (&case.rotor, &case.stator);
    // What both trains have alike.
    let alike = |of_rotor: &[f64], of_stator: &[f64]| match (of_rotor, of_stator) {
        ([one], [other]) if one == other => Some(*one),
        _ => None,
    };
    let surfaces = alike(&rotor.inertia[..rotor.inertia.len().min(1)], &stator.inertia);
    let undisturbed = rotor.viscous.iter().chain(&stator.viscous).all(|d| *d == 0.0);
    let disk = match rotor.inertia.as_slice() {
        [_, disk] if undisturbed => Some(*disk),
        _ => None,
    };
    let speed = match case.initial.rotor_speed.as_slice() {
        [one, other] if one == other => Some(*one),
        _ => None,
    };
    let kick = match case.kicks.as_slice() {
        [kick] => Some(kick),
        _ => None,
    };
    let kick_time = kick.map(|kick| match kick.time {
        KickTime::At(time) => time,
        KickTime::Instability => f64::INFINITY,
    });
    let several = (case.kicks.len() > 1).then_some(case.kicks.len() as f64);
    let law = case.law.as_exponential();
    [
        ("k_e", axial.map(|axial| axial.stiffness)),
        ("c_a", axial.map(|axial| axial.damping)),
        ("m", axial.map(|axial| axial.mass)),
        ("F_0", ramp.map(|ramp| ramp.value)),
        ("t_0", ramp.map(|ramp| ramp.rise_time)),
        ("k_t", alike(&rotor.stiffness, &stator.stiffness)),
        ("c_t", alike(&rotor.damping, &stator.damping)),
        ("r", Some(case.radius)),
        ("I", disk),
        ("J", surfaces),
        ("mu_0", Some(case.breakaway)),
        ("mu_s", law.map(|law| law.low_speed)),
        ("mu_d", law.map(|law| law.high_speed)),
        ("alpha", law.map(|law| law.decay)),
        ("omega_0", speed),
        ("kick_time", kick_time),
        ("kick_relative_velocity", kick.map(|kick| kick.relative_velocity)),
        ("number of kicks", several),
        (
            "breakaway test",
            (case.breakaway_test != BreakawayTest::Transmitted).then_some(1.0),
        ),
    ]
    .map(|(name, value)| (name, one(value)))
}
