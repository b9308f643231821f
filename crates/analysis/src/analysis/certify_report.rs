//! A certification as JSON document, and as groups of a result file: /certificate, /sensitivity, /events/time_uncertainty.

use super::advice::remedy;
use super::bands::{BandStretch, Bands, ChannelBand};
use super::certificate::{Certificate, CertifiedEvent, Verdict};
use super::certification::Certified;
use super::ladder::Rung;
use super::linearised::Slope;
use super::sensitivity::{Affected, CaseSensitivities, Sensitivities, Sensitivity, SensitivityRerun};
use super::stability::growth::Onset;
use crate::provenance::extension;
use serde::{Serialize, Serializer};
use serde_json::json;
use std::collections::BTreeMap;
use stickslip_case::{Case, CaseNumber};
use stickslip_files::schema::{TIME_UNCERTAINTY, Variable, extended_tables, group};
use stickslip_files::{Addition, DeclaredColumn, FileColumn, columns};
use stickslip_oracle::OracleSolution;

/// A certification as it is reported: certificate, sensitivities and exact events of a case.
#[derive(Debug, Serialize)]
pub struct CertifyReport<'a> {
    /// The case.
    #[serde(skip)]
    pub case: &'a Case,
    /// Certificate, sensitivities and exact solution.
    #[serde(skip)]
    pub certified: &'a Certified,
    /// Origin of the case.
    #[serde(rename = "case")]
    pub source: String,
    /// Overrides of the case, in words.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub changed: Vec<String>,
    /// Certified file.
    pub file: String,
    /// Figure of the onsets, if it was requested.
    pub figure: Option<String>,
    /// First sticks over the tolerance, for the figure.
    pub onsets: &'a [Onset],
    /// Whether the short report also has exact times, if there is an exact solution.
    #[serde(skip)]
    pub shows_exact: bool,
    /// Wall time, s.
    pub seconds: f64,
    title: &'a str,
    #[serde(flatten)]
    certificate: &'a Certificate,
    channels: &'a [ChannelBand],
    stretches: Vec<StretchDocument<'a>>,
    uncertainty_by: &'static str,
    converged: bool,
    remedy: String,
    digits: Option<u32>,
    digits_of_double: Option<u32>,
    warnings: Vec<String>,
    sensitivity: Vec<ParameterDocument<'a>>,
    final_stick: Option<&'a Sensitivities>,
    result: Option<serde_json::Value>,
    without_sensitivities: Option<&'a str>,
    oracle: Option<OracleDocument>,
}

#[derive(Debug, Serialize)]
struct StretchDocument<'a> {
    start: f64,
    end: f64,
    mode: &'static str,
    converged: bool,
    time_uncertainty: f64,
    bands: BTreeMap<&'a str, f64>,
    rates: BTreeMap<&'a str, f64>,
}

#[derive(Debug, Serialize)]
struct ParameterDocument<'a> {
    parameter: &'a str,
    unit: &'static str,
    value: f64,
    half_last_digit: Option<f64>,
    time_sensitivity: Vec<f64>,
    time_sensitivity_uncertainty: Vec<f64>,
    final_stick: Option<&'a Sensitivity>,
    result: Option<&'a Sensitivity>,
}

#[derive(Debug, Serialize)]
struct OracleDocument {
    digits: u32,
    bits: usize,
    steps: u64,
    seconds: f64,
    events: Vec<ExactEventDocument>,
    true_errors: Vec<Option<f64>>,
}

#[derive(Debug, Serialize)]
struct ExactEventDocument {
    kind: &'static str,
    time: String,
    digits: u32,
    error: f64,
    state_after: BTreeMap<&'static str, String>,
}

impl<'a> CertifyReport<'a> {
    /// Report on a certified result of `case`, which comes from `source`; `file` has its certificate.
    pub fn new(case: &'a Case, certified: &'a Certified, source: String, file: String) -> Self {
        let c = &certified.certificate;
        let result = certified.result_sensitivities();
        CertifyReport {
            case,
            certified,
            source,
            changed: Vec::new(),
            file,
            figure: None,
            onsets: &[],
            shows_exact: false,
            seconds: f64::NAN,
            title: &case.title,
            certificate: c,
            channels: &c.bands.channels,
            stretches: c.bands.stretches.iter().map(|one| stretch(one, &c.bands)).collect(),
            uncertainty_by: c.uncertainty_by(),
            converged: c.verdict == Verdict::Converged,
            remedy: remedy(c),
            digits: c.least_digits(),
            digits_of_double: c.most_digits(),
            warnings: c.warnings.iter().map(ToString::to_string).collect(),
            sensitivity: certified.known_sensitivities().map(parameters).unwrap_or_default(),
            final_stick: result.filter(|result| result.of == Affected::FinalStick),
            result: result.map(|result| json!({ "of": result.of, "value": result.time })),
            without_sensitivities: certified.without_sensitivities(),
            oracle: certified.exact.as_ref().map(|exact| oracle(exact, c)),
        }
    }
}

impl Certified {
    /// Sensitivities, if they are known.
    pub fn known_sensitivities(&self) -> Option<&CaseSensitivities> {
        self.sensitivities.as_ref()?.as_ref().ok()
    }

    /// Sensitivities of the run's result, if they are known.
    pub fn result_sensitivities(&self) -> Option<&Sensitivities> {
        self.known_sensitivities()?.result.as_ref()
    }

    /// Reason for missing sensitivities.
    pub fn without_sensitivities(&self) -> Option<&str> {
        Some(self.sensitivities.as_ref()?.as_ref().err()?)
    }
}

impl Serialize for Sensitivity {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Influence<'a> {
            slope: Option<f64>,
            by_slope: Option<f64>,
            minus: Option<&'a SensitivityRerun>,
            plus: Option<&'a SensitivityRerun>,
            nonlinear: Option<bool>,
        }
        let [minus, plus] = [0, 1].map(|side| self.reruns.as_ref().map(|reruns| &reruns[side]));
        let influence = Influence {
            slope: self.slope,
            by_slope: self.predicted(),
            minus,
            plus,
            nonlinear: self.nonlinear(),
        };
        influence.serialize(serializer)
    }
}

fn stretch<'a>(stretch: &BandStretch, bands: &'a Bands) -> StretchDocument<'a> {
    let names = || bands.channels.iter().map(|channel| channel.name.as_str());
    let of = |numbers: &[f64]| names().zip(numbers.iter().copied()).collect();
    StretchDocument {
        start: stretch.start,
        end: stretch.end,
        mode: stretch.mode.name(),
        converged: stretch.converged,
        time_uncertainty: stretch.time_uncertainty,
        bands: of(&stretch.bands),
        rates: of(&stretch.rates),
    }
}

fn parameters(known: &CaseSensitivities) -> Vec<ParameterDocument<'_>> {
    let of_stick = known
        .result
        .as_ref()
        .is_some_and(|result| result.of == Affected::FinalStick);
    let document = |column: usize| {
        let parameter = &known.parameters[column];
        let slopes = |of: fn(&Slope) -> f64| known.events.iter().map(|row| of(&row[column])).collect();
        let row = known.result.as_ref().map(|result| &result.rows[column]);
        ParameterDocument {
            parameter: &parameter.path,
            unit: parameter.unit,
            value: parameter.value,
            half_last_digit: row.and_then(|row| row.parameter.half_last_digit),
            time_sensitivity: slopes(|slope| slope.value),
            time_sensitivity_uncertainty: slopes(|slope| slope.uncertainty),
            final_stick: row.filter(|_| of_stick),
            result: row,
        }
    };
    (0..known.parameters.len()).map(document).collect()
}

fn oracle(exact: &OracleSolution, c: &Certificate) -> OracleDocument {
    let events = exact.report.events.iter().enumerate().map(|(index, event)| {
        let digits = exact.digits_of_event(index);
        let state = event.state.components().into_iter();
        ExactEventDocument {
            kind: event.kind.name(),
            time: event.time.to_decimal(digits as usize),
            digits,
            error: exact.errors[index],
            state_after: state
                .map(|(name, value)| (name, value.to_decimal(digits as usize)))
                .collect(),
        }
    });
    OracleDocument {
        digits: exact.digits,
        bits: exact.report.bits,
        steps: exact.report.steps,
        seconds: exact.seconds,
        events: events.collect(),
        true_errors: c.events.iter().map(|event| event.true_error).collect(),
    }
}

fn missing(x: Option<f64>) -> f64 {
    x.unwrap_or(f64::NAN)
}

fn finite(x: f64) -> f64 {
    if x.is_finite() { x } else { f64::NAN }
}

impl Certified {
    /// Additions to the file of the certified result, for [`stickslip_files::write_certified`].
    pub fn additions(&self, case: &Case) -> Vec<Addition> {
        let uncertainties = self.certificate.events.iter().map(|e| finite(e.uncertainty));
        let about = "how far from the exact solution of the stated model the event can be; NaN: not converged";
        let mut events = Addition::new(group::EVENTS);
        let variable = Variable::quantity(TIME_UNCERTAINTY, "s", about);
        events.over(&["event"], FileColumn::new(variable, uncertainties));
        vec![events, self.certificate_group(case), self.sensitivity_group(case)]
    }

    fn certificate_group(&self, case: &Case) -> Addition {
        let c = &self.certificate;
        let mut group = Addition::new(group::CERTIFICATE);
        group.attribute("verdict_of_all", c.verdict.name());
        group.attribute("uncertainty_by", c.uncertainty_by());
        group.attribute("contradiction", c.contradiction.clone().unwrap_or_default());
        group.attribute("remedy", remedy(c));
        for (name, number) in [
            ("digits", c.least_digits().map(f64::from)),
            ("digits_of_double", c.most_digits().map(f64::from)),
            ("growth_exponent", c.growth_exponent),
            ("growth_to_onset", c.growth_to_onset),
            ("kick_above_noise", c.kick_above_noise),
            ("kick_above_methods", c.kick_above_methods),
        ] {
            group.attribute(name, missing(number));
        }
        add_events(&mut group, c);
        add_ladder(&mut group, c);
        add_bands(&mut group, case, c);
        if let Some(exact) = &self.exact {
            let long_name = "exact events in multiple precision: time (s), kind, states (CSV)";
            group.text("oracle", long_name, csv(case.words.has_letters(), exact));
        }
        group
    }

    fn sensitivity_group(&self, case: &Case) -> Addition {
        let known = self.known_sensitivities();
        let parameters = known.map_or(&[][..], |known| &known.parameters);
        let events = self.certificate.events.len();
        let mut group = Addition::new(group::SENSITIVITY);
        let list = |of: fn(&CaseNumber) -> &str| parameters.iter().map(of).collect::<Vec<_>>().join(", ");
        group.attribute("parameters", list(|parameter| &parameter.path));
        group.attribute("parameter_units", list(|parameter| parameter.unit));
        group.dimension("event", events, "index of the event");
        group.dimension("parameter", parameters.len(), "index of the parameter");
        // An event that has not converged has no known derivative.
        let mut add = |name: &str, about: &str, required: bool, of: fn(&Slope) -> f64| {
            let row = |index: usize| match known.and_then(|known| known.events.get(index)) {
                Some(row) => row.iter().map(of).collect(),
                None => vec![f64::NAN; parameters.len()],
            };
            let values: Vec<f64> = (0..events).flat_map(row).collect();
            if required || values.iter().any(|x| !x.is_nan()) {
                let column = FileColumn::new(Variable::quantity(name, "s", about), values);
                group.over(&["event", "parameter"], column);
            }
        };
        let about =
            "d(event time)/d(parameter), s for each unit of the parameter (attribute parameter_units of the group)";
        add("time_sensitivity", about, true, |slope| slope.value);
        let about = "how far time_sensitivity can be off, in its unit";
        add("time_sensitivity_uncertainty", about, false, |slope| slope.uncertainty);
        let result = known.and_then(|known| known.result.as_ref());
        let affected = match result {
            Some(result) => result.of,
            None if case.stops() => Affected::FinalStick,
            None => Affected::LastEvent,
        };
        add_sensitivities(&mut group, result, affected, parameters.len());
        group.attribute("of", affected.name());
        if let Some(why) = self.without_sensitivities() {
            group.attribute("without_sensitivities", why);
        }
        group
    }
}

const EVENT_COLUMNS: &[DeclaredColumn<CertifiedEvent>] = &columns! { event:
    Variable::words("verdict", "verdict on the event", Verdict::codes()), f64::from(event.verdict as i8);
    Variable::words("ladder_verdict", "verdict on the event by the ladder of methods alone", Verdict::codes()),
        f64::from(event.ladder_verdict as i8);
    Variable::quantity(
        "ladder_uncertainty", "s", "uncertainty of the event by the ladder of methods alone; NaN: not converged"),
        finite(event.ladder_uncertainty);
    Variable::quantity(
        TRUE_ERROR, "s",
        "distance of the event from the exact one, own less exact; NaN: the exact solution has none near it"),
        missing(event.true_error);
    Variable::quantity(
        "rounding", "s",
        "how far rounding to double precision, of the input and of the state and the clock at every event before, moves the event"),
        finite(event.rounding);
    Variable::quantity(
        "growth", "1",
        "e-folds by which a deviation has grown from the loss of stability, or from a later kick on smooth sliding, to the event"),
        missing(event.growth);
};

/// Column of certificates by the oracle.
const TRUE_ERROR: &str = "true_error";

const RUNG_COLUMNS: &[DeclaredColumn<Rung>] = &columns! { rung:
    Variable::quantity("rung_rtol", "1", "relative tolerance"), rung.rtol;
    Variable::count("rung_agreeing", "events of the sequence that agree with the result's, from the first on"),
        rung.agreeing as f64;
    Variable::quantity("rung_distance", "s", "largest distance to the result over the agreeing events"),
        missing(rung.distance);
};

const STRETCH_ENDS: &[DeclaredColumn<BandStretch>] = &columns! { stretch:
    Variable::quantity("stretch_start", "s", "where it starts"), stretch.start;
    Variable::quantity("stretch_end", "s", "where it ends"), stretch.end;
};

fn add_events(group: &mut Addition, c: &Certificate) {
    group.dimension("event", c.events.len(), "index of the event");
    let known = |column: &&DeclaredColumn<_>| c.by_oracle || (column.variable)().name != TRUE_ERROR;
    group.table("event", EVENT_COLUMNS.iter().filter(known), &c.events);
}

fn add_ladder(group: &mut Addition, c: &Certificate) {
    group.dimension("rung", c.ladder.len(), "index of the run of the ladder");
    let mut methods: Vec<&str> = Vec::new();
    let codes = c.ladder.iter().map(|rung| {
        let known = methods.iter().position(|name| *name == rung.method);
        known.unwrap_or_else(|| {
            methods.push(rung.method);
            methods.len() - 1
        }) as i8
    });
    let codes: Vec<i8> = codes.collect();
    let words = (0..).zip(methods.into_iter().map(str::to_owned)).collect();
    group.over(
        &["rung"],
        FileColumn::codes("rung_method", "integration method", codes, words),
    );
    group.table("rung", RUNG_COLUMNS, &c.ladder);
}

fn add_bands(group: &mut Addition, case: &Case, c: &Certificate) {
    let stretches = &c.bands.stretches;
    let about = "index of the stretch: before the event of the same index, the last before the end of the run";
    group.dimension("stretch", stretches.len(), about);
    group.table("stretch", STRETCH_ENDS, stretches);
    let mut add = |variable: Variable, of: &dyn Fn(&BandStretch) -> f64| {
        group.over(&["stretch"], FileColumn::new(variable, stretches.iter().map(of)));
    };
    let [trajectory, ..] = extended_tables(&extension(case));
    let mode = trajectory
        .variables
        .into_iter()
        .find(|variable| variable.name == "mode");
    let modes = mode.map(|mode| mode.flags).unwrap_or_default();
    let mode = Variable::words("stretch_mode", "what the contact does in it", modes);
    add(mode, &|stretch| stretch.mode.code().into());
    let about = "larger uncertainty of the events at its ends; NaN: not converged";
    add(Variable::quantity("stretch_time_uncertainty", "s", about), &|stretch| {
        stretch.time_uncertainty
    });
    for (k, ChannelBand { name, unit, .. }) in c.bands.channels.iter().enumerate() {
        let about = format!(
            "how far {name} can be from the exact solution at the same share of its own way between the events"
        );
        add(Variable::quantity(&format!("band_{name}"), unit, &about), &|stretch| {
            stretch.bands[k]
        });
        let about =
            format!("largest |d({name})/dt|; times stretch_time_uncertainty, what to add to the band at a fixed time");
        let unit = match unit.strip_suffix("s-1") {
            Some(rest) => format!("{rest}s-2"),
            None => format!("{unit} s-1"),
        };
        add(Variable::quantity(&format!("rate_{name}"), &unit, &about), &|stretch| {
            stretch.rates[k]
        });
    }
}

/// Effects of half a unit in the last digit. A missing number is NaN, a missing code or count -1.
fn add_sensitivities(group: &mut Addition, found: Option<&Sensitivities>, of: Affected, parameters: usize) {
    group.attribute("held", found.map_or("", |found| &found.held));
    let without_reruns = match found {
        Some(found) => found.without_reruns.clone().unwrap_or_default(),
        None => format!("no {} that is converged", of.words().trim_start_matches("the ")),
    };
    group.attribute("without_reruns", without_reruns);
    let mut add = |variable: Variable, missing: f64, of: &dyn Fn(&Sensitivity) -> Option<f64>| {
        let value = |column: usize| found.and_then(|found| of(&found.rows[column])).unwrap_or(missing);
        group.over(&["parameter"], FileColumn::new(variable, (0..parameters).map(value)));
    };
    let about =
        "half a unit in the last written digit, in the unit of the parameter (attribute parameter_units of the group)";
    add(Variable::quantity("half_last_digit", "1", about), f64::NAN, &|row| {
        row.parameter.half_last_digit
    });
    let not_made = (-1, "not-made".to_owned());
    let outcomes: Vec<_> = std::iter::once(not_made).chain(of.outcomes()).collect();
    for (side, (name, where_to)) in [("minus", "lower"), ("plus", "higher")].into_iter().enumerate() {
        let rerun = |row: &Sensitivity| -> Option<SensitivityRerun> { Some(row.reruns.as_ref()?[side].clone()) };
        let about = format!("{} with the parameter half_last_digit {where_to}, by a run", of.shift());
        add(
            Variable::quantity(&format!("shift_{name}"), "s", &about),
            f64::NAN,
            &|row| rerun(row)?.shift,
        );
        let outcome = Variable::words(&format!("outcome_{name}"), "what that run came to", outcomes.clone());
        add(outcome, -1.0, &|row| Some(f64::from(rerun(row)?.outcome as i8)));
        let sticks = Variable::count(
            &format!("sticks_{name}"),
            "number of sticks of that run; -1 without one",
        );
        add(sticks, -1.0, &|row| Some(rerun(row)?.sticks? as f64));
    }
    let about = "whether these runs differ from what time_sensitivity says by more than a tenth, or in their events";
    let words = [(-1, "unknown"), (0, "linear"), (1, "nonlinear")];
    add(Variable::code("nonlinear", about, &words), -1.0, &|row| {
        row.nonlinear().map(|is| f64::from(u8::from(is)))
    });
}

/// Digits of the least known exact time, as in the table of the file.
pub fn least_digits(exact: &OracleSolution) -> u32 {
    let digits = (0..exact.report.events.len()).map(|index| exact.digits_of_event(index).max(1));
    digits.min().unwrap_or(exact.digits)
}

/// The events of the exact solution as CSV. They have the state after each event if the case has the paper's letters,
/// else the mode.
fn csv(has_letters: bool, exact: &OracleSolution) -> String {
    let mut text = String::new();
    for (index, event) in exact.report.events.iter().enumerate() {
        let digits = exact.digits_of_event(index).max(1) as usize;
        let mut line = vec![
            ("time", event.time.to_decimal(digits)),
            ("kind", event.kind.name().to_owned()),
        ];
        match has_letters {
            true => {
                let state = event.state.components().into_iter();
                line.extend(state.map(|(name, value)| (name, value.to_decimal(digits))));
            }
            false => line.push(("mode_after", event.mode_after.name().to_owned())),
        }
        let (names, values): (Vec<&str>, Vec<String>) = line.into_iter().unzip();
        if index == 0 {
            text += &(names.join(",") + "\n");
        }
        text += &(values.join(",") + "\n");
    }
    text
}
