//! Exact events from an independent code, read from a JSON file such as those in data/truth.

use serde_json::Value;
use std::path::{Path, PathBuf};
use stickslip_case::{Case, WrittenCase};
use stickslip_engine::simulation::is_short;
use stickslip_system::model::system::{ContactLaw, Pressing, System};
use stickslip_system::model::{BreakawayTest, KickTime};
use stickslip_system::record::EventKind;

/// Relative tolerance of equal parameters: the texts are exact, and conversions round once.
const SAME: f64 = 1e-14;

/// Event sequence of a case with more digits than a double.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// Method of the computation, in the words of the file.
    pub method: String,
    /// Kinds and times (s), in order.
    pub events: Vec<(EventKind, f64)>,
    parameters: Vec<(String, f64)>,
    path: PathBuf,
}

impl Truth {
    /// Reads a JSON object with `method`, `parameters` (decimal texts by the paper's symbols or the case's keys) and
    /// `events` (each with `kind` and `time`).
    ///
    /// # Errors
    /// The file has another form.
    pub fn read(path: &Path) -> Result<Truth, String> {
        let form = |why: String| {
            let path = path.display();
            format!("{path}: not a file of true events: {why}; data/truth has three that show the form")
        };
        let text = std::fs::read_to_string(path).map_err(|error| {
            let why = match error.kind() {
                std::io::ErrorKind::NotFound => "no such file".to_owned(),
                _ => error.to_string(),
            };
            format!(
                "{}: the true events cannot be read: {why}; check the name, which counts from the folder of the study",
                path.display()
            )
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
            parameters: parameters.iter().map(parameter).collect::<Result<_, String>>()?,
            path: path.to_owned(),
        })
    }

    /// Checks that the events belong to this case. The error names the first parameter that differs or is missing.
    pub(crate) fn check_case(&self, case: &Case) -> Result<(), String> {
        // A run that ends at another time within the final stick has the same events.
        let until = self.events.last().map_or(0.0, |event| event.1);
        let end = if case.output.end_time > until {
            f64::NAN
        } else {
            case.output.end_time
        };
        let by_keys = self.parameters.iter().any(|(name, _)| name.contains('.'));
        let mut numbers = match by_keys {
            true => keyed(case),
            false => symbols(&case.system)
                .map(|(name, value)| (name.to_owned(), value))
                .into(),
        };
        numbers.push(("t_end".to_owned(), end));
        for (name, here) in numbers {
            let there = self.parameters.iter().find(|p| p.0 == name).map_or(f64::NAN, |p| p.1);
            let same = name == "t_end" && here.is_nan()
                || (there - here).abs() <= SAME * there.abs()
                || (there.is_nan() && here.is_nan());
            if !same {
                return Err(format!(
                    "{}: these events are of another case: {name} is {there:?} there and {here:?} in the case of the study; name the \
                     case that they belong to, or other events",
                    self.path.display()
                ));
            }
        }
        Ok(())
    }
}

fn keyed(case: &Case) -> Vec<(String, f64)> {
    let case = WrittenCase::of(case);
    let numbers = case.numbers().iter();
    numbers.map(|number| (number.path.clone(), number.value)).collect()
}

fn decimal(value: &Value) -> Option<f64> {
    let text = value.as_str()?;
    text.parse().ok().filter(|x: &f64| x.is_finite())
}

/// Parameters under the paper's symbols, NaN if missing. A feature without a symbol has a name that no file contains.
fn symbols(case: &System) -> [(&'static str, f64); 20] {
    let one = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let (axial, ramp) = match &case.pressing {
        Pressing::Axial { axial, actuation } => (Some(axial), actuation.as_ramp()),
        Pressing::Force(_) => (None, None),
    };
    let (rotor, stator) = (&case.rotor, &case.stator);
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
    let unsaid = |differs: bool| differs.then_some(1.0);
    let driven = rotor.torque.is_some() || stator.torque.is_some();
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
            unsaid(case.breakaway_test != BreakawayTest::Transmitted),
        ),
        (
            "a part that the paper's brake has not",
            unsaid(!is_short(case) || driven || case.contact != ContactLaw::StickSlip),
        ),
    ]
    .map(|(name, value)| (name, one(value)))
}
